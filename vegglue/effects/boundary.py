"""Effects on what enters and leaves: discharge Q, its spread q over an inflow, the outlet level, water along the reach.

Shapes and units as in BoundaryValues. Parameters are (m,); unit and meaning of each stand in EFFECTS.
"""

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.definition import Amplitude, Effect, Shape
from vegglue.effects.surroundings import BoundaryValues


def discharge_error(boundary: BoundaryValues, relative_error: Array) -> dict[str, Array]:
    """Q -> Q (1 + e)."""
    return {"discharge": boundary.discharge * (1.0 + relative_error)}


def inflow_skew(boundary: BoundaryValues, skew: Array) -> dict[str, Array]:
    """q -> q (1 + a s), s = -1 .. 1 across each inflow."""
    return {"spread": boundary.spread * (1.0 + skew * boundary.position)}


def inflow_core(boundary: BoundaryValues, excess: Array) -> dict[str, Array]:
    """q -> q (1 + a (1 - 3 s^2) / 2), s = -1 .. 1 across each inflow."""
    return {"spread": boundary.spread * (1.0 + excess * (1.0 - 3.0 * boundary.position**2) / 2.0)}


def inflow_peak(boundary: BoundaryValues, excess: Array, middle: Array, width: Array) -> dict[str, Array]:
    """q -> q (1 + a exp(-((s - c) / w)^2)), s = -1 .. 1 across each inflow."""
    return {"spread": boundary.spread * (1.0 + excess * np.exp(-(((boundary.position - middle) / width) ** 2)))}


# Modes of the distribution over an inflow. Chosen: four tell a side, the middle and both sides, and a jet.
MODES = 4


def inflow_distribution(
    boundary: BoundaryValues, excess: Array, mode: Array, first_other: Array, second_other: Array, third_other: Array
) -> dict[str, Array]:
    """q -> q exp(sum_k a_k cos(k pi (1 + s)/2) / k), k = 1 .. 4, s = -1 .. 1 across each inflow."""
    others, log, mode = (first_other, second_other, third_other), np.zeros((1, 1, 1)), np.rint(mode)
    for k in range(1, MODES + 1):
        of_others = np.where(mode > k, others[min(k, MODES - 1) - 1], others[max(k - 2, 0)])
        size = np.where(mode == k, excess, of_others)
        log = log + size * np.cos(0.5 * np.pi * k * (1.0 + boundary.position)) / k
    return {"spread": boundary.spread * np.exp(log)}


def lateral_inflow(boundary: BoundaryValues, share: Array) -> dict[str, Array]:
    """q_lateral -> q_lateral + r Q, Q the sum of all inflows [m3/s]."""
    return {"lateral": boundary.lateral + share * boundary.discharge.sum(axis=0)}


def outlet_level(boundary: BoundaryValues, rise: Array) -> dict[str, Array]:
    """z_out -> z_out + d."""
    return {"level": boundary.level + rise}


# Standard deviation of each a_k [-]: then q / q_0 has (1/2 sum_k 1/k^2)^(1/2) OF_INFLOW = 0.32 = (beta - 1)^(1/2), that
# of velocities over a section of natural streams, beta = 1.10 (Chow 1959, table 2-1; not checked against it).
OF_INFLOW = 0.38

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
        amplitude=Amplitude(
            "skew",
            "-",
            "relative excess a at the end of the inflow",
            0.4,
            -0.9,
            0.9,
            basis="r.m.s. of (beta - 1)^(1/2) = 0.22, beta = 1.05 of regular channels, Chow (1959), table 2-1",
        ),
        source="definition",
        checked=True,
        tags=("inflow",),
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
        tags=("inflow",),
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
        tags=("inflow",),
        mirrored=False,
    ),
    Effect(
        name="inflow_distribution",
        stage="boundary",
        title="The inflow is not distributed by conveyance: it is not developed",
        equation="q -> q exp(sum_k a_k cos(k pi (1 + s)/2)/k), k = 1 .. 4, s from -1 to 1 across the inflow",
        act=inflow_distribution,
        amplitude=Amplitude(
            "excess",
            "-",
            "a_k of the mode k",
            OF_INFLOW,
            -3.0,
            3.0,
            basis="r.m.s. of all of (beta - 1)^(1/2) = 0.32, beta = 1.10 of natural streams, Chow (1959), table 2-1",
        ),
        shapes=(
            Shape("mode", "-", "that k", 1.0, 1.0, 4.0, (1.0, 2.0, 3.0, 4.0)),
            *(
                Shape(f"{name}_other", "-", f"a_k of the {name} of the other modes", 0.0, -3.0, 3.0, sd=OF_INFLOW)
                for name in ("first", "second", "third")
            ),
        ),
        source="definition",
        checked=True,
        tags=("inflow",),
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
