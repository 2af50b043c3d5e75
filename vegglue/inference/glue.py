"""GLUE: weigh the members of an ensemble by how well they predict what was measured.

Beven and Binley (1992), https://doi.org/10.1002/hyp.3360060305; the Gaussian likelihood and its sigma as in
Berends et al. (2020), https://doi.org/10.1016/j.advwatres.2020.103675.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.schema import Case
from vegglue.errors import InputError, shown_command
from vegglue.inference.likelihood import MemberFit, fit_members
from vegglue.inference.posterior_summary import posterior_of
from vegglue.measurements.observations import Observations
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import InferenceSettings, Posterior, WeightedSample


def glue(ensemble: Ensemble, case: Case, observations: Observations) -> Posterior:
    """p(theta | u) ~ L(u | theta) p(theta): a member drawn from the prior weighs w_k = L_k / sum L.

    gaussian: L = prod_i (2 pi s_i^2)^(-1/2) exp(-(u_i - U_i)^2 / (2 s_i^2)) over the used stations i, with s the root
    mean square residual of the best member, one for each kind of measurement (best-member), or the standard errors of
    the data (known). nse and inverse-variance: see member_weights. `behavioural` is the smallest Nash-Sutcliffe
    efficiency of a member with weight, for any of the three; failed members have none.

    Errors: InputError when nothing can be weighed: stations other than those simulated, none used, no member solved,
    standard errors missing, sigma zero, no member above the threshold.
    """
    station = observations.table
    check_stations(ensemble, station, case.source)
    fit = fit_members(ensemble.prediction, station, case.infer.sigma)
    threshold = -np.inf if case.infer.behavioural is None else case.infer.behavioural
    weights = member_weights(fit, case.infer.likelihood, threshold)
    settings = InferenceSettings(
        method="glue",
        likelihood=case.infer.likelihood,
        sigma_rule=case.infer.sigma,
        threshold=threshold,
        ensemble_hash=ensemble.config_hash,
        seed=ensemble.seed,
        version=ensemble.version,
    )
    return posterior_of(settings, _weighted_sample(ensemble, case, fit, weights), case, station, fit.noise, fit.sigma)


def _weighted_sample(ensemble: Ensemble, case: Case, fit: MemberFit, weights: Array) -> WeightedSample:
    return WeightedSample(
        members=len(weights),
        failed=int(np.sum(~fit.solved)),
        best=fit.best,
        unit={name: case.parameters[name].unit for name in ensemble.parameters},
        theta=ensemble.parameters,
        weights=weights,
        efficiency=fit.efficiency,
        log_likelihood=fit.log_likelihood,
        prediction=ensemble.prediction,
    )


def check_stations(ensemble: Ensemble, station: pd.DataFrame, config: Path | None = None) -> None:
    """Errors: InputError when the stations are not those that were simulated, or none is used."""
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
        raise InputError(f"observations: no station is used, nothing can be inferred; {command} says why.")


def member_weights(fit: MemberFit, likelihood: str, threshold: float) -> Array:
    """w_k = L_k / sum L (member,) [-]; zero for failed members and those of an efficiency below the threshold.

    gaussian: L = prod_i p(u_i | U_i). nse: L = max(E, 0). inverse-variance: L = 1 / (1 - E), proportional to the
    inverse error variance of Beven and Binley (1992), https://doi.org/10.1002/hyp.3360060305, with their shape 1.

    Errors: InputError when no member has weight.
    """
    if (likelihood != "gaussian" or threshold > -np.inf) and np.isnan(fit.efficiency[fit.best]):
        raise InputError(
            "observations: no efficiency is defined where all measured values of a kind are equal, as a single one is; "
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
    if not weights.sum() > 0:
        raise _no_weight(threshold, float(np.nanmax(fit.efficiency)))
    return weights / weights.sum()


def _no_weight(threshold: float, best: float) -> InputError:
    """Why no member has weight; best: the largest efficiency of any [-]."""
    if threshold > best:
        return InputError(
            f"infer.behavioural: expected a member with an efficiency of at least {threshold:g}, the best has "
            f"{best:.3g}; lower the threshold or widen the priors."
        )
    return InputError(
        f"infer.likelihood: nse expected a member with an efficiency above 0, the best has {best:.3g}: it predicts no "
        "better than the mean of what was measured; widen the priors or use gaussian."
    )
