"""The error ladder: how well each of several models, calibrated alike, predicts what it has seen and what it has not.

Held out: each section, or each experiment, is left out in turn and the model calibrated again by one exact linear step,

    dz = V (J' C^-1 r - z),   V = (J' C^-1 J + 1)^-1   over the rows kept,   error r_o - J_o dz of those left out,
    spread^2 = diag(C_oo + J_o V J_o' - 2 J_o V J' C^-1 C_o),

C_o between those kept and those left out: what the model errs by in both is calibrated away with the parameters.

Stations that a diagnosis excluded judge none of the compared models.
"""

from collections.abc import Collection
from dataclasses import asdict, replace
from typing import Any, Literal

import numpy as np
import pandas as pd
from scipy.special import ndtri

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline
from vegglue.calibration.fit import interval95
from vegglue.calibration.noise import covariance_of
from vegglue.case.bed_error import beds_of
from vegglue.diagnosis.held_out import unseen_errors
from vegglue.engine.interface import Model, linearise
from vegglue.inference.homogeneity import correlations_of_estimates, equal_values_test, without_prior
from vegglue.inference.weighted_statistics import root_mean_square
from vegglue.measurements.kinds import KINDS, leading_velocities
from vegglue.measurements.observations import EXCLUDED
from vegglue.normal_range import NORMAL95
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.model_comparison import HeldOut, InSample, ModelScore, PredictiveScores
from vegglue.wording.sentences import phrase

# What makes a measurement the same in a case and in those that extend it.
MEASUREMENT = ["experiment", "kind", "section", "x", "y", "value"]


def excluded_by(*found: Diagnosis) -> pd.DataFrame:
    """The measurements that any of the diagnoses has flagged."""
    flagged = [
        one.predictions.station.iloc[list(one.errors.flagged)][MEASUREMENT] for one in found if one.errors.flagged
    ]
    return pd.concat(flagged, ignore_index=True).drop_duplicates() if flagged else pd.DataFrame(columns=MEASUREMENT)


def excluding(model: Model, aside: pd.DataFrame) -> Model:
    """The model, with these measurements not used."""
    return replace(model, station=without_stations(model.station, aside))


def without_stations(station: pd.DataFrame, aside: pd.DataFrame) -> pd.DataFrame:
    """A table of stations, with these measurements not used."""
    known = set(aside.itertuples(index=False, name=None))
    there = np.array([row in known for row in station[MEASUREMENT].itertuples(index=False, name=None)], dtype=bool)
    there &= station["used"].to_numpy()
    return station.assign(used=station["used"].mask(there, False), reason=station["reason"].mask(there, EXCLUDED))


def exclusion_in_words(aside: pd.DataFrame) -> str:
    """What no compared model uses, in words; '' for nothing."""
    rows = [(f"{row.experiment} {row.section}".strip(), row.x, row.y) for row in aside.itertuples()]
    return phrase("excluded_from_comparison", rows) if rows else ""


# What is left out in turn.
By = Literal["sections", "experiments"]


def model_score(base: Baseline, validation: Model | None = None) -> ModelScore:
    """What a calibrated model misses.

    Parameters
    ----------
    base
        The calibrated model.
    validation
        The same model at stations that no calibration uses.

    Returns
    -------
    ModelScore
        Errors at calibrated, held-out and validation stations, and whether parameters are the same in all experiments.
    """
    model, noise, point = base.model, base.noise, base.fitted.point
    used, left = model.station.iloc[noise.rows], noise.residual(point.prediction)
    kind, velocity = used["kind"].to_numpy(), leading_velocities(used)
    section, spread = _held_out(base, used["section"].to_numpy())
    experiment, _ = _held_out(base, used["experiment"].to_numpy())
    error, surprise = section[velocity] / spread[velocity], np.abs(section[velocity] / spread[velocity])
    density = -0.5 * error**2 - np.log(spread[velocity]) - 0.5 * np.log(2.0 * np.pi)
    known = surprise[np.isfinite(surprise)]
    inside = [float(np.mean(known < ndtri(0.5 + 0.5 * level))) if known.size else float("nan") for level in (0.5, 0.95)]
    validated = within = float("nan")
    if validation is not None and (there := linearise(validation, point.z)) is not None:
        rows, change = leading_velocities(validation.station), None
        missed = validation.station["value"].to_numpy(float)[rows] - there.prediction[rows]
        if any(layer.survey is not None for layer in beds_of(model.case)):
            change = unseen_errors(base, validation, there)  # the bed is calibrated, too
        if change is not None:
            missed = missed - change.mean[rows]
            stated = np.nan_to_num(validation.station["standard_error"].to_numpy(float)[rows])
            within = float(np.mean(np.abs(missed) < NORMAL95 * np.hypot(change.error[rows], stated)))
        validated = root_mean_square(missed)
    return ModelScore(
        name=model.case.name,
        title=model.case.title,
        effects=tuple(model.case.effects),
        values={name: interval95(model, base.fitted, name) for name in model.names},
        in_sample=InSample(
            rmse={name: root_mean_square(left[kind == name]) for name in KINDS},
            chi2=float(np.sum((left / noise.error) ** 2)),
            stations=int(noise.rows.size),
            noise_floor=root_mean_square(noise.error[velocity]),
        ),
        held_out=HeldOut(
            section,
            experiment,
            velocity,
            tuple((str(e), str(s)) for e, s in zip(used["experiment"], used["section"], strict=True)),
        ),
        predictive=PredictiveScores(
            float(np.nanmean(density)) if np.isfinite(density).any() else float("nan"), *inside
        ),
        homogeneity=homogeneity(base),
        validation=validated,
        validation_inside95=within,
    )


