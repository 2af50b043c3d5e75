"""How a long command tells how far it is."""

from collections.abc import Callable
from dataclasses import dataclass

Say = Callable[[str], None]


@dataclass(frozen=True)
class Progress:
    """How far a run is: members solved of all, failed among them, members already there at the start."""

    solved: int
    members: int
    failed: int
    resumed: int
