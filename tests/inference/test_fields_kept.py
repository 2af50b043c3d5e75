"""Fields kept of every member: what they predict is what sensors read, and how large a window may be."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from channels import make_problem
from reach import COARSE, Say, write_reach
from stored import HASH, MEMBERS, X, Y

from vegglue.case.config import load_case
from vegglue.case.grid import Grid, build_grid
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import sample_at
from vegglue.case.resolved_config import simulation_hash
from vegglue.case.schema import Case
from vegglue.diagnosis.case_check import check_case
from vegglue.diagnosis.channel_check import FieldsBeyondBudget
from vegglue.errors import InputError
from vegglue.flow import nested_grids
from vegglue.flow.problem import ACROSS, ALONG, LEVEL
from vegglue.flow.sensor import read_sensors
from vegglue.flow.status import FAILED
from vegglue.inference.solve_ensemble import solve_chunk, solve_ensemble, solve_flow
from vegglue.measurements.observations import read_observations
from vegglue.results.ensemble import Ensemble, Fields, megabytes, predict_at, window_of
from vegglue.results.result_files import read_ensemble, read_fields

SMALL = ("members: 1024, seed: 7", "members: 16, seed: 7, fields: {x: [8, 20]}")
Finished = tuple[Case, Ensemble, Fields]


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
    """Sixteen members of the reach of docs/own_case.md with fields from its first section to its last."""
    folder = tmp_path_factory.mktemp("fields")
    case = load_case(write_reach(folder, COARSE, SMALL))
    solve_ensemble(case, read_observations(case), folder / "ensemble.h5", 1, lambda progress: None)
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
    solve = nested_grids.solve_nested

    def fail_second(*arguments: Any) -> Any:
        solved = solve(*arguments)
        return replace(solved, status=np.where(np.arange(len(solved.status)) == 1, FAILED, solved.status))

    monkeypatch.setattr("vegglue.inference.solve_ensemble.solve_nested", fail_second)
    rows = solve_chunk(case, build_site(case), read_observations(case), sample_at(case, np.full((3, 2), 0.4)))
    assert [bool(np.isfinite(fields).any()) for fields in rows["fields"]] == [True, False, True]


def test_fields_beyond_their_budget_are_refused_with_what_to_do(
    finished: Finished, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say
) -> None:
    config = write_reach(tmp_path, COARSE, ("seed: 7", "seed: 7, fields: {x: [8, 20]}, field_budget: 1"))
    monkeypatch.chdir(tmp_path)
    code, error = say("simulate", config.name)
    assert (code, error.count("\n")) == (2, 1), error
    assert error.startswith("brook.yaml: `simulate.fields` keeps 1.769 MB of 1,024 members, more than the 1 MB of")
    assert "shorten its 12 m along x to 5 m, take fewer members, or raise the budget." in error
    assert not (tmp_path / "runs/brook/fields.part").exists()
    case = load_case(config)
    remarks = check_case(case, build_site(case), read_observations(case))
    assert any(isinstance(one, FieldsBeyondBudget) for one in remarks)
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


def test_fields_that_were_removed_are_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say) -> None:
    config = write_reach(tmp_path, COARSE, SMALL)
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "runs/brook/fields.h5"
    for _ in range(2):
        assert say("simulate", config.name, "--jobs", 1) == (0, "")
        assert path.exists()
        path.unlink()
