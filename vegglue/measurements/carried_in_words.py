"""Sections that carry another discharge than stated, in sentences: which, how much, and what to do."""

from collections.abc import Sequence

import pandas as pd

from vegglue.case.gridded_site import Site
from vegglue.case.parameter_space import shown_bounds
from vegglue.case.schema import Case
from vegglue.measurements.carried_discharge import CarriedDischarge, carried_discharges, changing_discharge
from vegglue.measurements.sections import section_in_words
from vegglue.measurements.suspicious_values import absurd_values
from vegglue.wording.numbers import experiments_in_words, in_digits, listed, so_many

CHECK = "check the discharge, the velocities and their unit, the bed and the levels"


def carried_otherwise(case: Case, site: Site, station: pd.DataFrame) -> list[CarriedDischarge]:
    """Sections that clearly carry another discharge than stated; none beside values that no flow can have, and none
    whose discharge an effect of the case changes.
    """
    off = [
        one
        for one in carried_discharges(case, site, station)
        if one.clearly_off and not changing_discharge(case, one.experiment, one.x)
    ]
    return [] if off and absurd_values(case, site, station) else off


def carried_in_words(off: Sequence[CarriedDischarge]) -> list[str]:
    """One sentence on all sections that carry more than stated, and one on those that carry less."""
    return [_sentence(group) for group in _grouped(off)]


def carried_in_short(off: Sequence[CarriedDischarge]) -> str:
    """`sections carry 1.5 times the stated discharge in experiment low`, '' without any."""
    parts = [f"{_times(group)} times the stated discharge in {_experiments(group)}" for group in _grouped(off)]
    return f"sections carry {listed(parts)}" if parts else ""


def _grouped(off: Sequence[CarriedDischarge]) -> list[list[CarriedDischarge]]:
    groups = [one for one in off if one.ratio > 1.0], [one for one in off if one.ratio <= 1.0]
    return [group for group in groups if group]


def _times(group: Sequence[CarriedDischarge]) -> str:
    """`1.5`, `1.4 to 1.6`."""
    low, high = (in_digits(end(one.ratio for one in group), 2) for end in (min, max))
    return low if low == high else f"{low} to {high}"


def _experiments(group: Sequence[CarriedDischarge]) -> str:
    return experiments_in_words([*dict.fromkeys(one.experiment for one in group)])


def _sentence(group: Sequence[CarriedDischarge]) -> str:
    first, stated = group[0], shown_bounds(group[0].stated or (0.0, 0.0))
    carries = f"{in_digits(first.value)} m3/s, {shown_bounds(first.interval95)}"
    return (
        f"The velocities of {so_many(len(group), 'section')} in {_experiments(group)} carry {_times(group)} times the "
        f"stated discharge ({section_in_words(first.section, first.x)}, in {first.experiment}: {carries}, "
        f"where {stated} m3/s is stated): {CHECK}, as a diagnosis would name something that "
        "makes up for it."
    )
