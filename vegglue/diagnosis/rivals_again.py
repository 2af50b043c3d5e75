"""Rivals of effects accepted earlier, compared again with what was accepted later in the model.

Where the data could not tell two effects apart while something else was missing too, they may now.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vegglue.calibration.baseline import Baseline, search_model
from vegglue.diagnosis.refits import Refit, RefitTrial, calibrated_with, refits_of, start_with, without_effect
from vegglue.diagnosis.rivals import with_chances
from vegglue.diagnosis.tempered_chances import tempered_chances
from vegglue.progress import Progress, Watch
from vegglue.results.diagnosis import Step, Suspect
from vegglue.screening.candidates import candidate_in_case, candidates_of


def with_rivals_again(
    base: Baseline, steps: Sequence[Step], suspects: Mapping[str, Suspect], watch: Watch
) -> tuple[Baseline, tuple[Step, ...]]:
    """The model with the best rival of every step, and the steps with the chances as they are now.

    steps: of effects that were accepted before what was last, be that an effect or something at a place.
    """
    kept: list[Step] = []
    for step in steps:
        found = _again(base, step, suspects, watch) if len(step.rivals) > 1 else None
        base, step = found or (base, step)
        kept.append(step)
    return base, tuple(kept)


def _again(base: Baseline, step: Step, suspects: Mapping[str, Suspect], watch: Watch) -> tuple[Baseline, Step] | None:
    """One step; None when no flow is found without its effect, or with any of its rivals."""
    watch(Progress(f"comparing {', '.join(step.rivals)} again"))
    own = candidate_in_case(base.model.case, step.accepted)
    less = without_effect(base, own)
    if less is None:
        return None
    refits = _refits_of_rivals(less, step, suspects)
    if not refits:
        return None
    best = max(refits, key=lambda one: one.log_factor)
    chance = tempered_chances(np.array([one.log_factor for one in refits]))
    told = {one.candidate.name: float(p) for one, p in zip(refits, chance, strict=True)}
    again = with_chances(replace(step, others={}), best.candidate.name, told)
    if best.candidate.name == step.accepted:
        return base, again
    further = calibrated_with(less, best)
    return None if further is None else (further, again)


def _refits_of_rivals(less: Baseline, step: Step, suspects: Mapping[str, Suspect]) -> list[Refit]:
    """The rivals, each from the size it had, in the model without the effect that was accepted.

    A rival that a later step accepted acts already, and is none any more.
    """
    case, z = less.model.case, less.fitted.point.z
    possible = {one.name: one for one in candidates_of(case, less.model.station)}
    trials = []
    for name in step.rivals:
        if name not in possible:
            continue
        one, suspect = possible[name], suspects[name]
        gain = one.amplitude.gain(suspect.amplitude.value)
        trials.append(RefitTrial(one, suspect.shapes, (start_with(case, one, suspect.shapes, z, gain),)))
    return [refit for refit in refits_of(search_model(less), trials) if refit is not None]
