"""Files that are whole or not there: links are not followed, writers do not meet, failures are one sentence."""

import errno
import os
import threading
from pathlib import Path

import pytest
from systems import POSIX_ALONE

from vegglue import whole_files
from vegglue.errors import StorageError
from vegglue.whole_files import folder_within, write_file
from vegglue.wording.remedies import MAKE_ROOM


@POSIX_ALONE
@pytest.mark.parametrize("name", ["result.h5", "result.h5.new"])
@pytest.mark.parametrize("link", [os.symlink, os.link], ids=["soft", "hard"])
def test_a_link_in_a_received_folder_is_replaced_and_not_followed(tmp_path: Path, name: str, link) -> None:
    mine, folder = tmp_path / "thesis.tex", tmp_path / "runs"
    folder.mkdir()
    mine.write_text("my thesis")
    link(mine, folder / name)
    write_file(folder / "result.h5", b"result", MAKE_ROOM)
    assert mine.read_text() == "my thesis"
    assert (folder / "result.h5").read_bytes() == b"result"
    assert not (folder / "result.h5").is_symlink()
    assert [path.name for path in folder.iterdir()] == ["result.h5"]


def test_what_a_killed_command_left_is_taken_over(tmp_path: Path) -> None:
    (tmp_path / "result.h5.new").write_bytes(b"a half written result, longer than the whole one")
    write_file(tmp_path / "result.h5", b"result", MAKE_ROOM)
    assert (tmp_path / "result.h5").read_bytes() == b"result"
    assert [path.name for path in tmp_path.iterdir()] == ["result.h5"]


def test_writers_of_one_name_take_turns(tmp_path: Path) -> None:
    contents = [bytes([number]) * 200_000 for number in range(8)]
    writers = [threading.Thread(target=write_file, args=(tmp_path / "a", one, MAKE_ROOM)) for one in contents]
    for each in writers:
        each.start()
    for each in writers:
        each.join()
    assert (tmp_path / "a").read_bytes() in contents
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_writer_that_does_not_end_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(whole_files, "ATTEMPTS", 2)
    with whole_files.whole_file(tmp_path / "a"), pytest.raises(StorageError, match="another process is writing this"):
        write_file(tmp_path / "a", b"", MAKE_ROOM)


@pytest.mark.parametrize(
    ("number", "expected"),
    [
        (errno.ENOSPC, "the disk is full; make room"),
        (errno.EROFS, "cannot be written .* make the folder .* writable"),
        (errno.EACCES, "cannot be written .* make the folder .* writable"),
        (errno.EIO, "cannot be written .*; make room"),
    ],
)
def test_a_failed_write_is_one_sentence_and_keeps_the_old(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, expected: str
) -> None:
    def fails(handle: int) -> None:
        raise OSError(number, os.strerror(number))

    (tmp_path / "a").write_bytes(b"old")
    monkeypatch.setattr(whole_files.os, "fsync", fails)
    with pytest.raises(StorageError, match=expected):
        write_file(tmp_path / "a", b"new", MAKE_ROOM)
    assert (tmp_path / "a").read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_name_that_is_taken_by_a_folder_or_too_long_is_told(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    for name in ("a", "b" * 300):
        with pytest.raises(StorageError, match="cannot be written"):
            write_file(tmp_path / name, b"new", MAKE_ROOM)


@POSIX_ALONE
def test_a_folder_that_is_a_link_is_replaced_and_not_followed(tmp_path: Path) -> None:
    thesis, run = tmp_path / "thesis", tmp_path / "run"
    thesis.mkdir()
    run.mkdir()
    (run / "figures").symlink_to(thesis)
    for _ in range(2):
        assert folder_within(run, "figures") == run / "figures"
        write_file(run / "figures" / "u.svg", b"<svg/>", MAKE_ROOM)
    assert not (run / "figures").is_symlink()
    assert [path.name for path in (run / "figures").iterdir()] == ["u.svg"]
    assert list(thesis.iterdir()) == []
