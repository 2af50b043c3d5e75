"""Where the model misses: the misfit by experiment, section and zone of the channel."""

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.calibration.noise import Noise
from vegglue.effects.surroundings import ChannelGeometry
from vegglue.engine.interface import Model, Point
from vegglue.site.channel_geometry import channel_geometry

# Distance [m], in units of the half width of the floor, within which a station counts as at the edge of a patch.
AT_EDGE = 0.2


def misfit_zones(model: Model, noise: Noise, point: Point) -> pd.DataFrame:
    """Mean misfit with its standard error, and chi2, by experiment, section and zone (floor, bank, plants, edge)."""
    used = model.station.iloc[noise.rows]
    table = pd.DataFrame(
        {
            "experiment": used["experiment"].to_numpy(),
            "section": np.where(used["kind"] == "level", "gauges", used["section"]),
            "zone": _zones(model, used),
            "left": noise.residual(point.prediction),
            "error": noise.of_data,
        }
    )
    rows = []
    for (experiment, section, zone), part in table.groupby(["experiment", "section", "zone"], sort=False):
        size = len(part)
        related = 1.0 + (noise.correlation / (1.0 - noise.correlation) * 2.0 if size > 2 else 0.0)
        rows.append(
            {
                "experiment": experiment,
                "section": section,
                "zone": zone,
                "stations": size,
                "mean": float(part["left"].mean()),
                "standard_error": float(np.sqrt((part["error"] ** 2).sum() * related) / size),
                "chi2": float(((part["left"] / part["error"]) ** 2).sum()),
            }
        )
    return pd.DataFrame(rows)


def _zones(model: Model, used: pd.DataFrame) -> list[str]:
    grid, x, y = model.site.grid, used["x"].to_numpy(float), used["y"].to_numpy(float)
    cells = zip(_cell(x, grid.x, grid.dx), _cell(y, grid.y, grid.dy), strict=True)
    return [
        "level" if kind == "level" else _zone(channel_geometry(model.case, model.site, str(experiment)), *cell)
        for experiment, kind, cell in zip(used["experiment"], used["kind"], cells, strict=True)
    ]


def _cell(points: Array, centres: Array, step: float) -> np.ndarray:
    """The cell each point lies in, the outermost beyond."""
    return np.clip(np.rint((points - centres[0]) / step), 0, centres.size - 1).astype(np.int64)


def _zone(ground: ChannelGeometry, i: int, j: int) -> str:
    if abs(ground.edge[i, j, 0]) < AT_EDGE * ground.half_width[i, j, 0]:
        return "edge"
    if ground.planted[i, j, 0]:
        return "plants"
    return "bank" if ground.bank[i, j, 0] else "floor"
