"""Results on a UGRID mesh: the map file of D-Flow FM, and any netCDF file whose fields are named by standard names.

Format: UGRID 1.0, a variable with cf_role mesh_topology that names node coordinates and the nodes of each face. Fields
lie at faces, or at nodes. Of D-Flow FM: flowelem_bl (bed, upward), s1, waterdepth, ucx, ucy (ucxa, ucya in 3D), czs
(Chezy) and flowelem_domain, which marks the ghost cells of a partition.
"""

import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.import_notes import ImportNote, Noted
from vegglue.importers.model_result import (
    ModelResult,
    NetcdfVariable,
    RoughnessKind,
    bed_level_depth,
    lacking_fields,
    last_time,
    model_result,
    netcdf_variables,
    refuse_degrees,
)

# Of each quantity: names of D-Flow FM without the mesh, and standard names.
UGRID_NAMES = {
    "bed": (("flowelem_bl", "bl"), ("altitude", "sea_floor_altitude", "bed_level")),
    "level": (("s1",), ("sea_surface_height", "sea_surface_elevation", "water_surface_height_above_reference_datum")),
    "depth": (("waterdepth",), ("sea_floor_depth_below_sea_surface", "water_depth", "depth")),
    "u": (("ucxa", "ucx"), ("sea_water_x_velocity", "eastward_sea_water_velocity", "x_velocity")),
    "v": (("ucya", "ucy"), ("sea_water_y_velocity", "northward_sea_water_velocity", "y_velocity")),
}


def read_ugrid(path: Path) -> ModelResult:
    """The final state of a 2D mesh, at its faces, or at its nodes if velocities lie there.

    Parameters
    ----------
    path
        A netCDF file, classic or of version 4.

    Returns
    -------
    ModelResult
        Without the ghost cells of a partition.

    Raises
    ------
    InputError
        If it holds no 2D mesh, velocities in layers, or lacks bed, level or velocities.
    """
    with netcdf_variables(path) as variables:
        meshes = [
            (name, one)
            for name, one in variables.items()
            if one.text("cf_role") == "mesh_topology" and one.text("topology_dimension") in ("2", "")
        ]
        if not meshes:
            raise InputError(f"{shown_path(path)}: expected a UGRID file with a 2D mesh, got none; export one.")
        mesh, topology = meshes[0]
        named = {key: topology.text(key).split() for key in ("node_coordinates", "face_node_connectivity")}
        absent = [
            *(key for key, names in named.items() if not names),
            *(name for names in named.values() for name in names if name not in variables),
        ]
        if absent:
            raise InputError("not_on_mesh", file=path, missing=absent, layers=False)
        node_x, node_y = (variables[name] for name in named["node_coordinates"][:2])
        refuse_degrees(path, node_x)
        nodes = np.column_stack([node_x.values(), node_y.values()])
        connectivity = variables[named["face_node_connectivity"][0]]
        raw, fill = connectivity.numbers(), connectivity.attributes.get("_FillValue")
        start = int(np.ravel(connectivity.attributes.get("start_index", 0))[0])
        none = ~np.isfinite(raw.astype(np.float64)) | (raw < start)
        if fill is not None:
            none |= raw == np.ravel(fill)[0]
        # Nodes of each face (faces, most), counted from 0, and -1 where a face has fewer.
        corners = np.where(none, -1, np.where(none, 0, raw).astype(np.int64) - start)
        faces, times = corners.shape[0], max(variables["time"].shape[0], 1) if "time" in variables else 0
        fields = {key: _field(variables, mesh, key, (faces, len(nodes)), times) for key in UGRID_NAMES}
        given = {key: one for key, one in fields.items() if one is not None}
        if missing := lacking_fields(given):
            layers = any(len(one.shape) == 3 and faces in one.shape[:-1] for one in variables.values())
            raise InputError("not_on_mesh", file=path, missing=missing, layers=layers)
        at_faces = given["u"].size == faces
        centre = _mean_of_corners(nodes, corners)
        of_faces = topology.text("face_coordinates").split()[:2]
        if of_faces and at_faces and set(of_faces) <= variables.keys():
            centre = np.column_stack([variables[name].values() for name in of_faces])
        places = centre if at_faces else nodes
        for key, one in given.items():
            if one.size != places.shape[0] and at_faces:  # a bed at nodes
                given[key] = _mean_of_corners(one[:, None], corners)[:, 0]
        of_flow_fm = f"{mesh}_flowelem_bl" in variables or f"{mesh}_ucx" in variables
        keep = np.ones(len(places), bool)
        notes: tuple[ImportNote, ...] = ()
        domain = variables.get(f"{mesh}_flowelem_domain")
        if domain is not None and at_faces:
            numbers = np.ravel(domain.numbers()).astype(np.int64)
            in_name = re.search(r"_(\d{4})_map", path.name)
            own = int(in_name[1]) if in_name else Counter(numbers.tolist()).most_common(1)[0][0]
            keep = numbers == own
            if not keep.all():
                notes = (ImportNote(Noted.GHOSTS, int((~keep).sum())),)
        roughness: Array | None = None
        kind: RoughnessKind = "not-stated"
        chezy = variables.get(f"{mesh}_czs")
        if chezy is not None and at_faces and chezy.shape[-1] == faces:
            roughness, kind = chezy.values(times)[keep], "chezy"
        of_cells = (*places.T, *bed_level_depth(given), given["u"], given["v"])
        return model_result(
            "D-Flow FM" if of_flow_fm else "UGRID", *(one[keep] for one in of_cells), roughness=roughness,
            roughness_kind=kind, corners=nodes, crs=_system(variables), time=last_time(variables), notes=notes,
        )  # fmt: skip


def _field(
    variables: dict[str, NetcdfVariable], mesh: str, key: str, sizes: tuple[int, int], times: int
) -> Array | None:
    """A quantity at faces or nodes, by its name, else by its standard name; None if there is none without layers."""
    names, standard = UGRID_NAMES[key]
    of_mesh = {name: one for name, one in variables.items() if one.text("mesh") in (mesh, "")}
    by_name = [of_mesh[f"{mesh}_{name}"] for name in names if f"{mesh}_{name}" in of_mesh]
    by_standard = [one for one in of_mesh.values() if one.text("standard_name") in standard]
    by_standard.sort(key=lambda one: one.text("location") != "face")
    for one in [*by_name, *by_standard]:
        of_time = times and one.shape[:1] == (times,) and len(one.shape) == 2
        rest = one.shape[1:] if of_time else one.shape
        if len(rest) == 1 and rest[0] in sizes:
            return one.values(times if of_time else 0)
    return None


def _mean_of_corners(values: Array, corners: np.ndarray[Any, Any]) -> Array:
    """Means (faces, k) of values at nodes (nodes, k)."""
    there = corners >= 0
    return (values[np.where(there, corners, 0)] * there[..., None]).sum(axis=1) / there.sum(axis=1)[:, None]


def _system(variables: dict[str, NetcdfVariable]) -> str:
    """EPSG:... of the variable that states a projection; '' for none."""
    for one in variables.values():
        if number := int(np.ravel(one.attributes.get("epsg", 0))[0]):
            return f"EPSG:{number}"
        if found := re.search(r"EPSG:(\d+)", one.text("EPSG_code") + one.text("crs_wkt")):
            return f"EPSG:{found[1]}" if int(found[1]) else ""
    return ""
