"""A posterior by importance sampling around the best fits, which are searched from the best members of an ensemble, or
from points of the prior; and what it gives besides its draws: modes, errors, and predictions of held-out data.

    p(z | y) ~ exp(-|W (y - f(z))|^2 / 2 - |z|^2 / 2),   W' W the inverse covariance of the errors

z are the parameters on a scale on which the prior is standard normal. f is the flow model itself: every draw is a run.
Of a command it may be a surrogate, which is learned first.
"""

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
from scipy.special import ndtr

from vegglue.arrays import Array
from vegglue.calibration.fit import chance_of_misfit, freedom_of_misfit, squared_misfit
from vegglue.calibration.noise import Noise, covariance_of
from vegglue.case.parameter_space import sample_prior, theta_at
from vegglue.case.schema import Case
from vegglue.engine.interface import Model, predict
from vegglue.engine.model import with_compilation
from vegglue.inference.glue import check_stations, efficiency
from vegglue.inference.homogeneity import transfer
from vegglue.inference.importance_sampling import LogDensity, Sample, mixture_at_modes, sample
from vegglue.inference.posterior_modes import ModesAndErrors, members_of, modes_and_errors, points_of_prior
from vegglue.inference.posterior_summary import posterior_of
from vegglue.inference.surrogate import CommandToLearn, learn
from vegglue.inference.weighted_statistics import (
    leave_one_out,
    leave_out,
    log_likelihoods,
    root_mean_square,
    share_inside,
    stations_by_kind,
)
from vegglue.progress import Progress, Watch, counted, silent
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import (
    ErrorModel,
    GroupsLeftOut,
    ImportanceDraws,
    InferenceSettings,
    LeaveOneOut,
    MisfitTest,
    Posterior,
    PosteriorModes,
    Refinement,
    WeightedSample,
)
from vegglue.version import VERSION
from vegglue.wording.numbers import so_many
from vegglue.wording.phases import TRYING_POINTS

# Effective draws that are wanted: an end of the 95 % range then rests on 25 of them.
EFFECTIVE_DRAWS = 1000
# Largest correction that a draw may still need, over the smallest error of a measurement [-]; it is then made, and
# what is left is far smaller. Chosen: on open-b, with and without its effect, predictions moved by at most 2e-4 of
# their errors and ln p by 1e-3, for a sixth less work than with the tolerance of the case. With 0.05 it was 5e-3.
DRAWN_WITHIN = 0.02
# A station is an outlier if errors alone put any of all stations as far off with a chance below this.
OUTLIER_BELOW = 0.01


