"""The shell of the loop: import, diagnose, discover, extend, compare, next; and overview, of several runs."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import vegglue
from vegglue.cli.doubts import opened_run, opened_runs
from vegglue.cli.hearing import heard
from vegglue.cli.options import FLAG, RUNS, Cluster, Config, Force, Jobs, Json, Quiet, Runs, Trust, number_given
from vegglue.cli.output import command_line, print_object
from vegglue.cli.telling import tell
from vegglue.errors import InputError, shown_path
from vegglue.wording.numbers import so_many

if TYPE_CHECKING:
    from vegglue.results.diagnosis import Diagnosis


def import_command(
    folder: Annotated[
        Path, typer.Argument(help="Folder with site.json or site.yaml and what was measured; or a known set.")
    ],
    to: Annotated[
        Path | None, typer.Option(help="Config to write; configs/<folder>.yaml or <folder>.yaml if not given.")
    ] = None,
    as_object: Json = False,
    quiet: Quiet = False,
    force: Force = False,
) -> None:
    """Make a case of a folder of measurements, with wide priors; `vegglue run` then needs no edit by hand.

    Tables may have any separator, units and names of columns: one line says what was taken from each.

    The confluence set of R.B. Canelas makes two, one with the bed surveyed and one with a plane instead.
    """
    case = vegglue.import_folder(folder, to, force=force)
    target = shown_path(case.source)
    patches = [patch.name for patch in case.plants.patches]
    imported = [one.model_dump() for one in case.imported or ()]
    from vegglue.workflow.import_folder import assumptions_of, unnamed_banks, without_errors

    assumed, unstated = [*assumptions_of(folder), *unnamed_banks(case)], without_errors(case)
    for sentence in unstated:
        print(sentence, file=sys.stderr)
    if as_object:
        names = {"experiments": list(case.experiments), "patches": patches, "parameters": list(case.parameters)}
        print_object({"config": target, "case": case.name, **names, "imported": imported, "assumed": assumed})
        return
    if not quiet:
        for sentence in [*(f"{one.name}: {one.taken}." for one in case.imported or ()), *assumed]:
            print(sentence)
    print(
        f"{target}: {so_many(len(case.experiments), 'experiment')}, {so_many(len(patches), 'patch', 'patches')}, "
        f"{so_many(len(case.parameters), 'parameter')} with wide priors."
    )
    if not quiet:
        print(f"Next: {command_line('check', target)}, then {command_line('run', target)}")


def diagnose_command(
    config: Config,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Say where the model fails, which effect is missing, and how sure that is."""
    opened = opened_run(config, trust)
    with heard(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        found = vegglue.diagnose(opened.with_settings(runs, jobs, watch))
    tell(opened.case, runs, found, as_object)
    if not (quiet or as_object):
        print(f"Next: {_after(found, config, runs, trust)}")


def _after(found: "Diagnosis", config: Path, runs: Path, trust: bool) -> str:
    """The command that goes on from a diagnosis, or what is to be done before."""
    if found.verdict.doubts_the_data:
        return f"mend these measurements; {command_line('check', config)} says all that is odd"
    found_something = ("extend", config, "--auto") if found.steps or found.places else ("next", config)
    following = ("discover", config) if found.verdict.tells_laws else found_something
    return command_line(*following, runs=runs, trust=trust)


def discover_command(
    config: Config,
    without: Annotated[
        list[str] | None, typer.Option(help="Listed effect that is left out of the competition, e.g. bank_trend.")
    ] = None,
    to: Annotated[Path | None, typer.Option(help="Config to write, beside the parent if not given.")] = None,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    force: Force = False,
) -> None:
    """Say which law, in no list, explains the misfit; write it as an effect file and a child config."""
    opened = opened_run(config, trust)
    with heard(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        found = vegglue.discover(opened.with_settings(runs, jobs, watch, force), without=without or [], to=to)
    tell(opened.case, runs, found, as_object)


def extend_command(
    config: Config,
    add: Annotated[
        list[str] | None, typer.Option(help=r"Effect to add, e.g. streamlining or discharge_error\[high].")
    ] = None,
    shape: Annotated[list[str] | None, typer.Option(help="Value of a shape of it, NAME=NUMBER.")] = None,
    auto: Annotated[
        bool, typer.Option("--auto", metavar=FLAG, help="Add what the diagnosis finds, while held-out errors fall.")
    ] = False,
    to: Annotated[Path | None, typer.Option(help="Config to write, beside the parent if not given.")] = None,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    force: Force = False,
) -> None:
    """Write a child config that extends its parent by one effect or more."""
    shapes = dict(number_given(text) for text in shape or [])
    if auto == bool(add):
        got = "both" if add else "neither"
        raise InputError(f"extend: expected either --auto or --add EFFECT, got {got}; give one.")
    if auto and (to is not None or shape):
        given = "--to" if to is not None else "--shape"
        raise InputError(f"extend: expected {given} with --add only, got it with --auto, which finds its own; drop it.")
    if auto:
        opened = opened_run(config, trust)
        with heard(quiet, as_object) as watch, vegglue.on_cluster(cluster):
            extension = vegglue.extend_stepwise(opened.with_settings(runs, jobs, watch, force))
        tell(opened.case, runs, extension, as_object)
        return
    child = vegglue.extend(vegglue.load_case(config, trust), add or [], shapes=shapes, to=to, force=force, runs=runs)
    target = shown_path(child.source)
    if as_object:
        print_object({"config": target, "case": child.name, "added": add})
        return
    print(f"{target}: {child.name}.")
    if not quiet:
        commands = (("run", target), ("compare", config, target))
        print(f"Next: {', or '.join(command_line(*one, runs=runs, trust=trust) for one in commands)}")


def compare_command(
    configs: Annotated[list[Path], typer.Argument(help="Cases, the baseline first.", show_default=False)],
    jobs: Jobs = -1,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Set models side by side: their errors on what they have seen, on what was held out, and what each step cost."""
    opened = opened_runs(configs, trust)
    with heard(quiet, as_object) as watch:
        found = vegglue.compare([one.with_settings(runs, jobs, watch) for one in opened])
    tell(opened[-1].case, runs, found, as_object)


def overview_command(
    configs: Annotated[list[Path], typer.Argument(help="Cases with a posterior, the best first.", show_default=False)],
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Make one page of several runs: their answers, parameters side by side, and the way to each report."""
    cases = [vegglue.load_case(config, trust) for config in configs]
    with heard(quiet, as_object) as watch:
        page = vegglue.overview(cases, runs=runs, trust=trust, watch=watch)
    tell(cases[0], runs, page, as_object)


def next_command(
    config: Config,
    between: Annotated[list[str] | None, typer.Option(help="Effects to tell apart, else those left over.")] = None,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Say which measurement would tell the remaining rivals apart, by gain per hour of field work."""
    opened = opened_run(config, trust)
    with heard(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        found = vegglue.next_measurement(opened.with_settings(runs, jobs, watch), between=between or [])
    tell(opened.case, runs, found, as_object)
