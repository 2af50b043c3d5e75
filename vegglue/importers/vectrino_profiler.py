"""Profiles of Nortek's Vectrino Profiler (Vectrino II), as its program MIDAS saves them to MATLAB.

Format, as published scripts read it: structures Data (Profiles_Range of the cells from the central transducer [m];
Profiles_VelX, VelY, VelZ1 [m/s] or VelBeam1 to VelBeam4, and Profiles_CorBeam1 to CorBeam4 [%], samples by cells;
BottomCheck_BottomDistance [m], 0 for none) and Config (sampleRate [1/s], coordSystem,
ProbeCalibration_calibrationMatrix).
"""

from pathlib import Path
from typing import Any

import numpy as np

from vegglue.arrays import Array, Mask
from vegglue.errors import InputError, shown_path
from vegglue.importers.file_words import FileWords
from vegglue.importers.matlab_loading import numbers_of_variable, reading_structures
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.point_records import LEAST_CORRELATION, refuse_nowhere, trusted_samples

PROFILER_VARIABLES = ("Data", "Config")  # the variables by which such a file is known
BEAMS = 2  # `coordSystem` of velocities along the beams; 1 for x, y and z
SOUND_SHARE = 0.5  # of the samples of a cell: a mean of fewer is one of those that happen to be strong


def rows_of_profiler(path: Path, parts: dict[str, Any], words: FileWords) -> MeasuredRows:
    """One row for each cell, so far below the `position` of the probe, which looks down; none at the bed and below.

    Errors: InputError naming the file.
    """
    refuse_nowhere(path, words)
    data, config = (parts[name] for name in PROFILER_VARIABLES)
    with reading_structures(path, "the structures of a Vectrino Profiler", "export it anew from MIDAS"):
        away, rate = numbers_of_variable(data.Profiles_Range).ravel(), float(config.sampleRate)
        velocity = _velocity(data, config)
        correlation = np.stack([_samples(data, f"CorBeam{beam}") for beam in range(1, 5)], axis=2)
        trusted = _trusted(velocity, correlation) & _above_the_bed(data, away)
    kept = np.flatnonzero(trusted.mean(axis=0) >= SOUND_SHARE)
    if not kept.size:
        raise InputError(
            f"{shown_path(path)}: no cell has a correlation of {LEAST_CORRELATION:g} % in half of its samples; leave "
            "it out."
        )
    said = f"Vectrino Profiler, {len(velocity):,} samples at {rate:g} Hz, {kept.size} of {away.size} cells"
    return _means(words, away[kept], velocity[:, kept], trusted[:, kept], rate, said)


def _means(words: FileWords, away: Array, velocity: Array, trusted: Mask, rate: float, said: str) -> MeasuredRows:
    x, y, z = np.asarray(words.position).tolist()
    samples = np.where(trusted[..., None], velocity, np.nan)
    mean = np.nanmean(samples, axis=0)
    numbers = {"x": np.full(away.size, x), "y": np.full(away.size, y), "z": z - away}
    numbers |= {axis: mean[:, number] for number, axis in enumerate("uvw")}
    numbers |= {"u_std": np.nanstd(samples[..., 0], axis=0, ddof=1), "duration_s": trusted.sum(axis=0) / rate}
    columns = {axis: f"Profiles_Vel{name}" for axis, name in zip("uvw", ("X", "Y", "Z1"), strict=True)}
    device = {"device": ["Vectrino Profiler"] * away.size}
    return MeasuredRows(numbers, device, columns, dict.fromkeys("uvw", "m/s"), (said,), of_probe=True)


def _velocity(data: Any, config: Any) -> Array:
    """x, y and z (samples, cells, 3) [m/s]; of beams T b, with the matrix T of each cell."""
    if int(config.coordSystem) != BEAMS:
        return np.stack([_samples(data, f"Vel{axis}") for axis in ("X", "Y", "Z1")], axis=2)
    beams = np.stack([_samples(data, f"VelBeam{beam}") for beam in range(1, 5)], axis=2)
    turn = numbers_of_variable(config.ProbeCalibration_calibrationMatrix).reshape(-1, 4, 4)
    return np.asarray(np.einsum("cij,ncj->nci", turn[: beams.shape[1]], beams)[..., :3])


def _trusted(velocity: Array, correlation: Array) -> Mask:
    """Samples that count (samples, cells); none of those that are no numbers, as whoever cleaned a file marks them."""
    known: Mask = np.asarray(np.isfinite(velocity).all(axis=2))
    trusted: Mask = np.zeros_like(known)
    for cell in np.flatnonzero(known.any(axis=0)):
        here = known[:, cell]
        trusted[here, cell] = trusted_samples(velocity[here, cell], correlation[here, cell])
    return trusted


def _above_the_bed(data: Any, away: Array) -> Mask:
    """Cells that end before the bed, where the probe saw it: at its median distance."""
    seen = numbers_of_variable(getattr(data, "BottomCheck_BottomDistance", 0.0)).ravel()
    seen = seen[seen > 0.0]
    half = 0.5 * float(np.abs(np.diff(away)).min()) if away.size > 1 else 0.0
    return np.asarray(away + half <= (np.median(seen) if seen.size else np.inf))


def _samples(data: Any, name: str) -> Array:
    """A variable (samples, cells)."""
    values = numbers_of_variable(getattr(data, f"Profiles_{name}"))
    return values if values.ndim == 2 else values.reshape(-1, numbers_of_variable(data.Profiles_Range).size)
