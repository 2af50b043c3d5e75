"""Any field of any format marked as missing, at any place: as good as no row, or refused, or remarked; never a number.

Each format is a list of rows that a sample of it holds, and how they are written. A mark is tried in every column, also
in those that nothing is read from.
"""

import json
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import h5py
import numpy as np
import pytest
from field_folders import CHANNEL, refusal_of
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from instrument_files import VECTRINO_HEADING, flowtracker, pd0, riversurveyor, vector, vectrino, winriver
from matlab_files import BELOW, CELLS, DEPTH, SHAPE
from result_files import a_flow, write_flow_fm, write_hec_ras, write_selafin, write_trim
from scipy.io import netcdf_file, savemat
from scipy.spatial import cKDTree

from vegglue.errors import InputError
from vegglue.importers.file_options import FileOptions, read_file_options
from vegglue.importers.finished_results import read_result
from vegglue.importers.instruments import reader_of
from vegglue.importers.measured_rows import MeasuredRows, Placement, in_the_channel
from vegglue.importers.nortek import read_vector
from vegglue.importers.qrev import read_qrev_summary
from vegglue.importers.stations import KnownExperiments, station_tables
from vegglue.importers.teledyne import read_pd0
from vegglue.importers.terrain import read_terrain
from vegglue.importers.vector_files import planted_polygons, read_line

Row = dict[str, Any]
Stations = list[tuple[float, ...]]
PLACES, DEPTHS, VELOCITIES = [0.5, 1.0, 2.0, 3.0, 3.5], [0.4, 0.5, 0.8, 0.6, 0.4], [0.2, 0.3, 0.5, 0.4, 0.25]
TAPE = {"line": [[12, 2], [12, -2]], "section": "A"}
START, AT = {"start": [10, -1.5], "section": "A"}, {"position": [12, 0.5, 0.3], "section": "A"}
OF_STATIONS = {"x", "y", "z", "height", "u", "v", "level"}
ALONG = np.linspace(0.0, 3.0, 31)
OF_TEXT = ("", "-", "NaN", "-999", "-9999", "9999", "-32768", "1e30", "n/a", "#N/A", "k.A.", "-999999", "Ice")
OF_ARRAYS = (np.nan, -32768.0, -9999.0, 1e30)
SOME = settings(
    max_examples=60, deadline=None, derandomize=True, database=None, phases=[Phase.generate],
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)  # fmt: skip


def without_row(rows: Sequence[Row], number: int, column: str) -> Sequence[Row]:
    return [*rows[:number], *rows[number + 1 :]]


def with_fields(rows: Sequence[Row], number: int, changed: Row) -> Sequence[Row]:
    return [row | changed if place == number else row for place, row in enumerate(rows)]


@dataclass(frozen=True)
class Format:
    """name, options: of a file and what the site file states about it; rows: of a whole file; write: makes one of rows;
    marks: of no value; unread: columns from which nothing is read; less: the rows without what a column of one belongs
    to, the row itself if it is not given.
    """

    name: str
    options: Mapping[str, Any]
    rows: Sequence[Row]
    write: Callable[[Path, Sequence[Row]], None]
    marks: tuple[Any, ...]
    unread: frozenset[str] = field(default_factory=frozenset)
    less: Callable[[Sequence[Row], int, str], Sequence[Row]] = without_row


def text_of(head: str, join: Callable[[Row], str]) -> Callable[[Path, Sequence[Row]], None]:
    """A writer of text: its head, and a line of each row."""
    return lambda path, rows: path.write_text("\n".join([head, *map(join, rows)]) + "\n", encoding="utf-8")


def rows_of_text(lines: Sequence[str], headings: Sequence[str], separator: str | None) -> list[Row]:
    return [dict(zip(headings, line.split(separator), strict=False)) for line in lines]


def _table() -> Format:
    rows = [{"x": "8", "y": f"{-1 + 0.4 * n:.1f}", "u": f"0.{40 + n}", "u_se": "0.01", "Pt": str(n)} for n in range(6)]
    write = text_of("x,y,u,u_se,Pt", lambda row: ",".join(row.values()))
    return Format("a.csv", {"section": "A"}, rows, write, OF_TEXT, frozenset({"Pt"}))


def _points() -> Format:
    rows = [
        {"x": "8", "y": f"{y}", "z": f"{z}", "u": f"{0.3 + 0.2 * z:.2f}", "v": "0.02"}
        for y in (-1, 0, 1) for z in (0.1, 0.3, 0.6)
    ]  # fmt: skip
    return Format("a.txt", {"section": "A"}, rows, text_of("x;y;z;u;v", lambda row: ";".join(row.values())), OF_TEXT)


def _workbook() -> Format:
    def write(path: Path, rows: Sequence[Row]) -> None:
        book = pytest.importorskip("openpyxl").Workbook()
        book.active.append(list(rows[0]))
        for row in rows:
            book.active.append(list(row.values()))
        book.save(path)

    rows = [{"x": 8.0, "y": -1 + 0.4 * n, "u": 0.4 + 0.01 * n, "u_se": 0.01} for n in range(6)]
    return Format("a.xlsx", {"section": "A"}, rows, write, (None, "", -999, 9999, "#N/A", "n/a", 1e30))


