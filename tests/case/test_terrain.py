"""Rasters and surveyed points from anybody: read whole, or refused in one sentence."""

from pathlib import Path

import pytest

from vegglue.case import bed
from vegglue.case.bed import read_points, read_raster
from vegglue.errors import InputError

HEADER = "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 2\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "bed.asc"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (HEADER.replace("nrows 2", "nrows 0.5") + "1 2\n", "expected a whole number of cells as `nrows`, got 0.5"),
        (HEADER.replace("ncols 2", "ncols 1e300") + "1 2\n", "values after the header, got 2"),
        (HEADER.replace("ncols 2", "ncols -2"), "a `ncols` above 0"),
        (HEADER + "1 2\n3 inf\n", "line 7: expected finite numbers, got 'inf'"),
        (HEADER + "1 2\n3 1,5\n", "line 7: expected numbers, got '1,5'"),
        (HEADER + "1 2 3\n", "= 4 values after the header, got 3"),
        ("", "a `ncols` above 0, got no header"),
    ],
)
def test_a_faulty_raster_is_refused(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(InputError) as caught:
        read_raster(written(tmp_path, text))
    assert expected in str(caught.value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x,y,z\n0,0,1,5\n", "data row 1: expected as many fields as in the heading, got more"),
        ("x,y,z\n0,0\n", "column z expected a number in m, got None"),
        (f"x,y,z\n{'1' * 200_000},0,0\n", "expected a CSV table, which cannot be read"),
        ("x,y\n0,0\n", "the columns x, y and z"),
    ],
)
def test_faulty_points_are_refused(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(InputError) as caught:
        read_points(written(tmp_path, text))
    assert expected in str(caught.value)


def test_no_more_of_a_raster_is_read_than_the_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bed, "LARGEST_DATA", 20)
    with pytest.raises(InputError, match="expected at most 20 bytes, got more"):
        read_raster(written(tmp_path, HEADER + "1 2\n3 4\n"))
