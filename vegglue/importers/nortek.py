"""Records of a Nortek probe: Vectrino and Vector as ASCII (.dat), the Vector as it wrote it, and the Vectrino Profiler.

Formats: Nortek's conversion to ASCII: no heading, one line a sample; Vectrino: time, counter, status, velocities x, y,
z1, z2 [m/s], then amplitudes, ratios and correlations of four beams; Vector: burst, counter, velocities x, y, z [m/s],
then amplitudes, ratios and correlations of three beams, pressure and two inputs. The .hdr beside it has the rate.
Vectrino Profiler (Vectrino II), as MIDAS saves it to MATLAB and published scripts read it: structures Data
(Profiles_Range of the cells from the central transducer [m]; Profiles_VelX, VelY, VelZ1 [m/s] or VelBeam1 to VelBeam4,
and Profiles_CorBeam1 to CorBeam4 [%], samples by cells; BottomCheck_BottomDistance [m], 0 for none) and Config
(sampleRate [1/s], coordSystem, ProbeCalibration_calibrationMatrix).
"""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from vegglue.arrays import Array, Mask
from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import words_of
from vegglue.importers.file_options import FileOptions
from vegglue.importers.import_notes import ImportNote, Noted
from vegglue.importers.library_files import numbers_of_variable, open_raw, readable_text, reading_structures
from vegglue.importers.measured_rows import MeasuredRows, read_placed_rows
from vegglue.importers.table_parser import numbers_of

# How a binary record of a Vector begins: its hardware configuration, with its serial number.
VECTOR_BEGINS = b"\xa5\x05\x18\x00VEC"
BYTES_OF_A_SAMPLE = 24  # of the record of velocities in a .vec
LEAST_CORRELATION = 70.0  # %, Nortek's advice for means and turbulence
SPIKE = 6.0  # robust standard deviations beyond which a sample is a spike; of normal noise one in 5e8 is
# Standard deviation of normal noise over its median absolute deviation, 1 / Phi^-1(3/4) [-].
OF_THE_MEDIAN = 1.4826
# Least median deviation [m/s]: a record that is rounded may have none, and all else would be a spike.
LEAST_DEVIATION = 1e-4
OF_CORRELATION = re.compile(r"cor(r|relation)?( ?\d| beam| |$)")  # headings of samples, as words
PROFILER_VARIABLES = ("Data", "Config")  # of a file of a Vectrino Profiler
BEAMS = 2  # `coordSystem` of velocities along the beams; 1 for x, y and z
SOUND_SHARE = 0.5  # of the samples of a cell: a mean of fewer is one of those that happen to be strong


@dataclass(frozen=True)
class _Layout:
    """Columns of a line: the first velocity, the correlations, and how many there are at least."""

    name: str
    velocity: int
    correlation: slice
    columns: int


_LAYOUTS = (_Layout("Vectrino", 3, slice(15, 19), 19), _Layout("Vector", 2, slice(11, 14), 17))


def is_nortek(path: Path, text: str) -> bool:
    """Whether it is a .dat with its .hdr beside it, and as wide a first line as the exports have."""
    line = next(iter(text.splitlines()), "")
    wide = len(line.split()) >= min(layout.columns for layout in _LAYOUTS)
    return wide and path.suffix.lower() == ".dat" and _header(path) is not None


def _header(path: Path) -> Path | None:
    """The .hdr beside a record; None without."""
    return next((there for end in (".hdr", ".HDR") if (there := path.with_suffix(end)).is_file()), None)


def read_nortek(path: Path, options: FileOptions) -> MeasuredRows:
    """One row: the mean of an ASCII record of a Vectrino or a Vector.

    Parameters
    ----------
    path
        The .dat, with its .hdr beside it.
    options
        `position` of the probe [m].

    Returns
    -------
    MeasuredRows
        Mean velocities and the standard deviation of the first [m/s], and the length of the sound samples [s].

    Raises
    ------
    InputError
        For other axes than XYZ or ENU, a record without its rate, and one without a sound sample.
    """
    _refuse_without_position(path, options)
    lines = [line.split() for line in readable_text(path).splitlines() if line.strip()]
    layout = next((one for one in _LAYOUTS if lines and len(lines[0]) >= one.columns), None)
    for row, line in enumerate(lines, 1):
        if len(line) != len(lines[0]):
            raise InputError("ragged_record", file=path, row=row, fields=len(lines[0]), got=len(line))
        for column, word in enumerate(line, 1):
            try:
                float(word)
            except ValueError:
                raise InputError("no_number", file=path, row=row, column=column, got=word, why="no number") from None
    rows = np.array(lines, dtype=np.float64)
    if layout is None or rows.ndim != 2:
        raise InputError(
            f"{shown_path(path)}: expected the columns of a Vectrino or Vector, got others; export it anew."
        )
    header = _header(path)
    settings = readable_text(header) if header else ""
    axes = found[1] if (found := re.search(r"^Coordinate system\s+(\w+)", settings, re.MULTILINE)) else "XYZ"
    if axes not in ("XYZ", "ENU"):
        raise InputError(f"{shown_path(path)}: expected velocities in XYZ or ENU, got {axes}; export them anew.")
    rate = re.search(r"^Sampling rate\s+([\d.]+)\s*Hz", settings, re.MULTILINE)
    if rate is None:
        raise InputError(
            f"{shown_path(path)}: expected `Sampling rate` in the .hdr beside it, got none; export it too."
        )
    velocity, correlation = rows[:, layout.velocity : layout.velocity + 3], rows[:, layout.correlation]
    mean = _record_mean(path, options, layout.name, velocity, correlation, float(rate[1]))
    return replace(mean, of_probe=axes == "XYZ")


