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
    """Plants that are not on the map, as a rectangle.

    Attributes
    ----------
    angle, height, proportional : float
        Inclination to x [deg], height of the plants [m] and how they act where they stand out of the water, the
        shapes of the effect beside those of a spot.
    length_error, width_error, angle_error : float
        Standard errors of half length, half width [m] and inclination [deg].
    like : str
        The patch of the map whose drag is the plausible size.
    """

    angle: float
    height: float
    proportional: float
    length_error: float
    width_error: float
    angle_error: float
    like: str


@dataclass(frozen=True)
class LocalAnomaly:
    """A place where something unlisted changes a term of the equations.

    Attributes
    ----------
    x, y, length, width : float
        Middle, half length and half width of the spot, or of the outline [m].
    term, effect : str
        The term, or barrier, and the effect that stands for the place in the library.
    amplitude : float
        Its size [unit].
    interval95 : (float, float)
        Of the amplitude [unit].
    score : float
        Of its fingerprint [standard errors].
    experiments : tuple of str
        Those that point at it.
    odds : dict of float
        Over the best hypothesis of each other kind, by its name [-].
    plausible : float
        A plausible size there [unit].
    x_error, y_error : float
        Standard errors over all spots that could be it [m].
    x_spread, y_spread : float
        The same if traces are nature's own, over which `extend` spreads it [m]; 0 with an outline.
    outline : PatchOutline or None
        Of plants that are not on the map; None for a spot.
    """

    x: float
    y: float
    length: float
    width: float
    term: str
    effect: str
    amplitude: float
    interval95: tuple[float, float]
    unit: str
    score: float
    experiments: tuple[str, ...]
    odds: dict[str, float]
    plausible: float
    x_error: float = 0.0
    y_error: float = 0.0
    x_spread: float = 0.0
    y_spread: float = 0.0
    outline: PatchOutline | None = None

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
    """Scores of a spot of one term everywhere, in the model as it was.

    Attributes
    ----------
    term : str
        Of the first place that was found, drag without any and for an obstacle across the channel.
    x, y : ndarray (spot,)
        Middles of spots [m]; those of one length stand together, in the order of x.
    score : ndarray (spot,)
        [standard errors]
    """

    term: str
    x: Array
    y: Array
    score: Array


@dataclass(frozen=True)
class FaultyInstrument:
    """An instrument found to be off, whose readings are excluded.

    Attributes
    ----------
    kind : str
        A reading, a position, a probe, a gauge, or a surveyed line of the bed.
    x, y : float
        Where it stood [m], NaN if at several places.
    stations : tuple of int
        Rows of its readings.
    offset : float
        Excess of its readings [unit].
    interval95 : (float, float)
        Of the offset [unit].
    unit : str
        Of its kind.
    log_factor : float
        ln of the Bayes factor against none [-].
    factor : float
        Reading over true value [-], NaN if that explains the readings no better than an offset.
    """

    kind: str
    x: float
    y: float
    stations: tuple[int, ...]
    offset: float
    interval95: tuple[float, float]
    unit: str
    log_factor: float
    factor: float = float("nan")


@dataclass(frozen=True)
class FieldFound:
    """A smooth field of a term that would close the misfit.

    Attributes
    ----------
    size : float
        Standard deviation [unit of the term].
    length, width : float
        Half length and half width of its Gaussian basis functions [m].
    log_factor : float
        ln of its Bayes factor against none [-].
    value, error, x, y : float
        Value and standard error [unit of the term] at the place [m] of highest significance.
    """

    term: str
    size: float
    length: float
    width: float
    log_factor: float
    value: float
    error: float
    x: float
    y: float


@dataclass(frozen=True)
class FieldMapKept:
    """The smooth field of a term over the grid on which it was computed.

    Attributes
    ----------
    x, y : ndarray (nx,), (ny,)
        Cell centres [m].
    value, error : ndarray (nx, ny)
        Value and standard error [unit of the term].
    """

    x: Array
    y: Array
    value: Array
    error: Array


@dataclass(frozen=True)
class CandidateLaw:
    """A law of the grammar, to first order.

    Attributes
    ----------
    name, title, equation : str
        Of the law in the library.
    term, quantity : str
        What it changes and with what, in words.
    reference : float or None
        r [unit of the quantity]; None for a law that has none.
    scale, strength : float
        A plausible strength a, and the one found [-].
    chance : float
        Probability among all that was compared [-].
    """

    name: str
    term: str
    quantity: str
    title: str
    equation: str
    reference: float | None
    scale: float
    strength: float
    chance: float

    @property
    def shapes(self) -> dict[str, float]:
        """The shapes of its effect."""
        return {} if self.reference is None else {"reference": self.reference}


