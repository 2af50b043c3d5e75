"""The grammar of laws: terms, quantities and forms, and which of them make sense together; see `law`."""

from dataclasses import replace

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.exchange import dispersion
from vegglue.effects.law import Law, LawForm, LawQuantity, LawTerm
from vegglue.effects.physical_constants import GRAVITY
from vegglue.effects.resistance import LEAST_DEPTH_OF_POWER
from vegglue.effects.surroundings import Cells


def _friction(cells: Cells, factor: Array) -> dict[str, Array]:
    return {"rate": cells.rate * factor}


def _mixing(cells: Cells, factor: Array) -> dict[str, Array]:
    return {"viscosity": cells.viscosity * (factor - 1.0)}


def _advection(cells: Cells, factor: Array) -> dict[str, Array]:
    return dispersion(cells, factor - 1.0)


def _everywhere(cells: Cells) -> Array:
    return np.ones_like(cells.geometry.bank)


def _open_floor(cells: Cells) -> Array:
    return (1.0 - cells.geometry.bank) * (1.0 - cells.geometry.planted)


_WITH_FACTOR = '{{"rate": cells.rate * {factor}}}'
_FLOOR = LawTerm(
    "floor", "friction of the open floor", "on the floor without plants", "resistance", "k", _open_floor,
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
    "viscosity", "the eddy viscosity", "everywhere", "exchange", "nu", _everywhere, "", _mixing,
    '{{"viscosity": cells.viscosity * ({factor} - 1)}}',
)  # fmt: skip
_ADVECTION = LawTerm(
    "advection", "the momentum that the flow carries", "everywhere", "exchange", "h U U", _everywhere, "", _advection,
    "dispersion(cells, {factor} - 1)",
)  # fmt: skip

_DEPTH = LawQuantity("depth", "the depth", "h", "m", lambda cells: cells.depth, "cells.depth", 0.5)
_SPEED = LawQuantity("speed", "the speed", "|U|", "m/s", lambda cells: cells.speed, "cells.speed", 0.5)
_FROUDE = LawQuantity(
    "froude", "the Froude number", "F", "-",
    lambda cells: cells.speed / np.sqrt(GRAVITY * cells.depth.clip(LEAST_DEPTH_OF_POWER)),
    f"cells.speed / np.sqrt({GRAVITY} * cells.depth.clip({LEAST_DEPTH_OF_POWER}))", 0.2,
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
    "cells.geometry.front", 2.0,
)  # fmt: skip
_EDGE = LawQuantity(
    "edge", "the distance from the side of a patch", "d", "m", lambda cells: np.abs(cells.geometry.edge),
    "np.abs(cells.geometry.edge)", 0.5,
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
# By what a law is multiplied: the even form of each quantity, which says whether the one changes with the other at all.
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
