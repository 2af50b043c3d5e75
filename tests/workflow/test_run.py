"""The loop through the command line: a hidden effect gets a name, and the whole way is gone once."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from diagnoses import a_diagnosis, candidate_laws_of
from kills import WITH_ERRORS
from reach import COARSE, here, write_reach

from vegglue.case.config import load_case
from vegglue.results.causes import CandidateLaws
from vegglue.workflow import case_run
from vegglue.workflow import run as whole_way
from vegglue.workflow.case_run import CaseRun

ROOT = Path(__file__).parents[2]
TWIN = load_case(ROOT / "configs" / "twin.yaml")
WITH_LAW = TWIN.model_copy(update={"name": "twin-law", "source": TWIN.source.with_name("twin+law.yaml")})


@pytest.fixture(scope="module")
def went(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A folder after `vegglue run` on a channel in which something is hidden, and what it said; no test changes it."""
    folder, config = tmp_path_factory.mktemp("went"), ROOT / "configs" / "twin.yaml"
    here(folder, "twin", config, "--hide", "discharge_error[high]", "--snr", "10", "--seed", "3", "--to", "hidden")
    told = "extends: hidden.yaml\nname: small\nsimulate: {members: 16}\ninfer: {method: glue}\n"
    (folder / "hidden" / "small.yaml").write_text(told, encoding="utf-8")
    return folder, here(folder, "run", "hidden/small.yaml").stdout


@pytest.mark.slow
def test_a_hidden_effect_is_named_added_and_the_error_falls(went: tuple[Path, str], tmp_path: Path) -> None:
    """The diagnosis that `run` has left is read; child and comparison are made anew, as by a user who goes on alone."""
    folder = shutil.copytree(went[0], tmp_path, dirs_exist_ok=True)  # as deep: configs name each other
    child = next((folder / "hidden").glob("small+*.yaml"))
    child.unlink()
    said = json.loads(here(folder, "diagnose", "hidden/small.yaml", "--json").stdout)
    assert said["verdict"] in ("identified", "one-of")
    assert "discharge_error[high]" in said["set"]
    accused = next(one for one in said["effects"] if one["name"] == "discharge_error[high]")
    assert accused["p_family"] < 0.01
    here(folder, "extend", "hidden/small.yaml", "--auto")
    model_scores = json.loads(here(folder, "compare", "hidden/small.yaml", child, "--json").stdout)["rungs"]
    assert model_scores[1]["held_out_sections"] < model_scores[0]["held_out_sections"]
    assert model_scores[1]["chi2"] < 0.8 * model_scores[0]["chi2"]
    by_hand = f"extends: small.yaml\nname: {child.stem.replace('+', '-')}-mine\n"
    child.write_text(by_hand, encoding="utf-8")
    again = here(folder, "extend", "hidden/small.yaml", "--auto", succeed=False)
    assert (again.returncode, len(again.stderr.splitlines())) == (2, 1)
    assert "--force" in again.stderr
    assert child.read_text(encoding="utf-8") == by_hand, "what was written by hand is not replaced"


@pytest.mark.slow
def test_one_command_goes_the_whole_way_and_is_not_repeated(went: tuple[Path, str], tmp_path: Path) -> None:
    folder = shutil.copytree(went[0], tmp_path, dirs_exist_ok=True)  # as deep: configs name each other
    assert "discharge_error[high]" in went[1], "names in brackets are no markup"
    child = "small-discharge_error_high"
    made = {path.name for path in (folder / "runs" / child).iterdir()}
    assert made >= {"ensemble.h5", "posterior.h5", "report.html"}
    assert not (folder / "runs" / "small" / "posterior.h5").exists(), "that model is known to be wrong"
    parent = here(folder, "report", "hidden/small.yaml", succeed=False).stderr
    assert f"the run went on to {child}, whose report is runs/{child}/report.html" in parent
    here(folder, "overview", "hidden/small.yaml")
    assert f"{child}/report.html" in (folder / "runs" / "overview.html").read_text(encoding="utf-8")
    assert (folder / "runs" / child / "ladder.png").exists()
    before = {path: path.stat().st_mtime_ns for path in (folder / "runs").rglob("*.h5")}
    again = here(folder, "run", "hidden/small.yaml").stdout
    assert "up to date" in again
    assert before == {path: path.stat().st_mtime_ns for path in (folder / "runs").rglob("*.h5")}


