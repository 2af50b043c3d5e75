"""A folder of a field team becomes a case: files as people have them, what is held out, walls, what is left alone."""

import json
import re
from math import cos, radians, sin
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from built_models import model_of
from field_folders import CHANNEL, JUNE, field_folder, folder_of, import_of, imported, refusal, refusal_of
from reach import Say, here

import vegglue
from vegglue.case.config import load_case
from vegglue.case.site_schema import Frame
from vegglue.engine.interface import linearise
from vegglue.errors import InputError
from vegglue.importers.file_options import FileOptions
from vegglue.importers.import_notes import UnreadFiles
from vegglue.measurements.kinds import Unused
from vegglue.measurements.observations import read_observations
from vegglue.wording.sentences import sentence
from vegglue.workflow.import_folder import assumptions_of, import_folder, unread_files

FRAME = Frame(origin=(683120.0, 247480.0), angle=32.0)
FLUME = "channel: {length_m: 8, bottom_width_m: 0.8, bed_slope: 0.001}\n"


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


def test_the_page_has_every_option_of_a_file() -> None:
    page = (Path(__file__).parents[2] / "docs" / "own_files.md").read_text(encoding="utf-8")
    table = page.partition("## Options of a file")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (`[^|]*) \|", table, re.MULTILINE)
    assert {key for row in rows for key in re.findall(r"`([a-z_]+)", row)} == set(FileOptions.__dataclass_fields__)


@pytest.mark.slow
def test_a_folder_becomes_a_case(tmp_path: Path) -> None:
    here(tmp_path, "import", field_folder(tmp_path / "Mill Brook"), "--to", "mill.yaml")
    case = load_case(tmp_path / "mill.yaml")
    assert case.name == "mill-brook"
    assert set(case.parameters) == {"n_b", "k_s", "phi", "canopy_height", "eddy_viscosity"}
    assert [patch.stems for patch in case.plants.patches] == [20.0, 1.0]
    assert case.plants.stands["plants"].stems == 20.0
    assert case.grid.cell[1] == pytest.approx(3.0 / 16)
    assert case.grid.y[1] > 1.5 + 0.75 / 0.6667, "the banks reach above the water"
    assert case.validation is not None
    assert list(case.validation.experiments) == ["high"]
    assert read_observations(case).table["kind"].tolist() == ["velocity", "level"]
    assert linearise(model_of(case, read_observations(case)), np.zeros(5)) is not None, "water flows in it"


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"channel": {"length_m": 40.0}}, "`channel.bottom_width_m`"), ({"experiments": {}}, "`experiments`"),
        ({"experiments": {"low": {"discharge_m3_s": "much", "downstream_level_m": 1}}}, "'much'"),
        ({"experiments": {"low": {"discharge_m3_s": 2.66, "downstream_level_m": 431.75}}}, "431.75 m"),
        ({"holdout": {"high": {"discharge": "2 m3/s", "level": "31.9 m"}}}, "`holdout.high`"),
    ],
)  # fmt: skip
def test_a_folder_that_states_too_little_is_refused(tmp_path: Path, changes: dict[str, Any], place: str) -> None:
    folder = field_folder(tmp_path / "site", **changes)
    assert place in refusal(folder)
    done = here(tmp_path, "import", "site", "--to", "site.yaml", succeed=False)
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize("name", ["measured.csv", "holdout.csv"])
def test_a_folder_without_a_measurement_lists_its_columns_and_known_ones(tmp_path: Path, name: str) -> None:
    folder = field_folder(tmp_path / "site")
    for file in ("velocities.csv", "levels.csv") if name == "measured.csv" else ():
        (folder / file).unlink()
    (folder / name).write_text("x,section,Tempo\n10,A,0.3\n", encoding="utf-8")
    error = refusal(folder)
    for word in (name, "section from section", "Tempo", "u, vx, ux, u mean"):
        assert word in error


OVER_WATER = "experiment,section,x,y,z,u\nlow,A,12,0,1.2,0.4\nlow,A,12,0,1.4,0.5\n"
IN_WATER = OVER_WATER.replace("1.2,", "0.2,").replace("1.4,", "0.4,")


