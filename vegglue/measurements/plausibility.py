"""Values that no flow of a case can have: marks of missing values, wrong units, another datum, senseless errors.

The bounds come from continuity and friction, nothing is solved for them. They are checked before any effect is: an
effect that compensates for a wrong unit is found with great certainty. They are rough on purpose: they separate cm/s
from m/s and one datum from another, and no effect comes near to them.
"""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.channel_geometry import expected_depth
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.parameter_space import Bounds, prior_range
from vegglue.case.schema import Case, Experiment
from vegglue.measurements.kinds import STREAMWISE, WATER_LEVEL, kind_of, velocity_rows

# Manning's n [s m^(-1/3)] above which no reach as a whole lies: weedy lowland brooks reach 0.3 to 0.5.
THICKEST_GROWTH = 0.5
# And below which none lies: planed wood and glass.
SMOOTHEST_WALLS = 0.01
# Velocity head of critical flow over its depth [-], Fr^2 / 2: no level lies further below that of the outlet. The same
# is left above what growth holds up, for gauges that are off by as much as an effect may find.
CRITICAL_HEAD = 0.5
# Factor [-] between the mean of a section and Q / A up to which it is plausible. The sections of 16 campaigns and of a
# surveyed confluence lie within 0.5 and 1.1; no unit in use but feet is nearer than 10.
FURTHEST_MEAN = 5.0
# Times Q / A [-] up to which one value may lie: a thread that fast needs nine tenths of its section to be still.
FASTEST_THREAD = 10.0
# Share of the wet area [-] that the stations of a section must span for its mean to show feet, or flow that is missing:
# 2.6 times Q / A over two thirds of the area alone is 1.7 times the discharge.
SPANNED = 2.0 / 3.0
# Fewest stations of a section that show that flow is missing.
FEWEST_STATIONS = 3
# Ratios to the SI value by which units are recognised: around 1 / 0.3048 and 1 / 0.278 for velocities, and a factor of
# three around 100 and 1000, as a section may be that much slower than Q / A. Litres and cubic feet likewise.
VELOCITY_UNITS = {
    "ft/s or km/h": (2.6, 4.1), "dm/s, or mm/s taken for cm/s": (FURTHEST_MEAN, 30.0), "cm/s": (30.0, 300.0),
    "mm/s": (300.0, 3000.0),
}  # fmt: skip
DISCHARGE_UNITS = {"ft3/s": (18.0, 70.0), "l/s": (300.0, 3000.0)}
TENFOLD = "dm, or mm taken for cm"
LEVEL_UNITS = {"ft": 0.3048, TENFOLD: 0.1, "cm": 0.01, "mm": 0.001, "m, taken for cm": 100.0, "m, taken for mm": 1000.0}
# Share of the depth [-] within which a tenth of a level must lie at the outlet's: another datum may do as much.
NEAR_THE_OUTLET = 0.25
# Depth over width of the grid [-] that no channel has: flumes reach 1.
DEEPEST_CHANNEL = 2.0
# Q / A at the outlet [m/s] below which water stands: few probes distinguish less from nothing.
STANDING_WATER = 3e-3
# Standard errors of a velocity over Q / A [-]. Smaller: the mean of an hour at 5 % turbulence is known to 0.2 %, and no
# probe is calibrated better than that. Larger: the value does not constrain the flow.
VELOCITY_ERRORS = (1e-3, 1.0)
# Of a level: a point gauge in a flume is read to 0.1 mm [m]; an eighth of the depth is 20 % of Manning's n [-].
SMALLEST_LEVEL_ERROR, LARGEST_LEVEL_ERROR = 5e-5, 0.125
# Of a discharge, over the stated one [-]: flow meters in laboratories are good to 1e-3.
DISCHARGE_ERRORS = (1e-4, 1.0)
# Marks of a missing value, besides numbers of nines alone, of which loggers write any count. Whatever is measured: four
# and five nines, and the ends of integers of 16 and 32 bits.
MARKS_OF_ANY_COLUMN = (9999.0, 99999.0, -32768.0, 32767.0, 32768.0, 2147483647.0)
# Written as well, but a place on a map, along a tape, a time or a discharge may be that number: marks only if a
# measurement cannot be so large.
MARKS_OR_VALUES = (7777.0, 8888.0)
# What is larger [SI] is no measurement; a coordinate on a map may be (northings reach 1e7 m).
LARGEST_MEASURED, LARGEST_COORDINATE = 1e6, 1e9
# A single 9 and what is below it, 0.9 and 0.99, are measured.
LEAST_NINES = 9.0
_SIZES = frozenset(abs(mark) for mark in (*MARKS_OF_ANY_COLUMN, *MARKS_OR_VALUES))


