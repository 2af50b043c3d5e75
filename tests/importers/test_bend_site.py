"""Measurements of a bend on the map arrive along and across its centreline, with the bed and the patches."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from reach import COARSE, Say, write_reach

import vegglue
from vegglue.case.config import load_case
from vegglue.case.grid import build_grid, centreline_of, places_on_map
from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case
from vegglue.case.site_schema import CentrelineShape, Frame
from vegglue.errors import InputError
from vegglue.importers.measured_rows import Placement
from vegglue.importers.site_file import FileOfSite
from vegglue.importers.vector_files import drawn_centreline
from vegglue.measurements.observations import read_observations

FRAME = Frame(origin=(683120.0, 247480.0), angle=32.0, crs="EPSG:2056")
SAID = "frame: {origin: [683120.0, 247480.0], angle: 32.0, crs: EPSG:2056}\n"
# Half the reach straight, then a bend to the left, through a few points as a map program has them.
POINTS = ((0.0, 0.0), (6.0, 0.0), (12.0, 0.1), (17.5, 1.1), (22.0, 4.0), (24.9, 8.5), (26.0, 13.5))
BENT = f"{COARSE[1]}, centreline: {{points: {[list(one) for one in POINTS]}}}}}"
ON_MAP = [FRAME.to_map(*one) for one in POINTS]
EXPERIMENTS = "experiments: {June: {discharge: 2.0, level: 0.95}}\n"
GROUND = "channel: {bottom_width_m: 3, bank_slope_v_per_h: 0.5, bed_slope: 0.001}\n"
OF_MAP = {"E": "east [m]", "N": "north [m]", "Ve": "east_velocity [m/s]", "Vn": "north_velocity [m/s]"}


@pytest.fixture(scope="module")
def flow(tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    """The product's own flow in the bend, cell by cell, along the channel and on the map; wet cells only."""
    folder = tmp_path_factory.mktemp("bend")
    case = load_case(write_reach(folder, (COARSE[0] + "}", BENT), ("friction:\n", f"{SAID}friction:\n")))
    vegglue.export(case, runs=folder / "runs", forms=("csv",))
    table = pd.read_csv(folder / "runs/brook/export/flow-june.csv")
    return table[table["depth [m]"].notna()].reset_index(drop=True)


def imported(folder: Path, site: str, **files: str) -> Case:
    """The case of a folder; names of files with __ for the point."""
    folder.mkdir()
    (folder / "site.yaml").write_text(site, encoding="utf-8")
    for name, text in files.items():
        (folder / name.replace("__", ".")).write_text(text, encoding="utf-8")
    return vegglue.import_folder(folder, folder.parent / "bend.yaml")


def line_file(ending: str) -> str:
    if ending == "csv":
        return "Point;Easting;Northing\n" + "".join(f"{i};{e:.9f};{n:.9f}\n" for i, (e, n) in enumerate(ON_MAP))
    shape = {"type": "LineString", "coordinates": [list(one) for one in ON_MAP]}
    return json.dumps({"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": shape}]})


def survey(flow: pd.DataFrame) -> pd.DataFrame:
    """Every seventh wet cell, as a boat with a satellite receiver would have it."""
    return flow.iloc[::7].reset_index(drop=True)


@pytest.mark.parametrize("ending", ["csv", "geojson", "list"])
def test_a_survey_on_the_map_comes_back_along_and_across(tmp_path: Path, flow: pd.DataFrame, ending: str) -> None:
    cells = survey(flow)
    table = cells[list(OF_MAP.values())].set_axis(list(OF_MAP), axis=1).to_csv(index=False)
    drawn = f"{{file: axis.{ending}}}" if ending != "list" else str([list(one) for one in ON_MAP])
    files = {} if ending == "list" else {f"axis__{ending}": line_file(ending)}
    site = GROUND + EXPERIMENTS + SAID + f"grid: {{centreline: {drawn}}}\n"
    case = imported(tmp_path / "Bend", site, boat__csv=table, **files)
    found = read_observations(case).table
    along, across = (found[found["kind"] == kind] for kind in ("velocity", "velocity_across"))
    for part, column in ((along, "u [m/s]"), (across, "v [m/s]")):
        assert np.allclose(part[["x", "y"]], cells[["x [m]", "y [m]"]], atol=0.001), "to the millimetre of a station"
        assert np.allclose(part["value"], cells[column], atol=2e-6), "to the six digits of a station"
    assert part["used"].all()
    assert case.imported is not None
    assert {"33.53", "81", "12", "left"} <= set(case.imported[0].taken.partition(":")[0].split())
    assert "centreline" in case.imported[1].taken
    assert case.imported[0].name == ("site.yaml" if ending == "list" else f"axis.{ending}")


