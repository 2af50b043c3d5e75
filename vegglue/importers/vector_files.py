"""Polygons of patches and friction classes, and the line of a bend: GeoJSON, shapefiles, and tables of corners."""

import codecs
import glob
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.case.grid import Centreline, centreline_of
from vegglue.case.resolved_config import Tree
from vegglue.case.site_schema import NEAREST_POINTS, CentrelineShape, Frame
from vegglue.case.zones import signed_area
from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import UNITS, names_without_unit, role_of, words_of
from vegglue.importers.column_roles import columns_of_table, taken_as_si
from vegglue.importers.coordinate_systems import StatedSystem, epsg_number, refuse_other_system, system_of_wkt
from vegglue.importers.file_options import FileOptions, read_file_options
from vegglue.importers.import_notes import CentrelineTaken, ImportNote, Noted, PatchesRead, UnitsAssumed
from vegglue.importers.library_files import importing, read_by_library, readable_text, refuse_foreign_format
from vegglue.importers.measured_rows import (
    MeasuredRows,
    Placement,
    in_the_channel,
    read_rows,
    refuse_far_places,
    rows_of_table,
)
from vegglue.importers.site_file import FieldSite, FileOfSite
from vegglue.importers.table_parser import WORKBOOKS, is_number, parse_table
from vegglue.measurements.plausibility import is_mark_anywhere
from vegglue.wording.sentences import sentence, sentences

MAP_FILES = (".geojson", ".json", ".shp")
TABLES = (".csv", ".txt", ".tsv", ".dat", *WORKBOOKS)
# No longitude and no latitude is further from 0 [degrees].
LARGEST_LONGITUDE, LARGEST_LATITUDE = 360.0, 90.0
# Degrees on the map that a whole reach spans at most: what is so small, in a file of a map program, lies in degrees.
SPAN_OF_DEGREES = 0.5
# A centreline whose directions all lie within this angle is straight [degrees]: chosen.
STRAIGHT = 0.5
# Headings of a density, as words: `stems`, `Stems/m2`, `stem density per ft2`; plain ones are of 1/m2.
DENSITY = re.compile(
    r"(?:(?:stem|plant)s?(?: density)?|density|shoots|stengels?|stengeldichtheid|halme|halmdichte|stangel|stangeldichte"
    r"|tiges|tallos|steli|caules)(?: (?:per|par|por|pro))?(?: (m2|ft2))?"
)
# What a heading of a density may hold, and words of one that is rather of something else.
LIKE_DENSITY = re.compile(r"dens|dicht|stem|steng|stang|halm|tige|tallo|shoot|(?:per|par|por|pro) (?:m2|ft2)$")
NO_DENSITY = re.compile(r"diam|thick|height|hoog|hohe|haut|length|lengt|area|mass|(?:^| )(?:mm|cm|m)$")
CLASSES = ("class", "friction class", "friction", "roughness", "type", "landuse")
NAMES = ("name", "id", "patch", "fid")
MOST_CORNERS = 20_000  # of a polygon whose sides are compared with one another
MOST_STEMS = 1e7  # 1/m2, as in the site file
FEWEST_CORNERS = 3
# Points of a line that a case can hold; a curve through a few dozen has less of what they jitter.
MOST_POINTS = 1000
NONE_NAMED: Mapping[str, str] = MappingProxyType({})
Ring = list[tuple[float, float]]
Properties = Mapping[str, Any]


@dataclass(frozen=True)
class NamedPolygon:
    """A polygon of a file, in the channel.

    Attributes
    ----------
    corners : Ring
        [m]
    density : float or None
        [1/m2], if the file has it.
    friction_class : str or None
        If the file has it.
    density_from : str or None
        Heading of the density.
    unread : tuple of str
        Headings of its other properties.
    like_density : tuple of str
        Of these, those that may be a density.
    unitless : tuple of str
        Which of x and y have no stated unit, and are taken as m.
    """

    name: str
    corners: Ring
    density: float | None
    friction_class: str | None
    density_from: str | None = None
    unread: tuple[str, ...] = ()
    like_density: tuple[str, ...] = ()
    unitless: tuple[str, ...] = ()


