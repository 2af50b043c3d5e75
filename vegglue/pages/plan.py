"""The page of a plan, to take along: the map, the order of the work, stations, and what they would show."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from vegglue.calibration.score_test import alike_groups
from vegglue.case.channel_geometry import expected_depth
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.schema import Case, Planned
from vegglue.case.site_schema import Interval
from vegglue.case.zones import corners_of
from vegglue.measurements.kinds import KINDS
from vegglue.pages.svg import (
    COLOUR,
    Scale,
    inline,
    linear_scale,
    palette_css,
    round_ticks,
    svg_document,
    svg_element,
    svg_words,
    tick_labels,
)
from vegglue.results.plan import (
    KIND_OF_WORK,
    LETTERS,
    FieldFiles,
    FieldPlace,
    FieldPlan,
    PlaceChances,
    PlannedEffect,
    Work,
    field_places,
)
from vegglue.wording.sentences import page_document, phrase

# The map [px]: its width, letters, and room beside it; its height over its width is between these. Upright, for a
# phone: its width, its height over its width, and room on the right for names of transects.
MAP_WIDTH, PLAN_LETTERS, BESIDE, MAP_MARGIN, MAP_FOOT, MAP_HEAD = 960.0, 13.0, 44.0, 18.0, 34.0, 22.0
FLATTEST, STEEPEST_LABEL = 0.22, 0.5
UPRIGHT_WIDTH, UPRIGHT_HEIGHT, UPRIGHT_MARGIN = 350.0, 2.0, 34.0
# Chances are drawn for so many cells along and across at most, in steps of a third.
MAP_CELLS_ALONG, MAP_CELLS_ACROSS, BED_SHADES = 80, 24, 3
# Hours of a day in the field, and by how many it may end later rather than leave a piece for a further day [h].
DAY, LATER = 8.0, 0.5


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


def render_plan(case: Case, site: Site, plan: FieldPlan, files: FieldFiles) -> str:
    """The page of a plan as text."""
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
        upright=inline(draw_plan_map(case, site, places, plan.chances_of_places, title, True), "upright-map", title),
        places=places,
        days=days_of_work(case, plan, places),
        hours_of_day=DAY,
        to_measure=what_to_measure(case, places),
        letters=[(letter, work) for work, letter in LETTERS.items() if work in {one.work for one in places}],
        seen=[one for one in plan.effects if one.seen],
        larger=[one for one in plan.effects if not one.seen and one.testable],
        rest=[one for one in plan.effects if not one.testable],
        on_map=bool(files.stations) and bool(np.isfinite(files.stations[0].east)),
        mixed=confusions(plan.effects),
    )


def what_to_measure(case: Case, places: Sequence[FieldPlace]) -> list[tuple[str, float, str]]:
    """What is measured in the field, and the standard error of it that a plan assumes [its unit]."""
    errors, found = (case.planned or Planned()).errors, dict[str, tuple[float, str]]()
    for place in places:
        name = KIND_OF_WORK.get(place.work, "survey")
        usual, unit = (KINDS[name].usual_error, KINDS[name].unit) if name in KINDS else (0.0, "m")
        found[name] = (getattr(errors, name) or usual, unit)
    return [(name, *one) for name, one in found.items()]


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
    """The order of the work: flow by flow, each piece on the first day that has time for it; on a day gauges first,
    then from downstream, so that wading disturbs nothing.
    """
    found: list[DayOfWork] = []
    flows = [name for name in dict.fromkeys(one.experiment for one in plan.pieces) if name]
    for flow in [*flows, ""]:
        of_flow = [one for one in plan.pieces if one.experiment == flow]
        order = {Work.GAUGE: 0, Work.DISCHARGE: 1}
        days: list[list[WorkInFlow]] = []
        for piece in sorted(of_flow, key=lambda one: (order.get(one.work, 2), -one.x)):
            place = next(
                one for one in places if one.work is piece.work and one.x == piece.x and set(piece.y) <= set(one.y)
            )
            work = next((one for one in days if one[-1].ends + piece.hours <= DAY + LATER), None)
            if work is None:
                days.append(work := [])
            begins = work[-1].ends if work else 0.0
            work.append(WorkInFlow(place, begins, begins + piece.hours, piece.y))
        discharge, level = "", ""
        if flow in case.experiments:
            one = case.experiments[flow]
            *inflows, level = (f"{q:g}" if not isinstance(q, str) else q for q in (*one.discharge.values(), one.level))
            discharge = ", ".join(inflows)
        found += [DayOfWork(len(found) + k, flow, discharge, level, tuple(work)) for k, work in enumerate(days, 1)]
    return found


@dataclass(frozen=True)
class _PlanMap:
    """Where the reach lies in the drawing: scales of x and y onto px, and the lower edge of the map [px].

    upright: the flow downwards, for a phone; else to the right.
    """

    along: Scale
    across: Scale
    foot: float
    upright: bool

    def at(self, x: float, y: float) -> tuple[float, float]:
        """A place x, y [m] in the drawing [px]."""
        a, b = float(self.along(x)), float(self.across(y))
        return (b, a) if self.upright else (a, b)

    def path(self, x: Iterable[float], y: Iterable[float]) -> str:
        """Straight lines from place to place."""
        return "M" + "L".join("{:.1f},{:.1f}".format(*self.at(a, b)) for a, b in zip(x, y, strict=True))

    def symbols(self, place: FieldPlace, y: Sequence[float]) -> list[str]:
        """Lines of transects, dots of stations, a triangle for a gauge and a square for a discharge."""
        parts, (px, py) = list[str](), self.at(place.x, y[0])
        if place.work in (Work.TRANSECT, Work.SURVEY_LINE):
            dashes = {"stroke_dasharray": "4 3"} if place.work is Work.SURVEY_LINE else {}
            line = self.path([place.x, place.x], [y[0], y[-1]])
            parts.append(svg_element("path", d=line, stroke=COLOUR["ink"], stroke_width=1, **dashes))
        if place.work in (Work.TRANSECT, Work.POINT):
            radius = 2.4 if len(y) > 1 else 4
            for px, py in (self.at(place.x, one) for one in y):
                parts.append(svg_element("circle", cx=px, cy=py, r=radius, fill=COLOUR["measured"]))
        elif place.work is Work.GAUGE:
            parts.append(svg_element("path", d=f"M{px - 6:.1f},{py - 5:.1f}h12l-6,10z", fill=COLOUR["model"]))
        elif place.work is Work.DISCHARGE:
            parts.append(svg_element("path", d=f"M{px - 5:.1f},{py - 5:.1f}h10v10h-10z", fill=COLOUR["model"]))
        return parts

    def name_of(self, place: FieldPlace, y: float) -> str:
        """The name of a place beside it; of a line across, at the edge of the map."""
        px, py = self.at(place.x, y)
        if place.work not in (Work.TRANSECT, Work.SURVEY_LINE):
            halo = {"stroke": COLOUR["paper"], "stroke_width": "3", "paint_order": "stroke", "stroke_linejoin": "round"}
            return svg_words(px + 7.0, py - 6.0, place.name, "ink", text_anchor="start", **halo)
        if self.upright:
            right = UPRIGHT_WIDTH - UPRIGHT_MARGIN + 6.0
            return svg_words(right, py + 4.0, place.name, text_anchor="start", font_weight="bold")
        return svg_words(px, MAP_HEAD - 6.0, place.name, text_anchor="middle", font_weight="bold")

    def axes(self, x: Interval, y: Interval, width: float) -> list[str]:
        """Numbers below and beside the map, and the names of both axes; width: of the drawing [px]."""
        ticks = (round_ticks(*x, 9), self.along), (round_ticks(*y, 5), self.across)
        (below, to_the_right), (beside, downwards) = ticks[::-1] if self.upright else ticks
        parts = []
        for value, words in zip(below, tick_labels(below), strict=True):
            px = float(to_the_right(value))
            parts.append(svg_element("path", d=f"M{px:.1f},{self.foot:.1f}v5", stroke=COLOUR["muted"]))
            parts.append(svg_words(px, self.foot + 18.0, words, "muted", text_anchor="middle"))
        for value, words in zip(beside, tick_labels(beside), strict=True):
            parts.append(svg_words(BESIDE - 8.0, float(downwards(value)) + 4.0, words, "muted", text_anchor="end"))
        along, upwards = ("y_in_metres", "down") if self.upright else ("along", "y_in_metres")
        name = phrase("label", along)
        parts.append(svg_words(width - MAP_MARGIN, self.foot + 32.0, name, "muted", text_anchor="end"))
        return [*parts, svg_words(0.0, MAP_HEAD - 10.0, phrase("label", upwards), "muted")]


def draw_plan_map(
    case: Case,
    site: Site,
    places: Sequence[FieldPlace],
    chances: PlaceChances | None,
    title: str,
    upright: bool = False,
) -> str:
    """SVG text: water and plants, where an object would be detected, and all stations; y stretched.

    upright: the flow downwards, for a phone; else to the right.
    """
    (west, east), (south, north) = case.grid.x, case.grid.y
    depths = [expected_depth(case, in_experiment(site, name), one) for name, one in case.experiments.items()]
    water = np.max(depths, axis=0) > 0.0
    wet = site.grid.y[water.any(axis=0)]
    if wet.size:
        south, north = max(south, float(wet[0]) - site.grid.dy), min(north, float(wet[-1]) + site.grid.dy)
    if upright:
        width, foot = UPRIGHT_WIDTH, MAP_HEAD + UPRIGHT_HEIGHT * UPRIGHT_WIDTH
        along = linear_scale(west, east, MAP_HEAD, foot)
        across = linear_scale(south, north, BESIDE, UPRIGHT_WIDTH - UPRIGHT_MARGIN)
    else:
        width, inner = MAP_WIDTH, MAP_WIDTH - BESIDE - MAP_MARGIN
        foot = MAP_HEAD + float(np.clip((north - south) / (east - west), FLATTEST, STEEPEST_LABEL)) * inner
        along = linear_scale(west, east, BESIDE, MAP_WIDTH - MAP_MARGIN)
        across = linear_scale(south, north, foot, MAP_HEAD)
    plan_map = _PlanMap(along, across, foot, upright)
    columns = [k for k in range(site.grid.x.size) if water[k].any()]
    step = max(len(columns) // 200, 1)
    columns = sorted({*columns[::step], columns[-1]}) if columns else []
    low = [float(site.grid.y[water[k]][0]) - 0.5 * site.grid.dy for k in columns]
    high = [float(site.grid.y[water[k]][-1]) + 0.5 * site.grid.dy for k in columns]
    x, parts = [float(site.grid.x[k]) for k in columns], list[str]()
    if x:
        edge = plan_map.path([*x, *x[::-1]], [*low, *high[::-1]]) + "Z"
        parts.append(svg_element("path", d=edge, fill=COLOUR["water"]))
    if chances is not None:
        parts += _shading(chances, plan_map.path)
    for patch in case.plants.patches:
        corners = corners_of(case, patch)
        outline = plan_map.path(corners[:, 0], corners[:, 1]) + "Z"
        parts.append(svg_element("path", d=outline, fill=COLOUR["plants"], stroke=COLOUR["stems"]))
    stations = [(place, place.y or (0.5 * (south + north),)) for place in places]
    for place, y in stations:
        parts += plan_map.symbols(place, y)
    parts += [plan_map.name_of(place, y[0]) for place, y in stations]
    parts += plan_map.axes((west, east), (south, north), width)
    return svg_document(width, foot + MAP_FOOT + 4.0, parts, title, PLAN_LETTERS)


def _shading(chances: PlaceChances, path: Callable[[Iterable[float], Iterable[float]], str]) -> list[str]:
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
        (left, right), (below, above) = edges[0][[i, i + 1]], edges[1][[j, j + 1]]
        shade = min(int(mean[i, j] * BED_SHADES), BED_SHADES - 1)
        corners = path([left, right, right, left], [below, below, above, above]) + "z"
        opacity = 0.28 * shade + 0.1
        found.append(svg_element("path", d=corners, fill=COLOUR["narrow"], fill_opacity=opacity))
    return found
