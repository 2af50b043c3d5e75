"""What a diagnosis finds, as values: candidate effects as the data see them, and causes that are in no list: places,
instruments, fields, laws and the model's own error.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from vegglue.arrays import Array
from vegglue.decision_constants import constants
from vegglue.effects.identity import EffectIdentity

# Terms of the equations that something at a place may change, and an obstacle across the channel.
TERMS_AT_PLACES = ("drag", "barrier", "bed", "inflow", "viscosity")
# Units of smooth fields, by their term.
UNIT_OF_FIELD = {"friction": "-", "bed": "m", "viscosity": "m2/s", "inflow": "m/s"}


@dataclass(frozen=True)
class PatchOutline:
    """Plants that are not on the map, as a rectangle."""

    # angle, height, proportional: inclination to x [deg], height of the plants [m] and how they act where they stand
    # out of the water, the shapes of the effect beside those of a spot
    angle: float
    height: float
    proportional: float
    # length_error, width_error, angle_error: standard errors of half length, half width [m] and inclination [deg]
    length_error: float
    width_error: float
    angle_error: float
    like: str  # the patch of the map whose drag is the plausible size


@dataclass(frozen=True)
class LocalAnomaly:
    """A place where something unlisted changes a term of the equations."""

    # x, y, length, width: middle, half length and half width of the spot, or of the outline [m]
    x: float
    y: float
    length: float
    width: float
    # term, effect: the term, or barrier, and the effect that stands for the place in the library
    term: str
    effect: str
    # amplitude, interval95, unit: size with its 95 % interval
    amplitude: float
    interval95: tuple[float, float]
    unit: str
    score: float  # of its fingerprint [standard errors]
    experiments: tuple[str, ...]  # those that point at it
    odds: dict[str, float]  # over the best hypothesis of each other kind, by its name [-]
    plausible: float  # a plausible size there [unit]
    # x_error, y_error: standard errors over all spots that could be it [m]
    x_error: float = 0.0
    y_error: float = 0.0
    # x_spread, y_spread: the same if traces are nature's own, over which `extend` spreads it [m]; 0 with an outline
    x_spread: float = 0.0
    y_spread: float = 0.0
    outline: PatchOutline | None = None  # of plants that are not on the map; None for a spot

    @property
    def nearest_odds(self) -> tuple[tuple[str, float], ...]:
        """Odds against the nearest other term, and against what is known unless that is far, by name."""
        nearest = sorted(self.odds.items(), key=lambda one: one[1])
        terms = [one for one in nearest if one[0] in TERMS_AT_PLACES][:1]
        known = [one for one in nearest if one[0] not in TERMS_AT_PLACES and one[1] < 1.0 / constants().rival_share]
        return (*terms, *known[:1])

    @property
    def shapes(self) -> dict[str, float]:
        """The shapes of the effect there."""
        names, more = ("angle", "height", "proportional"), self.outline
        of_outline = {} if more is None else {name: getattr(more, name) for name in names}
        return {"x": self.x, "y": self.y, "length": self.length, "width": self.width} | of_outline


@dataclass(frozen=True)
class PlaceMap:
    """Scores of a spot of one term everywhere, in the model as it was."""

    term: str  # of the first place that was found, drag without any and for an obstacle across the channel
    # x, y: middles of spots (spot,) [m]; those of one length stand together, in the order of x
    x: Array
    y: Array
    score: Array  # (spot,) [standard errors]


@dataclass(frozen=True)
class FaultyInstrument:
    """An instrument found to be off, whose readings are excluded."""

    kind: str  # a reading, a position, a probe, a gauge, or a surveyed line of the bed
    # x, y: where it stood [m], NaN if at several places
    x: float
    y: float
    stations: tuple[int, ...]  # rows of its readings
    # offset, interval95, unit: excess of its readings with the 95 % interval [unit of its kind]
    offset: float
    interval95: tuple[float, float]
    unit: str
    log_factor: float  # ln of the Bayes factor against none [-]
    # Reading over true value [-], NaN if that explains the readings no better than an offset
    factor: float = float("nan")


@dataclass(frozen=True)
class FieldFound:
    """A smooth field of a term that would close the misfit."""

    term: str
    size: float  # standard deviation [unit of the term]
    # length, width: half length and half width of its Gaussian basis functions [m]
    length: float
    width: float
    log_factor: float  # ln of its Bayes factor against none [-]
    # value, error, x, y: value and standard error [unit of the term] at the place [m] of highest significance
    value: float
    error: float
    x: float
    y: float


@dataclass(frozen=True)
class FieldMapKept:
    """The smooth field of a term over the grid on which it was computed."""

    # x, y: cell centres, (nx,) and (ny,) [m]
    x: Array
    y: Array
    # value, error: value and standard error (nx, ny) [unit of the term]
    value: Array
    error: Array


@dataclass(frozen=True)
class CandidateLaw:
    """A law of the grammar, to first order."""

    # name, title, equation: of the law in the library
    name: str
    # term, quantity: what it changes and with what, in words
    term: str
    quantity: str
    title: str
    equation: str
    reference: float | None  # r [unit of the quantity]; None for a law that has none
    # scale, strength: a plausible strength a, and the one found [-]
    scale: float
    strength: float
    chance: float  # probability among all that was compared [-]

    @property
    def shapes(self) -> dict[str, float]:
        """The shapes of its effect."""
        return {} if self.reference is None else {"reference": self.reference}


@dataclass(frozen=True)
class CandidateLaws:
    """Laws that are significant in what is left, whatever was accepted."""

    p: float  # chance that errors alone make laws as significant [-]
    tried: int  # their number
    chance: float  # probability of all together among all that was compared [-]
    laws: tuple[CandidateLaw, ...]  # those that hold 95 % of it, the most probable first
    calibrated: bool = False  # whether the probabilities are those of calibrated laws, else to first order
    # Whether laws are significant beside the accepted effects, too: calibrated together with these. Else these and the
    # laws explain the same.
    needed: bool = True

    @property
    def likelier(self) -> bool:
        """Whether laws are likelier than all else together."""
        return self.chance > 0.5

    @property
    def clear(self) -> bool:
        """Whether laws are strong_odds times as likely as all else together, and needed beside it."""
        return self.needed and self.chance > constants().strong_odds * (1.0 - self.chance)

    @property
    def alike(self) -> tuple[CandidateLaw, ...]:
        """Laws of the same term and quantity as the likeliest."""
        best = self.laws[0]
        return tuple(one for one in self.laws if (one.term, one.quantity) == (best.term, best.quantity))


@dataclass(frozen=True)
class ModelErrorUsed:
    """The model's own error."""

    # friction, bed: relative error of friction [-] and error of the bed [m] as allowed
    friction: float
    bed: float
    needed: float  # the share of both that is most likely for the last residual [-]
    log_ratio: float  # ln of its likelihood ratio against what is allowed [-]

    @property
    def asks_for_more(self) -> bool:
        """Whether more than is allowed is needed, beyond doubt: two readings may need nine times as much."""
        return self.needed > 1.0 and self.log_ratio > constants().model_error_evidence


