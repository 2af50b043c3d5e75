"""Where velocities stand: across the channel, above the bed, in which section and experiment; or a refusal."""

from pathlib import Path

import numpy as np
import pytest
from field_folders import CHANNEL, JUNE, Imported, field_folder, folder_of, import_of, imported, refusal, refusal_of

import vegglue
from vegglue.case.site_schema import Frame
from vegglue.errors import InputError
from vegglue.importers.file_options import FileOptions
from vegglue.importers.measured_rows import Placement, in_the_channel, read_rows
from vegglue.measurements.observations import read_observations

WADING = "Chainage (m);Dist. from left bank (m);Velocity (m/s)\n10;0.5;0.41\n10;1.5;0.52\n18;0.5;0.40\n"
FROM_THE_BANK = '{columns: {y: "Dist. from left bank (m)"}, flip: y, zero: [1, 250 cm]}'
TAPE = "{line: [[8, 2], [8, -2]]}"


def entry(options: str) -> str:
    return CHANNEL + JUNE + f"files: {{a.csv: {options}}}\n"


@pytest.mark.parametrize(
    "heading", ["Dist. from left bank (m)", "Rive gauche [cm]", "Distance", "Punkt, m", "y/B", "Depth (m)"]
)
def test_velocities_of_a_section_are_no_repeats_on_its_axis(tmp_path: Path, heading: str) -> None:
    """70 velocities of a wading survey became 7 on the axis, with their scatter across as errors."""
    table = f"Chainage (m);{heading};Velocity (m/s)\n10;0.5;0.41\n10;1.5;0.52\n18;0.5;0.40\n"
    error = refusal_of(tmp_path, wading__csv=table)
    assert "wading.csv" in error
    assert "x = 10 m" in error
    assert repr(heading) in error


@pytest.mark.parametrize(
    "table",
    [
        "x;time (s);u\n10;1;0.41\n10;2;0.52\n",
        "x;Probe (cm);u\n10;3.5;0.41\n10;3.5;0.52\n18;4;0.5\n",
        "x;Remark (m);u\n10;at the pole;0.41\n10;later;0.52\n",
    ],
)
def test_repeats_on_the_axis_are_averaged_and_reported(tmp_path: Path, table: str) -> None:
    found = import_of(tmp_path, adv__csv=table)
    assert set(found.table["y"]) == {0.0}
    assert "1 repeat" in found.taken["adv.csv"]
    assert "y = 0 " in found.taken["adv.csv"]


@pytest.mark.parametrize(
    ("options", "table", "places"),
    [
        (FROM_THE_BANK, WADING, [(11, 2.0), (11, 1.0), (19, 2.0)]),
        ("{zero: [0, -1]}", "x;y;u\n1;0.5;0.4\n", [(1, -0.5)]),
        ("{zero: [0, -1]}", "x;u\n1;0.4\n", [(1, -1)]),
        ("{x: 12 m}", "y;u\n-1;0.4\n1;0.5\n", [(12, -1), (12, 1)]),
        (TAPE, "Distance (m);Velocity\n0.5;0.4\n1;0.5\n", [(8, 1.5), (8, 1)]),
        (TAPE, "DMG (m);Depth (m);Mean Speed (m/s)\n0.5;1;0.4\n1;1;0.5\n", [(8, 1.5), (8, 1)]),
    ],
)
def test_the_site_file_gives_a_table_its_places(
    tmp_path: Path, options: str, table: str, places: list[tuple[float, float]]
) -> None:
    found = import_of(tmp_path, entry(options), a__csv=table).table
    assert found[["x", "y"]].to_numpy() == pytest.approx(np.array(places, dtype=float))


