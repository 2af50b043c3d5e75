"""The centreline of a grid that follows its channel: from the map to lengths along and across it, and back.

    x = X(s) - n sin(theta), y = Y(s) + n cos(theta)

(X, Y) a point of the centreline s from its beginning, theta the direction it heads in there, n positive to its left.
Before its beginning and beyond its end the centreline runs on straight.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.site_schema import CentrelineShape, Stretch

# An arc is held by nodes so far apart [radians]: cubics between them miss it by 4e-9 of its radius.
NODE_STEP = np.radians(2.0)
# Nodes of a centreline of straight parts and arcs at least [-], so that the nearest node is on the right part of it.
FEWEST_NODES = 500
# Nodes for each pair of points of a centreline through points: chosen, not measured; lengths are then right to 1e-6.
NODES_PER_PAIR = 50
# Steps of Newton from the nearest node [-]: two are enough where nodes are as near as these.
STEPS = 6
# Distances from places to nodes held at once [-]: 80 MB, where a survey of a long reach has many of both.
DISTANCES_AT_ONCE = 10_000_000


@dataclass(frozen=True)
class Centreline:
    """Nodes of a centreline: s from its beginning [m], X and Y on the map [m], direction theta from the map's x axis,
    counterclockwise [radians].
    """

    s: Array
    x: Array
    y: Array
    heading: Array


def centreline_of(shape: CentrelineShape) -> Centreline:
    """The centreline a case describes: through points, or of straight parts and arcs."""
    if shape.points is not None:
        return _through(np.array(shape.points, dtype=np.float64))
    return _of_parts(shape.parts or (), shape.start, np.radians(shape.heading))


def heading_at(line: Centreline, s: Array) -> Array:
    """theta(s) [radians]."""
    return np.interp(s, line.s, line.heading)


def on_map(line: Centreline, s: Array, n: Array) -> tuple[Array, Array]:
    """x and y on the map [m] of places s along the centreline and n to its left [m]."""
    x, y, theta = *_position(line, s), heading_at(line, s)
    return x - n * np.sin(theta), y + n * np.cos(theta)


def along_and_across(line: Centreline, x: Array, y: Array) -> tuple[Array, Array]:
    """s and n [m] of places on the map: those of the nearest point of the centreline, where p - (X, Y) is normal to it.

    Newton's steps ds = (p - (X, Y)) . t / (1 - n kappa), from the nearest node.
    """
    nearest = _nearest_node(line, x, y)
    s, n = line.s[nearest], np.zeros_like(x)
    curvature = np.gradient(line.heading, line.s)
    for _ in range(STEPS):
        centre_x, centre_y = _position(line, s)
        theta = heading_at(line, s)
        ahead = (x - centre_x) * np.cos(theta) + (y - centre_y) * np.sin(theta)
        n = (y - centre_y) * np.cos(theta) - (x - centre_x) * np.sin(theta)
        turning = np.interp(s, line.s, curvature, left=0.0, right=0.0)
        s = s + ahead / np.maximum(1.0 - n * turning, 0.5)
    return s, n


def _nearest_node(line: Centreline, x: Array, y: Array) -> NDArray[np.int64]:
    """Number of the node nearest to each place (n,), a part of the places at a time."""
    size = max(DISTANCES_AT_ONCE // line.x.size, 1)
    found = [
        np.hypot(x[i : i + size, None] - line.x, y[i : i + size, None] - line.y).argmin(axis=1)
        for i in range(0, x.size, size)
    ]
    return np.concatenate([np.empty(0, np.int64), *found])


def _position(line: Centreline, s: Array) -> tuple[Array, Array]:
    """X(s) and Y(s): cubics between the nodes, which keep their directions."""
    from scipy.interpolate import CubicHermiteSpline  # late: a straight grid need not wait for it

    inside = np.clip(s, line.s[0], line.s[-1])
    beyond, theta = s - inside, heading_at(line, s)
    x = CubicHermiteSpline(line.s, line.x, np.cos(line.heading))(inside)
    y = CubicHermiteSpline(line.s, line.y, np.sin(line.heading))(inside)
    return x + beyond * np.cos(theta), y + beyond * np.sin(theta)


def _through(points: Array) -> Centreline:
    """A natural cubic spline through points, its parameter the length of the polygon."""
    from scipy.interpolate import CubicSpline  # late: a straight grid need not wait for it

    chord = np.hypot(*np.diff(points, axis=0).T)
    at = _summed(0.0, chord)
    curve = CubicSpline(at, points, bc_type="natural")
    pieces = [np.linspace(*pair, NODES_PER_PAIR, endpoint=False) for pair in pairwise(at)]
    t = np.concatenate([*pieces, at[-1:]])
    speed = np.hypot(*curve(t, 1).T)
    middle = np.hypot(*curve(0.5 * (t[1:] + t[:-1]), 1).T)
    lengths = np.diff(t) * (speed[:-1] + 4.0 * middle + speed[1:]) / 6.0  # Simpson's rule
    heading = np.unwrap(np.arctan2(*curve(t, 1).T[::-1]))
    x, y = curve(t).T
    return Centreline(_summed(0.0, lengths), x, y, heading)


def _of_parts(parts: tuple[Stretch, ...], start: tuple[float, float], heading: float) -> Centreline:
    """Straight parts and arcs, one after the other, in pieces whose chords are ds sin(dtheta/2) / (dtheta/2) long."""
    lengths, turns = np.array([part.run for part in parts]), np.radians([part.angle or 0.0 for part in parts])
    pieces = np.ceil(np.maximum(np.abs(turns) / NODE_STEP, lengths / lengths.sum() * FEWEST_NODES)).astype(int)
    length, turn = np.repeat(lengths / pieces, pieces), np.repeat(turns / pieces, pieces)
    s, theta = _summed(0.0, length), _summed(heading, turn)
    chord, towards = length * np.sinc(turn / (2.0 * np.pi)), theta[:-1] + 0.5 * turn
    return Centreline(s, _summed(start[0], chord * np.cos(towards)), _summed(start[1], chord * np.sin(towards)), theta)


def _summed(first: float, steps: Array) -> Array:
    return np.concatenate([[first], first + np.cumsum(steps)])
