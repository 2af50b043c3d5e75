"""Before anyone measures: what planned measurements would show of each effect, place and instrument, and which pieces
of field work to add.

Everything a diagnosis would do with the measurements is done without their values: fingerprints of all candidates,
slopes of the parameters, and the covariance of all errors (of instruments, grid, model, site and bed) give the length
of each fingerprint after calibration, the alarm of the diagnosis gives the threshold, see `calibration/detection`. All
of it is computed at several draws of the priors, as the flow is not known before, and averaged. Effects act to first
order.

A line of bed levels measures the bed's own error, which is a field with a prior: its rows are further measurements of
that field, and make no other difference. Pieces are added by their gain for an hour, and exchanged one by one while
that helps (Fedorov 1972; not checked against it).
"""

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import chain, pairwise

import numpy as np
import pandas as pd

from vegglue.arrays import Array, Mask
from vegglue.calibration.baseline import FEWEST_CELLS_ACROSS, places_of_prior
from vegglue.calibration.candidates import (
    Candidate,
    candidates_of,
    cause_of,
    instruments_of,
    offset_columns,
    plausible_offset,
)
from vegglue.calibration.detection import (
    PLANNED_POWER,
    Information,
    alarm_thresholds,
    chance_over_prior,
    chance_to_separate,
    detected_length,
    detection_chance,
    information,
    lowest,
    own_and_shared,
    single_threshold,
    trace_distances,
)
from vegglue.calibration.fingerprints import EFFECT_AT_PLACE, Fingerprints, Places, places_of
from vegglue.calibration.model_error import (
    BED_RADIUS,
    FRICTION_RADIUS,
    gaussian_basis,
    model_error_columns,
)
from vegglue.calibration.noise import (
    Noise,
    draw_whitened_errors,
    noise_of,
    with_grid_error,
    with_model_error,
)
from vegglue.calibration.residual_screening import GROUPS, kind_of_listed, kinds_of_instruments, kinds_of_places
from vegglue.calibration.score_test import HypothesisKind, Projected, alarm_level, project
from vegglue.case.case_effects import effect_named
from vegglue.case.channel_geometry import cells_across, expected_depth, half_width
from vegglue.case.gridded_site import build_site, in_experiment
from vegglue.case.parameter_space import refuse_without_parameters, theta_at
from vegglue.case.schema import (
    Case,
    Planned,
    PlannedDischarge,
    PlannedGauge,
    PlannedPoint,
    PlannedTransect,
)
from vegglue.case.zones import corners_of
from vegglue.decision_constants import constants
from vegglue.diagnosis.next_measurement import AS_MEASURED, SECTIONS, with_other_discharges
from vegglue.effects.definition import Amplitude
from vegglue.engine.interface import Model, Point, linearise, linearise_from, responses
from vegglue.engine.model import coarser
from vegglue.errors import InputError
from vegglue.measurements.kinds import KINDS, STREAMWISE
from vegglue.measurements.observations import section_places, station_table
from vegglue.normal_range import NORMAL95
from vegglue.parallel import in_threads
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
    PlannedPiece,
    PlannedPlaces,
    PlanQuestion,
    ProposedPieces,
    TwoEffects,
    Work,
    hours_of,
)
from vegglue.results.plan_files import KIND_OF_WORK

# Places of the prior at which a plan is computed [-]. Chosen: each costs the flows and all fingerprints.
PRIOR_PLACES = 3
# Other discharges that are thought of, relative to the lowest one of the case; above the highest one HIGHER.
LOWER_DISCHARGES = (0.5,)
# Depth below which no velocity is measured [m]: a propeller is covered.
LEAST_PLANNED_DEPTH = 0.1
# Verticals in the water of the middle experiment where no spacing is given [-].
VERTICALS_ACROSS = 10
# Verticals of a transect from which every second of them is thought of as well.
FEWEST_DIVIDED = 5
# Places of transects that are thought of, those at patches among them, and patches in whose middle a vertical is.
MOST_ADDED_PLACES, MOST_PATCHES = 20, 8
# |cosine| from which another effect is listed as similar [-]: half of the squares of a trace are then the same.
SIMILAR_FROM = 0.7
SIMILAR_SHOWN = 3
# ln of the sum of Bayes factors at which a diagnosis is alarmed, before any measurement says so [-]: between 0.4 and
# 0.9 on the sites of `configs/`.
USUAL_ALARM = 0.6
# Draws of errors alone for the alarm [-]: 50 lie beyond the 95 % point.
ALARM_DRAWS = 1000
# Proposals of one kind that are shown, and of all; those that are looked at again in a search, and rounds of exchange.
OF_A_KIND, ADDITIONS_SHOWN, ADDITIONS_WEIGHED, ADDING_ROUNDS = 2, 8, 12, 2
# Rise of the answer to a question below which a piece adds nothing [-].
LEAST_PLAN_GAIN = 1e-3


@dataclass(frozen=True)
class PlanDraw:
    """A place of the prior: the slopes (N, p), fingerprints (N, c) and shared errors (N, k) of all rows: stations of
    the plan and of what could be added, and behind them the bed levels of lines that could be surveyed.
    """

    point: Point
    slope: Array
    values: Array
    shared: Array


