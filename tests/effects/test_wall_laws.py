"""Friction of walls: the laws of the bed at the width of a cell."""

import numpy as np
import pytest

from vegglue.effects.bed_laws import CHEZY, KEULEGAN, MANNING, wall_coefficient

FLOOR = 1.3


@pytest.mark.parametrize(
    ("law", "coefficient", "chezy"),
    [(MANNING, 0.01, 0.05 ** (1 / 6) / 0.01), (KEULEGAN, 0.001, 18.0 * np.log10(600.0)), (CHEZY, 60.0, 60.0)],
)
def test_the_coefficient_is_that_of_the_law_at_the_width_of_a_cell(law: int, coefficient: float, chezy: float) -> None:
    assert wall_coefficient(law, np.array([coefficient]), 0.05, FLOOR) == pytest.approx(9.81 / chezy**2)


def test_the_logarithm_is_bounded_as_on_banks() -> None:
    rough = wall_coefficient(KEULEGAN, np.array([0.5, 5.0]), 0.05, FLOOR)
    assert rough == pytest.approx(9.81 / (18.0 * np.log10(FLOOR)) ** 2)


def test_a_logarithmic_profile_over_the_cell_has_nearly_this_stress() -> None:
    """u(y) = u*/kappa ln(30 y/k_s), its mean over the cell: Keulegan's 12 and 18 are 7 % below it in the stress."""
    width, roughness = 0.05, 0.001
    mean = (np.log(30.0 * width / roughness) - 1.0) / 0.41
    assert wall_coefficient(KEULEGAN, np.array([roughness]), width, FLOOR) == pytest.approx(1.0 / mean**2, rel=0.08)
