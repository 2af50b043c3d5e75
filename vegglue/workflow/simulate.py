"""case -> ensemble: every member solved and kept; what an earlier run has solved is not solved again."""

import os
import shutil
from pathlib import Path

from vegglue.case.parameter_space import PriorSample, sample_of
from vegglue.case.resolved_config import simulation_hash
from vegglue.case.schema import Case
from vegglue.case.text_files import names_in_files, write_text
from vegglue.engine.command import command_runs
from vegglue.errors import InputError, StorageError
from vegglue.flow.status import FAILED
from vegglue.inference.command_ensemble import run_ensemble
from vegglue.inference.glue import refuse_undefined_efficiency
from vegglue.inference.solve_ensemble import ensemble_hash, solve_ensemble
from vegglue.parallel import at_most, one_thread
from vegglue.progress import Watch, silent
from vegglue.results.calibration_files import ensemble_table, observation_names, read_parameters, solved_rows
from vegglue.results.ensemble import Ensemble
from vegglue.results.result_files import read_ensemble, stored_hash
from vegglue.results.resume import remove_left_over_fields
from vegglue.wording.remedies import MAKE_ROOM
from vegglue.workflow.case_run import CaseRun, case_run, other_size
from vegglue.workflow.command_model import refuse_command


@one_thread()
def simulate(
    case: Case | CaseRun,
    *,
    runs: Path | str = "runs",
    members: int | None = None,
    jobs: int = -1,
    watch: Watch = silent,
    force: bool = False,
    parameters: Path | str | None = None,
) -> Ensemble:
    """Solve all members of the ensemble of a case, or run the command of its `engine` for each.

    They are kept in runs/<name>/ensemble.h5, and in fields.h5 if the case keeps fields. An ensemble of exactly this
    case is read instead, also that of a run beside it whose case differs only in what an ensemble does not depend on; a
    stopped one is continued.

    Parameters
    ----------
    case : Case or CaseRun
    runs : Path or str
        Folder that holds the folders of runs.
    members : int, optional
        Size of the ensemble, instead of the case's.
    jobs : int
        Processes, -1 for one on each core. Results do not depend on it.
    watch : callable
        Gets a `Progress` at each step.
    force : bool
        Whether to replace a larger ensemble of the case, and to run members again for which the command failed.
    parameters : Path or str, optional
        CSV with one row for each member, such as draws of another program (see `read_parameters`). These members are
        kept in runs/<name>/given/<file>/, with their predictions also as predictions.csv.

    Returns
    -------
    Ensemble
        With predictions (member, station) [m/s for velocities, m for levels, m3/s for discharges].

    Raises
    ------
    InputError
        For a case without parameters, for fields beyond their budget, or if there is a larger ensemble.
    StorageError
        If another run holds the folder, or if the disk is full.
    """
    run = case_run(case, runs, jobs, watch, force)
    if run.case.engine is None:
        refuse_command(run.case, "simulate")  # of a finished run: `infer` draws its posterior without members
    if parameters is not None:
        return simulate_given(run, Path(parameters))
    run = run.sized(members)
    path = run.folder / "ensemble.h5"
    refuse_to_shrink(run)
    refuse_undefined_efficiency(run.case, run.observations.table)
    if not is_simulated(run):
        share_one_beside(run)
    if not is_up_to_date(run):
        compute_members(run, path)
    remove_left_over_fields(path)
    return read_ensemble(path)


def compute_members(run: CaseRun, path: Path, given: PriorSample | None = None) -> None:
    """Solve the members of a case, or run its command for each, into a file.

    Parameters
    ----------
    path : Path
        Of the HDF5 file.
    given : PriorSample, optional
        Members in place of those that the case draws from its priors.
    """
    if run.case.engine is None:
        solve_ensemble(run.case, run.observations, path, run.jobs, run.watch, run.site, given)
        return
    with at_most(run.jobs):
        commands = command_runs(run.case, run.folder)
        run_ensemble(run.case, run.observations, path, commands, run.jobs, run.watch, given)


def simulate_given(run: CaseRun, file: Path) -> Ensemble:
    """Solve the members of a CSV, and write their predictions beside the ensemble.

    Raises
    ------
    InputError
        For a file that does not fit the case.
    """
    theta = read_parameters(file, run.case)
    run, given = run.sized(len(next(iter(theta.values())))), sample_of(run.case, theta)
    path = given_folder(run, file) / "ensemble.h5"
    if stored_hash(path) != ensemble_hash(run.case, given):
        compute_members(run, path, given)
    remove_left_over_fields(path)
    found = read_ensemble(path)
    valued = found.station["value"].notna().to_numpy()
    columns = observation_names(found.station[valued])
    solved = solved_rows(found)
    table = ensemble_table(dict(zip(columns, found.prediction[solved][:, valued].T, strict=True)), solved)
    write_text(path.with_name("predictions.csv"), table, MAKE_ROOM)
    return found


def given_folder(run: CaseRun, file: Path) -> Path:
    """Where the members of a CSV of parameters are kept."""
    return run.folder / "given" / names_in_files([file.stem])[file.stem]


def is_simulated(run: CaseRun) -> bool:
    """Whether a readable ensemble of exactly this case is there, with its fields if the case keeps any."""
    path, wanted = run.runs / run.case.name / "ensemble.h5", simulation_hash(run.case)
    try:
        read_ensemble(path, wanted)
    except (InputError, StorageError):
        return False
    return run.case.simulate.fields is None or stored_hash(path.with_name("fields.h5")) == wanted


def is_up_to_date(run: CaseRun) -> bool:
    """Whether nothing is left to do: the ensemble is there, and no failed run of a command is to be tried again."""
    if not is_simulated(run):
        return False
    if not run.force or run.case.engine is None:
        return True
    return not (read_ensemble(run.folder / "ensemble.h5").status == FAILED).any()


def refuse_to_shrink(run: CaseRun) -> None:
    """Raise InputError if a finished ensemble of the case with more members would be replaced, unless forced."""
    folder, wanted = run.runs / run.case.name, run.case.simulate.members
    members = None if run.force else other_size(run.case, folder)
    if members is not None and members > wanted:
        raise InputError(
            f"{folder / 'ensemble.h5'}: holds {members:,} members of this case, which {wanted:,} would "
            f"replace; ask for --members {members}, give another folder by --runs, or add --force."
        )


def share_one_beside(run: CaseRun) -> None:
    """Link the ensemble of another case in the folder of runs that solved the very same members, if there is one.

    The files are copied if the disk knows no links.

    Raises
    ------
    StorageError
        If the disk is full.
    """
    wanted = simulation_hash(run.case)
    names = ("ensemble.h5",) if run.case.simulate.fields is None else ("fields.h5", "ensemble.h5")
    for folder in sorted(run.folder.parent.iterdir()):
        if folder == run.folder or any(stored_hash(folder / name) != wanted for name in names):
            continue
        for name in names:
            here, new = run.folder / name, run.folder / f"{name}.new"
            try:
                new.unlink(missing_ok=True)
                try:
                    os.link(folder / name, new)
                except OSError:
                    shutil.copyfile(folder / name, new)
                os.replace(new, here)
            except OSError as error:
                raise StorageError(
                    f"{here}: cannot be shared with {folder / name} ({error}); make room and run it again."
                ) from error
        return
