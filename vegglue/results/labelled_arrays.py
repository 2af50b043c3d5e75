"""Results as arrays with names and units: what xarray and ArviZ read from their files.

Both are an extra. Files are read whole and closed, so that a command may write them anew while a notebook is open.
"""

from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from vegglue.errors import InputError
from vegglue.results.hdf5 import open_hdf5

if TYPE_CHECKING:
    import arviz
    import xarray

ENGINE = "h5netcdf"


def read_labelled(path: Path, *groups: str) -> "xarray.Dataset":
    """Groups of a result file as one dataset, whose attributes name what they were made from: config, config_hash,
    seed, version. Errors: InputError without xarray, StorageError for a broken file.
    """
    xarray = extra_library("xarray")
    extra_library(ENGINE)
    with open_hdf5(path, "r") as file:
        stated = {name: value for name, value in file.attrs.items() if not name.startswith("_")}
    parts = [xarray.load_dataset(path, group=group, engine=ENGINE) for group in groups]
    return xarray.merge(parts).assign_attrs(stated)


def read_inference_data(path: Path) -> "arviz.InferenceData | xarray.DataTree":
    """posterior.h5 as ArviZ sees it: posterior, prior, log_likelihood and so on; a DataTree from ArviZ 1.0 on.

    Errors: as read_labelled.
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


def extra_library(name: str, extra: str = "arviz", asking: str = "vegglue.load", instead: str = "") -> Any:
    """A library that vegglue can do without. Errors: InputError, which names who asks, the extra that has it, and what
    else may be done.
    """
    try:
        module: ModuleType = import_module(name)
    except ImportError:
        remedy = f"run `pip install 'vegglue[{extra}]'`" + (f", or {instead}" if instead else "")
        raise InputError(f"{asking}: expected the library {name}, which is not installed; {remedy}.") from None
    return module
