"""Files of instruments become stations: right places, right units, errors that follow from the data; or a refusal."""

import json
import sys
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pandas as pd
import pytest
from field_folders import CHANNEL, JUNE, folder_of, imported, refusal
from instrument_files import VECTRINO_HEADING, flowtracker, pd0, riversurveyor, vector, vectrino, winriver
from matlab_files import profiler_mat, qrev_mat, riversurveyor_mat
from result_files import GridFlow, write_flow_fm, write_velocimetry
from scipy.io import savemat
from untrusted_imports import IMPORTS

from vegglue.case.site_schema import Frame
from vegglue.errors import InputError
from vegglue.importers import instruments
from vegglue.importers.file_options import FileOptions
from vegglue.importers.gaugings import read_flowtracker2, read_gauging
from vegglue.importers.import_notes import ImportNote, Noted
from vegglue.importers.instruments import read_matlab, reader_of
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.nortek import read_nortek, read_vector
from vegglue.importers.qrev import read_qrev_summary
from vegglue.importers.teledyne import read_pd0, read_winriver
from vegglue.importers.velocimetry import read_velocimetry
from vegglue.measurements.observations import read_observations

PLACES, DEPTHS, VELOCITIES = [0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 0.5, 0.8, 0.6, 0.0], [0.0, 0.3, 0.5, 0.4, 0.0]
# A tape that begins on the left bank, at y = 2 m, and runs to the right.
TAPE = FileOptions(line=((12.0, 2.0), (12.0, -2.0)))
START, PROBE = FileOptions(start=(100.0, 200.0)), FileOptions(position=(12.0, 0.5, 0.1))
SITE = CHANNEL + "experiments: {June: {discharge: 2.0, level: 0.95}}\n"
ALONG = np.linspace(0.0, 15.0, 151)  # 0.06 m/s east and 0.08 m/s north, whole millimetres as PD0 has them
BOAT = ((0.6 * ALONG, 0.8 * ALONG), 2.0, (0.64, -0.48), 0.05)
MEANS = np.linspace(0.30, 0.24, 31)  # slower towards the bed
SUMMARY = """\
<?xml version="1.0" encoding="utf-8"?>
<?xml-stylesheet type= "text/xsl" href="QRevStylesheet.xsl"?>
<Channel QRevFilename="mill_QRev" QRevVersion="QRevPy 4.01">
 <Transect><Discharge><Total type="double" unitsCode="cms">9.9</Total></Discharge></Transect>
 <ChannelSummary>
  <Discharge><Top type="double" unitsCode="cms">0.2</Top><Total type="double" unitsCode="cms">2.040</Total></Discharge>
  <Uncertainty><COV type="double">4.4</COV><Total type="double">8.0</Total></Uncertainty>
 </ChannelSummary>
</Channel>
"""


def boat_text(**more: str) -> str:
    (track, *rest) = BOAT
    return winriver(*track, *rest, **more)


def raw_boat(folder: Path) -> Path:
    (track, *rest) = BOAT
    (folder / "t.PD0").write_bytes(pd0(*track, *rest))
    return folder / "t.PD0"


