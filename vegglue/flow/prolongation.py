"""A state on a finer grid, as a start there."""

import numpy as np

from vegglue.arrays import Array
from vegglue.flow.closures import drag
from vegglue.flow.equations import cell_depths
from vegglue.flow.problem import ACROSS, ALONG, Problem

# How u goes with friction from cells to finer ones, u ~ k^-SHARE [-]. Where friction alone balances the slope it is a
# half; water that mixes with what flows beside changes by less. On a channel with banks, 9,600 cells, lifted flows are
# off by 0.019 m/s with 0 (median of 32 members, root of the mean square), 0.009 with 0.25 and 0.3, 0.012 with a half.
SHARE = 0.3


def on_grid(state: Array, shape: tuple[int, int]) -> Array:
    """A state (nx, 3, ny, m) on a grid of `shape` (nx, ny), along each axis its own or twice as many cells.

    Levels are those of the cell around; velocities on new faces are the mean of both neighbours.
    """
    if shape[0] == 2 * state.shape[0]:
        state = _shorter(state)
    return _narrower(state) if shape[1] == 2 * state.shape[2] else state


def lifted_flows(coarse: Problem, state: Array, fine: Problem) -> Array:
    """As `on_grid`, but u times (k_coarse / k_fine)^SHARE, k the friction rate [1/m] of the laws of bed and plants:
    finer cells have another beside a waterline and at the edges of plants. State (nx, 3, ny, m), of the same members.
    """
    lifted = on_grid(state, fine.shape)
    before, after = drag(coarse, cell_depths(coarse, state)), drag(fine, cell_depths(fine, lifted))
    faster = (_in_each_cell(before, fine.shape) / after) ** SHARE
    lifted[:-1, ALONG] *= 0.5 * (faster[:-1] + faster[1:])
    lifted[-1, ALONG] *= faster[-1]
    return lifted


def _in_each_cell(values: Array, shape: tuple[int, int]) -> Array:
    """Values of cells (nx, ny, m) in the finer ones that they hold."""
    return values.repeat(shape[0] // values.shape[0], axis=0).repeat(shape[1] // values.shape[1], axis=1)


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
