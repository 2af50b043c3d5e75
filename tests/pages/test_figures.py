"""Figures: what is drawn is what was handed in, and a picture in the page is self-contained."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.special
from drawings import off_the_sheet, points, texts
from matplotlib.figure import Figure
from report_runs import a_toy

from vegglue.flow.sensor import FlowFields
from vegglue.pages.diagnosis_figures import draw_fingerprint
from vegglue.pages.flow_maps import draw_reach, stream_function, stretch_of, wet_window
from vegglue.pages.measured_figures import Vertical, draw_quantiles, draw_residuals, draw_verticals
from vegglue.pages.parameters import parameter_row
from vegglue.pages.posterior_figures import (
    LONGEST_LABEL,
    POSTERIOR_MEMBERS,
    DrawnParameter,
    ReferenceValue,
    density,
    draw_cylinder,
    draw_joint,
    draw_marginal,
    draw_weights,
    range_of_figure,
    references_of,
)
from vegglue.pages.style import canvas, formula_labels, publish, publish_text, save, styled
from vegglue.pages.svg import COLOUR, PALETTE, inline
from vegglue.wording.numbers import (
    as_given,
    fixed,
    interval,
    percent,
    plus_minus,
    short,
    symbol_html,
    symbol_math,
    unit_html,
    unit_math,
)


def uniform_flow(u: float = 0.5, v: float = 0.0) -> FlowFields:
    x, y = np.arange(0.5, 40), np.arange(0.25, 6, 0.5)
    depth = np.where((y > 1) & (y < 5), 2.0, np.nan) * np.ones((len(x), 1))
    bed = np.zeros((len(x), len(y)))
    return FlowFields(x, y, bed, depth, bed + depth, u + 0 * depth, v + 0 * depth)


def unknown(values: np.ndarray, low: float, high: float, logarithmic: bool = False) -> DrawnParameter:
    return DrawnParameter(values, values, low, high, logarithmic, "k_s", "m", (low, high))


def test_density_keeps_its_mass_at_a_bound() -> None:
    values = np.linspace(0.0, 1.0, 2001)[1::2]
    grid, flat = density(values, np.ones(len(values)), 0.0, 1.0, (0.0, 1.0))
    assert np.trapezoid(flat, grid) == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(flat, 1.0, atol=0.03)


def test_a_density_without_bounds_is_not_folded_into_the_window() -> None:
    """A normal prior was drawn 2.6 times too high where the posterior is narrow."""
    values = scipy.special.ndtri((np.arange(4000) + 0.5) / 4000)
    _, drawn = density(values, np.ones(values.size), -0.3, 0.3, (-np.inf, np.inf))
    np.testing.assert_allclose(drawn, 0.39, atol=0.02)


def test_density_follows_the_weights() -> None:
    values = np.linspace(0.0, 1.0, 1001)
    weights = np.exp(-0.5 * ((values - 0.7) / 0.05) ** 2)
    grid, drawn = density(values, weights, 0.0, 1.0, (0.0, 1.0))
    assert grid[np.argmax(drawn)] == pytest.approx(0.7, abs=0.01)
    assert np.sqrt(np.trapezoid(drawn * (grid - 0.7) ** 2, grid)) == pytest.approx(0.05, rel=0.1)


def test_a_narrow_density_is_drawn_as_narrow_as_it_is() -> None:
    values = 0.3 + 0.001 * np.random.default_rng(5).normal(size=4000)  # 0.4 % of the range
    grid, found = density(values, np.ones(4000), 0.0, 1.0, (0.0, 1.0))
    mass = np.trapezoid(found, grid)
    middle = np.trapezoid(found * grid, grid) / mass
    assert mass == pytest.approx(1.0, abs=0.01)
    assert math.sqrt(np.trapezoid(found * (grid - middle) ** 2, grid) / mass) == pytest.approx(0.001, rel=0.5)


def test_density_of_a_single_member_is_finite() -> None:
    _, drawn = density(np.array([0.2, 0.5]), np.array([1.0, 0.0]), 0.0, 1.0, (0.0, 1.0))
    assert np.isfinite(drawn).all()


def test_stream_function_of_a_uniform_flow_is_its_discharge() -> None:
    psi = stream_function(uniform_flow(0.5))
    assert psi[:, 0] == pytest.approx(0.0)
    assert psi[:, -1] == pytest.approx(0.5 * 2.0 * 4.0)


def test_stream_function_of_a_turning_flow() -> None:
    """u = y, v = x on depth 1 has psi = (y^2 - x^2) / 2."""
    x, y = np.arange(0.05, 4, 0.1), np.arange(0.05, 3, 0.1)
    across, along = np.meshgrid(y, x)
    one = np.ones_like(along)
    psi = stream_function(FlowFields(x, y, 0 * one, one, one, across, along))
    exact = 0.5 * (across**2 - along**2)
    np.testing.assert_allclose(psi - psi[0, 0], exact - exact[0, 0], atol=0.25)
    assert np.corrcoef(psi.ravel(), exact.ravel())[0, 1] > 0.999


def test_window_is_as_wide_as_the_water() -> None:
    assert wet_window(uniform_flow(), (10.0, 30.0)) == pytest.approx((10.0, 30.0, 0.75, 5.25))


def test_what_an_edge_cuts_off_is_seen() -> None:
    figure = draw_weights(np.ones(8))
    assert off_the_sheet(figure) == []
    figure.text(0.98, 0.5, "too long a word")
    assert len(off_the_sheet(figure)) == 1


def test_verticals_stand_at_their_y_with_velocity_to_the_right() -> None:
    height = np.array([0.1, 0.5])
    vertical = Vertical(2.0, -1.0, 1.0, True, height, np.array([0.2, 0.4]), np.array([True, True]), height, height)
    axes = draw_verticals([vertical, vertical], (0.4, 0.05), 0.5).axes[0]
    points = next(line for line in axes.lines if line.get_marker() == "o")
    assert points.get_xdata() == pytest.approx([2.1, 2.2])
    assert points.get_ydata() == pytest.approx([-0.9, -0.5])


def test_the_canopy_is_drawn_above_the_bed_that_its_plants_stand_on() -> None:
    height = np.array([0.1, 0.5])
    used = np.array([True, True])
    flood_plain = Vertical(6.0, 1.0, 1.0, True, height, height, used, height, height)
    main = Vertical(2.0, -1.0, 3.0, False, height, height, used, height, height)
    axes = draw_verticals([flood_plain, main], (0.4, 0.05), 0.5).axes[0]
    canopy = next(line for line in axes.lines if line.get_color() == COLOUR["stems"])
    assert set(canopy.get_ydata()) == {1.4}  # it lay at -0.6, below the ground of the plants
    edge = axes.collections[0].get_paths()[0].vertices
    assert list(np.unique(edge[:, 0])) == [2.0, 6.0]
    assert list(edge[:3, 0]) == sorted(edge[:3, 0]), "the ground is drawn from bank to bank"


def test_residuals_of_any_number_of_zones_are_drawn() -> None:
    zones = [f"class {number}" for number in range(9)]
    axes = draw_residuals(np.arange(9.0), "y", np.linspace(-1, 1, 9), zones, "m/s").axes[0]
    drawn = [line for line in axes.lines if line.get_linestyle() == "None"]
    assert len(drawn) == len(zones)


def test_quantiles_pair_the_smallest_residual_with_the_smallest_quantile() -> None:
    axes = draw_quantiles(np.array([2.0, -1.0, 0.1]), ["c", "a", "b"]).axes[0]
    points = next(line for line in axes.lines if line.get_marker() == "o")
    assert list(points.get_ydata()) == [-1.0, 0.1, 2.0]
    assert points.get_xdata() == pytest.approx([-0.967, 0.0, 0.967], abs=1e-3)
    assert {"a", "c"} <= set(texts(axes))


def test_marginal_marks_references_on_the_logarithmic_axis() -> None:
    values = np.geomspace(0.01, 100, 500)
    reference = ReferenceValue("A study, Table 3", 10.0, 0.2, "D")
    figure = draw_marginal(unknown(values, 0.01, 100, True), np.ones(500), [reference])
    (axes,) = figure.axes
    assert [x for x, _ in points(axes, "D")] == pytest.approx([1.0])
    assert "A study, Table 3" in texts(axes)
    assert axes.get_xlim() == pytest.approx((-2, 2))
    assert off_the_sheet(figure) == []


def test_marginal_keeps_the_longest_label_on_the_sheet() -> None:
    """A label as long as reports cut a source to, beside values all over the prior."""
    values, name = np.linspace(0.0, 1.0, 500), "Wunderlich and Meyer (2020)"[:LONGEST_LABEL]
    for place in (0.02, 0.49, 0.51, 0.98):
        figure = draw_marginal(unknown(values, 0, 1), np.ones(500), [ReferenceValue(name, place, 0.1, "D")])
        assert off_the_sheet(figure) == []
        assert figure.axes[0].get_position().width > 0.8, "the label takes no room from the density"


def test_marginal_draws_the_prior_from_its_own_values_or_not_at_all() -> None:
    values = np.linspace(0.4, 0.6, 500)
    before = np.linspace(0.0, 1.0, 500)
    spread = DrawnParameter(values, before, 0.0, 1.0, False, "k_s", "m", (0.0, 1.0))
    for drawn, height in ((spread, 1.0), (replace(spread, prior=np.zeros(0)), 0.0)):
        outline = draw_marginal(drawn, np.ones(500), []).axes[0].collections[0].get_paths()[0].vertices
        inside = (outline[:, 0] > 0.2) & (outline[:, 0] < 0.8)
        assert outline[inside, 1].max() == pytest.approx(height, abs=0.05)


def test_joint_draws_area_in_proportion_to_weight() -> None:
    weights = np.array([0.5, 0.25, 0.25, 0.0])
    values = np.array([1.0, 2.0, 3.0, 4.0])
    figure = draw_joint(unknown(values, 0, 5), unknown(values, 0, 5), weights, [])
    sizes = figure.axes[0].collections[0].get_sizes()
    assert len(sizes) == 3
    assert sizes[0] == pytest.approx(2 * sizes[1])


def test_a_long_name_stays_on_the_sheet() -> None:
    place = replace(
        unknown(np.linspace(0.1, 1.0, 20), 0.0, 2.0), symbol="unlisted_object_x33_75_y_0_68_drag", unit="1/m"
    )
    figure = draw_joint(place, place, np.ones(20) / 20, [])
    assert off_the_sheet(figure) == []
    assert figure.axes[0].get_ylabel().replace("\n", "") == "unlisted_object_x33_75_y_0_68_drag [1/m]"


def test_joint_of_many_draws_shows_some_of_them() -> None:
    values = np.linspace(1.0, 4.0, 3000)
    figure = draw_joint(unknown(values, 0, 5), unknown(values, 0, 5), np.ones(3000), [])
    drawn = np.asarray(figure.axes[0].collections[0].get_offsets())[:, 0]
    assert 200 < len(drawn) <= POSTERIOR_MEMBERS
    assert (drawn.min(), drawn.max()) == pytest.approx((1.0, 4.0), abs=0.02)


def test_all_weight_on_one_member_can_be_drawn() -> None:
    weights = np.eye(8)[3]
    values = np.linspace(1, 2, 8)
    drawn = draw_weights(weights), draw_joint(unknown(values, 0, 5), unknown(values, 0, 5), weights, [])
    (shares,), (joint,) = (figure.axes for figure in drawn)
    assert texts(shares) == ["50 % in 1 members", "95 % in 1 members"]
    assert shares.lines[0].get_ydata() == pytest.approx(1.0)
    assert shares.get_xlim() == (1, 8)
    assert np.asarray(joint.collections[0].get_offsets()) == pytest.approx(np.array([[values[3], values[3]]]))
    cylinder = draw_cylinder(values, weights, values, 0.1, 10.0, "φ")
    assert len(texts(cylinder.axes[0])) == 2
    inferred = next(line for line in cylinder.axes[0].lines if line.get_color() == COLOUR["model"])
    peak = inferred.get_xdata()[np.argmax(inferred.get_ydata())]
    assert peak == pytest.approx(np.log10(values[3]), abs=0.02)
    assert cylinder.axes[0].get_xlim() == pytest.approx((-1, 1))
    assert [off_the_sheet(figure) for figure in (*drawn, cylinder)] == [[], [], []]


def test_published_picture_stands_alone(tmp_path: Path) -> None:
    drawn = draw_reach(uniform_flow(), (0, 40, 0, 6), [], np.array([[5.0, 3.0]]), "synthetic record")
    assert ">synthetic record</text>" in drawn
    picture = publish_text(drawn, tmp_path, "reach", "A caption.", 'Depth & "velocity"')
    assert picture.width == 902
    file = (tmp_path / "reach.svg").read_text(encoding="utf-8")
    assert COLOUR["ink"] in file
    assert "var(--" not in file
    assert 'aria-label="Depth &amp; &quot;velocity&quot;"' in picture.svg
    assert not any(colour in picture.svg for colour in COLOUR.values())
    ids = re.findall(r' id="([^"]+)"', picture.svg)
    used = re.findall(r'(?:href="#|url\(#)([^")]+)', picture.svg)
    assert len(ids) == len(set(ids))
    assert set(used) <= set(ids)
    assert all(name.startswith("reach-") for name in ids)


def test_a_long_reach_is_stretched_until_its_streamlines_part() -> None:
    wide, long = (0.0, 40.0, 0.0, 6.0), (0.0, 400.0, 0.0, 6.0)
    assert stretch_of(wide) == 1.0
    ten = stretch_of((0.0, 4000.0, 0.0, 6.0)) / stretch_of(long)
    assert ten == pytest.approx(10.0)
    heights = [float(re.search(r'height="(\d+)', draw_reach(uniform_flow(), one, [], np.zeros((0, 2))))[1])
               for one in (long, (0.0, 4000.0, 0.0, 6.0))]  # fmt: skip
    assert heights[0] == heights[1]


def test_the_same_figure_is_the_same_file(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        values = np.array([0.1, -0.2, 0.3])
        figure = draw_residuals(np.arange(3.0), "y", values, ["bed", "bed", "bank"], "m/s")
        publish(figure, tmp_path / folder, "residuals", "", "", "synthetic record")
        assert figure.get_suptitle() == "synthetic record"
    assert (tmp_path / "a/residuals.svg").read_bytes() == (tmp_path / "b/residuals.svg").read_bytes()


def test_inline_takes_the_colours_of_the_page() -> None:
    svg = f'<?xml version="1.0"?><svg width="1pt" viewBox="0 0 1 1"><path style="fill: {COLOUR["model"]}"/></svg>'
    assert (
        inline(svg, "x", "a")
        == '<svg role="img" aria-label="a" viewBox="0 0 1 1"><path style="fill: var(--model)"/></svg>'
    )


@pytest.mark.parametrize("theme", [0, 1])
@pytest.mark.parametrize("name", ["ink", "muted", "model", "measured", "stems"])
def test_colours_of_text_are_legible(name: str, theme: int) -> None:
    """Contrast of at least 4.5, WCAG 2.1 AA."""
    light, dark = sorted((luminance(PALETTE["paper"][theme]), luminance(PALETTE[name][theme])), reverse=True)
    assert (light + 0.05) / (dark + 0.05) >= 4.5


def luminance(colour: str) -> float:
    """Y = 0.2126 R + 0.7152 G + 0.0722 B of linear sRGB."""
    value = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize(
    ("set_", "expected"),
    [
        (plus_minus(0.09812, 0.00812), "0.0981 ± 0.0081"),
        (plus_minus(2.7049, 0.33), "2.70 ± 0.33"),
        (plus_minus(-0.31, 0.093), "−0.310 ± 0.093"),
        (plus_minus(1234.4, 56.0), "1234 ± 56"),
        (plus_minus(102.346, 0.012), "102.35 ± 0.01"),  # a level in a datum
        (plus_minus(0.110223, 3e-8), "0.11022300 ± 0.00000003"),
        (as_given(0.104, 0.01), "0.104 ± 0.010"),
        (as_given(39.81), "39.81"),
        (as_given(1.5e-5, 2e-6), "0.000015 ± 0.000002"),
        (as_given(1.2e7, 1e5), "12000000 ± 100000"),
        (fixed(-0.001, 1), "0.0"),
        (fixed(float("nan"), 1), "–"),
        (short(0.0245, 2), "0.025"),
        (short(1.8e-5), "1.8·10⁻⁵"),
        (short(1e-4), "10⁻⁴"),
        (short(9.97e-5), "10⁻⁴"),
        (short(-9.97e6), "−10⁷"),
        (interval(0.0873, 0.1126), "0.0873 to 0.1126"),
        (percent(0.0001), "< 0.1 %"),
        (percent(0.194), "19 %"),
        (percent(0.067), "6.7 %"),
        (symbol_html("n_b"), "<var>n</var><sub>b</sub>"),
        (unit_html("s m^(-1/3)"), "s m<sup>−1/3</sup>"),
        (unit_html("m3/s"), "m<sup>3</sup>/s"),
        (unit_html("-"), ""),
        (unit_math("s m^(-1/3)"), "s m$^{-1/3}$"),
    ],
)
def test_numbers_are_set_as_in_print(set_: str, expected: str) -> None:
    assert set_.replace("\u202f", " ").replace("\u00a0", " ") == expected


@pytest.mark.parametrize(("bounds", "logarithmic", "wanted"), [
    ((0.0, 10.0), False, (0.0, 10.0)),
    ((-45.0, 45.0), False, (0.5, 9.8)),
    ((0.4, np.inf), False, (0.4, 9.8)),
    ((0.4, 12.0), True, (0.4, 12.0)),
    ((1e-9, 1e9), True, (0.5, 9.8)),
])  # fmt: skip
def test_a_figure_ends_where_values_do_or_at_the_bounds_they_come_near(
    bounds: tuple[float, float], logarithmic: bool, wanted: tuple[float, float]
) -> None:
    """Water that enters was a needle on an axis from -45 to 45 m3/s, with a prior of 0.13 m3/s."""
    assert range_of_figure(np.linspace(0.5, 9.8, 50), bounds, logarithmic) == pytest.approx(wanted)


def test_one_value_is_drawn_between_the_bounds() -> None:
    assert range_of_figure(np.array([2.0, 2.0]), (1.0, 5.0), False) == (1.0, 5.0)


@pytest.mark.parametrize(
    ("table", "value", "sd", "study"),
    [
        ({"phi": [30.0, 3.0], "log10_phi": [1.6, 0.2]}, 10**1.6, 0.2, 1.6),
        ({"phi": [30.0, 3.0]}, 10**1.477, 0.043, 1.477),
        ({"phi": 30.0}, 10**1.48, np.nan, 1.48),
        ({"n_b": [0.03, 0.01], "log10_n_b": [-1.0, 0.1]}, 0.03, 0.01, 0.03),
        ({"log10_n_b": [-1.0, 0.1]}, 0.1, 0.023, 0.1),
    ],
)
def test_a_figure_marks_the_value_of_the_table(
    tmp_path: Path, table: dict[str, object], value: float, sd: float, study: float
) -> None:
    """Of a study that gives a parameter and its power of ten, the figure marked one and the table the other."""
    run = a_toy(tmp_path, reference={"source": "A study", "table": table})
    name = next(iter(table)).removeprefix("log10_")
    marked = references_of(run, name)[0]
    assert (marked.value, marked.sd) == pytest.approx((value, sd), nan_ok=True)
    assert parameter_row(run, name).study == pytest.approx((study, sd), nan_ok=True)


NASTY = (
    "10\\south", "$n_b$", "$x^$", "a b%", "n^", "x_", "_x", "a_b_c", "a_{b", "\\frac", "$", "$$", "\\$", "a#b&c~", "{}",
    "<script>alert(1)</script>", "]]>", "&amp;", "φ_d", "%", "'", "",
)  # fmt: skip


def drawn(figure: Figure) -> Figure:
    figure.canvas.draw()
    return figure


@pytest.mark.parametrize("name", NASTY)
def test_a_symbol_or_unit_of_any_signs_can_be_drawn(name: str) -> None:
    values = np.linspace(1.0, 2.0, 50)
    parameter = DrawnParameter(values, values, 1.0, 2.0, False, name, name, (1.0, 2.0))
    drawn(draw_joint(parameter, parameter, np.full(50, 0.02), [(name, 1.5, 1.5, "o")]))
    drawn(draw_cylinder(values, np.full(50, 0.02), values, 1.0, 2.0, name))


@pytest.mark.parametrize("name", NASTY)
def test_a_section_of_any_signs_is_written_as_it_is(name: str) -> None:
    assert name in texts(drawn(draw_quantiles(np.array([-1.0, 0.0, 1.0]), [name] * 3)).axes[0])
    residuals = draw_residuals(np.arange(3.0), "x", np.arange(3.0), [name] * 3, unit_math("m/s"))
    assert name in texts(drawn(residuals).axes[0])


@pytest.mark.parametrize("name", NASTY)
def test_the_size_of_an_effect_is_written_as_it_is(name: str) -> None:
    station = pd.DataFrame({"experiment": "E", "kind": "velocity", "section": "S", "x": 1.0, "y": np.arange(3.0)})
    figure = drawn(draw_fingerprint(np.arange(3.0), station, f"2 {name}"))
    assert figure.get_suptitle() == f"by 2 {name}"


@styled
def formula(text: str) -> Figure:
    figure = Figure()
    formula_labels(figure.subplots(), text)
    return drawn(figure)


def test_symbols_and_units_stay_formulae() -> None:
    assert symbol_math("n_b") == "$n_{b}$"
    assert symbol_math("discharge_error[high]") == "$discharge_{error[high]}$"
    assert symbol_math("$n_b$") == r"\$n_b\$"
    assert unit_math("$ m^2") == r"\$ m$^{2}$"
    assert formula("$n_{b}$").axes[0].xaxis.label.get_parse_math()


def test_signs_that_no_font_has_make_no_complaints(tmp_path: Path) -> None:
    """Warnings are errors in these tests."""
    figure, axes = canvas()
    axes.set_title("\U000131f2")  # a hieroglyph
    save(figure, tmp_path / "hieroglyph.png", 50)
    assert (tmp_path / "hieroglyph.png").stat().st_size > 0
