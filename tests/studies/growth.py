"""What a large site costs: `python tests/studies/growth.py`, sizes one after another, each in a process of its own.

A straight channel with ten unknowns and 1,000 stations, longer and longer, or wider and wider: seconds of one core and
peak of memory for a steady flow with its slopes, a step of a calibration, and members around it. As a calibration does,
the flow is found on ever coarser cells first. One size alone: `python tests/studies/growth.py COLUMNS ROWS [cells]`;
with the word `cells`, answers to a change of friction in each cell are made, too, as the search for places needs them.
"""

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # where `built_models` lies

from built_models import model_of

from vegglue.calibration.fit import fit
from vegglue.calibration.model_error import cell_responses
from vegglue.calibration.noise import noise_of
from vegglue.case.config import load_case
from vegglue.case.size_limits import factor_bytes
from vegglue.engine.interface import Point, linearise, predict
from vegglue.engine.model import ever_coarser
from vegglue.measurements.observations import read_observations
from vegglue.parallel import at_most

# Columns and rows, cells of 0.5 x 0.375 m: the paper's and longer ones, then wider ones.
LONGER = ((1142, 40), (2500, 40), (6250, 40), (12500, 40), (25000, 40))
WIDER = ((400, 80), (800, 80), (400, 160), (800, 160))
WITH_CELLS = ((342, 40), (1142, 40))
CELL, STATIONS, REACHES = (0.5, 0.375), 1000, 8
# Members around the flow, and how far off they lie [standard deviations of the prior]: as draws of a posterior do.
MEMBERS, AWAY = 32, 0.1
# Error of a station [m/s], and where the truth lies that a step of a calibration is to find [standard deviations].
ERROR, TRUTH = 0.02, 0.2
GIGABYTE = 1e9


def main() -> None:
    if len(sys.argv) > 2:
        with at_most(1):
            one_size(int(sys.argv[1]), int(sys.argv[2]), "cells" in sys.argv[3:])
        return
    for sizes, words in ((LONGER, []), (WIDER, []), (WITH_CELLS, ["cells"])):
        for columns, rows in sizes:
            subprocess.run([sys.executable, __file__, str(columns), str(rows), *words], check=True)


def site_file(folder: Path, columns: int, rows: int) -> Path:
    """A channel as wide as its grid, friction of its own in each of REACHES reaches, banks, and a patch of plants."""
    length, width = columns * CELL[0], rows * CELL[1]
    scale = rows / 40.0
    ends = np.linspace(0.0, length, REACHES + 1)
    classes = "".join(f"    r{k}: {{law: manning, n: n_{k}}}\n" for k in range(REACHES))
    zones = (
        "".join(f"    - {{class: r{k}, x: [{ends[k]}, {ends[k + 1]}]}}\n" for k in range(REACHES))
        + "    - {class: bank, beyond_slope_break: 0.2}\n"
    )
    priors = "".join(
        f'  n_{k}: {{distribution: uniform, low: 0.02, high: 0.06, unit: "s m^(-1/3)"}}\n' for k in range(REACHES)
    )
    text = f"""name: growth
title: A channel of {columns} x {rows} cells
grid: {{x: [0, {length}], y: [0, {width}], cell: [{CELL[0]}, {CELL[1]}]}}
bed:
  - trapezoid:
      axis: {width / 2}
      bottom_width: {width - 8.0}
      top_width: {width - 2.0}
      bank_slope: 0.5
      bed_slope: 0.001
      level: 0.0
friction:
  classes:
{classes}    bank: {{law: keulegan, k_s: k_s}}
  default: r0
  zones:
{zones}plants:
  stands:
    willow: {{phi: phi, canopy_height: 0.7}}
  patches:
    - {{name: p1, stand: willow, x: [{0.5 * length}, {0.5 * length + 20}], y: [{0.4 * width}, {0.5 * width}]}}
inflows:
  upstream: {{side: west, spread: conveyance}}
experiments:
  June: {{discharge: {4.0 * scale}, level: {0.9 - 0.001 * length}}}
parameters:
{priors}  k_s: {{distribution: uniform, low: 0.2, high: 1.5, unit: m}}
  phi: {{distribution: loguniform, low: 1, high: 100, unit: "-"}}
observations:
  - {{kind: velocity, file: velocities.csv, experiment: June}}
simulate: {{members: 64, seed: 7}}
"""
    across = np.linspace(0.3, 0.7, 5) * width
    along = np.linspace(0.02, 0.98, STATIONS // across.size) * length
    rows_of_file = [f"s{i},{x:.3f},{y:.3f},0.5" for i, x in enumerate(along) for y in across]
    (folder / "velocities.csv").write_text("\n".join(["section,x,y,u", *rows_of_file]) + "\n")
    path = folder / "growth.yaml"
    path.write_text(text)
    return path


def one_size(columns: int, rows: int, with_cells: bool) -> None:
    with tempfile.TemporaryDirectory() as folder:
        case = load_case(site_file(Path(folder), columns, rows))
        model = model_of(case, read_observations(case))
    grids = [replace(model, case=case, site=site) for case, site in ever_coarser(case, model.site)]
    cells = columns * rows
    print(
        f"{columns:,} x {rows} cells, {cells:,}; one experiment, {len(model.names)} unknowns, {len(model.station)} "
        f"stations; factors of all rows {factor_bytes(columns, rows) / GIGABYTE:.2f} GB",
        flush=True,
    )
    warm(grids[0])
    z = np.zeros(len(model.names))
    coarse = measured("  the same flow on ever coarser cells", lambda: down_to(grids[:-1], z)) if grids[1:] else None
    point = measured("  steady flow and its slopes", lambda: known(linearise(model, z, coarse)))
    truth = point.prediction + point.slope @ np.full(z.size, TRUTH)
    noise = noise_of(model.station.assign(value=truth, standard_error=ERROR))
    measured("  a step of a calibration", lambda: fit(model, noise, point, steps=1))
    away = z + AWAY * np.random.default_rng(1).standard_normal((MEMBERS, z.size))
    predicted = measured(f"  {MEMBERS} members around it", lambda: predict(model, [point], away))
    assert np.isfinite(predicted).all()
    if with_cells:
        measured("  answers to each cell", lambda: cell_responses(model, point, ("friction",)))


def down_to(grids: list[Any], z: np.ndarray) -> Point:
    """The flow on the last of ever finer grids."""
    point = None
    for model in grids:
        point = known(linearise(model, z, point))
    assert point is not None
    return point


def known(point: Point | None) -> Point:
    assert point is not None, "no steady flow was found"
    return point


def warm(model: Any) -> None:
    """All loops compiled or read from their caches."""
    point = known(linearise(model, np.zeros(len(model.names))))
    predict(model, [point], np.full((2, len(model.names)), 0.01))


def measured(words: str, work: Callable[[], Any]) -> Any:
    """What the work gives; seconds of a core, and the peak of memory of this process up to its end, told."""
    used = time.process_time()
    found = work()
    used = time.process_time() - used
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / GIGABYTE  # Linux counts kilobytes
    print(f"{words}: {used:.1f} s of a core, at most {peak:.2f} GB so far", flush=True)
    return found


if __name__ == "__main__":
    main()