@pytest.mark.parametrize(
    ("options", "table", "key"),
    [
        (TAPE, "y;u\n1;0.4\n", "line"), (TAPE, "when;u\n1;0.4\n", "tape"), ("{x: 8}", "x;y;u\n1;1;0.4\n", "`x`"),
        ("{zero: [0, 1], coordinates: map}", "x;y;u\n1;1;0.4\n", "zero"), ("{zero: 3}", "x;y;u\n1;1;0.4\n", "zero"),
    ],
)  # fmt: skip
def test_options_of_places_that_make_no_sense_are_refused(tmp_path: Path, options: str, table: str, key: str) -> None:
    assert key in refusal_of(tmp_path, entry(options), a__csv=table)


def test_depths_of_a_wading_sheet_are_not_read(tmp_path: Path) -> None:
    found = import_of(tmp_path, a__csv="x;y;Depth (m);Velocity (m/s)\n10;-1;0.8;0.41\n10;0;0.9;0.52\n")
    assert found.taken["a.csv"].endswith("not read: Depth (m)")
    assert "depth" not in (found.case.imported or ())[0].columns


def test_depths_that_read_as_names_of_experiments_are_depths(tmp_path: Path) -> None:
    site = CHANNEL + "experiments: {'1': {discharge: 1, level: 0.8}, '2': {discharge: 2, level: 1}}\n"
    assert "a.csv" in refusal_of(tmp_path, site, a__csv="x;y;depth;u\n10;-1;1;0.41\n10;0;2;0.52\n")


def test_verticals_beside_a_survey_are_refused_with_both_places(tmp_path: Path) -> None:
    survey = "x;y;z\n" + "".join(f"{x};{y};{abs(y - 3) / 4}\n" for x in (0, 20) for y in range(7))
    rows = "".join(f"10;{y};{height};0.4\n" for y in (2, 3, 4) for height in (0.1, 0.2))
    points = f"x;Dist. from left bank (m);height above bed;u\n{rows}"
    options = "zero: [0, 16], flip: y, columns: {y: 'Dist. from left bank (m)'}"
    site = f"bed: {{file: bed.csv, sections: true}}\n{JUNE}files: {{adv.csv: {{{options}}}}}\n"
    error = refusal(folder_of(tmp_path / "brook", site, bed__csv=survey, adv__csv=points))
    assert "adv.csv" in error
    assert "y = 0 and 6 m" in error
    assert "y = 12 m" in error


DEPTH = 0.9
# A log law over k_s = 0.03 m with u* = 0.05 m/s: u(z) = 2.5 u* ln(30 z / k_s); its mean is 2.5 u* (ln(30 h / k_s) - 1).
MEAN = 0.125 * (np.log(30.0 * DEPTH / 0.03) - 1.0)


def verticals(heading: str, *columns: str, unit: float = 1.0) -> str:
    """Four heights at four places; `columns` from z above the bed: `below`, `share`, `water`."""
    of = {
        "above": lambda z: unit * z,
        "below": lambda z: DEPTH - z,
        "share": lambda z: z / DEPTH,
        "water": lambda z: DEPTH,
    }
    rows = [
        ";".join(f"{value:.5f}" for value in (x, y, *(of[one](z) for one in columns), 0.125 * np.log(30.0 * z / 0.03)))
        for x in (8, 20)
        for y in (-0.5, 0.5)
        for z in (0.1, 0.3, 0.5, 0.7)
    ]
    return "\n".join([f"x;y;{heading};u", *rows])


@pytest.mark.parametrize(
    ("heading", "columns"),
    [
        ("depth", ["below"]), ("Depth below surface (m)", ["below"]), ("Messtiefe", ["below"]), ("hoogte", ["share"]),
        ("Profundidad [m]", ["below"]), ("Abstand Sohle [m]", ["above"]), ("Messhöhe [m]", ["above"]),
        ("dist. to bed", ["above"]), ("rel. depth", ["share"]), ("z/h", ["share"]),
        ("Tiefe [m];Wassertiefe [m]", ["below", "water"]),
    ],
)  # fmt: skip
def test_heights_that_are_not_known_are_asked_for(tmp_path: Path, heading: str, columns: list[str]) -> None:
    """Four points of a vertical were averaged as four repeats of one depth average, with their shear as its error."""
    error = refusal_of(tmp_path, a__csv=verticals(heading, *columns))
    assert "a.csv" in error
    assert any(repr(one) in error for one in heading.split(";"))


