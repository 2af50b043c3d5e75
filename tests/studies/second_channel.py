"""The numbers of a site, as a surveyor would hand them to the second solver: channel, patches, and how places lie.

Lengths in m; x (nx, 1) downstream, y (1, ny) to the left of the axis.
"""

from dataclasses import dataclass

import numpy as np
from second_solver import Field

Range = tuple[float, float]


@dataclass(frozen=True)
class Channel:
    """length [m], half width of the floor [m], rise of the banks [-], slope along [-]; patches as ranges of x and y,
    and stems of each over those of the densest [-]; inflow: half width of the side that water enters over [m].
    """

    length: float
    half: float
    rise: float
    slope: float
    patches: tuple[tuple[Range, Range], ...]
    density: tuple[float, ...]
    inflow: float


@dataclass(frozen=True)
class Lie:
    """How cells lie: x, y; bank: 1 on the banks, else 0; cover: share of the cell under a patch; patch: number of the
    one that covers most of it, -1 without; front: distance from the upstream end of its patch; edge: from the nearest
    side of a patch, negative inside, infinite beside none; wake: from the end of the nearest patch upstream in this
    row; end: x of the outlet.
    """

    x: Field
    y: Field
    bank: Field
    cover: Field
    patch: Field
    front: Field
    edge: Field
    wake: Field
    end: float


PAPER = Channel(
    100.0, 1.5, 2.0 / 3.0, 0.001,
    tuple(((40.0 + 8 * n, 44.0 + 8 * n), (0.0, 1.5) if n % 2 == 0 else (-1.5, 0.0)) for n in range(7)),
    (1.0,) * 4 + (7.3 / 22.0,) * 3, 4.5,
)  # fmt: skip
# Banks as its config writes them, and two patches.
SHORT = Channel(32.0, 1.5, 0.6667, 0.001, (((8.0, 12.0), (-1.5, 0.0)), ((18.0, 22.0), (0.0, 1.5))), (1.0, 0.5), 3.75)


def lie_of(channel: Channel, x: Field, y: Field, dx: float = 0.0, dy: float = 0.0) -> Lie:
    """How places lie; cover is that of cells dx by dy around them."""
    shape = np.broadcast(x, y).shape
    cover, patch = np.zeros(shape), np.full(shape, -1)
    front, edge, wake = (np.full(shape, np.inf) for _ in range(3))
    for number, (along, across) in enumerate(channel.patches):
        share = _share(x, dx, along) * _share(y, dy, across)
        inside = share > cover
        patch[inside] = number
        front = np.where(inside, np.maximum(x - along[0], 0.0), front)
        beside = (x > along[0]) & (x < along[1])
        out = np.maximum(across[0] - y, y - across[1])
        edge = np.where(beside & (np.abs(out) < np.abs(edge)), out, edge)
        behind = (x > along[1]) & (y > across[0]) & (y < across[1])
        wake = np.where(behind, np.minimum(wake, x - along[1]), wake)
        cover = np.maximum(cover, share)
    bank = (np.abs(y) > channel.half) + np.zeros(shape)
    return Lie(x + np.zeros(shape), y + np.zeros(shape), bank, cover, patch, front, edge, wake, channel.length)


def _share(middle: Field, width: float, part: Range) -> Field:
    """Share of a cell that lies in a range; 0 or 1 of a point."""
    if width == 0.0:
        return ((middle > part[0]) & (middle < part[1])).astype(float)
    low, high = np.maximum(middle - width / 2, part[0]), np.minimum(middle + width / 2, part[1])
    return np.maximum(high - low, 0.0) / width