def _flowtracker() -> Format:
    lines = flowtracker(PLACES, DEPTHS, VELOCITIES).splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith("St "))
    headings = lines[head].split()
    write = text_of("\n".join(lines[: head + 2]), lambda row: " ".join(row.values()))
    read = {"Loc", "Depth", "MeanV", "Verr", "Npts"}
    marks = tuple(mark for mark in OF_TEXT if mark not in ("", "k.A."))
    return Format(
        "g.dis", TAPE, rows_of_text(lines[head + 2 :], headings, None), write, marks, frozenset({*headings} - read)
    )


def _stationary() -> Format:
    lines = riversurveyor(PLACES, DEPTHS, VELOCITIES).splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith("#\t"))
    headings = lines[head].rstrip("\t").split("\t")
    rows = rows_of_text([line for line in lines[head + 1 :] if "\t" in line], headings, "\t")
    write = text_of("\n".join(lines[: head + 1]), lambda row: "\t".join([*row.values(), ""]))
    unread = frozenset({*headings} - {"Location", "Depth", "Mean Velocity", "% Measured"})
    return Format("s.dis", TAPE, rows, write, OF_TEXT, unread)


def _aquacalc() -> Format:
    headings = ["VERT", "DIST", "TDPTH", "OBS", "TIME", "VVEL"]
    rows = [
        dict(zip(headings, (str(n), f"{2 * at}", f"{depth}", "o6", "40.5", f"{u}"), strict=True))
        for n, (at, depth, u) in enumerate(zip(PLACES, DEPTHS, VELOCITIES, strict=True), 1)
    ]
    head = "<csv>\nAquaCalc Pro (tm)\n\nMeasure standard:, SAE\n\n" + ",".join(headings)
    write = text_of(head, lambda row: ",".join(row.values()))
    return Format("q.csv", TAPE, rows, write, OF_TEXT, frozenset({"VERT", "OBS"}))


def _flowtracker2() -> Format:
    def write(path: Path, rows: Sequence[Row]) -> None:
        stations = []
        for row in rows:
            means = {"MeanVelocityInVertical": {"X": row["u"], "Y": 0.0}, "Samples": row["Samples"],
                     "VelocityStandardError": {"X": row["error"]}}  # fmt: skip
            stations.append({"Location": row["Location"], "Depth": row["Depth"], "VelocityMethod": row["method"],
                             "Calculations": means, "CorrectionFactor": row["factor"]})  # fmt: skip
        with ZipFile(path, "w") as archive:
            archive.writestr("DataFile.json", json.dumps({"Stations": stations}))

    rows = [
        {"Location": at, "Depth": depth, "u": u, "error": 0.01, "Samples": 40, "method": "SixTenths", "factor": 1.0}
        for at, depth, u in zip(PLACES, DEPTHS, VELOCITIES, strict=True)
    ]
    return Format(
        "g.ft", TAPE, rows, write, (None, float("nan"), -9999.0, 1e30), frozenset({"method", "factor", "Samples"})
    )


def _winriver() -> Format:
    lines = winriver(0.0 * ALONG, ALONG, 1.0, (0.6, 0.02), 0.02).splitlines()
    blocks, at = [], 3
    while at < len(lines):
        size = 6 + int(lines[at + 5].split()[0])
        blocks.append(lines[at : at + size])
        at += size
    rows = [
        {f"{line}.{column}": word for line, text in enumerate(block) for column, word in enumerate(text.split())}
        for block in blocks
    ]

    def join(row: Row) -> str:
        words: dict[str, list[str]] = {}
        for key, word in row.items():
            words.setdefault(key.partition(".")[0], []).append(word)
        return "\n".join(map(" ".join, words.values()))

    def less(rows: Sequence[Row], number: int, column: str) -> Sequence[Row]:
        line = column.partition(".")[0]
        if int(line) < 6:  # of the ensemble; depths of beams, of which others remain
            return rows if column in ("1.8", "1.9", "1.10", "1.11") else without_row(rows, number, column)
        kept = {key: word for key, word in rows[number].items() if not key.startswith(f"{line}.")}
        return [kept | {"5.0": str(int(kept["5.0"]) - 1)} if at == number else row for at, row in enumerate(rows)]

    # How many cells there are, their unit and the reference are no measurements.
    read = {"1.0", "2.2", "2.3", *(f"1.{beam}" for beam in range(8, 12)), "5.0", "5.1", "5.2"}
    read |= {f"{line}.{column}" for line in range(6, 20) for column in (0, 3, 4)}
    unread = frozenset({key for row in rows for key in row} - read)
    return Format("t_ASC.TXT", START, rows, text_of("\n".join(lines[:3]), join), ("-32768",), unread, less)


