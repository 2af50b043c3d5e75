"""The modes of the posterior (MAP estimates) and the errors of the data, which importance sampling starts from.

Fits start from several of the best members of an ensemble, or of points of the prior, on cells of four times the size
where the grid can be coarsened so far, and are finished on ever finer ones. Fits that end at the same point count once.
"""

from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, grid_difference, with_own_error
from vegglue.calibration.fit import MapEstimate, determined, fit, fit_from
from vegglue.calibration.noise import Noise, noise_of, with_grid_error, with_scale
from vegglue.calibration.residual_screening import noise_given_all
from vegglue.case.channel_geometry import cells_across
from vegglue.case.parameter_space import refuse_without_parameters, sample_prior, z_at
from vegglue.engine.interface import Model, Point, linearise, linearise_from, predict
from vegglue.engine.model import coarser, ever_coarser
from vegglue.errors import InputError, shown_command
from vegglue.inference.glue import fit_members, sizes_as_stated
from vegglue.parallel import in_threads, parallel_map
from vegglue.progress import Progress, Watch, counted
from vegglue.results.ensemble import Ensemble
from vegglue.wording.phases import FITTING, REFINING_MODES

# Grids that fits go through: chosen. With the third the search for modes of the demo takes 24 s of one core, not 31; a
# fourth hardly resolves a section.
MOST_GRIDS = 3
# Cells across the floor of the channel below which a grid is left out: with two of them, two patches beside each other
# had one mode whichever way round they lay, with four both were found.
FEWEST_ACROSS = 4.0
# Points of the prior that are tried without an ensemble: as many as the best members that starts are chosen from.
# Chosen: on 100 x 12 cells with three experiments they take 1.5 s of a core.
TRIED_POINTS = 64
# Members that fits start from at most, among how many of the best, and their least distance [standard deviations of the
# prior]. Chosen, not measured: more starts find more modes and each costs a fit.
MOST_STARTS, BEST_MEMBERS, START_DISTANCE = 4, 64, 0.7
# Rise of the objective [-] above that of the best mode from which a mode is left out: its weight is below exp(-15).
NEGLIGIBLE_MODE = 30.0
# Times that the size of the errors is estimated from the residual, each followed by a fit. Chosen, not measured:
# further ones cost runs of the model.
SIZE_ESTIMATES = 2


@dataclass(frozen=True)
class TriedMembers:
    """Members whose predictions are known.

    Attributes
    ----------
    z : ndarray (m, p)
        [standard deviations of the prior]
    prediction : ndarray (m, station)
        [unit of each station], NaN of a member that failed.
    """

    z: Array
    prediction: Array


def members_of(ensemble: Ensemble, model: Model) -> TriedMembers:
    """The members of an ensemble on the scale of the prior.

    Parameters
    ----------
    model : Model
        With the priors.
    """
    return TriedMembers(z_at(model.case, ensemble.parameters), ensemble.prediction)


def points_of_prior(model: Model) -> TriedMembers:
    """TRIED_POINTS of the prior, Sobol' points, on the coarsest cells that fits go through.

    Parameters
    ----------
    model : Model
        On the case's own grid.

    Returns
    -------
    TriedMembers
        Predictions are NaN at a point without a flow; at all, if no point has one.

    Raises
    ------
    InputError
        If the case has no parameters.
    """
    refuse_without_parameters(model.case)
    coarsest = grids_of(model)[0]
    z = z_at(model.case, sample_prior(model.case.parameters, TRIED_POINTS, model.case.simulate.seed))
    middle = linearise(coarsest, np.zeros(z.shape[1]))
    if middle is None:
        middle = next((one for one in (linearise(coarsest, place) for place in z) if one is not None), None)
    known = np.full((len(z), len(model.station)), np.nan)
    return TriedMembers(z, known if middle is None else predict(coarsest, [middle], z))


def grids_of(model: Model) -> list[Model]:
    """The model on the grids that fits go through.

    Parameters
    ----------
    model : Model
        On the case's own grid.

    Returns
    -------
    list of Model
        MOST_GRIDS at most, each of cells half as large as the one before, its own last; none of the others has fewer
        than FEWEST_ACROSS cells across the floor.
    """
    *coarse, own = ever_coarser(model.case, model.site)[-MOST_GRIDS:]
    places = [*((case, site) for case, site in coarse if cells_across(site) >= FEWEST_ACROSS), own]
    return [replace(model, case=case, site=site) for case, site in places]


