"""How values show themselves where they are printed: a heading, and below it a few lines with units."""

import math
import re
from collections.abc import Iterable, Sequence

# Of a unit of time, from which it is told in the next: below two, whole ones may be off by more than a quarter.
LEAST_OF_A_UNIT = 2.0
# Sizes up to which a number is written in full; beyond, as a power of ten.
LARGEST_IN_FULL = 1e5


def in_short(heading: str, lines: Iterable[str]) -> str:
    """The heading, and the lines that say something, indented below it."""
    return "\n".join([heading, *(f"  {line}" for line in lines if line)])


def so_many(number: int, one: str, many: str = "") -> str:
    """`1 station`, `1,024 stations`; many: where it is not the one with an s."""
    return f"{number:,} {one if number == 1 else many or one + 's'}"


def duration_in_short(seconds: float) -> str:
    """`119 s`, `2 min`, `2.0 h`."""
    if seconds < LEAST_OF_A_UNIT * 60.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < LEAST_OF_A_UNIT * 3600.0 else f"{seconds / 3600.0:.1f} h"


def listed(parts: Sequence[str]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def without_asides(sentence: str) -> str:
    """A sentence without what stands in round brackets, but for shares and chances, `(7%)`: for who reads one line."""
    shorter = re.sub(r"\s*\([^()%]*\)", "", sentence)
    return shorter if shorter == sentence else without_asides(shorter)


def experiments_in_words(names: Sequence[str]) -> str:
    """`experiment low`, `experiments low, mid and high`."""
    return f"experiment{'s' if len(names) > 1 else ''} {listed(names)}"


def in_digits(value: float, digits: int = 3) -> str:
    """A number to so many significant digits, for people: `0.00965`, `1500`, `1.5e+06`; every sentence and table of the
    terminal that may hold a large one asks for it here, the page by `short` of figures/typography.
    """
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(float(text)) <= LARGEST_IN_FULL else text


def chance_in_words(chance: float) -> str:
    """A chance as a per cent, neither 0 nor 100 %: `under 1%`, `37%`, `over 99%`."""
    if chance < 0.01:
        return "under 1%"
    return "over 99%" if chance > 0.99 else f"{chance:.0%}"


def odds_in_digits(odds: float) -> str:
    """`30 to 1`, `1 to 3` below one, `over 1,000 to 1`."""
    if odds < 1.0:
        return f"1 to {1.0 / odds:.0f}" if odds > 0.001 else "1 to over 1,000"
    return "over 1,000 to 1" if odds > 1000 else f"{odds:.0f} to 1"


def place_in_digits(x: float, y: float) -> str:
    """`x = 14.3, y = 1.5`, without what is NaN."""
    return ", ".join(f"{name} = {in_digits(value, 4)}" for name, value in (("x", x), ("y", y)) if math.isfinite(value))


def range_in_digits(bounds: Sequence[float], digits: int = 3) -> str:
    """`low to high`, or one number if both read the same."""
    low, high = (in_digits(one, digits) for one in bounds)
    return low if low == high else f"{low} to {high}"


def section_in_words(name: str, x: float) -> str:
    """`D3, x = 42 m`; `x = 42 m` alone of a section that was only named after its place. x [m], to centimetres."""
    place = f"x = {round(x, 2):g} m"
    return place if re.fullmatch(r"x[-+]?\d+\.\d\d", name) else f"{name}, {place}"


def interval_in_short(name: str, value: float, low: float, high: float, unit: str = "") -> str:
    """`phi: 8.1, 95 % 7.2 to 9.3`, with the unit behind unless it is none."""
    digits = telling_digits(low, high)
    middle, least, most = (in_digits(one, digits) for one in (value, low, high))
    return f"{name}: {middle}, 95 % {least} to {most} {unit.removesuffix('-')}".rstrip()


def telling_digits(low: float, high: float) -> int:
    """Significant digits of both ends of a range: three, more where these would not tell one end from the other."""
    apart, largest = high - low, max(abs(low), abs(high))
    if not (math.isfinite(apart) and apart > 0.0):
        return 3
    return max(math.floor(math.log10(largest)) - math.floor(math.log10(apart)) + 1, 3)
