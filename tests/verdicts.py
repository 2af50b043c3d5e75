"""VerdictInputs of verdicts made up for tests, and what is said of them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pandas as pd
from diagnoses import a_candidate_effect

from vegglue.calibration.fit import chance_of_misfit
from vegglue.diagnosis.search_state import SearchState
from vegglue.diagnosis.verdict import make_verdict
from vegglue.diagnosis.verdict_inputs import VerdictInputs
from vegglue.results.diagnosis import CandidateEffect, EstimatedErrors, Misfit, Step

AS_STATED = EstimatedErrors(correlation=0.0, scale=1.0, grid_error=0.0, flagged=())
# A misfit as it should be, one that errors do not make, and one that is absurd: 3.8 and 6 times the degrees of freedom.
FITS, MISSES, ABSURD = (
    Misfit(chi2, chi2, freedom, chance_of_misfit(chi2, freedom), pd.DataFrame())
    for chi2, freedom in ((5.0, 5), (76.0, 20), (120.0, 20))
)
NONE = a_candidate_effect("wind", test={"score": 0.4})


def step(*rivals: str, **fields: Any) -> Step:
    chances = tuple(0.96 / len(rivals) for _ in rivals)
    return replace(Step(rivals[0], rivals, chances, tuple((name,) for name in rivals), 200.0, 5.0, 1e-4), **fields)


def inputs(*steps: Step, **parts: Any) -> VerdictInputs:
    """Of a diagnosis that found these steps; parts: fields of the inputs, or of what was found, to be changed."""
    of_findings = {name: parts.pop(name) for name in ("places", "instruments", "undecided", "absurd") if name in parts}
    usual = VerdictInputs(
        AS_STATED, FITS, SearchState(steps, **of_findings), None, None, (), float("nan"), False, ("n_b", 1.0)
    )
    return replace(usual, **parts)


def said(found: VerdictInputs, candidate_effects: Sequence[CandidateEffect] = (NONE,)) -> tuple[str, str, str]:
    verdict = make_verdict(found, candidate_effects)
    places = found.state.places
    assert (verdict.anomaly, verdict.not_excluded) == (places[0] if places else None, found.not_excluded)
    return verdict.kind, verdict.sentence, " ".join(verdict.remarks)
