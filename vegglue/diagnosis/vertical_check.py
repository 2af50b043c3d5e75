"""Checks of ADV verticals: their heights, their columns, and the standard errors that their neighbours give.

Each check yields remarks, frozen values whose words stand in `wording/templates/checks.j2`. Lengths in m.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.parameter_space import Bounds
from vegglue.case.schema import Case
from vegglue.measurements.adv_section import ABOVE_SURFACE, BELOW_BED, average_of, upward_column
from vegglue.measurements.observations import Observations
from vegglue.measurements.section_discharge import neighbour_error

# Verticals that make a rule, and the share of them that run the other way round [-]. A single one may lie in a wake.
FEWEST, MOST_OF_ALL = 3, 0.8
# Fall of the bed [m], and over the scatter of the lowest points [-], from which it is seen whether these follow the
# bed. A probe is set to a height to 1 or 2 mm; points that do follow scatter by 0.3 to 0.4 of the fall itself.
LEAST_FALL, OVER_THE_SCATTER = 0.003, 4.0
# Share of the change of the bed by which lowest points move with it [-]: 1 for levels, 0 for heights above the bed.
HALFWAY = 0.5
# A normal standard deviation over the median deviation [-].
OF_A_NORMAL = 1.4826
# How many times the error that points state [-], and that of neighbours on the same side of the plants, the one of all
# neighbours must be for a remark. Chosen: three times the error is a ninth of the weight; on 20 verticals of a brook
# neighbours give as much on either side as across, and a jump at plants is not why.
OVER_POINTS, OVER_ONE_SIDE = 3.0, 2.0


@dataclass(frozen=True)
class HeightsFromSurface:
    """Verticals outside plants whose velocities fall towards the surface, of all; x, y of the first."""

    falling: int
    verticals: int
    first: tuple[float, float]


@dataclass(frozen=True)
class HeightsExchanged:
    """A file whose heights (column `upward`) and velocities look exchanged in some of its verticals; first: x, y."""

    file: Path
    upward: str
    exchanged: int
    verticals: int
    first: tuple[float, float]


@dataclass(frozen=True)
class PointsOutsideWater:
    """Points excluded below the bed or above the surface in verticals that others keep in use; height above the bed
    and depth of water of the first. levels_doubted: another remark questions the levels of their experiments.
    """

    points: int
    sections: tuple[str, ...]
    experiments: tuple[str, ...]
    reason: str
    first: tuple[float, float]
    height: float
    depth: float
    levels_doubted: bool


@dataclass(frozen=True)
class HeightsTakenForLevels:
    """Verticals of a file that begin at one z while the bed falls by so much from one x to another, as in the first
    experiment; z: middle of the lowest points in each; heading: of the column z where it was imported, '' if unknown.
    """

    file: str
    experiments: tuple[str, ...]
    z: tuple[float, ...]
    first: float
    last: float
    fall: float
    heading: str


@dataclass(frozen=True)
class ErrorsAcrossPlants:
    """Sections across the side of a patch whose verticals get errors from the jump of velocities there.

    sections: (experiment, section); ranges over them of the errors [m/s] from all neighbours, from the points, and from
    neighbours on the same side of the plants.
    """

    sections: tuple[tuple[str, str], ...]
    neighbours: Bounds
    points: Bounds
    one_side: Bounds


def remarks_on_heights(observations: Observations) -> Iterator[HeightsFromSurface]:
    """Verticals outside plants whose velocities fall towards the surface, nearly all: heights may count downward."""
    falling = [
        (x, y, float(np.polyfit(some["height"], some["u"], 1)[0]) < 0.0)
        for x, y, some in _open_verticals(observations.points)
    ]
    down = [(x, y) for x, y, falls in falling if falls]
    if len(falling) >= FEWEST and len(down) >= MOST_OF_ALL * len(falling):
        yield HeightsFromSurface(len(down), len(falling), down[0])


def remarks_on_exchanged_heights(case: Case, observations: Observations) -> Iterator[HeightsExchanged]:
    """Tables whose velocities grow from the bed as heights do, and heights as velocities, in nearly all verticals
    outside plants: near the bed water has more of its speed than of its height, u/u_top > z/z_top.
    """
    points = observations.points
    of_file: dict[Path, list[tuple[float, float, bool]]] = {}
    for one in [one for one in case.observations if one.kind == "adv"]:
        for x, y, some in _open_verticals(
            points[(points["experiment"] == one.experiment) & (points["section"] == one.section)]
        ):
            upward = some.sort_values("height")[["height", "u"]].to_numpy(float)
            share = upward[:-1] / upward[-1]
            odd = bool(upward[-1, 1] > 0.0 and (share[:, 1] < share[:, 0]).all())
            of_file.setdefault(one.file, []).append((x, y, odd))
    for file, verticals in of_file.items():
        exchanged = [(x, y) for x, y, odd in verticals if odd]
        if len(verticals) >= FEWEST and len(exchanged) >= MOST_OF_ALL * len(verticals):
            yield HeightsExchanged(file, upward_column(file), len(exchanged), len(verticals), exchanged[0])


def _open_verticals(points: pd.DataFrame) -> Iterator[tuple[float, float, pd.DataFrame]]:
    """x, y and used points of each vertical outside plants with points at two heights or more."""
    open_ones = points[points["used"] & ~points["plants"]]
    for (_, _, x, y), some in open_ones.groupby(["experiment", "section", "x", "y"], sort=False):
        if some["height"].nunique() > 1:
            yield float(x), float(y), some


def remarks_on_lost_points(observations: Observations, doubted: Collection[str] = ()) -> Iterator[PointsOutsideWater]:
    """Points outside the water in verticals that others keep in use, which would be lost unnoticed: those above the
    surface, and those below the bed.

    doubted: experiments whose levels have a remark already.
    """
    points = observations.points
    if points.empty:
        return
    kept = points.groupby(["experiment", "section", "x", "y"])["used"].transform("any")
    lost = points[kept & points["reason"].isin((BELOW_BED, ABOVE_SURFACE))]
    for reason, some in lost.groupby("reason", sort=False):
        first, experiments = some.iloc[0], tuple(map(str, some["experiment"].unique()))
        yield PointsOutsideWater(
            points=len(some),
            sections=tuple(map(str, some["section"].unique())),
            experiments=experiments,
            reason=str(reason),
            first=(float(first["x"]), float(first["y"])),
            height=float(first["height"]),
            depth=float(first["depth"]),
            levels_doubted=any(name in doubted for name in experiments),
        )


def remarks_on_unmoved_heights(case: Case, observations: Observations) -> Iterator[HeightsTakenForLevels]:
    """Files whose verticals begin at one z while the bed falls: they may count from the bed below each. Sections with a
    `floor` of their own count from there, and are left out.
    """
    points = observations.points
    sections: dict[tuple[Path, str], list[str]] = {}
    for one in case.observations:
        if one.kind == "adv" and one.floor is None and upward_column(one.file) == "z":
            sections.setdefault((one.file, str(one.experiment)), []).append(str(one.section))
    found: dict[Path, list[tuple[str, float, float, float, float]]] = {}
    for (file, experiment), names in sections.items():
        own = points[(points["experiment"] == experiment) & points["section"].isin(names)]
        lowest = own.sort_values("z").groupby(["section", "x", "y"], as_index=False).first()
        middle = lowest.groupby("x")[["z", "bed"]].median()
        if len(lowest) < FEWEST:
            continue
        fall = float(middle["bed"].iloc[0] - middle["bed"].iloc[-1])
        if _keeps_its_level(lowest["z"].to_numpy(), middle, fall):
            first, last = float(middle.index[0]), float(middle.index[-1])
            found.setdefault(file, []).append((experiment, float(lowest["z"].median()), first, last, fall))
    for file, ones in found.items():
        _, _, first, last, fall = ones[0]
        known = [one.columns["z"] for one in case.imported or () if one.name == file.name and "z" in one.columns]
        heading = known[0] if known else ""
        names_, z = tuple(one[0] for one in ones), tuple(one[1] for one in ones)
        yield HeightsTakenForLevels(file.name, names_, z, first, last, fall, heading)


def _keeps_its_level(z: Array, middle: pd.DataFrame, fall: float) -> bool:
    """Whether the lowest points z (vertical,) [m] stay where they are while the bed falls.

    middle: z and bed of the sections, downstream; the median of dz / dbed between any two shows which of both holds.
    """
    scatter = OF_A_NORMAL * float(np.median(np.abs(z - np.median(z))))
    if fall < max(LEAST_FALL, OVER_THE_SCATTER * scatter):
        return False
    one, other = np.triu_indices(len(middle), 1)
    level, bed = (np.diff(middle[name].to_numpy(float)[np.array([one, other])], axis=0)[0] for name in ("z", "bed"))
    far = np.abs(bed) > HALFWAY * fall
    return float(np.median(level[far] / bed[far])) < HALFWAY


def remarks_on_errors_across_plants(case: Case, observations: Observations) -> Iterator[ErrorsAcrossPlants]:
    """Sections across the side of a patch whose errors come from the jump of velocities there; in one remark."""
    found: list[tuple[tuple[str, str], float, float, float]] = []
    for one in [one for one in case.observations if one.kind == "adv" and one.standard_error is None]:
        key, profiles = (str(one.experiment), str(one.section)), observations.profiles
        own = profiles[(profiles["experiment"] == key[0]) & (profiles["section"] == key[1])]
        own = own[own["used"]].sort_values("y")
        if own["plants"].nunique() < 2:
            continue
        error, points = observations.neighbour_error[key], float(average_of(own, str(one.average))[1].median())
        changes = own["plants"].ne(own["plants"].shift()).cumsum()
        sides = [neighbour_error(part["y"].to_numpy(), part["fitted"].to_numpy()) for _, part in own.groupby(changes)]
        known = [side for side in sides if np.isfinite(side)]
        if known and error > max(OVER_POINTS * points, OVER_ONE_SIDE * max(known)):
            found.append((key, error, points, max(known)))
    if found:
        keys, *errors = zip(*found, strict=True)
        yield ErrorsAcrossPlants(keys, *((min(one), max(one)) for one in errors))
