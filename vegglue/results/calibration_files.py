"""Cases and ensembles in the files of other calibration programs: PEST++ and SPOTPY, by names that both keep.

PEST++ turns names to lower case and sorts them; PEST takes 12 letters for a parameter or a group and 20 for an
observation. Names here keep within both, so that a file that went through either is matched by name.
"""

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.parameter_space import FURTHEST, quantile
from vegglue.case.schema import Case, Parameter
from vegglue.case.size_limits import LARGEST_DATA
from vegglue.case.text_files import read_text, write_text
from vegglue.errors import InputError, shown_path
from vegglue.flow.status import FAILED
from vegglue.results.ensemble import Ensemble
from vegglue.wording.remedies import MAKE_ROOM

LONGEST_PARAMETER, LONGEST_OBSERVATION = 12, 20
# Heading of the column that names members, as pyemu and PEST++ write it.
MEMBER = "real_name"
# Width of a number in a template: a sign, 17 digits, a point and an exponent.
FIELD = 24
LOG_PRIORS = ("loguniform", "lognormal")


def pest_names(names: Iterable[str], longest: int = LONGEST_PARAMETER) -> dict[str, str]:
    """Distinct names of letters a-z, 0-9 and _.

    Parameters
    ----------
    longest : int
        Letters at most.

    Returns
    -------
    dict of str
        By the names that they stand for.
    """
    found: dict[str, str] = {}
    for name in names:
        plain = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_") or "x"
        taken, number = set(found.values()), 1
        short = plain[:longest]
        while short in taken:
            number += 1
            short = f"{plain[: longest - len(str(number))]}{number}"
        found[name] = short
    return found


def observation_names(station: pd.DataFrame) -> list[str]:
    """o00012_low_d3 of the row 12 in experiment low and section D3: sorted, they are in the order of the table."""
    width = max(4, len(str(len(station))))
    found = []
    for row, (experiment, section) in enumerate(zip(station["experiment"], station["section"], strict=True)):
        words = re.sub(r"[^a-z0-9]+", "_", f"{experiment}_{section}".lower()).strip("_")
        found.append(f"o{row:0{width}d}_{words}"[:LONGEST_OBSERVATION].rstrip("_"))
    return found


def write_pest(
    folder: Path,
    case: Case,
    station: pd.DataFrame,
    command: str,
    predictions: str,
    ensembles: Mapping[str, tuple[Mapping[str, Array], Array | None]],
) -> list[Path]:
    """Write a control file, a template, instructions, standard deviations and ensembles for PEST++.

    Parameters
    ----------
    station : DataFrame
        Rows with a value. Their weight is one over the standard error, 0 if they are not used or it is unknown.
    command : str
        Reads the file of parameters and writes that of predictions.
    predictions : str
        The file that the command writes, seen from the folder.
    ensembles : mapping of str to (mapping of str to ndarray (member,), ndarray (member, station) or None)
        Parameters and predictions of members by the name of their files, `prior` among them.

    Returns
    -------
    list of Path
        The control file first.

    Raises
    ------
    StorageError
        If a file cannot be written.
    """
    names, observed = pest_names(case.parameters), observation_names(station)
    groups = pest_names(dict.fromkeys(station["kind"]))
    weights = weights_of(station)
    texts: dict[str, str] = {}
    for name, (theta, prediction) in ensembles.items():
        texts[f"{name}.csv"] = ensemble_table({names[one]: theta[one] for one in case.parameters})
        if prediction is not None:
            columns = dict(zip(observed, prediction.T, strict=True))
            texts[f"{name}_obs.csv"] = ensemble_table(columns)
    members = len(next(iter(ensembles["prior"][0].values())))
    options = {"parcov": f"{case.name}.unc", "ies_parameter_ensemble": "prior.csv", "ies_num_reals": members}
    rows, spread = [], []
    for name, prior in case.parameters.items():
        low, high = bounds_of(prior)
        transform = "log" if prior.distribution in LOG_PRIORS else "none"
        change = "factor" if low > 0.0 else "relative"  # a factor never changes the sign
        middle = float(quantile(prior, 0.5))
        rows.append(f"{names[name]} {transform} {change} {middle!r} {low!r} {high!r} parameters 1.0 0.0 1")
        spread.append(f"{names[name]} {standard_deviation(prior)!r}")
    data = [
        f"{name} {float(value)!r} {float(weight)!r} {groups[kind]}"
        for name, value, weight, kind in zip(observed, station["value"], weights, station["kind"], strict=True)
    ]
    control = [
        "pcf",
        "* control data",
        "restart estimation",
        f"{len(rows)} {len(data)} 1 0 {len(groups)}",
        "1 1 double point 1 0 0",
        "10.0 -3.0 0.3 0.03 10",
        "10.0 10.0 0.001",
        "0.1",
        "3 0.005 4 4 0.005 4",
        "0 0 0",
        "* parameter groups",
        "parameters relative 0.01 0.0 switch 2.0 parabolic",
        "* parameter data",
        *rows,
        "* observation groups",
        *groups.values(),
        "* observation data",
        *data,
        "* model command line",
        command,
        "* model input/output",
        "parameters.tpl parameters.csv",
        f"predictions.ins {predictions}",
        *(f"++{key}({value})" for key, value in options.items()),
        "",
    ]
    fields = [f"~{names[one]:^{FIELD - 2}}~" for one in case.parameters]
    texts |= {
        f"{case.name}.unc": "\n".join(["START STANDARD_DEVIATION", *spread, "END STANDARD_DEVIATION", ""]),
        "parameters.tpl": "\n".join(["ptf ~", ",".join([MEMBER, *names.values()]), ",".join(["0", *fields]), ""]),
        # The heading and the number of the member are passed by; then a number after each comma.
        "predictions.ins": "\n".join(["pif ~", "l1", " ".join(["l1", *(f"~,~ !{one}!" for one in observed)]), ""]),
        "names.csv": names_table(case, names, station, observed),
    }
    files = {folder / f"{case.name}.pst": "\n".join(control)} | {folder / name: text for name, text in texts.items()}
    for path, text in files.items():
        write_text(path, text, MAKE_ROOM)
    return list(files)


