"""What files mark as no measurement is none: marks of every format, rows of summaries, flags, zeros, and copies."""

import json
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pandas as pd
import pytest
from field_folders import CHANNEL, JUNE, folder_of
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from instrument_files import flowtracker, pd0, winriver
from reach import here

import vegglue
from vegglue.case.bed import read_points, read_raster
from vegglue.case.gridded_site import build_site
from vegglue.errors import InputError
from vegglue.importers.file_options import FileOptions
from vegglue.importers.gaugings import read_flowtracker2, read_gauging
from vegglue.importers.import_notes import ImportNote, Noted
from vegglue.importers.instruments import reader_of
from vegglue.importers.measured_rows import Placement, read_rows
from vegglue.importers.teledyne import read_pd0, read_winriver
from vegglue.importers.terrain import read_terrain
from vegglue.measurements.observations import read_observations

SHARED = Path(__file__).parents[3] / "shared" / "cases" / "files"
START = FileOptions(start=(100.0, 200.0))
TAPE = FileOptions(line=((12.0, 2.0), (12.0, -2.0)))
ALONG = np.linspace(0.0, 15.0, 151)
BOAT = (0.6 * ALONG, 0.8 * ALONG)
MANY = settings(
    max_examples=40, deadline=None, derandomize=True, database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)  # fmt: skip


def imported(tmp_path: Path, site: str = CHANNEL + JUNE, **files: str) -> tuple[pd.DataFrame, str]:
    """Stations of a folder, and what was taken from its last file."""
    case = vegglue.import_folder(folder_of(tmp_path / "brook", site, **files), tmp_path / "brook.yaml")
    return read_observations(case).table, (case.imported or ())[-1].taken


# Of each folder: how many values are used of each kind, their mean, and the range of levels of the bed; None for exit
# code 2, and nothing written.
OF_OTHERS: dict[str, tuple[dict[str, tuple[int, float]], tuple[float, float]] | None] = {
    "classes_bed": ({"velocity": (2, 0.25)}, (-0.010, 0.0)), "classes_only": ({"velocity": (2, 0.25)}, (-0.010, 0.0)),
    "dem_pit": ({"velocity": (20, 0.40)}, (-0.040, 1.453)), "dem_scale": ({"velocity": (20, 0.40)}, (-0.040, 1.453)),
    "depths": ({"velocity": (2, 0.25), "level": (3, 0.095)}, (-0.010, 0.0)),
    "flag": ({"velocity": (14, 0.3957)}, (-0.04, 1.453)), "hidden": ({"velocity": (14, 0.3957)}, (-0.04, 1.453)),
    "meanrow2": ({"velocity": (8, 0.4321), "velocity_across": (8, 0.0)}, (-0.04, 1.453)),
    "odd_floor": ({"velocity": (21, 0.3402)}, (-0.019, 0.875)), "write_table": ({"velocity": (2, 0.25)}, (-0.010, 0.0)),
    "z_bed": ({"velocity": (2, 0.25)}, (-0.010, 0.0)),
    "pd0min": ({"velocity": (14, 0.40), "velocity_across": (14, 0.02)}, (-0.039, 2.062)),
    "gda": None, "gda_json": None, "pol_bow": None, "wr_none": None, "zeros": None,
}  # fmt: skip


@pytest.mark.skipif(not SHARED.is_dir(), reason="no folder `shared/cases/files` beside the repository")
@pytest.mark.parametrize("name", OF_OTHERS)
def test_files_of_others_are_read_rightly_or_refused(tmp_path: Path, name: str) -> None:
    if name == "pd0min":
        pytest.importorskip("mhkit")
    wanted = OF_OTHERS[name]
    done = here(tmp_path, "import", SHARED / name, "--to", "made.yaml", succeed=False)
    assert done.returncode == (2 if wanted is None else 0), done.stderr
    assert (tmp_path / "made.yaml").exists() == (wanted is not None)
    if wanted is not None:
        case = vegglue.load_case(tmp_path / "made.yaml")
        table = read_observations(case).table
        used = table[table["used"]].groupby("kind")["value"]
        assert dict(used.count()) == {kind: count for kind, (count, _) in wanted[0].items()}
        for kind, (_, mean) in wanted[0].items():
            assert used.mean()[kind] == pytest.approx(mean, abs=2e-3)
        bed = build_site(case).bed
        assert (np.nanmin(bed), np.nanmax(bed)) == pytest.approx(wanted[1], abs=5e-3)


