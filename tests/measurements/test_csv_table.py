"""Tables from anybody: read whole, or refused with file and row; nothing is lost on the way."""

from pathlib import Path

import pytest

from vegglue.errors import InputError
from vegglue.measurements import csv_table
from vegglue.measurements.csv_table import read_table


def table(folder: Path, text: str | bytes):
    path = folder / "measured.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_table(path, ("section",), ("x", "u"), ("u_se",))


def refused(folder: Path, text: str | bytes) -> str:
    with pytest.raises(InputError) as caught:
        table(folder, text)
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("section,x,u\nA,1,0,53\n", "row 2: expected 3 fields as in the heading, got 4; write numbers with a decimal"),
        ("section,x,u\nA,1,0.5\nB,2,0,61\n", "row 3: expected 3 fields"),
        ("section,x,u\nA,1\n", "row 2: expected a number in column u, got ''"),
        ("section,x,u\n\nA,1,2\n", "row 2: expected a name in column section, got nothing"),
        ("section,x,u,u\nA,1,2,3\n", "row 1: expected one column u, got two"),
        ("section,x, u,u \nA,1,2,3\n", "row 1: expected one column u, got two"),
        ("section,x,u\nA\x00B,1,2\n", "row 2: expected a name in column section, got one with the sign '\\x00'"),
        ('section,x,u\n"A,1,2\n', "expected a CSV table, which cannot be read (unexpected end of data)"),
        (f"section,x,u\n{'A' * 200_000},1,2\n", "field larger than field limit"),
        ("", "row 1: expected the columns section, x, u"),
        (
            "section;x;u\nA;1;0,5\n",
            "row 1: expected columns separated by commas, got 'section;x;u'; write commas, and dec",
        ),
        ("section,x\nA,1\n", "without u; rename or add what is missing."),
        ("section,x,u\n", "expected rows below the heading, got none"),
        (b"section,x,u\nA\xff,1,2\n", "is not text in UTF-8"),
        ("section,x,u\nA,1,1e999\n", "row 2: expected a number in column u, got '1e999'"),
    ],
)
def test_a_fault_is_named_with_its_row(tmp_path: Path, text: str | bytes, expected: str) -> None:
    assert expected in refused(tmp_path, text)


@pytest.mark.parametrize(
    "text",
    [
        "section,x,u\nA,1,2\n", "\ufeffsection,x,u\nA,1,2\n", "section , x,u\r\nA,1, 2\r\n", "section,x,u\nA,1,2,,\n",
        '"section","x","u","note"\n"A",1,2,"0,5 m, at the bank"\n', "section,x,u,n,n\nA,1,2,,\n", "section,x,u\nA,1,2",
    ],
)  # fmt: skip
def test_what_spreadsheets_write_is_read(tmp_path: Path, text: str) -> None:
    assert table(tmp_path, text).to_dict("list") == {"section": ["A"], "x": [1.0], "u": [2.0]}


def test_no_more_is_read_than_the_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(csv_table, "LARGEST_DATA", 20)
    assert "expected at most 20 bytes, got more: make it smaller" in refused(tmp_path, "section,x,u\nA,1,2.0000\n")
