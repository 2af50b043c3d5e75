"""Do the places of velocities lie in the grid in another unit only?"""

from collections.abc import Iterator

import pandas as pd

from vegglue.case.schema import Case
from vegglue.measurements.kinds import velocity_rows
from vegglue.measurements.observations import OUTSIDE, Observations
from vegglue.wording.numbers import in_digits

# Units that places may be in where metres are expected, and one of each in m; of two that fit the larger.
SMALLER_UNITS = {"ft": 0.3048, "cm": 0.01, "mm": 0.001}
KILOMETRE = 1000.0
# Places over less than this share of the grid may be in km [-]: a thousandth of the grid is what all of it would be.
HUDDLED = 1.0 / 300.0


def remarks_on_units_of_places(case: Case, observations: Observations) -> Iterator[str]:
    """Velocities of which most are outside the grid, and all would lie inside in a smaller unit; or all stand within a
    short piece of it, as if in km. Places on a map are in its own unit.
    """
    table = observations.table[velocity_rows(observations.table)]
    if case.frame is not None or case.grid.centreline is not None or not len(table):
        return
    lost = table[(table["reason"] == OUTSIDE).to_numpy()]
    unit = fitting_unit(case, table)
    if 2 * len(lost) > len(table) and unit is not None:
        yield (
            f"{len(lost)} of {len(table)} velocities are outside the grid, {_first(lost)}, and all would lie inside if "
            f"x and y were in {unit}: check their unit."
        )
    west, east = case.grid.x
    spread = float(table["x"].max() - table["x"].min())
    if 0.0 < spread < HUDDLED * (east - west) and _all_inside(case, table[["x", "y"]] * [KILOMETRE, 1.0]):
        yield (
            f"All velocities lie within {in_digits(spread, 2)} m of a grid of {east - west:g} m, {_first(table)}, as "
            "if x were in km: check its unit."
        )


def fitting_unit(case: Case, table: pd.DataFrame) -> str | None:
    """The largest unit smaller than a metre in which all places of the table lie within the grid, if there is one."""
    return next((name for name, size in SMALLER_UNITS.items() if _all_inside(case, size * table[["x", "y"]])), None)


def _first(table: pd.DataFrame) -> str:
    return f"the first at x = {table['x'].iloc[0]:g}, y = {table['y'].iloc[0]:g} m"


def _all_inside(case: Case, places: pd.DataFrame) -> bool:
    """Whether places, columns x and y [m], all lie within the grid."""
    return all(bool(places[name].between(*ends).all()) for name, ends in (("x", case.grid.x), ("y", case.grid.y)))
