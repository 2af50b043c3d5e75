"""Where the search for the best place begins, and what it ends at."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from reach import write_reach
from refined_reach import FEW_MEMBERS, STATED_ERRORS, SolvedReach

from vegglue.calibration.fit import MapEstimate
from vegglue.calibration.noise import noise_of, with_correlation
from vegglue.case.config import load_case
from vegglue.case.parameter_space import z_at
from vegglue.engine.interface import Engine, Point, linearise
from vegglue.engine.model import model_of
from vegglue.errors import InputError
from vegglue.inference.posterior_modes import (
    distinct_modes,
    find_modes,
    points_of_prior,
    standardised_residual,
    starting_points,
)
from vegglue.inference.refine import log_posterior, refine
from vegglue.measurements.observations import read_observations
from vegglue.parallel import at_most
from vegglue.progress import silent
from vegglue.results.posterior import Posterior


def test_starts_are_the_best_that_lie_apart(reach: SolvedReach) -> None:
    case, observations, ensemble = reach
    noise, z = noise_of(observations.table), z_at(case, ensemble.parameters)
    starts = starting_points(noise, z, ensemble.prediction)
    logs = log_posterior(noise, z, ensemble.prediction)
    assert np.array_equal(starts[0], z[np.argmax(logs)])
    apart = np.linalg.norm(starts[:, None] - starts[None], axis=2) + np.eye(len(starts))
    assert apart.min() > 0.7


@pytest.mark.slow
def test_points_of_the_prior_lead_to_the_same_posterior(reach: SolvedReach, refined: Posterior) -> None:
    case, observations, _ = reach
    with at_most(1):
        found = refine(None, model_of(case, observations))
    assert found.settings.ensemble_hash == ""
    assert found.weighting.effective_size >= 1000
    assert found.refinement is not None
    assert refined.refinement is not None
    assert found.refinement.modes.mode_chi2 == pytest.approx(refined.refinement.modes.mode_chi2, rel=1e-3)
    for name, quantiles in refined.marginals.quantiles.items():
        sd = refined.marginals.sd[name]
        assert found.marginals.quantiles[name] == pytest.approx(quantiles, abs=0.15 * sd)


def test_points_of_the_prior_are_tried_on_coarse_cells(tmp_path: Path) -> None:
    case = load_case(write_reach(tmp_path, ("cell: [1.0, 0.5]", "cell: [0.625, 0.375]"), FEW_MEMBERS, STATED_ERRORS))
    model = model_of(case, read_observations(case))
    tried = points_of_prior(model)
    assert tried.prediction.shape == (64, len(model.station))
    own = linearise(model, tried.z[3])
    assert own is not None
    apart = np.abs(tried.prediction[3] - own.prediction).max()
    assert 1e-6 < apart < 0.1
    assert np.array_equal(tried.z, points_of_prior(model).z)


def test_without_a_prior_nothing_is_tried(reach: SolvedReach) -> None:
    model = model_of(*reach[:2])
    with pytest.raises(InputError, match=model.case.name):
        points_of_prior(replace(model, case=model.case.model_copy(update={"parameters": {}})))


def test_ends_of_the_search_are_counted_once() -> None:
    def end(place: float, objective: float) -> MapEstimate:
        point = Point(np.array([place]), np.zeros(1), np.zeros((1, 1)), {})
        return MapEstimate(point, objective, objective, np.eye(1))

    found = distinct_modes([end(2.5, 12.0), end(0.1, 10.1), end(0.0, 10.0), end(9.0, 80.0)])
    assert [one.objective for one in found] == [10.0, 12.0]


def test_what_stands_out_is_standard_normal_otherwise(reach: SolvedReach) -> None:
    case, observations, _ = reach
    model = model_of(case, observations)
    point = linearise(model, np.zeros(2))
    assert point is not None
    noise = with_correlation(noise_of(observations.table), 0.4, 1.0)
    random = np.random.default_rng(1)
    clean = [
        standardised_residual(replace(noise, value=point.prediction + noise.lower @ random.normal(size=15)), point)
        for _ in range(400)
    ]
    assert np.std(clean) == pytest.approx(1, abs=0.08)
    value = point.prediction.copy()
    value[4] += 0.1
    assert np.argmax(np.abs(standardised_residual(replace(noise, value=value), point))) == 4


def lost_from_coarse_cells(engine: Engine) -> Engine:
    """One that finds no flow at a place from the flow there on cells of another size."""
    return replace(
        engine, linearise=lambda model, z, near, wanted:
        None if near is not None and near.z is z else engine.linearise(model, z, near, wanted),
    )  # fmt: skip


def test_where_no_flow_is_found_from_coarse_cells_the_search_goes_on(tmp_path: Path) -> None:
    """A floodplain ended without a posterior: from the one mode on coarse cells no flow was found on its own."""
    case = load_case(write_reach(tmp_path, ("cell: [1.0, 0.5]", "cell: [0.5, 0.375]"), STATED_ERRORS))
    observations = read_observations(case)
    model, noise = model_of(case, observations), noise_of(observations.table)
    with at_most(1):
        tried = points_of_prior(model)
        usual = find_modes(model, noise, tried, watch=silent)
        anew = find_modes(replace(model, engine=lost_from_coarse_cells(model.engine)), noise, tried, watch=silent)
    assert usual.on_coarse, "there are coarse cells to begin with"
    assert anew.fits[0].objective == pytest.approx(usual.fits[0].objective, abs=0.1)
