"""The bed between the points of a survey, as measured flow corrects it.

    dz = B F' C^-1 (y - f(z)),   F = R B,   cov = B (I - F' (C + J J')^-1 F) B'

B B' is the covariance of the error of the bed that its survey leaves (case/survey_error.py), R how predictions answer
to the bed of each cell, C the covariance of all errors of the measurements, M included, J the slopes at the calibrated
parameters z, whose prior is N(0, I): one linear step of the best bed and parameters together, of which neither is known
better than both. A spot of the bed of mean g' dz is off or as stated,

    ln B = 1/2 m^2 / s^2 - ln(p / s)

m, s and p being its mean and standard errors with and without the flow: the Savage-Dickey ratio of a mean error N(0,
p^2) against none, all else of the bed as uncertain as it is. s holds fingerprint_error m, since R is not nature's.
Sources: Verdinelli and Wasserman (1995), doi:10.1080/01621459.1995.10476554, for the ratio; Tarantola (2005), Inverse
Problem Theory, section 3.2; not checked against them, the tests compare with the joint Gaussian.
"""

from dataclasses import dataclass, replace

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, model_that_errs, with_error_there
from vegglue.calibration.model_error import cell_responses, terms_that_err
from vegglue.calibration.score_test import project
from vegglue.case.bed_error import SurveyedLine, bed_error_columns, surveyed_lines
from vegglue.case.grid import Grid
from vegglue.decision_constants import constants

# Below it a standard error counts as this [m]: far less than any bed is known to.
LEAST_KNOWN = 1e-9
# Spots times cells whose weights are computed at a time, and cells whose errors are: some 20 MB.
MOST_WEIGHTS, CELLS_AT_A_TIME = 2_000_000, 10_000


