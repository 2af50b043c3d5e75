"""The comparison of everything that could explain a misfit: listed effects, local anomalies and instruments.

    E_j = ln B_j + ln prior_j
    p_j ~ exp((E_j - max E) / w_j),   w_j = 1 + e^2 2 E_j

The most promising hypotheses of each kind are calibrated with the model; their evidence E is Laplace's (`refits`). The
others of that kind keep their evidence to first order, corrected as that of the best of them was. Instruments do not
change the flow, so that first order is exact for them but for the parameters; of surveyed lines, which do, the most
probable is calibrated without its level. Prior weights are in `residual_screening`. Probabilities are tempered by e,
the relative error of a fingerprint: the cells and laws of a model are not those of nature, and the more a hypothesis
explains the more this counts, as if errors were w^(1/2) times as large.

The position of a local anomaly is searched between the spots of the screening, in the flow with that anomaly:

    ln B(x, y) = ln B_refit + b(x, y) - b(x_refit, y_refit)

b is ln B to first order of the same anomaly at another position (`score_test`), computed in the flow that has its wake
at full size. The best position is refitted until no other is better. The spots of the screening nearby are then
replaced by the mean over these positions, which are closer together.

Hypotheses almost as probable as the best are followed one step further, together with what would be accepted next:
first order overestimates what that will explain. The less specific hypothesis has to lead. A local anomaly says "none
of the known causes", so all positions together must lead all known causes by known_first_odds; which position is taken
need not be certain. No other hypothesis is followed beside one that nothing rivals within strong_odds.

A significant misfit alone names nothing: errors alone give one at a stated rate. A hypothesis is accepted only if all
of them together lead "nothing is missing" by missing_odds, with errors as large as the best of them leaves:

    E'_j = E_j - (1 - 1/w) L_j,   w = max(1, chi2 / n)

L is the part of E that is likelihood, and w the square of Birge's ratio, 1 unless errors alone would leave less. E'
also compares effects with the same fingerprint: their misfits differ by less than the error of the model, and their
prior probabilities, at the sizes they need, decide.

Impossible causes have no evidence: a bed that moves by more than the depth, water that enters by more than the
discharge (`possible_change`), and a listed effect beyond implausible_size that these data could not show at a plausible
one. Local anomalies stay as far from the ends of the grid as the spots of the screening, since nearer ones only change
the boundary conditions.

Smooth fields of a term (`field_scan`) explain much of any missing cause. They are compared with all that was accepted
in the end, not with a single cause.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from scipy.special import logsumexp

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.baseline import SearchModel
from vegglue.calibration.candidates import Instrument, InstrumentKind, place_candidate, start_with, with_effect
from vegglue.calibration.fingerprints import Places, digits_of_place, places_around
from vegglue.calibration.fit import chance_of_misfit, chi2, interval95
from vegglue.calibration.model_error import EFFECT_AT_PLACE, Unlisted
from vegglue.calibration.residual_screening import Screening, conditional_screenings, refit_start
from vegglue.calibration.score_test import HypothesisKind, expected_gain, kind_named, log_factors, prior_shrinkage
from vegglue.case.case_effects import effect_named, effect_of, value_of
from vegglue.case.channel_geometry import channel_geometry, patches_present, site_scales
from vegglue.case.gridded_site import cells_at
from vegglue.case.parameter_space import theta_at
from vegglue.case.schema import Parameter
from vegglue.decision_constants import constants
from vegglue.diagnosis.refits import Refit, RefitTrial, Relevelled, refits_of, relevelled
from vegglue.effects.unlisted import rectangle
from vegglue.engine.interface import Model, Point, flow_at_centres
from vegglue.engine.newton import problem_at
from vegglue.flow.closures import bed_drag, drag
from vegglue.flow.local_changes import Term
from vegglue.normal_range import NORMAL95
from vegglue.parallel import in_threads
from vegglue.progress import Progress, Watch
from vegglue.results.causes import PatchOutline
from vegglue.wording.phases import COMPARING_LINE

# Odds beyond e^this are reported as this: larger numbers mean no more.
LARGEST_LOG_ODDS = 100.0


def tempered_probabilities(evidence: Array, trace_error: float | None = None) -> Array:
    """p_j ~ exp((E_j - max E) / w_j),   w_j = 1 + e^2 2 E_j

    Parameters
    ----------
    evidence : ndarray (k,)
        E, ln evidence with its prior [-].
    trace_error : float, optional
        e, relative error of a fingerprint [-]; fingerprint_error of the constants if not given.

    Returns
    -------
    ndarray (k,)
        [-], of sum 1.
    """
    weight = np.exp((evidence - evidence.max()) / tempering(evidence, trace_error))
    return np.asarray(weight / weight.sum())


def tempering(evidence: Array, trace_error: float | None = None) -> Array:
    """w = 1 + e^2 2 max(E, 0): by how much ln odds are reduced, see the head of this file.

    Parameters
    ----------
    evidence : ndarray
        E [-].
    trace_error : float, optional
        e, relative error of a fingerprint [-]; fingerprint_error of the constants if not given.

    Returns
    -------
    ndarray
        [-]
    """
    error = constants().fingerprint_error if trace_error is None else trace_error
    return np.asarray(1.0 + error**2 * 2.0 * np.maximum(evidence, 0.0))


def tempered_odds(evidence: float, other: float) -> float:
    """p_1 / p_2 = exp((E_1 - E_2) / w),   w that of the lesser of both: odds of these two alone.

    Parameters
    ----------
    evidence, other : float
        E_1 and E_2 [-].

    Returns
    -------
    float
        [-], e^LARGEST_LOG_ODDS at most.
    """
    return float(np.exp(min((evidence - other) / float(tempering(np.array(min(evidence, other)))), LARGEST_LOG_ODDS)))


def chances_in_set(evidence: Array) -> Array:
    """`tempered_probabilities` of laws and all that they are compared with, e = law_fingerprint_error.

    Parameters
    ----------
    evidence : ndarray (k,)
        E [-].

    Returns
    -------
    ndarray (k,)
        [-], of sum 1.
    """
    return tempered_probabilities(evidence, constants().law_fingerprint_error)


# Distance of the places that are looked at around a refitted one, over that of the spots of the screening [-]. Chosen,
# not measured.
SHARE_OF_SPACING = 0.5
# How often it is moved at most, and by how much ln B has to rise. Chosen, not measured: most are moved once or twice,
# each time by two half lengths at most.
MOST_MOVES, LEAST_RISE = 10, 0.3


@dataclass(frozen=True)
class Window:
    """Places around a refitted one, to first order in the flow with it.

    Attributes
    ----------
    x, y : ndarray (spot,)
        Their middles [m].
    log_factor : ndarray (spot,)
        ln B of the same anomaly there [-].
    gain : ndarray (spot,)
        Its expected size there [unit of the effect].
    """

    x: Array
    y: Array
    log_factor: Array
    gain: Array


@dataclass(frozen=True)
class FoundPlace:
    """A local anomaly where it explains most.

    Attributes
    ----------
    refit : Refit
        Of the anomaly there.
    log_evidence : float
        E of its term over all places [-].
    errors : float, float
        Root mean square distance in x and y of where it may lie [m], by tempered probabilities.
    spread : float, float
        The same by the evidence as it is [m]; 0 of plants that are not on the map.
    outline : PatchOutline or None
        Of plants that are not on the map.
    """

    refit: Refit
    log_evidence: float
    errors: tuple[float, float]
    spread: tuple[float, float]
    outline: PatchOutline | None = None


def found_place(search: SearchModel, places: Places, kind: HypothesisKind, spot: int, refit: Refit) -> FoundPlace:
    """A local anomaly that was refitted at a spot, moved to where it explains most.

        ln B(x, y) = ln B_refit + b(x, y) - b(x_refit, y_refit)

    It is refitted at the best place of a window until ln B rises by less than LEAST_RISE, MOST_MOVES times at most.

    Parameters
    ----------
    search : SearchModel
        Without the anomaly.
    places : Places
        The spots of its term.
    kind : HypothesisKind
        Of these spots.
    spot : int
        Where it was refitted.
    refit : Refit
        At that spot.

    Returns
    -------
    FoundPlace
        With the evidence of all places of the term: those of the last window, and spots of other sizes or farther off.
    """
    moved, window = refit, window_around(search, places, refit)
    for _ in range(MOST_MOVES):
        best = int(np.argmax(window.log_factor))
        if window.log_factor[best] < moved.log_factor + LEAST_RISE:
            break
        digits = digits_of_place(min(moved.shapes["length"], moved.shapes["width"]))
        x, y = round(float(window.x[best]), digits), round(float(window.y[best]), digits)
        shapes = {**moved.shapes, "x": x, "y": y}
        candidate = place_candidate(moved.candidate.effect, shapes, places.plausible, moved.candidate.above_off)
        if candidate.key in search.model.case.effects:  # it would take the place of what acts there
            break
        start = start_with(candidate, moved.fitted.point.z[:-1], float(window.gain[best]))
        (there,) = refits_of(search, [RefitTrial(candidate, shapes, (start,))])
        if there is None or there.log_factor < moved.log_factor + LEAST_RISE:
            break
        moved, window = there, window_around(search, places, there)
    # Spots of the size of that one which the window has seen again are replaced by it.
    half = SHARE_OF_SPACING * np.array([places.length[spot], places.width[spot]])
    within = (places.x >= window.x.min() - half[0]) & (places.x <= window.x.max() + half[0])
    within &= (places.y >= window.y.min() - half[1]) & (places.y <= window.y.max() + half[1])
    far = ~((places.length == places.length[spot]) & within)
    # Elsewhere first-order evidence promises as much too much as at the spot that was refitted.
    kept = refit.log_factor - float(log_factors(kind.scores, kind.size)[spot])
    # A barrier has its places along the channel alone, and so has all else in a flume as narrow as a spot.
    axes = sum(float(np.ptp(coordinate)) > 0.0 for coordinate in (window.x, window.y))
    weight = np.concatenate(
        [kind.log_evidence[far] + kept, window.log_factor + kind.log_prior[spot] + axes * np.log(SHARE_OF_SPACING)]
    )
    away = np.stack([
        np.concatenate([places.x[far], window.x]) - moved.shapes["x"],
        np.concatenate([places.y[far], window.y]) - moved.shapes["y"],
    ])  # fmt: skip
    total = float(logsumexp(weight))
    # Where it may lie: far spots gain what those of the window gained by being refitted and moved, as their mirror
    # images would.
    near = weight[np.count_nonzero(far) :]
    gained = logsumexp(near) - logsumexp(kind.log_evidence[~far]) - kept
    chances = np.concatenate([weight[: np.count_nonzero(far)] + gained, near])
    errors, spread = (
        np.sqrt(away**2 @ chance).tolist()
        for chance in (tempered_probabilities(chances), np.exp(chances - logsumexp(chances)))
    )
    return FoundPlace(moved, total, tuple(errors), tuple(spread))


def possible_change(model: Model, point: Point, term: Unlisted | Term, x: float, y: float) -> tuple[float, float]:
    """The range in which a term can change at a place.

    A bed by the depth there, or by the mean depth if that is more; water that enters by all that flows; viscosity and
    friction down to none.

    Parameters
    ----------
    x, y : float
        [m]

    Returns
    -------
    float, float
        Least and largest change [m, m3/s, m2/s, or - of friction], infinite if it has no bound.
    """
    scales, most = site_scales(model.case, model.site), np.inf
    if term == "bed":
        i, j = cells_at(model.site, np.array([x]), np.array([y]))
        there = [flow_at_centres(model, point, name).depth[i, j] for name in point.flows]
        most = max(scales.mean_depth, float(np.max(there)))
    elif term == "inflow":
        most = scales.discharge
    elif term == "friction":
        return -1.0, most
    elif term == "viscosity" and not any(effect_of(model.case, key).stage == "exchange" for key in model.case.effects):
        return -float(value_of(model.case.eddy_viscosity, theta_at(model.case, point.z), 1)[0]), most
    return -most, most


def cannot_be(interval: tuple[float, float], possible: tuple[float, float]) -> bool:
    """Whether a change lies outside what is possible with its whole 95 % interval.

    Parameters
    ----------
    interval, possible : (float, float)
        Low and high, in one unit; see `possible_change`.
    """
    return interval[0] > possible[1] or interval[1] < possible[0]


# Plants that are not on the map, and their largest inclination [deg]: chosen before any patch was fitted.
PATCH, LARGEST_TURN = "unlisted_patch", 60.0
# Half length and half width in cells above which a fitted spot is not lost between their centres: its sum over the
# cells is then right to 2 exp(-pi^2 0.7^2) = 2 %.
LEAST_EXTENT = 0.7


def drag_of_patches(search: SearchModel, height: float) -> dict[str, float]:
    """phi = 2 h k, the drag of the plants of each patch of the map, the mean over its cells and experiments.

    Parameters
    ----------
    search : SearchModel
        At the MAP estimate.
    height : float
        Depth of the water h, as deep as the plants are high [m].

    Returns
    -------
    dict of float
        phi [-] by the name of the patch, those with cells and drag.
    """
    model, names = search.model, [patch.name for patch in search.model.case.plants.patches]
    patch, sums = model.site.main_patch, np.zeros((2, len(names)))
    depth = np.full((*patch.shape, 1), height)
    for experiment in search.point.flows:
        problem = problem_at(model, experiment, search.point.z)
        own = 2.0 * height * (drag(problem, depth) - bed_drag(problem, depth))[..., 0]
        for index in patches_present(model.case, experiment):
            sums[:, index] += own[patch == index].sum(), model.site.cover[patch == index].sum()
    return {name: float(of / cells) for name, of, cells in zip(names, *sums, strict=True) if cells > 0.0 < of}


def _within_places(values: Array, start: float) -> tuple[float, Parameter]:
    """A coordinate to start from, off the ends of all places, and its prior, uniform over them [m]."""
    low, high = float(values.min()), float(values.max())
    margin = 0.01 * (high - low)
    prior = Parameter(distribution="uniform", low=low, high=high, unit="m")
    return float(np.clip(start, low + margin, high - margin)), prior


def fitted_extent(search: SearchModel, refit: Refit) -> tuple[dict[str, float], dict[str, float]]:
    """Shapes of a local anomaly whose place and sizes were fitted, rounded as by `digits_of_place`.

    Parameters
    ----------
    search : SearchModel
        Without the anomaly.
    refit : Refit
        With the shapes that were fitted among its `free` ones.

    Returns
    -------
    shapes : dict of float
        All, the fitted ones at the MAP estimate [unit of the shape].
    errors : dict of float
        Standard errors of the fitted ones, a 95 % interval over 2 NORMAL95 [unit of the shape].
    """
    model = replace(search.model, case=with_effect(search.model.case, refit.candidate, refit.shapes))
    ends = {name: interval95(model, refit.fitted, parameter) for name, parameter in refit.candidate.free.items()}
    digits = digits_of_place(ends["width"][0])
    shapes = {**refit.shapes} | {name: round(middle, digits) for name, (middle, _, _) in ends.items()}
    return shapes, {name: (high - low) / (2.0 * NORMAL95) for name, (_, low, high) in ends.items()}


def found_extent(
    search: SearchModel, places: Places, kind: HypothesisKind, spot: Refit, outline: Mapping[str, float], needed: float
) -> FoundPlace | None:
    """A local anomaly whose middle, length and width are fitted with all else.

        ln E = ln B + ln prior,   x, y uniform over the places, ln l and ln w normal around those of the spots

    B is Laplace's of all five (`refits`), so that each is charged, and the prior that of all spots of the term.

    Parameters
    ----------
    search : SearchModel
        Without the anomaly.
    places : Places
        The spots of its term.
    kind : HypothesisKind
        Of these spots.
    spot : Refit
        The anomaly with the extent of a spot, from which a fit starts.
    outline : mapping of float
        x, y, half length and half width [m] from which another fit starts.
    needed : float
        ln E below which it is of no use [-].

    Returns
    -------
    FoundPlace or None
        None if no flow is found, it is of no use, falls between the centres of cells, or would take the place of what
        acts there.
    """
    effect, above_off = spot.candidate.effect, spot.candidate.above_off
    ends = float(places.length.min()), float(places.length.max())
    log_sd = constants().extent_log_sd
    spread = 0.5 * np.log(ends[1] / ends[0]) or log_sd  # in a short reach only the shortest spots fit
    length = Parameter(distribution="lognormal", median=float(np.sqrt(ends[0] * ends[1])), log_sd=spread, unit="m")
    width = Parameter(distribution="lognormal", median=float(places.width.min()), log_sd=log_sd, unit="m")
    trials = []
    for start in (spot.shapes, outline):
        (x, of_x), (y, of_y) = _within_places(places.x, start["x"]), _within_places(places.y, start["y"])
        shapes = {"x": x, "y": y, "length": start["length"], "width": start["width"]}
        candidate = place_candidate(effect, shapes, places.plausible, above_off)
        candidate = replace(candidate, fitted=(("x", of_x), ("y", of_y), ("length", length), ("width", width)))
        gain = float(candidate.amplitude.gain(spot.amplitude))
        at = start_with(candidate, spot.fitted.point.z[:-1], gain)
        trials.append(RefitTrial(candidate, shapes, (at,), needed - float(logsumexp(kind.log_prior))))

    def is_narrow(shapes: Mapping[str, float]) -> bool:
        grid = search.model.site.grid
        return shapes["length"] < LEAST_EXTENT * grid.dx or shapes["width"] < LEAST_EXTENT * grid.dy

    if (found := _best_fitted(search, kind, trials, is_narrow)) is None:
        return None
    fixed, evidence, errors = found
    error = errors["x"], errors["y"]
    return FoundPlace(fixed, evidence, error, error)


def _best_fitted(
    search: SearchModel, kind: HypothesisKind, trials: Sequence[RefitTrial],
    is_none: Callable[[Mapping[str, float]], bool],
) -> tuple[Refit, float, dict[str, float]] | None:  # fmt: skip
    """The likeliest of some trials of one thing, calibrated again with its shapes held, its evidence, and the standard
    errors of the shapes; None if no flow is found, its shapes are none, or it would take the place of what acts there.
    """
    ended = [one for one in refits_of(search, trials) if one is not None]
    if not ended:
        return None
    best = max(ended, key=lambda one: one.log_factor)
    shapes, errors = fitted_extent(search, best)
    of = best.candidate
    candidate = place_candidate(of.effect, shapes, of.scale, of.above_off)
    if is_none(shapes) or candidate.key in search.model.case.effects:
        return None
    (fixed,) = refits_of(search, [RefitTrial(candidate, shapes, (best.fitted.point.z[: -len(errors)],))])
    if fixed is None:
        return None
    return replace(fixed, interval95=best.interval95), best.log_factor + float(logsumexp(kind.log_prior)), errors


def found_patch(
    search: SearchModel, places: Places, kind: HypothesisKind, starts: Sequence[tuple[float, float]], needed: float
) -> FoundPlace | None:
    """Plants that are not on the map: a rectangle of drag whose middle, sizes and inclination are fitted with all else.

        ln E = ln B + ln prior,   x, y uniform over the places, ln 2l and ln 2w normal around the patches of the map

    B is Laplace's of all six (`refits`), so that each is charged, and the prior that of all spots of drag together.
    Such plants block the water: no response to first order leads there.

    Parameters
    ----------
    places : Places
        Spots of drag.
    kind : HypothesisKind
        Of these spots.
    starts : sequence of (float, float)
        x, y to begin from [m].
    needed : float
        ln E below which they are of no use [-].

    Returns
    -------
    FoundPlace or None
        None if the map has no plants, no flow is found, what is found is of no use, is no longer than a spot, or lies
        on the plants of the map.
    """
    case, scales = search.model.case, site_scales(search.model.case, search.model.site)
    told = drag_of_patches(search, scales.canopy)
    if not told or PATCH in (case.exclude or ()):
        return None
    like = max(told, key=told.__getitem__)
    effect, plausible = effect_named(case, PATCH), told[like]

    trials = []
    for start in starts:
        (x, of_x), (y, of_y) = _within_places(places.x, start[0]), _within_places(places.y, start[1])
        half = {"length": 0.5 * scales.patch_length, "width": 0.5 * scales.patch_width}
        shapes = {"x": x, "y": y, **half, "angle": 0.0, "height": scales.canopy}
        shapes["proportional"] = float(case.numerics.emergent == "proportional")
        free = {"x": of_x, "y": of_y} | {
            name: Parameter(distribution="lognormal", median=size, log_sd=constants().extent_log_sd, unit="m")
            for name, size in half.items()
        }
        free["angle"] = Parameter(
            distribution="normal", mean=0.0, sd=constants().patch_turn, low=-LARGEST_TURN, high=LARGEST_TURN, unit="deg"
        )
        candidate = replace(place_candidate(effect, shapes, plausible), fitted=tuple(free.items()))
        at = start_with(candidate, search.point.z, plausible)
        trials.append(RefitTrial(candidate, shapes, (at,), needed - float(logsumexp(kind.log_prior))))
    geometry = channel_geometry(case, search.model.site, next(iter(case.experiments)))

    def is_spot_or_known(shapes: Mapping[str, float]) -> bool:
        share = rectangle(geometry, **{name: np.array([shapes[name]]) for name in free})[..., 0]
        covered = float((share * search.model.site.cover).sum() / share.sum())
        return shapes["length"] <= places.length.min() or covered > constants().mapped_share

    if (found := _best_fitted(search, kind, trials, is_spot_or_known)) is None:
        return None
    fixed, evidence, errors = found
    of_sizes = {f"{name}_error": errors[name] for name in ("length", "width", "angle")}
    own = {name: fixed.shapes[name] for name in ("angle", "height", "proportional")}
    outline = PatchOutline(**own, **of_sizes, like=like)
    return FoundPlace(fixed, evidence, (errors["x"], errors["y"]), (0.0, 0.0), outline)


def window_around(search: SearchModel, places: Places, refit: Refit) -> Window:
    """Places around a refit, to first order in the flow with it.

        b(x, y) - b(x_refit, y_refit) + ln B_refit

    Parameters
    ----------
    search : SearchModel
        Without the anomaly.
    places : Places
        The spots of its term.
    refit : Refit
        The anomaly at its place.

    Returns
    -------
    Window
        No nearer to the ends of the grid than spots of this length, or than the refit.
    """
    point, noise, place = refit.fitted.point, search.noise, refit.shapes
    model = replace(search.model, case=with_effect(search.model.case, refit.candidate, place))
    around = places_around(model, point, places.term, place, SHARE_OF_SPACING)
    alike = np.abs(places.length - place["length"])
    ends = np.append(places.x[alike == alike.min()], place["x"])
    kept = np.flatnonzero((around.x >= ends.min()) & (around.x <= ends.max()))
    x, y = around.x[kept], around.y[kept]
    traces = noise.whiten(noise.used(around.fingerprints[:, kept]))
    own = int(np.argmin(np.hypot(x - place["x"], y - place["y"])))
    # What it does where it is is taken away, and put elsewhere.
    residual = noise.whiten(noise.residual(point.prediction)) + traces[:, own] * refit.amplitude
    slope = noise.whiten(noise.used(point.slope[:, :-1]))
    projected = score_test.project(slope, residual, point.z[:-1], traces)
    size = projected.length * places.plausible
    score = score_test.scores(projected, around.only_sign[kept])
    gain = expected_gain(score, projected.length, size)
    first_order = log_factors(score, size)
    return Window(x, y, first_order - first_order[own] + refit.log_factor, gain)


# Listed effects that are refitted in one round at most, and how far below the best one's evidence a hypothesis may lie
# to be refitted, after w: e^-6 is one in 400. Chosen, not measured: more cost runs of the model.
MOST_REFITTED, REACH = 8, 6.0
# Shares of the size that its score promises from which something at a place is refitted: at all of it a flow may not be
# found. Chosen, not measured.
START_SHARES = (1.0, 0.3)


@dataclass(frozen=True)
class Hypothesis:
    """A hypothesis with its evidence.

    Attributes
    ----------
    kind : str
        "effect", a term at a place, or an instrument's kind.
    log_evidence : float
        E [-], -inf of what cannot be.
    column : int
        Of its fingerprint among those of its kind.
    what : Refit or Instrument
        Its refit, or the instrument.
    errors, spread : float, float
        Of x and y of a place [m], see `FoundPlace`.
    without : Relevelled or None
        Of a surveyed line the model without its level.
    outline : PatchOutline or None
        Of plants that are not on the map.
    """

    kind: str
    name: str
    log_evidence: float
    column: int
    what: Refit | Instrument
    errors: tuple[float, float] = (0.0, 0.0)
    spread: tuple[float, float] = (0.0, 0.0)
    without: Relevelled | None = None
    outline: PatchOutline | None = None


def hypotheses_of(screening: Screening, watch: Watch, elsewhere: float = -np.inf) -> list[Hypothesis]:
    """Everything that was tried, with its evidence.

    To first order an effect may promise more than it keeps, or have no flow at all. Then what is within reach of the
    rest is refitted, too, until nothing is.

    Parameters
    ----------
    watch : callable
        Is called with each phase.
    elsewhere : float
        ln evidence of what competes besides [-].

    Returns
    -------
    list of Hypothesis
        The most evidence first.
    """
    kind, looks = screening.kinds[0], conditional_screenings(screening)
    prints, search, case = screening.fingerprints, screening.search, screening.search.model.case
    # E of every column of the listed effects, from the place that promises most, and the best column of each effect.
    linear = np.asarray(np.max([kind.log_evidence, *(one.log_factor + kind.log_prior for one in looks)], axis=0))
    columns = [int(some[np.argmax(linear[some])]) for some in prints.columns]
    of_each = np.array([linear[column] for column in columns])
    best = max(*(one.total for one in screening.kinds), float(linear.max(initial=-np.inf)), elsewhere)
    found = [
        Hypothesis(one.name, one.name, one.total, one.best, screening.instruments[one.name][one.best])
        for one in screening.kinds
        if one.name in screening.instruments
    ]
    for j, of_kind in enumerate(found):
        line = of_kind.what.line if isinstance(of_kind.what, Instrument) else None
        if line is None or not _within_reach(of_kind.log_evidence, best):
            continue
        lines = kind_named(screening.kinds, of_kind.kind)
        by_score = float(lines.log_evidence[of_kind.column] - lines.log_prior[of_kind.column])
        if by_score < 0.0:  # an offset acts linearly: where its score speaks against it, so does the calibration
            continue
        watch(Progress(COMPARING_LINE.format(line.x)))
        if (without := relevelled(screening.base, line)) is not None:
            refitted = of_kind.log_evidence + without.log_factor - by_score
            found[j] = replace(of_kind, log_evidence=refitted, without=without)
    tried: set[str] = set()
    while True:
        effects = [j for j in worth_refitting(of_each, best) if prints.candidates[j].name not in tried]
        places = [
            (one, promising_spots(screening, one, best))
            for one in prints.places
            if one.name not in tried and _within_reach(kind_named(screening.kinds, one.term).total, best)
        ]
        names = [prints.candidates[j].name for j in effects] + [one.name for one, _ in places]
        if not names:
            return sorted(found, key=lambda one: -one.log_evidence)
        watch(Progress(f"comparing {', '.join(names)}"))
        trials = []
        for j in effects:  # at its best setting, from the best place, and from others that promise more there
            column, candidate = columns[j], prints.candidates[j]
            shapes, by_score = prints.settings[column], kind.log_evidence[column] - kind.log_prior[column]
            others = (
                start_with(candidate, look.point.z, float(look.gain[column]))
                for look in looks
                if look.log_factor[column] > by_score
            )
            trials.append(RefitTrial(candidate, shapes, (refit_start(screening, j, column), *others)))
        spots = [(one, spot) for one, some in places for spot in some]
        for one, spot in spots:  # from the best place and shares of the size of its score
            shapes, gain = one.shapes(spot), float(kind_named(screening.kinds, one.term).gain[spot])
            bare = bool(one.only_sign[spot])
            candidate = place_candidate(effect_named(case, EFFECT_AT_PLACE[one.term]), shapes, one.plausible, bare)
            starts = (start_with(candidate, search.point.z, share * gain) for share in START_SHARES)
            trials.append(RefitTrial(candidate, shapes, tuple(starts)))
        refits = refits_of(search, trials, watch)
        for j, refit in zip(effects, refits, strict=False):
            if refit is not None:  # ln prior of the setting, and what the other settings add to first order
                some, evidence = prints.columns[j], kind.log_evidence
                others_add = float(np.logaddexp.reduce(evidence[some]) - evidence[some].max())
                if prints.candidates[j].free:  # whichever part of it the amplitude is, the model is the same
                    others_add = float(np.log(some.size))
                total = refit.log_factor + (float(kind.log_prior[columns[j]]) + others_add)
                size = abs(refit.amplitude - refit.candidate.amplitude.off) / refit.candidate.amplitude.scale
                if size > constants().implausible_size and not screening.testable(columns[j]):
                    total = -np.inf
                found.append(Hypothesis("effect", refit.candidate.name, total, columns[j], refit))
        ended = [(one, spot, refit) for (one, spot), refit in zip(spots, refits[len(effects) :], strict=True) if refit]
        tasks = [(screening, one, [(spot, refit) for of, spot, refit in ended if of is one]) for one, _ in places]
        found += [one for one in in_threads(somewhere_of, tasks) if one is not None]
        if spots and PATCH not in tried:
            names.append(PATCH)
            found = with_patch(screening, found)
        tried |= set(names)
        promising = [float(of_each[j]) for j in _promising(of_each) if prints.candidates[j].name not in tried]
        promising += [kind_named(screening.kinds, one.term).total for one in prints.places if one.name not in tried]
        best = max(elsewhere, *(one.log_evidence for one in found), *promising)


def somewhere_of(screening: Screening, places: Places, ends: Sequence[tuple[int, Refit]]) -> Hypothesis | None:
    """A local anomaly of a term where it explains most, from its refits at some spots.

    Parameters
    ----------
    places : Places
        The spots of the term.
    ends : sequence of (int, Refit)
        Spot and refit; the one of the largest ln B is moved on.

    Returns
    -------
    Hypothesis or None
        With E = -inf if its whole 95 % interval is impossible; None without refits.
    """
    if not ends:
        return None
    kind, search = kind_named(screening.kinds, places.term), screening.search
    spot, refit = max(ends, key=lambda end: end[1].log_factor)
    there = found_place(search, places, kind, spot, refit)
    name = there.refit.candidate.name
    possible = possible_change(search.model, search.point, places.term, *(there.refit.shapes[k] for k in "xy"))
    total = -np.inf if cannot_be(there.refit.interval95, possible) else there.log_evidence
    return Hypothesis(kind.name, name, total, spot, there.refit, there.errors, there.spread)


def with_patch(screening: Screening, found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The hypotheses with plants that are not on the map in place of a spot of drag that they lead by strong_odds.

    Spots of other terms then have their extent fitted, too: else water that enters along a bank is plants, whose sizes
    are free.

    Parameters
    ----------
    found : sequence of Hypothesis
        All so far. The plants are fitted from where most drag is promised, and from the place that has most evidence if
        that is a spot away.

    Returns
    -------
    list of Hypothesis
        As they were if no such plants lead.
    """
    places = next((one for one in screening.fingerprints.places if one.term == "drag"), None)
    at_places = [one for one in found if isinstance(one.what, Refit) and one.kind != "effect"]
    if places is None or not at_places:
        return list(found)
    kind = kind_named(screening.kinds, "drag")
    spot = int(np.argmax(np.where(kind.scores > 0.0, kind.log_evidence, -np.inf)))
    best = max(at_places, key=lambda one: one.log_evidence).what
    assert isinstance(best, Refit)
    starts = [(float(places.x[spot]), float(places.y[spot])), (best.shapes["x"], best.shapes["y"])]
    apart = np.diff(starts, axis=0) / (places.length[spot], places.width[spot])
    spots = [one.log_evidence for one in at_places if one.kind == "drag"]
    against = max(spots, default=kind.total)
    needed = against + np.log(constants().strong_odds) * float(tempering(np.array(against)))
    patch = found_patch(screening.search, places, kind, starts if np.linalg.norm(apart) > 1.0 else starts[:1], needed)
    if patch is None:
        return list(found)
    shapes = patch.refit.shapes
    nearest = int(np.argmin(np.hypot(places.x - shapes["x"], places.y - shapes["y"])))
    plants = Hypothesis(
        "drag", patch.refit.candidate.name, patch.log_evidence, nearest, patch.refit, patch.errors,
        outline=patch.outline,
    )  # fmt: skip
    return [*(with_extent(screening, one, shapes) for one in found if one.kind != "drag"), plants]


