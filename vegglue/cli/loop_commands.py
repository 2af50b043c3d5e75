"""The shell of the loop: import, diagnose, extend, compare, next."""

import json
from pathlib import Path
from typing import Annotated

import typer

from vegglue.case.config import load_case
from vegglue.cli.options import Config, Jobs, Json, Runs, Trust, console, number_given, say_on
from vegglue.cli.tables import question_json, show_diagnosis, show_ladder, show_questions
from vegglue.diagnosis.comparison import rung_json
from vegglue.errors import InputError, shown_path
from vegglue.results.diagnosis_json import diagnosis_json
from vegglue.workflow.compare import compare
from vegglue.workflow.diagnose import diagnose
from vegglue.workflow.extend import extend, extend_stepwise
from vegglue.workflow.import_folder import import_folder
from vegglue.workflow.next_measurement import next_measurement


def import_command(
    folder: Annotated[Path, typer.Argument(help="Folder with site.json, velocities.csv, levels.csv; or a known set.")],
    to: Annotated[
        Path | None, typer.Option(help="Config to write; configs/<folder>.yaml or <folder>.yaml if not given.")
    ] = None,
) -> None:
    """Make a case of a folder of measurements, with wide priors; `vegglue run` then needs no edit by hand.

    The confluence set of R.B. Canelas makes two, one with the bed surveyed and one with a plane instead.
    """
    case = import_folder(folder, to)
    target = shown_path(case.source)
    console.print(
        f"{target}: {len(case.experiments)} experiment(s), {len(case.plants.patches)} patches, "
        f"{len(case.parameters)} parameters with wide priors. Next: vegglue run {target}"
    )


def diagnose_command(
    config: Config, jobs: Jobs = -1, runs: Runs = Path("runs"), as_object: Json = False, trust: Trust = False
) -> None:
    """Say where the model fails, which effect is missing, and how sure that is."""
    case = load_case(config, trust)
    found = diagnose(case, runs=runs, jobs=jobs, say=say_on(as_object))
    if as_object:
        print(json.dumps(diagnosis_json(found), ensure_ascii=False))
        return
    show_diagnosis(found)
    folder = runs / case.name
    console.print(f"Written to {folder / 'diagnosis.h5'}, drawn in {folder / 'diagnosis.png'}.")


def extend_command(
    config: Config,
    add: Annotated[
        list[str] | None, typer.Option(help="Effect to add, e.g. streamlining or discharge_error[high].")
    ] = None,
    shape: Annotated[list[str] | None, typer.Option(help="Value of a shape of it, NAME=NUMBER.")] = None,
    auto: Annotated[
        bool, typer.Option("--auto", help="Add what the diagnosis finds, while held-out errors fall.")
    ] = False,
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
        extension = extend_stepwise(case, runs=runs, jobs=jobs, say=say_on())
        show_ladder(extension.comparison)
        console.print(extension.sentence)
        console.print(extension.reason)
        console.print(f"Last config: {extension.cases[-1].source}")
        return
    child = extend(case, add or [], shapes=dict(number_given(text) for text in shape or []), to=to)
    target = shown_path(child.source)
    console.print(f"{target}: {child.name}. Next: vegglue run {target}, or vegglue compare {config} {target}")


def compare_command(
    configs: Annotated[list[Path], typer.Argument(help="Cases, the baseline first.", show_default=False)],
    jobs: Jobs = -1,
    runs: Runs = Path("runs"),
    as_object: Json = False,
    trust: Trust = False,
) -> None:
    """Set models side by side: their errors on what they have seen, on what was held out, and what each step cost."""
    cases = [load_case(config, trust) for config in configs]
    found = compare(cases, runs=runs, jobs=jobs, say=say_on(as_object))
    if as_object:
        told = {"rungs": [rung_json(one) for one in found.rungs], "left_out": found.left_out.to_dict("records")}
        print(json.dumps(told, ensure_ascii=False))
        return
    show_ladder(found)
    console.print(f"Drawn in {runs / cases[-1].name / 'ladder.png'}")


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
    found = next_measurement(case, between=between or [], runs=runs, jobs=jobs, say=say_on(as_object))
    if as_object:
        print(json.dumps({"questions": [question_json(one) for one in found]}, ensure_ascii=False))
        return
    show_questions(found)
