"""One look at a calibrated model: which effect, place or single station the misfit points at, and how surely."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.stats

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, search_model
from vegglue.calibration.noise import Noise, drawn_errors, estimated
from vegglue.case.parameter_space import z_of
from vegglue.case.schema import Case
from vegglue.results.diagnosis import ALARM
from vegglue.screening import score_test
from vegglue.screening.candidates import start_of
from vegglue.screening.fingerprints import Fingerprints, fingerprints_of

# Size [1/m] of unlisted drag that is set aside when the noise is estimated: twenty times the friction of a bed of
# n = 0.04 under 1 m of water. Chosen, not measured; from 0.1 to 1 the verdicts on open-a to open-f are the same.
PLAUSIBLE_SPOT = 0.3
# Size, in standard errors, of what is most suspect when the noise is estimated for good: without bound, else
# what is missing passes for correlated errors (a floor 2 cm too high did, and went from 7.2 to 4.2 standard errors).
# From 100 on verdicts are the same; with 1e6 the covariance can no longer be factored.
FREE = 1e4


@dataclass(frozen=True)
class Family:
    """Scores T of fingerprints that are one hypothesis; many: how many independent ones they amount to under errors
    alone, so that the chance of the best is 1 - (1 - sf(T^2))^many.
    """

    scores: Array
    many: float

    @property
    def best(self) -> int:
        return int(np.argmax(self.scores**2))

    def log_p(self, slack: float = 0.0) -> float:
        """ln of the family-wise p of a best score that is too large by `slack`, beyond what a bootstrap counts."""
        score = max(float(np.abs(self.scores).max()) - slack, 0.0)
        log_tail = float(scipy.stats.chi2.logsf(score**2, 1))
        log_p = np.log(self.many) + log_tail
        if log_p > -4.0:
            log_p = np.log(-np.expm1(self.many * np.log1p(-min(np.exp(log_tail), 1.0 - 1e-12))))
        return float(min(log_p, 0.0))


@dataclass(frozen=True)
class Screening:
    """What the residual of a baseline says of all that could be missing. base: with the errors as estimated here.

    white, slopes: whitened traces of candidates (n, c) and slopes (n, p); flagged: stations that count for nothing,
    places among the used ones; maxima: largest squares of scores under errors alone.
    """

    base: Baseline
    flagged: tuple[int, ...]
    traces: Fingerprints
    white: Array
    slopes: Array
    projected: score_test.Projected
    scores: Array
    maxima: Array
    effects: Family
    places: Family
    stations: Family
    spot_length: Array

    @property
    def noise(self) -> Noise:
        return self.base.noise

    def best_column(self, candidate: int) -> int:
        columns = self.traces.columns[candidate]
        return int(columns[np.argmax(self.scores[columns] ** 2)])

    def best_score(self, candidate: int) -> float:
        return float(self.scores[self.best_column(candidate)])

    def family_p(self, candidate: int) -> float:
        return score_test.family_p(self.best_score(candidate), self.maxima)

    @property
    def threshold(self) -> float:
        """Score that errors alone reach once in 1 / ALARM."""
        return float(np.sqrt(np.quantile(self.maxima, 1.0 - ALARM)))

    def may_be(self, length: float, most: float) -> np.ndarray:
        """Whether traces may be `length` standard errors long, with either sign, (2, c): see `Amplitude.may_be`."""
        return self.traces.may_be(length / np.maximum(self.projected.length, 1e-300), most)

    @property
    def order(self) -> list[int]:
        """Candidates, the best score first."""
        squares = [self.best_score(j) ** 2 for j in range(len(self.traces.candidates))]
        return [int(j) for j in np.argsort(-np.array(squares))]


def screen(base: Baseline, flagged: tuple[int, ...] = (), before: Screening | None = None, seed: int = 1) -> Screening:
    """Traces of all candidates, of spots everywhere and of single stations, against the residual.

    The correlation of the errors is estimated first, with all that could be missing set aside. before: an earlier look,
    whose traces are taken if they are those of the same point.
    """
    point = search_model(base).point
    traces = before.traces if before is not None and before.traces.point is point else fingerprints_of(base)
    slope, prints, spots = (base.noise.used(values) for values in (point.slope, traces.prints, traces.spots.traces))
    left, z = base.noise.residual(base.fitted.point.prediction), base.fitted.point.z
    noise = _noise(base.noise, traces, (slope, prints, spots), left, z)

    def against(values: Array) -> score_test.Projected:
        return score_test.project(noise.whiten(slope), noise.whiten(left), z, noise.whiten(values))

    projected, of_spots, of_stations = against(prints), against(spots), against(np.eye(left.size))
    errors = drawn_errors(noise, score_test.NULL_DRAWS, np.random.default_rng((seed, 1)))
    maxima, scores = _maxima(projected, traces.one_sided, errors, seed), score_test.scores(projected, traces.one_sided)
    return Screening(
        base=replace(base, noise=noise),
        flagged=flagged,
        traces=traces,
        white=noise.whiten(prints),
        slopes=noise.whiten(slope),
        projected=projected,
        scores=scores,
        maxima=maxima,
        effects=_family(scores, maxima),
        places=_both_ways(of_spots, (), errors, seed),
        stations=_both_ways(of_stations, flagged, errors, seed),
        spot_length=of_spots.length,
    )


def _noise(noise: Noise, traces: Fingerprints, used: tuple[Array, Array, Array], left: Array, z: Array) -> Noise:
    """The noise of a residual `left` with all that could be missing set aside, slopes, prints and spots (n, ...).

    Estimated twice: for good with the one trace that the residual points at set aside whatever its size.
    """
    slope, prints, spots = used
    sizes = np.array([amplitude.plausible for amplitude in traces.amplitudes])
    explained = np.hstack([slope, prints * sizes, spots * PLAUSIBLE_SPOT])
    first = estimated(noise, left, explained)
    seen = score_test.project(first.whiten(slope), first.whiten(left), z, first.whiten(explained))
    best = int(np.argmax((seen.units.T @ seen.residual) ** 2))
    free = explained[:, best : best + 1] * (FREE / max(float(seen.length[best]), 1e-300))
    return estimated(first, left, np.hstack([explained, free]))


def _maxima(projected: score_test.Projected, one_sided: np.ndarray, errors: Array, seed: int) -> Array:
    return np.asarray((score_test.null_draws(projected, one_sided, errors, seed) ** 2).max(axis=1))


def _both_ways(projected: score_test.Projected, flagged: tuple[int, ...], errors: Array, seed: int) -> Family:
    """Traces of either sign; those flagged score nothing."""
    two = np.zeros(projected.length.size, bool)
    scores = score_test.scores(projected, two)
    scores[list(flagged)] = 0.0
    return _family(scores, _maxima(projected, two, errors, seed))


def refit_start(seen: Screening, candidate: int, changed: Case) -> Array:
    """Where in z (p + 1,) to begin the refit with a candidate: the joint linear step of all parameters."""
    column, one = seen.best_column(candidate), seen.traces.candidates[candidate]
    gain = float(seen.scores[column] / max(seen.projected.length[column], 1e-300))
    point, slope, noise = seen.base.fitted.point, seen.slopes, seen.noise
    left = noise.whiten(noise.residual(point.prediction)) - seen.white[:, column] * gain
    matrix = slope.T @ slope + np.eye(point.z.size)
    step = np.linalg.solve(matrix, slope.T @ left - point.z)
    step *= min(1.0, 1.0 / float(np.abs(step).max() + 1e-300))
    return np.append(point.z + step, z_of(changed.parameters[one.parameter], start_of(one.effect, gain)))


def _family(scores: Array, maxima: Array) -> Family:
    """Such that the tail fits the bootstrap at 95 %."""
    if scores.size == 0:
        return Family(np.zeros(1), 1.0)
    return Family(scores, float(-np.log(0.95) / scipy.stats.chi2.sf(np.quantile(maxima, 0.95), 1)))