def test_lost_bottom_track_costs_its_ensemble_only(tmp_path: Path) -> None:
    pytest.importorskip("mhkit")
    whole, marked = (tmp_path / name for name in ("a.PD0", "b.PD0"))
    whole.write_bytes(pd0(*BOAT, 2.0, (0.64, -0.48), 0.0))
    marked.write_bytes(pd0(*BOAT, 2.0, (0.64, -0.48), 0.0, lost=(40, 41), unranged=(90,)))
    a, b = read_pd0(whole, START), read_pd0(marked, START)
    assert ImportNote(Noted.ENSEMBLES, 151) in a.notes, "the last one, too"
    assert b.notes[-3:] == (
        ImportNote(Noted.ENSEMBLES, 148),
        ImportNote(Noted.ENSEMBLES_LACKING, 1, ("velocities",)),
        ImportNote(Noted.ENSEMBLES_LACKING, 2, ("a place",)),
    )
    for role in ("x", "y", "east_velocity", "north_velocity"):
        assert b.numbers[role] == pytest.approx(a.numbers[role], abs=0.05 if role in "xy" else 0.005), role


@MANY
@given(ensemble=st.integers(0, 150), part=st.sampled_from(["track", "depth", "cells", "boat"]))
def test_any_mark_of_winriver_is_as_good_as_no_ensemble(tmp_path: Path, ensemble: int, part: str) -> None:
    lines = winriver(*BOAT, 2.0, (0.64, -0.48), 0.05).splitlines()
    size = 6 + int(lines[8].split()[0])
    at = 3 + size * ensemble
    rows = [line.split() for line in lines[at : at + size]]
    lost = {"track": [(2, 2), (2, 3)], "depth": [(1, column) for column in range(8, 12)], "boat": [(1, 0)]}
    for row, column in lost.get(part, [(row, column) for row in range(6, size) for column in (3, 4)]):
        rows[row][column] = "-32768"
    path = tmp_path / "t_ASC.TXT"
    path.write_text("\n".join([*lines[:at], *map(" ".join, rows), *lines[at + size :]]), encoding="utf-8")
    marked = read_winriver(path, START)
    path.write_text("\n".join([*lines[:at], *lines[at + size :]]), encoding="utf-8")
    without = read_winriver(path, START)
    for role, values in without.numbers.items():
        assert marked.numbers[role] == pytest.approx(values, abs=1e-9), role
    counted = [(note.kind, note.number) for note in marked.notes[1:]]
    assert counted == [(Noted.ENSEMBLES, 150), (Noted.ENSEMBLES_LACKING, 1)]


@pytest.mark.parametrize(("reference", "leap"), [("NONE", 0.0), ("BT", 400.0)])
def test_a_boat_without_ground_or_that_leaps_is_refused(tmp_path: Path, reference: str, leap: float) -> None:
    east, north = BOAT[0] + np.where(ALONG > 7.0, leap, 0.0), BOAT[1]
    path = tmp_path / "t_ASC.TXT"
    path.write_text(winriver(east, north, 2.0, (0.64, -0.48), 0.05, reference=reference), encoding="utf-8")
    with pytest.raises(InputError, match=r"t_ASC\.TXT"):
        read_winriver(path, START)


def station(location: float, u: float | None, units: bool = False, **more: object) -> dict[str, object]:
    """A vertical of a FlowTracker2, with or without units in its keys."""
    length, speed = (" (m)", " (m/s)") if units else ("", "")
    means = None if u is None else {
        f"MeanVelocityInVertical{speed}": {"X": u, "Y": 0.0}, f"VelocityStandardError{speed}": {"X": 0.006},
        "Samples": 40,
    }  # fmt: skip
    return {
        f"Location{length}": location,
        f"Depth{length}": 0.5,
        "VelocityMethod": "SixTenths",
        "Calculations": means,
    } | more


