"""What is still to be told apart, and the measurements that could: as `vegglue next` tells it, and keeps it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from vegglue.wording.numbers import in_digits, so_many

# What stands in a question between an effect that calibration hides and the parameter that hides it.
HIDDEN_BEHIND = " from a change of "
# Below this D^2 a measurement does not separate anything.
SEPARATES = 4.0
# Measurements shown of each question: more than these nobody plans in one season.
SHOWN = 4
# A measurement that raises D^2 by less than a tenth is said to add nothing.
ADDS = 1.1


@dataclass(frozen=True)
class ProposedMeasurement:
    """A measurement in words, the experiment it is made in, its place x [m], stations and hours of field work, and the
    squared standard errors D^2 that lie between the nearest rivals now and with it [-].
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
    """What is to be told apart, in words, and the measurements that could, by what they add in an hour; seen_from: D^2
    from which on a diagnosis sees what is asked for 19 times of 20 [-], infinite where that is no matter of size.
    """

    tells_apart: str
    measurements: tuple[ProposedMeasurement, ...]
    seen_from: float = math.inf

    @property
    def of_one(self) -> bool:
        """Whether one effect is asked for, that calibration hides, and not which of several it is."""
        return HIDDEN_BEHIND in self.tells_apart

    @property
    def answered(self) -> bool:
        """Whether the data at hand would have shown it."""
        return any(one.now >= self.seen_from for one in self.measurements)

    @property
    def useful(self) -> tuple[ProposedMeasurement, ...]:
        """Those that would tell it apart by themselves, the few that are worth a thought; none where it is answered."""
        if self.answered:
            return ()
        enough = (one for one in self.measurements if one.then >= SEPARATES and one.then > ADDS * one.now)
        return tuple(enough)[:SHOWN]

    @property
    def nearest(self) -> tuple[ProposedMeasurement, ...]:
        """The one that comes nearest to it, where there is any."""
        return tuple(sorted(self.measurements, key=lambda one: -one.then)[:1])

    def __repr__(self) -> str:
        if not self.useful:
            return f"To tell {self.tells_apart}: {self._why_none()}."
        heading = f"To tell {self.tells_apart} (D2 now {self._now_in_words(self.useful[0].now)}):"
        return "\n".join([heading, *(f"- {_in_short(one)}" for one in self.useful)])

    def _now_in_words(self, now: float) -> str:
        """What the data at hand say, and why that is no answer yet where it is much."""
        told = f"{in_digits(now, 2)} squared standard errors"
        if math.isfinite(self.seen_from):
            return f"{told}; a diagnosis sees it from {in_digits(self.seen_from, 2)} on"
        return f"{told}: the data at hand should tell, what is listed makes it surer" if now >= SEPARATES else told

    def _why_none(self) -> str:
        """Why no measurement is proposed: they add little to what is known, or are not enough."""
        if self.answered:
            now = max(one.now for one in self.measurements)
            seen = in_digits(self.seen_from, 2)
            return f"answered, as D2 is {in_digits(now, 2)} already, and from {seen} on a diagnosis sees it"
        if not self.nearest:
            return "no measurement would by itself"
        would, adds = self._none_of_them()
        best, enough = self.nearest[0], f"{SEPARATES:g} tells two apart"
        most = f"D2 at most {in_digits(best.then, 2)}: {best.name}"
        if best.then >= SEPARATES:
            return f"D2 is {in_digits(best.now, 2)} already, where {enough}, and {adds} a tenth to it ({most})"
        return f"{would} by itself, where {enough} ({most})"

    def _none_of_them(self) -> tuple[str, str]:
        """`none of 3 measurements would` and `.. adds`; of a single one, that it would not."""
        if len(self.measurements) == 1:
            return "the one measurement would not", "the one measurement does not add"
        many = f"none of {len(self.measurements)} measurements"
        return f"{many} would", f"{many} adds"


def questions_from(tree: Sequence[Mapping[str, Any]]) -> tuple[Question, ...]:
    """The questions of a list of JSON. Errors: KeyError, TypeError or ValueError where it is none."""
    return tuple(map(_question_from, tree))


def _question_from(tree: Mapping[str, Any]) -> Question:
    """null for no number: a size that is never seen."""
    seen_from = math.inf if tree["seen_from"] is None else float(tree["seen_from"])
    return Question(str(tree["tells_apart"]), tuple(map(_proposed_from, tree["measurements"])), seen_from)


def _proposed_from(tree: Mapping[str, Any]) -> ProposedMeasurement:
    return ProposedMeasurement(
        name=str(tree["name"]),
        experiment=str(tree["experiment"]),
        x=float(tree["x"]),
        stations=int(tree["stations"]),
        hours=float(tree["hours"]),
        now=float(tree["now"]),
        then=float(tree["then"]),
    )


def _in_short(one: ProposedMeasurement) -> str:
    return f"{one.name}: {in_digits(one.then, 2)}, {so_many(one.stations, 'station')}, {one.hours:.1f} h"
