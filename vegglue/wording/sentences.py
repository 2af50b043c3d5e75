"""Values as words: each class of values has one macro of its own name in `templates/`, for terminal and page."""

import html
import math
import os
import re
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from functools import cache
from hashlib import sha256
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from vegglue.wording.numbers import (
    MINUS,
    NARROW,
    Written,
    as_given,
    chance_in_words,
    decimals_between,
    duration_in_short,
    experiments_in_words,
    fixed,
    in_digits,
    interval,
    listed,
    nearest,
    percent,
    plus_minus,
    range_in_digits,
    section_in_words,
    short,
    shown_path,
    sized,
    so_many,
    symbol_html,
    telling_digits,
    unit_html,
    with_unit,
)

if TYPE_CHECKING:
    from jinja2 import Environment

# Where compiled templates are kept.
KEPT = Path(__file__).parent / "__pycache__"
# What every page has in it, by its name in the templates.
INLINED = (("style", "page.css"), ("script", "sections.js"))


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


def sentences(values: Iterable[Any]) -> tuple[str, ...]:
    """Render several values, without those that render to nothing."""
    return tuple(text for text in map(sentence, values) if text)


def page_sentence(value: Any) -> str:
    """Render a value as HTML of the page by the same macro: symbols and units set as in print, commands as code."""
    return as_code(html.escape(value)) if isinstance(value, str) else page_phrase(tag_of(value), value)


def lines_of(value: Any) -> list[str]:
    """Render a value that is laid out in several lines of plain text."""
    return layout(tag_of(value), value).split("\n")


def layout(macro: str, *values: Any) -> str:
    """The macro of that name as it is laid out, in several lines of plain text."""
    return "\n".join(line.rstrip() for line in str(macros()[macro](*values)).strip("\n").split("\n"))


def phrase(macro: str, *values: Any) -> str:
    """A part of a sentence: the macro of that name, rendered on one line of plain text."""
    return " ".join(str(macros()[macro](*values)).split())


def page_phrase(macro: str, *values: Any) -> str:
    """The same as HTML of the page."""
    return as_code(re.sub(r"[ \t\n]+", " ", str(macros(page=True)[macro](*values))).strip())