def held_out_rmse(score: ModelScore, by: By = "sections", untold: Collection[str] = ()) -> float:
    """Root mean square held-out error of velocities [m/s]; untold: sections or experiments that do not count."""
    error = _of_velocities(score, by, untold)
    return root_mean_square(error[np.isfinite(error)])


def model_score_in_short(score: ModelScore) -> str:
    """One line: errors of velocity [m/s] at calibrated, held-out and validation stations."""
    return phrase("model_score", score, held_out_rmse(score), held_out_rmse(score, "experiments"))


def model_score_json(score: ModelScore) -> dict[str, Any]:
    """One object with every number of a model that is printed."""
    return {
        "name": score.name,
        "title": score.title,
        "effects": score.effects,
        "parameters": len(score.values),
        **asdict(score.in_sample),
        **asdict(score.predictive),
        "values": score.values,
        "homogeneity": score.homogeneity,
        "validation": score.validation,
        "validation_inside95": score.validation_inside95,
        "held_out_sections": held_out_rmse(score),
        "held_out_experiments": held_out_rmse(score, "experiments"),
    }


def improvement(
    before: ModelScore, after: ModelScore, by: By = "sections", untold: Collection[str] = ()
) -> tuple[float, float]:
    """Mean of e_before^2 - e_after^2 over held-out velocities, and its standard error, both in (m/s)^2.

        se^2 = (K - 1) / K sum_k (m_(k) - m)^2

    m is the mean of all velocities, m_(k) that without cluster k (experiment and section) of K: the jackknife, which
    holds for clusters of any size. untold: sections or experiments that do not count. Source: Miller (1974),
    doi:10.1093/biomet/61.1.1; not checked against it.
    """
    gain = _of_velocities(before, by, untold) ** 2 - _of_velocities(after, by, untold) ** 2
    known = np.isfinite(gain)
    if not known.any():
        return float("nan"), float("nan")
    numbers = {pair: number for number, pair in enumerate(dict.fromkeys(after.held_out.clusters))}
    cluster = np.array([numbers[pair] for pair in after.held_out.clusters])[after.held_out.velocity]
    mean, told = float(gain[known].mean()), np.unique(cluster[known])
    if told.size < 2:
        return mean, float("nan")
    without = np.array([gain[known & (cluster != number)].mean() for number in told])
    return mean, float(np.sqrt((told.size - 1) / told.size * np.sum((without - mean) ** 2)))


def homogeneity(base: Baseline) -> dict[str, float]:
    """For each parameter the chance p that it is the same in all experiments, each moved to by one linear step [-].

    The test of `transfer`; parameters that fewer than two experiments constrain are left out.
    """
    noise, point = base.noise, base.fitted.point
    slope, left = noise.used(point.slope), noise.residual(point.prediction)
    names, errors = base.model.station["experiment"].to_numpy()[noise.rows], covariance_of(noise)
    told, estimates = [], []
    for experiment in dict.fromkeys(names):
        rows = np.flatnonzero(names == experiment)
        step, spread = _step(errors, slope, left, point.z, rows)
        told.append(without_prior(base.model.case, point.z + step, np.diag(spread)))
        estimates.append((rows, slope[rows], spread))
    value, error = (np.array(part) for part in zip(*told, strict=True))
    alike = correlations_of_estimates(noise, estimates, point.z.size)
    chances = {
        name: equal_values_test(value[:, j], error[:, j], alike[j])[2] for j, name in enumerate(base.model.names)
    }
    return {name: p for name, p in chances.items() if np.isfinite(p)}


def _of_velocities(score: ModelScore, by: By, untold: Collection[str]) -> Array:
    """Held-out errors of velocities (v,), NaN where they do not count."""
    held_out = score.held_out
    error = held_out.sections if by == "sections" else held_out.experiments
    group = [section if by == "sections" else experiment for experiment, section in held_out.clusters]
    return np.where([one in untold for one in group], np.nan, error)[held_out.velocity]


def _held_out(base: Baseline, groups: np.ndarray) -> tuple[Array, Array]:
    """Errors of stations when their group is left out, and the spread they were predicted with (n,), see above."""
    noise, point = base.noise, base.fitted.point
    slope, left = noise.used(point.slope), noise.residual(point.prediction)
    error, spread = np.full(left.size, np.nan), np.full(left.size, np.nan)
    names = dict.fromkeys(groups)
    if len(names) < 2:
        return error, spread
    errors = covariance_of(noise)
    for name in names:
        out, kept = np.flatnonzero(groups == name), np.flatnonzero(groups != name)
        step, covariance = _step(errors, slope, left, point.z, kept)
        error[out] = left[out] - slope[out] @ step
        shared = np.linalg.solve(errors[np.ix_(kept, kept)], errors[np.ix_(kept, out)])
        of_step = slope[out] @ covariance - 2.0 * shared.T @ slope[kept] @ covariance
        spread[out] = np.sqrt(np.diag(errors)[out] + np.einsum("ij,ij->i", of_step, slope[out]))
    return error, spread


def _step(errors: Array, slope: Array, left: Array, z: Array, kept: np.ndarray) -> tuple[Array, Array]:
    """The linear step when only some rows are kept, and the covariance of z then; errors: covariance of all (n, n)."""
    lower = np.linalg.cholesky(errors[np.ix_(kept, kept)])
    white, right = np.linalg.solve(lower, slope[kept]), np.linalg.solve(lower, left[kept])
    matrix = white.T @ white + np.eye(z.size)
    return np.asarray(np.linalg.solve(matrix, white.T @ right - z)), np.asarray(np.linalg.inv(matrix))
