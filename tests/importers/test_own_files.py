"""Files as people have them become a case: what is in them is found, converted, turned, and told in one line each."""

import re
from math import cos, radians, sin
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from field_folders import CHANNEL, JUNE, folder_of
from reach import said_to

import vegglue
from vegglue.case.frame import Frame
from vegglue.case.gridded_site import build_site
from vegglue.diagnosis.channel_check import ParameterIdle
from vegglue.diagnosis.flow_check import FlowUpstream, WaterOnSideEdges
from vegglue.diagnosis.station_check import StationsOutsideGrid
from vegglue.errors import InputError
from vegglue.importers.column_names import in_si, role_of, unit_named
from vegglue.importers.file_options import FileOptions, read_file_options
from vegglue.importers.measured_rows import read_rows
from vegglue.importers.table_parser import parse_table
from vegglue.measurements.observations import read_observations
from vegglue.measurements.plausibility import ImplausibleValues
from vegglue.workflow.import_folder import assumptions_of

FRAME = Frame(origin=(683120.0, 247480.0), angle=32.0)


def survey_on_the_map() -> str:
    """Velocities of 0.4 m/s along and 0.02 across, as a logger of a German office writes them."""
    turn = radians(FRAME.angle)
    east, north = (0.4 * cos(turn) - 0.02 * sin(turn), 0.4 * sin(turn) + 0.02 * cos(turn))
    lines = ["Mill brook, 3 June", "# probe 2", "Pt;Easting;Northing;Ve;Vn", "-;m;m;cm/s;cm/s"]
    for number, (x, y) in enumerate([(8, -1), (8, 0), (20, -1), (20, 1)]):
        place = FRAME.to_map(x, y)
        fields = (*(f"{one:.3f}" for one in place), f"{100 * east:.3f}", f"{100 * north:.3f}")
        lines.append(";".join([str(number), *(field.replace(".", ",") for field in fields)]))
    return "\n".join([*lines, "9;683120,000;247480,000;-999;-999"])


def test_the_page_has_every_word_of_a_file() -> None:
    page = (Path(__file__).parents[2] / "docs" / "own_files.md").read_text(encoding="utf-8")
    table = page.partition("## What an entry of `files` may say")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (`[^|]*) \|", table, re.MULTILINE)
    told = {key for row in rows for key in re.findall(r"`([a-z_]+)", row)}
    assert told == set(FileOptions.__dataclass_fields__)


def test_both_velocities_of_a_plain_table_are_taken(tmp_path: Path) -> None:
    """Under the usual name of u alone."""
    rows = ["experiment,section,x,y,u,u_se,v", *(f"June,A,8,{y},0.4,0.01,0.02" for y in (-1, 0, 1))]
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, velocities__csv="\n".join(rows))
    table = read_observations(vegglue.import_folder(folder, tmp_path / "brook.yaml")).table
    assert table["kind"].value_counts().to_dict() == {"velocity": 3, "velocity_across": 3}
    assert set(table[table["kind"] == "velocity"]["standard_error"]) == {0.01}


@pytest.mark.parametrize(
    ("said", "velocity", "level"), [("1.5 cm/s", 0.015, None), ("4 mm", None, 0.004), ("0.02", 0.02, 0.02)]
)
def test_a_standard_error_is_of_the_values_of_its_unit(
    said: str, velocity: float | None, level: float | None, tmp_path: Path
) -> None:
    """1.5 cm/s was the error of levels in the same table, too."""
    rows = ["experiment,section,x,y,u,level", *(f"June,A,8,{y},0.4,0.95" for y in (-1, 0, 1))]
    words = f"files: {{all.csv: {{standard_error: {said}}}}}\n"
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE + words, all__csv="\n".join(rows))
    table = read_observations(vegglue.import_folder(folder, tmp_path / "brook.yaml")).table
    for kind, wanted in (("velocity", velocity), ("level", level)):
        found = table[table["kind"] == kind]["standard_error"].to_numpy(float)
        assert np.isnan(found).all() if wanted is None else set(found) == {wanted}, kind


