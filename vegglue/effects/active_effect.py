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

# What numpy's message about writing into a read-only array contains.
READ_ONLY = "read-only"


@dataclass(frozen=True)
class ActiveEffect:
    """An effect at work in m members.

    Parameters
    ----------
    effect
        What acts.
    values
        Values (m,) of its amplitude and shapes by name, in their units.
    sections, devices
        What a sensor effect is limited to; empty: all.
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
    """What a stage hands on after all effects that act there, in the order given.

    Nothing of an effect reaches a member whose amplitude is off, not even a rounding.

    Parameters
    ----------
    effects
        Effects of all stages.
    stage
        Only effects of this stage act.
    surroundings
        What effects of this stage see, see `surroundings`.
    neutral
        What the stage hands on without any effect, by name; shapes and units as in `definition`.

    Returns
    -------
    dict
        Arrays by the names of `neutral`.

    Raises
    ------
    InputError
        If an effect from a user's file fails, or returns what its stage does not hand on.
    """
    added, now = ADDED.get(stage, ()), dict(neutral)
    for active in effects:
        if active.effect.stage != stage or not active.on.any():
            continue
        on, everywhere = active.on, active.on.all()
        if active.effect.from_file:
            change = _act_of_file(active, surroundings, now)
        else:
            change = active.effect.act(surroundings, **active.values)
        for name, value in change.items():
            if name in added:
                now[name] = now[name] + (value if everywhere else np.where(on, value, 0.0))
            elif not everywhere:
                now[name] = np.where(on, value, now[name])
            else:  # np.where without its copy; np.broadcast_shapes takes longer than most effects
                value, shape = np.asarray(value), np.shape(now[name])
                now[name] = (
                    value if value.shape == shape else np.broadcast_to(value, np.broadcast_shapes(value.shape, shape))
                )
        if not added:
            surroundings = replace(surroundings, **{name: now[name] for name in change})
    return now


def _act_of_file(active: ActiveEffect, surroundings: Any, now: Mapping[str, Array]) -> Mapping[str, Array]:
    """What an effect from a user's file returns, checked; it can write into nothing that other effects see.

    now: what the stage hands on so far. Raises InputError.
    """
    name, act = active.effect.name, active.effect.act
    try:
        values = {parameter: _unwritable(value) for parameter, value in active.values.items()}
        change = act(_unwritable(surroundings), **values)
    except SystemExit:  # it would end the command as if all were well
        raise InputError(f"The effect `{name}` ends the program when it acts; mend it.") from None
    except Exception as error:
        file = getattr(getattr(act, "__code__", None), "co_filename", None)
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
        where = f", in line {lines[-1]}" if lines else ""  # none if it takes other parameters and never began
        advice = "return new arrays, and change none that it is given" if READ_ONLY in str(error) else "mend it"
        what = f"{type(error).__name__}: {error}"
        raise InputError(f"The effect `{name}` fails when it acts{where}: {what}; {advice}.") from None
    expected = f"expected a dict with {' or '.join(f'`{known}`' for known in now)}"
    if not isinstance(change, Mapping):
        raise InputError(f"The effect `{name}` gives {type(change).__name__}; {expected}.")
    for key, value in change.items():
        if key not in now:
            raise InputError(f"The effect `{name}` gives `{key}`; {expected}.")
        if np.asarray(value).dtype.kind not in "fiub":
            kind = np.asarray(value).dtype
            raise InputError(f"The effect `{name}` gives `{key}`; expected real numbers, got {kind}.")
        try:
            np.broadcast_shapes(np.shape(value), np.shape(now[key]))
        except ValueError:
            shapes = f"the shape {np.shape(now[key])}, got {np.shape(value)}"
            raise InputError(f"The effect `{name}` gives `{key}`; expected {shapes}.") from None
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
