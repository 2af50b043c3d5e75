"""One look at a calibrated model: which effect, place or single station the misfit points at, and how surely."""

from dataclasses import dataclass

import numpy as np
import scipy.stats

from vegglue import score
from vegglue.baseline import Baseline
from vegglue.candidates import Candidate, candidates_of, start_of, with_effect
from vegglue.effect import Amplitude, Array
from vegglue.ground import half_width
from vegglue.linearise import fingerprint, z_of
from vegglue.noise import Noise, estimated
from vegglue.places import Spots, spots
from vegglue.schema import Case

# Size [1/m] of unlisted drag that is set aside when the noise is estimated.
PLAUSIBLE_SPOT = 0.3
# Size, in standard errors, of what is most suspect when the noise is estimated for good: without bound, else
# what is missing passes for correlated errors (a floor 2 cm too high did, and went from 7.2 to 4.2 standard errors).
FREE = 1e4


@dataclass(frozen=True)
class Family:
    """Scores T of fingerprints that are one hypothesis, and the chance of the best of them under errors alone.

    log_p: natural logarithm of the family-wise p-value, carried on beyond what the bootstrap can count.
    """

    scores: Array
    log_p: float

    @property
    def best(self) -> int:
        return int(np.argmax(self.scores**2))

    @property
    def p(self) -> float:
        return float(np.exp(self.log_p))


@dataclass(frozen=True)
class Look:
    """Fingerprints at a baseline and what the residual says of them.

    columns: for each candidate, its columns among `traces`; settings: shapes of each column; own: candidate of each.
    """

    noise: Noise
    candidates: list[Candidate]
    columns: list[np.ndarray]
    settings: list[dict[str, float]]
    traces: Array  # whitened (n, c)
    slopes: Array  # whitened (n, p)
    projected: score.Projected
    scores: Array
    maxima: Array
    effects: Family
    places: Family
    stations: Family
    spots: Spots
    spot_length: Array

    def best_column(self, candidate: int) -> int:
        columns = self.columns[candidate]
        return int(columns[np.argmax(self.scores[columns] ** 2)])

    def family_p(self, candidate: int) -> float:
        return score.family_p(float(self.scores[self.best_column(candidate)]), self.maxima)


def look(base: Baseline, flagged: tuple[int, ...], seed: int = 1) -> Look:
    """Fingerprints of all candidates, of spots everywhere and of single stations, against the residual.

    Fingerprints and slopes are those of the quick model: they only have to point the right way. The correlation of the
    errors is estimated first, with all that could be missing set aside.
    """
    model, _, point = base.quick
    candidates = candidates_of(model.case, model.station)
    changed, columns, settings = _changes(model.case, candidates)
    there = spots(model, point, half_width(base.model.site))
    slope, prints, spot_prints = (
        base.noise.used(values) for values in (point.slope, fingerprint(model, point, changed), there.traces)
    )
    left = base.noise.residual(base.fitted.point.prediction)
    sizes = np.array([amplitude.plausible for _, _, amplitude in changed])
    explained = np.hstack([slope, prints * sizes, spot_prints * PLAUSIBLE_SPOT])
    noise = _set_aside(estimated(base.noise, left, explained), slope, left, base.fitted.point.z, explained)

    def against(traces: Array) -> score.Projected:
        return score.project(noise.whiten(slope), noise.whiten(left), base.fitted.point.z, noise.whiten(traces))

    one_sided = np.array([amplitude.low >= amplitude.off for _, _, amplitude in changed])
    projected, of_spots, of_stations = against(prints), against(spot_prints), against(np.eye(left.size))
    maxima = _maxima(projected, one_sided, seed)
    seen, alone = score.scores(projected, one_sided), score.scores(of_stations, np.zeros(left.size, bool))
    alone[list(flagged)] = 0.0
    return Look(
        noise=noise,
        candidates=candidates,
        columns=columns,
        settings=settings,
        traces=noise.whiten(prints),
        slopes=noise.whiten(slope),
        projected=projected,
        scores=seen,
        maxima=maxima,
        effects=_family(seen, maxima),
        places=_both_ways(of_spots, seed),
        stations=_family(alone, _maxima(of_stations, np.zeros(left.size, bool), seed)),
        spots=there,
        spot_length=of_spots.length,
    )


def _set_aside(noise: Noise, slope: Array, left: Array, z: Array, explained: Array) -> Noise:
    """The noise estimated again, with the one trace that the residual points at set aside whatever its size."""
    seen = score.project(noise.whiten(slope), noise.whiten(left), z, noise.whiten(explained))
    best = int(np.argmax((seen.units.T @ seen.residual) ** 2))
    free = explained[:, best : best + 1] * (FREE / max(float(seen.length[best]), 1e-300))
    return estimated(noise, left, np.hstack([explained, free]))


def _changes(
    case: Case, candidates: list[Candidate]
) -> tuple[list[tuple[Case, str, Amplitude]], list[np.ndarray], list[dict[str, float]]]:
    """The case with each candidate at each of its settings, which columns are whose, and the settings."""
    changed: list[tuple[Case, str, Amplitude]] = []
    columns: list[np.ndarray] = []
    settings: list[dict[str, float]] = []
    for one in candidates:
        tried = one.settings()
        columns.append(np.arange(len(changed), len(changed) + len(tried)))
        changed += [(with_effect(case, one, shapes), one.parameter, one.effect.amplitude) for shapes in tried]
        settings += tried
    return changed, columns, settings


def _maxima(projected: score.Projected, one_sided: np.ndarray, seed: int) -> Array:
    return np.asarray((score.null_draws(projected, one_sided, seed) ** 2).max(axis=1))


def _both_ways(projected: score.Projected, seed: int) -> Family:
    two = np.zeros(projected.length.size, bool)
    return _family(score.scores(projected, two), _maxima(projected, two, seed))


def refit_start(base: Baseline, seen: Look, candidate: int, changed: Case) -> Array:
    """Where in z (p + 1,) to begin the refit with a candidate: the joint linear step of all parameters."""
    column = seen.best_column(candidate)
    point, one = base.fitted.point, seen.candidates[candidate]
    gain = float(seen.scores[column] / max(seen.projected.length[column], 1e-300))
    amplitude = start_of(one.effect, gain)
    slope, noise = seen.slopes, seen.noise
    left = noise.whiten(noise.residual(point.prediction)) - seen.traces[:, column] * gain
    matrix = slope.T @ slope + np.eye(point.z.size)
    step = np.linalg.solve(matrix, slope.T @ left - point.z)
    step *= min(1.0, 1.0 / float(np.abs(step).max() + 1e-300))
    return np.append(point.z + step, z_of(changed.parameters[one.parameter], amplitude))


def _family(scores: Array, maxima: Array) -> Family:
    """The tail of the maximum of c alike squares: 1 - (1 - sf(T^2))^c, c so that it fits the bootstrap at 95 %."""
    if scores.size == 0:
        return Family(np.zeros(1), 0.0)
    many = -np.log(0.95) / scipy.stats.chi2.sf(np.quantile(maxima, 0.95), 1)
    log_tail = scipy.stats.chi2.logsf(float((scores**2).max()), 1)
    log_p = np.log(many) + log_tail
    if log_p > -4.0:
        log_p = float(np.log(-np.expm1(many * np.log1p(-np.exp(log_tail)))))
    return Family(scores, float(min(log_p, 0.0)))
