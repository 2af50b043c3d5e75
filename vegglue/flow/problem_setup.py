"""From a case to what the solver needs: values of parameters put in place, one problem for each experiment."""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.case_effects import Theta, active_effects, value_of
from vegglue.case.channel_geometry import channel_geometry, expected_depth, patches_present
from vegglue.case.grid import Grid, cell_stretch, curvature_of
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.schema import Case, Experiment
from vegglue.case.site_schema import Inflow, Stand, StandOverride
from vegglue.case.zones import centres_within, inflow_cells, refuse_ranges_without_cells
from vegglue.effects import bed_laws, plant_laws
from vegglue.effects.active_effect import ActiveEffect, applied
from vegglue.effects.bed_laws import wall_coefficient
from vegglue.effects.definition import REPLACED
from vegglue.effects.surroundings import BoundaryValues, ChannelGeometry
from vegglue.flow.kernels import Bend
from vegglue.flow.problem import (
    EMPTY,
    SMOOTH_WALLS,
    BedFriction,
    Boundaries,
    InflowSegment,
    Problem,
    SideWalls,
    VegetatedCells,
)

# Depth [m] from which on all of what enters somewhere does so; less of it where it is shallower. Chosen, not measured.
WHERE_WATER_ENTERS = 0.2
# Pairs of a site and a set of patches of which the cells are kept: those of a model and of its coarser ones.
PLANTED_KEPT = 8


def build_problem(case: Case, site: Site, experiment: str, theta: Theta) -> Problem:
    """The problem of one experiment for all members of theta, {parameter: (members,)}.

    Errors: InputError when an inflow or the outlet holds no cell centre.
    """
    refuse_ranges_without_cells(case, site.grid)
    site, members = in_experiment(site, experiment), _members(theta)
    return Problem(
        dx=site.grid.dx,
        dy=site.grid.dy,
        bed=site.bed,
        friction=_bed_friction(case, site, theta, members),
        plants=_plants(case, site, experiment, theta, members),
        viscosity=value_of(case.eddy_viscosity, theta, members),
        film=case.numerics.film_depth,
        smallest_shear_depth=case.numerics.shear_depth == "smallest",
        walls=_walls(case, site, theta, members),
        bend=bend_of(site.grid),
        **_under_effects(case, site, experiment, theta),
    )


def with_effects_of(case: Case, site: Site, experiment: str, theta: Theta, like: Problem) -> Problem:
    """The problem of a case that differs from that of `like` by effects alone, and the values of their parameters."""
    return replace(like, **_under_effects(case, in_experiment(site, experiment), experiment, theta))


def _under_effects(case: Case, site: Site, experiment: str, theta: Theta) -> dict[str, Any]:
    """Effects, and what of a problem they have a hand in before anything flows, by name."""
    members, setting = _members(theta), case.experiments[experiment]
    effects = active_effects(case, experiment, theta, members)
    geometry = channel_geometry(case, site, experiment) if effects else None
    added = _added_to_site(effects, geometry) if geometry else {}
    values = boundary_values(effects, _boundary_values(case, site, setting, theta, members))
    entering = _entering(values.lateral, added, geometry) if geometry else EMPTY
    if geometry and entering.size:
        under_water = share_under_water(case, site, setting)
        both = np.maximum(entering, 0.0), np.minimum(entering, 0.0)  # what enters and what leaves may cancel
        entering = np.ascontiguousarray(sum(_into_water(part, under_water, geometry.stretch) for part in both))
    return {
        "boundaries": _boundaries(case, site, values, entering),
        "bed_rise": added.get("bed", EMPTY),
        "effects": effects,
        "geometry": geometry,
    }


def _members(theta: Theta) -> int:
    return len(next(iter(theta.values()))) if theta else 1


