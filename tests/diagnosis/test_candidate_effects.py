"""What is told of an effect to first order: on a model that is linear, where it is what a refit would give."""

from dataclasses import replace

import numpy as np
import pytest
from linear_baseline import CASE_OF_TWINS, at_best, stations_of

from vegglue.calibration.baseline import Baseline
from vegglue.calibration.candidates import Candidate
from vegglue.calibration.fingerprints import Fingerprints
from vegglue.calibration.residual_screening import screen
from vegglue.diagnosis.candidate_effects import candidate_effects_of
from vegglue.effects.library import library
from vegglue.results.causes import CandidateEffect

STATION = stations_of(CASE_OF_TWINS, ("A", "B"), 6)


LISTED = library()["bank_trend"]


def on_linear_model(visible: float, end: float = 5.0) -> tuple[CandidateEffect, Baseline]:
    """An effect of 1.5 plausible sizes, each some `visible` standard errors long and `end` of them possible, as it is
    told to first order, and the model calibrated with it.
    """
    random = np.random.default_rng(4)
    slope = 0.02 * random.standard_normal((len(STATION), len(CASE_OF_TWINS.parameters)))
    own = replace(LISTED, amplitude=replace(LISTED.amplitude, scale=1.0, low=-end, high=end))
    trace = visible * 0.01 * random.standard_normal((len(STATION), 1)) / len(STATION) ** 0.5
    values = (
        slope @ random.standard_normal(slope.shape[1]) + 1.5 * trace[:, 0] + 0.01 * random.standard_normal(len(STATION))
    )
    base = at_best(CASE_OF_TWINS, STATION, values, slope)
    known = Fingerprints(
        base.fitted.point, [Candidate(own)], [np.array([0])], [{}], [own.amplitude], [], trace, places=()
    )
    screening = screen(base, (), known)
    assert (screening.base.noise.correlation, screening.base.noise.scale) == (0.0, 1.0)
    (candidate_effect,) = candidate_effects_of(screening).values()
    return candidate_effect, at_best(CASE_OF_TWINS, STATION, values, np.hstack([slope, trace]))


@pytest.mark.parametrize("visible", [0.2, 5.0])
def test_sizes_are_told_with_their_prior_as_those_of_refits(visible: float) -> None:
    """What the data hardly see was told as 1.4 plausible sizes, give or take 10: its refit says 0, give or take 2."""
    candidate_effect, refitted = on_linear_model(visible)
    fitted, told = refitted.fitted, candidate_effect.amplitude
    error = 1.96 * fitted.covariance[-1, -1] ** 0.5
    assert told.value == pytest.approx(fitted.point.z[-1], abs=1e-6)
    assert told.interval95 == pytest.approx((told.value - error, told.value + error), rel=1e-3)


@pytest.mark.parametrize("visible", [0.2, 5.0])
def test_the_least_sum_of_squares_is_told_with_the_prior_of_the_amplitude(visible: float) -> None:
    """Without it an effect that the data hardly see was told to explain more than its refit does."""
    candidate_effect, refitted = on_linear_model(visible)
    assert candidate_effect.amplitude.objective == pytest.approx(refitted.fitted.objective, abs=1e-6)


@pytest.mark.parametrize(("end", "testable"), [(5.0, True), (1.5, False)])
def test_what_would_be_seen_only_beyond_its_bounds_is_untestable(end: float, testable: bool) -> None:
    """The rotation of the earth ends at 1.5 plausible sizes, and was told to be testable at two."""
    candidate_effect, _ = on_linear_model(2.6, end)
    assert 1.5 < candidate_effect.detectability.smallest < 2.0
    assert candidate_effect.detectability.testable is testable
