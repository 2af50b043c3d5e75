"""How wrong a calibrated model is where it was not calibrated: at held-out measurements, between the sections, and
beside other models. Stations that a diagnosis excluded judge none of the compared models.
"""

from collections.abc import Collection
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np
import pandas as pd
import scipy.linalg
from scipy.special import chdtri, ndtri

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, SearchModel, grid_difference, model_that_errs, with_error_there
from vegglue.calibration.fit import interval95
from vegglue.calibration.model_error import (
    CellResponses,
    any_error,
    cell_responses,
    model_error_columns,
    site_error_columns,
    terms_that_err,
)
from vegglue.calibration.noise import covariance_of
from vegglue.case.bed_error import beds_of, without_surveys
from vegglue.case.gridded_site import build_site
from vegglue.case.schema import ModelError
from vegglue.decision_constants import constants
from vegglue.diagnosis.field_scan import free_of_prior
from vegglue.engine.interface import Model, Point, linearise, predict
from vegglue.engine.model import coarser
from vegglue.inference.homogeneity import correlations_of_estimates, equal_values_test, without_prior
from vegglue.inference.weighted_statistics import root_mean_square
from vegglue.measurements.kinds import KINDS, Unused, leading_velocities
from vegglue.measurements.observations import section_places, station_table
from vegglue.normal_range import NORMAL95
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.loop_results import HeldOut, InSample, ModelScore, PredictiveScores
from vegglue.wording.sentences import phrase


@dataclass(frozen=True)
class HeldOutErrors:
    """Errors at held-out velocities over the expected ones.

    Attributes
    ----------
    ratio : float
        [-]; NaN without such velocities, infinite if the model finds no flow for them.
    by_chance : float
        Ratio that errors alone exceed in 5 % of cases [-].
    """

    ratio: float
    by_chance: float


def held_out_errors(base: Baseline, held_out: Model) -> HeldOutErrors:
    """Errors of a calibrated model, effects included, over the expected ones.

        ratio = (|e|^2 / tr S)^(1/2),   S = diag(s_0^2 + (1 - c) g^2) + A A',   A = [M, c^(1/2) g 1, J V^(1/2)]

    e are the errors of held-out velocities, s_0 their stated standard errors (those of the calibrated ones if they are
    not stated), M the columns of the model's own error, g the error of the grid at the calibrated ones and c its
    correlation, V the covariance of the parameters and J the slopes. Errors alone exceed (chi2 / k)^(1/2) in 5 % of
    cases, chi2 the 95 % point with k = (tr S)^2 / tr S^2 degrees of freedom: few measurements, or many that err alike,
    are few.

    Parameters
    ----------
    held_out : Model
        The model at stations that no calibration uses.

    References
    ----------
    Satterthwaite (1946), doi:10.2307/3002019, for k; not checked against it.
    """
    case = base.model.case.model_copy(
        update={"experiments": held_out.case.experiments, "observations": held_out.case.observations}
    )
    site = held_out.site if held_out.case.bed == case.bed else build_site(case)  # a surveyed line may have become loose
    there = Model(case, site, held_out.station, held_out.engine)
    point = linearise(there, base.fitted.point.z)
    rows = np.flatnonzero(leading_velocities(there.station))
    if not rows.size or point is None:
        return HeldOutErrors(float("inf") if rows.size else float("nan"), 1.0)
    error = there.station["value"].to_numpy(float)[rows] - point.prediction[rows]
    noise, seen = base.noise, leading_velocities(base.model.station)[base.noise.rows]
    floor, grid = (
        float(np.mean(one[seen] ** 2)) if seen.any() else 0.0 for one in (noise.data_error, noise.grid_error)
    )
    stated = there.station["standard_error"].to_numpy(float)[rows] ** 2
    of_model = model_error_columns(there, point, there.case.model_error)[rows]
    of_grid = np.full((rows.size, 1), np.sqrt(noise.grid_correlation * grid))
    of_parameters = point.slope[rows] @ np.linalg.cholesky(base.fitted.covariance)
    own = np.where(stated > 0, stated, floor) + (1.0 - noise.grid_correlation) * grid
    alike = np.hstack([of_model, of_grid, of_parameters])
    squares = (alike**2).sum(axis=1)
    total = float((own + squares).sum())
    degrees = total**2 / float((own**2 + 2.0 * own * squares).sum() + ((alike.T @ alike) ** 2).sum())
    by_chance = float(np.sqrt(chdtri(degrees, constants().held_out_alarm_rate) / degrees))
    return HeldOutErrors(float(np.sqrt((error**2).sum() / total)), by_chance)