@pytest.mark.parametrize(
    "tables",
    [
        {"adv.csv": OVER_WATER}, {"adv.csv": IN_WATER, "adv2.csv": IN_WATER},
        {"again.csv": "experiment,section,x,y,u\nlow,A,12,0.5,0.5\n"},
    ],
)  # fmt: skip
def test_a_refused_import_leaves_nothing_behind(tmp_path: Path, tables: dict[str, str]) -> None:
    """What only the reading of the finished case refuses, under the paths that the files would have had."""
    folder = field_folder(tmp_path / "site")
    for name, text in tables.items():
        (folder / name).write_text(text, encoding="utf-8")
    done = here(tmp_path, "import", "site", "--to", "made/site.yaml", succeed=False)
    assert done.returncode == 2
    assert "tmp" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["site"]


@pytest.mark.parametrize(("u", "exchanged"), [(0.4, True), (2.4, False)])
def test_points_over_the_water_whose_velocities_would_lie_in_it_may_be_exchanged(
    tmp_path: Path, u: float, exchanged: bool
) -> None:
    folder = field_folder(tmp_path / "site")
    (folder / "adv.csv").write_text(OVER_WATER.replace("0.4\n", f"{u}\n"), encoding="utf-8")
    assert ("exchanged" in refusal(folder)) == exchanged


def test_levels_above_the_sea_need_that_of_the_floor(tmp_path: Path) -> None:
    """Every level had to be lowered by hand."""
    tables = {"u__csv": "x,y,u\n12,0,0.4\n", "w__csv": "x,y,depth\n12,0,0.95\n"}
    high = JUNE.replace("95 cm", "390.95 ft")  # 119.16156 m
    assert "channel.floor_level_m" in refusal_of(tmp_path, CHANNEL + high, **tables)
    low, raised = (
        import_of(tmp_path, CHANNEL.replace("}", f", floor_level_m: {floor}}}") + june, **tables)
        for floor, june in (("0 m", JUNE), ("118.21156 m", high))
    )
    assert raised.case.grid == low.case.grid
    assert raised.case.bed[0].trapezoid.level == pytest.approx(118.21156)
    assert raised.case.parameters["eddy_viscosity"].median == low.case.parameters["eddy_viscosity"].median
    assert raised.values("level") == pytest.approx([low.values("level")[0] + 118.21156], abs=1e-4)


def test_files_that_are_not_read_are_listed(tmp_path: Path) -> None:
    """A workbook of an old kind, or a .mat that no entry named, was left out without a word."""
    folder = field_folder(tmp_path / "site", patches={"file": "reeds.geojson", "stems_per_m2": 20})
    area = {"type": "Polygon", "coordinates": [[[16, 0], [20, 0], [20, 1], [16, 0]]]}
    reeds = {"type": "Feature", "properties": {}, "geometry": area}
    (folder / "reeds.geojson").write_text(json.dumps(reeds), encoding="utf-8")
    for name in ("levels.prj", "reeds.qmd", "readme.txt", "~$a.xlsx"):
        (folder / name).write_text("", encoding="utf-8")
    case = import_folder(folder, tmp_path / "site.yaml")
    assert unread_files(case, folder) == []
    for name in ("gauging.xls", "transects.mat"):
        (folder / name).write_bytes(b"")
    assert unread_files(case, folder) == [sentence(UnreadFiles(("gauging.xls", "transects.mat")))]


def test_the_grid_is_wide_enough_for_what_is_held_out(tmp_path: Path) -> None:
    high = {"high": {"discharge_m3_s": 6.0, "downstream_level_m": 1.6}}
    assert imported(field_folder(tmp_path / "site", holdout=high)).case.grid.y[1] > 1.5 + 1.6 / 0.6667


@pytest.mark.parametrize("name", ["._velocities.csv", ".velocities.csv", "~$velocities.xlsx"])
def test_what_programs_leave_beside_a_table_is_no_measurement(tmp_path: Path, name: str) -> None:
    folder = field_folder(tmp_path / "site")
    (folder / name).write_bytes(b"\x00\x05\x16\x07 velocity,1\n")
    assert len(imported(folder).case.observations) == 2


def test_a_file_of_notes_may_be_moved_away(tmp_path: Path) -> None:
    folder = field_folder(tmp_path / "site")
    (folder / "notes.txt").write_text("We came on 3 June, 2024.\nIt rained.\n", encoding="utf-8")
    assert "notes.txt" in refusal(folder)


