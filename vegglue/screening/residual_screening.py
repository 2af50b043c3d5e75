"""Score tests of a calibrated model: which effect, drag spot or single station explains its residual best."""

from dataclasses import dataclass, replace

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, SearchModel, search_model
from vegglue.calibration.noise import Noise, draw_whitened_errors, estimate_noise
from vegglue.case.parameter_space import z_of
from vegglue.case.schema import Case
from vegglue.engine.interface import Point
from vegglue.screening import score_test
from vegglue.screening.candidates import start_amplitude
from vegglue.screening.family_wise_p import Family, family_of
from vegglue.screening.fingerprints import Fingerprints, fingerprints_of
from vegglue.site.channel_geometry import half_width

# Drag [1/m] of a spot that counts as plausible when the noise is estimated: twenty times the friction of a bed of
# n = 0.04 under 1 m of water. Chosen, not measured; from 0.1 to 1 the verdicts on open-a to open-f are the same.
SPOT_DRAG = 0.3
# Size [standard errors] given to the fingerprint with the best score when the noise is estimated again. So large that
# its amplitude is free, else a missing effect passes for correlated errors (a floor 2 cm too high did, and its score
# fell from 7.2 to 4.2). From 100 on verdicts are the same; with 1e6 the covariance can no longer be factored.
FREE_SIZE = 1e4


@dataclass(frozen=True)
class Screening:
    """Score tests of the residual of a calibrated model against all effects that could be missing.

    base: with the noise as estimated here; search: its model that is fitted again and again; flagged: stations rejected
    as outliers, indices among the used ones.
    whitened_slopes (n, p): W df/dz; whitened_fingerprints (n, c): of candidates; projected: these with the slopes
    projected out. effects, spots, stations: score tests of candidates, of drag spots and of single stations.
    """

    base: Baseline
    search: SearchModel
    flagged: tuple[int, ...]
    fingerprints: Fingerprints
    whitened_slopes: Array
    whitened_fingerprints: Array
    projected: score_test.Projected
    effects: Family
    spots: Family
    stations: Family

    def best_column(self, candidate: int) -> int:
        """Column of the fingerprint of a candidate with the largest |T|, among the settings of its shapes."""
        columns = self.fingerprints.columns[candidate]
        return int(columns[np.argmax(self.effects.scores[columns] ** 2)])

    def best_score(self, candidate: int) -> float:
        """T of that column [standard errors]."""
        return float(self.effects.scores[self.best_column(candidate)])

    @property
    def ranking(self) -> list[int]:
        """Indices of the candidates, the largest |T| first."""
        squares = [self.best_score(j) ** 2 for j in range(len(self.fingerprints.candidates))]
        return [int(j) for j in np.argsort(-np.array(squares))]

    def possible_signs(self, length: float, most: float) -> np.ndarray:
        """Whether the amplitude of a fingerprint `length` [standard errors] long is allowed, for + and -, (2, c).

        most: the largest amplitude allowed, over the plausible one; see `Amplitude.allows`.
        """
        return self.fingerprints.allowed(length / np.maximum(self.projected.length, 1e-300), most)


def screen(base: Baseline, flagged: tuple[int, ...] = (), before: Screening | None = None, seed: int = 1) -> Screening:
    """Score tests of the residual against all candidates, drag spots everywhere and single stations.

    The correlation of the errors is estimated first. before: an earlier screening, whose fingerprints are used again if
    they belong to the same point; seed: of the draws of errors alone.
    """
    search = search_model(base)
    point = search.point
    fingerprints = _earlier(before, point) or fingerprints_of(search, half_width(base.model.site))
    changes = point.slope, fingerprints.values, fingerprints.spots.fingerprints
    slope, of_effects, spots = (base.noise.used(values) for values in changes)
    residual, z = base.noise.residual(base.fitted.point.prediction), base.fitted.point.z
    noise = _estimated_noise(base.noise, fingerprints, (slope, of_effects, spots), residual, z)
    errors = draw_whitened_errors(noise, score_test.NULL_DRAWS, np.random.default_rng((seed, 1)))

    def against(values: Array) -> score_test.Projected:
        return score_test.project(noise.whiten(slope), noise.whiten(residual), z, noise.whiten(values))

    def of_either_sign(values: Array) -> Family:
        return family_of(against(values), np.zeros(values.shape[1], bool), errors, seed)

    projected, with_noise = against(of_effects), replace(base, noise=noise)
    return Screening(
        base=with_noise,
        search=search_model(with_noise),
        flagged=flagged,
        fingerprints=fingerprints,
        whitened_slopes=noise.whiten(slope),
        whitened_fingerprints=noise.whiten(of_effects),
        projected=projected,
        effects=family_of(projected, fingerprints.one_sided, errors, seed),
        spots=of_either_sign(spots),
        stations=of_either_sign(np.eye(residual.size)).without(flagged),
    )


def _earlier(before: Screening | None, point: Point) -> Fingerprints | None:
    """Fingerprints of an earlier screening, if they are those of this point."""
    return before.fingerprints if before is not None and before.fingerprints.point is point else None


def _estimated_noise(
    noise: Noise, fingerprints: Fingerprints, used: tuple[Array, Array, Array], residual: Array, z: Array
) -> Noise:
    """The noise of a residual (n,); used: slopes and fingerprints of effects and spots (n, ...), at used stations.

    Estimated twice: the second time the amplitude of the fingerprint with the best score is free.
    """
    slope, of_effects, spots = used
    sizes = np.array([amplitude.plausible_gain for amplitude in fingerprints.amplitudes])
    systematic = np.hstack([slope, of_effects * sizes, spots * SPOT_DRAG])
    first = estimate_noise(noise, residual, systematic)
    projected = score_test.project(first.whiten(slope), first.whiten(residual), z, first.whiten(systematic))
    best = int(np.argmax((projected.units.T @ projected.residual) ** 2))
    free = systematic[:, best : best + 1] * (FREE_SIZE / max(float(projected.length[best]), 1e-300))
    return estimate_noise(first, residual, np.hstack([systematic, free]))


def refit_start(screening: Screening, candidate: int, changed: Case) -> Array:
    """z (p + 1,) to start the refit with a candidate from: the joint linear step of all parameters."""
    column, one = screening.best_column(candidate), screening.fingerprints.candidates[candidate]
    gain = float(screening.effects.scores[column] / max(screening.projected.length[column], 1e-300))
    point, slope, noise = screening.base.fitted.point, screening.whitened_slopes, screening.base.noise
    remaining = noise.whiten(noise.residual(point.prediction)) - screening.whitened_fingerprints[:, column] * gain
    matrix = slope.T @ slope + np.eye(point.z.size)
    step = np.linalg.solve(matrix, slope.T @ remaining - point.z)
    step *= min(1.0, 1.0 / float(np.abs(step).max() + 1e-300))
    return np.append(point.z + step, z_of(changed.parameters[one.parameter], start_amplitude(one.effect, gain)))
