"""Score tests of a residual against many fingerprints, after what calibration can mimic is projected out.

    T = S_perp' r / |S_perp|,   S_perp = (I - P) S,   P the projection onto the slopes of the calibrated parameters

Everything here is whitened: errors are independent and standard normal. Rows of the prior stand below those of the
data, so that a calibrated parameter is as free as its prior says.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from vegglue.arrays import Array

Name = TypeVar("Name", str, int)
# Residuals drawn of errors alone [-]: 150 of them lie beyond the 95 % point, so that p = 0.05 is known to 8 %.
NULL_DRAWS = 3000
# Cosine [-] between projected fingerprints above which the data cannot tell them apart. Chosen, not measured: at
# 0.9 the score of the wrong one is 90 % of that of the right one.
ALIKE = 0.9


@dataclass(frozen=True)
class Projected:
    """Fingerprints S (rows, c) and residual r (rows,) after the calibrated slopes J have been projected out.

    visible: |S_perp| / |S| of each (c,) [-]; length: |S_perp| (c,), in standard errors per unit of amplitude.
    """

    residual: Array
    fingerprints: Array
    length: Array
    visible: Array

    @property
    def units(self) -> Array:
        """S_perp / |S_perp| (rows, c)."""
        return self.fingerprints / np.maximum(self.length, 1e-300)

    @property
    def score(self) -> Array:
        """T (c,) [standard errors], of either sign; made without units, which are as large as the fingerprints."""
        return np.asarray((self.fingerprints.T @ self.residual) / np.maximum(self.length, 1e-300))


def project(slopes: Array, residual: Array, z: Array, fingerprints: Array) -> Projected:
    """(I - P) [r; -z] and (I - P) [S; 0], P onto [J; 1]: J (n, p), r (n,) and S (n, c) whitened, z (p,)."""
    rows, p = slopes.shape
    basis, _ = np.linalg.qr(np.vstack([slopes, np.eye(p)]))
    remaining = np.concatenate([residual, -z])
    seen = -(basis @ (basis[:rows].T @ fingerprints))
    seen[:rows] += fingerprints
    length = _lengths(seen)
    visible = length / np.maximum(_lengths(fingerprints), 1e-300)
    return Projected(remaining - basis @ (basis.T @ remaining), seen, length, visible)


def scores(projected: Projected, only_sign: np.ndarray) -> Array:
    """T = S_perp' r / |S_perp| (c,); 0 where an effect that only has one sign would need the other."""
    return _signed(projected.score, only_sign)


def null_draws(projected: Projected, only_sign: np.ndarray, errors: Array, seed: int) -> Array:
    """T (draws, c) of residuals that are errors (draws, n) only; the rows of the prior are drawn here."""
    of_prior = np.random.default_rng(seed).standard_normal((len(errors), projected.residual.size - errors.shape[1]))
    noise = np.hstack([errors, of_prior]).astype(np.float32)
    return _signed(np.asarray(noise @ projected.units.astype(np.float32), dtype=np.float64), only_sign)


def chances(projected: Projected, family: Sequence[np.ndarray], allowed: Mapping[float, np.ndarray]) -> Array:
    """Chance of each fingerprint (c,) [-] to be the one missing effect, whose length L [standard errors] is one of a
    few, all as likely before.

        p_i ~ sum_L sum_s exp(s L T_i - L^2 / 2) / n_jL,  s = +1, -1

    allowed {L: (2, c)}: whether it may have either sign at that length; n_jL: number of fingerprints and signs of its
    family that are allowed. All families with any allowed are as likely before (Bayes).
    """
    score = projected.score
    signed, highest = np.stack([score, -score]), float(np.abs(score).max(initial=0.0))
    most = max(length * highest - 0.5 * length**2 for length in allowed)
    chance = np.zeros(score.size)
    for length, possible in allowed.items():
        weight = np.where(possible, np.exp(length * signed - 0.5 * length**2 - most), 0.0).sum(axis=0)
        ways = possible.sum(axis=0)
        for columns in family:
            chance[columns] += weight[columns] / max(int(ways[columns].sum()), 1)
    return np.asarray(chance / max(float(chance.sum()), 1e-300))


def likeliest_families(
    projected: Projected, family: Sequence[np.ndarray], chance: Array, level: float
) -> list[list[int]]:
    """The fewest groups of families that hold a chance of `level` together, likelier groups and families first.

    chance (c,): of each fingerprint; a family is grouped by its likeliest.
    """
    of_family = np.array([chance[columns].sum() for columns in family])
    possible = [int(j) for j in np.argsort(-of_family) if of_family[j] > 0]
    units = projected.units[:, [int(family[j][np.argmax(chance[family[j]])]) for j in possible]]
    return fewest_groups(alike_groups(possible, units.T @ units), of_family, level)


def fewest_groups(found: Sequence[list[int]], chance: Array, level: float) -> list[list[int]]:
    """The fewest groups that hold a chance of `level` together, likelier ones first; chance (k,): of each member."""
    ranked = sorted(found, key=lambda group: -chance[group].sum())
    held = np.cumsum([chance[group].sum() for group in ranked])
    return ranked[: int(np.searchsorted(held, level)) + 1]


def cosines(projected: Projected) -> Array:
    """Cosine between every two projected fingerprints (c, c) [-]."""
    return np.asarray(projected.units.T @ projected.units)


def alike_groups(names: Sequence[Name], cosine: Array) -> list[list[Name]]:
    """Names, or numbers, that the data cannot tell apart, linked where |cosine| > ALIKE."""
    remaining, found = list(range(len(names))), []
    while remaining:
        group, grown = [remaining.pop(0)], True
        while grown:
            near = [j for j in remaining if np.abs(cosine[j, group]).max() > ALIKE]
            grown = bool(near)
            group += near
            remaining = [j for j in remaining if j not in near]
        found.append([names[j] for j in sorted(group)])
    return found


def _lengths(columns: Array) -> Array:
    """|column| of each (c,); one pass, where `norm` makes three."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->j", columns, columns)))


def _signed(values: Array, only_sign: np.ndarray) -> Array:
    return np.where(only_sign * values < 0, 0.0, values)
