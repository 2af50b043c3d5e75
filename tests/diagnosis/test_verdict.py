"""From what was found to a verdict in words: when it names, when it only remarks, and when it cannot tell."""

from dataclasses import replace

import numpy as np
import pytest
from diagnoses import a_diagnosis, a_suspect

from vegglue.calibration.noise import noise_of
from vegglue.diagnosis.verdict import Misfit, judged
from vegglue.results.diagnosis import Step, Suspect, Where

STATION = a_diagnosis().station
FITS, MISSES = Misfit(5.0, 5), Misfit(80.0, 5)
NONE = a_suspect("wind", score=0.4)


def step(*rivals: str) -> Step:
    chances = tuple(0.96 / len(rivals) for _ in rivals)
    return Step(rivals[0], rivals, chances, tuple((name,) for name in rivals), 200.0, 5.0, 1e-4)


Groups = tuple[tuple[str, ...], ...]


def said(
    steps: list[Step], suspects: list[Suspect], place: Where | None, fit: Misfit, still: Groups = (), alone: str = ""
) -> tuple[str, str, str]:
    verdict, sentence, remarks = judged(noise_of(STATION), steps, suspects, place, fit, (), still, alone)
    return verdict, sentence, " ".join(remarks)


def test_nothing_is_missing_only_where_it_would_be_seen() -> None:
    assert said([], [NONE], None, FITS)[0] == "nothing-missing"
    blind = [replace(NONE, testable=False)] * 9
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
    usual, huge = a_suspect("a", amplitude=0.9, scale=0.5), a_suspect("a", amplitude=-0.34, scale=0.1)
    assert "plausible" not in said([step("a")], [usual], None, FITS)[2]
    assert "3.4 times what is plausible" in said([step("a")], [huge], None, FITS)[2]


def test_a_place_wins_over_steps() -> None:
    place = Where(33.0, -0.6, ("low",), 0.4, 12.0)
    verdict, sentence, _ = said([step("a")], [a_suspect("a")], place, MISSES)
    assert verdict == "none-of-these"
    assert "after a: the misfit points at x = 33.0, y = -0.6 m" in sentence


def test_the_chance_of_a_misfit() -> None:
    assert Misfit(5.0, 5).p == pytest.approx(0.4159, abs=1e-3)
    assert np.isfinite(Misfit(0.0, 0).p)
