"""Whether parameters hold from one experiment to the next: each calibrated alone, and how far they lie apart.

    chi2 = sum_e (x_e - x)^2 / s_e^2,   x = sum_e (x_e / s_e^2) / sum_e (1 / s_e^2),   one degree of freedom less than e

x_e is what the data of experiment e alone say of a parameter: its prior is taken off, on the scale where it is flat.
All parameters at once are tested by how much the misfit falls when each experiment has its own. The size of the errors
is that which the experiments alone leave: what is left together holds the very thing in question.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.stats

from vegglue.arrays import Array
from vegglue.calibration.fit import Fitted, covariance, fit
from vegglue.calibration.noise import Noise, covariance_of, with_correlation
from vegglue.case.parameter_space import theta_at
from vegglue.case.schema import Case
from vegglue.engine.interface import Model, Point, linearise
from vegglue.engine.newton import DIFFERENCE_STEP
from vegglue.inference.posterior_summary import on_flat_scale
from vegglue.parallel import in_threads
from vegglue.results.posterior import Transfer

# Variance over the prior's above which an experiment says too little of a parameter to be compared.
SILENT = 0.5


def transfer(model: Model, noise: Noise, joint: Point, stated: bool) -> Transfer | None:
    """Every experiment that has stations refitted alone, from the joint best place; None with fewer than two.

    stated: errors are known and only made larger, where the experiments alone ask for it; else their size is free.
    """
    names = model.station["experiment"].to_numpy()
    here = [name for name in model.case.experiments if (names[noise.rows] == name).any()]
    if len(here) < 2:
        return None
    noise = with_correlation(noise, noise.correlation, 1.0)
    parts = [only(model, noise, name) for name in here]
    fits = in_threads(_alone, [(*part, joint) for part in parts])
    scale = _scale(fits, [part.rows.size for _, part in parts], 1.0 if stated else 0.0)
    value, error = (np.full((len(here), len(model.names)), np.nan) for _ in range(2))
    for e, fitted in enumerate(fits):
        if fitted is not None:
            value[e], error[e] = told_by_data(model.case, fitted.point.z, np.diag(fitted.covariance))
    error *= scale
    together = [_misfit(part, joint.prediction[names == name]) for (_, part), name in zip(parts, here, strict=True)]
    alone = [np.nan if fitted is None else fitted.chi2 for fitted in fits]
    gain = float(np.nansum(np.array(together) - np.array(alone)) / scale**2)
    own = sum(determined(one.covariance) for one in fits if one is not None)
    more = max(round(own - determined(covariance(noise, joint))), 1)
    tested = [alike(value[:, j], error[:, j]) for j in range(len(model.names))]
    return Transfer(
        scale=scale,
        gain=gain,
        more=more,
        p_all=float(scipy.stats.chi2.sf(max(gain, 0.0), more)),
        experiments=np.array(here, object),
        value=value,
        error=error,
        chi2=np.array([one[0] for one in tested]),
        freedom=np.array([one[1] for one in tested]),
        p=np.array([one[2] for one in tested]),
        misfit_together=np.array(together) / scale**2,
        misfit_alone=np.array(alone) / scale**2,
        stations=np.array([part.rows.size for _, part in parts]),
    )


def _scale(fits: Sequence[Fitted | None], stations: Sequence[int], least: float) -> float:
    """s^2 = sum_e chi2_e / sum_e (n_e - p_e), p_e the parameters that experiment e determines [-]."""
    pairs = [(one, count) for one, count in zip(fits, stations, strict=True) if one is not None]
    left = sum(one.chi2 for one, _ in pairs)
    free = sum(count - determined(one.covariance) for one, count in pairs)
    return max(float(np.sqrt(left / free)), least) if free > 0 and left > 0 else 1.0


def determined(spread: Array) -> float:
    """How many parameters the data determine, p - tr(covariance of z), not the prior [-]."""
    return float(spread.shape[0] - np.trace(spread))


def told_by_data(case: Case, z: Array, variance: Array) -> tuple[Array, Array]:
    """x (p,) and s (p,) of a best place z (p,) with variances (p,), the standard normal prior of z taken off.

    NaN for parameters of which the data say too little.
    """
    told = variance < SILENT
    own = np.where(told, variance / np.where(told, 1.0 - variance, 1.0), np.nan)
    steps = DIFFERENCE_STEP * np.array([-1.0, 0.0, 1.0])[:, None]
    low, middle, high = on_flat_scale(case, theta_at(case, z + steps))
    slope = (high - low) / (2.0 * DIFFERENCE_STEP)
    return middle + slope * z * (own / variance - 1.0), np.abs(slope) * np.sqrt(own)


def alike(value: Array, error: Array) -> tuple[float, int, float]:
    """chi2, degrees of freedom and p of values that should be one (error NaN or 0: unknown); NaN for fewer than two."""
    known = np.isfinite(value) & (error > 0)  # zero at an end of its support, where no step leads
    if known.sum() < 2:
        return float("nan"), 0, float("nan")
    weight = 1.0 / error[known] ** 2
    mean = np.sum(weight * value[known]) / weight.sum()
    apart = float(np.sum(weight * (value[known] - mean) ** 2))
    freedom = int(known.sum()) - 1
    return apart, freedom, float(scipy.stats.chi2.sf(apart, freedom))


def only(model: Model, noise: Noise, experiment: str) -> tuple[Model, Noise]:
    """The model and its errors for one experiment; all parameters stay."""
    here = (model.station["experiment"] == experiment).to_numpy()
    case = model.case.model_copy(update={"experiments": {experiment: model.case.experiments[experiment]}})
    kept = np.flatnonzero(here[noise.rows])
    lower = np.linalg.cholesky(covariance_of(noise)[np.ix_(kept, kept)])
    rows = (np.cumsum(here) - 1)[noise.rows[kept]]
    part = replace(
        noise, rows=rows, value=noise.value[kept], error=noise.error[kept], apart=noise.apart[np.ix_(kept, kept)],
        grid=noise.grid[kept], lower=np.asarray(lower),
    )  # fmt: skip
    return replace(model, case=case, station=model.station[here].reset_index(drop=True)), part


def _alone(own: Model, errors: Noise, joint: Point) -> Fitted | None:
    start = linearise(own, joint.z, joint)
    return None if start is None else fit(own, errors, start)


def _misfit(noise: Noise, prediction: Array) -> float:
    return float(np.sum(noise.whiten(noise.residual(prediction)) ** 2))
