"""The shell of the loop: plan, import, diagnose, discover, extend, compare, next; and overview, of several runs."""

import sys
from pathlib import Path
from typing import Annotated

import typer

import vegglue
from vegglue.cli.reporting import print_result, progress_reporter
from vegglue.cli.terminal import (
    FLAG,
    RUNS,
    Cluster,
    Config,
    Force,
    Jobs,
    Json,
    MemoryLimit,
    Quiet,
    Runs,
    Trust,
    command_line,
    number_given,
    opened_run,
    opened_runs,
    print_object,
)
from vegglue.errors import InputError, shown_path
from vegglue.wording.commands import HELP
from vegglue.wording.numbers import so_many
from vegglue.wording.sentences import phrase


def import_command(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help=HELP["import.folder"])],
    to: Annotated[Path | None, typer.Option(metavar="CONFIG", help=HELP["import.to"])] = None,
    as_object: Json = False,
    quiet: Quiet = False,
    force: Force = False,
) -> None:
    """Make a case from a folder of measurements, with wide priors, ready for `vegglue run`.

    Tables may have any separator, units and names of columns; for each file one line reports what was read.

    The confluence data set of R.B. Canelas makes two cases, with the surveyed bed and with a plane bed.
    """
    case = vegglue.import_folder(folder, to, force=force)
    target = shown_path(case.source)
    patches = [patch.name for patch in case.plants.patches]
    imported = [one.model_dump() for one in case.imported or ()]
    from vegglue.workflow.import_folder import assumptions_of, errors_of_site, unnamed_banks, without_errors

    assumed, unstated = [*assumptions_of(folder), *errors_of_site(case), *unnamed_banks(case)], without_errors(case)
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
    details: Annotated[bool, typer.Option("--details", metavar=FLAG, help=HELP["diagnose.details"])] = False,
    jobs: Jobs = -1,
    memory: MemoryLimit = None,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Find the cause of the misfit: a missing effect, a local anomaly or a faulty instrument."""
    opened = opened_run(config, trust)
    with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        found = vegglue.diagnose(opened.with_settings(runs, jobs, watch, memory=memory))
    more = command_line("diagnose", config, "--details", runs=runs, trust=trust)
    print_result(opened.case, runs, found, as_object, details, more)
    if quiet or as_object:
        return
    if found.verdict.doubts_the_data:
        print(phrase("next_measurements", command_line("check", config)))
        return
    following = ("extend", config, "--auto") if found.steps or found.places else ("next", config)
    if found.verdict.tells_laws:
        following = ("discover", config)
    print(phrase("next_commands", [command_line(*following, runs=runs, trust=trust)]))


def discover_command(
    config: Config,
    without: Annotated[list[str] | None, typer.Option(metavar="EFFECT", help=HELP["discover.without"])] = None,
    to: Annotated[Path | None, typer.Option(metavar="CONFIG", help=HELP["discover.to"])] = None,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    force: Force = False,
) -> None:
    """Find an unlisted law that explains the misfit; write it as an effect file and a child config."""
    opened = opened_run(config, trust)
    with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        found = vegglue.discover(opened.with_settings(runs, jobs, watch, force), without=without or [], to=to)
    print_result(opened.case, runs, found, as_object)


def extend_command(
    config: Config,
    add: Annotated[list[str] | None, typer.Option(metavar="EFFECT", help=HELP["extend.add"])] = None,
    shape: Annotated[list[str] | None, typer.Option(metavar="NAME=NUMBER", help=HELP["extend.shape"])] = None,
    auto: Annotated[bool, typer.Option("--auto", metavar=FLAG, help=HELP["extend.auto"])] = False,
    to: Annotated[Path | None, typer.Option(metavar="CONFIG", help=HELP["discover.to"])] = None,
    jobs: Jobs = -1,
    memory: MemoryLimit = None,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    force: Force = False,
) -> None:
    """Write a child config with one or more further effects."""
    shapes = dict(number_given(text) for text in shape or [])
    if auto == bool(add):
        got = "both" if add else "neither"
        raise InputError(f"extend: expected either --auto or --add EFFECT, got {got}; give one.")
    if auto and (to is not None or shape):
        given = "--to" if to is not None else "--shape"
        raise InputError(f"extend: expected {given} with --add only, got it with --auto, which finds its own; drop it.")
    if auto:
        opened = opened_run(config, trust)
        with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
            extension = vegglue.extend_stepwise(opened.with_settings(runs, jobs, watch, force, memory))
        print_result(opened.case, runs, extension, as_object)
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
    configs: Annotated[list[Path], typer.Argument(metavar="CONFIG", help=HELP["compare.configs"], show_default=False)],
    jobs: Jobs = -1,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Compare the errors of models at calibration data and at held-out data."""
    opened = opened_runs(configs, trust)
    with progress_reporter(quiet, as_object) as watch:
        found = vegglue.compare([one.with_settings(runs, jobs, watch) for one in opened])
    print_result(opened[-1].case, runs, found, as_object)


def overview_command(
    configs: Annotated[list[Path], typer.Argument(metavar="CONFIG", help=HELP["overview.configs"], show_default=False)],
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Make one page of several runs: verdicts, parameters side by side, and links to the reports."""
    cases = [vegglue.load_case(config, trust) for config in configs]
    with progress_reporter(quiet, as_object) as watch:
        page = vegglue.overview(cases, runs=runs, trust=trust, watch=watch)
    print_result(cases[0], runs, page, as_object)


def next_command(
    config: Config,
    between: Annotated[list[str] | None, typer.Option(metavar="EFFECT", help=HELP["next.between"])] = None,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Propose measurements that distinguish the remaining hypotheses, by gain per hour of field work."""
    opened = opened_run(config, trust)
    with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        found = vegglue.next_measurement(opened.with_settings(runs, jobs, watch), between=between or [])
    print_result(opened.case, runs, found, as_object)


def plan_command(
    config: Config,
    about: Annotated[str, typer.Option(metavar="EFFECT", help=HELP["plan.about"])] = "",
    size: Annotated[float | None, typer.Option(metavar="NUMBER", help=HELP["plan.size"])] = None,
    between: Annotated[tuple[str, str] | None, typer.Option(metavar="EFFECT EFFECT", help=HELP["plan.between"])] = None,
    hours: Annotated[float | None, typer.Option(metavar="HOURS", help=HELP["plan.hours"])] = None,
    details: Annotated[bool, typer.Option("--details", metavar=FLAG, help=HELP["plan.details"])] = False,
    jobs: Jobs = -1,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Report what planned measurements would show, and which to add; write a page for the field."""
    opened = opened_run(config, trust)
    with progress_reporter(quiet, as_object) as watch:
        settings = opened.with_settings(runs, jobs, watch)
        found = vegglue.plan(settings, about=about, size=size, between=between or (), hours=hours)
    print_result(opened.case, runs, found, as_object, details, command_line("plan", config, "--details", runs=runs))
