"""Score tests of a calibrated model: which effect, place or instrument explains its residual best; and the same given
one parameter that is back in the middle of its prior.

    z' = z - z_j V_j / V_jj,   V = (J' W' W J + 1)^-1

If a parameter j has taken over what an effect should explain, such as a canopy that is calibrated too low in place of
plants that bend, the score at the best place z is small, and only another place shows how far down the effect leads.
z' is the best place of the other parameters with z_j = 0, to first order (the mean of a normal distribution given one
of its components); V_j is column j of V. There the least objective with each effect is predicted from slopes and
fingerprints, as at the best place.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.baseline import Baseline, SearchModel, search_model, searched_by_itself
from vegglue.calibration.candidates import (
    Instrument,
    InstrumentKind,
    instruments_of,
    median_errors,
    offset_columns,
    plausible_offset,
    start_with,
)
from vegglue.calibration.detection import detected_length
from vegglue.calibration.fingerprints import Fingerprints, fingerprints_of
from vegglue.calibration.fit import at_point, objective
from vegglue.calibration.model_error import Unlisted
from vegglue.calibration.noise import Noise, draw_whitened_errors, estimate_noise
from vegglue.calibration.score_test import (
    Family,
    HypothesisKind,
    expected_gain,
    family_of,
    kind_of_hypotheses,
    log_factors,
    with_evidence,
)
from vegglue.case.case_effects import parameters_of_effects
from vegglue.case.channel_geometry import half_width
from vegglue.decision_constants import constants
from vegglue.engine.interface import Point, linearise, responses
from vegglue.parallel import in_threads

# Size [standard errors] given to the fingerprint with the best score when the noise is estimated again. So large that
# its amplitude is free, else a missing effect passes for correlated errors (a floor 2 cm too high did, and its score
# fell from 7.2 to 4.2). From 100 on verdicts are the same; with 1e6 the covariance can no longer be factored.
FREE_SIZE = 1e4
# Longest that it is made, before what calibration can mimic is taken off [standard errors]: at the largest of the sizes
# that are tried, ten, its square is 1e15, the last that is factored beside errors of 1.
LONGEST_FREE = 3e6
# Groups of kinds that are as likely before the data [-]: listed effects, places, instruments, fields (`field_scan`).
GROUPS = 4
# Standard deviations of its prior from which a parameter is off, and conditional screenings at most, of those furthest
# off: each costs 1.5 s of a core on 9,600 cells. Half a standard deviation was taken back after site 7049 of
# `drawn_sites`, where a canopy too low by 0.46 of them hid streamlining.
OFF, MOST_CONDITIONAL = 0.25, 2


@dataclass(frozen=True)
class Screening:
    """Score tests of the residual of a calibrated model against all that could be missing, or wrong with the data.

    Attributes
    ----------
    base : Baseline
        The model, with the noise as estimated here, at the place of its fit.
    search : SearchModel
        Its model that is fitted again and again.
    flagged : tuple of int
        Readings of instruments found to be off, indices among the used ones.
    fingerprints : Fingerprints
        S of candidates.
    whitened_slopes : ndarray (n, p)
        W df/dz [-].
    whitened_fingerprints : ndarray (n, c)
        W S [1 per unit of gain].
    projected : Projected
        W S with W df/dz projected out.
    effects : Family
        Score tests of candidates.
    kinds : tuple of HypothesisKind
        Evidence of listed effects, of places by term, and of `instruments`, in this order.
    errors : ndarray (draws, n)
        Whitened errors alone [-].
    """

    base: Baseline
    search: SearchModel
    flagged: tuple[int, ...]
    fingerprints: Fingerprints
    whitened_slopes: Array
    whitened_fingerprints: Array
    projected: score_test.Projected
    effects: Family
    kinds: tuple[HypothesisKind, ...]
    instruments: dict[str, tuple[Instrument, ...]]
    errors: Array

    def best_column(self, candidate: int) -> int:
        """Column of the fingerprint of a candidate with the largest |T|, among the settings of its shapes."""
        columns = self.fingerprints.columns[candidate]
        return int(columns[np.argmax(self.effects.scores[columns] ** 2)])

    def best_score(self, candidate: int) -> float:
        """T of that column [standard errors]."""
        return float(self.effects.scores[self.best_column(candidate)])

    def smallest_shown(self, column: int) -> float:
        """|amplitude - off| [its unit] of a fingerprint that is detected with detected_chance."""
        of = constants()
        needed = float(detected_length(np.array(self.effects.threshold(of.effect_alarm_rate)), of.detected_chance))
        gain = needed / max(float(self.projected.length[column]), 1e-300)
        return self.fingerprints.amplitudes[column].size(gain)

    def testable(self, column: int) -> bool:
        """Whether that is less than testable_sizes plausible ones, and within the support of the amplitude."""
        amplitude = self.fingerprints.amplitudes[column]
        return self.smallest_shown(column) < min(constants().testable_sizes * amplitude.scale, amplitude.furthest)

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


def screen(
    base: Baseline, flagged: tuple[int, ...] = (), known: Fingerprints | None = None, seed: int = 1
) -> Screening:
    """Score tests of the residual against all candidates, places everywhere and instruments.

    The correlation of the errors is estimated first.

    Parameters
    ----------
    base : Baseline
        The calibrated model.
    flagged : tuple of int
        Readings that are excluded, indices of used stations.
    known : Fingerprints, optional
        At the point of the search model, if they are at hand.
    seed : int
        Of the draws of errors alone.

    Returns
    -------
    Screening
        Under the noise as estimated.
    """
    base = searched_by_itself(base)
    search = search_model(base)
    point = search.point
    fingerprints = known or fingerprints_of(search, half_width(base.model.site))
    slope, of_effects = (base.noise.used(values) for values in (point.slope, fingerprints.values))
    residual, z = base.noise.residual(base.fitted.point.prediction), base.fitted.point.z
    instruments = instruments_of(base.model.station.iloc[base.noise.rows])
    noise = _estimated_noise(base.noise, (slope, _plausible(base.noise, fingerprints, instruments)), residual, z)
    errors = draw_whitened_errors(noise, score_test.NULL_DRAWS, np.random.default_rng((seed, 1)))

    def against(values: Array) -> score_test.Projected:
        return score_test.project(noise.whiten(slope), noise.whiten(residual), z, noise.whiten(values))

    # Under the errors as estimated parameters are known no better than under those of the fit.
    here = at_point(noise, base.fitted.point)
    wider = max(base.fitted, here, key=lambda one: float(np.linalg.slogdet(one.covariance)[1]))
    projected = against(of_effects)
    with_noise = replace(base, noise=noise, fitted=replace(here, covariance=wider.covariance))
    in_places = {one.term: against(base.noise.used(one.fingerprints)) for one in fingerprints.places}
    of_instruments = {name: against(offset_columns(some, residual.size)) for name, some in instruments.items() if some}
    if (lines := fingerprints.lines) is not None and lines.lines:
        instruments["line"] = tuple(Instrument("line", (), one.x, one.y, one) for one in lines.lines)
        of_instruments["line"] = with_evidence(against(base.noise.used(fingerprints.of_lines)), *lines.evidence)
    return Screening(
        base=with_noise,
        search=search_model(with_noise),
        flagged=flagged,
        fingerprints=fingerprints,
        whitened_slopes=noise.whiten(slope),
        whitened_fingerprints=noise.whiten(of_effects),
        projected=projected,
        effects=family_of(projected, fingerprints.only_sign, errors, seed),
        kinds=(
            kind_of_listed(fingerprints, projected),
            *kinds_of_places(fingerprints, in_places),
            *kinds_of_instruments(base.noise, instruments, of_instruments, flagged),
        ),
        instruments={str(name): some for name, some in instruments.items()},
        errors=errors,
    )


def noise_given_all(base: Baseline) -> Noise:
    """The noise that `screen` estimates, if nothing else of a screening is needed."""
    search = search_model(base)
    fingerprints = fingerprints_of(search, half_width(base.model.site))
    instruments = instruments_of(base.model.station.iloc[base.noise.rows])
    used = base.noise.used(search.point.slope), _plausible(base.noise, fingerprints, instruments)
    point = base.fitted.point
    return _estimated_noise(base.noise, used, base.noise.residual(point.prediction), point.z)


def kind_of_listed(fingerprints: Fingerprints, projected: score_test.Projected) -> HypothesisKind:
    """prior = w / (GROUPS sum w n): effects as likely before, but for common omissions, and so the n settings of one.

    Parameters
    ----------
    projected : Projected
        Theirs (c columns).
    """
    plausible = np.array([amplitude.plausible_gain for amplitude in fingerprints.amplitudes])
    prior = np.empty(plausible.size)
    weights = [constants().common_omission if "common" in one.effect.tags else 1.0 for one in fingerprints.candidates]
    for weight, columns in zip(weights, fingerprints.columns, strict=True):
        prior[columns] = weight / (GROUPS * sum(weights) * columns.size)
    return kind_of_hypotheses("effect", projected, plausible, prior, fingerprints.only_sign)


def kinds_of_places(
    fingerprints: Fingerprints, in_places: Mapping[Unlisted, score_test.Projected]
) -> list[HypothesisKind]:
    """prior = 1 / (GROUPS m n): a kind for each of m terms, all of its n spots as likely before.

    Parameters
    ----------
    in_places : mapping of Projected
        Of the spots of each term.
    """
    kinds = []
    for one in fingerprints.places:
        spots = np.ones(one.x.size)
        prior = spots / (GROUPS * len(fingerprints.places) * spots.size)
        kinds.append(kind_of_hypotheses(one.term, in_places[one.term], one.plausible * spots, prior, one.only_sign))
    return kinds


def kinds_of_instruments(
    noise: Noise,
    instruments: Mapping[InstrumentKind, tuple[Instrument, ...]],
    projected: Mapping[InstrumentKind, score_test.Projected],
    flagged: tuple[int, ...],
) -> list[HypothesisKind]:
    """prior = 1 / (GROUPS m n): a kind for each of m kinds of instruments, all of its n instruments as likely before.

    Parameters
    ----------
    instruments : mapping of tuple of Instrument
        By kind.
    projected : mapping of Projected
        Of the offsets of each kind that has any.
    flagged : tuple of int
        Excluded readings, indices of used stations: an instrument of these alone is known to be off, and of size 0.
    """
    kinds = []
    for name, of_kind in projected.items():
        plausible = plausible_offset(name) * median_errors(instruments[name], noise.error)
        known = np.array([i.line is None and set(i.readings) <= set(flagged) for i in instruments[name]])
        prior = np.full(plausible.size, 1.0 / (GROUPS * len(projected) * plausible.size))
        kinds.append(kind_of_hypotheses(name, of_kind, np.where(known, 0.0, plausible), prior))
    return kinds


def _plausible(
    noise: Noise, fingerprints: Fingerprints, instruments: Mapping[InstrumentKind, tuple[Instrument, ...]]
) -> Array:
    """Changes of predictions at used stations by all that could be missing or off, each of plausible size (n, c);
    spots of spots_in_noise of theirs. Spots of drag side by side are a barrier: a hundred of these besides would leave
    next to no misfit for errors.
    """
    sizes = np.array([amplitude.plausible_gain for amplitude in fingerprints.amplitudes])
    parts = [noise.used(fingerprints.values) * sizes]
    of_spots = constants().spots_in_noise
    spots = [one for one in fingerprints.places if one.term != "barrier"]
    parts += [noise.used(one.fingerprints) * (of_spots * one.plausible) for one in spots]
    for name in ("position", "probe", "gauge"):
        some = instruments[name]
        sizes = plausible_offset(name) * median_errors(some, noise.error)
        parts.append(offset_columns(some, noise.rows.size) * sizes)
    if fingerprints.lines is not None:
        parts.append(plausible_offset("line") * noise.used(fingerprints.of_lines))
    return np.hstack(parts)


def _estimated_noise(noise: Noise, used: tuple[Array, Array], residual: Array, z: Array) -> Noise:
    """The noise of a residual (n,); used: slopes, and changes by all that could be missing (n, ...), at used stations.

    Estimated twice: the second time the amplitude of the change with the best score is free. If nothing is missing
    that is the slope of the parameter furthest off its prior, of which calibration leaves next to nothing.
    """
    slope, changes = used
    systematic = np.hstack([slope, changes])
    gram = systematic @ systematic.T
    first = estimate_noise(noise, residual, gram)
    projected = score_test.project(first.whiten(slope), first.whiten(residual), z, first.whiten(systematic))
    best = int(np.argmax(projected.score**2))
    column = systematic[:, best]
    whole = float(np.linalg.norm(first.whiten(column)))
    free = min(FREE_SIZE / max(float(projected.length[best]), 1e-300), LONGEST_FREE / max(whole, 1e-300))
    return estimate_noise(first, residual, gram + np.outer(free * column, free * column))


def refit_start(screening: Screening, candidate: int, column: int) -> Array:
    """z + (J' J + 1)^-1 (J' (r - S g) - z), the step 1 at most, and the candidate's own: where its refit starts.

    Parameters
    ----------
    candidate, column : int
        Of the fingerprints; g is the gain by the score of the column.

    Returns
    -------
    ndarray (p + q,)
        See `start_with`.
    """
    one = screening.fingerprints.candidates[candidate]
    gain = float(screening.effects.scores[column] / max(screening.projected.length[column], 1e-300))
    point, slope, noise = screening.base.fitted.point, screening.whitened_slopes, screening.base.noise
    remaining = noise.whiten(noise.residual(point.prediction)) - screening.whitened_fingerprints[:, column] * gain
    matrix = slope.T @ slope + np.eye(point.z.size)
    step = np.linalg.solve(matrix, slope.T @ remaining - point.z)
    step *= min(1.0, 1.0 / float(np.abs(step).max() + 1e-300))
    return start_with(one, point.z + step, gain)


@dataclass(frozen=True)
class ConditionalScreening:
    """What candidates would bring if one parameter were back in the middle of its prior.

    Attributes
    ----------
    point : Point
        With that parameter there.
    log_factor : ndarray (c,)
        ln B of each column of the fingerprints, as predicted from there [-].
    gain : ndarray (c,)
        Size there [unit of the gain].
    """

    point: Point
    log_factor: Array
    gain: Array


def conditional_screenings(screening: Screening) -> tuple[ConditionalScreening, ...]:
    """ln B of each effect from the places z' where one parameter that is off is back in the middle of its prior.

    Returns
    -------
    tuple of ConditionalScreening
        One for each such place where a steady flow is found.
    """
    search, fingerprints = screening.search, screening.fingerprints
    model, noise = search.model, search.noise

    def screened_at(place: Array) -> ConditionalScreening | None:
        point = linearise(model, place, search.point)
        if point is None:
            return None
        found = responses(model, point, fingerprints.causes)
        slope, residual = noise.whiten(noise.used(point.slope)), noise.whiten(noise.residual(point.prediction))
        projected = score_test.project(slope, residual, point.z, noise.whiten(noise.used(found)))
        score = score_test.scores(projected, fingerprints.only_sign)
        size = projected.length * np.array([amplitude.plausible_gain for amplitude in fingerprints.amplitudes])
        nothing = float(projected.residual @ projected.residual)
        log_factor = 0.5 * (objective(noise, search.point) - nothing) + log_factors(score, size)
        return ConditionalScreening(point, log_factor, expected_gain(score, projected.length, size))

    tasks = [(place,) for place in conditional_places(search)]
    return tuple(one for one in in_threads(screened_at, tasks) if one is not None)


def conditional_places(search: SearchModel) -> list[Array]:
    """z' = z - z_j V_j / V_jj: where a parameter that is off is back in the middle of its prior, and others follow it.

    V is the covariance of z. Amplitudes of effects do not count, see `with_rivals_again`.

    Returns
    -------
    list of ndarray (p,)
        Of MOST_CONDITIONAL parameters at most with |z_j| > OFF, furthest first.
    """
    noise, z = search.noise, search.point.z
    of_effects = parameters_of_effects(search.model.case)
    own = [j for j, name in enumerate(search.model.names) if name not in of_effects]
    off = sorted((j for j in own if abs(z[j]) > OFF), key=lambda j: -abs(z[j]))
    white = noise.whiten(noise.used(search.point.slope))
    covariance = np.linalg.inv(white.T @ white + np.eye(z.size))
    return [z - z[j] * covariance[:, j] / covariance[j, j] for j in off[:MOST_CONDITIONAL]]
