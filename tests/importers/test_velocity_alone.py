"""V alone is the velocity; beside another component, or by a name that says so, it is that across."""

from pathlib import Path

import pytest

import vegglue
from vegglue.measurements.observations import read_observations

SITE = """channel: {length_m: 30, bottom_width_m: 3, bank_slope_v_per_h: 0.5, bed_slope: 0.001}
experiments: {June: {discharge: 2000 l/s, level: 95 cm}}
"""


@pytest.mark.parametrize(
    ("heading", "kinds"),
    [
        ("V,SE", {"velocity"}),
        ("v [m/s],SE", {"velocity"}),
        ("u,v", {"velocity", "velocity_across"}),
        ("transverse velocity,SE", {"velocity_across"}),
    ],
)
def test_a_column_v_is_the_velocity_where_it_is_alone(tmp_path: Path, heading: str, kinds: set[str]) -> None:
    folder = tmp_path / "brook"
    folder.mkdir()
    (folder / "site.yaml").write_text(SITE, encoding="utf-8")
    rows = "".join(f"A,10,{y},0.4,0.01\n" for y in (-1, 0, 1))
    (folder / "adv.csv").write_text(f"section,x,y,{heading}\n{rows}", encoding="utf-8")
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    assert set(read_observations(case).table["kind"]) == kinds
