"""Is what `vegglue plan` calls detectable found? `python tests/studies/plan.py channel --solver second --sets 60`,
and with `--compare 24` a proposed plan against plans made by hand.

Sites: `channel`, a short piece of the paper's channel; `reach`, a natural reach (see natural.py); `flume`, the sample
in data/samples; or a config. The plan of its stations states for each listed effect the size that is named with 90 %,
and the chance that a plausible size is. Twins hide testable effects at that size, and effects that are hidden to the
plan at a plausible size, each with parameters, shapes, errors and a sign of its own. The truth is that of the built-in
engine on finer cells, or of the second solver (not in the flume). Each is calibrated and diagnosed by the functions of
`diagnose` up to what is accepted first; an effect counts as named if it is among the effects of that step. Records are
appended to data/plan/SITE-SOLVER.jsonl, and a set that is there is not made again.
"""

import argparse
import itertools
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.stats
import yaml
from blind_sets import model_of
from blind_truth import CELLS, KNOWN_TO_THE_FLOW, SENSORS, SETTLED, flows_of, perfect_site, true_values
from natural import FLOWS, HELD_OUT, LISTED, HiddenThing, drawn_reach, flow_of, read, write_folder

import vegglue
from vegglue.arrays import Array
from vegglue.calibration.baseline import baseline
from vegglue.calibration.residual_screening import screen
from vegglue.case.parameter_space import theta_at
from vegglue.case.schema import Case, Planned, PlannedGauge, PlannedTransect
from vegglue.case.zones import corners_of
from vegglue.decision_constants import constants
from vegglue.diagnosis.competition import hypotheses_of
from vegglue.diagnosis.diagnose import best_branch
from vegglue.diagnosis.plan import needed_evidence, plan_measurements, planned_effects, shown_by
from vegglue.diagnosis.plan_model import place_along, plan_model, planned_pieces, possible_pieces, with_chosen
from vegglue.diagnosis.plan_search import plan_search
from vegglue.diagnosis.search_state import SearchState, Undecided, with_alarm
from vegglue.engine.interface import Model
from vegglue.errors import InputError
from vegglue.plain_json import plain
from vegglue.progress import silent
from vegglue.results.plan import EffectsInGeneral, FieldPlan, PlannedEffect, PlannedPiece, Work, hours_of
from vegglue.workflow.case_run import CaseRun
from vegglue.workflow.hidden_effect import candidate_of, measured_twin, true_place, twin_base

ROOT = Path(__file__).parents[2]
# Of three sets, two hide what is said to be detected and one what is said to be hidden.
HIDDEN_EVERY = 3
# The reach of natural.py that is planned, stated exactly.
REACH = 2
# Of the hidden cause by its name and numbers, and the number of the set: what is measured at all stations.
Truth = Callable[[str, Mapping[str, float], int], Array]


def site_of(name: str, runs: Path) -> tuple[Model, Truth | None, frozenset[str] | None]:
    """The model of a site with its stations, its truth by the second solver, and which effects that has."""
    if name == "channel":
        model = model_of("twin")
        by_flow = frozenset(KNOWN_TO_THE_FLOW) | {"inflow_skew", "inflow_core", "inflow_peak", "lateral_inflow"}
        return model, lambda *given: _in_channel(model, *given), by_flow | {*SENSORS, "discharge_error",
                                                                            "outlet_level_error"}  # fmt: skip
    if name == "reach":
        folder, site = runs / "reach", drawn_reach(REACH)
        known = {one: flow_of(site, HiddenThing(), one, None) for one in FLOWS if one != HELD_OUT}
        write_folder(folder, REACH, site, HiddenThing(), known)
        (folder / "holdout.csv").unlink()  # nothing is held out
        about = yaml.safe_load((folder / "site.yaml").read_text())
        (folder / "site.yaml").write_text(yaml.safe_dump({key: about[key] for key in about if key != "holdout"}))
        case = vegglue.import_folder(folder, folder.with_suffix(".yaml"), force=True)
        model = CaseRun(case).model

        def in_reach(effect: str, numbers: Mapping[str, float], number: int) -> Array:
            hidden = HiddenThing(effect, next(iter(numbers.values())))
            station, value = model.station, np.full(len(model.station), np.nan)
            for one in known:
                own = effect.startswith("probe_gain")
                flow = known[one] if own else flow_of(site, hidden, one, known[one])
                rows = model.rows[one]
                x, y = (station[key].to_numpy(float)[rows] for key in ("x", "y"))
                level = (station["kind"].to_numpy()[rows]) == "level"
                u = read(flow.u, x, y) * np.where(
                    own & (station["section"].astype(str).to_numpy()[rows] == effect[11:-1]),
                    1.0 + hidden.amplitude,
                    1.0,
                )
                value[rows] = np.where(level, read(flow.h + site.z[1::2, 1::2], x, y), u)
            return value

        return model, in_reach, frozenset(LISTED)
    if name == "flume":
        case = vegglue.import_folder(ROOT / "data/samples/flume", runs / "flume.yaml", force=True)
        return CaseRun(case).model, None, None
    return CaseRun(vegglue.load_case(Path(name))).model, None, None


