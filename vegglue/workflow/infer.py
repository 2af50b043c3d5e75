"""case, ensemble -> posterior: by draws around the best members, or by the members weighed as they are (GLUE)."""

from dataclasses import replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from vegglue.case.resolved_config import case_hash, resolved_yaml, simulation_hash
from vegglue.case.schema import Case
from vegglue.diagnosis.excluded_stations import without_stations
from vegglue.engine.model import model_of
from vegglue.errors import InputError, shown_command
from vegglue.inference.glue import glue
from vegglue.inference.refine import refinable, refine
from vegglue.measurements.observations import read_observations
from vegglue.parallel import at_most, one_thread
from vegglue.progress import Watch, silent
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior
from vegglue.results.result_files import read_ensemble, read_posterior, stored_hash, write_posterior
from vegglue.results.resume import begun_or_finished
from vegglue.workflow.command_model import with_command
from vegglue.workflow.median_flow import median_flow
from vegglue.workflow.run_folder import folder_of, of_size, other_size
from vegglue.workflow.set_aside import set_aside_of

Method = Literal["refine", "glue"]


@one_thread()
def infer(
    case: Case,
    ensemble: Ensemble | None = None,
    *,
    runs: Path | str = "runs",
    method: Method | None = None,
    members: int | None = None,
    jobs: int = -1,
    watch: Watch = silent,
) -> Posterior:
    """Infer the parameters from the measurements, p(theta | y) ~ p(y | theta) p(theta); kept in
    runs/<name>/posterior.h5, and the flow of their medians in flow.h5.

    Measurements that its diagnosis has set aside are left out, see `set_aside_of`; the posterior says so.

    ensemble: the one of this case, whose size counts then; read from the folder if not given. Where none is there,
    `refine` begins with points of the prior. method: `refine` or `glue` instead of the case's. members: size of the
    ensemble instead of the case's.

    Errors: InputError when there is none and it is needed, or it is of another state of the case, or the likelihood
    cannot be refined.
    """
    aside = set_aside_of(case, runs)
    case = of_size(case, members if ensemble is None else len(ensemble.status))
    wanted = case_hash(case)  # before anything is read: what changes meanwhile then makes the result out of date
    observations = read_observations(case)
    observations = replace(observations, table=without_stations(observations.table, aside))
    if not observations.table["used"].any():
        raise InputError(
            f"{case.name}: expected a station in use, got none: nothing can be inferred; "
            f"{shown_command('check', case.source)} says why."
        )
    folder, chosen = folder_of(runs, case), chosen_method(case, method)
    ensemble = _own_ensemble(case, ensemble, folder, members is not None or needs_ensemble(case, chosen))
    if chosen == "glue":
        assert ensemble is not None
        posterior = glue(ensemble, case, observations)
    else:
        with at_most(jobs):
            engine = with_command(model_of(case, observations), folder, watch).engine
            posterior = refine(ensemble, case, observations, watch, engine)
    write_posterior(folder / "posterior.h5", posterior, resolved_yaml(case), wanted)
    with at_most(jobs):
        median_flow(case, posterior, folder)  # for the page, which shall not have to wait for it
    return posterior


def is_inferred(case: Case, runs: Path | str, members: int | None = None) -> bool:
    """Whether the posterior that is kept is of exactly this case, or of this size, and without what is set aside."""
    path = folder_of(runs, case) / "posterior.h5"
    if stored_hash(path) != case_hash(of_size(case, members)):
        return False
    now = without_stations(read_observations(case).table, set_aside_of(case, runs))
    return bool(np.array_equal(read_posterior(path).station["used"].astype(bool), now["used"].astype(bool)))


def _own_ensemble(case: Case, given: Ensemble | None, folder: Path, needed: bool) -> Ensemble | None:
    """The ensemble that was given, else the one in the folder; None where there is none and it is not needed.

    Errors: InputError for one of another state of the case, or where none is there and it is needed.
    """
    if given is None:
        there = needed or begun_or_finished(folder / "ensemble.h5")
        _refuse_another_size(case, folder)
        return read_ensemble(folder / "ensemble.h5", simulation_hash(case), case.source) if there else None
    if given.config_hash != simulation_hash(case):
        raise InputError(f"{case.name}: expected its own ensemble, got one of another state of it; simulate it again.")
    return given


def _refuse_another_size(case: Case, folder: Path) -> None:
    """Errors: InputError when the ensemble in the folder is of this case, but of another number of members."""
    if (members := other_size(case, folder)) is not None:
        raise InputError(
            f"{folder / 'ensemble.h5'}: holds {members:,} members, and {case.simulate.members:,} are asked for; add "
            f"--members {members}, or simulate the case again."
        )


def needs_ensemble(case: Case, method: Method) -> bool:
    """Whether a posterior is made of the members of an ensemble: by GLUE, or with a command, whose runs are dear."""
    return method == "glue" or case.engine is not None


def chosen_method(case: Case, asked: Method | None) -> Method:
    """What is asked for, else what the case says; an informal likelihood is always weighed. Errors: InputError."""
    if asked not in (None, *get_args(Method)):
        raise InputError(f"--method: expected {' or '.join(get_args(Method))}, got {asked!r}.")
    if refinable(case):
        return asked or case.infer.method
    if asked == "refine":
        raise InputError(
            "--method refine: expected `infer.likelihood: gaussian` without `behavioural`, got an informal likelihood; "
            "change the config or use --method glue."
        )
    return "glue"
