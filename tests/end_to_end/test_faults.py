"""What a run survives: kills, Ctrl-C, a second run, a full disk, changed or broken inputs; its numbers stay."""

import errno
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import h5py
import numpy as np
import pytest
from reach import COARSE, Say, begin, here, vegglue, write_reach

from vegglue.case.config import load_case
from vegglue.errors import StorageError
from vegglue.flow.status import SOLVED_BY_NEWTON
from vegglue.inference.solve_ensemble import chunk_size, solve_ensemble
from vegglue.measurements.observations import read_observations
from vegglue.results.ensemble import Ensemble
from vegglue.results.result_files import read_ensemble
from vegglue.wording.commands import LAST_WORDS

pytestmark = pytest.mark.slow

# So many that a run is still on its way when it is stopped, on a busy machine too: some second.
CHUNKS = 16
CHUNK = chunk_size(4096, 1)
ENSEMBLE = Path("runs/brook/ensemble.h5")
PART = Path("runs/brook/ensemble.h5.part")
SIXTEEN = (COARSE, ("members: 1024", "members: 16"))
COMPARED = ("prediction", "section_flow", "mass_error", "status", "reason", "iterations")
Damage = Callable[[str], str]


def several_chunks(folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    return write_reach(folder, COARSE, ("members: 1024", f"members: {CHUNKS * CHUNK}"))


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> Ensemble:
    """All members in one go in one process."""
    folder = tmp_path_factory.mktemp("uninterrupted")
    here(folder, "simulate", several_chunks(folder).name, "--jobs", 1)
    return read_ensemble(folder / ENSEMBLE)


def assert_same_numbers(ensemble: Ensemble, other: Ensemble) -> None:
    for name in COMPARED:
        np.testing.assert_array_equal(getattr(ensemble, name), getattr(other, name), err_msg=name)
    for name, values in ensemble.parameters.items():
        np.testing.assert_array_equal(values, other.parameters[name], err_msg=name)


@contextmanager
def running(folder: Path, *arguments: str | int) -> Iterator["subprocess.Popen[str]"]:
    """A run on its way; what is left of it at the end is killed, its workers too."""
    process = begin(folder, *arguments)
    try:
        yield process
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate(timeout=60)


def wait_for_chunks(process: "subprocess.Popen[str]", part: Path, chunks: int) -> None:
    """Look at what a run writes until so many chunks are stored; it says so only now and then."""
    while process.poll() is None:
        with suppress(OSError, KeyError), h5py.File(part, "r", locking=False) as file:  # it may be half written
            if file["progress/finished"][:].sum() >= chunks:
                return
        time.sleep(0.01)
    pytest.fail(f"the run ended too early: {process.stderr.read() if process.stderr else ''}")


def stop_between_chunks(process: "subprocess.Popen[str]", part: Path) -> None:
    """Stop a run while no chunk is half written: such a one is solved again, and does not count as from before."""
    for _ in range(1000):
        os.kill(process.pid, signal.SIGSTOP)
        with suppress(OSError, KeyError), h5py.File(part, "r", locking=False) as file:
            if np.isfinite(file["members/seconds"][:]).sum() == CHUNK * file["progress/finished"][:].sum():
                return
        os.kill(process.pid, signal.SIGCONT)
        time.sleep(0.01)
    pytest.fail("chunks are always half written")


def stored(part: Path) -> tuple[np.ndarray, np.ndarray]:
    """Members of an unfinished run that are there, and the seconds each took."""
    with h5py.File(part, "r") as file:
        seconds = file["members/seconds"][:]
    return np.flatnonzero(np.isfinite(seconds)), seconds


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_killed_run_goes_on_where_it_was(tmp_path: Path, uninterrupted: Ensemble, jobs: int) -> None:
    config = several_chunks(tmp_path)
    with running(tmp_path, "simulate", config.name, "--jobs", jobs) as process:
        wait_for_chunks(process, tmp_path / PART, 1)
        stop_between_chunks(process, tmp_path / PART)
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
    there, seconds = stored(tmp_path / PART)
    assert 0 < there.size < CHUNKS * CHUNK, "killed in the middle"
    assert not (tmp_path / ENSEMBLE).exists()
    refused = here(tmp_path, "infer", config.name, succeed=False)
    assert refused.returncode == 2
    assert f"found only a part of the members; run `vegglue simulate {config.name}`" in refused.stderr
    said = vegglue(tmp_path, "simulate", config.name, "--jobs", 3 - jobs).stdout
    assert f"{there.size:,} of {CHUNKS * CHUNK:,} members ({there.size:,} from before)" in said
    ensemble = read_ensemble(tmp_path / ENSEMBLE)
    assert not (tmp_path / PART).exists()
    assert_same_numbers(ensemble, uninterrupted)
    np.testing.assert_array_equal(ensemble.seconds[there], seconds[there])  # of the wall clock: not solved again


def test_all_are_solved_and_differ(uninterrupted: Ensemble) -> None:
    """That their numbers do not depend on the number of jobs: above, where those before the kill had another."""
    assert (uninterrupted.status == SOLVED_BY_NEWTON).all()
    assert len(np.unique(uninterrupted.prediction[:, 0])) == CHUNKS * CHUNK


@pytest.mark.usefixtures("interruptible")
def test_ctrl_c_keeps_what_was_solved(tmp_path: Path) -> None:
    config = several_chunks(tmp_path)
    with running(tmp_path, "simulate", config.name, "--jobs", 1) as process:
        wait_for_chunks(process, tmp_path / PART, 1)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        _, error = process.communicate(timeout=60)
    assert process.returncode == 130, error
    assert LAST_WORDS["stopped"] in error
    assert "Traceback" not in error
    assert stored(tmp_path / PART)[0].size >= CHUNK


def test_a_second_run_of_one_name_is_refused(tmp_path: Path) -> None:
    config = several_chunks(tmp_path)
    with running(tmp_path, "simulate", config.name, "--jobs", 1) as process:
        wait_for_chunks(process, tmp_path / PART, 0)
        os.kill(process.pid, signal.SIGSTOP)  # holds its lock for as long as this test wants
        second = here(tmp_path, "simulate", config.name, "--jobs", 1, succeed=False)
        assert second.returncode == 3
        assert second.stderr.count("\n") == 1
        assert f"runs/brook is in use by process {process.pid} on " in second.stderr
        os.kill(process.pid, signal.SIGCONT)
        output, error = process.communicate(timeout=120)
    assert process.returncode == 0, error
    assert f"{CHUNKS * CHUNK:,} members" in output


def simulated(folder: Path) -> None:
    """A finished ensemble of sixteen members."""
    config = write_reach(folder, *SIXTEEN)
    case = load_case(config)
    solve_ensemble(case, read_observations(case), folder / ENSEMBLE, 1, lambda progress: None)


@pytest.fixture
def say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say) -> Say:
    """`vegglue step brook.yaml` in the test's folder: exit code and standard error, of one line if it is refused."""
    monkeypatch.chdir(tmp_path)

    def said(step: str) -> tuple[int, str]:
        code, error = say(step, "brook.yaml")
        assert error.count("\n") == bool(code), error
        return code, error

    return said


