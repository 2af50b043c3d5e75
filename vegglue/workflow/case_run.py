"""A case and all that its verbs share: its measurements and its site, read once, and the folder of its results.

ensemble.h5, fields.h5, posterior.h5, flow.h5, diagnosis.h5, rung.json, comparison.json, questions.json and best.json in
runs/<name>/ carry the hash of the case; a file of another state of the case is not used.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Integral
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, baseline, for_prediction, kept_baseline, log_evidence
from vegglue.calibration.fit import fit
from vegglue.case.gridded_site import Site, build_site
from vegglue.case.parameter_space import thetas_at, z_at
from vegglue.case.resolved_config import case_hash, resolved_yaml, simulation_hash
from vegglue.case.schema import Case
from vegglue.case.size_limits import MOST_MEMBERS
from vegglue.case.text_files import LARGEST_JSON, read_text, write_text
from vegglue.diagnosis.comparison import excluded_by, excluding
from vegglue.engine.interface import Model, linearise_from
from vegglue.engine.newton import NEWTON
from vegglue.errors import InputError
from vegglue.flow.sensor import FlowFields
from vegglue.inference.solve_ensemble import solve_flow
from vegglue.measurements.observations import Observations, read_observations, refuse_unknown_limits
from vegglue.progress import Watch, silent
from vegglue.results.loop_results import comparison_that_fits
from vegglue.results.posterior import Posterior
from vegglue.results.result_files import (
    diagnosis_that_fits,
    flow_that_fits,
    read_ensemble,
    read_posterior,
    stored_hash,
    write_flow,
)
from vegglue.whole_files import failed_writes_told
from vegglue.wording.remedies import ANOTHER_RUNS, MAKE_ROOM
from vegglue.workflow.command_model import unseen_with_command, with_command

# Distance of two fits [standard errors] below which they are the same minimum. Chosen, not measured.
SAME_FIT = 1.0
# Parts of a case that its measurements and its site do not depend on: a child differs from its parent in these alone.
OF_THE_MODEL_ALONE = {
    "source", "name", "title", "eddy_viscosity", "effects", "exclude", "effect_file", "engine", "parameters",
    "finished_result", "imported", "numerics", "simulate", "infer", "model_error", "validation", "reference",
    "canopy_correction", "planned",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class CaseRun:
    """A case with the settings of its run; measurements and site are read when they are first needed, and once.

    Parameters
    ----------
    runs : Path
        Folder that holds one folder of results for each case.
    jobs : int
        Number of processes, -1 for all cores. No result depends on it.
    watch : Watch
        Receives the progress of long computations.
    force : bool
        Whether a child that was edited by hand, and a larger ensemble, may be replaced.
    memory : float, optional
        Gigabytes that a diagnosis may use, else most of what the machine has. No result depends on it.
    beside : CaseRun, optional
        A run whose measurements and site are used here too, if the case has the same.
    """

    case: Case
    runs: Path = Path("runs")
    jobs: int = -1
    watch: Watch = silent
    force: bool = False
    memory: float | None = None
    beside: "CaseRun | None" = None

    @property
    def folder(self) -> Path:
        """Folder of the results, made if need be. Raises StorageError."""
        return folder_of(self.runs, self.case)

    @cached_property
    def config_hash(self) -> str:
        """Hash of the case and its files as they were before any of them was read."""
        return case_hash(self.case)

    @cached_property
    def observations(self) -> Observations:
        """The measurements of the case. Raises InputError."""
        _ = self.config_hash  # first: a file that changes while it is read makes the results out of date
        if self.beside is None or not _measured_alike(self.case, self.beside.case):
            return read_observations(self.case)
        refuse_unknown_limits(self.case, self.beside.observations.table)
        return self.beside.observations

    @cached_property
    def site(self) -> Site:
        """The site on its grid. Raises InputError."""
        if self.beside is None or not _measured_alike(self.case, self.beside.case):
            return build_site(self.case)
        return self.beside.site

    @cached_property
    def model(self) -> Model:
        """The case at its own measurements, solved by the built-in engine."""
        return Model(self.case, self.site, self.observations.table, NEWTON)

    @property
    def commanded_model(self) -> Model:
        """The model with the command of the case's `engine`, if there is one. Raises InputError."""
        return with_command(self.model, self.folder, self.watch)

    @cached_property
    def validation(self) -> "CaseRun | None":
        """The case at the measurements that no calibration uses, without effects; None if it names none."""
        if self.case.validation is None:
            return None
        seen = {"experiments": self.case.validation.experiments, "observations": self.case.validation.observations}
        # An effect limited to a section or device of the calibration need not be in the validation.
        there = self.case.model_copy(update=seen | {"effects": {}})
        return CaseRun(there, self.runs, beside=None if self.beside is None else self.beside.validation)

    @property
    def validation_model(self) -> Model | None:
        """The model at the measurements of the validation, with the command of the case if it has one."""
        there = self.validation
        if there is None:
            return None
        case = there.case.model_copy(update={"effects": self.case.effects})
        unseen = Model(case, there.site, there.observations.table, NEWTON)
        return unseen_with_command(unseen, self.model, self.folder, self.watch)

    def with_settings(
        self, runs: Path | str, jobs: int = -1, watch: Watch = silent, force: bool = False, memory: float | None = None
    ) -> "CaseRun":
        """The same case in another folder of runs, or with other settings, and what was read of it."""
        return CaseRun(self.case, Path(runs), jobs, watch, force, memory, beside=self)

    def of(self, case: Case) -> "CaseRun":
        """Another case in the same runs, such as a child: with these measurements and this site if it has the same."""
        return replace(self, case=case, beside=self)

    def sized(self, members: int | None) -> "CaseRun":
        """The run with another number of members. Raises InputError."""
        return self if members is None else self.of(of_size(self.case, members))


