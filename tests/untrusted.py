"""Readers of files that may come from anybody: for each a valid file, and what reads it to the end."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from field_folders import SITE
from reach import COARSE, block, write_reach
from untrusted_imports import IMPORTS

from vegglue.case.bed import read_raster, survey_levels
from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.errors import InputError, StorageError
from vegglue.importers.site_file import read_site
from vegglue.measurements.observations import read_observations
from vegglue.measurements.plant_survey import read_survey

ROOT = Path(__file__).parents[1]
# Parts of files that readers stumble over.
SNIPPETS = (
    b"", b"\x00", b"\xff", b"\xed\xa0\x80", "\u202e".encode(), b"\n", b",", b",,", b'"', b"'", b": ", b"&a ",
    b"*a", b"!!set", b"<<: ", b"[", b"]", b"{", b"}", b"- ", b"\t", b"#", b"%", b"|", b">", b"1e999", b"-1e999",
    b"nan", b"-inf", b"1e-320", b"0", b"-1", b"010", b"1:30", b"1_0", b"0.5", b"true", b"null", b"9" * 40,
    b"1e300", b"x" * 300, b"../../x", b"\\u0000", b"\\ud800", b"__class__", b"{}", b"[]", b"[1, 2]", b"ncols",
    b"1,5",
)  # fmt: skip
Edit = tuple[int, int, bytes]  # where, how many bytes go, what comes


@dataclass(frozen=True)
class Reader:
    """name: of the file it reads; valid: bytes that it takes; read: all that a command would do with the file."""

    name: str
    valid: bytes
    read: Callable[[Path], object]


def _observed(path: Path) -> object:
    content, config = path.read_bytes(), write_reach(path.parent, COARSE)
    path.write_bytes(content)
    return read_observations(load_case(config))


def _case(path: Path) -> object:
    path.with_name("velocities.csv").write_text(block("csv"), encoding="utf-8")
    case = load_case(path)
    (low, high), (south, north), (dx, dy) = case.grid.x, case.grid.y, case.grid.cell
    return build_site(case) if (high - low) / dx * (north - south) / dy < 10_000 else case


def _levels(path: Path) -> object:
    import numpy as np

    return survey_levels(path, np.linspace(0.0, 3.0, 4), np.linspace(0.0, 3.0, 4))


RASTER = b"ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 2\nNODATA_value -9999\n1 2 3\n4 5.5 -9999\n"
READERS = (
    Reader("case.yaml", block("yaml").encode(), _case),
    Reader("velocities.csv", block("csv").encode(), _observed),
    Reader("site.json", json.dumps(SITE).encode(), read_site),
    Reader("bed.asc", RASTER, read_raster),
    Reader("points.csv", b"x,y,z\n0,0,1\n3,0,1\n0,3,1.5\n3,3,1.2\n", _levels),
    Reader("survey.csv", (ROOT / "data" / "kict" / "plant_survey.csv").read_bytes(), read_survey),
    *(Reader(*one) for one in IMPORTS),
)


def edited(valid: bytes, edits: list[Edit]) -> bytes:
    """The bytes with some of them replaced."""
    for where, gone, come in edits:
        at = where % (len(valid) + 1)
        valid = valid[:at] + come + valid[at + gone :]
    return valid


def outcome(reader: Reader, folder: Path, content: bytes) -> str:
    """What became of a file: nothing if it was read, else the one sentence. Anything but the two errors is raised."""
    path = folder / reader.name
    path.write_bytes(content)
    try:
        reader.read(path)
    except (InputError, StorageError) as error:
        return str(error)
    return ""
