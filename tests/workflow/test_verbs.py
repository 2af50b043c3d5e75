"""`import vegglue`: the verbs on the nouns from Python, on the example of the README; fast to import."""

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from diagnoses import a_diagnosis
from reach import COARSE, ROOT, write_reach
from systems import NOT_SIMULATED

import vegglue
from vegglue.case.resolved_config import case_hash, simulation_hash
from vegglue.inference.statements import ReadingsExcluded, posterior_statements
from vegglue.measurements.kinds import Unused
from vegglue.measurements.observations import read_observations
from vegglue.progress import Progress
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.loop_results import comparison_that_fits, questions_that_fit
from vegglue.results.result_files import stored_hash, write_diagnosis
from vegglue.workflow.case_run import CaseRun
from vegglue.workflow.infer import is_inferred
from vegglue.workflow.report import results_of

MEMBERS = 16
HEAVY = ("numpy", "numba", "pandas", "scipy", "h5py", "matplotlib", "pydantic", "yaml", "typer", "joblib")
SMALL = ("members: 1024", f"members: {MEMBERS}")
WITH_ERROR = ("experiment: June}", "experiment: June, standard_error: 0.02}")


@NOT_SIMULATED
def test_nothing_heavy_is_imported_before_a_verb_is_used() -> None:
    program = f"import sys, vegglue; print(*(name for name in {HEAVY} if name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_every_name_is_there_and_the_same_for_editors() -> None:
    """What type checkers and editors see is what is got."""
    tree = ast.parse((ROOT / "vegglue" / "__init__.py").read_text(encoding="utf-8"))
    branch = next(node for node in tree.body if isinstance(node, ast.If))
    said = {
        alias.name: node.module for node in ast.walk(branch) if isinstance(node, ast.ImportFrom) for alias in node.names
    }
    assert set(said) == set(vegglue.__all__) - {"__version__"}
    for name, module in said.items():
        found = getattr(vegglue, name)
        assert found is getattr(sys.modules[str(module)], name)
        assert found.__doc__
    assert dir(vegglue) == vegglue.__all__
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        vegglue.simulat  # noqa: B018


def test_what_no_verb_can_do_is_said_in_its_words(tmp_path: Path) -> None:
    """An unknown method was weighed as `refine`; nothing to add was told as a config that extends itself."""
    case = vegglue.load_case(write_reach(tmp_path, COARSE, SMALL, WITH_ERROR))
    with pytest.raises(vegglue.InputError, match="--method: expected refine or surrogate or glue, got 'gleu'"):
        vegglue.infer(case, runs=tmp_path / "runs", method="gleu")  # type: ignore[arg-type]
    with pytest.raises(vegglue.InputError, match="--add: expected the name of an effect or more, got none"):
        vegglue.extend(case, [])
    with pytest.raises(vegglue.InputError, match="compare: expected one model or more, got none"):
        vegglue.compare([], runs=tmp_path / "runs")
    with pytest.raises(vegglue.InputError, match=r"expected a folder with site\.yaml, .*, got no such folder"):
        vegglue.import_folder(tmp_path / "nowhere")


@pytest.mark.slow
def test_the_brook_goes_through_all_verbs(tmp_path: Path) -> None:
    runs, heard = tmp_path / "runs", list[Progress]()
    case = vegglue.load_case(str(write_reach(tmp_path, COARSE, SMALL, WITH_ERROR)))
    assert vegglue.check(case, runs=runs).used_stations == 15

    ensemble = vegglue.simulate(case, runs=runs, jobs=1, watch=heard.append)
    assert str(heard[-1]) == f"solving brook: {MEMBERS} of {MEMBERS} members"
    assert ensemble.config_hash == simulation_hash(case)
    heard.clear()
    again = vegglue.simulate(case, runs=str(runs), jobs=1, watch=heard.append)
    assert heard == [], "what is there is not solved again"
    np.testing.assert_array_equal(again.prediction, ensemble.prediction)

    posterior = vegglue.infer(case, ensemble, runs=runs, jobs=1, method="glue")
    assert set(posterior.marginals.median) == {"n_b", "phi"}
    assert stored_hash(runs / "brook" / "posterior.h5") == case_hash(case)

    diagnosis = vegglue.diagnose(case, runs=runs, jobs=1, watch=heard.append)
    assert isinstance(diagnosis, Diagnosis)
    assert heard[0].phase == "calibrating the model as it is"
    child = vegglue.extend(case, ["streamlining"])
    assert child.source == tmp_path / "brook+streamlining.yaml"
    comparison = vegglue.compare([case, child], runs=runs)
    assert [score.name for score in comparison.model_scores] == ["brook", "brook-streamlining"]
    assert (runs / "brook-streamlining" / "ladder.png").exists()
    kept = [comparison_that_fits(runs / one.name, case_hash(one)) for one in (case, child)]
    assert kept[0] == kept[1], "both pages show the same ladder"
    assert kept[0] is not None
    assert [step.added for step in kept[0].steps] == [(), ("streamlining",)]
    questions = vegglue.next_measurement(case, runs=runs, jobs=1)
    for question in questions:
        assert question.tells_apart
        assert question.measurements[0].per_hour >= question.measurements[-1].per_hour
    asked = questions_that_fit(runs / "brook", case_hash(case))
    assert asked is not None
    assert [one.tells_apart for one in asked] == [one.tells_apart for one in questions]

    page = vegglue.report(case, runs=runs)
    assert diagnosis.verdict.sentence.split(" (")[0] in page.read_text(encoding="utf-8"), "the page tells the diagnosis"


