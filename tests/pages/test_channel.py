"""The channel that `vegglue check` draws: what stands in it is what the case and its measurements say."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drawings import off_the_sheet, points, texts
from matplotlib.axes import Axes

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.zones import corners_of
from vegglue.measurements.observations import read_observations
from vegglue.pages.channel import REACH_OF_INTEREST_MARGIN, draw_channel

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.mark.parametrize("name", ["twin", "d3a"])
def test_the_channel_shows_patches_stations_and_boundaries_where_they_are(name: str) -> None:
    case = load_case(CONFIGS / f"{name}.yaml")
    site, observations = build_site(case), read_observations(case)
    figure = draw_channel(case, site, observations)
    whole, reach, across = figure.axes[0], figure.axes[-2], figure.axes[-1]
    assert (len(figure.axes) == 3) is (name == "d3a"), "the twin is short: its reach of interest is the whole"
    table, corners = observations.table, [corners_of(case, patch) for patch in case.plants.patches]
    for marker, rows in (("o", table[table["used"]]), ("x", table[~table["used"]])):
        assert sorted(points(reach, marker)) == sorted(zip(rows["x"], rows["y"], strict=True))
    assert np.array_equal(whole.images[0].get_array(), site.friction_class.T)
    filled = [patch for patch in reach.patches if patch.get_fill()]
    assert [patch.get_xy()[:4].tolist() for patch in filled] == [each.tolist() for each in corners]
    assert {patch.name for patch in case.plants.patches} <= set(texts(reach))
    assert {"upstream", "outlet"} <= set(texts(whole))
    assert (whole.get_xlim(), whole.get_ylim()) == (case.grid.x, case.grid.y)
    along = [*table["x"], *np.concatenate(corners)[:, 0]]
    expected = (
        max(case.grid.x[0], min(along) - REACH_OF_INTEREST_MARGIN),
        min(case.grid.x[1], max(along) + REACH_OF_INTEREST_MARGIN),
    )
    assert reach.get_xlim() == pytest.approx(expected)
    middle = int(np.abs(site.grid.x - 0.5 * sum(expected)).argmin())
    assert np.array_equal(across.lines[0].get_ydata(), site.bed[middle])
    assert set(case.experiments) <= set(texts(across))
    assert off_the_sheet(figure) == []


def test_the_place_of_the_section_has_few_digits() -> None:
    """`Bed across x = 30.3333 m` stood above the channel of a wading survey."""
    case = load_case(CONFIGS / "twin.yaml")
    site = build_site(case)
    odd = replace(site, grid=replace(site.grid, x=site.grid.x + 1.0 / 3.0))
    title = draw_channel(case, odd, read_observations(case)).axes[-1].get_title(loc="left")
    place = re.search(r"x = (\d+(\.\d+)?) m", title)
    assert place is not None
    assert len(place[1]) <= 5


def covered(axes: Axes, x: np.ndarray, y: np.ndarray) -> list[str]:
    """Texts within these axes below which one of the places lies."""
    figure = axes.get_figure()
    figure.canvas.draw()
    places = axes.transData.transform(np.column_stack([x, y]))
    boxes = {text.get_text(): text.get_window_extent() for text in axes.texts}
    return [text for text, box in boxes.items() if any(box.contains(*place) for place in places)]


def test_no_name_covers_a_gauge() -> None:
    """`upstream` and `outlet` stood on the axis at the ends, where gauges are, and the name of a patch on stations."""
    case = load_case(CONFIGS / "twin.yaml")
    site, observations = build_site(case), read_observations(case)
    (west, east), (patch, *_) = case.grid.x, case.plants.patches
    middle = np.vstack([corners_of(case, patch).mean(axis=0)])
    x = np.array([west + 0.03 * (east - west), east - 0.025 * (east - west), middle[0, 0]])
    y = np.array([0.5 * sum(case.grid.y), 0.5 * sum(case.grid.y), middle[0, 1]])
    table = observations.table.iloc[:3].assign(x=x, y=y, used=True)
    whole = draw_channel(case, site, replace(observations, table=table)).axes[0]
    assert {"upstream", "outlet", patch.name} <= {text.get_text() for text in whole.texts}
    assert covered(whole, x, y) == []
    far = replace(observations, table=table.assign(y=case.grid.y[0]))
    usual = {text.get_text(): text for text in draw_channel(case, site, far).axes[0].texts}
    assert usual["outlet"].xy[1] == pytest.approx(0.5 * sum(case.grid.y)), "in the middle, where nothing stands"
