"""A new working folder is one that runs as it is."""

from pathlib import Path

import numpy as np
import pytest
from built_models import model_of
from reach import Say

import vegglue
from vegglue.case.gridded_site import build_site
from vegglue.diagnosis.case_check import check_case
from vegglue.engine.interface import linearise
from vegglue.errors import InputError, StorageError
from vegglue.measurements.observations import read_observations
from vegglue.workflow.new import Reach


@pytest.mark.parametrize("reach", [Reach(), Reach(length=20.0, width=1.0, depth=0.3, discharge=0.1, plants=False)])
def test_a_new_case_has_no_remarks_and_water_flows_in_it(tmp_path: Path, reach: Reach) -> None:
    case = vegglue.new("Mill brook", reach, folder=tmp_path)
    assert case.name == "mill-brook"
    assert list(case.parameters) == (["n_b", "phi"] if reach.plants else ["n_b"])
    observations = read_observations(case)
    assert observations.table["used"].all()
    assert check_case(case, build_site(case), observations) == []
    assert linearise(model_of(case, observations), np.zeros(len(case.parameters))) is not None
    assert {path.name for path in (tmp_path / "Mill brook").iterdir()} == {
        "case.yaml", "velocities.csv", "levels.csv", "README.md",
    }  # fmt: skip


def test_every_key_has_its_comment_and_the_measurements_say_what_they_are(tmp_path: Path) -> None:
    case = vegglue.new("brook", folder=tmp_path)
    text = (tmp_path / "brook/case.yaml").read_text(encoding="utf-8")
    assert text.count("#") > 15
    assert "# plants" not in text
    assert all(one.synthetic for one in case.observations)


def test_a_folder_that_is_there_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "brook").mkdir()
    with pytest.raises(InputError, match="expected a name that is free"):
        vegglue.new("brook", folder=tmp_path)
    assert list((tmp_path / "brook").iterdir()) == []


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--depth", "0", "--depth: expected a number above 0"),
        ("--length", "5", "four times"),
        ("--width", "nan", "--width: expected a number above 0, got nan"),
        ("--length", "inf", "--length: expected a number above 0, got inf"),
        ("--slope", "nan", "--slope: expected a number, got nan"),
    ],
)
def test_senseless_numbers_are_refused(
    tmp_path: Path,
    say: Say,
    option: str,
    value: str,
    said: str,
) -> None:
    code, error = say("new", "brook", "--folder", tmp_path, option, value)
    assert code == 2
    assert said in error
    assert not (tmp_path / "brook").exists()


def test_what_a_killed_command_left_is_taken_away(tmp_path: Path) -> None:
    """Nothing of it lies under the name of the folder, which appears when it is whole."""
    left = tmp_path / ".brook.new"
    left.mkdir()
    for name in ("case.yaml", "velocities.csv.new"):
        (left / name).write_text("half", encoding="utf-8")
    vegglue.new("brook", folder=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["brook"]
    (tmp_path / ".mill.new").mkdir()
    (tmp_path / ".mill.new" / "thesis.tex").write_text("mine", encoding="utf-8")
    with pytest.raises(StorageError, match=r"\.mill\.new: cannot be written .* take it away"):
        vegglue.new("mill", folder=tmp_path)
    assert (tmp_path / ".mill.new" / "thesis.tex").read_text() == "mine"


def test_numbers_without_a_flow_leave_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vegglue.workflow.new.solve_flow", lambda case, theta: {})
    with pytest.raises(InputError, match="no steady flow is found"):
        vegglue.new("brook", folder=tmp_path)
    assert list(tmp_path.iterdir()) == []
