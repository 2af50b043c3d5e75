"""The study behind docs/blind.md: many data sets, something hidden in each, all diagnosed. `make blind`.

    python tests/studies/blind.py [--jobs N | --cluster ADDRESS] [--share S] [--only KEY ...] [--page] [--runs FOLDER]
        [--anew]

The truth is that of the second solver, on a site with small imperfections drawn anew for each data set, or that of the
model's own equations on a finer grid. Calibration starts where a user's does. One line of JSON for
each data set in runs/blind/records.jsonl: what stands there, or in data/blind, is not done again, so that the study may
be stopped and go on, or grow by a larger --share. After a change of the diagnosis it has to be made --anew.
"""

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from blind_held_out import held_out
from blind_page import write_page
from blind_sets import EDITION, INSTRUMENTS, NULL_NOISE, OBJECTS, PAIRS, DataSet, Trial, as_measured, model_of, told

from vegglue.calibration.candidates import candidates_of
from vegglue.case.text_files import write_text
from vegglue.cluster import on_cluster
from vegglue.diagnosis.diagnose import diagnose_model
from vegglue.errors import InputError
from vegglue.parallel import as_finished, at_most
from vegglue.results.diagnosis import Diagnosis
from vegglue.workflow.hidden_effect import UNLISTED, VisibilityError

ROOT = Path(__file__).parents[2]
RUNS = ROOT / "runs" / "blind"
# Records of the study as far as it was made: data sets cost hours.
KEPT = ROOT / "data" / "blind" / "records.jsonl"
LENGTHS, PLACE_LIMITS = KEPT.with_name("lengths.jsonl"), KEPT.with_name("place_limits.jsonl")
OBJECT_LIMITS = KEPT.with_name("object_limits.jsonl")
# Data sets of each kind at share 1, by whose truth it is and how large the campaign.
SIZES: dict[tuple[str, str], dict[str, int]] = {
    ("second", "twin"): {
        "null-perfect": 100, "null-site": 100, "listed6": 160, "listed3": 150, "unlisted": 214, "instrument": 20,
        "pair": 10, "probe": 10,
    },
    ("second", "campaign"): {
        "null-perfect": 50, "null-site": 50, "listed6": 20, "listed3": 14, "unlisted": 8, "instrument": 6, "pair": 3,
        "probe": 3,
    },
    ("own", "twin"): {
        "null-perfect": 20, "listed6": 18, "listed3": 9, "unlisted": 5, "instrument": 4, "pair": 2, "probe": 2,
    },
}  # fmt: skip
# From this number on, what is hidden is as long as stated in the flow of the stranger and not of the model.
FIRST_SIZED_IN_TRUTH = {("second", "twin"): {"listed6": 110, "listed3": 90, "unlisted": 124}}
RATIO = {"listed3": 3.0}
USUAL_RATIO = 6.0
# Every so many data sets with a listed effect, the model with the true effect is calibrated too.
LOOKED_INTO = 2
# Where something is hidden, a data set costs so many times as much, or more: sets with nothing hidden go on before.
DEARER = 2.5
# Effects are hidden in steps of so many names, a prime, so that few data sets already hold effects of every kind.
STRIDE = 29


def planned_trials() -> list[Trial]:
    """All data sets, mixed so that a study that is stopped has some of each kind, and more of what is cheap."""
    found = [
        (number / size * (1.0 if group.startswith("null") else DEARER), _trial(truth, case, group, number))
        for (truth, case), sizes in SIZES.items()
        for group, size in sizes.items()
        for number in range(size)
    ]
    return [trial for _, trial in sorted(found, key=lambda pair: pair[0])]


def _trial(truth: str, case: str, group: str, number: int) -> Trial:
    null = group.startswith("null")
    noise = NULL_NOISE[number % len(NULL_NOISE)] if null else "white"
    imperfect = truth == "second" and group != "null-perfect"
    hide, signal = _hide(case, group, number), 0.0 if null else RATIO.get(group, USUAL_RATIO)
    first = FIRST_SIZED_IN_TRUTH.get((truth, case), {}).get(group, number + 1)
    sized = "truth" if number >= first else "model"
    return Trial(truth, case, group, number, hide, signal, noise, imperfect, sized)


def _hide(case: str, group: str, number: int) -> tuple[str, ...]:
    if group.startswith("null"):
        return ()
    if group == "unlisted":
        return (UNLISTED + list(OBJECTS)[number % len(OBJECTS)],)
    if group == "instrument":
        return (INSTRUMENTS[number % len(INSTRUMENTS)],)
    if group == "pair":
        return PAIRS[number % len(PAIRS)]
    model = model_of(case)
    names = [one.name for one in candidates_of(model.case, model.station)]
    name = names[(number * STRIDE) % len(names)]
    return (name, "bad_probe") if group == "probe" else (name,)


def study(trial: Trial, runs: Path) -> dict[str, Any]:
    """The record of one data set: what was hidden, what was said, and what came of it."""
    record: dict[str, Any] = {"key": trial.key, "edition": EDITION, **asdict(trial)}
    with at_most(1):
        began = time.process_time()
        made = truth_of(trial, runs / "truths")
        if "left_out" in made:
            return record | {"left_out": made["left_out"]}
        data = as_measured(trial.case, made)
        truth_seconds, began = time.process_time() - began, time.process_time()
        try:
            found = diagnose_model(data.model)
        except Exception as error:  # a crash is counted, and stops no study of hours
            return record | {"left_out": f"no diagnosis: {type(error).__name__}: {error}"}
        record |= _said(data, found) | {"seconds": time.process_time() - began, "truth_seconds": truth_seconds}
        try:
            record["held_out"] = held_out(data, found, trial.number % LOOKED_INTO == 0)
        except Exception as error:  # as above
            record |= {"held_out": None, "not_held_out": f"{type(error).__name__}: {error}"}
    return record


