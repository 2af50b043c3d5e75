"""Raw files of instruments: read where a kept reader does, else refused with what to export instead."""

import json
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from instrument_files import pd0, vector, winriver
from reach import said_to

import vegglue
from vegglue.errors import InputError
from vegglue.importers.file_options import FileOptions
from vegglue.importers.gaugings import read_flowtracker2
from vegglue.importers.instruments import reader_of
from vegglue.importers.nortek import read_vector
from vegglue.importers.teledyne import read_pd0, read_winriver

ALONG = np.linspace(0.0, 15.0, 151)  # 0.06 m/s east and 0.08 m/s north, whole millimetres as the format has them
TRACK = (0.6 * ALONG, 0.8 * ALONG)
SITE = """\
channel: {length_m: 30, bottom_width_m: 3, bank_slope_v_per_h: 0.5, bed_slope: 0.001}
experiments: {June: {discharge: 2.0, level: 0.95}}
"""


def raw_file(folder: Path) -> Path:
    (folder / "t.PD0").write_bytes(pd0(*TRACK, 2.0, (0.64, -0.48), 0.05))
    return folder / "t.PD0"


def test_a_raw_transect_gives_the_stations_of_its_ascii_output(tmp_path: Path) -> None:
    pytest.importorskip("mhkit")
    path = raw_file(tmp_path)
    (tmp_path / "t_ASC.TXT").write_text(winriver(*TRACK, 2.0, (0.64, -0.48), 0.05), encoding="utf-8")
    assert reader_of(path) is read_pd0
    words = FileOptions(start=(100.0, 200.0))
    raw, text = read_pd0(path, words), read_winriver(tmp_path / "t_ASC.TXT", words)
    assert raw.size == text.size == 15
    for role in ("x", "y"):
        assert np.allclose(raw.numbers[role], text.numbers[role], atol=0.08)
    assert raw.numbers["east_velocity"] == pytest.approx(0.64, abs=0.02)
    assert raw.numbers["north_velocity"] == pytest.approx(-0.48, abs=0.02)
    assert np.median(raw.numbers["u_se"]) == pytest.approx(np.median(text.numbers["u_se"]), rel=0.5)
    assert "PD0 of a Rio Grande 0.2 m below the surface, 151 ensembles" in raw.notes[0]


def test_a_compass_is_turned_to_true_north(tmp_path: Path) -> None:
    pytest.importorskip("mhkit")
    path = raw_file(tmp_path)
    plain, turned = (read_pd0(path, FileOptions(start=(0.0, 0.0), declination=d)) for d in (0.0, 90.0))
    assert np.allclose(turned.numbers["east_velocity"], plain.numbers["north_velocity"], atol=1e-6)
    assert np.allclose(turned.numbers["north_velocity"], -plain.numbers["east_velocity"], atol=1e-6)
    assert np.allclose(turned.numbers["x"], plain.numbers["y"], atol=1e-6)
    assert "turned by a declination of 90 degrees" in turned.notes[0]


def test_a_damaged_raw_file_is_refused_in_one_sentence(tmp_path: Path) -> None:
    pytest.importorskip("mhkit")
    path = tmp_path / "t.PD0"
    for content in (b"\x7f\x7f", b"\x7f\x7f" + bytes(400), raw_file(tmp_path).read_bytes()[:500]):
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"t\.PD0") as caught:
            read_pd0(path, FileOptions(start=(0.0, 0.0)))
        assert len(str(caught.value).splitlines()) == 1


def test_a_binary_record_of_a_vector_is_its_mean_without_spikes(tmp_path: Path) -> None:
    pytest.importorskip("mhkit")
    path = tmp_path / "p.vec"
    path.write_bytes(vector((0.30, 0.02, 0.0), 0.03, 960, bad=20))
    assert reader_of(path) is read_vector
    taken = read_vector(path, FileOptions(position=(12.0, 0.5, 0.1)))
    assert taken.numbers["u"][0] == pytest.approx(0.30, abs=0.005)
    assert taken.numbers["v"][0] == pytest.approx(0.02, abs=0.005)
    assert taken.numbers["u_std"][0] == pytest.approx(0.03, rel=0.1)
    assert taken.numbers["duration_s"][0] == pytest.approx(940 / 32, rel=0.01)
    assert "samples at 32 Hz, 20 left out" in taken.notes[0]
    assert taken.texts["device"] == ["Vector"]
    with pytest.raises(InputError, match="expected where the probe stood"):
        read_vector(path, FileOptions())


def flowtracker2(path: Path, stations: object) -> None:
    with ZipFile(path, "w") as archive:
        archive.writestr("DataFile.json", json.dumps({"Properties": {}, "Stations": stations}))
        archive.writestr("PointMeasurements/1.json", "{}")


def station_of(location: float, depth: float | None, u: float | None) -> dict[str, object]:
    mean, error = ({"X": value, "Y": 0.0, "Z": 0.0} for value in (u, 0.006))
    found = {"Location": location, "Depth": depth, "VelocityMethod": "SixTenths"}
    return found | {
        "Calculations": None if u is None else {"MeanVelocityInVertical": mean, "VelocityStandardError": error}
    }


