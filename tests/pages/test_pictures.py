"""What is drawn of a posterior."""

from pathlib import Path

import numpy as np
import pytest
from report_runs import a_toy

from vegglue.flow.sensor import FlowFields
from vegglue.pages.flow_maps import channel_caption, scale_in_words
from vegglue.pages.posterior_figures import range_of_figure, references_of
from vegglue.pages.tables import parameter_rows


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


def test_a_plan_is_at_true_scale_where_its_words_would_say_once() -> None:
    """The page said: y stretched 1 times."""
    assert [scale_in_words(stretch) for stretch in (1.0, 1.02, 1.52)] == [
        "at true scale", "at true scale", "y stretched 1.5 times"
    ]  # fmt: skip


def test_the_water_of_a_flume_falls_by_millimetres() -> None:
    """The page said: by 0.01 m, and the depth from 0.10 to 0.10 m."""
    x, y = np.linspace(0.1, 7.9, 40), np.linspace(-0.35, 0.35, 8)
    bed = np.repeat(-0.001 * x[:, None], 8, axis=1)
    level = np.repeat(np.linspace(0.0978, 0.0920, 40)[:, None], 8, axis=1)
    flow = FlowFields(x, y, bed, level - bed, level, 0.3 + 0 * bed, 0 * bed)
    caption = channel_caption(flow, "low", "")
    assert "the water level falls 0.0058 m over 7.80 m" in caption
    assert "the greatest depth goes from 0.0979 to 0.0999 m." in caption


@pytest.mark.parametrize(
    ("table", "value", "sd", "told"),
    [
        ({"phi": [30.0, 3.0], "log10_phi": [1.6, 0.2]}, 10**1.6, 0.2, "10<sup>1.6 ± 0.2</sup>"),
        ({"phi": [30.0, 3.0]}, 10**1.477, 0.043, "10<sup>1.477 ± 0.043</sup>"),
        ({"phi": 30.0}, 10**1.48, np.nan, "10<sup>1.48</sup>"),
        ({"n_b": [0.03, 0.01], "log10_n_b": [-1.0, 0.1]}, 0.03, 0.01, "0.03 ± 0.01"),
        ({"log10_n_b": [-1.0, 0.1]}, 0.1, 0.023, "0.100 ± 0.023"),
    ],
)
def test_a_figure_marks_the_value_that_the_table_tells(
    tmp_path: Path, table: dict[str, object], value: float, sd: float, told: str
) -> None:
    """Of a study that gives a parameter and its power of ten, the figure marked one and the table told the other."""
    run = a_toy(tmp_path, reference={"source": "A study", "table": table})
    name = next(iter(table)).removeprefix("log10_")
    marked = references_of(run, name)[0]
    assert (marked.value, marked.sd) == pytest.approx((value, sd), nan_ok=True)
    row = {"n_b": 0, "phi": 1}[name]
    assert parameter_rows(run)[row].reference.study.replace("\u00a0", " ") == told
