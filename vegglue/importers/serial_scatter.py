"""How alike neighbours of a series are: a logger's readings in a row are fewer measurements than there are values."""

from collections.abc import Iterable, Sequence

import numpy as np

from vegglue.arrays import Array

# The lag-one correlation of n values without one is off by 1 / sqrt(n): beyond four of these it is one.
OF_CHANCE = 4.0
# Values of a series from which its correlations count: the mean of fewer takes much of them along.
LEAST_OF_SERIES = 10


def values_that_are_one(series: Iterable[Sequence[float]]) -> float:
    """tau = 1 + 2 sum_k rho_k, up to the first rho_k that is not above 0 (k in values): the mean of n has the variance
    s^2 tau / n, where s^2 is that of a value (e.g. Sokal 1997, Monte Carlo Methods in Statistical
    Mechanics; not checked against it). 1 where neighbours are as alike as chance makes them.

    series: each of one place, in the order of time; their autocovariances are added up, each about its own mean.
    """
    found = [np.asarray(one, dtype=np.float64) for one in series if len(one) >= LEAST_OF_SERIES]
    longest = max((one.size for one in found), default=0)
    covariance = np.zeros(longest)
    for one in found:
        covariance[: one.size] += _autocovariance(one)
    if longest == 0 or covariance[0] <= 0.0:
        return 1.0
    rho = covariance / covariance[0]
    if rho[1] <= OF_CHANCE / np.sqrt(sum(one.size for one in found)):
        return 1.0
    until = int(np.argmax(rho <= 0.0))  # sums of deviations are 0, so that some rho is below
    return 1.0 + 2.0 * float(rho[1:until].sum())


def _autocovariance(values: Array) -> Array:
    """sum_i d_i d_(i + k) of the deviations d from the mean, by lag k (n,)."""
    spectrum = np.fft.rfft(values - values.mean(), 2 * values.size)
    return np.asarray(np.fft.irfft(np.abs(spectrum) ** 2)[: values.size])