def flowtracker2(path: Path, *stations: dict[str, object]) -> Path:
    with ZipFile(path, "w") as archive:
        archive.writestr("DataFile.json", json.dumps({"Stations": stations}))
    return path


@pytest.mark.parametrize("units", [True, False])
@pytest.mark.parametrize(
    "edge",
    [
        {"VelocityMethod": "None"}, {"StationType": "LeftBank"}, {"StationType": "IslandEdge"}, {"Calculations": None},
        {"Calculations": {"MeanVelocityInVertical": {"X": 0.0}, "Samples": 0}},
    ],
)  # fmt: skip
def test_what_a_flowtracker2_did_not_measure_is_no_velocity(
    tmp_path: Path, units: bool, edge: dict[str, object]
) -> None:
    path = flowtracker2(
        tmp_path / "g.ft", station(0.2, 0.0, units, **edge), station(1.0, 0.3, units), station(2.0, 0.5, units)
    )
    taken = read_flowtracker2(path, TAPE)
    assert taken.numbers["u"].tolist() == [0.3, 0.5]
    assert taken.numbers["y"].tolist() == pytest.approx([1.0, 0.0])


@pytest.mark.parametrize(
    ("more", "u"),
    [({}, -0.4), ({"Calculations": {"MeanVelocityInVertical": {"X": 0.4}, "Area": 0.5, "Discharge": 0.2}}, 0.4)],
)
def test_flow_that_runs_against_the_probe_has_its_sign(tmp_path: Path, more: dict[str, object], u: float) -> None:
    """Unless discharge over area shows that the velocity has the factor already."""
    path = flowtracker2(tmp_path / "g.ft", station(1.0, 0.4, CorrectionFactor=-1.0, **more), station(2.0, 0.5))
    assert read_flowtracker2(path, TAPE).numbers["u"].tolist() == [u, 0.5]


AQUACALC = """<csv>
AquaCalc Pro (tm) by JBS Instruments (c)2002

Gage ID:,            Mill
Meas Time:,           0.53
Measure standard:,     {standard}

VERT,   DIST,TDPTH,IDRFT,EDPTH,OBS, TIME,REVS,HA,HC:VF,METH,CLOCK, MVEL, OVEL, VVEL,   SSAREA,      SSQ,SSPCT,  FLAGS
 1,     0.00, 0.50, 0.00, 0.00,  E,     ,    ,  ,     ,    ,11:36,     ,     , 0.00,     0.00,     0.00,  0.0%,
 2,     2.00, 0.50, 0.00, 0.50, o6,46.25,   8, 0, 1.00,1.00,11:37, 0.40, 0.40, 0.40,     1.75,     0.70,  0.5%,
 3,     3.00, 0.50, 0.00, 0.50, o6,40.54,   6, 0, 1.00,1.00,11:39, 0.34, 0.34, 0.34,     2.25,     0.77,  0.6%,
"""


@pytest.mark.parametrize(("standard", "foot"), [("SAE", 0.3048), ("Metric", 1.0)])
def test_a_gauging_of_an_aquacalc_is_read_in_its_units(tmp_path: Path, standard: str, foot: float) -> None:
    path = tmp_path / "mill.csv"
    path.write_text(AQUACALC.format(standard=standard), encoding="utf-8")
    assert reader_of(path) is read_gauging
    taken = read_gauging(path, TAPE)
    assert taken.numbers["u"] == pytest.approx(np.array([0.40, 0.34]) * foot)
    assert taken.numbers["y"] == pytest.approx(2.0 - np.array([2.0, 3.0]) * foot)


