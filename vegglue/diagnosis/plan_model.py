"""What could be measured, and all that a plan needs of a case before it is measured: pieces of field work, their
stations, and flows, slopes, fingerprints and errors at several draws of the priors.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.calibration.baseline import FEWEST_CELLS_ACROSS, places_of_prior
from vegglue.calibration.candidates import (
    Candidate,
    candidates_of,
    cause_of,
)
from vegglue.calibration.model_error import (
    BED_RADIUS,
    FRICTION_RADIUS,
    gaussian_basis,
    model_error_columns,
)
from vegglue.case.channel_geometry import cells_across, expected_depth, half_width
from vegglue.case.gridded_site import build_site, in_experiment
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
from vegglue.engine.interface import Model, Point, linearise, linearise_from, responses
from vegglue.engine.model import coarser
from vegglue.errors import InputError
from vegglue.measurements.kinds import KINDS, STREAMWISE
from vegglue.measurements.observations import section_places, station_table
from vegglue.parallel import in_threads
from vegglue.results.plan import (
    PlannedPiece,
    Work,
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
