"""Errors where nobody measured: those told are the largest of 95 in 100 models drawn as the assumptions have it."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import pytest
from linear_baseline import CASE_OF_TWINS, at_best, linear_engine, stations_of

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline
from vegglue.calibration.noise import with_model_error
from vegglue.case.schema import ModelError
from vegglue.diagnosis.comparison import acts_elsewhere, halfway, largest_error_between
from vegglue.engine.interface import Point

pytestmark = pytest.mark.slow

SECTIONS, POINTS, PARAMETERS, ERROR = ("A",), 12, 3, 0.01
# One column of the model's error for each experiment: what predictions answer to its discharge.
COLUMNS = len(CASE_OF_TWINS.experiments)
CASE = CASE_OF_TWINS.model_copy(update={"model_error": ModelError(discharge=1.0)})
STATION = stations_of(CASE_OF_TWINS, SECTIONS, POINTS)


@dataclass(frozen=True)
class Linear:
    """Slopes (station, p) and columns of the model's error (station, k), of stations and of those between sections."""

    slope: Array
    columns: Array


def linear(seed: int, error_of_model: float) -> Linear:
    random = np.random.default_rng((seed, 1))
    return Linear(
        0.05 * random.standard_normal((2 * len(STATION), PARAMETERS)),
        error_of_model * random.standard_normal((2 * len(STATION), COLUMNS)),
    )


def calibrated(one: Linear, truth: Array, random: np.random.Generator) -> Baseline:
    """A model calibrated to measurements of a truth (2 station,), with the errors that it is allowed."""
    count = len(STATION)
    measured = truth[:count] + ERROR * random.standard_normal(count)
    whole = linear_engine(lambda model: (np.zeros(len(model.station)), one.slope[: len(model.station)]), one.columns)
    base = at_best(CASE, STATION, measured, one.slope[:count], whole)
    noise = with_model_error(base.noise, one.columns[:count])
    white, value = noise.whiten(one.slope[:count]), noise.whiten(measured)
    z = np.linalg.solve(white.T @ white + np.eye(PARAMETERS), white.T @ value)
    point = Point(z, one.slope[:count] @ z, one.slope[:count], {})
    return replace(base, noise=noise, fitted=replace(base.fitted, point=point))


def told_and_true(one: Linear, seed: int) -> tuple[float, float]:
    random = np.random.default_rng((seed, 2))
    truth = one.slope @ random.standard_normal(PARAMETERS) + one.columns @ random.standard_normal(COLUMNS)
    base = calibrated(one, truth, random)
    error = (truth - one.slope @ base.fitted.point.z)[len(STATION) :]
    return largest_error_between(base), float(np.sqrt(1.0 + np.mean(error**2) / ERROR**2))


@pytest.mark.parametrize("error_of_model", [0.0, 0.01, 0.03])
def test_of_a_hundred_models_some_five_err_by_more_than_is_told(error_of_model: float) -> None:
    one = linear(1, error_of_model)
    pairs = [told_and_true(one, seed) for seed in range(200)]
    beyond = sum(true > told for told, true in pairs)
    assert 3 <= beyond <= 20  # of 200, 10 are meant: 99 % of binomial draws


def test_a_model_that_is_known_does_not_err() -> None:
    one = Linear(np.zeros((2 * len(STATION), PARAMETERS)), np.zeros((2 * len(STATION), COLUMNS)))
    assert told_and_true(one, 1)[0] == pytest.approx(1.0)


@pytest.mark.parametrize("kind", ["speed", "velocity_across"])
def test_velocities_of_other_directions_are_judged_where_none_is_along_the_channel(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Speeds of a propeller know no direction: nothing was told of what the model may miss between their sections."""
    one = linear(1, 0.03)
    along, _ = told_and_true(one, 3)
    monkeypatch.setattr(f"{__name__}.STATION", STATION.assign(kind=kind))
    other, _ = told_and_true(one, 3)
    assert other == pytest.approx(along)


def test_stations_move_halfway_to_the_next_section_and_to_the_end() -> None:
    kinds = ["velocity", "velocity", "level"]
    station = pd.DataFrame(
        {"kind": kinds, "x": [2.0, 6.0, 9.0], "y": 0.0, "experiment": "low", "section": ["A", "B", ""]}
    )
    assert halfway(station.assign(used=True), 10.0)["x"].tolist() == [4.0, 8.0]
    assert halfway(station.assign(used=[True, False, True]), 10.0)["x"].tolist() == [6.0]


def test_a_section_that_a_boat_measured_moves_as_one() -> None:
    boat = {"x": [1.9, 2.0, 2.1, 6.1, 6.0, 5.9], "y": [0.0, 1.0, 2.0, 0.0, 1.0, 2.0], "section": [*"AAABBB"]}
    station = pd.DataFrame(boat | {"kind": "velocity", "used": True, "experiment": "low"})
    assert halfway(station, 8.0)["x"].tolist() == pytest.approx([3.9, 4.0, 4.1, 7.1, 7.0, 6.9])


def test_a_section_that_lies_a_little_off_in_another_experiment_is_no_next_one() -> None:
    """Stations moved by 1 cm, where the data know the flow: what may hide between the sections was not seen."""
    off = {"low": 2.0, "high": 2.02}
    station = pd.concat([
        pd.DataFrame({"kind": "velocity", "x": [x, x, 6.0], "y": [0.0, 1.0, 0.0], "section": [f"x{x:.2f}"] * 2 + ["B"]})
        .assign(experiment=experiment, used=True) for experiment, x in off.items()
    ], ignore_index=True)  # fmt: skip
    assert halfway(station, 10.0)["x"].tolist() == pytest.approx([4.0, 4.0, 8.0, 4.01, 4.01, 8.0])


@pytest.mark.parametrize(("there", "told"), [(0.29, False), (0.31, True), (-0.31, True)])
def test_what_acts_mostly_where_nobody_measured_is_told(there: float, told: bool) -> None:
    """Three times as much there as at the stations, of either sign, at one place halfway."""
    count = len(STATION)
    changed, behind = np.full(count, 0.02), np.full(count, 0.05)
    changed[3], behind[5] = 0.1, there
    slope = np.zeros((count, PARAMETERS))
    before, moved = (
        at_best(CASE_OF_TWINS, STATION, np.zeros(count), slope, linear_engine(lambda _, a=a: (a, slope)))
        for a in (np.zeros(count), behind)
    )
    point = replace(moved.fitted.point, prediction=changed)
    after = replace(moved, fitted=replace(moved.fitted, point=point))
    why = acts_elsewhere(before, after)
    assert (why is not None) == told
    if why is not None:
        assert (why.change, why.at_stations) == (pytest.approx(0.31), pytest.approx(0.1))