def _riversurveyor_mat() -> Format:
    random = np.random.default_rng(3)
    rows = []
    for n in range(40):
        velocity = {
            f"{axis}{cell}": SHAPE[cell] * mean + 0.02 * random.standard_normal()
            for axis, mean in (("e", 0.6), ("n", 0.02)) for cell in range(CELLS)
        }  # fmt: skip
        rows.append(
            {"east": 0.0, "north": 0.08 * n, "depth": DEPTH, "start": 0.2, "size": 0.1, "cells": CELLS, **velocity}
        )

    def write(path: Path, rows: Sequence[Row]) -> None:
        column = {name: np.array([row[name] for row in rows], dtype=np.float64) for name in rows[0]}
        every, water = np.ones(len(rows)), np.zeros((10, 4, len(rows)))
        for axis, name in enumerate("en"):
            for cell in range(CELLS):
                water[cell, axis] = column[f"{name}{cell}"]
        savemat(path, {
            "Setup": {"coordinateSystem": 2, "trackReference": 1},
            "Summary": {"Depth": column["depth"], "Cells": column["cells"],
                        "Track": np.column_stack([column["east"], column["north"]])},
            "System": {"Cell_Start": column["start"], "Cell_Size": column["size"], "Step": 3 * every},
            "WaterTrack": {"Velocity": water},
        })  # fmt: skip

    def less(rows: Sequence[Row], number: int, column: str) -> Sequence[Row]:
        of_cell = column[1:].isdigit()  # 0 is what the program fills up with
        return (
            with_fields(rows, number, {f"{axis}{column[1:]}": 0.0 for axis in "en"})
            if of_cell
            else without_row(rows, number, column)
        )

    return Format("r.mat", START, rows, write, OF_ARRAYS, less=less)


def _qrev() -> Format:
    random = np.random.default_rng(4)
    rows = [
        {"boat": 0.08, "seconds": 1.0, "bed": DEPTH}
        | {f"e{cell}": SHAPE[cell] * 0.6 + 0.02 * random.standard_normal() for cell in range(CELLS)}
        | {f"below{cell}": BELOW[cell] for cell in range(CELLS)}
        | {f"valid{cell}": 1.0 for cell in range(CELLS)}
        for _ in range(40)
    ]

    def write(path: Path, rows: Sequence[Row]) -> None:
        def cells(name: str) -> np.ndarray:
            return np.array([[row[f"{name}{cell}"] for row in rows] for cell in range(CELLS)], dtype=np.float64)

        def each(name: str) -> np.ndarray:
            return np.array([row[name] for row in rows], dtype=np.float64)

        valid = np.repeat(cells("valid")[..., None], 9, axis=2)
        transect = {
            "checked": 1, "startEdge": "Left", "inTransectIdx": np.arange(1, len(rows) + 1),
            "boatVel": {"selected": "btVel", "btVel": {"uProcessed_mps": 0 * each("boat"),
                                                       "vProcessed_mps": each("boat")}},
            "dateTime": {"ensDuration_sec": each("seconds")},
            "depths": {"selected": "btDepths",
                       "btDepths": {"depthProcessed_m": each("bed"), "depthCellDepth_m": cells("below")}},
            "wVel": {"coordSys": "Earth", "uProcessed_mps": cells("e"), "vProcessed_mps": 0.02 * cells("valid"),
                     "validData": valid},
        }  # fmt: skip
        savemat(path, {"meas_struct": {"stationName": "Mill", "transects": transect}}, oned_as="row")

    def less(rows: Sequence[Row], number: int, column: str) -> Sequence[Row]:
        cell = column[-1]
        cells = range(CELLS) if not cell.isdigit() else [int(cell)]
        return with_fields(rows, number, {f"valid{one}": 0.0 for one in cells})

    return Format("m_QRev.mat", START, rows, write, (np.nan,), less=less)


def _vectrino() -> Format:
    headings = [str(column) for column in range(19)]
    rows = rows_of_text(vectrino((0.4, 0.02, 0.0), 0.03, 200, 0).splitlines(), headings, None)

    def write(path: Path, rows: Sequence[Row]) -> None:
        path.write_text("\n".join(" ".join(row.values()) for row in rows), encoding="utf-8")
        path.with_suffix(".hdr").write_text(VECTRINO_HEADING, encoding="utf-8")

    read = {"3", "4", "5", *map(str, range(15, 19))}
    return Format("p.dat", AT, rows, write, ("NaN", "-32.768", "-999", "99999"), frozenset({*headings} - read))


def _vector() -> Format:
    """Burst, counter, three velocities, amplitudes, ratios and correlations of three beams, pressure, two inputs."""
    random, headings = np.random.default_rng(6), [str(column) for column in range(17)]
    rows = [
        dict(
            zip(
                headings,
                map(str, [1, n + 1, *np.round(at, 4), *[120] * 3, *[20] * 3, *[96] * 3, 1.2, 0, 0]),
                strict=True,
            )
        )
        for n, at in enumerate([0.4, 0.02, 0.0] + 0.03 * random.standard_normal((200, 3)))
    ]

    def write(path: Path, rows: Sequence[Row]) -> None:
        path.write_text("\n".join(" ".join(row.values()) for row in rows), encoding="utf-8")
        path.with_suffix(".hdr").write_text(VECTRINO_HEADING, encoding="utf-8")

    read = {"2", "3", "4", "11", "12", "13"}
    return Format("w.dat", AT, rows, write, ("NaN", "-32.768", "-999", "99999"), frozenset({*headings} - read))


