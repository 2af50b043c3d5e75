"""Files read within limits: text of any encoding, files of libraries, MATLAB files and raw records of instruments.

Whatever a library makes of a damaged file, and however many numbers a small file unpacks to, the user reads one
sentence.
"""

import codecs
import io
import json
import logging
import re
import struct
import traceback
import warnings
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import mat_struct

from vegglue.arrays import Array
from vegglue.case.size_limits import LARGEST_DATA
from vegglue.errors import InputError
from vegglue.sandboxed_reader import why_unreadable

COMPRESSED, AT_ONCE_UNPACKED = 15, 1 << 20  # type of an element of a MATLAB file; [bytes]
LONGEST_COMPLAINT = 200  # letters of a library's complaint; some quote the file
MATLAB_READER = f"{__name__}:unpack_matlab"  # as the process of its own knows it
MATLAB_5 = "MATLAB 5"
# How files begin that are no table, up to so much of them [bytes]; what they are, and as what a program saves them.
POINTS, CAD_MAP, WORKBOOK = "points", "drawn", "workbook"
LONGEST_BEGINNING = 1000
FOREIGN = (
    (rb"LASF", "a point cloud (LAS, LAZ)", POINTS), (rb"ASTM-E57", "a point cloud (E57)", POINTS),
    (rb"ply\r?\n", "a point cloud (PLY)", POINTS), (rb"AC10\d\d", "a drawing (DWG)", CAD_MAP),
    (rb"(999\r?\n.*\r?\n\s*)?0\r?\n\s*SECTION", "a drawing (DXF)", CAD_MAP),
    (rb"SQLite format 3", "a GeoPackage", CAD_MAP), (rb"(<\?xml[^>]*>\s*)?<kml", "a KML", CAD_MAP),
    (rb"(<\?xml[^>]*>\s*)?<gpx", "a GPX track", CAD_MAP), (rb"(<\?xml[^>]*>\s*)?<LandXML", "a LandXML", CAD_MAP),
    (rb"\xd0\xcf\x11\xe0", "a workbook of Excel 97 (.xls)", WORKBOOK), (rb"PK\x03\x04", "a packed file", WORKBOOK),
    (rb"%PDF", "a PDF", WORKBOOK), (rb"PAR1", "a Parquet file", WORKBOOK),
    (rb"\*?11\d{4}[+-]", "a record of a Leica (GSI)", WORKBOOK), (rb"<[?!a-zA-Z]", "an XML", WORKBOOK),
)  # fmt: skip


def refuse_foreign_format(path: Path) -> None:
    """InputError for a file that begins as one of FOREIGN: what it is, and as what to save it."""
    try:
        with path.open("rb") as file:
            begin = file.read(LONGEST_BEGINNING).removeprefix(codecs.BOM_UTF8).lstrip()
    except OSError as error:
        raise InputError("unreadable", file=path, why=error.strerror) from None
    for mark, name, instead in FOREIGN:
        if re.match(mark, begin):
            raise InputError("foreign_format", file=path, name=name, instead=instead)


def readable_text(path: Path) -> str:
    """The text of a file: UTF-8, UTF-16 with its mark, or what Windows in the west writes.

    Raises
    ------
    InputError
        If the file is too large, or cannot be read.
    """
    try:
        size = path.stat().st_size
        raw = path.read_bytes() if size <= LARGEST_DATA else b""
    except OSError as error:
        raise InputError("unreadable", file=path, why=error.strerror) from None
    refuse_larger(path, size)
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16", errors="replace")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace")


def refuse_larger(path: Path, size: int) -> None:
    """InputError if what a file holds, packed or unpacked, is more than a file of data may be [bytes]."""
    if size > LARGEST_DATA:
        raise InputError("file_too_large", file=path, most=LARGEST_DATA, got=size, result=False)


@contextmanager
def read_by_library(path: Path, kind: str, logger: str = "", limit: int = LARGEST_DATA) -> Iterator[None]:
    """Within, a library reads a file: its warnings and its log are not shown.

    Parameters
    ----------
    kind : str
        What the file should be.
    logger : str
        Of the library, if it has one.
    limit : int
        Of the size of the file [bytes].

    Raises
    ------
    InputError
        In place of every error of the library.
    """
    log = logging.getLogger(logger) if logger else None
    before = None if log is None else log.disabled
    try:
        if (size := path.stat().st_size) > limit:
            refuse_larger(path, size)
        if log is not None:
            log.disabled = True
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                yield
            except Exception as error:  # what the library leaves open is closed while its warnings are not shown
                traceback.clear_frames(error.__traceback__)
                raise
    except (InputError, MemoryError):
        raise
    except Exception as error:  # on damaged files libraries raise anything
        lines = str(error).splitlines() or [type(error).__name__]
        complaint = lines[0][:LONGEST_COMPLAINT]
        raise InputError("unreadable_as", file=path, kind=kind, why=complaint) from None
    finally:
        if log is not None and before is not None:
            log.disabled = before


@contextmanager
def importing(library: str, path: Path, extra: str, instead: str) -> Iterator[None]:
    """Within, a library of an extra is imported.

    Parameters
    ----------
    instead : str
        As what else the file may be saved.

    Raises
    ------
    InputError
        Naming the extra, if the library is not installed.
    """
    try:
        yield
    except ImportError:
        raise InputError("library_missing", file=path, library=library, extra=extra, instead=instead) from None


