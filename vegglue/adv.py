"""ADV points of one section: placed in the channel, judged, averaged over the depth and summed to the discharge."""

import os
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vegglue.discharge import CrossSection, Discharge, combine, conveyance_weights, grid_weights, neighbour_error
from vegglue.errors import InputError
from vegglue.profile import (
    Array,
    CanopyHeight,
    Column,
    ProfileFit,
    fit_canopy_height,
    fit_log_law,
    fit_two_layers,
    linear_average,
    sampling_error,
)
from vegglue.quality import dead_probes
from vegglue.schema import Case, Observation
from vegglue.site import Grid, bed_levels, cells_of_patch
from vegglue.table import read_table, refuse_repeated, refuse_rows

EDGE = 0.05  # m, a vertical closer to the edge of a patch stands beside the plants as much as in them
GRID_STEP = 0.02  # m, along y and z: cells of the regular grid a section is summed on
SMALLEST_ERROR = 0.001  # m/s, resolution of an ADV; keeps one calm point from outweighing all others
# Stand-ins for what a file leaves out, chosen so that errors come out too large rather than too small.
TURBULENCE = 0.15  # u_std over the mean velocity of the vertical
DURATION = 60.0  # s
SLOWEST = 0.05  # m/s, below which the mean velocity of a vertical says nothing about its time scale


@dataclass(frozen=True)
class Section:
    """One measured section: `points`, `profiles`, `discharge` and `canopy_height` as in observations.Observations."""

    points: pd.DataFrame
    profiles: pd.DataFrame
    discharge: dict[str, Discharge]
    canopy_height: CanopyHeight | None


def read_section(case: Case, observation: Observation) -> Section:
    """Everything one `kind: adv` entry yields; InputError names file and row of what cannot be used as given."""
    points = _read_points(observation)
    x = float(points["x"].iloc[0])
    section = _cross_section(case, observation, x)
    plants = _among_plants(case, observation, x, points["y"].to_numpy())
    points = _without_dead_probes(_with_errors(_placed(observation, points, section, plants)), section)
    profiles = pd.DataFrame([_profile(group) for _, group in points.groupby("y", sort=True)])
    columns = {y: _column(group) for y, group in points[points["plants"] & points["used"]].groupby("y")}
    canopy = fit_canopy_height(list(columns.values())) if points["plants"].any() else None
    return Section(points, profiles, _discharge(section, points, profiles), canopy)


def average_of(profiles: pd.DataFrame, rule: str) -> tuple[pd.Series, pd.Series]:
    """Depth average and standard error (rows,) [m/s] by the rule `paper` or `profile`.

    The error of the paper's rule has a part for the straight line it draws to the bed and the constant it draws to the
    surface: the difference d between both rules taken as the bound of a uniform distribution, d / sqrt(3).
    """
    if rule == "profile":
        return profiles["fitted"], profiles["fitted_error"]
    shape = (profiles["linear"] - profiles["fitted"]) / np.sqrt(3.0)
    return profiles["linear"], np.hypot(profiles["linear_error"], shape)


def _read_points(observation: Observation) -> pd.DataFrame:
    path = observation.file
    rows = read_table(path, ("case", "device"), ("x", "y", "z", "u"), ("v", "w", "u_std", "duration_s"))
    for column in {"u_std", "duration_s"} & set(rows.columns):
        wrong = rows[column] < 0.0 if column == "u_std" else rows[column] <= 0.0
        refuse_rows(path, wrong, f"expected {column} above 0; mend or remove the row")
    refuse_repeated(path, rows, ("case", "x", "y", "z"))
    chosen = rows[rows["case"] == observation.case]
    if chosen.empty:
        raise InputError(
            f"{os.path.relpath(path)}: expected rows with case {observation.case!r}, got {', '.join(rows['case'].unique())}; "
            f"correct `case` in the observation."
        )
    refuse_rows(path, chosen["x"] != chosen["x"].iloc[0], f"expected the x of case {observation.case!r}, a single section")
    moved = chosen.assign(x=chosen["x"] + observation.offset.x, y=chosen["y"] + observation.offset.y)
    return moved.drop(columns="case").sort_values(["y", "z"]).reset_index(drop=True)


def _placed(observation: Observation, points: pd.DataFrame, section: CrossSection, plants: Array) -> pd.DataFrame:
    """Points with bed (datum of the file), depth and height above the bed; those outside the water are not used."""
    bed = np.interp(points["y"], section.y, section.bed)
    points = points.assign(
        experiment=observation.experiment,
        section=observation.section,
        bed=bed,
        depth=section.surface - bed,
        height=points["z"] - bed,
        plants=plants,
        reason="",
    )
    points.loc[points["height"] <= 0.0, "reason"] = "below the bed"
    points.loc[points["z"] > section.surface, "reason"] = "above the water surface"
    points["used"] = points["reason"] == ""
    if not points["used"].any():
        raise InputError(
            f"{os.path.relpath(observation.file)}: expected points between the bed and the water surface at z = "
            f"{section.surface:g} m, got none with case {observation.case!r}; check `floor`, `surface` and `offset`."
        )
    return points


def _cross_section(case: Case, observation: Observation, x: float) -> CrossSection:
    """Bed and water level across the grid at x, in the datum of the file: the lowest bed of the section is `floor`."""
    low, high = case.grid.y
    y = np.arange(low + GRID_STEP / 2.0, high, GRID_STEP)
    bed = bed_levels(case, Grid(np.array([x]), y, GRID_STEP, GRID_STEP))[0]
    return CrossSection(y, bed - bed.min() + float(observation.floor or 0.0), float(observation.surface or 0.0))


