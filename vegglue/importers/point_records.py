"""Records of a probe that stood at one point, of any instrument: which samples count, and their mean as a row."""

from pathlib import Path

import numpy as np

from vegglue.arrays import Array, Mask
from vegglue.errors import InputError, shown_path
from vegglue.importers.file_words import FileWords
from vegglue.importers.measured_rows import MeasuredRows

LEAST_CORRELATION = 70.0  # %, Nortek's advice for means and turbulence
SPIKE = 6.0  # robust standard deviations beyond which a sample is a spike; of normal noise one in 5e8 is
# Standard deviation of normal noise over its median absolute deviation, 1 / Phi^-1(3/4) [-].
OF_THE_MEDIAN = 1.4826
# Least median deviation [m/s]: a record that is rounded may have none, and all else would be a spike.
LEAST_DEVIATION = 1e-4


def refuse_nowhere(path: Path, words: FileWords) -> None:
    """Errors: InputError where the site file does not say where a probe stood."""
    if words.position is None:
        raise InputError(
            f"{shown_path(path)}: expected where the probe stood, `position: [x, y, z]`, which no record says; add "
            "it to this file in `files`."
        )


def record_mean(
    path: Path, words: FileWords, name: str, velocity: Array, correlation: Array, rate: float
) -> MeasuredRows:
    """The mean of a record at its `position`, its standard deviation and its length.

    velocity: x, y, z (n, 3) [m/s]; correlation: of the beams (n, beams) [%]; rate: [1/s]. Samples of low correlation
    and spikes are left out, and counted. Errors: InputError where none is left.
    """
    u, v, w = velocity.T
    trusted = trusted_samples(velocity, correlation)
    if not trusted.any():
        raise InputError(f"{shown_path(path)}: no sample has a correlation of {LEAST_CORRELATION:g} %; leave it out.")
    x, y, z = (np.array([one]) for one in words.position or ())
    numbers = {
        "x": x,
        "y": y,
        "z": z,
        **{axis: part[trusted].mean(keepdims=True) for axis, part in zip("uvw", (u, v, w), strict=True)},
    }
    numbers["u_std"] = u[trusted].std(ddof=1, keepdims=True)
    numbers["duration_s"] = np.array([trusted.sum() / rate])
    said = f"{name}, {len(velocity):,} samples at {rate:g} Hz, {len(velocity) - int(trusted.sum()):,} left out"
    device = name.partition(",")[0]
    return MeasuredRows(numbers, {"device": [device]}, {"u": "velocity x", "v": "velocity y", "w": "velocity z"},
                 dict.fromkeys("uvw", "m/s"), (said,), of_probe=True)  # fmt: skip


def trusted_samples(velocity: Array, correlation: Array) -> Mask:
    """Samples of sound correlation in all beams, and no spike in any direction (n,).

    velocity: x, y, z (n, 3) [m/s]; correlation: of the beams (n, beams) [%].
    """
    sound = correlation.min(axis=1) >= LEAST_CORRELATION
    return np.logical_and.reduce([sound, *(_no_spike(part) for part in velocity.T)])


def _no_spike(velocity: Array) -> Mask:
    """Samples within SPIKE robust standard deviations, 1.4826 MAD."""
    off = np.abs(velocity - np.median(velocity))
    return np.asarray(off <= SPIKE * OF_THE_MEDIAN * max(float(np.median(off)), LEAST_DEVIATION))
