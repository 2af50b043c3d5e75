"""What a config may say goes with the laws there are, and its limits are those that docs/limits.md states."""

from typing import get_args

import pytest
from reach import ROOT

from vegglue.case import size_limits
from vegglue.case.schema import Case
from vegglue.case.site_schema import COEFFICIENT_OF, FrictionClass, VegetationType
from vegglue.case.size_limits import factor_bytes
from vegglue.effects.bed_laws import BED_LAWS
from vegglue.effects.plant_laws import PLANT_LAWS
from vegglue.flow.nested_dissection import dissection

STATED = (
    "LARGEST_CONFIG", "LARGEST_DATA", "DEEPEST_KEYS", "MOST_PARTS", "LONGEST_CHAIN", "MOST_CELLS", "MOST_MEMBERS",
    "MOST_PREDICTIONS", "MOST_STATIONS",
)  # fmt: skip


def test_every_limit_is_stated() -> None:
    page = (ROOT / "docs" / "limits.md").read_text(encoding="utf-8")
    table = page[page.index("## Sizes") : page.index("## Against")]
    for name in STATED:
        assert f" {getattr(size_limits, name):,} " in table.replace(", ", " , "), name


def test_factors_take_three_blocks_a_column() -> None:
    nx, ny = 1142, 40  # the grid of the paper's case
    assert factor_bytes(nx, ny) == 108 * nx * ny**2 == nx * 3 * (3 * ny) ** 2 * 4


@pytest.mark.parametrize(("nx", "ny"), [(90, 56), (180, 75), (120, 120)])
def test_sparse_factors_take_what_is_said(nx: int, ny: int) -> None:
    parts = dissection(nx, ny)
    held = 4.0 * parts.memory_start[:, -1].sum()
    assert 0.8 < held / factor_bytes(nx, ny) < 1.05


def test_help_of_a_case_has_its_keys_with_their_units() -> None:
    assert "Attributes\n----------\nsource\n    file the case was read from\nname\n" in str(Case.__doc__)
    assert "eddy_viscosity\n    [m2/s]\n" in str(Case.__doc__)
    assert str(FrictionClass.__doc__).startswith("C of a bed [m^1/2/s]: h^(1/6) / n")


def test_a_config_knows_the_laws_there_are() -> None:
    assert get_args(FrictionClass.model_fields["law"].annotation) == BED_LAWS == tuple(COEFFICIENT_OF)
    assert get_args(VegetationType.model_fields["law"].annotation) == PLANT_LAWS


def test_each_law_of_the_bed_has_a_coefficient_of_its_own() -> None:
    for law, key in COEFFICIENT_OF.items():
        assert FrictionClass.model_validate({"law": law, key: 0.5}).coefficient == 0.5
