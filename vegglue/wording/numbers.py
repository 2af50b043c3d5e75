"""How numbers, units and symbols are written: as plain text, as HTML of the page and as mathtext of figures."""

import difflib
import html
import math
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

# Of a unit of time, from which the next one is used; below two of it, a whole number may be off by more than a quarter.
LEAST_OF_A_UNIT = 2.0
# Sizes up to which a number is written in full; beyond, as a power of ten.
LARGEST_IN_FULL = 1e5
NARROW = "\u202f"  # between a number and its unit, never broken
FIRM = "\u00a0"  # a space at which a line must not break
MINUS = "\u2212"
MOST_NAMED = 30  # words that one sentence lists; no part of a case has more keys
# Parts of a symbol that mathtext draws as they are.
LETTER, LOWERED = re.compile(r"[^\W_]+"), re.compile(r"(?:[^\W_]|[\[\] .,:+-])*")
POWER = re.compile(r"\^\(?(-?[\d/.]+)\)?|(?<=[a-z])(\d)")  # in a unit: ^(-1/3), ^2, or the 3 of m3/s


@dataclass(frozen=True)
class Written:
    """Something as it is written in plain text and, as HTML, on the page."""

    plain: str
    page: str

    def __str__(self) -> str:
        return self.plain

    def __html__(self) -> str:
        return self.page


def most_like(word: str, known: Iterable[str]) -> str:
    """The known word most like another, '' if none is."""
    return next(iter(difflib.get_close_matches(word, list(known), n=1, cutoff=0.6)), "")


def nearest(word: str, known: Iterable[str]) -> str:
    """The end of a sentence about an unknown word: the known word most like it, else all known ones.

    Not by a template: a case with an effect that is not known is refused before jinja is imported.
    """
    known = list(known)
    if near := most_like(word, known):
        return f"did you mean `{near}`?"
    more = f" and {len(known) - MOST_NAMED} more" if len(known) > MOST_NAMED else ""
    return f"known here are {', '.join(known[:MOST_NAMED]) or 'none'}{more}"


def in_short(heading: str, lines: Iterable[str]) -> str:
    """The heading, and below it the lines that are not empty, indented."""
    return "\n".join([heading, *(f"  {line}" for line in lines if line)])


def in_short_html(text: str, headings: Sequence[str] = (), rows: Sequence[Sequence[str]] = ()) -> str:
    """The text of `in_short` and a table as HTML of a notebook: all escaped, without script or style of its own."""
    heading, *lines = [html.escape(line.strip()) for line in text.split("\n")]
    parts = [f"<p><b>{heading}</b></p>"]
    if lines:
        parts.append(f"<ul>{''.join(f'<li>{line}</li>' for line in lines)}</ul>")
    if rows:
        cells = [
            "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in row)
            for tag, row in [("th", headings), *(("td", row) for row in rows)]
        ]
        body = "".join(f"<tr>{row}</tr>" for row in cells[1:])
        parts.append(f"<table><thead><tr>{cells[0]}</tr></thead><tbody>{body}</tbody></table>")
    return f"<div>{''.join(parts)}</div>"


def shown_path(path: Path) -> str:
    """The path as sentences name it: relative to where the user stands; as it is on another drive of Windows."""
    try:
        return os.path.relpath(path)
    except ValueError:
        return str(path)


def so_many(number: int, one: str, many: str = "") -> str:
    """`1 station`, `1,024 stations`; many: if it is not the one with an s."""
    return f"{number:,} {one if number == 1 else many or one + 's'}"


def duration_in_short(seconds: float) -> str:
    """`119 s`, `2 min`, `2.0 h`."""
    if seconds < LEAST_OF_A_UNIT * 60.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < LEAST_OF_A_UNIT * 3600.0 else f"{seconds / 3600.0:.1f} h"


