"""The experiments that a site file names, and the refusal of rows of any other, before anything is written."""

from collections.abc import Sequence
from dataclasses import dataclass

from vegglue.errors import InputError
from vegglue.importers.site_file import HELD_OUT

EXPERIMENTS = "experiments"


@dataclass(frozen=True)
class KnownExperiments:
    """names: those that the rows of a file may have; site: the site file; key: where in it they stand; others: those
    under its other key.
    """

    names: tuple[str, ...]
    site: str
    key: str
    others: tuple[str, ...]

    def refuse_unknown(self, file: str, rows: Sequence[int], names: Sequence[str]) -> None:
        """Errors: InputError for the first of the names (rows,) that is not known, with the file and its row."""
        for row, name in zip(rows, names, strict=True):
            if name not in self.names:
                raise InputError(f"{file}, row {row}: {self.remedy(name)}.")

    def remedy(self, name: str) -> str:
        """What is wrong with a name that is not known, and what to do."""
        if not name:
            return f"expected an experiment, one of {', '.join(self.names)}, got nothing; fill it in"
        if name in self.others:
            other, place = (
                (HELD_OUT, "a file called `holdout`") if self.key == EXPERIMENTS else (EXPERIMENTS, "another file")
            )
            return f"experiment `{name}` is under `{other}` in {self.site}: put its rows into {place}, or take them out"
        return f"experiment `{name}` is not in {self.site}: add it under `{self.key}`, or take its rows out"
