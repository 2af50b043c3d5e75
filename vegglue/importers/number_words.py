"""Numbers as people write them: with a decimal point or comma, in groups of thousands, or as a word for none."""

import re
from collections.abc import Iterable

NUMBER = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eEdD][-+]?\d+)?")
# Thousands apart by one sign, decimals by another, which is thereby known: 1.236,00 and 1,236.00 and 1 236,00.
GROUPED = re.compile(r"[-+]?\d{1,3}(?P<apart>[.,'’\s])\d{3}((?P=apart)\d{3})*(?!(?P=apart))(?P<decimal>[.,])\d*")
# The minus of mathematics, hyphens and dashes that word processors write.
DASHES = str.maketrans(dict.fromkeys("\u2212\u2010\u2011\u2012\u2013\u2014\ufe63\uff0d", "-"))
MISSING_WORDS = (
    "", "-", "--", "---", "nan", "na", "n/a", "n.a.", "n.d.", "k.a.", "k. a.", "null", "none", "nodata", "no data",
    "missing", "inf", "-inf", "+inf", "nd", "s/d",
)  # fmt: skip
# What a workbook shows where a formula has no value, in any language: #DIV/0!, #N/A, #WERT!, #NOMBRE?
OF_FORMULA = re.compile(r"#[^\W_]+(/[^\W_]+)?[!?]?")


def is_number(text: str) -> bool:
    """Whether a field is a number, however it is written."""
    plain = _plain(text)
    return NUMBER.fullmatch(plain) is not None or GROUPED.fullmatch(plain) is not None


def has_decimal_comma(fields: Iterable[str]) -> bool:
    """Whether more of these numbers are written with a decimal comma than with a point."""
    signs = [sign for field in fields if (sign := _decimal_sign(field))]
    return signs.count(",") > signs.count(".")


def number_in(text: str, decimal_comma: bool) -> float | None:
    """A field as a number; None where it says that there is none. Errors: ValueError, which says what to do."""
    plain = _plain(text)
    if plain.lower() in MISSING_WORDS or OF_FORMULA.fullmatch(plain):
        return None
    sign = "," if decimal_comma else "."
    if (written := _decimal_sign(plain)) and written != sign:
        raise ValueError(f"write it with a decimal {'comma' if decimal_comma else 'point'}, as most numbers here")
    if GROUPED.fullmatch(plain):
        plain = re.sub(rf"[^-+\d{sign}]", "", plain)
    try:
        return float(re.sub("[dD]", "e", plain.replace(",", ".")))
    except ValueError:
        raise ValueError("mend or remove the row") from None


def _decimal_sign(text: str) -> str:
    """The sign before the decimals of a number, '' where there is none."""
    if (grouped := GROUPED.fullmatch(_plain(text))) is not None:
        return grouped["decimal"]
    return next((sign for sign in ",." if sign in text), "") if NUMBER.fullmatch(_plain(text)) else ""


def _plain(text: str) -> str:
    """Without spaces around it, and with the minus of a keyboard where a word processor wrote another."""
    return text.strip().translate(DASHES)
