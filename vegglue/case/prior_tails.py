"""How much of a prior lies below a value, by the standard library alone: a case is refused without waiting for more."""

import math

from vegglue.case.schema import Parameter


def share_below(prior: Parameter, value: float) -> float:
    """F(value) = P(X < value) [-]; the value in the unit of the prior. `prior.probability` is the same for arrays."""
    low = -math.inf if prior.low is None else prior.low
    high = math.inf if prior.high is None else prior.high
    if value <= low or value >= high:
        return float(value >= high)
    if prior.distribution == "uniform":
        return (value - low) / (high - low)
    if prior.distribution == "loguniform":
        return math.log(value / low) / math.log(high / low)
    if prior.median is not None and prior.log_sd is not None:
        return _mass(-math.inf, math.log(value / prior.median) / prior.log_sd) if value > 0.0 else 0.0
    assert prior.mean is not None
    assert prior.sd is not None
    a, x, b = ((end - prior.mean) / prior.sd for end in (low, value, high))
    whole = _mass(a, b)
    return _mass(a, x) / whole if whole > 0.0 else 0.0


def _mass(low: float, high: float) -> float:
    """Phi(high) - Phi(low), from the tail in which both keep their digits."""
    if low > 0.0:
        low, high = -high, -low
    return 0.5 * (math.erfc(-high / math.sqrt(2.0)) - math.erfc(-low / math.sqrt(2.0)))
