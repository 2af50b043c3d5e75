"""What map programs save: features of GeoJSON and shapes of shapefiles."""

import json
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from vegglue.case.frame import Frame
from vegglue.errors import InputError, shown_path
from vegglue.importers.library_files import read_by_library
from vegglue.importers.loose_table import readable_text

# No longitude and no latitude is further from 0 [degrees].
LARGEST_LONGITUDE, LARGEST_LATITUDE = 360.0, 90.0
# Degrees on the map that a whole reach spans at most: what is so small, in a file of a map program, lies in degrees.
SPAN_OF_DEGREES = 0.5


@contextmanager
def geojson_features(path: Path, what: str, frame: Frame | None = None) -> Iterator[list[Any]]:
    """The features of a GeoJSON file, or its one geometry; what: it should hold, in words.

    Errors: InputError when it is none, names another system than the frame does, or what is done with them within does
    not find what it should.
    """
    try:
        tree = json.loads(readable_text(path))
        _refuse_other_system(path, tree.get("crs"), frame)
        yield tree["features"] if tree["type"] == "FeatureCollection" else [tree]
    except InputError:  # a ValueError that says what it is
        raise
    except (ValueError, KeyError, TypeError, IndexError, AttributeError, RecursionError) as error:
        raise InputError(
            f"{shown_path(path)}: expected GeoJSON with {what}, got another file ({error}); save it as GeoJSON."
        ) from None


@contextmanager
def shapes_and_records(path: Path, kind: str) -> Iterator[list[Any]]:
    """Those of a shapefile whose type begins with a kind, such as POLYGON. Errors: InputError when it is none."""
    try:
        import shapefile
    except ImportError:
        raise InputError(
            f"{shown_path(path)}: shapefiles are read by pyshp, which is not installed; run "
            "`pip install 'vegglue[field]'`, or save it as GeoJSON."
        ) from None
    with read_by_library(path, "a shapefile"), shapefile.Reader(str(path)) as reader:
        yield [one for one in reader.shapeRecords() if one.shape.shapeTypeName.startswith(kind)]


def rounded_place(x: float, y: float) -> tuple[float, float]:
    """To a tenth of a millimetre [m]."""
    return round(x, 4), round(y, 4)


def may_be_degrees(places: Iterable[tuple[float, float]]) -> bool:
    """Whether all places (east, north) are small enough for degrees."""
    return all(abs(x) <= LARGEST_LONGITUDE and abs(y) <= LARGEST_LATITUDE for x, y in places)


def refuse_degrees(path: Path, frame: Frame | None, lines: Sequence[Sequence[tuple[float, float]]]) -> None:
    """Errors: InputError where all points are degrees and those of the frame are metres.

    They are where its origin lies further from 0 than degrees do, or where it names a system and the points, all of
    them, lie nearer together than those of a reach in metres.
    """
    if frame is None or not (places := [place for line in lines for place in line]):
        return
    spans = [max(of_axis) - min(of_axis) for of_axis in zip(*places, strict=True)]
    small = frame.crs is not None and max(spans) < SPAN_OF_DEGREES
    if (small or max(map(abs, frame.origin)) > LARGEST_LONGITUDE) and may_be_degrees(places):
        raise InputError(
            f"{shown_path(path)}: expected coordinates in m like those of `frame`, got degrees; save it in the "
            f"projected system of the survey{f', {frame.crs}' if frame.crs else ''}."
        )


def _refuse_other_system(path: Path, said: Any, frame: Frame | None) -> None:
    """Errors: InputError where the `crs` of a GeoJSON is another number of EPSG than that of the frame."""
    given, own = _number_of_system(json.dumps(said)), _number_of_system(frame.crs or "" if frame is not None else "")
    if given and own and given != own:
        raise InputError(
            f"{shown_path(path)}: expected coordinates in EPSG:{own}, the `crs` of `frame`, got EPSG:{given}; save it "
            "in that system, or take its `crs` out where both are the same."
        )


def _number_of_system(crs: str) -> str:
    """`28992` of `EPSG:28992` and `urn:ogc:def:crs:EPSG::28992`; '' where there is none."""
    found = re.search(r"EPSG:(?:[\d.]*:)?(\d+)", crs, re.IGNORECASE)
    return found[1] if found else ""
