"""Fields and stations as CSV, in the coordinates of the model and of the map."""

import csv
import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.case.frame import Frame
from vegglue.case.grid import Grid
from vegglue.case.text_files import write_text
from vegglue.flow.sensor import FlowFields
from vegglue.results.mesh_file import QUANTITIES_OF_FLOW, on_the_map, quantities

MAKE_ROOM_THERE = "make room and run it again"


def write_field_table(path: Path, flow: FlowFields, grid: Grid, frame: Frame | None) -> None:
    """One row a cell: x, y, east, north of its centre [m], then the quantities with their units; nothing where dry."""
    x, y = (part.ravel() for part in np.meshgrid(flow.x, flow.y, indexing="ij"))
    found = quantities(flow, grid, frame)
    heading = [f"{name} [{QUANTITIES_OF_FLOW[name][1]}]" for name in found]
    columns = [*_places(x, y, grid, frame), *(values.ravel() for values in found.values())]
    _write(path, [*_place_headings(grid, frame), *heading], columns)


def write_station_table(
    path: Path, station: Mapping[str, Array], predicted: Array | None, grid: Grid, frame: Frame | None
) -> None:
    """One row a station, as the case reads them, with places on the map; and what the model gives there, if known.

    station: columns (station,) of Observations.table.
    """
    x, y = station["x"].astype(float), station["y"].astype(float)
    names = ("experiment", "kind", "section", "value", "standard_error", "used", "reason")
    columns = [*_places(x, y, grid, frame), *(station[name] for name in names)]
    more = [] if predicted is None else ["predicted"]
    _write(
        path, [*_place_headings(grid, frame), *names, *more], [*columns, *([] if predicted is None else [predicted])]
    )


def _place_headings(grid: Grid, frame: Frame | None) -> list[str]:
    return ["x [m]", "y [m]", *(["east [m]", "north [m]"] if frame is not None or grid.centreline is not None else [])]


def _places(x: Array, y: Array, grid: Grid, frame: Frame | None) -> list[Array]:
    turned = frame is not None or grid.centreline is not None
    return [x, y, *(on_the_map(x, y, grid, frame) if turned else ())]


def _write(path: Path, heading: list[str], columns: list[Array]) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heading)
    writer.writerows([_shown(value) for value in row] for row in zip(*columns, strict=True))
    write_text(path, text.getvalue(), MAKE_ROOM_THERE)


def _shown(value: object) -> str:
    """Numbers in full, so that they are the same when read again; nothing for what is unknown."""
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else repr(float(value))
    return str(value)