def read_polygons(path: Path, frame: Frame | None, columns: Mapping[str, str] = NONE_NAMED) -> list[NamedPolygon]:
    """All polygons of a file, each part of one for itself.

    Parameters
    ----------
    path
        GeoJSON, a shapefile, or a table with a row for each corner.
    frame
        Of the model on the map.
    columns
        Headings of `stems` and `name`, if these are not usual ones.

    Raises
    ------
    InputError
        For another file, for degrees, and for a heading that is not there.
    """
    features, unitless = _outlines_and_properties(path, frame, columns)
    if not features:
        raise InputError(f"{shown_path(path)}: expected polygons, got none; save the areas as polygons.")
    _refuse_degrees(path, frame, [ring for ring, _ in features])
    for number, (ring, _) in enumerate(features, 1):
        lost = next((corner for corner in ring if any(map(is_mark_anywhere, corner))), None)
        if lost is not None:
            raise InputError(
                f"{shown_path(path)}: expected corners with places in polygon {number}, got one at {lost[0]:g}, "
                f"{lost[1]:g}, a missing-value code; correct or remove it."
            )
        if len(ring) < FEWEST_CORNERS:
            raise InputError("few_corners", file=path, polygon=number, got=len(ring))
        refuse_crossing(f"{shown_path(path)}: polygon {number}", ring)
    named = _columns_named(
        path, columns, list(dict.fromkeys(str(key) for _, properties in features for key in properties))
    )
    polygons = []
    for number, (ring, properties) in enumerate(features, 1):
        held = {heading: value for heading, value in properties.items() if value not in (None, "")}
        of_density = next((one for one in held if DENSITY.fullmatch(words_of(one))), None)
        of_name, of_class = _first_heading(held, NAMES), _first_heading(held, CLASSES)
        if "stems" in named:
            of_density = named["stems"] if named["stems"] in held else None
        if "name" in named:
            of_name = named["name"] if named["name"] in held else None
        unread = {str(one): value for one, value in properties.items() if one not in (of_density, of_class, of_name)}
        words = [
            (heading, words_of(heading))
            for heading, value in unread.items()
            if isinstance(value, int | float) or (isinstance(value, str) and is_number(value))
        ]
        density = None
        if of_density is not None:
            try:
                density = float(properties[of_density]) * UNITS["density"][f"1/{_area_named(of_density) or 'm2'}"]
            except (ValueError, TypeError, OverflowError):
                got = str(properties[of_density])[:40]
                raise InputError(
                    f"{shown_path(path)}: expected a number of stems in 1/m2, got {got!r}; correct it."
                ) from None
        polygons.append(
            NamedPolygon(
                name=str(properties[of_name]) if of_name is not None else f"p{number}",
                corners=[_rounded(*(frame.to_model(*corner) if frame is not None else corner)) for corner in ring],
                density=density,
                friction_class=str(properties[of_class]) if of_class is not None else None,
                density_from=of_density,
                unread=tuple(unread),
                like_density=tuple(
                    one for one, text in words if LIKE_DENSITY.search(text) and not NO_DENSITY.search(text)
                ),
                unitless=unitless,
            )
        )
    return polygons


