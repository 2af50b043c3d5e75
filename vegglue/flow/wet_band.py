"""The rows of a problem that are solved: those that may be wet, with a margin."""

from dataclasses import replace

import numpy as np

from vegglue.arrays import Array
from vegglue.flow.chord import ChordSolution, chord
from vegglue.flow.jacobian import Factors
from vegglue.flow.problem import ACROSS, LEVEL, Problem, above_bed, crop

# Rows whose bed lies further than this [m] above the water are left out of the band that is solved: chosen, not
# measured. Less makes members outgrow the band of their reference more often, more solves rows of land.
MARGIN = 0.1


def wet_band(problem: Problem, start: Array) -> tuple[int, int]:
    """Rows start .. stop - 1 to solve: those that may be wet, with a margin.

    With whole sides through which water enters, and with an inflow that stands apart.

    Parameters
    ----------
    start : (nx, 3, ny, m)
    """
    above = above_bed(problem, start[:, LEVEL]).max(axis=(0, 2))
    wet = np.flatnonzero(above > -MARGIN)
    if not wet.size:
        return 0, problem.shape[1]
    sides = {inflow.side for inflow in problem.boundaries.inflows}
    south = 0 if "south" in sides else max(int(wet[0]) - 1, 0)
    north = problem.shape[1] if "north" in sides else min(int(wet[-1]) + 2, problem.shape[1])
    for inflow in problem.boundaries.inflows:  # one that enters over dry rows alone wets them
        if inflow.side == "west" and (inflow.stop <= south or inflow.start >= north):
            south, north = min(south, inflow.start), max(north, inflow.stop)
    return south, north


def overflows(part: Problem, state: Array, band: tuple[int, int], ny: int) -> np.ndarray:
    """Whether water stands in an outermost row of the band, where a wall is that the problem does not have (m,).

    Parameters
    ----------
    part : Problem
        Of the rows of the band.
    state : (nx, 3, rows, m)
    band : (start, stop)
    ny : int
        Rows of the whole problem.
    """
    above = above_bed(part, state[:, LEVEL])
    south = (above[:, 0].max(axis=0) > 0.0) & (band[0] > 0)
    north = (above[:, -1].max(axis=0) > 0.0) & (band[1] < ny)
    return south | north


def rows_inside(state: Array, band: tuple[int, int]) -> Array:
    """The rows of a band, (nx, 3, rows, m)."""
    return walled(np.array(state[:, :, band[0] : band[1]], order="C"))


def walled(rows: Array) -> Array:
    """The rows given, in place, with no flow through their first side."""
    rows[:, ACROSS, 0] = 0.0
    return rows


def widen(part: Array, rows: int, band: tuple[int, int]) -> Array:
    """A state of a band put back into all rows; beyond it the level runs on flat and nothing moves.

    Parameters
    ----------
    part : (nx, 3, band rows, m)
    band : (start, stop)

    Returns
    -------
    (nx, 3, rows, m)
    """
    nx, _, _, m = part.shape
    wide = np.zeros((nx, 3, rows, m))
    wide[:, :, band[0] : band[1]] = part
    wide[:, LEVEL, : band[0]] = part[:, LEVEL, :1]
    wide[:, LEVEL, band[1] :] = part[:, LEVEL, -1:]
    return wide


def chord_in_band(
    problem: Problem, start: Array, shared: Factors, band: tuple[int, int], tolerance: float, most: int = 25
) -> ChordSolution:
    """x <- x - M^-1 R(x) in the band of a reference; a member that outgrows it counts as not converged.

    Parameters
    ----------
    problem : Problem
        Of all rows.
    start : (nx, 3, band rows, m)
    shared, tolerance, most
        As `chord`.
    band : (start, stop)
    """
    part = crop(problem, *band)
    solution = chord(part, start, shared, tolerance, most)
    overflowing = overflows(part, solution.state, band, problem.shape[1])
    correction = np.where(overflowing, np.inf, solution.correction)
    return replace(solution, converged=solution.converged & ~overflowing, correction=correction)
