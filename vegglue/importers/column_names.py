"""What a column is called and in which unit it is: every name and spelling that an import understands."""

import math
import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

from vegglue.errors import InputError

_FOOT, _SURVEY_FOOT = 0.3048, 1200.0 / 3937.0  # m, the international foot and that of the U.S. survey
# SI value of one of each unit, by quantity; the SI unit comes first.
UNITS: dict[str, dict[str, float]] = {
    "length": {
        "m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "km": 1000.0, "ft": _FOOT, "in": _FOOT / 12.0, "yd": 3.0 * _FOOT,
        "us-ft": _SURVEY_FOOT,
    },
    "velocity": {
        "m/s": 1.0, "dm/s": 0.1, "cm/s": 0.01, "mm/s": 0.001, "km/h": 1.0 / 3.6, "ft/s": _FOOT, "in/s": _FOOT / 12.0,
        "kn": 1852.0 / 3600.0, "mph": 5280.0 * _FOOT / 3600.0, "m/min": 1.0 / 60.0,
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
    "ift": "ft", "sft": "us-ft", "fps": "ft/s", "kmh": "km/h", "kph": "km/h", "knots": "kn", "knot": "kn", "kt": "kn",
    "kts": "kn", "cfs": "ft3/s", "cusec": "ft3/s", "cusecs": "ft3/s", "cumec": "m3/s", "cumecs": "m3/s", "cms": "m3/s",
    "deg": "degrees", "degree": "degrees", "°": "degrees", "graden": "degrees",
    "graad": "degrees", "grad": "degrees", "degré": "degrees", "degrés": "degrees", "degres": "degrees",
    "grados": "degrees", "gradi": "degrees", "graus": "degrees", "radians": "rad", "sec": "s", "seconds": "s",
    "minutes": "min", "hours": "h", "m/sec": "m/s", "cm/sec": "cm/s", "ft/sec": "ft/s", "ms": "m/s", "mps": "m/s",
    "lps": "l/s", "gpm": "gal/min", "m3/day": "m3/d", "yards": "yd", "stems/m2": "1/m2", "m-2": "1/m2", "cbm/s": "m3/s",
    "qm3/s": "m3/s",
}  # fmt: skip
# Units in words of lower case, in this order: `cubic feet per second`.
WORDS_OF_UNITS = (
    (r"\bcenti(?=met)", "c"), (r"\bmilli(?=met)", "m"), (r"\bdeci(?=met)", "d"), (r"\bkilo(?=met)", "k"),
    (r"met(re|er)s?\b", "m"), (r"\b(feet|foot)\b", "ft"), (r"\binch(es)?\b", "in"), (r"\blit(re|er)s?\b", "l"),
    (r"\bgallons?\b", "gal"), (r"\bcubic\s+(\w+)", r"\g<1>3"), (r"\bsquare\s+(\w+)", r"\g<1>2"), (r"^per\s+", "1/"),
    (r"\s+per\s+", "/"), (r"(?<=/)seconds?\b", "s"), (r"(?<=/)minutes?\b", "min"), (r"(?<=/)hours?\b", "h"),
)  # fmt: skip
# A power of ten in front of a unit or behind it, `10^-2 m/s`, `m/s x 100`: values may be times it or over it.
POWER_OF_TEN = r"(10\s*(\^|\*\*)?\s*[-−]?\d+|10[⁻⁺]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+|1?e[-+]?\d+|0?\.0*1|10+)"
SCALED_UNIT = re.compile(
    rf"[x×*]?\s*{POWER_OF_TEN}\s*[x×*·]?\s*(?P<front>\D.*)|(?P<back>.*\D)\s*[x×*·]\s*{POWER_OF_TEN}"
)
# The foot of the U.S. survey, `US ft`, `ftUS`, `survey feet`: 4 mm in 2 km of a State Plane, and 1.2 m in 600 km.
OF_SURVEY = re.compile(r"(?=.*(us|u\.s\.|survey))(us|u\.s\.)?[\s/-]*(survey)?[\s/-]*(ft|foot|feet)[\s/-]*(\(?us\)?)?")
# What stands behind the unit of a level and says of which datum it is: `m a.s.l.`, `m+NAP`, `m ü. NN`.
OF_A_DATUM = re.compile(
    r"(m|dm|cm|mm|ft)[\s+]*(a\.?\s?s\.?\s?l\.?|above sea level|aod|nap|(ü\.?\s?)?nh?n|ahd|navd88|ngvd29|ngf|taw|dvr90)"
)


def unit_named(word: str, quantity: str) -> str | None:
    """The unit of a quantity that a word means, `cm/s` for `cm s^-1`; None if it means none."""
    plain = _plain_unit(word)
    plain = of_datum[1] if (of_datum := OF_A_DATUM.fullmatch(plain)) else plain
    plain = "us-ft" if OF_SURVEY.fullmatch(plain) else SPELLINGS.get(plain, plain)
    return plain if plain in UNITS[quantity] else None


def is_unit(word: str) -> bool:
    """Whether a word can stand in a row of units: a unit of any quantity, a dash, or nothing."""
    others = ("", "-", "1", "db", "degc", "%", "*d", "cnt", "counts", "hpa", "dbar", "m2", "ft2")
    return _plain_unit(word) in others or any(unit_named(word, quantity) for quantity in UNITS)


def is_row_of_units(fields: Sequence[str]) -> bool:
    """Whether fields are the units of the columns below: all of them, or half of those that hold something, one of a
    quantity known here, if no other is the name of a column: `-;m;(ft/s);(sq ft)`.
    """
    others = [field for field in fields if not is_unit(field)]
    units = [field for field in fields if field.strip() and is_unit(field)]
    known = any(unit_named(field, quantity) for field in units for quantity in UNITS)
    return not others or (known and len(others) <= len(units) and not any(map(role_of, others)))


def unit_in_words(text: str) -> tuple[str, str] | None:
    """A unit other than that of the SI that a line states, and its quantity: `Unit: ft`, `all velocities in cm/s`.

    None stands behind a number, which is a value, and inches and kilometres are as a rule other words.
    """
    words = re.findall(r"[^\s,;:=\[\]()\"']+", text)
    for before, word in pairwise(["", *words]):
        for quantity in ("velocity", "length", "discharge") if not re.search(r"\d", before) else ():
            unit = unit_named(word, quantity)
            if unit not in (None, "in", "km", next(iter(UNITS[quantity]))):
                return word, quantity
    return None


def is_like_unit(word: str) -> bool:
    """Whether a word is a unit of any quantity, or looks like one that is not known here, `acre-ft/d`."""
    plain = _plain_unit(word)
    known = is_unit(word) and plain not in ("", "-", "1")
    return known or re.fullmatch(r"[a-z0-9-]+/(s|sec|min|h|hr|d|day)|m[gl]d", plain) is not None


@lru_cache(1024)  # the words of each title and heading, once for each quantity
def _plain_unit(word: str) -> str:
    text = word.strip().strip("[]()").strip().lower()
    for words, sign in WORDS_OF_UNITS:
        text = re.sub(words, sign, text)
    text = text.replace("³", "3").replace("²", "2").replace("⁻¹", "-1").replace("^", "").replace("**", "")
    text = re.sub(r"[\s.·*]*(s|sec|h)-1$", r"/\1", text)
    return re.sub(r"\s*/\s*", "/", text).replace("_", "/")


def si_factor(word: str, quantity: str, where: str) -> float:
    """SI value of one unit.

    Parameters
    ----------
    word : str
        The unit, as it is written.
    where : str
        How the message begins.

    Returns
    -------
    float
        [SI unit per unit]

    Raises
    ------
    InputError
        For an unknown word.
    """
    unit = unit_named(word, quantity)
    if unit is None:
        raise InputError("unknown_unit", where=where, quantity=quantity, got=word, known=list(UNITS[quantity]))
    return UNITS[quantity][unit]


def scale_of_column(word: str, quantity: str, where: str) -> float:
    """SI value of 1 in a column.

    Parameters
    ----------
    word : str
        A unit, or a scale such as `0.7 m`, a diameter that lengths are given in.
    where : str
        How the message begins.

    Returns
    -------
    float
        [SI unit]

    Raises
    ------
    InputError
        For an unknown word.
    """
    scale = re.fullmatch(r"\s*([\d.]+(?:e[-+]?\d+)?)\s*(\S.*)", word.lower())
    if scale is None:
        return si_factor(word, quantity, where)
    size = in_si(word, quantity, where)
    if not 0.0 < size < math.inf:
        raise InputError("no_scale", where=where, quantity=quantity, got=word)
    return size


def in_si(value: object, quantity: str, where: str) -> float:
    """A number in SI, or a text such as `42 l/s` as one.

    Parameters
    ----------
    where : str
        How the message begins.

    Returns
    -------
    float
        [SI unit]

    Raises
    ------
    InputError
        If it is neither.
    """
    if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    stated = re.fullmatch(r"\s*([-+]?[\d.]+(?:e[-+]?\d+)?)\s*(\S.*?)\s*", value) if isinstance(value, str) else None
    try:
        number = float(stated[1]) if stated else None
    except ValueError:
        number = None
    if stated is None or number is None:
        raise InputError("no_number_in_si", where=where, unit=next(iter(UNITS[quantity])), got=repr(value))
    # 82 cm is 0.82 m, and not 0.8200000000000001.
    return float(f"{number * si_factor(stated[2], quantity, where):.12g}")


@dataclass(frozen=True)
class Role:
    """What a column may hold.

    Attributes
    ----------
    quantity : str
        Of its unit, '' for words.
    names : tuple of str
        How it is usually headed.
    """

    name: str
    quantity: str
    names: tuple[str, ...]


# Columns that name the gauge of a level, and mean nothing beside velocities.
NAMES_OF_GAUGES = (
    "gauge", "gage", "gauge name", "gage name", "gauge id", "gauge no", "staff gauge", "pegelname", "peilschaal",
)  # fmt: skip
# Told apart from one another by their whole name, so that none of these is ambiguous. East and north components are
# roles of their own: they turn with the map.
ROLES = {
    role.name: role
    for role in (
        Role("x", "length", ("x", "easting", "east", "e", "x coordinate", "x coord", "rechtswert", "utm x", "utm e",
                             "rd x", "x rd", "x coordinaat", "x koordinate",
                             "chainage", "distance downstream", "distance along", "streamwise distance",
                             "distance aval", "distancia aguas abajo")),
        Role("y", "length", ("y", "northing", "north", "n", "y coordinate", "y coord", "hochwert", "utm y", "utm n",
                             "rd y", "y rd", "y coordinaat", "y koordinate",
                             "offset", "distance across", "lateral distance", "cross stream distance",
                             "distance laterale", "distance transversale", "distancia lateral",
                             "distancia transversal", "distanza laterale")),
        Role("z", "length", ("z", "elevation", "elev", "altitude", "hohe", "alt", "rl")),
        Role("z_bed", "length", ("bed level", "z bed", "zb", "bed elevation", "zbed", "z b", "bed z", "bed elev",
                                 "bed height", "bottom level", "bottom elevation", "streambed elevation",
                                 "riverbed level", "riverbed elevation")),
        Role("height", "length", ("height above bed", "height above the bed", "distance from bed", "distance above bed",
                                  "elevation above bed", "z above bed", "above bed", "hab", "hohe uber sohle",
                                  "hohe uber der sohle", "hohe u sohle", "hoehe ueber sohle", "z uber sohle",
                                  "z uber der sohle", "z ueber sohle", "z u sohle", "sohlabstand",
                                  "abstand von der sohle", "abstand zur sohle")),
        Role("u", "velocity", ("u", "vx", "ux", "u mean", "mean u", "umean", "velocity", "vel", "mean velocity",
                               "mean vel", "meanv", "velocity x", "vel x", "x velocity", "streamwise velocity",
                               "u velocity", "geschwindigkeit", "fliessgeschwindigkeit",
                               "mittlere geschwindigkeit", "stromungsgeschwindigkeit", "v x", "vitesse", "u depthavg",
                               "u avg", "depth averaged u", "average velocity", "avg velocity", "velocity mean",
                               "velocity avg", "depth averaged velocity", "depth average velocity",
                               "vitesse moyenne", "velocidad", "velocidad media", "snelheid",
                               "gemiddelde snelheid", "stroomsnelheid", "velocita", "velocita media",
                               "velocidade", "velocidade media", "geschwindigkeit x", "snelheid x", "vitesse x",
                               "velocidad x", "velocita x", "velocidade x")),
        Role("v", "velocity", ("v", "vy", "uy", "v mean", "mean v", "vmean", "velocity y", "vel y", "y velocity",
                               "transverse velocity", "lateral velocity", "v velocity", "v depthavg", "v avg",
                               "depth averaged v", "cross stream velocity", "v y", "geschwindigkeit y", "snelheid y",
                               "vitesse y", "velocidad y", "velocita y", "velocidade y")),
        Role("east_velocity", "velocity", ("ve", "v e", "vel e", "u east", "east velocity", "velocity east",
                                           "vel east", "veast", "eastward velocity", "mean vel e")),
        Role("north_velocity", "velocity", ("vn", "v n", "vel n", "v north", "north velocity", "velocity north",
                                            "vel north", "vnorth", "northward velocity", "mean vel n")),
        Role("w", "velocity", ("w", "vz", "uz", "w mean", "mean w", "velocity z", "vel z", "vertical velocity")),
        Role("speed", "velocity", ("speed", "magnitude", "velocity magnitude", "vmag", "vel mag", "magn",
                                   "mean speed")),
        Role("direction", "angle", ("direction", "dir", "flow direction", "velocity direction", "azimuth",
                                     "richting", "stroomrichting", "richtung", "fliessrichtung", "stromungsrichtung",
                                     "direction du courant", "direccion", "direccion del flujo", "direzione",
                                     "direcao")),
        Role("level", "length", ("level", "water level", "wse", "wsel", "water surface", "water surface elevation",
                                 "stage", "ws", "wl", "wasserstand", "wasserspiegel", "pegel", "z ws", "waterlevel",
                                 "wasserspiegellage", "wsp",
                                 "gauge height", "gage height", "ws elev", "w s elev",
                                 "niveau d' eau", "niveau de l' eau", "waterstand", "waterpeil", "nivel",
                                 "nivel del agua", "nivel de agua", "livello", "livello idrico")),
        Role("discharge", "discharge", ("discharge", "q", "flow", "flow rate", "abfluss", "debit", "total q", "q total",
                                        "caudal", "afvoer", "debiet", "durchfluss", "portata", "vazao")),
        Role("u_se", "velocity", ("u se", "se u", "u error", "u uncertainty", "velocity se", "velocity uncertainty",
                                  "standard error", "se", "verr")),
        Role("v_se", "velocity", ("v se", "se v", "v error", "v uncertainty")),
        Role("speed_se", "velocity", ("speed se", "speed uncertainty")),
        Role("level_se", "length", ("level se", "se level", "level error", "level uncertainty")),
        Role("discharge_se", "discharge", ("discharge se", "se discharge", "discharge uncertainty", "q se")),
        Role("u_std", "velocity", ("u std", "std u", "u rms", "rms u", "u sd", "sd u", "std", "urms")),
        Role("duration_s", "time", ("duration", "duration s", "sampling time", "record length", "averaging time")),
        Role("tape", "length", ("loc", "location", "tape", "distance from bank", "distance", "dist",
                                "distance from left bank", "distance from right bank", "dist from left bank",
                                "dist from right bank", "dist from bank", "distance from lb", "distance from rb", "dmg",
                                "dist from lb", "dist from rb", "dist lb", "dist rb", "distance lb", "distance rb",
                                "distance from lew", "distance from rew", "dist from lew", "dist from rew",
                                "abstand vom ufer", "abstand vom linken ufer", "abstand vom rechten ufer",
                                "distance a la rive", "distancia desde la orilla", "afstand", "distancia",
                                "distanza")),
        Role("depth", "length", ("depth", "h", "water depth", "tiefe", "wassertiefe",
                                 "profondeur", "profundidad", "calado", "diepte",
                                 "waterdiepte", "profondita", "profundidade", "hauteur d' eau")),
        Role("below", "length", ("below surface", "depth below surface", "depth below the surface", "measurement depth",
                                 "measuring depth", "meas depth", "depth of measurement", "point depth", "probe depth",
                                 "depth of point", "sampling depth", "distance from surface", "messtiefe",
                                 "profondeur de mesure", "meetdiepte", "profundidad de medicion",
                                 "profondita di misura")),
        Role("section", "", ("section", "transect", "profile", "cross section", "xs", "querprofil", "profil",
                             "seccion", "sezione", "secao", "raai", "dwarsprofiel", "perfil", "profilo",
                             *NAMES_OF_GAUGES)),
        Role("experiment", "", ("experiment", "run", "test", "campaign", "versuch", "lauf", "event",
                                "essai", "ensayo", "ensaio", "proef", "prova", "campagne", "campana")),
        Role("device", "", ("device", "instrument", "probe", "sensor")),
    )
}  # fmt: skip
# An error that is no standard error but two or three, half an interval.
ERROR_WORDS = {"se", "error", "uncertainty"}
OF_AN_INTERVAL = re.compile(
    r"9\d(\.\d+)?\s*%|\bk\s*=\s*[23]|\b[23]\s*(σ|sigma|sd|se)\b|\bci\b|interval|expanded", re.IGNORECASE
)
OF_SHARES = re.compile(r"%|\b(percent|pct)\b", re.IGNORECASE)
DEGREES = {"lat", "latitude", "lon", "long", "lng", "longitude", "breite", "breitengrad", "laenge", "langengrad"}
_ROLE_OF = {name: role.name for role in ROLES.values() for name in role.names}


def role_of(heading: str) -> tuple[str, str | None] | None:
    """The role of a column and the unit its heading states, `('u', 'cm/s')` for `U [cm/s]`; None for an unknown one."""
    known = known_name(heading)
    return (_ROLE_OF[known[0]], known[1]) if known is not None else None


def known_name(heading: str) -> tuple[str, str | None] | None:
    """Under which name of its role a column is known, and the unit its heading states: `('u mean', 'm/s')`; a share,
    such as `%Q`, half an interval, and a heading with two units under none.
    """
    bare, unit = _name_and_brackets(heading)
    if OF_SHARES.search(bare) or (ERROR_WORDS & set(words_of(bare).split()) and OF_AN_INTERVAL.search(heading)):
        return None
    if (found := _ROLE_OF.get(words_of(bare))) is not None:
        quantity = ROLES[found].quantity
        return words_of(bare), unit_named(unit, quantity) if unit and quantity else None
    for name, word in _suffixed(bare):
        found = _ROLE_OF.get(words_of(name))
        if found is not None and ROLES[found].quantity and (said := unit_named(word, ROLES[found].quantity)):
            # Brackets with another unit: h_m [mm] may be a mean depth.
            return None if unit_named(unit, ROLES[found].quantity) not in (None, said) else (words_of(name), said)
    return None


def unit_stated(heading: str, quantity: str) -> str | None:
    """The unit of a quantity that a heading states, whatever its name is: `cm/s` for `Geschw. (cm/s)`, `V, cm/s` and
    `V_cm_s`, also among other words, `(m above datum)` and `(US survey feet)`; None where it states none. A unit with a
    power of ten is as it stands: no unit that is known.
    """
    bare, unit = _name_and_brackets(heading)
    if (scaled := SCALED_UNIT.fullmatch(unit.strip())) and unit_named(scaled["front"] or scaled["back"], quantity):
        return unit.strip()
    among = [word for word in (*re.split(r"[,;]", unit), *re.findall(r"[^\s,;]+", unit)) if word != "in"]
    words = [unit, *among, *(word for _, word in _suffixed(bare))]
    return next((said for word in words if (said := unit_named(word, quantity))), None)


def bracketed_unit(heading: str) -> str:
    """What stands in brackets or behind a comma at the end of a heading, in round ones only if it is like a unit."""
    unit = _name_and_brackets(heading)[1].strip()
    return unit if heading.rstrip().endswith("]") or is_like_unit(unit) else ""


def names_without_unit(heading: str) -> set[str]:
    """`snelheid` of `snelheid [cm/s]`, `snelheid, cm/s` and `snelheid_cm_s`; none where it has no unit."""
    bare, unit = _name_and_brackets(heading)
    return {bare} if unit else {name for name, word in _suffixed(heading) if name and is_like_unit(word)}


def _name_and_brackets(heading: str) -> tuple[str, str]:
    """The name and what stands in brackets or after a comma at its end."""
    found = re.fullmatch(r"(.*?)\s*[\[(]([^\])]*)[\])]\s*", heading)
    if found:
        return found[1], found[2]
    name, comma, unit = heading.rpartition(", ")
    return (name, unit) if comma else (heading, "")


def _suffixed(name: str) -> list[tuple[str, str]]:
    """x_m as x in m, u_cm_s and `u in cm/s` as u in cm/s: the unit as the last part of the name, or the last two."""
    parts = re.split(r"[\s_]+", name.strip())
    ends = [(parts[:-last], "/".join(parts[-last:])) for last in (1, 2) if len(parts) > last]
    return [("_".join(bare[:-1] if bare[1:] and bare[-1] == "in" else bare), unit) for bare, unit in ends]


def is_in_degrees(heading: str) -> bool:
    """Whether a column of places holds degrees of longitude or latitude, by its name or its unit."""
    name = words_of(heading).split()
    return bool(name) and (name[0] in DEGREES or unit_stated(heading, "angle") is not None)


def words_of(name: str) -> str:
    """Letters and digits in lower case, apart where anything else stood: `u se` for `U_SE`.

    Signs that make another quantity of a letter stay with it: `u*`, `u'`, `Δx`. Quotes around a name go.
    """
    bare = re.sub(r"^(['’])(.*)\1$", r"\2", name.strip()).replace("’", "'")
    plain = "".join(sign for sign in unicodedata.normalize("NFKD", bare).casefold() if not unicodedata.combining(sign))
    return " ".join(re.findall(r"[∆∂±]*[^\W_]+[*'’′+]*", plain))
