"""Beds and polygons from files, on the map or along the channel, arrive at their place with their levels."""

import json
from pathlib import Path

import numpy as np
import pytest
from field_folders import JUNE, folder_of

import vegglue
from vegglue.arrays import Array
from vegglue.case.frame import Frame
from vegglue.case.grid import Grid
from vegglue.case.gridded_site import build_site
from vegglue.case.polygons import area_of, in_polygon
from vegglue.diagnosis.channel_check import BedHighestInMiddle
from vegglue.errors import InputError
from vegglue.importers.file_options import FileOptions
from vegglue.importers.measured_rows import Placement
from vegglue.importers.terrain import read_geotiff, read_terrain
from vegglue.importers.vector_files import planted_polygons, read_polygons

FRAME = Frame(origin=(5000.0, 2000.0), angle=30.0)
# Of the tags of a GeoTIFF: size of a pixel, where its first corner lies, keys, and what stands for no level.
SCALE, TIE, KEYS, NOTHING = 33550, 33922, 34735, 42113


def plane(x: Array, y: Array) -> Array:
    """A bed that falls along the channel and rises to its left."""
    return 3.0 - 0.01 * x + 0.05 * y


def levels_on_the_map() -> tuple[Array, Array, Array]:
    """East, north and level of a square of 100 m that holds a channel of 40 m by 10 m at 30 degrees."""
    east, north = 4980.0 + np.arange(0.0, 100.0, 1.0), 1980.0 + np.arange(0.0, 100.0, 1.0)
    level = plane(*FRAME.to_model(east[:, None], north[None, :]))
    return east, north, level


def write_geotiff(path: Path) -> None:
    tifffile = pytest.importorskip("tifffile")
    east, north, level = levels_on_the_map()
    corner = (0.0, 0.0, 0.0, east[0] - 0.5, north[-1] + 0.5, 0.0)
    values = level.T[::-1].astype(np.float64)
    values[-1, -1] = -9999.0
    tags = [(SCALE, "d", 3, (1.0, 1.0, 0.0), True), (TIE, "d", 6, corner, True), (NOTHING, "s", 0, "-9999", True)]
    tifffile.imwrite(path, values, extratags=tags)


def write_ascii(path: Path) -> None:
    east, north, level = levels_on_the_map()
    head = [f"ncols {east.size}", f"nrows {north.size}", f"xllcenter {east[0]}", f"yllcenter {north[0]}", "cellsize 1"]
    path.write_text("\n".join([*head, *(" ".join(f"{one:.8f}" for one in row) for row in level.T[::-1])]), "utf-8")


def write_xyz(path: Path) -> None:
    """Scattered points without a heading, as a surveyor's total station gives them."""
    x, y = np.random.default_rng(1).uniform((-2.0, -7.0), (42.0, 7.0), (900, 2)).T
    rows = zip(*FRAME.to_map(x, y), plane(x, y), strict=True)
    path.write_text("\n".join(" ".join(f"{one:.6f}" for one in row) for row in rows), encoding="utf-8")


@pytest.mark.parametrize(
    ("name", "write", "words"),
    [
        ("bed.tif", write_geotiff, FileOptions()),
        ("bed.asc", write_ascii, FileOptions()),
        ("bed.xyz", write_xyz, FileOptions(columns={"x": "1", "y": "2", "z": "3"})),
        ("bed.xyz", write_xyz, FileOptions()),
    ],
)
def test_a_bed_on_the_map_is_read_along_the_channel(tmp_path: Path, name: str, write, words: FileOptions) -> None:
    write(tmp_path / name)
    terrain = read_terrain(tmp_path / name, Placement(FRAME), words, sections=False)
    x, y = np.array([1.0, 20.0, 39.0]), np.array([-4.0, 0.3, 4.0])
    assert np.allclose(terrain.level(x, y), plane(x, y), atol=1e-6)
    assert np.isnan(terrain.level(np.array([500.0]), np.array([0.0]))).all()


def test_a_geotiff_knows_where_it_has_no_level(tmp_path: Path) -> None:
    write_geotiff(tmp_path / "bed.tif")
    raster = read_geotiff(tmp_path / "bed.tif")
    assert np.isnan(raster.values).sum() == 1
    assert np.isnan(raster.values[-1, 0]), "in the south-east"
    (tmp_path / "none.tif").write_bytes(b"II*\x00 nothing of the kind")
    with pytest.raises(InputError, match=r"none\.tif cannot be read as a GeoTIFF"):
        read_geotiff(tmp_path / "none.tif")


