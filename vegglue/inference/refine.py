"""A posterior by importance sampling around the best fits, which are searched from the best members of an ensemble, or
from points of the prior where there is none.

    p(z | y) ~ exp(-|W (y - f(z))|^2 / 2 - |z|^2 / 2),   W' W the inverse covariance of the errors

z are the parameters on a scale on which the prior is standard normal. f is the flow model itself: every draw is a run.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.fit import MapEstimate
from vegglue.calibration.noise import Noise, covariance_of
from vegglue.case.parameter_space import theta_at
from vegglue.case.schema import Case
from vegglue.engine.interface import Engine, Model, predict
from vegglue.engine.model import model_of
from vegglue.engine.newton import NEWTON
from vegglue.inference.glue import check_stations
from vegglue.inference.homogeneity import transfer
from vegglue.inference.importance_sampling import Sample, sample
from vegglue.inference.leave_one_out import log_likelihoods
from vegglue.inference.likelihood import efficiency, root_mean_square, stations_by_kind
from vegglue.inference.map_and_errors import ModesAndErrors, modes_and_errors
from vegglue.inference.posterior_summary import posterior_of
from vegglue.inference.refinement_summary import precision_of, refinement_of
from vegglue.inference.student_mixture import Mixture, mixture_at_modes
from vegglue.inference.tried_members import members_of, points_of_prior
from vegglue.measurements.observations import Observations
from vegglue.progress import Progress, Watch, counted, silent
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import InferenceSettings, Posterior, WeightedSample
from vegglue.version import VERSION
from vegglue.wording.numbers import so_many

# Effective draws that are asked for: an end of the 95 % range then rests on 25 of them.
EFFECTIVE_DRAWS = 1000
# Largest correction that a draw may still ask for, over the smallest error of a measurement [-]; it is then made, and
# what is left is far smaller. Chosen: on open-b, with and without its effect, predictions moved by at most 2e-4 of
# their errors and ln p by 1e-3, for a sixth less work than with the tolerance of the case. With 0.05 it was 5e-3.
DRAWN_WITHIN = 0.02


def refine(
    ensemble: Ensemble | None, case: Case, observations: Observations, watch: Watch = silent, engine: Engine = NEWTON
) -> Posterior:
    """EFFECTIVE_DRAWS of the posterior, or as many as some thousand runs give, and how well they predict unseen data.

    Errors: InputError when the stations are not those that were simulated, a standard error is missing (`sigma: known`)
    or no flow is found from the best members.
    """
    model = model_of(case, observations, engine)
    if ensemble is None:
        watch(Progress("trying points of the prior"))
        tried = points_of_prior(model)
    else:
        check_stations(ensemble, observations.table, case.source)
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
