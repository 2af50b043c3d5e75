"""A folder of a field team becomes a case, or is refused in a sentence."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from field_folders import field_folder
from reach import here, said_to

from vegglue.case.config import load_case
from vegglue.engine.interface import linearise
from vegglue.engine.model import model_of
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations
from vegglue.workflow.import_folder import import_folder


@pytest.mark.slow
def test_a_folder_becomes_a_case(tmp_path: Path) -> None:
    said = here(tmp_path, "import", field_folder(tmp_path / "Mill Brook"), "--to", "mill.yaml").stdout
    case = load_case(tmp_path / "mill.yaml")
    assert "vegglue run mill.yaml" in said
    assert case.name == "mill-brook"
    assert set(case.parameters) == {"n_b", "k_s", "phi", "canopy_height", "eddy_viscosity"}
    assert [patch.stems for patch in case.plants.patches] == [20.0, 1.0]
    assert case.plants.stands["plants"].stems == 20.0
    assert case.grid.cell[1] == pytest.approx(3.0 / 16)
    assert case.grid.y[1] > 1.5 + 0.75 / 0.6667, "the banks reach above the water"
    assert case.validation is not None
    assert list(case.validation.experiments) == ["high"]
    table = read_observations(case).table
    assert table["kind"].tolist() == ["velocity", "level"]
    assert linearise(model_of(case, read_observations(case)), np.zeros(5)) is not None, "water flows in it"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"channel": {"length_m": 40.0}}, "`channel.bottom_width_m` is missing"),
        ({"experiments": {}}, "`experiments` expected one or more"),
        (
            {"experiments": {"low": {"discharge_m3_s": "much", "downstream_level_m": 1}}},
            "expected a number, got 'much'",
        ),
        (
            {"experiments": {"low": {"discharge_m3_s": 2.66, "downstream_level_m": 431.75}}},
            "`experiments.low` expected a level in m above the floor at x = 0, got 431.75 m, which makes the outlet",
        ),
        ({"holdout": {"high": {"discharge": "2 m3/s", "level": "31.9 m"}}}, "`holdout.high` expected a level in m"),
    ],
)
def test_a_folder_that_says_too_little_is_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    changes: dict[str, Any],
    said: str,
) -> None:
    folder = field_folder(tmp_path / "site", **changes)
    code, error = said_to(monkeypatch, capsys, "import", folder, "--to", tmp_path / "site.yaml")
    assert code == 2
    assert said in error
    assert not (tmp_path / "site-data").exists()
    assert len(error.strip().splitlines()) == 1


@pytest.mark.parametrize("name", ["measured.csv", "holdout.csv"])
def test_a_folder_without_a_measurement_says_which_columns_it_has_and_which_are_known(
    tmp_path: Path, name: str
) -> None:
    """Known columns were not named; and where nothing held out was a measurement, nothing was held out, unsaid."""
    folder = field_folder(tmp_path / "site")
    for file in ("velocities.csv", "levels.csv") if name == "measured.csv" else ():
        (folder / file).unlink()
    (folder / name).write_text("x,section,Tempo\n10,A,0.3\n", encoding="utf-8")
    done = here(tmp_path, "import", "site", "--to", "site.yaml", succeed=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert f"{name}: no measurement, left out: x from x [m], section from section" in done.stderr
    assert "not read: Tempo" in done.stderr
    assert "understood, among them velocity as u, vx, ux, u mean; velocity across as v, vy" in done.stderr
    assert ("site: of what is held out, expected columns of" in done.stderr) == (name == "holdout.csv")


OVER_WATER = "experiment,section,x,y,z,u\nlow,A,12,0,1.2,0.4\nlow,A,12,0,1.4,0.5\n"
IN_WATER = OVER_WATER.replace("1.2,", "0.2,").replace("1.4,", "0.4,")


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"adv.csv": OVER_WATER}, "made/site-data/adv.csv: expected points of case 'low/A' between the bed and"),
        ({"adv.csv": IN_WATER, "adv2.csv": IN_WATER}, "expected section A of experiment low once, got two"),
        ({"again.csv": "experiment,section,x,y,u\nlow,A,12,0.5,0.5\n"}, "expected each station once"),
    ],
)
def test_a_refused_import_leaves_nothing_behind(tmp_path: Path, tables: dict[str, str], said: str) -> None:
    """What only the reading of the finished case refuses was told when config and tables lay there already."""
    folder = field_folder(tmp_path / "site")
    for name, text in tables.items():
        (folder / name).write_text(text, encoding="utf-8")
    done = here(tmp_path, "import", "site", "--to", "made/site.yaml", succeed=False)
    assert done.returncode == 2
    assert said in done.stderr
    assert "Nothing was written" in done.stderr
    assert "tmp" not in done.stderr, "the paths are those that the files would have had"
    assert [path.name for path in tmp_path.iterdir()] == ["site"]


@pytest.mark.parametrize(("u", "said"), [(0.4, True), (2.4, False)])
def test_points_over_the_water_whose_velocities_would_lie_in_it_may_be_exchanged(
    tmp_path: Path, u: float, said: bool
) -> None:
    folder = field_folder(tmp_path / "site")
    (folder / "adv.csv").write_text(OVER_WATER.replace("0.4\n", f"{u}\n"), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        import_folder(folder, tmp_path / "site.yaml")
    assert ("whether they and `u`, whose numbers would lie in the water, are exchanged" in str(refused.value)) == said


def test_the_grid_is_wide_enough_for_what_is_held_out(tmp_path: Path) -> None:
    """It fitted the experiments alone, and a flow held out at 1.6 m reached its sides."""
    high = {"high": {"discharge_m3_s": 6.0, "downstream_level_m": 1.6}}
    case = import_folder(field_folder(tmp_path / "site", holdout=high), tmp_path / "site.yaml")
    assert case.grid.y[1] > 1.5 + 1.6 / 0.6667


@pytest.mark.parametrize("name", ["._velocities.csv", ".velocities.csv", "~$velocities.xlsx"])
def test_what_programs_leave_beside_a_table_is_no_measurement(tmp_path: Path, name: str) -> None:
    """An open workbook, or a folder that was zipped on a Mac, could not be imported."""
    folder = field_folder(tmp_path / "site")
    (folder / name).write_bytes(b"\x00\x05\x16\x07 velocity,1\n")
    assert len(import_folder(folder, tmp_path / "site.yaml").observations) == 2


def test_a_file_of_notes_may_be_moved_away(tmp_path: Path) -> None:
    folder = field_folder(tmp_path / "site")
    (folder / "notes.txt").write_text("We came on 3 June, 2024.\nIt rained.\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"notes\.txt: .* move .* out of the folder"):
        import_folder(folder, tmp_path / "site.yaml")
