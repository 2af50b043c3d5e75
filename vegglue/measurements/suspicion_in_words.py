"""What is suspicious about measured values, in sentences: where, what, and what to do."""

import pandas as pd

from vegglue.measurements.kinds import kind_of
from vegglue.measurements.plausible_flow import PlausibleFlow

# Names of sections told before the rest is counted.
TOLD = 3
CHECK_ALL = "check the unit of these values, and the discharge and outlet level of the experiment"
CHECK_LEVEL = "check the datum and the unit of these values, and the outlet level of the experiment"
# By the first word of a problem: what is said of it, with {times} as judged, and what to do.
CLAUSES = {
    "mark": ("this marks a missing value and is no measurement", "take the row out of the file"),
    "alone": (
        "{times} times the discharge over the wet area there, beyond any thread of the flow",
        "correct it, or take the row out of the file",
    ),
    "fast": ("on average {times} times the discharge over the wet area there{unit}", CHECK_ALL),
    "slow": ("at most {times} times the discharge over the wet area there", CHECK_ALL),
    "level": ("{times} m from the outlet level{unit}", CHECK_LEVEL),
    "datum": ("all about {times} m from the outlet level, as from another datum", CHECK_LEVEL),
    "bed": ("{times} m below the lowest bed of the section", CHECK_LEVEL),
    "high": ("{times} m above the outlet level, more than the densest growth holds up", CHECK_LEVEL),
    "low": ("{times} m below the outlet level, more than half the depth there", CHECK_LEVEL),
    "much": ("{times} times the stated discharge{unit}", CHECK_ALL),
    "little": ("{times} times the smallest stated discharge", CHECK_ALL),
    "small": (
        "a standard error of {times} {of_kind} is smaller than any instrument's",
        "check the unit of the errors, or leave them out",
    ),
    "large": (
        "a standard error of {times} {of_kind} is so large that the values tell nothing",
        "check the unit of the errors",
    ),
}


def suspicions_in_words(judged: pd.DataFrame, used: pd.DataFrame) -> list[str]:
    """One sentence for each kind of observation and problem.

    judged: rows of the table of stations, with columns `problem` (a key of CLAUSES, perhaps followed by a unit) and
    `times` (by how much); used: all rows that were looked at.
    """
    return [
        _sentence(str(problem), rows, used[used["kind"] == kind])
        for (kind, problem), rows in judged.groupby(["kind", "problem"], sort=False)
    ]


def outlet_in_words(experiment: str, flow: PlausibleFlow) -> str:
    """That the outlet of an experiment would be deeper than channels are, or its water all but stand."""
    return (
        f"The outlet level of experiment {experiment}, {_rounded(0.5 * sum(flow.level))} m, makes the outlet "
        f"{_rounded(flow.depth)} m deep on a grid {_rounded(flow.width)} m wide, where the water moves at "
        f"{_rounded(float(flow.fastest[-1]))} m/s; check its unit and its datum, and the unit of the discharge."
    )


def _sentence(problem: str, rows: pd.DataFrame, of_kind: pd.DataFrame) -> str:
    word, _, unit = problem.partition(" ")
    clause, advice = CLAUSES[word]
    kind = kind_of(str(rows["kind"].iloc[0]))
    times, as_if = _rounded(abs(float(rows["times"].median()))), f", as if it were in {unit}" if unit else ""
    said = clause.format(times=times, unit=as_if, of_kind=kind.unit)
    first = rows.iloc[0]
    at = f"x = {first['x']:g}, y = {first['y']:g} m" if kind.at_point else f"x = {first['x']:g} m"
    value = f"{first['value']:.6g} {kind.unit} at {at}"
    if len(rows) == 1:
        return f"The {kind.words} {value} ({_whose(rows, of_kind)}): {said}; {advice}."
    return f"{len(rows)} values of {kind.words} ({_whose(rows, of_kind)}; the first {value}): {said}; {advice}."


def _rounded(value: float) -> str:
    """Two digits, but all of those before the point: 0.013, 9.2, 106."""
    return f"{value:.0f}" if 10.0 <= abs(value) < 1e6 else f"{value:.2g}"


def _whose(rows: pd.DataFrame, of_kind: pd.DataFrame) -> str:
    """`section A of experiment low`, `all of experiment low`, `all there are`."""
    if len(rows) == len(of_kind) > 1:
        return "all there are"
    noun = "gauge" if kind_of(str(of_kind["kind"].iloc[0])).instrument == "gauge" else "section"
    names = []
    for experiment, here in rows.groupby("experiment", sort=False):
        sections = [str(name) for name in here["section"].unique() if name]
        if len(here) == int((of_kind["experiment"] == experiment).sum()) > 1 and len(sections) != 1:
            names.append(f"all of experiment {experiment}")
        else:
            names += [f"{noun} {name} of experiment {experiment}" for name in sections] or [f"experiment {experiment}"]
    more = f" and {len(names) - TOLD} more" if len(names) > TOLD else ""
    return ", ".join(names[:TOLD]) + more
