"""The study behind docs/blind.md: many small twins, something hidden in each, all diagnosed. `make blind`.

    python tests/studies/blind.py [--jobs N] [--share S] [--only KIND ...] [--case NAME ...] [--runs FOLDER]

One line of JSON for each data set in runs/blind/<case>.jsonl. What stands there is not done again, so that the study
may be stopped and go on, or grow by a larger --share of its data sets. Parameters are true at one of PLACES places of
the prior; the errors are new in each data set. Calibration starts at the true parameters, where an `infer` would have
led: a search from nowhere, which takes half of the time, is left to `tests/end_to_end/test_open_*.py`.
"""

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from blind_informed import informed, silent
from blind_page import write_page

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, baseline, for_prediction
from vegglue.case.config import load_case
from vegglue.case.parameter_space import z_at
from vegglue.case.schema import Case
from vegglue.diagnosis.child_config import candidate_named
from vegglue.diagnosis.comparison import improvement, rung
from vegglue.diagnosis.diagnose import diagnose_model
from vegglue.diagnosis.excluded_stations import excluded_by, excluding
from vegglue.diagnosis.next_measurement import SEPARATES, worth_of_measurements
from vegglue.engine.interface import Model, linearise
from vegglue.errors import InputError
from vegglue.parallel import as_finished
from vegglue.results.diagnosis import Diagnosis
from vegglue.screening.candidates import candidates_of, with_effect
from vegglue.twins.hidden_effect import TwinBase, VisibilityError, candidate_of, case_hiding
from vegglue.twins.reveal import marks
from vegglue.twins.sealed_answer import Answer
from vegglue.twins.twin import measured_twin, true_place, twin_base
from vegglue.workflow.next_measurement import rivals_of
from vegglue.workflow.run_folder import model_in

ROOT = Path(__file__).parents[2]
CONFIGS, RUNS = ROOT / "configs", ROOT / "runs" / "blind"
# Cases that are studied, and the share of all data sets that is made in each.
CASES = {"twin": 1.0, "campaign": 0.1}
PLACES = 16
UNLISTED = tuple(f"unlisted:{name}" for name in ("pier", "jet", "sink", "fallen_tree", "scour_hole"))
# Pairs that leave different traces, so that both could be found.
TWO = (
    ("discharge_error[high]", "secondary_current"), ("viscosity", "gauge_datum"), ("inflow_skew", "probe_gain[C]"),
    ("station_shift[B]", "outlet_level_error[low]"), ("bank_difference", "discharge_error[mid]"),
)  # fmt: skip
# Data sets of each kind at share 1; of those with an effect, up to a third cannot be made visible and are left out.
SIZES = {
    "null-white": 200, "null-ar1": 200, "null-understated": 60, "snr3": 300, "snr6": 300, "unlisted": 60, "two": 30,
    "probe": 30, "snr2": 50, "snr4": 50, "snr5": 50,
}  # fmt: skip
RATIO, USUAL_RATIO = "snr", 6.0
NOISE = {"null-ar1": "ar1:0.5", "null-understated": "understated:1.5"}
# The size of this one is counted in cells: on the truth's grid the same number is another effect.
OF_THE_GRID = ("smagorinsky",)
# Places for which it is computed what well-calibrated sets come to.
INFORMED_PLACES = (0, 5, 10)
# Every so many data sets, held-out errors are taken before and after, and the measurement that `next` proposes is made.
LOOKED_INTO = 4


@dataclass(frozen=True)
class Trial:
    """One data set. hide: what; signal: how visible it is made."""

    group: str
    number: int
    hide: tuple[str, ...]
    signal: float

    @property
    def key(self) -> str:
        return f"{self.group}/{self.number}"


def planned_trials(names: list[str]) -> list[Trial]:
    """All data sets, mixed so that a study that is stopped has some of each kind."""
    found = [
        Trial(group, number, _hidden(group, number, names), _signal(group))
        for group, size in SIZES.items()
        for number in range(size)
    ]
    return sorted(found, key=lambda trial: (trial.number + 0.5) / SIZES[trial.group])


def _signal(group: str) -> float:
    return float(group.removeprefix(RATIO)) if group.startswith(RATIO) else USUAL_RATIO


