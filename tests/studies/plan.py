"""Is what `vegglue plan` calls detectable detected? `python tests/studies/plan.py CONFIG --sets 60 --minutes 4`,
and with `--compare 24` a proposed plan against plans made by hand.

The plan of the stations of a config states for each listed effect the size that is detected with 90 %, and the
chance that a plausible size is. Twins of the built-in engine hide testable effects at that size, and effects that are
hidden to the plan at a plausible size, each with parameters, errors and a sign of its own. An effect counts as detected
if the diagnosis is alarmed, and as named if it is among the effects of a step, alone or as one of a few. Records are
appended to data/plan/CONFIG.jsonl, and a set that is there is not made again.
"""

import argparse
import json
import time
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import scipy.stats

import vegglue
from vegglue.case.schema import Case, Planned, PlannedGauge, PlannedTransect
from vegglue.case.zones import corners_of
from vegglue.decision_constants import constants
from vegglue.diagnosis.plan import plan_measurements
from vegglue.diagnosis.plan_model import planned_pieces
from vegglue.effects.definition import Effect
from vegglue.effects.identity import EffectIdentity
from vegglue.effects.library import library
from vegglue.errors import InputError
from vegglue.plain_json import plain
from vegglue.results.plan import FieldPlan, hours_of
from vegglue.workflow.case_run import CaseRun

ROOT = Path(__file__).parents[2]
# Of three sets, two hide what is said to be detected and one what is said to be hidden.
HIDDEN_EVERY = 3


def one_set(config: Path, plan: FieldPlan, number: int) -> dict[str, Any]:
    """The record of one twin, or why it cannot be made."""
    hidden = [one for one in plan.effects if one.hidden]
    said_hidden = number % HIDDEN_EVERY == HIDDEN_EVERY - 1 and bool(hidden)
    random = np.random.default_rng((number, 63))
    of = hidden if said_hidden else plan.testable
    effect = of[int(random.integers(len(of)))]
    size = min(effect.plausible, effect.furthest) if said_hidden else effect.smallest
    case = vegglue.load_case(config)
    amplitude = listed(case, effect.name).amplitude
    signs = [sign for sign in (1.0, -1.0) if amplitude.low <= amplitude.off + sign * size <= amplitude.high]
    value = amplitude.off + float(random.choice(signs)) * size
    with TemporaryDirectory() as name:
        folder = Path(name) / "riddle"
        try:
            twin = vegglue.make_twin(case, folder, hide=[f"{effect.name}={value!r}"], seed=number + 1)
        except InputError as error:
            return {"set": number, "effect": effect.name, "failed": str(error)}
        began = time.monotonic()
        found = vegglue.diagnose(twin, runs=Path(name) / "runs")
        seconds = time.monotonic() - began
    verdict = found.verdict
    alarmed = verdict.kind in ("identified", "one-of", "none-of-these", "instrument") or bool(found.steps)
    named = sorted({rival for step in found.steps for rival in step.rivals})
    similar = [other.name for other in effect.confused if other.cosine > constants().alike_cosine]
    return {
        "set": number, "effect": effect.name, "amplitude": value, "said": "hidden" if said_hidden else "detected",
        "kind": verdict.kind, "alarm": alarmed,
        "named": effect.name in named, "similar_named": any(one in named for one in similar),
        "accepted": [step.accepted for step in found.steps], "places": len(found.places), "seconds": round(seconds, 1),
        "said_of_it": {key: asdict(effect)[key] for key in ("smallest", "plausible", "chance_plausible")},
    }  # fmt: skip


def listed(case: Case, name: str) -> Effect:
    """The effect of the library that acts under a name."""
    return library(case.effect_file)[EffectIdentity.parse(name).name]


