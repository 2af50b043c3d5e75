"""The residual of the shallow-water equations at a state."""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.physical_constants import FILM_ON_LAND
from vegglue.flow import kernels, wet_and_dry
from vegglue.flow.closures import Closures, closures, wall_rates
from vegglue.flow.problem import ALONG, EMPTY, LEVEL, InflowSegment, Problem, above_bed


@dataclass(frozen=True)
class Faces:
    """What a state means on the grid, boundaries included.

    Attributes
    ----------
    level, cell
        Levels and depths of cells (nx, ny, m) [m].
    face_x, face_y, corner
        Depths on west-east faces, south-north faces and corners, shapes as `wet_and_dry.depths` [m].
    u, v, flux_x
        Velocities [m/s] on both kinds of faces, and h u [m2/s] on the former.
    """

    level: Array
    cell: Array
    face_x: Array
    face_y: Array
    corner: Array
    u: Array
    v: Array
    flux_x: Array


def residual(problem: Problem, state: Array) -> Array:
    """R(state) = -d(state)/dt, zero when steady; the equations stand in `problem`.

    Parameters
    ----------
    problem
        Of m members.
    state
        (nx, 3, ny, m): level [m], v and u [m/s].

    Returns
    -------
    array
        (nx, 3, ny, m) [m/s, m/s2 and m/s2].
    """
    depth = cell_depths(problem, state)
    return residual_of(problem, state, depth, side_fluxes(problem, depth), closures(problem, state, depth))


def residual_of(
    problem: Problem, state: Array, depth: Array, sides: tuple[Array, Array, Array], closed: Closures
) -> Array:
    """R(state) as `residual`, of what is known of it already.

    Parameters
    ----------
    state, depth : (nx, 3, ny, m), (nx, ny, m) [m]
    sides, closed
        See `side_fluxes` and `closures`.
    """
    boundaries = problem.boundaries
    out = kernels.rates(
        state,
        *problem.wetting,
        problem.smallest_shear_depth,
        closed.rate,
        closed.viscosity,
        *sides,
        boundaries.outlet,
        boundaries.outlet_level,
        problem.dx,
        problem.dy,
        problem.bend,
    )
    u = state[:, ALONG]
    for inflow in boundaries.inflows:
        if inflow.side == "west":
            continue
        # What joins has to be brought from its own u_in to that of the flow: c (u - u_in) / dy beside inflows through
        # the sides, c their speed. Speeds of an east face are those of both its cells.
        row, part = 0 if inflow.side == "south" else -1, slice(inflow.start, inflow.stop)
        entering, brought = np.zeros((2, problem.shape[0] + 1, problem.members))
        flux = _inflow_flux(problem, inflow, depth[part, row])
        lift = _stretch_of(problem, inflow, 0.0) / _stretch_of(problem, inflow, 0.5)
        entering[:-1][part] = flux * lift
        brought[:-1][part] = flux**2 / depth[part, row] * inflow.along * lift
        entering[-1], brought[-1] = entering[-2], brought[-2]  # the last face has one cell alone
        h = np.concatenate([depth[:, row], depth[-1:, row]])
        both = problem.dy * (h[:-1] + h[1:])
        missing = (entering[:-1] + entering[1:]) * u[:, row] - (brought[:-1] + brought[1:])
        out[:, ALONG, row] += missing / both
    for row, rate in wall_rates(problem, depth):
        along = state[:, ALONG, row]
        out[:, ALONG, row] += rate * np.sqrt(along**2 + kernels.REST_SPEED**2) * along
    if boundaries.lateral_inflow.size:
        # What enters from above or below has to be brought to speed; what leaves takes its own along.
        out[:, LEVEL] -= boundaries.lateral_inflow
        out[:, ALONG] += np.maximum(boundaries.lateral_inflow, 0.0) / depth * state[:, ALONG]
    if closed.momentum:
        push_momentum(out, closed.momentum, depth, problem)
    wall = ~boundaries.outlet
    out[-1, ALONG, wall] = state[-1, ALONG, wall]  # u = 0 there, whatever pushes
    return out


def push_momentum(out: Array, momentum: dict[str, Array], depth: Array, problem: Problem) -> None:
    """Take forces and the divergence of momentum fluxes from a residual (nx, 3, ny, m), see kernels.push."""
    x, y, xx, xy, yy = (momentum.get(name, EMPTY) for name in ("x", "y", "xx", "xy", "yy"))
    kernels.push(out, depth, x, y, xx, xy, yy, problem.film, problem.dx, problem.dy, problem.bend)


def faces(problem: Problem, state: Array) -> Faces:
    """Depths, velocities and fluxes of a state (nx, 3, ny, m), boundaries included."""
    level = np.ascontiguousarray(state[:, LEVEL])
    cell, face_x, face_y, corner = all_depths(problem, level)
    u, v = kernels.velocities(state, 0, problem.shape[0], cell, *side_fluxes(problem, cell))
    return Faces(level, cell, face_x, face_y, corner, u, v, face_x * u)


