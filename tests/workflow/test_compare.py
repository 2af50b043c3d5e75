"""Models are compared by the same measurements, each under a name of its own."""

from pathlib import Path

import pytest

import vegglue
from vegglue.case.config import load_case
from vegglue.case.schema import Case
from vegglue.errors import InputError


@pytest.fixture
def case(tmp_path: Path) -> Case:
    return load_case(vegglue.new("brook", folder=tmp_path).source)


def test_models_of_other_measurements_are_refused(case: Case, tmp_path: Path) -> None:
    one = next(one for one in case.observations if one.kind == "velocity")
    lines = one.file.read_text(encoding="utf-8").splitlines(keepends=True)
    fewer = tmp_path / "fewer.csv"
    fewer.write_text("".join(lines[:-1]), encoding="utf-8")
    observations = tuple(each.model_copy(update={"file": fewer}) if each is one else each for each in case.observations)
    other = case.model_copy(update={"name": "fewer", "observations": observations})
    with pytest.raises(InputError, match="expected fewer and brook to be fitted to the same measurements, got others"):
        vegglue.compare([case, other], runs=tmp_path / "runs")


def test_models_of_one_name_are_refused(case: Case, tmp_path: Path) -> None:
    other = case.model_copy(update={"eddy_viscosity": 0.02})
    with pytest.raises(InputError, match="expected models of different names, got two called brook"):
        vegglue.compare([case, other], runs=tmp_path / "runs")


@pytest.mark.slow
def test_a_model_may_be_there_twice(case: Case, tmp_path: Path) -> None:
    """Who extends by hand what `extend --auto` has extended has two files of one model."""
    first, second = vegglue.compare([case, case], runs=tmp_path / "runs").rungs
    assert first.in_sample.chi2 == second.in_sample.chi2
