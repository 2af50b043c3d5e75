"""The comparison of everything that could explain a misfit: listed effects, local anomalies and instruments.

    E_j = ln B_j + ln prior_j

The most promising hypotheses of each kind are calibrated with the model; their evidence E is Laplace's (`refits`). The
others of that kind keep their evidence to first order, corrected as that of the best of them was. Instruments do not
change the flow, so that first order is exact for them but for the parameters; of surveyed lines, which do, the most
probable is calibrated without its level. Prior weights are in `residual_screening`, odds in `odds`, and local anomalies
are moved to where they explain most by `place_search`.

Hypotheses almost as probable as the best are followed one step further, together with what would be accepted next:
first order overestimates what that will explain. The less specific hypothesis has to lead. A local anomaly says "none
of the known causes", so all positions together must lead all known causes by known_first_odds; which position is taken
need not be certain. No other hypothesis is followed beside one that nothing rivals within strong_odds.

Impossible causes have no evidence: a bed that moves by more than the depth, water that enters by more than the
discharge (`possible_change`), and a listed effect beyond implausible_size that these data could not show at a plausible
one.

Smooth fields of a term (`field_scan`) explain much of any missing cause. They are compared with all that was accepted
in the end, not with a single cause.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.candidates import Instrument, InstrumentKind, place_candidate, start_with
from vegglue.calibration.fingerprints import Places
from vegglue.calibration.fit import chi2
from vegglue.calibration.model_error import EFFECT_AT_PLACE
from vegglue.calibration.residual_screening import Screening, conditional_screenings, refit_start
from vegglue.calibration.score_test import kind_named, prior_shrinkage
from vegglue.case.case_effects import effect_named
from vegglue.decision_constants import constants
from vegglue.diagnosis.odds import tempered_probabilities, tempering, under_larger_errors
from vegglue.diagnosis.place_search import PATCH, cannot_be, found_extent, found_patch, found_place, possible_change
from vegglue.diagnosis.refits import Refit, RefitTrial, Relevelled, refits_of, relevelled
from vegglue.parallel import in_threads
from vegglue.progress import Progress, Watch
from vegglue.results.causes import PatchOutline
from vegglue.wording.phases import COMPARING_LINE

# Listed effects that are refitted in one round at most, and how far below the best one's evidence a hypothesis may lie
# to be refitted, after w: e^-6 is one in 400. Chosen, not measured: more cost runs of the model.
MOST_REFITTED, REACH = 8, 6.0
# Shares of the size that its score promises from which something at a place is refitted: at all of it a flow may not be
# found. Chosen, not measured.
START_SHARES = (1.0, 0.3)


@dataclass(frozen=True)
class Hypothesis:
    """A hypothesis with its evidence.

    Attributes
    ----------
    kind : str
        "effect", a term at a place, or an instrument's kind.
    log_evidence : float
        E [-], -inf of what cannot be.
    column : int
        Of its fingerprint among those of its kind.
    what : Refit or Instrument
        Its refit, or the instrument.
    errors, spread : float, float
        Of x and y of a place [m], see `FoundPlace`.
    without : Relevelled or None
        Of a surveyed line the model without its level.
    outline : PatchOutline or None
        Of plants that are not on the map.
    """

    kind: str
    name: str
    log_evidence: float
    column: int
    what: Refit | Instrument
    errors: tuple[float, float] = (0.0, 0.0)
    spread: tuple[float, float] = (0.0, 0.0)
    without: Relevelled | None = None
    outline: PatchOutline | None = None


def hypotheses_of(screening: Screening, watch: Watch, elsewhere: float = -np.inf) -> list[Hypothesis]:
    """Everything that was tried, with its evidence.

    To first order an effect may promise more than it keeps, or have no flow at all. Then what is within reach of the
    rest is refitted, too, until nothing is.

    Parameters
    ----------
    watch : callable
        Is called with each phase.
    elsewhere : float
        ln evidence of what competes besides [-].

    Returns
    -------
    list of Hypothesis
        The most evidence first.
    """
    kind, looks = screening.kinds[0], conditional_screenings(screening)
    prints, search, case = screening.fingerprints, screening.search, screening.search.model.case
    # E of every column of the listed effects, from the place that promises most, and the best column of each effect.
    linear = np.asarray(np.max([kind.log_evidence, *(one.log_factor + kind.log_prior for one in looks)], axis=0))
    columns = [int(some[np.argmax(linear[some])]) for some in prints.columns]
    of_each = np.array([linear[column] for column in columns])
    best = max(*(one.total for one in screening.kinds), float(linear.max(initial=-np.inf)), elsewhere)
    found = list[Hypothesis]()
    for of_kind in screening.kinds:
        if of_kind.name not in screening.instruments:
            continue
        instrument, total, without = screening.instruments[of_kind.name][of_kind.best], of_kind.total, None
        by_score = float(of_kind.log_evidence[of_kind.best] - of_kind.log_prior[of_kind.best])
        # An offset acts linearly: where its score speaks against it, so does the calibration.
        if instrument.line is not None and by_score >= 0.0 and _within_reach(total, best):
            watch(Progress(COMPARING_LINE.format(instrument.line.x)))
            if (without := relevelled(screening.base, instrument.line)) is not None:
                total = total + without.log_factor - by_score
        found.append(Hypothesis(of_kind.name, of_kind.name, total, of_kind.best, instrument, without=without))
    tried: set[str] = set()
    while True:
        effects = [j for j in worth_refitting(of_each, best) if prints.candidates[j].name not in tried]
        places = [
            (one, promising_spots(screening, one, best))
            for one in prints.places
            if one.name not in tried and _within_reach(kind_named(screening.kinds, one.term).total, best)
        ]
        names = [prints.candidates[j].name for j in effects] + [one.name for one, _ in places]
        if not names:
            return sorted(found, key=lambda one: -one.log_evidence)
        watch(Progress(f"comparing {', '.join(names)}"))
        trials = []
        for j in effects:  # at its best setting, from the best place, and from others that promise more there
            column, candidate = columns[j], prints.candidates[j]
            shapes, by_score = prints.settings[column], kind.log_evidence[column] - kind.log_prior[column]
            others = (
                start_with(candidate, look.point.z, float(look.gain[column]))
                for look in looks
                if look.log_factor[column] > by_score
            )
            trials.append(RefitTrial(candidate, shapes, (refit_start(screening, j, column), *others)))
        spots = [(one, spot) for one, some in places for spot in some]
        for one, spot in spots:  # from the best place and shares of the size of its score
            shapes, gain = one.shapes(spot), float(kind_named(screening.kinds, one.term).gain[spot])
            bare = bool(one.only_sign[spot])
            candidate = place_candidate(effect_named(case, EFFECT_AT_PLACE[one.term]), shapes, one.plausible, bare)
            starts = (start_with(candidate, search.point.z, share * gain) for share in START_SHARES)
            trials.append(RefitTrial(candidate, shapes, tuple(starts)))
        refits = refits_of(search, trials, watch)
        for j, refit in zip(effects, refits, strict=False):
            if refit is not None:  # ln prior of the setting, and what the other settings add to first order
                some, evidence = prints.columns[j], kind.log_evidence
                others_add = float(np.logaddexp.reduce(evidence[some]) - evidence[some].max())
                if prints.candidates[j].free:  # whichever part of it the amplitude is, the model is the same
                    others_add = float(np.log(some.size))
                total = refit.log_factor + (float(kind.log_prior[columns[j]]) + others_add)
                size = abs(refit.amplitude - refit.candidate.amplitude.off) / refit.candidate.amplitude.scale
                if size > constants().implausible_size and not screening.testable(columns[j]):
                    total = -np.inf
                found.append(Hypothesis("effect", refit.candidate.name, total, columns[j], refit))
        ended = [(one, spot, refit) for (one, spot), refit in zip(spots, refits[len(effects) :], strict=True) if refit]
        tasks = [(screening, one, [(spot, refit) for of, spot, refit in ended if of is one]) for one, _ in places]
        found += [one for one in in_threads(somewhere_of, tasks) if one is not None]
        if spots and PATCH not in tried:
            names.append(PATCH)
            found = with_patch(screening, found)
        tried |= set(names)
        promising = [float(of_each[j]) for j in _promising(of_each) if prints.candidates[j].name not in tried]
        promising += [kind_named(screening.kinds, one.term).total for one in prints.places if one.name not in tried]
        best = max(elsewhere, *(one.log_evidence for one in found), *promising)


def somewhere_of(screening: Screening, places: Places, ends: Sequence[tuple[int, Refit]]) -> Hypothesis | None:
    """A local anomaly of a term where it explains most, from its refits at some spots.

    Parameters
    ----------
    places : Places
        The spots of the term.
    ends : sequence of (int, Refit)
        Spot and refit; the one of the largest ln B is moved on.

    Returns
    -------
    Hypothesis or None
        With E = -inf if its whole 95 % interval is impossible; None without refits.
    """
    if not ends:
        return None
    kind, search = kind_named(screening.kinds, places.term), screening.search
    spot, refit = max(ends, key=lambda end: end[1].log_factor)
    there = found_place(search, places, kind, spot, refit)
    name = there.refit.candidate.name
    possible = possible_change(search.model, search.point, places.term, *(there.refit.shapes[k] for k in "xy"))
    total = -np.inf if cannot_be(there.refit.interval95, possible) else there.log_evidence
    return Hypothesis(kind.name, name, total, spot, there.refit, there.errors, there.spread)


def with_patch(screening: Screening, found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The hypotheses with plants that are not on the map in place of a spot of drag that they lead by strong_odds.

    Spots of other terms then have their extent fitted, too: else water that enters along a bank is plants, whose sizes
    are free.

    Parameters
    ----------
    found : sequence of Hypothesis
        All so far. The plants are fitted from where most drag is promised, and from the place that has most evidence if
        that is a spot away.

    Returns
    -------
    list of Hypothesis
        As they were if no such plants lead.
    """
    places = next((one for one in screening.fingerprints.places if one.term == "drag"), None)
    at_places = [one for one in found if isinstance(one.what, Refit) and one.kind != "effect"]
    if places is None or not at_places:
        return list(found)
    kind = kind_named(screening.kinds, "drag")
    spot = int(np.argmax(np.where(kind.scores > 0.0, kind.log_evidence, -np.inf)))
    best = max(at_places, key=lambda one: one.log_evidence).what
    assert isinstance(best, Refit)
    starts = [(float(places.x[spot]), float(places.y[spot])), (best.shapes["x"], best.shapes["y"])]
    apart = np.diff(starts, axis=0) / (places.length[spot], places.width[spot])
    spots = [one.log_evidence for one in at_places if one.kind == "drag"]
    against = max(spots, default=kind.total)
    needed = against + np.log(constants().strong_odds) * float(tempering(np.array(against)))
    patch = found_patch(screening.search, places, kind, starts if np.linalg.norm(apart) > 1.0 else starts[:1], needed)
    if patch is None:
        return list(found)
    shapes = patch.refit.shapes
    nearest = int(np.argmin(np.hypot(places.x - shapes["x"], places.y - shapes["y"])))
    plants = Hypothesis(
        "drag", patch.refit.candidate.name, patch.log_evidence, nearest, patch.refit, patch.errors,
        outline=patch.outline,
    )  # fmt: skip
    return [*(with_extent(screening, one, shapes) for one in found if one.kind != "drag"), plants]