def _outlines_and_properties(
    path: Path, frame: Frame | None, columns: Mapping[str, str]
) -> tuple[list[tuple[Ring, Properties]], tuple[str, ...]]:
    """Of each part of each polygon in a file; and which of x and y have no stated unit."""
    if path.suffix.lower() in TABLES:
        return _polygons_of_table(path, columns)
    features: list[tuple[Ring, Properties]] = []
    if path.suffix.lower() == ".shp":
        with shapes_and_records(path, "POLYGON", frame) as found:
            for one in found:
                features += [(ring, one.record.as_dict()) for ring in _outlines(one.shape.__geo_interface__)]
        return features, ()
    with geojson_features(path, "polygons", frame) as mapped:
        for number, feature in enumerate(mapped, 1):
            own, geometry = dict(feature.get("properties") or {}), feature.get("geometry", feature)
            if geometry is None or geometry["type"] not in ("Polygon", "MultiPolygon"):
                got = "" if geometry is None else str(geometry["type"])[:40]
                raise InputError("no_polygon", file=path, feature=number, got=got)
            features += [(ring, own) for ring in _outlines(geometry)]
    return features, ()


def planted_polygons(path: Path, frame: Frame | None, columns: Mapping[str, str] = NONE_NAMED) -> list[NamedPolygon]:
    """Polygons of plants.

    Parameters
    ----------
    columns : mapping of str
        Headings of `stems` and `name`.

    Raises
    ------
    InputError
        As `read_polygons`, and for one without stems among others that have.
    """
    found = read_polygons(path, frame, columns)
    counted = any(one.density is not None for one in found)
    for one in found:
        sound = one.density is not None and 0.0 < one.density <= MOST_STEMS and not is_mark_anywhere(one.density)
        if counted and not sound:
            got = "none" if one.density is None else f"{one.density:g}"
            raise InputError(
                f"{shown_path(path)}: expected stems of polygon {one.name} above 0, up to {MOST_STEMS:g} 1/m2, got "
                f"{got}; correct them, or take it out where nothing grows."
            )
    return found


def refuse_far_polygons(path: Path, found: Sequence[NamedPolygon], place: Placement) -> None:
    """InputError for polygons that are rather degrees, or far from the site."""
    x, y = np.array([corner for one in found for corner in one.corners]).T
    east, north = place.frame.to_map(x, y) if place.frame is not None else (x, y)
    refuse_far_places(shown_path(path), east, north, place)


def summary_of_plants(found: Sequence[NamedPolygon]) -> str:
    """`2 patches: stems from Density; not read: d_mm`."""
    known = dict.fromkeys(one.density_from for one in found if one.density_from is not None)
    unread = dict.fromkeys(heading for one in found for heading in one.unread)
    alike = dict.fromkeys(heading for one in found for heading in one.like_density)
    units = units_assumed(found)
    return sentence(PatchesRead(len(found), tuple(known), units.lengths, units.densities, tuple(unread), tuple(alike)))


def units_assumed(found: Sequence[NamedPolygon]) -> UnitsAssumed:
    """Lengths and densities without a unit."""
    lengths = [*dict.fromkeys(axis for one in found for axis in one.unitless)]
    headings = dict.fromkeys(one.density_from for one in found if one.density_from is not None)
    plain = [heading for heading in headings if not _area_named(heading)]
    return UnitsAssumed(tuple(lengths), tuple(plain))


def _area_named(heading: str) -> str:
    """`m2` of `stems_m2`, '' if a heading ends in no area."""
    last = words_of(heading).rpartition(" ")[2]
    return last if last in ("m2", "ft2") else ""


def _first_heading(properties: Properties, names: Iterable[str]) -> str | None:
    """The heading that is the first of these names and holds something; None if there is none."""
    known = {words_of(heading): heading for heading, value in properties.items() if value not in (None, "")}
    return next((known[name] for name in names if name in known), None)


def _columns_named(path: Path, columns: Mapping[str, str], headings: Sequence[str]) -> dict[str, str]:
    """The headings that the site file names, with or without their unit. InputError for one that is not there."""
    found: dict[str, str] = {}
    for what, named in columns.items():
        alike = [one for one in headings if named in names_without_unit(one)]
        if named not in headings and len(alike) != 1:
            raise InputError(
                f"{shown_path(path)}: expected {named!r} for {what} of each polygon, got "
                f"{', '.join(headings) or 'none'}; correct `columns` of this file in `patches`."
            )
        found[what] = named if named in headings else alike[0]
    return found


