"""An engine of the user's own: a command that takes the place of the built-in solver, and the files it needs."""

import re
import shlex
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from vegglue.case.parts import Number, Part, Positive

# What a word of the command may name in braces beside the files: the Python that runs vegglue.
PYTHON = "python"
_PLACEHOLDER = re.compile(r"\{([^{}]*)\}")
# Words that only a shell understands: a program would be given them as they stand.
_OF_A_SHELL = ("|", "||", "&", "&&", ";", "<", ">", ">>", "2>", "2>&1")


class CommandEngine(Part):
    """A command that is started once for each member, in a folder of its own: see docs/own_engine.md."""

    command: str = Field(description="program and its words, without a shell; {name} stands for one of `files`")
    files: dict[str, Path] = Field(default_factory=dict, description="files and folders that the command needs")
    # An hour: a steady flow of a reach takes minutes with the codes this is made for.
    timeout: Positive = Field(default=3600.0, description="time after which a run is stopped and has failed [s]")
    keep: Literal["failed", "all"] = Field(default="failed", description="whose folders stay after a run")
    # A tenth of a standard deviation. Predictions rounded to 1 mm/s then give slopes to 2 % where a standard deviation
    # moves them by 0.1 m/s, and central differences leave a thousandth of the curvature of the third order.
    step: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.1, description="step of differences [standard deviations of the prior]"
    )

    @model_validator(mode="after")
    def _words_that_are_known(self) -> Self:
        known = [*self.files, PYTHON]
        if PYTHON in self.files:
            raise ValueError(f"another name than `{PYTHON}` in `files`: it stands for the Python that runs vegglue")
        try:
            words = shlex.split(self.command)
        except ValueError as error:
            raise ValueError(f"a `command` with quotes in pairs ({error})") from None
        if not words:
            raise ValueError("a `command` with the name of a program")
        for word in words:
            if word in _OF_A_SHELL:
                raise ValueError(f"a `command` without {word!r}, as no shell reads it; put it into a script of `files`")
        for name in _PLACEHOLDER.findall(self.command):
            if name not in known:
                raise ValueError(f"a `command` in which {{{name}}} names one of `files`: {', '.join(known)}")
        return self

    def words(self, python: str) -> tuple[str, ...]:
        """The program and its words, with the path of each file that is named; python: what stands for {python}."""
        paths = {name: str(path) for name, path in self.files.items()} | {PYTHON: python}
        return tuple(_PLACEHOLDER.sub(lambda found: paths[found[1]], word) for word in shlex.split(self.command))