def with_extent(screening: Screening, one: Hypothesis, outline: Mapping[str, float]) -> Hypothesis:
    """`found_extent` of a spot where that has more evidence.

    Parameters
    ----------
    outline : mapping of float
        x, y, half length and half width [m] from which a fit starts besides that of the spot.

    Returns
    -------
    Hypothesis
        As it was if it is no spot, a barrier, or its fitted extent has less evidence or an impossible amplitude.
    """
    places = next((places for places in screening.fingerprints.places if places.term == one.kind), None)
    if places is None or places.term == "barrier" or not isinstance(one.what, Refit):
        return one
    search = screening.search
    there = found_extent(search, places, kind_named(screening.kinds, one.kind), one.what, outline, one.log_evidence)
    if there is None:
        return one
    refit = there.refit
    possible = possible_change(search.model, search.point, places.term, refit.shapes["x"], refit.shapes["y"])
    if cannot_be(refit.interval95, possible):
        return one
    name, errors, spread = refit.candidate.name, there.errors, there.spread
    return replace(one, name=name, log_evidence=there.log_evidence, what=refit, errors=errors, spread=spread)


def chances_of(hypotheses: Sequence[Hypothesis]) -> Array:
    """p_j of each hypothesis to be what is missing, were it one of them: `tempered_probabilities`.

    Returns
    -------
    ndarray (k,)
        [-], of sum 1.
    """
    return tempered_probabilities(np.array([one.log_evidence for one in hypotheses]))


