"""Quality control of a section: which verticals cannot be trusted, and why. Nothing is dropped here."""

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array

# A probe is dead when all four hold. Chosen wide apart from what slow water shows, which still fluctuates.
LARGEST_DEAD_SPEED = 0.05  # m/s, no point of a dead probe is above this
SHARE_OF_SPEED = 0.1  # [-], at all heights it reads less than this share of the velocity between its neighbours
SHARE_OF_TURBULENCE = 0.25  # [-], and its velocity fluctuates by less than this share of theirs
FEWEST_HEIGHTS = 3  # with fewer points a slow vertical at the water's edge cannot be told from a dead probe


def dead_probes(
    edges: tuple[float, float],
    position: Array,
    points: NDArray[np.int64],
    largest: Array,
    mean: Array,
    deviation: Array,
    plants: NDArray[np.bool_],
) -> list[str]:
    """Why the probe of each vertical (n,) is taken for dead, or ''.

    A dead probe reads near zero at every height, without turbulence, where its neighbours do not. In slow water a
    working probe still sees fluctuations and a rise with height.

    edges: y of the water's edges, where velocity and turbulence are zero [m]; position (n,): y of the verticals [m];
    points (n,): how many each has; largest and mean (n,): largest |u| and mean u over its points [m/s]; deviation (n,):
    median of u_std [m/s], NaN when unknown; plants (n,): whether it stands in plants, where slow water is natural, so
    that without u_std its probe is not taken for dead.
    """
    suspect = (largest < LARGEST_DEAD_SPEED) & (points >= FEWEST_HEIGHTS)
    if suspect.all():
        return ["" for _ in position]
    expected_mean = _between_neighbours(position, edges, mean, ~suspect)
    expected_deviation = _between_neighbours(position, edges, deviation, ~suspect)
    unknown = np.isnan(deviation) | np.isnan(expected_deviation)
    calm = np.where(unknown, ~plants, deviation < SHARE_OF_TURBULENCE * expected_deviation)
    dead = suspect & calm & (largest < SHARE_OF_SPEED * expected_mean)
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