def _polygons_of_table(path: Path, columns: Mapping[str, str]) -> tuple[list[tuple[Ring, Properties]], tuple[str, ...]]:
    """Corners [m] and properties, those of its first row, of each name, of all rows if no column names polygons; and
    which of x and y have no stated unit.

    InputError for a table without x and y, a corner that lacks one, and fewer corners than a triangle has.
    """
    table = parse_table(path)
    if not {"x", "y"} <= {known[0] for heading in table.headings if (known := role_of(heading)) is not None}:
        raise InputError(
            f"{shown_path(path)}: expected columns of x and y, with a row for each corner of a patch, got "
            f"{', '.join(table.headings)}; rectangles may stand in the site file, "
            "`patches: [{x: [20, 24], y: [0, 1.5], stems_per_m2: 22}]`."
        )
    taken = rows_of_table(path, table, FileOptions())
    headings = _columns_named(path, columns, table.headings)
    texts = {**{taken.columns[role]: words for role, words in taken.texts.items()}, **taken.others}
    rows = [{heading: column[row].strip() for heading, column in texts.items()} for row in range(taken.size)]
    first_of_words = next((taken.columns[role] for role in taken.texts), None)
    named = headings.get("name") or _first_heading(rows[0], NAMES) or first_of_words
    places = np.column_stack([taken.numbers["x"], taken.numbers["y"]])
    found: dict[str, tuple[Ring, Properties]] = {}
    for line, properties, place in zip(taken.lines, rows, places.tolist(), strict=True):
        if not np.isfinite(place).all():
            raise InputError(f"{shown_path(path)}, row {line}: expected x and y of a corner, got none; add them.")
        name = properties.get(named or "", "")
        found.setdefault(name, ([], properties))[0].append((place[0], place[1]))
    for name, (corners, _) in found.items():
        if len(corners) < FEWEST_CORNERS:
            raise InputError(
                f"{shown_path(path)}: expected three corners or more of patch {name!r}, got {len(corners)}; add them, "
                "a row each, or write a rectangle into the site file, `patches: [{x: [20, 24], y: [0, 1.5]}]`."
            )
    assumed = taken_as_si(table, columns_of_table(path, table, FileOptions()), FileOptions())
    return list(found.values()), tuple(one for one in ("x", "y") if one in assumed)


def _outlines(geometry: Mapping[str, Any]) -> Iterator[Ring]:
    """One outline of each part of a geometry of GeoJSON, with its holes; nothing of what is no area.

    The outer ring is joined to each hole by a line there and back: a ray crosses such lines twice, or never. Holes run
    the other way round, so that their areas are taken off.
    """

    def runs_left(ring: Ring) -> bool:
        return signed_area(np.array(ring) - ring[0]) > 0.0  # from its first corner: map coordinates are large

    parts = {"Polygon": [geometry["coordinates"]], "MultiPolygon": geometry["coordinates"]}
    for part in parts.get(geometry["type"], []):
        if part:
            rings: list[Ring] = [[(float(corner[0]), float(corner[1])) for corner in ring] for ring in part]
            outer, *holes = [ring[:-1] if len(ring) > 1 and ring[0] == ring[-1] else ring for ring in rings]
            outline = list(outer)
            for hole in holes:
                turned = hole[::-1] if runs_left(hole) == runs_left(outer) else hole
                outline += [outer[0], *turned, turned[0]]
            yield outline


