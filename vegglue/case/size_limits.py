"""How large a case and its files may be: what is larger is refused before memory is taken for it.

Each limit lies far above what was ever calibrated, and low enough that a common machine refuses in a moment.
docs/limits.md states them.
"""

import math

# A config [bytes]: the largest of the shipped ones has 3 kB, one with a thousand patches 100 kB.
LARGEST_CONFIG = 1_000_000
# Files of data [bytes]: a raster of 3,000 x 3,000 levels, or a million rows of measurements.
LARGEST_DATA = 100_000_000
# Levels of keys within keys; a case uses 6. Parts of a config, aliases written out: 50 for each of a thousand patches.
DEEPEST_KEYS, MOST_PARTS = 40, 50_000
# Digits of a whole number: no quantity or seed needs more than 19.
MOST_DIGITS = 30
# Files one after the other that `extends` names.
LONGEST_CHAIN = 50
# Cells of a grid: more than twenty times as many as the largest case of this project.
MOST_CELLS = 1_000_000
# Rows of cells from which on factors are sparse [-]: measured, see docs/speed.md. SPARSE_BYTES: 390 to 445 on grids of
# 90 x 37 to 5,000 x 100 cells [bytes a cell and doubling of the rows].
WIDE_FROM, SPARSE_BYTES = 56, 440.0
# Members of an ensemble, 2^20; predictions of all of them, each of 8 bytes, are laid out at once.
MOST_MEMBERS, MOST_PREDICTIONS = 2**20, 10**9
# Stations: their covariance is a full matrix, 3.2 GB at this number.
MOST_STATIONS = 20_000


def factor_bytes(columns: float, rows: float) -> float:
    """B = 4 x 3 nx (3 ny)^2 by blocks, and on wide grids SPARSE_BYTES nx ny log2(ny): memory of one member's factors.

    Parameters
    ----------
    columns, rows : nx, ny

    Returns
    -------
    [bytes]
    """
    if rows >= WIDE_FROM:
        return SPARSE_BYTES * columns * rows * math.log2(rows)
    return block_bytes(columns, rows)


def block_bytes(columns: float, rows: float) -> float:
    """B = 4 x 3 nx (3 ny)^2: factors by blocks, on any grid [bytes]."""
    return 4.0 * 3.0 * columns * (3.0 * rows) ** 2
