"""diagnosis.h5: what is written comes back exactly, and xarray reads it."""

import json
import math
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from diagnoses import EVERY_KIND, NO_LOCATION, NOTHING, a_candidate_effect, a_diagnosis

from vegglue.errors import InputError, StorageError
from vegglue.results.causes import FieldFound, FieldMapKept
from vegglue.results.diagnosis import Diagnosis, diagnosis_json
from vegglue.results.result_files import diagnosis_that_fits, read_diagnosis, write_diagnosis

HASH = "d" * 64
ATTRIBUTES = {
    "chi2", "chi2_first", "config", "config_hash", "correlation", "field", "first_parameters", "first_scores",
    "flagged", "format", "freedom", "grid_error", "instruments", "laws", "left_over", "locations", "mapped_term",
    "model_error", "name", "not_excluded", "p_misfit", "parameters", "remarks", "scale", "sentence", "standing_out",
    "steps", "tells_laws",
    "threshold", "verdict", "verdict_value", "clears_the_model", "version", "where",
}  # fmt: skip
OF_STATIONS = [
    "experiment", "kind", "section", "x", "y", "value", "standard_error", "used", "reason", "depth", "device",
]  # fmt: skip
OF_AN_EFFECT = [
    "name", "title", "unit", "amplitude", "interval95", "score", "p_family", "visibility", "smallest_detectable",
    "testable", "refitted", "objective", "mimicked_by", "likeness", "shapes", "off", "scale", "support",
]  # fmt: skip
DATASETS = {
    "stations": ["station", *OF_STATIONS, "prediction_first", "prediction", "error"],
    "suspects": [
        "suspect",
        *(name for name in OF_AN_EFFECT if name not in ("interval95", "support")),
        "low95",
        "high95",
        "least",
        "most",
    ],
    "zones": ["zone_number", "experiment", "section", "zone", "stations", "mean", "standard_error", "chi2"],
    "places": ["place", "x", "y", "score"],
    "alike": ["name", "other", "cosine"],
}
IN_JSON = [
    "verdict", "sentence", "left_over", "verdict_value", "standing_out", "set", "groups", "not_excluded", "where",
    "effects", "steps", "remarks", "chi2", "threshold", "noise", "flagged", "parameters", "first_parameters", "places",
    "instruments", "field", "model_error", "laws", "zones",
]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("steps", '"rivals": ["', '"rivals": ["un'),
        ("steps", '"accepted": "', '"accepted": "un'),
        ("flagged", "[1]", "[400]"),
        ("instruments", '"stations": [', '"stations": [-1, '),
    ],
)
def test_names_and_rows_of_nothing_are_refused(tmp_path: Path, name: str, old: str, new: str) -> None:
    write_diagnosis(tmp_path / "diagnosis.h5", EVERY_KIND, "name: open-x\n", HASH)
    with h5py.File(tmp_path / "diagnosis.h5", "r+") as file:
        assert old in file.attrs[name], file.attrs[name]
        file.attrs[name] = file.attrs[name].replace(old, new)
    with pytest.raises(StorageError, match=r"diagnosis\.h5: is broken or of another version \(a st"):
        read_diagnosis(tmp_path / "diagnosis.h5", HASH)


@pytest.mark.parametrize("diagnosis", [a_diagnosis(), NOTHING, NO_LOCATION, EVERY_KIND])
def test_diagnosis_comes_back_as_it_went(tmp_path: Path, diagnosis: Diagnosis) -> None:
    write_diagnosis(tmp_path / "diagnosis.h5", diagnosis, "name: open-x\n", HASH)
    back = read_diagnosis(tmp_path / "diagnosis.h5", HASH)
    assert_same(back, diagnosis)
    assert diagnosis_json(back) == diagnosis_json(diagnosis)
    json.dumps(diagnosis_json(back), allow_nan=False)


def assert_same(back: object, there: object) -> None:
    """Equal in every field of every part, and of the same types."""
    assert type(back) is type(there)
    if is_dataclass(there):
        for field in fields(there):
            assert_same(getattr(back, field.name), getattr(there, field.name))
    elif isinstance(there, pd.DataFrame):
        pd.testing.assert_frame_equal(back, there, check_column_type=False)
    elif isinstance(there, np.ndarray | float):
        np.testing.assert_array_equal(back, there)
    elif isinstance(there, tuple):
        assert len(back) == len(there)
        for one, other in zip(back, there, strict=True):
            assert_same(one, other)
    else:
        assert back == there


