"""Homogeneity: whether a parameter has one value for all experiments, each of them calibrated alone.

    chi2 = (x - m)' S^-1 (x - m),   m = 1' S^-1 x / 1' S^-1 1,   S_ef = s_e s_f rho_ef

of one degree of freedom less than experiments e. x_e and s_e are the estimate of a parameter from the data of
experiment e alone, without its prior, and its standard error; rho_ef is the correlation of two estimates by errors
that experiments share, those of the model and of the grid. All parameters at once are tested by the fall of chi2 when
each experiment has its own. The size of the errors is estimated from the separate fits: the residual of the joint one
would hold the differences that are tested. As it is estimated from d degrees of freedom, chi2 / m of m of its own is
Fisher's F_m,d (Fisher 1925, Statistical Methods for Research Workers); chi2 alone takes few readings for many.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, fdtrc

from vegglue.arrays import Array
from vegglue.calibration.fit import covariance, determined, fit_from, squared_misfit
from vegglue.calibration.noise import Noise, covariance_of, with_correlation
from vegglue.case.parameter_space import theta_at
from vegglue.case.schema import Case
from vegglue.engine.interface import Model, Point
from vegglue.engine.newton import DIFFERENCE_STEP
from vegglue.inference.posterior_summary import on_flat_scale
from vegglue.parallel import parallel_map
from vegglue.results.posterior import Transfer

# Posterior over prior variance of z [-] above which an experiment does not determine a parameter. Chosen, not measured:
# a higher one compares more parameters, whose estimates without the prior rest on less and less data.
UNINFORMED = 0.5
# p-value [-], over all parameters compared (Bonferroni), below which a parameter differs between experiments. Stricter
# than the customary 0.05, as one value for all is given up then.
DIFFERS_BELOW = 0.01
# Of one experiment: rows among the used stations (n,), slopes (n, p) and covariance of z (p, p).
Estimate = tuple[NDArray[np.int64], Array, Array]


def differing(p: Mapping[str, float]) -> frozenset[str]:
    """Parameters that differ between experiments: p times the number compared < DIFFERS_BELOW.

    Parameters
    ----------
    p
        Chance that one value fits all experiments, by parameter [-]; NaN for one that is not compared.
    """
    compared = {name: chance for name, chance in p.items() if not math.isnan(chance)}
    return frozenset(name for name, chance in compared.items() if chance * len(compared) < DIFFERS_BELOW)


def transfer(model: Model, noise: Noise, joint: Point, stated: bool) -> Transfer | None:
    """Tests of homogeneity, with each experiment fitted alone from the joint estimate; None with fewer than two.

    Parameters
    ----------
    model : Model
        Of all experiments.
    noise : Noise
        Their errors.
    joint : Point
        The estimate from all experiments together.
    stated : bool
        Whether standard errors are known; they are then only made larger, if the separate fits need it.

    Returns
    -------
    Transfer or None
        Estimates of each parameter from each experiment, chi2, degrees of freedom and p.
    """
    names = model.station["experiment"].to_numpy()
    here = [name for name in model.case.experiments if (names[noise.rows] == name).any()]
    if len(here) < 2:
        return None
    noise = with_correlation(noise, noise.correlation, 1.0)
    parts = [one_experiment(model, noise, name) for name in here]
    fits = parallel_map(partial(fit_from, z=joint.z, near=joint), parts)
    # s^2 = sum_e chi2_e / sum_e (n_e - p_e), p_e: effective number of parameters of experiment e; and the degrees of
    # freedom that s is estimated from, infinite if it is the least, which is known.
    least, known = 1.0 if stated else 0.0, [(one, part) for one, (_, part) in zip(fits, parts, strict=True) if one]
    left = sum(one.chi2 for one, _ in known)
    free = sum(part.rows.size - determined(one.covariance) for one, part in known)
    scale = float(np.sqrt(left / free)) if free > 0 and left > 0 else 1.0
    scale, free = (scale, free) if free > 0 and scale > least else (max(scale, least), math.inf)
    value, error = (np.full((len(here), len(model.names)), np.nan) for _ in range(2))
    estimates: list[Estimate | None] = []
    for e, (fitted, (_, part), name) in enumerate(zip(fits, parts, here, strict=True)):
        if fitted is None:
            estimates.append(None)
            continue
        value[e], error[e] = without_prior(model.case, fitted.point.z, np.diag(fitted.covariance))
        rows = np.flatnonzero(names[noise.rows] == name)
        estimates.append((rows, part.used(fitted.point.slope), fitted.covariance))
    error *= scale
    together = np.array(
        [squared_misfit(part, joint.prediction[names == name]) for (_, part), name in zip(parts, here, strict=True)]
    )
    alone = np.array([np.nan if fitted is None else fitted.chi2 for fitted in fits])
    gain = float(np.nansum(together - alone) / scale**2)
    separate = sum(determined(one.covariance) for one, _ in known)
    more = max(round(separate - determined(covariance(noise, joint))), 1)
    alike = correlations_of_estimates(noise, estimates, len(model.names))
    tested = [equal_values_test(value[:, j], error[:, j], alike[j], free) for j in range(len(model.names))]
    return Transfer(
        scale=scale,
        gain=gain,
        more=more,
        p_all=chance_of_as_much(max(gain, 0.0), more, free),
        experiments=np.array(here, object),
        value=value,
        error=error,
        chi2=np.array([one[0] for one in tested]),
        freedom=np.array([one[1] for one in tested]),
        p=np.array([one[2] for one in tested]),
        misfit_together=together / scale**2,
        misfit_alone=alone / scale**2,
        stations=np.array([part.rows.size for _, part in parts]),
    )


def chance_of_as_much(chi2: float, freedom: int, free: float = math.inf) -> float:
    """P(chi2_f >= chi2), or P(F_f,g >= chi2 / f) over errors whose size is estimated from g others.

    Parameters
    ----------
    chi2 : float
        [-]
    freedom : int
        f.
    free : float
        g, infinite if errors are known.

    Returns
    -------
    float
        [-]
    """
    if math.isinf(free):
        return float(chdtrc(freedom, chi2))
    return float(fdtrc(freedom, free, chi2 / freedom))


def without_prior(case: Case, z: Array, variance: Array) -> tuple[Array, Array]:
    """1/s_z^2 = 1/v - 1,   x = x(z) + x' z (s_z^2 / v - 1),   s = |x'| s_z: an estimate without its prior.

    Parameters
    ----------
    z, variance : ndarray (p,)
        A MAP estimate and v, on the scale of standard normal priors [-].

    Returns
    -------
    ndarray (p,), ndarray (p,)
        x and s on the scale of `on_flat_scale` [unit of the parameter, or log10 of it]; NaN if v >= UNINFORMED.
    """
    informed = variance < UNINFORMED
    own = np.where(informed, variance / np.where(informed, 1.0 - variance, 1.0), np.nan)
    steps = DIFFERENCE_STEP * np.array([-1.0, 0.0, 1.0])[:, None]
    low, middle, high = on_flat_scale(case, theta_at(case, z + steps))
    slope = (high - low) / (2.0 * DIFFERENCE_STEP)
    return middle + slope * z * (own / variance - 1.0), np.abs(slope) * np.sqrt(own)


def correlations_of_estimates(noise: Noise, estimates: Sequence[Estimate | None], parameters: int) -> Array:
    """rho_ef = diag(A_e C_ef A_f') over its roots at e = f,   A_e = V_e J_e' C_ee^-1,   C the covariance of the errors

    Parameters
    ----------
    estimates : sequence of Estimate or None
        Of each experiment its rows among the used stations, slopes J_e (n_e, p) and covariance V_e (p, p) of z.
    parameters : int
        p.

    Returns
    -------
    ndarray (p, e, e)
        [-], by error propagation of the linear least-squares estimate.
    """
    errors, count = covariance_of(noise), len(estimates)
    pulled = [
        None if one is None else one[2] @ np.linalg.solve(errors[np.ix_(one[0], one[0])], one[1]).T for one in estimates
    ]
    shared = np.tile(np.eye(count), (parameters, 1, 1))
    for e, f in np.ndindex(count, count):
        one, other, a, b = estimates[e], estimates[f], pulled[e], pulled[f]
        if one is not None and other is not None and a is not None and b is not None:
            shared[:, e, f] = np.einsum("pi,ij,pj->p", a, errors[np.ix_(one[0], other[0])], b)
    own = np.sqrt(np.maximum(np.einsum("pee->pe", shared), np.finfo(float).tiny))
    return np.asarray(shared / (own[:, :, None] * own[:, None, :]))


def equal_values_test(
    value: Array, error: Array, alike: Array | None = None, free: float = math.inf
) -> tuple[float, int, float]:
    """Whether values that may be correlated are one value: chi2 about their weighted mean.

    Parameters
    ----------
    value, error : ndarray (e,)
        Values and standard errors [any unit]; error NaN or 0: unknown.
    alike : ndarray (e, e), optional
        Correlation rho of the errors [-], independent if it is not given.
    free : float
        Degrees of freedom by which the size of the errors is known, see `chance_of_as_much`.

    Returns
    -------
    float, int, float
        chi2, its degrees of freedom, and p [-]; NaN for fewer than two known.
    """
    known = np.isfinite(value) & (error > 0)  # zero at an end of its support, where no step leads
    if known.sum() < 2:
        return float("nan"), 0, float("nan")
    correlation = np.eye(value.size) if alike is None else alike
    covariance_of_values = np.outer(error[known], error[known]) * correlation[np.ix_(known, known)]
    weight = np.linalg.inv(covariance_of_values)
    off = value[known] - (weight @ value[known]).sum() / weight.sum()
    separation = float(off @ weight @ off)
    freedom = int(known.sum()) - 1
    return separation, freedom, chance_of_as_much(separation, freedom, free)


def one_experiment(model: Model, noise: Noise, experiment: str) -> tuple[Model, Noise]:
    """The model and its errors for one experiment.

    Returns
    -------
    Model
        Of its stations alone; all parameters stay.
    Noise
        Of these, with the covariance that they have among all.
    """
    here = (model.station["experiment"] == experiment).to_numpy()
    case = model.case.model_copy(update={"experiments": {experiment: model.case.experiments[experiment]}})
    kept = np.flatnonzero(here[noise.rows])
    lower = np.linalg.cholesky(covariance_of(noise)[np.ix_(kept, kept)])
    rows = (np.cumsum(here) - 1)[noise.rows[kept]]
    part = replace(
        noise,
        rows=rows,
        value=noise.value[kept],
        error=noise.error[kept],
        separation=noise.separation[np.ix_(kept, kept)],
        grid_error=noise.grid_error[kept],
        lower=np.asarray(lower),
        model_error=noise.model_error[np.ix_(kept, kept)],
        unknown=noise.unknown[kept],
    )
    return replace(model, case=case, station=model.station[here].reset_index(drop=True)), part
