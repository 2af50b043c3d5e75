"""How well each member of an ensemble predicts what was measured: residuals, efficiency and likelihood."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.errors import InputError
from vegglue.measurements.kinds import kind_of, unstated_errors

# Readings of a kind from which the size of its errors is taken from the residual [-]: from ten it is known to a fourth,
# 1 / (2 (n - 1))^(1/2). A model passes through one or two exactly, and the likelihood of a size has no bound then.
LEAST_FOR_SIZE = 10


@dataclass(frozen=True)
class MemberFit:
    """How well each member predicts the used stations."""

    solved: NDArray[np.bool_]  # (member,)
    best: int
    sigma: dict[str, float]  # standard deviation of the errors by kind of measurement [m/s or m]
    noise: Array  # (station,) that of each station, NaN unknown
    efficiency: Array  # (member,) Nash-Sutcliffe [-], NaN for failed members
    log_likelihood: Array  # (member, station) NaN where not used or failed


def stations_by_kind(station: pd.DataFrame) -> dict[str, NDArray[np.intp]]:
    """Rows of the used stations by kind of measurement."""
    used = station["used"].to_numpy(bool)
    return {str(kind): np.flatnonzero(used & (station["kind"] == kind)) for kind in station["kind"][used].unique()}


def fit_members(prediction: Array, station: pd.DataFrame, rule: str) -> MemberFit:
    """Efficiency and Gaussian log-likelihood of each member at the stations, with the errors that `rule` asks for.

    prediction (member, station), NaN where a member failed.

    best-member: s_k^2 = mean (u - U)^2 over the stations of kind k, of the member with the least sum_k n_k ln s_k^2,
    and as `sizes_as_stated` says where they are few; known: the standard errors of the data.

    E = 1 - mean_k (sum (u - U)^2 / sum (u - mean u)^2).

    Errors: InputError when no member was solved, a standard error is missing, or sigma would be zero.
    """
    kinds = stations_by_kind(station)
    used = np.concatenate(list(kinds.values()))
    solved = np.asarray(np.isfinite(prediction[:, used]).all(axis=1))
    if not solved.any():
        raise InputError(f"ensemble: none of the {len(solved)} members was solved; see the reasons stored with them.")
    value = station["value"].to_numpy(float)
    residual = np.where(solved[:, None], value - prediction, np.nan)
    mean_square = {kind: np.mean(residual[:, rows] ** 2, axis=1) for kind, rows in kinds.items()}
    errors, few = (_known_errors(station, used) if rule == "known" else None), sizes_as_stated(station)
    if errors is None:
        misfit = _profile_misfit(mean_square, kinds, few)
    else:
        misfit = np.sum((residual / errors)[:, used] ** 2, axis=1)
    best = int(np.nanargmin(misfit))
    sigma = {kind: float(np.sqrt(each[best])) for kind, each in mean_square.items()} | few
    noise = station["kind"].map(sigma).to_numpy(float) if errors is None else errors
    return MemberFit(
        solved=solved,
        best=best,
        sigma=sigma if errors is None else {kind: root_mean_square(errors[rows]) for kind, rows in kinds.items()},
        noise=noise,
        efficiency=efficiency(residual, station),
        log_likelihood=_log_likelihood(residual, noise, station["used"].to_numpy(bool)),
    )


def sizes_as_stated(station: pd.DataFrame) -> dict[str, float]:
    """Standard errors of kinds with fewer than LEAST_FOR_SIZE used readings [unit of the kind]: the root mean square of
    those stated, the usual one where any is not.
    """
    error = station["standard_error"].to_numpy(float)
    few = {kind: error[rows] for kind, rows in stations_by_kind(station).items() if rows.size < LEAST_FOR_SIZE}
    return {
        kind: root_mean_square(stated) if (stated > 0).all() else kind_of(kind).usual_error
        for kind, stated in few.items()
    }


def efficiency(residual: Array, station: pd.DataFrame) -> Array:
    """E = 1 - mean_k (sum (u - U)^2 / sum (u - mean u)^2) over kinds k, (member,); residual (member, station)."""
    value = station["value"].to_numpy(float)
    kinds = stations_by_kind(station).values()
    return 1 - np.mean([np.mean(residual[:, rows] ** 2, axis=1) / _variance(value[rows]) for rows in kinds], axis=0)


def _known_errors(station: pd.DataFrame, used: NDArray[np.intp]) -> Array:
    errors = station["standard_error"].to_numpy(float)
    if not (errors[used] > 0).all():
        raise InputError(
            f"observations: `infer.sigma: known` needs standard errors, but {unstated_errors(station)} "
            "`sigma: best-member` estimates them from what the best member leaves."
        )
    return errors


def _profile_misfit(
    mean_square: dict[str, Array], kinds: dict[str, NDArray[np.intp]], few: Mapping[str, float]
) -> Array:
    """sum_k n_k ln s_k^2: minus twice the likelihood at its best sigma of each kind, up to a constant [-]; of those
    that are few sum_k n_k s_k^2 / e_k^2, e_k their standard errors.
    """
    for kind, each in mean_square.items():
        if kind not in few and np.nanmin(each) == 0:
            raise InputError(
                f"observations: a member reproduces every {kind} exactly, so sigma cannot be taken from the residual; "
                "give standard errors and use `infer.sigma: known`."
            )
    terms = [
        len(kinds[kind]) * (each / few[kind] ** 2 if kind in few else np.log(each))
        for kind, each in mean_square.items()
    ]
    return np.sum(terms, axis=0)


def _variance(values: Array) -> float:
    """NaN instead of zero: against a constant no efficiency is defined."""
    return float(np.var(values)) or float("nan")


def _log_likelihood(residual: Array, noise: Array, used: NDArray[np.bool_]) -> Array:
    """ln p(u_i | U_i) = -ln(2 pi s_i^2) / 2 - (u_i - U_i)^2 / (2 s_i^2)."""
    noise = np.where(used, noise, np.nan)
    return -0.5 * np.log(2 * np.pi * noise**2) - 0.5 * (residual / noise) ** 2


def root_mean_square(values: Array) -> float:
    """sqrt(mean x^2), in the unit of the values; NaN without any, or with one that is unknown."""
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")
