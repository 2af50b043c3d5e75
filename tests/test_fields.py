"""Fields kept of every member: what they predict is what sensors read, and no kill parts them from the ensemble."""

import os
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
from channels import make_problem
from reach import COARSE, said_to, write_reach
from test_store import CHUNKS, HASH, MEMBERS, a_header, members_of, no_space, rows_of, start

from vegglue import simulate as simulation
from vegglue.check import check_case
from vegglue.config import load_case, simulation_hash
from vegglue.ensemble import FAILED, Ensemble, Header
from vegglue.errors import InputError, StorageError
from vegglue.fields import Fields, Window, fields_group, megabytes, predict_at, window_of
from vegglue.flow import ACROSS, ALONG, LEVEL
from vegglue.observations import read_observations
from vegglue.schema import Case
from vegglue.sensor import read_sensors
from vegglue.simulate import simulate, solve_flow
from vegglue.site import Grid, build_grid, build_site
from vegglue.store import EnsembleWriter, ensemble_writer, read_ensemble, read_fields

X, Y = np.array([0.5, 1.5]), np.array([0.25, 0.75, 1.25])
SMALL = ("members: 1024, seed: 7", "members: 16, seed: 7, fields: {x: [8, 20]}")
Finished = tuple[Case, Ensemble, Fields]


def header(**changes: Any) -> Header:
    return a_header(window=Window((0.6, 1.4), slice(0, 2), X, Y), **changes)


def values(member: int) -> np.ndarray:
    """Level, u and v (experiment, quantity, x, y) of a member, one cell dry."""
    fields = member + np.arange(3 * X.size * Y.size).reshape(1, 3, X.size, Y.size) / 32
    fields[:, :, 0, 2] = np.nan
    return fields.astype(np.float32)


def append(writer: EnsembleWriter, chunk: int) -> None:
    members = members_of(chunk)
    writer.append(chunk, members, rows_of(chunk), np.stack([values(member) for member in members]))


def write_chunks(path: Path, chunks: set[int], header: Header) -> set[int]:
    """Appends chunks to what is there; returns what was."""
    with ensemble_writer(path, header) as writer:
        done = writer.done
        for chunk in sorted(chunks - done):
            append(writer, chunk)
    return done


def assert_whole(path: Path) -> None:
    fields = read_fields(path.with_name("fields.h5"), HASH)
    for place, field in enumerate((fields.level, fields.u, fields.v)):
        np.testing.assert_array_equal(field, np.stack([values(member)[:, place] for member in range(MEMBERS)]))
    assert read_ensemble(path, HASH).iterations.tolist() == list(range(MEMBERS))
    assert {file.name for file in path.parent.iterdir()} == {".lock", "ensemble.h5", "fields.h5"}


ALL = set(range(CHUNKS))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "runs" / "d0" / "ensemble.h5"


def test_fields_come_back_as_they_went(path: Path) -> None:
    write_chunks(path, ALL, header())
    assert_whole(path)
    fields = read_fields(path.with_name("fields.h5"))
    assert (fields.experiments, fields.range, fields.config_hash) == (("D0",), (0.6, 1.4), HASH)
    assert (fields.x.tolist(), fields.y.tolist()) == (X.tolist(), Y.tolist())


