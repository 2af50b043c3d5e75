"""The lines of docs/blind.md: the records that each one counts, and the share that is wanted."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import blind_definitions as what
import numpy as np
import scipy.stats
from blind_definitions import Record

Answer = bool | None | list[bool]
Met = Callable[[Record], Answer]

NULL = ("null-perfect", "null-site")
NOISES = (
    ("white errors", "white"),
    ("neighbours correlated by 0.5", "ar1:0.5"),
    ("errors 1.5 times as stated", "understated:1.5"),
)
RATIOS = (("3 s.e.", ("listed3",)), ("6 s.e.", ("listed6",)))
LISTED, TWO = ("listed3", "listed6"), ("pair", "probe")
# Data sets that were looked at one by one when places were changed, or that a rule which was chosen after them changed:
# what is said of them is no proof of it.
LOOKED_AT = {
    *(f"second/twin/unlisted/{number}" for number in (*range(10), 11, 12, 13, 21, 39, 69, 80, 134, 142, 147, 152)),
    *(f"second/campaign/unlisted/{number}" for number in (*range(4), 6)),
}
# Fewest sets for a line to count as met. Chosen: of 19 sets without a failure the interval still reaches 18 %.
FEW_SETS = 20
# Bins of the stated probabilities, and the mean distance from the share that is true that is wanted at most.
BINS, DISTANCE = 10, 0.05
# Draws of what chance makes of that distance: its mean to a tenth of a point.
DRAWS = 20_000


@dataclass(frozen=True)
class Line:
    """One share: of records of these groups (all if empty) and errors (any if empty). most: `wanted` is at most so."""

    label: str
    groups: tuple[str, ...]
    met: Met
    wanted: float | None = None
    most: bool = False
    noise: str = ""


@dataclass(frozen=True)
class Told:
    """Names told at chances in one bin: their mean chance, how many, and how many came true."""

    low: float
    mean: float
    count: int
    true: int


def not_looked_at(met: Met) -> Met:
    """The same of data sets that were not looked at."""
    return lambda record: None if record["key"] in LOOKED_AT else met(record)


LINES: tuple[Line, ...] = (
    Line("Nothing hidden, exact site: something named", ("null-perfect",), what.named, 0.07, True),
    Line("Nothing hidden, imperfect site: something named", ("null-site",), what.named, 0.07, True),
    *(Line(f"Nothing hidden, {label}: something named", NULL, what.named, 0.07, True, noise)
      for label, noise in NOISES),
    Line("Nothing hidden: a false name", NULL, what.false_named, 0.07, True),
    *(Line(f"Listed effect, {label}: in the credible set", groups, what.in_set, 0.9) for label, groups in RATIOS),
    *(line for (label, groups), wanted in zip(RATIOS, (0.4, 0.85), strict=True) for line in (
        Line(f"Listed effect, {label}: the true effect named", groups, what.in_steps),
        Line(f"Listed effect, {label}: at most three groups", groups, what.few_groups, wanted),
        Line(f"Listed effect, {label}: at most three groups, with the true one", groups, what.few_and_true))),
    *(Line(f"Only a wrong name, listed effect, {label}", groups, what.wrong_alone, 0.02, True)
      for label, groups in RATIOS),
    *(Line(f"A false name beside a true one, {label}", groups, what.false_beside_true, 0.05, True)
      for label, groups in (*RATIOS, ("unlisted object", ("unlisted",)), ("instrument off", ("instrument",)),
                            ("two causes", TWO))),
    *(Line(f"Something named, all of it false, {label}", groups, what.only_false)
      for label, groups in (*RATIOS, ("unlisted object", ("unlisted",)))),
    Line("95 % interval of an amplitude contains the true one", (*LISTED, *TWO), what.amplitudes_held, 0.9),
    Line("Unlisted object: none of these", ("unlisted",), what.none_of_these, 0.85),
    Line("Unlisted object: a local anomaly within 1.5 m", ("unlisted",), what.place_near, 0.7),
    Line("Unlisted object: the same, with the right term", ("unlisted",), what.right_term, 0.7),
    Line("Unlisted object: anomaly within two stated s.e.", ("unlisted",), what.place_as_told),
    Line("Unlisted object, not inspected: none of these", ("unlisted",), not_looked_at(what.none_of_these), 0.85),
    Line("Unlisted object, not inspected: a local anomaly within 1.5 m", ("unlisted",),
         not_looked_at(what.place_near), 0.7),
    Line("Unlisted object, not inspected: the same, with the right term", ("unlisted",),
         not_looked_at(what.right_term), 0.7),
    Line("Unlisted object, not inspected: a listed effect or an instrument first", ("unlisted",),
         not_looked_at(what.known_first)),
    Line("Unlisted object, not inspected: only an effect or instrument", ("unlisted",),
         not_looked_at(what.wrong_for_object), 0.05, True),
    Line("Instrument off: named as an instrument", ("instrument",), what.instrument_found, 0.9),
    Line("Two effects, 6 s.e. each: both in the credible set", ("pair",), what.in_set),
    Line("Bad reading beside an effect: effect in the credible set", ("probe",), what.in_set),
    Line("Bad reading beside an effect: reading excluded", ("probe",), what.instrument_found),
    Line("Held-out error lower with what `extend --auto` kept", (), what.error_fell_as_kept, 0.95),
    Line("Held-out error lower with all that was named", (), what.error_fell_where_said, 0.95),
    Line("Held-out error lower with the true effect itself", (), what.error_falls_with_truth),
    Line("After `extend --auto`: within 1.1 of the true effect's error", (), what.near_oracle_as_kept, 0.8),
    Line("`nothing-missing`, but held-out error over 1.3 of the expected", (), what.silent_beside_error, 0.0, True),
)  # fmt: skip


def interval(successes: int, trials: int) -> tuple[float, float]:
    """95 % interval of a share (Clopper and Pearson 1934, doi:10.1093/biomet/26.4.404)."""
    if trials == 0:
        return 0.0, 1.0
    low = scipy.stats.beta.ppf(0.025, successes, trials - successes + 1) if successes else 0.0
    high = scipy.stats.beta.ppf(0.975, successes + 1, trials - successes) if successes < trials else 1.0
    return float(low), float(high)


def made(records: Sequence[Record], truth: str, case: str = "") -> list[Record]:
    """Data sets that were made of one truth, in one case or in all."""
    return [one for one in records if one["truth"] == truth and case in ("", one["case"]) and "left_out" not in one]


def counts(records: Sequence[Record], line: Line) -> tuple[int, int]:
    """Met, and of how many."""
    good = size = 0
    for record in records:
        if (line.groups and record["group"] not in line.groups) or line.noise not in ("", record["noise"]):
            continue
        answer = line.met(record)
        answers = answer if isinstance(answer, list) else [] if answer is None else [answer]
        good, size = good + sum(answers), size + len(answers)
    return good, size


def is_met(line: Line, good: int, size: int) -> bool | None:
    """Whether the share itself reaches the target, whatever its interval; None without a target or data."""
    if line.wanted is None or not size:
        return None
    return good / size <= line.wanted if line.most else good / size >= line.wanted


def targets_met(records: Sequence[Record]) -> tuple[int, int]:
    """Lines with a target and data, and how many of them are met, in FEW_SETS sets or more."""
    counted = [(line, *counts(records, line)) for line in LINES if line.wanted is not None]
    known = [one for one in counted if one[2]]
    return len(known), sum(is_met(*one) is True and one[2] >= FEW_SETS for one in known)


def chances_told(records: Sequence[Record]) -> list[Told]:
    """What first steps told, by bins of the chance, where one listed effect is hidden and nothing else."""
    pairs = [
        (chance, name in what.truths(record))
        for record in records
        if record["steps"] and [one["kind"] for one in record["hidden"]] == ["listed"]
        for name, chance in zip(record["steps"][0]["rivals"], record["steps"][0]["chances"], strict=True)
    ]
    found = []
    for number in range(BINS):
        here = [(chance, true) for chance, true in pairs if min(int(BINS * chance), BINS - 1) == number]
        if here:
            mean = float(np.mean([chance for chance, _ in here]))
            found.append(Told(number / BINS, mean, len(here), sum(true for _, true in here)))
    return found


def distance(told: Sequence[Told]) -> float:
    """Mean distance of stated probability and share that is true over the bins, weighted by hypotheses [-]."""
    return float(
        np.average([abs(one.mean - one.true / one.count) for one in told], weights=[one.count for one in told])
    )


def distance_by_chance(told: Sequence[Told]) -> float:
    """Mean of the same if all stated probabilities are right: few hypotheses are away from any probability."""
    count, mean = (np.array(each, dtype=float) for each in zip(*((one.count, one.mean) for one in told), strict=True))
    true = np.random.default_rng(1).binomial(count.astype(int), mean, (DRAWS, count.size))
    return float(np.average(np.abs(mean - true / count), axis=1, weights=count).mean())
