"""Where the search for modes begins and what it ends at; two patches side by side have two modes, mirror images."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from built_models import model_of
from reach import COARSE, write_reach
from refined_reach import FEW_MEMBERS, STATED_ERRORS, SolvedReach

from vegglue.calibration.fit import MapEstimate
from vegglue.calibration.noise import noise_of, with_correlation
from vegglue.case.config import load_case
from vegglue.case.parameter_space import z_at
from vegglue.case.schema import Case
from vegglue.engine.interface import Engine, Point, linearise
from vegglue.errors import InputError
from vegglue.inference.posterior_modes import (
    distinct_modes,
    find_modes,
    grids_of,
    points_of_prior,
    standardised_residual,
    starting_points,
)
from vegglue.inference.refine import log_posterior, refine
from vegglue.inference.solve_ensemble import solve_ensemble
from vegglue.inference.statements import posterior_statements
from vegglue.measurements.observations import Observations, read_observations
from vegglue.parallel import at_most
from vegglue.progress import silent
from vegglue.results.posterior import Posterior
from vegglue.results.result_files import read_ensemble


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
    assert posterior_statements(found)[0].from_prior


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


PRIOR = '  {}: {{distribution: loguniform, low: {}, high: 100, unit: "-"}}'
# Not coarsened: with two cells across the floor water does not part around the patches.
MIRRORED = (
    COARSE,
    (
        "    willow: {phi: phi, canopy_height: 0.7}",
        "    left: {phi: left, canopy_height: 1.7}\n    right: {phi: right, canopy_height: 1.7}",
    ),
    (
        "{name: p1, stand: willow, x: [12, 16], y: [0, 1.5]}",
        "{name: p1, stand: left, x: [12, 16], y: [0, 1.5]}\n    - {name: p2, stand: right, x: [12, 16], y: [-1.5, 0]}",
    ),
    (PRIOR.format("phi", 1), PRIOR.format("left", 0.1) + "\n" + PRIOR.format("right", 0.1)),
    ("simulate: {members: 1024, seed: 7}", "simulate: {members: 256, seed: 7}\ninfer: {sigma: known}"),
    ("velocities.csv, experiment: June}", "velocities.csv, experiment: June, standard_error: 0.01}"),
)
ALONG = (4, 8, 10, 12, 14, 16, 18, 20, 23, 26)
TRUTH = {"n_b": np.array([0.04]), "left": np.array([30.0]), "right": np.array([0.5])}


def measured(folder: Path) -> tuple[Case, Observations]:
    """The brook with u on its axis, as the truth has it, and errors of 0.01 m/s."""
    path, file = write_reach(folder, *MIRRORED), folder / "velocities.csv"

    def write(values: np.ndarray) -> tuple[Case, Observations]:
        rows = [f"s{x},{x},0,{value:.6f}" for x, value in zip(ALONG, values, strict=True)]
        file.write_text("\n".join(["section,x,y,u", *rows]) + "\n", encoding="utf-8")
        case = load_case(path)
        return case, read_observations(case)

    case, observations = write(np.full(len(ALONG), 0.5))
    truth = linearise(model_of(case, observations), z_at(case, TRUTH)[0])
    assert truth is not None
    return write(truth.prediction + 0.01 * np.random.default_rng(1).standard_normal(len(ALONG)))


@pytest.fixture(scope="module")
def both_ways(tmp_path_factory: pytest.TempPathFactory) -> tuple[Posterior, Posterior]:
    """The posterior from an ensemble, and the one from points of the prior."""
    folder = tmp_path_factory.mktemp("mirrored")
    case, observations = measured(folder)
    solve_ensemble(case, observations, folder / "ensemble.h5", 1, lambda _: None)
    with at_most(1):
        model = model_of(case, observations)
        return refine(read_ensemble(folder / "ensemble.h5"), model), refine(None, model)


@pytest.mark.slow
@pytest.mark.parametrize("way", [0, 1], ids=["ensemble", "prior"])
def test_both_modes_are_found_and_weigh_the_same(both_ways: tuple[Posterior, Posterior], way: int) -> None:
    found = both_ways[way]
    assert found.refinement is not None
    assert len(found.refinement.modes.mode_chi2) == 2
    denser_left = found.sample.theta["left"] > found.sample.theta["right"]
    # 1,000 effective draws know a half to 0.016: three of these.
    assert found.sample.weights[denser_left].sum() == pytest.approx(0.5, abs=0.05)


def test_an_ensemble_and_points_of_the_prior_lead_to_the_same_posterior(both_ways: tuple[Posterior, Posterior]) -> None:
    # Not the medians: they lie between the modes, where nothing is.
    for name, within in (("left", 0.3), ("right", 0.3), ("n_b", 0.03)):
        ends = [np.log(np.delete(one.marginals.quantiles[name], 2)) for one in both_ways]
        assert ends[1] == pytest.approx(ends[0], abs=within)


def test_cells_that_do_not_part_the_patches_are_left_out(tmp_path: Path) -> None:
    model = model_of(*measured(tmp_path))
    assert [one.site.bed.shape for one in grids_of(model)] == [(24, 12)]
