"""Laws that no list holds: a term of the equations changes with a quantity of the flow or the channel.

    k -> k exp(a g),   nu -> nu exp(a g),   h U U -> h U U exp(a g)

with g a pure number of the size of 1, to first order a factor 1 + a g. The last is a flux of momentum that the mean
velocity does not carry, (exp(a g) - 1) h U U, as `dispersion` is with a constant.

A law is a term, a quantity and a form: friction of the banks, with the speed, as a step. exp keeps every term above 0.
Quantities q are measured by a reference r, a quantile of what the data have seen; a form makes g of q and r, which is 0
at q = r, or 1 there (or at q = 0) and falls off. Each law is an effect
as any other, with the tag `law`, which the search of a diagnosis leaves out. A product c g_1 g_2 is a law beside the
law a g_1 that it belongs to: what the one quantity does then changes evenly with another.

The second half lists terms, quantities and forms, and which of them make sense together.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.definition import Amplitude, Effect, Shape, Stage
from vegglue.effects.exchange import dispersion
from vegglue.effects.physical_constants import GRAVITY
from vegglue.effects.resistance import LEAST_DEPTH_OF_POWER
from vegglue.effects.surroundings import Cells

# A plausible size a [-]: a term changes by a half where g is 1.
PLAUSIBLE_STRENGTH = 0.5


@dataclass(frozen=True)
class LawTerm:
    """What a law changes.

    Parameters
    ----------
    name, words, where, symbol
        Of the term, and where it is changed in words.
    stage
        Stage of the effect.
    share, written
        1 in the cells where it is changed, else 0, as a function and as a factor in code.
    changed, change
        What the effect returns with a factor on the term, as a function and as code.
    """

    name: str
    words: str
    where: str
    stage: Stage
    symbol: str
    share: Callable[[Cells], Array]
    written: str
    changed: Callable[[Cells, Array], dict[str, Array]]
    change: str


@dataclass(frozen=True)
class LawQuantity:
    """What a law depends on.

    Parameters
    ----------
    name, words, symbol, unit
        Of the quantity q.
    of, written
        q in each cell, as a function and as code.
    usual
        A usual value [unit], the default of the reference r.
    scale
        Scale of the site of which that is a multiple, "" for none.
    """

    name: str
    words: str
    symbol: str
    unit: str
    of: Callable[[Cells], Array]
    written: str
    usual: float
    scale: str = ""

    @property
    def unit_behind(self) -> str:
        """The unit with a space before it; nothing for a pure number."""
        return "" if self.unit == "-" else f" {self.unit}"


def signed(reference: float) -> str:
    """A reference as it stands in a formula: in brackets below 0."""
    return f"({reference:g})" if reference < 0.0 else f"{reference:g}"


@dataclass(frozen=True)
class LawForm:
    """How g follows from q and r.

    Parameters
    ----------
    name, words
        Of the form.
    of, written, equation
        g as a function, as code and as text.
    quantiles
        Quantiles of the q in the data that are tried as r; empty: g has no r.
    strongest
        End of the support of a on either side [-]; 3 is a factor of 20 where g is 1.
    """

    name: str
    words: str
    of: Callable[[Array, Array | float], Array]
    written: str
    equation: str
    quantiles: tuple[float, ...] = ()
    strongest: float = 3.0


@dataclass(frozen=True)
class Law:
    """A law of the grammar.

        term -> term exp(a g(q, r))

    Parameters
    ----------
    term, quantity, form
        What changes, with what, and how.
    times
        A law by whose g its own g is multiplied, which has a reference of its own, `first`.
    """

    term: LawTerm
    quantity: LawQuantity
    form: LawForm
    times: "Law | None" = None

    @property
    def name(self) -> str:
        if self.times is not None:
            return f"{self.times.name}_by_{self.quantity.name}"
        return f"law_{self.term.name}_{self.quantity.name}_{self.form.name}"

    @property
    def subject(self) -> tuple[str, str]:
        """Names of its term and of its quantity: what it relates, whatever its form."""
        return self.term.name, self.quantity.name

    @property
    def title(self) -> str:
        words = self.form.words.format(q=self.quantity.words)
        if self.times is not None:
            return f"What {self.times.quantity.words} does to {self.term.words} {words}"
        return f"{self.term.words[0].upper()}{self.term.words[1:]} {words}"

    def equation(self, reference: float | None = None, first: float | None = None) -> str:
        """In one line; reference: the value of r if it is known; first: that of the law that it multiplies."""
        a, g = "a", self.g_in_words(reference, "r")
        if self.times is not None:
            a, g = ("c", f"({self.times.g_in_words(first, 'r_1')}) ({g})")
        return f"{self.term.symbol} -> {self.term.symbol} exp({a} g) {self.term.where}, g = {g}"

    def g_in_words(self, reference: float | None, letter: str) -> str:
        """Its own g, without that of the law that it multiplies; letter: of a reference that is not known."""
        r = letter if reference is None else f"{signed(reference)}{self.quantity.unit_behind}"
        return self.form.equation.format(q=self.quantity.symbol, r=r)

    def g(self, cells: Cells, reference: Array | float = 1.0, first: Array | float = 1.0) -> Array:
        """g (nx, ny, m) [-]."""
        own = self.form.of(self.quantity.of(cells), reference)
        return own if self.times is None else own * self.times.g(cells, first)

    def act(
        self, cells: Cells, strength: Array, reference: Array | float = 1.0, first: Array | float = 1.0
    ) -> dict[str, Array]:
        """What its effect returns: the term with the factor exp(a g)."""
        return self.term.changed(cells, np.exp(strength * self.g(cells, reference, first) * self.term.share(cells)))

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """Its reference, and that of the law that it multiplies, where g has one."""
        of_first = () if self.times is None else _reference("first", self.times)
        return (*_reference("reference", self), *of_first)

    @property
    def effect(self) -> Effect:
        strongest, letter = self.form.strongest, "a" if self.times is None else "c"
        return Effect(
            name=self.name,
            stage=self.term.stage,
            title=self.title,
            equation=self.equation(),
            act=self.act,
            amplitude=Amplitude("strength", "-", f"strength {letter}", PLAUSIBLE_STRENGTH, -strongest, strongest),
            shapes=self.shapes,
            source="definition",
            checked=True,
            tags=("law",),
        )


def _reference(name: str, law: Law) -> tuple[Shape, ...]:
    """The reference of a law as a shape of that name; none where its g has none."""
    quantity = law.quantity
    low, high = (-0.5, 0.5) if quantity.name == "along" else (1e-3 * quantity.usual, 1e3 * quantity.usual)
    shape = Shape(name, quantity.unit, f"reference r of {quantity.words}", quantity.usual, low, high, of=quantity.scale)
    return (shape,) if law.form.quantiles else ()


def _friction(cells: Cells, factor: Array) -> dict[str, Array]:
    return {"rate": cells.rate * factor}


def _everywhere(cells: Cells) -> Array:
    return np.ones_like(cells.geometry.bank)


_WITH_FACTOR = '{{"rate": cells.rate * {factor}}}'
_FLOOR = LawTerm(
    "floor", "friction of the open floor", "on the floor without plants", "resistance", "k",
    lambda cells: (1.0 - cells.geometry.bank) * (1.0 - cells.geometry.planted),
    " * (1 - cells.geometry.bank) * (1 - cells.geometry.planted)", _friction, _WITH_FACTOR,
)  # fmt: skip
_BANK = LawTerm(
    "bank", "friction of the banks", "on the banks", "resistance", "k", lambda cells: cells.geometry.bank,
    " * cells.geometry.bank", _friction, _WITH_FACTOR,
)  # fmt: skip
_PLANTS = LawTerm(
    "plants", "friction of the plants", "where plants stand", "resistance", "k", lambda cells: cells.geometry.planted,
    " * cells.geometry.planted", _friction, _WITH_FACTOR,
)  # fmt: skip
_VISCOSITY = LawTerm(
    "viscosity", "the eddy viscosity", "everywhere", "exchange", "nu", _everywhere, "",
    lambda cells, factor: {"viscosity": cells.viscosity * (factor - 1.0)},
    '{{"viscosity": cells.viscosity * ({factor} - 1)}}',
)  # fmt: skip
_ADVECTION = LawTerm(
    "advection", "the momentum that the flow carries", "everywhere", "exchange", "h U U", _everywhere, "",
    lambda cells, factor: dispersion(cells, factor - 1.0), "dispersion(cells, {factor} - 1)",
)  # fmt: skip

_DEPTH = LawQuantity("depth", "the depth", "h", "m", lambda cells: cells.depth, "cells.depth", 0.5, "depth")
_SPEED = LawQuantity("speed", "the speed", "|U|", "m/s", lambda cells: cells.speed, "cells.speed", 1.0, "speed")
_FROUDE = LawQuantity(
    "froude", "the Froude number", "F", "-",
    lambda cells: cells.speed / np.sqrt(GRAVITY * cells.depth.clip(LEAST_DEPTH_OF_POWER * cells.geometry.depth_scale)),
    f"cells.speed / np.sqrt({GRAVITY} * cells.depth.clip({LEAST_DEPTH_OF_POWER} * cells.geometry.depth_scale))", 0.2,
)  # fmt: skip
_SHEAR = LawQuantity(
    "shear", "the lateral shear", "(|du/dy| h/|U|)", "-", lambda cells: np.abs(cells.u_y) * cells.depth / cells.speed,
    "np.abs(cells.u_y) * cells.depth / cells.speed", 0.3,
)  # fmt: skip
_ALONG_CHANNEL = LawQuantity(
    "along", "the place along the channel", "x/L", "-", lambda cells: cells.geometry.share_along,
    "cells.geometry.share_along", 0.0,
)  # fmt: skip
_OFFSET = LawQuantity(
    "offset", "the distance from the axis", "(|y|/b)", "-", lambda cells: np.abs(cells.geometry.offset),
    "np.abs(cells.geometry.offset)", 0.7,
)  # fmt: skip
_FRONT = LawQuantity(
    "front", "the distance from the front of a patch", "d", "m", lambda cells: cells.geometry.front,
    "cells.geometry.front", 0.5, "patch_length",
)  # fmt: skip
_EDGE = LawQuantity(
    "edge", "the distance from the side of a patch", "d", "m", lambda cells: np.abs(cells.geometry.edge),
    "np.abs(cells.geometry.edge)", 0.33, "patch_width",
)  # fmt: skip

_STEMS = LawQuantity(
    "stems", "the stems of the patch", "(m/m_0)", "-", lambda cells: cells.geometry.relative_stems,
    "cells.geometry.relative_stems", 1.0,
)  # fmt: skip

# Quantiles of what was seen at which references are tried: so many that a reference between two of them changes little.
_EVERYWHERE = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
# g of -2.3 to 2.3, -1 to 2, -1/2 to 1/2 and 0 to 1: held where q is ten or three times r, since no data reach there.
_POWER = LawForm(
    "power", "changes as a power of {q}", lambda q, r: np.log(np.clip(q / r, 0.1, 10.0)),
    "np.log(np.clip({q} / {r}, 0.1, 10))", "ln({q}/{r}), {q}/{r} within 0.1 to 10", (0.5,),
)  # fmt: skip
_RAMP = LawForm(
    "ramp", "changes evenly with {q}", lambda q, r: np.minimum(q / r, 3.0) - 1.0,
    "np.minimum({q} / {r}, 3) - 1", "{q}/{r} - 1, at most 2", (0.5,),
)  # fmt: skip
_STEP = LawForm(
    "step", "changes at one value of {q}", lambda q, r: 0.5 * np.tanh(5.0 * (np.minimum(q / r, 3.0) - 1.0)),
    "0.5 * np.tanh(5 * (np.minimum({q} / {r}, 3) - 1))", "tanh(5 ({q}/{r} - 1)) / 2", _EVERYWHERE,
)  # fmt: skip
_HUMP = LawForm(
    "hump", "differs around one value of {q}", lambda q, r: np.exp(-(((np.minimum(q / r, 3.0) - 1.0) / 0.4) ** 2)),
    "np.exp(-(((np.minimum({q} / {r}, 3) - 1) / 0.4) ** 2))", "exp(-(({q}/{r} - 1)/0.4)^2)", _EVERYWHERE,
)  # fmt: skip
# The data may lie in a tenth of the channel: then a is large, although the term changes little there.
_TREND = LawForm(
    "trend", "changes evenly with {q}", lambda q, r: q, "{q}", "{q}, -1/2 to 1/2 from end to end", strongest=8.0
)
_PART = LawForm(
    "part", "changes at one value of {q}", lambda q, r: 0.5 * np.tanh(20.0 * (q - r)),
    "0.5 * np.tanh(20 * ({q} - {r}))", "tanh(20 ({q} - {r})) / 2", _EVERYWHERE,
)  # fmt: skip
_STRETCH = LawForm(
    "stretch", "differs in one stretch of the channel", lambda q, r: np.exp(-(((q - r) / 0.2) ** 2)),
    "np.exp(-((({q} - {r}) / 0.2) ** 2))", "exp(-(({q} - {r})/0.2)^2)", _EVERYWHERE,
)  # fmt: skip
_FADING = LawForm(
    "fading", "fades out with {q}", lambda q, r: np.exp(-q / r), "np.exp(-({q}) / {r})", "exp(-{q}/{r})", _EVERYWHERE
)

_COEFFICIENTS = (_FLOOR, _BANK, _PLANTS, _VISCOSITY)
_EVERY_TERM = (*_COEFFICIENTS, _ADVECTION)
# Which quantities are to be seen in which terms, and the forms that make sense of them.
_SENTENCES: tuple[tuple[tuple[LawTerm, ...], tuple[LawQuantity, ...], tuple[LawForm, ...]], ...] = (
    (_EVERY_TERM, (_DEPTH, _SPEED, _FROUDE), (_POWER, _RAMP, _STEP, _HUMP)),
    # A flux that grows with the shear mixes backwards somewhere: moving water finds no steady flow with it.
    (_COEFFICIENTS, (_SHEAR,), (_POWER, _RAMP, _STEP, _HUMP)),
    (_EVERY_TERM, (_ALONG_CHANNEL,), (_TREND, _PART, _STRETCH)),
    (_EVERY_TERM, (_OFFSET,), (_RAMP, _STEP, _HUMP)),
    ((_PLANTS, _VISCOSITY, _ADVECTION), (_FRONT,), (_FADING,)),
    ((_FLOOR, _PLANTS, _VISCOSITY, _ADVECTION), (_EDGE,), (_FADING,)),
    ((_PLANTS,), (_STEMS,), (_POWER,)),
)
LAWS: dict[str, Law] = {
    law.name: law
    for terms, quantities, forms in _SENTENCES
    for law in (Law(term, quantity, form) for term in terms for quantity in quantities for form in forms)
}
# By what a law is multiplied: the even form of each quantity, which shows whether one changes with the other at all.
_EVEN = {
    "depth": "ramp", "speed": "ramp", "froude": "ramp", "shear": "ramp", "along": "trend", "offset": "ramp",
    "front": "fading", "edge": "fading", "stems": "power",
}  # fmt: skip
PRODUCTS: dict[str, tuple[Law, ...]] = {
    name: tuple(
        replace(other, times=law)
        for other in LAWS.values()
        if other.term == law.term and other.quantity != law.quantity and other.form.name == _EVEN[other.quantity.name]
    )
    for name, law in LAWS.items()
}
# Laws that only restate an effect of the list, within the range in which they are not held.
SAME_AS = {
    "law_bank_along_trend": "bank_trend",
    "law_floor_along_trend": "bed_trend",
    "law_bank_depth_power": "depth_dependent_bank",
    "law_floor_depth_power": "depth_dependent_bed",
}
EFFECTS = tuple(law.effect for law in LAWS.values())
EFFECTS_OF_PRODUCTS = tuple(product.effect for some in PRODUCTS.values() for product in some)