@dataclass(frozen=True)
class PlanModel:
    """All that is needed of a case before measuring.

    model: on the cells of the search, with every station that is or could be measured and every flow; count: how many
    of them are of the plan, which come first; rows: of each piece that could be added, surveyed levels behind the
    stations; error (N,): standard errors; grid_error (N,), see `noise`.
    """

    model: Model
    count: int
    pieces: tuple[PlannedPiece, ...]
    rows: tuple[np.ndarray, ...]
    error: Array
    grid_error: Array
    candidates: tuple[Candidate, ...]
    draws: tuple[PlanDraw, ...]


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
    watch : Watch

    Returns
    -------
    FieldPlan

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
    watch(Progress("computing flows and fingerprints"))
    wide = plan_model(model, planned, at_hand, base, possible)
    question = _question(wide.candidates, about, size, between)
    proposed = not len(at_hand) and not base
    level = USUAL_ALARM
    if proposed:
        watch(Progress("choosing a first set"))
        search = plan_search(wide, question, planned, level, frozenset())
        chosen = search.best_set(planned.hours)
        if not chosen:
            raise InputError(
                f"{model.case.name}: no measurement fits {planned.hours:g} hours of field work; raise `planned.hours`."
            )
        base = [wide.pieces[j] for j in chosen]
        taken = {one.place for one in base}
        others = [one for one in wide.pieces if one.place not in taken]
        wide = plan_model(model, planned, at_hand, base, others, wide)
        question = _question(wide.candidates, about, size, between)
    watch(Progress("weighing what they show"))
    shown = [shown_by(wide, one) for one in wide.draws]
    level = shown[0].level
    costs = planned.costs
    present = frozenset(at_hand["experiment"]) | {one.experiment for one in base if one.experiment}
    hours = hours_of(base, costs.discharge, frozenset(at_hand["experiment"]))
    watch(Progress("weighing what could be added"))
    search = plan_search(wide, question, planned, level, present)
    further = search.ranked()
    left = planned.hours - hours
    extended = search.extended(left) if left > 0.0 else None
    return FieldPlan(
        case=model.case.name,
        pieces=tuple(base),
        at_hand=len(at_hand),
        proposed=proposed,
        hours=hours,
        budget=planned.hours,
        draws=len(wide.draws),
        effects=_effects(wide, shown),
        places=_places(model.case, shown),
        instruments=_instruments(wide, shown[0]),
        parameters=_parameters(model.case, shown),
        question=question,
        answer=search.start.mean,
        further=further[:ADDITIONS_SHOWN],
        extended=extended,
        chances_of_places=_chances_of_drag(shown),
    )


def water_across(model: Model, experiment: str, x: float) -> tuple[Array, Array]:
    """y of the cells and the expected depth there [m] of one experiment at x."""
    site = in_experiment(model.site, experiment)
    depth = expected_depth(model.case, site, model.case.experiments[experiment])
    return site.grid.y, depth[np.abs(site.grid.x - x).argmin()]


def verticals_at(
    model: Model, experiment: str, x: float, spacing: float, within: tuple[float, float] | None = None
) -> tuple[float, ...]:
    """y of the verticals of a transect [m] that are under water: at multiples of the spacing from the middle of the
    channel, or from the first end of `within`, so that they are the same in all experiments.
    """
    y, depth = water_across(model, experiment, x)
    low, high = (float(y[0]), float(y[-1])) if within is None else within
    start = low if within is not None else 0.5 * (low + high)
    steps = np.arange(np.ceil((low - start) / spacing - 1e-9), np.floor((high - start) / spacing + 1e-9) + 1.0)
    places = np.round(start + spacing * steps, 3)
    deep = np.interp(places, y, depth) >= LEAST_PLANNED_DEPTH
    return tuple(float(one) for one in places[deep])


def place_along(case: Case, x: float) -> float:
    """x of a section to a decimetre, or to a centimetre on a reach of 20 m at most [m]: a boat does not hold it."""
    return round(float(x), 1 if case.grid.x[1] - case.grid.x[0] > 20.0 else 2)


def planned_pieces(model: Model, planned: Planned) -> list[PlannedPiece]:
    """The pieces that a case plans, one for each experiment. Raises InputError if one has no station under water."""
    found = []
    for one in planned.pieces:
        for experiment in one.experiments or tuple(model.case.experiments):
            piece = _piece(model, planned, one, experiment)
            if piece is None:
                raise InputError(
                    f"{model.case.name}: `planned` expected water of {LEAST_PLANNED_DEPTH:g} m at x = {one.x:g} m in "
                    f"{experiment}, got none; correct the place, or name the `experiments` it is for."
                )
            found.append(piece)
    return found


def _piece(
    model: Model,
    planned: Planned,
    one: PlannedTransect | PlannedPoint | PlannedGauge | PlannedDischarge,
    experiment: str,
    new: bool = False,
    again: bool = False,
) -> PlannedPiece | None:
    costs = planned.costs
    match one:
        case PlannedTransect():
            places = verticals_at(model, experiment, one.x, one.spacing, one.y)
            hours = costs.transect + len(places) * costs.vertical
            return PlannedPiece(Work.TRANSECT, experiment, one.x, places, hours, new, again) if places else None
        case PlannedPoint():
            y, depth = water_across(model, experiment, one.x)
            deep = float(np.interp(one.y, y, depth)) >= LEAST_PLANNED_DEPTH
            point = PlannedPiece(Work.POINT, experiment, one.x, (one.y,), costs.vertical, new, again)
            return point if deep else None
        case PlannedGauge():
            y, depth = water_across(model, experiment, one.x)
            wet = y[depth >= LEAST_PLANNED_DEPTH]
            if one.y is None and not wet.size:
                return None
            middle = round(float(0.5 * (wet[0] + wet[-1])), 2) if one.y is None else one.y
            return PlannedPiece(Work.GAUGE, experiment, one.x, (middle,), costs.gauge, new, again)
        case PlannedDischarge():
            return PlannedPiece(Work.DISCHARGE, experiment, one.x, (), costs.gauging, new, again)


