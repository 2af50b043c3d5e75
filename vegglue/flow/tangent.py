"""Exact derivatives of a steady state: how it changes with any cause, and which force would move a prediction.

    J dx = -dR        (tangent: one solve for each cause)
    J' l = g          (adjoint: one solve for each prediction; l . dR is then -g . dx for every cause at once)

J is the Jacobian at the steady state, known by differences of the residual itself, effects and boundary conditions
included. Its single-precision factors, which may be those of a state nearby, are the preconditioner of generalised
conjugate residuals: if a cell is about to fall dry they can be so far off that mere repetition runs away.
"""

import numpy as np

from vegglue.arrays import Array, Single
from vegglue.flow.equations import residual
from vegglue.flow.jacobian import Factors, SharedFactors, column_held, shared_inflows, sharing_at, solved
from vegglue.flow.problem import LEVEL, Problem, take

# Step [m, m/s] of the central difference along a direction scaled to one: chosen, not measured. Tangents agree with
# differences of solved states to 1e-4 (test_tangent).
DIRECTION_STEP = 1e-5
# Rounds of residuals at most [-]: chosen, not measured; where factors are those of the state itself a few are enough.
MOST_ROUNDS = 12
# Causes answered together [-], and on wide grids: what has been tried for each is kept, so that more need more memory.
CAUSE_SLOTS, WIDE_CAUSE_SLOTS = 16, 8
# Sparse factors are those of a matrix near J: what the last correction leaves is up to 0.3 of it [-], of others a
# hundredth, so that corrections go on to a smaller one.
FURTHER_IF_SPARSE = 0.1
# Corrections of adjoints beside side inflows [-]: each leaves less than a hundredth of what the last one did.
REPEATS = 2


def tangents(problem: Problem, state: Array, shared: Factors, causes: Array, tolerance: float = 1e-7) -> Array:
    """J dx = -dR: how a steady state changes with causes, by generalised conjugate residuals.

    Parameters
    ----------
    problem, state
        Of one member at its steady state (nx, 3, ny, 1).
    shared
        Factors of J there or nearby, the preconditioner.
    causes
        dR of each cause (nx, 3, ny, p).
    tolerance
        Each column is refined until its next correction is below so much of its largest entry [-].

    Returns
    -------
    array
        dx (nx, 3, ny, p).

    References
    ----------
    Eisenstat, Elman and Schultz (1983), doi:10.1137/0720023.
    """
    found, slots = np.empty_like(causes), CAUSE_SLOTS
    if isinstance(shared.inverse, SharedFactors):
        tolerance, slots = tolerance * FURTHER_IF_SPARSE, WIDE_CAUSE_SLOTS
    for first in range(0, causes.shape[3], slots):
        some = slice(first, first + slots)
        left = -np.ascontiguousarray(causes[..., some])
        answer, tried = np.zeros_like(left), list[tuple[Array, Array]]()
        for _ in range(MOST_ROUNDS):
            step = shared.solve(left)
            if (_largest(step) <= tolerance * _largest(answer)).all():
                answer = answer + step
                break
            moved = jacobian_times(problem, state, step)
            for earlier, its in tried:
                share = _product(its, moved)
                step, moved = step - share * earlier, moved - share * its
            length = np.maximum(np.sqrt(_product(moved, moved)), 1e-300)
            step, moved = step / length, moved / length
            tried.append((step, moved))
            gain = _product(moved, left)
            answer, left = answer + gain * step, left - gain * moved
        found[..., some] = answer
    return found


def jacobian_times(problem: Problem, state: Array, direction: Array) -> Array:
    """J direction, (nx, 3, ny, p), by central differences of the residual."""
    scale = np.maximum(_largest(direction), 1e-300)
    count = direction.shape[3]
    step = DIRECTION_STEP * direction / scale
    both = residual(take(problem, np.zeros(2 * count, dtype=np.int64)), np.concatenate([state + step, state - step], 3))
    return (both[..., :count] - both[..., count:]) * (scale / (2.0 * DIRECTION_STEP))


def adjoints(problem: Problem, state: Array, shared: Factors, weights: Array | Single) -> Single:
    """J' l = g: the force on each unknown that would move predictions, in single precision.

    Where inflows through a side share by depth, the factors are those of an A near J, and l is corrected REPEATS times
    by A^-T (g - J' l).

    Parameters
    ----------
    problem, state, shared
        Of one member at its steady state (nx, 3, ny, 1), and factors of its J.
    weights
        g = d prediction / d state (nx, 3, ny, p).

    Returns
    -------
    array
        l (nx, 3, ny, p).
    """
    sides = [inflow for inflow in shared_inflows(problem) if inflow.side != "west"]
    exact = isinstance(shared.inverse, SharedFactors)
    sharings = [] if exact else [sharing_at(problem, state, inflow) for inflow in sides]
    first = solved(shared.inverse, weights, transposed=True)
    if not sharings:
        return first
    answer = correction = first.astype(np.float64)
    for _ in range(REPEATS):
        left = np.zeros_like(correction)  # (A - J)' l: what A puts down to columns that its blocks hold
        levels = left[:, LEVEL]
        for one in sharings:
            blocks = np.flatnonzero(one.answer.any(axis=(1, 2)))
            of_blocks = np.einsum("ikj,ikjp->ip", one.answer[blocks], correction[blocks])
            for block, weight in zip(blocks, of_blocks, strict=True):
                change = one.slope[:, None] * weight
                np.add.at(levels, (one.column, one.row), change)
                np.add.at(levels, (column_held(one.column, int(block)), one.row), -change)
        correction = solved(shared.inverse, left, transposed=True).astype(np.float64)
        answer = answer + correction
    return answer.astype(np.float32)


def _product(one: Array, other: Array) -> Array:
    return np.asarray(np.einsum("ikjp,ikjp->p", one, other))


def _largest(values: Array) -> Array:
    """Largest |value| of each column (p,), one by one: over all at once it takes six times as long."""
    return np.array([np.abs(values[..., column]).max() for column in range(values.shape[3])])
