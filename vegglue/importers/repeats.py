"""Values measured again at one place: their mean and its standard error, and columns that they are confounded with.

The scatter of three values alone may come out ten times too small by chance, and that one place then outweighs all
others: sums of squares of residuals have no mean with two degrees of freedom. So it is pooled over many places.
"""

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import replace
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from vegglue.arrays import Array
from vegglue.errors import InputError
from vegglue.importers.import_notes import RepeatsAveraged
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.wording.numbers import listed

# Experiment, section, x, y of a place [m]; and a value with its stated standard error, NaN if there is none.
PlaceKey = tuple[str, str, float, float]
RepeatedValue = tuple[float, float]
# Of what counts as one: begins as the key of a place, and may go on.
RepeatKey = Any
# How much of a key names a place, its section and its experiment: the narrowest that has ENOUGH is taken.
NARROW_TO_WIDE = (4, 2, 1)
# Degrees of freedom nu of a scatter. chi^2 is nu / (nu - 2) times too large on average with it: 7 % with 30. The whole
# file may give fewer: with 10, a standard error is known to 1 / sqrt(2 nu), about a quarter.
ENOUGH, LEAST_OF_FILE = 30, 10
# Repeats that differ by so many of their errors do not by chance: of two, one pair in two million.
BEYOND_ERRORS = 5.0
# The lag-one correlation of n values without one is off by 1 / sqrt(n): beyond four of these it is one.
OF_CHANCE = 4.0
# Values of a series from which its correlations count: the mean of fewer takes much of them along.
LEAST_OF_SERIES = 10
DOWNSTREAM = ("u", "speed")
# What a column must do to velocities before they are no repeats: more than chance would in one of a thousand, half of
# their scatter or more, and 5 % of them, root mean square. Operators, days and probes of one flow make less of a
# difference, flows and heights of their own more. Chosen, not measured.
SIGNIFICANCE, SHARE_OF_SCATTER, SHARE_OF_VELOCITY = 1e-3, 0.5, 0.05
MOST_TEXTS = 3  # of the texts of a column
Gathered = Mapping[RepeatKey, Sequence[RepeatedValue]]


def means_of_repeats(gathered: Gathered) -> list[RepeatedValue]:
    """mean u and s (tau / n)^(1/2): the mean of each place and its standard error.

    s^2 is sum (u - mean u)^2 / sum (n - 1) of the values without stated errors of the narrowest of place, section and
    experiment that has ENOUGH degrees of freedom, else of all; tau, see `autocorrelation_time`.

    Parameters
    ----------
    gathered : mapping of sequence of (float, float)
        Values and their errors [m/s], NaN if not stated, by place, in the order of time; of one kind and one file.

    Returns
    -------
    list of (float, float)
        Mean and its error [m/s]: from those stated if all are, else s at most; 0 if unknown.
    """
    unstated = {place: values for place, values in gathered.items() if not _stated(values)}
    tau = autocorrelation_time([one for one, _ in values] for values in unstated.values())
    # Sum of squares about the means of the places, and degrees of freedom, by the beginning of their keys.
    pooled: dict[tuple[object, ...], tuple[float, int]] = {}
    for place, values in unstated.items():
        squares, freedom = len(values) * float(np.var([one for one, _ in values])), len(values) - 1
        for width in (*NARROW_TO_WIDE, 0):
            before = pooled.get(place[:width], (0.0, 0))
            pooled[place[:width]] = (before[0] + squares, before[1] + freedom)

    def variance(place: RepeatKey) -> float:
        for width in NARROW_TO_WIDE:
            squares, freedom = pooled.get(place[:width], (0.0, 0))
            if freedom >= ENOUGH:
                return squares / freedom
        squares, freedom = pooled.get((), (0.0, 0))
        return squares / freedom if freedom >= LEAST_OF_FILE else 0.0

    found = []
    for place, values in gathered.items():
        if _stated(values):
            error = sqrt(sum(error**2 for _, error in values)) / len(values)
        else:
            error = sqrt(variance(place) * min(tau / len(values), 1.0))
        found.append((float(np.mean([one for one, _ in values])), error))
    return found


