"""What is exported is opened again by other readers, with the same numbers at the same places."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from reach import COARSE, Say, write_reach
from systems import POSIX_ALONE

from vegglue.case.config import load_case
from vegglue.case.grid import build_grid
from vegglue.case.schema import Case
from vegglue.errors import InputError
from vegglue.flow.sensor import FlowFields
from vegglue.results.field_exports import write_mesh
from vegglue.workflow.export import Exported, export

FRAME = "frame: {origin: [683120.0, 247480.0], angle: 32.0, crs: EPSG:2056}\n"
Done = tuple[Case, Exported, Path]


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Done:
    folder = tmp_path_factory.mktemp("export")
    case = load_case(write_reach(folder, COARSE, ("friction:\n", f"{FRAME}friction:\n")))
    return case, export(case, runs=folder / "runs"), folder / "runs/brook/export"


def at_cells(done: Done) -> pd.DataFrame:
    return pd.read_csv(done[2] / "flow-june.csv", dtype=str).map(float)  # bit by bit


def test_all_forms_are_written_and_named(done: Done) -> None:
    names = {path.name for path in done[1].files}
    assert {
        "stations.csv",
        "flow-june.csv",
        "flow.nc",
        "bed-june.tif",
        "u-june.tif",
        "north_velocity-june.tif",
    } <= names
    assert done[1].parameters == "the middle of the priors"
    assert all(path.is_file() for path in done[1].files)


def test_stations_are_those_of_the_case_with_their_place_on_the_map(done: Done) -> None:
    table = pd.read_csv(done[2] / "stations.csv")
    assert table["value"].tolist()[:3] == [0.400, 0.436, 0.472]
    assert done[0].frame is not None
    x, y = done[0].frame.to_model(table["east [m]"], table["north [m]"])
    assert np.allclose(x, table["x [m]"], atol=1e-6)
    assert np.allclose(y, table["y [m]"], atol=1e-6)


def test_water_flows_along_the_channel_on_the_map(done: Done) -> None:
    table = at_cells(done)
    wet = table["depth [m]"].notna()
    assert wet.any()
    assert not wet.all()
    assert np.allclose(np.hypot(table["u [m/s]"], table["v [m/s]"])[wet],
                       np.hypot(table["east_velocity [m/s]"], table["north_velocity [m/s]"])[wet])  # fmt: skip
    heading = np.degrees(np.arctan2(table["north_velocity [m/s]"][wet].sum(), table["east_velocity [m/s]"][wet].sum()))
    assert heading == pytest.approx(32.0, abs=3.0)


def test_xarray_opens_the_mesh_with_the_same_numbers(done: Done) -> None:
    xarray = pytest.importorskip("xarray")
    mesh, table = xarray.load_dataset(done[2] / "flow.nc", engine="h5netcdf"), at_cells(done)
    for name, unit in (("bed", "m"), ("level", "m"), ("u", "m/s"), ("east_velocity", "m/s")):
        np.testing.assert_array_equal(np.squeeze(mesh[f"{name}_june"].to_numpy()), table[f"{name} [{unit}]"])
        assert mesh[f"{name}_june"].attrs["units"] == unit
    np.testing.assert_array_equal(mesh["face_x"], table["east [m]"])
    corners = mesh["node_x"].to_numpy()[mesh["face_nodes"].to_numpy()]
    assert np.allclose(corners.mean(axis=1), mesh["face_x"]), "nodes surround their face"
    assert mesh.attrs["Conventions"] == "CF-1.8 UGRID-1.0"
    assert mesh["mesh"].attrs["cf_role"] == "mesh_topology"
    assert mesh["map"].attrs["epsg"] == 2056
    across, along = (np.diff(part, axis=1)[:, :2] for part in (mesh["node_y"].to_numpy()[mesh["face_nodes"]], corners))
    assert (along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0] > 0.0).all(), "anticlockwise"


def test_a_missing_library_is_named_before_anything_is_solved(done: Done, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "xarray", None)
    told: list[object] = []
    with pytest.raises(InputError, match=r"the library xarray, .* 'vegglue\[field\]'`, or choose --only csv"):
        export(done[0], runs=done[2].parent.parent, forms=("netcdf",), watch=told.append)
    assert told == []


def test_map_programs_find_texts_vectors_and_the_system(done: Done) -> None:
    """As QGIS's reader wants it: text of fixed length, vectors by long names and with a time, nodes on a map."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(done[2] / "flow.nc") as file:
        texts = 0
        for owner in (file, *file.values()):
            for name in owner.attrs:
                info = h5py.check_string_dtype(owner.attrs.get_id(name).dtype)
                assert info is None or info.length is not None, name
                texts += info is not None
        assert texts > 40
        called = {name: str(np.char.decode(np.bytes_(one.attrs.get("long_name", b"")))) for name, one in file.items()}
        assert "_FillValue" not in file["node_x"].attrs
    mesh = pytest.importorskip("xarray").load_dataset(done[2] / "flow.nc", engine="h5netcdf", decode_coords=False)
    for east, north in (("east_velocity_june", "north_velocity_june"),):
        assert called[east].endswith(", x-component")
        assert called[east].removesuffix("x-component") == called[north].removesuffix("y-component")
    assert mesh["east_velocity_june"].dims == mesh["north_velocity_june"].dims == ("time", "face")
    assert not called["u_june"].endswith("component"), "along a turned grid it is no component on the map"
    for name in mesh["mesh"].attrs["node_coordinates"].split():
        assert mesh[name].attrs["grid_mapping"] == "map"
    assert mesh["map"].attrs["epsg_code"] == "EPSG:2056"
    assert "\nparameters:" in mesh.attrs["config"]


