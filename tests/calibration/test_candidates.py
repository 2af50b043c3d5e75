"""Effects of a case as candidates: however much of them the config says."""

from collections.abc import Mapping

import pytest
from linear_baseline import CASE_OF_TWINS as CASE
from linear_baseline import stations_of

from vegglue.calibration.candidates import (
    Candidate,
    acting_in,
    candidate_in_case,
    candidates_in_case,
    candidates_of,
    patch_candidate,
    with_effect,
)
from vegglue.case.parts import Value
from vegglue.case.schema import Case, EffectEntry, Parameter
from vegglue.diagnosis.child_config import candidate_named
from vegglue.effects.library import library
from vegglue.errors import InputError

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


STATION = stations_of(CASE, ("A",), 3)


@pytest.mark.parametrize(
    "beside",
    [
        Candidate(library()["wind"]),
        acting_in(library()["discharge_error"], "experiment", ("mid",)),
        acting_in(library()["probe_gain"], "section", ("A",)),
        patch_candidate(library()["patch_density"], 1, CASE),
    ],
    ids=lambda one: one.name,
)
def test_an_effect_of_the_case_is_not_missing_whatever_its_key(beside: Candidate) -> None:
    """Keys were compared: `my_wind: {effect: wind, ...}` was in the case, and wind was proposed as missing."""
    listed = with_effect(CASE, beside, {}).effects[beside.key]
    own = listed.model_copy(update={"effect": beside.effect.name})
    case = CASE.model_copy(update={"effects": {"my_own": own}})
    before, after = ({one.name for one in candidates_of(of, STATION)} for of in (CASE, case))
    assert before - after == {beside.name}
    with pytest.raises(InputError, match="is at work in twin already"):
        candidate_named(case, STATION, beside.name)


def test_an_effect_elsewhere_is_still_a_candidate() -> None:
    """What acts in one experiment only may be missing in the others; in all by their names it is everywhere."""
    wind = library()["wind"]
    of_some = EffectEntry(effect="wind", values={wind.amplitude.name: 1.0}, experiments=("low",))
    of_all = of_some.model_copy(update={"experiments": tuple(CASE.experiments)})
    for entry, proposed in ((of_some, True), (of_all, False)):
        case = CASE.model_copy(update={"effects": {"own": entry}})
        assert ("wind" in [one.name for one in candidates_of(case, STATION)]) == proposed
