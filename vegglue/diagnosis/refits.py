"""Suspects calibrated: the best of them, the rivals that may be it instead, and the model that follows; then backward
elimination, of effects accepted earlier that a later one has made superfluous."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy.stats

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, grid_difference
from vegglue.calibration.fit import MapEstimate, chi2, fit, interval95, objective
from vegglue.calibration.noise import with_grid_error
from vegglue.case.parameter_space import z_of
from vegglue.diagnosis.verdict import MOST_GROUPS
from vegglue.engine.interface import Model, linearise
from vegglue.parallel import in_threads
from vegglue.results.diagnosis import Step, Suspect
from vegglue.screening import score_test
from vegglue.screening.candidates import Candidate, candidates_in_case, with_effect
from vegglue.screening.residual_screening import Screening, refit_start

# Suspects that are refitted in one round, and steps each of them may take.
REFITTED, REFIT_STEPS = 6, 8
# Scores this much below the best one's (in squares, and as a share of it) are not refitted, nor is one below 2 standard
# errors: errors alone make every twentieth effect as strong.
BEHIND, BEHIND_SHARE, LEAST_SQUARE = 15.0, 0.45, 4.0
# Share of the chances that the set holds, and the part of the best one's chance below which a rival is told apart from
# others whatever its trace: odds of 20 to 1, where strong evidence begins (Kass and Raftery 1995, doi:10.2307/2291091).
IN_SET, HARDLY = 0.95, 0.05


@dataclass(frozen=True)
class Refit:
    """The search model with one effect more at its best place; column: its fingerprint; amplitude with its 95 %
    interval.
    """

    candidate: Candidate
    column: int
    fitted: MapEstimate
    amplitude: float
    interval95: tuple[float, float]

    def of(self, suspect: Suspect) -> Suspect:
        """The suspect with the amplitude of its refit."""
        first_order = replace(suspect.amplitude, value=self.amplitude, interval95=self.interval95)
        return replace(suspect, amplitude=replace(first_order, refitted=True, objective=self.fitted.objective))


def refits_of(screening: Screening, say: Callable[[str], None]) -> list[Refit]:
    """The most suspect effects refitted, the best first; those that find no flow are left out."""
    tried = _worth_refitting(screening)
    say(f"refitting with {', '.join(screening.fingerprints.candidates[j].name for j in tried)}")
    found = in_threads(partial(_refit, screening), [(j,) for j in tried])
    return sorted((one for one in found if one is not None), key=lambda one: one.fitted.objective)


def accepted(
    screening: Screening, refits: list[Refit], later: bool, say: Callable[[str], None]
) -> tuple[Step, Baseline] | None:
    """The best refit as a step, with the rivals that may be it instead, and the baseline it leads to.

    None when one parameter more would lower the misfit as much (5 %), when a later effect has so many rivals that they
    say nothing, or when no flow is found with it.
    """
    search = screening.search
    fall = [objective(search.noise, search.point) - one.fitted.objective for one in refits]
    if not refits or fall[0] < scipy.stats.chi2.ppf(0.95, 1):
        return None
    best, chance, groups = refits[0], *rivals_among(refits, np.array(fall), score_test.cosines(screening.projected))
    if later and len(groups) > MOST_GROUPS:
        return None
    say(f"calibrating with {best.candidate.name}")
    further = _calibrated_with(screening, best)
    if further is None:
        return None
    base, p_family = screening.base, float(np.exp(screening.effects.log_p()))
    before = chi2(base.noise, base.fitted.point)
    rivals, chances = tuple(chance), tuple(chance.values())
    return Step(best.candidate.name, rivals, chances, groups, before, further.fitted.chi2, p_family), further


def rivals_among(
    refits: Sequence[Refit], fall: Array, cosine: Array
) -> tuple[dict[str, float], tuple[tuple[str, ...], ...]]:
    """The chance of each refit in the fewest groups that hold IN_SET of it, the likeliest first, and these groups.

    fall (k,): by how much each lowers the objective; cosine (c, c): between projected fingerprints.
    """
    columns, names = [one.column for one in refits], [one.candidate.name for one in refits]
    chance = score_test.chances_of_rivals(fall)
    near = chance >= HARDLY * chance.max()
    alike = np.where(near & near[:, None], cosine[np.ix_(columns, columns)], 0.0)
    kept = score_test.fewest_groups(score_test.alike_groups(range(len(refits)), alike), chance, IN_SET)
    likeliest = sorted((j for group in kept for j in group), key=lambda j: -chance[j])
    return {names[j]: float(chance[j]) for j in likeliest}, tuple(tuple(names[j] for j in group) for group in kept)


def _calibrated_with(screening: Screening, best: Refit) -> Baseline | None:
    """The model with the accepted effect as the next baseline, the error of its grid looked at again; None where it
    finds no flow.
    """
    base, place = screening.base, best.fitted.point
    model = _with(base.model, screening, best)
    if base.coarse is None:
        return Baseline(model, base.noise, best.fitted, None, None)
    on_own_grid = screening.search.model is base.model
    start = place if on_own_grid else linearise(model, place.z, place) or linearise(model, place.z)
    if start is None:
        return None
    fitted, coarse = fit(model, base.noise, start), _with(base.coarse, screening, best)
    on_coarse = linearise(coarse, fitted.point.z, base.on_coarse)
    noise = with_grid_error(base.noise, grid_difference(fitted.point, on_coarse))
    return Baseline(model, noise, fit(model, noise, fitted.point), coarse, on_coarse)


def _with(model: Model, screening: Screening, one: Refit) -> Model:
    return replace(model, case=with_effect(model.case, one.candidate, screening.fingerprints.settings[one.column]))


def _worth_refitting(screening: Screening) -> list[int]:
    """Candidates whose score is not far behind the best one's, the best first."""
    ranking = screening.ranking
    squares = {j: screening.best_score(j) ** 2 for j in ranking}
    most = max(squares.values())
    least = min(most - BEHIND, BEHIND_SHARE * most)
    return [j for j in ranking[:REFITTED] if squares[j] >= max(least, LEAST_SQUARE)] or ranking[:1]


