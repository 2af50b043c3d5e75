"""Maps of places and of a smooth field: where something that is no listed effect would reduce the misfit."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import QuadMesh
from matplotlib.colors import LinearSegmentedColormap, to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Patch, Polygon

from vegglue.arrays import Array
from vegglue.case.schema import Case
from vegglue.case.zones import corners_of
from vegglue.pages.flow_maps import Outline
from vegglue.pages.run import Run, published_picture
from vegglue.pages.style import EDGE_COLOUR, SMALL, WIDTH, Picture, canvas, label, styled
from vegglue.pages.svg import COLOUR
from vegglue.results.causes import UNIT_OF_FIELD
from vegglue.results.diagnosis import Diagnosis
from vegglue.wording.sentences import phrase

# Least score [standard errors] in full colour, so that a map of errors alone (scores of 2 to 3) stays pale.
FULL_COLOUR_SCORE = 6.0
# Opacity [-] of the colour in each quarter of the largest score of a map; the first quarter stays blank.
SHADES = (0.22, 0.5, 0.85)
# Standard errors [-] below which a field is not distinguished from zero, and its opacity there.
CLEAR_FROM, FADED = 2.0, 0.3
# Blue is more and vermilion less, as in all maps; light grey between, distinct from both in every colour blindness.
LESS_TO_MORE = LinearSegmentedColormap.from_list("less_to_more", [COLOUR["measured"], "#f3f2ef", COLOUR["model"]])

# Pale enough for stations and patches on top.
GREYS = LinearSegmentedColormap.from_list("greys", ["#f3f2ef", COLOUR["muted"]])


@dataclass(frozen=True)
class MarkedSpot:
    """What was found: middle x, y, half length, half width [m], what is written beside it, and the inclination of a
    rectangle [deg], None for an ellipse.
    """

    x: float
    y: float
    length: float
    width: float
    words: str
    angle: float | None = None


@dataclass(frozen=True)
class PlanMarks:
    """What is drawn over a map: patches, stations (station, 2) and those excluded (station, 2) as x, y [m], spots."""

    patches: Sequence[Outline]
    stations: Array
    aside: Array
    spots: Sequence[MarkedSpot] = ()


@dataclass(frozen=True)
class DrawnField:
    """value and standard error (nx, ny) [unit] at cell centres x (nx,), y (ny,) [m]; what: the quantity in words."""

    x: Array
    y: Array
    value: Array
    error: Array
    what: str
    unit: str


@styled
def draw_places(x: Array, y: Array, score: Array, term: str, marks: PlanMarks) -> Figure:
    """Standard errors by which a spot of a term at each place would improve the fit, y stretched.

    x, y, score: (place,), spots of one length together, see `strongest_spots`. Blue and solid lines: more of the term;
    vermilion and dashed lines: less of it.
    """
    figure, axes = canvas(2 * WIDTH, 2.5)
    paint_places(axes, x, y, score, term, marks)
    return figure


def paint_places(axes: Axes, x: Array, y: Array, score: Array, term: str, marks: PlanMarks) -> None:
    """Paint draw_places on given axes."""
    along, across, field = strongest_spots(x, y, score)
    largest = float(np.nanmax(np.abs(field), initial=0.0)) or 1.0
    if min(field.shape) > 1:
        full = max(largest, FULL_COLOUR_SCORE)
        quarters = full * np.array([0.25, 0.5, 0.75, 1.0])
        shown = np.ma.masked_invalid(field.T)
        for sign, colour, line in ((1.0, "model", "solid"), (-1.0, "measured", "dashed")):
            faces = [to_rgba(COLOUR[colour], shade) for shade in SHADES]
            axes.contourf(along, across, sign * shown, levels=quarters, colors=faces)
            look: dict[str, Any] = {"colors": COLOUR[colour], "linewidths": 0.7, "linestyles": line}
            axes.contour(along, across, sign * shown, levels=quarters[:-1], **look)
        text = phrase("steps_of_score", 0.25 * full, largest)
        axes.text(1.0, 1.02, text, transform=axes.transAxes, ha="right", fontsize=SMALL, color=COLOUR["muted"])
        for place, line, sign, colour in ((0.0, "━", 1, "model"), (0.28, "╌", -1, "measured")):
            acting = f"{line} {phrase('acting', term, sign)} {phrase('label', 'helps')}"
            axes.text(place, 1.02, acting, transform=axes.transAxes, fontsize=SMALL, color=COLOUR[colour])
    _paint_marks(axes, marks)
    if len(marks.aside):
        axes.text(0.56, 1.02, "× excluded", transform=axes.transAxes, fontsize=SMALL, color=COLOUR["ink"])
    axes.set(xlabel=phrase("label", "along"), ylabel="y [m]")


def strongest_spots(x: Array, y: Array, score: Array) -> tuple[Array, Array, Array]:
    """The score (nx, ny) of the spot that scores most, of any length, at each place of the raster of the shortest; NaN
    where there is none. Longer spots stand further apart, and are interpolated along x.

    x, y, score: (spot,), those of one length together, in the order of x.
    """
    starts = np.flatnonzero(np.diff(x) < 0) + 1
    parts = list(zip(*(np.split(values, starts) for values in (x, y, score)), strict=True))
    along, across = np.unique(parts[0][0]), np.unique(parts[0][1])
    shortest = np.full((along.size, across.size), np.nan)
    shortest[np.searchsorted(along, parts[0][0]), np.searchsorted(across, parts[0][1])] = parts[0][2]
    layers = np.full((len(parts), *shortest.shape), np.nan)
    layers[0] = shortest
    for layer, (x_of, y_of, scores) in zip(layers[1:], parts[1:], strict=True):
        for j, row in enumerate(across):
            own = np.isclose(y_of, row)
            if own.any():
                layer[:, j] = np.interp(along, x_of[own], scores[own], left=np.nan, right=np.nan)
    size = np.nan_to_num(np.abs(layers), nan=-1.0)
    strongest = np.take_along_axis(layers, size.argmax(axis=0)[None], axis=0)[0]
    return along, across, np.where(np.isfinite(shortest), strongest, np.nan)


def _paint_marks(axes: Axes, marks: PlanMarks) -> None:
    for patch in marks.patches:
        axes.add_patch(Polygon(patch.corners, closed=True, fill=False, edgecolor=COLOUR["stems"], linewidth=1.1))
    axes.plot(*marks.stations.T, ".", markersize=2.2, color=COLOUR["ink"], markeredgewidth=0, alpha=0.7)
    axes.plot(*marks.aside.T, "x", markersize=5.5, markeredgewidth=1.3, color=COLOUR["ink"], zorder=6)
    for number, one in enumerate(marks.spots):
        if one.angle is None:
            size = 2 * one.length, 2 * one.width
            outline: Patch = Ellipse((one.x, one.y), *size, fill=False, edgecolor=EDGE_COLOUR, zorder=6)
        else:
            sides = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [one.length, one.width]
            turned = np.deg2rad(one.angle)
            turn = np.array([[np.cos(turned), np.sin(turned)], [-np.sin(turned), np.cos(turned)]])
            outline = Polygon(sides @ turn + [one.x, one.y], fill=False, edgecolor=EDGE_COLOUR, zorder=6)
        outline.set_linestyle((0, (4, 2)))
        axes.add_patch(outline)
        axes.plot(one.x, one.y, "*", markersize=13, color=COLOUR["measured"], markeredgecolor=COLOUR["paper"], zorder=7)
        above = number % 2 == 0
        label(
            axes, one.x, one.y, one.words, "ink", xytext=(9, 8 if above else -9), va="bottom" if above else "top",
            fontsize=8.5, fontweight="bold",
        )  # fmt: skip


@styled
def draw_field_map(field: DrawnField, marks: PlanMarks) -> Figure:
    """The field, pale where it is less than two of its standard errors, and below it these errors; y stretched."""
    figure, (upper, lower) = canvas(2 * WIDTH, 4.4, nrows=2, sharex=True, sharey=True)
    largest = float(np.abs(field.value).max()) or 1.0
    told = np.abs(field.value) >= CLEAR_FROM * field.error
    mesh = upper.pcolormesh(
        field.x, field.y, field.value.T, cmap=LESS_TO_MORE, vmin=-largest, vmax=largest, rasterized=True,
        alpha=np.where(told, 1.0, FADED).T,
    )  # fmt: skip
    if told.any() and not told.all():
        upper.contour(field.x, field.y, told.T.astype(float), levels=[0.5], colors=EDGE_COLOUR, linewidths=0.7)
    _colour_bar(upper, mesh, f"{field.what} [{field.unit}]")
    mesh = lower.pcolormesh(field.x, field.y, field.error.T, cmap=GREYS, vmin=0.0, rasterized=True)
    _colour_bar(lower, mesh, f"standard error [{field.unit}]")
    _paint_marks(upper, marks)
    _paint_marks(lower, PlanMarks(marks.patches, marks.stations, marks.aside))
    text = phrase("label", "outlined")
    upper.text(1.0, 1.02, text, transform=upper.transAxes, ha="right", fontsize=SMALL, color=COLOUR["muted"])
    for axes in (upper, lower):
        axes.set_ylabel("y [m]")
    lower.set_xlabel(phrase("label", "along"))
    return figure


def _colour_bar(axes: Axes, mesh: QuadMesh, title: str) -> None:
    every = ScalarMappable(mesh.norm, mesh.cmap)  # of the mesh itself it would be as pale as most of the field
    bar = axes.figure.colorbar(every, ax=axes, label=title, pad=0.012, aspect=12, fraction=0.05)
    bar.outline.set_visible(False)


def outlines(case: Case) -> list[Outline]:
    """Patches as they are drawn."""
    return [Outline(patch.name, corners_of(case, patch)) for patch in case.plants.patches]


def plan_marks(diagnosis: Diagnosis, patches: Sequence[Outline]) -> PlanMarks:
    """Patches, stations, excluded ones, and all places that were found; one of another term than the map is named."""
    station, aside = diagnosis.predictions.station, list(diagnosis.errors.flagged)
    spots = []
    for one in diagnosis.places:
        of_term = "" if one.term == diagnosis.place_map.term else f"{phrase('acting', one.term, one.amplitude)}: "
        angle = None if one.outline is None else one.outline.angle
        words = of_term + phrase("place_of", one.term, one.x, one.y)
        spots.append(MarkedSpot(one.x, one.y, one.length, one.width, words, angle))
    return PlanMarks(
        patches=patches,
        stations=station[["x", "y"]].drop_duplicates().to_numpy(float),
        aside=station.iloc[aside][["x", "y"]].drop_duplicates().to_numpy(float),
        spots=spots,
    )


def place_picture(run: Run, diagnosis: Diagnosis) -> Iterator[Picture]:
    """The map of places, if there is any place where something could be."""
    mapped = diagnosis.place_map
    if mapped.x.size:
        figure = draw_places(mapped.x, mapped.y, mapped.score, mapped.term, plan_marks(diagnosis, outlines(run.case)))
        yield published_picture(run, figure, "missing-places", "caption_places", diagnosis)


def bed_picture(run: Run, diagnosis: Diagnosis) -> Iterator[Picture]:
    """The map of what measurements change a surveyed bed by, if its survey states an error."""
    mapped = diagnosis.bed_map
    if mapped is not None:
        drawn = DrawnField(mapped.x, mapped.y, mapped.value, mapped.error, phrase("label", "bed change"), "m")
        figure = draw_field_map(drawn, replace(plan_marks(diagnosis, outlines(run.case)), spots=[]))
        yield published_picture(run, figure, "learned-bed", "caption_bed")


def field_picture(run: Run, diagnosis: Diagnosis) -> Iterator[Picture]:
    """The map of the field with its standard error, if a field was found."""
    mapped, found = diagnosis.field_map, diagnosis.field
    if mapped is None or found is None:
        return
    scale, unit = (100.0, "%") if found.term == "friction" else (1.0, UNIT_OF_FIELD[found.term])
    what = f"change of {phrase('field_of', found.term)}"
    drawn = DrawnField(mapped.x, mapped.y, scale * mapped.value, scale * mapped.error, what, unit)
    marks = plan_marks(diagnosis, outlines(run.case))
    most = MarkedSpot(found.x, found.y, found.length, found.width, phrase("place", found.x, found.y))
    figure = draw_field_map(drawn, PlanMarks(marks.patches, marks.stations, marks.aside, [most]))
    unclear = float(np.mean(np.abs(mapped.value) < CLEAR_FROM * mapped.error))
    yield published_picture(run, figure, "missing-field", "caption_field", diagnosis, unclear)
