"""Laws that are hidden in the study of laws: none is in the grammar of the package, nor exactly of one of its forms.

    k -> k exp(a g),   nu -> nu exp(a g)

Each is here for the package, which sizes it and calibrates the true law, and in `second_hidden_laws` for the second
solver. This file is an effect file: the tag `law` keeps its effects out of every search.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.definition import Amplitude, Effect, Shape
from vegglue.effects.surroundings import Cells

# Range of what the data see of each quantity in each term in the short channel [unit of the quantity]: the middle half.
RANGES: dict[tuple[str, str], tuple[float, float]] = {
    ("floor", "depth"): (0.75, 1.1), ("floor", "speed"): (0.37, 0.61), ("floor", "froude"): (0.137, 0.19),
    ("floor", "shear"): (0.05, 0.26), ("floor", "along"): (-0.2, 0.2), ("floor", "offset"): (0.3, 0.7),
    ("bank", "depth"): (0.3, 0.7), ("bank", "speed"): (0.29, 0.52), ("bank", "along"): (-0.2, 0.2),
    ("bank", "offset"): (1.2, 1.7), ("plants", "depth"): (0.75, 1.0), ("plants", "speed"): (0.15, 0.4),
    ("plants", "front"): (0.7, 2.0), ("plants", "edge"): (0.2, 0.6), ("viscosity", "depth"): (0.54, 0.93),
    ("viscosity", "speed"): (0.33, 0.56), ("viscosity", "shear"): (0.09, 0.35), ("viscosity", "along"): (-0.2, 0.2),
    ("viscosity", "offset"): (0.44, 1.4), ("viscosity", "edge"): (0.3, 0.8),
}  # fmt: skip
# g of q and its reference r. Far from all that is seen g is held, as in the grammar. A threshold is 1.6 times as sharp
# as the step of the grammar: one 2.5 times as sharp, in the speed, leaves the second solver without a steady flow.
FORMS: dict[str, Callable[[Array, Array | float], Array]] = {
    "threshold": lambda q, r: 1.0 / (1.0 + np.exp(-16.0 * (np.minimum(q / r, 3.0) - 1.0))) - 0.5,
    "square": lambda q, r: np.minimum(q / r, 2.5) ** 2 - 1.0,
    "root": lambda q, r: np.sqrt(np.clip(q / r, 0.01, 10.0)) - 1.0,
    "exponential": lambda q, r: np.exp(1.0 - np.minimum(q / r, 10.0)) - 1.0,
    "hump": lambda q, r: np.exp(-(((np.minimum(q / r, 5.0) - 1.0) / 0.3) ** 2)),
    "border": lambda q, r: 1.0 / (1.0 + np.minimum(q / r, 10.0) ** 6),
    "wave": lambda q, r: np.sin(2.0 * np.pi * (q - r)),
    "bow": lambda q, r: 4.0 * (q - r) ** 2,
    "place": lambda q, r: 1.0 / (1.0 + np.exp(-100.0 * (q - r))) - 0.5,
}


@dataclass(frozen=True)
class HiddenLaw:
    """A term that changes as a form of a quantity, in a combination also evenly with another one."""

    term: str
    quantity: str
    form: str
    other: str = ""

    @property
    def name(self) -> str:
        return "_".join(filter(None, ("hidden", self.term, self.quantity, self.form, self.other)))

    @property
    def quantities(self) -> tuple[str, ...]:
        return (self.quantity, self.other) if self.other else (self.quantity,)

    def g(self, q: Array, other: Array | None, reference: Array | float) -> Array:
        """g of the values of its quantities; the other one of a combination from 1/2 to 3/2 over its range."""
        g = FORMS[self.form](q, reference)
        if other is None:
            return g
        low, high = RANGES[self.term, self.other]
        return g * (1.0 + np.clip((other - 0.5 * (low + high)) / (high - low), -0.5, 0.5))


HIDDEN_LAWS = tuple(
    HiddenLaw(*words.split())
    for words in (
        "floor speed threshold", "bank along place", "viscosity offset square", "plants front border",
        "floor along wave", "bank speed square", "viscosity depth threshold", "floor offset square",
        "bank depth exponential", "viscosity along place", "plants speed threshold", "floor shear root",
        "bank offset threshold", "viscosity offset exponential", "floor froude square", "bank along bow",
        "plants depth threshold", "viscosity speed square", "floor along place", "bank speed threshold",
        "viscosity shear threshold", "floor offset threshold", "plants edge border", "bank depth threshold along",
        "viscosity offset hump", "floor depth hump", "viscosity edge border", "floor offset square along",
        "bank speed hump", "viscosity offset threshold along",
    )
)  # fmt: skip
BY_NAME = {law.name: law for law in HIDDEN_LAWS}

_OF_CELLS: dict[str, Callable[[Cells], Array]] = {
    "depth": lambda cells: cells.depth,
    "speed": lambda cells: cells.speed,
    "froude": lambda cells: cells.speed / np.sqrt(9.81 * cells.depth.clip(0.02)),
    "shear": lambda cells: np.abs(cells.u_y) * cells.depth / cells.speed,
    "along": lambda cells: cells.geometry.share_along,
    "offset": lambda cells: np.abs(cells.geometry.offset),
    "front": lambda cells: cells.geometry.front,
    "edge": lambda cells: np.abs(cells.geometry.edge),
}
_SHARE_OF_CELLS: dict[str, Callable[[Cells], Array | float]] = {
    "floor": lambda cells: (1.0 - cells.geometry.bank) * (1.0 - cells.geometry.planted),
    "bank": lambda cells: cells.geometry.bank,
    "plants": lambda cells: cells.geometry.planted,
    "viscosity": lambda cells: 1.0,
}


def acting(law: HiddenLaw, cells: Cells, strength: Array, reference: Array) -> dict[str, Array]:
    """What a hidden law changes, as an effect of the package."""
    other = _OF_CELLS[law.other](cells) if law.other else None
    g = law.g(_OF_CELLS[law.quantity](cells), other, reference)
    factor = np.exp(strength * g * _SHARE_OF_CELLS[law.term](cells))
    if law.term == "viscosity":
        return {"viscosity": cells.viscosity * (factor - 1.0)}
    return {"rate": cells.rate * factor}


def _effect_of(law: HiddenLaw) -> Effect:
    low, high = RANGES[law.term, law.quantity]
    return Effect(
        name=law.name,
        stage="exchange" if law.term == "viscosity" else "resistance",
        title=f"A hidden law: {law.term}, {law.quantity}, {law.form}",
        equation="exp(a g)",
        act=partial(acting, law),
        # A factor of 1.6 over the range of g; hidden ones may be four times as large in ln.
        amplitude=Amplitude("strength", "-", "strength a", 0.5, -3.0, 3.0),
        shapes=(Shape("reference", "-", "reference r", 0.5 * (low + high), -10.0, 10.0, (low, high)),),
        source="definition",
        tags=("law",),
    )


EFFECTS = tuple(_effect_of(law) for law in HIDDEN_LAWS)
