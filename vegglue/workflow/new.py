"""name -> a working folder: a commented case of a straight reach, and measurements that belong to it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vegglue.case.config import load_case
from vegglue.case.schema import Case
from vegglue.case.text_files import case_name, write_text
from vegglue.errors import InputError, shown_path
from vegglue.flow.sensor import FlowFields
from vegglue.inference.solve_ensemble import solve_flow
from vegglue.whole_files import failed_writes_told

# What the examples were made with, and their errors: the first draws of one seed, so that each time they are the same.
TRUTH = {"n_b": 0.04, "phi": 6.0}
VELOCITY_ERROR, LEVEL_ERROR_OF_EXAMPLE, SEED = 0.01, 0.002, 1
OWN_FILES, ELSEWHERE = ("case.yaml", "velocities.csv", "levels.csv", "README.md"), "give another place by --folder"
# Cells across the floor: as many as a first look needs.
CELLS_OF_FLOOR = 8


# Lines that end in `# plants` are left out where there are none.
CASE = """\
# A case: everything a run depends on. SI units throughout; x downstream, y across to the left, z as surveyed.
name: {name}                     # results go to runs/{name}/
title: A straight reach          # stands above the report
grid:                            # of the model; eight cells across the floor are enough for a first look
  x: [0, {length}]               # from upstream to downstream [m]
  y: [-{half}, {half}]           # across, wide enough that water never reaches the edge [m]
  cell: [{dx}, {dy}]             # a whole number of cells along each [m]
bed:                             # or {{raster: bed.asc}}, {{points: survey.csv}}; later layers win where they have data
  - trapezoid: {{axis: 0, bottom_width: {width}, bank_slope: 0.5, bed_slope: {slope}, level: 0}}
friction:
  classes:
    bed: {{law: manning, n: n_b}}  # a number, or the name of a parameter below
  default: bed
plants:                                                               # plants
  stands:                                                             # plants
    reed: {{phi: phi, canopy_height: {canopy}}}  # drag of the plants [-], their height in the flow [m] # plants
  patches:                                                            # plants
    - {{name: p1, stand: reed, x: [{patch_from}, {patch_to}], y: [0, {patch_side}]}} # plants
inflows:
  upstream: {{side: west}}         # water enters by the west side, spread by depth
experiments:                     # as many as were measured; they share the parameters
  first: {{discharge: {discharge}, level: {level}}}  # [m3/s]; level at the outlet, datum of the bed [m]
parameters:                      # the unknowns and what is known of them before
  n_b: {{distribution: loguniform, low: 0.01, high: 0.1, unit: s m^(-1/3), symbol: n_b, meaning: Manning coefficient}}
  phi: {{distribution: loguniform, low: 0.5, high: 50, unit: '-', symbol: φ, meaning: drag of the plants}} # plants
observations:                    # put your own in place of these, which were computed
  - {{kind: velocity, file: velocities.csv, experiment: first, synthetic: true}}
  - {{kind: level, file: levels.csv, experiment: first, synthetic: true}}
simulate: {{members: 256, seed: 1}}  # a first look; 4096 for a final answer
infer: {{sigma: known}}            # standard errors are those of the files
model_error: {{friction: 0.05, bed: 0.01}}  # by how much the model itself may be wrong [-], [m]
"""

README = """\
# {name}

`case.yaml` describes the reach; `velocities.csv` and `levels.csv` hold measurements that were **computed**, with errors
added, so that everything runs as it is. Put your own in their place: the columns are x, y [m], u [m/s] or level [m],
and their standard errors `u_se` and `level_se`.

    vegglue check case.yaml      # reads everything and says what is odd
    vegglue simulate case.yaml   # solves the ensemble
    vegglue run case.yaml        # the whole loop: what is missing in the model, and a report

