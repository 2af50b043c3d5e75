"""Folders as a field team and a laboratory would hand them over: the product's own flow with noise, in others' formats.

    python tests/studies/sample_sites.py     # writes data/samples/bend and data/samples/flume

A bend surveyed by boat, as WinRiver exports its transects, and a flume with side walls and dowels, as a table of means.
Nothing in them was measured. What was put in stands below, and nowhere in the folders.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from instrument_files import winriver
from scipy.interpolate import RegularGridInterpolator

from vegglue.case.grid import centreline_of, heading_at
from vegglue.case.schema import Case
from vegglue.flow.sensor import FlowFields
from vegglue.importers.measured_rows import Placement
from vegglue.inference.solve_ensemble import solve_flow

ROOT = Path(__file__).parents[2]
BEND, FLUME = ROOT / "data/samples/bend", ROOT / "data/samples/flume"
UNIFORM = {"distribution": "uniform", "low": 0.0, "high": 10.0, "unit": "-"}
# Where the bend lies on the map, and the three sections a boat crossed: metres along the centreline.
CORNER, HEADING, SECTIONS = (683120.0, 247480.0), 20.0, {"A": 22.0, "B": 33.0, "C": 44.0}
HELICAL = {"n_b": 0.035, "k_s": 0.1, "share": 1.0}
SMOOTH = {"n_b": 0.014, "n_w": 0.010, "phi": 3.0}
# Noise of one cell of an ADCP, of the mean of an ADV, and of levels [m/s, m/s, m].
OF_A_CELL, OF_A_MEAN, OF_A_LEVEL = 0.04, 0.005, 0.001


def bend() -> Case:
    """Two straight reaches and a quarter of a circle between them, in whose flow a spiral turns."""
    line = {"parts": [{"length": 15.0}, {"radius": 15.0, "angle": 90.0}, {"length": 15.0}]}
    channel = {"axis": 0.0, "bottom_width": 4.0, "bank_slope": 0.5, "bed_slope": 0.0015, "level": 0.0}
    return Case.model_validate({
        "source": Path("bend"), "name": "bend",
        "grid": {"x": (0.0, 53.5), "y": (-5.0, 5.0), "cell": (0.5, 0.25),
                 "centreline": line | {"start": CORNER, "heading": HEADING}},
        "bed": [{"trapezoid": channel}],
        "friction": {"classes": {"bed": {"law": "manning", "n": "n_b"}, "bank": {"law": "keulegan", "k_s": "k_s"}},
                     "default": "bed", "zones": [{"class": "bank", "beyond_slope_break": 0.2}]},
        "inflows": {"upstream": {"side": "west"}}, "eddy_viscosity": 0.01,
        "effects": {"helical_flow": {"values": {"share": "share"}}},
        "experiments": {"June": {"discharge": {"upstream": 2.4}, "level": 0.82}},
        "parameters": dict.fromkeys(HELICAL, UNIFORM),
    })  # fmt: skip


def flume() -> Case:
    """Eight metres between walls, dowels along a part of the left one."""
    channel = {"axis": 0.0, "bottom_width": 2.0, "bank_slope": 1.0, "bed_slope": 0.001, "level": 0.0}
    return Case.model_validate({
        "source": Path("flume"), "name": "flume",
        "grid": {"x": (0.0, 8.0), "y": (-0.4, 0.4), "cell": (0.1, 0.025)},
        "bed": [{"trapezoid": channel}],
        "friction": {"classes": {"bed": {"law": "manning", "n": "n_b"}}, "default": "bed",
                     "walls": {"law": "manning", "n": "n_w"}},
        "plants": {"stands": {"dowels": {"phi": "phi", "canopy_height": 0.3}},
                   "patches": [{"name": "p", "stand": "dowels", "x": (3.0, 4.5), "y": (0.2, 0.4)}]},
        "inflows": {"upstream": {"side": "west"}}, "eddy_viscosity": 0.0005,
        "experiments": {"run 1": {"discharge": {"upstream": 0.032}, "level": 0.1}},
        "parameters": dict.fromkeys(SMOOTH, UNIFORM),
    })  # fmt: skip


def write_bend(folder: Path) -> None:
    """The centreline as a map program has it, three transects, and gauges in a table of an office."""
    case = bend()
    assert case.grid.centreline is not None
    place = Placement(None, centreline_of(case.grid.centreline))
    (flow,) = solve_flow(case, HELICAL).values()
    along = np.arange(0.0, 54.0, 4.5)
    corners = np.round(np.stack(place.to_map(along, np.zeros(along.size)), axis=1), 2).tolist()
    shape = {"type": "LineString", "coordinates": corners}
    _write(folder / "axis.geojson", json.dumps({"type": "Feature", "properties": {}, "geometry": shape}))
    starts = {name: _transect(folder, flow, place, name, s, seed) for seed, (name, s) in enumerate(SECTIONS.items(), 1)}
    random, gauges = np.random.default_rng(9), np.array([[4.0, 1.0], [28.0, -1.0], [50.0, 1.0]])
    level = _at(flow, flow.level, *gauges.T) + OF_A_LEVEL * random.standard_normal(len(gauges))
    east, north = place.to_map(*gauges.T)
    rows = [f"{e:.2f};{n:.2f};{z:.3f}".replace(".", ",") for e, n, z in zip(east, north, level, strict=True)]
    _write(folder / "gauges.txt", "\n".join(["Easting;Northing;WSE", *rows]))
    _write(folder / "site.yaml", BEND_SITE.format(**starts))


def _transect(folder: Path, flow: FlowFields, place: Placement, name: str, s: float, seed: int) -> str:
    """One crossing from the right bank to the left; returns where it began."""
    n = np.linspace(-3.0, 3.0, 64)
    at = np.full(n.size, s)
    assert place.line is not None
    u, v, theta = _at(flow, flow.u, at, n), _at(flow, flow.v, at, n), heading_at(place.line, at)
    velocity = np.column_stack([u * np.cos(theta) - v * np.sin(theta), u * np.sin(theta) + v * np.cos(theta)])
    east, north = place.to_map(at, n)
    text = winriver(east - east[0], north - north[0], _at(flow, flow.depth, at, n), velocity, OF_A_CELL, seed)
    _write(folder / f"mill_{name}_ASC.TXT", text)
    return f"[{east[0]:.2f}, {north[0]:.2f}]"


def write_flume(folder: Path) -> None:
    """Means of an ADV in centimetres, and a point gauge in millimetres above the floor at the inlet."""
    (flow,) = solve_flow(flume(), SMOOTH).values()
    random = np.random.default_rng(4)
    rows = ["Run;X [cm];Y [cm];U [cm/s];V [cm/s]"]
    for x in (2.0, 3.75, 5.25, 7.0):
        for y in (-0.3, -0.1, 0.05, 0.15, 0.25, 0.35):
            u, v = (_at(flow, part, x, y) + OF_A_MEAN * random.standard_normal() for part in (flow.u, flow.v))
            rows.append(f"run 1;{100 * x:g};{100 * y:g};{100 * u:.1f};{100 * v:.1f}")
    _write(folder / "adv means.csv", "\n".join(rows))
    rows = ["Run;X [cm];Y [cm];Level [mm]"]
    for x in (0.5, 2.5, 4.8, 7.5):
        rows.append(
            f"run 1;{100 * x:g};0;{1000 * (_at(flow, flow.level, x, 0.0) + 5e-4 * random.standard_normal()):.1f}"
        )
    _write(folder / "point gauge.csv", "\n".join(rows))
    _write(folder / "site.yaml", FLUME_SITE)


def _at(flow: FlowFields, field: np.ndarray, x: Any, y: Any) -> Any:
    return RegularGridInterpolator((flow.x, flow.y), field)((x, y))


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text.rstrip() + "\n", encoding="utf-8")


BEND_SITE = """\
channel: {{bottom_width_m: 4, bank_slope_v_per_h: 0.5, bed_slope: 0.0015}}
frame: {{crs: "EPSG:2056"}}
grid:
  centreline: {{file: axis.geojson}}
  x: [0, 53]
  y: [-5, 5]
  cell: [1, 0.5]
experiments:
  June: {{discharge: 2400 l/s, level: 82 cm}}
files:
  mill_A_ASC.TXT: {{start: {A}, section: A}}
  mill_B_ASC.TXT: {{start: {B}, section: B}}
  mill_C_ASC.TXT: {{start: {C}, section: C}}
  gauges.txt: {{standard_error: 1 mm}}
"""
FLUME_SITE = """\
channel: {length_m: 8, bottom_width_m: 0.8, bed_slope: 0.001}
walls: {n: 0.010}                                     # glass
patches: [{x: [3, 4.5], y: [0.2, 0.4], stems_per_m2: 400}]
canopy_height_guess_m: 0.3
eddy_viscosity_m2_s: 0.0005
experiments:
  run 1: {discharge: 32 l/s, level: 100 mm}
files:
  adv means.csv: {columns: {experiment: Run}, standard_error: 0.5 cm/s}
  point gauge.csv: {columns: {experiment: Run}, standard_error: 0.5 mm}
"""
WRITERS: Mapping[Path, Any] = {BEND: write_bend, FLUME: write_flume}

if __name__ == "__main__":
    for into, write in WRITERS.items():
        write(into)
        print(into)