def _profiler() -> Format:
    random = np.random.default_rng(5)
    rows = [
        {f"{axis}{cell}": mean + 0.02 * random.standard_normal() for axis, mean in (("X", 0.3), ("Y", 0.0), ("Z1", 0.0))
         for cell in range(3)} | {f"Cor{cell}": 96.0 for cell in range(3)}
        for _ in range(60)
    ]  # fmt: skip

    def write(path: Path, rows: Sequence[Row]) -> None:
        def cells(name: str) -> np.ndarray:
            return np.array([[row[f"{name}{cell}"] for cell in range(3)] for row in rows], dtype=np.float64)

        data = {f"Profiles_Vel{axis}": cells(axis) for axis in ("X", "Y", "Z1")} | {"Profiles_Range": [0.04, 0.05, 0.2]}
        data |= {f"Profiles_CorBeam{beam}": cells("Cor") for beam in range(1, 5)}
        settings = {"sampleRate": 50.0, "coordSystem": 1}
        savemat(path, {"Data": data, "Config": settings}, long_field_names=True)

    def less(rows: Sequence[Row], number: int, column: str) -> Sequence[Row]:
        return with_fields(rows, number, {f"Cor{column[-1]}": 0.0})

    return Format("v.mat", AT, rows, write, OF_ARRAYS, less=less)


FORMATS = {
    made.__name__[1:]: made
    for made in (_table, _points, _workbook, _flowtracker, _stationary, _aquacalc, _flowtracker2, _winriver,
                 _riversurveyor_mat, _qrev, _vectrino, _vector, _profiler)
}  # fmt: skip


def imported(folder: Path, form: Format, rows: Sequence[Row]) -> tuple[Stations, str] | None:
    """Stations of a file of these rows, and what was taken from it; None if it is refused, in one line that names it.

    A station: number of its kind, x, y, height if it is a point, value.
    """
    folder.mkdir(exist_ok=True)
    path = folder / form.name
    form.write(path, rows)
    known = KnownExperiments(("June",), "site.yaml", "experiments", ())
    options = read_file_options(form.options, form.name)
    try:
        taken = in_the_channel(reader_of(path)(path, options), Placement(), options)
        made = station_tables(taken, path.stem, options, known, Placement(), form.name)
    except InputError as error:
        refused = str(error)
    else:
        refused = ""
    if refused:
        assert len(refused.splitlines()) == 1
        assert form.name in refused
        return None
    found = []
    for number, table in enumerate(made.tables):
        columns = [table.heading.index(name) for name in table.heading if name in OF_STATIONS]
        found += [(float(number), *(float(row[column] or "nan") for column in columns)) for row in table.rows]
    return sorted(found), f"{made.taken}: {taken.summary}"


def alike(one: Stations, other: Stations) -> bool:
    """Whether all numbers are the same, as far as there is one in the first."""
    return len(one) == len(other) and all(
        np.allclose(np.where(np.isnan(a), b, a), b, atol=2e-5, equal_nan=True)
        for a, b in zip(map(np.array, one), map(np.array, other), strict=True)
    )


@pytest.mark.parametrize("name", FORMATS)
@SOME
@given(data=st.data())
def test_a_field_marked_as_missing_is_no_number(tmp_path: Path, name: str, data: st.DataObject) -> None:
    """As without its row, or its cell; or every number is one of the whole file, and what was taken differs."""
    form = FORMATS[name]()
    number = data.draw(st.integers(0, len(form.rows) - 1), label="row")
    column = data.draw(st.sampled_from(sorted(form.rows[number])), label="column")
    mark = data.draw(st.sampled_from(form.marks), label="mark")
    marked = imported(tmp_path / "marked", form, with_fields(form.rows, number, {column: mark}))
    if marked is None:
        return
    whole = imported(tmp_path / "whole", form, form.rows)
    assert whole is not None
    if column in form.unread:
        assert alike(marked[0], whole[0])
        return
    less = imported(tmp_path / "less", form, form.less(form.rows, number, column))
    assert less is not None
    if not alike(marked[0], less[0]):
        known = [*whole[0], *less[0]]
        assert all(any(alike([one], [other]) for other in known) for one in marked[0]), f"{column} = {mark!r}"
        assert marked[1] != whole[1], f"{column} = {mark!r} without a remark"


def _pd0_rows(content: bytes | None = None) -> list[bytes]:
    """Ensembles of a raw transect, each for itself."""
    content, found = content or pd0(0.0 * ALONG, ALONG, 1.5, (0.6, 0.02), 0.02), []
    while content:
        size = int.from_bytes(content[2:4], "little") + 2
        found.append(content[:size])
        content = content[size:]
    return found


