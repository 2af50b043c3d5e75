"""site.json by anybody: read, or refused in one sentence, whatever stands in it."""

import copy
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from field_folders import SITE, field_folder

from vegglue.case.config import load_case
from vegglue.case.resolved_config import as_yaml
from vegglue.case.safe_yaml import safe_yaml
from vegglue.errors import InputError
from vegglue.importers.import_notes import SiteAssumptions, UnreadHoldout, UnreadKeys
from vegglue.importers.site_file import assumptions_of_site, read_site, site_file
from vegglue.workflow.import_folder import assumptions_of, import_folder

ODD = (
    None, True, "", "3", "much", [], {}, [[]], 0, -1, 1e-300, 1e300, 10**400, float("nan"), float("inf"), "\ud800",
    "a\0b", [1, 2, 3], [2, 1], {"x": 1}, [[0, 0], [1, 1]], {"file": "velocities.csv"}, {"points": [[0, 0], [0, 0]]},
)  # fmt: skip


def places(tree: Any, above: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    yield above
    for key in tree if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ():
        yield from places(tree[key], (*above, key))


# What a site file may say of a bend, a frame and walls.
BENT: dict[str, Any] = SITE | {
    "grid": {
        "x": [0, 30], "y": [-3, 3], "cell": [1, 0.5],
        "centreline": {"parts": [{"length": 12.0}, {"radius": 20.0, "angle": 60.0}], "start": [5, 2], "heading": 30.0},
    },
    "frame": {"origin": [3.0, 4.0], "angle": 20.0, "crs": "EPSG:2056"},
    "walls": {"n": 0.01},
}  # fmt: skip


def put(tree: Any, place: tuple[Any, ...], value: Any) -> Any:
    if not place:
        return value
    tree = copy.deepcopy(tree)
    inner = tree
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    return tree


def refusal(folder: Path, target: Path) -> str:
    """Why a folder is refused; nothing when it is read."""
    try:
        import_folder(folder, target)
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    ("site", "place"),
    [
        *((SITE, one) for one in places(SITE)),
        *(
            pytest.param(BENT, one, marks=pytest.mark.slow)
            for one in places(BENT)
            if one[:1] in (("grid",), ("frame",), ("walls",))
        ),
    ],
    ids=lambda value: "bend" if value is BENT else "" if value is SITE else str(value),
)
def test_whatever_stands_in_it_is_read_or_refused(tmp_path: Path, site: dict[str, Any], place: tuple[Any, ...]) -> None:
    folder = field_folder(tmp_path / "site")
    for value in ODD:
        (folder / "site.json").write_text(json.dumps(put(site, place, value)), encoding="utf-8")
        said = refusal(folder, tmp_path / "site.yaml")
        assert len(said.splitlines()) <= 1
        assert len(said) < 1000


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[" * 100_000, "site.json: expected parts nested less deeply"),
        ("[1, 2", "expected a comma"),
        ("[]", "`site.json` expected"),
        ("9" * 5000, "digits"),
        ('{"channel": {"bed_slope": 0.001, "bed_slope": 0.01}}', "`bed_slope` once, got it twice"),
        (json.dumps(put(SITE, ("channel", "bed_slope"), 3)), "`channel.bed_slope`"),
        (json.dumps(put(SITE, ("patches", 0, "x"), [4, 2])), "`patches[0].x`"),
        (json.dumps(put(SITE, ("patches", 1), {"x": [1, 2]})), "`patches[1].y`"),
        (json.dumps(put(SITE, ("patches", 0), {"x": [16, 20], "y": [0, 1.5]})), "`patches[0]`"),
        (json.dumps(SITE | {"frmae": {}}), "`frame`?"),
        (json.dumps(SITE | {"eddy_viscosity": 0.02}), "`eddy_visco"),
        (json.dumps(put(SITE, ("patches", 0), {"x": [16, 20], "y": [0, 1.5], "stems": 7})), "`stems_per_m2`?"),
        (json.dumps(put(SITE, ("experiments", "low"), {"discarge": 2, "level": 1})), "`discharge`?"),
        (json.dumps(SITE | {"walls": "glass"}), "got 'glass'"),
        (json.dumps(SITE | {"experiments": ["low"]}), "got ['low']"),
        (json.dumps({key: SITE[key] for key in ("channel", "experiments")} | {"plants": []}), "`patches`?"),
        (json.dumps(put(SITE, ("patches", 0), {"x": [16, 20], "y": [0, 1.5], "density": 7})), "`patches[0].density`"),
        (json.dumps(put(SITE, ("experiments",), {"a\0b": {}})), "'\\x00'"),
    ],
    ids=lambda text: text[:20],
)
def test_what_is_wrong_is_named(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "site.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_site(path)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    "name", ["1e5", "010", "1:30", "yes", "null", "2024-05-01", "1.", ".5", "~", "a: b", "#", "- x"]
)
def test_an_experiment_keeps_its_name(tmp_path: Path, name: str) -> None:
    assert safe_yaml(as_yaml({name: {"a": name}})) == {name: {"a": name}}
    folder = field_folder(tmp_path / "site", experiments={name: SITE["experiments"]["low"]})
    for table in (folder / "velocities.csv", folder / "levels.csv"):
        table.write_text(table.read_text(encoding="utf-8").replace("low", name), encoding="utf-8")
    assert list(import_folder(folder, tmp_path / "site.yaml").experiments) == [name]
    assert list(load_case(tmp_path / "site.yaml").experiments) == [name]