Tables of other forms and units, workbooks and instruments' exports go through `vegglue import` instead.
"""


@dataclass(frozen=True)
class Reach:
    """The numbers that a new case begins with: length and width of the floor [m], slope of the bed [-], depth at the
    outlet [m], discharge [m3/s], and whether there are plants.
    """

    length: float = 40.0
    width: float = 3.0
    slope: float = 0.001
    depth: float = 0.9
    discharge: float = 1.5
    plants: bool = True


def new(name: str, reach: Reach | None = None, *, folder: Path | str = ".") -> Case:
    """Make <folder>/<name>/ with case.yaml, velocities.csv, levels.csv and README.md; returns the case.

    The measurements are computed with TRUTH and errors, and say so; your own take their place. The folder appears when
    it is whole. Errors: InputError when there is such a folder already, or no water flows with these numbers;
    StorageError.
    """
    reach = reach or Reach()
    into = Path(folder) / name
    if into.exists():
        raise InputError(f"{shown_path(into)}: expected a name that is free, got one in use; take another.")
    _refuse_senseless(reach)
    words = {"name": case_name(Path(name).name), **_numbers(reach)}
    growing = into.with_name(f".{into.name}.new")
    _clear(growing)
    write_text(growing / "case.yaml", _case_text(reach, words), ELSEWHERE)
    for file, heading in (("velocities.csv", "section,x,y,u,u_se"), ("levels.csv", "x,y,level,level_se")):
        write_text(growing / file, f"{heading}\n", ELSEWHERE)
    case = load_case(growing / "case.yaml")
    flow = solve_flow(case, {name: TRUTH[name] for name in case.parameters}).get("first")
    if flow is None:
        _clear(growing)
        raise InputError(f"{shown_path(into)}: no steady flow is found with these numbers; try a greater --depth.")
    _write_measurements(growing, flow, reach)
    write_text(growing / "README.md", README.format(**words), ELSEWHERE)
    with failed_writes_told(into, ELSEWHERE):
        growing.rename(into)
    return load_case(into / "case.yaml")


def _clear(growing: Path) -> None:
    """Take away what a killed command left. Errors: StorageError where anything else lies there."""
    with failed_writes_told(growing, "take it away"):
        if growing.is_symlink():
            growing.unlink()
        elif growing.exists():
            for name in OWN_FILES:
                for file in (growing / name, growing / f"{name}.new"):
                    file.unlink(missing_ok=True)
            growing.rmdir()


def _refuse_senseless(reach: Reach) -> None:
    for name in ("length", "width", "depth", "discharge"):
        if not 0.0 < getattr(reach, name) < np.inf:
            raise InputError(f"--{name}: expected a number above 0, got {getattr(reach, name):g}; correct it.")
    if not np.isfinite(reach.slope):
        raise InputError(f"--slope: expected a number, got {reach.slope:g}; correct it.")
    if reach.length < 4.0 * reach.width:
        raise InputError(
            f"--length: expected at least four times the width, {4.0 * reach.width:g} m, got {reach.length:g}; a "
            "shorter reach is all inflow and outlet."
        )


def _numbers(reach: Reach) -> dict[str, str]:
    """Grid and patch: banks of 1:2 up to half a metre above the water, cells about twice as long as wide."""
    dy = reach.width / CELLS_OF_FLOOR
    beside = int(np.ceil((reach.depth + reach.slope * reach.length + 0.5) / 0.5 / dy))
    columns = 2 * round(reach.length / dy / 4.0)
    half = 0.5 * reach.width + beside * dy
    patch = (reach.length / columns * round(0.4 * columns), reach.length / columns * round(0.55 * columns))
    found = {
        "length": reach.length, "half": half, "dx": reach.length / columns, "dy": dy, "width": reach.width,
        "slope": reach.slope, "discharge": reach.discharge, "level": reach.depth - reach.slope * reach.length,
        "canopy": 0.6 * reach.depth, "patch_from": patch[0], "patch_to": patch[1], "patch_side": 0.5 * reach.width,
    }  # fmt: skip
    return {name: f"{value:.10g}" for name, value in found.items()}


def _case_text(reach: Reach, words: dict[str, str]) -> str:
    text = CASE.format(**words)
    kept = [line for line in text.splitlines() if reach.plants or not line.endswith("# plants")]
    return "\n".join(line.removesuffix("# plants").rstrip() for line in kept) + "\n"


def _write_measurements(into: Path, flow: FlowFields, reach: Reach) -> None:
    """Three sections of seven verticals, before, in and behind the patch; gauges at both ends."""
    random = np.random.default_rng(SEED)
    rows = ["section,x,y,u,u_se"]
    for name, share in (("A", 0.3), ("B", 0.5), ("C", 0.65)):
        column = int(np.abs(flow.x - share * reach.length).argmin())
        wet = np.flatnonzero(~np.isnan(flow.u[column]))
        for row in wet[np.linspace(1, wet.size - 2, 7).round().astype(int)]:
            u = flow.u[column, row] + VELOCITY_ERROR * random.standard_normal()
            rows.append(f"{name},{flow.x[column]:.6g},{flow.y[row]:.6g},{u:.3f},{VELOCITY_ERROR:g}")
    write_text(into / "velocities.csv", "\n".join(rows) + "\n", "make room")
    levels = ["x,y,level,level_se"]
    middle = flow.y.size // 2
    for share in (0.1, 0.9):
        column = int(np.abs(flow.x - share * reach.length).argmin())
        level = flow.level[column, middle] + LEVEL_ERROR_OF_EXAMPLE * random.standard_normal()
        levels.append(f"{flow.x[column]:.6g},{flow.y[middle]:.6g},{level:.3f},{LEVEL_ERROR_OF_EXAMPLE:g}")
    write_text(into / "levels.csv", "\n".join(levels) + "\n", "make room")
