"""Effects between the flow and the number in the file."""

from vegglue.effect import Amplitude, Array, Effect, Reading


def probe_gain(reading: Reading, gain: Array) -> dict[str, Array]:
    """u -> u (1 + b)."""
    return {"value": reading.value * (1.0 + gain * reading.velocity)}


def gauge_datum(reading: Reading, shift: Array) -> dict[str, Array]:
    """z_s -> z_s + d."""
    return {"value": reading.value + shift * (1.0 - reading.velocity)}


EFFECTS = (
    Effect(
        name="probe_gain",
        stage="sensor",
        title="Velocity probes read too high or too low",
        equation="u -> u (1 + b)",
        act=probe_gain,
        amplitude=Amplitude("gain", "-", "relative error b of the probes", 0.05, -0.5, 0.5),
        source="definition",
        checked=True,
        each="section",
    ),
    Effect(
        name="gauge_datum",
        stage="sensor",
        title="Gauges stand on another datum than the bed",
        equation="z_s -> z_s + d",
        act=gauge_datum,
        amplitude=Amplitude("shift", "m", "how much too high the gauges read", 0.02, -0.5, 0.5),
        source="definition",
        checked=True,
    ),
)
