"""Cases and members in the files of PEST++ and SPOTPY, read back by pyemu and spotpy where these are installed."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from reach import COARSE, Say, here, write_reach

import vegglue
from vegglue.case.config import load_case
from vegglue.case.parameter_space import sample_of, sobol_sample
from vegglue.case.schema import Case
from vegglue.errors import InputError
from vegglue.results.calibration_files import (
    LONGEST_OBSERVATION,
    LONGEST_PARAMETER,
    observation_names,
    pest_names,
    read_parameters,
)
from vegglue.results.result_files import read_ensemble

# pyemu leaves files open; both libraries warn of what numpy and pandas are about to change.
OF_OTHERS = pytest.mark.filterwarnings("ignore")
# Numbers are read by pandas, whose last digit may be another one.
LAST_DIGIT = 1e-14
MEMBERS = 16
WITH_ERROR = ("experiment: June}", "experiment: June, standard_error: 0.02}")
SMALL = ("members: 1024", f"members: {MEMBERS}")


@dataclass(frozen=True)
class Written:
    """A brook whose ensemble and posterior were exported; pest, spotpy: folders of the files."""

    case: Case
    runs: Path
    pest: Path
    spotpy: Path


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Written:
    folder = tmp_path_factory.mktemp("programs")
    case, runs = load_case(write_reach(folder, COARSE, SMALL, WITH_ERROR)), folder / "runs"
    vegglue.infer(case, vegglue.simulate(case, runs=runs, jobs=1), runs=runs, method="glue")
    for program in ("pest", "spotpy"):
        vegglue.export(case, runs=runs, to=program)
    return Written(case, runs, runs / "brook/export/pest", runs / "brook/export/spotpy")


def test_names_are_short_lower_and_each_another_one() -> None:
    long = ["secondary_current_strength", "secondary_current_span", "Phi", "phi", "n b", "φ", "discharge_error[low]"]
    names = pest_names(long)
    assert list(names) == long
    assert len(set(names.values())) == len(long)
    assert all(one == one.lower() and len(one) <= LONGEST_PARAMETER and one.isascii() for one in names.values())


def test_names_of_observations_keep_their_order_when_sorted() -> None:
    station = pd.DataFrame({"experiment": ["High water in June", "low"] * 600, "section": ["Zufluß 3", "a"] * 600})
    names = observation_names(station)
    assert names == sorted(names)
    assert len(set(names)) == len(names)
    assert all(len(one) <= LONGEST_OBSERVATION and one == one.lower() and one.isascii() for one in names)


@pytest.mark.slow
@OF_OTHERS
def test_pyemu_reads_the_same_names_values_and_weights(written: Written) -> None:
    pyemu = pytest.importorskip("pyemu")
    control = pyemu.Pst(str(written.pest / "brook.pst"))
    station = pd.read_csv(written.runs.parent / "velocities.csv")
    observed = control.observation_data
    assert control.obs_names == sorted(control.obs_names)
    assert np.array_equal(observed["obsval"], station["u"])
    assert np.array_equal(observed["weight"], np.full(len(station), 1 / 0.02))
    assert set(observed["obgnme"]) == {"velocity"}
    parameters = control.parameter_data
    assert list(parameters.index) == list(pest_names(written.case.parameters).values())
    for name, prior in written.case.parameters.items():
        row = parameters.loc[name]
        assert (row["parlbnd"], row["parubnd"]) == (prior.low, prior.high)
        assert row["partrans"] == ("log" if prior.distribution == "loguniform" else "none")
    covariance = pyemu.Cov.from_uncfile(str(written.pest / "brook.unc"), pst=control)
    assert set(covariance.row_names) == set(parameters.index)


@pytest.mark.slow
@OF_OTHERS
def test_pyemu_reads_the_ensembles(written: Written) -> None:
    pyemu = pytest.importorskip("pyemu")
    control = pyemu.Pst(str(written.pest / "brook.pst"))
    ensemble = read_ensemble(written.runs / "brook/ensemble.h5")
    members = pyemu.ParameterEnsemble.from_csv(control, str(written.pest / "prior.csv"))
    for name, values in ensemble.parameters.items():
        assert np.allclose(members.loc[:, name], values, rtol=LAST_DIGIT)
    predicted = pyemu.ObservationEnsemble.from_csv(control, str(written.pest / "prior_obs.csv"))
    assert np.allclose(predicted.loc[:, control.obs_names].to_numpy(), ensemble.prediction, rtol=LAST_DIGIT)
    draws = pd.read_csv(written.pest / "posterior.csv", index_col=0)
    assert len(draws) == len(pd.read_csv(written.pest / "posterior_obs.csv", index_col=0)) == 2000


@pytest.mark.slow
@OF_OTHERS
@pytest.mark.parametrize("draw", ["uniform", "gaussian"])
def test_draws_of_pyemu_run_as_an_ensemble(written: Written, draw: str) -> None:
    pyemu = pytest.importorskip("pyemu")
    control = pyemu.Pst(str(written.pest / "brook.pst"))
    if draw == "uniform":
        draws = pyemu.ParameterEnsemble.from_uniform_draw(control, num_reals=5)
    else:
        prior = pyemu.Cov.from_uncfile(str(written.pest / "brook.unc"), pst=control)
        draws = pyemu.ParameterEnsemble.from_gaussian_draw(control, cov=prior, num_reals=5)
    draws.enforce()
    file = written.runs.parent / "draws.csv"
    draws.to_csv(file)
    ensemble = vegglue.simulate(written.case, runs=written.runs, jobs=1, parameters=file)
    assert ensemble.prediction.shape == (5, len(control.obs_names))
    assert np.isfinite(ensemble.prediction).all()
    for name, short in pest_names(written.case.parameters).items():
        assert np.allclose(ensemble.parameters[name], draws.loc[:, short], rtol=LAST_DIGIT)
    back = pyemu.ObservationEnsemble.from_csv(control, str(written.runs / "brook/given/draws/predictions.csv"))
    assert np.allclose(back.loc[:, control.obs_names].to_numpy(), ensemble.prediction, rtol=LAST_DIGIT)


@pytest.mark.slow
@OF_OTHERS
def test_the_model_command_turns_parameters_into_what_the_instructions_read(
    written: Written, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The middle of the priors, through template, command and instructions, as PEST++ would run it."""
    pyemu = pytest.importorskip("pyemu")
    monkeypatch.chdir(written.pest)
    control = pyemu.Pst("brook.pst")
    control.write_input_files(".")
    program, *words = control.model_command[0].replace('"', "").split()
    assert program == "vegglue"
    here(written.pest, *words)
    read = pyemu.pst_utils.InstructionFile("predictions.ins", pst=control).read_output_file(control.output_files[0])
    middle = {name: np.array([control.parameter_data.loc[name, "parval1"]]) for name in written.case.parameters}
    table = pd.read_csv(control.output_files[0], index_col=0)
    assert np.allclose(read.loc[control.obs_names, "obsval"], table.loc[0, control.obs_names], rtol=LAST_DIGIT)
    assert np.allclose(sample_of(written.case, middle).points, 0.5)


