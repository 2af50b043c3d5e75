"""What a refined posterior tells besides its weighted draws: its modes, its errors, and predictions of unseen data.

A posterior by importance sampling around the best fits, which are searched from the best members of an ensemble, or
from points of the prior where there is none.

    p(z | y) ~ exp(-|W (y - f(z))|^2 / 2 - |z|^2 / 2),   W' W the inverse covariance of the errors

z are the parameters on a scale on which the prior is standard normal. f is the flow model itself: every draw is a run.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
from scipy.special import ndtr

from vegglue.arrays import Array
from vegglue.calibration.fit import MapEstimate, chance_of_misfit, freedom_of_misfit, squared_misfit
from vegglue.calibration.noise import Noise, covariance_of
from vegglue.case.parameter_space import theta_at
from vegglue.case.prior import sample_prior
from vegglue.case.schema import Case
from vegglue.engine.interface import Model, predict
from vegglue.inference.glue import check_stations, efficiency
from vegglue.inference.homogeneity import transfer
from vegglue.inference.importance_sampling import Mixture, Sample, mixture_at_modes, sample
from vegglue.inference.leave_one_out import leave_one_out, leave_out, log_likelihoods, share_inside
from vegglue.inference.posterior_modes import ModesAndErrors, members_of, modes_and_errors, points_of_prior
from vegglue.inference.posterior_summary import posterior_of
from vegglue.inference.weighted_statistics import root_mean_square, stations_by_kind
from vegglue.progress import Progress, Watch, counted, silent
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import InferenceSettings, Posterior, WeightedSample
from vegglue.results.refinement import (
    ErrorModel,
    GroupsLeftOut,
    ImportanceDraws,
    LeaveOneOut,
    MisfitTest,
    PosteriorModes,
    Refinement,
)
from vegglue.version import VERSION
from vegglue.wording.numbers import so_many

# A station is an outlier when errors alone put any of all stations as far off with a chance below this.
OUTLIER_BELOW = 0.01


def refinement_of(base: ModesAndErrors, drawn: Sample, best: int) -> Refinement:
    """base: errors and modes; drawn: the members drawn around the modes; best: index of the member that fits best."""
    case, noise = base.model.case, base.noise
    kept = drawn.weights > 0
    left, weights = noise.value - drawn.values[np.ix_(kept, noise.rows)], drawn.weights[kept]
    precision = precision_of(noise)
    at_all = partial(noise.among_all, stations=len(base.model.station))
    return Refinement(
        error_model=ErrorModel(
            errors="stated" if case.infer.sigma == "known" else "estimated",
            correlation=noise.correlation,
            scale=noise.scale,
            grid_error=root_mean_square(noise.grid_error) if base.grid_error_known else float("nan"),
        ),
        modes=_modes(base, drawn),
        draws=ImportanceDraws(
            drawn=np.array(drawn.drawn),
            worth=np.array(drawn.effective),
            log_density=drawn.log_density,
            prior_theta=sample_prior(case.parameters, len(drawn.z), case.simulate.seed),
        ),
        leave_one_out=_leave_one_out(left, precision, weights, at_all),
        misfit=_misfit(base, drawn.values[best], at_all),
        groups=_groups_left_out(left, precision, weights, base.model.station.iloc[noise.rows]),
    )


def _modes(base: ModesAndErrors, drawn: Sample) -> PosteriorModes:
    near = np.argmin([np.linalg.norm(drawn.z - one.point.z, axis=1) for one in base.fits], axis=0)
    theta = theta_at(base.model.case, np.stack([one.point.z for one in base.fits]))
    return PosteriorModes(
        starts=base.starts,
        mode_theta=np.column_stack(list(theta.values())),
        mode_chi2=np.array([one.chi2 for one in base.fits]),
        mode_weight=np.bincount(near, drawn.weights, len(base.fits)),
    )


def _leave_one_out(left: Array, precision: Array, weights: Array, at_all: Callable[[Array], Array]) -> LeaveOneOut:
    """Residuals (m, n) of members with weights (m,); at_all puts values of the used stations (n,) among all."""
    from scipy.stats import kstest  # late: other commands need not wait for it

    scored = leave_one_out(left, precision, weights)
    return LeaveOneOut(
        elpd=float(scored.score.sum()),
        elpd_error=float(np.sqrt(left.shape[1]) * scored.score.std()),
        inside50=share_inside(scored.below, 0.5),
        inside95=share_inside(scored.below, 0.95),
        p_calibration=float(kstest(scored.below, "uniform").pvalue),
        score=at_all(scored.score),
        score_k=at_all(scored.k),
        below=at_all(scored.below),
    )


def _misfit(base: ModesAndErrors, prediction: Array, at_all: Callable[[Array], Array]) -> MisfitTest:
    """chi2 = |W (y - f)|^2 of the best member's predictions f (station,), and each residual that stands out."""
    noise, count = base.noise, base.noise.rows.size
    chi2 = squared_misfit(noise, prediction)
    freedom = freedom_of_misfit(count, base.fits[0].covariance)
    return MisfitTest(
        chi2=chi2,
        freedom=freedom,
        p_misfit=chance_of_misfit(chi2, freedom),
        surprise=at_all(base.standardised),
        outlier=at_all(count * ndtr(-np.abs(base.standardised)) * 2) < OUTLIER_BELOW,
    )


def _groups_left_out(left: Array, precision: Array, weights: Array, used: pd.DataFrame) -> GroupsLeftOut:
    groups = groups_left_out(used)
    without = [leave_out(left, precision, weights, rows) for rows in groups.values()]
    return GroupsLeftOut(
        left_out=np.array(list(groups), object),
        left_out_stations=np.array([rows.size for rows in groups.values()]),
        left_out_score=np.array([one.score for one in without]),
        left_out_k=np.array([one.k for one in without]),
    )


