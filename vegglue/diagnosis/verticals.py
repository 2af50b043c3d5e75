"""Do the points of verticals lie in the water, and do their velocities grow from the bed to the surface?"""

from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.case.schema import Case
from vegglue.errors import shown_path
from vegglue.measurements.adv_section import ABOVE_SURFACE, BELOW_BED, upward_column
from vegglue.measurements.observations import Observations
from vegglue.wording.numbers import experiments_in_words, listed, so_many

# Verticals that make a rule, and the share of them that run the other way round [-]. A single one may lie in a wake.
FEWEST, MOST_OF_ALL = 3, 0.8
CHECK_HEIGHTS = "check unit and sign of heights, the bed and the levels"


def remarks_on_heights(observations: Observations) -> Iterator[str]:
    """Verticals outside plants whose velocities fall towards the surface, nearly all: heights may count downward."""
    points = observations.points
    if points.empty:
        return
    open_ones = points[points["used"] & ~points["plants"]]
    falling = [
        (x, y, float(np.polyfit(some["height"], some["u"], 1)[0]) < 0.0)
        for (_, _, x, y), some in open_ones.groupby(["experiment", "section", "x", "y"], sort=False)
        if some["height"].nunique() > 1
    ]
    down = [(x, y) for x, y, falls in falling if falls]
    if len(falling) >= FEWEST and len(down) >= MOST_OF_ALL * len(falling):
        yield (
            f"Velocities fall from the bed to the surface in {len(down)} of {len(falling)} verticals outside plants, "
            f"the first at x = {down[0][0]:g}, y = {down[0][1]:g} m, as if their heights counted from the surface: z "
            "and `height` count upward."
        )


def remarks_on_exchanged_heights(case: Case, observations: Observations) -> Iterator[str]:
    """Tables whose velocities grow from the bed as heights do, and heights as velocities, in nearly all verticals
    outside plants: near the bed water has more of its speed than of its height.
    """
    points = observations.points
    if points.empty:
        return
    of_file: dict[Path, list[tuple[float, float, bool]]] = {}
    for one in case.observations:
        own = points[(points["experiment"] == one.experiment) & (points["section"] == one.section)]
        if one.kind == "adv" and not own.empty:
            of_file.setdefault(one.file, []).extend(_as_if_exchanged(own))
    for file, verticals in of_file.items():
        odd = [(x, y) for x, y, exchanged in verticals if exchanged]
        if len(verticals) >= FEWEST and len(odd) >= MOST_OF_ALL * len(verticals):
            upward = upward_column(file)
            yield (
                f"{shown_path(file)}: the columns `{upward}` and `u` look exchanged: in {len(odd)} of {len(verticals)} "
                f"verticals outside plants, the first at x = {odd[0][0]:g}, y = {odd[0][1]:g} m, lower points "
                "have a smaller share of the velocity at the top than of its height, and in a stream a larger one; "
                f"exchange the two headings, or say which column is which by `columns: {{{upward}: ..., u: ...}}` of "
                "the file in the site file; if they are right, correct the bed or the level that heights count from."
            )


def _as_if_exchanged(points: pd.DataFrame) -> Iterator[tuple[float, float, bool]]:
    """Of each vertical outside plants: x, y [m], and whether u/u_top < z/z_top at all points but the top one."""
    open_ones = points[points["used"] & ~points["plants"]]
    for (x, y), some in open_ones.groupby(["x", "y"], sort=False):
        if some["height"].nunique() > 1:
            upward = some.sort_values("height")[["height", "u"]].to_numpy(float)
            share = upward[:-1] / upward[-1]
            yield x, y, bool(upward[-1, 1] > 0.0 and (share[:, 1] < share[:, 0]).all())


def remarks_on_lost_points(observations: Observations, doubted: Collection[str] = ()) -> Iterator[str]:
    """Points outside the water in verticals that others keep in use: nobody would miss them. One sentence for those
    above the surface, one for those below the bed.

    doubted: experiments of whose levels something is said already.
    """
    points = observations.points
    if points.empty:
        return
    vertical = ["experiment", "section", "x", "y"]
    kept = points.groupby(vertical)["used"].transform("any").astype(bool)
    lost = points[kept & points["reason"].isin((BELOW_BED, ABOVE_SURFACE))]
    for reason, some in lost.groupby("reason", sort=False):
        first = some.iloc[0]
        experiments = [str(name) for name in some["experiment"].unique()]
        follows = any(name in doubted for name in experiments)
        advice = "correct the levels told of above first" if follows else CHECK_HEIGHTS
        yield (
            f"{so_many(len(some), 'point')} of {listed([str(one) for one in some['section'].unique()])} in "
            f"{experiments_in_words(experiments)} not used: {reason}, the first at x = {first['x']:g}, "
            f"y = {first['y']:g} m, {first['height']:.2g} m above the bed in {first['depth']:.2g} m of water; {advice}."
        )
