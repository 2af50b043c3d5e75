"""Marching in time: semi-implicit steps, alternating directions, all members at once.

One step solves (S/dt + theta A_x) (S/dt)^-1 (S/dt + theta A_y) delta = -R, with R the full residual, S the storage
(friction, upwind and viscous diagonals included) and A the gravity waves along x and y: tridiagonal sweeps for the
level, the velocities eliminated (delta form of Beam and Warming 1976, doi:10.1016/0021-9991(76)90110-8). The right
side is the residual that Newton brings to zero, so both come to the same steady state, whatever dt.
"""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.flow.closures import Closures, closures
from vegglue.flow.equations import Faces, faces, residual, storage
from vegglue.flow.kernels import REST_SPEED
from vegglue.flow.problem import LEVEL, Problem
from vegglue.solver import sweeps
from vegglue.solver.newton import newton

FALL_BACK_STEP = 0.5
FALL_BACK_SPAN = 600.0
FALL_BACK_TRIES = 4


def march(problem: Problem, state: Array, time_step: float, steps: int, theta: float = 1.0) -> Array:
    """The state (nx, 3, ny, m) after `steps` steps of `time_step` [s]; theta 1/2 .. 1 weighs the new gravity terms."""
    for _ in range(steps):
        state = state + advance(problem, state, time_step, theta)
    return state


def advance(problem: Problem, state: Array, time_step: float, theta: float) -> Array:
    """The change of a state over one step."""
    now = faces(problem, state)
    # Never below a thousandth, so that dry land keeps a water table.
    wet = np.maximum(storage(problem, state[:, LEVEL]), 1e-3)
    along, across = _damping(problem, now, closures(problem, state, now.cell))
    change, outlet = -residual(problem, state), problem.boundaries.outlet
    sweeps.sweep_x(change, now.face_x, wet, 1.0 / time_step + along, outlet, time_step, theta, problem.dx)
    sweeps.sweep_y(change, now.face_y, wet, 1.0 / time_step + across, time_step, theta, problem.dy)
    return change


@dataclass(frozen=True)
class Marched:
    """Where a march for the steady state ended: steady or not, steps spent, and in words."""

    state: Array
    steady: bool
    steps: int
    sentence: str


def settle(problem: Problem, start: Array, tolerance: float) -> Marched:
    """March one member until Newton can finish it; its steady state is judged as any other, by its residual."""
    state, per_try = start, round(FALL_BACK_SPAN / FALL_BACK_STEP)
    for tried in range(1, FALL_BACK_TRIES + 1):
        with np.errstate(over="ignore", invalid="ignore"):  # a march that runs away is told by its end
            state = march(problem, state, FALL_BACK_STEP, per_try)
        if not np.isfinite(state).all():
            return Marched(state, False, tried * per_try, f"not finite within {tried * FALL_BACK_SPAN:g} s of marching")
        polished = newton(problem, state, tolerance, most=25, time_step=50.0)
        if polished.converged[0]:
            return Marched(polished.state, True, tried * per_try, "")
    rate = float(np.abs(advance(problem, state, FALL_BACK_STEP, 1.0)).max()) / FALL_BACK_STEP
    span = FALL_BACK_TRIES * FALL_BACK_SPAN
    return Marched(state, False, FALL_BACK_TRIES * per_try, f"still changing by {rate:.1e} per second after {span:g} s")


def _damping(problem: Problem, now: Faces, closed: Closures) -> tuple[Array, Array]:
    """Diagonals [1/s] of friction, upwinding and viscosity for u on faces 1 .. nx and v on faces 0 .. ny - 1."""
    u, v = 0.5 * (now.u[1:] + now.u[:-1]), 0.5 * (now.v[:, 1:] + now.v[:, :-1])
    cell = 2.0 * closed.rate * np.sqrt(u**2 + v**2 + REST_SPEED**2) + np.abs(u) / problem.dx + np.abs(v) / problem.dy
    # Shear acts on a thin cell over the depth of its deeper corners.
    sheared = np.maximum(np.maximum(now.corner[1:, 1:], now.corner[1:, :-1]) / now.cell, 1.0)
    cell += 4.0 * closed.viscosity * (1.0 / problem.dx**2 + sheared / problem.dy**2)
    along, across = cell.copy(), cell.copy()
    along[:-1] = np.maximum(cell[:-1], cell[1:])
    across[:, 1:] = np.maximum(cell[:, 1:], cell[:, :-1])
    return along, across
