"""Figures of a diagnosis: scores of effects, effects that look alike, misfit by zone, gauges, and all on one screen."""

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from vegglue.arrays import Array
from vegglue.calibration.score_test import alike_groups
from vegglue.case.schema import Case
from vegglue.decision_constants import constants
from vegglue.measurements.kinds import KINDS, WATER_LEVEL, Kind
from vegglue.pages.flow_maps import Outline
from vegglue.pages.headline import Headline, candidate_rows, rms_residual
from vegglue.pages.place_maps import bed_picture, field_picture, outlines, paint_places, place_picture, plan_marks
from vegglue.pages.run import Run, accepted_causes, published_picture
from vegglue.pages.style import HEIGHT, SMALL, WIDTH, Picture, canvas, formula_labels, label, save, styled
from vegglue.pages.svg import COLOUR
from vegglue.results.diagnosis import Diagnosis
from vegglue.wording.numbers import fixed, section_in_words, unit_math
from vegglue.wording.sentences import phrase, sentence

# How each status is drawn: marker, face, edge. Form and fill differ, without colour.
MARKS: dict[str, tuple[str, str, str]] = {
    "accepted": ("o", "measured", "measured"),
    "rival": ("D", "measured", "measured"),
    "significant": ("P", "ink", "ink"),
    "less likely": ("X", "ink", "ink"),
    "no sign": ("o", "paper", "muted"),
    "untestable": ("|", "muted", "muted"),
}
# Where the panel of scores begins, over its first row: the words beside the threshold then cover no mark.
TOP = -1.5
# Panels side by side: with five, the ticks of each still have room.
FINGERPRINT_COLUMNS = 5
# One for each experiment, distinct without colour.
LINE_STYLES = ("solid", (0, (4, 2)), (0, (1, 1.5)), (0, (5, 1.5, 1, 1.5)))


@styled
def draw_candidates(suspects: pd.DataFrame, threshold: float) -> Figure:
    """Scores of the effects before anything is added, and what the last look leaves of them (small rings), beside
    their visibility.

    suspects: name, status (of MARKS), first, left (NaN where not looked at again) and visibility, the strongest first;
    threshold: the score that errors alone seldom reach.
    """
    height = 0.95 + 0.2 * max(len(suspects), 3)
    figure, (scores, visible) = canvas(2 * WIDTH, height, ncols=2, sharey=True, width_ratios=(3.4, 1))
    paint_candidates(scores, visible, suspects, threshold)
    return figure


def paint_candidates(scores: Axes, visible: Axes, suspects: pd.DataFrame, threshold: float) -> None:
    """Paint draw_candidates on two axes that share their rows: scores on the first, visibility on the second."""
    rows = np.arange(len(suspects))
    first, left = np.abs(suspects["first"].to_numpy(float)), np.abs(suspects["left"].to_numpy(float))
    scores.hlines(rows, 0, first, color=COLOUR["rule"], linewidth=1)
    scores.plot(left, rows, "o", markersize=3.4, markerfacecolor="none", color=COLOUR["model"], zorder=4)
    status = suspects["status"].to_numpy()
    for word in [word for word in MARKS if word in status]:
        chosen = status == word
        marker, face, edge = MARKS[word]
        scores.plot(
            first[chosen], rows[chosen], linestyle="", zorder=5, label=word, marker=marker, color=COLOUR[edge],
            markersize=9 if marker == "|" else 5.5, markerfacecolor=COLOUR[face],
            markeredgewidth=1.2 if marker != "X" else 0.4,
        )  # fmt: skip
    scores.axvline(threshold, color=COLOUR["ink"], linewidth=0.9, dashes=(4, 2))
    scores.set_xscale("function", functions=(lambda x: np.sqrt(np.maximum(x, 0.0)), np.square))
    reach = float(np.nanmax([3.2 * threshold, *(1.15 * first), *(1.15 * left)]))  # room right of the threshold
    scores.set(xlim=(0, reach), ylim=(len(rows) - 0.4, TOP), xlabel=phrase("label", "score"))
    scores.set_xticks([tick for tick in (0, 1, 2, 5, 10, 20, 50, 100, 200) if tick < reach])
    label(scores, threshold, TOP, phrase("label", "threshold"), xytext=(4, -8), va="center")
    scores.set_yticks(
        rows,
        [
            f"{name} (untestable)" if word == "untestable" else name
            for name, word in zip(suspects["name"], status, strict=True)
        ],
    )
    again = [Line2D([], [], linestyle="", marker="o", markersize=3.4, markerfacecolor="none", color=COLOUR["model"],
                    label=phrase("label", "last"))] if np.isfinite(left).any() else []  # fmt: skip
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


