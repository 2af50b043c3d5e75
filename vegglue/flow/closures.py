"""Friction, viscosity, momentum fluxes and forces of a state: laws of the bed and of plants, then effects.

All at cell centres; nothing here knows a face of the grid.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.effects.active_effect import ActiveEffect, applied
from vegglue.effects.surroundings import Cells, ChannelGeometry, PlantCells
from vegglue.flow.problem import ACROSS, ALONG, LEVEL, Problem
from vegglue.resistance import bed_laws, plant_laws
from vegglue.site.channel_geometry import part_of

# Columns worked on together, so that what lies between fits the cache.
CLOSURE_STRIP = 40


@dataclass(frozen=True)
class Closures:
    """Friction rate k [1/m] and viscosity [m2/s], (nx, ny, m); momentum fluxes h T [m3/s2] and forces [m/s2] by name,
    as far as there are any.
    """

    rate: Array
    viscosity: Array
    momentum: dict[str, Array]


@dataclass(frozen=True)
class BareClosures:
    """What effects at cell centres start from: depth h [m], friction rate k [1/m] and the part of it that is the bed's,
    (nx, ny, m), viscosity [m2/s]; whether shear acts over the smallest depth, see `Problem`.
    """

    depth: Array
    rate: Array
    bed_rate: Array
    viscosity: Array
    smallest_shear_depth: bool


def stages_of(effects: tuple[ActiveEffect, ...]) -> set[str]:
    return {active.effect.stage for active in effects}


def plant_values(
    effects: tuple[ActiveEffect, ...],
    geometry: ChannelGeometry,
    column: NDArray[np.int64],
    row: NDArray[np.int64],
    plants: tuple[Array, Array],
    state: Array,
    depth: Array,
) -> tuple[Array, Array]:
    """phi and canopy height (cell, m) of vegetated cells after the effects of the stage plants."""
    phi, canopy_height = plants
    before = np.maximum(column - 1, 0)
    u = 0.5 * (state[column, ALONG, row] + state[before, ALONG, row])
    north = np.minimum(row + 1, state.shape[2] - 1)
    beyond = np.where((row + 1 < state.shape[2])[:, None], state[column, ACROSS, north], 0.0)
    v = 0.5 * (state[column, ACROSS, row] + beyond)
    seen = PlantCells(
        phi=phi,
        canopy_height=canopy_height,
        depth=depth[column, row],
        speed=np.sqrt(u**2 + v**2 + 1e-6),
        front=geometry.front[column, row],
        edge=geometry.edge[column, row],
        x=geometry.x[column, 0],
        y=geometry.y[0, row],
    )
    now = applied(effects, "plants", seen, {"phi": phi, "canopy_height": canopy_height})
    return np.ascontiguousarray(now["phi"]), np.ascontiguousarray(now["canopy_height"])


def closures(
    effects: tuple[ActiveEffect, ...], geometry: ChannelGeometry, state: Array, bare: BareClosures
) -> Closures:
    """All that the stages resistance, exchange and force hand on."""
    nx = state.shape[0]
    found: dict[str, Array] = {"rate": np.empty_like(bare.rate), "viscosity": np.empty_like(bare.rate)}
    for first in range(0, nx, CLOSURE_STRIP):
        stop = min(first + CLOSURE_STRIP, nx)
        wide = slice(max(first - 1, 0), min(stop + 1, nx))
        inner = slice(first - wide.start, stop - wide.start)
        cells = _cells(part_of(geometry, wide, slice(None)), state, bare, wide)
        values = applied(effects, "resistance", cells, {"rate": cells.rate})
        cells = Cells(**{**cells.__dict__, "rate": values["rate"]})
        values |= applied(effects, "exchange", cells, {"viscosity": bare.viscosity, "xx": ZERO, "xy": ZERO, "yy": ZERO})
        values |= applied(effects, "force", cells, {"x": ZERO, "y": ZERO})
        for name, value in values.items():
            if value is ZERO:
                continue
            if name not in found:
                found[name] = np.zeros_like(bare.rate)
            found[name][first:stop] = np.broadcast_to(value, cells.depth.shape)[inner]
    momentum = {name: value for name, value in found.items() if name not in ("rate", "viscosity")}
    return Closures(found["rate"], found["viscosity"], momentum)


ZERO, EMPTY = np.zeros(1), np.zeros((0, 0, 0))


def _cells(geometry: ChannelGeometry, state: Array, bare: BareClosures, columns: slice) -> Cells:
    here, depth = state[columns], bare.depth[columns]
    before = state[np.maximum(np.arange(columns.start, columns.stop) - 1, 0), ALONG]
    v = 0.5 * here[:, ACROSS]
    v[:, :-1] += 0.5 * here[:, ACROSS, 1:]
    return Cells(
        geometry=geometry,
        depth=depth,
        level=here[:, LEVEL],
        u=0.5 * (here[:, ALONG] + before),
        v=v,
        rate=bare.rate[columns],
        bed_rate=bare.bed_rate[columns],
        viscosity=bare.viscosity,
        shear_depth=np.minimum(depth[:, 1:], depth[:, :-1]) if bare.smallest_shear_depth else EMPTY,
    )


def bed_drag(problem: Problem, depth: Array) -> Array:
    """k [1/m] of the class laws at cell centres, see `roughness`; depth (nx, ny, m) [m]."""
    classes = problem.friction_class, problem.law, problem.coefficient
    return bed_laws.class_drag(depth, problem.reach, *classes, problem.log_argument_minimum, problem.film)


def drag(problem: Problem, depth: Array, plants: tuple[Array, Array] | None = None) -> Array:
    """Friction k [1/m] of classes and plants at cell centres, so that the force is -k |U| u; depth (nx, ny, m) [m].

    plants: phi and canopy height (cell, m) when they are not those of the problem.
    """
    rate = bed_drag(problem, depth)
    add_plant_drag(problem, rate, depth, plants or (problem.plants.phi, problem.plants.canopy_height))
    return rate


def add_plant_drag(problem: Problem, rate: Array, depth: Array, plants: tuple[Array, Array]) -> None:
    law = problem.plants.law
    plant_laws.plant_drag(
        rate,
        depth,
        problem.plants.column,
        problem.plants.row,
        law if law.size else np.zeros_like(problem.plants.row),
        *plants,
        problem.plants.bare_chezy,
        problem.phi_proportional,
    )


def closed(problem: Problem, state: Array, depth: Array) -> tuple[Array, Array, dict[str, Array]]:
    """Friction rate [1/m] and viscosity [m2/s] (nx, ny, m), momentum fluxes and forces by name, effects included."""
    stages = stages_of(problem.effects)
    plants = (problem.plants.phi, problem.plants.canopy_height)
    if "plants" in stages and problem.geometry is not None:
        column, row = problem.plants.column, problem.plants.row
        plants = plant_values(problem.effects, problem.geometry, column, row, plants, state, depth)
    rate = bed_drag(problem, depth)
    if problem.geometry is None or not stages & {"resistance", "exchange", "force"}:
        add_plant_drag(problem, rate, depth, plants)
        return rate, np.ascontiguousarray(np.broadcast_to(problem.viscosity, depth.shape)), {}
    of_bed = rate.copy()
    add_plant_drag(problem, rate, depth, plants)
    bare = BareClosures(depth, rate, of_bed, problem.viscosity, problem.smallest_shear_depth)
    found = closures(problem.effects, problem.geometry, state, bare)
    return found.rate, found.viscosity, found.momentum
