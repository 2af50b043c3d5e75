"""The centreline of a bend in a site file: points in a file, a list of them, or straight parts and arcs.

A file is a table of x and y, a line of GeoJSON, or of a shapefile; upstream first.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vegglue.case.centreline import Centreline, centreline_of
from vegglue.case.frame import Frame
from vegglue.case.resolved_config import Tree
from vegglue.case.site_schema import NEAREST_POINTS, CentrelineShape
from vegglue.errors import InputError, shown_path
from vegglue.importers.field_site import FileOfSite
from vegglue.importers.file_words import file_words
from vegglue.importers.map_files import (
    SPAN_OF_DEGREES,
    geojson_features,
    may_be_degrees,
    refuse_degrees,
    rounded_place,
    shapes_and_records,
)
from vegglue.importers.measured_rows import MeasuredRows, in_the_channel, read_rows, taken_in_words
from vegglue.importers.placement import Placement
from vegglue.wording.numbers import in_digits

# Points of a line that a case can hold; a curve through a few dozen has less of what they jitter.
MOST_POINTS = 1000


@dataclass(frozen=True)
class DrawnCentreline:
    """shape: as a case keeps it, in the frame; line: what it makes; columns, units: of a table; taken: in words."""

    shape: Tree
    line: Centreline
    columns: Tree
    units: Tree
    taken: str


def drawn_centreline(folder: Path, given: FileOfSite | CentrelineShape, frame: Frame | None) -> DrawnCentreline:
    """The centreline that a site file describes, brought from the map into the frame.

    Errors: InputError for a file that is not there, or holds no line.
    """
    if isinstance(given, CentrelineShape):
        return _made(_in_frame(given, frame), {}, {}, "as the site file says")
    path = folder / given.file
    if not path.is_file():
        raise InputError(
            f"{shown_path(folder)}: `grid.centreline.file` names {given.file}, which is not there; correct it."
        )
    said = dict(given.model_extra or {})
    turned = bool(said.pop("reverse", False))
    words = file_words(said, f"{shown_path(folder)}: `grid.centreline`")
    taken = _of_map(path, frame) if path.suffix.lower() in (".geojson", ".json", ".shp") else read_rows(path, words)
    points = _points(path, in_the_channel(taken, Placement(frame), words))
    refuse_degrees(path, frame, [list(zip(taken.numbers["x"].tolist(), taken.numbers["y"].tolist(), strict=True))])
    shape = CentrelineShape(points=tuple(points[::-1] if turned else points))
    told = taken.leaving(*(taken.columns.keys() - {"x", "y"}))
    how = f"{taken_in_words(told)}{', the last one first' if turned else ''}"
    return _made(shape, dict(told.columns), dict(told.units), how)


def _made(shape: CentrelineShape, columns: Tree, units: Tree, how: str) -> DrawnCentreline:
    line = centreline_of(shape)
    kept = {key: _plain(value) for key, value in shape.model_dump(exclude_defaults=True, exclude_none=True).items()}
    turn = np.degrees(line.heading[-1] - line.heading[0])
    side = "left" if turn > 0.0 else "right"
    sharpest = float(np.abs(np.gradient(line.heading, line.s)).max())
    radius = f", radius {in_digits(1.0 / sharpest)} m at least" if sharpest > 0.0 else ""
    taken = f"centreline of {in_digits(line.s[-1], 4)} m, {abs(turn):.0f} degrees to the {side}{radius}: {how}"
    return DrawnCentreline(kept, line, columns, units, taken)


def _plain(value: Any) -> Any:
    """Tuples as the lists that a config has."""
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return {key: _plain(one) for key, one in value.items() if one is not None} if isinstance(value, dict) else value


def _in_frame(shape: CentrelineShape, frame: Frame | None) -> CentrelineShape:
    """What is said on the map, in the frame."""
    if frame is None:
        return shape
    if shape.points is not None:
        return shape.model_copy(update={"points": tuple(rounded_place(*frame.to_model(*one)) for one in shape.points)})
    start = rounded_place(*frame.to_model(*shape.start))
    return shape.model_copy(update={"start": start, "heading": round(shape.heading - frame.angle, 6)})


def _points(path: Path, taken: MeasuredRows) -> list[tuple[float, float]]:
    """Places of the line, each once. Errors: InputError without two of them, or with too many."""
    if not {"x", "y"} <= taken.numbers.keys():
        raise InputError(
            f"{shown_path(path)}: expected columns of x and y, got {', '.join(taken.columns.values())}; name them by "
            "`columns` of `grid.centreline`."
        )
    places = np.column_stack([taken.numbers["x"], taken.numbers["y"]])
    places = places[np.isfinite(places).all(axis=1)]
    found: list[tuple[float, float]] = []
    for point in (rounded_place(*place) for place in places.tolist()):
        if not found or math.dist(point, found[-1]) >= NEAREST_POINTS:
            found.append(point)
    if not 2 <= len(found) <= MOST_POINTS:
        raise InputError(
            f"{shown_path(path)}: expected a line of 2 to {MOST_POINTS:,} points, got {len(found):,}; a few dozen do, "
            "simplify it in the map program."
        )
    return found


def _of_map(path: Path, frame: Frame | None = None) -> MeasuredRows:
    """The one line in a file of a map program."""
    found = _of_shapefile(path) if path.suffix.lower() == ".shp" else _of_geojson(path, frame)
    if len(found) != 1:
        raise InputError(f"{shown_path(path)}: expected one line, got {len(found)}; save the centreline alone.")
    places = np.array(found[0], dtype=np.float64)
    if places.ndim != 2 or not np.isfinite(places).all():
        raise InputError(f"{shown_path(path)}: expected a line of points with numbers, got another; draw it anew.")
    x, y = places[:, :2].T
    if max(np.ptp(x), np.ptp(y)) < SPAN_OF_DEGREES and may_be_degrees(zip(x.tolist(), y.tolist(), strict=True)):
        raise InputError(f"{shown_path(path)}: expected coordinates in m, got degrees; save it in a projected system.")
    form = (f"line of {path.suffix[1:]}",)
    return MeasuredRows({"x": x, "y": y}, {}, {"x": "east", "y": "north"}, {"x": "m", "y": "m"}, form)


def _of_geojson(path: Path, frame: Frame | None) -> list[Any]:
    with geojson_features(path, "a line", frame) as features:
        shapes = [feature.get("geometry", feature) for feature in features]
        lines = [[shape["coordinates"]] for shape in shapes if shape["type"] == "LineString"]
        lines += [shape["coordinates"] for shape in shapes if shape["type"] == "MultiLineString"]
        return [[(float(point[0]), float(point[1])) for point in line] for part in lines for line in part]


def _of_shapefile(path: Path) -> list[Any]:
    with shapes_and_records(path, "POLYLINE") as found:
        return [one.shape.points[a:b] for one in found for a, b in _parts(one.shape)]


def _parts(shape: Any) -> list[tuple[int, int]]:
    return list(zip(shape.parts, [*shape.parts[1:], len(shape.points)], strict=True))
