"""The Jacobian of one member by coloured differences of its residual, and its factors, which serve neighbours too."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vegglue import blocks, easing
from vegglue.flow import Array, Problem, friction_slope, residual, take, thickness

Single = NDArray[np.float32]

STEP = 1e-6
# Disturbed together: 15, as many as there are colours in a quarter, take a quarter longer than 16.
LANES = 16


@dataclass(frozen=True)
class Factors:
    """The eliminated Jacobian of one member: J^-1 costs three products a column.

    Beside it what chord steps need of the state it was made at, see `easing`: slopes of friction [1/s], depths of faces
    [m] and how velocities answer to levels there [1/s].
    """

    columns: Single
    far: Single
    slope: Array
    thick: Array
    answer: Array

    def solve(self, right: Array) -> Array:
        """J^-1 right, (nx, 3, ny, m)."""
        return solved(self.columns, self.far, right)

    def step(self, rates: Array) -> Single:
        """-J^-1 R in the unknowns of chord steps (nx, 3, ny, m): levels, velocities times rho where water is thin."""
        nx, _, ny, m = rates.shape
        work = np.multiply(rates, -1.0, dtype=np.float32, casting="same_kind")
        blocks.solve(self.columns, self.far, work.reshape(nx, 3 * ny, m))
        easing.tilt(work, self.answer)
        return work


def solved(columns: Single, far: Single, right: Array) -> Array:
    """J^-1 right, (nx, 3, ny, m), of factors."""
    nx, _, ny, m = right.shape
    work = right.astype(np.float32).reshape(nx, 3 * ny, m)
    blocks.solve(columns, far, work)
    return work.reshape(right.shape).astype(np.float64)


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
    return Factors(columns, far, friction_slope(problem, state), *thickness(problem, state))
