"""Do verticals get large standard errors only because their neighbours stand on the other side of plants?"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.case.schema import Case, Observation
from vegglue.measurements.adv_section import average_of
from vegglue.measurements.observations import Observations
from vegglue.measurements.section_discharge import neighbour_error
from vegglue.wording.numbers import experiments_in_words, in_digits, listed

# How many times the error that points state [-], and that of neighbours on the same side of the plants, the one of all
# neighbours must be to be told. Chosen: three times the error is a ninth of the weight; on 20 verticals of a brook
# neighbours say as much on either side as across, and a jump at plants is not why.
OVER_POINTS, OVER_ONE_SIDE = 3.0, 2.0


@dataclass(frozen=True)
class _Widened:
    """A section and errors of its verticals [m/s]: from all neighbours, from its points, from those of one side."""

    experiment: str
    section: str
    neighbours: float
    points: float
    one_side: float


def remarks_on_errors_across_plants(case: Case, observations: Observations) -> Iterator[str]:
    """Sections across the side of a patch whose errors come from the jump of velocities there; in one sentence."""
    found = [
        widened
        for one in case.observations
        if one.kind == "adv" and one.standard_error is None
        if (widened := _widened(observations, one)) is not None
    ]
    if found:
        yield _widened_in_words(found)


def _widened(observations: Observations, one: Observation) -> _Widened | None:
    key, profiles = (str(one.experiment), str(one.section)), observations.profiles
    own = profiles[(profiles["experiment"] == key[0]) & (profiles["section"] == key[1])]
    own = own[own["used"]].sort_values("y")
    plants = own["plants"]
    if plants.nunique() < 2:
        return None
    error, points = observations.neighbour_error[key], float(average_of(own, str(one.average))[1].median())
    sides = [_by_neighbours(side) for _, side in own.groupby(plants.ne(plants.shift()).cumsum())]
    known = [side for side in sides if np.isfinite(side)]
    if not known or not error > max(OVER_POINTS * points, OVER_ONE_SIDE * max(known)):
        return None
    return _Widened(*key, error, points, max(known))


def _by_neighbours(profiles: pd.DataFrame) -> float:
    """Error of a vertical by its neighbours among these alone [m/s]; NaN of fewer than three."""
    return neighbour_error(profiles["y"].to_numpy(float), profiles["fitted"].to_numpy(float))


def _widened_in_words(found: list[_Widened]) -> str:
    by = {name: [one.section for one in found if one.experiment == name] for name in (one.experiment for one in found)}
    where = listed([f"{listed(sections)} in {experiments_in_words([name])}" for name, sections in by.items()])
    return (
        f"Verticals of {where} get standard errors of {_span([one.neighbours for one in found])} mm/s from their "
        f"neighbours, where their points say {_span([one.points for one in found])} mm/s: these sections cross the "
        "side of a patch, where velocities jump (neighbours on the same side say "
        f"{_span([one.one_side for one in found])} mm/s), and what is wrong with the model there may be missed: "
        "`standard_error` of these observations in the config replaces them."
    )


def _span(errors: list[float]) -> str:
    """Lowest to highest of errors given in m/s, in mm/s."""
    low, high = (in_digits(1000.0 * end, 2) for end in (min(errors), max(errors)))
    return low if low == high else f"{low} to {high}"
