"""Values that no flow of the case can have: marks for a missing value, wrong units, another datum, senseless errors.

To be looked at before any effect is: an effect that makes up for a wrong unit is found with great certainty.
"""

from collections.abc import Callable

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.parameter_space import Bounds
from vegglue.case.schema import Case
from vegglue.measurements.kinds import STREAMWISE, WATER_LEVEL, kind_of, velocity_rows
from vegglue.measurements.missing_marks import is_mark
from vegglue.measurements.plausible_flow import PlausibleFlow, plausible_flow
from vegglue.measurements.suspicion_in_words import outlet_in_words, suspicions_in_words

# Factor [-] between what was measured in a section and Q / A up to which nothing is said. The sections of 16 campaigns
# and of a surveyed confluence lie within 0.5 and 1.1; no unit in use but feet is nearer than 10.
FURTHEST_MEAN = 5.0
# Times Q / A [-] up to which one value may lie: a thread that fast needs nine tenths of its section to be still.
FASTEST_THREAD = 10.0
# Share of the wet area [-] that the stations of a section must span for its mean to tell feet, or flow that is missing:
# 2.6 times Q / A over two thirds of the area alone is 1.7 times the discharge.
SPANNED = 2.0 / 3.0
# Fewest stations of a section from which it is said that flow is missing.
FEWEST_STATIONS = 3
# Ratios to the SI value by which units are told: around 1 / 0.3048 and 1 / 0.278 for velocities, and a factor of three
# around 100 and 1000, as a section may be that much slower than Q / A. Litres and cubic feet are told as well.
VELOCITY_UNITS = {
    "ft/s or km/h": (2.6, 4.1), "dm/s, or mm/s taken for cm/s": (FURTHEST_MEAN, 30.0), "cm/s": (30.0, 300.0),
    "mm/s": (300.0, 3000.0),
}  # fmt: skip
DISCHARGE_UNITS = {"ft3/s": (18.0, 70.0), "l/s": (300.0, 3000.0)}
TENFOLD = "dm, or mm taken for cm"
LEVEL_UNITS = {
    "ft": 0.3048, TENFOLD: 0.1, "cm": 0.01, "mm": 0.001, "m, taken for cm": 100.0, "m, taken for mm": 1000.0,
}  # fmt: skip
# Share of the depth [-] within which a tenth of a level must lie at the outlet's: another datum may do as much.
NEAR_THE_OUTLET = 0.25
# Depth over width of the grid [-] that no channel has: flumes reach 1.
DEEPEST_CHANNEL = 2.0
# Q / A at the outlet [m/s] below which water stands: few probes tell less from nothing.
STANDING_WATER = 3e-3
# Standard errors of a velocity over Q / A [-]. Smaller: the mean of an hour at 5 % turbulence is known to 0.2 %, and no
# probe is calibrated better than that. Larger: it tells nothing about the flow.
VELOCITY_ERRORS = (1e-3, 1.0)
# Of a level: a point gauge in a flume is read to 0.1 mm [m]; an eighth of the depth is 20 % of Manning's n [-].
SMALLEST_LEVEL_ERROR, LARGEST_LEVEL_ERROR = 5e-5, 0.125
# Of a discharge, over the stated one [-]: flow meters in laboratories are good to 1e-3.
DISCHARGE_ERRORS = (1e-4, 1.0)

Judged = tuple[str, float]  # what is wrong with a value, '' for nothing, and by how much


def absurd_values(case: Case, site: Site, station: pd.DataFrame) -> list[str]:
    """What no flow of the case can have among the used stations, one sentence each; none when all of it is possible.

    |u| against U = Q / A, levels against the outlet's, the bed and the thickest growth, errors against both; see
    `plausible_flow`. station: a table of stations, columns as in Observations.table [SI].
    """
    used = station[station["used"].astype(bool)]
    sentences, judged = _judged(case, site, used)
    return sentences + (suspicions_in_words(judged, used) if len(judged) else [])


def with_absurd_levels(case: Case, site: Site, station: pd.DataFrame) -> pd.Series:
    """Whether each row is a level that its experiment cannot have, by itself, whatever its error."""
    _, judged = _judged(case, site, station[station["used"].astype(bool)])
    levels = judged[(judged["kind"] == WATER_LEVEL) & ~judged["problem"].astype(str).str.endswith("error")]
    return station.index.to_series().isin(levels.index)


