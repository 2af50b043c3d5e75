"""What holds of every command: its answer alone with `--quiet`, one object with `--json`, no colour in a pipe."""

import json
import sys
from pathlib import Path

import pytest
import typer
from reach import COARSE, write_reach

from vegglue.cli.main import COMMANDS, app, main
from vegglue.version import VERSION

# The version is one word, with nothing around it.
BARE = {"version"}
# Its loop is that of the tutorial, whose results `test_documents` lets it use again.
ELSEWHERE = {"demo"}
NAMES = [name for group in COMMANDS.values() for name in group if name not in BARE]
# One call of each command in a folder with a brook, in an order in which each finds what it needs; MODE keeps what two
# passes write apart.
CALLS: tuple[tuple[str, ...], ...] = (
    ("new", "beck-MODE"),
    ("plan", "brook.yaml", "--jobs", "1"),
    ("import", "mill", "--to", "mill-MODE.yaml"),
    ("check", "brook.yaml"),
    ("simulate", "brook.yaml", "--jobs", "1"),
    ("infer", "brook.yaml", "--jobs", "1"),
    ("diagnose", "brook.yaml", "--jobs", "1"),
    ("discover", "brook.yaml", "--jobs", "1"),
    ("extend", "brook.yaml", "--add", "streamlining"),
    ("extend", "brook.yaml", "--auto", "--jobs", "1"),
    ("compare", "brook.yaml", "brook+streamlining.yaml", "--jobs", "1"),
    ("next", "brook.yaml", "--jobs", "1"),
    ("run", "brook.yaml", "--jobs", "1"),
    ("report", "brook.yaml"),
    ("overview", "brook.yaml"),
    ("export", "brook.yaml", "--only", "csv"),
    ("effects",),
    ("effects", "wind"),
    ("twin", "brook.yaml", "--hide", "streamlining=-0.5", "--to", "riddle-MODE"),
    ("diagnose", "riddle-MODE/riddle-MODE.yaml", "--jobs", "1"),
    ("reveal", "riddle-MODE"),
)
SITE = """
channel: {length_m: 30, bottom_width_m: 3, bank_slope_v_per_h: 0.5, bed_slope: 0.001}
author: a note that nobody reads
experiments: {June: {discharge: 2000 l/s, level: 95 cm}}
"""


def test_a_call_of_every_command_is_tried() -> None:
    assert {call[0] for call in CALLS} | ELSEWHERE == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_every_command_can_be_quiet_and_tell_an_object(name: str) -> None:
    command = typer.main.get_group(app).commands[name]
    options = {option for parameter in command.params for option in parameter.opts}
    assert {"--quiet", "-q", "--json"} <= options
    flags = [parameter for parameter in command.params if getattr(parameter, "is_flag", False)]
    assert all(str(flag.metavar).strip() == "" for flag in flags), "none is told as if it took a value"


@pytest.mark.parametrize("asked", ["version", "--version"])
def test_the_version_is_one_word(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], asked: str
) -> None:
    monkeypatch.setattr(sys, "argv", ["vegglue", asked])
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code
    assert capsys.readouterr().out == f"{VERSION}\n"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (("simulate", "x.yaml", "--members", "-1"), ("--members", "at least 1", "'-1'")),
        (("simulate", "x.yaml", "--jobs", "two"), ("--jobs", "a whole number", "'two'")),
        (("new", "x", "--length", "wide"), ("--length", "a number", "'wide'")),
        (("export", "x.yaml", "--to", "spoty"), ("--to", "'spoty'", "'spotpy'")),
        (("check", "x.yaml", "--job", "2"), ("--job",)),
        (("check",), ("CONFIG",)),
    ],
    ids=lambda part: part[-1],
)
def test_what_an_option_does_not_take_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], line: tuple[str, ...], words: tuple[str, ...]
) -> None:
    """In words of ours: none of the library that reads values."""
    monkeypatch.setattr(sys, "argv", ["vegglue", *line])
    with pytest.raises(SystemExit) as ended:
        main()
    said = capsys.readouterr().err
    assert ended.value.code == 2
    assert all(word in said for word in words)
    assert "Input should" not in said
    assert "Value error" not in said


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("user")
    error = ("experiment: June}", "experiment: June, standard_error: 0.02}")
    write_reach(folder, COARSE, ("members: 1024", "members: 32"), error)
    (folder / "mill").mkdir()
    (folder / "mill" / "site.yaml").write_text(SITE, encoding="utf-8")
    (folder / "mill" / "adv.csv").write_text("x;y;u (cm/s);u_se (cm/s)\n8;0;21;1\n", encoding="utf-8")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["quiet", "json"])
def test_each_gives_its_answer_and_nothing_else(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], mode: str
) -> None:
    monkeypatch.chdir(folder)
    for call in CALLS:
        arguments = [argument.replace("MODE", mode) for argument in call]
        monkeypatch.setattr(sys, "argv", ["vegglue", *arguments, f"--{mode}"])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        assert (ended.value.code or 0, err) == (0, ""), arguments
        assert "\x1b" not in out, arguments
        if mode == "json":
            assert out.count("\n") == 1, arguments
            json.loads(out)
        else:
            assert out, arguments
            assert not any(line.startswith(("... ", "Next: ")) for line in out.splitlines()), arguments
            assert "taken as notes" not in out, arguments
