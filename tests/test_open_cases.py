"""Diagnoses of data that another code made. They lie in a folder `shared` beside the repository, else: skipped.

On the paper's cells, 0.5 m x 0.375 m, with the wide priors of `vegglue import`: nobody tells the diagnosis anything.
"""

from pathlib import Path

import pytest
import yaml

from vegglue.config import load_case
from vegglue.diagnose import diagnose
from vegglue.diagnosis import Diagnosis
from vegglue.intake import case_from_folder
from vegglue.loop import model_in

CASES = Path(__file__).parents[2] / "shared" / "cases"
GRID = {"x": [0.0, 100.0], "y": [-4.5, 4.5], "cell": [0.5, 0.375]}
EDDIES = {"viscosity", "elder", "smagorinsky", "mixing_length", "coherent_structures", "edge_mixing"}
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CASES.is_dir(), reason="no folder `shared/cases` beside the repository"),
]


def diagnosed(name: str, folder: Path) -> Diagnosis:
    target = folder / "case.yaml"
    target.write_text(yaml.safe_dump(case_from_folder(CASES / name, target) | {"grid": GRID}), encoding="utf-8")
    return diagnose(model_in(load_case(target)))


def test_where_nothing_is_hidden_nothing_is_found(tmp_path: Path) -> None:
    found = diagnosed("open-a", tmp_path)
    assert found.verdict == "nothing-missing", found.sentence


@pytest.mark.parametrize(
    ("name", "hidden"),
    [("open-b", "secondary_current"), ("open-c", "streamlining"), ("open-d", "discharge_error[high]")],
)
def test_one_hidden_effect_is_found(name: str, hidden: str, tmp_path: Path) -> None:
    found = diagnosed(name, tmp_path)
    assert found.verdict in ("identified", "one-of"), found.sentence
    assert hidden in found.steps[0].rivals, found.sentence
    assert len(found.steps[0].groups) <= 2, found.sentence
    assert found.chi2 < found.chi2_first


def test_mixing_is_found_as_a_family(tmp_path: Path) -> None:
    """Viscosity and a mixing length leave nearly the same trace there: either name will do."""
    found = diagnosed("open-e", tmp_path)
    assert found.verdict in ("identified", "one-of"), found.sentence
    assert found.steps[0].accepted in EDDIES, found.sentence


def test_something_unlisted_is_none_of_these_and_has_a_place(tmp_path: Path) -> None:
    found = diagnosed("open-f", tmp_path)
    assert found.verdict == "none-of-these", found.sentence
    assert found.where is not None
    assert ((found.where.x - 33.0) ** 2 + (found.where.y + 0.6) ** 2) ** 0.5 < 1.5
