"""Results as files: ensemble.h5, fields.h5, posterior.h5, flow.h5 and diagnosis.h5, each with its config.

A file whose config hash is not the wanted one is refused with the command that makes it again. Ensembles are written by
`resume`, member by member.
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from vegglue.errors import InputError, StorageError, shown_command
from vegglue.flow.sensor import FlowFields
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.diagnosis_file import diagnosis_attributes, diagnosis_from, diagnosis_groups
from vegglue.results.ensemble import Ensemble, Fields, ensemble_from, fields_from
from vegglue.results.hdf5 import UNREADABLE, open_hdf5, read_groups, stored_attribute, write_whole
from vegglue.results.layout import Group, Stored, Variable, fitting, names_of
from vegglue.results.posterior import Posterior, posterior_attributes, posterior_from, posterior_groups
from vegglue.results.resume import part_file
from vegglue.wording.remedies import KEEP_FIELDS

# Fields at cell centres, in units of FlowFields.
FIELD_UNITS_KEPT = {"bed": "m", "depth": "m", "level": "m", "u": "m/s", "v": "m/s"}


def flow_groups(flow: Mapping[str, FlowFields]) -> dict[str, Group]:
    """The groups of flow.h5, from fields by experiment, of which there is at least one."""
    first = next(iter(flow.values()))
    coordinates = {"experiment": np.array(list(flow), object), "x": first.x, "y": first.y}
    values = {
        name: Variable(("experiment", "x", "y"), np.stack([getattr(one, name) for one in flow.values()]), unit)
        for name, unit in FIELD_UNITS_KEPT.items()
    }
    return {"flow": Group(coordinates, values, {"x": "m", "y": "m"})}


def flow_attributes(theta: Mapping[str, float]) -> dict[str, str]:
    """The parameters the flow was solved with."""
    return {"theta": json.dumps({name: float(value) for name, value in theta.items()}, sort_keys=True)}


def flow_from(groups: Mapping[str, Mapping[str, Any]]) -> dict[str, FlowFields]:
    """The fields by experiment of a file with these groups."""
    at_cells = dict.fromkeys(FIELD_UNITS_KEPT, Stored(("experiment", "x", "y")))
    kept = fitting(groups["flow"], at_cells | {"x": Stored(("x",)), "y": Stored(("y",))})
    return {
        experiment: FlowFields(kept["x"], kept["y"], **{name: kept[name][place] for name in FIELD_UNITS_KEPT})
        for place, experiment in enumerate(names_of(kept, "experiment"))
    }


POSTERIOR_FORMAT, DIAGNOSIS_FORMAT, FLOW_FORMAT = "vegglue posterior 1", "vegglue diagnosis 9", "vegglue flow 1"
Result = TypeVar("Result")


def read_ensemble(path: Path, expected_hash: str | None = None, config: Path | None = None) -> Ensemble:
    """Read a finished ensemble.

    Parameters
    ----------
    path : Path
        `ensemble.h5`.
    expected_hash : str, optional
        That of the config which the ensemble has to be of.
    config : Path, optional
        The file of the case, for the command that a refusal names.

    Raises
    ------
    InputError
        If there is none, or it was made from another config.
    StorageError
        If the file is broken.
    """
    if not path.exists() and part_file(path).exists():
        command = _made_by("simulate", config, path)
        raise InputError(f"{path}: found only a part of the members; run {command} to solve the rest.")
    return _read(path, expected_hash, _made_by("simulate", config, path), ensemble_from)


def read_fields(path: Path, expected_hash: str | None = None) -> Fields:
    """Read the fields of a finished ensemble, whole.

    Parameters
    ----------
    path : Path
        `fields.h5`.
    expected_hash : str, optional
        That of the config which they have to be of.

    Returns
    -------
    Fields
        Arrays (member, experiment, x, y), which `results.ensemble.predict_at` reads at a point.

    Raises
    ------
    InputError, StorageError
        As `read_ensemble`.
    """
    if not path.exists():
        remedy = KEEP_FIELDS.format(shown_command("simulate", None))
        raise InputError(f"{path}: expected fields of the members, found no file; {remedy}.")
    return _read(path, expected_hash, shown_command("simulate", None), fields_from)


def write_posterior(path: Path, posterior: Posterior, config: str, config_hash: str) -> None:
    """Write a posterior with its config, replacing an older file only when it is whole.

    Parameters
    ----------
    path : Path
        `posterior.h5`.
    config : str
        The resolved config that it was inferred under, as YAML.
    config_hash : str
        Of that config and its data.

    Raises
    ------
    StorageError
        If it cannot be written.
    """
    own = {"config": config, "config_hash": config_hash, "format": POSTERIOR_FORMAT}
    write_whole(path, posterior_groups(posterior), posterior_attributes(posterior) | own)


def read_posterior(path: Path, expected_hash: str | None = None, config: Path | None = None) -> Posterior:
    """Read a posterior.

    Parameters
    ----------
    path, expected_hash, config
        `posterior.h5`, and as `read_ensemble`.

    Raises
    ------
    InputError, StorageError
        As `read_ensemble`, for `vegglue infer`.
    """
    return _read(path, expected_hash, _made_by("infer", config, path), posterior_from)


def write_diagnosis(path: Path, diagnosis: Diagnosis, config: str, config_hash: str) -> None:
    """Write a diagnosis with its config, replacing an older file only when it is whole.

    Parameters
    ----------
    path : Path
        `diagnosis.h5`.
    config, config_hash
        As `write_posterior`.

    Raises
    ------
    StorageError
        If it cannot be written.
    """
    own = {"config": config, "config_hash": config_hash, "format": DIAGNOSIS_FORMAT}
    write_whole(path, diagnosis_groups(diagnosis), diagnosis_attributes(diagnosis) | own)


def read_diagnosis(path: Path, expected_hash: str | None = None) -> Diagnosis:
    """Read a diagnosis.

    Parameters
    ----------
    path, expected_hash
        `diagnosis.h5`, and as `read_ensemble`.

    Raises
    ------
    InputError, StorageError
        As `read_ensemble`, for `vegglue diagnose`.
    """
    return _read(path, expected_hash, shown_command("diagnose", None), diagnosis_from)


def diagnosis_that_fits(path: Path, config_hash: str) -> Diagnosis | None:
    """The diagnosis of exactly this config, if it is kept.

    Parameters
    ----------
    path : Path
        `diagnosis.h5`.
    config_hash : str
        That of the config which it has to be of.

    Returns
    -------
    Diagnosis or None
        None without one, or with one of another config or format.
    """
    fits = stored_hash(path) == config_hash and stored_attribute(path, "format") == DIAGNOSIS_FORMAT
    return read_diagnosis(path) if fits else None


def write_flow(
    path: Path, flow: Mapping[str, FlowFields], theta: Mapping[str, float], config: str, config_hash: str
) -> None:
    """Write the flow of all experiments with its config.

    Parameters
    ----------
    path : Path
        `flow.h5`.
    flow : mapping of str to FlowFields
        By experiment.
    theta : mapping of str to float
        The parameters that it was solved with [their units].
    config, config_hash
        As `write_posterior`.

    Raises
    ------
    StorageError
        If it cannot be written.
    """
    own = {"config": config, "config_hash": config_hash, "format": FLOW_FORMAT}
    write_whole(path, flow_groups(flow), flow_attributes(theta) | own)


def flow_that_fits(path: Path, config_hash: str, theta: Mapping[str, float]) -> dict[str, FlowFields] | None:
    """The flow of exactly this config and these parameters, if it is kept.

    Parameters
    ----------
    path : Path
        `flow.h5`.
    theta : mapping of str to float
        [their units]

    Returns
    -------
    dict of str to FlowFields, or None
        By experiment.
    """
    wanted = flow_attributes(theta) | {"config_hash": config_hash, "format": FLOW_FORMAT}
    if any(stored_attribute(path, name) != value for name, value in wanted.items()):
        return None
    try:
        with open_hdf5(path, "r") as file:
            return flow_from(read_groups(file))
    except UNREADABLE:
        return None


def stored_hash(path: Path) -> str | None:
    """Config hash a result file was made from, or None when there is no readable file."""
    return stored_attribute(path, "config_hash")


def _made_by(verb: str, config: Path | None, path: Path) -> str:
    """The command that makes a result, into the folder of runs where it was looked for."""
    runs = path.parent.parent
    return shown_command(verb, config, *(["--runs", str(runs)] if config is not None and runs != Path("runs") else []))


def _read(path: Path, expected_hash: str | None, command: str, understand: Callable[..., Result]) -> Result:
    remedy = f"run {command}"
    if not path.exists():
        raise InputError(f"{path}: expected the result of an earlier step, found no file; {remedy}.")
    with open_hdf5(path, "r") as file:
        try:
            stated = dict(file.attrs)
            found = str(stated.get("config_hash", "none"))
            wanted = found if expected_hash is None else expected_hash
            if found == wanted:
                return understand(read_groups(file), stated)
        except UNREADABLE as error:
            raise StorageError(f"{path}: is broken or of another version ({error}); remove it and {remedy}.") from error
    raise InputError(
        f"{path}: expected config hash {wanted[:12]}, found {found[:12]}: the config, --members, a file "
        f"it names or vegglue changed since this was made; {remedy} again."
    )