def _block(ensemble: bytes, name: int) -> int:
    """Where a block of an ensemble begins, by its number."""
    starts = struct.unpack(f"<{ensemble[5]}H", ensemble[6 : 6 + 2 * ensemble[5]])
    return next(one for one in starts if struct.unpack("<H", ensemble[one : one + 2])[0] == name)


def _with_sum(ensemble: bytes) -> bytes:
    """The ensemble with the check sum that belongs to it."""
    return ensemble[:-2] + struct.pack("<H", sum(ensemble[:-2]) & 0xFFFF)


def _raw_stations(path: Path, content: bytes) -> MeasuredRows:
    pytest.importorskip("mhkit")
    path.write_bytes(content)
    return read_pd0(path, FileOptions(start=(10.0, -1.5)))


@pytest.mark.parametrize("damage", ["sum", "size", "cut", "before", "between"])
def test_a_damaged_ensemble_costs_itself_alone(tmp_path: Path, damage: str) -> None:
    """A wrong check sum made the whole file unreadable, and a wrong size loses what comes after it."""
    rows = _pd0_rows()
    bad = {"sum": rows[8][:-1] + bytes([rows[8][-1] ^ 1]), "size": rows[8][:2] + b"\xff\x70" + rows[8][4:],
           "cut": rows[8][:200]}  # fmt: skip
    changed = [b"$GPGGA,\x7f\x7f"] * (damage == "before") + rows[:8] + [b"\x7f\x7f\x10"] * (damage == "between")
    changed += [bad.get(damage, rows[8]), *rows[9:]]
    found = _raw_stations(tmp_path / "t.000", b"".join(changed))
    whole = _raw_stations(
        tmp_path / "t.000", b"".join(rows if damage in ("before", "between") else rows[:8] + rows[9:])
    )
    for role, values in whole.numbers.items():
        assert found.numbers[role] == pytest.approx(values, nan_ok=True), role
    assert found.notes != whole.notes


def test_cells_of_two_sizes_stand_where_they_were_measured(tmp_path: Path) -> None:
    fine, coarse = (
        _pd0_rows(pd0(0.0 * ALONG, ALONG, 1.5, (0.6, 0.02), 0.0, cell=cell, first=first))
        for cell, first in ((10, 35), (25, 50))
    )
    found = _raw_stations(tmp_path / "t.PD0", b"".join([*fine[:15], *coarse[15:]]))
    apart = [_raw_stations(tmp_path / "t.PD0", b"".join(rows)) for rows in (fine, coarse)]
    for role in ("y", "east_velocity"):
        wanted = np.concatenate([apart[0].numbers[role][:15], apart[1].numbers[role][15:]])
        assert found.numbers[role] == pytest.approx(wanted, abs=2e-3), role


@pytest.mark.parametrize(("block", "place"), [(0x100, 2), (0x600, 24)])
def test_a_lost_beam_of_four_is_known_by_the_others(tmp_path: Path, block: int, place: int) -> None:
    """In coordinates of the beams, if the file allows it: the velocity that has no error."""
    of_beams = []
    for ensemble in _pd0_rows():
        changed = bytearray(ensemble)
        changed[_block(ensemble, 0) + 25] = 0x07
        cells = np.frombuffer(ensemble, "<i2", 4 * 30, _block(ensemble, 0x100) + 2).reshape(-1, 4).copy()
        cells[cells[:, 0] != -32768] = [200, -100, 140, -40]
        at = _block(ensemble, 0x100) + 2
        changed[at : at + cells.nbytes] = cells.tobytes()
        struct.pack_into("<4h", changed, _block(ensemble, 0x600) + 24, -30, 20, -40, 30)
        of_beams.append(_with_sum(bytes(changed)))
    lost = []
    for ensemble in of_beams:
        changed = bytearray(ensemble)
        for cell in range(6 if block == 0x100 else 1):
            struct.pack_into("<h", changed, _block(ensemble, block) + place + 8 * cell + 2, -32768)
        lost.append(_with_sum(bytes(changed)))
    whole, less = (_raw_stations(tmp_path / "t.PD0", b"".join(rows)) for rows in (of_beams, lost))
    for role in ("x", "y", "east_velocity", "north_velocity"):
        assert less.numbers[role] == pytest.approx(whole.numbers[role], abs=1e-6), role


# Fields of an ensemble: the block, the place in it [bytes], and the mark of the format.
PD0_FIELDS = {
    **{f"velocity{beam} of cell {cell}": (0x100, 2 + 8 * cell + 2 * beam, b"\0\x80")
       for cell in range(4) for beam in range(4)},
    **{f"range{beam}": (0x600, 16 + 2 * beam, b"\0\0") for beam in range(4)},
    **{f"bottom{beam}": (0x600, 24 + 2 * beam, b"\0\x80") for beam in range(4)},
    "depth of the transducer": (0x80, 16, b"\0\x80"),
    "salinity": (0x80, 24, b"\xff\xff"),
}  # fmt: skip


