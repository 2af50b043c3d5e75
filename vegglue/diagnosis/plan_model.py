"""What could be measured, and all that a plan needs of a case before it is measured: pieces of field work, their
stations, and flows, slopes, fingerprints and errors at several draws of the priors.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
import pandas as pd
from scipy.linalg import hadamard

from vegglue.arrays import Array
from vegglue.calibration.baseline import FEWEST_CELLS_ACROSS, START_SPREAD
from vegglue.calibration.candidates import Candidate, candidates_of, cause_of
from vegglue.calibration.detection import own_and_shared, trace_lengths
from vegglue.calibration.fit import prediction_at
from vegglue.calibration.model_error import error_bases, model_error_columns
from vegglue.case.channel_geometry import cells_across, expected_depth
from vegglue.case.gridded_site import build_site, in_experiment
from vegglue.case.parameter_space import z_of
from vegglue.case.schema import Case, Planned, PlannedDischarge, PlannedGauge, PlannedPoint, PlannedTransect
from vegglue.case.zones import corners_of
from vegglue.decision_constants import constants
from vegglue.diagnosis.next_measurement import AS_MEASURED, with_other_discharges
from vegglue.engine.interface import (
    Cause,
    Model,
    Point,
    linearise,
    linearise_around,
    linearise_from,
    predict,
    responses,
    responses_at,
)
from vegglue.engine.model import coarser
from vegglue.engine.newton import on_half_as_many_cells
from vegglue.errors import InputError
from vegglue.measurements.kinds import KINDS, STREAMWISE
from vegglue.measurements.observations import section_places, station_table
from vegglue.parallel import in_threads, submit
from vegglue.results.plan import KIND_OF_WORK, PlannedPiece, Work

# Places around the middle of the prior at which lengths of traces are computed, on the coarsest cells [-]: of up to
# seven parameters each is varied by itself. Chosen: each costs the flows and a fingerprint of each effect.
DRAWS_AROUND = 8
# Ratio of lengths above which it is not the trace that is longer, but the coarsest cells that are too coarse [-].
LARGEST_LENGTH_RATIO = 10.0
# Stages whose effects leave shorter traces than to first order: 0.2 to 0.95 of them at a plausible size in the channel
# and the reach of docs/plan.md; at the others both signs together leave 0.97 to 1.08 of them.
BENDING_STAGES = ("plants", "resistance", "exchange", "force")
# Other discharges that are thought of, relative to the lowest one of the case; above the highest one HIGHER.
LOWER_DISCHARGES = (0.5,)
# Depth below which no velocity is measured [m]: a propeller is covered.
LEAST_PLANNED_DEPTH = 0.1
# Verticals in the water of the middle experiment where no spacing is given [-].
VERTICALS_ACROSS = 10
# Verticals of a transect from which every second of them is thought of as well.
FEWEST_DIVIDED = 5
# Places of transects that are thought of, those at patches among them, and patches in whose middle a vertical is. Along
# the reach they are twelfths: one, two, three or five transects can be equally spaced.
TWELFTHS, MOST_ADDED_PLACES, MOST_PATCHES = 12, 20, 8


@dataclass(frozen=True)
class PlanDraw:
    """A place of the prior on some cells.

    Rows are those of the stations of the plan and of what could be added, and behind them of the bed levels of lines
    that could be surveyed.

    Attributes
    ----------
    slope : ndarray (N, p)
    values : ndarray (N, k)
        Fingerprints of one setting of each candidate [unit of the row per unit of gain].
    shared : ndarray (N, q)
        Errors that rows share [unit of the row].
    """

    model: Model
    point: Point
    slope: Array
    values: Array
    shared: Array


@dataclass(frozen=True)
class PlanModel:
    """All that is needed of a case before measuring.

    Attributes
    ----------
    case : Case
        On its own cells.
    known, surveyed : ndarray of int
        Rows of the stations of the plan, and of the bed levels of its lines.
    pieces : tuple of PlannedPiece
        That could be added.
    rows : tuple of ndarray of int
        Of each of these.
    error, grid_error : ndarray (N,)
        Standard errors, and those of the grid, see `noise` [unit of the row].
    draws : tuple of PlanDraw
        The middle of the priors on the cells of the search, with every flow that is or could be measured; then the
        middle and places around it on the coarsest cells.
    errors : tuple of (ndarray, ndarray)
        Of all rows at each draw, see `errors_of`.
    at_plausible_size : ndarray (N, c, 2)
        See `bending_of`.
    """

    case: Case
    known: np.ndarray
    surveyed: np.ndarray
    pieces: tuple[PlannedPiece, ...]
    rows: tuple[np.ndarray, ...]
    error: Array
    grid_error: Array
    candidates: tuple[Candidate, ...]
    draws: tuple[PlanDraw, ...]
    errors: tuple[tuple[Array, Array], ...]
    at_plausible_size: Array

    @property
    def model(self) -> Model:
        """On the cells of the search."""
        return self.draws[0].model


def _water_across(model: Model, experiment: str, x: float) -> tuple[Array, Array]:
    """y of the cells and the expected depth there [m] of one experiment at x."""
    site = in_experiment(model.site, experiment)
    depth = expected_depth(model.case, site, model.case.experiments[experiment])
    return site.grid.y, depth[np.abs(site.grid.x - x).argmin()]


def verticals_at(
    model: Model, experiment: str, x: float, spacing: float, within: tuple[float, float] | None = None
) -> tuple[float, ...]:
    """The verticals of a transect that are under water.

    Parameters
    ----------
    x : float
        [m]
    spacing : float
        [m]
    within : (float, float), optional
        y of its ends [m], of the whole channel if not given.

    Returns
    -------
    tuple of float
        y [m], at multiples of the spacing from the middle of the channel, or from the first end of `within`, so that
        they are the same in all experiments; none in less than LEAST_PLANNED_DEPTH of water.
    """
    y, depth = _water_across(model, experiment, x)
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
    """The pieces that a case plans, one for each experiment.

    Raises
    ------
    InputError
        If a piece has no station in LEAST_PLANNED_DEPTH of water.
    """
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
            y, depth = _water_across(model, experiment, one.x)
            deep = float(np.interp(one.y, y, depth)) >= LEAST_PLANNED_DEPTH
            point = PlannedPiece(Work.POINT, experiment, one.x, (one.y,), costs.vertical, new, again)
            return point if deep else None
        case PlannedGauge():
            y, depth = _water_across(model, experiment, one.x)
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
    """Every piece that could be added, in all flows, at places along the reach and at patches, or once more.

    Parameters
    ----------
    planned : Planned
        With costs and errors.
    at_hand : DataFrame
        The used stations.
    base : sequence of PlannedPiece
        The plan as it is.

    Returns
    -------
    list of PlannedPiece
        Transects, gauges, gaugings, points and lines of bed levels; of a transect and every second of its verticals the
        whole one first.
    """
    wide = _with_flows(model, LOWER_DISCHARGES)
    low, high = model.case.grid.x
    along = np.linspace(low, high, TWELFTHS + 1)[1:-1]
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
            for x in sorted(places):
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
    y, depth = _water_across(model, experiments[len(experiments) // 2], float(grid.x[grid.x.size // 2]))
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
    """The stations of some pieces as one table.

    Parameters
    ----------
    planned : Planned
        Whose errors they have where stated, else those of the same kind at hand, else the usual ones.
    at_hand : DataFrame
        The used stations.

    Returns
    -------
    DataFrame
    list of int
        How many each piece has; a line of bed levels has none.
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
) -> PlanModel:
    """Flows, slopes, fingerprints and errors in the middle of the priors and around it.

    Parameters
    ----------
    model : Model
        On the case's own cells.
    at_hand : DataFrame
        The used stations.
    base, possible : sequence of PlannedPiece
        The plan, and what could be added.

    Raises
    ------
    InputError
        If no flow is found in the middle of the priors.
    """
    for wide in chain((_with_flows(model, lower) for lower in (LOWER_DISCHARGES, ())), [model]):
        kept = [one for one in possible if not one.experiment or one.experiment in wide.case.experiments]
        found = _plan_model(model, wide, planned, at_hand, base, kept)
        if found is not None:
            return found
    raise InputError(f"{model.case.name}: no steady flow was found in the middle of the priors; narrow the priors.")


