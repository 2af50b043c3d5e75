"""From misfit to missing effect: look, refit the suspects, keep every one that the data do not reject, look again.

The method is that of a score test against the bootstrap of its maximum (Rao 1948, doi:10.1017/S0305004100023987), with
nonlinear refits of the best and a set of rivals by simulation from each rival's fit (Cox 1962).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy.stats

from vegglue import __version__, score
from vegglue.baseline import Baseline, baseline, grid_difference
from vegglue.candidates import Candidate, with_effect
from vegglue.cores import in_threads
from vegglue.diagnosis import ALARM, ALARM_OF_PLACES, Diagnosis, Step, Suspect, Where
from vegglue.effect import Array
from vegglue.fit import Fitted, chi2, fit, interval95, objective
from vegglue.likelihood import root_mean_square
from vegglue.linearise import Model, linearise
from vegglue.noise import Noise, with_grid_error, without
from vegglue.prune import pruned
from vegglue.suspicion import Look, look, refit_start
from vegglue.verdict import MOST_GROUPS, judged, misfit_zones

# Suspects that are refitted in one round, effects that are accepted one after the other, stations set aside at most.
REFITTED, ACCEPTED, FLAGGED, REFIT_STEPS = 6, 3, 6, 8
# Scores this much below the best one's (in squares, and as a share of it) are not refitted.
BEHIND, BEHIND_SHARE = 15.0, 0.45
# Amplitude seen in 19 of 20 tries at the 5 % level, over its standard error.
SEEN = 3.5
# A second effect must be this much surer than a first one.
FURTHER = 0.2
# Logarithm of the odds by which a place must beat every listed effect, or a single station both.
CLEARLY = 3.0


@dataclass(frozen=True)
class _Refit:
    candidate: Candidate
    column: int
    fitted: Fitted
    amplitude: float
    interval95: tuple[float, float]


def diagnose(
    model: Model, known: Array | None = None, jobs: int = -1, say: Callable[[str], None] = lambda text: None
) -> Diagnosis:
    """Find out what a calibrated model lacks. known (p,): a good place of the prior, if there is one.

    Errors: InputError when the model finds no flow, or a station has no standard error.
    """
    say("calibrating the model as it is")
    base = baseline(model, known)
    flagged: list[int] = []
    steps: list[Step] = []
    first, seen_first = base, None
    suspects: dict[str, Suspect] = {}
    place: Where | None = None
    while True:
        say(f"looking for what is missing after {' and '.join(step.accepted for step in steps) or 'nothing'}")
        seen = look(base, tuple(flagged))
        base = replace(base, noise=seen.noise)
        if seen_first is None:
            seen_first, first = seen, base
        alarm = _alarm(seen, 1.0 if not steps else FURTHER)
        if alarm == "station" and len(flagged) < FLAGGED:
            flagged.append(seen.stations.best)
            base = _set_aside(base, seen.stations.best)
            continue
        suspects = _suspects(base, seen, suspects)
        if alarm == "place":
            place = _where(base, seen)
        if alarm != "effect" or len(steps) == ACCEPTED:
            break
        step, further, refits = _accept(base, seen, jobs, say)
        suspects |= {one.candidate.name: _refitted(base, seen, one) for one in refits}
        if step is None:
            break
        if steps and len(step.groups) > MOST_GROUPS:
            break
        steps.append(step)
        base, unneeded = pruned(further, [step.accepted for step in steps[:-1]], say)
        steps = [step for step in steps if step.accepted not in unneeded]
    return _written(first, base, seen_first, seen, flagged, steps, suspects, place)


def _alarm(seen: Look, strictness: float) -> str:
    """What the residual points at most surely: 'effect', 'place', 'station', or '' when errors alone explain it.

    strictness: factor on the chance of a false alarm.
    """
    effect, place, station = seen.effects.log_p, seen.places.log_p, seen.stations.log_p
    if station < np.log(0.01) and station < min(effect, place) - CLEARLY:
        return "station"
    listed = effect < np.log(strictness * ALARM)
    if place < np.log(strictness * ALARM_OF_PLACES) and (place < effect - CLEARLY or not listed):
        return "place"
    return "effect" if listed else ""


def _set_aside(base: Baseline, station: int) -> Baseline:
    """The same, with one station counting for nothing; the model is calibrated again."""
    noise = without(base.noise, np.array([station]))
    return replace(base, noise=noise, fitted=fit(base.model, noise, base.fitted.point))


def _accept(
    base: Baseline, seen: Look, jobs: int, say: Callable[[str], None]
) -> tuple[Step | None, Baseline, list[_Refit]]:
    """Refit the suspects, take the best, and name the rivals that the data do not reject."""
    tried = _handful(seen)
    say(f"refitting with {', '.join(seen.candidates[j].name for j in tried)}")
    found = in_threads(partial(_refit, base, seen), [(j,) for j in tried], jobs)
    refits = [one for one in found if one is not None]
    if not refits:
        return None, base, []
    best = min(refits, key=lambda one: one.fitted.objective)
    _, noise, point = base.quick
    if objective(noise, point) - best.fitted.objective < scipy.stats.chi2.ppf(0.95, 1):
        return None, base, refits
    say(f"calibrating with {best.candidate.name}")
    further = _onward(base, seen, best)
    if further is None:
        return None, base, refits
    rivals = _not_rejected(seen, refits)
    step = Step(
        accepted=best.candidate.name,
        rivals=tuple(one.candidate.name for one in rivals),
        groups=_groups(seen, rivals),
        chi2_before=chi2(base.noise, base.fitted.point),
        chi2_after=further.fitted.chi2,
        p_family=seen.effects.p,
    )
    amplitude, low, high = interval95(further.model, further.fitted, best.candidate.parameter)
    better = replace(best, amplitude=amplitude, interval95=(low, high))
    return step, further, [better if one is best else one for one in refits]


def _handful(seen: Look) -> list[int]:
    """Candidates worth a refit, the best score first."""
    squares = np.array([float(seen.scores[seen.best_column(j)] ** 2) for j in range(len(seen.candidates))])
    order = [int(j) for j in np.argsort(-squares)]
    least = min(squares.max() - BEHIND, BEHIND_SHARE * squares.max())
    return [j for j in order[:REFITTED] if squares[j] >= max(least, 4.0)] or order[:1]


def _refit(base: Baseline, seen: Look, candidate: int) -> _Refit | None:
    """The quick model with one effect more at its best place; None where it finds no flow."""
    one, column = seen.candidates[candidate], seen.best_column(candidate)
    quick, noise, point = base.quick
    model = replace(quick, case=with_effect(quick.case, one, seen.settings[column]))
    start = linearise(model, refit_start(base, seen, candidate, model.case), point)
    if start is None:
        return None
    fitted = fit(model, noise, start, REFIT_STEPS)
    amplitude, low, high = interval95(model, fitted, one.parameter)
    return _Refit(one, column, fitted, amplitude, (low, high))


def _not_rejected(seen: Look, refits: list[_Refit]) -> list[_Refit]:
    """Every refit whose misfit lies within what chance allows were it the truth, the best first."""
    order = sorted(refits, key=lambda one: one.fitted.objective)
    family = [seen.columns[seen.candidates.index(one.candidate)] for one in order]
    gains = np.zeros(seen.scores.size)
    for one in order:
        gains[one.column] = one.candidate.effect.amplitude.gain(one.amplitude)
    slack = score.rivals(seen.projected, family, gains, seed=2)
    best = order[0].fitted.objective
    return [one for one, most in zip(order, slack, strict=True) if one.fitted.objective - best <= most]


def _groups(seen: Look, rivals: list[_Refit]) -> tuple[tuple[str, ...], ...]:
    columns = [one.column for one in rivals]
    cosine = score.cosines(seen.projected)[np.ix_(columns, columns)]
    return tuple(tuple(group) for group in score.groups([one.candidate.name for one in rivals], cosine))


def _onward(base: Baseline, seen: Look, best: _Refit) -> Baseline | None:
    """The model with the accepted effect as the next baseline, the error of its grid looked at again; None where it
    finds no flow.
    """
    shapes = seen.settings[best.column]
    model = replace(base.model, case=with_effect(base.model.case, best.candidate, shapes))
    if base.coarse is None:
        return Baseline(model, base.noise, best.fitted, None, None)
    coarse, place = replace(base.coarse, case=with_effect(base.coarse.case, best.candidate, shapes)), best.fitted.point
    start = linearise(model, place.z, place) or linearise(model, place.z)
    if start is None:
        return None
    fitted = fit(model, base.noise, start)
    on_coarse = linearise(coarse, fitted.point.z, base.on_coarse)
    noise = with_grid_error(base.noise, grid_difference(fitted.point, on_coarse))
    return Baseline(model, noise, fit(model, noise, fitted.point), coarse, on_coarse)


def _suspects(base: Baseline, seen: Look, known: dict[str, Suspect]) -> dict[str, Suspect]:
    """All effects as this look sees them; what was refitted earlier stays as it was then."""
    slopes = seen.slopes
    lengths = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    now = {}
    for j, one in enumerate(seen.candidates):
        column = seen.best_column(j)
        amplitude, length = one.effect.amplitude, max(float(seen.projected.length[column]), 1e-300)
        gain = float(seen.scores[column]) / length
        trace = seen.traces[:, column]
        alike = (trace / max(float(np.linalg.norm(trace)), 1e-300)) @ (slopes / lengths)
        nearest = int(np.argmax(np.abs(alike)))
        smallest = amplitude.size(SEEN / length)
        low, high = (amplitude.at(gain + side * 1.96 / length) for side in (-1.0, 1.0))
        now[one.name] = Suspect(
            name=one.name,
            title=one.effect.title,
            unit=amplitude.unit,
            amplitude=amplitude.at(gain),
            interval95=(low, high),
            score=float(seen.scores[column]),
            p_family=seen.family_p(j),
            visibility=float(seen.projected.visible[column]),
            smallest_detectable=smallest,
            testable=smallest < 2.0 * amplitude.scale,
            refitted=False,
            objective=base.fitted.objective - float(seen.scores[column] ** 2),
            mimicked_by=base.model.names[nearest] if base.model.names else "",
            likeness=float(alike[nearest]),
            shapes=seen.settings[column],
        )
    return now | {name: suspect for name, suspect in known.items() if suspect.refitted or name not in now}


def _refitted(base: Baseline, seen: Look, one: _Refit) -> Suspect:
    known = _suspects(replace(base, fitted=base.fitted), seen, {}).get(one.candidate.name)
    assert known is not None
    return replace(
        known,
        amplitude=one.amplitude,
        interval95=one.interval95,
        refitted=True,
        objective=one.fitted.objective,
    )


def _where(base: Baseline, seen: Look) -> Where:
    """The place whose drag spot explains most."""
    best = seen.places.best
    spot = seen.spots
    strength = float(seen.places.scores[best] / max(seen.spot_length[best], 1e-300))
    white = seen.noise.whiten(seen.noise.used(spot.traces[:, best : best + 1]))[:, 0] ** 2
    names = base.model.station["experiment"].to_numpy()[seen.noise.rows]
    share = {str(name): float(white[names == name].sum() / white.sum()) for name in dict.fromkeys(names)}
    seen_in = tuple(name for name, part in share.items() if part > 0.1)
    return Where(float(spot.x[best]), float(spot.y[best]), seen_in, strength, float(seen.places.scores[best]))


def _written(
    first: Baseline,
    last: Baseline,
    seen_first: Look,
    seen: Look,
    flagged: list[int],
    steps: list[Step],
    suspects: dict[str, Suspect],
    place: Where | None,
) -> Diagnosis:
    noise, point = seen.noise, last.fitted.point
    left, freedom = chi2(noise, point), noise.rows.size - point.z.size - len(flagged)
    p_misfit = float(scipy.stats.chi2.sf(left, max(freedom, 1)))
    ranked = tuple(sorted(suspects.values(), key=lambda one: (not one.refitted, -(one.score**2))))
    verdict, sentence, remarks = judged(last.model.case, noise, steps, ranked, place, p_misfit, left, freedom, flagged)
    parameters = {name: interval95(last.model, last.fitted, name) for name in last.model.names}
    mapped = seen_first if place is None else seen  # a place is found in what the steps leave
    top = [seen_first.best_column(j) for j in _order(seen_first)[:12]]
    return Diagnosis(
        name=first.model.case.name,
        verdict=verdict,
        sentence=sentence,
        remarks=tuple(remarks),
        suspects=ranked,
        steps=tuple(steps),
        where=place,
        chi2_first=chi2(first.noise, first.fitted.point),
        chi2=left,
        freedom=freedom,
        p_misfit=p_misfit,
        correlation=noise.correlation,
        scale=noise.scale,
        grid_error=root_mean_square(noise.grid),
        flagged=tuple(int(noise.rows[row]) for row in flagged),
        threshold=float(np.sqrt(np.quantile(seen_first.maxima, 1.0 - ALARM))),
        first_scores={one.name: _best_score(seen_first, j) for j, one in enumerate(seen_first.candidates)},
        first_parameters={name: interval95(first.model, first.fitted, name)[0] for name in first.model.names},
        parameters=parameters,
        zones=misfit_zones(first.model, first.noise, first.fitted.point),
        station=first.model.station,
        prediction_first=first.fitted.point.prediction,
        prediction=point.prediction,
        error=_at_stations(noise, len(first.model.station)),
        map_x=mapped.spots.x,
        map_y=mapped.spots.y,
        map_score=mapped.places.scores,
        cosine_names=tuple(seen_first.candidates[j].name for j in _order(seen_first)[:12]),
        cosine=score.cosines(seen_first.projected)[np.ix_(top, top)],
        version=__version__,
    )


def _order(seen: Look) -> list[int]:
    squares = [_best_score(seen, j) ** 2 for j in range(len(seen.candidates))]
    return [int(j) for j in np.argsort(-np.array(squares))]


def _best_score(seen: Look, candidate: int) -> float:
    return float(seen.scores[seen.best_column(candidate)])


def _at_stations(noise: Noise, stations: int) -> Array:
    error = np.full(stations, np.nan)
    error[noise.rows] = noise.scale * noise.error
    return error
