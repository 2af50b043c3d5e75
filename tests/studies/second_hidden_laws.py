"""The hidden laws of `hidden_laws` as effects of the second solver, on its own quantities."""

from collections.abc import Callable
from functools import partial

import numpy as np
from hidden_laws import HIDDEN_LAWS, HiddenLaw
from second_effects import Effect, State, shear
from second_kernels import GRAVITY
from second_solver import Field

# Speed [m/s] at which a ratio to the speed is held: at rest there is none.
LEAST_SPEED = 1e-3

_OF_STATE: dict[str, Callable[[State], Field]] = {
    "depth": lambda s: s.h,
    "speed": lambda s: s.speed,
    "froude": lambda s: s.speed / np.sqrt(GRAVITY * np.maximum(s.h, 0.02)),
    "shear": lambda s: shear(s) * s.h / np.maximum(s.speed, LEAST_SPEED),
    "along": lambda s: s.lie.x / s.length - 0.5,
    "offset": lambda s: np.abs(s.eta),
    "front": lambda s: s.lie.front,
    "edge": lambda s: np.abs(s.lie.edge),
}
_SHARE: dict[str, Callable[[State], Field | float]] = {
    "floor": lambda s: s.open_floor,
    "bank": lambda s: s.lie.bank,
    "plants": lambda s: s.lie.cover,
    "viscosity": lambda s: 1.0,
}


def _factor(law: HiddenLaw, s: State, strength: float, reference: float) -> Field:
    other = _OF_STATE[law.other](s) if law.other else None
    g = law.g(_OF_STATE[law.quantity](s), other, reference)
    return np.exp(strength * g * _SHARE[law.term](s))


def _drag(law: HiddenLaw, s: State, strength: float, reference: float) -> Field:
    return s.k * _factor(law, s, strength, reference)


def _added(law: HiddenLaw, s: State, strength: float, reference: float) -> Field:
    return s.nu * (_factor(law, s, strength, reference) - 1.0)


# k [1/m], and viscosity added [m2/s].
LAW_DRAG: dict[str, Effect] = {law.name: partial(_drag, law) for law in HIDDEN_LAWS if law.term != "viscosity"}
LAW_MIXING: dict[str, Effect] = {law.name: partial(_added, law) for law in HIDDEN_LAWS if law.term == "viscosity"}
