"""A field is so free that it has to beat all else clearly."""

import pytest

from vegglue.diagnosis.conclusion import field_goes_first


@pytest.mark.parametrize(("log_factor", "gained", "first"), [
    (3.7, 0.0, False), (1.8, -2.0, False), (6.0, 0.0, True), (30.0, 26.0, False), (30.0, 10.0, True),
])  # fmt: skip
def test_a_field_beats_the_rest_by_a_hundred_to_one(log_factor: float, gained: float, first: bool) -> None:
    """The first two were told on sites of the blind study on which nothing is hidden."""
    assert field_goes_first(log_factor, gained) == first
