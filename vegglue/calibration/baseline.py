"""The calibrated model that a diagnosis starts from: its best place, its noise, and the error of its grid."""

from dataclasses import dataclass, replace

import scipy.stats

from vegglue.arrays import Array
from vegglue.calibration.fit import Fitted, fit, objective
from vegglue.calibration.noise import Noise, noise_of, scattered, with_grid_error
from vegglue.engine.interface import Model, Point, linearise
from vegglue.engine.model import coarser
from vegglue.errors import InputError
from vegglue.site.channel_geometry import cells_across

# Places of the prior that are looked at on the coarse grid, and how many of them are followed downhill.
LOOKED_AT, FOLLOWED = 8, 2
# Cells across the floor below which a grid is no place to compare effects.
ENOUGH_ACROSS = 7.0


@dataclass(frozen=True)
class Baseline:
    """A model at its best place; coarse, on_coarse: the same on cells of twice the size and its point at the same
    place, when the grid can be coarsened.
    """

    model: Model
    noise: Noise
    fitted: Fitted
    coarse: Model | None
    on_coarse: Point | None


@dataclass(frozen=True)
class SearchModel:
    """What a search for missing effects fits again and again: a cheap model, its noise, and a point of it."""

    model: Model
    noise: Noise
    point: Point


def search_model(base: Baseline) -> SearchModel:
    """The model on cells of twice the size, its measurements shifted by what the grid makes of the predictions.

    The model itself when cells of twice the size are too coarse for the floor of the channel.
    """
    point = base.fitted.point
    if base.coarse is None or base.on_coarse is None or cells_across(base.coarse.site) < ENOUGH_ACROSS:
        return SearchModel(base.model, base.noise, point)
    shift = base.noise.used(point.prediction - base.on_coarse.prediction)
    return SearchModel(base.coarse, replace(base.noise, value=base.noise.value - shift), base.on_coarse)


def baseline(model: Model, known: Array | None = None) -> Baseline:
    """Calibrate a model: from `known` (p,), or from the best of some places of the prior, on coarse grids first.

    Errors: InputError when no flow is found anywhere.
    """
    noise, coarse = noise_of(model.station), coarser(model)
    near = None
    if known is None and coarse is not None:
        coarsest = coarser(coarse)
        near = _searched(coarsest or coarse, noise)
        near = near if coarsest is None else _refined(coarse, noise, near).point
        known = near.z
    start = _searched(model, noise) if known is None else linearise(model, known, near) or linearise(model, known)
    if start is None:
        raise InputError(f"{model.case.name}: the model finds no steady flow at its best place; widen the priors.")
    fitted = fit(model, noise, start)
    if coarse is None:
        return Baseline(model, noise, fitted, None, None)
    on_coarse = linearise(coarse, fitted.point.z, near) or linearise(coarse, fitted.point.z)
    noise = with_grid_error(noise, grid_difference(fitted.point, on_coarse))
    fitted = fit(model, noise, fitted.point)
    return Baseline(model, noise, fitted, coarse, on_coarse)


def for_prediction(base: Baseline) -> Baseline:
    """The same model calibrated so that it predicts on its own grid, whatever a finer one would say."""
    if base.coarse is None:
        return base
    noise = scattered(base.noise)
    return replace(base, noise=noise, fitted=fit(base.model, noise, base.fitted.point))


def _searched(model: Model, noise: Noise) -> Point:
    """The best place of a model, from the best of some places of its prior."""
    return min((fit(model, noise, start) for start in _starts(model, noise)), key=lambda found: found.objective).point


def _refined(model: Model, noise: Noise, near: Point) -> Fitted:
    """The best place of a model, from that of one on cells of twice the size."""
    start = linearise(model, near.z, near) or linearise(model, near.z)
    if start is None:
        raise InputError(f"{model.case.name}: the model finds no steady flow on cells of half the size; refine `grid`.")
    return fit(model, noise, start)


def grid_difference(point: Point, on_coarse: Point | None) -> Array:
    """What predictions (station,) change by on cells of twice the size; zero where the coarse flow finds no rest."""
    return point.prediction - (point if on_coarse is None else on_coarse).prediction


def _starts(model: Model, noise: Noise) -> list[Point]:
    """The best of the middle of the prior and some places around it, and how well they fit before any step."""
    places = scipy.stats.norm.ppf(scipy.stats.qmc.Sobol(len(model.names), seed=1).random(LOOKED_AT))
    places[0] = 0.0
    found = [point for z in places if (point := linearise(model, 0.7 * z)) is not None]
    if not found:
        raise InputError(f"{model.case.name}: no steady flow was found at any of {LOOKED_AT} places of the prior.")
    return sorted(found, key=lambda point: objective(noise, point))[:FOLLOWED]
