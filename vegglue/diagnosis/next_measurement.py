"""The next measurement: which one would separate rival explanations, and how much it would gain per hour of work.

Rival i, fitted to the data at hand, predicts new measurements; rival j predicts others, after it has been calibrated to
all of them. What is left between both,

    D^2 = |(I - P_[J, S_j]) S_i a_i|^2,

in squared standard errors, is the gain of the log-likelihood ratio (times two) that i would win over j by measuring.
j may be the model without any effect: then D^2 says whether i would be seen at all.

A survey measures no flow, and makes the model err less: a further line at cells with the columns B_l of the bed's error
takes F (B_l' (B_l B_l' + s^2 I)^-1 B_l) F' from the covariance, F the responses to these columns and s the error of a
surveyed point; polygons walked again take what their sides leave.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import scipy.linalg

from vegglue.arrays import Array
from vegglue.calibration.candidates import Candidate, cause_of
from vegglue.calibration.model_error import cell_responses, model_error_columns, site_error_columns
from vegglue.calibration.noise import Noise
from vegglue.case.bed import read_bed_survey
from vegglue.case.bed_error import bed_error_columns
from vegglue.case.channel_geometry import expected_depth
from vegglue.case.gridded_site import in_experiment
from vegglue.case.schema import Case, ModelError, Planned
from vegglue.engine.interface import Model, Point, linearise_from, responses
from vegglue.measurements.kinds import STREAMWISE, WATER_LEVEL, kind_of, velocity_rows
from vegglue.measurements.observations import section_places, station_table
from vegglue.wording.numbers import in_digits
from vegglue.wording.sentences import phrase

# How near to a line of bed levels a new one is the same [m], and hours of work by which outlines of plants are taken
# with a total station. Chosen.
SAME_LINE, OUTLINES = 1.0, 2.0
# Places along the reach where a section is thought of, and how near to one that was measured it is that one, over the
# distance between these places. Chosen, not measured.
SECTIONS, AS_MEASURED = 12, 0.3
# Other discharges, relative to the lowest and to the highest one at hand, with the outlet level that goes with them
# (h ~ Q^0.6). A quarter brings plants to the surface, where what depends on speed or depth leaves other traces.
LOWER, HIGHER = (0.25, 0.5), (1.4,)
LEVEL_POWER = 0.6


@dataclass(frozen=True)
class MeasurementPlan:
    """One measurement that could be made.

    Attributes
    ----------
    rows : ndarray of int
        Of its stations in the extended table.
    stations : DataFrame
        Empty for a survey.
    hours : float
        Cost [h].
    x : float
        Where [m].
    experiment : str
        In which; '' of a survey.
    less : ndarray (station, k) or None
        Columns L of a survey that takes L L' from the covariance [unit of the station].
    """

    name: str
    rows: np.ndarray
    stations: pd.DataFrame
    hours: float
    x: float
    experiment: str
    less: Array | None = None


@dataclass(frozen=True)
class MeasurementWorth:
    """What a measurement would bring.

    Attributes
    ----------
    now, then : ndarray (rival,)
        The least D^2 between each rival and any other, now and with it [-].
    """

    plan: MeasurementPlan
    now: Array
    then: Array


Explanation = tuple[Candidate, dict[str, float], float]


def worth_of_measurements(
    model: Model, noise: Noise, here: Point, questions: Sequence[Sequence[Explanation]]
) -> list[list[MeasurementWorth]]:
    """The least D^2 of each question now and with each measurement that could be made.

    Parameters
    ----------
    here : Point
        The calibrated model.
    questions : sequence of sequence of (Candidate, dict of float, float)
        A few rivals to be separated, or one effect to be separated from calibration: effect, values of its shapes, gain
        (amplitude - off)^power.

    Returns
    -------
    list of list of MeasurementWorth
        Of each question; none if no flow is found.
    """
    for case in (*(with_other_discharges(model, lower) for lower in (LOWER, ())), model.case):
        wide, plans = planned(model, case)
        point = linearise_from(wide, here.z, here)
        if point is not None:
            break
    else:
        return [[] for _ in questions]
    every = [rival for question in questions for rival in question]
    changed = [cause_of(wide.case, one, shapes) for one, shapes, _ in every]
    own_error = model_error_columns(wide, point, wide.case.model_error)
    # Measurements to come are as good as the usual one of their kind.
    errors, kinds = noise.among_all(noise.data_error, len(wide.station)), wide.station["kind"].to_numpy()
    for kind in dict.fromkeys(kinds):
        there = errors[(kinds == kind) & np.isfinite(errors)]
        usual = np.median(there) if there.size else kind_of(str(kind)).usual_error
        if wide.case.planned is not None:
            usual = getattr(wide.case.planned.errors, str(kind), None) or usual
        errors[(kinds == kind) & ~np.isfinite(errors)] = usual
    covariance = np.diag(errors**2) + own_error @ own_error.T
    plans += surveys(wide, point)
    traces = responses(wide, point, changed) * np.array([gain for _, _, gain in every])
    known = np.zeros(len(wide.station), dtype=bool)
    known[: len(model.station)] = model.station["used"].to_numpy()
    ends = np.cumsum([len(question) for question in questions])
    found = []
    for end, question in zip(ends, questions, strict=True):
        columns, slopes = np.hstack([point.slope, traces[:, end - len(question) : end]]), point.slope.shape[1]

        def least(rows: np.ndarray, less: Array | None = None, columns: Array = columns, slopes: int = slopes) -> Array:
            whole = covariance[np.ix_(rows, rows)]
            lower = np.linalg.cholesky(whole if less is None else whole - less[rows] @ less[rows].T)
            white = scipy.linalg.solve_triangular(lower, columns[rows], lower=True)
            return least_distances(white[:, :slopes], white[:, slopes:])

        now, worths = least(known), []
        for plan in plans:
            rows = known.copy()
            rows[plan.rows] = True
            worths.append(MeasurementWorth(plan, now, least(rows, plan.less)))
        found.append(worths)
    return found


def planned(model: Model, case: Case) -> tuple[Model, list[MeasurementPlan]]:
    """The model with every station that could be measured behind those that were, and the plans they make.

    Parameters
    ----------
    case : Case
        That of the model with further experiments, each with the bed of the one it is like, which may have its own.

    Returns
    -------
    Model
        Of that case; the further stations are not used.
    list of MeasurementPlan
    """
    tables, plans, count = [model.station], [], len(model.station)
    velocity = model.station[velocity_rows(model.station) & model.station["used"]]
    velocity = velocity.assign(x=section_places(velocity))
    known = [(model.case.experiments[name].bed, there) for name, there in model.site.own.items()]
    own = {name: there for name, one in case.experiments.items() for bed, there in known if bed == one.bed}
    wide = replace(model, case=case, site=replace(model.site, own={**own, **model.site.own}))
    for plan_name, experiment, x, y, kind, hours in _ideas(wide, list(model.case.experiments), velocity):
        table = pd.DataFrame(
            {"experiment": experiment, "kind": kind, "section": plan_name, "x": x, "y": y, "value": 0.0,
             "standard_error": np.nan, "used": False, "reason": "", "depth": np.nan, "device": ""}
        )  # fmt: skip
        rows = np.arange(count, count + len(table))
        plans.append(MeasurementPlan(plan_name, rows, table, hours, x, experiment))
        tables.append(table)
        count += len(table)
    return replace(wide, station=station_table(*tables)), plans


def surveys(model: Model, point: Point) -> list[MeasurementPlan]:
    """Surveys that would take from the errors of the site.

        A_l' (B_l B_l' + s^2 I)^(-1/2)

    are the columns that a line of bed levels takes: A the responses of the stations to the bed's errors, B_l these
    errors on the line, s the error of a level. Outlines of plants that are levelled in keep a fifth of their error.

    Returns
    -------
    list of MeasurementPlan
        Lines midway between surveyed ones, and outlines of plants; none if the site states no such error.
    """
    case, grid, nothing = model.case, model.site.grid, np.zeros(0, dtype=int)
    found, no_station = [], model.station.iloc[:0]
    of_work = case.planned or Planned()
    columns = bed_error_columns(case, grid)
    if columns.any():
        own = model.station["experiment"].isin(model.site.own).to_numpy()
        answers = cell_responses(model, point, ("bed",)).of["bed"].reshape(len(model.station), -1) @ columns
        answers[own] = 0.0
        read = [read_bed_survey(layer.survey.file) for layer in case.bed if layer.survey is not None]
        lines = np.unique([one.points[rows, 0].mean() for one in read for rows in one.lines])
        for before, after in itertools.pairwise(lines):
            if after - before <= 2.0 * SAME_LINE:
                continue
            x = 0.5 * (before + after)
            at = columns.reshape(*model.site.bed.shape, -1)[int(np.abs(grid.x - x).argmin())]
            # A_l' (B_l B_l' + s^2 I)^(-1/2) of the answers A = F.
            lower = np.linalg.cholesky(at @ at.T + of_work.errors.survey**2 * np.eye(len(at)))
            less = answers @ scipy.linalg.solve_triangular(lower, at, lower=True).T
            name = phrase("possible_measurement", "line", f"{x:.0f}")
            hours = of_work.costs.survey_line
            found.append(MeasurementPlan(name, nothing, no_station, hours, float(x), "", less))
    if case.model_error.edges and case.plants.patches:
        drag = cell_responses(model, point, ("friction", "drag"))
        sides = site_error_columns(model, point, ModelError(edges=case.model_error.edges), drag)
        # Corners that are levelled in leave a fifth of the error, and a 25th of its square.
        less = np.sqrt(1.0 - 0.2**2) * sides
        name = phrase("possible_measurement", "outlines")
        found.append(MeasurementPlan(name, nothing, no_station, OUTLINES, float(grid.x.mean()), "", less))
    return found


def _ideas(
    model: Model, at_hand: Sequence[str], velocity: pd.DataFrame
) -> list[tuple[str, str, float, Array, str, float]]:
    """Name, experiment, x, y, kind and hours of every measurement worth a thought; sections as those that were
    measured, as far as water reaches, none where no velocity was. model: with further experiments behind those at hand.
    """
    costs = (model.case.planned or Planned()).costs
    usual, y = at_hand[-1], np.zeros(0)
    if not velocity.empty:  # where verticals stand in the section that has most of them
        counts = velocity.groupby("x")["y"].nunique()
        y = np.sort(velocity[velocity["x"] == counts.idxmax()]["y"].unique().astype(float))
    low, high = model.case.grid.x
    places = np.linspace(low, high, SECTIONS + 2)[1:-1]
    near = AS_MEASURED * float(places[1] - places[0])
    # Sections and their verticals, as in the experiment with most of them: in others a boat lay beside it, by `near` at
    # most. Where as many, in the order of the case: that of the rows of a table means nothing.
    verticals = velocity.groupby(["experiment", "x"], sort=False)["y"].unique()
    found: list[tuple[list[str], float, Array]] = []
    for (experiment, x), there in sorted(
        verticals.items(), key=lambda one: (-one[1].size, at_hand.index(one[0][0]), one[0][1])
    ):
        same = [of for of, other, _ in found if abs(other - x) <= near and experiment not in of]
        if same:
            same[0].append(experiment)
        else:
            found.append(([experiment], float(x), np.sort(there.astype(float))))
    taken = [(x, there) for _, x, there in sorted(found, key=lambda one: one[1])]
    new = [float(x) for x in places if taken and min(abs(x - there) for there, _ in taken) > near]
    sections = [(phrase("possible_measurement", "section", f"{x:.0f}", usual), usual, x, y, 0.0) for x in new]
    for x, here in taken:
        at = f"{round(x, 2):g}"
        sections.append((phrase("possible_measurement", "again", at, usual), usual, x, here, 0.0))
        for other in (name for name in model.case.experiments if name not in at_hand):
            sections.append((phrase("possible_measurement", "at-flow", at, other), other, x, here, costs.discharge))
    ideas = []
    for name, experiment, x, verticals, more in sections:  # verticals that the water covers, see `expected_depth`
        site, grid = in_experiment(model.site, experiment), model.site.grid
        depth = expected_depth(model.case, site, model.case.experiments[experiment])[np.abs(grid.x - x).argmin()]
        deep = depth[np.abs(grid.y[:, None] - verticals).argmin(axis=0)] > model.case.numerics.film_depth
        if (wet := verticals[deep]).size:
            hours = costs.transect + wet.size * costs.vertical + more
            ideas.append((name, experiment, x, wet, STREAMWISE, hours))
    across = y if y.size else np.array(model.case.grid.y)
    middle = np.array([float(0.5 * (across[0] + across[-1]))])
    for x in places[::2]:
        name = phrase("possible_measurement", "gauge", f"{x:.0f}", usual)
        ideas.append((name, usual, float(x), middle, WATER_LEVEL, costs.gauge))
    return ideas


def with_other_discharges(model: Model, lower: Sequence[float]) -> Case:
    """The case with experiments at discharges it has not seen, their outlet level at floor + h (Q' / Q)^LEVEL_POWER.

    Parameters
    ----------
    lower : sequence of float
        Shares of the lowest discharge [-], beside HIGHER ones of the highest.

    Returns
    -------
    Case
        The same if no experiment has discharges and a level that are numbers.
    """
    case = model.case
    numbers = [
        (name, one)
        for name, one in case.experiments.items()
        if not isinstance(one.level, str) and not any(isinstance(q, str) for q in one.discharge.values())
    ]
    if not numbers:
        return case
    totals = {name: sum(float(q) for q in one.discharge.values()) for name, one in numbers}
    lowest, highest = min(totals, key=lambda name: totals[name]), max(totals, key=lambda name: totals[name])
    more = {}
    for name, factor in [(lowest, factor) for factor in lower] + [(highest, factor) for factor in HIGHER]:
        one, floor = case.experiments[name], float(in_experiment(model.site, name).bed[-1].min())
        depth = float(one.level) - floor
        level = floor + depth * factor**LEVEL_POWER
        digits = max(1 - math.floor(math.log10(depth * factor**LEVEL_POWER)), 0) if depth > 0.0 else 2
        discharge = {inflow: float(q) * factor for inflow, q in one.discharge.items()}
        plan = phrase("possible_flow", in_digits(factor * totals[name]), f"{level:.{digits}f}")
        more[plan] = one.model_copy(update={"discharge": discharge, "level": level})
    unseen = {name: one for name, one in more.items() if name not in case.experiments}
    return case.model_copy(update={"experiments": {**case.experiments, **unseen}})


def least_distances(slope: Array, traces: Array) -> Array:
    """The least D^2 between each rival and any other, either way.

        D^2 = |(I - P) t|^2

    P projects onto the slopes, with their priors, and the trace of the other rival.

    Parameters
    ----------
    slope : ndarray (n, p)
        Whitened [-].
    traces : ndarray (n, rival)
        Whitened [-].

    Returns
    -------
    ndarray (rival,)
        [-]; D^2 from no rival if there is only one.
    """
    count, priors = traces.shape[1], slope.shape[1]
    if count == 1:
        return np.array([_left(slope, traces[:, 0], priors)])
    between = np.full((count, count), np.inf)
    for i, j in itertools.permutations(range(count), 2):
        between[i, j] = _left(np.column_stack([slope, traces[:, j]]), traces[:, i], priors)
    return np.minimum(between, between.T).min(axis=1)


def _left(calibrated: Array, trace: Array, priors: int) -> float:
    """|(I - P) trace|^2 with the rows of the priors below the slopes."""
    below = np.zeros((priors, calibrated.shape[1]))
    below[:, :priors] = np.eye(priors)
    wide, target = np.vstack([calibrated, below]), np.concatenate([trace, np.zeros(priors)])
    answer, *_ = np.linalg.lstsq(wide, target, rcond=1e-10)
    return float(np.sum((target - wide @ answer) ** 2))