@pytest.mark.parametrize("heading", ["Water depth;Measurement depth", "h [m];Distance from surface [m]"])
def test_depths_below_the_surface_are_heights_above_the_bed(tmp_path: Path, heading: str) -> None:
    found = import_of(tmp_path, a__csv=verticals(heading, "water", "below"))
    assert (tmp_path / "brook0-data" / "a.csv").read_text(encoding="utf-8").startswith("case,device,x,y,height,u\n")
    assert found.values() == pytest.approx([MEAN] * 4, rel=0.02)


@pytest.mark.parametrize(
    "heading", ["Sohlabstand [m]", "Abstand von der Sohle [m]", "Höhe ü. Sohle", "hoehe ueber sohle"]
)
def test_heights_above_the_bed_are_known_in_german(tmp_path: Path, heading: str) -> None:
    case = vegglue.import_folder(
        folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=verticals(heading, "above")), tmp_path / "brook.yaml"
    )
    assert (case.imported or ())[0].columns["height"] == heading


def test_a_depth_of_the_water_that_stands_once_is_asked_for(tmp_path: Path) -> None:
    rows = (f"{x};0;{depth};{below};0.4" for x in (8, 20) for depth, below in ((0.9, 0.2), ("", 0.7)))
    error = refusal_of(tmp_path, a__csv="\n".join(["x;y;water depth;measurement depth;u", *rows]))
    assert "'measurement depth'" in error


def test_a_depth_of_the_water_that_is_read_again_is_no_height(tmp_path: Path) -> None:
    found = import_of(tmp_path, a__csv="x;y;depth;u\n8;0;0.90;0.4\n8;0;0.93;0.42\n20;0;0.5;0.4\n")
    assert found.values() == [0.41, 0.4]


def test_heights_in_another_unit_are_refused_with_what_came(tmp_path: Path) -> None:
    """Heights in cm under `Height above bed`."""
    folder = folder_of(tmp_path / "b", CHANNEL + JUNE, a__csv=verticals("Height above bed", "above", unit=100.0))
    with pytest.raises(InputError, match="10 to 70 m above"):
        read_observations(vegglue.import_folder(folder, tmp_path / "brook.yaml"))


@pytest.mark.parametrize("heading", ["height above bed", "z above bed"])
def test_heights_that_are_not_used_are_reported(tmp_path: Path, heading: str) -> None:
    rows = "".join(f"8;{y};0.1;0.4\n" for y in (-1, 0, 1))
    taken = import_of(tmp_path, a__csv=f"x;y;{heading};u\n{rows}").taken["a.csv"]
    assert taken.startswith("3 of velocity, ")
    assert "height not used" in taken


@pytest.mark.parametrize(("below", "average"), [(0.54, True), (0.81, False)])
def test_a_point_at_four_tenths_of_the_depth_is_its_average(tmp_path: Path, below: float, average: bool) -> None:
    rows = "".join(f"8;{y};{DEPTH};{below};0.4\n" for y in (-1, 0, 1))
    found = import_of(tmp_path, a__csv=f"x;y;Water depth;Measurement depth;u\n{rows}")
    assert ("not used" in found.taken["a.csv"]) != average
    assert found.values() == [0.4, 0.4, 0.4]


def points_of(tmp_path: Path, *points: str, site: str = CHANNEL + JUNE, heading: str = "x,y,z,u,u_se") -> Imported:
    return import_of(tmp_path, site, adv__csv="\n".join([heading, *points]))


