"""How often a diagnosis of planned measurements would name an effect, and the search for pieces of field work to add:
by gain per hour, exchanged one by one while that helps (Fedorov 1972; not checked against it).
"""

from collections.abc import Sequence, Set
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy.special import logsumexp

from vegglue.arrays import Array, Mask, Single
from vegglue.calibration.detection import (
    PLANNED_POWER,
    Information,
    chance_over_prior,
    chance_to_separate,
    detection_chance,
    information,
    single_threshold,
    trace_distances,
)
from vegglue.calibration.residual_screening import GROUPS
from vegglue.calibration.score_test import HypothesisKind, Projected, prior_shrinkage, with_more_rows
from vegglue.case.schema import Planned
from vegglue.decision_constants import constants
from vegglue.diagnosis.competition import tempering
from vegglue.diagnosis.plan_model import DRAWS_AROUND, PlanModel, bending_of, errors_at, place_along
from vegglue.effects.definition import Amplitude
from vegglue.measurements.kinds import STREAMWISE
from vegglue.measurements.observations import section_places
from vegglue.parallel import in_threads
from vegglue.results.plan import EffectsInGeneral, OneEffect, PlanQuestion, ProposedPieces, TwoEffects, Work, hours_of

# Lengths l at which the chance to be named is computed [standard errors]; between them it is linear, from 0 at 0.
NAMED_AT = np.array([0.0, 2.0, 3.0, 4.0, 4.75, 5.5, 6.5, 8.0, 11.0, 16.0, 24.0])
# Draws of errors alone for each: a chance of 90 % is known to 2 %.
NAMED_DRAWS = 192
# |cosine| with a trace below which a spot or an instrument keeps the evidence that it has under errors alone [-].
UNLIKE = 0.3


