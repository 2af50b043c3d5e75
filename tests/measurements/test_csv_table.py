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
    ("text", "words"),
    [
        ("section,x,u\nA,1,0,53\n", ("row 2:", "got 4")), ("section,x,u\nA,1,0.5\nB,2,0,61\n", ("row 3:", "got 4")),
        ("section,x,u\nA,1\n", ("row 2:", "column u", "nothing")),
        ("section,x,u\n\nA,1,2\n", ("row 2:", "column section")),
        ("section,x,u,u\nA,1,2,3\n", ("row 1:", "column u")), ("section,x, u,u \nA,1,2,3\n", ("row 1:", "column u")),
        ("section,x,u\nA\x00B,1,2\n", ("row 2:", "column section", "'\\x00'")), ('section,x,u\n"A,1,2\n', ("CSV",)),
        (f"section,x,u\n{'A' * 200_000},1,2\n", ("limit",)), ("", ("empty", "section, x, u")),
        ("section;x;u\nA;1;0,5\n", ("row 1:", "commas", "'section;x;u'")), ("section,x\nA,1\n", ("u is missing",)),
        ("section,x,u\n", ("rows",)), (b"section,x,u\nA\xff,1,2\n", ("UTF-8",)),
        ("section,x,u\nA,1,1e999\n", ("row 2:", "column u", "'1e999'")),
    ],
    ids=lambda text: str(text)[:20],
)  # fmt: skip
def test_a_fault_is_named_with_its_row(tmp_path: Path, text: str | bytes, words: tuple[str, ...]) -> None:
    said = refused(tmp_path, text)
    assert all(word in said for word in ("measured.csv", *words))


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
    assert "20 bytes" in refused(tmp_path, "section,x,u\nA,1,2.0000\n")
