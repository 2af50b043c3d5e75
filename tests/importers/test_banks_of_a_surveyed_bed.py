"""Banks of a surveyed bed: where the site file states them, and where it does not."""

import json
from pathlib import Path

import numpy as np
import pytest

import vegglue
from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case
from vegglue.cli.loop_commands import import_command
from vegglue.diagnosis.channel_check import SteepCellsLikeFloor
from vegglue.wording.sentences import sentence
from vegglue.workflow.import_folder import unnamed_banks


def surveyed(tmp_path: Path, said: str, rise: float = 0.5, **files: str) -> Case:
    """A floor of 3 m between banks, surveyed along and across; said: more of the site file."""
    folder = tmp_path / "mill"
    folder.mkdir()
    rows = (
        f"{x},{0.5 * j},{max(0.0, abs(0.5 * j) - 1.5) * rise - 0.001 * x:.4f}" for x in (0, 40) for j in range(-9, 10)
    )
    (folder / "bed.csv").write_text("\n".join(["x,y,z", *rows]), encoding="utf-8")
    (folder / "u.csv").write_text("x,y,u,u_se\n10,0,0.5,0.01\n", encoding="utf-8")
    for name, text in files.items():
        (folder / name.replace("__", ".")).write_text(text, encoding="utf-8")
    ground = "bed: {file: bed.csv}\ngrid: {x: [0, 40], y: [-4.5, 4.5], cell: [1.0, 0.25]}\n"
    june = "experiments: {June: {discharge: 2, level: 1.0}}\n"
    (folder / "site.yaml").write_text(ground + june + said, encoding="utf-8")
    return vegglue.import_folder(folder, tmp_path / "mill.yaml")


def taken_of_bed(case: Case) -> str:
    return next(one.taken for one in case.imported or () if one.name == "bed.csv")


BANKS = "channel: {length_m: 40, bottom_width_m: 3, bank_slope_v_per_h: 0.5, bed_slope: 0.001}\n"


def test_stated_banks_of_a_surveyed_bed_have_their_roughness(tmp_path: Path) -> None:
    case = surveyed(tmp_path, BANKS)
    site = build_site(case)
    banks = site.friction_class == site.class_names.index("bank")
    assert np.array_equal(banks, np.broadcast_to(np.abs(site.grid.y) > 1.5, banks.shape))
    assert list(case.parameters) == ["n_b", "k_s", "eddy_viscosity"]
    said = "banks lie beyond a slope of 0.25, half the stated one, and leave a floor of 3 m (3 m stated)"
    assert said in taken_of_bed(case)
    assert not unnamed_banks(case)


def test_stated_banks_that_no_survey_shows_are_told(tmp_path: Path) -> None:
    """No parameter is left without a cell that it acts on."""
    case = surveyed(tmp_path, BANKS, rise=0.1)
    assert list(case.friction.classes) == ["bed"]
    assert "k_s" not in case.parameters
    assert "no bank, as it is nowhere steeper than 0.25" in taken_of_bed(case)
    assert not unnamed_banks(case)


def test_walls_and_classes_of_ones_own_win_over_stated_banks(tmp_path: Path) -> None:
    assert "bank" not in surveyed(tmp_path, BANKS + "walls: true\n").friction.classes
    corners = [[x, y] for x, y in ((0, -4.5), (40, -4.5), (40, -3), (0, -3), (0, -4.5))]
    shape = {"type": "Polygon", "coordinates": [corners]}
    for name, laws in (("grass", ["manning", "manning", "keulegan"]), ("bank", ["manning", "manning"])):
        feature = {"type": "Feature", "properties": {"class": name}, "geometry": shape}
        text = json.dumps({"type": "FeatureCollection", "features": [feature]})
        (tmp_path / name).mkdir()
        case = surveyed(tmp_path / name, BANKS + "classes: {file: classes.geojson}\n", classes__geojson=text)
        assert [one.law for one in case.friction.classes.values()] == laws
        site = build_site(case)
        assert (site.friction_class[:, site.grid.y < -3] == site.class_names.index(name)).all()


def test_steep_cells_without_a_class_are_told_by_import_and_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = surveyed(tmp_path, "")
    assert list(case.friction.classes) == ["bed"]
    (told,) = unnamed_banks(case)
    (one,) = [one for one in vegglue.check(case, runs=tmp_path).remarks if isinstance(one, SteepCellsLikeFloor)]
    assert told == sentence(one)
    assert one.slope == 0.2
    import_command(tmp_path / "mill", tmp_path / "other.yaml")
    assert told in capsys.readouterr().out
