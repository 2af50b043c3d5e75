"""A disk that is full or fills up: told with what to do, and nothing that was written is lost."""

import os
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from stored import HASH, a_header, append, no_space, write_chunks

from vegglue.errors import StorageError
from vegglue.results.result_files import read_ensemble
from vegglue.results.resume import ensemble_writer


def test_full_disk_while_appending_keeps_what_was_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "ensemble.h5"
    with ensemble_writer(path, a_header()) as writer:
        append(writer, 0)
        with monkeypatch.context() as patch:
            patch.setattr("vegglue.results.resume.os.fsync", no_space)
            with pytest.raises(StorageError, match=r"ensemble\.h5\.part: the disk is full; .* make room"):
                append(writer, 1)
    with ensemble_writer(path, a_header()) as writer:
        assert writer.done == {0}


@pytest.fixture
def full_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 256 kB, where the machine lets us mount one."""
    folder = tmp_path / "small"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True).returncode != 0:
        pytest.skip("mounting a small disk needs more rights")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_full_disk_is_told_before_the_first_member(full_disk: Path) -> None:
    path = full_disk / "ensemble.h5"
    many = np.arange(5000.0)
    with pytest.raises(StorageError, match="the disk is full"):
        write_chunks(path, set(), a_header(parameters={"a": many}, units={"a": "-"}))
    assert [file.name for file in full_disk.iterdir()] == [".lock"]


def fill_up(path: Path) -> None:
    with suppress(OSError), path.open("wb", buffering=0) as file:
        while file.write(bytes(4096)):
            pass
    assert os.statvfs(path.parent).f_bavail == 0


def test_disk_that_fills_up_later_cannot_stop_a_run(full_disk: Path) -> None:
    path = full_disk / "ensemble.h5"
    with ensemble_writer(path, a_header()) as writer:
        append(writer, 0)
        fill_up(full_disk / "other")
        append(writer, 1)
        append(writer, 2)
    assert read_ensemble(path, HASH).status.tolist() == [member % 3 for member in range(12)]
