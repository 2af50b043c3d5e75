"""Effects of a case: which act in an experiment, and with which values."""

from collections.abc import Mapping

import numpy as np

from vegglue.arrays import Array
from vegglue.case.parts import Value
from vegglue.case.schema import Case
from vegglue.effects.active_effect import ActiveEffect
from vegglue.effects.definition import Effect
from vegglue.effects.library import library

Theta = Mapping[str, Array]


def value_of(value: Value, theta: Theta, members: int) -> Array:
    """A number for all members, or the parameter of that name, (members,)."""
    if isinstance(value, str):
        return np.array(theta[value], dtype=np.float64)
    return np.full(members, float(value))


def effect_of(case: Case, name: str) -> Effect:
    """The effect that an entry of `effects` puts to work."""
    return library(case.effect_file)[case.effects[name].effect or name]


def amplitude_of(case: Case, name: str) -> str | None:
    """The parameter that is the amplitude of an entry of `effects`; None when it is a number."""
    value = case.effects[name].values.get(effect_of(case, name).amplitude.name)
    return value if isinstance(value, str) else None


def active_effects(case: Case, experiment: str, theta: Theta, members: int) -> tuple[ActiveEffect, ...]:
    """Effects at work in one experiment, in the order of the library."""
    order = list(library(case.effect_file))
    here = [
        (effect_of(case, name), working)
        for name, working in case.effects.items()
        if working.experiments is None or experiment in working.experiments
    ]
    here.sort(key=lambda pair: order.index(pair[0].name))
    return tuple(
        ActiveEffect(
            effect,
            {
                parameter.name: value_of(working.values.get(parameter.name, _default(parameter)), theta, members)
                for parameter in effect.parameters
            },
            working.sections,
            working.devices,
        )
        for effect, working in here
    )


def _default(parameter: object) -> float:
    return float(getattr(parameter, "default", getattr(parameter, "off", 0.0)))
