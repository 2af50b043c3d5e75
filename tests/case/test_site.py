"""The site: bed from design numbers, rasters and points; classes by rule, place and raster; patches by cell centre."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from reach import write_reach

from vegglue.case.bed import read_raster
from vegglue.case.channel_geometry import channel_geometry, site_scales
from vegglue.case.config import load_case
from vegglue.case.grid import Grid
from vegglue.case.gridded_site import Site, build_site, cells_at, in_experiment, rims
from vegglue.case.resolved_config import dumped
from vegglue.errors import InputError
from vegglue.flow.problem_setup import build_problem

CONFIGS = Path(__file__).parents[2] / "configs"
CHANNEL = {"axis": 0.0, "bottom_width": 3.0, "top_width": 7.0, "bank_slope": 0.5, "bed_slope": 0.01, "level": 2.0}
PLANE = "ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 2\nNODATA_value -9999\n"


def site(folder: Path, **changes):
    """Site of an 8 m x 6 m case with cells of 1 m, changed at its top level."""
    tree = {
        "name": "small",
        "grid": {"x": [0, 8], "y": [0, 6], "cell": [1, 1]},
        "bed": [{"trapezoid": CHANNEL | {"axis": 3.0}}],
        "friction": {
            "classes": {"bed": {"law": "chezy", "c": 40}, "bank": {"law": "chezy", "c": 20}},
            "default": "bed",
        },
        "inflows": {"upstream": {"side": "west"}},
        "experiments": {"one": {"discharge": 1, "level": 3}},
    }
    path = folder / "small.yaml"
    path.write_text(yaml.safe_dump(tree | changes, sort_keys=False))
    return build_site(load_case(path))


def zones(*rules):
    classes = {"bed": {"law": "chezy", "c": 40}, "bank": {"law": "chezy", "c": 20}}
    return {"classes": classes, "default": "bed", "zones": list(rules)}


def test_trapezoid_is_floor_bank_and_flat_top(tmp_path):
    built = site(tmp_path, grid={"x": [10, 18], "y": [-5, 5], "cell": [2, 1]}, bed=[{"trapezoid": CHANNEL}])
    assert built.grid.x.tolist() == [11, 13, 15, 17]
    assert built.grid.y.tolist() == [-4.5, -3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5, 4.5]
    across = np.array([1.0, 1.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0])
    assert built.bed == pytest.approx(across[None, :] + 2.0 - 0.01 * np.array([1, 3, 5, 7])[:, None])


def test_banks_without_a_top_rise_to_the_edge(tmp_path):
    channel = {key: value for key, value in CHANNEL.items() if key != "top_width"}
    built = site(tmp_path, grid={"x": [0, 4], "y": [-9, 9], "cell": [1, 1]}, bed=[{"trapezoid": channel}])
    assert np.diff(built.bed[0, -6:]) == pytest.approx(0.5)


def test_the_papers_site():
    built = build_site(load_case(CONFIGS / "d3a.yaml"))
    assert built.bed.shape == (1142, 40)
    assert built.class_names == ("bed", "bank")
    # Floor from y = 4 to 7, and all that is not floor, up to both edges of the grid, is bank.
    floor = (built.grid.y > 4) & (built.grid.y < 7)
    assert floor.sum() == 8
    assert np.array_equal(built.friction_class, np.broadcast_to(~floor, built.bed.shape).astype(int))
    assert built.bed[-1, floor] == pytest.approx(-0.571 + 0.001 * 0.25)
    assert [(built.patch == index).sum() for index in range(7)] == [8 * 4] * 7
    i, j = np.nonzero(built.patch == 1)
    assert (built.grid.x[i].min(), built.grid.x[i].max()) == (408.25, 411.75)
    assert (built.grid.y[j].min(), built.grid.y[j].max()) == (5.6875, 6.8125)
    assert np.all(built.friction_class[built.patch >= 0] == 0)


def test_raster_of_a_plane_is_exact_between_its_centres(tmp_path):
    # z = x + 10 y at the centres x = 1, 3, 5, 7 and y = 1, 3, 5; the first row of the file is the northernmost.
    rows = "\n".join(" ".join(str(x + 10 * y) for x in (1, 3, 5, 7)) for y in (5, 3, 1))
    (tmp_path / "bed.asc").write_text(PLANE + rows)
    built = site(tmp_path, bed=[{"raster": "bed.asc"}])
    expected = np.clip(built.grid.x, 1, 7)[:, None] + 10 * np.clip(built.grid.y, 1, 5)[None, :]
    assert built.bed == pytest.approx(expected)


def test_raster_by_centre_is_shifted_by_half_a_cell(tmp_path):
    header = PLANE.replace("xllcorner 0", "xllcenter 1").replace("yllcorner 0", "yllcenter 1")
    (tmp_path / "bed.asc").write_text(header + "\n".join("1 3 5 7" for _ in range(3)))
    assert site(tmp_path, bed=[{"raster": "bed.asc"}]).bed[3, 0] == pytest.approx(3.5)


def test_where_a_raster_has_no_data_the_layer_below_shows(tmp_path):
    (tmp_path / "scour.asc").write_text(PLANE + "-9999 -9999 -9999 -9999\n-9999 -1 -1 -9999\n-9999 -1 -1 -9999\n")
    below, built = site(tmp_path), site(tmp_path, bed=[{"trapezoid": CHANNEL | {"axis": 3.0}}, {"raster": "scour.asc"}])
    scoured = built.bed == -1
    assert np.array_equal(scoured, (np.isin(built.grid.x, [3.5, 4.5]))[:, None] & (built.grid.y < 3)[None, :])
    assert np.array_equal(built.bed[~scoured], below.bed[~scoured])


def test_survey_points_of_a_plane_are_exact(tmp_path):
    generator = np.random.default_rng(2)
    inner = generator.uniform([0, 0], [8, 6], (40, 2))
    points = np.vstack([inner, [[-1, -1], [9, -1], [-1, 7], [9, 7]]])
    lines = [f"{x},{y},{0.5 - 0.1 * x + 0.3 * y}" for x, y in points]
    (tmp_path / "survey.csv").write_text("x,y,z\n" + "\n".join(lines))
    built = site(tmp_path, bed=[{"points": "survey.csv"}])
    assert built.bed == pytest.approx(0.5 - 0.1 * built.grid.x[:, None] + 0.3 * built.grid.y[None, :])


def test_cells_without_a_level_are_refused(tmp_path):
    (tmp_path / "survey.csv").write_text("x,y,z\n0,0,1\n8,0,1\n8,6,1\n")
    with pytest.raises(InputError, match=r"^(?!/).*small.yaml: `bed` .* 24 of 48 .* x = 0.5, y = 0.5 m"):
        site(tmp_path, bed=[{"points": "survey.csv"}])


TWO = "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 2\n"
BAD_SURVEYS = [
    ("x,y\n1,2\n", ("x, y and z",)), ("x,y,z\n0,0,1\n1,0,high\n", ("data row 2", "column z", "'high'")),
    ("x,y,z\n0,0,1\n1,0\n", ("data row 2", "column z")), ("x,y,z\n0,0,1\n1,1,1\n2,2,1\n", ("three", "got 3")),
    ("x,y,z\n", ("three", "got 0")), ("x,y,z\n0,0,1,5\n", ("data row 1",)),
    (f"x,y,z\n{'1' * 200_000},0,0\n", ("CSV",)),
]  # fmt: skip
BAD_RASTERS = [
    ("1 2 3\n", ("`ncols`",)), ("", ("`ncols`",)), (TWO.replace("ncols 2", "ncols -2"), ("`ncols`", "-2")),
    (PLANE.replace("cellsize 2", "cellsize 0") + "1 " * 12, ("`cellsize`",)),
    (PLANE.replace("xllcorner 0\n", "") + "1 " * 12, ("`xllcorner`", "`xllcenter`")),
    (PLANE.replace("ncols 4", "ncols") + "1 " * 12, ("line 1:", "`ncols`")),
    (TWO.replace("nrows 2", "nrows 0.5") + "1 2\n", ("`nrows`", "0.5")),
    (TWO.replace("ncols 2", "ncols 1e300") + "1 2\n", ("got 2",)), (TWO + "1 2 3\n", ("= 4", "got 3")),
    (PLANE + "1 " * 11, ("= 12", "got 11")), (PLANE + "1 1 1 1\n1 x 1 1\n1 1 1 1\n", ("line 8", "'x'")),
    (TWO + "1 2\n3 inf\n", ("line 7", "'inf'")), (TWO + "1 2\n3 1,5x\n", ("line 7", "x'")),
]  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "text", "words"),
    [*(("points", *one) for one in BAD_SURVEYS), *(("raster", *one) for one in BAD_RASTERS)],
    ids=lambda text: str(text)[:20],
)
def test_a_bad_survey_or_raster_is_refused(tmp_path, kind, text, words):
    (tmp_path / "bed.asc").write_text(text)
    with pytest.raises(InputError) as refused:
        site(tmp_path, bed=[{kind: "bed.asc"}])
    assert all(word in str(refused.value) for word in ("bed.asc", *words))


def test_no_more_of_a_raster_is_read_than_the_limit(tmp_path, monkeypatch):
    monkeypatch.setattr("vegglue.case.bed.LARGEST_DATA", 20)
    (tmp_path / "bed.asc").write_text(TWO + "1 2\n3 4\n")
    with pytest.raises(InputError, match="20 bytes"):
        read_raster(tmp_path / "bed.asc")


@pytest.mark.parametrize(
    ("rule", "rows"),
    [
        # Floor from y = 2 to 6, banks 2 m wide on both sides, flat beyond them.
        ({"steeper_than": 0.2}, [0, 1, 6, 7]),
        ({"beyond_slope_break": 0.2}, [-2, -1, 0, 1, 6, 7, 8, 9]),
        ({"y": [2, 4]}, [2, 3]),
    ],
)
def test_classes_by_rule(tmp_path, rule, rows):
    grid = {"x": [0, 4], "y": [-2, 10], "cell": [1, 1]}
    channel = CHANNEL | {"axis": 4.0, "bottom_width": 4.0, "top_width": 8.0}
    built = site(tmp_path, grid=grid, bed=[{"trapezoid": channel}], friction=zones({"class": "bank"} | rule))
    found = np.floor(built.grid.y[built.friction_class[1] == 1]).astype(int)
    assert found.tolist() == rows


def test_classes_by_place_later_ones_win(tmp_path):
    triangle = {"class": "bank", "polygon": [[0, 0], [8, 0], [0, 6]]}
    built = site(tmp_path, friction=zones(triangle, {"class": "bed", "x": [0, 2], "y": [0, 2]}))
    inside = built.grid.x[:, None] / 8 + built.grid.y[None, :] / 6 < 1
    inside[:2, :2] = False
    assert np.array_equal(built.friction_class == 1, inside)


def test_classes_by_raster(tmp_path):
    (tmp_path / "classes.asc").write_text(PLANE + "1 1 2 2\n1 1 -9999 2\n2 1 1 1\n")
    rule = {"raster": "classes.asc", "values": {1: "bed", 2: "bank"}}
    built = site(tmp_path, friction=zones({"class": "bank", "x": [4, 6]}, rule))
    blocks = np.array([[1, 0, 0], [0, 0, 0], [0, 1, 1], [0, 1, 1]])
    assert np.array_equal(built.friction_class, np.kron(blocks, np.ones((2, 2), dtype=int)))
    with pytest.raises(InputError, match=r"classes.asc: .* 2: .*`values`"):
        site(tmp_path, friction=zones(rule | {"values": {1: "bed"}}))


def test_patches_take_the_cells_that_they_cover_half_of(tmp_path):
    stands = {"reed": {"phi": 1.0, "canopy_height": 0.5}}
    square = {"name": "a", "stand": "reed", "x": [1.4, 3.4], "y": [1.6, 3.4]}
    bow = {"name": "b", "stand": "reed", "polygon": [[4, 0], [8, 0], [8, 6], [6, 6], [6, 2], [4, 2]]}
    built = site(tmp_path, plants={"stands": stands, "patches": [square, bow]})
    expected = np.full((8, 6), -1)
    expected[1:3, 2] = 0
    expected[4:8, 0:2] = 1
    expected[6:8, 2:6] = 1
    assert np.array_equal(built.main_patch, expected)
    assert built.cover[1:4, 1:4] == pytest.approx(np.outer([0.6, 1.0, 0.4], [0.4, 1.0, 0.4]))


def test_an_experiment_may_have_a_bed_of_its_own(tmp_path):
    """Layers over those of the case, in that experiment only; banks and what effects see of the channel follow."""
    deeper = [{"trapezoid": CHANNEL | {"axis": 3.0, "level": 1.5, "bottom_width": 5.0, "top_width": 5.5}}]
    experiments = {"one": {"discharge": 1, "level": 3}, "after": {"discharge": 1, "level": 3, "bed": deeper}}
    built = site(tmp_path, experiments=experiments, friction=zones({"class": "bank", "steeper_than": 0.2}))
    case = load_case(tmp_path / "small.yaml")
    before, after = in_experiment(built, "one"), in_experiment(built, "after")
    assert before is built
    assert (before.bed - after.bed)[:, 2:4] == pytest.approx(0.5)
    assert before.friction_class.sum() > after.friction_class.sum()
    for name, now in (("one", before), ("after", after)):
        assert np.array_equal(build_problem(case, built, name, {}).bed, now.bed)
        assert np.array_equal(channel_geometry(case, built, name).bed[..., 0], now.bed)
    assert site(tmp_path, experiments={"one": experiments["one"]}).own == {}
    assert "bed" not in dumped(load_case(tmp_path / "small.yaml"))["experiments"]["one"]


def test_a_place_on_an_edge_is_in_its_lowest_cell() -> None:
    """The toes of both banks are on the floor, whichever way an edge would be rounded."""
    site = build_site(load_case(CONFIGS / "twin.yaml"))
    grid, middle = site.grid, len(site.grid.x) // 2
    edges = grid.y[:-1] + 0.5 * grid.dy
    i, j = cells_at(site, np.full(edges.size, grid.x[middle]), edges)
    assert (i == middle).all()
    assert (site.bed[i, j] == np.minimum(site.bed[middle, :-1], site.bed[middle, 1:])).all()
    outermost = cells_at(site, np.array([-1e3, 1e3]), np.array([-1e3, 1e3]))
    assert [one.tolist() for one in outermost] == [[0, grid.x.size - 1], [0, grid.y.size - 1]]
    at_centres = cells_at(site, grid.x[[2, 5]], grid.y[[3, 4]])
    assert [one.tolist() for one in at_centres] == [[2, 5], [3, 4]]


def test_plants_stand_inside_their_own_patch_whatever_is_beside_it(tmp_path: Path) -> None:
    """Beside another patch, or around a denser one, some seemed to stand outside."""
    first = "    - {name: p1, stand: willow, x: [12, 16], y: [0, 1.5]}\n"
    more = "".join(
        f"    - {{name: {name}, stand: willow, x: {x}, y: {y}}}\n"
        for name, x, y in (("p2", [12, 16], [1.5, 3.0]), ("p3", [20, 28], [-2.0, 2.0]), ("p4", [23, 25], [-0.5, 0.5]))
    )
    case = load_case(write_reach(tmp_path, (first, first + more), ("cell: [1.0, 0.5]", "cell: [1.0, 0.25]")))
    geometry = channel_geometry(case, build_site(case), "June")
    planted = geometry.planted[..., 0] > 0
    assert planted.any()
    assert geometry.edge[..., 0][planted].max() < 0.0


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        # the bank falls to the stream: no hollow, nor for a sill downstream that all of the stream has
        ([[0.9, 0.5, 0.1, 0.6], [0.9, 0.7, 0.4, 0.6], [0.9, 0.5, 0.0, 0.6]], [0.0, 0.0, 0.0, 0.0]),
        # a hollow on the bank, closed by a rim at 0.9 beside it and at 0.8 in the next column, over 0.7
        ([[0.3, 0.9, 0.1, 0.6], [0.5, 0.8, 0.1, 0.6], [0.9, 0.9, 0.0, 0.6]], [0.5, 0.0, 0.0, 0.0]),
        # an arm of its own to the outlet, past an island
        ([[0.3, 0.9, 0.1, 0.6], [0.2, 0.9, 0.1, 0.6], [0.1, 0.9, 0.0, 0.6]], [0.0, 0.0, 0.0, 0.0]),
    ],
    ids=["bank", "hollow", "arm"],
)
def test_the_rim_of_a_hollow_beside_the_inflow(rows: list[list[float]], expected: list[float]) -> None:
    bed = np.array(rows)
    nowhere = np.full(bed.shape, -1)
    site = Site(Grid(np.arange(3.0), np.arange(4.0), 1.0, 1.0), bed, nowhere + 1, ("bed",), nowhere, 0.0 * bed)
    assert rims(site, "west", 0, 4)[:, 0] == pytest.approx(expected)


def test_scales_of_a_site_are_those_of_its_priors() -> None:
    """A case with another prior of a parameter, or least argument of the logarithm, was given those of the first."""
    case = load_case(CONFIGS / "twin.yaml")
    first = site_scales(case)
    taller = case.parameters["canopy_height"].model_copy(update={"mean": 1.0})
    priors = {**case.parameters, "canopy_height": taller}
    assert site_scales(case.model_copy(update={"parameters": priors})).canopy > first.canopy + 0.2
    assert site_scales(case.model_copy(update={"parameters": dict(case.parameters)})) is first
    # A floor so rough that its Chézy coefficient is the least one.
    rough = case.parameters["k_s"].model_copy(update={"low": 20.0, "high": 30.0})
    of_floor = case.friction.model_copy(update={"default": "bank"})
    floor = case.model_copy(update={"friction": of_floor, "parameters": {**case.parameters, "k_s": rough}})
    cases = [
        floor.model_copy(update={"numerics": case.numerics.model_copy(update={"bank_argument_minimum": least})})
        for least in (2.0, 4.0)
    ]
    shear = [site_scales(one).shear_velocity for one in cases]
    assert shear[0] > 1.5 * shear[1]
