"""Friction, viscosity, momentum fluxes and forces of a state: laws of the bed and of plants, then effects.

All at cell centres; nothing here knows a face of the grid.
"""

from dataclasses import dataclass, replace

import numpy as np

from vegglue.arrays import Array
from vegglue.case.channel_geometry import part_of
from vegglue.effects import bed_laws, plant_laws
from vegglue.effects.active_effect import applied
from vegglue.effects.surroundings import Cells, PlantCells, speed_of
from vegglue.flow.problem import ACROSS, ALONG, EMPTY, LEVEL, Problem
from vegglue.flow.wet_and_dry import afloat

# Columns worked on together [-], so that what lies between fits the cache. On 200 x 48 cells strips of 40 take a fifth
# longer than all columns at once with one member, and an eighth with 16. No number hangs on it.
CLOSURE_STRIP = 200
ZERO = np.zeros(1)


@dataclass(frozen=True)
class Closures:
    """k, nu, h T and f of a state at cell centres (nx, ny, m).

    Attributes
    ----------
    rate, viscosity
        Friction rate k [1/m] and eddy viscosity nu [m2/s].
    momentum
        Forces x, y [m/s2] and momentum fluxes xx, xy, yy = h T [m3/s2] by name, as far as there are any.
    """

    rate: Array
    viscosity: Array
    momentum: dict[str, Array]


def closures(problem: Problem, state: Array, depth: Array) -> Closures:
    """k, nu, h T and f of a state: laws of bed and plants, then the effects of resistance, exchange and force.

    Parameters
    ----------
    problem
        Of m members.
    state, depth
        (nx, 3, ny, m) and (nx, ny, m) [m].
    """
    stages, geometry = {active.effect.stage for active in problem.effects}, problem.geometry
    plants = bent_plants(problem, state, depth)
    rate = bed_drag(problem, depth)
    if geometry is None or not stages & {"resistance", "exchange", "force"}:
        _add_plant_drag(problem, rate, depth, plants)
        return Closures(rate, np.array(np.broadcast_to(problem.viscosity, depth.shape), order="C"), {})
    bed_rate = rate.copy()
    _add_plant_drag(problem, rate, depth, plants)
    nx, found = state.shape[0], {"rate": np.empty_like(rate), "viscosity": np.empty_like(rate)}
    for first in range(0, nx, CLOSURE_STRIP):
        stop = min(first + CLOSURE_STRIP, nx)
        wide = slice(max(first - 1, 0), min(stop + 1, nx))  # gradients look one column further
        inner = slice(first - wide.start, stop - wide.start)
        here, h = state[wide], depth[wide]
        before = state[np.maximum(np.arange(wide.start, wide.stop) - 1, 0), ALONG]
        v = 0.5 * here[:, ACROSS]
        v[:, :-1] += 0.5 * here[:, ACROSS, 1:]
        cells = Cells(
            geometry=part_of(geometry, wide, slice(None)),
            depth=h,
            level=here[:, LEVEL],
            u=0.5 * (here[:, ALONG] + before),
            v=v,
            rate=rate[wide],
            bed_rate=bed_rate[wide],
            viscosity=problem.viscosity,
            shear_depth=np.minimum(h[:, 1:], h[:, :-1]) if problem.smallest_shear_depth else EMPTY,
        )
        values = applied(problem.effects, "resistance", cells, {"rate": cells.rate})
        cells = replace(cells, rate=values["rate"])
        nothing = {"viscosity": cells.viscosity, "xx": ZERO, "xy": ZERO, "yy": ZERO}
        values |= applied(problem.effects, "exchange", cells, nothing)
        values |= applied(problem.effects, "force", cells, {"x": ZERO, "y": ZERO})
        for name, value in values.items():
            if value is ZERO:
                continue
            if name not in found:
                found[name] = np.zeros_like(rate)
            found[name][first:stop] = np.broadcast_to(value, h.shape)[inner]
    momentum = {name: value for name, value in found.items() if name not in ("rate", "viscosity")}
    # Two places that mix less may take more than there is.
    return Closures(found["rate"], np.maximum(found["viscosity"], 0.0), momentum)


