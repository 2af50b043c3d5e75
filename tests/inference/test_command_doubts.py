"""What a command leaves that are no predictions: marks, zeros, values that do not follow the parameters."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from commands import SMOOTH, commanded
from reach import COARSE

import vegglue
from vegglue.case.config import load_case
from vegglue.engine.command import FailedRunError, refuse_marks
from vegglue.errors import InputError
from vegglue.flow.status import FAILED, RUN_BY_COMMAND
from vegglue.inference.command_ensemble import (
    FailuresFollowParameter,
    ParametersWithoutInfluence,
    PredictionsRepeated,
    PredictionsUnchanged,
    StationsUnchanged,
    doubts_of_predictions,
    refuse_useless,
)
from vegglue.inference.glue import efficiency
from vegglue.results.ensemble import Ensemble
from vegglue.wording.sentences import sentence
from vegglue.workflow.check import check

MEMBERS, U = 64, np.array([0.4, 0.3, 0.02, 0.25])
STATION = pd.DataFrame({
    "experiment": "June", "kind": ["velocity", "velocity", "velocity", "level"], "section": "A", "x": [1.0, 2.0, 3, 4],
    "y": 0.5, "value": [0.41, 0.28, 0.02, 0.95], "standard_error": 0.01, "used": True, "reason": "", "depth": 1.0,
    "device": "",
})  # fmt: skip


def predicted(prediction: np.ndarray, station: pd.DataFrame) -> bool:
    """Whether these are predictions, and no marks."""
    try:
        refuse_marks(prediction, station)
    except FailedRunError:
        return False
    return True


@pytest.mark.parametrize(
    ("station", "value", "refused"),
    [
        (0, -999.0, True), (0, -9999.0, True), (0, -99.0, True), (0, -9.0, True), (0, 1e20, True), (0, -32.768, True),
        (3, -999.0, True), (3, 9999.0, True), (3, 3.4e38, True), (3, 0.0, True), (0, 0.0, True), (1, -0.0, True),
        (2, 0.0, False), (0, 0.9, False), (0, -0.3, False), (3, 1.2, False), (2, 0.9, False),
    ],
)  # fmt: skip
def test_a_mark_or_a_zero_at_a_measured_flow_is_no_prediction(station: int, value: float, refused: bool) -> None:
    prediction = U.copy()
    prediction[station] = value
    assert predicted(prediction, STATION) != refused


def test_a_mark_that_was_measured_is_a_value() -> None:
    """A level of 99.9 m beside one of 99.87 m, a discharge of 999 m3/s."""
    station = STATION.assign(kind=["level", "level", "discharge", "discharge"], value=[99.87, 99.8, 1010.0, 30.0])
    assert predicted(np.array([99.9, 99.0, 999.0, 29.0]), station.assign(value=[99.87, 99.8, 998.0, 30.0]))
    assert not predicted(np.array([99.9, 99.0, -999.0, 29.0]), station)


def test_a_straight_flow_has_no_velocity_across_and_an_unused_station_may_be_dry() -> None:
    across = STATION.assign(kind=["velocity", "velocity_across", "velocity", "level"])
    assert predicted(np.array([0.4, 0.0, 0.02, 0.9]), across)
    assert predicted(np.array([0.4, 0.0, 0.02, 0.9]), STATION.assign(used=[True, False, True, True]))
    assert not predicted(np.zeros(4), STATION.assign(value=0.01)), "all of them: a run that failed"


def an_ensemble(predict: Callable[[np.ndarray, np.ndarray], np.ndarray], failed: float = 2.0) -> Ensemble:
    """Members in two parameters from 0 to 1; those with b above `failed` are."""
    random = np.random.default_rng(5)
    a, b = random.uniform(size=MEMBERS), random.uniform(size=MEMBERS)
    prediction = np.array([predict(one, two) for one, two in zip(a, b, strict=True)])
    prediction[b > failed] = np.nan
    status = np.where(b > failed, FAILED, RUN_BY_COMMAND).astype(np.int8)
    nothing = np.full(MEMBERS, np.nan)
    return Ensemble(
        {"a": a, "b": b}, prediction, status, np.full(MEMBERS, b"", "S240"), np.zeros(MEMBERS, np.int32), nothing,
        nothing, np.full((MEMBERS, 1, 1), np.nan), STATION, ("June",), (("A", 1.0),), "engine: x\n", "", 1, "",
    )  # fmt: skip


def test_predictions_that_follow_all_parameters_leave_no_doubt() -> None:
    assert doubts_of_predictions(an_ensemble(lambda a, b: U * (1.0 + 0.1 * a) + 0.001 * b)) == ()
    assert doubts_of_predictions(an_ensemble(lambda a, b: U + 0.1 * (a - 0.5) * (b - 0.5))) == (), "only together"


def test_a_command_that_ignores_everything_is_refused() -> None:
    ensemble = an_ensemble(lambda a, b: U)
    assert doubts_of_predictions(ensemble) == (PredictionsUnchanged(("a", "b"), MEMBERS),)
    inside = replace(ensemble, config="", status=np.zeros_like(ensemble.status))
    assert doubts_of_predictions(inside) == (), "of a command alone"


def test_doubts_about_a_part() -> None:
    (constant,) = doubts_of_predictions(an_ensemble(lambda a, b: U + np.array([a + b, 0.0, a, b])))
    assert constant == StationsUnchanged(1, 4, "June", (2.0, 0.5), 0.3, "m/s", MEMBERS)
    (ignored,) = doubts_of_predictions(an_ensemble(lambda a, b: U + 0.1 * a**2))
    assert ignored == ParametersWithoutInfluence(("b",), MEMBERS)
    (repeated,) = doubts_of_predictions(an_ensemble(lambda a, b: U + (a + b if a < 0.8 else 0.7)))
    assert isinstance(repeated, PredictionsRepeated)
    assert 5 < repeated.count < 20
    (failures,) = doubts_of_predictions(an_ensemble(lambda a, b: U + a + b, failed=0.7))
    assert isinstance(failures, FailuresFollowParameter)
    assert (failures.parameter, failures.high, 0.7 < failures.median < 1.0) == ("b", True, True)
    assert all(sentence(one) for one in (constant, ignored, repeated, failures))


SMALL = ("members: 1024", "members: 16")
LAST = "out[-1] = rows[-1]['station'] + ',VALUE\\n'"


def leaving(rest: str) -> str:
    """SMOOTH with its lines of predictions changed before they are written."""
    head, tail = SMOOTH.split('with open("predictions.csv"')
    line = tail.split("file.write(f", 1)[1].rsplit(")", 1)[0]
    return f"{head}out = [f{line} for row in rows]\n{rest}\n" + (
        'open("predictions.csv", "w").write("station,prediction\\n" + "".join(out))\n'
    )


@pytest.mark.slow
@pytest.mark.parametrize("value", ["-999", "-9999", "-99", "1e20", "nan", "NaN", "", "0", "0.000"])
def test_a_mark_in_all_members_ends_every_verb(tmp_path: Path, value: str) -> None:
    case = commanded(tmp_path, leaving(LAST.replace("VALUE", value)), "", COARSE, SMALL)
    runs = tmp_path / "runs"
    with pytest.raises(InputError, match=r"model|predictions\.csv"):
        check(case, runs=runs)
    ensemble = vegglue.simulate(case, runs=runs, jobs=2)
    assert (ensemble.status == FAILED).all()
    for verb in (lambda: vegglue.infer(case, runs=runs, method="glue"), lambda: refuse_useless(case, ensemble)):
        with pytest.raises(InputError, match=r"none of 16"):
            verb()


@pytest.mark.slow
@pytest.mark.parametrize("value", ["-999", "0"])
def test_a_mark_in_some_members_counts_these_as_failed(tmp_path: Path, value: str) -> None:
    runs, marked = tmp_path / "runs", f"if phi > 10: {LAST.replace('VALUE', value)}"
    case = commanded(tmp_path, leaving(marked), "", COARSE, SMALL)
    ensemble = vegglue.simulate(case, runs=runs, jobs=2)
    np.testing.assert_array_equal(ensemble.status == FAILED, ensemble.parameters["phi"] > 10)
    posterior = vegglue.infer(case, runs=runs, method="glue")
    assert posterior.sample.failed == (ensemble.parameters["phi"] > 10).sum() > 0
    assert (posterior.sample.weights[ensemble.status == FAILED] == 0).all()


@pytest.mark.slow
def test_predictions_that_never_change_end_simulate_infer_and_report(tmp_path: Path) -> None:
    case = commanded(
        tmp_path, leaving("phi = n = 1\nout = [f'{i},0.4\\n' for i in range(len(rows))]"), "", COARSE, SMALL
    )
    runs = tmp_path / "runs"
    tried = check(case, runs=runs).remarks[-1]
    assert (tried.unchanged, tried.parameters) == (("n_b", "phi"), 2)  # type: ignore[attr-defined]
    ensemble = vegglue.simulate(case, runs=runs, jobs=2)
    for verb in (
        lambda: refuse_useless(case, ensemble),
        lambda: vegglue.infer(case, runs=runs, method="glue"),
        lambda: vegglue.report(case, runs=runs),
    ):
        with pytest.raises(InputError, match="n_b or phi"):
            verb()


@pytest.mark.slow
def test_check_names_a_parameter_that_is_ignored_or_rounded_away(tmp_path: Path) -> None:
    for program in (
        leaving("").replace('given["phi"]["value"]', "5.0"),
        leaving("").replace("phi**0.2", "round(phi / 1e3)"),
    ):
        tried = check(commanded(tmp_path, program, "", COARSE, SMALL), runs=tmp_path / "runs").remarks[-1]
        assert tried.unchanged == ("phi",)  # type: ignore[attr-defined]
        assert sentence(tried)


def test_no_efficiency_is_defined_against_a_constant() -> None:
    """The variance of fifteen values of 0.45 is 3e-33, as their mean is rounded."""
    station = pd.DataFrame({"kind": "velocity", "value": np.full(15, 0.45), "used": True})
    assert np.isnan(efficiency(np.zeros((3, 15)), station)).all()
    assert np.isnan(efficiency(np.ones((3, 15)), station)).all()


ENGINES = Path(__file__).parents[3] / "shared" / "cases" / "files" / "engines"


@pytest.mark.skipif(not ENGINES.is_dir(), reason="no folder `shared/cases/files/engines` beside the repository")
def test_efficiencies_against_constant_values_are_refused_before_anything_is_solved(tmp_path: Path) -> None:
    case = load_case(ENGINES / "nse_const.yaml")
    with pytest.raises(InputError, match=r"nse_const\.yaml, infer\.likelihood: .* 15 of 0\.45"):
        vegglue.simulate(case, runs=tmp_path)
    assert not list(tmp_path.rglob("ensemble.h5"))


@pytest.mark.slow
@pytest.mark.skipif(not ENGINES.is_dir(), reason="no folder `shared/cases/files/engines` beside the repository")
@pytest.mark.parametrize("name", ["f_dry", "f_const"])
def test_engines_of_others(name: str, tmp_path: Path) -> None:
    case = load_case(ENGINES / f"{name}.yaml", trust=True)
    case = case.model_copy(update={"simulate": case.simulate.model_copy(update={"members": 16})})
    ensemble = vegglue.simulate(case, runs=tmp_path / "runs", jobs=2)
    with pytest.raises(InputError, match="none of 16" if name == "f_dry" else "n_b or phi"):
        refuse_useless(case, ensemble)