def test_the_file_is_single_precision_compressed_and_opened_by_xarray(path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    write_chunks(path, ALL, header())
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
        assert float(data.v.sel(member=5, experiment="D0", x=1.5, y=0.75)) == values(5)[0, 2, 1, 1]


def test_large_fields_are_compressed_in_batches_of_members() -> None:
    window = Window((0, 9), slice(0, 100), np.arange(100.0), np.arange(50.0))
    group = fields_group(window, ("D0",), np.zeros((400, 1, 3, 100, 50), np.float32))
    assert group.variables["u"].compressed == (52, 1, 100, 50)


def test_without_a_window_no_fields_are_written(path: Path) -> None:
    write_chunks(path, ALL, a_header())
    with pytest.raises(InputError, match=r"fields\.h5: .* say in `simulate\.fields` where .* run `vegglue simulate"):
        read_fields(path.with_name("fields.h5"))


def test_fields_of_another_config_are_refused(path: Path) -> None:
    write_chunks(path, ALL, header())
    with pytest.raises(InputError, match="run `vegglue simulate CONFIG` again"):
        read_fields(path.with_name("fields.h5"), "e" * 64)


def test_rows_without_their_fields_are_refused(path: Path) -> None:
    with ensemble_writer(path, header()) as writer:
        with pytest.raises(ValueError, match="expected fields"):
            writer.append(0, members_of(0), rows_of(0))
        with pytest.raises(ValueError, match="expected fields of shape"):
            writer.append(0, members_of(0), rows_of(0), np.zeros((4, 1, 3, 2, 2), np.float32))
        assert writer.done == set()


APPEND_FOREVER = """
    import sys
    from pathlib import Path
    sys.path.insert(0, {tests!r})
    from test_fields import append, header
    from vegglue.store import ensemble_writer
    with ensemble_writer(Path({path!r}), header()) as writer:
        append(writer, 1)
        print("appended", flush=True)
        while True:
            append(writer, 2)
"""


@pytest.mark.parametrize("delay", [0.0, 0.013, 0.05])
def test_a_kill_while_appending_leaves_rows_and_fields_alike(path: Path, delay: float) -> None:
    with start(APPEND_FOREVER, path=str(path)) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "appended\n"
        time.sleep(delay)
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert 1 in write_chunks(path, ALL, header())
    assert_whole(path)


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

    with ensemble_writer(path, header()) as writer:
        append(writer, 0)
        with monkeypatch.context() as patch:
            patch.setattr("os.fsync", fill_up)
            with pytest.raises(StorageError, match=r"the disk is full; .* make room"):
                append(writer, 1)
    assert flushed
    assert write_chunks(path, ALL, header()) == {0}
    assert_whole(path)


def test_no_room_for_the_fields_is_told_before_the_first_member(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.fsync", no_space)
    with pytest.raises(StorageError, match=r"fields\.part: the disk is full"):
        write_chunks(path, set(), header())
    assert [file.name for file in path.parent.iterdir()] == [".lock"]


def test_no_room_for_the_compressed_fields_loses_no_member(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    new = path.with_name("fields.h5.new")
    with monkeypatch.context() as patch:
        patch.setattr("os.fsync", lambda handle: no_space(handle) if new.exists() else None)
        with pytest.raises(StorageError, match=r"fields\.h5: the disk is full; .* run the same command again"):
            write_chunks(path, ALL, header())
    assert not path.exists()
    assert not new.exists()
    assert write_chunks(path, ALL, header()) == ALL
    assert_whole(path)


def test_a_stop_between_fields_and_ensemble_is_made_up_for(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    replaced = os.replace

    def stop(old: Path, new: Path) -> None:
        if new == path:
            raise KeyboardInterrupt
        replaced(old, new)

    with monkeypatch.context() as patch, suppress(KeyboardInterrupt):
        patch.setattr("os.replace", stop)
        write_chunks(path, ALL, header())
    assert path.with_name("fields.h5").exists()
    assert not path.exists()
    assert write_chunks(path, ALL, header()) == ALL
    assert_whole(path)


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
    write_chunks(path, {0, 2}, header())
    damage(path.with_name("fields.part"))
    with ensemble_writer(path, header()) as writer:
        assert writer.done == set()
        assert writer.set_aside == path.with_name("ensemble.h5.part.old")
        writer.set_aside.unlink()
        for chunk in ALL:
            append(writer, chunk)
    assert_whole(path)


def test_a_run_of_another_config_starts_its_own_fields(path: Path) -> None:
    write_chunks(path, {1}, header(config_hash="e" * 64))
    assert write_chunks(path, ALL, header()) == set()
    path.with_name("ensemble.h5.part.old").unlink()
    assert_whole(path)


def some_fields() -> Fields:
    """level = 2 x + 3 y and u = x y + member, one cell dry."""
    level = np.broadcast_to(2 * X[:, None] + 3 * Y, (MEMBERS, 1, 2, 3)).astype(np.float32)
    u = (np.outer(X, Y) + np.arange(MEMBERS)[:, None, None, None]).astype(np.float32)
    u[:, :, 1, 2] = np.nan
    return Fields(level, u, -u, ("D0",), X, Y, (0.4, 1.4), HASH)


def test_a_prediction_is_bilinear() -> None:
    fields = some_fields()
    assert predict_at(fields, 0.9, 0.4, "level") == pytest.approx(np.full((MEMBERS, 1), 3.0))
    assert predict_at(fields, 0.9, 0.4)[:, 0] == pytest.approx(0.36 + np.arange(MEMBERS))
    assert predict_at(fields, 0.9, 0.4, "v")[:, 0] == pytest.approx(-0.36 - np.arange(MEMBERS))
    assert predict_at(fields, 0.4, 0.1, "level") == pytest.approx(np.full((MEMBERS, 1), 1.75))  # as the last centres


def test_a_dry_cell_makes_a_prediction_unknown_only_where_it_counts() -> None:
    fields = some_fields()
    assert np.isnan(predict_at(fields, 0.6, 0.8)).all()
    assert np.isfinite(predict_at(fields, 0.6, 0.75)).all()
    assert np.isfinite(predict_at(fields, 0.5, 1.2)).all()


@pytest.mark.parametrize(("x", "y"), [(0.39, 0.5), (1.41, 0.5), (0.9, -0.01), (0.9, 1.51), (np.nan, 0.5)])
def test_a_point_outside_the_window_is_refused(x: float, y: float) -> None:
    with pytest.raises(InputError, match=r"outside the fields that were kept, 0\.4 to 1\.4 m by 0 to 1\.5 m"):
        predict_at(some_fields(), x, y)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """Sixteen members of the reach of the README with fields from its first section to its last."""
    folder = tmp_path_factory.mktemp("fields")
    case = load_case(write_reach(folder, COARSE, SMALL))
    simulate(case, read_observations(case), folder / "ensemble.h5", 1, lambda progress: None)
    wanted = simulation_hash(case)
    return case, read_ensemble(folder / "ensemble.h5", wanted), read_fields(folder / "fields.h5", wanted)


def test_fields_predict_what_the_sensors_of_the_ensemble_read(finished: Finished) -> None:
    _, ensemble, fields = finished
    assert len(ensemble.station) == 15
    for number, row in ensemble.station.iterrows():
        predicted = predict_at(fields, row["x"], row["y"])
        np.testing.assert_allclose(predicted[:, 0], ensemble.prediction[:, number], rtol=3e-7, err_msg=f"{row['x']}")


def test_fields_are_the_flow_of_their_member(finished: Finished) -> None:
    case, ensemble, fields = finished
    columns = np.isin(build_grid(case).x, fields.x)
    assert 9 < columns.sum() < 13
    for member in (0, 11):
        flow = solve_flow(case, {name: values[member] for name, values in ensemble.parameters.items()})["June"]
        wet = np.isfinite(flow.level[columns])
        for name in ("level", "u", "v"):
            kept = getattr(fields, name)[member, 0]
            np.testing.assert_allclose(kept[wet], getattr(flow, name)[columns][wet], atol=1e-5, err_msg=name)
        assert np.abs(kept[wet]).max() > 0.01


def test_what_is_kept_is_at_centres_and_dry_where_no_part_of_a_cell_is_wet() -> None:
    """A bank that rises by 0.4 m from one row to the next; water just over the lowest corner of the third, 0.6 m."""
    bed = np.repeat(0.4 * np.arange(6.0)[None], 5, axis=0)
    problem = make_problem(bed, (1.0, 1.0), 0.1, 0.62, film=0.01)
    state = np.zeros((5, 3, 6, 1))
    state[:, LEVEL] = 0.62
    state[:, ALONG, :, 0], state[:, ACROSS, :, 0] = 0.1 * np.arange(5)[:, None], 0.2 * np.arange(6)
    station = pd.DataFrame({"kind": ["velocity"], "x": [2.5], "y": [1.5]})
    grid = Grid(np.arange(5) + 0.5, np.arange(6) + 0.5, 1.0, 1.0)
    kept = read_sensors(problem, state, grid, station, (), slice(1, 4)).fields
    assert (kept.shape, kept.dtype) == ((1, 3, 3, 6), np.float32)
    assert np.isfinite(kept).all(axis=(0, 1, 2)).tolist() == [True, True, True, False, False, False]
    assert np.isnan(kept[..., 3:]).all()
    level, u, v = kept[0, :, :, :3]
    assert (level == np.float32(0.62)).all()
    assert u == pytest.approx(np.repeat([[0.05], [0.15], [0.25]], 3, axis=1))
    assert v == pytest.approx(np.tile([0.1, 0.3, 0.5], (3, 1)))


@pytest.mark.parametrize("bounds", [(8.0, 20.0), (0.0, 30.0), (0.0, 0.1), (29.9, 30.0), (9.375, 10.625), (10.0, 10.01)])
def test_a_window_holds_what_its_range_needs(finished: Finished, bounds: tuple[float, float]) -> None:
    case = changed(finished[0], fields=finished[0].simulate.fields.model_copy(update={"x": bounds}))
    grid = build_grid(case)
    window = window_of(case, grid)
    assert window is not None
    assert window.x.tolist() == grid.x[window.columns].tolist()
    assert window.x.size >= 2
    for x in bounds:
        assert window.x[0] <= max(x, grid.x[0])
        assert min(x, grid.x[-1]) <= window.x[-1]
    assert window.x[0] > bounds[0] - 2 * grid.dx
    assert window.x[-1] < bounds[1] + 2 * grid.dx + 1e-9


def changed(case: Case, **keys: Any) -> Case:
    return case.model_copy(update={"simulate": case.simulate.model_copy(update=keys)})


def test_a_failed_member_has_no_fields(finished: Finished, monkeypatch: pytest.MonkeyPatch) -> None:
    case, _, _ = finished
    solve = simulation.solve_members

    def fail_second(*arguments: Any) -> Any:
        solved = solve(*arguments)
        return replace(solved, status=np.where(np.arange(len(solved.status)) == 1, FAILED, solved.status))

    monkeypatch.setattr(simulation, "solve_members", fail_second)
    rows = simulation.solve_chunk(case, build_site(case), read_observations(case), np.full((3, 2), 0.4))
    assert [bool(np.isfinite(fields).any()) for fields in rows["fields"]] == [True, False, True]


def test_fields_beyond_their_budget_are_refused_with_what_to_do(
    finished: Finished, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    config = write_reach(tmp_path, COARSE, ("seed: 7", "seed: 7, fields: {x: [8, 20]}, field_budget: 1"))
    monkeypatch.chdir(tmp_path)
    code, error = said_to(monkeypatch, capsys, "simulate", config.name)
    assert (code, error.count("\n")) == (2, 1), error
    assert error.startswith("brook.yaml: `simulate.fields` keeps 1.769 MB of 1,024 members, more than the 1 MB of")
    assert "shorten its 12 m along x to 5 m, take fewer members, or raise the budget." in error
    assert not (tmp_path / "runs/brook/fields.part").exists()
    case = load_case(config)
    assert any("will not be simulated" in each for each in check_case(case, build_site(case), read_observations(case)))
    advised = changed(case, fields=case.simulate.fields.model_copy(update={"x": (8.0, 13.0)}))
    window = window_of(advised, build_grid(advised))
    assert window is not None
    assert megabytes(advised, window) <= 1


def test_a_window_outside_the_grid_is_refused(tmp_path: Path) -> None:
    config = write_reach(tmp_path, ("seed: 7", "seed: 7, fields: {x: [8, 31]}"))
    with pytest.raises(InputError, match=r"`simulate\.fields\.x` expected a range within 0 to 30 m, got 8 to 31 m"):
        load_case(config)


def test_an_ensemble_depends_on_its_window_but_not_on_the_budget(finished: Finished) -> None:
    case, _, _ = finished
    assert simulation_hash(changed(case, field_budget=300.0)) == simulation_hash(case)
    assert simulation_hash(changed(case, fields=None)) != simulation_hash(case)
    assert simulation_hash(changed(case, members=17)) != simulation_hash(case)


def test_fields_that_were_removed_are_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    config = write_reach(tmp_path, COARSE, SMALL)
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "runs/brook/fields.h5"
    for _ in range(2):
        assert said_to(monkeypatch, capsys, "simulate", config.name, "--jobs", 1) == (0, "")
        assert path.exists()
        path.unlink()