def _stated(values: Sequence[RepeatedValue]) -> bool:
    return all(np.isfinite(error) for _, error in values)


def autocorrelation_time(series: Iterable[Sequence[float]]) -> float:
    """tau = 1 + 2 sum_k rho_k, up to the first rho_k that is not above 0

    The mean of n values has the variance s^2 tau / n, where s^2 is that of a value.

    Parameters
    ----------
    series : iterable of sequence of float
        Each of one place, in the order of time; their autocovariances are added up, each about its own mean.

    Returns
    -------
    float
        [values]; 1 if neighbours are as alike as chance makes them.

    References
    ----------
    Sokal (1997), Monte Carlo Methods in Statistical Mechanics; not checked against it.
    """
    found = [np.asarray(one, dtype=np.float64) for one in series if len(one) >= LEAST_OF_SERIES]
    longest = max((one.size for one in found), default=0)
    covariance = np.zeros(longest)
    for one in found:
        spectrum = np.fft.rfft(one - one.mean(), 2 * one.size)
        covariance[: one.size] += np.asarray(np.fft.irfft(np.abs(spectrum) ** 2)[: one.size])
    if longest == 0 or covariance[0] <= 0.0:
        return 1.0
    rho = covariance / covariance[0]
    if rho[1] <= OF_CHANCE / np.sqrt(sum(one.size for one in found)):
        return 1.0
    until = int(np.argmax(rho <= 0.0))  # sums of deviations are 0, so that some rho is below
    return 1.0 + 2.0 * float(rho[1:until].sum())


def note_on_repeats(gathered: Gathered) -> RepeatsAveraged:
    """How many values were averaged, if they are too few for a standard error that is missing, and if they differ by
    more than the errors that are stated.
    """
    unstated = {place: values for place, values in gathered.items() if not _stated(values)}
    note = RepeatsAveraged(sum(len(values) - 1 for values in gathered.values()))
    if note.repeats == 1:
        place, values = next((place, values) for place, values in gathered.items() if len(values) > 1)
        note = replace(note, at=(place[2], place[3]), copied=values[0][0] == values[1][0])
    elif note.repeats:
        note = replace(note, together=autocorrelation_time([one for one, _ in some] for some in unstated.values()))
    if 0 < sum(len(values) - 1 for values in unstated.values()) < LEAST_OF_FILE:
        note = replace(note, needed=LEAST_OF_FILE)

    def times_error(values: Sequence[RepeatedValue]) -> float:
        """Root of sum ((u - mean u) / se)^2 / (n - 1) [-]."""
        u, error = np.array(values).T
        return float(np.sqrt(np.sum(((u - u.mean()) / error) ** 2) / (u.size - 1)))

    several = {place: times_error(some) for place, some in gathered.items() if len(some) > 1 and _stated(some)}
    place = max(several, key=several.__getitem__, default=None)
    if place is not None and several[place] > BEYOND_ERRORS:
        note = replace(note, apart=several[place], worst=(place[2], place[3]))
    return note


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


def without_repeats(
    points: MeasuredRows, keys: Sequence[tuple[object, ...]], errors: Array
) -> tuple[MeasuredRows, RepeatsAveraged]:
    """Each point once: u is the mean with its error, see `means_of_repeats`.

    v and w are means, u_std is the root of the mean square, and durations add up.

    Parameters
    ----------
    keys : sequence of tuple (rows,)
        Rows of equal keys are one.
    errors : ndarray (rows,)
        [m/s], NaN if not stated.

    Returns
    -------
    MeasuredRows
        As they were without repeats.
    RepeatsAveraged
    """
    rows: dict[tuple[object, ...], list[int]] = {}
    for row, key in enumerate(keys):
        rows.setdefault(key, []).append(row)
    if len(rows) == points.size:
        return points, RepeatsAveraged(0)
    u = points.numbers["u"]
    gathered = {key: [(float(u[row]), float(errors[row])) for row in some] for key, some in rows.items()}
    value, error = np.array(means_of_repeats(gathered)).T
    together = {
        role: np.array([how(points.numbers[role][some]) for some in rows.values()])
        for role, how in TOGETHER.items()
        if role in points.numbers
    }
    first = np.isin(np.arange(points.size), [some[0] for some in rows.values()])
    return points.only(first).having({"u": value, "u_se": error, **together}), note_on_repeats(gathered)


