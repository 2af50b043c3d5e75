"""Results on disk: nothing lost by a kill, a full disk, a broken file or two runs; readable by xarray and ArviZ."""

import errno
import os
import signal
import socket
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest

from vegglue.ensemble import ROWS, Ensemble, Header
from vegglue.errors import InputError, StorageError
from vegglue.lock import hold_lock
from vegglue.posterior import LEVELS, CorrectedCanopy, Posterior
from vegglue.store import ensemble_writer, read_ensemble, read_posterior, stored_hash, write_posterior

MEMBERS, CHUNKS = 12, 3
HASH = "f" * 64
QUIET_ARVIZ = pytest.mark.filterwarnings("ignore:.*ArviZ is undergoing:FutureWarning")  # once a day, on import


def a_header(**changes: Any) -> Header:
    station = pd.DataFrame({
        "experiment": ["D0", "D0"], "kind": ["velocity", "level"], "section": ["D0", ""], "x": [1.0, 2.0],
        "y": [0.5, 0.5], "value": [0.4, np.nan], "standard_error": [0.01, np.nan], "used": [True, False],
        "reason": ["", "dead"], "depth": [1.1, np.nan], "device": ["A", ""],
    })  # fmt: skip
    parameters = {"z_last": np.linspace(1, 2, MEMBERS), "a_first": np.linspace(3, 4, MEMBERS)}
    header = Header(
        parameters, {"z_last": "m", "a_first": "-"}, station, ("D0",), (("D0", 1.0), ("D3", 7.0)), CHUNKS,
        "name: d0\n", HASH, 5, "0.1.0",
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


def write_chunks(path: Path, chunks: tuple[int, ...], header: Header | None = None) -> None:
    with ensemble_writer(path, header or a_header()) as writer:
        for chunk in chunks:
            writer.append(chunk, members_of(chunk), rows_of(chunk))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "runs" / "d0" / "ensemble.h5"


def part(path: Path) -> Path:
    return path.with_name("ensemble.h5.part")


def assert_whole(ensemble: Ensemble) -> None:
    member = np.arange(MEMBERS)
    assert ensemble.prediction == pytest.approx(member[:, None] + np.array([0.1, 0.2]))
    assert ensemble.status.tolist() == (member % 3).tolist()
    assert ensemble.reason.tolist() == [f"Größe {each}" for each in member]
    assert ensemble.iterations.tolist() == member.tolist()
    assert ensemble.mass_error == pytest.approx(member * 1e-6)
    assert ensemble.seconds == pytest.approx(member * 0.5)
    assert ensemble.section_flow.shape == (MEMBERS, 1, 2)


def test_ensemble_comes_back_as_it_went(path: Path) -> None:
    write_chunks(path, (2, 0, 1))
    ensemble, header = read_ensemble(path, HASH), a_header()
    assert_whole(ensemble)
    assert list(ensemble.parameters) == ["z_last", "a_first"]  # the order of the config
    assert all(np.array_equal(ensemble.parameters[name], header.parameters[name]) for name in header.parameters)
    pd.testing.assert_frame_equal(ensemble.station, header.station, check_dtype=False)
    assert ensemble.station["used"].dtype == bool
    assert (ensemble.experiments, ensemble.sections) == (header.experiments, header.sections)
    assert (ensemble.config, ensemble.seed, ensemble.version) == ("name: d0\n", 5, "0.1.0")
    assert stored_hash(path) == HASH
    assert not part(path).exists()


def test_unfinished_run_is_resumed(path: Path) -> None:
    write_chunks(path, (1,))
    assert not path.exists()
    with pytest.raises(InputError, match="only a part"):
        read_ensemble(path)
    with ensemble_writer(path, a_header()) as writer:
        assert writer.done == {1}
        assert writer.set_aside is None
        for chunk in (0, 2):
            writer.append(chunk, members_of(chunk), rows_of(chunk))
    assert_whole(read_ensemble(path))


def test_members_survive_an_exception_in_the_run(path: Path) -> None:
    with suppress(KeyboardInterrupt), ensemble_writer(path, a_header()) as writer:
        writer.append(0, members_of(0), rows_of(0))
        raise KeyboardInterrupt
    with ensemble_writer(path, a_header()) as writer:
        assert writer.done == {0}


APPEND_FOREVER = """
    import sys
    from pathlib import Path
    sys.path.insert(0, {tests!r})
    from test_store import a_header, members_of, rows_of
    from vegglue.store import ensemble_writer
    with ensemble_writer(Path({path!r}), a_header()) as writer:
        writer.append(1, members_of(1), rows_of(1))
        print("appended", flush=True)
        while True:
            writer.append(2, members_of(2), rows_of(2))
"""


def start(code: str, **names: str) -> "subprocess.Popen[str]":
    program = textwrap.dedent(code).format(tests=str(Path(__file__).parent), **names)
    return subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)


