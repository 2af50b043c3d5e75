"""How near members are to one another: coordinates in which they lie as far apart as their flows differ, clusters of
neighbours, and the order to solve them in.

A member is a point s (d,) of the unit cube, its prior probabilities, in which every parameter is alike. Its coordinates
are s A, along other axes A (d, d).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array

# The shortest axis over the longest [-]: no parameter is left out of account. Chosen, not measured: with less a cluster
# holds members that differ much in what changes flows little.
SHORTEST_AXIS = 0.1
# Weights of a spline [-], which add up to 1, by which known members count at every place but one: chosen, not measured.
LARGEST_WEIGHT = 1e3


@dataclass(frozen=True)
class ParameterMetric:
    """Where members are, and coordinates in which they lie as far apart as their flows differ.

    Attributes
    ----------
    points, coordinates
        s in the unit cube, and s A (m, d).
    axes
        A (d, d).
    """

    points: Array
    axes: Array
    coordinates: Array


def parameter_metric(points: Array, slopes: Sequence[tuple[Array, ...]]) -> ParameterMetric:
    """s A, the coordinates of members by the tangents of some flows, see `principal_axes`.

    Parameters
    ----------
    points : (m, d)
    slopes : sequence of d arrays (nx, 3, ny, 1)
        d state/ds of each flow; the unit cube is left as it is without any.
    """
    axes = principal_axes(slopes, points.shape[1])
    return ParameterMetric(points, axes, points @ axes)


def metric_of_flows(points: Array, states: Array) -> ParameterMetric:
    """s A, A from a plane through the flows of the members themselves, whose slopes are their tangents.

    Parameters
    ----------
    points : (m, d)
    states : (nx, 3, ny, m)
        NaN where there is none; with d known or fewer the unit cube is left as it is.
    """
    known = np.flatnonzero(np.isfinite(states).all(axis=(0, 1, 2)))
    if known.size <= points.shape[1]:
        return parameter_metric(points, [])
    flat = states[..., known].reshape(-1, known.size).T
    plane = np.column_stack([np.ones(known.size), points[known]])
    slopes = np.linalg.lstsq(plane, flat, rcond=None)[0][1:]
    return parameter_metric(points, [tuple(slopes)])


def principal_axes(slopes: Sequence[tuple[Array, ...]], parameters: int) -> Array:
    """A, the principal axes of G = sum S'S, S tangents of flows; each as long as the root of the change along it.

    The longest is 1. Along axes as long as the change itself members take more steps. Rounded, so that clusters cut
    with them are the same on another machine. The unit cube without tangents.

    Parameters
    ----------
    slopes
        As `parameter_metric`.
    parameters : int
        d.

    Returns
    -------
    (d, d)
    """
    gram = np.zeros((parameters, parameters))
    for some in slopes:
        flat = np.stack([slope.ravel() for slope in some])
        gram += flat @ flat.T
    if not gram.any():
        return np.eye(parameters)
    squares, found = np.linalg.eigh(gram)
    found *= np.sign(found[np.abs(found).argmax(axis=0), np.arange(parameters)])
    length = np.maximum(np.maximum(squares, 0.0) / squares[-1], SHORTEST_AXIS**4) ** 0.25
    return np.round(found * length, 2)


def clusters(coordinates: Array, size: int) -> list[np.ndarray]:
    """Index sets of neighbours, few and even, cut across the longest side; each next to the last.

    Parameters
    ----------
    coordinates : (m, d)
    size : int
        Members of one at most.
    """

    def cut(index: np.ndarray, parts: int, upwards: bool) -> list[np.ndarray]:
        if parts == 1:
            return [index]
        longest = int(np.argmax(np.ptp(coordinates[index], axis=0)))
        ordered = index[np.argsort(coordinates[index, longest], kind="stable")]
        fewer = parts // 2
        border = index.size * fewer // parts
        low, high = (ordered[:border], fewer), (ordered[border:], parts - fewer)
        first, second = (low, high) if upwards else (high, low)
        return cut(*first, True) + cut(*second, False)

    return cut(np.arange(len(coordinates)), -(-len(coordinates) // size), True)


def farthest_first(coordinates: Array, pending: np.ndarray, centre: Array) -> np.ndarray:
    """Pending members, the farthest from all before first, so that most of them lie between others.

    Parameters
    ----------
    coordinates : (m, d)
    pending : (n,)
        Which members.
    centre : (d,)
        From which the first is the farthest.
    """
    chosen, order = coordinates[pending], []
    distance = squared_distances(chosen, centre)
    for _ in range(pending.size):
        order.append(int(np.argmax(distance)))
        distance = np.minimum(distance, squared_distances(chosen, chosen[order[-1]]))
        distance[order] = -1.0
    return pending[order]


def nearest_members(coordinates: Array, some: np.ndarray, centre: Array, most: int) -> np.ndarray:
    """Of some members the `most` nearest ones, the nearest first.

    Parameters
    ----------
    coordinates : (m, d)
    some : (n,)
        Which members.
    centre : (d,)
        To which they are near.
    """
    return some[np.argsort(squared_distances(coordinates[some], centre), kind="stable")[:most]]


def spline_weights(known: Array, wanted: Array, kernel: str, degree: int) -> Array | None:
    """w with f(wanted) = w f(known), of splines by radial basis functions.

    Parameters
    ----------
    known, wanted : (k, d), (n, d)
        Coordinates.
    kernel, degree
        As SciPy's `RBFInterpolator`.

    Returns
    -------
    (n, k) or None
        None if no spline is worth it: known places coincide, or lie in a plane, as at an end of a prior.
    """
    from scipy.interpolate import RBFInterpolator  # late: what only looks at a solved run need not wait for it

    try:
        weights = np.asarray(RBFInterpolator(known, np.eye(len(known)), kernel=kernel, degree=degree)(wanted))
    except np.linalg.LinAlgError:
        return None
    return weights if np.abs(weights).max() < LARGEST_WEIGHT else None


def squared_distances(coordinates: Array, centre: Array) -> Array:
    """Squared distances of members (m, d) from one of these coordinates, (m,)."""
    return np.asarray(((coordinates - centre) ** 2).sum(axis=1))
