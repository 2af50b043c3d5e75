"""Fields as a netCDF file after CF 1.8 and UGRID 1.0: a mesh of quadrangles that xarray and map programs open."""

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.case.centreline import heading_at, on_map
from vegglue.case.frame import Frame
from vegglue.case.grid import Grid
from vegglue.case.text_files import names_in_files
from vegglue.flow.sensor import FlowFields
from vegglue.results.geotiff import epsg_code
from vegglue.results.labelled_arrays import ENGINE, extra_library
from vegglue.whole_files import MAKE_ROOM, failed_writes_told, write_file

# Quantities of a flow at cell centres: what they are called in words, and their unit.
QUANTITIES_OF_FLOW = {
    "bed": ("level of the bed", "m"),
    "level": ("level of the water", "m"),
    "depth": ("depth of the water", "m"),
    "u": ("velocity along the channel", "m/s"),
    "v": ("velocity across the channel", "m/s"),
    "east_velocity": ("velocity to the east of the map", "m/s"),
    "north_velocity": ("velocity to the north of the map", "m/s"),
}


def quantities(flow: FlowFields, grid: Grid, frame: Frame | None) -> dict[str, Array]:
    """The fields of one experiment by name (nx, ny); with a frame the components on the map too."""
    found = {name: getattr(flow, name) for name in ("bed", "level", "depth", "u", "v")}
    if frame is not None or grid.centreline is not None:
        found["east_velocity"], found["north_velocity"] = _components_on_map(flow, grid, frame)
    return found


def _components_on_map(flow: FlowFields, grid: Grid, frame: Frame | None) -> tuple[Array, Array]:
    """u and v along and across a centreline turned by its direction theta, then by the frame of the model."""
    u, v = flow.u, flow.v
    if grid.centreline is not None:
        theta = heading_at(grid.centreline, grid.x)[:, None]
        u, v = u * np.cos(theta) - v * np.sin(theta), u * np.sin(theta) + v * np.cos(theta)
    return frame.turned_to_map(u, v) if frame is not None else (u, v)


def on_the_map(x: Array, y: Array, grid: Grid, frame: Frame | None) -> tuple[Array, Array]:
    """Places x along and y across the grid (n,) [m] on the map [m]; as they are without a centreline and a frame."""
    if grid.centreline is not None:
        x, y = on_map(grid.centreline, x, y)
    return frame.to_map(x, y) if frame is not None else (x, y)


def write_mesh(
    path: Path, flows: Mapping[str, FlowFields], grid: Grid, frame: Frame | None, attributes: Mapping[str, str]
) -> None:
    """Write the fields of all experiments, one variable for each quantity and experiment, u_June; NaN where dry.

    Errors: InputError without xarray; StorageError.
    """
    xarray = extra_library("xarray", "field", "vegglue export")
    extra_library(ENGINE, "field", "vegglue export")
    variables, called = _mesh(grid, frame), names_in_files(flows)
    for experiment, flow in flows.items():
        for name, values in quantities(flow, grid, frame).items():
            words, unit = QUANTITIES_OF_FLOW[name]
            at_faces = {"mesh": "mesh", "location": "face", "coordinates": "face_x face_y", "grid_mapping": "map"}
            told = {"long_name": f"{words}, {experiment}", "units": unit, **at_faces}
            variables[f"{name}_{called[experiment]}"] = ("face", values.ravel(), told)
    dataset = xarray.Dataset(variables, attrs={"Conventions": "CF-1.8 UGRID-1.0", **attributes})
    with failed_writes_told(path, MAKE_ROOM), TemporaryDirectory() as folder:  # the library writes to a name only
        whole = Path(folder) / path.name
        dataset.to_netcdf(whole, engine=ENGINE)
        content = whole.read_bytes()
    write_file(path, content, MAKE_ROOM)


def _mesh(grid: Grid, frame: Frame | None) -> dict[str, Any]:
    """Topology, nodes and faces; faces in the order of cells, the last axis fastest, their nodes anticlockwise."""
    nx, ny = grid.x.size, grid.y.size
    edges_x = np.append(grid.x - 0.5 * grid.dx, grid.x[-1] + 0.5 * grid.dx)
    edges_y = np.append(grid.y - 0.5 * grid.dy, grid.y[-1] + 0.5 * grid.dy)
    first = (np.arange(nx)[:, None] * (ny + 1) + np.arange(ny)[None, :]).ravel()
    corners = np.column_stack([first, first + ny + 1, first + ny + 2, first + 1])
    node_x, node_y = _placed(edges_x, edges_y, grid, frame)
    face_x, face_y = _placed(grid.x, grid.y, grid, frame)
    topology = {
        "cf_role": "mesh_topology", "topology_dimension": np.int32(2), "node_coordinates": "node_x node_y",
        "face_node_connectivity": "face_nodes", "face_coordinates": "face_x face_y",
    }  # fmt: skip
    nodes = {"cf_role": "face_node_connectivity", "start_index": np.int32(0)}
    return {
        "mesh": ((), np.int32(0), topology),
        "map": ((), np.int32(0), _system(frame)),
        "node_x": ("node", node_x, _axis("x")),
        "node_y": ("node", node_y, _axis("y")),
        "face_x": ("face", face_x, _axis("x")),
        "face_y": ("face", face_y, _axis("y")),
        "face_nodes": (("face", "corner"), corners.astype(np.int32), nodes),
    }


def _placed(x: Array, y: Array, grid: Grid, frame: Frame | None) -> tuple[Array, Array]:
    at_x, at_y = (part.ravel() for part in np.meshgrid(x, y, indexing="ij"))
    return on_the_map(at_x, at_y, grid, frame)


def _axis(name: str) -> dict[str, str]:
    return {"standard_name": f"projection_{name}_coordinate", "units": "m"}


def _system(frame: Frame | None) -> dict[str, Any]:
    """The coordinate system by its code, where the frame names one; and the frame itself."""
    if frame is None:
        return {"long_name": "coordinates of the model"}
    code = epsg_code(frame)
    of_code = {"epsg": np.int32(code), "epsg_code": f"EPSG:{code}"} if code else {}
    origin = np.array(frame.origin)
    return {"long_name": frame.crs or "coordinates of the map", **of_code, "origin": origin, "angle": frame.angle}
