"""The bed between the points of a survey, as measured flow corrects it.

    dz = B F' C^-1 (y - f(z)),   F = R B,   cov = B (I - F' (C + J J')^-1 F) B'

B B' is the covariance of the error of the bed that its survey leaves (case/survey_error.py), R how predictions answer
to the bed of each cell, C the covariance of all errors of the measurements, M included, J the slopes at the calibrated
parameters z, whose prior is N(0, I): one linear step of the best bed and parameters together, of which neither is known
better than both. Source: Tarantola (2005), Inverse Problem Theory, section 3.2; not checked against it, the tests
compare with the joint Gaussian.
"""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array, Mask
from vegglue.calibration.baseline import Baseline, model_that_errs
from vegglue.calibration.fingerprints import least_depth
from vegglue.calibration.model_error import cell_responses
from vegglue.calibration.score_test import project
from vegglue.case.bed_error import bed_error_columns
from vegglue.case.grid import Grid
from vegglue.engine.interface import Model, Point, flow_at_centres


@dataclass(frozen=True)
class LearnedBed:
    """Most likely correction dz (nx, ny) [m] of the bed on a grid, and columns (nx ny, k) [m] of its covariance."""

    grid: Grid
    correction: Array
    columns: Array

    @property
    def error(self) -> Array:
        """Standard error of the corrected bed (nx, ny) [m]."""
        return np.asarray(np.linalg.norm(self.columns, axis=1).reshape(self.correction.shape))


def learned_bed(base: Baseline) -> LearnedBed | None:
    """That of a calibrated model, on the cells on which its own error was computed; None if no survey states an error.

    Experiments with a bed of their own are left out: their flow does not depend on the bed of the others.
    """
    where = model_that_errs(base)
    model, grid = where.model, where.model.site.grid
    columns = bed_error_columns(model.case, grid)
    if not columns.any():
        return None
    answers = cell_responses(model, where.point, ("bed",)).of["bed"].reshape(len(model.station), -1) @ columns
    answers[model.station["experiment"].isin(model.site.own)] = 0.0
    residual = where.noise.whiten(where.noise.residual(where.point.prediction))
    slope, white = (where.noise.whiten(where.noise.used(part)) for part in (where.point.slope, answers))
    amounts = white.T @ residual
    seen = project(slope, residual, where.point.z, white).fingerprints  # seen' seen = F' (C + J J')^-1 F
    values, vectors = np.linalg.eigh(np.eye(columns.shape[1]) - seen.T @ seen)
    left = columns @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    return LearnedBed(grid, (columns @ amounts).reshape(grid.x.size, grid.y.size), left)


def wet_cells(base: Baseline) -> Mask:
    """Cells of the grid of `learned_bed` that are under water in any experiment (nx, ny), see `least_depth`."""
    where = model_that_errs(base)
    flows = [flow_at_centres(where.model, where.point, experiment) for experiment in where.point.flows]
    return np.asarray(np.any([flow.depth > least_depth(where.model) for flow in flows], axis=0))


def changed_by(learned: LearnedBed, model: Model, point: Point) -> tuple[Array, Array]:
    """How predictions (station,) change with the correction, and columns (station, k) of what its error leaves, by one
    linear step; model: on the cells of the correction, at any stations.
    """
    answers = cell_responses(model, point, ("bed",)).of["bed"].reshape(len(model.station), -1).astype(float)
    answers[model.station["experiment"].isin(model.site.own)] = 0.0
    return answers @ learned.correction.ravel(), answers @ learned.columns
