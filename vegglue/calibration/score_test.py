"""Score tests of a residual against many fingerprints, after what calibration can mimic is projected out; the evidence
of each hypothesis, and the alarm that any of them stands out.

    T = S_perp' r / |S_perp|,   S_perp = (I - P) S,   P the projection onto the slopes of the calibrated parameters
    ln B = -1/2 ln(1 + a^2) + 1/2 T^2 a^2 / (1 + a^2),   a = s |S_perp|

Everything here is whitened: errors are independent and standard normal. Rows of the prior stand below those of the
data, so that a calibrated parameter is as free as under its prior.

B is the Bayes factor of a hypothesis of size N(0, s^2) against nothing, T its score and |S_perp| the length of its
fingerprint per unit of size, both in standard errors: the width of its prior is charged (Occam's factor). Groups of
kinds (listed effects, places, instruments) are as likely before; of a group all kinds are, of a kind all hypotheses, of
one hypothesis all settings. What is missing is one of them or nothing. The sum over all sounds the alarm, against the
same sum in draws of errors alone.
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
# Draws of errors alone that are worked on together: what lies between them then fits the memory.
NULL_DRAWS_TOGETHER = 250


@dataclass(frozen=True)
class Projected:
    """Fingerprints S and residual r after the calibrated slopes J have been projected out.

    Attributes
    ----------
    residual : ndarray (rows,)
        [-]
    fingerprints : ndarray (rows, c)
        S_perp [1 per unit of gain].
    length : ndarray (c,)
        |S_perp| [standard errors per unit of gain].
    visible : ndarray (c,)
        |S_perp| / |S| [-].
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
    """(I - P) [r; -z] and (I - P) [S; 0], P onto [J; 1].

    Parameters
    ----------
    slopes : array (n, p)
        J, whitened [-].
    residual : array (n,)
        r, whitened [-].
    z : array (p,)
        Parameters on the scale of their priors [-].
    fingerprints : array (n, c)
        S, whitened [per unit of amplitude].

    Returns
    -------
    Projected
        Of n + p rows, those of the prior last.
    """
    rows, p = slopes.shape
    basis, _ = np.linalg.qr(np.vstack([slopes, np.eye(p)]))
    remaining = np.concatenate([residual, -z])
    seen = -(basis @ (basis[:rows].T @ fingerprints))
    seen[:rows] += fingerprints
    # One pass, where `norm` makes three.
    length, whole = (np.sqrt(np.einsum("ij,ij->j", columns, columns)) for columns in (seen, fingerprints))
    return Projected(remaining - basis @ (basis.T @ remaining), seen, length, length / np.maximum(whole, 1e-300))


def with_evidence(projected: Projected, residual: Array, columns: Array) -> Projected:
    """The projection with rows of other measurements of the same amplitudes, which depend on no calibrated parameter.

    Parameters
    ----------
    projected : Projected
        Of c fingerprints.
    residual : ndarray (rows,)
        Whitened [-].
    columns : ndarray (rows, c)
        Whitened [per unit of amplitude].
    """
    seen = np.vstack([projected.fingerprints, columns])
    length = np.linalg.norm(seen, axis=0)
    whole = np.hypot(projected.length / np.maximum(projected.visible, 1e-300), np.linalg.norm(columns, axis=0))
    return Projected(np.concatenate([projected.residual, residual]), seen, length, length / np.maximum(whole, 1e-300))


def scores(projected: Projected, only_sign: np.ndarray) -> Array:
    """T = S_perp' r / |S_perp|.

    Parameters
    ----------
    only_sign : ndarray (c,) of int
        The only sign that an amplitude may have, 0 for both.

    Returns
    -------
    ndarray (c,)
        [standard errors]; 0 if an effect of one sign would need the other.
    """
    return _signed(projected.score, only_sign)


def _signed(values: Array, only_sign: np.ndarray) -> Array:
    return np.where(only_sign * values < 0, 0.0, values)


