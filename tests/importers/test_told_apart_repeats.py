"""Values of one place that a column tells apart, alike everywhere, are no repeats; what differs by chance is."""

from pathlib import Path

import numpy as np
import pytest
from field_folders import CHANNEL, JUNE, folder_of

import vegglue
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations

PLACES = [(x, y) for x in (6, 12, 18, 24) for y in (-1.0, 0.0, 1.0)]
SCATTER = np.random.default_rng(5).normal(0.0, 0.01, (len(PLACES), 3))


def survey(heading: str, factors: dict[str, float], places: str = "x;y", z: str = "") -> str:
    """One velocity for each name at each place: 0.4 m/s times the factor of the name, and chance."""
    rows = [
        ";".join(map(str, (x, y, *z.split(), name, f"{0.4 * factor + SCATTER[row, column]:.3f}")))
        for row, (x, y) in enumerate(PLACES)
        for column, (name, factor) in enumerate(factors.items())
    ]
    return "\n".join([f"{places};{heading};u", *rows])


@pytest.mark.parametrize(
    ("heading", "factors"),
    [
        ("reach", {"A": 1.0, "B": 0.5}),
        ("date", {"3/6/2024": 1.0, "9/7/2024": 1.3}),
        ("Syvyys", {"0.1": 1.2, "0.3": 1.0, "0.6": 0.7}),
        ("position", {"20 %": 1.15, "80 %": 0.85}),
        ("Q", {"1.8": 1.0, "2.4": 1.2}),
    ],
)
def test_two_surveys_at_the_same_places_are_no_repeats(tmp_path: Path, heading: str, factors: dict[str, float]) -> None:
    """Two reaches, two discharges, or the heights of a vertical were averaged, and it stood in one line of many."""
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=survey(heading, factors))
    with pytest.raises(InputError, match=rf"differ with '{heading}' \({next(iter(factors))}.*; name it in `columns`"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


def test_points_of_two_verticals_at_one_place_are_no_repeats(tmp_path: Path) -> None:
    upper, lower = (survey("reach", {"A": 1.0, "B": 0.5}, "x;y;z", z).split("\n") for z in ("0.2", "0.6"))
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv="\n".join([*upper, *lower[1:]]))
    with pytest.raises(InputError, match=r"differ with 'reach' \(A and B\)"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


@pytest.mark.parametrize("factors", [{"1": 1.0, "2": 1.0, "3": 1.0}, {"Ann": 1.01, "Bob": 0.99}])
def test_repeats_of_one_flow_are_averaged(tmp_path: Path, factors: dict[str, float]) -> None:
    """Two persons read 2 % apart, always the same way."""
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=survey("by", factors))
    found = read_observations(vegglue.import_folder(folder, tmp_path / "brook.yaml")).table
    assert len(found) == len(PLACES)
    assert found["value"].to_numpy() == pytest.approx(np.full(len(PLACES), 0.4), abs=0.03)