def test_a_table_on_the_map_in_other_units_becomes_stations(tmp_path: Path) -> None:
    site = (
        CHANNEL + JUNE + "frame: {origin: [683120, 247480], angle: 32}\nfiles: {adv__csv: {standard_error: 1 cm/s}}\n"
    )
    folder = folder_of(tmp_path / "Brook", site.replace("__", "."), adv__csv=survey_on_the_map())
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    table = read_observations(case).table
    along = table[table["kind"] == "velocity"]
    assert np.allclose(along[["x", "y"]], [(8, -1), (8, 0), (20, -1), (20, 1)], atol=0.002)
    assert np.allclose(along["value"], 0.4, atol=1e-4)
    assert np.allclose(table[table["kind"] == "velocity_across"]["value"], 0.02, atol=1e-4)
    assert set(table["standard_error"]) == {0.01}
    assert case.experiments["June"].discharge == {"upstream": 2.0}
    assert case.experiments["June"].level == pytest.approx(0.95)
    assert case.frame == FRAME
    assert case.imported is not None
    taken = case.imported[0].taken
    for word in (
        "semicolons",
        "decimal comma",
        "1 comment line",
        "a row of units",
        "1 mark for no value in Ve",
        "Easting",
    ):
        assert word in taken
    assert case.imported[0].units["east_velocity"] == "cm/s"


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
def test_separators_decimals_and_units_are_told(tmp_path: Path, text: str, rows: int) -> None:
    path = tmp_path / "table.txt"
    path.write_text(text, encoding="utf-8")
    taken = read_rows(path, FileOptions())
    assert set(taken.numbers) == {"x", "y", "u"}
    assert taken.size == rows
    foot = 0.3048 if "ft" in text else 1.0
    assert taken.numbers["u"][0] == pytest.approx(0.5 * foot)
    assert taken.numbers["x"][0] == pytest.approx((1.5 if "1,5" in text else 1.0) * foot)


def test_a_workbook_is_read_like_a_table(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in (["Brook"], ["Station x", "y", "u"], ["m", "m", "cm/s"], [1, 2, 50], [3, 4, 60.5]):
        book.active.append(row)
    book.save(tmp_path / "book.xlsx")
    taken = read_rows(tmp_path / "book.xlsx", FileOptions(columns={"x": "Station x"}))
    assert taken.numbers["u"].tolist() == [0.5, 0.605]
    book.create_sheet("Levels")
    book.save(tmp_path / "book.xlsx")
    assert "only sheet Sheet; measurements of Levels need a file" in parse_table(tmp_path / "book.xlsx").form
    assert "Levels" not in parse_table(tmp_path / "book.xlsx", "Sheet").form
    with pytest.raises(InputError, match="expected the sheet 'June', got Sheet"):
        parse_table(tmp_path / "book.xlsx", "June")
    (tmp_path / "none.xlsx").write_bytes(b"PK no workbook")
    with pytest.raises(InputError, match=r"none\.xlsx cannot be read as a workbook"):
        parse_table(tmp_path / "none.xlsx")


@pytest.mark.slow
def test_what_is_wrong_in_a_file_is_named_by_check(tmp_path: Path) -> None:
    """A wrong unit, a station outside the grid, and a stream that is reversed."""
    rows = "".join(f"8,{y},{40 + y}\n20,{y},{42 + y}\n" for y in (-1, 0, 1))
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=f"x,y,u\n{rows}300,0,40\n")
    remarks = vegglue.check(vegglue.import_folder(folder, tmp_path / "b.yaml"), runs=tmp_path).remarks
    assert [one.unit for one in remarks if isinstance(one, ImplausibleValues)] == ["cm/s"]
    assert StationsOutsideGrid("June", 1, (300.0, 0.0)) in remarks
    entry = "files: {a.csv: {units: {u: cm/s}}}\n"
    folder = folder_of(tmp_path / "other", CHANNEL + JUNE + entry, a__csv="x,y,u\n" + rows.replace(",4", ",-4"))
    remarks = vegglue.check(vegglue.import_folder(folder, tmp_path / "o.yaml"), runs=tmp_path).remarks
    assert [one.experiments for one in remarks if isinstance(one, FlowUpstream)] == [("June",)]