def load_matlab(path: Path, kind: str = MATLAB_5, names: Sequence[str] | None = None) -> dict[str, Any]:
    """The variables of a MATLAB file of version 5, structures as objects with attributes.

    A process of its own reads the file, which damage may make crash, and hands over plain arrays.

    Parameters
    ----------
    path
        The file.
    kind
        What it should be, for messages.
    names
        Of variables that are read alone, as arrays of two or more dimensions.

    Raises
    ------
    InputError
        If the file is too large or damaged, or lacks one of the names.
    StorageError
        If no process can be started.
    """
    with read_by_library(path, kind), TemporaryDirectory() as folder:
        _refuse_larger_matlab(path)
        copy = Path(folder) / "read.mat"
        copy.write_bytes(path.read_bytes())
        if (why := why_unreadable(copy, copy.stat().st_size, by=MATLAB_READER)) is not None:
            raise ValueError(why)
        with np.load(copy.with_suffix(".npz"), allow_pickle=False) as arrays:
            tree = json.loads(str(arrays["tree"]))

            def built(node: Any) -> Any:
                if "fields" in node:
                    return SimpleNamespace(**{name: built(one) for name, one in node["fields"].items()})
                if "cells" in node:
                    cells = np.empty(len(node["cells"]), dtype=object)
                    for place, one in enumerate(node["cells"]):
                        cells[place] = built(one)
                    return cells.reshape(node["shape"])
                return arrays[node["array"]][()]

            if names is None:
                return {name: built(node) for name, node in tree["variables"].items()}
            return {name: np.asarray(arrays[tree["whole"][name]], dtype=np.float64) for name in names}


def _refuse_larger_matlab(path: Path) -> None:
    """InputError if the variables of a MATLAB file of version 5 unpack to more than a file of data may be.

    Format: MAT-File Format (MathWorks): a header of 128 bytes that ends in the order of bytes, then elements, each with
    its type and its size; those of type 15 are packed by deflate.
    """
    with path.open("rb") as file:
        order = "<" if file.read(128)[126:] == b"IM" else ">"
        total = 0
        while len(head := file.read(8)) == 8:
            kind, size = struct.unpack(f"{order}II", head)
            rest = file.read(size)
            total += len(rest)
            unpacker = zlib.decompressobj()
            while kind == COMPRESSED and rest and not unpacker.eof:
                total += len(unpacker.decompress(rest, AT_ONCE_UNPACKED))
                rest = unpacker.unconsumed_tail
                refuse_larger(path, total)


def unpack_matlab(path: str) -> None:
    """Write the arrays of a MATLAB file into an .npz beside it, with a tree of its structures and cells."""
    arrays: dict[str, Any] = {}

    def kept(value: Any) -> Any:
        if isinstance(value, mat_struct):
            return {"fields": {name: kept(getattr(value, name)) for name in value._fieldnames}}
        found = np.asarray(value)
        if found.dtype == object:
            return {"cells": [kept(one) for one in found.ravel()], "shape": found.shape}
        name = f"a{len(arrays)}"
        arrays[name] = found if found.dtype.kind in "biufUS" else np.zeros(0)
        return {"array": name}

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        variables = loadmat(path, struct_as_record=False, squeeze_me=True)
        tree: dict[str, Any] = {"variables": {name: kept(one) for name, one in variables.items()}, "whole": {}}
        for name, one in loadmat(path).items():
            if isinstance(one, np.ndarray) and one.dtype.kind in "biuf":
                tree["whole"][name] = kept(one)["array"]
    np.savez(Path(path).with_suffix(".npz"), tree=np.array(json.dumps(tree)), **arrays)


@contextmanager
def reading_structures(path: Path, kind: str) -> Iterator[None]:
    """Within, structures of a file are read.

    Parameters
    ----------
    kind : str
        Whose structures.

    Raises
    ------
    InputError
        For whatever they lack.
    """
    try:
        yield
    except InputError:
        raise
    except (AttributeError, IndexError, ValueError, TypeError, KeyError) as error:
        raise InputError("other_structures", file=path, kind=kind, why=str(error)) from None


def numbers_of_variable(values: Any) -> Array:
    """A variable as numbers, a single one as an array of one."""
    return np.atleast_1d(np.asarray(values, dtype=np.float64))


def open_raw(path: Path, program: str, most: int | None = None, named: Path | None = None) -> Any:
    """The dataset that mhkit, which carries on dolfyn, makes of a raw file.

    Parameters
    ----------
    program : str
        That of the maker, which can export ASCII.
    most : int, optional
        Samples that the file can hold, where the reader's own guess is too small.
    named : Path, optional
        The file that it is a copy of.

    Raises
    ------
    InputError
        Without mhkit, and for what it cannot read.
    """
    named = named or path
    with importing("mhkit", named, "instruments", f"ASCII by {program}"):
        from mhkit import dolfyn
    with redirect_stdout(io.StringIO()), read_by_library(named, program):
        return dolfyn.read(str(path), userdata=False, nens=most)