class Symptom(Enum):
    """What is wrong with measured values. The comment gives the `size` of an ImplausibleValues."""

    MISSING_MARK = "missing-value mark"  # 1
    ISOLATED = "single fast value"  # over Q / A [-]
    FAST = "too fast"  # mean over Q / A [-]
    SLOW = "too slow"  # largest over Q / A [-]
    LEVEL_UNIT = "level in another unit"  # above the outlet level [m]
    DATUM = "level above another datum"  # above the outlet level [m]
    BELOW_BED = "level below the bed"  # below the lowest bed [m]
    HIGH = "level too high"  # above the outlet level [m]
    LOW = "level too low"  # below the outlet level [m]
    LARGE_DISCHARGE = "discharge too large"  # over the stated one [-]
    SMALL_DISCHARGE = "discharge too small"  # over the smallest stated one [-]
    SMALL_ERROR = "standard error too small"  # the error [unit of the kind]
    LARGE_ERROR = "standard error too large"  # the error [unit of the kind]


@dataclass(frozen=True)
class ImplausibleValues:
    """Used values of one kind of observation with one problem.

    Attributes
    ----------
    quantity : str
        The kind in words.
    instrument, si_unit : str
        As in Kind, and the unit of its values.
    unit : str
        The unit in which they would be plausible; empty for none.
    size : float
        Median over the values, see Symptom.
    count, total : int
        Number of these and of all used values of the kind.
    first : (float, float, float or None)
        Value, x and y of the first [SI]; y None if the kind has none.
    places : tuple of (str, str or None)
        Experiments and sections; '' for a gauge without a name, None for all values of the experiment.
    """

    quantity: str
    instrument: str
    si_unit: str
    symptom: Symptom
    unit: str
    size: float
    count: int
    total: int
    first: tuple[float, float, float | None]
    places: tuple[tuple[str, str | None], ...]


@dataclass(frozen=True)
class ImplausibleOutlet:
    """An outlet deeper than channels are, or all but still.

    Attributes
    ----------
    level, depth, width
        At the outlet, largest depth there, and width of the grid [m].
    velocity
        Q / A [m/s].
    """

    experiment: str
    level: float
    depth: float
    width: float
    velocity: float


@dataclass(frozen=True)
class PlausibleFlow:
    """Bounds for one experiment on the grid.

    Attributes
    ----------
    x, y : ndarray (nx,), (ny,)
        Columns and rows [m].
    slowest, fastest : ndarray (nx,)
        Q / A [m/s], infinite if the section may be dry.
    lowest, highest : ndarray (nx,)
        Water level [m].
    smoothest, thickest : ndarray (nx,)
        The same without what is left for gauges that are off, on smooth walls and in growth [m].
    floor : ndarray (nx,)
        Lowest bed of the section [m].
    discharge : (float, float)
        Least, of one inflow alone, and most, of all [m3/s].
    depth : float
        Largest at the outlet [m].
    level : (float, float)
        At the outlet [m].
    width : float
        Of the grid [m].
    depths : ndarray (nx, ny)
        Expected [m].
    """

    x: Array
    y: Array
    slowest: Array
    fastest: Array
    lowest: Array
    highest: Array
    smoothest: Array
    thickest: Array
    floor: Array
    discharge: Bounds
    depth: float
    level: Bounds
    width: float
    depths: Array

    def column(self, x: float) -> int:
        """Index of the column of cells nearest to x [m]."""
        return int(np.abs(self.x - x).argmin())


