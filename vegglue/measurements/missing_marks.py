"""Numbers that stand for a missing value: one list for what an import leaves out and what a check doubts.

Numbers of nines alone are told by their digits, as loggers write any count of them.
"""

# Written by loggers whatever was measured: four and five nines, and the ends of integers of 16 and 32 bits.
MARKS_OF_ANY_COLUMN = (9999.0, 99999.0, -32768.0, 32767.0, 32768.0, 2147483647.0)
# Written as well, but a place on a map, along a tape, a time or a discharge may be that number: marks only where a
# measurement cannot be so large.
MARKS_OR_VALUES = (7777.0, 8888.0)
# What is larger [SI] is no measurement; a coordinate on a map may be (northings reach 1e7 m).
LARGEST_MEASURED, LARGEST_COORDINATE = 1e6, 1e9
# A single 9 and what is below it, 0.9 and 0.99, are measured.
LEAST_NINES = 9.0
_SIZES = frozenset(abs(mark) for mark in (*MARKS_OF_ANY_COLUMN, *MARKS_OR_VALUES))


def is_mark(value: float) -> bool:
    """Whether a number is one that stands for a missing value: of nines only (-999, 99.9, 9999), 1e30 and the like."""
    size = abs(value)
    return size >= LARGEST_MEASURED or size in _SIZES or (size >= LEAST_NINES and is_of_nines(size))


def is_of_nines(value: float) -> bool:
    """Whether a number is written with nines alone: 9, 99.9, 9999."""
    return set(f"{value:g}") <= set("9.")