def bend_of(grid: Grid) -> Bend | None:
    """The curvature of a grid along a centreline, of its west-east faces the mean of both columns; None if straight."""
    at_cells = curvature_of(grid)
    if not at_cells.any():
        return None
    beside = np.concatenate([at_cells[:1], at_cells, at_cells[-1:]])
    return Bend(at_cells, 0.5 * (beside[1:] + beside[:-1]), float(grid.y[0] - 0.5 * grid.dy), grid.dy)


def _bed_friction(case: Case, site: Site, theta: Theta, members: int) -> BedFriction:
    """Laws of the classes of a site, each with its one coefficient."""
    classes = [case.friction.classes[name] for name in site.class_names]
    return BedFriction(
        friction_class=site.friction_class,
        law=np.array([bed_laws.BED_LAWS.index(item.law) for item in classes], dtype=np.int64),
        coefficient=np.array([value_of(item.coefficient, theta, members) for item in classes]),
        bank_argument_minimum=case.numerics.bank_argument_minimum,
    )


def _walls(case: Case, site: Site, theta: Theta, members: int) -> SideWalls:
    """Rough walls along both sides, none where water enters through them."""
    walls, sides = case.friction.walls, _lengths_of_sides(site.grid)
    if walls is None:
        return SMOOTH_WALLS
    for inflow in case.inflows.values():
        if inflow.side != "west":
            sides[inflow.side][inflow_cells(inflow, site.grid)] = 0.0
    law, floor = bed_laws.BED_LAWS.index(walls.law), case.numerics.bank_argument_minimum
    drag = wall_coefficient(law, value_of(walls.coefficient, theta, members), site.grid.dy, floor)
    return SideWalls(**sides, rate=drag / site.grid.dy)


def _lengths_of_sides(grid: Grid) -> dict[str, Array]:
    """Length of each cell on the south and north side of the grid over that in its middle, (nx,) [-]; 1 if straight."""
    curvature, middle = curvature_of(grid), cell_stretch(grid)
    y = {"south": grid.y[0] - 0.5 * grid.dy, "north": grid.y[-1] + 0.5 * grid.dy}
    return {
        "south": (1.0 - curvature * y["south"]) / middle[:, 0],
        "north": (1.0 - curvature * y["north"]) / middle[:, -1],
    }


def _boundaries(case: Case, site: Site, values: BoundaryValues, entering: Array) -> Boundaries:
    inflows = zip(case.inflows.values(), values.discharge, values.spread, strict=True)
    return Boundaries(
        inflows=tuple(_inflow(inflow, site, discharge, spread) for inflow, discharge, spread in inflows),
        outlet=centres_within(case.outlet.range, site.grid.y),
        # What effects hand on may not be written to: loops would be compiled once more for such arrays.
        outlet_level=np.array(values.level),
        lateral_inflow=entering,
    )


def _boundary_values(case: Case, site: Site, setting: Experiment, theta: Theta, members: int) -> BoundaryValues:
    """What the case says of inflows and outlet; spread and position have as many cells as the longest side."""
    cells = [inflow_cells(inflow, site.grid).size for inflow in case.inflows.values()]
    position = np.zeros((len(cells), max(cells), 1))
    for inflow, size in enumerate(cells):
        position[inflow, :size, 0] = (np.arange(size) + 0.5) / size * 2.0 - 1.0
    return BoundaryValues(
        discharge=np.array([value_of(setting.discharge[name], theta, members) for name in case.inflows]),
        level=value_of(setting.level, theta, members),
        spread=np.ones((len(cells), max(cells), 1)),
        lateral=np.zeros(members),
        position=position,
    )


def _entering(lateral: Array, added: Mapping[str, Array], geometry: ChannelGeometry) -> Array:
    """Q_lateral / (area of the floor) on the floor, and what effects on the site add, (nx, ny, m) [m/s], or empty."""
    entering = added.get("inflow", EMPTY)
    if not lateral.any():
        return entering
    floor = 1.0 - geometry.bank
    spread = floor * lateral / ((floor * geometry.stretch).sum() * geometry.dx * geometry.dy)
    return np.ascontiguousarray(spread + entering if entering.size else spread)