def _hidden(group: str, number: int, names: list[str]) -> tuple[str, ...]:
    if group.startswith("null"):
        return ()
    if group == "unlisted":
        return (UNLISTED[number % len(UNLISTED)],)
    if group == "two":
        return TWO[number % len(TWO)]
    # Names in an order of their own, so that few data sets already hold effects of every kind.
    name = names[(number * 23) % len(names)]
    return (name, "bad_probe") if group == "probe" else (name,)


@lru_cache
def model_of_study(config: Path) -> Model:
    return model_in(load_case(config))


@lru_cache(maxsize=PLACES)
def ground_of_study(config: Path, place: int) -> TwinBase:
    model = model_of_study(config)
    return twin_base(model, true_place(len(model.names), place))


def study(trial: Trial, config: Path) -> dict[str, Any]:
    """The record of one data set: what was hidden, what was said, and what came of it."""
    seed = list(SIZES).index(trial.group) * 100_000 + trial.number
    ground = ground_of_study(config, (trial.number * 7 + len(trial.group)) % PLACES)
    record: dict[str, Any] = {"key": trial.key, **asdict(trial)}
    began = time.process_time()
    try:
        station, answer = measured_twin(ground, trial.hide, trial.signal, NOISE.get(trial.group, "white"), seed)
    except InputError as error:
        return record | {"left_out": str(error), "visible": not isinstance(error, VisibilityError)}
    model = replace(ground.model, station=station)
    found = diagnose_model(model)
    record |= _said(answer, found) | {"seconds": time.process_time() - began}
    if found.steps and trial.number % LOOKED_INTO == 0:
        record |= held_out(model, found)
        if answer.hidden and len(found.steps[0].groups) > 1:
            record["next"] = measured_again(ground, model, answer, found, seed)
    return record


def _said(answer: Answer, found: Diagnosis) -> dict[str, Any]:
    names, cosine = found.first_screening.compared, found.first_screening.cosine
    verdict, errors = found.verdict, found.errors
    alike = {
        hidden.name: {
            names[j]: round(float(cosine[names.index(hidden.name), j]), 3)
            for j in range(len(names))
            if names[j] != hidden.name and abs(cosine[names.index(hidden.name), j]) > 0.9
        }
        for hidden in answer.hidden
        if hidden.name in names
    }
    return {
        "hidden": [asdict(hidden) for hidden in answer.hidden],
        "marks": [
            {"hidden": {"name": mark.hidden.name}, "found": mark.found, "inside": mark.inside, "named": mark.named,
             "amplitude": mark.amplitude, "away": None if np.isnan(mark.away) else mark.away}
            for mark in marks(answer, found)
        ],
        "verdict": verdict.kind, "set": found.set, "not_excluded": verdict.not_excluded,
        "steps": [asdict(step) for step in found.steps],
        "where": None if verdict.location is None else asdict(verdict.location), "flagged": len(errors.flagged),
        "correlation": errors.correlation, "scale": errors.scale, "p_misfit": found.misfit.p,
        "threshold": found.first_screening.threshold, "alike": alike,
        "scores": {one.name: one.test.score for one in found.suspects[:8]},
    }  # fmt: skip


def calibrated(model: Model, found: Diagnosis, theta: dict[str, float]) -> Baseline:
    """As `compare` and `next` do: without what the diagnosis set aside, to predict on its own grid."""
    known = z_at(model.case, {name: np.array([theta[name]]) for name in model.names})[0]
    return for_prediction(baseline(excluding(model, excluded_by(found)), known))


def with_accepted(model: Model, found: Diagnosis) -> Model:
    """The model with all effects that the diagnosis accepted."""
    case: Case = model.case
    for step in found.steps:
        candidate = candidate_named(case, model.station, step.accepted)
        case = with_effect(case, candidate, found.suspect(step.accepted).shapes)
    return replace(model, case=case)


def held_out(model: Model, found: Diagnosis) -> dict[str, Any]:
    """Errors of held-out sections without and with what was accepted [m/s], and by how much their squares fall."""
    theta = {name: three[0] for name, three in found.parameters.last.items()}
    before = rung(calibrated(model, found, found.parameters.first))
    after = rung(calibrated(with_accepted(model, found), found, theta))
    errors = [one.held_out.sections[after.held_out.velocity] for one in (before, after)]
    known = np.isfinite(errors[0]) & np.isfinite(errors[1])
    return {
        "gain": improvement(before, after)[0],
        "held_out": [float(np.sqrt(np.mean(error[known] ** 2))) for error in errors],
    }