@settings(SOME, max_examples=15)
@given(number=st.integers(0, ALONG.size - 1), name=st.sampled_from(sorted(PD0_FIELDS)))
def test_a_field_marked_as_missing_in_a_raw_record_is_no_number(tmp_path: Path, number: int, name: str) -> None:
    """The ensemble is left out, or its velocity is that of its other cells, 0.02 m/s apart."""
    ensembles = _pd0_rows()
    block, place, mark = PD0_FIELDS[name]
    changed = bytearray(ensembles[number])
    at = _block(ensembles[number], block) + place
    changed[at : at + 2] = mark

    def stations(rows: Sequence[bytes]) -> Stations:
        taken = _raw_stations(tmp_path / "t.PD0", b"".join(rows))
        roles = ("x", "y", "east_velocity", "north_velocity")
        return list(zip(*(taken.numbers[role].tolist() for role in roles), strict=True))

    marked = stations([*ensembles[:number], _with_sum(bytes(changed)), *ensembles[number + 1 :]])
    known = [*stations(ensembles), *stations([*ensembles[:number], *ensembles[number + 1 :]])]
    assert len(marked) >= ALONG.size - 1
    assert all(any(np.allclose(one, other, atol=0.025) for other in known) for one in marked)


@settings(SOME, max_examples=20)
@given(
    column=st.integers(0, 5), row=st.integers(0, 4), mark=st.sampled_from(["declared", "-9999", "-3.4e38", "1e20"]),
    ending=st.sampled_from([".asc", ".tif"]),
)  # fmt: skip
def test_a_pixel_marked_as_missing_is_no_level(tmp_path: Path, column: int, row: int, mark: str, ending: str) -> None:
    levels = 100.0 + 0.1 * np.arange(30, dtype=np.float32).reshape(5, 6)
    marked = levels.copy()
    marked[row, column] = np.float32("-99999" if mark == "declared" else mark)
    path = tmp_path / f"bed{ending}"
    if ending == ".tif":
        tags = [(33550, 12, 3, (2.0, 2.0, 0.0), False), (33922, 12, 6, (0.0, 0.0, 0.0, 0.0, 10.0, 0.0), False)]
        pytest.importorskip("tifffile").imwrite(path, marked, extratags=[*tags, (42113, 2, 7, "-99999", False)])
    else:
        rows = "\n".join(" ".join(f"{value:.9g}" for value in line) for line in marked)
        path.write_text(f"ncols 6\nnrows 5\nxllcorner 0\nyllcorner 0\ncellsize 2\nNODATA_value -99999\n{rows}\n")
    found = read_terrain(path, Placement(), FileOptions(), False)
    x, y = (part.ravel() for part in np.meshgrid(1.0 + 2.0 * np.arange(6), 9.0 - 2.0 * np.arange(5)))
    known = np.ones(30, dtype=bool)
    known[6 * row + column] = False
    at = found.level(x, y)
    assert np.isnan(at[~known]).all()
    assert np.allclose(at[known & np.isfinite(at)], levels.ravel()[known & np.isfinite(at)], atol=1e-3)
    # Next to it a reader of linear levels has none either, further away it has.
    assert np.isfinite(at).sum() >= 21


@SOME
@given(row=st.integers(0, 11), column=st.sampled_from("xyz"), mark=st.sampled_from(OF_TEXT), sections=st.booleans())
def test_a_point_of_the_bed_marked_as_missing_is_none(
    tmp_path: Path, row: int, column: str, mark: str, sections: bool
) -> None:
    rows = [{"section": f"s{n // 4}", "x": f"{5.0 * (n // 4)}", "y": f"{n % 4 - 1.5}", "z": f"{1.0 + 0.01 * n:.2f}"}
            for n in range(12)]  # fmt: skip

    def level(rows: Sequence[Row]) -> np.ndarray | None:
        path = tmp_path / "bed.csv"
        path.write_text("\n".join(["section,x,y,z", *(",".join(one.values()) for one in rows)]), encoding="utf-8")
        try:
            found = read_terrain(path, Placement(), FileOptions(), sections)
        except InputError as error:
            return None if "bed.csv" in str(error) else np.zeros(0)
        x, y = (part.ravel() for part in np.meshgrid([0.0, 4.0, 9.0], [-1.0, 0.0, 1.2]))
        return found.level(x, y)

    marked = level(with_fields(rows, row, {column: mark}))
    less = level(without_row(rows, row, column))
    assert less is not None
    assert marked is None or np.allclose(marked, less, equal_nan=True)


