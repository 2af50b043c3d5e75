"""The flow problem: all that the shallow-water equations need, and the layout of a state.

    dh/dt + d(hu)/dx + d(hv)/dy = 0
    du/dt + u du/dx + v du/dy + g dz_s/dx + k |U| u - [dT_xx/dx + dT_xy/dy] / h = f        (v alike)
    T_xx = 2 h nu du/dx,  T_xy = h nu (du/dy + dv/dx)

with k = g / (C^2 h) [1/m] from the friction laws where all of a cell is wet. On a grid along a centreline of curvature
kappa, x along it and y across, J = 1 - y kappa (Smith and McLean 1984, doi:10.1029/WR020i009p01301; not checked against
it, tests compare each term with the same equations on the map), they are

    dh/dt + [d(hu)/dx + d(J hv)/dy] / J = 0
    du/dt + (u/J) du/dx + v du/dy - (kappa/J) u v + (g/J) dz_s/dx + k |U| u = [dT_xx/dx / J + d(J^2 T_xy)/dy / J^2] / h
    dv/dt + (u/J) dv/dx + v dv/dy + (kappa/J) u^2 + g dz_s/dy + k |U| v
                                            = [dT_xy/dx / J + d(J T_yy)/dy / J + (kappa/J) T_xx] / h
    T_xx = 2 h nu (du/dx - kappa v) / J,  T_xy = h nu [du/dy + (dv/dx + kappa u) / J],  T_yy = 2 h nu dv/dy

A state of m members is one array (nx, 3, ny, m): level at cell centres, v on the south face of each cell (row 0 unused:
walls and side inflows set it), u on the east face of each cell.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.channel_geometry import rows_of
from vegglue.effects.active_effect import ActiveEffect
from vegglue.effects.surroundings import ChannelGeometry
from vegglue.flow.kernels import Bend

LEVEL, ACROSS, ALONG = 0, 1, 2
# An array (nx, ny, m) of something that is absent.
EMPTY = np.zeros((0, 0, 0))


@dataclass(frozen=True)
class BedFriction:
    """Friction of the bed, see `bed_laws.class_drag` for its fields."""

    friction_class: NDArray[np.int64]
    law: NDArray[np.int64]
    coefficient: Array
    bank_argument_minimum: float


@dataclass(frozen=True)
class VegetatedCells:
    """Friction of plants in their cells; fields not named here as in `plant_laws.plant_drag`.

    Attributes
    ----------
    share
        What they cover of each cell (cell,) [-].
    proportional
        Whether phi h/h_d takes the place of phi if plants stand out of the water.
    """

    column: NDArray[np.int64]
    row: NDArray[np.int64]
    law: NDArray[np.int64]
    share: Array
    phi: Array
    canopy_height: Array
    bare_chezy: Array
    proportional: bool


@dataclass(frozen=True)
class SideWalls:
    """Rough vertical walls along the south and the north side of the grid, and on steps of the bed; all empty without.

    Attributes
    ----------
    south, north
        Length of the wall over that of the cell beside it, 0 without a wall (nx,) [-].
    rate
        c_w / dy (m,) [1/m], see `wall_coefficient`.
    steps
        Walls between rows j and j + 1, their length over that of the lower cell, positive if the south one is lower, 0
        without a step (nx, ny - 1) [-], or empty.
    """

    south: Array
    north: Array
    rate: Array
    steps: Array = field(default_factory=lambda: EMPTY)

    @cached_property
    def faces(self) -> tuple[tuple[int, int, Array], ...]:
        """Of each row beside steps: its number, that of the row above them, and the length of the wall (nx, 1) [-]."""
        found = []
        for south in range(self.steps.shape[1] if self.steps.size else 0):
            length = self.steps[:, south, None]
            sides = ((south, south + 1, np.maximum(length, 0.0)), (south + 1, south, np.maximum(-length, 0.0)))
            found += [side for side in sides if side[2].any()]
        return tuple(found)


SMOOTH_WALLS = SideWalls(np.zeros(0), np.zeros(0), np.zeros(0))


@dataclass(frozen=True)
class InflowSegment:
    """An inflow through one side of the grid."""

    side: str  # "west", "south" or "north"
    # start, stop: it enters by the cells start .. stop - 1 of that side.
    start: int
    stop: int
    discharge: Array  # Q (m,) [m3/s]
    by_conveyance: bool = True  # whether Q is shared over its cells by h^(5/3), not evenly
    # Factor on the share of each cell (cell, m) or (cell, 1) [-]
    spread: Array = field(default_factory=lambda: np.ones((1, 1)))
    # Through a side: velocity along x over that through the side, the cotangent of the angle of the confluence [-]
    along: float = 0.0
    # How high the rim of the hollow that a cell lies in stands over its bed (cell, 1), 0 outside of one [m]
    rim: Array = field(default_factory=lambda: np.zeros((1, 1)))


@dataclass(frozen=True)
class Boundaries:
    """What enters and leaves.

    Attributes
    ----------
    inflows
        Through the sides.
    outlet, outlet_level
        Rows of the east side that are the outlet (ny,), and the level there (m,) [m].
    lateral_inflow
        Water that enters from above or below, without momentum (nx, ny, m) [m/s], or empty.
    """

    inflows: tuple[InflowSegment, ...]
    outlet: NDArray[np.bool_]
    outlet_level: Array
    lateral_inflow: Array = field(default_factory=lambda: EMPTY)


@dataclass(frozen=True)
class Problem:
    """One experiment for m members on one grid."""

    # dx, dy: size of a cell [m]
    dx: float
    dy: float
    bed: Array  # bed level (nx, ny) [m]
    # friction, plants, walls: friction of bed, plants and sides of the grid
    friction: BedFriction
    plants: VegetatedCells
    viscosity: Array  # eddy viscosity (m,) [m2/s]
    boundaries: Boundaries  # what enters and leaves
    film: float  # a tenth of it stays on dry land [m]
    # Whether shear acts over the smallest depth of the cells around a point, not the mean: over a step with a wall it
    # acts above the step alone
    smallest_shear_depth: bool
    # By how much members' beds lie higher (nx, ny, m) [m], or empty
    bed_rise: Array = field(default_factory=lambda: EMPTY)
    effects: tuple[ActiveEffect, ...] = ()  # effects in the flow and its readings
    geometry: ChannelGeometry | None = None  # what effects see of the channel; None without effects
    walls: SideWalls = SMOOTH_WALLS
    bend: Bend | None = None  # curvature of a grid along a centreline; None if it is straight
    # `bed_half_range` where it is known, of rows that were cut out that of the whole grid; else empty
    half_range: Array = field(default_factory=lambda: EMPTY)

    @property
    def shape(self) -> tuple[int, int]:
        """Cells along and across, nx and ny."""
        return self.bed.shape[0], self.bed.shape[1]

    @property
    def members(self) -> int:
        return self.boundaries.outlet_level.size

    @cached_property
    def bed_half_range(self) -> Array:
        """Half the range of the bed across the flow within each cell, (nx, ny) [m], at least four films.

        Along x the surface falls with the bed, so that a slope there does not make a cell deep and shallow at once. Of
        rows cut out it is what it was in the whole, where the cells beside them are known. A step with a wall lies
        between cells, and in none.
        """
        if self.half_range.size:
            return self.half_range
        step = np.gradient(self.bed, axis=1) if self.shape[1] > 1 else np.zeros_like(self.bed)
        if self.walls.steps.any():
            even = np.pad(self.walls.steps == 0.0, ((0, 0), (1, 1)))
            rise = np.pad(np.diff(self.bed, axis=1), ((0, 0), (1, 1))) * even
            step = (rise[:, 1:] + rise[:, :-1]) / np.maximum(even[:, 1:].astype(float) + even[:, :-1], 1.0)
        return np.maximum(0.5 * np.abs(step), 4.0 * self.film)

    @property
    def wetting(self) -> tuple[Array, Array, Array, float]:
        """What depths are made of, in the order in which the compiled loops take it."""
        return self.bed, self.bed_rise, self.bed_half_range, self.film


def above_bed(problem: Problem, level: Array) -> Array:
    """z_s - z_b of the members' own beds (nx, ny, m) [m], below 0 on land.

    Parameters
    ----------
    level : (nx, ny, m) [m]
    """
    above = level - problem.bed[:, :, None]
    return above - problem.bed_rise if problem.bed_rise.size else above


def stretch_of_cells(problem: Problem) -> Array:
    """J (nx, ny, 1) [-], the length of each cell over dx; (1, 1, 1) on a straight grid."""
    if problem.bend is None:
        return np.ones((1, 1, 1))
    y = problem.bend.south + (np.arange(problem.shape[1]) + 0.5) * problem.dy
    return np.asarray((1.0 - problem.bend.at_cells[:, None] * y)[..., None])


def take(problem: Problem, members: NDArray[np.int64]) -> Problem:
    """The problem of some of its members.

    Parameters
    ----------
    members : (n,)
        Their indices, which may repeat.
    """

    def some(values: Array) -> Array:
        return np.ascontiguousarray(values[..., members]) if values.shape[-1] else values  # nothing of what is empty

    plants, boundaries = problem.plants, problem.boundaries
    inflows = tuple(
        replace(
            one, discharge=some(one.discharge), spread=one.spread if one.spread.shape[-1] == 1 else some(one.spread)
        )
        for one in boundaries.inflows
    )
    return replace(
        problem,
        friction=replace(problem.friction, coefficient=some(problem.friction.coefficient)),
        plants=replace(
            plants, phi=some(plants.phi), canopy_height=some(plants.canopy_height), bare_chezy=some(plants.bare_chezy)
        ),
        viscosity=some(problem.viscosity),
        boundaries=replace(
            boundaries,
            inflows=inflows,
            outlet_level=some(boundaries.outlet_level),
            lateral_inflow=some(boundaries.lateral_inflow),
        ),
        bed_rise=some(problem.bed_rise),
        walls=replace(problem.walls, rate=some(problem.walls.rate)),
        effects=tuple(
            replace(active, values={name: some(value) for name, value in active.values.items()})
            for active in problem.effects
        ),
    )


def crop(problem: Problem, south: int, north: int) -> Problem:
    """The rows south .. north - 1, with smooth walls beside them where rows are cut off.

    Parameters
    ----------
    south, north : int
        No inflow may enter through a side that is cut off.
    """

    def cut(values: Any) -> Any:
        return np.ascontiguousarray(values[:, south:north])

    def of_rows(inflow: InflowSegment) -> InflowSegment:
        if inflow.side != "west":
            return inflow
        start, stop = max(inflow.start, south), min(inflow.stop, north)
        spread = inflow.spread[start - inflow.start : stop - inflow.start] if len(inflow.spread) > 1 else inflow.spread
        rim = inflow.rim[start - inflow.start : stop - inflow.start] if len(inflow.rim) > 1 else inflow.rim
        return replace(inflow, start=start - south, stop=stop - south, spread=spread, rim=rim)

    plants, boundaries, walls = problem.plants, problem.boundaries, problem.walls
    inside = (plants.row >= south) & (plants.row < north)
    names = ("column", "row", "law", "share", "phi", "canopy_height", "bare_chezy")
    plants = replace(plants, **{name: getattr(plants, name)[inside] for name in names})
    return replace(
        problem,
        bed=cut(problem.bed),
        half_range=cut(problem.bed_half_range),
        friction=replace(problem.friction, friction_class=cut(problem.friction.friction_class)),
        plants=replace(plants, row=plants.row - south),
        boundaries=replace(
            boundaries,
            inflows=tuple(map(of_rows, boundaries.inflows)),
            outlet=boundaries.outlet[south:north],
            lateral_inflow=cut(boundaries.lateral_inflow),
        ),
        bed_rise=cut(problem.bed_rise),
        walls=replace(  # land beside rows cut out does not drag
            walls,
            south=walls.south if south == 0 else np.zeros_like(walls.south),
            north=walls.north if north == problem.shape[1] else np.zeros_like(walls.north),
            steps=walls.steps[:, south : north - 1] if walls.steps.size else walls.steps,
        ),
        geometry=None if problem.geometry is None else rows_of(problem.geometry, south, north),
        bend=None if problem.bend is None else problem.bend._replace(south=problem.bend.south + south * problem.dy),
    )