def truth_of(trial: Trial, folder: Path) -> dict[str, Any]:
    """What is measured in a data set and what is true, or why there is none: from its file, or made and kept there."""
    path = folder / f"{trial.key}.json"
    if path.exists():
        kept: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if kept["edition"] == EDITION and kept.get("hide", list(trial.hide)) == list(trial.hide):
            return kept
    try:
        made = told(trial)
    except VisibilityError as error:
        made = {"edition": EDITION, "left_out": str(error)}
    except (InputError, RuntimeError) as error:
        made = {"edition": EDITION, "left_out": f"no data: {error}"}
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json.dumps(made), "expected a folder to write to; give another one by --runs")
    return made


def _said(data: DataSet, found: Diagnosis) -> dict[str, Any]:
    verdict, errors = found.verdict, found.errors
    return {
        "hidden": list(data.hidden), "also_true": data.also_true,
        "verdict": verdict.kind, "sentence": verdict.sentence, "set": found.set, "not_excluded": verdict.not_excluded,
        "steps": [asdict(step) for step in found.steps], "places": [asdict(place) for place in found.places],
        "instruments": [asdict(one) for one in found.instruments], "flagged": len(errors.flagged),
        "field": None if found.field is None else asdict(found.field),
        "sizes": {name: (size := found.candidate_effect(name).amplitude).value - size.off for name in found.set},
        "amplitudes": [row for one in data.hidden for row in _amplitude(one, found)],
        "p_misfit": found.misfit.p, "scale": errors.scale, "correlation": errors.correlation,
    }  # fmt: skip


def _amplitude(hidden: dict[str, Any], found: Diagnosis) -> list[dict[str, Any]]:
    """The interval of a hidden effect in the set, where its shapes are those of the truth."""
    if hidden["kind"] != "listed" or hidden["name"] not in found.set:
        return []
    suspect = found.candidate_effect(hidden["name"])
    if any(not np.isclose(suspect.shapes.get(name, true), true, rtol=0.05) for name, true in hidden["shapes"].items()):
        return []
    low, high = suspect.amplitude.interval95
    return [{"name": hidden["name"], "low": low, "high": high, "true": hidden["amplitude"]}]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--jobs", type=int, default=-1)
    parser.add_argument("--cluster", help="Dask scheduler, or local:N; workers need tests/studies on their PYTHONPATH")
    parser.add_argument("--share", type=float, default=1.0, help="share of all data sets, 0 to 1")
    parser.add_argument("--only", nargs="+", default=[""], help="how keys begin: second/twin, own/twin/listed6, ...")
    parser.add_argument("--truths", action="store_true", help="make the truths, and diagnose nothing")
    parser.add_argument("--page", action="store_true", help="write the page from what is there, and do no more")
    parser.add_argument("--runs", type=Path, default=RUNS)
    parser.add_argument("--anew", action="store_true", help="leave aside what data/blind holds")
    given = parser.parse_args()
    path = given.runs / "records.jsonl"
    kept = [] if given.anew else list(records_in(KEPT))
    if not given.page:
        with on_cluster(given.cluster):
            todo = planned(given.share, given.only)
            if given.truths:
                make_truths(todo, given.runs, given.jobs)
                return
            run(todo, path, {record["key"] for record in kept}, given.jobs)
    records = {record["key"]: record for record in (*kept, *records_in(path))}
    write_page(
        list(records.values()),
        ROOT / "docs",
        values_by_key(LENGTHS, "truth"),
        values_by_key(PLACE_LIMITS, "near"),
        lines_by_key(OBJECT_LIMITS),
    )


def values_by_key(path: Path, name: str) -> dict[str, float]:
    """One value of each data set that `blind_lengths` or one of the studies of limits looked into, by its key."""
    return {key: one[name] for key, one in lines_by_key(path).items()}


def lines_by_key(path: Path) -> dict[str, dict[str, Any]]:
    """What one of those studies found of each data set, by its key."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return {one["key"]: one for one in map(json.loads, lines)}


def planned(share: float, only: list[str]) -> list[Trial]:
    """The first part of each kind whose keys begin so."""
    return [
        one
        for one in planned_trials()
        if one.number < share * SIZES[one.truth, one.case][one.group] and one.key.startswith(tuple(only))
    ]


def make_truths(todo: list[Trial], runs: Path, jobs: int) -> None:
    """Truths of data sets, kept where `study` looks for them."""
    for count, made in enumerate(as_finished(truth_of, ((trial, runs / "truths") for trial in todo), jobs), 1):
        print(f"{count} of {len(todo)}: {made.get('key', made.get('left_out'))}", flush=True)


def run(todo: list[Trial], path: Path, kept: set[str], jobs: int) -> None:
    """Do what is not yet done."""
    path.parent.mkdir(parents=True, exist_ok=True)
    done = kept | {record["key"] for record in records_in(path)}
    todo = [trial for trial in todo if trial.key not in done]
    with path.open("a", encoding="utf-8") as file:
        for count, record in enumerate(as_finished(study, ((trial, path.parent) for trial in todo), jobs), 1):
            file.write(json.dumps(record) + "\n")
            file.flush()
            print(f"{count} of {len(todo)}: {record['key']} {record.get('verdict', 'left out')}", flush=True)


def records_in(path: Path, edition: str = EDITION) -> Iterator[dict[str, Any]]:
    """All whole lines of an edition; the last one of a study that was stopped may not be whole."""
    if not path.exists():
        return
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            record = json.loads(line)
        except ValueError:
            continue
        if record.get("edition") == edition:
            yield record


if __name__ == "__main__":
    from blind import main  # by its name, so that workers keep what they know between data sets

    main()
