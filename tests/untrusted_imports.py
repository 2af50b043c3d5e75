"""Readers of what `import` takes from elsewhere: for each a valid file, and what reads it to the end."""

import json
from collections.abc import Callable
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZipFile

import numpy as np
import openpyxl
import shapefile
import tifffile
from instrument_files import VECTRINO_HEADING, flowtracker, riversurveyor, vectrino, winriver
from matlab_files import profiler_mat, qrev_mat, riversurveyor_mat
from result_files import GridFlow, write_flow_fm, write_hec_ras, write_selafin, write_trim, write_velocimetry
from scipy.io import savemat

from vegglue.importers.confluence import OF_THE_SET
from vegglue.importers.file_options import FileOptions
from vegglue.importers.finished_results import read_result
from vegglue.importers.instruments import reader_of
from vegglue.importers.library_files import load_matlab
from vegglue.importers.measured_rows import Placement, read_rows
from vegglue.importers.terrain import read_terrain
from vegglue.importers.vector_files import read_line, read_polygons

OF_TABLES = FileOptions(experiment="low", standard_error={"m/s": 0.01})
WORDS = replace(OF_TABLES, line=((0.0, 0.0), (0.0, 9.0)), start=(0.0, 0.0), position=(1.0, 0.0, 0.3))
PLACES, DEPTHS, VELOCITIES = [1.0, 2.0, 3.0], [0.5, 0.7, 0.6], [0.3, 0.4, 0.2]
SQUARE = [[0.0, 0.0], [0.0, 2.0], [2.0, 2.0], [2.0, 0.0], [0.0, 0.0]]
GEOJSON = (
    b'{"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {"stems": 20, "class": "bank"}, '
    b'"geometry": {"type": "Polygon", "coordinates": [[[0, 0], [0, 2], [2, 2], [2, 0], [0, 0]]]}}]}'
)

LINE = b'{"type": "Feature", "geometry": {"type": "LineString", "coordinates": [[0, 0], [500, 0], [900, 30]]}}'
SUMMARY = (
    b'<?xml version="1.0"?><Channel QRevFilename="a"><ChannelSummary><Discharge><Total unitsCode="cms">2</Total>'
    b"</Discharge><Uncertainty><Total>8</Total></Uncertainty></ChannelSummary></Channel>"
)
AQUACALC = (
    b"<csv>\nAquaCalc Pro (tm)\n\nMeasure standard:, SAE\n\nVERT,DIST,TDPTH,OBS,TIME,VVEL\n"
    b"1,0,0,E,,0\n2,1,0.5,o6,40,0.4\n3,2,0.6,o6,41,0.5\n"
)
PRJ = b'PROJCS["RD_New",GEOGCS["GCS_Amersfoort",UNIT["Degree",0.0174532925199433]],UNIT["Meter",1.0]]'


def _workbook() -> bytes:
    book, content = openpyxl.Workbook(), BytesIO()
    for row in (["x", "y", "u"], ["m", "m", "m/s"], [1.0, 0.0, 0.3], [1.0, 1.0, 0.4]):
        book.active.append(row)
    book.save(content)
    return content.getvalue()


def _geotiff() -> bytes:
    content = BytesIO()
    of_map = [(33550, 12, 3, (2.0, 2.0, 0.0), False), (33922, 12, 6, (0.0, 0.0, 0.0, 0.0, 6.0, 0.0), False)]
    tags = [*of_map, (42113, 2, 6, "-9999", False)]
    tifffile.imwrite(content, np.arange(6, dtype=np.float32).reshape(3, 2), extratags=tags)
    return content.getvalue()


def _shapes() -> dict[str, bytes]:
    with TemporaryDirectory() as folder:
        with shapefile.Writer(str(Path(folder) / "p.shp")) as writer:
            writer.field("stems", "N", decimal=1)
            writer.poly([SQUARE])
            writer.record(20.0)
        return {path.suffix: path.read_bytes() for path in Path(folder).iterdir()}


def _matlab() -> bytes:
    content = BytesIO()
    savemat(content, {"X": np.ones((2, 2)), "Y": np.eye(2)}, do_compression=True)
    return content.getvalue()


