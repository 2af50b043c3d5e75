"""The channel as effects see it: its axis, floor and banks, and the distance of each cell from patches of plants; and
what of it is known before anything flows: discharges that have entered, and expected depths.
"""

import math
from collections import OrderedDict
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.grid import Grid, cell_stretch, curvature_of, filter_width_of
from vegglue.case.gridded_site import Site, build_site, in_experiment
from vegglue.case.parameter_space import middle_value, value_at
from vegglue.case.schema import Case, Experiment
from vegglue.case.site_schema import FrictionClass
from vegglue.case.zones import BANK_SLOPE, beyond_slope_break
from vegglue.effects.physical_constants import GRAVITY
from vegglue.effects.scales import SLOPE_ERROR, SiteScales
from vegglue.effects.surroundings import ChannelGeometry

# Least distance of the centre of a cell from the front or side of a patch, over the size of the cell [-]: the mean over
# a cell that lies half within is a fourth. Laws that fade out divide by such distances.
NEAREST = 0.25
# Pairs of a site and a set of patches whose fields are kept: those of a model and of its coarser ones.
GEOMETRIES_KEPT = 8


def channel_geometry(case: Case, site: Site, experiment: str) -> ChannelGeometry:
    """The geometry (nx, ny, 1) that effects see in one experiment, with the patches that stand in it.

    Parameters
    ----------
    site : Site
        On this or another grid.
    """
    stems = np.array([patch.stems for patch in case.plants.patches])
    relative = tuple((stems / stems.mean()).tolist()) if stems.size else ()
    scales, patches = site_scales(case, site), patches_present(case, experiment)
    of_flow = scales.depth, scales.speed
    return _geometry(in_experiment(site, experiment), filter_width_of(case), patches, relative, of_flow)


def patches_present(case: Case, experiment: str) -> tuple[int, ...]:
    """Indices of the patches of the case that stand in an experiment."""
    plants = case.experiments[experiment].plants
    return tuple(
        index for index, patch in enumerate(case.plants.patches) if plants is True or (plants and patch.name in plants)
    )


def discharges_upstream_of(case: Case, experiment: Experiment, x: float) -> list[float | str] | None:
    """Discharges, numbers [m3/s] or parameters, of what has entered upstream of x.

    Parameters
    ----------
    x : [m]

    Returns
    -------
    list or None
        None if a side inflow lets water in on both sides of x.
    """
    given = []
    for name, value in experiment.discharge.items():
        inflow = case.inflows[name]
        low, high = inflow.range or case.grid.x
        if inflow.side == "west" or high <= x:
            given.append(value)
        elif not low >= x:
            return None
    return given


def half_width(site: Site) -> float:
    """Half width of the floor [m], the median of its cross-sections."""
    return float(np.median(_section(site)[1]))


def _beyond_floor(site: Site) -> NDArray[np.bool_]:
    """Cells (nx, ny) beyond the toe of the banks."""
    return ~_section(site)[2]


def cells_across(site: Site) -> float:
    """Width of the floor over that of a cell, 2 `half_width` / dy [-]."""
    return 2.0 * half_width(site) / site.grid.dy


@lru_cache(GEOMETRIES_KEPT)  # every problem of every member needs the same
def _geometry(
    site: Site,
    filter_width: float,
    present: tuple[int, ...],
    relative_stems: tuple[float, ...],
    of_flow: tuple[float, float],
) -> ChannelGeometry:
    grid, bed = site.grid, site.bed
    axis, half_width, floor = _section(site)
    patch = np.where(np.isin(site.patch, present), site.patch, -1)
    cover = np.where(patch >= 0, site.cover, 0.0)
    front, edge, wake = _distances(patch, cover, grid)
    bent = {}
    if grid.centreline is not None:
        stretch = cell_stretch(grid)[..., None]
        bent = {"stretch": stretch, "turning": curvature_of(grid)[:, None, None] / stretch}
    return ChannelGeometry(
        x=grid.x[:, None, None],
        y=grid.y[None, :, None],
        share_along=((np.arange(grid.x.size) + 0.5) / grid.x.size - 0.5)[:, None, None],
        length=grid.dx * grid.x.size,
        dx=grid.dx,
        dy=grid.dy,
        filter_width=filter_width,
        depth_scale=of_flow[0],
        speed_scale=of_flow[1],
        bed=bed[..., None],
        offset=((grid.y[None] - axis[:, None]) / half_width[:, None])[..., None],
        half_width=np.repeat(half_width[:, None, None], grid.y.size, axis=1),
        side_slope=_side_slope(site)[..., None],
        bank=(~floor).astype(float)[..., None],
        planted=cover[..., None],
        front=front[..., None],
        edge=edge[..., None],
        wake=wake[..., None],
        patch=patch[..., None],
        relative_stems=np.array([*relative_stems, 1.0])[patch][..., None],  # the last one where none stands, at -1
        **bent,
    )


