"""A diagnosis as it lies in diagnosis.h5: tables and arrays in groups, single numbers and words as attributes.

Lists and values of several parts are attributes as well, as JSON.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, TypeVar, cast

import numpy as np
import pandas as pd

from vegglue.results.diagnosis import (
    AmplitudeEstimate,
    Detectability,
    Diagnosis,
    EstimatedErrors,
    FaultyInstrument,
    FieldFound,
    FieldMapKept,
    FirstScreening,
    Location,
    Misfit,
    ModelErrorUsed,
    ParameterEstimates,
    PlaceMap,
    Predictions,
    ScoreTest,
    Step,
    Suspect,
    Verdict,
    VerdictKind,
)
from vegglue.results.diagnosis_json import flat_suspect
from vegglue.results.ensemble import STATION_UNITS, VALUE_UNIT
from vegglue.results.layout import Group, Variable, table_group

T = TypeVar("T")
# Datasets of the group `stations` that are not columns of the table of stations.
AT_STATIONS = ("prediction_first", "prediction", "error")
# Units of smooth fields, by their term.
FIELD_UNITS = {"friction": "-", "bed": "m", "viscosity": "m2/s", "inflow": "m/s"}


def diagnosis_groups(diagnosis: Diagnosis) -> dict[str, Group]:
    """All groups of diagnosis.h5: stations with predictions before and after, suspects, zones, the map of places, and
    cosines of fingerprints.
    """
    at_stations = diagnosis.predictions
    stations = table_group(at_stations.station, "station", STATION_UNITS)
    arrays = zip(AT_STATIONS, (at_stations.first, at_stations.last, at_stations.error), strict=True)
    values = {name: Variable(("station",), array, VALUE_UNIT) for name, array in arrays}
    suspects = pd.DataFrame([_row(suspect) for suspect in diagnosis.suspects])
    places = diagnosis.place_map
    spots = {
        "x": Variable(("place",), places.x, "m"),
        "y": Variable(("place",), places.y, "m"),
        "score": Variable(("place",), places.score),
    }
    first = diagnosis.first_screening
    names = np.array(first.compared, object)
    return {
        "stations": Group(stations.coordinates, {**stations.variables, **values}),
        "suspects": table_group(suspects, "suspect", {}),
        "zones": table_group(diagnosis.misfit.zones, "zone_number", {}),
        "places": Group({"place": np.arange(places.x.size)}, spots),
        "alike": Group({"name": names, "other": names}, {"cosine": Variable(("name", "other"), first.cosine)}),
        **_field_group(diagnosis),
    }


def _field_group(diagnosis: Diagnosis) -> dict[str, Group]:
    """The map of the field, where there is one."""
    mapped, found = diagnosis.field_map, diagnosis.field
    if mapped is None or found is None:
        return {}
    unit = FIELD_UNITS[found.term]
    values = {name: Variable(("x", "y"), getattr(mapped, name), unit) for name in ("value", "error")}
    return {"field": Group({"x": mapped.x, "y": mapped.y}, values, {"x": "m", "y": "m"})}


def diagnosis_attributes(diagnosis: Diagnosis) -> dict[str, Any]:
    """Attributes of diagnosis.h5: numbers and words as they are, everything else as JSON."""
    verdict, misfit, errors = diagnosis.verdict, diagnosis.misfit, diagnosis.errors
    plain = {
        "name": diagnosis.name,
        "verdict": verdict.kind,
        "sentence": verdict.sentence,
        "chi2_first": misfit.chi2_first,
        "chi2": misfit.chi2,
        "freedom": misfit.freedom,
        "p_misfit": misfit.p,
        "correlation": errors.correlation,
        "scale": errors.scale,
        "grid_error": errors.grid_error,
        "threshold": diagnosis.first_screening.threshold,
        "version": diagnosis.version,
        "mapped_term": diagnosis.place_map.term,
    }
    composed = {
        "steps": [asdict(step) for step in diagnosis.steps],
        "where": None if verdict.location is None else asdict(verdict.location),
        "remarks": verdict.remarks,
        "not_excluded": verdict.not_excluded,
        "flagged": errors.flagged,
        "first_scores": diagnosis.first_screening.scores,
        "first_parameters": diagnosis.parameters.first,
        "parameters": diagnosis.parameters.last,
        "locations": [asdict(one) for one in diagnosis.places],
        "instruments": [asdict(one) for one in diagnosis.instruments],
        "field": None if diagnosis.field is None else asdict(diagnosis.field),
        "model_error": None if diagnosis.model_error is None else asdict(diagnosis.model_error),
    }
    return plain | {name: json.dumps(value) for name, value in composed.items()}


def diagnosis_from(groups: Mapping[str, Mapping[str, Any]], attributes: Mapping[str, Any]) -> Diagnosis:
    """The diagnosis whose file has these groups and attributes."""
    stations, places = groups["stations"], groups["places"]
    return Diagnosis(
        name=str(attributes["name"]),
        version=str(attributes["version"]),
        verdict=_verdict_from(attributes),
        suspects=tuple(_suspect_from(row) for row in _table_from(groups["suspects"], "suspect").to_dict("records")),
        steps=tuple(_step_from(step) for step in json.loads(attributes["steps"])),
        misfit=Misfit(
            chi2_first=float(attributes["chi2_first"]),
            chi2=float(attributes["chi2"]),
            freedom=int(attributes["freedom"]),
            p=float(attributes["p_misfit"]),
            zones=_table_from(groups["zones"], "zone_number"),
        ),
        errors=EstimatedErrors(
            **{name: float(attributes[name]) for name in ("correlation", "scale", "grid_error")},
            flagged=tuple(json.loads(attributes["flagged"])),
        ),
        first_screening=_first_screening_from(groups["alike"], attributes),
        parameters=ParameterEstimates(
            first=json.loads(attributes["first_parameters"]),
            last={name: tuple(values) for name, values in json.loads(attributes["parameters"]).items()},
        ),
        predictions=Predictions(
            _table_from(stations, "station", *AT_STATIONS), *(stations[name] for name in AT_STATIONS)
        ),
        place_map=PlaceMap(str(attributes["mapped_term"]), places["x"], places["y"], places["score"]),
        places=tuple(_location_from(one) for one in json.loads(attributes["locations"])),
        instruments=tuple(_instrument_from(one) for one in json.loads(attributes["instruments"])),
        field=_optional(FieldFound, json.loads(attributes["field"])),
        model_error=_optional(ModelErrorUsed, json.loads(attributes["model_error"])),
        field_map=_optional(FieldMapKept, groups.get("field")),
    )


def _optional(kind: type[T], tree: Mapping[str, Any] | None) -> T | None:
    return None if tree is None else kind(**tree)


def _verdict_from(attributes: Mapping[str, Any]) -> Verdict:
    where = json.loads(attributes["where"])
    location = None if where is None else _location_from(where)
    return Verdict(
        kind=cast(VerdictKind, str(attributes["verdict"])),
        sentence=str(attributes["sentence"]),
        remarks=tuple(json.loads(attributes["remarks"])),
        location=location,
        not_excluded=tuple(tuple(group) for group in json.loads(attributes["not_excluded"])),
    )


def _location_from(tree: Mapping[str, Any]) -> Location:
    lists = {name: tuple(tree[name]) for name in ("interval95", "experiments")}
    return Location(**{**tree, **lists})


def _instrument_from(tree: Mapping[str, Any]) -> FaultyInstrument:
    place = {name: float("nan") if tree[name] is None else tree[name] for name in ("x", "y")}
    lists = {name: tuple(tree[name]) for name in ("stations", "interval95")}
    return FaultyInstrument(**{**tree, **place, **lists})


def _first_screening_from(alike: Mapping[str, Any], attributes: Mapping[str, Any]) -> FirstScreening:
    return FirstScreening(
        threshold=float(attributes["threshold"]),
        scores=json.loads(attributes["first_scores"]),
        compared=tuple(alike["name"]),
        cosine=alike["cosine"],
    )


def _table_from(group: Mapping[str, Any], *others: str) -> pd.DataFrame:
    return pd.DataFrame({name: values for name, values in group.items() if name not in others})


def _step_from(step: dict[str, Any]) -> Step:
    lists = {name: tuple(step[name]) for name in ("rivals", "chances")}
    return Step(**step | lists | {"groups": tuple(tuple(group) for group in step["groups"])})


def _row(suspect: Suspect) -> dict[str, Any]:
    row = flat_suspect(suspect)
    ends = dict(zip(("low95", "high95", "least", "most"), (*row.pop("interval95"), *row.pop("support")), strict=True))
    return row | ends | {"shapes": json.dumps(suspect.shapes)}


def _suspect_from(row: Mapping[str, Any]) -> Suspect:
    return Suspect(
        name=row["name"],
        title=row["title"],
        shapes=json.loads(row["shapes"]),
        amplitude=AmplitudeEstimate(
            value=row["amplitude"],
            interval95=(row["low95"], row["high95"]),
            support=(row["least"], row["most"]),
            **{name: row[name] for name in ("unit", "off", "scale", "refitted", "objective")},
        ),
        test=ScoreTest(row["score"], row["p_family"]),
        detectability=Detectability(
            visibility=row["visibility"],
            smallest=row["smallest_detectable"],
            testable=row["testable"],
            confounder=row["mimicked_by"],
            cosine=row["likeness"],
        ),
    )