@pytest.mark.parametrize("name", ["holdout__csv", "holdout__txt"])
def test_what_is_held_out_may_have_any_form(tmp_path: Path, name: str) -> None:
    """It goes where no calibration sees it, in SI and in the channel."""
    site = CHANNEL + JUNE + "holdout: {May: {discharge: 2.4, level: 1.0}}\n"
    site += "frame: {origin: [683120, 247480], angle: 32}\n"
    own = "Easting,Northing,u\n683126.78,247484.24,0.5\n"
    folder = folder_of(tmp_path / "brook", site, adv__csv=own, **{name: survey_on_the_map()})
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    assert [one.file.name for one in case.observations] == ["adv-velocity.csv"]
    assert case.validation is not None
    assert list(case.validation.experiments) == ["May"]
    found = {one.kind: pd.read_csv(one.file) for one in case.validation.observations}
    assert set(found["velocity"]["experiment"]) == {"May"}
    assert np.allclose(found["velocity"]["u"], 0.4, atol=1e-4)
    assert np.allclose(found["velocity_across"]["v"], 0.02, atol=1e-4)
    assert np.allclose(found["velocity"][["x", "y"]], [(8, -1), (8, 0), (20, -1), (20, 1)], atol=0.002)
    assert case.imported is not None
    assert [one.name for one in case.imported] == ["adv.csv", name.replace("__", ".")]


def test_a_flume_has_walls_and_no_banks(tmp_path: Path) -> None:
    """The grid ends at the walls, their roughness is a parameter, and `check` wants no wider grid."""
    channel = "channel: {length_m: 8, bottom_width_m: 0.8, bed_slope: 0.001}\nwalls: {n: 0.010}\n"
    june = "experiments: {June: {discharge: 32 l/s, level: 9.2 cm}}\n"
    folder = folder_of(tmp_path / "flume", channel + june, a__csv="x,y,u [cm/s]\n4,-0.2,44\n4,0,46\n4,0.2,44\n")
    case = vegglue.import_folder(folder, tmp_path / "flume.yaml")
    assert case.grid.y == (-0.4, 0.4)
    assert case.friction.walls is not None
    assert case.friction.walls.n == "n_w"
    assert list(case.parameters) == ["n_b", "eddy_viscosity", "n_w"]
    assert case.model_error.bed == 0.001
    remarks = vegglue.check(case, runs=tmp_path).remarks
    assert not [one for one in remarks if isinstance(one, WaterOnSideEdges)]
    assert not [one for one in remarks if isinstance(one, ParameterIdle)], "n_w acts on the walls"


def test_walls_may_be_their_coefficient_alone(tmp_path: Path) -> None:
    channel = "channel: {length_m: 8, bottom_width_m: 0.8, bed_slope: 0.001}\nwalls: 0.013\n"
    folder = folder_of(tmp_path / "flume", channel + JUNE, a__csv="x,y,u\n4,0,0.4\n")
    n_w = vegglue.import_folder(folder, tmp_path / "flume.yaml").parameters["n_w"]
    assert getattr(n_w, "median", None) == 0.013


def test_walls_leave_no_room_for_banks(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "flume", CHANNEL + JUNE + "walls: true\n", a__csv="x,y,u\n4,0,0.4\n")
    assert vegglue.import_folder(folder, tmp_path / "flume.yaml").grid.y == (-1.5, 1.5)
    assert "not read: channel.bank_slope_v_per_h, as there are walls." in " ".join(assumptions_of(folder))
    (folder / "site.yaml").write_text(CHANNEL.replace("bank_slope_v_per_h: 0.5, ", "") + JUNE, encoding="utf-8")
    with pytest.raises(InputError, match=r"`channel.bank_slope_v_per_h` is missing; add it"):
        vegglue.import_folder(folder, tmp_path / "flume.yaml")


def test_own_columns_and_units_are_kept_in_the_case(tmp_path: Path) -> None:
    entry = "files: {a.csv: {columns: {u: V1, x: P}, units: {u: ft/s}, flip: [x], missing: [-1], section: A}}\n"
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE + entry, a__csv="P,y,V1\n-4,0,-1.0\n-6,0,-2.0\n-8,0,-1\n")
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    assert case.imported is not None
    assert case.imported[0].columns == {"x": "P", "y": "y", "u": "V1"}
    assert case.imported[0].units["u"] == "ft/s"
    table = read_observations(case).table
    assert table[["x", "value", "section"]].to_numpy().tolist() == [[6.0, 0.6096, "A"]]


