"""Whether one value will do for several experiments."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.stats
from built_models import model_of
from reach import COARSE, write_reach
from refined_reach import FEW_MEMBERS, STATED_ERRORS, SolvedReach

from vegglue.calibration.fit import fit
from vegglue.calibration.noise import covariance_of, noise_of, with_correlation
from vegglue.case.config import load_case
from vegglue.case.parameter_space import theta_at, z_at
from vegglue.engine.interface import linearise
from vegglue.inference.homogeneity import chance_of_as_much, equal_values_test, one_experiment, transfer, without_prior
from vegglue.inference.statements import (
    CalibrationDiffers,
    ErrorsOfComparison,
    ParameterBetweenExperiments,
    transfer_statements,
)
from vegglue.measurements.observations import read_observations
from vegglue.results.posterior import Posterior, Transfer


def test_homogeneity_of_the_papers_table() -> None:
    bed = equal_values_test(np.array([0.062, 0.098, 0.104]), np.array([0.007, 0.008, 0.010]))
    assert bed[:2] == (pytest.approx(16.9, abs=0.05), 2)
    assert equal_values_test(np.array([0.99, 2.70, 4.0]), np.array([0.28, 0.33, 0.44]))[0] == pytest.approx(
        37.6, abs=0.05
    )
    assert equal_values_test(np.array([1.0, 1.2, np.nan]), np.array([0.1, 0.1, np.nan])) == (
        pytest.approx(2), 1, pytest.approx(scipy.stats.chi2.sf(2, 1)),
    )  # fmt: skip
    assert math.isnan(equal_values_test(np.array([1.0, np.nan]), np.array([0.1, np.nan]))[0])


def test_errors_estimated_from_few_readings_raise_no_false_alarms() -> None:
    random, alarms = np.random.default_rng(4), 0
    for _ in range(2000):  # the mean of 8 readings in each of two experiments, of one size of error
        seen = random.normal(size=(2, 8))
        size = math.sqrt(seen.var(axis=1, ddof=1).mean())
        alarms += equal_values_test(seen.mean(axis=1), np.full(2, size / math.sqrt(8)), None, 14)[2] < 0.01
    assert 10 <= alarms <= 32  # 20 are expected, 39 where the size is taken for known
    assert chance_of_as_much(9.2, 3) == pytest.approx(scipy.stats.chi2.sf(9.2, 3))
    assert chance_of_as_much(9.2, 3, 1e9) == pytest.approx(scipy.stats.chi2.sf(9.2, 3))


def test_the_prior_is_taken_off(reach: SolvedReach) -> None:
    case = reach[0]
    likelihood, error = np.array([0.4, -0.3]), np.array([0.1, 0.9])
    variance = 1 / (1 + 1 / error**2)
    value, own = without_prior(case, likelihood * variance / error**2, variance)
    exact = theta_at(case, likelihood)
    assert value[0] == pytest.approx(exact["n_b"][0], rel=1e-3)
    assert value[1] == pytest.approx(math.log10(exact["phi"][0]), abs=0.03)
    assert own[0] == pytest.approx(0.1 * 0.08 * scipy.stats.norm.pdf(0.4), rel=0.01)
    assert np.isnan(without_prior(case, np.zeros(2), np.array([0.1, 0.8]))[0]).tolist() == [False, True]


TWO = (
    "  June: {discharge: 2.0, level: 0.95}",
    "  June: {discharge: 2.0, level: 0.95}\n  July: {discharge: 2.0, level: 0.95, stands: {willow: {phi: 8}}}",
)


@pytest.mark.parametrize(("rough", "moves"), [(0.05, False), (0.07, True)])
def test_a_bed_that_changes_between_experiments_is_noticed(tmp_path: Path, rough: float, moves: bool) -> None:
    case = load_case(write_reach(tmp_path, COARSE, FEW_MEMBERS, STATED_ERRORS, TWO))
    once = read_observations(case)
    table = once.table.loc[once.table.index.repeat(2)].reset_index(drop=True)
    table["experiment"] = np.tile(["June", "July"], len(once.table))
    random = np.random.default_rng(5)
    model = model_of(case, replace(once, table=table))
    for experiment, n_b in (("June", 0.05), ("July", rough)):
        point = linearise(model, z_at(case, {"n_b": np.array([n_b]), "phi": np.array([8.0])})[0])
        assert point is not None
        rows = (table["experiment"] == experiment).to_numpy()
        table.loc[rows, "value"] = point.prediction[rows] + 0.01 * random.normal(size=rows.sum())
    middle = linearise(model, np.zeros(2))
    assert middle is not None
    joint = fit(model, noise_of(table), middle).point
    found = transfer(model, noise_of(table), joint, True)
    assert found is not None
    assert list(found.experiments) == ["June", "July"]
    assert (found.p[0] < 1e-3) == moves
    assert np.isnan(found.value[1, 1])  # phi is a number in July
    assert np.all(found.misfit_alone < found.misfit_together)
    assert (found.p_all < 1e-3) == moves
    assert (found.scale, found.more) == (pytest.approx(1, abs=0.3), 1)
    twice = with_correlation(noise_of(table.assign(standard_error=0.005)), 0.0, 3.0)
    again, free = (transfer(model, errors, joint, False) for errors in (twice, noise_of(table)))
    assert again is not None
    assert free is not None
    assert again.scale == pytest.approx(2 * free.scale, rel=0.05)  # its own, whatever the joint fit asked for
    assert again.chi2[0] == pytest.approx(free.chi2[0], rel=0.1, abs=0.1)


@pytest.mark.parametrize(("apart", "outcome"), [(0.0, "one-value"), (0.028, "hardly-one-value"), (0.06, "differs")])
def test_what_is_stated_of_experiments(refined: Posterior, apart: float, outcome: str) -> None:
    value, error = np.array([0.05, 0.05 + apart]), np.array([0.01, 0.008])
    chi2, freedom, p = equal_values_test(value, error)
    found = Transfer(
        scale=1.0, gain=chi2, more=1, p_all=p, experiments=np.array(["June", "July"], object),
        value=np.column_stack([value, [1.0, np.nan]]), error=np.column_stack([error, [0.1, np.nan]]),
        chi2=np.array([chi2, np.nan]), freedom=np.array([freedom, 0]), p=np.array([p, np.nan]),
        misfit_together=np.array([20.0, 15.0]), misfit_alone=np.array([12.0, 13.0]), stations=np.array([15, 15]),
    )  # fmt: skip
    first, _, errors, last = transfer_statements(replace(refined, transfer=found), {"chi2_n_b": 16.9})
    assert isinstance(first, ParameterBetweenExperiments), "nothing of phi, which one experiment alone determines"
    assert (first.parameter.name, first.outcome, first.reference) == ("n_b", outcome, 16.9)
    assert first.values[0] == ("June", 0.05, 0.01)
    assert isinstance(last, CalibrationDiffers) == (outcome == "differs")
    assert errors == ErrorsOfComparison(False, 1.0)
    larger = list(transfer_statements(replace(refined, transfer=replace(found, scale=2.1)), {}))
    assert larger[2] == ErrorsOfComparison(False, 2.1)


def test_errors_of_one_experiment_are_those_of_all(reach: SolvedReach) -> None:
    case, observations, _ = reach
    noise = with_correlation(noise_of(observations.table), 0.3, 1.2)
    model, own = one_experiment(model_of(case, observations), noise, "June")
    assert own.lower @ own.lower.T == pytest.approx(covariance_of(noise))
    assert list(model.case.experiments) == ["June"]
