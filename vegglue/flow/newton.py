"""Steady states of one member: Newton with pseudo-time from afar, chord steps with its own factors at the end.

Newton solves (D/dt + J) delta = -R, D the storage of each unknown, dt growing until it no longer matters. However a
member was reached, it is accepted on its own residual only: the largest correction J^-1 R [m, m/s] is below the
tolerance.
"""

from dataclasses import dataclass, replace

import numpy as np

from vegglue.arrays import Array
from vegglue.flow.chord import LONGEST_CORRECTION, ChordSolution, chord
from vegglue.flow.equations import storage
from vegglue.flow.jacobian import Factors, factors, jacobian, solved
from vegglue.flow.problem import LEVEL, Problem
from vegglue.flow.thin_water import eased, slope_of_friction

# Near enough [m, m/s] for chord steps to do the rest, and for neighbours to use factors made there: chosen, not
# measured. Factors made 0.3 m/s away from the root led 60 of 63 members of one cluster astray.
CLOSE = 2e-2
# By how much the pseudo-time step grows after a correction below so much [m, m/s], the nearest first, and its longest
# [s]. Chosen, not measured: faster growth saves factorisations where the root is near, and throws a member off where it
# is not, which costs every cut of the step that follows.
GROWTHS, LONGEST_TIME_STEP = ((0.02, 8.0), (0.12, 2.0)), 1e9
# The pseudo-time step [s] from which a small correction is that of the steady state, at most: chosen, not measured. In
# less time a member that is far from rest moves little, too.
STEADY_TIME_STEP = 1e4
# How often the pseudo-time step is cut at most, and by what. Chosen, not measured: twelve such cuts make 10 s a
# millionth of a second, and no more would help; smaller cuts cost more factorisations, larger ones iterations after.
MOST_CUTS, CUT = 12, 4.0
# Chord steps with one set of factors, and sets of factors, at most. Chosen, not measured: fewer steps factorise more
# often, more are wasted where factors made too far away do not pull; four sets leave a member that is not near to
# Newton early.
STEPS_PER_FACTORS, MOST_FACTORS = 14, 4


@dataclass(frozen=True)
class Beginning:
    """Iterations of Newton at most, and its first pseudo-time step [s].

    Chosen, not measured: a longer first step saves iterations near the root, and is cut again elsewhere, at a
    factorisation each; more iterations seldom find what another way finds at their price.
    """

    most: int
    time_step: float


# From a backwater curve, from a member nearby, and from where a march stands.
FROM_AFAR, FROM_NEARBY, FROM_A_MARCH = Beginning(60, 10.0), Beginning(12, 200.0), Beginning(25, 50.0)


def newton(problem: Problem, start: Array, tolerance: float, how: Beginning = FROM_AFAR) -> ChordSolution:
    """x <- x - (D/dt + J)^-1 R(x), dt growing as corrections shrink: one member from a start that may be far away.

    Parameters
    ----------
    problem
        Of one member.
    start
        State (nx, 3, ny, 1).
    tolerance
        Largest correction [m, m/s] of a converged member.
    how
        Iterations and first pseudo-time step.

    Returns
    -------
    ChordSolution
        Not converged after `how.most` iterations, or if no cut of the step keeps it below LONGEST_CORRECTION.

    References
    ----------
    Kelley and Keyes (1998), doi:10.1137/S0036142996304796.
    """
    state, size, time_step = start, np.inf, how.time_step
    nx, _, ny, _ = start.shape
    # Not at the outlet: levels of dry land there have no storage that would hold them while velocities are still far.
    nowhere = np.zeros(ny, dtype=bool)
    for iteration in range(1, how.most + 1):
        slope = slope_of_friction(problem, state)
        rates, system = eased(problem, state, slope, nowhere), jacobian(problem, state)
        stored = np.ones((nx, 3, ny), np.float32)  # D: dh/dz_s of each level, 1 for velocities
        stored[:, LEVEL] = storage(problem, state[:, LEVEL])[..., 0]
        for _ in range(MOST_CUTS):
            step = -solved(system.inverse(stored / np.float32(time_step)), rates).astype(np.float64)
            size = float(np.abs(step).max())
            if size < LONGEST_CORRECTION:
                break
            time_step /= CUT
        else:
            return _alone(state, size, iteration, False)
        state = state + step
        if size < tolerance and time_step > min(STEADY_TIME_STEP, 1.0 / tolerance):
            return _alone(state, size, iteration, True)
        growth = next((growth for below, growth in GROWTHS if size < below), 1.0)
        time_step = min(time_step * growth, LONGEST_TIME_STEP)
    return _alone(state, size, how.most, False)


def _alone(state: Array, size: float, iterations: int, converged: bool) -> ChordSolution:
    return ChordSolution(state, np.array([size]), np.array([iterations]), np.array([converged]))


def finish(problem: Problem, near: Array, tolerance: float) -> tuple[ChordSolution, Factors | None, float]:
    """x <- x - M^-1 R(x), the factors M of J renewed while they help: one member from a start near its root.

    Parameters
    ----------
    problem, near, tolerance
        As in `newton`.

    Returns
    -------
    ChordSolution
        Where it ended.
    Factors or None
        Of J as it was used last; None if no root was found.
    float
        By how much the state has moved since those factors [m, m/s]; 0 within CLOSE.

    References
    ----------
    Shamanskii (1967), Ukrainian Mathematical Journal 19, 133, not checked against it.
    """
    state, spent, largest = near, 0, np.inf
    for _ in range(MOST_FACTORS):
        shared = factors(problem, state)
        end = chord(problem, state, shared, tolerance, most=STEPS_PER_FACTORS)
        spent += int(end.iterations[0])
        moved = float(np.abs(end.state - state).max())
        end = replace(end, iterations=np.array([spent]))
        if end.converged[0]:
            return end, shared, moved if moved >= CLOSE else 0.0
        if not end.correction[0] < min(largest, LONGEST_CORRECTION):
            break
        state, largest = end.state, float(end.correction[0])
    return end, None, np.inf
