"""Three ways to write a member: theta in units, s = F(theta) in the unit cube, z = Phi^-1(s), of which every prior is
standard normal."""

import numpy as np
from scipy.special import ndtr, ndtri

from vegglue.arrays import Array
from vegglue.case.parts import Value
from vegglue.case.prior import probability, quantile
from vegglue.case.schema import Case, Parameter

# Places further than this from the middle of the prior are not told apart from its bounds.
FURTHEST = 6.0


def theta_at(case: Case, z: Array) -> dict[str, Array]:
    """theta_j = F_j^-1(Phi(z_j)), one array (m,) a parameter; z (m, p)."""
    places = ndtr(np.clip(np.atleast_2d(z), -FURTHEST, FURTHEST))
    return {name: quantile(prior, places[:, j]) for j, (name, prior) in enumerate(case.parameters.items())}


def z_at(case: Case, theta: dict[str, Array]) -> Array:
    """The inverse of `theta_at`, (m, p)."""
    columns = [_normal(prior, theta[name]) for name, prior in case.parameters.items()]
    return np.column_stack(columns)


def z_of(prior: Parameter, value: float) -> float:
    """z of one value of one parameter."""
    return float(_normal(prior, np.array([value]))[0])


def _normal(prior: Parameter, values: Array) -> Array:
    return np.clip(ndtri(probability(prior, values)), -FURTHEST, FURTHEST)


def unit_points(case: Case, theta: dict[str, np.ndarray]) -> np.ndarray:
    """s_j = F_j(theta_j), the members' places in the unit cube, (members, parameters)."""
    return np.column_stack([probability(case.parameters[name], values) for name, values in theta.items()])


def parameters_at(case: Case, places: np.ndarray) -> dict[str, np.ndarray]:
    """theta_j = F_j^-1(s_j)."""
    return {name: quantile(prior, places[:, j]) for j, (name, prior) in enumerate(case.parameters.items())}


def middle_value(case: Case, value: Value) -> float:
    return float(quantile(case.parameters[value], 0.5)) if isinstance(value, str) else value