def test_points_without_a_second_component_cost_no_other_its_own(tmp_path: Path) -> None:
    """One empty cell dropped all velocities across."""
    rows = [f"8,{y},{z},{u},{v},0.01" for y in (0, 1) for z, u, v in (
        (0.1, 0.4, "0.02" if y == 0 else ""), (0.3, 0.5, ""), (0.6, 0.6, "0.02" if y == 0 else ""))]  # fmt: skip
    table = points_of(tmp_path, *rows, heading="x,y,z,u,v,u_se").table
    across = table[table["kind"] == "velocity_across"]
    assert across["y"].tolist() == [0.0]
    assert across["value"].item() == pytest.approx(0.02, rel=0.05)  # what both points read
    assert len(table[table["kind"] == "velocity"]) == 2


def test_verticals_of_one_point_stand_beside_those_of_two(tmp_path: Path) -> None:
    """As is usual in shallow water; their table was taken for repeats of depth averages."""
    single = [f"8,{y},0.4,0.5,0.01" for y in (-1, 1, 1.2)]
    double = [f"8,{y},{z},{u},0.01" for y in (-0.5, 0, 0.5) for z, u in ((0.2, 0.45), (0.8, 0.6))]
    found = read_observations(points_of(tmp_path, *single, *double).case)
    assert found.profiles.sort_values("y")["points"].tolist() == [1, 2, 2, 2, 1, 1]
    # Two points leave 3.5 % open, one 7.5 %.
    assert (found.table["standard_error"] / found.table["value"]).between(0.03, 0.09).all()


def test_a_point_measured_again_is_averaged_with_itself(tmp_path: Path) -> None:
    points = [f"8,{y},{z},{u},0.02" for y in (0, 1) for z, u in ((0.1, 0.4), (0.3, 0.5), (0.6, 0.6))]
    found = points_of(tmp_path, *points, "8,0,0.1,0.44,0.02", "8,0,0.1,0.42,0.02", "8,0,0.1,0.42,0.02")
    assert found.taken["adv.csv"].startswith("6 points of 1 section, 3 repeats")
    again = read_observations(found.case).points.query("y == 0 and z == 0.1")
    assert again["u"].tolist() == pytest.approx([0.42])
    assert again["standard_error"].tolist() == pytest.approx([0.01])


def test_heights_above_the_bed_are_those_of_points(tmp_path: Path) -> None:
    """Of a probe on a stand, which knows no datum: two verticals on the floor, one on the bank."""
    points = [f"8,{y},{height},{0.3 + 0.1 * height}" for y in (0, 1, 2) for height in (0.05, 0.15, 0.3)]
    found = read_observations(points_of(tmp_path, *points, heading="x,y,Height above bed [m],u").case)
    assert found.points["height"].tolist() == pytest.approx([0.05, 0.15, 0.3] * 3)
    assert found.points["used"].all()
    bank = found.points[found.points["y"] == 2.0]
    assert (bank["z"] - bank["height"] > found.points["z"].min()).all(), "the bed of the bank lies higher"


def test_stated_errors_of_points_in_the_vertical_count(tmp_path: Path) -> None:
    errors = []
    for more, column in (("", ""), ("", "0.1"), ("files: {adv.csv: {standard_error: 10 cm/s}}\n", "")):
        rows = [f"8,{y},{z},{u},{column}" for y in (0, 1) for z, u in ((0.1, 0.4), (0.3, 0.5), (0.6, 0.6))]
        errors.append(points_of(tmp_path, *rows, site=CHANNEL + JUNE + more).table["standard_error"].to_numpy(float))
    usual, of_column, of_site = errors
    assert (of_column > 2.0 * usual).all()
    assert np.allclose(of_site, of_column)