def groups_left_out(used: pd.DataFrame) -> dict[str, np.ndarray]:
    """Rows of each section of each experiment, then of each experiment; none where there is only one of them."""
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


def precision_of(noise: Noise) -> Array:
    """Inverse covariance of the errors of the used stations, (n, n)."""
    return np.asarray(np.linalg.inv(covariance_of(noise)))


# Effective draws that are asked for: an end of the 95 % range then rests on 25 of them.
EFFECTIVE_DRAWS = 1000
# Largest correction that a draw may still ask for, over the smallest error of a measurement [-]; it is then made, and
# what is left is far smaller. Chosen: on open-b, with and without its effect, predictions moved by at most 2e-4 of
# their errors and ln p by 1e-3, for a sixth less work than with the tolerance of the case. With 0.05 it was 5e-3.
DRAWN_WITHIN = 0.02


def refine(ensemble: Ensemble | None, model: Model, watch: Watch = silent) -> Posterior:
    """EFFECTIVE_DRAWS of the posterior, or as many as some thousand runs give, and how well they predict unseen data.

    Errors: InputError when the stations are not those that were simulated, a standard error is missing (`sigma: known`)
    or no flow is found from the best members.
    """
    case = model.case
    if ensemble is None:
        watch(Progress("trying points of the prior"))
        tried = points_of_prior(model)
    else:
        check_stations(ensemble, model.station, case.source)
        tried = members_of(ensemble, model)
    base = modes_and_errors(model, tried, case.infer.sigma, watch)
    run = partial(predict, solved_for(base.model, base.noise), [one.point for one in base.fits])
    density, start = partial(log_posterior, base.noise), mixture_around(base.fits)
    finished = counted(watch, f"drawing around {so_many(len(base.fits), 'mode')}", EFFECTIVE_DRAWS, "effective draws")
    drawn = sample(run, density, start, EFFECTIVE_DRAWS, case.simulate.seed, finished)
    watch(Progress("summing up"))
    posterior = _posterior(base, drawn, "" if ensemble is None else ensemble.config_hash)
    return replace(
        posterior,
        refinement=refinement_of(base, drawn, posterior.sample.best),
        transfer=transfer(base.model, base.noise, base.fits[0].point, case.infer.sigma == "known"),
    )


def solved_for(model: Model, noise: Noise) -> Model:
    """The model with its flows solved as exactly as measurements can tell, see DRAWN_WITHIN, or as the case asks."""
    own = model.case.numerics
    tolerance = max(own.tolerance, DRAWN_WITHIN * float(noise.data_error.min()))
    return replace(
        model, case=model.case.model_copy(update={"numerics": own.model_copy(update={"tolerance": tolerance})})
    )


def refinable(case: Case) -> bool:
    """Whether the case has a Gaussian likelihood of all members, so that its posterior is a density to draw from."""
    return case.infer.likelihood == "gaussian" and case.infer.behavioural is None


def log_posterior(noise: Noise, z: Array, prediction: Array) -> Array:
    """ln p(z | y) up to a constant (m,); z (m, p), prediction (m, station), NaN where there is none."""
    known = np.isfinite(prediction[:, noise.rows]).all(axis=1)
    logs = np.full(len(z), -np.inf)
    left = noise.value - prediction[np.ix_(known, noise.rows)]
    logs[known] = -0.5 * np.sum(noise.whiten(left.T) ** 2, axis=0) - 0.5 * np.sum(z[known] ** 2, axis=1)
    return logs


def mixture_around(fits: tuple[MapEstimate, ...]) -> Mixture:
    """A component for each mode, its share proportional to exp(-objective / 2) |covariance|^(1/2) (Laplace)."""
    covariances = np.stack([one.covariance for one in fits])
    mass = np.array([-0.5 * one.objective for one in fits]) + 0.5 * np.linalg.slogdet(covariances)[1]
    return mixture_at_modes(np.stack([one.point.z for one in fits]), covariances, mass)


def _posterior(base: ModesAndErrors, drawn: Sample, ensemble_hash: str) -> Posterior:
    """What follows from the draws alone; `refine` adds `refinement` and `transfer`."""
    case, station, noise = base.model.case, base.model.station, base.noise
    error = noise.among_all(np.sqrt(np.diag(covariance_of(noise))), len(station))
    sigma = {kind: root_mean_square(error[rows]) for kind, rows in stations_by_kind(station).items()}
    settings = InferenceSettings(
        method="refine",
        likelihood="gaussian",
        sigma_rule=case.infer.sigma,
        threshold=-np.inf,
        ensemble_hash=ensemble_hash,
        seed=case.simulate.seed,
        version=VERSION,
    )
    return posterior_of(
        settings, _weighted_sample(base, drawn), case, station, error, sigma, _factor(noise, len(station))
    )


def _weighted_sample(base: ModesAndErrors, drawn: Sample) -> WeightedSample:
    case, station, noise = base.model.case, base.model.station, base.noise
    theta = theta_at(case, drawn.z)
    residual = station["value"].to_numpy(float) - drawn.values
    likelihoods = np.full(drawn.values.shape, np.nan)
    likelihoods[:, noise.rows] = log_likelihoods(residual[:, noise.rows], precision_of(noise))
    return WeightedSample(
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


def _factor(noise: Noise, stations: int) -> Array:
    """L (station, station) with L L' the covariance of the errors, NaN where a station is not used."""
    wide = np.full((stations, stations), np.nan)
    wide[noise.rows] = 0.0
    wide[np.ix_(noise.rows, noise.rows)] = noise.lower
    return wide
