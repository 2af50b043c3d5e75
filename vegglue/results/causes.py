"""Causes other than listed effects that a diagnosis found: places, instruments, fields, laws, the model's own error."""

from dataclasses import dataclass

from vegglue.arrays import Array

# Faulty instruments by their kind.
FAULT_WORDS = {
    "reading": "one reading that is off",
    "position": "a probe that is off in all experiments",
    "probe": "a probe that is off in all sections",
    "gauge": "a gauge that is off",
}
# Units of smooth fields, by their term.
UNIT_OF_FIELD = {"friction": "-", "bed": "m", "viscosity": "m2/s", "inflow": "m/s"}
# ln of the likelihood ratio beyond which the model needs more error of its own than it is allowed: 1 % of chi2 with one
# degree of freedom.
NEEDS_MORE = 3.3


@dataclass(frozen=True)
class LocalAnomaly:
    """Where [m] something unlisted changes a term of the equations: middle x, y, half length, half width of the spot,
    and standard errors of x and y over all spots that could be it; x_spread, y_spread: the same where traces are taken
    to be nature's own, over which `extend` spreads it.

    effect: that stands for it in the library; amplitude [unit] with its 95 % interval; score of its fingerprint
    [standard errors]; experiments that point at it. odds: how much likelier it is than the best hypothesis of each
    other kind, by its name. plausible: a plausible size there [unit].
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

    @property
    def shapes(self) -> dict[str, float]:
        """The shapes of the effect there."""
        return {"x": self.x, "y": self.y, "length": self.length, "width": self.width}


@dataclass(frozen=True)
class PlaceMap:
    """Scores [standard errors] of a spot of one term at x, y [m], (spot,) each, in the model as it was: of the term of
    the first place that was found, else of drag. Spots of one length stand together, in the order of x.
    """

    term: str
    x: Array
    y: Array
    score: Array


@dataclass(frozen=True)
class FaultyInstrument:
    """An instrument found to be off, whose readings were set aside: a reading, a position, a probe or a gauge.

    x, y: where it stood [m], NaN where it stood at several; stations: rows of its readings; offset: what it shows too
    much, with the 95 % interval [unit of its kind]; log_factor: ln of the Bayes factor against none [-]; factor: what
    it shows over what is there [-], NaN where that explains its readings no better than an offset.
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
    """A smooth field of a term that would close the misfit: its standard deviation [unit of the term], half length and
    half width of its bumps [m], ln of its Bayes factor against none [-], and where it stands out most: value there, its
    standard error, x and y [m].
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
    """The smooth field of a term over the grid it was computed on: value and standard error (nx, ny) [unit of the
    term], at cell centres x (nx,), y (ny,) [m].
    """

    x: Array
    y: Array
    value: Array
    error: Array


@dataclass(frozen=True)
class CandidateLaw:
    """A law of the grammar, to first order: its name in the library, the term it changes and the quantity it depends on
    in words, its equation, reference r (None: none), a plausible strength a and the one found [-], and its chance among
    all that was compared [-].
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
    """Laws that stand out in what is left, whatever was accepted. p: chance that errors alone make laws stand out as
    much; tried: how many; chance: of all of them together among all that was compared [-]; laws: the likeliest first,
    those that hold 95 % of it.
    """

    p: float
    tried: int
    chance: float
    laws: tuple[CandidateLaw, ...]

    @property
    def alike(self) -> tuple[CandidateLaw, ...]:
        """Laws of the same term and quantity as the likeliest."""
        best = self.laws[0]
        return tuple(one for one in self.laws if (one.term, one.quantity) == (best.term, best.quantity))


@dataclass(frozen=True)
class ModelErrorUsed:
    """The model's own error: relative error of friction [-] and error of the bed [m] as allowed, and the share of both
    that the last residual asks for most [-], with the ln of its likelihood ratio against what is allowed.
    """

    friction: float
    bed: float
    needed: float
    log_ratio: float

    @property
    def asks_for_more(self) -> bool:
        """Whether more than is allowed is asked for, beyond doubt: two readings may ask for nine times as much."""
        return self.needed > 1.0 and self.log_ratio > NEEDS_MORE
