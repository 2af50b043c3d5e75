"""The problem of the flow, all that its equations need, and the layout of a state, what they are solved for.

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

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.channel_geometry import rows_of
from vegglue.effects.active_effect import ActiveEffect
from vegglue.effects.surroundings import ChannelGeometry
from vegglue.flow.kernels import Bend

LEVEL, ACROSS, ALONG = 0, 1, 2
# An array (nx, ny, m) of something that is not there.
EMPTY = np.zeros((0, 0, 0))
ProblemPart = TypeVar("ProblemPart", "BedFriction", "VegetatedCells", "SideWalls", "InflowSegment", "Boundaries")


@dataclass(frozen=True)
class BedFriction:
    """Friction of the bed: class of each cell (nx, ny), law of each class (an index, see `bed_laws`), and its
    coefficient for each member (class, m) [s m^(-1/3), m or m^1/2/s].

    bank_argument_minimum: the floor of the bank law, below which 12 h/k_s is not let fall [-].
    """

    friction_class: NDArray[np.int64]
    law: NDArray[np.int64]
    coefficient: Array
    bank_argument_minimum: float


@dataclass(frozen=True)
class VegetatedCells:
    """Vegetated cells (column, row), the law of each (an index into PLANT_LAWS), the share of each that plants cover
    [-], and their values per cell and member: phi [-], h_d [m], C_b [m^1/2/s].

    proportional: phi h/h_d in place of phi where plants stand out of the water.
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
    """Rough vertical walls along the south and the north side of the grid: length of the wall over that of the cell
    beside it, 1 on a straight grid, 0 where none stands, (nx,) [-], and c_w / dy of each member (m,), see
    `wall_coefficient` [1/m]; all empty without such walls.
    """

    south: Array
    north: Array
    rate: Array


SMOOTH_WALLS = SideWalls(np.zeros(0), np.zeros(0), np.zeros(0))


@dataclass(frozen=True)
class InflowSegment:
    """Discharge [m3/s] of each member through the cells start..stop-1 of one side ('west', 'south' or 'north').

    spread: what conveyance is multiplied by in each cell, (cell, m) or (cell, 1) [-]; along: through a side, velocity
    along x over that through the side, the cotangent of the angle it joins at [-].
    """

    side: str
    start: int
    stop: int
    discharge: Array
    by_conveyance: bool = True
    spread: Array = field(default_factory=lambda: np.ones((1, 1)))
    along: float = 0.0


@dataclass(frozen=True)
class Boundaries:
    """What enters and leaves: inflows, rows of the east side that are the outlet (ny,), the level there (m,) [m].

    lateral_inflow (nx, ny, m) or empty: water that enters from above or below, without momentum [m/s].
    """

    inflows: tuple[InflowSegment, ...]
    outlet: NDArray[np.bool_]
    outlet_level: Array
    lateral_inflow: Array = field(default_factory=lambda: EMPTY)


@dataclass(frozen=True)
class Problem:
    """One experiment for m members on one grid of cells dx by dy [m]: bed (nx, ny) [m], its friction, plants, eddy
    viscosity (m,) [m2/s], boundaries, and the effects at work in the flow and its readings.

    film: a tenth of it stays on dry land [m]; smallest_shear_depth: whether shear acts over the smallest depth of the
    cells around a point, not the mean; bed_rise (nx, ny, m) or empty: by how much members' beds lie higher [m];
    geometry: what effects see of the channel, none without effects; walls: friction of the sides of the grid; bend: the
    curvature of a grid along a centreline, none of a straight one; half_range: of rows cut out, that of the whole.
    """

    dx: float
    dy: float
    bed: Array
    friction: BedFriction
    plants: VegetatedCells
    viscosity: Array
    boundaries: Boundaries
    film: float
    smallest_shear_depth: bool
    bed_rise: Array = field(default_factory=lambda: EMPTY)
    effects: tuple[ActiveEffect, ...] = ()
    geometry: ChannelGeometry | None = None
    walls: SideWalls = SMOOTH_WALLS
    bend: Bend | None = None
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
        rows cut out it is what it was in the whole, where the cells beside them are known.
        """
        if self.half_range.size:
            return self.half_range
        step = np.gradient(self.bed, axis=1) if self.shape[1] > 1 else np.zeros_like(self.bed)
        return np.maximum(0.5 * np.abs(step), 4.0 * self.film)

    @property
    def wetting(self) -> tuple[Array, Array, Array, float]:
        """What depths are made of, in the order in which the compiled loops take it."""
        return self.bed, self.bed_rise, self.bed_half_range, self.film


def above_bed(problem: Problem, level: Array) -> Array:
    """Heights of levels (nx, ny, m) above the members' own beds [m], below 0 on land."""
    above = level - problem.bed[:, :, None]
    return above - problem.bed_rise if problem.bed_rise.size else above


