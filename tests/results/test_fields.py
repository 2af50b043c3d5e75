"""Fields on disk: no kill, no full disk and no lost file parts them from the ensemble they belong to."""

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import pytest
from stored import (
    ALL,
    HASH,
    MEMBERS,
    WINDOW,
    X,
    Y,
    a_header,
    append,
    assert_whole,
    fields_of,
    members_of,
    no_space,
    rows_of,
    write_chunks,
)

from vegglue.errors import InputError, StorageError
from vegglue.results.ensemble import FieldWindow, fields_group
from vegglue.results.result_files import read_fields
from vegglue.results.resume import ensemble_writer

HEADER = a_header(window=WINDOW)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "runs" / "d0" / "ensemble.h5"


def test_fields_come_back_as_they_went(path: Path) -> None:
    write_chunks(path, ALL, HEADER)
    assert_whole(path, HEADER)
    fields = read_fields(path.with_name("fields.h5"))
    assert (fields.experiments, fields.range, fields.config_hash) == (("D0",), (0.6, 1.4), HASH)
    assert (fields.x.tolist(), fields.y.tolist()) == (X.tolist(), Y.tolist())


def test_the_file_is_single_precision_compressed_and_opened_by_xarray(path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    write_chunks(path, ALL, HEADER)
    with h5py.File(path.with_name("fields.h5")) as file:
        for name in ("level", "u", "v"):
            stored = file["fields"][name]
            assert (stored.dtype, stored.compression, stored.shuffle) == (np.float32, "gzip", True)
            assert stored.chunks == (MEMBERS, 1, 2, 3)
        assert {"config", "config_hash", "seed", "version", "format"} <= set(file.attrs)
    with xarray.open_dataset(path.with_name("fields.h5"), group="fields", engine="h5netcdf") as data:
        assert set(data.data_vars) == {"level", "u", "v"}
        assert data.u.dims == ("member", "experiment", "x", "y")
        assert [data[name].attrs["units"] for name in ("level", "u", "v", "x", "y")] == ["m", "m/s", "m/s", "m", "m"]
        assert float(data.v.sel(member=5, experiment="D0", x=1.5, y=0.75)) == fields_of(5)[0, 2, 1, 1]


def test_large_fields_are_compressed_in_batches_of_members() -> None:
    window = FieldWindow((0, 9), slice(0, 100), np.arange(100.0), np.arange(50.0))
    group = fields_group(window, ("D0",), np.zeros((400, 1, 3, 100, 50), np.float32))
    assert group.variables["u"].compressed == (52, 1, 100, 50)


def test_without_a_window_no_fields_are_written(path: Path) -> None:
    write_chunks(path, ALL, a_header())
    with pytest.raises(InputError, match=r"fields\.h5: .* state in `simulate\.fields` where .* run `vegglue simulate"):
        read_fields(path.with_name("fields.h5"))


def test_fields_of_another_config_are_refused(path: Path) -> None:
    write_chunks(path, ALL, HEADER)
    with pytest.raises(InputError, match="run `vegglue simulate CONFIG` again"):
        read_fields(path.with_name("fields.h5"), "e" * 64)


def test_rows_without_their_fields_are_refused(path: Path) -> None:
    with ensemble_writer(path, HEADER) as writer:
        with pytest.raises(ValueError, match="expected fields"):
            writer.append(0, members_of(0), rows_of(0))
        with pytest.raises(ValueError, match="expected fields of shape"):
            writer.append(0, members_of(0), rows_of(0), np.zeros((4, 1, 3, 2, 2), np.float32))
        assert writer.done == set()


@pytest.mark.parametrize("allowed", [0, 1])
def test_fields_are_on_disk_before_their_chunk_is_finished(
    path: Path, monkeypatch: pytest.MonkeyPatch, allowed: int
) -> None:
    """The disk fills up at the first flush of a chunk, that of the fields, or at the second, that of the rows."""
    flushed: list[int] = []

    def fill_up(handle: int) -> None:
        flushed.append(handle)
        if len(flushed) > allowed:
            no_space(handle)

    with ensemble_writer(path, HEADER) as writer:
        append(writer, 0)
        with monkeypatch.context() as patch:
            patch.setattr("os.fsync", fill_up)
            with pytest.raises(StorageError, match=r"the disk is full; .* make room"):
                append(writer, 1)
    assert flushed
    assert write_chunks(path, ALL, HEADER) == {0}
    assert_whole(path, HEADER)


def test_no_room_for_the_fields_is_told_before_the_first_member(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.fsync", no_space)
    with pytest.raises(StorageError, match=r"fields\.part: the disk is full"):
        write_chunks(path, set(), HEADER)
    assert [file.name for file in path.parent.iterdir()] == [".lock"]


def test_no_room_for_the_compressed_fields_loses_no_member(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    new = path.with_name("fields.h5.new")
    with monkeypatch.context() as patch:
        patch.setattr("os.fsync", lambda handle: no_space(handle) if new.exists() else None)
        with pytest.raises(StorageError, match=r"fields\.h5: the disk is full; .* run the same command again"):
            write_chunks(path, ALL, HEADER)
    assert not path.exists()
    assert not new.exists()
    assert write_chunks(path, ALL, HEADER) == ALL
    assert_whole(path, HEADER)


def test_a_stop_between_fields_and_ensemble_is_made_up_for(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    replaced = os.replace

    def stop(old: Path, new: Path) -> None:
        if new == path:
            raise KeyboardInterrupt
        replaced(old, new)

    with monkeypatch.context() as patch, suppress(KeyboardInterrupt):
        patch.setattr("os.replace", stop)
        write_chunks(path, ALL, HEADER)
    assert path.with_name("fields.h5").exists()
    assert not path.exists()
    assert write_chunks(path, ALL, HEADER) == ALL
    assert_whole(path, HEADER)


@pytest.mark.parametrize(
    "damage",
    [
        lambda file: file.unlink(),
        lambda file: file.write_bytes(file.read_bytes()[:-1]),
        lambda file: file.write_bytes(b"other" + file.read_bytes()[5:]),
    ],
    ids=["missing", "cut off", "of another run"],
)
def test_rows_whose_fields_are_lost_are_solved_again(path: Path, damage: Callable[[Path], object]) -> None:
    write_chunks(path, {0, 2}, HEADER)
    damage(path.with_name("fields.part"))
    with ensemble_writer(path, HEADER) as writer:
        assert writer.done == set()
        assert writer.moved_to == path.with_name("ensemble.h5.part.old")
        writer.moved_to.unlink()
        for chunk in ALL:
            append(writer, chunk)
    assert_whole(path, HEADER)


def test_a_run_of_another_config_starts_its_own_fields(path: Path) -> None:
    write_chunks(path, {1}, a_header(window=WINDOW, config_hash="e" * 64))
    assert write_chunks(path, ALL, HEADER) == set()
    path.with_name("ensemble.h5.part.old").unlink()
    assert_whole(path, HEADER)
