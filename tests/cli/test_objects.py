"""What `run --json` tells of each model that it came by."""

from pathlib import Path

from diagnoses import NOTHING, a_diagnosis
from linear_baseline import CASE_OF_TWINS

from vegglue.cli.objects import run_object
from vegglue.results.loop_results import Question, RivalEffects


def test_a_child_does_not_take_the_place_of_its_parent() -> None:
    """The verdict on the case that was given was replaced by that on its last child, which lacks nothing."""
    child = CASE_OF_TWINS.model_copy(update={"name": "twin-eddies"})
    asked = [Question(RivalEffects(("eddies", "wind")), ())]
    found = run_object(
        Path("runs"),
        [
            (CASE_OF_TWINS, a_diagnosis(verdict={"kind": "identified"})),
            (child, NOTHING),
            (CASE_OF_TWINS, asked),
            (child, []),
            (child, "runs/twin-eddies/posterior.h5 is up to date."),
        ],
    )
    assert found["diagnosis"]["verdict"] == "identified"
    assert [one["tells_apart"] for one in found["questions"]] == ["eddies from wind"]
    of_child = found["cases"]["twin-eddies"]
    assert of_child["diagnosis"]["verdict"] == "nothing-missing"
    assert of_child["questions"] == []
    assert of_child["notes"] == ["runs/twin-eddies/posterior.h5 is up to date."]
