"""One run as one page, a self-contained HTML file that needs no network, with its figures beside it as files; and
several runs on one page: their answers, their parameters side by side, and links to their reports.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.case.resolved_config import resolved_yaml
from vegglue.inference.statements import measurement_error
from vegglue.inference.weighted_statistics import TRUSTED_K_HAT
from vegglue.pages.answer import CaseAnswer, answer_of, headline_lines
from vegglue.pages.diagnosis_figures import diagnosis_pictures
from vegglue.pages.findings import findings, provenance, run_health, station_rows
from vegglue.pages.headline import diagnosis_section
from vegglue.pages.parameters import (
    as_power,
    fit_rows,
    key_parameters,
    parameter_row,
    parameter_rows,
    posterior_verdict,
    study_value,
)
from vegglue.pages.posterior_figures import pictures
from vegglue.pages.run import Run, file_name, is_synthetic
from vegglue.pages.style import Picture, publish_text
from vegglue.pages.svg import (
    COLOUR,
    FEWEST_TICKS,
    axis_below,
    linear_scale,
    palette_css,
    round_ticks,
    svg_document,
    svg_element,
    svg_words,
    tick_labels,
    within_width,
)
from vegglue.whole_files import folder_within, write_file
from vegglue.wording.remedies import MAKE_ROOM
from vegglue.wording.sentences import page_document, page_phrase, phrase, sentence


def write_report(run: Run) -> Path:
    """Write run.folder/report.html and figures/*.svg beside it; what `run` lacks is left out of it.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    StorageError
        If a file cannot be written.
    """
    path = run.folder / "report.html"
    write_file(path, render(run).encode(), MAKE_ROOM)
    return path


def render(run: Run) -> str:
    """The whole page as text; writes the figures as files on the way."""
    stations, found, fit = station_rows(run), findings(run), fit_rows(run)
    notes = run.diagnosis.verdict.notes if run.diagnosis else ()
    light, dark = palette_css()
    return page_document(
        "report.html.j2",
        light=light,
        dark=dark,
        top=answer_of(run),
        caveats=len(notes) + sum(limits for _, limits in found),
        case=run.case,
        synthetic=is_synthetic(run.case),
        verdict=posterior_verdict(run.case, run.posterior),
        parameters=key_parameters(run),
        error=measurement_error(run.posterior, next(iter(run.posterior.fit.sigma))),
        rows=parameter_rows(run),
        fit=fit,
        findings=found,
        diagnosis=None if run.diagnosis is None else diagnosis_section(run.diagnosis),
        diagnosis_pictures={} if run.diagnosis is None else diagnosis_pictures(run, run.diagnosis),
        pictures=pictures(run),
        stations=stations,
        flagged=[row for row in stations if row.reason],
        health=run_health(run),
        trusted_k=TRUSTED_K_HAT,
        made=provenance(run),
        config=resolved_yaml(run.case),
    )


# The picture [px], legible on a telephone of 360 px; the height of a row, of its words in it, and of the foot.
INTERVALS_WIDTH, INTERVALS_LETTERS, ROW, WORDS, INTERVALS_FOOT = 460.0, 13.0, 40.0, 18.0, 28.0
START, END = 12.0, 440.0
# Share of the range that stays free beyond its ends.
FREE_BEYOND = 0.06
# Range of an axis with one value, over that value: enough for round numbers on both sides of it.
ALONE = 0.1


@dataclass(frozen=True)
class DrawnInterval:
    """A value and the range it is given; both ends are the value if it has none. others: not a posterior of ours."""

    low: float
    centre: float
    high: float
    others: bool = False


def draw_interval_rows(rows: Mapping[str, DrawnInterval], logarithmic: bool, title: str) -> str:
    """SVG text. rows: intervals of one unit by what they are of; logarithmic: equal ratios are equally long."""
    known = np.array([value for row in rows.values() for value in (row.low, row.centre, row.high)])
    ends = np.log10([known.min(), known.max()]) if logarithmic else np.array([known.min(), known.max()])
    spread = float(ends[1] - ends[0])
    if spread <= 1e-6 * abs(float(ends[1])):  # one value alone
        spread = ALONE * abs(float(ends[1])) or ALONE
    low, high = float(ends[0]) - FREE_BEYOND * spread, float(ends[1]) + FREE_BEYOND * spread
    place = linear_scale(low, high, START, END)

    def scale(value: Any) -> Array:
        return place(np.log10(value) if logarithmic else value)

    foot = ROW * len(rows) + 6.0
    ticks = round_ticks(low, high, 6)
    if logarithmic:  # powers of ten, with 2 and 5 times them if these are few; else round numbers
        powers = range(int(np.floor(low)), int(np.ceil(high)) + 1)
        factors = (1.0, 2.0, 5.0) if high - low < 2.0 else (1.0,)
        values = [factor * 10.0**power for power in powers for factor in factors]
        inside = [value for value in values if low <= np.log10(value) <= high]
        ticks = inside if len(inside) >= FEWEST_TICKS else round_ticks(10.0**low, 10.0**high, 5)
    labels = [f"{tick:.4g}" for tick in ticks]
    if not logarithmic or len(set(labels)) < len(labels):
        labels = tick_labels(ticks)
    parts = axis_below(scale, ticks, labels, foot)
    for number, (words, row) in enumerate(rows.items()):  # words above a line with its centre
        height, colour = ROW * number + WORDS, "measured" if row.others else "model"
        shown = within_width(words, INTERVALS_WIDTH, INTERVALS_LETTERS)
        parts.append(svg_words(0.0, height - 4, shown, "muted" if row.others else "ink"))
        centre, level = float(scale(row.centre)), height + 9.0
        if row.high > row.low:
            line = f"M{float(scale(row.low)):.1f},{level:g}H{float(scale(row.high)):.1f}"
            dashes = {"stroke_dasharray": "5 3"} if row.others else {}
            parts.append(svg_element("path", d=line, stroke=COLOUR[colour], stroke_width=3, **dashes))
        if row.others:
            diamond = f"M{centre:.1f},{level - 6:g}l6,6l-6,6l-6,-6z"
            parts.append(svg_element("path", d=diamond, fill=COLOUR["paper"], stroke=COLOUR[colour], stroke_width=2))
        else:
            parts.append(svg_element("circle", cx=centre, cy=level, r=6.0, fill=COLOUR[colour]))
    return svg_document(INTERVALS_WIDTH, foot + INTERVALS_FOOT, parts, title, INTERVALS_LETTERS)


# Standard deviations on both sides that hold some 95 %, for values of others that are stated with one.
BOTH_SIDES = 2.0


@dataclass(frozen=True)
class LoopOfOverview:
    """A run that was taken round the loop: its answer, where its report lies, and its place in the page."""

    anchor: str
    title: str
    page: str
    top: CaseAnswer

    @property
    def tour(self) -> bool:
        """Whether there is a before and an after to be shown in three clicks."""
        fall = self.top.error_fall
        return self.top.falls and bool(self.top.sections.added) and fall is not None and math.isfinite(fall.before)


@dataclass(frozen=True)
class OverviewRow:
    """One line of the table of runs; members: of its ensemble and draws of its own, 0 without."""

    name: str
    title: str
    page: str
    headline: list[object]
    refined: bool
    members: int
    drawn: int
    effective_size: float


@dataclass(frozen=True)
class IntervalOf:
    """What an interval of the overview is of: a run, or (members None) a value of others with the runs it is for."""

    name: str
    effective_size: float = 0.0
    members: int | None = None
    runs: tuple[str, ...] = ()


def write_overview(path: Path, runs: Sequence[Run]) -> Path:
    """Write a page about runs whose folders lie beside it, with pictures in figures.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    StorageError
        If a file cannot be written.
    """
    write_file(path, render_overview(path.parent, runs).encode(), MAKE_ROOM)
    return path


def render_overview(folder: Path, runs: Sequence[Run]) -> str:
    """The page as text; writes the pictures on the way."""
    loops: dict[str, LoopOfOverview] = {}  # runs that know what they lack, each ladder once
    for run in runs:
        first = run.loop.ladder.steps[0].name if run.loop.ladder else run.case.name
        if run.behind is not None and first not in loops:
            title, name = run.case.title or run.case.name, run.case.name
            loops[first] = LoopOfOverview(file_name(name), title, f"{name}/report.html", answer_of(run))
    rows = []
    for run in runs:
        posterior, ensemble, name = run.posterior, run.ensemble, run.case.name
        refined, members = posterior.refinement is not None, 0 if ensemble is None else len(ensemble.status)
        rows.append(OverviewRow(
            name, run.case.title, f"{name}/report.html", headline_lines(run), refined, members,
            posterior.sample.members if refined else 0, max(posterior.weighting.effective_size, 1.0),
        ))  # fmt: skip
    alike: dict[tuple[str, object], list[Run]] = {}  # runs whose parameter has one name, unit and prior
    for name in dict.fromkeys(name for run in runs for name in run.posterior.parameters):
        for run in (one for one in runs if name in one.posterior.parameters):
            prior = run.case.parameters[name].model_dump(exclude={"symbol", "meaning"})
            alike.setdefault((name, tuple(sorted(prior.items()))), []).append(run)
    shared = [(name, those) for (name, _), those in alike.items() if len(those) > 1]
    shown = [run for _, those in shared for run in those]
    light, dark = palette_css()
    return page_document(
        "overview.html.j2",
        light=light,
        dark=dark,
        loops=list(loops.values()),
        rows=rows,
        compared=[_side_by_side(folder, name, those) for name, those in shared],
        others=any(run.case.reference for run in shown),
        first_looks=any(not run.posterior.claimed for run in shown),
    )


def _side_by_side(folder: Path, name: str, runs: Sequence[Run]) -> Picture:
    """Medians with 95 % ranges, medians alone if the effective sample is too small; then values of others, each once
    with the runs it is for: of the source of a case, and what a synthetic record was made with.
    """
    rows: dict[IntervalOf, DrawnInterval] = {}
    of_others: dict[tuple[str, DrawnInterval], list[str]] = {}
    for run in runs:
        posterior, marginals, reference = run.posterior, run.posterior.marginals, run.case.reference
        median = float(marginals.median[name])
        low, high = marginals.quantiles[name][[0, -1]] if posterior.claimed else (median, median)
        size = max(posterior.weighting.effective_size, 1.0)
        rows[IntervalOf(run.case.name, size, posterior.sample.members)] = DrawnInterval(float(low), median, float(high))
        stated = study_value(run.case, posterior, name)
        if reference is not None and stated is not None:
            reach, powers = 0.0 if math.isnan(stated[1]) else BOTH_SIDES * stated[1], as_power(posterior, name)
            least, middle, most = (
                10.0**end if powers else end for end in (stated[0] - reach, stated[0], stated[0] + reach)
            )
            drawn = DrawnInterval(least, middle, most, others=True)
            of_others.setdefault((reference.source, drawn), []).append(run.case.name)
        if reference is not None and name in reference.made_with:
            made = float(reference.made_with[name])
            drawn = DrawnInterval(made, made, made, others=True)
            of_others.setdefault((phrase("label", "made with"), drawn), []).append(run.case.name)
    rows |= {IntervalOf(source, runs=tuple(names)): drawn for (source, drawn), names in of_others.items()}
    named = {sentence(of): row for of, row in rows.items()}
    svg = draw_interval_rows(named, as_power(runs[0].posterior, name), name)
    row = parameter_row(runs[0], name)
    picture = f"parameter-{file_name(name)}"
    texts = page_phrase("caption_parameter", row, []), phrase("caption_parameter", row, [*named])
    return publish_text(svg, folder_within(folder, "figures"), picture, *texts)