@pytest.mark.parametrize("delay", [0.0, 0.013, 0.05])
def test_members_survive_a_kill_while_appending(path: Path, delay: float) -> None:
    with start(APPEND_FOREVER, path=str(path)) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "appended\n"
        time.sleep(delay)
        process.send_signal(signal.SIGKILL)
        process.wait()
    with ensemble_writer(path, a_header()) as writer:
        assert writer.set_aside is None
        assert 1 in writer.done
        for chunk in {0, 1, 2} - writer.done:
            writer.append(chunk, members_of(chunk), rows_of(chunk))
    assert_whole(read_ensemble(path))


OTHER_PARAMETERS = {"z_last": np.ones(MEMBERS), "a_first": np.ones(MEMBERS)}


@pytest.mark.parametrize(
    "changes",
    [{"config_hash": "e" * 64}, {"seed": 6}, {"version": "0.2.0"}, {"chunks": 4}, {"parameters": OTHER_PARAMETERS}],
)
def test_unfinished_run_of_another_config_is_set_aside(path: Path, changes: dict[str, Any]) -> None:
    write_chunks(path, (1,))
    with ensemble_writer(path, a_header(**changes)) as writer:
        assert writer.done == set()
        assert writer.set_aside is not None
        with h5py.File(writer.set_aside) as old:
            assert old["progress/finished"][:].tolist() == [0, 1, 0]


def test_broken_part_file_is_set_aside(path: Path) -> None:
    write_chunks(path, (1,))
    part(path).write_bytes(part(path).read_bytes()[:700])
    with ensemble_writer(path, a_header()) as writer:
        assert writer.done == set()
        assert writer.set_aside == path.with_name("ensemble.h5.part.old")


def test_missing_other_and_broken_ensembles_are_told(path: Path) -> None:
    with pytest.raises(InputError, match=r"ensemble\.h5: .*found no file; run `vegglue simulate CONFIG`"):
        read_ensemble(path)
    write_chunks(path, (0, 1, 2))
    with pytest.raises(InputError, match=r"expected config hash eeeeeeeeeeee, found ffffffffffff: .* again"):
        read_ensemble(path, "e" * 64)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(StorageError, match="cannot be opened"):
        read_ensemble(path)
    assert stored_hash(path) is None
    path.write_bytes(content)
    with h5py.File(path, "r+") as file:
        del file["members/seconds"]
    with pytest.raises(StorageError, match="is broken or of another version"):
        read_ensemble(path)


def test_rows_that_do_not_match_the_file_are_refused(path: Path) -> None:
    rows = rows_of(0)
    del rows["seconds"]
    with ensemble_writer(path, a_header()) as writer, pytest.raises(ValueError, match="expected the rows"):
        writer.append(0, members_of(0), rows)


def test_long_reasons_are_cut_between_characters(path: Path) -> None:
    with ensemble_writer(path, a_header()) as writer:
        for chunk in range(CHUNKS):
            reasons = np.array(["x" + "ü" * 300] * len(members_of(chunk)), object)
            writer.append(chunk, members_of(chunk), rows_of(chunk) | {"reason": reasons})
    assert set(read_ensemble(path).reason) == {"x" + "ü" * 119}


