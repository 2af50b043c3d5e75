"""A finished result as the engine of a case: its predictions, how it is compared, and what is refused."""

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from result_files import GridFlow, write_flow_fm, write_hec_ras, write_selafin, write_trim

import vegglue
from vegglue.case.parameter_space import sobol_sample
from vegglue.case.schema import Case
from vegglue.engine.finished import compared_flows, their_predictions
from vegglue.errors import InputError
from vegglue.importers.finished_results import read_result
from vegglue.measurements.their_flow import read_their_flow
from vegglue.results.verdict import ResultCompared
from vegglue.workflow.case_run import CaseRun

N, SLOPE, DEPTH = 0.03, 0.001, 0.6
SPEED = DEPTH ** (2.0 / 3.0) * SLOPE**0.5 / N  # uniform flow between smooth walls [m/s]
WIDTH, LENGTH = 4.0, 24.0
SHEARED = np.linspace(0.3, 1.7, 8)[None, :]


def uniform(angle: float = 20.0, speed: float = SPEED, n: float = N, depth: float = DEPTH) -> GridFlow:
    """A uniform flow in a flume, turned on the map; bed at 100 m."""
    x, y = np.linspace(0.0, LENGTH, 25), np.linspace(-0.5 * WIDTH, 0.5 * WIDTH, 9)
    middle = 0.5 * (x[1:] + x[:-1])[:, None] + np.zeros((1, 8))
    full = np.full(middle.shape, 1.0)
    return GridFlow(
        x, y, 100.0 - SLOPE * middle, depth * full, speed * full, 0.0 * full, n * full, (5000.0, 3000.0), angle
    )


def folder_with(folder: Path, flow: GridFlow, write=write_hec_ras, name: str = "reach.p01.hdf", site=None) -> Path:
    """Velocities of the uniform flow at nine places on the map, and the result."""
    folder.mkdir()
    write(folder / name, flow)
    x, y = (part.ravel() for part in np.meshgrid([6.1, 12.2, 18.3], [-1.2, 0.1, 1.3], indexing="ij"))
    east, north = flow.on_map(x, y)
    angle = np.radians(flow.angle)
    table = pd.DataFrame({"section": np.repeat(["A", "B", "C"], 3), "x": east, "y": north})
    table["u"], table["v"], table["u_se"] = SPEED * np.cos(angle), SPEED * np.sin(angle), 0.01
    table.assign(v_se=0.01).to_csv(folder / "velocities.csv", index=False)
    if site is not None:
        (folder / "site.yaml").write_text(yaml.safe_dump(site), encoding="utf-8")
    return folder


def imported(folder: Path) -> Case:
    return vegglue.import_folder(folder, folder.parent / f"{folder.name}.yaml")


@pytest.mark.parametrize(
    ("write", "name", "site"),
    [
        (write_hec_ras, "reach.p01.hdf", None),
        (write_selafin, "reach.slf", {"result": {"law": "manning"}}),
        (write_flow_fm, "reach_map.nc", None),
        (write_trim, "trim-reach.nc", {"result": {"manning": N}}),
    ],
)
def test_a_folder_with_a_result_becomes_a_case(tmp_path: Path, write, name: str, site) -> None:
    """No site file is needed: bed, roughness, discharge, level and extent are those of the result."""
    case = imported(folder_with(tmp_path / "reach", uniform(), write, name, site))
    (experiment,) = case.experiments.values()
    assert experiment.discharge["upstream"] == pytest.approx(SPEED * DEPTH * WIDTH, rel=0.02)
    assert experiment.level == pytest.approx(100.0 - SLOPE * LENGTH + DEPTH, abs=0.002)
    assert case.grid.x == pytest.approx((0.0, LENGTH), abs=0.6)
    assert case.grid.y == pytest.approx((-0.5 * WIDTH, 0.5 * WIDTH), abs=0.3)
    assert case.frame.angle == pytest.approx(20.0, abs=0.05)
    assert case.finished_result.parameters["n_b"] == pytest.approx(N, rel=0.03)
    flow = read_their_flow(next(iter(case.finished_result.files.values())))
    there = flow.at(np.array([12.0]), np.array([0.3]))
    assert there["u"] == pytest.approx(SPEED, abs=1e-3)
    assert there["v"] == pytest.approx(0.0, abs=1e-3)
    assert there["level"] == pytest.approx(100.0 - 12.0 * SLOPE + DEPTH, abs=2e-3)


def test_predictions_at_stations_are_theirs(tmp_path: Path) -> None:
    """f(z_0) = f_theirs, whatever the built-in engine has there; both flows agree."""
    case = imported(folder_with(tmp_path / "reach", uniform()))
    run = CaseRun(case, tmp_path / "runs")
    found = compared_flows(run.model)
    assert found.agreement.alike
    assert found.agreement.velocity_share < 0.05
    assert found.agreement.measured < 1e-3
    model = run.commanded_model
    assert model.engine.name == "finished"
    flows = {name: read_their_flow(path) for name, path in case.finished_result.files.items()}
    theirs = their_predictions(run.observations.table, flows, run.site.grid)
    z = np.zeros(len(model.names))
    at = model.engine.linearise(model, z, None, lambda prediction: True)
    own = run.model.engine.linearise(run.model, z, None, lambda prediction: True)
    np.testing.assert_allclose(at.prediction - own.prediction, found.correction.value, atol=1e-9)
    np.testing.assert_allclose(at.slope, own.slope)
    along = (run.observations.table["kind"] == "velocity").to_numpy()
    np.testing.assert_allclose(theirs[along], SPEED, atol=1e-3)


