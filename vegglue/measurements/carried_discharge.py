"""What the velocities of each section carry beside the stated discharge, and how well that is known.

Nothing is solved for it: it asks for velocities, the bed, and levels. A model has to let the stated discharge through,
so where the sections carry another one, whatever is missing in it is found in the wrong place.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.case.case_effects import effect_of
from vegglue.case.channel_geometry import discharges_upstream_of, expected_depth
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.parameter_space import Bounds, middle_value, prior_range
from vegglue.case.schema import Case, Experiment
from vegglue.measurements.kinds import STREAMWISE, WATER_LEVEL
from vegglue.measurements.plausible_flow import plausible_flow
from vegglue.measurements.section_discharge import CrossSection, conveyance_weights, neighbour_error
from vegglue.normal_range import NORMAL95

# Strips that each cell is cut into across a section, and water shallower than which tells no velocity there [m].
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
# Effects of the library with which another discharge passes a section than stated.
CHANGE_DISCHARGE = ("discharge_error", "lateral_inflow", "unlisted_inflow")
# Standard errors beyond which a section carries another discharge than stated: sections are many, and a stated error
# may be half of the true one. Chosen, with the open cases and drawn sites at hand: where no more water really passed,
# their 244 sections lie within 1.2.
SURELY_OTHERWISE = 3.0


@dataclass(frozen=True)
class CarriedDischarge:
    """What the verticals of one section carry.

    x: of the section [m]; value, and interval95 of it [m3/s]; stated: what has entered upstream, 95 % of its priors
    [m3/s], None where that is not known; share: of the wet width that lies between the outermost verticals [-];
    verticals: how many there are; gauged: whether the level was measured.
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
        """What it carries over what is stated [-]; NaN where that is not known."""
        return self.value / (0.5 * sum(self.stated)) if self.stated else float("nan")

    @property
    def clearly_off(self) -> bool:
        """Whether the stated discharge lies beyond SURELY_OTHERWISE standard errors, on the side on which it does."""
        if self.stated is None:
            return False
        low, high = (self.value + SURELY_OTHERWISE / NORMAL95 * (end - self.value) for end in self.interval95)
        return low > self.stated[1] or high < self.stated[0]


def carried_discharges(case: Case, site: Site, station: pd.DataFrame) -> list[CarriedDischarge]:
    """Of each section with FEWEST_VERTICALS, in the order of the table.

    station: a table of stations, columns as in Observations.table [SI].
    """
    used = station[station["used"].astype(bool)]
    velocity = used[(used["kind"] == STREAMWISE) & (used["section"].astype(str) != "")]
    found = []
    for (experiment, section), rows in velocity.groupby(["experiment", "section"], sort=False):
        if np.ptp(rows["x"]) <= np.ptp(rows["y"]):
            own = used[(used["experiment"] == experiment) & (used["kind"] == WATER_LEVEL)]
            found.append(_carried(case, in_experiment(site, str(experiment)), str(experiment), str(section), rows, own))
    return [one for one in found if one is not None]


def _carried(
    case: Case, site: Site, experiment: str, section: str, rows: pd.DataFrame, gauges: pd.DataFrame
) -> CarriedDischarge | None:
    """None where fewer than FEWEST_VERTICALS stand in the water, or nothing passes them."""
    x = float(rows["x"].median())
    level, around = _level_at(case, site, experiment, rows, gauges)
    whole = _summed(site, x, rows, level)
    if whole is None or whole.value <= 0.0:
        return None
    lower, higher = (_summed(site, x, rows, one) for one in around)
    by_level = [0.0 if one is None else abs(one.value - whole.value) for one in (lower, higher)]
    low, high = (float(np.hypot(NORMAL95 * whole.error, off)) for off in by_level)
    return CarriedDischarge(
        experiment=experiment,
        section=section,
        x=x,
        value=whole.value,
        interval95=(whole.value - low, whole.value + high),
        stated=_stated(case, case.experiments[experiment], x),
        share=whole.share,
        verticals=whole.verticals,
        gauged=len(gauges) > 0 or _surface_given(case, experiment, section),
    )


def _stated(case: Case, experiment: Experiment, x: float) -> Bounds | None:
    given = discharges_upstream_of(case, experiment, x)
    if given is None:
        return None
    parts = [prior_range(case, value) for value in given]
    return sum(low for low, _ in parts), sum(high for _, high in parts)


def changing_discharge(case: Case, experiment: str, x: float) -> str:
    """The key of an effect of the case by which another discharge than stated passes x [m]; '' for none."""
    for name, entry in case.effects.items():
        place = entry.values.get("x")
        is_below = not isinstance(place, str) and place is not None and place > x
        acts = entry.experiments is None or experiment in entry.experiments
        if effect_of(case, name).name in CHANGE_DISCHARGE and acts and not is_below:
            return name
    return ""