def with_extent(screening: Screening, one: Hypothesis, outline: Mapping[str, float]) -> Hypothesis:
    """`found_extent` of a spot where that has more evidence.

    Parameters
    ----------
    outline : mapping of float
        x, y, half length and half width [m] from which a fit starts besides that of the spot.

    Returns
    -------
    Hypothesis
        As it was if it is no spot, a barrier, or its fitted extent has less evidence or an impossible amplitude.
    """
    places = next((places for places in screening.fingerprints.places if places.term == one.kind), None)
    if places is None or places.term == "barrier" or not isinstance(one.what, Refit):
        return one
    search = screening.search
    there = found_extent(search, places, kind_named(screening.kinds, one.kind), one.what, outline, one.log_evidence)
    if there is None:
        return one
    refit = there.refit
    possible = possible_change(search.model, search.point, places.term, refit.shapes["x"], refit.shapes["y"])
    if cannot_be(refit.interval95, possible):
        return one
    name, errors, spread = refit.candidate.name, there.errors, there.spread
    return replace(one, name=name, log_evidence=there.log_evidence, what=refit, errors=errors, spread=spread)


def chances_of(hypotheses: Sequence[Hypothesis]) -> Array:
    """p_j of each hypothesis to be what is missing, were it one of them: `tempered_probabilities`.

    Returns
    -------
    ndarray (k,)
        [-], of sum 1.
    """
    return tempered_probabilities(np.array([one.log_evidence for one in hypotheses]))


