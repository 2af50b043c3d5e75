"""Several runs on one page: their answers, their parameters side by side, and links to their reports."""

import html
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.pages.answer import CaseAnswer, answer_of
from vegglue.pages.answer_words import headline
from vegglue.pages.key_numbers import as_power, study_value, symbol
from vegglue.pages.page_file import rendered, write_page
from vegglue.pages.run import Run, file_name
from vegglue.pages.style import COLOUR, Picture, publish_text
from vegglue.pages.svg import (
    FEWEST_TICKS,
    Scale,
    axis_below,
    linear_scale,
    round_ticks,
    svg_document,
    svg_element,
    svg_words,
    tick_labels,
    within_width,
)
from vegglue.pages.typography import short, unit_html
from vegglue.whole_files import folder_within

# The picture [px], legible on a telephone of 360 px; the height of a row, of its words in it, and of the foot.
INTERVALS_WIDTH, INTERVALS_LETTERS, ROW, WORDS, FOOT = 460.0, 13.0, 40.0, 18.0, 28.0
START, END = 12.0, 440.0
# Share of the range that stays free beyond its ends.
FREE_BEYOND = 0.06
# Range of an axis with one value, over that value: enough for round numbers on both sides of it.
ALONE = 0.1


@dataclass(frozen=True)
class DrawnInterval:
    """A value and the range it is given; both ends are the value where nobody said. others: not a posterior of ours."""

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
    ticks = _powers(low, high) if logarithmic else round_ticks(low, high, 6)
    labels = [f"{tick:.4g}" for tick in ticks]
    if not logarithmic or len(set(labels)) < len(labels):
        labels = tick_labels(ticks)
    parts = axis_below(scale, ticks, labels, foot, INTERVALS_WIDTH, "")
    for number, (words, row) in enumerate(rows.items()):
        parts += _interval_row(scale, words, row, ROW * number + WORDS)
    return svg_document(INTERVALS_WIDTH, foot + FOOT, parts, title, INTERVALS_LETTERS)


def _powers(low: float, high: float) -> list[float]:
    """Powers of ten from 10^low to 10^high, with 2 and 5 times them where they are few; else round numbers."""
    factors = (1.0, 2.0, 5.0) if high - low < 2.0 else (1.0,)
    powers = range(int(np.floor(low)), int(np.ceil(high)) + 1)
    values = [factor * 10.0**power for power in powers for factor in factors]
    inside = [value for value in values if low <= np.log10(value) <= high]
    return inside if len(inside) >= FEWEST_TICKS else round_ticks(10.0**low, 10.0**high, 5)


def _interval_row(scale: Scale, words: str, row: DrawnInterval, height: float) -> list[str]:
    """Words above a line from low to high with its centre: a dot of ours, a diamond of others."""
    colour = "measured" if row.others else "model"
    shown = within_width(words, INTERVALS_WIDTH, INTERVALS_LETTERS)
    parts = [svg_words(0.0, height - 4, shown, "muted" if row.others else "ink")]
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
    return parts


# How methods are called in a table.
METHODS = {"glue": "members weighed (GLUE)", "refine": "draws around the best"}
# Standard deviations on both sides that hold some 95 %, for values of others that are stated with one.
BOTH_SIDES = 2.0


@dataclass(frozen=True)
class LoopOfOverview:
    """A run that was taken round the loop: its answer, where its report lies, and its place in the page."""

    anchor: str
    title: str
    page: str
    top: CaseAnswer


@dataclass(frozen=True)
class OverviewRow:
    """One line of the table of runs (text, but headline, which is HTML)."""

    name: str
    title: str
    page: str
    headline: str
    method: str
    members: str
    worth: str


def write_overview(path: Path, runs: Sequence[Run]) -> Path:
    """Write a page about runs whose folders lie beside it, with pictures in figures; returns the page.

    Errors: StorageError when a file cannot be written.
    """
    return write_page(path, lambda: render_overview(path.parent, runs))


def render_overview(folder: Path, runs: Sequence[Run]) -> str:
    """The page as text; writes the pictures on the way."""
    shared = list(_shared_parameters(runs))
    compared = [_side_by_side(folder, name, those) for name, those in shared]
    shown = [run for _, those in shared for run in those]
    return rendered(
        "overview.html.j2",
        loops=list(_loops(runs)),
        rows=[_run_row(run) for run in runs],
        compared=compared,
        others=any(run.case.reference for run in shown),
        first_looks=any(not run.posterior.claimed for run in shown),
    )


