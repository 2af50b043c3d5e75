"""How often a diagnosis of planned measurements would name an effect, and the search for pieces of field work to add:
by gain per hour, from nothing and from equally spaced transects, exchanged one by one while that helps (Fedorov 1972;
not checked against it).
"""

from collections.abc import Sequence
from collections.abc import Set as Flows
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vegglue.arrays import Array, Mask, Single
from vegglue.calibration.detection import (
    PLANNED_POWER,
    PossibleMeasurements,
    chance_over_prior,
    chance_to_separate,
    detection_chance,
    possible_measurements,
    single_threshold,
    squared_distance,
)
from vegglue.calibration.residual_screening import GROUPS
from vegglue.calibration.score_test import HypothesisKind, Projected, prior_shrinkage, with_more_rows
from vegglue.case.schema import Planned
from vegglue.compilation import compiled
from vegglue.decision_constants import constants
from vegglue.diagnosis.odds import tempering
from vegglue.diagnosis.plan_model import PlanModel, bending_of, place_along, ratios_of_lengths
from vegglue.effects.definition import Amplitude
from vegglue.measurements.kinds import STREAMWISE
from vegglue.measurements.observations import section_places
from vegglue.parallel import in_threads
from vegglue.results.plan import EffectsInGeneral, OneEffect, PlanQuestion, ProposedPieces, TwoEffects, Work, hours_of

# Lengths l at which the chance to be named is computed [standard errors]; between them it is linear, from 0 at 0.
NAMED_AT = np.array([0.0, 2.0, 3.0, 4.0, 4.75, 5.5, 6.5, 8.0, 11.0, 16.0, 24.0])
# Draws of errors alone for each: a chance of 90 % is known to 2 %.
NAMED_DRAWS = 192
# Draws that are worked on together [-]: what is computed of them then fits the cache.
DRAWS_AT_ONCE = 64
# Least sum of Bayes factors, as that of nothing at all [-].
LEAST_ODDS = 1e-300
# |cosine| with a trace below which a spot or an instrument keeps the evidence that it has under errors alone [-].
UNLIKE = 0.3


