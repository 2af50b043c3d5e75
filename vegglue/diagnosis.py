"""What a diagnosis says: the verdict, the effects that explain the misfit, where it lies, and all numbers behind it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd

from vegglue.effect import Array
from vegglue.layout import Group, Variable, table_group

Verdict = Literal["nothing-missing", "identified", "one-of", "none-of-these", "cannot-tell"]
# Sum over families of what the data may accuse without cause: listed effects and unlisted places.
ALARM, ALARM_OF_PLACES = 0.04, 0.01


@dataclass(frozen=True)
class Suspect:
    """One effect as the data see it at the last baseline at which it was looked at.

    amplitude, interval95: from its own refit when there was one, else to first order; unit of the amplitude. p_family:
    chance that errors alone make any effect look as strong. visibility: share of its trace that calibration cannot
    mimic [-]. smallest_detectable: amplitude that would be seen 19 times of 20; mimicked_by: the parameter most alike.
    """

    name: str
    title: str
    unit: str
    amplitude: float
    interval95: tuple[float, float]
    score: float
    p_family: float
    visibility: float
    smallest_detectable: float
    testable: bool
    refitted: bool
    objective: float
    mimicked_by: str
    likeness: float
    shapes: dict[str, float]


@dataclass(frozen=True)
class Step:
    """One round of the search: what was accepted, its rivals that are not rejected, chi2 before and after."""

    accepted: str
    rivals: tuple[str, ...]
    groups: tuple[tuple[str, ...], ...]
    chi2_before: float
    chi2_after: float
    p_family: float


@dataclass(frozen=True)
class Where:
    """A place [m] and the experiments that point at it."""

    x: float
    y: float
    experiments: tuple[str, ...]
    drag: float
    score: float


@dataclass(frozen=True)
class Diagnosis:
    """Everything a diagnosis found. chi2, freedom: of the last model, whitened; flagged: rows of stations that no
    effect explains and that stand alone; zones: misfit by experiment, section and zone; residual: (station,) of the
    baseline and of the last model; map_x, map_y, map_score: scores of a spot of drag everywhere at the last model.
    """

    name: str
    verdict: Verdict
    sentence: str
    remarks: tuple[str, ...]
    suspects: tuple[Suspect, ...]
    steps: tuple[Step, ...]
    where: Where | None
    chi2_first: float
    chi2: float
    freedom: int
    p_misfit: float
    correlation: float
    scale: float
    grid_error: float
    flagged: tuple[int, ...]
    parameters: dict[str, tuple[float, float, float]]
    zones: pd.DataFrame
    station: pd.DataFrame
    prediction_first: Array
    prediction: Array
    error: Array
    map_x: Array
    map_y: Array
    map_score: Array
    cosine_names: tuple[str, ...]
    cosine: Array
    version: str

    @property
    def set(self) -> list[str]:
        """Names of all effects not rejected, those of the first step first."""
        return list(dict.fromkeys(name for step in self.steps for name in step.rivals))

    @property
    def groups(self) -> list[list[str]]:
        return [list(group) for step in self.steps for group in step.groups]


def as_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """One object with every number that is printed."""
    table = diagnosis.zones.replace({np.nan: None}).to_dict("records")
    return {
        "verdict": diagnosis.verdict,
        "sentence": diagnosis.sentence,
        "set": diagnosis.set,
        "groups": diagnosis.groups,
        "where": _place(diagnosis.where),
        "effects": [_plain(asdict(suspect)) for suspect in diagnosis.suspects],
        "steps": [_plain(asdict(step)) for step in diagnosis.steps],
        "remarks": list(diagnosis.remarks),
        "chi2": {"first": diagnosis.chi2_first, "last": diagnosis.chi2, "freedom": diagnosis.freedom,
                 "p": diagnosis.p_misfit},
        "noise": {"correlation": diagnosis.correlation, "scale": diagnosis.scale, "grid_error": diagnosis.grid_error},
        "flagged": [_flagged(diagnosis, row) for row in diagnosis.flagged],
        "parameters": {name: list(values) for name, values in diagnosis.parameters.items()},
        "zones": table,
    }  # fmt: skip


def _place(where: Where | None) -> dict[str, Any] | None:
    return None if where is None else _plain(asdict(where))


def _flagged(diagnosis: Diagnosis, row: int) -> dict[str, Any]:
    station = diagnosis.station.iloc[row]
    place = {name: str(station[name]) for name in ("experiment", "kind", "section")}
    return place | {name: float(station[name]) for name in ("x", "y", "value")}


def _plain(tree: Any) -> Any:
    """Numbers as JSON knows them: no NaN, no infinity, no tuples."""
    if isinstance(tree, Mapping):
        return {key: _plain(value) for key, value in tree.items()}
    if isinstance(tree, list | tuple):
        return [_plain(value) for value in tree]
    if isinstance(tree, float | np.floating):
        return float(tree) if np.isfinite(tree) else None
    return tree


def groups(diagnosis: Diagnosis) -> dict[str, Group]:
    """All groups of diagnosis.h5: stations with predictions before and after, suspects, zones, the map of places."""
    stations = table_group(diagnosis.station, "station", {"x": "m", "y": "m"})
    dims = ("station",)
    values = {
        "prediction_first": Variable(dims, diagnosis.prediction_first, "m/s for velocity, m for level"),
        "prediction": Variable(dims, diagnosis.prediction, "m/s for velocity, m for level"),
        "error": Variable(dims, diagnosis.error, "m/s for velocity, m for level"),
    }
    suspects = pd.DataFrame([_row(suspect) for suspect in diagnosis.suspects])
    place = {"x": Variable(("place",), diagnosis.map_x, "m"), "y": Variable(("place",), diagnosis.map_y, "m")}
    alike = {"cosine": Variable(("name", "other"), diagnosis.cosine)}
    names = np.array(diagnosis.cosine_names, object)
    return {
        "stations": Group(stations.coordinates, {**stations.variables, **values}),
        "suspects": table_group(suspects, "suspect", {}),
        "zones": table_group(diagnosis.zones, "zone", {}),
        "places": Group(
            {"place": np.arange(diagnosis.map_x.size)}, {**place, "score": Variable(("place",), diagnosis.map_score)}
        ),
        "alike": Group({"name": names, "other": names}, alike),
    }


def _row(suspect: Suspect) -> dict[str, Any]:
    row = asdict(suspect)
    low, high = row.pop("interval95")
    shapes = row.pop("shapes")
    said = ", ".join(f"{key}={value:g}" for key, value in shapes.items())
    return row | {"low95": low, "high95": high, "shapes": said}
