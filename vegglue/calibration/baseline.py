"""The calibrated model that a diagnosis starts from: its MAP estimate, its noise, and the error of its grid.

With a command, the built-in engine leads to where it fits best. At each place the engine is corrected to the
predictions and slopes of the command (`engine/corrected`) and calibrated; where that ends, the command is run again. A
place is kept when the command itself fits better there.
"""

import hashlib
import json
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd
from scipy.special import ndtri

from vegglue.arrays import Array
from vegglue.calibration.fit import NEGLIGIBLE_DECREASE, MapEstimate, at_point, fit, log_evidence_under, objective
from vegglue.calibration.model_error import CellResponses, any_error, model_error_columns
from vegglue.calibration.noise import Noise, noise_of, with_grid_error, with_independent_grid_errors, with_model_error
from vegglue.case.channel_geometry import cells_across
from vegglue.case.parameter_space import refuse_without_parameters
from vegglue.case.resolved_config import dumped, plain_tree
from vegglue.case.size_limits import WIDE_FROM
from vegglue.engine.command import CommandRuns
from vegglue.engine.corrected import Correction, InsensitiveCommandError, corrected, correction_at
from vegglue.engine.interface import Model, Point, linearise, linearise_as_coarse, linearise_from, relinearised
from vegglue.engine.model import coarser
from vegglue.engine.newton import NEWTON, on_half_as_many_cells
from vegglue.errors import InputError
from vegglue.parallel import in_threads
from vegglue.progress import Watch
from vegglue.wording.phases import AT_PLACE, TOWARDS_PLACE

# Points of the prior that are computed on the coarse grid, and how many of them the fit starts from. Chosen, not
# measured: more cost runs of the coarse model and guard against a local minimum.
PRIOR_POINTS, FITTED_POINTS = 8, 2
# Objectives of two ends by which they are of one minimum at most [-]: fits of one minimum differ by up to 0.2 in open-b
# and open-e and 1.4 in river-h, those of set H2 of docs/measured.md, which has several, by 24 and more.
ONE_MINIMUM = 2.0
# Their spread over that of the prior [-]: at its ends a flow is not always found. Chosen, not measured.
START_SPREAD = 0.7
# Standard errors by which the model's own error has to move the best place to be computed again there. Chosen, not
# measured: each time costs the adjoints of all stations and a fit.
FAR_MOVED = 1.0
# Cells across the floor of the channel below which fingerprints are not computed on a grid. Chosen, not measured: a
# lower bound makes more searches cheap, and their fingerprints less exact.
FEWEST_CELLS_ACROSS = 7.0
# Baselines that are kept, of a case and its child [-]: each holds factors of all its experiments, each 0.2 GB by its
# size at 1142 x 40 cells.
MOST_KEPT = 2
# Keys of a case that change no calibration, in the form in which pydantic leaves them out.
ONLY_NAMED = dict.fromkeys(
    ("name", "title", "simulate", "infer", "survey", "validation", "reference", "canopy_correction", "planned"), True
) | {"frame": True, "imported": True}
_kept: OrderedDict[str, "Baseline"] = OrderedDict()


@dataclass(frozen=True)
class Baseline:
    """A calibrated model.

    Attributes
    ----------
    coarse : Model or None
        On cells of twice the size, None if the grid cannot be coarsened.
    on_coarse : Point or None
        Of the coarse model at the same z, None without a steady flow there.
    """

    model: Model
    noise: Noise
    fitted: MapEstimate
    coarse: Model | None
    on_coarse: Point | None


@dataclass(frozen=True)
class SearchModel:
    """A cheap model for the search for missing effects.

    Attributes
    ----------
    point : Point
        At the MAP estimate.
    """

    model: Model
    noise: Noise
    point: Point

    @cached_property
    def log_evidence(self) -> float:
        """ln p(y) of the model with nothing more, calibrated on its own cells (`log_evidence_under`) [-]."""
        return log_evidence_under(fit(self.model, self.noise, self.point))


