"""Exact derivatives of a steady state: how it answers to any cause, and which force would move a prediction.

    J dx = -dR        (tangent: one solve for each cause)
    J' l = g          (adjoint: one solve for each prediction; l . dR is then -g . dx for every cause at once)

J is the Jacobian at the steady state. Its single-precision factors are the preconditioner; the tangent is refined with
differences of the residual itself, so it is exact to their precision, effects and boundary conditions included.
"""

import numpy as np

from vegglue import blocks
from vegglue.flow import Array, Problem, residual, take
from vegglue.steady import Factors

# Step [m, m/s] of the central difference along a direction scaled to one.
STEP = 1e-5
ROUNDS = 12


def tangents(problem: Problem, state: Array, shared: Factors, causes: Array, tolerance: float = 1e-7) -> Array:
    """dx = -J^-1 dR, (nx, 3, ny, p), for causes dR (nx, 3, ny, p) at the steady state (nx, 3, ny, 1) of one member.

    Each column is refined until its next correction is below `tolerance` of its largest entry.
    """
    answer = np.zeros_like(causes)
    left = -causes
    for _ in range(ROUNDS):
        correction = shared.solve(left)
        answer += correction
        if (_largest(correction) <= tolerance * _largest(answer)).all():
            break
        left = -causes - along(problem, state, answer)
    return answer


def along(problem: Problem, state: Array, direction: Array) -> Array:
    """J direction, (nx, 3, ny, p), by central differences of the residual."""
    scale = np.maximum(_largest(direction), 1e-300)
    many = take(problem, np.zeros(direction.shape[3], dtype=np.int64))
    ahead = residual(many, state + STEP * direction / scale)
    behind = residual(many, state - STEP * direction / scale)
    return (ahead - behind) * (scale / (2.0 * STEP))


def adjoints(shared: Factors, weights: Array) -> Array:
    """l = J^-T g, (nx, 3, ny, p), for weights g = d(prediction)/d(state) (nx, 3, ny, p); single precision."""
    nx, _, ny, p = weights.shape
    work = weights.astype(np.float32).reshape(nx, 3 * ny, p)
    blocks.solve_transposed(shared.columns, shared.far, work)
    return work.reshape(weights.shape).astype(np.float64)


def _largest(values: Array) -> Array:
    return np.abs(values).max(axis=(0, 1, 2))
