"""What a config from a stranger can and cannot do: docs/trust.md, held."""

import ast
import os
import re
from contextlib import suppress
from pathlib import Path

import pytest
from house import FILES
from reach import COARSE, Say, write_reach
from systems import POSIX_ALONE

import vegglue
from vegglue.case import config as case_config
from vegglue.case.config import load_case
from vegglue.errors import InputError

COMMANDS = (
    ("check",), ("simulate",), ("infer",), ("report",), ("run",), ("diagnose",), ("extend", "--add", "mixing_length"),
    ("compare",), ("overview",), ("next",), ("twin", "--to", "twin"), ("effects", "--config"),
)  # fmt: skip
ALARM = "from pathlib import Path\nPath('ran').write_text('')\nEFFECTS = ()\n"


CODE = ("effect_file: own.py", 'engine: {command: "{python} {own}", files: {own: own.py}}')


@pytest.fixture(params=CODE, ids=["effects", "engine"])
def strangers(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A config that extends one that names code, which leaves a mark when it runs."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.py").write_text(ALARM.replace("'ran'", repr(str(tmp_path / "ran"))), encoding="utf-8")
    write_reach(tmp_path, COARSE, ("name: brook", f"name: brook\n{request.param}"))
    child = tmp_path / "child.yaml"
    child.write_text("extends: brook.yaml\nname: child\n", encoding="utf-8")
    return child


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
def test_no_command_runs_code_that_a_config_names(strangers: Path, say: Say, command: tuple[str, ...]) -> None:
    name, *options = command
    arguments = [*options, strangers] if options == ["--config"] else [strangers, *options]
    code, said = say(name, *arguments)
    assert code == 2
    assert re.search("which runs as code: read it.* and add --trust if you trust", said)
    assert not Path("ran").exists()
    assert not Path("runs").exists()


def test_only_trust_runs_it(strangers: Path) -> None:
    with pytest.raises(InputError, match="runs as code"):
        load_case(strangers)
    assert not Path("ran").exists()
    with suppress(InputError):  # of a command that leaves no predictions
        vegglue.check(load_case(strangers, trust=True))
    assert Path("ran").exists()


@pytest.mark.parametrize("name", ["../away", "a/b", "/x", "..", ".", "a\\b", "A", "a\n", ""])
def test_the_folder_of_a_run_lies_in_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="`name`"):
        load_case(write_reach(tmp_path, ("name: brook", f"name: {name!r}")))


@pytest.mark.slow
def test_nothing_that_is_read_can_hold_code() -> None:
    """No pickle, eval or shell anywhere but in what speaks to workers of a cluster, which the user names. Three files
    begin a process: two a Python of their own words, which reads a result file before the command does or compiles
    loops, and one the command of `engine`, which needs --trust.
    """
    never = {"pickle", "marshal", "shelve", "dill", "cloudpickle", "subprocess"}
    for path in FILES:
        of_own_words = path.name in ("sandboxed_reader.py", "first_compilation.py")
        banned = never - {"subprocess"} if of_own_words else never
        tree = ast.parse(path.read_text(encoding="utf-8"))
        imported = {
            alias.name.split(".")[0] for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names
        }
        imported |= {(node.module or "").split(".")[0] for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        called = {
            node.func.id for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        }
        assert imported & banned == ({"subprocess"} if path.name == "command.py" else set()), path
        assert "shell=True" not in path.read_text(encoding="utf-8"), path
        assert not called & {"eval", "exec", "__import__"}, path
        assert "allow_pickle=True" not in path.read_text(encoding="utf-8"), path


@POSIX_ALONE
def test_a_file_without_end_or_name_is_refused_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    os.symlink("loop.csv", "loop.csv")
    os.mkfifo("pipe.csv")
    for name in ("loop.csv", "pipe.csv", "/dev/zero", "x" * 300, "."):
        with pytest.raises(InputError, match="expected an existing file"):
            load_case(write_reach(tmp_path, ("file: velocities.csv", f"file: {name}")))
    for name in ("loop.csv", "pipe.csv", "x" * 300):
        with pytest.raises(InputError, match="cannot be read"):
            load_case(name)
    monkeypatch.setattr(case_config, "LARGEST_DATA", 10)
    with pytest.raises(InputError, match="expected a file of at most 10 bytes"):
        load_case(write_reach(tmp_path))


def test_a_missing_file_of_validation_is_named(tmp_path: Path) -> None:
    unseen = "validation: {experiments: {May: {discharge: 1, level: 0.9}}, observations: [{kind: level, file: no.csv}]}"
    with pytest.raises(InputError, match=r"`validation.observations\[0\].file` expected an existing file"):
        load_case(write_reach(tmp_path, ("simulate:", f"{unseen}\nsimulate:")))