def _judged(case: Case, site: Site, used: pd.DataFrame) -> tuple[list[str], pd.DataFrame]:
    """What is said of outlets, and the rows of the table that are wrong, with `problem` and `times`."""
    sentences, judged = [], [_with_verdicts(used[:0], []).assign(depth=0.0)]
    for name, rows in used.groupby("experiment", sort=False):
        flow = plausible_flow(case, in_experiment(site, str(name)), case.experiments[str(name)])
        if flow.depth > DEEPEST_CHANNEL * flow.width or flow.fastest[-1] < STANDING_WATER:
            sentences.append(outlet_in_words(str(name), flow))
            continue
        groups = [(str(kind), group) for (kind, _), group in rows.groupby(["kind", "section"], sort=False)]
        wrong = pd.concat([_with_verdicts(group, _values_judge(kind)(flow, group)) for kind, group in groups])
        judged.append(wrong.assign(depth=flow.depth))
        doubted = _of_doubted_scale(rows, wrong)
        sound = [group[~group.index.isin(doubted)] for _, group in groups]
        judged += [_with_verdicts(group, _errors_judged(flow, group)) for group in sound]
    wrong = pd.concat(judged)
    return sentences, wrong if wrong.empty else _of_one_datum(wrong)


def _with_verdicts(group: pd.DataFrame, verdicts: list[Judged]) -> pd.DataFrame:
    problem, times = [problem for problem, _ in verdicts], [times for _, times in verdicts]
    table = group.assign(problem=problem, times=times)
    return table[table["problem"] != ""]


def _of_doubted_scale(rows: pd.DataFrame, wrong: pd.DataFrame) -> pd.Index:
    """Rows of an experiment against which errors are not held: those that are wrong themselves, and every velocity of
    a section whose velocities do not go with the discharge.
    """
    off = wrong[wrong["problem"].str.match("fast|slow")]
    same = velocity_rows(rows) & rows["section"].isin(off["section"]).to_numpy(bool)
    return wrong.index.union(rows.index[same])


def _values_judge(kind: str) -> Callable[[PlausibleFlow, pd.DataFrame], list[Judged]]:
    return {"probe": _velocities_judged, "gauge": _levels_judged, "section": _discharges_judged}[
        kind_of(kind).instrument
    ]


def _velocities_judged(flow: PlausibleFlow, group: pd.DataFrame) -> list[Judged]:
    """Marks and single values first, then the mean of what is left of the section."""
    column = [flow.column(x) for x in group["x"]]
    speed, fastest = group["value"].abs().to_numpy(float), flow.fastest[column]
    beyond = speed > FASTEST_THREAD * fastest
    mark = beyond & np.array([is_mark(value) for value in group["value"]])
    usual = float(np.median(speed[~mark])) if (~mark).any() else 0.0
    alone = beyond & ~mark & (speed > FASTEST_THREAD * usual)
    left = ~mark & ~alone
    whole = _section_judged(flow, group[left], column[0]) if left.any() else ("", 1.0)
    return [
        ("mark", 1.0) if marked else ("alone", ratio) if single else whole
        for marked, single, ratio in zip(mark, alone, speed / fastest, strict=True)
    ]


def _section_judged(flow: PlausibleFlow, rows: pd.DataFrame, column: int) -> Judged:
    """The mean of |u| / U of a section, against the units; or its largest, where all of it is too slow."""
    speed = rows["value"].abs()
    ratio = float(speed.mean() / flow.fastest[column])
    spanned = flow.share_between(column, rows["y"].min(), rows["y"].max()) >= SPANNED
    unit = _unit_of(ratio, VELOCITY_UNITS)
    if ratio > FURTHEST_MEAN or (spanned and unit):
        return (f"fast {unit}".strip(), ratio)
    largest = float(speed.max() / flow.slowest[column])
    whole = spanned and len(rows) >= FEWEST_STATIONS and rows["kind"].iloc[0] in (STREAMWISE, "speed")
    return ("slow", largest) if whole and 0.0 < FURTHEST_MEAN * largest < 1.0 else ("", 1.0)


