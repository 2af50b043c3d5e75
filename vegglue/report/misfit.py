"""Figures of where a model misses, before and after something was added: sections, gauges, zones.

Every function takes plain arrays and tables and returns a matplotlib Figure; nothing here knows a run or a page.
"""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vegglue.measurements.kinds import WATER_LEVEL
from vegglue.report.style import COLOUR, HEIGHT, WIDTH, canvas, styled
from vegglue.report.typography import fixed

# Root mean square misfit [standard errors] from which it is set in bold: twice what errors alone make.
BOLD_MISFIT = 2.0


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