def test_a_gauging_of_a_flowtracker2_stands_where_the_tape_lay(tmp_path: Path) -> None:
    path = tmp_path / "gauging.ft"
    flowtracker2(path, [station_of(0.0, 0.0, None), station_of(1.0, 0.5, 0.3), station_of(2.0, 0.8, 0.5),
                        station_of(3.0, 0.6, float("nan")), station_of(4.0, None, None)])  # fmt: skip
    assert reader_of(path) is read_flowtracker2
    taken = read_flowtracker2(path, FileOptions(line=((12.0, 2.0), (12.0, -2.0))))
    assert taken.numbers["y"].tolist() == pytest.approx([1.0, 0.0])
    assert taken.numbers["u"].tolist() == [0.3, 0.5]
    assert (taken.numbers["u_se"] > 0.05 * 0.3).all()
    assert "FlowTracker2" in taken.notes
    with pytest.raises(InputError, match="expected where the tape lay"):
        read_flowtracker2(path, FileOptions())


def test_another_zip_is_refused_in_one_sentence(tmp_path: Path) -> None:
    path, words = tmp_path / "g.ft", FileOptions(line=((0.0, 2.0), (0.0, -2.0)))
    for stations in ([], {}, [1], [{}], [{"Location": "a"}]):
        flowtracker2(path, stations)
        with pytest.raises(InputError, match=r"g\.ft: expected") as caught:
            read_flowtracker2(path, words)
        assert len(str(caught.value).splitlines()) == 1
    with ZipFile(path, "w") as archive:
        archive.writestr("other.json", "{}")
    with pytest.raises(InputError, match=r"a ZIP with DataFile\.json"):
        read_flowtracker2(path, words)


def test_without_the_library_it_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "mhkit", None)
    (tmp_path / "p.vec").write_bytes(vector((0.3, 0.0, 0.0), 0.03, 64, bad=0))
    said = r"read by mhkit, which is not installed; run `pip install 'vegglue\[instruments\]'`"
    with pytest.raises(InputError, match=said):
        read_pd0(raw_file(tmp_path), FileOptions(start=(0.0, 0.0)))
    with pytest.raises(InputError, match=said):
        read_vector(tmp_path / "p.vec", FileOptions(position=(0.0, 0.0, 0.1)))


def test_a_raw_record_beside_its_export_is_left_alone(tmp_path: Path) -> None:
    folder = tmp_path / "brook"
    folder.mkdir()
    (folder / "site.yaml").write_text(
        f"{SITE}files: {{t_ASC.TXT: {{start: [10, -1], section: A}}}}\n", encoding="utf-8"
    )
    (folder / "t_ASC.TXT").write_text(winriver(*TRACK, 2.0, (0.64, -0.48), 0.05), encoding="utf-8")
    raw_file(folder)
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    assert case.imported is not None
    assert [one.name for one in case.imported] == ["t_ASC.TXT"]


def test_a_raw_record_beside_the_export_of_another_is_read(tmp_path: Path) -> None:
    """mill_1 was left out beside mill_10_ASC, whose name begins alike."""
    folder = tmp_path / "brook"
    folder.mkdir()
    words = "{start: [10, -1], section: A}"
    (folder / "site.yaml").write_text(f"{SITE}files: {{mill_10_ASC.TXT: {words}}}\n", encoding="utf-8")
    (folder / "mill_10_ASC.TXT").write_text(winriver(*TRACK, 2.0, (0.64, -0.48), 0.05), encoding="utf-8")
    (folder / "mill_1.vno").write_bytes(bytes(100))
    with pytest.raises(InputError, match=r"mill_1\.vno: expected an export as text"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


@pytest.mark.parametrize(
    ("name", "begins", "said"),
    [
        ("p.vec", b"\xa5\x05\x18\x00", "got a binary record of a Nortek instrument, which is not read"),
        ("p.dat", b"\xa5\x05\x18\x00", "convert it to ASCII in the maker's program"),
        ("p.ad2cp", b"\xa5\x0a\x0a\x10", "got a binary record of a Nortek instrument"),
        ("p.vno", b"??", "got a record .vno, which is not read"),
        ("p.ntk", b"??", "got a record .ntk, which is not read"),
    ],
)
def test_records_that_nobody_reads_say_what_to_export(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
    begins: bytes,
    said: str,
) -> None:
    folder = tmp_path / "flume"
    folder.mkdir()
    (folder / "site.yaml").write_text(SITE, encoding="utf-8")
    (folder / name).write_bytes(begins + bytes(100))
    code, error = said_to(monkeypatch, capsys, "import", folder, "--to", tmp_path / "flume.yaml")
    assert code == 2
    assert f"{name}: expected an export as text" in error
    assert said in error
    assert len(error.strip().splitlines()) == 1
