"""Coordinate systems that files of map programs state: compared with that of the frame, in metres or refused.

Names are those of ESRI and of EPSG in the WKT of a .prj; the table holds the systems of surveys in which plants and
rivers are mapped most, and families whose number follows from the zone. What is in no table is compared by its datum.
"""

import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from vegglue.case.site_schema import Frame, in_metres
from vegglue.errors import InputError, shown_path

# Letters and digits of names of systems, in lower case, and their numbers of EPSG; {z} is a zone, added to the number.
FAMILIES = {
    r"(wgs1984|wgs84)utmzone{z}n": 32600, r"(wgs1984|wgs84)utmzone{z}s": 32700, r"etrs(19)?89utmzone{z}n": 25800,
    r"nad(19)?83utmzone{z}n": 26900, r"nad(19)?832011utmzone{z}n": 6329, r"nad(19)?27utmzone{z}n": 26700,
    r"ed(uropeandatum)?(19)?50utmzone{z}n": 23000, r"europeandatum1950utmzone{z}n": 23000,
    r"gda(19)?94mgazone{z}": 28300, r"gda2020mgazone{z}": 7800, r"sirgas2000utmzone{z}s": 31960,
    r"dhdn3degreegausszone{z}": 31464, r"dhdn3degreegausskrugerzone{z}": 31464, r"rgf(19)?93v?1?cc(4[2-9]|50)": 0,
}  # fmt: skip
SYSTEMS = {
    r"ch1903lv95|ch1903\+?lv95": 2056, r"ch1903lv03": 21781, r"rdnew|amersfoortrdnew": 28992,
    r"(osgb(19)?36)?britishnationalgrid": 27700, r"belgelambert1972|(bd72|belge1972)belgianlambert72": 31370,
    r"belgelambert2008|etrs(19)?89belgianlambert2008": 3812, r"rgf(19)?93(v1)?lambert93": 2154, r"sweref99tm": 3006,
    r"nzgd2000newzealandtransversemercator(2000)?": 2193, r"etrs(19)?89laea|etrs(19)?89extendedlaeaeurope": 3035,
    r"etrs(19)?89polandcs92": 2180, r"mgiaustrialambert": 31287, r"tm65irishgrid": 29902,
    r"irenet95irishtransversemercator": 2157,
    r"(wgs1984)?webmercatorauxiliarysphere|wgs84pseudomercator": 3857,
}  # fmt: skip
# Datum of numbers and of names: systems of different ones lie apart, by 1.8 m and more.
DATUMS = (
    ("gda94", r"gda_?(19)?94", lambda n: 28300 <= n < 28400), ("gda2020", r"gda_?2020", lambda n: 7800 <= n < 7900),
    ("wgs84", r"wgs_?(19)?84", lambda n: 32600 <= n < 32800 or n == 3857),
    ("etrs89", r"etrs_?(19)?89|etrf|european_terrestrial", lambda n: 25800 <= n < 25900 or n in (3035, 3812, 2180)),
    ("nad83", r"nad_?(19)?83|north_american_(datum_)?1983", lambda n: 26900 <= n < 27000),
    ("nad27", r"nad_?(19)?27|north_american_(datum_)?1927", lambda n: 26700 <= n < 26800),
    ("ch1903+", r"ch_?1903\+|ch1903_plus|lv95", lambda n: n == 2056),
    ("ch1903", r"ch_?1903(?!\+|_plus)", lambda n: n == 21781),
    ("amersfoort", r"amersfoort", lambda n: n == 28992), ("osgb36", r"osgb|ordnance_survey", lambda n: n == 27700),
    ("belge1972", r"belge_1972|reseau_national_belge_1972", lambda n: n == 31370),
    ("nzgd2000", r"nzgd|new_zealand", lambda n: n == 2193), ("rgf93", r"rgf_?(19)?93", lambda n: n == 2154),
    ("dhdn", r"dhdn|deutsches_hauptdreiecksnetz", lambda n: 31464 <= n < 31470),
)  # fmt: skip
# Where WGS 84 and the datum of a continent agree to a metre or so, programs write one for the other.
ALIKE = ({"wgs84", "etrs89"}, {"etrs89", "rgf93"}, {"wgs84", "nad83"}, {"wgs84", "gda2020"})
METRE = 1e-9  # difference of a unit of length from a metre that is none [m]


