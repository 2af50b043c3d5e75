"""Along which part of the channel velocities were measured, where that is a small part of it."""

import pandas as pd

from vegglue.case.case_effects import effect_of
from vegglue.case.schema import Case
from vegglue.effects.definition import Stage
from vegglue.measurements.kinds import velocity_rows
from vegglue.wording.numbers import listed

# Share of the channel below which it is said that velocities come from a part of it. Chosen, not measured.
SMALL_PART = 0.5
# Stages whose effects may change from place to place along the channel; others act at an end, or in what is read.
ALONG_THE_CHANNEL: tuple[Stage, ...] = ("plants", "resistance", "exchange", "force")


def stretch_in_words(case: Case, station: pd.DataFrame) -> str:
    """What is told of the effects of a case where velocities lie within SMALL_PART of the channel; '' where they do
    not, or where none of the effects acts along it.

    An effect is one law for the whole channel: gauges see its sum, and velocities only what it is where they are.
    """
    effects = [effect_of(case, name) for name in case.effects]
    law = [one for one in effects if one.stage in ALONG_THE_CHANNEL and "search" not in one.tags]
    along = [*dict.fromkeys(one.name for one in law)]
    used = station["x"][velocity_rows(station) & station["used"].to_numpy()]
    whole = case.grid.x[1] - case.grid.x[0]
    if not along or used.empty or used.max() - used.min() >= SMALL_PART * whole:
        return ""
    of_them = f"{listed(along)} {'is' if len(along) == 1 else 'are'} the same elsewhere"
    return (
        f"Velocities were measured from x = {used.min():g} to {used.max():g} m only, in a model of {whole:g} m: "
        f"whether {of_them}, these data can hardly tell."
    )
