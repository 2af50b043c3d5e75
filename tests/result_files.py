"""Results of HEC-RAS 2D, TELEMAC, D-Flow FM and Delft3D-4, written to their formats from a gridded flow."""

import struct
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from scipy.io import netcdf_file


@dataclass(frozen=True)
class GridFlow:
    """A flow on a grid: edges along x and y [m], fields at centres (nx, ny); the grid lies turned on the map."""

    x: np.ndarray
    y: np.ndarray
    bed: np.ndarray
    depth: np.ndarray
    u: np.ndarray
    v: np.ndarray
    n: np.ndarray
    origin: tuple[float, float] = (0.0, 0.0)
    angle: float = 0.0

    def on_map(self, x, y):
        c, s = np.cos(np.radians(self.angle)), np.sin(np.radians(self.angle))
        return self.origin[0] + c * x - s * y, self.origin[1] + s * x + c * y

    @property
    def velocity(self):
        """To the east and to the north at centres."""
        c, s = np.cos(np.radians(self.angle)), np.sin(np.radians(self.angle))
        return c * self.u - s * self.v, s * self.u + c * self.v

    @property
    def centres(self):
        mid = np.meshgrid(0.5 * (self.x[1:] + self.x[:-1]), 0.5 * (self.y[1:] + self.y[:-1]), indexing="ij")
        return self.on_map(*mid)

    @property
    def nodes(self):
        return self.on_map(*np.meshgrid(self.x, self.y, indexing="ij"))

    @property
    def nodes_of_selafin(self):
        """Centres of cells, and the edges of the grid."""
        each = (np.concatenate([one[:1], 0.5 * (one[1:] + one[:-1]), one[-1:]]) for one in (self.x, self.y))
        return self.on_map(*np.meshgrid(*each, indexing="ij"))


def a_flow(angle: float = 30.0) -> GridFlow:
    """A flow that is linear in x and y, so that means at faces and corners are exact; one bank is dry."""
    x, y = np.linspace(0.0, 60.0, 13), np.linspace(-6.0, 6.0, 7)
    cx, cy = np.meshgrid(0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1]), indexing="ij")
    depth = np.where(cy > 4.0, 0.0, 1.0 + 0.002 * cx)
    wet = depth > 0.0
    u, v = np.where(wet, 0.6 + 0.01 * cy, 0.0), np.where(wet, 0.05 + 0.001 * cx, 0.0)
    bed = 10.0 - 0.001 * cx + np.where(cy > 4.0, 2.0, 0.0)
    return GridFlow(x, y, bed, depth, u, v, np.full(bed.shape, 0.03), (683000.0, 247000.0), angle)


def at_nodes(field):
    """A field at centres (nx, ny) at these and along the edges of the grid (nx + 2, ny + 2), as at the nearest one."""
    return np.pad(field, 1, mode="edge")