@dataclass(frozen=True)
class FirstCompetition:
    """The first competition of a diagnosis, before there is a residual.

    Attributes
    ----------
    effects : int
        Number of hypotheses about listed effects, which stand first; then one of each other kind.
    places : ndarray of bool
        Which of the other kinds are places.
    alike : ndarray of bool (effects, effects)
        Whether traces are similar.
    level : float
        ln of the sum of Bayes factors at which the diagnosis is alarmed [-].
    owner : ndarray of int (k,)
        Hypothesis of each column.
    only_sign : ndarray (k,)
        Sign with which a score counts, 0 for both.
    constant, factor : ndarray (k,)
        ln evidence = constant + factor T^2 [-].
    units : ndarray (rows, k)
        Whitened and projected fingerprints of length 1 [-].
    scores : ndarray (k, draws)
        T under errors alone [standard errors].
    """

    effects: int
    places: Mask
    alike: Mask
    level: float
    owner: np.ndarray
    only_sign: Single
    constant: Single
    factor: Single
    units: Single
    scores: Single

    def named(self, effect: int, cosine: Single) -> Array:
        """Chance that an effect is named at each of NAMED_AT (lengths,), over its truths in turn, given the cosine of
        each with all columns (k, truths).
        """
        truths = cosine.shape[1]
        own = self.only_sign[self.owner == effect]
        both = np.where((np.arange(self.scores.shape[1]) // truths) % 2 == 0, 1.0, -1.0)
        sign = np.where(own.any(), own[0], both).astype(np.float32)
        near = np.flatnonzero((self.owner < self.effects) | (np.abs(cosine).max(axis=1) > UNLIKE))
        owner, first = np.unique(self.owner[near], return_index=True)
        at_rest, of_all = self.at_rest
        others = of_all.copy()
        others[owner] -= np.add.reduceat(at_rest[near], first, axis=0, dtype=float)
        evidence = np.repeat(np.log(np.maximum(others, LEAST_ODDS))[None], NAMED_AT.size - 1, axis=0)
        of_near = self.only_sign[near], self.factor[near], self.constant[near], self.owner[near]
        scores = self.scores[near]
        for one, toward in enumerate(np.ascontiguousarray(cosine[near].T)):
            of_it = slice(one, None, truths)
            found = np.ascontiguousarray(evidence[..., of_it])
            shifts = np.outer(NAMED_AT[1:], sign[of_it])
            _add_evidence(shifts, np.ascontiguousarray(scores[:, of_it]), toward, *of_near, found)
            evidence[..., of_it] = found
        return np.array([0.0, *(self._named(one.T, effect) for one in evidence)])

    @cached_property
    def at_rest(self) -> tuple[Single, Array]:
        """Evidence under errors alone of each column (k, draws), and its sums (hypotheses, draws)."""
        counted = np.where(self.only_sign[:, None] * self.scores < 0.0, np.float32(0.0), self.scores)
        found = np.exp(self.constant[:, None] + self.factor[:, None] * counted**2)
        return found, np.add.reduceat(found, np.unique(self.owner, return_index=True)[1], axis=0, dtype=float)

    def _named(self, evidence: Array, effect: int) -> float:
        """Share of the draws in which an effect is named, of ln evidence (draws, hypotheses)."""
        most = evidence.max(axis=1)[:, None]
        of_any = most[:, 0] + np.log(np.exp(evidence - most).sum(axis=1))
        chance = np.exp((evidence - most) / tempering(evidence))
        chance /= chance.sum(axis=1)[:, None]
        listed, others = chance[:, : self.effects], evidence[:, self.effects :]
        best = evidence[:, : self.effects].max(axis=1)
        of_places = others[:, self.places].max(axis=1, initial=-np.inf)
        of_instruments = others[:, ~self.places].max(axis=1, initial=-np.inf)
        taken = (of_places - best) / tempering(of_places) < np.log(constants().known_first_odds)
        taken &= (best >= of_instruments) & (of_any >= self.level)
        # The groups that are likelier than its own hold less than set_chance.
        groups = listed @ self.alike
        likelier = (groups > groups[:, effect][:, None]) & ~self.alike[effect]
        inside = (listed * likelier).sum(axis=1) < constants().set_chance * listed.sum(axis=1)
        inside &= listed[:, effect] >= constants().rival_share * chance.max(axis=1)
        return float(np.mean(taken & inside))


@compiled
def _add_evidence(
    shifts: Array, scores: Single, cosine: Single, only_sign: Single, factor: Single, constant: Single,
    owner: np.ndarray, evidence: Array,
) -> None:  # fmt: skip
    """ln of the sums of what is in `evidence` (lengths, hypotheses, draws) and of columns by owner (k,), at scores (k,
    draws) shifted by `shifts` (lengths, draws) times cosine (k,), with the only sign that they count with.
    """
    one, half = np.float32(1.0), np.float32(0.5)
    third, fourth, fifth, sixth = np.float32(1 / 3), np.float32(1 / 4), np.float32(1 / 5), np.float32(1 / 6)
    binary, natural = np.float32(1.0 / np.log(2.0)), np.float32(np.log(2.0))
    shift, most = np.empty(DRAWS_AT_ONCE, np.float32), np.empty(DRAWS_AT_ONCE, np.float32)
    found, sums = np.empty((cosine.size, shift.size), np.float32), np.empty((evidence.shape[1], shift.size), np.float32)
    for beginning in range(0, scores.shape[1], shift.size):
        draws = min(shift.size, scores.shape[1] - beginning)
        for length in range(shifts.shape[0]):
            for d in range(draws):
                shift[d], most[d] = shifts[length, beginning + d], np.float32(-1e30)
            for k in range(cosine.size):
                toward, sided, c, f = cosine[k], only_sign[k], constant[k], factor[k]
                for d in range(draws):
                    score = scores[k, beginning + d] + shift[d] * toward
                    score = np.float32(0.0) if sided * score < np.float32(0.0) else score
                    found[k, d] = c + f * score * score
                    most[d] = found[k, d] if found[k, d] > most[d] else most[d]
            sums[:] = np.float32(0.0)
            for k in range(cosine.size):
                j = owner[k]
                for d in range(draws):  # e^x = 2^n e^y, |y| <= ln 2 / 2: a series to 1e-7 takes a fourth of the time
                    power = (found[k, d] - most[d]) * binary
                    power = np.float32(-126.0) if power < np.float32(-126.0) else power
                    whole = np.floor(power + half)
                    y = (power - whole) * natural
                    series = one + y * third * (one + y * fourth * (one + y * fifth * (one + y * sixth)))
                    series = one + y * (one + y * half * series)
                    scale = np.int32((np.int32(whole) + np.int32(127)) << np.int32(23)).view(np.float32)
                    sums[j, d] += series * scale
            for j in range(evidence.shape[1]):
                for d in range(draws):
                    before = evidence[length, j, beginning + d]
                    evidence[length, j, beginning + d] = most[d] + np.log(sums[j, d] + np.exp(before - most[d]))


def first_competition(
    kinds: Sequence[HypothesisKind], columns: Sequence[np.ndarray], places: Sequence[str], errors: Array, level: float
) -> FirstCompetition:
    """The first competition of a diagnosis before there is a residual: how often an effect is named that is in it.

        T_k = l c_k + e_k,   c_k = U_k' S_perp / |S_perp|

    T_k are the scores of all hypotheses (`score_test`) if an effect with the trace S, l standard errors long, and
    errors alone make the residual; e_k are the scores of errors alone. The diagnosis is alarmed if the sum of all Bayes
    factors is above its level. Of the tempered chances of `odds` it then takes what is likeliest, an effect
    before a place that does not lead by known_first_odds, and reports the fewest groups of similar effects that hold
    set_chance (`search_state.rivals_among`; here the group of an effect is all that are similar to it). Named means
    that the true effect is among them. Refits, and what is found beside a first effect, are left out.

    Parameters
    ----------
    kinds : sequence of HypothesisKind
        That of listed effects first.
    columns : sequence of array
        Columns of each listed effect, side by side.
    places : sequence of str
        Names of the kinds that are places.
    errors : array (draws, n)
        Whitened errors alone [-], NAMED_DRAWS of them are used.
    level : float
        ln of the sum of Bayes factors at which the diagnosis is alarmed [-].
    """
    effects = len(columns)
    of_others = [one.size.size for one in kinds[1:]]
    size = np.concatenate([one.size for one in kinds])
    units = np.hstack([one.projected.units for one in kinds]).astype(np.float32)
    likeness = np.abs(kinds[0].projected.units.T @ kinds[0].projected.units) > constants().alike_cosine
    first = [int(one[np.argmax(kinds[0].size[one])]) for one in columns]
    return FirstCompetition(
        effects=effects,
        places=np.array([one.name in places for one in kinds[1:]], dtype=bool),
        alike=likeness[np.ix_(first, first)],
        level=level,
        owner=np.repeat(np.arange(effects + len(of_others)), [*(one.size for one in columns), *of_others]),
        only_sign=np.concatenate([one.only_sign for one in kinds]).astype(np.float32),
        constant=np.concatenate([one.of_scores(np.zeros(one.size.size)) for one in kinds]).astype(np.float32),
        factor=(0.5 * prior_shrinkage(size)).astype(np.float32),
        units=units,
        scores=units.T @ with_more_rows(errors[:NAMED_DRAWS], len(units), 2).T,
    )


def chances_named(competition: FirstCompetition, truths: Sequence[Projected]) -> Array:
    """Chance that each listed effect is named at each of NAMED_AT, see `first_competition`.

    Parameters
    ----------
    truths : sequence of Projected
        Of each effect, at shapes that it may have.

    Returns
    -------
    ndarray (effect, lengths)
        [-]
    """
    ends = np.cumsum([one.units.shape[1] for one in truths])[:-1]
    cosines = competition.units.T @ np.hstack([one.units for one in truths]).astype(np.float32)
    return np.array(in_threads(competition.named, list(enumerate(np.split(cosines, ends, axis=1)))))


# Proposals of one kind that are shown, and of all; rounds of exchange.
OF_A_KIND, ADDITIONS_SHOWN, EXCHANGES = 2, 8, 3
# Rise of what is maximised below which a piece adds nothing [-].
LEAST_PLAN_GAIN = 1e-3
# What is maximised: the number of testable effects, smooth as a power of the chance of each, so that one that nearly is
# counts, and a share of the answer. Chosen: with 1 to 8, and 0.1 to 1, sets of the sites of docs/plan.md are as good.
NEARLY_TESTABLE, SHARE_OF_ANSWER = 4.0, 0.3


@dataclass(frozen=True)
class PlanAnswer:
    """The answer to a question over all places of the priors.

    Attributes
    ----------
    mean, least : float
        [-]
    """

    mean: float
    least: float


@dataclass(frozen=True)
class DesignCriterion:
    """How well measurements answer a question, by the lengths of the traces that they would leave.

    Attributes
    ----------
    question : PlanQuestion
        What is asked. Of two effects there are three traces, the third the sum of both.
    candidates : int
        Number of hypotheses about listed effects.
    level : float
        Of the alarm, ln of the sum of Bayes factors [-].
    amplitudes : tuple of Amplitude
        Of the k effects that the question is about.
    beyond : ndarray (k,)
        By how much the score of each has to be above that of the alarm to be named [standard errors].
    bending : ndarray (k,)
        See `bending_of`.
    """

    question: PlanQuestion
    candidates: int
    level: float
    amplitudes: tuple[Amplitude, ...]
    beyond: Array
    bending: Array

    def sizes(self, squares: Array) -> Array:
        """Lengths of traces at places of the priors (place, ..., k), or the distance of two, of squares at each draw:
        those around the middle over that in the middle, on the coarsest cells, times that on the cells of the search.
        """
        if isinstance(self.question, TwoEffects):
            squares = squared_distance(*np.moveaxis(squares, -1, 0))[..., None]
        size = np.sqrt(np.maximum(squares, 0.0))
        return size[:1] if len(size) < 3 else size[0] * ratios_of_lengths(size[1:])

    def answers(self, size: Array) -> Array:
        """The answer at each place of the priors (place, ...)."""
        if isinstance(self.question, TwoEffects):
            return chance_to_separate(size[..., 0] ** 2)
        threshold = self._threshold(size)
        if isinstance(self.question, OneEffect):
            amplitude = self.amplitudes[0]
            relative = self._bent(np.array([abs(amplitude.gain(self.question.size)) / amplitude.plausible_gain]))
            return detection_chance(relative * size, threshold, amplitude.only_sign)[..., 0]
        return np.asarray(chance_over_prior(size, threshold).sum(axis=-1))

    def answer(self, size: Array) -> PlanAnswer:
        """The mean answer and the least."""
        found = self.answers(size)
        return PlanAnswer(float(found.mean()), float(found.min()))

    def worths(self, squares: Array) -> Array:
        """What is maximised (...,), of squares at each draw (draw, ..., c): the answer, or of all effects

            sum over effects of min(P / PLANNED_POWER, 1)^NEARLY_TESTABLE + SHARE_OF_ANSWER answer,

        P the chance to be named at twice a plausible size, from PLANNED_POWER of which it is testable.
        """
        size = self.sizes(squares)
        answer = self.answers(size).mean(axis=0)
        if not isinstance(self.question, EffectsInGeneral):
            return np.asarray(answer)
        chance = detection_chance(self._twice * size, self._threshold(size)).mean(axis=0)
        nearly = np.minimum(chance / PLANNED_POWER, 1.0) ** NEARLY_TESTABLE
        return np.asarray(nearly.sum(axis=-1) + SHARE_OF_ANSWER * answer)

    def _threshold(self, size: Array) -> Array:
        prior = np.full(size.shape, -np.log(GROUPS * self.candidates))
        return single_threshold(size, prior, self.level) + self.beyond

    def _bent(self, relative: Array) -> Array:
        """Length of a trace over that at a plausible size, of gains over those of plausible sizes (k,)."""
        return np.asarray(relative * (1.0 + self.bending) / (1.0 + self.bending * relative))

    @cached_property
    def _twice(self) -> Array:
        """Length of a trace at twice a plausible size, or at the furthest, over that at a plausible one (k,)."""
        sizes = [min(2.0 * one.scale, one.furthest) / one.scale for one in self.amplitudes]
        return self._bent(np.array([size**one.power for size, one in zip(sizes, self.amplitudes, strict=True)]))


@dataclass(frozen=True)
class PlanSearch:
    """The search for pieces of field work to add.

    Attributes
    ----------
    wide : PlanModel
        All pieces that are possible.
    criterion : DesignCriterion
        What is maximised.
    present : frozenset of str
        Flows that are measured in anyhow.
    another : float
        Hours of another one [h].
    base : PossibleMeasurements
        Given the plan as it is, at each draw of the priors (draw, ...).
    """

    wide: PlanModel
    criterion: DesignCriterion
    present: frozenset[str]
    another: float
    base: PossibleMeasurements

    @cached_property
    def start(self) -> PlanAnswer:
        """The answer without a further piece."""
        return self.criterion.answer(self.criterion.sizes(self.base.squares))

    @cached_property
    def sections(self) -> frozenset[float]:
        """Where velocities are measured or planned along the reach, see `place_along`."""
        known = self.wide.model.station.iloc[self.wide.known]
        velocity = known[known["kind"] == STREAMWISE]
        return frozenset(place_along(self.wide.model.case, x) for x in section_places(velocity).unique())

    def worth(self, pieces: Sequence[int]) -> float:
        """What is maximised, with some pieces added."""
        return float(self.criterion.worths(self.with_each([pieces]))[0])

    def rows_of(self, pieces: Sequence[int]) -> np.ndarray:
        """Of the stations and bed levels of some pieces."""
        return np.concatenate([np.zeros(0, dtype=int), *(self.wide.rows[j] for j in pieces)])

    def with_each(self, moves: Sequence[Sequence[int]]) -> Array:
        """Squares of lengths with one of some moves made (draw, move, c)."""
        return _with_each(self.base, [self.rows_of(move) for move in moves])

    def hours(self, pieces: Sequence[int], present: frozenset[str]) -> float:
        """Of some pieces together, beside flows that are measured in anyhow."""
        return hours_of([self.wide.pieces[j] for j in pieces], self.another, present)

    def moves(self) -> list[tuple[int, ...]]:
        """What could be added at once: each piece, and for each flow without measurements the places of the others."""
        pieces, case = self.wide.pieces, self.wide.model.case
        found: list[tuple[int, ...]] = [(j,) for j in range(len(pieces))]
        for flow in case.experiments:
            if flow in self.present:
                continue
            together = [
                j for j, one in enumerate(pieces) if one.experiment == flow and one.work is Work.TRANSECT
                and place_along(case, one.x) in self.sections
            ]  # fmt: skip
            # Of a transect and the same with every second vertical the whole one, which stands first.
            together = list({pieces[j].x: j for j in reversed(together)}.values())[::-1]
            found += [tuple(together[:count]) for count in (2, 3, 5, 8) if len(together) >= count]
        return found

    def ranked(self) -> tuple[ProposedPieces, ...]:
        """Single additions to the plan by what they add in an hour: the best few of each kind of work, of repeats, and
        of flows that the case does not have, as far as they add something.
        """
        found = []
        moves = self.moves()
        # a flow that the case does not have is known in the middle of the priors: elsewhere traces keep their ratio.
        size = self.criterion.sizes(self.with_each(moves))
        for k, move in enumerate(moves):
            after = self.criterion.answer(size[:, k])
            if after.mean - self.start.mean > LEAST_PLAN_GAIN:
                found.append(self._proposed(move, after))
        found.sort(key=lambda one: -one.per_hour)
        kinds = [(one.pieces[0].work, one.pieces[0].again, one.pieces[0].new, len(one.pieces) > 1) for one in found]
        few = [one for j, one in enumerate(found) if kinds[:j].count(kinds[j]) < OF_A_KIND]
        return tuple(few[:ADDITIONS_SHOWN])

    def _proposed(self, move: Sequence[int], after: PlanAnswer) -> ProposedPieces:
        pieces = tuple(self.wide.pieces[j] for j in move)
        return ProposedPieces(pieces, self.hours(move, self.present), self.start.mean, after.mean, after.least)

    def extended(self, budget: float) -> ProposedPieces | None:
        """The best set to add for so many hours; None if nothing fits."""
        chosen = self.best_set(budget)
        after = self.criterion.answer(self.criterion.sizes(self.with_each([chosen])[:, 0]))
        return self._proposed(chosen, after) if chosen else None

    def best_set(self, budget: float) -> list[int]:
        """Pieces that fit a budget [h], in the flows that are best: one more as long as that helps."""
        best, flows = self._best_in(budget, self.present), self.present
        while True:
            others = [flows | {one} for one in self.wide.case.experiments if one not in flows]
            sets = in_threads(self._best_in, [(budget, more) for more in others])
            found, more = max(zip(sets, others, strict=True), key=lambda one: self.worth(one[0]), default=(best, flows))
            if self.worth(found) <= self.worth(best) + LEAST_PLAN_GAIN:
                break
            best, flows = found, more
        before = self.worth(best)
        for _ in range(EXCHANGES):  # each piece in turn left out, and its hours filled, while that helps
            helped = False
            for j in best:
                again = self._filled(budget, [k for k in best if k != j], flows)
                if j in best and (now := self.worth(again)) > before + LEAST_PLAN_GAIN:
                    best, before, helped = again, now, True
            if not helped:
                break
        return best

    def _best_in(self, budget: float, flows: Flows[str]) -> list[int]:
        """Pieces in some flows by gain per hour, from nothing, or from the best equally spaced transects that fit."""
        spaced = max(self.equally_spaced(budget, flows), key=self.worth, default=[])
        return max(in_threads(self._filled, [(budget, some, flows) for some in ([], spaced)]), key=self.worth)

    def equally_spaced(self, budget: float, flows: Flows[str]) -> list[list[int]]:
        """Transects at places of equal distance, with a gauge at each, in all of some flows; all that fit."""
        pieces, (low, high) = self.wide.pieces, self.wide.case.grid.x
        # Of a transect and the same with every second vertical the whole one, which stands first.
        there = {one.place: j for j, one in reversed(list(enumerate(pieces)))
                 if one.work in (Work.TRANSECT, Work.GAUGE) and one.experiment in flows and not one.new}  # fmt: skip
        places = np.unique([pieces[j].x for j in there.values() if pieces[j].work is Work.TRANSECT])
        found = []
        for count in range(1, len(places) + 1):
            x = {float(places[np.abs(places - to).argmin()]) for to in np.linspace(low, high, count + 2)[1:-1]}
            some = [j for j in there.values() if pieces[j].x in x]
            if self._left(budget, some, flows) < 0.0:
                break
            found.append(some)
        return found

    def _left(self, budget: float, pieces: Sequence[int], flows: Flows[str]) -> float:
        """Hours that are left of a budget in some flows, all of them measured in."""
        further = len(flows - self.present) - (0 if self.present else 1)
        return budget - self.another * max(further, 0) - sum(self.wide.pieces[j].hours for j in pieces) + 1e-9

    def _filled(self, budget: float, chosen: list[int], flows: Flows[str]) -> list[int]:
        """More pieces in some flows, or of none, by gain per hour."""
        pieces, left = self.wide.pieces, self._left(budget, chosen, flows)
        # a flow that the case does not have cannot be ordered: it is shown, and not planned.
        possible = [j for j, one in enumerate(pieces) if one.hours <= left and not one.new
                    and one.experiment in {*flows, ""}]  # fmt: skip
        kept = np.unique(self.rows_of(possible))
        rows = {j: np.searchsorted(kept, self.wide.rows[j]) for j in possible}
        known = self.base.made(self.rows_of(chosen), kept)
        while True:
            left, taken = self._left(budget, chosen, flows), {pieces[j].place for j in chosen}
            possible = [j for j in possible if pieces[j].hours <= left and pieces[j].place not in taken]
            if not possible:
                return chosen
            now = float(self.criterion.worths(known.squares))
            gain = self.criterion.worths(_with_each(known, [rows[j] for j in possible])) - now
            rate = gain / np.array([pieces[j].hours for j in possible])
            best = possible[int(np.argmax(rate))]
            if rate.max() <= LEAST_PLAN_GAIN / budget:
                return chosen
            chosen, known = [*chosen, best], known.made(rows[best])


def _with_each(known: PossibleMeasurements, rows: Sequence[np.ndarray]) -> Array:
    """Squares of lengths with the measurements of one of some rows made (draw, move, c)."""
    found = np.empty((len(known.squares), len(rows), known.squares.shape[1]))
    for number in sorted({some.size for some in rows}):
        which = [k for k, some in enumerate(rows) if some.size == number]
        found[:, which] = known.with_each(np.array([rows[k] for k in which]))
    return found


def plan_search(
    wide: PlanModel, question: PlanQuestion, planned: Planned, level: float, present: frozenset[str], beyond: Array
) -> PlanSearch:
    """The search for pieces to add to the stations of the plan.

    Parameters
    ----------
    level : float
        ln of the sum of Bayes factors at which anything is named [-].
    present : frozenset of str
        Experiments that are measured in anyhow.
    beyond : ndarray (candidates,)
        By how much the score of each has to be above that of the level [standard errors].
    """
    match question:
        case OneEffect():
            names = [question.name]
        case TwoEffects():
            names = [question.first, question.second]
        case EffectsInGeneral():  # those of a section or a device are others with each piece
            names = [one.name for one in wide.candidates if not (one.sections or one.devices)]
    kept = [j for j, one in enumerate(wide.candidates) if one.name in names]
    amplitudes = tuple(wide.candidates[j].amplitude for j in kept)
    bending = bending_of(wide)[kept]
    gains = np.array([one.plausible_gain for one in amplitudes]) / (1.0 + bending)
    traces = np.array([draw.values[:, kept] * gains for draw in wide.draws])
    if isinstance(question, TwoEffects):
        traces = np.concatenate([traces, traces.sum(axis=2, keepdims=True)], axis=2)
    variances, each = zip(*wide.errors, strict=True)
    most = max(one.shape[1] for one in each)
    nuisances = np.array([np.pad(one, ((0, 0), (0, most - one.shape[1]))) for one in each])
    none = possible_measurements(np.array(variances), nuisances, traces)
    return PlanSearch(
        wide=wide,
        criterion=DesignCriterion(question, len(wide.candidates), level, amplitudes, beyond[kept], bending),
        present=present,
        another=planned.costs.discharge,
        base=none.made(np.concatenate([wide.known, wide.surveyed])),
    )