def expected_errors(base: Baseline, held_out: Model, there: Point) -> tuple[Array, Array] | None:
    """Measured less predicted at stations that no calibration uses, as the calibrated ones let expect.

    e of `errors_elsewhere` with all errors of model and site that stations share. The error of the grid is that
    at the stations, and that of a discharge is independent of those that were calibrated.

    Parameters
    ----------
    held_out : Model
        At these stations.
    there : Point
        Of `held_out`, at the parameters of the base.

    Returns
    -------
    (ndarray (station,), ndarray (station,)) or None
        Mean and standard error, without the error of reading [unit of the station]; None if no flow is found on the
        cells of the model's own error.
    """
    where = with_error_there(model_that_errs(base))
    same = where.model.site.bed.shape == held_out.site.bed.shape
    coarse = coarser(held_out)
    on_coarse = None if coarse is None else linearise(coarse, there.z)
    cells, point = (held_out, there) if same else (coarse, on_coarse)
    if cells is None or point is None:
        return None
    allowed = where.model.case.model_error
    shared = allowed.model_copy(update={"probes": 0.0, "discharge": 0.0})
    at_stations, elsewhere = (
        np.hstack([at.slope, model_error_columns(model, at, shared)])
        for model, at in ((where.model, where.point), (cells, point))
    )
    mean, covariance = errors_elsewhere(where, at_stations[where.noise.rows], elsewhere, point)
    of_discharge = ModelError(discharge=allowed.discharge)
    own = site_error_columns(cells, point, of_discharge, CellResponses(cells.site.grid, {}))
    of_grid = constants().grid_error_share * grid_difference(there, on_coarse)
    variance = np.diag(covariance) + (own**2).sum(axis=1) + of_grid**2
    return mean, np.sqrt(np.maximum(variance, 0.0))


def errors_elsewhere(where: SearchModel, at_stations: Array, there: Array, point: Point) -> tuple[Array, Array]:
    """Errors e of a calibrated model at other stations, given its residual r at those of the calibration.

        e = y - f(z) there,   C = cov + J J',   c = J J_e' + M M_e'
        e ~ N(-J_e z + c' C^-1 (r + J z),   J_e J_e' + M_e M_e' - c' C^-1 c)

    Before the data parameters are standard normal, and the model and its site err as `model_error` allows: M are the
    columns of that error at the stations, M_e there. cov is that of the errors at the stations, M M' among them, J and
    J_e are slopes, z the calibrated place.

    Parameters
    ----------
    at_stations, there : ndarray (stations, p + m)
        [J, M] and [J_e, M_e].
    point : Point
        That of the other stations.

    Returns
    -------
    ndarray (k,), ndarray (k, k)
        Mean and covariance of e.
    """
    whole, residual = free_of_prior(where)
    factor = scipy.linalg.cho_factor(whole, lower=True)
    shared = at_stations @ there.T
    mean = shared.T @ scipy.linalg.cho_solve(factor, residual) - there[:, : point.z.size] @ point.z
    return mean, there @ there.T - shared.T @ scipy.linalg.cho_solve(factor, shared)


# Draws of the errors between sections [-]: the 95 % point of so many is known to half a per cent of the share.
DRAWN_ERRORS = 2000


def largest_error_between(base: Baseline) -> float:
    """(1 + mean e^2 / s^2)^(1/2) halfway between the sections and beyond the last: between_share of its cases.

    e is that of `errors_elsewhere`, s^2 the mean square of the errors of data and site. What a survey leaves open of
    the bed, and where patches end, is in its cov and not in M_e: errors of the site that are stated are no room for a
    missing effect. A reading there would be judged by them, so that e counts in the errors of the data and of the site.

    Returns
    -------
    float
        [-]; NaN if there are no velocities or no flow.
    """
    where = model_that_errs(base)
    model, noise = where.model, where.noise
    seen = leading_velocities(base.model.station)[base.noise.rows]
    both = station_table(model.station, halfway(model.station, model.case.grid.x[1]))
    wide, count = replace(model, station=both), len(model.station)
    point = linearise(wide, where.point.z, where.point)
    if point is None or len(both) == count or not seen.any():
        return float("nan")
    # A probe beside its place reads another place, and is no error of the model there.
    allowed = model.case.model_error.model_copy(update={"probes": 0.0, "edges": 0.0})
    plain = replace(wide, case=without_surveys(model.case))
    site = ModelError(edges=model.case.model_error.edges)
    errs = any_error(model.case, model.case.model_error)
    cells = cell_responses(wide, point, terms_that_err(model.case, site)) if errs else None
    columns = np.hstack([point.slope, model_error_columns(plain, point, allowed, cells)])
    of_site = model_error_columns(wide, point, site, cells)[count:]
    mean, covariance = errors_elsewhere(where, columns[:count][noise.rows], columns[count:], point)
    random = np.random.default_rng(1)
    drawn = random.multivariate_normal(mean, covariance, DRAWN_ERRORS, check_valid="ignore", method="eigh")
    expected = float(np.mean(base.noise.data_error[seen] ** 2)) + float((of_site**2).sum(axis=1).mean())
    squares = (drawn**2).mean(axis=1) / expected
    return float(np.sqrt(1.0 + np.quantile(squares, constants().between_share)))


