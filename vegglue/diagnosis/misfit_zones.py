"""Where the model misses: the misfit by experiment, section and zone of the channel."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from vegglue.calibration.noise import Noise, covariance_of_data
from vegglue.case.channel_geometry import channel_geometry
from vegglue.case.gridded_site import cells_at
from vegglue.effects.surroundings import ChannelGeometry
from vegglue.engine.interface import Model, Point
from vegglue.measurements.kinds import STREAMWISE, Kind, kind_of

# Distance [m], in units of the half width of the floor, within which a station counts as at the edge of a patch.
AT_EDGE = 0.2


def misfit_zones(model: Model, noise: Noise, point: Point, aside: Sequence[int] = ()) -> pd.DataFrame:
    """Mean misfit with its standard error, and chi2, by experiment, section and zone (floor, bank, plants, edge), of
    all used stations but those set aside.

    Zones of velocities across and of speeds are told apart from those of velocities along x: `floor (v)`.
    """
    used = model.station.iloc[noise.rows]
    kinds = [kind_of(str(name)) for name in used["kind"]]
    table = pd.DataFrame(
        {
            "experiment": used["experiment"].to_numpy(),
            "section": [_section(kind, str(name)) for kind, name in zip(kinds, used["section"], strict=True)],
            "zone": _zones(model, used, kinds),
            "left": noise.residual(point.prediction),
            "error": noise.data_error,
        }
    )
    table = table.drop(index=list(aside))
    rows = []
    covariance = covariance_of_data(noise)
    for (experiment, section, zone), part in table.groupby(["experiment", "section", "zone"], sort=False):
        size, here = len(part), part.index.to_numpy()
        rows.append(
            {
                "experiment": experiment,
                "section": section,
                "zone": zone,
                "stations": size,
                "mean": float(part["left"].mean()),
                "standard_error": float(np.sqrt(covariance[np.ix_(here, here)].sum()) / size),
                "chi2": float(((part["left"] / part["error"]) ** 2).sum()),
            }
        )
    return pd.DataFrame(rows)


def _section(kind: Kind, section: str) -> str:
    """Gauges are one group; a discharge may have a section of its own."""
    return section if kind.velocity else "gauges" if kind.instrument == "gauge" else section or "discharges"


def _zones(model: Model, used: pd.DataFrame, kinds: Sequence[Kind]) -> list[str]:
    x, y = used["x"].to_numpy(float), used["y"].to_numpy(float)
    cells = zip(*cells_at(model.site, x, y), strict=True)
    return [
        _named(kind, channel_geometry(model.case, model.site, str(experiment)), *cell)
        for experiment, kind, cell in zip(used["experiment"], kinds, cells, strict=True)
    ]


def _named(kind: Kind, ground: ChannelGeometry, i: int, j: int) -> str:
    if not kind.velocity:
        return kind.name
    zone = _zone(ground, i, j)
    return zone if kind.name == STREAMWISE else f"{zone} ({kind.column})"


def _zone(geometry: ChannelGeometry, i: int, j: int) -> str:
    if abs(geometry.edge[i, j, 0]) < AT_EDGE * geometry.half_width[i, j, 0]:
        return "edge"
    if geometry.planted[i, j, 0] >= 0.5:
        return "plants"
    return "bank" if geometry.bank[i, j, 0] else "floor"
