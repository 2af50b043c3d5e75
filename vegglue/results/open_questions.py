"""What is still to be separated, and the measurements that could, as `vegglue next` reports and stores it.

The words stand in wording/templates/questions.j2.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import TypeAdapter

from vegglue.wording.sentences import phrase, sentence, tag_of

# Below this D^2 a measurement does not separate anything.
SEPARATES = 4.0
# Measurements shown of each question: more than these cannot be planned in one season.
SHOWN = 4
# A measurement that raises D^2 by less than a tenth adds nothing.
ADDS = 1.1


@dataclass(frozen=True)
class RivalEffects:
    """Effects, laws or places to separate from each other."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class OneOfRivals:
    """One of several rivals to separate from all others."""

    name: str
    others: tuple[str, ...]


@dataclass(frozen=True)
class HiddenEffect:
    """An effect to separate from a change of the parameter that leaves its trace."""

    name: str
    parameter: str


@dataclass(frozen=True)
class HiddenLaw:
    """A law to separate from what calibration absorbs."""

    name: str


Subject = RivalEffects | OneOfRivals | HiddenEffect | HiddenLaw
SUBJECTS: Mapping[str, type] = {tag_of(one): one for one in get_args(Subject)}


@dataclass(frozen=True)
class ProposedMeasurement:
    """A measurement that could separate rivals.

    Attributes
    ----------
    name
        In words.
    experiment, x, stations
        In which experiment, at which place [m], and how many.
    hours
        Field work [h].
    now, then
        Squared standard errors D^2 between the nearest rivals, now and with it [-].
    """

    name: str
    experiment: str
    x: float
    stations: int
    hours: float
    now: float
    then: float

    @property
    def per_hour(self) -> float:
        """What it adds to D^2 for each hour of field work [1/h]."""
        return (self.then - self.now) / self.hours


@dataclass(frozen=True)
class Question:
    """What to separate, and the measurements that could.

    Attributes
    ----------
    about
        The rivals.
    measurements : tuple of ProposedMeasurement
        By what they add in an hour.
    seen_from
        D^2 from which a diagnosis detects it 19 times of 20 [-]; infinite if that depends on no size.
    """

    about: Subject
    measurements: tuple[ProposedMeasurement, ...]
    seen_from: float = math.inf

    @property
    def tells_apart(self) -> str:
        """What is to be separated, in words."""
        return sentence(self.about)

    @property
    def answered(self) -> bool:
        """Whether the data at hand would have shown it."""
        return any(one.now >= self.seen_from for one in self.measurements)

    @property
    def useful(self) -> tuple[ProposedMeasurement, ...]:
        """Those that would separate it by themselves, the few best ones; none if it is answered."""
        if self.answered:
            return ()
        enough = (one for one in self.measurements if one.then >= SEPARATES and one.then > ADDS * one.now)
        return tuple(enough)[:SHOWN]

    @property
    def nearest(self) -> ProposedMeasurement | None:
        """The measurement that comes nearest to it, if there is any."""
        return max(self.measurements, key=lambda one: one.then, default=None)

    def __repr__(self) -> str:
        return "\n".join([sentence(self), *(f"- {phrase('proposed_measurement', one)}" for one in self.useful)])


def questions_from(tree: Sequence[Mapping[str, Any]]) -> tuple[Question, ...]:
    """The questions of a list of JSON, null for a size that is never seen.

    Errors: KeyError, TypeError or ValueError where it is none.
    """
    return tuple(
        Question(
            about=TypeAdapter(SUBJECTS[one["about"]["kind"]]).validate_python(one["about"]),
            measurements=TypeAdapter(tuple[ProposedMeasurement, ...]).validate_python(one["measurements"]),
            seen_from=math.inf if one["seen_from"] is None else float(one["seen_from"]),
        )
        for one in tree
    )