def test_what_is_out_of_date_is_refused_with_what_to_run(tmp_path: Path, say: Say) -> None:
    simulated(tmp_path)
    assert say("infer") == (0, "")
    write_reach(tmp_path, *SIXTEEN, ("simulate:", "infer: {likelihood: nse}\nsimulate:"))
    code, error = say("report")
    assert code == 2
    assert "posterior.h5: expected config hash" in error
    assert "run `vegglue infer brook.yaml` again" in error
    assert say("infer") == (0, ""), "another likelihood needs no new members"
    write_reach(tmp_path, *SIXTEEN, ("high: 0.10", "high: 0.12"))
    assert_stale_ensemble(say)
    write_reach(tmp_path, *SIXTEEN)
    assert say("infer") == (0, "")
    with (tmp_path / "velocities.csv").open("a", encoding="utf-8") as file:
        file.write("below,20,2.25,0.35\n")
    assert_stale_ensemble(say)


def assert_stale_ensemble(say: Say) -> None:
    for step in ("infer", "report"):
        code, error = say(step)
        assert code == 2
        assert f"{ENSEMBLE}: expected config hash" in error
        assert "run `vegglue simulate brook.yaml` again" in error


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """No file may grow beyond a size [bytes], as on a disk without room; nobody's rights are needed for that."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_disk_without_room_is_one_sentence_and_keeps_what_was_there(tmp_path: Path, say: Say) -> None:
    simulated(tmp_path)
    assert say("infer") == (0, "")
    run = tmp_path / "runs/brook"
    kept = {name: (run / name).read_bytes() for name in ("ensemble.h5", "posterior.h5")}
    for step, size, file in (("infer", 10_000, "posterior.h5"), ("report", 100_000, "runs/brook/figures/")):
        with room_for(size):
            code, error = say(step)
        assert code == 3
        assert file in error
        assert "cannot be written" in error
    assert {name: (run / name).read_bytes() for name in kept} == kept
    assert not (run / "report.html").exists()
    # Other members: the same ones would be taken over from the brook without being written.
    write_reach(tmp_path, *SIXTEEN, ("name: brook", "name: pond"), ("high: 0.10", "high: 0.12"))
    with room_for(10_000):
        code, error = say("simulate")
    assert code == 3
    assert "runs/pond/ensemble.h5.part: cannot be written" in error
    assert say("simulate") == (0, "")


def test_a_disk_that_fills_up_in_the_middle_loses_no_chunk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config = write_reach(tmp_path, COARSE, ("members: 1024", f"members: {CHUNKS * CHUNK}"))
    case = load_case(config)
    observations, path = read_observations(case), tmp_path / ENSEMBLE
    chunks = []

    def fill_up(handle: int) -> None:
        if chunks[-1].done >= CHUNK:
            raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("vegglue.results.resume.os.fsync", lambda handle: fill_up(handle) if chunks else None)
        with pytest.raises(StorageError, match=r"ensemble\.h5\.part: the disk is full; .* run the same command again"):
            solve_ensemble(case, observations, path, 1, chunks.append)
    assert [progress.done for progress in chunks] == [0, CHUNK]
    again = []
    solve_ensemble(case, observations, path, 1, again.append)
    assert (again[0].resumed, again[-1].done) == (CHUNK, CHUNKS * CHUNK)
    assert (read_ensemble(path).status == SOLVED_BY_NEWTON).all()


@pytest.mark.parametrize(
    ("damage", "expected"),
    [
        (lambda text: text.replace("0.436", "fast"), "csv, row 3: expected a number in column u, got 'fast'"),
        (lambda text: text.replace("0.436", ""), "csv, row 3: expected a number in column u, got nothing"),
        (lambda text: text.replace("section,x,y,u", "section,x,y,v"), "velocities.csv, row 1: expected the columns"),
        (lambda text: text + "below,20,2,0.397\n", "row 17: expected experiment, section, x, y to differ"),
        (lambda text: text[:14], "velocities.csv: expected rows below the heading, got none"),
        (lambda text: "", "velocities.csv: expected the columns section, x, y, u, got an empty file"),
        (lambda text: text.replace("above", "\udcff"), "velocities.csv is not text in UTF-8: save it as UTF-8"),
    ],
)
def test_a_broken_measurement_file_is_named_with_its_row(
    tmp_path: Path, say: Say, damage: Damage, expected: str
) -> None:
    write_reach(tmp_path, COARSE)
    file = tmp_path / "velocities.csv"
    file.write_bytes(damage(file.read_text(encoding="utf-8")).encode(errors="surrogateescape"))
    for step in ("check", "simulate", "infer", "report"):
        code, error = say(step)
        assert code == 2
        assert expected in error