@SOME
@given(
    which=st.integers(0, 2),
    column=st.sampled_from(["stems", "name", "x", "y"]),
    ending=st.sampled_from([".geojson", ".shp", ".csv"]),
    mark=st.sampled_from([None, float("nan"), -9999.0, 9999.0, 1e30]),
)
def test_a_patch_with_a_mark_is_refused_or_as_the_others(
    tmp_path: Path, which: int, column: str, ending: str, mark: float | None
) -> None:
    """Without a name it has a number; without stems or a corner it is refused."""
    squares = [{"name": f"p{n}", "stems": 20.0 + n, "ring": [[4 * n, 0], [4 * n, 2], [4 * n + 2, 2], [4 * n + 2, 0]]}
               for n in range(3)]  # fmt: skip
    one = squares[which]
    if column in ("x", "y"):
        one["ring"][1]["xy".index(column)] = mark
    else:
        one[column] = mark
    path = tmp_path / f"p{ending}"
    if ending == ".geojson":
        features = [{"type": "Feature", "properties": {"name": each["name"], "stems": each["stems"]},
                     "geometry": {"type": "Polygon", "coordinates": [each["ring"]]}} for each in squares]  # fmt: skip
        path.write_text(json.dumps({"type": "FeatureCollection", "features": features}), encoding="utf-8")
    elif ending == ".csv":
        rows = [f"{each['name']},{each['stems']},{x},{y}" for each in squares for x, y in each["ring"]]
        path.write_text("\n".join(["name,stems,x,y", *rows]).replace("None", ""), encoding="utf-8")
    else:
        shapefile = pytest.importorskip("shapefile")
        if (column in ("x", "y") and mark is None) or column == "name":
            return
        with shapefile.Writer(str(path)) as writer:
            writer.field("name", "C")
            writer.field("stems", "N", size=33, decimal=1)
            for each in squares:
                writer.poly([[*each["ring"], each["ring"][0]]])
                writer.record(each["name"], each["stems"])
    if column == "name":
        assert [each.density for each in planted_polygons(path, None)] == [20.0, 21.0, 22.0]
    else:
        with pytest.raises(InputError, match=path.name):
            planted_polygons(path, None)


@pytest.mark.parametrize("mark", ["null", "-999", "-9999", "9999", "-32768", "1.0e+30", ".nan", "''", "n/a"])
@pytest.mark.parametrize("key", ["discharge", "level"])
def test_a_flow_marked_as_missing_in_a_site_file_is_refused(tmp_path: Path, key: str, mark: str) -> None:
    flow = {"discharge": "2.0", "level": "0.95"} | {key: mark}
    site = CHANNEL + f"experiments: {{June: {{discharge: {flow['discharge']}, level: {flow['level']}}}}}\n"
    assert "June" in refusal_of(tmp_path, site, a__csv="x,y,u\n8,0,0.4\n9,0,0.4\n")


@settings(SOME, max_examples=15)
@given(sample=st.integers(0, 319), axis=st.integers(0, 2), mark=st.sampled_from([-32768, 32767, -9999]))
def test_a_sample_marked_as_missing_in_a_vector_record_is_none(
    tmp_path: Path, sample: int, axis: int, mark: int
) -> None:
    """The mean is that of the others: with the sample it would be off by 0.03 m/s and more."""
    pytest.importorskip("mhkit")
    content, path = vector((0.4, 0.02, 0.0), 0.03, 320, 0), tmp_path / "p.vec"
    path.write_bytes(content)
    whole = read_vector(path, FileOptions(position=(12.0, 0.5, 0.3)))
    starts = [at for at in range(len(content) - 1) if content[at : at + 2] == b"\xa5\x10"]
    block = bytearray(content[starts[sample] : starts[sample] + 24])
    struct.pack_into("<h", block, 10 + 2 * axis, mark)
    struct.pack_into("<H", block, 22, (0xB58C + sum(struct.unpack("<11H", block[:22]))) & 0xFFFF)
    path.write_bytes(content[: starts[sample]] + bytes(block) + content[starts[sample] + 24 :])
    marked = read_vector(path, FileOptions(position=(12.0, 0.5, 0.3)))
    for role in ("u", "v"):
        assert marked.numbers[role] == pytest.approx(whole.numbers[role], abs=1e-3)
    assert marked.notes != whole.notes


def _marked_in_hdf5(path: Path, name: str, place: tuple[int, ...], mark: float) -> None:
    with h5py.File(path, "r+") as file:
        file[name][place] = mark


def _marked_in_netcdf(path: Path, name: str, place: tuple[int, ...], mark: float) -> None:
    with netcdf_file(path, "a", mmap=False) as file:
        values = file.variables[name][:].copy()
        values[place] = mark
        file.variables[name][:] = values


SERIES_OF_AREA = "Results/Unsteady/Output/Output Blocks/Base Output/Unsteady Time Series/2D Flow Areas/reach"
# Of each finished result: its file, how it is written and marked, and where fields of cell 17 or face 17 stand in it.
RESULTS: dict[str, tuple[str, Any, Any, dict[str, tuple[int, ...]]]] = {
    "HEC-RAS": (
        "reach.p01.hdf", write_hec_ras, _marked_in_hdf5,
        {f"{SERIES_OF_AREA}/Water Surface": (-1, 17), f"{SERIES_OF_AREA}/Face Velocity": (-1, 17),
         "Geometry/2D Flow Areas/reach/Cells Minimum Elevation": (17,),
         "Geometry/2D Flow Areas/reach/Cells Center Manning's n": (17,)},
    ),
    "D-Flow FM": (
        "reach_map.nc", partial(write_flow_fm, classic=False), _marked_in_hdf5,
        {f"mesh2d_{name}": (-1, 17) for name in ("s1", "waterdepth", "ucx", "ucy", "czs")}
        | {f"mesh2d_{name}": (17,) for name in ("flowelem_bl", "face_x")},
    ),
    "Delft3D-4": (
        "trim-reach.nc", write_trim, _marked_in_netcdf,
        {"S1": (-1, 4, 3), "U1": (-1, 0, 4, 3), "V1": (-1, 0, 4, 3), "DPS0": (4, 3), "XZ": (4, 3)},
    ),
}  # fmt: skip


