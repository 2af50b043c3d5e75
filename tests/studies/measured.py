"""Published measurements through the loop, from the files as their authors ship them: docs/measured.md.

`make measured DATA=folder`, the folder with copies of the repositories under their names (see `SETS` for the files).
Nothing of them is kept but what the loop said and errors of the models.
"""

import argparse
import csv
import io
import shutil
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.case.config import load_case
from vegglue.diagnosis.comparison import excluded_by, held_out_rmse, model_score
from vegglue.importers.file_options import FileOptions
from vegglue.importers.terrain import read_geotiff
from vegglue.importers.velocimetry import read_velocimetry
from vegglue.results.verdict import Verdict
from vegglue.workflow.case_run import CaseRun, calibrated
from vegglue.workflow.diagnose import diagnose
from vegglue.workflow.extend import extend_stepwise
from vegglue.workflow.import_folder import import_folder

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "measured.md"
BEGIN, END = "<!-- numbers by make measured -->", "<!-- end of numbers -->"


@dataclass(frozen=True)
class MeasuredSet:
    """folder: makes the folder that is imported from that of the data; known: what is known, and by whom; right:
    effects that state it; nearly: those that state a part of it, or its place.
    """

    name: str
    files: str
    folder: Callable[[Path, Path], Path]
    known: str
    right: tuple[str, ...]
    nearly: tuple[str, ...] = ()


# A. Compound channel of the HHLab: 18 m by 3 m, a main channel of 1 m of glass between floodplains of artificial grass
# 0.117 m higher, a slope of 1.1e-3; velocities over half of the width.
COMPOUND = "data/data-raw/HHLab/compound_single_friction/case_08"
STEP, COMPOUND_SLOPE, COMPOUND_LENGTH = 0.117, 1.1e-3, 18.0


def _rows(path: Path) -> list[list[float]]:
    """Rows of numbers of a table whose first line is a title and whose second names the columns."""
    with path.open(encoding="utf-8") as file:
        found = list(csv.reader(file))[2:]
    return [[float(word) for word in row[:3]] for row in found if row]


def compound_discharge(data: Path) -> float:
    """Q = 2 sum over half of the width of u h dy, the mean of the sections from x = 4 m on, where the flow has settled
    [m3/s].
    """
    velocity = _rows(data / COMPOUND / "Mean_Velocity_Qf_08_at_z_star_0p94_x_star_various.csv")
    found = []
    for x in sorted({row[0] for row in velocity if row[0] > 4.0}):
        y, u = np.array([row[1:] for row in velocity if row[0] == x and np.isfinite(row[2])]).T
        at = np.linspace(0.0, 1.5, 601)
        depth = np.where(at < 1.0, 0.0306, 0.148)
        speed = np.interp(at, np.concatenate([[0.0], y / 1000.0]), np.concatenate([[0.0], u / 100.0]))
        found.append(2.0 * float(np.trapezoid(speed * depth, at)))
    return float(np.mean(found))


