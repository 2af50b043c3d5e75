"""Whether parameters hold from one experiment to the next: each calibrated alone, and how far they lie apart.

    chi2 = sum_e (x_e - x)^2 / s_e^2,   x = sum_e (x_e / s_e^2) / sum_e (1 / s_e^2),   one degree of freedom less than e

x_e is what the data of experiment e alone say of a parameter: its prior is taken off, on the scale on which it is flat.
"""

from dataclasses import replace

import numpy as np
import scipy.stats

from vegglue.cores import in_threads
from vegglue.effect import Array
from vegglue.fit import Fitted, fit
from vegglue.infer import on_flat_scale
from vegglue.linearise import STEP, Model, Point, linearise, theta_at
from vegglue.noise import Noise, covariance_of
from vegglue.posterior import Transfer
from vegglue.schema import Case

# Variance over the prior's above which an experiment says too little of a parameter to be compared.
SILENT = 0.5


def transfer(model: Model, noise: Noise, joint: Point, jobs: int) -> Transfer | None:
    """Every experiment that has stations refitted alone, from the joint best place; None with fewer than two."""
    names = model.station["experiment"].to_numpy()
    here = [name for name in model.case.experiments if (names[noise.rows] == name).any()]
    if len(here) < 2:
        return None
    fits = in_threads(_alone, [(model, noise, joint, name) for name in here], jobs)
    value, error = (np.full((len(here), len(model.names)), np.nan) for _ in range(2))
    for e, fitted in enumerate(fits):
        if fitted is not None:
            value[e], error[e] = told_by_data(model.case, fitted.point.z, np.diag(fitted.covariance))
    tested = [alike(value[:, j], error[:, j]) for j in range(len(model.names))]
    parts = [only(model, noise, name) for name in here]
    together = [_misfit(part, joint.prediction[(names == name)]) for (_, part), name in zip(parts, here, strict=True)]
    return Transfer(
        experiments=np.array(here, object),
        value=value,
        error=error,
        chi2=np.array([one[0] for one in tested]),
        freedom=np.array([one[1] for one in tested]),
        p=np.array([one[2] for one in tested]),
        misfit_together=np.array(together),
        misfit_alone=np.array([np.nan if fitted is None else fitted.chi2 for fitted in fits]),
        stations=np.array([part.rows.size for _, part in parts]),
    )


def told_by_data(case: Case, z: Array, variance: Array) -> tuple[Array, Array]:
    """x (p,) and s (p,) of a best place z (p,) with variances (p,), the standard normal prior of z taken off.

    NaN for parameters of which the data say too little.
    """
    told = variance < SILENT
    own = np.where(told, variance / np.where(told, 1.0 - variance, 1.0), np.nan)
    steps = STEP * np.array([-1.0, 0.0, 1.0])[:, None]
    low, middle, high = on_flat_scale(case, theta_at(case, z + steps))
    slope = (high - low) / (2.0 * STEP)
    return middle + slope * z * (own / variance - 1.0), np.abs(slope) * np.sqrt(own)


def alike(value: Array, error: Array) -> tuple[float, int, float]:
    """chi2, degrees of freedom and p of values that should be one, NaN where unknown; all NaN with fewer than two."""
    known = np.isfinite(value) & np.isfinite(error)
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
    return Model(case, model.site, model.station[here].reset_index(drop=True)), part


def _alone(model: Model, noise: Noise, joint: Point, experiment: str) -> Fitted | None:
    own, errors = only(model, noise, experiment)
    start = linearise(own, joint.z, joint)
    return None if start is None else fit(own, errors, start)


def _misfit(noise: Noise, prediction: Array) -> float:
    return float(np.sum(noise.whiten(noise.residual(prediction)) ** 2))