def _plants(case: Case, site: Site, experiment: str, theta: Theta, members: int) -> VegetatedCells:
    """Vegetated cells of the patches present; phi is proportional to stems."""
    column, row, index = _planted_cells(site, patches_present(case, experiment))
    fields, law = np.empty((3, column.size, members)), np.empty(column.size, dtype=np.int64)
    for patch in np.unique(index):
        stems, name = case.plants.patches[patch].stems, case.plants.patches[patch].stand
        stand = case.plants.stands[name]
        phi, height, chezy = _stand(stand, case.experiments[experiment].stands.get(name), theta, members)
        fields[:, index == patch] = np.stack([phi * stems / stand.stems, height, chezy])[:, None]
        law[index == patch] = plant_laws.PLANT_LAWS.index(stand.law)
    proportional = case.numerics.emergent == "proportional"
    return VegetatedCells(column, row, law, site.cover[column, row], fields[0], fields[1], fields[2], proportional)


@lru_cache(PLANTED_KEPT)  # every problem of every member asks for the same
def _planted_cells(
    site: Site, patches: tuple[int, ...]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Column, row and patch (cell,) of the cells in which one of some patches stands."""
    column, row = np.ascontiguousarray(np.nonzero(np.isin(site.patch, patches)))
    return column, row, site.patch[column, row]


def _stand(stand: Stand, override: StandOverride | None, theta: Theta, members: int) -> tuple[Array, Array, Array]:
    """phi, canopy height and bare Chezy coefficient of a stand in one experiment."""

    def own(name: str) -> Array:
        other = getattr(override, name) if override is not None else None
        return value_of(getattr(stand, name) if other is None else other, theta, members)

    return own("phi"), own("canopy_height"), own("bare_chezy")


def _inflow(inflow: Inflow, site: Site, discharge: Array, spread: Array) -> InflowSegment:
    cells = inflow_cells(inflow, site.grid)
    start, stop = int(cells[0]), int(cells[-1]) + 1
    along = 0.0 if inflow.angle is None else 1.0 / float(np.tan(np.radians(inflow.angle)))
    return InflowSegment(
        inflow.side, start, stop, discharge, inflow.spread == "conveyance", spread[: stop - start], along
    )


def share_under_water(case: Case, site: Site, setting: Experiment) -> Array:
    """How much of what enters somewhere does so in each cell, (nx, ny) [-]: 1 where water is expected to stand deeper
    than WHERE_WATER_ENTERS, 0 on land, over which it would have no steady way down.
    """
    return np.clip(expected_depth(case, site, setting) / WHERE_WATER_ENTERS, 0.0, 1.0)


def _into_water(entering: Array, under_water: Array, stretch: Array) -> Array:
    """What would enter over land enters in the water beside it, (nx, ny, m) [m/s]: each member's sum stays."""
    wet = entering * under_water[..., None]
    left = (wet * stretch).sum(axis=(0, 1))
    return np.asarray(wet * ((entering * stretch).sum(axis=(0, 1)) / np.where(left == 0.0, 1.0, left)))


def _added_to_site(effects: tuple[ActiveEffect, ...], geometry: ChannelGeometry) -> dict[str, Array]:
    """By how much members' beds lie higher [m] and what enters there [m/s], (nx, ny, m), as far as effects say so."""
    here = [active for active in effects if active.effect.stage == "site" and active.on.any()]
    if not here:
        return {}
    zero = np.zeros((*geometry.bed.shape[:2], len(next(iter(here[0].values.values())))))
    change = applied(effects, "site", geometry, {"bed": zero, "inflow": zero})
    return {name: np.ascontiguousarray(value) for name, value in change.items() if value is not zero}


def boundary_values(effects: tuple[ActiveEffect, ...], boundary: BoundaryValues) -> BoundaryValues:
    """What enters and leaves after the effects of the stage boundary."""
    neutral = {name: getattr(boundary, name) for name in REPLACED["boundary"]}
    return BoundaryValues(**applied(effects, "boundary", boundary, neutral), position=boundary.position)