def test_a_channel_wider_than_long_has_cells(tmp_path: Path) -> None:
    folder = field_folder(tmp_path / "site", channel=SITE["channel"] | {"length_m": 0.5}, patches=[])
    assert import_folder(folder, tmp_path / "site.yaml").grid.cell[0] == 0.125


def test_what_is_not_stated_is_assumed_and_listed(tmp_path: Path) -> None:
    folder = field_folder(
        tmp_path / "site", weather="fine", experiments=put(SITE["experiments"], ("low", "plants"), False), holdout={}
    )
    assert assumptions_of_site(folder, read_site(folder / "site.json")) == [
        SiteAssumptions("site.json", viscosity=2.0, canopy=None, alike=False, bare=False),
        UnreadKeys("site.json", ("weather", "experiments.low.plants")),
        UnreadHoldout("holdout.csv", "site.json"),
    ]
    bare = field_folder(tmp_path / "bare", patches=[])
    assert assumptions_of_site(bare, read_site(bare / "site.json"))[0].bare
    assert assumptions_of(field_folder(tmp_path / "whole", eddy_viscosity_m2_s=0.01)) == []


@pytest.mark.parametrize(
    ("said", "value", "median", "log_sd"),
    [
        ({}, "eddy_viscosity", 0.016, 0.6931),  # by depth, speed and usual roughness
        ({"eddy_viscosity_m2_s": 0.02}, 0.02, None, None),
        ({"eddy_viscosity_m2_s": 0.02, "eddy_viscosity_factor": 3}, "eddy_viscosity", 0.02, 1.0986),
        ({"eddy_viscosity_m2_s": 0.02, "eddy_viscosity_factor": 1}, 0.02, None, None),
    ],
)
def test_a_viscosity_that_is_not_surely_known_is_calibrated(
    said: dict[str, float], value: float | str, median: float | None, log_sd: float | None, tmp_path: Path
) -> None:
    case = import_folder(field_folder(tmp_path / "site", **said), tmp_path / "site.yaml")
    prior = case.parameters.get("eddy_viscosity")
    assert case.eddy_viscosity == value
    assert (prior.median, prior.log_sd) == (median, log_sd) if prior else median is None


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ({"eddy_viscosity_factor": 0.5}, "eddy_viscosity_factor"),
        ({"frame": {"origin": [10, 20], "towards": [10, 20]}}, "`towards`"),  # was east
        ({"frame": {"origin": [8.5, 47.4], "angle": 0, "crs": "EPSG:4326"}}, "EPSG:4326"),  # degrees
        # `downstream_level_m` was asked for of a file that says `discharge: 600 l/s`.
        ({"experiments": {"low": {"discharge": "600 l/s"}}}, r"`experiments\.low\.level`"),
    ],
)
def test_what_no_case_can_have_is_refused(stated: dict[str, Any], said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        import_folder(field_folder(tmp_path / "site", **stated), tmp_path / "site.yaml")


@pytest.mark.parametrize("crs", ["EPSG:99999", "EPSG:2263", "Gauss-Kruger"])  # the second is in feet
def test_a_system_that_is_unknown_or_not_in_metres_is_refused(tmp_path: Path, crs: str) -> None:
    pytest.importorskip("pyproj")
    folder = field_folder(tmp_path / "site", frame={"origin": [10, 20], "angle": 0, "crs": crs})
    with pytest.raises(InputError, match=rf"site\.json: `frame\.crs` .*'{crs}'"):
        import_folder(folder, tmp_path / "site.yaml")


def test_a_frame_may_have_its_place_in_feet(tmp_path: Path) -> None:
    frame = {"origin": ["2000000 ftUS", "100 ft"], "towards": [609701.2192, 30.48]}
    files = {name: {"coordinates": "channel"} for name in ("velocities.csv", "levels.csv", "holdout.csv")}
    folder = field_folder(tmp_path / "site", frame=frame, files=files)
    case = import_folder(folder, tmp_path / "site.yaml")
    assert case.frame is not None
    assert (*case.frame.origin, case.frame.angle) == pytest.approx((609601.2192, 30.48, 0.0), abs=1e-4)


def test_a_second_file_of_what_is_held_out_is_told(tmp_path: Path) -> None:
    """It was left out without a word."""
    folder = field_folder(tmp_path / "site")
    (folder / "holdout.txt").write_text("x y u\n1 2 3\n", encoding="utf-8")
    assert any("holdout.txt" in one and "holdout.csv" in one for one in assumptions_of(folder))


@pytest.mark.parametrize(
    ("key", "said"),
    [("stem_diameter_mm", "diameter [1/m]"), ("number_of_stems", "area of the patch"), ("species", None)],
)
def test_what_has_no_key_is_told_with_what_to_write_instead(tmp_path: Path, key: str, said: str | None) -> None:
    """A diameter was taken as a note, and where else it belongs was not told."""
    patch = {"x": [16, 20], "y": [0, 1.5], "stems_per_m2": 20}
    folder = field_folder(tmp_path / "brook", patches=[{**patch, key: 8}])
    told = assumptions_of(folder)
    assert any(f"not read: patches[0].{key}" in one for one in told)
    assert any("has no key" in one or "have no key" in one for one in told) == (said is not None)
    assert said is None or any(said in one for one in told)


@pytest.mark.parametrize(("y", "said"), [([0, 2, 1, 2], "got [0, 2, 1, 2]"), (0.2, "got 0.2")])
def test_no_type_of_a_language_is_named(tmp_path: Path, y: object, said: str) -> None:
    """`[0,2, 1,2]` was answered with `Tuple should have at most 2 items after validation, not 4`."""
    folder = field_folder(tmp_path / "brook", patches=[{"x": [16, 20], "y": y}])
    with pytest.raises(InputError) as raised:
        read_site(folder / "site.json")
    assert "site.json: `patches[0].y`" in str(raised.value)
    assert said in str(raised.value)
    assert "Tuple" not in str(raised.value)


def test_a_file_in_place_of_a_folder_is_called_a_file(tmp_path: Path) -> None:
    table = field_folder(tmp_path / "brook") / "velocities.csv"
    with pytest.raises(InputError, match="got a file;"):
        read_site(site_file(table))
