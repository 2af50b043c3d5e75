"""Polygons of patches and friction classes from GeoJSON, shapefiles and tables, brought into the channel."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from vegglue.case.frame import Frame
from vegglue.errors import InputError, shown_path
from vegglue.importers.map_files import geojson_features, refuse_degrees, rounded_place, shapes_and_records
from vegglue.importers.polygon_properties import (
    CLASSES,
    NAMES,
    density_factor,
    density_heading,
    first_heading,
    given_heading,
    like_densities,
    names_its_unit,
)
from vegglue.importers.polygon_tables import NONE_NAMED, columns_named, polygons_of_table
from vegglue.wording.numbers import listed, so_many

AREAS = ("Polygon", "MultiPolygon")  # geometries of GeoJSON
TABLES = (".csv", ".txt", ".tsv", ".dat", ".xlsx", ".xlsm")
MOST_STEMS = 1e7  # 1/m2, as in the site file
Ring = list[tuple[float, float]]


@dataclass(frozen=True)
class NamedPolygon:
    """Corners in the channel [m]; density [1/m2] and class where the file says them; density_from: its heading;
    unread: headings of what else the file says of it, like_density: those that may be a density; lengths_taken: which
    of x and y were taken as m, unsaid.
    """

    name: str
    corners: Ring
    density: float | None
    friction_class: str | None
    density_from: str | None = None
    unread: tuple[str, ...] = ()
    like_density: tuple[str, ...] = ()
    lengths_taken: tuple[str, ...] = ()


def read_polygons(path: Path, frame: Frame | None, columns: Mapping[str, str] = NONE_NAMED) -> list[NamedPolygon]:
    """All polygons of a file, each part of one for itself. columns: headings of `stems` and `name`, where they are not
    told by themselves.

    Errors: InputError for another file, for degrees, and for a heading that is not there.
    """
    features, taken = _features(path, frame, columns)
    if not features:
        raise InputError(f"{shown_path(path)}: expected polygons, got none; save the areas as polygons.")
    refuse_degrees(path, frame, [ring for ring, _ in features])
    headings = columns_named(path, columns, [*dict.fromkeys(str(key) for _, said in features for key in said)])
    named = [_named_polygon(path, frame, f"p{number}", headings, *one) for number, one in enumerate(features, 1)]
    return [replace(one, lengths_taken=taken) for one in named]


def _features(
    path: Path, frame: Frame | None, columns: Mapping[str, str]
) -> tuple[Sequence[tuple[Ring, Mapping[str, Any]]], tuple[str, ...]]:
    """Outlines with their properties, and which of x and y nobody gave a unit of; a map is in m by its frame."""
    ending = path.suffix.lower()
    if ending in TABLES:
        return polygons_of_table(path, columns)
    return list(_of_shapefile(path) if ending == ".shp" else _of_geojson(path, frame)), ()


def _named_polygon(
    path: Path,
    frame: Frame | None,
    number: str,
    named: Mapping[str, str],
    ring: Ring,
    properties: Mapping[str, Any],
) -> NamedPolygon:
    of_density = given_heading(properties, named["stems"]) if "stems" in named else density_heading(properties)
    of_name = given_heading(properties, named["name"]) if "name" in named else first_heading(properties, NAMES)
    of_class = first_heading(properties, CLASSES)
    unread = {str(one): value for one, value in properties.items() if one not in (of_density, of_class, of_name)}
    return NamedPolygon(
        name=str(properties[of_name]) if of_name is not None else number,
        corners=[rounded_place(*(frame.to_model(*corner) if frame is not None else corner)) for corner in ring],
        density=_density(path, of_density, properties[of_density]) if of_density is not None else None,
        friction_class=str(properties[of_class]) if of_class is not None else None,
        density_from=of_density,
        unread=tuple(unread),
        like_density=like_densities(unread),
    )


def planted_in_words(found: Sequence[NamedPolygon]) -> str:
    """`2 patches: stems from Density; not read: d_mm`."""
    known = dict.fromkeys(one.density_from for one in found if one.density_from is not None)
    unread = dict.fromkeys(heading for one in found for heading in one.unread)
    said = f"stems from {listed(list(known))}" if known else "no stems, and so equally dense"
    clauses = [f"{so_many(len(found), 'patch', 'patches')}: {said}", *units_taken(found)]
    clauses += [f"not read: {listed(list(unread))}"] if unread else []
    alike = dict.fromkeys(heading for one in found for heading in one.like_density)
    if alike and not known:
        first = next(iter(alike))
        clauses.append(
            f"{listed(list(alike))} may be their density: where it is, write "
            f"`patches: {{file: ..., columns: {{stems: {first}}}}}`"
        )
    return "; ".join(clauses)


def units_taken(found: Sequence[NamedPolygon]) -> list[str]:
    """`no unit given of x and y, taken as m`, and the same of densities, taken as 1/m2; nothing where all are given."""
    lengths = [*dict.fromkeys(axis for one in found for axis in one.lengths_taken)]
    headings = dict.fromkeys(one.density_from for one in found if one.density_from is not None)
    plain = [heading for heading in headings if not names_its_unit(heading)]
    taken = [f"{listed(names)}, taken as {unit}" for names, unit in ((lengths, "m"), (plain, "1/m2")) if names]
    return [f"no unit given of {', and of '.join(taken)}"] if taken else []


def planted_polygons(path: Path, frame: Frame | None, columns: Mapping[str, str] = NONE_NAMED) -> list[NamedPolygon]:
    """Polygons of plants. Errors: InputError as in read_polygons, and for one without stems among others that have."""
    found = read_polygons(path, frame, columns)
    said = any(one.density is not None for one in found)
    for one in found:
        if said and not (one.density is not None and 0.0 < one.density <= MOST_STEMS):
            got = "none" if one.density is None else f"{one.density:g}"
            raise InputError(
                f"{shown_path(path)}: expected stems of polygon {one.name} above 0, up to {MOST_STEMS:g} 1/m2, got "
                f"{got}; correct them, or take it out where nothing grows."
            )
    return found


def _of_geojson(path: Path, frame: Frame | None) -> Iterator[tuple[Ring, Mapping[str, Any]]]:
    with geojson_features(path, "polygons", frame) as features:
        for number, feature in enumerate(features, 1):
            properties = dict(feature.get("properties") or {})
            geometry = feature["geometry"]
            if geometry is None or geometry["type"] not in AREAS:
                got = "one of no place" if geometry is None else f"a {str(geometry['type'])[:40]}"
                raise InputError(
                    f"{shown_path(path)}: expected polygons alone, got {got} as feature {number}; take it out, or save "
                    "it as the area that it stands for."
                )
            yield from ((ring, properties) for ring in _outlines(geometry))


def _of_shapefile(path: Path) -> Iterator[tuple[Ring, Mapping[str, Any]]]:
    with shapes_and_records(path, "POLYGON") as found:
        for one in found:
            yield from ((ring, one.record.as_dict()) for ring in _outlines(one.shape.__geo_interface__))


def _outlines(geometry: Mapping[str, Any]) -> Iterator[Ring]:
    """One outline of each part of a geometry of GeoJSON; nothing of what is no area."""
    parts = {"Polygon": [geometry["coordinates"]], "MultiPolygon": geometry["coordinates"]}
    for rings in parts.get(geometry["type"], []):
        if rings:
            yield _with_holes([_open([(float(corner[0]), float(corner[1])) for corner in ring]) for ring in rings])


def _with_holes(rings: Sequence[Ring]) -> Ring:
    """The outer ring, joined to each hole by a line there and back: a ray crosses such lines twice, or never.

    Holes run the other way round, so that their areas are taken off.
    """
    outer, *holes = rings
    outline = list(outer)
    for hole in holes:
        turned = hole[::-1] if (_area(hole) > 0.0) == (_area(outer) > 0.0) else hole
        outline += [outer[0], *turned, turned[0]]
    return outline


def _area(ring: Ring) -> float:
    """A = sum((x_i - x_0) (y_(i+1) - y_0) - (x_(i+1) - x_0) (y_i - y_0)) / 2, above 0 counterclockwise."""
    x, y = (np.array(ring) - ring[0]).T
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _density(path: Path, heading: str, value: Any) -> float:
    try:
        return float(value) * density_factor(heading)
    except (ValueError, TypeError, OverflowError):
        complaint = f"expected a number of stems in 1/m2, got {str(value)[:40]!r}; correct it"
        raise InputError(f"{shown_path(path)}: {complaint}.") from None


def _open(ring: Ring) -> Ring:
    return ring[:-1] if len(ring) > 1 and ring[0] == ring[-1] else ring
