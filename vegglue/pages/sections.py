"""Measured against modelled across all sections, before and after what was missing is added."""

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.gridded_site import in_experiment
from vegglue.case.text_files import unused
from vegglue.measurements.kinds import STREAMWISE, Kind, kind_of, velocity_rows
from vegglue.normal_range import NORMAL95
from vegglue.pages.cause_words import accepted_causes
from vegglue.pages.run import Run, file_name, planted_cells, published_svg, stamp
from vegglue.pages.style import COLOUR, Picture
from vegglue.pages.svg import (
    Scale,
    area_between,
    line_through,
    linear_scale,
    round_ticks,
    svg_document,
    svg_element,
    svg_words,
    tick_labels,
    within_width,
)
from vegglue.pages.typography import as_given, short
from vegglue.wording.numbers import section_in_words, so_many

# A panel [px]: four of them stand side by side on a screen of 1,200; letters of the size of the captions.
PANEL_WIDTH, PANEL_HEIGHT, PANEL_LETTERS, NOTE_LETTERS = 240.0, 222.0, 11.5, 9.0
PANEL_LEFT, PANEL_RIGHT, PANEL_TOP, PANEL_LOWEST, PANEL_BED_TOP, PANEL_BED_FOOT = 28.0, 236.0, 24.0, 154.0, 160.0, 190.0
PANEL_TICKS = 5
PANEL_TITLE = 186.0  # room of the title [px], beside the unit
FAINT_LINE: dict[str, Any] = {"stroke_width": 0.9, "stroke_dasharray": "2 2.5"}
AXIS_CLEAR = 18.0  # of the name of the axis [px]
LARGE_DOT, SMALL_DOT = 3.6, 2.6
Edges = tuple[Array, Array]  # lower and upper


@dataclass(frozen=True)
class PanelGround:
    """What lies under a section, at cell centres y (cells,): level of the bed [m], and whether plants stand there."""

    y: Array
    bed: Array
    planted: NDArray[np.bool_]


@dataclass(frozen=True)
class SectionPanel:
    """One section of one experiment; (station,) each, ordered by y. error: 95 % of the standard error, NaN unknown;
    aside: set aside or not used; before: None where nothing was added; band: 95 % of the posterior, if any; core and
    total: 50 %, and 95 % with the residual error, where they are to be seen [SI].
    """

    title: str
    y: Array
    measured: Array
    error: Array
    aside: NDArray[np.bool_]
    before: Array | None
    after: Array
    band: Edges | None
    core: Edges | None
    total: Edges | None
    ground: PanelGround


@dataclass(frozen=True)
class DrawnPanel:
    """A panel as SVG text, and where its stations are in it [px]: across, and down of each line, NaN where unknown."""

    svg: str
    across: Array
    down: dict[str, Array]


def value_range(panels: Sequence[SectionPanel]) -> tuple[float, float]:
    """The range of values that holds all panels, from zero on where nothing flows back [unit of the values]."""
    values = np.concatenate([part for panel in panels for part in _all_values(panel)])
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    low = min(low, 0.0) if low < 0.4 * high else low
    margin = 0.06 * max(high - low, 1e-3)
    return (low - margin if low else 0.0), high + margin


def _all_values(panel: SectionPanel) -> list[Array]:
    error = np.nan_to_num(panel.error)
    edges = [edge for pair in (panel.band, panel.total) if pair is not None for edge in pair]
    before = [] if panel.before is None else [panel.before]
    return [panel.measured - error, panel.measured + error, panel.after, *before, *edges]


def draw_panel(panel: SectionPanel, values: tuple[float, float], unit: str, note: str = "") -> DrawnPanel:
    """The panel with values (low, high) from foot to head; note: in its corner."""
    margin = 0.08 * float(np.ptp(panel.y)) + 0.1
    ends = float(panel.y.min()) - margin, float(panel.y.max()) + margin
    across, down = linear_scale(*ends, PANEL_LEFT, PANEL_RIGHT), linear_scale(*values, PANEL_LOWEST, PANEL_TOP)
    parts = [
        *_ground(panel.ground, across, ends),
        *_axes(across, down, ends, values, unit),
        *_lines(panel, across, down),
        *_points(panel, across, down),
        _cursor(),
        svg_words(0.0, 13.0, within_width(panel.title, PANEL_TITLE, PANEL_LETTERS), font_weight="bold"),
        svg_words(PANEL_RIGHT, PANEL_HEIGHT - 3, note, "muted", font_size=NOTE_LETTERS, text_anchor="end"),
    ]
    places = {"measured": down(panel.measured), "after": down(panel.after)}
    if panel.before is not None:
        places["before"] = down(panel.before)
    svg = svg_document(PANEL_WIDTH, PANEL_HEIGHT, parts, panel.title, PANEL_LETTERS)
    return DrawnPanel(svg, across(panel.y), places)