MAY = "experiments: {May: {discharge: 1500 l/s, level: 90 cm}, June: {discharge: 2000 l/s, level: 95 cm}}\n"
# Two sections of a total station, some centimetres off their lines.
OFF = 0.01 * np.array([3.1, -4.2, 0.7, 5.3, -2.6, 1.9, -6.4, 4.4, -0.8, 2.2])
SCATTERED = [(x + off, y) for (x, y), off in zip([(x, y) for x in (12, 18) for y in range(-2, 3)], OFF, strict=True)]


def sections_of(tmp_path: Path, heading: str, rows: list[str], site: str = CHANNEL + JUNE) -> tuple[list[str], str]:
    """Sections of the stations of a table, and what was taken from it."""
    found = import_of(tmp_path, site, adv__csv="\n".join([heading, *rows]) + "\n")
    return found.table["section"].astype(str).tolist(), found.taken["adv.csv"]


def test_scattered_places_are_sections_also_if_two_experiments_share_them(tmp_path: Path) -> None:
    rows = [f"{name};{x:.3f};{y};0.4" for name in ("May", "June") for x, y in SCATTERED]
    assert set(sections_of(tmp_path, "experiment;x;y;u", rows, CHANNEL + MAY)[0]) == {"x12.01", "x18.02"}


def test_scattered_verticals_are_sections(tmp_path: Path) -> None:
    rows = [f"{x:.3f};{y};{z};{0.3 + z}" for x, y in SCATTERED if abs(y) < 2 for z in (0.1, 0.2, 0.3, 0.4)]
    names, taken = sections_of(tmp_path, "x;y;height above bed;u", rows)
    assert sorted(map(names.count, set(names))) == [3, 3]
    assert "0.056 m" in taken, "moved so far to the line of their section"


@pytest.mark.parametrize("heights", [1, 5])
def test_what_lies_along_the_channel_is_no_section(tmp_path: Path, heights: int) -> None:
    """Places 0.2 m apart on the axis were one section of 8 m."""
    rows = [f"{10 + 0.2 * i:.1f};0;{0.1 * (j + 1):.1f};0.4" for i in range(40) for j in range(heights)]
    assert len(set(sections_of(tmp_path, "x;y;height above bed;u", rows)[0])) == 40


def test_equal_places_on_many_lines_are_sections_however_near(tmp_path: Path) -> None:
    rows = [f"{10 + 0.1 * i:.1f};{y};0.4" for i in range(6) for y in (-1, 0, 1)]
    assert len(set(sections_of(tmp_path, "x;y;u", rows)[0])) == 6


LEVELS = ["P1;5;0;0.97", "P2;25;0;0.95"]


@pytest.mark.parametrize(
    ("heading", "rows", "sections", "unread"),
    [
        ("Gauge;x;y;level", LEVELS, ["P1", "P2"], False),
        ("Section;Gauge;x;y;level", [f"A;{row}" for row in LEVELS], ["A", "A"], True),
        ("Gauge;x;y;u", ["P1;5;0;0.4", "P1;25;0;0.5"], ["x5.00", "x25.00"], True),
        ("section;x;y;u", ["A;8;0;0.4", ";8;1;0.5", "B;20;0;0.5"], ["x8.00", "x8.00", "x20.00"], False),
    ],
)
def test_a_gauge_names_levels_and_no_section_of_velocities(
    tmp_path: Path, heading: str, rows: list[str], sections: list[str], unread: bool
) -> None:
    names, taken = sections_of(tmp_path, heading, rows)
    assert names == sections
    assert taken.endswith("not read: Gauge") == unread


def test_a_column_of_readings_of_a_gauge_is_not_taken_for_its_name(tmp_path: Path) -> None:
    site = CHANNEL + JUNE + "files: {adv.csv: {columns: {level: Gauge}}}\n"
    assert sections_of(tmp_path, "x;y;Gauge", ["5;0;0.97", "25;0;0.95"], site)[0] == ["x5.00", "x25.00"]


