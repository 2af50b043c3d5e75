"""Compiled templates are kept between runs, and anew if what they were compiled with changed or is damaged."""

from pathlib import Path

import pytest

from vegglue.wording import sentences


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder of compiled templates, which this process may write to."""
    monkeypatch.setattr(sentences, "KEPT", tmp_path)
    monkeypatch.setattr(sentences.sys, "dont_write_bytecode", False)
    return tmp_path


def written() -> str:
    """A text of a template that no call before has in memory."""
    template = sentences._environment(page=False, folder="templates").get_template("plan.j2")
    return str(template.module.more_of_plan("vegglue plan"))  # type: ignore[attr-defined]


def test_a_template_is_compiled_once(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert written() == "All effects: vegglue plan"
    assert [one.suffix for one in kept.iterdir()] == [".jinja"]
    monkeypatch.setattr("jinja2.Environment.compile", lambda *_: pytest.fail("compiled again"))
    assert written() == "All effects: vegglue plan"


@pytest.mark.parametrize("damage", [b"", b"of other numbers\ncode", b"no line"])
def test_code_of_other_words_is_made_anew(kept: Path, damage: bytes) -> None:
    assert written() == "All effects: vegglue plan"
    (file,) = kept.iterdir()
    whole = file.read_bytes()
    file.write_bytes(damage)
    assert written() == "All effects: vegglue plan"
    assert file.read_bytes() == whole


def test_a_page_is_written_where_nothing_can_be_kept(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sentences, "KEPT", kept / "missing")
    assert written() == "All effects: vegglue plan"
    assert not list(kept.iterdir())