def _in_channel(model: Model, effect: str, numbers: Mapping[str, float], number: int) -> Array:
    theta = {key: float(one[0]) for key, one in theta_at(model.case, true_place(len(model.names), number)).items()}
    site = perfect_site(model.case, "twin", theta, len(model.station))
    starts = flows_of(site, model.case, "twin")
    return true_values(site, model.case, "twin", model.station, {effect: numbers}, CELLS["twin"], SETTLED, starts)


def one_set(model: Model, plan: FieldPlan, number: int, truth: Truth | None, possible: frozenset[str] | None) -> Any:
    """The record of one twin, or why it cannot be made."""

    def made(effects: tuple[PlannedEffect, ...]) -> list[PlannedEffect]:
        return [one for one in effects
                if truth is None or possible is None or {one.name, one.name.partition("[")[0]} & possible]  # fmt: skip

    hidden, testable = made(tuple(one for one in plan.effects if one.hidden)), made(plan.testable)
    said_hidden = number % HIDDEN_EVERY == HIDDEN_EVERY - 1 and bool(hidden)
    random = np.random.default_rng((number, 63))
    of = hidden if said_hidden else testable
    effect = of[int(random.integers(len(of)))]
    size = min(effect.plausible, effect.furthest) if said_hidden else effect.smallest
    candidate = candidate_of(model, effect.name)
    amplitude = candidate.amplitude
    signs = [sign for sign in (1.0, -1.0) if amplitude.low <= amplitude.off + sign * size <= amplitude.high]
    value = amplitude.off + float(random.choice(signs)) * size
    began = time.process_time()
    record = {
        "set": number, "effect": effect.name, "amplitude": value, "said": "hidden" if said_hidden else "detected",
        "said_of_it": {key: asdict(effect)[key] for key in ("smallest", "plausible", "chance_plausible")},
    }  # fmt: skip
    try:
        if truth is None:
            base = twin_base(model, true_place(len(model.names), number + 1))
            station, _ = measured_twin(base, [f"{effect.name}={value!r}"], 6.0, "white", number + 1)
        else:
            shapes = {
                one.name: float(random.uniform(min(one.grid), max(one.grid))) if one.grid else one.default
                for one in candidate.effect.shapes
            } | dict(candidate.fixed)
            values = truth(effect.name, {amplitude.name: value, **shapes}, number + 1)
            error = model.station["standard_error"].to_numpy(float)
            station = model.station.assign(value=values + error * random.standard_normal(len(values)))
        found, took = first_step(replace(model, station=station)), time.process_time()
    except (InputError, RuntimeError) as error:
        return record | {"failed": str(error)}
    similar = [other.name for other in effect.confused if other.cosine > constants().alike_cosine]
    rivals = [name for step in found.steps for name in step.rivals]
    return record | {
        "alarm": found.alarmed, "named": effect.name in rivals, "rivals": rivals,
        "similar_named": any(one in rivals for one in similar), "places": [one.term for one in found.places],
        "instruments": [one.kind for one in found.instruments], "undecided": found.undecided is not None,
        "seconds": round(took - began, 1),
    }  # fmt: skip


def first_step(model: Model) -> SearchState:
    """What a diagnosis accepts first; `alarmed` as before it."""
    screening = screen(baseline(model))
    found = with_alarm(screening, SearchState())
    if not found.alarmed:
        return found
    branch = best_branch(screening, hypotheses_of(screening, silent), found, silent)
    return replace(found, undecided=branch) if isinstance(branch, Undecided) else branch.found


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


Place = tuple[Work, str, float, tuple[float, ...]]


def place_of(piece: PlannedPiece) -> Place:
    return piece.work, piece.experiment, piece.x, piece.y