def odds_against_nothing(evidence: Array) -> float:
    """sum_j e^E_j: the odds that one of them is missing, and not nothing, both as likely before.

    Parameters
    ----------
    evidence : ndarray (k,)
        E [-].

    Returns
    -------
    float
        [-], e^LARGEST_LOG_ODDS at most.
    """
    return float(np.exp(min(logsumexp(evidence), LARGEST_LOG_ODDS)))


def log_odds_taken(evidence: Array) -> float:
    """ln sum_j e^E_j: the odds that one of them is missing, and not nothing, both as likely before.

    Parameters
    ----------
    evidence : ndarray (k,)
        E [-].

    Returns
    -------
    float
        [-]; 0 below missing_odds, where none is taken.
    """
    odds = odds_against_nothing(evidence)
    return float(np.log(odds)) if odds >= constants().missing_odds else 0.0


def worth_refitting(evidence: Array, best: float) -> list[int]:
    """Listed effects whose evidence is not far behind the best: (best - E) / w(best) < REACH.

    Parameters
    ----------
    evidence : ndarray (candidate,)
        E to first order [-].
    best : float
        E of the best of all hypotheses [-].

    Returns
    -------
    list of int
        MOST_REFITTED at most, the best first, one of them at least.
    """
    ranked = _promising(evidence)
    return [j for j in ranked if _within_reach(float(evidence[j]), best)] or ranked[:1]