def test_the_mesh_states_its_system_as_cf_has_it(done: Done) -> None:
    """A reader of CF makes the system of the case of it: the oblique Mercator of Switzerland."""
    pyproj, xarray = pytest.importorskip("pyproj"), pytest.importorskip("xarray")
    attributes = xarray.load_dataset(done[2] / "flow.nc", engine="h5netcdf")["map"].attrs
    assert attributes["grid_mapping_name"] == "oblique_mercator"
    assert pyproj.CRS.from_cf(attributes).to_epsg() == 2056
    assert pyproj.CRS.from_wkt(attributes["crs_wkt"]).to_epsg() == 2056
    east, north = pyproj.Transformer.from_crs(attributes["crs_wkt"], 4326).transform(2683120.0, 1247480.0)
    assert (east, north) == pytest.approx((47.37, 8.54), abs=0.02)


def test_without_a_map_the_velocity_along_the_grid_is_the_vector(done: Done, tmp_path: Path) -> None:
    xarray, grid = pytest.importorskip("xarray"), build_grid(done[0])
    flow = FlowFields(grid.x, grid.y, *(np.full((grid.x.size, grid.y.size), one) for one in (0.0, 1.0, 1.0, 0.4, 0.1)))
    write_mesh(tmp_path / "flow.nc", {"June °": flow}, grid, None, {"title": "über"})
    mesh = xarray.load_dataset(tmp_path / "flow.nc", engine="h5netcdf")
    names = [mesh[name].attrs["long_name"] for name in mesh if str(name)[:2] in ("u_", "v_")]
    assert names == ["velocity, June °, x-component", "velocity, June °, y-component"]
    assert mesh.attrs["title"] == "über"
    assert "grid_mapping" not in mesh["node_x"].attrs | mesh["node_x"].encoding


def test_stations_have_what_the_model_gives_there(done: Done) -> None:
    """At the middle of the priors, as nothing was inferred; apart from the nearest cell by what a coarse cell spans."""
    table, cells = pd.read_csv(done[2] / "stations.csv"), at_cells(done)
    assert table["predicted"].between(0.0, cells["u [m/s]"].max() + 0.02).all()
    nearest = [((cells["x [m]"] - x) ** 2 + (cells["y [m]"] - y) ** 2).idxmin()
               for x, y in zip(table["x [m]"], table["y [m]"], strict=True)]  # fmt: skip
    np.testing.assert_allclose(table["predicted"], cells["u [m/s]"].to_numpy()[nearest], atol=0.15)


