"""A state to begin from: the gradually varied flow of each cross-section's conveyance."""

from dataclasses import replace

import numpy as np

from vegglue.arrays import Array
from vegglue.flow.closures import drag
from vegglue.flow.problem import ALONG, LEVEL, Problem
from vegglue.resistance import physical_constants

# Steeper than this [-], the one-dimensional estimate would run away from the bed.
STEEPEST = 0.02


def backwater(problem: Problem) -> Array:
    """dz_s/dx = -(Q / K)^2 from the outlet upstream, K = sum C h^(3/2) dy, u = C sqrt(h S): a state (nx, 3, ny, m).

    Chow (1959), Open-Channel Hydraulics, ch. 9; Q is what has entered upstream of each section. Only a start.
    """
    (nx, ny), m = problem.shape, problem.members
    state = np.zeros((nx, 3, ny, m))
    flow = _passing(problem)
    level = problem.outlet_level.copy()
    for i in range(nx - 1, -1, -1):
        column = _column(problem, i)
        depth = np.maximum(level - column.bed[0][:, None], 0.0) + 0.01 * problem.film
        chezy = np.sqrt(physical_constants.GRAVITY / (drag(column, depth[None])[0] * depth))
        wet = np.where(depth > problem.film, depth, 0.0)
        conveyance = (chezy * wet**1.5).sum(axis=0) * problem.dy + 1e-9
        slope = np.minimum((flow[i] / conveyance) ** 2, STEEPEST)
        state[i, LEVEL], state[i, ALONG] = level, chezy * np.sqrt(wet * slope)
        level = np.maximum(level + slope * problem.dx, problem.bed[i].min() + 10.0 * problem.film)
    return state


def _column(problem: Problem, i: int) -> Problem:
    """One cross-section as a problem of its own, without plants (their patches rarely fill a section)."""
    none = np.zeros(0, dtype=np.int64)
    empty = np.zeros((0, problem.members))
    plants = replace(problem.plants, column=none, row=none, phi=empty, canopy_height=empty, bare_chezy=empty)
    return replace(
        problem,
        bed=problem.bed[i : i + 1],
        friction_class=problem.friction_class[i : i + 1],
        plants=plants,
        lift=problem.lift[i : i + 1],
        effects=(),
    )


def _passing(problem: Problem) -> Array:
    """Discharge through every cross-section (nx, m) [m3/s]: what enters at or above it."""
    passing = np.zeros((problem.shape[0], problem.members))
    for inflow in problem.inflows:
        if inflow.side == "west":
            passing += inflow.discharge
            continue
        share = np.clip((np.arange(problem.shape[0]) - inflow.start + 1) / (inflow.stop - inflow.start), 0.0, 1.0)
        passing += share[:, None] * inflow.discharge
    return passing
