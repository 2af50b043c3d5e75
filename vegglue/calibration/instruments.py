"""Instruments that could be off: a reading, a probe at one place or at one y of all sections, a gauge at one place.

value -> value + offset,   the offset the same in all readings of the instrument

By its offset it is found. A probe may be off by a factor, too: once it is set aside neither counts, see
`error_columns`.
"""

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.measurements.kinds import kind_of

InstrumentKind = Literal["reading", "position", "probe", "gauge"]
# Plausible offsets over the median standard error of the readings [-]: of a reading that went wrong, and of an
# instrument that is off wherever it reads. Chosen, not measured.
PLAUSIBLE_OFFSET = {"reading": 10.0, "position": 5.0, "probe": 5.0, "gauge": 10.0}


@dataclass(frozen=True)
class Instrument:
    """One that could be off: its readings, indices of used stations; x or y: where it stood [m], NaN if everywhere."""

    kind: InstrumentKind
    readings: tuple[int, ...]
    x: float
    y: float


def instruments_of(used: pd.DataFrame) -> dict[InstrumentKind, tuple[Instrument, ...]]:
    """Those of the used stations: every reading; probes at one place in several experiments, and at one y in several
    sections; gauges at one place in several experiments. Readings of other kinds have offsets of their own.
    """
    kinds = [kind_of(str(name)) for name in used["kind"]]
    places = used[["x", "y"]].to_numpy(float)
    rows = range(len(used))
    probes = [row for row in rows if kinds[row].velocity]
    gauges = [row for row in rows if kinds[row].instrument == "gauge"]
    # To a millimetre: a place on the axis that was turned from a map lies at 0 or at -0.
    of = [(kinds[row].name, round(float(places[row, 0]), 3), round(float(places[row, 1]), 3)) for row in rows]
    across = [(name, y) for name, _, y in of]
    positions = _shared("position", {row: of[row] for row in probes}, places)
    at_one_place = {one.readings for one in positions}
    return {
        "reading": tuple(Instrument("reading", (row,), *map(float, places[row])) for row in rows),
        "position": positions,
        "probe": tuple(
            replace(one, x=float("nan"))
            for one in _shared("probe", {row: across[row] for row in probes}, places)
            if one.readings not in at_one_place
        ),
        "gauge": _shared("gauge", {row: of[row] for row in gauges}, places),
    }


def error_columns(instrument: Instrument, value: Array) -> Array:
    """What an instrument that is off may add to its readings, of measured values (n,): an offset, and for a probe of
    several readings a factor, value itself (n, 1 or 2).
    """
    offset = offset_columns((instrument,), value.size)
    factor = offset[:, 0] * value
    is_probe = instrument.kind in ("position", "probe")
    return np.column_stack([offset, factor]) if is_probe and factor.any() else offset


def offset_columns(instruments: tuple[Instrument, ...], stations: int) -> Array:
    """d value / d offset of each instrument (n, instrument): 1 in its readings, else 0."""
    columns = np.zeros((stations, len(instruments)))
    for j, one in enumerate(instruments):
        columns[list(one.readings), j] = 1.0
    return columns


def _shared(kind: InstrumentKind, name: Mapping[int, Hashable], places: Array) -> tuple[Instrument, ...]:
    """Instruments of more than one reading, rows of the same name together; places: x, y of all rows (n, 2) [m]."""
    together: dict[Hashable, list[int]] = {}
    for row, its in name.items():
        together.setdefault(its, []).append(row)
    return tuple(
        Instrument(kind, tuple(rows), *map(float, places[rows[0]])) for rows in together.values() if len(rows) > 1
    )