def bed_drag(problem: Problem, depth: Array, columns: slice = slice(None)) -> Array:
    """k [1/m] of the laws of the bed, without plants, see `bed_laws.class_drag`.

    Parameters
    ----------
    depth : (columns, ny, m) [m]
        At the centres of cells.
    columns : slice
        Of which columns of the grid.
    """
    bed, half_range = problem.friction, problem.bed_half_range[columns]
    classes, floor = bed.friction_class[columns], bed.bank_argument_minimum
    return bed_laws.class_drag(depth, half_range, classes, bed.law, bed.coefficient, floor, problem.film)


def drag(problem: Problem, depth: Array) -> Array:
    """k (nx, ny, m) [1/m] of bed and plants without effects, so that the force on the water is -k |U| u.

    Parameters
    ----------
    depth : (nx, ny, m) [m]
    """
    rate = bed_drag(problem, depth)
    _add_plant_drag(problem, rate, depth, (problem.plants.phi, problem.plants.canopy_height))
    return rate


def _add_plant_drag(problem: Problem, rate: Array, depth: Array, values: tuple[Array, Array]) -> None:
    """The laws of plants in place of those of the bed on what plants cover; values: phi and canopy height (cell, m)."""
    one = problem.plants
    plant_laws.plant_drag(
        rate, depth, one.column, one.row, one.law, one.share, *values, one.bare_chezy, one.proportional
    )


def wall_rates(problem: Problem, depth: Array) -> tuple[tuple[int, Array], ...]:
    """k_w = sum(r c_w / dy) / sum h over both cells of the east faces of rows beside rough walls.

    A wall that is wet over a height r takes c_w |u| u r dx from the water h dx dy of the cell, so that du/dt = -c_w r/h
    |u| u / dy: along the wall only, which is why it is no part of k. At the sides r = h, on a step h less the depth
    above it. Faded out in the film on dry land like advection.

    Parameters
    ----------
    depth : (nx, ny, m) [m]

    Returns
    -------
    tuple of (row, (nx, m))
        k_w [1/m] of each row beside a wall.
    """
    walls = problem.walls
    if not walls.rate.size:
        return ()
    wet = {0: walls.south[:, None] * depth[:, 0]}
    last = depth.shape[1] - 1
    wet[last] = wet.get(last, 0.0) + walls.north[:, None] * depth[:, last]
    for row, above, length in walls.faces:
        wet[row] = wet.get(row, 0.0) + length * np.maximum(depth[:, row] - depth[:, above], 0.0)
    found = []
    for row, height in wet.items():
        beside = depth[:, row]
        pulled = walls.rate * height * afloat(beside, 0.5 / problem.film)
        pulled[:-1] += pulled[1:]  # the last face has one cell
        pair = beside.copy()
        pair[:-1] += beside[1:]
        found.append((row, pulled / pair))
    return tuple(found)


def bent_plants(problem: Problem, state: Array, depth: Array) -> tuple[Array, Array]:
    """phi [-] and canopy height [m] (cell, m) of vegetated cells after the effects of the stage plants.

    Parameters
    ----------
    state, depth : (nx, 3, ny, m), (nx, ny, m) [m]
    """
    geometry, stages = problem.geometry, {active.effect.stage for active in problem.effects}
    if geometry is None or "plants" not in stages:
        return problem.plants.phi, problem.plants.canopy_height
    column, row = problem.plants.column, problem.plants.row
    before = np.maximum(column - 1, 0)
    u = 0.5 * (state[column, ALONG, row] + state[before, ALONG, row])
    north = np.minimum(row + 1, state.shape[2] - 1)
    beyond = np.where((row + 1 < state.shape[2])[:, None], state[column, ACROSS, north], 0.0)
    v = 0.5 * (state[column, ACROSS, row] + beyond)
    phi, canopy_height = problem.plants.phi, problem.plants.canopy_height
    seen = PlantCells(
        phi=phi,
        canopy_height=canopy_height,
        depth=depth[column, row],
        speed=speed_of(u, v),
        front=geometry.front[column, row],
        edge=geometry.edge[column, row],
        x=geometry.x[column, 0],
        y=geometry.y[0, row],
        patch=geometry.patch[column, row],
        speed_scale=geometry.speed_scale,
    )
    now = applied(problem.effects, "plants", seen, {"phi": phi, "canopy_height": canopy_height})
    return np.array(now["phi"]), np.array(now["canopy_height"])
