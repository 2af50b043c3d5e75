"""Cases with rough walls and in a bend: where walls stand, that members, tangents and both engines know either."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from channels import stations_at
from marching_engine import marching

from vegglue.calibration.model_error import cell_responses
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import theta_at
from vegglue.case.resolved_config import dumped
from vegglue.case.schema import Case
from vegglue.case.site_schema import GridExtent
from vegglue.engine.interface import Model, linearise, predict, relinearised
from vegglue.engine.newton import NEWTON
from vegglue.flow.problem_setup import build_problem

N_B = {"n_b": {"distribution": "loguniform", "low": 0.01, "high": 0.03, "unit": "s m^(-1/3)"}}
N_W = {"n_w": {"distribution": "loguniform", "low": 0.005, "high": 0.03, "unit": "s m^(-1/3)"}}
BED = {"classes": {"bed": {"law": "manning", "n": "n_b"}}, "default": "bed"}
TREE = {
    "source": Path("flume"),
    "name": "flume",
    "grid": {"x": (0.0, 6.0), "y": (0.0, 0.9), "cell": (0.25, 0.075)},
    "bed": [{"trapezoid": {"axis": 0.45, "bottom_width": 2.0, "bank_slope": 1.0, "bed_slope": 0.002, "level": 0.0}}],
    "friction": BED,
    "inflows": {"main": {"side": "west"}, "side": {"side": "south", "range": (2.0, 2.5), "spread": "uniform"}},
    "experiments": {"one": {"discharge": {"main": 0.04, "side": 0.004}, "level": 0.1}},
    "eddy_viscosity": 0.002,
    "numerics": {"film_depth": 0.002},
    "parameters": N_B,
}
ROUGH = TREE | {"friction": BED | {"walls": {"law": "manning", "n": "n_w"}}, "parameters": N_B | N_W}
ROUND = {"parts": [{"length": 2.0}, {"radius": 2.0, "angle": 90.0}]}
LINE = {"parts": [{"length": 1.5}, {"radius": 2.0, "angle": 90.0}, {"length": 1.5}]}
# With helical flow, plants and water from the side.
BENT = TREE | {
    "name": "bend",
    "grid": {"x": (0.0, 6.0), "y": (-0.45, 0.45), "cell": (0.25, 0.075), "centreline": LINE},
    "bed": [{"trapezoid": {"axis": 0.0, "bottom_width": 2.0, "bank_slope": 1.0, "bed_slope": 0.002, "level": 0.0}}],
    "plants": {
        "stands": {"reed": {"phi": 0.3, "canopy_height": 0.08}},
        "patches": [{"name": "p", "stand": "reed", "x": (2.5, 3.5), "y": (0.1, 0.3)}],
    },
    "effects": {"helical_flow": {"values": {"share": "s"}}},
    "parameters": N_B | {"s": {"distribution": "uniform", "low": 0.2, "high": 1.2, "unit": "-"}},
}
Z = np.array([0.1, 0.2])


def flume(rough: bool = True) -> Case:
    return Case.model_validate(ROUGH if rough else TREE)


def stations(x: tuple[float, ...] = (1.3, 3.0, 4.9), y: tuple[float, ...] = (0.05, 0.3, 0.8)) -> pd.DataFrame:
    return stations_at(["one"], dict.fromkeys(("velocity", "velocity_across", "level"), (x, y)))


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(flume(), build_site(flume()), stations(), NEWTON)


@pytest.fixture(scope="module")
def bend() -> Model:
    case = Case.model_validate(BENT)
    return Model(case, build_site(case), stations((1.7, 3.1, 4.6), (-0.35, 0.0, 0.35)), NEWTON)


@pytest.fixture(params=["model", "bend"])
def either(request: pytest.FixtureRequest) -> Model:
    found: Model = request.getfixturevalue(request.param)
    return found


def test_slopes_are_those_of_members_solved_by_chord_steps(either: Model) -> None:
    point = linearise(either, Z)
    assert point is not None
    step = 0.05 * np.eye(2)
    found = predict(either, [point], np.concatenate([Z + step, Z - step]))
    slope = (found[:2] - found[2:]).T / 0.1
    for parameter in range(2):
        largest = np.abs(slope[:, parameter]).max()
        assert largest > 1e-3
        assert point.slope[:, parameter] == pytest.approx(slope[:, parameter], abs=0.01 * largest)


@pytest.mark.slow
def test_both_engines_agree(either: Model) -> None:
    exact, marched = linearise(either, Z), linearise(replace(either, engine=marching()), Z)
    assert exact is not None
    assert marched is not None
    assert marched.prediction == pytest.approx(exact.prediction, abs=1e-5)
    assert marched.slope == pytest.approx(exact.slope, abs=5e-3 * np.abs(exact.slope).max())


def test_water_stands_higher_outside(bend: Model) -> None:
    """Of the order of B u^2 / (g R): 0.7 m times 0.45^2 m2/s2 over 9.81 m/s2 times 2 m, some 7 mm, in a short bend."""
    point = linearise(bend, Z)
    assert point is not None
    south, _, north = point.prediction.reshape(3, 3, 3)[2, 1]
    assert 0.003 < south - north < 0.012


def test_walls_stand_where_no_water_enters() -> None:
    case = flume()
    walls = build_problem(case, build_site(case), "one", {"n_b": np.full(2, 0.02), "n_w": np.array([0.01, 0.02])}).walls
    assert np.flatnonzero(walls.south == 0.0).tolist() == [8, 9]
    assert walls.north.all()
    assert walls.rate == pytest.approx(9.81 * np.array([0.01, 0.02]) ** 2 / 0.075 ** (1.0 / 3.0) / 0.075)


@pytest.mark.parametrize(("height", "rough", "there"), [(0.1, True, True), (0.05, True, False), (0.1, False, False)])
def test_between_walls_a_bed_steeper_than_one_to_one_is_a_step(height: float, rough: bool, there: bool) -> None:
    """Cells are 0.075 m wide."""
    tree = ROUGH if rough else TREE
    case = Case.model_validate(tree)
    site = build_site(case)
    bed = site.bed.copy()
    bed[:, :4] += height
    problem = build_problem(case, replace(site, bed=bed), "one", {"n_b": np.full(1, 0.02), "n_w": np.full(1, 0.01)})
    steps = np.zeros((24, 11))
    steps[:, 3] = -1.0
    assert np.array_equal(problem.walls.steps, steps) == there
    assert problem.walls.steps.any() == problem.smallest_shear_depth == there


def test_walls_of_a_bend_are_longer_outside() -> None:
    """Radius 2 m to the left: the wall at y = 0 is as long as the line, the cell beside it (2 - 0.0375) / 2 of that."""
    bent = flume().model_copy(update={"grid": GridExtent.model_validate(TREE["grid"] | {"centreline": ROUND})})
    walls = build_problem(bent, build_site(bent), "one", {"n_b": np.full(1, 0.02), "n_w": np.full(1, 0.02)}).walls
    assert walls.south[12] == pytest.approx(2.0 / 1.9625)
    assert walls.north[12] == pytest.approx(1.1 / 1.1375)
    assert walls.south[9] == 0.0
    assert walls.south[0] == 1.0


def test_a_case_that_names_no_walls_has_none_and_is_written_as_before() -> None:
    case = flume(rough=False)
    assert build_problem(case, build_site(case), "one", {"n_b": np.full(2, 0.02)}).walls.rate.size == 0
    assert "walls" not in dumped(case)["friction"]


def test_walls_hold_the_water_beside_them_and_raise_it(model: Model) -> None:
    rough = linearise(model, Z)
    smooth = linearise(replace(model, case=flume(rough=False)), Z[:1])
    assert rough is not None
    assert smooth is not None
    change = (rough.prediction - smooth.prediction).reshape(3, 3, 3)
    assert (change[0, 1:, [0, 2]] < -0.005).all()
    assert (change[0, 1:, 1] > 5e-4).all()
    assert (change[2, 0] > 1e-4).all()


def test_members_far_away_are_those_newton_finds(model: Model) -> None:
    point = linearise(model, Z)
    assert point is not None
    there = [np.array([-1.0, 1.5]), np.array([0.5, -1.5])]
    found = predict(model, [point], np.array(there))
    for z, prediction in zip(there, found, strict=True):
        alone = linearise(model, z)
        assert alone is not None
        assert prediction == pytest.approx(alone.prediction, abs=1e-5)


def test_answers_to_cells_of_a_flume_add_up_to_the_slope() -> None:
    """Where the rows beside the sides are wet an inflow shared out by depth couples them all: 3 % were lost."""
    case = Case.model_validate(
        TREE
        | {"inflows": {"main": {"side": "west"}}, "experiments": {"one": {"discharge": {"main": 0.04}, "level": 0.1}}}
    )
    seen = stations()
    seen = seen[(seen["kind"] == "velocity") & (seen["x"] > 2.0)].reset_index(drop=True)
    model = Model(case, build_site(case), seen, NEWTON)
    point = linearise(model, np.zeros(1))
    assert point is not None
    beside = np.log([theta_at(case, np.array([[z]]))["n_b"][0] for z in (-1e-4, 1e-4)])
    of_log_n = point.slope[:, 0] * 2e-4 / (beside[1] - beside[0])
    answers = cell_responses(model, relinearised(model, point), ("friction",)).of["friction"]
    # k goes with the square of n.
    np.testing.assert_allclose(2.0 * answers.sum(axis=(1, 2)), of_log_n, atol=0.005 * np.abs(of_log_n).max())