def _promising(evidence: Array) -> list[int]:
    return [int(j) for j in np.argsort(-evidence)[:MOST_REFITTED]]


def _within_reach(evidence: float, best: float) -> bool:
    return bool((best - evidence) / tempering(np.array(best)) < REACH)


def promising_spots(screening: Screening, places: Places, best: float) -> list[int]:
    """The best spot of each length that is within reach of the best hypothesis.

    Parameters
    ----------
    places : Places
        The spots of one term.
    best : float
        E of the best of all hypotheses [-].

    Returns
    -------
    list of int
        Spots, by length. None where something of the term acts already: an effect at the same place has its name, and
        would take its place in the case.
    """
    kind, case = kind_named(screening.kinds, places.term), screening.search.model.case
    effect = effect_named(case, EFFECT_AT_PLACE[places.term])
    acting = [place_candidate(effect, places.shapes(spot)).key in case.effects for spot in range(places.x.size)]
    evidence = np.where(acting, -np.inf, kind.log_evidence)
    of_length = [np.flatnonzero(places.length == length) for length in np.unique(places.length)]
    spots = [int(columns[np.argmax(evidence[columns])]) for columns in of_length]
    charge = kind.total - float(kind.log_evidence.max())
    return [spot for spot in spots if _within_reach(float(evidence[spot]) + charge, best)]


