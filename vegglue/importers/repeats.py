"""Values measured again at one place: their mean, and its standard error from a scatter pooled over many places.

The scatter of three values alone may come out ten times too small by chance, and that one place then outweighs all
others: sums of squares of residuals have no mean with two degrees of freedom.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import sqrt
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.serial_scatter import values_that_are_one

# Experiment, section, x, y of a place [m]; and a value with its stated standard error, NaN where there is none.
PlaceKey = tuple[str, str, float, float]
RepeatedValue = tuple[float, float]
# Of what counts as one: begins as the key of a place, and may go on.
RepeatKey = Any
# How much of a key names a place, its section and its experiment: the narrowest that has ENOUGH is asked.
NARROW_TO_WIDE = (4, 2, 1)
# Degrees of freedom nu of a scatter. chi^2 is nu / (nu - 2) times too large on average with it: 7 % with 30. The whole
# file may give fewer: with 10, a standard error is known to 1 / sqrt(2 nu), about a quarter.
ENOUGH, LEAST_OF_FILE = 30, 10
# Repeats that differ by so many of their errors do not by chance: of two, one pair in two million.
BEYOND_ERRORS = 5.0
Scatter = Mapping[tuple[object, ...], tuple[float, int]]


def means_of_repeats(gathered: Mapping[RepeatKey, Sequence[RepeatedValue]]) -> list[RepeatedValue]:
    """Mean of each place and its standard error: from those stated, else s sqrt(tau / n), s at most; 0 for unknown.

    tau: how many values in a row count as one, see `values_that_are_one`; s: root of sum (u - mean u)^2 / sum (n - 1),
    of the values without stated errors of the narrowest of place, section and experiment that has ENOUGH degrees of
    freedom, else of all. One kind and one file.
    """
    unstated = {place: values for place, values in gathered.items() if not _stated(values)}
    scatter, tau = _scatter(unstated), _in_a_row(unstated)
    return [
        (float(np.mean([one for one, _ in some])), _error(place, some, scatter, tau))
        for place, some in gathered.items()
    ]


def said_of_repeats(gathered: Mapping[RepeatKey, Sequence[RepeatedValue]]) -> str:
    """How many values were averaged, where they are too few for a standard error that is missing, and where they differ
    by more than the errors that are stated.
    """
    unstated = {place: values for place, values in gathered.items() if not _stated(values)}
    repeats = sum(len(values) - 1 for values in gathered.values())
    freedom = sum(len(values) - 1 for values in unstated.values())
    too_few = f", too few for a standard error: {LEAST_OF_FILE} are needed" if 0 < freedom < LEAST_OF_FILE else ""
    tau = _in_a_row(unstated)
    alike = f", {tau:.2g} in a row as one, as neighbours are alike" if tau > 1.0 else ""
    averaged = _single(gathered) if repeats == 1 else f", {repeats} repeats averaged{alike}" if repeats else ""
    return averaged + too_few + _beyond_errors(gathered)


def _single(gathered: Mapping[RepeatKey, Sequence[RepeatedValue]]) -> str:
    """Where the only repeat is, and what to do if it is a row that was written twice."""
    (place, values), *_ = ((place, values) for place, values in gathered.items() if len(values) > 1)
    copied = " (the same value: take the row out if it was written twice)" if values[0][0] == values[1][0] else ""
    return f", 1 repeat averaged at x = {place[2]:g}, y = {place[3]:g} m{copied}"


def _beyond_errors(gathered: Mapping[RepeatKey, Sequence[RepeatedValue]]) -> str:
    """Where repeats differ most, by more than BEYOND_ERRORS times their stated errors; nothing where none do."""
    several = {place: values for place, values in gathered.items() if len(values) > 1 and _stated(values)}
    if not several:
        return ""
    place = max(several, key=lambda one: _times_error(several[one]))
    times = _times_error(several[place])
    where = f"at x = {place[2]:g}, y = {place[3]:g} m"
    return (
        f", which differ by {times:.2g} times their stated errors {where}: see whether they are repeats"
        if times > BEYOND_ERRORS
        else ""
    )


def _times_error(values: Sequence[RepeatedValue]) -> float:
    """Root of sum ((u - mean u) / se)^2 / (n - 1) [-], of values with stated errors."""
    u, error = np.array(values).T
    return float(np.sqrt(np.sum(((u - u.mean()) / error) ** 2) / (u.size - 1)))


def without_repeats(
    points: MeasuredRows, keys: Sequence[tuple[object, ...]], errors: Array
) -> tuple[MeasuredRows, str]:
    """Each point once, where `keys` (rows,) say which rows are one, and what is said of it; errors (rows,) [m/s].

    u is the mean with its error, see `means_of_repeats`; v and w are means, u_std is the root of the mean square, and
    durations add up. Without repeats the points are as they were.
    """
    rows: dict[tuple[object, ...], list[int]] = {}
    for row, key in enumerate(keys):
        rows.setdefault(key, []).append(row)
    if len(rows) == points.size:
        return points, ""
    u = points.numbers["u"]
    gathered = {key: [(float(u[row]), float(errors[row])) for row in some] for key, some in rows.items()}
    value, error = np.array(means_of_repeats(gathered)).T
    together = {
        role: np.array([how(points.numbers[role][some]) for some in rows.values()])
        for role, how in TOGETHER.items()
        if role in points.numbers
    }
    first = np.isin(np.arange(points.size), [some[0] for some in rows.values()])
    return points.only(first).having({"u": value, "u_se": error, **together}), said_of_repeats(gathered)


def _mean_of_known(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else float("nan")


# How what stands beside u is put together of repeats.
TOGETHER: Mapping[str, Callable[[Array], float]] = {
    "v": _mean_of_known,
    "w": _mean_of_known,
    "u_std": lambda values: float(np.sqrt(np.mean(values**2))),
    "duration_s": lambda values: float(np.sum(values)),
}


def _stated(values: Sequence[RepeatedValue]) -> bool:
    return all(np.isfinite(error) for _, error in values)


def _in_a_row(unstated: Mapping[RepeatKey, Sequence[RepeatedValue]]) -> float:
    return values_that_are_one([one for one, _ in values] for values in unstated.values())


def _error(place: RepeatKey, values: Sequence[RepeatedValue], scatter: Scatter, tau: float) -> float:
    if _stated(values):
        return sqrt(sum(error**2 for _, error in values)) / len(values)
    return sqrt(_variance(place, scatter) * min(tau / len(values), 1.0))


def _variance(place: RepeatKey, scatter: Scatter) -> float:
    """s^2 of one value at a place; 0 for unknown."""
    for width in NARROW_TO_WIDE:
        squares, freedom = scatter.get(place[:width], (0.0, 0))
        if freedom >= ENOUGH:
            return squares / freedom
    squares, freedom = scatter.get((), (0.0, 0))
    return squares / freedom if freedom >= LEAST_OF_FILE else 0.0


def _scatter(gathered: Mapping[RepeatKey, Sequence[RepeatedValue]]) -> Scatter:
    """Sum of squares about the means of the places, and degrees of freedom, by the beginning of their keys."""
    found: dict[tuple[object, ...], tuple[float, int]] = {}
    for place, values in gathered.items():
        squares, freedom = len(values) * float(np.var([one for one, _ in values])), len(values) - 1
        for group in _groups_of(place):
            before = found.get(group, (0.0, 0))
            found[group] = (before[0] + squares, before[1] + freedom)
    return found


def _groups_of(place: RepeatKey) -> Iterator[tuple[object, ...]]:
    return (place[:width] for width in (*NARROW_TO_WIDE, 0))
