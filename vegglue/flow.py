"""The nouns of the flow: a Problem (everything the equations need), a State (what they are solved for), their residual.

    dh/dt + d(hu)/dx + d(hv)/dy = 0
    du/dt + u du/dx + v du/dy + g dz_s/dx + k |U| u - div(h nu grad u)/h = f        (v alike)

with k = g / (C^2 h) [1/m] from the friction laws where all of a cell is wet. A state of m members is one array (nx, 3,
ny, m): level at cell centres, v on the south face of each cell (row 0 unused: walls and side inflows set it), u on the
east face of each cell.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vegglue import canopy, easing, kernels, roughness
from vegglue.acting import Bare, closures, push, stages_of, stand_values
from vegglue.effect import Acting, Ground
from vegglue.ground import rows

Array = NDArray[np.float64]
LEVEL, ACROSS, ALONG = 0, 1, 2


@dataclass(frozen=True)
class Inflow:
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
class Plants:
    """Vegetated cells (column, row) and their values per cell and member: phi [-], h_d [m], C_b [m^1/2/s].

    law: of each cell, an index into canopy.LAWS; Baptist's when empty.
    """

    column: NDArray[np.int64]
    row: NDArray[np.int64]
    phi: Array
    canopy_height: Array
    bare_chezy: Array
    law: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))


@dataclass(frozen=True)
class Problem:
    """One experiment for m members on one grid: bed (nx, ny) [m], friction classes, plants, boundaries, viscosity
    [m2/s].

    lift (nx, ny, m) or empty: by how much members' beds lie higher [m]; source (nx, ny, m) or empty: water that enters
    from above or below, without momentum [m/s]; acting: effects at work in the flow and its readings.
    """

    dx: float
    dy: float
    bed: Array
    friction_class: NDArray[np.int64]
    law: NDArray[np.int64]
    coefficient: Array
    plants: Plants
    viscosity: Array
    inflows: tuple[Inflow, ...]
    outlet: NDArray[np.bool_]
    outlet_level: Array
    film: float = 0.01
    log_argument_minimum: float = 1.3
    phi_proportional: bool = False
    smallest_shear_depth: bool = False
    lift: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    source: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    acting: tuple[Acting, ...] = ()
    ground: Ground | None = None

    @property
    def shape(self) -> tuple[int, int]:
        return self.bed.shape[0], self.bed.shape[1]

    @cached_property
    def reach(self) -> Array:
        """Half the range of the bed across the flow within each cell, (nx, ny) [m], at least four films.

        Along x the surface falls with the bed, so that a slope there does not make a cell deep and shallow at once.
        """
        rise = np.gradient(self.bed, axis=1) if self.shape[1] > 1 else np.zeros_like(self.bed)
        return np.maximum(0.5 * np.abs(rise), 4.0 * self.film)

    @property
    def members(self) -> int:
        return self.outlet_level.size


@dataclass(frozen=True)
class Faces:
    """What a state means on the grid: depths [m] at cells, faces, corners; velocities [m/s] and fluxes [m2/s] on
    faces.
    """

    level: Array
    cell: Array
    face_x: Array
    face_y: Array
    corner: Array
    u: Array
    v: Array
    flux_x: Array
    flux_y: Array


@dataclass(frozen=True)
class FlowFields:
    """One member at cell centres, (nx, ny): bed and level [m], depth [m], u and v [m/s]; NaN where dry."""

    x: Array
    y: Array
    bed: Array
    depth: Array
    level: Array
    u: Array
    v: Array


def take(problem: Problem, members: NDArray[np.int64]) -> Problem:
    """The same problem for some of its members (an index array; an index may repeat)."""
    pick = lambda values: np.ascontiguousarray(values[..., members])  # noqa: E731
    plants = problem.plants
    return replace(
        problem,
        coefficient=pick(problem.coefficient),
        plants=replace(
            plants, phi=pick(plants.phi), canopy_height=pick(plants.canopy_height), bare_chezy=pick(plants.bare_chezy)
        ),
        viscosity=pick(problem.viscosity),
        inflows=tuple(
            replace(
                inflow,
                discharge=pick(inflow.discharge),
                spread=pick(inflow.spread) if inflow.spread.shape[-1] > 1 else inflow.spread,
            )
            for inflow in problem.inflows
        ),
        outlet_level=pick(problem.outlet_level),
        lift=pick(problem.lift) if problem.lift.size else problem.lift,
        source=pick(problem.source) if problem.source.size else problem.source,
        acting=tuple(
            replace(one, values={name: pick(value) for name, value in one.values.items()}) for one in problem.acting
        ),
    )


def crop(problem: Problem, south: int, north: int) -> Problem:
    """The rows south..north-1 of a problem, with walls beside them; inflows through a side cut off must not exist."""
    plants = problem.plants
    inside = (plants.row >= south) & (plants.row < north)
    kept = Plants(
        plants.column[inside],
        plants.row[inside] - south,
        plants.phi[inside],
        plants.canopy_height[inside],
        plants.bare_chezy[inside],
        plants.law[inside] if plants.law.size else plants.law,
    )
    inflows = tuple(_cropped(inflow, south, north) if inflow.side == "west" else inflow for inflow in problem.inflows)
    return replace(
        problem,
        bed=np.ascontiguousarray(problem.bed[:, south:north]),
        friction_class=np.ascontiguousarray(problem.friction_class[:, south:north]),
        plants=kept,
        inflows=inflows,
        outlet=problem.outlet[south:north],
        lift=np.ascontiguousarray(problem.lift[:, south:north]),
        source=np.ascontiguousarray(problem.source[:, south:north]),
        ground=None if problem.ground is None else rows(problem.ground, south, north),
    )


def _cropped(inflow: Inflow, south: int, north: int) -> Inflow:
    start, stop = max(inflow.start, south), min(inflow.stop, north)
    spread = inflow.spread[start - inflow.start : stop - inflow.start] if len(inflow.spread) > 1 else inflow.spread
    return replace(inflow, start=start - south, stop=stop - south, spread=spread)


def _side_fluxes(problem: Problem, depth: Array) -> tuple[Array, Array, Array]:
    """q = Q w / (sum w * width) [m2/s] into the west (ny, m), south and north (nx, m) side, w = h^(5/3) or 1."""
    (nx, ny), m = problem.shape, problem.members
    fluxes = {"west": np.zeros((ny, m)), "south": np.zeros((nx, m)), "north": np.zeros((nx, m))}
    beside = {"west": depth[0], "south": depth[:, 0], "north": depth[:, -1]}
    for inflow in problem.inflows:
        part = slice(inflow.start, inflow.stop)
        fluxes[inflow.side][part] += _flux(problem, inflow, beside[inflow.side][part])
    return fluxes["west"], fluxes["south"], fluxes["north"]


def _flux(problem: Problem, inflow: Inflow, depth: Array) -> Array:
    """q [m2/s] in each cell of an inflow, of their depths (cell, m)."""
    width = problem.dy if inflow.side == "west" else problem.dx
    weight = (depth ** (5.0 / 3.0) if inflow.by_conveyance else np.ones_like(depth)) * inflow.spread
    return np.asarray(inflow.discharge * weight / (weight.sum(axis=0) * width))


def _join(problem: Problem, out: Array, u: Array, depth: Array) -> None:
    """Add c (u - u_in) / dy to R_u (nx, 3, ny, m) beside inflows through the sides, c their speed: what joins has to be
    brought from its own u_in to that of the flow. Speeds of an east face are those of both its cells.
    """
    for inflow in problem.inflows:
        if inflow.side == "west":
            continue
        row, part = 0 if inflow.side == "south" else -1, slice(inflow.start, inflow.stop)
        entering, brought = np.zeros((2, problem.shape[0] + 1, problem.members))
        entering[:-1][part] = _flux(problem, inflow, depth[part, row])
        brought[:-1][part] = entering[:-1][part] ** 2 / depth[part, row] * inflow.along
        h = np.concatenate([depth[:, row], depth[-1:, row]])
        both = problem.dy * (h[:-1] + h[1:])
        missing = (entering[:-1] + entering[1:]) * u[:, row] - (brought[:-1] + brought[1:])
        out[:, ALONG, row] += missing / both


def storage(problem: Problem, level: Array) -> Array:
    """dh/dz_s of every cell [-], (nx, ny, m): the share of it that is wet."""
    above = level - problem.bed[:, :, None] - 0.1 * problem.film
    if problem.lift.size:
        above = above - problem.lift
    reach = problem.reach[:, :, None]
    return np.clip(0.5 * (above + reach) / reach, 0.0, 1.0)


def faces(problem: Problem, state: Array) -> Faces:
    """Depths, velocities and fluxes of a state (nx, 3, ny, m), boundaries included."""
    level = np.ascontiguousarray(state[:, LEVEL])
    cell, face_x, face_y, corner = _depths(problem, level)
    u, v = kernels.velocities(state, 0, problem.shape[0], cell, *_side_fluxes(problem, cell))
    return Faces(level, cell, face_x, face_y, corner, u, v, face_x * u, face_y * v)


def _depths(problem: Problem, level: Array) -> tuple[Array, Array, Array, Array]:
    bed, lift, reach = problem.bed, problem.lift, problem.reach
    return kernels.depths(level, bed, lift, reach, problem.outlet_level, problem.film, problem.smallest_shear_depth)


def bed_drag(problem: Problem, depth: Array) -> Array:
    """k [1/m] of the class laws at cell centres, see `roughness`; depth (nx, ny, m) [m]."""
    classes = problem.friction_class, problem.law, problem.coefficient
    return roughness.class_drag(depth, problem.reach, *classes, problem.log_argument_minimum, problem.film)


def drag(problem: Problem, depth: Array, plants: tuple[Array, Array] | None = None) -> Array:
    """Friction k [1/m] of classes and plants at cell centres, so that the force is -k |U| u; depth (nx, ny, m) [m].

    plants: phi and canopy height (cell, m) when they are not those of the problem.
    """
    rate = bed_drag(problem, depth)
    _plant(problem, rate, depth, plants or (problem.plants.phi, problem.plants.canopy_height))
    return rate


def _plant(problem: Problem, rate: Array, depth: Array, plants: tuple[Array, Array]) -> None:
    law = problem.plants.law
    canopy.plant_drag(
        rate,
        depth,
        problem.plants.column,
        problem.plants.row,
        law if law.size else np.zeros_like(problem.plants.row),
        *plants,
        problem.plants.bare_chezy,
        problem.phi_proportional,
    )


def closed(problem: Problem, state: Array, depth: Array) -> tuple[Array, Array, dict[str, Array]]:
    """Friction rate [1/m] and viscosity [m2/s] (nx, ny, m), momentum fluxes and forces by name, effects included."""
    stages = stages_of(problem.acting)
    plants = (problem.plants.phi, problem.plants.canopy_height)
    if "plants" in stages and problem.ground is not None:
        column, row = problem.plants.column, problem.plants.row
        plants = stand_values(problem.acting, problem.ground, column, row, plants, state, depth)
    rate = bed_drag(problem, depth)
    if problem.ground is None or not stages & {"resistance", "exchange", "force"}:
        _plant(problem, rate, depth, plants)
        return rate, np.ascontiguousarray(np.broadcast_to(problem.viscosity, depth.shape)), {}
    of_bed = rate.copy()
    _plant(problem, rate, depth, plants)
    bare = Bare(depth, rate, of_bed, problem.viscosity, problem.smallest_shear_depth)
    found = closures(problem.acting, problem.ground, state, bare)
    return found.rate, found.viscosity, found.momentum


def residual(problem: Problem, state: Array) -> Array:
    """R(state), (nx, 3, ny, m): the negative rate of change of level [m/s], v and u [m/s2]; zero when steady."""
    depth = _depth(problem, state)
    return _residual(problem, state, depth, _side_fluxes(problem, depth), *closed(problem, state, depth))


def eased(problem: Problem, state: Array, slope: Array) -> Array:
    """R(state) with its rows of thin water as chord steps need them, see `easing`; zero when R is.

    slope (nx, 3, ny, 1): `friction_slope` of the state whose factors are in use.
    """
    depth = _depth(problem, state)
    rate, viscosity, momentum = closed(problem, state, depth)
    sides = _side_fluxes(problem, depth)
    out = _residual(problem, state, depth, sides, rate, viscosity, momentum)
    easing.ease(out, state, depth, rate, sides[0], slope, problem.film)
    return out


def face_depths(problem: Problem, state: Array) -> Array:
    """Depths [m] of the faces that velocities of a state stand on, (nx, 3, ny, m); infinite where `carry` has none."""
    level = np.ascontiguousarray(state[:, LEVEL])
    _, along, across, _ = _depths(problem, level)
    found = np.full_like(state, np.inf)
    found[:-1, ALONG], found[:, ACROSS, 1:] = along[1:-1], across[:, 1:-1]
    return found


def thickness(problem: Problem, state: Array) -> tuple[Array, Array]:
    """Of one member, (nx, 3, ny): depths of its faces [m], and how its velocities answer to levels there [1/s]."""
    thick = np.ascontiguousarray(face_depths(problem, state)[..., 0])
    return thick, easing.answers(state, problem.bed, problem.lift, problem.reach, problem.film, thick)


def thin_places(problem: Problem, state: Array, thick: Array) -> NDArray[np.bool_]:
    """Where water is thin, (nx, 3, ny): cells in any member of a state, faces there or at the centre."""
    return np.asarray(easing.thin_places(state, problem.bed, problem.lift, problem.reach, problem.film, thick))


def carry(
    problem: Problem, values: Array, state: Array, thin: NDArray[np.bool_], thick: Array, back: bool = False
) -> None:
    """Velocities or their rates (nx, 3, ny, m) times rho of thin faces at the levels of a state, or back; in place."""
    easing.stretch(values, state, thin, problem.bed, problem.lift, problem.reach, problem.film, thick, back)


def correction(
    problem: Problem, step: NDArray[np.float32], state: Array, thin: NDArray[np.bool_], thick: Array
) -> Array:
    """Largest change of each member (m,) [m, m/s] by a step of what is carried, in proportion to depth where thin."""
    bed, lift, reach, film = problem.bed, problem.lift, problem.reach, problem.film
    return np.asarray(easing.correction(step, state, thin, bed, lift, reach, film, thick))


def friction_slope(problem: Problem, state: Array) -> Array:
    """d(k |U| u)/du and d(k |U| v)/dv [1/s] where u and v stand in a state, (nx, 3, ny, m)."""
    depth = _depth(problem, state)
    rate, _, _ = closed(problem, state, depth)
    return easing.friction_slope(state, depth, rate, _side_fluxes(problem, depth)[0])


def _depth(problem: Problem, state: Array) -> Array:
    return kernels.cell_depth(state, problem.bed, problem.lift, problem.reach, problem.film)


def _residual(
    problem: Problem,
    state: Array,
    depth: Array,
    sides: tuple[Array, Array, Array],
    rate: Array,
    viscosity: Array,
    momentum: dict[str, Array],
) -> Array:
    out = kernels.rates(
        state,
        problem.bed,
        problem.lift,
        problem.reach,
        rate,
        viscosity,
        *sides,
        problem.outlet,
        problem.outlet_level,
        problem.film,
        problem.smallest_shear_depth,
        problem.dx,
        problem.dy,
    )
    _join(problem, out, state[:, ALONG], depth)
    if problem.source.size:
        # What enters from the side has to be brought to speed.
        out[:, LEVEL] -= problem.source
        out[:, ALONG] += problem.source / depth * state[:, ALONG]
    if momentum:
        push(out, momentum, depth, problem.film, problem.dx, problem.dy)
    return out
