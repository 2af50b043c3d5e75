"""From a case to what the solver needs: values of parameters put in place, one problem for each experiment."""

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.case_effects import Theta, active_effects, value_of
from vegglue.case.channel_geometry import channel_geometry, expected_depth, patches_present, site_scales
from vegglue.case.grid import Grid, cell_stretch, curvature_of
from vegglue.case.gridded_site import Site, in_experiment, rims
from vegglue.case.schema import Case, Experiment
from vegglue.case.zones import centres_within, inflow_cells, refuse_ranges_without_cells
from vegglue.effects import bed_laws, plant_laws
from vegglue.effects.active_effect import ActiveEffect, applied
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

# Depth over that on the floor [-] from which on all of what enters somewhere does so; less of it where it is shallower.
# Chosen, not measured.
WHERE_WATER_ENTERS = 0.2
# Rise of the bed between two rows over their distance [-] from which it is a step with a wall, between walls: chosen as
# what no bank of earth has, after the compound channel A2 of docs/measured.md.
STEEP_AS_A_WALL = 1.0
# Pairs of a site and a set of patches of which the cells are kept: those of a model and of its coarser ones.
PLANTED_KEPT = 8


def build_problem(case: Case, site: Site, experiment: str, theta: Theta) -> Problem:
    """The flow problem of one experiment.

    Parameters
    ----------
    case, site, experiment
        The case, on its grid or on another, and the name of the experiment.
    theta
        Values (m,) of the parameters by name, in their units.

    Returns
    -------
    Problem
        Of all m members.

    Raises
    ------
    InputError
        If an inflow or the outlet holds no cell centre.
    """
    refuse_ranges_without_cells(case, site.grid)
    site, members = in_experiment(site, experiment), _members(theta)
    classes = [case.friction.classes[name] for name in site.class_names]
    walls = _walls(case, site, theta)
    return Problem(
        dx=site.grid.dx,
        dy=site.grid.dy,
        bed=site.bed,
        friction=BedFriction(
            friction_class=site.friction_class,
            law=np.array([bed_laws.BED_LAWS.index(item.law) for item in classes], dtype=np.int64),
            coefficient=np.array([value_of(item.coefficient, theta, members) for item in classes]),
            bank_argument_minimum=case.numerics.bank_argument_minimum,
        ),
        plants=_plants(case, site, experiment, theta),
        viscosity=value_of(case.eddy_viscosity, theta, members),
        film=case.numerics.film_depth,
        smallest_shear_depth=case.numerics.shear_depth == "smallest" or bool(walls.steps.any()),
        walls=walls,
        bend=bend_of(site.grid),
        **_under_effects(case, site, experiment, theta),
    )


def with_effects_of(case: Case, site: Site, experiment: str, theta: Theta, like: Problem) -> Problem:
    """The problem of a case that differs from that of another by effects alone, and by the values of their parameters.

    Parameters
    ----------
    case, site, experiment, theta
        As `build_problem`.
    like : Problem
        Of the other case, of the same m members.
    """
    changed = _under_effects(case, in_experiment(site, experiment), experiment, theta)
    return replace(like, half_range=like.bed_half_range, **changed)  # no effect changes the bed itself: known once


def _members(theta: Theta) -> int:
    return len(next(iter(theta.values()))) if theta else 1


def _under_effects(case: Case, site: Site, experiment: str, theta: Theta) -> dict[str, Any]:
    """Effects, and by name the parts of a problem that they change before anything flows: bed, inflows, outlet."""
    members, setting, grid = _members(theta), case.experiments[experiment], site.grid
    effects = active_effects(case, experiment, theta, members)
    geometry = channel_geometry(case, site, experiment) if effects else None
    cells = [inflow_cells(inflow, grid) for inflow in case.inflows.values()]
    longest = max(some.size for some in cells)  # spread and position have as many cells as the longest inflow
    position = np.zeros((len(cells), longest, 1))
    for inflow, some in enumerate(cells):
        position[inflow, : some.size, 0] = (np.arange(some.size) + 0.5) / some.size * 2.0 - 1.0
    stated = BoundaryValues(
        discharge=np.array([value_of(setting.discharge[name], theta, members) for name in case.inflows]),
        level=value_of(setting.level, theta, members),
        spread=np.ones((len(cells), longest, 1)),
        lateral=np.zeros(members),
        position=position,
    )
    neutral = {name: getattr(stated, name) for name in REPLACED["boundary"]}
    values = BoundaryValues(**applied(effects, "boundary", stated, neutral), position=position)
    bed_rise, entering = EMPTY, EMPTY
    if geometry is not None:
        bed_rise, entering = _site_changes(effects, geometry, values.lateral)
        if entering.size:
            # What would enter over land enters the water beside it: each member's sum stays. What enters and what
            # leaves may cancel.
            under_water, stretch, parts = share_under_water(case, site, setting)[..., None], geometry.stretch, []
            for part in (np.maximum(entering, 0.0), np.minimum(entering, 0.0)):
                wet = part * under_water
                left = (wet * stretch).sum(axis=(0, 1))
                parts.append(wet * ((part * stretch).sum(axis=(0, 1)) / np.where(left == 0.0, 1.0, left)))
            entering = np.ascontiguousarray(sum(parts))
    inflows = tuple(
        InflowSegment(
            side=inflow.side,
            start=int(some[0]),
            stop=int(some[-1]) + 1,
            discharge=discharge,
            by_conveyance=inflow.spread == "conveyance",
            spread=spread[: some.size],
            along=0.0 if inflow.angle is None else 1.0 / float(np.tan(np.radians(inflow.angle))),
            rim=rims(site, inflow.side, int(some[0]), int(some[-1]) + 1),
        )
        for inflow, some, discharge, spread in zip(
            case.inflows.values(), cells, values.discharge, values.spread, strict=True
        )
    )
    return {
        "boundaries": Boundaries(
            inflows=inflows,
            outlet=centres_within(case.outlet.range, grid.y),
            # What effects hand on may not be written to: loops would be compiled once more for such arrays.
            outlet_level=np.array(values.level),
            lateral_inflow=entering,
        ),
        "bed_rise": bed_rise,
        "effects": effects,
        "geometry": geometry,
    }


