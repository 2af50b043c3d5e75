"""Where a local anomaly lies, how far it extends, and what it cannot be.

Its position is searched between the spots of the screening, in the flow with that anomaly:

    ln B(x, y) = ln B_refit + b(x, y) - b(x_refit, y_refit)

b is ln B to first order of the same anomaly at another position (`score_test`), computed in the flow that has its wake
at full size. The best position is refitted until no other is better. The spots of the screening nearby are then
replaced by the mean over these positions, which are closer together. They stay as far from the ends of the grid as
those spots, since nearer ones only change the boundary conditions.

Of plants that are not on the map, and of a spot beside them, middle and sizes are calibrated with all else.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.baseline import SearchModel
from vegglue.calibration.candidates import place_candidate, start_with, with_effect
from vegglue.calibration.fingerprints import Places, digits_of_place, places_around
from vegglue.calibration.fit import interval95
from vegglue.calibration.model_error import Unlisted
from vegglue.calibration.score_test import HypothesisKind, expected_gain, log_factors
from vegglue.case.case_effects import effect_named, effect_of, value_of
from vegglue.case.channel_geometry import channel_geometry, patches_present, site_scales
from vegglue.case.gridded_site import cells_at
from vegglue.case.parameter_space import theta_at
from vegglue.case.schema import Parameter
from vegglue.decision_constants import constants
from vegglue.diagnosis.odds import tempered_probabilities
from vegglue.diagnosis.refits import Refit, RefitTrial, refits_of
from vegglue.effects.unlisted import rectangle
from vegglue.engine.interface import Model, Point, flow_at_centres
from vegglue.engine.newton import problem_at
from vegglue.flow.closures import bed_drag, drag
from vegglue.flow.local_changes import Term
from vegglue.normal_range import NORMAL95
from vegglue.results.causes import PatchOutline

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