@dataclass(frozen=True)
class CandidateLaws:
    """Laws that are significant in what is left, whatever was accepted.

    Attributes
    ----------
    p : float
        Chance that errors alone make laws as significant [-].
    tried : int
        Their number.
    chance : float
        Probability of all together among all that was compared [-].
    laws : tuple of CandidateLaw
        Those that hold 95 % of it, the most probable first.
    calibrated : bool
        Whether the probabilities are those of calibrated laws, else to first order.
    needed : bool
        Whether laws are significant beside the accepted effects, too: calibrated together with these. Else these
        and the laws explain the same.
    """

    p: float
    tried: int
    chance: float
    laws: tuple[CandidateLaw, ...]
    calibrated: bool = False
    needed: bool = True
    # How far the parameter that is furthest off its prior lies with the likeliest law in the model [standard
    # deviations]
    strained: float = 0.0

    @property
    def likelier(self) -> bool:
        """Whether laws are likelier than all else together."""
        return self.chance > 0.5

    @property
    def clear(self) -> bool:
        """Whether laws are strong_odds times as likely as all else together, needed beside it, and with the parameters
        within far_off_prior, as whatever is named.
        """
        believed = self.needed and self.strained <= constants().far_off_prior
        return believed and self.chance > constants().strong_odds * (1.0 - self.chance)

    @property
    def alike(self) -> tuple[CandidateLaw, ...]:
        """Laws of the same term and quantity as the likeliest."""
        best = self.laws[0]
        return tuple(one for one in self.laws if (one.term, one.quantity) == (best.term, best.quantity))


@dataclass(frozen=True)
class ModelErrorUsed:
    """The model's own error.

    Attributes
    ----------
    friction, bed : float
        Relative error of friction [-] and error of the bed [m] as allowed.
    needed : float
        The share of both that is most likely for the last residual [-].
    log_ratio : float
        ln of its likelihood ratio against what is allowed [-].
    """

    friction: float
    bed: float
    needed: float
    log_ratio: float

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
    """How large an effect is, in the unit of its amplitude.

    Attributes
    ----------
    value : float
        From its own refit if `refitted`, else to first order; with its prior [unit].
    interval95 : (float, float)
        95 % interval of the value [unit].
    off, scale : float
        Value at which the effect is off, and a plausible distance from it [unit].
    objective : float
        Least |W (y - f)|^2 + |z|^2 with the effect [-], predicted if it was not refitted.
    support : (float, float)
        Range within which the amplitude must lie [unit].
    """

    value: float
    interval95: tuple[float, float]
    unit: str
    off: float
    scale: float
    refitted: bool
    objective: float
    support: tuple[float, float] = (-np.inf, np.inf)

    @property
    def relative_size(self) -> float:
        """|value - off| / scale [-]."""
        return abs(self.value - self.off) / self.scale


@dataclass(frozen=True)
class ScoreTest:
    """Score of an effect, and how often errors alone reach it.

    Attributes
    ----------
    score : float
        T [standard errors].
    p_family : float
        Chance that errors alone make any effect score as high [-], counted among bootstrap draws and never below
        one over their number; see `calibration/score_test`.
    """

    score: float
    p_family: float


@dataclass(frozen=True)
class Detectability:
    """Whether these data could show an effect.

    Attributes
    ----------
    visibility : float
        Share of its fingerprint that calibration cannot mimic [-].
    smallest : float
        Distance of the amplitude from off that is detected 19 times of 20 [unit of the amplitude].
    testable : bool
        Whether that is less than twice a plausible one, and within its support.
    confounder : str
        The parameter whose slope is most like the fingerprint.
    cosine : float
        Between both [-].
    """

    visibility: float
    smallest: float
    testable: bool
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
    """One effect in the light of the data, in the last model in which it was tested.

    Attributes
    ----------
    shapes : dict of float
        Shapes by name at which it scores best.
    """

    name: str
    title: str
    shapes: dict[str, float]
    amplitude: AmplitudeEstimate
    test: ScoreTest
    detectability: Detectability


def effects_among(candidate_effects: Sequence[CandidateEffect]) -> int:
    """How many effects they are, wherever each may act."""
    return len({EffectIdentity.parse(one.name).name for one in candidate_effects})


@dataclass(frozen=True)
class Rival:
    """Another explanation with its probability.

    Attributes
    ----------
    kind : str
        `effect`, a term at a place, or the kind of an instrument.
    probability : float
        [-]
    x, y : float
        Of a place or an instrument [m], NaN otherwise.
    amplitude : float
        Of what is at a place [unit of the term], NaN otherwise.
    """

    name: str
    kind: str
    probability: float
    x: float = float("nan")
    y: float = float("nan")
    amplitude: float = float("nan")


@dataclass(frozen=True)
class Step:
    """One round of the search.

    Attributes
    ----------
    accepted : str
        Name of the effect that was accepted.
    rivals : tuple of str
        The effects that together hold 95 % of the probability.
    chances : tuple of float
        Of each among all of every kind [-].
    groups : tuple of tuple of str
        Rivals that the data cannot separate.
    chi2_before, chi2_after : float
        [-]
    p_family : float
        Chance that errors alone sound the alarm as loudly [-], counted, see `score_test.alarm_p`.
    others : dict of float
        Probability of the best of each other kind by its name, unless negligible [-].
    places : dict of LocalAnomaly
        Those of the others that are something at a place.
    """

    accepted: str
    rivals: tuple[str, ...]
    chances: tuple[float, ...]
    groups: tuple[tuple[str, ...], ...]
    chi2_before: float
    chi2_after: float
    p_family: float
    others: dict[str, float] = field(default_factory=dict)
    places: dict[str, LocalAnomaly] = field(default_factory=dict)

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