@pytest.mark.slow
@OF_OTHERS
def test_spotpy_reads_its_database(written: Written, monkeypatch: pytest.MonkeyPatch) -> None:
    analyser = pytest.importorskip("spotpy.analyser")
    monkeypatch.chdir(written.spotpy)
    found = analyser.load_csv_results("ensemble")
    ensemble = read_ensemble(written.runs / "brook/ensemble.h5")
    assert list(analyser.get_parameternames(found)) == list(written.case.parameters)
    assert np.allclose(found["parphi"], ensemble.parameters["phi"], rtol=1e-6)
    simulated = np.array([list(row) for row in found[list(analyser.get_simulation_fields(found))]])
    assert np.allclose(simulated, ensemble.prediction, rtol=1e-6)
    value = pd.read_csv("evaluation.csv")["value"].to_numpy()
    best = np.argmax(found["like1"])
    assert best == np.argmin(((ensemble.prediction - value) ** 2).sum(axis=1))
    assert set(analyser.load_csv_results("posterior")["chain"]) == {1.0, 2.0, 3.0, 4.0}


def parameters_file(folder: Path, *rows: str) -> Path:
    path = folder / "given.csv"
    path.write_text("\n".join(rows), encoding="utf-8")
    return path


def test_columns_may_stand_in_any_order_and_be_upper_case(tmp_path: Path) -> None:
    case = load_case(write_reach(tmp_path))
    found = read_parameters(parameters_file(tmp_path, "real_name,PHI,N_B", "base,4.5,0.03", "0,5,0.05"), case)
    assert {name: values.tolist() for name, values in found.items()} == {"n_b": [0.03, 0.05], "phi": [4.5, 5.0]}


@pytest.mark.parametrize(
    ("rows", "place"),
    [
        (("n_b",), "row 1"),
        (("n_b,phi,phi", "0.03,1,1"), "row 1"),
        (("n_b,phi,width,depth", "0.03,1,1,1"), "row 1"),
        (("n_b,phi",), "given.csv"),
        (("n_b,phi", "0.03,"), "row 2"),
        (("n_b,phi", "0.03,2", "0.03"), "row 3"),
        (("n_b,phi", "0.03,2", "nan,2"), "row 3"),
        (("n_b,phi", "0.03,-2"), "row 2"),
        (("n_b,phi", "9" * 200_000), "given.csv"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_row(tmp_path: Path, rows: tuple[str, ...], place: str) -> None:
    case = load_case(write_reach(tmp_path))
    with pytest.raises(InputError, match=place):
        read_parameters(parameters_file(tmp_path, *rows), case)


def test_without_members_only_a_control_file_is_written(tmp_path: Path) -> None:
    case = load_case(write_reach(tmp_path))
    files = vegglue.export(case, runs=tmp_path / "runs", to="pest").files
    assert {path.name for path in files} >= {"brook.pst", "prior.csv", "names.csv", "parameters.tpl", "predictions.ins"}
    with (files[0].parent / "prior.csv").open(encoding="utf-8", newline="") as file:
        heading, *rows = list(csv.reader(file))
    drawn = sobol_sample(case).theta
    assert [float(row[heading.index("phi")]) for row in rows] == drawn["phi"].tolist()
    with pytest.raises(InputError, match="simulate"):
        vegglue.export(case, runs=tmp_path / "runs", to="spotpy")


@pytest.mark.parametrize(
    "words", [("export", "--only", "csv", "--to", "pest"), ("simulate", "--members", 8, "--parameters", "given.csv")]
)
def test_options_that_exclude_each_other_are_refused(tmp_path: Path, say: Say, words: tuple[object, ...]) -> None:
    verb, *options = words
    assert say(verb, write_reach(tmp_path), *options)[0] == 2
