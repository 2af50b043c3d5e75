"""How much longer or shorter cells of a bent grid are than on its centreline.

On a grid along a centreline, s along it and n across, positive to the left, a length ds is J ds off the centreline,
J = 1 - n kappa, kappa its curvature [1/m], positive where it turns left.
"""

from typing import NamedTuple

from vegglue.arrays import Array
from vegglue.compilation import compiled


class Bend(NamedTuple):
    """Curvature kappa of the centreline in each column of cells (nx,) and at west-east faces (nx + 1,) [1/m]; n of the
    south edge of the grid and width of its rows [m]. A tuple, as compiled loops take it.
    """

    at_cells: Array
    at_faces: Array
    south: float
    dy: float


@compiled
def at_cell(bend: Bend | None, column: int, rows: float) -> float:
    """J [-] in a column of cells, so many rows north of the south edge; 1 on a straight grid."""
    if bend is None:
        return 1.0
    return 1.0 - bend.at_cells[column] * (bend.south + rows * bend.dy)


@compiled
def at_face(bend: Bend | None, face: int, rows: float) -> float:
    """J [-] at the west-east faces, so many rows north of the south edge; 1 on a straight grid."""
    if bend is None:
        return 1.0
    return 1.0 - bend.at_faces[face] * (bend.south + rows * bend.dy)


@compiled
def columns_of(bend: Bend | None, first: int, stop: int) -> Bend | None:
    """The bend of the columns first .. stop - 1."""
    if bend is None:
        return None
    return Bend(bend.at_cells[first:stop], bend.at_faces[first : stop + 1], bend.south, bend.dy)
