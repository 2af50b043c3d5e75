"""Score tests of a calibrated model: which effect, spot of drag or single station its residual points at."""

from dataclasses import dataclass, replace

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, search_model
from vegglue.calibration.noise import Noise, drawn_errors, estimated
from vegglue.case.parameter_space import z_of
from vegglue.case.schema import Case
from vegglue.engine.interface import Point
from vegglue.screening import score_test
from vegglue.screening.candidates import start_of
from vegglue.screening.family_wise_p import Family, family_of
from vegglue.screening.fingerprints import Fingerprints, fingerprints_of

# Size [1/m] of unlisted drag that is set aside when the noise is estimated: twenty times the friction of a bed of
# n = 0.04 under 1 m of water. Chosen, not measured; from 0.1 to 1 the verdicts on open-a to open-f are the same.
PLAUSIBLE_SPOT = 0.3
# Size, in standard errors, of what is most suspect when the noise is estimated for good: without bound, else
# what is missing passes for correlated errors (a floor 2 cm too high did, and went from 7.2 to 4.2 standard errors).
# From 100 on verdicts are the same; with 1e6 the covariance can no longer be factored.
FREE = 1e4


@dataclass(frozen=True)
class Screening:
    """What the residual of a baseline says of all that could be missing.

    base: with the errors as estimated here; flagged: stations rejected as outliers, places among the used ones.
    slopes (n, p), prints (n, c): of parameters and candidates, whitened; projected: the candidates' once calibration
    is projected out. effects, spots, stations: score tests of candidates, of spots of drag, of single stations.
    """

    base: Baseline
    flagged: tuple[int, ...]
    fingerprints: Fingerprints
    slopes: Array
    prints: Array
    projected: score_test.Projected
    effects: Family
    spots: Family
    stations: Family

    def best_column(self, candidate: int) -> int:
        """The fingerprint of a candidate that scores highest, of the settings of its shapes."""
        columns = self.fingerprints.columns[candidate]
        return int(columns[np.argmax(self.effects.scores[columns] ** 2)])

    def best_score(self, candidate: int) -> float:
        return float(self.effects.scores[self.best_column(candidate)])

    @property
    def ranking(self) -> list[int]:
        """Candidates, the best score first."""
        squares = [self.best_score(j) ** 2 for j in range(len(self.fingerprints.candidates))]
        return [int(j) for j in np.argsort(-np.array(squares))]

    def possible_signs(self, length: float, most: float) -> np.ndarray:
        """Whether fingerprints may be `length` standard errors long, with either sign, (2, c); see `Amplitude.may_be`.

        most: how large an amplitude may be, in plausible ones.
        """
        return self.fingerprints.may_be(length / np.maximum(self.projected.length, 1e-300), most)


def screen(base: Baseline, flagged: tuple[int, ...] = (), before: Screening | None = None, seed: int = 1) -> Screening:
    """Score tests of all candidates, of spots of drag everywhere and of single stations, against the residual.

    The correlation of the errors is estimated first, with all that could be missing set aside. before: an earlier
    screening, whose fingerprints are taken if they are those of the same point.
    """
    point = search_model(base).point
    fingerprints = _earlier(before, point) or fingerprints_of(base)
    changes = point.slope, fingerprints.prints, fingerprints.spots.traces
    slope, prints, spots = (base.noise.used(values) for values in changes)
    left, z = base.noise.residual(base.fitted.point.prediction), base.fitted.point.z
    noise = _estimated_noise(base.noise, fingerprints, (slope, prints, spots), left, z)
    errors = drawn_errors(noise, score_test.NULL_DRAWS, np.random.default_rng((seed, 1)))

    def against(values: Array) -> score_test.Projected:
        return score_test.project(noise.whiten(slope), noise.whiten(left), z, noise.whiten(values))

    def of_either_sign(values: Array) -> Family:
        return family_of(against(values), np.zeros(values.shape[1], bool), errors, seed)

    projected = against(prints)
    return Screening(
        base=replace(base, noise=noise),
        flagged=flagged,
        fingerprints=fingerprints,
        slopes=noise.whiten(slope),
        prints=noise.whiten(prints),
        projected=projected,
        effects=family_of(projected, fingerprints.one_sided, errors, seed),
        spots=of_either_sign(spots),
        stations=of_either_sign(np.eye(left.size)).without(flagged),
    )


def _earlier(before: Screening | None, point: Point) -> Fingerprints | None:
    """Fingerprints of an earlier screening, if they are those of this point."""
    return before.fingerprints if before is not None and before.fingerprints.point is point else None


def _estimated_noise(
    noise: Noise, fingerprints: Fingerprints, used: tuple[Array, Array, Array], left: Array, z: Array
) -> Noise:
    """The noise of a residual `left` with all that could be missing set aside, slopes, prints and spots (n, ...).

    Estimated twice: for good with the one fingerprint that the residual points at set aside whatever its size.
    """
    slope, prints, spots = used
    sizes = np.array([amplitude.plausible for amplitude in fingerprints.amplitudes])
    explained = np.hstack([slope, prints * sizes, spots * PLAUSIBLE_SPOT])
    first = estimated(noise, left, explained)
    projected = score_test.project(first.whiten(slope), first.whiten(left), z, first.whiten(explained))
    best = int(np.argmax((projected.units.T @ projected.residual) ** 2))
    free = explained[:, best : best + 1] * (FREE / max(float(projected.length[best]), 1e-300))
    return estimated(first, left, np.hstack([explained, free]))


def refit_start(screening: Screening, candidate: int, changed: Case) -> Array:
    """Where in z (p + 1,) to begin the refit with a candidate: the joint linear step of all parameters."""
    column, one = screening.best_column(candidate), screening.fingerprints.candidates[candidate]
    gain = float(screening.effects.scores[column] / max(screening.projected.length[column], 1e-300))
    point, slope, noise = screening.base.fitted.point, screening.slopes, screening.base.noise
    left = noise.whiten(noise.residual(point.prediction)) - screening.prints[:, column] * gain
    matrix = slope.T @ slope + np.eye(point.z.size)
    step = np.linalg.solve(matrix, slope.T @ left - point.z)
    step *= min(1.0, 1.0 / float(np.abs(step).max() + 1e-300))
    return np.append(point.z + step, z_of(changed.parameters[one.parameter], start_of(one.effect, gain)))
