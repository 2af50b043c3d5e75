"""What a diagnosis says: the verdict, the effects that explain the misfit, where it lies, and all numbers behind it."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Literal

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.results.ensemble import STATION_UNITS, VALUE_UNIT
from vegglue.results.layout import Group, Variable, table_group

Verdict = Literal["nothing-missing", "identified", "one-of", "none-of-these", "cannot-tell"]
# Sum over families of what the data may accuse without cause: listed effects and unlisted places.
ALARM, ALARM_OF_PLACES = 0.04, 0.01
# Fields that are lists or tables of plain values.
LISTS = ("remarks", "not_excluded", "flagged", "first_scores", "first_parameters", "parameters")
# Fields that have one value for each station.
AT_STATIONS = ("prediction_first", "prediction", "error")


@dataclass(frozen=True)
class Suspect:
    """One effect as the data see it at the last baseline at which it was looked at.

    amplitude, interval95: from its own refit when there was one, else to first order; unit of the amplitude. p_family:
    chance that errors alone make any effect look as strong. visibility: share of its trace that calibration cannot
    mimic [-]. smallest_detectable: distance of the amplitude from off that stands out 19 times of 20; testable: that
    is less than twice a plausible one; mimicked_by: the parameter most alike; off, scale: where the amplitude does
    nothing, and how far from there is plausible.
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
    off: float
    scale: float

    @property
    def stretch(self) -> float:
        """Amplitude over a plausible one [-]."""
        return abs(self.amplitude - self.off) / self.scale


