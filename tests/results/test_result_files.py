"""Ensembles on disk: they come back as they went, what does not fit is told, and xarray reads them."""

from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from stored import ALL, HASH, MEMBERS, a_header, assert_whole, write_chunks

from vegglue.errors import InputError, StorageError
from vegglue.results.ensemble import ROWS
from vegglue.results.result_files import read_ensemble, stored_hash


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "runs" / "d0" / "ensemble.h5"


def test_ensemble_comes_back_as_it_went(path: Path) -> None:
    header = a_header()
    write_chunks(path, ALL, header)
    assert_whole(path, header)
    ensemble = read_ensemble(path, HASH)
    assert list(ensemble.parameters) == ["z_last", "a_first"]  # the order of the config
    assert all(np.array_equal(ensemble.parameters[name], header.parameters[name]) for name in header.parameters)
    pd.testing.assert_frame_equal(ensemble.station, header.station, check_dtype=False)
    assert ensemble.station["used"].dtype == bool
    assert (ensemble.experiments, ensemble.sections) == (header.experiments, header.sections)
    assert (ensemble.config, ensemble.seed, ensemble.version) == ("name: d0\n", 5, "0.1.0")
    assert stored_hash(path) == HASH


@pytest.mark.slow
def test_missing_other_and_broken_ensembles_are_told(path: Path) -> None:
    with pytest.raises(InputError, match=r"ensemble\.h5: .*found no file; run `vegglue simulate CONFIG`"):
        read_ensemble(path)
    write_chunks(path, ALL, a_header())
    with pytest.raises(InputError, match=r"expected config hash eeeeeeeeeeee, found ffffffffffff: .* again"):
        read_ensemble(path, "e" * 64)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(StorageError, match="cannot be opened"):
        read_ensemble(path)
    assert stored_hash(path) is None
    path.write_bytes(content)
    with h5py.File(path, "r+") as file:
        del file["members/seconds"]
    with pytest.raises(StorageError, match="is broken or of another version"):
        read_ensemble(path)


def test_parameter_named_like_a_dimension_is_refused(path: Path) -> None:
    named = {"member": np.ones(MEMBERS)}
    with pytest.raises(InputError, match=r"\['member'\] are names of dimensions .* rename"):
        write_chunks(path, set(), a_header(parameters=named, units={"member": "-"}))
    assert [file.name for file in path.parent.iterdir()] == [".lock"]


@pytest.mark.parametrize("group", ["members", "parameters", "stations", "progress"])
def test_xarray_opens_every_group_of_an_ensemble(path: Path, group: str) -> None:
    xarray = pytest.importorskip("xarray")
    write_chunks(path, ALL, a_header())
    with xarray.open_dataset(path, group=group, engine="h5netcdf") as data:
        data.load()
    if group == "members":
        assert set(data.data_vars) == {*ROWS, "section_x"}
        assert data["section_flow"].dims == ("member", "experiment", "section")
        assert data["section"].values.tolist() == ["D0", "D3"]
        assert data["seconds"].attrs["units"] == "s"
    if group == "stations":
        assert data["used"].values.tolist() == [True, False]
