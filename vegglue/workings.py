"""Effects of a case: which act in an experiment, with which values, and what they set before anything flows."""

import dataclasses
from collections.abc import Mapping

import numpy as np

from vegglue.effect import Acting, Array, Boundary, Effect, Ground, applied
from vegglue.effects import library
from vegglue.schema import Case, Value

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


def acting_in(case: Case, experiment: str, theta: Theta, members: int) -> tuple[Acting, ...]:
    """Effects at work in one experiment, in the order of the library."""
    order = list(library(case.effect_file))
    here = [
        (effect_of(case, name), working)
        for name, working in case.effects.items()
        if working.experiments is None or experiment in working.experiments
    ]
    here.sort(key=lambda pair: order.index(pair[0].name))
    return tuple(
        Acting(
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


def lifted(acting: tuple[Acting, ...], ground: Ground) -> Array:
    """By how much members' beds lie higher, (nx, ny, m) [m]; empty when no effect says so."""
    nothing = np.zeros((0, 0, 0))
    if not any(one.effect.stage == "site" and one.on.any() for one in acting):
        return nothing
    members = len(next(iter(acting[0].values.values())))
    change = applied(acting, "site", ground, {"bed": np.zeros((*ground.bed.shape[:2], members))})
    return np.ascontiguousarray(change["bed"])


def bounded(acting: tuple[Acting, ...], boundary: Boundary) -> Boundary:
    """What enters and leaves after the effects of the stage boundary."""
    neutral = {item.name: getattr(boundary, item.name) for item in dataclasses.fields(boundary) if item.name != "place"}
    return Boundary(**applied(acting, "boundary", boundary, neutral), place=boundary.place)
