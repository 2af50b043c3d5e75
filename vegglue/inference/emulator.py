"""A polynomial emulator of the flow model, fitted to its runs.

It only proposes where to run the model next. Every weight comes from a true run, so the numbers below change how many
runs are needed and not what is found.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from vegglue.arrays import Array

# Degree of the polynomial at most. Chosen, not measured: coefficients grow as p^4 / 24, and each needs runs.
HIGHEST_DEGREE = 4
# Least runs for each coefficient. Chosen, not measured: a polynomial through fewer would follow single runs.
RUNS_PER_COEFFICIENT = 2.0
# Ridge over the mean square of a term [-]: keeps the normal equations solvable where runs leave a term undetermined.
RIDGE = 1e-6
# Fall of the log density below the best run [per parameter] at which the root of a run's weight is a half. Chosen, not
# measured: a smaller one fits the mode more closely and the tails less.
HALF_WEIGHT_DROP = 5.0
# Parts into which runs are cut to tell which degree predicts those that it has not seen. Chosen, not measured.
HELD_OUT_PARTS = 4
# Fall of the log density below the best run [per parameter] beyond which how far it falls does not matter: chosen. With
# two parameters a draw of a normal posterior falls so far with a chance of 2e-9, with more less often.
NO_CHANCE_DROP = 10.0


@dataclass(frozen=True)
class Emulator:
    """values(z) = sum_b coefficient_b prod_j u_j^(powers of b),   u = lower^-1 (z - centre)."""

    centre: Array
    lower: Array
    powers: tuple[tuple[int, ...], ...]
    coefficient: Array  # (b, n)

    def predict(self, z: Array) -> Array:
        """Values (m, n) at z (m, p)."""
        return np.asarray(_terms(_standard(z, self.centre, self.lower), self.powers) @ self.coefficient)


def emulator_of_density(
    z: Array, values: Array, density: Callable[[Array, Array], Array], centre: Array, lower: Array
) -> Emulator:
    """`fit_emulator` of the degree with which a part of the runs predicts the density of the others best.

        sum_i weight_i (l_emulated(z_i) - l(z_i))^2,   i among the runs held out, weights as in `fit_emulator`

    density: z (m, p), values (m, n) -> l = ln p(z) up to a constant (m,), -inf or NaN where a run failed. A degree that
    the runs determine and that does not bend as the model does swings beyond them, where the next are then drawn.
    """
    logs = density(z, values)
    known = np.isfinite(logs)
    z, values, logs = z[known], values[known], logs[known]
    part, weight = np.arange(len(z)) % HELD_OUT_PARTS, _weights(logs, z.shape[1])
    least = logs.max() - NO_CHANCE_DROP * z.shape[1]

    def error(degree: int) -> float:
        found = np.empty(len(z))
        for k in range(HELD_OUT_PARTS):
            seen = part != k
            emulator = fit_emulator(z[seen], values[seen], logs[seen], centre, lower, degree)
            found[~seen] = density(z[~seen], emulator.predict(z[~seen]))
        return float(weight @ (np.maximum(found, least) - np.maximum(logs, least)) ** 2)

    return fit_emulator(z, values, logs, centre, lower, min(range(2, HIGHEST_DEGREE + 1), key=error))


def fit_emulator(
    z: Array, values: Array, log_density: Array, centre: Array, lower: Array, highest: int = HIGHEST_DEGREE
) -> Emulator:
    """Weighted least squares through the runs z (m, p) -> values (m, n), of the highest degree that they determine.

    weight = (1 + (max l - l) / (HALF_WEIGHT_DROP p))^-2 with l the log density of each run (m,): the fit is best where
    the posterior is. centre (p,), lower (p, p): u = lower^-1 (z - centre) are the variables of the polynomial.
    """
    known = np.isfinite(log_density)
    z, values, log_density = z[known], values[known], log_density[known]
    p = z.shape[1]
    degrees = range(2, highest + 1)
    degree = max((d for d in degrees if RUNS_PER_COEFFICIENT * math.comb(p + d, d) <= len(z)), default=1)
    powers = tuple(
        tuple(chosen.count(j) for j in range(p))
        for d in range(degree + 1)
        for chosen in combinations_with_replacement(range(p), d)
    )
    terms = _terms(_standard(z, centre, lower), powers)
    weight = _weights(log_density, p)
    size = np.sqrt((weight @ terms**2) / weight.sum())
    root = np.sqrt(weight)[:, None]
    left = terms / size * root
    matrix = left.T @ left + RIDGE * weight.sum() * np.eye(len(powers))
    return Emulator(centre, lower, powers, np.linalg.solve(matrix, left.T @ (values * root)) / size[:, None])


def _weights(log_density: Array, parameters: int) -> Array:
    """Of runs in a fit (m,)."""
    return np.asarray(1.0 / (1.0 + (log_density.max() - log_density) / (HALF_WEIGHT_DROP * parameters)) ** 2)


def _standard(z: Array, centre: Array, lower: Array) -> Array:
    return np.asarray(np.linalg.solve(lower, (z - centre).T).T, np.float64)


def _terms(u: Array, powers: tuple[tuple[int, ...], ...]) -> Array:
    """prod_j u_j^powers (m, b)."""
    table = np.stack([u**d for d in range(HIGHEST_DEGREE + 1)])
    terms = np.ones((len(u), len(powers)))
    for b, power in enumerate(powers):
        for j, d in enumerate(power):
            if d:
                terms[:, b] *= table[d, :, j]
    return terms
