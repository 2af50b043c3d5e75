"""Cross-sections: from verticals to the discharge through them, and how it compares with the stated discharge.

Two rules, linear interpolation (`paper`) and fitted profiles (`profile`), are linear in what was measured: they are
written as weights, and errors follow exactly. `carried_discharges` needs no profiles, only averages of verticals, the
bed and levels; nothing is solved for it. A model has to let the stated discharge through, so if the sections carry
another one, whatever is missing in it is found in the wrong place.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.bed_error import bed_error_columns
from vegglue.case.case_effects import effect_of
from vegglue.case.channel_geometry import discharges_upstream_of, expected_depth
from vegglue.case.grid import Grid
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.parameter_space import Bounds, middle_value, prior_range
from vegglue.case.schema import Case, Experiment
from vegglue.measurements.kinds import STREAMWISE, WATER_LEVEL
from vegglue.measurements.plausibility import implausible_levels, implausible_values, plausible_flow
from vegglue.measurements.vertical_profile import Column, linear_weights
from vegglue.normal_range import NORMAL95

# Cells of the regular grid a section is summed on, along y and z [m].
GRID_STEP = 0.02
# Strips that each cell is cut into across a section, and water [m] too shallow for a velocity there.
STRIPS, SHALLOWEST = 10, 0.01
# Verticals without which a section is none.
FEWEST_VERTICALS = 2
# Standard error of a discharge by m verticals, F / m [-]: 4.5 % of ten, 2.3 % of twenty (ISO 748:2007, table E.6).
OF_FEW_VERTICALS = 0.45
# Standard error of what lies between the outermost verticals and the banks, over itself [-]: none or twice as much.
OF_BANKS = 0.5
# Standard error that all verticals of a section share [-]: of the probe, its direction, the bed and the levels. Chosen:
# hydrometry takes 2 to 3 %.
SHARED_ERROR = 0.03
# By how much the bed is raised for the slope of a discharge [m].
BED_STEP = 0.005
# Effects of the library with which another discharge passes a section than stated.
CHANGE_DISCHARGE = ("discharge_error", "lateral_inflow", "unlisted_inflow")
# Standard errors beyond which a section carries another discharge than stated: sections are many, and a stated error
# may be half of the true one. Chosen, with the open cases and drawn sites at hand: where no more water really passed,
# their 244 sections lie within 1.2.
SURELY_OTHERWISE = 3.0
# y [m], velocity and its standard error [m/s] of verticals (verticals,) each.
Verticals = tuple[Array, Array, Array]


@dataclass(frozen=True)
class CrossSection:
    """A section of regular cells under a flat water level.

    Attributes
    ----------
    y : ndarray (cells,)
        Middles of the cells across the channel [m].
    bed : ndarray (cells,)
        [m]
    surface : float
        Water level [m].
    """

    y: Array
    bed: Array
    surface: float

    @property
    def width(self) -> float:
        """Width of a cell [m]."""
        return float(self.y[1] - self.y[0])

    @property
    def depth(self) -> Array:
        """h = max(surface - bed, 0) (cells,) [m]."""
        return np.maximum(self.surface - self.bed, 0.0)


@dataclass(frozen=True)
class Discharge:
    """Discharge and its standard error [m3/s], see `combine`."""

    value: float
    standard_error: float


@dataclass(frozen=True)
class CarriedDischarge:
    """What the verticals of one section carry.

    Attributes
    ----------
    x : float
        Of the section [m].
    value : float
        Discharge [m3/s].
    interval95 : (float, float)
        Of the discharge [m3/s].
    stated : (float, float) or None
        What has entered upstream, 95 % of its priors [m3/s]; None if that is not known.
    share : float
        Of the wet width that lies between the outermost verticals [-].
    verticals : int
        Their number.
    gauged : bool
        Whether the level was measured.
    """

    experiment: str
    section: str
    x: float
    value: float
    interval95: Bounds
    stated: Bounds | None
    share: float
    verticals: int
    gauged: bool

    @property
    def ratio(self) -> float:
        """What it carries over what is stated [-]; NaN if that is not known."""
        return self.value / (0.5 * sum(self.stated)) if self.stated else float("nan")

    @property
    def excludes_stated(self) -> bool:
        """Whether the stated discharge lies outside the 95 % range."""
        return self._is_off_by(NORMAL95)

    @property
    def clearly_off(self) -> bool:
        """Whether the stated discharge lies beyond SURELY_OTHERWISE standard errors, on the side on which it does."""
        return self._is_off_by(SURELY_OTHERWISE)

    def _is_off_by(self, errors: float) -> bool:
        if self.stated is None:
            return False
        low, high = (self.value + errors / NORMAL95 * (end - self.value) for end in self.interval95)
        return low > self.stated[1] or high < self.stated[0]


@dataclass(frozen=True)
class DischargeMismatch:
    """Sections that clearly carry more than the stated discharge, or that all clearly carry less; at least one."""

    sections: tuple[CarriedDischarge, ...]

    @property
    def ratios(self) -> Bounds:
        """Smallest and largest of what the sections carry over what is stated [-]."""
        return min(one.ratio for one in self.sections), max(one.ratio for one in self.sections)

    @property
    def experiments(self) -> tuple[str, ...]:
        """Names of the experiments of the sections, each once."""
        return tuple(dict.fromkeys(one.experiment for one in self.sections))


def grid_weights(section: CrossSection, position: Array, columns: Sequence[Column], step: float) -> list[Array]:
    """w with Q = sum(w u): the rule `paper`.

    Points are interpolated linearly on a regular (y, z) grid of cells at most `step` high: upward in each vertical
    (zero at the bed, constant from the highest point to the surface), then across at each level between verticals, to
    zero where that level meets the bed or the bank. Q = sum of velocity x cell area.

    Parameters
    ----------
    position
        y of the verticals (columns,) [m].
    step
        Largest height of a grid cell [m].

    Returns
    -------
    list of array
        For each vertical (points,) [m2].

    References
    ----------
    Berends et al. (2020), section 3.1, which does not state the assumptions at the surface and at the banks.
    """
    lowest = float(section.bed.min())
    count = int(np.ceil((section.surface - lowest) / step))
    height = (section.surface - lowest) / count
    levels = lowest + height * (np.arange(count) + 0.5)
    bed = section.surface - np.array([column.depth for column in columns])
    # Width [m] over which each vertical counts at a level: the area under its hat function.
    widths = np.zeros((count, len(position)))
    for width, level in zip(widths, levels, strict=True):
        nodes = np.concatenate([position[bed < level], section.y[section.bed >= level]])
        order, cells = np.argsort(nodes), section.y[section.bed < level]
        for index in np.flatnonzero(bed < level):
            hat = (nodes == position[index]).astype(float)
            width[index] = section.width * np.interp(cells, nodes[order], hat[order]).sum()
    return [
        height * widths[:, index] @ (linear_weights(column.height, levels - bed[index]))
        for index, column in enumerate(columns)
    ]


def conveyance_weights(section: CrossSection, position: Array, depth: Array) -> Array:
    """w with Q = sum(w U): U / sqrt(h) is linear across, constant beyond the outermost verticals.

    Between the outermost vertical and the bank that is a constant Froude number, so that the velocity goes to zero with
    the depth.

    Parameters
    ----------
    position, depth
        y and water depth h of the verticals (columns,) [m].

    Returns
    -------
    array
        (columns,) [m2]

    References
    ----------
    Le Coz et al. (2012), doi 10.1016/j.flowmeasinst.2012.05.001.
    """
    flow = section.width * section.depth**1.5
    hats = [np.interp(section.y, position, unit) for unit in np.eye(len(position))]
    return np.array([float(flow @ hat) for hat in hats]) / np.sqrt(depth)


def neighbour_error(position: Array, average: Array) -> float:
    """s with s^2 = mean((U_i - sum_j w_j U_j)^2 / (1 + sum_j w_j^2)): the error of one vertical.

    The weights w predict U_i from its neighbours by the cubic through two on either side, or by the straight line
    through one on either side with fewer than five verticals. Smooth curvature across the channel then does not count
    as error; jumps, as at the edge of plants, do.

    Parameters
    ----------
    position
        y of the verticals (columns,) [m].
    average
        U (columns,) [m/s].

    Returns
    -------
    float
        [m/s]; NaN below three verticals.

    References
    ----------
    Cohn, Kiang and Mason (2013), doi 10.1061/(ASCE)HY.1943-7900.0000695: the interpolated variance estimator, which
    takes the straight line.
    """
    count = len(position)
    each_side = 2 if count >= 5 else 1
    if count < 3:
        return float("nan")
    squares = []
    for index in range(each_side, count - each_side):
        others = np.r_[index - each_side : index, index + 1 : index + each_side + 1]
        gaps, eye = position[others][:, None] - position[others], np.eye(2 * each_side)
        weights = np.prod(np.where(eye > 0.0, 1.0, position[index] - position[others]) / (gaps + eye), axis=1)
        squares.append((average[index] - weights @ average[others]) ** 2 / (1.0 + weights @ weights))
    return float(np.sqrt(np.mean(squares)))


def combine(value: float, sampling: float, spacing: float, rule: float) -> Discharge:
    """standard_error^2 = max(sampling, spacing)^2 + rule^2.

    Parameters
    ----------
    value
        Q [m3/s].
    sampling
        From the standard errors of the verticals [m3/s].
    spacing
        From how far each vertical lies from what its neighbours predict, which contains the sampling error [m3/s]; left
        out if NaN.
    rule
        From the profile assumed where nothing was measured [m3/s].
    """
    return Discharge(value, float(np.hypot(np.fmax(sampling, spacing), rule)))


def section_discharges(
    section: CrossSection, columns: Sequence[Column], good: pd.DataFrame, error: float
) -> dict[str, Discharge]:
    """Q = sum_i w_i u_i by both rules, from the verticals that are used.

    Parameters
    ----------
    good : DataFrame
        Their profiles, rows of Observations.profiles.
    error
        Of one vertical, estimated from its neighbours [m/s].

    Returns
    -------
    dict of str to Discharge
        By rule.
    """
    position, scatter = good["y"].to_numpy(), good["scatter"].fillna(1.0)
    grid = grid_weights(section, position, columns, GRID_STEP)
    paper = sum(float(weights @ column.velocity) for weights, column in zip(grid, columns, strict=True))
    errors = [
        factor * float(np.linalg.norm(weights * column.standard_error))
        for weights, column, factor in zip(grid, columns, scatter, strict=True)
    ]
    area = conveyance_weights(section, position, good["depth"].to_numpy())
    profile = float(area @ good["fitted"].to_numpy())
    spacing = error * float(np.linalg.norm(area))
    return {
        "paper": combine(paper, float(np.linalg.norm(errors)), spacing, abs(paper - profile) / float(np.sqrt(3.0))),
        "profile": combine(profile, float(np.linalg.norm(area * good["fitted_error"].to_numpy())), spacing, 0.0),
    }


def carried_discharges(case: Case, site: Site, station: pd.DataFrame) -> list[CarriedDischarge]:
    """Q = sum_i w_i U_i of each section across the channel, see `conveyance_weights`.

    Parameters
    ----------
    station : DataFrame
        As Observations.table [SI]; levels that their experiment cannot have are left out.

    Returns
    -------
    list of CarriedDischarge
        In the order of the table; none with fewer than FEWEST_VERTICALS in the water.
    """
    used = station[station["used"] & ~implausible_levels(case, site, station)]
    velocity = used[(used["kind"] == STREAMWISE) & (used["section"] != "")]
    found = []
    for (experiment, section), rows in velocity.groupby(["experiment", "section"], sort=False):
        if np.ptp(rows["x"]) <= np.ptp(rows["y"]):
            name, own = str(experiment), used[(used["experiment"] == experiment) & (used["kind"] == WATER_LEVEL)]
            found.append(_carried_discharge(case, in_experiment(site, name), name, str(section), rows, own))
    return [one for one in found if one is not None]


def mismatched_discharges(case: Case, site: Site, station: pd.DataFrame) -> list[CarriedDischarge]:
    """Sections that clearly carry another discharge than stated, and whose discharge no effect of the case changes.

    Parameters
    ----------
    case, site, station
        As `carried_discharges`.

    Returns
    -------
    list of CarriedDischarge
        Empty beside values that no flow can have.
    """
    off = [
        one
        for one in carried_discharges(case, site, station)
        if one.clearly_off and not changing_discharge(case, one.experiment, one.x)
    ]
    return [] if off and implausible_values(case, site, station) else off


def discharge_mismatches(off: Sequence[CarriedDischarge]) -> list[DischargeMismatch]:
    """Sections that carry another discharge than stated, those that carry more together and then those with less.

    Parameters
    ----------
    off : sequence of CarriedDischarge
        Of `mismatched_discharges`.
    """
    groups = [one for one in off if one.ratio > 1.0], [one for one in off if one.ratio <= 1.0]
    return [DischargeMismatch(tuple(group)) for group in groups if group]


def changing_discharge(case: Case, experiment: str, x: float) -> str:
    """The key of an effect of the case by which another discharge than stated passes a section; '' for none.

    Parameters
    ----------
    x : [m]
        Of the section.
    """
    for name, entry in case.effects.items():
        place = entry.values.get("x")
        is_below = not isinstance(place, str) and place is not None and place > x
        acts = entry.experiments is None or experiment in entry.experiments
        if effect_of(case, name).name in CHANGE_DISCHARGE and acts and not is_below:
            return name
    return ""


def level_by_gauges(case: Case, setting: Experiment, gauges: pd.DataFrame, x: float) -> tuple[float, float]:
    """Water level at x, linear between the gauges of an experiment and the outlet; level at the first gauge upstream of
    it, where z = z_gauge + S (x_gauge - x), S `fall_of_floor`.

    Parameters
    ----------
    gauges : DataFrame
        Its stations of measured levels, one at least.
    x : float
        [m]

    Returns
    -------
    float, float
        The level [m], and how far upstream of all gauges x lies [m].
    """
    measured, end = gauges.groupby("x")["value"].mean(), case.grid.x[1]
    at, z = measured.index.to_numpy(float), measured.to_numpy(float)
    if at[-1] < end:
        at, z = np.append(at, end), np.append(z, middle_value(case, setting.level))
    return float(np.interp(x, at, z)), max(float(at[0]) - x, 0.0)


def fall_of_floor(x: Array, floor: Array) -> float:
    """S = -dz/dx of the line through the lowest beds of sections, at least 0 [-]: a pool is no slope.

    Parameters
    ----------
    x, floor : ndarray (sections,)
        [m]
    """
    return max(-float(np.polyfit(x, floor, 1)[0]), 0.0)


def _carried_discharge(
    case: Case, site: Site, experiment: str, section: str, rows: pd.DataFrame, gauges: pd.DataFrame
) -> CarriedDischarge | None:
    """None if fewer than FEWEST_VERTICALS stand in the water, or nothing passes them.

    The level is that stated beside the verticals, else by the gauges, else parallel to the floor, and as low as smooth
    walls or as high as the thickest growth make it.
    """
    x, setting = float(rows["x"].median()), case.experiments[experiment]
    column = int(np.abs(site.grid.x - x).argmin())
    surface_given = any(
        one.surface is not None and (one.experiment, one.section) == (experiment, section) for one in case.observations
    )
    if surface_given:
        level = float((rows["depth"] + np.interp(rows["y"], site.grid.y, site.bed[column])).median())
        around = level, level
    elif gauges.empty:
        level = float((expected_depth(case, site, setting) + site.bed)[column, 0])
        flow = plausible_flow(case, site, setting)
        around = min(float(flow.smoothest[column]), level), max(float(flow.thickest[column]), level)
    else:
        level, upstream = level_by_gauges(case, setting, gauges, float(site.grid.x[column]))
        rise = upstream * fall_of_floor(site.grid.x, site.bed.min(axis=1))  # give or take that
        level += rise
        error = rise + NORMAL95 * float(gauges["standard_error"].fillna(0.0).max())
        around = level - error, level + error
    grid, bed = site.grid, site.bed[column]
    mean = rows.groupby("y", as_index=False)[["value", "standard_error"]].mean()
    measured = (mean["y"].to_numpy(float), mean["value"].to_numpy(float), mean["standard_error"].fillna(0.0).to_numpy())
    whole = _velocity_area(grid, bed, measured, level)
    if whole is None or whole[0] <= 0.0:
        return None
    value, error, share, verticals = whole
    # s_bed = |sum_j dQ/dz_j B_j|, B the columns of the error of the surveyed bed of each cell j across.
    of_bed = bed_error_columns(case, replace(grid, x=grid.x[[column]]), experiment)
    if of_bed.any():
        lower = (_passing(grid, bed + BED_STEP * unit, measured, level)[2].sum() for unit in np.eye(bed.size))
        slope = np.nan_to_num([(one - value) / BED_STEP for one in lower])
        error = float(np.hypot(error, np.linalg.norm(slope @ of_bed)))
    ends = (float(_passing(grid, bed, measured, one)[2].sum()) for one in around)
    low, high = (float(np.hypot(NORMAL95 * error, np.nan_to_num(abs(one - value)))) for one in ends)
    given = discharges_upstream_of(case, setting, x)
    parts = [prior_range(case, one) for one in given or ()]
    return CarriedDischarge(
        experiment=experiment,
        section=section,
        x=x,
        value=value,
        interval95=(value - low, value + high),
        stated=None if given is None else (sum(low for low, _ in parts), sum(high for _, high in parts)),
        share=share,
        verticals=verticals,
        gauged=len(gauges) > 0 or surface_given,
    )


def _passing(grid: Grid, bed: Array, measured: Verticals, level: float) -> tuple[CrossSection, Array, Array]:
    """The section of a column of cells with this bed (ny,) [m], depths [m] at the verticals, and the discharge of each
    strip of the section [m3/s], see `conveyance_weights`; NaN below FEWEST_VERTICALS in the water.
    """
    step = grid.dy / STRIPS
    y = grid.y[0] - 0.5 * grid.dy + step * (np.arange(STRIPS * grid.y.size) + 0.5)
    cross = CrossSection(y, np.interp(y, grid.y, bed), level)
    depth = np.interp(measured[0], cross.y, cross.depth)
    wet = depth > SHALLOWEST
    if wet.sum() < FEWEST_VERTICALS:
        return cross, depth, np.full(y.size, np.nan)
    rate = np.interp(y, measured[0][wet], measured[1][wet] / np.sqrt(depth[wet]))
    return cross, depth, rate * cross.depth**1.5 * cross.width


def _velocity_area(grid: Grid, bed: Array, measured: Verticals, level: float) -> tuple[float, float, float, int] | None:
    """Q = sum_i w_i u_i, see `conveyance_weights`, and s^2 = max(sampling, spacing)^2 + few^2 + banks^2 + shared^2.

    Q and s but for the errors of level and bed [m3/s]; share of the wet width between the outermost verticals [-]; how
    many; None below FEWEST_VERTICALS.
    """
    cross, depth, through = _passing(grid, bed, measured, level)
    wet = depth > SHALLOWEST
    y, u, own = (values[wet] for values in measured)
    if y.size < FEWEST_VERTICALS:
        return None
    value, weights = float(through.sum()), conveyance_weights(cross, y, depth[wet])
    sampling = float(np.linalg.norm(weights * own))
    spacing = neighbour_error(y, u) * float(np.linalg.norm(weights))
    within = (cross.y >= y[0]) & (cross.y <= y[-1])
    banks = OF_BANKS * float(np.abs(through[~within]).sum())
    few = abs(value) * float(np.hypot(OF_FEW_VERTICALS / y.size, SHARED_ERROR))
    error = float(np.linalg.norm([np.fmax(sampling, spacing), banks, few]))
    return value, error, float((cross.depth[within] > 0.0).sum() / (cross.depth > 0.0).sum()), y.size
