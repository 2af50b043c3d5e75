"""Several runs as one page, the most telling first: their answers, their parameters side by side, and their reports."""

import html
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from vegglue.report.answer import CaseAnswer, answer_of
from vegglue.report.answer_words import headline
from vegglue.report.interval_rows import DrawnInterval, draw_interval_rows
from vegglue.report.key_numbers import as_power, study_value, symbol
from vegglue.report.page_file import rendered, write_page
from vegglue.report.run import Run, file_name
from vegglue.report.style import Picture, publish_text
from vegglue.report.typography import short, unit_html
from vegglue.whole_files import folder_within

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
        rows=[_row(run) for run in runs],
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


def _row(run: Run) -> OverviewRow:
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
