"""Score tests of a residual against many fingerprints, after what calibration can mimic is projected out.

    T = S_perp' r / |S_perp|,   S_perp = (I - P) S,   P the projection onto the slopes of the calibrated parameters

Everything here is whitened: errors are independent and standard normal. Rows of the prior stand below those of the
data, so that a calibrated parameter is as free as its prior says.

Family-wise p: the chance that errors alone make the best of many score tests score as high as one does.

    p = (1 + #{b: T_b^2 >= T^2}) / (1 + draws)

Residuals that are errors only are drawn, and T_b^2 is the largest of the squared scores of draw b. It is told beside
each effect; the alarm is another sum over the same draws, see `evidence`. No form of the tail is assumed; p is never
below 1 / (1 + draws).

The evidence for hypotheses of every kind, to first order in their size, and the alarm that any of them stands out.

    ln B = -1/2 ln(1 + a^2) + 1/2 T^2 a^2 / (1 + a^2),   a = s |S_perp|

B is the Bayes factor of a hypothesis of size N(0, s^2) against nothing, T its score and |S_perp| the length of its
fingerprint per unit of size, both in standard errors (see `score_test`): the width of its prior is charged (Occam's
factor). Groups of kinds (listed effects, places, instruments) are as likely before; of a group all kinds are, of a kind
all hypotheses, of one hypothesis all settings. What is missing is one of them or nothing. The alarm is sounded by the
sum over all, against the same sum in draws of errors alone.
Source: Kass and Raftery (1995), doi:10.2307/2291091, for Bayes factors; not checked against it.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from scipy.special import logsumexp

from vegglue.arrays import Array, Single
from vegglue.decision_constants import constants
from vegglue.parallel import in_threads

Name = TypeVar("Name", str, int)
# Residuals drawn of errors alone [-]: 150 of them lie beyond the 95 % point, so that p = 0.05 is known to 8 %.
NULL_DRAWS = 3000


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
    """Names, or numbers, that the data cannot tell apart, linked where |cosine| > alike_cosine."""
    remaining, found = list(range(len(names))), []
    while remaining:
        group, grown = [remaining.pop(0)], True
        while grown:
            near = [j for j in remaining if np.abs(cosine[j, group]).max() > constants().alike_cosine]
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


@dataclass(frozen=True)
class Family:
    """Score tests of fingerprints that are one hypothesis.

    scores: T (c,) [standard errors]; maxima: largest T^2 of each draw of errors alone (draws,).
    """

    scores: Array
    maxima: Array

    def p_of(self, score: float) -> float:
        """P(max_j T_j^2 >= T^2) under the null, for one score T."""
        return float((1 + np.sum(self.maxima >= score**2)) / (1 + self.maxima.size))

    def threshold(self, rate: float) -> float:
        """|T| that the best one exceeds by errors alone at a rate."""
        return float(np.sqrt(np.quantile(self.maxima, 1.0 - rate)))


def family_of(projected: Projected, only_sign: np.ndarray, errors: Array, seed: int) -> Family:
    """Scores of fingerprints against their residual, and what they come to in whitened errors (draws, n) alone."""
    drawn = null_draws(projected, only_sign, errors, seed) ** 2
    maxima = np.asarray(drawn.max(axis=1, initial=0.0))
    return Family(scores(projected, only_sign), maxima)


# Draws of errors alone that are worked on together: what lies between them then fits the memory.
NULL_DRAWS_TOGETHER = 250


@dataclass(frozen=True)
class HypothesisKind:
    """Hypotheses of one kind, whitened and projected.

    log_prior (c,): ln of the chance of each column before the data; size (c,): a = s |S_perp| [-]; scores T (c,);
    only_sign (c,): the only sign that its amplitude may have, 0 for both: a score of the other counts as 0.
    """

    name: str
    projected: Projected
    log_prior: Array
    size: Array
    only_sign: np.ndarray
    scores: Array

    @property
    def log_evidence(self) -> Array:
        """ln B + ln prior of each column (c,)."""
        return self.of_scores(self.scores)

    def of_scores(self, scores: Array) -> Array:
        """The same, had the columns these scores (c,)."""
        return log_factors(scores, self.size) + self.log_prior

    @property
    def gain(self) -> Array:
        """(amplitude - off)^power of each column to first order (c,)."""
        return expected_gain(self.scores, self.projected.length, self.size)

    @property
    def total(self) -> float:
        """ln of the sum over all columns."""
        return float(logsumexp(self.log_evidence))

    @property
    def best(self) -> int:
        """The column with the most evidence."""
        return int(np.argmax(self.log_evidence))


def kind_named(kinds: Iterable[HypothesisKind], name: str) -> HypothesisKind:
    """The kind of that name."""
    return next(one for one in kinds if one.name == name)


def kind_of_hypotheses(
    name: str, projected: Projected, plausible: Array, prior: Array, only_sign: np.ndarray | None = None
) -> HypothesisKind:
    """plausible (c,): s [unit of the size]; prior (c,): chance of each column before the data."""
    if only_sign is None:
        only_sign = np.zeros(plausible.size, dtype=int)
    found = scores(projected, only_sign)
    return HypothesisKind(name, projected, np.log(prior), plausible * projected.length, only_sign, found)


def log_factors(scores: Array, size: Array) -> Array:
    """ln B (..., c) of scores (..., c) and sizes a (c,)."""
    return np.asarray(0.5 * scores**2 * prior_shrinkage(size) - 0.5 * np.log1p(size**2))


def expected_gain(scores: Array, length: Array, size: Array) -> Array:
    """T / |S_perp| a^2 / (1 + a^2) (c,): the mean of an amplitude to first order, given score, length and size a."""
    return np.asarray(scores / np.maximum(length, 1e-300) * prior_shrinkage(size))


def prior_shrinkage(size: Array) -> Array:
    """a^2 / (1 + a^2) (c,) [-]: by how much the prior draws an estimate of that size towards nothing."""
    return np.asarray(size**2 / (1.0 + size**2))


def alarm_p(kinds: Sequence[HypothesisKind], errors: Array, seed: int, slack: float = 0.0) -> float:
    """P(errors alone give as large a sum of Bayes factors over all kinds), counted, (1 + count) / (1 + draws).

    errors (draws, n): whitened; slack: by how much scores are made smaller first [standard errors].
    """
    found = logsumexp([logsumexp(kind.of_scores(np.maximum(np.abs(kind.scores) - slack, 0.0))) for kind in kinds])
    rows = kinds[0].projected.residual.size
    of_prior = np.random.default_rng(seed).standard_normal((len(errors), rows - errors.shape[1]))
    drawn = np.hstack([errors, of_prior]).astype(np.float32)
    terms = [_drawn_terms(kind) for kind in kinds]
    parts = [(terms, drawn[k : k + NULL_DRAWS_TOGETHER]) for k in range(0, len(drawn), NULL_DRAWS_TOGETHER)]
    count = sum(int(np.sum(sums >= found)) for sums in in_threads(_sums_of_draws, parts))
    return (1 + count) / (1 + len(errors))


@dataclass(frozen=True)
class _DrawnTerms:
    """ln (B prior) = constant + factor T^2 of each column of a kind (c,), T = draw . unit; units (rows, c)."""

    units: Single
    only_sign: np.ndarray
    constant: Array
    factor: Array


def _drawn_terms(kind: HypothesisKind) -> _DrawnTerms:
    constant = kind.of_scores(np.zeros(kind.size.size))
    return _DrawnTerms(
        kind.projected.units.astype(np.float32), kind.only_sign, constant, 0.5 * prior_shrinkage(kind.size)
    )


def _sums_of_draws(terms: Sequence[_DrawnTerms], drawn: Single) -> Array:
    """ln of the sum over all kinds of each draw (draws, n) of errors alone, (draws,)."""
    return np.asarray(logsumexp([_sums_of_kind(one, drawn) for one in terms], axis=0))


def _sums_of_kind(one: _DrawnTerms, drawn: Single) -> Array:
    """The same of one kind; in place, which takes a third of the time."""
    if not one.constant.size:
        return np.full(len(drawn), -np.inf)
    values = (drawn @ one.units).astype(np.float64)
    values[:, one.only_sign > 0] = np.maximum(values[:, one.only_sign > 0], 0.0)
    values[:, one.only_sign < 0] = np.minimum(values[:, one.only_sign < 0], 0.0)
    np.square(values, out=values)
    values *= one.factor
    values += one.constant
    most = values.max(axis=1)
    values -= most[:, None]
    np.exp(values, out=values)
    return np.asarray(most + np.log(values.sum(axis=1)))
