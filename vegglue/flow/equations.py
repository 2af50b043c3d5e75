"""The residual of the shallow-water equations at a state, and what chord steps need of it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.flow import kernels, thin_water, wet_and_dry
from vegglue.flow.closures import EMPTY, closed
from vegglue.flow.problem import ACROSS, ALONG, LEVEL, InflowSegment, Problem
from vegglue.resistance.physical_constants import FILM_ON_LAND


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


def _side_fluxes(problem: Problem, depth: Array) -> tuple[Array, Array, Array]:
    """q = Q w / (sum w * width) [m2/s] into the west (ny, m), south and north (nx, m) side, w = h^(5/3) or 1."""
    (nx, ny), m = problem.shape, problem.members
    fluxes = {"west": np.zeros((ny, m)), "south": np.zeros((nx, m)), "north": np.zeros((nx, m))}
    beside = {"west": depth[0], "south": depth[:, 0], "north": depth[:, -1]}
    for inflow in problem.inflows:
        part = slice(inflow.start, inflow.stop)
        fluxes[inflow.side][part] += _flux(problem, inflow, beside[inflow.side][part])
    return fluxes["west"], fluxes["south"], fluxes["north"]


def _flux(problem: Problem, inflow: InflowSegment, depth: Array) -> Array:
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
    above = level - problem.bed[:, :, None] - FILM_ON_LAND * problem.film
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
    return wet_and_dry.depths(level, bed, lift, reach, problem.outlet_level, problem.film, problem.smallest_shear_depth)


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
    thin_water.ease(out, state, depth, rate, sides[0], slope, problem.film)
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
    return thick, thin_water.answers(state, problem.bed, problem.lift, problem.reach, problem.film, thick)


def where_thin(problem: Problem, state: Array, thick: Array) -> NDArray[np.bool_]:
    """Where water is thin, (nx, 3, ny): cells in any member of a state, faces there or at the centre."""
    return np.asarray(thin_water.thin_places(state, problem.bed, problem.lift, problem.reach, problem.film, thick))


def carry_thin(
    problem: Problem, values: Array, state: Array, thin: NDArray[np.bool_], thick: Array, back: bool = False
) -> None:
    """Velocities or their rates (nx, 3, ny, m) times rho of thin faces at the levels of a state, or back; in place."""
    thin_water.stretch(values, state, thin, problem.bed, problem.lift, problem.reach, problem.film, thick, back)


def largest_correction(
    problem: Problem, step: NDArray[np.float32], state: Array, thin: NDArray[np.bool_], thick: Array
) -> Array:
    """Largest change of each member (m,) [m, m/s] by a step of what is carried, in proportion to depth where thin."""
    bed, lift, reach, film = problem.bed, problem.lift, problem.reach, problem.film
    return np.asarray(thin_water.correction(step, state, thin, bed, lift, reach, film, thick))


def slope_of_friction(problem: Problem, state: Array) -> Array:
    """d(k |U| u)/du and d(k |U| v)/dv [1/s] where u and v stand in a state, (nx, 3, ny, m)."""
    depth = _depth(problem, state)
    rate, _, _ = closed(problem, state, depth)
    return thin_water.friction_slope(state, depth, rate, _side_fluxes(problem, depth)[0])


def _depth(problem: Problem, state: Array) -> Array:
    return wet_and_dry.cell_depth(state, problem.bed, problem.lift, problem.reach, problem.film)


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
        push_momentum(out, momentum, depth, problem.film, problem.dx, problem.dy)
    return out


def push_momentum(out: Array, momentum: dict[str, Array], depth: Array, film: float, dx: float, dy: float) -> None:
    """Take forces and the divergence of momentum fluxes from a residual (nx, 3, ny, m), see kernels.push."""
    x, y, xx, xy, yy = (momentum.get(name, EMPTY) for name in ("x", "y", "xx", "xy", "yy"))
    kernels.push(out, depth, x, y, xx, xy, yy, film, dx, dy)
