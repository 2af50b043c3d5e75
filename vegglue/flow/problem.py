"""The nouns of the flow: a Problem (everything the equations need), a State (what they are solved for), their residual.

    dh/dt + d(hu)/dx + d(hv)/dy = 0
    du/dt + u du/dx + v du/dy + g dz_s/dx + k |U| u - div(h nu grad u)/h = f        (v alike)

with k = g / (C^2 h) [1/m] from the friction laws where all of a cell is wet. A state of m members is one array (nx, 3,
ny, m): level at cell centres, v on the south face of each cell (row 0 unused: walls and side inflows set it), u on the
east face of each cell.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.effects.active_effect import ActiveEffect
from vegglue.effects.surroundings import ChannelGeometry
from vegglue.site.channel_geometry import rows_of

LEVEL, ACROSS, ALONG = 0, 1, 2


@dataclass(frozen=True)
class InflowSegment:
    """Discharge [m3/s] of each member through the cells start..stop-1 of one side ('west', 'south' or 'north').

    spread: what conveyance is multiplied by in each cell, (cell, m) or (cell, 1) [-]; along: through a side, velocity
    along x over that through the side, the cotangent of the angle it joins at [-].
    """

    side: str
    start: int
    stop: int
    discharge: Array
    by_conveyance: bool = True
    spread: Array = field(default_factory=lambda: np.ones((1, 1)))
    along: float = 0.0


@dataclass(frozen=True)
class VegetatedCells:
    """Vegetated cells (column, row) and their values per cell and member: phi [-], h_d [m], C_b [m^1/2/s].

    law: of each cell, an index into canopy.LAWS; Baptist's when empty.
    """

    column: NDArray[np.int64]
    row: NDArray[np.int64]
    phi: Array
    canopy_height: Array
    bare_chezy: Array
    law: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))


@dataclass(frozen=True)
class Problem:
    """One experiment for m members on one grid: bed (nx, ny) [m], friction classes, plants, boundaries, viscosity
    [m2/s].

    lift (nx, ny, m) or empty: by how much members' beds lie higher [m]; source (nx, ny, m) or empty: water that enters
    from above or below, without momentum [m/s]; effects: effects at work in the flow and its readings.
    """

    dx: float
    dy: float
    bed: Array
    friction_class: NDArray[np.int64]
    law: NDArray[np.int64]
    coefficient: Array
    plants: VegetatedCells
    viscosity: Array
    inflows: tuple[InflowSegment, ...]
    outlet: NDArray[np.bool_]
    outlet_level: Array
    film: float
    log_argument_minimum: float
    phi_proportional: bool = False
    smallest_shear_depth: bool = False
    lift: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    source: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    effects: tuple[ActiveEffect, ...] = ()
    geometry: ChannelGeometry | None = None

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
        inflows=tuple(
            replace(
                inflow,
                discharge=pick(inflow.discharge),
                spread=pick(inflow.spread) if inflow.spread.shape[-1] > 1 else inflow.spread,
            )
            for inflow in problem.inflows
        ),
        outlet_level=pick(problem.outlet_level),
        lift=pick(problem.lift) if problem.lift.size else problem.lift,
        source=pick(problem.source) if problem.source.size else problem.source,
        effects=tuple(
            replace(active, values={name: pick(value) for name, value in active.values.items()})
            for active in problem.effects
        ),
    )


def crop(problem: Problem, south: int, north: int) -> Problem:
    """The rows south..north-1 of a problem, with walls beside them; inflows through a side cut off must not exist."""
    plants = problem.plants
    inside = (plants.row >= south) & (plants.row < north)
    kept = VegetatedCells(
        plants.column[inside],
        plants.row[inside] - south,
        plants.phi[inside],
        plants.canopy_height[inside],
        plants.bare_chezy[inside],
        plants.law[inside] if plants.law.size else plants.law,
    )
    inflows = tuple(_cropped(inflow, south, north) if inflow.side == "west" else inflow for inflow in problem.inflows)
    return replace(
        problem,
        bed=np.ascontiguousarray(problem.bed[:, south:north]),
        friction_class=np.ascontiguousarray(problem.friction_class[:, south:north]),
        plants=kept,
        inflows=inflows,
        outlet=problem.outlet[south:north],
        lift=np.ascontiguousarray(problem.lift[:, south:north]),
        source=np.ascontiguousarray(problem.source[:, south:north]),
        geometry=None if problem.geometry is None else rows_of(problem.geometry, south, north),
    )


def _cropped(inflow: InflowSegment, south: int, north: int) -> InflowSegment:
    start, stop = max(inflow.start, south), min(inflow.stop, north)
    spread = inflow.spread[start - inflow.start : stop - inflow.start] if len(inflow.spread) > 1 else inflow.spread
    return replace(inflow, start=start - south, stop=stop - south, spread=spread)
