"""Figures of a diagnosis: which there are, captions that state the finding, and all of it on one screen."""

import html
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure, FigureBase, SubFigure

from vegglue.calibration.score_test import alike_groups
from vegglue.case.schema import Case
from vegglue.measurements.kinds import WATER_LEVEL
from vegglue.report.cause_pictures import field_picture, outlines, place_picture, plan_marks
from vegglue.report.cause_words import accepted_causes
from vegglue.report.diagnosis_words import (
    ranked_suspects,
    rms_residual,
    standard_errors,
    suspect_status,
)
from vegglue.report.misfit import draw_gauges, draw_zones, paint_zones
from vegglue.report.places import paint_places
from vegglue.report.plan_view import Outline
from vegglue.report.run import Run, published_picture
from vegglue.report.style import Picture, save, styled
from vegglue.report.suspects import draw_alike, draw_fingerprint, draw_suspects, paint_alike, paint_suspects
from vegglue.report.typography import fixed, short
from vegglue.results.diagnosis import Diagnosis
from vegglue.wording.numbers import listed, so_many

# Effects drawn at once: as many rows as their names stay legible on one screen.
SUSPECTS_DRAWN = 16
# Letters of the verdict in a line: at 11.5 pt more of them run off a figure 14 inches wide.
VERDICT_LINE_LETTERS = 135


def diagnosis_pictures(run: Run, diagnosis: Diagnosis) -> dict[str, list[Picture]]:
    """All figures of a diagnosis, written to run.folder/figures: those as wide as the page, and the others."""
    wide = [*_suspects(run, diagnosis), *place_picture(run, diagnosis), *field_picture(run, diagnosis)]
    return {"wide": wide, "narrow": [*_zones(run, diagnosis), *_alike(run, diagnosis), *_gauges(run, diagnosis)]}


def save_diagnosis_figure(diagnosis: Diagnosis, case: Case, path: Path) -> None:
    """Write the whole diagnosis as one screen, PNG or SVG by the ending of `path`."""
    save(draw_diagnosis(diagnosis, outlines(case)), path, dots_per_inch=130)


# Width of a column of the misfit by zone [inch]: a square and two numbers stand in it.
ZONE_WIDTH = 0.72
# What the parts of the picture of a diagnosis show.
TITLES = (
    "What would improve the fit, alone", "What leaves a like trace",
    "Where the model misses, in standard errors (grey: the mean)", "Where a spot would help",
)  # fmt: skip


def save_fingerprint_figure(trace: np.ndarray, station: pd.DataFrame, size: str, path: Path) -> None:
    """Write what an effect of some size changes at the stations, trace (station,); PNG or SVG by its ending."""
    save(draw_fingerprint(trace, station, size), path)


@styled
def draw_diagnosis(diagnosis: Diagnosis, patches: Sequence[Outline]) -> Figure:
    """Verdict, suspects, what looks alike, where the model misses, and the map of places, on one screen."""
    missed = diagnosis.misfit.zones
    zones_width = max(4.7, 1.2 + ZONE_WIDTH * missed["zone"].nunique()) if len(missed) else 4.7
    figure = Figure(figsize=(9.3 + zones_width, 8.6), layout="constrained")
    title = textwrap.fill(
        f"{diagnosis.name}: {diagnosis.verdict.kind}. {diagnosis.verdict.sentence}", VERDICT_LINE_LETTERS
    )
    figure.suptitle(title, x=0.01, ha="left", fontsize=11.5, fontweight="bold")
    upper, lower = _split(figure, 2, 1, height_ratios=(2.6, 1))
    suspects, alike, zones = _split(upper, 1, 3, width_ratios=(5.3, 4.0, zones_width))
    for part, words in zip((suspects, alike, zones, lower), TITLES, strict=True):
        part.suptitle(words, x=0.01, ha="left", fontsize=9.5, fontweight="bold")
    scores, visible = suspects.subplots(1, 2, sharey=True, width_ratios=(3, 1))
    paint_suspects(scores, visible, _suspect_table(diagnosis), diagnosis.first_screening.threshold)
    paint_alike(alike.subplots(), diagnosis.first_screening.compared, diagnosis.first_screening.cosine)
    if len(missed):
        paint_zones(zones.subplots(), missed)
    mapped = diagnosis.place_map
    if mapped.x.size:
        paint_places(lower.subplots(), mapped.x, mapped.y, mapped.score, mapped.term, plan_marks(diagnosis, patches))
    return figure


