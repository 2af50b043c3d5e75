"""The library of effects, listed by hand: a new one is a function in one of these files and an entry in its list."""

import importlib.util
from collections.abc import Mapping
from dataclasses import fields
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


@lru_cache
def library(own: Path | None = None) -> Mapping[str, Effect]:
    """All effects by name: those shipped, laws of the grammar and their products, then those of a user's file, which is
    run to read them.

    Errors: InputError when the file cannot be run, has no EFFECTS, or repeats a name.
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
    """The effects of a user's file, which is run. Errors: InputError when it cannot be, or has no EFFECTS."""
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
    if not isinstance(found, tuple) or not all(isinstance(effect, Effect) for effect in found):
        raise InputError(f"{shown}: expected EFFECTS = (Effect(...), ...), got {_other_effects(found)}.")
    if not found:
        raise InputError(f"{shown}: expected EFFECTS = (Effect(...), ...), got none in it; add one.")
    for effect in found:
        _refuse_wrong_kinds(effect, shown)
        _refuse_unusable(effect, shown)
    return found


def _other_effects(found: object) -> str:
    """What stands for EFFECTS in a file, and what to do."""
    if found is None:
        return "none; add it"
    if isinstance(found, Effect):
        return "one Effect; put it in brackets with a comma, (Effect(...),)"
    other = next((one for one in found if not isinstance(one, Effect)), found) if isinstance(found, tuple) else found
    return f"{type(other).__name__}; correct it"


def _refuse_wrong_kinds(effect: Effect, shown: str) -> None:
    """Errors: InputError for a declaration whose parts are not of their kind, such as a number that is text."""
    whole = isinstance(effect.shapes, tuple) and all(isinstance(one, Shape) for one in effect.shapes)
    for name, right, wanted in (
        ("amplitude", isinstance(effect.amplitude, Amplitude), "an Amplitude(...)"),
        ("shapes", whole, "a tuple (Shape(...), ...)"),
        ("act", callable(effect.act), "a function"),
    ):
        if not right:
            got = type(getattr(effect, name)).__name__
            said = f"`{name}` of the effect {effect.name!r} expected {wanted}, got {got}"
            raise InputError(f"{shown}: {said}; correct it.")
    parts: tuple[Effect | Amplitude | Shape, ...] = (effect, effect.amplitude, *effect.shapes)
    for part in parts:
        kinds = get_type_hints(type(part))
        for one in fields(part):
            value, kind = getattr(part, one.name), kinds[one.name]
            right = _is_number(value) if kind in (float, int) else isinstance(value, str) if kind is str else True
            if not right:
                wanted = "text" if kind is str else "a number"
                of = "" if part is effect else f"{part.name!r} of "
                said = f"`{one.name}` of {of}the effect {effect.name!r} expected {wanted}, got {value!r}"
                raise InputError(f"{shown}: {said}; correct it.")


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _refuse_unusable(effect: Effect, shown: str) -> None:
    """Errors: InputError for a name that no config and no command can hold, or a stage or `each` that there is not."""
    if not (effect.name.isascii() and effect.name.isidentifier()):
        said = f"expected letters, digits and underscores, got `{effect.name}`"
        raise InputError(f"{shown}: the name of an effect {said}; correct it.")
    if effect.stage not in STAGES:
        said = f"expected one of {', '.join(STAGES)}, got `{effect.stage}`"
        raise InputError(f"{shown}: the stage of `{effect.name}` {said}; correct it.")
    if effect.each not in EACH:
        said = f"expected one of {', '.join(EACH)}, got `{effect.each}`"
        raise InputError(f"{shown}: `each` of `{effect.name}` {said}; correct it.")
