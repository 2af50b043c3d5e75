"""Tables as people have them: separators, decimals, titles, units, remarks, copies; refused if columns may shift."""

from datetime import datetime
from pathlib import Path

import pytest
from field_folders import field_folder, imported

from vegglue.errors import InputError
from vegglue.importers.file_options import FileOptions
from vegglue.importers.import_notes import ImportNote, Noted
from vegglue.importers.measured_rows import read_rows
from vegglue.importers.table_parser import (
    ParsedTable,
    has_decimal_comma,
    is_number,
    number_in,
    parse_table,
    without_copies,
)

HEADING = "experiment,section,x,y,u,u_se"
ROWS = [f"low,D{number},{number}.0,-1.5,0.5718,0.012" for number in range(12)]


def table_of(folder: Path, *lines: str) -> Path:
    path = folder / "v.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def workbook_of(folder: Path, *rows: list[object]) -> Path:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(row)
    book.save(folder / "book.xlsx")
    return folder / "book.xlsx"


@pytest.mark.parametrize(
    ("text", "decimal_comma", "value"),
    [
        ("0,5", True, 0.5), ("-1,5e-3", True, -0.0015), ("3", True, 3.0), ("0.5", False, 0.5), (".5", False, 0.5),
        ("1.236,00", True, 1236.0), ("1,236.50", False, 1236.5), ("1'236.5", False, 1236.5),
        ("12 001 236,5", True, 12001236.5), ("3.7D-01", False, 0.37),
        ("1d3", False, 1000.0), ("n/a", True, None), ("", False, None), ("k.A.", True, None), ("n.d.", False, None),
        ("#DIV/0!", False, None), ("#N/A", True, None), ("#WERT!", True, None), ("#NAME?", False, None),
        ("+inf", False, None),
        ("\u22120,5", True, -0.5), ("\u20131", False, -1.0), ("\u2014", True, None), ("1e\u22123", False, 0.001),
    ],
)  # fmt: skip
def test_a_number_is_read_as_written(text: str, decimal_comma: bool, value: float | None) -> None:
    assert number_in(text, decimal_comma) == value


@pytest.mark.parametrize(
    ("text", "decimal_comma"),
    [("0.5", True), ("1.236", True), ("0,5", False), ("1,236.00", True), ("much", False), ("1.2.3", False)],
)
def test_a_number_with_another_sign_than_most_is_not_guessed(text: str, decimal_comma: bool) -> None:
    wanted = "no number" if text in ("much", "1.2.3") else "comma" if decimal_comma else "point"
    with pytest.raises(ValueError, match=wanted):
        number_in(text, decimal_comma)


def test_most_numbers_decide_on_the_decimal_sign() -> None:
    assert has_decimal_comma(["0,5", "1.236,00", "2.0", "low", "12.05.2024"])
    assert not has_decimal_comma(["0.5", "2,0"])
    assert not has_decimal_comma(["3", "low"])
    assert is_number("1.236,00")
    assert not is_number("12.05.2024")


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("x,y,u\n1,2,0.5\n3,4,0.6\n", 2),
        ("x;y;u\n1,5;2,5;0,5\n3,5;4,5;0,6\n", 2),
        ("X [ft]\tY [ft]\tVelocity [ft/s]\n1\t2\t0.5\n3\t4\t0.6\n", 2),
        ("% made by hand\n\nx y u\nm m m/s\n1 2 .5\n3 4 .6\n5 6 NaN\n", 3),
        ('"x","y","u_m_s"\n"1","2","0.5"\n', 1),
        ("x (m) | y (m) | u (mm/s)\n1 | 2 | 500\n3 | 4 | 600\n", 2),
    ],
)
def test_separators_decimals_and_units_are_found(tmp_path: Path, text: str, rows: int) -> None:
    path = tmp_path / "table.txt"
    path.write_text(text, encoding="utf-8")
    taken = read_rows(path, FileOptions())
    assert set(taken.numbers) == {"x", "y", "u"}
    assert taken.size == rows
    foot = 0.3048 if "ft" in text else 1.0
    assert taken.numbers["u"][0] == pytest.approx(0.5 * foot)
    assert taken.numbers["x"][0] == pytest.approx((1.5 if "1,5" in text else 1.0) * foot)


