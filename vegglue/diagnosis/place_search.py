"""Where exactly something at a place lies: between the spots of the screening, in the flow that it leaves.

    ln B(x, y) = ln B_refit + b(x, y) - b(x_refit, y_refit)

b is ln B to first order of the same thing at another place, in the flow with it (see `evidence`): there its own wake is
seen at its true size. The best of such places is refitted, until none promises more. Of the evidence, the spots of the
screening near by are replaced by the mean over these places, which stand closer.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.baseline import SearchModel
from vegglue.calibration.candidates import place_candidate, with_effect
from vegglue.calibration.fingerprints import Places, places_around
from vegglue.calibration.score_test import HypothesisKind, expected_gain, log_factors
from vegglue.diagnosis.refits import Refit, RefitTrial, refits_of, start_with
from vegglue.diagnosis.tempered_probabilities import tempered_probabilities

# Distance of the places that are looked at around a refitted one, over that of the spots of the screening [-]. Chosen,
# not measured.
SHARE_OF_SPACING = 0.5
# How often it is moved at most, and by how much ln B has to rise. Chosen, not measured: most are moved once or twice,
# each time by two half lengths at most.
MOST_MOVES, LEAST_RISE = 10, 0.3


@dataclass(frozen=True)
class Window:
    """Places (spot,) around a refitted one: x, y [m], ln B of each, and its size there [unit of the effect]."""

    x: Array
    y: Array
    log_factor: Array
    gain: Array


@dataclass(frozen=True)
class FoundPlace:
    """A refit where it explains most; log_evidence: of its term over all places; errors: root mean square distance in x
    and y of where it may lie [m], by chances that allow for traces that are not nature's; spread: the same by the
    evidence as it is.
    """

    refit: Refit
    log_evidence: float
    errors: tuple[float, float]
    spread: tuple[float, float]


def found_place(search: SearchModel, places: Places, kind: HypothesisKind, spot: int, refit: Refit) -> FoundPlace:
    """Something refitted at a spot, moved to where it explains most."""
    moved, window = _moved(search, places, refit, MOST_MOVES)
    near = _is_near(places, spot, window)
    # Elsewhere first-order evidence promises as much too much as at the spot that was refitted.
    kept = refit.log_factor - float(log_factors(kind.scores, kind.size)[spot])
    weight = np.concatenate([
        kind.log_evidence[~near] + kept,
        window.log_factor + kind.log_prior[spot] + 2.0 * np.log(SHARE_OF_SPACING),
    ])  # fmt: skip
    away = np.stack([
        np.concatenate([places.x[~near], window.x]) - moved.shapes["x"],
        np.concatenate([places.y[~near], window.y]) - moved.shapes["y"],
    ])  # fmt: skip
    total = float(logsumexp(weight))
    errors, spread = (
        _root_mean_square(away, chance) for chance in (tempered_probabilities(weight), np.exp(weight - total))
    )
    return FoundPlace(moved, total, errors, spread)


def _root_mean_square(away: Array, chance: Array) -> tuple[float, float]:
    """Of distances in x and y (2, spot), each with its chance (spot,)."""
    along, across = np.sqrt(away**2 @ chance)
    return float(along), float(across)


def _moved(search: SearchModel, places: Places, refit: Refit, moves: int) -> tuple[Refit, Window]:
    """The refit at the best place that it leads to, and the window around that."""
    window = _window(search, places, refit)
    best = int(np.argmax(window.log_factor))
    if moves == 0 or window.log_factor[best] < refit.log_factor + LEAST_RISE:
        return refit, window
    shapes = {**refit.shapes, "x": round(float(window.x[best]), 2), "y": round(float(window.y[best]), 2)}
    candidate = place_candidate(refit.candidate.effect, shapes, places.plausible)
    if candidate.key in search.model.case.effects:  # it would take the place of what acts there
        return refit, window
    start = start_with(search.model.case, candidate, shapes, refit.fitted.point.z[:-1], float(window.gain[best]))
    (there,) = refits_of(search, [RefitTrial(candidate, shapes, (start,))])
    if there is None or there.log_factor < refit.log_factor + LEAST_RISE:
        return refit, window
    return _moved(search, places, there, moves - 1)


def _window(search: SearchModel, places: Places, refit: Refit) -> Window:
    """Places around a refit, to first order in the flow with it."""
    point, noise, place = refit.fitted.point, search.noise, refit.shapes
    model = replace(search.model, case=with_effect(search.model.case, refit.candidate, place))
    around = places_around(model, point, places.term, place, SHARE_OF_SPACING)
    traces = noise.whiten(noise.used(around.fingerprints))
    own = int(np.argmin(np.hypot(around.x - place["x"], around.y - place["y"])))
    # What it does where it is is taken away, and put elsewhere.
    residual = noise.whiten(noise.residual(point.prediction)) + traces[:, own] * refit.amplitude
    slope = noise.whiten(noise.used(point.slope[:, :-1]))
    projected = score_test.project(slope, residual, point.z[:-1], traces)
    size = projected.length * places.plausible
    score = score_test.scores(projected, np.zeros(size.size, dtype=bool))
    gain = expected_gain(score, projected.length, size)
    first_order = log_factors(score, size)
    return Window(around.x, around.y, first_order - first_order[own] + refit.log_factor, gain)


def _is_near(places: Places, spot: int, window: Window) -> np.ndarray:
    """Which spots of the size of that one the window has seen again (spot,)."""
    alike = places.length == places.length[spot]
    half = SHARE_OF_SPACING * np.array([places.length[spot], places.width[spot]])
    within = (places.x >= window.x.min() - half[0]) & (places.x <= window.x.max() + half[0])
    within &= (places.y >= window.y.min() - half[1]) & (places.y <= window.y.max() + half[1])
    return np.asarray(alike & within)
