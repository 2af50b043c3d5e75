"""Is `z` of points the height above the bed there, where it was taken for a level?"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.schema import Case
from vegglue.measurements.adv_section import upward_column
from vegglue.measurements.observations import Observations
from vegglue.wording.numbers import experiments_in_words, in_digits, listed

# Fall of the bed [m], and over the scatter of the lowest points [-], from which it is seen whether these follow the
# bed. A probe is set to a height to 1 or 2 mm; points that do follow scatter by 0.3 to 0.4 of the fall itself.
LEAST_FALL, OVER_THE_SCATTER = 0.003, 4.0
# Share of the change of the bed by which lowest points move with it [-]: 1 for levels, 0 for heights above the bed.
HALFWAY = 0.5
# Fewest verticals that make a rule, as elsewhere; a normal standard deviation over the median deviation [-].
FEWEST_LOWEST, OF_A_NORMAL = 3, 1.4826


@dataclass(frozen=True)
class _Unmoved:
    """An experiment whose lowest points keep their z, the middle of them, from one x to another while the bed falls;
    all in m. file: of its points.
    """

    experiment: str
    file: Path
    z: float
    first: float
    last: float
    fall: float


def remarks_on_unmoved_heights(case: Case, observations: Observations) -> Iterator[str]:
    """Files whose verticals begin at one z while the bed falls: they may count from the bed below each."""
    found = [*_unmoved(case, observations)]
    for file in dict.fromkeys(one.file for one in found):
        yield _in_words(case, file, [one for one in found if one.file == file])


def _unmoved(case: Case, observations: Observations) -> Iterator[_Unmoved]:
    """One of each file and experiment. Sections with a `floor` of their own count from there, and are left out."""
    points = observations.points
    if points.empty:
        return
    sections: dict[tuple[Path, str], list[str]] = {}
    for one in case.observations:
        if one.kind == "adv" and one.floor is None and upward_column(one.file) == "z":
            sections.setdefault((one.file, str(one.experiment)), []).append(str(one.section))
    for (file, experiment), names in sections.items():
        own = points[(points["experiment"] == experiment) & points["section"].isin(names)]
        lowest = own.sort_values("z").groupby(["section", "x", "y"], as_index=False).first()
        middle = lowest.groupby("x")[["z", "bed"]].median()
        fall = float(middle["bed"].iloc[0] - middle["bed"].iloc[-1])
        if len(lowest) >= FEWEST_LOWEST and _keeps_its_level(lowest["z"].to_numpy(float), middle, fall):
            first, last = float(middle.index[0]), float(middle.index[-1])
            yield _Unmoved(experiment, file, float(lowest["z"].median()), first, last, fall)


def _keeps_its_level(z: Array, middle: pd.DataFrame, fall: float) -> bool:
    """Whether the lowest points z (vertical,) [m] stay where they are while the bed falls.

    middle: z and bed of the sections, downstream; the median of dz / dbed between any two tells which of both holds.
    """
    scatter = OF_A_NORMAL * float(np.median(np.abs(z - np.median(z))))
    if fall < max(LEAST_FALL, OVER_THE_SCATTER * scatter):
        return False
    one, other = np.triu_indices(len(middle), 1)
    level, bed = (np.diff(middle[name].to_numpy(float)[np.array([one, other])], axis=0)[0] for name in ("z", "bed"))
    far = np.abs(bed) > HALFWAY * fall
    return float(np.median(level[far] / bed[far])) < HALFWAY


def _in_words(case: Case, file: Path, found: list[_Unmoved]) -> str:
    """One sentence for all experiments of a file."""
    first = found[0]
    levels = listed([in_digits(one.z, 2) for one in found])
    heading = next(
        (one.columns["z"] for one in case.imported or () if one.name == file.name and "z" in one.columns), None
    )
    remedy = "head its column `height` in place of `z`"
    if heading is not None:
        said = f'`columns: {{height: "{heading}"}}` of {file.name} in the site file'
        remedy = f"head its column `height above bed`, or say {said}, and import again"
    return (
        f"The lowest points of the verticals of {experiments_in_words([one.experiment for one in found])} lie at "
        f"z = {levels} m from x = {first.first:g} to {first.last:g} m, where the bed falls by "
        f"{in_digits(1000.0 * first.fall, 2)} mm: z is taken for a level; if it is the height above the bed, {remedy}."
    )
