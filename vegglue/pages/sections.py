"""Measured against modelled across all sections, before and after what was missing is added."""

import json
from collections.abc import Sequence
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
from vegglue.pages.run import SYNTHETIC, Run, accepted_causes, file_name, is_synthetic, planted_cells, published_picture
from vegglue.pages.style import Picture
from vegglue.pages.svg import (
    COLOUR,
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
from vegglue.wording.numbers import section_in_words
from vegglue.wording.sentences import phrase

# A panel [px]: four of them stand side by side on a screen of 1,200; letters of the size of the captions.
PANEL_WIDTH, PANEL_HEIGHT, PANEL_LETTERS, NOTE_LETTERS = 240.0, 222.0, 11.5, 9.0
PANEL_LEFT, PANEL_RIGHT, PANEL_TOP, PANEL_LOWEST, PANEL_BED_TOP, PANEL_BED_FOOT = 28.0, 236.0, 24.0, 154.0, 160.0, 190.0
PANEL_TICKS = 5
PANEL_TITLE = 186.0  # room of the title [px], beside the unit
AXIS_CLEAR = 18.0  # of the name of the axis [px]
DOT, RING = 2.6, 5.1  # radii [px]
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
    aside: excluded or not used; before: None where nothing was added; band: 95 % of the posterior, if any; core and
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
    parts = []
    for panel in panels:
        error = np.nan_to_num(panel.error)
        edges = [edge for pair in (panel.band, panel.total) if pair is not None for edge in pair]
        before = [] if panel.before is None else [panel.before]
        parts += [panel.measured - error, panel.measured + error, panel.after, *before, *edges]
    values = np.concatenate(parts)
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    low = min(low, 0.0) if low < 0.4 * high else low
    margin = 0.06 * max(high - low, 1e-3)
    return (low - margin if low else 0.0), high + margin


def draw_panel(panel: SectionPanel, values: tuple[float, float], unit: str, note: str = "") -> DrawnPanel:
    """The panel with values (low, high) from foot to head; note: in its corner."""
    margin = 0.08 * float(np.ptp(panel.y)) + 0.1
    ends = float(panel.y.min()) - margin, float(panel.y.max()) + margin
    across, down = linear_scale(*ends, PANEL_LEFT, PANEL_RIGHT), linear_scale(*values, PANEL_LOWEST, PANEL_TOP)

    def line(path: str, colour: str, width: float, **look: object) -> str:
        return svg_element("path", "", d=path, stroke=COLOUR[colour], stroke_width=width, **look)

    # The bed in a strip below, and the plants as shaded stretches through the panel.
    ground = panel.ground
    step = float(ground.y[1] - ground.y[0])
    near = (ground.y > ends[0] - step) & (ground.y < ends[1] + step)
    y, bed = np.clip(ground.y[near], *ends), ground.bed[near]
    rise = max(float(np.ptp(bed)), 0.2)
    level = linear_scale(float(bed.min()) - 0.25 * rise, float(bed.min()) + rise, PANEL_BED_FOOT, PANEL_BED_TOP)
    earth = area_between(across(y), np.full(y.size, PANEL_BED_FOOT), level(bed))
    parts = [svg_element("path", d=earth, fill=COLOUR["earth"])]
    change = np.diff(np.r_[0, ground.planted[near].astype(int), 0])
    for start, stop in zip(np.flatnonzero(change == 1), np.flatnonzero(change == -1) - 1, strict=True):
        left, right = map(float, across(np.clip([y[start] - 0.5 * step, y[stop] + 0.5 * step], *ends)))
        box = {"x": left, "y": PANEL_TOP, "width": right - left, "height": PANEL_BED_FOOT - PANEL_TOP}
        look = {"text_anchor": "middle", "font_size": 10}
        parts.append(svg_element("rect", "", fill=COLOUR["plants"], opacity=0.45, **box))
        parts.append(svg_words(0.5 * (left + right), PANEL_BED_TOP + 8, "plants", "stems", **look))
    # Axes.
    ticks = round_ticks(*values, PANEL_TICKS)
    for tick, text in zip(ticks, tick_labels(ticks), strict=True):
        height = float(down(tick))
        parts.append(line(f"M{PANEL_LEFT:g},{height:.1f}H{PANEL_RIGHT:g}", "rule", 0.7))
        parts.append(svg_words(PANEL_LEFT - 5, height + 4, text, "muted", text_anchor="end"))
    ticks = [tick for tick in round_ticks(*ends, PANEL_TICKS) if across(tick) > PANEL_LEFT + AXIS_CLEAR]
    for tick, text in zip(ticks, tick_labels(ticks), strict=True):
        at = float(across(tick))
        parts.append(line(f"M{at:.1f},{PANEL_BED_FOOT:g}v4", "muted", 0.7))
        parts.append(svg_words(at, PANEL_BED_FOOT + 16, text, "muted", text_anchor="middle"))
    parts.append(svg_words(PANEL_RIGHT, 13.0, unit, "muted", text_anchor="end"))
    parts.append(svg_words(0.0, PANEL_BED_FOOT + 16, "y [m]", "muted"))
    # The models.
    x = across(panel.y)
    for edges, colour in ((panel.band, "wide"), (panel.core, "narrow")):
        if edges is not None:
            area = area_between(x, down(edges[0]), down(edges[1]))
            parts.append(svg_element("path", class_="band", d=area, fill=COLOUR[colour]))
    for edge in panel.total or ():
        parts.append(line(line_through(x, down(edge)), "model", 0.9, fill="none", stroke_dasharray="2 2.5"))
    if panel.before is not None:
        before = line_through(x, down(panel.before))
        parts.append(line(before, "muted", 1.8, class_="before", fill="none", stroke_dasharray="5 3"))
    parts.append(line(line_through(x, down(panel.after)), "model", 2, class_="after", fill="none"))
    # Measured values with their errors; hollow and crossed if they are excluded.
    for at, value, error, aside in zip(x.tolist(), panel.measured, panel.error, panel.aside, strict=True):
        if not np.isfinite(value):
            continue
        middle = float(down(value))
        if np.isfinite(error):
            parts.append(line(f"M{at:.1f},{down(value - error):.1f}V{down(value + error):.1f}", "measured", 1))
        face = COLOUR["paper" if aside else "measured"]
        parts.append(svg_element("circle", cx=at, cy=middle, r=DOT, fill=face, stroke=COLOUR["measured"]))
        if aside:
            parts.append(line(f"M{at - 5:.1f},{middle - 5:.1f}l10,10m0,-10l-10,10", "ink", 1.3))
    # What the page moves to the station that is read, hidden until then.
    cursor = line(f"M0,{PANEL_TOP:g}V{PANEL_BED_FOOT:g}", "ink", 0.8)
    for name, colour in (("measured", "measured"), ("before", "muted"), ("after", "model")):
        ring = {"r": RING, "fill": "none", "stroke": COLOUR[colour], "stroke_width": 1.8}
        cursor += svg_element("circle", "", class_=name, **ring)
    parts.append(svg_element("g", cursor, class_="cursor", visibility="hidden"))
    parts.append(svg_words(0.0, 13.0, within_width(panel.title, PANEL_TITLE, PANEL_LETTERS), font_weight="bold"))
    corner = {"font_size": NOTE_LETTERS, "text_anchor": "end"}
    parts.append(svg_words(PANEL_RIGHT, PANEL_HEIGHT - 3, note, "muted", **corner))
    lines = {"measured": panel.measured, "after": panel.after}
    lines |= {} if panel.before is None else {"before": panel.before}
    svg = svg_document(PANEL_WIDTH, PANEL_HEIGHT, parts, panel.title, PANEL_LETTERS)
    return DrawnPanel(svg, x, {name: down(part) for name, part in lines.items()})


# What makes two rows of two tables one station.
STATION_KEY = ["experiment", "kind", "section", "x", "y"]
CENTIMETRES = 2  # decimals of places [m]: no tape shows more, and places turned from a map have more
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
    nothing; banded, any_aside: whether a posterior and excluded stations are shown; data: numbers of all
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
    stations = _predicted_stations(run)
    stations = stations[velocity_rows(stations) & np.isfinite(stations["value"].to_numpy(float))]
    added, note = accepted_causes(run.behind) if run.behind else "", SYNTHETIC if is_synthetic(run.case) else ""
    taken: set[str] = set()
    experiments, data = [], []
    for (experiment, kind_name), rows in stations.groupby(["experiment", "kind"], sort=False):
        kind, pictures = kind_of(str(kind_name)), []
        places = rows.groupby("section")["x"].mean().sort_values()
        panels = [_panel(run, str(experiment), rows[rows["section"] == place], bool(added)) for place in places.index]
        values = value_range(panels)
        for section, panel in zip(places.index, panels, strict=True):
            along = "section" if kind.name == STREAMWISE else kind.name
            name = unused(file_name(f"{along}-{experiment}-{section}"), taken)
            taken.add(name)
            drawn = draw_panel(panel, values, f"{kind.column} [{kind.unit}]", note)
            picture = published_picture(run, drawn.svg, name, "panel_words", panel_misfit(panel, kind.unit))
            pictures.append(picture)
            reasons = rows[rows["section"] == section].sort_values("y")["reason"]
            words = [phrase("why_unused", one) for one in reasons]
            data.append(_under_pointer(picture.name, kind, panel, drawn) | {"reason": words})
        left = (rows["value"] - rows["before"])[~rows["aside"]]
        title = str(experiment) if kind.name == STREAMWISE else f"{experiment}, {kind.words}"
        experiments.append(ExperimentPanels(title, pictures, float(np.sqrt(np.mean(left**2))) if len(left) else 0.0))
    experiments.sort(key=lambda one: -one.worst)
    banded, aside = (bool(column.any()) for column in (stations["low"].notna(), stations["aside"]))
    return SectionPanels(experiments, added, banded, aside, safe_json(data))


def safe_json(tree: Any) -> str:
    """The tree as JSON that ends no script element, whatever users wrote."""
    text = json.dumps(tree, ensure_ascii=False, allow_nan=False)
    return "".join(ESCAPED.get(letter, letter) for letter in text)


def _predicted_stations(run: Run) -> pd.DataFrame:
    """Stations with columns before, after, low and high: of the diagnosis if there is one, else of the posterior."""
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


def _panel(run: Run, experiment: str, rows: pd.DataFrame, added: bool) -> SectionPanel:
    rows, grid = rows.sort_values("y"), run.site.grid
    x = float(rows["x"].mean())
    values = {name: rows[name].to_numpy(float) for name in ("y", "value", "before", "after", *EDGES)}
    band, core, total = (
        None if np.isnan(values[low]).all() else (values[low], values[high])
        for low, high in zip(EDGES[::2], EDGES[1::2], strict=True)
    )
    column = int(np.argmin(np.abs(grid.x - x)))
    bed, planted = in_experiment(run.site, experiment).bed[column], planted_cells(run, experiment)[column]
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
        ground=PanelGround(grid.y, bed, planted),
    )


