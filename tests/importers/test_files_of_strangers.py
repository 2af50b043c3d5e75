"""Files that a library reads, made to fill the memory or to break it: one sentence, before room is taken."""

import struct
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pytest
from scipy.io import savemat
from untrusted_imports import IMPORTS

from vegglue.errors import InputError
from vegglue.importers import library_files
from vegglue.importers.file_options import FileOptions
from vegglue.importers.instruments import read_matlab
from vegglue.importers.library_files import load_matlab
from vegglue.importers.table_parser import parse_table
from vegglue.importers.terrain import read_geotiff
from vegglue.importers.vector_files import read_polygons

pytestmark = pytest.mark.slow

VALID = {name: content for name, content, _ in IMPORTS}
SHEET = "xl/worksheets/sheet1.xml"
MOST = 400_000_000  # bytes, a few times the largest file of data


@pytest.fixture(autouse=True)
def _in_bounded_memory() -> Iterator[None]:
    tracemalloc.start()
    yield
    assert tracemalloc.get_traced_memory()[1] < MOST
    tracemalloc.stop()


def workbook_with(path: Path, sheet: Iterator[bytes]) -> Path:
    """A workbook whose only sheet holds these bytes."""
    (path.parent / "valid.xlsx").write_bytes(VALID["table.xlsx"])
    with ZipFile(path.parent / "valid.xlsx") as valid, ZipFile(path, "w", ZIP_DEFLATED) as packed:
        for name in valid.namelist():
            if name != SHEET:
                packed.writestr(name, valid.read(name))
        with packed.open(SHEET, "w") as file:
            for part in sheet:
                file.write(part)
    return path


def test_a_workbook_that_unpacks_to_much_is_refused(tmp_path: Path) -> None:
    path = workbook_with(tmp_path / "bomb.xlsx", (b" " * 1_000_000 for _ in range(150)))
    assert path.stat().st_size < 1_000_000
    with pytest.raises(InputError, match=r"bomb\.xlsx: .* 100,000,000 bytes, got 150,"):
        parse_table(path)


def test_a_workbook_with_few_cells_far_to_the_right_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundredth of the limit, and of the memory: with all of it the library takes twenty seconds."""

    def rows() -> Iterator[bytes]:
        yield b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'
        for row in range(1, 100):
            yield b'<row r="%d"><c r="XFD%d"><v>1</v></c></row>' % (row, row)
        yield b"</sheetData></worksheet>"

    path = workbook_with(tmp_path / "wide.xlsx", rows())
    monkeypatch.setattr(library_files, "LARGEST_DATA", 1_000_000)
    tracemalloc.reset_peak()
    with pytest.raises(InputError, match=r"wide\.xlsx: .* 1,000,000 bytes, got 1,"):
        parse_table(path)
    assert tracemalloc.get_traced_memory()[1] < MOST / 50


def test_a_geotiff_that_claims_many_pixels_is_refused(tmp_path: Path) -> None:
    content, (width, height) = VALID["bed.tif"], (0x100, 0x101)
    for tag in (width, height):
        place = content.index(struct.pack("<HHI", tag, 4, 1))
        content = content[: place + 8] + struct.pack("<I", 1_000_000) + content[place + 12 :]
    (tmp_path / "bed.tif").write_bytes(content)
    with pytest.raises(InputError, match=r"bed\.tif: .* 100,000,000 bytes, got 4,000,000,000,000"):
        read_geotiff(tmp_path / "bed.tif")


def test_a_matlab_file_that_unpacks_to_much_is_refused(tmp_path: Path) -> None:
    savemat(tmp_path / "maps.mat", {"X": np.zeros((4000, 4000))}, do_compression=True)
    assert (tmp_path / "maps.mat").stat().st_size < 200_000
    with pytest.raises(InputError, match=r"maps\.mat: .* 100,000,000 bytes, got 100,"):
        load_matlab(tmp_path / "maps.mat", "a file of the set", ("X",))
    savemat(tmp_path / "boat.mat", {"Summary": {"Track": np.zeros((4000, 4000))}}, do_compression=True)
    with pytest.raises(InputError, match=r"boat\.mat: .* 100,000,000 bytes, got 100,"):
        read_matlab(tmp_path / "boat.mat", FileOptions(start=(0.0, 0.0)))


@pytest.mark.parametrize(("place", "byte"), [(320, 0x91), (241, 2)])
def test_a_matlab_file_that_crashes_its_reader_is_refused(tmp_path: Path, place: int, byte: int) -> None:
    """One byte of a structure is another: scipy reads memory that is not its own, or asks for any."""
    savemat(tmp_path / "boat.mat", {"S": {"a": np.arange(3.0), "b": 1.0}})
    content = bytearray((tmp_path / "boat.mat").read_bytes())
    content[place] = byte
    (tmp_path / "boat.mat").write_bytes(content)
    with pytest.raises(InputError, match=r"boat\.mat"):
        read_matlab(tmp_path / "boat.mat", FileOptions(start=(0.0, 0.0)))


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("a.geojson", b"[" * 100_000, "a.geojson"),
        ("a.geojson", b"[]", "a.geojson"),
        ("a.geojson", VALID["patches.geojson"].replace(b"20", b'"many"'), "'many'"),
        ("a.shp", b"", "a.shp"),
    ],
)
def test_what_is_wrong_with_polygons_is_told(tmp_path: Path, name: str, content: bytes, expected: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=expected):
        read_polygons(tmp_path / name, None)