Judgement = tuple[Symptom | None, float, str]  # of one value: what is wrong, its size, and the unit that would mend it
PLAUSIBLE: Judgement = (None, 1.0, "")


def is_mark(value: float) -> bool:
    """Whether a number is one that stands for a missing value: of nines only (-999, 99.9, 9999), 1e30 and the like.

    Parameters
    ----------
    value : [SI]
        Measured, no coordinate.
    """
    size = abs(value)
    return size >= LARGEST_MEASURED or size in _SIZES or (size >= LEAST_NINES and is_of_nines(size))


def is_mark_anywhere(value: float) -> bool:
    """Whether a number stands for a missing value also among places, where 9 and 99 are measured.

    Parameters
    ----------
    value : [SI]
    """
    negative_nines = value <= -99.0 and is_of_nines(-value)
    return negative_nines or value in MARKS_OF_ANY_COLUMN or not abs(value) <= LARGEST_COORDINATE


def is_of_nines(value: float) -> bool:
    """Whether a number is written with nines alone: 9, 99.9, 9999."""
    return set(f"{value:g}") <= set("9.")


def implausible_values(case: Case, site: Site, station: pd.DataFrame) -> list[ImplausibleOutlet | ImplausibleValues]:
    """What no flow of the case can have among the used stations.

        |u| against U = Q / A, levels against the outlet's, the bed and the thickest growth, errors against both

    Parameters
    ----------
    station : DataFrame
        As Observations.table [SI].

    Returns
    -------
    list
        Empty if all of it is possible; see `plausible_flow`.
    """
    used = station[station["used"]]
    outlets, wrong = _judged(case, site, used)
    found: list[ImplausibleOutlet | ImplausibleValues] = [*outlets]
    for (name, problem, unit), rows in wrong.groupby(["kind", "problem", "unit"], sort=False):
        kind, first, of_kind = kind_of(str(name)), rows.iloc[0], used[used["kind"] == name]
        places: list[tuple[str, str | None]] = []
        for experiment, here in rows.groupby("experiment", sort=False):
            sections = [str(one) for one in here["section"].unique() if one]
            whole = len(here) == int((of_kind["experiment"] == experiment).sum()) > 1 and len(sections) != 1
            places += [(str(experiment), None)] if whole else [(str(experiment), one) for one in sections or [""]]
        found.append(
            ImplausibleValues(
                quantity=kind.words,
                instrument=kind.instrument,
                si_unit=kind.unit,
                symptom=problem,
                unit=str(unit),
                size=abs(float(rows["size"].median())),
                count=len(rows),
                total=len(of_kind),
                first=(float(first["value"]), float(first["x"]), float(first["y"]) if kind.at_point else None),
                places=tuple(places),
            )
        )
    return found


def implausible_levels(case: Case, site: Site, station: pd.DataFrame) -> pd.Series:
    """Whether each row is a level that its experiment cannot have, whatever its error (station,).

    Parameters
    ----------
    case, site, station
        As `implausible_values`.
    """
    _, wrong = _judged(case, site, station[station["used"]])
    of_errors = wrong["problem"].isin([Symptom.SMALL_ERROR, Symptom.LARGE_ERROR])
    return station.index.to_series().isin(wrong.index[(wrong["kind"] == WATER_LEVEL) & ~of_errors])