PlaceOfPiece = tuple[Work, str, float, tuple[float, ...]]  # see `PlannedPiece.place`


def _rows_of_pieces(
    possible: Sequence[PlannedPiece],
    whole: Mapping[PlaceOfPiece, PlannedPiece],
    first: Mapping[PlaceOfPiece, int],
    level: int,
) -> tuple[np.ndarray, ...]:
    """Rows of each piece: among the stations of the whole transect, by its place, or behind them from `level` on."""
    rows = list[np.ndarray]()
    for piece in possible:
        if piece.work is Work.SURVEY_LINE:
            rows.append(np.arange(level, level + len(piece.y)))
            level += len(piece.y)
        else:
            across = whole[piece.place].y
            rows.append(first[piece.place] + np.array([across.index(y) for y in piece.y] or [0]))
    return tuple(rows)


def _usual_where_unknown(difference: Array, kind: np.ndarray) -> Array:
    """Differences of two grids (station,), those of flows that the case does not have as usual for their kind."""
    found = difference.copy()
    for name in np.unique(kind):
        known = difference[(kind == name) & np.isfinite(difference)]
        usual = float(np.sqrt(np.mean(known**2))) if known.size else 0.0
        found[(kind == name) & ~np.isfinite(difference)] = usual
    return found


def _plan_model(
    model: Model,
    wide: Model,
    planned: Planned,
    at_hand: pd.DataFrame,
    base: Sequence[PlannedPiece],
    possible: Sequence[PlannedPiece],
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
    surveyed = np.arange(len(here.station), level)
    on_coarse = coarser(here)
    # A diagnosis knows no error of the grid where cells of just twice the size do not fit.
    half = on_coarse or on_half_as_many_cells(here)
    search = half if half is not None and cells_across(half.site) >= FEWEST_CELLS_ACROSS else here
    other = here if search is on_coarse else on_coarse
    candidates = candidates_of(model.case, stations)

    def in_own_flows(one: Model) -> Model:
        flows = {name: one.case.experiments[name] for name in model.case.experiments}
        return replace(one, case=one.case.model_copy(update={"experiments": flows}))

    coarsest = in_own_flows(coarser(search) or search)
    places_of_prior = places_of_draws(len(model.names))
    middle, around = places_of_prior[0], places_of_prior[1:]
    usual = [(one, _usual_shapes(one)) for one in candidates]

    def draws(of: Model, points: Sequence[Point]) -> list[PlanDraw]:
        of_each = responses_at(of, points, _causes(of, usual)) if points else ()

        def draw(point: Point, values: Array) -> PlanDraw:
            of_model = model_error_columns(of, point, of.case.model_error)
            levels = _bed_levels(of, np.reshape(places, (-1, 2)), of_model.shape[1])
            slope = _with_rows(np.nan_to_num(point.slope), len(places))
            return PlanDraw(of, point, slope, _with_rows(values, len(places)), np.vstack([of_model, levels]))

        return in_threads(draw, list(zip(points, of_each, strict=True)))

    def draws_around(below: Point) -> list[PlanDraw]:
        near = [below, *linearise_around(coarsest, around, below)]
        return draws(coarsest, [one for one in near if one is not None])

    below = linearise(coarsest, middle)
    # Beside what follows: on few cells most is done by the interpreter, on many by compiled loops.
    on_coarsest = None if below is None else submit(draws_around, below)
    start = linearise_from(search, middle, None if coarsest.site is search.site else below)
    if start is None:
        return None
    near_start = start if search is on_coarse else None
    there = None if other is None else prediction_at(in_own_flows(other), middle, near_start)
    difference = np.zeros(len(here.station))
    if there is not None:  # its sign is of no matter
        difference = _usual_where_unknown(there - start.prediction, here.station["kind"].to_numpy())
    of_stations = here.station["standard_error"].to_numpy(float)
    error = np.concatenate([of_stations, np.full(len(places), planned.errors.survey)])
    grid_error = constants().grid_error_share * np.concatenate([difference, np.zeros(len(places))])
    of_search = draws(search, [start])
    changes = None if below is None else _at_plausible_size(coarsest, below, candidates)
    unknown = np.full((len(here.station), len(candidates), 2), np.nan)
    every = (*of_search, *(on_coarsest() if on_coarsest else ()))
    return PlanModel(
        case=model.case,
        known=np.arange(len(stations)),
        surveyed=surveyed,
        pieces=tuple(possible),
        rows=_rows_of_pieces(possible, whole, first, level),
        error=error,
        grid_error=grid_error,
        candidates=tuple(candidates),
        draws=every,
        errors=tuple(in_threads(errors_of, [(error, grid_error, one.slope, one.shared) for one in every])),
        at_plausible_size=_with_rows(unknown if changes is None else changes, len(places)),
    )


def _usual_shapes(candidate: Candidate) -> dict[str, float]:
    """The middle one of its settings."""
    settings = candidate.settings()
    return settings[len(settings) // 2]


def errors_of(error: Array, grid_error: Array, slope: Array, shared: Array) -> tuple[Array, Array]:
    """Variances of some rows, and what calibration and shared errors can do there.

        C = diag(s^2 + (1 - c) g^2) + [c^(1/2) g, A] [c^(1/2) g, A]'

    Parameters
    ----------
    error, grid_error : ndarray (n,)
        s and g, standard errors and those of the grid [unit of the row].
    slope : ndarray (n, p)
    shared : ndarray (n, k)
        A, errors that rows share [unit of the row].

    Returns
    -------
    variance : ndarray (n,)
        Of the errors that each row has of its own [unit of the row squared].
    nuisances : ndarray (n, q)
        The slopes, and patterns of the shared errors behind them.
    """
    correlation = constants().grid_error_correlation
    together = np.column_stack([np.sqrt(correlation) * grid_error, shared])
    variance, patterns = own_and_shared(error**2 + (1.0 - correlation) * grid_error**2, together)
    return variance, np.hstack([slope, patterns])


def errors_at(wide: PlanModel, draw: PlanDraw, rows: np.ndarray) -> tuple[Array, Array]:
    """`errors_of` some rows at a draw."""
    return errors_of(wide.error[rows], wide.grid_error[rows], draw.slope[rows], draw.shared[rows])


def relative_lengths(wide: PlanModel) -> Array:
    """|S| around the middle of the priors over |S| in the middle, on the coarsest cells.

    Returns
    -------
    ndarray (draws, candidates)
        [-]; ones, of one draw, if no flow is found there.
    """
    rows = np.concatenate([wide.known, wide.surveyed])

    def lengths(draw: PlanDraw) -> Array:
        variance, nuisances = errors_at(wide, draw, rows)
        return trace_lengths(variance, nuisances, draw.values[rows])

    if len(wide.draws) < 3:
        return np.ones((1, len(wide.candidates)))
    return ratios_of_lengths(np.array(in_threads(lengths, [(draw,) for draw in wide.draws[1:]])))


def ratios_of_lengths(lengths: Array) -> Array:
    """Lengths of all but the first over those of the first, within LARGEST_LENGTH_RATIO either way.

    Parameters
    ----------
    lengths : ndarray (draws, ...)

    Returns
    -------
    ndarray (draws - 1, ...)
        [-]; 1 of what leaves next to no trace in the first.
    """
    middle, around = lengths[0], lengths[1:]
    ratio = np.clip(around / np.maximum(middle, 1e-300), 1.0 / LARGEST_LENGTH_RATIO, LARGEST_LENGTH_RATIO)
    return np.asarray(np.where(middle > 1e-9, ratio, 1.0))


def _at_plausible_size(model: Model, point: Point, candidates: Sequence[Candidate]) -> Array:
    """Changes of predictions by each candidate at a plausible size, up and down (n, c, 2), 0 in flows that the point
    does not have; NaN where there is no flow, the size is not possible, or the stage is none of BENDING_STAGES.
    """
    here = np.flatnonzero(model.station["experiment"].isin(list(point.flows)))
    station = model.station.iloc[here].reset_index(drop=True)
    found = np.full((len(model.station), len(candidates), 2), np.nan)

    def change(j: int, one: Candidate) -> None:
        amplitude, cause = one.amplitude, cause_of(model.case, one, _usual_shapes(one))
        sizes = amplitude.off + min(amplitude.scale, amplitude.furthest) * np.array([1.0, -1.0])
        prior = cause.case.parameters[cause.parameter]
        possible = np.flatnonzero((amplitude.low <= sizes) & (sizes <= amplitude.high))
        z = np.array([[*point.z, z_of(prior, float(size))] for size in sizes[possible]])
        there = predict(replace(model, case=cause.case, station=station), [point], z)
        found[:, j, possible] = 0.0
        found[np.ix_(here, np.array([j]), possible)] = (there - point.prediction[here]).T[:, None]

    in_threads(change, [(j, one) for j, one in enumerate(candidates) if one.effect.stage in BENDING_STAGES])
    return found


def bending_of(wide: PlanModel) -> Array:
    """|S(g)| = |S'| |g| / (1 + b |g| / g_p): b, by how much a trace is shorter than to first order, the longer it is.

    g_p is the gain of a plausible size, S' the fingerprint. b is that of the flow with the effect at that size, the
    mean of both signs, on the coarsest cells in the middle of the priors, at the stations of the plan, or at all that
    are possible if it has none.

    Returns
    -------
    ndarray (candidates,)
        b >= 0 [-]; 0 if no flow is known, or the trace is longer.
    """
    if len(wide.draws) < 2:
        return np.zeros(len(wide.candidates))
    draw, rows = wide.draws[1], np.concatenate([wide.known, wide.surveyed])
    if not rows.size:
        rows = np.unique(np.concatenate(wide.rows))
    variance, nuisances = errors_at(wide, draw, rows)
    amplitudes = [one.amplitude for one in wide.candidates]
    gains = np.array([min(one.scale, one.furthest) ** one.power for one in amplitudes])
    traces = np.hstack([draw.values * gains, *np.moveaxis(np.nan_to_num(wide.at_plausible_size), 2, 0)])
    lengths = trace_lengths(variance, nuisances, traces[rows])
    first_order, *whole = lengths.reshape(3, -1)
    known = np.isfinite(wide.at_plausible_size).all(axis=0)
    mean = np.sum(whole, axis=0) / np.maximum(known.sum(axis=1), 1)
    return np.where(mean > 0.0, np.maximum(first_order / np.maximum(mean, 1e-300) - 1.0, 0.0), 0.0)


def places_of_draws(parameters: int) -> Array:
    """The middle of the prior, and corners around it.

    Of every pair of parameters, up to seven of them, both are high, low or opposed equally often.

    Parameters
    ----------
    parameters : int
        p, how many there are.

    Returns
    -------
    ndarray (DRAWS_AROUND + 1, p)
        z, START_SPREAD up or down [standard deviations of the prior].

    References
    ----------
    Plackett and Burman (1946), doi:10.1093/biomet/33.4.305; not checked against it.
    """
    number = np.arange(parameters)
    corners = hadamard(DRAWS_AROUND)[:, 1 + number % (DRAWS_AROUND - 1)] * (-1.0) ** (number // (DRAWS_AROUND - 1))
    return START_SPREAD * np.vstack([np.zeros(parameters), corners])


def _causes(model: Model, wanted: Sequence[tuple[Candidate, dict[str, float]]]) -> list[Cause]:
    return [cause_of(model.case, one, shapes) for one, shapes in wanted]


def _with_rows(values: Array, count: int) -> Array:
    """With as many rows of bed levels, which no flow changes."""
    return np.vstack([values, np.zeros((count, *values.shape[1:]))])


def with_chosen(wide: PlanModel, chosen: Sequence[int]) -> PlanModel:
    """With some of its pieces in the plan, and with the effects that act in sections which these bring.

    Parameters
    ----------
    chosen : sequence of int
        Of its pieces.

    Returns
    -------
    PlanModel
        Without these pieces and others of their places.
    """
    pieces = [wide.pieces[j] for j in chosen]
    lines = [rows for one, rows in zip(pieces, (wide.rows[j] for j in chosen), strict=True)
             if one.work is Work.SURVEY_LINE]  # fmt: skip
    others = [wide.rows[j] for j, one in zip(chosen, pieces, strict=True) if one.work is not Work.SURVEY_LINE]
    known = np.concatenate([wide.known, *others])
    used = np.zeros(len(wide.model.station), dtype=bool)
    used[known] = True
    station = wide.model.station.assign(used=used)
    candidates = candidates_of(wide.case, station[used])
    before = {one.name: j for j, one in enumerate(wide.candidates)}
    new = [one for one in candidates if one.name not in before]
    order = np.argsort([before.get(one.name, len(before)) for one in candidates], kind="stable")
    candidates = [candidates[j] for j in order]
    kept = [before[one.name] for one in candidates if one.name in before]
    count = wide.error.size - len(station)
    unknown = np.full((wide.error.size, len(new), 2), np.nan)  # effects of sections change readings alone

    def with_new(draw: PlanDraw) -> PlanDraw:
        model = replace(draw.model, station=station)
        causes = _causes(model, [(one, _usual_shapes(one)) for one in new])
        values = _with_rows(responses(model, draw.point, causes), count)
        return replace(draw, model=model, values=np.hstack([draw.values[:, kept], values]))

    draws = tuple(in_threads(with_new, [(one,) for one in wide.draws]))
    taken = {one.place for one in pieces}
    left = [j for j, one in enumerate(wide.pieces) if one.place not in taken]
    return replace(
        wide,
        known=known,
        surveyed=np.concatenate([wide.surveyed, *lines]).astype(int),
        pieces=tuple(wide.pieces[j] for j in left),
        rows=tuple(wide.rows[j] for j in left),
        candidates=tuple(candidates),
        draws=draws,
        at_plausible_size=np.concatenate([wide.at_plausible_size[:, kept], unknown], axis=1),
    )


def _bed_levels(model: Model, places: Array, count: int) -> Array:
    """The bed's own error at places (place, 2): its part of `count` columns of `model_error_columns`, where its basis
    functions stand behind those of friction (place, count) [m].
    """
    found = np.zeros((len(places), count))
    if not places.size:
        return found
    friction, bed = error_bases(model)
    along = np.exp(-(((places[:, :1] - bed.x) / bed.length) ** 2))
    across = np.exp(-(((places[:, 1:] - bed.y) / bed.width) ** 2))
    variance = (bed.along**2).sum(axis=0).mean() * (bed.across**2).sum(axis=0).mean()
    of_bed = (along[:, :, None] * across[:, None, :]).reshape(len(places), -1)
    first = friction.x.size * friction.y.size
    found[:, first : first + of_bed.shape[1]] = model.case.model_error.bed / np.sqrt(variance) * of_bed
    return found
