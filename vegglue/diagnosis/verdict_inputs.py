"""What a verdict rests on, and what is asked of it by its sentence and by its remarks."""

from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import field as by_default

from vegglue.decision_constants import constants
from vegglue.diagnosis.search_state import SearchState
from vegglue.measurements.section_discharge import CarriedDischarge
from vegglue.normal_range import NORMAL95
from vegglue.results.causes import CandidateLaws, FaultyInstrument
from vegglue.results.diagnosis import EstimatedErrors, FieldFound, Misfit, ModelErrorUsed, VerdictKind


@dataclass(frozen=True)
class VerdictInputs:
    """What a verdict rests on. unseen: errors at what was not seen over those expected [-], NaN if unknown; by_chance:
    what of that errors alone exceed in 5 % of cases; neighbours: whether readings side by side were set aside;
    strained: the parameter furthest off its prior, and how far; between: errors between the sections that were
    measured, over those of the data [-], at most; laws: those that stand out; on_map: where places lie on the map;
    stretch: what is told of the part of the channel that was measured, '' for nothing; places_searched: whether there
    was water deep enough to look for something at a place; carried: sections that clearly carry another discharge than
    stated; significant_effects: effects that stand out in the last model, with the family-wise p of each [-];
    remainder: whether all of these may be what is left of what was accepted.
    """

    errors: EstimatedErrors
    misfit: Misfit
    state: SearchState
    field: FieldFound | None
    model_error: ModelErrorUsed | None
    not_excluded: tuple[tuple[str, ...], ...]
    unseen: float
    neighbours: bool
    strained: tuple[str, float]
    between: float = 1.0
    by_chance: float = 1.0
    laws: CandidateLaws | None = None
    stretch: str = ""
    on_map: str = ""
    places_searched: bool = True
    carried: tuple[CarriedDischarge, ...] = ()
    significant_effects: Mapping[str, float] = by_default(default_factory=dict)
    remainder: bool = False


@dataclass(frozen=True)
class Statement:
    """The sentence of a verdict, its kind, and what it says besides: whether it clears the model but for instruments,
    whether it tells the laws that stand out, of which instruments it tells, and whether it says by how much errors are
    larger than stated.
    """

    kind: VerdictKind
    sentence: str
    clears_the_model: bool = False
    tells_laws: bool = False
    instruments: tuple[FaultyInstrument, ...] = ()
    tells_errors: bool = False


def is_clear(instrument: FaultyInstrument) -> bool:
    """Whether an instrument is off by instrument_errors of its standard errors."""
    low, high = instrument.interval95
    return abs(instrument.offset) > constants().instrument_errors * (high - low) / (2.0 * NORMAL95)
