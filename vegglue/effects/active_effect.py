"""An effect with the values of its parameters, and what a stage hands on after all that act there."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.effects.definition import ADDED, Effect, Stage
from vegglue.errors import InputError


@dataclass(frozen=True)
class ActiveEffect:
    """An effect at work: values (m,) of its parameters by name, and where it acts when not everywhere.

    sections, devices: what a sensor effect is limited to; empty for all.
    """

    effect: Effect
    values: Mapping[str, Array]
    sections: tuple[str, ...] = ()
    devices: tuple[str, ...] = ()

    @property
    def on(self) -> NDArray[np.bool_]:
        """Members (m,) in which the amplitude is not at its off value."""
        return np.asarray(self.values[self.effect.amplitude.name] != self.effect.amplitude.off)


def applied(
    effects: tuple[ActiveEffect, ...], stage: Stage, surroundings: Any, neutral: Mapping[str, Array]
) -> dict[str, Array]:
    """What a stage hands on, by name, after all effects that act there, in the order given.

    surroundings: what the effects of this stage see (`surroundings`); neutral: what is handed on without any effect.
    Where the amplitude of a member is at its off value, nothing of the effect reaches it, not even a rounding.
    """
    added = ADDED.get(stage, ())
    now = dict(neutral)
    for active in effects:
        on = active.on
        if active.effect.stage != stage or not on.any():
            continue
        try:
            change = active.effect.act(surroundings, **active.values)
        except SystemExit:  # of a user's effect; it would end the command as if all were well
            raise InputError(f"The effect `{active.effect.name}` ends the program when it acts; mend it.") from None
        for name, value in change.items():
            if name in added:
                now[name] = now[name] + _chosen(on, value, np.zeros(1))
            else:
                now[name] = _chosen(on, value, now[name])
        if not added:
            surroundings = replace(surroundings, **{name: now[name] for name in change})
    return now


def _chosen(on: NDArray[np.bool_], value: Array, otherwise: Array) -> Array:
    """np.where, without a copy when all members are on."""
    if on.all():
        return np.broadcast_to(value, np.broadcast_shapes(np.shape(value), np.shape(otherwise)))
    return np.where(on, value, otherwise)
