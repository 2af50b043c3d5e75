"""A law as an effect file that a person can read, rename and keep, in the form of docs/own_effect.md.

A case names one such file: where it has one of its own, the law is written below what stands there.
"""

from pathlib import Path

from vegglue.discovery.discovered import LawFound, signed
from vegglue.effects.library import library
from vegglue.errors import InputError

IMPORTS = "import numpy as np\nfrom vegglue.effects.definition import Amplitude, Effect, SeenRange\n"
TEXT = '''

def {name}(cells, strength):
    """{equation}."""
    g = {g}
    return {change}


EFFECTS = ({others}Effect(
    name="{name}", stage="{stage}", act={name},
    title="{title}",
    equation="{equation}",
    source="found by `vegglue discover`; seen for {seen}",
    amplitude=Amplitude("strength", "-", "strength a of the law", scale={scale:.2g}, low={low:g}, high={high:g}),
    seen=SeenRange("{symbol}", "{unit}", lambda cells: {quantity}, {least:.2g}, {most:.2g}),
),)
'''


def effect_name(found: LawFound) -> str:
    """The name of a law as an effect of a user's own: bank_speed_step."""
    return found.law.name.removeprefix("law_")


def effect_text(found: LawFound, own: Path | None) -> str:
    """The file; own: that of the case, whose effects are kept. Errors: InputError where it has this name already."""
    name = effect_name(found)
    if name in library(own):
        raise InputError(f"{own}: the effect `{name}` exists already; rename it there, then run discover again.")
    before = IMPORTS if own is None else own.read_text(encoding="utf-8").rstrip() + "\n\n\n" + IMPORTS
    reference = "" if found.reference is None else signed(found.reference)
    law = found.law
    g = law.form.written.format(q=law.quantity.written, r=reference)
    factor = f"np.exp(strength * g{law.term.written})"
    change = f'{{"rate": cells.rate * {factor}}}'
    if law.term.stage == "exchange":
        change = f'{{"viscosity": cells.viscosity * ({factor} - 1)}}'
    return before + TEXT.format(
        name=name, equation=found.equation, seen=found.range_seen, g=g, change=change, stage=law.term.stage,
        others="" if own is None else "*EFFECTS, ", title=law.title, scale=found.scale, low=-law.form.strongest,
        high=law.form.strongest, symbol=law.quantity.symbol, unit=law.quantity.unit, quantity=law.quantity.written,
        least=found.seen[0], most=found.seen[1],
    )  # fmt: skip