def test_both_velocities_of_a_plain_table_are_taken(tmp_path: Path) -> None:
    """Under the usual name of u alone."""
    rows = ["experiment,section,x,y,u,u_se,v", *(f"June,A,8,{y},0.4,0.01,0.02" for y in (-1, 0, 1))]
    table = import_of(tmp_path, velocities__csv="\n".join(rows)).table
    assert table["kind"].value_counts().to_dict() == {"velocity": 3, "velocity_across": 3}
    assert set(table[table["kind"] == "velocity"]["standard_error"]) == {0.01}


def test_a_table_on_the_map_in_other_units_becomes_stations(tmp_path: Path) -> None:
    site = CHANNEL + JUNE + "frame: {origin: [683120, 247480], angle: 32}\nfiles: {adv.csv: {standard_error: 1 cm/s}}\n"
    found = import_of(tmp_path, site, adv__csv=survey_on_the_map())
    along = found.table[found.table["kind"] == "velocity"]
    assert np.allclose(along[["x", "y"]], [(8, -1), (8, 0), (20, -1), (20, 1)], atol=0.002)
    assert np.allclose(along["value"], 0.4, atol=1e-4)
    assert np.allclose(found.values("velocity_across"), 0.02, atol=1e-4)
    assert set(found.table["standard_error"]) == {0.01}
    assert found.case.experiments["June"].discharge == {"upstream": 2.0}
    assert found.case.experiments["June"].level == pytest.approx(0.95)
    assert found.case.frame == FRAME
    for word in ("semicolons", "decimal comma", "1 comment line", "1 missing-value code", "Easting"):
        assert word in found.taken["adv.csv"]
    assert (found.case.imported or ())[0].units["east_velocity"] == "cm/s"


@pytest.mark.slow
def test_what_is_wrong_in_a_file_is_found_by_check(tmp_path: Path) -> None:
    """A wrong unit, a station outside the grid, and a stream that is reversed."""
    rows = "".join(f"8,{y},{40 + y}\n20,{y},{42 + y}\n" for y in (-1, 0, 1))
    entry = "files: {a.csv: {units: {u: cm/s}}}\n"
    kinds = []
    for site, table in ((CHANNEL + JUNE, f"{rows}300,0,40\n"), (CHANNEL + JUNE + entry, rows.replace(",4", ",-4"))):
        case = import_of(tmp_path, site, a__csv=f"x,y,u\n{table}").case
        kinds.append({type(one).__name__ for one in vegglue.check(case, runs=tmp_path / "runs").remarks})
    assert len(kinds[0]) > 1
    assert kinds[1] - kinds[0], "of the reversed stream"


@pytest.mark.parametrize("name", ["holdout__csv", "holdout__txt"])
def test_what_is_held_out_may_have_any_form(tmp_path: Path, name: str) -> None:
    """It goes where no calibration sees it, in SI and in the channel."""
    site = CHANNEL + JUNE + "holdout: {May: {discharge: 2.4, level: 1.0}}\n"
    site += "frame: {origin: [683120, 247480], angle: 32}\n"
    own = "Easting,Northing,u\n683126.78,247484.24,0.5\n"
    found = import_of(tmp_path, site, adv__csv=own, **{name: survey_on_the_map()})
    assert [one.file.name for one in found.case.observations] == ["adv-velocity.csv"]
    assert found.case.validation is not None
    assert list(found.case.validation.experiments) == ["May"]
    tables = {one.kind: pd.read_csv(one.file) for one in found.case.validation.observations}
    assert set(tables["velocity"]["experiment"]) == {"May"}
    assert np.allclose(tables["velocity"]["u"], 0.4, atol=1e-4)
    assert np.allclose(tables["velocity_across"]["v"], 0.02, atol=1e-4)
    assert np.allclose(tables["velocity"][["x", "y"]], [(8, -1), (8, 0), (20, -1), (20, 1)], atol=0.002)
    assert list(found.taken) == ["adv.csv", name.replace("__", ".")]


