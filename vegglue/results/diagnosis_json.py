"""A diagnosis as the object that `vegglue diagnose --json` prints."""

from dataclasses import asdict
from typing import Any

from vegglue.plain_json import plain
from vegglue.results.diagnosis import CandidateEffect, Diagnosis


def diagnosis_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """One object with every number that is printed."""
    verdict, misfit, errors = diagnosis.verdict, diagnosis.misfit, diagnosis.errors
    tree = {
        "verdict": verdict.kind,
        "sentence": verdict.sentence,
        "left_over": verdict.left_over,
        "standing_out": verdict.significant_effects,
        "set": diagnosis.set,
        "groups": diagnosis.groups,
        "not_excluded": verdict.not_excluded,
        "where": None if verdict.anomaly is None else asdict(verdict.anomaly),
        "effects": [flat_candidate_effect(candidate_effect) for candidate_effect in diagnosis.candidate_effects],
        "steps": [asdict(step) for step in diagnosis.steps],
        "remarks": verdict.remarks,
        "chi2": {"first": misfit.chi2_first, "last": misfit.chi2, "freedom": misfit.freedom, "p": misfit.p},
        "threshold": diagnosis.first_screening.threshold,
        "noise": {"correlation": errors.correlation, "scale": errors.scale, "grid_error": errors.grid_error},
        "flagged": [_flagged(diagnosis, row) for row in errors.flagged],
        "parameters": diagnosis.parameters.last,
        "first_parameters": diagnosis.parameters.first,
        "places": [asdict(one) for one in diagnosis.places],
        "instruments": [asdict(one) for one in diagnosis.instruments],
        "field": None if diagnosis.field is None else asdict(diagnosis.field),
        "model_error": None if diagnosis.model_error is None else asdict(diagnosis.model_error),
        "laws": None if diagnosis.laws is None else asdict(diagnosis.laws),
        "zones": misfit.zones.to_dict("records"),
    }
    return {name: plain(value) for name, value in tree.items()}


def flat_candidate_effect(candidate_effect: CandidateEffect) -> dict[str, Any]:
    """All numbers of a candidate_effect by the names they have in JSON and in diagnosis.h5."""
    amplitude, test, detectability = candidate_effect.amplitude, candidate_effect.test, candidate_effect.detectability
    return {
        "name": candidate_effect.name,
        "title": candidate_effect.title,
        "unit": amplitude.unit,
        "amplitude": amplitude.value,
        "interval95": amplitude.interval95,
        "score": test.score,
        "p_family": test.p_family,
        "visibility": detectability.visibility,
        "smallest_detectable": detectability.smallest,
        "testable": detectability.testable,
        "refitted": amplitude.refitted,
        "objective": amplitude.objective,
        "mimicked_by": detectability.confounder,
        "likeness": detectability.cosine,
        "shapes": candidate_effect.shapes,
        "off": amplitude.off,
        "scale": amplitude.scale,
        "support": amplitude.support,
    }


def _flagged(diagnosis: Diagnosis, row: int) -> dict[str, Any]:
    station = diagnosis.predictions.station.iloc[row]
    place = {name: str(station[name]) for name in ("experiment", "kind", "section")}
    return place | {name: float(station[name]) for name in ("x", "y", "value")}
