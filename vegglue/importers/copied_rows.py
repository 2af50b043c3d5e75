"""Rows that stand in a table again because it, or a stretch of it, was pasted twice: no measurements of their own."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
from math import gcd

from vegglue.importers.loose_table import LooseTable

# Equal rows may be repeats that agree in the few digits of a table: four pairs in ten do where their scatter is 0.7 of
# the last digit. Those of five places then all agree in one table of a hundred, of ten in a row in one of ten thousand.
FEWEST_ROWS, FEWEST_IN_A_ROW = 5, 10


def without_copies(table: LooseTable) -> LooseTable:
    """The table with copies counted once, and told in its form.

    Rows are copies only where they agree in the text of every column, and where the whole table stands there k times
    (every row k times, or a multiple of that, and five rows or more that differ: of each the k-th part is kept), or a
    stretch of ten rows or more, no two alike, stands there again in the same order. All other equal rows are repeats.
    """
    texts = [tuple(fields) for _, fields in table.rows]
    copied = _of_whole(texts) or _of_stretches(texts)
    if not copied:
        return table
    kept = tuple(row for place, row in enumerate(table.rows) if place not in copied)
    return replace(table, rows=kept, form=f"{table.form}, {len(copied):,} rows are copies of others and count once")


def _of_whole(rows: Sequence[tuple[str, ...]]) -> set[int]:
    """Places of the copies of a table that stands there more than once; none where it does not."""
    counts = Counter(rows)
    times = gcd(*counts.values())
    if times < 2 or len(counts) < FEWEST_ROWS:
        return set()
    met: Counter[tuple[str, ...]] = Counter()
    copied = set()
    for place, row in enumerate(rows):
        met[row] += 1
        if met[row] > counts[row] // times:
            copied.add(place)
    return copied


def _of_stretches(rows: Sequence[tuple[str, ...]]) -> set[int]:
    """Places of the rows of stretches that stand further up in the same order."""
    first: dict[tuple[str, ...], int] = {}
    behind = [place - first.setdefault(row, place) for place, row in enumerate(rows)]
    copied: set[int] = set()
    for shift, stretch in groupby(range(len(rows)), key=behind.__getitem__):
        places = list(stretch)
        if shift and len(places) >= FEWEST_IN_A_ROW:
            copied.update(places)
    return copied
