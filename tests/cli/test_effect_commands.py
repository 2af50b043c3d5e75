"""`vegglue effects`, a user's own effects, and what is refused of a case that names effects."""

import json
import re
from pathlib import Path

import pytest
from reach import COARSE, ROOT, here, vegglue, write_reach

from vegglue.cli.main import main
from vegglue.effects.library import SHIPPED, library

PAGE = (ROOT / "docs" / "own_effect.md").read_text(encoding="utf-8")
OWN = re.search(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)[1]
IN_CONFIG = re.search(r"^```yaml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)[1]


WITH_ERROR = ("experiment: June}", "experiment: June, standard_error: 0.02}")


def own_case(folder: Path) -> Path:
    """The reach of docs/own_case.md with the effect of the page, its values merged into the config."""
    (folder / "slow_stones.py").write_text(OWN, encoding="utf-8")
    return write_reach(folder, COARSE, *pasted(IN_CONFIG), WITH_ERROR)


def pasted(text: str) -> tuple[tuple[str, str], ...]:
    """What to replace in the page's config to have `effects:` and one more of its `parameters:`."""
    effects, parameter = text.split("parameters:\n") if "parameters:\n" in text else (text, "")
    return ("observations:\n", f"{effects}observations:\n"), ("  phi: {dist", f"{parameter}  phi: {{dist")


def test_the_list_names_every_effect(say, capsys, monkeypatch):
    assert say("effects")[0] == 0
    listed = said_to_text(monkeypatch, capsys, "effects").splitlines()
    assert {line.split()[0] for line in listed if line.startswith("  ")} == {effect.name for effect in SHIPPED}
    named = json.loads(said_to_text(monkeypatch, capsys, "effects", "--json"))
    assert {entry["name"] for entry in named} == {effect.name for effect in SHIPPED}


def said_to_text(monkeypatch, capsys, *arguments):
    """What a command prints."""

    monkeypatch.setattr("sys.argv", ["vegglue", *map(str, arguments)])
    with pytest.raises(SystemExit):
        main()
    return capsys.readouterr().out


@pytest.mark.parametrize("effect", SHIPPED, ids=lambda effect: effect.name)
def test_a_page_says_equation_parameters_and_source(effect, monkeypatch, capsys):
    page = said_to_text(monkeypatch, capsys, "effects", effect.name)
    assert effect.equation in page
    assert effect.source in page
    for parameter in effect.parameters:
        assert f"{parameter.name} [{parameter.unit}]: {parameter.meaning}" in page


def test_the_example_on_a_page_can_be_pasted(tmp_path, monkeypatch, capsys):
    page = said_to_text(monkeypatch, capsys, "effects", "wind")
    example = "".join(line[4:] + "\n" for line in page.split("In a config:\n")[1].splitlines())
    config = write_reach(tmp_path, COARSE, *pasted(example))
    told = said_to_text(monkeypatch, capsys, "effects", "wind", "--config", config)
    assert "as `wind`: speed = wind (normal)" in told
    assert "brook does not have it." in said_to_text(monkeypatch, capsys, "effects", "elder", "--config", config)


def test_an_effect_of_ones_own_is_checked(tmp_path, monkeypatch, say, capsys):
    file = tmp_path / "slow_stones.py"
    file.write_text(OWN, encoding="utf-8")
    code, complaint = say("effects", "--check", file)
    assert (code, "--trust" in complaint) == (2, True)
    assert said_to_text(monkeypatch, capsys, "effects", "--check", file, "--trust") == (
        "slow_stones: keeps the contract\n"
    )
    file.with_name("bad.py").write_text(OWN.replace("1 + excess", "1 - 20 * excess"), encoding="utf-8")
    code, complaint = say("effects", "--check", tmp_path / "bad.py", "--trust")
    assert (code, "1 of 1 effects break the contract: slow_stones" in complaint) == (2, True)


def test_the_example_is_ten_lines():
    assert len([line for line in OWN.splitlines() if line.strip()]) <= 10


@pytest.mark.slow
def test_an_effect_of_ones_own_works_in_every_command(tmp_path, monkeypatch, say, capsys):
    """In several processes too, where the effect is known to none: the ensemble is made by two, the page by another."""
    config = own_case(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert "--trust" in say("check", config)[1]
    told = said_to_text(monkeypatch, capsys, "effects", "slow_stones", "--config", config, "--trust")
    assert "as `slow_stones`" in told
    assert say("check", config, "--trust")[0] == 0
    vegglue(tmp_path, "simulate", "--members", 8, "--jobs", 2, config, "--trust")
    inferred = say("infer", "--members", 8, "--method", "glue", config, "--trust")
    assert inferred[0] == 0
    page = here(tmp_path, "report", config, "--members", 8, "--trust")
    assert "Report" in page.stdout
    assert "slow_stones" in (tmp_path / "runs" / "brook" / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("EFFECTS = 1", "expected EFFECTS = (Effect(...), ...), got int; correct it"),
        ("EFFECTS = (max,)", "got builtin_function_or_method; correct it"),
        ("EFFECTS = (None,)", "got NoneType; correct it"),
        ("effects = ()", "got none; add it"),
        ("1 / 0", "cannot be run: ZeroDivisionError"),
        (OWN.replace('name="slow_stones"', 'name="wind"'), "exists already"),
    ],
)
def test_a_file_that_holds_no_effects_is_refused(text, complaint, tmp_path, say):
    config = own_case(tmp_path)
    (tmp_path / "slow_stones.py").write_text(text, encoding="utf-8")
    library.cache_clear()
    code, said = say("check", config, "--trust")
    assert (code, complaint in said, said.count("\n")) == (2, True, 1)


REFUSED = {  # what is refused, and the names that the message has
    "of the effect": ("streamlinin: {values: {vogel_exponent: -0.5}}", "`streamlining`"),
    "by `effect`": ("mine: {effect: winds, values: {speed: 3}}", "`wind`"),
    "of a parameter": ("wind: {values: {sped: 3}}", "`speed`"),
    "without amplitude": ("debris_screen: {values: {length: 1.0}}", "`excess`"),
    "too large": ("wind: {values: {speed: 300}}", "300"),
    "prior too wide": ("steep_bank: {values: {share: phi}}", "phi"),
    "of an experiment": ("wind: {values: {speed: 3}, experiments: [high]}", "high"),
    "of a section": ("probe_gain: {values: {gain: 0.1}, sections: [Z]}", "`Z`"),
    "of a device": ("device_gain: {values: {gain: 0.1}, devices: [Z]}", "`Z`"),
    "sections of the flow": ("wind: {values: {speed: 3}, sections: [A]}", "sections"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_does_not_agree_with_the_library_is_refused(what, tmp_path, say):
    entry, complaint = REFUSED[what]
    config = write_reach(tmp_path, COARSE, *pasted(f"effects:\n  {entry}\n"))
    code, said = say("check", config)
    assert (code, complaint in said, said.count("\n")) == (2, True, 1), said


@pytest.mark.slow
def test_diagnose_weighs_an_effect_of_ones_own_unasked(tmp_path):
    """The page says that `effect_file` alone makes it a suspect."""
    (tmp_path / "slow_stones.py").write_text(OWN, encoding="utf-8")
    named = ("observations:\n", "effect_file: slow_stones.py\nobservations:\n")
    config = write_reach(tmp_path, COARSE, named, WITH_ERROR)
    found = json.loads(here(tmp_path, "diagnose", config, "--json", "--trust").stdout)
    assert "slow_stones" in {effect["name"] for effect in found["effects"]}
