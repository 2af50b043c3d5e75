"""Which effect acts where, as a value; only this module writes its text and reads it."""

import csv
import re
from dataclasses import dataclass
from io import StringIO

_NUMBER = r"-?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?"


@dataclass(frozen=True)
class EffectIdentity:
    """An effect of the library and what it is limited to.

    The text is ``name`` or ``name[target,target]``: ``steep_bank``, ``discharge_error[high]``, ``patch_density[p5]``,
    ``unlisted_bed[x47.29,y-0.23]``; as in CSV, a target that holds a comma stands in quotes, ``probe_gain["A, left"]``.

    Parameters
    ----------
    name
        Name of the effect in the library.
    target
        Names of experiments, sections or devices, of one patch, or the coordinates of a place; empty: everywhere.
    """

    name: str
    target: tuple[str, ...] = ()

    @classmethod
    def parse(cls, text: str) -> "EffectIdentity":
        """The identity with this text. A text without brackets is a name."""
        name, _, target = text.partition("[")
        return cls(name, tuple(next(csv.reader([target.removesuffix("]")]), ())))

    @classmethod
    def at_place(cls, name: str, x: float, y: float) -> "EffectIdentity":
        """An effect that acts around one place x, y [m]."""
        return cls(name, (f"x{x:g}", f"y{y:g}"))

    @property
    def place(self) -> tuple[float, float] | None:
        """The place x, y [m] when the target is one, else None."""
        found = re.fullmatch(f"x({_NUMBER}),y({_NUMBER})", ",".join(self.target))
        return (float(found[1]), float(found[2])) if found else None

    @property
    def key(self) -> str:
        """The text as a word, for the key of a config and the name of a parameter: ``discharge_error_high``.

        `import` names sections by their place, ``x-0.10`` and ``x+0.10``, which have to stay apart.
        """
        return re.sub(r"\W", "_", self.text.removesuffix("]").replace("+", "_plus_"))

    @property
    def text(self) -> str:
        written = StringIO()
        csv.writer(written, lineterminator="").writerow(self.target)
        return f"{self.name}[{written.getvalue()}]" if self.target else self.name

    def __str__(self) -> str:
        return self.text