def _axes(across: Scale, down: Scale, ends: tuple[float, float], values: tuple[float, float], unit: str) -> list[str]:
    parts = []
    ticks = round_ticks(*values, PANEL_TICKS)
    for tick, words in zip(ticks, tick_labels(ticks), strict=True):
        height = float(down(tick))
        parts.append(
            svg_element(
                "path", d=f"M{PANEL_LEFT:g},{height:.1f}H{PANEL_RIGHT:g}", stroke=COLOUR["rule"], stroke_width=0.7
            )
        )
        parts.append(svg_words(PANEL_LEFT - 5, height + 4, words, "muted", text_anchor="end"))
    places = [tick for tick in round_ticks(*ends, PANEL_TICKS) if across(tick) > PANEL_LEFT + AXIS_CLEAR]
    for tick, words in zip(places, tick_labels(places), strict=True):
        at = float(across(tick))
        parts.append(svg_element("path", d=f"M{at:.1f},{PANEL_BED_FOOT:g}v4", stroke=COLOUR["muted"], stroke_width=0.7))
        parts.append(svg_words(at, PANEL_BED_FOOT + 16, words, "muted", text_anchor="middle"))
    parts.append(svg_words(PANEL_RIGHT, 13.0, unit, "muted", text_anchor="end"))
    parts.append(svg_words(0.0, PANEL_BED_FOOT + 16, "y [m]", "muted"))
    return parts


def _ground(ground: PanelGround, across: Scale, ends: tuple[float, float]) -> list[str]:
    """The bed in a strip below, and the plants as shaded stretches through the panel."""
    step = float(ground.y[1] - ground.y[0])
    near = (ground.y > ends[0] - step) & (ground.y < ends[1] + step)
    y, bed = np.clip(ground.y[near], *ends), ground.bed[near]
    rise = max(float(np.ptp(bed)), 0.2)
    level = linear_scale(float(bed.min()) - 0.25 * rise, float(bed.min()) + rise, PANEL_BED_FOOT, PANEL_BED_TOP)
    x = across(y)
    parts = [
        svg_element("path", d=area_between(x, np.full(x.size, PANEL_BED_FOOT), level(bed)), fill=COLOUR["earth"]),
    ]
    planted = ground.planted[near].astype(int)
    starts = np.flatnonzero(np.diff(np.r_[0, planted, 0]) == 1)
    stops = np.flatnonzero(np.diff(np.r_[0, planted, 0]) == -1) - 1
    for start, stop in zip(starts, stops, strict=True):
        edges = across(np.clip(np.array([y[start] - 0.5 * step, y[stop] + 0.5 * step]), *ends))
        left, width = float(edges[0]), float(edges[1] - edges[0])
        parts.append(
            svg_element(
                "rect",
                x=left,
                y=PANEL_TOP,
                width=width,
                height=PANEL_BED_FOOT - PANEL_TOP,
                fill=COLOUR["plants"],
                opacity=0.45,
            )
        )
        parts.append(
            svg_words(left + 0.5 * width, PANEL_BED_TOP + 8, "plants", "stems", text_anchor="middle", font_size=10)
        )
    return parts


def _lines(panel: SectionPanel, across: Scale, down: Scale) -> list[str]:
    x = across(panel.y)
    parts = []
    for edges, colour in ((panel.band, "wide"), (panel.core, "narrow")):
        if edges is not None:
            area = area_between(x, down(edges[0]), down(edges[1]))
            parts.append(svg_element("path", class_="band", d=area, fill=COLOUR[colour]))
    for edge in panel.total or ():
        parts.append(
            svg_element("path", d=line_through(x, down(edge)), fill="none", stroke=COLOUR["model"], **FAINT_LINE)
        )
    if panel.before is not None:
        parts.append(
            svg_element(
                "path", class_="before", d=line_through(x, down(panel.before)), fill="none", stroke=COLOUR["muted"],
                stroke_width=1.8, stroke_dasharray="5 3",
            )
        )  # fmt: skip
    parts.append(
        svg_element(
            "path", class_="after", d=line_through(x, down(panel.after)), fill="none", stroke=COLOUR["model"],
            stroke_width=2,
        )
    )  # fmt: skip
    return parts


