"""The files between vegglue and a command: what it is given, and what it has to leave. docs/own_engine.md tells them.

parameters.json   values and units of the parameters, and the flow of each experiment
stations.csv      station, experiment, kind, section, x, y, depth, unit
predictions.csv   station, prediction, left by the command
"""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.case_effects import value_of
from vegglue.case.channel_geometry import patches_present
from vegglue.case.schema import Case, Experiment
from vegglue.case.text_files import read_text
from vegglue.errors import InputError
from vegglue.measurements.kinds import kind_of
from vegglue.measurements.observations import LARGEST_READING

PARAMETERS_FILE, STATIONS_FILE, PREDICTIONS_FILE = "parameters.json", "stations.csv", "predictions.csv"
COLUMNS_LEFT = ("station", "prediction")
# Most that predictions.csv may take [bytes]: the most stations of a case, with fifty signs each.
LARGEST_PREDICTIONS = 1_000_000


class BadPredictionsError(ValueError):
    """What a command left is not what was asked for: says where, what was expected and what came."""


def parameters_text(case: Case, theta: Mapping[str, float]) -> str:
    """parameters.json: theta in the units of the case, and discharge [m3/s], level [m] and plants of experiments."""
    parameters = {name: {"value": value, "unit": case.parameters[name].unit} for name, value in theta.items()}
    experiments = {name: _flow_of(case, name, one, theta) for name, one in case.experiments.items()}
    return json.dumps({"case": case.name, "parameters": parameters, "experiments": experiments}, indent=1) + "\n"


def _flow_of(case: Case, name: str, one: Experiment, theta: Mapping[str, float]) -> dict[str, Any]:
    values = {parameter: np.array([value]) for parameter, value in theta.items()}
    discharge = {inflow: float(value_of(value, values, 1)[0]) for inflow, value in one.discharge.items()}
    plants = [case.plants.patches[index].name for index in patches_present(case, name)]
    return {"discharge": discharge, "level": float(value_of(one.level, values, 1)[0]), "plants": plants}


def stations_text(station: pd.DataFrame) -> str:
    """stations.csv: places in the coordinates of the grid [m], depth as measured [m], empty where it was not."""
    columns = ["experiment", "kind", "section", "x", "y", "depth"]
    units = [kind_of(str(kind)).unit for kind in station["kind"]]
    table = station[columns].reset_index(drop=True).assign(unit=units)
    table.insert(0, "station", range(len(table)))
    return str(table.to_csv(index=False, lineterminator="\n"))


def read_predictions(path: Path, stations: int) -> Array:
    """Predictions (station,) [m/s, m or m3/s] of predictions.csv, in any order. Errors: BadPredictionsError."""
    if not path.is_file():
        raise BadPredictionsError(f"the command ended well and left no {PREDICTIONS_FILE}")
    try:
        lines = read_text(path, LARGEST_PREDICTIONS).splitlines()
    except InputError as error:
        raise BadPredictionsError(f"{PREDICTIONS_FILE} cannot be read: {error}") from None
    heading = tuple(word.strip() for word in lines[0].split(",")) if lines else ()
    if heading != COLUMNS_LEFT:
        raise BadPredictionsError(
            f"{PREDICTIONS_FILE}, row 1: expected {','.join(COLUMNS_LEFT)}, got {','.join(heading)[:40]!r}"
        )
    found = np.full(stations, np.nan)
    for row, line in enumerate(lines[1:], 2):
        if line.strip():
            number, value = _row(row, line, stations)
            if np.isfinite(found[number]):
                raise BadPredictionsError(f"{PREDICTIONS_FILE}, row {row}: station {number} stands there twice")
            found[number] = value
    missing = np.flatnonzero(np.isnan(found))
    if missing.size:
        more = f" and {missing.size - 1} more" if missing.size > 1 else ""
        raise BadPredictionsError(f"{PREDICTIONS_FILE}: no prediction of station {missing[0]}{more}")
    return found


def _row(row: int, line: str, stations: int) -> tuple[int, float]:
    """The station and the prediction of one line."""
    words = [word.strip() for word in line.split(",")]
    try:
        number, value = int(words[0]), float(words[1])
        sound = len(words) == len(COLUMNS_LEFT) and math.isfinite(value)
    except (ValueError, IndexError):
        sound = False
    if not sound:
        raise BadPredictionsError(
            f"{PREDICTIONS_FILE}, row {row}: expected a station and a finite number, got {line[:40]!r}"
        )
    if abs(value) > LARGEST_READING:
        raise BadPredictionsError(
            f"{PREDICTIONS_FILE}, row {row}: expected a prediction of at most {LARGEST_READING:g}, got {value:g}"
        )
    if not 0 <= number < stations:
        raise BadPredictionsError(
            f"{PREDICTIONS_FILE}, row {row}: expected a station from 0 to {stations - 1}, got {number}"
        )
    return number, value
