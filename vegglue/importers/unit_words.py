"""Words for units, as people write them in headings, and what they are in SI."""

import math
import re

from vegglue.case.messages import nearest
from vegglue.errors import InputError

_FOOT = 0.3048  # m, the international foot
# SI value of one of each unit, by quantity; the SI unit comes first.
UNITS: dict[str, dict[str, float]] = {
    "length": {
        "m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "km": 1000.0, "ft": _FOOT, "in": _FOOT / 12.0, "yd": 3.0 * _FOOT,
    },
    "velocity": {
        "m/s": 1.0, "dm/s": 0.1, "cm/s": 0.01, "mm/s": 0.001, "km/h": 1.0 / 3.6, "ft/s": _FOOT, "in/s": _FOOT / 12.0,
        "kn": 1852.0 / 3600.0, "m/min": 1.0 / 60.0,
    },
    "discharge": {
        "m3/s": 1.0, "l/s": 0.001, "ml/s": 1e-6, "m3/h": 1.0 / 3600.0, "m3/min": 1.0 / 60.0, "m3/d": 1.0 / 86400.0,
        "l/min": 0.001 / 60.0, "l/h": 0.001 / 3600.0, "ft3/s": _FOOT**3, "gal/min": 231.0 * (_FOOT / 12.0) ** 3 / 60.0,
    },
    "angle": {"degrees": 1.0, "rad": 180.0 / math.pi, "gon": 0.9},
    "time": {"s": 1.0, "min": 60.0, "h": 3600.0},
    "density": {"1/m2": 1.0, "1/ft2": _FOOT**-2},
}  # fmt: skip
# Other spellings, after `_plain` has done its work.
SPELLINGS = {
    "metre": "m", "metres": "m", "meter": "m", "meters": "m", "feet": "ft", "foot": "ft", "usft": "ft", "inch": "in",
    "fps": "ft/s", "kmh": "km/h", "kph": "km/h", "knots": "kn", "cfs": "ft3/s", "cumecs": "m3/s", "cms": "m3/s",
    "deg": "degrees", "degree": "degrees", "°": "degrees", "graden": "degrees",
    "graad": "degrees", "grad": "degrees", "degré": "degrees", "degrés": "degrees", "degres": "degrees",
    "grados": "degrees", "gradi": "degrees", "graus": "degrees", "radians": "rad", "sec": "s", "seconds": "s",
    "minutes": "min", "hours": "h", "m/sec": "m/s", "cm/sec": "cm/s", "ft/sec": "ft/s", "ms": "m/s", "mps": "m/s",
    "lps": "l/s", "gpm": "gal/min", "m3/day": "m3/d", "yards": "yd", "stems/m2": "1/m2", "m-2": "1/m2", "cbm/s": "m3/s",
    "qm3/s": "m3/s",
}  # fmt: skip
# What stands behind the unit of a level and says of which datum it is: `m a.s.l.`, `m+NAP`, `m ü. NN`.
OF_A_DATUM = re.compile(
    r"(m|dm|cm|mm|ft)[\s+]*(a\.?\s?s\.?\s?l\.?|above sea level|aod|nap|(ü\.?\s?)?nh?n|ahd|navd88|ngvd29|ngf|taw|dvr90)"
)


def unit_named(word: str, quantity: str) -> str | None:
    """The unit of a quantity that a word means, `cm/s` for `cm s^-1`; None when it means none."""
    plain = _plain(word)
    plain = of_datum[1] if (of_datum := OF_A_DATUM.fullmatch(plain)) else plain
    plain = SPELLINGS.get(plain, plain)
    return plain if plain in UNITS[quantity] else None


def is_unit(word: str) -> bool:
    """Whether a word is a unit of any quantity, a dash, or nothing: what stands in a row of units."""
    return _plain(word) in ("", "-", "1", "db", "degc", "%", "*d", "cnt", "counts", "hpa", "dbar", "m2", "ft2") or any(
        unit_named(word, quantity) for quantity in UNITS
    )


def is_like_unit(word: str) -> bool:
    """Whether a word is a unit of any quantity, or looks like one that is not known here, `acre-ft/d`."""
    known = is_unit(word) and _plain(word) not in ("", "-", "1")
    return known or re.fullmatch(r"[a-z0-9-]+/(s|sec|min|h|hr|d|day)", _plain(word)) is not None


def si_factor(word: str, quantity: str, where: str) -> float:
    """SI value of one unit [SI unit per unit]. Errors: InputError, which begins with `where`, for an unknown word."""
    unit = unit_named(word, quantity)
    if unit is None:
        raise InputError(f"{where} expected a unit of {quantity}, got {word!r}: {nearest(word, UNITS[quantity])}")
    return UNITS[quantity][unit]


def in_si(value: object, quantity: str, where: str) -> float:
    """A number in SI, or a text such as `42 l/s` as one. Errors: InputError, which begins with `where`."""
    if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    said = re.fullmatch(r"\s*([-+]?[\d.]+(?:e[-+]?\d+)?)\s*(\S.*?)\s*", value) if isinstance(value, str) else None
    try:
        number = float(said[1]) if said else None
    except ValueError:
        number = None
    if said is None or number is None:
        si = next(iter(UNITS[quantity]))
        raise InputError(f"{where} expected a number in {si}, or one with its unit, got {value!r}; correct it.")
    # 82 cm is 0.82 m, and not 0.8200000000000001.
    return float(f"{number * si_factor(said[2], quantity, where):.12g}")


def _plain(word: str) -> str:
    text = word.strip().strip("[]()").strip().lower()
    text = text.replace("³", "3").replace("²", "2").replace("⁻¹", "-1").replace("^", "").replace("**", "")
    text = re.sub(r"[\s.·*]*(s|sec|h)-1$", r"/\1", text)
    return re.sub(r"\s*/\s*", "/", text).replace("_", "/")