# Hypotheses of different kinds that are followed a step further at most: each costs a calibration and a screening.
MOST_FOLLOWED = 3

What = Literal["effect", "place", "instrument"]
# Kinds of hypotheses that are in a list.
KNOWN = ("effect", *get_args(InstrumentKind))


def under_larger_errors(evidence: Array, left: Array, before: float, readings: int) -> Array:
    """E' = E - (1 - 1/w) L with L = (before - left) / 2, see the head of this file.

    Parameters
    ----------
    evidence, left : ndarray (k,)
        E of each hypothesis, and the chi2 that it leaves [-].
    before : float
        chi2 without any [-]; what it is changes no difference between hypotheses.
    readings : int
        How many there are, n.

    Returns
    -------
    ndarray (k,)
        E itself where errors alone leave as large a chi2 as the best does, by poor_fit_chance.
    """
    least = float(left.min())
    if chance_of_misfit(least, readings) >= constants().poor_fit_chance:
        return evidence
    return np.asarray(evidence - 0.5 * (1.0 - readings / least) * (before - left))


def evidence_under_larger_errors(screening: Screening, hypotheses: Sequence[Hypothesis]) -> Array:
    """`under_larger_errors` of hypotheses, refitted or to first order.

    Returns
    -------
    ndarray (k,)
        E' [-].
    """
    before = chi2(screening.search.noise, screening.search.point)

    def left_by(one: Hypothesis) -> float:
        if isinstance(one.what, Refit):
            return one.what.fitted.chi2
        kind = kind_named(screening.kinds, one.kind)
        return before - float(kind.scores[one.column] ** 2 * prior_shrinkage(kind.size[one.column]))

    left = np.array([left_by(one) for one in hypotheses])
    evidence = np.array([one.log_evidence for one in hypotheses])
    return under_larger_errors(evidence, left, before, screening.base.noise.rows.size)


