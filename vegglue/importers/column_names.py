"""Names of columns, as people write them, and what stands in them: its role, its quantity, its unit."""

import re
import unicodedata
from dataclasses import dataclass

from vegglue.importers.unit_words import is_like_unit, unit_named


@dataclass(frozen=True)
class Role:
    """What a column may hold. quantity: that of its unit, '' for words; names: how it is usually headed."""

    name: str
    quantity: str
    names: tuple[str, ...]


# Columns that name the gauge of a level, and mean nothing beside velocities.
NAMES_OF_GAUGES = (
    "gauge",
    "gage",
    "gauge name",
    "gage name",
    "gauge id",
    "gauge no",
    "staff gauge",
    "pegelname",
    "peilschaal",
)
# Told apart from one another by their whole name, so that none of these is ambiguous. East and north components are
# roles of their own: they turn with the map.
ROLES = {
    role.name: role
    for role in (
        Role("x", "length", ("x", "easting", "east", "e", "x coordinate", "x coord", "rechtswert", "utm x", "utm e",
                             "chainage", "distance downstream", "distance along", "streamwise distance",
                             "distance aval", "distancia aguas abajo")),
        Role("y", "length", ("y", "northing", "north", "n", "y coordinate", "y coord", "hochwert", "utm y", "utm n",
                             "offset", "distance across", "lateral distance", "cross stream distance",
                             "distance laterale", "distance transversale", "distancia lateral",
                             "distancia transversal", "distanza laterale")),
        Role("z", "length", ("z", "elevation", "elev", "altitude", "hohe", "bed level", "z bed", "zb", "bed elevation",
                             "alt", "rl")),
        Role("height", "length", ("height above bed", "height above the bed", "distance from bed", "distance above bed",
                                  "elevation above bed", "z above bed", "above bed", "hab", "hohe uber sohle",
                                  "hohe uber der sohle", "hohe u sohle", "hoehe ueber sohle", "sohlabstand",
                                  "abstand von der sohle", "abstand zur sohle")),
        Role("u", "velocity", ("u", "vx", "ux", "u mean", "mean u", "umean", "velocity", "vel", "mean velocity",
                               "mean vel", "meanv", "velocity x", "vel x", "x velocity", "streamwise velocity",
                               "u velocity", "geschwindigkeit", "fliessgeschwindigkeit",
                               "mittlere geschwindigkeit", "stromungsgeschwindigkeit", "v x", "vitesse", "u depthavg",
                               "u avg", "depth averaged u", "average velocity", "avg velocity", "velocity mean",
                               "velocity avg", "depth averaged velocity", "depth average velocity",
                               "vitesse moyenne", "velocidad", "velocidad media", "snelheid",
                               "gemiddelde snelheid", "stroomsnelheid", "velocita", "velocita media",
                               "velocidade", "velocidade media")),
        Role("v", "velocity", ("v", "vy", "uy", "v mean", "mean v", "vmean", "velocity y", "vel y", "y velocity",
                               "transverse velocity", "lateral velocity", "v velocity", "v depthavg", "v avg",
                               "depth averaged v", "cross stream velocity", "v y")),
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
                                 "gauge height", "gage height",
                                 "niveau d' eau", "niveau de l' eau", "waterstand", "waterpeil", "nivel",
                                 "nivel del agua", "nivel de agua", "livello", "livello idrico")),
        Role("discharge", "discharge", ("discharge", "q", "flow", "flow rate", "abfluss", "debit", "total q",
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
        Role("experiment", "", ("experiment", "run", "test", "campaign", "versuch", "event",
                                "essai", "ensayo", "ensaio", "proef", "prova", "campagne", "campana")),
        Role("device", "", ("device", "instrument", "probe", "sensor")),
    )
}  # fmt: skip
DEGREES = {"lat", "latitude", "lon", "long", "lng", "longitude", "breite", "breitengrad", "laenge", "langengrad"}
_ROLE_OF = {name: role.name for role in ROLES.values() for name in role.names}


def role_of(heading: str) -> tuple[str, str | None] | None:
    """The role of a column and the unit its heading states, `('u', 'cm/s')` for `U [cm/s]`; None for an unknown one."""
    known = known_name(heading)
    return (_ROLE_OF[known[0]], known[1]) if known is not None else None


def known_name(heading: str) -> tuple[str, str | None] | None:
    """Under which name of its role a column is known, and the unit its heading states: `('u mean', 'm/s')`."""
    bare, unit = _apart(heading)
    if (found := _ROLE_OF.get(words_of(bare))) is not None:
        quantity = ROLES[found].quantity
        return words_of(bare), unit_named(unit, quantity) if unit and quantity else None
    for name, word in _suffixed(bare):
        found = _ROLE_OF.get(words_of(name))
        if found is not None and ROLES[found].quantity and (said := unit_named(word, ROLES[found].quantity)):
            return words_of(name), said
    return None


def unit_stated(heading: str, quantity: str) -> str | None:
    """The unit of a quantity that a heading states, whatever its name is: `cm/s` for `Geschw. (cm/s)`, `V, cm/s` and
    `V_cm_s`, also among other words, `(m above datum)` and `(US survey feet)`; None where it states none.
    """
    bare, unit = _apart(heading)
    among = [word for word in re.findall(r"[^\s,;]+", unit) if word != "in"]
    words = [unit, *among, *(word for _, word in _suffixed(bare))]
    return next((said for word in words if (said := unit_named(word, quantity))), None)


def bracketed(heading: str) -> str:
    """What stands in brackets or after a comma at the end of a heading, '' where nothing does."""
    return _apart(heading)[1].strip()


def names_without_unit(heading: str) -> set[str]:
    """`snelheid` of `snelheid [cm/s]`, `snelheid, cm/s` and `snelheid_cm_s`; none where it has no unit."""
    bare, unit = _apart(heading)
    return {bare} if unit else {name for name, word in _suffixed(heading) if name and is_like_unit(word)}


def _apart(heading: str) -> tuple[str, str]:
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
