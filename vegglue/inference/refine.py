"""From the best members of an ensemble to a posterior one can stand on: best places, errors, draws with true runs.

    p(z | y) ~ exp(-|W (y - f(z))|^2 / 2 - |z|^2 / 2),   W' W the inverse covariance of the errors

z are places of the prior in which it is standard normal, f the model itself: every draw that counts is a run.
"""

from functools import partial

import numpy as np
import pandas as pd
import scipy.stats

from vegglue.arrays import Array
from vegglue.calibration.fit import Fitted
from vegglue.calibration.noise import Noise, covariance_of
from vegglue.case.parameter_space import theta_at
from vegglue.case.prior import sample_prior
from vegglue.case.schema import Case
from vegglue.engine.interface import predict
from vegglue.engine.model import model_of
from vegglue.inference.canopy_correction import corrected_canopy
from vegglue.inference.glue import check_stations
from vegglue.inference.homogeneity import transfer
from vegglue.inference.importance_sampling import Sample, sample
from vegglue.inference.leave_one_out import leave_one_out, leave_out, log_likelihoods, share_inside
from vegglue.inference.likelihood import efficiency, root_mean_square, stations_by_kind
from vegglue.inference.map_and_errors import Groundwork, groundwork
from vegglue.inference.posterior_summary import marginals, predictions
from vegglue.inference.student_mixture import Mixture, around
from vegglue.inference.weighted_statistics import effective_size, pareto_shape
from vegglue.measurements.observations import Observations
from vegglue.progress import Say
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior, Refinement, Transfer
from vegglue.version import VERSION

# Effective draws that are asked for.
WANTED = 1000
# A station is flagged when the chance of one as far off, among all stations, is below this.
NO_CHANCE = 0.01


def refine(ensemble: Ensemble, case: Case, observations: Observations, say: Say = lambda text: None) -> Posterior:
    """Draws worth WANTED of the posterior, or as many as some thousand runs give, with what they predict unseen.

    Errors: InputError when the stations are not those that were simulated, a standard error is missing (`sigma: known`)
    or no flow is found from the best members.
    """
    check_stations(ensemble, observations.table)
    say("following the best members downhill")
    base = groundwork(model_of(case, observations), ensemble, case.infer.sigma)
    say(f"{len(base.fits)} mode(s), chi2 {base.fits[0].chi2:.4g} over {base.noise.rows.size} stations; drawing")
    run = partial(predict, base.model, [one.point for one in base.fits])
    drawn = sample(run, partial(log_posterior, base.noise), mixture_around(base.fits), WANTED, case.simulate.seed)
    moved = transfer(base.model, base.noise, base.fits[0].point, case.infer.sigma == "known")
    return _posterior(base, drawn, moved, ensemble)


def refinable(case: Case) -> bool:
    """Whether the case asks for a likelihood of errors, which is what draws can follow; not an informal one."""
    return case.infer.likelihood == "gaussian" and case.infer.behavioural is None


def log_posterior(noise: Noise, z: Array, prediction: Array) -> Array:
    """ln p(z | y) up to a constant (m,); z (m, p), prediction (m, station), NaN where there is none."""
    known = np.isfinite(prediction[:, noise.rows]).all(axis=1)
    logs = np.full(len(z), -np.inf)
    left = noise.value - prediction[np.ix_(known, noise.rows)]
    logs[known] = -0.5 * np.sum(noise.whiten(left.T) ** 2, axis=0) - 0.5 * np.sum(z[known] ** 2, axis=1)
    return logs


def mixture_around(fits: tuple[Fitted, ...]) -> Mixture:
    """A component for each mode, sharing by exp(-objective / 2) |covariance|^(1/2)."""
    covariances = np.stack([one.covariance for one in fits])
    mass = np.array([-0.5 * one.objective for one in fits]) + 0.5 * np.linalg.slogdet(covariances)[1]
    return around(np.stack([one.point.z for one in fits]), covariances, mass)