def small_geotiff(path: Path, values: Array, *more: tuple[object, ...], **said: str) -> None:
    """Three rows and four columns of 2 m whose first one is at 100 m east, 200 m north."""
    tifffile = pytest.importorskip("tifffile")
    place = [(SCALE, "d", 3, (2.0, 2.0, 0.0), True), (TIE, "d", 6, (0.0, 0.0, 0.0, 100.0, 200.0, 0.0), True)]
    tifffile.imwrite(path, values, extratags=[*place, *more], **said)


@pytest.mark.parametrize("mark", ["-99999.9", "-3.40282346638529e+38", "-1.7976931348623157e+308", "nan"])
def test_a_mark_is_known_among_levels_of_single_precision(tmp_path: Path, mark: str) -> None:
    """-99999.9 was a level of the bed, as float32 holds another number."""
    values = np.full((3, 4), 2.5, dtype=np.float32)
    with np.errstate(over="ignore"):
        values[0, 1] = np.float32(mark)
    small_geotiff(tmp_path / "bed.tif", values, (NOTHING, "s", 0, mark, True))
    raster = read_geotiff(tmp_path / "bed.tif")
    assert np.argwhere(np.isnan(raster.values)).tolist() == [[1, 2]]


@pytest.mark.parametrize(("kind", "first"), [(1, 101.0), (2, 100.0)])
def test_a_geotiff_says_whether_its_places_are_corners_or_middles(tmp_path: Path, kind: int, first: float) -> None:
    """Points stood half a pixel off."""
    keys = (1, 1, 0, 2, 1024, 0, 1, 1, 1025, 0, 1, kind)
    small_geotiff(tmp_path / "bed.tif", np.ones((3, 4)), (KEYS, "H", len(keys), keys, True))
    raster = read_geotiff(tmp_path / "bed.tif")
    assert raster.x[0] == first
    assert raster.y[-1] == 300.0 - first


def test_the_first_of_bands_that_lie_apart_is_read(tmp_path: Path) -> None:
    """A column of all bands was taken for it."""
    values = np.stack([np.full((3, 4), level) for level in (1.0, 7.0)])
    small_geotiff(tmp_path / "bed.tif", values, photometric="minisblack", planarconfig="separate")
    assert (read_geotiff(tmp_path / "bed.tif").values == np.ones((4, 3))).all()


def test_cross_sections_carry_the_thalweg_along_the_channel(tmp_path: Path) -> None:
    """A V whose lowest point moves from the left third to the right third: so it does half-way in between."""
    rows = ["x,y,z"]
    for x, lowest in ((0.0, 2.0), (20.0, -2.0)):
        rows += [f"{x},{y},{z}" for y, z in ((-5, 1.0 - x / 100), (lowest, -x / 100), (5, 1.0 - x / 100))]
    (tmp_path / "sections.csv").write_text("\n".join(rows), encoding="utf-8")
    terrain = read_terrain(tmp_path / "sections.csv", Placement(), FileOptions(), sections=True)
    assert terrain.level(np.array([0.0, 20.0]), np.array([2.0, -2.0])) == pytest.approx([0.0, -0.2])
    assert terrain.level(np.array([10.0, 10.0]), np.array([-5.0, 5.0])) == pytest.approx([0.9, 0.9])
    left, middle, right = terrain.level(np.full(3, 10.0), np.array([-2.0, 0.0, 2.0]))
    assert left == pytest.approx(right, abs=1e-9)
    assert middle < 0.5
    assert np.isnan(terrain.level(np.array([10.0]), np.array([6.0]))).all()


