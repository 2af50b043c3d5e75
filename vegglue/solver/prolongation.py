"""A state on a finer grid, as a start there."""

import numpy as np

from vegglue.arrays import Array
from vegglue.flow.problem import ACROSS, ALONG


def on_grid(state: Array, shape: tuple[int, int]) -> Array:
    """A state (nx, 3, ny, m) on a grid of `shape` (nx, ny), along each axis its own or twice as many cells.

    Levels are those of the cell around; velocities on new faces are the mean of both neighbours.
    """
    if shape[0] == 2 * state.shape[0]:
        state = _shorter(state)
    return _narrower(state) if shape[1] == 2 * state.shape[2] else state


def _shorter(coarse: Array) -> Array:
    """On cells of half the length."""
    fine = np.repeat(coarse, 2, axis=0)
    fine[2::2, ALONG] = 0.5 * (fine[1:-1:2, ALONG] + fine[3::2, ALONG])
    return fine


def _narrower(coarse: Array) -> Array:
    """On cells of half the width."""
    fine = np.repeat(coarse, 2, axis=2)
    fine[:, ACROSS, 1:-1:2] = 0.5 * (fine[:, ACROSS, :-2:2] + fine[:, ACROSS, 2::2])
    return fine