def commas_in_x(row: str) -> str:
    return row.replace(".0,", ",0,", 1)


@pytest.mark.parametrize(
    ("lines", "wrong"),
    [
        ([HEADING, *ROWS[:8], commas_in_x(ROWS[8]), *ROWS[9:]], 10),
        ([HEADING, *map(commas_in_x, ROWS[:5]), *ROWS[5:]], 2),
        ([HEADING, *(row.replace("0.012", "0,012") for row in ROWS)], 2),
        ([HEADING, *(f"low,D0,3,0,-1,5,0,5718,0,0{number}" for number in range(12))], 2),
        (["1,5,2.0,0.3", "1.5,2.1,0.3", "1.5,2.2,0.3"], 1),
        (["x;y;u", "1.5;2.1;0.3;0.3", "1.5;2.2;0.3"], 2),
    ],
)
def test_a_row_with_too_many_fields_is_refused(tmp_path: Path, lines: list[str], wrong: int) -> None:
    """Its columns would be shifted, and a decimal comma averaged into a sound station."""
    with pytest.raises(InputError, match=rf"v\.csv, row {wrong}: "):
        parse_table(table_of(tmp_path, *lines))


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
        (["x,y,u,note", "1,2,0.5,wet; deep", "3,4,0.6,dry; steep", "5,6,0.7,mud; old"], ("x", "y", "u", "note"),
         ["1", "2", "0.5", "wet; deep"]),
        (["Levels", "May", "experiment,x,level,note", "low,2.0,0.5,", "low,3.0,0.6,"], ("experiment", "x", "level"),
         ["low", "2.0", "0.5"]),
        (["Gauge;Chainage;Level", ";m;m a.s.l.", "A;2;47,748", "B;17;47,736"], ("Gauge", "Chainage", "Level"),
         ["A", "2", "47,748"]),
    ],
)  # fmt: skip
def test_rows_that_fit_are_read(tmp_path: Path, lines: list[str], headings: tuple[str, ...], first: list[str]) -> None:
    table = parse_table(table_of(tmp_path, *lines))
    assert table.headings[: len(headings)] == headings
    assert list(table.rows[0])[: len(first)] == first
    assert (table.units[-1] == "m a.s.l.") == ("Gauge" in headings)


@pytest.mark.parametrize(
    "rows",
    [
        ["PS1;155020,7;463045,2;12 mei;11,76;", "PS2;155095,9;463072,9;12 mei;11,73;schaal scheef",
         "PS3;1,5;2,5;a;3,1;"],
        ["PS1;155020,7;463045,2;12 mei;11,76", "PS2;155095,9;463072,9;12 mei;11,73;scheef", "PS3;1,5;2,5;a;3,1;x y"],
        ["12 mei;620;meetschot", "3 juni;1400;ADCP, 4 raaien"],
        ["A;1;155048,53;463050,74;NaN;NaN;droog", "A;2;155048,39;463051,12;14,3;70,4;",
         "A;3;155048,2;463051,5;2,5;69;"],
        ["A;1;155048,53;463050,74;-;-;droog", "A;2;155048,39;463051,12;14,3;70,4;", "A;3;155048,2;463051,5;2,5;69;"],
        ["A;1;2;-;-;", "B;-;-;4,5;-", "A;2;155048,39;463051,12;14,3;70,4;", "A;3;155048,2;463051,5;2,5;69;",
         "A;3;1;2;3;"],
        ["A;left;bank;3,5;;;dry", "A;2;155048,39;463051,12;14,3;70,4;", "A;3;155048,2;463051,5;2,5;69;"],
        ["A;-;-;-;-", "A;2;155048,39;463051,12;14,3;70,4;", "A;3;155048,2;463051,5;2,5;69;"],
    ],
)  # fmt: skip
@pytest.mark.parametrize("units", [[], ["-;1;m;m;-;-;"], ["-;(m);(m2/s2);(ft/ft);(ft);(sq ft);"]])
def test_remarks_and_dry_rows_are_rows(tmp_path: Path, rows: list[str], units: list[str]) -> None:
    """A remark in two of six rows had them parted by their decimal commas, and a dry first row became the heading."""
    table = parse_table(table_of(tmp_path, "raai;x;q;level;u;direction;note", *units, *rows))
    assert table.headings[:3] == ("raai", "x", "q")
    assert [row[0] for row in table.rows] == [row.split(";")[0] for row in rows]
    assert table.form[0] == "semicolons"
    assert bool(any(table.units)) == bool(units)