def share(found: list[bool]) -> str:
    """A share with its 95 % interval (Clopper and Pearson)."""
    count, number = sum(found), len(found)
    if not number:
        return "none"
    low = scipy.stats.beta.ppf(0.025, count, number - count + 1) if count else 0.0
    high = scipy.stats.beta.ppf(0.975, count + 1, number - count) if count < number else 1.0
    return f"{count} of {number}, {100 * count / number:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def figures(records: list[dict[str, Any]]) -> str:
    """What the records show, in lines."""
    good = [one for one in records if "failed" not in one]
    lines = []
    for said in ("detected", "hidden"):
        of = [one for one in good if one["said"] == said]
        lines.append(f"said to be {said}: alarm in {share([one['alarm'] for one in of])}")
        lines.append(f"  named: {share([one['named'] for one in of])}")
        lines.append(f"  named, or one that is alike: {share([one['named'] or one['similar_named'] for one in of])}")
    return "\n".join(lines)


def counted(case: Case, plan: FieldPlan) -> tuple[int, int]:
    """Effects of the case, of experiments and of patches that are testable, and all; those of sections are left out,
    as each section brings its own.
    """
    kept = [one for one in plan.effects if listed(case, one.name).each not in ("section", "device")]
    return sum(one.testable for one in kept), len(kept)


def made_by_hand(case: Case, hours: float, beside_plants: bool) -> list[Planned]:
    """Transects equally spaced along the reach, or all beside the plants, with a gauge at each, in one flow and more:
    as many as fit the hours.
    """
    site = CaseRun(case).model
    low, high = case.grid.x
    ends = [corners_of(case, patch)[:, 0] for patch in case.plants.patches]
    middles = [0.5 * (one.min() + one.max()) for one in ends]
    found, names = [], list(case.experiments)
    for flows in range(1, len(names) + 1):
        best = None
        for count in range(1, 30):
            if beside_plants and count > len(middles):
                break
            x = np.round(middles[:count] if beside_plants else np.linspace(low, high, count + 2)[1:-1], 1)
            transects = tuple(
                PlannedTransect(x=float(one), spacing=0.5, experiments=tuple(names[-flows:])) for one in x
            )
            gauges = tuple(PlannedGauge(x=float(one), experiments=tuple(names[-flows:])) for one in x)
            planned = Planned(hours=hours, transects=transects, gauges=gauges)
            pieces = planned_pieces(site, planned)
            if hours_of(pieces, planned.costs.discharge) > hours:
                break
            best = planned
        if best is not None:
            found.append(best)
    return found


def compare(config: Path, hours: float) -> None:
    """Print a plan proposed for some hours against plans made by hand, in one flow and in more."""
    case = vegglue.load_case(config).model_copy(update={"observations": (), "planned": Planned(hours=hours)})
    began = time.process_time()
    plan = plan_measurements(CaseRun(case).model)
    seconds = time.process_time() - began
    print(f"proposed: {counted(case, plan)} testable in {plan.hours:.1f} h ({seconds:.1f} s of CPU)", flush=True)
    for beside in (False, True):
        shown = []
        for planned in made_by_hand(case, hours, beside):
            with_plan = case.model_copy(update={"planned": planned})
            plan = plan_measurements(CaseRun(with_plan).model)
            flows = len({one.experiment for one in plan.pieces})
            shown.append(
                f"{counted(case, plan)} with {len(planned.transects)} transects in {flows} flows, {plan.hours:.1f} h"
            )
        print(f"{'beside the plants' if beside else 'equally spaced'}: {'; '.join(shown)}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("config", type=Path)
    parser.add_argument("--sets", type=int, default=60)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--folder", type=Path, default=ROOT / "data/plan")
    parser.add_argument("--compare", type=float, help="hours: compare a proposed plan with plans made by hand instead")
    given = parser.parse_args()
    if given.compare is not None:
        compare(given.config, given.compare)
        return
    case = vegglue.load_case(given.config)
    path = given.folder / f"{case.name}.jsonl"
    path.parent.mkdir(parents=True, exist_ok=True)
    records = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    done = {one["set"] for one in records}
    began = time.monotonic()
    plan = plan_measurements(CaseRun(case).model) if len(done) < given.sets else None
    for number in range(given.sets):
        if number in done or plan is None or time.monotonic() - began > 60.0 * given.minutes:
            continue
        records.append(one_set(given.config, plan, number))
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(plain(records[-1]), allow_nan=False) + "\n")
    print(figures(records))


if __name__ == "__main__":
    main()
