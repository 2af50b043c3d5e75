"""Steady states: Newton with pseudo-time for the first member of a neighbourhood, its factors shared by the others.

Newton solves (D/dt + J) delta = -R, D the storage of each unknown, dt growing until it no longer matters (Kelley and
Keyes 1998, doi:10.1137/S0036142996304796). Neighbours iterate x <- x - M^-1 R(x) with the factors M of their centre,
accelerated by Anderson's mixing (Walker and Ni 2011, doi:10.1137/10078356X). However a member was reached, it is
accepted on its own residual only: the largest correction M^-1 R, in m/s and m, is below the tolerance.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vegglue import blocks
from vegglue.flow import LEVEL, Array, Problem, eased, friction_slope, residual, storage, take

Single = NDArray[np.float32]

STEP = 1e-6
LANES = 15
DEPTH = 6
# A step this long [m, m/s] leaves the range where the linearisation means anything.
LONGEST = 0.25
# Near enough [m, m/s] for chord steps to do the rest.
CLOSE = 2e-2
# Factors of a state further than this [m, m/s] from the root are renewed before neighbours lean on them.
FRESH = 0.3


@dataclass(frozen=True)
class Factors:
    """The eliminated Jacobian of one member: J^-1 costs three products a column; and its slopes of friction [1/s]."""

    columns: Single
    far: Single
    slope: Array

    def solve(self, right: Array) -> Array:
        """J^-1 right, (nx, 3, ny, m)."""
        nx, _, ny, m = right.shape
        work = right.astype(np.float32).reshape(nx, 3 * ny, m)
        blocks.solve(self.columns, self.far, work)
        return work.reshape(right.shape).astype(np.float64)


@dataclass(frozen=True)
class Solution:
    """States (nx, 3, ny, m), the last correction of each member [m/s, m], iterations spent, and who converged."""

    state: Array
    correction: Array
    iterations: np.ndarray
    converged: np.ndarray


def jacobian(problem: Problem, state: Array) -> tuple[Single, Single]:
    """J = dR/dstate of one member by coloured differences: blocks (nx, 3, n, n) and far diagonal (nx, n), n = 3 ny.

    Single precision is enough: the factors only lead to the root, the residual in double precision says where it is.
    """
    nx, _, ny, _ = state.shape
    base = residual(problem, state)[..., 0]
    columns, far = np.zeros((nx, 3, 3 * ny, 3 * ny), np.float32), np.zeros((nx, 3 * ny), np.float32)
    colours = np.array(list(np.ndindex(3, blocks.ALONG_PERIOD, blocks.ACROSS_PERIOD)))
    many = take(problem, np.zeros(LANES, dtype=np.int64))
    lanes = np.empty((nx, 3, ny, LANES))
    for group in np.split(colours, range(LANES, len(colours), LANES)):
        lanes[...] = state
        for lane, (kind, column, row) in enumerate(group):
            lanes[column :: blocks.ALONG_PERIOD, kind, row :: blocks.ACROSS_PERIOD, lane] += STEP
        blocks.collect(columns, far, base, residual(many, lanes), group, STEP)
    return columns, far


def factors(problem: Problem, state: Array) -> Factors:
    """Factors of J at one state."""
    columns, far = jacobian(problem, state)
    blocks.factor(columns, far)
    return Factors(columns, far, friction_slope(problem, state))


def _stored(problem: Problem, state: Array) -> Single:
    """dh/dz_s of each level, 1 for velocities: (nx, n)."""
    nx, _, ny, _ = state.shape
    stored = np.ones((nx, 3, ny), np.float32)
    stored[:, LEVEL] = storage(problem, state[:, LEVEL])[..., 0]
    return stored.reshape(nx, 3 * ny)


def newton(problem: Problem, start: Array, tolerance: float, most: int = 60, time_step: float = 10.0) -> Solution:
    """One member (m = 1) from a start that may be far away."""
    state, size = start, np.inf
    for iteration in range(1, most + 1):
        slope = friction_slope(problem, state)
        rates, columns_far, stored = eased(problem, state, slope), jacobian(problem, state), _stored(problem, state)
        step, time_step = _bounded_step(rates, columns_far, stored, slope, time_step)
        size = float(np.abs(step).max())
        if not size < LONGEST:
            return _alone(state, size, iteration, False)
        state = state + step
        if size < tolerance and time_step > min(1e4, 1.0 / tolerance):
            return _alone(state, size, iteration, True)
        time_step = min(time_step * (8.0 if size < 0.02 else 2.0 if size < 0.12 else 1.0), 1e9)
    return _alone(state, size, most, False)


def finish(problem: Problem, near: Array, tolerance: float, rounds: int = 4) -> tuple[Solution, Factors | None]:
    """One member from a start near its root: chord steps, the factors renewed while they help (Shamanskii 1967).

    The factors handed back are those of a state that lies within CLOSE of the root, or none if there was no root.
    """
    state, spent, largest = near, 0, np.inf
    for _ in range(rounds):
        shared = factors(problem, state)
        end = chord(problem, state, shared, tolerance, most=14)
        spent += int(end.iterations[0])
        moved = float(np.abs(end.state - state).max())
        end = replace(end, iterations=np.array([spent]))
        if end.converged[0]:
            return end, shared if moved < FRESH else factors(problem, end.state)
        if not end.correction[0] < min(largest, LONGEST):
            break
        state, largest = end.state, float(end.correction[0])
    return end, None


def _bounded_step(
    rates: Array, columns_far: tuple[Single, Single], stored: Single, slope: Array, time_step: float
) -> tuple[Array, float]:
    """-(D/dt + J)^-1 R with dt cut until no entry is longer than LONGEST; the last one tried if none is."""
    columns, far = columns_far
    diagonal = np.arange(far.shape[1])
    for _ in range(12):
        shifted = columns.copy()
        shifted[:, 1, diagonal, diagonal] += stored / np.float32(time_step)
        blocks.factor(shifted, far)
        step = -Factors(shifted, far, slope).solve(rates)
        if np.abs(step).max() < LONGEST:
            break
        time_step /= 4.0
    return step, time_step


def _alone(state: Array, size: float, iterations: int, converged: bool) -> Solution:
    return Solution(state, np.array([size]), np.array([iterations]), np.array([converged]))


class _Memory:
    """The last DEPTH changes of every member's correction, for Anderson's mixing; filled in place, slot by slot."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.turns: Single = np.zeros((DEPTH, *shape), np.float32)
        self.sums: Single = np.zeros((DEPTH, *shape), np.float32)
        self.gram = np.zeros((DEPTH, DEPTH, shape[-1]))
        self.last: tuple[Array, Array] | None = None
        self.count = 0

    def keep(self, members: np.ndarray) -> None:
        self.turns = np.ascontiguousarray(self.turns[..., members])
        self.sums = np.ascontiguousarray(self.sums[..., members])
        self.gram = _columns(self.gram, members)
        if self.last is not None:
            self.last = _columns(self.last[0], members), _columns(self.last[1], members)

    def next_state(self, state: Array, step: Array) -> Array:
        """x + f, less what the memory knows to overshoot."""
        if self.last is not None:
            slot = self.count % DEPTH
            blocks.remember(self.turns, self.sums, slot, state, step, *self.last)
            self.count += 1
            known = min(self.count, DEPTH)
            row, right = blocks.products(self.turns[:known], slot, step)
            self.gram[slot, :known], self.gram[:known, slot] = row, row
            weights = blocks.minimise(np.ascontiguousarray(self.gram[:known, :known]), right)
            mixed = blocks.mix(state, step, self.sums[:known], weights)
        else:
            mixed = state + step
        self.last = state, step
        return mixed


