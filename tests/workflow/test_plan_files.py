"""What a plan leaves to take along: stations on the map, waypoints, sheets that import reads back, and the page."""

import csv
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from shutil import copytree
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from browser import found_in_page
from small_case import SMALL

import vegglue
from vegglue.calibration.candidates import effect_entry
from vegglue.case.config import load_case
from vegglue.case.parameter_space import theta_at
from vegglue.engine.interface import linearise
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations
from vegglue.pages.plan import confusions, days_of_work
from vegglue.results.plan import FieldPlan, PlannedPiece, Work, field_places, field_stations
from vegglue.workflow.case_run import CaseRun
from vegglue.workflow.hidden_effect import candidate_of

# Of UTM zone 32: the central meridian of 9 degrees east has the easting 500,000 m, the equator the northing 0.
FRAME = """
frame: {origin: [500000, 5000000], angle: 30, crs: "EPSG:32632"}
planned:
  transects: [{x: 9, spacing: 0.5}, {x: 16, spacing: 1.0}]
  gauges: [{x: 5}]
  points: [{x: 12, y: 0.7}]
  costs: {transect: 3.0}
"""
Made = tuple[Path, FieldPlan]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    folder = tmp_path_factory.mktemp("field")
    config = folder / "small.yaml"
    config.write_text(SMALL + FRAME, encoding="utf-8")
    return folder, vegglue.plan(load_case(config), runs=folder / "runs")


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_stations_stand_on_the_map(made: Made) -> None:
    folder, plan = made
    rows = rows_of(folder / "runs/small/plan/stations.csv")
    assert len(rows) == sum(len(one.y) for one in plan.pieces)
    assert [one.name for one in field_places(plan)] == ["T1", "T2", "V1", "G1"]
    gauge = next(row for row in rows if row["station"] == "G1")
    assert (gauge["x"], gauge["work"], gauge["flows"]) == ("5", "gauge", "low")
    cosine, sine = np.cos(np.radians(30)), np.sin(np.radians(30))
    x, y = float(gauge["x"]), float(gauge["y"])
    assert float(gauge["east"]) == pytest.approx(500000 + x * cosine - y * sine, abs=0.01)
    assert float(gauge["north"]) == pytest.approx(5000000 + x * sine + y * cosine, abs=0.01)


def test_waypoints_are_in_degrees(made: Made) -> None:
    pytest.importorskip("pyproj")
    folder, plan = made
    tree = ElementTree.parse(folder / "runs/small/plan/stations.gpx")
    points = tree.findall("{http://www.topografix.com/GPX/1/1}wpt")
    assert len(points) == sum(len(one.y) for one in plan.pieces)
    stations, without = field_stations(load_case(folder / "small.yaml"), plan)
    assert without == ""
    # 5,000 km north of the equator: 45.15 degrees; a degree along the parallel is 78.8 km there.
    assert np.array([one.latitude for one in stations]) == pytest.approx(45.153, abs=2e-3)
    east = np.array([one.east - 500000 for one in stations])
    assert np.array([one.longitude - 9.0 for one in stations]) == pytest.approx(east / 78_700, abs=1e-5)


def test_without_a_system_there_are_no_waypoints(made: Made) -> None:
    folder, plan = made
    case = load_case(folder / "small.yaml")
    assert field_stations(case.model_copy(update={"frame": None}), plan)[1] == "frame"
    assert case.frame is not None
    assert (
        field_stations(case.model_copy(update={"frame": case.frame.model_copy(update={"crs": None})}), plan)[1] == "crs"
    )


def filled(sheet: Path, values: dict[str, list[float]]) -> None:
    """Write measured values into the tables of a sheet, row by row; NaN leaves a row empty."""
    for name, of_rows in values.items():
        rows = rows_of(sheet / name)
        column = {"velocities.csv": "u", "levels.csv": "level"}[name]
        for row, value in zip(rows, of_rows, strict=True):
            row[column] = "" if np.isnan(value) else f"{value:.4f}"
        with (sheet / name).open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)


def filled_in(made: Made, sheet: Path) -> pd.DataFrame:
    """A sheet filled in with numbers that are none of a flow, and its stations."""
    folder, plan = made
    if sheet.name != "sheet":
        copytree(folder / "runs/small/plan/sheet", sheet)
    count = sum(len(one.y) for one in plan.pieces if one.work.value != "gauge")
    filled(sheet, {"velocities.csv": [0.5 + 0.01 * k for k in range(count)], "levels.csv": [0.93]})
    return read_observations(vegglue.import_folder(sheet, sheet.parent / "first.yaml", force=True)).table


