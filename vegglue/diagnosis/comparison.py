"""The error ladder: how well each of several models, calibrated alike, predicts what it has seen and what it has not.

Held out: each section, or each experiment, is left out in turn and the model calibrated again by one exact linear step,

    dz = (J' C^-1 J + 1)^-1 (J' C^-1 r - z)   over the rows kept,   error r - J dz of those left out.
"""

from dataclasses import dataclass

import numpy as np
import scipy.stats

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline
from vegglue.calibration.fit import interval95
from vegglue.calibration.noise import Noise, covariance_of
from vegglue.engine.interface import Model, linearise
from vegglue.inference.homogeneity import alike, told_by_data
from vegglue.inference.likelihood import root_mean_square
from vegglue.measurements.kinds import KINDS, STREAMWISE


@dataclass(frozen=True)
class Rung:
    """One model of the ladder. Errors [m/s] of velocities along x unless said; stations (n,) are the used ones.

    rmse: by kind, NaN for what was not measured; sections, experiments: held-out error of each station, NaN where
    nothing could be left out; log_score: mean log predictive density of held-out sections; inside50, inside95: share of
    held-out measurements within the bands [-]; homogeneity: chance that a parameter is the same in all experiments, by
    name; validation: root mean square error of velocities that no calibration has seen, NaN without them.
    """

    name: str
    title: str
    effects: tuple[str, ...]
    parameters: int
    rmse: dict[str, float]
    chi2: float
    stations: int
    noise_floor: float
    sections: Array
    experiments: Array
    log_score: float
    inside50: float
    inside95: float
    values: dict[str, tuple[float, float, float]]
    homogeneity: dict[str, float]
    validation: float
    velocity: np.ndarray
    place: tuple[str, ...]


def rung(base: Baseline, validation: Model | None = None) -> Rung:
    """What there is to say of one calibrated model; validation: the same at stations it has not seen."""
    model, noise, point = base.model, base.noise, base.fitted.point
    used = model.station.iloc[noise.rows]
    velocity = (used["kind"] == STREAMWISE).to_numpy()
    left = noise.residual(point.prediction)
    section, spread = _held_out(base, used["section"].astype(str).to_numpy())
    experiment, _ = _held_out(base, used["experiment"].astype(str).to_numpy())
    surprise = np.abs(section[velocity] / spread[velocity])
    density = scipy.stats.norm.logpdf(section[velocity], scale=spread[velocity])
    return Rung(
        name=model.case.name,
        title=model.case.title,
        effects=tuple(model.case.effects),
        parameters=len(model.names),
        rmse={kind: root_mean_square(left[(used["kind"] == kind).to_numpy()]) for kind in KINDS},
        chi2=float(np.sum((left / noise.error) ** 2)),
        stations=int(noise.rows.size),
        noise_floor=root_mean_square(noise.error[velocity]),
        sections=section,
        experiments=experiment,
        log_score=float(np.nanmean(density)) if np.isfinite(density).any() else float("nan"),
        inside50=_share(surprise, 0.5),
        inside95=_share(surprise, 0.95),
        values={name: interval95(model, base.fitted, name) for name in model.names},
        homogeneity=homogeneity(base),
        validation=float("nan") if validation is None else _validated(base, validation),
        velocity=velocity,
        place=tuple(f"{e} {s}" for e, s in zip(used["experiment"], used["section"], strict=True)),
    )


def held_out(rung: Rung, by: str = "sections") -> float:
    """Root mean square held-out error of velocities [m/s]."""
    error = getattr(rung, by)[rung.velocity]
    return root_mean_square(error[np.isfinite(error)])


def improvement(before: Rung, after: Rung, by: str = "sections") -> tuple[float, float]:
    """Mean of e_before^2 - e_after^2 over held-out velocities, and its standard error by clusters (experiment and
    section), both in (m/s)^2.
    """
    gain = (getattr(before, by) ** 2 - getattr(after, by) ** 2)[after.velocity]
    names = np.array(after.place)[after.velocity]
    known = np.isfinite(gain)
    if not known.any():
        return float("nan"), float("nan")
    means = np.array([gain[known & (names == name)].mean() for name in dict.fromkeys(names[known])])
    error = means.std(ddof=1) / np.sqrt(means.size) if means.size > 1 else float("nan")
    return float(gain[known].mean()), float(error)


def homogeneity(base: Baseline) -> dict[str, float]:
    """For each parameter the chance p that it is the same in all experiments, each moved to by one linear step [-].

    The test of `transfer`; parameters of which fewer than two experiments say enough are left out.
    """
    noise, point = base.noise, base.fitted.point
    slope, left = noise.used(point.slope), noise.residual(point.prediction)
    names = base.model.station["experiment"].to_numpy()[noise.rows]
    told = []
    for experiment in dict.fromkeys(names):
        step, spread = _step(noise, slope, left, point.z, np.flatnonzero(names == experiment))
        told.append(told_by_data(base.model.case, point.z + step, np.diag(spread)))
    value, error = (np.array(part) for part in zip(*told, strict=True))
    chances = {name: alike(value[:, j], error[:, j])[2] for j, name in enumerate(base.model.names)}
    return {name: p for name, p in chances.items() if np.isfinite(p)}


def _held_out(base: Baseline, groups: np.ndarray) -> tuple[Array, Array]:
    """Errors of stations when their group is left out, and the spread they were predicted with (n,)."""
    noise, point = base.noise, base.fitted.point
    slope, left = noise.used(point.slope), noise.residual(point.prediction)
    error, spread = np.full(left.size, np.nan), np.full(left.size, np.nan)
    names = dict.fromkeys(groups)
    if len(names) < 2:
        return error, spread
    own = np.diag(covariance_of(noise))
    for name in names:
        out = np.flatnonzero(groups == name)
        step, covariance = _step(noise, slope, left, point.z, np.flatnonzero(groups != name))
        error[out] = left[out] - slope[out] @ step
        spread[out] = np.sqrt(own[out] + np.einsum("ij,jk,ik->i", slope[out], covariance, slope[out]))
    return error, spread


def _step(noise: Noise, slope: Array, left: Array, z: Array, kept: np.ndarray) -> tuple[Array, Array]:
    """The linear step when only some rows are kept, and the covariance of z then."""
    lower = np.linalg.cholesky(covariance_of(noise)[np.ix_(kept, kept)])
    white, right = np.linalg.solve(lower, slope[kept]), np.linalg.solve(lower, left[kept])
    matrix = white.T @ white + np.eye(z.size)
    return np.asarray(np.linalg.solve(matrix, white.T @ right - z)), np.asarray(np.linalg.inv(matrix))


def _validated(base: Baseline, validation: Model) -> float:
    point = linearise(validation, base.fitted.point.z)
    if point is None:
        return float("nan")
    station = validation.station
    rows = (station["used"] & (station["kind"] == STREAMWISE)).to_numpy(bool)
    return root_mean_square(station["value"].to_numpy(float)[rows] - point.prediction[rows])


def _share(surprise: Array, level: float) -> float:
    known = surprise[np.isfinite(surprise)]
    return float(np.mean(known < scipy.stats.norm.ppf(0.5 + 0.5 * level))) if known.size else float("nan")
