"""One vertical: from point velocities to a depth average, its standard error, and the height of the canopy.

Heights count from the bed [m]; arrays have shape (points,), sorted upwards. The rule `paper` (linear between points)
stands in `linear_average`, the rule `profile` in `fit_log_law` and `fit_two_layers`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from vegglue.arrays import Array

FEWEST_POINTS = 4  # two or three numbers are fitted: with fewer points no misfit is left to judge them
# ln(h / z_0) [-] of the log law through fewer points: a Chezy coefficient of 47 m^(1/2)/s. Chosen: from 5 (31, coarse)
# to 9 (63, smooth) the average of a point at 0.6 of the depth from the surface, or of two at 0.2 and 0.8, moves by 1 %.
USUAL_ROUGHNESS = 7.0
# Standard error of an average over the average [-] by the number of its points, where a vertical is no log law. Source:
# ISO 748:2007 by Morgenschweis (2010), Hydrometrie, table 4.11: a point at 0.6, two at 0.2 and 0.8 of the depth; three
# lie between these and five points, 2.5 %.
FEW_POINTS_ERROR = {1: 0.075, 2: 0.035, 3: 0.03}
# Standard errors by which the velocity must rise with height to count as a rise: by chance one vertical in 700 does.
SIGNIFICANT_RISE = 3.0
# z_0 and canopy heights tried in a fit: steps of 2 % of z_0, some millimetres in a canopy, finer than points resolve.
HEIGHTS_TRIED = 600
SMOOTHEST_BED = 1e-6  # z_0 over the depth: a micrometre in a metre of water, smoother than any bed
CANOPY_STEP = 0.001  # m, between canopy heights tried for all verticals of a stand, finer than ADV points stand apart
TINY = 1e-300  # keeps 0 / 0 from points that all lie below the top; their slope is then 0


@dataclass(frozen=True)
class Column:
    """The points of one vertical.

    Attributes
    ----------
    height : ndarray (points,)
        Above the bed [m].
    velocity, standard_error : ndarray (points,)
        [m/s]
    depth : float
        Of the water [m].
    """

    height: Array
    velocity: Array
    standard_error: Array
    depth: float


@dataclass(frozen=True)
class ProfileFit:
    """u(z) = within + slope ln(max(z / top, 1)), slope = u* / kappa.

    Attributes
    ----------
    within : float
        Uniform velocity below the top [m/s]; 0 without plants.
    slope : float
        Of the logarithmic part above it [m/s].
    top : float
        Canopy height inside plants, else the roughness height z_0 [m].
    covariance : ndarray (3, 3)
        Of (within, slope, top), times scatter^2.
    scatter : float
        Root of the reduced chi-square, at least 1 [-]: scatter of the points over what their sampling errors
        explain.
    """

    within: float
    slope: float
    top: float
    covariance: Array
    scatter: float

    def velocity(self, height: Array) -> Array:
        """u(z) = within + slope ln(max(z / top, 1)); height (n,) [m] -> (n,) [m/s]."""
        return self.within + self.slope * np.log(np.maximum(height / self.top, 1.0))

    def average(self, depth: float) -> tuple[float, float]:
        """U = (1/h) integral of u(z) from 0 to h = within + slope (ln(h / top) - 1 + top / h).

        depth h [m] -> U and its standard error [m/s]. Where the top is above the water, U = within.
        """
        ratio = max(depth / self.top, 1.0)
        share = np.log(ratio) - 1.0 + 1.0 / ratio
        gradient = np.array([1.0, share, self.slope * (1.0 / depth - 1.0 / self.top) if ratio > 1.0 else 0.0])
        return float(self.within + self.slope * share), float(np.sqrt(gradient @ self.covariance @ gradient))


class CanopyUnknown(Enum):
    """Why verticals inside plants show no canopy height."""

    FEW_POINTS = "few-points"
    NO_SHARED_HEIGHT = "no-shared-height"
    NO_TOP = "no-top"


@dataclass(frozen=True)
class CanopyHeight:
    """Deflected canopy height above the bed.

    Attributes
    ----------
    value, standard_error : float
        [m]; NaN if the verticals show no canopy top.
    columns : int
        Number of verticals.
    unknown : CanopyUnknown or None
        Why they show none, or None.
    """

    value: float
    standard_error: float
    columns: int
    unknown: CanopyUnknown | None = None


def sampling_error(deviation: Array, duration: Array, time_scale: Array | float) -> Array:
    """se = sqrt(2 T_I / T) s, the error of a mean of a record; never above s.

    Parameters
    ----------
    deviation
        Standard deviation s [m/s].
    duration
        T [s]
    time_scale
        Integral time scale T_I [s].

    Returns
    -------
    array
        [m/s]

    References
    ----------
    Lenschow, Mann and Kristensen (1994), doi 10.1175/1520-0426(1994)011<0661:HLILEW>2.0.CO;2.
    """
    return deviation * np.sqrt(np.minimum(2.0 * np.asarray(time_scale) / duration, 1.0))


def linear_weights(height: Array, levels: Array) -> Array:
    """w with u(levels) = w u: linear between points, zero at the bed, constant above the highest.

    Parameters
    ----------
    height
        Of the points above the bed (points,) [m].
    levels
        Above the bed (levels,) [m].

    Returns
    -------
    array
        (levels, points) [-]
    """
    nodes = np.concatenate([[0.0], height])
    return np.column_stack([np.interp(levels, nodes, np.concatenate([[0.0], unit])) for unit in np.eye(len(height))])


def average_weights(height: Array, depth: float) -> Array:
    """w with U = sum(w u): the profile of `linear_weights`, averaged from the bed to the surface.

    Parameters
    ----------
    height
        Of the points above the bed (points,) [m].
    depth
        [m]; the average ends at the highest point if that is above it.

    Returns
    -------
    array
        (points,) [-]
    """
    half = np.diff(np.concatenate([[0.0], height, [max(depth, height[-1])]])) / 2.0
    weights = half[:-1] + half[1:]
    weights[-1] += half[-1]  # above the highest point there is no second point to share with
    return weights / max(depth, height[-1])


def linear_average(column: Column, scatter: float = 1.0) -> tuple[float, float]:
    """U = sum(w u) and its standard error scatter sqrt(sum((w se)^2)), w the `average_weights`.

    Parameters
    ----------
    scatter
        Factor on the standard errors of the points [-], see ProfileFit.

    Returns
    -------
    U, standard error
        [m/s]
    """
    weights = average_weights(column.height, column.depth)
    return float(weights @ column.velocity), float(scatter * np.linalg.norm(weights * column.standard_error))


def few_points_average(column: Column, among_plants: bool) -> tuple[float, float]:
    """U of fewer than FEWEST_POINTS points, which do not resolve the profile.

        U = a (L - 1 + e^-L) of the log law u = a (L + ln(z / h)), L = USUAL_ROUGHNESS

    a is the weighted least-squares estimate; the error is that of the points and FEW_POINTS_ERROR. Among plants see
    `average_within_plants`. The average is the integral of the log law.

    Parameters
    ----------
    among_plants
        Whether the vertical stands in plants.

    Returns
    -------
    U, standard error
        [m/s]

    References
    ----------
    ISO 748:2007 for the errors.
    """
    if among_plants:
        return average_within_plants(column)
    rise = np.maximum(USUAL_ROUGHNESS + np.log(column.height / column.depth), 0.0)
    weight = rise / column.standard_error**2
    share = (USUAL_ROUGHNESS - 1.0 + np.exp(-USUAL_ROUGHNESS)) / max(float(weight @ rise), TINY)
    average = share * float(weight @ column.velocity)
    sampling = share * float(np.linalg.norm(weight * column.standard_error))
    return average, float(np.hypot(sampling, FEW_POINTS_ERROR[len(column.height)] * average))


def average_within_plants(column: Column) -> tuple[float, float]:
    """U of points among plants that show no top: stems keep u even down to the bed.

    As `linear_average`, but uniform below the lowest point; what zero at the bed would change is the bound of a uniform
    distribution.

    Returns
    -------
    U, standard error
        [m/s]
    """
    zero_at_bed, sampling = linear_average(column)
    more = 0.5 * column.height[0] / max(column.depth, column.height[-1]) * float(column.velocity[0])
    return zero_at_bed + more, float(np.hypot(sampling, more / np.sqrt(3.0)))


def fit_log_law(column: Column) -> ProfileFit | None:
    """u = (u* / kappa) ln(z / z_0) above z_0, zero below: the profile of water without plants.

    Weighted least squares: z_0 is the best of HEIGHTS_TRIED values, the slope of each is exact.

    Returns
    -------
    ProfileFit or None
        None with fewer than FEWEST_POINTS points, or if the velocity does not rise with height.
    """
    tops = np.geomspace(SMOOTHEST_BED * column.depth, 0.9 * column.height[-1], HEIGHTS_TRIED)
    return _fit(column, tops, within_free=False)


def fit_two_layers(column: Column) -> ProfileFit | None:
    """u = u_v below the canopy height k, u_v + (u* / kappa) ln(z / k) above it: the profile inside plants.

    Weighted least squares: k is the best of HEIGHTS_TRIED values, u_v and the slope of each are exact.

    Returns
    -------
    ProfileFit or None
        None with fewer than FEWEST_POINTS points, or if the velocity does not rise above a canopy.

    References
    ----------
    Baptist et al. (2007), doi 10.1080/00221686.2007.9521778: the profile behind their resistance formula.
    """
    if len(column.height) < FEWEST_POINTS:
        return None
    return _fit(column, np.linspace(column.height[1], column.height[-2], HEIGHTS_TRIED), within_free=True)


def fit_canopy_height(columns: Sequence[Column]) -> CanopyHeight:
    """k = argmin of sum(chi2(k)) over the verticals: the canopy height shared by all verticals of a stand.

    Each vertical has the profile of `fit_two_layers`, with u_v and u* of its own. Standard error: half the width of the
    range in which chi2(k) <= chi2_min + s^2, with s^2 the reduced chi-square, at least 1, so that scatter between stems
    and verticals counts.

    Returns
    -------
    CanopyHeight
        NaN with a reason if the fit is no better than a uniform velocity in each vertical.
    """
    columns = [column for column in columns if len(column.height) >= FEWEST_POINTS]
    if not columns:
        return CanopyHeight(np.nan, np.nan, 0, CanopyUnknown.FEW_POINTS)
    lowest = max(column.height[1] for column in columns)
    highest = min(column.height[-2] for column in columns)
    if lowest >= highest:
        return CanopyHeight(np.nan, np.nan, len(columns), CanopyUnknown.NO_SHARED_HEIGHT)
    tops = np.arange(lowest, highest, CANOPY_STEP)
    misfit = np.sum([_with_offset(column, tops)[2] for column in columns], axis=0)
    uniform = sum(_with_offset(column, np.array([np.inf]))[2][0] for column in columns)
    best = int(np.argmin(misfit))
    freedom = sum(len(column.height) for column in columns) - 2 * len(columns) - 1
    unit = max(misfit[best] / freedom, 1.0)
    if uniform - misfit[best] < SIGNIFICANT_RISE**2 * unit * len(columns):
        return CanopyHeight(np.nan, np.nan, len(columns), CanopyUnknown.NO_TOP)
    inside = tops[misfit <= misfit[best] + unit]
    return CanopyHeight(float(tops[best]), float(inside[-1] - inside[0]) / 2.0 + 0.5 * CANOPY_STEP, len(columns))


LeastSquares = tuple[Array, Array, Array]  # within, slope, chi-square for each given top, each (tops,)


def _rise(column: Column, tops: Array) -> Array:
    return np.log(np.maximum(column.height / tops[:, None], 1.0))


def _with_offset(column: Column, tops: Array) -> LeastSquares:
    rise, weight = _rise(column, tops), column.standard_error**-2
    share = weight / weight.sum()
    mean_rise, mean_velocity = rise @ share, column.velocity @ share
    rise_off, velocity_off = rise - mean_rise[:, None], column.velocity - mean_velocity
    slope = (rise_off * weight) @ velocity_off / np.maximum((rise_off**2) @ weight, TINY)
    misfit = ((velocity_off - slope[:, None] * rise_off) ** 2) @ weight
    return mean_velocity - slope * mean_rise, slope, misfit


def _fit(column: Column, tops: Array, within_free: bool) -> ProfileFit | None:
    """The best of the tops; within is 0 unless it is free."""
    if len(column.height) < FEWEST_POINTS:
        return None
    if within_free:
        withins, slopes, misfits = _with_offset(column, tops)
    else:
        rise, weight = _rise(column, tops), column.standard_error**-2
        slopes = (rise * weight) @ column.velocity / np.maximum((rise**2) @ weight, TINY)
        withins, misfits = np.zeros(len(tops)), ((column.velocity - slopes[:, None] * rise) ** 2) @ weight
    best = int(np.argmin(misfits))
    within, slope, top = float(withins[best]), float(slopes[best]), float(tops[best])
    free = [0, 1, 2] if within_free else [1, 2]
    scatter = float(np.sqrt(max(misfits[best] / (len(column.height) - len(free)), 1.0)))
    rise = np.log(np.maximum(column.height / top, 1.0))
    jacobian = np.column_stack([np.ones_like(rise), rise, np.where(rise > 0.0, -slope / top, 0.0)])[:, free]
    jacobian = jacobian / column.standard_error[:, None]
    covariance = np.zeros((3, 3))
    covariance[np.ix_(free, free)] = np.linalg.pinv(jacobian.T @ jacobian) * scatter**2
    if slope < SIGNIFICANT_RISE * np.sqrt(covariance[1, 1]):
        return None
    return ProfileFit(within, slope, top, covariance, scatter)
