"""The limits that docs/limits.md states are those in force."""

from reach import ROOT

from vegglue.case import size_limits
from vegglue.case.size_limits import factor_bytes

STATED = (
    "LARGEST_CONFIG", "LARGEST_DATA", "DEEPEST_KEYS", "MOST_PARTS", "LONGEST_CHAIN", "MOST_CELLS", "MOST_MEMBERS",
    "MOST_PREDICTIONS", "MOST_STATIONS",
)  # fmt: skip


def test_every_limit_is_stated() -> None:
    page = (ROOT / "docs" / "limits.md").read_text(encoding="utf-8")
    table = page[page.index("## Sizes") : page.index("## Against")]
    for name in STATED:
        assert f" {getattr(size_limits, name):,} " in table.replace(", ", " , "), name
    assert f"{size_limits.LARGEST_FACTORS / 1e9:g} GB" in table


def test_factors_take_three_blocks_a_column() -> None:
    nx, ny = 1142, 40  # the grid of the paper's case
    assert factor_bytes(nx, ny) == 108 * nx * ny**2 == nx * 3 * (3 * ny) ** 2 * 4
