"""What is drawn of a posterior."""

from pathlib import Path

import numpy as np
import pytest
from report_runs import a_toy

from vegglue.pages.parameters import parameter_row
from vegglue.pages.posterior_figures import range_of_figure, references_of


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
