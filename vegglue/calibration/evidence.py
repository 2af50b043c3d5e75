"""The evidence for hypotheses of every kind, to first order in their size, and the alarm that any of them stands out.

    ln B = -1/2 ln(1 + a^2) + 1/2 T^2 a^2 / (1 + a^2),   a = s |S_perp|

B is the Bayes factor of a hypothesis of size N(0, s^2) against nothing, T its score and |S_perp| the length of its
fingerprint per unit of size, both in standard errors (see `score_test`): the width of its prior is charged (Occam's
factor). Groups of kinds (listed effects, places, instruments) are as likely before; of a group all kinds are, of a kind
all hypotheses, of one hypothesis all settings. What is missing is one of them or nothing. The alarm is sounded by the
sum over all, against the same sum in draws of errors alone.
Source: Kass and Raftery (1995), doi:10.2307/2291091, for Bayes factors; not checked against it.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from vegglue.arrays import Array, Single
from vegglue.calibration import score_test
from vegglue.parallel import in_threads

# Draws of errors alone that are worked on together: what lies between them then fits the memory.
NULL_DRAWS_TOGETHER = 250


@dataclass(frozen=True)
class HypothesisKind:
    """Hypotheses of one kind, whitened and projected.

    log_prior (c,): ln of the chance of each column before the data; size (c,): a = s |S_perp| [-]; scores T (c,);
    only_sign (c,): the only sign that its amplitude may have, 0 for both: a score of the other counts as 0.
    """

    name: str
    projected: score_test.Projected
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
    name: str, projected: score_test.Projected, plausible: Array, prior: Array, only_sign: np.ndarray | None = None
) -> HypothesisKind:
    """plausible (c,): s [unit of the size]; prior (c,): chance of each column before the data."""
    if only_sign is None:
        only_sign = np.zeros(plausible.size, dtype=int)
    scores = score_test.scores(projected, only_sign)
    return HypothesisKind(name, projected, np.log(prior), plausible * projected.length, only_sign, scores)


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