def plausible_flow(case: Case, site: Site, experiment: Experiment) -> PlausibleFlow:
    """U = Q / A(x) with A under the expected level, and z_out - h/2 <= z <= z_highest + h/2, see `_backwater_level`.

    Q and z_out within 95 % of their priors. A of `slowest` lies under a surface parallel to the floor, or that of the
    outlet if that is higher; A of `fastest` under the lower one that smooth walls leave, see `_normal_level`. If plants
    hold the water up, A is larger and the flow slower.
    """
    level = prior_range(case, experiment.level)
    parts = [prior_range(case, value) for value in experiment.discharge.values()]
    least, most = min(low for low, _ in parts), sum(high for _, high in parts)
    expected, deep = (
        np.maximum(expected_depth(case, site, experiment.model_copy(update={"level": end})), 0.0) for end in level
    )
    smoothest = _normal_level(site, expected, level[0], least)
    shallow = np.minimum(expected, np.maximum(smoothest[:, None] - site.bed, 0.0))
    thickest = _backwater_level(site, deep, level[1], most)
    dy, depth = site.grid.dy, float(deep[-1].max())
    with np.errstate(divide="ignore"):
        slowest, fastest = least / (dy * deep.sum(axis=1)), most / (dy * shallow.sum(axis=1))
    return PlausibleFlow(
        x=site.grid.x,
        y=site.grid.y,
        slowest=slowest,
        fastest=fastest,
        lowest=np.full(site.grid.x.size, level[0] - CRITICAL_HEAD * depth),
        highest=thickest + CRITICAL_HEAD * depth,
        smoothest=smoothest,
        thickest=thickest,
        floor=site.bed.min(axis=1),
        discharge=(least, most),
        depth=depth,
        level=level,
        width=dy * site.grid.y.size,
        depths=deep,
    )


def _normal_level(site: Site, depths: Array, level: float, discharge: float) -> Array:
    """z = max(z_out, z_floor + (n q / sqrt(S))^(3/5)) (nx,) [m].

    Above the backwater of its outlet a reach may flow at normal depth (Manning), least on smooth walls. S: fall of the
    floor over the length of the grid [-]; q: Q over the widest water [m2/s].
    """
    floor, grid = site.bed.min(axis=1), site.grid
    slope = float(floor[0] - floor[-1]) / (grid.dx * grid.x.size)
    width = grid.dy * float((depths > 0.0).sum(axis=1).max())
    normal = 0.0
    if slope > 0.0 and width > 0.0 and discharge > 0.0:
        normal = (SMOOTHEST_WALLS * discharge / width / slope**0.5) ** 0.6
    return np.maximum(level, floor + normal)


def _backwater_level(site: Site, depths: Array, level: float, discharge: float) -> Array:
    """z = z_floor + h with h^(13/3) = h_L^(13/3) + 13/3 n^2 q^2 (L - x), (nx,) [m]: water held up by growth all over.

    The integral of dh/dx = -n^2 q^2 / h^(10/3), friction after Manning on an even bed, at the thickest growth; on a bed
    that falls, h is smaller. z_floor: the highest floor from x to the outlet; q: Q over the narrowest water [m2/s].
    """
    grid = site.grid
    width = grid.dy * (depths > 0.0).sum(axis=1)
    unit_discharge = discharge / float(width[width > 0.0].min()) if (width > 0.0).any() else 0.0
    distance = grid.x[-1] + 0.5 * grid.dx - grid.x
    grown = 13.0 / 3.0 * (THICKEST_GROWTH * unit_discharge) ** 2 * distance
    depth = (max(float(depths[-1].max()), 0.0) ** (13.0 / 3.0) + grown) ** (3.0 / 13.0)
    sill = np.maximum.accumulate(site.bed.min(axis=1)[::-1])[::-1]
    return np.maximum(sill, level - depths[-1].max()) + depth


