"""The figures of docs/blind.md."""

from collections.abc import Mapping, Sequence

import numpy as np
from blind_definitions import Record, error_of
from blind_lines import Line, Told, hidden_and_named, interval
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from vegglue.figures.style import COLOUR, SMALL, WIDTH, styled

# By truth: what it is called, and its colour.
TRUTHS = {"second": ("stranger's truth", COLOUR["measured"]), "own": ("own equations", COLOUR["model"])}
Counted = tuple[int, int]  # met, of


@styled
def draw_shares(shares: Sequence[tuple[Line, Mapping[str, Counted]]]) -> Figure:
    """Every share with its interval for both truths, and the share that is wanted."""
    figure = Figure(figsize=(2.1 * WIDTH, 1.1 + 0.25 * len(shares)), layout="constrained")
    axes = figure.subplots()
    for (truth, (_, colour)), aside in zip(TRUTHS.items(), (0.17, -0.17), strict=True):
        for row, (_, counted) in enumerate(shares):
            good, size = counted[truth]
            if size:
                here = [aside - row] * 2
                axes.plot(interval(good, size), here, color=colour, linewidth=2, alpha=0.4, solid_capstyle="butt")
                axes.plot([good / size], here[:1], "o", color=colour, markersize=3.5)
    for row, (line, _) in enumerate(shares):
        if line.wanted is not None:
            axes.plot([line.wanted] * 2, [-row - 0.4, 0.4 - row], color=COLOUR["ink"], linewidth=1)
    labels = [f"{line.label} ({counted['second'][1]}, {counted['own'][1]})" for line, counted in shares]
    axes.set_yticks([-row for row in range(len(shares))], labels, fontsize=SMALL)
    axes.set(xlim=(-0.01, 1.01), ylim=(0.6 - max(len(shares), 1), 0.6))
    axes.grid(axis="x")
    axes.set_xlabel("share of data sets (their numbers: stranger's, own), 95 % interval")
    _explain(axes)
    return figure


def _explain(axes: Axes) -> None:
    """A legend above the panel: it covers nothing there."""
    for label, colour in TRUTHS.values():
        axes.plot([], [], "o-", color=colour, markersize=3.5, label=label)
    axes.plot([], [], "|", color=COLOUR["ink"], markersize=8, label="wanted")
    axes.legend(frameon=False, fontsize=SMALL, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))


@styled
def draw_chances(told: Mapping[str, Sequence[Told]]) -> Figure:
    """Chances that were told against what came true, by bins of the chance."""
    figure = Figure(figsize=(WIDTH, 3.9), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color=COLOUR["muted"], linewidth=1)
    for truth, bins in told.items():
        label, colour = TRUTHS[truth]
        x, share, low, high = np.array(
            [(one.mean, one.true / one.count, *interval(one.true, one.count)) for one in bins]
        ).reshape(-1, 4).T  # fmt: skip
        axes.errorbar(x, share, [share - low, high - share], fmt="o", color=colour, markersize=4, elinewidth=1,
                      capsize=2, label=f"{label} ({sum(one.count for one in bins)} names)")  # fmt: skip
    axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), xlabel="chance told", ylabel="share that came true")
    axes.set_aspect("equal")
    axes.grid()
    axes.legend(frameon=False, fontsize=SMALL, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return figure


@styled
def draw_held_out(records: Mapping[str, Sequence[Record]]) -> Figure:
    """Errors of sections that were not measured, without and with what `extend --auto` kept, a panel for each truth."""
    pairs = {truth: _errors(chosen) for truth, chosen in records.items()}
    every = np.concatenate(list(pairs.values()))
    ends = (0.8 * every.min(), 1.25 * every.max()) if len(every) else (1.0, 100.0)
    figure = Figure(figsize=(1.9 * WIDTH, 4.3), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, (truth, (label, colour)) in zip(panels, TRUTHS.items(), strict=True):
        before, after = pairs[truth].T
        axes.plot(ends, ends, color=COLOUR["muted"], linewidth=1)
        axes.loglog(before, after, "o", color=colour, markersize=4, markeredgewidth=0, alpha=0.5)
        axes.set(title=f"{label} ({len(before)})", xlim=ends, ylim=ends, xlabel="held-out error of the parent [mm/s]")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(subs=(1.0, 1.5, 2.0, 3.0, 5.0)))
            axis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axis.set_minor_formatter(NullFormatter())
        axes.set_aspect("equal")
    panels[0].set_ylabel("with what was kept [mm/s]")
    return figure


def _errors(records: Sequence[Record]) -> np.ndarray:
    """Before and after [mm/s] (n, 2), where something was kept."""
    pairs = [(error_of(one, "parent"), error_of(one, "kept")) for one in records]
    return 1e3 * np.array([pair for pair in pairs if None not in pair], dtype=float).reshape(-1, 2)


@styled
def draw_confusion(records: Sequence[Record]) -> Figure:
    """Hidden effects against what was named first, ratio 6; what was right lies on the falling line of squares."""
    pairs = hidden_and_named(records)
    hidden, said = sorted({a for a, _ in pairs}), {b for _, b in pairs}
    columns = [name for name in hidden if name in said] + sorted(
        said - set(hidden), key=lambda name: (name[0] == "(", name)
    )
    table = np.zeros((max(len(hidden), 1), max(len(columns), 1)))
    for a, b in pairs:
        table[hidden.index(a), columns.index(b)] += 1
    size = (max(2.4 + 0.11 * len(columns), 4.0), max(2.4 + 0.11 * len(hidden), 4.0))
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots()
    axes.imshow(table / np.maximum(table.sum(axis=1, keepdims=True), 1), cmap="Blues", vmin=0, vmax=1)
    axes.set_xticks(range(len(columns)), columns, rotation=90, fontsize=6)
    axes.set_yticks(range(len(hidden)), hidden, fontsize=6)
    axes.set(xlabel="named first", ylabel="hidden, ratio 6")
    axes.set_xticks(np.arange(len(columns) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(hidden) + 1) - 0.5, minor=True)
    axes.grid(which="minor", linewidth=0.3)
    axes.tick_params(which="minor", length=0)
    return figure
