"""Results as objects, as `--json` prints them: names of files and every number that words state."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from vegglue.case.schema import Case
from vegglue.diagnosis.comparison import model_score_json
from vegglue.diagnosis.discovered import LawFound
from vegglue.flow.status import FAILED, SOLVED_BY_MARCHING, members_with
from vegglue.inference.statements import off_its_prior, posterior_statements, pressed_bounds
from vegglue.measurements.section_discharge import CarriedDischarge
from vegglue.results.diagnosis import Diagnosis, diagnosis_json
from vegglue.results.ensemble import Ensemble
from vegglue.results.open_questions import ProposedMeasurement, Question
from vegglue.results.posterior import Posterior
from vegglue.wording.sentences import sentence, sentences, tagged
from vegglue.workflow.check import CheckedCase
from vegglue.workflow.compare import Comparison
from vegglue.workflow.discover import DiscoveredCase
from vegglue.workflow.extend import StepwiseExtension

Object = dict[str, Any]


def object_of(case: Case, runs: Path, result: Any) -> Object:
    """What a verb returns of a case, by name."""
    folder = runs / case.name
    match result:
        case CheckedCase():
            return _checked(case, result)
        case Ensemble():
            return _ensemble(result) | {"file": folder / "ensemble.h5"}
        case Posterior():
            return _posterior(case, result) | {"file": folder / "posterior.h5"}
        case Diagnosis():
            return diagnosis_json(result)
        case DiscoveredCase():
            return _discovered(result)
        case StepwiseExtension():
            told = {"configs": [one.source for one in result.cases], "cases": [one.name for one in result.cases]}
            told |= {"sentence": sentence(result.sentence), "reason": sentence(result.reason)}
            told |= {"unclear": result.unclear}
            return told | _comparison(result.comparison)
        case Comparison():
            return _comparison(result)
        case list():
            return {"questions": [_question(one) for one in result]}
        case Path():
            return {"report": result.resolve()}
    return {"note": str(result)}


def run_object(runs: Path, results: Sequence[tuple[Case, Any]]) -> Object:
    """What `run` found of the case it was given: diagnosis, extension, discovery, comparison with its law, questions;
    then, of each case by name, its own diagnosis and questions, its ensemble, posterior and report, and what was up to
    date in `notes`.
    """
    told: Object = {"cases": {}}
    for case, result in results:
        of_case = told["cases"].setdefault(case.name, {"config": case.source, "notes": []})
        match result:
            case Diagnosis():
                of_case["diagnosis"] = object_of(case, runs, result)
                told.setdefault("diagnosis", of_case["diagnosis"])
            case StepwiseExtension():
                told["extension"] = object_of(case, runs, result)
            case DiscoveredCase():
                told["discovery"] = object_of(case, runs, result)
            case Comparison():
                told["comparison"] = object_of(case, runs, result)
            case list():
                of_case |= object_of(case, runs, result)
                told.setdefault("questions", of_case["questions"])
            case Ensemble():
                of_case["ensemble"] = object_of(case, runs, result)
            case Posterior():
                of_case["posterior"] = object_of(case, runs, result)
            case Path():
                of_case |= object_of(case, runs, result)
            case _:
                of_case["notes"].append(str(result))
    return told


def _checked(case: Case, found: CheckedCase) -> Object:
    return {
        "case": case.name, "experiments": list(case.experiments), "cells": found.cells, "stations": found.stations,
        "used_stations": found.used_stations, "remarks": sentences(found.remarks), "picture": found.picture,
        "sections": [_carried(one) for one in found.carried],
        "findings": [tagged(one) for one in found.remarks],
    }  # fmt: skip


def _carried(one: CarriedDischarge) -> Object:
    """Discharges [m3/s]; stated: both ends of its priors, null where it is not known."""
    return {
        "experiment": one.experiment, "section": one.section, "x": one.x, "carried": one.value,
        "interval95": one.interval95, "stated": one.stated, "share_of_width": one.share, "verticals": one.verticals,
        "gauged": one.gauged, "clearly_off": one.clearly_off,
    }  # fmt: skip


def _discovered(result: DiscoveredCase) -> Object:
    return {
        "sentence": sentence(result.found.sentence),
        "p": result.found.p,
        "laws_tried": result.found.tried,
        "laws": [_law(one) for one in result.found.laws],
        "product": None if result.found.product is None else _law(result.found.product.found),
        "others": result.found.others,
        "left_out": sentence(result.aside) or None,
        "effect_file": result.effect_file,
        "config": None if result.child is None else result.child.source,
    }


def _law(one: LawFound) -> Object:
    return {
        "name": one.name, "title": one.law.title, "equation": one.equation, "same_as": one.same_as or None,
        "reference": one.reference, "strength": one.strength, "interval95": one.interval95, "chance": one.chance,
        "log_evidence": one.log_evidence, "seen": one.seen, "factor": one.factor, "alike": one.alike,
    }  # fmt: skip


def _ensemble(found: Ensemble) -> Object:
    marched, failed = (members_with(found.status, number) for number in (SOLVED_BY_MARCHING, FAILED))
    mass_error = None if found.by_command else found.mass_error[found.status != FAILED].max(initial=0.0)
    return {"members": len(found.status), "marched": marched, "failed": failed, "largest_mass_error": mass_error}


def _posterior(case: Case, found: Posterior) -> Object:
    refined = found.refinement
    misfit = None if refined is None or refined.error_model.errors == "estimated" else refined.misfit
    return {
        "method": found.settings.method,
        "members": found.sample.members,
        "failed": found.sample.failed,
        "effective_size": found.weighting.effective_size,
        "k_hat": found.weighting.pareto_k,
        "claimed": found.claimed,
        "parameters": {name: _parameter(found, name) for name in found.parameters},
        "correlation": found.marginals.correlation,
        "used_stations": found.fit.used,
        "rmse": found.fit.rmse,
        "sigma": found.fit.sigma,
        "chi2": None if misfit is None else {"chi2": misfit.chi2, "freedom": misfit.freedom, "p": misfit.p_misfit},
        "sentences": sentences(posterior_statements(found, case.reference.table if case.reference else None)),
    }


def _parameter(found: Posterior, name: str) -> Object:
    marginals = found.marginals
    return {
        "unit": found.sample.unit[name],
        "median": marginals.median[name],
        "sd": marginals.sd[name],
        "range95": marginals.quantiles[name][[0, -1]],
        "share_of_prior": marginals.width_ratio[name],
        "identified": bool(marginals.identified[name]),
        "at_bounds": pressed_bounds(found, name),
        "off_its_prior": off_its_prior(found, name),
    }


def _comparison(found: Comparison) -> Object:
    return {
        "rungs": [model_score_json(one) for one in found.model_scores],
        "left_out": found.left_out.to_dict("records"),
    }


def _question(question: Question) -> Object:
    """What is to be told apart, and the measurements that could."""
    return {
        "tells_apart": question.tells_apart, "answered": question.answered,
        "measurements": [_worth(one) for one in question.measurements],
    }  # fmt: skip


def _worth(one: ProposedMeasurement) -> Object:
    return {**asdict(one), "gain_per_hour": one.per_hour}
