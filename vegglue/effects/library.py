"""The library of effects, listed by hand: a new one is a function in one of these files and an entry in its list."""

import importlib.util
from collections.abc import Mapping
from dataclasses import fields, replace
from functools import lru_cache
from numbers import Real
from pathlib import Path
from types import MappingProxyType
from typing import get_type_hints

from vegglue.effects import boundary, exchange, force, grammar, plants, resistance, sensor, site, unlisted
from vegglue.effects.definition import EACH, STAGES, Amplitude, Effect, Shape
from vegglue.errors import InputError, shown_path

SHIPPED: tuple[Effect, ...] = (
    *site.EFFECTS,
    *boundary.EFFECTS,
    *plants.EFFECTS,
    *resistance.EFFECTS,
    *exchange.EFFECTS,
    *force.EFFECTS,
    *sensor.EFFECTS,
    *unlisted.EFFECTS,
)
for _act, _effect in {effect.act: effect for effect in SHIPPED}.items():
    _act.__doc__ = _effect.docstring


@lru_cache
def library(own: Path | None = None) -> Mapping[str, Effect]:
    """All effects by name.

    Parameters
    ----------
    own
        A user's file of effects, which is run to read them.

    Returns
    -------
    Mapping
        The effects shipped, laws of the grammar and their products, then those of the file.

    Raises
    ------
    InputError
        If the file cannot be run, has no EFFECTS, or repeats a name.
    """
    known = {effect.name: effect for effect in (*SHIPPED, *grammar.EFFECTS, *grammar.EFFECTS_OF_PRODUCTS)}
    if own is None:
        return MappingProxyType(known)
    for effect in effects_of(own):
        if effect.name in known:
            raise InputError(f"{shown_path(own)}: the effect `{effect.name}` exists already; give yours another name.")
        known[effect.name] = effect
    return MappingProxyType(known)


def effects_of(path: Path) -> tuple[Effect, ...]:
    """The effects of a user's file, which is run.

    Raises
    ------
    InputError
        If the file cannot be run, has no EFFECTS, or declares an effect that no command could use.
    """
    shown = shown_path(path)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise InputError(f"{shown}: expected a Python file (.py) with a tuple EFFECTS; correct `effect_file`.")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # whatever a file of the user's may raise
        raise InputError(f"{shown}: cannot be run: {type(error).__name__}: {error}; mend it.") from None
    found = getattr(module, "EFFECTS", None)
    found = tuple(found) if isinstance(found, list) else found
    others = [one for one in found if not isinstance(one, Effect)] if isinstance(found, tuple) else [found]
    if others or not found:
        got = None if found is None else type(others[0]).__name__ if others else ""
        raise InputError("no_effects_in_file", file=path, got=got)
    for effect in found:
        shapes = isinstance(effect.shapes, tuple) and all(isinstance(one, Shape) for one in effect.shapes)
        for name, right, wanted in (
            ("amplitude", isinstance(effect.amplitude, Amplitude), "an Amplitude(...)"),
            ("shapes", shapes, "a tuple (Shape(...), ...)"),
            ("act", callable(effect.act), "a function"),
        ):
            if not right:
                got = type(getattr(effect, name)).__name__
                raise InputError(
                    f"{shown}: `{name}` of the effect {effect.name!r} expected {wanted}, got {got}; correct it."
                )
        parts: tuple[Effect | Amplitude | Shape, ...] = (effect, effect.amplitude, *effect.shapes)
        for part in parts:
            kinds = get_type_hints(type(part))
            for one in fields(part):
                value, kind = getattr(part, one.name), kinds[one.name]
                number = isinstance(value, Real) and not isinstance(value, bool)
                if (kind in (float, int) and not number) or (kind is str and not isinstance(value, str)):
                    place = f"`{one.name}` of " + ("" if part is effect else f"{part.name!r} of ")
                    wanted = "text" if kind is str else "a number"
                    raise InputError(
                        f"{shown}: {place}the effect {effect.name!r} expected {wanted}, got {value!r}; correct it."
                    )
        for place, value, right, wanted in (
            ("the name of an effect", effect.name, effect.name.isascii() and effect.name.isidentifier(),
             "letters, digits and underscores"),
            (f"the stage of `{effect.name}`", effect.stage, effect.stage in STAGES, f"one of {', '.join(STAGES)}"),
            (f"`each` of `{effect.name}`", effect.each, effect.each in EACH, f"one of {', '.join(EACH)}"),
        ):  # fmt: skip
            if not right:
                raise InputError(f"{shown}: {place} expected {wanted}, got `{value}`; correct it.")
    return tuple(replace(effect, from_file=True) for effect in found)
