"""The best places of a prior: steps downhill from several members of an ensemble, ends that are the same counted once.

Members are followed on cells of twice the size where the grid can be halved, and the ends finished on the case's own.
"""

from dataclasses import dataclass, replace

import numpy as np

from vegglue.baseline import coarser
from vegglue.cores import in_threads
from vegglue.effect import Array
from vegglue.ensemble import Ensemble
from vegglue.errors import InputError
from vegglue.fit import Fitted, fit
from vegglue.linearise import Model, linearise, z_at
from vegglue.noise import Noise

# Members followed downhill, among how many of the best, and how far apart [standard deviations of the prior].
STARTS, AMONG, APART = 4, 64, 0.7
# Modes whose misfit lies further above the best one's than this weigh nothing: exp(-15).
HOPELESS = 30.0


@dataclass(frozen=True)
class Modes:
    """Ends of the search on the case's own grid, the best first, and how many members were followed."""

    fits: tuple[Fitted, ...]
    starts: int


def modes_of(model: Model, noise: Noise, ensemble: Ensemble, jobs: int) -> Modes:
    """Errors: InputError when no flow is found from any of the members."""
    starts = starting_places(noise, z_at(model.case, ensemble.parameters), ensemble.prediction)
    coarse = coarser(model)
    ends = _followed(coarse or model, noise, starts, jobs)
    if coarse is not None:
        ends = _finished(model, coarse, noise, ends, jobs)
    if not ends:
        raise InputError(f"{model.case.name}: no steady flow was found from the best members; use `--method glue`.")
    return Modes(tuple(ends), len(starts))


def starting_places(noise: Noise, z: Array, prediction: Array) -> Array:
    """The best members (STARTS at most, p) that lie apart, by |W (y - f)|^2 + |z|^2; z (m, p), prediction (m, n)."""
    left = noise.value - prediction[:, noise.rows]
    known = np.flatnonzero(np.isfinite(left).all(axis=1))
    misfit = np.sum(noise.whiten(left[known].T) ** 2, axis=0) + np.sum(z[known] ** 2, axis=1)
    order = known[np.argsort(misfit, kind="stable")][:AMONG]
    chosen = [int(order[0])]
    for member in order[1:]:
        if len(chosen) < STARTS and np.linalg.norm(z[chosen] - z[member], axis=1).min() > APART:
            chosen.append(int(member))
    return np.asarray(z[chosen])


def _followed(model: Model, noise: Noise, starts: Array, jobs: int) -> list[Fitted]:
    return distinct([end for end in in_threads(_follow, [(model, noise, z) for z in starts], jobs) if end is not None])


def _follow(model: Model, noise: Noise, z: Array) -> Fitted | None:
    start = linearise(model, z)
    return None if start is None else fit(model, noise, start)


def _finished(model: Model, coarse: Model, noise: Noise, ends: list[Fitted], jobs: int) -> list[Fitted]:
    finer = in_threads(_finish, [(model, coarse, noise, end) for end in ends], jobs)
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
