"""The shell: reads files, calls the verbs, prints what they say. The only place that knows typer and rich."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash, resolved_yaml, simulation_hash
from vegglue.case.schema import Case
from vegglue.cli.effect_commands import effects_command
from vegglue.cli.loop_commands import LOOP_COMMANDS, loop
from vegglue.cli.options import Config, Jobs, Runs, Trust, console
from vegglue.cli.twin_commands import TWIN_COMMANDS
from vegglue.ensemble.simulate import simulate, solve_flow
from vegglue.errors import InputError, StorageError
from vegglue.figures.channel import save_channel_figure
from vegglue.inference.glue import glue
from vegglue.inference.refine import refinable, refine
from vegglue.measurements.observations import Observations, read_observations
from vegglue.measurements.plant_survey import read_survey, rigid_cylinder
from vegglue.parallel import alone, at_most
from vegglue.progress import Progress
from vegglue.report.page import write_report
from vegglue.report.posterior_words import describe
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior
from vegglue.site.gridded_site import build_site
from vegglue.solver.status import FAILED, SOLVED_BY_MARCHING, members_with
from vegglue.storage.hdf5 import diagnosis_that_fits, read_ensemble, read_posterior, stored_hash, write_posterior
from vegglue.version import VERSION
from vegglue.workflow.check import check_case
from vegglue.workflow.run_folder import folder_of

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
Members = Annotated[
    int | None,
    typer.Option(min=1, help="Size of the ensemble instead of the config's; powers of two use the Sobol' points best."),
]


@app.callback()
def about() -> None:
    """Calibrate a model of flow through plants against measured velocities, and see where it fails.

    check, then run, or its steps: simulate, infer, diagnose, extend, compare, next, report. Every command takes the
    same CONFIG and works in runs/<name>.
    """


@app.command()
def version() -> None:
    """Print the version."""
    console.print(VERSION)


@app.command()
def check(config: Config, runs: Runs = Path("runs"), trust: Trust = False) -> None:
    """Read everything a case names, say what is odd, and draw the channel, before hours are spent."""
    case, observations = _read(config, trust)
    site = build_site(case)
    figure = folder_of(runs, case) / "channel.png"
    oddities = check_case(case, site, observations)
    for sentence in oddities:
        console.print(f"- {sentence}")
    save_channel_figure(case, site, observations, figure)
    used = int(observations.table["used"].sum())
    console.print(
        f"{case.name}: {len(case.experiments)} experiment(s), {site.bed.size:,} cells, {used} of "
        f"{len(observations.table)} stations in use, {len(oddities)} remark(s). Channel drawn in {figure}"
    )


@app.command(name="simulate")
def simulate_command(
    config: Config, members: Members = None, jobs: Jobs = -1, runs: Runs = Path("runs"), trust: Trust = False
) -> None:
    """Solve every member of the ensemble; a run that was stopped goes on where it was."""
    if jobs == 0:
        raise InputError("--jobs: expected the number of processes, or -1 for one on every core, got 0.")
    case, observations = _read(config, trust, members)
    path = folder_of(runs, case) / "ensemble.h5"
    if _is_current(path, case):
        console.print(f"{path} is up to date.")
        return
    with _progress(case.name) as report:
        simulate(case, observations, path, jobs, report)
    ensemble = read_ensemble(path)
    marched, failed = (members_with(ensemble.status, number) for number in (SOLVED_BY_MARCHING, FAILED))
    console.print(
        f"{path}: {len(ensemble.status):,} members, {marched} by marching, {failed} failed, "
        f"largest mass error {ensemble.mass_error[ensemble.status != FAILED].max(initial=0.0):.1e}"
    )


@app.command()
def infer(
    config: Config,
    method: Annotated[
        Literal["refine", "glue"] | None,
        typer.Option(help="Draws around the best members, or these members weighed; instead of the config's."),
    ] = None,
    members: Members = None,
    jobs: Jobs = -1,
    runs: Runs = Path("runs"),
    trust: Trust = False,
) -> None:
    """Infer the parameters from the measurements and say what was found."""
    case, observations = _read(config, trust, members)
    folder = folder_of(runs, case)
    ensemble = read_ensemble(folder / "ensemble.h5", simulation_hash(case))
    posterior = _inferred(case, observations, ensemble, method, jobs)
    write_posterior(folder / "posterior.h5", posterior, resolved_yaml(case), case_hash(case))
    for sentence in describe(posterior, case.reference.table if case.reference else None):
        console.print(f"- {sentence}")
    console.print(f"Written to {folder / 'posterior.h5'}")


def _inferred(case: Case, observations: Observations, ensemble: Ensemble, method: str | None, jobs: int) -> Posterior:
    if method == "refine" and not refinable(case):
        raise InputError(
            "--method refine: expected `infer.likelihood: gaussian` without `behavioural`, got an informal likelihood; "
            "change the config or use --method glue."
        )
    if (method or case.infer.method) == "glue" or not refinable(case):
        return glue(ensemble, case, observations)
    with at_most(jobs):
        return refine(ensemble, case, observations, lambda text: console.print(f"... {text}", style="dim"))


@app.command()
def report(config: Config, members: Members = None, runs: Runs = Path("runs"), trust: Trust = False) -> None:
    """Make the page and the figures of a run."""
    case, observations = _read(config, trust, members)
    folder = folder_of(runs, case)
    ensemble = read_ensemble(folder / "ensemble.h5", simulation_hash(case))
    posterior = read_posterior(folder / "posterior.h5", case_hash(case))
    flow = solve_flow(case, posterior.marginals.median)
    survey = rigid_cylinder(read_survey(case.survey.file), case.survey) if case.survey else None
    diagnosis = diagnosis_that_fits(folder / "diagnosis.h5", case_hash(load_case(config, trust)))
    page = write_report(folder, case, observations, ensemble, posterior, flow, survey, diagnosis)
    console.print(f"Report: {page.resolve()}")


@app.command(name="run")
def run_command(config: Config, jobs: Jobs = -1, runs: Runs = Path("runs"), trust: Trust = False) -> None:
    """The whole loop: diagnose, add what is missing, watch the error fall; posterior and report before and after."""
    last = loop(load_case(config, trust), runs, jobs)
    for each in dict.fromkeys((config.resolve(), last.resolve())):
        if _calibrated(each, jobs, runs, trust):
            report(each, runs=runs, trust=trust)


def _calibrated(config: Path, jobs: int, runs: Path, trust: bool) -> bool:
    """Ensemble and posterior, unless they are there; False, and why, where no posterior could be found."""
    simulate_command(config, jobs=jobs, runs=runs, trust=trust)
    case = load_case(config, trust)
    posterior = runs / case.name / "posterior.h5"
    if stored_hash(posterior) == case_hash(case):
        console.print(f"{posterior} is up to date.")
        return True
    try:
        infer(config, jobs=jobs, runs=runs, trust=trust)
    except InputError as error:
        console.print(f"{error} There is no report of {case.name} without a posterior.")
        return False
    return True


for _name, _command in (*LOOP_COMMANDS, *TWIN_COMMANDS, ("effects", effects_command)):
    app.command(name=_name)(_command)


def _read(config: Path, trust: bool, members: int | None = None) -> tuple[Case, Observations]:
    case = load_case(config, trust)
    if members is not None:
        case = case.model_copy(update={"simulate": case.simulate.model_copy(update={"members": members})})
    return case, read_observations(case)


def _is_current(path: Path, case: Case) -> bool:
    wanted = simulation_hash(case)
    try:
        read_ensemble(path, wanted)
    except (InputError, StorageError):
        return False
    return case.simulate.fields is None or stored_hash(path.with_name("fields.h5")) == wanted


@contextmanager
def _progress(name: str) -> Iterator[Callable[[Progress], None]]:
    """A bar with the time left on a terminal, a line now and then elsewhere."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("members,"),
        TimeElapsedColumn(),
        TextColumn("spent,"),
        TimeRemainingColumn(elapsed_when_finished=False),
        TextColumn("left{task.fields[note]}"),
    )
    with Bar(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task(name, total=None, note="")

        def show(progress: Progress) -> None:
            failed = f", {progress.failed} failed" if progress.failed else ""
            bar.update(task, completed=progress.solved, total=progress.members, note=failed)
            if not console.is_terminal:
                resumed = f" ({progress.resumed} from before)" if progress.resumed else ""
                print(f"{name}: {progress.solved} of {progress.members} members{resumed}{failed}", flush=True)

        yield show


def main() -> None:
    """Entry point: errors a user can mend are one sentence and exit code 2, a full disk or a lock 3, Ctrl-C 130."""
    try:
        alone()
        app()
    except InputError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
    except StorageError as error:
        print(error, file=sys.stderr)
        sys.exit(3)
    except SystemExit as ended:
        if ended.code == 130:  # typer has made this of Ctrl-C
            print("Stopped; what was solved is kept, run the same command again to go on.", file=sys.stderr)
        raise


if __name__ == "__main__":
    main()
