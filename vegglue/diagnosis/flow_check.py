"""Checks of the flow: boundaries, outlet level, Froude number, and the directions and the discharge of measurements.

Each check yields remarks, frozen values whose words stand in `wording/templates/checks.j2`. One cause is one remark
of all experiments that show it, and what follows from it is left out. Lengths in m.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.channel_geometry import chezy, discharges_upstream_of, expected_depth, half_width
from vegglue.case.grid import curvature_of
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.parameter_space import middle_value, prior_range
from vegglue.case.schema import Case, Experiment
from vegglue.case.zones import centres_within, inflow_cells
from vegglue.effects.physical_constants import GRAVITY
from vegglue.measurements.kinds import STREAMWISE, THROUGH_SECTION, TRANSVERSE, WATER_LEVEL, kind_of
from vegglue.measurements.observations import Observations
from vegglue.measurements.plausibility import implausible_values
from vegglue.measurements.section_discharge import (
    SURELY_OTHERWISE,
    CarriedDischarge,
    DischargeMismatch,
    carried_discharges,
    changing_discharge,
    discharge_mismatches,
    fall_of_floor,
    mismatched_discharges,
)
from vegglue.normal_range import NORMAL95

# Width of the grid over the radius of its centreline [-] from which its ends should be straight: chosen, not measured.
LEAST_TURN = 0.02
# Froude number [-] of an outlet above which its level may not hold: chosen, not measured. At 1 no wave carries the
# level upstream; 0.7 leaves room for the fastest part of a section, some 1.4 times as fast as its mean.
LARGEST_FROUDE = 0.7
# Halvings and more of the error of the depth, whatever it began at: each multiplies it by less than 2/3.
ROUNDS = 60
# Fewest stations that stand for a whole section: two may stand in an eddy.
FEWEST_OF_A_SECTION = 3
# Rise of the water downstream [m], and over its standard error [-], from which levels run uphill: velocity heads,
# which a widening gives back, are 5 mm at 0.3 m/s.
RISE, SURE = 0.01, 4.0
# Rise [m] that gauges and the level of an outlet may show by chance, beside so many standard errors [-]. Chosen:
# a bed that is uneven by millimetres, and a surface that waves.
RISE_BY_CHANCE, SURE_OF_A_RISE = 0.003, 3.0
# Velocity head of a section over that of its mean velocity [-]: 1.15 to 1.5 in streams (Chow 1959, table 2-1).
UNEVENNESS = 1.5
# Angle [degrees] of turned velocities, and over its standard error over the sections [-]. Chosen: declinations in
# Europe reach some degrees; a section beside the end of a patch in a flume was off by 1.6.
LEAST_ANGLE, SURE_OF_AN_ANGLE = 3.0, 3.0
# The same of one probe beside its neighbours: many positions are tried.
SURE_OF_A_PROBE = 6.0
# Fewest sections that show a turn: two may both stand where a patch drives water aside. Share of them on one side [-].
FEWEST_CROSSED, MOST_ON_ONE_SIDE = 3, 0.9
# Fewest places of a section whose mean is that of the section.
FEWEST_OF_A_MEAN = 3


@dataclass(frozen=True)
class DischargeUnlike:
    """A measured discharge that all sections contradict.

    Attributes
    ----------
    x : float
        Where it was measured [m].
    value : float
        [m3/s]
    nearest : CarriedDischarge
        What the nearest of these sections carries.
    """

    experiment: str
    x: float
    value: float
    nearest: CarriedDischarge


@dataclass(frozen=True)
class GridEndInBend:
    """A grid that begins (upstream) or ends where its centreline turns with a radius [m]: u is even there, and the
    level at the outlet too.
    """

    upstream: bool
    radius: float


@dataclass(frozen=True)
class OutletWithoutCells:
    """An outlet without a cell centre."""


@dataclass(frozen=True)
class OutletDry:
    """An experiment whose outlet level lies below all of the bed there.

    Attributes
    ----------
    level, bed : float
        At the outlet, and the lowest of its bed [m].
    measured : bool
        Whether anything was measured in it.
    """

    experiment: str
    level: float
    bed: float
    measured: bool


@dataclass(frozen=True)
class OutletFast:
    """An experiment that leaves near the critical Froude number [-]."""

    experiment: str
    froude: float


@dataclass(frozen=True)
class WaterOnSideEdges:
    """An experiment with water on the side edges of the grid, which act as smooth walls."""

    experiment: str


@dataclass(frozen=True)
class InflowWithoutCells:
    """An inflow without a cell centre."""

    inflow: str


@dataclass(frozen=True)
class InflowAboveWater:
    """An inflow above the water of an experiment."""

    inflow: str
    experiment: str


@dataclass(frozen=True)
class Supercritical:
    """An experiment whose even flow without plants is supercritical.

    Attributes
    ----------
    slope : float
        Of the floor [-].
    froude : float
        Froude number on it [-].
    """

    experiment: str
    slope: float
    froude: float


@dataclass(frozen=True)
class OutletAboveGauge:
    """Outlets above the last gauge by more than the velocity lifts the water.

    Attributes
    ----------
    x : float
        Of the gauge [m].
    distance : float
        By which it lies upstream of the outlet [m].
    gauges : tuple of (str, float, float)
        Experiment, level of the gauge, rise from it to the outlet [m].
    """

    x: float
    distance: float
    gauges: tuple[tuple[str, float, float], ...]


@dataclass(frozen=True)
class ComponentsExchanged:
    """Experiments with more water across than along.

    Attributes
    ----------
    along, across : float
        Median |u| and |v| of the first [m/s].
    """

    experiments: tuple[str, ...]
    along: float
    across: float


@dataclass(frozen=True)
class FlowUpstream:
    """Experiments whose velocities run upstream.

    Attributes
    ----------
    median : float
        Of the first [m/s].
    on_centreline : bool
        Whether the grid follows a centreline.
    """

    experiments: tuple[str, ...]
    median: float
    on_centreline: bool


@dataclass(frozen=True)
class SectionsUpstream:
    """Sections of an experiment whose velocities all run upstream, at a mean [m/s]."""

    experiment: str
    sections: tuple[str, ...]
    mean: float


@dataclass(frozen=True)
class LevelsRiseDownstream:
    """Experiments whose water rises downstream.

    Attributes
    ----------
    rises : tuple of float
        Of each [m].
    first, last : float
        x of the gauges between which it does [m].
    """

    experiments: tuple[str, ...]
    rises: tuple[float, ...]
    first: float
    last: float


@dataclass(frozen=True)
class VelocitiesTurned:
    """Experiments whose velocities are turned to one side at nearly all sections, as no water between two banks is.

    Attributes
    ----------
    angles : tuple of float
        Mean of each experiment to that side [degrees].
    sections : int
        How many.
    others : tuple of (str, float)
        Experiment and angle [degrees] of those that share sections and are not turned.
    """

    side: str
    experiments: tuple[str, ...]
    angles: tuple[float, ...]
    sections: int
    others: tuple[tuple[str, float], ...]


def remarks_on_boundaries(case: Case, site: Site) -> Iterator[object]:
    """Inflows and outlets without cells or without water, water on edges that act as walls, ends in a bend."""
    curvature = curvature_of(site.grid)
    for turning, upstream in ((curvature[0], True), (curvature[-1], False)):
        if abs(turning) * site.grid.y.size * site.grid.dy > LEAST_TURN:
            yield GridEndInBend(upstream, 1.0 / abs(float(turning)))
    dry, open_ = dry_outlets(case, site), centres_within(case.outlet.range, site.grid.y)
    if not open_.any():
        yield OutletWithoutCells()
    cells = {inflow: inflow_cells(side, site.grid) for inflow, side in case.inflows.items()}
    yield from (InflowWithoutCells(inflow) for inflow, some in cells.items() if not some.size)
    for name, experiment in case.experiments.items():
        if name in dry:
            continue
        depth = expected_depth(case, in_experiment(site, name), experiment)
        if open_.any():  # Fr = Q / (A sqrt(g A / B))
            wet = np.maximum(depth[-1, open_], 0.0)
            area, top = float(wet.sum()) * site.grid.dy, float((wet > 0).sum()) * site.grid.dy
            froude = _discharge(case, experiment) / (area * float(np.sqrt(GRAVITY * area / top)))
            if froude > LARGEST_FROUDE:
                yield OutletFast(name, froude)
        if case.friction.walls is None and (depth[:, [0, -1]] > 0).any():
            yield WaterOnSideEdges(name)
        for inflow, side in case.inflows.items():
            edge = {"west": depth[0], "south": depth[:, 0], "north": depth[:, -1]}[side.side]
            if cells[inflow].size and not (edge[cells[inflow]] > 0).any():
                yield InflowAboveWater(inflow, name)


def _discharge(case: Case, experiment: Experiment) -> float:
    """Of all inflows, in the middle of the prior [m3/s]."""
    return sum(middle_value(case, value) for value in experiment.discharge.values())


def dry_outlets(case: Case, site: Site) -> dict[str, float]:
    """Experiments whose outlet level lies below all of the bed there.

    Parameters
    ----------
    case : Case
        Of a prior the middle counts.

    Returns
    -------
    dict of float
        The lowest bed at the outlet by experiment [m].
    """
    open_ = centres_within(case.outlet.range, site.grid.y)
    if not open_.any():
        return {}
    lowest = {name: float(in_experiment(site, name).bed[-1, open_].min()) for name in case.experiments}
    return {name: bed for name, bed in lowest.items() if middle_value(case, case.experiments[name].level) <= bed}


def remarks_on_dry_outlets(case: Case, site: Site, observations: Observations) -> Iterator[OutletDry]:
    """Outlets below the bed, for which no command finds a flow, whether or not anything was measured."""
    for name, bed in dry_outlets(case, site).items():
        measured = bool((observations.table["experiment"] == name).any())
        yield OutletDry(name, middle_value(case, case.experiments[name].level), bed, measured)


def remarks_on_discharges(case: Case, site: Site, observations: Observations) -> Iterator[DischargeMismatch]:
    """Sections whose velocities clearly carry another discharge than stated; none of an experiment whose velocities or
    levels run the wrong way, as that is why.
    """
    off, excused = mismatched_discharges(case, site, observations.table), _misdirected(case, observations)
    yield from discharge_mismatches([one for one in off if one.experiment not in excused])


def remarks_on_measured_discharges(case: Case, site: Site, observations: Observations) -> Iterator[DischargeUnlike]:
    """|Q - Q_s| > SURELY_OTHERWISE (se^2 + se_s^2)^(1/2)

    Parameters
    ----------
    observations : Observations
        Q, se: of the measured discharges.

    Yields
    ------
    DischargeUnlike
        If all sections past which the same water flows carry another Q_s. None of an experiment whose velocities run
        the wrong way, or beside values that no flow can have.
    """
    table, excused = observations.table, _misdirected(case, observations)
    rows = table[table["used"] & (table["kind"] == THROUGH_SECTION) & ~table["experiment"].isin(list(excused))]
    if rows.empty or implausible_values(case, site, table):
        return
    carried = carried_discharges(case, site, table)
    for row in rows.itertuples():
        name, x, value = str(row.experiment), float(row.x), float(row.value)
        stated = case.experiments[name]
        own, error = discharges_upstream_of(case, stated, x), float(np.nan_to_num(row.standard_error))
        alike = [
            one
            for one in carried
            if one.experiment == name
            and own is not None
            and discharges_upstream_of(case, stated, one.x) == own
            and not changing_discharge(case, name, max(x, one.x))
        ]
        off = [
            (value - one.value) / math.hypot(error, 0.5 * (one.interval95[1] - one.interval95[0]) / NORMAL95)
            for one in alike
        ]
        if off and (min(off) > SURELY_OTHERWISE or max(off) < -SURELY_OTHERWISE):
            yield DischargeUnlike(name, x, value, min(alike, key=lambda one: abs(one.x - x)))


def remarks_on_steep_flow(case: Case, site: Site) -> Iterator[Supercritical]:
    """Experiments whose even flow on the slope of the floor would be supercritical."""
    slope = fall_of_floor(site.grid.x, site.bed.min(axis=1))
    for name, experiment in case.experiments.items():
        froude = even_froude(case, site, experiment, slope)
        if froude > 1.0:
            yield Supercritical(name, slope, froude)


def even_froude(case: Case, site: Site, experiment: Experiment, slope: float) -> float:
    """Fr = C (S/g)^(1/2) of even flow on the floor, C at its depth h = (q / (C S^(1/2)))^(2/3)

    Parameters
    ----------
    experiment : Experiment
        Whose whole discharge over the width of the floor is q, as if there were neither banks nor plants.
    slope : float
        S [-].

    Returns
    -------
    float
        Fr [-], with C [m^(1/2)/s] of the friction class along most of the lowest line of the bed; 0 without a fall.
    """
    if slope <= 0.0:
        return 0.0
    per_width = _discharge(case, experiment) / (2.0 * half_width(site))
    lowest = site.friction_class[np.arange(site.bed.shape[0]), site.bed.argmin(axis=1)]
    law = case.friction.classes[site.class_names[int(np.bincount(lowest).argmax())]]
    coefficient, depth, of_floor = middle_value(case, law.coefficient), 1.0, 1.0
    for _ in range(ROUNDS):
        of_floor = chezy(case, law, coefficient, depth)
        depth = (per_width / (of_floor * math.sqrt(slope))) ** (2.0 / 3.0)
    return of_floor * math.sqrt(slope / GRAVITY)


def remarks_on_outlet_levels(case: Case, site: Site, observations: Observations) -> Iterator[OutletAboveGauge]:
    """Outlets above the last gauge by more than its velocity head, RISE_BY_CHANCE and its errors explain; of no
    experiment whose gauges rise among themselves, which is a remark of its own.
    """
    rising, table = rising_levels(case, observations), observations.table
    found: dict[float, list[tuple[str, float, float]]] = {}
    for name, stated in case.experiments.items():
        gauges = table[table["used"] & (table["experiment"] == name) & (table["kind"] == WATER_LEVEL)]
        if name in rising or gauges.empty:
            continue
        last = gauges[gauges["x"] == gauges["x"].max()]
        x, level = float(last["x"].iloc[0]), float(last["value"].mean())
        error = float(last["standard_error"].fillna(kind_of(WATER_LEVEL).usual_error).mean())
        depth = np.maximum(level - in_experiment(site, name).bed[np.abs(site.grid.x - x).argmin()], 0.0)
        area = float(depth.sum()) * site.grid.dy
        if area <= 0.0:  # a station on land, or a level without sense: a remark of its own
            continue
        lifted = UNEVENNESS * (_discharge(case, stated) / area) ** 2 / (2.0 * GRAVITY)
        rise = prior_range(case, stated.level)[0] - level
        if rise > lifted + RISE_BY_CHANCE + SURE_OF_A_RISE * error:
            found.setdefault(x, []).append((name, level, rise))
    for x, lower in found.items():
        yield OutletAboveGauge(x, case.grid.x[1] - x, tuple(lower))


def remarks_on_directions(case: Case, observations: Observations) -> Iterator[object]:
    """Velocities that run across or upstream, and levels that rise downstream."""
    exchanged = exchanged_components(case, observations)
    if exchanged:
        yield ComponentsExchanged(tuple(exchanged), *next(iter(exchanged.values())))
    of = {name: rows for name, rows in _by_experiment(case, observations).items() if name not in exchanged}
    whole = {name: median for name, rows in of.items() if (median := _median(rows)) < 0.0}
    if whole:
        yield FlowUpstream(tuple(whole), next(iter(whole.values())), case.grid.centreline is not None)
    for name, rows in of.items():
        mean = rows[rows["kind"] == STREAMWISE].groupby("section")["value"].agg(["mean", "size", "max"])
        against = mean[(mean["max"] < 0.0) & (mean["size"] >= FEWEST_OF_A_SECTION)]
        if name not in whole and len(against):
            yield SectionsUpstream(name, tuple(map(str, against.index)), float(against["mean"].mean()))
    rising = rising_levels(case, observations)
    for first, last in dict.fromkeys((first, last) for first, last, _ in rising.values()):
        by = {name: rise for name, (*ends, rise) in rising.items() if ends == [first, last]}
        yield LevelsRiseDownstream(tuple(by), tuple(by.values()), first, last)


def _misdirected(case: Case, observations: Observations) -> tuple[str, ...]:
    """Experiments with an odd direction, whose sections do not show what they carry."""
    upstream = [name for name, rows in _by_experiment(case, observations).items() if _median(rows) < 0.0]
    return (*exchanged_components(case, observations), *rising_levels(case, observations), *upstream)


def _by_experiment(case: Case, observations: Observations) -> dict[str, pd.DataFrame]:
    used = observations.table[observations.table["used"]]
    return {name: used[used["experiment"] == name] for name in case.experiments}


def _median(rows: pd.DataFrame) -> float:
    """Of u [m/s], NaN without any: one mark of a missing value does not turn it."""
    return float(rows.loc[rows["kind"] == STREAMWISE, "value"].median())


def exchanged_components(case: Case, observations: Observations) -> dict[str, tuple[float, float]]:
    """median|v| > median|u|: experiments with more water across than along, exchanged or of the map.

    Returns
    -------
    dict of (float, float)
        Median |u| and |v| by experiment [m/s].
    """
    middle = {
        name: tuple(float(rows.loc[rows["kind"] == kind, "value"].abs().median()) for kind in (STREAMWISE, TRANSVERSE))
        for name, rows in _by_experiment(case, observations).items()
    }
    return {name: (along, across) for name, (along, across) in middle.items() if across > along}


def rising_levels(case: Case, observations: Observations) -> dict[str, tuple[float, float, float]]:
    """z_j - z_i > max(RISE, u^2 / 2g, SURE (se_i^2 + se_j^2)^(1/2)): experiments whose levels rise downstream.

    i and j are neighbours, or the first and the last gauge. The head of the fastest velocity u, which a widening may
    give back, counts between neighbours of more than two gauges.

    Returns
    -------
    dict of (float, float, float)
        x of both gauges and the rise by experiment [m].
    """
    found = {}
    for name, rows in _by_experiment(case, observations).items():
        level = rows[rows["kind"] == WATER_LEVEL].assign(standard_error=rows["standard_error"].fillna(0.0))
        gauges = level.groupby("x")[["value", "standard_error"]].mean()
        if len(gauges) < 2:
            continue
        x, z, error = (part.to_numpy(float) for part in (gauges.index, gauges["value"], gauges["standard_error"]))
        pairs = [(i, i + 1) for i in range(len(x) - 1)] + [(0, len(x) - 1)]
        i, j = max(pairs, key=lambda pair: z[pair[1]] - z[pair[0]])
        speed = rows.loc[rows["kind"] == STREAMWISE, "value"].max()
        head = 0.0 if np.isnan(speed) or j - i == len(x) - 1 else float(speed) ** 2 / (2.0 * GRAVITY)
        rise = float(z[j] - z[i])
        if rise > max(RISE, head, SURE * float(np.hypot(error[i], error[j]))):
            found[name] = (float(x[i]), float(x[j]), rise)
    return found


@dataclass(frozen=True)
class ProbeTurned:
    """A position across whose velocities point to one side of those of both neighbours, by an angle [degrees] that is
    the same at all its sections and experiments; y [m].
    """

    y: float
    side: str
    angle: float
    sections: int


def _to_one_side(angles: Array, errors: float, share: float) -> bool:
    """Whether FEWEST_CROSSED angles [degrees] or more have a mean beyond LEAST_ANGLE and so many of its standard errors
    [-], and a share of them [-] its sign.
    """
    if len(angles) < FEWEST_CROSSED:
        return False
    mean, error = float(angles.mean()), float(angles.std(ddof=1)) / float(np.sqrt(len(angles)))
    alike = int((np.sign(angles) == np.sign(mean)).sum())
    return abs(mean) > max(LEAST_ANGLE, errors * error) and alike >= share * len(angles)


def remarks_on_turned_probes(observations: Observations) -> Iterator[ProbeTurned]:
    """Positions whose v/u is off that of their neighbours, alike in FEWEST_CROSSED sections or more."""
    used = observations.table[observations.table["used"]]
    place = ["experiment", "section", "x", "y"]
    along, across = (used.loc[used["kind"] == kind, [*place, "value"]] for kind in (STREAMWISE, TRANSVERSE))
    both = along.merge(across, on=place, suffixes=("_along", "_across")).sort_values("y")
    if both.empty:
        return
    both["angle"] = np.degrees(np.arctan2(both["value_across"], both["value_along"]))
    angle = both.groupby(["experiment", "section"])["angle"]
    both["off"] = both["angle"] - 0.5 * (angle.shift(1) + angle.shift(-1))
    for y, rows in both.dropna(subset="off").groupby(both["y"].round(3)):
        off = rows["off"].to_numpy(float)
        # Both neighbours of a turned probe look turned by half of it the other way.
        if rows["section"].nunique() > 1 and _to_one_side(off, SURE_OF_A_PROBE, 1.0):
            mean = float(off.mean())
            yield ProbeTurned(float(y), "left" if mean > 0.0 else "right", abs(mean), len(off))


def remarks_on_turned_velocities(case: Case, observations: Observations) -> Iterator[VelocitiesTurned]:
    """Experiments whose velocities are turned to one side at nearly all sections, by more than chance makes; none with
    odd directions besides.
    """
    odd = _misdirected(case, observations)
    angles: dict[str, pd.Series[float]] = {}  # atan(sum v / sum u) to the left [degrees], by section with enough places
    for name, rows in _by_experiment(case, observations).items():
        if name not in odd:
            along, across = (
                rows.loc[rows["kind"] == kind, ["section", "x", "y", "value"]] for kind in (STREAMWISE, TRANSVERSE)
            )
            both = along.merge(across, on=["section", "x", "y"], suffixes=("_along", "_across"))
            sums = both.groupby("section")[["value_along", "value_across"]].agg(["sum", "size"])
            wide = sums[sums[("value_along", "size")] >= FEWEST_OF_A_MEAN]
            v, u = (wide[(f"value_{part}", "sum")].to_numpy(float) for part in ("across", "along"))
            angles[name] = pd.Series(np.degrees(np.arctan2(v, u)), index=wide.index)
    sure = SURE_OF_AN_ANGLE, MOST_ON_ONE_SIDE
    turned = {name: one for name, one in angles.items() if _to_one_side(one.to_numpy(), *sure)}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        ones = {name: one for name, one in turned.items() if sign * one.mean() > 0.0}
        sections = {section for one in ones.values() for section in one.index}
        others = tuple(
            (name, abs(float(one.mean())))
            for name, one in angles.items()
            if name not in turned and len(one) >= FEWEST_CROSSED and sections & set(one.index)
        )
        if ones:
            means = tuple(abs(float(one.mean())) for one in ones.values())
            yield VelocitiesTurned(side, tuple(ones), means, len(sections), others)