@dataclass(frozen=True)
class Family:
    """Score tests of fingerprints that are one hypothesis.

        p = (1 + #{b: T_b^2 >= T^2}) / (1 + draws)

    No form of the tail is assumed.

    Attributes
    ----------
    scores : ndarray (c,)
        T [standard errors].
    maxima : ndarray (draws,)
        The largest T_b^2 of each draw b of errors alone.
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
    """Scores of fingerprints against their residual, and the largest T^2 against draws of errors alone.

    Parameters
    ----------
    only_sign : ndarray (c,) of int
        As of `scores`.
    errors : ndarray (draws, n)
        Whitened errors alone [-].
    seed : int
        Of the rows of the prior.
    """
    drawn = with_more_rows(errors, projected.residual.size, seed) @ projected.units.astype(np.float32)
    squares = _signed(np.asarray(drawn, dtype=np.float64), only_sign) ** 2
    return Family(scores(projected, only_sign), np.asarray(squares.max(axis=1, initial=0.0)))


def with_more_rows(errors: Array, rows: int, seed: int) -> Single:
    """Draws of errors alone, with N(0, 1) for the rows below those of the data.

    Parameters
    ----------
    errors : ndarray (draws, n)
        Whitened [-].
    rows : int
        All of them, n at least.

    Returns
    -------
    ndarray (draws, rows)
        In single precision [-].
    """
    more = np.random.default_rng(seed).standard_normal((len(errors), rows - errors.shape[1]))
    return np.hstack([errors, more]).astype(np.float32)


def chances(projected: Projected, family: Sequence[np.ndarray], allowed: Mapping[float, np.ndarray]) -> Array:
    """Probability of each fingerprint to be the one missing effect (Bayes), of one of a few lengths L.

        p_i ~ sum_L sum_s exp(s L T_i - L^2 / 2) / n_jL,  s = +1, -1

    n_jL is the number of fingerprints and signs of family j that are allowed. All L are as likely before, and so are
    all families with any allowed.

    Parameters
    ----------
    projected : Projected
        Of c fingerprints.
    family : sequence of arrays
        Columns of each family of fingerprints, which is one effect.
    allowed : dict of arrays (2, c)
        By L [standard errors], whether a fingerprint may have either sign at that length.

    Returns
    -------
    array (c,)
        Of sum 1 [-].
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
    """The fewest groups of families that hold a chance together, likelier groups and families first.

    Parameters
    ----------
    projected : Projected
        Of c fingerprints.
    family : sequence of ndarray
        Columns of each family; it is grouped by its likeliest.
    chance : ndarray (c,)
        Of each fingerprint, see `chances` [-].
    level : float
        The chance to be held [-].

    Returns
    -------
    list of list of int
        Families of each group, by number.
    """
    of_family = np.array([chance[columns].sum() for columns in family])
    possible = [int(j) for j in np.argsort(-of_family) if of_family[j] > 0]
    units = projected.units[:, [int(family[j][np.argmax(chance[family[j]])]) for j in possible]]
    return fewest_groups(alike_groups(possible, units.T @ units), of_family, level)


def fewest_groups(found: Sequence[list[int]], chance: Array, level: float) -> list[list[int]]:
    """The fewest groups that hold a chance together, likelier ones first.

    Parameters
    ----------
    found : sequence of list of int
        Members of each group.
    chance : ndarray (k,)
        Of each member [-].
    level : float
        The chance to be held [-].
    """
    ranked = sorted(found, key=lambda group: -chance[group].sum())
    held = np.cumsum([chance[group].sum() for group in ranked])
    return ranked[: int(np.searchsorted(held, level)) + 1]


def cosines(projected: Projected) -> Array:
    """cos_ij = S_i' S_j / |S_i| |S_j| of projected fingerprints.

    Returns
    -------
    ndarray (c, c)
        [-]
    """
    return np.asarray(projected.units.T @ projected.units)


def alike_groups(names: Sequence[Name], cosine: Array) -> list[list[Name]]:
    """Members that the data cannot separate, linked if |cosine| > alike_cosine (single linkage).

    Parameters
    ----------
    cosine : ndarray (k, k)
        Of projected fingerprints, of each pair of names [-].

    Returns
    -------
    list of list
        Names of each group; every name is in one.
    """
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