def write_hec_ras(path: Path, flow: GridFlow, feet: bool = False, version: str = "6.1") -> None:
    """A plan with the cells of the grid, ghost cells last; faces carry the normal component of the mean velocity."""
    unit = 0.3048 if feet else 1.0
    nx, ny = flow.bed.shape
    number = np.arange(nx * ny).reshape(nx, ny)
    east, north = flow.velocity
    corner = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    node_x, node_y = (part.ravel() for part in flow.nodes)
    faces, points, ghosts = [], [], 0
    for axis in (0, 1):
        for i in range(nx + (axis == 0)):
            for j in range(ny + (axis == 1)):
                low, high = ((i - 1, j), (i, j)) if axis == 0 else ((i, j - 1), (i, j))
                sides = []
                for cell in (low, high):
                    if 0 <= cell[0] < nx and 0 <= cell[1] < ny:
                        sides.append(number[cell])
                    else:
                        sides.append(nx * ny + ghosts)
                        ghosts += 1
                faces.append(sides)
                points.append((corner[i, j], corner[i, j + 1] if axis == 0 else corner[i + 1, j]))
    cells, points = np.array(faces), np.array(points)
    along = np.column_stack([node_x[points[:, 1]] - node_x[points[:, 0]], node_y[points[:, 1]] - node_y[points[:, 0]]])
    length = np.hypot(*along.T)
    normal = np.column_stack([along[:, 1], -along[:, 0]]) / length[:, None]
    centre = np.column_stack([part.ravel() for part in flow.centres])
    middle = 0.5 * np.column_stack([node_x[points].sum(axis=1), node_y[points].sum(axis=1)])
    inside = cells < nx * ny
    first = np.where(inside[:, 0], cells[:, 0], cells[:, 1])
    outward = np.einsum("fk,fk->f", normal, middle - centre[first]) * np.where(inside[:, 0], 1.0, -1.0)
    normal *= np.where(outward < 0.0, -1.0, 1.0)[:, None]
    bed, depth = flow.bed.ravel(), flow.depth.ravel()
    velocity = np.column_stack([east.ravel(), north.ravel()])
    tables, info, at_face, total = [], [], np.zeros(len(cells)), 0
    for face, (sides, ok) in enumerate(zip(cells, inside, strict=True)):
        real = sides[ok]
        low = bed[real].max()
        if (depth[real] > 0.0).all():
            at_face[face] = normal[face] @ velocity[real].mean(axis=0)
        rows = [(low, 0.0, 0.0, flow.n.ravel()[real[0]]), (low + 1.0, length[face], 0.0, flow.n.ravel()[real[0]])]
        tables += rows
        info.append((total, len(rows)))
        total += len(rows)
    ghost_bed = np.full(ghosts, np.nan)
    with h5py.File(path, "w") as file:
        file.attrs["File Version"] = f"HEC-RAS {version}"
        file.attrs["Units System"] = np.bytes_("US Customary" if feet else "SI Units")
        area = file.create_group("Geometry/2D Flow Areas/reach")
        area["Cells Center Coordinate"] = np.vstack([centre, np.zeros((ghosts, 2))]) / unit
        area["Cells Minimum Elevation"] = np.append(bed, ghost_bed).astype("f4") / unit
        if version.startswith("6"):
            area["Cells Center Manning's n"] = np.append(flow.n.ravel(), ghost_bed).astype("f4")
        area["Faces Cell Indexes"] = cells.astype("i4")
        area["Faces NormalUnitVector and Length"] = np.column_stack([normal, length / unit]).astype("f4")
        table = np.array(tables) / [unit, unit**2, unit, 1.0]
        table[1::2, 0] = table[::2, 0] + 1.0 / unit
        area["Faces Area Elevation Info"] = np.array(info, "i4")
        area["Faces Area Elevation Values"] = table.astype("f4")
        area["FacePoints Coordinate"] = np.column_stack([node_x, node_y]) / unit
        base = "Results/Unsteady/Output/Output Blocks/Base Output/Unsteady Time Series"
        series = file.create_group(f"{base}/2D Flow Areas/reach")
        level = np.append(bed + depth, np.zeros(ghosts)) / unit  # of a dry cell: its bed
        series["Water Surface"] = np.vstack([level - 0.1, level]).astype("f4")
        series["Face Velocity"] = np.vstack([0.0 * at_face, at_face / unit]).astype("f4")
        names = ("Units", "Units") if version.startswith("6") else ("WSEL", "Velocity")
        words = ("ft", "ft/s") if feet else ("m", "m/s")
        for key, name, word in zip(("Water Surface", "Face Velocity"), names, words, strict=True):
            series[key].attrs[name] = np.bytes_(
                {"ft": "Feet", "m": "Meters"}.get(word, word) if name == "WSEL" else word
            )
        file[f"{base}/Time Date Stamp"] = np.array([b"01JAN2020 00:00:00", b"01JAN2020 12:00:00"])


