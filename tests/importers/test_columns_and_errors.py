"""Columns are what their headings say, every reading counts once, and stated errors arrive with their values."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from field_folders import CHANNEL, JUNE, folder_of

import vegglue
from vegglue.case.schema import Case
from vegglue.errors import InputError
from vegglue.importers.file_options import FileOptions
from vegglue.importers.measured_rows import read_rows
from vegglue.measurements.observations import read_observations


def test_two_files_of_one_stem_have_tables_of_their_own(tmp_path: Path) -> None:
    """The second wrote over the first, and was then read twice."""
    first, second = "x;y;level\n8;0;0.95\n", "x\ty\tlevel\n20\t0\t0.94\n"
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, gauge__csv=first, gauge__txt=second, Gauge__dat=first)
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    assert len({one.file.name.lower() for one in case.observations}) == 3
    assert sorted(read_observations(case).table["value"]) == [0.94, 0.95, 0.95]


@pytest.mark.parametrize("heading", ["x;y;Ve;Vn;Speed;Direction", "x;y;u;v;Speed;Direction"])
def test_a_speed_beside_its_components_is_no_further_observation(tmp_path: Path, heading: str) -> None:
    """One reading was three observations; a row that has a speed alone keeps it."""
    table = f"{heading}\n8;0;0.4;0.03;0.401;86\n8;1;0.4;0.03;0.401;86\n20;1;;;0.43;\n"
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=table), tmp_path / "brook.yaml")
    found = read_observations(case).table
    assert found["kind"].value_counts().to_dict() == {"velocity": 2, "velocity_across": 2, "speed": 1}
    assert case.imported is not None
    assert "speed not taken again beside its components" in case.imported[0].taken


def verticals_of(tmp_path: Path, said: str, error: str) -> pd.DataFrame:
    """Stations of two verticals; a cell of v is empty in the first, all of them in the second."""
    rows = [f"8,{y},{z},{u},{v},{error}" for y in (0, 1) for z, u, v in (
        (0.1, 0.4, "0.02" if y == 0 else ""), (0.3, 0.5, ""), (0.6, 0.6, "0.02" if y == 0 else ""))]  # fmt: skip
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE + said, adv__csv="\n".join(["x,y,z,u,v,u_se", *rows]))
    return read_observations(vegglue.import_folder(folder, tmp_path / "brook.yaml")).table


def test_points_without_a_second_component_cost_no_other_its_own(tmp_path: Path) -> None:
    """One empty cell dropped all velocities across."""
    table = verticals_of(tmp_path, "", "0.01")
    across = table[table["kind"] == "velocity_across"]
    assert across["y"].tolist() == [0.0]
    assert across["value"].item() == pytest.approx(0.02, rel=0.05)  # what both points read
    assert len(table[table["kind"] == "velocity"]) == 2


def brook_with(tmp_path: Path, *points: str) -> Case:
    """The brook, imported with these points x,y,z,u,u_se."""
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, adv__csv="\n".join(["x,y,z,u,u_se", *points]))
    return vegglue.import_folder(folder, tmp_path / "brook.yaml")


def test_verticals_of_one_point_stand_beside_those_of_two(tmp_path: Path) -> None:
    """As is usual where water is shallow; their table was taken for repeats of depth averages."""
    single = [f"8,{y},0.4,0.5,0.01" for y in (-1, 1, 1.2)]
    double = [f"8,{y},{z},{u},0.01" for y in (-0.5, 0, 0.5) for z, u in ((0.2, 0.45), (0.8, 0.6))]
    found = read_observations(brook_with(tmp_path, *single, *double))
    assert found.profiles.sort_values("y")["points"].tolist() == [1, 2, 2, 2, 1, 1]
    # Two points leave 3.5 % open, one 7.5 %.
    assert (found.table["standard_error"] / found.table["value"]).between(0.03, 0.09).all()


def test_a_point_measured_again_is_averaged_with_itself(tmp_path: Path) -> None:
    """It was written twice, and `check` refused the table that import had made."""
    points = [f"8,{y},{z},{u},0.02" for y in (0, 1) for z, u in ((0.1, 0.4), (0.3, 0.5), (0.6, 0.6))]
    case = brook_with(tmp_path, *points, "8,0,0.1,0.44,0.02", "8,0,0.1,0.42,0.02", "8,0,0.1,0.42,0.02")
    assert case.imported is not None
    assert "6 points of 1 section, 3 repeats averaged" in case.imported[0].taken
    again = read_observations(case).points.query("y == 0 and z == 0.1")
    assert again["u"].tolist() == pytest.approx([0.42])
    assert again["standard_error"].tolist() == pytest.approx([0.01])


def test_heights_above_the_bed_are_those_of_points(tmp_path: Path) -> None:
    """Of a probe on a stand, which knows no datum: two verticals on the floor, one on the bank."""
    points = [f"8,{y},{height},{0.3 + 0.1 * height}" for y in (0, 1, 2) for height in (0.05, 0.15, 0.3)]
    table = "\n".join(["x,y,Height above bed [m],u", *points])
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, adv__csv=table), tmp_path / "brook.yaml")
    found = read_observations(case)
    assert found.points["height"].tolist() == pytest.approx([0.05, 0.15, 0.3] * 3)
    assert found.points["used"].all()
    bank = found.points[found.points["y"] == 2.0]
    assert (bank["z"] - bank["height"] > found.points["z"].min()).all(), "the bed of the bank lies higher"


def test_the_level_of_the_bed_is_no_height_of_a_point(tmp_path: Path) -> None:
    """Readings of one place with the bed below each: repeats, and no vertical."""
    table = "\n".join(["x,y,Bed level,u", *(f"8,{y},{bed},0.4" for y in (0, 1) for bed in (0.01, 0.03))])
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, adv__csv=table), tmp_path / "brook.yaml")
    assert read_observations(case).table["value"].tolist() == [0.4, 0.4]
    assert case.imported is not None
    assert "2 of velocity, 2 repeats averaged" in case.imported[0].taken


def test_stated_errors_of_points_in_the_vertical_count(tmp_path: Path) -> None:
    """Neither the column nor the site file did: all had the error of a minute of usual turbulence."""
    errors = []
    for name, said, column in (
        ("a", "", ""),
        ("b", "", "0.1"),
        ("c", "files: {adv.csv: {standard_error: 10 cm/s}}\n", ""),
    ):
        (tmp_path / name).mkdir()
        table = verticals_of(tmp_path / name, said, column)
        errors.append(table.loc[table["kind"] == "velocity", "standard_error"].to_numpy(float))
    usual, of_column, of_site = errors
    assert (of_column > 2.0 * usual).all()
    assert np.allclose(of_site, of_column)


@pytest.mark.parametrize(
    ("table", "errors"),
    [
        ("x;y;level;SE\n8;0;0.95;0.002\n", [0.002]),
        ("x;y;level;SE (mm)\n8;0;0.95;2\n", [0.002]),
        ("x;y;Speed;SE\n8;0;0.4;0.01\n", [0.01]),
        ("x;y;Speed;Direction;SE\n8;0;0.4;80;0.01\n", [0.01, 0.01]),
        ("x;Q;standard error\n8;2;0.1\n", [0.1]),
    ],
)
def test_an_error_without_a_name_is_of_what_the_table_holds(tmp_path: Path, table: str, errors: list[float]) -> None:
    """It was taken for that of u, and dropped."""
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=table), tmp_path / "brook.yaml")
    assert read_observations(case).table["standard_error"].tolist() == pytest.approx(errors)


@pytest.mark.parametrize(
    ("headings", "wanted"),
    [
        ("x,N,y,u", {"x": 0, "y": 2, "u": 3}),
        ("x,N,u", {"x": 0, "u": 2}),
        ("E,N,u", {"x": 0, "y": 1, "u": 2}),
        ("E (m),N (m),x,y,u", {"x": 0, "y": 1, "u": 4}),
        ("N,Easting,u", {"x": 1, "y": 0, "u": 2}),
        ("N,Easting,Northing,u", {"x": 1, "y": 2, "u": 3}),
        ("x,y,bed elevation,z,u", {"x": 0, "y": 1, "z_bed": 2, "z": 3, "u": 4}),
        ("x,y,bed_elevation_m", {"x": 0, "y": 1, "z_bed": 2}),
        ("x,y,Vel,Vx,Vy", {"x": 0, "y": 1, "u": 3, "v": 4}),
        ("x,y,Vel (cm/s)", {"x": 0, "y": 1, "u": 2}),
    ],
)
def test_a_name_that_says_less_yields(tmp_path: Path, headings: str, wanted: dict[str, int]) -> None:
    """The number of samples was y, the bed the height of a point, and the magnitude the velocity along."""
    numbers = ",".join(str(1 + place) for place in range(headings.count(",") + 1))
    (tmp_path / "a.csv").write_text(f"{headings}\n{numbers}\n{numbers}.5\n", encoding="utf-8")
    taken = read_rows(tmp_path / "a.csv", FileOptions())
    assert taken.columns == {role: headings.split(",")[place] for role, place in wanted.items()}


def test_north_is_known_beside_a_column_named_as_x(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("Ost,N,u\n1,2,3\n4,5,6\n", encoding="utf-8")
    assert set(read_rows(tmp_path / "a.csv", FileOptions(columns={"x": "Ost"})).numbers) == {"x", "y", "u"}


@pytest.mark.parametrize(
    ("table", "role", "error"),
    [
        ("x,y,U [cm/s],u_se\n1,2,40,0.3\n", "u_se", 0.003),
        ("x,y,U [cm/s],u_se [m/s]\n1,2,40,0.003\n", "u_se", 0.003),
        ("x,y,Ve (cm/s),Vn (cm/s),SE\n1,2,40,3,0.3\n", "v_se", 0.003),
        ("x,y,level [mm],SE\n1,2,950,2\n", "level_se", 0.002),
        ("x,y,u,u_se\n1,2,0.4,0.003\n", "u_se", 0.003),
    ],
)
def test_an_error_without_a_unit_has_that_of_its_values(tmp_path: Path, table: str, role: str, error: float) -> None:
    """0.3 beside U [cm/s] was 0.3 m/s."""
    (tmp_path / "a.csv").write_text(table, encoding="utf-8")
    assert read_rows(tmp_path / "a.csv", FileOptions()).numbers[role].tolist() == pytest.approx([error])


def test_an_error_follows_the_unit_that_the_site_file_says(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x,y,u,u_se\n1,2,40,0.3\n", encoding="utf-8")
    taken = read_rows(tmp_path / "a.csv", FileOptions(units={"u": "cm/s"}))
    assert taken.numbers["u_se"].tolist() == pytest.approx([0.003])
    assert taken.units["u_se"] == "cm/s"


@pytest.mark.parametrize(
    ("heading", "level"),
    [("WL (cm ü. Sohle)", 0.95), ("WL [cm above datum]", 0.95), ("WL (in cm)", 0.95), ("WL (m a.s.l.)", 95.0)],
)
def test_a_unit_may_have_words_behind_it(tmp_path: Path, heading: str, level: float) -> None:
    """Levels in cm above the floor were read as metres."""
    (tmp_path / "a.csv").write_text(f"x;y;{heading}\n1;2;95\n2;2;95\n", encoding="utf-8")
    assert read_rows(tmp_path / "a.csv", FileOptions()).numbers["level"].tolist() == pytest.approx([level, level])


@pytest.mark.parametrize(
    ("headings", "columns"),
    [
        ("Longitude (deg),Latitude (deg)", {"x": "Longitude (deg)", "y": "Latitude (deg)"}),
        ("lon,lat", {"x": "lon", "y": "lat"}),
        ("x [°],y [°]", {}),
        ("Longitude,Latitude", {}),
    ],
)
def test_places_in_degrees_are_refused(tmp_path: Path, headings: str, columns: dict[str, str]) -> None:
    """Degrees were read as metres: 63 stations of a transect became 2."""
    site = CHANNEL + JUNE + f"files: {{a.csv: {{columns: {json.dumps(columns)}}}}}\n"
    folder = folder_of(tmp_path / "brook", site, a__csv=f"{headings},u\n8.5417,47.3769,0.4\n8.5418,47.3769,0.5\n")
    with pytest.raises(InputError, match="degrees; convert longitudes and latitudes to metres"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


def test_columns_that_are_not_read_are_said(tmp_path: Path) -> None:
    """An error headed `sd` was dropped, and nothing said so."""
    table = "no;exp;x;y;u;sd;Remark\n1;June;8;0;0.4;0.01;\n2;June;9;0;0.4;0.01;weed\n"
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, adv__csv=table), tmp_path / "brook.yaml")
    assert case.imported is not None
    assert case.imported[0].taken.endswith("2 rows; not read: no, sd and Remark")


def test_names_of_sections_that_are_not_used_are_told(tmp_path: Path) -> None:
    """Below a merged cell rows have none, and then all sections were called by their x, unsaid."""
    table = "section;x;y;u\nA;8;0;0.4\n;8;1;0.5\nB;20;0;0.5\n"
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=table), tmp_path / "brook.yaml")
    assert case.imported is not None
    assert "sections told by x, as 1 row lacks its name" in case.imported[0].taken


@pytest.mark.parametrize(
    ("headings", "number", "kept"),
    [
        ("x,y,u", "7777", False),
        ("x,y,u (mm/s)", "-8888", False),
        ("x,y,level", "7777", False),
        ("x,y,level (mm)", "7777", True),
        ("x,y,level (ft)", "7777", True),
        ("u,y,x", "7777", True),
        ("x,y,depth (cm)", "8888", False),
        ("x,y,discharge", "7777", True),
    ],
)
def test_sevens_and_eights_are_marks_where_nothing_measured_is_so_large(
    tmp_path: Path, headings: str, number: str, kept: bool
) -> None:
    """A check doubted them, an import kept them."""
    (tmp_path / "a.csv").write_text(f"{headings}\n1,2,0.4\n2,2,{number}\n", encoding="utf-8")
    taken = read_rows(tmp_path / "a.csv", FileOptions())
    last = list(taken.numbers)[-1]
    assert np.isfinite(taken.numbers[last]).tolist() == [True, kept]
    assert any("1 mark for no value" in one for one in taken.notes) == (not kept)