@MANY
@given(vertical=st.integers(1, 3), mark=st.sampled_from(["Npts", "MeanV", "Depth", "Loc"]))
def test_any_mark_of_a_gauging_is_as_good_as_no_vertical(tmp_path: Path, vertical: int, mark: str) -> None:
    lines = flowtracker([0.5, 1.0, 2.0, 3.0], [0.4, 0.5, 0.8, 0.6], [0.2, 0.3, 0.5, 0.4]).splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith("St "))
    fields = lines[head + 2 + vertical].split()
    fields[lines[head].split().index(mark)] = {"Npts": "0"}.get(mark, "-999")
    path = tmp_path / "g.dis"
    path.write_text(
        "\n".join([*lines[: head + 2 + vertical], " ".join(fields), *lines[head + 3 + vertical :]]), "utf-8"
    )
    marked = read_gauging(path, TAPE)
    path.write_text("\n".join([*lines[: head + 2 + vertical], *lines[head + 3 + vertical :]]), encoding="utf-8")
    kept = np.isfinite(marked.numbers["y"])
    for role, values in read_gauging(path, TAPE).numbers.items():
        assert marked.numbers[role][kept] == pytest.approx(values), role


@MANY
@given(
    row=st.integers(0, 11),
    column=st.sampled_from(["x", "y", "u", "u_se"]),
    mark=st.sampled_from(["", "-", "NaN", "-999", "-9999", "9999", "-32768", "1e30", "n/a", "#N/A", "k.A."]),
)
def test_any_mark_in_a_table_is_no_number(tmp_path: Path, row: int, column: str, mark: str) -> None:
    heading = ["x", "y", "u", "u_se"]
    rows = [[f"{8 + number}", "0.5", f"0.{40 + number}", "0.01"] for number in range(12)]
    path = tmp_path / "a.csv"
    rows[row][heading.index(column)] = mark
    path.write_text("\n".join(",".join(one) for one in [heading, *rows]), encoding="utf-8")
    numbers = read_rows(path, FileOptions()).numbers
    assert np.flatnonzero(~np.isfinite(numbers[column])).tolist() == [row]
    assert all(np.isfinite(values).all() for role, values in numbers.items() if role != column)


ACROSS = [(x, y) for x in (8, 16) for y in (-1.5, -0.5, 0.5, 1.5)]


def rows_of(*changed: tuple[int, str], more: str = "") -> str:
    """Velocities of two sections; changed: the velocity of some rows."""
    values = dict(changed)
    rows = [f"{x},{y},{values.get(number, '0.40')}{more}" for number, (x, y) in enumerate(ACROSS)]
    return "\n".join(["x,y,u" + (",note" if more else ""), *rows]) + "\n"


@pytest.mark.parametrize(
    ("zeros", "refused"), [((1,), True), ((1, 2), True), ((5, 6), True), ((0,), False), ((7,), False)]
)
def test_a_velocity_of_0_between_others_is_refused(tmp_path: Path, zeros: tuple[int, ...], refused: bool) -> None:
    table = rows_of(*((row, "0.000") for row in zeros))
    if refused:
        with pytest.raises(InputError, match=rf"v\.csv, row {zeros[0] + 2}:"):
            imported(tmp_path, v__csv=table)
    else:
        assert len(imported(tmp_path, v__csv=table)[0]) == 8


@pytest.mark.parametrize(("missing", "count"), [("[0]", 7), ("[]", 8)])
def test_the_site_file_decides_on_a_velocity_of_0(tmp_path: Path, missing: str, count: int) -> None:
    site = CHANNEL + JUNE + f"files: {{v.csv: {{missing: {missing}}}}}\n"
    assert len(imported(tmp_path, site, v__csv=rows_of((1, "0")))[0]) == count


def test_a_0_in_a_table_of_the_usual_name_is_refused_as_well(tmp_path: Path) -> None:
    rows = [f"June,A,8,{y},{u}" for y, u in ((-1, 0.4), (0, 0), (1, 0.4))]
    with pytest.raises(InputError, match=r"velocities\.csv, row 3:"):
        imported(tmp_path, velocities__csv="\n".join(["experiment,section,x,y,u", *rows]))


@pytest.mark.parametrize(("flag", "mark"), [("bad", "0.40"), ("good", "-999"), ("good", "9999")])
def test_a_table_of_the_usual_name_is_read_like_others(tmp_path: Path, flag: str, mark: str) -> None:
    """Flags and marks in it counted as measurements."""
    rows = [f"June,A,8,{y},{mark if y == 0 else 0.4},{flag if y == 0 else 'good'}" for y in (-1, 0, 1)]
    table, _ = imported(tmp_path, velocities__csv="\n".join(["experiment,section,x,y,u,quality", *rows]))
    assert table["value"].tolist() == [0.4, 0.4]


