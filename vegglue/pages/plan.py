"""The page of a plan, to take along: the map, the order of the work, stations, and what they would show."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from vegglue.calibration.score_test import alike_groups
from vegglue.case.channel_geometry import expected_depth
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.schema import Case
from vegglue.case.zones import corners_of
from vegglue.pages.style import (
    COLOUR,
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
                one for one in places
                if one.work is piece.work and one.x == piece.x and set(piece.y) <= set(one.y)
            )  # fmt: skip
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
        foot = MAP_HEAD + UPRIGHT_HEIGHT * UPRIGHT_WIDTH
        width, along = UPRIGHT_WIDTH, linear_scale(west, east, MAP_HEAD, foot)
        across = linear_scale(south, north, BESIDE, UPRIGHT_WIDTH - UPRIGHT_MARGIN)
    else:
        inner = MAP_WIDTH - BESIDE - MAP_MARGIN
        foot = MAP_HEAD + float(np.clip((north - south) / (east - west), FLATTEST, STEEPEST_LABEL)) * inner
        width, along = MAP_WIDTH, linear_scale(west, east, BESIDE, MAP_WIDTH - MAP_MARGIN)
        across = linear_scale(south, north, foot, MAP_HEAD)

    def at(x: float, y: float) -> tuple[float, float]:
        a, b = float(along(x)), float(across(y))
        return (b, a) if upright else (a, b)

    def path(x: Iterable[float], y: Iterable[float]) -> str:
        return "M" + "L".join("{:.1f},{:.1f}".format(*at(a, b)) for a, b in zip(x, y, strict=True))

    columns = [k for k in range(site.grid.x.size) if water[k].any()]
    step = max(len(columns) // 200, 1)
    columns = sorted({*columns[::step], columns[-1]}) if columns else []
    low = [float(site.grid.y[water[k]][0]) - 0.5 * site.grid.dy for k in columns]
    high = [float(site.grid.y[water[k]][-1]) + 0.5 * site.grid.dy for k in columns]
    x = [float(site.grid.x[k]) for k in columns]
    parts = [svg_element("path", d=path([*x, *x[::-1]], [*low, *high[::-1]]) + "Z", fill=COLOUR["water"])] if x else []
    if chances is not None:
        parts += _shading(chances, path)
    for patch in case.plants.patches:
        corners = corners_of(case, patch)
        outline = path(corners[:, 0], corners[:, 1]) + "Z"
        parts.append(svg_element("path", d=outline, fill=COLOUR["plants"], stroke=COLOUR["stems"]))
    names = list[str]()
    halo = {"stroke": COLOUR["paper"], "stroke_width": "3", "paint_order": "stroke", "stroke_linejoin": "round"}
    for place in places:
        y = place.y or (0.5 * (south + north),)
        ink, first = COLOUR["ink"], at(place.x, y[0])
        if place.work in (Work.TRANSECT, Work.SURVEY_LINE):
            dashes = {"stroke_dasharray": "4 3"} if place.work is Work.SURVEY_LINE else {}
            line = path([place.x, place.x], [y[0], y[-1]])
            parts.append(svg_element("path", d=line, stroke=ink, stroke_width=1, **dashes))
        if place.work in (Work.TRANSECT, Work.POINT):
            for px, py in (at(place.x, one) for one in y):
                parts.append(svg_element("circle", cx=px, cy=py, r=2.4 if len(y) > 1 else 4, fill=COLOUR["measured"]))
        elif place.work is Work.GAUGE:
            d = f"M{first[0] - 6:.1f},{first[1] - 5:.1f}h12l-6,10z"
            parts.append(svg_element("path", d=d, fill=COLOUR["model"]))
        elif place.work is Work.DISCHARGE:
            d = f"M{first[0] - 5:.1f},{first[1] - 5:.1f}h10v10h-10z"
            parts.append(svg_element("path", d=d, fill=COLOUR["model"]))
        if place.work not in (Work.TRANSECT, Work.SURVEY_LINE):
            names.append(svg_words(first[0] + 7.0, first[1] - 6.0, place.name, "ink", text_anchor="start", **halo))
        elif upright:
            right = UPRIGHT_WIDTH - UPRIGHT_MARGIN + 6.0
            names.append(svg_words(right, first[1] + 4.0, place.name, text_anchor="start", font_weight="bold"))
        else:
            above = MAP_HEAD - 6.0
            names.append(svg_words(first[0], above, place.name, text_anchor="middle", font_weight="bold"))
    parts += names
    ticks_along, ticks_across = round_ticks(west, east, 9), round_ticks(south, north, 5)
    if upright:
        below, to_the_right, beside, downwards = ticks_across, across, ticks_along, along
    else:
        below, to_the_right, beside, downwards = ticks_along, along, ticks_across, across
    for value, words in zip(below, tick_labels(below), strict=True):
        parts.append(svg_element("path", d=f"M{float(to_the_right(value)):.1f},{foot:.1f}v5", stroke=COLOUR["muted"]))
        parts.append(svg_words(float(to_the_right(value)), foot + 18.0, words, "muted", text_anchor="middle"))
    for value, words in zip(beside, tick_labels(beside), strict=True):
        parts.append(svg_words(BESIDE - 8.0, float(downwards(value)) + 4.0, words, "muted", text_anchor="end"))
    foot_words, head_words = ("y_in_metres", "down") if upright else ("along", "y_in_metres")
    parts.append(svg_words(width - MAP_MARGIN, foot + 32.0, phrase("label", foot_words), "muted", text_anchor="end"))
    parts.append(svg_words(0.0, MAP_HEAD - 10.0, phrase("label", head_words), "muted"))
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