@dataclass(frozen=True)
class _Sum:
    """Discharge of a section under one level and its standard error but for that of the level [m3/s]."""

    value: float
    error: float
    share: float
    verticals: int


def _summed(site: Site, x: float, rows: pd.DataFrame, level: float) -> _Sum | None:
    """Q = sum_i w_i u_i, see `conveyance_weights`, and s^2 = max(sampling, spacing)^2 + few^2 + banks^2 + shared^2."""
    cross = _cross_section(site, x, level)
    measured = rows.groupby("y", as_index=False)[["value", "standard_error"]].mean()
    depth = np.interp(measured["y"], cross.y, cross.depth)
    wet = measured[depth > SHALLOWEST]
    if len(wet) < FEWEST_VERTICALS:
        return None
    y, u = wet["y"].to_numpy(float), wet["value"].to_numpy(float)
    weights = conveyance_weights(cross, y, depth[depth > SHALLOWEST])
    value = float(weights @ u)
    sampling = float(np.linalg.norm(weights * wet["standard_error"].fillna(0.0)))
    spacing = neighbour_error(y, u) * float(np.linalg.norm(weights))
    within = (cross.y >= y[0]) & (cross.y <= y[-1])
    through = np.interp(cross.y, y, u / np.sqrt(depth[depth > SHALLOWEST])) * cross.depth**1.5 * cross.width
    banks = OF_BANKS * float(np.abs(through[~within]).sum())
    own = abs(value) * float(np.hypot(OF_FEW_VERTICALS / len(wet), SHARED_ERROR))
    error = float(np.linalg.norm([np.fmax(sampling, spacing), banks, own]))
    share = float((cross.depth[within] > 0.0).sum() / (cross.depth > 0.0).sum())
    return _Sum(value, error, share, len(wet))


def _cross_section(site: Site, x: float, level: float) -> CrossSection:
    """Strips across the grid at the column of cells nearest to x [m]."""
    grid = site.grid
    step = grid.dy / STRIPS
    y = grid.y[0] - 0.5 * grid.dy + step * (np.arange(STRIPS * grid.y.size) + 0.5)
    return CrossSection(y, np.interp(y, grid.y, site.bed[_column(site, x)]), level)


def _column(site: Site, x: float) -> int:
    return int(np.abs(site.grid.x - x).argmin())


def _surface_given(case: Case, experiment: str, section: str) -> bool:
    """Whether the case states the level of the section, beside its verticals."""
    return any(
        one.surface is not None and (one.experiment, one.section) == (experiment, section) for one in case.observations
    )


def _level_at(
    case: Case, site: Site, experiment: str, rows: pd.DataFrame, gauges: pd.DataFrame
) -> tuple[float, Bounds]:
    """Water level of a section, and 95 % of what it may be [m]: as stated beside its verticals, else between gauges and
    outlet, else parallel to the floor, where it may be as low as smooth walls and as high as the thickest growth make
    it. Beyond the first gauge it falls as the floor does, give or take all of that.
    """
    column, setting = _column(site, float(rows["x"].median())), case.experiments[experiment]
    if _surface_given(case, experiment, str(rows["section"].iloc[0])):
        level = float((rows["depth"] + np.interp(rows["y"], site.grid.y, site.bed[column])).median())
        return level, (level, level)
    if gauges.empty:
        level = float((expected_depth(case, site, setting) + site.bed)[column, 0])
        flow = plausible_flow(case, site, setting)
        return level, (min(float(flow.smoothest[column]), level), max(float(flow.thickest[column]), level))
    return _between_gauges(case, site, setting, column, gauges)


def _between_gauges(
    case: Case, site: Site, setting: Experiment, column: int, gauges: pd.DataFrame
) -> tuple[float, Bounds]:
    """The level and what it may be, linear between gauges and outlet; beyond the first gauge it falls as the floor."""
    at, along, floor = gauges.groupby("x")["value"].mean(), site.grid.x, site.bed.min(axis=1)
    x, z = (np.array([*given, end]) for given, end in ((at.index, along[-1]), (at, middle_value(case, setting.level))))
    beyond = along[column] < x[0]
    fall = max(float(floor[column] - floor[_column(site, float(x[0]))]), 0.0) if beyond else 0.0
    level = float(np.interp(along[column], x, z)) + fall
    error = fall + NORMAL95 * float(gauges["standard_error"].fillna(0.0).max())
    return level, (level - error, level + error)
