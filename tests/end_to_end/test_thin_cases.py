"""Cases that hold as little as a case can: what they lack is told in a sentence, and what they hold is used."""

import re
from pathlib import Path

import pytest
from diagnoses import IMPLAUSIBLE
from reach import COARSE, Say, block, write_reach

from vegglue.cli.main import main
from vegglue.errors import InputError
from vegglue.wording.sentences import sentence


def thin(folder: Path, lines: int) -> Path:
    """The coarse brook with its first measurements only."""
    config = write_reach(folder, COARSE)
    table = folder / "velocities.csv"
    table.write_text("".join(block("csv").splitlines(keepends=True)[: lines + 1]), encoding="utf-8")
    return config


def without_parameters(folder: Path) -> Path:
    """The coarse brook with numbers in place of its priors."""
    config = write_reach(folder, COARSE)
    text = re.sub(r"^(parameters:|  (n_b|phi): {distribution).*\n", "", config.read_text("utf-8"), flags=re.MULTILINE)
    config.write_text(text.replace("n: n_b", "n: 0.05").replace("phi: phi", "phi: 8"), encoding="utf-8")
    return config


@pytest.mark.parametrize("command", ["diagnose", "next", "discover", "run", "simulate", "infer", "export"])
def test_nothing_to_calibrate_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say, command: str) -> None:
    config = without_parameters(tmp_path)
    monkeypatch.chdir(tmp_path)
    options = () if command == "export" else ("--jobs", 1)
    code, told = say(command, config, *options)
    assert (code, "`parameters` expected a prior or more, got none" in told) == (2, True), told


def test_check_remarks_that_there_is_nothing_to_calibrate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    config = without_parameters(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["vegglue", "check", str(config)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code
    assert "There are no `parameters`" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("lines", [1, 5])
def test_one_reading_and_one_section_are_diagnosed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say, lines: int
) -> None:
    config = thin(tmp_path, lines)
    monkeypatch.chdir(tmp_path)
    text = config.read_text(encoding="utf-8").replace("experiment: June}", "experiment: June, standard_error: 0.01}")
    config.write_text(text, encoding="utf-8")
    for command in ("diagnose", "next"):
        code, told = say(command, config, "--jobs", 1)
        assert code == 0, told
        assert "Traceback" not in told


@pytest.mark.slow
def test_velocities_no_flow_comes_near_are_told_before_priors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say
) -> None:
    """Where no flow is found at all, wrong units are the reason and not the priors."""
    config = thin(tmp_path, 10)
    monkeypatch.chdir(tmp_path)

    def none_found(_: object) -> None:
        raise InputError("brook: the model finds no steady flow at its best point; widen the priors.")

    monkeypatch.setattr("vegglue.diagnosis.diagnose.kept_baseline", none_found)
    code, told = say("diagnose", config, "--jobs", 1)
    assert (code, "widen the priors" in told) == (2, True), told
    monkeypatch.setattr("vegglue.diagnosis.diagnose.implausible_values", lambda *_: [IMPLAUSIBLE])
    code, told = say("diagnose", config, "--jobs", 1)
    assert code == 2
    assert sentence(IMPLAUSIBLE) in told
