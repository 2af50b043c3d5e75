"""Chances of laws and other causes, each the one that is missing."""

from vegglue.arrays import Array
from vegglue.decision_constants import constants
from vegglue.diagnosis.tempered_probabilities import tempered_probabilities


def chances_in_set(evidence: Array) -> Array:
    """p_j of the ln evidence of each (k,) [-], as in `competition`, with law_fingerprint_error."""
    return tempered_probabilities(evidence, constants().law_fingerprint_error)
