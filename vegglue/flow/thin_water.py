"""Thin water eased for chord steps, where both its laws are far from linear: friction in the velocity, and what a
face carries in the level.

Steps with another member's Jacobian overshoot along the waterline long after the rest of the flow has settled. Hence,
on thin faces,

    rows of momentum along the channel are written as slope (u - u*), u* their root in u, all else as it is;
    the unknown is w = rho u, rho = h / h_c, with h_c the depth at the reference member: what it carries is linear in w;
    rows of momentum are weighed by rho, those across the channel by at most one.

Along the channel the flow around gives the slope, and friction the velocity. Across it a cell at the waterline is a
dead end: what comes in gives the velocity, and friction the level. There the row as it is leads to the root, while one
written with its root is off by the ratio of what both faces carry, 1e4 where one is wet and the other dry.

Deep water stays as it is, roots stay roots, and at the reference member nothing changes. A nonlinear preconditioner
from the left and one from the right, as in Cai and Keyes 2002, doi:10.1137/S106482750037620X; not checked against it.
"""

import math

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array, Single
from vegglue.compilation import compiled, compiled_inside
from vegglue.effects.physical_constants import FILM_ON_LAND
from vegglue.flow.closures import closures
from vegglue.flow.equations import all_depths, cell_depths, residual_of, side_fluxes
from vegglue.flow.kernels import REST_SPEED
from vegglue.flow.problem import ACROSS, ALONG, LEVEL, Problem
from vegglue.flow.wet_and_dry import wet_depth

# Films of depth above which a face stays as it is [-]. Of the rows, 2 needs two more steps in ten, 10 none fewer;
# of rho, 20 and 100 none fewer.
THIN = 5.0


@compiled_inside
def _gap(own: float, other: float, rough: float, rate: float) -> float:
    """u - u* [m/s] of a row whose rate is `rate`, k |U| u in it; other: |U|^2 less u^2."""
    drive = math.sqrt(own * own + other) * own - rate / rough
    root = math.sqrt(0.5 * (math.sqrt(other * other + 4.0 * drive * drive) - other))
    return own - math.copysign(root, drive)


@compiled_inside
def _beside(state, before, i, j, along):
    """The cell beyond the face of cell i, j (its east one, or its south one) and the four velocities across it."""
    nx, _, ny, _ = state.shape
    if along:
        b, n = min(i + 1, nx - 1), min(j + 1, ny - 1)
        return b, j, state[i, 1, j], state[i, 1, n], state[b, 1, j], state[b, 1, n]
    s = max(j - 1, 0)
    behind = state[i - 1, 2] if i > 0 else before
    return i, s, state[i, 2, j], state[i, 2, s], behind[j], behind[s]


@compiled
def friction_slope(state, depth, drag, west):
    """d(k |U| u)/du [1/s] of the unknowns (nx, 3, ny, m); none for levels."""
    nx, _, ny, m = state.shape
    slope, before = np.zeros((nx, 3, ny, m)), west / depth[0]
    for i in range(nx):
        for j in range(ny):
            for e in (1, 2):
                a, b, one, two, three, four = _beside(state, before, i, j, e == 2)
                for k in range(m):
                    own, other = state[i, e, j, k], 0.25 * (one[k] + two[k] + three[k] + four[k])
                    here, beyond = depth[i, j, k], depth[a, b, k]
                    rough = (drag[i, j, k] * here + drag[a, b, k] * beyond) / (here + beyond)
                    speed = math.sqrt(own * own + other * other + REST_SPEED * REST_SPEED)
                    slope[i, e, j, k] = rough * (speed + own * own / speed)
    return slope


@compiled
def ease(out, state, depth, drag, west, slope, film, at_outlet):
    """Rows of momentum along the channel in thin water, in place, as slope (u - u*); blended in below THIN films.

    slope (nx, 3, ny, 1): of the state whose factors are in use; at_outlet (ny,): rows eased at the outlet, too.
    """
    nx, _, ny, m = state.shape
    before, per_thin = west / depth[0], 0.5 / (THIN * film)
    for i in range(nx):
        for j in range(ny):
            deep = True
            for k in range(m):  # not by `min`, which takes as long to compile as the rest
                deep &= depth[i, j, k] > 2.0 * THIN * film
            if deep:
                continue
            if i == nx - 1 and not at_outlet[j]:
                continue
            a, b, one, two, three, four = _beside(state, before, i, j, True)
            at_reference = slope[i, 2, j, 0]
            for k in range(m):
                other = 0.25 * (one[k] + two[k] + three[k] + four[k])
                pair = depth[i, j, k] + depth[a, b, k]
                rough = (drag[i, j, k] * depth[i, j, k] + drag[a, b, k] * depth[a, b, k]) / pair
                rate = out[i, 2, j, k]
                gap = _gap(state[i, 2, j, k], other * other + REST_SPEED * REST_SPEED, rough, rate)
                share = min(pair * per_thin, 1.0)
                out[i, 2, j, k] = rate + (1.0 - share * share) * (at_reference * gap - rate)


