"""Beds, polygons and classes from files arrive at their place with their levels, in their system, or are refused."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from field_folders import CHANNEL, JUNE, folder_of, import_of, imported, refusal, refusal_of

import vegglue
from vegglue.arrays import Array
from vegglue.case.bed_error import bed_error_columns, without_surveys
from vegglue.case.grid import Grid
from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case, ModelError
from vegglue.case.site_schema import Frame
from vegglue.case.zones import in_polygon, signed_area
from vegglue.cli.commands import import_command
from vegglue.errors import InputError
from vegglue.importers.coordinate_systems import system_of_wkt
from vegglue.importers.file_options import FileOptions
from vegglue.importers.measured_rows import Placement
from vegglue.importers.terrain import Terrain, read_geotiff, read_terrain
from vegglue.importers.vector_files import planted_polygons, read_polygons, summary_of_plants
from vegglue.workflow.import_folder import assumptions_of, unnamed_banks

FRAME = Frame(origin=(5000.0, 2000.0), angle=30.0)
# Of the tags of a GeoTIFF: size of a pixel, where its first corner lies, keys, mark of no level, what GDAL keeps.
SCALE, TIE, KEYS, NOTHING, GDAL = 33550, 33922, 34735, 42113, 42112


def plane(x: Array, y: Array) -> Array:
    """A bed that falls along the channel and rises to its left."""
    return 3.0 - 0.01 * x + 0.05 * y


def levels_on_the_map() -> tuple[Array, Array, Array]:
    """East, north and level of a square of 100 m that holds a channel of 40 m by 10 m at 30 degrees."""
    east, north = 4980.0 + np.arange(0.0, 100.0, 1.0), 1980.0 + np.arange(0.0, 100.0, 1.0)
    return east, north, plane(*FRAME.to_model(east[:, None], north[None, :]))


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
    ("name", "write", "columns"),
    [
        ("bed.tif", write_geotiff, {}), ("bed.asc", write_ascii, {}), ("bed.xyz", write_xyz, {}),
        ("bed.xyz", write_xyz, {"x": "1", "y": "2", "z": "3"}),
    ],
)  # fmt: skip
def test_a_bed_on_the_map_is_read_along_the_channel(
    tmp_path: Path, name: str, write: Callable[[Path], None], columns: dict[str, str]
) -> None:
    write(tmp_path / name)
    terrain = read_terrain(tmp_path / name, Placement(FRAME), FileOptions(columns=columns), sections=False)
    x, y = np.array([1.0, 20.0, 39.0]), np.array([-4.0, 0.3, 4.0])
    assert np.allclose(terrain.level(x, y), plane(x, y), atol=1e-6)
    assert np.isnan(terrain.level(np.array([500.0]), np.array([0.0]))).all()


def small_geotiff(folder: Path, values: Array, *more: tuple[object, ...], **settings: str) -> Path:
    """Three rows and four columns of 2 m whose first one is at 100 m east, 200 m north."""
    tifffile = pytest.importorskip("tifffile")
    place = [(SCALE, "d", 3, (2.0, 2.0, 0.0), True), (TIE, "d", 6, (0.0, 0.0, 0.0, 100.0, 200.0, 0.0), True)]
    tifffile.imwrite(folder / "bed.tif", values, extratags=[*place, *more], **settings)
    return folder / "bed.tif"


@pytest.mark.parametrize("mark", ["-99999.9", "-3.40282346638529e+38", "-1.7976931348623157e+308", "nan"])
def test_a_mark_is_known_among_levels_of_single_precision(tmp_path: Path, mark: str) -> None:
    """-99999.9 was a level of the bed, as float32 holds another number."""
    values = np.full((3, 4), 2.5, dtype=np.float32)
    with np.errstate(over="ignore"):
        values[0, 1] = np.float32(mark)
    raster = read_geotiff(small_geotiff(tmp_path, values, (NOTHING, "s", 0, mark, True)))
    assert np.argwhere(np.isnan(raster.values)).tolist() == [[1, 2]]


@pytest.mark.parametrize("mark", [-9999.0, -999.0, 1e20, -3.4e38, -32768.0, 0.0, 9999.0, np.inf])
@pytest.mark.parametrize("ending", ["tif", "asc"])
def test_a_fill_value_that_is_not_declared_is_no_level(tmp_path: Path, mark: float, ending: str) -> None:
    values = 431.0 + 0.1 * np.arange(12.0).reshape(3, 4)
    values[1, 2] = mark
    if ending == "asc":
        if np.isinf(mark):
            pytest.skip("refused by its reader")
        head = "ncols 4\nnrows 3\nxllcorner 100\nyllcorner 194\ncellsize 2\nnodata_value -1\n"
        path = tmp_path / "bed.asc"
        path.write_text(head + "\n".join(" ".join(map(str, row)) for row in values.tolist()), encoding="utf-8")
    else:
        path = small_geotiff(tmp_path, values.astype(np.float32))
    terrain = read_terrain(path, Placement(), FileOptions(), sections=False)
    level = terrain.level(np.array([101.0, 105.0]), np.array([199.0, 197.0]))
    assert level[0] == pytest.approx(431.0, abs=1e-3)
    assert np.isnan(level[1])
    assert "11 levels" in terrain.taken
    assert "1 undeclared" in terrain.taken


def test_a_pool_is_no_fill_value(tmp_path: Path) -> None:
    values = 1.0 + 0.1 * np.arange(12.0).reshape(3, 4)
    values[1, 2] = -1.0
    terrain = read_terrain(small_geotiff(tmp_path, values), Placement(), FileOptions(), sections=False)
    assert "12 levels" in terrain.taken


@pytest.mark.parametrize(("kind", "first"), [(1, 101.0), (2, 100.0)])
def test_a_geotiff_has_places_of_corners_or_of_middles(tmp_path: Path, kind: int, first: float) -> None:
    """Points stood half a pixel off."""
    keys = (1, 1, 0, 2, 1024, 0, 1, 1, 1025, 0, 1, kind)
    raster = read_geotiff(small_geotiff(tmp_path, np.ones((3, 4)), (KEYS, "H", len(keys), keys, True)))
    assert (raster.x[0], raster.y[-1]) == (first, 300.0 - first)


def test_the_first_of_bands_that_lie_apart_is_read(tmp_path: Path) -> None:
    """A column of all bands was taken for it."""
    values = np.stack([np.full((3, 4), level) for level in (1.0, 7.0)])
    path = small_geotiff(tmp_path, values, photometric="minisblack", planarconfig="separate")
    assert (read_geotiff(path).values == np.ones((4, 3))).all()
    (tmp_path / "none.tif").write_bytes(b"II*\x00 nothing of the kind")
    with pytest.raises(InputError, match=r"none\.tif"):
        read_geotiff(tmp_path / "none.tif")


SCALED = '<Item name="SCALE" sample="0" role="scale">0.01</Item><Item name="OFFSET" sample="0" role="offset">'


@pytest.mark.parametrize(
    ("item", "keys", "level"),
    [
        (f"{SCALED}400</Item>", (), 402.0),
        ('<Item name="UNITTYPE" sample="0" role="unittype">ft</Item>', (), 60.96),
        ("", (4099, 0, 1, 9003), 200 * 1200 / 3937),
        ("", (4099, 0, 1, 9001), 200.0),
    ],
)
def test_scale_offset_and_unit_of_a_geotiff_count(
    tmp_path: Path, item: str, keys: tuple[int, ...], level: float
) -> None:
    tags: list[tuple[object, ...]] = [(GDAL, "s", 0, f"<GDALMetadata>{item}</GDALMetadata>", True)] if item else []
    directory = (1, 1, 0, 2, 1024, 0, 1, 1, *keys)
    tags += [(KEYS, "H", len(directory), directory, True)] if keys else []
    raster = read_geotiff(small_geotiff(tmp_path, np.full((3, 4), 200, dtype=np.int16), *tags))
    assert raster.values == pytest.approx(np.full((4, 3), level))


@pytest.mark.parametrize(
    ("keys", "refused"),
    [
        ((3072, 0, 1, 2056), False), ((3072, 0, 1, 21781), True), ((3072, 0, 1, 32767), False),
        ((3076, 0, 1, 9003), True),
        ((3076, 0, 1, 9001), False), ((), True),
    ],
)  # fmt: skip
def test_a_geotiff_of_another_system_is_refused(tmp_path: Path, keys: tuple[int, ...], refused: bool) -> None:
    """Without further keys its places are degrees."""
    directory = (1, 1, 0, 1 + bool(keys), 1024, 0, 1, 1 if keys else 2, *keys)
    path = small_geotiff(tmp_path, np.ones((3, 4)), (KEYS, "H", len(directory), directory, True))
    frame = Frame(origin=(0.0, 0.0), angle=0.0, crs="EPSG:2056")
    if not refused:
        assert read_geotiff(path, frame).values.shape == (4, 3)
        return
    with pytest.raises(InputError, match=r"bed\.tif.*EPSG:2056"):
        read_geotiff(path, frame)


@pytest.mark.parametrize(("dtype", "predictor"), [("f4", 1), ("f4", 3), ("u1", 1), ("u1", 2)])
def test_a_geotiff_packed_by_lzw_is_read(tmp_path: Path, dtype: str, predictor: int) -> None:
    """Long enough for codes of twelve bits and a cleared table."""
    image = pytest.importorskip("PIL.Image")
    from PIL import TiffImagePlugin

    rng = np.random.default_rng(1)
    values = rng.integers(0, 9, (120, 97)).astype(dtype) + (rng.normal(0, 3, (120, 97)) if dtype == "f4" else 0)
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    for code, numbers in ((SCALE, (2.0, 2.0, 0.0)), (TIE, (0.0, 0.0, 0.0, 100.0, 900.0, 0.0))):
        tags[code] = numbers
        tags.tagtype[code] = 12
    tags[317] = predictor
    image.fromarray(values.astype(dtype)).save(tmp_path / "bed.tif", compression="tiff_lzw", tiffinfo=tags)
    assert np.array_equal(read_geotiff(tmp_path / "bed.tif").values.T[::-1], values.astype(dtype).astype(float))


def sections_of(folder: Path, rows: list[str]) -> Terrain:
    (folder / "sections.csv").write_text("\n".join(rows), encoding="utf-8")
    return read_terrain(folder / "sections.csv", Placement(), FileOptions(), sections=True)


def test_cross_sections_carry_the_thalweg_along_the_channel(tmp_path: Path) -> None:
    """A V whose lowest point moves from the left third to the right third: so it does half-way in between."""
    rows = ["x,y,z"]
    for x, lowest in ((0.0, 2.0), (20.0, -2.0)):
        rows += [f"{x},{y},{z}" for y, z in ((-5, 1.0 - x / 100), (lowest, -x / 100), (5, 1.0 - x / 100))]
    terrain = sections_of(tmp_path, rows)
    assert terrain.level(np.array([0.0, 20.0]), np.array([2.0, -2.0])) == pytest.approx([0.0, -0.2])
    assert terrain.level(np.array([10.0, 10.0]), np.array([-5.0, 5.0])) == pytest.approx([0.9, 0.9])
    left, middle, right = terrain.level(np.full(3, 10.0), np.array([-2.0, 0.0, 2.0]))
    assert left == pytest.approx(right, abs=1e-9)
    assert middle < 0.5
    assert np.isnan(terrain.level(np.array([10.0]), np.array([6.0]))).all()


def test_a_survey_of_sections_states_the_error_of_its_bed(tmp_path: Path) -> None:
    """It grows between the lines, each line is left out in turn, and usual errors of sides and places are assumed."""
    random = np.random.default_rng(1)
    across = np.arange(-5.0, 5.1, 1.0)
    rows = [
        f"P{x},{x},{y},{0.3 + 0.02 * y**2 + 0.1 * np.sin(x / 4.0 + y / 2.0) + 0.01 * random.standard_normal():.3f}"
        for x in range(0, 49, 8)
        for y in across
    ]
    site = "bed: {file: s.csv, sections: true}\npatches: {file: p.csv}\n" + JUNE
    corners = [f"reeds,{x},{y},20" for x, y in ((10, 1), (20, 1), (20, 4), (10, 4))]
    case = import_of(
        tmp_path, site, s__csv="\n".join(["section,x,y,z", *rows]), p__csv="\n".join(["name,x,y,stems", *corners]),
        u__csv="x,y,u\n12,0,0.5\n",
    ).case  # fmt: skip
    (layer,) = case.bed
    assert layer.survey is not None
    assert layer.survey.left_out is not None
    assert layer.survey.left_out.count == 5
    assert sum(one.chance for one in layer.survey.covariances) == pytest.approx(1.0)
    site_of_case = build_site(case)
    error = np.linalg.norm(bed_error_columns(case, site_of_case.grid), axis=1).reshape(site_of_case.bed.shape)
    x, middle = site_of_case.grid.x, error.shape[1] // 2
    on, between = (error[np.abs(x - at).argmin(), middle] for at in (24.0, 28.0))
    assert on < 0.6 * between
    assert case.model_error == ModelError(friction=0.05, bed=0.01, edges=0.1, probes=0.03)
    (plain,) = without_surveys(case).bed
    assert plain.survey is None


def test_a_bed_by_design_has_no_error_between_its_lines(tmp_path: Path) -> None:
    rows = [f"P{x},{x},{y},{0.3 - 0.002 * x + 0.02 * y**2:.5f}" for x in range(0, 49, 8) for y in range(-5, 6)]
    bed, site = "\n".join(["section,x,y,z", *rows]), "bed: {file: s.csv, sections: true}\n" + JUNE
    case = import_of(tmp_path, site, s__csv=bed, u__csv="x,y,u\n12,0,0.5\n").case
    assert case.bed[0].survey is None


@pytest.mark.parametrize(("first", "wide"), [(-2.0, 5.0), (0.0, 4.0)])
def test_a_design_known_by_many_points_has_no_error_between_them(tmp_path: Path, first: float, wide: float) -> None:
    """Its mean cross-section predicts all of them to rounding, or their covariance is singular to rounding."""
    x, y = (one.ravel() for one in np.meshgrid(np.arange(first, 32.0 - first), np.arange(-wide, wide + 0.1, 0.5)))
    z = -0.001 * x + 0.5 * np.maximum(np.abs(y) - 1.5, 0.0)
    bed = "\n".join(["x,y,z", *(f"{a:g},{b:g},{c:.3f}" for a, b, c in zip(x, y, z, strict=True))])
    case = import_of(tmp_path, f"bed: {{file: s.csv}}\n{JUNE}", s__csv=bed, u__csv="x,y,u\n12,0,0.5\n").case
    assert case.bed[0].survey is None


@pytest.mark.parametrize(("names", "spread"), [(True, 0.2), (True, 0.0), (False, 0.0)])
def test_sections_of_a_flume_stay_apart(tmp_path: Path, names: bool, spread: float) -> None:
    """Sections within a metre of one another were made one, and the slope between them was lost."""
    rows = ["section,x,y,z" if names else "x,y,z"]
    for number in range(5):
        for part, z in ((-1, 0.3), (0, 0.1), (1, 0.3)):
            at = f"{0.5 * number + spread * part:.3f},{0.4 * part},{z - 0.02 * number:.3f}"
            rows.append(f"S{number},{at}" if names else at)
    terrain = sections_of(tmp_path, rows)
    x = np.linspace(0.0, 2.0, 9)
    assert np.allclose(terrain.level(x, np.zeros(9)), 0.1 - 0.04 * x)
    assert "5 cross-sections" in terrain.taken


@pytest.mark.parametrize(
    ("rows", "place"),
    [
        ("A,0,-1,1\nA,0,1,1\nB,5,0,1\n", "x = 5 m"), ("A,0,-1,1\nA,0,0,1\nB,0,0,1\nB,0,1,1\n", "x = 0 m"),
        ("A,3,-1,1\nA,3,1,1\n", "x = 3 to 3 m"),
    ],
)  # fmt: skip
def test_sections_that_make_no_bed_are_refused(tmp_path: Path, rows: str, place: str) -> None:
    site = "bed: {file: s.csv, sections: true}\nexperiments: {June: {discharge: 2, level: 1.6}}\n"
    error = refusal_of(tmp_path, site, s__csv=f"section,x,y,z\n{rows}", u__csv="x,y,u\n3,0,0.5\n")
    assert "s.csv" in error
    assert place in error


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("River Station,Station,Elevation\n40,1,2.5\n40,2,2.4\n", "Elevation, River Station, Station"),
        ("section,x,y,depth below datum\nA,0,1,2.5\nA,0,2,2.4\n", "depths"),
        ("Geom Title=Mill\n#Sta/Elev= 2\n 0 3.2 1 2.7\n", "HEC-RAS"),
    ],
)
def test_sections_as_others_keep_them_are_refused(tmp_path: Path, table: str, words: str) -> None:
    (tmp_path / "bed.g01").write_text(table, encoding="utf-8")
    with pytest.raises(InputError, match=rf"bed\.g01.*{words}"):
        read_terrain(tmp_path / "bed.g01", Placement(), FileOptions(), sections=True)


def test_depths_are_no_levels_of_a_bed(tmp_path: Path) -> None:
    """Named as z they made a ridge, which `check` reports."""
    rows = [f"{x},{y},{depth}" for x in (0, 20, 40) for y, depth in ((-3, -0.2), (-1, 0.9), (1, 0.9), (3, -0.2))]
    site = "bed: {file: bed.csv, columns: {z: depth}}\n" + JUNE
    files = {"bed__csv": "\n".join(["x,y,depth", *rows]), "a__csv": "x,y,u\n8,2,0.4\n"}
    assert "depths" in refusal_of(tmp_path, site.replace(", columns: {z: depth}", ""), **files)
    case = import_of(tmp_path, site, **files).case
    remarks = vegglue.check(case, runs=tmp_path / "runs").remarks
    assert "BedHighestInMiddle" in [type(one).__name__ for one in remarks]


def test_what_a_bed_has_no_use_for_is_not_read(tmp_path: Path) -> None:
    rows = [f"{x},{y},{0.1 * y * y},0.9,0.4" for x in (0, 20, 40) for y in (-3, -1, 1, 3)]
    (tmp_path / "bed.csv").write_text("\n".join(["x,y,z,depth,u", *rows]), encoding="utf-8")
    taken = read_terrain(tmp_path / "bed.csv", Placement(), FileOptions(), sections=False).taken
    assert taken.endswith("not read: depth and u")


def test_a_bed_of_more_levels_than_a_case_reads_is_refused(tmp_path: Path) -> None:
    """x in mm, say, asked for 30 GB."""
    points = "\n".join(["x,y,z", *(f"{x},{y},{abs(y)}" for x in (0, 40) for y in (-4, 0, 4))])
    site = "bed: {file: bed.csv}\ngrid: {x: [0, 40000], y: [-4, 4], cell: [0.5, 0.005]}\n" + JUNE
    assert "1.28e+10" in refusal_of(tmp_path, site, bed__csv=points, a__csv="x,y,u\n8,2,0.4\n")


def collection(*features: tuple[object, object], **more: object) -> str:
    """GeoJSON of properties and geometries."""
    made = [{"type": "Feature", "properties": one, "geometry": shape} for one, shape in features]
    return json.dumps({"type": "FeatureCollection", "features": made, **more})


def polygon(*corners: tuple[float, float]) -> dict[str, object]:
    return {"type": "Polygon", "coordinates": [[list(one) for one in (*corners, corners[0])]]}


PATCH = ((12.0, 0.0), (16.0, 0.0), (16.0, 2.0), (12.0, 2.0))
ON_MAP = tuple(FRAME.to_map(*corner) for corner in PATCH)


def geojson(folder: Path, *features: tuple[object, object], **more: object) -> Path:
    (folder / "a.geojson").write_text(collection(*features, **more), encoding="utf-8")
    return folder / "a.geojson"


def shapes(
    folder: Path, rings: list[list[tuple[float, float]]], name: str = "Willows", encoding: str = "utf-8"
) -> Path:
    shapefile = pytest.importorskip("shapefile")
    with shapefile.Writer(str(folder / "p.shp"), encoding=encoding) as writer:
        writer.field("NAME", "C")
        writer.field("STEMS", "N", decimal=1)
        writer.poly([list(map(list, ring)) for ring in rings])
        writer.record(name, 22.0)
    return folder / "p.shp"


def test_a_site_of_survey_and_polygons_becomes_a_case(tmp_path: Path) -> None:
    site = (
        "frame: {origin: [5000, 2000], towards: [5008.6602540378, 2005]}\nbed: {file: dtm.tif}\n"
        "grid: {x: [0, 40], y: [-5, 5], cell: [1.0, 0.5]}\npatches: {file: a.geojson}\n"
        "experiments: {June: {discharge: 8, level: 3.6}}\nfiles: {u.csv: {coordinates: channel}}\n"
    )
    folder = folder_of(tmp_path / "Reach", site, u__csv="x;y;u\n10;0;0.5\n")
    write_geotiff(folder / "dtm.tif")
    geojson(folder, ({"name": "Willows", "stems": 22}, polygon(*ON_MAP)))
    case = imported(folder).case
    built = build_site(case)
    assert np.allclose(built.bed, plane(built.grid.x[:, None], built.grid.y[None, :]), atol=1e-3)
    assert (built.patch >= 0).sum() == 4 * 4, "4 m by 2 m in cells of 1 m by 0.5 m"
    assert case.plants.patches[0].stems == 22.0
    assert case.frame is not None
    assert case.frame.angle == pytest.approx(30.0)


@pytest.mark.parametrize(("name", "encoding"), [("Willows", "utf-8"), ("Röhricht", "utf-8"), ("Röhricht", "latin-1")])
def test_polygons_of_a_shapefile_are_those_of_geojson(tmp_path: Path, name: str, encoding: str) -> None:
    """Also with texts as older programs write them, whether a .cpg names their encoding or not."""
    (same,) = read_polygons(geojson(tmp_path, ({"name": name, "stems": 22}, polygon(*ON_MAP))), FRAME)
    path = shapes(tmp_path, [[*ON_MAP[::-1], ON_MAP[-1]]], name, encoding)
    for stated in (None, encoding):
        if stated is not None:
            path.with_suffix(".cpg").write_text(stated, encoding="utf-8")
        (found,) = read_polygons(path, FRAME)
        assert (found.name, found.density) == (same.name, same.density) == (name, 22.0)
        assert np.allclose(sorted(found.corners), sorted(same.corners))


def square(x: float, y: float, side: float) -> list[tuple[float, float]]:
    """Corners of a square, clockwise as the outer rings of a shapefile run."""
    return [(x, y), (x, y + side), (x + side, y + side), (x + side, y), (x, y)]


@pytest.mark.parametrize("kind", ["shp", "geojson"])
def test_parts_and_holes_of_a_polygon_are_kept(tmp_path: Path, kind: str) -> None:
    """Of a shapefile only the first part was read, and of holes nothing."""
    rings = [square(0, 0, 4), square(1, 1, 2)[::-1], square(6, 0, 2)]
    shape = {"type": "MultiPolygon", "coordinates": [rings[:2], rings[2:]]}
    found = read_polygons(shapes(tmp_path, rings) if kind == "shp" else geojson(tmp_path, ({"stems": 22}, shape)), None)
    assert [one.density for one in found] == [22.0, 22.0]
    assert [abs(signed_area(np.array(one.corners))) for one in found] == pytest.approx([12.0, 4.0])
    grid = Grid(np.arange(0.25, 9.0, 0.5), np.arange(0.25, 5.0, 0.5), 0.5, 0.5)
    assert [int(in_polygon(tuple(one.corners), grid).sum()) for one in found] == [48, 16]


@pytest.mark.parametrize(
    ("corners", "crosses"),
    [
        ([(12, 0), (18, 1.5), (18, 0), (12, 1.5)], True), ([(0, 0), (4, 0), (4, 4), (2, -1), (0, 4)], True),
        ([(0, 0), (4, 0), (4, 4), (2, 1), (0, 4)], False), ([(0, 0), (4, 0), (2, 1), (4, 2), (0, 2), (2, 1)], False),
    ],
)  # fmt: skip
@pytest.mark.parametrize("kind", ["geojson", "csv"])
def test_an_outline_that_crosses_itself_is_refused(
    tmp_path: Path, corners: list[tuple[float, float]], crosses: bool, kind: str
) -> None:
    """Outlines may touch themselves."""
    path = tmp_path / f"a.{kind}"
    rows = "".join(f"a,{x},{y}\n" for x, y in corners)
    path.write_text(collection(({}, polygon(*corners))) if kind == "geojson" else f"name,x,y\n{rows}", encoding="utf-8")
    if crosses:
        with pytest.raises(InputError, match=rf"a\.{kind}: polygon 1"):
            read_polygons(path, None)
    else:
        assert len(read_polygons(path, None)) == 1


def test_an_outline_in_a_site_file_may_not_cross_itself(tmp_path: Path) -> None:
    site = CHANNEL + JUNE + "patches: [{polygon: [[12, 0], [18, 1.5], [18, 0], [12, 1.5]]}]\n"
    assert "patches" in refusal_of(tmp_path, site, a__csv="x,y,u\n8,0,0.4\n")


@pytest.mark.parametrize(("stems", "got"), [(0, "0"), (None, "none"), (-3, "-3")])
def test_a_patch_without_stems_is_refused_beside_others(tmp_path: Path, stems: float | None, got: str) -> None:
    path = geojson(tmp_path, *(({"stems": one}, polygon(*PATCH)) for one in (22, stems)))
    with pytest.raises(InputError, match=rf"polygon p2 .* got {got};"):
        planted_polygons(path, None)


@pytest.mark.parametrize(
    "other",
    [{"type": "LineString", "coordinates": [[0, 0], [4, 1]]}, {"type": "GeometryCollection", "geometries": []}, None],
)
def test_what_is_no_area_is_refused_among_polygons(tmp_path: Path, other: dict[str, object] | None) -> None:
    path = geojson(tmp_path, ({"stems": 22}, polygon(*PATCH)), ({"stems": 22}, other))
    with pytest.raises(InputError) as refused:
        read_polygons(path, None)
    assert (refused.value.kind, refused.value.values["feature"]) == ("no_polygon", 2)


def test_a_geometry_without_properties_is_a_patch(tmp_path: Path) -> None:
    area = {"type": "Polygon", "coordinates": [[[16, 0], [20, 0], [20, 1], [16, 0]]]}
    (tmp_path / "reeds.geojson").write_text(json.dumps(area), encoding="utf-8")
    assert [len(one.corners) for one in planted_polygons(tmp_path / "reeds.geojson", None, {})] == [3]


def test_a_polygon_of_two_corners_is_refused(tmp_path: Path) -> None:
    path = geojson(tmp_path, ({}, polygon(*PATCH)), ({}, polygon((16.0, 0.0), (20.0, 0.0))))
    with pytest.raises(InputError) as refused:
        planted_polygons(path, None)
    assert (refused.value.kind, refused.value.values["polygon"], refused.value.values["got"]) == ("few_corners", 2, 2)


def test_a_raster_without_levels_is_refused(tmp_path: Path) -> None:
    head = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 2\nnodata_value -1\n"
    (tmp_path / "bed.asc").write_text(head + 6 * "-1 ", encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_terrain(tmp_path / "bed.asc", Placement(), FileOptions(), False)
    assert refused.value.kind == "no_levels"


@pytest.mark.parametrize(
    ("crs", "corner", "refused"),
    [
        ("urn:ogc:def:crs:EPSG::31370", (155090.0, 463072.0), "EPSG:31370"),
        ("EPSG:31370", (155090.0, 463072.0), "EPSG:31370"),
        ("urn:ogc:def:crs:OGC:1.3:CRS84", (5.3813, 52.1506), "degrees"),
        ("urn:ogc:def:crs:EPSG::28992", (155090.0, 463072.0), ""),
    ],
)
def test_polygons_of_another_system_are_refused(
    tmp_path: Path, crs: str, corner: tuple[float, float], refused: str
) -> None:
    side = 1e-4 if refused == "degrees" else 2.0
    ring = [(corner[0] + side * x, corner[1] + side * y) for x, y in ((0, 0), (1, 0), (1, 1))]
    path = geojson(tmp_path, ({}, polygon(*ring)), crs={"type": "name", "properties": {"name": crs}})
    frame = Frame(origin=(0.0, 0.0), angle=0.0, crs="EPSG:28992")
    if not refused:
        assert len(read_polygons(path, frame)) == 1
        return
    with pytest.raises(InputError, match=rf"a\.geojson: .*{refused}"):
        read_polygons(path, frame)
    with pytest.raises(InputError, match="degrees"):
        read_polygons(geojson(tmp_path, ({}, polygon((8, 47), (8, 48), (9, 47)))), FRAME)


def wkt(name: str, unit: str = '"Meter",1.0', end: str = "") -> str:
    return (
        f'PROJCS["{name}",GEOGCS["GCS_{name}",DATUM["D_{name}",SPHEROID["GRS_1980",6378137.0,298.257222101]],PRIMEM'
        f'["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],UNIT[{unit}]{end}]'
    )


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("GDA_1994_MGA_Zone_55", 28355), ("GDA2020_MGA_Zone_55", 7855), ("WGS_1984_UTM_Zone_32N", 32632),
        ("ETRS_1989_UTM_Zone_32N", 25832), ("WGS 84 / UTM zone 33S", 32733), ("NAD_1983_UTM_Zone_10N", 26910),
        ("RD_New", 28992),
        ("CH1903+_LV95", 2056), ("CH1903_LV03", 21781), ("British_National_Grid", 27700), ("RGF_1993_Lambert_93", 2154),
        ("ETRS89 / UTM zone 31N", 25831), ("DHDN_3_Degree_Gauss_Zone_3", 31467), ("NAD_1983_2011_UTM_Zone_11N", 6340),
        ("Somewhere_else", 0),
    ],
)  # fmt: skip
def test_names_of_systems_have_their_numbers(name: str, number: int) -> None:
    assert system_of_wkt(wkt(name)).number == number
    assert system_of_wkt(wkt(name, end=',AUTHORITY["EPSG","5555"]')).number == 5555


@pytest.mark.parametrize(
    ("text", "crs", "refused"),
    [
        (wkt("GDA_1994_MGA_Zone_55"), "EPSG:7855", True), (wkt("GDA2020_MGA_Zone_55"), "EPSG:7855", False),
        (wkt("WGS_1984_UTM_Zone_33N"), "EPSG:32632", True), (wkt("NAD_1927_Local"), "EPSG:26910", True),
        (wkt("Local_grid"), "EPSG:26910", False), (wkt("NAD_1983_Ohio", '"Foot_US",0.3048006096012192'), None, True),
        ('GEOGCS["WGS 84",DATUM["WGS_1984"],UNIT["degree",0.0174532925199433]]', None, True),
    ],
)  # fmt: skip
def test_a_shapefile_has_the_system_of_its_prj(tmp_path: Path, text: str, crs: str | None, refused: bool) -> None:
    path = shapes(tmp_path, [[(320011, 5811998), (320011, 5811999), (320017, 5811999), (320011, 5811998)]])
    path.with_suffix(".prj").write_text(text, encoding="utf-8")
    frame = Frame(origin=(320000.0, 5812000.0), angle=0.0, crs=crs)
    if not refused:
        assert len(read_polygons(path, frame)) == 1
        return
    with pytest.raises(InputError, match=r"p\.shp"):
        read_polygons(path, frame)


CORNERS = "".join(f"reed;{x};{y};20;8\n" for x, y in PATCH) + "sedge;20;-1;40;8\nsedge;22;-1;;\nsedge;22;0;;\n"


def test_a_table_of_corners_is_read_as_patches(tmp_path: Path) -> None:
    site = CHANNEL + JUNE + "patches: {file: plants.csv}\n"
    found = import_of(tmp_path, site, plants__csv="name;x;y;Stems/m2;d (mm)\n" + CORNERS, a__csv="x;y;u\n8;0;0.4\n")
    patches = found.case.plants.patches
    assert [(one.name, one.stems) for one in patches] == [("reed", 20.0), ("sedge", 40.0)]
    assert [len(one.polygon or ()) for one in patches] == [4, 3]
    assert found.taken["plants.csv"].endswith("not read: d (mm)")
    assert not any("equally dense" in one for one in assumptions_of(tmp_path / "brook0"))


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("name,x1,x2,y1,y2\np1,10,14,0,1\n", "x1, x2, y1, y2"), ("name,x,y\np1,10,0\np1,14,1\n", "'p1', got 2"),
        ("name,x,y\np1,10,0\np1,14,1\np1,,1\n", "row 4"),
    ],
)  # fmt: skip
def test_a_table_that_draws_no_patch_is_refused(tmp_path: Path, table: str, words: str) -> None:
    (tmp_path / "plants.csv").write_text(table, encoding="utf-8")
    with pytest.raises(InputError, match=rf"plants\.csv.*{words}"):
        planted_polygons(tmp_path / "plants.csv", None)


@pytest.mark.parametrize(
    ("heading", "density", "stated"),
    [
        ("stems", 2.0, False), ("Stems/m²", 2.0, True), ("stem_density", 2.0, False),
        ("stems_per_ft2", 2.0 / 0.3048**2, True),
        ("stengels_m2", 2.0, True), ("Halme pro m²", 2.0, True), ("tiges_par_m2", 2.0, True), ("a_per_m", None, True),
    ],
)  # fmt: skip
def test_a_density_is_known_by_its_heading_and_its_unit(
    tmp_path: Path, heading: str, density: float | None, stated: bool
) -> None:
    (found,) = planted_polygons(geojson(tmp_path, ({heading: 2}, polygon(*PATCH))), None)
    assert found.density == (density if density is None else pytest.approx(density))
    summary = summary_of_plants([found])
    assert (f"stems from {heading}" in summary) == (density is not None)
    assert summary.endswith(f"not read: {heading}") == (density is None)
    assert ("1/m2" in summary) == (not stated)


@pytest.mark.parametrize(
    ("heading", "units"),
    [("name,x,y,stems", ["m", "1/m2"]), ("name,x_m,y [m],stems", ["1/m2"]), ("name,x_cm,y_cm,stems_per_m2", [])],
)
def test_units_that_a_table_of_patches_does_not_state_are_reported(
    tmp_path: Path, heading: str, units: list[str]
) -> None:
    rows = "".join(f"reed,{x},{y},20\n" for x, y in PATCH)
    (tmp_path / "patch.csv").write_text(f"{heading}\n{rows}", encoding="utf-8")
    summary = summary_of_plants(planted_polygons(tmp_path / "patch.csv", None))
    assert [unit for unit in ("m", "1/m2") if f"taken as {unit}" in f"{summary},".replace(";", ",") and f"as {unit}," in
            f"{summary},".replace(";", ",")] == units  # fmt: skip


def test_what_may_be_a_density_is_reported_with_what_to_write(tmp_path: Path) -> None:
    path = geojson(tmp_path, ({"bedekkingsdichtheid": 2, "stem_diameter": 4, "name": "riet"}, polygon(*PATCH)))
    summary = summary_of_plants(planted_polygons(path, None))
    assert "{stems: bedekkingsdichtheid}" in summary
    assert "{stems: stem_diameter}" not in summary
    (found,) = planted_polygons(path, None, {"stems": "bedekkingsdichtheid"})
    assert (found.name, found.density, found.density_from) == ("riet", 2.0, "bedekkingsdichtheid")
    with pytest.raises(InputError, match=r"a.geojson: .*'dichtheid' for stems"):
        planted_polygons(path, None, {"stems": "dichtheid"})


def test_a_site_file_names_columns_of_patches(tmp_path: Path) -> None:
    rows = "".join(f"{kind};{x};{y};{many}\n" for kind, many in (("riet", 20), ("zegge", 40)) for x, y in PATCH)
    patches = "patches: {file: plants.csv, columns: {stems: aantal, name: soort}}\n"
    files = {"plants__csv": f"soort;x;y;aantal [1/m2]\n{rows}", "a__csv": "x,y,u\n8,0.5,0.4\n"}
    case = import_of(tmp_path, CHANNEL + JUNE + patches, **files).case
    assert [(one.name, one.stems) for one in case.plants.patches] == [("riet", 20.0), ("zegge", 40.0)]
    assert not any("columns" in one for one in assumptions_of(tmp_path / "brook0"))
    assert "columns" in refusal_of(tmp_path, CHANNEL + JUNE + patches.replace("stems:", "stengels:"), **files)


def surveyed(folder: Path, more: str, rise: float = 0.5, **files: str) -> tuple[Case, str]:
    """A floor of 3 m between banks, surveyed along and across; more: of the site file. The case, and what was taken."""
    rows = (
        f"{x},{0.5 * j},{max(0.0, abs(0.5 * j) - 1.5) * rise - 0.001 * x:.4f}" for x in (0, 40) for j in range(-9, 10)
    )
    site = "bed: {file: bed.csv}\ngrid: {x: [0, 40], y: [-4.5, 4.5], cell: [1.0, 0.25]}\n"
    site += "experiments: {June: {discharge: 2, level: 1.0}}\n"
    files |= {"bed__csv": "\n".join(["x,y,z", *rows]), "u__csv": "x,y,u,u_se\n10,0,0.5,0.01\n"}
    found = imported(folder_of(folder / "mill", site + more, **files))
    return found.case, found.taken["bed.csv"]


BANKS = "channel: {length_m: 40, bottom_width_m: 3, bank_slope_v_per_h: 0.5, bed_slope: 0.001}\n"


def test_stated_banks_of_a_surveyed_bed_have_their_roughness(tmp_path: Path) -> None:
    case, taken = surveyed(tmp_path, BANKS)
    site = build_site(case)
    banks = site.friction_class == site.class_names.index("bank")
    assert np.array_equal(banks, np.broadcast_to(np.abs(site.grid.y) > 1.5, banks.shape))
    assert list(case.parameters) == ["n_b", "k_s", "eddy_viscosity"]
    assert "3 m (3 m stated)" in taken
    assert not unnamed_banks(case)


def test_stated_banks_that_no_survey_shows_are_reported(tmp_path: Path) -> None:
    """No parameter is left without a cell that it acts on."""
    case, taken = surveyed(tmp_path, BANKS, rise=0.1)
    assert list(case.friction.classes) == ["bed"]
    assert "k_s" not in case.parameters
    assert "no bank" in taken
    assert not unnamed_banks(case)


def test_walls_and_mapped_classes_win_over_stated_banks(tmp_path: Path) -> None:
    assert "bank" not in surveyed(tmp_path, BANKS + "walls: true\n")[0].friction.classes
    shape = polygon((0, -4.5), (40, -4.5), (40, -3), (0, -3))
    for name, laws in (("grass", ["manning", "manning", "keulegan"]), ("bank", ["manning", "manning"])):
        text = collection(({"class": name}, shape))
        case, _ = surveyed(tmp_path / name, BANKS + "classes: {file: classes.geojson}\n", classes__geojson=text)
        assert [one.law for one in case.friction.classes.values()] == laws
        site = build_site(case)
        assert (site.friction_class[:, site.grid.y < -3] == site.class_names.index(name)).all()


@pytest.mark.parametrize(
    ("names", "coefficients"),
    [
        (("砂", "砾"), ["n_b", "n_class", "n_class_2"]),
        (("fine sand", "Fine-Sand"), ["n_b", "n_fine_sand"]),
        (("d 1/2", "d 1_2"), ["n_b", "n_d_1_2"]),
    ],
)
def test_classes_differ_if_their_names_do(tmp_path: Path, names: tuple[str, str], coefficients: list[str]) -> None:
    """Two classes without a Latin letter were one."""
    south, north = (polygon((0, y), (40, y), (40, y + 1.5), (0, y + 1.5)) for y in (-4.5, 3.0))
    text = collection(({"class": names[0]}, south), ({"class": names[1]}, north))
    case, _ = surveyed(tmp_path, "classes: {file: classes.geojson}\n", classes__geojson=text)
    assert [one.n for one in case.friction.classes.values()] == coefficients


def test_steep_cells_without_a_class_are_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case, _ = surveyed(tmp_path, "")
    assert list(case.friction.classes) == ["bed"]
    (remark,) = unnamed_banks(case)
    assert "steeper than 0.2" in remark
    import_command(tmp_path / "mill", tmp_path / "other.yaml")
    assert remark in capsys.readouterr().out


@pytest.mark.parametrize(("slope", "beyond"), [(1.0, 0.2), (0.5, 0.2), (0.15, 0.075)])
def test_flat_banks_of_a_channel_are_banks(tmp_path: Path, slope: float, beyond: float) -> None:
    site = CHANNEL.replace("v_per_h: 0.5", f"v_per_h: {slope}") + JUNE
    case = import_of(tmp_path, site, a__csv="x,y,u\n8,0,0.4\n").case
    assert [zone.beyond_slope_break for zone in case.friction.zones] == [beyond]
    cells = build_site(case)
    outside = cells.friction_class == cells.class_names.index("bank")
    assert outside[:, np.abs(cells.grid.y) > 1.5].all()
    assert not outside[:, np.abs(cells.grid.y) < 1.4].any()


def test_a_bed_of_another_unit_in_a_table_is_converted(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "b", "bed: {file: s.csv, sections: true}\n" + JUNE, s__csv="section,x,y,z\nA,0,0,1\n")
    assert "s.csv" in refusal(folder)


FRAMED = "frame: {origin: [683120, 247480], angle: 32}\n"
SECTION_FRAMED = [(683132.8, 247482.1), (683131.8, 247483.8), (683130.8, 247485.5)]


def on_map(place, **columns):
    """Velocities of a section whose places are turned into another form."""
    rows = [",".join(map(repr, (*place(east, north), 0.34, 0.21))) for east, north in SECTION_FRAMED]
    return "\n".join([columns.get("head", "Easting,Northing,Ve,Vn"), *rows])


@pytest.mark.parametrize(
    ("place", "cause"),
    [
        (lambda east, north: (north, east), "look exchanged"),
        (lambda east, north: (east + 2e6, north + 1e6), "digits"),
        (lambda east, north: (east / 0.3048, north / 0.3048), "units: {x: ft"),
        (lambda east, north: (east / 1e3, north / 1e3), "units: {x: km"),
        (lambda east, north: (east - 683120.0, north - 247480.0), "coordinates: channel"),
        (lambda east, north: (east - 216000.0, north + 4990000.0), "correct `frame`"),
        (lambda east, north: (8.0 + east * 1e-6, 47.0 + north * 1e-6), "degrees"),
    ],
)  # fmt: skip
def test_places_far_from_the_site_are_refused_with_the_likely_cause(tmp_path: Path, place, cause: str) -> None:
    """A million metres off, all stations were outside the grid, which `check` alone said."""
    error = refusal_of(tmp_path, CHANNEL + JUNE + FRAMED, v__csv=on_map(place))
    assert "v.csv: expected" in error
    assert cause in error


def test_degrees_are_no_metres_without_a_frame_either(tmp_path: Path) -> None:
    """They became one place, with all velocities as its repeats."""
    degrees = on_map(lambda east, north: (8.0 + east * 1e-6, 47.0 + north * 1e-6), head="x,y,u,v")
    assert "degrees" in refusal_of(tmp_path, v__csv=degrees)


def test_a_plane_of_millimetres_is_one(tmp_path: Path) -> None:
    found = import_of(tmp_path, v__csv="x [mm],y [mm],u\n8000,2,0.3\n8000,4,0.31\n8002.5,7,0.32\n")
    assert found.table["y"].tolist() == pytest.approx([0.002, 0.004, 0.007])


@pytest.mark.parametrize("at", ["patches: [{file: p.geojson}]", "classes: {file: p.geojson}", "bed: {file: b.csv}"])
def test_maps_far_from_the_site_are_refused(tmp_path: Path, at: str) -> None:
    ring = [[2683130.0, 1247480.0], [2683134.0, 1247480.0], [2683134.0, 1247482.0]]
    polygon = {"type": "Feature", "properties": {"class": "a"}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
    points = "\n".join(
        ["x,y,z", *(f"{2683100 + 2 * i},{1247470 + 2 * j},{0.1 * j}" for i in range(9) for j in range(9))]
    )
    files = {"p__geojson": json.dumps({"type": "FeatureCollection", "features": [polygon]}), "b__csv": points}
    site = CHANNEL + JUNE + FRAMED + at + "\n"
    used = {name: text for name, text in files.items() if name.replace("__", ".") in at}
    assert "digits" in refusal_of(tmp_path, site, v__csv=on_map(lambda east, north: (east, north)), **used)


@pytest.mark.parametrize(
    ("name", "begin", "words"),
    [
        ("p.las", b"LASF\x00\x00", "point cloud"), ("p.ply", b"ply\nformat ascii 1.0\n0 0 1\n1 0 2\n", "point cloud"),
        ("p.gpkg", b"SQLite format 3\x00", "GeoPackage"), ("p.dxf", b"  0\r\nSECTION\r\n  2\r\n", "drawing"),
        ("p.kml", b'\xef\xbb\xbf<?xml version="1.0"?>\n<kml>8.5,47.3,0 8.6,47.3,0</kml>', "KML"),
        ("p.gpx", b'<?xml version="1.0"?><gpx version="1.1">', "GPX"), ("p.xls", b"\xd0\xcf\x11\xe0\xa1", "Excel 97"),
        ("p.pdf", b"%PDF-1.4", "PDF"), ("p.ods", b"PK\x03\x04", "packed"), ("p.xml", b"<Data><v>1</v></Data>", "XML"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("at", ["bed: {file: F}", "patches: [{file: F}]", "grid: {centreline: {file: F}}"])
def test_files_of_other_programs_are_named_with_what_to_save(
    tmp_path: Path, at: str, name: str, begin: bytes, words: str
) -> None:
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE + at.replace("F", name) + "\n", v__csv="x,y,u\n8,0,0.4\n")
    (folder / name).write_bytes(begin)
    error = refusal(folder)
    assert f"{name}: expected text, got a" in error
    assert words in error
    assert "; save " in error
