"""Whether measurements that no calibration has seen agree with a calibrated model: errors over what was to be expected.

    ratio = (mean e^2 / mean (s_0^2 + m_i + g^2 + J_i V J_i'))^(1/2)

e are the errors of velocities that were not seen, s_0 their stated standard error (that of what was seen where it is
not stated), m the variance of the model's own error, g the error of the grid where it was seen, V the covariance of the
parameters and J the slopes.
"""

import numpy as np

from vegglue.calibration.baseline import Baseline
from vegglue.calibration.model_error import model_error_columns
from vegglue.case.schema import Case
from vegglue.engine.interface import Model, linearise
from vegglue.measurements.kinds import STREAMWISE


def unseen_ratio(base: Baseline, unseen: Model) -> float:
    """The ratio [-], NaN without velocities that were not seen, infinite where the model finds no flow for them;
    unseen: the model at stations it has not seen.
    """
    there = Model(_case_there(base, unseen), unseen.site, unseen.station, unseen.engine)
    point = linearise(there, base.fitted.point.z)
    station = there.station
    rows = (station["used"] & (station["kind"] == STREAMWISE)).to_numpy(bool)
    if not rows.any():
        return float("nan")
    if point is None:
        return float("inf")
    seen = base.model.station["kind"].to_numpy()[base.noise.rows] == STREAMWISE
    floor = float(np.mean(base.noise.data_error[seen] ** 2)) if seen.any() else 0.0
    stated = station["standard_error"].to_numpy(float)[rows] ** 2
    own = (model_error_columns(there, point, there.case.model_error)[rows] ** 2).sum(axis=1)
    grid = float(np.mean(base.noise.grid_error[seen] ** 2)) if seen.any() else 0.0
    slope = point.slope[rows]
    known = np.einsum("ij,jk,ik->i", slope, base.fitted.covariance, slope)
    expected = np.where(stated > 0, stated, floor) + own + grid + known
    error = station["value"].to_numpy(float)[rows] - point.prediction[rows]
    return float(np.sqrt(np.mean(error**2) / np.mean(expected)))


def _case_there(base: Baseline, unseen: Model) -> Case:
    """The case as it was calibrated, effects included, with the experiments that were not seen."""
    return base.model.case.model_copy(
        update={"experiments": unseen.case.experiments, "observations": unseen.case.observations}
    )
