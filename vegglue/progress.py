"""How a long command reports its progress: what it does, and how much of that is done if it is counted."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """What a long command does now. total: how many there are to do, None where nothing is counted.

    unit: what is counted; failed: those of the done that failed; resumed: those that an earlier run had done.
    """

    phase: str
    done: int = 0
    total: int | None = None
    unit: str = ""
    failed: int = 0
    resumed: int = 0

    def __str__(self) -> str:
        """As one line: 'solving brook: 128 of 256 members (64 from before), 1 failed'."""
        if self.total is None:
            return self.phase
        resumed = f" ({self.resumed:,} from before)" if self.resumed else ""
        failed = f", {self.failed:,} failed" if self.failed else ""
        return f"{self.phase}: {self.done:,} of {self.total:,} {self.unit}".rstrip() + resumed + failed


Watch = Callable[[Progress], None]


def silent(*_: object) -> None:
    """Shows nothing: the default of `watch` and `show`."""


def counted(watch: Watch, phase: str, total: int, unit: str = "") -> Callable[[int], None]:
    """Reports a phase each time one more of `total` is done, and at once that none is."""
    watch(Progress(phase, 0, total, unit))
    return lambda done: watch(Progress(phase, done, total, unit))
