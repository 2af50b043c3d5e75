"""Whatever a result file holds, its reader makes a value of it or says one sentence, in bounded time and memory."""

import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from damaged_results import (
    OF_VALUES,
    OF_WORDS,
    RESULTS,
    Kept,
    change_content,
    damaged,
    places_in,
    sentence_of,
    without_digest,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from stored import ALL, HASH, a_header, append, assert_whole, start, write_chunks

from vegglue import sandboxed_reader
from vegglue.errors import StorageError
from vegglue.results.hdf5 import READ_HDF5, state_of, with_digest
from vegglue.results.result_files import read_ensemble, stored_hash
from vegglue.results.resume import ensemble_writer, part_file

pytestmark = pytest.mark.slow

Valid = Callable[[str], bytes]
OF_RESULTS = pytest.mark.parametrize("kept", RESULTS, ids=lambda kept: kept.name)
ANY_EXAMPLES, CHILDREN = 60, 8  # a damaged file costs its reader, and another takes a third of a second to begin
SHARED = {
    "deadline": None, "derandomize": True, "database": None,
    "suppress_health_check": [HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
}  # fmt: skip
# Where, in parts of the file, and what is done there: bits flipped, zeros, ones, cut off.
WAYS = st.sampled_from(("bit", "zeros", "ones", "cut"))
DAMAGE = st.lists(st.tuples(st.floats(0.0, 1.0, exclude_max=True), WAYS), min_size=1, max_size=3)


# Which place, what comes there of an array, and what of an attribute.
CHANGE = st.tuples(st.integers(0, 200), st.sampled_from(list(OF_VALUES)), st.integers(0, len(OF_WORDS) - 1))


def copy_of(kept: Kept, valid: Valid, folder: Path) -> Path:
    """A file in a folder of its own: what is known of one is not asked again before its time has changed."""
    path = Path(tempfile.mkdtemp(dir=folder)) / kept.name
    path.write_bytes(valid(kept.name))
    return path


def change_somewhere(path: Path, change: tuple[int, str, int]) -> None:
    where, values, words = change
    places = places_in(path)
    change_content(path, places[where % len(places)], OF_VALUES[values], OF_WORDS[words])


@pytest.fixture(scope="module")
def valid(tmp_path_factory: pytest.TempPathFactory) -> Valid:
    """The bytes of a whole file of each kind."""
    contents = {}
    for kept in RESULTS:
        path = tmp_path_factory.mktemp("valid") / kept.name
        kept.write(path)
        assert sentence_of(kept, path) == ""
        contents[kept.name] = path.read_bytes()

    def content_of(name: str) -> bytes:  # hypothesis shows what a test is given
        return contents[name]

    return content_of


@OF_RESULTS
@settings(max_examples=ANY_EXAMPLES, **SHARED)
@given(change=CHANGE)
def test_other_contents_are_read_or_refused(
    kept: Kept, valid: Valid, tmp_path: Path, change: tuple[int, str, int]
) -> None:
    path = copy_of(kept, valid, tmp_path)
    change_somewhere(path, change)
    assert len(sentence_of(kept, path).splitlines()) <= 1


@OF_RESULTS
@pytest.mark.parametrize("how", ["gone", "one less", "a dimension more", "text", "complex"])
def test_arrays_that_do_not_fit_each_other_are_refused(kept: Kept, how: str, valid: Valid, tmp_path: Path) -> None:
    """Of the numbers that a reader computes with; a diagnosis may have no map of a field."""
    numbers = {
        "ensemble.h5": ("members", "prediction"), "fields.h5": ("fields", "u"), "posterior.h5": ("members", "weights"),
        "diagnosis.h5": ("suspects", "amplitude"), "flow.h5": ("flow", "depth"),
    }  # fmt: skip
    path = tmp_path / kept.name
    path.write_bytes(valid(kept.name))
    change_content(path, numbers[kept.name], OF_VALUES[how], None)
    if kept.name == "flow.h5":  # which is solved again
        assert kept.read(path) is None
    else:
        assert "is broken or of another version" in sentence_of(kept, path)


@OF_RESULTS
@settings(max_examples=ANY_EXAMPLES, **SHARED)
@given(edits=DAMAGE)
def test_damage_of_a_file_with_a_digest_is_noticed(
    kept: Kept, valid: Valid, tmp_path: Path, edits: list[tuple[float, str]]
) -> None:
    path = copy_of(kept, valid, tmp_path)
    content = damaged(valid(kept.name)[:-100], [edit for edit in edits if edit[1] != "cut"]) + valid(kept.name)[-100:]
    path.write_bytes(content)
    if content != valid(kept.name):
        assert stored_hash(path) is None
        assert "has changed since it was written" in sentence_of(kept, path) or kept.name == "flow.h5"


@OF_RESULTS
@settings(max_examples=CHILDREN, **SHARED)
@given(edits=DAMAGE)
def test_damage_of_a_file_without_a_digest_is_read_or_refused(
    kept: Kept, valid: Valid, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, edits: list[tuple[float, str]]
) -> None:
    monkeypatch.setattr(sandboxed_reader, "LONGEST_START", 5.0)
    path = copy_of(kept, valid, tmp_path)
    path.write_bytes(damaged(without_digest(path), edits))
    assert len(sentence_of(kept, path).splitlines()) <= 1


def endless(path: Path) -> bytes:
    """Zeros in the heap of texts: the HDF5 library reads such a file in circles, and holds whoever asked."""
    content = bytearray(without_digest(path))
    heap = content.index(b"GCOL")
    content[heap + 16 : heap + 80] = bytes(64)
    return bytes(content)


@pytest.mark.parametrize("digest", [bytes, with_digest], ids=["without a digest", "behind a right digest"])
def test_a_file_that_is_read_in_circles_is_given_up(
    digest: Callable[[bytes], bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sandboxed_reader, "LONGEST_START", 2.0)
    path = tmp_path / "ensemble.h5"
    write_chunks(path, ALL, a_header())
    path.write_bytes(digest(endless(path)))
    began = time.monotonic()
    with pytest.raises(StorageError, match=r"cannot be opened \(it is not read to its end within 2 s\); remove it"):
        read_ensemble(path, HASH)
    assert stored_hash(path) is None, "what is known of it is not found out again"
    assert time.monotonic() - began < 20.0, "given up, not waited for"
    other = tmp_path / "other.h5"
    write_chunks(other, ALL, a_header())
    read_ensemble(other, HASH)  # by the next reader


def test_a_reader_that_was_ended_is_replaced(tmp_path: Path) -> None:
    for number in range(3):
        path = tmp_path / f"{number}.h5"
        write_chunks(path, ALL, a_header())
        read_ensemble(path, HASH)
        reader = sandboxed_reader._reader(os.getpid())
        if number == 0:  # one that lives is kept
            kept = reader
        elif number == 1:
            assert reader is kept
            reader.kill()
            reader.wait()
        else:
            assert reader is not kept


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there a reader that crashed is replaced")
def test_a_file_that_crashes_its_reader_harms_a_copy_of_it(tmp_path: Path) -> None:
    reader = sandboxed_reader._reader(os.getpid())
    assert sandboxed_reader.why_unreadable(tmp_path, 1, by="sys:exit") == sandboxed_reader.CRASHED
    path = tmp_path / "ensemble.h5"
    write_chunks(path, ALL, a_header())
    assert sandboxed_reader.why_unreadable(*state_of(path), by=READ_HDF5) is None
    assert sandboxed_reader._reader(os.getpid()) is reader
    assert reader.poll() is None


def test_a_process_that_was_forked_has_a_reader_of_its_own(tmp_path: Path) -> None:
    path = tmp_path / "ensemble.h5"
    write_chunks(path, ALL, a_header())
    assert sandboxed_reader.why_unreadable(*state_of(path), by=READ_HDF5) is None
    parents, child = sandboxed_reader._reader(os.getpid()), os.fork()
    if not child:
        sandboxed_reader.why_unreadable.cache_clear()
        right = (
            sandboxed_reader.why_unreadable(*state_of(path), by=READ_HDF5) is None
            and sandboxed_reader._reader(os.getpid()) is not parents
        )
        os._exit(0 if right else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert parents.poll() is None
    sandboxed_reader.why_unreadable.cache_clear()
    assert sandboxed_reader.why_unreadable(*state_of(path), by=READ_HDF5) is None, "the answers are not mixed up"


def test_a_reader_ends_with_whoever_asked(tmp_path: Path) -> None:
    path = tmp_path / "ensemble.h5"
    write_chunks(path, ALL, a_header())
    asks = """
        import os
        from pathlib import Path
        from vegglue import sandboxed_reader
        from vegglue.results import hdf5
        sandboxed_reader.why_unreadable(*hdf5.state_of(Path({path!r})), by=hdf5.READ_HDF5)
        print(sandboxed_reader._reader(os.getpid()).pid, flush=True)
        os.kill(os.getpid(), 9)
    """
    with start(asks, path=str(path)) as asking:
        reader = int(asking.communicate()[0])
    for _ in range(100):
        try:
            os.kill(reader, 0)
            if Path(f"/proc/{reader}/stat").read_text(encoding="utf-8").split()[2] == "Z":  # nobody asks for its end
                return
        except OSError:
            return
        time.sleep(0.1)
    raise AssertionError(f"process {reader} goes on")


def assert_set_aside(path: Path, once_open: Callable[[], None] = lambda: None) -> None:
    """A file as a growing part is moved away, and the ensemble is written anew."""
    path.rename(part_file(path))
    with ensemble_writer(path, a_header()) as writer:
        once_open()
        assert writer.moved_to is not None
        for chunk in ALL:
            append(writer, chunk)
    writer.moved_to.unlink()
    assert_whole(path, a_header())


def test_a_part_that_is_read_in_circles_is_set_aside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sandboxed_reader, "LONGEST_START", 2.0)
    path = tmp_path / "ensemble.h5"
    write_chunks(path, ALL, a_header())
    path.write_bytes(endless(path))
    assert_set_aside(path, monkeypatch.undo)  # what is read later has its time, on a machine at work


@settings(max_examples=CHILDREN, **SHARED)
@given(change=CHANGE)
def test_a_part_with_other_contents_is_gone_on_with_or_set_aside(
    valid: Valid, tmp_path: Path, change: tuple[int, str, int]
) -> None:
    path = copy_of(RESULTS[0], valid, tmp_path)
    change_somewhere(path, change)
    path.rename(part_file(path))
    with ensemble_writer(path, a_header()) as writer:
        writer.reopen_damaged([np.sort(np.arange(chunk, 12, 3)) for chunk in sorted(ALL)])
        for chunk in ALL - writer.done:
            append(writer, chunk)
    if writer.moved_to is not None:
        writer.moved_to.unlink()
    assert_whole(path, a_header())


def test_a_part_whose_numbers_are_text_is_set_aside(valid: Valid, tmp_path: Path) -> None:
    """It ended in a traceback."""
    path = copy_of(RESULTS[0], valid, tmp_path)
    change_content(path, ("members", "prediction"), OF_VALUES["text"], None)
    assert_set_aside(path)


def test_room_for_more_than_the_file_holds_is_counted_over_all_names(tmp_path: Path) -> None:
    path = tmp_path / "ensemble.h5"
    with h5py.File(path, "w") as file:
        group = file.create_group("members")
        group.create_dataset("status", (1 << 20,), np.float64, chunks=(1 << 17,), compression="gzip")[...] = 0.0
        for number in range(5000):
            group[f"again{number}"] = group["status"]
    assert path.stat().st_size < 1 << 20
    with pytest.raises(StorageError, match="claims more numbers than the file can hold"):
        read_ensemble(path)


def test_a_link_in_a_circle_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "ensemble.h5"
    with h5py.File(path, "w") as file:
        group = file.create_group("members")
        group["status"] = h5py.SoftLink("/members/status")
    with pytest.raises(StorageError, match="members/status is a link"):
        read_ensemble(path)
    with h5py.File(path, "w") as file:
        group = file.create_group("members")
        group["members"] = group
    with pytest.raises(StorageError, match="members/members is no dataset"):
        read_ensemble(path)


def test_files_that_are_no_hdf5_are_refused(tmp_path: Path) -> None:
    for name, content in {"nothing": b"", "text": b"u,v\n1,2\n", "mark alone": b"\x89HDF\r\n\x1a\n"}.items():
        path = tmp_path / name
        path.write_bytes(content)
        with pytest.raises(StorageError, match="cannot be opened"):
            read_ensemble(path)
