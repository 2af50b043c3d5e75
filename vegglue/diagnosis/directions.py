"""Does the water run the way the measurements say: downstream along x, and downhill?

One cause is said in one sentence of all experiments that show it; what follows from it is left out.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.case.schema import Case
from vegglue.effects.physical_constants import GRAVITY
from vegglue.measurements.kinds import STREAMWISE, TRANSVERSE, WATER_LEVEL
from vegglue.measurements.observations import Observations
from vegglue.wording.numbers import experiments_in_words

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


@dataclass(frozen=True)
class _Rise:
    """A gauge and the next one downstream, x [m] each, between which the water rises [m]."""

    first: float
    last: float
    rise: float


def remarks_on_directions(case: Case, observations: Observations) -> Iterator[str]:
    """Velocities that run across or upstream, and levels that rise downstream."""
    exchanged, on_a_line = _exchanged(case, observations), case.grid.centreline is not None
    of = {name: rows for name, rows in _by_experiment(case, observations).items() if name not in exchanged}
    along = {name: rows[rows["kind"] == STREAMWISE] for name, rows in of.items()}
    yield from _across_in_words(exchanged)
    yield from _upstream(along, on_a_line)
    yield from _uphill_in_words(_rising(case, observations))


def exchanged_components(case: Case, observations: Observations) -> tuple[str, ...]:
    """Experiments with more water across than along: components exchanged, or of the map."""
    return tuple(_exchanged(case, observations))


def rising_levels(case: Case, observations: Observations) -> tuple[str, ...]:
    """Experiments whose levels rise downstream."""
    return tuple(_rising(case, observations))


def misdirected(case: Case, observations: Observations) -> tuple[str, ...]:
    """Experiments with an odd direction, of which no section tells what it carries."""
    upstream = [name for name, rows in _by_experiment(case, observations).items() if _runs_upstream(rows)]
    return (*_exchanged(case, observations), *_rising(case, observations), *upstream)


def _by_experiment(case: Case, observations: Observations) -> dict[str, pd.DataFrame]:
    used = observations.table[observations.table["used"]]
    return {name: used[used["experiment"] == name] for name in case.experiments}


def _runs_upstream(rows: pd.DataFrame) -> bool:
    along = rows.loc[rows["kind"] == STREAMWISE, "value"]
    return len(along) > 0 and float(along.median()) < 0.0  # one mark for a missing value is told elsewhere


def _exchanged(case: Case, observations: Observations) -> dict[str, tuple[float, float]]:
    """Of each such experiment the median |u| and |v| [m/s]."""
    middle = {
        name: tuple(float(rows.loc[rows["kind"] == kind, "value"].abs().median()) for kind in (STREAMWISE, TRANSVERSE))
        for name, rows in _by_experiment(case, observations).items()
    }
    return {name: (along, across) for name, (along, across) in middle.items() if across > along}


def _across_in_words(exchanged: Mapping[str, tuple[float, float]]) -> Iterator[str]:
    if exchanged:
        first, (along, across) = next(iter(exchanged.items()))
        which = f" of {first}" if len(exchanged) > 1 else ""
        yield (
            f"Velocities across of {experiments_in_words(list(exchanged))} are larger than those along, {across:.2g} "
            f"and {along:.2g} m/s in the middle{which}: u and v are exchanged, or components of a map were not turned."
        )


def _upstream(along: Mapping[str, pd.DataFrame], on_a_line: bool) -> Iterator[str]:
    """All of it, or whole sections, against the way downstream. on_a_line: whether the grid follows a centreline."""
    whole = {name: float(rows["value"].median()) for name, rows in along.items() if _runs_upstream(rows)}
    if whole:
        first, middle = next(iter(whole.items()))
        which = f" of {first}" if len(whole) > 1 else ""
        yield (
            f"Velocities of {experiments_in_words(list(whole))} run upstream, {middle:.2g} m/s in the middle{which}: "
            f"{OF_A_LINE if on_a_line else OF_A_FRAME}."
        )
    for name, rows in along.items():
        mean = rows.groupby("section")["value"].agg(["mean", "size", "max"])
        against = mean[(mean["max"] < 0.0) & (mean["size"] >= FEWEST_OF_A_SECTION)]
        if name not in whole and len(against):
            yield (
                f"All velocities of {', '.join(map(str, against.index))} in experiment {name} run upstream, "
                f"{against['mean'].mean():.2g} m/s on average: check the sign of u there."
            )


def _rising(case: Case, observations: Observations) -> dict[str, _Rise]:
    """Of each experiment the largest rise from one gauge to the next, or from the first to the last."""
    found = {name: _rise(rows) for name, rows in _by_experiment(case, observations).items()}
    return {name: one for name, one in found.items() if one is not None}


def _rise(rows: pd.DataFrame) -> _Rise | None:
    """Beyond its error, and beyond the head u2/2g of the fastest velocity, which a widening may give back."""
    level = rows[rows["kind"] == WATER_LEVEL].assign(standard_error=rows["standard_error"].fillna(0.0))
    gauges = level.groupby("x")[["value", "standard_error"]].mean()
    if len(gauges) < 2:
        return None
    x, z, error = (part.to_numpy(float) for part in (gauges.index, gauges["value"], gauges["standard_error"]))
    pairs = [(i, i + 1) for i in range(len(x) - 1)] + [(0, len(x) - 1)]
    i, j = max(pairs, key=lambda pair: z[pair[1]] - z[pair[0]])
    speed = rows.loc[rows["kind"] == STREAMWISE, "value"].max()
    head = 0.0 if np.isnan(speed) or j - i == len(x) - 1 else float(speed) ** 2 / (2.0 * GRAVITY)
    rise = float(z[j] - z[i])
    least = max(RISE, head, SURE * float(np.hypot(error[i], error[j])))
    return _Rise(float(x[i]), float(x[j]), rise) if rise > least else None


def _uphill_in_words(rising: Mapping[str, _Rise]) -> Iterator[str]:
    """One sentence for each pair of gauges between which the water rises."""
    for ends in dict.fromkeys((one.first, one.last) for one in rising.values()):
        by = {name: one.rise for name, one in rising.items() if (one.first, one.last) == ends}
        low, high = (f"{end(by.values()):.2g}" for end in (min, max))
        rise = low if low == high else f"{low} to {high}"
        yield (
            f"Levels of {experiments_in_words(list(by))} rise downstream, by {rise} m from x = {ends[0]:g} to "
            f"{ends[1]:g} m: x is reversed, or a gauge has another datum."
        )
