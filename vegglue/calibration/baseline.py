"""The calibrated model that a diagnosis starts from: its MAP estimate, its noise, and the error of its grid.

The baselines of a case and of its child, which several steps of a run begin with, each computed once.
"""

import hashlib
import json
from collections import OrderedDict
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.calibration.fit import MapEstimate, at_point, fit, log_evidence_under, objective
from vegglue.calibration.model_error import any_error, model_error_columns
from vegglue.calibration.noise import (
    Noise,
    noise_of,
    with_grid_error,
    with_independent_grid_errors,
    with_model_error,
)
from vegglue.case.channel_geometry import cells_across
from vegglue.case.parameter_space import refuse_without_parameters
from vegglue.case.resolved_config import dumped, plain_tree
from vegglue.engine.interface import Model, Point, by_itself, linearise, linearise_from
from vegglue.engine.model import coarser
from vegglue.engine.newton import NEWTON
from vegglue.errors import InputError
from vegglue.parallel import in_threads

# Points of the prior that are computed on the coarse grid, and how many of them the fit starts from. Chosen, not
# measured: more cost runs of the coarse model and guard against a local minimum.
PRIOR_POINTS, FITTED_POINTS = 8, 2
# Their spread over that of the prior [-]: at its ends a flow is not always found. Chosen, not measured.
START_SPREAD = 0.7
# Standard errors by which the model's own error has to move the best place to be computed again there. Chosen, not
# measured: each time costs the adjoints of all stations and a fit.
FAR_MOVED = 1.0
# Cells across the floor of the channel below which fingerprints are not computed on a grid. Chosen, not measured: a
# lower bound makes more searches cheap, and their fingerprints less exact.
FEWEST_CELLS_ACROSS = 7.0


@dataclass(frozen=True)
class Baseline:
    """A calibrated model; coarse, on_coarse: the model on cells of twice the size and its point at the same z.

    None where the grid cannot be coarsened, or the coarse model has no steady flow.
    """

    model: Model
    noise: Noise
    fitted: MapEstimate
    coarse: Model | None
    on_coarse: Point | None


@dataclass(frozen=True)
class SearchModel:
    """A cheap model for the search for missing effects, its noise, and its point at the MAP estimate."""

    model: Model
    noise: Noise
    point: Point


def search_model(base: Baseline) -> SearchModel:
    """The model on cells of twice the size, y_coarse = y - (f - f_coarse): residuals are those of the fine model.

    The model itself where the coarse one has fewer than FEWEST_CELLS_ACROSS.
    """
    point, searched = base.fitted.point, coarse_search(base)
    if searched is None:
        return SearchModel(base.model, base.noise, point)
    coarse, on_coarse = searched
    shift = base.noise.used(point.prediction - on_coarse.prediction)
    return SearchModel(coarse, replace(base.noise, value=base.noise.value - shift), on_coarse)


def searched_by_itself(base: Baseline) -> Baseline:
    """The baseline with nothing borrowed at the point of its search: many answers are asked for there."""
    searched = coarse_search(base)
    if searched is not None:
        return replace(base, on_coarse=by_itself(*searched))
    return replace(base, fitted=replace(base.fitted, point=by_itself(base.model, base.fitted.point)))


def coarse_search(base: Baseline) -> tuple[Model, Point] | None:
    """The model on cells of twice the size and its point; None where missing effects are searched on the case's own."""
    if base.coarse is None or base.on_coarse is None or cells_across(base.coarse.site) < FEWEST_CELLS_ACROSS:
        return None
    return base.coarse, base.on_coarse


def model_that_errs(base: Baseline) -> SearchModel:
    """The model on the cells from which its own error is told: those of the case where sides of patches may lie off,
    since cells of twice the size do not resolve what water does there; else those of the search.
    """
    if base.model.case.model_error.edges:
        return SearchModel(base.model, base.noise, base.fitted.point)
    return search_model(base)


