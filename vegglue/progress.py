"""How a long command tells how far it is."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """How far the ensemble of a case is: members solved of all, failed among them, there from an earlier run."""

    name: str
    solved: int
    members: int
    failed: int
    resumed: int


Say = Callable[[str], None]
Watch = Callable[[Progress], None]


def silent(_: object) -> None:
    """Says nothing: what is heard of a long command unless it is given something to say it to."""
