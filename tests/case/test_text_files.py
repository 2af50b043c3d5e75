"""Text files: whole or not at all, and a name for every case."""

from pathlib import Path

import pytest

from vegglue.case.text_files import case_name, names_in_files, write_text
from vegglue.errors import StorageError


def test_a_file_is_written_with_the_folders_above_it(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b" / "note.txt"
    for text in ("first", "zweiter – länger"):
        write_text(path, text, "do it again")
        assert path.read_text(encoding="utf-8") == text
    assert list(path.parent.iterdir()) == [path]


def test_what_cannot_be_written_is_told_and_leaves_the_old(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "note.txt"
    write_text(path, "old", "")

    def full(*names: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("vegglue.whole_files.os.replace", full)
    with pytest.raises(StorageError, match=r"note\.txt: .*make room\.$"):
        write_text(path, "new", "make room")
    assert path.read_text(encoding="utf-8") == "old"


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("Mill Brook (2024)", "mill-brook-2024"),
        ("d0-viscosity", "d0-viscosity"),
        ("Größe", "grosse"),
        ("Mühlbach", "muhlbach"),
        ("Ложа", "case"),
        ("***", "case"),
    ],
)
def test_any_words_become_the_name_of_a_case(words: str, name: str) -> None:
    assert case_name(words) == name
    assert len(case_name(words * 100)) <= 100


def test_no_two_names_come_to_the_same_file() -> None:
    """Where case does not count either, and for letters of any script."""
    names = ["June", "june", "June!", "高", "低", "+1", "-1", "***", "", "x" * 300, "x" * 301]
    found = names_in_files(names)
    assert list(found) == names
    assert len({name.casefold() for name in found.values()}) == len(names)
    assert (found["June"], found["june"], found["高"], found["***"]) == ("june", "june-2", "高", "case")
    assert max(len(name) for name in found.values()) < 60