def compound_channel(surfaces: int) -> Callable[[Path, Path], Path]:
    """The folder of the compound channel; surfaces: 1 as one bed, 2 with a class of its own for the grass."""

    def folder(data: Path, to: Path) -> Path:
        shutil.rmtree(to, ignore_errors=True)
        to.mkdir(parents=True)
        shutil.copy(data / COMPOUND / "Mean_Velocity_Qf_08_at_z_star_0p94_x_star_various.csv", to / "velocities.csv")
        rows = []
        for name, above in (
            ("Flowdepth_FP_Qf_08_at_y_star_0p3_and_0p7.csv", STEP),
            ("Flowdepth_MC_Qf_08_at_y_star_1p2_1p5_1p8.csv", 0.0),
        ):
            found = np.array(_rows(data / COMPOUND / name))
            for x in np.unique(found[:, 1]):
                there = found[found[:, 1] == x]
                # All positions across together: single depths stray by 1 mm of standing waves.
                rows.append((x, there[:, 2].mean() / 1000.0 + above - COMPOUND_SLOPE * x, above))
        # One gauge every metre, from main channel and floodplain together.
        lines = ["section,x,y,level,level_se"]
        for x in range(2, 18):
            near = [level for at, level, _ in rows if abs(at - x) <= 0.5]
            lines.append(f"gauge{x},{x},1.5,{np.mean(near):.5f},0.0004")
        (to / "levels.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        bed = ["x,y,z"]
        across = ((0.0, STEP), (0.99, STEP), (1.01, 0.0), (1.99, 0.0), (2.01, STEP), (3.0, STEP))
        for x in np.arange(0.0, COMPOUND_LENGTH + 0.1, 1.0):
            bed += [f"{x:g},{y:g},{z - COMPOUND_SLOPE * x:.5f}" for y, z in across]
        (to / "bed.csv").write_text("\n".join(bed) + "\n", encoding="utf-8")
        outlet = float(np.mean([level for at, level, _ in rows if at > 17.0])) - COMPOUND_SLOPE * 0.5
        grass = ""
        if surfaces == 2:
            grass = "classes: {file: grass.csv}\n"
            lines = ["name,class,x,y"]
            for name, low, high in (("right", 0.0, 1.0), ("left", 2.0, 3.0)):
                lines += [f"{name},grass,{x},{y}" for x, y in ((0, low), (18, low), (18, high), (0, high))]
            (to / "grass.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        (to / "site.yaml").write_text(
            "bed: {file: bed.csv, sections: true}\nwalls: 0.010\n"
            "grid: {x: [0, 18], y: [0, 3], cell: [0.25, 0.05]}\n"
            f"experiments: {{'08': {{discharge: {compound_discharge(data):.4f}, level: {outlet:.4f}}}}}\n"
            'files: {velocities.csv: {standard_error: 1 cm/s, columns: {x: "x* (m)"}}}\n' + grass,
            encoding="utf-8",
        )
        return to

    return folder


# B. Smooth rectangular flume of the HHLab, 2 m wide, 1.04e-3: mean velocity of either half and its depth at nine
# sections, four discharges.
SMOOTH, SMOOTH_SLOPE, SMOOTH_LENGTH = "data/data-raw/HHLab/smooth_bed", 1.04e-3, 18.0
SMOOTH_FLOWS = ("07_07", "15_15", "30_30", "60_60")


def smooth_flume(data: Path, to: Path) -> Path:
    """The folder of the smooth flume."""
    shutil.rmtree(to, ignore_errors=True)
    to.mkdir(parents=True)
    velocity, level, flows = ["experiment,section,x,y,u,u_se"], ["experiment,section,x,y,level,level_se"], []
    for case in SMOOTH_FLOWS:
        path = data / SMOOTH / f"case_{case}" / f"case_{case}_mixing_layer_mean_flow_parameters.csv"
        table = {}
        for row in csv.reader(path.read_text(encoding="utf-8").splitlines(), delimiter=";"):
            if row and row[1:] and row[1] != "ND":
                table[row[0]] = np.array([float(word) for word in row[1:]])
        # U1 and U2 are those between the layers of the walls, 10 % above Q / (B h): what they carry is taken for Q.
        carried = [np.mean(table[f"U{side} (cm/s)"][1:] * table[f"h{side} (mm)"][1:]) / 1e5 for side in "12"]
        x, name = table["x (m)"], f"q{case[:2]}"
        for side, y in (("1", -0.5), ("2", 0.5)):
            for at, u, h in zip(x, table[f"U{side} (cm/s)"], table[f"h{side} (mm)"], strict=True):
                if at > 0.5:
                    velocity.append(f"{name},x{at:g},{at:g},{y},{u / 100.0:.5f},0.008")
                    level.append(f"{name},x{at:g},{at:g},{y},{h / 1000.0 - SMOOTH_SLOPE * at:.5f},0.001")
        last = float(np.mean([table["h1 (mm)"][-1], table["h2 (mm)"][-1]])) / 1000.0
        flows.append(f"  {name}: {{discharge: {sum(carried):.5f}, level: {last - SMOOTH_SLOPE * SMOOTH_LENGTH:.5f}}}")
    (to / "velocities.csv").write_text("\n".join(velocity) + "\n", encoding="utf-8")
    (to / "levels.csv").write_text("\n".join(level) + "\n", encoding="utf-8")
    (to / "site.yaml").write_text(
        f"channel: {{length_m: {SMOOTH_LENGTH:g}, bottom_width_m: 2.0, bed_slope: {SMOOTH_SLOPE:g}}}\nwalls: 0.010\n"
        "experiments:\n" + "\n".join(flows) + "\n",
        encoding="utf-8",
    )
    return to


# C. Tidal reach of the San Joaquin above the Head of Old River: averaged boat sections and a DEM of 2 m; seven of the
# nine sections lie in the straight reach, two in the branches below.
TRACKS, DEM = "field/hor_yaps/adcp_2018", "bathy/adcp-rbf-med3.tif"
IN_REACH, ORIGIN, TOWARDS = (5, 1, 2, 7, 6, 8, 0), (647478.0, 4185617.0), (647202.0, 4185892.0)
REACH, HALF_WIDTH, LAST = 392.0, 81.0, 0


def tidal_reach(data: Path, to: Path) -> Path:
    """The folder of the tidal reach: tracks as shipped, one file a section, and the DEM."""
    shutil.rmtree(to, ignore_errors=True)
    to.mkdir(parents=True)
    shutil.copy(data / DEM, to / "dem.tif")
    files = []
    for track in IN_REACH:
        _averaged_track(data / TRACKS / f"track-{track}.csv", to / f"track{track}.csv")
        columns = "{x: x, y: y, u: u_avg, v: v_avg}"
        files.append(f"  track{track}.csv: {{section: t{track}, standard_error: 3 cm/s, columns: {columns}}}")
    # The surface is flat to a few cm: level of the DEM and depth of the boat at the last section.
    raster = read_raster_of(data / DEM)
    with (data / TRACKS / f"track-{LAST}.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["depth_bt"]]
    levels = [raster(float(row["x"]), float(row["y"])) + float(row["depth_bt"]) for row in rows]
    level = float(np.nanmedian(levels))
    (to / "site.yaml").write_text(
        f'frame: {{origin: {list(ORIGIN)}, towards: {list(TOWARDS)}, crs: "EPSG:26910"}}\n'
        f"bed: {{file: dem.tif}}\ngrid: {{x: [0, {REACH:g}], y: [-{HALF_WIDTH:g}, {HALF_WIDTH:g}], cell: [7, 4.5]}}\n"
        "channel: {length_m: 392, bottom_width_m: 80, bank_slope_v_per_h: 0.3, bed_slope: 0.0}\n"
        f"experiments: {{april: {{discharge: {TIDAL_DISCHARGE:g}, level: {level:.3f}}}}}\n"
        "files:\n" + "\n".join(files) + "\n",
        encoding="utf-8",
    )
    return to


# Rows of a track that are averaged [-]: they stand 0.67 m apart, and a cell is 4.5 m wide.
AVERAGED = 7


def _averaged_track(source: Path, to: Path) -> None:
    """A track with means of AVERAGED rows that have a velocity; columns as shipped."""
    with source.open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["u_avg"]]
    lines = ["x,y,u_avg,v_avg"]
    for first in range(0, len(rows) - AVERAGED + 1, AVERAGED):
        part = rows[first : first + AVERAGED]
        lines.append(",".join(f"{np.mean([float(row[name]) for row in part]):.4f}" for name in lines[0].split(",")))
    to.write_text("\n".join(lines) + "\n", encoding="utf-8")


# Mean of the discharges of the boat, 194 to 232 m3/s (field/adcp/river_surveyor_flows-2018.csv).
TIDAL_DISCHARGE = 230.0


def read_raster_of(path: Path) -> Callable[[float, float], float]:
    """Level of the nearest pixel of a GeoTIFF [m]."""
    raster = read_geotiff(path)

    def level(x: float, y: float) -> float:
        return float(raster.values[np.abs(raster.x - x).argmin(), np.abs(raster.y - y).argmin()])

    return level


# D. A jam of wood over the whole width of a flat flume of Penn State, 15.24 m by 1.5 m: means of two to five heights at
# five places across in four sections, and levels before and behind, at four discharges (cases 9 to 12).
JAM = "SRH_2D/plotting/depth_averaged_velocity/measurement_data"
JAM_AT, JAM_LENGTH, JAM_CASES = 10.16, 0.2, range(9, 13)
JAM_PLACES = (-0.6, -0.3, 0.0, 0.3, 0.6)
# x of the sections from the middle of the jam [m], and of the gauge before it, as in the authors' model.
JAM_SECTIONS = {
    "72inch_upstream": -1.83, "36inch_upstream": -0.91, "36inch_downstream": 0.91, "72inch_downstream": 1.83,
}  # fmt: skip
JAM_GAUGE = -4.673


def jam(stated: bool) -> Callable[[Path, Path], Path]:
    """The folder of the flume with a jam; stated: with it as a patch, else as a user who knows of none."""

    def folder(data: Path, to: Path) -> Path:
        shutil.rmtree(to, ignore_errors=True)
        to.mkdir(parents=True)
        table = pd.read_excel(data / "results_for_all_cases.xlsx", sheet_name="Sheet1", header=None)
        known = {str(row[3]): row[4:20].to_numpy() for _, row in table.iterrows()}
        velocity, level, flows = ["experiment,section,x,y,u,u_se"], ["experiment,section,x,y,level,level_se"], []
        for case in JAM_CASES:
            name = f"c{case}"
            for section, x in JAM_SECTIONS.items():
                read = pd.read_excel(data / JAM / f"Case{case}" / f"{section}.xlsx", header=None)
                means = read[read[0] == "average"].iloc[0, 1:].to_numpy(float)
                rows = zip(JAM_PLACES, means, strict=True)
                velocity += [f"{name},{section},{JAM_AT + x:.2f},{y:g},{u:.5f},0.01" for y, u in rows]
            before, behind, carried = (
                float(known[what][case - 1]) for what in ("Upstream WSE (m)", "Downstream WSE (m)", "Discharge (m3/s)")
            )
            level.append(f"{name},before,{JAM_AT + JAM_GAUGE:.2f},0,{before},0.005")
            flows.append(f"  {name}: {{discharge: {carried}, level: {behind}}}")
        (to / "velocities.csv").write_text("\n".join(velocity) + "\n", encoding="utf-8")
        (to / "levels.csv").write_text("\n".join(level) + "\n", encoding="utf-8")
        ends = [JAM_AT - 0.5 * JAM_LENGTH, JAM_AT + 0.5 * JAM_LENGTH]
        patch = f"patches: [{{name: jam, x: {ends}, y: [-0.75, 0.75], stems_per_m2: 441}}]\n" if stated else ""
        (to / "site.yaml").write_text(
            "channel: {length_m: 15.24, bottom_width_m: 1.5, bed_slope: 0.0}\nwalls: 0.010\n"
            "grid: {x: [0, 15.24], y: [-0.75, 0.75], cell: [0.127, 0.1]}\n" + patch +
            "experiments:\n" + "\n".join(flows) + "\n",
            encoding="utf-8",
        )  # fmt: skip
        return to

    return folder


# E. Three sections of the Lower Yuba, a gravel river, waded at 797 cfs: bed and edge of the water by level, velocity
# and depth by rod. Places are in feet of the state plane; x runs west from E = 2057595 m.
YUBA, YUBA_SHEET = "examples/yuba/lyr-h20-dpd/measurement-data/LYR-XS-vs-Model.xlsx", "LYR_XS"
YUBA_SECTIONS, WATERS_EDGE = ("X15", "X16", "X17"), "X"


def waded_river(data: Path, to: Path) -> Path:
    """The folder of the gravel river: rows of three sections, as they stand in the workbook."""
    shutil.rmtree(to, ignore_errors=True)
    to.mkdir(parents=True)
    table = pd.read_excel(data / YUBA, sheet_name=YUBA_SHEET, header=None)
    place = "section,E [ft],N [ft]"
    velocity, bed, level, section = [f"{place},V [ft/s]"], [f"{place},Z [ft]"], [f"{place},WSE [ft]"], ""
    for row in table.iloc[1:].to_numpy().tolist():
        name, north, east, height, speed = str(row[0]), row[1], row[2], row[7], row[10]
        section = name.split("_")[0] if name.startswith(WATERS_EDGE) else section
        if section not in YUBA_SECTIONS:
            continue
        bed.append(f"{section},{east},{north},{height}")
        if name.startswith(WATERS_EDGE):
            level.append(bed[-1])
        else:
            velocity.append(f"{section},{east},{north},{speed}")
    for name, lines in (("velocities", velocity), ("bed", bed), ("levels", level)):
        (to / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (to / "site.yaml").write_text(
        "frame: {origin: [2057595, 672690], angle: 180 degrees}\nbed: {file: bed.csv, sections: true}\n"
        "experiments: {December: {discharge: 797 cfs, level: 195.99 ft}}\n"
        'files:\n  velocities.csv: {standard_error: 3 cm/s, columns: {x: "E [ft]", y: "N [ft]", u: "V [ft/s]"}}\n'
        '  levels.csv: {standard_error: 2 cm, columns: {x: "E [ft]", y: "N [ft]", level: "WSE [ft]"}}\n',
        encoding="utf-8",
    )
    return to


# F. Wake of a turbine 0.7 m wide in a flume of 18 m by 4 m with 2 m of water at 0.8 m/s: velocities at the height of
# its axis, at two intensities of turbulence, over its diameter and that speed.
WAKE = "Data/river/flume_experiment"
WAKE_FILES = {"quiet": "Mycek_03TI_vel.txt", "turbulent": "Mycek_15TI_vel.txt"}


def turbine_wake(data: Path, to: Path) -> Path:
    """The folder of the flume with a turbine, as a user who knows of none; files as shipped."""
    shutil.rmtree(to, ignore_errors=True)
    to.mkdir(parents=True)
    entries = []
    for experiment, name in WAKE_FILES.items():
        shutil.copy(data / WAKE / name, to / name)
        entries.append(
            f'  {name}: {{experiment: {experiment}, columns: {{x: Downstream, y: "y*", u: "u*"}}, '
            "units: {x: 0.7 m, y: 0.7 m, u: 0.8 m/s}, zero: [6, 0], standard_error: 1 cm/s}"
        )
    flows = ", ".join(f"{experiment}: {{discharge: 6.4, level: 2.0}}" for experiment in WAKE_FILES)
    (to / "site.yaml").write_text(
        "channel: {length_m: 18, bottom_width_m: 4, bed_slope: 0}\nwalls: 0.010\n"
        "grid: {x: [0, 18], y: [-2, 2], cell: [0.36, 0.1]}\n"
        f"experiments: {{{flows}}}\nfiles:\n" + "\n".join(entries) + "\n",
        encoding="utf-8",
    )
    return to


# G. A stream 3 m wide and 0.2 to 0.4 m deep in Lusaka, filmed from a bridge: velocities of its surface by images as
# pyorc's example ships them, and its bed at two lines 1.25 m apart. x runs along the images, 1.2 m before the first.
STREAM, STREAM_LINES = "examples/ngwerere", ("ngwerere_cross_section.csv", "ngwerere_cross_section_2.csv")
STREAM_FILM, STREAM_LEVEL, STREAM_FACTOR = "ngwerere_masked.nc", 1182.2, 0.85
STREAM_ORIGIN, STREAM_TOWARDS, STREAM_LENGTH = (642733.844, 8304294.326), (642734.336, 8304297.690), 3.4


def stream_discharge(folder: Path) -> float:
    """Q = 0.85 sum u h dy, the mean of both lines, u that of the surface within 0.2 m, along the images [m3/s]."""
    film = read_velocimetry(folder / STREAM_FILM, FileOptions()).numbers
    ends = np.array([STREAM_ORIGIN, STREAM_TOWARDS])
    towards = (ends[1] - ends[0]) / np.hypot(*(ends[1] - ends[0]))
    u = film["east_velocity"] * towards[0] + film["north_velocity"] * towards[1]
    found = []
    for name in STREAM_LINES:
        line = pd.read_csv(folder / name)
        apart = np.hypot(line["x"].to_numpy()[:, None] - film["x"], line["y"].to_numpy()[:, None] - film["y"])
        near = apart < 0.2
        speed = (near * u).sum(axis=1) / np.maximum(near.sum(axis=1), 1)
        across = -towards[1] * line["x"] + towards[0] * line["y"]
        depth = np.maximum(STREAM_LEVEL - line["z"], 0.0)
        found.append(abs(float(np.trapezoid(STREAM_FACTOR * speed * depth, across))))
    return float(np.mean(found))


def filmed_stream(data: Path, to: Path) -> Path:
    """The folder of the filmed stream: its film as shipped, and both lines of the bed in one table."""
    shutil.rmtree(to, ignore_errors=True)
    to.mkdir(parents=True)
    shutil.copy(data / STREAM / STREAM_FILM, to / STREAM_FILM)
    lines = [pd.read_csv(data / STREAM / name).assign(section=name) for name in STREAM_LINES]
    pd.concat(lines).to_csv(to / "bed.csv", index=False)
    discharge = stream_discharge(data / STREAM)
    (to / "site.yaml").write_text(
        f'frame: {{origin: {list(STREAM_ORIGIN)}, towards: {list(STREAM_TOWARDS)}, crs: "EPSG:32735"}}\n'
        "bed: {file: bed.csv, sections: true}\n"
        f"grid: {{x: [0, {STREAM_LENGTH:g}], y: [-2.2, 2.4], cell: [0.1, 0.1]}}\n"
        f"experiments: {{november: {{discharge: {discharge:.3f}, level: {STREAM_LEVEL:g}}}}}\n"
        f"files: {{{STREAM_FILM}: {{factor: {STREAM_FACTOR:g}}}}}\n",
        encoding="utf-8",
    )
    return to


# H. Compound channel of the HHLab, a main channel of glass between floodplains 0.115 m higher, on which rods (wood)
# stand up to x = 9.05 m and grass grows beyond; 162 l/s, levels alone, z = 0 on the floor at x = 18 m. Rods as in other
# experiments of that flume, 81 per m2: only their ratio counts.
TRANSITION = (
    "Case_studies/HHLab/Compound_channel_spatial_friction/Calibration_experiments/piecewise_function/"
    "Kmin_n_deg_0_Kflood_PW_function_nK_2/BaM"
)
TRANSITION_STEP, TRANSITION_SLOPE, TRANSITION_AT = 0.115, 1.05e-3, 9.05


def changing_floodplains(stated: bool) -> Callable[[Path, Path], Path]:
    """The folder of the channel with wood, then meadow, on its floodplains; stated: the wood as patches."""

    def folder(data: Path, to: Path) -> Path:
        shutil.rmtree(to, ignore_errors=True)
        to.mkdir(parents=True)
        shutil.copy(data / TRANSITION / "CalibrationData.txt", to / "CalibrationData.txt")
        bed, grass, patches = ["x,y,z"], ["name,class,x,y"], list[str]()
        across = ((0.0, 1), (0.99, 1), (1.01, 0), (1.99, 0), (2.01, 1), (3.0, 1))
        for x in range(19):
            bed += [f"{x},{y:g},{TRANSITION_STEP * high + TRANSITION_SLOPE * (18 - x):.5f}" for y, high in across]
        for name, low, high in (("right", 0, 1), ("left", 2, 3)):
            grass += [f"{name},floodplain,{x},{y}" for x, y in ((0, low), (18, low), (18, high), (0, high))]
            patches.append(f"{{name: {name}, x: [0, {TRANSITION_AT}], y: [{low}, {high}], stems_per_m2: 81}}")
        (to / "bed.csv").write_text("\n".join(bed) + "\n", encoding="utf-8")
        (to / "floodplains.csv").write_text("\n".join(grass) + "\n", encoding="utf-8")
        wood = f"canopy_height_guess_m: 0.3\npatches: [{', '.join(patches)}]\n" if stated else ""
        (to / "site.yaml").write_text(
            "bed: {file: bed.csv, sections: true}\nwalls: 0.010\nclasses: {file: floodplains.csv}\n"
            "grid: {x: [0, 18], y: [0, 3], cell: [0.5, 0.1]}\n"
            "experiments: {'1': {discharge: 0.162, level: 0.1718}, '2': {discharge: 0.162, level: 0.1702}}\n"
            "files: {CalibrationData.txt: {standard_error: 2 mm, zero: [0, 1.5]}}\n" + wood,
            encoding="utf-8",
        )
        return to

    return folder


# I. Two passes of a boat over one line of the Tanana at Nenana, with GPS. The bed is known by the depths of the boat
# alone: carried along the river, with banks of 1:3 beyond the water that it reached. Level 0 is that of the water.
PASSES, PASS_FILES = "examples/data/river/ADCP_transect", (
    "tanana_transects_08_10_10_0_002_10-08-10_142214.PD0", "tanana_transects_08_10_10_0_003_10-08-10_143335.PD0",
)  # fmt: skip
PASS_ANGLE, PASS_DECLINATION, PASS_DISCHARGE, PASS_REACH = 107.0, 15.7, 1789.0, 150.0


def river_crossing(data: Path, to: Path) -> Path:
    """The folder of the Tanana: both passes as shipped, and a bed by the depths that they have."""
    from mhkit import dolfyn

    shutil.rmtree(to, ignore_errors=True)
    to.mkdir(parents=True)
    degree, along = 111_400.0, np.radians(PASS_ANGLE)  # metres in a degree of latitude there
    first, starts, seen = np.zeros(0), list[str](), list[np.ndarray]()
    for name in PASS_FILES:
        shutil.copy(data / PASSES / name, to / name)
        with redirect_stdout(io.StringIO()):
            read = dolfyn.read(str(to / name))
        place = np.column_stack([read["longitude_gps"].values, read["latitude_gps"].values])
        first = first if first.size else place[0]
        east, north = ((place - first) * degree * np.array([np.cos(np.radians(first[1])), 1.0])).T
        starts.append(
            f"  {name}: {{start: [{east[0]:.1f}, {north[0]:.1f}], declination: {PASS_DECLINATION} degrees, section: T}}"
        )
        depth = read["dist_bt"].values.mean(axis=0)[: east.size]
        seen.append(np.column_stack([-east * np.sin(along) + north * np.cos(along), depth]))
    across, depth = np.vstack(seen).T
    middle = 0.5 * (across.min() + across.max())
    at = np.arange(np.ceil((across.min() - middle) / 5.0) * 5.0, across.max() - middle, 5.0)
    bed = np.array([-depth[np.abs(across - middle - y) < 4.0].mean() for y in at])
    at = np.concatenate([[at[0] + 3.0 * bed[0] - 3.0], at, [at[-1] - 3.0 * bed[-1] + 3.0]])
    lines = ["section,x,y,z"]
    for x in (-PASS_REACH, 0.0, PASS_REACH):
        lines += [f"s{x:g},{x:g},{y:.2f},{z:.2f}" for y, z in zip(at, [1.0, *bed, 1.0], strict=True)]
    (to / "bed.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    origin = [float(-middle * np.sin(along)), float(middle * np.cos(along))]
    edge = 5.0 * np.ceil(np.abs(at).max() / 5.0)
    (to / "site.yaml").write_text(
        f"frame: {{origin: [{origin[0]:.2f}, {origin[1]:.2f}], angle: {PASS_ANGLE:g} degrees}}\n"
        "bed: {file: bed.csv, sections: true, coordinates: channel}\n"
        f"grid: {{x: [{-PASS_REACH:g}, {PASS_REACH:g}], y: [{-edge:g}, {edge:g}], cell: [10, 5]}}\n"
        f"experiments: {{August: {{discharge: {PASS_DISCHARGE:g}, level: 0}}}}\nfiles:\n" + "\n".join(starts) + "\n",
        encoding="utf-8",
    )
    return to


MEASUREMENTS, NOTHING = "measurements to correct", "nothing"
HYDROBAYES = "Felipemendezrios/Hydrobayes @ ecd7947e, d83c12f9, 316ddab5"
SETS = (
    MeasuredSet(
        "A1 compound channel, one roughness",
        f"{HYDROBAYES}: {COMPOUND}",
        compound_channel(1),
        "glass and grass, two surfaces (Proust and Nikora 2020)",
        ("bank_roughness",),
        ("depth_dependent_bed", "depth_dependent_bank"),
    ),
    MeasuredSet(
        "A2 compound channel, grass with its own roughness",
        f"{HYDROBAYES}: {COMPOUND}",
        compound_channel(2),
        "a shear layer with large eddies, cells of secondary current (Proust and Nikora 2020)",
        ("coherent_structures", "growing_shear_layer"),
        (
            "mixing_length",
            "smagorinsky",
            "secondary_current",
            "panel_current",
            "viscosity as a field",
            "viscosity at a place",
        ),
    ),
    MeasuredSet(
        "B smooth flume, four discharges",
        f"{HYDROBAYES}: {SMOOTH}",
        smooth_flume,
        "hydraulically smooth, n falls by some 10 % with Reynolds number (Proust et al. 2022)",
        ("depth_dependent_bed",),
        ("law of the depth",),
    ),
    MeasuredSet(
        "C tidal reach by ADCP",
        f"rustychris/hor_flow_and_salmon @ 30f00859: {TRACKS}, {DEM}",
        tidal_reach,
        "more horizontal shear than in their model, n = 0.023; one track without RTK (notes of the authors); below x = "
        "351 m the river divides, 115 and 130 m3/s of the boat in its branches (tracks 3 and 4)",
        ("inflow_distribution", "inflow_peak", "inflow_skew", "inflow_core", "station_shift"),
        (
            "viscosity",
            "elder",
            "mixing_length",
            "smagorinsky",
            "coherent_structures",
            "growing_shear_layer",
            "inflow at a place",  # of the water that leaves; counted since it was seen
        ),
    ),
    MeasuredSet(
        "D1 jam over a flume, not stated",
        f"psu-efd/LWD_flow_resistance @ 95ed9506: {JAM}, results_for_all_cases.xlsx",
        jam(stated=False),
        "drag of a jam at x = 10.16 m over the whole width, C_d 50 to 60 over 0.2 m (authors' calibration)",
        ("barrier at a place", "drag at a place", "bed_stretch"),
    ),
    MeasuredSet(
        "D2 jam over a flume, stated as a patch",
        f"psu-efd/LWD_flow_resistance @ 95ed9506: {JAM}, results_for_all_cases.xlsx",
        jam(stated=True),
        "the jam is not the same over the width: behind it 0.04 to 0.47 m/s side by side (authors' velocities)",
        ("drag at a place", "patch_density", "edge_thinning"),
    ),
    MeasuredSet(
        "E three waded sections of a gravel river",
        f"Ecohydraulics/hydrobayescal @ 9500eae: {YUBA}, sheet {YUBA_SHEET}",
        waded_river,
        "depths by rod in X15 and X16 are 0.18 m more than level less bed, in the 15 others -0.07 to 0.01 m; X16 "
        "and X17 were waded in part (the authors' workbook)",
        (MEASUREMENTS,),
    ),
    MeasuredSet(
        "F wake of a turbine, not stated",
        f"browniea/Delft3D_verify @ e7687e4: {WAKE}",
        turbine_wake,
        "a turbine 0.7 m wide at x = 6 m, y = 0, thrust coefficient 0.72 (Mycek et al. 2014)",
        ("drag at a place",),
    ),
    MeasuredSet(
        "G filmed stream, bed by two lines",
        f"localdevices/pyorc @ be7d7c8f: {STREAM}, {STREAM_FILM}, {', '.join(STREAM_LINES)}",
        filmed_stream,
        "the bed was recorded to 0.1 m, the site is far from uniform, which explains that both lines carry different "
        "discharges (the authors' notebook 04)",
        (MEASUREMENTS, "bed at a place", "bed as a field", "bed_level_error", "cross_slope_error"),
    ),
    MeasuredSet(
        "H1 wood on floodplains, not stated",
        f"Felipemendezrios/Hydrobayes @ 37f22780: {TRANSITION}/CalibrationData.txt",
        changing_floodplains(stated=False),
        "floodplains of wood up to x = 9.05 m, of meadow beyond: their friction changes there (the authors' model)",
        ("bed_stretch", "unlisted_patch"),
        ("drag at a place", "bed_trend", "bank_trend", "bank_drag_trend", "friction as a field"),
    ),
    MeasuredSet(
        "H2 wood on floodplains, stated",
        f"Felipemendezrios/Hydrobayes @ 37f22780: {TRANSITION}/CalibrationData.txt",
        changing_floodplains(stated=True),
        "nothing is missing that the authors state",
        (NOTHING,),
    ),
    MeasuredSet(
        "I one line of the Tanana by ADCP",
        f"MHKiT-Software/MHKiT-Python @ 9fa9f9c9: {PASSES}/{' and '.join(PASS_FILES)}",
        river_crossing,
        "1789 m3/s by the gauge (USGS); no cause stated: one line, and a bed by its own depths",
        (MEASUREMENTS,),
    ),
)


@dataclass(frozen=True)
class Outcome:
    """What the loop said of a set, and errors along [m/s] before, after and with one section left out each time.

    Without velocities errors are those of levels [m], and nothing is left out.
    """

    name: str
    known: str
    verdict: str
    said: str
    judged: str
    errors: tuple[float, float, float, float]


def judged(verdict: Verdict, one: MeasuredSet) -> str:
    """Right, partly, wrong or undecided. A field or a law that goes before effects is what is named, not these."""
    if verdict.doubts_the_data:
        named, alike = {MEASUREMENTS}, set[str]()
    elif verdict.kind in ("cannot-tell", "nothing-missing") and one.right == (NOTHING,):
        return "right"
    elif verdict.kind == "cannot-tell":
        return "undecided"
    elif verdict.field is not None:
        named, alike = {f"{verdict.field.term} as a field"}, set()
    elif verdict.laws is not None and verdict.kind == "none-of-these":
        named, alike = {f"law of {law.quantity}" for law in verdict.laws.laws}, set()
    else:
        named = {effect.effect for effect in verdict.effects}
        named |= {f"{place.term} at a place" for place in verdict.places}
        alike = {name.split("[")[0] for effect in verdict.effects for name in effect.alike}
    if named & set(one.right):
        return "right"
    return "partly" if (named | alike) & {*one.right, *one.nearly} else "wrong"


def outcome_of(one: MeasuredSet, data: Path, runs: Path, jobs: int) -> Outcome:
    """Import, diagnose and extend a set."""
    key = one.name.split()[0].lower()
    shutil.rmtree(runs / "runs" / key, ignore_errors=True)
    folder = one.folder(data / one.files.split("/")[1].split(" ")[0], runs / key)
    case = import_folder(folder, runs / f"{key}.yaml", force=True)
    found = diagnose(case, runs=runs / "runs", jobs=jobs)
    grown = extend_stepwise(case, runs=runs / "runs", jobs=jobs, force=True)
    first, last = (
        model_score(calibrated(CaseRun(load_case(model.source), runs / "runs"), excluded_by()))
        for model in (grown.cases[0], grown.cases[-1])
    )
    kind = "level" if np.isnan(first.in_sample.rmse.get("velocity", np.nan)) else "velocity"
    errors = first.in_sample.rmse[kind], last.in_sample.rmse[kind], held_out_rmse(first), held_out_rmse(last)
    return Outcome(one.name, one.known, found.verdict.kind, found.verdict.sentence, judged(found.verdict, one), errors)


def page(found: list[Outcome]) -> str:
    """The table of the page, and how many are right."""
    count = {word: sum(one.judged == word for one in found) for word in ("right", "partly", "undecided", "wrong")}
    lines = [
        ", ".join(f"{number} {word}" for word, number in count.items()) + ".",
        "",
        "| set | verdict | judged | error before | after | held out before | after |",
        "|---|---|---|---:|---:|---:|---:|",
    ]
    for one in found:
        numbers = " | ".join("-" if np.isnan(value) else f"{value:.4f}" for value in one.errors)
        lines.append(f"| {one.name} | {one.verdict} | {one.judged} | {numbers} |")
    return "\n".join(lines)


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("data", type=Path)
    ask.add_argument("--runs", type=Path, default=ROOT / "runs" / "measured")
    ask.add_argument("--jobs", type=int, default=1)
    ask.add_argument("--only", default="", help="letters of the sets, such as A1,B")
    given = ask.parse_args()
    chosen = [one for one in SETS if not given.only or one.name.split()[0] in given.only.split(",")]
    found = []
    for one in chosen:
        found.append(outcome_of(one, given.data, given.runs, given.jobs))
        print(f"{page(found[-1:])}\n{found[-1].known}\n{found[-1].said}", flush=True)
    if len(chosen) == len(SETS):
        text = PAGE.read_text(encoding="utf-8")
        before, after = text[: text.index(BEGIN) + len(BEGIN)], text[text.index(END) :]
        PAGE.write_text(f"{before}\n\n{page(found)}\n\n{after}", encoding="utf-8")
        print(f"Written to {PAGE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
