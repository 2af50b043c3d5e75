"""Rows that are not as the others: refused where their numbers may stand in wrong columns, else read or counted."""

from datetime import datetime
from pathlib import Path

import pytest
from field_folders import field_folder

import vegglue
from vegglue.errors import InputError
from vegglue.importers.column_names import unit_named
from vegglue.importers.table_parser import parse_table

HEADING = "experiment,section,x,y,u,u_se"
ROWS = [f"low,D{number},{number}.0,-1.5,0.5718,0.012" for number in range(12)]


def table_of(folder: Path, *lines: str) -> Path:
    path = folder / "v.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def commas_in_x(row: str) -> str:
    return row.replace(".0,", ",0,", 1)


@pytest.mark.parametrize(
    ("rows", "wrong", "fields"),
    [
        ([*ROWS[:8], commas_in_x(ROWS[8]), *ROWS[9:]], 10, 7),
        ([*map(commas_in_x, ROWS[:5]), *ROWS[5:]], 2, 7),
        ([row.replace("0.012", "0,012") for row in ROWS], 2, 7),
        ([f"low,D0,3,0,-1,5,0,5718,0,0{number}" for number in range(12)], 2, 10),
    ],
)
def test_decimal_commas_between_commas_are_refused(tmp_path: Path, rows: list[str], wrong: int, fields: int) -> None:
    """Their row was read with its columns shifted, and averaged into a sound station."""
    said = rf"v\.csv, row {wrong}: expected 6 fields as in the heading, got {fields}; if numbers"
    with pytest.raises(InputError, match=said):
        parse_table(table_of(tmp_path, HEADING, *rows))


def test_a_longer_row_without_a_heading_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"row 1: expected 3 fields as in others, got 4; if numbers"):
        parse_table(table_of(tmp_path, "1,5,2.0,0.3", "1.5,2.1,0.3", "1.5,2.2,0.3"))
    with pytest.raises(InputError, match=r"row 2: expected 3 fields as in the heading, got 4; mend the row"):
        parse_table(table_of(tmp_path, "x;y;u", "1.5;2.1;0.3;0.3", "1.5;2.2;0.3"))


@pytest.mark.parametrize(
    ("lines", "headings", "first"),
    [
        (["x,y,u,", "1,2,0.5,dry,", "3,4,0.6,,,"], ("x", "y", "u", ""), ["1", "2", "0.5", "dry"]),
        (["x,y,u,u_se", "1,2,0.5", "3,4,0.6", "5,6,0.7,0.1"], ("x", "y", "u", "u_se"), ["1", "2", "0.5", ""]),
        (["x,y,u,u_se", "m,m,m/s,m/s", "1,2,0.5", "3,4,0.6,0.1"], ("x", "y", "u", "u_se"), ["1", "2", "0.5", ""]),
        (["x [m]  y [m]  u [m/s]", "1 2 0.5", "3 4 0.6"], ("x[m]", "y[m]", "u[m/s]"), ["1", "2", "0.5"]),
        (["x y u", "[m] [m] (m/s)", "1 2 0.5", "3 4 0.6"], ("x", "y", "u"), ["1", "2", "0.5"]),
        (["x y u", "1 2 0.5 (dry)", "3 4 0.6", "5 6 0.7"], ("x", "y", "u"), ["1", "2", "0.5"]),
        (["x y u", "1 2 0.5 top of bank", "3 4 0.6", "5 6 0.7"], ("x", "y", "u"), ["1", "2", "0.5"]),
        (["Brook; 3 June", "x;y;u;;", "1;2;0.5;;", "# 7;7;7;7;7;7;7", "3;4;0.6"], ("x", "y", "u"), ["1", "2", "0.5"]),
    ],
)
def test_rows_that_fit_are_read(tmp_path: Path, lines: list[str], headings: tuple[str, ...], first: list[str]) -> None:
    table = parse_table(table_of(tmp_path, *lines))
    assert table.headings == headings
    assert list(table.rows[0]) == first


