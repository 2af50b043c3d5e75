"""The shell of the ensemble: check, simulate, infer, report; and run, which goes the whole way."""

from pathlib import Path
from typing import Annotated, Any

import typer

from vegglue.case.config import load_case
from vegglue.case.schema import Case
from vegglue.cli.options import Config, Jobs, Members, Runs, Trust, console, progress_bars, say_on
from vegglue.cli.tables import show_diagnosis, show_ladder, show_questions
from vegglue.report_page.posterior_words import describe
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior
from vegglue.solver.status import FAILED, SOLVED_BY_MARCHING, members_with
from vegglue.workflow.check import check
from vegglue.workflow.extend import StepwiseExtension
from vegglue.workflow.infer import Method, infer
from vegglue.workflow.report import report
from vegglue.workflow.run import run
from vegglue.workflow.run_folder import of_size
from vegglue.workflow.simulate import is_simulated, simulate


def check_command(config: Config, runs: Runs = Path("runs"), trust: Trust = False) -> None:
    """Read everything a case names, say what is odd, and draw the channel, before hours are spent."""
    case = load_case(config, trust)
    found = check(case, runs=runs)
    for sentence in found.remarks:
        console.print(f"- {sentence}")
    console.print(
        f"{case.name}: {len(case.experiments)} experiment(s), {found.cells:,} cells, {found.used_stations} of "
        f"{found.stations} stations in use, {len(found.remarks)} remark(s). Channel drawn in {found.picture}"
    )


def simulate_command(
    config: Config, members: Members = None, jobs: Jobs = -1, runs: Runs = Path("runs"), trust: Trust = False
) -> None:
    """Solve every member of the ensemble; a run that was stopped goes on where it was."""
    case = of_size(load_case(config, trust), members)
    current = is_simulated(case, runs)
    with progress_bars() as watch:
        ensemble = simulate(case, runs=runs, jobs=jobs, watch=watch)
    show(case, runs, f"{runs / case.name / 'ensemble.h5'} is up to date." if current else ensemble)


def infer_command(
    config: Config,
    method: Annotated[
        Method | None,
        typer.Option(help="Draws around the best members, or these members weighed; instead of the config's."),
    ] = None,
    members: Members = None,
    jobs: Jobs = -1,
    runs: Runs = Path("runs"),
    trust: Trust = False,
) -> None:
    """Infer the parameters from the measurements and say what was found."""
    case = load_case(config, trust)
    show(case, runs, infer(case, runs=runs, method=method, members=members, jobs=jobs, say=say_on()))


def report_command(config: Config, members: Members = None, runs: Runs = Path("runs"), trust: Trust = False) -> None:
    """Make the page and the figures of a run."""
    case = load_case(config, trust)
    show(case, runs, report(case, runs=runs, members=members))


def run_command(
    config: Config, members: Members = None, jobs: Jobs = -1, runs: Runs = Path("runs"), trust: Trust = False
) -> None:
    """The whole loop: diagnose, add what is missing, watch the error fall; posterior and report before and after."""
    with progress_bars() as watch:
        run(
            load_case(config, trust),
            runs=runs,
            members=members,
            jobs=jobs,
            say=say_on(),
            watch=watch,
            show=lambda case, result: show(case, runs, result),
        )


def show(case: Case, runs: Path, result: Any) -> None:
    """Print a result of a case: a noun of `run`, or a sentence as it is."""
    match result:
        case str():
            console.print(result)
        case Diagnosis():
            show_diagnosis(result)
        case StepwiseExtension():
            show_ladder(result.comparison)
            console.print(result.reason)
        case list():
            show_questions(result)
        case Ensemble():
            console.print(f"{runs / case.name / 'ensemble.h5'}: {_solved(result)}")
        case Posterior():
            for sentence in describe(result, case.reference.table if case.reference else None):
                console.print(f"- {sentence}")
            console.print(f"Written to {runs / case.name / 'posterior.h5'}")
        case Path():
            console.print(f"Report: {result.resolve()}")


def _solved(ensemble: Ensemble) -> str:
    status = ensemble.status
    marched, failed = (members_with(status, number) for number in (SOLVED_BY_MARCHING, FAILED))
    return (
        f"{len(status):,} members, {marched} by marching, {failed} failed, "
        f"largest mass error {ensemble.mass_error[status != FAILED].max(initial=0.0):.1e}"
    )
