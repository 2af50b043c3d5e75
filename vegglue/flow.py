"""The nouns of the flow: a Problem (everything the equations need), a State (what they are solved for), their residual.

    dh/dt + d(hu)/dx + d(hv)/dy = 0
    du/dt + u du/dx + v du/dy + g dz_s/dx + k |U| u - div(h nu grad u)/h = f        (v alike)

with k = g / (C^2 h) [1/m] from the friction laws. A state of m members is one array (nx, 3, ny, m): level at cell
centres, v on the south face of each cell (row 0 unused: walls and side inflows set it), u on the east face of each
cell.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vegglue import kernels

Array = NDArray[np.float64]
LEVEL, ACROSS, ALONG = 0, 1, 2


@dataclass(frozen=True)
class Inflow:
    """Discharge [m3/s] of each member through the cells start..stop-1 of one side ('west', 'south' or 'north')."""

    side: str
    start: int
    stop: int
    discharge: Array
    by_conveyance: bool = True


@dataclass(frozen=True)
class Plants:
    """Vegetated cells (column, row) and their Baptist values per cell and member: phi [-], h_d [m], C_b [m^1/2/s]."""

    column: NDArray[np.int64]
    row: NDArray[np.int64]
    phi: Array
    canopy_height: Array
    bare_chezy: Array


@dataclass(frozen=True)
class Problem:
    """One experiment for m members on one grid: bed (nx, ny) [m], friction classes, plants, boundaries, viscosity
    [m2/s].
    """

    dx: float
    dy: float
    bed: Array
    friction_class: NDArray[np.int64]
    law: NDArray[np.int64]
    coefficient: Array
    plants: Plants
    viscosity: Array
    inflows: tuple[Inflow, ...]
    outlet: NDArray[np.bool_]
    outlet_level: Array
    film: float = 0.01
    log_argument_minimum: float = 1.3
    phi_proportional: bool = False

    @property
    def shape(self) -> tuple[int, int]:
        return self.bed.shape[0], self.bed.shape[1]

    @cached_property
    def reach(self) -> Array:
        """Half the range of the bed across the flow within each cell, (nx, ny) [m], at least four films.

        Along x the surface falls with the bed, so that a slope there does not make a cell deep and shallow at once.
        """
        rise = np.gradient(self.bed, axis=1) if self.shape[1] > 1 else np.zeros_like(self.bed)
        return np.maximum(0.5 * np.abs(rise), 4.0 * self.film)

    @property
    def members(self) -> int:
        return self.outlet_level.size


@dataclass(frozen=True)
class Faces:
    """What a state means on the grid: depths [m] at cells, faces, corners; velocities [m/s] and fluxes [m2/s] on
    faces.
    """

    level: Array
    cell: Array
    face_x: Array
    face_y: Array
    corner: Array
    u: Array
    v: Array
    flux_x: Array
    flux_y: Array


@dataclass(frozen=True)
class FlowFields:
    """One member at cell centres, (nx, ny): bed and level [m], depth [m], u and v [m/s]; NaN where dry."""

    x: Array
    y: Array
    bed: Array
    depth: Array
    level: Array
    u: Array
    v: Array


def take(problem: Problem, members: NDArray[np.int64]) -> Problem:
    """The same problem for some of its members (an index array; an index may repeat)."""
    pick = lambda values: np.ascontiguousarray(values[..., members])  # noqa: E731
    plants = problem.plants
    return replace(
        problem,
        coefficient=pick(problem.coefficient),
        plants=replace(
            plants, phi=pick(plants.phi), canopy_height=pick(plants.canopy_height), bare_chezy=pick(plants.bare_chezy)
        ),
        viscosity=pick(problem.viscosity),
        inflows=tuple(replace(inflow, discharge=pick(inflow.discharge)) for inflow in problem.inflows),
        outlet_level=pick(problem.outlet_level),
    )


def crop(problem: Problem, south: int, north: int) -> Problem:
    """The rows south..north-1 of a problem, with walls beside them; inflows through a side cut off must not exist."""
    plants = problem.plants
    inside = (plants.row >= south) & (plants.row < north)
    kept = Plants(
        plants.column[inside],
        plants.row[inside] - south,
        plants.phi[inside],
        plants.canopy_height[inside],
        plants.bare_chezy[inside],
    )
    rows = north - south
    inflows = tuple(
        replace(inflow, start=max(inflow.start - south, 0), stop=min(inflow.stop - south, rows))
        if inflow.side == "west"
        else inflow
        for inflow in problem.inflows
    )
    return replace(
        problem,
        bed=np.ascontiguousarray(problem.bed[:, south:north]),
        friction_class=np.ascontiguousarray(problem.friction_class[:, south:north]),
        plants=kept,
        inflows=inflows,
        outlet=problem.outlet[south:north],
    )


def _side_fluxes(problem: Problem, depth: Array) -> tuple[Array, Array, Array]:
    """q = Q w / (sum w * width) [m2/s] into the west (ny, m), south and north (nx, m) side, w = h^(5/3) or 1."""
    (nx, ny), m = problem.shape, problem.members
    fluxes = {"west": np.zeros((ny, m)), "south": np.zeros((nx, m)), "north": np.zeros((nx, m))}
    beside = {"west": depth[0], "south": depth[:, 0], "north": depth[:, -1]}
    for inflow in problem.inflows:
        part = slice(inflow.start, inflow.stop)
        width = problem.dy if inflow.side == "west" else problem.dx
        there = beside[inflow.side][part]
        weight = there ** (5.0 / 3.0) if inflow.by_conveyance else np.ones_like(there)
        fluxes[inflow.side][part] += inflow.discharge * weight / (weight.sum(axis=0) * width)
    return fluxes["west"], fluxes["south"], fluxes["north"]


def storage(problem: Problem, level: Array) -> Array:
    """dh/dz_s of every cell [-], (nx, ny, m): the share of it that is wet."""
    above = level - problem.bed[:, :, None] - 0.1 * problem.film
    reach = problem.reach[:, :, None]
    return np.clip(0.5 * (above + reach) / reach, 0.0, 1.0)


def faces(problem: Problem, state: Array) -> Faces:
    """Depths, velocities and fluxes of a state (nx, 3, ny, m), boundaries included."""
    level = np.ascontiguousarray(state[:, LEVEL])
    cell, face_x, face_y, corner = kernels.depths(level, problem.bed, problem.reach, problem.outlet_level, problem.film)
    u, v = kernels.velocities(state, 0, problem.shape[0], cell, *_side_fluxes(problem, cell))
    return Faces(level, cell, face_x, face_y, corner, u, v, face_x * u, face_y * v)


def drag(problem: Problem, depth: Array) -> Array:
    """Friction k = g / (C^2 h) [1/m] at cell centres, so that the force is -k |U| u; depth (nx, ny, m) [m]."""
    rate = kernels.class_drag(
        depth,
        problem.reach,
        problem.friction_class,
        problem.law,
        problem.coefficient,
        problem.log_argument_minimum,
        problem.film,
    )
    plants = problem.plants
    kernels.plant_drag(
        rate,
        depth,
        plants.column,
        plants.row,
        plants.phi,
        plants.canopy_height,
        plants.bare_chezy,
        problem.phi_proportional,
    )
    return rate


def residual(problem: Problem, state: Array) -> Array:
    """R(state), (nx, 3, ny, m): the negative rate of change of level [m/s], v and u [m/s2]; zero when steady."""
    depth = kernels.cell_depth(state, problem.bed, problem.reach, problem.film)
    viscosity = np.broadcast_to(problem.viscosity, depth.shape)
    return kernels.rates(
        state,
        problem.bed,
        problem.reach,
        drag(problem, depth),
        np.ascontiguousarray(viscosity),
        *_side_fluxes(problem, depth),
        problem.outlet,
        problem.outlet_level,
        problem.film,
        problem.dx,
        problem.dy,
    )