def written(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def refused(path: Path, options: FileOptions) -> str:
    """Why a file is refused: one line, which names it."""
    with pytest.raises(InputError) as caught:
        reader_of(path)(path, options)
    assert len(str(caught.value).splitlines()) == 1
    assert path.name in str(caught.value)
    assert str(caught.value).count("expected") <= 1, "a refusal within a refusal"
    return str(caught.value)


def test_every_reader_has_a_file_that_is_damaged(tmp_path: Path) -> None:
    """But those that hand raw records to mhkit, which may not be there."""
    damaged = set()
    for name, content, _ in IMPORTS:
        written(tmp_path / name, content)
        (tmp_path / name).with_suffix(".hdr").write_text(VECTRINO_HEADING, encoding="utf-8")
        damaged.add(reader_of(tmp_path / name))
    known = {one for name, one in vars(instruments).items() if name.startswith("read_")}
    assert known - damaged == {read_pd0, read_vector}


@pytest.mark.parametrize(
    ("name", "content", "key"),
    [
        ("g.dis", flowtracker(PLACES, DEPTHS, VELOCITIES), "line"), ("t_ASC.TXT", boat_text(), "start"),
        ("q.xml", SUMMARY, "start"), ("p.dat", vectrino((0.3, 0.0, 0.0), 0.03, 100, bad=0), "position"),
    ],
)  # fmt: skip
def test_a_file_without_a_place_asks_for_its_key(tmp_path: Path, name: str, content: str, key: str) -> None:
    (tmp_path / "p.hdr").write_text(VECTRINO_HEADING, encoding="utf-8")
    assert f"`{key}: [" in refused(written(tmp_path / name, content), FileOptions())


@pytest.mark.parametrize("export", [flowtracker, riversurveyor])
def test_verticals_along_a_tape_stand_where_it_lay(tmp_path: Path, export) -> None:
    path = written(tmp_path / "gauging.dis", export(PLACES, DEPTHS, VELOCITIES))
    assert reader_of(path) is read_gauging
    taken = read_gauging(path, TAPE)
    assert np.allclose(taken.numbers["x"], 12.0)
    assert np.allclose(taken.numbers["y"], [1.0, 0.0, -1.0], atol=0.01)
    assert np.allclose(taken.numbers["u"], [0.3, 0.5, 0.4], atol=0.001)
    assert (taken.numbers["u_se"] > 0.05 * 0.3).all()


def test_a_gauging_becomes_a_case(tmp_path: Path) -> None:
    site = SITE + "files: {june.dis: {line: [[12, 2], [12, -2]], section: A}}\n"
    found = imported(folder_of(tmp_path / "brook", site, june__dis=flowtracker(PLACES, DEPTHS, VELOCITIES)))
    assert found.table["section"].tolist() == ["A"] * 3
    assert found.values() == pytest.approx([0.3, 0.5, 0.4], abs=0.001)
    assert (found.case.imported or ())[0].units["u"] == "ft/s"


@pytest.mark.parametrize("stations", [[], {}, [1], [{}], [{"Location": "a"}], None])
def test_another_zip_is_refused(tmp_path: Path, stations: object) -> None:
    with ZipFile(tmp_path / "g.ft", "w") as archive:
        name = "other.json" if stations is None else "DataFile.json"
        archive.writestr(name, json.dumps({"Properties": {}, "Stations": stations}))
    assert reader_of(tmp_path / "g.ft") is read_flowtracker2
    refused(tmp_path / "g.ft", TAPE)


def test_a_transect_is_averaged_over_the_depth_and_along_the_section(tmp_path: Path) -> None:
    path = written(tmp_path / "transect_ASC.TXT", boat_text())
    assert reader_of(path) is read_winriver
    taken = read_winriver(path, START)
    assert taken.size == 15
    assert np.allclose(taken.numbers["x"] - 100.0, 0.75 * (taken.numbers["y"] - 200.0), atol=0.02)
    assert taken.numbers["east_velocity"] == pytest.approx(0.64, abs=0.03)
    assert taken.numbers["north_velocity"] == pytest.approx(-0.48, abs=0.03)
    # Ten ensembles a station, some 15 cells each, of 0.05 m/s of noise.
    assert np.median(taken.numbers["u_se"]) == pytest.approx(0.05 / 150**0.5, rel=0.5)


def test_a_transect_is_turned_into_the_channel(tmp_path: Path) -> None:
    """Water that heads to the south-east, in a channel that does: all of it along, with its errors."""
    frame = Frame(origin=(100.0, 200.0), angle=-36.8698976458)
    start = frame.to_map(12.0, -4.0)
    along = np.linspace(0.0, 8.0, 120)
    site = SITE + f"frame: {{origin: [100, 200], angle: {frame.angle}}}\n"
    site += f"files: {{t_ASC.TXT: {{start: [{start[0]}, {start[1]}], section: A}}}}\n"
    text = winriver(0.6 * along, 0.8 * along, 2.0, (0.64, -0.48), 0.05)
    found = imported(folder_of(tmp_path / "bend", site, t_ASC__TXT=text))
    assert np.allclose(found.values(), 0.8, atol=0.03)
    assert np.allclose(found.values("velocity_across"), 0.0, atol=0.03)
    assert np.allclose(found.table["x"], 12.0, atol=0.01)
    assert found.table["y"].between(-4.0, 4.0).all()
    assert (found.table["standard_error"] > 0.0).all()


def test_a_raw_transect_gives_the_stations_of_its_ascii_output(tmp_path: Path) -> None:
    pytest.importorskip("mhkit")
    path = raw_boat(tmp_path)
    assert reader_of(path) is read_pd0
    raw, text = read_pd0(path, START), read_winriver(written(tmp_path / "t_ASC.TXT", boat_text()), START)
    assert raw.size == text.size == 15
    for role, off in (("x", 0.08), ("y", 0.08), ("east_velocity", 0.02), ("north_velocity", 0.02)):
        assert raw.numbers[role] == pytest.approx(text.numbers[role], abs=off), role
    assert np.median(raw.numbers["u_se"]) == pytest.approx(np.median(text.numbers["u_se"]), rel=0.5)
    assert raw.notes[0] == ImportNote(Noted.ADCP_AT, pytest.approx(0.2), ("Rio Grande",))
    assert ImportNote(Noted.ENSEMBLES, 151) in raw.notes


@pytest.mark.parametrize(("bed", "lost", "drift"), [
    ((0.0, 0.0), (), 0.0), ((0.0, 0.0), tuple(range(40, 90)), 0.0), ((0.16, -0.12), (), 0.2),
    ((0.16, -0.12), tuple(range(40, 90)), 0.2),
])  # fmt: skip
def test_places_by_gps_count_over_a_bottom_that_moves_or_is_lost(
    tmp_path: Path, bed: tuple[float, float], lost: tuple[int, ...], drift: float
) -> None:
    """On the Tanana the bottom was lost for 122 s, and moved at up to 1 m/s: stations lay 180 m off, and water that ran
    at 2.1 m/s was read as 1.2 m/s.
    """
    pytest.importorskip("mhkit")
    (track, *rest) = BOAT
    right = read_pd0(raw_boat(tmp_path), START)
    path = written(tmp_path / "gps.PD0", pd0(*track, *rest, gps=True, bed=bed, lost=lost))
    found = read_pd0(path, START)
    for role, off in (("x", 0.3), ("y", 0.3), ("east_velocity", 0.03), ("north_velocity", 0.03)):
        assert found.numbers[role] == pytest.approx(right.numbers[role], abs=off), role
    assert ImportNote(Noted.BY_GPS, pytest.approx(drift, abs=0.02)) in found.notes
    assert ImportNote(Noted.ENSEMBLES, 151) in found.notes


def test_the_way_of_a_boat_that_lost_the_bottom_is_told_if_there_is_no_gps(tmp_path: Path) -> None:
    """It was bridged by the velocity of one ensemble without a word."""
    pytest.importorskip("mhkit")
    (track, *rest) = BOAT
    told = read_pd0(written(tmp_path / "lost.PD0", pd0(*track, *rest, lost=tuple(range(40, 90)))), START).notes
    assert ImportNote(Noted.BOTTOM_BRIDGED, pytest.approx(ALONG[90] - ALONG[39], rel=0.05)) in told
    soon = read_pd0(written(tmp_path / "soon.PD0", pd0(*track, *rest, lost=(40,))), START).notes
    assert Noted.BOTTOM_BRIDGED not in {one.kind for one in soon if isinstance(one, ImportNote)}


def test_a_compass_is_turned_to_true_north(tmp_path: Path) -> None:
    pytest.importorskip("mhkit")
    path = raw_boat(tmp_path)
    plain, turned = (read_pd0(path, FileOptions(start=(0.0, 0.0), declination=d)) for d in (0.0, 90.0))
    for role, same, sign in (
        ("east_velocity", "north_velocity", 1.0), ("north_velocity", "east_velocity", -1.0), ("x", "y", 1.0),
    ):  # fmt: skip
        assert np.allclose(turned.numbers[role], sign * plain.numbers[same], atol=1e-6), role


def test_a_damaged_raw_file_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("mhkit")
    path = raw_boat(tmp_path)
    for content in (b"\x7f\x7f", b"\x7f\x7f" + bytes(400), path.read_bytes()[:500]):
        refused(written(path, content), START)


def test_a_binary_record_of_a_vector_is_its_mean_without_spikes(tmp_path: Path) -> None:
    pytest.importorskip("mhkit")
    path = written(tmp_path / "p.vec", vector((0.30, 0.02, 0.0), 0.03, 960, bad=20))
    assert reader_of(path) is read_vector
    taken = read_vector(path, PROBE)
    for role, value, off in (
        ("u", 0.30, 0.005),
        ("v", 0.02, 0.005),
        ("u_std", 0.03, 0.003),
        ("duration_s", 940 / 32, 0.3),
    ):
        assert taken.numbers[role][0] == pytest.approx(value, abs=off), role
    assert taken.notes[1] == ImportNote(Noted.SAMPLES_LOST, 20)
    assert taken.texts["device"] == ["Vector"]
    refused(path, FileOptions())


def test_without_the_library_it_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mhkit", None)
    record = written(tmp_path / "p.vec", vector((0.3, 0.0, 0.0), 0.03, 64, bad=0))
    for path, options in ((raw_boat(tmp_path), START), (record, PROBE)):
        assert "vegglue[instruments]" in refused(path, options)


@pytest.mark.parametrize(("raw", "read"), [("t.PD0", True), ("t_1.vno", False)])
def test_a_raw_record_beside_its_export_is_left_alone(tmp_path: Path, raw: str, read: bool) -> None:
    """But not one beside the export of another, t_10, whose name begins alike."""
    name = "t_ASC.TXT" if read else "t_10_ASC.TXT"
    folder = folder_of(tmp_path / "brook", f"{SITE}files: {{{name}: {{start: [10, -1], section: A}}}}\n")
    written(folder / name, boat_text())
    written(folder / raw, b"\x7f\x7f" + bytes(100))
    if read:
        assert list(imported(folder).taken) == [name]
    else:
        assert raw in refusal(folder)


@pytest.mark.parametrize(
    ("name", "begins"),
    [
        ("p.vec", b"\xa5\x05\x18\x00"), ("p.dat", b"\xa5\x05\x18\x00"), ("p.ad2cp", b"\xa5\x0a\x0a\x10"),
        ("p.vno", b"??"),
        ("p.ntk", b"??"),
    ],
)  # fmt: skip
def test_records_without_a_reader_are_refused_with_what_to_export(tmp_path: Path, name: str, begins: bytes) -> None:
    folder = folder_of(tmp_path / "flume", SITE)
    written(folder / name, begins + bytes(100))
    error = refusal(folder)
    assert name in error
    assert ".hdr" in error


def flume(
    tmp_path: Path, options: list[str], records: list[tuple[float, float]], axes: str = "", more: str = ""
) -> Path:
    """Records of a Vectrino of mean u and v, each with its options in the site file."""
    entries = ", ".join(f"p{number}.dat: {{{one}}}" for number, one in enumerate(options))
    folder = folder_of(tmp_path / "flume", f"{SITE}{more}files: {{{entries}}}\n")
    of_axes = f"Coordinate system                     {axes}\n" if axes else ""
    for number, (u, v) in enumerate(records):
        written(folder / f"p{number}.dat", vectrino((u, v, 0.0), 0.03, 1000, bad=20))
        written(folder / f"p{number}.hdr", VECTRINO_HEADING + of_axes)
    return folder


def test_records_of_one_point_become_a_vertical(tmp_path: Path) -> None:
    points = [(0.1, 0.30), (0.3, 0.38), (0.6, 0.44)]
    found = imported(
        flume(tmp_path, [f"position: [12, 0.5, {z}], section: A" for z, _ in points], [(u, 0.02) for _, u in points])
    )
    read = read_observations(found.case)
    assert read.points["u"].tolist() == pytest.approx([0.30, 0.38, 0.44], abs=0.005)
    assert read.points["u_std"].tolist() == pytest.approx([0.03] * 3, rel=0.1)
    assert 0.3 < found.values()[0] < 0.5
    assert found.values("velocity_across") == pytest.approx([0.02], abs=0.005)
    assert "20 left out" in found.taken["p0.dat"]


def test_records_of_one_vertical_keep_errors_of_their_own(tmp_path: Path) -> None:
    errors = (", standard_error: 1 cm/s", "", ", standard_error: 4 cm/s")
    options = [f"position: [12, 0.5, {0.1 + 0.2 * n:.1f}], section: A{error}" for n, error in enumerate(errors)]
    case = imported(flume(tmp_path, options, [(0.3, 0.02)] * 3)).case
    assert pd.read_csv(case.observations[0].file)["u_se"].tolist() == [0.01, 0.0, 0.04]


QREVIEW = """ \r
Discharge Measurement Summary\r
Units\tImperial\tPoint Offset\t0.00\r
Start edge\tRIGHT\tFirst edge position(ft)\t56.00\tLast edge position(ft)\t99.50\r
 \r
Time Series\r
Time    \tNr \tPnts\tPos. \tDepth \tMeanV \tArea  \tQ     \t%Q    \tAngle\tStD of\tTempe\r
        \t  \t    \t(ft)   \t(ft)        \t(ft/s)    \t(ft³)    \t(ft³/s)    \t      \t(?   \t(ft³/s)  \t(°C) \r
17:00:13\t1\t1\t60.00\t2.052\t0.021\t6.156\t0.129\t0.6\t-62.3*\t0.41\t18.8\r
18:16:28\t3\t2\t64.50\t3.138\t0.271\t1.569\t0.426\t1.8\t-0.3\t0.13\t20.1\r
17:05:06\t2\t2\t64.00\t2.967\t0.292\t3.709\t1.081\t4.6\t0.3\t0.10\t19.2\r
"""


def test_verticals_of_an_ott_adc_stand_along_their_tape(tmp_path: Path) -> None:
    """Units below the headings, in the code page of Windows; added verticals stand out of order."""
    path = tmp_path / "mill_Summary.TSV"
    path.write_bytes(QREVIEW.encode("cp1252"))
    taken = reader_of(path)(path, FileOptions(line=((10.0, 0.0), (10.0, 40.0))))
    assert taken.numbers["y"] == pytest.approx(0.3048 * np.array([60.0, 64.5, 64.0]))
    assert taken.numbers["u"] == pytest.approx(0.3048 * np.array([0.021, 0.271, 0.292]))
    assert taken.numbers["depth"] == pytest.approx(0.3048 * np.array([2.052, 3.138, 2.967]))


MF_PRO = """Profile Name: MILL 1
14:23 Mo 24. Aug 2015
Start Edge: Left Edge Water
# Stations: 3
Stage Reference: 0.300 m

Time\tStation\tLocation (m)\tMethod\tDepth (m)\tEdge Factor\t0.2 (m/s)\t0.6 (m/s)\tAverage Velocity (m/s)\tFlow (m³/s)
14:25\t1\t0.20\t0 point\t0.00\t0.60\t0.000\t0.000\t0.000\t0.000
14:26\t2\t1.20\t1 point\t0.42\t0.00\t0.000\t0.351\t0.351\t0.147
14:29\t3\t2.20\t2 point\t0.61\t0.00\t0.512\t0.000\t0.457\t0.279
"""


@pytest.mark.parametrize("decimal", [".", ","])
def test_verticals_of_an_ott_mf_pro_stand_along_their_tape(tmp_path: Path, decimal: str) -> None:
    site = f"{CHANNEL}{JUNE}files: {{mill.tsv: {{line: [[10, 3.2], [10, -3]]}}}}\n"
    found = imported(folder_of(tmp_path / "mill", site, mill__tsv=MF_PRO.replace(".", decimal)))
    assert found.table["y"].tolist() == pytest.approx([2.0, 1.0])
    assert found.values() == [0.351, 0.457]
    error = refusal(folder_of(tmp_path / "brook", CHANNEL + JUNE, mill__tsv=MF_PRO))
    assert "expected where the tape of 'Location (m)' lay" in error


def test_points_of_an_aquacalc_5000_are_named(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    rows = " 1,    43.00,   0.00,  0.00,    0,  0.0,  1.00,   6,  1.00,   9:50,   0.341,    0.000,     0.000,         ,"
    head = "\nAquaCalc 5000 (tm)  by JBS Instruments \n\n  GAGE ID#  ,6690500\n\n"
    path.write_text(f"{head}OB ,DIST    ,DEPTH,ICE,REVS,TIME,COS:VF,LOC,COEF ,CLOCK  ,VEL   ,AREA \n{rows}\n")
    with pytest.raises(InputError, match="points of an AquaCalc 5000; write a table"):
        reader_of(path)(path, FileOptions(line=((10.0, 0.0), (10.0, 40.0))))


def samples(mean: float, headings: str = "Time,Vx,Vy,Corr1,Corr2") -> str:
    """A table of a probe at 25 Hz: of each fifty samples one has a low correlation, and one of 300 is a spike."""
    rng = np.random.default_rng(round(100 * mean))
    rows = [
        f"{0.04 * n:.2f},{9.0 if n == 170 else mean + u:.4f},{0.02 + v:.4f},{20 if n % 50 == 0 else 95},96"
        for n, (u, v) in enumerate(rng.normal(0.0, 0.03, (300, 2)))
    ]
    return "\n".join([headings, *rows])


def test_tables_of_samples_stand_at_the_position_of_their_probe(tmp_path: Path) -> None:
    files = [f"p{n}.csv: {{position: [12, 0.5, {z}]}}" for n, z in enumerate((0.2, 0.4, 0.6))]
    folder = folder_of(tmp_path / "flume", f"{SITE}files: {{{', '.join(files)}}}\n")
    for number, mean in enumerate((0.30, 0.36, 0.40)):
        written(folder / f"p{number}.csv", samples(mean))
    found = imported(folder)
    points = pd.read_csv(found.case.observations[0].file)
    assert points[["x", "y", "z"]].to_numpy().tolist() == [[12, 0.5, 0.2], [12, 0.5, 0.4], [12, 0.5, 0.6]]
    assert points["u"].tolist() == pytest.approx([0.30, 0.36, 0.40], abs=0.005)
    assert points["v"].tolist() == pytest.approx([0.02] * 3, abs=0.005)
    assert points["u_se"].tolist() == pytest.approx([0.03 / np.sqrt(293)] * 3, rel=0.1)
    assert "7 left out" in found.taken["p1.csv"]


def test_a_table_of_samples_and_a_record_make_one_vertical(tmp_path: Path) -> None:
    folder = flume(tmp_path, ["position: [12, 0.5, 0.1]"], [(0.3, 0.02)], more="")
    site = folder / "site.yaml"
    site.write_text(site.read_text(encoding="utf-8").replace("files: {", "files: {a.csv: {position: [12, 0.5, 0.4]}, "))
    written(folder / "a.csv", samples(0.4))
    points = pd.read_csv(imported(folder).case.observations[0].file)
    assert dict(zip(points["z"], points["u"], strict=True)) == pytest.approx({0.1: 0.3, 0.4: 0.4}, abs=0.005)


@pytest.mark.parametrize(
    ("table", "word"),
    [
        ("x,u\n1,0.4\n2,0.5\n", "places in x"),
        ("z,Vx\n0.1,0.4\n", "places in z"),
        ("time,level\n1,0.4\n", "no velocity"),
    ],
)
def test_a_position_is_for_samples_of_one_point(tmp_path: Path, table: str, word: str) -> None:
    folder = folder_of(tmp_path / "flume", f"{SITE}files: {{a.csv: {{position: [12, 0.5, 0.4]}}}}\n", a__csv=table)
    assert word in refusal(folder)


@pytest.mark.parametrize(
    ("axes", "directions", "velocity"),
    [("XYZ", "", (0.4, 0.05)), ("", "", (0.4, 0.05)), ("XYZ", ", directions: map", (0.05, -0.4)),
    ("ENU", "", (0.05, -0.4))],
)  # fmt: skip
def test_the_axes_of_a_probe_are_not_those_of_the_map(
    tmp_path: Path, axes: str, directions: str, velocity: tuple[float, float]
) -> None:
    """0.4 m/s along a channel that runs north were 0.4 m/s across it."""
    more = "frame: {origin: [1000, 2000], angle: 90}\n"
    case = imported(flume(tmp_path, [f"position: [1000, 2010, 0.3]{directions}"], [(0.4, 0.05)], axes, more)).case
    found = [pd.read_csv(one.file)[column].item() for one, column in zip(case.observations, "uv", strict=True)]
    assert found == pytest.approx(velocity, abs=0.003)


@pytest.mark.parametrize(
    ("heading", "word"), [(f"{VECTRINO_HEADING}Coordinate system    BEAM\n", "BEAM"), ("", "Sampling rate")]
)
def test_a_record_in_beams_or_without_its_rate_is_refused(tmp_path: Path, heading: str, word: str) -> None:
    path = written(tmp_path / "p.dat", vectrino((0.4, 0.0, 0.0), 0.01, 100, bad=0))
    written(tmp_path / "p.hdr", heading)
    with pytest.raises(InputError, match=word):
        read_nortek(path, PROBE)


@pytest.mark.parametrize(
    ("line", "kind", "got"), [("1 0.4 0.1", "ragged_record", 3), ("x" + " 1" * 18, "no_number", "x")]
)
def test_a_row_of_a_record_that_is_no_row_of_numbers_is_named(
    tmp_path: Path, line: str, kind: str, got: int | str
) -> None:
    record = vectrino((0.4, 0.0, 0.0), 0.01, 100, bad=0).splitlines()
    width = len(record[0].split())
    path = written(tmp_path / "p.dat", "\n".join([record[0], " ".join(line.split()[:width]), *record[2:]]))
    written(tmp_path / "p.hdr", VECTRINO_HEADING)
    with pytest.raises(InputError) as caught:
        read_nortek(path, PROBE)
    assert (caught.value.kind, caught.value.values["row"], caught.value.values["got"]) == (kind, 2, got)


@pytest.mark.parametrize("unit", ["m", "ft"])
def test_a_transect_of_a_riversurveyor_becomes_stations(tmp_path: Path, unit: str) -> None:
    riversurveyor_mat(tmp_path / "t.mat", unit)
    assert reader_of(tmp_path / "t.mat") is read_matlab
    taken = read_matlab(tmp_path / "t.mat", START)
    assert ImportNote(Noted.ENSEMBLES, 36) in taken.notes
    assert taken.numbers["east_velocity"] == pytest.approx(0.64, abs=0.03)
    assert taken.numbers["north_velocity"] == pytest.approx(-0.48, abs=0.03)
    assert np.allclose(taken.numbers["x"] - 100.0, 0.75 * (taken.numbers["y"] - 200.0), atol=1e-6)


def qrev(tmp_path: Path, transects: int) -> MeasuredRows:
    qrev_mat(tmp_path / "mill_QRev.mat", transects=transects)
    return read_matlab(tmp_path / "mill_QRev.mat", START)


def test_transects_there_and_back_lie_on_one_another(tmp_path: Path) -> None:
    taken = qrev(tmp_path, 2)
    assert taken.notes[1:3] == (ImportNote(Noted.TRANSECTS, 2), ImportNote(Noted.ENSEMBLES, 118))
    assert taken.notes[3].number == 2
    assert taken.size == 15
    assert taken.numbers["x"].min() == pytest.approx(100.0, abs=0.2)
    assert taken.numbers["x"].max() == pytest.approx(100.0 + 59 * 0.06, abs=0.2)
    assert np.allclose(taken.numbers["y"] - 200.0, (taken.numbers["x"] - 100.0) / 0.75, atol=1e-6)
    assert taken.numbers["east_velocity"] == pytest.approx(0.64, abs=0.02)  # without the cells that were filled up
    assert taken.numbers["north_velocity"] == pytest.approx(-0.48, abs=0.02)
    assert qrev(tmp_path, 1).notes[1:3] == (ImportNote(Noted.TRANSECTS, 1), ImportNote(Noted.ENSEMBLES, 59))


@pytest.mark.parametrize("beams", [False, True])
def test_a_profile_is_the_mean_of_each_cell_that_is_strong(tmp_path: Path, beams: bool) -> None:
    path = tmp_path / "p.mat"
    profiler_mat(path, MEANS, beams)
    taken = read_matlab(path, FileOptions(position=(2.0, 0.3, 0.15)))
    assert taken.size == 30
    assert taken.notes[1] == ImportNote(Noted.CELLS_SOUND, 30, ("31",))
    assert taken.numbers["z"] == pytest.approx(0.15 - 0.04 - 0.001 * np.arange(30))
    assert taken.numbers["u"] == pytest.approx(MEANS[:30], abs=0.005)
    assert taken.numbers["v"] == pytest.approx(0.0, abs=0.005)
    assert taken.numbers["u_std"] == pytest.approx(0.02, rel=0.2)
    assert taken.numbers["duration_s"] == pytest.approx(np.where(np.arange(30) == 3, 359, 360) / 50)
    refused(path, FileOptions())


def test_cells_at_the_bed_are_left_out(tmp_path: Path) -> None:
    profiler_mat(tmp_path / "p.mat", MEANS, bed=0.0602)
    taken = read_matlab(tmp_path / "p.mat", FileOptions(position=(2.0, 0.3, 0.0602)))
    assert taken.numbers["z"].min() == pytest.approx(0.0012)


def test_profiles_one_above_the_other_become_a_vertical(tmp_path: Path) -> None:
    files = [f"p{n}.mat: {{position: [2, 0.1, {0.08 + 0.04 * n}], section: A}}" for n in (0, 1)]
    site = "channel: {length_m: 4, bottom_width_m: 0.8, bed_slope: 0.001}\nwalls: {n: 0.01}\n"
    site += f"experiments: {{run: {{discharge: 20 l/s, level: 0.13}}}}\nfiles: {{{', '.join(files)}}}\n"
    folder = folder_of(tmp_path / "flume", site)
    for number, speed in enumerate((0.24, 0.30)):
        profiler_mat(folder / f"p{number}.mat", np.full(31, speed))
    found = imported(folder)
    assert 0.24 < found.values()[0] < 0.30
    assert found.values("velocity_across") == pytest.approx([0.0], abs=0.005)


def test_another_mat_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "t.mat"
    riversurveyor_mat(path, "m", coordinateSystem=0)
    assert "ENU" in refused(path, START)
    for water, word in (({"coordSys": "Ship"}, "Ship"), ({"validData": np.ones(3)}, "QRev")):
        qrev_mat(path, **water)
        assert word in refused(path, START)
    profiler_mat(path, MEANS, sampleRate="fast")
    assert "Vectrino Profiler" in refused(path, PROBE)
    for variables, word in (
        ({"meas_struct": {"a": 1.0}}, "QRev"), ({"depths": 1.0}, "depths"),
        ({name: {"a": 1.0} for name in ("Setup", "Summary", "System", "WaterTrack")}, "RiverSurveyor Live"),
    ):  # fmt: skip
        savemat(path, variables)
        assert word in refused(path, START)
    for content in (b"MATLAB 5.0 MAT-file" + bytes(200), b"MATLAB 7.3 MAT-file, HDF5" + bytes(600)):
        refused(written(path, content), START)


def test_a_summary_of_qrev_is_a_discharge_with_its_error(tmp_path: Path) -> None:
    site = SITE + "files: {mill_QRev.xml: {start: [12, 2]}}\n"
    folder = folder_of(tmp_path / "mill", site, mill_QRev__xml=SUMMARY)
    assert reader_of(folder / "mill_QRev.xml") is read_qrev_summary
    table = imported(folder).table
    assert table[["kind", "x", "value"]].to_numpy().tolist() == [["discharge", 12.0, 2.04]]
    assert table["standard_error"].tolist() == pytest.approx([0.04 * 2.04])


@pytest.mark.parametrize(
    "change",
    [
        ("<Channel Q", '<!DOCTYPE a [<!ENTITY b "bb">]><Channel Q'), ("</Channel>", ""),
        ("<ChannelSummary>", "<Summary>"),
        (">2.040<", ">many<"), ("<Total type", "<All type"), ('unitsCode="cms">2', 'unitsCode="m">2'),
    ],
)  # fmt: skip
def test_another_summary_is_refused(tmp_path: Path, change: tuple[str, str]) -> None:
    refused(written(tmp_path / "mill_QRev.xml", SUMMARY.replace(*change)), START)


@pytest.mark.parametrize("classic", [False, True])
def test_images_of_a_camera_become_means_of_what_they_saw(tmp_path: Path, classic: bool) -> None:
    """Along the axes of the images 0.5 and 0.1 m/s, which lie 30 degrees from the east; a corner was hardly seen."""
    random, turned, spread = np.random.default_rng(5), np.radians(30.0), 0.06
    along, across = (mean + spread * random.standard_normal((400, 5, 6)) for mean in (0.5, 0.1))
    along[:, 0, 0][20:] = np.nan
    write_velocimetry(tmp_path / "piv.nc", along, across, turned, classic)
    assert reader_of(tmp_path / "piv.nc") is read_velocimetry
    taken = read_velocimetry(tmp_path / "piv.nc", FileOptions())
    assert taken.size == 9
    assert taken.numbers["east_velocity"] == pytest.approx(0.5 * np.cos(turned) - 0.1 * np.sin(turned), abs=0.01)
    assert taken.numbers["north_velocity"] == pytest.approx(0.5 * np.sin(turned) + 0.1 * np.cos(turned), abs=0.01)
    assert taken.numbers["u_se"] == pytest.approx(spread / 20.0, rel=0.1)
    # The last row of images has no row beside it: two by two there are 0.1 m of x, 0 of y.
    last = int(np.argmin(np.hypot(taken.numbers["x"] - 1000.0, taken.numbers["y"] - 2000.0)))
    assert taken.numbers["x"][last] == pytest.approx(1000.0 + 0.1 * np.cos(turned))
    assert taken.notes == ("pyorc", ImportNote(Noted.IMAGES, 400, ("factor",)))


def test_a_cell_seen_once_has_no_error(tmp_path: Path) -> None:
    """Of two times: its velocity had an error of 0 m/s, and the errors of the others were 0.7 times too small."""
    along = np.stack([np.full((4, 6), 0.4), np.full((4, 6), 0.6)])
    along[1, :2, :2] = np.nan
    write_velocimetry(tmp_path / "piv.nc", along, 0.0 * along, 0.0)
    taken = read_velocimetry(tmp_path / "piv.nc", FileOptions())
    assert taken.numbers["east_velocity"] == pytest.approx(0.5)
    assert (taken.numbers["u_se"] > 0.0).all()


def test_images_named_under_files_are_no_result_of_a_model(tmp_path: Path) -> None:
    """At 0.85 of the surface, in the channel: its frame lies 30 degrees from the east, as the images do."""
    frame = "frame: {origin: [998, 1999], angle: 30 degrees}\n"
    folder = folder_of(tmp_path / "stream", f"{CHANNEL}{JUNE}{frame}files: {{piv.nc: {{factor: 0.85}}}}\n")
    moving = 0.5 + 0.05 * np.random.default_rng(6).standard_normal((30, 4, 6))
    write_velocimetry(folder / "piv.nc", moving, 0.0 * moving, np.radians(30.0))
    found = imported(folder)
    assert np.allclose(found.values(), 0.85 * 0.5, atol=0.03)
    assert np.allclose(found.values("velocity_across"), 0.0, atol=0.03)


def test_images_that_saw_nothing_and_other_netcdf_are_refused(tmp_path: Path) -> None:
    unseen = np.full((9, 2, 2), np.nan)
    write_velocimetry(tmp_path / "piv.nc", unseen, unseen, 0.0)
    with pytest.raises(InputError, match="mask less in pyorc"):
        read_velocimetry(tmp_path / "piv.nc", FileOptions())
    ones = np.ones((3, 2))
    flow = GridFlow(np.arange(4.0), np.arange(3.0), 0.0 * ones, ones, ones, 0.0 * ones, 0.03 * ones)
    write_flow_fm(tmp_path / "map.nc", flow)
    with pytest.raises(InputError, match="expected velocities of images"):
        read_velocimetry(tmp_path / "map.nc", FileOptions())
