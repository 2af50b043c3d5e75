"""Rivals of an earlier step, compared again with what came later."""

from dataclasses import replace

import pytest
from coarse_twin import coarse_twin
from diagnoses import a_suspect

from vegglue.calibration.baseline import baseline
from vegglue.diagnosis.child_config import candidate_named, with_additions
from vegglue.diagnosis.rivals_again import with_rivals_again
from vegglue.progress import silent
from vegglue.results.diagnosis import Step

pytestmark = pytest.mark.slow


def a_step(*rivals: str) -> Step:
    groups = tuple((name,) for name in rivals)
    return Step(rivals[0], rivals, tuple(1.0 / len(rivals) for _ in rivals), groups, 200.0, 100.0, 1e-4)


def test_what_a_later_step_accepted_is_no_rival_any_more() -> None:
    model, _ = coarse_twin()
    names = ("viscosity", "floor_level_error")
    case = with_additions(model.case, [(candidate_named(model.case, model.station, name), {}) for name in names])
    base = baseline(replace(model, case=case))
    steps = (a_step("viscosity", "elder", "floor_level_error"), a_step("floor_level_error"))
    suspects = {name: a_suspect(name) for name in ("viscosity", "elder", "floor_level_error")}
    _, (first, second) = with_rivals_again(base, steps, suspects, silent)
    assert "floor_level_error" not in first.rivals
    assert first.chances != steps[0].chances, "the others are compared again"
    assert second == steps[1], "without rivals there is nothing to compare"