@dataclass(frozen=True)
class HypothesisKind:
    """Hypotheses of one kind, whitened and projected.

    Attributes
    ----------
    log_prior : ndarray (c,)
        ln of the chance of each column before the data [-].
    size : ndarray (c,)
        a = s |S_perp| [-].
    only_sign : ndarray of int (c,)
        The only sign that its amplitude may have, 0 for both: a score of the other counts as 0.
    scores : ndarray (c,)
        T [standard errors].
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
    """a = s |S_perp| and T of each hypothesis of a kind.

    Parameters
    ----------
    projected : Projected
        Of c fingerprints.
    plausible : ndarray (c,)
        s [unit of the gain]; 0 for one that is not looked for.
    prior : ndarray (c,)
        Chance of each column before the data, above 0 [-].
    only_sign : ndarray (c,) of int, optional
        As of `scores`.
    """
    if only_sign is None:
        only_sign = np.zeros(plausible.size, dtype=int)
    found = scores(projected, only_sign)
    return HypothesisKind(name, projected, np.log(prior), plausible * projected.length, only_sign, found)


def log_factors(scores: Array, size: Array) -> Array:
    """ln B = T^2/2 a^2 / (1 + a^2) - ln(1 + a^2)/2.

    Parameters
    ----------
    scores : ndarray (..., c)
        T [standard errors].
    size : ndarray (c,)
        a [-].

    Returns
    -------
    ndarray (..., c)
        [-]
    """
    return np.asarray(0.5 * scores**2 * prior_shrinkage(size) - 0.5 * np.log1p(size**2))


def expected_gain(scores: Array, length: Array, size: Array) -> Array:
    """g = T / |S_perp| a^2 / (1 + a^2): the mean of a gain to first order.

    Parameters
    ----------
    scores : ndarray (c,)
        T [standard errors].
    length : ndarray (c,)
        |S_perp| [standard errors per unit of gain].
    size : ndarray (c,)
        a [-].

    Returns
    -------
    ndarray (c,)
        [unit of the gain]
    """
    return np.asarray(scores / np.maximum(length, 1e-300) * prior_shrinkage(size))


def prior_shrinkage(size: Array) -> Array:
    """a^2 / (1 + a^2): share of an estimate that its prior leaves.

    Parameters
    ----------
    size : ndarray
        a [-].

    Returns
    -------
    ndarray
        [-]
    """
    return np.asarray(size**2 / (1.0 + size**2))


def alarm_p(kinds: Sequence[HypothesisKind], errors: Array, seed: int, slack: float = 0.0) -> float:
    """P(errors alone give as large a sum of Bayes factors over all kinds), counted, (1 + count) / (1 + draws).

    Parameters
    ----------
    kinds : sequence of HypothesisKind
        One at least.
    errors : array (draws, n)
        Whitened errors alone [-].
    seed : int
        Of the rows of the prior.
    slack : float
        By how much scores are made smaller first [standard errors].

    Returns
    -------
    float
        Never below 1 / (1 + draws).
    """
    found = logsumexp([logsumexp(kind.of_scores(np.maximum(np.abs(kind.scores) - slack, 0.0))) for kind in kinds])
    return (1 + int(np.sum(_sums_under_errors(kinds, errors, seed) >= found))) / (1 + len(errors))


def alarm_level(kinds: Sequence[HypothesisKind], errors: Array, seed: int, rate: float) -> float:
    """ln of the sum of Bayes factors over all kinds that errors alone exceed at a rate.

    Parameters
    ----------
    kinds, errors, seed
        As of `alarm_p`.
    rate : float
        [-]

    Returns
    -------
    float
        [-]
    """
    return float(np.quantile(_sums_under_errors(kinds, errors, seed), 1.0 - rate))


def _sums_under_errors(kinds: Sequence[HypothesisKind], errors: Array, seed: int) -> Array:
    """ln of the sum over all kinds of each draw of errors alone (draws,)."""
    rows = [kind.projected.residual.size for kind in kinds]
    drawn = with_more_rows(errors, max(rows), seed)
    terms = [
        _DrawnTerms(
            kind.projected.units.astype(np.float32),
            kind.only_sign,
            kind.of_scores(np.zeros(kind.size.size)),
            0.5 * prior_shrinkage(kind.size),
        )
        for kind in kinds
    ]

    def sums_of(part: Single) -> Array:
        sums = [one.sums(part[:, :count]) for one, count in zip(terms, rows, strict=True)]
        return np.asarray(logsumexp(sums, axis=0))

    parts = [(drawn[k : k + NULL_DRAWS_TOGETHER],) for k in range(0, len(drawn), NULL_DRAWS_TOGETHER)]
    return np.concatenate(in_threads(sums_of, parts))


@dataclass(frozen=True)
class _DrawnTerms:
    """ln (B prior) = constant + factor T^2 of each column of a kind (c,), T = draw . unit; units (rows, c)."""

    units: Single
    only_sign: np.ndarray
    constant: Array
    factor: Array

    def sums(self, drawn: Single) -> Array:
        """ln of the sum over the columns for each draw (draws, rows), (draws,); in place, in a third of the time."""
        if not self.constant.size:
            return np.full(len(drawn), -np.inf)
        values = (drawn @ self.units).astype(np.float64)
        values[:, self.only_sign > 0] = np.maximum(values[:, self.only_sign > 0], 0.0)
        values[:, self.only_sign < 0] = np.minimum(values[:, self.only_sign < 0], 0.0)
        np.square(values, out=values)
        values *= self.factor
        values += self.constant
        most = values.max(axis=1)
        values -= most[:, None]
        np.exp(values, out=values)
        return np.asarray(most + np.log(values.sum(axis=1)))
