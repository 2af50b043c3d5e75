"""Marching in time: semi-implicit steps, alternating directions, all members at once.

One step solves (S/dt + theta A_x) (S/dt)^-1 (S/dt + theta A_y) delta = -R, with R the full residual, S the storage
(friction, upwind and viscous diagonals included) and A the gravity waves along x and y: tridiagonal sweeps for the
level, the velocities eliminated (delta form of Beam and Warming 1976, doi:10.1016/0021-9991(76)90110-8). The right
side is the residual that Newton brings to zero, so both come to the same steady state, whatever dt.
"""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.compilation import compiled_exactly
from vegglue.effects.physical_constants import GRAVITY
from vegglue.flow.closures import closures, wall_rates
from vegglue.flow.equations import faces, residual_of, side_fluxes, storage
from vegglue.flow.kernels import REST_SPEED
from vegglue.flow.newton import FROM_A_MARCH, newton
from vegglue.flow.problem import LEVEL, Problem, stretch_of_cells


@compiled_exactly
def _sweep_x(change, face_x, stored, weight, outlet, time_step, theta, dx):
    """Thomas sweeps along x in place: level and u of `change`; weight (nx, ny, m) of the east face of each cell."""
    nx, _, ny, m = change.shape
    upper, right = np.empty((nx, m)), np.empty((nx, m))
    for j in range(ny):
        for i in range(nx):
            last = i == nx - 1
            for k in range(m):
                east = face_x[i + 1, j, k] / weight[i, j, k]
                pull_e = theta * theta * GRAVITY / (dx * dx) * east * (2.0 if last else 1.0)
                if last and not outlet[j]:
                    east, pull_e = 0.0, 0.0
                value = change[i, 0, j, k] - theta / dx * east * change[i, 2, j, k]
                diagonal = stored[i, j, k] / time_step + pull_e
                if i > 0:
                    west = face_x[i, j, k] / weight[i - 1, j, k]
                    pull_w = theta * theta * GRAVITY / (dx * dx) * west
                    value += theta / dx * west * change[i - 1, 2, j, k]
                    diagonal += pull_w - pull_w * upper[i - 1, k]
                    value += pull_w * right[i - 1, k]
                upper[i, k] = (0.0 if last else pull_e) / diagonal
                right[i, k] = value / diagonal
        for i in range(nx - 1, -1, -1):
            for k in range(m):
                level = right[i, k]
                if i < nx - 1:
                    level += upper[i, k] * change[i + 1, 0, j, k]
                    gap = change[i + 1, 0, j, k] - level
                else:
                    gap = -2.0 * level
                change[i, 0, j, k] = level
                if i < nx - 1 or outlet[j]:
                    u = (change[i, 2, j, k] - theta * GRAVITY * gap / dx) / weight[i, j, k]
                    change[i, 2, j, k] = u


@compiled_exactly
def _sweep_y(change, face_y, stored, weight, time_step, theta, dy):
    """Thomas sweeps along y in place: level and v of `change`; weight (nx, ny, m) of the south face of each cell."""
    nx, _, ny, m = change.shape
    upper, right = np.empty((ny, m)), np.empty((ny, m))
    scale = theta * theta * GRAVITY / (dy * dy)
    for i in range(nx):
        for j in range(ny):
            for k in range(m):
                mass = stored[i, j, k] / time_step
                value, diagonal, pull_n = mass * change[i, 0, j, k], mass, 0.0
                if j < ny - 1:
                    north = face_y[i, j + 1, k] / weight[i, j + 1, k]
                    pull_n = scale * north
                    diagonal += pull_n
                    value -= theta / dy * north * change[i, 1, j + 1, k]
                if j > 0:
                    south = face_y[i, j, k] / weight[i, j, k]
                    value += theta / dy * south * change[i, 1, j, k]
                    diagonal += scale * south * (1.0 - upper[j - 1, k])
                    value += scale * south * right[j - 1, k]
                upper[j, k] = pull_n / diagonal
                right[j, k] = value / diagonal
        for j in range(ny - 1, -1, -1):
            for k in range(m):
                level = right[j, k] + (upper[j, k] * change[i, 0, j + 1, k] if j < ny - 1 else 0.0)
                change[i, 0, j, k] = level
        for j in range(1, ny):
            for k in range(m):
                gap = change[i, 0, j, k] - change[i, 0, j - 1, k]
                change[i, 1, j, k] = (change[i, 1, j, k] - theta * GRAVITY * gap / dy) / weight[i, j, k]
        for k in range(m):
            change[i, 1, 0, k] = 0.0


# Newton tries to finish a march after each of so many equal parts [-]: chosen, not measured. More tries end sooner
# if one succeeds, and cost up to 25 factorisations each if none does.
TRIES = 4