@pytest.mark.parametrize(("names", "spread"), [(True, 0.2), (True, 0.0), (False, 0.0)])
def test_sections_of_a_flume_stay_apart(tmp_path: Path, names: bool, spread: float) -> None:
    """Sections within a metre of one another were made one, and the slope between them was lost."""
    rows = ["section,x,y,z" if names else "x,y,z"]
    for number in range(5):
        for part, z in ((-1, 0.3), (0, 0.1), (1, 0.3)):
            at = f"{0.5 * number + spread * part:.3f},{0.4 * part},{z - 0.02 * number:.3f}"
            rows.append(f"S{number},{at}" if names else at)
    (tmp_path / "sections.csv").write_text("\n".join(rows), encoding="utf-8")
    terrain = read_terrain(tmp_path / "sections.csv", Placement(), FileOptions(), sections=True)
    x = np.linspace(0.0, 2.0, 9)
    assert np.allclose(terrain.level(x, np.zeros(9)), 0.1 - 0.04 * x)
    assert "in 5 cross-sections" in terrain.taken


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("A,0,-1,1\nA,0,1,1\nB,5,0,1\n", "in each cross-section, got one at x = 5 m; name sections"),
        ("A,0,-1,1\nA,0,0,1\nB,0,0,1\nB,0,1,1\n", "got two at x = 0 m; give both one name"),
        ("A,3,-1,1\nA,3,1,1\n", "got one from x = 3 to 3 m"),
    ],
)
def test_sections_that_make_no_bed_are_refused(tmp_path: Path, rows: str, said: str) -> None:
    """One alone ended in a division by zero."""
    (tmp_path / "reach").mkdir()
    (tmp_path / "reach" / "s.csv").write_text(f"section,x,y,z\n{rows}", encoding="utf-8")
    (tmp_path / "reach" / "u.csv").write_text("x,y,u\n3,0,0.5\n", encoding="utf-8")
    june = "bed: {file: s.csv, sections: true}\nexperiments: {June: {discharge: 2, level: 1.6}}\n"
    (tmp_path / "reach" / "site.yaml").write_text(june, encoding="utf-8")
    with pytest.raises(InputError, match=said):
        vegglue.import_folder(tmp_path / "reach", tmp_path / "reach.yaml")


def patches_on_the_map(path: Path) -> None:
    corners = [FRAME.to_map(*corner) for corner in ((12, 0), (16, 0), (16, 2), (12, 2), (12, 0))]
    feature = {"type": "Feature", "properties": {"name": "Willows", "stems": 22}}
    feature["geometry"] = {"type": "Polygon", "coordinates": [corners]}
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}), encoding="utf-8")


def test_a_site_of_survey_and_polygons_becomes_a_case(tmp_path: Path) -> None:
    folder = tmp_path / "Reach"
    folder.mkdir()
    write_geotiff(folder / "dtm.tif")
    patches_on_the_map(folder / "patches.geojson")
    (folder / "u.csv").write_text("x;y;u\n10;0;0.5\n", encoding="utf-8")
    (folder / "site.yaml").write_text(
        "frame: {origin: [5000, 2000], towards: [5008.6602540378, 2005]}\nbed: {file: dtm.tif}\n"
        "grid: {x: [0, 40], y: [-5, 5], cell: [1.0, 0.5]}\npatches: {file: patches.geojson}\n"
        "experiments: {June: {discharge: 8, level: 3.6}}\nfiles: {u.csv: {coordinates: channel}}\n",
        encoding="utf-8",
    )
    case = vegglue.import_folder(folder, tmp_path / "reach.yaml")
    site = build_site(case)
    assert np.allclose(site.bed, plane(site.grid.x[:, None], site.grid.y[None, :]), atol=1e-3)
    assert (site.patch >= 0).sum() == 4 * 4, "4 m by 2 m in cells of 1 m by 0.5 m"
    assert case.plants.patches[0].stems == 22.0
    assert case.frame is not None
    assert case.frame.angle == pytest.approx(30.0)


def test_polygons_of_a_shapefile_are_those_of_geojson(tmp_path: Path) -> None:
    shapefile = pytest.importorskip("shapefile")
    with shapefile.Writer(str(tmp_path / "patches.shp")) as writer:
        writer.field("NAME", "C")
        writer.field("STEMS", "N", decimal=1)
        writer.poly([[list(FRAME.to_map(*corner)) for corner in ((12, 0), (12, 2), (16, 2), (16, 0), (12, 0))]])
        writer.record("Willows", 22.0)
    (found,) = read_polygons(tmp_path / "patches.shp", FRAME)
    patches_on_the_map(tmp_path / "patches.geojson")
    (same,) = read_polygons(tmp_path / "patches.geojson", FRAME)
    assert (found.name, found.density) == (same.name, same.density) == ("Willows", 22.0)
    assert np.allclose(sorted(found.corners), sorted(same.corners))