def _made(make: Callable[[Path], None]) -> bytes:
    """What a function writes into a file."""
    with TemporaryDirectory() as folder:
        make(Path(folder) / "made")
        return (Path(folder) / "made").read_bytes()


def _gauging() -> bytes:
    """Three verticals, as a FlowTracker2 packs them."""
    content = BytesIO()
    stations = [{"Location": at, "Depth": 0.5, "Calculations": {"MeanVelocityInVertical": {"X": 0.3}}} for at in PLACES]
    with ZipFile(content, "w") as packed:
        packed.writestr("DataFile.json", json.dumps({"Stations": stations}))
    return content.getvalue()


def _measured(path: Path) -> object:
    path.with_suffix(".hdr").write_text(VECTRINO_HEADING, encoding="utf-8")
    return reader_of(path)(path, WORDS)


def _beside(path: Path) -> object:
    """One file of a shapefile, the others whole."""
    for ending, content in SHAPES.items():
        if ending != path.suffix:
            path.with_suffix(ending).write_bytes(content)
    return read_polygons(path.with_suffix(".shp"), None)


SHAPES = _shapes()
# Three by two cells of water at 1 m/s.
ONES = np.ones((3, 2))
FLUME = GridFlow(np.arange(4.0), np.arange(3.0), 0.0 * ONES, ONES, ONES, 0.0 * ONES, 0.03 * ONES)
EAST, NORTH = np.linspace(0.0, 8.0, 20), np.zeros(20)
IMAGES = np.full((4, 2, 3), 0.3)
IMPORTS: tuple[tuple[str, bytes, Callable[[Path], object]], ...] = (
    ("table.xlsx", _workbook(), lambda path: read_rows(path, OF_TABLES)),
    ("table.txt", b"x;y;u\nm;m;cm/s\n1,5;0;30\n1,5;1;40\n", lambda path: read_rows(path, OF_TABLES)),
    ("bed.tif", _geotiff(), lambda path: read_terrain(path, Placement(), OF_TABLES, False)),
    (
        "sections.csv",
        b"x,y,z\n0,-1,1\n0,1,1\n9,-1,1\n9,1,1\n",
        lambda path: read_terrain(path, Placement(), OF_TABLES, True),
    ),
    ("patches.shp", SHAPES[".shp"], _beside),
    ("patches.dbf", SHAPES[".dbf"], _beside),
    ("patches.geojson", GEOJSON, lambda path: read_polygons(path, None)),
    ("river.mat", _made(lambda path: riversurveyor_mat(path, "m")), _measured),
    ("qrev.mat", _made(lambda path: qrev_mat(path, transects=1)), _measured),
    ("profiler.mat", _made(lambda path: profiler_mat(path, np.full(2, 0.3))), _measured),
    ("summary.xml", SUMMARY, _measured),
    ("maps.mat", _matlab(), lambda path: load_matlab(path, OF_THE_SET, ("X", "Y"))),
    ("mill.csv", AQUACALC, _measured),
    ("patches.prj", PRJ, _beside),
    ("tracker.dis", flowtracker(PLACES, DEPTHS, VELOCITIES).encode(), _measured),
    ("surveyor.dis", riversurveyor(PLACES, DEPTHS, VELOCITIES).encode(), _measured),
    ("probe.dat", vectrino((0.3, 0.0, 0.0), 0.02, 40, 2).encode(), _measured),
    ("gauging.ft", _gauging(), _measured),
    ("line.geojson", LINE, read_line),
    ("plan.hdf", _made(lambda path: write_hec_ras(path, FLUME)), read_result),
    ("reach.slf", _made(lambda path: write_selafin(path, FLUME)), read_result),
    ("map.nc", _made(lambda path: write_flow_fm(path, FLUME)), read_result),
    ("map4.nc", _made(lambda path: write_flow_fm(path, FLUME, classic=False)), read_result),
    ("trim.nc", _made(lambda path: write_trim(path, FLUME)), read_result),
    ("piv.nc", _made(lambda path: write_velocimetry(path, IMAGES, 0.1 * IMAGES, 0.5)), _measured),
    ("boat.txt", winriver(EAST, NORTH, 1.0, (0.1, 0.4), 0.01).encode(), _measured),
)
