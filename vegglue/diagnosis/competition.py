"""One competition of everything that could explain a misfit: listed effects, places and instruments.

    E_j = ln B_j + ln prior_j

Of each kind the most promising hypotheses are calibrated in earnest, and their evidence E is Laplace's (`refits`); of
those of its kind that were not, it is the one to first order, corrected as that of the best of them. Instruments change
no flow: to first order is exact for them but for the parameters. What is how likely before says `evidence`, and
their chances are tempered, see `tempered_probabilities`.

Smooth fields of a term (`field_scan`) are so free that they explain much of whatever is missing. They do not compete
with a single cause, but with all that was accepted in the end.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import SearchModel
from vegglue.calibration.candidates import Instrument, place_candidate
from vegglue.calibration.fingerprints import EFFECT_AT_PLACE, Places
from vegglue.calibration.residual_screening import ConditionalScreening, Screening, conditional_screenings, refit_start
from vegglue.calibration.score_test import HypothesisKind, kind_named
from vegglue.diagnosis.place_search import found_place
from vegglue.diagnosis.refits import Refit, RefitTrial, refits_of, start_with
from vegglue.diagnosis.tempered_probabilities import tempered_probabilities, tempering
from vegglue.effects.library import library
from vegglue.progress import Progress, Watch

# Listed effects that are refitted in one round at most, and how far below the best one's evidence a hypothesis may lie
# to be refitted, after w: e^-6 is one in 400. Chosen, not measured: more cost runs of the model.
MOST_REFITTED, REACH = 8, 6.0
# Shares of the size that its score promises from which something at a place is refitted: at all of it a flow may not be
# found. Chosen, not measured.
START_SHARES = (1.0, 0.3)


@dataclass(frozen=True)
class Hypothesis:
    """A hypothesis with its evidence E [-]. kind: effect, a term at a place, or an instrument's kind; column: of its
    fingerprint among those of its kind; what: its refit, or the instrument; errors, spread: of x and y of a
    place [m], see `FoundPlace`.
    """

    kind: str
    name: str
    log_evidence: float
    column: int
    what: Refit | Instrument
    errors: tuple[float, float] = (0.0, 0.0)
    spread: tuple[float, float] = (0.0, 0.0)


def hypotheses_of(screening: Screening, watch: Watch, elsewhere: float = -np.inf) -> list[Hypothesis]:
    """Everything that was tried, most evidence first; elsewhere: ln evidence of what competes besides.

    To first order an effect may promise more than it keeps, or have no flow at all. Then what is within reach of the
    rest is refitted, too, until nothing is.
    """
    kind, looks = screening.kinds[0], conditional_screenings(screening)
    linear = _linear_evidence(kind, looks)
    best = max(*(kind.total for kind in screening.kinds), float(linear.max(initial=-np.inf)), elsewhere)
    found, tried = _instrument_hypotheses(screening), set[str]()
    while True:
        of_round = _round(screening, linear, best, tried)
        if not of_round.effects and not of_round.places:
            return sorted(found, key=lambda one: -one.log_evidence)
        watch(Progress(f"comparing {', '.join(of_round.names(screening))}"))
        found += _refitted(screening, of_round, (linear, looks), watch)
        tried |= set(of_round.names(screening))
        kept = [one.log_evidence for one in found]
        best = max(elsewhere, *kept, *_promises(screening, linear, tried))


@dataclass(frozen=True)
class _Round:
    """What is refitted together: effects by their indices, and terms at places with the spots to start from."""

    effects: list[int]
    places: list[tuple[Places, list[int]]]

    def names(self, screening: Screening) -> list[str]:
        candidates = screening.fingerprints.candidates
        return [candidates[j].name for j in self.effects] + [one.name for one, _ in self.places]


def _round(screening: Screening, linear: Array, best: float, tried: set[str]) -> _Round:
    """What is within reach of the best and was not tried."""
    candidates = screening.fingerprints.candidates
    effects = [j for j in _worth_refitting(screening, linear, best) if candidates[j].name not in tried]
    places = [
        (one, promising_spots(screening, one, best))
        for one in screening.fingerprints.places
        if one.name not in tried and _within_reach(kind_named(screening.kinds, one.term).total, best)
    ]
    return _Round(effects, places)


def _promises(screening: Screening, linear: Array, tried: set[str]) -> list[float]:
    """ln evidence to first order of what may be refitted and was not tried."""
    candidates = screening.fingerprints.candidates
    of_each = _of_each(screening, linear)
    effects = [float(of_each[j]) for j in _most_promising(of_each) if candidates[j].name not in tried]
    terms = [one.term for one in screening.fingerprints.places if one.name not in tried]
    return effects + [kind_named(screening.kinds, term).total for term in terms]


def _refitted(
    screening: Screening, of_round: _Round, promised: tuple[Array, Sequence[ConditionalScreening]], watch: Watch
) -> list[Hypothesis]:
    """Hypotheses of one round that found a flow; promised: evidence to first order, and conditional screenings."""
    linear = promised[0]
    effects, spots = of_round.effects, [(one, spot) for one, some in of_round.places for spot in some]
    trials = [_effect_trial(screening, j, *promised) for j in effects]
    trials += [_place_trial(screening, one, spot) for one, spot in spots]
    refits = refits_of(screening.search, trials, watch)
    found = []
    for j, refit in zip(effects, refits, strict=False):
        if refit is not None:
            column = _column_of(screening, j, linear)
            evidence = refit.log_factor + _settings_charge(screening, j, column)
            found.append(Hypothesis("effect", refit.candidate.name, evidence, column, refit))
    for one, _ in of_round.places:
        of_term = zip(spots, refits[len(effects) :], strict=True)
        ended = [(spot, refit) for (where, spot), refit in of_term if where is one and refit is not None]
        found += _place_hypothesis(screening.search, one, kind_named(screening.kinds, one.term), ended)
    return found


def _place_hypothesis(
    search: SearchModel, places: Places, kind: HypothesisKind, refits: Sequence[tuple[int, Refit]]
) -> list[Hypothesis]:
    """Something at the place where it explains most, see `place_search`; none if no flow was found at any spot."""
    if not refits:
        return []
    spot, best = max(refits, key=lambda one: one[1].log_factor)
    there = found_place(search, places, kind, spot, best)
    found = there.refit
    return [Hypothesis(kind.name, found.candidate.name, there.log_evidence, spot, found, there.errors, there.spread)]


def chances_of(hypotheses: Sequence[Hypothesis]) -> Array:
    """Chance of each to be what is missing, were it one of them (k,) [-], see the head of this file."""
    return tempered_probabilities(np.array([one.log_evidence for one in hypotheses]))


def _within_reach(evidence: float, best: float) -> bool:
    return bool((best - evidence) / tempering(np.array(best)) < REACH)


def _linear_evidence(kind: HypothesisKind, looks: Sequence[ConditionalScreening]) -> Array:
    """E of every column of the listed effects (c,), from the place that promises most."""
    promised = [kind.log_evidence, *(one.log_factor + kind.log_prior for one in looks)]
    return np.asarray(np.max(promised, axis=0))


def _worth_refitting(screening: Screening, linear: Array, best: float) -> list[int]:
    """Listed effects whose evidence is not far behind the best, the best first, one of them at least."""
    of_each = _of_each(screening, linear)
    ranked = _most_promising(of_each)
    return [j for j in ranked if _within_reach(float(of_each[j]), best)] or ranked[:1]


def _of_each(screening: Screening, linear: Array) -> Array:
    """E of the best column of each listed effect (candidate,)."""
    return np.array([linear[columns].max() for columns in screening.fingerprints.columns])


def _most_promising(of_each: Array) -> list[int]:
    return [int(j) for j in np.argsort(-of_each)[:MOST_REFITTED]]


def promising_spots(screening: Screening, places: Places, best: float) -> list[int]:
    """The best spot of each length, those within reach; none where something of the term acts already: an effect at
    the same place has its name, and would take its place in the case.
    """
    kind, case = kind_named(screening.kinds, places.term), screening.search.model.case
    effect = library(case.effect_file)[EFFECT_AT_PLACE[places.term]]
    acting = [place_candidate(effect, places.shapes(spot)).key in case.effects for spot in range(places.x.size)]
    evidence = np.where(acting, -np.inf, kind.log_evidence)
    of_length = [np.flatnonzero(places.length == length) for length in np.unique(places.length)]
    spots = [int(columns[np.argmax(evidence[columns])]) for columns in of_length]
    charge = kind.total - float(kind.log_evidence.max())
    return [spot for spot in spots if _within_reach(float(evidence[spot]) + charge, best)]


def _column_of(screening: Screening, candidate: int, linear: Array) -> int:
    columns = screening.fingerprints.columns[candidate]
    return int(columns[np.argmax(linear[columns])])


def _effect_trial(
    screening: Screening, candidate: int, linear: Array, looks: Sequence[ConditionalScreening]
) -> RefitTrial:
    """A listed effect at its best setting, from the best place, and from others that promise more there."""
    column, one = _column_of(screening, candidate, linear), screening.fingerprints.candidates[candidate]
    shapes, case = screening.fingerprints.settings[column], screening.search.model.case
    by_score = screening.kinds[0].log_evidence[column] - screening.kinds[0].log_prior[column]
    others = tuple(
        start_with(case, one, shapes, look.point.z, float(look.gain[column]))
        for look in looks
        if look.log_factor[column] > by_score
    )
    return RefitTrial(one, shapes, (refit_start(screening, candidate, column), *others))


def _place_trial(screening: Screening, places: Places, spot: int) -> RefitTrial:
    """Something unlisted at one spot, from the best place and the size of its score."""
    case, search = screening.search.model.case, screening.search
    kind = kind_named(screening.kinds, places.term)
    shapes = places.shapes(spot)
    candidate = place_candidate(library(case.effect_file)[EFFECT_AT_PLACE[places.term]], shapes, places.plausible)
    gain = float(kind.gain[spot])
    starts = (start_with(case, candidate, shapes, search.point.z, share * gain) for share in START_SHARES)
    return RefitTrial(candidate, shapes, tuple(starts))


def _settings_charge(screening: Screening, candidate: int, column: int) -> float:
    """ln prior of an effect whose setting `column` was refitted, and what its other settings add to first order."""
    columns, kind = screening.fingerprints.columns[candidate], screening.kinds[0]
    evidence = kind.log_evidence
    others = float(np.logaddexp.reduce(evidence[columns]) - evidence[columns].max())
    return float(kind.log_prior[column]) + others


def _instrument_hypotheses(screening: Screening) -> list[Hypothesis]:
    """The best instrument of each kind, with the evidence of its kind."""
    return [
        Hypothesis(kind.name, kind.name, kind.total, kind.best, screening.instruments[kind.name][kind.best])
        for kind in screening.kinds
        if kind.name in screening.instruments
    ]