@dataclass(frozen=True)
class StatedSystem:
    """A coordinate system as a file states it.

    Attributes
    ----------
    number : int
        Of EPSG, 0 if unknown.
    name : str
        In the file.
    metres : float
        In one unit of its coordinates, 0 for degrees.
    """

    number: int
    name: str
    metres: float = 1.0


def known_in_metres(crs: str) -> str:
    """The system of a frame.

    Raises
    ------
    ValueError
        If it has no metres, or if pyproj, where it is installed, does not know it.
    """
    in_metres(crs)
    with suppress(ImportError):  # of the extra `field`: late, as it is not always there
        from pyproj import CRS
        from pyproj.exceptions import CRSError

        try:
            system = CRS.from_user_input(crs)
        except CRSError:
            raise ValueError("a coordinate system by its number, such as EPSG:2056, or no `crs`") from None
        lengths = {axis.unit_conversion_factor for axis in system.axis_info[:2]}
        if not (system.is_projected or system.is_engineering) or lengths != {1.0}:
            raise ValueError("a projected system, with coordinates in metres, such as EPSG:2056")
    return crs


def epsg_number(crs: str) -> int:
    """28992 of `EPSG:28992` and `urn:ogc:def:crs:EPSG::28992`; 0 if there is none."""
    found = re.search(r"EPSG:(?:[\d.]*:)?(\d+)", crs, re.IGNORECASE)
    return int(found[1]) if found else 0


def system_of_wkt(text: str) -> StatedSystem:
    """The system in a .prj: WKT of one projected or geographic system."""
    name = found[1] if (found := re.search(r'"([^"]*)"', text)) else ""
    if not re.match(r"\s*(PROJCS|PROJCRS|BOUNDCRS|COMPD_?CS|COMPOUNDCRS)", text, re.IGNORECASE):
        return StatedSystem(0, name, 0.0)
    horizontal = re.split(r"VERT_?CS|VERTCRS", text, flags=re.IGNORECASE)[0]
    units = re.findall(r'(?:LENGTH)?UNIT\["([^"]*)",\s*([-+.\deE]+)', horizontal, re.IGNORECASE)
    lengths = [float(size) for unit, size in units if "degree" not in unit.lower() and "radian" not in unit.lower()]
    own = re.findall(r'(?:AUTHORITY|ID)\["EPSG",\s*"?(\d+)"?\]\s*\]', horizontal)
    of_whole = re.search(r'(AUTHORITY|ID)\["EPSG",\s*"?\d+"?\]\s*\]\s*\Z', horizontal.strip())
    number = int(own[-1]) if own and of_whole else 0
    plain = re.sub(r"[^a-z0-9+]", "", name.lower())
    if not number:
        number = next((number for pattern, number in SYSTEMS.items() if re.fullmatch(pattern, plain)), 0)
    for pattern, first in FAMILIES.items() if not number else ():
        if zone := re.fullmatch(pattern.replace("{z}", r"(?P<z>\d+)"), plain):
            number = first + int(zone["z"]) if first else 0
    return StatedSystem(number, name, lengths[-1] if lengths else 1.0)


def refuse_other_system(path: Path, stated: StatedSystem, frame: Frame | None) -> None:
    """InputError if a file states degrees, feet, or another system or datum than that of the frame."""
    own = epsg_number(frame.crs or "") if frame is not None else 0
    if stated.metres == 0.0:
        raise InputError(
            f"{shown_path(path)}: expected coordinates in m, got degrees ({stated.name}); save it in the projected "
            f"system of the survey{f', EPSG:{own}' if own else ''}."
        )
    if abs(stated.metres - 1.0) > METRE:
        raise InputError(
            f"{shown_path(path)}: expected coordinates in m, got units of {stated.metres:.9g} m ({stated.name}); save "
            f"it in a system in metres{f', EPSG:{own}' if own else ''}."
        )
    if not own:
        return
    datums = [
        {name for name, words, numbers in DATUMS if (number and numbers(number)) or re.search(words, text.lower())}
        for number, text in ((stated.number, "" if stated.number else stated.name), (own, ""))
    ]
    apart = (
        all(datums) and not datums[0] & datums[1] and not any(datums[0] & pair and datums[1] & pair for pair in ALIKE)
    )
    if (stated.number and stated.number != own) or (not stated.number and apart):
        got = f"EPSG:{stated.number}" if stated.number else stated.name
        raise InputError(
            f"{shown_path(path)}: expected coordinates in EPSG:{own}, the `crs` of `frame`, got {got}; save it in that "
            "system, or take its statement out where both are the same."
        )
