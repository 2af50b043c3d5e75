"""Files that were damaged, come from strangers or are open elsewhere: one sentence, never another's file touched."""

import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from stored import ALL, HASH, WINDOW, a_header, append, assert_whole, members_of, write_chunks

from vegglue.errors import InputError, StorageError
from vegglue.results.loop_results import questions_that_fit
from vegglue.results.result_files import read_ensemble, stored_hash
from vegglue.results.resume import EnsembleWriter, ensemble_writer, part_file, remove_left_over_fields
from vegglue.workflow.twin import opened_answer

pytestmark = pytest.mark.slow

# Damaged one by one: each is looked at by a process of its own, which takes a third of a second.
PLACES = 20
CHUNKS_OF_MEMBERS = [np.sort(members_of(chunk)) for chunk in sorted(ALL)]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "runs" / "ensemble.h5"


def flip(path: Path, place: int, bit: int = 0) -> None:
    content = bytearray(path.read_bytes())
    content[place] ^= 1 << bit
    path.write_bytes(content)


def test_a_flipped_bit_anywhere_in_a_whole_file_is_noticed(path: Path) -> None:
    write_chunks(path, ALL, a_header())
    good = path.read_bytes()
    for place in np.random.default_rng(1).integers(0, len(good) - 100, 40):
        path.write_bytes(good)
        flip(path, int(place), int(place) % 8)
        with pytest.raises(StorageError, match=r"ensemble\.h5: is broken, it has changed since it was written; remove"):
            read_ensemble(path, HASH)
        assert stored_hash(path) is None


def test_a_file_of_an_older_version_has_no_digest_and_is_read(path: Path) -> None:
    write_chunks(path, ALL, a_header())
    with h5py.File(path, "r+"):
        pass  # the HDF5 library cuts off what it does not know
    assert b"vegglue sha256" not in path.read_bytes()
    assert_whole(path, a_header())


@pytest.mark.parametrize("name", ["members/prediction", "members/reason", "progress/digest"])
@pytest.mark.parametrize("header", [a_header(), a_header(window=WINDOW)], ids=["rows alone", "with fields"])
def test_damaged_members_of_an_unfinished_run_are_solved_again(path: Path, name: str, header) -> None:
    write_chunks(path, {0, 1}, header)
    part = path.with_name("ensemble.h5.part")
    with h5py.File(part) as file:
        start, each = file[name].id.get_offset(), file[name].nbytes // len(file[name])
    flip(part, start + each, 7)  # of member or chunk 1
    with ensemble_writer(path, header) as writer:
        assert writer.moved_to is None
        assert writer.done == {0, 1}
        writer.reopen_damaged(CHUNKS_OF_MEMBERS)
        assert writer.done == {0}
        for chunk in (1, 2):
            append(writer, chunk)
    assert_whole(path, header)


def test_damaged_fields_of_an_unfinished_run_are_solved_again(path: Path) -> None:
    header = a_header(window=WINDOW)
    write_chunks(path, {0, 1}, header)
    flip(path.with_name("fields.part"), -5)  # of the last member, 11, of chunk 2: not solved yet
    flip(path.with_name("fields.part"), 85 + 10)  # of member 0, of chunk 0
    with ensemble_writer(path, header) as writer:
        writer.reopen_damaged(CHUNKS_OF_MEMBERS)
        assert writer.done == {1}
        for chunk in (0, 2):
            append(writer, chunk)
    assert_whole(path, header)


