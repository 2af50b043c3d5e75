"""Patches of plants in tables, and what of the words beside a polygon is its density."""

import json
from pathlib import Path

import pytest
from field_folders import CHANNEL, JUNE, folder_of

import vegglue
from vegglue.errors import InputError
from vegglue.importers.vector_files import planted_polygons, summary_of_plants
from vegglue.workflow.import_folder import assumptions_of

SQUARE = [[10, 0], [14, 0], [14, 1], [10, 1], [10, 0]]
CORNERS = "".join(f"reed;{x};{y};20;8\n" for x, y in SQUARE[:-1]) + "sedge;20;-1;40;8\nsedge;22;-1;;\nsedge;22;0;;\n"


def drawn(path: Path, **properties: object) -> Path:
    shape = {"type": "Polygon", "coordinates": [SQUARE]}
    feature = {"type": "Feature", "properties": properties, "geometry": shape}
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}), encoding="utf-8")
    return path


def test_a_table_of_corners_is_read_as_patches(tmp_path: Path) -> None:
    """It was refused as no GeoJSON."""
    site = CHANNEL + JUNE + "patches: {file: plants.csv}\n"
    files = {"plants__csv": "name;x;y;Stems/m2;d (mm)\n" + CORNERS, "a__csv": "x;y;u\n8;0;0.4\n"}
    folder = folder_of(tmp_path / "brook", site, **files)
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    assert [(one.name, one.stems) for one in case.plants.patches] == [("reed", 20.0), ("sedge", 40.0)]
    assert [len(one.polygon or ()) for one in case.plants.patches] == [4, 3]
    assert case.imported is not None
    assert case.imported[-1].taken == (
        "2 patches: stems from Stems/m2; no unit given of x and y, taken as m; not read: d (mm)"
    )
    assert not any("equally dense" in one for one in assumptions_of(folder))


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (
            "name,x1,x2,y1,y2\np1,10,14,0,1\n",
            r"expected columns of x and y, with a row for each corner .* `patches: \[",
        ),
        ("name,x,y\np1,10,0\np1,14,1\n", "expected three corners or more of patch 'p1', got 2"),
        ("name,x,y\np1,10,0\np1,14,1\np1,,1\n", "row 4: expected x and y of a corner"),
    ],
)
def test_a_table_that_draws_no_patch_is_refused(tmp_path: Path, table: str, words: str) -> None:
    (tmp_path / "plants.csv").write_text(table, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        planted_polygons(tmp_path / "plants.csv", None)


@pytest.mark.parametrize(
    ("heading", "density"),
    [("stems", 2.0), ("Stems/m²", 2.0), ("stem_density", 2.0), ("stems_per_ft2", 2.0 / 0.3048**2), ("a_per_m", None)],
)
def test_a_density_is_told_by_its_heading_and_its_unit(tmp_path: Path, heading: str, density: float | None) -> None:
    """Densities under another heading, or per square foot, were left out without a word: all patches were alike."""
    (found,) = planted_polygons(drawn(tmp_path / "a.geojson", **{heading: 2}), None)
    assert found.density == (density if density is None else pytest.approx(density))
    said = summary_of_plants([found])
    if density is None:
        assert said == "1 patch: no stems, and so equally dense; not read: a_per_m"
    else:
        taken = "" if "2" in heading or "²" in heading else f"; no unit given of {heading}, taken as 1/m2"
        assert said == f"1 patch: stems from {heading}{taken}"


@pytest.mark.parametrize(
    ("heading", "taken"),
    [
        ("name,x,y,stems", "; no unit given of x and y, taken as m, and of stems, taken as 1/m2"),
        ("name,x_m,y [m],stems", "; no unit given of stems, taken as 1/m2"),
        ("name,x_cm,y_cm,stems_per_m2", ""),
    ],
)
def test_units_that_a_table_of_patches_does_not_give_are_told(tmp_path: Path, heading: str, taken: str) -> None:
    """Those of measurements were, and of plants nothing was said."""
    rows = "".join(f"reed,{x},{y},20\n" for x, y in SQUARE[:-1])
    (tmp_path / "patch.csv").write_text(f"{heading}\n{rows}", encoding="utf-8")
    found = planted_polygons(tmp_path / "patch.csv", None)
    assert summary_of_plants(found) == f"1 patch: stems from {heading.split(',')[-1]}{taken}"


@pytest.mark.parametrize(("heading", "density"), [("stengels_m2", 2.0), ("Halme pro m²", 2.0), ("tiges_par_m2", 2.0)])
def test_stems_of_other_languages_are_read(tmp_path: Path, heading: str, density: float) -> None:
    (found,) = planted_polygons(drawn(tmp_path / "a.geojson", **{heading: 2}), None)
    assert found.density == density
    assert summary_of_plants([found]) == f"1 patch: stems from {heading}"


def test_what_may_be_a_density_is_told_with_what_to_write(tmp_path: Path) -> None:
    """Patches were equally dense, and the attribute that says otherwise was one of those not read."""
    path = drawn(tmp_path / "a.geojson", bedekkingsdichtheid=2, stem_diameter=4, name="riet")
    said = summary_of_plants(planted_polygons(path, None))
    assert "bedekkingsdichtheid may be their density: where it is, write `patches: {file: ..., columns: {stems:" in said
    assert "stem_diameter may" not in said
    (found,) = planted_polygons(path, None, {"stems": "bedekkingsdichtheid"})
    assert (found.name, found.density, found.density_from) == ("riet", 2.0, "bedekkingsdichtheid")
    with pytest.raises(
        InputError, match=r"a.geojson: expected 'dichtheid' for stems of each polygon, got .* `patches`"
    ):
        planted_polygons(path, None, {"stems": "dichtheid"})


def test_a_site_file_names_columns_of_patches(tmp_path: Path) -> None:
    rows = "".join(f"{kind};{x};{y};{many}\n" for kind, many in (("riet", 20), ("zegge", 40)) for x, y in SQUARE[:-1])
    patches = "patches: {file: plants.csv, columns: {stems: aantal, name: soort}}\n"
    velocities = "experiment,section,x,y,u\nJune,A,8,0.5,0.4\n"
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE + patches, velocities__csv=velocities)
    (folder / "plants.csv").write_text(f"soort;x;y;aantal [1/m2]\n{rows}", encoding="utf-8")
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    assert [(one.name, one.stems) for one in case.plants.patches] == [("riet", 20.0), ("zegge", 40.0)]
    assert not any("columns" in one for one in assumptions_of(folder))
    (folder / "site.yaml").write_text(CHANNEL + JUNE + patches.replace("stems:", "stengels:"), encoding="utf-8")
    with pytest.raises(InputError, match=r"`patches.*columns` expected the headings of `stems` and `name`"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")
