"""Family-wise p: the chance that errors alone make the best of many score tests score as high as it does.

Both p-values come from one bootstrap: residuals that are errors only are drawn, and T_b^2 is the largest of the squared
scores of draw b.

    counted    p = (1 + #{b: T_b^2 >= T^2}) / (1 + draws)                               family_p
    fitted     p = 1 - (1 - P(chi2_1 >= T^2))^m,  p = 0.05 where T^2 is the 95 % point of the T_b^2    log_family_p

The fitted one decides: its logarithm still ranks families where no draw reaches T. It is Sidak's (1967,
doi:10.1080/01621459.1967.10482935; not checked against it) for m independent tests; m is the effective number of tests
that correlated scores amount to. The counted one is told beside each effect: it assumes no form of the tail, and is
never below 1 / (1 + draws).

Both agree near 0.05, to the 8 % that 3,000 draws leave open. Further out correlated scores amount to more tests than m:
against 400,000 draws of configs/twin.yaml the fitted p is 0.97 of the true one at 0.04, 0.87 at 0.01 and 0.78 at 0.002
for effects, 1.09, 0.88 and 0.68 for spots of drag, and right for stations. So false alarms are as rare as stated at the
first step and up to half more frequent at later ones. Nearer to 1 the fitted p is the larger one; nothing is decided
there.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.stats

from vegglue.arrays import Array
from vegglue.screening import score_test

# p at which the fitted tail meets the counted one: near the rates of false alarms, and with 150 of 3,000 draws beyond.
FITTED_AT = 0.05


@dataclass(frozen=True)
class Family:
    """Score tests of fingerprints that are one hypothesis.

    scores: T (c,) [standard errors]; length: |S_perp| (c,), standard errors per unit of amplitude; maxima: largest T^2
    of each draw of errors alone (draws,).
    """

    scores: Array
    length: Array
    maxima: Array

    @property
    def best(self) -> int:
        """The fingerprint with the largest |T|."""
        return int(np.argmax(self.scores**2))

    @property
    def effective_tests(self) -> float:
        """m = -ln(1 - p) / P(chi2_1 >= q), to first order in P [-]; p = FITTED_AT, q the 1 - p point of the maxima."""
        point = np.quantile(self.maxima, 1.0 - FITTED_AT)
        return float(-np.log(1.0 - FITTED_AT) / scipy.stats.chi2.sf(point, 1))

    def log_p(self, slack: float = 0.0) -> float:
        """ln p, fitted, of the best |T| made smaller by `slack`: what is decided by; 0 without any fingerprint."""
        if not self.scores.size:
            return 0.0
        return log_family_p(max(float(np.abs(self.scores).max()) - slack, 0.0), self.effective_tests)

    def p_of(self, score: float) -> float:
        """p, counted, of one score: what is told of an effect."""
        return family_p(score, self.maxima)

    def threshold(self, rate: float) -> float:
        """|T| that the best one exceeds by errors alone at a rate."""
        return float(np.sqrt(np.quantile(self.maxima, 1.0 - rate)))

    def without(self, fingerprints: tuple[int, ...]) -> "Family":
        """The same with scores of 0 for some; the maxima stay those of all."""
        scores = self.scores.copy()
        scores[list(fingerprints)] = 0.0
        return replace(self, scores=scores)


def family_of(projected: score_test.Projected, one_sided: np.ndarray, errors: Array, seed: int) -> Family:
    """Scores of fingerprints against their residual, and what they come to in whitened errors (draws, n) alone."""
    drawn = score_test.null_draws(projected, one_sided, errors, seed) ** 2
    maxima = np.asarray(drawn.max(axis=1, initial=0.0))
    return Family(score_test.scores(projected, one_sided), projected.length, maxima)


def family_p(score: float, maxima: Array) -> float:
    """P(max_j T_j^2 >= T^2) under the null, (1 + count) / (1 + draws); maxima: T_b^2 (draws,).

    To be told, not to be decided by: uniform under the null, but 1 / (1 + draws) for every T that no draw reaches.
    """
    return float((1 + np.sum(maxima >= score**2)) / (1 + maxima.size))


def log_family_p(score: float, tests: float) -> float:
    """ln(1 - (1 - P(chi2_1 >= T^2))^m) of a score T and m effective tests; m P(...) where that is small.

    To be decided by: agrees with `family_p` near 0.05, and goes on where no draw reaches.
    """
    log_tail = float(scipy.stats.chi2.logsf(score**2, 1))
    log_p = np.log(tests) + log_tail
    if log_p > -4.0:
        log_p = np.log(-np.expm1(tests * np.log1p(-min(np.exp(log_tail), 1.0 - 1e-12))))
    return float(min(log_p, 0.0))
