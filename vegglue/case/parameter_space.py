"""Three ways to write a member: theta in units, s = F(theta) in the unit cube, z = Phi^-1(s), of which every prior is
standard normal."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from vegglue.arrays import Array
from vegglue.case.parts import Value
from vegglue.case.prior import probability, quantile, sobol_points
from vegglue.case.schema import Case, Parameter

# Places further than this from the middle of the prior are not told apart from its bounds.
FURTHEST = 6.0


def theta_at(case: Case, z: Array) -> dict[str, Array]:
    """theta_j = F_j^-1(Phi(z_j)), one array (m,) a parameter; z (m, p)."""
    return parameters_at(case, ndtr(np.clip(np.atleast_2d(z), -FURTHEST, FURTHEST)))


def z_at(case: Case, theta: dict[str, Array]) -> Array:
    """The inverse of `theta_at`, (m, p)."""
    columns = [_normal(prior, theta[name]) for name, prior in case.parameters.items()]
    return np.column_stack(columns)


def z_of(prior: Parameter, value: float) -> float:
    """z of one value of one parameter."""
    return float(_normal(prior, np.array([value]))[0])


def _normal(prior: Parameter, values: Array) -> Array:
    return np.clip(ndtri(probability(prior, values)), -FURTHEST, FURTHEST)


@dataclass(frozen=True)
class PriorSample:
    """Members both ways: points s (m, p) of the unit cube, and theta, {parameter: (m,)}, made of them once. What is
    stored, solved and compared is this theta: made again of some of the points, its last digits may differ.
    """

    points: Array
    theta: dict[str, Array]

    def take(self, members: NDArray[np.int64]) -> "PriorSample":
        """Some of the members, theta as it is."""
        return PriorSample(self.points[members], {name: values[members] for name, values in self.theta.items()})


def sobol_sample(case: Case) -> PriorSample:
    """The members of a case, s_ij of the scrambled Sobol' sequence and theta_ij = F_j^-1(s_ij)."""
    return sample_at(case, sobol_points(len(case.parameters), case.simulate.members, case.simulate.seed))


def sample_at(case: Case, points: Array) -> PriorSample:
    """Members at points (m, p)."""
    return PriorSample(points, parameters_at(case, points))


def sample_of(case: Case, theta: Mapping[str, Array]) -> PriorSample:
    """Members with these parameters, s_j = F_j(theta_j)."""
    values = {name: np.asarray(theta[name], dtype=np.float64) for name in case.parameters}
    columns = [probability(prior, values[name]) for name, prior in case.parameters.items()]
    return PriorSample(np.column_stack(columns), values)


def parameters_at(case: Case, points: Array) -> dict[str, Array]:
    """theta_j = F_j^-1(s_j), one array (m,) a parameter; s (m, p)."""
    return {name: quantile(prior, points[:, j]) for j, (name, prior) in enumerate(case.parameters.items())}


def middle_value(case: Case, value: Value) -> float:
    return float(quantile(case.parameters[value], 0.5)) if isinstance(value, str) else value