CONVERTED = "experiment;section;x;y;u [cm/s]\nlow;A;12;0,5;45\n{};B;14;0,5;46\n"
PLAIN = "experiment,section,x,y,u,u_se\nlow,A,12,0.5,0.45,0.01\nflood,A,14,0.5,0.46,0.01\n"
FLOW = {"discharge_m3_s": 1.2, "downstream_level_m": 0.72}
HELD = "experiment,section,x,y,u\nhigh,A,12,0.5,0.6\nflood,A,14,0.5,0.6\n"


@pytest.mark.parametrize(
    ("name", "table", "row", "words"),
    [
        ("survey.txt", CONVERTED.format("flood"), 3, "`experiments`"), ("velocities.csv", PLAIN, 3, "`experiments`"),
        ("holdout.csv", HELD, 3, "`holdout`"), ("holdout.csv", HELD.replace(",", ";"), 3, "`holdout`"),
        ("survey.txt", CONVERTED.format("high"), 3, "`holdout`"), ("survey.txt", CONVERTED.format(""), 3, "low"),
        ("levels.csv", "experiment,x,y,level\nlow,2,0,\n", 2, "level"),
    ],
)  # fmt: skip
def test_rows_of_unknown_experiments_are_refused(tmp_path: Path, name: str, table: str, row: int, words: str) -> None:
    """With their own file and row; nothing is written."""
    folder = field_folder(tmp_path / "brook")
    (folder / name).write_text(table, encoding="utf-8")
    error = refusal(folder)
    assert f"brook/{name}, row {row}: " in error
    assert words in error


def test_an_entry_of_files_names_a_known_experiment(tmp_path: Path) -> None:
    folder = field_folder(tmp_path / "brook", files={"velocities.csv": {"experiment": "lo"}})
    assert "`lo`" in refusal(folder)


def test_rows_without_a_value_may_name_any_experiment(tmp_path: Path) -> None:
    folder = field_folder(tmp_path / "brook")
    (folder / "velocities.csv").unlink()  # which holds the same station
    (folder / "survey.txt").write_text(CONVERTED.format("flood").replace("46", "-999"), encoding="utf-8")
    assert imported(folder).values() == [0.45]


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("Messtermin;x;y;u [cm/s]\nLow;12;-1;45\nflood;12;0;45\nflood;12;1;45\n", "'Messtermin'"),
        ("Gauge;x;low;mid\nA;2;0.93;1.04\nB;12;0.92;1.03\n", "low and mid"),
        ("Gauge;x;level low;level mid (m)\nA;2;0.93;1.04\nB;12;0.92;1.03\n", "level low and level mid (m)"),
        ("Gauge;afstand;low;mid\nA;2;0.93;1.04\nB;12;0.92;1.03\n", "low and mid"),
        ("x;y;u;Remarks\n12;0;0.4;\n12;1;0.3;in reeds\n12;2;0.4;\n", "`survey.txt: {experiment: low}`"),
        ("run;debiet [l/s];opmerking\nlow;620;meetschot\nmid;1400;ADCP, 4 raaien\n", "`discharge` of low"),
    ],
)
def test_a_table_that_hides_its_experiments_is_refused_with_what_to_write(
    tmp_path: Path, table: str, words: str
) -> None:
    folder = field_folder(tmp_path / "brook", experiments=dict.fromkeys(("low", "mid"), FLOW))
    (folder / "survey.txt").write_text(table, encoding="utf-8")
    error = refusal(folder)
    assert words in error
    assert "Remarks" not in error


def test_a_column_of_names_of_experiments_is_known_by_what_it_holds(tmp_path: Path) -> None:
    two = "experiments: {12 May: {discharge: 0.6, level: 0.5}, 3 June: {discharge: 2.0, level: 0.95}}\n"
    survey = "Survey;Remark;x (m);y (m);u (cm/s)\n12 May;;8;0;21\n3 June;;8;0;40\n"
    found = import_of(tmp_path, CHANNEL + two, adv__csv=survey).table
    assert dict(zip(found["experiment"], found["value"], strict=True)) == {"12 May": 0.21, "3 June": 0.40}
    error = refusal_of(tmp_path, CHANNEL + two, adv__csv=survey.replace("12 May;", "May;"))
    assert "`adv.csv: {experiment: 12 May}`" in error


