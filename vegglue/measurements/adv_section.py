"""ADV points of one section: placed in the channel, judged, averaged over the depth and summed to the discharge."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.bed import bed_levels
from vegglue.case.grid import Grid, centreline_in
from vegglue.case.parameter_space import middle_value
from vegglue.case.schema import Case, Observation
from vegglue.case.zones import cells_of_patch
from vegglue.errors import InputError, shown_path
from vegglue.measurements.csv_table import headings_of, read_table, refuse_repeated, refuse_rows
from vegglue.measurements.kinds import WATER_LEVEL, Unused
from vegglue.measurements.section_discharge import (
    GRID_STEP,
    CrossSection,
    Discharge,
    fall_of_floor,
    level_by_gauges,
    neighbour_error,
    section_discharges,
)
from vegglue.measurements.vertical_profile import (
    FEWEST_POINTS,
    CanopyHeight,
    Column,
    average_within_plants,
    few_points_average,
    fit_canopy_height,
    fit_log_law,
    fit_two_layers,
    linear_average,
    sampling_error,
)
from vegglue.wording.numbers import in_digits, range_in_digits, so_many
from vegglue.wording.sentences import sentence

EDGE = 0.05  # m, a vertical closer to the edge of a patch stands beside the plants as much as in them
SMALLEST_ERROR = 0.001  # m/s, resolution of an ADV; keeps one calm point from outweighing all others
SLOWEST = 0.05  # m/s, below which the mean velocity of a vertical does not give its time scale
# Stand-ins for what a file leaves out, chosen so that errors come out too large rather than too small.
TURBULENCE = 0.15  # u_std over the mean velocity of the vertical
DURATION = 60.0  # s
SECTIONS_OF_FLOOR = 50  # chosen, not measured: some in every pool and on every riffle of a reach
# A probe is dead when all four hold. Chosen wide apart from what slow water shows, which still fluctuates.
LARGEST_DEAD_SPEED = 0.05  # m/s, no point of a dead probe is above this
SHARE_OF_SPEED = 0.1  # [-], at all heights it reads less than this share of the velocity between its neighbours
SHARE_OF_TURBULENCE = 0.25  # [-], and its velocity fluctuates by less than this share of theirs
FEWEST_HEIGHTS = 3  # with fewer points a slow vertical at the water's edge may look like a dead probe


@dataclass(frozen=True)
class Section:
    """One measured section: its part of every value in observations.Observations of the same name."""

    points: pd.DataFrame
    profiles: pd.DataFrame
    discharge: dict[str, Discharge]
    neighbour_error: float
    canopy_height: CanopyHeight | None


@dataclass(frozen=True)
class DeadProbe:
    """A probe that reads near zero at all heights.

    Attributes
    ----------
    heights : int
        Number of points.
    largest, expected : float
        Largest |u|, and mean u between its neighbours [m/s].
    deviation, expected_deviation : float or None
        Median of u_std here and between its neighbours [m/s], None if unknown.
    """

    heights: int
    largest: float
    expected: float
    deviation: float | None
    expected_deviation: float | None


def read_section(case: Case, observation: Observation, gauges: pd.DataFrame) -> Section:
    """Points, verticals, discharge and canopy height of the section of one observation of `kind: adv`.

    Parameters
    ----------
    gauges : DataFrame
        Stations of measured levels.

    Raises
    ------
    InputError
        Naming file and row, for what cannot be used as given.
    """
    points = _placed(case, observation, _read_points(observation), gauges)
    # Standard error of every point: as stated, else its sampling error. The integral time scale, which no file gives,
    # is taken as h / U of the vertical: eddies as long as the water is deep, carried past at the mean velocity.
    mean = points["u"].abs().groupby(points["y"]).transform("mean").clip(lower=SLOWEST).to_numpy()
    deviation = points["u_std"].to_numpy() if "u_std" in points else TURBULENCE * mean
    duration = points["duration_s"].to_numpy() if "duration_s" in points else np.full(len(points), DURATION)
    own = sampling_error(deviation, duration, points["depth"].clip(lower=0.0).to_numpy() / mean)
    if "u_se" in points:
        own = np.where(points["u_se"] > 0.0, points["u_se"], own)
    points = points.assign(standard_error=np.maximum(own, SMALLEST_ERROR), u_std=points.get("u_std", np.nan))
    x, y = points["x"].iloc[0], _across(case)
    section = CrossSection(y, _bed(case, observation, x, y), _surface(case, observation, x, gauges))
    wet = section.y[section.depth > 0.0]
    dead = {at: sentence(one) for at, one in dead_probes((wet[0], wet[-1]), points[points["used"]]).items()}
    reason = points["y"].map(lambda at: dead.get(at, ""))
    points = points.assign(reason=points["reason"].mask(reason != "", reason), used=points["used"] & (reason == ""))
    profiles = pd.DataFrame([_profile(group) for _, group in points.groupby("y")])
    good = profiles[profiles["used"]]
    error = neighbour_error(good["y"].to_numpy(), good["fitted"].to_numpy())
    columns = [_column(group) for _, group in points[points["used"]].groupby("y")]
    among = [column for column, plants in zip(columns, good["plants"], strict=True) if plants]
    canopy = fit_canopy_height(among) if among else None
    return Section(points, profiles, section_discharges(section, columns, good, error), error, canopy)


def dead_probes(edges: tuple[float, float], points: pd.DataFrame) -> dict[float, DeadProbe]:
    """Verticals of a section whose probe is dead. Nothing is dropped here.

    A dead probe reads near zero at every height, without turbulence, while its neighbours do not. In slow water a
    working probe still shows fluctuations and a rise with height. Slow water is natural in plants, so that without
    u_std a probe there is not dead.

    Parameters
    ----------
    edges
        y of the water's edges, at which velocity and turbulence are zero [m].
    points : DataFrame
        Columns y, u, u_std (NaN if unknown) and plants, in the water.

    Returns
    -------
    dict of float to DeadProbe
        By y [m].
    """
    by = points.assign(speed=points["u"].abs()).groupby("y", as_index=False).agg(
        heights=("u", "size"), largest=("speed", "max"), mean=("u", "mean"), deviation=("u_std", "median"),
        plants=("plants", "first"),
    )  # fmt: skip
    y, deviation = by["y"].to_numpy(), by["deviation"].to_numpy(float)
    suspect = ((by["largest"] < LARGEST_DEAD_SPEED) & (by["heights"] >= FEWEST_HEIGHTS)).to_numpy()
    if suspect.all():
        return {}

    def between_neighbours(value: Array) -> Array:
        nodes = np.concatenate([[edges[0]], y[~suspect], [edges[1]]])
        return np.interp(y, nodes, np.concatenate([[0.0], value[~suspect], [0.0]]))

    expected, expected_deviation = between_neighbours(by["mean"].to_numpy()), between_neighbours(deviation)
    unknown = np.isnan(deviation) | np.isnan(expected_deviation)
    calm = np.where(unknown, ~by["plants"].to_numpy(bool), deviation < SHARE_OF_TURBULENCE * expected_deviation)
    dead = suspect & calm & (by["largest"].to_numpy() < SHARE_OF_SPEED * expected)
    return {
        float(y[i]): DeadProbe(
            int(by["heights"][i]), float(by["largest"][i]), float(expected[i]),
            *((None, None) if unknown[i] else (float(deviation[i]), float(expected_deviation[i]))),
        )
        for i in np.flatnonzero(dead)
    }  # fmt: skip


def average_of(profiles: pd.DataFrame, rule: str) -> tuple[pd.Series, pd.Series]:
    """Depth average of each vertical and its standard error, by a rule.

    Parameters
    ----------
    profiles : DataFrame
        Rows of Observations.profiles.
    rule
        `paper`: as in Berends et al. (2020), linear between points, zero at the bed and constant above the highest
        point; its error includes d / sqrt(3), the difference d of both rules being the bound of a uniform distribution.
        `profile`: the mean of the fitted profile.

    Returns
    -------
    U, standard error
        (rows,) [m/s]
    """
    if rule == "profile":
        return profiles["fitted"], profiles["fitted_error"]
    shape = (profiles["linear"] - profiles["fitted"]) / np.sqrt(3.0)
    return profiles["linear"], np.hypot(profiles["linear_error"], shape)


def across_averages(points: pd.DataFrame) -> pd.DataFrame:
    """Depth average of v in each vertical.

    Linear between points, zero at the bed, constant above the highest: no law gives the spread of secondary flow. Few
    points are averaged as along the channel, so that they keep their direction.

    Parameters
    ----------
    points : DataFrame
        Rows of Observations.points with a column v, of verticals in the order of `Section.profiles`.

    Returns
    -------
    DataFrame
        Columns value and standard_error [m/s].
    """
    found = []
    for _, group in points.groupby("y"):
        wet = group[group["height"].gt(0.0) & group["height"].le(group["depth"]) & group["v"].notna()]
        if wet.empty:
            found.append((np.nan, np.nan))
            continue
        column = _column(wet.assign(u=wet["v"]))
        few = len(wet) < FEWEST_POINTS
        found.append(few_points_average(column, bool(wet["plants"].iloc[0])) if few else linear_average(column))
    return pd.DataFrame(found, columns=["value", "standard_error"])


def upward_column(path: Path) -> str:
    """The column of heights in a file of points: `z`, a level, else `height` above the bed.

    Raises
    ------
    InputError
        As `headings_of`.
    """
    there = headings_of(path)
    return "height" if "height" in there and "z" not in there else "z"


def _read_points(observation: Observation) -> pd.DataFrame:
    """Rows of the observed case, upwards in each vertical, in the coordinates of the grid; with z, else with height."""
    path, wanted = observation.file, observation.case
    upward = upward_column(path)
    optional = ("v", "w", "u_se", "u_std", "duration_s")
    rows = read_table(path, ("case", "device"), ("x", "y", upward, "u"), optional, gaps=("v", "w"))
    if "u_se" in rows:
        refuse_rows(path, rows["u_se"] < 0.0, "out_of_bounds", rows["u_se"], least=0.0)
    for column in {"u_std", "duration_s"} & set(rows.columns):
        refuse_rows(path, rows[column] <= 0.0, "out_of_bounds", rows[column], above=0.0)
    refuse_repeated(path, rows, ("case", "x", "y", upward))
    chosen = rows[rows["case"] == wanted]
    if chosen.empty:
        raise InputError(
            f"{shown_path(path)}: expected rows with case {wanted!r}, got only {', '.join(rows['case'].unique())}; "
            f"correct `case` in the observation."
        )
    first = chosen["x"].iloc[0]
    refuse_rows(path, chosen["x"] != first, "other_x", chosen["x"], case=wanted, first=first)
    moved = chosen.assign(x=chosen["x"] + observation.offset.x, y=chosen["y"] + observation.offset.y)
    return moved.drop(columns="case").sort_values(["y", upward]).reset_index(drop=True)


def _placed(case: Case, observation: Observation, points: pd.DataFrame, gauges: pd.DataFrame) -> pd.DataFrame:
    """Points with bed (datum of the file), depth, height above the bed and plants; `used` if they are in the water.

    Of heights above the bed below each point, z is that of the bed of the case and the height.
    """
    x, y = points["x"].iloc[0], points["y"].to_numpy()
    surface, (low, high) = _surface(case, observation, x, gauges), case.grid.y
    try:
        bed = _bed(case, observation, x, y)
    except InputError:
        beside = np.unique(y[(y < low) | (y > high)])
        if not beside.size:
            raise
        raise InputError(
            f"{shown_path(observation.file)}: expected verticals of case {observation.case!r} over the surveyed bed, "
            f"between y = {low:g} and {high:g} m, got {so_many(beside.size, 'vertical')} beside it, the first at y = "
            f"{beside[0]:g} m; correct y (`flip` and `zero` of a file set its origin), or the grid."
        ) from None
    points = points if "z" in points else points.assign(z=bed + points["height"])
    reason = np.select([points["z"] <= bed, points["z"] > surface], [Unused.BELOW_BED, Unused.ABOVE_SURFACE], "")
    if (reason != "").all():
        above, bounds = points["z"] - bed, [(float(np.min(one)), float(np.max(one))) for one in (points["y"], bed)]
        exchanged = ((points["u"] > bed) & (points["u"] <= surface)).all()
        raise InputError(
            f"{shown_path(observation.file)}: expected points of case {observation.case!r} between the bed and the "
            f"water surface at z = {in_digits(surface, 4)} m, got none: at x = {x:.4g} m, y = "
            f"{range_in_digits(bounds[0])} m the bed lies at {range_in_digits(bounds[1])} m, the points "
            f"{range_in_digits((above.min(), above.max()))} m above it; check unit and sign of heights, "
            f"{'whether heights and `u` are exchanged, ' if exchanged else ''}x, y, the water levels, and `floor`, "
            "`surface` and `offset` of the observation."
        )
    # In plants of the experiment, at least EDGE inside their patch.
    present, line = case.experiments[str(observation.experiment)].plants, centreline_in(case)
    plants = np.zeros(len(y), dtype=bool)
    for patch in case.plants.patches:
        if present is True or (present and patch.name in present):
            sides = [Grid(np.array([x]), y + side, 1.0, 1.0, line) for side in (-EDGE, EDGE)]
            plants |= np.logical_and(*(cells_of_patch(patch, grid)[0] for grid in sides))
    return points.assign(
        experiment=observation.experiment,
        section=observation.section,
        bed=bed,
        depth=surface - bed,
        height=points["z"] - bed,
        plants=plants,
        used=reason == "",
        reason=reason,
    )


def _surface(case: Case, observation: Observation, x: float, gauges: pd.DataFrame) -> float:
    """Water level at x in z of the file [m]: as given, else of the gauges of the experiment, else as expected.

    By gauges: see `level_by_gauges`. As expected: parallel to the floor, z = z_out + max(z_floor(x) - z_floor(L), 0),
    as in channel_geometry.expected_depth.
    """
    if observation.surface is not None:
        return observation.surface
    experiment, across = str(observation.experiment), _across(case)
    own = gauges[(gauges["experiment"] == experiment) & (gauges["kind"] == WATER_LEVEL)]
    if len(own):
        level, upstream = level_by_gauges(case, case.experiments[experiment], own, x)
        if upstream > 0.0:
            places = np.linspace(*case.grid.x, SECTIONS_OF_FLOOR + 2)[1:-1]
            grid = Grid(places, across, float(places[1] - places[0]), GRID_STEP, centreline_in(case))
            level += upstream * fall_of_floor(places, bed_levels(case, grid, experiment).min(axis=1))
    else:
        ends = (x, case.grid.x[1] - 0.5 * case.grid.cell[0])
        here, outlet = (_local_bed(case, experiment, end, across).min() for end in ends)
        level = middle_value(case, case.experiments[experiment].level) + max(float(here - outlet), 0.0)
    return float(_in_the_file(case, observation, x, np.array(level)))


def _bed(case: Case, observation: Observation, x: float, y: Array) -> Array:
    """Bed level at x and each y in the datum of the file: in it the lowest bed of the section is `floor`, if given."""
    return _in_the_file(case, observation, x, _local_bed(case, str(observation.experiment), x, y))


def _in_the_file(case: Case, observation: Observation, x: float, level: Array) -> Array:
    """A level of the model at x in z of the file [m]: the same without a `floor`."""
    if observation.floor is None:
        return level
    return level - _local_bed(case, str(observation.experiment), x, _across(case)).min() + observation.floor


def _local_bed(case: Case, experiment: str, x: float, y: Array) -> Array:
    return bed_levels(case, Grid(np.array([x]), y, GRID_STEP, GRID_STEP, centreline_in(case)), experiment)[0]


def _across(case: Case) -> Array:
    low, high = case.grid.y
    return np.arange(low + GRID_STEP / 2.0, high, GRID_STEP)


def _column(points: pd.DataFrame) -> Column:
    height, velocity, error = (points[name].to_numpy() for name in ("height", "u", "standard_error"))
    return Column(height, velocity, error, float(points["depth"].iloc[0]))


def _profile(points: pd.DataFrame) -> dict[str, object]:
    """One row of Observations.profiles from all points of one vertical; a dead one is averaged too, to be shown."""
    first, wet = points.iloc[0], points[points["height"].gt(0.0) & points["height"].le(points["depth"])]
    used = bool(points["used"].any())
    row = {name: first[name] for name in ("experiment", "section", "x", "y", "bed", "depth", "plants", "device")}
    row |= {"points": len(wet), "used": used, "reason": "" if used else first["reason"], "law": "none"}
    row |= dict.fromkeys(
        ("linear", "linear_error", "fitted", "fitted_error", "within", "slope", "top", "scatter"), np.nan
    )
    if wet.empty:
        return row
    column = _column(wet)
    fit = fit_two_layers(column) if first["plants"] else fit_log_law(column)
    linear, linear_error = linear_average(column, fit.scatter if fit else 1.0)
    row |= {"linear": linear, "linear_error": linear_error}
    if len(wet) < FEWEST_POINTS:
        average, error = few_points_average(column, bool(first["plants"]))
        return row | {"fitted": average, "fitted_error": error, "law": "few points"}
    if fit is None and first["plants"]:
        average, error = average_within_plants(column)
        return row | {"fitted": average, "fitted_error": error, "law": "uniform at the bed"}
    if fit is None:
        return row | {"fitted": linear, "fitted_error": linear_error, "law": "linear"}
    fitted, fitted_error = fit.average(column.depth)
    law = "two layers" if first["plants"] else "log law"
    curve = {"within": fit.within, "slope": fit.slope, "top": fit.top, "scatter": fit.scatter}
    return row | curve | {"fitted": fitted, "fitted_error": fitted_error, "law": law}
