"""How much of each cell a patch covers, wherever its sides lie between those of cells."""

from pathlib import Path

import numpy as np
import pytest
from sound_case import ROWS, SOUND

from vegglue.case.channel_geometry import channel_geometry
from vegglue.case.config import load_case
from vegglue.case.gridded_site import Site, build_site
from vegglue.case.schema import Case
from vegglue.case.zones import corners_of, share_in_patch, signed_area
from vegglue.diagnosis.channel_check import PatchHidden, remarks_on_patches
from vegglue.flow.closures import drag
from vegglue.flow.problem_setup import build_problem

# Cells of `SOUND`: 1.0 x 0.5 m.
CELL = 0.5
PATCH = "x: [10, 14], y: [0, 1.5]"


def case_with(folder: Path, *patches: str) -> tuple[Case, Site]:
    """The sound case with these patches in place of its own."""
    (folder / "velocities.csv").write_text(ROWS)
    planted = "\n".join(
        f"    - {{name: p{k}, stand: reed, {where}, stems: {22 * k}}}" for k, where in enumerate(patches, 1)
    )
    own = f"    - {{name: p1, stand: reed, {PATCH}, stems: 22}}"
    assert own in SOUND
    (folder / "sound.yaml").write_text(SOUND.replace(own, planted))
    case = load_case(folder / "sound.yaml")
    return case, build_site(case)


def test_a_patch_between_cells_covers_them_whole(tmp_path: Path) -> None:
    _, site = case_with(tmp_path, PATCH)
    assert set(np.unique(site.cover)) == {0.0, 1.0}
    assert site.cover.sum() * CELL == 4 * 1.5
    assert np.array_equal(site.main_patch, site.patch)


def test_a_patch_across_cells_covers_parts_of_them(tmp_path: Path) -> None:
    _, site = case_with(tmp_path, "x: [10.25, 14], y: [0.2, 1.3]")
    assert site.cover.sum() * CELL == pytest.approx(3.75 * 1.1, abs=1e-5)
    column, row = np.searchsorted(site.grid.x, 10.5), np.searchsorted(site.grid.y, 0.25)
    assert site.cover[column, row : row + 3] == pytest.approx([0.75 * 0.6, 0.75, 0.75 * 0.6])
    assert site.patch[column, row] == 0
    assert site.main_patch[column, row] == -1  # less than half of it


@pytest.mark.parametrize(
    "corners",
    [
        [[10, 0], [14, 0], [14, 1.5], [10, 1.5]],
        [[10.2, 0.1], [15.3, 0.4], [13.1, 3.2]],
        [[8, -3], [16, -3], [16, 3], [12, -1], [8, 3]],  # with a notch
    ],
)
def test_a_polygon_covers_its_area(tmp_path: Path, corners: list[list[float]]) -> None:
    case, site = case_with(tmp_path, f"polygon: {corners}")
    meant = abs(signed_area(corners_of(case, case.plants.patches[0])))
    assert site.cover.sum() * CELL == pytest.approx(meant, rel=0.01)
    assert site.cover.min() >= 0.0
    assert site.cover.max() <= 1.0


@pytest.mark.parametrize(
    "corners", [[[60, 0], [61, 0], [61, 1]], [[10, 20], [12, 20], [12, 21]], [[10, 0], [12, 0], [14, 0]]]
)
def test_a_polygon_beyond_the_grid_or_without_area_covers_nothing(tmp_path: Path, corners: list[list[float]]) -> None:
    _, site = case_with(tmp_path, f"polygon: {corners}")
    assert not site.cover.any()
    assert (site.patch == -1).all()


def test_a_polygon_is_the_range_that_it_draws(tmp_path: Path) -> None:
    sides = "x: [10.3, 14.1], y: [0.125, 1.375]"
    corners = "polygon: [[10.3, 0.125], [14.1, 0.125], [14.1, 1.375], [10.3, 1.375]]"
    (_, ranged), (_, drawn) = case_with(tmp_path, sides), case_with(tmp_path, corners)
    assert drawn.cover == pytest.approx(ranged.cover, abs=1e-5)


def test_patches_side_by_side_share_a_cell(tmp_path: Path) -> None:
    """The one that covers more of it gives it its stems."""
    _, site = case_with(tmp_path, "x: [10, 14], y: [0, 0.7]", "x: [10, 14], y: [0.7, 1.5]")
    assert site.cover.sum() * CELL == pytest.approx(4 * 1.5)
    row = int(np.searchsorted(site.grid.y, 0.75))
    assert site.cover[10, row] == 1.0
    assert site.patch[10, row] == 1


def test_patches_that_meet_within_cells_lose_none_to_each_other(tmp_path: Path) -> None:
    """Half of a row each: no cell is hidden by the later one."""
    case, site = case_with(tmp_path, "x: [10, 14], y: [0, 0.75]", "x: [10, 14], y: [0.75, 1.5]")
    assert not [one for one in remarks_on_patches(case, site) if isinstance(one, PatchHidden)]


def test_a_later_patch_wins_where_it_lies_over_another(tmp_path: Path) -> None:
    _, site = case_with(tmp_path, PATCH, "x: [12, 13], y: [0, 1.5]")
    assert [int((site.patch == index).sum()) for index in (0, 1)] == [9, 3]


def test_a_range_beyond_the_grid_ends_with_it(tmp_path: Path) -> None:
    case, site = case_with(tmp_path, "x: [30, 60], y: [-9, 9]")
    share = share_in_patch(case, case.plants.patches[0], site.grid)
    assert share[30:].min() == 1.0
    assert share[:30].max() == 0.0


def test_friction_of_a_cell_is_that_of_both_its_parts(tmp_path: Path) -> None:
    """s k_p + (1 - s) k: half planted, half way between bare and planted."""
    theta = {"n_b": np.array([0.05]), "phi": np.array([3.0])}
    depth = np.full((40, 20, 1), 0.9)
    rates = []
    for top in (1.0, 1.25, 1.5):
        case, site = case_with(tmp_path, f"x: [10, 14], y: [0, {top}]")
        rates.append(drag(build_problem(case, site, "low", theta), depth)[11, 12, 0])
    assert rates[0] < rates[2]
    assert rates[1] == pytest.approx(0.5 * (rates[0] + rates[2]), rel=1e-12)


def test_effects_see_the_sides_where_they_are(tmp_path: Path) -> None:
    case, site = case_with(tmp_path, "x: [10.25, 13.75], y: [0.1, 1.4]")
    geometry = channel_geometry(case, site, "low")
    row = int(np.searchsorted(site.grid.y, 0.75))
    assert geometry.front[10:14, row, 0] == pytest.approx([0.25, 1.25, 2.25, 3.25])
    assert geometry.edge[11, row - 1 : row + 2, 0] == pytest.approx([-0.15, -0.65, -0.15])
    assert geometry.wake[14, row, 0] == pytest.approx(0.75)
    assert geometry.planted[11, row - 1 : row + 2, 0] == pytest.approx([0.8, 1.0, 0.8])