def worth_refitting(evidence: Array, best: float) -> list[int]:
    """Listed effects whose evidence is not far behind the best: (best - E) / w(best) < REACH.

    Parameters
    ----------
    evidence : ndarray (candidate,)
        E to first order [-].
    best : float
        E of the best of all hypotheses [-].

    Returns
    -------
    list of int
        MOST_REFITTED at most, the best first, one of them at least.
    """
    ranked = _promising(evidence)
    return [j for j in ranked if _within_reach(float(evidence[j]), best)] or ranked[:1]


def _promising(evidence: Array) -> list[int]:
    return [int(j) for j in np.argsort(-evidence)[:MOST_REFITTED]]


def _within_reach(evidence: float, best: float) -> bool:
    return bool((best - evidence) / tempering(np.array(best)) < REACH)


def promising_spots(screening: Screening, places: Places, best: float) -> list[int]:
    """The best spot of each length that is within reach of the best hypothesis.

    Parameters
    ----------
    places : Places
        The spots of one term.
    best : float
        E of the best of all hypotheses [-].

    Returns
    -------
    list of int
        Spots, by length. None where something of the term acts already: an effect at the same place has its name, and
        would take its place in the case.
    """
    kind, case = kind_named(screening.kinds, places.term), screening.search.model.case
    effect = effect_named(case, EFFECT_AT_PLACE[places.term])
    acting = [place_candidate(effect, places.shapes(spot)).key in case.effects for spot in range(places.x.size)]
    evidence = np.where(acting, -np.inf, kind.log_evidence)
    of_length = [np.flatnonzero(places.length == length) for length in np.unique(places.length)]
    spots = [int(columns[np.argmax(evidence[columns])]) for columns in of_length]
    charge = kind.total - float(kind.log_evidence.max())
    return [spot for spot in spots if _within_reach(float(evidence[spot]) + charge, best)]


