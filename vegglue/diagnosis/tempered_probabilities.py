"""Chances from evidence, where the traces of causes are not quite nature's.

    p_j ~ exp((E_j - max E) / w_j),   w_j = 1 + e^2 2 E_j

e is the relative error of a fingerprint. That of an effect in nature differs from the model's, whose cells and laws are
not nature's: where much is explained, errors count as w^(1/2) times as large.
"""

import numpy as np

from vegglue.arrays import Array
from vegglue.decision_constants import constants

# Odds beyond e^this are told as this: larger numbers say no more.
LARGEST_LOG_ODDS = 100.0


def tempered_probabilities(evidence: Array, trace_error: float | None = None) -> Array:
    """p_j of E_j (k,) [-]; trace_error: relative error of a fingerprint [-]."""
    weight = np.exp((evidence - evidence.max()) / tempering(evidence, trace_error))
    return np.asarray(weight / weight.sum())


def tempering(evidence: Array, trace_error: float | None = None) -> Array:
    """w = 1 + e^2 2 E, at least 1, e the relative error of a fingerprint."""
    error = constants().fingerprint_error if trace_error is None else trace_error
    return np.asarray(1.0 + error**2 * 2.0 * np.maximum(evidence, 0.0))


def tempered_odds(evidence: float, other: float) -> float:
    """p_1 / p_2 of the chances of these two alone [-]."""
    return float(np.exp(min((evidence - other) / float(tempering(np.array(min(evidence, other)))), LARGEST_LOG_ODDS)))
