"""Do gauges allow the level at the outlet: does water rise to it by more than its velocity could lift it?"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.parameter_space import middle_value, prior_range
from vegglue.case.schema import Case
from vegglue.diagnosis.directions import rising_levels
from vegglue.effects.physical_constants import GRAVITY
from vegglue.measurements.kinds import WATER_LEVEL, kind_of
from vegglue.measurements.observations import Observations
from vegglue.wording.numbers import in_digits, listed

# Rise [m] that gauges and the level of an outlet may show by chance, beside so many standard errors [-]. Chosen:
# a bed that is uneven by millimetres, and a surface that waves.
RISE_BY_CHANCE, SURE_OF_A_RISE = 0.003, 3.0
# Velocity head of a section over that of its mean velocity [-]: 1.15 to 1.5 in streams (Chow 1959, table 2-1).
UNEVENNESS = 1.5


@dataclass(frozen=True)
class _Low:
    """A gauge at x that stands at a level below that of the outlet; all in m."""

    x: float
    gauge: float
    outlet: float

    @property
    def rise(self) -> float:
        """From the gauge to the outlet [m]."""
        return self.outlet - self.gauge


def remarks_on_outlet_levels(case: Case, site: Site, observations: Observations) -> Iterator[str]:
    """Outlets above the gauge next to them; of no experiment whose gauges rise among themselves, which is told."""
    told = rising_levels(case, observations)
    low = {name: _low(case, site, observations.table, name) for name in case.experiments if name not in told}
    found = {name: one for name, one in low.items() if one is not None}
    for x in dict.fromkeys(one.x for one in found.values()):
        yield _low_in_words(case, {name: one for name, one in found.items() if one.x == x})


def _low(case: Case, site: Site, table: pd.DataFrame, experiment: str) -> _Low | None:
    """Of the last gauge, if its velocity head, RISE_BY_CHANCE and its errors do not explain how low it stands."""
    here = table["used"] & (table["experiment"] == experiment) & (table["kind"] == WATER_LEVEL)
    gauges = table[here]
    if gauges.empty:
        return None
    last = gauges[gauges["x"] == gauges["x"].max()]
    x, level = float(last["x"].iloc[0]), float(last["value"].mean())
    error = float(last["standard_error"].astype(float).fillna(kind_of(WATER_LEVEL).usual_error).mean())
    depth = np.maximum(level - in_experiment(site, experiment).bed[np.abs(site.grid.x - x).argmin()], 0.0)
    area = float(depth.sum()) * site.grid.dy
    if area <= 0.0:
        return None  # told as a station on land, or a level without sense
    stated = case.experiments[experiment]
    speed = sum(middle_value(case, value) for value in stated.discharge.values()) / area
    lifted = UNEVENNESS * speed**2 / (2.0 * GRAVITY)
    one = _Low(x, level, prior_range(case, stated.level)[0])
    return one if one.rise > lifted + RISE_BY_CHANCE + SURE_OF_A_RISE * error else None


def _low_in_words(case: Case, found: Mapping[str, _Low]) -> str:
    """One sentence for all experiments of one gauge."""
    x = next(iter(found.values())).x
    reads = listed([f"{in_digits(one.gauge, 4)} m in {name}" for name, one in found.items()])
    low = listed([in_digits(1000.0 * one.rise, 2) for one in found.values()])
    return (
        f"The gauge at x = {x:g} m reads {reads}, {low} mm below the level at the outlet "
        f"{in_digits(case.grid.x[1] - x)} m further downstream, and the water is too slow to rise so much: the level "
        "at the outlet may be a depth, or have another datum than the gauges; correct `level` of the experiment, or "
        "the gauges."
    )
