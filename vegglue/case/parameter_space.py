"""Three coordinates of a member: its parameters theta in their units, s = F(theta) in the unit cube, and
z = Phi^-1(s), in which every prior is standard normal. F is the distribution function of the prior, Phi that of the
standard normal distribution.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from vegglue.arrays import Array
from vegglue.case.parts import Value
from vegglue.case.prior import probability, quantile, sobol_points
from vegglue.case.schema import Case, Parameter
from vegglue.errors import InputError, shown_path

Bounds = tuple[float, float]
# Largest |z|: beyond it lies a probability of 1e-9, as good as the bound of the prior.
FURTHEST = 6.0


def refuse_without_parameters(case: Case) -> None:
    """Errors: InputError for a case with nothing to calibrate."""
    if not case.parameters:
        raise InputError(f"{shown_path(case.source)}: `parameters` expected a prior or more, got none: add one.")


def theta_at(case: Case, z: Array) -> dict[str, Array]:
    """theta_j = F_j^-1(Phi(z_j)), an array (m,) for each parameter [its unit]; z (m, p) or (p,) [-]."""
    return parameters_at(case, ndtr(np.clip(np.atleast_2d(z), -FURTHEST, FURTHEST)))


def z_at(case: Case, theta: dict[str, Array]) -> Array:
    """z_j = Phi^-1(F_j(theta_j)) (m, p) [-], the inverse of `theta_at`, at most FURTHEST from 0."""
    columns = [_normal(prior, theta[name]) for name, prior in case.parameters.items()]
    return np.column_stack(columns)


def z_of(prior: Parameter, value: float) -> float:
    """z = Phi^-1(F(value)) of one value of one parameter [-]."""
    return float(_normal(prior, np.array([value]))[0])


def _normal(prior: Parameter, values: Array) -> Array:
    return np.clip(ndtri(probability(prior, values)), -FURTHEST, FURTHEST)


@dataclass(frozen=True)
class PriorSample:
    """Members as points s (m, p) of the unit cube [-] and as theta, {parameter: (m,)} [its unit], made of them once.

    Stored, solved and compared is this theta: made again of some of the points, its last digits may differ.
    """

    points: Array
    theta: dict[str, Array]

    def take(self, members: NDArray[np.int64]) -> "PriorSample":
        """Some of the members, by index (n,); their theta is copied and not computed again."""
        return PriorSample(self.points[members], {name: values[members] for name, values in self.theta.items()})


def sobol_sample(case: Case) -> PriorSample:
    """The members of a case: s_ij of the scrambled Sobol' sequence, theta_ij = F_j^-1(s_ij)."""
    return sample_at(case, sobol_points(len(case.parameters), case.simulate.members, case.simulate.seed))


def sample_at(case: Case, points: Array) -> PriorSample:
    """Members at points s (m, p) of the unit cube."""
    return PriorSample(points, parameters_at(case, points))


def sample_of(case: Case, theta: Mapping[str, Array]) -> PriorSample:
    """Members with these parameters, {parameter: (m,)}; s_j = F_j(theta_j)."""
    values = {name: np.asarray(theta[name], dtype=np.float64) for name in case.parameters}
    columns = [probability(prior, values[name]) for name, prior in case.parameters.items()]
    return PriorSample(np.column_stack(columns), values)


def parameters_at(case: Case, points: Array) -> dict[str, Array]:
    """theta_j = F_j^-1(s_j), an array (m,) for each parameter [its unit]; points s (m, p) [-]."""
    return {name: quantile(prior, points[:, j]) for j, (name, prior) in enumerate(case.parameters.items())}


def middle_value(case: Case, value: Value) -> float:
    """The number, or the median of the prior of the parameter of that name [its unit]."""
    return value_at(case, value, 0.5)


def value_at(case: Case, value: Value, share: float) -> float:
    """The number, or what so much of the prior of the parameter of that name lies below [its unit]."""
    return float(quantile(case.parameters[value], share)) if isinstance(value, str) else value


def prior_range(case: Case, value: Value) -> Bounds:
    """What a value may be: 95 % of its prior, or itself twice."""
    if isinstance(value, str):
        low, high = quantile(case.parameters[value], [0.025, 0.975])
        return float(low), float(high)
    return value, value