def listed(parts: Sequence[str]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def experiments_in_words(names: Sequence[str]) -> str:
    """`experiment low`, `experiments low, mid and high`."""
    return f"experiment{'s' if len(names) > 1 else ''} {listed(names)}"


def in_digits(value: float, digits: int = 3) -> str:
    """A number to so many significant digits in plain text, `0.00965`, `1500`, `1.5e+06`; the page has `short`."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(float(text)) <= LARGEST_IN_FULL else text


def chance_in_words(chance: float) -> str:
    """A chance as a per cent, neither 0 nor 100 %: `under 1 %`, `37 %`, `over 99 %`."""
    if chance < 0.01:
        return "under 1 %"
    return "over 99 %" if chance > 0.99 else f"{100 * chance:.0f} %"


def range_in_digits(bounds: Sequence[float], digits: int = 3) -> str:
    """`low to high`, or one number if both read the same."""
    low, high = (in_digits(one, digits) for one in bounds)
    return low if low == high else f"{low} to {high}"


def section_in_words(name: str, x: float) -> str:
    """`D3, x = 42 m`; `x = 42 m` alone of a section that was only named after its place. x [m], to centimetres."""
    place = f"x = {round(x, 2):g} m"
    return place if re.fullmatch(r"x[-+]?\d+\.\d\d", name) else f"{name}, {place}"


def interval_in_short(name: str, value: float, low: float, high: float, unit: str = "") -> str:
    """`phi: 8.1, 95 % 7.2 to 9.3`, with the unit at the end if there is one."""
    digits = telling_digits(low, high)
    middle, least, most = (in_digits(one, digits) for one in (value, low, high))
    return f"{name}: {middle}, 95 % {least} to {most} {unit.removesuffix('-')}".rstrip()


def telling_digits(low: float, high: float) -> int:
    """Significant digits of both ends of a range: three, more if these would be the same for both ends."""
    apart, largest = high - low, max(abs(low), abs(high))
    if not (math.isfinite(apart) and apart > 0.0):
        return 3
    return max(math.floor(math.log10(largest)) - math.floor(math.log10(apart)) + 1, 3)


def decimals(scale: float, figures: int = 2) -> int:
    """Decimal places that show `scale` to this many significant figures; 0 for scales above that."""
    if not math.isfinite(scale) or scale == 0:
        return 3
    return max(figures - 1 - math.floor(math.log10(abs(scale)) + 1e-9), 0)


def fixed(value: float, places: int) -> str:
    """value with so many decimals and a true minus; an en dash if it is no number."""
    if not math.isfinite(value):
        return "–"
    return f"{round(value, places) + 0.0:.{places}f}".replace("-", MINUS)  # + 0.0 makes a negative zero positive


def short(value: float, figures: int = 3) -> str:
    """value to so many significant figures, never in E notation: powers of ten as 1.2·10⁻⁵."""
    if not math.isfinite(value):
        return "–"
    if value != 0 and not 1e-3 <= abs(value) < 1e6:
        leading, _, power = f"{abs(value):.1e}".partition("e")
        raised = str(int(power)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
        return f"{MINUS if value < 0 else ''}{'' if leading == '1.0' else leading + '·'}10{raised}"
    return fixed(value, decimals(value, figures) if value else 0)


def plus_minus(value: float, sd: float) -> str:
    """value ± sd, both to two significant figures of sd; to one of them if value would have more than four."""
    if not math.isfinite(sd):
        return short(value)
    places = min(decimals(sd), max(decimals(value, 4), decimals(sd, 1))) if value else decimals(sd)
    return f"{fixed(value, places)}{FIRM}±{FIRM}{fixed(sd, places)}"


def as_given(value: float, sd: float = math.nan) -> str:
    """value ± sd of another study with the decimals they are stated with, no more."""
    if not math.isfinite(sd):
        return f"{value:g}".replace("-", MINUS)
    places = max(0, *(-int(Decimal(f"{number:g}").as_tuple().exponent) for number in (value, sd)))
    return f"{fixed(value, places)}{FIRM}±{FIRM}{fixed(sd, places)}"


def decimals_between(low: float, high: float) -> int:
    """Decimal places of both ends of a 95 % range and of what lies in it: two figures of its standard deviation."""
    return decimals((high - low) / 4) if high > low else 3


def interval(low: float, high: float) -> str:
    """low to high, to as many decimals as their distance deserves."""
    places = decimals_between(low, high)
    return f"{fixed(low, places)} to {fixed(high, places)}"


def percent(share: float) -> str:
    """A share as '37 %'; small ones as '0.4 %' or '< 0.1 %'."""
    if 0 < share < 0.0005:
        return f"<{NARROW}0.1{NARROW}%"
    return f"{fixed(100 * share, 0 if share >= 0.0995 else 1).removesuffix('.0')}{NARROW}%"


def symbol_html(symbol: str) -> str:
    """n_b as n with a lowered b, the letter slanted; a name of words as it is."""
    letter, _, lowered = symbol.partition("_")
    if len(letter) > 1 and lowered:
        return f"<code>{html.escape(symbol)}</code>"
    return f"<var>{html.escape(letter)}</var>" + (f"<sub>{html.escape(lowered)}</sub>" if lowered else "")


def symbol_math(symbol: str) -> str:
    """The same for matplotlib's mathtext; a symbol with signs that mean something there is written as it is."""
    letter, _, lowered = symbol.partition("_")
    if not (LETTER.fullmatch(letter) and LOWERED.fullmatch(lowered)):
        return no_formula(symbol)
    return f"${letter}_{{{lowered}}}$" if lowered else f"${letter}$"


def unit_html(unit: str) -> str:
    """'s m^(-1/3)' or 'm3/s' with its powers raised; nothing for '-'."""
    if unit == "-":
        return ""
    return POWER.sub(lambda power: f"<sup>{(power[1] or power[2]).replace('-', MINUS)}</sup>", html.escape(unit))


def unit_math(unit: str) -> str:
    """The same for matplotlib's mathtext, with a dash for what has no unit."""
    return POWER.sub(lambda power: f"$^{{{power[1] or power[2]}}}$", no_formula(unit)) if unit != "-" else "–"


def no_formula(text: str) -> str:
    """Text as it is within mathtext."""
    return text.replace("$", r"\$")


def with_unit(value: float, unit: str, figures: int = 2) -> Written:
    """A number and its unit."""
    plain, page = ("", "") if unit in ("", "-") else (f" {unit}", f"{NARROW}{unit_html(unit)}")
    return Written(f"{in_digits(value, figures)}{plain}", f"{short(value, figures)}{page}")


def sized(value: float, low: float, high: float, unit: str = "-") -> Written:
    """`0.67 m, 95 % 0.54 to 0.79`, to one figure of the standard deviation."""
    places = decimals((high - low) / 4, 1) if math.isfinite(high - low) and high > low else 3
    middle, least, most = (fixed(one, places) for one in (value, low, high))
    plain, page = ("", "") if unit in ("", "-") else (f" {unit}", f"{NARROW}{unit_html(unit)}")
    return Written(
        f"{middle}{plain}, 95 % {least} to {most}".replace(MINUS, "-"), f"{middle}{page}, 95{FIRM}% {least} to {most}"
    )