def _columns(values: Array, members: np.ndarray) -> Array:
    return np.ascontiguousarray(values[..., members])


def chord(problem: Problem, start: Array, shared: Factors, tolerance: float, most: int = 25) -> Solution:
    """All members from their starts with one factorisation; those that stall are left where they got to."""
    members = problem.members
    final = start.copy()
    iterations, converged = np.zeros(members, dtype=np.int64), np.zeros(members, dtype=bool)
    best = np.full(members, np.inf)
    active, running = np.arange(members), np.ones(members, dtype=bool)
    state, part, memory = start, problem, _Memory(start.shape)
    for iteration in range(1, most + 1):
        step = -shared.solve(eased(part, state, shared.slope))
        size = np.abs(step).max(axis=(0, 1, 2))
        now = active[running]
        iterations[now] = iteration
        done = running & (size < tolerance)
        best[now] = np.minimum(best[now], size[running])
        converged[active[done]] = True
        if done.any():
            final[..., active[done]] = state[..., done] + step[..., done]
        running = running & ~done & (size < 4.0 * LONGEST)
        if not running.any() or iteration == most:
            final[..., active[running]] = state[..., running] + step[..., running]
            break
        if running.sum() <= active.size // 2:
            keep = np.flatnonzero(running)
            active, part, running = active[keep], take(part, keep), running[keep]
            state, step = _columns(state, keep), _columns(step, keep)
            memory.keep(keep)
        # Members that strayed stay in their lane until the next cut: they must not spoil the arithmetic of others.
        step[..., ~running] = 0.0
        state = memory.next_state(state, step)
    return Solution(final, best, iterations, converged)