@compiled_inside
def _beyond(i, e, j):
    """The cell beyond the face of an unknown of cell i, j; for a level this cell itself."""
    if e == 0:
        return i, j
    return (i + 1, j) if e == 2 else (i, j - 1)


@compiled_inside
def _above(state, bed, rise, i, j, a, b, k):
    """Level above the bed [m] at the face between the cells i, j and a, b, the mean of both."""
    above = 0.5 * (state[i, 0, j, k] - bed[i, j] + state[a, 0, b, k] - bed[a, b])
    return above - 0.5 * (rise[i, j, k] + rise[a, b, k]) if rise.size else above


@compiled
def answers(state, bed, rise, half_range, film, thick):
    """u d(rho)/dz [1/s] of one member's faces (nx, 3, ny) where rho is one, z the level of either cell beside."""
    nx, _, ny = thick.shape
    answer = np.zeros((nx, 3, ny))
    for i in range(nx):
        for e in range(3):
            for j in range(ny):
                if not thick[i, e, j] < THIN * film:
                    continue
                a, b = _beyond(i, e, j)
                wide, share = 0.5 * (half_range[i, j] + half_range[a, b]), thick[i, e, j] / (THIN * film)
                above = _above(state, bed, rise, i, j, a, b, 0) - FILM_ON_LAND * film
                wet = min(max(0.5 * (above + wide) / wide, 0.0), 1.0)
                answer[i, e, j] = (1.0 - share * share) * 0.5 * wet / thick[i, e, j] * state[i, e, j, 0]
    return answer


@compiled
def thin_cells_and_faces(state, bed, rise, half_range, film, thick):
    """Cells and faces (nx, 3, ny) that are thin in any member of a state, or, faces only, at the reference member."""
    nx, _, ny, m = state.shape
    found = np.zeros((nx, 3, ny), np.bool_)
    for i in range(nx):
        for j in range(ny):
            for e in range(3):
                if e > 0 and thick[i, e, j] == np.inf:
                    continue
                a, b = _beyond(i, e, j)
                lowest = np.inf
                for k in range(m):
                    lowest = min(lowest, _above(state, bed, rise, i, j, a, b, k))
                least = wet_depth(lowest, 0.5 * (half_range[i, j] + half_range[a, b]), film)
                found[i, e, j] = min(least, thick[i, e, j]) < THIN * film
    return found


@compiled_inside
def _rho(h: float, reference: float, per_thin: float) -> float:
    """h / h_c of a thin face, one of a deep one."""
    share = min(min(h, reference) * per_thin, 1.0)
    return 1.0 + (1.0 - share * share) * (h / reference - 1.0)


@compiled
def stretch(values, state, faces, bed, rise, half_range, film, thick, most_across, back):
    """Velocities or rows of some faces (nx, 3, ny) times rho at the levels of a state, or divided by it, in place;
    across the channel by at most `most_across`. values (nx, 3, ny, m).
    """
    nx, _, ny, m = state.shape
    per_thin = 1.0 / (THIN * film)
    for i in range(nx):
        for e in (1, 2):
            for j in range(ny):
                if not faces[i, e, j]:
                    continue
                a, b = _beyond(i, e, j)
                wide, reference = 0.5 * (half_range[i, j] + half_range[a, b]), thick[i, e, j]
                for k in range(m):
                    h = wet_depth(_above(state, bed, rise, i, j, a, b, k), wide, film)
                    rho = _rho(h, reference, per_thin)
                    if e == 1:
                        rho = min(rho, most_across)
                    values[i, e, j, k] *= 1.0 / rho if back else rho


@compiled
def tilt(step, answer):
    """dw = du + u d(rho)/dz (dz + dz beyond the face): steps of u to steps of w = rho u, in place.

    Parameters
    ----------
    step : (nx, 3, ny, m)
    answer : (nx, 3, ny) [1/s]
        u d(rho)/dz, see `thickness`; 0 where water is deep.
    """
    nx, _, ny, m = step.shape
    for i in range(nx):
        for j in range(ny):
            for e in (1, 2):
                if answer[i, e, j] == 0.0:
                    continue
                a, b = _beyond(i, e, j)
                for k in range(m):
                    step[i, e, j, k] += answer[i, e, j] * (step[i, 0, j, k] + step[a, 0, b, k])