# Hypotheses of different kinds that are followed a step further at most: each costs a calibration and a screening.
MOST_FOLLOWED = 3
What = Literal["effect", "place", "instrument"]
# Kinds of hypotheses that are in a list.
KNOWN = ("effect", *get_args(InstrumentKind))


def evidence_under_larger_errors(screening: Screening, hypotheses: Sequence[Hypothesis]) -> Array:
    """`under_larger_errors` of hypotheses, refitted or to first order.

    Returns
    -------
    ndarray (k,)
        E' [-].
    """
    before = chi2(screening.search.noise, screening.search.point)

    def left_by(one: Hypothesis) -> float:
        if isinstance(one.what, Refit):
            return one.what.fitted.chi2
        kind = kind_named(screening.kinds, one.kind)
        return before - float(kind.scores[one.column] ** 2 * prior_shrinkage(kind.size[one.column]))

    left = np.array([left_by(one) for one in hypotheses])
    evidence = np.array([one.log_evidence for one in hypotheses])
    return under_larger_errors(evidence, left, before, screening.base.noise.rows.size)


def nearly_as_likely(hypotheses: Sequence[Hypothesis]) -> list[int]:
    """Hypotheses of the best one's kind within same_kind_odds of it, of others within strong_odds.

    Parameters
    ----------
    hypotheses : sequence of Hypothesis
        The most evidence first.

    Returns
    -------
    list of int
        MOST_FOLLOWED of them at most, what is known among them if any of it is so likely.
    """
    chance = chances_of(hypotheses)
    odds = [
        constants().same_kind_odds if one.kind == hypotheses[0].kind else constants().strong_odds for one in hypotheses
    ]
    likely = [j for j, p in enumerate(chance) if p * odds[j] >= chance[0]]
    known = [j for j in likely if hypotheses[j].kind in KNOWN]
    last = known[0] if known and known[0] not in likely[: MOST_FOLLOWED - 1] else None
    return likely[:MOST_FOLLOWED] if last is None else [*likely[: MOST_FOLLOWED - 1], last]


def chance_of_a_place(hypotheses: Sequence[Hypothesis], chances: Sequence[float]) -> float:
    """That it is something at a place, of hypotheses with their chances (k,) [-]."""
    return sum(chance for one, chance in zip(hypotheses, chances, strict=True) if one.kind not in KNOWN)


def chosen_hypothesis(what: Sequence[What], evidence: Array, at_a_place: float) -> int | None:
    """The likeliest of those followed; if that is a place, the likeliest listed effect within known_first_odds of it.

    Parameters
    ----------
    what : sequence of {"effect", "place", "instrument"}
    evidence : ndarray (k,)
        ln, of each [-].
    at_a_place : float
        Chance of all places together, those that were not followed among them [-].

    Returns
    -------
    int or None
        Without such an effect the place, or None if all places do not lead all that is known by known_first_odds.
    """
    best = int(np.argmax(evidence))
    if what[best] != "place":
        return best
    ahead = (evidence[best] - evidence) / tempering(evidence[best])
    listed = [j for j, one in enumerate(what) if one == "effect" and ahead[j] < np.log(constants().known_first_odds)]
    if listed:
        return min(listed, key=lambda j: float(ahead[j]))
    return best if at_a_place >= constants().known_first_odds * (1.0 - at_a_place) else None
