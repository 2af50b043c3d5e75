"""Effects of a case: which act in an experiment, and with which values."""

from collections.abc import Mapping

import numpy as np

from vegglue.arrays import Array
from vegglue.case.channel_geometry import site_scales
from vegglue.case.schema import Case
from vegglue.case.site_schema import Value
from vegglue.effects.active_effect import ActiveEffect
from vegglue.effects.definition import Effect, Stage
from vegglue.effects.library import library
from vegglue.effects.scales import at_site, has_scales

Theta = Mapping[str, Array]


def value_of(value: Value, theta: Theta, members: int) -> Array:
    """A number for all members, or the values of the parameter of that name, (members,) [its unit].

    Parameters
    ----------
    theta : mapping of str to (members,)
    """
    if isinstance(value, str):
        return np.array(theta[value], dtype=np.float64)
    return np.full(members, float(value))


def effect_named(case: Case, name: str) -> Effect:
    """The effect of this name in the library, with sizes made of the scales of the case."""
    effect = library(case.effect_file)[name]
    return at_site(effect, site_scales(case)) if has_scales(effect) else effect


def effect_of(case: Case, name: str) -> Effect:
    """The effect that an entry of `effects` stands for, see `effect_named`."""
    return effect_named(case, case.effects[name].effect or name)


def parameters_of_effects(case: Case) -> set[str]:
    """Names of the parameters that stand in `effects`: amplitudes and shapes."""
    return {value for entry in case.effects.values() for value in entry.values.values() if isinstance(value, str)}


def stages_of(case: Case, parameter: str) -> set[Stage]:
    """Stages of the effects that a parameter stands in."""
    return {effect_of(case, name).stage for name, entry in case.effects.items() if parameter in entry.values.values()}


def active_effects(case: Case, experiment: str, theta: Theta, members: int) -> tuple[ActiveEffect, ...]:
    """Effects that act in one experiment, in the order of the library.

    Parameters
    ----------
    theta : mapping of str to (members,)
        Values of the parameters in their units.
    """
    order = list(library(case.effect_file))
    here = [
        (effect_of(case, name), entry)
        for name, entry in case.effects.items()
        if entry.experiments is None or experiment in entry.experiments
    ]
    here.sort(key=lambda pair: order.index(pair[0].name))
    found = []
    for effect, entry in here:
        defaults = {effect.amplitude.name: effect.amplitude.off} | {one.name: one.default for one in effect.shapes}
        given = {name: value_of(entry.values.get(name, default), theta, members) for name, default in defaults.items()}
        found.append(ActiveEffect(effect, given, entry.sections, entry.devices))
    return tuple(found)
