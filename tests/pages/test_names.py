"""Names of any signs are drawn as they are: none is a formula but those of symbols and units."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from drawings import texts
from matplotlib.figure import Figure

from vegglue.pages.diagnosis_figures import draw_fingerprint
from vegglue.pages.measured_figures import draw_quantiles, draw_residuals
from vegglue.pages.posterior_figures import DrawnParameter, draw_cylinder, draw_joint
from vegglue.pages.style import canvas, formula_labels, save, styled
from vegglue.wording.numbers import symbol_math, unit_math

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
