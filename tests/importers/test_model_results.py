"""Finished results of other models: each format read back from a flow that is known, with its traps."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray
from result_files import GridFlow, a_flow, at_nodes, write_flow_fm, write_hec_ras, write_selafin, write_trim

from vegglue.errors import InputError
from vegglue.importers.finished_results import holds_result, read_result
from vegglue.importers.model_result import DRY_DEPTH
from vegglue.importers.ugrid import read_ugrid


def compare(result, flow: GridFlow, tolerance: float = 2e-5) -> None:
    """All fields of cells, which are in the order of the grid."""
    wet, (east, north) = flow.depth.ravel() > 0.0, flow.velocity
    for got, wanted in zip((result.x, result.y), flow.centres, strict=True):
        np.testing.assert_allclose(got, wanted.ravel(), atol=1e-3)
    np.testing.assert_array_equal(result.wet, wet)
    np.testing.assert_allclose(result.bed, flow.bed.ravel(), atol=tolerance)
    np.testing.assert_allclose(result.depth, flow.depth.ravel(), atol=tolerance)
    assert np.isnan(result.level[~wet]).all()
    assert not result.u[~wet].any()
    inner = np.zeros(flow.depth.shape, bool)
    inner[1:-1, 1:-3] = True  # beside walls and the dry bank a face is no mean of two cells
    for got, wanted in ((result.u, east), (result.v, north)):
        np.testing.assert_allclose(got[inner.ravel()], wanted[inner], atol=tolerance)
    np.testing.assert_allclose(result.manning()[wet & np.isfinite(result.manning())], 0.03, rtol=1e-4)


@pytest.mark.parametrize("feet", [False, True])
@pytest.mark.parametrize("version", ["5.0.5", "6.1"])
def test_hec_ras(tmp_path: Path, feet: bool, version: str) -> None:
    flow, path = a_flow(), tmp_path / "reach.p01.hdf"
    write_hec_ras(path, flow, feet, version)
    result = read_result(path)
    assert (result.code, result.time) == ("HEC-RAS", "01JAN2020 12:00:00")
    compare(result, flow)
    assert result.corners.shape == (13 * 7, 2)


@pytest.mark.parametrize(
    "how",
    [
        {},
        {"double": True},
        {"order": "<", "double": True},
        {"french": True},
        {"offset": (683000, 247000)},
        {"cut": True},
    ],
)
def test_selafin(tmp_path: Path, how: dict) -> None:
    flow, path = a_flow(), tmp_path / "reach.slf"
    write_selafin(path, flow, **how)
    assert holds_result(path)
    result, (east, north) = read_result(path), flow.velocity
    single = not how.get("double") and not how.get("offset")  # a large coordinate with 24 bits is good to 3 cm
    for got, wanted in zip((result.x, result.y), flow.nodes_of_selafin, strict=True):
        np.testing.assert_allclose(got, wanted.ravel(), atol=0.04 if single else 2e-5)
    depth = at_nodes(flow.depth).ravel()
    np.testing.assert_allclose(result.depth, np.where(depth > DRY_DEPTH, depth, 0.0), atol=1e-6)
    wet = result.wet
    assert 0 < wet.sum() < wet.size
    np.testing.assert_allclose(result.u[wet], at_nodes(east).ravel()[wet], atol=1e-6)
    np.testing.assert_allclose(result.v[wet], at_nodes(north).ravel()[wet], atol=1e-6)
    assert result.time == "2020-01-02 03:04:05 + 60 s"
    assert result.manning() is None
    np.testing.assert_allclose(result.manning("manning"), 0.03, rtol=1e-6)
    np.testing.assert_allclose(
        replace(result, roughness=result.roughness * 1000.0).manning("strickler"), 1.0 / 30.0, rtol=1e-6
    )


def test_selafin_that_is_no_result(tmp_path: Path) -> None:
    path = tmp_path / "reach.slf"
    write_selafin(path, a_flow())
    path.write_bytes(path.read_bytes()[:900])
    with pytest.raises(InputError, match=r"reach\.slf"):
        read_result(path)


@pytest.mark.parametrize("classic", [True, False])
def test_flow_fm(tmp_path: Path, classic: bool) -> None:
    flow, path = a_flow(), tmp_path / "reach_map.nc"
    write_flow_fm(path, flow, classic)
    result = read_result(path)
    assert (result.code, result.crs) == ("D-Flow FM", "EPSG:28992")
    compare(result, flow)


@pytest.mark.parametrize("name", ["mesh2d_face_nodes", "mesh2d_node_x"])
def test_a_mesh_without_its_nodes_is_refused_by_their_name(tmp_path: Path, name: str) -> None:
    path = tmp_path / "map.nc"
    write_flow_fm(path, a_flow(), classic=False)
    with h5py.File(path, "a") as file:
        del file[name]
    with pytest.raises(InputError) as caught:
        read_result(path)
    assert (caught.value.kind, caught.value.values["missing"]) == ("not_on_mesh", [name])


def test_ghost_cells_of_a_partition(tmp_path: Path) -> None:
    flow, path = a_flow(), tmp_path / "reach_0000_map.nc"
    write_flow_fm(path, flow, ghosts=6)
    assert read_result(path).x.size == flow.bed.size - 6


@pytest.mark.parametrize(("clockwise", "layers"), [(False, False), (True, False), (False, True)])
def test_trim(tmp_path: Path, clockwise: bool, layers: bool) -> None:
    """U at a face is the mean of both centres, of a field linear in y: the mean of both faces is the field. Layers
    count by their thickness.
    """
    flow, path = a_flow(), tmp_path / "trim-reach.nc"
    write_trim(path, flow, clockwise, layers)
    result = read_result(path)
    assert (result.code, result.manning()) == ("Delft3D-4", None)
    compare(replace(result, roughness=np.full(result.x.size, 0.03), roughness_kind="manning"), flow, 6e-4)


def test_another_file(tmp_path: Path) -> None:
    path = tmp_path / "table.nc"
    path.write_text("x,y\n")
    assert not holds_result(path)
    with pytest.raises(InputError, match=r"table\.nc"):
        read_result(path)


@pytest.mark.filterwarnings("ignore::UserWarning:xugrid")  # of xugrid, on axes without one
@pytest.mark.parametrize("code", ["selafin", "ugrid"])
def test_values_of_the_format_s_own_library(tmp_path: Path, code: str) -> None:
    """Ten points, read by xarray-selafin and xugrid, which are no dependency."""
    flow = a_flow()
    points = np.random.default_rng(1).choice(60, 10, replace=False)
    if code == "selafin":
        pytest.importorskip("xarray_selafin")
        xarray = pytest.importorskip("xarray")
        path = tmp_path / "reach.slf"
        write_selafin(path, flow)
        with xarray.open_dataset(path, engine="selafin") as data:
            theirs = {"depth": data["H"][-1], "u": data["U"][-1], "v": data["V"][-1]}
            theirs = {key: np.asarray(one)[points] for key, one in theirs.items()}
    else:
        xugrid = pytest.importorskip("xugrid")
        path = tmp_path / "reach_map.nc"
        write_flow_fm(path, flow)
        data = xugrid.open_dataset(path)
        theirs = {"depth": data["mesh2d_waterdepth"], "u": data["mesh2d_ucx"], "v": data["mesh2d_ucy"]}
        theirs = {key: np.asarray(one[-1])[points] for key, one in theirs.items()}
    ours = read_result(path)
    for key, one in theirs.items():
        there = one > -0.005 if key == "depth" else slice(None)
        np.testing.assert_allclose(getattr(ours, key)[points][there], one[there], atol=1e-7)


def write_ugrid(path: Path, **changed: dict[str, object]) -> None:
    """Twelve squares of water 0.5 m deep over a bed at 10 m, at three times; attributes of fields are changed, and
    `values` of them; other fields are added.
    """
    x, y = np.meshgrid(np.arange(5.0), np.arange(4.0), indexing="ij")
    corner = np.arange(20).reshape(5, 4)
    faces = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1).reshape(-1, 4)
    of_time = np.ones((3, 12)) * np.array([[0.2], [0.6], [1.0]])
    fields: dict[str, dict[str, object]] = {
        "time": {"values": np.arange(3.0), "units": "seconds since 2026-01-01"},
        "bed": {"values": np.full(12, 10.0), "standard_name": "altitude", "units": "m"},
        "level": {"values": 10.5 * np.ones((3, 12)), "standard_name": "sea_surface_height", "units": "m"},
        "u": {"values": 0.4 * of_time, "standard_name": "sea_water_x_velocity", "units": "m s-1"},
        "v": {"values": 0.1 * of_time, "standard_name": "sea_water_y_velocity", "units": "m s-1"},
    }
    named = {"node_coordinates": "x y", "face_node_connectivity": "faces"}
    fields |= {"x": {"values": x.ravel(), "units": "m"}, "y": {"values": y.ravel(), "units": "m"}}
    fields |= {"faces": {"values": faces}, "m": {"values": 0, "cf_role": "mesh_topology", **named}}
    fields |= {name: {**fields.get(name, {}), **more} for name, more in changed.items() if more}
    with h5py.File(path, "w") as file:
        for name, field in fields.items():
            dataset = file.create_dataset(field.get("called", name), data=field["values"])
            dataset.attrs.update({key: one for key, one in field.items() if key not in ("values", "called")})


U = {"values": 1.2 * np.ones((3, 12)), "standard_name": "sea_water_x_velocity", "units": "m s-1"}


def partly(value: float) -> NDArray[np.float64]:
    """u at three times, three of twelve faces of this value [m/s]."""
    return np.repeat([[value, 0.4]] * 3, [3, 9], axis=1)


FLAG = {"values": np.repeat([0, 1], [3, 9]), "flag_meanings": "dry wet"}


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({}, (12, 10.0, 0.5, 0.4)),
        ({"time": {"called": "Time"}}, (12, 10.0, 0.5, 0.4)),
        ({"bed": {"values": np.full(12, -10.0), "positive": "down"}}, (12, 10.0, 0.5, 0.4)),
        (
            {"bed": {"values": np.full(12, -10.0), "standard_name": "sea_floor_depth_below_geoid"}},
            (12, 10.0, 0.5, 0.4),
        ),
        ({"u": {"values": 40.0 * np.ones((3, 12)), "units": "cm/s"}}, (12, 10.0, 0.5, 0.4)),
        (
            {
                one: {"values": np.full(12, high), "units": "US_survey_foot"}
                for one, high in (("bed", 10), ("level", 12))
            },
            (12, 12000 / 3937, 2400 / 3937, 0.4),
        ),
        ({"a_maximum": {**U, "cell_methods": "time: maximum"}}, (12, 10.0, 0.5, 0.4)),
        ({"dryness": FLAG}, (9, 10.0, 0.5, 0.4)),
        ({"dryness": {**FLAG, "flag_meanings": "wet dry", "flag_values": np.array([1, 0])}}, (9, 10.0, 0.5, 0.4)),
        (
            {"u": {"values": np.repeat([[500.0, 0.4]] * 3, [3, 9], axis=1), "valid_range": [-9.0, 9.0]}},
            (9, 10.0, 0.5, 0.4),
        ),
        ({"u": {"values": np.repeat([[-99.0, 0.4]] * 3, [3, 9], axis=1)}}, (9, 10.0, 0.5, 0.4)),
    ],
)
def test_what_a_netcdf_states_of_its_fields_counts(
    tmp_path: Path, changed: dict[str, dict[str, object]], expected: tuple[float, ...]
) -> None:
    """A bed that counts downward made water 20 m deep, a maximum over time was the flow at the end."""
    write_ugrid(tmp_path / "map.nc", **changed)
    found = read_ugrid(tmp_path / "map.nc")
    wet = found.wet
    got = (wet.sum(), found.bed.mean(), found.depth[wet].mean(), found.u[wet].mean())
    assert got == pytest.approx(expected)


@pytest.mark.parametrize(
    ("changed", "words"), [({"near_bed": U}, "near_bed, u"), ({"u": {"units": "furlongs"}}, "'furlongs'")]
)
def test_what_a_netcdf_leaves_open_is_refused(
    tmp_path: Path, changed: dict[str, dict[str, object]], words: str
) -> None:
    write_ugrid(tmp_path / "map.nc", **changed)
    with pytest.raises(InputError, match=words):
        read_ugrid(tmp_path / "map.nc")