def _refit(screening: Screening, candidate: int) -> Refit | None:
    one, column = screening.fingerprints.candidates[candidate], screening.best_column(candidate)
    search = screening.search
    model = replace(search.model, case=with_effect(search.model.case, one, screening.fingerprints.settings[column]))
    start = linearise(model, refit_start(screening, candidate, model.case), search.point)
    if start is None:
        return None
    fitted = fit(model, search.noise, start, REFIT_STEPS)
    amplitude, low, high = interval95(model, fitted, one.parameter)
    return Refit(one, column, fitted, amplitude, (low, high))


# An earlier effect whose amplitude lies closer to off than this many standard errors is dropped again.
NEEDED = 2.0


def pruned(base: Baseline, earlier: list[str], say: Callable[[str], None]) -> tuple[Baseline, list[str]]:
    """The model without those of its earlier effects whose amplitude has become compatible with off; their names."""
    unneeded: list[str] = []
    for name in earlier:
        one = next(one for one in candidates_in_case(base.model.case).values() if one.name == name)
        j = base.model.names.index(one.parameter)
        spread = float(np.sqrt(base.fitted.covariance[j, j]))
        off = z_of(base.model.case.parameters[one.parameter], one.effect.amplitude.off)
        if abs(base.fitted.point.z[j] - off) > NEEDED * spread:
            continue
        say(f"{name} is no longer needed")
        fewer = _without(base, one.key, one.parameter)
        if fewer is not None:
            base, unneeded = fewer, [*unneeded, name]
    return base, unneeded


def _without(base: Baseline, key: str, parameter: str) -> Baseline | None:
    """The model calibrated again without one of its effects."""

    def less(model: Model) -> Model:
        case = model.case
        effects = {name: one for name, one in case.effects.items() if name != key}
        parameters = {name: one for name, one in case.parameters.items() if name != parameter}
        return replace(model, case=case.model_copy(update={"effects": effects, "parameters": parameters}))

    kept = np.array([name != parameter for name in base.model.names])
    start = linearise(less(base.model), base.fitted.point.z[kept], base.fitted.point)
    if start is None:
        return None
    fitted = fit(less(base.model), base.noise, start)
    coarse = None if base.coarse is None else less(base.coarse)
    on_coarse = None if coarse is None else linearise(coarse, fitted.point.z, base.on_coarse)
    return Baseline(less(base.model), base.noise, fitted, coarse, on_coarse)