@compiled
def correction(step, state, thin, bed, rise, half_range, film, thick):
    """Largest change of each member (m,) [m, m/s] by a step in the unknowns of chord steps, NaN if any is.

    In thin places in proportion to the depth there, that of its face for a velocity.
    """
    nx, _, ny, m = state.shape
    largest, total, per_thin = np.zeros(m), np.zeros(m), 1.0 / (THIN * film)
    for i in range(nx):
        for e in range(3):
            for j in range(ny):
                if not thin[i, e, j]:
                    for k in range(m):
                        change = abs(step[i, e, j, k])
                        largest[k] = max(largest[k], change)
                        total[k] += change
                    continue
                a, b = _beyond(i, e, j)
                wide, reference = 0.5 * (half_range[i, j] + half_range[a, b]), thick[i, e, j]
                for k in range(m):
                    above = _above(state, bed, rise, i, j, a, b, k)
                    h, change = wet_depth(above, wide, film), step[i, e, j, k]
                    if e > 0:
                        risen = wet_depth(above + 0.5 * (step[i, 0, j, k] + step[a, 0, b, k]), wide, film)
                        carried = _rho(h, reference, per_thin) * state[i, e, j, k] + change
                        change = carried / _rho(risen, reference, per_thin) - state[i, e, j, k]
                    change = abs(change) * min(h * per_thin, 1.0)
                    largest[k] = max(largest[k], change)
                    total[k] += change
    return largest + 0.0 * total


def eased(problem: Problem, state: Array, slope: Array, at_outlet: NDArray[np.bool_]) -> Array:
    """R(state), (nx, 3, ny, m), its rows of momentum of thin water written as slope (u - u*); zero when R is.

    Parameters
    ----------
    state : (nx, 3, ny, m)
    slope : (nx, 3, ny, 1) [1/s]
        `slope_of_friction` of the reference member.
    at_outlet : (ny,)
        Rows eased at the outlet, too.
    """
    depth = cell_depths(problem, state)
    closed, sides = closures(problem, state, depth), side_fluxes(problem, depth)
    out = residual_of(problem, state, depth, sides, closed)
    ease(out, state, depth, closed.rate, sides[0], slope, problem.film, at_outlet)
    return out


def slope_of_friction(problem: Problem, state: Array) -> Array:
    """d(k |U| u)/du and d(k |U| v)/dv at the faces of u and v, (nx, 3, ny, m) [1/s]; 0 for levels.

    Parameters
    ----------
    state : (nx, 3, ny, m)
    """
    depth = cell_depths(problem, state)
    rate = closures(problem, state, depth).rate
    return np.asarray(friction_slope(state, depth, rate, side_fluxes(problem, depth)[0]))


def thickness(problem: Problem, state: Array) -> tuple[Array, Array]:
    """h_c and u d(rho)/dz of one member: depths of its faces, and how its velocities answer to levels there.

    Parameters
    ----------
    state : (nx, 3, ny, 1)

    Returns
    -------
    (nx, 3, ny) [m], (nx, 3, ny) [1/s]
        The former infinite for levels and on the sides of the grid.
    """
    _, along, across, _ = all_depths(problem, np.ascontiguousarray(state[:, LEVEL]))
    faces = np.full_like(state, np.inf)
    faces[:-1, ALONG], faces[:, ACROSS, 1:] = along[1:-1], across[:, 1:-1]
    thick = np.ascontiguousarray(faces[..., 0])
    return thick, answers(state, *problem.wetting, thick)


def where_thin(problem: Problem, state: Array, thick: Array) -> NDArray[np.bool_]:
    """Where water is thin, (nx, 3, ny): cells in any member of a state, faces there or at the reference member.

    Parameters
    ----------
    state : (nx, 3, ny, m)
    thick : (nx, 3, ny) [m]
        h_c, see `thickness`.
    """
    return np.asarray(thin_cells_and_faces(state, *problem.wetting, thick))


def carry_thin(
    problem: Problem, values: Array, state: Array, thin: NDArray[np.bool_], thick: Array, back: bool = False
) -> None:
    """u -> rho u on thin faces at the levels of a state, or back; in place.

    Parameters
    ----------
    values : (nx, 3, ny, m) [m/s]
    state, thin, thick
        As `where_thin` has them, and what it gives.
    """
    stretch(values, state, thin, *problem.wetting, thick, np.inf, back)


def weigh_thin(problem: Problem, rates: Array, state: Array, thin: NDArray[np.bool_], thick: Array) -> None:
    """R_u -> rho R_u and R_v -> min(rho, 1) R_v on thin faces, in place.

    Parameters
    ----------
    problem, state, thin, thick
        As `carry_thin`.
    rates : (nx, 3, ny, m) [m/s2]
    """
    stretch(rates, state, thin, *problem.wetting, thick, 1.0, False)


def largest_correction(problem: Problem, step: Single, state: Array, thin: NDArray[np.bool_], thick: Array) -> Array:
    """Largest change of each member (m,) [m, m/s] by a step in w, in proportion to depth where thin; NaN if any is.

    Parameters
    ----------
    problem, state, thin, thick
        As `carry_thin`.
    step : (nx, 3, ny, m)
        Of levels and w, see `tilt`.
    """
    return np.asarray(correction(step, state, thin, *problem.wetting, thick))