@contextmanager
def geojson_features(path: Path, what: str, frame: Frame | None = None) -> Iterator[list[Any]]:
    """The features of a GeoJSON file, or its one geometry.

    Parameters
    ----------
    what : str
        It should hold.
    frame : Frame, optional

    Raises
    ------
    InputError
        If it is no GeoJSON, names another system than the frame does, or lacks what is read of it within.
    """
    refuse_foreign_format(path)
    try:
        tree = json.loads(readable_text(path))
        number = epsg_number(json.dumps(tree.get("crs")))
        refuse_other_system(path, StatedSystem(number, ""), frame)
        yield tree["features"] if tree["type"] == "FeatureCollection" else [tree]
    except InputError:  # a ValueError, too
        raise
    except (ValueError, KeyError, TypeError, IndexError, AttributeError, RecursionError):
        raise InputError("no_geojson", file=path, what=what) from None


@contextmanager
def shapes_and_records(path: Path, kind: str, frame: Frame | None) -> Iterator[list[Any]]:
    """The shapes and records of a shapefile.

    Its .cpg names the encoding of its texts; without it they are UTF-8, or what Windows in the west writes.

    Parameters
    ----------
    kind : str
        With which the type of its shapes begins, such as POLYGON.

    Raises
    ------
    InputError
        If it is no shapefile, or its .prj states another system than the frame.
    """
    beside = {one.suffix.lower(): one for one in path.parent.glob(f"{glob.escape(path.stem)}.*")}
    if ".prj" in beside:
        refuse_other_system(path, system_of_wkt(readable_text(beside[".prj"])), frame)
    with importing("pyshp", path, "field", "GeoJSON"):
        import shapefile
    encoding = "utf-8"
    if ".cpg" in beside:
        with suppress(LookupError, ValueError):  # of a name that is no encoding
            encoding = codecs.lookup(readable_text(beside[".cpg"]).strip()).name
    with read_by_library(path, "shapefile"):
        try:
            with shapefile.Reader(str(path), encoding=encoding) as reader:
                found = list(reader.shapeRecords())
        except (UnicodeDecodeError, shapefile.ShapefileException) as error:
            if "decode" not in str(error):
                raise
            with shapefile.Reader(str(path), encoding="cp1252", encodingErrors="replace") as reader:
                found = list(reader.shapeRecords())
        yield [one for one in found if one.shape.shapeTypeName.startswith(kind)]


def refuse_crossing(where: str, ring: Sequence[tuple[float, float]]) -> None:
    """Refuse the outline of a polygon that crosses itself, like a bow tie: half of its area would be lost.

    Sides a b and c d cross if c and d lie on different sides of a b, and a and b on different sides of c d; the lines
    there and back to holes touch others at their ends only.

    Parameters
    ----------
    where : str
        How the message begins.
    ring : sequence of (float, float)
        Its corners [m].

    Raises
    ------
    InputError
        Naming where it crosses.
    """
    a = np.asarray(ring, dtype=np.float64)
    if len(a) < 4 or len(a) > MOST_CORNERS:
        return
    a = a - a[0]  # products of map coordinates would lose the last digits
    b = np.roll(a, -1, axis=0)

    def side(p: Array, q: Array, r: Array) -> Array:
        (x, y), (u, v) = (q - p).T, (r - p).T
        return np.sign(x * v - y * u)

    for i in range(len(a) - 2):
        c, d = a[i + 2 :], b[i + 2 :]
        p, q = np.broadcast_to(a[i], c.shape), np.broadcast_to(b[i], c.shape)
        crosses = (side(p, q, c) * side(p, q, d) < 0.0) & (side(c, d, p) * side(c, d, q) < 0.0)
        if crosses.any():
            corner = ring[i]
            raise InputError(
                f"{where}: expected an outline that does not cross itself, got one that does between its corners "
                f"{i + 1} and {i + 2} (at {corner[0]:.10g}, {corner[1]:.10g}); put them in their order around it."
            )


def _rounded(x: float, y: float) -> tuple[float, float]:
    """A place to a tenth of a millimetre [m]."""
    return round(x, 4), round(y, 4)


