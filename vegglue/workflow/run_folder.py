"""The folder of a run, runs/<name>/: what one step keeps there for the next, first of all where a model fits best.

ensemble.h5, fields.h5, posterior.h5, flow.h5, diagnosis.h5, rung.json, comparison.json, questions.json and best.json
carry the hash of the case; what does not fit is not used.
"""

import json
from collections.abc import Mapping
from numbers import Integral
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, baseline, for_prediction, kept_baseline, log_evidence
from vegglue.calibration.fit import fit
from vegglue.case.parameter_space import theta_at, z_at
from vegglue.case.resolved_config import case_hash, simulation_hash
from vegglue.case.schema import Case
from vegglue.case.size_limits import MOST_MEMBERS
from vegglue.case.text_files import LARGEST_JSON, read_text, write_text
from vegglue.diagnosis.excluded_stations import excluding
from vegglue.engine.interface import Model, linearise_from
from vegglue.engine.model import model_of
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations
from vegglue.progress import Watch, silent
from vegglue.results.result_files import read_ensemble, read_posterior, stored_hash
from vegglue.whole_files import MAKE_ROOM, failed_writes_told
from vegglue.workflow.command_model import unseen_with_command, with_command

# Standard errors within which the ends of two fits are one. Chosen, not measured.
SAME_FIT = 1.0


def folder_of(runs: Path | str, case: Case) -> Path:
    """Where the results of a case lie; made if need be. Errors: StorageError."""
    folder = Path(runs) / case.name
    with failed_writes_told(folder, "expected a folder that can be made there; give another one by --runs"):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


def of_size(case: Case, members: int | None) -> Case:
    """The case with another number of members, or as it is. Errors: InputError for none, a part, or too many."""
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
    """How many members the ensemble in the folder of its run has, if its size is all that is not the case's."""
    path = folder / "ensemble.h5"
    stored = stored_hash(path)
    if stored in (None, simulation_hash(case)):
        return None
    members = len(read_ensemble(path, config=case.source).status)
    return members if stored == simulation_hash(of_size(case, members)) else None


def model_in(case: Case) -> Model:
    """The case as a model of its own measurements, which are read from their files."""
    return model_of(case, read_observations(case))


def validation_of(case: Case, folder: Path | None = None, watch: Watch = silent) -> Model | None:
    """The case at the measurements that no calibration sees, if it names any; folder: of its results, in which runs of
    its command are kept, if it has one.
    """
    if case.validation is None:
        return None
    seen = {"experiments": case.validation.experiments, "observations": case.validation.observations}
    there = case.model_copy(update=seen)
    # An effect on a section or device that was calibrated to need not be in what was not.
    unseen = model_of(there, read_observations(there.model_copy(update={"effects": {}})))
    return unseen if folder is None else unseen_with_command(unseen, model_in(case), folder, watch)


def kept_best_fit(case: Case, folder: Path) -> Array | None:
    """Where an earlier command found that exactly this case fits best, z (p,)."""
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


def calibrated(case: Case, folder: Path, aside: pd.DataFrame, watch: Watch = silent) -> Baseline:
    """The case where it predicts best, which is kept for the next command; aside: measurements that are left out."""
    wanted = case_hash(case)
    model = with_command(model_in(case), folder, watch)
    base = calibrated_anew(model, kept_best_fit(case, folder), aside)
    keep_best_fit(case, folder, best_parameters(base), wanted)
    return base


def calibrated_anew(model: Model, known: Array | None, aside: pd.DataFrame) -> Baseline:
    """The model where it predicts best, searched from the prior, whatever ran before; from z = `known` (p,), too: where
    they end apart, the one with more evidence, as the model's own error is another at each.
    """
    model = excluding(model, aside)
    base = for_prediction(kept_baseline(model))
    if known is None or _leads_to(base, known):
        return base
    return max(base, for_prediction(baseline(model, known)), key=log_evidence)


def best_parameters(base: Baseline) -> dict[str, float]:
    """The parameters of a calibrated model by name, in their units."""
    return {name: float(value[0]) for name, value in theta_at(base.model.case, base.fitted.point.z).items()}


def _leads_to(base: Baseline, known: Array) -> bool:
    """Whether a fit from `known` ends where the base lies, or finds no flow."""
    if _same_fit(base, known):
        return True
    start = linearise_from(base.model, known, base.fitted.point)
    return start is None or _same_fit(base, fit(base.model, base.noise, start).point.z)


def _same_fit(base: Baseline, z: Array) -> bool:
    away = z - base.fitted.point.z
    return bool(away @ np.linalg.solve(base.fitted.covariance, away) < SAME_FIT**2)
