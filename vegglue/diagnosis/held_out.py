"""Whether measurements that no calibration has seen agree with a calibrated model: errors over what was to be expected.

    ratio = (|e|^2 / tr S)^(1/2),   S = diag(s_0^2 + (1 - c) g^2) + A A',   A = [M, c^(1/2) g 1, J V^(1/2)]

e are the errors of velocities that were not seen, s_0 their stated standard errors (those of what was seen where they
are not stated), M the columns of the model's own error, g the error of the grid where it was seen and c its
correlation, V the covariance of the parameters and J the slopes. Errors alone exceed (chi2 / k)^(1/2) in 5 % of cases,
chi2 the 95 % point with k = (tr S)^2 / tr S^2 degrees of freedom: few measurements, or many that err alike, are
few.
Source: Satterthwaite (1946), doi:10.2307/3002019, for k; not checked against it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline
from vegglue.calibration.model_error import model_error_columns
from vegglue.case.schema import Case
from vegglue.engine.interface import Model, Point, linearise
from vegglue.measurements.kinds import leading_velocities

# How often errors alone exceed what is told of them; 5 % is usual.
BY_CHANCE = 0.05


@dataclass(frozen=True)
class HeldOutErrors:
    """Errors at what was not seen, over those expected [-], and the ratio that errors alone exceed in 5 % of cases.

    ratio: NaN without velocities that were not seen, infinite where the model finds no flow for them.
    """

    ratio: float
    by_chance: float


def held_out_errors(base: Baseline, unseen: Model) -> HeldOutErrors:
    """Those of a calibrated model; unseen: the model at stations it has not seen."""
    there = Model(_case_there(base, unseen), unseen.site, unseen.station, unseen.engine)
    point = linearise(there, base.fitted.point.z)
    rows = np.flatnonzero(leading_velocities(there.station))
    if not rows.size or point is None:
        return HeldOutErrors(float("inf") if rows.size else float("nan"), 1.0)
    error = there.station["value"].to_numpy(float)[rows] - point.prediction[rows]
    own, alike = _expected(base, there, point, rows)
    squares = (alike**2).sum(axis=1)
    total = float((own + squares).sum())
    degrees = total**2 / float((own**2 + 2.0 * own * squares).sum() + ((alike.T @ alike) ** 2).sum())
    by_chance = float(np.sqrt(chdtri(degrees, BY_CHANCE) / degrees))
    return HeldOutErrors(float(np.sqrt((error**2).sum() / total)), by_chance)


def _expected(base: Baseline, there: Model, point: Point, rows: np.ndarray) -> tuple[Array, Array]:
    """The diagonal that each station has of its own (n,) [m2/s2] and A (n, k) [m/s], see the head of this file."""
    noise, seen = base.noise, leading_velocities(base.model.station)[base.noise.rows]
    floor, grid = (
        float(np.mean(error[seen] ** 2)) if seen.any() else 0.0 for error in (noise.data_error, noise.grid_error)
    )
    stated = there.station["standard_error"].to_numpy(float)[rows] ** 2
    of_model = model_error_columns(there, point, there.case.model_error)[rows]
    of_grid = np.full((rows.size, 1), np.sqrt(noise.grid_correlation * grid))
    of_parameters = point.slope[rows] @ np.linalg.cholesky(base.fitted.covariance)
    own = np.where(stated > 0, stated, floor) + (1.0 - noise.grid_correlation) * grid
    return own, np.hstack([of_model, of_grid, of_parameters])


def _case_there(base: Baseline, unseen: Model) -> Case:
    """The case as it was calibrated, effects included, with the experiments that were not seen."""
    return base.model.case.model_copy(
        update={"experiments": unseen.case.experiments, "observations": unseen.case.observations}
    )