def _judged(case: Case, site: Site, used: pd.DataFrame) -> tuple[list[ImplausibleOutlet], pd.DataFrame]:
    """Outlets, and rows of the table that are wrong, with columns `problem`, `size` and `unit` of the Judgement."""

    outlets: list[ImplausibleOutlet] = []
    found: dict[Hashable, tuple[Symptom, float, str, float]] = {}

    def keep_wrong(group: pd.DataFrame, verdicts: Sequence[Judgement], depth: float) -> None:
        for row, (problem, size, unit) in zip(group.index, verdicts, strict=True):
            if problem is not None:
                found[row] = problem, size, unit, depth

    for name, rows in used.groupby("experiment", sort=False):
        flow = plausible_flow(case, in_experiment(site, str(name)), case.experiments[str(name)])
        if flow.depth > DEEPEST_CHANNEL * flow.width or flow.fastest[-1] < STANDING_WATER:
            level = 0.5 * sum(flow.level)
            outlets.append(ImplausibleOutlet(str(name), level, flow.depth, flow.width, float(flow.fastest[-1])))
            continue
        groups = [group for _, group in rows.groupby(["kind", "section"], sort=False)]
        for group in groups:
            keep_wrong(group, _judge_values(flow, group), flow.depth)
        # Errors are held against sound values only: velocities of a section that do not go with the discharge are none.
        off_already = rows.index.isin(found)
        of_section = [row for row in rows.index[off_already] if found[row][0] in (Symptom.FAST, Symptom.SLOW)]
        off = rows["section"].isin(rows.loc[of_section, "section"]).to_numpy(bool)
        unsound = rows.index[off_already | velocity_rows(rows) & off]
        for group in groups:
            sound = group[~group.index.isin(unsound)]
            keep_wrong(sound, _judge_errors(flow, sound), flow.depth)
    problem, size, unit, depth = zip(*found.values(), strict=True) if found else ((), (), (), ())
    wrong = used.loc[list(found)].assign(
        problem=np.array(problem, dtype=object),
        size=np.array(size, dtype=float),
        unit=np.array(unit, dtype=object),
        depth=np.array(depth, dtype=float),
    )
    # Levels that a unit would move far from their outlets, and that all lie as far above them, have another datum:
    # |f z - z_out| beyond a quarter of the depth somewhere, and twice the range of z - z_out; f: the unit found for it.
    rows = wrong[wrong["problem"] == Symptom.LEVEL_UNIT]
    left = (rows["unit"].map(LEVEL_UNITS).astype(float) * rows["value"] - (rows["value"] - rows["size"])).abs()
    alike = len(rows) > 1 and 2.0 * float(np.ptp(rows["size"])) < left.max()
    if alike and (left > NEAR_THE_OUTLET * rows["depth"]).any():
        of_unit = wrong.index.isin(rows.index)
        wrong = wrong.assign(
            problem=wrong["problem"].where(~of_unit, Symptom.DATUM), unit=wrong["unit"].where(~of_unit, "")
        )
    return outlets, wrong


