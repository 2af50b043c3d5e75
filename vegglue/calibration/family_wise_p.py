"""Family-wise p: the chance that errors alone make the best of many score tests score as high as one does.

    p = (1 + #{b: T_b^2 >= T^2}) / (1 + draws)

Residuals that are errors only are drawn, and T_b^2 is the largest of the squared scores of draw b. It is told beside
each effect; the alarm is another sum over the same draws, see `evidence`. No form of the tail is assumed; p is never
below 1 / (1 + draws).
"""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration import score_test


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


def family_of(projected: score_test.Projected, only_sign: np.ndarray, errors: Array, seed: int) -> Family:
    """Scores of fingerprints against their residual, and what they come to in whitened errors (draws, n) alone."""
    drawn = score_test.null_draws(projected, only_sign, errors, seed) ** 2
    maxima = np.asarray(drawn.max(axis=1, initial=0.0))
    return Family(score_test.scores(projected, only_sign), maxima)
