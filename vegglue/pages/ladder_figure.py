"""The error ladder as one picture: how the errors fall from model to model, and what the parameters do meanwhile."""

import textwrap
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

from vegglue.arrays import Array
from vegglue.diagnosis.comparison import held_out_rmse, improvement
from vegglue.inference.homogeneity import differing
from vegglue.pages.style import SMALL, WIDTH, canvas, label, save, styled
from vegglue.pages.svg import COLOUR
from vegglue.results.loop_results import ModelComparison, ModelScore
from vegglue.wording.numbers import fixed, short
from vegglue.wording.sentences import phrase

# How errors are drawn by what they are judged on: line and marker, name beside the line, colour, width.
LINES = {
    "held_out_sections": ("o-", "sections", "model", 1.6),
    "held_out_experiments": ("D--", "experiments", "model", 1.0),
    "unseen": ("*-", "unseen", "measured", 1.2),
    "in_sample": ("o:", "in sample", "muted", 1.2),
    "noise_floor": ("_--", "floor", "ink", 0.9),
}
# Panels of parameters side by side; ratio [-] of largest to smallest value, 1.5 decades, from which an axis is
# logarithmic: on a linear one the smallest could not be read.
LADDER_COLUMNS, LOGARITHMIC_FROM = 5, 30.0
# The axis of errors reaches up to this at least [m/s]: without velocities there is none to show.
LEAST_AXIS_END = 1e-3
# Letters of a name in a line above the panel of a parameter, and below a model where it has so many inches.
TITLE_LETTERS, LETTERS_PER_INCH = 26, 15.0


def save_ladder_figure(scores: Sequence[ModelScore], path: Path) -> None:
    """Write the ladder to a file, PNG or SVG by its ending."""
    save(draw_ladder(scores), path)


