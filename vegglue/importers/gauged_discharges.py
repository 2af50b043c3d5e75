"""Discharges and levels beside the verticals of a gauging, where each row repeats that of its section.

A discharge may also be the share of each vertical, which is none of the section.
"""

import numpy as np

from vegglue.importers.lost_places import VELOCITIES
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.wording.numbers import so_many

# Values of one discharge are alike to so much [-]: those of one are copied, not measured again.
COPIED = 1e-6


def whole_discharges(taken: MeasuredRows) -> tuple[MeasuredRows, tuple[str, ...]]:
    """The rows with the discharge of a section once, and without shares of it, and what is said of these.

    taken: rows with an experiment and a section. Several values at one y are repeats, and stay.
    """
    if not {"y", "discharge"} <= taken.numbers.keys():
        return taken, ()
    found = taken.numbers["discharge"].copy()
    shares = 0
    for rows in _rows_of_sections(taken, "discharge"):
        if np.ptp(taken.numbers["y"][rows]) == 0.0:
            continue
        values = found[rows]
        alike = np.allclose(values, values[0], rtol=COPIED, atol=0.0)
        found[rows[1:] if alike else rows] = np.nan
        shares += 0 if alike else len(rows)
    said = f"{so_many(shares, 'discharge')} left out, as those of one section differ: shares of its verticals"
    return taken.having({"discharge": found}), (said,) if shares else ()


def levels_once(taken: MeasuredRows) -> tuple[MeasuredRows, tuple[str, ...]]:
    """The rows with a level that all verticals of a section repeat once, and what is said of it.

    taken: rows with an experiment and a section. Gauges on both banks are two readings, even where they agree.
    """
    if not {"y", "level"} <= taken.numbers.keys() or not taken.numbers.keys() & set(VELOCITIES):
        return taken, ()
    found = taken.numbers["level"].copy()
    across = taken.numbers["y"]
    sections = [rows for rows in _rows_of_sections(taken, "level") if len(set(across[rows])) > 2]
    repeated = [rows for rows in sections if np.ptp(found[rows]) == 0.0]
    for rows in repeated:
        found[rows[1:]] = np.nan
    said = f"levels of {so_many(len(repeated), 'section')} once, as all rows repeat them"
    return taken.having({"level": found}), (said,) if repeated else ()


def _rows_of_sections(taken: MeasuredRows, role: str) -> list[list[int]]:
    """The rows with a number of that role of each section of each experiment."""
    rows: dict[tuple[str, str], list[int]] = {}
    for row in np.flatnonzero(np.isfinite(taken.numbers[role])).tolist():
        rows.setdefault((taken.texts["experiment"][row], taken.texts["section"][row]), []).append(row)
    return list(rows.values())
