"""Fields as GeoTIFF: one value a cell, placed on the map by the frame of the model, however that is turned."""

import re
from io import BytesIO
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.case.frame import Frame
from vegglue.case.grid import Grid
from vegglue.errors import InputError
from vegglue.whole_files import MAKE_ROOM, write_file

# Tags of GeoTIFF 1.1 (OGC 19-008): the affine way from pixels to the map, and the coordinate system; and that of GDAL
# for what marks no data.
TRANSFORMATION, GEO_KEYS, MARKS_NO_DATA = 34264, 34735, 42113
# Keys: a projected model, pixels as areas, the code of the system.
MODEL_TYPE, RASTER_TYPE, PROJECTED = 1024, 1025, 3072
NO_LEVEL_THERE = -9999.0


def write_geotiff(path: Path, values: Array, grid: Grid, frame: Frame | None) -> None:
    """Write values (nx, ny) at cell centres, NaN where there is none, as float64.

    A pixel (column, row) lies at x = x_0 + column dx, y = y_1 - row dy, which the frame turns onto the map.
    Errors: InputError without tifffile; StorageError.
    """
    try:
        import tifffile
    except ImportError:
        raise InputError(
            f"{path}: GeoTIFFs are written by tifffile, which is not installed; run `pip install 'vegglue[field]'`, or "
            "leave them out by --only csv."
        ) from None
    keys = _keys(frame)
    tags = [
        (TRANSFORMATION, "d", 16, _affine(grid, frame), True),
        (GEO_KEYS, "H", len(keys), keys, True),
        (MARKS_NO_DATA, "s", 0, f"{NO_LEVEL_THERE:g}", True),
    ]
    north_up = np.where(np.isnan(values), NO_LEVEL_THERE, values).T[::-1]
    content = BytesIO()
    tifffile.imwrite(content, np.ascontiguousarray(north_up), extratags=tags, metadata=None, compression=None)
    write_file(path, content.getvalue(), MAKE_ROOM)


def _affine(grid: Grid, frame: Frame | None) -> tuple[float, ...]:
    """The 4 by 4 matrix, row by row, from (column, row) to (east, north)."""
    west, north_edge = float(grid.x[0]) - 0.5 * grid.dx, float(grid.y[-1]) + 0.5 * grid.dy
    place = frame or Frame(origin=(0.0, 0.0), angle=0.0)
    (a, d), (b, e) = place.turned_to_map(grid.dx, 0.0), place.turned_to_map(0.0, -grid.dy)
    c, f = place.to_map(west, north_edge)
    return (a, b, 0.0, c, d, e, 0.0, f, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def _keys(frame: Frame | None) -> tuple[int, ...]:
    """The directory of keys; without a code of EPSG only that it is a map of areas."""
    code = epsg_code(frame)
    entries = [(MODEL_TYPE, 0, 1, 1), (RASTER_TYPE, 0, 1, 1)] + ([(PROJECTED, 0, 1, code)] if code else [])
    return (1, 1, 0, len(entries), *(number for entry in entries for number in entry))


def epsg_code(frame: Frame | None) -> int | None:
    """2056 for EPSG:2056, None where the frame names no such code."""
    found = re.fullmatch(r"EPSG:(\d{4,5})", (frame.crs or "").strip(), re.IGNORECASE) if frame is not None else None
    return int(found[1]) if found else None
