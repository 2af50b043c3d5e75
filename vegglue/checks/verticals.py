"""Do the points of verticals lie in the water, and do their velocities grow from the bed to the surface?"""

from collections.abc import Iterator

import numpy as np

from vegglue.in_short import so_many
from vegglue.measurements.adv_section import ABOVE_SURFACE, BELOW_BED
from vegglue.measurements.observations import Observations

# Verticals that make a rule, and the share of them that run the other way round [-]. A single one may lie in a wake.
FEWEST, MOST_OF_ALL = 3, 0.8


def remarks_on_heights(observations: Observations) -> Iterator[str]:
    """Verticals outside plants whose velocities fall towards the surface, nearly all: heights may count downward."""
    points = observations.points
    if points.empty:
        return
    open_ones = points[points["used"].astype(bool) & ~points["plants"].astype(bool)]
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


def remarks_on_lost_points(observations: Observations) -> Iterator[str]:
    """Points outside the water in verticals that others keep in use: nobody would miss them."""
    points = observations.points
    if points.empty:
        return
    vertical = ["experiment", "section", "x", "y"]
    kept = points.groupby(vertical)["used"].transform("any").astype(bool)
    lost = points[kept & points["reason"].isin((BELOW_BED, ABOVE_SURFACE))]
    for (experiment, section, reason), some in lost.groupby(["experiment", "section", "reason"], sort=False):
        first = some.iloc[0]
        yield (
            f"{so_many(len(some), 'point')} of {section} in experiment {experiment} not used: {reason}, the first at "
            f"x = {first['x']:g}, y = {first['y']:g} m, {first['height']:.2g} m above the bed in {first['depth']:.2g} "
            "m of water; check unit and sign of heights, the bed and the levels."
        )
