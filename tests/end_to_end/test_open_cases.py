"""The loop on data that another code made.

As a user has it: `vegglue import`, and nothing edited by hand. That code has Baptist's law, the floor of 1.3 in the
bank law and the rule for emergent plants in common with vegglue, and kappa was chosen on open-a: not tested here.
"""

from pathlib import Path

import pytest
from open_cases import imported

from vegglue.case.schema import Case
from vegglue.diagnosis.comparison import held_out_rmse
from vegglue.results.diagnosis import Diagnosis
from vegglue.workflow.diagnose import diagnose
from vegglue.workflow.extend import StepwiseExtension, extend_stepwise

EDDIES = {"viscosity", "elder", "smagorinsky", "mixing_length", "coherent_structures", "edge_mixing"}
# Largest error of velocities that no calibration has seen, once the effect is added [m/s].
WANTED = 0.010
pytestmark = pytest.mark.slow


def looked_into(case: Case, folder: Path) -> Diagnosis:
    return diagnose(case, runs=folder / "runs", say=print)


def extended(case: Case, folder: Path) -> StepwiseExtension:
    return extend_stepwise(case, runs=folder / "runs", say=print)


def test_where_nothing_is_hidden_nothing_is_found(tmp_path: Path) -> None:
    found = looked_into(imported("open-a", tmp_path), tmp_path)
    assert found.verdict.kind == "nothing-missing", found.verdict.sentence


@pytest.mark.parametrize(
    ("name", "hidden", "true"),
    [
        ("open-b", "secondary_current", 0.010),
        ("open-c", "streamlining", -0.9),
        ("open-d", "discharge_error[high]", 0.09),
        ("open-e", "mixing_length", 0.5),
    ],
)
def test_what_is_hidden_is_found_and_added(name: str, hidden: str, true: float, tmp_path: Path) -> None:
    case = imported(name, tmp_path)
    found = looked_into(case, tmp_path)
    assert found.verdict.kind in ("identified", "one-of"), found.verdict.sentence
    assert len(found.steps) == 1, found.verdict.sentence
    assert hidden in found.set, found.verdict.sentence
    assert len(found.set) == 1 or set(found.set) <= EDDIES, found.verdict.sentence
    low, high = found.suspect(hidden).amplitude.interval95
    assert low <= true <= high
    before, after = extended(case, tmp_path).comparison.rungs
    assert after.validation < min(before.validation, WANTED)


def test_something_unlisted_is_none_of_these_and_has_a_place(tmp_path: Path) -> None:
    found = looked_into(imported("open-f", tmp_path), tmp_path)
    location = found.verdict.location
    assert found.verdict.kind == "none-of-these", found.verdict.sentence
    assert location is not None
    assert ((location.x - 33.0) ** 2 + (location.y + 0.6) ** 2) ** 0.5 < 1.5


@pytest.mark.parametrize(("name", "term", "x", "y"), [("open-i", "bed", 47.0, -0.5), ("open-f", "drag", 33.0, -0.6)])
def test_a_place_is_of_the_right_term(name: str, term: str, x: float, y: float, tmp_path: Path) -> None:
    found = looked_into(imported(name, tmp_path), tmp_path)
    (place,) = found.places
    assert found.verdict.kind == "none-of-these", found.verdict.sentence
    assert ((place.x - x) ** 2 + (place.y - y) ** 2) ** 0.5 < 1.5
    assert place.term == term
    assert all(odds > 10.0 for name, odds in place.odds.items() if name in ("drag", "bed", "inflow", "viscosity"))


@pytest.mark.parametrize(("name", "kind", "offset"), [("open-j", "probe", 0.05), ("open-k", "gauge", -0.015)])
def test_an_instrument_that_is_off_is_set_aside_alone(name: str, kind: str, offset: float, tmp_path: Path) -> None:
    found = looked_into(imported(name, tmp_path), tmp_path)
    (faulty,) = found.instruments
    assert found.verdict.kind == "instrument", found.verdict.sentence
    assert (faulty.kind, found.steps, found.places) == (kind, (), ())
    assert faulty.interval95[0] <= offset <= faulty.interval95[1]


@pytest.mark.parametrize(("name", "added"), [("open-l", 2), ("open-i", 1)])
def test_two_effects_and_a_place_are_added(name: str, added: int, tmp_path: Path) -> None:
    grown = extended(imported(name, tmp_path), tmp_path)
    before, after = grown.comparison.rungs[0], grown.comparison.rungs[-1]
    assert len(after.effects) == added, grown.reason
    assert held_out_rmse(after) < held_out_rmse(before)
    assert held_out_rmse(after, "experiments") < held_out_rmse(before, "experiments")
    assert after.validation < min(before.validation, WANTED)
