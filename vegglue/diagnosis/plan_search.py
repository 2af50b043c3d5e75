"""The search for pieces of field work to add to a plan: by gain per hour, exchanged one by one while that helps
(Fedorov 1972; not checked against it).
"""

from collections.abc import Sequence, Set
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.detection import (
    Information,
    chance_over_prior,
    chance_to_separate,
    detection_chance,
    information,
    own_and_shared,
    single_threshold,
    trace_distances,
)
from vegglue.calibration.residual_screening import GROUPS
from vegglue.case.schema import (
    Planned,
)
from vegglue.decision_constants import constants
from vegglue.diagnosis.plan_model import PlanModel, place_along
from vegglue.effects.definition import Amplitude
from vegglue.measurements.kinds import STREAMWISE
from vegglue.measurements.observations import section_places
from vegglue.results.plan import (
    EffectsInGeneral,
    OneEffect,
    PlanQuestion,
    ProposedPieces,
    TwoEffects,
    Work,
    hours_of,
)

# Proposals of one kind that are shown, and of all; those that are looked at again in a search, and rounds of exchange.
OF_A_KIND, ADDITIONS_SHOWN, ADDITIONS_WEIGHED, ADDING_ROUNDS = 2, 8, 12, 2
# Rise of the answer to a question below which a piece adds nothing [-].
LEAST_PLAN_GAIN = 1e-3


@dataclass(frozen=True)
class PlanAnswer:
    """The answer to a question [-], the mean over all draws and the least of them."""

    mean: float
    least: float


@dataclass(frozen=True)
class PlanSearch:
    """What the search for pieces to add knows: the information of the plan and of each piece at each draw, and of the
    traces that the question is about their effects by number, names, amplitudes and ln priors; present: flows that are
    measured in anyhow; another: hours of another one; level: of the alarm.
    """

    wide: PlanModel
    question: PlanQuestion
    level: float
    present: frozenset[str]
    another: float
    names: tuple[str, ...]
    amplitudes: tuple[Amplitude, ...]
    owner: np.ndarray
    signs: np.ndarray
    log_prior: Array
    base: tuple[Information, ...]
    of_pieces: tuple[tuple[Information, ...], ...]

    @cached_property
    def start(self) -> PlanAnswer:
        """The answer without a further piece."""
        return self.answer(self.base)

    @cached_property
    def sections(self) -> frozenset[float]:
        """Where velocities are measured or planned along the reach, see `place_along`."""
        known = self.wide.model.station.iloc[: self.wide.count]
        velocity = known[known["kind"] == STREAMWISE]
        return frozenset(place_along(self.wide.model.case, x) for x in section_places(velocity).unique())

    def answer(self, known: Sequence[Information]) -> PlanAnswer:
        """The answer to the question with some information at each draw [-]."""
        found = np.array([self._answer(one) for one in known])
        return PlanAnswer(float(found.mean()), float(found.min()))

    def _answer(self, known: Information) -> float:
        if isinstance(self.question, TwoEffects):
            visible = known.visible()
            distance = trace_distances(visible)
            first, second = (np.flatnonzero(self.owner == self.names.index(name)) for name in
                             (self.question.first, self.question.second))  # fmt: skip
            return float(chance_to_separate(np.minimum(distance, distance.T)[np.ix_(first, second)].min()))
        size = known.lengths()
        threshold = single_threshold(size, self.log_prior, self.level)
        if isinstance(self.question, OneEffect):
            amplitude = self.amplitudes[0]
            relative = abs(amplitude.gain(self.question.size)) / amplitude.plausible_gain
            return float(detection_chance(relative * size, threshold, self.signs).mean())
        chance = chance_over_prior(size, threshold)
        return float((np.bincount(self.owner, chance) / np.bincount(self.owner)).sum())

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
            return self.answer(self.with_pieces(self.base, pieces)).mean

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
        now = self.answer(known).mean
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
                promised[move] = self.answer(self.with_pieces(known, move)).mean - now
                if promised[move] / possible[move] > best_rate:
                    best, best_rate = move, promised[move] / possible[move]
            if best is None:
                return chosen
            chosen = [*chosen, *best]
            known = self.with_pieces(known, best)
            now = self.answer(known).mean


def plan_search(
    wide: PlanModel, question: PlanQuestion, planned: Planned, level: float, present: frozenset[str]
) -> PlanSearch:
    """The search for pieces to add to the stations of the plan."""
    match question:
        case OneEffect():
            kept = [j for j, one in enumerate(wide.candidates) if one.name == question.name]
        case TwoEffects():
            kept = [j for j, one in enumerate(wide.candidates) if one.name in (question.first, question.second)]
        case EffectsInGeneral():  # those of a section or a device are others with each piece
            kept = [j for j, one in enumerate(wide.candidates) if not (one.sections or one.devices)]
    candidates = [wide.candidates[j] for j in kept]
    ends = np.cumsum([0, *(len(one.settings()) for one in wide.candidates)])
    counts = [len(one.settings()) for one in candidates]
    columns = np.concatenate([np.arange(ends[j], ends[j + 1]) for j in kept])
    gains = np.repeat([one.amplitude.plausible_gain for one in candidates], counts)
    of_pieces = np.concatenate([np.zeros(0, dtype=int), *wide.rows])
    own = np.setdiff1d(np.arange(wide.error.size), of_pieces)
    correlation = constants().grid_error_correlation
    base, pieces = [], []
    for draw in wide.draws:
        shared = np.column_stack([np.sqrt(correlation) * wide.grid_error, draw.shared])
        variance, patterns = own_and_shared(wide.error**2 + (1.0 - correlation) * wide.grid_error**2, shared)
        nuisances, traces = np.hstack([draw.slope, patterns]), draw.values[:, columns] * gains
        base.append(information(variance, nuisances, traces, own))
        pieces.append(tuple(information(variance, nuisances, traces, rows) for rows in wide.rows))
    return PlanSearch(
        wide=wide,
        question=question,
        level=level,
        present=present,
        another=planned.costs.discharge,
        names=tuple(one.name for one in candidates),
        amplitudes=tuple(one.amplitude for one in candidates),
        owner=np.repeat(np.arange(len(candidates)), counts),
        signs=np.repeat([one.amplitude.only_sign for one in candidates], counts),
        log_prior=np.full(columns.size, -np.log(GROUPS * len(wide.candidates))),
        base=tuple(base),
        of_pieces=tuple(pieces),
    )