@dataclass(frozen=True)
class ActsElsewhere:
    """A local anomaly that acts mostly between the stations.

    Attributes
    ----------
    change : float
        Largest change of velocity halfway between sections [m/s].
    x : float
        Where that is [m].
    at_stations : float
        Largest change where velocities were measured [m/s].
    """

    change: float
    x: float
    at_stations: float


def acts_elsewhere(before: Baseline, after: Baseline) -> ActsElsewhere | None:
    """Whether max|du| halfway between the sections is mostly_elsewhere times max|du| at the stations.

    Parameters
    ----------
    before, after : Baseline
        Without and with something at a place, of the same stations.

    Returns
    -------
    ActsElsewhere or None
        None if it acts at the stations as well, or velocities are missing there.
    """
    station = before.model.station
    velocity = leading_velocities(station)
    there = halfway(station, before.model.case.grid.x[1])

    def read_there(base: Baseline) -> Array:
        point = base.fitted.point
        return np.asarray(predict(replace(base.model, station=there), [point], point.z[None])[0])

    was, now = read_there(before), read_there(after)
    changed = np.abs(now - was)
    if not velocity.any() or not np.isfinite(changed).all():
        return None
    most = int(np.argmax(changed))
    at_stations = float(np.abs(after.fitted.point.prediction - before.fitted.point.prediction)[velocity].max())
    if changed[most] < constants().mostly_elsewhere * at_stations:
        return None
    return ActsElsewhere(float(changed[most]), float(there["x"].iloc[most]), at_stations)


def halfway(station: pd.DataFrame, end: float) -> pd.DataFrame:
    """The stations of velocities, moved halfway to the next section of their experiment downstream.

    Parameters
    ----------
    station : DataFrame
        All stations.
    end : float
        End of the channel, to which those of the last section are moved halfway [m].

    Returns
    -------
    DataFrame
        None is used. A section is one of its own experiment: in another one a boat lies some centimetres off.
    """
    velocity = station[leading_velocities(station)]
    middle = section_places(velocity)

    def ahead(of_experiment: "pd.Series[float]") -> "pd.Series[float]":
        places = np.unique(of_experiment)
        steps = 0.5 * (np.append(places[1:], end) - places)
        return of_experiment.map(dict(zip(places, steps, strict=True)))

    moved = velocity["x"] + middle.groupby(velocity["experiment"]).transform(ahead)
    return velocity.assign(x=np.minimum(moved, end), used=False)


# What makes a measurement the same in a case and in those that extend it.
MEASUREMENT = ["experiment", "kind", "section", "x", "y", "value"]


def excluded_by(*found: Diagnosis) -> pd.DataFrame:
    """The measurements that any of the diagnoses has flagged.

    Returns
    -------
    DataFrame
        With the columns of MEASUREMENT, each measurement once.
    """
    flagged = [
        one.predictions.station.iloc[list(one.errors.flagged)][MEASUREMENT] for one in found if one.errors.flagged
    ]
    return pd.concat(flagged, ignore_index=True).drop_duplicates() if flagged else pd.DataFrame(columns=MEASUREMENT)


def excluding(model: Model, aside: pd.DataFrame) -> Model:
    """The model, with these measurements not used."""
    return replace(model, station=without_stations(model.station, aside))


def without_stations(station: pd.DataFrame, aside: pd.DataFrame) -> pd.DataFrame:
    """A table of stations with some measurements not used.

    Parameters
    ----------
    aside : DataFrame
        With the columns of MEASUREMENT, all of which have to be the same.

    Returns
    -------
    DataFrame
        `used` False and `reason` EXCLUDED for those that were in use.
    """
    known = set(aside.itertuples(index=False, name=None))
    there = np.array([row in known for row in station[MEASUREMENT].itertuples(index=False, name=None)], dtype=bool)
    there &= station["used"].to_numpy()
    reason = station["reason"].mask(there, Unused.EXCLUDED)
    return station.assign(used=station["used"].mask(there, False), reason=reason)