def _points(panel: SectionPanel, across: Scale, down: Scale) -> list[str]:
    """Measured values with their errors; hollow and crossed where they do not count."""
    parts = []
    for y, value, error, aside in zip(panel.y, panel.measured, panel.error, panel.aside, strict=True):
        if not np.isfinite(value):
            continue
        x, middle = float(across(y)), float(down(value))
        if np.isfinite(error):
            low, high = float(down(value - error)), float(down(value + error))
            parts.append(
                svg_element("path", d=f"M{x:.1f},{low:.1f}V{high:.1f}", stroke=COLOUR["measured"], stroke_width=1)
            )
        face = COLOUR["paper"] if aside else COLOUR["measured"]
        parts.append(svg_element("circle", cx=x, cy=middle, r=SMALL_DOT, fill=face, stroke=COLOUR["measured"]))
        if aside:
            cross = f"M{x - 5:.1f},{middle - 5:.1f}l10,10m0,-10l-10,10"
            parts.append(svg_element("path", d=cross, stroke=COLOUR["ink"], stroke_width=1.3))
    return parts


def _cursor() -> str:
    """What a page moves to the station that is read, hidden until then."""
    line = svg_element("path", d=f"M0,{PANEL_TOP:g}V{PANEL_BED_FOOT:g}", stroke=COLOUR["ink"], stroke_width=0.8)
    rings = "".join(
        svg_element("circle", class_=name, r=LARGE_DOT + 1.5, fill="none", stroke=COLOUR[colour], stroke_width=1.8)
        for name, colour in (("measured", "measured"), ("before", "muted"), ("after", "model"))
    )
    return svg_element("g", line + rings, class_="cursor", visibility="hidden")


# What makes two rows of two tables one station.
STATION_KEY = ["experiment", "kind", "section", "x", "y"]
CENTIMETRES = 2  # decimals of places [m]: no tape tells more, and places turned from a map have more
# Edges of the bands of a posterior: 95 %, 50 %, and 95 % with the residual error.
EDGES = ["low", "high", "low50", "high50", "total_low", "total_high"]
# What HTML would take for markup, as JSON writes it too.
ESCAPED = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028", "\u2029": "\\u2029"}


@dataclass(frozen=True)
class ExperimentPanels:
    """The sections of one experiment; name: of the experiment; worst: root mean square of what was missed at first."""

    name: str
    pictures: list[Picture]
    worst: float


@dataclass(frozen=True)
class SectionPanels:
    """All sections, the experiment that was missed most first. added: what stands between before and after, '' for
    nothing; banded, any_aside: whether a posterior and stations that were set aside are shown; data: numbers of all
    stations as JSON that is safe in a page.
    """

    experiments: list[ExperimentPanels]
    added: str
    banded: bool
    any_aside: bool
    data: str

    @property
    def choices(self) -> list[tuple[int, str]]:
        """Place and name of each experiment."""
        return [(place, one.name) for place, one in enumerate(self.experiments)]


def section_panels(run: Run) -> SectionPanels:
    """Every section at which velocities were measured, drawn and written to run.folder/figures."""
    stations = _stations(run)
    stations = stations[velocity_rows(stations) & np.isfinite(stations["value"].to_numpy(float))]
    added = accepted_causes(run.behind) if run.behind else ""
    taken: set[str] = set()
    experiments, data = [], []
    for (experiment, kind), rows in stations.groupby(["experiment", "kind"], sort=False):
        drawn = list(_drawn(run, str(experiment), kind_of(str(kind)), rows, bool(added), taken))
        data += [numbers for _, numbers in drawn]
        name = str(experiment) if kind == STREAMWISE else f"{experiment}, {kind_of(str(kind)).words}"
        experiments.append(ExperimentPanels(name, [picture for picture, _ in drawn], _missed(rows)))
    experiments.sort(key=lambda one: -one.worst)
    banded, aside = (bool(column.any()) for column in (stations["low"].notna(), stations["aside"]))
    return SectionPanels(experiments, added, banded, aside, safe_json(data))


def safe_json(tree: Any) -> str:
    """The tree as JSON that ends no script element, whatever users wrote."""
    text = json.dumps(tree, ensure_ascii=False, allow_nan=False)
    return "".join(ESCAPED.get(letter, letter) for letter in text)


def _stations(run: Run) -> pd.DataFrame:
    """Stations with columns before, after, low and high: of the diagnosis where there is one, else of the posterior."""
    band, total = run.posterior.predicted.model_band, run.posterior.predicted.total_band
    levels = {"low": band[0], "low50": band[1], "middle": band[2], "high50": band[3], "high": band[4]}
    own = run.observations.table.assign(**levels, total_low=total[0], total_high=total[-1])
    if run.behind is None:
        return own.assign(before=own["middle"], after=own["middle"], aside=~own["used"])
    told = run.behind.predictions.table.rename(columns={"prediction_first": "before", "prediction": "after"})
    aside = ~told["used"]
    aside.iloc[list(run.behind.errors.flagged)] = True
    edges = own.drop_duplicates(STATION_KEY)[[*STATION_KEY, *EDGES]]
    return told.assign(aside=aside).merge(edges, on=STATION_KEY, how="left")


