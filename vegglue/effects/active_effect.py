"""An effect with the values of its parameters, and what a stage hands on after all that act there."""

import traceback
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.effects.definition import ADDED, Effect, Stage
from vegglue.errors import InputError

# What numpy says of an array that nobody may write into.
READ_ONLY = "read-only"


@dataclass(frozen=True)
class ActiveEffect:
    """An effect at work: values (m,) of its parameters by name, and where it acts when not everywhere.

    sections, devices: what a sensor effect is limited to; empty for all.
    """

    effect: Effect
    values: Mapping[str, Array]
    sections: tuple[str, ...] = ()
    devices: tuple[str, ...] = ()

    @cached_property
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
        if active.effect.stage != stage or not active.on.any():
            continue
        on = active.on
        change = _change(active, surroundings, now)
        for name, value in change.items():
            if name in added:
                now[name] = now[name] + (value if on.all() else np.where(on, value, 0.0))
            else:
                now[name] = _chosen(on, value, now[name])
        if not added:
            surroundings = replace(surroundings, **{name: now[name] for name in change})
    return now


def _change(active: ActiveEffect, surroundings: Any, now: Mapping[str, Array]) -> Mapping[str, Array]:
    """What the effect makes of its surroundings; now: what the stage hands on so far.

    Errors: InputError where the effect of a user fails, or gives what the stage does not hand on.
    """
    act = active.effect.act
    if not act.__module__.startswith("vegglue."):
        return _change_by_a_stranger(active, surroundings, now)
    return act(surroundings, **active.values)


def _change_by_a_stranger(active: ActiveEffect, surroundings: Any, now: Mapping[str, Array]) -> Mapping[str, Array]:
    """What the effect of a user makes of its surroundings, which it cannot write into: others see them, too."""
    act = active.effect.act
    try:
        values = {name: _unwritable(value) for name, value in active.values.items()}
        change = act(_unwritable(surroundings), **values)
    except SystemExit:  # it would end the command as if all were well
        raise InputError(f"The effect `{active.effect.name}` ends the program when it acts; mend it.") from None
    except Exception as error:
        what, name = f"{type(error).__name__}: {error}", active.effect.name
        advice = "return new arrays, and change none that it is given" if READ_ONLY in str(error) else "mend it"
        raise InputError(f"The effect `{name}` fails when it acts{_in_line(act, error)}: {what}; {advice}.") from None
    _refuse_misfits(active.effect, change, now)
    return change


def _unwritable(given: Any) -> Any:
    """The same array, or dataclass of arrays, to be read only."""
    if isinstance(given, np.ndarray):
        seen = given.view()
        seen.flags.writeable = False
        return seen
    if not is_dataclass(given) or isinstance(given, type):
        return given
    return replace(given, **{one.name: _unwritable(getattr(given, one.name)) for one in fields(given)})


def _in_line(act: Any, error: Exception) -> str:
    """`, in line 7` of the file of a function; '' where it never began, as one that takes other names."""
    file = getattr(getattr(act, "__code__", None), "co_filename", None)
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    return f", in line {lines[-1]}" if lines else ""


def _refuse_misfits(effect: Effect, change: Any, now: Mapping[str, Array]) -> None:
    """Errors: InputError for anything but arrays by the names and of the shapes that its stage hands on."""
    expected = f"expected a dict with {' or '.join(f'`{name}`' for name in now)}"
    if not isinstance(change, Mapping):
        raise InputError(f"The effect `{effect.name}` gives {type(change).__name__}; {expected}.")
    for name, value in change.items():
        if name not in now:
            raise InputError(f"The effect `{effect.name}` gives `{name}`; {expected}.")
        if np.asarray(value).dtype.kind not in "fiub":
            got = np.asarray(value).dtype
            raise InputError(f"The effect `{effect.name}` gives `{name}`; expected real numbers, got {got}.")
        try:
            np.broadcast_shapes(np.shape(value), np.shape(now[name]))
        except ValueError:
            shapes = f"the shape {np.shape(now[name])}, got {np.shape(value)}"
            raise InputError(f"The effect `{effect.name}` gives `{name}`; expected {shapes}.") from None


def _chosen(on: NDArray[np.bool_], value: Array, otherwise: Array) -> Array:
    """np.where, without a copy when all members are on."""
    if not on.all():
        return np.where(on, value, otherwise)
    value = np.asarray(value)
    if value.shape == np.shape(otherwise):  # nearly always: to ask which shape both have takes longer than most effects
        return value
    return np.broadcast_to(value, np.broadcast_shapes(value.shape, np.shape(otherwise)))
