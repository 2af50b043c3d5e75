"""A flow begins where its own cells put it, moved as the flow on cells of twice the size moved."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from marching_engine import marching

from vegglue.arrays import Array
from vegglue.calibration.candidates import Candidate, with_effect
from vegglue.case.config import load_case
from vegglue.effects.library import library
from vegglue.engine.interface import Model, Point, linearise, linearise_as_coarse
from vegglue.engine.model import coarser
from vegglue.flow.starts import on_grid
from vegglue.flow.wet_band import widen
from vegglue.workflow.case_run import CaseRun

CONFIG = Path(__file__).parents[2] / "configs" / "twin.yaml"


def known(point: Point | None) -> Point:
    assert point is not None
    return point


def state(point: Point, experiment: str) -> Array:
    flow = point.flows[experiment]
    return widen(flow.state, flow.rows, flow.band)


def with_effects(model: Model, *names: str) -> Model:
    case = model.case
    for name in names:
        case = with_effect(case, Candidate(library()[name]), {})
    return replace(model, case=case)


@pytest.fixture(scope="module")
def models() -> tuple[Model, Model]:
    """Of cells of twice the size and of four times."""
    fine = coarser(CaseRun(load_case(CONFIG)).model)
    assert fine is not None
    coarse = coarser(fine)
    assert coarse is not None
    return fine, coarse


@pytest.fixture(scope="module")
def ends(models: tuple[Model, Model]) -> dict[str, Point]:
    fine, coarse = models
    before = np.zeros(len(fine.names))
    after = np.where(np.arange(before.size) % 2, -0.25, 0.5)
    return {
        "fine before": known(linearise(fine, before)),
        "coarse before": known(linearise(coarse, before)),
        "coarse after": known(linearise(coarse, after)),
        "fine after": known(linearise(fine, after)),
    }


def test_it_begins_nearer_than_the_flow_of_coarse_cells(models: tuple[Model, Model], ends: dict[str, Point]) -> None:
    correct = models[0].engine.with_coarse_correction
    start = correct(ends["fine before"], ends["coarse before"], ends["coarse after"])
    for experiment in models[0].case.experiments:
        there = state(ends["fine after"], experiment)
        lifted = on_grid(state(ends["coarse after"], experiment), (there.shape[0], there.shape[2]))
        own, of_coarse = np.abs(state(start, experiment) - there), np.abs(lifted - there)
        assert np.sqrt(np.mean(own**2)) < 0.5 * np.sqrt(np.mean(of_coarse**2))


def test_it_ends_at_the_same_flow(models: tuple[Model, Model], ends: dict[str, Point]) -> None:
    found = known(linearise_as_coarse(models[0], ends["fine before"], ends["coarse before"], ends["coarse after"]))
    assert np.array_equal(found.z, ends["fine after"].z)
    assert found.prediction == pytest.approx(ends["fine after"].prediction, abs=1e-5)
    scale = np.abs(ends["fine after"].slope).max()
    assert found.slope == pytest.approx(ends["fine after"].slope, abs=0.02 * scale)


def test_an_effect_may_have_been_added_in_between(models: tuple[Model, Model], ends: dict[str, Point]) -> None:
    fine, coarse = (with_effects(one, "edge_mixing") for one in models)
    z = np.append(ends["coarse before"].z, 0.5)
    after = known(linearise(coarse, z, ends["coarse before"]))
    found = known(linearise_as_coarse(fine, ends["fine before"], ends["coarse before"], after))
    assert found.prediction == pytest.approx(known(linearise(fine, z)).prediction, abs=1e-5)


def test_an_effect_may_have_been_taken_away_in_between(models: tuple[Model, Model], ends: dict[str, Point]) -> None:
    """The slope of one that stands before another must not be mistaken for that one's."""
    both, last = (
        [with_effects(one, *names) for one in models] for names in (("edge_mixing", "wake_mixing"), ("wake_mixing",))
    )
    z = np.concatenate([ends["coarse before"].z, [0.5, 0.5]])
    before, on_coarse = (known(linearise(one, z)) for one in both)
    after = known(linearise(last[1], np.delete(z, -2), on_coarse))
    start = both[0].engine.with_coarse_correction(before, on_coarse, after)
    for experiment in both[0].case.experiments:
        there = state(known(linearise(last[0], after.z)), experiment)
        lifted = on_grid(state(after, experiment), (there.shape[0], there.shape[2]))
        own, of_coarse = np.abs(state(start, experiment) - there), np.abs(lifted - there)
        assert np.sqrt(np.mean(own**2)) < 0.5 * np.sqrt(np.mean(of_coarse**2))


def test_an_experiment_that_coarse_cells_do_not_know_stays(ends: dict[str, Point], models: tuple[Model, Model]) -> None:
    first, *others = models[0].case.experiments
    before = replace(ends["coarse before"], flows={name: ends["coarse before"].flows[name] for name in others})
    start = models[0].engine.with_coarse_correction(ends["fine before"], before, ends["coarse after"])
    assert np.array_equal(state(start, first), state(ends["fine before"], first))


def test_an_engine_without_use_for_it_begins_at_its_own_point(ends: dict[str, Point]) -> None:
    point = ends["fine before"]
    assert marching().with_coarse_correction(point, ends["coarse before"], ends["coarse after"]) is point