def baseline(model: Model, known: Array | None = None, beside: Baseline | None = None) -> Baseline:
    """The calibrated model; on cells of twice the size, where a fit costs a quarter, as far as possible.

    Parameters
    ----------
    model : Model
        Of a case with at least one parameter.
    known : array (p,), optional
        z to start from, else the best points of the prior on coarse grids.
    beside : Baseline, optional
        Of another bed on the same grid, with whose noise the search begins at its place from its flows.

    Returns
    -------
    Baseline
        Under the errors of the data, the grid and the model.

    Raises
    ------
    InputError
        If no steady flow is found, or there is nothing to calibrate.
    """
    refuse_without_parameters(model.case)
    coarse, noise = coarser(model), noise_of(model.station) if beside is None else beside.noise
    before, near = (None, None) if beside is None else (beside.fitted.point, beside.on_coarse)
    known = known if before is None else before.z
    if coarse is None:
        start = _best_from_prior(model, noise) if known is None else linearise_from(model, known, before)
        return with_own_error(Baseline(model, noise, fit(model, noise, _with_steady_flow(model, start)), None, None))
    if known is not None:
        near = linearise_from(coarse, known, near)
    elif (coarsest := coarser(coarse) or on_half_as_many_cells(coarse)) is None:
        near = _best_from_prior(coarse, noise)
    else:
        there = _best_from_prior(coarsest, noise)
        start = linearise_from(coarse, there.z, there)
        if start is None:
            raise InputError(f"{model.case.name}: no steady flow on cells of half the size was found; refine `grid`.")
        near = fit(coarse, noise, start).point
    if near is not None and cells_across(coarse.site) >= FEWEST_CELLS_ACROSS:
        noise = with_own_error_at(noise, coarse, near)
        near = near if known is not None else fit(coarse, noise, near).point
    z = known if near is None else near.z
    if near is not None and beside is not None and beside.on_coarse is not None:
        start = linearise_as_coarse(model, beside.fitted.point, beside.on_coarse, near)
    else:
        start = None if z is None else linearise_from(model, z, near)
    if start is None and known is None:  # the best point of the coarser cells has no flow on these
        start = _best_from_prior(model, noise)
    base = under_error_of_grid(Baseline(model, noise, at_point(noise, _with_steady_flow(model, start)), coarse, near))
    return with_own_error(base) if near is None else with_own_error_again(base, near.z)


def _with_steady_flow(model: Model, start: Point | None) -> Point:
    if start is None:
        raise InputError(f"{model.case.name}: the model finds no steady flow at its best point; widen the priors.")
    return start


def _best_from_prior(model: Model, noise: Noise) -> Point:
    """The point of the best fit among those that start from the FITTED_POINTS with the least objective, or from all if
    these end in different minima; on a wide grid searched on half as many cells each way, and fitted again here.
    """
    rough = on_half_as_many_cells(model) if model.site.bed.shape[1] >= WIDE_FROM else None
    if rough is not None:
        there = _best_from_prior(rough, noise)
        start = linearise_from(model, there.z, there)
        if start is not None:
            return fit(model, noise, start).point
    middle, *others = places_of_prior(len(model.names))
    first = linearise(model, middle)
    tried = [first, *in_threads(linearise_from, [(model, z, first) for z in others])]
    found = [point for point in tried if point is not None]
    if not found:
        raise InputError(
            f"{model.case.name}: no steady flow was found at any of {PRIOR_POINTS} points of the prior; see in "
            "`vegglue check` outlet, inflow and bed, and correct levels, discharges or priors."
        )
    starts = [(model, noise, start) for start in sorted(found, key=lambda point: objective(noise, point))]
    ends = in_threads(fit, starts[:FITTED_POINTS])
    if np.ptp([one.objective for one in ends]) > ONE_MINIMUM:
        ends += in_threads(fit, starts[FITTED_POINTS:])
    return min(ends, key=lambda found: found.objective).point


