"""Raw files of instruments through mhkit, which carries on dolfyn; an optional library, imported here only."""

import io
import warnings
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

from vegglue.errors import InputError, shown_path
from vegglue.importers.library_files import refuse_larger


def opened_raw(path: Path, instead: str, most: int | None = None) -> Any:
    """The dataset that mhkit makes of a raw file. instead: what else may be exported, in words; most: samples that it
    can hold, where the reader's own guess is too small.

    Errors: InputError without mhkit, and for what it cannot read.
    """
    try:
        from mhkit import dolfyn
    except ImportError:
        raise InputError(
            f"{shown_path(path)}: raw files of instruments are read by mhkit, which is not installed; run "
            f"`pip install 'vegglue[instruments]'`, or export {instead}."
        ) from None
    refuse_larger(path, path.stat().st_size)
    data, problem = None, ""
    with redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the reader leaves files open, and warns of what is of no use here
        try:
            data = dolfyn.read(str(path), userdata=False, nens=most)
        except Exception as error:  # what breaks on a damaged file is of any kind
            problem = f"{type(error).__name__}: {error}"
    if data is None or problem:
        raise InputError(f"{shown_path(path)} cannot be read ({problem}); export {instead}.")
    return data


def turned_to_earth(path: Path, data: Any) -> Any:
    """The dataset with its velocities east, north and up. Errors: InputError where the reader cannot turn them."""
    from mhkit import dolfyn

    if data.attrs["coord_sys"] == "earth":
        return data
    try:
        return dolfyn.rotate2(data, "earth", inplace=False)
    except Exception as error:  # as above
        raise InputError(
            f"{shown_path(path)}: velocities cannot be turned to the earth ({type(error).__name__}: {error}); export "
            "them in earth coordinates."
        ) from None