def test_a_damaged_unfinished_file_never_stops_a_run_twice(path: Path) -> None:
    write_chunks(path, {1}, a_header())
    part = path.with_name("ensemble.h5.part")
    good = part.read_bytes()
    for place in range(0, len(good), len(good) // PLACES):
        part.write_bytes(good)
        flip(part, place, place % 8)
        with ensemble_writer(path, a_header()) as writer:
            writer.reopen_damaged(CHUNKS_OF_MEMBERS)
            for chunk in ALL - writer.done:
                append(writer, chunk)
        part.with_name("ensemble.h5.part.old").unlink(missing_ok=True)
        assert_whole(path, a_header())
        path.unlink()


def lead_out(part: Path, victim: Path, how: str) -> None:
    """Make a dataset of an unfinished ensemble one that lies in another file."""
    with h5py.File(part, "r+") as file:
        group, old = file["members"], file["members/seconds"]
        shape, dtype = old.shape, old.dtype
        del group["seconds"]
        if how == "raw storage":
            group.create_dataset("seconds", shape, dtype, external=[(str(victim), 0, h5py.h5f.UNLIMITED)])
        elif how == "virtual":
            layout = h5py.VirtualLayout(shape, dtype)
            layout[:] = h5py.VirtualSource(str(victim), "seconds", shape)
            group.create_virtual_dataset("seconds", layout)
        elif how == "soft link":
            group["seconds"] = h5py.SoftLink("/members/mass_error")
        else:
            group["seconds"] = h5py.ExternalLink(str(victim), "seconds")


@pytest.mark.parametrize("how", ["raw storage", "virtual", "soft link", "external link"])
def test_what_leads_out_of_a_received_file_is_neither_read_nor_filled(path: Path, tmp_path: Path, how: str) -> None:
    victim = tmp_path / "thesis.h5"
    with h5py.File(victim, "w") as file:
        file["seconds"] = np.arange(12.0)
    kept = victim.read_bytes()
    write_chunks(path, {1}, a_header())
    part = path.with_name("ensemble.h5.part")
    lead_out(part, victim, how)
    path.write_bytes(part.read_bytes())
    with pytest.raises(StorageError, match=r"ensemble\.h5: members/seconds .*, which vegglue never writes"):
        read_ensemble(path, HASH)
    path.unlink()
    with ensemble_writer(path, a_header()) as writer:
        assert writer.moved_to is not None
        assert writer.done == set()
        for chunk in ALL:
            append(writer, chunk)
    writer.moved_to.unlink()
    assert_whole(path, a_header())
    assert victim.read_bytes() == kept


@pytest.mark.parametrize("name", ["ensemble.h5.part", "ensemble.h5.part.new", "fields.part", "fields.h5.new"])
def test_links_in_a_received_folder_are_not_followed(path: Path, tmp_path: Path, name: str) -> None:
    victim, header = tmp_path / "thesis.tex", a_header(window=WINDOW)
    victim.write_text("my thesis")
    path.parent.mkdir()
    (path.parent / name).symlink_to(victim)
    write_chunks(path, ALL, header)
    (path.parent / "ensemble.h5.part.old").unlink(missing_ok=True)
    assert_whole(path, header)
    assert victim.read_text() == "my thesis"


def test_a_lock_that_is_a_link_is_refused(path: Path, tmp_path: Path) -> None:
    victim = tmp_path / "thesis.tex"
    victim.write_text("my thesis")
    path.parent.mkdir()
    (path.parent / ".lock").symlink_to(victim)
    with pytest.raises(StorageError, match=r"\.lock: cannot be written"):
        write_chunks(path, ALL, a_header())
    assert victim.read_text() == "my thesis"


def test_more_numbers_than_a_file_can_hold_are_refused_before_any_room_is_taken(path: Path) -> None:
    path.parent.mkdir()
    with h5py.File(path, "w") as file:
        file.create_dataset("members/status", (1 << 40,), np.int8, chunks=(1 << 20,))
    with pytest.raises(StorageError, match="members/status claims more numbers than the file can hold"):
        read_ensemble(path)


OTHERS = """
import h5py, sys
with h5py.File(sys.argv[1], sys.argv[2]) as file:
    print(file["members/status"][0], flush=True)
    sys.stdin.readline()
"""


def elsewhere(path: Path, mode: str) -> "subprocess.Popen[str]":
    """Another process that has the file open, with the locks of the HDF5 library."""
    command = [sys.executable, "-c", OTHERS, str(path), mode]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline()
    return process


@pytest.mark.parametrize("mode", ["r", "r+"])
def test_an_unfinished_file_that_another_process_has_open_is_gone_on_with(path: Path, mode: str) -> None:
    chunks = {0, 1}
    write_chunks(path, chunks, a_header())
    with elsewhere(path.with_name("ensemble.h5.part"), mode) as other:
        assert write_chunks(path, ALL, a_header()) == chunks
        other.communicate("\n")
    assert_whole(path, a_header())


def test_a_file_that_another_process_reads_is_read(path: Path) -> None:
    write_chunks(path, ALL, a_header())
    with elsewhere(path, "r") as other:
        assert_whole(path, a_header())
        other.communicate("\n")


def test_a_file_that_another_program_may_change_is_in_use_and_not_broken(path: Path) -> None:
    write_chunks(path, ALL, a_header())
    with elsewhere(path, "r+") as other:
        with pytest.raises(StorageError, match=r"ensemble\.h5 is in use by another program; close it there\."):
            read_ensemble(path, HASH)
        with pytest.raises(StorageError, match="is in use by another program"):
            write_chunks(path, set(), a_header())
        other.communicate("\n")
    assert_whole(path, a_header())


def test_a_growing_file_can_be_followed_with_locks_on(path: Path) -> None:
    with ensemble_writer(path, a_header()) as writer:
        for chunk in sorted(ALL):
            append(writer, chunk)
            code = "import h5py,sys; print(h5py.File(sys.argv[1])['progress/finished'][:].sum())"
            said = subprocess.run([sys.executable, "-c", code, writer.path], capture_output=True, text=True, check=True)
            assert int(said.stdout) == chunk + 1


def test_a_growing_file_is_resumed_from_any_of_its_states(path: Path, tmp_path: Path) -> None:
    states = []

    def keep(writer: EnsembleWriter) -> None:
        states.append((writer.path.read_bytes(), writer.done))

    with ensemble_writer(path, a_header()) as writer:
        keep(writer)
        for chunk in sorted(ALL):
            append(writer, chunk)
            keep(writer)
    for number, (content, done) in enumerate(states):
        other = tmp_path / str(number) / "ensemble.h5"
        other.parent.mkdir()
        part_file(other).write_bytes(content)
        assert write_chunks(other, ALL, a_header()) == done
        assert_whole(other, a_header())


def test_a_file_that_this_process_has_open_is_read(path: Path) -> None:
    write_chunks(path, ALL, a_header())
    with h5py.File(path):
        assert read_ensemble(path, HASH).status.size == 12


def test_fields_left_over_are_taken_away(path: Path) -> None:
    header = a_header(window=WINDOW)
    write_chunks(path, ALL, header)
    path.with_name("fields.part").write_bytes(b"killed just before this was taken away")
    remove_left_over_fields(path)
    assert_whole(path, header)


def test_a_pipe_in_a_received_folder_makes_nobody_wait(path: Path) -> None:
    path.parent.mkdir()
    for name in ("ensemble.h5", "questions.json", "answer.sealed"):
        os.mkfifo(path.parent / name)
    with pytest.raises(StorageError, match="cannot be opened"):
        read_ensemble(path)
    assert stored_hash(path) is None
    assert questions_that_fit(path.parent, HASH) is None
    with pytest.raises(InputError, match="it is not a file"):
        opened_answer(path.parent / "answer.sealed")


def test_a_folder_in_place_of_a_file_is_told_before_anything_is_solved(path: Path) -> None:
    path.mkdir(parents=True)
    with pytest.raises(StorageError, match="expected a file or nothing, found a folder"):
        write_chunks(path, set(), a_header())
