"""Results as arrays with names and units: what xarray and ArviZ read from their files.

Both are an extra. Files are read whole and closed, so that a command may write them anew while a notebook is open.
"""

import re
from collections.abc import Mapping
from importlib import import_module
from itertools import chain
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from vegglue.errors import InputError
from vegglue.flow.status import STATUS_WORDS
from vegglue.results.hdf5 import open_hdf5

if TYPE_CHECKING:
    import arviz
    import xarray

ENGINE = "h5netcdf"


def read_labelled(path: Path, *groups: str) -> "xarray.Dataset":
    """Groups of a result file as one dataset.

    Returns
    -------
    xarray.Dataset
        Its attributes state what it was made from: config, config_hash, seed, version.

    Raises
    ------
    InputError
        Without xarray.
    StorageError
        For a broken file.
    """
    xarray = extra_library("xarray")
    extra_library(ENGINE)
    with open_hdf5(path, "r") as file:
        stated = {name: value for name, value in file.attrs.items() if not name.startswith("_")}
    parts = [xarray.load_dataset(path, group=group, engine=ENGINE) for group in groups]
    return xarray.merge(parts).assign_attrs(stated)


def read_inference_data(path: Path) -> "arviz.InferenceData | xarray.DataTree":
    """posterior.h5 as ArviZ sees it: posterior, prior, log_likelihood and so on; a DataTree from ArviZ 1.0 on.

    Raises
    ------
    InputError, StorageError
        As `read_labelled`.
    """
    arviz = extra_library("arviz")
    extra_library(ENGINE)
    with open_hdf5(path, "r"):
        pass  # it is whole; closed again, since the libraries below open it with locks
    if int(arviz.__version__.split(".")[0]) >= 1:
        with extra_library("xarray").open_datatree(path, engine=ENGINE) as tree:
            return tree.load()
    with arviz.rc_context({"data.load": "eager"}):
        return arviz.from_netcdf(path, engine=ENGINE)


# What CF calls our units, none of which has a power that is no whole number; and its standard names of variables and
# coordinates, by name and unit.
CF_UNITS = {"-": "1"}
CF_STANDARD_NAMES = {
    ("member", ""): "realization",
    ("x", "m"): "projection_x_coordinate",
    ("y", "m"): "projection_y_coordinate",
    ("level", "m"): "water_surface_height_above_reference_datum",
    ("section_flow", "m3/s"): "water_volume_transport_in_river_channel",
    ("status", ""): "status_flag",
}
CF_CONVENTIONS = "CF-1.11"


def as_tree(parts: "Mapping[str, xarray.Dataset]") -> "xarray.DataTree":
    """Results as one tree of groups, with the names and units of the CF conventions.

    Each variable has a `long_name`, `units` that UDUNITS reads, and a `standard_name` if CF has one. A unit that CF
    does not know, or that differs between stations, stands in its `comment`.

    Parameters
    ----------
    parts : mapping of xarray.Dataset
        By the name of the group.

    Raises
    ------
    InputError
        Without xarray.
    """
    groups = {name: part.copy() for name, part in parts.items()}
    for name, variable in chain.from_iterable(part.variables.items() for part in groups.values()):
        attributes = dict(variable.attrs)
        unit = str(attributes.pop("units", ""))
        if " for " in unit or unit.startswith("that of") or "^(" in unit:
            attributes["comment"] = f"units: {unit}"
        elif unit and variable.dtype.kind in "fiu":
            attributes["units"] = CF_UNITS.get(unit, unit)
        attributes["long_name"] = str(name).replace("_", " ")
        bare = "" if unit == "-" else unit
        if standard := CF_STANDARD_NAMES.get((str(name), bare)):
            attributes["standard_name"] = standard
        if name == "status":
            attributes |= {
                "flag_values": np.array(list(STATUS_WORDS), np.int8),
                "flag_meanings": " ".join(re.sub(r"\W+", "_", words) for words in STATUS_WORDS.values()),
            }
        variable.attrs = attributes
    tree = extra_library("xarray").DataTree.from_dict(groups)
    tree.attrs["Conventions"] = CF_CONVENTIONS
    return tree


def extra_library(name: str, extra: str = "arviz", asking: str = "vegglue.load", instead: str = "") -> Any:
    """A library that vegglue can do without.

    Parameters
    ----------
    extra : str
        That has it.
    asking : str
        What needs it, for the message.
    instead : str
        What else may be done, for the message.

    Returns
    -------
    module

    Raises
    ------
    InputError
        If it is not installed.
    """
    try:
        module: ModuleType = import_module(name)
    except ImportError:
        remedy = f"run `pip install 'vegglue[{extra}]'`" + (f", or {instead}" if instead else "")
        raise InputError(f"{asking}: expected the library {name}, which is not installed; {remedy}.") from None
    return module
