"""MATLAB files of instruments, built to the description of each format: no measurement, and nobody's file."""

from pathlib import Path

import numpy as np
from scipy.io import savemat

DEPTH, CELLS = 1.2, 8  # of the water under the boats [m]; from 0.2 m below the surface on, each 0.1 m
BELOW = 0.2 + 0.1 * (np.arange(CELLS) + 0.5)
SHAPE = 7.0 / 6.0 * ((DEPTH - BELOW) / DEPTH) ** (1.0 / 6.0)


def riversurveyor_mat(path: Path, unit: str, **setup: int) -> None:
    """A boat of 40 samples, 36 of them within its transect."""
    foot = 0.3048 if unit == "ft" else 1.0
    samples, random = 40, np.random.default_rng(3)
    velocity = np.zeros((10, 4, samples))  # the program fills up with zeros
    for axis, mean in enumerate((0.64, -0.48)):
        velocity[:CELLS, axis] = SHAPE[:, None] * mean + 0.02 * random.standard_normal((CELLS, samples))
    along = 0.1 * np.arange(samples)
    units = {"length": {"Depth": unit, "Track": unit}, "cells": {"Cell_Start": unit, "Cell_Size": unit}}
    every = np.ones(samples)
    savemat(path, {
        "Setup": {"coordinateSystem": 2, "trackReference": 1} | setup,
        "Summary": {"Depth": DEPTH / foot * every, "Cells": CELLS * every, "Units": units["length"],
                    "Track": np.column_stack([0.6 * along, 0.8 * along]) / foot},
        "System": {"Cell_Start": 0.2 / foot * every, "Cell_Size": 0.1 / foot * every, "Units": units["cells"],
                   "Step": np.r_[2, 2, 3 * np.ones(36), 4, 4]},
        "WaterTrack": {"Velocity": velocity / foot, "Units": {"Velocity": f"{unit}/s"}},
    })  # fmt: skip


def qrev_mat(path: Path, transects: int = 2, **water: object) -> None:
    """A boat that goes there and back, 60 ensembles each way, and once more in a transect that QRev does not use.

    Each third ensemble has a cell of no sense that QRev filled up, the tenth has no bed.
    """
    one = [_transect(number, water) for number in range(transects)] + [_transect(9, water) | {"checked": 0}]
    names = list(one[0])
    rows = np.zeros((len(one),), dtype=[(name, object) for name in names])
    for number, transect in enumerate(one):
        for name in names:
            rows[name][number] = transect[name]
    savemat(path, {"meas_struct": {"stationName": "Mill", "transects": rows}, "version": "QRev 4"}, oned_as="row")


def _transect(number: int, water: dict[str, object]) -> dict[str, object]:
    back, ensembles, random = number % 2, 60, np.random.default_rng(number)
    step = np.array([-0.06, -0.08] if back else [0.06, 0.08])
    east, north = (SHAPE[:, None] * mean + 0.02 * random.standard_normal((CELLS, ensembles)) for mean in (0.64, -0.48))
    valid = np.ones((CELLS, ensembles, 9))
    valid[3, ::3, 0], east[3, ::3] = 0, 9.0
    bed = np.where(np.arange(ensembles) == 10, np.nan, DEPTH)
    boat = dict(zip(("uProcessed_mps", "vProcessed_mps"), np.outer(step, np.ones(ensembles)), strict=True))
    flow = {"coordSys": "Earth", "uProcessed_mps": east, "vProcessed_mps": north, "validData": valid}
    cells = np.repeat(BELOW[:, None], ensembles, axis=1)
    return {
        "checked": 1, "startEdge": "Right" if back else "Left", "inTransectIdx": np.arange(1, ensembles + 1),
        "boatVel": {"selected": "btVel", "btVel": boat}, "dateTime": {"ensDuration_sec": np.ones(ensembles)},
        "depths": {"selected": "btDepths", "btDepths": {"depthProcessed_m": bed, "depthCellDepth_m": cells}},
        "wVel": flow | water,
    }  # fmt: skip


# From the four beams of each cell to x, y, z1 and z2, as a probe may be calibrated.
TURN = np.array([[1.9, 0.0, -1.9, 0.0], [0.0, 1.9, 0.0, -1.9], [0.5, 0.0, 0.5, 0.0], [0.0, 0.5, 0.0, 0.5]])


def profiler_mat(path: Path, means: np.ndarray, beams: bool = False, bed: float = 0.0, **config: object) -> None:
    """A Vectrino Profiler of 400 samples at 50 Hz in 31 cells from 40 mm on: velocities `means` (cells,) along x.

    The first 40 samples are weak and of no sense; so are three in four of the last cell.
    """
    samples, cells, random = 400, means.size, np.random.default_rng(5)
    xyz = 0.02 * random.standard_normal((samples, cells, 4))
    xyz[..., 0] += means
    weak = np.zeros((samples, cells), dtype=bool)
    weak[:40] = True
    weak[:300, -1] = True
    xyz[weak] = -0.9
    xyz[50, cells // 10] = np.nan  # as whoever cleaned the file may mark it
    names = [f"VelBeam{beam}" for beam in range(1, 5)] if beams else ["VelX", "VelY", "VelZ1", "VelZ2"]
    parts = np.einsum("ij,ncj->nci", np.linalg.inv(TURN), xyz) if beams else xyz
    data = {f"Profiles_{name}": parts[..., number].astype("f4") for number, name in enumerate(names)}
    data |= {f"Profiles_CorBeam{beam}": np.where(weak, 30.0, 96.0) for beam in range(1, 5)}
    data |= {"Profiles_Range": 0.04 + 0.001 * np.arange(cells), "BottomCheck_BottomDistance": np.r_[0.0, bed, bed]}
    settings = {
        "sampleRate": 50.0,
        "coordSystem": 2 if beams else 1,
        "ProbeCalibration_calibrationMatrix": np.tile(TURN.ravel(), (cells, 1)),
    }
    savemat(path, {"Data": data, "Config": settings | config}, long_field_names=True)