def cell_depths(problem: Problem, state: Array) -> Array:
    """h (nx, ny, m) [m] at the cell centres of a state (nx, 3, ny, m)."""
    return np.asarray(wet_and_dry.cell_depth(state, *problem.wetting))


def all_depths(problem: Problem, level: Array) -> tuple[Array, Array, Array, Array]:
    """Depths [m] of cells, west-east faces, south-north faces and corners at levels (nx, ny, m) [m]."""
    found = wet_and_dry.depths(level, *problem.wetting, problem.smallest_shear_depth, problem.boundaries.outlet_level)
    cell, face_x, face_y, corner = found
    return cell, face_x, face_y, corner


def storage(problem: Problem, level: Array) -> Array:
    """dh/dz_s (nx, ny, m) [-] of every cell: the share of it that is wet.

    Parameters
    ----------
    level : (nx, ny, m) [m]
    """
    above = above_bed(problem, level) - FILM_ON_LAND * problem.film
    half_range = problem.bed_half_range[:, :, None]
    return np.clip(0.5 * (above + half_range) / half_range, 0.0, 1.0)


def side_fluxes(problem: Problem, depth: Array) -> tuple[Array, Array, Array]:
    """q = Q w / (sum w * width), w = h^(5/3) or 1, times the spread that an effect gives the inflow.

    Widths along a bend are those of its cells. In a hollow whose rim stands r over its bed, w = h^(5/3) min(1, max(h/r
    - 1, 0)): what stands below the rim flows nowhere.

    Parameters
    ----------
    depth : (nx, ny, m) [m]

    Returns
    -------
    west, south, north : (ny, m), (nx, m), (nx, m) [m2/s]
        Into the sides, positive into the domain.
    """
    (nx, ny), m = problem.shape, problem.members
    fluxes = {"west": np.zeros((ny, m)), "south": np.zeros((nx, m)), "north": np.zeros((nx, m))}
    beside = {"west": depth[0], "south": depth[:, 0], "north": depth[:, -1]}
    for inflow in problem.boundaries.inflows:
        part = slice(inflow.start, inflow.stop)
        fluxes[inflow.side][part] += _inflow_flux(problem, inflow, beside[inflow.side][part])
    return fluxes["west"], fluxes["south"], fluxes["north"]


def side_discharges(problem: Problem, depth: Array) -> Array:
    """Discharge (nx, m) [m3/s] that enters each column of cells through its south and north side.

    Parameters
    ----------
    depth : (nx, ny, m) [m]
    """
    entering = np.zeros((problem.shape[0], problem.members))
    for inflow in problem.boundaries.inflows:
        if inflow.side != "west":
            part = slice(inflow.start, inflow.stop)
            flux = _inflow_flux(problem, inflow, depth[part, 0 if inflow.side == "south" else -1])
            entering[part] += flux * _stretch_of(problem, inflow, 0.0) * problem.dx
    return entering


def _inflow_flux(problem: Problem, inflow: InflowSegment, depth: Array) -> Array:
    """q [m2/s] in each cell of an inflow, of their depths (cell, m)."""
    width = problem.dy if inflow.side == "west" else problem.dx
    together = inflow_parts(problem, inflow, depth).sum(axis=0) * width
    return np.asarray(inflow.discharge * _inflow_weight(inflow, depth) / together)


def inflow_parts(problem: Problem, inflow: InflowSegment, depth: Array) -> Array:
    """w J (cell, m): what the discharge of each cell of an inflow is in proportion to, see `side_fluxes`.

    Parameters
    ----------
    depth : (cell, m) [m]
        Of its cells.
    """
    weight = _inflow_weight(inflow, depth)
    return weight if inflow.side == "west" else weight * _stretch_of(problem, inflow, 0.0)


def _inflow_weight(inflow: InflowSegment, depth: Array) -> Array:
    """w (cell, m), see `side_fluxes`."""
    if not inflow.by_conveyance:
        return np.asarray(np.ones_like(depth) * inflow.spread)
    weight = depth ** (5.0 / 3.0) * inflow.spread
    if inflow.rim.any():
        rim = np.where(inflow.rim > 0.0, inflow.rim, np.inf)
        weight = weight * np.where(inflow.rim > 0.0, np.clip(depth / rim - 1.0, 0.0, 1.0), 1.0)
    return np.asarray(weight)


def _stretch_of(problem: Problem, inflow: InflowSegment, rows: float) -> Array:
    """J (cell, 1) [-] of the cells a side inflow enters by, so many rows off that side."""
    if problem.bend is None:
        return np.ones((1, 1))
    from_south = rows if inflow.side == "south" else problem.shape[1] - rows
    y = problem.bend.south + from_south * problem.dy
    return np.asarray(1.0 - y * problem.bend.at_cells[inflow.start : inflow.stop, None])