def march(problem: Problem, state: Array, time_step: float, steps: int, theta: float = 1.0) -> Array:
    """`steps` steps of the equation of `advance`: the state after them.

    Parameters
    ----------
    state : (nx, 3, ny, m)
    time_step : [s]
    theta : 1/2 .. 1 [-]
        Weight of the gravity terms at the end of a step.
    """
    for _ in range(steps):
        state = state + advance(problem, state, time_step, theta)
    return state


def advance(problem: Problem, state: Array, time_step: float, theta: float) -> Array:
    """(S/dt + theta A_x) (S/dt)^-1 (S/dt + theta A_y) delta = -R: the change (nx, 3, ny, m) of a state over one step.

    Parameters
    ----------
    problem, state, time_step, theta
        As `march`.
    """
    now = faces(problem, state)
    # Never below a thousandth, so that dry land keeps a water table.
    wet = np.maximum(storage(problem, state[:, LEVEL]), 1e-3)
    closed, outlet = closures(problem, state, now.cell), problem.boundaries.outlet
    # The shortest cells: in a bend the sweeps must not take waves to be slower than they are.
    length = problem.dx * float(stretch_of_cells(problem).min())
    # Diagonals [1/s] of friction, upwinding and viscosity for u on faces 1 .. nx and v on faces 0 .. ny - 1.
    u, v = 0.5 * (now.u[1:] + now.u[:-1]), 0.5 * (now.v[:, 1:] + now.v[:, :-1])
    cell = (
        2.0 * np.abs(closed.rate) * np.sqrt(u**2 + v**2 + REST_SPEED**2) + np.abs(u) / length + np.abs(v) / problem.dy
    )
    # Shear acts on a thin cell over the depth of its deeper corners.
    sheared = np.maximum(np.maximum(now.corner[1:, 1:], now.corner[1:, :-1]) / now.cell, 1.0)
    cell += 4.0 * closed.viscosity * (1.0 / length**2 + sheared / problem.dy**2)
    along, across = cell.copy(), cell.copy()
    along[:-1] = np.maximum(cell[:-1], cell[1:])
    for row, rate in wall_rates(problem, now.cell):
        along[:, row] += 2.0 * rate * np.sqrt(now.u[1:, row] ** 2 + REST_SPEED**2)
    across[:, 1:] = np.maximum(cell[:, 1:], cell[:, :-1])
    change = -residual_of(problem, state, now.cell, side_fluxes(problem, now.cell), closed)
    _sweep_x(change, now.face_x, wet, 1.0 / time_step + along, outlet, time_step, theta, length)
    _sweep_y(change, now.face_y, wet, 1.0 / time_step + across, time_step, theta, problem.dy)
    return change


@dataclass(frozen=True)
class FallBack:
    """How members are marched if Newton fails: steps [s], and the flow time [s] after which one has failed.

    Chosen, not measured: a wave runs through 171 m of water 1 m deep within a minute, so that 40 minutes let it come
    and go many times; a step of 0.5 s takes about as long as the water needs through a cell. Longer channels may
    need more time (`numerics.march_span`), a march that runs away shorter steps (`numerics.march_step`).
    """

    step: float = 0.5
    span: float = 2400.0


USUAL_FALL_BACK = FallBack()


def fall_back(step: float | None, span: float | None) -> FallBack:
    """As a case gives them; as usual what it leaves out."""
    usual = USUAL_FALL_BACK
    return FallBack(usual.step if step is None else step, usual.span if span is None else span)


@dataclass(frozen=True)
class Marched:
    """Where a march for the steady state of one member ended.

    Attributes
    ----------
    state
        (nx, 3, ny, 1), steady if `steady`.
    steps
        That were made.
    sentence
        Why it is not steady, else empty.
    """

    state: Array
    steady: bool
    steps: int
    sentence: str


def march_to_rest(problem: Problem, start: Array, tolerance: float, how: FallBack) -> Marched:
    """March one member until Newton can finish it; its steady state is judged as any other, by its residual.

    Parameters
    ----------
    start : (nx, 3, ny, 1)
    tolerance : [m, m/s]
        Largest correction of a steady state.
    """
    state, per_try = start, max(round(how.span / TRIES / how.step), 1)
    for tried in range(1, TRIES + 1):
        with np.errstate(over="ignore", invalid="ignore"):  # a march that runs away is known by its end
            state = march(problem, state, how.step, per_try)
        steps = tried * per_try
        if not np.isfinite(state).all():
            return Marched(state, False, steps, f"not finite within {steps * how.step:g} s of marching")
        polished = newton(problem, state, tolerance, FROM_A_MARCH)
        if polished.converged[0]:
            return Marched(polished.state, True, steps, "")
    rate = float(np.abs(advance(problem, state, how.step, 1.0)).max()) / how.step
    return Marched(state, False, steps, f"still changing by {rate:.1e} per second after {steps * how.step:g} s")
