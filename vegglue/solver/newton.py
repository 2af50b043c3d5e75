"""Steady states of one member: Newton with pseudo-time from afar, chord steps with its own factors at the end.

Newton solves (D/dt + J) delta = -R, D the storage of each unknown, dt growing until it no longer matters (Kelley and
Keyes 1998, doi:10.1137/S0036142996304796). However a member was reached, it is accepted on its own residual only: the
largest correction J^-1 R, in m/s and m, is below the tolerance.
"""

from dataclasses import replace

import numpy as np

from vegglue.arrays import Array, Single
from vegglue.flow.chord_equations import eased, slope_of_friction
from vegglue.flow.equations import storage
from vegglue.flow.problem import LEVEL, Problem
from vegglue.solver.chord import LONGEST_CORRECTION, ChordSolution, chord
from vegglue.solver.jacobian import Factors, eliminate, factors, jacobian, solved

# Near enough [m, m/s] for chord steps to do the rest, and for neighbours to lean on factors made there: chosen, not
# measured. Factors made 0.3 m/s away from the root led 60 of 63 members of one cluster astray (DECISIONS).
CLOSE = 2e-2


def _stored(problem: Problem, state: Array) -> Single:
    """dh/dz_s of each level, 1 for velocities: (nx, n)."""
    nx, _, ny, _ = state.shape
    stored = np.ones((nx, 3, ny), np.float32)
    stored[:, LEVEL] = storage(problem, state[:, LEVEL])[..., 0]
    return stored.reshape(nx, 3 * ny)


def newton(problem: Problem, start: Array, tolerance: float, most: int = 60, time_step: float = 10.0) -> ChordSolution:
    """One member (m = 1) from a start that may be far away."""
    state, size = start, np.inf
    # Not at the outlet: levels of dry land there have no storage that would hold them while velocities are still far.
    nowhere = np.zeros(start.shape[2], dtype=bool)
    for iteration in range(1, most + 1):
        slope = slope_of_friction(problem, state)
        rates, columns_far = eased(problem, state, slope, nowhere), jacobian(problem, state)
        stored = _stored(problem, state)
        step, time_step = _bounded_step(rates, columns_far, stored, time_step)
        size = float(np.abs(step).max())
        if not size < LONGEST_CORRECTION:
            return _alone(state, size, iteration, False)
        state = state + step
        if size < tolerance and time_step > min(1e4, 1.0 / tolerance):
            return _alone(state, size, iteration, True)
        time_step = min(time_step * (8.0 if size < 0.02 else 2.0 if size < 0.12 else 1.0), 1e9)
    return _alone(state, size, most, False)


def finish(problem: Problem, near: Array, tolerance: float, rounds: int = 4) -> tuple[ChordSolution, Factors | None]:
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
            return end, shared if moved < CLOSE else factors(problem, end.state)
        if not end.correction[0] < min(largest, LONGEST_CORRECTION):
            break
        state, largest = end.state, float(end.correction[0])
    return end, None


def _bounded_step(
    rates: Array, columns_far: tuple[Single, Single], stored: Single, time_step: float
) -> tuple[Array, float]:
    """-(D/dt + J)^-1 R with dt cut until no entry is as long as LONGEST_CORRECTION; the last one tried if none is."""
    columns, far = columns_far
    diagonal = np.arange(far.shape[1])
    for _ in range(12):
        shifted = columns.copy()
        shifted[:, 1, diagonal, diagonal] += stored / np.float32(time_step)
        eliminate(shifted, far)
        step = -solved(shifted, far, rates)
        if np.abs(step).max() < LONGEST_CORRECTION:
            break
        time_step /= 4.0
    return step, time_step


def _alone(state: Array, size: float, iterations: int, converged: bool) -> ChordSolution:
    return ChordSolution(state, np.array([size]), np.array([iterations]), np.array([converged]))