@pytest.mark.parametrize(("walls", "median"), [("{n: 0.010}", 0.010), ("0.013", 0.013), ("true", 0.011)])
def test_a_flume_has_walls_and_no_banks(tmp_path: Path, walls: str, median: float) -> None:
    """The grid ends at the walls, and their roughness is a parameter."""
    june = "experiments: {June: {discharge: 32 l/s, level: 9.2 cm}}\n"
    table = "x,y,u [cm/s]\n4,-0.2,44\n4,0,46\n4,0.2,44\n"
    case = import_of(tmp_path, f"{FLUME}walls: {walls}\n{june}", a__csv=table).case
    assert case.grid.y == (-0.4, 0.4)
    assert case.friction.walls is not None
    assert case.friction.walls.n == "n_w"
    assert list(case.parameters) == ["n_b", "eddy_viscosity", "n_w"]
    assert getattr(case.parameters["n_w"], "median", None) == median
    assert case.model_error.bed == 0.001


@pytest.mark.parametrize(("scale", "low", "high"), [(0.04, 3e-5, 3e-4), (1.0, 5e-3, 5e-2), (12.0, 0.2, 2.0)])
def test_an_unstated_viscosity_follows_depth_and_speed(tmp_path: Path, scale: float, low: float, high: float) -> None:
    """A flume of 4 cm of water, a brook, a river of 10 m: by Froude's law, and 0.15 h u* between walls."""
    site = (
        f"channel: {{length_m: {30 * scale}, bottom_width_m: {3 * scale}, bank_slope_v_per_h: 0.5, bed_slope: 0.001}}\n"
        f"experiments: {{June: {{discharge: {2.0 * scale**2.5:.6g}, level: {0.95 * scale:.4g}}}}}\n"
    ) + ("walls: true\n" if scale < 1.0 else "")
    prior = import_of(tmp_path, site, a__csv=f"x,y,u\n{4 * scale},0,{0.4 * scale**0.5}\n").case.parameters[
        "eddy_viscosity"
    ]
    assert prior.median is not None
    assert low < prior.median < high


def test_a_velocity_beside_a_wall_is_no_reading_of_its_cell(tmp_path: Path) -> None:
    """Cells of 0.19 m have their middles 0.09 m from the wall; at 0.02 m the wall holds the water back."""
    found = import_of(tmp_path, CHANNEL + JUNE + "walls: true\n", a__csv="x,y,u\n4,0,0.4\n4,1.48,0.2\n4,-1.4,0.3\n")
    assert found.table.set_index("y")["used"].to_dict() == {0.0: True, 1.48: False, -1.4: True}
    assert found.table.set_index("y")["reason"][1.48] == Unused.AT_WALL


def test_walls_leave_no_room_for_banks(tmp_path: Path) -> None:
    table = "x,y,u\n4,0,0.4\n"
    assert import_of(tmp_path, CHANNEL + JUNE + "walls: true\n", a__csv=table).case.grid.y == (-1.5, 1.5)
    assert any("bank_slope_v_per_h" in one for one in assumptions_of(tmp_path / "brook0"))
    site = CHANNEL.replace("bank_slope_v_per_h: 0.5, ", "") + JUNE
    assert "`channel.bank_slope_v_per_h`" in refusal_of(tmp_path, site, a__csv=table)