def test_a_line_that_is_straight_to_its_digits_has_no_radius(tmp_path: Path) -> None:
    """It was one of 1.6e12 m."""
    points = "\n".join(f"{683120 + 8.75 * i:.3f},{247480 + 3.775 * i:.3f}" for i in range(5))
    (tmp_path / "axis.csv").write_text(f"x,y\n{points}\n", encoding="utf-8")
    drawn = drawn_centreline(tmp_path, FileOfSite(file="axis.csv"), None)
    assert "radius" not in drawn.taken
    assert drawn.line.s[-1] == pytest.approx(38.12, abs=0.01)


def test_places_given_along_the_channel_stay_there(tmp_path: Path) -> None:
    site = GROUND + EXPERIMENTS + SAID + f"grid: {{centreline: {[list(one) for one in ON_MAP]}}}\n"
    site += "files: {a.csv: {coordinates: channel}}\n"
    case = imported(tmp_path / "Bend", site, a__csv="x,y,u,v\n20,1,0.5,0.02\n25,-1,0.6,0.01\n")
    found = read_observations(case).table
    assert found["x"].tolist() == pytest.approx([20.0, 25.0] * 2, abs=1e-4)
    assert found["y"].tolist() == pytest.approx([1.0, -1.0] * 2, abs=1e-4)
    assert found["value"].tolist() == [0.5, 0.6, 0.02, 0.01]