def test_the_sheet_filled_in_is_imported_and_diagnosed_without_an_edit(made: Made, tmp_path: Path) -> None:
    folder, _ = made
    sheet = folder / "runs/small/plan/sheet"
    table = filled_in(made, sheet)
    count = int((table["kind"] == "velocity").sum())
    # What the model shows with what nobody guessed: a roughness off the middle of its prior.
    model = CaseRun(load_case(folder / "small.yaml")).model
    point = linearise(replace(model, station=table), np.array([0.6, -0.4]))
    assert point is not None
    error = table["standard_error"].to_numpy(float) * np.random.default_rng(5).standard_normal(len(table))
    value, velocity = point.prediction + error, (table["kind"] == "velocity").to_numpy()
    value[2] = np.nan  # a vertical that was not measured
    filled(sheet, {"velocities.csv": list(value[velocity]), "levels.csv": list(value[~velocity])})
    case = vegglue.import_folder(sheet, tmp_path / "measured.yaml")
    assert case.planned is None
    assert list(case.parameters) == ["n_b", "phi"]
    table = read_observations(case).table
    assert (table["kind"] == "velocity").sum() == count - 1
    assert sorted(table.loc[table["kind"] == "velocity", "x"].unique()) == [9.0, 12.0, 16.0]
    assert table["value"].iloc[3] == pytest.approx(value[4], abs=1e-4)
    assert (table["standard_error"] > 0).all()
    assert table["used"].all()
    found = vegglue.diagnose(case, runs=tmp_path / "runs")
    assert found.verdict.kind in ("nothing-missing", "cannot-tell")
    low, high = found.parameters.last["n_b"][1:]
    true = theta_at(case, np.array([0.6, -0.4]))["n_b"][0]
    assert low < true < high


def test_what_the_plan_said_would_be_seen_is_named_from_its_sheet(made: Made, tmp_path: Path) -> None:
    folder, plan = made
    sheet, name = folder / "runs/small/plan/sheet", "discharge_error[low]"
    assert next(one for one in plan.effects if one.name == name).seen
    table = filled_in(made, sheet)
    model = replace(CaseRun(load_case(folder / "small.yaml")).model, station=table)
    candidate = candidate_of(model, name)
    hidden = effect_entry(candidate, 1.2 * candidate.amplitude.scale, candidate.settings()[0])
    case = model.case.model_copy(update={"effects": {candidate.key: hidden}})
    point = linearise(replace(model, case=case), np.array([0.5, -0.5]))
    assert point is not None
    error = table["standard_error"].to_numpy(float) * np.random.default_rng(1).standard_normal(len(table))
    value, velocity = point.prediction + error, (table["kind"] == "velocity").to_numpy()
    filled(sheet, {"velocities.csv": list(value[velocity]), "levels.csv": list(value[~velocity])})
    found = vegglue.diagnose(vegglue.import_folder(sheet, tmp_path / "measured.yaml"), runs=tmp_path / "runs")
    assert name in [one.name for one in found.verdict.effects]


def as_saved_by_a_person(sheet: Path) -> None:
    """With semicolons and decimal commas, in another order, with an empty row and remarks."""
    heading, *rows = (line.split(",") for line in (sheet / "velocities.csv").read_text().splitlines())
    rows = [[*(cell.replace(".", ",") for cell in row), "Äste davor" if k == 3 else ""] for k, row in enumerate(rows)]
    lines = [[*heading, "Bemerkung"], *rows[::-1], [""] * (len(heading) + 1)]
    (sheet / "velocities.csv").write_bytes("\r\n".join(";".join(row) for row in lines).encode("cp1252"))


def as_a_workbook(sheet: Path) -> None:
    pd.read_csv(sheet / "velocities.csv").to_excel(sheet / "velocities.xlsx", index=False)
    (sheet / "velocities.csv").unlink()


@pytest.mark.parametrize("saved", [as_saved_by_a_person, as_a_workbook])
def test_a_sheet_may_be_saved_as_spreadsheets_do(made: Made, saved: Callable[[Path], None]) -> None:
    sheet = made[0] / f"runs/small/plan/{saved.__name__}"
    columns = ["x", "y", "value", "standard_error"]
    before = filled_in(made, sheet)[columns].sort_values(columns[:2])
    saved(sheet)
    found = read_observations(vegglue.import_folder(sheet, sheet.parent / "first.yaml", force=True)).table
    assert found[columns].sort_values(columns[:2]).to_numpy() == pytest.approx(before.to_numpy())


def test_levels_that_were_not_measured_may_be_deleted(made: Made) -> None:
    sheet = made[0] / "runs/small/plan/without_levels"
    count = len(filled_in(made, sheet))
    (sheet / "levels.csv").unlink()
    case = vegglue.import_folder(sheet, sheet.parent / "first.yaml", force=True)
    assert len(read_observations(case).table) == count - 1


