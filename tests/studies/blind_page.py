"""docs/blind.md and its figures from the records of the study; `blind_definitions` says what counts as what."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from blind_definitions import Record, error_of, none_of_these
from blind_figures import TRUTHS, draw_chances, draw_confusion, draw_held_out, draw_shares
from blind_lines import (
    BINS,
    DISTANCE,
    LINES,
    Line,
    Told,
    chances_told,
    counts,
    distances,
    distances_by_chance,
    instead,
    interval,
    is_met,
    made,
    shares_that_reach,
)
from blind_text import AFFORDED, IDEAL, PAGE

from vegglue.figures.style import save

# Fewest sets of which a line is said to be met. Chosen: of 19 without a failure the interval still reaches 18 %.
FEW_SETS = 20
CASES = {"twin": "the small channel", "campaign": "the field campaign"}
ROWS = 30
# Of objects, by how long they are in the stranger's flow.
THIRDS = ("of the shortest third", "of the middle third", "of the longest third")


def write_page(
    records: Sequence[Record],
    folder: Path,
    planned: Mapping[tuple[str, str], int],
    lengths: Mapping[str, float],
    limits: Mapping[str, float],
    ideal: Mapping[str, Mapping[str, float]],
) -> None:
    """blind.md with its tables, and blind-*.svg beside it; planned: data sets by truth and case. By the keys of sets
    with an object: lengths, how long it is in the flow of the stranger [standard errors]; limits, how often its place
    could be told in a model that is right but for it [-]; ideal, how often it would be told there, see `object_limits`.
    """
    sets = {truth: made(records, truth) for truth in TRUTHS}
    told = {truth: chances_told(chosen) for truth, chosen in sets.items()}
    lines, alone, reached = shares_that_reach(sets["second"])
    nothing = [one for one in sets["second"] if one["group"].startswith("null")]
    text = PAGE.format(
        lines=lines, alone=alone, reached=reached,
        lengths=_lengths(sets["second"], lengths), limits=_limits(limits), ideal=_ideal(ideal),
        kept=_kept(sets["second"]),
        sized=_case_table([one for one in sets["second"] if one.get("sized") == "truth"]),
        sizes=_sizes(records, planned), left_out=_left_out(records), afforded=AFFORDED, main=_main_table(sets),
        chances=_chances(told), distances=_distances(told), instead=_instead(sets["second"]),
        unheard=sum(one["verdict"] == "nothing-missing" for one in nothing), nothing=len(nothing),
        silent=sum(not one["steps"] and not one["places"] for one in sets["second"] if one["group"] == "listed6"),
        **{case: _case_table(made(records, "second", case)) for case in CASES},
    )  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "blind.md").write_text(text, encoding="utf-8")
    shares = [(line, {truth: counts(chosen, line) for truth, chosen in sets.items()}) for line in LINES]
    for name, figure in (
        ("shares", draw_shares([pair for pair in shares if any(size for _, size in pair[1].values())])),
        ("chances", draw_chances(told)),
        ("held-out", draw_held_out(sets)),
        ("confusion", draw_confusion(sets["second"])),
    ):
        save(figure, folder / f"blind-{name}.svg")


def _lengths(records: Sequence[Record], lengths: Mapping[str, float]) -> str:
    """How long objects are in the stranger's own flow, and what is told of each third of them."""
    objects = sorted((one for one in records if one["key"] in lengths), key=lambda one: lengths[one["key"]])
    if len(objects) < len(THIRDS):
        return ""
    values = [lengths[one["key"]] for one in objects]
    thirds = np.array_split(np.arange(len(objects)), len(THIRDS))
    told = [
        f"{sum(none_of_these(objects[j]) for j in some)} of {some.size} {words} ({values[some[0]]:.1f} to "
        f"{values[some[-1]]:.1f})"
        for words, some in zip(THIRDS, thirds, strict=True)
    ]
    return (
        "An object is made as large as makes it six standard errors long in the model's own equations. In the "
        f"stranger's, whose mixing and friction are others, the same object is {values[0]:.1f} to {values[-1]:.1f} "
        f"long, {float(np.median(values)):.1f} at the median of {len(values)} in the small channel "
        f'(`tests/studies/blind_lengths.py`). "None of these" is told of {", ".join(told)}.'
    )


