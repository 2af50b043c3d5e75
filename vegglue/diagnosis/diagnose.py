"""From misfit to missing effect.

The model is calibrated, and its residual is screened by score tests of all that could be missing (Rao 1948,
doi:10.1017/S0305004100023987), against the bootstrap of their maximum. Stations that are outliers are rejected. While
an effect stands out, the most suspect ones are refitted; the best is accepted, with the rivals that may be it instead;
what was accepted earlier and is no longer needed is dropped; and the residual is screened again. When no effect stands
out, or none of the refits helps, the verdict is drawn from the last screening.
"""

from collections.abc import Mapping
from dataclasses import replace

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, baseline
from vegglue.calibration.fit import interval95
from vegglue.diagnosis.conclusion import concluded
from vegglue.diagnosis.detection import detected, without_outliers
from vegglue.diagnosis.refits import accepted, pruned, refits_of
from vegglue.diagnosis.suspects import suspects_of
from vegglue.engine.interface import Model
from vegglue.progress import Say
from vegglue.results.diagnosis import Diagnosis, Step, Suspect
from vegglue.screening.residual_screening import screen

# Effects that are accepted one after the other at most.
MOST_EFFECTS = 3


def diagnose_model(model: Model, known: Array | None = None, say: Say = lambda text: None) -> Diagnosis:
    """Find out what a calibrated model lacks. known (p,): a good place of the prior, if there is one.

    Errors: InputError when the model finds no flow, or a station has no standard error.
    """
    say("calibrating the model as it is")
    base = baseline(model, known)
    say("looking for what is missing")
    first = screening = screen(base)
    steps: list[Step] = []
    suspects: dict[str, Suspect] = {}
    while True:
        screening = without_outliers(screening, steps, say)
        tested = suspects_of(screening)
        suspects = tested | _kept(suspects, tested)
        if detected(screening, steps) != "effect" or len(steps) == MOST_EFFECTS:
            break
        refits = refits_of(screening, say)
        suspects |= {one.candidate.name: one.of(tested[one.candidate.name]) for one in refits}
        found = accepted(screening, refits, bool(steps), say)
        if found is None:
            break
        step, base = found
        suspects[step.accepted] = _in_model(suspects[step.accepted], base, refits[0].candidate.parameter)
        base, unneeded = pruned(base, [one.accepted for one in steps], say)
        steps = [one for one in (*steps, step) if one.accepted not in unneeded]
        say(f"looking for what is missing after {' and '.join(one.accepted for one in steps)}")
        screening = screen(base, screening.flagged)
    return concluded(first, screening, steps, suspects)


def _kept(suspects: Mapping[str, Suspect], tested: Mapping[str, Suspect]) -> dict[str, Suspect]:
    """Those of which earlier rounds say more than the last test: refitted, or accepted and so tested no more."""
    return {name: one for name, one in suspects.items() if one.amplitude.refitted or name not in tested}


def _in_model(suspect: Suspect, base: Baseline, parameter: str) -> Suspect:
    """A suspect with its amplitude in the model that has accepted it."""
    value, low, high = interval95(base.model, base.fitted, parameter)
    return replace(suspect, amplitude=replace(suspect.amplitude, value=value, interval95=(low, high)))