def _missed(rows: pd.DataFrame) -> float:
    left = (rows["value"] - rows["before"])[~rows["aside"]]
    return float(np.sqrt(np.mean(left**2))) if len(left) else 0.0


def _drawn(
    run: Run, experiment: str, kind: Kind, rows: pd.DataFrame, added: bool, taken: set[str]
) -> Iterator[tuple[Picture, dict[str, Any]]]:
    """Each section of one experiment as a picture, and its numbers; taken: names of files in use, added to."""
    places = rows.groupby("section")["x"].mean().sort_values()
    panels = [_panel(run, experiment, rows[rows["section"] == section], added) for section in places.index]
    values = value_range(panels)
    for section, panel in zip(places.index, panels, strict=True):
        words = f"{'section' if kind.name == STREAMWISE else kind.name}-{experiment}-{section}"
        name = unused(file_name(words), taken)
        taken.add(name)
        drawn = draw_panel(panel, values, f"{kind.column} [{kind.unit}]", stamp(run.case))
        alt = f"{kind.words.capitalize()} across {panel.title}, experiment {experiment}: {panel_words(panel)}."
        reasons = rows[rows["section"] == section].sort_values("y")["reason"].tolist()
        picture = published_svg(run, drawn.svg, name, panel_words(panel), alt)
        yield picture, _numbers(picture.name, kind, panel, drawn) | {"reason": reasons}


def _panel(run: Run, experiment: str, rows: pd.DataFrame, added: bool) -> SectionPanel:
    rows = rows.sort_values("y")
    x = float(rows["x"].mean())
    values = {name: rows[name].to_numpy(float) for name in ("y", "value", "before", "after", *EDGES)}
    band, core, total = (
        None if np.isnan(values[low]).all() else (values[low], values[high])
        for low, high in zip(EDGES[::2], EDGES[1::2], strict=True)
    )
    return SectionPanel(
        title=section_in_words(str(rows["section"].iloc[0]), x),
        y=values["y"],
        measured=values["value"],
        error=NORMAL95 * rows["standard_error"].to_numpy(float),
        aside=rows["aside"].to_numpy(),
        before=values["before"] if added else None,
        after=values["after"],
        band=band,
        core=None if added else core,
        total=None if added else total,
        ground=_ground_at(run, experiment, x),
    )


def _ground_at(run: Run, experiment: str, x: float) -> PanelGround:
    grid = run.site.grid
    column = int(np.argmin(np.abs(grid.x - x)))
    return PanelGround(grid.y, in_experiment(run.site, experiment).bed[column], planted_cells(run, experiment)[column])


def panel_words(panel: SectionPanel) -> str:
    """Where a section was missed most, by how much before and after, and how many stations errors explain (text)."""
    counted = ~panel.aside
    if not counted.any():
        return "no measurement counts here"
    left = np.where(counted, np.abs(panel.measured - panel.after), -1.0)
    first = left if panel.before is None else np.where(counted, np.abs(panel.measured - panel.before), -1.0)
    worst = int(np.argmax(first))
    after = "" if panel.before is None else f", with it by {short(float(left[worst]), 2)}"
    y = as_given(round(float(panel.y[worst]), CENTIMETRES))
    missed = "misses most" if panel.before is None else "missed most"
    held = "" if panel.total is None else f"; {_held(panel, panel.total)}"
    return f"{missed} at y = {y} m: by {short(float(first[worst]), 2)}{after} m/s{held}"


def _held(panel: SectionPanel, total: Edges) -> str:
    inside = int(np.sum(~panel.aside & (panel.measured >= total[0]) & (panel.measured <= total[1])))
    return f"{inside} of {so_many(int(np.sum(~panel.aside)), 'station')} lie within the dotted lines"


def _numbers(name: str, kind: Kind, panel: SectionPanel, drawn: DrawnPanel) -> dict[str, Any]:
    """What the page shows of each station under the pointer, and where it is in the picture [px]."""
    lines = {"measured": panel.measured, "after": panel.after, "error": panel.error}
    if panel.before is not None:
        lines["before"] = panel.before
    return {
        "id": name,
        "unit": kind.unit,
        "y": _plain_numbers(panel.y),
        "across": _plain_numbers(drawn.across),
        "aside": panel.aside.tolist(),
        **{line: _plain_numbers(values) for line, values in lines.items()},
        "down": {line: _plain_numbers(values) for line, values in drawn.down.items()},
    }


def _plain_numbers(values: Array | Iterable[float]) -> list[float | None]:
    return [round(float(value), 4) if np.isfinite(value) else None for value in values]