@dataclass(frozen=True)
class FoundModes:
    """The modes of a posterior.

    Attributes
    ----------
    fits : tuple of MapEstimate
        On the case's own grid, the best first.
    starts : int
        Number of members that the search started from.
    on_coarse : tuple of MapEstimate
        Those on cells of twice the size that led there, none if there are no such cells.
    """

    fits: tuple[MapEstimate, ...]
    starts: int
    on_coarse: tuple[MapEstimate, ...]

    def coarse_point(self, coarse: Model) -> Point | None:
        """The best mode's place on cells of twice the size, from the nearest that is known there, if any is."""
        z, known = self.fits[0].point.z, [one.point for one in self.on_coarse]
        near = min(known, key=lambda point: float(np.linalg.norm(point.z - z)), default=None)
        return linearise_from(coarse, z, near)


def find_modes(model: Model, noise: Noise, tried: TriedMembers, watch: Watch) -> FoundModes:
    """The modes of the posterior under given errors. If none is refined on finer cells, the members start there.

    Parameters
    ----------
    model : Model
        On the case's own grid.
    tried : TriedMembers
        Of whose best the search starts.
    watch : callable
        Is called with each fit.

    Returns
    -------
    FoundModes
        One at least.

    Raises
    ------
    InputError
        If no steady flow is found from any of the members.
    """
    starts, grids = starting_points(noise, tried.z, tried.prediction), grids_of(model)

    def fit_all(on: Model) -> list[MapEstimate]:
        finished = counted(watch, FITTING, len(starts), "members")
        ends = parallel_map(partial(fit_from, on, noise), [(z,) for z in starts], finished)
        return [end for end in ends if end is not None]

    before: list[MapEstimate] = []
    ends = _apart(fit_all(grids[0]))
    for coarse, finer in pairwise(grids):
        finished = counted(watch, REFINING_MODES, len(ends), "modes")
        refined = parallel_map(partial(_refine, finer, coarse, noise), [(end,) for end in ends], finished)
        found = [end for end in refined if end is not None]
        before, ends = ends, distinct_modes(found or fit_all(finer))
    if not ends:
        source = model.case.source
        raise InputError(
            f"{model.case.name}: no steady flow was found from the best members; run "
            f"{shown_command('simulate', source)} and {shown_command('infer', source, '--method', 'glue')}."
        )
    return FoundModes(tuple(ends), len(starts), tuple(before))


def starting_points(noise: Noise, z: Array, prediction: Array) -> Array:
    """The members of the least |W (y - f)|^2 + |z|^2, more than START_DISTANCE apart.

    Parameters
    ----------
    z : ndarray (m, p)
        [standard deviations of the prior]
    prediction : ndarray (m, station)
        [unit of each station]

    Returns
    -------
    ndarray (k, p)
        MOST_STARTS at most of the best BEST_MEMBERS, the best first.

    Raises
    ------
    InputError
        If no member has a prediction at all used stations.
    """
    residual = noise.value - prediction[:, noise.rows]
    known = np.flatnonzero(np.isfinite(residual).all(axis=1))
    if not known.size:
        raise InputError(f"ensemble: none of the {len(z)} members was solved; see the reasons stored with them.")
    misfit = np.sum(noise.whiten(residual[known].T) ** 2, axis=0) + np.sum(z[known] ** 2, axis=1)
    order = known[np.argsort(misfit, kind="stable")][:BEST_MEMBERS]
    chosen = [int(order[0])]
    for member in order[1:]:
        if len(chosen) < MOST_STARTS and np.linalg.norm(z[chosen] - z[member], axis=1).min() > START_DISTANCE:
            chosen.append(int(member))
    return np.asarray(z[chosen])


def _refine(model: Model, coarse: Model, noise: Noise, end: MapEstimate) -> MapEstimate | None:
    """The fit on coarse cells with y_coarse = y - (f - f_coarse), then on the fine ones."""
    start = linearise(model, end.point.z, end.point)
    if start is None:
        return None
    changed = noise.used(start.prediction - end.point.prediction)
    there = fit(coarse, replace(noise, value=noise.value - changed), end.point).point.z
    nearer = linearise(model, there, start)
    return fit(model, noise, start if nearer is None else nearer)


def distinct_modes(ends: list[MapEstimate]) -> list[MapEstimate]:
    """Fits, best first, without those within one standard deviation of a better one, or NEGLIGIBLE_MODE above the best.

    Parameters
    ----------
    ends : list of MapEstimate
        In any order; distances are (dz' V^-1 dz)^(1/2), V the covariance of the better one.
    """
    found = _apart(ends)
    return [end for end in found if end.objective - found[0].objective < NEGLIGIBLE_MODE]


