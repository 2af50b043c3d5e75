"""Values of one place that differ with a column: those of two surveys, reaches or heights, and no repeats."""

from collections.abc import Hashable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from vegglue.arrays import Array
from vegglue.errors import InputError
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.wording.numbers import listed

DOWNSTREAM = ("u", "speed")
# What a column must do to velocities before they are no repeats: more than chance would in one of a thousand, half of
# their scatter or more, and 5 % of them, root mean square. Operators, days and probes of one flow make less of a
# difference, flows and heights of their own more. Chosen, not measured.
REPEATS_APART, TOLD_SCATTER, TOLD_VELOCITY = 1e-3, 0.5, 0.05
MOST_TEXTS = 3  # of the texts of a column
Numbers = NDArray[np.int64]


def refuse_told_apart(taken: MeasuredRows, places: Sequence[Hashable], file: str) -> None:
    """Errors: InputError where velocities of one place differ with a column in no role, or the discharge, alike at many
    places.

    places (rows,): what is one where they are equal. A number of the repeat, or the time of it, makes no difference.
    """
    for role in DOWNSTREAM:
        for heading, texts in _columns(taken).items() if role in taken.numbers else ():
            u = taken.numbers[role]
            rows = [row for row, text in enumerate(texts) if text.strip() and np.isfinite(u[row])]
            names = [texts[row] for row in rows]
            if _differ_with_names(u[rows], _numbered([places[row] for row in rows]), _numbered(names)):
                known = list(dict.fromkeys(names))
                more = [f"{len(known) - MOST_TEXTS} more"] if len(known) > MOST_TEXTS else []
                raise InputError(
                    f"{file}: expected repeats at one place to differ by chance, got velocities that differ with "
                    f"{heading!r} ({listed([*known[:MOST_TEXTS], *more])}); name it in `columns` of this file in "
                    "`files` of the site file, by what it holds (`experiment`, `section`, `y`, `z`, `height`, "
                    "`below`), keep the rows of one, or take the column out where they are repeats of one flow."
                )


def _columns(taken: MeasuredRows) -> dict[str, Sequence[str]]:
    """By heading: what may tell one flow or height from another."""
    discharges = taken.numbers.get("discharge")
    if discharges is None:
        return dict(taken.others)
    texts = ["" if np.isnan(one) else f"{one:g} m3/s" for one in discharges.tolist()]
    return {taken.columns["discharge"]: texts, **taken.others}


def _differ_with_names(u: Array, place: Numbers, name: Numbers) -> bool:
    """Whether names explain what u (rows,) of one place differs by, beyond chance; place and name by their numbers.

    d = u - mean u of its place, e = mean d of its name; F = (sum e^2 / (names - 1)) / (sum (d - e)^2 / (rows - places -
    names + 1)), an analysis of variance in two ways without
    interaction (Scheffe 1959, The Analysis of Variance; not checked against it), exact where each name stands once at
    each place.
    """
    several = np.bincount(place)[place] > 1 if u.size else np.zeros(0, dtype=bool)
    u, place, name = u[several], place[several], name[several]
    names, places = (np.unique(one).size for one in (name, place))
    left = u.size - places - names + 1
    if names < 2 or left < 1:
        return False
    off = u - _means(u, place)
    told = _means(off, name)
    whole, explained, rest = (float(np.sum(part**2)) for part in (off, told, off - told))
    if explained < TOLD_SCATTER * whole or explained < TOLD_VELOCITY**2 * float(np.sum(u**2)):
        return False
    ratio = explained / (names - 1) / (rest / left) if rest > 0.0 else np.inf
    return bool(fdtrc(names - 1, left, ratio) < REPEATS_APART)


def _numbered(keys: Sequence[Hashable]) -> Numbers:
    """A number for each key, the same for equal ones."""
    numbers = {key: number for number, key in enumerate(dict.fromkeys(keys))}
    return np.array([numbers[key] for key in keys], dtype=np.int64)


def _means(values: Array, group: Numbers) -> Array:
    """Of each value (rows,) the mean of its group."""
    return np.asarray((np.bincount(group, values) / np.maximum(np.bincount(group), 1))[group])
