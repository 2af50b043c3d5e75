"""What a search has found so far: effects, places and instruments, in the order in which they were accepted."""

from dataclasses import dataclass

from vegglue.diagnosis.competition import Contender
from vegglue.results.diagnosis import FaultyInstrument, Location, Step


@dataclass(frozen=True)
class Findings:
    """flagged: readings set aside, indices among the used stations. explained: fall of chi2 by effects and places;
    log_prior: ln of the chance of all of them before the data. of_shape: ln evidence of places as they competed, less
    that in the model, whose covariance holds the error of their shape. p: of the last alarm, and the rate below which
    it is sounded. undecided: what competed last and led to nothing, most evidence first. absurd: values that no flow of
    the case can have, in sentences.
    """

    steps: tuple[Step, ...] = ()
    places: tuple[Location, ...] = ()
    instruments: tuple[FaultyInstrument, ...] = ()
    flagged: tuple[int, ...] = ()
    explained: float = 0.0
    log_prior: float = 0.0
    of_shape: float = 0.0
    p: float = 1.0
    rate: float = 0.0
    undecided: tuple[Contender, ...] = ()
    absurd: tuple[str, ...] = ()

    @property
    def alarmed(self) -> bool:
        return self.p < self.rate

    def gained(self, before: float, after: float) -> float:
        """ln evidence of all that was found together, as it competed, from those of the first and the last model."""
        return after - before + self.log_prior + self.of_shape

    @property
    def accepted(self) -> int:
        """Effects and places."""
        return len(self.steps) + len(self.places)
