"""A result file of another model, read by the reader of its format; in a process of its own first."""

from pathlib import Path

from vegglue.errors import InputError
from vegglue.importers.delft3d_trim import read_delft3d_trim
from vegglue.importers.hec_ras import read_hec_ras
from vegglue.importers.library_files import read_by_library
from vegglue.importers.model_result import ModelResult, netcdf_variables
from vegglue.importers.selafin import looks_like_selafin, read_selafin
from vegglue.importers.ugrid import read_ugrid
from vegglue.sandboxed_reader import why_unreadable

# Largest file that is read [bytes]. Chosen: results of long runs are large, and of these only the final state is read.
LARGEST_RESULT = 50_000_000_000
# Endings of files that may hold a result, besides what stands in them.
ENDINGS = (".hdf", ".slf", ".nc", ".res")
HDF5, NETCDF = b"\x89HDF", b"CDF"
IN_ITS_PROCESS = f"{__name__}:why_no_result"


def holds_result(path: Path) -> bool:
    """Whether a file of a folder is a finished result of a model, by its name and its first bytes."""
    if path.suffix.lower() not in ENDINGS or not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(4)
    return head == HDF5 or head[:3] == NETCDF or looks_like_selafin(path)


def read_result(path: Path) -> ModelResult:
    """The final state in a result file of HEC-RAS 2D, TELEMAC-2D, D-Flow FM, Delft3D-4, or on a UGRID mesh.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    ModelResult
        In SI units.

    Raises
    ------
    InputError
        If the file is of another format, damaged, or lacks what is needed.
    StorageError
        If no process can be started to read it.
    """
    try:
        state = path.stat()
    except OSError as error:
        raise InputError("unreadable", file=path, why=error.strerror) from None
    if state.st_size > LARGEST_RESULT:
        raise InputError("file_too_large", file=path, most=LARGEST_RESULT, got=state.st_size, result=True)
    why = why_unreadable(path.absolute(), min(state.st_size, 10**9), state.st_mtime_ns, by=IN_ITS_PROCESS)
    if why is not None:
        raise InputError("unreadable_as", file=path, kind="result", why=why)
    return _read(path)


def _read(path: Path) -> ModelResult:
    with path.open("rb") as file:
        head = file.read(4)
    if looks_like_selafin(path):
        return read_selafin(path)
    if head != HDF5 and head[:3] != NETCDF:
        raise InputError("no_result", file=path, mesh=True)
    with read_by_library(path, "result", limit=LARGEST_RESULT):
        with netcdf_variables(path) as variables:
            names = set(variables)
            mesh = any(one.text("cf_role") == "mesh_topology" for one in variables.values())
        if mesh:
            return read_ugrid(path)
        if {"U1", "V1", "S1"} <= names:
            return read_delft3d_trim(path)
        if path.suffix.lower() == ".nc":
            raise InputError("no_result", file=path, mesh=False)
        return read_hec_ras(path)


def why_no_result(path: str) -> str | None:
    """Read a result and drop what comes: None, as the next reader meets its errors, which harm nothing."""
    try:
        _read(Path(path))
    except MemoryError:
        raise
    except Exception:  # on damaged files libraries raise anything
        return None
    return None
