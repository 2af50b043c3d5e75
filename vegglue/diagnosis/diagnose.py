"""From misfit to missing effect.

The model is calibrated, and its residual is screened by score tests of all that could be missing (Rao 1948,
doi:10.1017/S0305004100023987). While an alarm is sounded (`score_test`), listed effects, places and instruments
compete by their evidence (`competition`), and the best is taken into the model or its data excluded; what was accepted
earlier and is no longer needed is dropped; and the residual is screened again. The verdict is drawn from what was found
and from the last screening.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vegglue.calibration.baseline import FEWEST_CELLS_ACROSS, Baseline, kept_baseline, log_evidence
from vegglue.calibration.candidates import Instrument, candidate_in_case, error_columns
from vegglue.calibration.fit import chi2, fit, interval95
from vegglue.calibration.noise import with_unknown_errors
from vegglue.calibration.residual_screening import Screening, screen
from vegglue.case.channel_geometry import cells_across
from vegglue.case.gridded_site import Site
from vegglue.case.size_limits import WIDE_FROM, factor_bytes
from vegglue.decision_constants import constants
from vegglue.diagnosis.candidate_effects import candidate_effects_of, laws_beside
from vegglue.diagnosis.competition import (
    Hypothesis,
    What,
    chance_of_a_place,
    chances_of,
    chosen_hypothesis,
    evidence_under_larger_errors,
    hypotheses_of,
    nearly_as_likely,
)
from vegglue.diagnosis.conclusion import assemble_diagnosis, single_readings
from vegglue.diagnosis.odds import log_odds_taken, tempered_probabilities, under_larger_errors
from vegglue.diagnosis.refits import calibrated_with, pruned
from vegglue.diagnosis.search_state import (
    PriorWeight,
    SearchState,
    Undecided,
    anomaly_found,
    followed_further,
    instrument_found,
    place_followed_further,
    refitted,
    step_found,
    undecided_of,
    with_alarm,
    with_rivals_again,
)
from vegglue.engine.interface import Model
from vegglue.engine.model import coarser, with_compilation
from vegglue.errors import InputError
from vegglue.flow.nested_dissection import MOST_BYTES, keep_factors_within
from vegglue.measurements.plausibility import implausible_values
from vegglue.parallel import in_threads, submit
from vegglue.progress import Progress, Watch, silent
from vegglue.results.causes import CandidateEffect
from vegglue.results.diagnosis import Diagnosis
from vegglue.wording.phases import CALIBRATING, SEARCHING, SEARCHING_WITH
from vegglue.wording.sentences import sentence

# What the process holds before it solves anything, and what it finds beside flows [bytes].
BASE = 0.4e9
# Flows that are held of each experiment at once [-], on the cells of the search and on the case's own: refits of all
# hypotheses, and points of the calibration. Measured on natural reaches, 72 x 32 to 360 x 150 cells.
SEARCHED, OWN = 12.0, 4.0
# A flow without its factors on a wide grid, and what each core works with [bytes a cell].
FLOW, AT_WORK = 1000.0, 5000.0
# Share of the machine's memory that may be used unless a command says otherwise [-].
MEMORY_SHARE = 0.9
GIGABYTE = 1e9


def jobs_in_memory(model: Model, jobs: int, allowed: float) -> int:
    """As many of `jobs` cores as the memory allowed [bytes] has room for; factors of wide grids are kept within it.

    Raises
    ------
    InputError
        If one core needs more.
    """
    found = coarser(model)
    searched = found.site if found is not None and cells_across(found.site) >= FEWEST_CELLS_ACROSS else model.site
    experiments, cells = len(model.case.experiments), model.site.bed.size
    held = BASE + experiments * (SEARCHED * _flow_bytes(searched) + OWN * _flow_bytes(model.site))
    nx, ny = model.site.bed.shape
    in_use = factor_bytes(nx, ny) if ny >= WIDE_FROM else 0.0  # factors of one flow
    each = AT_WORK * cells + 2.0 * in_use
    fit = min(int((allowed - held) / each), jobs)
    if fit < 1:
        raise InputError(
            f"{model.case.name}: a diagnosis on {nx} x {ny} cells needs about {(held + each) / GIGABYTE:.1f} GB, "
            f"{allowed / GIGABYTE:.1f} GB are allowed: take larger cells, or raise --memory."
        )
    room, enough = allowed - held - AT_WORK * cells * fit, max(MOST_BYTES, max(2, experiments) * in_use)
    keep_factors_within(min(max(room, 2.0 * in_use), enough))
    return fit


def _flow_bytes(site: Site) -> float:
    nx, ny = site.bed.shape
    return FLOW * nx * ny if ny >= WIDE_FROM else factor_bytes(nx, ny)


# Effects and places that are accepted at most, and instruments.
MOST_ACCEPTED, MOST_INSTRUMENTS = 3, 6


@dataclass(frozen=True)
class SearchBranch:
    """What is found with one hypothesis more.

    Attributes
    ----------
    what : {"effect", "place", "instrument"}
        The hypothesis.
    found : SearchState
        With it.
    base : Baseline
        The model that follows.
    screening : Screening or None
        Of that model, once it was screened.
    hypotheses : sequence of Hypothesis
        What competes next, none if no alarm is sounded.
    """

    what: What
    found: SearchState
    base: Baseline
    screening: Screening | None = None
    hypotheses: Sequence[Hypothesis] = ()


def diagnose_model(model: Model, watch: Watch = silent, held_out: Model | None = None) -> Diagnosis:
    """Find out what a calibrated model lacks, from a start that depends on nothing but the case and its data.

    Parameters
    ----------
    watch : callable
        Is called with each phase.
    held_out : Model, optional
        The model at measurements that no calibration uses, with which silence has to agree.

    Raises
    ------
    InputError
        If the model finds no flow, or a station has no standard error.
    """
    watch(Progress(with_compilation(CALIBRATING)))
    implausible = tuple(implausible_values(model.case, model.site, model.station))
    try:
        base = kept_baseline(model)
    except InputError as error:
        if not implausible:
            raise
        why = " ".join(map(sentence, implausible))
        raise InputError(f"{model.case.name}: no flow comes near what was measured. {why}") from error
    watch(Progress(SEARCHING))
    first = screening = screen(base)
    found, effects = SearchState(implausible=implausible), dict[str, CandidateEffect]()
    hypotheses: Sequence[Hypothesis] = ()
    laws = partial(laws_beside, first) if implausible else submit(laws_beside, first)
    while True:
        tested = candidate_effects_of(screening)
        # Of what was refitted, or accepted and so tested no more, earlier rounds know more than the last test.
        effects = tested | {name: one for name, one in effects.items() if one.amplitude.refitted or name not in tested}
        found = with_alarm(screening, found)
        if found.implausible or not found.alarmed:
            break
        hypotheses = hypotheses or hypotheses_of(screening, watch)
        effects |= refitted(hypotheses, tested)
        branch = best_branch(screening, hypotheses, found, watch)
        if isinstance(branch, Undecided):
            found = replace(found, undecided=branch)
            break
        found, base = branch.found, branch.base
        if branch.what == "instrument":  # amplitudes that were calibrated with these readings are no longer true
            effects = tested | {step.accepted: effects[step.accepted] for step in found.steps}
        earlier = found.steps[:-1] if branch.what == "effect" else found.steps
        base, found, effects = with_rivals_again(base, found, earlier, effects, watch)
        watch(Progress(SEARCHING_WITH))
        kept = branch if base is branch.base else SearchBranch(branch.what, found, base)
        screening, hypotheses = kept.screening or screen(base, found.flagged), kept.hypotheses
        model, fitted = screening.base.model, screening.base.fitted
        for step in found.steps:  # with the amplitude in the model as it is now
            one = effects[step.accepted]
            value, low, high = interval95(model, fitted, candidate_in_case(model.case, one.name).parameter)
            effects[one.name] = replace(one, amplitude=replace(one.amplitude, value=value, interval95=(low, high)))
    return assemble_diagnosis(first, screening, found, effects, held_out, laws, watch)


def best_branch(
    screening: Screening, hypotheses: Sequence[Hypothesis], found: SearchState, watch: Watch
) -> SearchBranch | Undecided:
    """What is found with the likeliest hypothesis, and the model that follows; undecided when it leads to nothing, or
    where all hypotheses together do not lead nothing by missing_odds.

    Those that are nearly as likely are followed one step further, on the case's own grid and with the best that could
    come next, see `competition`.
    """

    def with_what_is_next(one: SearchBranch, further: Screening) -> SearchBranch:
        alarmed = with_alarm(further, one.found).alarmed
        return replace(one, screening=further, hypotheses=hypotheses_of(further, watch) if alarmed else ())

    def further(one: SearchBranch) -> float:
        """ln evidence of all that would be taken next, as it competes: to first order it promises more."""
        assert one.screening is not None
        return log_odds_taken(evidence_under_larger_errors(one.screening, one.hypotheses)) if one.hypotheses else 0.0

    def prospect(one: SearchBranch) -> float:
        """ln evidence of a model and of what could come next, less that of the prior so far; of a place as it competed,
        without the error of its shape, which is there for what is found beside it.
        """
        before = found.log_prior + found.of_shape
        return log_evidence(one.base) + one.found.log_prior + one.found.of_shape - before + further(one)

    if not log_odds_taken(evidence_under_larger_errors(screening, hypotheses)):
        return Undecided(tuple(hypotheses), tuple(chances_of(hypotheses)))
    rivals = nearly_as_likely(hypotheses)
    branches = in_threads(branch_with, [(screening, hypotheses, j, found, watch) for j in rivals])
    possible = [(j, one) for j, one in zip(rivals, branches, strict=True) if one is not None]
    if len(possible) < 2:
        return possible[0][1] if possible else Undecided(tuple(hypotheses), tuple(chances_of(hypotheses)))
    screened = in_threads(screen, [(one.base, one.found.flagged) for _, one in possible])
    ends = [with_what_is_next(one, further) for (_, one), further in zip(possible, screened, strict=True)]
    evidence = np.array([prospect(one) for one in ends]) - log_evidence(screening.base)
    followed = [hypotheses[j] for j, _ in possible]
    names, chances = [one.name for one in followed], tempered_probabilities(evidence)
    undecided = undecided_of(hypotheses, names, chances)
    best = chosen_hypothesis([one.what for one in ends], evidence, chance_of_a_place(hypotheses, undecided.chances))
    if best is None:
        return undecided
    if ends[best].what == "effect":  # of one trace the likelier size leads
        group = next(one for one in ends[best].found.steps[-1].groups if names[best] in one)
        alike, readings = [j for j, name in enumerate(names) if name in group], screening.base.noise.rows.size
        left = np.array([chi2(one.base.noise, one.base.fitted.point) - 2.0 * further(one) for one in ends])
        leading = np.argmax(under_larger_errors(evidence[alike], left[alike], float(left.max()), readings))
        best = alike[int(leading)]
    taken = ends[best].found
    if ends[best].what == "effect":  # with the chances of all that was followed
        *earlier, step = taken.steps
        taken = replace(taken, steps=(*earlier, followed_further(step, names, chances)))
    elif ends[best].what == "place":  # with its odds against all that was followed
        *before, place = taken.places
        taken = replace(taken, places=(*before, place_followed_further(place, followed, best, evidence)))
    return replace(ends[best], found=taken)


def beside_excluded(base: Baseline, instrument: Instrument, found: SearchState) -> bool:
    """Whether a single reading stands side by side with one that is excluded already."""
    if instrument.kind != "reading":
        return False
    separation, own = base.noise.separation, instrument.readings[0]
    return any(0.0 < separation[row, own] < constants().neighbours_within for row in single_readings(base.noise, found))


def branch_with(
    screening: Screening, hypotheses: Sequence[Hypothesis], j: int, found: SearchState, watch: Watch
) -> SearchBranch | None:
    """What is found with one hypothesis, and the model that follows.

    An instrument is excluded, and the model calibrated without what its readings share, or without the level of the
    surveyed line; an effect or a place is taken into the model.

    Parameters
    ----------
    j : int
        Which of them.
    found : SearchState
        So far.
    watch : callable
        Is called with each phase.

    Returns
    -------
    SearchBranch or None
        None if MOST_ACCEPTED or MOST_INSTRUMENTS are accepted, it explains less than nothing does, has more than
        most_groups of rivals beside what was accepted, is a reading beside an excluded one, or no flow is found with
        it.
    """
    one, base = hypotheses[j], screening.base
    instrument = one.what if isinstance(one.what, Instrument) else None
    enough = found.accepted == MOST_ACCEPTED if instrument is None else len(found.instruments) == MOST_INSTRUMENTS
    if enough or one.log_evidence < 0.0:
        return None
    if isinstance(one.what, Instrument):
        if beside_excluded(base, one.what, found):  # neighbours that fall together are a misfit of the model
            return None
        watch(Progress(f"excluding a {one.kind} that is off"))
        if one.what.line is not None:
            if one.without is None:
                return None
            without = one.without.base
        else:
            noise = with_unknown_errors(base.noise, error_columns(one.what, base.noise.value))
            without = replace(base, noise=noise, fitted=fit(base.model, noise, base.fitted.point))
        # Its errors are all but free in the covariance: their prior is charged here, as it was in the competition.
        weight = PriorWeight(one.name, 0.0, one.log_evidence - (log_evidence(without) - log_evidence(base)))
        excluded = replace(
            found,
            instruments=(*found.instruments, instrument_found(screening, one, one.what)),
            flagged=(*found.flagged, *(row for row in one.what.readings if row not in found.flagged)),
            prior_weights=(*found.prior_weights, weight),
        )
        return SearchBranch("instrument", excluded, without)
    watch(Progress(f"calibrating with {one.name}"))
    further = calibrated_with(base, one.what)
    if further is None:
        return None
    explained = chi2(base.noise, base.fitted.point) - further.fitted.chi2
    log_prior = one.log_evidence - one.what.log_factor
    if one.kind != "effect":
        # ln evidence with the place under the errors that the model had before: less what the error of its shape takes.
        as_before = fit(further.model, base.noise, further.fitted.point)
        lost = log_evidence(replace(further, noise=base.noise, fitted=as_before)) - log_evidence(further)
        place = anomaly_found(screening, hypotheses, j, one.what)
        return SearchBranch(
            "place", found.with_place(place, PriorWeight(one.name, explained, log_prior), lost), further
        )
    step = step_found(screening, hypotheses, j, further, found.p)
    if found.accepted and len(step.groups) > constants().most_groups:
        return None
    further, unneeded = pruned(further, found.effects, watch)
    return SearchBranch("effect", found.with_step(step, unneeded, explained, log_prior), further)