@pytest.mark.parametrize("wrong", [{"n": 0.06}, {"speed": SPEED * SHEARED}])
def test_a_flow_that_ours_cannot_follow_is_refused_with_the_number(tmp_path: Path, wrong: dict) -> None:
    """Another n than the flow was made with, or a shear across a flat bed that friction does not allow."""
    case = imported(folder_with(tmp_path / "reach", uniform(**wrong)))
    compared = vegglue.check(case, runs=tmp_path / "runs").remarks[0]
    assert isinstance(compared, ResultCompared)
    assert not compared.alike
    assert compared.level_share > compared.limits[1] or compared.velocity_share > compared.limits[0]
    for verb in (vegglue.diagnose, vegglue.infer):
        with pytest.raises(InputError, match=r"got \d+ %"):
            verb(case, runs=tmp_path / "runs", jobs=1)
    with pytest.raises(InputError, match="finished_result"):
        vegglue.simulate(case, runs=tmp_path / "runs", jobs=1)


def test_no_members_of_a_finished_run_are_solved_by_ours(tmp_path: Path) -> None:
    """Predictions for another program would be those of the built-in engine, without a word."""
    case = imported(folder_with(tmp_path / "reach", uniform()))
    pd.DataFrame(sobol_sample(case).theta).head(2).to_csv(tmp_path / "draws.csv", index=False)
    with pytest.raises(InputError, match="finished_result"):
        vegglue.simulate(case, runs=tmp_path / "runs", jobs=1, parameters=tmp_path / "draws.csv")
    with pytest.raises(InputError, match="finished_result"):
        vegglue.export(case, runs=tmp_path / "runs", to="pest")


def test_what_import_refuses(tmp_path: Path) -> None:
    """Roughness without a law, a discharge that changes along the channel, two results, a flow across the grid."""
    with pytest.raises(InputError, match="law"):
        imported(folder_with(tmp_path / "a", uniform(), write_selafin, "reach.slf"))
    growing = uniform()
    more = replace(growing, u=growing.u * np.linspace(0.5, 1.5, 24)[:, None])
    with pytest.raises(InputError, match=r"m3/s"):
        imported(folder_with(tmp_path / "b", more))
    two = folder_with(tmp_path / "c", uniform())
    write_hec_ras(two / "other.p02.hdf", uniform())
    with pytest.raises(InputError, match="got 2"):
        imported(two)
    across = {
        "frame": {"origin": [5000.0, 3000.0], "angle": 75.0},
        "grid": {"x": [0, 3], "y": [-3, 3], "cell": [0.5, 0.5]},
    }
    with pytest.raises(InputError, match="degrees"):
        imported(folder_with(tmp_path / "d", uniform(), site=across))
    with pytest.raises(InputError, match=r"result\.law"):
        imported(folder_with(tmp_path / "e", uniform(), site={"result": {"law": "darcy"}}))


@pytest.mark.parametrize(("low", "high"), [("low", "high"), ("低", "高"), ("Q 2", "Q/2")])
def test_each_experiment_has_its_result(tmp_path: Path, low: str, high: str) -> None:
    """Also the one that is held out; discharges are those of the runs, bed and frame those of the first.

    Flows of two experiments whose names have the same Latin letters were written into one file.
    """
    speeds = {high: 1.2, "late": 1.1, low: 1.0}
    files = {name: f"{number}.p01.hdf" for number, name in enumerate(speeds)}
    site = {"result": {"files": files}, "experiments": {low: {}, high: {}}, "holdout": {"late": {}}}
    folder = folder_with(tmp_path / "reach", uniform(), name=files[low], site=site)
    for name, factor in speeds.items():
        write_hec_ras(folder / files[name], uniform(speed=factor * SPEED))
    table = pd.read_csv(folder / "velocities.csv")
    pd.concat([table.assign(experiment=name) for name in (low, high)]).to_csv(folder / "velocities.csv")
    table.assign(experiment="late").to_csv(folder / "holdout.csv")
    case = imported(folder)
    flows = case.experiments | case.validation.experiments
    for name, factor in speeds.items():
        assert flows[name].discharge["upstream"] == pytest.approx(factor * SPEED * DEPTH * WIDTH, rel=0.02)
        u = read_their_flow(case.finished_result.files[name]).at(np.array([12.0]), np.array([0.3]))["u"]
        assert u == pytest.approx(factor * SPEED, abs=1e-3)


def test_a_damaged_result_is_refused_or_read(tmp_path: Path) -> None:
    path = tmp_path / "reach.p01.hdf"
    write_hec_ras(path, uniform())
    whole = path.read_bytes()
    random = np.random.default_rng(1)
    for _ in range(6):
        bad = bytearray(whole)
        at = int(random.integers(0, len(bad) - 400))
        bad[at : at + 300] = random.bytes(300)
        path.write_bytes(bytes(bad[: int(random.integers(len(bad) // 2, len(bad)))]))
        with suppress(InputError):  # and nothing else
            read_result(path)


def test_theirs_is_set_beside_ours_and_has_a_posterior(tmp_path: Path) -> None:
    """One config is enough: its parameters are calibrated with predictions of either."""
    case = imported(folder_with(tmp_path / "reach", uniform()))
    run = CaseRun(case, tmp_path / "runs", jobs=1)
    ours, theirs = vegglue.compare([run]).model_scores
    assert (ours.name, theirs.name) == ("reach-built-in", "reach")
    assert theirs.in_sample.velocity < 0.002
    posterior = vegglue.infer(run)
    low, high = (np.quantile(posterior.sample.theta["n_b"], q) for q in (0.0, 1.0))
    assert low < N < high
