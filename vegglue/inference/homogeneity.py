"""Homogeneity: whether a parameter has one value for all experiments, each of them calibrated alone.

    chi2 = sum_e (x_e - x)^2 / s_e^2,   x = sum_e (x_e / s_e^2) / sum_e (1 / s_e^2),   one degree of freedom less than e

x_e and s_e are the estimate of a parameter from the data of experiment e alone, without its prior, and its standard
error. All parameters at once are tested by the fall of chi2 when each experiment has its own. The size of the errors is
estimated from the separate fits: the residual of the joint one would hold the differences that are tested.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import scipy.stats

from vegglue.arrays import Array
from vegglue.calibration.fit import MapEstimate, covariance, fit, squared_misfit
from vegglue.calibration.noise import Noise, covariance_of, with_correlation
from vegglue.case.parameter_space import theta_at
from vegglue.case.schema import Case
from vegglue.engine.interface import Model, Point, linearise
from vegglue.engine.newton import DIFFERENCE_STEP
from vegglue.inference.posterior_summary import on_flat_scale
from vegglue.parallel import side_by_side
from vegglue.results.posterior import Transfer

# Posterior over prior variance of z [-] above which an experiment does not determine a parameter. Chosen, not measured:
# a higher one compares more parameters, whose estimates without the prior rest on less and less data.
UNINFORMED = 0.5


def transfer(model: Model, noise: Noise, joint: Point, stated: bool) -> Transfer | None:
    """Tests of homogeneity, with each experiment fitted alone from the joint estimate; None with fewer than two.

    stated: whether standard errors are known; they are then only made larger, where the separate fits ask for it.
    """
    names = model.station["experiment"].to_numpy()
    here = [name for name in model.case.experiments if (names[noise.rows] == name).any()]
    if len(here) < 2:
        return None
    noise = with_correlation(noise, noise.correlation, 1.0)
    parts = [one_experiment(model, noise, name) for name in here]
    fits = side_by_side(partial(_alone, joint), parts)
    scale = _scale(fits, [part.rows.size for _, part in parts], 1.0 if stated else 0.0)
    value, error = (np.full((len(here), len(model.names)), np.nan) for _ in range(2))
    for e, fitted in enumerate(fits):
        if fitted is not None:
            value[e], error[e] = without_prior(model.case, fitted.point.z, np.diag(fitted.covariance))
    error *= scale
    together = [
        squared_misfit(part, joint.prediction[names == name]) for (_, part), name in zip(parts, here, strict=True)
    ]
    alone = [np.nan if fitted is None else fitted.chi2 for fitted in fits]
    gain = float(np.nansum(np.array(together) - np.array(alone)) / scale**2)
    separate = sum(determined(one.covariance) for one in fits if one is not None)
    more = max(round(separate - determined(covariance(noise, joint))), 1)
    tested = [equal_values_test(value[:, j], error[:, j]) for j in range(len(model.names))]
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


def _scale(fits: Sequence[MapEstimate | None], stations: Sequence[int], least: float) -> float:
    """s^2 = sum_e chi2_e / sum_e (n_e - p_e), p_e: effective number of parameters of experiment e [-]."""
    pairs = [(one, count) for one, count in zip(fits, stations, strict=True) if one is not None]
    left = sum(one.chi2 for one, _ in pairs)
    free = sum(count - determined(one.covariance) for one, count in pairs)
    return max(float(np.sqrt(left / free)), least) if free > 0 and left > 0 else 1.0


def determined(spread: Array) -> float:
    """p - tr(covariance of z) [-]: effective number of parameters, those that the data determine and not the prior."""
    return float(spread.shape[0] - np.trace(spread))


def without_prior(case: Case, z: Array, variance: Array) -> tuple[Array, Array]:
    """x (p,) and s (p,) of a MAP estimate z (p,) with variances v (p,), without the prior: 1/s_z^2 = 1/v - 1.

    They are on the scale of `on_flat_scale`; NaN for parameters with v >= UNINFORMED.
    """
    informed = variance < UNINFORMED
    own = np.where(informed, variance / np.where(informed, 1.0 - variance, 1.0), np.nan)
    steps = DIFFERENCE_STEP * np.array([-1.0, 0.0, 1.0])[:, None]
    low, middle, high = on_flat_scale(case, theta_at(case, z + steps))
    slope = (high - low) / (2.0 * DIFFERENCE_STEP)
    return middle + slope * z * (own / variance - 1.0), np.abs(slope) * np.sqrt(own)


def equal_values_test(value: Array, error: Array) -> tuple[float, int, float]:
    """chi2, degrees of freedom and p of equal values; error NaN or 0: unknown; NaN for fewer than two known."""
    known = np.isfinite(value) & (error > 0)  # zero at an end of its support, where no step leads
    if known.sum() < 2:
        return float("nan"), 0, float("nan")
    weight = 1.0 / error[known] ** 2
    mean = np.sum(weight * value[known]) / weight.sum()
    separation = float(np.sum(weight * (value[known] - mean) ** 2))
    freedom = int(known.sum()) - 1
    return separation, freedom, float(scipy.stats.chi2.sf(separation, freedom))


def one_experiment(model: Model, noise: Noise, experiment: str) -> tuple[Model, Noise]:
    """The model and its errors for one experiment; all parameters stay."""
    here = (model.station["experiment"] == experiment).to_numpy()
    case = model.case.model_copy(update={"experiments": {experiment: model.case.experiments[experiment]}})
    kept = np.flatnonzero(here[noise.rows])
    lower = np.linalg.cholesky(covariance_of(noise)[np.ix_(kept, kept)])
    rows = (np.cumsum(here) - 1)[noise.rows[kept]]
    part = replace(
        noise,
        rows=rows,
        value=noise.value[kept],
        error=noise.error[kept],
        separation=noise.separation[np.ix_(kept, kept)],
        grid_error=noise.grid_error[kept],
        lower=np.asarray(lower),
        model_error=noise.model_error[np.ix_(kept, kept)],
        unknown=noise.unknown[kept],
    )
    return replace(model, case=case, station=model.station[here].reset_index(drop=True)), part


def _alone(joint: Point, own: Model, errors: Noise) -> MapEstimate | None:
    start = linearise(own, joint.z, joint)
    return None if start is None else fit(own, errors, start)
