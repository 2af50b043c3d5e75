"""The figures of docs/blind.md."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import scipy.stats
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

from vegglue.figures.style import COLOUR, SMALL, WIDTH, styled

Record = dict[str, Any]
Counted = tuple[float, int, int]  # ratio, met, of
# Score above which an effect stands out, about: a chance of 5 % over all effects together.
STANDS_OUT = 3.2
# Groups from which sets are counted as one.
MANY = 6


def interval(successes: int, trials: int) -> tuple[float, float]:
    """95 % interval of a share (Clopper and Pearson 1934, doi:10.1093/biomet/26.4.404)."""
    if trials == 0:
        return 0.0, 1.0
    low = scipy.stats.beta.ppf(0.025, successes, trials - successes + 1) if successes else 0.0
    high = scipy.stats.beta.ppf(0.975, successes + 1, trials - successes) if successes < trials else 1.0
    return float(low), float(high)


@styled
def draw_shares(counted: Sequence[tuple[str, int, int]]) -> Figure:
    """Every share with its interval, those that were studied."""
    shown = [(label, good, size) for label, good, size in counted if size]
    figure = Figure(figsize=(2 * WIDTH, 0.8 + 0.24 * len(shown)), layout="constrained")
    axes = figure.subplots()
    for row, (_, good, size) in enumerate(shown):
        axes.plot(interval(good, size), [-row, -row], color=COLOUR["narrow"], linewidth=3, solid_capstyle="butt")
        axes.plot([good / size], [-row], "o", color=COLOUR["model"], markersize=4)
    axes.set_yticks([-row for row in range(len(shown))], [f"{label} ({size})" for label, _, size in shown], fontsize=8)
    axes.set_xlim(0, 1)
    axes.grid(axis="x")
    axes.set_xlabel("share of data sets (their number), 95 % interval")
    return figure


@styled
def draw_over_ratio(counted: Mapping[str, Sequence[Counted]]) -> Figure:
    """Shares against the length of the hidden effect's trace, and what one score would pass."""
    figure = Figure(figsize=(1.4 * WIDTH, 3.4), layout="constrained")
    axes = figure.subplots()
    for number, ((label, points), colour) in enumerate(
        zip(counted.items(), ("stems", "model", "measured"), strict=True)
    ):
        _paint_shares(axes, points, label, COLOUR[colour], 0.04 * (number - 1))
    ratio = np.linspace(1.5, 6.5, 101)
    axes.plot(ratio, scipy.stats.norm.sf(STANDS_OUT - ratio), color=COLOUR["muted"], linewidth=1, linestyle=":",
              label=f"a score of {STANDS_OUT} passed, in theory")  # fmt: skip
    axes.set(xlabel="length of the trace [standard errors]", ylabel="share of data sets", ylim=(0, 1.02))
    axes.grid(axis="y")
    axes.legend(frameon=False, fontsize=SMALL)
    return figure


def _paint_shares(axes: Axes, points: Sequence[Counted], label: str, colour: str, aside: float) -> None:
    known = [(ratio + aside, good / size, *interval(good, size)) for ratio, good, size in points if size]
    if not known:
        return
    x, share, low, high = np.array(known).T
    axes.errorbar(x, share, [share - low, high - share], fmt="o-", color=colour, markersize=4, linewidth=1.2,
                  elinewidth=1, capsize=2, label=label)  # fmt: skip


@styled
def draw_sizes(records: Sequence[Record], size_of: Callable[[Record], int]) -> Figure:
    """Groups in a set at both ratios: where something stands out, and of what is not excluded where nothing does."""
    figure = Figure(figsize=(2 * WIDTH, 2.8), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, group in zip(panels, ("snr3", "snr6"), strict=True):
        chosen = [record for record in records if record["group"] == group]
        named = [size_of(record) for record in chosen if record["steps"]]
        still = [len(record["not_excluded"]) for record in chosen if not record["steps"]]
        bins = np.arange(1, MANY + 1)
        heights = [
            np.bincount(np.clip(np.array(sizes, int), 0, MANY), minlength=MANY + 1)[1:] for sizes in (named, still)
        ]
        axes.bar(bins, heights[0], color=COLOUR["model"], width=0.8, label="named")
        axes.bar(bins, heights[1], bottom=heights[0], color=COLOUR["narrow"], width=0.8, label="not excluded")
        axes.set_xticks(bins, [*(str(size) for size in bins[:-1]), f"{MANY} or more"])
        axes.set(title=f"ratio {group[-1]}", xlabel="groups in the set")
    panels[0].set_ylabel("data sets")
    panels[0].yaxis.set_major_locator(MaxNLocator(integer=True))
    panels[0].legend(frameon=False, fontsize=SMALL)
    return figure


@styled
def draw_gains(records: Sequence[Record]) -> Figure:
    """Error of held-out sections without and with what was accepted."""
    pairs = 1e3 * np.array([record["held_out"] for record in records if "held_out" in record]).reshape(-1, 2)
    figure = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    axes = figure.subplots()
    ends = (0.8 * pairs.min(), 1.25 * pairs.max()) if len(pairs) else (1.0, 100.0)
    axes.plot(ends, ends, color=COLOUR["muted"], linewidth=1)
    axes.loglog(pairs[:, 0], pairs[:, 1], "o", color=COLOUR["model"], markersize=4, markeredgewidth=0, alpha=0.7)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 3.0, 5.0, 7.0)))
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.set(xlim=ends, ylim=ends, xlabel="error of held-out sections, without what was accepted [mm/s]",
             ylabel="with it [mm/s]")  # fmt: skip
    axes.set_aspect("equal")
    return figure


@styled
def draw_confusion(records: Sequence[Record]) -> Figure:
    """Hidden effects against what was accepted first: rows the hidden ones, columns the accepted ones, ratio 6."""
    pairs = [
        (record["hidden"][0]["name"], record["steps"][0]["accepted"] if record["steps"] else "(nothing)")
        for record in records
        if record["group"] == "snr6"
    ]
    hidden, said = sorted({a for a, _ in pairs}), sorted({b for _, b in pairs})
    table = np.zeros((len(hidden), max(len(said), 1)))
    for a, b in pairs:
        table[hidden.index(a), said.index(b)] += 1
    figure = Figure(figsize=(9, 9), layout="constrained")
    axes = figure.subplots()
    axes.imshow(table / np.maximum(table.sum(axis=1, keepdims=True), 1), cmap="Blues", vmin=0, vmax=1)
    axes.set_xticks(range(len(said)), said, rotation=90, fontsize=6)
    axes.set_yticks(range(len(hidden)), hidden, fontsize=6)
    axes.set_xlabel("accepted first")
    axes.set_ylabel("hidden, ratio 6")
    return figure