def possible_pieces(
    model: Model, planned: Planned, at_hand: pd.DataFrame, base: Sequence[PlannedPiece]
) -> list[PlannedPiece]:
    """Every piece that could be added: transects, gauges, gaugings and points in all flows, at places along the reach
    and at patches; lines of bed levels; and what is measured or planned again.
    """
    wide = _with_flows(model, LOWER_DISCHARGES)
    low, high = model.case.grid.x
    along = np.linspace(low, high, SECTIONS + 2)[1:-1]
    near = AS_MEASURED * float(along[1] - along[0])
    velocity = at_hand[at_hand["kind"] == STREAMWISE]
    measured: dict[float, tuple[str, ...]] = {}
    for (experiment, at), _ in velocity.assign(x=section_places(velocity)).groupby(["experiment", "x"]):
        x = place_along(model.case, at)
        measured[x] = (*measured.get(x, ()), str(experiment))
    for one in base:
        if one.work is Work.TRANSECT:
            measured[one.x] = (*measured.get(one.x, ()), one.experiment)
    patches = [corners_of(model.case, patch)[:, 0] for patch in model.case.plants.patches]
    beside = [x for ends in patches for x in (0.5 * (ends.min() + ends.max()), ends.max() + 0.5 * np.ptp(ends))]
    places = list(measured)
    for x in (*along, *beside):
        x = place_along(model.case, x)
        if low < x < high and len(places) < MOST_ADDED_PLACES and all(abs(x - other) > near for other in places):
            places.append(x)
    spacing = _usual_spacing(wide, planned, velocity)
    found: list[PlannedPiece | None] = []
    for experiment in wide.case.experiments:
        new = experiment not in model.case.experiments
        for x in sorted(places):
            again = experiment in measured.get(x, ())
            piece = _piece(wide, planned, PlannedTransect(x=x, spacing=spacing), experiment, new, again)
            found.append(piece)
            if piece is not None and not again and len(piece.y) >= FEWEST_DIVIDED:  # every second vertical
                some = piece.y[(len(piece.y) // 2) % 2 :: 2]
                found.append(replace(piece, y=some, hours=planned.costs.transect + len(some) * planned.costs.vertical))
        if not new:
            middle = 0.5 * (low + high)
            for x in sorted(places)[::2]:
                found.append(_piece(wide, planned, PlannedGauge(x=x), experiment))
            found.append(_piece(wide, planned, PlannedDischarge(x=place_along(model.case, middle)), experiment))
            for ends in model.case.plants.patches[:MOST_PATCHES]:
                x, y = corners_of(model.case, ends).mean(axis=0)
                point = PlannedPoint(x=round(float(x), 2), y=round(float(y), 2))
                found.append(_piece(wide, planned, point, experiment))
    if model.case.model_error.bed:
        y = model.site.grid.y
        line = tuple(float(one) for one in np.round(np.arange(y[0], y[-1] + 1e-9, spacing), 3))
        for x in sorted(places):
            found.append(PlannedPiece(Work.SURVEY_LINE, "", x, line, planned.costs.survey_line))
    return [one for one in found if one is not None]


def _usual_spacing(model: Model, planned: Planned, velocity: pd.DataFrame) -> float:
    """Of the planned transects, else of the measured ones, else for VERTICALS_ACROSS in the water."""
    if planned.transects:
        return float(np.median([one.spacing for one in planned.transects]))
    if not velocity.empty:
        across = [np.diff(np.unique(one["y"])) for _, one in velocity.groupby(["experiment", "section"])]
        steps = np.concatenate(across)
        if steps.size:
            return float(np.median(steps))
    experiments = list(model.case.experiments)
    grid = model.site.grid
    y, depth = water_across(model, experiments[len(experiments) // 2], float(grid.x[grid.x.size // 2]))
    wet = y[depth >= LEAST_PLANNED_DEPTH]
    width = float(np.ptp(wet)) if wet.size > 1 else float(np.ptp(y))
    return float(f"{width / VERTICALS_ACROSS:.1g}")


def _with_flows(model: Model, lower: Sequence[float]) -> Model:
    """The model with the flows that could be measured besides, `lower` ones and HIGHER."""
    case = with_other_discharges(model, lower)
    return model if case is model.case else replace(model, case=case, site=build_site(case))


def stations_of(
    model: Model, planned: Planned, pieces: Sequence[PlannedPiece], at_hand: pd.DataFrame
) -> tuple[pd.DataFrame, list[int]]:
    """The stations of some pieces as one table, and how many each has; a line of bed levels has none. Their errors are
    the stated ones, else those of the same kind at hand, else the usual ones.
    """
    middle = 0.5 * (model.case.grid.y[0] + model.case.grid.y[1])
    error: dict[str, float] = {}
    for kind in set(KIND_OF_WORK.values()):
        stated = getattr(planned.errors, kind, None)
        there = at_hand.loc[at_hand["kind"] == kind, "standard_error"].dropna()
        usual = float(there.median()) if len(there) else KINDS[kind].usual_error
        error[kind] = usual if stated is None else stated
    rows = [
        (piece.experiment, KIND_OF_WORK[piece.work], "points" if piece.work is Work.POINT else f"x{piece.x:g}",
         piece.x, y, error[KIND_OF_WORK[piece.work]])
        for piece in pieces if piece.work is not Work.SURVEY_LINE
        for y in piece.y or (middle,)
    ]  # fmt: skip
    table = pd.DataFrame(rows, columns=["experiment", "kind", "section", "x", "y", "standard_error"])
    table = table.assign(value=0.0, used=True, reason="", depth=np.nan, device="")
    counts = [0 if piece.work is Work.SURVEY_LINE else max(len(piece.y), 1) for piece in pieces]
    return station_table(table), counts


def plan_model(
    model: Model,
    planned: Planned,
    at_hand: pd.DataFrame,
    base: Sequence[PlannedPiece],
    possible: Sequence[PlannedPiece],
    known: PlanModel | None = None,
) -> PlanModel:
    """Flows, slopes, fingerprints and errors at several draws of the priors; known: of other pieces of the same case.

    Errors: InputError if no flow is found.
    """
    for wide in chain((_with_flows(model, lower) for lower in (LOWER_DISCHARGES, ())), [model]):
        kept = [one for one in possible if not one.experiment or one.experiment in wide.case.experiments]
        found = _plan_model(model, wide, planned, at_hand, base, kept, () if known is None else known.draws)
        if found is not None:
            return found
    raise InputError(f"{model.case.name}: no steady flow was found in the middle of the priors; narrow the priors.")


def _plan_model(
    model: Model,
    wide: Model,
    planned: Planned,
    at_hand: pd.DataFrame,
    base: Sequence[PlannedPiece],
    possible: Sequence[PlannedPiece],
    known: Sequence[PlanDraw],
) -> PlanModel | None:
    stations = station_table(at_hand, stations_of(wide, planned, base, at_hand)[0])
    # A transect with every second vertical is made of stations of the whole one, which stands first.
    whole = {one.place: one for one in reversed(possible)}
    own = [one for one in possible if whole[one.place] is one]
    further, counts = stations_of(wide, planned, own, at_hand)
    here = replace(wide, station=station_table(stations, further.assign(used=False)))
    # Bed levels stand behind all stations, those of the plan first.
    places = [(one.x, y) for one in (*base, *possible) if one.work is Work.SURVEY_LINE for y in one.y]
    first = dict(zip((one.place for one in own), np.cumsum([len(stations), *counts])[:-1], strict=True))
    level = len(here.station) + sum(len(one.y) for one in base if one.work is Work.SURVEY_LINE)
    rows = list[np.ndarray]()
    for piece in possible:
        if piece.work is Work.SURVEY_LINE:
            rows.append(np.arange(level, level + len(piece.y)))
            level += len(piece.y)
        else:
            across = whole[piece.place].y
            rows.append(first[piece.place] + np.array([across.index(y) for y in piece.y] or [0]))
    on_coarse = coarser(here)
    search = on_coarse if on_coarse is not None and cells_across(on_coarse.site) >= FEWEST_CELLS_ACROSS else here
    other = here if search is on_coarse else on_coarse
    candidates = candidates_of(model.case, stations)
    causes = [cause_of(search.case, one, shapes) for one in candidates for shapes in one.settings()]
    middle, *others = places_of_prior(len(model.names))[:PRIOR_PLACES]
    coarsest = None if search is here else coarser(search)

    def in_own_flows(one: Model) -> Model:
        flows = {name: one.case.experiments[name] for name in model.case.experiments}
        return replace(one, case=one.case.model_copy(update={"experiments": flows}))

    def settled(of: Model, z: Array, near: Point | None = None) -> Point | None:
        """The point at z, from a known one, or from the flow on still coarser cells, which costs a part of it."""
        for one in known:
            if np.array_equal(one.point.z, z) and one.point.flows.keys() == of.case.experiments.keys():
                return linearise_from(of, z, one.point)
        below = coarsest if coarsest is None or of is search else in_own_flows(coarsest)
        return linearise_from(of, z, near if below is None else linearise(below, z))

    start = settled(search, middle)
    if start is None:
        return None
    # Flows that the case does not have are computed in the middle of the priors alone, and have the usual grid error.
    own_search = in_own_flows(search)
    difference = np.zeros(len(here.station))
    if other is not None:
        kept = list[Array]()

        def without_slopes(prediction: Array) -> bool:
            kept.append(prediction)
            return False

        linearise(in_own_flows(other), middle, start if search is on_coarse else None, without_slopes)
        if kept:
            difference = kept[0] - start.prediction  # its sign is of no matter
            kind = here.station["kind"].to_numpy()
            for name in np.unique(kind):
                known_there = difference[(kind == name) & np.isfinite(difference)]
                usual = float(np.sqrt(np.mean(known_there**2))) if known_there.size else 0.0
                difference[(kind == name) & ~np.isfinite(difference)] = usual
    of_stations = here.station["standard_error"].to_numpy(float)
    error = np.concatenate([of_stations, np.full(len(places), planned.errors.survey)])

    def draw(of: Model, point: Point) -> PlanDraw:
        shared = model_error_columns(of, point, of.case.model_error)
        levels = _bed_levels(search, np.reshape(places, (-1, 2)), shared.shape[1])
        below = np.zeros((len(places), len(causes)))
        return PlanDraw(
            point,
            np.vstack([np.nan_to_num(point.slope), np.zeros((len(places), point.slope.shape[1]))]),
            np.vstack([responses(of, point, causes), below]),
            np.vstack([shared, levels]),
        )

    points = in_threads(settled, [(own_search, z, start) for z in others])
    draws = in_threads(draw, [(search, start), *((own_search, one) for one in points if one is not None)])
    grid_error = constants().grid_error_share * np.concatenate([difference, np.zeros(len(places))])
    return PlanModel(
        search, len(stations), tuple(possible), tuple(rows), error, grid_error, tuple(candidates), tuple(draws)
    )


def _bed_levels(model: Model, places: Array, count: int) -> Array:
    """The bed's own error at places (place, 2): its part of `count` columns of `model_error_columns`, where its basis
    functions stand behind those of friction (place, count) [m].
    """
    found = np.zeros((len(places), count))
    if not places.size:
        return found
    half, grid = half_width(model.site), model.site.grid
    friction = gaussian_basis(grid, FRICTION_RADIUS * half, FRICTION_RADIUS * half)
    bed = gaussian_basis(grid, BED_RADIUS * half, BED_RADIUS * half)
    along = np.exp(-(((places[:, :1] - bed.x) / bed.length) ** 2))
    across = np.exp(-(((places[:, 1:] - bed.y) / bed.width) ** 2))
    variance = (bed.along**2).sum(axis=0).mean() * (bed.across**2).sum(axis=0).mean()
    of_bed = (along[:, :, None] * across[:, None, :]).reshape(len(places), -1)
    first = friction.x.size * friction.y.size
    found[:, first : first + of_bed.shape[1]] = model.case.model_error.bed / np.sqrt(variance) * of_bed
    return found


@dataclass(frozen=True)
class ShownByPlan:
    """The hypotheses of a diagnosis at one draw, without a residual: kinds as in a screening, the first of listed
    effects; thresholds: of each column of these (c,); level: of the alarm; cosines with spots (c,) by term, and with
    slopes (c, p); spread (p,): standard errors of z.
    """

    noise: Noise
    fingerprints: Fingerprints
    kinds: tuple[HypothesisKind, ...]
    thresholds: Array
    level: float
    with_places: Mapping[str, Array]
    with_slopes: Array
    visible: Array
    spread: Array


def shown_by(wide: PlanModel, draw: PlanDraw) -> ShownByPlan:
    """The screening of a diagnosis of the stations of the plan, before there is a residual."""
    known = np.arange(wide.count)
    station = wide.model.station.iloc[known].reset_index(drop=True)
    case = wide.model.case
    flows = {name: flow for name, flow in draw.point.flows.items() if name in set(station["experiment"])}
    there = case.model_copy(update={"experiments": {name: case.experiments[name] for name in flows}})
    model = replace(wide.model, case=there, station=station)
    point = Point(draw.point.z, draw.point.prediction[known], draw.point.slope[known], flows)
    noise = with_grid_error(noise_of(station), wide.grid_error[known] / constants().grid_error_share)
    of_pieces = np.concatenate([np.zeros(0, dtype=int), *wide.rows])
    surveyed = np.setdiff1d(np.arange(len(wide.model.station), len(draw.shared)), of_pieces)
    noise = with_model_error(noise, _after_survey(draw.shared, known, surveyed, wide.error))
    settings = [(one, shapes) for one in wide.candidates for shapes in one.settings()]
    sizes = [len(one.settings()) for one in wide.candidates]
    ends = np.cumsum([0, *sizes])
    prints = Fingerprints(
        point=point,
        candidates=list(wide.candidates),
        columns=[np.arange(a, b) for a, b in pairwise(ends)],
        settings=[shapes for _, shapes in settings],
        amplitudes=[one.amplitude for one, _ in settings],
        causes=[],
        values=draw.values[known],
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
    level = alarm_level(kinds, errors, 1, constants().false_alarm_rate)
    units = projected.units
    spots: dict[str, Array] = {
        str(term): np.abs(units.T @ one.units).max(axis=1, initial=0.0) for term, one in in_places.items()
    }
    lengths = np.maximum(np.linalg.norm(white, axis=0), 1e-300), np.maximum(np.linalg.norm(slope, axis=0), 1e-300)
    return ShownByPlan(
        noise=noise,
        fingerprints=prints,
        kinds=kinds,
        thresholds=alarm_thresholds(kinds[0], prints.columns, level),
        level=level,
        with_places=spots,
        with_slopes=(white / lengths[0]).T @ (slope / lengths[1]),
        visible=projected.visible,
        spread=np.sqrt(np.diag(np.linalg.inv(slope.T @ slope + np.eye(z.size)))),
    )


def _after_survey(shared: Array, known: np.ndarray, surveyed: np.ndarray, error: Array) -> Array:
    """Columns of the shared errors of known stations, given lines of bed levels: U L, L L' = (1 + V' V / s^2)^-1."""
    if not surveyed.size:
        return shared[known]
    lines = shared[surveyed] / error[surveyed][:, None]
    _, strength, right = np.linalg.svd(lines, full_matrices=False)
    less = 1.0 - 1.0 / np.sqrt(1.0 + strength**2)
    return np.asarray(shared[known] - ((shared[known] @ right.T) * less) @ right)


def _effects(wide: PlanModel, shown: Sequence[ShownByPlan]) -> tuple[PlannedEffect, ...]:
    """Each effect, averaged over draws and settings of its shapes."""
    kinds, prints = [one.kinds[0] for one in shown], shown[0].fingerprints
    cosines = np.mean([np.abs(kind.projected.units.T @ kind.projected.units) for kind in kinds], axis=0)
    size = np.mean([kind.size for kind in kinds], axis=0)
    best = [int(own[np.argmax(size[own])]) for own in prints.columns]

    def effect(j: int) -> PlannedEffect:
        one, own, column = prints.candidates[j], prints.columns[j], best[j]
        amplitude = one.amplitude
        length = np.array([kind.projected.length[own] for kind in kinds])
        threshold = np.array([part.thresholds[own] for part in shown])

        def chances(size: float) -> Array:
            """That a size is detected, of each draw."""
            gain = abs(size) ** amplitude.power
            return np.asarray(detection_chance(gain * length, threshold, amplitude.only_sign).mean(axis=1))

        def chance_at(size: float, draw: int) -> float:
            return float(chances(size)[draw])

        of_draws = [_smallest(partial(chance_at, draw=d), amplitude.furthest) for d in range(len(shown))]
        others = [
            Confusion(other.name, float(cosines[column, best[k]]))
            for k, other in enumerate(prints.candidates)
            if k != j and cosines[column, best[k]] > SIMILAR_FROM
        ]
        terms = {term: float(np.mean([part.with_places[term][column] for part in shown])) for term in
                 shown[0].with_places}  # fmt: skip
        nearest = max(terms, key=lambda term: terms[term], default="")
        with_slopes = np.mean([part.with_slopes[column] for part in shown], axis=0)
        parameter = int(np.argmax(np.abs(with_slopes)))
        return PlannedEffect(
            name=one.name,
            title=one.effect.title,
            unit=amplitude.unit,
            smallest=_smallest(lambda size: float(chances(size).mean()), amplitude.furthest),
            best=min(of_draws),
            worst=max(of_draws),
            plausible=amplitude.scale,
            furthest=amplitude.furthest,
            chance_plausible=float(chances(min(amplitude.scale, amplitude.furthest)).mean()),
            chance=float(chance_over_prior(np.array([kind.size[own] for kind in kinds]), threshold).mean()),
            visibility=float(np.mean([part.visible[column] for part in shown])),
            confused=tuple(sorted(others, key=lambda other: -other.cosine)[:SIMILAR_SHOWN]),
            place=Confusion(nearest, terms[nearest]) if terms.get(nearest, 0.0) > SIMILAR_FROM else None,
            parameter=wide.model.names[parameter],
            cosine=float(with_slopes[parameter]),
        )

    found = [effect(j) for j in range(len(prints.candidates))]
    return tuple(sorted(found, key=lambda one: (-one.chance, one.name)))


def _smallest(chance: Callable[[float], float], furthest: float) -> float:
    """The size at which a chance that rises with it is PLANNED_POWER; infinite if it is not within `furthest`."""
    if not chance(furthest) >= PLANNED_POWER:
        return float("inf")

    def enough(log: Array) -> Mask:
        return np.array(chance(float(np.exp(log))) >= PLANNED_POWER)

    return float(np.exp(lowest(enough, np.log(1e-9 * furthest), np.log(furthest))))


def _chances_at_places(shown: Sequence[ShownByPlan]) -> list[tuple[Places, Array, Array]]:
    """Of each term: its spots at the first draw, the chance that a plausible size is detected, and the size that is."""
    found = []
    for position, places in enumerate(shown[0].fingerprints.places):
        chance, smallest = [], []
        for part in shown:
            kind = part.kinds[1 + position]
            if kind.size.size != places.x.size:  # other places are under water at this draw
                continue
            threshold = single_threshold(kind.size, kind.log_prior, part.level)
            chance.append(detection_chance(kind.size, threshold))
            length = np.maximum(kind.projected.length, 1e-300)
            smallest.append(detected_length(threshold) / length)
        found.append((places, np.mean(chance, axis=0), np.median(smallest, axis=0)))
    return found


def _places(case: Case, shown: Sequence[ShownByPlan]) -> tuple[PlannedPlaces, ...]:
    return tuple(
        PlannedPlaces(
            places.term,
            effect_named(case, EFFECT_AT_PLACE[places.term]).amplitude.unit,
            places.plausible,
            places.x.size,
            float(np.mean(chance >= PLANNED_POWER)) if chance.size else 0.0,
            float(np.median(smallest)) if smallest.size else float("inf"),
        )
        for places, chance, smallest in _chances_at_places(shown)
    )


def _chances_of_drag(shown: Sequence[ShownByPlan]) -> PlaceChances | None:
    """Of the smallest spots of drag."""
    for places, chance, _ in _chances_at_places(shown):
        if places.term == "drag" and places.x.size:
            small = np.flatnonzero(places.length == places.length.min())
            return PlaceChances(
                tuple(map(float, places.x[small])), tuple(map(float, places.y[small])),
                tuple(map(float, chance[small])), float(places.length[small[0]]), float(places.width[small[0]]),
            )  # fmt: skip
    return None


def _instruments(wide: PlanModel, shown: ShownByPlan) -> tuple[PlannedInstruments, ...]:
    station = wide.model.station.iloc[: wide.count]
    instruments = instruments_of(station)
    found = []
    for kind in shown.kinds:
        of_kind = next((some for name, some in instruments.items() if name == kind.name), None)
        if not of_kind:
            continue
        error = np.array([np.median(shown.noise.error[list(one.readings)]) for one in of_kind])
        threshold = single_threshold(kind.size, kind.log_prior, shown.level)
        threshold = np.maximum(threshold, constants().instrument_errors)
        smallest = detected_length(threshold) / np.maximum(kind.projected.length, 1e-300) / error
        plausible = plausible_offset(next(name for name in instruments if name == kind.name))
        found.append(PlannedInstruments(kind.name, len(of_kind), float(np.median(smallest)), plausible))
    return tuple(found)


def _parameters(case: Case, shown: Sequence[ShownByPlan]) -> tuple[PlannedParameter, ...]:
    share = np.mean([one.spread for one in shown], axis=0)
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


def plan_search(
    wide: PlanModel, question: PlanQuestion, planned: Planned, level: float, present: frozenset[str]
) -> "PlanSearch":
    """The search for pieces to add to the stations of the plan."""
    match question:
        case OneEffect():
            kept = [j for j, one in enumerate(wide.candidates) if one.name == question.name]
        case TwoEffects():
            kept = [j for j, one in enumerate(wide.candidates) if one.name in (question.first, question.second)]
        case EffectsInGeneral():  # those of a section or a device are others with each piece
            kept = [j for j, one in enumerate(wide.candidates) if not (one.sections or one.devices)]
    candidates = [wide.candidates[j] for j in kept]
    ends = np.cumsum([0, *(len(one.settings()) for one in wide.candidates)])
    counts = [len(one.settings()) for one in candidates]
    columns = np.concatenate([np.arange(ends[j], ends[j + 1]) for j in kept])
    gains = np.repeat([one.amplitude.plausible_gain for one in candidates], counts)
    of_pieces = np.concatenate([np.zeros(0, dtype=int), *wide.rows])
    own = np.setdiff1d(np.arange(wide.error.size), of_pieces)
    correlation = constants().grid_error_correlation
    base, pieces = [], []
    for draw in wide.draws:
        shared = np.column_stack([np.sqrt(correlation) * wide.grid_error, draw.shared])
        variance, patterns = own_and_shared(wide.error**2 + (1.0 - correlation) * wide.grid_error**2, shared)
        nuisances, traces = np.hstack([draw.slope, patterns]), draw.values[:, columns] * gains
        base.append(information(variance, nuisances, traces, own))
        pieces.append(tuple(information(variance, nuisances, traces, rows) for rows in wide.rows))
    return PlanSearch(
        wide=wide,
        question=question,
        level=level,
        present=present,
        another=planned.costs.discharge,
        names=tuple(one.name for one in candidates),
        amplitudes=tuple(one.amplitude for one in candidates),
        owner=np.repeat(np.arange(len(candidates)), counts),
        signs=np.repeat([one.amplitude.only_sign for one in candidates], counts),
        log_prior=np.full(columns.size, -np.log(GROUPS * len(wide.candidates))),
        base=tuple(base),
        of_pieces=tuple(pieces),
    )


@dataclass(frozen=True)
class PlanAnswer:
    """The answer to a question [-], the mean over all draws and the least of them."""

    mean: float
    least: float


@dataclass(frozen=True)
class PlanSearch:
    """What the search for pieces to add knows: the information of the plan and of each piece at each draw, and of the
    traces that the question is about their effects by number, names, amplitudes and ln priors; present: flows that are
    measured in anyhow; another: hours of another one; level: of the alarm.
    """

    wide: PlanModel
    question: PlanQuestion
    level: float
    present: frozenset[str]
    another: float
    names: tuple[str, ...]
    amplitudes: tuple[Amplitude, ...]
    owner: np.ndarray
    signs: np.ndarray
    log_prior: Array
    base: tuple[Information, ...]
    of_pieces: tuple[tuple[Information, ...], ...]

    @cached_property
    def start(self) -> PlanAnswer:
        """The answer without a further piece."""
        return self.answer(self.base)

    @cached_property
    def sections(self) -> frozenset[float]:
        """Where velocities are measured or planned along the reach, see `place_along`."""
        known = self.wide.model.station.iloc[: self.wide.count]
        velocity = known[known["kind"] == STREAMWISE]
        return frozenset(place_along(self.wide.model.case, x) for x in section_places(velocity).unique())

    def answer(self, known: Sequence[Information]) -> PlanAnswer:
        """The answer to the question with some information at each draw [-]."""
        found = np.array([self._answer(one) for one in known])
        return PlanAnswer(float(found.mean()), float(found.min()))

    def _answer(self, known: Information) -> float:
        if isinstance(self.question, TwoEffects):
            visible = known.visible()
            distance = trace_distances(visible)
            first, second = (np.flatnonzero(self.owner == self.names.index(name)) for name in
                             (self.question.first, self.question.second))  # fmt: skip
            return float(chance_to_separate(np.minimum(distance, distance.T)[np.ix_(first, second)].min()))
        size = known.lengths()
        threshold = single_threshold(size, self.log_prior, self.level)
        if isinstance(self.question, OneEffect):
            amplitude = self.amplitudes[0]
            relative = abs(amplitude.gain(self.question.size)) / amplitude.plausible_gain
            return float(detection_chance(relative * size, threshold, self.signs).mean())
        chance = chance_over_prior(size, threshold)
        return float((np.bincount(self.owner, chance) / np.bincount(self.owner)).sum())

    def with_pieces(self, known: Sequence[Information], pieces: Sequence[int]) -> list[Information]:
        """The information with some pieces more, at each draw."""
        found = list(known)
        for d, of in enumerate(self.of_pieces):
            for j in pieces:
                found[d] = found[d] + of[j]
        return found

    def hours(self, pieces: Sequence[int], present: frozenset[str]) -> float:
        """Of some pieces together, beside flows that are measured in anyhow."""
        return hours_of([self.wide.pieces[j] for j in pieces], self.another, present)

    def moves(self, chosen: Sequence[int]) -> list[tuple[int, ...]]:
        """What could be added at once: each piece, and for each flow without measurements the places of the others."""
        pieces = self.wide.pieces
        taken = {pieces[j].place for j in chosen}
        free = [j for j, one in enumerate(pieces) if one.place not in taken]
        found: list[tuple[int, ...]] = [(j,) for j in free]
        present = self.present | {pieces[j].experiment for j in chosen}
        case = self.wide.model.case
        there = self.sections | {place_along(case, pieces[j].x) for j in chosen if pieces[j].work is Work.TRANSECT}
        for flow in case.experiments:
            if flow in present:
                continue
            together = [
                j for j in free if pieces[j].experiment == flow and pieces[j].work is Work.TRANSECT
                and place_along(case, pieces[j].x) in there
            ]  # fmt: skip
            # Of a transect and the same with every second vertical the whole one, which stands first.
            together = list({pieces[j].x: j for j in reversed(together)}.values())[::-1]
            found += [tuple(together[:count]) for count in (2, 3, 5, 8) if len(together) >= count]
        return found

    def ranked(self) -> tuple[ProposedPieces, ...]:
        """Single additions to the plan by what they add in an hour: the best few of each kind of work, of repeats, and
        of flows that the case does not have, as far as they add something.
        """
        found = []
        for move in self.moves(()):
            known = self.with_pieces(self.base, move)
            after = self.answer(known)
            if any(self.wide.pieces[j].new for j in move):  # known at the first draw alone
                gain = self.answer(known[:1]).mean - self.answer(self.base[:1]).mean
                after = PlanAnswer(self.start.mean + gain, self.start.least)
            if after.mean - self.start.mean > LEAST_PLAN_GAIN:
                found.append(self._proposed(move, after))
        found.sort(key=lambda one: -one.per_hour)
        kinds = [(one.pieces[0].work, one.pieces[0].again, one.pieces[0].new, len(one.pieces) > 1) for one in found]
        return tuple(one for j, one in enumerate(found) if kinds[:j].count(kinds[j]) < OF_A_KIND)

    def _proposed(self, move: Sequence[int], after: PlanAnswer) -> ProposedPieces:
        pieces = tuple(self.wide.pieces[j] for j in move)
        return ProposedPieces(pieces, self.hours(move, self.present), self.start.mean, after.mean, after.least)

    def extended(self, budget: float) -> ProposedPieces | None:
        """The best set to add for so many hours; None if nothing fits."""
        chosen = self.best_set(budget)
        return self._proposed(chosen, self.answer(self.with_pieces(self.base, chosen))) if chosen else None

    def best_set(self, budget: float) -> list[int]:
        """Pieces that fit a budget [h]: greedy by gain for an hour, in any flows and in each flow alone, of which the
        best is exchanged piece by piece while that helps.
        """

        def worth(pieces: Sequence[int]) -> float:
            return self.answer(self.with_pieces(self.base, pieces)).mean

        flows = [one for one in self.wide.model.case.experiments if one not in self.present]
        starts = [None, *({*self.present, one} for one in flows if len(flows) > 1)]
        best = max((self._greedy(budget, [], start) for start in starts), key=worth)
        before = worth(best)
        for _ in range(ADDING_ROUNDS):
            for j in list(best):
                again = self._greedy(budget, [k for k in best if k != j])
                if (now := worth(again)) > before + LEAST_PLAN_GAIN:
                    best, before = again, now
                    break
            else:
                break
        return best

    def _greedy(self, budget: float, chosen: list[int], flows: Set[str] | None = None) -> list[int]:
        """flows: in which alone work is done, beside that which is of no flow; None for all."""
        known = self.with_pieces(self.base, chosen)
        now = self.answer(known).mean
        promised: dict[tuple[int, ...], float] = {}
        while True:
            spent = self.hours(chosen, self.present)
            # A flow that the case does not have cannot be ordered: it is shown, and not planned.
            moves = [move for move in self.moves(chosen) if not any(self.wide.pieces[j].new for j in move)]
            if flows is not None:
                allowed = {*flows, ""}
                moves = [move for move in moves if all(self.wide.pieces[j].experiment in allowed for j in move)]
            possible = {move: self.hours([*chosen, *move], self.present) - spent for move in moves}
            possible = {move: hours for move, hours in possible.items() if spent + hours <= budget + 1e-9}
            # What a piece adds hardly ever grows: those that added less before are looked at last (lazy greedy).
            order = sorted(possible, key=lambda move: -promised.get(move, np.inf) / possible[move])
            best, best_rate = None, LEAST_PLAN_GAIN / budget
            for looked, move in enumerate(order):
                if move in promised and (promised[move] / possible[move] <= best_rate or looked >= ADDITIONS_WEIGHED):
                    break
                promised[move] = self.answer(self.with_pieces(known, move)).mean - now
                if promised[move] / possible[move] > best_rate:
                    best, best_rate = move, promised[move] / possible[move]
            if best is None:
                return chosen
            chosen = [*chosen, *best]
            known = self.with_pieces(known, best)
            now = self.answer(known).mean
