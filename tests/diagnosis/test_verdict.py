"""From what was found to a verdict in words: when it names, when it only remarks, and when it cannot tell."""

import numpy as np
import pandas as pd
import pytest
from diagnoses import a_suspect

from vegglue.diagnosis.conclusion import chance_of_misfit
from vegglue.diagnosis.verdict import judged
from vegglue.results.diagnosis import Location, EstimatedErrors, Misfit, Step, Suspect

AS_STATED = EstimatedErrors(correlation=0.0, scale=1.0, grid_error=0.0, flagged=())
FITS, MISSES = (Misfit(chi2, chi2, 5, chance_of_misfit(chi2, 5), pd.DataFrame()) for chi2 in (5.0, 80.0))
NONE = a_suspect("wind", test={"score": 0.4})


def step(*rivals: str) -> Step:
    chances = tuple(0.96 / len(rivals) for _ in rivals)
    return Step(rivals[0], rivals, chances, tuple((name,) for name in rivals), 200.0, 5.0, 1e-4)


Groups = tuple[tuple[str, ...], ...]


def said(
    steps: list[Step],
    suspects: list[Suspect],
    location: Location | None,
    misfit: Misfit,
    still: Groups = (),
    alone: str = "",
    errors: EstimatedErrors = AS_STATED,
) -> tuple[str, str, str]:
    found = judged(errors, misfit, steps, suspects, location, still, alone)
    assert (found.location, found.not_excluded) == (location, still)
    return found.kind, found.sentence, " ".join(found.remarks)


def test_nothing_is_missing_only_where_it_would_be_seen() -> None:
    assert said([], [NONE], None, FITS)[0] == "nothing-missing"
    blind = [a_suspect("wind", detectability={"testable": False})] * 9
    assert said([], [NONE, *blind], None, FITS)[0] == "cannot-tell"
    assert said([], [NONE], None, MISSES)[0] == "cannot-tell"


def test_what_scores_below_the_alarm_is_not_excluded() -> None:
    groups = (("effect0", "effect1"), tuple(f"effect{k}" for k in range(2, 11)))
    verdict, _, remarks = said([], [NONE], None, FITS, groups)
    assert verdict == "nothing-missing"
    assert "effect0" in remarks
    assert "and 3 more" in remarks
    assert "wind" not in remarks


def test_an_alarm_that_nothing_came_of_is_no_all_clear() -> None:
    verdict, sentence, _ = said([], [NONE], None, FITS, (), "wind stands out, but no flow with it fits")
    assert verdict == "cannot-tell"
    assert "wind stands out" in sentence


def test_a_misfit_is_not_said_to_hide() -> None:
    assert "effect0" in said([], [NONE], None, FITS, (("effect0",),))[2]
    assert "effect0" not in said([], [NONE], None, MISSES, (("effect0",),))[2]


@pytest.mark.parametrize(
    ("rivals", "verdict"),
    [(["a"], "identified"), (["a", "b", "c"], "one-of"), (["a", "b", "c", "d"], "cannot-tell")],
)
def test_a_set_of_more_than_three_groups_tells_nothing(rivals: list[str], verdict: str) -> None:
    assert said([step(*rivals)], [a_suspect(name) for name in rivals], None, FITS)[0] == verdict


def test_rivals_are_told_with_their_chances() -> None:
    both = Step("a", ("a", "b", "c"), (0.5, 0.3, 0.16), (("a", "b"), ("c",)), 200.0, 5.0, 1e-4)
    sentence = said([both], [a_suspect(name) for name in "abc"], None, FITS)[1]
    assert "trace in these data as b, together with a chance of 80% among those calibrated, or else c (16%)" in sentence


def test_an_implausible_size_is_remarked() -> None:
    usual = a_suspect("a", amplitude={"value": 0.9, "scale": 0.5})
    huge = a_suspect("a", amplitude={"value": -0.34, "scale": 0.1})
    assert "plausible" not in said([step("a")], [usual], None, FITS)[2]
    assert "3.4 times what is plausible" in said([step("a")], [huge], None, FITS)[2]


def test_a_place_wins_over_steps() -> None:
    location = Location(33.0, -0.6, ("low",), 0.4, 12.0)
    verdict, sentence, _ = said([step("a")], [a_suspect("a")], location, MISSES)
    assert verdict == "none-of-these"
    assert "after a: the misfit points at x = 33.0, y = -0.6 m" in sentence


def test_the_chance_of_a_misfit() -> None:
    assert chance_of_misfit(5.0, 5) == pytest.approx(0.4159, abs=1e-3)
    assert np.isfinite(chance_of_misfit(0.0, 0))


def test_what_is_left_too_large_is_remarked_after_a_step_only() -> None:
    left = "left is still larger than the errors allow"
    assert left in said([step("a")], [a_suspect("a")], None, MISSES)[2]
    assert left not in said([step("a")], [a_suspect("a")], None, FITS)[2]
    assert left not in said([], [NONE], None, MISSES)[2]
    assert left not in said([step(*"abcd")], [a_suspect(name) for name in "abcd"], None, MISSES)[2]


def test_errors_that_are_not_as_stated_are_remarked() -> None:
    remarks = said([], [NONE], None, FITS, errors=EstimatedErrors(0.4, 1.5, 0.0, (3, 4)))[2]
    assert "correlated by 0.40" in remarks
    assert "too small by a factor of 1.50" in remarks
    assert "2 stations stand alone" in remarks
    assert said([], [NONE], None, FITS)[2] == ""


def test_what_looks_like_a_parameter_is_untestable_for_that_reason() -> None:
    hidden = a_suspect("wind", detectability={"testable": False, "cosine": -0.9})
    assert "wind (looks like a change of k_s)" in said([], [hidden], None, FITS)[2]
