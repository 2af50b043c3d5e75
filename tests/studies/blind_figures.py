"""The figures of docs/blind.md."""

from collections.abc import Mapping, Sequence

import numpy as np
from blind_definitions import Record, error_of
from blind_lines import Told, interval
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from vegglue.pages.style import SMALL, WIDTH, styled
from vegglue.pages.svg import COLOUR

# By truth: its label and its colour.
TRUTHS = {"second": ("second solver", COLOUR["measured"]), "own": ("own equations", COLOUR["model"])}


@styled
def draw_chances(told: Mapping[str, Sequence[Told]]) -> Figure:
    """Stated probabilities against the share that is true, by bins of the probability."""
    figure = Figure(figsize=(WIDTH, 3.9), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color=COLOUR["muted"], linewidth=1)
    for truth, bins in told.items():
        label, colour = TRUTHS[truth]
        x, share, low, high = np.array(
            [(one.mean, one.true / one.count, *interval(one.true, one.count)) for one in bins]
        ).reshape(-1, 4).T  # fmt: skip
        axes.errorbar(x, share, [share - low, high - share], fmt="o", color=colour, markersize=4, elinewidth=1,
                      capsize=2, label=f"{label} ({sum(one.count for one in bins)} hypotheses)")  # fmt: skip
    axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), xlabel="stated probability", ylabel="share that is true")
    axes.set_aspect("equal")
    axes.grid()
    axes.legend(frameon=False, fontsize=SMALL, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return figure


@styled
def draw_held_out(records: Mapping[str, Sequence[Record]]) -> Figure:
    """Errors at sections without measurements, without and with what `extend --auto` kept, a panel for each truth."""
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
