"""folder of a run -> what lies there, as xarray and ArviZ know it: for notebooks, from any step of the line."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import pandas as pd

from vegglue.errors import InputError, shown_command
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.labelled_arrays import as_tree, read_inference_data, read_labelled
from vegglue.results.result_files import read_diagnosis
from vegglue.wording.numbers import in_short, in_short_html, so_many

if TYPE_CHECKING:
    import arviz
    import xarray

FILES = ("ensemble.h5", "fields.h5", "posterior.h5", "diagnosis.h5")
Read = TypeVar("Read")


@dataclass(frozen=True)
class LoadedRun:
    """All results in the folder of a run; None for a step that was not done.

    Each dataset has the config, seed and version as attributes, and `units` of its variables.

    Attributes
    ----------
    ensemble : xarray.Dataset or None
        All members: parameters, prediction (member, station), status, reason, mass_error.
    fields : xarray.Dataset or None
        level [m], u and v [m/s], each (member, experiment, x, y), if the case keeps fields.
    members : xarray.Dataset or None
        Of the posterior: theta (parameter, member), weights and what follows from them.
    posterior : arviz.InferenceData or xarray.DataTree or None
        Draws of equal weight, with the groups prior, log_likelihood, posterior_predictive and others.
    stations : DataFrame or None
        One row for each measurement.
    """

    folder: Path
    ensemble: "xarray.Dataset | None"
    fields: "xarray.Dataset | None"
    members: "xarray.Dataset | None"
    posterior: "arviz.InferenceData | xarray.DataTree | None"
    diagnosis: Diagnosis | None
    stations: pd.DataFrame | None

    @property
    def tree(self) -> "xarray.DataTree":
        """All of it as one DataTree with the names and units of the CF conventions: the groups ensemble, fields,
        members, stations and, of the draws of equal weight, posterior, prior and so on.
        """
        parts = {name: getattr(self, name) for name in ("ensemble", "fields", "members")}
        if self.stations is not None:
            parts["stations"] = self.stations.to_xarray()
        if self.posterior is not None:
            groups = self.posterior.groups
            names = groups() if callable(groups) else [name.strip("/") for name in groups]
            parts |= {name: self.posterior[name] for name in names if name and name not in parts}
        return as_tree({name: dataset_of(part) for name, part in parts.items() if part is not None})

    def _repr_html_(self) -> str:
        return in_short_html(repr(self))

    def __repr__(self) -> str:
        sized = {name: getattr(self, name) for name in ("ensemble", "fields", "members")}
        lines = [
            f"{name}: {', '.join(so_many(size, str(dim)) for dim, size in data.sizes.items())}"
            for name, data in sized.items()
            if data is not None
        ]
        if self.posterior is not None:
            drawn = self.posterior["posterior"]
            lines.append(f"posterior: {', '.join(map(str, drawn.data_vars))}")
        if self.diagnosis is not None:
            lines.append(f"diagnosis: {self.diagnosis.verdict.kind}. {self.diagnosis.verdict.sentence}")
        if self.stations is not None:
            lines.append(f"stations: {len(self.stations):,} rows")
        return in_short(f"Run in {self.folder}", lines)


def dataset_of(part: Any) -> "xarray.Dataset":
    """A dataset as it is, or that of a node of a tree."""
    return part.to_dataset() if hasattr(part, "to_dataset") else part


def load(folder: Path | str) -> LoadedRun:
    """Read all results in the folder of a run, such as runs/brook.

    Parameters
    ----------
    folder : Path or str

    Returns
    -------
    LoadedRun

    Raises
    ------
    InputError
        If there are none, or if xarray or ArviZ is not installed.
    StorageError
        If a file is damaged.
    """
    folder = Path(folder)
    there = {name for name in FILES if (folder / name).exists()}
    if not there:
        raise InputError(
            f"{folder}: expected results of a run ({', '.join(FILES)}), found none; check the folder, or run "
            f"{shown_command('simulate', None)}."
        )

    def read(name: str, how: Callable[..., Read], *groups: str) -> Read | None:
        return how(folder / name, *groups) if name in there else None

    stated = next((name for name in ("posterior.h5", "ensemble.h5") if name in there), None)
    return LoadedRun(
        folder=folder,
        ensemble=read("ensemble.h5", read_labelled, "members", "parameters"),
        fields=read("fields.h5", read_labelled, "fields"),
        members=read("posterior.h5", read_labelled, "members"),
        posterior=read("posterior.h5", read_inference_data),
        diagnosis=read("diagnosis.h5", read_diagnosis),
        stations=None if stated is None else read_labelled(folder / stated, "stations").to_dataframe(),
    )