@pytest.mark.parametrize(
    "rows",
    [
        [
            "PS1;155020,7;463045,2;12 mei;11,76;",
            "PS2;155095,9;463072,9;12 mei;11,73;schaal scheef",
            "PS3;1,5;2,5;a;3,1;",
        ],
        ["PS1;155020,7;463045,2;12 mei;11,76", "PS2;155095,9;463072,9;12 mei;11,73;scheef", "PS3;1,5;2,5;a;3,1;x y"],
        ["12 mei;620;meetschot", "3 juni;1400;ADCP, 4 raaien"],
        [
            "A;1;155048,53;463050,74;NaN;NaN;droog",
            "A;2;155048,39;463051,12;14,3;70,4;",
            "A;3;155048,2;463051,5;2,5;69;",
        ],
        ["A;1;155048,53;463050,74;-;-;droog", "A;2;155048,39;463051,12;14,3;70,4;", "A;3;155048,2;463051,5;2,5;69;"],
        [
            "A;1;2;-;-;",
            "B;-;-;4,5;-",
            "A;2;155048,39;463051,12;14,3;70,4;",
            "A;3;155048,2;463051,5;2,5;69;",
            "A;3;1;2;3;",
        ],
        ["A;left;bank;3,5;;;dry", "A;2;155048,39;463051,12;14,3;70,4;", "A;3;155048,2;463051,5;2,5;69;"],
    ],
)
@pytest.mark.parametrize("units", [[], ["-;1;m;m;-;-;"]])
def test_remarks_and_dry_rows_are_rows(tmp_path: Path, rows: list[str], units: list[str]) -> None:
    """A remark in two of six rows had them parted by their decimal commas, and a dry first row became the heading."""
    table = parse_table(table_of(tmp_path, "raai;x;q;level;u;direction;note", *units, *rows))
    assert table.headings[:3] == ("raai", "x", "q")
    assert [row[0] for row in table.rows] == [row.split(";")[0] for row in rows]
    assert table.form.startswith("semicolons")
    assert bool(any(table.units)) == bool(units)


@pytest.mark.parametrize(
    "rows", [["S1 72,4 46,8 44,9", "A 1,6 57,6 69,3"], ["6,2 6,1 58,1", "- - 75,1", "7,3 2,1 8,3", "9,1 3,3 4,4"]]
)
def test_spaces_part_numbers_with_decimal_commas(tmp_path: Path, rows: list[str]) -> None:
    """They were parted by the commas, as these cut all lines but the heading."""
    headings = ("section", "x", "y", "u")[-len(rows[0].split()) :]
    table = parse_table(table_of(tmp_path, " ".join(headings), *rows, rows[0], rows[0], rows[0], rows[0]))
    assert table.headings == headings
    assert table.decimal_comma


@pytest.mark.parametrize("rows", [["1;2;0,5", "3;4;0,6"], ["A;1;dry", "B;2;0,6"], ["A;1;dry", "B;2;wet"]])
def test_what_a_title_says_with_its_unit_is_no_row(tmp_path: Path, rows: list[str]) -> None:
    table = parse_table(table_of(tmp_path, "Site;Mill brook", "Discharge;620;l/s", "x;y;u", *rows))
    assert table.headings == ("x", "y", "u")
    assert [";".join(row) for row in table.rows] == rows


def test_words_with_semicolons_do_not_part_a_table_of_commas(tmp_path: Path) -> None:
    table = parse_table(table_of(tmp_path, "x,y,u,note", "1,2,0.5,wet; deep", "3,4,0.6,dry; steep", "5,6,0.7,mud; old"))
    assert table.headings == ("x", "y", "u", "note")


def told_of(folder: Path, *lines: str) -> str:
    """What is told of a table of measurements in a folder of a field team."""
    table_of(field_folder(folder), *lines)
    imported = vegglue.import_folder(folder, folder.parent / "brook.yaml").imported
    assert imported is not None
    return imported[0].taken