@dataclass(frozen=True)
class FirstCompetition:
    """Hypotheses, first those of listed effects, then one of each other kind; of each column k: its owner among them,
    only_sign, ln evidence = constant + factor T^2, units (rows, k), and scores T under errors alone (draws, k);
    places: which of the other kinds are places; alike (effects, effects); level: of the alarm.
    """

    effects: int
    places: Mask
    alike: Mask
    level: float
    owner: np.ndarray
    only_sign: np.ndarray
    constant: Single
    factor: Single
    units: Single
    scores: Single

    def named(self, effect: int, truths: Projected) -> Array:
        """Chance that an effect is named at each of NAMED_AT (lengths,), over its truths (rows, t) in turn."""
        draw = np.arange(len(self.scores))
        cosine = self.units.T @ truths.units.astype(np.float32)
        truth = draw % cosine.shape[1]
        own = self.only_sign[self.owner == effect]
        sign = float(own[0]) if own.any() else np.where((draw // cosine.shape[1]) % 2 == 0, 1.0, -1.0)
        near = (self.owner < self.effects) | (np.abs(cosine).max(axis=1) > UNLIKE)
        quiet = np.exp(self._evidence(self.scores[:, ~near], ~near))
        of_quiet = np.zeros((draw.size, self.effects + self.places.size))
        _add_by_owner(of_quiet, quiet, self.owner[~near])
        scores, shift = self.scores[:, near], (cosine[near][:, truth] * sign).T.astype(np.float32)
        chances = [0.0]
        for length in NAMED_AT[1:]:
            evidence = self._evidence(scores + np.float32(length) * shift, near)
            most = evidence.max(axis=1)[:, None]
            evidence -= most
            found = of_quiet * np.exp(-most.astype(float))
            _add_by_owner(found, np.exp(evidence, out=evidence), self.owner[near])
            chances.append(self._named(np.log(np.maximum(found, 1e-300)) + most, effect))
        return np.array(chances)

    def _evidence(self, scores: Single, columns: Mask) -> Single:
        """ln evidence of some columns (draws, k), in the memory of their scores."""
        sign = self.only_sign[columns]
        scores[:, sign > 0] = np.maximum(scores[:, sign > 0], 0.0)
        scores[:, sign < 0] = np.minimum(scores[:, sign < 0], 0.0)
        scores *= scores
        scores *= self.factor[columns]
        scores += self.constant[columns]
        return scores

    def _named(self, evidence: Array, effect: int) -> float:
        """Share of the draws in which an effect is named, of ln evidence (draws, hypotheses)."""
        chance = np.exp((evidence - evidence.max(axis=1)[:, None]) / tempering(evidence))
        chance /= chance.sum(axis=1)[:, None]
        listed, others = chance[:, : self.effects], evidence[:, self.effects :]
        best = evidence[:, : self.effects].max(axis=1)
        of_places = others[:, self.places].max(axis=1, initial=-np.inf)
        of_instruments = others[:, ~self.places].max(axis=1, initial=-np.inf)
        taken = (of_places - best) / tempering(of_places) < np.log(constants().known_first_odds)
        taken &= (best >= of_instruments) & (logsumexp(evidence, axis=1) >= self.level)
        # The groups that are likelier than its own hold less than set_chance.
        groups = listed @ self.alike
        likelier = (groups > groups[:, effect][:, None]) & ~self.alike[effect]
        inside = (listed * likelier).sum(axis=1) < constants().set_chance * listed.sum(axis=1)
        inside &= listed[:, effect] >= constants().rival_share * chance.max(axis=1)
        return float(np.mean(taken & inside))


def _add_by_owner(sums: Array, values: Single, owner: np.ndarray) -> None:
    """Add columns of values (draws, k) to the sums of their owners (draws, hypotheses); owners are in order."""
    if owner.size:
        some, first = np.unique(owner, return_index=True)
        sums[:, some] += np.add.reduceat(values, first, axis=1)


def first_competition(
    kinds: Sequence[HypothesisKind], columns: Sequence[np.ndarray], places: Sequence[str], errors: Array, level: float
) -> FirstCompetition:
    """The first competition of a diagnosis before there is a residual: how often an effect is named that is in it.

        T_k = l c_k + e_k,   c_k = U_k' S_perp / |S_perp|

    T_k are the scores of all hypotheses (`score_test`) if an effect with the trace S, l standard errors long, and
    errors alone make the residual; e_k are the scores of errors alone. The diagnosis is alarmed if the sum of all Bayes
    factors is above its level. Of the tempered chances of `competition` it then takes what is likeliest, an effect
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

    Returns
    -------
    FirstCompetition
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
        only_sign=np.concatenate([one.only_sign for one in kinds]),
        constant=np.concatenate([one.of_scores(np.zeros(one.size.size)) for one in kinds]).astype(np.float32),
        factor=(0.5 * prior_shrinkage(size)).astype(np.float32),
        units=units,
        scores=with_more_rows(errors[:NAMED_DRAWS], len(units), 2) @ units,
    )


def chances_named(competition: FirstCompetition, truths: Sequence[Projected]) -> Array:
    """`FirstCompetition.named` of each listed effect (effect, lengths)."""
    return np.array(in_threads(competition.named, list(enumerate(truths))))


# Proposals of one kind that are shown, and of all; those that are looked at again in a search, and rounds of exchange.
OF_A_KIND, ADDITIONS_SHOWN, ADDITIONS_WEIGHED, ADDING_ROUNDS = 2, 8, 12, 2
# Rise of the answer to a question below which a piece adds nothing [-].
LEAST_PLAN_GAIN = 1e-3
# Places of the prior over which the answer is averaged: the middle, and others around it. Chosen: each costs a third.
DRAWS_SEARCHED = 3


@dataclass(frozen=True)
class PlanAnswer:
    """The answer to a question [-], the mean over all draws and the least of them."""

    mean: float
    least: float


@dataclass(frozen=True)
class PlanSearch:
    """What the search for pieces to add knows: the information of the plan and of each piece at each draw, and of the
    effects that the question is about their names and amplitudes; present: flows that are measured in anyhow; another:
    hours of another one; level: of the alarm; beyond: by how much the score of each has to be above that of the alarm
    to be named [standard errors]; bending (k,), see `bending_of`.
    """

    wide: PlanModel
    question: PlanQuestion
    level: float
    present: frozenset[str]
    another: float
    names: tuple[str, ...]
    amplitudes: tuple[Amplitude, ...]
    beyond: Array
    bending: Array
    base: tuple[Information, ...]
    of_pieces: tuple[tuple[Information, ...], ...]

    @cached_property
    def start(self) -> PlanAnswer:
        """The answer without a further piece."""
        return self.answer(self.base)

    @cached_property
    def sections(self) -> frozenset[float]:
        """Where velocities are measured or planned along the reach, see `place_along`."""
        known = self.wide.model.station.iloc[self.wide.known]
        velocity = known[known["kind"] == STREAMWISE]
        return frozenset(place_along(self.wide.model.case, x) for x in section_places(velocity).unique())

    def answer(self, known: Sequence[Information]) -> PlanAnswer:
        """The answer to the question with some information at each draw [-]."""
        found = np.array([self._answer(one) for one in known])
        return PlanAnswer(float(found.mean()), float(found.min()))

    def _answer(self, known: Information) -> float:
        if isinstance(self.question, TwoEffects):
            distance = trace_distances(known.visible())
            return float(chance_to_separate(min(distance[0, 1], distance[1, 0])))
        size = known.lengths()
        threshold = self._threshold(size)
        if isinstance(self.question, OneEffect):
            amplitude = self.amplitudes[0]
            relative = self._bent(np.array([abs(amplitude.gain(self.question.size)) / amplitude.plausible_gain]))
            return float(detection_chance(relative * size, threshold, amplitude.only_sign)[0])
        return float(chance_over_prior(size, threshold).sum())

    def _threshold(self, size: Array) -> Array:
        prior = np.full(size.size, -np.log(GROUPS * len(self.wide.candidates)))
        return single_threshold(size, prior, self.level) + self.beyond

    def _bent(self, relative: Array) -> Array:
        """Length of a trace over that at a plausible size, of gains over those of plausible sizes (k,)."""
        return np.asarray(relative * (1.0 + self.bending) / (1.0 + self.bending * relative))

    @cached_property
    def _twice(self) -> Array:
        """Length of a trace at twice a plausible size, or at the furthest, over that at a plausible one (k,)."""
        sizes = [min(2.0 * one.scale, one.furthest) / one.scale for one in self.amplitudes]
        return self._bent(np.array([size**one.power for size, one in zip(sizes, self.amplitudes, strict=True)]))

    def worth(self, known: Sequence[Information]) -> float:
        """What is maximised: the answer, and of all effects also the expected number that is named at twice a plausible
        size, each up to PLANNED_POWER, from which it counts as testable.
        """
        answer = self.answer(known).mean
        if not isinstance(self.question, EffectsInGeneral):
            return answer
        chances = [
            detection_chance(self._twice * size, self._threshold(size)) for size in (one.lengths() for one in known)
        ]
        return answer + float(np.minimum(np.mean(chances, axis=0), PLANNED_POWER).sum())

    def with_pieces(self, known: Sequence[Information], pieces: Sequence[int]) -> list[Information]:
        """The information with some pieces more, at each draw."""
        found = list(known)
        for d, of in enumerate(self.of_pieces):
            for j in pieces:
                found[d] = found[d] + of[j]
        return found

    def hours(self, pieces: Sequence[int], present: frozenset[str]) -> float:
        """Of some pieces together, beside flows that are measured in anyhow."""
        return hours_of([self.wide.pieces[j] for j in pieces], self.another, present)

    def moves(self, chosen: Sequence[int]) -> list[tuple[int, ...]]:
        """What could be added at once: each piece, and for each flow without measurements the places of the others."""
        pieces = self.wide.pieces
        taken = {pieces[j].place for j in chosen}
        free = [j for j, one in enumerate(pieces) if one.place not in taken]
        found: list[tuple[int, ...]] = [(j,) for j in free]
        present = self.present | {pieces[j].experiment for j in chosen}
        case = self.wide.model.case
        there = self.sections | {place_along(case, pieces[j].x) for j in chosen if pieces[j].work is Work.TRANSECT}
        for flow in case.experiments:
            if flow in present:
                continue
            together = [
                j for j in free if pieces[j].experiment == flow and pieces[j].work is Work.TRANSECT
                and place_along(case, pieces[j].x) in there
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
        for move in self.moves(()):
            known = self.with_pieces(self.base, move)
            after = self.answer(known)
            if any(self.wide.pieces[j].new for j in move):  # known at the first draw alone
                gain = self.answer(known[:1]).mean - self.answer(self.base[:1]).mean
                after = PlanAnswer(self.start.mean + gain, self.start.least)
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
        return self._proposed(chosen, self.answer(self.with_pieces(self.base, chosen))) if chosen else None

    def best_set(self, budget: float) -> list[int]:
        """Pieces that fit a budget [h]: greedy by gain for an hour, in any flows and in each flow alone, of which the
        best is exchanged piece by piece while that helps.
        """

        def worth(pieces: Sequence[int]) -> float:
            return self.worth(self.with_pieces(self.base, pieces))

        flows = [one for one in self.wide.model.case.experiments if one not in self.present]
        starts = [None, *({*self.present, one} for one in flows if len(flows) > 1)]
        best = max((self._greedy(budget, [], start) for start in starts), key=worth)
        before = worth(best)
        for _ in range(ADDING_ROUNDS):
            for j in list(best):
                again = self._greedy(budget, [k for k in best if k != j])
                if (now := worth(again)) > before + LEAST_PLAN_GAIN:
                    best, before = again, now
                    break
            else:
                break
        return best

    def _greedy(self, budget: float, chosen: list[int], flows: Set[str] | None = None) -> list[int]:
        """flows: in which alone work is done, beside that which is of no flow; None for all."""
        known = self.with_pieces(self.base, chosen)
        now = self.worth(known)
        promised: dict[tuple[int, ...], float] = {}
        while True:
            spent = self.hours(chosen, self.present)
            # A flow that the case does not have cannot be ordered: it is shown, and not planned.
            moves = [move for move in self.moves(chosen) if not any(self.wide.pieces[j].new for j in move)]
            if flows is not None:
                allowed = {*flows, ""}
                moves = [move for move in moves if all(self.wide.pieces[j].experiment in allowed for j in move)]
            possible = {move: self.hours([*chosen, *move], self.present) - spent for move in moves}
            possible = {move: hours for move, hours in possible.items() if spent + hours <= budget + 1e-9}
            # What a piece adds hardly ever grows: those that added less before are looked at last (lazy greedy).
            order = sorted(possible, key=lambda move: -promised.get(move, np.inf) / possible[move])
            best, best_rate = None, LEAST_PLAN_GAIN / budget
            for looked, move in enumerate(order):
                if move in promised and (promised[move] / possible[move] <= best_rate or looked >= ADDITIONS_WEIGHED):
                    break
                promised[move] = self.worth(self.with_pieces(known, move)) - now
                if promised[move] / possible[move] > best_rate:
                    best, best_rate = move, promised[move] / possible[move]
            if best is None:
                return chosen
            chosen = [*chosen, *best]
            known = self.with_pieces(known, best)
            now = self.worth(known)


def plan_search(
    wide: PlanModel, question: PlanQuestion, planned: Planned, level: float, present: frozenset[str], beyond: Array
) -> PlanSearch:
    """The search for pieces to add to the stations of the plan; beyond: of each candidate, see `PlanSearch`."""
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
    base, pieces = [], []
    for draw in wide.draws[:: DRAWS_AROUND // 2][:DRAWS_SEARCHED]:
        variance, nuisances = errors_at(wide, draw, np.arange(wide.error.size))
        of_rows = partial(information, variance, nuisances, draw.values[:, kept] * gains)
        base.append(of_rows(np.concatenate([wide.known, wide.surveyed])))
        pieces.append(tuple(of_rows(rows) for rows in wide.rows))
    return PlanSearch(
        wide=wide,
        question=question,
        level=level,
        present=present,
        another=planned.costs.discharge,
        names=tuple(wide.candidates[j].name for j in kept),
        amplitudes=amplitudes,
        beyond=beyond[kept],
        bending=bending,
        base=tuple(base),
        of_pieces=tuple(pieces),
    )