def _posterior(base: Groundwork, drawn: Sample, moved: Transfer | None, ensemble: Ensemble) -> Posterior:
    case, station, noise, weights = base.model.case, base.model.station, base.noise, drawn.weights
    theta, seed = theta_at(case, drawn.z), case.simulate.seed
    residual = station["value"].to_numpy(float) - drawn.values
    own = noise.among_all(np.sqrt(np.diag(covariance_of(noise))), len(station))
    kinds = stations_by_kind(station)
    likelihoods = np.full(drawn.values.shape, np.nan)
    likelihoods[:, noise.rows] = log_likelihoods(residual[:, noise.rows], _precision(noise))
    best = int(np.argmax(drawn.log_density))
    return Posterior(
        method="refine",
        likelihood="gaussian",
        sigma_rule=case.infer.sigma,
        threshold=-np.inf,
        members=len(weights),
        failed=int(np.sum(np.isnan(drawn.values).any(axis=1))),
        weighed=int(np.sum(weights > 0)),
        used=noise.rows.size,
        best=best,
        effective_size=effective_size(weights),
        largest_weight=float(weights.max()),
        pareto_k=pareto_shape(weights),
        ensemble_hash=ensemble.config_hash,
        seed=seed,
        version=VERSION,
        weights=weights,
        efficiency=efficiency(residual, station),
        log_likelihood=likelihoods,
        prediction=drawn.values,
        sigma={kind: root_mean_square(own[rows]) for kind, rows in kinds.items()},
        noise=own,
        station=station,
        canopy=corrected_canopy(theta, case, weights),
        refinement=_refinement(base, drawn, best),
        transfer=moved,
        **marginals(theta, case, weights),
        **predictions(drawn.values, best, own, weights, station, seed, _spread(noise, len(station))),
    )


def _refinement(base: Groundwork, drawn: Sample, best: int) -> Refinement:
    case, station, noise = base.model.case, base.model.station, base.noise
    kept = drawn.weights > 0
    left, weights = noise.value - drawn.values[np.ix_(kept, noise.rows)], drawn.weights[kept]
    precision, count = _precision(noise), noise.rows.size
    alone = leave_one_out(left, precision, weights)
    groups = _groups(station.iloc[noise.rows])
    without = [leave_out(left, precision, weights, rows) for rows in groups.values()]
    misfit = float(np.sum(noise.whiten(noise.residual(drawn.values[best])) ** 2))
    freedom = count - len(base.model.names)
    near = np.argmin([np.linalg.norm(drawn.z - one.point.z, axis=1) for one in base.fits], axis=0)
    grid = root_mean_square(noise.grid) if base.grid_known else float("nan")
    modes = theta_at(case, np.stack([one.point.z for one in base.fits]))
    at_all = partial(noise.among_all, stations=len(station))
    return Refinement(
        errors="stated" if case.infer.sigma == "known" else "estimated",
        correlation=noise.correlation,
        scale=noise.scale,
        grid_error=grid,
        starts=base.starts,
        chi2=misfit,
        freedom=freedom,
        p_misfit=float(scipy.stats.chi2.sf(misfit, max(freedom, 1))),
        elpd=float(alone.score.sum()),
        elpd_error=float(np.sqrt(count) * alone.score.std()),
        inside50=share_inside(alone.below, 0.5),
        inside95=share_inside(alone.below, 0.95),
        p_calibration=float(scipy.stats.kstest(alone.below, "uniform").pvalue),
        mode_theta=np.column_stack(list(modes.values())),
        mode_chi2=np.array([one.chi2 for one in base.fits]),
        mode_weight=np.bincount(near, drawn.weights, len(base.fits)),
        drawn=np.array(drawn.drawn),
        worth=np.array(drawn.worth),
        log_density=drawn.log_density,
        prior_theta=sample_prior(case.parameters, len(drawn.z), case.simulate.seed),
        score=at_all(alone.score),
        score_k=at_all(alone.k),
        below=at_all(alone.below),
        surprise=at_all(base.surprise),
        outlier=at_all(count * scipy.stats.norm.sf(np.abs(base.surprise)) * 2) < NO_CHANCE,
        left_out=np.array(list(groups), object),
        left_out_stations=np.array([rows.size for rows in groups.values()]),
        left_out_score=np.array([one.score for one in without]),
        left_out_k=np.array([one.k for one in without]),
    )


def _precision(noise: Noise) -> Array:
    return np.asarray(np.linalg.inv(covariance_of(noise)))


def _spread(noise: Noise, stations: int) -> Array:
    """Factor of the errors' covariance (station, station), NaN where a station is not used."""
    wide = np.full((stations, stations), np.nan)
    wide[noise.rows] = 0.0
    wide[np.ix_(noise.rows, noise.rows)] = noise.lower
    return wide


def _groups(used: pd.DataFrame) -> dict[str, np.ndarray]:
    """Rows of each section of each experiment, then of each experiment, where that leaves something."""
    names = used["experiment"].astype(str).to_numpy()
    sections = used["section"].astype(str).to_numpy()
    sections = np.where(sections == "", used["kind"].astype(str) + "s", sections)
    places = np.array([f"{a} {b}" for a, b in zip(names, sections, strict=True)])
    found: dict[str, np.ndarray] = {}
    for labels, word in ((places, ""), (names, "experiment ")):
        each = dict.fromkeys(labels)
        if len(each) > 1:
            found |= {f"{word}{label}": np.flatnonzero(labels == label) for label in each}
    return found
