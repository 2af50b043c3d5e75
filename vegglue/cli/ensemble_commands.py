"""The shell of the ensemble: check, simulate, infer, report; and run and demo, which go the whole way."""

import os
import sys
import webbrowser
from pathlib import Path
from typing import Annotated, Any, Literal

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
    Members,
    MemoryLimit,
    Quiet,
    Runs,
    Trust,
    command_line,
    opened_run,
    print_doubts_of_ensemble,
    print_object,
)
from vegglue.errors import InputError, shown_path
from vegglue.wording.commands import DEMO, HELP
from vegglue.wording.sentences import phrase


def check_command(
    config: Config, runs: Runs = RUNS, as_object: Json = False, quiet: Quiet = False, trust: Trust = False
) -> None:
    """Check all files of a case, report likely errors, and draw the channel."""
    case = vegglue.load_case(config, trust)
    with progress_reporter(quiet, as_object):
        found = vegglue.check(case, runs=runs)
    print_result(case, runs, found, as_object)


def simulate_command(
    config: Config,
    members: Members = None,
    parameters: Annotated[Path | None, typer.Option(metavar="CSV", help=HELP["simulate.parameters"])] = None,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    force: Force = False,
) -> None:
    """Solve all members of the ensemble; a stopped run is continued.

    With --force, members for which the command of an `engine` failed are run again.
    """
    if members is not None and parameters is not None:
        raise InputError("simulate: expected --members or --parameters, got both; leave one out.")
    opened = opened_run(config, trust)
    from vegglue.inference.command_ensemble import refuse_useless
    from vegglue.workflow.simulate import given_folder, is_up_to_date

    if parameters is not None:
        with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
            run = opened.with_settings(runs, jobs, watch, force)
            ensemble = vegglue.simulate(run, parameters=parameters)
        folder = given_folder(run, parameters)
        print_result(opened.case.model_copy(update={"name": folder.name}), folder.parent, ensemble, as_object)
        return
    with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        run = opened.with_settings(runs, jobs, watch, force).sized(members)
        current = is_up_to_date(run)
        ensemble = vegglue.simulate(run)
    case = run.case
    if as_object:
        from vegglue.cli.objects import object_of

        print_object(object_of(case, runs, ensemble) | {"up_to_date": current})
    elif current:
        print(phrase("up_to_date", runs / case.name / "ensemble.h5"))
    else:
        print_result(case, runs, ensemble, as_object)
    refuse_useless(case, ensemble)
    print_doubts_of_ensemble(run)


def infer_command(
    config: Config,
    method: Annotated[Literal["refine", "surrogate", "glue"] | None, typer.Option(help=HELP["infer.method"])] = None,
    members: Members = None,
    jobs: Jobs = -1,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Compute the posterior of the parameters from the measurements."""
    opened = opened_run(config, trust)
    with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        run = opened.with_settings(runs, jobs, watch)
        posterior = vegglue.infer(run, method=method, members=members)
    print_doubts_of_ensemble(run)
    print_result(opened.case, runs, posterior, as_object)


def report_command(
    config: Config,
    members: Members = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Write the page and the figures of a run."""
    opened = opened_run(config, trust)
    with progress_reporter(quiet, as_object) as watch:
        run = opened.with_settings(runs, watch=watch)
        page = vegglue.report(run, members=members)
    print_doubts_of_ensemble(run)
    print_result(opened.case, runs, page, as_object)


def run_command(
    config: Config,
    members: Members = None,
    jobs: Jobs = -1,
    memory: MemoryLimit = None,
    cluster: Cluster = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    force: Force = False,
) -> None:
    """Run the whole loop: diagnose, add effects while held-out errors fall; posterior and report of the last model."""
    opened, results = opened_run(config, trust), list[tuple[Any, Any]]()

    def show(of: Any, result: Any) -> None:
        results.append((of, result))
        if not as_object:
            print_result(of, runs, result, as_object)

    with progress_reporter(quiet, as_object) as watch, vegglue.on_cluster(cluster):
        extension = vegglue.run(opened.with_settings(runs, jobs, watch, force, memory), members=members, show=show)
    if as_object:
        from vegglue.cli.objects import run_object

        print_object(run_object(runs, results))
        return
    from vegglue.cli.printed import last_of, summary_lines
    from vegglue.results.diagnosis import Diagnosis

    print("\n".join(summary_lines(extension, results)))  # what was found scrolled by, with all that was done after it
    last, found = last_of(results, Diagnosis)
    if last.name != opened.case.name and (found.steps or found.places):
        print(f"Next: {command_line('extend', shown_path(last.source), '--auto', runs=runs, trust=trust)}")


def demo_command(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help=HELP["demo.folder"])] = RUNS / "demo",
    short: Annotated[bool, typer.Option("--short", metavar=FLAG, help=HELP["demo.short"])] = False,
    no_open: Annotated[bool, typer.Option("--no-open", metavar=FLAG, help=HELP["demo.no-open"])] = False,
    jobs: Jobs = -1,
    as_object: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run the loop on synthetic measurements of the package, and open a page with the results."""
    results = list[tuple[Any, Any]]()

    def show(of: Any, result: Any) -> None:
        results.append((of, result))
        if not as_object and not quiet:
            print_result(of, folder, result, as_object)

    def begin(part: int) -> None:
        if not as_object and not quiet:
            print(DEMO[str(part)], flush=True)

    with progress_reporter(quiet, as_object) as watch:
        page = vegglue.demo(folder, short=short, jobs=jobs, watch=watch, show=show, part=begin)
    if as_object:
        from vegglue.cli.objects import run_object

        print_object(run_object(folder, results) | {"overview": page.resolve()})
        return
    print(DEMO["page"].format(page.resolve()))
    if not quiet:
        print(DEMO["copy"].format(folder))
    # Only where a person is in front of a desktop: without one, Linux would open a browser of the terminal.
    desktop = sys.platform in ("win32", "darwin") or bool(
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    )
    if desktop and sys.stdout.isatty() and not (no_open or os.environ.get("CI")):
        webbrowser.open(page.resolve().as_uri())
