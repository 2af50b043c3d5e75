"""The error ladder as one picture: how the errors fall from model to model, and what the parameters do meanwhile."""

import textwrap
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

from vegglue.arrays import Array
from vegglue.diagnosis.comparison import held_out_rmse, improvement
from vegglue.pages.style import COLOUR, SMALL, WIDTH, label, save, styled
from vegglue.pages.typography import fixed, short
from vegglue.results.model_comparison import ModelScore

# p-value [-] of one value in all experiments, below which a parameter is drawn as one that moves: 1 in 20.
MOVES_BELOW = 0.05
# Panels of parameters side by side; ratio [-] of largest to smallest value, 1.5 decades, from which an axis is
# logarithmic: on a linear one the smallest could not be read.
LADDER_COLUMNS, LOGARITHMIC_FROM = 5, 30.0
# The axis of errors reaches up to this at least [m/s]: where no velocity was measured, there is none to show.
LEAST_AXIS_END = 1e-3
# Letters of a parameter's name in a line above its panel.
TITLE_LETTERS = 26


def save_ladder_figure(scores: Sequence[ModelScore], path: Path) -> None:
    """Write the ladder to a file, PNG or SVG by its ending."""
    save(draw_ladder(scores), path)


@styled
def draw_ladder(scores: Sequence[ModelScore]) -> Figure:
    """Above: root mean square errors of velocity of each model, down to the noise floor. Below: each parameter with its
    95 % range; hollow where the experiments disagree about it.
    """
    names = list(dict.fromkeys(name for score in scores for name in score.values))
    rows = -(-len(names) // LADDER_COLUMNS)
    figure = Figure(figsize=(2 * WIDTH, 3.6 + 1.75 * rows), layout="constrained")
    if not names:
        _paint_errors(figure.subplots(), scores)
        return figure
    upper, lower = np.ravel(np.array(figure.subfigures(2, 1, height_ratios=(3.6, 1.75 * rows)), object))
    _paint_errors(upper.subplots(), scores)
    panels = list(lower.subplots(rows, LADDER_COLUMNS, squeeze=False).flat)
    for axes, name in zip(panels, names, strict=False):
        _paint_parameter(axes, scores, name)
    for axes in panels[len(names) :]:
        axes.set_visible(False)
    return figure


def _paint_errors(axes: Axes, scores: Sequence[ModelScore]) -> None:
    place = np.arange(1, len(scores) + 1)
    held = np.array([held_out_rmse(score) for score in scores])
    alone = np.array([held_out_rmse(score, "experiments") for score in scores])
    inside = np.array([score.in_sample.velocity for score in scores])
    unseen, floor = np.array([(score.validation, score.in_sample.noise_floor) for score in scores]).T
    bars = np.array([np.nan, *(_spread(*pair) for pair in pairwise(scores))])
    axes.errorbar(place, held, np.nan_to_num(bars), fmt="o-", color=COLOUR["model"], markersize=6, linewidth=1.6,
                  elinewidth=1.1, capsize=3)  # fmt: skip
    axes.plot(place, alone, "D--", color=COLOUR["model"], markersize=5, markerfacecolor=COLOUR["paper"], linewidth=1)
    axes.plot(place, unseen, "*-", color=COLOUR["measured"], markersize=10, linewidth=1.2)
    axes.plot(place, inside, "o:", color=COLOUR["muted"], markersize=4.5, linewidth=1.2)
    axes.plot(place, floor, color=COLOUR["ink"], linewidth=0.9, dashes=(5, 3), marker="_", markersize=14)
    for x, value in zip(place, held, strict=True):
        if np.isfinite(value):
            label(axes, float(x), float(value), short(value, 2), "model", xytext=(7, 5), fontweight="bold")
    _name_lines(axes, place[-1], {
        "held out by section": (held, "model"), "held out by experiment": (alone, "model"),
        "not seen by any fit": (unseen, "measured"), "in sample": (inside, "muted"),
        "error of measuring": (floor, "ink"),
    })  # fmt: skip
    top = np.nanmax([*held, *alone, *inside, *unseen, *floor, LEAST_AXIS_END])
    axes.set(ylim=(0, 1.12 * top), xlim=(0.6, len(scores) + 0.9), ylabel="velocity error, root mean square [m/s]")
    axes.set_xticks(place, [_step_name(scores, k) for k in range(len(scores))])
    axes.tick_params(axis="x", length=0)


def _spread(before: ModelScore, after: ModelScore) -> float:
    """Standard error of the fall of the held-out error: that of the mean square, over 2 RMSE [m/s]."""
    return improvement(before, after)[1] / (2.0 * held_out_rmse(after))


def _name_lines(axes: Axes, x: float, lines: dict[str, tuple[Array, str]]) -> None:
    """Each line named beside its last point, names pushed apart where they would cover each other."""
    known = {name: (line[-1], colour) for name, (line, colour) in lines.items() if np.isfinite(line[-1])}
    if not known:
        return
    gap = 0.065 * max(float(np.nanmax(line)) for line, _ in lines.values() if np.isfinite(line).any())
    lowest = -np.inf
    for name, (value, colour) in sorted(known.items(), key=lambda each: each[1][0]):
        lowest = max(float(value), lowest + gap)
        axes.annotate(name, (x + 0.32, lowest), fontsize=SMALL + 0.5, color=COLOUR[colour], va="center",
                      annotation_clip=False)  # fmt: skip
        axes.plot([x + 0.05, x + 0.3], [value, lowest], color=COLOUR["rule"], linewidth=0.7)


def _step_name(scores: Sequence[ModelScore], k: int) -> str:
    new = [name for name in scores[k].effects if k == 0 or name not in scores[k - 1].effects]
    added = "".join(f"\n+ {name}" for name in new)
    return f"{k + 1}  {scores[k].name}{added}\n{len(scores[k].values)} parameters"


def _paint_parameter(axes: Axes, scores: Sequence[ModelScore], name: str) -> None:
    known = [(k + 1, score) for k, score in enumerate(scores) if name in score.values]
    for place, score in known:
        middle, low, high = score.values[name]
        moves = score.homogeneity.get(name, 1.0) < MOVES_BELOW
        axes.vlines(place, low, high, color=COLOUR["model"], linewidth=1.1)
        face = COLOUR["paper" if moves else "model"]
        axes.plot(place, middle, "o", markersize=5, color=COLOUR["model"], markerfacecolor=face, zorder=4)
    values = np.array([score.values[name] for _, score in known])
    if (values > 0).all() and values.max() > LOGARITHMIC_FROM * values.min():
        axes.set_yscale("log")
        for set_formatter in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
            set_formatter(LogFormatter())  # plain numbers: the usual one writes formulae
    moving = [score.homogeneity[name] for _, score in known if name in score.homogeneity]
    homogeneity = f"\none value fits: p = {fixed(moving[-1], 2)}" if moving else ""
    broken = "\n".join(line.replace("_ ", "_") for line in textwrap.wrap(name.replace("_", "_ "), TITLE_LETTERS))
    axes.set_title(f"{broken}{homogeneity}", fontsize=SMALL + 0.5, fontweight="normal")
    axes.set(xlim=(0.5, len(scores) + 0.5))
    axes.set_xticks(range(1, len(scores) + 1))
    axes.tick_params(labelsize=7.5)