def weights_of(station: pd.DataFrame) -> Array:
    """1 / standard error of each row that is used and states one, else 0 (station,) [1 / unit of the kind]."""
    error = station["standard_error"].to_numpy(float)
    known = station["used"].to_numpy(bool) & np.isfinite(error) & (error > 0.0)
    return np.where(known, 1.0 / np.where(known, error, 1.0), 0.0)


def bounds_of(prior: Parameter) -> tuple[float, float]:
    """Bounds of a prior for programs that need them.

    Returns
    -------
    float, float
        Low and high [its unit]; of an unbounded side the value that z = -FURTHEST or FURTHEST leads to.
    """
    from scipy.special import ndtr

    low, high = (
        float(quantile(prior, share)) if end is None else float(end)
        for end, share in ((prior.low, ndtr(-FURTHEST)), (prior.high, ndtr(FURTHEST)))
    )
    return low, high


def standard_deviation(prior: Parameter) -> float:
    """Of the prior, of its log10 if PEST++ is to estimate that; of a uniform one a quarter of its 95 % range."""
    low, high = np.asarray(quantile(prior, [0.025, 0.975]))
    return float(0.25 * (np.log10(high / low) if prior.distribution in LOG_PRIORS else high - low))


def ensemble_table(columns: Mapping[str, Array], members: NDArray[np.int64] | None = None) -> str:
    """CSV with one row for each member, as pyemu and PEST++ read ensembles; members: their numbers, if not 0, 1, ..."""
    rows = np.column_stack(list(columns.values()))
    numbers = range(len(rows)) if members is None else members.tolist()
    members_of_rows = zip(numbers, rows.tolist(), strict=True)
    return csv_text([MEMBER, *columns], ([one, *map(repr, row)] for one, row in members_of_rows))


def names_table(case: Case, names: Mapping[str, str], station: pd.DataFrame, observed: Sequence[str]) -> str:
    """CSV: what each short name stands for, with its unit, or the place and time of a station."""
    of_parameters = [["parameter", names[name], name, one.unit, "", ""] for name, one in case.parameters.items()]
    of_stations = [
        ["observation", short, f"{row.experiment} {row.section} {row.kind}".strip(), "", row.x, row.y]
        for short, row in zip(observed, station.itertuples(), strict=True)
    ]
    return csv_text(["what", "name", "stands for", "unit", "x [m]", "y [m]"], [*of_parameters, *of_stations])


def write_spotpy(
    path: Path, names: Mapping[str, str], theta: Mapping[str, Array], prediction: Array, like: Array, chain: Array
) -> None:
    """Write members as SPOTPY's CSV database, which `spotpy.analyser.load_csv_results` reads: like1, one column for
    each parameter (par...), one for each station (simulation_...), and chain.

    Parameters
    ----------
    names : mapping of str to str
        Of the columns, by parameter.
    theta : mapping of str to (member,)
        By parameter [its unit].
    prediction : (member, station)
        [unit of the kind]
    like, chain : (member,)
        Log-likelihood [-], and number of the chain.
    """
    heading = ["like1", *(f"par{names[one]}" for one in theta)]
    heading += [*(f"simulation_{number}" for number in range(prediction.shape[1])), "chain"]
    rows = np.column_stack([like, *theta.values(), prediction])
    numbers = ([*map(repr, row), int(one)] for row, one in zip(rows.tolist(), chain, strict=True))
    write_text(path, csv_text(heading, numbers), MAKE_ROOM)


