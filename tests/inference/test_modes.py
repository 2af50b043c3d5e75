"""Two patches side by side and stations between them: nothing tells which of both is the denser one, so that the
posterior has two modes, mirror images of each other.
"""

from pathlib import Path

import numpy as np
import pytest
from reach import COARSE, write_reach

from vegglue.case.config import load_case
from vegglue.case.parameter_space import z_at
from vegglue.case.schema import Case
from vegglue.engine.interface import linearise
from vegglue.engine.model import model_of
from vegglue.inference.posterior_modes import grids_of
from vegglue.inference.refine import refine
from vegglue.inference.solve_ensemble import solve_ensemble
from vegglue.measurements.observations import Observations, read_observations
from vegglue.parallel import at_most
from vegglue.results.posterior import Posterior
from vegglue.results.result_files import read_ensemble

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
