"""Priors: quantiles and probabilities are those of the distributions, and Sobol' points follow them."""

import numpy as np
import pytest
import scipy.stats

from vegglue.case.parameter_space import probability, quantile, sample_prior
from vegglue.case.schema import Parameter, share_below

PRIORS = {
    "uniform": Parameter(distribution="uniform", low=0.01, high=0.15, unit="-"),
    "loguniform": Parameter(distribution="loguniform", low=0.01, high=100, unit="-"),
    "normal": Parameter(distribution="normal", mean=2.66, sd=0.1, unit="-"),
    "bounded": Parameter(distribution="normal", mean=0.5, sd=1.0, low=0.0, high=2.0, unit="-"),
    "lognormal": Parameter(distribution="lognormal", median=0.8, log_sd=0.3, unit="-"),
}
EXACT = [
    ("uniform", 0.25, 0.045),
    ("loguniform", 0.5, 1.0),
    ("loguniform", 0.75, 10.0),
    ("normal", 0.5, 2.66),
    ("normal", 0.8413447460685429, 2.76),
    ("lognormal", 0.5, 0.8),
    ("lognormal", 0.8413447460685429, 0.8 * np.exp(0.3)),
    ("bounded", 0.0, 0.0),
    ("bounded", 1.0, 2.0),
]


@pytest.mark.parametrize(("name", "probability", "expected"), EXACT)
def test_quantiles_are_the_closed_form(name, probability, expected):
    assert quantile(PRIORS[name], probability) == pytest.approx(expected, rel=1e-9, abs=1e-12)


TAILS = PRIORS | {
    "above": Parameter(distribution="normal", mean=0.5, sd=1.0, low=6.0, unit="-"),
    "below": Parameter(distribution="normal", mean=0.5, sd=1.0, high=-5.0, unit="-"),
}
BY_SCIPY = {
    "uniform": scipy.stats.uniform(0.01, 0.15 - 0.01),
    "loguniform": scipy.stats.loguniform(0.01, 100),
    "normal": scipy.stats.norm(2.66, 0.1),
    "bounded": scipy.stats.truncnorm(-0.5, 1.5, loc=0.5, scale=1.0),
    "lognormal": scipy.stats.lognorm(0.3, scale=0.8),
    "above": scipy.stats.truncnorm(5.5, np.inf, loc=0.5, scale=1.0),
    "below": scipy.stats.truncnorm(-np.inf, -5.5, loc=0.5, scale=1.0),
}


@pytest.mark.parametrize("name", TAILS)
def test_what_lies_below_a_value_is_what_scipy_says(name):
    prior = TAILS[name]
    values = np.concatenate([quantile(prior, np.linspace(1e-6, 1 - 1e-6, 401)), [-1e3, -1.0, 0.0, 1.0, 1e3]])
    expected = BY_SCIPY[name].cdf(values)
    np.testing.assert_allclose(probability(prior, values), expected, rtol=0, atol=1e-14)
    np.testing.assert_allclose([share_below(prior, float(x)) for x in values], expected, rtol=1e-9, atol=1e-12)


def test_every_quarter_of_every_prior_gets_its_share_of_a_power_of_two():
    sample = sample_prior(PRIORS, 256, seed=3)
    for name, prior in PRIORS.items():
        counts = np.histogram(sample[name], quantile(prior, [0.0, 0.25, 0.5, 0.75, 1.0]))[0]
        assert counts.tolist() == [64] * 4, name


def test_pairs_of_parameters_fill_every_sixteenth_of_their_plane():
    sample = sample_prior({"a": PRIORS["uniform"], "b": PRIORS["uniform"]}, 256, seed=3)
    counts = np.histogram2d(sample["a"], sample["b"], bins=4, range=[[0.01, 0.15]] * 2)[0]
    assert np.all(counts == 16)


def test_a_longer_sample_of_the_same_seed_begins_with_the_shorter():
    short, long = sample_prior(PRIORS, 100, seed=7), sample_prior(PRIORS, 5000, seed=7)
    assert short["loguniform"].shape == (100,)
    assert np.array_equal(short["loguniform"], long["loguniform"][:100])
    assert not np.array_equal(short["loguniform"], sample_prior(PRIORS, 100, seed=8)["loguniform"])


def test_nothing_is_infinite_and_no_parameters_are_no_sample():
    assert all(np.isfinite(values).all() for values in sample_prior(PRIORS, 4096, seed=0).values())
    assert sample_prior({}, 16, seed=0) == {}