def exclusion_in_words(aside: pd.DataFrame) -> str:
    """What no compared model uses, in words; '' for nothing."""
    rows = [(f"{row.experiment} {row.section}".strip(), row.x, row.y) for row in aside.itertuples()]
    return phrase("excluded_from_comparison", rows) if rows else ""


# What is left out in turn.
By = Literal["sections", "experiments"]


def model_score(base: Baseline, validation: Model | None = None) -> ModelScore:
    """What a calibrated model misses, with each section, or each experiment, left out in turn.

        dz = V (J' C^-1 r - z),   V = (J' C^-1 J + 1)^-1   over the rows kept,   error r_o - J_o dz of those left out,
        spread^2 = diag(C_oo + J_o V J_o' - 2 J_o V J' C^-1 C_o),

    C_o between those kept and those left out: what the model errs by in both is calibrated away with the parameters.

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
    section, spread = _cross_validated(base, used["section"].to_numpy())
    experiment, _ = _cross_validated(base, used["experiment"].to_numpy())
    error, surprise = section[velocity] / spread[velocity], np.abs(section[velocity] / spread[velocity])
    density = -0.5 * error**2 - np.log(spread[velocity]) - 0.5 * np.log(2.0 * np.pi)
    known = surprise[np.isfinite(surprise)]
    inside = [float(np.mean(known < ndtri(0.5 + 0.5 * level))) if known.size else float("nan") for level in (0.5, 0.95)]
    validated = within = float("nan")
    if validation is not None and (there := linearise(validation, point.z)) is not None:
        rows, expected = leading_velocities(validation.station), None
        missed = validation.station["value"].to_numpy(float)[rows] - there.prediction[rows]
        if any(layer.survey is not None for layer in beds_of(model.case)):
            expected = expected_errors(base, validation, there)  # the bed is calibrated, too
        if expected is not None:
            mean, error_there = (of_each[rows] for of_each in expected)
            missed = missed - mean
            stated = np.nan_to_num(validation.station["standard_error"].to_numpy(float)[rows])
            within = float(np.mean(np.abs(missed) < NORMAL95 * np.hypot(error_there, stated)))
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
    """(mean e^2)^(1/2) of velocities whose section, or experiment, was left out.

    Parameters
    ----------
    by : {"sections", "experiments"}
        What is left out in turn.
    untold : collection of str
        Sections or experiments that do not count.

    Returns
    -------
    float
        [m/s]; NaN if nothing is held out.
    """
    error = _of_velocities(score, by, untold)
    return root_mean_square(error[np.isfinite(error)])


def model_score_in_short(score: ModelScore) -> str:
    """One line: errors of velocity [m/s] at calibrated, held-out and validation stations."""
    return phrase("model_score", score, held_out_rmse(score), held_out_rmse(score, "experiments"))


def model_score_json(score: ModelScore) -> dict[str, Any]:
    """Every number of a model that is printed.

    Returns
    -------
    dict
        Root mean square errors by kind and of held-out velocities [unit of the kind]; chi2, chances and shares [-];
        `values`: estimate and 95 % interval of each parameter [its unit].
    """
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
    """Reduction of held-out mean square error of velocities, and its standard error by the jackknife.

        m = mean(e_before^2 - e_after^2),   se^2 = (K - 1) / K sum_k (m_(k) - m)^2

    m_(k) is the mean without cluster k (experiment and section) of K, which may be of any size.

    Parameters
    ----------
    by : {"sections", "experiments"}
        What is left out in turn.
    untold : collection of str
        Sections or experiments that do not count.

    Returns
    -------
    float, float
        m and se [(m/s)^2]; NaN if nothing is held out, se also for a single cluster.

    References
    ----------
    Miller (1974), doi:10.1093/biomet/61.1.1; not checked against it.
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
    """P that a parameter is the same in all experiments, each moved to by one linear step; the test of `transfer`.

    Returns
    -------
    dict of float
        By parameter [-]; those that fewer than two experiments constrain are left out.
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


def _cross_validated(base: Baseline, groups: np.ndarray) -> tuple[Array, Array]:
    """Errors of stations when their group is left out, and the spread they were predicted with (n,), `model_score`."""
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