@pytest.mark.slow
def test_another_size_of_the_ensemble_goes_through(tmp_path: Path) -> None:
    case = vegglue.load_case(write_reach(tmp_path, COARSE, SMALL))
    runs = tmp_path / "runs"
    ensemble = vegglue.simulate(case, runs=runs, members=8, jobs=1)
    assert len(ensemble.status) == 8
    with pytest.raises(vegglue.InputError, match=r"holds 8 members, .* are asked for; add --members 8, or"):
        vegglue.infer(case, runs=runs, method="glue")
    vegglue.infer(case, ensemble, runs=runs, method="glue")
    assert vegglue.report(case, runs=runs).exists(), "a page is of the members that are there"
    assert vegglue.report(case, runs=runs, members=8).exists()
    with pytest.raises(vegglue.InputError, match=r"run `vegglue simulate .*brook\.yaml --runs .*runs`"):
        vegglue.report(case, runs=runs, members=9)


@pytest.mark.slow
def test_draws_and_their_page_need_no_ensemble(tmp_path: Path) -> None:
    case = vegglue.load_case(write_reach(tmp_path, COARSE, SMALL, WITH_ERROR))
    runs = tmp_path / "runs"
    with pytest.raises(vegglue.InputError, match=r"`vegglue simulate .*brook\.yaml --runs .*runs`"):
        vegglue.infer(case, runs=runs, method="glue")
    posterior = vegglue.infer(case, runs=runs, jobs=2)
    assert posterior.weighting.effective_size >= 1000
    page = vegglue.report(case, runs=runs).read_text(encoding="utf-8")
    assert f"{posterior.sample.members:,} draws" in page
    assert "mass error" not in page
    assert vegglue.overview([case], runs=runs).exists()
    assert not (runs / "brook" / "ensemble.h5").exists()
    shown = list[object]()
    vegglue.run(case, runs=runs, jobs=2, show=lambda _, result: shown.append(result))
    assert not list(runs.rglob("ensemble.h5"))


def test_an_ensemble_of_another_case_is_refused(tmp_path: Path) -> None:
    case = vegglue.load_case(write_reach(tmp_path, COARSE, SMALL))
    ensemble = vegglue.simulate(case, runs=tmp_path / "runs", jobs=1)
    other = vegglue.load_case(write_reach(tmp_path, COARSE, SMALL, ("level: 0.95", "level: 0.96")))
    with pytest.raises(vegglue.InputError, match="brook: expected its own ensemble"):
        vegglue.infer(other, ensemble, runs=tmp_path / "runs")


@pytest.mark.slow
def test_a_posterior_leaves_out_what_the_diagnosis_set_aside(tmp_path: Path) -> None:
    """It held twelve readings of a probe that the verdict on open-j had called off."""
    runs = tmp_path / "runs"
    case = vegglue.load_case(str(write_reach(tmp_path, COARSE, SMALL, WITH_ERROR)))
    table = read_observations(case).table
    run, ensemble = CaseRun(case, runs), vegglue.simulate(case, runs=runs, jobs=1)
    before = vegglue.infer(case, ensemble, method="glue", runs=runs, jobs=1)
    assert before.fit.used == 15
    assert is_inferred(CaseRun(case, runs))
    nothing = np.full(len(table), np.nan)
    predictions = {"station": table, "first": nothing, "last": nothing, "error": nothing}
    found = a_diagnosis(predictions=predictions, errors={"flagged": (3, 7)})
    write_diagnosis(runs / "brook" / "diagnosis.h5", found, "", case_hash(case))
    assert not is_inferred(CaseRun(case, runs)), "it still holds them"
    assert results_of(run, run).excluded_since == 2
    after = vegglue.infer(case, ensemble, method="glue", runs=runs, jobs=1)
    assert after.fit.used == 13
    assert after.station.index[after.station["reason"] == Unused.EXCLUDED].tolist() == [3, 7]
    assert ReadingsExcluded(2, 15) in posterior_statements(after)
    assert is_inferred(CaseRun(case, runs))
    assert results_of(run, run).excluded_since == 0