def refine(
    ensemble: Ensemble | None, model: Model, watch: Watch = silent, command: CommandToLearn | None = None
) -> Posterior:
    """EFFECTIVE_DRAWS of the posterior, or as many as some thousand runs give, and how well they predict held-out data.

    Parameters
    ----------
    ensemble : Ensemble or None
        Its best members start the fits; points of the prior do without one.
    model : Model
        Of the case, with the stations of its measurements; `infer.sigma` sets where the errors come from.
    watch : callable
        Is called with each phase.
    command : CommandToLearn, optional
        Its surrogate is drawn from; the engine of the model is then the built-in one, corrected where it fits best.

    Returns
    -------
    Posterior
        With a refinement, and tests of transfer between experiments.

    Raises
    ------
    InputError
        If the stations are not those that were simulated, a standard error is missing (`sigma: known`) or no flow is
        found from the best members.
    """
    case, station = model.case, model.station
    if ensemble is None:
        watch(Progress(with_compilation(TRYING_POINTS)))
        tried = points_of_prior(model)
    else:
        check_stations(ensemble, station, case.source)
        tried = members_of(ensemble, model)
    base = modes_and_errors(model, tried, case.infer.sigma, watch)
    fits, learned = base.fits, None
    density: LogDensity = partial(log_posterior, base.noise)
    # A component for each mode, its share proportional to exp(-objective / 2) |covariance|^(1/2) (Laplace).
    covariances = np.stack([one.covariance for one in fits])
    mass = np.array([-0.5 * one.objective for one in fits]) + 0.5 * np.linalg.slogdet(covariances)[1]
    start = mixture_at_modes(np.stack([one.point.z for one in fits]), covariances, mass)
    if command is not None:
        learned = learn(command, base, start, watch)
        base, density = learned.base, learned.density
    noise, fits = base.noise, base.fits
    run = partial(predict, solved_for(base.model, noise), [one.point for one in fits])
    finished = counted(watch, f"drawing around {so_many(len(fits), 'mode')}", EFFECTIVE_DRAWS, "effective draws")
    drawn = sample(run, density, start, EFFECTIVE_DRAWS, case.simulate.seed, finished)
    watch(Progress("summing up"))
    theta, residual = theta_at(case, drawn.z), station["value"].to_numpy(float) - drawn.values
    precision = np.asarray(np.linalg.inv(covariance_of(noise)))
    likelihoods = np.full(drawn.values.shape, np.nan)
    likelihoods[:, noise.rows] = log_likelihoods(residual[:, noise.rows], precision)
    weighted = WeightedSample(
        members=len(drawn.weights),
        failed=int(np.sum(np.isnan(drawn.values).any(axis=1))),
        best=int(np.argmax(drawn.log_density)),
        unit={name: case.parameters[name].unit for name in theta},
        theta=theta,
        weights=drawn.weights,
        efficiency=efficiency(residual, station),
        log_likelihood=likelihoods,
        prediction=drawn.values,
    )
    settings = InferenceSettings(
        method="refine" if command is None else "surrogate",
        likelihood="gaussian",
        sigma_rule=case.infer.sigma,
        threshold=-np.inf,
        ensemble_hash="" if ensemble is None else ensemble.config_hash,
        seed=case.simulate.seed,
        version=VERSION,
    )
    error = noise.among_all(np.sqrt(np.diag(covariance_of(noise))), len(station))
    sigma = {kind: root_mean_square(error[rows]) for kind, rows in stations_by_kind(station).items()}
    # L with L L' the covariance of the errors, NaN where a station is not used.
    factor = np.full((len(station), len(station)), np.nan)
    factor[noise.rows] = 0.0
    factor[np.ix_(noise.rows, noise.rows)] = noise.lower
    return replace(
        posterior_of(settings, weighted, case, station, error, sigma, factor),
        refinement=_refinement_of(base, drawn, precision, drawn.values[weighted.best]),
        transfer=transfer(base.model, noise, fits[0].point, case.infer.sigma == "known"),
        surrogate=None if learned is None else learned.result,
    )


def refinable(case: Case) -> bool:
    """Whether the case has a Gaussian likelihood of all members, so that its posterior is a density to draw from."""
    return case.infer.likelihood == "gaussian" and case.infer.behavioural is None


def solved_for(model: Model, noise: Noise) -> Model:
    """The model with its flows solved as exactly as measurements resolve.

    Returns
    -------
    Model
        With a tolerance of DRAWN_WITHIN of the least standard error, or that of the case if it is larger.
    """
    own = model.case.numerics
    tolerance = max(own.tolerance, DRAWN_WITHIN * float(noise.data_error.min()))
    numerics = own.model_copy(update={"tolerance": tolerance})
    return replace(model, case=model.case.model_copy(update={"numerics": numerics}))


def log_posterior(noise: Noise, z: Array, prediction: Array) -> Array:
    """ln p(z | y) = -|W (y - f(z))|^2 / 2 - |z|^2 / 2, up to a constant

    Parameters
    ----------
    z : ndarray (m, p)
        [standard deviations of the prior]
    prediction : ndarray (m, station)
        f [unit of each station], NaN without a flow.

    Returns
    -------
    ndarray (m,)
        [-]; -inf without a prediction at all used stations.
    """
    known = np.isfinite(prediction[:, noise.rows]).all(axis=1)
    logs = np.full(len(z), -np.inf)
    left = noise.value - prediction[np.ix_(known, noise.rows)]
    logs[known] = -0.5 * np.sum(noise.whiten(left.T) ** 2, axis=0) - 0.5 * np.sum(z[known] ** 2, axis=1)
    return logs