@pytest.mark.parametrize("heading", ["Geschw. (cm/s)", "Geschw. [cm/s]", "Geschw., cm/s", "Geschw_cm_s", "Geschw cm/s"])
def test_the_unit_of_a_heading_counts_whatever_its_name_is(tmp_path: Path, heading: str) -> None:
    entry = f"files: {{a.csv: {{columns: {{u: '{heading}', x: 'Ort (flach)'}}}}}}\n"
    table = f"Ort (flach);y;{heading}\n4;0;10\n8;0;20\n"
    case = vegglue.import_folder(
        folder_of(tmp_path / "brook", CHANNEL + JUNE + entry, a__csv=table), tmp_path / "b.yaml"
    )
    assert case.imported is not None
    assert (case.imported[0].units["u"], case.imported[0].units["x"]) == ("cm/s", "m")
    assert read_observations(case).table["value"].tolist() == [0.1, 0.2]


@pytest.mark.parametrize(
    ("site", "table", "said"),
    [
        ("files: {b.csv: {}}", "x,y,u\n1,2,3\n", "`files` names b.csv, which is not there"),
        ("files: {a.csv: {colums: {}}}", "x,y,u\n1,2,3\n", "does not know `colums`: did you mean `columns`?"),
        ("files: {a.csv: {columns: {u: V9}}}", "x,y,u\n1,2,3\n", "expected the column 'V9' for u, got x, y, u"),
        ("files: {a.csv: {columns: {V9: u}}}", "x,y,V9\n1,2,3\n", "expected what is measured first, `u: V9`"),
        ("files: {a.csv: {units: {u: furlong}}}", "x,y,u\n1,2,3\n", "expected a unit of velocity, got 'furlong'"),
        ("", "x,y,u [m3]\n1,2,3\n", "is headed 'm3', which is no unit of velocity"),
        ("", "a,b\n1,2\n", "got a, b"),
        ("", "y,u\n1,2\n", "expected a column of x, got none"),
        ("", "section,x,u\nA,1,2\nsection,x,u\nB,1,2\n", "got 'x'; the heading stands there again: put"),
        ("", "x,y,u\n1,2,3\n1,2,fast\n4,5,6\n", "row 3: expected a number in column u, got 'fast'"),
        ("files: {a.csv: {missing: none}}", "x,y,u\n1,2,3\n", "`files.a.csv`.missing expected a number"),
        ("files: {a.csv: {standard_error: -0.01}}", "x,y,u\n1,2,3\n", "standard_error expected a number of 0 or above"),
        ("", "x,y,u,u_se\n1,2,3,0.1\n1,3,3,-1\n", "row 3: expected 0 or above in column u_se, got -1; correct it, or"),
        ("files: {a.csv: {flip: z}}", "x,y,u\n1,2,3\n", "flip expected one of x, y, got 'z'"),
        ("files: {a.csv: {line: 3}}", "x,y,u\n1,2,3\n", "line expected two points"),
        ("files: {a.csv: {line: [[1, 2], [1, 2]]}}", "tape,u\n1,2\n", "line expected two points, one at each end"),
        (
            "files: {a.csv: {start: [1, 2]}}",
            "x,y,u\n1,2,3\n",
            "expected no `start` in its entry of `files`, which is for",
        ),
        ("files: {a.csv: {line: [[1, 2], [3, 4]]}}", "x,y,u\n1,2,3\n", "expected no `line` in its entry"),
        ("files: {a.csv: {draft: 0.1}}", "x,y,u\n1,2,3\n", "expected no `draft` in its entry"),
        (
            "files: {a.csv: {declination: 3}}",
            "x,y,u\n1,2,3\n",
            "`declination` in its entry of `files`, which is for raw",
        ),
        ("frame: {origin: [1, 2]}", "x,y,u\n1,2,3\n", "either `angle` or `towards: [east, north]`"),
    ],
)
def test_what_cannot_be_taken_is_said_in_one_sentence(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    site: str,
    table: str,
    said: str,
) -> None:
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE + site + "\n", a__csv=table.replace(",", ";"))
    code, error = said_to(monkeypatch, capsys, "import", folder, "--to", tmp_path / "brook.yaml")
    assert code == 2
    assert said in error
    assert len(error.strip().splitlines()) == 1


