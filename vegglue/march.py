"""Marching in time: semi-implicit steps, alternating directions, all members at once.

One step solves (S/dt + theta A_x) (S/dt)^-1 (S/dt + theta A_y) delta = -R, with R the full residual, S the storage (friction,
upwind and viscous diagonals included) and A the gravity waves along x and y: tridiagonal sweeps for the level, the
velocities eliminated (delta form of Beam and Warming 1976, doi:10.1016/0021-9991(76)90110-8). The right side is the
residual that Newton brings to zero, so both come to the same steady state, whatever dt.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from vegglue.flow import ACROSS, ALONG, LEVEL, Array, Faces, Problem, drag, faces, residual
from vegglue.kernels import GRAVITY
from vegglue.steady import newton

compiled = njit(cache=True, error_model="numpy")

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
    rough = drag(problem, now.cell)
    storage = _storage(problem, state)
    along, across = _damping(problem, now, rough)
    change = -residual(problem, state)
    _sweep_x(change, now.face_x, storage, 1.0 / time_step + along, problem.outlet, time_step, theta, problem.dx)
    _sweep_y(change, now.face_y, storage, 1.0 / time_step + across, time_step, theta, problem.dy)
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
        state = march(problem, state, FALL_BACK_STEP, per_try)
        if not np.isfinite(state).all():
            return Marched(state, False, tried * per_try, f"not finite within {tried * FALL_BACK_SPAN:g} s of marching")
        polished = newton(problem, state, tolerance, most=25, time_step=50.0)
        if polished.converged[0]:
            return Marched(polished.state, True, tried * per_try, "")
    rate = float(np.abs(advance(problem, state, FALL_BACK_STEP, 1.0)).max()) / FALL_BACK_STEP
    span = FALL_BACK_TRIES * FALL_BACK_SPAN
    return Marched(state, False, FALL_BACK_TRIES * per_try, f"still changing by {rate:.1e} per second after {span:g} s")


def _storage(problem: Problem, state: Array) -> Array:
    """dh/dz_s of every cell, (nx, ny, m), never below a thousandth so that dry land keeps a water table."""
    above = state[:, LEVEL] - problem.bed[:, :, None]
    return np.maximum(0.5 * (1.0 + above / np.sqrt(above**2 + 4.0 * problem.film**2)), 1e-3)


def _damping(problem: Problem, now: Faces, rough: Array) -> tuple[Array, Array]:
    """Diagonals [1/s] of friction, upwinding and viscosity for u on faces 1 .. nx and v on faces 0 .. ny - 1."""
    u, v = 0.5 * (now.u[1:] + now.u[:-1]), 0.5 * (now.v[:, 1:] + now.v[:, :-1])
    cell = 2.0 * rough * np.hypot(u, v) + np.abs(u) / problem.dx + np.abs(v) / problem.dy
    cell += 4.0 * problem.viscosity * (1.0 / problem.dx**2 + 1.0 / problem.dy**2)
    along, across = cell.copy(), cell.copy()
    along[:-1] = np.maximum(cell[:-1], cell[1:])
    across[:, 1:] = np.maximum(cell[:, 1:], cell[:, :-1])
    return along, across


@compiled
def _sweep_x(change, face_x, storage, weight, outlet, time_step, theta, dx):
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
                value = change[i, LEVEL, j, k] - theta / dx * east * change[i, ALONG, j, k]
                diagonal = storage[i, j, k] / time_step + pull_e
                if i > 0:
                    west = face_x[i, j, k] / weight[i - 1, j, k]
                    pull_w = theta * theta * GRAVITY / (dx * dx) * west
                    value += theta / dx * west * change[i - 1, ALONG, j, k]
                    diagonal += pull_w - pull_w * upper[i - 1, k]
                    value += pull_w * right[i - 1, k]
                upper[i, k] = (0.0 if last else pull_e) / diagonal
                right[i, k] = value / diagonal
        for i in range(nx - 1, -1, -1):
            for k in range(m):
                level = right[i, k]
                if i < nx - 1:
                    level += upper[i, k] * change[i + 1, LEVEL, j, k]
                    gap = change[i + 1, LEVEL, j, k] - level
                else:
                    gap = -2.0 * level
                change[i, LEVEL, j, k] = level
                if i < nx - 1 or outlet[j]:
                    u = (change[i, ALONG, j, k] - theta * GRAVITY * gap / dx) / weight[i, j, k]
                    change[i, ALONG, j, k] = u


@compiled
def _sweep_y(change, face_y, storage, weight, time_step, theta, dy):
    """Thomas sweeps along y in place: level and v of `change`; weight (nx, ny, m) of the south face of each cell."""
    nx, _, ny, m = change.shape
    upper, right = np.empty((ny, m)), np.empty((ny, m))
    scale = theta * theta * GRAVITY / (dy * dy)
    for i in range(nx):
        for j in range(ny):
            for k in range(m):
                mass = storage[i, j, k] / time_step
                value, diagonal, pull_n = mass * change[i, LEVEL, j, k], mass, 0.0
                if j < ny - 1:
                    north = face_y[i, j + 1, k] / weight[i, j + 1, k]
                    pull_n = scale * north
                    diagonal += pull_n
                    value -= theta / dy * north * change[i, ACROSS, j + 1, k]
                if j > 0:
                    south = face_y[i, j, k] / weight[i, j, k]
                    value += theta / dy * south * change[i, ACROSS, j, k]
                    diagonal += scale * south * (1.0 - upper[j - 1, k])
                    value += scale * south * right[j - 1, k]
                upper[j, k] = pull_n / diagonal
                right[j, k] = value / diagonal
        for j in range(ny - 1, -1, -1):
            for k in range(m):
                level = right[j, k] + (upper[j, k] * change[i, LEVEL, j + 1, k] if j < ny - 1 else 0.0)
                change[i, LEVEL, j, k] = level
        for j in range(1, ny):
            for k in range(m):
                gap = change[i, LEVEL, j, k] - change[i, LEVEL, j - 1, k]
                change[i, ACROSS, j, k] = (change[i, ACROSS, j, k] - theta * GRAVITY * gap / dy) / weight[i, j, k]
        for k in range(m):
            change[i, ACROSS, 0, k] = 0.0
