"""Instruments that could be off: a reading, a probe at one place or at one y of all sections, a gauge at one place.

value -> value + offset,   the offset the same in all readings of the instrument
"""

from dataclasses import dataclass
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
    sections; gauges at one place in several experiments.
    """
    x, y = used["x"].to_numpy(float), used["y"].to_numpy(float)
    names = used["kind"].astype(str)
    probe = names.map(lambda name: kind_of(name).velocity).to_numpy(bool)
    gauge = names.map(lambda name: kind_of(name).instrument == "gauge").to_numpy(bool)
    readings = tuple(Instrument("reading", (row,), float(x[row]), float(y[row])) for row in range(len(used)))
    probes = _shared("probe", [(row, float("nan"), float(y[row])) for row in _rows(probe)])
    gauges = _shared("gauge", [(row, float(x[row]), float(y[row])) for row in _rows(gauge)])
    positions = _shared("position", [(row, float(x[row]), float(y[row])) for row in _rows(probe)])
    at_places = {one.readings for one in positions}
    across = tuple(one for one in probes if one.readings not in at_places)
    return {"reading": readings, "position": positions, "probe": across, "gauge": gauges}


def offset_columns(instruments: tuple[Instrument, ...], stations: int) -> Array:
    """d value / d offset of each instrument (n, instrument): 1 in its readings, else 0."""
    columns = np.zeros((stations, len(instruments)))
    for j, one in enumerate(instruments):
        columns[list(one.readings), j] = 1.0
    return columns


def _rows(chosen: np.ndarray) -> list[int]:
    return [int(row) for row in np.flatnonzero(chosen)]


def _shared(kind: InstrumentKind, rows: list[tuple[int, float, float]]) -> tuple[Instrument, ...]:
    """Instruments of more than one reading, rows of the same place together; rows: (row, x, y)."""
    together: dict[str, list[tuple[int, float, float]]] = {}
    for row, x, y in rows:
        together.setdefault(f"{x:.3f} {y:.3f}", []).append((row, x, y))
    return tuple(
        Instrument(kind, tuple(row for row, _, _ in found), found[0][1], found[0][2])
        for found in together.values()
        if len(found) > 1
    )
