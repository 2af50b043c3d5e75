"""GLUE: the members of an ensemble weighted by how well they predict what was measured.

    p(theta | u) ~ L(u | theta) p(theta):   a member drawn from the prior weighs w_k = L_k / sum L

Beven and Binley (1992), https://doi.org/10.1002/hyp.3360060305; the Gaussian likelihood and its sigma as in
Berends et al. (2020), https://doi.org/10.1016/j.advwatres.2020.103675.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.schema import Case
from vegglue.errors import InputError, shown_command, shown_path
from vegglue.inference.posterior_summary import posterior_of
from vegglue.inference.weighted_statistics import root_mean_square, stations_by_kind
from vegglue.measurements.kinds import kind_of, unstated_errors
from vegglue.measurements.observations import Observations
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import InferenceSettings, Posterior, WeightedSample
from vegglue.wording.sentences import sentence

# Readings of a kind from which the size of its errors is taken from the residual [-]: from ten it is known to a fourth,
# 1 / (2 (n - 1))^(1/2). A model passes through one or two exactly, and the likelihood of a size has no bound then.
LEAST_FOR_SIZE = 10


@dataclass(frozen=True)
class MemberFit:
    """How well each member predicts the used stations.

    Attributes
    ----------
    solved : ndarray of bool (member,)
    best : int
        Index of the best member.
    sigma : dict of float
        Standard deviation of the errors by kind of measurement [m/s or m].
    noise : ndarray (station,)
        That of each station, NaN if unknown.
    efficiency : ndarray (member,)
        Nash-Sutcliffe [-], NaN of failed members.
    log_likelihood : ndarray (member, station)
        NaN if not used, or failed.
    """

    solved: NDArray[np.bool_]
    best: int
    sigma: dict[str, float]
    noise: Array
    efficiency: Array
    log_likelihood: Array


def fit_members(prediction: Array, station: pd.DataFrame, rule: str) -> MemberFit:
    """Efficiency and Gaussian log-likelihood of each member at the stations.

        E = 1 - mean_k (sum (u - U)^2 / sum (u - mean u)^2)
        ln p(u_i | U_i) = -ln(2 pi s_i^2) / 2 - (u_i - U_i)^2 / (2 s_i^2)

    Parameters
    ----------
    prediction : array (member, station)
        U [m/s or m], NaN where a member failed.
    station : DataFrame
        All stations, their measured values u among them.
    rule : str
        `known`: s are the standard errors of the data. `best-member`: s_k^2 = mean (u - U)^2 over the stations of kind
        k, of the member with the least sum_k n_k ln s_k^2, and as in `sizes_as_stated` if they are few.

    Returns
    -------
    MemberFit
        Of all members.

    Raises
    ------
    InputError
        If no member was solved, a standard error is missing, or sigma would be zero.
    """
    kinds = stations_by_kind(station)
    used = np.concatenate(list(kinds.values()))
    solved = np.asarray(np.isfinite(prediction[:, used]).all(axis=1))
    if not solved.any():
        raise InputError(f"ensemble: none of the {len(solved)} members was solved; see the reasons stored with them.")
    residual = np.where(solved[:, None], station["value"].to_numpy(float) - prediction, np.nan)
    mean_square = {kind: np.mean(residual[:, rows] ** 2, axis=1) for kind, rows in kinds.items()}
    few = sizes_as_stated(station)
    if rule == "known":
        noise = station["standard_error"].to_numpy(float)
        if not (noise[used] > 0).all():
            raise InputError(
                f"observations: `infer.sigma: known` needs standard errors, but {sentence(unstated_errors(station))} "
                "`sigma: best-member` estimates them from the residual of the best member."
            )
        best = int(np.nanargmin(np.sum((residual / noise)[:, used] ** 2, axis=1)))
        sigma = {kind: root_mean_square(noise[rows]) for kind, rows in kinds.items()}
    else:
        for kind, each in mean_square.items():
            if kind not in few and np.nanmin(each) == 0:
                raise InputError(
                    f"observations: a member reproduces every {kind} exactly, so sigma cannot be taken from the "
                    "residual; give standard errors and use `infer.sigma: known`."
                )
        # Minus twice the likelihood at its best sigma of each kind; of those that are few at their standard errors.
        terms = [
            len(kinds[kind]) * (each / few[kind] ** 2 if kind in few else np.log(each))
            for kind, each in mean_square.items()
        ]
        best = int(np.nanargmin(np.sum(terms, axis=0)))
        sigma = {kind: float(np.sqrt(each[best])) for kind, each in mean_square.items()} | few
        noise = station["kind"].map(sigma).to_numpy(float)
    of_used = np.where(station["used"].to_numpy(), noise, np.nan)
    return MemberFit(
        solved=solved,
        best=best,
        sigma=sigma,
        noise=noise,
        efficiency=efficiency(residual, station),
        log_likelihood=-0.5 * np.log(2 * np.pi * of_used**2) - 0.5 * (residual / of_used) ** 2,
    )


def sizes_as_stated(station: pd.DataFrame) -> dict[str, float]:
    """Standard errors of kinds with fewer than LEAST_FOR_SIZE used readings: too few to estimate them from a residual.

    Parameters
    ----------
    station : DataFrame
        All stations.

    Returns
    -------
    dict of float
        Root mean square of those stated, by kind [its unit]; the usual one of a kind if any is not stated.
    """
    error = station["standard_error"].to_numpy(float)
    few = {kind: error[rows] for kind, rows in stations_by_kind(station).items() if rows.size < LEAST_FOR_SIZE}
    return {
        kind: root_mean_square(stated) if (stated > 0).all() else kind_of(kind).usual_error
        for kind, stated in few.items()
    }


def efficiency(residual: Array, station: pd.DataFrame) -> Array:
    """E = 1 - mean_k (sum (u - U)^2 / sum (u - mean u)^2) over kinds k: the Nash-Sutcliffe efficiency of each member.

    Parameters
    ----------
    residual : ndarray (member, station)
        u - U [unit of each station].

    Returns
    -------
    ndarray (member,)
        [-], NaN if all values of a kind are equal: against a constant no efficiency is defined.
    """
    value = station["value"].to_numpy(float)
    kinds = stations_by_kind(station).values()
    # By the range: the variance of equal values is not always 0, as their mean is rounded.
    variances = [float(np.var(value[rows])) if np.ptp(value[rows]) > 0.0 else float("nan") for rows in kinds]
    squares = [np.mean(residual[:, rows] ** 2, axis=1) for rows in kinds]
    return 1 - np.mean([square / variance for square, variance in zip(squares, variances, strict=True)], axis=0)


def glue(ensemble: Ensemble, case: Case, observations: Observations) -> Posterior:
    """The posterior of an ensemble, its members weighted by likelihood.

        gaussian: L = prod_i (2 pi s_i^2)^(-1/2) exp(-(u_i - U_i)^2 / (2 s_i^2)) over the used stations i

    with s the root mean square residual of the best member, one for each kind of measurement (`infer.sigma:
    best-member`), or the standard errors of the data (`known`). nse and inverse-variance: see `member_weights`.

    Parameters
    ----------
    ensemble : Ensemble
        Members drawn from the prior, and their predictions.
    case : Case
        `infer.likelihood`, `infer.sigma`, and `infer.behavioural`: the smallest Nash-Sutcliffe efficiency of a member
        with weight [-], for any of the three likelihoods; failed members have no weight.
    observations : Observations
        The stations that were simulated, with measured values.

    Returns
    -------
    Posterior
        Without a refinement.

    Raises
    ------
    InputError
        If stations are not those simulated, none is used, no member was solved, standard errors are missing, sigma is
        zero, or no member is above the threshold.

    References
    ----------
    Beven and Binley (1992), https://doi.org/10.1002/hyp.3360060305.
    """
    station = observations.table
    check_stations(ensemble, station, case.source)
    refuse_undefined_efficiency(case, station)
    fit = fit_members(ensemble.prediction, station, case.infer.sigma)
    threshold = -np.inf if case.infer.behavioural is None else case.infer.behavioural
    settings = InferenceSettings(
        method="glue",
        likelihood=case.infer.likelihood,
        sigma_rule=case.infer.sigma,
        threshold=threshold,
        ensemble_hash=ensemble.config_hash,
        seed=ensemble.seed,
        version=ensemble.version,
    )
    sample = WeightedSample(
        members=len(fit.solved),
        failed=int(np.sum(~fit.solved)),
        best=fit.best,
        unit={name: case.parameters[name].unit for name in ensemble.parameters},
        theta=ensemble.parameters,
        weights=member_weights(fit, case.infer.likelihood, threshold),
        efficiency=fit.efficiency,
        log_likelihood=fit.log_likelihood,
        prediction=ensemble.prediction,
    )
    return posterior_of(settings, sample, case, station, fit.noise, fit.sigma)


def refuse_undefined_efficiency(case: Case, station: pd.DataFrame) -> None:
    """Refuse to weigh by efficiencies if all measured values of a kind are equal.

    Parameters
    ----------
    case : Case
        `infer` states whether efficiencies are used.

    Raises
    ------
    InputError
    """
    settings = case.infer
    if settings.method != "glue" or (settings.likelihood == "gaussian" and settings.behavioural is None):
        return
    value = station["value"].to_numpy(float)
    for kind, rows in stations_by_kind(station).items():
        if np.ptp(value[rows]) == 0.0:
            setting = "likelihood" if settings.likelihood != "gaussian" else "behavioural"
            raise InputError(
                f"{shown_path(case.source)}, infer.{setting}: expected values of {kind} that differ, got "
                f"{rows.size} of {value[rows][0]:g}: no efficiency is defined against them; use gaussian alone."
            )


def check_stations(ensemble: Ensemble, station: pd.DataFrame, config: Path | None = None) -> None:
    """Refuse stations that are not those that were simulated.

    Parameters
    ----------
    config : Path, optional
        For the command to be run again.

    Raises
    ------
    InputError
        Also if no station is used.
    """
    same = len(station) == len(ensemble.station) and all(
        np.array_equal(station[column].to_numpy(), ensemble.station[column].to_numpy())
        for column in ("experiment", "kind", "x", "y")
    )
    if not same:
        raise InputError(
            f"observations: the {len(station)} stations are not the {len(ensemble.station)} that were simulated; "
            f"run {shown_command('simulate', config)} again."
        )
    if not station["used"].any():
        command = shown_command("check", config)
        raise InputError(f"observations: no station is used, nothing can be inferred; {command} shows why.")


def member_weights(fit: MemberFit, likelihood: str, threshold: float) -> Array:
    """w_k = L_k / sum L, zero for failed members and those of an efficiency E below the threshold.

        gaussian: L = prod_i p(u_i | U_i);   nse: L = max(E, 0);   inverse-variance: L = 1 / (1 - E)

    The last is proportional to the inverse error variance of Beven and Binley (1992), with their shape 1.

    Parameters
    ----------
    fit : MemberFit
        Of all members.
    likelihood : str
        `gaussian`, `nse` or `inverse-variance`.
    threshold : float
        Smallest efficiency of a member with weight [-], -inf for none.

    Returns
    -------
    array (member,)
        Of sum 1 [-].

    Raises
    ------
    InputError
        If no member has weight.

    References
    ----------
    Beven and Binley (1992), https://doi.org/10.1002/hyp.3360060305.
    """
    if (likelihood != "gaussian" or threshold > -np.inf) and np.isnan(fit.efficiency[fit.best]):
        raise InputError(
            "observations: no efficiency is defined if all measured values of a kind are equal, as a single one is; "
            "use gaussian."
        )
    kept = fit.solved & ((threshold == -np.inf) | (fit.efficiency >= threshold))
    weights = np.zeros(len(kept))
    if likelihood == "gaussian":
        log_weight = np.nansum(fit.log_likelihood, axis=1)
        weights[kept] = np.exp(log_weight[kept] - np.max(log_weight[kept], initial=-np.inf))
    elif likelihood == "nse":
        weights[kept] = np.maximum(fit.efficiency[kept], 0)
    else:
        weights[kept] = 1 / np.maximum(1 - fit.efficiency[kept], np.finfo(float).tiny)
    if weights.sum() > 0:
        return weights / weights.sum()
    largest = float(np.nanmax(fit.efficiency))
    if threshold > largest:
        raise InputError(
            f"infer.behavioural: expected a member with an efficiency of at least {threshold:g}, the best has "
            f"{largest:.3g}; lower the threshold or widen the priors."
        )
    raise InputError(
        f"infer.likelihood: nse expected a member with an efficiency above 0, the best has {largest:.3g}, no better "
        "than the mean of the measured values; widen the priors or use gaussian."
    )
