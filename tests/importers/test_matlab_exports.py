"""MATLAB files of RiverSurveyor Live, QRev and MIDAS: known by their variables, read into stations, else refused."""

from pathlib import Path

import numpy as np
import pytest
from matlab_files import profiler_mat, qrev_mat, riversurveyor_mat
from scipy.io import savemat

import vegglue
from vegglue.errors import InputError
from vegglue.importers.file_options import FileOptions
from vegglue.importers.instruments import read_matlab, reader_of
from vegglue.measurements.observations import read_observations

START = FileOptions(start=(100.0, 200.0))
MEANS = np.linspace(0.30, 0.24, 31)  # slower towards the bed


@pytest.mark.parametrize("unit", ["m", "ft"])
def test_a_transect_of_a_riversurveyor_becomes_stations(tmp_path: Path, unit: str) -> None:
    path = tmp_path / "t.mat"
    riversurveyor_mat(path, unit)
    assert reader_of(path) is read_matlab
    taken = read_matlab(path, START)
    assert "RiverSurveyor MATLAB export, 36 ensembles" in taken.notes[0]
    assert taken.numbers["east_velocity"] == pytest.approx(0.64, abs=0.03)
    assert taken.numbers["north_velocity"] == pytest.approx(-0.48, abs=0.03)
    assert np.allclose(taken.numbers["x"] - 100.0, 0.75 * (taken.numbers["y"] - 200.0), atol=1e-6)


def test_transects_there_and_back_lie_on_one_another(tmp_path: Path) -> None:
    path = tmp_path / "mill_QRev.mat"
    qrev_mat(path)
    assert reader_of(path) is read_matlab
    taken = read_matlab(path, START)
    assert taken.notes[0] == "QRev, 2 transects, 118 ensembles, 2 without velocities left out"
    assert taken.size == 15
    assert taken.numbers["x"].min() == pytest.approx(100.0, abs=0.2)
    assert taken.numbers["x"].max() == pytest.approx(100.0 + 59 * 0.06, abs=0.2)
    assert np.allclose(taken.numbers["y"] - 200.0, (taken.numbers["x"] - 100.0) / 0.75, atol=1e-6)
    assert taken.numbers["east_velocity"] == pytest.approx(0.64, abs=0.02)  # without the cells that were filled up
    assert taken.numbers["north_velocity"] == pytest.approx(-0.48, abs=0.02)
    with pytest.raises(InputError, match=r"^\S+ expected where the boat started"):
        read_matlab(path, FileOptions())


def test_one_transect_of_qrev_is_enough(tmp_path: Path) -> None:
    path = tmp_path / "mill_QRev.mat"
    qrev_mat(path, transects=1)
    assert read_matlab(path, START).notes[0].startswith("QRev, 1 transect, 59 ensembles")


@pytest.mark.parametrize("beams", [False, True])
def test_a_profile_is_the_mean_of_each_cell_that_is_strong(tmp_path: Path, beams: bool) -> None:
    path = tmp_path / "p.mat"
    profiler_mat(path, MEANS, beams)
    taken = read_matlab(path, FileOptions(position=(2.0, 0.3, 0.15)))
    assert taken.size == 30
    assert "Vectrino Profiler, 400 samples at 50 Hz, 30 of 31 cells" in taken.notes
    assert taken.numbers["z"] == pytest.approx(0.15 - 0.04 - 0.001 * np.arange(30))
    assert taken.numbers["u"] == pytest.approx(MEANS[:30], abs=0.005)
    assert taken.numbers["v"] == pytest.approx(0.0, abs=0.005)
    assert taken.numbers["u_std"] == pytest.approx(0.02, rel=0.2)
    assert taken.numbers["duration_s"] == pytest.approx(np.where(np.arange(30) == 3, 359, 360) / 50)
    with pytest.raises(InputError, match="expected where the probe stood"):
        read_matlab(path, FileOptions())


def test_cells_at_the_bed_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / "p.mat"
    profiler_mat(path, MEANS, bed=0.0602)
    taken = read_matlab(path, FileOptions(position=(2.0, 0.3, 0.0602)))
    assert taken.numbers["z"].min() == pytest.approx(0.0012)


def test_profiles_one_above_the_other_become_a_vertical(tmp_path: Path) -> None:
    folder = tmp_path / "flume"
    folder.mkdir()
    for number, speed in enumerate((0.24, 0.30)):
        profiler_mat(folder / f"p{number}.mat", np.full(31, speed))
    files = [f"p{n}.mat: {{position: [2, 0.1, {0.08 + 0.04 * n}], section: A}}" for n in (0, 1)]
    (folder / "site.yaml").write_text(
        "channel: {length_m: 4, bottom_width_m: 0.8, bed_slope: 0.001}\nwalls: {n: 0.01}\n"
        f"experiments: {{run: {{discharge: 20 l/s, level: 0.13}}}}\nfiles: {{{', '.join(files)}}}\n",
        encoding="utf-8",
    )
    table = read_observations(vegglue.import_folder(folder, tmp_path / "flume.yaml")).table
    assert table["kind"].tolist() == ["velocity", "velocity_across"]
    assert 0.24 < table["value"].iloc[0] < 0.30
    assert table["value"].iloc[1] == pytest.approx(0.0, abs=0.005)


def refusal(path: Path, words: FileOptions = START) -> str:
    with pytest.raises(InputError) as caught:
        reader_of(path)(path, words)
    assert len(str(caught.value).splitlines()) == 1
    assert str(caught.value).count("expected") <= 1, "a refusal within a refusal"
    return str(caught.value)


def test_another_mat_file_is_refused_in_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "t.mat"
    riversurveyor_mat(path, "m", coordinateSystem=0)
    assert "expected velocities in ENU coordinates" in refusal(path)
    qrev_mat(path, coordSys="Ship")
    assert "expected velocities in earth coordinates, got them in Ship" in refusal(path)
    qrev_mat(path, validData=np.ones(3))
    assert "expected the transects of a measurement saved by QRev" in refusal(path)
    profiler_mat(path, MEANS, sampleRate="fast")
    assert "expected the structures of a Vectrino Profiler" in refusal(path, FileOptions(position=(0.0, 0.0, 0.1)))
    savemat(path, {"meas_struct": {"a": 1.0}})
    assert "expected the transects of a measurement saved by QRev" in refusal(path)
    savemat(path, {name: {"a": 1.0} for name in ("Setup", "Summary", "System", "WaterTrack")})
    assert "expected the structures of a MATLAB export of RiverSurveyor Live" in refusal(path)
    savemat(path, {"depths": 1.0})
    assert "QRev or MIDAS (Vectrino Profiler), got one with depths; export a table" in refusal(path)
    for content in (b"MATLAB 5.0 MAT-file" + bytes(200), b"MATLAB 7.3 MAT-file, HDF5" + bytes(600)):
        path.write_bytes(content)
        assert "t.mat" in refusal(path)
