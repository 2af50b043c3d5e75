"""`vegglue.load`: what lies in the folder of a run, as xarray and ArviZ know it."""

import re
from pathlib import Path

import numpy as np
import pytest
from diagnoses import a_diagnosis
from posteriors import a_posterior
from stored import ALL, HASH, MEMBERS, WINDOW, a_header, write_chunks

import vegglue
from vegglue.results import labelled_arrays
from vegglue.results.result_files import write_diagnosis, write_posterior
from vegglue.wording.sentences import tagged

pytestmark = pytest.mark.slow


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A folder in which every step has left its result."""
    write_chunks(tmp_path / "ensemble.h5", ALL, a_header(window=WINDOW))
    write_posterior(tmp_path / "posterior.h5", a_posterior(canopy=True), "name: d0\n", HASH)
    write_diagnosis(tmp_path / "diagnosis.h5", a_diagnosis(), "name: d0\n", HASH)
    return tmp_path


def test_everything_in_a_folder_is_loaded(run: Path) -> None:
    loaded = vegglue.load(str(run))
    assert dict(loaded.ensemble.sizes)["member"] == MEMBERS
    assert loaded.ensemble.prediction.dims == ("member", "station")
    np.testing.assert_array_equal(loaded.ensemble.z_last, np.linspace(1, 2, MEMBERS))
    assert loaded.ensemble.z_last.attrs["units"] == "m"
    assert loaded.fields.u.dims == ("member", "experiment", "x", "y")
    assert float(loaded.members.weights.sum()) == pytest.approx(1.0)
    assert loaded.posterior.posterior["phi"].dims == ("chain", "draw")
    assert tagged(loaded.diagnosis.verdict).keys() == tagged(a_diagnosis().verdict).keys()
    np.testing.assert_equal(tagged(loaded.diagnosis.verdict), tagged(a_diagnosis().verdict))
    assert loaded.stations["kind"].tolist() == ["velocity", "level"]
    assert loaded.stations["used"].dtype == bool
    for data in (loaded.ensemble, loaded.members):
        assert (data.attrs["config"], data.attrs["config_hash"]) == ("name: d0\n", HASH)


def test_arviz_of_either_generation_gives_the_same_draws(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """InferenceData before 1.0, a DataTree of xarray from then on; Python 3.11 gets the older one only."""
    arviz, own = pytest.importorskip("arviz"), vegglue.load(run).posterior
    monkeypatch.setattr(arviz, "__version__", "1.3.0")
    tree = vegglue.load(run).posterior
    assert isinstance(tree, pytest.importorskip("xarray").DataTree)
    groups = {"posterior", "prior", "log_likelihood", "posterior_predictive", "observed_data"}
    assert groups <= set(tree.children)
    for group in groups:
        for name, values in own[group].data_vars.items():
            np.testing.assert_array_equal(tree[group][name].values, values.values)
    assert "posterior: n_b, phi" in repr(vegglue.load(run))
    (run / "posterior.h5").unlink()
    assert tree.posterior["phi"].values.size == 2000, "read, and closed"


def test_a_loaded_run_says_what_it_holds(run: Path) -> None:
    shown = repr(vegglue.load(run))
    sizes = ("ensemble: 12 members, 2 stations", "fields:", "2 rows")
    for part in ("Run in", *sizes, "posterior: n_b, phi", "eddies"):
        assert part in shown


def test_files_are_closed_so_that_a_command_may_write_them(run: Path) -> None:
    loaded = vegglue.load(run)
    for path in run.glob("*.h5"):
        path.unlink()
    assert float(loaded.fields.u.max()) > 0.0
    assert loaded.posterior.posterior["phi"].values.size == 2000


def test_what_was_not_done_is_none(tmp_path: Path) -> None:
    write_chunks(tmp_path / "ensemble.h5", ALL, a_header())
    loaded = vegglue.load(tmp_path)
    assert (loaded.fields, loaded.members, loaded.posterior, loaded.diagnosis) == (None,) * 4
    assert len(loaded.stations) == 2
    assert repr(loaded).count("\n") == 2


def test_an_empty_folder_is_refused_with_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(vegglue.InputError, match=r"expected results of a run .* run `vegglue simulate CONFIG`"):
        vegglue.load(tmp_path / "no" / "such")


def test_a_broken_file_is_told(run: Path) -> None:
    (run / "posterior.h5").write_bytes(b"no HDF5")
    with pytest.raises(vegglue.StorageError, match=r"posterior\.h5: cannot be opened"):
        vegglue.load(run)


@pytest.mark.parametrize("missing", ["xarray", "arviz", "h5netcdf"])
def test_a_missing_library_is_one_sentence(run: Path, missing: str, monkeypatch: pytest.MonkeyPatch) -> None:
    known = labelled_arrays.import_module

    def without(name: str) -> object:
        if name == missing:
            raise ImportError(name)
        return known(name)

    monkeypatch.setattr(labelled_arrays, "import_module", without)
    with pytest.raises(vegglue.InputError, match=rf"the library {missing}, .* `pip install 'vegglue\[arviz\]'`"):
        vegglue.load(run)


def test_all_results_are_one_tree_with_names_and_units_of_cf(run: Path) -> None:
    tree = vegglue.load(run).tree
    assert isinstance(tree, pytest.importorskip("xarray").DataTree)
    assert {"ensemble", "fields", "members", "stations", "posterior", "prior", "log_likelihood"} <= set(tree.children)
    assert tree.attrs["Conventions"].startswith("CF-")
    assert tree["ensemble/prediction"].dims == ("member", "station")
    assert tree["ensemble"]["member"].attrs["standard_name"] == "realization"
    assert tree["fields/level"].attrs["standard_name"] == "water_surface_height_above_reference_datum"
    assert tree["fields/u"].attrs["units"] == "m/s"
    status = tree["ensemble/status"].attrs
    assert len(status["flag_values"]) == len(status["flag_meanings"].split())
    for node in tree.subtree:
        for name, variable in node.variables.items():
            unit = variable.attrs.get("units", "1")
            assert re.fullmatch(r"1|(?:(?:m|s|kg|N|W)\d*)(?:[ /](?:m|s|kg)\d*)*", unit), (node.path, name, unit)
            assert variable.attrs["long_name"]


def test_the_tree_is_written_and_read_again(run: Path, tmp_path: Path) -> None:
    xarray, tree = pytest.importorskip("xarray"), vegglue.load(run).tree
    tree.to_netcdf(tmp_path / "all.nc", engine="h5netcdf")
    with xarray.open_datatree(tmp_path / "all.nc", engine="h5netcdf") as again:
        np.testing.assert_array_equal(again["ensemble/prediction"], tree["ensemble/prediction"])