def gone(
    kind: str,
    places: int,
    error_with_law: float,
    patched: pytest.MonkeyPatch,
    folder: Path,
    laws: CandidateLaws | None = None,
) -> tuple[list[str], list[str]]:
    """Cases whose ensembles `run` makes, and the kinds of results it shows, where nothing is solved."""
    found = a_diagnosis(verdict={"kind": kind, "laws": laws})
    found = replace(found, places=found.places[:1] * places, laws=laws)
    model_scores = {TWIN.name: 0.02, WITH_LAW.name: error_with_law}
    alone = SimpleNamespace(model_scores=(TWIN.name,), left_out=None)
    made, shown, kept = list[str](), list[str](), list[str]()

    def make_posterior(run: CaseRun, *_: Any) -> bool:
        made.append(run.case.name)
        return False

    fakes: dict[str, Any] = {
        "refuse_to_shrink": lambda *_: None,
        "diagnose": lambda *_: found,
        "extend_stepwise": lambda *_: SimpleNamespace(cases=(TWIN,), comparison=alone),
        "discover": lambda *_: SimpleNamespace(child=WITH_LAW, law=True),
        "model_score_of": lambda run, *_: run.case.name,
        "comparison_of": lambda *_: None,
        "keep_comparison": lambda _, several: kept.append(several[-1].case.name),
        "held_out_rmse": lambda model_score: model_scores[model_score],
        "next_measurement": lambda *_: [],
        "draw_ladder_of": lambda *_: None,
        "make_posterior": make_posterior,
    }
    for name, fake in fakes.items():
        patched.setattr(whole_way, name, fake)
    whole_way.run(TWIN, runs=folder, show=lambda _, result: shown.append("law" if hasattr(result, "law") else ""))
    assert kept == [name for name in made if name == WITH_LAW.name], (
        "the ladder of a law that is not kept is not, either"
    )
    return made, [one for one in shown if one]


@pytest.mark.parametrize(
    ("kind", "places", "laws"), [("none-of-these", 0, False), ("none-of-these", 1, True), ("cannot-tell", 0, True)]
)
def test_a_law_is_searched_where_it_stands_out_or_no_effect_explains_what_acts_all_over(
    kind: str, places: int, laws: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    known = candidate_laws_of("law_bank_speed_step") if laws else None
    assert gone(kind, places, 0.01, monkeypatch, tmp_path, known) == (["twin-law"], ["law"])


def test_a_law_that_does_not_lower_errors_is_told_and_not_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert gone("none-of-these", 0, 0.03, monkeypatch, tmp_path) == (["twin"], ["law"])
    nothing_held_out = float("nan")
    assert gone("none-of-these", 0, nothing_held_out, monkeypatch, tmp_path) == (["twin"], ["law"])


@pytest.mark.parametrize(("kind", "places"), [("none-of-these", 1), ("nothing-missing", 0), ("cannot-tell", 0)])
def test_no_law_is_searched_for_a_place_or_in_silence(
    kind: str, places: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert gone(kind, places, 0.01, monkeypatch, tmp_path) == (["twin"], [])


@pytest.mark.slow
def test_measurements_are_read_once_and_the_site_is_built_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the case and of all its children; sites of coarser cells are others."""
    case = load_case(write_reach(tmp_path, COARSE, WITH_ERRORS))
    counted = {"read": 0, "built": 0}

    def counting(name: str, real: Any) -> Any:
        def called(*arguments: Any) -> Any:
            counted[name] += 1
            return real(*arguments)

        return called

    monkeypatch.setattr(case_run, "read_observations", counting("read", case_run.read_observations))
    monkeypatch.setattr(case_run, "build_site", counting("built", case_run.build_site))
    whole_way.run(case, runs=tmp_path / "runs", members=8, jobs=1)
    assert counted == {"read": 1, "built": 1}
