"""The equations as chord steps need them: rows of momentum and unknowns eased where water is thin, see `thin_water`.

Chord steps use the factors of a reference member. What they need of the state these were made at is, for each velocity,
the slope of friction there, the depth of its face, and how it answers to levels.
"""

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array, Single
from vegglue.flow import thin_water
from vegglue.flow.closures import closures
from vegglue.flow.equations import all_depths, cell_depths, residual_of, side_fluxes
from vegglue.flow.problem import ACROSS, ALONG, LEVEL, Problem


def eased(problem: Problem, state: Array, slope: Array, at_outlet: NDArray[np.bool_]) -> Array:
    """R(state), (nx, 3, ny, m), its rows of momentum of thin water written as slope (u - u*); zero when R is.

    slope (nx, 3, ny, 1): `slope_of_friction` of the reference member; at_outlet (ny,): rows whose outlet face, too, is
    written so.
    """
    depth = cell_depths(problem, state)
    closed, sides = closures(problem, state, depth), side_fluxes(problem, depth)
    out = residual_of(problem, state, depth, sides, closed)
    thin_water.ease(out, state, depth, closed.rate, sides[0], slope, problem.film, at_outlet)
    return out


def slope_of_friction(problem: Problem, state: Array) -> Array:
    """d(k |U| u)/du and d(k |U| v)/dv [1/s] at the faces of u and v in a state, (nx, 3, ny, m)."""
    depth = cell_depths(problem, state)
    rate = closures(problem, state, depth).rate
    return np.asarray(thin_water.friction_slope(state, depth, rate, side_fluxes(problem, depth)[0]))


def face_depths(problem: Problem, state: Array) -> Array:
    """Depths [m] of the faces that velocities of a state are given on, (nx, 3, ny, m); infinite for levels and on the
    sides of the grid.
    """
    level = np.ascontiguousarray(state[:, LEVEL])
    _, along, across, _ = all_depths(problem, level)
    found = np.full_like(state, np.inf)
    found[:-1, ALONG], found[:, ACROSS, 1:] = along[1:-1], across[:, 1:-1]
    return found


def thickness(problem: Problem, state: Array) -> tuple[Array, Array]:
    """Of one member, (nx, 3, ny): depths of its faces [m], and how its velocities answer to levels there [1/s]."""
    thick = np.ascontiguousarray(face_depths(problem, state)[..., 0])
    return thick, thin_water.answers(state, *problem.wetting, thick)


def where_thin(problem: Problem, state: Array, thick: Array) -> NDArray[np.bool_]:
    """Where water is thin, (nx, 3, ny): cells in any member of a state, faces there or at the reference member."""
    return np.asarray(thin_water.thin_cells_and_faces(state, *problem.wetting, thick))


def carry_thin(
    problem: Problem, values: Array, state: Array, thin: NDArray[np.bool_], thick: Array, back: bool = False
) -> None:
    """Velocities (nx, 3, ny, m) times rho of thin faces at the levels of a state, or back; in place."""
    thin_water.stretch(values, state, thin, *problem.wetting, thick, np.inf, back)


def weigh_thin(problem: Problem, rates: Array, state: Array, thin: NDArray[np.bool_], thick: Array) -> None:
    """Rows of momentum (nx, 3, ny, m) of thin faces times rho, those across at most times one, in place."""
    thin_water.stretch(rates, state, thin, *problem.wetting, thick, 1.0, False)


def largest_correction(problem: Problem, step: Single, state: Array, thin: NDArray[np.bool_], thick: Array) -> Array:
    """Largest change of each member (m,) [m, m/s] by a step of what is carried, in proportion to depth where thin."""
    return np.asarray(thin_water.correction(step, state, thin, *problem.wetting, thick))
