"""The loop through the command line: a hidden effect gets a name, and the whole way is gone once."""

import json
from pathlib import Path

import pytest
from reach import vegglue

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_a_hidden_effect_is_named_added_and_the_error_falls(tmp_path: Path) -> None:
    config = ROOT / "configs" / "twin.yaml"
    vegglue(tmp_path, "twin", config, "--hide", "discharge_error[high]", "--snr", "10", "--seed", "3", "--to", "hidden")
    said = json.loads(vegglue(tmp_path, "diagnose", "hidden/hidden.yaml", "--json").stdout)
    assert said["verdict"] in ("identified", "one-of")
    assert "discharge_error[high]" in said["set"]
    accused = next(one for one in said["effects"] if one["name"] == "discharge_error[high]")
    assert accused["p_family"] < 0.01
    vegglue(tmp_path, "extend", "hidden/hidden.yaml", "--auto")
    child = next((tmp_path / "hidden").glob("hidden+*.yaml"))
    rungs = json.loads(vegglue(tmp_path, "compare", "hidden/hidden.yaml", child, "--json").stdout)["rungs"]
    assert rungs[1]["held_out_sections"] < rungs[0]["held_out_sections"]
    assert rungs[1]["chi2"] < 0.8 * rungs[0]["chi2"]
    by_hand = f"extends: hidden.yaml\nname: {child.stem.replace('+', '-')}-mine\n"
    child.write_text(by_hand, encoding="utf-8")
    again = vegglue(tmp_path, "extend", "hidden/hidden.yaml", "--auto", succeed=False)
    assert (again.returncode, len(again.stderr.splitlines())) == (2, 1)
    assert "--force" in again.stderr
    assert child.read_text(encoding="utf-8") == by_hand, "what was written by hand is not replaced"


@pytest.mark.slow
def test_one_command_goes_the_whole_way_and_is_not_repeated(tmp_path: Path) -> None:
    config = ROOT / "configs" / "twin.yaml"
    vegglue(tmp_path, "twin", config, "--hide", "discharge_error[high]", "--snr", "10", "--seed", "3", "--to", "hidden")
    small = tmp_path / "hidden" / "small.yaml"
    told = "extends: hidden.yaml\nname: small\nsimulate: {members: 16}\ninfer: {method: glue}\n"
    small.write_text(told, encoding="utf-8")
    said = vegglue(tmp_path, "run", "hidden/small.yaml").stdout
    assert "discharge_error[high] of -0.0" in said, "names in brackets are no markup"
    child = "small-discharge_error_high"
    for folder in ("small", child):
        made = {path.name for path in (tmp_path / "runs" / folder).iterdir()}
        assert made >= {"ensemble.h5", "posterior.h5", "report.html"}
    assert (tmp_path / "runs" / child / "ladder.png").exists()
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").rglob("*.h5")}
    again = vegglue(tmp_path, "run", "hidden/small.yaml").stdout
    assert "up to date" in again
    assert before == {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").rglob("*.h5")}