def _may_be_degrees(places: Iterable[tuple[float, float]]) -> bool:
    """Whether all places (east, north) are small enough for degrees."""
    return all(abs(x) <= LARGEST_LONGITUDE and abs(y) <= LARGEST_LATITUDE for x, y in places)


def _refuse_degrees(path: Path, frame: Frame | None, lines: Sequence[Sequence[tuple[float, float]]]) -> None:
    """InputError if all points are degrees and those of the frame are metres.

    They are if its origin lies further from 0 than degrees do, or if it names a system and the points, all of them, lie
    nearer together than those of a reach in metres.
    """
    if frame is None or not (places := [place for line in lines for place in line]):
        return
    spans = [max(of_axis) - min(of_axis) for of_axis in zip(*places, strict=True)]
    small = frame.crs is not None and max(spans) < SPAN_OF_DEGREES
    if (small or max(map(abs, frame.origin)) > LARGEST_LONGITUDE) and _may_be_degrees(places):
        raise InputError(
            f"{shown_path(path)}: expected coordinates in m like those of `frame`, got degrees; save it in the "
            f"projected system of the survey{f', {frame.crs}' if frame.crs else ''}."
        )


@dataclass(frozen=True)
class DrawnCentreline:
    """A centreline of a site file.

    Attributes
    ----------
    shape : Tree
        As a case keeps it, in the frame.
    line : Centreline
        What it makes.
    columns, units : Tree
        Of a table.
    taken : str
        A summary.
    """

    shape: Tree
    line: Centreline
    columns: Tree
    units: Tree
    taken: str


def drawn_placement(folder: Path, site: FieldSite) -> tuple[DrawnCentreline | None, Placement]:
    """The centreline of a site, if it has one, and where its channel lies on the map.

    Raises
    ------
    InputError
        If the centreline cannot be read or drawn.
    """
    frame = site.frame.frame if site.frame is not None else None
    given = site.grid.centreline if site.grid is not None else None
    drawn = drawn_centreline(folder, given, frame) if given is not None else None
    return drawn, Placement(frame, drawn.line if drawn is not None else None)


def drawn_centreline(folder: Path, given: FileOfSite | CentrelineShape, frame: Frame | None) -> DrawnCentreline:
    """The centreline of a site file, brought from the map into the frame.

    Parameters
    ----------
    given : FileOfSite or CentrelineShape
        A file, a table of x and y, a line of GeoJSON, or of a shapefile, upstream first; or points, or parts and arcs.

    Raises
    ------
    InputError
        For a file that is not there, or holds no line.
    """
    columns: Tree = {}
    units: Tree = {}
    how = "site file"
    if isinstance(given, CentrelineShape):
        shape = given
        if frame is not None and shape.points is not None:
            shape = shape.model_copy(update={"points": tuple(_rounded(*frame.to_model(*one)) for one in shape.points)})
        elif frame is not None:
            start, heading = _rounded(*frame.to_model(*shape.start)), round(shape.heading - frame.angle, 6)
            shape = shape.model_copy(update={"start": start, "heading": heading})
    else:
        path = folder / given.file
        if not path.is_file():
            raise InputError("not_there", folder=folder, key="grid.centreline.file", name=given.file)
        keys = dict(given.model_extra or {})
        reverse = bool(keys.pop("reverse", False))
        options = read_file_options(keys, f"{shown_path(folder)}: `grid.centreline`")
        taken = read_line(path, frame) if path.suffix.lower() in MAP_FILES else read_rows(path, options)
        turned = in_the_channel(taken, Placement(frame), options)
        if not {"x", "y"} <= turned.numbers.keys():
            raise InputError(
                f"{shown_path(path)}: expected columns of x and y, got {', '.join(turned.columns.values())}; name them "
                "by `columns` of `grid.centreline`."
            )
        at = np.column_stack([turned.numbers["x"], turned.numbers["y"]])
        points: list[tuple[float, float]] = []
        for point in (_rounded(*place) for place in at[np.isfinite(at).all(axis=1)].tolist()):
            if not points or math.dist(point, points[-1]) >= NEAREST_POINTS:
                points.append(point)
        if not 2 <= len(points) <= MOST_POINTS:
            raise InputError(
                f"{shown_path(path)}: expected a line of 2 to {MOST_POINTS:,} points, got {len(points):,}; a few dozen "
                "do, simplify it in the map program."
            )
        places = list(zip(taken.numbers["x"].tolist(), taken.numbers["y"].tolist(), strict=True))
        _refuse_degrees(path, frame, [places])
        shape = CentrelineShape(points=tuple(points[::-1] if reverse else points))
        taken = taken.not_reading(*(taken.columns.keys() - {"x", "y"}))
        columns, units = dict(taken.columns), dict(taken.units)
        how = ", ".join([taken.summary, *sentences([ImportNote(Noted.LAST_FIRST)] if reverse else [])])
    line = centreline_of(shape)

    def as_lists(value: Any) -> Any:
        if isinstance(value, list | tuple):
            return [as_lists(one) for one in value]
        is_tree = isinstance(value, dict)
        return {key: as_lists(one) for key, one in value.items() if one is not None} if is_tree else value

    kept = {key: as_lists(value) for key, value in shape.model_dump(exclude_defaults=True, exclude_none=True).items()}
    turn = float(np.degrees(line.heading[-1] - line.heading[0]))
    sharpest = float(np.abs(np.gradient(line.heading, line.s)).max())
    bends = np.degrees(np.ptp(line.heading)) >= STRAIGHT
    shown = CentrelineTaken(float(line.s[-1]), turn, 1.0 / sharpest if bends else None)
    return DrawnCentreline(kept, line, columns, units, f"{sentence(shown)}: {how}")