def read_vector(path: Path, options: FileOptions) -> MeasuredRows:
    """One row: the mean of a binary record of a Vector (.vec), along the axes x, y and z of the probe.

    Parameters
    ----------
    path
        The record.
    options
        `position` of the probe [m].

    Returns
    -------
    MeasuredRows
        As `read_nortek`.

    Raises
    ------
    InputError
        Also for other axes, and without mhkit.
    """
    _refuse_without_position(path, options)
    most = path.stat().st_size // BYTES_OF_A_SAMPLE
    data = open_raw(path, "Nortek", most)
    axes = str(data.attrs.get("coord_sys"))
    if axes != "inst" or not {"vel", "corr"} <= set(data):
        raise InputError(
            f"{shown_path(path)}: expected a record in XYZ coordinates, got one in {axes}; convert it in Nortek's "
            "program, and export ASCII data."
        )
    velocity, correlation = (np.asarray(data[name].values, dtype=np.float64).T for name in ("vel", "corr"))
    there = np.isfinite(velocity).all(axis=1)  # the reader fills up what the file does not hold
    rate = float(data.attrs["fs"])
    return _record_mean(path, options, "Vector, binary", velocity[there], correlation[there], rate)


def _refuse_without_position(path: Path, options: FileOptions) -> None:
    if options.position is None:
        raise InputError(
            f"{shown_path(path)}: expected where the probe stood, `position: [x, y, z]`, which no record holds; add it "
            "to this file in `files`."
        )


def _record_mean(
    path: Path, options: FileOptions, name: str, velocity: Array, correlation: Array, rate: float
) -> MeasuredRows:
    """The mean of a record at its `position`, its standard deviation and its length.

    velocity: x, y, z (n, 3) [m/s]; correlation: of the beams (n, beams) [%]; rate: [1/s]. Samples of low correlation
    and spikes are left out, and counted. InputError if none is left.
    """
    trusted = _trusted_samples(velocity, correlation)
    if not trusted.any():
        raise InputError(
            f"{shown_path(path)}: expected samples with a correlation of {LEAST_CORRELATION:g} % or more, got none; "
            "leave the file out."
        )
    numbers = {axis: np.array([one]) for axis, one in zip("xyz", options.position or (), strict=True)}
    numbers |= {axis: part[trusted].mean(keepdims=True) for axis, part in zip("uvw", velocity.T, strict=True)}
    numbers["u_std"] = velocity[trusted, 0].std(ddof=1, keepdims=True)
    numbers["duration_s"] = np.array([trusted.sum() / rate])
    notes = (
        ImportNote(Noted.SAMPLES, len(velocity), (name, f"{rate:g}")),
        ImportNote(Noted.SAMPLES_LOST, len(velocity) - int(trusted.sum())),
    )
    texts = {"device": [name.partition(",")[0]]}
    columns = {axis: f"velocity {place}" for axis, place in zip("uvw", "xyz", strict=True)}
    return MeasuredRows(numbers, texts, columns, dict.fromkeys("uvw", "m/s"), notes, of_probe=True)


def read_samples(path: Path, options: FileOptions) -> MeasuredRows:
    """What a table of measurements holds; with a `position`, samples of a probe there without spikes and those of low
    correlation.

    Raises
    ------
    InputError
        If it is no such table; also for a `position` of a table that has places of its own, or no velocities.
    """
    taken = read_placed_rows(path, replace(options, position=None))
    if options.position is None:
        return taken
    places = [taken.columns[role] for role in ("x", "y", "z", "tape", "height", "below") if role in taken.columns]
    moving = [role for role in ("u", "v", "w", "east_velocity", "north_velocity") if role in taken.numbers]
    if places or not moving:
        got = f"places in {' and '.join(places)}" if places else "no velocity"
        raise InputError(
            f"{shown_path(path)}: expected samples of one point for `position` in its entry of `files`, got a table "
            f"with {got}; take `position` out."
        )
    velocity = np.column_stack([taken.numbers[role] for role in moving])
    beams = [numbers_of(texts) for name, texts in taken.others.items() if OF_CORRELATION.match(words_of(name))]
    correlation = np.array([one for one in beams if one is not None]).reshape(-1, taken.size).T
    trusted = _trusted_samples(velocity, correlation)
    if not trusted.any():
        raise InputError(
            f"{shown_path(path)}: expected samples with a correlation of {LEAST_CORRELATION:g} % or more, got none; "
            "leave the file out."
        )
    kept = replace(taken.only(trusted), of_probe="u" in moving)
    at = {axis: np.full(kept.size, one) for axis, one in zip("xyz", options.position, strict=True)}
    lost = taken.size - kept.size
    return kept.having(at, *([ImportNote(Noted.SAMPLES_LOST, lost)] if lost else []))


