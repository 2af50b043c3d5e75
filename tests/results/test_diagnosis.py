"""What a diagnosis says of one effect: scores of the first and of the last model, and of which one p is."""

import math
from dataclasses import replace

from diagnoses import a_candidate_effect, a_diagnosis


def test_a_refit_tells_instead_of_the_last_score() -> None:
    """Its score in a model that holds it by now is small, which is no sign against it."""
    tested = a_candidate_effect("eddies", amplitude={"refitted": True}, test={"score": -1.4, "p_family": 1.0})
    found = a_diagnosis(candidate_effects=(tested, a_candidate_effect("mixing[D3]")))
    assert found.first_score(tested) == 45.2
    assert math.isnan(found.last_score(tested))
    assert math.isnan(found.p_of_score(tested))


def test_p_is_of_the_score_told_last() -> None:
    found = a_diagnosis()
    wind, turning = found.candidate_effect("wind"), found.candidate_effect("turning")
    assert (found.last_score(wind), found.p_of_score(wind)) == (0.3, 1.0)
    assert (found.last_score(turning), found.p_of_score(turning)) == (-1.0, 0.7)
    nothing = replace(found, steps=(), places=(), instruments=())
    assert math.isnan(nothing.last_score(wind))
    assert nothing.p_of_score(wind) == 1.0
