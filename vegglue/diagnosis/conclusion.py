"""What a diagnosis concludes from its first and its last screening, as the values it is kept and told in."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from vegglue.calibration import score_test
from vegglue.calibration.baseline import Baseline, log_evidence
from vegglue.calibration.fit import chance_of_misfit, chi2, freedom_of_misfit, interval95
from vegglue.calibration.law_screening import LawScreening
from vegglue.calibration.noise import with_correlation
from vegglue.calibration.residual_screening import Screening
from vegglue.calibration.score_test import kind_named
from vegglue.case.case_effects import parameters_of_effects
from vegglue.case.channel_geometry import half_width
from vegglue.decision_constants import constants
from vegglue.diagnosis.between_sections import largest_error_between
from vegglue.diagnosis.candidate_effects import candidate_effects_of, not_excluded
from vegglue.diagnosis.causes_in_words import places_told
from vegglue.diagnosis.child_config import candidate_at
from vegglue.diagnosis.field_scan import best_field, free_of_prior, log_density_of_residual, map_of_field
from vegglue.diagnosis.measured_stretch import stretch_in_words
from vegglue.diagnosis.misfit_zones import misfit_zones
from vegglue.diagnosis.places_on_map import places_on_map_in_words
from vegglue.diagnosis.search_state import SearchState
from vegglue.diagnosis.tempered_probabilities import tempering
from vegglue.diagnosis.unlisted_laws import candidate_laws, clearly_a_law, law_goes_first
from vegglue.diagnosis.unseen import UnseenErrors, unseen_errors
from vegglue.diagnosis.verdict import make_verdict
from vegglue.diagnosis.verdict_inputs import VerdictInputs
from vegglue.engine.interface import Model
from vegglue.inference.weighted_statistics import root_mean_square
from vegglue.measurements.kinds import velocity_rows
from vegglue.measurements.section_discharge import mismatched_discharges
from vegglue.results.diagnosis import (
    CandidateEffect,
    Diagnosis,
    EstimatedErrors,
    FieldFound,
    FieldMapKept,
    FirstScreening,
    LocalAnomaly,
    Misfit,
    ModelErrorUsed,
    ParameterEstimates,
    PlaceMap,
    Predictions,
)
from vegglue.version import VERSION

# Chance that errors alone make any effect look as strong, below which one is told as standing out: the rate of the
# alarm beside what was accepted (`diagnose`), which places, instruments and slack may keep silent all the same.
STANDS_OUT = 0.01
# Effects whose likeness is kept, the strongest of the first screening.
COMPARED = 12
# Spacings of a section [-] within which two readings stand side by side: neighbours are about one apart, others two.
NEIGHBOURS_WITHIN = 1.5
# Shares of the allowed model error of which the likelihood is computed [-].
ERROR_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0, 6.0, 9.0)


def assemble_diagnosis(
    first: Screening,
    last: Screening,
    found: SearchState,
    candidate_effects: Mapping[str, CandidateEffect],
    unseen: Model | None,
    laws_beside_first: Callable[[], LawScreening | None],
) -> Diagnosis:
    """The diagnosis; candidate_effects: of every effect by its name; unseen: the model where nothing was calibrated."""
    laws = candidate_laws(first, last, found, laws_beside_first)
    if found.places and not found.steps and not found.instruments and clearly_a_law(laws):
        # What competed after the place did so in the flow with it.
        found = replace(found, places=(), prior_weights=(), of_shape=0.0, undecided=None)
        last, candidate_effects = first, candidate_effects_of(first)
    found = replace(found, places=tuple(as_calibrated(one, last.base) for one in found.places))
    ranked = tuple(
        sorted(candidate_effects.values(), key=lambda one: (not one.amplitude.refitted, -(one.test.score**2)))
    )
    misfit = misfit_of(first, last, found.flagged)
    field, field_map = (None, None) if law_goes_first(laws, found) else _field(first, last, found, misfit)
    inputs = replace(_inputs(last, found, misfit, unseen), field=field, laws=laws)
    base, before = last.base, first.base
    return Diagnosis(
        name=before.model.case.name,
        version=VERSION,
        verdict=make_verdict(inputs, ranked),
        candidate_effects=ranked,
        steps=found.steps,
        misfit=misfit,
        errors=inputs.errors,
        first_screening=_first_screening(first),
        parameters=_parameters(before, base),
        predictions=Predictions(
            station=before.model.station,
            first=before.fitted.point.prediction,
            last=base.fitted.point.prediction,
            error=base.noise.among_all(base.noise.data_error, len(base.model.station)),
        ),
        place_map=_place_map(first, found),
        places=found.places,
        instruments=found.instruments,
        field=field,
        model_error=inputs.model_error,
        field_map=field_map,
        laws=laws,
    )


def as_calibrated(place: LocalAnomaly, base: Baseline) -> LocalAnomaly:
    """The place with its amplitude in the last model, in which what was accepted after it is calibrated, too."""
    parameter = candidate_at(base.model.case, place).parameter
    value, low, high = interval95(base.model, base.fitted, parameter)
    return replace(place, amplitude=value, interval95=(low, high))


def _inputs(last: Screening, found: SearchState, misfit: Misfit, unseen: Model | None) -> VerdictInputs:
    """What the verdict rests on, but for fields and laws."""
    silent = not (found.steps or found.places or found.undecided)
    beside = significant_effects(last, found)
    there = unseen_errors(last.base, unseen) if silent and unseen is not None else UnseenErrors(float("nan"), 1.0)
    model = last.base.model
    return VerdictInputs(
        errors=estimated_errors(last, found),
        misfit=misfit,
        state=found,
        field=None,
        model_error=_model_error(last),
        not_excluded=() if found.absurd else not_excluded(last),
        unseen=there.ratio,
        by_chance=there.by_chance,
        neighbours=_neighbours_aside(last, found),
        strained=_strained(last),
        between=largest_error_between(last.base) if silent else 1.0,
        stretch=stretch_in_words(model.case, model.station),
        on_map=places_on_map_in_words(model.case, places_told(found)),
        places_searched=any(one.x.size for one in last.fingerprints.places),
        carried=tuple(mismatched_discharges(model.case, model.site, model.station)),
        significant_effects=beside,
        remainder=bool(beside) and not significant_effects(last, found, found.slack),
    )


def significant_effects(last: Screening, found: SearchState, slack: float = 0.0) -> dict[str, float]:
    """Effects that stand out in the last model and are not in it, with the family-wise p of each [-].

    slack: by how much their scores are made smaller first [standard errors].
    """
    chances = {
        one.name: last.effects.p_of(max(abs(last.best_score(j)) - slack, 0.0))
        for j, one in enumerate(last.fingerprints.candidates)
    }
    return {name: p for name, p in chances.items() if p < STANDS_OUT and name not in found.effects}


def misfit_of(first: Screening, last: Screening, flagged: tuple[int, ...]) -> Misfit:
    """chi2 before and after, and where the first model misses."""
    before, after = first.base, last.base
    misfit = chi2(after.noise, after.fitted.point)
    readings = after.noise.rows.size - int(np.linalg.matrix_rank(after.noise.unknown))
    freedom = freedom_of_misfit(readings, after.fitted.covariance)
    # The errors that are told: those of the last model, whose residual holds the least that is no error.
    errors_as_last = with_correlation(before.noise, after.noise.correlation, after.noise.scale)
    return Misfit(
        chi2_first=chi2(before.noise, before.fitted.point),
        chi2=misfit,
        freedom=freedom,
        p=chance_of_misfit(misfit, freedom),
        zones=misfit_zones(before.model, errors_as_last, before.fitted.point, flagged),
    )


def _parameters(before: Baseline, after: Baseline) -> ParameterEstimates:
    return ParameterEstimates(
        {name: interval95(before.model, before.fitted, name)[0] for name in before.model.names},
        {name: interval95(after.model, after.fitted, name) for name in after.model.names},
    )


def estimated_errors(screening: Screening, found: SearchState) -> EstimatedErrors:
    """What the errors are taken to be after the last screening; that of the grid is told of velocities alone [m/s]."""
    noise = screening.base.noise
    flagged = tuple(int(noise.rows[row]) for row in found.flagged)
    velocity = velocity_rows(screening.base.model.station.iloc[noise.rows])
    return EstimatedErrors(noise.correlation, noise.scale, root_mean_square(noise.grid_error[velocity]), flagged)


def _model_error(screening: Screening) -> ModelErrorUsed | None:
    """By how much the model may be wrong, and the share of it that the residual makes likeliest; None where none is
    allowed.
    """
    search, allowed = screening.search, screening.base.model.case.model_error
    noise = search.noise
    if not noise.model_error.any():
        return None
    whole, residual = free_of_prior(search)
    logs = [log_density_of_residual(whole + (share**2 - 1.0) * noise.model_error, residual) for share in ERROR_SHARES]
    best = int(np.argmax(logs))
    gained = float(logs[best] - logs[ERROR_SHARES.index(1.0)])
    return ModelErrorUsed(allowed.friction, allowed.bed, ERROR_SHARES[best], gained)


def _field(
    first: Screening, last: Screening, found: SearchState, misfit: Misfit
) -> tuple[FieldFound, FieldMapKept] | tuple[None, None]:
    """A smooth field of one term and its map, where it explains the misfit of the first model better than all that was
    accepted, or closes a misfit in which nothing was; None where there is nothing to explain, or where a place of the
    same term says it in fewer words.
    """
    if found.absurd or (not (found.accepted or found.undecided) and misfit.p >= constants().poor_fit_chance):
        return None, None
    screening = first if found.accepted else last
    best, responses = best_field(screening.search, half_width(screening.base.model.site))
    gained = found.gained(log_evidence(first.base), log_evidence(last.base)) if found.accepted else 0.0
    undecided = found.undecided.hypotheses if found.undecided else ()
    gained = max([gained, *(one.log_evidence for one in undecided)])
    told_as_place = {"friction" if place.term == "drag" else place.term for place in found.places}
    if not field_goes_first(best.log_factor, gained) or best.term in told_as_place:
        return None, None
    mapped, grid = map_of_field(screening.search, responses, best), responses.grid
    i, j = np.unravel_index(int(np.argmax(np.abs(mapped.value) / np.maximum(mapped.error, 1e-300))), mapped.value.shape)
    most = FieldFound(
        term=best.term,
        size=best.size,
        length=best.over.length,
        width=best.over.width,
        log_factor=best.log_factor,
        value=float(mapped.value[i, j]),
        error=float(mapped.error[i, j]),
        x=float(grid.x[i]),
        y=float(grid.y[j]),
    )
    return most, FieldMapKept(grid.x, grid.y, mapped.value, mapped.error)


def field_goes_first(log_factor: float, gained: float) -> bool:
    """Whether a field beats nothing, and all that was accepted, by field_odds; both as ln evidence [-]."""
    ahead = (log_factor - max(gained, 0.0)) / tempering(np.array(log_factor))
    return bool(ahead > np.log(constants().field_odds))


def _neighbours_aside(screening: Screening, found: SearchState) -> bool:
    """Whether two single readings were set aside that stand side by side in one section."""
    single = [one.stations[0] for one in found.instruments if len(one.stations) == 1]
    noise = screening.base.noise
    rows = [int(np.flatnonzero(noise.rows == station)[0]) for station in single]
    return any(0.0 < noise.separation[a, b] < NEIGHBOURS_WITHIN for a in rows for b in rows)


def _strained(screening: Screening) -> tuple[str, float]:
    """The calibrated parameter, other than the amplitude of an effect, that lies furthest from the middle of its prior,
    and how far [standard deviations].
    """
    model, z = screening.base.model, screening.base.fitted.point.z
    of_effects = parameters_of_effects(model.case)
    own = [(abs(float(z[j])), name) for j, name in enumerate(model.names) if name not in of_effects]
    far, name = max(own, default=(0.0, ""))
    return name, far


def _first_screening(screening: Screening) -> FirstScreening:
    candidates, strongest = screening.fingerprints.candidates, screening.ranking[:COMPARED]
    columns = [screening.best_column(j) for j in strongest]
    return FirstScreening(
        threshold=screening.effects.threshold(constants().effect_alarm_rate),
        scores={one.name: screening.best_score(j) for j, one in enumerate(candidates)},
        compared=tuple(candidates[j].name for j in strongest),
        cosine=score_test.cosines(screening.projected)[np.ix_(columns, columns)],
    )


def _place_map(screening: Screening, found: SearchState) -> PlaceMap:
    """Scores of the term of the first place that was found, else of drag, before anything was accepted."""
    term = found.places[0].term if found.places else "drag"
    places = next(one for one in screening.fingerprints.places if one.term == term)
    scores = kind_named(screening.kinds, term).scores
    return PlaceMap(term, places.x, places.y, scores)
