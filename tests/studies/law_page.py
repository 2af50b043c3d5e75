"""The numbers of docs/discover.md from the records of the study of laws."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from blind_lines import FEW_SETS, interval
from law_answers import (
    Record,
    has_quantity,
    is_silent,
    law_says_term,
    near_truth,
    quantity_alone,
    says_term,
    told_near_truth,
)
from law_limits import chance_lines, told_at_most
from law_sets import law_trials

BEGIN, END = "<!-- numbers by make laws -->", "<!-- end of numbers -->"
GROUPS = {"law": "a law hidden", "nothing": "nothing hidden", "listed": "a listed effect hidden"}
# What is wanted of each group: label, least share, whether a record has it.
LINES: tuple[tuple[str, str, float | None, Callable[[Record], bool | None]], ...] = (
    ("law", "the most probable hypothesis changes the right term", 0.8, says_term),
    ("law", "the same, and it is a law", None, law_says_term),
    ("law", "the right quantity of the right term is in the 95 % credible set", 0.8, has_quantity),
    ("law", "nothing else is in the credible set", 0.5, quantity_alone),
    ("law", "held-out RMSE at most 1.25 times that with the true law", 0.7, near_truth),
    ("law", "the same with the most probable hypothesis added, law or not", None, told_near_truth),
    ("nothing", "no law is written", 0.95, is_silent),
    ("listed", "no unlisted law is preferred", 0.95, is_silent),
)


def write_law_page(records: Sequence[Record], angles: Sequence[Record], page: Path) -> None:
    """The part of the page between the marks; angles: records of `law_angles`."""
    made = [record for record in records if "left_out" not in record]
    size = {group: sum(record["group"] == group for record in made) for group in GROUPS}
    seconds = np.median([record["seconds"] for record in made])
    numbers = NUMBERS.format(
        sets=len(made), planned=len(law_trials()), left_out=len(records) - len(made), seconds=f"{seconds:.0f}",
        lines=_lines(made), chances=chance_lines(made), at_most=told_at_most(made, angles), **size,
    )  # fmt: skip
    text = page.read_text(encoding="utf-8")
    before, after = text[: text.index(BEGIN) + len(BEGIN)], text[text.index(END) :]
    page.write_text(f"{before}\n\n{numbers}\n{after}", encoding="utf-8")


def _lines(made: Sequence[Record]) -> str:
    rows = []
    for group, words, wanted, is_so in LINES:
        answers = [one for record in made if record["group"] == group and (one := is_so(record)) is not None]
        if not answers:
            continue
        share, (low, high) = sum(answers) / len(answers), interval(sum(answers), len(answers))
        reached = wanted is not None and share >= wanted
        met = "-" if wanted is None else "no" if not reached else "yes" if len(answers) >= FEW_SETS else "too few"
        target = "-" if wanted is None else f"at least {100 * wanted:.0f} %"
        ends = f"{100 * low:.0f} to {100 * high:.0f} %"
        rows.append(f"| {GROUPS[group]}: {words} | {target} | {len(answers)} | {100 * share:.0f} % | {ends} | {met} |")
    return "\n".join(rows)


NUMBERS = """{sets} data sets ({law} with a law, {nothing} with nothing, {listed} with a listed effect) of {planned}
planned; {left_out} were left out, mostly as no plausible size is visible. A search takes {seconds} s of one core.

| | target | data sets | share | 95 % interval | met |
|---|---|---:|---:|---:|---|
{lines}

| probability of the most probable quantity | data sets | mean | share that is right |
|---|---:|---:|---:|
{chances}

{at_most}
"""
