"""Discharges beside the verticals of a gauging: each row repeats that of its section, or holds the share of its own."""

import numpy as np

from vegglue.importers.measured_rows import Taken
from vegglue.in_short import so_many

# Values of one discharge are alike to so much [-]: those of one are copied, not measured again.
COPIED = 1e-6


def whole_discharges(taken: Taken) -> tuple[Taken, tuple[str, ...]]:
    """The rows with the discharge of a section once, and without shares of it, and what is said of these.

    taken: rows with an experiment and a section. Several values at one y are repeats, and stay.
    """
    if not {"y", "discharge"} <= taken.numbers.keys():
        return taken, ()
    found = taken.numbers["discharge"].copy()
    shares = 0
    for rows in _rows_of_sections(taken):
        if np.ptp(taken.numbers["y"][rows]) == 0.0:
            continue
        values = found[rows]
        alike = np.allclose(values, values[0], rtol=COPIED, atol=0.0)
        found[rows[1:] if alike else rows] = np.nan
        shares += 0 if alike else len(rows)
    said = f"{so_many(shares, 'discharge')} left out, as those of one section differ: shares of its verticals"
    return taken.having({"discharge": found}), (said,) if shares else ()


def _rows_of_sections(taken: Taken) -> list[list[int]]:
    """The rows with a discharge of each section of each experiment."""
    rows: dict[tuple[str, str], list[int]] = {}
    for row in np.flatnonzero(np.isfinite(taken.numbers["discharge"])).tolist():
        rows.setdefault((taken.words["experiment"][row], taken.words["section"][row]), []).append(row)
    return list(rows.values())
