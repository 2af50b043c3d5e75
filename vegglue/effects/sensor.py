"""Effects on instruments: what they show, (station, m) [m/s, m or m3/s], where the flow is something else.

Parameters are (m,); unit and meaning of each stand in EFFECTS, with the source of the formula.
"""

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.definition import Amplitude, Effect
from vegglue.effects.physical_constants import GRAVITY, KARMAN
from vegglue.effects.surroundings import Reading


def probe_gain(reading: Reading, gain: Array) -> dict[str, Array]:
    """u -> u (1 + b), u what a probe measures: along x, across, or speed."""
    return {"value": reading.value * (1.0 + gain * reading.velocity)}


def zero_offset(reading: Reading, offset: Array) -> dict[str, Array]:
    """u -> u + c, u what a probe measures [m/s]."""
    return {"value": reading.value + offset * reading.velocity}


def station_shift(reading: Reading, shift: Array) -> dict[str, Array]:
    """u -> u + d du/dy, u what a probe measures [m/s]: to first order, what stands d further towards larger y."""
    return {"value": reading.value + shift * reading.component_y * reading.velocity}


def partial_depth(reading: Reading, excess: Array) -> dict[str, Array]:
    """u -> u (1 + a (k h)^(1/2) / kappa) outside plants.

    Under a log law a = -b ln b / (1 - b) when the lowest share b of the depth is left out (0.16 for 0.05), and
    a = ln(1 - t) when the highest share t is (-0.16 for 0.15).
    """
    open_water = reading.velocity * (1.0 - reading.canopy_share)
    shear = np.sqrt(np.maximum(reading.rate, 0.0) * reading.depth) / KARMAN
    return {"value": reading.value + excess * shear * reading.component * open_water}


def among_plants(reading: Reading, gain: Array) -> dict[str, Array]:
    """u -> u (1 + a min(h_d / h, 1)) where plants stand."""
    return {"value": reading.value * (1.0 + gain * reading.canopy_share * reading.velocity)}


def gauge_datum(reading: Reading, shift: Array) -> dict[str, Array]:
    """z_s -> z_s + d, z_s the level that a gauge shows [m]."""
    return {"value": reading.value + shift * reading.level}


def gauge_head(reading: Reading, share: Array) -> dict[str, Array]:
    """z_s -> z_s + a u^2 / (2 g), z_s the level that a gauge shows [m]."""
    return {"value": reading.value + share * reading.u**2 / (2.0 * GRAVITY) * reading.level}


RELATIVE = Amplitude("gain", "-", "relative error b of the probes", 0.05, -0.5, 0.5)
EFFECTS = (
    Effect(
        name="probe_gain",
        stage="sensor",
        title="Velocity probes read too high or too low",
        equation="u -> u (1 + b)",
        act=probe_gain,
        amplitude=RELATIVE,
        source="definition",
        checked=True,
        each="section",
    ),
    Effect(
        name="device_gain",
        stage="sensor",
        title="One velocity probe reads too high or too low",
        equation="u -> u (1 + b) for one device",
        act=probe_gain,
        amplitude=RELATIVE,
        source="definition",
        checked=True,
        each="device",
    ),
    Effect(
        name="zero_offset",
        stage="sensor",
        title="Velocity probes do not read zero in still water",
        equation="u -> u + c",
        act=zero_offset,
        amplitude=Amplitude("offset", "m/s", "what the probes read in still water", 0.02, -0.4, 0.4, of="speed"),
        source="definition",
        checked=True,
        each="device",
    ),
    Effect(
        name="station_shift",
        stage="sensor",
        title="Probes stood beside their reported positions",
        equation="u -> u + d du/dy, d towards larger y",
        act=station_shift,
        amplitude=Amplitude("shift", "m", "true less reported place", 0.1, -0.5, 0.5, of="depth"),
        source="definition",
        checked=True,
        each="section",
        mirrored=False,
    ),
    Effect(
        name="partial_depth",
        stage="sensor",
        title="Probes sampled only part of the depth",
        equation="u -> u (1 + a (k h)^(1/2)/kappa) outside plants; a = -b ln b/(1 - b) without the lowest share b",
        act=partial_depth,
        amplitude=Amplitude(
            "excess", "-", "mean of the part sampled less that of the depth, in u*/kappa", 0.2, -1.5, 1.5
        ),
        source="definition, from the log law",
        checked=True,
        needs=("few heights",),
    ),
    Effect(
        name="among_plants",
        stage="sensor",
        title="Probes among plants do not measure the mean between stems",
        equation="u -> u (1 + a min(h_d/h, 1)) where plants stand",
        act=among_plants,
        amplitude=Amplitude("gain", "-", "relative error a of a probe deep in the plants", 0.2, -0.9, 2.0),
        source="definition",
        checked=True,
        needs=("plants",),
    ),
    Effect(
        name="gauge_datum",
        stage="sensor",
        title="Gauges have another datum than the bed",
        equation="z_s -> z_s + d",
        act=gauge_datum,
        amplitude=Amplitude("shift", "m", "how much too high the gauges read", 0.02, -0.5, 0.5, of="depth"),
        source="definition",
        checked=True,
        needs=("gauges",),
    ),
    Effect(
        name="gauge_head",
        stage="sensor",
        title="Gauges respond to the velocity head, not only to the level",
        equation="z_s -> z_s + a u^2/(2 g)",
        act=gauge_head,
        amplitude=Amplitude("share", "-", "share a of the velocity head that they show", 0.5, -1.0, 1.0),
        source="definition, from Bernoulli's equation",
        checked=True,
        needs=("gauges",),
    ),
)
