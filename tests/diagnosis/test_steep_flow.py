"""Supercritical flow is named before hours are spent on it."""

from pathlib import Path

import pytest
from reach import write_reach

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.diagnosis.steep_flow import even_froude, floor_slope, remarks_on_steep_flow

STEEP = ("bed_slope: 0.001", "bed_slope: 0.05")


def remarks(folder: Path, *changes: tuple[str, str]) -> list[str]:
    case = load_case(write_reach(folder, *changes))
    return list(remarks_on_steep_flow(case, build_site(case)))


def test_a_steep_channel_is_called_supercritical(tmp_path: Path) -> None:
    (said,) = remarks(tmp_path, STEEP)
    assert said.startswith(
        "Experiment June is supercritical: on the slope of the floor, 0.05, water without plants runs at"
    )


@pytest.mark.parametrize("changes", [[], [("bed_slope: 0.001", "bed_slope: -0.05")]])
def test_a_gentle_or_rising_channel_is_not(tmp_path: Path, changes: list[tuple[str, str]]) -> None:
    assert remarks(tmp_path, *changes) == []


@pytest.mark.parametrize(
    ("law", "chezy"),
    [
        ("{law: chezy, c: 30}", 30.0),
        ("{law: manning, n: 0.05}", (2.0 / 3 * 0.05 / 0.05**0.5) ** (3 / 5 / 6) / 0.05),
    ],
)
def test_the_froude_number_is_that_of_even_flow(tmp_path: Path, law: str, chezy: float) -> None:
    """A floor 3 m wide, 2 m3/s: h = (n q / S^(1/2))^(3/5) for Manning's law."""
    priors = ("  n_b: {distribution: uniform, low: 0.02, high: 0.10, unit: s m^(-1/3)}\n", "")
    case = load_case(write_reach(tmp_path, STEEP, ("{law: manning, n: n_b}", law), priors))
    site = build_site(case)
    assert floor_slope(site) == pytest.approx(0.05)
    found = even_froude(case, site, case.experiments["June"], 0.05)
    assert found == pytest.approx(chezy * (0.05 / 9.81) ** 0.5, rel=0.02)