def test_the_layout_of_the_file_is_the_one_agreed(tmp_path: Path) -> None:
    """What other programs read by name: attributes, and datasets by group in their order."""
    write_diagnosis(tmp_path / "diagnosis.h5", a_diagnosis(), "", HASH)
    with h5py.File(tmp_path / "diagnosis.h5") as file:
        assert set(file.attrs) == ATTRIBUTES
        assert {name: list(group) for name, group in file.items()} == DATASETS
    assert list(diagnosis_json(a_diagnosis())) == IN_JSON
    assert list(diagnosis_json(a_diagnosis())["effects"][0]) == OF_AN_EFFECT


def test_diagnosis_of_another_config_is_refused(tmp_path: Path) -> None:
    write_diagnosis(tmp_path / "diagnosis.h5", a_diagnosis(), "", HASH)
    with pytest.raises(InputError, match="run `vegglue diagnose CONFIG` again"):
        read_diagnosis(tmp_path / "diagnosis.h5", "e" * 64)
    with pytest.raises(InputError, match="run `vegglue diagnose CONFIG`"):
        read_diagnosis(tmp_path / "other.h5")


def test_only_a_diagnosis_of_the_same_config_fits(tmp_path: Path) -> None:
    path = tmp_path / "diagnosis.h5"
    assert diagnosis_that_fits(path, HASH) is None
    write_diagnosis(path, a_diagnosis(), "", HASH)
    fitting = diagnosis_that_fits(path, HASH)
    assert fitting is not None
    assert fitting.set == a_diagnosis().set
    assert diagnosis_that_fits(path, "e" * 64) is None


def test_a_diagnosis_of_another_format_is_made_anew(tmp_path: Path) -> None:
    path = tmp_path / "diagnosis.h5"
    write_diagnosis(path, a_diagnosis(), "", HASH)
    with h5py.File(path, "r+") as file:
        file.attrs["format"] = "vegglue diagnosis 1"
    assert diagnosis_that_fits(path, HASH) is None


@pytest.mark.parametrize("diagnosis", [a_diagnosis(), NOTHING])
def test_xarray_opens_every_group_of_a_diagnosis(tmp_path: Path, diagnosis: Diagnosis) -> None:
    xarray = pytest.importorskip("xarray")
    write_diagnosis(tmp_path / "diagnosis.h5", diagnosis, "", HASH)
    for group in ("stations", "suspects", "zones", "places", "alike"):
        with xarray.open_dataset(tmp_path / "diagnosis.h5", group=group, engine="h5netcdf") as data:
            data.load()
            assert not any(name.startswith("phony") for name in data.sizes)
            if group == "stations":
                assert data["prediction_first"].dims == ("station",)
            if group == "alike":
                assert data["cosine"].values.tolist() == diagnosis.first_screening.cosine.tolist()


def test_a_refit_tells_instead_of_the_last_score() -> None:
    """Its score in a model that holds it by now is small, which is no sign against it."""
    tested = a_candidate_effect("eddies", amplitude={"refitted": True}, test={"score": -1.4, "p_family": 1.0})
    found = a_diagnosis(candidate_effects=(tested, a_candidate_effect("mixing[D3]")))
    assert found.first_score(tested) == 45.2
    assert math.isnan(found.last_score(tested))
    assert math.isnan(found.p_of_score(tested))


def test_p_is_of_the_score_told_last() -> None:
    found = a_diagnosis()
    wind, turning = found.candidate_effect("wind"), found.candidate_effect("turning")
    assert (found.last_score(wind), found.p_of_score(wind)) == (0.3, 1.0)
    assert (found.last_score(turning), found.p_of_score(turning)) == (-1.0, 0.7)
    nothing = replace(found, steps=(), places=(), instruments=())
    assert math.isnan(nothing.last_score(wind))
    assert nothing.p_of_score(wind) == 1.0


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