# |cosine| [-] above which an effect is reported to resemble one of a parameter: that change then mimics two thirds of
# its trace (cos^2 = 0.64).
LOOKS_LIKE_FROM = 0.8
# A smallest size from which on no data show an effect, see `Detectability`.
NEVER = 1e100


@dataclass(frozen=True)
class AmplitudeEstimate:
    """How large an effect is, in the unit of its amplitude."""

    # value, interval95: from its own refit if `refitted`, else to first order; with its prior
    value: float
    interval95: tuple[float, float]
    unit: str
    # off, scale: value at which the effect is off, and a plausible distance from it
    off: float
    scale: float
    refitted: bool
    objective: float  # least |W (y - f)|^2 + |z|^2 with the effect [-], predicted if it was not refitted
    support: tuple[float, float] = (-np.inf, np.inf)  # range within which the amplitude must lie

    @property
    def relative_size(self) -> float:
        """|value - off| / scale [-]."""
        return abs(self.value - self.off) / self.scale


@dataclass(frozen=True)
class ScoreTest:
    """Score of an effect, and how often errors alone reach it."""

    score: float  # T [standard errors]
    # Chance that errors alone make any effect score as high [-], counted among bootstrap draws and never below one over
    # their number; see `calibration/score_test`
    p_family: float


@dataclass(frozen=True)
class Detectability:
    """Whether these data could show an effect."""

    visibility: float  # share of its fingerprint that calibration cannot mimic [-]
    smallest: float  # distance of the amplitude from off that is detected 19 times of 20 [unit of the amplitude]
    testable: bool  # whether that is less than twice a plausible one, and within its support
    # confounder, cosine: the parameter whose slope is most like the fingerprint, and the cosine between both [-]
    confounder: str
    cosine: float

    @property
    def ever(self) -> bool:
        """Whether any size of it shows: a trace without length has a smallest size of some 1e300."""
        return self.smallest < NEVER

    @property
    def looks_like(self) -> str:
        """The parameter that a trace looks like a change of; '' where none is so like it."""
        return self.confounder if abs(self.cosine) > LOOKS_LIKE_FROM else ""


@dataclass(frozen=True)
class CandidateEffect:
    """One effect in the light of the data, in the last model in which it was tested."""

    name: str
    title: str
    shapes: dict[str, float]  # shapes by name at which it scores best
    amplitude: AmplitudeEstimate
    test: ScoreTest
    detectability: Detectability


def effects_among(candidate_effects: Sequence[CandidateEffect]) -> int:
    """How many effects they are, wherever each may act."""
    return len({EffectIdentity.parse(one.name).name for one in candidate_effects})


@dataclass(frozen=True)
class Rival:
    """Another explanation with its probability."""

    name: str
    kind: str  # `effect`, a term at a place, or the kind of an instrument
    probability: float  # [-]
    # x, y: of a place or an instrument [m], NaN otherwise
    x: float = float("nan")
    y: float = float("nan")
    amplitude: float = float("nan")  # of what is at a place [unit of the term], NaN otherwise


@dataclass(frozen=True)
class Step:
    """One round of the search."""

    accepted: str  # name of the effect that was accepted
    # rivals, chances: the effects that together hold 95 % of the probability, and the probability of each among all of
    # every kind [-]
    rivals: tuple[str, ...]
    chances: tuple[float, ...]
    groups: tuple[tuple[str, ...], ...]  # rivals that the data cannot separate
    # chi2_before, chi2_after: [-]
    chi2_before: float
    chi2_after: float
    p_family: float  # chance that errors alone sound the alarm as loudly [-], counted, see `score_test.alarm_p`
    # Probability of the best of each other kind by its name, unless negligible [-]
    others: dict[str, float] = field(default_factory=dict)
    places: dict[str, LocalAnomaly] = field(default_factory=dict)  # those of the others that are something at a place

    @property
    def chance(self) -> dict[str, float]:
        """Of each rival by its name."""
        return dict(zip(self.rivals, self.chances, strict=True))

    @property
    def likelier_place(self) -> str:
        """The place that is likelier than every group of effects that the data cannot separate; '' without."""
        best = max(self.places, key=self.others.__getitem__, default="")
        groups = [sum(self.chance[name] for name in group) for group in self.groups]
        return best if best and self.others[best] > max(groups) else ""