def square(x: float, y: float, side: float) -> list[list[float]]:
    """Corners of a square, clockwise as the outer rings of a shapefile run."""
    return [[x, y], [x, y + side], [x + side, y + side], [x + side, y], [x, y]]


@pytest.mark.parametrize("name", ["p.shp", "p.geojson"])
def test_parts_and_holes_of_a_polygon_are_kept(tmp_path: Path, name: str) -> None:
    """Of a shapefile only the first part was read, and of holes nothing."""
    rings = [square(0, 0, 4), square(1, 1, 2)[::-1], square(6, 0, 2)]
    if name.endswith(".shp"):
        shapefile = pytest.importorskip("shapefile")
        with shapefile.Writer(str(tmp_path / name)) as writer:
            writer.field("STEMS", "N", decimal=1)
            writer.poly(rings)
            writer.record(22.0)
    else:
        shape = {"type": "MultiPolygon", "coordinates": [rings[:2], rings[2:]]}
        text = json.dumps({"type": "Feature", "geometry": shape, "properties": {"stems": 22}})
        (tmp_path / name).write_text(text, encoding="utf-8")
    found = read_polygons(tmp_path / name, None)
    assert [one.density for one in found] == [22.0, 22.0]
    assert [area_of(np.array(one.corners)) for one in found] == pytest.approx([12.0, 4.0])
    grid = Grid(np.arange(0.25, 9.0, 0.5), np.arange(0.25, 5.0, 0.5), 0.5, 0.5)
    assert [int(in_polygon(tuple(one.corners), grid).sum()) for one in found] == [48, 16]


@pytest.mark.parametrize(("stems", "got"), [(0, "0"), (None, "none"), (-3, "-3")])
def test_a_patch_without_stems_is_refused_beside_others(tmp_path: Path, stems: float | None, got: str) -> None:
    """0 ended in a traceback, and nothing was taken for one stem."""
    features = [
        {
            "type": "Feature",
            "properties": {"stems": one},
            "geometry": {"type": "Polygon", "coordinates": [square(4, 0, 1)]},
        }
        for one in (22, stems)
    ]
    (tmp_path / "a.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}), "utf-8")
    with pytest.raises(InputError, match=rf"expected stems of polygon p2 above 0, up to 1e\+07 1/m2, got {got};"):
        planted_polygons(tmp_path / "a.geojson", None)


@pytest.mark.parametrize(
    ("other", "got"),
    [
        ({"type": "LineString", "coordinates": [[0, 0], [4, 1]]}, "a LineString"),
        ({"type": "GeometryCollection", "geometries": []}, "a GeometryCollection"),
        (None, "one of no place"),
    ],
)
def test_what_is_no_area_is_refused_among_polygons(tmp_path: Path, other: dict[str, object] | None, got: str) -> None:
    """A patch drawn as a line was left out without a word."""
    shapes = [{"type": "Polygon", "coordinates": [square(4, 0, 1)]}, other]
    features = [{"type": "Feature", "properties": {"stems": 22}, "geometry": shape} for shape in shapes]
    (tmp_path / "a.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}), "utf-8")
    with pytest.raises(InputError, match=rf"expected polygons alone, got {got} as feature 2; take it out"):
        read_polygons(tmp_path / "a.geojson", None)


def test_degrees_are_refused_where_the_frame_is_in_metres(tmp_path: Path) -> None:
    text = json.dumps(
        {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [[[8, 47], [8, 48], [9, 47]]]}}
    )
    (tmp_path / "a.geojson").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="got degrees; save it in the projected system"):
        read_polygons(tmp_path / "a.geojson", FRAME)


def test_depths_are_no_levels_of_a_bed(tmp_path: Path) -> None:
    """What to do with them was not said, and named as z they made a ridge, of which `check` was silent."""
    rows = [f"{x},{y},{depth}" for x in (0, 20, 40) for y, depth in ((-3, -0.2), (-1, 0.9), (1, 0.9), (3, -0.2))]
    (tmp_path / "bed.csv").write_text("\n".join(["x,y,depth", *rows]), encoding="utf-8")
    with pytest.raises(InputError, match="take depths off the level of the water above them, and call that z"):
        read_terrain(tmp_path / "bed.csv", Placement(), FileOptions(), sections=False)
    site = "bed: {file: bed.csv, columns: {z: depth}}\n" + JUNE
    folder = folder_of(tmp_path / "brook", site, a__csv="x,y,u\n8,2,0.4\n")
    (tmp_path / "bed.csv").rename(folder / "bed.csv")
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    remarks = vegglue.check(case, runs=tmp_path / "runs").remarks
    assert [one for one in remarks if isinstance(one, BedHighestInMiddle)]


