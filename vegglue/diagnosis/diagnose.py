"""From misfit to missing effect: look, refit the suspects, keep those that hold 95 % of the chances, look again.

The method is that of a score test against the bootstrap of its maximum (Rao 1948, doi:10.1017/S0305004100023987), with
nonlinear refits of the best and a set of rivals by their chances.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, baseline
from vegglue.calibration.fit import chi2, fit, interval95
from vegglue.calibration.noise import discounted
from vegglue.diagnosis.misfit_zones import misfit_zones
from vegglue.diagnosis.refits import accepted, pruned, refits_of
from vegglue.diagnosis.suspects import hiding, suspects_of
from vegglue.diagnosis.verdict import Misfit, judged
from vegglue.engine.interface import Model
from vegglue.inference.likelihood import root_mean_square
from vegglue.progress import Say
from vegglue.results.diagnosis import ALARM, ALARM_OF_PLACES, Diagnosis, Step, Suspect, Where
from vegglue.screening import score_test
from vegglue.screening.residual_screening import Screening, screen
from vegglue.version import VERSION

# Effects that are accepted one after the other, stations set aside at most, effects whose likeness is kept.
ACCEPTED, FLAGGED, COMPARED = 3, 6, 12
# A second effect must be this much surer than a first one.
FURTHER = 0.2
# Share of an accepted trace, in standard errors, that the model may have put wrong, and that another one then picks up:
# with the true effect in open-c and open-e 0.1 of their length was left along one other trace, at the waterline.
BESIDE = 0.1
# Logarithm of the odds by which a place must beat every listed effect, or a single station both: 20 to 1, where strong
# evidence begins (Kass and Raftery 1995, doi:10.2307/2291091). From 1 to 6 only one station of open-b depends on it.
CLEARLY = 3.0


def diagnose_model(model: Model, known: Array | None = None, say: Say = lambda text: None) -> Diagnosis:
    """Find out what a calibrated model lacks. known (p,): a good place of the prior, if there is one.

    Errors: InputError when the model finds no flow, or a station has no standard error.
    """
    say("calibrating the model as it is")
    base = baseline(model, known)
    say("looking for what is missing")
    first = seen = screen(base)
    steps: list[Step] = []
    suspects: dict[str, Suspect] = {}
    while True:
        seen = _calm(seen, steps, say)
        now = suspects_of(seen)
        suspects = now | {name: one for name, one in suspects.items() if one.refitted or name not in now}
        if _alarm(seen, steps) != "effect" or len(steps) == ACCEPTED:
            break
        refits = refits_of(seen, say)
        found = accepted(seen, refits, bool(steps), say)
        suspects |= {one.candidate.name: one.told(now[one.candidate.name]) for one in refits}
        if found is None:
            break
        step, base = found
        suspects[step.accepted] = _calibrated(suspects[step.accepted], base, refits[0].candidate.parameter)
        base, unneeded = pruned(base, [one.accepted for one in steps], say)
        steps = [one for one in (*steps, step) if one.accepted not in unneeded]
        say(f"looking for what is missing after {' and '.join(one.accepted for one in steps)}")
        seen = screen(base, seen.flagged)
    return _written(first, seen, steps, suspects)


def _alarm(seen: Screening, steps: Sequence[Step]) -> str:
    """What the residual points at most surely: 'effect', 'place', 'station', or '' when errors alone explain it."""
    slack = BESIDE * float(np.sqrt(sum(max(one.chi2_before - one.chi2_after, 0.0) for one in steps)))
    effect, place, station = (family.log_p(slack) for family in (seen.effects, seen.places, seen.stations))
    strictness = FURTHER if steps else 1.0
    if station < np.log(0.01) and station < min(effect, place) - CLEARLY:
        return "station"
    listed = effect < np.log(strictness * ALARM)
    if place < np.log(strictness * ALARM_OF_PLACES) and (place < effect - CLEARLY or not listed):
        return "place"
    return "effect" if listed else ""


def _calm(seen: Screening, steps: Sequence[Step], say: Say) -> Screening:
    """The look once stations that stand alone count for nothing; the model is calibrated again without each."""
    while _alarm(seen, steps) == "station" and len(seen.flagged) < FLAGGED:
        say("setting a station aside")
        station, base = seen.stations.best, seen.base
        noise = discounted(base.noise, np.array([station]))
        base = replace(base, noise=noise, fitted=fit(base.model, noise, base.fitted.point))
        seen = screen(base, (*seen.flagged, station), seen)
    return seen


def _calibrated(suspect: Suspect, base: Baseline, parameter: str) -> Suspect:
    """A suspect with its amplitude in the model that has accepted it."""
    amplitude, low, high = interval95(base.model, base.fitted, parameter)
    return replace(suspect, amplitude=amplitude, interval95=(low, high))


def _where(seen: Screening) -> Where:
    """The place whose drag spot explains most."""
    best, spots = seen.places.best, seen.traces.spots
    strength = float(seen.places.scores[best] / max(seen.spot_length[best], 1e-300))
    white = seen.noise.whiten(seen.noise.used(spots.traces[:, best : best + 1]))[:, 0] ** 2
    names = seen.base.model.station["experiment"].to_numpy()[seen.noise.rows]
    share = {str(name): float(white[names == name].sum() / white.sum()) for name in dict.fromkeys(names)}
    seen_in = tuple(name for name, part in share.items() if part > 0.1)
    return Where(float(spots.x[best]), float(spots.y[best]), seen_in, strength, float(seen.places.scores[best]))


def _unexplained(seen: Screening, alarm: str) -> str:
    """What stands out although nothing came of it, '' if nothing does."""
    if alarm == "effect":
        return f"{seen.traces.candidates[seen.order[0]].name} stands out, but no calibrated flow with it fits better"
    return f"more than {FLAGGED} stations stand alone" if alarm == "station" else ""


def _written(first: Screening, last: Screening, steps: Sequence[Step], suspects: Mapping[str, Suspect]) -> Diagnosis:
    """From the first look and the last one."""
    point, noise = last.base.fitted.point, last.noise
    alarm = _alarm(last, steps)
    place = _where(last) if alarm == "place" else None
    misfit = Misfit(chi2(noise, point), noise.rows.size - point.z.size - len(last.flagged))
    ranked = tuple(sorted(suspects.values(), key=lambda one: (not one.refitted, -(one.score**2))))
    open_still = () if steps or alarm else hiding(last)
    unexplained = "" if steps else _unexplained(last, alarm)
    verdict, sentence, remarks = judged(noise, steps, ranked, place, misfit, last.flagged, open_still, unexplained)
    mapped = first if place is None else last  # a place is found in what the steps leave
    return Diagnosis(
        name=first.base.model.case.name,
        verdict=verdict,
        sentence=sentence,
        remarks=tuple(remarks),
        suspects=ranked,
        steps=tuple(steps),
        where=place,
        not_excluded=open_still,
        chi2=misfit.chi2,
        freedom=misfit.freedom,
        p_misfit=misfit.p,
        map_x=mapped.traces.spots.x,
        map_y=mapped.traces.spots.y,
        map_score=mapped.places.scores,
        version=VERSION,
        **_before(first),
        **_after(last),
    )


def _before(seen: Screening) -> dict[str, Any]:
    """What a diagnosis keeps of the model as it was."""
    base, candidates, order = seen.base, seen.traces.candidates, seen.order[:COMPARED]
    columns = [seen.best_column(j) for j in order]
    return {
        "chi2_first": chi2(base.noise, base.fitted.point),
        "threshold": seen.threshold,
        "first_scores": {one.name: seen.best_score(j) for j, one in enumerate(candidates)},
        "first_parameters": {name: interval95(base.model, base.fitted, name)[0] for name in base.model.names},
        "zones": misfit_zones(base.model, base.noise, base.fitted.point),
        "station": base.model.station,
        "prediction_first": base.fitted.point.prediction,
        "cosine_names": tuple(candidates[j].name for j in order),
        "cosine": score_test.cosines(seen.projected)[np.ix_(columns, columns)],
    }


def _after(seen: Screening) -> dict[str, Any]:
    """What it keeps of the last model."""
    base, noise = seen.base, seen.noise
    return {
        "correlation": noise.correlation,
        "scale": noise.scale,
        "grid_error": root_mean_square(noise.grid),
        "flagged": tuple(int(noise.rows[row]) for row in seen.flagged),
        "parameters": {name: interval95(base.model, base.fitted, name) for name in base.model.names},
        "prediction": base.fitted.point.prediction,
        "error": noise.among_all(noise.of_data, len(base.model.station)),
    }