def stretch_of_cells(problem: Problem) -> Array:
    """J (nx, ny, 1) [-], the length of each cell over dx; (1, 1, 1) on a straight grid."""
    if problem.bend is None:
        return np.ones((1, 1, 1))
    y = problem.bend.south + (np.arange(problem.shape[1]) + 0.5) * problem.dy
    return np.asarray((1.0 - problem.bend.at_cells[:, None] * y)[..., None])


def take(problem: Problem, members: NDArray[np.int64]) -> Problem:
    """The same problem for some of its members (an index array; an index may repeat)."""
    boundaries = _taken(problem.boundaries, members, "outlet_level", "lateral_inflow")
    return replace(
        problem,
        friction=_taken(problem.friction, members, "coefficient"),
        plants=_taken(problem.plants, members, "phi", "canopy_height", "bare_chezy"),
        viscosity=_some(problem.viscosity, members),
        boundaries=replace(boundaries, inflows=tuple(_inflow_of(one, members) for one in boundaries.inflows)),
        bed_rise=_some(problem.bed_rise, members),
        walls=_taken(problem.walls, members, "rate"),
        effects=tuple(
            replace(active, values={name: _some(value, members) for name, value in active.values.items()})
            for active in problem.effects
        ),
    )


def crop(problem: Problem, south: int, north: int) -> Problem:
    """The rows south..north-1 of a problem, with walls beside them; inflows through a side cut off must not exist."""

    def cut(values: Any) -> Any:
        return np.ascontiguousarray(values[:, south:north])

    return replace(
        problem,
        bed=cut(problem.bed),
        half_range=cut(problem.bed_half_range),
        friction=replace(problem.friction, friction_class=cut(problem.friction.friction_class)),
        plants=_plants_between(problem.plants, south, north),
        boundaries=replace(
            problem.boundaries,
            inflows=tuple(_inflow_between(one, south, north) for one in problem.boundaries.inflows),
            outlet=problem.boundaries.outlet[south:north],
            lateral_inflow=cut(problem.boundaries.lateral_inflow),
        ),
        bed_rise=cut(problem.bed_rise),
        walls=_walls_between(problem.walls, south == 0, north == problem.shape[1]),
        geometry=None if problem.geometry is None else rows_of(problem.geometry, south, north),
        bend=None if problem.bend is None else problem.bend._replace(south=problem.bend.south + south * problem.dy),
    )


def _some(values: Array, members: NDArray[np.int64]) -> Array:
    """Some members of an array (.., m), in one piece of memory; nothing of what is not there."""
    return np.ascontiguousarray(values[..., members]) if values.shape[-1] else values


def _taken(part: ProblemPart, members: NDArray[np.int64], *names: str) -> ProblemPart:
    """A part of a problem of which some fields (.., m) keep some members only."""
    kept: dict[str, Any] = {name: _some(getattr(part, name), members) for name in names}
    return replace(part, **kept)


def _inflow_of(inflow: InflowSegment, members: NDArray[np.int64]) -> InflowSegment:
    alike = inflow.spread.shape[-1] == 1
    return _taken(inflow, members, "discharge") if alike else _taken(inflow, members, "discharge", "spread")


