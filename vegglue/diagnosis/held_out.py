"""How wrong a calibrated model is where it was not calibrated: at held-out measurements, and between the sections.

Held out, errors over the expected ones:

    ratio = (|e|^2 / tr S)^(1/2),   S = diag(s_0^2 + (1 - c) g^2) + A A',   A = [M, c^(1/2) g 1, J V^(1/2)]

e are the errors of held-out velocities, s_0 their stated standard errors (those of the calibrated ones if they are not
stated), M the columns of the model's own error, g the error of the grid at the calibrated ones and c its correlation, V
the covariance of the parameters and J the slopes. Errors alone exceed (chi2 / k)^(1/2) in 5 % of cases, chi2 the 95 %
point with k = (tr S)^2 / tr S^2 degrees of freedom: few measurements, or many that err alike, are few.
Source: Satterthwaite (1946), doi:10.2307/3002019, for k; not checked against it.

Halfway between the sections, and beyond the last:

    e = y - f(z) there,   r = residual at the stations,   C = cov + J J',   c = J J_e' + M M_e'
    e ~ N(-J_e z + c' C^-1 (r + J z),   J_e J_e' + M_e M_e' - c' C^-1 c)

Before the data parameters are standard normal, and the model and its site err as `model_error` allows: M are the
columns of that error at the stations, M_e there. What the data say of both is so taken into account. cov is that of the
errors at the stations, M M' among them, J and J_e are slopes, z the calibrated place. What a survey leaves open of the
bed, and where patches end, is in cov and not in M_e: errors of the site that are stated are no room for a missing
effect. A reading there would be judged by them, so that e counts in the errors of the data and of the site.
Source: conditional normal distribution.
"""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import scipy.linalg
from scipy.special import chdtri

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, SearchModel, model_that_errs, with_error_there
from vegglue.calibration.model_error import (
    CellResponses,
    any_error,
    cell_responses,
    model_error_columns,
    site_error_columns,
    terms_that_err,
)
from vegglue.case.bed_error import without_surveys
from vegglue.case.gridded_site import build_site
from vegglue.case.schema import ModelError
from vegglue.decision_constants import constants
from vegglue.diagnosis.field_scan import free_of_prior
from vegglue.engine.interface import Model, Point, linearise, predict
from vegglue.engine.model import coarser
from vegglue.measurements.kinds import leading_velocities
from vegglue.measurements.observations import section_places, station_table

# How often errors alone exceed the reported bound; 5 % is usual.
BY_CHANCE = 0.05


@dataclass(frozen=True)
class HeldOutErrors:
    """Errors at what was not seen, over those expected [-], and the ratio that errors alone exceed in 5 % of cases.

    ratio: NaN without velocities that were not seen, infinite where the model finds no flow for them.
    """

    ratio: float
    by_chance: float


def held_out_errors(base: Baseline, held_out: Model) -> HeldOutErrors:
    """Those of a calibrated model, effects included; held_out: the model at stations that no calibration uses."""
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
    by_chance = float(np.sqrt(chdtri(degrees, BY_CHANCE) / degrees))
    return HeldOutErrors(float(np.sqrt((error**2).sum() / total)), by_chance)


@dataclass(frozen=True)
class UnseenErrors:
    """Measured less predicted at stations that no calibration uses, as the calibrated ones let expect: mean and
    standard error (station,) [unit of the station], without the error of reading.
    """

    mean: Array
    error: Array


