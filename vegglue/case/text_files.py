"""Text files written whole or not at all, and names of cases made of any words."""

import os
import re
from pathlib import Path

from vegglue.errors import StorageError


def write_text(path: Path, text: str, advice: str) -> None:
    """Write a file, and the folders above it, whole or not at all. Errors: StorageError, which ends with the advice."""
    new = path.with_name(path.name + ".new")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        new.write_text(text, encoding="utf-8")
        os.replace(new, path)
    except OSError as error:
        raise StorageError(f"{path}: cannot be written ({error.strerror}); {advice}.") from None


def case_name(words: str, otherwise: str = "case") -> str:
    """The words in lower case, with hyphens for what the schema does not allow in the name of a case.

    otherwise: the name when nothing is left.
    """
    return re.sub(r"[^a-z0-9_-]+", "-", words.lower()).strip("-")[:100] or otherwise
