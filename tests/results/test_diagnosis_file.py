"""diagnosis.h5: what is written comes back exactly, and xarray reads it."""

from dataclasses import fields
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from diagnoses import NOTHING, a_diagnosis

from vegglue.errors import InputError
from vegglue.results.diagnosis import Diagnosis, diagnosis_json
from vegglue.storage.result_files import diagnosis_that_fits, read_diagnosis, write_diagnosis

HASH = "d" * 64


@pytest.mark.parametrize("diagnosis", [a_diagnosis(), NOTHING, a_diagnosis(where=None)])
def test_diagnosis_comes_back_as_it_went(tmp_path: Path, diagnosis: Diagnosis) -> None:
    write_diagnosis(tmp_path / "diagnosis.h5", diagnosis, "name: open-x\n", HASH)
    back = read_diagnosis(tmp_path / "diagnosis.h5", HASH)
    for field in fields(Diagnosis):
        one, other = getattr(diagnosis, field.name), getattr(back, field.name)
        assert type(one) is type(other), field.name
        if isinstance(one, pd.DataFrame):
            pd.testing.assert_frame_equal(other, one, check_column_type=False)
        elif isinstance(one, np.ndarray | float):
            np.testing.assert_array_equal(other, one)
        else:
            assert one == other
    assert diagnosis_json(back) == diagnosis_json(diagnosis)


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
                assert data["cosine"].values.tolist() == diagnosis.cosine.tolist()