def _limits(limits: Mapping[str, float]) -> str:
    """How often places could be told at most."""
    if not limits:
        return ""
    share = percent(float(np.mean(list(limits.values()))))
    return (
        f"Were the model right but for the object, and its kind and width known, the likeliest place would lie within "
        f"1.5 m of the true one in {share} of draws of the errors, over {len(limits)} objects six standard errors long "
        "(`tests/studies/place_limits.py`)."
    )


def _ideal(shares: Mapping[str, Mapping[str, float]]) -> str:
    """How often objects would be told in a model that is right but for them, by the rules of a diagnosis."""
    groups = {
        group: [one for key, one in shares.items() if f"/{group}/" in key]
        for group in ("unlisted", "listed6", "listed3")
    }
    if not all(groups.values()):
        return ""

    def mean(name: str, group: str = "unlisted") -> str:
        return percent(float(np.mean([one[name] for one in groups[group]])))

    return IDEAL.format(
        objects=len(groups["unlisted"]), told=mean("told"), near=mean("near"), guessed=mean("guessed"),
        evenly=mean("evenly"), effects=len(groups["listed6"]) + len(groups["listed3"]),
        evenly6=mean("evenly", "listed6"), evenly3=mean("evenly", "listed3"),
        told6=mean("told", "listed6"), told3=mean("told", "listed3"),
    )  # fmt: skip


def _kept(records: Sequence[Record]) -> str:
    """By how much held-out errors change with what is kept, at the median, and of those that rise."""
    known = [(error_of(one, "parent"), error_of(one, "kept")) for one in records]
    change = np.array([kept / parent - 1.0 for parent, kept in known if parent is not None and kept is not None])
    rising = change[change >= 0.0]
    if not rising.size:
        return ""
    median, of_rising, most = (percent(float(each)) for each in (np.median(change), np.median(rising), rising.max()))
    return (
        f"At the median of the {change.size} errors change by {median}; of the {rising.size} that rise, by "
        f"{of_rising}, and by {most} at most."
    )


def percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def ends_of(good: int, size: int) -> str:
    """The interval of a share in words."""
    low, high = interval(good, size)
    return f"{100 * low:.1f} to {percent(high)}"


def wanted_of(line: Line) -> str:
    if line.wanted is None:
        return "-"
    if line.wanted == 0.0:
        return "never"
    return f"at {'most' if line.most else 'least'} {100 * line.wanted:.0f} %"


def _answer(line: Line, good: int, size: int) -> str:
    if line.wanted is not None and 0 < size < FEW_SETS and is_met(line, good, size):
        return "too few"
    return {True: "yes", False: "no", None: "-"}[is_met(line, good, size)]


def _main_table(sets: dict[str, list[Record]]) -> str:
    """Lines that were studied at all, both truths side by side."""
    rows = [
        "| | wanted | met | of | share | 95 % interval | met? | own equations: share (of) |",
        "|---|---|---:|---:|---:|---:|---|---:|",
    ]
    for line in LINES:
        good, size = counts(sets["second"], line)
        own, owned = counts(sets["own"], line)
        beside = f"{percent(own / owned)} ({owned})" if owned else "-"
        share = f"{good} | {size} | {percent(good / size)} | {ends_of(good, size)}" if size else "- | 0 | - | -"
        if size or owned:
            rows.append(f"| {line.label} | {wanted_of(line)} | {share} | {_answer(line, good, size)} | {beside} |")
    return "\n".join(rows)


def _case_table(records: Sequence[Record]) -> str:
    """Lines that were studied in one case, of one truth."""
    rows = ["| | wanted | share (of) | 95 % interval | met? |", "|---|---|---:|---:|---|"]
    for line in LINES:
        good, size = counts(records, line)
        if size:
            share = f"{percent(good / size)} ({size}) | {ends_of(good, size)}"
            rows.append(f"| {line.label} | {wanted_of(line)} | {share} | {_answer(line, good, size)} |")
    return "\n".join(rows)


