"""Figures of effects: how strongly each is suspected, which of them look alike, the trace that one leaves.

Every function takes plain arrays and tables and returns a matplotlib Figure; nothing here knows a run or a page.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from vegglue.arrays import Array
from vegglue.calibration.score_test import ALIKE, alike_groups
from vegglue.measurements.kinds import KINDS, Kind
from vegglue.measurements.sections import section_in_words
from vegglue.report.style import COLOUR, SMALL, WIDTH, canvas, formula_labels, label, styled
from vegglue.report.typography import fixed, unit_math

# How each status is drawn: marker, face, edge. Form and fill tell them apart without colour.
MARKS: dict[str, tuple[str, str, str]] = {
    "accepted": ("o", "measured", "measured"),
    "rival": ("D", "measured", "measured"),
    "stands out": ("P", "ink", "ink"),
    "less likely": ("X", "ink", "ink"),
    "no sign": ("o", "paper", "muted"),
    "untestable": ("|", "muted", "muted"),
}
# Where the panel of scores begins, over its first row: the words beside the threshold then cover no mark.
TOP = -1.5
# Panels side by side: with five, the ticks of each still have room.
FINGERPRINT_COLUMNS = 5
# One for each experiment, told apart without colour.
LINE_STYLES = ("solid", (0, (4, 2)), (0, (1, 1.5)), (0, (5, 1.5, 1, 1.5)))


@styled
def draw_suspects(suspects: pd.DataFrame, threshold: float) -> Figure:
    """Scores of the effects before anything is added, and what the last look leaves of them (small rings), beside
    their visibility.

    suspects: name, status (of MARKS), first, left (NaN where not looked at again) and visibility, the strongest first;
    threshold: the score that errors alone seldom reach.
    """
    height = 0.95 + 0.2 * max(len(suspects), 3)
    figure, (scores, visible) = canvas(2 * WIDTH, height, ncols=2, sharey=True, width_ratios=(3.4, 1))
    paint_suspects(scores, visible, suspects, threshold)
    return figure


def paint_suspects(scores: Axes, visible: Axes, suspects: pd.DataFrame, threshold: float) -> None:
    """Paint draw_suspects on two axes that share their rows: scores on the first, visibility on the second."""
    rows = np.arange(len(suspects))
    first, left = np.abs(suspects["first"].to_numpy(float)), np.abs(suspects["left"].to_numpy(float))
    scores.hlines(rows, 0, first, color=COLOUR["rule"], linewidth=1)
    scores.plot(left, rows, "o", markersize=3.4, markerfacecolor="none", color=COLOUR["model"], zorder=4)
    status = suspects["status"].to_numpy()
    for word in [word for word in MARKS if word in status]:
        chosen = status == word
        scores.plot(first[chosen], rows[chosen], linestyle="", zorder=5, label=word, **_mark(word))
    scores.axvline(threshold, color=COLOUR["ink"], linewidth=0.9, dashes=(4, 2))
    scores.set_xscale("function", functions=(lambda x: np.sqrt(np.maximum(x, 0.0)), np.square))
    reach = float(np.nanmax([3.2 * threshold, *(1.15 * first), *(1.15 * left)]))  # room right of the threshold
    scores.set(xlim=(0, reach), ylim=(len(rows) - 0.4, TOP), xlabel="score [standard errors], root scale")
    scores.set_xticks([tick for tick in (0, 1, 2, 5, 10, 20, 50, 100, 200) if tick < reach])
    label(scores, threshold, TOP, "errors alone seldom reach this", xytext=(4, -8), va="center")
    scores.set_yticks(rows, [_effect_label(name, word) for name, word in zip(suspects["name"], status, strict=True)])
    again = [Line2D([], [], linestyle="", marker="o", markersize=3.4, markerfacecolor="none", color=COLOUR["model"],
                    label="when looked at last")] if np.isfinite(left).any() else []  # fmt: skip
    handles = [*scores.get_legend_handles_labels()[0], *again]
    if handles:
        scores.set_ylim(len(rows) - 0.4 + 0.85 * len(handles), TOP)  # rows of their own below the marks
        key = scores.legend(handles=handles, loc="lower right", fontsize=SMALL, framealpha=1.0)
        key.get_frame().set(facecolor=COLOUR["paper"], linewidth=0)  # hides the threshold, which runs through it
    visible.barh(rows, suspects["visibility"], height=0.5, color=COLOUR["narrow"])
    visible.set(xlim=(0, 1), xlabel="visibility [–]", xticks=[0, 0.5, 1])
    for axes in (scores, visible):
        axes.tick_params(axis="y", length=0, labelsize=8)
        axes.spines["left"].set_visible(False)


def _mark(status: str) -> dict[str, Any]:
    marker, face, edge = MARKS[status]
    size = 9 if marker == "|" else 5.5
    return {
        "marker": marker, "markersize": size, "color": COLOUR[edge], "markerfacecolor": COLOUR[face],
        "markeredgewidth": 1.2 if marker != "X" else 0.4,
    }  # fmt: skip


def _effect_label(name: str, status: str) -> str:
    return f"{name} (untestable)" if status == "untestable" else name


@styled
def draw_alike(names: Sequence[str], cosine: Array) -> Figure:
    """Cosines between the traces of effects after calibration: squares by size, full where alike, hollow where opposed;
    framed are groups that these data cannot tell apart.
    """
    side = 1.9 + 0.26 * len(names)
    figure, axes = canvas(max(WIDTH, side + 0.4), max(side, 2.2))
    paint_alike(axes, names, cosine)
    return figure


def paint_alike(axes: Axes, names: Sequence[str], cosine: Array) -> None:
    """Paint draw_alike on given axes; cosine: (effect, effect), in the order of names."""
    families = alike_groups(names, cosine)
    order = [list(names).index(name) for family in families for name in family]
    turned = cosine[np.ix_(order, order)]
    for i, j in np.ndindex(turned.shape):
        if i == j:
            continue
        size = 0.88 * float(np.sqrt(abs(turned[i, j])))
        face, corner = COLOUR["model"] if turned[i, j] > 0 else "none", (j - size / 2, i - size / 2)
        axes.add_patch(Rectangle(corner, size, size, facecolor=face, edgecolor=COLOUR["model"], linewidth=0.7))
    start = 0
    for family in families:
        if len(family) > 1:
            corner = start - 0.5, start - 0.5
            frame = Rectangle(corner, len(family), len(family), fill=False, edgecolor=COLOUR["measured"], linewidth=2)
            axes.add_patch(frame)
        start += len(family)
    shown = [names[place] for place in order]
    axes.set(xlim=(-0.6, len(names) - 0.4), ylim=(len(names) - 0.4, -0.6), aspect="equal")
    axes.set_yticks(range(len(names)), shown)
    axes.set_xticks(range(len(names)), shown, rotation=60, ha="left", rotation_mode="anchor")
    axes.xaxis.tick_top()
    axes.tick_params(length=0, labelsize=7.5)
    for edge in ("left", "bottom"):
        axes.spines[edge].set_visible(False)
    text = f"full: alike, hollow: opposed;\nframe: |cosine| above {fixed(ALIKE, 2)}"
    axes.text(0.0, -0.03, text, transform=axes.transAxes, va="top", fontsize=SMALL, color=COLOUR["muted"])


@styled
def draw_fingerprint(trace: Array, station: pd.DataFrame, size: str) -> Figure:
    """What an effect changes: velocities across each section, a line for each experiment; else values along x.

    trace: (station,) [unit of the kind]; station: experiment, kind, section, x, y; size: of the effect, in words.
    """
    table = station.assign(change=trace)
    parts = [part for kind in KINDS.values() for part in _parts_of(kind, table[table["kind"] == kind.name])]
    figure, grid = _panels(len(parts))
    lines = dict(zip(dict.fromkeys(table["experiment"]), LINE_STYLES * len(table), strict=False))
    for place, (axes, (part, title, kind)) in enumerate(zip(grid, parts, strict=False)):
        _paint_traces(axes, part, "y" if kind.velocity else "x", lines)
        axes.set_title(title, fontsize=8.5)
        if place % FINGERPRINT_COLUMNS == 0 or kind != parts[place - 1][2]:
            formula_labels(axes, upward=f"change of {kind.column} [{unit_math(kind.unit)}]")
        if kind.velocity:
            axes.set_ylim(*_range(table.loc[table["kind"] == kind.name, "change"]))
    handles = [
        Line2D([], [], linestyle=line, color=COLOUR["model"], label=experiment) for experiment, line in lines.items()
    ]
    figure.legend(handles=handles, loc="outside upper left", ncols=4, frameon=False, fontsize=SMALL + 0.5)
    figure.suptitle(f"by {size}", x=0.995, ha="right", fontsize=SMALL + 0.5, color=COLOUR["muted"])
    return figure


def _parts_of(kind: Kind, rows: pd.DataFrame) -> list[tuple[pd.DataFrame, str, Kind]]:
    """Rows and title of each panel of a kind: one for each section of velocities, one for all others."""
    if not kind.velocity:
        return [(rows, f"{kind.instrument}s", kind)] if len(rows) else []
    sections = rows.groupby("section")["x"].mean().sort_values().index
    parts = [(str(name), rows[rows["section"] == name]) for name in sections]
    return [(part, section_in_words(name, float(part["x"].mean())), kind) for name, part in parts]


def _panels(number: int) -> tuple[Figure, list[Axes]]:
    across, rows = min(max(number, 1), FINGERPRINT_COLUMNS), max(-(-number // FINGERPRINT_COLUMNS), 1)
    figure, grid = canvas(max(WIDTH, 0.9 + 1.95 * across), 0.5 + 2.3 * rows, nrows=rows, ncols=across, squeeze=False)
    for axes in grid.flat[number:]:
        axes.set_visible(False)
    return figure, list(grid.flat)


def _range(change: "pd.Series[float]") -> tuple[float, float]:
    low, high = min(float(change.min()), 0.0), max(float(change.max()), 0.0)
    room = 0.08 * (high - low) or 1.0
    return low - room, high + room


def _paint_traces(axes: Axes, part: pd.DataFrame, along: str, lines: Mapping[str, Any]) -> None:
    axes.axhline(0, color=COLOUR["muted"], linewidth=0.7)
    for experiment, rows in part.sort_values(along).groupby("experiment"):
        line = lines[str(experiment)]
        axes.plot(rows[along], rows["change"], linestyle=line, marker=".", markersize=3, color=COLOUR["model"])
    axes.set_xlabel(f"{along} [m]")
    axes.yaxis.set_major_locator(MaxNLocator(5))
