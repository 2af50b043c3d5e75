"""The whole line on a reach where every kind of observation was measured: each counts, and nothing stumbles over it."""

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from built_models import model_of
from reach import COARSE, write_reach

from vegglue.calibration.baseline import baseline
from vegglue.calibration.candidates import candidates_of, cause_of
from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import z_at
from vegglue.case.schema import Case
from vegglue.diagnosis import station_check
from vegglue.diagnosis.case_check import check_case
from vegglue.diagnosis.comparison import held_out_rmse, model_score
from vegglue.diagnosis.diagnose import diagnose_model
from vegglue.diagnosis.next_measurement import worth_of_measurements
from vegglue.engine.interface import linearise, responses
from vegglue.flow.sensor import FlowFields
from vegglue.inference.glue import glue
from vegglue.inference.refine import refine
from vegglue.inference.solve_ensemble import solve_ensemble, solve_flow
from vegglue.measurements.kinds import KINDS
from vegglue.measurements.observations import Observations, read_observations
from vegglue.pages.channel import save_channel_figure
from vegglue.pages.diagnosis_figures import save_diagnosis_figure, save_fingerprint_figure
from vegglue.pages.ladder_figure import save_ladder_figure
from vegglue.pages.page import write_report
from vegglue.pages.run import Run
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior
from vegglue.results.result_files import read_ensemble, read_posterior, write_posterior
from vegglue.workflow.twin import write_twin

pytestmark = pytest.mark.slow

TRUTH = {"n_b": 0.05, "q": 2.13, "phi": 8.0}
# A discharge that only those know who measured it.
CHANGES = (
    COARSE,
    ("members: 1024", "members: 64"),
    ("discharge: 2.0", "discharge: q"),
    ("\nsimulate:", "\ninfer: {sigma: known}\nsimulate:"),
    ("  phi: {dist", "  q: {distribution: uniform, low: 1.5, high: 2.5, unit: m3/s}\n  phi: {dist"),
)
GIVEN = "  - {kind: velocity, file: velocities.csv, experiment: June}"
ERROR = {"m/s": 0.01, "m": 0.003, "m3/s": 0.04}


def places() -> pd.DataFrame:
    """Three sections of velocities in every direction, two gauges and two gaugings."""
    probes = [
        (kind.name, section, x, y)
        for kind in KINDS.values()
        for section, x in (("above", 11.0), ("patch", 14.5), ("below", 20.0))
        for y in (-1.2, -0.4, 0.4, 1.2)
        if kind.velocity
    ]
    others = [(kind.name, "", x, 0.0) for kind in KINDS.values() for x in (4.0, 26.0) if not kind.velocity]
    table = pd.DataFrame([*probes, *others], columns=["kind", "section", "x", "y"])
    error = [ERROR[KINDS[name].unit] for name in table["kind"]]
    return table.assign(experiment="June", device="", used=True, reason="", value=0.0, standard_error=error)


def measured_case(folder: Path, names: tuple[str, ...]) -> Case:
    """The brook with files of these kinds: what flows at TRUTH, with errors."""
    folder.mkdir(exist_ok=True)
    case = load_case(write_reach(folder, *CHANGES, ("observations:\n" + GIVEN, "")))
    model = model_of(case, replace(read_observations(case), table=places()))
    point = linearise(model, z_at(case, {name: np.array([value]) for name, value in TRUTH.items()})[0])
    error = model.station["standard_error"]
    value = point.prediction + error * np.random.default_rng(5).standard_normal(len(error))
    files = "\n".join(f"  - {{kind: {name}, file: {KINDS[name].file}, experiment: June}}" for name in names)
    config = write_reach(folder, *CHANGES, (GIVEN, files))
    for kind in (KINDS[name] for name in names):
        rows = model.station.assign(value=value)[model.station["kind"] == kind.name]
        columns = [*(["section"] if kind.velocity else []), "x", *(["y"] if kind.at_point else [])]
        named = rows[[*columns, "value", "standard_error"]].rename(
            columns={"value": kind.column, "standard_error": kind.error_column}
        )
        named.to_csv(folder / kind.file, index=False)
    return load_case(config)


@dataclass(frozen=True)
class Line:
    """A case from its files to its posterior and its diagnosis."""

    folder: Path
    case: Case
    observations: Observations
    ensemble: Ensemble
    posterior: Posterior
    diagnosis: Diagnosis


def whole_line(folder: Path, names: tuple[str, ...]) -> Line:
    case = measured_case(folder, names)
    observations = read_observations(case)
    solve_ensemble(case, observations, folder / "ensemble.h5", 1, lambda progress: None)
    ensemble = read_ensemble(folder / "ensemble.h5")
    found = diagnose_model(model_of(case, observations))
    return Line(folder, case, observations, ensemble, refine(ensemble, model_of(case, observations)), found)


@pytest.fixture(scope="module")
def line(tmp_path_factory: pytest.TempPathFactory) -> Line:
    return whole_line(tmp_path_factory.mktemp("every"), tuple(KINDS))


