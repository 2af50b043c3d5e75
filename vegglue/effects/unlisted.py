"""An object of no named kind at a place: what a diagnosis tries where no effect of the library fits."""

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.definition import Amplitude, Effect, Shape
from vegglue.effects.surroundings import Cells


def unlisted_object(cells: Cells, drag: Array, x: Array, y: Array, radius: Array) -> dict[str, Array]:
    """k -> max(k + c exp(-((x - x_0)^2 + (y - y_0)^2) / r^2), 0) [1/m], for an object of radius r at x_0, y_0 [m]."""
    away = ((cells.geometry.x - x) ** 2 + (cells.geometry.y - y) ** 2) / radius**2
    return {"rate": np.maximum(cells.rate + drag * np.exp(-away), 0.0)}


EFFECTS = (
    Effect(
        name="unlisted_object",
        stage="resistance",
        title="Something stands in the flow (or is missing) at one place",
        equation="k -> k + c exp(-((x - x_0)^2 + (y - y_0)^2) / r^2)",
        act=unlisted_object,
        amplitude=Amplitude("drag", "1/m", "drag c of the object per length of flow through it", 2.0, -5.0, 50.0),
        shapes=(
            Shape("x", "m", "where along the channel", 0.0, -1e5, 1e5),
            Shape("y", "m", "where across it", 0.0, -1e5, 1e5),
            Shape("radius", "m", "its radius r", 0.5, 0.01, 100.0),
        ),
        source="definition",
        checked=True,
        mirrored=False,
        tags=("search",),
    ),
)
