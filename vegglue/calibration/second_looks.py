"""Second looks at effects, from where a parameter that lies off its prior is back in its middle.

    z' = z - z_j V_j / V_jj,   V = (J' W' W J + 1)^-1

Where a parameter j has taken over what an effect should explain, such as a canopy that is calibrated too low in place
of plants that bend, the score at the best place z is small, and only another place shows how far down the effect leads.
z' is the best place of the other parameters with z_j = 0, to first order (the mean of a normal distribution given one
of its components); V_j is column j of V. There the least objective with each effect is predicted from slopes and
fingerprints, as at the best place.
"""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.baseline import SearchModel
from vegglue.calibration.evidence import expected_gain, log_factors
from vegglue.calibration.fit import objective
from vegglue.calibration.residual_screening import Screening
from vegglue.case.case_effects import parameters_of_effects
from vegglue.engine.interface import Point, linearise, responses
from vegglue.parallel import in_threads

# Standard deviations of its prior from which a parameter is off, and looks at most, of those furthest off: each costs
# 1.5 s of a core on 9,600 cells. Half a standard deviation was taken back after site 7049 of `drawn_sites`, where a
# canopy too low by 0.46 of them hid streamlining.
OFF, MOST_LOOKS = 0.25, 2


@dataclass(frozen=True)
class SecondLook:
    """log_factor (c,): ln B of each column of the fingerprints as predicted from the point; gain (c,): size there."""

    point: Point
    log_factor: Array
    gain: Array


def second_looks(screening: Screening) -> tuple[SecondLook, ...]:
    """The looks from all such places where a steady flow is found; none where no parameter is off."""
    tasks = [(screening, place) for place in places_of_looks(screening.search)]
    return tuple(one for one in in_threads(_look, tasks) if one is not None)


def places_of_looks(search: SearchModel) -> list[Array]:
    """z' (p,) of each parameter that is off, the furthest first. Amplitudes of effects are not: `rivals_again` has
    those.
    """
    noise, z = search.noise, search.point.z
    of_effects = parameters_of_effects(search.model.case)
    own = [j for j, name in enumerate(search.model.names) if name not in of_effects]
    off = sorted((j for j in own if abs(z[j]) > OFF), key=lambda j: -abs(z[j]))
    white = noise.whiten(noise.used(search.point.slope))
    covariance = np.linalg.inv(white.T @ white + np.eye(z.size))
    return [z - z[j] * covariance[:, j] / covariance[j, j] for j in off[:MOST_LOOKS]]


def _look(screening: Screening, place: Array) -> SecondLook | None:
    """The look from one place; None where no steady flow is found there."""
    search, fingerprints = screening.search, screening.fingerprints
    model, noise = search.model, search.noise
    point = linearise(model, place, search.point)
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
