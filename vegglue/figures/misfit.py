"""Figures of where a model misses, before and after something was added: sections, gauges, zones.

Every function takes plain arrays and tables and returns a matplotlib Figure; nothing here knows a run or a page.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from vegglue.figures.style import COLOUR, HEIGHT, SMALL, WIDTH, canvas, styled
from vegglue.figures.typography import fixed
from vegglue.measurements.kinds import STREAMWISE, WATER_LEVEL

# Standard errors [-] beyond which a residual is one that errors alone leave 1 time in 20.
LIKELY_RESIDUAL = 2.0
# Root mean square misfit [standard errors] from which it is set in bold: twice what errors alone make.
BOLD_MISFIT = 2.0
BEFORE: dict[str, Any] = {"color": COLOUR["muted"], "linewidth": 1.2, "dashes": (3, 2)}
AFTER: dict[str, Any] = {"color": COLOUR["model"], "linewidth": 1.5}


@styled
def draw_profiles(stations: pd.DataFrame, added: str, flagged: Sequence[int] = ()) -> Figure:
    """Measured and predicted u across sections, a row for each experiment; below each what is left of it.

    stations: those of observations with prediction_first, prediction and error (1 sd) of each; added: what stands
    between the two predictions, '' for nothing; flagged: labels of rows that were set aside.
    """
    velocity = stations[stations["kind"] == STREAMWISE]
    experiments = list(dict.fromkeys(velocity["experiment"]))
    sections = list(velocity.groupby("section")["x"].mean().sort_values().index)
    size = max(WIDTH, 0.9 + 2.1 * len(sections)), 0.75 + 2.05 * len(experiments)
    ratios = {"height_ratios": (2.5, 1) * len(experiments)}
    figure, panels = canvas(
        *size, nrows=2 * len(experiments), ncols=len(sections), sharex="col", sharey="row", squeeze=False,
        gridspec_kw=ratios,
    )  # fmt: skip
    for row, experiment in enumerate(experiments):
        for column, section in enumerate(sections):
            part = velocity[(velocity["experiment"] == experiment) & (velocity["section"] == section)]
            _paint_profile(panels[2 * row, column], part.sort_values("y"), added, flagged)
            _paint_residuals(panels[2 * row + 1, column], part.sort_values("y"), "y", added)
        panels[2 * row, 0].set_ylabel(f"{experiment}\nu [m/s]")
        panels[2 * row + 1, 0].set_ylabel("left [sd]")
    for column, section in enumerate(sections):
        panels[0, column].set_title(_section_title(section, velocity), fontsize=8.5)
        panels[-1, column].set_xlabel("y [m]")
    figure.align_ylabels()
    figure.legend(handles=_legend(added, bool(len(flagged))), **LEGEND)
    return figure


LEGEND: dict[str, Any] = {
    "loc": "outside upper left", "ncols": 4, "frameon": False, "fontsize": SMALL + 0.5, "borderpad": 0.0,
}  # fmt: skip


def _legend(added: str, flagged: bool) -> list[Line2D]:
    measured = Line2D([], [], linestyle="", marker="o", markersize=4, color=COLOUR["measured"], label="measured")
    aside = Line2D([], [], linestyle="", marker="x", markersize=6, color=COLOUR["ink"], label="set aside")
    before = Line2D([], [], label="model before" if added else "model", **(BEFORE if added else AFTER))
    after = [Line2D([], [], label=f"with {added}", **AFTER)] if added else []
    return [measured, before, *after, *([aside] if flagged else [])]


def _section_title(section: str, velocity: pd.DataFrame) -> str:
    return f"{section}, x = {velocity.loc[velocity['section'] == section, 'x'].mean():g} m"


def _paint_profile(axes: Axes, part: pd.DataFrame, added: str, flagged: Sequence[int]) -> None:
    for used, face in ((True, COLOUR["measured"]), (False, COLOUR["paper"])):
        rows = part[part["used"].astype(bool) == used]
        error = 1.96 * rows["standard_error"].fillna(0.0)
        axes.errorbar(
            rows["y"], rows["value"], error, fmt="o", markersize=3.2, markerfacecolor=face, color=COLOUR["measured"],
            elinewidth=0.7, markeredgewidth=0.9,
        )  # fmt: skip
    aside = part[part.index.isin(list(flagged))]
    axes.plot(aside["y"], aside["value"], "x", markersize=8, markeredgewidth=1.3, color=COLOUR["ink"], zorder=6)
    if added:
        axes.plot(part["y"], part["prediction_first"], zorder=3, **BEFORE)
    axes.plot(part["y"], part["prediction"], zorder=3, **AFTER)
    axes.yaxis.set_major_locator(MaxNLocator(4))


def _paint_residuals(axes: Axes, part: pd.DataFrame, along: str, added: str) -> None:
    """(measured - predicted) / error against a coordinate: before hollow, after full, the usual range shaded."""
    axes.axhspan(-LIKELY_RESIDUAL, LIKELY_RESIDUAL, color=COLOUR["rule"], linewidth=0, alpha=0.6, zorder=0)
    axes.axhline(0, color=COLOUR["muted"], linewidth=0.6, zorder=1)
    place = part[along].to_numpy(float)
    before, after = (
        ((part["value"] - part[name]) / part["error"]).to_numpy(float) for name in ("prediction_first", "prediction")
    )
    if added:
        axes.plot(place, before, "o", markersize=2.8, markerfacecolor=COLOUR["paper"], color=COLOUR["muted"])
    axes.plot(place, after, "o", markersize=2.8, color=COLOUR["model"], zorder=4)
    axes.yaxis.set_major_locator(MaxNLocator(3, integer=True))


@styled
def draw_gauges(stations: pd.DataFrame, added: str) -> Figure:
    """Measured minus predicted level [mm] of each gauge along the channel, with 95 % of its error, by experiment."""
    levels = stations[stations["kind"] == WATER_LEVEL]
    experiments = list(dict.fromkeys(levels["experiment"]))
    size = max(WIDTH, 0.9 + 1.6 * len(experiments)), HEIGHT - 0.4
    figure, panels = canvas(*size, ncols=len(experiments), sharey=True, squeeze=False)
    for axes, experiment in zip(panels[0], experiments, strict=True):
        part = levels[(levels["experiment"] == experiment)].sort_values("x")
        axes.axhline(0, color=COLOUR["muted"], linewidth=0.8)
        before, after = (1000 * (part["value"] - part[name]) for name in ("prediction_first", "prediction"))
        if added:
            axes.plot(part["x"], before, "o", markersize=4, markerfacecolor=COLOUR["paper"], color=COLOUR["muted"])
        error = 1960 * part["standard_error"].fillna(0.0)
        axes.errorbar(part["x"], after, error, fmt="o", markersize=4, color=COLOUR["model"], elinewidth=0.9)
        axes.set_title(experiment, fontsize=8.5)
        axes.set_xlabel("x [m]")
        axes.margins(x=0.1, y=0.12)
    panels[0, 0].set_ylabel("measured − model [mm]")
    return figure


@styled
def draw_zones(zones: pd.DataFrame) -> Figure:
    """Misfit by experiment, section and zone: root mean square in standard errors, and the mean in its own.

    The area of a square follows the misfit; it is full where more was measured than predicted on average, else hollow.
    zones: columns experiment, section, zone, stations, mean, standard_error, chi2.
    """
    height = 0.7 + 0.25 * len(zones[["experiment", "section"]].drop_duplicates())
    figure, axes = canvas(max(WIDTH, 1.5 + 0.9 * zones["zone"].nunique()), height)
    paint_zones(axes, zones)
    return figure


def paint_zones(axes: Axes, zones: pd.DataFrame) -> None:
    """Paint draw_zones on given axes."""
    experiments = list(dict.fromkeys(zones["experiment"]))
    rows = list(dict.fromkeys(zip(zones["experiment"], zones["section"], strict=True)))
    rows.sort(key=lambda row: experiments.index(row[0]))
    columns = list(dict.fromkeys(zones["zone"]))
    size = np.sqrt(np.nan_to_num(zones["chi2"] / zones["stations"]))
    mean = np.nan_to_num(zones["mean"] / zones["standard_error"])
    largest = float(size.max(initial=2 * BOLD_MISFIT))
    for each, miss, row in zip(size, mean, zones.itertuples(), strict=True):
        across, down = columns.index(row.zone), rows.index((row.experiment, row.section))
        face = COLOUR["measured"] if miss > 0 else "none"
        axes.scatter(
            across - 0.34, down, 110 * each / largest, marker="s", facecolor=face, edgecolor=COLOUR["measured"]
        )
        weight = "bold" if each > BOLD_MISFIT else "normal"
        axes.text(across + 0.06, down, fixed(float(each), 1), ha="right", va="center", fontsize=8, fontweight=weight)
        text = ("+" if miss > 0 else "") + fixed(float(miss), 1)
        axes.text(across + 0.42, down, text, ha="right", va="center", fontsize=7, color=COLOUR["muted"])
    for down in range(1, len(rows)):
        if rows[down][0] != rows[down - 1][0]:
            axes.axhline(down - 0.5, color=COLOUR["rule"], linewidth=0.8)
    axes.set(xlim=(-0.6, len(columns) - 0.4), ylim=(len(rows) - 0.4, -0.6))
    axes.set_yticks(range(len(rows)), [f"{experiment}  {section}" for experiment, section in rows])
    axes.set_xticks(range(len(columns)), columns)
    axes.tick_params(length=0, labelsize=8)
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.xaxis.tick_top()
