"""Grids along a centreline: its geometry, and where what stands on the map comes to lie on them."""

from pathlib import Path

import numpy as np
import pytest

from vegglue.case.config import load_case
from vegglue.case.grid import (
    Centreline,
    along_and_across,
    build_grid,
    cell_stretch,
    centreline_of,
    curvature_of,
    heading_at,
    on_map,
)
from vegglue.case.gridded_site import build_site
from vegglue.case.site_schema import CentrelineShape, Stretch
from vegglue.case.zones import corners_of
from vegglue.diagnosis.case_check import check_case
from vegglue.diagnosis.channel_check import PatchAreaMissed
from vegglue.diagnosis.flow_check import GridEndInBend
from vegglue.diagnosis.station_check import StationsOutsideGrid
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations
from vegglue.workflow.twin import write_twin

BEND = CentrelineShape(parts=(Stretch(length=20.0), Stretch(radius=25.0, angle=90.0), Stretch(length=20.0)))
AROUND = 25.0 * np.pi / 2.0
CASE = """
name: bend
grid:
  x: [0, 78]
  y: [-6, 6]
  cell: [1.0, 0.5]
  centreline: {parts: [{length: 20}, {radius: 25, angle: 90}, {length: 20}]}
bed:
  - trapezoid: {axis: 0, bottom_width: 4, bank_slope: 0.5, bed_slope: 0.001, level: 0}
friction: {classes: {bed: {law: manning, n: 0.03}}, default: bed}
plants:
  stands: {reed: {phi: 2, canopy_height: 0.8}}
  patches: [{name: p, stand: reed, polygon: [[43.2, 21], [46.8, 21], [46.8, 29], [43.2, 29]]}]
inflows: {main: {side: west}}
experiments: {one: {discharge: 1.5, level: 1.0}}
observations: [{kind: velocity, file: u.csv}]
"""


def test_an_arc_leads_where_it_must() -> None:
    """A quarter to the left, radius 25 m, after 20 m: it ends at (45, 25), heading along y."""
    line = centreline_of(BEND)
    assert line.s[-1] == pytest.approx(40.0 + AROUND, rel=1e-12)
    x, y = on_map(line, np.array([20.0, 20.0 + AROUND, 20.0 + AROUND / 2.0]), np.array([0.0, 0.0, 5.0]))
    at = 20.0 * np.sin(np.pi / 4.0)
    assert x == pytest.approx([20.0, 45.0, 20.0 + at], abs=1e-6)
    assert y == pytest.approx([0.0, 25.0, 25.0 - at], abs=1e-6)
    assert np.degrees(heading_at(line, np.array([10.0, 20.0 + AROUND / 2.0, 75.0]))) == pytest.approx([0, 45, 90])


def winding() -> Centreline:
    return centreline_of(CentrelineShape(points=((0, 0), (20, 3), (40, -2), (60, 6), (80, 5))))


@pytest.mark.parametrize("line", [centreline_of(BEND), winding()], ids=["arc", "points"])
def test_the_way_back_from_the_map(line: Centreline) -> None:
    """Beside the line, and where it runs on beyond its ends."""
    s, n = (each.ravel() for each in np.meshgrid(np.linspace(-5.0, line.s[-1] + 5.0, 60), np.linspace(-6.0, 6.0, 9)))
    found = along_and_across(line, *on_map(line, s, n))
    assert found[0] == pytest.approx(s, abs=1e-6)
    assert found[1] == pytest.approx(n, abs=1e-6)


def test_a_curve_passes_through_its_points_and_is_as_long_as_it_is() -> None:
    """A quarter of a circle of radius 10 m through seven points is 15.7 m long to a thousandth."""
    angle = np.linspace(0.0, np.pi / 2.0, 7)
    points = tuple(zip(10.0 * np.sin(angle), 10.0 - 10.0 * np.cos(angle), strict=True))
    line = centreline_of(CentrelineShape(points=points))
    assert line.s[-1] == pytest.approx(5.0 * np.pi, rel=1e-3)
    s, n = along_and_across(line, *np.array(points).T)
    assert n == pytest.approx(np.zeros(7), abs=1e-7)
    assert (np.diff(s) > 0.0).all()


