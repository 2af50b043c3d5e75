"""The shell of the loop: import, diagnose, extend, compare, next, run. What they do stands in `loop`."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.table import Table

from vegglue.case.config import load_case
from vegglue.case.resolved_config import as_yaml
from vegglue.case.schema import Case
from vegglue.case.text_files import write_text
from vegglue.cli.options import Config, Jobs, Json, Runs, Trust, console, number_given, say_on
from vegglue.diagnosis.comparison import Rung, held_out_rmse, improvement, rung_json
from vegglue.diagnosis.excluded_stations import exclusion_in_words
from vegglue.diagnosis.next_measurement import SEPARATES, MeasurementWorth
from vegglue.errors import InputError
from vegglue.figures.error_ladder import save_ladder_figure
from vegglue.importers.confluence import case_from_confluence, flat_bed, holds_confluence
from vegglue.importers.field_folder import case_from_folder
from vegglue.measurements.kinds import KINDS, STREAMWISE, WATER_LEVEL, Kind
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.diagnosis_json import diagnosis_json
from vegglue.workflow.loop import (
    child_path,
    diagnosed,
    grow,
    ladder_of,
    left_out,
    named_candidates,
    next_measurements,
    write_child,
)
from vegglue.workflow.run_folder import folder_of


def import_command(
    folder: Annotated[Path, typer.Argument(help="Folder with site.json, velocities.csv, levels.csv; or a known set.")],
    to: Annotated[
        Path | None, typer.Option(help="Config to write; configs/<folder>.yaml or <folder>.yaml if not given.")
    ] = None,
) -> None:
    """Make a case of a folder of measurements, with wide priors; `vegglue run` then needs no edit by hand.

    The confluence set of R.B. Canelas makes two, one with the bed surveyed and one with a plane instead.
    """
    target = to or _default_target(folder)
    if holds_confluence(folder):
        _write_config(target, folder, case_from_confluence(folder, target))
        _write_config(target.with_stem(f"{target.stem}-flat"), folder, flat_bed(folder, target))
    else:
        _write_config(target, folder, case_from_folder(folder, target))
    case = load_case(target)
    console.print(
        f"{target}: {len(case.experiments)} experiment(s), {len(case.plants.patches)} patches, "
        f"{len(case.parameters)} parameters with wide priors. Next: vegglue run {target}"
    )


def diagnose_command(
    config: Config, jobs: Jobs = -1, runs: Runs = Path("runs"), as_object: Json = False, trust: Trust = False
) -> None:
    """Say where the model fails, which effect is missing, and how sure that is."""
    case = load_case(config, trust)
    found = diagnosed(case, folder_of(runs, case), jobs, say_on(as_object))
    if as_object:
        print(json.dumps(diagnosis_json(found), ensure_ascii=False))
        return
    _tell(found)
    folder = folder_of(runs, case)
    console.print(f"Written to {folder / 'diagnosis.h5'}, drawn in {folder / 'diagnosis.png'}.")


def extend_command(
    config: Config,
    add: Annotated[
        list[str] | None, typer.Option(help="Effect to add, e.g. streamlining or discharge_error[high].")
    ] = None,
    shape: Annotated[list[str] | None, typer.Option(help="Value of a shape of it, NAME=NUMBER.")] = None,
    auto: Annotated[bool, typer.Option("--auto", help="Add what the diagnosis accepts, step by step.")] = False,
    to: Annotated[Path | None, typer.Option(help="Config to write, beside the parent if not given.")] = None,
    jobs: Jobs = -1,
    runs: Runs = Path("runs"),
    trust: Trust = False,
) -> None:
    """Write a child config that extends its parent by one effect or more."""
    case = load_case(config, trust)
    if auto == bool(add):
        raise InputError("extend: expected either --auto or --add EFFECT, got both or neither; choose one.")
    if auto:
        grown = grow(case, runs, jobs, say_on())
        _show_ladder(grown.rungs, exclusion_in_words(grown.aside))
        console.print(grown.reason)
        console.print(f"Last config: {grown.paths[-1]}")
        return
    added = named_candidates(case, add or [], dict(number_given(text) for text in shape or []))
    target = to or child_path(config, [one for one, _ in added])
    child = write_child(case, target, added)
    console.print(f"{target}: {child.name}. Next: vegglue run {target}, or vegglue compare {config} {target}")


def compare_command(
    configs: Annotated[list[Path], typer.Argument(help="Cases, the baseline first.", show_default=False)],
    runs: Runs = Path("runs"),
    as_object: Json = False,
    trust: Trust = False,
) -> None:
    """Set models side by side: their errors on what they have seen, on what was held out, and what each step cost."""
    cases = [load_case(config, trust) for config in configs]
    aside = left_out(cases, runs)
    rungs = ladder_of(cases, runs, aside, say_on(as_object))
    picture = folder_of(runs, cases[-1]) / "ladder.png"
    save_ladder_figure(rungs, picture)
    if as_object:
        told = {"rungs": [rung_json(one) for one in rungs], "left_out": aside.to_dict("records")}
        print(json.dumps(told, ensure_ascii=False))
        return
    _show_ladder(rungs, exclusion_in_words(aside))
    console.print(f"Drawn in {picture}")


def next_command(
    config: Config,
    between: Annotated[list[str] | None, typer.Option(help="Effects to tell apart, else those left over.")] = None,
    jobs: Jobs = -1,
    runs: Runs = Path("runs"),
    as_object: Json = False,
    trust: Trust = False,
) -> None:
    """Say which measurement would tell the remaining rivals apart, by gain per hour of field work."""
    case = load_case(config, trust)
    found = next_measurements(case, folder_of(runs, case), jobs, say_on(as_object), between or [])
    if as_object:
        print(json.dumps({"questions": [_question_json(*one) for one in found]}, ensure_ascii=False))
        return
    _show_next(found)


def loop(case: Case, runs: Path, jobs: int) -> Path:
    """Diagnose, add what is missing, watch the error fall, say what to measure next; the last config."""
    folder = folder_of(runs, case)
    _tell(diagnosed(case, folder, jobs, say_on()))
    grown = grow(case, runs, jobs, say_on())
    _show_ladder(grown.rungs, exclusion_in_words(grown.aside))
    _show_next(next_measurements(case, folder, jobs, say_on(), []))
    picture = folder_of(runs, load_case(grown.paths[-1], trust=True)) / "ladder.png"  # the case was trusted
    save_ladder_figure(grown.rungs, picture)
    console.print(f"Ladder drawn in {picture}; last config: {grown.paths[-1]}")
    return grown.paths[-1]


LOOP_COMMANDS: tuple[tuple[str, Callable[..., None]], ...] = (
    ("import", import_command),
    ("diagnose", diagnose_command),
    ("extend", extend_command),
    ("compare", compare_command),
    ("next", next_command),
)


def _write_config(path: Path, folder: Path, tree: dict[str, Any]) -> None:
    text = f"# Made by `vegglue import` from {folder.name}.\n" + as_yaml(tree)
    write_text(path, text, "give another file by --to")


def _default_target(folder: Path) -> Path:
    name = f"{folder.resolve().name}.yaml"
    return Path("configs") / name if Path("configs").is_dir() else Path(name)


def _tell(found: Diagnosis) -> None:
    console.print(found.verdict.kind, style="bold", end=": ")
    console.print(found.verdict.sentence)
    for remark in found.verdict.remarks:
        console.print(f"- {remark}")
    table = Table(box=None, pad_edge=False, header_style="bold")
    headings = "effect", "chance", "amplitude", "95 % interval", "score", "p (family)", "visible", "detectable from"
    for heading in headings:
        table.add_column(heading, justify="left" if heading == "effect" else "right")
    for one in found.suspects[:10]:
        share = f"{found.chances[one.name]:.0%}" if one.name in found.chances else ""
        amplitude, test, detectability = one.amplitude, one.test, one.detectability
        low, high = amplitude.interval95
        p_family = f"< {test.p_family:.1g}" if test.p_family < 5e-4 else f"{test.p_family:.2g}"
        unit = amplitude.unit.removesuffix("-")
        table.add_row(
            one.name, share, f"{amplitude.value:.3g} {unit}".strip(), f"{low:.3g} .. {high:.3g}", f"{test.score:+.1f}",
            p_family, f"{detectability.visibility:.2f}", f"{detectability.smallest:.2g}",
        )  # fmt: skip
    console.print(table)
    for row in found.errors.flagged:
        station = found.predictions.station.iloc[row]
        place = f"{station['experiment']} {station['section']} x = {station['x']:g}, y = {station['y']:g} m"
        console.print(f"- set aside: {place}, measured {station['value']:g}")


def _show_ladder(rungs: Sequence[Rung], note: str) -> None:
    table = Table(box=None, pad_edge=False, header_style="bold")
    others = _other_kinds(rungs)
    headings = ("model", "parameters", "RMSE", "levels", *(f"{kind.words} [{kind.unit}]" for kind in others),
                "chi2 / n", "held out (section)", "fell by", "held out (exp.)", "log score", "in 50 %", "in 95 %",
                "validation")  # fmt: skip
    for heading in headings:
        table.add_column(heading, justify="left" if heading == "model" else "right")
    for before, one in zip([None, *rungs[:-1]], rungs, strict=True):
        gain = "" if before is None else "{:.2g} ± {:.1g}".format(*(1e6 * part for part in improvement(before, one)))
        seen, scores = one.in_sample, one.predictive
        table.add_row(
            one.name, str(len(one.values)), f"{seen.rmse[STREAMWISE]:.4f}", f"{seen.rmse[WATER_LEVEL]:.4f}",
            *(f"{seen.rmse[kind.name]:.4f}" for kind in others), f"{seen.chi2:.0f} / {seen.stations}",
            f"{held_out_rmse(one):.4f}", gain, f"{held_out_rmse(one, 'experiments'):.4f}",
            f"{scores.log_score:.2f}", f"{scores.inside50:.0%}", f"{scores.inside95:.0%}", f"{one.validation:.4f}",
        )  # fmt: skip
    console.print(table)
    if rungs:
        console.print(
            f"Errors in m/s (levels in m), `fell by` in (mm/s)^2 of held-out squares; noise floor "
            f"{rungs[-1].in_sample.noise_floor:.4f} m/s."
        )
    if note:
        console.print(note)
    for one in rungs:
        moving = [f"{name} (p = {p:.1g})" for name, p in one.homogeneity.items() if p < 0.01]
        if moving:
            console.print(f"- {one.name}: differs between experiments: {', '.join(moving)}")


def _other_kinds(rungs: Sequence[Rung]) -> list[Kind]:
    """What was measured besides velocities along x and levels."""
    others = (kind for kind in KINDS.values() if kind.name not in (STREAMWISE, WATER_LEVEL))
    return [kind for kind in others if any(np.isfinite(one.in_sample.rmse[kind.name]) for one in rungs)]


def _show_next(found: Sequence[tuple[str, Sequence[MeasurementWorth]]]) -> None:
    if not found:
        console.print("Nothing is left to be told apart; no further measurement is proposed.")
    for what, worths in found:
        useful = [one for one in worths if one.then >= SEPARATES and one.then > 1.1 * one.now]
        if not useful:
            best = max(worths, key=lambda one: one.then, default=None)
            most = f" (D2 at most {best.then:.2g}: {best.plan.name})" if best else ""
            console.print(f"To tell {what}: none of {len(worths)} measurements would by itself{most}.")
            continue
        console.print(f"To tell {what} (D2 now {useful[0].now:.2g} squared standard errors):")
        for one in useful[:4]:
            plan = one.plan
            console.print(f"- {plan.name}: {one.then:.2g}, {plan.rows.size} station(s), {plan.hours:.1f} h")


def _question_json(what: str, worths: Sequence[MeasurementWorth]) -> dict[str, Any]:
    return {"tells_apart": what, "measurements": [_worth_json(one) for one in worths]}


def _worth_json(one: MeasurementWorth) -> dict[str, Any]:
    plan = one.plan
    return {
        "name": plan.name, "experiment": plan.experiment, "x": plan.x, "stations": int(plan.rows.size),
        "hours": plan.hours, "now": one.now, "then": one.then, "gain_per_hour": one.per_hour,
    }  # fmt: skip
