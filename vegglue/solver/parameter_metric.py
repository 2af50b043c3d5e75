"""Which members are near one another: coordinates in which they lie as far apart as their flows differ, sets of
neighbours, and the order to solve them in.

Places s (m, d) are prior probabilities, in which every parameter is alike; spots s A are places along other axes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array

# The shortest axis, relative to the longest: no parameter is left out of account.
SHORTEST = 0.1


@dataclass(frozen=True)
class ParameterMetric:
    """Members: their places in the unit cube and their spots (m, d), and the axes A (d, d) of these."""

    places: Array
    axes: Array
    spots: Array


def parameter_metric(places: Array, slopes: Sequence[tuple[Array, ...]]) -> ParameterMetric:
    """Members at places, nearness as the tangents of some flows have it."""
    found = axes(slopes, places.shape[1])
    return ParameterMetric(places, found, places @ found)


def axes(slopes: Sequence[tuple[Array, ...]], parameters: int) -> Array:
    """A (d, d), the principal axes of G = sum S'S, S the tangents d state/ds of one flow or more; each as long as the
    square root of the change along it, the longest one.

    Along axes as long as the change itself members take more steps (DECISIONS). Rounded, so that sets cut with them are
    the same on another machine. The unit cube without tangents.
    """
    gram = np.zeros((parameters, parameters))
    for some in slopes:
        flat = np.stack([slope.ravel() for slope in some])
        gram += flat @ flat.T
    if not gram.any():
        return np.eye(parameters)
    squares, found = np.linalg.eigh(gram)
    found *= np.sign(found[np.abs(found).argmax(axis=0), np.arange(parameters)])
    length = np.maximum(np.maximum(squares, 0.0) / squares[-1], SHORTEST**4) ** 0.25
    return np.round(found * length, 2)


def leaves(spots: Array, size: int) -> list[np.ndarray]:
    """Index sets of neighbours, as few and as even as `size` allows, cut across the longest side; each next to the
    last.
    """

    def cut(index: np.ndarray, parts: int, upwards: bool) -> list[np.ndarray]:
        if parts == 1:
            return [index]
        longest = int(np.argmax(np.ptp(spots[index], axis=0)))
        ordered = index[np.argsort(spots[index, longest], kind="stable")]
        fewer = parts // 2
        border = index.size * fewer // parts
        low, high = (ordered[:border], fewer), (ordered[border:], parts - fewer)
        first, second = (low, high) if upwards else (high, low)
        return cut(*first, True) + cut(*second, False)

    return cut(np.arange(len(spots)), -(-len(spots) // size), True)


def spread(spots: Array, pending: np.ndarray, centre: Array) -> np.ndarray:
    """Pending members, the furthest from all before first, so that most of them lie between others."""
    chosen, order = spots[pending], []
    distance = squared(chosen, centre)
    for _ in range(pending.size):
        order.append(int(np.argmax(distance)))
        distance = np.minimum(distance, squared(chosen, chosen[order[-1]]))
        distance[order] = -1.0
    return pending[order]


def nearest_members(spots: Array, some: np.ndarray, centre: Array, most: int) -> np.ndarray:
    """Of some members, those nearest to a spot, the nearest first."""
    return some[np.argsort(squared(spots[some], centre), kind="stable")[:most]]


def squared(spots: Array, spot: Array) -> Array:
    """Squared distances from one spot, (m,)."""
    return np.asarray(((spots - spot) ** 2).sum(axis=1))
