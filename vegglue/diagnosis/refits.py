"""Hypotheses calibrated in earnest: the search model with one effect more, from one start or two, and its evidence.

    ln B = -1/2 (F - F_0) - 1/2 ln(|H| / |H_0|),   F = |W (y - f)|^2 + |z|^2,   H = J' W' W J + 1

This is Laplace's approximation of the Bayes factor against nothing missing (0), at the best place of each: on the scale
of z priors are standard normal, so that their widths are charged by |H|.
Source: Kass and Raftery (1995), doi:10.2307/2291091, their equation 5; not checked against it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import (
    Baseline,
    SearchModel,
    baseline,
    coarse_search,
    log_evidence,
    search_model,
    under_error_of_grid,
    with_coarse_point,
    with_own_error,
    with_own_error_again,
    with_own_error_at,
)
from vegglue.calibration.candidates import Candidate, candidate_in_case, start_with, with_effect
from vegglue.calibration.fit import MapEstimate, at_point, fit, interval95, log_evidence_under
from vegglue.calibration.learned_bed import line_offset
from vegglue.calibration.score_test import log_factors
from vegglue.case.bed_error import SurveyedLine, surveyed_lines, without_level
from vegglue.case.gridded_site import build_site
from vegglue.decision_constants import constants
from vegglue.engine.interface import Model, Point, linearise, linearise_as_coarse, linearise_from
from vegglue.errors import InputError
from vegglue.normal_range import NORMAL95
from vegglue.parallel import parallel_map
from vegglue.progress import Progress, Watch, counted, silent
from vegglue.results.causes import CandidateEffect
from vegglue.wording.phases import NO_LONGER_NEEDED

# Steps that a refit may take, and how many more for each shape that is fitted, too. Chosen, not measured: most need
# four; an outline needs up to twenty, and stops far from the best with ten.
REFIT_STEPS, SHAPE_STEPS = 10, 3
# Shares of the way to a start at which a flow is looked for, the next where the one before has none. Chosen, not
# measured: with a tenth of a size nearly every flow is found that is found without.
SHARES_OF_START = (1.0, 0.3, 0.1)
# Fall of the objective that a later start has to promise [-]: half of it is evidence, e^0.25. Chosen, not measured.
WORTH_FOLLOWING = 0.5


@dataclass(frozen=True)
class RefitTrial:
    """What is to be refitted.

    Attributes
    ----------
    shapes : mapping of float
        Values of its shapes [unit of each].
    starts : tuple of ndarray (p + q,)
        z to start from, the amplitude and the shapes that are fitted with it last [standard deviations of the prior].
    needed : float
        ln B below which it is of no use [-].
    """

    candidate: Candidate
    shapes: Mapping[str, float]
    starts: tuple[Array, ...]
    needed: float = -np.inf


@dataclass(frozen=True)
class Refit:
    """The search model with one effect more, calibrated.

    Attributes
    ----------
    shapes : mapping of float
        [unit of each]
    fitted : MapEstimate
        Of all parameters, the amplitude among them.
    log_factor : float
        ln B against nothing missing [-].
    amplitude : float
        [unit of the effect]
    interval95 : (float, float)
        Of the amplitude.
    """

    candidate: Candidate
    shapes: Mapping[str, float]
    fitted: MapEstimate
    log_factor: float
    amplitude: float
    interval95: tuple[float, float]

    def of(self, candidate_effect: CandidateEffect) -> CandidateEffect:
        """The candidate_effect with the amplitude of its refit."""
        own = replace(candidate_effect.amplitude, value=self.amplitude, interval95=self.interval95)
        amplitude = replace(own, refitted=True, objective=self.fitted.objective)
        return replace(candidate_effect, shapes=dict(self.shapes), amplitude=amplitude)


def refits_of(search: SearchModel, trials: Sequence[RefitTrial], watch: Watch = silent) -> list[Refit | None]:
    """Each trial refitted, side by side, with ln B as in the head of this file.

    Parameters
    ----------
    watch : callable
        Is called with the number of refits that are done.

    Returns
    -------
    list of Refit or None
        In the order of the trials; None if no flow is found, or less than is needed.
    """
    finished = counted(watch, "refitting with each", len(trials), "refits")
    tasks = [(trial, search.log_evidence + trial.needed) for trial in trials]
    ends = parallel_map(partial(_best_of_starts, search), tasks, finished)
    refits: list[Refit | None] = []
    for trial, best in zip(trials, ends, strict=True):
        gained = -np.inf if best is None else log_evidence_under(best) - search.log_evidence
        if best is None or gained < trial.needed:
            refits.append(None)
            continue
        amplitude, low, high = interval95(_with(search.model, trial), best, trial.candidate.parameter)
        refits.append(Refit(trial.candidate, trial.shapes, best, gained, amplitude, (low, high)))
    return refits


def _best_of_starts(search: SearchModel, trial: RefitTrial, needed: float) -> MapEstimate | None:
    """The best end of all starts, or of a share of the way to them from the amplitude off, each later one followed
    while it promises more than those before it, and any while it may have the ln evidence that is needed [-]. Flows are
    found from the nearest that is known, the nearest first.
    """
    model, candidate, best = _with(search.model, trial), trial.candidate, None
    here = start_with(candidate, search.point.z, 0.0)
    known: list[tuple[Array, Point]] = [(here, search.point)]
    points = dict[int, Point]()
    for number in np.argsort([np.linalg.norm(start - here) for start in trial.starts], kind="stable").tolist():
        start = trial.starts[number]
        near = min(known, key=lambda one: float(np.linalg.norm(start - one[0])))[1]
        ways = (np.asarray(here + share * (start - here)) for share in SHARES_OF_START)
        point = next((one for z in ways if (one := linearise_from(model, z, near)) is not None), None)
        if point is not None:
            points[number] = point
            known.append((point.z, point))
    steps = REFIT_STEPS + SHAPE_STEPS * len(candidate.fitted)
    for number in sorted(points):
        enough = np.inf if best is None else best.objective - WORTH_FOLLOWING
        found = fit(model, search.noise, points[number], steps, enough, needed)
        best = found if best is None or found.objective < best.objective else best
    return best


def calibrated_with(base: Baseline, best: Refit) -> Baseline | None:
    """The model with an accepted hypothesis as the next baseline, the errors of its grid and its own computed again.

    Parameters
    ----------
    best : Refit
        On the cells of the search.

    Returns
    -------
    Baseline or None
        None if no flow is found on the case's own cells.
    """
    place, model = best.fitted.point, _with(base.model, best)
    if base.coarse is None:
        return with_own_error(Baseline(model, base.noise, best.fitted, None, None))
    coarse = _with(base.coarse, best)
    if coarse_search(base) is None:
        trial = with_coarse_point(Baseline(model, base.noise, best.fitted, coarse, base.on_coarse))
        return with_own_error(under_error_of_grid(trial))
    start = _on_own_cells(base, model, place)
    if start is None:
        return None
    # Errors of the grid and of the model are those where the refit ended first: its flow on coarse cells is known.
    noise = with_own_error_at(base.noise, coarse, place)
    trial = Baseline(model, noise, at_point(noise, start), coarse, place)
    return with_own_error_again(under_error_of_grid(trial), place.z)


@dataclass(frozen=True)
class Relevelled:
    """The model calibrated without the level of a surveyed line.

    Attributes
    ----------
    log_factor : float
        ln B of an offset of that line against none, by survey and flow [-].
    offset, error : float
        The offset and its standard error [m].
    """

    base: Baseline
    log_factor: float
    offset: float
    error: float


def relevelled(base: Baseline, line: SurveyedLine) -> Relevelled | None:
    """The model without the level of a line.

        ln B = ln p(y | its level unknown) - ln p(y | its level as surveyed) + ln B of the survey alone

    What the survey says of the offset is the prior of the flow in the first term, and counts once.

    Returns
    -------
    Relevelled or None
        None if no flow is found on that bed.
    """
    case = without_level(base.model.case, line)
    try:
        loose = baseline(replace(base.model, case=case, site=build_site(case)), beside=base)
    except InputError:
        return None
    known = surveyed_lines(base.model.case, base.model.site.grid)
    of_survey, columns = known.evidence
    trace = columns[:, known.lines.index(line)]
    length = float(np.linalg.norm(trace))
    alone = log_factors(np.array([trace @ of_survey / length]), np.array([length * constants().line_offset]))
    gained = log_evidence(loose) - log_evidence(base)
    return Relevelled(loose, gained + float(alone[0]), *line_offset(loose, line, base))


def _on_own_cells(base: Baseline, model: Model, place: Point) -> Point | None:
    """A model, which may differ from the base by one effect, at a place on the cells of the search."""
    searched = coarse_search(base)
    return place if searched is None else linearise_as_coarse(model, base.fitted.point, searched[1], place)


def _with(model: Model, tried: RefitTrial | Refit) -> Model:
    return replace(model, case=with_effect(model.case, tried.candidate, tried.shapes))


def pruned(base: Baseline, earlier: list[str], watch: Watch) -> tuple[Baseline, list[str]]:
    """The model without those of its earlier effects whose amplitude has become compatible with off.

    Parameters
    ----------
    earlier : list of str
        Names of effects.
    watch : callable
        Is called with each that is dropped.

    Returns
    -------
    Baseline, list of str
        The model, and the names that it lacks now.
    """
    unneeded: list[str] = []
    for name in earlier:
        one = candidate_in_case(base.model.case, name)
        interval = interval95(base.model, base.fitted, one.parameter)
        if one.has_further_amplitudes or not is_near_off(interval, one.effect.amplitude.off):
            continue
        watch(Progress(NO_LONGER_NEEDED.format(name)))
        fewer = without_effect(base, one)
        if fewer is not None:
            base, unneeded = fewer, [*unneeded, name]
    return base, unneeded


def is_near_off(interval: tuple[float, float, float], off: float) -> bool:
    """|a - off| <= needed_errors s,   s = (high - low) / (2 1.96).

    Not on the scale of z, on which off is the far end of the prior of an effect that has one sign only.

    Parameters
    ----------
    interval : (float, float, float)
        a and its 95 % range [its unit].
    off : float
        [its unit]
    """
    middle, low, high = interval
    return abs(middle - off) <= constants().needed_errors * (high - low) / (2.0 * NORMAL95)


def without_effect(base: Baseline, one: Candidate) -> Baseline | None:
    """The model calibrated again without one of its effects.

    Parameters
    ----------
    one : Candidate
        As it stands in the case.

    Returns
    -------
    Baseline or None
        Under the errors of the base; None if no flow is found.
    """

    def less(model: Model) -> Model:
        case = model.case
        effects = {name: entry for name, entry in case.effects.items() if name != one.key}
        parameters = {name: prior for name, prior in case.parameters.items() if name not in one.priors}
        return replace(model, case=case.model_copy(update={"effects": effects, "parameters": parameters}))

    search = search_model(base)
    kept = np.array([name not in one.priors for name in base.model.names])
    near = linearise(less(search.model), search.point.z[kept], search.point)
    if near is None:
        return None
    place, model = fit(less(search.model), search.noise, near).point, less(base.model)
    start = _on_own_cells(base, model, place)
    if start is None:
        return None
    coarse = None if base.coarse is None else less(base.coarse)
    on_coarse = base.on_coarse if coarse_search(base) is None else place
    return with_coarse_point(Baseline(model, base.noise, fit(model, base.noise, start), coarse, on_coarse))