@dataclass(frozen=True)
class PanelMisfit:
    """Where a section is missed most, None without measurements: y [m], by how much at first and after the addition;
    inside: of the counted stations those within the total band, None if it is not drawn.
    """

    y: float | None
    first: float
    after: float | None
    unit: str
    inside: int | None
    counted: int


def panel_misfit(panel: SectionPanel, unit: str) -> PanelMisfit:
    """Where a section is missed most, before and after what was missing is added."""
    counted = ~panel.aside
    if not counted.any():
        return PanelMisfit(None, np.nan, None, unit, None, 0)
    left = np.where(counted, np.abs(panel.measured - panel.after), -1.0)
    first = left if panel.before is None else np.where(counted, np.abs(panel.measured - panel.before), -1.0)
    worst, inside = int(np.argmax(first)), None
    if panel.total is not None:
        inside = int(np.sum(counted & (panel.measured >= panel.total[0]) & (panel.measured <= panel.total[1])))
    after, y = None if panel.before is None else float(left[worst]), round(float(panel.y[worst]), CENTIMETRES)
    return PanelMisfit(y, float(first[worst]), after, unit, inside, int(counted.sum()))


def _under_pointer(name: str, kind: Kind, panel: SectionPanel, drawn: DrawnPanel) -> dict[str, Any]:
    """What the page shows of each station under the pointer, and where it is in the picture [px]."""

    def plain(values: Array) -> list[float | None]:
        return [round(float(value), 4) if np.isfinite(value) else None for value in values]

    lines = {"measured": panel.measured, "after": panel.after, "error": panel.error}
    if panel.before is not None:
        lines["before"] = panel.before
    return {
        "id": name,
        "unit": kind.unit,
        "y": plain(panel.y),
        "across": plain(drawn.across),
        "aside": panel.aside.tolist(),
        **{line: plain(values) for line, values in lines.items()},
        "down": {line: plain(values) for line, values in drawn.down.items()},
    }
