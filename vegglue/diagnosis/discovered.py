"""What a search for laws has found, and a law as an effect file to read, rename and keep, as of docs/own_effect.md.

A case names one such file: if it has one of its own, the law is written below what stands there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from vegglue.calibration.laws_in_case import VALUES_SEEN
from vegglue.decision_constants import constants
from vegglue.diagnosis.refits import Refit
from vegglue.effects.grammar import Law, signed
from vegglue.effects.library import library
from vegglue.errors import InputError
from vegglue.wording.numbers import in_short
from vegglue.wording.sentences import file_text, phrase, sentence


@dataclass(frozen=True)
class LawFound:
    """A law with its reference r, its strength a and the 95 % interval of it [-].

    chance: that its term changes with its quantity, in whatever form; the law is the form that explains most.

    scale: a plausible strength; same_as: the listed effect that it restates, or empty; seen: from where to where the
    data have seen its quantity; alike: listed effects and laws that leave the same trace at the stations; first: the
    reference of the law that a product multiplies, where that has one.
    """

    law: Law
    same_as: str
    reference: float | None
    scale: float
    strength: float
    interval95: tuple[float, float]
    chance: float
    log_evidence: float
    seen: tuple[float, float]
    alike: tuple[str, ...]
    first: float | None = None

    @property
    def name(self) -> str:
        """Of the listed effect, where the law only restates it."""
        return self.same_as or self.law.name

    @property
    def unit(self) -> str:
        """Of its quantity, with a space before it; nothing for a pure number."""
        return self.law.quantity.unit_behind

    @property
    def equation(self) -> str:
        """With the references in it, the strength as a letter."""
        return self.law.equation(self.reference, self.first)

    @property
    def factor(self) -> float:
        """By what the term is larger where it differs most, over what was seen, than at the lower end of that [-]."""
        g = self.law.form.of(np.linspace(*self.seen, VALUES_SEEN), 1.0 if self.reference is None else self.reference)
        return float(np.exp(self.strength * (g - g[0])[np.abs(g - g[0]).argmax()]))

    @property
    def range_seen(self) -> str:
        """From where to where the data have seen its quantity."""
        return phrase("range_of_law", self)

    @property
    def lines(self) -> list[str]:
        """The law in words, as an equation, and how far to trust it."""
        parts = (phrase(f"{part}_of_law", self) for part in ("title", "strength", "reach", "rivals"))
        return [line for line in parts if line]


@dataclass(frozen=True)
class ProductFound:
    """found: a product of the best law with another quantity, reported as any law; refit: of it, beside that law, whose
    a is then strength_of_law [-]. found.chance: that it is what is left, among all else that could be.
    """

    found: LawFound
    refit: Refit
    strength_of_law: float

    @property
    def lines(self) -> list[str]:
        """As those of a law."""
        first, _, *further = self.found.lines
        return [first, phrase("strength_of_product", self), *further]


@dataclass(frozen=True)
class Discovery:
    """p: chance that errors alone make laws stand out as much; tried: the number of laws that had something to act on.

    laws, others: the laws, best first, and the names of other causes with their chances, that hold 95 % together; none
    where nothing is found. compared: ln evidence of all that was calibrated, by name [-];
    likeliest: the likeliest of these, where it is in the model and not in the data; product: of the best law with
    another quantity, where that law leaves a misfit.
    """

    p: float
    tried: int
    laws: tuple[LawFound, ...]
    others: dict[str, float]
    compared: Mapping[str, float] = field(default_factory=dict)
    likeliest: Refit | None = None
    product: ProductFound | None = None

    @property
    def best(self) -> LawFound | None:
        """The law that is likelier than any other cause, if there is one."""
        if not self.laws or any(chance > self.laws[0].chance for chance in self.others.values()):
            return None
        return self.laws[0]

    @property
    def enough_for_errors(self) -> bool:
        """Whether errors alone leave as much no more often than the rate of an alarm."""
        return self.p <= constants().false_alarm_rate

    @property
    def likeliest_other(self) -> tuple[str, float] | None:
        """The likeliest other cause with its chance, if there is one."""
        return max(self.others.items(), key=lambda pair: pair[1], default=None)

    @property
    def sentence(self) -> str:
        """What was found, in one sentence."""
        return sentence(self)

    def __repr__(self) -> str:
        return in_short(f"Discovery: {self.sentence}", self.lines)

    @property
    def written(self) -> tuple[LawFound, ...]:
        """What a child config holds: the best law and its product; none where it only restates a listed effect."""
        best = self.best
        if best is None or best.same_as:
            return ()
        return (best,) if self.product is None else (best, self.product.found)

    @property
    def ranked(self) -> list[list[str]]:
        """Lines of every law and other cause, the likeliest first; those of the product after its law."""
        pairs = [(law.chance, law.lines) for law in self.laws]
        pairs += [(chance, [phrase("other_cause", name, chance)]) for name, chance in self.others.items()]
        ranked = [lines for _, lines in sorted(pairs, key=lambda pair: -pair[0])]
        if self.product is not None:
            ranked.insert(1, self.product.lines)
        return ranked

    @property
    def lines(self) -> list[str]:
        """The same, one after the other."""
        return [line for lines in self.ranked for line in lines]


def effect_name(found: LawFound) -> str:
    """The name of a law as an effect of a user's own: bank_speed_step."""
    return found.law.name.removeprefix("law_")


def effect_text(laws: Sequence[LawFound], own: Path | None) -> str:
    """The file of a law, and of its product if it has one; own: that of the case, whose effects are kept.

    Errors: InputError if it has one of these names already.
    """
    known = library(own)
    for name in map(effect_name, laws):
        if name in known:
            raise InputError(f"{own}: the effect `{name}` exists already; rename it there, then run discover again.")
    parts = []
    for found in laws:
        law = found.law
        g = _written(law, found.reference)
        if law.times is not None:
            g = f"({_written(law.times, found.first)}) * ({g})"
        change = law.term.change.format(factor=f"np.exp(strength * g{law.term.written})")
        parts.append({"name": effect_name(found), "found": found, "g": g, "change": change})
    before = "" if own is None else own.read_text(encoding="utf-8").rstrip() + "\n\n\n"
    return before + file_text("effects.py.j2", {"parts": parts, "own": own is not None})


def _written(law: Law, reference: float | None) -> str:
    """Its own g as code."""
    return law.form.written.format(q=law.quantity.written, r="" if reference is None else signed(reference))
