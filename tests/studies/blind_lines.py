"""The lines of docs/blind.md: of which records each is counted, and which share is wanted."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import blind_definitions as what
import numpy as np
import scipy.stats
from blind_definitions import Record

from vegglue.arrays import Array

Answer = bool | None | list[bool]
Met = Callable[[Record], Answer]

NULL = ("null-perfect", "null-site")
NOISES = (
    ("white errors", "white"),
    ("neighbours correlated by 0.5", "ar1:0.5"),
    ("errors 1.5 times as stated", "understated:1.5"),
)  # fmt: skip
RATIOS = (("ratio 3", ("listed3",)), ("ratio 6", ("listed6",)))
LISTED, TWO = ("listed3", "listed6"), ("pair", "probe")
# Data sets that were looked at one by one when places were changed, or that a rule which was chosen after them changed:
# what is said of them is no proof of it.
LOOKED_AT = {
    *(f"second/twin/unlisted/{number}" for number in (*range(10), 11, 12, 13, 21, 39, 69, 80, 134, 142, 147, 152)),
    *(f"second/campaign/unlisted/{number}" for number in (*range(4), 6)),
}
# Bins of the stated chances, and the mean distance of what comes true that is wanted at most.
BINS, DISTANCE = 10, 0.05
# Draws of what chance makes of that distance: its ends to a tenth of a point.
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
    Line("Nothing hidden, perfect site: something named", ("null-perfect",), what.named, 0.07, True),
    Line("Nothing hidden, small imperfections: something named", ("null-site",), what.named, 0.07, True),
    Line("Nothing hidden: something named that is not there", NULL, what.false_named, 0.07, True),
    *(Line(f"Nothing hidden, {label}: something named", NULL, what.named, 0.07, True, noise)
      for label, noise in NOISES),
    *(Line(f"Nothing hidden, {label}: something that is not there", NULL, what.false_named, 0.07, True, noise)
      for label, noise in NOISES),
    Line("Nothing hidden: a station set aside", NULL, what.station_set_aside),
    *(Line(f"Listed effect in the set, {label}", groups, what.in_set, 0.9) for label, groups in RATIOS),
    *(Line(f"Something named, {label}", groups, what.named) for label, groups in RATIOS),
    *(Line(f"... the hidden effect among it, {label}", groups, what.in_steps) for label, groups in RATIOS),
    Line("At most three groups, ratio 3", ("listed3",), what.few_groups, 0.4),
    Line("... and the truth in them, ratio 3", ("listed3",), what.few_and_true),
    Line("At most three groups, ratio 6", ("listed6",), what.few_groups, 0.85),
    Line("... and the truth in them, ratio 6", ("listed6",), what.few_and_true),
    *(Line(f"A false name beside a true one, {label}", groups, what.false_beside_true, 0.05, True)
      for label, groups in (*RATIOS, ("unlisted object", ("unlisted",)), ("instrument off", ("instrument",)),
                            ("two things hidden", TWO))),
    *(Line(f"A wrong name alone, {label}", groups, what.wrong_alone, 0.02, True) for label, groups in RATIOS),
    Line("A name or an instrument alone for an unlisted object", ("unlisted",), what.wrong_for_object, 0.05, True),
    *(Line(f"Something named and nothing of it true, {label}", groups, what.only_false)
      for label, groups in (*RATIOS, ("unlisted object", ("unlisted",)), ("instrument off", ("instrument",)))),
    Line("Interval of an amplitude holds the true one", (*LISTED, *TWO), what.amplitudes_held, 0.9),
    Line("Unlisted object: none of these", ("unlisted",), what.none_of_these, 0.85),
    Line("... a place within 1.5 m of it, of all", ("unlisted",), what.place_near, 0.7),
    Line("... and with the right term, of all", ("unlisted",), what.right_term, 0.7),
    Line("... with the right term, of those within 1.5 m", ("unlisted",), what.right_term_if_near),
    Line("... a place within two of its stated standard errors, of places named", ("unlisted",), what.place_as_told),
    Line("Unlisted object not looked at: none of these", ("unlisted",), not_looked_at(what.none_of_these), 0.85),
    Line("... a place within 1.5 m of it", ("unlisted",), not_looked_at(what.place_near), 0.7),
    Line("... and with the right term", ("unlisted",), not_looked_at(what.right_term), 0.7),
    Line("... a place within 1.5 m of it, or told as the likeliest of several causes", ("unlisted",),
         not_looked_at(what.told_near)),
    Line("... a listed effect or an instrument told first", ("unlisted",), not_looked_at(what.known_first)),
    Line("... a name or an instrument alone for it", ("unlisted",), not_looked_at(what.wrong_for_object), 0.05, True),
    Line("Instrument off: named as an instrument", ("instrument",), what.instrument_found, 0.9),
    Line("... or some effect of instruments in the set", ("instrument",), what.sensor_in_set),
    Line("Two effects, ratio 6 each: both in the set", ("pair",), what.in_set),
    Line("A bad reading beside an effect: the effect in the set", ("probe",), what.in_set),
    Line("... the reading named as an instrument", ("probe",), what.instrument_found),
    Line("... or some station set aside", ("probe",), what.reading_set_aside),
    Line("Held-out error fell with what `extend --auto` kept", (), what.error_fell_as_kept, 0.95),
    Line("... with all that was named, where the verdict names", (), what.error_fell_where_said, 0.95),
    Line("... with all that was found, whatever the verdict", (), what.error_fell),
    Line("... with the true effect itself, where that was looked into", (), what.error_falls_with_truth),
    Line("As `extend --auto` leaves it: within 1.1 of the true effect", (), what.near_oracle_as_kept, 0.8),
    Line("... with all that was found: within 1.1 of it", (), what.near_oracle, 0.8),
    Line("Nothing missing, but held-out error over 1.3 of the noise", (), what.silent_beside_error, 0.0, True),
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
    return [
        one for one in records if one["truth"] == truth and case in ("", one["case"]) and "left_out" not in one
    ]  # fmt: skip


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
    """The interval reaches the figure; None where there is none, or no data."""
    if line.wanted is None or not size:
        return None
    low, high = interval(good, size)
    return low <= line.wanted if line.most else high >= line.wanted


def shares_that_reach(records: Sequence[Record]) -> tuple[int, int, int]:
    """Lines with a figure and data, those whose share reaches it, and those whose interval does."""
    counted = [(line, *counts(records, line)) for line in LINES if line.wanted is not None]
    known = [(line, good, size) for line, good, size in counted if size]
    alone = sum(good / size <= line.wanted if line.most else good / size >= line.wanted for line, good, size in known)
    return len(known), alone, sum(is_met(*one) is True for one in known)


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


def distances(told: Sequence[Told]) -> tuple[float, float] | None:
    """Mean distance of mean chance and share true over the bins, weighted by names and not; None without bins."""
    if not told:
        return None
    away = [abs(one.mean - one.true / one.count) for one in told]
    return float(np.average(away, weights=[one.count for one in told])), float(np.mean(away))


def distances_by_chance(told: Sequence[Told], off: float = 0.0) -> Array:
    """The first of `distances` (DRAWS,) where true shares lie `off` from what is told, to the side that was seen, or
    less where less was seen: few names are away from any chance.
    """
    count, mean = (np.array(each, dtype=float) for each in zip(*((one.count, one.mean) for one in told), strict=True))
    seen = np.array([one.true / one.count for one in told])
    share = np.clip(mean + np.clip(seen - mean, -off, off), 0.0, 1.0)
    true = np.random.default_rng(1).binomial(count.astype(int), share, (DRAWS, count.size))
    return np.average(np.abs(mean - true / count), axis=1, weights=count)


def first_named(record: Record) -> str:
    """What was accepted first, else the kind of thing that was found."""
    if record["steps"]:
        return str(record["steps"][0]["accepted"])
    return "(place)" if record["places"] else "(instrument)" if record["instruments"] else "(nothing)"


def hidden_and_named(records: Sequence[Record]) -> list[tuple[str, str]]:
    """The hidden listed effect and what was named first, at ratio 6."""
    return [
        (what.hidden_of(one, "listed")[0]["name"], first_named(one)) for one in records if one["group"] == "listed6"
    ]


def instead(records: Sequence[Record]) -> list[tuple[str, str, int, int, int]]:
    """Hidden at ratio 6, named first instead, how often, the truth among its rivals, and sets with it hidden."""
    chosen = [one for one in records if one["group"] == "listed6"]
    pairs = hidden_and_named(chosen)
    times: Counter[tuple[str, str]] = Counter()
    inside: Counter[tuple[str, str]] = Counter()
    for record, pair in zip(chosen, pairs, strict=True):
        if pair[1] not in what.truths(record) and pair[1] != "(nothing)":
            times[pair] += 1
            inside[pair] += any(pair[0] in step["rivals"] for step in record["steps"][:1])
    of = Counter(hidden for hidden, _ in pairs)
    rows = [(*pair, number, inside[pair], of[pair[0]]) for pair, number in times.items()]
    return sorted(rows, key=lambda row: (-row[2], row[0], row[1]))
