"""What is drawn of a posterior."""

import numpy as np
import pytest

from vegglue.report_page.pictures import range_of_figure


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
