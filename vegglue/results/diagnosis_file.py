"""A diagnosis as it lies in diagnosis.h5: tables and arrays in groups, single numbers and words as attributes.

Lists and values of several parts are attributes as well, as JSON.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, get_args

import numpy as np
import pandas as pd

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
from vegglue.results.type_adapters import type_adapter
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
FIELD_MAP = {"x": Stored(("x",)), "y": Stored(("y",)), "value": Stored(("x", "y")), "error": Stored(("x", "y"))}
ENDS = ("low95", "high95", "least", "most")  # of the interval and of the support of an amplitude
NUMBERS_OF_CANDIDATE = (
    "amplitude", "score", "p_family", "visibility", "smallest_detectable", "objective", "likeness", "off", "scale",
    *ENDS,
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
    effects = []
    for one in diagnosis.candidate_effects:
        row = candidate_effect_json(one)
        ends = (*row.pop("interval95"), *row.pop("support"))
        effects.append(row | dict(zip(ENDS, ends, strict=True)) | {"shapes": json.dumps(one.shapes)})
    places = diagnosis.place_map
    spots = {
        "x": Variable(("place",), places.x, "m"),
        "y": Variable(("place",), places.y, "m"),
        "score": Variable(("place",), places.score),
    }
    first, mapped, field = diagnosis.first_screening, diagnosis.field_map, diagnosis.field
    names = np.array(first.compared, object)
    groups = {
        "stations": Group(stations.coordinates, {**stations.variables, **values}),
        "suspects": table_group(pd.DataFrame(effects), "suspect", {}),
        "zones": table_group(diagnosis.misfit.zones, "zone_number", {}),
        "places": Group({"place": np.arange(places.x.size)}, spots),
        "alike": Group({"name": names, "other": names}, {"cosine": Variable(("name", "other"), first.cosine)}),
    }
    if mapped is not None and field is not None:
        unit = UNIT_OF_FIELD[field.term]
        cells = {name: Variable(("x", "y"), getattr(mapped, name), unit) for name in ("value", "error")}
        groups["field"] = Group({"x": mapped.x, "y": mapped.y}, cells, {"x": "m", "y": "m"})
    if (learned := diagnosis.bed_map) is not None:
        cells = {name: Variable(("x", "y"), getattr(learned, name), "m") for name in ("value", "error")}
        groups["bed"] = Group({"x": learned.x, "y": learned.y}, cells, {"x": "m", "y": "m"})
    return groups


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
    """The diagnosis whose file has these groups and attributes.

    Raises
    ------
    KeyError, ValueError
        If a part is missing or does not fit, a step names an effect, or a list a station, that the diagnosis lacks.
    """
    stations, places = fitting(groups["stations"], STATION_VALUES), fitting(groups["places"], SPOTS)
    verdict = _untagged(json.loads(stated_as(str, attributes, "verdict_value")))
    if not isinstance(verdict, Verdict):
        raise ValueError("verdict_value is no verdict")
    effects = []
    for row in _table_from(groups["suspects"], "suspect", CANDIDATE_COLUMNS).to_dict("records"):
        amplitude = AmplitudeEstimate(
            value=row["amplitude"],
            interval95=(row["low95"], row["high95"]),
            support=(row["least"], row["most"]),
            **{name: row[name] for name in ("unit", "off", "scale", "refitted", "objective")},
        )
        detectability = Detectability(
            visibility=row["visibility"],
            smallest=row["smallest_detectable"],
            testable=row["testable"],
            confounder=row["mimicked_by"],
            cosine=row["likeness"],
        )
        shapes, test = _parsed(dict[str, float], row["shapes"]), ScoreTest(row["score"], row["p_family"])
        effects.append(CandidateEffect(row["name"], row["title"], shapes, amplitude, test, detectability))
    compared = names_of(groups["alike"], "name")
    both = dict.fromkeys(("name", "other"), len(compared))
    # An instrument at several stations has no place: null.
    nowhere = {"x": float("nan"), "y": float("nan")}
    off = [{key: one for key, one in tree.items() if one is not None} for tree in json.loads(attributes["instruments"])]
    found = Diagnosis(
        name=stated_as(str, attributes, "name"),
        version=stated_as(str, attributes, "version"),
        verdict=verdict,
        candidate_effects=tuple(effects),
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
        first_screening=FirstScreening(
            threshold=stated_as(float, attributes, "threshold"),
            scores=_parsed(dict[str, float], attributes["first_scores"]),
            compared=compared,
            cosine=fitting(groups["alike"], {"cosine": Stored(("name", "other"))}, both)["cosine"],
        ),
        parameters=ParameterEstimates(
            first=_parsed(dict[str, float], attributes["first_parameters"]),
            last=_parsed(dict[str, tuple[float, float, float]], attributes["parameters"]),
        ),
        predictions=Predictions(stations_from(stations), *(stations[name] for name in AT_STATIONS)),
        place_map=PlaceMap(stated_as(str, attributes, "mapped_term"), places["x"], places["y"], places["score"]),
        places=_parsed(tuple[LocalAnomaly, ...], attributes["locations"]),
        instruments=type_adapter(tuple[FaultyInstrument, ...]).validate_python([nowhere | tree for tree in off]),
        field=_parsed(FieldFound | None, attributes["field"]),
        model_error=_parsed(ModelErrorUsed | None, attributes["model_error"]),
        field_map=FieldMapKept(**fitting(groups["field"], FIELD_MAP)) if "field" in groups else None,
        bed_map=FieldMapKept(**fitting(groups["bed"], FIELD_MAP)) if "bed" in groups else None,
        laws=_parsed(CandidateLaws | None, attributes["laws"]),
    )
    names = {one.name for one in found.candidate_effects}
    for step in found.steps:
        if step.accepted not in step.chance or not set(step.rivals) <= names:
            raise ValueError(f"a step names {', '.join((step.accepted, *step.rivals))!r}, not all of them candidates")
    rows = {*found.errors.flagged, *(row for one in found.instruments for row in one.stations)}
    if not rows <= set(range(len(found.predictions.station))):
        raise ValueError("a station that is excluded is not in the table")
    return found


def _table_from(group: ReadGroup, dim: str, columns: Mapping[str, Stored]) -> pd.DataFrame:
    """A table without rows has no columns either."""
    there = fitting(group, columns if len(group) > 1 else {})
    return pd.DataFrame({name: there[name] for name in there if name != dim})


def _parsed(kind: Any, text: str) -> Any:
    """A value of this kind from JSON. Errors: ValueError where it is none."""
    return type_adapter(kind).validate_json(text)


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
    return type_adapter(VERDICT_VALUES[own.pop(tag)]).validate_python(own)
