"""Fingerprints of laws from answers to cells: those of the effects, also at a point with borrowed factors."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vegglue.calibration.candidates import Candidate, cause_of
from vegglue.calibration.laws_in_case import law_traces
from vegglue.calibration.model_error import model_error_columns
from vegglue.case.config import load_case
from vegglue.case.schema import ModelError
from vegglue.effects.grammar import LAWS
from vegglue.engine.interface import Model, Point, by_itself, linearise, responses
from vegglue.engine.model import coarser
from vegglue.workflow.case_run import CaseRun

CONFIG = Path(__file__).parents[2] / "configs" / "twin.yaml"
NAMES = (
    "law_floor_speed_power", "law_bank_shear_step", "law_bank_depth_hump", "law_plants_along_stretch",
    "law_viscosity_offset_ramp", "law_viscosity_front_fading", "law_advection_speed_step", "law_advection_along_trend",
    "law_advection_edge_fading",
)  # fmt: skip


@pytest.fixture(scope="module")
def model() -> Model:
    coarse = coarser(CaseRun(load_case(CONFIG)).model)
    assert coarse is not None
    return coarse


@pytest.fixture(scope="module")
def borrowed(model: Model) -> Point:
    """A point that leans on the factors of one nearby."""
    near = linearise(model, np.zeros(len(model.names)))
    assert near is not None
    point = linearise(model, np.full(len(model.names), 0.02), near)
    assert point is not None
    assert any(flow.moved > 0.0 for flow in point.flows.values())
    return point


@pytest.mark.parametrize("name", NAMES)
def test_a_trace_is_the_response_to_the_effect(model: Model, borrowed: Point, name: str) -> None:
    law = LAWS[name]
    settings = {shape.name: shape.default for shape in law.effect.shapes}
    exact = responses(model, borrowed, [cause_of(model.case, Candidate(law.effect), settings)])
    trace = law_traces(model, borrowed).of(law, [settings])
    assert trace == pytest.approx(exact, abs=0.02 * np.abs(exact).max())


def test_an_experiment_without_measurements_is_no_obstacle(model: Model) -> None:
    """It was a traceback, after a minute."""
    seen = model.station[model.station["experiment"] != "mid"].reset_index(drop=True)
    part = replace(model, station=seen)
    point = linearise(part, np.zeros(len(part.names)))
    assert point is not None
    assert np.isfinite(law_traces(part, point).of(LAWS[NAMES[0]], [{"reference": 0.5}])).all()
    allowed = ModelError(friction=0.05, edges=0.1)
    assert len(model_error_columns(part, point, allowed)) == len(seen)


def test_a_point_by_itself_borrows_nothing(model: Model, borrowed: Point) -> None:
    alone = by_itself(model, borrowed)
    assert all(flow.moved == 0.0 for flow in alone.flows.values())
    assert by_itself(model, alone).flows["mid"].factors is alone.flows["mid"].factors
    assert np.array_equal(alone.prediction, borrowed.prediction)
