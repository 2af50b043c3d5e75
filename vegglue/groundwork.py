"""What a refined posterior stands on: the best places of the prior, and the errors of the data there."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from vegglue.baseline import Baseline, coarser, grid_difference
from vegglue.effect import Array
from vegglue.ensemble import Ensemble
from vegglue.fit import Fitted, fit
from vegglue.likelihood import fit_members
from vegglue.linearise import Model, Point, linearise
from vegglue.modes import distinct, modes_of
from vegglue.noise import Noise, noise_of, with_grid_error
from vegglue.suspicion import look

# Turns of fitting and taking the size of the errors from what is left.
TURNS = 2


@dataclass(frozen=True)
class Groundwork:
    """Best places under the final errors, the best first; surprise: the residual of each used station (n,) that
    calibration cannot explain, in its own standard errors.
    """

    model: Model
    noise: Noise
    fits: tuple[Fitted, ...]
    starts: int
    surprise: Array
    grid_known: bool


def groundwork(model: Model, ensemble: Ensemble, rule: str, jobs: int) -> Groundwork:
    """Best places from the best members; then the errors, and the best places under these.

    known: errors as stated and that of the grid, from the difference to cells of twice the size; best-member: errors
    of one size for each kind of measurement, from what the best place leaves (this holds that of the grid). The
    correlation along a section is estimated in both, with all that could be missing in the model set aside.
    Errors: InputError when a standard error is missing (known) or no flow is found.
    """
    noise = _first_noise(model, ensemble, rule)
    modes = modes_of(model, noise, ensemble, jobs)
    fits, coarse = list(modes.fits), coarser(model)
    on_coarse = None if coarse is None else linearise(coarse, fits[0].point.z)
    if rule == "known":
        noise = with_grid_error(noise, grid_difference(fits[0].point, on_coarse))
    for _ in range(TURNS if rule != "known" else 0):
        noise = _sized(noise, fits[0], model.station)
        fits = _again(model, noise, fits)
    seen = look(Baseline(model, noise, fits[0], coarse, on_coarse))
    noise = seen.noise if rule == "known" else replace(seen.noise, scale=1.0)
    fits = _again(model, noise, fits)
    surprise = unexplained(noise, fits[0].point)
    return Groundwork(model, noise, tuple(fits), modes.starts, surprise, rule == "known" and on_coarse is not None)


def unexplained(noise: Noise, point: Point) -> Array:
    """T_i = e_i' M r / (e_i' M e_i)^(1/2): M projects out what calibration can mimic; standard normal, each (n,)."""
    inverse = np.linalg.solve(noise.lower.T, np.linalg.solve(noise.lower, np.eye(noise.rows.size)))
    slope = noise.used(point.slope)
    pulled = inverse @ slope
    middle = np.linalg.inv(slope.T @ pulled + np.eye(point.z.size))
    projected = inverse - pulled @ middle @ pulled.T
    force = projected @ noise.residual(point.prediction) + pulled @ middle @ point.z
    return np.asarray(force / np.sqrt(np.diag(projected)))


def _first_noise(model: Model, ensemble: Ensemble, rule: str) -> Noise:
    if rule == "known":
        return noise_of(model.station)
    sigma = fit_members(ensemble, model.station, rule).sigma
    return noise_of(model.station.assign(standard_error=np.nan), sigma)


def _sized(noise: Noise, fitted: Fitted, station: pd.DataFrame) -> Noise:
    """s_k^2 = sum_k r^2 / (n_k (1 - p / n)) for each kind k, p the parameters that the data determine."""
    left = noise.residual(fitted.point.prediction)
    kind = station["kind"].to_numpy()[noise.rows]
    determined = fitted.covariance.shape[0] - float(np.trace(fitted.covariance))
    free = max(1.0 - determined / left.size, 1.0 / left.size)
    sigma = {str(k): float(np.sqrt(np.mean(left[kind == k] ** 2) / free)) for k in np.unique(kind)}
    return noise_of(station.assign(standard_error=np.nan), sigma)


def _again(model: Model, noise: Noise, fits: list[Fitted]) -> list[Fitted]:
    """Best places under other errors, a few steps from where they were."""
    return distinct([fit(model, noise, one.point) for one in fits])