@styled
def draw_ladder(scores: Sequence[ModelScore]) -> Figure:
    """Above: root mean square errors of velocity of each model, and the measurement error. Below: each parameter with
    its 95 % range; hollow if it differs between experiments.
    """
    names = list(dict.fromkeys(name for score in scores for name in score.values))
    rows = -(-len(names) // LADDER_COLUMNS)
    figure = Figure(figsize=(2 * WIDTH, 3.6 + 1.75 * rows), layout="constrained")
    parts = [figure]
    if names:
        parts = list(np.ravel(np.array(figure.subfigures(2, 1, height_ratios=(3.6, 1.75 * rows)), object)))
    errors = {
        "held_out_sections": [held_out_rmse(score) for score in scores],
        "held_out_experiments": [held_out_rmse(score, "experiments") for score in scores],
        "unseen": [score.validation for score in scores],
        "in_sample": [score.in_sample.velocity for score in scores],
        "noise_floor": [score.in_sample.noise_floor for score in scores],
    }
    # Standard error of the fall of the held-out error: that of the mean square, over 2 RMSE [m/s].
    spread = [improvement(*pair)[1] / (2.0 * held_out_rmse(pair[1])) for pair in pairwise(scores)]
    added = [tuple(one for one in after.effects if one not in before.effects) for before, after in pairwise(scores)]
    news = [scores[0].effects, *added]
    models = [(score.name, new, len(score.values)) for score, new in zip(scores, news, strict=True)]
    _paint_errors(parts[0].subplots(), models, errors, np.array([np.nan, *spread]), 2 * WIDTH)
    if names:
        panels = list(parts[1].subplots(rows, LADDER_COLUMNS, squeeze=False).flat)
        for axes, name in zip(panels, names, strict=False):
            known = [(k, score) for k, score in enumerate(scores, 1) if name in score.values]
            for place, score in known:
                middle, low, high = score.values[name]
                axes.vlines(place, low, high, color=COLOUR["model"], linewidth=1.1)
                face = COLOUR["paper" if name in differing(score.homogeneity) else "model"]
                axes.plot(place, middle, "o", markersize=5, color=COLOUR["model"], markerfacecolor=face, zorder=4)
            values = np.array([score.values[name] for _, score in known])
            if (values > 0).all() and values.max() > LOGARITHMIC_FROM * values.min():
                axes.set_yscale("log")
                for set_formatter in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
                    set_formatter(LogFormatter())  # plain numbers: the usual one writes formulae
            moving = [score.homogeneity[name] for _, score in known if name in score.homogeneity]
            homogeneity = f"\none value: p = {fixed(moving[-1], 2)}" if moving else ""
            title = "\n".join(_broken(name, TITLE_LETTERS))
            axes.set_title(f"{title}{homogeneity}", fontsize=SMALL + 0.5, fontweight="normal")
            axes.set(xlim=(0.5, len(scores) + 0.5))
            axes.set_xticks(range(1, len(scores) + 1))
            axes.tick_params(labelsize=7.5)
        for axes in panels[len(names) :]:
            axes.set_visible(False)
    return figure


@styled
def draw_errors(ladder: ModelComparison) -> Figure:
    """The errors of each model of a kept ladder, for the page."""
    figure, axes = canvas(WIDTH + 0.6, 3.0)
    errors = {name: [float(getattr(step, name)) for step in ladder.steps] for name in LINES}
    models = [(step.name, step.added, step.parameters) for step in ladder.steps]
    _paint_errors(axes, models, errors, np.full(len(models), np.nan), WIDTH + 0.6)
    return figure


def _paint_errors(
    axes: Axes, models: Sequence[tuple[str, Sequence[str], int]], errors: Mapping[str, Sequence[float]], spread: Array,
    width: float,
) -> None:  # fmt: skip
    """A line for each way of judging, named beside its last point; models: name, what was added, parameters."""
    place, known = np.arange(1, len(models) + 1), {name: np.array(values) for name, values in errors.items()}
    top = float(np.nanmax([*np.concatenate(list(known.values())), LEAST_AXIS_END]))
    for name, (line, _, colour, thick) in LINES.items():
        face = COLOUR["paper" if name == "held_out_experiments" else colour]
        size = 10 if line[0] in "*_" else 5.5
        axes.plot(
            place, known[name], line, color=COLOUR[colour], linewidth=thick, markersize=size, markerfacecolor=face
        )
    held = known["held_out_sections"]
    axes.errorbar(place, held, np.nan_to_num(spread), fmt="none", ecolor=COLOUR["model"], elinewidth=1.1, capsize=3)
    for x, value in zip(place, held, strict=True):
        if np.isfinite(value):
            label(axes, float(x), float(value), short(value, 2), "model", xytext=(7, 5), fontweight="bold")
    ends = {LINES[name][1:3]: float(values[-1]) for name, values in known.items() if np.isfinite(values[-1])}
    lowest, right = -np.inf, place[-1]
    for (name, colour), value in sorted(ends.items(), key=lambda one: one[1]):
        lowest = max(value, lowest + 0.065 * top)  # names are pushed apart that would cover each other
        axes.annotate(
            phrase("label", name), (right + 0.32, lowest), fontsize=SMALL + 0.5, color=COLOUR[colour], va="center",
            annotation_clip=False,
        )  # fmt: skip
        axes.plot([right + 0.05, right + 0.3], [value, lowest], color=COLOUR["rule"], linewidth=0.7)
    axes.set(ylim=(0, 1.12 * top), xlim=(0.6, len(models) + 0.9), ylabel=phrase("label", "rmse"))
    letters = max(int(LETTERS_PER_INCH * width / (len(models) + 1)), 12)
    ticks = []
    for k, (name, added, parameters) in enumerate(models, 1):
        lines = [f"{k}  {name}" if k == 1 or not added else f"{k}", *(f"+ {one}" for one in added)]
        broken = [part for line in lines for part in _broken(line, letters)]
        ticks.append("\n".join([*broken, f"{parameters} parameters"]))
    axes.set_xticks(place, ticks)
    axes.tick_params(axis="x", length=0, labelsize=SMALL + 0.5)


def _broken(name: str, letters: int) -> list[str]:
    """A name in lines of at most so many letters, broken at underscores first."""
    return [line.replace("_ ", "_") for line in textwrap.wrap(name.replace("_", "_ "), letters)]