def test_edges_of_a_gauging_are_no_velocities(tmp_path: Path) -> None:
    site = CHANNEL + JUNE + "files: {g.csv: {line: [[12, 2], [12, -2]]}}\n"
    rows = ["0,0,0", "1,0.5,0.3", "2,0.6,0.5", "3,0.5,0.4", "4,0,0"]
    table, _ = imported(tmp_path, site, g__csv="\n".join(["Distance (m),Depth (m),Velocity (m/s)", *rows]))
    assert table["value"].tolist() == [0.3, 0.5, 0.4]


@pytest.mark.parametrize(
    "summary",
    [
        "Mean;8;0;41",
        "Mean of section A;8;0;41",
        "Average;;;41",
        "Mittelwert;8;0;41",
        "Total:;;;1800",
        "moyenne;8;0;41",
        "St dev;;;3",
        "Max;8;0;44",
    ],
)
def test_rows_of_summaries_are_no_measurements(tmp_path: Path, summary: str) -> None:
    rows = [f"{number};{x};{y};{40 + number}" for number, (x, y) in enumerate(ACROSS)]
    table, taken = imported(tmp_path, v__txt="\n".join(["Pt;x;y;u (cm/s)", *rows[:4], summary, *rows[4:]]))
    assert sorted(table["value"]) == pytest.approx([0.40 + 0.01 * number for number in range(8)])
    assert "row 6" in taken


@pytest.mark.parametrize(
    ("heading", "good", "bad"),
    [
        ("Quality", "good", "BAD - weed on probe"), ("QC flag", "1", "4"), ("Flag", "", "reject"), ("valid", "1", "0"),
        ("valid", "yes", "no"), ("bad", "0", "1"), ("Status", "ok", "failed"), ("QC", "1", "9"),
    ],
)  # fmt: skip
def test_rows_flagged_as_bad_are_left_out(tmp_path: Path, heading: str, good: str, bad: str) -> None:
    rows = [
        f"{x};{y};{'5' if number == 6 else '40'};{bad if number == 6 else good}" for number, (x, y) in enumerate(ACROSS)
    ]
    table, taken = imported(tmp_path, v__txt="\n".join([f"x;y;u (cm/s);{heading}", *rows]))
    assert set(table["value"]) == {0.40}
    assert "row 8" in taken


@pytest.mark.parametrize(("heading", "codes"), [("QC", 2), ("flags", 2), ("flags", 3)])  # flags: of OpenPIV, 0 to 2
def test_flags_of_0_and_1_without_a_sense_are_refused(tmp_path: Path, heading: str, codes: int) -> None:
    rows = [f"{x};{y};0.4;{number % codes}" for number, (x, y) in enumerate(ACROSS)]
    with pytest.raises(InputError, match=f"'{heading}'"):
        imported(tmp_path, v__txt="\n".join([f"x;y;u;{heading}", *rows]))


@pytest.mark.parametrize("quality", ["good", "fair", "poor", "{number}"])
def test_a_rating_is_no_flag(tmp_path: Path, quality: str) -> None:
    rows = [f"{x};{y};0.4;{quality.format(number=number % 4)}" for number, (x, y) in enumerate(ACROSS)]
    assert len(imported(tmp_path, v__txt="\n".join(["x;y;u;Quality", *rows]))[0]) == 8


@pytest.mark.parametrize("by", ["hand", "filter"])
def test_rows_that_a_workbook_hides_are_left_out(tmp_path: Path, by: str) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in (["x", "y", "u"], *([x, y, 0.05 if (x, y) == (8, 0.5) else 0.4] for x, y in ACROSS)):
        book.active.append(row)
    book.active.row_dimensions[4].hidden = True
    if by == "filter":
        book.active.auto_filter.ref = "A1:C9"
    front = book.create_sheet("front", 0)
    front.sheet_state = "hidden"
    front.append(["x", "y", "u"])
    front.append([1, 1, 9])
    book.active = 1
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE)
    book.save(folder / "v.xlsx")
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    assert read_observations(case).table["value"].tolist() == [0.4] * 7