def baseline(model: Model, known: Array | None = None) -> Baseline:
    """The calibrated model, from z = `known` (p,), else from the best points of the prior on coarse grids.

    What can be is done on cells of twice the size: there a fit costs a quarter. Errors: InputError when no steady flow
    is found, or there is nothing to calibrate.
    """
    refuse_without_parameters(model.case)
    noise, coarse = noise_of(model.station), coarser(model)
    if coarse is None:
        start = _best_from_prior(model, noise) if known is None else linearise(model, known)
        return with_own_error(Baseline(model, noise, fit(model, noise, _found(model, start)), None, None))
    near = _near(coarse, noise, known)
    if near is not None and cells_across(coarse.site) >= FEWEST_CELLS_ACROSS:
        noise = with_own_error_at(noise, coarse, near)
        near = near if known is not None else fit(coarse, noise, near).point
    z = known if near is None else near.z
    start = None if z is None else linearise_from(model, z, near)
    base = under_error_of_grid(Baseline(model, noise, at_point(noise, _found(model, start)), coarse, near))
    return with_own_error(base) if near is None else with_own_error_again(base, near.z)


def under_error_of_grid(trial: Baseline) -> Baseline:
    """The model calibrated on its own cells from a trial, the error of its grid told where that ends."""
    return with_error_of_grid(with_coarse_point(with_error_of_grid(trial)))


def with_own_error_again(base: Baseline, z: Array) -> Baseline:
    """`with_own_error`, unless coarse cells told it at a place z (p,) that is near enough."""
    if _told_on_coarse_cells(base) and _is_near(base, z):
        return with_coarse_point(base)
    # The model's own error moves the best place, and is another there.
    return with_own_error(base)


def with_own_error_at(noise: Noise, coarse: Model, point: Point) -> Noise:
    """The noise with the model's own error as coarse cells tell it at a point."""
    return with_model_error(noise, model_error_columns(coarse, point, coarse.case.model_error))


def with_coarse_point(base: Baseline) -> Baseline:
    """With the point on coarse cells at the same z."""
    coarse, z, known = base.coarse, base.fitted.point.z, base.on_coarse
    if coarse is None or (known is not None and np.array_equal(known.z, z)):
        return base
    return replace(base, on_coarse=linearise(coarse, z, known))


def _near(coarse: Model, noise: Noise, known: Array | None) -> Point | None:
    """A point on cells of twice the size to start from: a known place, or the best from the prior."""
    if known is not None:
        return linearise(coarse, known)
    coarsest = coarser(coarse)
    if coarsest is None:
        return _best_from_prior(coarse, noise)
    return _from_coarse(coarse, noise, _best_from_prior(coarsest, noise)).point


def _found(model: Model, start: Point | None) -> Point:
    if start is None:
        raise InputError(f"{model.case.name}: the model finds no steady flow at its best point; widen the priors.")
    return start


def with_error_of_grid(base: Baseline) -> Baseline:
    """The error of the grid from its point on coarse cells, and the model calibrated under it."""
    noise = with_grid_error(base.noise, grid_difference(base.fitted.point, base.on_coarse))
    return replace(base, noise=noise, fitted=fit(base.model, noise, base.fitted.point))


def _told_on_coarse_cells(base: Baseline) -> bool:
    """Whether the noise holds the model's own error already, from coarse cells that are good enough for it."""
    return bool(base.noise.model_error.any()) and not base.model.case.model_error.edges


def _is_near(base: Baseline, z: Array) -> bool:
    """Whether the best place lies within FAR_MOVED standard errors of z (p,) in every parameter."""
    moved = np.abs(base.fitted.point.z - z) / np.sqrt(np.diag(base.fitted.covariance))
    return bool(moved.max(initial=0.0) <= FAR_MOVED)


def with_own_error(base: Baseline) -> Baseline:
    """The baseline with the model's own error as the case allows it, computed at its point, and calibrated under it."""
    allowed = base.model.case.model_error
    if not any_error(allowed):
        return base
    where = model_that_errs(base)
    noise = with_model_error(base.noise, model_error_columns(where.model, where.point, allowed))
    fitted = fit(base.model, noise, base.fitted.point)
    return with_coarse_point(replace(base, noise=noise, fitted=fitted))