def case_run(
    case: Case | CaseRun, runs: Path | str, jobs: int = -1, watch: Watch = silent, force: bool = False
) -> CaseRun:
    """The run of a case.

    Parameters
    ----------
    case : Case or CaseRun
        A CaseRun is returned as it is: it has its own settings.
    runs : Path or str
        Folder of all runs.
    jobs : int
        Processes; -1 for one on every core.
    watch : callable
        Is called with each phase.
    force : bool
        Whether what vegglue did not write is replaced, too.
    """
    return case if isinstance(case, CaseRun) else CaseRun(case, Path(runs), jobs, watch, force)


def _measured_alike(case: Case, other: Case) -> bool:
    """Whether two cases have the same measurements on the same site."""
    parts = type(case).model_fields.keys() - OF_THE_MODEL_ALONE
    return all(getattr(case, name) == getattr(other, name) for name in parts)


def folder_of(runs: Path | str, case: Case) -> Path:
    """Where the results of a case lie; made if need be.

    Raises
    ------
    StorageError
        If it cannot be made.
    """
    folder = Path(runs) / case.name
    with failed_writes_told(folder, ANOTHER_RUNS):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


def of_size(case: Case, members: int | None) -> Case:
    """The case with another number of members.

    Parameters
    ----------
    members : int or None
        The case as it is, if None.

    Raises
    ------
    InputError
        If that is no whole number of 1 to MOST_MEMBERS.
    """
    if members is None:
        return case
    if not isinstance(members, Integral):
        raise InputError(f"members: expected a whole number, got {members!r}; give another.")
    if not 0 < members <= MOST_MEMBERS:
        raise InputError(f"members: expected 1 to {MOST_MEMBERS:,}, got {members:,}; give another number.")
    return case.model_copy(update={"simulate": case.simulate.model_copy(update={"members": int(members)})})


def as_solved(case: Case, folder: Path) -> Case:
    """The case with as many members as the ensemble in the folder of its run has, or as it is where there is none.

    Errors: StorageError.
    """
    path = folder / "ensemble.h5"
    return of_size(case, len(read_ensemble(path, config=case.source).status)) if path.exists() else case


def other_size(case: Case, folder: Path) -> int | None:
    """How many members the stored ensemble of a case has, if its size is all that is not the case's.

    Parameters
    ----------
    folder : Path
        Of its run.

    Returns
    -------
    int or None
        None without an ensemble, and for one of exactly this case or of another.
    """
    path = folder / "ensemble.h5"
    stored = stored_hash(path)
    if stored in (None, simulation_hash(case)):
        return None
    members = len(read_ensemble(path, config=case.source).status)
    return members if stored == simulation_hash(of_size(case, members)) else None


