"""Results of TELEMAC in SELAFIN (.slf), an unformatted Fortran file.

Format (TELEMAC user manual, appendix on the Serafin format): records between two equal lengths of 4 bytes, the highest
byte first as a rule: a title of 80 letters; numbers of variables; names of 16 letters with 16 of unit; ten parameters,
of which the third and fourth are offsets of all places, the seventh the number of planes and the tenth announces a
date; numbers of elements, points and corners; corners of elements, counted from one; boundary numbers; x; y; then of
each time one record for it and one for each variable. Reals have 4 or 8 bytes: the length of the record of x tells.
"""

import struct
from pathlib import Path
from typing import BinaryIO

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.import_notes import ImportNote, Noted
from vegglue.importers.model_result import ModelResult, bed_level_depth, lacking_fields, model_result, without_marks

# Names of variables, English and French, without their units.
SELAFIN_NAMES = {
    "bed": ("BOTTOM", "FOND"), "depth": ("WATER DEPTH", "HAUTEUR D'EAU", "HAUTEUR D EAU"),
    "level": ("FREE SURFACE", "SURFACE LIBRE"), "u": ("VELOCITY U", "VITESSE U"), "v": ("VELOCITY V", "VITESSE V"),
    "friction": ("BOTTOM FRICTION", "FROTTEMENT"),
}  # fmt: skip
TITLE = 80


def looks_like_selafin(path: Path) -> bool:
    """Whether a file begins with a title of 80 letters as a record."""
    with path.open("rb") as file:
        head = file.read(4)
        file.seek(4 + TITLE)
        tail = file.read(4)
    return head == tail and head in (struct.pack(">i", TITLE), struct.pack("<i", TITLE))


def read_selafin(path: Path) -> ModelResult:
    """The last whole frame of a two-dimensional result, at its nodes.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    ModelResult
        Its roughness has the kind "not-stated", as the file does not hold the law of friction.

    Raises
    ------
    InputError
        If the file is damaged or three-dimensional, or lacks bed, level or velocities.
    """
    with path.open("rb") as file:
        order = ">" if file.read(4) == struct.pack(">i", TITLE) else "<"
        file.seek(0)
        try:
            return _last_frame(path, file, order)
        except InputError:
            raise
        except (struct.error, ValueError, IndexError, OverflowError):
            raise InputError(f"{shown_path(path)}: expected a SELAFIN file, got a damaged one; copy it anew.") from None


def _last_frame(path: Path, file: BinaryIO, order: str) -> ModelResult:
    size = path.stat().st_size
    _record(file, order, size)
    first, second = np.frombuffer(_record(file, order, size), f"{order}i4")
    names = [_record(file, order, size)[:16].decode("latin-1").strip().upper() for _ in range(int(first + second))]
    parameters = np.frombuffer(_record(file, order, size), f"{order}i4")
    date = ""
    if parameters[9] == 1:
        year, month, day, hour, minute, second = np.frombuffer(_record(file, order, size), f"{order}i4")
        date = f"{year}-{month:02d}-{day:02d} {hour:02d}:{minute:02d}:{second:02d}"
    _, points, _, _ = np.frombuffer(_record(file, order, size), f"{order}i4")
    if parameters[6] > 1:
        raise InputError(
            f"{shown_path(path)}: expected a 2D result, got {parameters[6]} planes; give that of TELEMAC-2D."
        )
    _record(file, order, size)
    _record(file, order, size)
    raw = _record(file, order, size)
    width = len(raw) // int(points)
    if width not in (4, 8) or width * points != len(raw):
        raise ValueError("reals of another length")
    real = f"{order}f{width}"
    x = np.frombuffer(raw, real).astype(np.float64) + float(parameters[2])
    y = np.frombuffer(_record(file, order, size), real).astype(np.float64) + float(parameters[3])
    begin = file.tell()
    frame = (8 + width) + len(names) * (8 + width * int(points))
    frames = (size - begin) // frame
    if frames < 1:
        raise InputError(f"{shown_path(path)}: expected a time step of all values, got none; run the model anew.")
    file.seek(begin + (frames - 1) * frame)
    seconds = float(np.frombuffer(_record(file, order, size), real)[0])
    values = {name: np.frombuffer(_record(file, order, size), real).astype(np.float64) for name in names}
    found: dict[str, Array] = {}
    for key, known in SELAFIN_NAMES.items():
        if (name := next((name for name in names if name in known), None)) is not None:
            found[key] = without_marks(values[name])
    if missing := [SELAFIN_NAMES[key][0] for key in lacking_fields(found)]:
        raise InputError(
            f"{shown_path(path)}: expected the variables {', '.join(missing)}, got {', '.join(names) or 'none'}; add "
            "them to VARIABLES FOR GRAPHIC PRINTOUTS."
        )
    bed, level, depth = bed_level_depth(found)
    notes: list[ImportNote] = []
    if (negative := int((depth < 0.0).sum())) > 0:
        notes.append(ImportNote(Noted.BELOW_BED, negative))
    if parameters[2] or parameters[3]:
        notes.append(ImportNote(Noted.OFFSETS, names=tuple(map(str, parameters[2:4]))))
    if size - begin != frames * frame:
        notes.append(ImportNote(Noted.CUT_FRAME))
    return model_result(
        "TELEMAC", x, y, bed, level, depth, found["u"], found["v"], roughness=found.get("friction"),
        corners=np.column_stack([x, y]), time=f"{date + ' + ' if date else ''}{seconds:g} s", notes=tuple(notes),
    )  # fmt: skip


def _record(file: BinaryIO, order: str, size: int) -> bytes:
    """The content of the next record. Errors: struct.error, ValueError."""
    (length,) = struct.unpack(f"{order}i", file.read(4))
    if not 0 <= length <= size:
        raise ValueError("a record longer than the file")
    content = file.read(length)
    if file.read(4) != struct.pack(f"{order}i", length):
        raise ValueError("a record whose two lengths differ")
    return content
