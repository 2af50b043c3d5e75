"""One run at a time: the lock of a folder, and what becomes of that of a dead run."""

import os
import socket
from pathlib import Path

import pytest
from stored import start

from vegglue.errors import StorageError
from vegglue.results.resume import hold_lock

HOLD = """
    import time
    from pathlib import Path
    from vegglue.results.resume import hold_lock
    with hold_lock(Path({path!r})):
        print("held", flush=True)
        time.sleep(60)
"""


def test_two_runs_of_one_name_exclude_each_other(tmp_path: Path) -> None:
    with start(HOLD, path=str(tmp_path)) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        holder = f"in use by process {process.pid} on {socket.gethostname()} since 20"
        with pytest.raises(StorageError, match=holder), hold_lock(tmp_path):
            pass
        process.kill()
        process.wait()
    with hold_lock(tmp_path):  # the lock of the dead is taken over
        assert str(os.getpid()) in (tmp_path / ".lock").read_text()
    assert (tmp_path / ".lock").read_text() == ""


def test_what_another_machine_left_behind_is_taken_over(tmp_path: Path) -> None:
    (tmp_path / ".lock").write_text('{"pid": 1, "host": "elsewhere", "since": "2020-01-01"} and more')
    with hold_lock(tmp_path):
        assert "elsewhere" not in (tmp_path / ".lock").read_text()


def test_lock_is_given_back_after_an_error(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), hold_lock(tmp_path):
        raise RuntimeError
    with hold_lock(tmp_path):
        pass


def test_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    with pytest.raises(StorageError, match=r"missing/\.lock: cannot be written"), hold_lock(tmp_path / "missing"):
        pass
