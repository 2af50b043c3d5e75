"""`numerics.shear_depth: smallest`, shear as codes of flat cells have it: what it is, and that nothing forgets it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from channels import changed, even_geometry, make_problem, mixed, river, trapezoid

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.resolved_config import simulation_hash
from vegglue.effects.active_effect import ActiveEffect
from vegglue.effects.library import library
from vegglue.effects.surroundings import weighted_across
from vegglue.flow.closures import closures
from vegglue.flow.equations import faces, residual
from vegglue.flow.jacobian import factors
from vegglue.flow.newton import FROM_AFAR, newton
from vegglue.flow.problem import ALONG, LEVEL, Problem
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.tangent import tangents

FROM_THE_ROOT = replace(FROM_AFAR, time_step=1e4)  # s, as a start at the root of a flow hardly changed allows

CONFIG = Path(__file__).parents[2] / "configs" / "twin.yaml"
FILM = 1e-6


@pytest.mark.parametrize("smallest", [False, True])
def test_shear_acts_over_the_depth_of_its_point_or_the_smallest_around_it(smallest: bool) -> None:
    """Beds between 0.2 m and 1.8 m under a level of 1 m."""
    bed = 1.0 + 0.8 * np.random.default_rng(1).uniform(-1.0, 1.0, (5, 6))
    problem = make_problem(bed, (1.0, 1.0), 0.0, 1.0, film=FILM, smallest_shear_depth=smallest)
    state = np.zeros((5, 3, 6, 1))
    state[:, LEVEL] = 1.0
    around = np.array([bed[:-1, :-1], bed[1:, :-1], bed[:-1, 1:], bed[1:, 1:]])
    told = np.maximum(1.0 - (around.max(axis=0) if smallest else around.mean(axis=0)), 0.0)
    assert faces(problem, state).corner[1:-1, 1:-1, 0] == pytest.approx(told, abs=FILM)


def test_a_gradient_by_weights() -> None:
    """2 below and 4 above: 3 where both weigh alike, that of the other side where one weighs nothing to speak of."""
    values = np.array([1.25, 2.25, 4.25])[None, :, None]
    for weights, told in (((1.0, 1.0), 3.0), ((3.0, 1.0), 2.5), ((1.0, 1e-12), 2.0)):
        found = weighted_across(values, np.array(weights)[None, :, None], 0.5)[0, 1, 0]
        assert found == pytest.approx(told)


def channel(smallest: bool, length: float) -> Problem:
    """30 m of the paper's channel with a mixing length."""
    problem = river(smallest_shear_depth=smallest)
    cell = (problem.dx, problem.dy)
    _, banks = trapezoid(30.0, 4.5, problem.shape)
    mixing = ActiveEffect(library()["mixing_length"], {"length": np.array([length])})
    return replace(problem, effects=(mixing,), geometry=even_geometry(problem.bed, banks, cell))


def test_land_raises_no_viscosity() -> None:
    """Water that moves at 1 m/s throughout, beside land at rest: no shear in it, so nothing beyond 0.01 m2/s."""
    found = {}
    for smallest in (False, True):
        problem = channel(smallest, 0.5)
        state = np.zeros((*problem.bed.shape[:1], 3, problem.bed.shape[1], 1))
        state[:, LEVEL] = 1.0
        wet = problem.bed < 1.0
        state[:, ALONG, :, 0] = wet
        depth = faces(problem, state).cell
        edge = wet & ~np.roll(wet, 1, axis=1)
        found[smallest] = float(closures(problem, state, depth).viscosity[..., 0][edge].mean())
    assert found[False] > 0.1
    assert found[True] < 0.02


@pytest.mark.slow
def test_tangent_equals_difference_of_solved_states() -> None:
    """Of the discharge, with a mixing length, relative to the largest answer in the water."""

    def with_discharge(factor: float) -> Problem:
        problem = channel(True, 0.3)
        inflows = tuple(replace(one, discharge=one.discharge * factor) for one in problem.boundaries.inflows)
        return changed(problem, inflows=inflows)

    step = 1e-4
    bare = replace(channel(True, 0.3), effects=())
    problem, state = mixed(bare, 0.3, 1e-10)
    assert np.abs(state - mixed(replace(bare, smallest_shear_depth=False), 0.3, 1e-10)[1]).max() > 1e-3
    more, less = with_discharge(1.0 + step), with_discharge(1.0 - step)
    cause = (residual(more, state) - residual(less, state)) / (2.0 * step)
    tangent = tangents(problem, state, factors(problem, state), cause)[:, ALONG, :, 0]
    found = newton(more, state, 1e-11, FROM_THE_ROOT).state - newton(less, state, 1e-11, FROM_THE_ROOT).state
    deep = (state[:, LEVEL, :, 0] - problem.bed) > 0.3
    found = (found / (2.0 * step))[:, ALONG, :, 0]
    assert np.abs(tangent - found)[deep].max() < 1e-4 * np.abs(found[deep]).max()


def test_a_config_asks_for_it(tmp_path: Path) -> None:
    """It reaches the problem and the hash; where it is not asked for, hashes are those of before there was the key."""
    path = tmp_path / "smallest.yaml"
    path.write_text(f"extends: {CONFIG}\nnumerics: {{shear_depth: smallest}}\n", encoding="utf-8")
    asked, plain = load_case(path), load_case(CONFIG)
    theta = {name: np.array([prior.low]) for name, prior in plain.parameters.items()}
    for case, told in ((asked, True), (plain, False)):
        problem = build_problem(case, build_site(case), next(iter(case.experiments)), theta)
        assert problem.smallest_shear_depth is told
    assert simulation_hash(asked) != simulation_hash(plain)
    assert "shear_depth" not in plain.numerics.model_dump(exclude_none=True)