def log_evidence(base: Baseline) -> float:
    """ln p(y) - 1/2 ln|C| of a calibrated model, C the covariance of its errors, up to a constant of the data [-].

    Under the errors as they are told now: a screening tells them anew, and keeps the place of the fit.
    """
    here = at_point(base.noise, base.fitted.point)
    return log_evidence_under(here) - float(np.log(np.diag(base.noise.lower)).sum())


def for_prediction(base: Baseline) -> Baseline:
    """The model calibrated for predictions on its own grid: errors of the grid are independent between stations."""
    if base.coarse is None:
        return base
    noise = with_independent_grid_errors(base.noise)
    return replace(base, noise=noise, fitted=fit(base.model, noise, base.fitted.point))


def _best_from_prior(model: Model, noise: Noise) -> Point:
    """The point of the best fit among those that start from the best points of the prior."""
    ends = in_threads(fit, [(model, noise, start) for start in _starts(model, noise)])
    return min(ends, key=lambda found: found.objective).point


def _from_coarse(model: Model, noise: Noise, near: Point) -> MapEstimate:
    """The MAP estimate of a model, from a point of one on cells of twice the size."""
    start = linearise_from(model, near.z, near)
    if start is None:
        raise InputError(f"{model.case.name}: the model finds no steady flow on cells of half the size; refine `grid`.")
    return fit(model, noise, start)


def grid_difference(point: Point, on_coarse: Point | None) -> Array:
    """f - f_coarse (station,) [m/s or m], to cells of twice the size; zero where no steady flow is found on these."""
    return point.prediction - (point if on_coarse is None else on_coarse).prediction


def places_of_prior(parameters: int) -> Array:
    """The middle of the prior, and Sobol' points around it, z (PRIOR_POINTS, p)."""
    from scipy.stats import norm, qmc  # late: what only looks at a case need not wait for it

    places = norm.ppf(qmc.Sobol(parameters, seed=1).random(PRIOR_POINTS))
    places[0] = 0.0
    return np.asarray(START_SPREAD * places)


def _starts(model: Model, noise: Noise) -> list[Point]:
    """The FITTED_POINTS with the least objective, of the places of the prior."""
    middle, *others = places_of_prior(len(model.names))
    first = linearise(model, middle)
    tried = [first, *in_threads(linearise_from, [(model, z, first) for z in others])]
    found = [point for point in tried if point is not None]
    if not found:
        raise InputError(
            f"{model.case.name}: no steady flow was found at any of {PRIOR_POINTS} points of the prior; see what "
            "`vegglue check` says of outlet, inflow and bed, and correct the levels, discharges or priors."
        )
    return sorted(found, key=lambda point: objective(noise, point))[:FITTED_POINTS]


# A case and its child [-]: each holds factors of all its experiments, each 0.2 GB by its size at 1142 x 40 cells.
MOST_KEPT = 2
# Keys of a case on which no calibration hangs, as pydantic wants those to leave out.
ONLY_NAMED = dict.fromkeys(
    ("name", "title", "simulate", "infer", "survey", "validation", "reference", "canopy_correction"), True
) | {"frame": True, "imported": True}
_kept: OrderedDict[str, Baseline] = OrderedDict()


def kept_baseline(model: Model) -> Baseline:
    """`baseline` of a model from its prior; of the same grid, measurements and priors it is not made again."""
    if model.engine is not NEWTON or model.case.effect_file is not None:  # codes of others, which may have changed
        return baseline(model)
    key = _content_of(model)
    found = _kept.pop(key, None)
    if found is None:
        found = baseline(model)
    else:
        found = replace(found, model=model, coarse=None if found.coarse is None else coarser(model))
    _kept[key] = found
    while len(_kept) > MOST_KEPT:
        _kept.popitem(last=False)
    return found


def _content_of(model: Model) -> str:
    """A digest of what the predictions of a model and its misfit hang on, as it was read."""
    tree = plain_tree(dumped(model.case, ONLY_NAMED), str)
    digest = hashlib.sha256(json.dumps(tree).encode())
    for site in (model.site, *model.site.own.values()):
        for values in (site.bed, site.friction_class, site.patch, site.cover):
            digest.update(values.tobytes())
    digest.update(pd.util.hash_pandas_object(model.station, index=False).to_numpy().tobytes())
    return digest.hexdigest()
