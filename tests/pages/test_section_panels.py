"""Panels of sections and maps, written as SVG: what is drawn is what was handed in."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from vegglue.pages.flow_maps import first_crossing
from vegglue.pages.page import DrawnInterval, draw_interval_rows
from vegglue.pages.sections import PanelGround, SectionPanel, draw_panel, value_range
from vegglue.pages.svg import COLOUR, area_between, line_through, round_ticks, svg_words, tick_labels, within_width

SVG = "{http://www.w3.org/2000/svg}"
GROUND = PanelGround(np.arange(-3.0, 3.5, 0.5), np.abs(np.arange(-3.0, 3.5, 0.5)), np.arange(13) > 6)
PANEL = SectionPanel(
    title="D<3>, x = 36 m",
    y=np.array([-1.0, 0.0, 1.0]),
    measured=np.array([0.4, 0.5, 0.3]),
    error=np.array([0.02, np.nan, 0.02]),
    aside=np.array([False, False, True]),
    before=np.array([0.6, 0.6, 0.6]),
    after=np.array([0.41, 0.49, 0.42]),
    band=None,
    core=None,
    total=None,
    ground=GROUND,
)


def parsed(svg: str) -> ElementTree.Element:
    return ElementTree.fromstring(svg)


def of_class(svg: str, name: str) -> list[ElementTree.Element]:
    return [one for one in parsed(svg).iter() if one.get("class") == name]


def test_a_panel_shows_both_models_and_every_measurement() -> None:
    drawn = draw_panel(PANEL, value_range([PANEL]), "u [m/s]", "synthetic record")
    before, after = (of_class(drawn.svg, name)[0].get("d", "") for name in ("before", "after"))
    heights = [float(part.split(",")[1]) for part in re.findall(r"[\d.]+,[\d.]+", after)]
    assert heights == pytest.approx(drawn.down["after"], abs=0.01)
    assert before.count("L") == after.count("L") == 2
    root = parsed(drawn.svg)
    dots = [one for one in root.iter(f"{SVG}circle") if one.get("cx")]
    assert [dot.get("fill") for dot in dots] == [COLOUR["measured"], COLOUR["measured"], COLOUR["paper"]]
    assert [float(dot.get("cx", "")) for dot in dots] == pytest.approx(drawn.across, abs=0.01)
    words = [text.text for text in root.iter(f"{SVG}text")]
    assert {"D<3>, x = 36 m", "plants", "synthetic record", "u [m/s]"} <= set(words)


def test_an_unchanged_model_is_drawn_once_over_its_bands() -> None:
    edges = np.array([0.3, 0.4, 0.3]), np.array([0.5, 0.6, 0.5])
    drawn = draw_panel(replace(PANEL, before=None, band=edges, core=edges), (0.0, 1.0), "u [m/s]").svg
    assert len(of_class(drawn, "band")) == 2
    assert not [one for one in of_class(drawn, "before") if one.get("d")]


def test_all_values_fit_in_the_range_with_zero_where_it_is_near() -> None:
    low, high = value_range([PANEL])
    assert 0.2 < low < 0.28
    assert high > 0.6
    assert value_range([PANEL, replace(PANEL, after=PANEL.after - 0.3)])[0] == 0.0
    assert value_range([replace(PANEL, measured=PANEL.measured - 0.7)])[0] < -0.4


def test_lines_break_where_nothing_is_known() -> None:
    known = np.array([0.0, 1.0, np.nan, 3.0])
    assert line_through(np.arange(4.0), known) == "M0,0L1,1M3,3"
    assert area_between(np.arange(4.0), known, known + 1) == "M0,1L1,2L3,4L3,3L1,1L0,0Z"
    assert area_between(np.arange(2.0), np.array([0.0, np.nan]), np.ones(2)) == ""


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [(0.0, 0.8, "0.0 0.2 0.4 0.6 0.8"), (-3.2, 3.2, "−2 0 2"), (0.0, 0.065, "0.00 0.02 0.04 0.06")],
)
def test_ticks_are_round(low: float, high: float, expected: str) -> None:
    assert " ".join(tick_labels(round_ticks(low, high, 5))) == expected


def test_words_too_long_for_a_picture_lose_their_middle() -> None:
    assert within_width("D3, x = 42 m", 186.0, 11.5) == "D3, x = 42 m"
    long = draw_panel(replace(PANEL, title=f"{'below the bridge ' * 4}, x = 42 m"), (0.0, 1.0), "u [m/s]").svg
    title = next(text.text or "" for text in parsed(long).iter(f"{SVG}text") if text.get("font-weight") == "bold")
    assert len(title) <= 28
    assert title.startswith("below the")
    assert title.endswith("x = 42 m")
    words = f"{'a-long-name-' * 6}, worth 90 of 5,000 members"
    drawn = draw_interval_rows({words: DrawnInterval(1.0, 2.0, 3.0)}, False, "k")
    assert max(len(text.text or "") for text in parsed(drawn).iter(f"{SVG}text")) * 7.54 <= 460.0
    assert "worth 90 of 5,000 members" in drawn


@pytest.mark.parametrize("logarithmic", [False, True])
@pytest.mark.parametrize("row", [DrawnInterval(102.34, 102.36, 102.39), DrawnInterval(0.03, 0.03, 0.03)])
def test_numbers_of_an_axis_differ(row: DrawnInterval, logarithmic: bool) -> None:
    svg = draw_interval_rows({"run": row}, logarithmic, "k")
    _, *numbers = [text.text or "" for text in parsed(svg).iter(f"{SVG}text") if text.text != "k"]
    assert len(numbers) == len(set(numbers)) >= 2
    assert max(map(len, numbers)) <= 7, "no ten digits for one value alone"


def test_words_of_users_are_no_markup() -> None:
    assert "&lt;b&gt;" in svg_words(0, 0, "<b>", text_anchor='"')
    assert 'text-anchor="&quot;"' in svg_words(0, 0, "x", text_anchor='"')


def test_a_streamline_lies_where_the_discharge_is_reached() -> None:
    y = np.arange(5.0)
    psi = np.array([[0.0, 1.0, 2.0, 3.0, 4.0], [np.nan, np.nan, 0.0, 4.0, 8.0], [0.0, 0.1, 0.2, 0.3, 0.4]])
    assert first_crossing(y, psi, 1.5) == pytest.approx([1.5, 2.375, np.nan], nan_ok=True)