def test_a_file_of_a_folder_within_is_read(tmp_path: Path) -> None:
    """It was looked for, and never read."""
    site = CHANNEL + JUNE + "files: {adcp/b.csv: {section: B}}\n"
    folder = folder_of(tmp_path / "brook", site, b__csv="x;y;section;u\n1;0;A;0.1\n")
    (folder / "adcp").mkdir()
    for name in ("b.csv", "unnamed.csv"):
        (folder / "adcp" / name).write_text("x;y;u\n2;0;0.2\n", encoding="utf-8")
    table = read_observations(vegglue.import_folder(folder, tmp_path / "brook.yaml")).table
    assert table[["section", "value"]].to_numpy().tolist() == [["A", 0.1], ["B", 0.2]]


def test_a_file_beside_the_folder_is_not_read(tmp_path: Path) -> None:
    """A site file may be a stranger's."""
    (tmp_path / "secret.csv").write_text("x;y;u\n2;0;0.2\n", encoding="utf-8")
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE + "files: {../secret.csv: {}}\n", b__csv="x;y;u\n1;0;0.1\n")
    with pytest.raises(InputError, match=r"names \.\./secret\.csv, which leads out of the folder"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


def test_words_for_units_and_columns() -> None:
    assert unit_named("cm s^-1", "velocity") == "cm/s"
    assert unit_named("m³/s", "discharge") == "m3/s"
    assert unit_named("cfs", "discharge") == "ft3/s"
    assert unit_named("feet", "length") == "ft"
    assert unit_named("m", "velocity") is None
    assert [unit_named(word, "length") for word in ("m a.s.l.", "m+NAP", "m ü. NN", "ft NAVD88")] == [*"mmm", "ft"]
    assert unit_named("min", "length") is None
    assert in_si("42 l/s", "discharge", "Q") == pytest.approx(0.042)
    assert role_of("U_depthavg_ms") == ("u", "m/s")
    assert role_of("Water level [cm]") == ("level", "cm")
    assert role_of("Mean Vel. (ft/s)") == ("u", "ft/s")
    assert role_of("remark") is None
    assert role_of("Water Surface Type") is None


def test_a_frame_turns_there_and_back() -> None:
    x, y = FRAME.to_model(*FRAME.to_map(12.5, -3.0))
    assert (x, y) == pytest.approx((12.5, -3.0))
    assert FRAME.to_map(0.0, 0.0) == FRAME.origin
    north = Frame(origin=(0.0, 0.0), angle=90.0)
    assert north.to_map(10.0, 0.0) == pytest.approx((0.0, 10.0))
    assert north.turned_to_model(0.0, 1.0) == pytest.approx((1.0, 0.0))


def test_directions_with_speeds_become_components(tmp_path: Path) -> None:
    """A speed that heads east-north-east, 58 degrees from north, runs along a channel at 32 degrees from east."""
    (tmp_path / "a.csv").write_text("easting;northing;speed;direction\n683130;247480;50;58\n", encoding="utf-8")
    from vegglue.importers.measured_rows import Placement, in_the_channel

    words = read_file_options({"units": {"speed": "cm/s"}}, "a")
    taken = in_the_channel(read_rows(tmp_path / "a.csv", words), Placement(FRAME), words)
    assert taken.numbers["u"][0] == pytest.approx(0.5)
    assert taken.numbers["v"][0] == pytest.approx(0.0, abs=1e-9)


def test_nines_that_may_be_a_mark_are_said_and_kept(tmp_path: Path) -> None:
    rows = "x;y;u [cm/s];level [m]\n1;0;35,1;9,99\n1;1;99,99;9,99\n1;2;-999;9,99\n"
    (tmp_path / "v.csv").write_text(rows, encoding="utf-8")
    taken = read_rows(tmp_path / "v.csv", FileOptions())
    assert [words for words in taken.notes if "no value" in words] == [
        "kept 99.99 in u [cm/s] (if it marks no value, say `missing: [99.99]`)", "1 mark for no value in u [cm/s]",
    ]  # fmt: skip
    assert taken.numbers["u"][1] == pytest.approx(0.9999)
    assert np.isnan(read_rows(tmp_path / "v.csv", FileOptions(missing=(99.99,))).numbers["u"][1])


TWO = "experiments: {12 May: {discharge: 0.6, level: 0.5}, 3 June: {discharge: 2.0, level: 0.95}}\n"
SURVEYED = "Survey;Remark;x (m);y (m);u (cm/s)\n12 May;;8;0;21\n3 June;;8;0;40\n"


def test_a_column_of_names_of_experiments_is_known_by_what_it_holds(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "brook", CHANNEL + TWO, adv__csv=SURVEYED)
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    table = read_observations(case).table
    assert dict(zip(table["experiment"], table["value"], strict=True)) == {"12 May": 0.21, "3 June": 0.40}
    assert case.imported is not None
    assert "experiment from Survey" in case.imported[0].taken


def test_a_file_of_the_usual_name_need_not_name_the_only_experiment(tmp_path: Path) -> None:
    """The config named such a file as it was, and every command after `import` refused it."""
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, velocities__csv="section,x,y,u,u_se\nA,4,0,0.4,0.01\n")
    table = read_observations(vegglue.import_folder(folder, tmp_path / "brook.yaml")).table
    assert table[["experiment", "section", "value"]].to_numpy().tolist() == [["June", "A", 0.4]]