def test_another_library_opens_the_mesh(done: Done) -> None:
    netcdf = pytest.importorskip("netCDF4")
    with netcdf.Dataset(done[2] / "flow.nc") as file:
        values = np.ma.filled(file["depth_june"][:], np.nan)
    np.testing.assert_array_equal(values, at_cells(done)["depth [m]"])


def test_a_geotiff_lies_on_the_map_cell_by_cell(done: Done) -> None:
    """As GDAL reads it: (east, north) = A (column, row), with A of the tag ModelTransformation."""
    tifffile = pytest.importorskip("tifffile")
    with tifffile.TiffFile(done[2] / "level-june.tif") as file:
        page = file.pages.first
        values, affine = page.asarray(), np.reshape(page.tags[34264].value, (4, 4))
        assert page.tags[42113].value.startswith("-9999")
        assert 2056 in page.tags[34735].value
    table = at_cells(done)
    row, column = np.indices(values.shape)
    places = np.stack([column.ravel() + 0.5, row.ravel() + 0.5, np.zeros(values.size), np.ones(values.size)])
    order = np.lexsort((table["y [m]"], table["x [m]"]))
    north_up = np.reshape(np.arange(len(table))[order], values.shape[::-1]).T[::-1].ravel()
    assert np.allclose((affine @ places)[0], table["east [m]"].to_numpy()[north_up], atol=1e-6)
    assert np.allclose((affine @ places)[1], table["north [m]"].to_numpy()[north_up], atol=1e-6)
    np.testing.assert_array_equal(values.ravel(), table["level [m]"].fillna(-9999.0).to_numpy()[north_up])


def test_gdal_opens_the_geotiff_with_the_same_numbers(done: Done) -> None:
    """Through rasterio, where it is installed: levels, their place on the turned grid, and the system of the map."""
    rasterio = pytest.importorskip("rasterio")
    table = at_cells(done)
    with rasterio.open(done[2] / "level-june.tif") as file:
        assert file.crs.to_epsg() == 2056
        values = file.read(1, masked=True).filled(np.nan)
        rows, columns = np.indices(values.shape)
        east, north = rasterio.transform.xy(file.transform, rows.ravel(), columns.ravel())
    found = sorted(zip(np.round(east, 4), np.round(north, 4), values.ravel(), strict=True))
    wanted = sorted(zip(table["east [m]"].round(4), table["north [m]"].round(4), table["level [m]"], strict=True))
    np.testing.assert_allclose(np.array(found), np.array(wanted), atol=2e-4)


def test_gdal_opens_the_mesh_with_the_same_numbers(done: Done) -> None:
    """Its driver of netCDF reads each variable of the mesh as rows of numbers, one for each face."""
    rasterio = pytest.importorskip("rasterio")
    with rasterio.Env() as environment:
        if "netCDF" not in environment.drivers():
            pytest.skip("this GDAL has no driver of netCDF")
    of_pixels = pytest.warns(rasterio.errors.NotGeoreferencedWarning)  # which a mesh does not have
    with of_pixels, rasterio.open(f"netcdf:{done[2] / 'flow.nc'}:u_june") as file:
        values = file.read().ravel()
    np.testing.assert_array_equal(values, at_cells(done)["u [m/s]"])


def test_a_library_of_meshes_knows_the_faces(done: Done) -> None:
    """xugrid, where it is installed: the mesh as UGRID has it, its areas those of the cells, its values theirs."""
    xugrid = pytest.importorskip("xugrid")
    mesh, table = xugrid.open_dataset(done[2] / "flow.nc", engine="h5netcdf"), at_cells(done)
    assert mesh.ugrid.grid.n_face == len(table)
    assert np.allclose(mesh.ugrid.grid.area, 1.25 * 0.75)
    assert np.allclose(mesh.ugrid.grid.face_coordinates[:, 0], table["east [m]"])
    np.testing.assert_array_equal(mesh["depth_june"], table["depth [m]"])