@pytest.mark.parametrize(
    ("name", "places"), [("v.txt", "{x:.1f};{y:.1f};{u:.2f}"), ("velocities.csv", "June,A,{x:.0f},{y:.1f},{u:.3f}")]
)
def test_a_second_file_with_the_same_values_is_refused(tmp_path: Path, name: str, places: str) -> None:
    """Rounded, and in another form; files of other values at the same places are repeats, and stay."""
    heading = "x;y;u" if name == "v.txt" else "experiment,section,x,y,u"
    first = "\n".join(["x,y,u", *(f"{x + 0.04},{y + 0.03},{0.4 + n / 90:.4f}" for n, (x, y) in enumerate(ACROSS))])
    for again, off in ((True, 0.0), (False, 0.02)):
        rows = [places.format(x=x, y=y, u=0.4 + n / 90 + off) for n, (x, y) in enumerate(ACROSS)]
        folder = folder_of(tmp_path / f"brook{again}", CHANNEL + JUNE, a__csv=first)
        (folder / name).write_text("\n".join([heading, *rows]), encoding="utf-8")
        if again:
            with pytest.raises(InputError, match=r"a\.csv|v\.txt|velocities\.csv"):
                vegglue.import_folder(folder, tmp_path / "brook.yaml")
        else:
            vegglue.import_folder(folder, tmp_path / "brook.yaml")


@pytest.mark.parametrize("separator", [" ", "\t", ",", ";"])
@pytest.mark.parametrize("names", [['"1"', '"2"', '"3"'], ['"a 1"', '"a 2"', '"b"']])
def test_a_table_of_r_has_names_of_rows(tmp_path: Path, separator: str, names: list[str]) -> None:
    rows = [[name, "5", str(number - 1), f"0.{number}"] for number, name in enumerate(names, 2)]
    (tmp_path / "v.txt").write_text("\n".join(separator.join(one) for one in [['"x"', '"y"', '"u"'], *rows]), "utf-8")
    numbers = read_rows(tmp_path / "v.txt", FileOptions()).numbers
    assert numbers["x"].tolist() == [5.0] * 3
    assert numbers["u"].tolist() == [0.2, 0.3, 0.4]


def test_decimal_commas_between_commas_are_no_names_of_rows(tmp_path: Path) -> None:
    (tmp_path / "v.csv").write_text("x,y,u\n1,5,2.0,0.3\n2,5,2.1,0.3\n3,5,2.2,0.3\n", encoding="utf-8")
    with pytest.raises(InputError, match="row 2"):
        read_rows(tmp_path / "v.csv", FileOptions())


def test_exponents_of_fortran_are_numbers_in_any_table(tmp_path: Path) -> None:
    rows = [f"June,A,8,{y},{u}" for y, u in ((-1, "3.7D-01"), (0, "4.1D-01"), (1, "0.37D+00"))]
    table, _ = imported(tmp_path, velocities__csv="\n".join(["experiment,section,x,y,u", *rows]))
    assert table["value"].tolist() == [0.37, 0.41, 0.37]


DEPTHS = "x [m],y [m],{heading}\n2,0,101\n5,0,100\n8,0,99\n"


@pytest.mark.parametrize(
    ("entry", "heading"), [("{columns: {depth: 'tiefgang [mm]'}}", "tiefgang [mm]"), ("{}", "Water depth [mm]")]
)
def test_depths_are_levels_above_the_bed(tmp_path: Path, entry: str, heading: str) -> None:
    site = CHANNEL + JUNE + f"files: {{d.csv: {entry}}}\n"
    table, _ = imported(tmp_path, site, a__csv="x,y,u\n5,0,0.3\n", d__csv=DEPTHS.format(heading=heading))
    levels = table[table["kind"] == "level"]
    assert levels["value"].tolist() == pytest.approx([0.101 - 0.002, 0.100 - 0.005, 0.099 - 0.008])


def test_depths_stand_on_the_bed_of_their_own_table(tmp_path: Path) -> None:
    table, _ = imported(tmp_path, d__csv="x,y,z_bed,depth\n2,0,0.5,0.1\n5,1,0.4,0.2\n")
    assert table["value"].tolist() == pytest.approx([0.6, 0.6])