@settings(SOME, max_examples=40)
@given(
    of=st.sampled_from([(code, name) for code, made in RESULTS.items() for name in made[3]]),
    mark=st.sampled_from([np.nan, -999.0, -9999.0, 1e31]),
)
def test_a_field_of_a_finished_result_marked_as_missing_is_no_number(
    tmp_path: Path, of: tuple[str, str], mark: float
) -> None:
    """The place is left out or dry, and counted, or has the values that its other faces give; all others are as they
    were.
    """
    code, name = of
    file, write, set_mark, fields = RESULTS[code]
    path, flow = tmp_path / file, a_flow()
    write(path, flow)
    whole = read_result(path)
    set_mark(path, name, fields[name], mark)
    marked = read_result(path)
    there = cKDTree(np.column_stack([whole.x, whole.y])).query(np.column_stack([marked.x, marked.y]))[1]
    changed = np.zeros(marked.x.size, bool)
    for key in ("bed", "depth", "level", "u", "v"):
        changed |= ~np.isclose(getattr(marked, key), getattr(whole, key)[there], atol=1e-3, equal_nan=True)
    gone = whole.x.size - marked.x.size
    assert gone <= 2, "a face has two cells"
    assert np.abs(marked.u[changed] - whole.u[there][changed]).max(initial=0.0) < 1.0
    # A cell with one face less has the velocity of the others, 0.01 m/s apart in this flow; else it is dry.
    dry = changed & (marked.depth == 0.0)
    assert dry.sum() + gone <= 2
    assert (np.abs(marked.u - whole.u[there])[changed & ~dry] < 0.02).all()
    if dry.any() or (gone and not name.endswith(("Elevation", "bl", "face_x", "DPS0", "XZ"))):
        assert marked.notes != whole.notes


@SOME
@given(field_of=st.sampled_from(["bed", "u", "v"]), place=st.integers(0, 71))
def test_a_node_of_a_selafin_file_without_a_value_is_left_out(tmp_path: Path, field_of: str, place: int) -> None:
    flow, path = a_flow(), tmp_path / "reach.slf"
    write_selafin(path, flow)
    whole = read_result(path)
    values = getattr(flow, field_of).copy()
    values.ravel()[place] = np.nan
    write_selafin(path, replace(flow, **{field_of: values}))
    marked = read_result(path)
    there = cKDTree(np.column_stack([whole.x, whole.y])).query(np.column_stack([marked.x, marked.y]))[1]
    for key in ("bed", "depth", "level", "u", "v"):
        np.testing.assert_allclose(getattr(marked, key), getattr(whole, key)[there], atol=1e-6, equal_nan=True)
    wet = flow.depth.ravel()[place] > 0.0
    assert marked.x.size < whole.x.size or (field_of in ("u", "v") and not wet)


@pytest.mark.parametrize("mark", ["", "NaN", "-999", "-9999", "1e30", "n/a"])
@pytest.mark.parametrize("name", ["Discharge", "Uncertainty"])
def test_a_summary_of_qrev_without_a_value_has_none(tmp_path: Path, mark: str, name: str) -> None:
    """Without the discharge, or with words, it is refused; without its uncertainty the discharge has no error."""
    values = {"Discharge": "2.4", "Uncertainty": "6.0"} | {name: mark}
    parts = "".join(f'<{key}><Total unitsCode="cms">{value}</Total></{key}>' for key, value in values.items())
    path = tmp_path / "m_QRev.xml"
    path.write_text(f'<Channel QRevFilename="m"><ChannelSummary>{parts}</ChannelSummary></Channel>', encoding="utf-8")
    options = FileOptions(start=(10.0, 0.0))
    if name == "Discharge" or mark == "n/a":
        with pytest.raises(InputError, match=r"m_QRev\.xml"):
            read_qrev_summary(path, options)
    else:
        assert np.isnan(read_qrev_summary(path, options).numbers["discharge_se"]).all()


@SOME
@given(
    place=st.integers(0, 3), axis=st.integers(0, 1), mark=st.sampled_from([None, float("nan"), -9999.0, -999.0, 1e30])
)
def test_a_centreline_with_a_mark_is_refused(tmp_path: Path, place: int, axis: int, mark: Any) -> None:
    corners: list[list[Any]] = [[0.0, 0.0], [20.0, 1.0], [40.0, 0.0], [60.0, -2.0]]
    corners[place][axis] = mark
    path = tmp_path / "axis.geojson"
    geometry = {"type": "LineString", "coordinates": corners}
    path.write_text(json.dumps({"type": "Feature", "properties": {}, "geometry": geometry}), encoding="utf-8")
    with pytest.raises(InputError, match=r"axis\.geojson"):
        read_line(path)