def _site_changes(effects: tuple[ActiveEffect, ...], geometry: ChannelGeometry, lateral: Array) -> tuple[Array, Array]:
    """By how much members' beds lie higher [m], and what enters by effects on the site and as lateral inflow, spread
    over the floor [m/s]; (nx, ny, m), or empty.
    """
    changed: dict[str, Array] = {}
    here = [active for active in effects if active.effect.stage == "site" and active.on.any()]
    if here:
        zero = np.zeros((*geometry.bed.shape[:2], len(next(iter(here[0].values.values())))))
        change = applied(effects, "site", geometry, {"bed": zero, "inflow": zero})
        changed = {name: np.ascontiguousarray(value) for name, value in change.items() if value is not zero}
    bed_rise, entering = changed.get("bed", EMPTY), changed.get("inflow", EMPTY)
    if lateral.any():
        floor = 1.0 - geometry.bank
        spread = floor * lateral / ((floor * geometry.stretch).sum() * geometry.dx * geometry.dy)
        entering = np.ascontiguousarray(spread + entering if entering.size else spread)
    return bed_rise, entering


def share_under_water(case: Case, site: Site, setting: Experiment) -> Array:
    """min(1, h / (a h_0)): how much of what enters somewhere does so in each cell, (nx, ny) [-].

    h is the depth expected, h_0 that on the floor, a WHERE_WATER_ENTERS. On land, over which water would have no steady
    way down, nothing enters.

    Parameters
    ----------
    case, site
        The case on its grid.
    """
    return np.clip(expected_depth(case, site, setting) / (WHERE_WATER_ENTERS * site_scales(case, site).depth), 0.0, 1.0)


def bend_of(grid: Grid) -> Bend | None:
    """The curvature of a grid along a centreline, of its west-east faces the mean of both columns; None if straight."""
    at_cells = curvature_of(grid)
    if not at_cells.any():
        return None
    beside = np.concatenate([at_cells[:1], at_cells, at_cells[-1:]])
    return Bend(at_cells, 0.5 * (beside[1:] + beside[:-1]), float(grid.y[0] - 0.5 * grid.dy), grid.dy)


def _walls(case: Case, site: Site, theta: Theta) -> SideWalls:
    """Rough walls along both sides, none where water enters through them, and on steps of the bed."""
    walls, grid = case.friction.walls, site.grid
    if walls is None:
        return SMOOTH_WALLS
    curvature, middle = curvature_of(grid), cell_stretch(grid)
    lengths = {
        "south": (1.0 - curvature * (grid.y[0] - 0.5 * grid.dy)) / middle[:, 0],
        "north": (1.0 - curvature * (grid.y[-1] + 0.5 * grid.dy)) / middle[:, -1],
    }
    for inflow in case.inflows.values():
        if inflow.side != "west":
            lengths[inflow.side][inflow_cells(inflow, grid)] = 0.0
    law, floor = bed_laws.BED_LAWS.index(walls.law), case.numerics.bank_argument_minimum
    drag = bed_laws.wall_coefficient(law, value_of(walls.coefficient, theta, _members(theta)), grid.dy, floor)
    rise, middle = np.diff(site.bed, axis=1), np.broadcast_to(middle, site.bed.shape)
    along = 1.0 - curvature[:, None] * (grid.y[:-1] + 0.5 * grid.dy)
    of_lower = along / np.where(rise > 0.0, middle[:, :-1], middle[:, 1:])
    steps = np.where(np.abs(rise) > STEEP_AS_A_WALL * grid.dy, np.sign(rise) * of_lower, 0.0)
    return SideWalls(**lengths, rate=drag / grid.dy, steps=steps if steps.any() else EMPTY)


def _plants(case: Case, site: Site, experiment: str, theta: Theta) -> VegetatedCells:
    """Vegetated cells of the patches present; phi is proportional to stems."""
    members = _members(theta)
    column, row, index = _planted_cells(site, patches_present(case, experiment))
    fields, law = np.empty((3, column.size, members)), np.empty(column.size, dtype=np.int64)
    for patch in np.unique(index):
        stems, name = case.plants.patches[patch].stems, case.plants.patches[patch].stand
        stand, override = case.plants.stands[name], case.experiments[experiment].stands.get(name)

        def own(key: str, stand: Any = stand, override: Any = override) -> Array:
            other = None if override is None else getattr(override, key)
            return value_of(getattr(stand, key) if other is None else other, theta, members)

        phi = own("phi") * stems / stand.stems
        fields[:, index == patch] = np.stack([phi, own("canopy_height"), own("bare_chezy")])[:, None]
        law[index == patch] = plant_laws.PLANT_LAWS.index(stand.law)
    proportional = case.numerics.emergent == "proportional"
    return VegetatedCells(column, row, law, site.cover[column, row], fields[0], fields[1], fields[2], proportional)


@lru_cache(PLANTED_KEPT)  # every problem of every member has the same
def _planted_cells(
    site: Site, patches: tuple[int, ...]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Column, row and patch (cell,) of the cells in which one of some patches stands."""
    column, row = np.ascontiguousarray(np.nonzero(np.isin(site.patch, patches)))
    return column, row, site.patch[column, row]
