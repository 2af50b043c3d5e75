"""Effects on the bed level z_b [m] (nx, ny, m): what a survey may have missed, or the flow has changed since.

Parameters are (m,); unit and meaning of each stand in EFFECTS, with the source of the formula.
"""

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.definition import Amplitude, Effect, Shape
from vegglue.effects.surroundings import ChannelGeometry


def floor_level(geometry: ChannelGeometry, rise: Array) -> dict[str, Array]:
    """z_b -> z_b + dz on the floor."""
    return {"bed": rise * (1.0 - geometry.bank)}


def bank_level(geometry: ChannelGeometry, rise: Array) -> dict[str, Array]:
    """z_b -> z_b + dz on the banks."""
    return {"bed": rise * geometry.bank}


def bed_slope(geometry: ChannelGeometry, slope: Array) -> dict[str, Array]:
    """z_b -> z_b + s (x_end - x): the bed at the outlet stays."""
    return {"bed": slope * (geometry.x[-1] - geometry.x) * np.ones_like(geometry.bed)}


def cross_slope(geometry: ChannelGeometry, slope: Array) -> dict[str, Array]:
    """z_b -> z_b + s (y - y_axis), y_axis that of the channel axis."""
    return {"bed": slope * geometry.offset * geometry.half_width}


def flank_scour(geometry: ChannelGeometry, depth: Array, width: Array) -> dict[str, Array]:
    """z_b -> z_b - d exp(-((e - w) / w)^2) outside the sides of a patch, e the distance from them [m]."""
    # Columns without a patch count as inside one, where nothing is dug.
    beside = np.where(np.isfinite(geometry.edge), geometry.edge, -1e3)
    return {"bed": np.where(beside > 0.0, -depth * np.exp(-(((beside - width) / width) ** 2)), 0.0)}


def patch_deposit(geometry: ChannelGeometry, rise: Array) -> dict[str, Array]:
    """z_b -> z_b + dz where plants stand."""
    return {"bed": rise * geometry.planted}


def wake_deposit(geometry: ChannelGeometry, rise: Array, length: Array) -> dict[str, Array]:
    """z_b -> z_b + dz exp(-s / L) behind a patch, s the distance from its end [m]."""
    return {"bed": rise * np.exp(-geometry.wake / length)}


FOLLETT = "Follett and Nepf (2012), shape assumed"
FOLLETT_DOI = "10.1016/j.geomorph.2012.08.006"
EFFECTS = (
    Effect(
        name="floor_level_error",
        stage="site",
        title="The floor lies higher than surveyed",
        equation="z_b -> z_b + dz on the floor",
        act=floor_level,
        amplitude=Amplitude("rise", "m", "how much higher the floor lies than surveyed", 0.1, -0.5, 0.5, of="depth"),
        source="definition",
        checked=True,
    ),
    Effect(
        name="bank_level_error",
        stage="site",
        title="The banks lie higher than surveyed",
        equation="z_b -> z_b + dz on the banks",
        act=bank_level,
        amplitude=Amplitude("rise", "m", "how much higher the banks lie than surveyed", 0.1, -0.5, 0.5, of="depth"),
        source="definition",
        checked=True,
        needs=("banks",),
    ),
    Effect(
        name="bed_slope_error",
        stage="site",
        title="The bed falls more steeply than surveyed",
        equation="z_b -> z_b + s (x_end - x)",
        act=bed_slope,
        amplitude=Amplitude("slope", "-", "additional slope s along the channel", 1.0, -10.0, 10.0, of="slope_error"),
        source="definition",
        checked=True,
    ),
    Effect(
        name="cross_slope_error",
        stage="site",
        title="The bed is tilted to one side",
        equation="z_b -> z_b + s (y - y_axis), higher towards larger y",
        act=cross_slope,
        amplitude=Amplitude("slope", "-", "slope s across the channel", 0.03, -0.15, 0.15, of="tilt"),
        source="definition",
        checked=True,
        mirrored=False,
    ),
    Effect(
        name="flank_scour",
        stage="site",
        title="The flow has dug a trench beside the plants",
        equation="z_b -> z_b - d exp(-((e - w)/w)^2) at the distance e > 0 from the sides of a patch",
        act=flank_scour,
        amplitude=Amplitude("depth", "m", "depth d of the trench, negative for a ridge", 0.1, -0.5, 0.5, of="depth"),
        shapes=(
            Shape(
                "width",
                "m",
                "half width w, and how far off the trench is deepest",
                0.27,
                0.03,
                3.3,
                (0.2, 0.53),
                "patch_width",
            ),
        ),
        source=FOLLETT,
        doi=FOLLETT_DOI,
        needs=("plants",),
    ),
    Effect(
        name="patch_deposit",
        stage="site",
        title="Sediment has settled among the plants",
        equation="z_b -> z_b + dz where plants stand",
        act=patch_deposit,
        amplitude=Amplitude("rise", "m", "thickness dz of the deposit", 0.1, -0.4, 0.4, of="depth"),
        source="definition",
        checked=True,
        needs=("plants",),
    ),
    Effect(
        name="wake_deposit",
        stage="site",
        title="A bar has grown behind the plants",
        equation="z_b -> z_b + dz exp(-s/L), s the distance downstream of a patch",
        act=wake_deposit,
        amplitude=Amplitude("rise", "m", "height dz of the bar at the end of the patch", 0.1, -0.4, 0.4, of="depth"),
        shapes=(Shape("length", "m", "length L over which it fades", 2.0, 0.13, 33.0, (1.0, 4.0), "patch_width"),),
        source=FOLLETT,
        doi=FOLLETT_DOI,
        needs=("plants",),
    ),
)