def write_selafin(
    path: Path, flow: GridFlow, *, double: bool = False, order: str = ">", french: bool = False, cut: bool = False,
    offset: tuple[int, int] = (0, 0), friction: bool = True,
) -> None:  # fmt: skip
    """A result at centres and edges of the grid, two triangles between four; the first of two frames is at rest."""
    real = np.dtype(f"{order}f{8 if double else 4}")
    nx, ny = (size + 1 for size in flow.bed.shape)
    corner = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    a, b, c, d = corner[:-1, :-1].ravel(), corner[1:, :-1].ravel(), corner[1:, 1:].ravel(), corner[:-1, 1:].ravel()
    triangles = np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])]) + 1
    x, y = (part.ravel() for part in flow.nodes_of_selafin)
    east, north = flow.velocity
    bed, depth = at_nodes(flow.bed).ravel(), at_nodes(flow.depth).ravel()
    depth = np.where(depth > 0.0, depth, -0.01)  # as TELEMAC leaves it on dry land
    names = ["VITESSE U", "VITESSE V", "HAUTEUR D'EAU", "SURFACE LIBRE", "FOND", "FROTTEMENT"] if french else [
        "VELOCITY U", "VELOCITY V", "WATER DEPTH", "FREE SURFACE", "BOTTOM", "BOTTOM FRICTION",
    ]  # fmt: skip
    fields = [at_nodes(east).ravel(), at_nodes(north).ravel(), depth, bed + depth, bed, at_nodes(flow.n).ravel()]
    if not friction:
        names, fields = names[:-1], fields[:-1]

    def record(content: bytes) -> bytes:
        length = struct.pack(f"{order}i", len(content))
        return length + content + length

    def integers(*values: int) -> bytes:
        return record(np.array(values, f"{order}i4").tobytes())

    text = record(f"{'a reach':<72}{'SERAFIND' if double else 'SERAFIN '}".encode())
    text += integers(len(names), 0) + b"".join(record(f"{name:<16}{'M':<16}".encode()) for name in names)
    text += integers(1, 0, *offset, 0, 0, 0, 0, 0, 1) + integers(2020, 1, 2, 3, 4, 5)
    text += integers(len(triangles), x.size, 3, 1) + integers(*triangles.ravel()) + integers(*np.zeros(x.size, int))
    text += record((x - offset[0]).astype(real).tobytes()) + record((y - offset[1]).astype(real).tobytes())
    for frame, factor in enumerate((0.0, 1.0, 0.5) if cut else (0.0, 1.0)):
        text += record(np.array([60.0 * frame], real).tobytes())
        still = [factor * field if number < 2 else field for number, field in enumerate(fields)]
        text += b"".join(record(field.astype(real).tobytes()) for field in still)
    path.write_bytes(text[:-30] if cut else text)


def write_flow_fm(path: Path, flow: GridFlow, classic: bool = True, ghosts: int = 0) -> None:
    """A map file of D-Flow FM with the cells of the grid as faces; the first `ghosts` belong to another partition."""
    nx, ny = flow.bed.shape
    corner = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    faces = np.column_stack(
        [part.ravel() for part in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:])]
    )
    nodes, (face_x, face_y), (east, north) = flow.nodes, flow.centres, flow.velocity
    wet = flow.depth > 0.0
    chezy = np.where(wet, np.maximum(flow.depth, 1e-6) ** (1.0 / 6.0) / flow.n, -999.0)
    timed = {"mesh2d_s1": flow.bed + flow.depth, "mesh2d_waterdepth": flow.depth, "mesh2d_czs": chezy}
    timed |= {"mesh2d_ucx": east, "mesh2d_ucy": north}
    at = {"mesh": b"mesh2d", "location": b"face", "_FillValue": -999.0}
    topology = {
        "cf_role": b"mesh_topology",
        "topology_dimension": 2,
        "node_coordinates": b"mesh2d_node_x mesh2d_node_y",
    }
    topology |= {"face_node_connectivity": b"mesh2d_face_nodes", "face_coordinates": b"mesh2d_face_x mesh2d_face_y"}
    domain = np.where(np.arange(nx * ny) < ghosts, 1, 0)
    entries = {
        "mesh2d": ((), np.array(0, "i4"), topology),
        "projected_coordinate_system": ((), np.array(0, "i4"), {"epsg": 28992}),
        "mesh2d_node_x": (("node",), nodes[0].ravel(), {"units": b"m"}),
        "mesh2d_node_y": (("node",), nodes[1].ravel(), {"units": b"m"}),
        "mesh2d_face_x": (("face",), face_x.ravel(), at), "mesh2d_face_y": (("face",), face_y.ravel(), at),
        "mesh2d_face_nodes": (("face", "four"), faces.astype("i4") + 1, {"start_index": 1, "_FillValue": -999}),
        "mesh2d_flowelem_bl": (("face",), flow.bed.ravel(), at),
        "mesh2d_flowelem_domain": (("face",), domain.astype("i4"), {"mesh": b"mesh2d", "location": b"face"}),
        "time": (("time",), np.array([0.0, 60.0]), {"units": b"seconds since 2020-01-01"}),
    }  # fmt: skip
    entries |= {name: (("time", "face"), np.vstack([0.0 * f.ravel(), f.ravel()]), at) for name, f in timed.items()}
    sizes = {"node": nodes[0].size, "face": nx * ny, "four": 4, "time": 2}
    _write_netcdf(path, entries, sizes, classic)


