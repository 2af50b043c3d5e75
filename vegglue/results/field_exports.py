"""Fields and stations for other programs: GeoTIFF, a netCDF mesh after CF 1.8 and UGRID 1.0, and CSV."""

import re
import warnings
from collections.abc import Mapping
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import h5py
import numpy as np

from vegglue.arrays import Array
from vegglue.case.grid import Grid, edges, heading_at, on_map
from vegglue.case.site_schema import Frame
from vegglue.case.text_files import names_in_files, write_text
from vegglue.errors import InputError
from vegglue.flow.sensor import FlowFields
from vegglue.results.calibration_files import csv_text
from vegglue.results.labelled_arrays import ENGINE, extra_library
from vegglue.whole_files import failed_writes_told, write_file
from vegglue.wording.remedies import MAKE_ROOM
from vegglue.wording.sentences import phrase

# Tags of GeoTIFF 1.1 (OGC 19-008): the affine way from pixels to the map, and the coordinate system; and that of GDAL
# for what marks no data.
TRANSFORMATION, GEO_KEYS, MARKS_NO_DATA = 34264, 34735, 42113
# Keys: a projected model, pixels as areas, the code of the system.
MODEL_TYPE, RASTER_TYPE, PROJECTED = 1024, 1025, 3072
NO_LEVEL_THERE = -9999.0
LONGEST_ATTRIBUTE = 60_000  # bytes of a text of fixed length; HDF5 has room for 64 KiB