def unseen_errors(base: Baseline, unseen: Model, there: Point) -> UnseenErrors | None:
    """Those of a calibrated model, e of the head of this file with all errors of model and site that stations share;
    there: the point of the same parameters. None where no flow is found on the cells of the model's own error.

    The error of the grid is that at the stations; that of a discharge is no calibrated one's.
    """
    where = with_error_there(model_that_errs(base))
    same = where.model.site.bed.shape == unseen.site.bed.shape
    coarse = coarser(unseen)
    on_coarse = None if coarse is None else linearise(coarse, there.z)
    cells, point = (unseen, there) if same else (coarse, on_coarse)
    if cells is None or point is None:
        return None
    allowed = where.model.case.model_error
    shared = allowed.model_copy(update={"probes": 0.0, "discharge": 0.0})
    at_stations, elsewhere = (
        np.hstack([at.slope, model_error_columns(model, at, shared)])
        for model, at in ((where.model, where.point), (cells, point))
    )
    mean, covariance = _given_residual(where, at_stations[where.noise.rows], elsewhere, point)
    of_discharge = ModelError(discharge=allowed.discharge)
    own = site_error_columns(cells, point, of_discharge, CellResponses(cells.site.grid, {}))
    of_grid = constants().grid_error_share * (there.prediction - (there if on_coarse is None else on_coarse).prediction)
    variance = np.diag(covariance) + (own**2).sum(axis=1) + of_grid**2
    return UnseenErrors(mean, np.sqrt(np.maximum(variance, 0.0)))


def _given_residual(where: SearchModel, at_stations: Array, there: Array, point: Point) -> tuple[Array, Array]:
    """Mean (k,) and covariance (k, k) of e at other stations, see the head of this file.

    at_stations, there: [J, M] and [J_e, M_e] (stations, p + m); point: that of the other stations.
    """
    whole, residual = free_of_prior(where)
    factor = scipy.linalg.cho_factor(whole, lower=True)
    shared = at_stations @ there.T
    mean = shared.T @ scipy.linalg.cho_solve(factor, residual) - there[:, : point.z.size] @ point.z
    return mean, there @ there.T - shared.T @ scipy.linalg.cho_solve(factor, shared)


# Share of the cases in which the errors are to be smaller than the reported bound, and draws of them: the 95 % point of
# 2,000 is known to half a per cent of the share.
SHARE_BELOW, DRAWN_ERRORS = 0.95, 2000


def largest_error_between(base: Baseline) -> float:
    """The root mean square of e and the errors of data and site, over that of those alone [-]: so much in SHARE_BELOW
    of the cases. NaN if there are no velocities, or the flow is not found.
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
    mean, covariance = _given_residual(where, columns[:count][noise.rows], columns[count:], point)
    random = np.random.default_rng(1)
    drawn = random.multivariate_normal(mean, covariance, DRAWN_ERRORS, check_valid="ignore", method="eigh")
    expected = float(np.mean(base.noise.data_error[seen] ** 2)) + float((of_site**2).sum(axis=1).mean())
    squares = (drawn**2).mean(axis=1) / expected
    return float(np.sqrt(1.0 + np.quantile(squares, SHARE_BELOW)))


@dataclass(frozen=True)
class ActsElsewhere:
    """Something at a place changes the velocity by `change` halfway between sections at x [m], and by `at_stations` at
    most where it was measured [m/s].
    """

    change: float
    x: float
    at_stations: float


def acts_elsewhere(before: Baseline, after: Baseline) -> ActsElsewhere | None:
    """Whether something at a place acts mostly between the sections: its largest change of the velocity halfway there
    is mostly_elsewhere times that at the stations; None when it acts at the stations as well.
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
    """The stations of velocities moved halfway to the next section of their experiment downstream, or to the end of the
    channel [m], where none is in use: in another one a boat lies some centimetres off.
    """
    velocity = station[leading_velocities(station)]
    middle = section_places(velocity)

    def ahead(of_experiment: "pd.Series[float]") -> "pd.Series[float]":
        places = np.unique(of_experiment)
        steps = 0.5 * (np.append(places[1:], end) - places)
        return of_experiment.map(dict(zip(places, steps, strict=True)))

    moved = velocity["x"] + middle.groupby(velocity["experiment"]).transform(ahead)
    return velocity.assign(x=np.minimum(moved, end), used=False)