def test_only_some_forms_and_a_case_without_a_frame(tmp_path: Path) -> None:
    case = load_case(write_reach(tmp_path, COARSE))
    found = export(case, runs=tmp_path / "runs", forms=("csv",))
    assert [path.name for path in found.files] == ["stations.csv", "flow-june.csv"]
    assert "east [m]" not in pd.read_csv(found.files[0]).columns


def test_experiments_that_differ_in_case_alone_have_files_of_their_own(tmp_path: Path) -> None:
    """One overwrote the other, and the list named the file twice."""
    twice = ("  June: {", "  june: {discharge: 1.0, level: 0.9}\n  June: {")
    case = load_case(write_reach(tmp_path, COARSE, twice))
    tables = [path for path in export(case, runs=tmp_path / "runs", forms=("csv",)).files if "flow" in path.name]
    assert [path.name for path in tables] == ["flow-june.csv", "flow-june-2.csv"]
    assert tables[0].read_bytes() != tables[1].read_bytes()


def test_a_posterior_of_another_state_is_told(tmp_path: Path) -> None:
    """It was passed over in silence, and what came out was written over the export of before."""
    case = load_case(write_reach(tmp_path, COARSE))
    (tmp_path / "runs" / "brook").mkdir(parents=True)
    (tmp_path / "runs" / "brook" / "posterior.h5").write_bytes(b"of another state")
    found = export(case, runs=tmp_path / "runs", forms=("csv",))
    assert found.parameters.startswith("the middle of the priors, as the posterior that is kept is of another state")


def test_an_unknown_form_is_refused(tmp_path: Path, say: Say) -> None:
    code, error = say("export", write_reach(tmp_path), "--only", "shape")
    assert code == 2
    assert "shape" in error


def test_a_bend_lies_on_the_map_where_it_bends(tmp_path: Path) -> None:
    """Half the grid straight, then a quarter of a circle to the left: water enters eastward and leaves northward."""
    parts = "parts: [{length: 15}, {radius: 9.549296586, angle: 90}]"
    bent = (COARSE[0] + "}", f"{COARSE[1]}, centreline: {{{parts}}}}}")
    case = load_case(write_reach(tmp_path, bent))
    found = export(case, runs=tmp_path / "runs", forms=("csv", "geotiff"))
    assert {path.name for path in found.files} == {"stations.csv", "flow-june.csv"}
    table = pd.read_csv(tmp_path / "runs/brook/export/flow-june.csv")
    last = table[(table["x [m]"] > 29.0) & (table["y [m]"].abs() < 0.5)]
    assert last["east [m]"].mean() == pytest.approx(15.0 + 9.549, abs=0.1)
    assert last["north [m]"].mean() == pytest.approx(9.549, abs=0.8)
    assert (last["north_velocity [m/s]"] > 3.0 * last["east_velocity [m/s]"].abs()).all()
    with pytest.raises(InputError, match="choose --only netcdf or csv"):
        export(case, runs=tmp_path / "runs", forms=("geotiff",))


@POSIX_ALONE
def test_links_in_the_folder_are_replaced_and_not_followed(tmp_path: Path) -> None:
    """The folder of a run may come from others, and a kill leaves no half of a file under its name."""
    case, victim = load_case(write_reach(tmp_path, COARSE)), tmp_path / "thesis.tex"
    victim.write_text("my thesis", encoding="utf-8")
    into = tmp_path / "runs/brook/export"
    into.mkdir(parents=True)
    for name in ("flow.nc", "u-june.tif", "flow-june.csv"):
        (into / name).symlink_to(victim)
    found = export(case, runs=tmp_path / "runs")
    assert victim.read_text(encoding="utf-8") == "my thesis"
    assert not any(path.is_symlink() for path in found.files)