@pytest.mark.parametrize(
    ("entry", "table", "place"),
    [
        ("files: {b.csv: {}}", "x,y,u\n1,2,3\n", "b.csv"),
        ("files: {a.csv: {colums: {}}}", "x,y,u\n1,2,3\n", "`columns`?"),
        ("files: {a.csv: {columns: {u: V9}}}", "x,y,u\n1,2,3\n", "'V9' for u"),
        ("files: {a.csv: {columns: {V9: u}}}", "x,y,V9\n1,2,3\n", "`u: V9`"),
        ("files: {a.csv: {units: {u: furlong}}}", "x,y,u\n1,2,3\n", "'furlong'"),
        ("files: {a.csv: {units: {u: 0.8 m}}}", "x,y,u\n1,2,3\n", "'m'"),
        ("files: {a.csv: {units: {x: 0 m}}}", "x,y,u\n1,2,3\n", "'0 m'"), ("", "a,b\n1,2\n", "got a, b"),
        ("", "y,u\n1,2\n", "column of x"), ("", "section,x,u\nA,1,2\nsection,x,u\nB,1,2\n", "'x'"),
        ("", "x,y,u\n1,2,3\n1,2,fast\n4,5,6\n", "row 3: "),
        ("files: {a.csv: {missing: none}}", "x,y,u\n1,2,3\n", "missing"),
        ("files: {a.csv: {standard_error: -0.01}}", "x,y,u\n1,2,3\n", "standard_error"),
        ("", "x,y,u,u_se\n1,2,3,0.1\n1,3,3,-1\n", "row 3: "), ("files: {a.csv: {flip: z}}", "x,y,u\n1,2,3\n", "flip"),
        ("files: {a.csv: {line: 3}}", "x,y,u\n1,2,3\n", "line"),
        ("files: {a.csv: {factor: 0}}", "x,y,u\n1,2,3\n", "factor"),
        ("files: {a.csv: {line: [[1, 2], [1, 2]]}}", "tape,u\n1,2\n", "line"),
        ("files: {a.csv: {start: [1, 2]}}", "x,y,u\n1,2,3\n", "`start`"),
        ("frame: {origin: [1, 2]}", "x,y,u\n1,2,3\n", "`angle`"),
        ("files: {a.csv: {line: [[1, 2], [3, 4]]}}", "x,y,u\n1,2,3\n", "`line`"),
        ("files: {a.csv: {draft: 0.1}}", "x,y,u\n1,2,3\n", "`draft`"),
        ("files: {a.csv: {declination: 3}}", "x,y,u\n1,2,3\n", "`declination`"),
        ("files: {../secret.csv: {}}", "x,y,u\n1,2,3\n", "../secret.csv"),
    ],
)  # fmt: skip
def test_what_cannot_be_taken_is_refused(tmp_path: Path, entry: str, table: str, place: str) -> None:
    """A file beside the folder, too: a site file may be a stranger's."""
    (tmp_path / "secret.csv").write_text("x;y;u\n2;0;0.2\n", encoding="utf-8")
    assert place in refusal_of(tmp_path, CHANNEL + JUNE + entry + "\n", a__csv=table.replace(",", ";"))


def test_a_file_of_a_folder_within_is_read_if_it_is_named(tmp_path: Path) -> None:
    site = CHANNEL + JUNE + "files: {adcp/b.csv: {section: B}}\n"
    folder = folder_of(tmp_path / "brook", site, b__csv="x;y;section;u\n1;0;A;0.1\n")
    (folder / "adcp").mkdir()
    for name in ("b.csv", "unnamed.csv"):
        (folder / "adcp" / name).write_text("x;y;u\n2;0;0.2\n", encoding="utf-8")
    assert imported(folder).table[["section", "value"]].to_numpy().tolist() == [["A", 0.1], ["B", 0.2]]


def test_two_files_of_one_stem_have_tables_of_their_own(tmp_path: Path) -> None:
    """The second wrote over the first, and was then read twice."""
    first, second = "x;y;level\n8;0;0.95\n", "x\ty\tlevel\n20\t0\t0.94\n"
    found = import_of(tmp_path, gauge__csv=first, gauge__txt=second, Gauge__dat=first)
    assert len({one.file.name.lower() for one in found.case.observations}) == 3
    assert sorted(found.values("level")) == [0.94, 0.95, 0.95]


def test_a_file_of_the_usual_name_need_not_name_the_only_experiment(tmp_path: Path) -> None:
    table = import_of(tmp_path, velocities__csv="section,x,y,u,u_se\nA,4,0,0.4,0.01\n").table
    assert table[["experiment", "section", "value"]].to_numpy().tolist() == [["June", "A", 0.4]]


def test_import_reports_which_measurements_lack_errors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say
) -> None:
    monkeypatch.chdir(tmp_path)
    folder_of(tmp_path / "brook", CHANNEL + JUNE, adv__csv="x;y;Vx (cm/s)\n8;0;21\n")
    code, printed = say("import", "brook", "--quiet")
    assert code == 0
    for word in ("`infer`", "1 value of velocity", "x = 8, y = 0 m", "`u_se`", "0.015 m/s"):
        assert word in printed


def test_an_edited_config_is_not_replaced(tmp_path: Path) -> None:
    folder = field_folder(tmp_path / "brook")
    target = tmp_path / "brook.yaml"
    vegglue.import_folder(folder, target)
    target.write_text(target.read_text(encoding="utf-8") + "\n# mine\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"brook\.yaml"):
        vegglue.import_folder(folder, target)
    assert vegglue.import_folder(folder, target, force=True).name == "brook"
