"""Text files read up to a size and written whole or not at all, and names of cases made of any words."""

import re
import stat
import unicodedata
from collections.abc import Iterable, Mapping
from itertools import chain, count
from pathlib import Path

from vegglue.errors import InputError, shown_path
from vegglue.whole_files import write_file

# Most that a small result as JSON may take [bytes]; vegglue writes some tens of thousands.
LARGEST_JSON = 10_000_000
LONGEST_NAME = 100  # letters of the name of a case, as in its schema
LONGEST_IN_FILES = 50  # letters of a name in that of a file, which has room for 255 bytes; a letter takes up to four
# Signs that no text of a case may hold: control characters but tabs and ends of lines, halves of characters (which no
# file can hold), and marks that turn the direction of what follows.
UNPRINTABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\u202a-\u202e\u2066-\u2069\ufffe\uffff]")


def read_text(path: Path, most: int, advice: str = "path", by: Path | None = None) -> str:
    """The text of a file in UTF-8, with or without its mark.

    Parameters
    ----------
    most : int
        Size of the file at most [bytes]; no more is ever read.
    by : Path, optional
        With `advice`, how to get such a file, see the macro `unreadable`.

    Raises
    ------
    InputError
        If it is no file, cannot be read, is larger, or is not in UTF-8.
    """
    try:
        content = None
        if stat.S_ISREG(path.stat().st_mode):  # opening a pipe would wait, a device never ends
            with path.open("rb") as file:
                content = file.read(most + 1)
    except OSError as error:
        raise InputError("unreadable", file=path, why=error.strerror, advice=advice, by=by) from None
    except ValueError:  # a NUL in the name
        raise InputError("unreadable", file=path, why="no file has such a name", advice=advice, by=by) from None
    if content is None:
        raise InputError("unreadable", file=path, why="it is not a file", advice=advice, by=by)
    if len(content) > most:
        raise InputError(f"{shown_path(path)}: expected at most {most:,} bytes, got more: make it smaller.")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{shown_path(path)} is not text in UTF-8: save it as UTF-8.") from None


def unprintable(text: str) -> str | None:
    """The first sign of a text that nothing can show, None when there is none."""
    found = UNPRINTABLE.search(text)
    return None if found is None else found[0]


def write_text(path: Path, text: str, advice: str) -> None:
    """Write a file, and the folders above it, whole or not at all.

    Raises
    ------
    StorageError
        If it cannot be written; the message ends with the advice.
    InputError
        For a sign that no file in UTF-8 can hold.
    """
    try:
        content = text.encode()
    except UnicodeEncodeError as error:  # of the name of a folder, which need not be text
        sign = error.object[error.start]
        raise InputError(f"{str(path)!a}: cannot hold the sign {sign!a} of a name; rename what has it.") from None
    write_file(path, content, advice)


def case_name(words: str, otherwise: str = "case") -> str:
    """The words in lower case, letters without their accents, hyphens for what the schema does not allow in a name.

    otherwise: the name when nothing is left.
    """
    plain = unicodedata.normalize("NFKD", words.lower().replace("ß", "ss"))
    bare = "".join(sign for sign in plain if not unicodedata.combining(sign))
    return re.sub(r"[^a-z0-9_-]+", "-", bare).strip("-")[:LONGEST_NAME] or otherwise


def names_in_files(names: Iterable[str]) -> dict[str, str]:
    """What each of some names is called in files: in lower case, with hyphens for what is no letter, digit or _.

    Letters of all scripts stay.
    """
    stems = {name: re.sub(r"[^\w-]+", "-", name.lower()).strip("-")[:LONGEST_IN_FILES] or "case" for name in names}
    return told_apart(stems)


def told_apart(stems: Mapping[str, str]) -> dict[str, str]:
    """Stems by name, with a number from the second on where they come to be the same on a disk that knows no case."""
    found = dict[str, str]()
    for name, stem in stems.items():
        found[name] = unused(stem, found.values())
    return found


def unused(stem: str, taken: Iterable[str]) -> str:
    """A stem, with a number from 2 on where it is taken on a disk that knows no case."""
    of_any_case = {one.casefold() for one in taken}
    numbered = (f"{stem}-{number}" for number in count(2))
    return next(one for one in chain([stem], numbered) if one.casefold() not in of_any_case)
