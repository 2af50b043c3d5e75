"""The page of a plan, to take along: the map, the order of the work, stations, and what they would show."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vegglue.calibration.score_test import alike_groups
from vegglue.case.channel_geometry import expected_depth
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.schema import Case
from vegglue.case.zones import corners_of
from vegglue.pages.page import write_page
from vegglue.pages.style import COLOUR, inline, palette_css
from vegglue.pages.svg import Scale, linear_scale, round_ticks, svg_document, svg_element, svg_words, tick_labels
from vegglue.results.plan import FieldPlan, PlaceChances, PlannedEffect, Work
from vegglue.results.plan_files import LETTERS, FieldFiles, FieldPlace, field_places
from vegglue.wording.sentences import page_document, phrase

# The map [px]: its width, letters, and room beside it; its height over its width is between these.
MAP_WIDTH, PLAN_LETTERS, BESIDE, MAP_MARGIN, MAP_FOOT, MAP_HEAD = 960.0, 13.0, 44.0, 18.0, 34.0, 22.0
FLATTEST, STEEPEST_LABEL = 0.22, 0.5
# Chances are drawn for so many cells along and across at most, in steps of a third.
MAP_CELLS_ALONG, MAP_CELLS_ACROSS, BED_SHADES = 80, 24, 3
# Hours of a day in the field, after which the next one begins [h].
DAY = 8.0


@dataclass(frozen=True)
class WorkInFlow:
    """A piece of work in the order of a day: place, when it begins and ends after the start [h]; y of stations [m]."""

    place: FieldPlace
    begins: float
    ends: float
    y: tuple[float, ...]


@dataclass(frozen=True)
class DayOfWork:
    """Work in one flow ('' for that which does not depend on it): its discharge and level in words, and the order."""

    number: int
    flow: str
    discharge: str
    level: str
    work: tuple[WorkInFlow, ...]


def write_plan_page(folder: Path, case: Case, site: Site, plan: FieldPlan, files: FieldFiles) -> Path:
    """Write plan.html into a folder; returns the page. Errors: StorageError."""
    return write_page(folder / "plan.html", lambda: render_plan(case, site, plan, files))


def render_plan(case: Case, site: Site, plan: FieldPlan, files: FieldFiles) -> str:
    """The page as text."""
    light, dark = palette_css()
    places = field_places(plan)
    title = phrase("label", "plan") + f" {case.title or case.name}"
    return page_document(
        "plan.html.j2",
        light=light,
        dark=dark,
        case=case,
        plan=plan,
        files=files,
        map=inline(draw_plan_map(case, site, places, plan.chances_of_places, title), "plan-map", title),
        places=places,
        days=days_of_work(case, plan, places),
        hours_of_day=DAY,
        letters=[(letter, work) for work, letter in LETTERS.items() if work in {one.work for one in places}],
        seen=[one for one in plan.effects if one.seen],
        larger=[one for one in plan.effects if not one.seen and one.testable],
        rest=[one for one in plan.effects if not one.testable],
        on_map=bool(files.stations) and bool(np.isfinite(files.stations[0].east)),
        mixed=confusions(plan.effects),
    )


def confusions(effects: Sequence[PlannedEffect]) -> list[list[str]]:
    """Groups of testable effects that the data cannot separate, as a diagnosis groups them."""
    names = [one.name for one in effects if one.testable]
    cosine = np.eye(len(names))
    for one in effects:
        for other in one.confused:
            if one.testable and other.name in names:
                i, j = names.index(one.name), names.index(other.name)
                cosine[i, j] = cosine[j, i] = other.cosine
    return [group for group in alike_groups(names, cosine) if len(group) > 1]


def days_of_work(case: Case, plan: FieldPlan, places: Sequence[FieldPlace]) -> list[DayOfWork]:
    """The order of the work: flow by flow, gauges first, then from downstream, so that wading disturbs nothing."""
    found: list[DayOfWork] = []
    flows = [name for name in dict.fromkeys(one.experiment for one in plan.pieces) if name]
    for flow in [*flows, ""]:
        of_flow = [one for one in plan.pieces if one.experiment == flow]
        order = {Work.GAUGE: 0, Work.DISCHARGE: 1}
        work: list[WorkInFlow] = []
        begins = 0.0
        for piece in sorted(of_flow, key=lambda one: (order.get(one.work, 2), -one.x)):
            place = next(
                one for one in places
                if one.work is piece.work and one.x == piece.x and set(piece.y) <= set(one.y)
            )  # fmt: skip
            if work and begins + piece.hours > DAY + 1e-9:
                found.append(_day(case, len(found) + 1, flow, work))
                work, begins = [], 0.0
            work.append(WorkInFlow(place, begins, begins + piece.hours, piece.y))
            begins += piece.hours
        if work:
            found.append(_day(case, len(found) + 1, flow, work))
    return found


def _day(case: Case, number: int, flow: str, work: Sequence[WorkInFlow]) -> DayOfWork:
    if not flow or flow not in case.experiments:
        return DayOfWork(number, flow, "", "", tuple(work))
    one = case.experiments[flow]
    discharge = ", ".join(f"{value:g}" if not isinstance(value, str) else value for value in one.discharge.values())
    level = f"{one.level:g}" if not isinstance(one.level, str) else one.level
    return DayOfWork(number, flow, discharge, level, tuple(work))


def draw_plan_map(
    case: Case, site: Site, places: Sequence[FieldPlace], chances: PlaceChances | None, title: str
) -> str:
    """SVG text: water and plants, where an object would be detected, and all stations; y stretched."""
    (west, east), (south, north) = case.grid.x, case.grid.y
    depths = [expected_depth(case, in_experiment(site, name), one) for name, one in case.experiments.items()]
    water = np.max(depths, axis=0) > 0.0
    wet = site.grid.y[water.any(axis=0)]
    if wet.size:
        south, north = max(south, float(wet[0]) - site.grid.dy), min(north, float(wet[-1]) + site.grid.dy)
    inner = MAP_WIDTH - BESIDE - MAP_MARGIN
    height = float(np.clip((north - south) / (east - west), FLATTEST, STEEPEST_LABEL)) * inner
    along = linear_scale(west, east, BESIDE, MAP_WIDTH - MAP_MARGIN)
    across = linear_scale(south, north, MAP_HEAD + height, MAP_HEAD)

    def path(x: Iterable[float], y: Iterable[float]) -> str:
        points = [f"{float(along(a)):.1f},{float(across(b)):.1f}" for a, b in zip(x, y, strict=True)]
        return f"M{'L'.join(points)}"

    columns = [k for k in range(site.grid.x.size) if water[k].any()]
    step = max(len(columns) // 200, 1)
    columns = sorted({*columns[::step], columns[-1]}) if columns else []
    low = [float(site.grid.y[water[k]][0]) - 0.5 * site.grid.dy for k in columns]
    high = [float(site.grid.y[water[k]][-1]) + 0.5 * site.grid.dy for k in columns]
    x = [float(site.grid.x[k]) for k in columns]
    parts = [svg_element("path", d=path([*x, *x[::-1]], [*low, *high[::-1]]) + "Z", fill=COLOUR["water"])] if x else []
    if chances is not None:
        parts += _shading(chances, along, across)
    for patch in case.plants.patches:
        corners = corners_of(case, patch)
        outline = path(corners[:, 0], corners[:, 1]) + "Z"
        parts.append(svg_element("path", d=outline, fill=COLOUR["plants"], stroke=COLOUR["stems"]))
    for place in places:
        at = float(along(place.x))
        ends = [float(across(y)) for y in place.y] or [float(across(0.5 * (south + north)))]
        ink, measured = COLOUR["ink"], COLOUR["measured"]
        if place.work in (Work.TRANSECT, Work.SURVEY_LINE):
            dashes = {"stroke_dasharray": "4 3"} if place.work is Work.SURVEY_LINE else {}
            line = f"M{at:.1f},{max(ends):.1f}V{min(ends):.1f}"
            parts.append(svg_element("path", d=line, stroke=ink, stroke_width=1, **dashes))
        if place.work in (Work.TRANSECT, Work.POINT):
            parts += [svg_element("circle", cx=at, cy=y, r=2.4 if len(ends) > 1 else 4, fill=measured) for y in ends]
        elif place.work is Work.GAUGE:
            parts.append(svg_element("path", d=f"M{at - 6:.1f},{ends[0] - 5:.1f}h12l-6,10z", fill=COLOUR["model"]))
        elif place.work is Work.DISCHARGE:
            parts.append(svg_element("path", d=f"M{at - 5:.1f},{ends[0] - 5:.1f}h10v10h-10z", fill=COLOUR["model"]))
        if place.work in (Work.TRANSECT, Work.SURVEY_LINE):
            parts.append(svg_words(at, MAP_HEAD - 6.0, place.name, text_anchor="middle", font_weight="bold"))
        else:
            parts.append(svg_words(at + 7.0, ends[0] - 6.0, place.name, text_anchor="start"))
    foot = MAP_HEAD + height
    for tick, words in zip(ticks := round_ticks(west, east, 9), tick_labels(ticks), strict=True):
        parts.append(svg_element("path", d=f"M{float(along(tick)):.1f},{foot:.1f}v5", stroke=COLOUR["muted"]))
        parts.append(svg_words(float(along(tick)), foot + 18.0, words, "muted", text_anchor="middle"))
    for tick, words in zip(ticks := round_ticks(south, north, 5), tick_labels(ticks), strict=True):
        parts.append(svg_words(BESIDE - 8.0, float(across(tick)) + 4.0, words, "muted", text_anchor="end"))
    parts.append(svg_words(MAP_WIDTH - MAP_MARGIN, foot + 32.0, phrase("label", "along"), "muted", text_anchor="end"))
    parts.append(svg_words(0.0, MAP_HEAD - 6.0, phrase("label", "y_in_metres"), "muted"))
    return svg_document(MAP_WIDTH, foot + MAP_FOOT + 4.0, parts, title, PLAN_LETTERS)


def _shading(chances: PlaceChances, along: Scale, across: Scale) -> list[str]:
    """Rectangles where an object is likely to be detected, in BED_SHADES steps; bins of equal size."""
    x, y, chance = (np.array(part) for part in (chances.x, chances.y, chances.chance))
    counts = min(np.unique(x).size, MAP_CELLS_ALONG), min(np.unique(y).size, MAP_CELLS_ACROSS)
    edges = [
        np.linspace(part.min() - half, part.max() + half, count + 1)
        for part, half, count in ((x, 0.5 * chances.length, counts[0]), (y, 0.5 * chances.width, counts[1]))
    ]
    sums, _, _ = np.histogram2d(x, y, bins=edges, weights=chance)
    number, _, _ = np.histogram2d(x, y, bins=edges)
    mean = sums / np.maximum(number, 1)
    found = []
    for i, j in zip(*np.nonzero(mean >= 1.0 / BED_SHADES), strict=True):
        left, right = (float(along(edges[0][k])) for k in (i, i + 1))
        below, above = (float(across(edges[1][k])) for k in (j, j + 1))
        shade = min(int(mean[i, j] * BED_SHADES), BED_SHADES - 1)
        found.append(
            svg_element("path", d=f"M{left:.1f},{above:.1f}H{right:.1f}V{below:.1f}H{left:.1f}z",
                        fill=COLOUR["narrow"], fill_opacity=0.28 * shade + 0.1)
        )  # fmt: skip
    return found
