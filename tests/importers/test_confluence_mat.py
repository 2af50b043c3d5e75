"""The confluence set in the author's MATLAB files: the tables made of them hold what the files do."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

import vegglue
from vegglue.errors import InputError
from vegglue.importers.confluence import mat_folder, tables_of_mat
from vegglue.measurements.observations import read_observations
from vegglue.workflow.import_folder import assumptions_of

# Where whoever develops it keeps the set, which is not part of the project.
PUBLISHED = Path(__file__).parents[3] / "shared" / "real" / "confluence"
WIDTH, DEPTH, SPEED = 0.6, 0.2, 0.4


def shipped_set(folder: Path) -> Path:
    """Three sections of a flat flume as the author lays them out, velocities linear from the bed to the surface."""
    inside = folder / "data_3d_velocity_topography_surface_maps"
    inside.mkdir(parents=True)
    x, y = np.meshgrid(np.arange(-1.5, 2.0, 0.01), np.arange(0.02, WIDTH + 0.01, 0.02))
    flat = {"topo": np.zeros_like(x), "wl": np.full_like(x, DEPTH)}
    savemat(inside / "topo_water_level_maps.mat", {
        f"{axis}{name}": part for name, z in flat.items() for axis, part in (("X", x), ("Y", y), ("Z", z))
    })  # fmt: skip
    for name, at in (("x_100", -1.0), ("x000", 0.0), ("x100", 1.0)):
        z, across = np.meshgrid([0.15, 0.1, 0.05, -0.01], np.arange(0.05, WIDTH, 0.1), indexing="ij")
        u = np.where(z > 0.0, SPEED * z / DEPTH, np.nan)
        section = {"X": np.full_like(z, at), "Y": across, "Z": z, "U": u, "V": np.full_like(u, np.nan)}
        savemat(inside / f"section_uvw_{name}.mat", section)
    return folder


def test_the_set_is_not_looked_for_all_over_a_disk(tmp_path: Path) -> None:
    shipped_set(tmp_path / "one" / "set")
    assert mat_folder(tmp_path / "one") is not None
    assert mat_folder(tmp_path) is None


def test_files_become_tables_of_verticals_and_maps(tmp_path: Path) -> None:
    source = mat_folder(shipped_set(tmp_path / "set"))
    assert source is not None
    table = pd.read_csv(tables_of_mat(source, tmp_path / "tables") / "depth_averaged.csv")
    assert len(table) == 3 * 6
    assert np.allclose(table["h_m"], DEPTH)
    # Linear to the highest point at three quarters of the depth, constant above it.
    assert np.allclose(table["U_depthavg_ms"], SPEED * 0.75 * (0.5 * 0.75 + 0.25))
    assert table["V_depthavg_ms"].isna().all()
    assert (table["bed_extrapolated"] == 0).all()


def test_the_set_becomes_a_case(tmp_path: Path) -> None:
    case = vegglue.import_folder(shipped_set(tmp_path / "set"), tmp_path / "made.yaml")
    table = read_observations(case).table
    assert sorted(table.loc[table["kind"] == "velocity", "x"].unique()) == [-1.0, 1.0]
    assert (tmp_path / "made-flat.yaml").is_file()
    assert "2 % and 0.01 m/s for velocities, 1 mm for levels" in assumptions_of(tmp_path / "set")[0]


def test_a_second_config_that_was_edited_keeps_the_first_from_being_written(tmp_path: Path) -> None:
    """The first config, its tables and the tables of the MATLAB files were there before the second was refused."""
    folder = shipped_set(tmp_path / "set")
    (tmp_path / "made-flat.yaml").write_text("name: of my own\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"made-flat\.yaml: is there, and was not made by vegglue"):
        vegglue.import_folder(folder, tmp_path / "made.yaml")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["made-flat.yaml", "set"]


def test_a_broken_file_is_a_sentence(tmp_path: Path) -> None:
    source = mat_folder(shipped_set(tmp_path / "set"))
    assert source is not None
    (source / "section_uvw_x000.mat").write_bytes(b"no such thing")
    with pytest.raises(InputError, match=r"section_uvw_x000\.mat cannot be read as a file of the set"):
        tables_of_mat(source, tmp_path / "tables")


@pytest.mark.skipif(not PUBLISHED.is_dir(), reason="no folder `shared/real/confluence` beside the repository")
def test_the_published_files_give_the_tables_made_of_them_by_another(tmp_path: Path) -> None:
    """Beds are read from the maps in two ways: depths differ by 2 mm at most."""
    source = mat_folder(PUBLISHED / "as_published")
    assert source is not None
    tables_of_mat(source, tmp_path)
    ours, theirs = (pd.read_csv(folder / "depth_averaged.csv") for folder in (tmp_path, PUBLISHED))
    both = ours.merge(theirs, on=["x_m", "y_m"], suffixes=("", "_theirs"))
    assert len(both) == len(ours) == len(theirs)
    for name, off in (("h_m", 0.002), ("U_depthavg_ms", 0.01), ("V_depthavg_ms", 0.01)):
        assert (both[name] - both[f"{name}_theirs"]).abs().max() < off
    assert (both["bed_extrapolated"] == both["bed_extrapolated_theirs"]).all()