@pytest.mark.parametrize(
    ("row", "told"),
    [
        ("low,B,20,0,{},0.01", ["4 rows left out for want of u:", "4 marks for no value in u;"]),
        ("low,B,20,0,,0.01", ["4 rows left out for want of u:", "4 empty cells in u;"]),
        ("low,B,,0,0.5,0.01", ["4 rows left out for want of x or y:", "4 empty cells in x;"]),
        ("low,B,20,0", ["4 rows left out for want of u:", "4 empty cells in u, 4 empty cells in u_se;"]),
        ("none", ["commas, 4 lines of one field left out;"]),
    ],
)
def test_rows_left_out_are_counted(tmp_path: Path, row: str, told: list[str]) -> None:
    """Of four marks one was counted, and of empty cells and short rows none."""
    said = told_of(tmp_path / "brook", HEADING, *ROWS, *(row.format(mark) for mark in ("-999", "NaN", "n/a", "-")))
    assert said.startswith("12 of velocity")
    for words in told:
        assert words in said


@pytest.mark.parametrize(
    ("heading", "said"),
    [
        (HEADING, "no unit given of x, y and u, taken as SI, commas,"),
        (HEADING.replace("x,y,u,", "x [m],y (m),u [m/s],"), "; commas,"),
        (HEADING.replace("u,", "u_cm_s,", 1), "no unit given of x and y, taken as SI, commas,"),
    ],
)
def test_a_unit_that_nobody_gave_is_said(tmp_path: Path, heading: str, said: str) -> None:
    """`u from u [m/s]` was told as if the table had stated it."""
    assert said in told_of(tmp_path / "brook", heading, *ROWS, "none")


def test_a_unit_may_name_the_datum_of_a_level(tmp_path: Path) -> None:
    """`m a.s.l.` in a row of units made that row the heading, and no column was known."""
    table = parse_table(table_of(tmp_path, "Gauge;Chainage;Level", ";m;m a.s.l.", "A;2;47,748", "B;17;47,736"))
    assert table.headings == ("Gauge", "Chainage", "Level")
    assert table.units == ("", "m", "m a.s.l.")


@pytest.mark.parametrize("unit", ["cm+NAP", "cm + NAP", "cm ü. NN"])
def test_a_level_may_be_in_centimetres_above_a_datum(unit: str) -> None:
    assert unit_named(unit, "length") == "cm"


def test_two_titles_above_two_rows_are_no_table(tmp_path: Path) -> None:
    table = parse_table(table_of(tmp_path, "Levels", "May", "experiment,x,level,note", "low,2.0,0.5,", "low,3.0,0.6,"))
    assert table.headings == ("experiment", "x", "level")
    assert len(table.rows) == 2


def test_a_number_in_groups_is_no_heading(tmp_path: Path) -> None:
    table = parse_table(table_of(tmp_path, "run;x (m);level (m)", "low;1.236,00;0,5", "low;2,0;0,6"))
    assert table.headings == ("run", "x (m)", "level (m)")
    assert table.numbers(tmp_path, 1).tolist() == [1236.0, 2.0]


def test_text_with_decimal_commas_in_a_workbook_is_numbers(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in (["x", "y", "u"], ["1,5", 2, "0,25"], ["2,5", 2.5, "0,3"]):
        book.active.append(row)
    book.save(tmp_path / "v.xlsx")
    table = parse_table(tmp_path / "v.xlsx")
    assert [table.numbers(tmp_path, column).tolist() for column in range(3)] == [[1.5, 2.5], [2.0, 2.5], [0.25, 0.3]]


def test_a_date_in_a_workbook_is_the_day(tmp_path: Path) -> None:
    """It was `2024-06-03 00:00:00`, and no experiment of that name is in a site file."""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in (["date", "x", "u"], [datetime(2024, 6, 3), 8, 0.4], [datetime(2024, 6, 3, 14, 30), 9, 0.5]):
        book.active.append(row)
    book.save(tmp_path / "a.xlsx")
    rows = parse_table(tmp_path / "a.xlsx").rows
    assert [row[0] for row in rows] == ["2024-06-03", "2024-06-03 14:30:00"]