def test_a_frame_turns_there_and_back(tmp_path: Path) -> None:
    frame = Frame(origin=(683120.0, 247480.0), angle=32.0)
    assert frame.to_model(*frame.to_map(12.5, -3.0)) == pytest.approx((12.5, -3.0))
    assert frame.to_map(0.0, 0.0) == frame.origin
    north = Frame(origin=(0.0, 0.0), angle=90.0)
    assert north.to_map(10.0, 0.0) == pytest.approx((0.0, 10.0))
    assert north.turned_to_model(0.0, 1.0) == pytest.approx((1.0, 0.0))
    # A speed that heads east-north-east, 58 degrees from north, runs along a channel at 32 degrees from east.
    (tmp_path / "a.csv").write_text("easting;northing;speed;direction\n683130;247480;50;58\n", encoding="utf-8")
    options = FileOptions(units={"speed": "cm/s"})
    taken = in_the_channel(read_rows(tmp_path / "a.csv", options), Placement(frame), options)
    assert (taken.numbers["u"][0], taken.numbers["v"][0]) == pytest.approx((0.5, 0.0), abs=1e-9)


@pytest.mark.parametrize(
    ("options", "heading", "refused"),
    [
        ("{line: [[8, 2], [8, -2]]}", "Distance from right bank (m)", True),
        ("{line: [[8, -2], [8, 2]]}", "Distance from right bank (m)", False),
        ("{line: [[8, -2], [8, 2]]}", "Dist LB (m)", True),
        ("{line: [[8, -2], [8, 2]]}", "Distance from REW (m)", False),
        ("{line: [[8, 2], [8, -2]]}", "Abstand vom linken Ufer (m)", False),
        ('{x: 8, columns: {y: "Dist. from LB (m)"}}', "Dist. from LB (m)", True),
        ('{x: 8, columns: {y: "Dist. from LB (m)"}, flip: y, zero: [0, 2]}', "Dist. from LB (m)", False),
        ('{x: 8, columns: {y: "Dist. from RB (m)"}, flip: y, zero: [0, 2]}', "Dist. from RB (m)", True),
        ('{x: 8, columns: {y: "y (+ left) (m)"}}', "y (+ left) (m)", False),
    ],
)
def test_distances_count_from_the_bank_of_their_heading(
    tmp_path: Path, options: str, heading: str, refused: bool
) -> None:
    """The section was mirrored without a word."""
    table = f"{heading};Velocity (m/s)\n0.5;0.4\n1.5;0.5\n"
    if refused:
        assert "bank, as" in refusal_of(tmp_path, entry(options), a__csv=table)
    else:
        assert len(import_of(tmp_path, entry(options), a__csv=table).table) == 2


def test_ends_of_a_tape_on_the_map_are_those_of_the_channel(tmp_path: Path) -> None:
    """The channel runs north: its left bank lies to the west."""
    site = CHANNEL + JUNE + "frame: {origin: [5000, 2000], angle: 90}\nfiles: {a.csv: {line: LINE}}\n"
    table = "Distance from left bank (m);Velocity (m/s)\n0.5;0.4\n1.5;0.5\n"
    found = import_of(tmp_path, site.replace("LINE", "[[4998, 2008], [5002, 2008]]"), a__csv=table)
    assert found.table["y"].tolist() == pytest.approx([1.5, 0.5])
    (tmp_path / "other").mkdir()
    other = site.replace("LINE", "[[5002, 2008], [4998, 2008]]")
    assert "exchange the ends of `line`" in refusal_of(tmp_path / "other", other, a__csv=table)
