"""Limits of the study of laws: what the data allow at most, and how good stated probabilities are."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from textwrap import fill
from typing import Any

import numpy as np
from hidden_laws import BY_NAME
from law_answers import Record, Said, causes, is_true

# Ways to weigh in records of `law_angles`, and in words.
WAYS = {
    "as it is": "with a model that is right but for the law",
    "whole evidence": "without an error of the fingerprints",
    "true law tried": "if the hidden law itself is among the candidates, too",
}
# Ends of the bins of the chance of the likeliest quantity [-].
BINS = (0.0, 0.6, 0.8, 0.95, 1.0)


def told_at_most(made: Sequence[Record], angles: Sequence[Mapping[str, Any]]) -> str:
    """Shares in the set and alone for each way to weigh, of the laws that were hidden, each as often as it was."""
    hidden = [record["hide"] for record in made if record["group"] == "law"]
    told = []
    for way, words in WAYS.items():
        found = [[one for one in angles if one["hide"] == name] for name in hidden]
        shares = [np.mean([_mean(some, way, what) for some in found if some]) for what in ("in set", "alone")]
        told.append(f"{100 * shares[0]:.0f} % and {100 * shares[1]:.0f} % {words}")
    return fill(
        "What the data allow at most, to first order, as shares of the laws whose right quantity is in the credible "
        "set, and of those for which it is alone in it: "
        f"{'; '.join(told)} (`tests/studies/law_angles.py`).", 120, break_on_hyphens=False
    )  # fmt: skip


def chance_lines(made: Sequence[Record]) -> str:
    """The chance of the likeliest quantity of a term, all its laws together, and how often it was right, by bins."""
    pairs = [pair for record in made if record["group"] == "law" and (pair := likeliest_quantity(record)) is not None]
    rows = []
    for low, high in pairwise(BINS):
        of_bin = [(chance, right) for chance, right in pairs if low < chance <= high]
        if of_bin:
            chance, right = np.mean(of_bin, axis=0)
            bounds = f"{100 * low:.0f} to {100 * high:.0f} %"
            rows.append(f"| {bounds} | {len(of_bin)} | {100 * chance:.0f} % | {100 * right:.0f} % |")
    if pairs:
        chance, right = np.mean(pairs, axis=0)
        rows.append(f"| all | {len(pairs)} | {100 * chance:.0f} % | {100 * right:.0f} % |")
    return "\n".join(rows)


def likeliest_quantity(record: Record) -> tuple[float, bool] | None:
    """Its chance in the set, and whether it is the right one; None where the set is empty."""
    together: dict[Said, float] = {}
    for said, chance, _ in causes(record):
        together[said] = together.get(said, 0.0) + chance
    if not together:
        return None
    best = max(together, key=lambda said: together[said])
    return together[best] / sum(together.values()), is_true(BY_NAME[record["hide"]], best)


def _mean(angles: Sequence[Mapping[str, Any]], way: str, what: str) -> float:
    return float(np.mean([one[way][what] for one in angles]))