@pytest.mark.parametrize(
    "rows", [["S1 72,4 46,8 44,9", "A 1,6 57,6 69,3"], ["6,2 6,1 58,1", "- - 75,1", "7,3 2,1 8,3", "9,1 3,3 4,4"]]
)
def test_spaces_part_numbers_with_decimal_commas(tmp_path: Path, rows: list[str]) -> None:
    headings = ("section", "x", "y", "u")[-len(rows[0].split()) :]
    table = parse_table(table_of(tmp_path, " ".join(headings), *rows, rows[0], rows[0], rows[0], rows[0]))
    assert table.headings == headings
    assert table.decimal_comma


def test_quoted_commas_are_decimal_unless_they_may_part_thousands(tmp_path: Path) -> None:
    """A spreadsheet of the web writes `"0,35"` where the country has a decimal comma, another `"1,236"` for a depth in
    millimetres: told apart where one number has no three digits behind its comma, and none a point.
    """
    decimal = parse_table(table_of(tmp_path, "x,y,u,note", '12,"4,125","0,35","reeds, left"', '12,"5,250","0,4",'))
    assert decimal.numbers(tmp_path, 1).tolist() == [4.125, 5.25]
    assert decimal.numbers(tmp_path, 2).tolist() == [0.35, 0.4]
    for rows in (['1,"1,236",0.4', '2,"1,240",0.5'], ['1,"1,236",4', '2,"1,240","reeds, left"']):
        with pytest.raises(InputError, match="1,236"):
            parse_table(table_of(tmp_path, "x,depth,u", *rows)).numbers(tmp_path, 1)


@pytest.mark.parametrize("rows", [["1;2;0,5", "3;4;0,6"], ["A;1;dry", "B;2;0,6"], ["A;1;dry", "B;2;wet"]])
def test_a_title_with_a_unit_is_no_row(tmp_path: Path, rows: list[str]) -> None:
    table = parse_table(table_of(tmp_path, "Site;Mill brook", "Discharge;620;l/s", "x;y;u", *rows))
    assert table.headings == ("x", "y", "u")
    assert [";".join(row) for row in table.rows] == rows


def test_a_number_in_groups_is_no_heading(tmp_path: Path) -> None:
    table = parse_table(table_of(tmp_path, "run;x (m);level (m)", "low;1.236,00;0,5", "low;2,0;0,6"))
    assert table.headings == ("run", "x (m)", "level (m)")
    assert table.numbers(tmp_path, 1).tolist() == [1236.0, 2.0]


def test_a_workbook_is_read_like_a_table(tmp_path: Path) -> None:
    """Numbers typed as text with decimal commas are numbers; the first sheet is read, or one that is named."""
    path = workbook_of(tmp_path, ["Brook"], ["Station x", "y", "u"], ["m", "m", "cm/s"], ["1,5", 2, 50], [3, 4, "60,5"])
    taken = read_rows(path, FileOptions(columns={"x": "Station x"}))
    assert taken.numbers["u"].tolist() == [0.5, 0.605]
    assert taken.numbers["x"].tolist() == [1.5, 3.0]
    book = pytest.importorskip("openpyxl").load_workbook(path)
    book.create_sheet("Levels")
    book.save(path)
    assert ImportNote(Noted.ONE_SHEET, names=("Sheet", "Levels")) in parse_table(path).form
    assert Noted.ONE_SHEET not in [getattr(one, "kind", "") for one in parse_table(path, "Sheet").form]
    with pytest.raises(InputError, match=r"book\.xlsx: .*'June'"):
        parse_table(path, "June")
    (tmp_path / "none.xlsx").write_bytes(b"PK no workbook")
    with pytest.raises(InputError, match=r"none\.xlsx"):
        parse_table(tmp_path / "none.xlsx")


