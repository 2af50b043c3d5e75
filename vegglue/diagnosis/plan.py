"""What planned measurements would show of each effect, place and instrument, and which pieces of field work to add.

A plan does what a diagnosis does, without measured values. Fingerprints of all candidates, slopes of the parameters and
the covariance of all errors (instruments, grid, model, site, bed) give the length of each fingerprint after
calibration. What a diagnosis needs to name anything gives the threshold, see `calibration/detection`. The flow is not
known yet: all of it is computed at several draws of the priors and averaged. Effects act to first order.

A line of bed levels conditions the error of the bed, a random field with a prior, and changes nothing else.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from vegglue.arrays import Array
from vegglue.calibration.candidates import (
    Candidate,
    cause_of,
    instruments_of,
    median_errors,
    offset_columns,
    plausible_offset,
)
from vegglue.calibration.detection import PLANNED_POWER, detected_length, detection_chance, single_threshold
from vegglue.calibration.fingerprints import Fingerprints, consecutive_columns, places_of
from vegglue.calibration.model_error import EFFECT_AT_PLACE
from vegglue.calibration.noise import Noise, draw_whitened_errors, noise_of, with_grid_error, with_model_error
from vegglue.calibration.residual_screening import kind_of_listed, kinds_of_instruments, kinds_of_places
from vegglue.calibration.score_test import HypothesisKind, Projected, alarm_level, project
from vegglue.case.case_effects import effect_named
from vegglue.case.channel_geometry import half_width
from vegglue.case.parameter_space import refuse_without_parameters, theta_at
from vegglue.case.schema import Case, Planned
from vegglue.decision_constants import constants
from vegglue.diagnosis.plan_model import (
    PlanModel,
    bending_of,
    plan_model,
    planned_pieces,
    possible_pieces,
    relative_lengths,
    with_chosen,
)
from vegglue.diagnosis.plan_search import NAMED_AT, chances_named, first_competition, plan_search
from vegglue.engine.interface import Model, Point, responses
from vegglue.engine.model import with_compilation
from vegglue.errors import InputError
from vegglue.normal_range import NORMAL95
from vegglue.progress import Progress, Watch, silent
from vegglue.results.plan import (
    Confusion,
    EffectsInGeneral,
    FieldPlan,
    OneEffect,
    PlaceChances,
    PlannedEffect,
    PlannedInstruments,
    PlannedParameter,
    PlannedPlaces,
    PlanQuestion,
    TwoEffects,
    hours_of,
)
from vegglue.wording.phases import COMPUTING_FINGERPRINTS, WEIGHING_ADDED, WEIGHING_PLANNED

# |cosine| from which another effect is listed as similar [-]: half of the squares of a trace are then the same.
SIMILAR_FROM = 0.7
SIMILAR_SHOWN = 3
# Sizes at which a chance is computed, down to 1e-4 of the furthest, and of the prior [-].
SIZES_TRIED, SIZES_OF_PRIOR = 120, 40
# Shapes between its settings at which an effect is thought to be, for each that has any.
SETTINGS_BETWEEN = 3
# Draws of errors alone for the alarm [-]: 50 lie beyond the 95 % point.
ALARM_DRAWS = 1000


def needed_evidence() -> float:
    """ln missing_odds: the odds against nothing at which a diagnosis names anything.

    Alarms are sounded earlier, at 0.4 to 0.9 on the sites of `configs/`.

    Returns
    -------
    float
        [-]
    """
    return float(np.log(constants().missing_odds))


def plan_measurements(
    model: Model, about: str = "", size: float | None = None, between: Sequence[str] = (), watch: Watch = silent
) -> FieldPlan:
    """What the measured and the planned stations of a case would show, and what to add.

    Parameters
    ----------
    model : Model
        Of the case at its own cells; its stations are those at hand, their values count for nothing.
    about, size : str, float
        One effect, and its size [unit of its amplitude], a plausible one if None.
    between : sequence of two str
        Effects to be told from each other.

    Raises
    ------
    InputError
        If there is nothing to calibrate, no flow is found, or an effect is unknown.
    """
    refuse_without_parameters(model.case)
    planned = model.case.planned or Planned()
    at_hand = model.station[model.station["used"]].reset_index(drop=True)
    if len(at_hand):
        noise_of(at_hand)  # raises InputError if a station states no error
    base = planned_pieces(model, planned)
    possible = possible_pieces(model, planned, at_hand, base)
    watch(Progress(with_compilation(COMPUTING_FINGERPRINTS)))
    wide = plan_model(model, planned, at_hand, base, possible)
    question = _question(wide.candidates, about, size, between)
    proposed = not len(at_hand) and not base
    if proposed:
        watch(Progress("choosing a first set"))
        search = plan_search(wide, question, planned, needed_evidence(), frozenset(), np.zeros(len(wide.candidates)))
        chosen = search.best_set(planned.hours)
        if not chosen:
            raise InputError(
                f"{model.case.name}: no measurement fits {planned.hours:g} hours of field work; raise `planned.hours`."
            )
        base = [wide.pieces[j] for j in chosen]
        wide = with_chosen(wide, chosen)
        question = _question(wide.candidates, about, size, between)
    watch(Progress(WEIGHING_PLANNED))
    shown = shown_by(wide)
    places, chances_of_places = _places(model.case, shown)
    flows = frozenset(at_hand["experiment"])
    present = flows | {one.experiment for one in base if one.experiment}
    hours = hours_of(base, planned.costs.discharge, flows)
    watch(Progress(WEIGHING_ADDED))
    search = plan_search(wide, question, planned, shown.level, present, shown.beyond)
    left = planned.hours - hours
    return FieldPlan(
        case=model.case.name,
        pieces=tuple(base),
        at_hand=len(at_hand),
        proposed=proposed,
        hours=hours,
        budget=planned.hours,
        draws=len(shown.relative),
        effects=planned_effects(wide, shown),
        places=places,
        instruments=_instruments(wide, shown),
        parameters=_parameters(model.case, shown),
        question=question,
        answer=search.start.mean,
        further=search.ranked(),
        extended=search.extended(left) if left > 0.0 else None,
        chances_of_places=chances_of_places,
    )


@dataclass(frozen=True)
class ShownByPlan:
    """The hypotheses of a diagnosis in the middle of the priors, without a residual.

    Attributes
    ----------
    noise : Noise
        Of the stations of the plan.
    kinds : tuple of HypothesisKind
        As in a screening, the first of listed effects.
    level : float
        ln of the sum of Bayes factors at which anything is named [-].
    with_places : mapping of ndarray (c,)
        Largest |cosine| with a spot, by term [-].
    with_slopes : ndarray (c, p)
        Cosine with the slopes of the parameters [-].
    visible : ndarray (c,)
        Share of a trace that calibration leaves [-].
    spread : ndarray (p,)
        Standard errors of z [standard deviations of the prior].
    lengths : tuple of ndarray (t,)
        Of the traces of each effect at the shapes that it may have [standard errors per unit of gain].
    named : ndarray (effect, lengths)
        Chance to be named at each of NAMED_AT [-].
    relative : ndarray (draws, effect)
        Length of a trace around the middle of the priors over that in the middle [-].
    """

    noise: Noise
    fingerprints: Fingerprints
    kinds: tuple[HypothesisKind, ...]
    level: float
    with_places: Mapping[str, Array]
    with_slopes: Array
    visible: Array
    spread: Array
    lengths: tuple[Array, ...]
    named: Array
    relative: Array

    @property
    def beyond(self) -> Array:
        """By how much the length that is named with even odds is above the score needed (effect,) [standard
        errors]; that of an effect that never is counts as the largest of NAMED_AT.
        """
        even = np.array([_first_at(NAMED_AT, one, 0.5) for one in self.named])
        kind = self.kinds[0]
        threshold = single_threshold(kind.size, kind.log_prior, self.level)
        own = np.array([threshold[one].min() for one in self.fingerprints.columns])
        return np.clip(even - own, 0.0, NAMED_AT[-1])


def _first_at(x: Array, chance: Array, wanted: float) -> float:
    """x from which on a chance is `wanted`, linear between the given ones; infinite if it is at none."""
    reached = np.flatnonzero(chance >= wanted)
    if not reached.size or reached[0] == 0:
        return float("inf") if not reached.size else float(x[0])
    k = int(reached[0])
    return float(x[k - 1] + (x[k] - x[k - 1]) * (wanted - chance[k - 1]) / (chance[k] - chance[k - 1]))


def shown_by(wide: PlanModel) -> ShownByPlan:
    """The screening of a diagnosis of the stations of the plan, before there is a residual."""
    known, draw = wide.known, wide.draws[0]
    station = draw.model.station.iloc[known].reset_index(drop=True)
    case = draw.model.case
    flows = {name: flow for name, flow in draw.point.flows.items() if name in set(station["experiment"])}
    there = case.model_copy(update={"experiments": {name: case.experiments[name] for name in flows}})
    model = replace(draw.model, case=there, station=station)
    point = Point(draw.point.z, draw.point.prediction[known], draw.point.slope[known], flows)
    noise = with_grid_error(noise_of(station), wide.grid_error[known] / constants().grid_error_share)
    noise = with_model_error(noise, after_survey(draw.shared, known, wide.surveyed, wide.error))
    tried = [one.settings() for one in wide.candidates]
    drawn = [SETTINGS_BETWEEN if len(settings) > 1 else 0 for settings in tried]
    columns, others = consecutive_columns([len(settings) for settings in tried]), consecutive_columns(drawn)
    settings = [(one, shapes) for one, of_it in zip(wide.candidates, tried, strict=True) for shapes in of_it]
    between = [
        (one, one.drawn_shapes(np.random.default_rng((j, k))))
        for j, one in enumerate(wide.candidates) for k in range(drawn[j])
    ]  # fmt: skip
    causes = [cause_of(draw.model.case, one, shapes) for one, shapes in (*settings, *between)]
    values = np.empty((len(station), len(causes)))
    usual = np.array([own[len(own) // 2] for own in columns])  # the middle one of each, as in the search
    new = np.setdiff1d(np.arange(len(causes)), usual)
    values[:, usual] = draw.values[known]
    values[:, new] = responses(replace(draw.model, station=station), point, [causes[k] for k in new])
    prints = Fingerprints(
        point=point,
        candidates=list(wide.candidates),
        columns=columns,
        settings=[shapes for _, shapes in settings],
        amplitudes=[one.amplitude for one, _ in settings],
        causes=causes[: len(settings)],
        values=values[:, : len(settings)],
        places=places_of(model, point, half_width(model.site)),
    )
    slope = noise.whiten(point.slope)
    nothing, z = np.zeros(len(station)), np.zeros(point.z.size)

    def against(values: Array) -> Projected:
        return project(slope, nothing, z, noise.whiten(values))

    white = noise.whiten(prints.values)
    projected = project(slope, nothing, z, white)
    in_places = {one.term: against(one.fingerprints) for one in prints.places}
    instruments = instruments_of(station)
    of_instruments = {name: against(offset_columns(some, len(station))) for name, some in instruments.items() if some}
    kinds = (
        kind_of_listed(prints, projected),
        *kinds_of_places(prints, in_places),
        *kinds_of_instruments(noise, instruments, of_instruments, ()),
    )
    errors = draw_whitened_errors(noise, ALARM_DRAWS, np.random.default_rng(1))
    level = max(alarm_level(kinds, errors, 1, constants().false_alarm_rate), needed_evidence())
    units = projected.units
    spots: dict[str, Array] = {
        str(term): np.abs(units.T @ one.units).max(axis=1, initial=0.0) for term, one in in_places.items()
    }
    whole = np.maximum(np.linalg.norm(white, axis=0), 1e-300), np.maximum(np.linalg.norm(slope, axis=0), 1e-300)
    truths = [against(values[:, len(settings) + further if further.size else own])
              for further, own in zip(others, columns, strict=True)]  # fmt: skip
    competition = first_competition(kinds, prints.columns, list(in_places), errors, level)
    return ShownByPlan(
        noise=noise,
        fingerprints=prints,
        kinds=kinds,
        level=level,
        with_places=spots,
        with_slopes=(white / whole[0]).T @ (slope / whole[1]),
        visible=projected.visible,
        spread=np.sqrt(np.diag(np.linalg.inv(slope.T @ slope + np.eye(z.size)))),
        lengths=tuple(one.length for one in truths),
        named=chances_named(competition, truths),
        relative=relative_lengths(wide),
    )


def after_survey(shared: Array, known: np.ndarray, surveyed: np.ndarray, error: Array) -> Array:
    """Columns of the shared errors of known stations, given lines of bed levels: U L, L L' = (1 + V' V / s^2)^-1."""
    if not surveyed.size:
        return shared[known]
    lines = shared[surveyed] / error[surveyed][:, None]
    _, strength, right = np.linalg.svd(lines, full_matrices=False)
    less = 1.0 - 1.0 / np.sqrt(1.0 + strength**2)
    return np.asarray(shared[known] - ((shared[known] @ right.T) * less) @ right)


def planned_effects(wide: PlanModel, shown: ShownByPlan) -> tuple[PlannedEffect, ...]:
    """Each effect, averaged over places of the priors and its shapes."""
    kind, prints = shown.kinds[0], shown.fingerprints
    cosines = np.abs(kind.projected.units.T @ kind.projected.units)
    best = [int(own[np.argmax(kind.size[own])]) for own in prints.columns]
    bending = bending_of(wide)
    quantiles = ndtri((np.arange(SIZES_OF_PRIOR) + 0.5) / SIZES_OF_PRIOR / 2.0 + 0.5)

    def effect(j: int) -> PlannedEffect:
        one, column = prints.candidates[j], best[j]
        amplitude, relative = one.amplitude, shown.relative[:, j]

        def chances(size: Array) -> Array:
            """That sizes (k,) are named, at each draw (k, draw)."""
            gain = size**amplitude.power
            bent = gain / (1.0 + bending[j] * gain / amplitude.plausible_gain)
            length = bent[:, None, None] * shown.lengths[j][:, None] * relative
            return np.asarray(np.interp(length, NAMED_AT, shown.named[j]).mean(axis=1))

        sizes = amplitude.furthest * np.geomspace(1e-4, 1.0, SIZES_TRIED)
        of_sizes = chances(sizes)
        of_prior = chances(np.minimum(amplitude.scale * quantiles, amplitude.furthest))
        of_draws = [_first_at(sizes, one, PLANNED_POWER) for one in of_sizes.T]
        others = [
            Confusion(other.name, float(cosines[column, best[k]]))
            for k, other in enumerate(prints.candidates)
            if k != j and cosines[column, best[k]] > SIMILAR_FROM
        ]
        terms = {term: float(of_spots[column]) for term, of_spots in shown.with_places.items()}
        nearest = max(terms, key=lambda term: terms[term], default="")
        parameter = int(np.argmax(np.abs(shown.with_slopes[column])))
        return PlannedEffect(
            name=one.name,
            title=one.effect.title,
            unit=amplitude.unit,
            smallest=_first_at(sizes, of_sizes.mean(axis=1), PLANNED_POWER),
            best=min(of_draws),
            worst=max(of_draws),
            plausible=amplitude.scale,
            furthest=amplitude.furthest,
            chance_plausible=float(chances(np.array([min(amplitude.scale, amplitude.furthest)])).mean()),
            chance=float(of_prior.mean()),
            visibility=float(shown.visible[column]),
            confused=tuple(sorted(others, key=lambda other: -other.cosine)[:SIMILAR_SHOWN]),
            place=Confusion(nearest, terms[nearest]) if terms.get(nearest, 0.0) > SIMILAR_FROM else None,
            parameter=wide.model.names[parameter],
            cosine=float(shown.with_slopes[column, parameter]),
        )

    found = [effect(j) for j in range(len(prints.candidates))]
    return tuple(sorted(found, key=lambda one: (-one.chance, one.name)))


def _places(case: Case, shown: ShownByPlan) -> tuple[tuple[PlannedPlaces, ...], PlaceChances | None]:
    """Each term, and the chances of the smallest spots of drag."""
    found, of_drag = [], None
    for places, kind in zip(shown.fingerprints.places, shown.kinds[1:], strict=False):
        threshold = single_threshold(kind.size, kind.log_prior, shown.level)
        smallest = detected_length(threshold) / np.maximum(kind.projected.length, 1e-300)
        chance = detection_chance(kind.size, threshold)
        unit = effect_named(case, EFFECT_AT_PLACE[places.term]).amplitude.unit
        share = float(np.mean(chance >= PLANNED_POWER)) if chance.size else 0.0
        median = float(np.median(smallest)) if smallest.size else float("inf")
        found.append(PlannedPlaces(places.term, unit, places.plausible, places.x.size, share, median))
        if places.term == "drag" and places.x.size:
            small = np.flatnonzero(places.length == places.length.min())
            of_drag = PlaceChances(
                tuple(map(float, places.x[small])), tuple(map(float, places.y[small])),
                tuple(map(float, chance[small])), float(places.length[small[0]]), float(places.width[small[0]]),
            )  # fmt: skip
    return tuple(found), of_drag


def _instruments(wide: PlanModel, shown: ShownByPlan) -> tuple[PlannedInstruments, ...]:
    station = wide.model.station.iloc[wide.known]
    instruments = instruments_of(station)
    found = []
    for kind in shown.kinds:
        of_kind = next((some for name, some in instruments.items() if name == kind.name), None)
        if not of_kind:
            continue
        error = median_errors(of_kind, shown.noise.error)
        threshold = single_threshold(kind.size, kind.log_prior, shown.level)
        threshold = np.maximum(threshold, constants().instrument_errors)
        smallest = detected_length(threshold) / np.maximum(kind.projected.length, 1e-300) / error
        plausible = plausible_offset(next(name for name in instruments if name == kind.name))
        found.append(PlannedInstruments(kind.name, len(of_kind), float(np.median(smallest)), plausible))
    return tuple(found)


def _parameters(case: Case, shown: ShownByPlan) -> tuple[PlannedParameter, ...]:
    share = shown.spread
    ends = NORMAL95 * np.array([-1.0, 1.0])
    before = theta_at(case, np.repeat(ends[:, None], share.size, axis=1))
    after = theta_at(case, ends[:, None] * share)
    return tuple(
        PlannedParameter(
            name, prior.unit, prior.meaning, float(share[j]),
            (float(before[name][0]), float(before[name][1])), (float(after[name][0]), float(after[name][1])),
        )
        for j, (name, prior) in enumerate(case.parameters.items())
    )  # fmt: skip


def _question(candidates: Sequence[Candidate], about: str, size: float | None, between: Sequence[str]) -> PlanQuestion:
    """Errors: InputError for an effect that the case cannot have, or a size that it cannot have."""
    by_name = {one.name: one for one in candidates}
    for name in (*([about] if about else []), *between):
        if name not in by_name:
            option = "--about" if name == about else "--between"
            raise InputError(f"{option}: `{name}` is not among the effects of this case: {', '.join(by_name)}.")
    if between:
        if len(set(between)) != 2 or about:
            raise InputError("--between: expected two effects and no --about; name two different ones.")
        return TwoEffects(*between)
    if about:
        amplitude = by_name[about].amplitude
        value = amplitude.off + amplitude.scale if size is None else size
        if not amplitude.low <= value <= amplitude.high or value == amplitude.off:
            raise InputError(
                f"--size: expected an amplitude of {about} within {amplitude.low:g} to {amplitude.high:g}, other than "
                f"{amplitude.off:g}, got {value:g}; give another."
            )
        return OneEffect(about, value, amplitude.unit)
    if size is not None:
        raise InputError("--size: expected it beside --about EFFECT, got it alone; name the effect.")
    return EffectsInGeneral(sum(not (one.sections or one.devices) for one in candidates))
