"""Configs and tables that vegglue writes among a user's own: it replaces what it wrote itself, and nothing else.

A config ends with the digests of itself and of the tables written with it. A file without one, or with another
content, was made or edited by hand.
"""

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path

from vegglue.case.text_files import write_text
from vegglue.errors import InputError, shown_path

HEADING = "# By these vegglue knows what it wrote; what was edited since is replaced with --force only.\n"
LINE = re.compile(r"^# sha256 ([0-9a-f]{16}) of (.+)\n", re.MULTILINE)


def write_made(texts: Mapping[Path, str], advice: str, force: bool = False) -> None:
    """Write a config, the last of `texts`, and before it the tables it comes with.

    Errors: InputError, before anything is written, when one is there that vegglue did not write as it is, unless
    forced; StorageError, which ends with the advice.
    """
    refuse_not_made(texts, advice, force)
    *tables, config = texts
    for table in tables:
        write_text(table, texts[table], advice)
    stamped = {path.name: texts[path] for path in (config, *tables)}
    lines = "".join(f"# sha256 {_short(text)} of {name}\n" for name, text in stamped.items())
    write_text(config, texts[config] + HEADING + lines, advice)


def refuse_not_made(texts: Mapping[Path, str], advice: str, force: bool = False) -> None:
    """Errors: InputError, as those of `write_made`, where something is there that is not to be replaced."""
    config = list(texts)[-1]
    for path in texts:
        if (path.exists() or path.is_symlink()) and not path.is_file():  # reading a pipe would wait
            raise InputError(f"{shown_path(path)}: expected a file or nothing, got something else; {advice}.")
    if not force:
        stated = _stated_in(config)
        for path, text in texts.items():
            _refuse_edited(path, text, stated, advice)


def refuse_parent(target: Path, parent: Path) -> None:
    """Errors: InputError where a config is to be written over the one that it extends, which --force would replace."""
    if target.resolve() == parent:
        raise InputError(f"--to {shown_path(target)}: is the config that it extends; give another file.")


def _refuse_edited(path: Path, text: str, stated: Mapping[str, str], advice: str) -> None:
    there = _text_of(path)
    if there is None or there == text or stated.get(path.name) == _short(there):
        return
    raise InputError(
        f"{shown_path(path)}: is there, and was not made by vegglue or was edited since; add --force to "
        f"replace it, or {advice}."
    )


def _stated_in(config: Path) -> dict[str, str]:
    try:
        return {name: digest for digest, name in LINE.findall(config.read_text(encoding="utf-8"))}
    except (OSError, UnicodeDecodeError):
        return {}


def _text_of(path: Path) -> str | None:
    """The text of a file without the digests at its end; None where there is no file."""
    try:
        text = path.read_bytes().decode(errors="backslashreplace")
    except FileNotFoundError:
        return None
    except OSError:
        return ""  # not readable: not what vegglue wrote
    body, heading, lines = text.rpartition(HEADING)
    return body if heading and not LINE.sub("", lines) else text


def _short(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
