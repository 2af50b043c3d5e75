"""What tests of files share: the ensemble of a small run, with fields or without, and what can happen to it."""

import errno
import subprocess
import sys
import textwrap
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from vegglue.results.ensemble import FieldWindow, Header
from vegglue.results.result_files import read_ensemble, read_fields
from vegglue.results.resume import EnsembleWriter, ensemble_writer

MEMBERS, CHUNKS = 12, 3
ALL = set(range(CHUNKS))
HASH = "f" * 64
X, Y = np.array([0.5, 1.5]), np.array([0.25, 0.75, 1.25])
WINDOW = FieldWindow((0.6, 1.4), slice(0, 2), X, Y)


def a_header(**changes: Any) -> Header:
    station = pd.DataFrame({
        "experiment": ["D0", "D0"], "kind": ["velocity", "level"], "section": ["D0", ""], "x": [1.0, 2.0],
        "y": [0.5, 0.5], "value": [0.4, np.nan], "standard_error": [0.01, np.nan], "used": [True, False],
        "reason": ["", "dead"], "depth": [1.1, np.nan], "device": ["A", ""],
    })  # fmt: skip
    parameters = {"z_last": np.linspace(1, 2, MEMBERS), "a_first": np.linspace(3, 4, MEMBERS)}
    header = Header(
        parameters, {"z_last": "m", "a_first": "-"}, station, ("D0",), (("D0", 1.0), ("D3", 7.0)), CHUNKS,
        "cut", "name: d0\n", HASH, 5, "0.1.0",
    )  # fmt: skip
    return replace(header, **changes)


def members_of(chunk: int) -> np.ndarray:
    return np.arange(chunk, MEMBERS, CHUNKS)[::-1]  # neither contiguous nor sorted


def rows_of(chunk: int) -> dict[str, Any]:
    members = members_of(chunk)
    return {
        "prediction": members[:, None] + np.array([0.1, 0.2]),
        "status": members % 3,
        "reason": np.array([f"Größe {member}" for member in members], object),
        "iterations": members,
        "mass_error": members * 1e-6,
        "seconds": members * 0.5,
        "section_flow": members[:, None, None] + np.zeros((1, 1, 2)),
    }


def fields_of(member: int) -> np.ndarray:
    """Level, u and v (experiment, quantity, x, y) of a member, one cell dry."""
    fields = member + np.arange(3 * X.size * Y.size).reshape(1, 3, X.size, Y.size) / 32
    fields[:, :, 0, 2] = np.nan
    return fields.astype(np.float32)


def append(writer: EnsembleWriter, chunk: int) -> None:
    """One chunk, with its fields where the run keeps them."""
    members = members_of(chunk)
    fields = None if writer.unfinished is None else np.stack([fields_of(member) for member in members])
    writer.append(chunk, members, rows_of(chunk), fields)


def write_chunks(path: Path, chunks: set[int], header: Header) -> set[int]:
    """Appends chunks to what is there; returns what was."""
    with ensemble_writer(path, header) as writer:
        done = writer.done
        for chunk in sorted(chunks - done):
            append(writer, chunk)
    return done


def assert_whole(path: Path, header: Header) -> None:
    """The ensemble, with its fields where the run keeps them, is that of its members, and nothing else is left."""
    ensemble, member = read_ensemble(path, HASH), np.arange(MEMBERS)
    assert ensemble.prediction == pytest.approx(member[:, None] + np.array([0.1, 0.2]))
    assert ensemble.status.tolist() == (member % 3).tolist()
    assert ensemble.reason.tolist() == [f"Größe {each}" for each in member]
    assert ensemble.iterations.tolist() == member.tolist()
    assert ensemble.mass_error == pytest.approx(member * 1e-6)
    assert ensemble.seconds == pytest.approx(member * 0.5)
    assert ensemble.section_flow.shape == (MEMBERS, 1, 2)
    left = {".lock", path.name}
    if header.window is not None:
        fields = read_fields(path.with_name("fields.h5"), HASH)
        for place, field in enumerate((fields.level, fields.u, fields.v)):
            np.testing.assert_array_equal(field, np.stack([fields_of(number)[:, place] for number in member]))
        left.add("fields.h5")
    assert {file.name for file in path.parent.iterdir()} == left


def start(code: str, **names: str) -> "subprocess.Popen[str]":
    """A program that finds this module, on its way."""
    program = textwrap.dedent(code).format(tests=str(Path(__file__).parent), **names)
    return subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)


def no_space(handle: int) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")