def _trusted_samples(velocity: Array, correlation: Array) -> Mask:
    """Samples of sound correlation in all beams, and within SPIKE robust standard deviations in any direction (n,).

    velocity: components (n, 1 to 3) [m/s]; correlation: of the beams, if known (n, beams) [%].
    """
    known = np.asarray(np.isfinite(velocity).all(axis=1))
    sound = (correlation >= LEAST_CORRELATION) & (correlation <= 100.0)
    trusted: Mask = known & np.asarray(sound.all(axis=1))
    for part in velocity.T if known.any() else ():
        off = np.abs(part - np.median(part[known]))
        trusted = trusted & np.asarray(
            off <= SPIKE * OF_THE_MEDIAN * max(float(np.median(off[known])), LEAST_DEVIATION)
        )
    return trusted


def rows_of_profiler(path: Path, parts: dict[str, Any], options: FileOptions) -> MeasuredRows:
    """One row for each cell, so far below the `position` of the probe, which looks down; none at the bed and below.

    Velocities of beams b are turned by T b, with the matrix T of each cell. Samples without a number, as in a cleaned
    file, do not count, nor do cells at or below the bed that the probe found, at its median distance.

    Raises
    ------
    InputError
        If the file lacks what this needs, or `position` is not given.
    """
    _refuse_without_position(path, options)
    data, config = (parts[name] for name in PROFILER_VARIABLES)

    def samples(*names: str) -> Array:
        """Variables as (samples, cells, names)."""
        cells = numbers_of_variable(data.Profiles_Range).size
        values = [numbers_of_variable(getattr(data, f"Profiles_{name}")) for name in names]
        return np.stack([one if one.ndim == 2 else one.reshape(-1, cells) for one in values], axis=2)

    with reading_structures(path, "Vectrino Profiler"):
        away, rate = numbers_of_variable(data.Profiles_Range).ravel(), float(config.sampleRate)
        if int(config.coordSystem) != BEAMS:
            velocity = samples("VelX", "VelY", "VelZ1")
        else:
            beams = samples(*(f"VelBeam{beam}" for beam in range(1, 5)))
            turn = numbers_of_variable(config.ProbeCalibration_calibrationMatrix).reshape(-1, 4, 4)
            velocity = np.einsum("cij,ncj->nci", turn[: beams.shape[1]], beams)[..., :3]
        correlation = samples(*(f"CorBeam{beam}" for beam in range(1, 5)))
        cells = range(away.size)
        trusted = np.stack([_trusted_samples(velocity[:, cell], correlation[:, cell]) for cell in cells], axis=1)
        seen = numbers_of_variable(getattr(data, "BottomCheck_BottomDistance", 0.0)).ravel()
        seen = seen[seen > 0.0]
        half = 0.5 * float(np.abs(np.diff(away)).min()) if away.size > 1 else 0.0
        trusted &= away + half <= (np.median(seen) if seen.size else np.inf)
    kept = np.flatnonzero(trusted.mean(axis=0) >= SOUND_SHARE)
    if not kept.size:
        raise InputError(
            f"{shown_path(path)}: no cell has a correlation of {LEAST_CORRELATION:g} % in half of its samples; leave "
            "it out."
        )
    notes = (
        ImportNote(Noted.SAMPLES, len(velocity), ("Vectrino Profiler", f"{rate:g}")),
        ImportNote(Noted.CELLS_SOUND, kept.size, (str(away.size),)),
    )
    away, trusted = away[kept], trusted[:, kept]
    good = np.where(trusted[..., None], velocity[:, kept], np.nan)
    mean = np.nanmean(good, axis=0)
    x, y, z = np.asarray(options.position).tolist()
    numbers = {"x": np.full(away.size, x), "y": np.full(away.size, y), "z": z - away}
    numbers |= {axis: mean[:, number] for number, axis in enumerate("uvw")}
    numbers |= {"u_std": np.nanstd(good[..., 0], axis=0, ddof=1), "duration_s": trusted.sum(axis=0) / rate}
    columns = {axis: f"Profiles_Vel{name}" for axis, name in zip("uvw", ("X", "Y", "Z1"), strict=True)}
    device = {"device": ["Vectrino Profiler"] * away.size}
    return MeasuredRows(numbers, device, columns, dict.fromkeys("uvw", "m/s"), notes, of_probe=True)
