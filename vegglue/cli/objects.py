"""Results as objects, as `--json` prints them: names of files and every number that words state."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from vegglue.case.schema import Case
from vegglue.diagnosis.comparison import model_score_json
from vegglue.diagnosis.law_search import LawFound
from vegglue.flow.status import FAILED, SOLVED_BY_MARCHING, members_with
from vegglue.inference.statements import off_its_prior, posterior_statements, pressed_bounds
from vegglue.results.diagnosis import Diagnosis, diagnosis_json
from vegglue.results.ensemble import Ensemble
from vegglue.results.plan import FieldPlan, plan_json
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
            sections = [
                {"experiment": one.experiment, "section": one.section, "x": one.x, "carried": one.value,
                 "interval95": one.interval95, "stated": one.stated, "share_of_width": one.share,
                 "verticals": one.verticals, "gauged": one.gauged, "clearly_off": one.clearly_off}
                for one in result.carried
            ]  # fmt: skip
            return {
                "case": case.name, "experiments": list(case.experiments), "cells": result.cells,
                "stations": result.stations, "used_stations": result.used_stations,
                "remarks": sentences(result.remarks), "picture": result.picture, "sections": sections,
                "findings": [tagged(one) for one in result.remarks],
            }  # fmt: skip
        case Ensemble():
            marched, failed = (members_with(result.status, number) for number in (SOLVED_BY_MARCHING, FAILED))
            mass = None if result.by_command else result.mass_error[result.status != FAILED].max(initial=0.0)
            counts = {"members": len(result.status), "marched": marched, "failed": failed}
            return counts | {"largest_mass_error": mass, "file": folder / "ensemble.h5"}
        case Posterior():
            return _posterior_object(case, result) | {"file": folder / "posterior.h5"}
        case Diagnosis():
            return diagnosis_json(result)
        case DiscoveredCase():
            found = result.found
            return {
                "sentence": sentence(found.sentence), "p": found.p, "laws_tried": found.tried,
                "laws": [_law_object(one) for one in found.laws],
                "product": None if found.product is None else _law_object(found.product.found), "others": found.others,
                "left_out": sentence(result.aside) or None, "effect_file": result.effect_file,
                "config": None if result.child is None else result.child.source,
            }  # fmt: skip
        case StepwiseExtension():
            told = {"configs": [one.source for one in result.cases], "cases": [one.name for one in result.cases]}
            told |= {"sentence": sentence(result.sentence), "reason": sentence(result.reason)}
            told |= {"unclear": result.unclear}
            return told | _comparison_object(result.comparison)
        case Comparison():
            return _comparison_object(result)
        case FieldPlan():
            return plan_json(result) | {"page": (folder / "plan" / "plan.html").resolve()}
        case list():
            questions = [
                {"tells_apart": one.tells_apart, "answered": one.answered,
                 "measurements": [asdict(each) | {"gain_per_hour": each.per_hour} for each in one.measurements]}
                for one in result
            ]  # fmt: skip
            return {"questions": questions}
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


def _law_object(one: LawFound) -> Object:
    return {
        "name": one.name, "title": one.law.title, "equation": one.equation, "same_as": one.same_as or None,
        "reference": one.reference, "strength": one.strength, "interval95": one.interval95, "chance": one.chance,
        "log_evidence": one.log_evidence, "seen": one.seen, "factor": one.factor, "alike": one.alike,
    }  # fmt: skip


def _posterior_object(case: Case, found: Posterior) -> Object:
    refined, marginals, learned = found.refinement, found.marginals, found.surrogate
    misfit = None if refined is None or refined.error_model.errors == "estimated" else refined.misfit
    parameters = {
        name: {
            "unit": found.sample.unit[name], "median": marginals.median[name], "sd": marginals.sd[name],
            "range95": marginals.quantiles[name][[0, -1]], "share_of_prior": marginals.width_ratio[name],
            "identified": bool(marginals.identified[name]), "at_bounds": pressed_bounds(found, name),
            "off_its_prior": off_its_prior(found, name),
        }
        for name in found.parameters
    }  # fmt: skip
    return {
        "method": found.settings.method, "members": found.sample.members, "failed": found.sample.failed,
        "effective_size": found.weighting.effective_size, "k_hat": found.weighting.pareto_k, "claimed": found.claimed,
        "parameters": parameters, "correlation": marginals.correlation, "used_stations": found.fit.used,
        "rmse": found.fit.rmse, "sigma": found.fit.sigma,
        "chi2": None if misfit is None else {"chi2": misfit.chi2, "freedom": misfit.freedom, "p": misfit.p_misfit},
        "surrogate": None if learned is None else {
            "runs": learned.runs, "failed": learned.failed, "settled": bool(learned.settled),
            "median_error": learned.median_error, "sd_error": learned.sd_error, "last_error": learned.last_error,
            "validation_discharges": [learned.validation_low, learned.validation_high],
        },
        "sentences": sentences(posterior_statements(found, case.reference.table if case.reference else None)),
    }  # fmt: skip


def _comparison_object(found: Comparison) -> Object:
    return {
        "rungs": [model_score_json(one) for one in found.model_scores],
        "left_out": found.left_out.to_dict("records"),
    }
