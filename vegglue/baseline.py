"""The calibrated model that a diagnosis starts from: its best place, its noise, and the error of its grid."""

from dataclasses import dataclass

import numpy as np
import scipy.stats

from vegglue.effect import Array
from vegglue.errors import InputError
from vegglue.fit import Fitted, fit, objective
from vegglue.linearise import Model, Point, linearise
from vegglue.noise import Noise, noise_of, with_grid_error
from vegglue.schema import Case
from vegglue.site import build_site

# Places of the prior that are looked at on the coarse grid, and how many of them are followed downhill.
LOOKED_AT, FOLLOWED = 8, 2
FEWEST_CELLS = 8


@dataclass(frozen=True)
class Baseline:
    """A model at its best place; coarse: the same on cells of twice the size, when the grid can be halved."""

    model: Model
    noise: Noise
    fitted: Fitted
    coarse: Model | None


def baseline(model: Model, known: Array | None = None) -> Baseline:
    """Calibrate a model: from `known` (p,), or from the best of some places of the prior, first on a coarse grid.

    Errors: InputError when no flow is found anywhere.
    """
    noise = noise_of(model.station)
    coarse = coarser(model)
    on_coarse = None
    if known is None:
        search = coarse or model
        fits = [fit(search, noise, start) for start in _starts(search, noise)]
        best = min(fits, key=lambda found: found.objective)
        known, on_coarse = best.point.z, best.point
    start = linearise(model, known, on_coarse if coarse is not None else None) or linearise(model, known)
    if start is None:
        raise InputError(f"{model.case.name}: the model finds no steady flow at its best place; widen the priors.")
    fitted = fit(model, noise, start)
    if coarse is not None:
        noise = with_grid_error(noise, grid_difference(coarse, fitted.point, on_coarse))
        fitted = fit(model, noise, fitted.point)
    return Baseline(model, noise, fitted, coarse)


def grid_difference(coarse: Model, point: Point, near: Point | None = None) -> Array:
    """What predictions (station,) change by on cells of twice the size; zero where the coarse flow finds no rest."""
    there = linearise(coarse, point.z, near)
    return np.zeros_like(point.prediction) if there is None else np.asarray(point.prediction - there.prediction)


def coarser(model: Model) -> Model | None:
    """The model on cells of twice the size; None where their number is odd or would become too small."""
    grid = model.site.grid
    if grid.x.size % 2 or grid.y.size % 2 or min(grid.x.size, grid.y.size) < 2 * FEWEST_CELLS:
        return None
    cell = (2.0 * model.case.grid.cell[0], 2.0 * model.case.grid.cell[1])
    case: Case = model.case.model_copy(update={"grid": model.case.grid.model_copy(update={"cell": cell})})
    return Model(case, build_site(case), model.station)


def _starts(model: Model, noise: Noise) -> list[Point]:
    """The best of the middle of the prior and some places around it, and how well they fit before any step."""
    places = scipy.stats.norm.ppf(scipy.stats.qmc.Sobol(len(model.names), seed=1).random(LOOKED_AT))
    places[0] = 0.0
    found = [point for z in places if (point := linearise(model, 0.7 * z)) is not None]
    if not found:
        raise InputError(f"{model.case.name}: no steady flow was found at any of {LOOKED_AT} places of the prior.")
    return sorted(found, key=lambda point: objective(noise, point))[:FOLLOWED]
