"""What is still to be told apart, and the measurements that could: as `vegglue next` leaves it for the page."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class ProposedMeasurement:
    """A measurement in words, its stations and hours of field work, and the squared standard errors that lie between
    the nearest rivals now and with it; enough: whether it tells them apart by itself.
    """

    name: str
    stations: int
    hours: float
    now: float
    then: float
    enough: bool


@dataclass(frozen=True)
class OpenQuestion:
    """What is to be told apart, in words; the best measurements, the first one best."""

    tells_apart: str
    measurements: tuple[ProposedMeasurement, ...]


def questions_json(questions: Sequence[OpenQuestion]) -> list[dict[str, Any]]:
    """The questions as a list of objects."""
    return [asdict(one) for one in questions]


def questions_from(tree: Sequence[Mapping[str, Any]]) -> tuple[OpenQuestion, ...]:
    """The questions of such a list. Errors: KeyError or TypeError where it is none."""
    return tuple(
        OpenQuestion(str(one["tells_apart"]), tuple(ProposedMeasurement(**each) for each in one["measurements"]))
        for one in tree
    )
