"""Figures of causes that are no listed effect: the maps of places and of a field; captions state the finding."""

import html
import re
from collections.abc import Iterator, Sequence

import numpy as np

from vegglue.case.polygons import corners_of
from vegglue.case.schema import Case
from vegglue.report.cause_words import (
    FIELD_WORDS,
    accepted_causes,
    field_in_words,
    field_scale,
    instrument_in_words,
    place_in_words,
    what_at,
    where,
)
from vegglue.report.places import TERM_SIGNS, TOLD_FROM, DrawnField, MarkedSpot, PlanMarks, draw_field_map, draw_places
from vegglue.report.plan_view import Outline
from vegglue.report.run import Run, published_picture
from vegglue.report.style import Picture
from vegglue.report.typography import percent
from vegglue.results.diagnosis import Diagnosis


def outlines(case: Case) -> list[Outline]:
    """Patches as they are drawn."""
    return [Outline(patch.name, corners_of(case, patch)) for patch in case.plants.patches]


def plan_marks(diagnosis: Diagnosis, patches: Sequence[Outline]) -> PlanMarks:
    """Patches, stations, those set aside, and all places that were found; one of another term than the map says so."""
    station, aside = diagnosis.predictions.station, list(diagnosis.errors.flagged)
    mapped = diagnosis.place_map.term
    return PlanMarks(
        patches=patches,
        stations=station[["x", "y"]].drop_duplicates().to_numpy(float),
        aside=station.iloc[aside][["x", "y"]].drop_duplicates().to_numpy(float),
        spots=[
            MarkedSpot(
                one.x,
                one.y,
                one.length,
                one.width,
                ("" if one.term == mapped else f"{what_at(one)}: ") + where(one.x, one.y),
            )
            for one in diagnosis.places
        ],
    )


def place_picture(run: Run, diagnosis: Diagnosis) -> Iterator[Picture]:
    """The map of places, if there is any place where something could be."""
    mapped = diagnosis.place_map
    if not mapped.x.size:
        return
    finding = _finding(diagnosis)
    more, less = TERM_SIGNS[mapped.term]
    caption = (
        f"<b>Where a spot of {_term(mapped.term)} would help</b> the model as it was, y stretched. {finding}. Green: "
        f"patches; dots: stations; full lines: {more} would help, dashed: {less}."
    )
    figure = draw_places(mapped.x, mapped.y, mapped.score, mapped.term, plan_marks(diagnosis, outlines(run.case)))
    alt = _spoken(f"Plan of the channel with scores of a spot of {_term(mapped.term)}. {finding}.")
    yield published_picture(run, figure, "missing-places", caption, alt)


def _finding(diagnosis: Diagnosis) -> str:
    """What is marked on the map (HTML)."""
    if diagnosis.places:
        marked = "; ".join(place_in_words(one) for one in diagnosis.places)
        found = f"Marked, with the outline of the spot: {marked}"
    elif diagnosis.steps:
        found = f"No place explains as much as {html.escape(accepted_causes(diagnosis))} does"
    else:
        found = "No place stands out more than errors alone make it"
    if diagnosis.instruments:
        found += f". Crosses: set aside ({'; '.join(instrument_in_words(one) for one in diagnosis.instruments)})"
    return found


def _term(term: str) -> str:
    return {"drag": "drag", "bed": "the bed level", "inflow": "water that enters", "viscosity": "mixing"}[term]


def field_picture(run: Run, diagnosis: Diagnosis) -> Iterator[Picture]:
    """The map of the field with its standard error, if a field was found."""
    mapped, found = diagnosis.field_map, diagnosis.field
    if mapped is None or found is None:
        return
    what, unit = FIELD_WORDS[found.term]
    scale = field_scale(found.term)
    drawn = DrawnField(mapped.x, mapped.y, scale * mapped.value, scale * mapped.error, f"change of {what}", unit)
    marks = plan_marks(diagnosis, outlines(run.case))
    most = MarkedSpot(found.x, found.y, found.length, found.width, where(found.x, found.y))
    told = float(np.mean(np.abs(mapped.value) >= TOLD_FROM * mapped.error))
    finding = f"It acts like {field_in_words(diagnosis)}"
    caption = (
        f"<b>The field of {what}</b> that would close the misfit, and its standard error, y stretched. {finding}. "
        f"Pale: within two standard errors of nothing, {percent(1 - told)} of the plan; dashed: the size of its bumps."
    )
    figure = draw_field_map(drawn, PlanMarks(marks.patches, marks.stations, marks.aside, [most]))
    alt = _spoken(f"Plan of the channel with a field of {what} and its standard error. {finding}.")
    yield published_picture(run, figure, "missing-field", caption, alt)


def _spoken(words: str) -> str:
    """Without tags, for those who hear the page."""
    return html.unescape(re.sub("<[^>]+>", "", words))