def made_by_hand(case: Case, model: Model, spacing: float, hours: float) -> dict[str, list[PlannedPiece]]:
    """Transects equally spaced along the reach, or in the middle of the patches, with a gauge at each, in the highest
    flow, the two highest and so on: all that fit the hours.
    """
    low, high = case.grid.x
    ends = [corners_of(case, patch)[:, 0] for patch in case.plants.patches]
    middles = [0.5 * (one.min() + one.max()) for one in ends]
    found, names = {}, list(case.experiments)
    for flows, count in itertools.product(range(1, len(names) + 1), range(1, 30)):
        for beside in (False, True)[: 1 + (count <= len(middles))]:
            where = middles[:count] if beside else np.linspace(low, high, count + 2)[1:-1]
            x, experiments = [place_along(case, float(one)) for one in where], tuple(names[-flows:])
            transects = tuple(PlannedTransect(x=one, spacing=spacing, experiments=experiments) for one in x)
            gauges = tuple(PlannedGauge(x=one, experiments=experiments) for one in x)
            pieces = planned_pieces(model, Planned(transects=transects, gauges=gauges))
            if hours_of(pieces, Planned().costs.discharge) <= hours:
                name = f"{'at patches' if beside else 'equally spaced'}, {count} transects in {flows} flows"
                found[name] = pieces
    return found


def compare(config: Path, hours: float) -> None:
    """Print plans made by hand that fit some hours, with as dense verticals as the proposed ones, and what is proposed
    for the hours of the best of them and for 0.7 of these: testable effects, without those of sections and devices.
    """
    planned = Planned(hours=hours)
    case = vegglue.load_case(config).model_copy(update={"observations": (), "planned": planned})
    model = CaseRun(case).model
    at_hand = model.station.iloc[:0]
    possible = possible_pieces(model, planned, at_hand, [])
    across = max((one.y for one in possible if one.work is Work.TRANSECT), key=len)
    by_hand = made_by_hand(case, model, float(np.diff(across).min()), hours)
    there = {place_of(one) for one in possible}
    further = {place_of(one): replace(one, new=True) for pieces in by_hand.values() for one in pieces}
    # As of a flow that cannot be ordered: the search does not take them.
    others = [one for place, one in further.items() if place not in there]
    wide = plan_model(model, planned, at_hand, [], [*possible, *others])
    index = {place_of(one): j for j, one in enumerate(wide.pieces)}
    general = [one.name for one in wide.candidates if not (one.sections or one.devices)]

    def counted(chosen: list[int]) -> tuple[int, float]:
        chosen_ones = with_chosen(wide, chosen)
        effects = [one for one in planned_effects(chosen_ones, shown_by(chosen_ones)) if one.name in general]
        return sum(one.testable for one in effects), hours_of([wide.pieces[j] for j in chosen], planned.costs.discharge)

    best = (0, 0.0)
    for name, pieces in by_hand.items():
        found = counted([index[place_of(one)] for one in pieces])
        best = max(best, found, key=lambda one: (one[0], -one[1]))
        print(f"{name}: {found[0]} of {len(general)} testable in {found[1]:.1f} h", flush=True)
    search = plan_search(wide, EffectsInGeneral(len(general)), planned, needed_evidence(), frozenset(),
                         np.zeros(len(wide.candidates)))  # fmt: skip
    for budget in (best[1], 0.7 * best[1]):
        began = time.process_time()
        chosen = search.best_set(budget)
        seconds = time.process_time() - began
        number, spent = counted(chosen)
        print(f"proposed: {number} testable in {spent:.1f} h ({seconds:.1f} s of CPU for the search)", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("site", help="channel, reach, flume, or a config")
    parser.add_argument("--solver", choices=("own", "second"), default="own")
    parser.add_argument("--sets", type=int, default=60)
    parser.add_argument("--first", type=int, default=0, help="number of the first set")
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--folder", type=Path, default=ROOT / "data/plan")
    parser.add_argument("--runs", type=Path, default=ROOT / "runs/plan")
    parser.add_argument("--figures", action="store_true")
    parser.add_argument(
        "--compare", type=float, help="hours: compare a config's proposed plans with plans made by hand instead"
    )
    given = parser.parse_args()
    began = time.monotonic()
    if given.compare is not None:
        compare(Path(given.site), given.compare)
        return
    path = given.folder / f"{Path(given.site).stem}-{given.solver}.jsonl"
    path.parent.mkdir(parents=True, exist_ok=True)
    records = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    wanted, made = range(given.first, given.first + given.sets), {one["set"] for one in records}
    left = [number for number in wanted if number not in made]
    if left and not given.figures:
        given.runs.mkdir(parents=True, exist_ok=True)
        model, truth, possible = site_of(given.site, given.runs)
        if given.solver == "second" and truth is None:
            parser.error(f"{given.site}: the second solver has no truth of it.")
        plan = plan_measurements(model)
        for number in left:
            if time.monotonic() - began > 60.0 * given.minutes:
                break
            records.append(one_set(model, plan, number, truth if given.solver == "second" else None, possible))
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(plain(records[-1]), allow_nan=False) + "\n")
    print(figures(records))


if __name__ == "__main__":
    main()
