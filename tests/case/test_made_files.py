"""What a user made or edited is never replaced without being asked to; what vegglue wrote itself is."""

import os
from pathlib import Path

import pytest

from vegglue.case.resolved_config import write_made
from vegglue.errors import InputError

ADVICE = "give another file by --to"
Texts = dict[Path, str]


@pytest.fixture
def texts(tmp_path: Path) -> Texts:
    """A table and the config it comes with."""
    return {tmp_path / "velocities.csv": "x,y,u\n1,2,0.3\n", tmp_path / "brook.yaml": "name: brook\n"}


def changed(texts: Texts) -> Texts:
    return {path: text + text.splitlines()[-1] + "0\n" for path, text in texts.items()}


def test_its_own_files_are_replaced(texts: Texts) -> None:
    for now in (texts, texts, changed(texts), texts):
        write_made(now, ADVICE)
        assert all(path.read_text().startswith(text) for path, text in now.items())


@pytest.mark.parametrize("name", ["velocities.csv", "brook.yaml"])
@pytest.mark.parametrize("by", ["edit", "hand"])
def test_what_was_made_or_edited_by_hand_stays(texts: Texts, tmp_path: Path, name: str, by: str) -> None:
    mine = tmp_path / name
    if by == "edit":
        write_made(texts, ADVICE)
        mine.write_text(mine.read_text().replace("1,2", "1,3").replace("brook", "creek"))
    else:
        mine.write_text("# mine\n")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(InputError, match=f"{name}: is there, .* --force to replace it, or give another"):
        write_made(changed(texts), ADVICE)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before, "nothing at all is written"
    write_made(changed(texts), ADVICE, force=True)
    assert mine.read_text().startswith(changed(texts)[mine])


def test_what_a_killed_command_wrote_is_no_edit(texts: Texts, tmp_path: Path) -> None:
    (tmp_path / "velocities.csv").write_text(texts[tmp_path / "velocities.csv"])
    write_made(texts, ADVICE)


def test_a_file_of_an_older_version_with_the_same_content_is_its_own(texts: Texts, tmp_path: Path) -> None:
    (tmp_path / "brook.yaml").write_text(texts[tmp_path / "brook.yaml"])
    write_made(texts, ADVICE)


def test_a_folder_and_bytes_that_are_no_text_stay(texts: Texts, tmp_path: Path) -> None:
    (tmp_path / "velocities.csv").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=r"velocities\.csv"):
        write_made(texts, ADVICE)
    (tmp_path / "velocities.csv").unlink()
    (tmp_path / "brook.yaml").mkdir()
    with pytest.raises(InputError, match=r"brook\.yaml"):
        write_made(texts, ADVICE)


@pytest.mark.parametrize("force", [False, True])
def test_what_is_no_file_is_neither_read_nor_replaced(tmp_path: Path, force: bool) -> None:
    """Reading a pipe would wait for ever; a link that leads nowhere was made by somebody."""
    (tmp_path / "link").symlink_to("nowhere")
    os.mkfifo(tmp_path / "pipe")
    for name in ("link", "pipe"):
        with pytest.raises(InputError, match=f"{name}: expected a file or nothing, got something else; give another"):
            write_made({tmp_path / name: "name: x\n"}, ADVICE, force)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "pipe"]
    assert (tmp_path / "link").is_symlink()