def test_the_bed_beside_velocities_is_not_their_height(tmp_path: Path) -> None:
    rows = [f"{x},{y},{0.01 * n},0.4" for n, (x, y) in enumerate([*ACROSS, *ACROSS])]
    table, taken = imported(tmp_path, v__csv="\n".join(["x [m],y [m],z_bed [m],u [m/s]", *rows]))
    assert len(table) == 8
    assert taken.endswith("not read: z_bed [m]")


@pytest.mark.parametrize("surveyed", [False, True])
def test_classes_of_friction_have_coefficients_of_their_own(tmp_path: Path, surveyed: bool) -> None:
    bed = "bed: {file: s.csv, sections: true}\ngrid: {x: [0, 30], y: [-1, 1], cell: [0.5, 0.25]}\nwalls: true\n"
    files = {"areas__csv": "name,class,x,y\ng,short grass,0,-1\ng,short grass,10,-1\ng,short grass,10,0\n"}
    files |= {"a__csv": "x,y,u\n8,0,0.4\n", "s__csv": "section,x,y,z\na,0,-1,0\na,0,1,0\nb,30,-1,0\nb,30,1,0\n"}
    files = files if surveyed else {name: text for name, text in files.items() if name != "s__csv"}
    site = CHANNEL + JUNE + "classes: {file: areas.csv}\n" + (bed if surveyed else "")
    case = vegglue.import_folder(folder_of(tmp_path / "brook", site, **files), tmp_path / "brook.yaml")
    classes = {name: getattr(one, "n", None) for name, one in case.friction.classes.items()}
    assert (classes["bed"], classes["short-grass"]) == ("n_b", "n_short_grass")
    assert {"n_b", "n_short_grass"} <= set(case.parameters)


def test_velocities_of_the_surface_take_a_factor(tmp_path: Path) -> None:
    site = CHANNEL + JUNE + "files: {a.csv: {factor: 0.85, columns: {u: surface velocity}}}\n"
    table, _ = imported(tmp_path, site, a__csv="x,y,surface velocity\n8,0,0.4\n9,0,0.6\n")
    assert table["value"].tolist() == pytest.approx([0.34, 0.51])
    folder = folder_of(tmp_path / "other", site.replace("0.85", "-1"), a__csv="x,y,surface velocity\n8,0,0.4\n")
    with pytest.raises(InputError, match="factor"):
        vegglue.import_folder(folder, tmp_path / "other.yaml")


@pytest.mark.slow
def test_a_floor_of_seven_cells_comes_to_a_verdict(tmp_path: Path) -> None:
    """A seventh of the cells lies on the axis, from which laws of the offset count."""
    site = "channel: {length_m: 20, bottom_width_m: 3.5, bank_slope_v_per_h: 0.5, bed_slope: 0.001}\n"
    site += "grid: {x: [0, 20], y: [-3.75, 3.75], cell: [1, 0.5]}\nfiles: {v.csv: {standard_error: 1 cm/s}}\n"
    site += "experiments: {low: {discharge: 0.7 m3/s, level: 0.48 m}}\n"
    profile = dict(zip((-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5), (0.25, 0.31, 0.35, 0.39, 0.43, 0.36, 0.3), strict=True))
    rows = [f"{name},{x},{y},{u}" for name, x in (("A", 6), ("B", 10), ("C", 14)) for y, u in profile.items()]
    table = "\n".join(["section,x [m],y [m],u [m/s]", *rows])
    case = vegglue.import_folder(folder_of(tmp_path / "brook", site, v__csv=table), tmp_path / "brook.yaml")
    vegglue.diagnose(case, runs=tmp_path / "runs", jobs=1)


RDB = """# U.S. Geological Survey
#  agency_cd  code
agency_cd\tsite_no\tdatetime\ttz_cd\t1_00060\t1_00060_cd
5s\t15s\t20d\t6s\t14n\t10s
USGS\t01\t2020-01-01 00:00\tEST\t10.0\tP
USGS\t01\t2020-01-01 00:15\tEST\t{mark}\tP
USGS\t01\t2020-01-01 00:30\tEST\t12.0\tP
"""


