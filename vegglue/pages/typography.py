"""How numbers, symbols and units are written: as plain text, on the page (HTML) and in figures (mathtext)."""

import html
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from vegglue.wording.numbers import in_digits

NARROW = "\u202f"  # between a number and its unit, never broken
FIRM = "\u00a0"  # a space where a line must not break
MINUS = "\u2212"
# Parts of a symbol that mathtext draws as they are.
LETTER, LOWERED = re.compile(r"[^\W_]+"), re.compile(r"(?:[^\W_]|[\[\] .,:+-])*")
POWER = re.compile(r"\^\(?(-?[\d/.]+)\)?|(?<=[a-z])(\d)")  # in a unit: ^(-1/3), ^2, or the 3 of m3/s


def decimals(scale: float, figures: int = 2) -> int:
    """Decimal places that show `scale` to this many significant figures; 0 for scales above that."""
    if not math.isfinite(scale) or scale == 0:
        return 3
    return max(figures - 1 - math.floor(math.log10(abs(scale)) + 1e-9), 0)


def fixed(value: float, places: int) -> str:
    """value with so many decimals and a true minus; an en dash where there is no number."""
    if not math.isfinite(value):
        return "–"
    return f"{round(value, places) + 0.0:.{places}f}".replace("-", MINUS)  # + 0.0 makes a negative zero positive


def short(value: float, figures: int = 3) -> str:
    """value to so many significant figures, never in E notation: powers of ten as 1.2·10⁻⁵."""
    if not math.isfinite(value):
        return "–"
    if value != 0 and not 1e-3 <= abs(value) < 1e6:
        power = math.floor(math.log10(abs(value)))
        leading = fixed(value / 10**power, 1)
        return f"{'' if leading == '1.0' else leading + '·'}10{_raised(power)}"
    return fixed(value, decimals(value, figures) if value else 0)


def plus_minus(value: float, sd: float) -> str:
    """value ± sd, both to two significant figures of sd; to one of them where value would have more than four."""
    if not math.isfinite(sd):
        return short(value)
    places = min(decimals(sd), max(decimals(value, 4), decimals(sd, 1))) if value else decimals(sd)
    return f"{fixed(value, places)}{FIRM}±{FIRM}{fixed(sd, places)}"


def as_given(value: float, sd: float = math.nan) -> str:
    """value ± sd of others with the decimals they were given with, no more."""
    if not math.isfinite(sd):
        return f"{value:g}".replace("-", MINUS)
    places = max(len(f"{number:g}".partition(".")[2]) for number in (value, sd))
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
    return f"{fixed(100 * share, 0 if share >= 0.0995 or share == 0 else 1)}{NARROW}%"


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
    return POWER.sub(lambda power: f"<sup>{_digits(power).replace('-', MINUS)}</sup>", html.escape(unit)) * (
        unit != "-"
    )


def unit_math(unit: str) -> str:
    """The same for matplotlib's mathtext, with a dash for what has no unit."""
    return POWER.sub(lambda power: f"$^{{{_digits(power)}}}$", no_formula(unit)) if unit != "-" else "–"


def no_formula(text: str) -> str:
    """Text as it is within mathtext."""
    return text.replace("$", r"\$")


def _digits(power: re.Match[str]) -> str:
    return power[1] or power[2]


def _raised(power: int) -> str:
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


@dataclass(frozen=True)
class Notation:
    """How one sentence is written for a terminal (plain text) and for the page (HTML).

    parameter: its name to what is written. number: a value to so many significant digits. unit: with the space before
    it, '' for '-'. share: a part of one, in percent. power_of_ten: an exponent and its standard deviation.
    """

    parameter: Callable[[str], str]
    number: Callable[[float, int], str]
    unit: Callable[[str], str]
    share: Callable[[float], str]
    power_of_ten: Callable[[float, float], str]


PLAIN_TEXT = Notation(
    parameter=str,
    number=in_digits,
    unit=lambda unit: f" {unit}" if unit not in ("", "-") else "",
    share=lambda share: f"{100 * share:.0f} %",
    power_of_ten=lambda exponent, sd: f"10^({exponent:.2f} ± {sd:.2f})",
)


def html_notation(symbols: Mapping[str, str]) -> Notation:
    """The notation of the page; symbols: how each parameter is written there (HTML), by name."""
    return Notation(
        parameter=symbols.__getitem__,
        number=short,
        unit=lambda unit: f"{NARROW}{unit_html(unit)}" if unit not in ("", "-") else "",
        share=percent,
        power_of_ten=lambda exponent, sd: f"10<sup>{plus_minus(exponent, sd)}</sup>",
    )