def test_discharge_is_measured_along_the_line(tmp_path: Path, flow: pd.DataFrame) -> None:
    """A station of the map with a discharge passes the section that lies s along the centreline."""
    place = flow.iloc[len(flow) // 2]
    site = GROUND + EXPERIMENTS + SAID + f"grid: {{centreline: {[list(one) for one in ON_MAP]}}}\n"
    case = imported(tmp_path / "Bend", site, q__csv=f"E,N,Q\n{place['east [m]']},{place['north [m]']},2.0\n")
    found = read_observations(case).table
    assert found["x"].tolist() == pytest.approx([place["x [m]"]], abs=0.001)


def test_parts_begin_on_the_map_and_head_there(tmp_path: Path) -> None:
    east, north = FRAME.to_map(1.0, 2.0)
    parts = f"{{parts: [{{length: 12}}, {{radius: 20, angle: 60}}], start: [{east}, {north}], heading: 32}}"
    case = imported(
        tmp_path / "Bend",
        GROUND + EXPERIMENTS + SAID + f"grid: {{centreline: {parts}}}\n",
        a__csv=f"E,N,u\n{east},{north},0.5\n",
    )
    assert case.grid.centreline is not None
    assert case.grid.centreline.start == pytest.approx((1.0, 2.0))
    assert case.grid.centreline.heading == pytest.approx(0.0)
    assert case.grid.x == pytest.approx((0.0, 12.0 + 20.0 * np.pi / 3.0), abs=1e-4)


def test_no_frame_is_needed_but_its_system_may_be_named(tmp_path: Path, flow: pd.DataFrame) -> None:
    cells = survey(flow)
    table = cells[list(OF_MAP.values())].set_axis(list(OF_MAP), axis=1).to_csv(index=False)
    site = GROUND + EXPERIMENTS + "frame: {crs: EPSG:2056}\n"
    case = imported(
        tmp_path / "Bend", site + "grid: {centreline: {file: axis.csv}}\n", boat__csv=table, axis__csv=line_file("csv")
    )
    assert case.frame == Frame(origin=(0.0, 0.0), angle=0.0, crs="EPSG:2056")
    found = read_observations(case).table
    along = found[found["kind"] == "velocity"]
    assert np.allclose(along[["x", "y"]], cells[["x [m]", "y [m]"]], atol=0.002)
    assert np.allclose(along["value"], cells["u [m/s]"], atol=1e-4)


def test_the_bed_and_the_patches_follow_the_line(tmp_path: Path, flow: pd.DataFrame) -> None:
    """Levels on the map of a bed that falls along the bend and rises to its banks; a patch drawn on the map."""
    place = Placement(FRAME, centreline_of(CentrelineShape(points=POINTS)))
    along, across = (part.ravel() for part in np.meshgrid(np.arange(-1.0, 32.0), np.arange(-4.0, 4.1, 0.5)))
    east, north = place.to_map(along, across)
    level = 2.0 - 0.002 * along + 0.02 * across
    points = "".join(f"{e:.6f} {n:.6f} {z:.6f}\n" for e, n, z in zip(east, north, level, strict=True))
    corners = np.stack(place.to_map(np.array([18.0, 22.0, 22.0, 18.0]), np.array([0.0, 0.0, 1.5, 1.5])), axis=1)
    shape = {"type": "Polygon", "coordinates": [[list(one) for one in corners]]}
    patch = json.dumps({"type": "Feature", "properties": {"name": "Reed"}, "geometry": shape})
    site = EXPERIMENTS.replace("0.95", "2.9") + SAID + "patches: {file: reed.geojson}\n"
    site += "bed: {file: bed.xyz, columns: {x: 1, y: 2, z: 3}}\ngrid: {centreline: {file: axis.csv}, y: [-3.5, 3.5]}\n"
    files = {"bed__xyz": points, "axis__csv": line_file("csv"), "reed__geojson": patch}
    case = imported(tmp_path / "Bend", site, boat__csv="E,N,u\n683140,247495,0.5\n", **files)
    found, grid = build_site(case), build_grid(case)
    assert case.grid.x == pytest.approx((0.0, 31.0), abs=1e-3), "as far as the survey goes"
    assert np.allclose(found.bed, 2.0 - 0.002 * grid.x[:, None] + 0.02 * grid.y, atol=0.002)
    planted = np.argwhere(found.main_patch >= 0)
    assert len(planted)
    assert grid.x[planted[:, 0]].min() == pytest.approx(18.0, abs=0.6)
    assert grid.x[planted[:, 0]].max() == pytest.approx(22.0, abs=0.6)
    # A side drawn straight on the map from (18, 1.5) to (22, 1.5) is a chord, 0.139 m off the arc in its middle.
    assert 0.0 < grid.y[planted[:, 1]].min() < grid.y[planted[:, 1]].max() < 1.5 + 0.139


def test_cross_sections_of_a_bend_are_carried_on_along_it(tmp_path: Path) -> None:
    """Four of them, square to the line on the map, of a bed that falls along it and rises to its banks."""
    place = Placement(FRAME, centreline_of(CentrelineShape(points=POINTS)))
    along, across = (part.ravel() for part in np.meshgrid([0.0, 9.0, 20.0, 33.0], np.arange(-4.0, 4.1, 1.0)))
    rows = zip(*place.to_map(along, across), 2.0 - 0.002 * along + 0.05 * np.abs(across), strict=True)
    points = "E,N,z\n" + "".join(f"{e:.6f},{n:.6f},{z:.6f}\n" for e, n, z in rows)
    site = EXPERIMENTS.replace("0.95", "2.9") + SAID + "bed: {file: sections.csv, sections: true}\n"
    site += "grid: {centreline: {file: axis.csv}, x: [0, 33], y: [-3.5, 3.5], cell: [1, 0.5]}\n"
    case = imported(
        tmp_path / "Bend", site, sections__csv=points, axis__csv=line_file("csv"), a__csv="E,N,u\n683140,247495,0.5\n"
    )
    found, grid = build_site(case), build_grid(case)
    assert np.allclose(found.bed, 2.0 - 0.002 * grid.x[:, None] + 0.05 * np.abs(grid.y), atol=0.003)
    assert case.imported is not None
    assert "in 4 cross-sections" in " ".join(one.taken for one in case.imported)


def test_a_raster_needs_the_width_of_the_grid(tmp_path: Path, say: Say) -> None:
    """Levels of a plane on the map, which the grid then reads where its cells lie."""
    at = np.arange(40.0) + 0.5
    rows = (2.0 + 0.01 * at[None, :] - 0.02 * at[::-1, None]).tolist()
    levels = "\n".join(" ".join(f"{one:.6f}" for one in row) for row in rows)
    head = "ncols 40\nnrows 40\nxllcorner 683110\nyllcorner 247470\ncellsize 1\n"
    site = EXPERIMENTS + SAID + "bed: {file: dtm.asc}\ngrid: {centreline: {file: axis.csv}}\n"
    folder = tmp_path / "Bend"
    folder.mkdir()
    for name, text in (("site.yaml", site), ("dtm.asc", head + levels),
                       ("axis.csv", line_file("csv")), ("a.csv", "E,N,u\n683140,247495,0.5\n")):  # fmt: skip
        (folder / name).write_text(text, encoding="utf-8")
    code, error = say("import", folder, "--to", tmp_path / "bend.yaml")
    assert code == 2
    assert "dtm.asc: expected `grid.y`" in error
    (folder / "site.yaml").write_text(site.replace("axis.csv}", "axis.csv}, y: [-4, 4]"), encoding="utf-8")
    case = vegglue.import_folder(folder, tmp_path / "bend.yaml")
    east, north = FRAME.to_map(*places_on_map(build_grid(case)))
    assert np.allclose(build_site(case).bed, 2.0 + 0.01 * (east - 683110) - 0.02 * (north - 247470), atol=1e-3)


@pytest.mark.parametrize(
    ("drawn", "files", "said"),
    [
        ("{file: no.csv}", {}, "no.csv"),
        ("{file: a.csv}", {"a__csv": "E,N\n1,2\n1,2\n"}, "got 1;"),
        ("{file: a.csv}", {"a__csv": "E,N\n1,2\n1,2.0006\n"}, "got 1;"),
        ("{file: a.csv, colums: {x: E}}", {"a__csv": "E,N\n1,2\n3,4\n"}, "`colums`"),
        ("{file: a.geojson}", {"a__geojson": '{"type": "Point", "coordinates": [1, 2]}'}, "got 0;"),
        ("{file: a.geojson}", {"a__geojson": "[]"}, "a.geojson: expected GeoJSON"),
        (
            "{file: a.geojson}",
            {"a__geojson": '{"type": "LineString", "coordinates": [[8.1, 47.2], [8.1001, 47.2003]]}'},
            "degrees",
        ),
        ("{points: [[0, 0]]}", {}, "`grid.centreline.points`"),
        ("{parts: [{length: 3}], points: [[0, 0], [1, 1]]}", {}, "`parts`"),
        ("12", {}, "got 12;"),
    ],
)
def test_a_line_that_cannot_be_taken_is_refused_in_one_sentence(
    tmp_path: Path,
    say: Say,
    drawn: str,
    files: dict[str, str],
    said: str,
) -> None:
    folder = tmp_path / "Bend"
    folder.mkdir()
    (folder / "site.yaml").write_text(GROUND + EXPERIMENTS + f"grid: {{centreline: {drawn}}}\n", encoding="utf-8")
    for name, text in {"u__csv": "x,y,u\n1,2,0.5\n", **files}.items():
        (folder / name.replace("__", ".")).write_text(text, encoding="utf-8")
    code, error = say("import", folder, "--to", tmp_path / "bend.yaml")
    assert code == 2
    assert said in error
    assert len(error.strip().splitlines()) == 1


def test_a_file_on_the_map_of_a_line_is_not_flipped(tmp_path: Path, say: Say) -> None:
    folder = tmp_path / "Bend"
    folder.mkdir()
    site = GROUND + EXPERIMENTS + "grid: {centreline: [[0, 0], [30, 0], [50, 10]]}\nfiles: {u.csv: {flip: x}}\n"
    (folder / "site.yaml").write_text(site, encoding="utf-8")
    (folder / "u.csv").write_text("x,y,u\n1,2,0.5\n", encoding="utf-8")
    code, error = say("import", folder, "--to", tmp_path / "bend.yaml")
    assert code == 2
    assert "u.csv: expected no `flip`" in error


def test_a_line_from_its_other_end(tmp_path: Path) -> None:
    site = GROUND + EXPERIMENTS + SAID + "grid: {centreline: {file: axis.csv, reverse: true}}\n"
    case = imported(tmp_path / "Bend", site, axis__csv=line_file("csv"), a__csv="E,N,u\n683140,247495,0.5\n")
    assert case.grid.centreline is not None
    assert case.grid.centreline.points is not None
    assert case.grid.centreline.points[0] == pytest.approx(POINTS[-1], abs=1e-4)
    assert case.imported is not None
    assert "reversed" in case.imported[0].taken


def test_a_misspelt_key_of_the_grid_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "Brook"
    site = GROUND.replace("{", "{length_m: 30, ", 1) + EXPERIMENTS + "grid: {centerline: [[0, 0], [1, 1]]}\n"
    with pytest.raises(InputError, match=r"`grid\.centerline`.*`centreline`"):
        imported(folder, site, u__csv="x,y,u\n1,0,0.5\n")


def test_without_a_line_the_length_and_the_frame_are_needed(tmp_path: Path, say: Say) -> None:
    folder = tmp_path / "Brook"
    folder.mkdir()
    (folder / "u.csv").write_text("x,y,u\n1,0,0.5\n", encoding="utf-8")
    for site, said in (
        (GROUND + EXPERIMENTS, "`channel.length_m`"),
        (GROUND.replace("{", "{length_m: 30, ", 1) + EXPERIMENTS + "frame: {crs: a}\n", "`frame.origin`"),
    ):
        (folder / "site.yaml").write_text(site, encoding="utf-8")
        code, error = say("import", folder, "--to", tmp_path / "brook.yaml")
        assert code == 2
        assert said in error
