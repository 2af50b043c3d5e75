"""Slopes of predictions are those of solved members, lead to other grids, and a fit on them finds the truth."""

from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from built_models import model_of

from vegglue.calibration.fit import fit
from vegglue.calibration.noise import noise_of
from vegglue.case.config import load_case
from vegglue.case.parameter_space import theta_at
from vegglue.engine.interface import Model, linearise
from vegglue.engine.model import coarser
from vegglue.engine.newton import SteadyFlow, predict_near
from vegglue.flow.jacobian import Factors
from vegglue.measurements.observations import read_observations

pytestmark = pytest.mark.slow

CONFIG = Path(__file__).parents[2] / "configs" / "twin.yaml"


def twin() -> Model:
    case = load_case(CONFIG)
    return model_of(case, read_observations(case))


def test_slopes_are_those_of_solved_members() -> None:
    model = twin()
    z = np.array([0.3, -0.2, 0.5, 0.1])
    point = linearise(model, z)
    assert point is not None
    steps = 0.01 * np.eye(4)
    measured = (predict_near(model, point, z + steps) - predict_near(model, point, z - steps)) / 0.02
    assert point.slope == pytest.approx(measured.T, abs=2e-4)


def test_a_point_leads_to_one_on_narrower_cells() -> None:
    model = twin()
    coarse = coarser(model)
    assert coarse is not None
    assert coarse.site.bed.shape == (model.site.bed.shape[0], model.site.bed.shape[1] // 2), "long cells become wider"
    z = np.array([0.3, -0.2, 0.5, 0.1])
    cold, near = linearise(model, z), linearise(coarse, z)
    assert cold is not None
    assert near is not None
    warm = linearise(model, z, near)
    assert warm is not None
    assert warm.prediction == pytest.approx(cold.prediction, abs=1e-6)


def test_where_a_point_nearby_leads_nowhere_a_cold_start_finds_the_flow() -> None:
    """There was said to be no flow, and the diagnosis of a river ended."""
    model, z = twin(), np.array([0.3, -0.2, 0.5, 0.1])
    coarse = coarser(model)
    assert coarse is not None
    cold, there = linearise(model, z), linearise(coarse, z)
    assert cold is not None
    assert there is not None
    astray = {}
    for experiment, flow in there.flows.items():
        assert isinstance(flow, SteadyFlow)
        noise = np.random.default_rng(4).uniform(-3.0, 3.0, flow.state.shape)
        astray[experiment] = replace(flow, state=flow.state + noise, slopes=np.zeros_like(flow.slopes))
    found = linearise(model, z, replace(there, flows=astray))
    assert found is not None
    assert found.prediction == pytest.approx(cold.prediction, abs=1e-6)


def test_a_start_follows_the_slopes_of_the_parameters_that_they_are_of() -> None:
    slopes, no_factors = np.random.default_rng(1).standard_normal((4, 3, 5, 2)), cast(Factors, None)
    slopes[:, 1, 0] = 0.0  # nothing flows through the first side
    flow = SteadyFlow(np.ones((4, 3, 5, 1)), (0, 5), 5, no_factors, slopes, 0.0)
    assert flow.after(np.array([0.1, -0.2])) == pytest.approx(1.0 + slopes @ np.array([[0.1], [-0.2]]))
    assert flow.after(np.array([0.1])) == pytest.approx(1.0 + 0.1 * slopes[..., :1])


def test_a_flow_reuses_the_factors_of_one_nearby_and_makes_its_own_further_away() -> None:
    model = twin()
    first = linearise(model, np.zeros(4))
    assert first is not None
    for far, reused in ((0.003, True), (0.2, False)):
        z = np.full(4, far)
        near, alone = linearise(model, z, first), linearise(model, z)
        assert near is not None
        assert alone is not None
        assert near.prediction == pytest.approx(alone.prediction, abs=1e-6)
        assert near.slope == pytest.approx(alone.slope, abs=1e-5)
        assert all((near.flows[name].factors is flow.factors) == reused for name, flow in first.flows.items())


def test_factors_are_renewed_after_many_small_moves() -> None:
    model = twin()
    point = first = linearise(model, np.zeros(4))
    for k in range(1, 40):
        assert point is not None
        point = linearise(model, np.full(4, 0.01 * k), point)
    assert first is not None
    assert point is not None
    assert all(point.flows[name].factors is not flow.factors for name, flow in first.flows.items())


def test_a_fit_finds_the_place_the_measurements_were_made_at() -> None:
    model = twin()
    truth = linearise(model, np.array([0.4, -0.3, 0.2, -0.5]))
    assert truth is not None
    exact = model.station.assign(value=truth.prediction)
    made = replace(model, station=exact)
    start = linearise(made, np.zeros(4))
    assert start is not None
    fitted = fit(made, noise_of(exact), start)
    # The prior pulls towards zero, by less than its share of what is known.
    assert np.abs(fitted.point.z - truth.z).max() < 3.0 * np.sqrt(np.diag(fitted.covariance)).max()
    assert fitted.chi2 < 1.0
    assert theta_at(model.case, fitted.point.z)["n_b"] == pytest.approx(theta_at(model.case, truth.z)["n_b"], rel=0.02)