def read_line(path: Path, frame: Frame | None = None) -> MeasuredRows:
    """The one line in a file of a map program.

    Parameters
    ----------
    path
        GeoJSON or a shapefile.
    frame
        Of the model on the map, whose coordinate system the file has to have.

    Returns
    -------
    MeasuredRows
        x and y of its points, in their order [m].

    Raises
    ------
    InputError
        For several lines, degrees, and another system than that of the frame.
    """
    if path.suffix.lower() == ".shp":
        with shapes_and_records(path, "POLYLINE", frame) as records:
            shapes = [one.shape for one in records]
            ends = [list(zip(one.parts, [*one.parts[1:], len(one.points)], strict=True)) for one in shapes]
            found = [one.points[a:b] for one, parts in zip(shapes, ends, strict=True) for a, b in parts]
    else:
        with geojson_features(path, "a line", frame) as features:
            geometries = [feature.get("geometry", feature) for feature in features]
            lines = [[one["coordinates"]] for one in geometries if one["type"] == "LineString"]
            lines += [one["coordinates"] for one in geometries if one["type"] == "MultiLineString"]
            found = [[(float(point[0]), float(point[1])) for point in line] for part in lines for line in part]
    if len(found) != 1:
        raise InputError(f"{shown_path(path)}: expected one line, got {len(found)}; save the centreline alone.")
    places = np.array(found[0], dtype=np.float64)
    if places.ndim != 2 or any(map(is_mark_anywhere, places.ravel().tolist())):
        raise InputError(f"{shown_path(path)}: expected a line of points with numbers, got another; draw it anew.")
    x, y = places[:, :2].T
    if max(np.ptp(x), np.ptp(y)) < SPAN_OF_DEGREES and _may_be_degrees(zip(x.tolist(), y.tolist(), strict=True)):
        raise InputError(f"{shown_path(path)}: expected coordinates in m, got degrees; save it in a projected system.")
    note = (f"line of {path.suffix[1:]}",)
    return MeasuredRows({"x": x, "y": y}, {}, {"x": "east", "y": "north"}, {"x": "m", "y": "m"}, note)