def places_of_prior(parameters: int) -> Array:
    """z = START_SPREAD Phi^-1((k + 1/2) / PRIOR_POINTS), k in random order for each parameter: a Latin hypercube.

    Parameters
    ----------
    parameters : int
        p.

    Returns
    -------
    ndarray (PRIOR_POINTS, p)
        [standard deviations of the prior]; the first is replaced by the middle of the prior.

    References
    ----------
    McKay, Beckman and Conover (1979), doi:10.2307/1268522; not checked against it.
    """
    shares = np.tile(np.arange(PRIOR_POINTS), (parameters, 1))
    order = np.random.default_rng(1).permuted(shares, axis=1).T
    places = START_SPREAD * ndtri((order + 0.5) / PRIOR_POINTS)
    places[0] = 0.0
    return np.asarray(places)


def under_error_of_grid(trial: Baseline) -> Baseline:
    """The model calibrated on its own cells from a trial, the error of its grid computed again where that ends.

    Returns
    -------
    Baseline
        Without the model's own error, unless the trial has it.
    """

    def with_error_of_grid(base: Baseline) -> Baseline:
        noise = with_grid_error(base.noise, grid_difference(base.fitted.point, base.on_coarse))
        return replace(base, noise=noise, fitted=fit(base.model, noise, base.fitted.point))

    return with_error_of_grid(with_coarse_point(with_error_of_grid(trial)))


def grid_difference(point: Point, on_coarse: Point | None) -> Array:
    """f - f_coarse, to cells of twice the size.

    Parameters
    ----------
    on_coarse : Point or None
        At the same z; None if no steady flow is found there.

    Returns
    -------
    ndarray (station,)
        [unit of each station]; zero without the coarse point.
    """
    return point.prediction - (point if on_coarse is None else on_coarse).prediction


def with_coarse_point(base: Baseline) -> Baseline:
    """With the point on coarse cells at the same z."""
    coarse, z, known = base.coarse, base.fitted.point.z, base.on_coarse
    if coarse is None or (known is not None and np.array_equal(known.z, z)):
        return base
    return replace(base, on_coarse=linearise(coarse, z, known))


def with_own_error(base: Baseline) -> Baseline:
    """The baseline with the model's own error M as the case allows it, computed at its point, and calibrated under it.

    Returns
    -------
    Baseline
        The same if no error is allowed.
    """
    allowed = base.model.case.model_error
    if not any_error(base.model.case, allowed):
        return base
    where = model_that_errs(base)
    noise = with_model_error(base.noise, model_error_columns(where.model, where.point, allowed))
    fitted = fit(base.model, noise, base.fitted.point)
    return with_coarse_point(replace(base, noise=noise, fitted=fitted))


def with_own_error_again(base: Baseline, z: Array) -> Baseline:
    """`with_own_error`, unless coarse cells gave it near enough: |z - z_best| <= FAR_MOVED standard errors.

    Parameters
    ----------
    z : ndarray (p,)
        Where coarse cells gave it. If sides of patches may lie off it is computed anew in any case.
    """
    if base.noise.model_error.any() and not base.model.case.model_error.edges:
        moved = np.abs(base.fitted.point.z - z) / np.sqrt(np.diag(base.fitted.covariance))
        if moved.max(initial=0.0) <= FAR_MOVED:
            return with_coarse_point(base)
    # The model's own error moves the best place, and is another there.
    return with_own_error(base)


def with_own_error_at(noise: Noise, coarse: Model, point: Point) -> Noise:
    """The noise with the model's own error M as computed on coarse cells.

    Parameters
    ----------
    point : Point
        Of the coarse model.
    """
    return with_model_error(noise, model_error_columns(coarse, point, coarse.case.model_error))


def model_that_errs(base: Baseline) -> SearchModel:
    """The model on the cells on which its own error is computed.

    Returns
    -------
    SearchModel
        On the cells of the case if sides of patches may lie off, since cells of twice the size do not resolve what
        water does there; else `search_model`.
    """
    if base.model.case.model_error.edges:
        return SearchModel(base.model, base.noise, base.fitted.point)
    return search_model(base)


