"""Errors a user can mend: one sentence each, shown without a traceback."""

import os
import re
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from vegglue.wording.numbers import shown_path as shown_path
from vegglue.wording.sentences import macros

# Signs that end a line or steer a terminal; files of strangers may hold them, and sentences quote files.
_STEERING = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


def _in_one_line(sentence: str) -> str:
    return _STEERING.sub(lambda sign: ascii(sign[0])[1:-1], sentence)


class InputError(ValueError):
    """Something handed in is wrong: where, what was expected, what came, and what to do.

    Parameters
    ----------
    kind : str
        The macro of `wording/templates/refusals.j2` that words the values; without values the sentence itself.
    **values : object
        Numbers in SI, names, rows and paths, kept as `values`.
    """

    def __init__(self, kind: str, /, **values: object) -> None:
        super().__init__(kind)
        self.kind, self.values = kind, values

    def __str__(self) -> str:
        if not self.values:
            return _in_one_line(self.kind)
        shown = {name: _in_one_line(one) if isinstance(one, str) else one for name, one in self.values.items()}
        lines = macros()[self.kind](shown).strip("\n").split("\n")
        return _in_one_line(" ".join(line.strip() for line in lines))

    def _render_traceback_(self) -> list[str]:  # IPython shows these lines in place of a traceback
        return [f"{type(self).__name__}: {self}"]


class StorageError(OSError):
    """A result could not be written or read, or a process was killed: what, why, and what is still safe."""

    def __str__(self) -> str:
        return _in_one_line(super().__str__())

    def _render_traceback_(self) -> list[str]:  # IPython shows these lines in place of a traceback
        return [f"{type(self).__name__}: {self}"]


def path_from(folder: Path, path: Path) -> str:
    """The path as a file in the folder names it, with slashes; in full on another drive of Windows."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:
        return Path(path).absolute().as_posix()


def shell_line(words: Sequence[str]) -> str:
    """Words as one line that can be copied into a shell: Windows quotes otherwise, and has backslashes in paths."""
    if sys.platform == "win32":
        return " ".join(f'"{word}"' if not word or " " in word else word for word in words)
    return shlex.join(words)


def shown_command(verb: str, config: Path | None, *options: str) -> str:
    """`vegglue VERB CONFIG` as sentences name it, to be copied; CONFIG if it is not known."""
    named = "CONFIG" if config is None else shown_path(config)
    return f"`{shell_line(['vegglue', verb, named, *options])}`"
