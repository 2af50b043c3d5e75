"""Exports of instruments become stations: right places, right units, and errors that follow from the data."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from instrument_files import VECTRINO_HEADING, flowtracker, riversurveyor, vectrino, winriver
from untrusted_imports import IMPORTS

import vegglue
from vegglue.case.frame import Frame
from vegglue.errors import InputError
from vegglue.importers import instruments
from vegglue.importers.file_options import FileOptions
from vegglue.importers.gaugings import read_gauging
from vegglue.importers.instruments import reader_of
from vegglue.importers.nortek import read_nortek, read_vector
from vegglue.importers.teledyne import read_pd0, read_winriver
from vegglue.measurements.observations import read_observations

PLACES, DEPTHS, VELOCITIES = [0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 0.5, 0.8, 0.6, 0.0], [0.0, 0.3, 0.5, 0.4, 0.0]
# A tape that begins on the left bank, at y = 2 m, and runs to the right.
ACROSS = ((12.0, 2.0), (12.0, -2.0))
SITE = """\
channel: {length_m: 30, bottom_width_m: 3, bank_slope_v_per_h: 0.5, bed_slope: 0.001}
experiments: {June: {discharge: 2.0, level: 0.95}}
"""


def test_every_reader_has_a_file_that_is_damaged(tmp_path: Path) -> None:
    """But those that hand raw records to mhkit, which may not be there."""
    damaged = set()
    for name, content, _ in IMPORTS:
        (tmp_path / name).write_bytes(content)
        (tmp_path / name).with_suffix(".hdr").write_text(VECTRINO_HEADING, encoding="utf-8")
        damaged.add(reader_of(tmp_path / name))
    known = {one for name, one in vars(instruments).items() if name.startswith("read_")}
    assert known - damaged == {read_pd0, read_vector}


@pytest.mark.parametrize("export", [flowtracker, riversurveyor])
def test_verticals_along_a_tape_stand_where_it_lay(tmp_path: Path, export) -> None:
    path = tmp_path / "gauging.dis"
    path.write_text(export(PLACES, DEPTHS, VELOCITIES), encoding="utf-8")
    words = FileOptions(line=ACROSS)
    assert reader_of(path) is read_gauging
    taken = read_gauging(path, words)
    assert np.allclose(taken.numbers["x"], 12.0)
    assert np.allclose(taken.numbers["y"], [1.0, 0.0, -1.0], atol=0.01)
    assert np.allclose(taken.numbers["u"], [0.3, 0.5, 0.4], atol=0.001)
    assert (taken.numbers["u_se"] > 0.05 * 0.3).all()
    with pytest.raises(InputError, match="expected where the tape lay"):
        read_gauging(path, FileOptions())


def test_a_gauging_becomes_a_case(tmp_path: Path) -> None:
    folder = tmp_path / "brook"
    folder.mkdir()
    (folder / "june.dis").write_text(flowtracker(PLACES, DEPTHS, VELOCITIES), encoding="utf-8")
    (folder / "site.yaml").write_text(SITE + "files: {june.dis: {line: [[12, 2], [12, -2]], section: A}}\n", "utf-8")
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    table = read_observations(case).table
    assert table["section"].tolist() == ["A"] * 3
    assert np.allclose(table["value"], [0.3, 0.5, 0.4], atol=0.001)
    assert case.imported is not None
    assert case.imported[0].units["u"] == "ft/s"
    assert "FlowTracker" in case.imported[0].taken


def test_a_transect_is_averaged_over_the_depth_and_along_the_section(tmp_path: Path) -> None:
    along = np.linspace(0.0, 10.0, 150)
    text = winriver(0.6 * along, 0.8 * along, 2.0, (0.64, -0.48), 0.05)
    (tmp_path / "transect_ASC.TXT").write_text(text, encoding="utf-8")
    assert reader_of(tmp_path / "transect_ASC.TXT") is read_winriver
    taken = read_winriver(tmp_path / "transect_ASC.TXT", FileOptions(start=(100.0, 200.0)))
    assert taken.size == 15
    assert np.allclose(taken.numbers["x"] - 100.0, 0.75 * (taken.numbers["y"] - 200.0), atol=0.02)
    assert taken.numbers["east_velocity"] == pytest.approx(0.64, abs=0.03)
    assert taken.numbers["north_velocity"] == pytest.approx(-0.48, abs=0.03)
    # Ten ensembles a station, some 15 cells each, of 0.05 m/s of noise.
    assert np.median(taken.numbers["u_se"]) == pytest.approx(0.05 / 150**0.5, rel=0.5)


def test_a_transect_is_turned_into_the_channel(tmp_path: Path) -> None:
    """Water that heads to the south-east, in a channel that does: all of it along, with its errors."""
    folder = tmp_path / "bend"
    folder.mkdir()
    frame = Frame(origin=(100.0, 200.0), angle=-36.8698976458)
    start = frame.to_map(12.0, -4.0)
    along = np.linspace(0.0, 8.0, 120)
    (folder / "t_ASC.TXT").write_text(winriver(0.6 * along, 0.8 * along, 2.0, (0.64, -0.48), 0.05), encoding="utf-8")
    (folder / "site.yaml").write_text(
        SITE + f"frame: {{origin: [100, 200], angle: {frame.angle}}}\n"
        f"files: {{t_ASC.TXT: {{start: [{start[0]}, {start[1]}], section: A}}}}\n",
        encoding="utf-8",
    )
    table = read_observations(vegglue.import_folder(folder, tmp_path / "bend.yaml")).table
    parts = {kind: table[table["kind"] == kind] for kind in ("velocity", "velocity_across")}
    assert np.allclose(parts["velocity"]["value"], 0.8, atol=0.03)
    assert np.allclose(parts["velocity_across"]["value"], 0.0, atol=0.03)
    assert np.allclose(table["x"], 12.0, atol=0.01)
    assert table["y"].between(-4.0, 4.0).all()
    assert (table["standard_error"] > 0.0).all()


def test_records_of_one_point_become_a_vertical(tmp_path: Path) -> None:
    folder = tmp_path / "flume"
    folder.mkdir()
    entries = []
    for number, (z, u) in enumerate([(0.1, 0.30), (0.3, 0.38), (0.6, 0.44)]):
        (folder / f"p{number}.dat").write_text(vectrino((u, 0.02, 0.0), 0.03, 1000, bad=20), encoding="utf-8")
        (folder / f"p{number}.hdr").write_text(VECTRINO_HEADING, encoding="utf-8")
        entries.append(f"p{number}.dat: {{position: [12, 0.5, {z}], section: A}}")
    (folder / "site.yaml").write_text(f"{SITE}files: {{{', '.join(entries)}}}\n", encoding="utf-8")
    case = vegglue.import_folder(folder, tmp_path / "flume.yaml")
    observations = read_observations(case)
    assert observations.points["u"].tolist() == pytest.approx([0.30, 0.38, 0.44], abs=0.005)
    assert observations.points["u_std"].tolist() == pytest.approx([0.03] * 3, rel=0.1)
    assert observations.table["kind"].tolist() == ["velocity", "velocity_across"]
    assert 0.3 < observations.table["value"].iloc[0] < 0.5
    assert observations.table["value"].iloc[1] == pytest.approx(0.02, abs=0.005)
    assert case.imported is not None
    assert "1,000 samples at 25 Hz, 20 left out" in case.imported[0].taken


def test_records_of_one_vertical_keep_errors_of_their_own(tmp_path: Path) -> None:
    """All had that of the first."""
    folder = tmp_path / "flume"
    folder.mkdir()
    entries = []
    for number, error in enumerate((", standard_error: 1 cm/s", "", ", standard_error: 4 cm/s")):
        (folder / f"p{number}.dat").write_text(vectrino((0.3, 0.02, 0.0), 0.03, 400, bad=0), encoding="utf-8")
        (folder / f"p{number}.hdr").write_text(VECTRINO_HEADING, encoding="utf-8")
        entries.append(f"p{number}.dat: {{position: [12, 0.5, {0.1 + 0.2 * number:.1f}], section: A{error}}}")
    (folder / "site.yaml").write_text(f"{SITE}files: {{{', '.join(entries)}}}\n", encoding="utf-8")
    case = vegglue.import_folder(folder, tmp_path / "flume.yaml")
    assert pd.read_csv(case.observations[0].file)["u_se"].tolist() == [0.01, 0.0, 0.04]


@pytest.mark.parametrize(
    ("axes", "said", "velocity"),
    [
        ("XYZ", "", (0.4, 0.05)),
        ("", "", (0.4, 0.05)),
        ("XYZ", ", directions: map", (0.05, -0.4)),
        ("ENU", "", (0.05, -0.4)),
    ],
)
def test_the_axes_of_a_probe_are_not_those_of_the_map(
    tmp_path: Path, axes: str, said: str, velocity: tuple[float, float]
) -> None:
    """0.4 m/s along a channel that runs north were 0.4 m/s across it."""
    folder = tmp_path / "flume"
    folder.mkdir()
    (folder / "p.dat").write_text(vectrino((0.4, 0.05, 0.0), 0.01, 400, bad=0), encoding="utf-8")
    of_axes = f"Coordinate system                     {axes}\n" if axes else ""
    (folder / "p.hdr").write_text(VECTRINO_HEADING + of_axes, encoding="utf-8")
    more = f"frame: {{origin: [1000, 2000], angle: 90}}\nfiles: {{p.dat: {{position: [1000, 2010, 0.3]{said}}}}}\n"
    (folder / "site.yaml").write_text(SITE + more, encoding="utf-8")
    case = vegglue.import_folder(folder, tmp_path / "flume.yaml")
    found = [pd.read_csv(one.file)[column].item() for one, column in zip(case.observations, "uv", strict=True)]
    assert found == pytest.approx(velocity, abs=0.003)


def test_a_record_in_beams_is_refused(tmp_path: Path) -> None:
    (tmp_path / "p.dat").write_text(vectrino((0.4, 0.0, 0.0), 0.01, 100, bad=0), encoding="utf-8")
    (tmp_path / "p.hdr").write_text(f"{VECTRINO_HEADING}Coordinate system    BEAM\n", encoding="utf-8")
    with pytest.raises(InputError, match="expected velocities in XYZ or ENU, got BEAM; export them anew"):
        read_nortek(tmp_path / "p.dat", FileOptions(position=(1.0, 0.0, 0.2)))


def test_a_record_without_its_rate_or_place_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "p.dat"
    path.write_text(vectrino((0.3, 0.0, 0.0), 0.03, 100, bad=0), encoding="utf-8")
    with pytest.raises(InputError, match="expected where the probe stood"):
        read_nortek(path, FileOptions())
    with pytest.raises(InputError, match=r"expected `Sampling rate` in the \.hdr"):
        read_nortek(path, FileOptions(position=(1.0, 0.0, 0.2)))