def write_geotiff(path: Path, values: Array, grid: Grid, frame: Frame | None) -> None:
    """Write a GeoTIFF of float64, whose pixel (column, row) lies at x = x_0 + column dx, y = y_1 - row dy.

    Parameters
    ----------
    values : (nx, ny)
        At cell centres; NaN where there is none.
    frame : Frame, optional
        Turns x and y onto the map.

    Raises
    ------
    InputError
        Without tifffile.
    StorageError
        If it cannot be written.
    """
    try:
        import tifffile
    except ImportError:
        raise InputError(
            f"{path}: GeoTIFFs are written by tifffile, which is not installed; run `pip install 'vegglue[field]'`, or "
            "leave them out by --only csv."
        ) from None
    # The directory of keys; without a code of EPSG only that it is a map of areas.
    code = epsg_code(frame)
    entries = [(MODEL_TYPE, 0, 1, 1), (RASTER_TYPE, 0, 1, 1)] + ([(PROJECTED, 0, 1, code)] if code else [])
    keys = (1, 1, 0, len(entries), *(number for entry in entries for number in entry))
    # The 4 by 4 matrix, row by row, from (column, row) to (east, north).
    west, north_edge = float(grid.x[0]) - 0.5 * grid.dx, float(grid.y[-1]) + 0.5 * grid.dy
    place = frame or Frame(origin=(0.0, 0.0), angle=0.0)
    (a, d), (b, e) = place.turned_to_map(grid.dx, 0.0), place.turned_to_map(0.0, -grid.dy)
    c, f = place.to_map(west, north_edge)
    affine = (a, b, 0.0, c, d, e, 0.0, f, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    tags = [
        (TRANSFORMATION, "d", 16, affine, True),
        (GEO_KEYS, "H", len(keys), keys, True),
        (MARKS_NO_DATA, "s", 0, f"{NO_LEVEL_THERE:g}", True),
    ]
    north_up = np.where(np.isnan(values), NO_LEVEL_THERE, values).T[::-1]
    content = BytesIO()
    tifffile.imwrite(content, np.ascontiguousarray(north_up), extratags=tags, metadata=None, compression=None)
    write_file(path, content.getvalue(), MAKE_ROOM)


def epsg_code(frame: Frame | None) -> int | None:
    """2056 for EPSG:2056, None where the frame names no such code."""
    found = re.fullmatch(r"EPSG:(\d{4,5})", (frame.crs or "").strip(), re.IGNORECASE) if frame is not None else None
    return int(found[1]) if found else None


# Quantities of a flow at cell centres, and their unit.
QUANTITIES_OF_FLOW = dict.fromkeys(("bed", "level", "depth"), "m") | dict.fromkeys(
    ("u", "v", "east_velocity", "north_velocity"), "m/s"
)


def quantities(flow: FlowFields, grid: Grid, frame: Frame | None) -> dict[str, Array]:
    """The fields of one experiment by name.

    Returns
    -------
    dict of ndarray (nx, ny)
        bed, level and depth [m], u and v [m/s]; with a frame or a centreline the components on the map, too.
    """
    found = {name: getattr(flow, name) for name in ("bed", "level", "depth", "u", "v")}
    if frame is not None or grid.centreline is not None:
        u, v = flow.u, flow.v
        if grid.centreline is not None:  # turned by the direction of the centreline, then by the frame
            theta = heading_at(grid.centreline, grid.x)[:, None]
            u, v = u * np.cos(theta) - v * np.sin(theta), u * np.sin(theta) + v * np.cos(theta)
        found["east_velocity"], found["north_velocity"] = frame.turned_to_map(u, v) if frame is not None else (u, v)
    return found


def on_the_map(x: Array, y: Array, grid: Grid, frame: Frame | None) -> tuple[Array, Array]:
    """Places x along and y across the grid (n,) [m] on the map [m]; as they are without a centreline and a frame."""
    if grid.centreline is not None:
        x, y = on_map(grid.centreline, x, y)
    return frame.to_map(x, y) if frame is not None else (x, y)


def write_mesh(
    path: Path, flows: Mapping[str, FlowFields], grid: Grid, frame: Frame | None, attributes: Mapping[str, str]
) -> None:
    """Write a UGRID mesh with one variable for each quantity and experiment, such as u_June; NaN where dry.

    For map programs all text has a fixed length, the components of the velocity on the map have long names that make
    them a vector, and nodes name the coordinate system: QGIS's reader of meshes finds these in no other way.

    Parameters
    ----------
    flows : mapping of str to FlowFields
        By experiment.
    frame : Frame, optional
        Turns x and y onto the map.
    attributes : mapping of str to str
        Of the file.

    Raises
    ------
    InputError
        Without xarray.
    StorageError
        If it cannot be written.
    """
    xarray = extra_library("xarray", "field", "vegglue export")
    extra_library(ENGINE, "field", "vegglue export")
    variables, called = _mesh(grid, frame), names_in_files(flows)
    on_map = ("u", "v") if frame is None and grid.centreline is None else ("east_velocity", "north_velocity")
    for experiment, flow in flows.items():
        for name, values in quantities(flow, grid, frame).items():
            long_name = f"{phrase('quantity_of_flow', name)}, {experiment}"
            if name in on_map:
                long_name = f"velocity, {experiment}, {'xy'[on_map.index(name)]}-component"
            at_faces = {"mesh": "mesh", "location": "face", "coordinates": "face_x face_y", **_mapped(frame)}
            told = {"long_name": long_name, "units": QUANTITIES_OF_FLOW[name], **at_faces}
            # QGIS's reader takes the x-component for both if a vector has no time (lutraconsulting/MDAL issue 521).
            vector = name in on_map
            dims, data = (("time", "face"), values.reshape(1, -1)) if vector else (("face",), values.ravel())
            variables[f"{name}_{called[experiment]}"] = (dims, data, told)
    dataset = xarray.Dataset(variables, attrs={"Conventions": "CF-1.8 UGRID-1.0", **attributes})
    with failed_writes_told(path, MAKE_ROOM), TemporaryDirectory() as folder:  # the library writes to a name only
        whole = Path(folder) / path.name
        coordinates = {name: {"_FillValue": None} for name in ("time", "node_x", "node_y", "face_x", "face_y")}
        dataset.to_netcdf(whole, engine=ENGINE, encoding=coordinates)
        with h5py.File(whole, "r+") as file:
            for owner in (file, *file.values()):
                for name, text in list(owner.attrs.items()):
                    size = len(text.encode()) if isinstance(text, str) else 0
                    if 0 < size < LONGEST_ATTRIBUTE:
                        owner.attrs.create(name, text.encode(), dtype=h5py.string_dtype("utf-8", size))
        content = whole.read_bytes()
    write_file(path, content, MAKE_ROOM)


def _mesh(grid: Grid, frame: Frame | None) -> dict[str, Any]:
    """Topology, nodes and faces; faces in the order of cells, the last axis fastest, their nodes anticlockwise."""
    nx, ny = grid.x.size, grid.y.size
    first = (np.arange(nx)[:, None] * (ny + 1) + np.arange(ny)[None, :]).ravel()
    corners = np.column_stack([first, first + ny + 1, first + ny + 2, first + 1])
    node_x, node_y = _placed(edges(grid.x, grid.dx), edges(grid.y, grid.dy), grid, frame)
    face_x, face_y = _placed(grid.x, grid.y, grid, frame)
    topology = {
        "cf_role": "mesh_topology", "topology_dimension": np.int32(2), "node_coordinates": "node_x node_y",
        "face_node_connectivity": "face_nodes", "face_coordinates": "face_x face_y",
    }  # fmt: skip
    nodes = {"cf_role": "face_node_connectivity", "start_index": np.int32(0)}
    return {
        "time": (
            "time",
            np.zeros(1),
            {"standard_name": "time", "units": "hours since 2000-01-01 00:00:00", "long_name": phrase("any_time")},
        ),
        "mesh": ((), np.int32(0), topology),
        "map": ((), np.int32(0), _system(frame)),
        "node_x": ("node", node_x, _axis("x") | _mapped(frame)),
        "node_y": ("node", node_y, _axis("y") | _mapped(frame)),
        "face_x": ("face", face_x, _axis("x") | _mapped(frame)),
        "face_y": ("face", face_y, _axis("y") | _mapped(frame)),
        "face_nodes": (("face", "corner"), corners.astype(np.int32), nodes),
    }


def _placed(x: Array, y: Array, grid: Grid, frame: Frame | None) -> tuple[Array, Array]:
    at_x, at_y = (part.ravel() for part in np.meshgrid(x, y, indexing="ij"))
    return on_the_map(at_x, at_y, grid, frame)


def _axis(name: str) -> dict[str, str]:
    return {"standard_name": f"projection_{name}_coordinate", "units": "m"}


def _mapped(frame: Frame | None) -> dict[str, str]:
    return {} if frame is None else {"grid_mapping": "map"}


def _system(frame: Frame | None) -> dict[str, Any]:
    """The coordinate system by its code and, with pyproj, as CF has it (grid_mapping_name, crs_wkt); and the frame."""
    if frame is None:
        return {"long_name": phrase("coordinates_of", "model")}
    code = epsg_code(frame)
    of_code: dict[str, Any] = {"epsg": np.int32(code), "epsg_code": f"EPSG:{code}"} if code else {}
    with suppress(ImportError):
        from pyproj import CRS
        from pyproj.exceptions import CRSError

        with suppress(CRSError), warnings.catch_warnings():  # a code that it does not know
            warnings.simplefilter("ignore")  # of what CF has no word for; crs_wkt has it
            of_code = (CRS.from_epsg(code).to_cf() if code else {}) | of_code
    origin = np.array(frame.origin)
    return {
        "long_name": frame.crs or phrase("coordinates_of", "map"),
        **of_code,
        "origin": origin,
        "angle": frame.angle,
    }


def write_field_table(path: Path, flow: FlowFields, grid: Grid, frame: Frame | None) -> None:
    """Write a CSV with one row a cell: x, y, east, north of its centre [m], then the quantities; nothing where dry.

    Parameters
    ----------
    frame : Frame, optional
        Turns x and y onto the map.
    """
    x, y = (part.ravel() for part in np.meshgrid(flow.x, flow.y, indexing="ij"))
    found = quantities(flow, grid, frame)
    heading = [f"{name} [{QUANTITIES_OF_FLOW[name]}]" for name in found]
    columns = [*_places(x, y, grid, frame), *(values.ravel() for values in found.values())]
    _write(path, [*_place_headings(grid, frame), *heading], columns)


def write_station_table(
    path: Path, station: Mapping[str, Array], predicted: Array | None, grid: Grid, frame: Frame | None
) -> None:
    """Write a CSV with one row a station, as the case reads them, with places on the map.

    Parameters
    ----------
    station : mapping of str to (station,)
        Columns of `Observations.table`.
    predicted : (station,), optional
        What the model gives there [unit of the kind].
    frame : Frame, optional
        Turns x and y onto the map.
    """
    x, y = station["x"].astype(float), station["y"].astype(float)
    names = ("experiment", "kind", "section", "value", "standard_error", "used", "reason")
    reasons = np.array([phrase("why_unused", one) for one in station["reason"]], dtype=object)
    columns = [*_places(x, y, grid, frame), *(station[name] for name in names[:-1]), reasons]
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
    def shown(value: object) -> str:
        """Numbers in full, so that they are the same when read again; nothing for what is unknown."""
        if isinstance(value, float | np.floating):
            return "" if np.isnan(value) else repr(float(value))
        return str(value)

    write_text(path, csv_text(heading, (map(shown, row) for row in zip(*columns, strict=True))), MAKE_ROOM)
