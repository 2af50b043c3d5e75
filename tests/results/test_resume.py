"""A run that stops or is killed goes on where it was, and nothing of another run is mixed in."""

import signal
import time
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from stored import (
    ALL,
    CHUNKS,
    MEMBERS,
    WINDOW,
    a_header,
    append,
    assert_whole,
    members_of,
    rows_of,
    start,
    write_chunks,
)

from vegglue.errors import InputError, StorageError
from vegglue.results.ensemble import Header
from vegglue.results.result_files import read_ensemble
from vegglue.results.resume import ensemble_writer

pytestmark = pytest.mark.slow


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "runs" / "d0" / "ensemble.h5"


def part(path: Path) -> Path:
    return path.with_name("ensemble.h5.part")


def test_unfinished_run_is_resumed(path: Path) -> None:
    write_chunks(path, {1}, a_header())
    assert not path.exists()
    with pytest.raises(InputError, match="only a part"):
        read_ensemble(path)
    assert write_chunks(path, ALL, a_header()) == {1}
    assert_whole(path, a_header())


def test_chunks_may_come_in_any_order(path: Path) -> None:
    with ensemble_writer(path, a_header()) as writer:
        for chunk in (2, 0, 1):
            append(writer, chunk)
    assert_whole(path, a_header())


def test_members_survive_an_exception_in_the_run(path: Path) -> None:
    with suppress(KeyboardInterrupt), ensemble_writer(path, a_header()) as writer:
        append(writer, 0)
        raise KeyboardInterrupt
    with ensemble_writer(path, a_header()) as writer:
        assert writer.done == {0}


APPEND_FOREVER = """
    import sys
    from pathlib import Path
    sys.path.insert(0, {tests!r})
    from stored import WINDOW, a_header, append
    from vegglue.results.resume import ensemble_writer
    with ensemble_writer(Path({path!r}), a_header(window={window})) as writer:
        append(writer, 1)
        print("appended", flush=True)
        while True:
            append(writer, 2)
"""


@pytest.mark.parametrize("header", [a_header(), a_header(window=WINDOW)], ids=["rows alone", "with fields"])
@pytest.mark.parametrize("delay", [0.0, 0.013, 0.05])
def test_members_survive_a_kill_while_appending(path: Path, header: Header, delay: float) -> None:
    with start(APPEND_FOREVER, path=str(path), window="None" if header.window is None else "WINDOW") as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "appended\n"
        time.sleep(delay)
        process.send_signal(signal.SIGKILL)
        process.wait()
    with ensemble_writer(path, header) as writer:
        assert writer.moved_to is None
        assert 1 in writer.done
        for chunk in ALL - writer.done:
            append(writer, chunk)
    assert_whole(path, header)


OTHER_PARAMETERS = {"z_last": np.ones(MEMBERS), "a_first": np.ones(MEMBERS)}


@pytest.mark.parametrize(
    "changes",
    [
        {"config_hash": "e" * 64},
        {"seed": 6},
        {"version": "0.1.1"},
        {"chunks": 4},
        {"cut": "otherwise"},
        {"parameters": OTHER_PARAMETERS},
    ],
)
def test_unfinished_run_of_another_config_is_set_aside(path: Path, changes: dict[str, Any]) -> None:
    write_chunks(path, {1}, a_header())
    with ensemble_writer(path, a_header(**changes)) as writer:
        assert writer.done == set()
        assert writer.moved_to is not None
        with h5py.File(writer.moved_to) as old:
            assert old["progress/finished"][:].tolist() == [0, 1, 0]


def test_broken_part_file_is_set_aside(path: Path) -> None:
    write_chunks(path, {1}, a_header())
    part(path).write_bytes(part(path).read_bytes()[:700])
    with ensemble_writer(path, a_header()) as writer:
        assert writer.done == set()
        assert writer.moved_to == path.with_name("ensemble.h5.part.old")


def test_rows_that_do_not_match_the_file_are_refused(path: Path) -> None:
    rows = rows_of(0)
    del rows["seconds"]
    with ensemble_writer(path, a_header()) as writer, pytest.raises(ValueError, match="expected the rows"):
        writer.append(0, members_of(0), rows)


@pytest.mark.parametrize("header", [a_header(), a_header(window=WINDOW)], ids=["rows alone", "with fields"])
def test_a_run_on_a_machine_that_no_lock_reaches_spoils_nothing(
    path: Path, header: Header, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both lay out the part file; the first must not call that of the second whole."""

    def two_at_once() -> None:
        with ensemble_writer(path, header) as first:
            append(first, 0)
            with ensemble_writer(path, header) as second:
                assert second.done == {0}
                append(second, 1)
            for chunk in (1, 2):
                append(first, chunk)

    with monkeypatch.context() as patch:
        patch.setattr("vegglue.results.resume.hold_lock", lambda folder: nullcontext())
        with pytest.raises(StorageError, match="was replaced by another run"):
            two_at_once()
    assert not path.exists()
    assert write_chunks(path, ALL, header) == {0, 1}
    assert_whole(path, header)


def test_long_reasons_are_cut_between_characters(path: Path) -> None:
    with ensemble_writer(path, a_header()) as writer:
        for chunk in range(CHUNKS):
            reasons = np.array(["x" + "ü" * 300] * len(members_of(chunk)), object)
            writer.append(chunk, members_of(chunk), rows_of(chunk) | {"reason": reasons})
    assert set(read_ensemble(path).reason) == {"x" + "ü" * 119}