def _among_plants(case: Case, observation: Observation, x: float, y: Array) -> NDArray[np.bool_]:
    """Whether the verticals at y stand in plants of the experiment, at least EDGE inside their patch."""
    present = case.experiments[str(observation.experiment)].plants
    patches = [patch for patch in case.plants.patches if present is True or (present and patch.name in present)]
    result = np.zeros(len(y), dtype=bool)
    for patch in patches:
        left, right = (cells_of_patch(patch, Grid(np.array([x]), y + side, 1.0, 1.0))[0] for side in (-EDGE, EDGE))
        result |= left & right
    return result


def _with_errors(points: pd.DataFrame) -> pd.DataFrame:
    """Sampling error of every point; the integral time scale, which no file gives, is taken as h / U of the vertical.

    That is eddies as long as the water is deep, carried past at the mean velocity.
    """
    mean = points["u"].abs().groupby(points["y"]).transform("mean").clip(lower=SLOWEST)
    deviation = points["u_std"] if "u_std" in points else TURBULENCE * mean
    duration = points["duration_s"] if "duration_s" in points else pd.Series(DURATION, index=points.index)
    scale = (points["depth"].clip(lower=0.0) / mean).to_numpy()
    error = sampling_error(deviation.to_numpy(), duration.to_numpy(), scale)
    return points.assign(standard_error=np.maximum(error, SMALLEST_ERROR), u_std=points.get("u_std", np.nan))


def _without_dead_probes(points: pd.DataFrame, section: CrossSection) -> pd.DataFrame:
    """Points with `used` false and the reason given in every vertical where the probe was dead."""
    usable = points[points["used"]]
    verticals = usable.groupby("y").agg(
        points=("u", "size"), mean=("u", "mean"), deviation=("u_std", "median"), plants=("plants", "first")
    )
    largest = usable["u"].abs().groupby(usable["y"]).max()
    wet = section.y[section.depth > 0.0]
    reasons = dead_probes(
        verticals.index.to_numpy(),
        (float(wet[0]), float(wet[-1])),
        verticals["points"].to_numpy(),
        largest.to_numpy(),
        verticals["mean"].to_numpy(),
        verticals["deviation"].to_numpy(),
        verticals["plants"].to_numpy(),
    )
    reason = points["y"].map(dict(zip(verticals.index, reasons, strict=True))).fillna("")
    return points.assign(reason=points["reason"].mask(reason != "", reason), used=points["used"] & (reason == ""))


def _column(points: pd.DataFrame) -> Column:
    height, velocity, error = (points[name].to_numpy() for name in ("height", "u", "standard_error"))
    return Column(height, velocity, error, float(points["depth"].iloc[0]))


def _profile(points: pd.DataFrame) -> dict[str, object]:
    """One row of Observations.profiles from all points of one vertical."""
    first = points.iloc[0]
    inside_water = points[(points["height"] > 0.0) & ~points["reason"].str.startswith("above")]
    used = bool(points["used"].any())
    row = {name: first[name] for name in ("experiment", "section", "x", "y", "bed", "depth", "plants", "device")}
    row |= {"points": len(inside_water), "used": used, "reason": "" if used else first["reason"]}
    if inside_water.empty:
        nothing = dict.fromkeys(("linear", "linear_error", "fitted", "fitted_error", "within", "slope", "top", "scatter"), np.nan)
        return row | nothing | {"law": "none"}
    column = _column(inside_water)
    fit = fit_two_layers(column) if first["plants"] else fit_log_law(column)
    return row | _averages(column, fit, "two layers" if first["plants"] else "log law")


def _averages(column: Column, fit: ProfileFit | None, law: str) -> dict[str, object]:
    linear, linear_error = linear_average(column, fit.scatter if fit else 1.0)
    if fit is None:
        unknown = {"within": np.nan, "slope": np.nan, "top": np.nan, "scatter": np.nan}
        return unknown | {
            "linear": linear, "linear_error": linear_error, "fitted": linear, "fitted_error": linear_error, "law": "linear",
        }  # fmt: skip
    fitted, fitted_error = fit.average(column.depth)
    return {
        "linear": linear, "linear_error": linear_error, "fitted": fitted, "fitted_error": fitted_error, "law": law,
        "within": fit.within, "slope": fit.slope, "top": fit.top, "scatter": fit.scatter,
    }  # fmt: skip


def _discharge(section: CrossSection, points: pd.DataFrame, profiles: pd.DataFrame) -> dict[str, Discharge]:
    """By both rules, from the verticals that are used."""
    good = profiles[profiles["used"]]
    position, scatter = good["y"].to_numpy(), good["scatter"].fillna(1.0).to_numpy()
    columns = [_column(group) for _, group in points[points["used"]].groupby("y")]
    grid = grid_weights(section, position, columns, GRID_STEP)
    area = np.array([weights.sum() for weights in grid])
    paper = sum(float(weights @ column.velocity) for weights, column in zip(grid, columns, strict=True))
    errors = [
        factor * np.linalg.norm(weights * column.standard_error)
        for weights, column, factor in zip(grid, columns, scatter, strict=True)
    ]
    conveyance = conveyance_weights(section, position, good["depth"].to_numpy())
    profile = float(conveyance @ good["fitted"])
    rule = float(abs(paper - profile) / np.sqrt(3.0))
    spacing = neighbour_error(position, good["fitted"].to_numpy())
    return {
        "paper": combine(paper, float(np.linalg.norm(errors)), spacing * float(np.linalg.norm(area)), rule),
        "profile": combine(
            profile,
            float(np.linalg.norm(conveyance * good["fitted_error"])),
            spacing * float(np.linalg.norm(conveyance)),
            0.0,
        ),
    }