def test_parameter_named_like_a_dimension_is_refused(path: Path) -> None:
    named = {"member": np.ones(MEMBERS)}
    with pytest.raises(InputError, match=r"\['member'\] are names of dimensions .* rename"):
        write_chunks(path, (), a_header(parameters=named, units={"member": "-"}))
    assert [file.name for file in path.parent.iterdir()] == [".lock"]


def no_space(handle: int) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def test_full_disk_while_appending_keeps_what_was_written(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with ensemble_writer(path, a_header()) as writer:
        writer.append(0, members_of(0), rows_of(0))
        with monkeypatch.context() as patch:
            patch.setattr("vegglue.store.os.fsync", no_space)
            with pytest.raises(StorageError, match=r"ensemble\.h5\.part: the disk is full; .* make room"):
                writer.append(1, members_of(1), rows_of(1))
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
        write_chunks(path, (), a_header(parameters={"a": many}, units={"a": "-"}))
    assert [file.name for file in full_disk.iterdir()] == [".lock"]


def fill_up(path: Path) -> None:
    with suppress(OSError), path.open("wb", buffering=0) as file:
        while file.write(bytes(4096)):
            pass
    assert os.statvfs(path.parent).f_bavail == 0


def test_disk_that_fills_up_later_cannot_stop_a_run(full_disk: Path) -> None:
    path = full_disk / "ensemble.h5"
    with ensemble_writer(path, a_header()) as writer:
        writer.append(0, members_of(0), rows_of(0))
        fill_up(full_disk / "other")
        writer.append(1, members_of(1), rows_of(1))
        writer.append(2, members_of(2), rows_of(2))
    assert_whole(read_ensemble(path))


HOLD = """
    import time
    from pathlib import Path
    from vegglue.lock import hold_lock
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


@pytest.mark.parametrize("group", ["members", "parameters", "stations", "progress"])
def test_xarray_opens_every_group_of_an_ensemble(path: Path, group: str) -> None:
    xarray = pytest.importorskip("xarray")
    write_chunks(path, (0, 1, 2))
    with xarray.open_dataset(path, group=group, engine="h5netcdf") as data:
        data.load()
    if group == "members":
        assert set(data.data_vars) == {*ROWS, "section_x"}
        assert data["section_flow"].dims == ("member", "experiment", "section")
        assert data["section"].values.tolist() == ["D0", "D3"]
        assert data["seconds"].attrs["units"] == "s"
    if group == "stations":
        assert data["used"].values.tolist() == [True, False]


def a_posterior(canopy: bool) -> Posterior:
    """Two parameters, two stations of which one is used; every number differs from every other."""
    random = np.random.default_rng(8)
    names, station = ("n_b", "phi"), a_header().station
    weights = random.random(MEMBERS)
    two, levels = {"n_b": 0.1, "phi": 2.0}, {name: random.random(len(LEVELS)) for name in names}
    sides = {name: random.random(2) for name in names}
    per_kind = {"velocity": 0.02}
    draws = random.integers(0, MEMBERS, (4, 500))
    log_likelihood = random.random((MEMBERS, 2)) * [1, np.nan]
    predictive = random.random((4, 500, 2))
    corrected = CorrectedCanopy("phi", 0.8, 1.06, 1.36, random.random(MEMBERS), 1.5, 0.2, levels["phi"], 0.18, 0.12)
    return Posterior(
        parameters=names, likelihood="gaussian", sigma_rule="best-member", threshold=-np.inf, members=MEMBERS, failed=1,
        weighed=11, used=1, best=3, effective_size=7.5, largest_weight=0.3, pareto_k=0.4, chi2=np.nan,
        ensemble_hash=HASH, seed=5, version="0.1.0", unit={"n_b": "s m^(-1/3)", "phi": "-"},
        theta={name: random.random(MEMBERS) for name in names}, weights=weights / weights.sum(), efficiency=weights - 1,
        log_likelihood=log_likelihood, prediction=random.random((MEMBERS, 2)), median=two, sd=two, quantiles=levels,
        prior_quantiles=levels, log10_median={"phi": 0.3}, log10_sd={"phi": 0.1}, correlation=random.random((2, 2)),
        width_ratio=two, identified={"n_b": True, "phi": False}, bounds=sides, bound_mass=sides,
        bound_hit={"n_b": np.array([True, False]), "phi": np.array([False, False])}, sigma=per_kind, rmse=per_kind,
        best_rmse=per_kind, noise=np.array([0.02, np.nan]), residual=random.random(2), best_residual=random.random(2),
        model_band=random.random((5, 2)), total_band=random.random((5, 2)), draws=draws, predictive=predictive,
        station=station, canopy=corrected if canopy else None, method="glue", refinement=None, transfer=None,
    )  # fmt: skip


def assert_same(one: Any, other: Any) -> None:
    assert type(one) is type(other)
    if isinstance(one, dict):
        assert list(one) == list(other)
        for key in one:
            assert_same(one[key], other[key])
    elif isinstance(one, pd.DataFrame):
        pd.testing.assert_frame_equal(one, other, check_dtype=False)
    elif isinstance(one, Posterior | CorrectedCanopy):
        for field in fields(one):
            assert_same(getattr(one, field.name), getattr(other, field.name))
    else:
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("canopy", [True, False])
def test_posterior_comes_back_as_it_went(tmp_path: Path, canopy: bool) -> None:
    posterior = a_posterior(canopy)
    write_posterior(tmp_path / "posterior.h5", posterior, "name: d0\n", HASH)
    assert_same(read_posterior(tmp_path / "posterior.h5", HASH), posterior)
    with pytest.raises(InputError, match="run `vegglue infer CONFIG` again"):
        read_posterior(tmp_path / "posterior.h5", "e" * 64)


def test_posterior_without_logarithmic_parameters_comes_back(tmp_path: Path) -> None:
    posterior = replace(a_posterior(False), log10_median={}, log10_sd={})
    write_posterior(tmp_path / "posterior.h5", posterior, "", HASH)
    assert_same(read_posterior(tmp_path / "posterior.h5"), posterior)


def test_failed_write_leaves_the_older_posterior(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "posterior.h5"
    write_posterior(path, a_posterior(False), "", HASH)

    with monkeypatch.context() as patch:
        patch.setattr("vegglue.store.os.fsync", no_space)
        with pytest.raises(StorageError, match="the disk is full"):
            write_posterior(path, a_posterior(True), "", "e" * 64)
    assert stored_hash(path) == HASH
    assert list(tmp_path.iterdir()) == [path]


@QUIET_ARVIZ
def test_xarray_opens_every_group_of_a_posterior(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    write_posterior(tmp_path / "posterior.h5", a_posterior(True), "", HASH)
    with h5py.File(tmp_path / "posterior.h5") as file:
        names = set(file)
    assert names == {"posterior", "prior", "log_likelihood", "posterior_predictive", "observed_data", "constant_data",
                     "sample_stats", "members", "stations", "canopy"}  # fmt: skip
    for name in names:
        with xarray.open_dataset(tmp_path / "posterior.h5", group=name, engine="h5netcdf") as data:
            data.load()
            assert not any(variable.startswith("phony") for variable in data.sizes)


@QUIET_ARVIZ
def test_arviz_summarises_and_plots_a_posterior(tmp_path: Path) -> None:
    arviz, matplotlib = pytest.importorskip("arviz"), pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    posterior = a_posterior(True)
    write_posterior(tmp_path / "posterior.h5", posterior, "", HASH)
    data = arviz.from_netcdf(tmp_path / "posterior.h5", engine="h5netcdf")
    summary = arviz.summary(data, kind="stats", round_to="none")
    assert list(summary.index) == ["n_b", "phi"]
    assert summary.loc["phi", "mean"] == pytest.approx(posterior.theta["phi"][posterior.draws].mean())
    assert data.posterior["phi"].dims == ("chain", "draw")
    assert data.log_likelihood["measured"].shape == (4, 500, 1)  # used stations only
    assert data.observed_data["measured"].values.tolist() == [0.4]
    assert arviz.plot_pair(data) is not None
    matplotlib.pyplot.close("all")