def _loops(runs: Sequence[Run]) -> Iterator[LoopOfOverview]:
    """Runs that know what they lack, each ladder once."""
    told: set[str] = set()
    for run in runs:
        if run.behind is None:
            continue
        ladder = run.loop.ladder
        first = ladder.steps[0].name if ladder else run.case.name
        if first not in told:
            told.add(first)
            yield LoopOfOverview(file_name(run.case.name), run.case.title or run.case.name, _page(run), answer_of(run))


def _page(run: Run) -> str:
    return f"{run.case.name}/report.html"


def _run_row(run: Run) -> OverviewRow:
    posterior = run.posterior
    size = posterior.weighting.effective_size
    members = [] if run.ensemble is None else [f"{len(run.ensemble.status):,}"]
    drawn = [f"{posterior.sample.members:,} drawn"] if posterior.refinement else []
    method = METHODS["refine" if posterior.refinement else "glue"]
    return OverviewRow(
        run.case.name,
        run.case.title,
        _page(run),
        headline(run),
        method,
        ", ".join(members + drawn),
        f"{max(size, 1.0):,.0f}",
    )


def _shared_parameters(runs: Sequence[Run]) -> Iterator[tuple[str, list[Run]]]:
    """Parameters that have one name, unit and prior in at least two runs, and those runs."""
    names = dict.fromkeys(name for run in runs for name in run.posterior.parameters)
    for name in names:
        groups: dict[tuple[object, ...], list[Run]] = {}
        for run in runs:
            if name in run.posterior.parameters:
                prior = run.case.parameters[name]
                told = tuple(sorted(prior.model_dump(exclude={"symbol", "meaning"}).items()))
                groups.setdefault(told, []).append(run)
        yield from ((name, those) for those in groups.values() if len(those) > 1)


def _side_by_side(folder: Path, name: str, runs: Sequence[Run]) -> Picture:
    rows = {_words(run): _interval(run, name) for run in runs} | _of_others(runs, name)
    unit = unit_html(runs[0].posterior.sample.unit[name])
    powers = as_power(runs[0].posterior, name)
    told = "; ".join(f"{words}: {short(row.centre)}" for words, row in rows.items())
    meaning = runs[0].case.parameters[name].meaning
    svg = draw_interval_rows(rows, powers, f"{name} in {len(runs)} runs")
    of_what = f": {html.escape(meaning)}" if meaning else ""
    caption = f"{symbol(runs[0].case, name)}{f' [{unit}]' if unit else ''}{of_what}"
    return publish_text(
        svg, folder_within(folder, "figures"), f"parameter-{file_name(name)}", caption, f"{name}. {told}."
    )


def _words(run: Run) -> str:
    size = max(run.posterior.weighting.effective_size, 1.0)
    return f"{run.case.name}, worth {size:,.0f} of {run.posterior.sample.members:,} members"


def _interval(run: Run, name: str) -> DrawnInterval:
    """Median and 95 % range; the median alone where too few members carry the weight."""
    median = float(run.posterior.marginals.median[name])
    low, high = run.posterior.marginals.quantiles[name][[0, -1]] if run.posterior.claimed else (median, median)
    return DrawnInterval(float(low), median, float(high))


def _of_others(runs: Sequence[Run], name: str) -> dict[str, DrawnInterval]:
    """What others state for a parameter, each value once, with the runs it is for."""
    of_whom: dict[tuple[str, DrawnInterval], list[str]] = {}
    for run in runs:
        for told in _references(run, name):
            of_whom.setdefault(told, []).append(run.case.name)
    return {f"{source} ({', '.join(names)})": value for (source, value), names in of_whom.items()}


def _references(run: Run, name: str) -> Iterator[tuple[str, DrawnInterval]]:
    """What the source of a case states for a parameter, and what a synthetic record was made with."""
    reference = run.case.reference
    if reference is None:
        return
    stated = study_value(run.case, run.posterior, name)
    if stated is not None:
        centre, reach = stated[0], 0.0 if math.isnan(stated[1]) else BOTH_SIDES * stated[1]
        powers = as_power(run.posterior, name)
        low, middle, high = (10.0**one if powers else one for one in (centre - reach, centre, centre + reach))
        yield reference.source, DrawnInterval(low, middle, high, others=True)
    if name in reference.made_with:
        made = float(reference.made_with[name])
        yield "the record was made with", DrawnInterval(made, made, made, others=True)
