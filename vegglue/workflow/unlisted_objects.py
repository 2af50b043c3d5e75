"""Effects that stand in no list: what `vegglue twin --hide unlisted:NAME` hides, so that no named effect is right."""

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.definition import Act, Amplitude, Effect, Shape, Stage
from vegglue.effects.physical_constants import GRAVITY
from vegglue.effects.surroundings import Cells, ChannelGeometry


def _away(geometry: ChannelGeometry, x: Array, y: Array, radius: Array) -> Array:
    """Squared distance from a place over the squared radius [-]."""
    return ((geometry.x - x) ** 2 + (geometry.y - y) ** 2) / radius**2


def pier(cells: Cells, drag: Array, x: Array, y: Array, radius: Array) -> dict[str, Array]:
    """k -> k + c exp(-(s / r)^4), s the distance from a place: a block with sharp sides."""
    return {"rate": cells.rate + drag * np.exp(-(_away(cells.geometry, x, y, radius) ** 2))}


def jet(cells: Cells, push: Array, x: Array, y: Array, radius: Array) -> dict[str, Array]:
    """f_x = g a exp(-(s / r)^2)."""
    return {"x": GRAVITY * push * np.exp(-_away(cells.geometry, x, y, radius))}


def sink(cells: Cells, loss: Array, x: Array, y: Array, radius: Array) -> dict[str, Array]:
    """f = -a U exp(-(s / r)^2): momentum is lost in proportion to speed, not to its square."""
    held = -loss * np.exp(-_away(cells.geometry, x, y, radius))
    return {"x": held * cells.u, "y": held * cells.v}


def fallen_tree(cells: Cells, drag: Array, x: Array, y: Array, radius: Array) -> dict[str, Array]:
    """k -> k + c exp(-(p / 0.3 r)^2 - (q / 2 r)^4), q along a stem at 45 degrees to the channel and p across it."""
    along = ((cells.geometry.x - x) + (cells.geometry.y - y)) / np.sqrt(2.0)
    across = ((cells.geometry.x - x) - (cells.geometry.y - y)) / np.sqrt(2.0)
    shape = np.exp(-((across / (0.3 * radius + 0.2)) ** 2) - (along / (2.0 * radius)) ** 4)
    return {"rate": cells.rate + drag * shape}


def scour_hole(geometry: ChannelGeometry, depth: Array, x: Array, y: Array, radius: Array) -> dict[str, Array]:
    """z_b -> z_b - d exp(-(s / r)^2)."""
    return {"bed": -depth * np.exp(-_away(geometry, x, y, radius))}


OBJECT_PLACE = (
    Shape("x", "m", "where along the channel", 0.0, -1e5, 1e5),
    Shape("y", "m", "where across it", 0.0, -1e5, 1e5),
    Shape("radius", "m", "its radius r", 0.6, 0.01, 100.0),
)
DRAG = Amplitude("drag", "1/m", "drag c per length of flow through it", 1.0, 0.0, 50.0)


def _unlisted(name: str, stage: Stage, title: str, act: Act, amplitude: Amplitude) -> Effect:
    return Effect(
        name, stage, title, str(act.__doc__), act, amplitude, OBJECT_PLACE, source="definition", mirrored=False
    )


LOSS = Amplitude("loss", "1/s", "rate a of loss", 0.3, 0.0, 50.0)
PUSH = Amplitude("push", "-", "push a in units of gravity", 0.01, 0.0, 1.0)
SCOUR_DEPTH = Amplitude("depth", "m", "its depth d", 0.3, 0.0, 3.0)
EFFECTS = (
    _unlisted("pier", "resistance", "A pier stands in the flow", pier, DRAG),
    _unlisted("jet", "force", "Water is pushed at one place", jet, PUSH),
    _unlisted("sink", "force", "Momentum is lost at one place", sink, LOSS),
    _unlisted("fallen_tree", "resistance", "A tree lies aslant in the flow", fallen_tree, DRAG),
    _unlisted("scour_hole", "site", "A hole in the bed", scour_hole, SCOUR_DEPTH),
)