def _split(figure: FigureBase, rows: int, columns: int, **ratios: Any) -> list[SubFigure]:
    return list(np.ravel(np.array(figure.subfigures(rows, columns, **ratios), object)))


def _suspect_table(diagnosis: Diagnosis) -> pd.DataFrame:
    """The strongest suspects and every one that is accepted or a rival, the strongest first."""
    order = sorted(ranked_suspects(diagnosis), key=lambda one: -abs(np.nan_to_num(diagnosis.first_score(one))))
    drawn = [one for k, one in enumerate(order) if k < SUSPECTS_DRAWN or one.name in diagnosis.set]
    rows = [
        {"name": one.name, "status": suspect_status(diagnosis, one), "first": diagnosis.first_score(one),
         "left": diagnosis.last_score(one), "visibility": one.detectability.visibility}
        for one in drawn
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=["name", "status", "first", "left", "visibility"])


def _suspects(run: Run, diagnosis: Diagnosis) -> Iterator[Picture]:
    table = _suspect_table(diagnosis)
    if table.empty:
        return
    threshold = diagnosis.first_screening.threshold
    out = sum(abs(diagnosis.first_score(one)) > threshold for one in diagnosis.suspects)
    left = [diagnosis.last_score(one) for one in diagnosis.suspects]
    caption = (
        f"<b>Suspects.</b> Of {so_many(len(diagnosis.suspects), 'effect')}, {out} would improve the fit by more than "
        f"errors alone seldom do ({fixed(threshold, 1)} standard errors, dashed)"
    )
    if accepted_causes(diagnosis):
        still = int(np.sum(np.abs(np.nan_to_num(left)) > threshold))
        after = f"{still} still {'does' if still == 1 else 'do'}" if still else "none does any more"
        caption += f"; with {html.escape(accepted_causes(diagnosis))} added, {after} (rings)"
    caption += ". Visibility: the share of its trace that no change of the calibrated parameters can mimic."
    alt = "Effects ranked by score: " + ", ".join(
        f"{row.name} {row.first:.1f} ({row.status})" for row in table.head(6).itertuples()
    )
    yield published_picture(run, draw_suspects(table, threshold), "missing-suspects", caption, alt)


def _gauges(run: Run, diagnosis: Diagnosis) -> Iterator[Picture]:
    stations = diagnosis.predictions.table
    if not (stations["kind"] == WATER_LEVEL).any():
        return
    both = diagnosis.predictions.first, diagnosis.predictions.last
    before, after = (1000 * rms_residual(diagnosis, each, WATER_LEVEL) for each in both)
    finding, names = f"{short(after, 2)} mm", accepted_causes(diagnosis)
    if names:
        finding = f"{short(before, 2)} mm before (hollow) and {finding} with {html.escape(names)} (full)"
    caption = f"<b>Gauges.</b> The model misses the levels by {finding} (root mean square)."
    yield published_picture(run, draw_gauges(stations, names), "missing-gauges", caption, f"Gauges: {finding}.")


def _zones(run: Run, diagnosis: Diagnosis) -> Iterator[Picture]:
    zones, most = diagnosis.misfit.zones, diagnosis.misfit.worst
    if most is None:
        return
    worst, size = most
    finding = (
        f"Largest in {worst['experiment']} {worst['section']}, {worst['zone']}: {fixed(size, 1)} "
        f"{standard_errors(diagnosis)}, where errors alone make 1"
    )
    caption = (
        f"<b>Misfit by zone</b> of the model as it was, root mean square. {html.escape(finding)}. Small: the mean in "
        "its own standard errors; squares are full where more was measured than modelled, hollow where less."
    )
    yield published_picture(run, draw_zones(zones), "missing-zones", caption, f"Misfit by section and zone. {finding}.")


def _alike(run: Run, diagnosis: Diagnosis) -> Iterator[Picture]:
    names, cosine = diagnosis.first_screening.compared, diagnosis.first_screening.cosine
    if len(names) < 2:
        return
    families = [group for group in alike_groups(names, cosine) if len(group) > 1]
    finding = "No two of the strongest suspects leave the same trace"
    if families:
        finding = f"To first order these leave the same trace: {'; '.join(listed(group) for group in families)}"
    caption = f"<b>What looks alike</b>, by the cosine of the traces after calibration. {html.escape(finding)}."
    yield published_picture(
        run, draw_alike(names, cosine), "missing-alike", caption, f"Cosines between traces of effects. {finding}."
    )
