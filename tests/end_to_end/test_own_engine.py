"""A command as the engine of a case, all the way: the built-in solver called as one says what it says inside."""

import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from commands import built_in, by_server, served
from reach import COARSE, ROOT, here, write_reach

import vegglue
from vegglue.case.schema import Case
from vegglue.results.ensemble import Ensemble
from vegglue.results.result_files import read_ensemble

PAGE = ROOT / "docs" / "own_engine.md"
SMALL = ("members: 1024", "members: 16")
WITH_ERROR = ("experiment: June}", "experiment: June, standard_error: 0.02}")
KNOWN = "members: 16, seed: 7}\ninfer: {sigma: known}"
# Draws of a posterior here, of the first round and worth: a run of a command is some hundredths of a second.
FIRST, WORTH = 256, 160


@dataclass(frozen=True)
class Pair:
    """The brook, by itself and with the built-in solver as its command, both with an ensemble in `runs`."""

    inside: Case
    command: Case
    runs: Path
    ensembles: tuple[Ensemble, Ensemble]


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Pair]:
    folder = tmp_path_factory.mktemp("pair")
    config = write_reach(folder, COARSE, SMALL, WITH_ERROR, ("members: 16, seed: 7}", KNOWN))
    inside, runs = vegglue.load_case(config), folder / "runs"
    with served(built_in(inside)) as port:
        command = by_server(config, port)
        ensembles = tuple(vegglue.simulate(case, runs=runs, jobs=2) for case in (inside, command))
        yield Pair(inside, command, runs, (ensembles[0], ensembles[1]))


@pytest.mark.slow
def test_the_ensemble_is_the_same(pair: Pair) -> None:
    inside, command = pair.ensembles
    np.testing.assert_array_equal(command.parameters["n_b"], inside.parameters["n_b"])
    np.testing.assert_allclose(command.prediction, inside.prediction, atol=3e-6)
    assert command.by_command
    assert not inside.by_command
    assert "16 run by the command, 0 failed" in repr(command)


@pytest.mark.slow
def test_weighed_members_give_the_same_posterior(pair: Pair) -> None:
    inside, command = (
        vegglue.infer(case, runs=pair.runs, method="glue").marginals for case in (pair.inside, pair.command)
    )
    for name, median in inside.median.items():
        assert command.median[name] == pytest.approx(median, rel=1e-4)


@pytest.mark.slow
def test_draws_give_the_same_posterior(pair: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vegglue.inference.refine.EFFECTIVE_DRAWS", WORTH)
    monkeypatch.setattr("vegglue.inference.importance_sampling.FIRST_DRAWS", FIRST)
    inside, command = (
        vegglue.infer(case, runs=pair.runs, jobs=2, method="refine") for case in (pair.inside, pair.command)
    )
    assert inside.refinement is not None
    assert command.refinement is not None
    np.testing.assert_array_equal(command.refinement.draws.drawn, inside.refinement.draws.drawn)
    # Searches end where less than NEGLIGIBLE_DECREASE is promised: 0.14 standard errors, and a few thousandths here.
    spread = {name: float(np.std(inside.sample.theta[name])) for name in inside.parameters}
    apart = command.refinement.modes.mode_theta - inside.refinement.modes.mode_theta
    assert np.abs(apart / np.array([*spread.values()])).max() < 0.01
    for name, median in inside.marginals.median.items():
        assert command.marginals.median[name] == pytest.approx(median, abs=0.01 * spread[name])
        np.testing.assert_allclose(np.std(command.sample.theta[name]), np.std(inside.sample.theta[name]), rtol=0.02)


@pytest.mark.slow
def test_the_page_is_true(pair: Pair, tmp_path: Path) -> None:
    """Its config and its script, in a few members; without --trust nothing runs."""
    write_reach(tmp_path, COARSE, SMALL, WITH_ERROR)
    pattern = r"^```yaml\n(# brook_by_command\.yaml\n.*?)^```"
    shown = re.search(pattern, PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert shown
    (tmp_path / "brook_by_command.yaml").write_text(shown[1], encoding="utf-8")
    shutil.copy(PAGE.parent / "examples" / "solver_as_command.py", tmp_path)
    refused = here(tmp_path, "check", "brook_by_command.yaml", succeed=False)
    assert refused.returncode == 2
    assert "which runs as code" in refused.stderr
    assert not (tmp_path / "runs").exists()
    checked = " ".join(here(tmp_path, "check", "brook_by_command.yaml", "--trust").stdout.split())
    assert re.search(r"The command of `engine` took [\d.]+ s at the medians of the priors: velocity 0\.\d+ to", checked)
    said = here(tmp_path, "simulate", "brook_by_command.yaml", "--trust", "--members", 2, "--jobs", 2).stdout
    assert "2 members, run by the command, 0 failed" in said
    found = read_ensemble(tmp_path / "runs" / "brook_by_command" / "ensemble.h5")
    inside = vegglue.simulate(pair.inside, runs=tmp_path / "inside", members=2, jobs=1)
    np.testing.assert_allclose(found.prediction, inside.prediction, atol=3e-6)


@pytest.mark.parametrize("script", sorted((PAGE.parent / "examples").glob("engine_*.py")), ids=lambda path: path.stem)
def test_scripts_for_other_codes_can_be_read_and_say_whether_they_were_run(script: Path) -> None:
    """No more is tested of them: the codes are not there."""
    text = script.read_text(encoding="utf-8")
    compile(text, script.name, "exec")
    assert ("4.1.0 was tried" if script.stem == "engine_anuga" else "it was never run") in text
    assert script.name in PAGE.read_text(encoding="utf-8")