def _section(site: Site) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Axis and half width of the floor (nx,) [m], at least one cell, and the cells that are floor (nx, ny)."""
    y, dy, floor = site.grid.y, site.grid.dy, ~beyond_slope_break(_side_slope(site) > BANK_SLOPE, site.bed)
    first, last = floor.argmax(axis=1), floor.shape[1] - 1 - floor[:, ::-1].argmax(axis=1)
    low, high = y[first] - 0.5 * dy, y[last] + 0.5 * dy
    return 0.5 * (low + high), np.maximum(0.5 * (high - low), 0.5 * dy), floor


def _side_slope(site: Site) -> Array:
    """|dz/dy| (nx, ny) [-]."""
    return np.abs(np.gradient(site.bed, site.grid.dy, axis=1))


def rows_of(geometry: ChannelGeometry, south: int, north: int) -> ChannelGeometry:
    """The geometry of rows south to north - 1."""
    return part_of(geometry, slice(None), slice(south, north))


def part_of(geometry: ChannelGeometry, columns: slice, rows: slice) -> ChannelGeometry:
    """The geometry of some columns and rows."""
    cut = {
        name: getattr(geometry, name)[columns, rows]
        for name in (
            "bed", "offset", "half_width", "side_slope", "bank", "planted", "front", "edge", "wake", "patch",
            "relative_stems",
        )
    }  # fmt: skip
    if geometry.turning.size:
        cut |= {"stretch": geometry.stretch[columns, rows], "turning": geometry.turning[columns, rows]}
    along = {name: getattr(geometry, name)[columns] for name in ("x", "share_along")}
    numbers = ("length", "dx", "dy", "filter_width", "depth_scale", "speed_scale")
    whole = {name: getattr(geometry, name) for name in numbers}
    return ChannelGeometry(y=geometry.y[:, rows], **whole, **along, **cut)


def _distances(patch: NDArray[np.int64], cover: Array, grid: Grid) -> tuple[Array, Array, Array]:
    """Front, edge and wake of ChannelGeometry, (nx, ny) [m]."""
    x, y = grid.x, grid.y
    front, edge, wake, own = (np.full(patch.shape, np.inf) for _ in range(4))
    for index in np.unique(patch[patch >= 0]):
        column, row = np.nonzero(patch == index)
        held = np.where(patch == index, cover, 0.0)
        west, east = _ends(held.max(axis=1), x, grid.dx)
        south, north = _ends(held.max(axis=0), y, grid.dy)
        front[column, row] = np.maximum(x[column] - west, NEAREST * grid.dx)
        beside = np.abs(y - 0.5 * (south + north)) - 0.5 * (north - south)
        beside = np.copysign(np.maximum(np.abs(beside), NEAREST * grid.dy), beside)
        here = slice(column.min(), column.max() + 1)
        edge[here] = np.where(np.abs(beside) < np.abs(edge[here]), beside, edge[here])
        own[column, row] = beside[row]
        behind = np.where(x > east, x - east, np.inf)[:, None]
        spans = ((y > south) & (y < north))[None]
        wake = np.where(spans & (behind < wake), behind, wake)
    return front, np.where(patch >= 0, own, edge), wake  # plants stand within their own patch, whatever is near


def _ends(share: Array, centres: Array, step: float) -> tuple[float, float]:
    """Where what covers cells (n,) in a row begins and ends [m], from the share [-] of the first and of the last."""
    first, last = np.flatnonzero(share)[[0, -1]]
    return float(centres[first] + step * (0.5 - share[first])), float(centres[last] - step * (0.5 - share[last]))


def expected_depth(case: Case, site: Site, experiment: Experiment) -> Array:
    """h = max(z_out, z_floor(x) + z_out - z_floor(L)) - z_b, (nx, ny) [m]; negative where dry.

    A water surface parallel to the floor, but nowhere below the level at the outlet: good enough to see what is odd,
    usually too low where plants hold the water up.

    Parameters
    ----------
    experiment : Experiment
        Its level is a number, or the middle of a prior.
    """
    outlet = middle_value(case, experiment.level)
    floor = site.bed.min(axis=1)
    level = np.maximum(outlet, floor + outlet - floor[-1])
    return level[:, None] - site.bed


def chezy(case: Case, of: FrictionClass, coefficient: float, depth: float) -> float:
    """C = h^(1/6)/n, 18 log10(12 h/k_s), or as given [m^1/2/s].

    Parameters
    ----------
    case : Case
        Of which the least 12 h/k_s is.
    coefficient : [s m^(-1/3), m or m^1/2/s]
    depth : h [m]
    """
    if of.law == "manning":
        return depth ** (1.0 / 6.0) / coefficient
    if of.law == "keulegan":
        return 18.0 * math.log10(max(12.0 * depth / coefficient, case.numerics.bank_argument_minimum))
    return coefficient


# Share of a prior without bounds that lies beyond what counts as its end [-].
TAIL = 1e-3
# Share of the even ground under water from which on a floodplain, or a second surface, carries a stream of its own [-].
# Chosen, not measured.
LEAST_STREAM = 0.1
# Cases whose scales are kept: one, its children and those of held-out experiments.
SCALES_KEPT = 16
_kept: OrderedDict[tuple[float, ...], tuple[tuple[object, ...], SiteScales]] = OrderedDict()


def site_scales(case: Case, site: Site | None = None) -> SiteScales:
    """h, U = Q / A and u* = (g h S)^(1/2) of a case, means over its experiments; h the median depth on the floor.

    With a water surface parallel to the floor, as `expected_depth` has it, and S the slope of the bed if Manning's n or
    the roughness between the ends of its prior can balance it, else S = (U / (C h^(1/2)))^2 of the middle of the prior.
    Kept for the parts of the case and the priors on which they depend, which its children and its coarser grids share.

    Parameters
    ----------
    site : Site, optional
        On its grid, if it is at hand.
    """
    of_floor, stands = case.friction.classes[case.friction.default], case.plants.stands.values()
    values = [of_floor.coefficient, case.eddy_viscosity, *(one.canopy_height for one in stands)]
    for setting in case.experiments.values():
        values += [setting.level, *setting.discharge.values()]
    priors = [case.parameters[value] for value in values if isinstance(value, str)]
    parts = (case.bed, case.experiments, case.friction, case.plants, case.eddy_viscosity, *priors)
    key = (case.numerics.bank_argument_minimum, *map(id, parts))
    if kept := _kept.get(key):
        return kept[1]
    site = build_site(case) if site is None else site
    depths, means, speeds, discharges = [], [], [], []
    banks, kinds = _beyond_floor(site), np.zeros(2 * len(site.class_names))
    for name, experiment in case.experiments.items():
        here = in_experiment(site, name)
        of_cells = np.maximum(expected_depth(case, here, experiment), 0.0)
        beyond, even = _beyond_floor(here), (_side_slope(here) <= BANK_SLOPE) & (of_cells > 0.0)
        kinds += np.bincount((2 * here.friction_class + beyond)[even], minlength=kinds.size)
        floor = np.where(beyond, 0.0, of_cells)
        wet = (of_cells > 0.0).sum(axis=1)
        area, columns = of_cells.sum(axis=1) * site.grid.dy, wet > 0
        on_floor = floor[floor > 0.0]
        if not columns.any() or not on_floor.size:
            continue
        discharge = sum(middle_value(case, value) for value in experiment.discharge.values())
        discharges.append(discharge)
        depths.append(float(np.median(on_floor)))
        means.append(float(np.median(area[columns] / (wet[columns] * site.grid.dy))))
        speeds.append(discharge / float(np.median(area[columns])))
    width = half_width(site)
    depth = float(np.mean(depths)) if depths else width
    speed = max(float(np.mean(speeds)) if speeds else 1.0, 1e-3 * (GRAVITY * depth) ** 0.5)
    slopes = []
    for share in (0.0, 0.5, 1.0):
        coefficient = value_at(case, of_floor.coefficient, share)
        if not 0.0 < coefficient < np.inf:  # a prior without bounds
            coefficient = value_at(case, of_floor.coefficient, min(max(share, TAIL), 1.0 - TAIL))
        slopes.append((speed / (chezy(case, of_floor, coefficient, depth) * depth**0.5)) ** 2)
    slopes.sort()
    level = (site.bed * ~banks).sum(axis=1) / np.maximum((~banks).sum(axis=1), 1)
    has_floor = (~banks).any(axis=1)
    fall = -float(np.polyfit(site.grid.x[has_floor], level[has_floor], 1)[0]) if has_floor.sum() > 1 else 0.0
    slope = fall if slopes[0] <= fall <= slopes[2] else slopes[1]
    surveys = [layer.survey for layer in case.bed if layer.survey is not None]
    of_points = [sum(one.chance * one.point_error for one in survey.covariances) for survey in surveys]
    heights = [middle_value(case, one.canopy_height) for one in stands]
    patches = [site.patch == index for index in np.unique(site.patch[site.patch >= 0])]
    lengths = [float(one.any(axis=1).sum() * site.grid.dx) for one in patches]
    widths = [float(one.any(axis=0).sum() * site.grid.dy) for one in patches]
    found = SiteScales(
        depth=depth,
        mean_depth=float(np.mean(means)) if means else depth,
        half_width=width,
        speed=speed,
        shear_velocity=(GRAVITY * depth * slope) ** 0.5,
        slope=slope,
        slope_error=max(of_points) / (case.grid.x[1] - case.grid.x[0]) if of_points else SLOPE_ERROR * slope,
        discharge=float(np.mean(discharges)) if discharges else speed * depth * width,
        viscosity=middle_value(case, case.eddy_viscosity),
        canopy=float(np.median(heights)) if heights else 0.5 * depth,
        patch_length=float(np.median(lengths)) if lengths else 2.0 * width,
        patch_width=float(np.median(widths)) if widths else width,
        banks=bool(banks.any()),
        two_streams=bool(np.sort(kinds)[-2] >= LEAST_STREAM * max(kinds.sum(), 1.0)),
    )
    _kept[key] = (parts, found)  # with the parts, whose identities are theirs as long as they are kept
    while len(_kept) > SCALES_KEPT:
        _kept.popitem(last=False)
    return found