def test_rows_of_no_experiment_are_refused_with_the_line_to_write(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "brook", CHANNEL + TWO, adv__csv=SURVEYED.replace("12 May;", "May;"))
    with pytest.raises(InputError, match=r"under `files`, `adv\.csv: \{experiment: 12 May\}`"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


@pytest.mark.parametrize(("heading", "errors"), [("SE (cm/s)", [0.008, 0.008]), ("u_se (cm/s)", [0.008, np.nan])])
def test_an_error_of_the_velocity_is_that_of_both_components(tmp_path: Path, heading: str, errors: list[float]) -> None:
    table = f"x;y;Vx (cm/s);Vy (cm/s);{heading}\n8;0;21;1;0.8\n"
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, adv__csv=table), tmp_path / "brook.yaml")
    found = read_observations(case).table
    assert found["kind"].tolist() == ["velocity", "velocity_across"]
    assert found["standard_error"].tolist() == pytest.approx(errors, nan_ok=True)


def test_import_says_which_measurements_lack_errors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    folder_of(tmp_path / "brook", CHANNEL + JUNE, adv__csv="x;y;Vx (cm/s)\n8;0;21\n")
    code, told = said_to(monkeypatch, capsys, "import", "brook", "--quiet")
    assert code == 0
    assert told.startswith("`infer`, `diagnose` and `run` will refuse this: "), "as `check` says"
    assert "no standard error is stated for 1 of velocity, the first at x = 8, y = 0 m: add a column `u_se`" in told
    assert "`files: {NAME.csv: {standard_error: 0.015 m/s}}`" in told, "in a unit of what lacks them"


@pytest.mark.parametrize(("slope", "beyond"), [(1.0, 0.2), (0.5, 0.2), (0.15, 0.075)])
def test_flat_banks_of_a_channel_are_banks(tmp_path: Path, slope: float, beyond: float) -> None:
    site = CHANNEL.replace("v_per_h: 0.5", f"v_per_h: {slope}") + JUNE
    case = vegglue.import_folder(folder_of(tmp_path / "b", site, a__csv="x,y,u\n8,0,0.4\n"), tmp_path / "b.yaml")
    assert [zone.beyond_slope_break for zone in case.friction.zones] == [beyond]
    cells = build_site(case)
    outside = cells.friction_class == cells.class_names.index("bank")
    assert outside[:, np.abs(cells.grid.y) > 1.5].all()
    assert not outside[:, np.abs(cells.grid.y) < 1.4].any()
