"""Odds of hypotheses by their evidence E, tempered: neither fingerprints nor stated errors are exact.

    p_j ~ exp((E_j - max E) / w_j),   w_j = 1 + e^2 2 E_j

Probabilities are tempered by e, the relative error of a fingerprint: the cells and laws of a model are not those of
nature, and the more a hypothesis explains the more this counts, as if errors were w^(1/2) times as large.

A significant misfit alone names nothing: errors alone give one at a stated rate. A hypothesis is accepted only if all
of them together lead "nothing is missing" by missing_odds, with errors as large as the best of them leaves:

    E'_j = E_j - (1 - 1/w) L_j,   w = max(1, chi2 / n)

L is the part of E that is likelihood, and w the square of Birge's ratio, 1 unless errors alone would leave less. E'
also compares effects with the same fingerprint: their misfits differ by less than the error of the model, and their
prior probabilities, at the sizes they need, decide.
"""

import numpy as np
from scipy.special import logsumexp

from vegglue.arrays import Array
from vegglue.calibration.fit import chance_of_misfit
from vegglue.decision_constants import constants

# Odds beyond e^this are reported as this: larger numbers mean no more.
LARGEST_LOG_ODDS = 100.0


def tempered_probabilities(evidence: Array, trace_error: float | None = None) -> Array:
    """p_j ~ exp((E_j - max E) / w_j),   w_j = 1 + e^2 2 E_j

    Parameters
    ----------
    evidence : ndarray (k,)
        E, ln evidence with its prior [-].
    trace_error : float, optional
        e, relative error of a fingerprint [-]; fingerprint_error of the constants if not given.

    Returns
    -------
    ndarray (k,)
        [-], of sum 1.
    """
    weight = np.exp((evidence - evidence.max()) / tempering(evidence, trace_error))
    return np.asarray(weight / weight.sum())


def tempering(evidence: Array, trace_error: float | None = None) -> Array:
    """w = 1 + e^2 2 max(E, 0): by how much ln odds are reduced, see the head of this file.

    Parameters
    ----------
    evidence : ndarray
        E [-].
    trace_error : float, optional
        e, relative error of a fingerprint [-]; fingerprint_error of the constants if not given.

    Returns
    -------
    ndarray
        [-]
    """
    error = constants().fingerprint_error if trace_error is None else trace_error
    return np.asarray(1.0 + error**2 * 2.0 * np.maximum(evidence, 0.0))


def tempered_odds(evidence: float, other: float) -> float:
    """p_1 / p_2 = exp((E_1 - E_2) / w),   w that of the lesser of both: odds of these two alone.

    Parameters
    ----------
    evidence, other : float
        E_1 and E_2 [-].

    Returns
    -------
    float
        [-], e^LARGEST_LOG_ODDS at most.
    """
    return float(np.exp(min((evidence - other) / float(tempering(np.array(min(evidence, other)))), LARGEST_LOG_ODDS)))


def chances_in_set(evidence: Array) -> Array:
    """`tempered_probabilities` of laws and all that they are compared with, e = law_fingerprint_error.

    Parameters
    ----------
    evidence : ndarray (k,)
        E [-].

    Returns
    -------
    ndarray (k,)
        [-], of sum 1.
    """
    return tempered_probabilities(evidence, constants().law_fingerprint_error)


def odds_against_nothing(evidence: Array) -> float:
    """sum_j e^E_j: the odds that one of them is missing, and not nothing, both as likely before.

    Parameters
    ----------
    evidence : ndarray (k,)
        E [-].

    Returns
    -------
    float
        [-], e^LARGEST_LOG_ODDS at most.
    """
    return float(np.exp(min(logsumexp(evidence), LARGEST_LOG_ODDS)))


def log_odds_taken(evidence: Array) -> float:
    """ln sum_j e^E_j: the odds that one of them is missing, and not nothing, both as likely before.

    Parameters
    ----------
    evidence : ndarray (k,)
        E [-].

    Returns
    -------
    float
        [-]; 0 below missing_odds, where none is taken.
    """
    odds = odds_against_nothing(evidence)
    return float(np.log(odds)) if odds >= constants().missing_odds else 0.0


def under_larger_errors(evidence: Array, left: Array, before: float, readings: int) -> Array:
    """E' = E - (1 - 1/w) L with L = (before - left) / 2, see the head of this file.

    Parameters
    ----------
    evidence, left : ndarray (k,)
        E of each hypothesis, and the chi2 that it leaves [-].
    before : float
        chi2 without any [-]; what it is changes no difference between hypotheses.
    readings : int
        How many there are, n.

    Returns
    -------
    ndarray (k,)
        E itself where errors alone leave as large a chi2 as the best does, by poor_fit_chance.
    """
    least = float(left.min())
    if chance_of_misfit(least, readings) >= constants().poor_fit_chance:
        return evidence
    return np.asarray(evidence - 0.5 * (1.0 - readings / least) * (before - left))