@styled
def draw_alike(names: Sequence[str], cosine: Array) -> Figure:
    """Cosines between the traces of effects after calibration: squares by size, full where alike, hollow where opposed;
    framed are groups that these data cannot separate.
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
    text = f"{phrase('label', 'squares')}\n{phrase('label', 'frame')} {fixed(constants().alike_cosine, 2)}"
    axes.text(0.0, -0.03, text, transform=axes.transAxes, va="top", fontsize=SMALL, color=COLOUR["muted"])


@styled
def draw_fingerprint(trace: Array, station: pd.DataFrame, size: str) -> Figure:
    """What an effect changes: velocities across each section, a line for each experiment; else values along x.

    trace: (station,) [unit of the kind]; station: experiment, kind, section, x, y; size: of the effect, in words.
    """
    table = station.assign(change=trace)
    parts: list[tuple[pd.DataFrame, str, Kind]] = []  # rows and title of each panel: sections, else all of a kind
    for kind in KINDS.values():
        rows = table[table["kind"] == kind.name]
        if len(rows) and not kind.velocity:
            parts.append((rows, f"{kind.instrument}s", kind))
        elif len(rows):
            for name in rows.groupby("section")["x"].mean().sort_values().index:
                part = rows[rows["section"] == name]
                parts.append((part, section_in_words(str(name), float(part["x"].mean())), kind))
    across = min(max(len(parts), 1), FINGERPRINT_COLUMNS)
    down = max(-(-len(parts) // FINGERPRINT_COLUMNS), 1)
    size_of_figure = max(WIDTH, 0.9 + 1.95 * across), 0.5 + 2.3 * down
    figure, grid = canvas(*size_of_figure, nrows=down, ncols=across, squeeze=False)
    for axes in grid.flat[len(parts) :]:
        axes.set_visible(False)
    lines = dict(zip(dict.fromkeys(table["experiment"]), LINE_STYLES * len(table), strict=False))
    for place, (axes, (part, title, kind)) in enumerate(zip(grid.flat, parts, strict=False)):
        along = "y" if kind.velocity else "x"
        axes.axhline(0, color=COLOUR["muted"], linewidth=0.7)
        for experiment, rows in part.sort_values(along).groupby("experiment"):
            line = lines[str(experiment)]
            axes.plot(rows[along], rows["change"], linestyle=line, marker=".", markersize=3, color=COLOUR["model"])
        axes.set_xlabel(f"{along} [m]")
        axes.yaxis.set_major_locator(MaxNLocator(5))
        axes.set_title(title, fontsize=8.5)
        if place % FINGERPRINT_COLUMNS == 0 or kind != parts[place - 1][2]:
            formula_labels(axes, upward=f"change of {kind.column} [{unit_math(kind.unit)}]")
        if kind.velocity:
            change = table.loc[table["kind"] == kind.name, "change"]
            low, high = min(float(change.min()), 0.0), max(float(change.max()), 0.0)
            room = 0.08 * (high - low) or 1.0
            axes.set_ylim(low - room, high + room)
    handles = [
        Line2D([], [], linestyle=line, color=COLOUR["model"], label=experiment) for experiment, line in lines.items()
    ]
    figure.legend(handles=handles, loc="outside upper left", ncols=4, frameon=False, fontsize=SMALL + 0.5)
    figure.suptitle(f"by {size}", x=0.995, ha="right", fontsize=SMALL + 0.5, color=COLOUR["muted"])
    return figure


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
    panels[0, 0].set_ylabel(phrase("label", "level residual"))
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
        axes.scatter(across - 0.4, down, 110 * each / largest, marker="s", facecolor=face, edgecolor=COLOUR["measured"])
        weight, text = "bold" if each > BOLD_MISFIT else "normal", fixed(float(each), int(each < 10.0))
        axes.text(across + 0.01, down, text, ha="right", va="center", fontsize=8, fontweight=weight)
        text = ("+" if miss > 0 else "") + fixed(float(miss), int(abs(miss) < 10.0))
        axes.text(across + 0.46, down, text, ha="right", va="center", fontsize=7, color=COLOUR["muted"])
    for down in range(1, len(rows)):
        if rows[down][0] != rows[down - 1][0]:
            axes.axhline(down - 0.5, color=COLOUR["rule"], linewidth=0.8)
    axes.set(xlim=(-0.6, len(columns) - 0.4), ylim=(len(rows) - 0.4, -0.6))
    axes.set_yticks(range(len(rows)), [f"{experiment}  {section}" for experiment, section in rows])
    axes.set_xticks(range(len(columns)), columns)
    axes.tick_params(length=0, labelsize=8)
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.xaxis.tick_top()


# Effects drawn at once: as many rows as their names stay legible on one screen.
CANDIDATES_DRAWN = 16
# Letters of the verdict in a line: at 11.5 pt more of them run off a figure 14 inches wide.
VERDICT_LINE_LETTERS = 135


def diagnosis_pictures(run: Run, diagnosis: Diagnosis) -> dict[str, list[Picture]]:
    """All figures of a diagnosis, written to run.folder/figures: those as wide as the page, and the others."""
    screening, names = diagnosis.first_screening, accepted_causes(diagnosis)
    threshold = screening.threshold
    wide, narrow = [], []
    table = candidate_table(diagnosis)
    if not table.empty:
        above = sum(abs(diagnosis.first_score(one)) > threshold for one in diagnosis.candidate_effects)
        still = sum(abs(np.nan_to_num(diagnosis.last_score(one))) > threshold for one in diagnosis.candidate_effects)
        said = len(diagnosis.candidate_effects), above, threshold, names, still
        figure = draw_candidates(table, threshold)
        wide.append(published_picture(run, figure, "missing-suspects", "caption_suspects", *said))
    wide += [*place_picture(run, diagnosis), *field_picture(run, diagnosis), *bed_picture(run, diagnosis)]
    if diagnosis.misfit.worst is not None:
        worst, size = diagnosis.misfit.worst
        missed = worst["experiment"], worst["section"], worst["zone"], size, diagnosis.errors.scale
        narrow.append(
            published_picture(run, draw_zones(diagnosis.misfit.zones), "missing-zones", "caption_zones", *missed)
        )
    if len(screening.compared) > 1:
        families = [group for group in alike_groups(screening.compared, screening.cosine) if len(group) > 1]
        figure = draw_alike(screening.compared, screening.cosine)
        narrow.append(published_picture(run, figure, "missing-alike", "caption_alike", families))
    stations = diagnosis.predictions.table
    if (stations["kind"] == WATER_LEVEL).any():
        both = diagnosis.predictions.first, diagnosis.predictions.last
        rms = (1000 * rms_residual(diagnosis, each, WATER_LEVEL) for each in both)
        figure = draw_gauges(stations, names)
        narrow.append(published_picture(run, figure, "missing-gauges", "caption_gauges", *rms, names))
    return {"wide": wide, "narrow": narrow}


def save_diagnosis_figure(diagnosis: Diagnosis, case: Case, path: Path) -> None:
    """Write the whole diagnosis as one screen, PNG or SVG by the ending of `path`."""
    save(draw_diagnosis(diagnosis, outlines(case)), path, dots_per_inch=130)


# Width of a column of the misfit by zone [inch]: a square and two numbers stand in it.
ZONE_WIDTH = 0.72
# What the parts of the picture of a diagnosis show.
TITLES = ("candidates", "alike", "zones", "spots")


def save_fingerprint_figure(trace: np.ndarray, station: pd.DataFrame, size: str, path: Path) -> None:
    """Write what an effect of some size changes at the stations, trace (station,); PNG or SVG by its ending."""
    save(draw_fingerprint(trace, station, size), path)


@styled
def draw_diagnosis(diagnosis: Diagnosis, patches: Sequence[Outline]) -> Figure:
    """Verdict, suspects, what looks alike, where the model misses, and the map of places, on one screen."""
    missed = diagnosis.misfit.zones
    zones_width = max(4.7, 1.2 + ZONE_WIDTH * missed["zone"].nunique()) if len(missed) else 4.7
    figure = Figure(figsize=(9.3 + zones_width, 8.6), layout="constrained")
    title = textwrap.fill(f"{diagnosis.name}: {sentence(Headline(diagnosis.verdict))}", VERDICT_LINE_LETTERS)
    figure.suptitle(title, x=0.01, ha="left", fontsize=11.5, fontweight="bold")
    upper, lower = _split(figure, 2, 1, height_ratios=(2.6, 1))
    suspects, alike, zones = _split(upper, 1, 3, width_ratios=(5.3, 4.0, zones_width))
    for part, title in zip((suspects, alike, zones, lower), TITLES, strict=True):
        part.suptitle(phrase("label", title), x=0.01, ha="left", fontsize=9.5, fontweight="bold")
    scores, visible = suspects.subplots(1, 2, sharey=True, width_ratios=(3, 1))
    paint_candidates(scores, visible, candidate_table(diagnosis), diagnosis.first_screening.threshold)
    paint_alike(alike.subplots(), diagnosis.first_screening.compared, diagnosis.first_screening.cosine)
    if len(missed):
        paint_zones(zones.subplots(), missed)
    mapped = diagnosis.place_map
    if mapped.x.size:
        paint_places(lower.subplots(), mapped.x, mapped.y, mapped.score, mapped.term, plan_marks(diagnosis, patches))
    return figure


def _split(figure: FigureBase, rows: int, columns: int, **ratios: Any) -> list[SubFigure]:
    return list(np.ravel(np.array(figure.subfigures(rows, columns, **ratios), object)))


def candidate_table(found: Diagnosis) -> pd.DataFrame:
    """The strongest candidates and every one that is accepted or a rival, the strongest first."""
    order = sorted(candidate_rows(found), key=lambda row: -abs(np.nan_to_num(found.first_score(row.effect))))
    drawn = [row for k, row in enumerate(order) if k < CANDIDATES_DRAWN or row.effect.name in found.set]
    rows = [
        {"name": row.effect.name, "status": row.status, "first": found.first_score(row.effect),
         "left": found.last_score(row.effect), "visibility": row.effect.detectability.visibility}
        for row in drawn
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=["name", "status", "first", "left", "visibility"])
