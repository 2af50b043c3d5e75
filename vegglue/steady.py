"""Steady states: Newton with pseudo-time for the first member of a neighbourhood, its factors shared by the others.

Newton solves (D/dt + J) delta = -R, D the storage of each unknown, dt growing until it no longer matters (Kelley and Keyes
1998, doi:10.1137/S0036142996304796). Neighbours iterate x <- x - M^-1 R(x) with the factors M of their centre, accelerated by
Anderson's mixing (Walker and Ni 2011, doi:10.1137/10078356X). However a member was reached, it is accepted on its own
residual only: the largest correction M^-1 R, in m/s and m, is below the tolerance.
"""

from dataclasses import dataclass

import numpy as np

from vegglue import blocks
from vegglue.flow import LEVEL, Array, Problem, residual, take

STEP = 1e-6
LANES = 15
DEPTH = 6
# A step this long [m, m/s] leaves the range where the linearisation means anything.
LONGEST = 0.25


@dataclass(frozen=True)
class Factors:
    """The eliminated Jacobian of one member: J^-1 costs three products a column."""

    columns: Array
    far: Array

    def solve(self, right: Array) -> Array:
        """J^-1 right, (nx, 3, ny, m)."""
        nx, _, ny, m = right.shape
        work = np.ascontiguousarray(right, dtype=self.columns.dtype).reshape(nx, 3 * ny, m).copy()
        blocks.solve(self.columns, self.far, work)
        return work.reshape(right.shape).astype(np.float64)


@dataclass(frozen=True)
class Solution:
    """States (nx, 3, ny, m), the last correction of each member [m/s, m], iterations spent, and who converged."""

    state: Array
    correction: Array
    iterations: np.ndarray
    converged: np.ndarray


def jacobian(problem: Problem, state: Array) -> tuple[Array, Array]:
    """J = dR/dstate of one member by coloured differences: blocks (nx, 3, n, n) and far diagonal (nx, n), n = 3 ny."""
    nx, _, ny, _ = state.shape
    base = residual(problem, state)[..., 0]
    alone = np.ascontiguousarray(state[..., 0])
    columns, far = np.zeros((nx, 3, 3 * ny, 3 * ny)), np.zeros((nx, 3 * ny))
    colours = [(kind, a, b) for kind in range(3) for a in range(blocks.PERIOD) for b in range(blocks.PERIOD)]
    many = take(problem, np.zeros(LANES, dtype=np.int64))
    lanes = np.empty((nx, 3, ny, LANES))
    for first in range(0, len(colours), LANES):
        group = colours[first : first + LANES]
        for lane, colour in enumerate(group):
            blocks.disturb(alone, *colour, STEP, lanes, lane)
        rates = residual(many, lanes)
        for lane, colour in enumerate(group):
            blocks.collect(columns, far, base, rates, *colour, STEP, lane)
    return columns, far


def factors(problem: Problem, state: Array, time_step: float = np.inf, precision: type = np.float64) -> Factors:
    """Factors of D/dt + J at one state, D the wet share of each cell (1 for velocities)."""
    return _eliminate(*jacobian(problem, state), _storage(problem, state), time_step, precision)


def _storage(problem: Problem, state: Array) -> Array:
    """dh/dz_s of the film at each level, 1 for velocities: (nx, n)."""
    nx, _, ny, _ = state.shape
    above = state[:, LEVEL, :, 0] - problem.bed
    storage = np.ones((nx, 3, ny))
    storage[:, LEVEL] = 0.5 * (1.0 + above / np.sqrt(above**2 + 4.0 * problem.film**2))
    return storage.reshape(nx, 3 * ny)


def _eliminate(columns: Array, far: Array, storage: Array, time_step: float, precision: type) -> Factors:
    shifted, diagonal = columns.astype(precision), np.arange(storage.shape[1])
    shifted[:, 1, diagonal, diagonal] += (storage / time_step).astype(precision)
    far = far.astype(precision)
    blocks.factor(shifted, far)
    return Factors(shifted, far)


def newton(problem: Problem, start: Array, tolerance: float, most: int = 60, time_step: float = 10.0) -> Solution:
    """One member (m = 1) from a start that may be far away."""
    state, size = start, np.inf
    for iteration in range(1, most + 1):
        rates, columns_far, storage = residual(problem, state), jacobian(problem, state), _storage(problem, state)
        step, time_step = _bounded_step(rates, columns_far, storage, time_step)
        size = float(np.abs(step).max())
        if not size < LONGEST:
            return _alone(state, size, iteration, False)
        state = state + step
        if size < tolerance and time_step > 1e4:
            return _alone(state, size, iteration, True)
        time_step = min(time_step * (8.0 if size < 0.02 else 2.0 if size < 0.12 else 1.0), 1e9)
    return _alone(state, size, most, False)


def _bounded_step(
    rates: Array, columns_far: tuple[Array, Array], storage: Array, time_step: float
) -> tuple[Array, float]:
    """-(D/dt + J)^-1 R with dt cut until no entry is longer than LONGEST; the last one tried if none is."""
    for _ in range(12):
        step = -_eliminate(*columns_far, storage, time_step, np.float64).solve(rates)
        if np.abs(step).max() < LONGEST:
            break
        time_step /= 4.0
    return step, time_step


def _alone(state: Array, size: float, iterations: int, converged: bool) -> Solution:
    return Solution(state, np.array([size]), np.array([iterations]), np.array([converged]))


@dataclass(frozen=True)
class _Memory:
    """The last DEPTH changes of each member: of its correction, and of state plus correction (depth, nx, 3, ny, m)."""

    turns: Array
    sums: Array

    def keep(self, members: np.ndarray) -> "_Memory":
        return _Memory(np.ascontiguousarray(self.turns[..., members]), np.ascontiguousarray(self.sums[..., members]))


def chord(problem: Problem, start: Array, shared: Factors, tolerance: float, most: int = 25) -> Solution:
    """All members from their starts with one factorisation; those that stall or stray are left unconverged."""
    members = problem.members
    final, correction = start.copy(), np.full(members, np.inf)
    iterations, converged = np.zeros(members, dtype=np.int64), np.zeros(members, dtype=bool)
    active, state, part = np.arange(members), start, problem
    memory = _Memory(np.zeros((DEPTH, *start.shape)), np.zeros((DEPTH, *start.shape)))
    previous: tuple[Array, Array] | None = None
    for iteration in range(most):
        step = -shared.solve(residual(part, state))
        size = np.abs(step).max(axis=(0, 1, 2))
        iterations[active], correction[active] = iteration + 1, size
        final[..., active] = state + step
        converged[active] = size < tolerance
        keep = np.flatnonzero(~(size < tolerance) & (size < 4.0 * LONGEST))
        if keep.size == 0:
            break
        if keep.size < active.size:
            active, part, memory = active[keep], take(part, keep), memory.keep(keep)
            state, step = np.ascontiguousarray(state[..., keep]), np.ascontiguousarray(step[..., keep])
            previous = previous and (previous[0][..., keep], previous[1][..., keep])
        if previous is not None:
            slot = (iteration - 1) % DEPTH
            memory.turns[slot] = step - previous[1]
            memory.sums[slot] = memory.turns[slot] + (state - previous[0])
        previous = (state, step)
        known = min(iteration, DEPTH)
        state = blocks.mix(state, step, memory.turns[:known], memory.sums[:known])
    return Solution(final, correction, iterations, converged)