def test_what_a_bed_has_no_use_for_is_told_as_not_read(tmp_path: Path) -> None:
    """Depths alone were; velocities beside the levels of a bed were told as taken."""
    rows = [f"{x},{y},{0.1 * y * y},0.9,0.4" for x in (0, 20, 40) for y in (-3, -1, 1, 3)]
    (tmp_path / "bed.csv").write_text("\n".join(["x,y,z,depth,u", *rows]), encoding="utf-8")
    said = read_terrain(tmp_path / "bed.csv", Placement(), FileOptions(), sections=False).taken
    assert "x from x [m], y from y [m], z from z [m];" in said
    assert said.endswith("not read: depth and u")


@pytest.mark.parametrize(
    ("table", "advice"),
    [
        (
            "River Station,Station,Elevation\n40,1,2.5\n40,2,2.4\n",
            r"got Elevation, River Station, Station; .*flip: \[x, y\]",
        ),
        ("section,x,y,depth below datum\nA,0,1,2.5\nA,0,2,2.4\n", r"or off the datum that they count from"),
        ("Geom Title=Mill\n#Sta/Elev= 2\n 0 3.2 1 2.7\n", "got a geometry of HEC-RAS; write its cross-sections into"),
    ],
)
def test_sections_as_others_keep_them_are_refused_with_what_to_do(tmp_path: Path, table: str, advice: str) -> None:
    """Only the columns that were known were named, and a geometry of HEC-RAS was a row with too many fields."""
    (tmp_path / "bed.g01").write_text(table, encoding="utf-8")
    with pytest.raises(InputError, match=advice):
        read_terrain(tmp_path / "bed.g01", Placement(), FileOptions(), sections=True)


def test_a_bed_of_more_levels_than_a_case_reads_is_refused(tmp_path: Path) -> None:
    """x in mm, say, asked for 30 GB: the memory was full, and nothing said of what."""
    points = "\n".join(["x,y,z", *(f"{x},{y},{abs(y)}" for x in (0, 40) for y in (-4, 0, 4))])
    site = "bed: {file: bed.csv}\ngrid: {x: [0, 40000], y: [-4, 4], cell: [0.5, 0.005]}\n" + JUNE
    folder = folder_of(tmp_path / "brook", site, bed__csv=points, a__csv="x,y,u\n8,2,0.4\n")
    with pytest.raises(InputError, match=r"at most 10,000,000 levels .* got 1\.28e\+10; say larger cells"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


@pytest.mark.parametrize(
    ("crs", "corner", "words"),
    [
        (
            "urn:ogc:def:crs:EPSG::31370",
            (155090.0, 463072.0),
            "expected coordinates in EPSG:28992, .* got EPSG:31370; save",
        ),
        ("EPSG:31370", (155090.0, 463072.0), "expected coordinates in EPSG:28992, .* got EPSG:31370; save"),
        ("urn:ogc:def:crs:OGC:1.3:CRS84", (5.3813, 52.1506), "got degrees; save it in .* of the survey, EPSG:28992"),
        ("urn:ogc:def:crs:EPSG::28992", (155090.0, 463072.0), ""),
    ],
)
def test_polygons_of_another_system_are_refused(
    tmp_path: Path, crs: str, corner: tuple[float, float], words: str
) -> None:
    """With a centreline the frame has no origin, and patches in degrees or of Belgium were planted off the grid."""
    side = 1e-4 if words.startswith("got degrees") else 2.0
    ring = [[corner[0] + side * x, corner[1] + side * y] for x, y in ((0, 0), (1, 0), (1, 1))]
    feature = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
    system = {"type": "name", "properties": {"name": crs}}
    text = json.dumps({"type": "FeatureCollection", "crs": system, "features": [feature]})
    (tmp_path / "a.geojson").write_text(text, encoding="utf-8")
    frame = Frame(origin=(0.0, 0.0), angle=0.0, crs="EPSG:28992")
    if not words:
        assert len(read_polygons(tmp_path / "a.geojson", frame)) == 1
        return
    with pytest.raises(InputError, match=words):
        read_polygons(tmp_path / "a.geojson", frame)
