"""case, ensemble -> posterior: by draws around the best members, or by the members weighed as they are (GLUE)."""

from dataclasses import replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from vegglue.case.resolved_config import case_hash, resolved_yaml, simulation_hash
from vegglue.case.schema import Case
from vegglue.diagnosis.comparison import without_stations
from vegglue.errors import InputError, shown_command, shown_path
from vegglue.inference.command_ensemble import refuse_useless
from vegglue.inference.glue import glue
from vegglue.inference.refine import refinable, refine
from vegglue.parallel import at_most, one_thread
from vegglue.progress import Watch, silent
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior
from vegglue.results.result_files import read_ensemble, read_posterior, stored_hash, write_posterior
from vegglue.results.resume import begun_or_finished
from vegglue.workflow.case_run import CaseRun, case_run, excluded_in, median_flow, other_size
from vegglue.workflow.command_model import command_to_learn, with_command

Method = Literal["refine", "surrogate", "glue"]


@one_thread()
def infer(
    case: Case | CaseRun,
    ensemble: Ensemble | None = None,
    *,
    runs: Path | str = "runs",
    method: Method | None = None,
    members: int | None = None,
    jobs: int = -1,
    watch: Watch = silent,
) -> Posterior:
    """Infer the parameters of a case from its measurements.

        p(theta | y) ~ p(y | theta) p(theta)

    The posterior is kept in runs/<name>/posterior.h5, the flow of its medians in flow.h5. Readings that the diagnosis
    excludes are excluded.

    Parameters
    ----------
    case : Case or CaseRun
    ensemble : Ensemble, optional
        That of this case; read from the folder if not given. If there is none, `refine` begins with points of the
        prior.
    runs : Path or str
        Folder that holds the folders of runs.
    method : str, optional
        `refine`, `surrogate` (of the command of `engine`) or `glue`, instead of the case's.
    members : int, optional
        Size of the ensemble, instead of the case's.
    jobs : int
        Processes, -1 for one on each core. Results do not depend on it.
    watch : callable
        Gets a `Progress` at each step.

    Returns
    -------
    Posterior

    Raises
    ------
    InputError
        If an ensemble is needed and there is none, if it is of another state of the case, or if the likelihood cannot
        be refined.
    """
    run = case_run(case, runs, jobs, watch)
    aside = excluded_in(run)
    run = run.sized(members if ensemble is None else len(ensemble.status))
    sized, wanted = run.case, run.config_hash
    observations = replace(run.observations, table=without_stations(run.observations.table, aside))
    if not observations.table["used"].any():
        raise InputError(
            f"{sized.name}: expected a station in use, got none, so that nothing can be inferred; "
            f"{shown_command('check', sized.source)} reports why."
        )
    chosen = chosen_method(sized, method)
    ensemble = own_ensemble(run, ensemble, members is not None or needs_ensemble(sized, chosen))
    if ensemble is not None and ensemble.by_command:
        refuse_useless(sized, ensemble)
    if chosen == "glue":
        assert ensemble is not None
        posterior = glue(ensemble, sized, observations)
    else:
        with at_most(run.jobs):
            model = replace(run.model, station=observations.table)
            if chosen == "surrogate":
                model, command = command_to_learn(model, run.folder, run.watch)
                posterior = refine(None, model, run.watch, command)
            else:
                posterior = refine(ensemble, with_command(model, run.folder, run.watch), run.watch)
    write_posterior(run.folder / "posterior.h5", posterior, resolved_yaml(sized), wanted)
    with at_most(run.jobs):
        median_flow(run, posterior)  # for the page, which shall not have to wait for it
    return posterior


def is_inferred(run: CaseRun) -> bool:
    """Whether the posterior that is kept is of exactly this case and without what is excluded."""
    path = run.folder / "posterior.h5"
    if stored_hash(path) != case_hash(run.case):
        return False
    now = without_stations(run.observations.table, excluded_in(run))
    return bool(np.array_equal(read_posterior(path).station["used"], now["used"]))


def own_ensemble(run: CaseRun, given: Ensemble | None, needed: bool) -> Ensemble | None:
    """The ensemble that a posterior is made of.

    Parameters
    ----------
    given : Ensemble or None
        The one in the folder of the run, if None.
    needed : bool
        Whether the posterior needs one.

    Returns
    -------
    Ensemble or None
        None if there is none and it is not needed.

    Raises
    ------
    InputError
        For an ensemble of another state of the case or of another size, or if there is none and it is needed.
    """
    case, path = run.case, run.folder / "ensemble.h5"
    if given is None:
        there = needed or begun_or_finished(path)
        if (size := other_size(case, run.folder)) is not None:
            raise InputError(
                f"{path}: holds {size:,} members, and {case.simulate.members:,} are asked for; add --members {size}, "
                "or simulate the case again."
            )
        return read_ensemble(path, simulation_hash(case), case.source) if there else None
    if given.config_hash != simulation_hash(case):
        raise InputError(f"{case.name}: expected its own ensemble, got one of another state of it; simulate it again.")
    return given


def needs_ensemble(case: Case, method: Method) -> bool:
    """Whether a posterior is made of the members of an ensemble: by GLUE, or with a command that runs each draw."""
    return method == "glue" or (method == "refine" and case.engine is not None)


def chosen_method(case: Case, asked: Method | None) -> Method:
    """How a posterior is made; members of an informal likelihood are always weighed.

    Parameters
    ----------
    asked : {"glue", "refine", "surrogate"} or None
        That of the case, if None.

    Raises
    ------
    InputError
        If that is no method, or none for this case.
    """
    if asked not in (None, *get_args(Method)):
        raise InputError(f"--method: expected {' or '.join(get_args(Method))}, got {asked!r}.")
    chosen = asked or case.infer.method
    if chosen == "surrogate" and case.engine is None:
        raise InputError(
            f"{shown_path(case.source)}: `method: surrogate` expected an `engine`, got none; the built-in engine is "
            "drawn from by `refine`."
        )
    if refinable(case):
        return chosen
    if asked in ("refine", "surrogate"):
        raise InputError(
            f"--method {asked}: expected `infer.likelihood: gaussian` without `behavioural`, got an informal "
            "likelihood; change the config or use --method glue."
        )
    return "glue"
