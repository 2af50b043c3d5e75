"""A diagnosis as it lies in diagnosis.h5: tables and arrays in groups, single numbers and words as attributes.

Lists and values of several parts are attributes as well, as JSON.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, get_args

import numpy as np
import pandas as pd
from pydantic import TypeAdapter

from vegglue.measurements.section_discharge import CarriedDischarge
from vegglue.results.causes import (
    UNIT_OF_FIELD,
    AmplitudeEstimate,
    CandidateEffect,
    CandidateLaw,
    CandidateLaws,
    Detectability,
    FaultyInstrument,
    FieldFound,
    FieldMapKept,
    LocalAnomaly,
    ModelErrorUsed,
    PlaceMap,
    Rival,
    ScoreTest,
    Step,
)
from vegglue.results.diagnosis import (
    Diagnosis,
    FirstScreening,
    Misfit,
    ParameterEstimates,
    Predictions,
    candidate_effect_json,
)
from vegglue.results.ensemble import STATION_UNITS, VALUE_UNIT
from vegglue.results.layout import (
    IN_WORDS,
    YES_OR_NO,
    Group,
    ReadGroup,
    Stored,
    Variable,
    fitting,
    names_of,
    stated_as,
    stations_from,
    table_group,
)
from vegglue.results.verdict import (
    ChiSquare,
    EffectFound,
    EffectsTested,
    EstimatedErrors,
    Note,
    Reason,
    Remaining,
    Verdict,
)
from vegglue.wording.sentences import tag_of, tagged

# Datasets of the group `stations` that are not columns of the table of stations.
AT_STATIONS = ("prediction_first", "prediction", "error")
STATION_VALUES = dict.fromkeys(AT_STATIONS, Stored(("station",)))
SPOTS = dict.fromkeys(("x", "y", "score"), Stored(("place",)))
FIELD_MAP = {
    "x": Stored(("x",)), "y": Stored(("y",)), "value": Stored(("x", "y")), "error": Stored(("x", "y")),
}  # fmt: skip
NUMBERS_OF_CANDIDATE = (
    "amplitude", "score", "p_family", "visibility", "smallest_detectable", "objective", "likeness", "off", "scale",
    "low95", "high95", "least", "most",
)  # fmt: skip
CANDIDATE_COLUMNS = {
    **dict.fromkeys(("name", "title", "unit", "mimicked_by", "shapes"), Stored(("suspect",), type=IN_WORDS)),
    **dict.fromkeys(("testable", "refitted"), Stored(("suspect",), type=YES_OR_NO)),
    **dict.fromkeys(NUMBERS_OF_CANDIDATE, Stored(("suspect",))),
}
ZONE_COLUMNS = {
    **dict.fromkeys(("experiment", "section", "zone"), Stored(("zone_number",), type=IN_WORDS)),
    **dict.fromkeys(("stations", "mean", "standard_error", "chi2"), Stored(("zone_number",))),
}
# Classes of the values in a verdict, by their tags.
VERDICT_VALUES = {
    tag_of(one): one
    for one in (
        Verdict, ChiSquare, EffectFound, EffectsTested, LocalAnomaly, FaultyInstrument, FieldFound, CandidateLaws,
        CandidateLaw, Rival, CarriedDischarge, *get_args(Reason), *get_args(Note), *get_args(Remaining),
    )
}  # fmt: skip


def diagnosis_groups(diagnosis: Diagnosis) -> dict[str, Group]:
    """All groups of diagnosis.h5: stations with predictions before and after, candidate effects, zones, the map of
    places, and cosines of fingerprints.
    """
    at_stations = diagnosis.predictions
    stations = table_group(at_stations.station, "station", STATION_UNITS)
    arrays = zip(AT_STATIONS, (at_stations.first, at_stations.last, at_stations.error), strict=True)
    values = {name: Variable(("station",), array, VALUE_UNIT) for name, array in arrays}
    candidate_effects = pd.DataFrame([_row(candidate_effect) for candidate_effect in diagnosis.candidate_effects])
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
        "suspects": table_group(candidate_effects, "suspect", {}),
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
    unit = UNIT_OF_FIELD[found.term]
    values = {name: Variable(("x", "y"), getattr(mapped, name), unit) for name in ("value", "error")}
    return {"field": Group({"x": mapped.x, "y": mapped.y}, values, {"x": "m", "y": "m"})}


def diagnosis_attributes(diagnosis: Diagnosis) -> dict[str, Any]:
    """Attributes of diagnosis.h5: numbers and words as they are, everything else as JSON.

    The verdict is read from `verdict_value` alone; its other attributes are for other programs.
    """
    verdict, misfit, errors = diagnosis.verdict, diagnosis.misfit, diagnosis.errors
    plain = {
        "name": diagnosis.name,
        "verdict": verdict.kind,
        "sentence": verdict.sentence,
        "clears_the_model": verdict.clears_the_model,
        "tells_laws": verdict.tells_laws,
        "left_over": verdict.left_over,
        "verdict_value": json.dumps(tagged(verdict)),
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
        "where": None if verdict.anomaly is None else asdict(verdict.anomaly),
        "remarks": verdict.remarks,
        "not_excluded": verdict.not_excluded,
        "standing_out": dict(verdict.significant_effects),
        "flagged": errors.flagged,
        "first_scores": diagnosis.first_screening.scores,
        "first_parameters": diagnosis.parameters.first,
        "parameters": diagnosis.parameters.last,
        "locations": [asdict(one) for one in diagnosis.places],
        "instruments": [asdict(one) for one in diagnosis.instruments],
        "field": None if diagnosis.field is None else asdict(diagnosis.field),
        "model_error": None if diagnosis.model_error is None else asdict(diagnosis.model_error),
        "laws": None if diagnosis.laws is None else asdict(diagnosis.laws),
    }
    return plain | {name: json.dumps(value) for name, value in composed.items()}


def diagnosis_from(groups: Mapping[str, Mapping[str, Any]], attributes: Mapping[str, Any]) -> Diagnosis:
    """The diagnosis whose file has these groups and attributes."""
    stations, places = fitting(groups["stations"], STATION_VALUES), fitting(groups["places"], SPOTS)
    candidate_effects = _table_from(groups["suspects"], "suspect", CANDIDATE_COLUMNS)
    found = Diagnosis(
        name=stated_as(str, attributes, "name"),
        version=stated_as(str, attributes, "version"),
        verdict=_verdict_from(stated_as(str, attributes, "verdict_value")),
        candidate_effects=tuple(_candidate_effect_from(row) for row in candidate_effects.to_dict("records")),
        steps=_parsed(tuple[Step, ...], attributes["steps"]),
        misfit=Misfit(
            chi2_first=stated_as(float, attributes, "chi2_first"),
            chi2=stated_as(float, attributes, "chi2"),
            freedom=stated_as(int, attributes, "freedom"),
            p=stated_as(float, attributes, "p_misfit"),
            zones=_table_from(groups["zones"], "zone_number", ZONE_COLUMNS),
        ),
        errors=EstimatedErrors(
            **{name: stated_as(float, attributes, name) for name in ("correlation", "scale", "grid_error")},
            flagged=_parsed(tuple[int, ...], attributes["flagged"]),
        ),
        first_screening=_first_screening_from(groups["alike"], attributes),
        parameters=ParameterEstimates(
            first=_parsed(dict[str, float], attributes["first_parameters"]),
            last=_parsed(dict[str, tuple[float, float, float]], attributes["parameters"]),
        ),
        predictions=Predictions(stations_from(stations), *(stations[name] for name in AT_STATIONS)),
        place_map=PlaceMap(stated_as(str, attributes, "mapped_term"), places["x"], places["y"], places["score"]),
        places=_parsed(tuple[LocalAnomaly, ...], attributes["locations"]),
        instruments=_instruments_from(attributes["instruments"]),
        field=_parsed(FieldFound | None, attributes["field"]),
        model_error=_parsed(ModelErrorUsed | None, attributes["model_error"]),
        field_map=FieldMapKept(**fitting(groups["field"], FIELD_MAP)) if "field" in groups else None,
        laws=_parsed(CandidateLaws | None, attributes["laws"]),
    )
    _refuse_strays(found)
    return found


def _refuse_strays(found: Diagnosis) -> None:
    """Errors: ValueError where a step names an effect, or a list a station, that the diagnosis does not hold."""
    effects = {one.name for one in found.candidate_effects}
    for step in found.steps:
        if step.accepted not in step.chance or not set(step.rivals) <= effects:
            raise ValueError(f"a step names {', '.join((step.accepted, *step.rivals))!r}, not all of them its suspects")
    rows = {*found.errors.flagged, *(row for one in found.instruments for row in one.stations)}
    if not rows <= set(range(len(found.predictions.station))):
        raise ValueError("a station that was set aside is not in the table")


def _parsed(kind: Any, text: str) -> Any:
    """A value of this kind from JSON. Errors: ValueError where it is none."""
    return TypeAdapter(kind).validate_json(text)


def _verdict_from(text: str) -> Verdict:
    found = _untagged(json.loads(text))
    if not isinstance(found, Verdict):
        raise ValueError("verdict_value is no verdict")
    return found


def _untagged(tree: Any) -> Any:
    """The values of which `tagged` made this tree. Errors: ValueError where one does not fit its class."""
    if isinstance(tree, list):
        return tuple(map(_untagged, tree))
    if not isinstance(tree, dict):
        return tree
    own = {name: _untagged(value) for name, value in tree.items()}
    tag = "tag" if "tag" in own else "kind"
    if own.get(tag) not in VERDICT_VALUES:
        return own
    return TypeAdapter(VERDICT_VALUES[own.pop(tag)]).validate_python(own)


def _instruments_from(text: str) -> tuple[FaultyInstrument, ...]:
    """Several stations have no place: null."""
    nowhere = {"x": float("nan"), "y": float("nan")}
    known = [{name: value for name, value in tree.items() if value is not None} for tree in json.loads(text)]
    instruments: tuple[FaultyInstrument, ...] = TypeAdapter(tuple[FaultyInstrument, ...]).validate_python(
        [nowhere | tree for tree in known]
    )
    return instruments


def _first_screening_from(alike: ReadGroup, attributes: Mapping[str, Any]) -> FirstScreening:
    compared = names_of(alike, "name")
    both = dict.fromkeys(("name", "other"), len(compared))
    return FirstScreening(
        threshold=stated_as(float, attributes, "threshold"),
        scores=_parsed(dict[str, float], attributes["first_scores"]),
        compared=compared,
        cosine=fitting(alike, {"cosine": Stored(("name", "other"))}, both)["cosine"],
    )


def _table_from(group: ReadGroup, dim: str, columns: Mapping[str, Stored]) -> pd.DataFrame:
    """A table without rows has no columns either."""
    there = fitting(group, columns if len(group) > 1 else {})
    return pd.DataFrame({name: there[name] for name in there if name != dim})


def _row(candidate_effect: CandidateEffect) -> dict[str, Any]:
    row = candidate_effect_json(candidate_effect)
    ends = dict(zip(("low95", "high95", "least", "most"), (*row.pop("interval95"), *row.pop("support")), strict=True))
    return row | ends | {"shapes": json.dumps(candidate_effect.shapes)}


def _candidate_effect_from(row: Mapping[str, Any]) -> CandidateEffect:
    return CandidateEffect(
        name=row["name"],
        title=row["title"],
        shapes=_parsed(dict[str, float], row["shapes"]),
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
