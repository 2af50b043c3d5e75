"""Velocities beside patches are as exact wherever the sides of these lie between the sides of cells."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from built_models import model_of

from vegglue.case.config import load_case
from vegglue.case.schema import Case
from vegglue.diagnosis.diagnose import diagnose_model
from vegglue.engine.interface import linearise
from vegglue.measurements.kinds import velocity_rows
from vegglue.measurements.observations import read_observations

CONFIG = Path(__file__).parents[2] / "configs" / "twin.yaml"
CELL, FINE = (0.5, 0.1875), (0.125, 0.046875)


def moved_case(folder: Path, moved: tuple[float, float], cell: tuple[float, float]) -> Case:
    """The twin's channel on other cells, its patches moved along and across [m]."""
    tree = yaml.safe_load(CONFIG.read_text("utf-8"))
    tree["grid"]["cell"] = list(cell)
    for one in tree["observations"]:
        one["file"] = str(CONFIG.parent / one["file"])
    for patch in tree["plants"]["patches"]:
        patch["x"] = [x + moved[0] for x in patch["x"]]
        patch["y"] = [y + moved[1] for y in patch["y"]]
    (folder / "moved.yaml").write_text(yaml.safe_dump(tree))
    return load_case(folder / "moved.yaml")


def velocities(folder: Path, moved: tuple[float, float], cell: tuple[float, float]) -> np.ndarray:
    """u [m/s] at its stations."""
    case = moved_case(folder, moved, cell)
    observations, predicted = read_observations(case), list[np.ndarray]()

    def without_slopes(prediction: np.ndarray) -> bool:
        predicted.append(prediction)
        return False

    assert linearise(model_of(case, observations), np.zeros(len(case.parameters)), wanted=without_slopes) is None
    return predicted[0][velocity_rows(observations.table)]


def error(folder: Path, moved: tuple[float, float]) -> float:
    """Root of the mean square difference to cells of a fourth of the size [m/s]."""
    return float(np.sqrt(np.mean((velocities(folder, moved, CELL) - velocities(folder, moved, FINE)) ** 2)))


def test_sides_within_cells_add_no_error(tmp_path: Path) -> None:
    """0.0015 m/s with sides between cells and 0.0014 to 0.0018 anywhere; 0.006 to 0.014 where a cell was planted by
    its centre.
    """
    between = error(tmp_path, (0.0, 0.0))
    for moved in ((0.2, 0.09), (0.33, 0.15)):
        assert error(tmp_path, moved) < 1.5 * between, moved


@pytest.mark.slow
def test_where_nothing_is_hidden_beside_them_nothing_is_found(tmp_path: Path) -> None:
    """A channel whose patches lie across cells, its data those of cells of a fourth of the size and errors as stated.
    With cells planted by their centre a deeper bed was told beside a patch, 32 to 1.
    """
    random, moved = np.random.default_rng(100), (0.2, 0.09)
    z = random.uniform(-0.7, 0.7, 4)
    case = moved_case(tmp_path, moved, FINE)
    observations = read_observations(case)
    point = linearise(model_of(case, observations), z)
    assert point is not None
    error = observations.table["standard_error"].to_numpy(float)
    measured = point.prediction + error * random.standard_normal(error.size)
    model = model_of(moved_case(tmp_path, moved, CELL), observations)
    model = replace(model, station=observations.table.assign(value=measured))
    assert diagnose_model(model).verdict.kind == "nothing-missing"