@pytest.mark.parametrize("mark", ["Ice", "Eqp", "***", "-999999", "Bkw", ""])
def test_a_table_of_a_gauging_office_has_a_row_of_types_and_words_for_no_value(tmp_path: Path, mark: str) -> None:
    path = tmp_path / "gauge.txt"
    path.write_text(RDB.format(mark=mark), encoding="utf-8")
    options = FileOptions(columns={"discharge": "1_00060"}, units={"discharge": "cfs"})
    values = read_rows(path, options).numbers["discharge"] / 0.3048**3
    assert values == pytest.approx([10.0, np.nan, 12.0], nan_ok=True)


def test_exponents_of_fortran_are_levels_of_a_bed(tmp_path: Path) -> None:
    grid, points = tmp_path / "bed.asc", tmp_path / "bed.csv"
    grid.write_text("ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1.0D-01 0.2D+00\n3.d-1 0.4\n", "utf-8")
    points.write_text("x,y,z\n0,0,1.0D-01\n1,0,2D-1\n0,1,0.3\n", encoding="utf-8")
    assert read_raster(grid).values.tolist() == [[0.3, 0.1], [0.4, 0.2]]
    assert read_points(points)[:, 2].tolist() == [0.1, 0.2, 0.3]


@pytest.mark.parametrize(
    ("size", "nothing", "level"),
    [("cellsize 2", "null", "null"), ("cellsize 2", "nan", "nan"), ("dx 2\ndy 2", "-9999", "-9999"),
     ("cellsize 2,0", "-9999,0", "-9999,0"), ("dx 2\ndy 2", "-3.4e38", "-3.4e38")],
)  # fmt: skip
def test_grids_as_other_programs_write_them(tmp_path: Path, size: str, nothing: str, level: str) -> None:
    (tmp_path / "bed.asc").write_text(
        f"ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\n{size}\nNODATA_value {nothing}\n{level} 1,5\n1.0 2.0\n", "utf-8"
    )
    raster = read_raster(tmp_path / "bed.asc")
    assert raster.size == 2.0
    np.testing.assert_array_equal(raster.values, [[1.0, np.nan], [2.0, 1.5]])


def test_a_grid_has_the_scale_that_gdal_keeps_beside_it(tmp_path: Path) -> None:
    """Of a terrain in centimetres the ASCII grid holds the stored numbers."""
    text = "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n10012 10013\n10014 10015\n"
    (tmp_path / "bed.asc").write_text(text, encoding="utf-8")
    band = '<PAMDataset><PAMRasterBand band="1"><Offset>0</Offset><Scale>0.01</Scale></PAMRasterBand></PAMDataset>'
    (tmp_path / "bed.asc.aux.xml").write_text(band, encoding="utf-8")
    found = read_terrain(tmp_path / "bed.asc", Placement(), FileOptions(), False)
    assert found.level(np.array([0.5]), np.array([0.5])) == pytest.approx(100.14)


def test_a_grid_of_oblong_cells_is_refused(tmp_path: Path) -> None:
    text = "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ndx 2\ndy 3\n1 1\n1 1\n"
    (tmp_path / "bed.asc").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"bed\.asc"):
        read_raster(tmp_path / "bed.asc")


def test_a_transect_with_decimal_commas_is_read(tmp_path: Path) -> None:
    text = winriver(*BOAT, 2.0, (0.64, -0.48), 0.05)
    found = []
    for name, content in (("a_ASC.TXT", text), ("b_ASC.TXT", text.replace(".", ","))):
        (tmp_path / name).write_text(content, encoding="utf-8")
        found.append(reader_of(tmp_path / name)(tmp_path / name, START).numbers)
    assert found[0]["u_se"].tolist() == found[1]["u_se"].tolist()


def test_a_raw_record_that_begins_with_something_else_has_its_reader(tmp_path: Path) -> None:
    (tmp_path / "t.000").write_bytes(b"\x7f\x79" + pd0(*BOAT, 2.0, (0.64, -0.48), 0.0))
    assert reader_of(tmp_path / "t.000") is read_pd0