def with_error_there(where: SearchModel, cells: CellResponses | None = None) -> SearchModel:
    """The model with its own error M as computed at its point, see `model_error_columns`.

    What is known of parts of that error then is no more than all of it. That of a baseline is of a point before its
    last fit.

    Parameters
    ----------
    cells : CellResponses, optional
        To the terms of `terms_that_err`, if they are known.
    """
    columns = model_error_columns(where.model, where.point, where.model.case.model_error, cells)
    return replace(where, noise=with_model_error(where.noise, columns))


def search_model(base: Baseline) -> SearchModel:
    """y_coarse = y - (f - f_coarse): the model on cells of twice the size, with the residuals of the fine one.

    Returns
    -------
    SearchModel
        The model itself if the coarse one has fewer than FEWEST_CELLS_ACROSS.
    """
    point, searched = base.fitted.point, coarse_search(base)
    if searched is None:
        return SearchModel(base.model, base.noise, point)
    coarse, on_coarse = searched
    shift = base.noise.used(point.prediction - on_coarse.prediction)
    return SearchModel(coarse, replace(base.noise, value=base.noise.value - shift), on_coarse)


def coarse_search(base: Baseline) -> tuple[Model, Point] | None:
    """The model on cells of twice the size on which missing effects are searched.

    Returns
    -------
    (Model, Point) or None
        None if they are searched on the case's own cells: the coarse ones are fewer than FEWEST_CELLS_ACROSS, or have
        no steady flow.
    """
    if base.coarse is None or base.on_coarse is None or cells_across(base.coarse.site) < FEWEST_CELLS_ACROSS:
        return None
    return base.coarse, base.on_coarse


def searched_by_itself(base: Baseline) -> Baseline:
    """The baseline with factors of its own at the point of its search: many responses are computed there."""
    searched = coarse_search(base)
    if searched is not None:
        return replace(base, on_coarse=relinearised(*searched))
    return replace(base, fitted=replace(base.fitted, point=relinearised(base.model, base.fitted.point)))


def log_evidence(base: Baseline) -> float:
    """ln p(y) - ln|C|/2,   C the covariance of the errors: evidence of models whose errors differ.

    Parameters
    ----------
    base : Baseline
        Under the errors of its noise: a screening estimates them again, and keeps the place of the fit.

    Returns
    -------
    float
        [-], up to a constant of the data.
    """
    here = at_point(base.noise, base.fitted.point)
    return log_evidence_under(here) - float(np.log(np.diag(base.noise.lower)).sum())


def for_prediction(base: Baseline) -> Baseline:
    """The model calibrated for predictions on its own grid: c = 0, errors of the grid independent between stations.

    Returns
    -------
    Baseline
        The same if its grid cannot be coarsened.
    """
    if base.coarse is None:
        return base
    noise = with_independent_grid_errors(base.noise)
    return replace(base, noise=noise, fitted=fit(base.model, noise, base.fitted.point))


def kept_baseline(model: Model) -> Baseline:
    """`baseline` of a model from its prior, kept in memory by its grid, measurements and priors.

    Parameters
    ----------
    model : Model
        One with code of the user, an engine or effects, is calibrated each time: it may have changed.

    Raises
    ------
    InputError
        As `baseline`.
    """
    if model.engine is not NEWTON or model.case.effect_file is not None:  # codes of users, which may have changed
        return baseline(model)
    digest = hashlib.sha256(json.dumps(plain_tree(dumped(model.case, ONLY_NAMED), str)).encode())
    for site in (model.site, *model.site.own.values()):
        for values in (site.bed, site.friction_class, site.patch, site.cover):
            digest.update(values.tobytes())
    digest.update(pd.util.hash_pandas_object(model.station, index=False).to_numpy().tobytes())
    found = _kept.pop(digest.hexdigest(), None)
    if found is None:
        found = baseline(model)
    else:
        found = replace(found, model=model, coarse=None if found.coarse is None else coarser(model))
    _kept[digest.hexdigest()] = found
    while len(_kept) > MOST_KEPT:
        _kept.popitem(last=False)
    return found


