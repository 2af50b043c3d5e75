"""Posteriors on disk: they come back as they went, and xarray and ArviZ read them."""

from dataclasses import is_dataclass
from pathlib import Path
from typing import get_type_hints

import h5py
import pytest
from posteriors import a_posterior, assert_same, changed
from stored import HASH, no_space

from vegglue.errors import InputError, StorageError
from vegglue.results.layout import stored_fields
from vegglue.results.posterior import CorrectedCanopy, Posterior, Refinement, Transfer
from vegglue.results.result_files import read_posterior, stored_hash, write_posterior


@pytest.mark.parametrize("canopy", [True, False])
def test_posterior_comes_back_as_it_went(tmp_path: Path, canopy: bool) -> None:
    posterior = a_posterior(canopy)
    write_posterior(tmp_path / "posterior.h5", posterior, "name: d0\n", HASH)
    assert_same(read_posterior(tmp_path / "posterior.h5", HASH), posterior)
    with pytest.raises(InputError, match="run `vegglue infer CONFIG` again"):
        read_posterior(tmp_path / "posterior.h5", "e" * 64)


def names_in(kind: type) -> list[str]:
    """Names under which a value of this kind lies in its file."""
    hints = {name: hint for name, hint in get_type_hints(kind).items() if isinstance(hint, type)}
    plain = [name for name, hint in hints.items() if hint in (str, int, float)]
    inner = [name for hint in hints.values() if is_dataclass(hint) for name in names_in(hint)]
    return [*plain, *stored_fields(kind), *inner]


@pytest.mark.parametrize("kind", [Posterior, CorrectedCanopy, Refinement, Transfer])
def test_no_two_fields_of_a_part_have_the_same_name_in_the_file(kind: type) -> None:
    names = names_in(kind)
    assert sorted(names) == sorted(set(names))
    assert names


def test_nested_fields_lie_flat_in_the_file(tmp_path: Path) -> None:
    write_posterior(tmp_path / "posterior.h5", a_posterior(True), "", HASH)
    with h5py.File(tmp_path / "posterior.h5") as file:
        members, canopy, stated = set(file["members"]), set(file["canopy"]), set(file.attrs)
    assert members == {
        "parameter", "member", "station", "level", "log_parameter", "other_parameter", "side", "kind", "chain", "draw",
        "unit", "theta", "weights", "efficiency", "log_likelihood", "prediction", "median", "sd", "quantiles",
        "prior_quantiles", "log10_median", "log10_sd", "correlation", "width_ratio", "identified", "bounds",
        "bound_mass", "bound_hit", "sigma", "rmse", "best_rmse", "noise", "residual", "model_band",
        "total_band", "draws", "predictive",
    }  # fmt: skip
    assert canopy == {"member", "level", "phi", "quantiles"}
    assert stated == {
        "method", "likelihood", "sigma_rule", "threshold", "members", "failed", "weighed", "used", "best",
        "effective_size", "largest_weight", "pareto_k", "chi2", "ensemble_hash", "seed", "version", "canopy_parameter",
        "canopy_from_height", "canopy_to_height", "canopy_depth", "canopy_median", "canopy_sd", "canopy_log10_median",
        "canopy_log10_sd", "config", "config_hash", "format",
    }  # fmt: skip


def test_posterior_without_logarithmic_parameters_comes_back(tmp_path: Path) -> None:
    posterior = changed(a_posterior(False), log10_median={}, log10_sd={})
    write_posterior(tmp_path / "posterior.h5", posterior, "", HASH)
    assert_same(read_posterior(tmp_path / "posterior.h5"), posterior)


def test_failed_write_leaves_the_older_posterior(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "posterior.h5"
    write_posterior(path, a_posterior(False), "", HASH)

    with monkeypatch.context() as patch:
        patch.setattr("vegglue.whole_files.os.fsync", no_space)
        with pytest.raises(StorageError, match="the disk is full"):
            write_posterior(path, a_posterior(True), "", "e" * 64)
    assert stored_hash(path) == HASH
    assert list(tmp_path.iterdir()) == [path]


def test_xarray_opens_every_group_of_a_posterior(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    write_posterior(tmp_path / "posterior.h5", a_posterior(True), "", HASH)
    with h5py.File(tmp_path / "posterior.h5") as file:
        names = set(file)
    assert names == {"posterior", "prior", "log_likelihood", "posterior_predictive", "observed_data", "constant_data",
                     "sample_stats", "members", "stations", "canopy"}  # fmt: skip
    for name in names:
        with xarray.open_dataset(tmp_path / "posterior.h5", group=name, engine="h5netcdf") as data:
            data.load()
            assert not any(variable.startswith("phony") for variable in data.sizes)


@pytest.mark.slow  # arviz takes a second to import
def test_arviz_summarises_and_plots_a_posterior(tmp_path: Path) -> None:
    arviz, matplotlib = pytest.importorskip("arviz"), pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    posterior = a_posterior(True)
    write_posterior(tmp_path / "posterior.h5", posterior, "", HASH)
    data = arviz.from_netcdf(tmp_path / "posterior.h5", engine="h5netcdf")
    summary = arviz.summary(data, kind="stats", round_to="none")
    assert list(summary.index) == ["n_b", "phi"]
    assert summary.loc["phi", "mean"] == pytest.approx(posterior.sample.theta["phi"][posterior.predicted.draws].mean())
    assert data.posterior["phi"].dims == ("chain", "draw")
    assert data.log_likelihood["measured"].shape == (4, 500, 1)  # used stations only
    assert data.observed_data["measured"].values.tolist() == [0.4]
    assert arviz.plot_pair(data) is not None
    matplotlib.pyplot.close("all")