def as_code(text: str) -> str:
    """HTML with commands in `backticks` set as code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", text)


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


def _listed(parts: Iterable[Any]) -> Written:
    given = list(parts)
    marked = [one.__html__() if hasattr(one, "__html__") else html.escape(str(one)) for one in given]
    return Written(listed([str(one) for one in given]), listed(marked))


# How templates write what they are given: plain text, and HTML of the page.
WRITTEN_BY: dict[str, Callable[..., Any]] = {
    "digits": lambda value, figures=3: Written(in_digits(value, figures), short(value, figures)),
    "fixed": lambda value, places: Written(f"{round(value, places) + 0.0:.{places}f}", fixed(value, places)),
    "general": lambda value, figures: f"{value:.{figures}g}",
    "quantity": with_unit,
    "unit": lambda unit: with_unit_only(unit),
    "percent": lambda share: Written(
        percent(share).replace(NARROW, " ").replace(MINUS, "-"), html.escape(percent(share))
    ),
    "p_equals": lambda p: Written(
        "p < 0.001" if p < 0.001 else f"p = {p:.2g}", f"p &lt;{NARROW}0.001" if p < 0.001 else f"p = {short(p, 2)}"
    ),
    "p_value": lambda p: Written(
        "< 0.001" if p < 0.001 else f"{p:.2g}", f"&lt;{NARROW}0.001" if p < 0.001 else short(p, 2)
    ),
    "plus_minus": lambda value, sd: Written(
        f"{in_digits(value, telling_digits(value - sd, value + sd))} ± {in_digits(sd, 2)}", plus_minus(value, sd)
    ),
    "exponential": math.exp,
    "power_of_ten": lambda value, sd: Written(f"10^({value:.2f} ± {sd:.2f})", f"10<sup>{plus_minus(value, sd)}</sup>"),
    "as_given": lambda value, sd=float("nan"): as_given(value, sd),
    "interval": lambda ends: Written(
        " to ".join(f"{round(end, decimals_between(*ends)) + 0.0:.{decimals_between(*ends)}f}" for end in ends),
        interval(*ends),
    ),
    "sized": lambda value, ends, unit="-": sized(value, ends[0], ends[1], unit),
    "symbol": lambda name, written="": Written(name, symbol_html(written or name)),
    "code": lambda text: Written(text, f"<code>{html.escape(text)}</code>"),
    "command": lambda text: Written(f"`{text}`", f"<code>{html.escape(text)}</code>"),
    "strong": lambda text: Written(str(text), f"<b>{html.escape(str(text))}</b>"),
    "link": lambda text, target: Written(text, f'<a href="{html.escape(target)}">{html.escape(text)}</a>'),
    "bare_unit": lambda unit: Written(unit, unit_html(unit)),
    "lower_first": lambda text: f"{str(text)[:1].lower()}{str(text)[1:]}",
    "upper_first": lambda text: f"{str(text)[:1].upper()}{str(text)[1:]}",
    "listed": _listed,
    "many": so_many,
    "nearest": nearest,
    "chance": chance_in_words,
    "experiments": experiments_in_words,
    "path": shown_path,
    "quoted": lambda names: [f"`{name}`" for name in names],
    "range": range_in_digits,
    "duration": duration_in_short,
}


def with_unit_only(unit: str) -> Written:
    """A unit with the space before it; nothing for '-'."""
    return Written("", "") if unit in ("", "-") else Written(f" {unit}", f"{NARROW}{unit_html(unit)}")


def page_document(template: str, **values: Any) -> str:
    """A page of `page/`, with the style and the script that all pages share."""
    environment = _environment(page=True, folder="page")
    shared = {name: (Path(__file__).parent / "page" / file).read_text(encoding="utf-8") for name, file in INLINED}
    return environment.get_template(template).render(**shared, **values)


def file_text(template: str, values: Mapping[str, Any]) -> str:
    """The text of a file that a user is given, by its template in `files/`."""
    return _environment(page=False, folder="files").get_template(template).render(values) + "\n"


@cache
def macros(page: bool = False) -> dict[str, Callable[..., str]]:
    """All macros of all templates by name; page: those that write HTML.

    Each template is compiled when one of its macros is first called: all of them take half a second.

    Raises
    ------
    ValueError
        If two templates define the same macro.
    """
    environment = _environment(page, "templates")
    module_of = cache(lambda template: environment.get_template(template).module)
    found: dict[str, Callable[..., str]] = {}
    for template in sorted((Path(__file__).parent / "templates").glob("*.j2")):
        for macro in re.findall(r"{%-? *macro ([a-z]\w*)\(", template.read_text(encoding="utf-8")):
            if macro in found:
                raise ValueError(f"{template.name}: expected each macro once, got {macro} again; rename one of both.")
            found[macro] = lambda *given, of=template.name, macro=macro: getattr(module_of(of), macro)(*given)
    return found


@dataclass(frozen=True)
class KeptTemplates:
    """Compiled templates, kept between runs beside the byte code of Python, as Jinja keeps them in memcached: what
    cannot be read or written there is compiled anew.

    Templates of a page take 0.4 s to compile.
    """

    stamp: bytes  # of all that templates are compiled with, beside their own text

    def get(self, key: str) -> bytes:
        """The code kept under a name, b"" if it was compiled with anything else."""
        stamp, _, code = (KEPT / f"{key}.jinja").read_bytes().partition(b"\n")
        return code if stamp == self.stamp else b""

    def set(self, key: str, value: bytes, timeout: int | None = None) -> None:
        """Keep code under a name, for good."""
        new = KEPT / f"{key}.{os.getpid()}.new"
        new.write_bytes(self.stamp + b"\n" + value)
        new.replace(KEPT / f"{key}.jinja")  # whole, or not at all


@cache
def _stamp() -> bytes:
    """Of the files with what templates write numbers by: Jinja does so as it compiles, if a number is constant."""
    files = sorted(Path(__file__).parent.glob("*.py"))
    return sha256(b"".join(file.read_bytes() for file in files)).hexdigest().encode()


def _environment(page: bool, folder: str) -> "Environment":
    # Jinja takes 50 ms to import, which a refused config need not wait for.
    from jinja2 import Environment, MemcachedBytecodeCache, PackageLoader, StrictUndefined

    kept = None
    if not sys.dont_write_bytecode:
        kept = MemcachedBytecodeCache(KeptTemplates(_stamp()), prefix="html-" if page else "text-")
    environment = Environment(
        loader=PackageLoader("vegglue.wording", folder), undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, autoescape=page, bytecode_cache=kept,
    )  # fmt: skip
    environment.filters |= WRITTEN_BY
    environment.globals |= {
        "digits_of_range": telling_digits,
        "sentence": (lambda value: Written(sentence(value), page_sentence(value))) if page else sentence,
        "phrase": (lambda *given: Written(phrase(*given), page_phrase(*given))) if page else phrase,
        "infinity": math.inf,
        "so_many": so_many,
        "section_at": section_in_words,
        "tag_of": tag_of,
    }
    return environment