# Places at which the command is linearised at most, and how often a step that fits worse is halved. Chosen, not
# measured: most cases need three places, and each costs two runs for each parameter.
MOST_PLACES, MOST_HALVINGS = 8, 4


@dataclass(frozen=True)
class CommandPlace:
    """A model with the engine of its command, corrected where the command fits best.

    Attributes
    ----------
    z : ndarray (p,)
        That place [standard deviations of the prior].
    settled : bool
        Whether the next step would have been negligible.
    places : int
        At how many the slopes of the command were taken.
    correction : Correction
        At z.
    run : ndarray (k, q)
        Where the command ran in the search [standard deviations of the prior].
    failed : int
        Number of runs that failed.
    """

    model: Model
    z: Array
    settled: bool
    places: int
    correction: Correction
    run: Array
    failed: int


def command_place(runs: CommandRuns, model: Model, watch: Watch) -> CommandPlace:
    """The place where the command of a case fits best.

    The search starts from the first place of the prior where the command runs: it depends on nothing but the case.

    Parameters
    ----------
    watch : callable
        Is called with each phase, and with the number of runs that are done.

    Raises
    ------
    InputError
        If the command runs at none of these places, or the built-in engine finds no flow.
    """

    tried: list[Correction] = []

    def correction_there(z: Array, phase: Watch, slopes: bool = True) -> Correction:
        tried.append(correction_at(runs, model, z, phase, slopes))
        return tried[-1]

    def found(settled: bool) -> CommandPlace:
        run = np.unique(np.concatenate([one.run for one in tried]), axis=0)
        return CommandPlace(here, z, settled, places, correction, run, sum(one.failed for one in tried))

    def in_phase(words: str, place: int) -> Watch:
        """A phase of its own, so that the time that is left is that of its runs."""
        return lambda now: watch(replace(now, phase=words.format(now.phase, place)))

    def model_at(correction: Correction, phase: Watch = watch) -> Model:
        return replace(model, engine=corrected(correction, runs, phase))

    def objective_at(here: Model, noise: Noise, z: Array) -> float:
        point = linearise(here, z)
        return np.inf if point is None else objective(noise, point)

    def lower_place(here: Model, base: Baseline, z: Array, phase: Watch) -> Array | None:
        """A place towards the calibrated model where the command itself fits better than at z (p,), if there is one."""
        before, step = objective_at(here, base.noise, z), base.fitted.point.z - z
        for _ in range(MOST_HALVINGS):
            try:
                there = correction_there(z + step, phase, slopes=False)
            except InputError:  # the command fails there: it may not nearer by
                there = None
            if there is not None and objective_at(model_at(there, phase), base.noise, z + step) < before:
                return np.asarray(z + step)
            step = step / 2.0
        return None

    z, correction = _first_place(model, lambda z, slopes: correction_there(z, in_phase(AT_PLACE, 1), slopes))
    here = model_at(correction)
    base = baseline(here)
    for places in range(1, MOST_PLACES + 1):
        away = base.fitted.point.z - z
        if away @ np.linalg.solve(base.fitted.covariance, away) < NEGLIGIBLE_DECREASE:
            return found(True)
        if places == MOST_PLACES:
            break
        lower = lower_place(here, base, z, in_phase(TOWARDS_PLACE, places + 1))
        if lower is None:
            break
        z, correction = lower, correction_there(lower, in_phase(AT_PLACE, places + 1))
        here = model_at(correction)
        base = baseline(here, z)
    return found(False)


def _first_place(model: Model, correction_there: Callable[[Array, bool], Correction]) -> tuple[Array, Correction]:
    """The middle of the prior or, if the command fails there, the next of `places_of_prior`."""
    refused: InputError | None = None
    for z in places_of_prior(len(model.names)):
        try:
            correction_there(z, False)  # alone: a command that fails may take its time
            return z, correction_there(z, True)
        except InsensitiveCommandError:  # it fails anywhere else too
            raise
        except InputError as error:
            refused = error
    assert refused is not None
    raise refused