def _refinement_of(base: ModesAndErrors, drawn: Sample, precision: Array, best: Array) -> Refinement:
    """What only draws from a density give; precision: inverse covariance of the errors of the used stations (n, n);
    best: predictions of the member that fits best (station,).
    """
    from scipy.stats import kstest  # late: other commands need not wait for it

    case, noise, fits, count = base.model.case, base.noise, base.fits, base.noise.rows.size
    kept, at_all = drawn.weights > 0, partial(noise.among_all, stations=len(base.model.station))
    left, weights = noise.value - drawn.values[np.ix_(kept, noise.rows)], drawn.weights[kept]
    near = np.argmin([np.linalg.norm(drawn.z - one.point.z, axis=1) for one in fits], axis=0)
    modes = theta_at(case, np.stack([one.point.z for one in fits]))
    scored = leave_one_out(left, precision, weights)
    chi2, freedom = squared_misfit(noise, best), freedom_of_misfit(count, fits[0].covariance)
    groups = groups_left_out(base.model.station.iloc[noise.rows])
    without = [leave_out(left, precision, weights, rows) for rows in groups.values()]
    return Refinement(
        error_model=ErrorModel(
            errors="stated" if case.infer.sigma == "known" else "estimated",
            correlation=noise.correlation,
            scale=noise.scale,
            grid_error=root_mean_square(noise.grid_error) if base.grid_error_known else float("nan"),
        ),
        modes=PosteriorModes(
            starts=base.starts,
            mode_theta=np.column_stack(list(modes.values())),
            mode_chi2=np.array([one.chi2 for one in fits]),
            mode_weight=np.bincount(near, drawn.weights, len(fits)),
        ),
        draws=ImportanceDraws(
            drawn=np.array(drawn.drawn),
            worth=np.array(drawn.effective),
            log_density=drawn.log_density,
            prior_theta=sample_prior(case.parameters, len(drawn.z), case.simulate.seed),
        ),
        leave_one_out=LeaveOneOut(
            elpd=float(scored.score.sum()),
            elpd_error=float(np.sqrt(left.shape[1]) * scored.score.std()),
            inside50=share_inside(scored.below, 0.5),
            inside95=share_inside(scored.below, 0.95),
            p_calibration=float(kstest(scored.below, "uniform").pvalue),
            score=at_all(scored.score),
            score_k=at_all(scored.k),
            below=at_all(scored.below),
        ),
        misfit=MisfitTest(
            chi2=chi2,
            freedom=freedom,
            p_misfit=chance_of_misfit(chi2, freedom),
            surprise=at_all(base.standardised),
            outlier=at_all(count * ndtr(-np.abs(base.standardised)) * 2) < OUTLIER_BELOW,
        ),
        groups=GroupsLeftOut(
            left_out=np.array(list(groups), object),
            left_out_stations=np.array([rows.size for rows in groups.values()]),
            left_out_score=np.array([one.score for one in without]),
            left_out_k=np.array([one.k for one in without]),
        ),
    )


def groups_left_out(used: pd.DataFrame) -> dict[str, np.ndarray]:
    """Groups that are predicted from all other stations: each section of each experiment, then each experiment.

    Parameters
    ----------
    used : DataFrame
        The used stations (n rows).

    Returns
    -------
    dict of ndarray
        Rows by name of the group; no sections, or no experiments, if there is only one of them.
    """
    names = used["experiment"].to_numpy()
    sections = used["section"].to_numpy()
    sections = np.where(sections == "", used["kind"] + "s", sections)
    named = np.array([f"{a} {b}" for a, b in zip(names, sections, strict=True)])
    found: dict[str, np.ndarray] = {}
    for labels, word in ((named, ""), (names, "experiment ")):
        each = dict.fromkeys(labels)
        if len(each) > 1:
            found |= {f"{word}{label}": np.flatnonzero(labels == label) for label in each}
    return found
