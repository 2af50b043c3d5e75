"""A parameter at a bound, beyond handbooks or off what was stated is a doubt beside every verdict."""

import numpy as np
import pytest
from linear_baseline import CASE_OF_TWINS as CASE
from linear_baseline import at_best, measured_linearly, stations_of

from vegglue.calibration.baseline import Baseline
from vegglue.case.parameter_space import quantile, z_of
from vegglue.diagnosis.handbook import parameter_doubts
from vegglue.results.verdict import BeyondHandbook, EstimateAtBound, EstimateOffPrior


def base_at(**values: float) -> Baseline:
    """A baseline whose best place has these values, and the middle of its prior elsewhere."""
    names = list(CASE.parameters)
    z = np.array([z_of(CASE.parameters[name], values[name]) if name in values else 0.0 for name in names])
    slope, _ = measured_linearly(("A",), 12, len(names))
    return at_best(CASE, stations_of(CASE, ("A",), 12), 100.0 * slope @ z, 100.0 * slope)


BED = next(one.coefficient for one in CASE.friction.classes.values() if one.law == "manning")


def test_the_middle_of_the_prior_is_no_doubt() -> None:
    assert not [one for one in parameter_doubts(base_at(**{BED: 0.035})) if one.parameter == BED]


@pytest.mark.parametrize("share", [0.002, 0.998])
def test_a_parameter_at_a_bound_is_one(share: float) -> None:
    prior = CASE.parameters[BED]
    base = base_at(**{BED: float(quantile(prior, share))})
    (found,) = [one for one in parameter_doubts(base) if isinstance(one, EstimateAtBound) and one.parameter == BED]
    assert found.lower == (share < 0.5)
    assert (found.low, found.high) == (prior.low, prior.high)


def test_what_no_handbook_gives_is_one() -> None:
    beyond = [one for one in parameter_doubts(base_at(k_s=2.5)) if isinstance(one, BeyondHandbook)]
    assert [one.parameter for one in beyond] == ["k_s"]
    assert all(not one.low <= one.value <= one.high for one in beyond)


def test_what_lies_far_off_its_statement_is_one() -> None:
    stated = [name for name, one in CASE.parameters.items() if one.distribution in ("normal", "lognormal")]
    for name in stated:
        prior = CASE.parameters[name]
        far = prior.median * np.exp(2.9 * prior.log_sd) if prior.median else prior.mean + 2.9 * prior.sd
        found = [one for one in parameter_doubts(base_at(**{name: float(far)})) if isinstance(one, EstimateOffPrior)]
        assert [one.parameter for one in found] == [name]
        assert found[0].deviations > 2.5
