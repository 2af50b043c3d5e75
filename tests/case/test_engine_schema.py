"""`engine` in a config: words of the command, its files, what a hash covers, and sentences for what is wrong."""

from pathlib import Path

import pytest
from reach import write_reach

from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash, digest_of, resolved_yaml, simulation_hash
from vegglue.case.schema import Case
from vegglue.errors import InputError

ENGINE = 'engine: {command: "{python} {model} --speed 2", files: {model: model.py}}'


def with_engine(folder: Path, engine: str = ENGINE, *changes: tuple[str, str]) -> Case:
    """The brook of the docs with an engine, read with --trust."""
    if not (folder / "model.py").exists():
        (folder / "model.py").write_text("print(1)\n", encoding="utf-8")
    return load_case(write_reach(folder, ("name: brook", f"name: brook\n{engine}"), *changes), trust=True)


def test_files_are_named_from_the_config_and_stand_in_the_words(tmp_path: Path) -> None:
    engine = with_engine(tmp_path).engine
    assert engine is not None
    assert engine.words("py") == ("py", str(tmp_path / "model.py"), "--speed", "2")


def test_a_child_in_another_folder_keeps_the_files_of_its_parent(tmp_path: Path) -> None:
    with_engine(tmp_path)
    (tmp_path / "below").mkdir()
    child = tmp_path / "below" / "child.yaml"
    child.write_text("extends: ../brook.yaml\nname: child\n", encoding="utf-8")
    case = load_case(child, trust=True)
    assert case.engine is not None
    assert case.engine.files == {"model": tmp_path / "model.py"}
    with pytest.raises(InputError, match=r"`engine` names the command .* runs as code: .* add --trust"):
        load_case(child)


def test_a_resolved_config_says_the_same(tmp_path: Path) -> None:
    case = with_engine(tmp_path)
    (tmp_path / "resolved.yaml").write_text(resolved_yaml(case), encoding="utf-8")
    again = load_case(tmp_path / "resolved.yaml", trust=True)
    assert again.engine == case.engine
    assert case_hash(again) == case_hash(case)


def test_the_hash_of_an_ensemble_covers_the_command_and_its_files(tmp_path: Path) -> None:
    own = simulation_hash(with_engine(tmp_path))
    assert own != simulation_hash(with_engine(tmp_path, ENGINE.replace("speed 2", "speed 3")))
    assert own == simulation_hash(with_engine(tmp_path, ENGINE.replace("{command", "{keep: all, step: 0.2, command")))
    (tmp_path / "model.py").write_text("print(2)\n", encoding="utf-8")
    assert own != simulation_hash(with_engine(tmp_path))


def test_a_folder_has_one_digest_until_a_file_in_it_changes(tmp_path: Path) -> None:
    template = tmp_path / "template"
    (template / "deep").mkdir(parents=True)
    (template / "deep" / "grid.txt").write_text("1", encoding="utf-8")
    before = digest_of(template)
    (template / "deep" / "__pycache__").mkdir()
    (template / "deep" / "__pycache__" / "model.cpython-312.pyc").write_bytes(b"left by the first run")
    assert digest_of(template) == before
    (template / "deep" / "grid.txt").rename(template / "grid.txt")
    assert digest_of(template) != before
    assert with_engine(tmp_path, ENGINE.replace("model.py", "template"))


def test_a_command_may_have_parameters_that_the_built_in_solver_lacks(tmp_path: Path) -> None:
    unknown = ("parameters:  ", "parameters:\n  salt: {distribution: uniform, low: 0, high: 1, unit: '-'}\n  #")
    assert "salt" in with_engine(tmp_path, ENGINE, unknown).parameters
    with pytest.raises(InputError, match="used nowhere"):
        load_case(write_reach(tmp_path, unknown))


@pytest.mark.parametrize(
    ("engine", "sentence"),
    [
        ("engine: {command: ''}", "`engine` .* expected a `command` with the name of a program"),
        ("engine: {command: 'run \"it'}", "expected a `command` with quotes in pairs"),
        ("engine: {command: 'run it | tee log'}", r"expected a `command` without '\|', as no shell reads it"),
        ("engine: {command: 'run {modl}', files: {model: model.py}}", "{modl} names one of `files`: model, python"),
        ("engine: {command: 'run', files: {python: model.py}}", "expected another name than `python` in `files`"),
        (
            "engine: {command: 'run', files: {model: no.py}}",
            r"files.model` expected an existing file or folder",
        ),
        ("engine: {command: 'run', timeout: 0}", "`engine.timeout` .* expected"),
        ("engine: {command: 'run', step: 2}", "`engine.step` .* expected"),
        ("engine: {command: 'run', keep: none}", "`engine.keep` .* expected"),
        ("engine: {program: 'run'}", "`engine.* is not a known key"),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(tmp_path: Path, engine: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence.replace("{modl}", r"\{modl\}")) as told:
        with_engine(tmp_path, engine)
    assert "\n" not in str(told.value)


def test_no_fields_are_kept_of_a_command(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"`simulate.fields` cannot be kept of a command"):
        with_engine(tmp_path, ENGINE, ("members: 1024", "members: 8, fields: {x: [0, 10]}"))


def test_a_child_may_have_the_built_in_engine_again(tmp_path: Path) -> None:
    """To be compared with its parent; nothing of it is code."""
    with_engine(tmp_path)
    (tmp_path / "child.yaml").write_text("extends: brook.yaml\nname: child\nengine: null\n", encoding="utf-8")
    assert load_case(tmp_path / "child.yaml").engine is None
