"""What a refined posterior stands on: the best places of the prior, and the errors of the data there.

Several members of an ensemble are followed downhill, on cells of twice the size where the grid can be halved, and the
ends finished on the case's own. Ends that are the same count once.
"""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, grid_difference
from vegglue.calibration.fit import Fitted, fit
from vegglue.calibration.noise import Noise, noise_of, with_grid_error
from vegglue.case.parameter_space import z_at
from vegglue.engine.interface import Model, Point, linearise
from vegglue.engine.model import coarser
from vegglue.errors import InputError
from vegglue.inference.likelihood import fit_members
from vegglue.parallel import in_threads
from vegglue.results.ensemble import Ensemble
from vegglue.screening.residual_screening import screen

# Members followed downhill, among how many of the best, and how far apart [standard deviations of the prior].
STARTS, AMONG, APART = 4, 64, 0.7
# Modes whose misfit lies further above the best one's than this weigh nothing: exp(-15).
HOPELESS = 30.0


@dataclass(frozen=True)
class Modes:
    """Ends of the search on the case's own grid, the best first, and how many members were followed."""

    fits: tuple[Fitted, ...]
    starts: int


def modes_of(model: Model, noise: Noise, ensemble: Ensemble) -> Modes:
    """Errors: InputError when no flow is found from any of the members."""
    starts = starting_places(noise, z_at(model.case, ensemble.parameters), ensemble.prediction)
    coarse = coarser(model)
    ends = _followed(coarse or model, noise, starts)
    if coarse is not None:
        ends = _finished(model, coarse, noise, ends)
    if not ends:
        raise InputError(f"{model.case.name}: no steady flow was found from the best members; use `--method glue`.")
    return Modes(tuple(ends), len(starts))


def starting_places(noise: Noise, z: Array, prediction: Array) -> Array:
    """The best members (STARTS at most, p) that lie apart, by |W (y - f)|^2 + |z|^2; z (m, p), prediction (m, n).

    Errors: InputError when no member has a prediction at all used stations.
    """
    left = noise.value - prediction[:, noise.rows]
    known = np.flatnonzero(np.isfinite(left).all(axis=1))
    if not known.size:
        raise InputError(f"ensemble: none of the {len(z)} members was solved; see the reasons stored with them.")
    misfit = np.sum(noise.whiten(left[known].T) ** 2, axis=0) + np.sum(z[known] ** 2, axis=1)
    order = known[np.argsort(misfit, kind="stable")][:AMONG]
    chosen = [int(order[0])]
    for member in order[1:]:
        if len(chosen) < STARTS and np.linalg.norm(z[chosen] - z[member], axis=1).min() > APART:
            chosen.append(int(member))
    return np.asarray(z[chosen])


def _followed(model: Model, noise: Noise, starts: Array) -> list[Fitted]:
    return distinct([end for end in in_threads(_follow, [(model, noise, z) for z in starts]) if end is not None])


def _follow(model: Model, noise: Noise, z: Array) -> Fitted | None:
    start = linearise(model, z)
    return None if start is None else fit(model, noise, start)


def _finished(model: Model, coarse: Model, noise: Noise, ends: list[Fitted]) -> list[Fitted]:
    finer = in_threads(_finish, [(model, coarse, noise, end) for end in ends])
    return distinct([end for end in finer if end is not None])


def _finish(model: Model, coarse: Model, noise: Noise, end: Fitted) -> Fitted | None:
    """First on the coarse cells with what the fine ones change in the predictions, then on the fine ones."""
    start = linearise(model, end.point.z, end.point)
    if start is None:
        return None
    changed = noise.used(start.prediction - end.point.prediction)
    there = fit(coarse, replace(noise, value=noise.value - changed), end.point).point.z
    nearer = linearise(model, there, start)
    return fit(model, noise, start if nearer is None else nearer)


def distinct(ends: list[Fitted]) -> list[Fitted]:
    """The ends, best first, without those within a standard deviation of a better one, and without hopeless ones."""
    found: list[Fitted] = []
    for end in sorted(ends, key=lambda one: one.objective):
        if not found or (
            end.objective - found[0].objective < HOPELESS
            and all(_distance(other, end.point.z) > 1.0 for other in found)
        ):
            found.append(end)
    return found


def _distance(end: Fitted, z: Array) -> float:
    away = z - end.point.z
    return float(np.sqrt(away @ np.linalg.solve(end.covariance, away)))


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


def groundwork(model: Model, ensemble: Ensemble, rule: str) -> Groundwork:
    """Best places from the best members; then the errors, and the best places under these.

    known: errors as stated and that of the grid, from the difference to cells of twice the size; best-member: errors
    of one size for each kind of measurement, from what the best place leaves (this holds that of the grid). The
    correlation along a section is estimated in both, with all that could be missing in the model set aside.
    Errors: InputError when a standard error is missing (known) or no flow is found.
    """
    noise = _first_noise(model, ensemble, rule)
    modes = modes_of(model, noise, ensemble)
    fits, coarse = list(modes.fits), coarser(model)
    on_coarse = None if coarse is None else linearise(coarse, fits[0].point.z)
    if rule == "known":
        noise = with_grid_error(noise, grid_difference(fits[0].point, on_coarse))
    for _ in range(TURNS if rule != "known" else 0):
        noise = _sized(noise, fits[0], model.station)
        fits = _again(model, noise, fits)
    estimated = screen(Baseline(model, noise, fits[0], coarse, on_coarse)).base.noise
    noise = estimated if rule == "known" else replace(estimated, scale=1.0)
    fits = _again(model, noise, fits)
    surprise = unexplained_residual(noise, fits[0].point)
    return Groundwork(model, noise, tuple(fits), modes.starts, surprise, rule == "known" and on_coarse is not None)


def unexplained_residual(noise: Noise, point: Point) -> Array:
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
