"""Does the water run the way the measurements say: downstream along x, and downhill?"""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from vegglue.case.schema import Case
from vegglue.measurements.kinds import STREAMWISE, TRANSVERSE, WATER_LEVEL
from vegglue.measurements.observations import Observations

# Fewest stations from which something is said of a whole section: two may stand in an eddy.
FEWEST_OF_A_SECTION = 3
# Rise of the water downstream [m], and over its standard error [-], from which levels run uphill: velocity heads,
# which a widening gives back, are 5 mm at 0.3 m/s.
RISE, SURE = 0.01, 4.0
# What is likely where all of it runs upstream, and what mends it.
OF_A_FRAME = (
    "x or u is reversed, or components of a map were not turned; `flip: [x]` and `frame` of `vegglue import` mend that"
)
OF_A_LINE = (
    "the centreline is drawn from its lower end, which `reverse: true` of `vegglue import` mends, or u is reversed"
)


def remarks_on_directions(case: Case, observations: Observations) -> Iterator[str]:
    """Velocities that run upstream or across, and levels that rise downstream; by experiment."""
    table = observations.table
    used = table[table["used"].astype(bool)]
    for name in case.experiments:
        own = used[used["experiment"] == name]
        yield from _upstream(name, own[own["kind"] == STREAMWISE], case.grid.centreline is not None)
        yield from _across(name, own)
        yield from _uphill(name, own[own["kind"] == WATER_LEVEL])


def _upstream(name: str, rows: pd.DataFrame, on_a_line: bool) -> Iterator[str]:
    """All of it, or whole sections, against the way downstream. on_a_line: whether the grid follows a centreline."""
    mean = rows.groupby("section")["value"].agg(["mean", "size", "max"])
    against = mean[(mean["max"] < 0.0) & (mean["size"] >= FEWEST_OF_A_SECTION)]
    if len(rows) and rows["value"].median() < 0.0:  # one mark for a missing value is told elsewhere
        yield (
            f"Velocities of experiment {name} run upstream, {rows['value'].median():.2g} m/s in the middle: "
            f"{OF_A_LINE if on_a_line else OF_A_FRAME}."
        )
    elif len(against):
        yield (
            f"All velocities of {', '.join(map(str, against.index))} in experiment {name} run upstream, "
            f"{against['mean'].mean():.2g} m/s on average: check the sign of u there."
        )


def _across(name: str, rows: pd.DataFrame) -> Iterator[str]:
    """More water across than along: components exchanged, or of the map."""
    along, across = (rows.loc[rows["kind"] == kind, "value"].abs().median() for kind in (STREAMWISE, TRANSVERSE))
    if np.isfinite(along) and across > along:
        yield (
            f"Velocities across of experiment {name} are larger than those along, {across:.2g} and {along:.2g} m/s in "
            "the middle: u and v are exchanged, or components of a map were not turned."
        )


def _uphill(name: str, rows: pd.DataFrame) -> Iterator[str]:
    """The water at the last gauges above that at the first."""
    if rows["x"].nunique() < 2:
        return
    first, last = (rows[rows["x"] == end] for end in (rows["x"].min(), rows["x"].max()))
    rise = float(last["value"].mean() - first["value"].mean())
    error = float(np.hypot(first["standard_error"].fillna(0.0).mean(), last["standard_error"].fillna(0.0).mean()))
    if rise > max(RISE, SURE * error):
        yield (
            f"Levels of experiment {name} rise downstream, by {rise:.2g} m from x = {first['x'].iloc[0]:g} to "
            f"{last['x'].iloc[0]:g} m: x is reversed, or a gauge has another datum."
        )
