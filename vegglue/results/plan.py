"""What planned measurements would show, as `vegglue plan` reports and stores it; the words stand in
wording/templates/plan.j2.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

from vegglue.wording.sentences import lines_of, tagged


class Work(Enum):
    """Kinds of field work."""

    TRANSECT = "transect"
    POINT = "point"
    GAUGE = "gauge"
    DISCHARGE = "discharge"
    SURVEY_LINE = "survey line"


@dataclass(frozen=True)
class PlannedPiece:
    """A piece of field work: verticals of a transect, a vertical, a gauge or a gauging in one experiment, or a line of
    bed levels, which is of all (experiment '').

    x, y: its places [m], y empty for a gauging; hours: without those of another flow. new: whether the experiment is a
    flow that the case does not have; again: whether the same is measured before.
    """

    work: Work
    experiment: str
    x: float
    y: tuple[float, ...]
    hours: float
    new: bool = False
    again: bool = False

    @property
    def place(self) -> tuple[Work, str, float, tuple[float, ...]]:
        """What is planned once only: of transects at one x, however dense their verticals are, one."""
        return self.work, self.experiment, self.x, () if self.work is Work.TRANSECT else self.y[:1]


@dataclass(frozen=True)
class Confusion:
    """Another explanation that leaves a similar trace, and the cosine between both after calibration [-]."""

    name: str
    cosine: float


@dataclass(frozen=True)
class PlannedEffect:
    """An effect as the planned measurements would show it.

    Named means that the first step of a diagnosis has it, alone or as one of a few. smallest: distance of its amplitude
    from off that is named with 90 %, averaged over all draws of the priors [unit of the amplitude], infinite if no size
    is; best, worst: the same in the draws where it is least and largest. plausible: a plausible distance; furthest: the
    largest possible one. chance_plausible: that the plausible size is named; chance: that a size drawn from the prior
    of the amplitude is. visibility: share of the trace that calibration cannot mimic. confused: other effects with a
    similar trace, the most similar first; place: the term at a place that is; parameter, cosine: the parameter whose
    change is most like it.
    """

    name: str
    title: str
    unit: str
    smallest: float
    best: float
    worst: float
    plausible: float
    furthest: float
    chance_plausible: float
    chance: float
    visibility: float
    confused: tuple[Confusion, ...]
    place: Confusion | None
    parameter: str
    cosine: float

    @property
    def testable(self) -> bool:
        """Whether twice a plausible size is possible and is named with 90 %; a diagnosis requires an alarm in 95 %."""
        return self.smallest < min(2.0 * self.plausible, self.furthest)

    @property
    def seen(self) -> bool:
        """Whether a plausible size is named with 90 %."""
        return self.smallest <= min(self.plausible, self.furthest)

    @property
    def hidden(self) -> bool:
        """Whether a plausible size is named with 10 % at most."""
        return self.chance_plausible <= 0.1


@dataclass(frozen=True)
class PlannedPlaces:
    """Something unlisted at a place that changes a term: how large a plausible one is [unit], the share of the places
    under water where that is detected with 90 %, and the size that is at half of them.
    """

    term: str
    unit: str
    plausible: float
    places: int
    share: float
    smallest: float


@dataclass(frozen=True)
class PlaceChances:
    """Chance that drag of a plausible size is detected at each place x, y [m], (place,) each, of half length and half
    width of one spot [m].
    """

    x: tuple[float, ...]
    y: tuple[float, ...]
    chance: tuple[float, ...]
    length: float
    width: float


@dataclass(frozen=True)
class PlannedInstruments:
    """Instruments of one kind: how many, the offset that is detected with 90 % in half of them, and a plausible
    one, both over the standard error of a reading [-].
    """

    instrument: str
    count: int
    smallest: float
    plausible: float


@dataclass(frozen=True)
class PlannedParameter:
    """How well a parameter would be known: standard error over that of its prior [-], the mean over all draws, and 95 %
    intervals before and after around the middle of the prior [unit].
    """

    name: str
    unit: str
    meaning: str
    share: float
    before: tuple[float, float]
    after: tuple[float, float]


@dataclass(frozen=True)
class EffectsInGeneral:
    """The question of all effects: how many are expected to be named, of sizes drawn from their priors."""

    count: int


@dataclass(frozen=True)
class OneEffect:
    """The question of one effect of a size [unit of its amplitude]: the chance that it is named."""

    name: str
    size: float
    unit: str


@dataclass(frozen=True)
class TwoEffects:
    """The question which of two effects of plausible size it is: the chance that the true one is likelier."""

    first: str
    second: str


PlanQuestion = EffectsInGeneral | OneEffect | TwoEffects


@dataclass(frozen=True)
class ProposedPieces:
    """Pieces that could be added together, as one more discharge takes more than one; hours with those of another flow,
    and the answer to the question before and after [-], the mean over all draws, with the least of them.
    """

    pieces: tuple[PlannedPiece, ...]
    hours: float
    before: float
    after: float
    least: float

    @property
    def per_hour(self) -> float:
        """What it adds in an hour [1/h]."""
        return (self.after - self.before) / self.hours


@dataclass(frozen=True, repr=False)
class FieldPlan:
    """What planned measurements would show, and which ones to add.

    at_hand: stations measured before; proposed: whether the pieces are proposed for a budget of hours, as none were
    planned. draws: places of the prior that all is computed at. answer: to the question now; further: the best
    single additions, the largest gain per hour first; extended: the best set for the hours that are left, and its
    answer.
    """

    case: str
    pieces: tuple[PlannedPiece, ...]
    at_hand: int
    proposed: bool
    hours: float
    budget: float
    draws: int
    effects: tuple[PlannedEffect, ...]
    places: tuple[PlannedPlaces, ...]
    instruments: tuple[PlannedInstruments, ...]
    parameters: tuple[PlannedParameter, ...]
    question: PlanQuestion
    answer: float
    further: tuple[ProposedPieces, ...]
    extended: ProposedPieces | None
    chances_of_places: PlaceChances | None = None

    def __repr__(self) -> str:
        return "\n".join(lines_of(self))

    @property
    def testable(self) -> tuple[PlannedEffect, ...]:
        """Effects that are named at twice a plausible size."""
        return tuple(one for one in self.effects if one.testable)


def hours_of(pieces: Sequence[PlannedPiece], another_flow: float, present: frozenset[str] = frozenset()) -> float:
    """Hours of some pieces together, with those of each flow beside the first; present: flows that are measured in
    anyhow.
    """
    flows = {one.experiment for one in pieces if one.experiment} - present
    free = 0 if present else 1
    return math.fsum(one.hours for one in pieces) + another_flow * max(len(flows) - free, 0)


def plan_json(plan: FieldPlan) -> dict[str, Any]:
    """A plan as the object that `vegglue plan --json` prints and plan.json keeps: docs/plan.md lists its keys.

    A size that is never named is null.
    """

    def piece(one: PlannedPiece) -> dict[str, Any]:
        return {
            "work": one.work.value, "experiment": one.experiment or None, "x": one.x, "y": list(one.y),
            "hours": one.hours, "new_flow": one.new, "again": one.again,
        }  # fmt: skip

    def proposed(one: ProposedPieces) -> dict[str, Any]:
        return {
            "pieces": list(map(piece, one.pieces)), "hours": one.hours, "before": one.before, "after": one.after,
            "least": one.least, "gain_per_hour": one.per_hour,
        }  # fmt: skip

    def effect(one: PlannedEffect) -> dict[str, Any]:
        return {
            "name": one.name, "unit": one.unit, "smallest": one.smallest, "best": one.best, "worst": one.worst,
            "plausible": one.plausible, "furthest": one.furthest, "chance_plausible": one.chance_plausible,
            "chance": one.chance, "testable": one.testable, "seen": one.seen, "hidden": one.hidden,
            "visibility": one.visibility, "confused": {other.name: other.cosine for other in one.confused},
            "place": None if one.place is None else {one.place.name: one.place.cosine},
            "parameter": one.parameter, "cosine": one.cosine,
        }  # fmt: skip

    return {
        "case": plan.case, "hours": plan.hours, "budget": plan.budget, "proposed": plan.proposed,
        "at_hand": plan.at_hand, "draws": plan.draws, "pieces": list(map(piece, plan.pieces)),
        "effects": list(map(effect, plan.effects)), "places": [vars(one) for one in plan.places],
        "instruments": [vars(one) for one in plan.instruments],
        "parameters": {one.name: {key: value for key, value in vars(one).items() if key != "name"}
                       for one in plan.parameters},
        "question": tagged(plan.question), "answer": plan.answer, "further": list(map(proposed, plan.further)),
        "extended": None if plan.extended is None else proposed(plan.extended),
    }  # fmt: skip
