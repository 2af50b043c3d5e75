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

from vegglue.arrays import Array, Mask
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

# Standard names of a bed that counts downward from the zero of levels.
BED_BELOW_ZERO = ("sea_floor_depth_below_geoid", "sea_floor_depth_below_mean_sea_level", "sea_floor_depth")
SINCE, EXTREME = re.compile(r"\bsince\b"), re.compile(r"time: *(max|min|range|std|standard_dev)")
# Of each quantity: names of D-Flow FM without the mesh, and standard names.
UGRID_NAMES = {
    "bed": (("flowelem_bl", "bl"), ("altitude", "sea_floor_altitude", "bed_level", *BED_BELOW_ZERO)),
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
        clock = next((one for one in variables.values() if SINCE.search(one.text("units"))), variables.get("time"))
        faces, times = corners.shape[0], max(clock.shape[0], 1) if clock is not None and clock.shape else 0
        fields = {key: _field(path, variables, mesh, key, (faces, len(nodes)), times) for key in UGRID_NAMES}
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
        level_of = bed_level_depth(given)
        depth = np.where(_dry(variables, mesh, len(places), times), 0.0, level_of[2])
        of_cells = (*places.T, *level_of[:2], depth, given["u"], given["v"])
        return model_result(
            "D-Flow FM" if of_flow_fm else "UGRID", *(one[keep] for one in of_cells), roughness=roughness,
            roughness_kind=kind, corners=nodes, crs=_system(variables), time=last_time(clock), notes=notes,
        )  # fmt: skip


def _field(
    path: Path, variables: dict[str, NetcdfVariable], mesh: str, key: str, sizes: tuple[int, int], times: int
) -> Array | None:
    """A quantity at faces or nodes, by its name, else by its standard name; None if there is none without layers.

    A depth of the bed, or a bed that counts downward, is one below zero. InputError for an unknown unit, and for two
    variables of one standard name. Extremes over time are none.
    """
    names, standard = UGRID_NAMES[key]

    def of_size(one: NetcdfVariable) -> int:
        """Whether it lies at the faces (2), at the nodes (1) or elsewhere (0), with the times in front or without."""
        rest = one.shape[1:] if one.of_time(times) else one.shape
        return 2 - sizes.index(rest[0]) if len(rest) == 1 and rest[0] in sizes else 0

    of_mesh = {
        name: one
        for name, one in variables.items()
        if one.text("mesh") in (mesh, "") and of_size(one) and not EXTREME.search(one.text("cell_methods"))
    }
    found = [name for one in names if (name := f"{mesh}_{one}") in of_mesh][:1]
    if not found:
        alike = [name for name, one in of_mesh.items() if one.text("standard_name") in standard]
        found = [name for name in alike if of_size(of_mesh[name]) == max(map(of_size, map(of_mesh.__getitem__, alike)))]
    if len(found) > 1:
        raise InputError(
            f"{shown_path(path)}: expected one variable of {key}, got {', '.join(found)}, all of standard name "
            f"{of_mesh[found[0]].text('standard_name')}; leave one in the file."
        )
    if not found:
        return None
    one = of_mesh[found[0]]
    if not one.in_si:
        raise InputError(
            f"{shown_path(path)}: expected {found[0]} in a unit of {'velocity' if key in 'uv' else 'length'}, got "
            f"{one.text('units')!r}; write it in SI."
        )
    down = key == "bed" and (one.text("positive") == "down" or one.text("standard_name") in BED_BELOW_ZERO)
    return -one.values(times) if down else one.values(times)


def _dry(variables: dict[str, NetcdfVariable], mesh: str, size: int, times: int) -> Mask:
    """Places (size,) that a flag marks as dry: a variable whose `flag_meanings` has that word."""
    for one in variables.values():
        meanings = one.text("flag_meanings").lower().split()
        if "dry" in meanings and one.text("mesh") in (mesh, "") and one.shape[-1:] == (size,):
            given = one.attributes.get("flag_values", range(len(meanings)))
            texts = re.findall(r"-?\d+", given if isinstance(given, str) else " ".join(map(str, np.ravel(given))))
            return np.asarray(one.numbers(times) == int(texts[meanings.index("dry")]))
    return np.zeros(size, dtype=bool)


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
