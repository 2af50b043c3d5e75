"""Suspects calibrated in earnest: the best of them, the rivals that may be it instead, the model that follows."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy.stats

from vegglue import score
from vegglue.baseline import Baseline, grid_difference
from vegglue.candidates import Candidate, with_effect
from vegglue.cores import in_threads
from vegglue.diagnosis import Step, Suspect
from vegglue.effect import Array
from vegglue.fit import Fitted, chi2, fit, interval95, objective
from vegglue.linearise import Model, linearise
from vegglue.noise import with_grid_error
from vegglue.suspicion import Look, refit_start
from vegglue.verdict import MOST_GROUPS

# Suspects that are refitted in one round, and steps each of them may take.
REFITTED, REFIT_STEPS = 6, 8
# Scores this much below the best one's (in squares, and as a share of it) are not refitted.
BEHIND, BEHIND_SHARE = 15.0, 0.45
# Share of the chances that the set holds, and the part of the best one's chance below which a rival is told apart from
# others whatever its trace: odds of 20 to 1, where strong evidence begins (Kass and Raftery 1995, doi:10.2307/2291091).
IN_SET, HARDLY = 0.95, 0.05


@dataclass(frozen=True)
class Refit:
    """The quick model with one effect more at its best place; column: its trace; amplitude with its 95 % interval."""

    candidate: Candidate
    column: int
    fitted: Fitted
    amplitude: float
    interval95: tuple[float, float]

    def told(self, suspect: Suspect) -> Suspect:
        """The suspect with what its refit says of it."""
        told = replace(suspect, amplitude=self.amplitude, interval95=self.interval95, refitted=True)
        return replace(told, objective=self.fitted.objective)


def refits_of(seen: Look, jobs: int, say: Callable[[str], None]) -> list[Refit]:
    """The most suspect effects refitted, the best first; those that find no flow are left out."""
    tried = _handful(seen)
    say(f"refitting with {', '.join(seen.traces.candidates[j].name for j in tried)}")
    found = in_threads(partial(_refit, seen), [(j,) for j in tried], jobs)
    return sorted((one for one in found if one is not None), key=lambda one: one.fitted.objective)


def accepted(seen: Look, refits: list[Refit], later: bool, say: Callable[[str], None]) -> tuple[Step, Baseline] | None:
    """The best refit as a step, with the rivals that may be it instead, and the baseline it leads to.

    None when one parameter more would lower the misfit as much (5 %), when a later effect has so many rivals that they
    say nothing, or when no flow is found with it.
    """
    _, noise, point = seen.base.quick
    fall = [objective(noise, point) - one.fitted.objective for one in refits]
    if not refits or fall[0] < scipy.stats.chi2.ppf(0.95, 1):
        return None
    best, chance, groups = refits[0], *_rivals(seen, refits, np.array(fall))
    if later and len(groups) > MOST_GROUPS:
        return None
    say(f"calibrating with {best.candidate.name}")
    further = _onward(seen, best)
    if further is None:
        return None
    before, p_family = chi2(seen.noise, seen.base.fitted.point), float(np.exp(seen.effects.log_p()))
    rivals, chances = tuple(chance), tuple(chance.values())
    return Step(best.candidate.name, rivals, chances, groups, before, further.fitted.chi2, p_family), further


def _rivals(seen: Look, refits: list[Refit], fall: Array) -> tuple[dict[str, float], tuple[tuple[str, ...], ...]]:
    """The chance of each refit in the fewest groups that hold IN_SET of it, the likeliest first, and these groups.

    fall (k,): by how much each lowers the objective.
    """
    columns, names = [one.column for one in refits], [one.candidate.name for one in refits]
    chance = score.chances_of_rivals(fall)
    near = chance >= HARDLY * chance.max()
    alike = np.where(near & near[:, None], score.cosines(seen.projected)[np.ix_(columns, columns)], 0.0)
    kept = score.fewest(score.groups(range(len(refits)), alike), chance, IN_SET)
    likeliest = sorted((j for group in kept for j in group), key=lambda j: -chance[j])
    return {names[j]: float(chance[j]) for j in likeliest}, tuple(tuple(names[j] for j in group) for group in kept)


def _onward(seen: Look, best: Refit) -> Baseline | None:
    """The model with the accepted effect as the next baseline, the error of its grid looked at again; None where it
    finds no flow.
    """
    base, place = seen.base, best.fitted.point
    model = _with(base.model, seen, best)
    if base.coarse is None:
        return Baseline(model, base.noise, best.fitted, None, None)
    start = place if base.quick[0] is base.model else linearise(model, place.z, place) or linearise(model, place.z)
    if start is None:
        return None
    fitted, coarse = fit(model, base.noise, start), _with(base.coarse, seen, best)
    on_coarse = linearise(coarse, fitted.point.z, base.on_coarse)
    noise = with_grid_error(base.noise, grid_difference(fitted.point, on_coarse))
    return Baseline(model, noise, fit(model, noise, fitted.point), coarse, on_coarse)


def _with(model: Model, seen: Look, one: Refit) -> Model:
    return replace(model, case=with_effect(model.case, one.candidate, seen.traces.settings[one.column]))


def _handful(seen: Look) -> list[int]:
    """Candidates worth a refit, the best score first."""
    squares = {j: seen.best_score(j) ** 2 for j in seen.order}
    most = max(squares.values())
    least = min(most - BEHIND, BEHIND_SHARE * most)
    return [j for j in seen.order[:REFITTED] if squares[j] >= max(least, 4.0)] or seen.order[:1]


def _refit(seen: Look, candidate: int) -> Refit | None:
    one, column = seen.traces.candidates[candidate], seen.best_column(candidate)
    quick, noise, point = seen.base.quick
    model = replace(quick, case=with_effect(quick.case, one, seen.traces.settings[column]))
    start = linearise(model, refit_start(seen, candidate, model.case), point)
    if start is None:
        return None
    fitted = fit(model, noise, start, REFIT_STEPS)
    amplitude, low, high = interval95(model, fitted, one.parameter)
    return Refit(one, column, fitted, amplitude, (low, high))