def refuse_confounded_replicates(taken: MeasuredRows, places: Sequence[Hashable], file: str) -> None:
    """Refuse repeats of a place that another column explains: a mean over them would mix two flows.

    Parameters
    ----------
    places : sequence (rows,)
        What is one if they are equal. A number of the repeat, or its time, makes no difference.
    file : str
        How the message begins.

    Raises
    ------
    InputError
        If velocities of one place differ with a column of no role, or the discharge, alike at many places.
    """
    columns: dict[str, Sequence[str]] = dict(taken.others)
    if (discharges := taken.numbers.get("discharge")) is not None:
        stated = ["" if np.isnan(one) else f"{one:g} m3/s" for one in discharges.tolist()]
        columns = {taken.columns["discharge"]: stated, **columns}
    for role in DOWNSTREAM:
        for heading, texts in columns.items() if role in taken.numbers else ():
            u = taken.numbers[role]
            rows = [row for row, text in enumerate(texts) if text.strip() and np.isfinite(u[row])]
            names = [texts[row] for row in rows]
            if _is_explained_by(u[rows], _numbered([places[row] for row in rows]), _numbered(names)):
                known = list(dict.fromkeys(names))
                more = [f"{len(known) - MOST_TEXTS} more"] if len(known) > MOST_TEXTS else []
                raise InputError(
                    f"{file}: expected repeats that differ by chance, got velocities that differ with {heading!r} "
                    f"({listed([*known[:MOST_TEXTS], *more])}); name it in `columns`, by what it holds "
                    "(`experiment`, `section`, `y`, `z`), or leave one of them in the file."
                )


def _numbered(keys: Sequence[Hashable]) -> NDArray[np.int64]:
    """A number for each key, the same for equal ones."""
    numbers = {key: number for number, key in enumerate(dict.fromkeys(keys))}
    return np.array([numbers[key] for key in keys], dtype=np.int64)


def _is_explained_by(u: Array, place: NDArray[np.int64], name: NDArray[np.int64]) -> bool:
    """Whether names explain what u (rows,) of one place differs by, beyond chance; place and name by their numbers.

    d = u - mean u of its place, e = mean d of its name; F = (sum e^2 / (names - 1)) / (sum (d - e)^2 / (rows - places -
    names + 1)), an analysis of variance in two ways without interaction (Scheffe 1959, The Analysis of Variance; not
    checked against it), exact if each name stands once at each place.
    """

    def means(values: Array, group: NDArray[np.int64]) -> Array:
        return np.asarray((np.bincount(group, values) / np.maximum(np.bincount(group), 1))[group])

    several = np.bincount(place)[place] > 1 if u.size else np.zeros(0, dtype=bool)
    u, place, name = u[several], place[several], name[several]
    names, places = (np.unique(one).size for one in (name, place))
    left = u.size - places - names + 1
    if names < 2 or left < 1:
        return False
    off = u - means(u, place)
    of_names = means(off, name)
    whole, explained, rest = (float(np.sum(part**2)) for part in (off, of_names, off - of_names))
    if explained < SHARE_OF_SCATTER * whole or explained < SHARE_OF_VELOCITY**2 * float(np.sum(u**2)):
        return False
    ratio = explained / (names - 1) / (rest / left) if rest > 0.0 else np.inf
    return bool(fdtrc(names - 1, left, ratio) < SIGNIFICANCE)
