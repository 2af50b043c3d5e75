"""Raw files of instruments through mhkit, which carries on dolfyn; an optional library, imported here only."""

import io
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

from vegglue.errors import InputError, shown_path
from vegglue.importers.library_files import read_by_library


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
    told = redirect_stdout(io.StringIO())
    with told, read_by_library(path, "a raw file of an instrument", advice=f"export {instead}"):
        return dolfyn.read(str(path), userdata=False, nens=most)


def turned_to_earth(path: Path, data: Any) -> Any:
    """The dataset with its velocities east, north and up. Errors: InputError where the reader cannot turn them."""
    from mhkit import dolfyn

    if data.attrs["coord_sys"] == "earth":
        return data
    with read_by_library(path, "velocities to be turned to the earth", advice="export them in earth coordinates"):
        return dolfyn.rotate2(data, "earth", inplace=False)