def test_every_kind_is_fitted(line: Line) -> None:
    posterior = line.posterior
    assert list(posterior.fit.rmse) == list(KINDS)
    assert posterior.fit.used == len(places())
    for name, error in posterior.fit.rmse.items():
        assert error < 2.0 * ERROR[KINDS[name].unit], name
    for name, value in TRUTH.items():
        assert abs(posterior.marginals.median[name] - value) < 4.0 * posterior.marginals.sd[name], name
    assert posterior.marginals.sd["q"] < 0.04
    assert posterior.refinement.misfit.p_misfit > 1e-3


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_moves_the_weights(line: Line, name: str) -> None:
    table = line.observations.table
    there = (table["kind"] == name).to_numpy()
    moved = table.assign(value=table["value"] + 2.0 * there * table["standard_error"])
    before, after = (
        glue(line.ensemble, line.case, replace(line.observations, table=one)).sample.weights for one in (table, moved)
    )
    assert np.abs(after - before).max() > 1e-4
    assert np.ptp(line.ensemble.prediction[:, there], axis=0).min() > 0.1 * table["standard_error"][there].min()


def test_check_has_nothing_against_the_stations(line: Line) -> None:
    found = check_case(line.case, build_site(line.case), line.observations)
    assert not [one for one in found if type(one).__module__ == station_check.__name__], found
    save_channel_figure(line.case, build_site(line.case), line.observations, line.folder / "channel.png")


def test_a_diagnosis_tells_zones_of_each_kind_apart(line: Line) -> None:
    zones = line.diagnosis.misfit.zones
    assert {"floor", "floor (v)", "floor (speed)", "level", "discharge"} <= set(zones["zone"])
    assert set(zones.loc[zones["zone"] == "discharge", "section"]) == {"discharges"}
    assert zones["stations"].sum() == len(places())
    save_diagnosis_figure(line.diagnosis, line.case, line.folder / "diagnosis.png")


def test_both_commands_count_the_same_degrees_of_freedom(line: Line) -> None:
    assert line.diagnosis.misfit.freedom == line.posterior.refinement.misfit.freedom


def test_models_are_compared_and_measurements_planned(line: Line) -> None:
    base = baseline(model_of(line.case, line.observations))
    found = model_score(base)
    assert found.held_out.velocity.sum() == 12, "errors in m/s are those of velocities along x"
    assert np.isfinite([held_out_rmse(found), *found.in_sample.rmse.values()]).all()
    save_ladder_figure([found], line.folder / "ladder.png")
    wind, *_ = [one for one in candidates_of(line.case, line.observations.table) if one.name == "wind"]
    plans = worth_of_measurements(base.model, base.noise, base.fitted.point, [[(wind, {}, 1.0)]])[0]
    assert all(np.isfinite([plan.now, plan.then]).all() for plan in plans)
    trace = responses(base.model, base.fitted.point, [cause_of(line.case, wind, {})])[:, 0]
    save_fingerprint_figure(trace, base.model.station, "m/s", line.folder / "wind.png")


def _as_run(line: Line, flow: dict[str, FlowFields]) -> Run:
    site = build_site(line.case)
    return Run(
        line.folder, line.case, site, line.observations, line.ensemble, line.posterior, flow, None, line.diagnosis
    )


def test_the_page_names_every_kind_and_its_unit(line: Line) -> None:
    posterior = line.folder / "posterior.h5"
    write_posterior(posterior, line.posterior, "", "")
    flow = solve_flow(line.case, line.posterior.marginals.median)
    page = write_report(_as_run(replace(line, posterior=read_posterior(posterior)), flow))
    text = re.sub(r"data:[^\"')]*", "", page.read_text(encoding="utf-8"))
    for kind in KINDS.values():
        assert kind.words in text, kind.name
        assert (line.folder / "figures" / f"residuals-{kind.name}.svg").is_file()
    assert "m<sup>3</sup>/s" in text
    assert (line.folder / "figures" / "velocity_across-June-patch.svg").is_file()


def test_a_twin_keeps_every_kind(line: Line, tmp_path: Path) -> None:
    path = write_twin(line.case, tmp_path, line.observations.table, "")
    pd.testing.assert_frame_equal(
        read_observations(load_case(path)).table, line.observations.table, check_exact=False, atol=1e-5
    )


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> Line:
    """No velocity along x and no level."""
    return whole_line(tmp_path_factory.mktemp("other"), ("speed", "discharge"))


def test_speeds_and_discharges_alone_will_do(other: Line) -> None:
    """What speaks of velocities along x has nothing to say, and says so; what is held out are the speeds."""
    assert other.posterior.marginals.sd["q"] < 0.04
    found = model_score(baseline(model_of(other.case, other.observations)))
    assert np.isnan([found.in_sample.rmse["velocity"], found.in_sample.rmse["level"]]).all()
    assert found.in_sample.rmse["speed"] < 0.02
    assert held_out_rmse(found) < 0.02
    save_ladder_figure([found, found], other.folder / "ladder.png")
    save_diagnosis_figure(other.diagnosis, other.case, other.folder / "diagnosis.png")


def test_their_page_is_written(other: Line) -> None:
    flow = solve_flow(other.case, other.posterior.marginals.median)
    page = write_report(_as_run(other, flow))
    assert "speed" in page.read_text(encoding="utf-8")