def nearly_as_likely(hypotheses: Sequence[Hypothesis]) -> list[int]:
    """Hypotheses of the best one's kind within same_kind_odds of it, of others within strong_odds.

    Parameters
    ----------
    hypotheses : sequence of Hypothesis
        The most evidence first.

    Returns
    -------
    list of int
        MOST_FOLLOWED of them at most, what is known among them if any of it is so likely.
    """
    chance = chances_of(hypotheses)
    odds = [
        constants().same_kind_odds if one.kind == hypotheses[0].kind else constants().strong_odds for one in hypotheses
    ]
    likely = [j for j, p in enumerate(chance) if p * odds[j] >= chance[0]]
    known = [j for j in likely if hypotheses[j].kind in KNOWN]
    last = known[0] if known and known[0] not in likely[: MOST_FOLLOWED - 1] else None
    return likely[:MOST_FOLLOWED] if last is None else [*likely[: MOST_FOLLOWED - 1], last]


def chance_of_a_place(hypotheses: Sequence[Hypothesis], chances: Sequence[float]) -> float:
    """That it is something at a place, of hypotheses with their chances (k,) [-]."""
    return sum(chance for one, chance in zip(hypotheses, chances, strict=True) if one.kind not in KNOWN)


def chosen_hypothesis(what: Sequence[What], evidence: Array, at_a_place: float) -> int | None:
    """The likeliest of those followed; if that is a place, the likeliest listed effect within known_first_odds of it.

    Parameters
    ----------
    what : sequence of {"effect", "place", "instrument"}
    evidence : ndarray (k,)
        ln, of each [-].
    at_a_place : float
        Chance of all places together, those that were not followed among them [-].

    Returns
    -------
    int or None
        Without such an effect the place, or None if all places do not lead all that is known by known_first_odds.
    """
    best = int(np.argmax(evidence))
    if what[best] != "place":
        return best
    ahead = (evidence[best] - evidence) / tempering(evidence[best])
    listed = [j for j, one in enumerate(what) if one == "effect" and ahead[j] < np.log(constants().known_first_odds)]
    if listed:
        return min(listed, key=lambda j: float(ahead[j]))
    return best if at_a_place >= constants().known_first_odds * (1.0 - at_a_place) else None
