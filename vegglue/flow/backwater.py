"""A state to begin from: the gradually varied flow of each cross-section's conveyance."""

import numpy as np

from vegglue.arrays import Array
from vegglue.effects import physical_constants
from vegglue.flow.closures import bed_drag
from vegglue.flow.problem import ALONG, LEVEL, Problem

# Largest slope of the energy line [-]: above it the estimate in one dimension would run away from the bed. Chosen, not
# measured, twenty times that of a bed of 1 in 1,000; it decides where Newton starts, not where it ends.
STEEPEST = 0.02


def backwater(problem: Problem) -> Array:
    """dz_s/dx = -(Q / K)^2 from the outlet upstream, K = sum C h^(3/2) dy, u = C sqrt(h S): a state (nx, 3, ny, m).

    Chow (1959), Open-Channel Hydraulics, ch. 9; Q is what has entered upstream of each section, C that of the bed alone
    (patches of plants rarely fill a section). Only a start.
    """
    (nx, ny), m = problem.shape, problem.members
    state = np.zeros((nx, 3, ny, m))
    discharge = _discharge(problem)
    level, bed = problem.boundaries.outlet_level.copy(), problem.bed[:, :, None]
    bed = bed + problem.bed_rise if problem.bed_rise.size else bed
    for i in range(nx - 1, -1, -1):
        depth = np.maximum(level - bed[i], 0.0) + 0.01 * problem.film
        chezy = np.sqrt(physical_constants.GRAVITY / (bed_drag(problem, depth[None], slice(i, i + 1))[0] * depth))
        wet = np.where(depth > problem.film, depth, 0.0)
        conveyance = (chezy * wet**1.5).sum(axis=0) * problem.dy + 1e-9
        slope = np.minimum((discharge[i] / conveyance) ** 2, STEEPEST)
        state[i, LEVEL], state[i, ALONG] = level, chezy * np.sqrt(wet * slope)
        level = np.maximum(level + slope * problem.dx, bed[i].min(axis=0) + 10.0 * problem.film)
    return state


def _discharge(problem: Problem) -> Array:
    """Discharge through every cross-section (nx, m) [m3/s]: what enters at or above it."""
    discharge = np.zeros((problem.shape[0], problem.members))
    for inflow in problem.boundaries.inflows:
        if inflow.side == "west":
            discharge += inflow.discharge
            continue
        share = np.clip((np.arange(problem.shape[0]) - inflow.start + 1) / (inflow.stop - inflow.start), 0.0, 1.0)
        discharge += share[:, None] * inflow.discharge
    return discharge