def write_evaluation(path: Path, station: pd.DataFrame) -> None:
    """Write the measurements that the columns simulation_0, simulation_1, ... of a database are compared with."""
    names, weights = observation_names(station), weights_of(station)
    table = zip(names, station["value"].astype(float), weights, station["kind"], strict=True)
    rows = [[f"simulation_{number}", name, repr(value), weight, kind] for number, (name, value, weight, kind) in
            enumerate(table)]  # fmt: skip
    write_text(path, csv_text(["column", "name", "value", "weight", "kind"], rows), MAKE_ROOM)


def log_likelihood(station: pd.DataFrame, prediction: Array) -> Array:
    """ln L = -1/2 sum of (w (y - f))^2 + ln 2 pi - 2 ln w

    Parameters
    ----------
    station : DataFrame
        y; w is 1 over the standard error of those that are used and state one, others do not count.
    prediction : ndarray (member, station)
        f [unit of each station].

    Returns
    -------
    ndarray (member,)
        [-]
    """
    weight = weights_of(station)
    counted = weight > 0.0
    w, residual = weight[counted], (station["value"].to_numpy(float) - prediction)[:, counted]
    return np.asarray(-0.5 * ((w * residual) ** 2 + np.log(2 * np.pi) - 2.0 * np.log(w)).sum(axis=1))


def solved_rows(ensemble: Ensemble) -> NDArray[np.int64]:
    """Numbers of the members that have predictions (member,)."""
    return np.flatnonzero(ensemble.status != FAILED)


def read_parameters(path: Path, case: Case) -> dict[str, Array]:
    """Members of a CSV with one row each: a column for each parameter, by its name, or that of `pest_names` in any
    case, and at most one that names the members.

    Returns
    -------
    dict of str to (member,)
        By parameter [its unit].

    Raises
    ------
    InputError
        For a missing, doubled or unknown column, and for a value that is none or outside the bounds of its prior.
    """
    shown = shown_path(path)
    try:
        heading, *lines = list(csv.reader(io.StringIO(read_text(path, LARGEST_DATA)))) or [[]]
    except csv.Error as error:  # of a NUL, or a cell without end
        raise InputError(f"{shown}: expected a table of numbers in CSV, got none ({error}); export it again.") from None
    columns, short = [word.strip() for word in heading], pest_names(case.parameters)
    if {one.lower() for one in columns} >= set(short.values()):  # through PEST++, which knows lower case alone
        columns, called = [one.lower() for one in columns], short
    else:
        called = {name: name for name in case.parameters}
    wrong = next((name for name, column in called.items() if columns.count(column) != 1), None)
    if wrong is not None:
        raise InputError(
            f"{shown}, row 1: expected one column for each parameter, got {columns.count(called[wrong])} for {wrong}; "
            "correct the heading."
        )
    others = [one for one in columns if one not in called.values()]
    if len(others) > 1:
        raise InputError(
            f"{shown}, row 1: expected {', '.join(called.values())} and one column that names members, got "
            f"{', '.join(others)}, too; remove what is no parameter."
        )
    members = [(row, line) for row, line in enumerate(lines, 2) if line]
    if not members:
        raise InputError(f"{shown}: expected rows below the heading, got none.")
    found: dict[str, Array] = {}
    for name, prior in case.parameters.items():
        (low, high), place = bounds_of(prior), columns.index(called[name])
        values = []
        for row, line in members:
            text = line[place].strip() if place < len(line) else ""
            try:
                value = float(text)
            except ValueError:
                raise InputError(
                    f"{shown}, row {row}: expected a number for {name}, got {text!r}; correct it."
                ) from None
            if not low <= value <= high:
                raise InputError(
                    f"{shown}, row {row}: expected {name} from {low:g} to {high:g}, the bounds of its prior, got "
                    f"{value:g}; correct the row, or the prior."
                )
            values.append(value)
        found[name] = np.array(values)
    return found


def csv_text(heading: Sequence[str], rows: Iterable[Iterable[Any]]) -> str:
    """A table as CSV."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([heading, *rows])
    return text.getvalue()
