"""Inputs of verdicts made up for tests, and the verdicts on them."""

from dataclasses import fields, replace
from typing import Any

from diagnoses import a_candidate_effect

from vegglue.calibration.fit import chance_of_misfit
from vegglue.diagnosis.verdict_rules import Doubts, VerdictInputs, make_verdict
from vegglue.results.causes import CandidateEffect, Step
from vegglue.results.verdict import ChiSquare, EstimatedErrors, Verdict
from vegglue.wording.sentences import tag_of

AS_STATED = EstimatedErrors(correlation=0.0, scale=1.0, grid_error=0.0, flagged=())
# A misfit as it should be, one that errors do not make, and one that is absurd: 3.8 and 6 times the degrees of freedom.
FITS, MISSES, ABSURD = (
    ChiSquare(chi2, freedom, chance_of_misfit(chi2, freedom)) for chi2, freedom in ((5.0, 5), (76.0, 20), (120.0, 20))
)
NONE = a_candidate_effect("wind", test={"score": 0.4})


def step(*rivals: str, **changed: Any) -> Step:
    """A step that accepts the first; changed: other fields."""
    chances = tuple(0.96 / len(rivals) for _ in rivals)
    return replace(Step(rivals[0], rivals, chances, tuple((name,) for name in rivals), 200.0, 5.0, 1e-4), **changed)


def inputs(*steps: Step, candidates: tuple[CandidateEffect, ...] | None = None, **parts: Any) -> VerdictInputs:
    """Of a diagnosis that accepted these steps, each effect a candidate of its own if none are given."""
    own = tuple(a_candidate_effect(name) for step in steps for name in step.rivals) or (NONE,)
    doubts = {one.name: parts.pop(one.name) for one in fields(Doubts) if one.name in parts}
    doubted = replace(Doubts(strained=("n_b", 1.0)), **doubts)
    usual = VerdictInputs(own if candidates is None else tuple(candidates), AS_STATED, FITS, doubted, steps)
    return replace(usual, **parts)


def verdict_on(*steps: Step, **parts: Any) -> Verdict:
    """The verdict on the same; all its words render."""
    found = make_verdict(inputs(*steps, **parts))
    assert found.sentence
    assert len(found.remarks) == len(found.notes)
    return found


def tags(values: Any) -> list[str]:
    """Kinds of reasons, notes or what remains."""
    return [tag_of(one) for one in values]