def test_a_date_in_a_workbook_is_the_day(tmp_path: Path) -> None:
    path = workbook_of(
        tmp_path, ["date", "x", "u"], [datetime(2024, 6, 3), 8, 0.4], [datetime(2024, 6, 3, 14, 30), 9, 0.5]
    )
    assert [row[0] for row in parse_table(path).rows] == ["2024-06-03", "2024-06-03 14:30:00"]


def taken_of(folder: Path, *lines: str) -> str:
    """What is taken from a table of measurements in a folder of a field team."""
    table_of(field_folder(folder), *lines)
    return imported(folder).taken["v.csv"]


@pytest.mark.parametrize(
    ("row", "counts"),
    [
        ("low,B,20,0,{},0.01", ["4 rows", "4 missing-value codes"]),
        ("low,B,20,0,,0.01", ["4 rows", "4 empty cells in u"]),
        ("low,B,,0,0.5,0.01", ["4 rows", "4 empty cells in x"]),
        ("low,B,20,0", ["4 rows", "4 empty cells in u", "4 empty cells in u_se"]),
        ("none", ["4 lines"]),
    ],
)
def test_rows_left_out_are_counted(tmp_path: Path, row: str, counts: list[str]) -> None:
    taken = taken_of(tmp_path / "brook", HEADING, *ROWS, *(row.format(mark) for mark in ("-999", "NaN", "n/a", "-")))
    assert taken.startswith("12 of velocity")
    assert all(count in taken for count in counts)


@pytest.mark.parametrize(
    ("heading", "assumed"),
    [
        (HEADING, "x, y and u,"), (HEADING.replace("x,y,u,", "x [m],y (m),u [m/s],"), None),
        (HEADING.replace("u,", "u_cm_s,", 1), "x and y,"),
    ],
)  # fmt: skip
def test_units_that_are_not_stated_are_reported(tmp_path: Path, heading: str, assumed: str | None) -> None:
    taken = taken_of(tmp_path / "brook", heading, *ROWS, "none")
    assert (f"for {assumed}" in taken) if assumed else ("SI" not in taken)


SURVEY = [f"low,A,12,{number / 10},{0.4 + number / 100},0.012" for number in range(12)]


def kept_of(rows: list[str]) -> list[str]:
    texts, numbers = tuple([row] for row in rows), tuple(range(2, len(rows) + 2))
    return [fields[0] for fields in without_copies(ParsedTable(("row",), ("",), texts, numbers, False, ())).rows]


@pytest.mark.parametrize("times", [1, 4])
def test_a_table_pasted_four_times_is_as_good_as_once(tmp_path: Path, times: int) -> None:
    folder = field_folder(tmp_path / "brook")
    table_of(folder, HEADING, *SURVEY * times)
    (folder / "velocities.csv").unlink()
    found = imported(folder)
    assert len(found.values()) == 12
    assert set(found.table.loc[found.table["kind"] == "velocity", "standard_error"]) == {0.012}
    assert ("36 rows" in found.taken["v.csv"]) == (times == 4)


@pytest.mark.parametrize(
    ("rows", "kept"),
    [
        ([row for row in SURVEY for _ in range(3)], SURVEY),
        ([*SURVEY, SURVEY[3]] * 2, [*SURVEY, SURVEY[3]]),
        (["a", *SURVEY, "b", *SURVEY[:11]], ["a", *SURVEY, "b"]),
        ([*SURVEY, "b", *SURVEY, *SURVEY], [*SURVEY, "b"]),
    ],
)
def test_tables_and_stretches_that_stand_there_again_are_copies(rows: list[str], kept: list[str]) -> None:
    assert kept_of(rows) == kept


@pytest.mark.parametrize(
    "rows",
    [
        SURVEY,
        SURVEY[:4] * 3,  # four places, where all repeats may agree by chance
        [*SURVEY, *SURVEY[:9]],
        [*SURVEY, "b", *reversed(SURVEY)],
        [SURVEY[0]] * 30,
        [*SURVEY[:6], *SURVEY[:3], "other", *SURVEY[4:6]],  # a second pass, whose fourth reading differs
    ],
)
def test_repeats_that_agree_in_few_digits_stay(rows: list[str]) -> None:
    assert kept_of(rows) == rows
