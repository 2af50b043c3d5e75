"""A second look at effects from half way between the best place and the middle of the prior.

Where a parameter has taken over what an effect should explain, such as a canopy that is calibrated too low in place of
plants that bend, the score at the best place is small, and only another place shows how far down the effect leads.
There the least objective with each effect is predicted from slopes and fingerprints, as at the best place.
"""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.fit import objective
from vegglue.engine.interface import Point, linearise, responses
from vegglue.screening import score_test
from vegglue.screening.evidence import expected_gain, log_factors
from vegglue.screening.residual_screening import Screening

# Where the second place lies, over the best one on the scale of z [-]. Chosen, not measured.
SHARE_OF_BEST = 0.5


@dataclass(frozen=True)
class SecondLook:
    """log_factor (c,): ln B of each column of the fingerprints as predicted from the point; gain (c,): size there."""

    point: Point
    log_factor: Array
    gain: Array


def second_look(screening: Screening) -> SecondLook | None:
    """The look from the second place; None where no steady flow is found there."""
    search, fingerprints = screening.search, screening.fingerprints
    model, noise = search.model, search.noise
    point = linearise(model, SHARE_OF_BEST * search.point.z, search.point)
    if point is None:
        return None
    found = responses(model, point, fingerprints.causes)
    slope, residual = noise.whiten(noise.used(point.slope)), noise.whiten(noise.residual(point.prediction))
    projected = score_test.project(slope, residual, point.z, noise.whiten(noise.used(found)))
    score = score_test.scores(projected, fingerprints.only_sign)
    size = projected.length * np.array([amplitude.plausible_gain for amplitude in fingerprints.amplitudes])
    nothing = float(projected.residual @ projected.residual)
    log_factor = 0.5 * (objective(noise, search.point) - nothing) + log_factors(score, size)
    return SecondLook(point, log_factor, expected_gain(score, projected.length, size))