@dataclass(frozen=True)
class LearnedBed:
    """The correction of a surveyed bed that is likeliest after the flow was measured.

    Attributes
    ----------
    correction : ndarray (nx, ny)
        dz [m].
    before : ndarray (nx ny, k)
        Columns B of its covariance before the flow was measured [m].
    left : ndarray (k, k)
        W, so that the columns after are B W [-].
    """

    grid: Grid
    correction: Array
    before: Array
    left: Array

    @property
    def error(self) -> Array:
        """Standard error of the corrected bed (nx, ny) [m]."""
        parts = np.array_split(self.before, len(self.before) // CELLS_AT_A_TIME + 1)
        found = [np.linalg.norm(part @ self.left, axis=1) for part in parts]
        return np.concatenate(found).reshape(self.correction.shape)


@dataclass(frozen=True)
class BedOfSpots:
    """Means of the corrected bed over spots.

    Attributes
    ----------
    mean : ndarray (spot,)
        [m]
    error, before : ndarray (spot,)
        Standard errors, and those before the flow was measured [m].
    columns : ndarray (spot, k)
        Of the covariance of the means [m].
    """

    mean: Array
    error: Array
    before: Array
    columns: Array

    @property
    def log_factor(self) -> Array:
        """ln B (spot,), see above; 0 where the survey leaves nothing open."""
        error, before = np.maximum(self.error, LEAST_KNOWN), np.maximum(self.before, LEAST_KNOWN)
        return np.asarray(0.5 * (self.mean / error) ** 2 - np.log(before / error))


def bed_of_spots(learned: LearnedBed, x: Array, y: Array, length: Array, width: Array) -> BedOfSpots:
    """Means of the corrected bed with weights exp(-((x - x_0) / l)^2 - ((y - y_0) / w)^2).

    Parameters
    ----------
    x, y, length, width : ndarray (spot,)
        x_0, y_0, l and w [m].
    """
    grid = learned.grid
    along, across = (
        np.exp(-(((cells[None] - middles[:, None]) / radius[:, None]) ** 2))
        for cells, middles, radius in ((grid.x, x, length), (grid.y, y, width))
    )
    mean, before = np.empty(x.size), np.empty((x.size, learned.before.shape[1]))
    for some in np.array_split(np.arange(x.size), x.size * learned.correction.size // MOST_WEIGHTS + 1):
        weight = (along[some, :, None] * across[some, None, :]).reshape(some.size, -1)
        weight /= weight.sum(axis=1, keepdims=True)
        mean[some] = weight @ learned.correction.ravel()
        before[some] = weight.astype(learned.before.dtype, copy=False) @ learned.before
    columns = before @ learned.left
    error = np.hypot(np.linalg.norm(columns, axis=1), constants().fingerprint_error * mean)
    return BedOfSpots(mean, error, np.linalg.norm(before, axis=1), columns)


def learned_bed(base: Baseline) -> LearnedBed | None:
    """dz = B F' C^-1 (y - f(z)) of a calibrated model, on the cells on which its own error was computed.

    Experiments with a bed of their own are left out: their flow does not depend on the bed of the others.

    Returns
    -------
    LearnedBed or None
        None if no survey states an error.
    """
    where = model_that_errs(base)
    model, grid = where.model, where.model.site.grid
    if not bed_error_columns(model.case, grid).any():
        return None
    cells = cell_responses(model, where.point, terms_that_err(model.case, model.case.model_error))
    where, columns = with_error_there(where, cells), bed_error_columns(model.case, grid)
    answers = cells.of["bed"].reshape(len(model.station), -1) @ columns
    del cells  # several times what is kept of them
    answers[model.station["experiment"].isin(model.site.own)] = 0.0
    residual = where.noise.whiten(where.noise.residual(where.point.prediction))
    slope, white = (where.noise.whiten(where.noise.used(part)) for part in (where.point.slope, answers))
    amounts = white.T @ residual
    seen = project(slope, residual, where.point.z, white).fingerprints  # seen' seen = F' (C + J J')^-1 F
    values, vectors = np.linalg.eigh(np.eye(columns.shape[1]) - seen.T @ seen)
    # The symmetric root: that of the eigenvectors alone depends on their signs, and with it what is drawn by it.
    left = ((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T).astype(columns.dtype)
    return LearnedBed(grid, np.einsum("ck,k->c", columns, amounts).reshape(grid.x.size, grid.y.size), columns, left)


def line_offset(loose: Baseline, line: SurveyedLine, tight: Baseline) -> tuple[float, float]:
    """By how much a surveyed line is too high, and its standard error, by survey and flow.

        d = d_0 + s^2 F' r,   s = (1 / s_0^2 + F' F)^(-1/2),   F = -W R w

    d_0 and s_0 are those of its survey alone, r the whitened residual, and w how the bed rises with the line. W whitens
    by the errors of the model with its level, and takes off what parameters can mimic.

    Parameters
    ----------
    loose : Baseline
        Calibrated without the level of the line.
    tight : Baseline
        With its level; its errors have no part of it.

    Returns
    -------
    float, float
        d and s [m].
    """
    where = model_that_errs(loose)
    model, known = where.model, surveyed_lines(tight.model.case, where.model.site.grid)
    column = known.lines.index(line)
    noise = replace(where.noise, lower=tight.noise.lower)
    answers = cell_responses(model, where.point, ("bed",)).of["bed"].reshape(len(model.station), -1)
    trace = -(answers @ known.weights[:, column : column + 1])
    trace[model.station["experiment"].isin(model.site.own)] = 0.0
    residual = noise.whiten(noise.residual(where.point.prediction))
    slope, white = (noise.whiten(noise.used(part)) for part in (where.point.slope, trace))
    seen = project(slope, residual, where.point.z, white)
    h, columns = known.evidence
    of_survey = columns[:, column]
    squared = float(of_survey @ of_survey) + float(seen.length[0]) ** 2
    offset = float(of_survey @ h) / float(of_survey @ of_survey)
    return offset + float(seen.fingerprints[:, 0] @ seen.residual) / squared, float(squared**-0.5)
