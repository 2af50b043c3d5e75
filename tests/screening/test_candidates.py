"""Effects of a case as candidates: however much of them the config says."""

from collections.abc import Mapping

import pytest
from linear_baseline import CASE_OF_TWINS as CASE

from vegglue.case.parts import Value
from vegglue.case.schema import Case, EffectEntry, Parameter
from vegglue.effects.library import library
from vegglue.screening.candidates import Candidate, candidate_in_case, candidates_in_case, with_effect

SOMEWHERE = Parameter(distribution="uniform", low=5.0, high=20.0, unit="m")


def case_with(effect: str, values: Mapping[str, Value]) -> Case:
    """The twin with an effect that has a name of its own, and a calibrated place."""
    entry = EffectEntry(effect=effect, values=dict(values))
    parameters = {**CASE.parameters, "somewhere": SOMEWHERE}
    return CASE.model_copy(update={"effects": {"own": entry}, "parameters": parameters})


@pytest.mark.parametrize(
    ("effect", "values", "name"),
    [
        ("patch_density", {"excess": 0.1}, "patch_density[p1]"),
        ("patch_density", {"excess": 0.1, "patch": 2.0}, "patch_density[p2]"),
        ("patch_density", {"excess": 0.1, "patch": 9.0}, "patch_density"),
        ("unlisted_bed", {"rise": 0.1}, "unlisted_bed[x0,y0]"),
        ("unlisted_bed", {"rise": 0.1, "x": "somewhere", "y": 0.5}, "unlisted_bed[x12.5,y0.5]"),
    ],
)
def test_shapes_that_are_left_alone_or_calibrated_stop_no_search(
    effect: str, values: dict[str, Value], name: str
) -> None:
    """What was accepted beside them was looked for, and the search ended in a KeyError or a ValueError."""
    case = case_with(effect, values)
    assert [one.name for one in candidates_in_case(case).values()] == [name]
    beside = Candidate(library()["bank_trend"])
    assert candidate_in_case(with_effect(case, beside, {}), "bank_trend") == beside