def test_a_sheet_without_its_config_is_refused(made: Made, tmp_path: Path) -> None:
    copytree(made[0] / "runs/small/plan/sheet", tmp_path / "sheet")
    with pytest.raises(InputError, match="planned with"):
        vegglue.import_folder(tmp_path / "sheet", tmp_path / "measured.yaml")


def test_a_sheet_that_was_filled_in_is_not_replaced(made: Made) -> None:
    folder, _ = made
    filled_in(made, folder / "runs/small/plan/sheet")
    before = (folder / "runs/small/plan/sheet/velocities.csv").read_text(encoding="utf-8")
    with pytest.raises(InputError, match="filled in"):
        vegglue.plan(load_case(folder / "small.yaml"), runs=folder / "runs")
    assert (folder / "runs/small/plan/sheet/velocities.csv").read_text(encoding="utf-8") == before


def test_an_empty_sheet_is_refused(tmp_path: Path) -> None:
    config = tmp_path / "small.yaml"
    config.write_text(SMALL + FRAME, encoding="utf-8")
    vegglue.plan(load_case(config), runs=tmp_path / "runs")
    with pytest.raises(InputError):
        vegglue.import_folder(tmp_path / "runs/small/plan/sheet", tmp_path / "measured.yaml")
    assert not (tmp_path / "measured.yaml").exists()


def test_days_are_eight_hours_and_a_half_at_most_and_hold_all_work(made: Made) -> None:
    folder, plan = made
    days = days_of_work(load_case(folder / "small.yaml"), plan, field_places(plan))
    assert len(days) == 2
    assert sum(len(day.work) for day in days) == len(plan.pieces)
    assert all(day.work[-1].ends <= 8.5 + 1e-9 or len(day.work) == 1 for day in days)
    for day in days:
        x = [one.place.x for one in day.work if one.place.work is not Work.GAUGE]
        assert x == sorted(x, reverse=True)
    assert days[0].work[0].place.name == "G1"


def test_what_a_day_has_no_time_for_does_not_end_it(made: Made) -> None:
    """Of 3, 3.4, 3.4 and 1 h from downstream the last one is done on the first day: two days instead of three."""
    folder, plan = made
    hours = {20.0: 3.0, 15.0: 3.4, 10.0: 3.4, 5.0: 1.0, 2.0: 3.5}
    pieces = tuple(PlannedPiece(Work.TRANSECT, "low", x, (0.0,), one) for x, one in hours.items())
    other = replace(plan, pieces=pieces)
    days = days_of_work(load_case(folder / "small.yaml"), other, field_places(other))
    assert [[one.place.x for one in day.work] for day in days] == [[20.0, 15.0, 5.0], [10.0, 2.0]]


def test_the_page_and_the_object_hold_the_plan(made: Made) -> None:
    folder, plan = made
    page = (folder / "runs/small/plan/plan.html").read_text(encoding="utf-8")
    stations = field_stations(load_case(folder / "small.yaml"), plan)[0]
    for name in [*(one.name for one in plan.effects), *(one.name for one in stations)]:
        assert name in page
    assert page.count("<circle") >= sum(len(one.y) for one in plan.pieces if one.work.value != "gauge")
    tree = json.loads((folder / "runs/small/plan/plan.json").read_text(encoding="utf-8"))
    assert tree["hours"] == pytest.approx(plan.hours)
    assert [one["name"] for one in tree["effects"]] == [one.name for one in plan.effects]


def test_effects_that_look_alike_are_one_group(made: Made) -> None:
    _, plan = made
    groups = confusions(plan.effects)
    assert len({name for group in groups for name in group}) == sum(map(len, groups))
    assert any({"smagorinsky", "mixing_length"} <= set(group) for group in groups)


@pytest.mark.parametrize("width", [360, 1300])
def test_the_page_fits_a_phone_and_a_desktop(made: Made, width: int) -> None:
    folder, plan = made
    script = """(window, document) => ({
      wide: document.documentElement.scrollWidth,
      rows: document.querySelectorAll("#order ~ div tbody tr").length,
      stations: document.querySelectorAll("#stations ~ details tbody tr").length,
      maps: [...document.querySelectorAll(".drawing")].map((one) => one.clientWidth > 0),
      sideways: [...document.querySelectorAll(".drawing, #order ~ .scroll")].some(
        (one) => one.scrollWidth > one.clientWidth),
    })"""
    found = found_in_page(folder / "runs/small/plan/plan.html", width, script)
    assert found["wide"] <= width
    assert found["rows"] == len(plan.pieces)
    assert found["maps"] == [width > 640, width <= 640]
    assert not found["sideways"]
    assert found["stations"] == sum(len(one.y) for one in plan.pieces)