@dataclass(frozen=True)
class Step:
    """One round of the search: what was accepted, what it may be instead, chi2 before and after.

    rivals: the effects that together hold 95 % of the chances, the accepted one among them; chances: of each, were it
    one of those that were refitted.
    """

    accepted: str
    rivals: tuple[str, ...]
    chances: tuple[float, ...]
    groups: tuple[tuple[str, ...], ...]
    chi2_before: float
    chi2_after: float
    p_family: float

    @property
    def chance(self) -> dict[str, float]:
        """Of each rival by its name."""
        return dict(zip(self.rivals, self.chances, strict=True))


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
    effect explains and that stand alone; zones: misfit by experiment, section and zone; prediction_first,
    prediction: (station,) of the baseline and of the last model; map_x, map_y, map_score: scores of a spot of drag
    everywhere, of the model in which `where` was found, else of the first.
    not_excluded: where nothing stood out, groups of effects among which one that hides is, nine times of ten.
    threshold, first_scores: score that errors alone reach once in 1 / ALARM, and those of the effects at the baseline.
    """

    name: str
    verdict: Verdict
    sentence: str
    remarks: tuple[str, ...]
    suspects: tuple[Suspect, ...]
    steps: tuple[Step, ...]
    where: Where | None
    not_excluded: tuple[tuple[str, ...], ...]
    chi2_first: float
    chi2: float
    freedom: int
    p_misfit: float
    correlation: float
    scale: float
    grid_error: float
    flagged: tuple[int, ...]
    threshold: float
    first_scores: dict[str, float]
    first_parameters: dict[str, float]
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
        """Names of all effects that may be missing, those of the first step first."""
        return list(self.chances)

    @property
    def chances(self) -> dict[str, float]:
        """Chance of each effect of the set, in the step that accepted it or the first that names it."""
        own = {step.accepted: step.chance[step.accepted] for step in self.steps}
        first = {name: chance for step in reversed(self.steps) for name, chance in step.chance.items()}
        told = first | own
        return {name: told[name] for step in self.steps for name in step.rivals}

    @property
    def groups(self) -> list[list[str]]:
        return [list(group) for step in self.steps for group in step.groups]


def diagnosis_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """One object with every number that is printed."""
    told = {
        "verdict": diagnosis.verdict,
        "sentence": diagnosis.sentence,
        "set": diagnosis.set,
        "groups": diagnosis.groups,
        "not_excluded": diagnosis.not_excluded,
        "where": None if diagnosis.where is None else asdict(diagnosis.where),
        "effects": [asdict(suspect) for suspect in diagnosis.suspects],
        "steps": [asdict(step) for step in diagnosis.steps],
        "remarks": diagnosis.remarks,
        "chi2": {"first": diagnosis.chi2_first, "last": diagnosis.chi2, "freedom": diagnosis.freedom,
                 "p": diagnosis.p_misfit},
        "threshold": diagnosis.threshold,
        "noise": {"correlation": diagnosis.correlation, "scale": diagnosis.scale, "grid_error": diagnosis.grid_error},
        "flagged": [_flagged(diagnosis, row) for row in diagnosis.flagged],
        "parameters": diagnosis.parameters,
        "first_parameters": diagnosis.first_parameters,
        "zones": diagnosis.zones.to_dict("records"),
    }  # fmt: skip
    return {name: _plain(value) for name, value in told.items()}


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


def diagnosis_groups(diagnosis: Diagnosis) -> dict[str, Group]:
    """All groups of diagnosis.h5: stations with predictions before and after, suspects, zones, the map of places."""
    stations = table_group(diagnosis.station, "station", STATION_UNITS)
    values = {name: Variable(("station",), getattr(diagnosis, name), VALUE_UNIT) for name in AT_STATIONS}
    suspects = pd.DataFrame([_row(suspect) for suspect in diagnosis.suspects])
    places = {
        "x": Variable(("place",), diagnosis.map_x, "m"),
        "y": Variable(("place",), diagnosis.map_y, "m"),
        "score": Variable(("place",), diagnosis.map_score),
    }
    names = np.array(diagnosis.cosine_names, object)
    return {
        "stations": Group(stations.coordinates, {**stations.variables, **values}),
        "suspects": table_group(suspects, "suspect", {}),
        "zones": table_group(diagnosis.zones, "zone_number", {}),
        "places": Group({"place": np.arange(diagnosis.map_x.size)}, places),
        "alike": Group({"name": names, "other": names}, {"cosine": Variable(("name", "other"), diagnosis.cosine)}),
    }


def diagnosis_attributes(diagnosis: Diagnosis) -> dict[str, Any]:
    """For the attributes of the file: one number or word as it is, what is neither that nor an array as JSON."""
    return {name: getattr(diagnosis, name) for name in _plain_names()} | {
        "steps": json.dumps([asdict(step) for step in diagnosis.steps]),
        "where": json.dumps(None if diagnosis.where is None else asdict(diagnosis.where)),
        **{name: json.dumps(getattr(diagnosis, name)) for name in LISTS},
    }


def diagnosis_from(read: Mapping[str, Mapping[str, Any]], stated: Mapping[str, Any]) -> Diagnosis:
    """The diagnosis whose file has these groups and attributes."""
    stations, places = read["stations"], read["places"]
    told = {name: json.loads(stated[name]) for name in ("steps", "where", *LISTS)}
    where = told["where"]
    return Diagnosis(
        **{name: kind(stated[name]) for name, kind in _plain_names().items()},
        remarks=tuple(told["remarks"]),
        not_excluded=tuple(tuple(group) for group in told["not_excluded"]),
        suspects=_suspects_from(read["suspects"]),
        steps=tuple(_step_from(step) for step in told["steps"]),
        where=None if where is None else Where(**where | {"experiments": tuple(where["experiments"])}),
        flagged=tuple(told["flagged"]),
        first_scores=told["first_scores"],
        first_parameters=told["first_parameters"],
        parameters={name: tuple(values) for name, values in told["parameters"].items()},
        zones=_table_from(read["zones"], "zone_number"),
        station=_table_from(stations, "station", *AT_STATIONS),
        **{name: stations[name] for name in AT_STATIONS},
        map_x=places["x"],
        map_y=places["y"],
        map_score=places["score"],
        cosine_names=tuple(read["alike"]["name"]),
        cosine=read["alike"]["cosine"],
    )


def _plain_names() -> dict[str, type]:
    """Fields of a diagnosis that are one number or word."""
    kinds = {each.name: each.type for each in fields(Diagnosis)}
    return {
        name: str if kind is Verdict else kind for name, kind in kinds.items() if kind in (str, int, float, Verdict)
    }


def _table_from(group: Mapping[str, Any], *others: str) -> pd.DataFrame:
    return pd.DataFrame({name: values for name, values in group.items() if name not in others})


def _step_from(step: dict[str, Any]) -> Step:
    lists = {name: tuple(step[name]) for name in ("rivals", "chances")}
    return Step(**step | lists | {"groups": tuple(tuple(group) for group in step["groups"])})


def _row(suspect: Suspect) -> dict[str, Any]:
    row = asdict(suspect)
    low, high = row.pop("interval95")
    return row | {"low95": low, "high95": high, "shapes": json.dumps(suspect.shapes)}


def _suspects_from(group: Mapping[str, Any]) -> tuple[Suspect, ...]:
    found = []
    for row in _table_from(group, "suspect").to_dict("records"):
        interval = row.pop("low95"), row.pop("high95")
        found.append(Suspect(**row | {"interval95": interval, "shapes": json.loads(row["shapes"])}))
    return tuple(found)
