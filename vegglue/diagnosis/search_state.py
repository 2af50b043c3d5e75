"""What a search has found so far: effects, places and instruments, in the order in which they were accepted."""

from dataclasses import dataclass

from vegglue.calibration.candidates import Instrument
from vegglue.decision_constants import constants
from vegglue.diagnosis.competition import Hypothesis
from vegglue.measurements.plausibility import ImplausibleOutlet, ImplausibleValues
from vegglue.results.causes import FaultyInstrument, LocalAnomaly, Rival, Step


@dataclass(frozen=True)
class PriorWeight:
    """What one finding brought and cost: the fall of chi2 with it, and the ln of its chance before the data."""

    name: str
    explained: float
    log_prior: float


@dataclass(frozen=True)
class Undecided:
    """Hypotheses that competed last and led to nothing, most evidence first, and the chance of each (k,) [-]."""

    hypotheses: tuple[Hypothesis, ...]
    chances: tuple[float, ...]


def rivals_in(undecided: Undecided) -> tuple[Rival, ...]:
    """The hypotheses as values with their probabilities, the likeliest first."""
    rivals = []
    for one, chance in zip(undecided.hypotheses, undecided.chances, strict=True):
        if isinstance(one.what, Instrument):
            rivals.append(Rival(one.name, one.what.kind, chance, one.what.x, one.what.y))
        elif one.kind == "effect":
            rivals.append(Rival(one.name, "effect", chance))
        else:
            shapes = one.what.shapes
            rivals.append(Rival(one.name, one.kind, chance, shapes["x"], shapes["y"], one.what.amplitude))
    return tuple(sorted(rivals, key=lambda one: -one.probability))


@dataclass(frozen=True)
class SearchState:
    """prior_weights: of all that is held. flagged: readings set aside, indices among the used stations. of_shape:
    ln evidence of places as they competed, less that in the model, whose covariance holds the error of their shape. p:
    of the last alarm, and the rate below which it is sounded. undecided: what competed last and led to nothing.
    implausible: values that no flow of the case can have.
    """

    steps: tuple[Step, ...] = ()
    places: tuple[LocalAnomaly, ...] = ()
    instruments: tuple[FaultyInstrument, ...] = ()
    prior_weights: tuple[PriorWeight, ...] = ()
    flagged: tuple[int, ...] = ()
    of_shape: float = 0.0
    p: float = 1.0
    rate: float = 0.0
    undecided: Undecided | None = None
    implausible: tuple[ImplausibleOutlet | ImplausibleValues, ...] = ()

    @property
    def alarmed(self) -> bool:
        return self.p < self.rate

    @property
    def explained(self) -> float:
        """Fall of chi2 by effects and places."""
        return sum(one.explained for one in self.prior_weights)

    @property
    def slack(self) -> float:
        """By how much a remainder of what was accepted may make others score higher [standard errors]."""
        return constants().misplaced_share * float(max(self.explained, 0.0) ** 0.5)

    @property
    def log_prior(self) -> float:
        """ln of the chance of all that was found before the data."""
        return sum(one.log_prior for one in self.prior_weights)

    def gained(self, before: float, after: float) -> float:
        """ln evidence of all that was found together, as it competed, from those of the first and the last model."""
        return after - before + self.log_prior + self.of_shape

    @property
    def effects(self) -> list[str]:
        """Names of the effects that were accepted."""
        return [step.accepted for step in self.steps]

    @property
    def accepted(self) -> int:
        """How many effects and places."""
        return len(self.steps) + len(self.places)
