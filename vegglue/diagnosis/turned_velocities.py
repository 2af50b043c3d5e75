"""Do all velocities of an experiment point to one side of the channel, which no water between two sides can do?"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.schema import Case
from vegglue.diagnosis.directions import misdirected
from vegglue.measurements.kinds import STREAMWISE, TRANSVERSE
from vegglue.measurements.observations import Observations
from vegglue.wording.numbers import experiments_in_words, in_digits, listed, so_many

# Angle [degrees] from which it is told, and over its standard error over the sections [-]. Chosen: declinations in
# Europe reach some degrees; a section beside the end of a patch in a flume of a newcomer was off by 1.6.
LEAST_ANGLE, SURE_OF_AN_ANGLE = 3.0, 3.0
# Fewest sections that tell: two may both stand where a patch drives water aside. Share of them on one side [-].
FEWEST_CROSSED, MOST_ON_ONE_SIDE = 3, 0.9
# Fewest places of a section whose mean is that of the section.
FEWEST_OF_A_MEAN = 3


@dataclass(frozen=True)
class _Turned:
    """Angle of the mean velocity at each section, to the left of the channel [degrees]."""

    sections: tuple[str, ...]
    angles: Array

    @property
    def mean(self) -> float:
        """Over the sections [degrees]."""
        return float(self.angles.mean())


def remarks_on_turned_velocities(case: Case, observations: Observations) -> Iterator[str]:
    """Experiments whose velocities are turned to one side at nearly all sections; none with odd directions besides."""
    table, odd = observations.table, misdirected(case, observations)
    used = table[table["used"]]
    angles = {name: _angles(used[used["experiment"] == name]) for name in case.experiments if name not in odd}
    turned = {name: one for name, one in angles.items() if _to_one_side(one.angles)}
    straight = {name: one for name, one in angles.items() if name not in turned}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        ones = {name: one for name, one in turned.items() if sign * one.mean > 0.0}
        if ones:
            yield _turned_in_words(side, ones, straight)


def _angles(rows: pd.DataFrame) -> _Turned:
    """atan(sum v / sum u) of each section with enough places where both were measured."""
    along, across = (
        rows.loc[rows["kind"] == kind, ["section", "x", "y", "value"]] for kind in (STREAMWISE, TRANSVERSE)
    )
    both = along.merge(across, on=["section", "x", "y"], suffixes=("_along", "_across"))
    sums = both.groupby("section")[["value_along", "value_across"]].agg(["sum", "size"])
    wide = sums[sums[("value_along", "size")] >= FEWEST_OF_A_MEAN]
    angles = np.arctan2(wide[("value_across", "sum")].to_numpy(float), wide[("value_along", "sum")].to_numpy(float))
    return _Turned(tuple(map(str, wide.index)), np.degrees(angles))


def _to_one_side(angles: Array) -> bool:
    """Whether angles (section,) [degrees] have one sign nearly all, and a mean that chance does not make."""
    if len(angles) < FEWEST_CROSSED:
        return False
    mean, error = float(angles.mean()), float(angles.std(ddof=1)) / float(np.sqrt(len(angles)))
    alike = int((np.sign(angles) == np.sign(mean)).sum())
    return abs(mean) > max(LEAST_ANGLE, SURE_OF_AN_ANGLE * error) and alike >= MOST_ON_ONE_SIDE * len(angles)


def _turned_in_words(side: str, turned: Mapping[str, _Turned], others: Mapping[str, _Turned]) -> str:
    """One sentence of all that turn to a side; others: without such an angle, told where they share sections."""
    sections = {section for one in turned.values() for section in one.sections}
    same = [
        f"{in_digits(abs(one.mean), 2)} in {other}"
        for other, one in others.items()
        if len(one.sections) >= FEWEST_CROSSED and sections & set(one.sections)
    ]
    cause = "the compass or the declination is off, or the `frame` or the centreline turned against the channel"
    if same:
        cause = "the compass, the declination or the zero of their directions is off; turn them back in their file"
    return (
        f"Velocities of {experiments_in_words(list(turned))} point "
        f"{listed([in_digits(abs(one.mean)) for one in turned.values()])} degrees to the {side} of the channel on "
        f"average over {so_many(len(sections), 'section')}{f' ({listed(same)})' if same else ''}, and all water of a "
        f"channel cannot run to one side: {cause}."
    )
