"""Effects of a user that fail when they act: a sentence with their name, whatever the command."""

from pathlib import Path

import pytest
from reach import COARSE, Say, write_reach

from vegglue.diagnosis.effect_contract import ContractRule, breaches
from vegglue.effects.library import effects_of

EFFECT = '''from vegglue.effects.definition import Amplitude, Effect


def act(cells, excess):
    """k -> k (1 + a)."""
    {body}


EFFECTS = (Effect(
    name="slow_stones", stage="resistance", title="Stones hold back slow water", act=act,
    equation="k -> k (1 + a)", source="a guess",
    amplitude=Amplitude("excess", "-", "relative excess of friction", scale=0.5, low=-0.9, high=5.0),
),)
'''
SMALL = ("simulate: {members: 1024, seed: 7}", "simulate: {members: 4, seed: 7}\neffect_file: stones.py")
ERRORS = ("experiment: June}", "experiment: June, standard_error: 0.01}")


@pytest.mark.parametrize(
    ("body", "named"),
    [
        ("raise KeyError('x')", "KeyError"),
        ("return {'rate': cells.rate * float('nan')}", "finite"),
        ("return {'rate': cells.rate[:2, :2] * excess}", "`rate`"),
        ("return {'rate': cells.rate * (1 + 0j)}", "complex128"),
        ("return {'ratte': cells.rate}", "`ratte`"),
        ("cells.rate * (1 + excess)", "NoneType"),
    ],
)
def test_what_an_effect_does_wrong_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say, body: str, named: str
) -> None:
    config = write_reach(tmp_path, COARSE, SMALL, ERRORS)
    (tmp_path / "stones.py").write_text(EFFECT.format(body=body), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    code, told = say("diagnose", config, "--trust", "--jobs", 1)
    assert (code, "slow_stones" in told, named in told) == (2, True, True), told


def test_an_effect_at_work_that_fails_ends_a_simulation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say
) -> None:
    config = write_reach(tmp_path, COARSE, SMALL, ERRORS)
    config.write_text(config.read_text("utf-8") + "effects: {slow_stones: {values: {excess: 0.3}}}\n", encoding="utf-8")
    (tmp_path / "stones.py").write_text(EFFECT.format(body="raise KeyError('x')"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    code, told = say("simulate", config, "--trust", "--jobs", 1)
    assert (code, "fails when it acts, in line 6" in told) == (2, True), told


def test_a_function_of_other_names_fails_in_no_line(tmp_path: Path) -> None:
    """A line of ours was told, which the user's file did not have."""
    text = EFFECT.format(body="return {'rate': cells.rate * (1 + more)}").replace("(cells, excess)", "(cells, more)")
    (tmp_path / "stones.py").write_text(text, encoding="utf-8")
    effect = effects_of(tmp_path / "stones.py")[0]
    [said] = breaches(effect, tmp_path / "stones.py")
    assert said.rule is ContractRule.FUNCTION_RUNS
    assert "TypeError" in said.name
    assert "in line" not in said.name


@pytest.mark.parametrize(
    ("changed", "to", "said"),
    [
        ('"slow_stones"', '"slow stones"', "expected letters, digits and underscores, got `slow stones`"),
        ('"resistance"', '"resitance"', "the stage of `slow_stones` expected one of site, boundary"),
        ("source=", 'each="run", source=', "`each` of `slow_stones` expected one of case, experiment, "),
        ('Amplitude("excess", "-", "relative excess of friction", scale=0.5, low=-0.9, high=5.0)', "None",
         "`amplitude` of the effect 'slow_stones' expected an Amplitude(...), got NoneType"),
        ("scale=0.5", "scale='big'", "`scale` of 'excess' of the effect 'slow_stones' expected a number, got 'big'"),
        ("low=-0.9", "low=None", "`low` of 'excess' of the effect 'slow_stones' expected a number, got None"),
        ('title="Stones hold back slow water"', "title=7", "`title` of the effect 'slow_stones' expected text, got 7"),
        ("act=act", "act='act'", "`act` of the effect 'slow_stones' expected a function, got str"),
        ("source=", "shapes=[1], source=", "`shapes` of the effect 'slow_stones' expected a tuple (Shape(...), ...)"),
        ("EFFECTS = (Effect(", "EFFECTS = ()\nOTHERS = (Effect(", "got none in it"),
    ],
)  # fmt: skip
def test_what_no_command_could_use_is_refused(
    tmp_path: Path,
    say: Say,
    changed: str,
    to: str,
    said: str,
) -> None:
    text = EFFECT.format(body="return {'rate': cells.rate * (1 + excess)}").replace(changed, to)
    (tmp_path / "stones.py").write_text(text, encoding="utf-8")
    code, told = say("effects", "--check", tmp_path / "stones.py", "--trust")
    assert (code, said in told) == (2, True), told


def test_a_case_with_an_effect_file_can_be_twinned(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say) -> None:
    config = write_reach(tmp_path, COARSE, SMALL, ERRORS)
    (tmp_path / "stones.py").write_text(EFFECT.format(body="return {'rate': cells.rate * (1 + excess)}"), "utf-8")
    monkeypatch.chdir(tmp_path)
    assert say("twin", config, "--hide", "slow_stones=0.4", "--to", "twin", "--trust")[0] == 0
    assert say("reveal", "twin", "--trust") == (0, "")
    code, told = say("reveal", "twin")
    assert (code, "add --trust" in told) == (2, True), told
