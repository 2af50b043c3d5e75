"""A case in a bend: slopes, chord steps and both engines, with helical flow and water from the side."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case
from vegglue.engine.interface import Model, linearise, predict
from vegglue.engine.marching import marching
from vegglue.engine.newton import NEWTON

LINE = {"parts": [{"length": 1.5}, {"radius": 2.0, "angle": 90.0}, {"length": 1.5}]}
TREE = {
    "source": Path("bend"),
    "name": "bend",
    "grid": {"x": (0.0, 6.0), "y": (-0.45, 0.45), "cell": (0.25, 0.075), "centreline": LINE},
    "bed": [{"trapezoid": {"axis": 0.0, "bottom_width": 2.0, "bank_slope": 1.0, "bed_slope": 0.002, "level": 0.0}}],
    "friction": {"classes": {"bed": {"law": "manning", "n": "n_b"}}, "default": "bed"},
    "plants": {
        "stands": {"reed": {"phi": 0.3, "canopy_height": 0.08}},
        "patches": [{"name": "p", "stand": "reed", "x": (2.5, 3.5), "y": (0.1, 0.3)}],
    },
    "inflows": {
        "main": {"side": "west"},
        "side": {"side": "south", "range": (2.0, 2.5), "spread": "uniform"},
    },
    "experiments": {"one": {"discharge": {"main": 0.04, "side": 0.004}, "level": 0.1}},
    "eddy_viscosity": 0.002,
    "numerics": {"film_depth": 0.002},
    "effects": {"helical_flow": {"values": {"share": "s"}}},
    "parameters": {
        "n_b": {"distribution": "loguniform", "low": 0.01, "high": 0.03, "unit": "s m^(-1/3)"},
        "s": {"distribution": "uniform", "low": 0.2, "high": 1.2, "unit": "-"},
    },
}
Z = np.array([0.1, 0.2])


@pytest.fixture(scope="module")
def model() -> Model:
    case = Case.model_validate(TREE)
    rows = [
        {"experiment": "one", "kind": kind, "section": f"{x:g}", "x": x, "y": y}
        for kind in ("velocity", "velocity_across", "level")
        for x in (1.7, 3.1, 4.6)
        for y in (-0.35, 0.0, 0.35)
    ]
    given = {"value": 0.0, "standard_error": 0.01, "used": True, "reason": "", "depth": np.nan, "device": ""}
    return Model(case, build_site(case), pd.DataFrame(rows).assign(**given), NEWTON)


def test_water_stands_higher_outside(model: Model) -> None:
    """Of the order of B u^2 / (g R): 0.7 m times 0.45^2 m2/s2 over 9.81 m/s2 times 2 m, some 7 mm, in a short bend."""
    point = linearise(model, Z)
    assert point is not None
    south, _, north = point.prediction.reshape(3, 3, 3)[2, 1]
    assert 0.003 < south - north < 0.012


def test_slopes_are_those_of_members_solved_by_chord_steps(model: Model) -> None:
    point = linearise(model, Z)
    assert point is not None
    step = 0.05 * np.eye(2)
    found = predict(model, [point], np.concatenate([Z + step, Z - step]))
    slope = (found[:2] - found[2:]).T / 0.1
    assert np.abs(slope[:, 1]).max() > 1e-3
    for parameter in range(2):
        largest = np.abs(slope[:, parameter]).max()
        assert point.slope[:, parameter] == pytest.approx(slope[:, parameter], abs=0.01 * largest)


@pytest.mark.slow
def test_both_engines_go_round_the_bend(model: Model) -> None:
    exact, marched = linearise(model, Z), linearise(replace(model, engine=marching()), Z)
    assert exact is not None
    assert marched is not None
    assert marched.prediction == pytest.approx(exact.prediction, abs=1e-5)
    assert marched.slope == pytest.approx(exact.slope, abs=5e-3 * np.abs(exact.slope).max())