def _inflow_between(inflow: InflowSegment, south: int, north: int) -> InflowSegment:
    if inflow.side != "west":
        return inflow
    start, stop = max(inflow.start, south), min(inflow.stop, north)
    spread = inflow.spread[start - inflow.start : stop - inflow.start] if len(inflow.spread) > 1 else inflow.spread
    return replace(inflow, start=start - south, stop=stop - south, spread=spread)


def _walls_between(walls: SideWalls, south: bool, north: bool) -> SideWalls:
    """The walls of the sides that are kept; land beside rows cut out does not drag."""
    return replace(
        walls,
        south=walls.south if south else np.zeros_like(walls.south),
        north=walls.north if north else np.zeros_like(walls.north),
    )


def _plants_between(plants: VegetatedCells, south: int, north: int) -> VegetatedCells:
    inside = (plants.row >= south) & (plants.row < north)
    names = ("column", "row", "law", "share", "phi", "canopy_height", "bare_chezy")
    kept = replace(plants, **{name: getattr(plants, name)[inside] for name in names})
    return replace(kept, row=kept.row - south)


def joined(problems: Sequence[Problem]) -> Problem:
    """One problem with all members: what is alike, as the grid and its classes, is taken from the first."""
    first = problems[0]
    plants: dict[str, Any] = {
        name: _side_by_side([getattr(one.plants, name) for one in problems])
        for name in ("phi", "canopy_height", "bare_chezy")
    }
    return replace(
        first,
        friction=replace(first.friction, coefficient=_side_by_side([one.friction.coefficient for one in problems])),
        plants=replace(first.plants, **plants),
        viscosity=_side_by_side([one.viscosity for one in problems]),
        boundaries=_boundaries([one.boundaries for one in problems], [one.members for one in problems]),
        bed_rise=_where_any([one.bed_rise for one in problems], [one.members for one in problems]),
        walls=replace(first.walls, rate=_side_by_side([one.walls.rate for one in problems])),
        effects=_effects(problems),
        geometry=next((one.geometry for one in problems if one.geometry is not None), None),
    )


def _boundaries(parts: Sequence[Boundaries], members: Sequence[int]) -> Boundaries:
    inflows = zip(*(one.inflows for one in parts), strict=True)
    return replace(
        parts[0],
        inflows=tuple(_inflow(alike, members) for alike in inflows),
        outlet_level=_side_by_side([one.outlet_level for one in parts]),
        lateral_inflow=_where_any([one.lateral_inflow for one in parts], members),
    )


def _inflow(parts: Sequence[InflowSegment], members: Sequence[int]) -> InflowSegment:
    cells = max(len(one.spread) for one in parts)
    spread = [np.broadcast_to(one.spread, (cells, count)) for one, count in zip(parts, members, strict=True)]
    return replace(parts[0], discharge=_side_by_side([one.discharge for one in parts]), spread=_side_by_side(spread))


def _effects(problems: Sequence[Problem]) -> tuple[ActiveEffect, ...]:
    """Effects of each problem, off in the members of all others."""
    found, start, total = list[ActiveEffect](), 0, sum(one.members for one in problems)
    for one in problems:
        own = slice(start, start + one.members)
        for active in one.effects:
            amplitude = active.effect.amplitude
            values = {name: np.full(total, value[0]) for name, value in active.values.items()}
            values[amplitude.name][:] = amplitude.off
            for name, value in active.values.items():
                values[name][own] = value
            found.append(replace(active, values=values))
        start += one.members
    return tuple(found)


def _where_any(parts: Sequence[Array], members: Sequence[int]) -> Array:
    """Arrays (nx, ny, m), 0 of a problem without one; empty where none has one."""
    shape = next((one.shape[:2] for one in parts if one.size), None)
    if shape is None:
        return EMPTY
    return _side_by_side(
        [one if one.size else np.zeros((*shape, count)) for one, count in zip(parts, members, strict=True)]
    )


def _side_by_side(parts: Sequence[Array]) -> Array:
    return np.concatenate(parts, axis=-1)
