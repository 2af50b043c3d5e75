"""What a law is that no list holds: a term of the equations changes with what is there.

    k -> k exp(a g),   nu -> nu exp(a g),   h U U -> h U U exp(a g)

with g a pure number of the size of 1, to first order a factor 1 + a g. The last is a flux of momentum that the mean
velocity does not carry, (exp(a g) - 1) h U U, as `dispersion` is with a constant.

A law is a term, a quantity and a form: friction of the banks, with the speed, as a step. exp keeps every term above 0.
Quantities q are measured by a reference r, a quantile of what the data have seen; a form makes g of q and r, which is 0
at q = r, or 1 there (or at q = 0) and falls off. Each law is an effect
as any other, with the tag `law`, which the search of a diagnosis leaves out. A product c g_1 g_2 is a law beside the
law a g_1 that it belongs to: what the one quantity does then changes evenly with another.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.definition import Amplitude, Effect, Shape, Stage
from vegglue.effects.surroundings import Cells

# A plausible size a [-]: a term changes by a half where g is 1.
PLAUSIBLE_STRENGTH = 0.5


@dataclass(frozen=True)
class LawTerm:
    """What a law changes. share: where, 1 or 0 in each cell; symbol: of the term; written: share as code, a factor;
    changed: what the term is with a factor on it, as an effect says it; change: the same as code.
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
    """What a law depends on. of: q in each cell; written: the same as code; usual: a usual value, the reference unless
    told.
    """

    name: str
    words: str
    symbol: str
    unit: str
    of: Callable[[Cells], Array]
    written: str
    usual: float

    @property
    def unit_behind(self) -> str:
        """The unit with a space before it; nothing for a pure number."""
        return "" if self.unit == "-" else f" {self.unit}"


def signed(reference: float) -> str:
    """A reference as it stands in a formula: in brackets below 0."""
    return f"({reference:g})" if reference < 0.0 else f"{reference:g}"


@dataclass(frozen=True)
class LawForm:
    """How g follows from q and r, as a function, as code and as text; quantiles: of the q that the data have seen, to
    be tried as r (none: g has no r); strongest: end of the support of a on either side, a factor of 20 where g is 1.
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
    """A law of the grammar, `effect` as the library lists it; times: the law whose g its own g is multiplied by, which
    has a reference of its own, `first`.
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
        """Names of its term and of its quantity: what a law says, whatever its form."""
        return self.term.name, self.quantity.name

    @property
    def title(self) -> str:
        words = self.form.words.format(q=self.quantity.words)
        if self.times is not None:
            return f"What {self.times.quantity.words} does to {self.term.words} {words}"
        return f"{self.term.words[0].upper()}{self.term.words[1:]} {words}"

    def equation(self, reference: float | None = None, first: float | None = None) -> str:
        """In one line; reference: the value of r, where it is known; first: the same of the law that it multiplies."""
        a, g = ("a", self.g_in_words(reference, "r"))
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
            act=partial(_by_law, self),
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
    shape = Shape(name, quantity.unit, f"reference r of {quantity.words}", quantity.usual, low, high)
    return (shape,) if law.form.quantiles else ()


def _by_law(
    law: Law, cells: Cells, strength: Array, reference: Array | float = 1.0, first: Array | float = 1.0
) -> dict[str, Array]:
    return law.term.changed(cells, np.exp(strength * law.g(cells, reference, first) * law.term.share(cells)))
