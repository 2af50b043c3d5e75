"""A law as an effect file that a person can read, rename and keep, in the form of docs/own_effect.md.

A case names one such file: where it has one of its own, the law is written below what stands there.
"""

from collections.abc import Sequence
from pathlib import Path

from vegglue.diagnosis.discovered import LawFound
from vegglue.effects.grammar import Law, signed
from vegglue.effects.library import library
from vegglue.errors import InputError

IMPORTS = "import numpy as np\nfrom vegglue.effects.definition import Amplitude, Effect, SeenRange\n"
OF_FLUXES = "from vegglue.effects.exchange import dispersion\n"
FUNCTION = '''

def {name}(cells, strength):
    """{equation}."""
    g = {g}
    return {change}
'''
EFFECT = """Effect(
    name="{name}", stage="{stage}", act={name},
    title="{title}",
    equation="{equation}",
    source="found by `vegglue discover`; seen for {seen}",
    amplitude=Amplitude("strength", "-", "strength {letter} of the law", scale={scale:.2g}, low={low:g}, high={high:g}),
    seen=SeenRange("{symbol}", "{unit}", lambda cells: {quantity}, {least:.2g}, {most:.2g}),
)"""


def effect_name(found: LawFound) -> str:
    """The name of a law as an effect of a user's own: bank_speed_step."""
    return found.law.name.removeprefix("law_")


def effect_text(laws: Sequence[LawFound], own: Path | None) -> str:
    """The file of a law, and of its product where it has one; own: that of the case, whose effects are kept.

    Errors: InputError where it has one of these names already.
    """
    known = library(own)
    for name in map(effect_name, laws):
        if name in known:
            raise InputError(f"{own}: the effect `{name}` exists already; rename it there, then run discover again.")
    before = IMPORTS if own is None else own.read_text(encoding="utf-8").rstrip() + "\n\n\n" + IMPORTS
    parts = [_parts(found) for found in laws]
    functions = "".join(FUNCTION.format(**part) for part in parts)
    before += OF_FLUXES if "dispersion(" in functions else ""
    effects = ", ".join([*(["*EFFECTS"] if own is not None else []), *(EFFECT.format(**part) for part in parts)])
    return f"{before}{functions}\n\nEFFECTS = ({effects},)\n"


def _parts(found: LawFound) -> dict[str, object]:
    """What stands in the templates for a law."""
    law = found.law
    factor = f"np.exp(strength * g{law.term.written})"
    change = law.term.change.format(factor=factor)
    g = _written(law, found.reference)
    if law.times is not None:
        g = f"({_written(law.times, found.first)}) * ({g})"
    return {
        "name": effect_name(found), "equation": found.equation, "seen": found.range_seen, "g": g, "change": change,
        "stage": law.term.stage, "title": law.title, "scale": found.scale, "low": -law.form.strongest,
        "high": law.form.strongest, "symbol": law.quantity.symbol, "unit": law.quantity.unit,
        "quantity": law.quantity.written, "letter": "a" if law.times is None else "c",
        "least": found.seen[0], "most": found.seen[1],
    }  # fmt: skip


def _written(law: Law, reference: float | None) -> str:
    """Its own g as code."""
    return law.form.written.format(q=law.quantity.written, r="" if reference is None else signed(reference))
