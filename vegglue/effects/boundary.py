"""Effects on what enters and leaves: discharge Q, its spread q over an inflow, the outlet level, water along the reach.

Shapes and units as in BoundaryValues. Parameters are (m,); unit and meaning of each stand in EFFECTS.
"""

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.definition import Amplitude, Effect, Shape
from vegglue.effects.surroundings import BoundaryValues


def discharge_error(boundary: BoundaryValues, relative_error: Array) -> dict[str, Array]:
    """Q -> Q (1 + e).

    Parameters
    ----------
    boundary : BoundaryValues
    relative_error : (m,) [-]
        true over reported discharge, less one.

    Returns
    -------
    dict
        `discharge` (inflow, m) [m3/s].
    """
    return {"discharge": boundary.discharge * (1.0 + relative_error)}


def inflow_skew(boundary: BoundaryValues, skew: Array) -> dict[str, Array]:
    """q -> q (1 + a s), s = -1 .. 1 across each inflow.

    Parameters
    ----------
    boundary : BoundaryValues
    skew : (m,) [-]
        relative excess a at the end of the inflow.

    Returns
    -------
    dict
        `spread` (inflow, cell, m) [-].
    """
    return {"spread": boundary.spread * (1.0 + skew * boundary.position)}


def inflow_core(boundary: BoundaryValues, excess: Array) -> dict[str, Array]:
    """q -> q (1 + a (1 - 3 s^2) / 2), s = -1 .. 1 across each inflow.

    Parameters
    ----------
    boundary : BoundaryValues
    excess : (m,) [-]
        twice the relative excess in the middle.

    Returns
    -------
    dict
        `spread` (inflow, cell, m) [-].
    """
    return {"spread": boundary.spread * (1.0 + excess * (1.0 - 3.0 * boundary.position**2) / 2.0)}


def inflow_peak(boundary: BoundaryValues, excess: Array, middle: Array, width: Array) -> dict[str, Array]:
    """q -> q (1 + a exp(-((s - c) / w)^2)), s = -1 .. 1 across each inflow.

    Parameters
    ----------
    boundary : BoundaryValues
    excess : (m,) [-]
        relative excess a in the middle of that part.
    middle : (m,) [-]
        middle c of that part.
    width : (m,) [-]
        its half width w.

    Returns
    -------
    dict
        `spread` (inflow, cell, m) [-].
    """
    return {"spread": boundary.spread * (1.0 + excess * np.exp(-(((boundary.position - middle) / width) ** 2)))}


def lateral_inflow(boundary: BoundaryValues, share: Array) -> dict[str, Array]:
    """q_lateral -> q_lateral + r Q, Q the sum of all inflows [m3/s].

    Parameters
    ----------
    boundary : BoundaryValues
    share : (m,) [-]
        discharge that enters along the reach over that at the inflow.

    Returns
    -------
    dict
        `lateral` (m,) [m3/s].
    """
    return {"lateral": boundary.lateral + share * boundary.discharge.sum(axis=0)}


def outlet_level(boundary: BoundaryValues, rise: Array) -> dict[str, Array]:
    """z_out -> z_out + d.

    Parameters
    ----------
    boundary : BoundaryValues
    rise : (m,) [m]
        true level less the one reported.

    Returns
    -------
    dict
        `level` (m,) [m].
    """
    return {"level": boundary.level + rise}


EFFECTS = (
    Effect(
        name="discharge_error",
        stage="boundary",
        title="The discharge differs from the one reported",
        equation="Q -> Q (1 + e)",
        act=discharge_error,
        amplitude=Amplitude("relative_error", "-", "true over reported discharge, less one", 0.1, -0.5, 0.5),
        source="definition",
        checked=True,
        each="experiment",
    ),
    Effect(
        name="inflow_skew",
        stage="boundary",
        title="More water enters on one side of the inflow",
        equation="q -> q (1 + a s), s from -1 to 1 across the inflow towards larger y",
        act=inflow_skew,
        amplitude=Amplitude("skew", "-", "relative excess a at the end of the inflow", 0.4, -0.9, 0.9),
        source="definition",
        checked=True,
        mirrored=False,
    ),
    Effect(
        name="inflow_core",
        stage="boundary",
        title="More water enters in the middle of the inflow",
        equation="q -> q (1 + a (1 - 3 s^2)/2), s from -1 to 1 across the inflow",
        act=inflow_core,
        amplitude=Amplitude("excess", "-", "twice the relative excess in the middle", 0.4, -0.9, 0.9),
        source="definition",
        checked=True,
    ),
    Effect(
        name="inflow_peak",
        stage="boundary",
        title="More water enters at one part of the inflow",
        equation="q -> q (1 + a exp(-((s - c)/w)^2)), s from -1 to 1 across the inflow towards larger y",
        act=inflow_peak,
        amplitude=Amplitude("excess", "-", "relative excess a in the middle of that part", 0.4, -0.9, 5.0),
        shapes=(
            Shape("middle", "-", "middle c of that part", 0.0, -1.0, 1.0, (-0.75, -0.45, -0.15, 0.15, 0.45, 0.75)),
            Shape("width", "-", "its half width w", 0.3, 0.05, 2.0),
        ),
        source="definition",
        checked=True,
        mirrored=False,
    ),
    Effect(
        name="lateral_inflow",
        stage="boundary",
        title="Water seeps in along the reach",
        equation="dq/dx = r Q / L, spread evenly over the floor, without momentum",
        act=lateral_inflow,
        amplitude=Amplitude(
            "share", "-", "discharge that enters along the reach over that at the inflow", 0.05, 0.0, 0.5
        ),
        source="definition",
        checked=True,
        needs=("open ground",),
    ),
    Effect(
        name="outlet_level_error",
        stage="boundary",
        title="The water at the outlet stands higher than reported",
        equation="z_out -> z_out + d",
        act=outlet_level,
        amplitude=Amplitude("rise", "m", "true level less the one reported", 0.05, -0.3, 0.3, of="depth"),
        source="definition",
        checked=True,
        each="experiment",
    ),
)
