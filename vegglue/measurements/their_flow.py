"""The flow of a finished run of another model, at the places of its own mesh, and read between them."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import QhullError, cKDTree

from vegglue.arrays import Array, Mask
from vegglue.case.grid import Grid
from vegglue.errors import InputError, shown_path
from vegglue.measurements.csv_table import read_table

COLUMNS = ("x", "y", "bed", "depth", "u", "v")
# A place is beyond a mesh if it is further from its nearest point than so many usual distances between points.
BEYOND_MESH = 2.0


@dataclass(frozen=True, eq=False)
class TheirFlow:
    """The flow of a finished run at its own places, along and across the channel.

    Attributes
    ----------
    x, y, bed, depth
        (n,) [m]; the depth is 0 where it is dry.
    u, v
        (n,) [m/s].
    """

    x: Array
    y: Array
    bed: Array
    depth: Array
    u: Array
    v: Array

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(np.column_stack([self.x, self.y]))

    @cached_property
    def spacing(self) -> float:
        """Usual distance of a place to the fourth nearest one [m]: that to the next column or row of a mesh."""
        distance, _ = self._tree.query(np.column_stack([self.x, self.y]), k=min(5, self.x.size))
        return float(np.median(distance[:, -1]))

    def inside(self, x: Array, y: Array) -> Mask:
        """Whether places (m,) lie on the mesh."""
        return np.asarray(self._tree.query(np.column_stack([x, y]))[0] <= BEYOND_MESH * self.spacing)

    @cached_property
    def _between(self) -> Callable[[Array], Array]:
        """Level, depth, u and v (m, 4) at places (m, 2): linear between wet places, of the nearest one beyond them."""
        from scipy.interpolate import LinearNDInterpolator  # late: a case of its own flow need not wait for it

        wet = self.depth > 0.0
        places = np.column_stack([self.x, self.y])[wet]
        fields = np.column_stack([self.bed + self.depth, self.depth, self.u, self.v])[wet]
        tree = cKDTree(places)
        try:
            linear = LinearNDInterpolator(places, fields)
        except (QhullError, ValueError):  # fewer than three places, or all on a line
            return lambda to: fields[tree.query(to)[1]]

        def read(to: Array) -> Array:
            found = linear(to)
            return np.where(np.isfinite(found), found, fields[tree.query(to)[1]])

        return read

    def at(self, x: Array, y: Array) -> dict[str, Array]:
        """level [m], depth [m], u and v [m/s] at places (m,): linear between wet places, NaN where it is dry.

        A place is dry if the nearest place of the mesh is, or if it lies beyond the mesh.
        """
        to = np.column_stack([x, y])
        there = (self.depth > 0.0)[self._tree.query(to)[1]] & self.inside(x, y)
        found = np.full((len(to), 4), np.nan)
        if there.any():
            found[there] = self._between(to[there])
        return dict(zip(("level", "depth", "u", "v"), found.T, strict=True))

    def nearest(self, x: Array, y: Array, among: Mask) -> NDArray[np.int64]:
        """Of the places that are true in `among` (n,), the number of the nearest one to each of (m,)."""
        tree = cKDTree(np.column_stack([self.x, self.y])[among])
        return np.asarray(tree.query(np.column_stack([x, y]))[1], dtype=np.int64)

    def discharge(self, grid: Grid, x: Array) -> Array:
        """Q = dy sum_j h_j u_j through the row of cells at each x, and the same of v across (2, m) [m3/s]."""
        at_x, at_y = (part.ravel() for part in np.meshgrid(x, grid.y, indexing="ij"))
        here = self.at(at_x, at_y)
        each = np.stack([here["depth"] * here[name] for name in ("u", "v")]).reshape(2, len(x), grid.y.size)
        return np.asarray(np.nansum(each, axis=2) * grid.dy)


def read_their_flow(path: Path) -> TheirFlow:
    """The flow in a file of a case, with the columns COLUMNS.

    Raises
    ------
    InputError
        If it cannot be read, or holds dry places alone.
    """
    rows = read_table(path, (), COLUMNS)
    if not (rows["depth"] > 0.0).any():
        raise InputError(f"{shown_path(path)}: expected a flow, got {len(rows)} dry places; import it anew.")
    return TheirFlow(*(rows[name].to_numpy(float) for name in COLUMNS))


def text_of_flow(flow: TheirFlow) -> str:
    """The file of a case that `read_their_flow` reads: millimetres, and a tenth of a millimetre per second."""
    columns = (one.tolist() for one in (flow.x, flow.y, flow.bed, flow.depth, flow.u, flow.v))
    rows = [
        f"{x:.3f},{y:.3f},{bed:.4f},{depth:.4f},{u:.4f},{v:.4f}"
        for x, y, bed, depth, u, v in zip(*columns, strict=True)
    ]
    return "\n".join([",".join(COLUMNS), *rows]) + "\n"