def write_velocimetry(path: Path, along: np.ndarray, across: np.ndarray, turned: float, classic: bool = False) -> None:
    """What pyorc writes: velocities (time, y, x) on a grid of 0.2 m whose x runs `turned` [rad] from the east."""
    times, ny, nx = along.shape
    x, y = 0.2 * np.arange(nx), 0.2 * np.arange(ny)[::-1]  # rows of an image run down
    east = 1000.0 + np.cos(turned) * x - np.sin(turned) * y[:, None]
    north = 2000.0 + np.sin(turned) * x + np.cos(turned) * y[:, None]
    entries = {name: (("time", "y", "x"), part, {}) for name, part in (("v_x", along), ("v_y", across))}
    entries |= {"xs": (("y", "x"), east, {"units": b"m"}), "ys": (("y", "x"), north, {"units": b"m"})}
    entries |= {"x": (("x",), x, {}), "y": (("y",), y, {})}
    _write_netcdf(path, entries, {"time": times, "y": ny, "x": nx}, classic)


def write_trim(path: Path, flow: GridFlow, clockwise: bool = False, layers: bool = False) -> None:
    """A trim file of Delft3D-4: the grid with a row of dummies on all sides, velocities along grid lines at faces.

    layers: two of unequal thickness, the upper one 1.3 times as fast as the mean.
    """
    nx, ny = flow.bed.shape
    shape = (nx + 2, ny + 2)

    def framed(field, fill):
        whole = np.full(shape, fill)
        whole[1:-1, 1:-1] = field
        return whole

    x, y = flow.centres
    wet = flow.depth > 0.0
    u1, v1 = np.zeros(shape), np.zeros(shape)
    u1[1:-1, 1:-1] = 0.5 * (flow.u + np.vstack([flow.u[1:], flow.u[-1:]]))
    u1[0, 1:-1] = 2.0 * flow.u[0] - u1[1, 1:-1]
    v1[1:-1, 1:-1] = 0.5 * (flow.v + np.hstack([flow.v[:, 1:], 0.0 * flow.v[:, -1:]]))
    east = framed(wet, False)
    speeds = np.array([1.3, 0.8] if layers else [1.0])[:, None, None]  # the mean of 0.4 and 0.6 of the depth is 1
    thick = {"SIG_INTF": (("interface",), np.array([0.0, -0.4, -1.0]), {})} if layers else {}
    dims = ("M", "N")
    corner_x, corner_y = np.zeros(shape), np.zeros(shape)
    corner_x[:-1, :-1], corner_y[:-1, :-1] = flow.nodes
    entries = {
        "XZ": (dims, framed(x, 0.0), {"units": b"m"}), "YZ": (dims, framed(y, 0.0), {"units": b"m"}),
        "XCOR": (dims, corner_x, {}), "YCOR": (dims, corner_y, {}),
        "ALFAS": (dims, framed(-flow.angle if clockwise else flow.angle, 0.0), {}),
        "KCS": (dims, framed(1, 0).astype("i4"), {}), "DPS0": (dims, framed(-flow.bed, -999.0), {}),
        "S1": (("time", *dims), np.stack([framed(0.0, 0.0), framed(flow.bed + flow.depth, 0.0)]), {}),
        "U1": (("time", "layer", *dims), np.stack([0.0 * u1 * speeds, u1 * speeds]), {}),
        "V1": (("time", "layer", *dims), np.stack([0.0 * v1 * speeds, v1 * speeds]), {}),
        "KFU": (("time", *dims), np.stack([east, east | np.roll(east, -1, 0)]).astype("i4"), {}),
        "KFV": (("time", *dims), np.stack([east, east]).astype("i4"), {}),
        "time": (("time",), np.array([0.0, 60.0]), {"units": b"minutes since 2020-01-01"}),
    } | thick  # fmt: skip
    sizes = {"M": shape[0], "N": shape[1], "layer": len(speeds), "interface": len(speeds) + 1, "time": 2}
    _write_netcdf(path, entries, sizes, True)


def _write_netcdf(path: Path, entries, sizes, classic: bool) -> None:
    if classic:
        with netcdf_file(path, "w") as file:
            for name, size in sizes.items():
                file.createDimension(name, size)
            for name, (dims, values, attributes) in entries.items():
                one = file.createVariable(name, values.dtype, dims)
                one[...] = values
                for key, value in attributes.items():
                    setattr(one, key, value)
        return
    with h5py.File(path, "w") as file:
        for name, (_, values, attributes) in entries.items():
            file[name] = values
            file[name].attrs.update(attributes)
