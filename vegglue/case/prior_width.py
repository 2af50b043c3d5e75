"""Priors that no computer can tell from a number, or that reach beyond all that is measured."""

import math
from collections.abc import Mapping

# Numbers of a prior lie between 10^-30 and 10^30, whatever their unit: their squares and products are still numbers.
SMALLEST_IN_PRIOR, LARGEST_IN_PRIOR = 1e-30, 1e30
# Width of a prior over its size [-]: a thinner one is a number, whose digits end at 10^-16.
THINNEST = 1e-9
# Standard deviations from the mean to the nearer bound [-]: beyond lies a share of 10^-12.
FARTHEST_BOUND = 7.0
# Spread of the logarithm [-]: twice it, either way, is a factor of 10^17.
WIDEST_LOG = 20.0


def unusable(distribution: str, numbers: Mapping[str, float | None]) -> str | None:
    """What a prior should have been, as the schema says it; None for one that can be drawn from.

    numbers: low, high, mean, sd, median and log_sd, None where there is none.
    """
    given = {name: value for name, value in numbers.items() if value is not None}
    if any(value and not SMALLEST_IN_PRIOR <= abs(value) <= LARGEST_IN_PRIOR for value in given.values()):
        return f"numbers between {SMALLEST_IN_PRIOR:g} and {LARGEST_IN_PRIOR:g}"
    if distribution == "lognormal":
        spread = given["log_sd"]
        return None if THINNEST < spread < WIDEST_LOG else f"a `log_sd` between {THINNEST:g} and {WIDEST_LOG:g}"
    if distribution != "normal":
        width, size = given["high"] - given["low"], max(abs(given["low"]), abs(given["high"]))
        return None if width > THINNEST * size else "a range wider than the last digits; write a number instead"
    return _unusable_normal(given["mean"], given["sd"], given.get("low", -math.inf), given.get("high", math.inf))


def _unusable_normal(mean: float, sd: float, low: float, high: float) -> str | None:
    if sd < THINNEST * abs(mean):
        return "an `sd` wider than the last digits of the mean; write a number instead"
    if low > mean + FARTHEST_BOUND * sd or high < mean - FARTHEST_BOUND * sd:
        return f"bounds within {FARTHEST_BOUND:g} `sd` of the mean"
    if high - low < THINNEST * sd:
        return "an `sd` nearer to the width between the bounds; write a uniform prior instead"
    return None
