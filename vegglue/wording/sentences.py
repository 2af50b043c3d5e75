"""Values as sentences: each class of findings has one macro of its own name in `templates/`."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from pathlib import PurePath
from typing import Any

from vegglue.errors import shown_path
from vegglue.wording.numbers import (
    chance_in_words,
    duration_in_short,
    experiments_in_words,
    in_digits,
    listed,
    odds_in_digits,
    place_in_digits,
    range_in_digits,
    section_in_words,
    so_many,
    telling_digits,
)  # fmt: skip


def sentence(value: Any) -> str:
    """Render a value by the macro that bears the name of its class.

    Parameters
    ----------
    value : dataclass instance or str
        A finding. A text is returned as it is.

    Returns
    -------
    str
        Plain text on one line; an empty text if the template prints nothing.

    Raises
    ------
    KeyError
        If no template defines a macro for the class.
    """
    if isinstance(value, str):
        return value
    return phrase(tag_of(value), value)


def phrase(macro: str, *values: Any) -> str:
    """A part of a sentence: the macro of that name, rendered on one line."""
    return " ".join(str(macros()[macro](*values)).split())


def sentences(values: Any) -> tuple[str, ...]:
    """Render several values, without those that render to nothing."""
    return tuple(text for text in map(sentence, values) if text)


def tag_of(value: Any) -> str:
    """`parameter_far_from_prior` of the class ParameterFarFromPrior and of its instances."""
    name = (value if isinstance(value, type) else type(value)).__name__
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def tagged(value: Any) -> Any:
    """A value as plain JSON objects: a dataclass becomes its fields and its tag under `kind`."""
    if is_dataclass(value) and not isinstance(value, type):
        own = {one.name: tagged(getattr(value, one.name)) for one in fields(value)}
        return {"kind": tag_of(value), **own} if "kind" not in own else {"tag": tag_of(value), **own}
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): tagged(one) for key, one in value.items()}
    if isinstance(value, tuple | list):
        return [tagged(one) for one in value]
    return value


@cache
def macros() -> dict[str, Callable[..., str]]:
    """All macros of all templates by name.

    Raises
    ------
    ValueError
        If two templates define the same macro.
    """
    # Jinja takes 50 ms to import, which a refused config need not wait for.
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("vegglue", "wording/templates"), undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, autoescape=False,
    )  # fmt: skip
    environment.filters |= {
        "digits": in_digits,
        "listed": listed,
        "many": so_many,
        "duration": duration_in_short,
        "chance": chance_in_words,
        "odds": odds_in_digits,
        "experiments": experiments_in_words,
        "range": range_in_digits,
        "path": shown_path,
        "percent": lambda share: f"{share:.0%}",
        "quoted": lambda names: [f"`{name}`" for name in names],
    }
    environment.globals |= {
        "sentence": sentence,
        "digits_of_range": telling_digits,
        "section_at": section_in_words,
        "place_at": place_in_digits,
        "tag_of": tag_of,
        "infinity": math.inf,
    }
    found: dict[str, Callable[..., str]] = {}
    for name in environment.list_templates():
        for macro, render in vars(environment.get_template(name).module).items():
            if macro.startswith("_"):
                continue
            if macro in found:
                raise ValueError(f"{name}: expected each macro once, got {macro} again; rename one of the two.")
            found[macro] = render
    return found