def _sizes(records: Sequence[Record], planned: Mapping[tuple[str, str], int]) -> str:
    """How many data sets there are of each truth in each case, and what a diagnosis took."""
    rows = [
        "| truth | case | planned | data sets | left out | seconds of one core (median) |",
        "|---|---|---:|---:|---:|---:|",
    ]
    for (truth, case), size in planned.items():
        chosen = made(records, truth, case)
        known = [one["seconds"] for one in chosen if one.get("seconds") is not None]
        out = sum("left_out" in one for one in records if (one["truth"], one["case"]) == (truth, case))
        took = f"{np.median(known):.0f}" if known else "-"
        rows.append(f"| {TRUTHS[truth][0]} | {CASES[case]} | {size} | {len(chosen)} | {out} | {took} |")
    return "\n".join(rows)


def _left_out(records: Sequence[Record]) -> str:
    """Names of what could not be seen, and other reasons with their counts."""
    names: set[str] = set()
    others: Counter[str] = Counter()
    for record in records:
        if "left_out" in record:
            found = re.match(r"(?:--hide )?(\S+): at no plausible size", record["left_out"])
            names.update(found[1].split(",") if found else ())
            others.update([] if found else [record["left_out"].partition(":")[0]])
    told = "Left out, since the data would not show them at any plausible size: {}.".format(
        ", ".join(f"`{name}`" for name in sorted(names)) or "none"
    )
    if others:
        told += " Left out for other reasons: " + "; ".join(f"{why} ({size})" for why, size in others.items()) + "."
    return told


def _chances(told: dict[str, list[Told]]) -> str:
    """How often what a first step tells at some chance is true."""
    rows = [
        "| told at | mean | names | true | share | 95 % interval | own equations: mean, share (names) |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    bins = {truth: {one.low: one for one in found} for truth, found in told.items()}
    for number in range(BINS):
        second, own = (bins[truth].get(number / BINS) for truth in ("second", "own"))
        cells = "- | 0 | - | - | -"
        if second:
            share = f"{percent(second.true / second.count)} | {ends_of(second.true, second.count)}"
            cells = f"{percent(second.mean)} | {second.count} | {second.true} | {share}"
        beside = f"{percent(own.mean)}, {percent(own.true / own.count)} ({own.count})" if own else "-"
        if second or own:
            low, high = 100 * number // BINS, 100 * (number + 1) // BINS
            rows.append(f"| {low} to {high} % | {cells} | {beside} |")
    return "\n".join(rows)


def _distances(told: dict[str, list[Told]]) -> str:
    """Mean distance of the chances from what came true, in points."""
    rows = [
        f"| mean distance over the bins, at most {100 * DISTANCE:.0f} points wanted | weighted by names | unweighted "
        f"| weighted, were all chances right | ... were shares {100 * DISTANCE:.0f} points off: up to | met? |",
        "|---|---:|---:|---:|---:|---|",
    ]
    for truth, (label, _) in TRUTHS.items():
        away = distances(told[truth])
        if away is not None:
            right = np.mean(distances_by_chance(told[truth]))
            most = np.quantile(distances_by_chance(told[truth], DISTANCE), 0.95)
            cells = (f"{100 * each:.1f} points" for each in (*away, right, most))
            rows.append(f"| {label} | {' | '.join(cells)} | {'yes' if away[0] <= most else 'no'} |")
    return "\n".join(rows)


def _instead(records: Sequence[Record]) -> str:
    """What was named first instead of the hidden effect, the most common first."""
    rows = [
        "| hidden | named first | times | hidden effect beside it | sets with it hidden |",
        "|---|---|---:|---:|---:|",
    ]
    for hidden, said, times, inside, size in instead(records)[:ROWS]:
        rows.append(f"| `{hidden}` | {said if said.startswith('(') else f'`{said}`'} | {times} | {inside} | {size} |")
    return "\n".join(rows)