def bend_case(folder: Path, text: str = CASE, rows: str = "one,A,25,25,0.5,0.01\n"):
    (folder / "u.csv").write_text("experiment,section,x,y,u,u_se\n" + rows)
    (folder / "bend.yaml").write_text(text)
    return load_case(folder / "bend.yaml")


def test_a_case_in_a_bend(tmp_path: Path) -> None:
    """A station on the map at 20 m from the centre of the arc, a patch across its end; ranges are along and across."""
    middle = 25.0 * np.sin(np.pi / 4.0)
    case = bend_case(tmp_path, rows=f"one,A,{20 + middle:.6f},{25 - middle:.6f},0.5,0.01\n")
    grid, site = build_grid(case), build_site(case)
    assert curvature_of(grid)[[5, 40, 75]] == pytest.approx([0.0, 0.04, 0.0])
    assert cell_stretch(grid)[40, [0, -1]] == pytest.approx([1.23, 0.77])
    table = read_observations(case).table
    assert table[["x", "y"]].to_numpy()[0] == pytest.approx([20.0 + AROUND / 2.0, 0.0], abs=1e-4)
    column, row = np.nonzero(site.main_patch == 0)
    assert grid.x[column].min() == pytest.approx(55.5)
    assert grid.x[column].max() == pytest.approx(62.5)
    assert np.abs(grid.y[row]).max() < 2.0
    assert corners_of(case, case.plants.patches[0])[:, 1].max() < 2.0
    remarks = check_case(case, site, read_observations(case))
    assert not [one for one in remarks if isinstance(one, GridEndInBend | StationsOutsideGrid | PatchAreaMissed)]


def test_surveys_and_rasters_lie_on_the_map(tmp_path: Path) -> None:
    """A bed z = x / 100 + y / 50 of surveyed points, read at the cells of the bend."""
    (tmp_path / "z.csv").write_text(
        "x,y,z\n" + "".join(f"{x},{y},{x / 100 + y / 50}\n" for x in (-20, 80) for y in (-20, 70))
    )
    head = "ncols 50\nnrows 46\nxllcorner -20\nyllcorner -20\ncellsize 2\n"
    rows = [" ".join(str((-19 + 2 * i) / 100 + (71 - 2 * j) / 50) for i in range(50)) for j in range(46)]
    (tmp_path / "z.asc").write_text(head + "\n".join(rows))
    old = "trapezoid: {axis: 0, bottom_width: 4, bank_slope: 0.5, bed_slope: 0.001, level: 0}"
    for layer in ("points: z.csv", "raster: z.asc"):
        case = bend_case(tmp_path, CASE.replace(old, layer))
        grid = build_grid(case)
        assert grid.centreline is not None
        x, y = on_map(grid.centreline, grid.x[:, None], grid.y[None])
        assert build_site(case).bed == pytest.approx(x / 100 + y / 50, abs=1e-9)


def test_a_twin_writes_its_stations_on_the_map(tmp_path: Path) -> None:
    case = bend_case(tmp_path, rows="one,A,38,7.5,0.5,0.01\none,A,37,8.5,0.5,0.01\n")
    table = read_observations(case).table
    twin = write_twin(case, tmp_path / "twin", table, "")
    again = read_observations(load_case(twin)).table
    assert again[["x", "y"]].to_numpy() == pytest.approx(table[["x", "y"]].to_numpy(), abs=2e-5)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("radius: 25", "radius: 6", "radius of 6 m at x ="),
        ("{length: 20}, {radius", "{length: 20, radius: 3}, {radius", "`radius`"),
        (", angle: 90", "", "`angle`"),
        ("centreline: {parts", "centreline: {points: [[0, 0], [1, 1]], parts", "`points` or `parts`"),
    ],
)
def test_a_line_that_cannot_be_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        build_grid(bend_case(tmp_path, CASE.replace(old, new, 1)))


def test_a_grid_that_ends_in_a_bend_is_remarked(tmp_path: Path) -> None:
    case = bend_case(tmp_path, CASE.replace(", {length: 20}]", "]").replace("[0, 78]", "[0, 59]"))
    said = check_case(case, build_site(case), read_observations(case))
    assert GridEndInBend(False, pytest.approx(25.0)) in said
