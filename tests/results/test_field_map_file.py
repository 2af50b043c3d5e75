"""The map of a field in diagnosis.h5: on its own grid, with its unit, and no group without a field."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from diagnoses import a_diagnosis

from vegglue.results.causes import FieldFound, FieldMapKept
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.result_files import read_diagnosis, write_diagnosis

MAP = FieldMapKept(
    x=np.array([1.0, 2.0, 3.0]), y=np.array([-0.5, 0.5]), value=np.arange(6.0).reshape(3, 2), error=np.full((3, 2), 0.1)
)


def with_field(term: str) -> Diagnosis:
    field = FieldFound(term, size=0.4, length=7.5, width=1.5, log_factor=40.5, value=0.6, error=0.1, x=3.0, y=0.5)
    return replace(a_diagnosis(), field=field, field_map=MAP)


@pytest.mark.parametrize(("term", "unit"), [("friction", "-"), ("bed", "m"), ("viscosity", "m2/s"), ("inflow", "m/s")])
def test_a_map_comes_back_with_its_unit(tmp_path: Path, term: str, unit: str) -> None:
    path = tmp_path / "diagnosis.h5"
    write_diagnosis(path, with_field(term), "", "d" * 64)
    back = read_diagnosis(path).field_map
    assert back is not None
    for name in ("x", "y", "value", "error"):
        np.testing.assert_array_equal(getattr(back, name), getattr(MAP, name))
    with h5py.File(path) as file:
        units = {name: file["field"][name].attrs.get("units", "-") for name in ("x", "y", "value", "error")}
    assert units == {"x": "m", "y": "m", "value": unit, "error": unit}


def test_without_a_field_there_is_no_map(tmp_path: Path) -> None:
    path = tmp_path / "diagnosis.h5"
    write_diagnosis(path, replace(a_diagnosis(), field=None), "", "d" * 64)
    assert read_diagnosis(path).field_map is None
    with h5py.File(path) as file:
        assert "field" not in file


def test_the_learned_bed_comes_back_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "diagnosis.h5"
    write_diagnosis(path, replace(with_field("friction"), bed_map=replace(MAP, value=-MAP.value)), "", "d" * 64)
    found = read_diagnosis(path)
    assert found.field_map is not None
    assert found.bed_map is not None
    np.testing.assert_array_equal(found.bed_map.value, -found.field_map.value)
    with h5py.File(path) as file:
        assert file["bed"]["value"].attrs["units"] == "m"


def test_bounds_of_an_amplitude_come_back(tmp_path: Path) -> None:
    path, found = tmp_path / "diagnosis.h5", a_diagnosis()
    first = found.candidate_effects[0]
    bounded = replace(first, amplitude=replace(first.amplitude, support=(-0.5, np.inf)))
    write_diagnosis(path, replace(found, candidate_effects=(bounded, *found.candidate_effects[1:])), "", "d" * 64)
    assert read_diagnosis(path).candidate_effects[0].amplitude.support == (-0.5, np.inf)
