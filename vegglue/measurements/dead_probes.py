"""Quality control of a section: which verticals cannot be trusted, and why. Nothing is dropped here."""

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array

STILL = 0.05  # m/s, no point of a dead probe is above this
SHARE = 0.1  # a dead probe stays below this share of the velocity between its neighbours at all heights ...
CALM = 0.25  # ... and its velocity fluctuates by less than this share of theirs
FEWEST = 3  # points; with fewer a slow vertical at the water's edge cannot be told from a dead probe


def dead_probes(
    edges: tuple[float, float],
    position: Array,
    points: NDArray[np.int64],
    largest: Array,
    mean: Array,
    deviation: Array,
    plants: NDArray[np.bool_],
) -> list[str]:
    """'' or the reason, for each vertical: near zero at every height where its neighbours are not, and no turbulence.

    edges and position (n,): y of the water's edges, where velocity and turbulence are zero, and of the verticals [m];
    points: how many; largest and mean: of |u| and u over the points [m/s]; deviation: median of u_std [m/s], NaN when
    unknown, and then a vertical inside plants (bool) gets the benefit of the doubt, since slow water is natural there.

    A probe in slow water still sees it fluctuate and speed up with height, and so is not taken for dead.
    """
    suspect = (largest < STILL) & (points >= FEWEST)
    if suspect.all():
        return ["" for _ in position]
    expected_mean = _between_neighbours(position, edges, mean, ~suspect)
    expected_deviation = _between_neighbours(position, edges, deviation, ~suspect)
    unknown = np.isnan(deviation) | np.isnan(expected_deviation)
    calm = np.where(unknown, ~plants, deviation < CALM * expected_deviation)
    dead = suspect & calm & (largest < SHARE * expected_mean)
    return [
        f"near zero at all {points[i]} heights (at most {largest[i]:.3f} m/s, where its neighbours give "
        f"{expected_mean[i]:.2f} m/s{_turbulence(deviation[i], expected_deviation[i])}): the probe is taken for dead"
        if dead[i]
        else ""
        for i in range(len(position))
    ]


def _turbulence(deviation: float, expected: float) -> str:
    known = np.isfinite(deviation) and np.isfinite(expected)
    return f", and fluctuating by {deviation:.3f} against {expected:.3f} m/s" if known else ""


def _between_neighbours(position: Array, edges: tuple[float, float], value: Array, good: NDArray[np.bool_]) -> Array:
    nodes = np.concatenate([[edges[0]], position[good], [edges[1]]])
    return np.interp(position, nodes, np.concatenate([[0.0], value[good], [0.0]]))