def _judge_values(flow: PlausibleFlow, group: pd.DataFrame) -> list[Judgement]:
    """Of the values of one kind and section."""
    instrument, value = kind_of(str(group["kind"].iloc[0])).instrument, group["value"].to_numpy(float)
    column = [flow.column(x) for x in group["x"]]
    if instrument == "gauge":
        return [_judge_level(flow, at, level) for at, level in zip(column, value, strict=True)]
    if instrument == "section":  # it may hold the water of one inflow only, or of all
        least, most = flow.discharge
        if least <= 0.0:
            return [PLAUSIBLE] * len(value)
        found: list[Judgement] = []
        for ratio, one in zip(np.abs(value) / most, value, strict=True):
            if ratio > FURTHEST_MEAN:
                large = (Symptom.LARGE_DISCHARGE, float(ratio), _unit_of(ratio, DISCHARGE_UNITS))
                found.append((Symptom.MISSING_MARK, 1.0, "") if is_mark(one) else large)
            else:
                small = FURTHEST_MEAN * abs(one) < least
                found.append((Symptom.SMALL_DISCHARGE, float(abs(one) / least), "") if small else PLAUSIBLE)
        return found
    # Marks and single values first, then the mean of what is left of the section.
    speed, fastest = np.abs(value), flow.fastest[column]
    beyond = speed > FASTEST_THREAD * fastest
    mark = beyond & np.array([is_mark(one) for one in value])
    usual = float(np.median(speed[~mark])) if (~mark).any() else 0.0
    alone = beyond & ~mark & (speed > FASTEST_THREAD * usual)
    whole, left = PLAUSIBLE, group[~mark & ~alone]
    if len(left):
        ratio = float(left["value"].abs().mean() / flow.fastest[column[0]])
        largest = float(left["value"].abs().max() / flow.slowest[column[0]])
        unit, wet = _unit_of(ratio, VELOCITY_UNITS), flow.depths[column[0]]
        between = (flow.y >= left["y"].min()) & (flow.y <= left["y"].max())
        spanned = wet.any() and float(wet[between].sum() / wet.sum()) >= SPANNED
        along = spanned and len(left) >= FEWEST_STATIONS and left["kind"].iloc[0] in (STREAMWISE, "speed")
        if ratio > FURTHEST_MEAN or (spanned and unit):
            whole = (Symptom.FAST, ratio, unit)
        elif along and 0.0 < FURTHEST_MEAN * largest < 1.0:
            whole = (Symptom.SLOW, largest, "")
    return [
        (Symptom.MISSING_MARK, 1.0, "") if marked else (Symptom.ISOLATED, float(ratio), "") if single else whole
        for marked, single, ratio in zip(mark, alone, speed / fastest, strict=True)
    ]


def _judge_level(flow: PlausibleFlow, column: int, level: float) -> Judgement:
    lowest, highest = max(float(flow.lowest[column]), float(flow.floor[column])), float(flow.highest[column])
    outlet = 0.5 * sum(flow.level)
    above = level - outlet
    if lowest <= level <= highest:
        return PLAUSIBLE
    if is_mark(level):
        return (Symptom.MISSING_MARK, 1.0, "")
    off = {unit: abs(size * level - outlet) for unit, size in LEVEL_UNITS.items() if lowest <= size * level <= highest}
    off = {unit: by for unit, by in off.items() if unit != TENFOLD or by < NEAR_THE_OUTLET * flow.depth}
    if off:
        return (Symptom.LEVEL_UNIT, above, min(off, key=lambda unit: off[unit]))
    if level < flow.floor[column]:
        return (Symptom.BELOW_BED, float(flow.floor[column]) - level, "")
    return (Symptom.HIGH if above > 0 else Symptom.LOW, abs(above), "")


def _judge_errors(flow: PlausibleFlow, group: pd.DataFrame) -> list[Judgement]:
    """Of the standard errors of one kind and section, against the smallest and largest that make sense."""
    if group.empty:
        return []
    kind, even = kind_of(str(group["kind"].iloc[0])), np.ones(len(group))
    if kind.name == WATER_LEVEL:
        smallest, largest = SMALLEST_LEVEL_ERROR * even, LARGEST_LEVEL_ERROR * flow.depth * even
    elif not kind.velocity:
        smallest, largest = (share * end * even for share, end in zip(DISCHARGE_ERRORS, flow.discharge, strict=True))
    else:
        column = [flow.column(x) for x in group["x"]]
        slowest = np.where(np.isfinite(flow.slowest[column]), flow.slowest[column], 0.0)
        smallest, largest = VELOCITY_ERRORS[0] * slowest, VELOCITY_ERRORS[1] * flow.fastest[column]
    return [
        (Symptom.SMALL_ERROR, error, "") if error < low else (Symptom.LARGE_ERROR, error, "") if error > high
        else PLAUSIBLE
        for error, low, high in zip(group["standard_error"].to_numpy(float), smallest, largest, strict=True)
    ]  # fmt: skip


def _unit_of(ratio: float, units: dict[str, Bounds]) -> str:
    return next((unit for unit, (low, high) in units.items() if low <= ratio <= high), "")
