"""The study of docs/discover.md: laws that stand in no list and not in the grammar, hidden and searched.

    python tests/studies/laws.py [--most N] [--page] [--runs FOLDER] [--anew]

One line of JSON for each data set in runs/laws/records.jsonl: what stands there, or in data/blind/laws.jsonl, is not
done again, so that the study may be stopped and go on. After a change of the search it has to be made --anew.
"""

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from blind import records_in
from law_angles import ANGLES
from law_page import write_law_page
from law_sets import LAW_EDITION, LawDataSet, LawTrial, knowing_hidden, law_data_set, law_trials, law_truth

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, baseline
from vegglue.calibration.candidates import Candidate, start_amplitude, with_effect
from vegglue.case.parameter_space import z_of
from vegglue.case.schema import Case
from vegglue.diagnosis.child_config import candidate_named
from vegglue.diagnosis.law_search import Discovery, laws_beyond
from vegglue.diagnosis.refits import Refit
from vegglue.engine.interface import linearise
from vegglue.errors import InputError
from vegglue.inference.weighted_statistics import root_mean_square
from vegglue.parallel import at_most
from vegglue.progress import silent

ROOT = Path(__file__).parents[2]
RUNS = ROOT / "runs" / "laws"
KEPT = ROOT / "data" / "blind" / "laws.jsonl"


def study_of_laws(trial: LawTrial, truths: Path) -> dict[str, Any]:
    """The record of one data set: what was hidden, what was found, and errors in an experiment that was held out;
    truths: the folder in which these are kept.
    """
    record: dict[str, Any] = {"key": trial.key, "edition": LAW_EDITION, "group": trial.group, "hide": trial.hide}
    truth = law_truth(trial, truths)
    if truth.left_out:
        return record | {"left_out": truth.left_out}
    data = law_data_set(trial, truth)
    record |= {"hidden": data.hidden, "also_true": dict(data.also_true), "truth_seconds": truth.seconds}
    began = time.process_time()
    try:
        base = baseline(data.model)
        found = laws_beyond(base, without=(), watch=silent)
        record |= _found_in(found)
        record["seconds"] = time.process_time() - began
        record["held_out"] = _errors_held_out(trial, data, base, found)
        if trial.group == "listed":
            without = laws_beyond(base, [trial.hide], watch=silent)
            record["without"] = _found_in(without)
            record["held_out_without"] = _errors_held_out(trial, data, base, without)
    except Exception as error:  # a crash is counted, and stops no study of hours
        return record | {"left_out": f"no search: {type(error).__name__}: {error}"}
    return record


def _found_in(found: Discovery) -> dict[str, Any]:
    """What was found, best first."""
    return {
        "p": found.p,
        "tried": found.tried,
        "best": "" if found.best is None else found.best.law.name,
        "laws": [
            {"term": one.law.term.name, "quantity": one.law.quantity.name, "form": one.law.form.name,
             "chance": one.chance, "strength": one.strength, "reference": one.reference, "same_as": one.same_as}
            for one in found.laws
        ],
        "product": "" if found.product is None else found.product.found.law.name,
        "others": found.others,
        "compared": dict(found.compared),
    }  # fmt: skip


def _errors_held_out(trial: LawTrial, data: LawDataSet, base: Baseline, found: Discovery) -> dict[str, float | None]:
    """Root mean square errors of predictions in the experiment that was held out [m/s], without errors of probes: of
    the model as it is, with the law that was found, with what was likeliest, law or not, and with what was hidden.
    """
    model, z, truth = data.model, base.fitted.point.z, None
    before = told = _error_of(data, model.case, z)
    if found.likeliest is not None:
        one = found.likeliest
        told = _error_with(data, replace(base, model=model), one.candidate, dict(one.shapes), one.amplitude)
    if found.product is not None and found.likeliest is not None:
        told = _error_with_both(data, replace(base, model=model), found.likeliest, found.product.refit)
    if data.hidden is not None:
        known = replace(model, case=knowing_hidden(model.case)) if trial.group == "law" else model
        one = candidate_named(known.case, model.station, trial.hide)
        truth = _error_with(data, replace(base, model=known), one, data.hidden["shapes"], data.hidden["amplitude"])
    after = None if found.best is None else told
    return {"before": before, "after": after, "told": told, "truth": truth}


def _error_with(
    data: LawDataSet, base: Baseline, one: Candidate, shapes: dict[str, float], amplitude: float
) -> float | None:
    """Of the model with one effect more, calibrated from about that amplitude; None where no flow is found."""
    case = with_effect(base.model.case, one, shapes)
    off = one.amplitude.off
    start = start_amplitude(one.amplitude, one.amplitude.gain(off + 0.7 * (amplitude - off)))
    z = np.append(base.fitted.point.z, z_of(case.parameters[one.parameter], start))
    try:
        there = baseline(replace(base.model, case=case), z).fitted.point.z
    except InputError:
        return None
    return _error_of(data, case, there)


def _error_with_both(data: LawDataSet, base: Baseline, law: Refit, product: Refit) -> float | None:
    """Of the model with a law and its product, calibrated from where both were found."""
    case = with_effect(base.model.case, law.candidate, law.shapes)
    both = replace(base.model, case=with_effect(case, product.candidate, product.shapes))
    try:
        there = baseline(both, product.fitted.point.z).fitted.point.z
    except InputError:
        return None
    return _error_of(data, both.case, there)


def _error_of(data: LawDataSet, case: Case, z: Array) -> float | None:
    other = case.model_copy(update={"experiments": data.case.experiments})
    point = linearise(replace(data.model, case=other, station=data.held_out), z)
    if point is None:
        return None
    error = data.held_out["value"].to_numpy(float) - point.prediction
    return float(root_mean_square(error[np.isfinite(error)]))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--most", type=int, default=None, help="data sets to do at most")
    parser.add_argument("--page", action="store_true", help="write the page from what is there, and do no more")
    parser.add_argument("--runs", type=Path, default=RUNS)
    parser.add_argument("--anew", action="store_true", help="leave aside what data/blind holds")
    given = parser.parse_args()
    path = given.runs / "records.jsonl"
    kept = [] if given.anew else list(records_in(KEPT, LAW_EDITION))
    if not given.page:
        _make(path, {record["key"] for record in kept}, given.most)
    found = {record["key"]: record for record in (*kept, *records_in(path, LAW_EDITION))}
    write_law_page(list(found.values()), list(records_in(ANGLES, LAW_EDITION)), ROOT / "docs" / "discover.md")


def _make(path: Path, kept: set[str], most: int | None) -> None:
    """Do what is not yet done, `most` data sets at most."""
    path.parent.mkdir(parents=True, exist_ok=True)
    done = kept | {record["key"] for record in records_in(path, LAW_EDITION)}
    todo = [trial for trial in law_trials() if trial.key not in done][:most]
    with path.open("a", encoding="utf-8") as file, at_most(1):
        for count, trial in enumerate(todo, 1):
            record = study_of_laws(trial, path.parent / "truths")
            file.write(json.dumps(record) + "\n")
            file.flush()
            said = record.get("left_out") or record["best"] or ", ".join(record["others"]) or "nothing"
            print(f"{count} of {len(todo)}: {record['key']} {trial.hide}: {said}", flush=True)


if __name__ == "__main__":
    from laws import main  # by its name, so that places are known between data sets

    main()
