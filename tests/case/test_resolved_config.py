"""The resolved config reads as the same case, and its hashes follow what decides a result."""

import os
from pathlib import Path

import pytest
import yaml
from small_case import SMALL, changed, write

from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash, resolved_yaml, simulation_hash

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_the_resolved_case_reads_as_the_same_case():
    case = load_case(CONFIGS / "d3b_paper.yaml")
    folder = Path(os.path.relpath(CONFIGS))
    resolved = resolved_yaml(case)
    assert "extends" not in resolved
    assert str(Path.home()) not in resolved
    tree = yaml.safe_load(resolved)
    for part in (*tree["observations"], tree["survey"]):
        part["file"] = str(folder / part["file"])
    again = load_case(write(yaml.safe_dump(tree, sort_keys=False), "resolved.yaml"))
    assert case_hash(again) == case_hash(case)


def test_the_hash_follows_contents_and_not_places():
    text = SMALL.replace("name: small", "name: small\nobservations: [{kind: level, file: levels.csv}]")
    for folder in ("one", "two"):
        write("experiment,x,y,level\nlow,1,0,0.9\n", f"{folder}/levels.csv")
    one, two = (load_case(write(text, f"{folder}/small.yaml")) for folder in ("one", "two"))
    assert case_hash(one) == case_hash(two)
    before = case_hash(one)
    write("experiment,x,y,level\nlow,1,0,0.8\n", "one/levels.csv")
    assert case_hash(one) != before


def test_results_of_other_equations_do_not_fit(monkeypatch):
    case = load_case(write(SMALL))
    before = case_hash(case), simulation_hash(case)
    monkeypatch.setattr("vegglue.case.resolved_config.EQUATIONS", 1)
    assert case_hash(case) != before[0]
    assert simulation_hash(case) != before[1]


def test_an_ensemble_outlives_another_likelihood_but_not_another_prior():
    case = load_case(write(SMALL))
    other = load_case(changed("name: small", "name: small\ninfer: {likelihood: nse, behavioural: 0.5}"))
    assert simulation_hash(other) == simulation_hash(case)
    assert case_hash(other) != case_hash(case)
    assert simulation_hash(load_case(changed("high: 0.15", "high: 0.16"))) != simulation_hash(case)
    # The order of the parameters decides which member gets which value.
    first = "  n_b: {distribution: uniform, low: 0.01, high: 0.15, unit: s m^(-1/3)}\n"
    swapped = write(SMALL.replace(first, "") + first)
    assert simulation_hash(load_case(swapped)) != simulation_hash(case)


def test_results_outlive_another_title():
    case = load_case(write(SMALL))
    named = load_case(changed("name: small", "name: small\ntitle: A small brook"))
    assert case_hash(named) == case_hash(case)
    assert "A small brook" in resolved_yaml(named)


def test_an_ensemble_outlives_what_is_said_of_the_record():
    write("experiment,x,y,level\nlow,1,0,0.9\n", "levels.csv")
    text = SMALL + "observations:\n  - {kind: level, file: levels.csv}\n"
    case = load_case(write(text))
    computed = load_case(write(text.replace("levels.csv}", "levels.csv, synthetic: true}")))
    assert [one.synthetic for one in (*case.observations, *computed.observations)] == [False, True]
    assert simulation_hash(computed) == simulation_hash(case)
    assert case_hash(computed) != case_hash(case)