def _levels_judged(flow: PlausibleFlow, group: pd.DataFrame) -> list[Judged]:
    return [_level_judged(flow, flow.column(x), value) for x, value in zip(group["x"], group["value"], strict=True)]


def _level_judged(flow: PlausibleFlow, column: int, level: float) -> Judged:
    """Times: metres from the middle of the outlet level."""
    bounds = max(float(flow.lowest[column]), float(flow.floor[column])), float(flow.highest[column])
    above = level - 0.5 * sum(flow.level)
    if bounds[0] <= level <= bounds[1]:
        return ("", 1.0)
    if is_mark(level):
        return ("mark", 1.0)
    off = {
        unit: abs(metres * level - 0.5 * sum(flow.level))
        for unit, metres in LEVEL_UNITS.items()
        if bounds[0] <= metres * level <= bounds[1]
    }
    off = {unit: by for unit, by in off.items() if unit != TENFOLD or by < NEAR_THE_OUTLET * flow.depth}
    if off:
        return (f"level {min(off, key=lambda unit: off[unit])}", above)
    if level < flow.floor[column]:
        return ("bed", float(flow.floor[column]) - level)
    return ("high" if above > 0 else "low", abs(above))


def _of_one_datum(judged: pd.DataFrame) -> pd.DataFrame:
    """Levels that a unit would move far from their outlets, and that all lie as far above them, have another datum.

    |f z - z_out| beyond a quarter of the depth somewhere, and twice the range of z - z_out; f: the unit taken for it.
    """
    rows = judged[judged["problem"].str.startswith("level ")]
    metres = rows["problem"].str.removeprefix("level ").map(LEVEL_UNITS)
    left = (metres * rows["value"] - (rows["value"] - rows["times"])).abs()
    alike = len(rows) > 1 and 2.0 * float(np.ptp(rows["times"])) < left.max()
    if not alike or not (left > NEAR_THE_OUTLET * rows["depth"]).any():
        return judged
    return judged.assign(problem=judged["problem"].where(~judged.index.isin(rows.index), "datum"))


def _discharges_judged(flow: PlausibleFlow, group: pd.DataFrame) -> list[Judged]:
    return [_discharge_judged(flow.discharge, value) for value in group["value"]]


def _discharge_judged(stated: Bounds, value: float) -> Judged:
    """A section may hold the water of one inflow only, or of all."""
    if stated[0] <= 0.0:
        return ("", 1.0)
    ratio = abs(value) / stated[1]
    if ratio > FURTHEST_MEAN:
        return ("mark", 1.0) if is_mark(value) else (f"much {_unit_of(ratio, DISCHARGE_UNITS)}".strip(), ratio)
    return ("little", abs(value) / stated[0]) if FURTHEST_MEAN * abs(value) < stated[0] else ("", 1.0)


def _errors_judged(flow: PlausibleFlow, group: pd.DataFrame) -> list[Judged]:
    if group.empty:
        return []
    smallest, largest = _error_bounds(flow, group)
    error = group["standard_error"].to_numpy(float)
    return [
        ("small error", value) if value < low else ("large error", value) if value > high else ("", 1.0)
        for value, low, high in zip(error, smallest, largest, strict=True)
    ]


def _error_bounds(flow: PlausibleFlow, group: pd.DataFrame) -> tuple[Array, Array]:
    """Smallest and largest standard error that makes sense, (station,) each, in the unit of the kind."""
    kind, even = str(group["kind"].iloc[0]), np.ones(len(group))
    if kind == WATER_LEVEL:
        return SMALLEST_LEVEL_ERROR * even, LARGEST_LEVEL_ERROR * flow.depth * even
    if not kind_of(kind).velocity:
        return DISCHARGE_ERRORS[0] * flow.discharge[0] * even, DISCHARGE_ERRORS[1] * flow.discharge[1] * even
    column = [flow.column(x) for x in group["x"]]
    slowest = np.where(np.isfinite(flow.slowest[column]), flow.slowest[column], 0.0)
    return VELOCITY_ERRORS[0] * slowest, VELOCITY_ERRORS[1] * flow.fastest[column]


def _unit_of(ratio: float, units: dict[str, Bounds]) -> str:
    return next((unit for unit, (low, high) in units.items() if low <= ratio <= high), "")
