"""case -> ensemble: every member solved and kept; what an earlier run has solved is not solved again."""

import os
import shutil
from collections import Counter
from pathlib import Path

from vegglue.case.resolved_config import simulation_hash
from vegglue.case.schema import Case
from vegglue.engine.command_runs import command_runs
from vegglue.errors import InputError, StorageError, shown_path
from vegglue.flow.status import FAILED
from vegglue.inference.command_ensemble import run_ensemble
from vegglue.inference.solve_ensemble import solve_ensemble
from vegglue.measurements.observations import read_observations
from vegglue.parallel import at_most, one_thread
from vegglue.progress import Watch, silent
from vegglue.results.ensemble import Ensemble
from vegglue.results.result_files import read_ensemble, stored_hash
from vegglue.results.resume import remove_left_over_fields
from vegglue.workflow.run_folder import folder_of, of_size, other_size


@one_thread()
def simulate(
    case: Case,
    *,
    runs: Path | str = "runs",
    members: int | None = None,
    jobs: int = -1,
    watch: Watch = silent,
    force: bool = False,
) -> Ensemble:
    """Solve every member of the ensemble, kept in runs/<name>/ensemble.h5 (and fields.h5 if the case keeps fields); or
    run the command of the case's `engine` for each.

    An ensemble of exactly this case is read instead, also that of a run beside it whose case differs only in what an
    ensemble does not depend on; one that was stopped goes on where it was. members: size of the ensemble instead of the
    case's; jobs: processes, -1 for one on every core, and results do not depend on it; watch is told how far it is;
    force: replace a larger ensemble of the case, too, and run members again for which the command of an engine failed.
    Predictions are (member, station), in m/s for velocities and m for levels.

    Errors: InputError for a case without parameters, fields beyond their budget, or a larger ensemble there;
    StorageError when another run holds the folder or the disk is full.
    """
    case = of_size(case, members)
    path = folder_of(runs, case) / "ensemble.h5"
    refuse_to_shrink(case, runs, force)
    if not is_simulated(case, runs):
        _share_one_beside(case, path)
    if not is_up_to_date(case, runs, force):
        if case.engine is None:
            solve_ensemble(case, read_observations(case), path, jobs, watch)
        else:
            with at_most(jobs):
                run_ensemble(case, read_observations(case), path, command_runs(case, path.parent), jobs, watch)
    remove_left_over_fields(path)
    return read_ensemble(path)


def is_simulated(case: Case, runs: Path | str) -> bool:
    """Whether a readable ensemble of exactly this case is there, with its fields if the case keeps any."""
    path, wanted = Path(runs) / case.name / "ensemble.h5", simulation_hash(case)
    try:
        read_ensemble(path, wanted)
    except (InputError, StorageError):
        return False
    return case.simulate.fields is None or stored_hash(path.with_name("fields.h5")) == wanted


def is_up_to_date(case: Case, runs: Path | str, force: bool) -> bool:
    """Whether nothing is left to do: the ensemble is there, and no failed run of a command is to be tried again."""
    if not is_simulated(case, runs):
        return False
    if not force or case.engine is None:
        return True
    return not (read_ensemble(Path(runs) / case.name / "ensemble.h5").status == FAILED).any()


def refuse_to_shrink(case: Case, runs: Path | str, force: bool) -> None:
    """Errors: InputError when a finished ensemble of the case with more members would be replaced, unless forced."""
    folder = Path(runs) / case.name
    members = None if force else other_size(case, folder)
    if members is not None and members > case.simulate.members:
        raise InputError(
            f"{folder / 'ensemble.h5'}: holds {members:,} members of this case, which {case.simulate.members:,} would "
            f"replace; ask for --members {members}, give another folder by --runs, or add --force."
        )


def _share_one_beside(case: Case, path: Path) -> None:
    """Share the ensemble of a run in the same folder of runs that solved the very same members, if there is one."""
    wanted = simulation_hash(case)
    names = ("ensemble.h5",) if case.simulate.fields is None else ("fields.h5", "ensemble.h5")
    for folder in sorted(path.parent.parent.iterdir()):
        if folder != path.parent and all(stored_hash(folder / name) == wanted for name in names):
            for name in names:
                _share(folder / name, path.with_name(name))
            return


def _share(there: Path, here: Path) -> None:
    """One file under two names, or a copy where the disk knows no links. Finished results are never changed in place.

    Errors: StorageError when the disk is full.
    """
    new = here.with_name(f"{here.name}.new")
    try:
        new.unlink(missing_ok=True)
        try:
            os.link(there, new)
        except OSError:
            shutil.copyfile(there, new)
        os.replace(new, here)
    except OSError as error:
        raise StorageError(f"{here}: cannot be shared with {there} ({error}); make room and run it again.") from error


def refuse_all_failed(case: Case, ensemble: Ensemble) -> None:
    """Errors: InputError for an ensemble of which nothing can be inferred; it is kept all the same."""
    failed = ensemble.status == FAILED
    if failed.all():
        reason, many = Counter(map(str, ensemble.reason[failed])).most_common(1)[0]
        again = "" if case.engine is None else " with --force"
        raise InputError(
            f"{shown_path(case.source)}: expected members with a solution, got none of {failed.size:,}; {many:,} of "
            f"them say: {reason or 'no steady flow'}. Mend that, or the priors, and simulate again{again}."
        )
