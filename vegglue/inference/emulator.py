"""Polynomials through runs of a model: where its posterior lies, for next to nothing. They only say where to look."""

import math
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from vegglue.arrays import Array

HIGHEST = 4
# Runs for each coefficient, at least.
RUNS_EACH = 2.0
RIDGE = 1e-6
# Runs whose log density lies this far [per parameter] below the best count half.
FAR = 5.0


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


def learned(z: Array, values: Array, log_density: Array, centre: Array, lower: Array) -> Emulator:
    """The polynomial of the highest degree that the runs z (m, p), values (m, n) support, best where the density is."""
    known = np.isfinite(log_density)
    z, values, log_density = z[known], values[known], log_density[known]
    p = z.shape[1]
    degree = max((d for d in range(2, HIGHEST + 1) if RUNS_EACH * math.comb(p + d, d) <= len(z)), default=1)
    powers = tuple(
        tuple(chosen.count(j) for j in range(p))
        for d in range(degree + 1)
        for chosen in combinations_with_replacement(range(p), d)
    )
    terms = _terms(_standard(z, centre, lower), powers)
    weight = 1.0 / (1.0 + (log_density.max() - log_density) / (FAR * p)) ** 2
    size = np.sqrt((weight @ terms**2) / weight.sum())
    root = np.sqrt(weight)[:, None]
    left = terms / size * root
    matrix = left.T @ left + RIDGE * weight.sum() * np.eye(len(powers))
    return Emulator(centre, lower, powers, np.linalg.solve(matrix, left.T @ (values * root)) / size[:, None])


def _standard(z: Array, centre: Array, lower: Array) -> Array:
    return np.asarray(np.linalg.solve(lower, (z - centre).T).T, np.float64)


def _terms(u: Array, powers: tuple[tuple[int, ...], ...]) -> Array:
    """prod_j u_j^powers (m, b)."""
    table = np.stack([u**d for d in range(HIGHEST + 1)])
    terms = np.ones((len(u), len(powers)))
    for b, power in enumerate(powers):
        for j, d in enumerate(power):
            if d:
                terms[:, b] *= table[d, :, j]
    return terms