def measured_again(
    ground: TwinBase, model: Model, answer: Answer, found: Diagnosis, seed: int
) -> dict[str, Any] | None:
    """The best next measurement, made and added: groups of the first step before and after; None if none is of use."""
    base = calibrated(model, found, found.parameters.first)
    rivals = rivals_of(model.case, found, found.steps[0].rivals)
    best = worth_of_measurements(base.model, base.noise, base.fitted.point.z, [rivals])[0][0]
    if best.then < SEPARATES:
        return None
    more = best.plan.stations
    usual = model.station.groupby("kind")["standard_error"].median()
    error = more["kind"].map(usual).to_numpy(float)
    experiments = {**model.case.experiments, best.plan.experiment: best.plan.setting}
    values = _true_values(ground, answer, experiments, more)
    if values is None:
        return None
    values += error * np.random.default_rng((seed, 3)).standard_normal(len(more))
    station = pd.concat([model.station, more.assign(value=values, standard_error=error, used=True)], ignore_index=True)
    case = model.case.model_copy(update={"experiments": experiments})
    again = diagnose_model(replace(model, case=case, station=station))
    return {
        "plan": best.plan.name, "now": best.now, "then": best.then, "before": len(found.steps[0].groups),
        "after": len(again.steps[0].groups) if again.steps else 0, "verdict": again.verdict.kind, "set": again.set,
    }  # fmt: skip


def _true_values(ground: TwinBase, answer: Answer, experiments: dict[str, Any], station: pd.DataFrame) -> Array | None:
    """What is true at further stations, of further experiments maybe."""
    case = ground.fine.case.model_copy(update={"experiments": experiments})
    for hidden in (one for one in answer.hidden if one.station < 0):
        case = case_hiding(case, candidate_of(ground.model, hidden.name), hidden)
    point = linearise(replace(ground.fine, case=case, station=station.reset_index(drop=True)), ground.there.z)
    return None if point is None else point.prediction


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--jobs", type=int, default=-1)
    parser.add_argument("--share", type=float, default=1.0, help="share of all data sets, 0 to 1")
    parser.add_argument("--only", nargs="*", choices=list(SIZES), default=list(SIZES), help="kinds of data sets")
    parser.add_argument("--case", nargs="*", choices=list(CASES), default=list(CASES))
    parser.add_argument("--runs", type=Path, default=RUNS)
    given = parser.parse_args()
    for case in given.case:
        run(case, given.runs, given.jobs, given.share * CASES[case], given.only)
    looks = [silent(ground_of_study(config_of("twin"), place)) for place in INFORMED_PLACES]
    bounds = {level: informed(looks, 3.0, level) for level in (0.95, 0.9)}
    write_page({case: list(records_in(given.runs / f"{case}.jsonl")) for case in CASES}, bounds, ROOT / "docs")


def config_of(case: str) -> Path:
    return CONFIGS / f"{case}.yaml"


def run(case: str, folder: Path, jobs: int, share: float, only: list[str]) -> None:
    """Do what is not yet done of the first part of each kind."""
    folder.mkdir(parents=True, exist_ok=True)
    path, config = folder / f"{case}.jsonl", config_of(case)
    model = model_of_study(config)
    names = [one.name for one in candidates_of(model.case, model.station) if one.name not in OF_THE_GRID]
    trials = [one for one in planned_trials(names) if one.number < share * SIZES[one.group] and one.group in only]
    done = {record["key"] for record in records_in(path)}
    todo = [trial for trial in trials if trial.key not in done]
    with path.open("a", encoding="utf-8") as file:
        for count, record in enumerate(as_finished(study, ((trial, config) for trial in todo), jobs), 1):
            file.write(json.dumps(record) + "\n")
            file.flush()
            print(f"{count} of {len(todo)}: {record['key']} {record.get('verdict', 'left out')}", flush=True)


def records_in(path: Path) -> Iterator[dict[str, Any]]:
    """All whole lines; the last one of a study that was stopped may not be whole."""
    if not path.exists():
        return
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            yield json.loads(line)
        except ValueError:
            continue


if __name__ == "__main__":
    from blind import main  # by its name, so that workers keep what they know between data sets

    main()