def _apart(ends: list[MapEstimate]) -> list[MapEstimate]:
    """The fits, best first, but none within one standard deviation of a better one.

    On coarse cells no more can be left out: their errors move objectives by more than NEGLIGIBLE_MODE.
    """

    def distance(end: MapEstimate, z: Array) -> float:
        away = z - end.point.z
        return float(np.sqrt(away @ np.linalg.solve(end.covariance, away)))

    found: list[MapEstimate] = []
    for end in sorted(ends, key=lambda one: one.objective):
        if all(distance(other, end.point.z) > 1.0 for other in found):
            found.append(end)
    return found


@dataclass(frozen=True)
class ModesAndErrors:
    """The modes of a posterior under the final errors.

    Attributes
    ----------
    fits : tuple of MapEstimate
        The best first.
    starts : int
        Number of members that the search started from.
    standardised : ndarray (n,)
        T_i of each used station, see `standardised_residual`.
    grid_error_known : bool
        Whether the noise holds the error of the grid.
    """

    model: Model
    noise: Noise
    fits: tuple[MapEstimate, ...]
    starts: int
    standardised: Array
    grid_error_known: bool


def modes_and_errors(model: Model, tried: TriedMembers, rule: str, watch: Watch) -> ModesAndErrors:
    """The modes from the best of the members that were tried; then the errors, and the modes under these.

    The correlation along a section is estimated under both rules, see `estimate_noise`.

    Parameters
    ----------
    model : Model
        On the case's own grid.
    tried : TriedMembers
        Of an ensemble or of the prior.
    rule : str
        `known`: errors as stated, the error of the grid from the difference to cells of twice the size, and that of the
        model as the case allows it. `best-member`: errors of one size for each kind of measurement, from the residual
        at the best mode, which holds both.
    watch : callable
        Is called with each phase.

    Returns
    -------
    ModesAndErrors
        One mode at least.

    Raises
    ------
    InputError
        If a standard error is missing (`known`) or no flow is found.
    """
    without_errors = model.station.assign(standard_error=np.nan)
    if rule == "known":
        noise = noise_of(model.station)
    else:
        noise = noise_of(without_errors, fit_members(tried.prediction, model.station, rule).sigma)
    modes = find_modes(model, noise, tried, watch)
    watch(Progress("estimating the errors"))
    fits, coarse = list(modes.fits), coarser(model)
    on_coarse = None if coarse is None else modes.coarse_point(coarse)

    def refitted() -> list[MapEstimate]:
        return distinct_modes(in_threads(fit, [(model, noise, one.point) for one in fits]))

    if rule == "known":
        noise = with_grid_error(noise, grid_difference(fits[0].point, on_coarse))
        noise = with_own_error(Baseline(model, noise, fits[0], coarse, on_coarse)).noise
    for _ in range(SIZE_ESTIMATES if rule != "known" else 0):
        # s_k^2 = sum_k r^2 / (n_k (1 - p / n)) for each kind k of enough readings; p: effective number of parameters.
        residual = noise.residual(fits[0].point.prediction)
        kind = model.station["kind"].to_numpy()[noise.rows]
        free = max(1.0 - determined(fits[0].covariance) / residual.size, 1.0 / residual.size)
        sigma = {str(k): float(np.sqrt(np.mean(residual[kind == k] ** 2) / free)) for k in np.unique(kind)}
        noise = noise_of(without_errors, sigma | sizes_as_stated(model.station))
        fits = refitted()
    estimated = noise_given_all(Baseline(model, noise, fits[0], coarse, on_coarse))
    noise = estimated if rule == "known" else with_scale(estimated, 1.0)
    fits = refitted()
    standardised = standardised_residual(noise, fits[0].point)
    grid_error_known = rule == "known" and on_coarse is not None
    return ModesAndErrors(model, noise, tuple(fits), modes.starts, standardised, grid_error_known)


def standardised_residual(noise: Noise, point: Point) -> Array:
    """T_i = e_i' M r / (e_i' M e_i)^(1/2),   M = C^-1 with the slopes projected out

    Parameters
    ----------
    noise : Noise
        C is the covariance of its errors.
    point : Point
        Of the residual r and the slopes.

    Returns
    -------
    ndarray (n,)
        [standard errors], each standard normal under the null.
    """
    inverse = np.linalg.solve(noise.lower.T, np.linalg.solve(noise.lower, np.eye(noise.rows.size)))
    slope = noise.used(point.slope)
    pulled = inverse @ slope
    middle = np.linalg.inv(slope.T @ pulled + np.eye(point.z.size))
    projected = inverse - pulled @ middle @ pulled.T
    force = projected @ noise.residual(point.prediction) + pulled @ middle @ point.z
    return np.asarray(force / np.sqrt(np.diag(projected)))