def kept_best_fit(case: Case, folder: Path) -> Array | None:
    """Where an earlier command found that exactly this case fits best.

    Parameters
    ----------
    folder : Path
        Of its run, with best.json or posterior.h5.

    Returns
    -------
    ndarray (p,) or None
        z [standard deviations of the prior].
    """
    wanted = case_hash(case)
    try:
        found = json.loads(read_text(folder / "best.json", LARGEST_JSON))
        if found["config_hash"] == wanted:
            z = z_at(case, {name: np.array([float(found["theta"][name])]) for name in case.parameters})[0]
            if np.isfinite(z).all():  # a file that was edited may hold anything
                return z
    except (OSError, ValueError, KeyError, TypeError, OverflowError, RecursionError):
        pass
    if stored_hash(folder / "posterior.h5") != wanted:
        return None
    posterior = read_posterior(folder / "posterior.h5", wanted)
    best = slice(posterior.sample.best, posterior.sample.best + 1)
    return z_at(case, {name: values[best] for name, values in posterior.sample.theta.items()})[0]


def keep_best_fit(case: Case, folder: Path, theta: Mapping[str, float], config_hash: str) -> None:
    """Keep where a case fits best for the next command; config_hash: of it as it was read. Errors: StorageError."""
    text = json.dumps({"config_hash": config_hash, "theta": {name: float(theta[name]) for name in case.parameters}})
    write_text(folder / "best.json", text, MAKE_ROOM)


def calibrated_anew(model: Model, known: Array | None, aside: pd.DataFrame) -> Baseline:
    """The model at its minimum, searched from the prior and from a place that is known.

    Of two different minima the one with more evidence is returned, as the model's own error differs between them.

    Parameters
    ----------
    known : ndarray (p,) or None
        z [standard deviations of the prior].
    aside : DataFrame
        Measurements that are excluded, with the columns of MEASUREMENT.

    Raises
    ------
    InputError
        If no steady flow is found, or there is nothing to calibrate.
    """
    model = excluding(model, aside)
    base = for_prediction(kept_baseline(model))

    def same_fit(z: Array) -> bool:
        away = z - base.fitted.point.z
        return bool(away @ np.linalg.solve(base.fitted.covariance, away) < SAME_FIT**2)

    if known is None or same_fit(known):
        return base
    start = linearise_from(base.model, known, base.fitted.point)
    if start is None or same_fit(fit(base.model, base.noise, start).point.z):
        return base
    return max(base, for_prediction(baseline(model, known)), key=log_evidence)


def best_parameters(base: Baseline) -> dict[str, float]:
    """The parameters of a calibrated model by name, in their units."""
    return thetas_at(base.model.case, base.fitted.point.z[None])[0]


def calibrated(run: CaseRun, aside: pd.DataFrame) -> Baseline:
    """A case where it predicts best, kept for the next command.

    Parameters
    ----------
    aside : DataFrame
        Measurements that are excluded, with the columns of MEASUREMENT.
    """
    wanted = run.config_hash
    base = calibrated_anew(run.commanded_model, kept_best_fit(run.case, run.folder), aside)
    keep_best_fit(run.case, run.folder, best_parameters(base), wanted)
    return base


def median_flow(run: CaseRun, posterior: Posterior) -> dict[str, FlowFields]:
    """Steady fields at cell centres for the median parameters, kept in flow.h5.

    Returns
    -------
    dict of FlowFields
        By experiment; one without a steady flow is left out.

    Raises
    ------
    StorageError
        If they cannot be written.
    """
    path, theta, wanted = run.folder / "flow.h5", posterior.marginals.median, case_hash(run.case)
    kept = flow_that_fits(path, wanted, theta)
    if kept is not None:
        return kept
    flow = solve_flow(run.case, theta)
    if flow:
        write_flow(path, flow, theta, resolved_yaml(run.case), wanted)
    return flow


def excluded_in(*several: CaseRun) -> pd.DataFrame:
    """Measurements that the diagnosis of any of the cases, or of the model its comparison begins with, has excluded."""
    # A comparison may begin with one of the cases as it was before: with its name, but another hash.
    models = dict.fromkeys((run.runs, *model) for run in several for model in judged_by(run.case, run.runs).items())
    found = (diagnosis_that_fits(runs / name / "diagnosis.h5", wanted) for runs, name, wanted in models)
    return excluded_by(*(one for one in found if one is not None))


def judged_by(case: Case, runs: Path) -> dict[str, str]:
    """Names and hashes of the models whose diagnoses count: its own, and the first of its comparison."""
    wanted = case_hash(case)
    ladder = comparison_that_fits(runs / case.name, wanted)
    first = {} if ladder is None else {ladder.steps[0].name: ladder.steps[0].config_hash}
    return {**first, case.name: wanted}
