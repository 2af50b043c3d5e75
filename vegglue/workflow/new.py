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
from vegglue.wording.remedies import ANOTHER_NAME
from vegglue.wording.sentences import file_text

# What the examples were made with, and their errors: the first draws of one seed, so that each time they are the same.
TRUTH = {"n_b": 0.04, "phi": 6.0}
VELOCITY_ERROR, LEVEL_ERROR_OF_EXAMPLE, SEED = 0.01, 0.002, 1
OWN_FILES = ("case.yaml", "velocities.csv", "levels.csv", "README.md")
# Cells across the floor: as many as a first look needs.
CELLS_OF_FLOOR = 8


@dataclass(frozen=True)
class Reach:
    """The numbers that a new case begins with.

    Parameters
    ----------
    length, width
        Of the floor [m].
    slope
        Of the bed [-].
    depth
        At the outlet [m].
    discharge
        [m3/s]
    plants
        Whether there is a patch of plants.

    Raises
    ------
    InputError
        For a number that no channel has.
    """

    length: float = 40.0
    width: float = 3.0
    slope: float = 0.001
    depth: float = 0.9
    discharge: float = 1.5
    plants: bool = True

    def __post_init__(self) -> None:
        for name in ("length", "width", "depth", "discharge"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise InputError(f"--{name}: expected a number above 0, got {getattr(self, name):g}; correct it.")
        if not np.isfinite(self.slope):
            raise InputError(f"--slope: expected a number, got {self.slope:g}; correct it.")
        if self.length < 4.0 * self.width:
            raise InputError(
                f"--length: expected at least four times the width, {4.0 * self.width:g} m, got {self.length:g}; a "
                "shorter reach is all inflow and outlet."
            )


def new(name: str, reach: Reach | None = None, *, folder: Path | str = ".") -> Case:
    """Make <folder>/<name>/ with case.yaml, velocities.csv, levels.csv and README.md.

    The measurements are computed with TRUTH and errors, and marked as such; your own take their place. The folder
    appears when it is whole.

    Parameters
    ----------
    name : str
    reach : Reach, optional
    folder : Path or str

    Returns
    -------
    Case

    Raises
    ------
    InputError
        If there is such a folder already, or if no water flows with these numbers.
    StorageError
        If a file cannot be written.
    """
    reach = reach or Reach()
    into = Path(folder) / name
    if into.exists():
        raise InputError(f"{shown_path(into)}: expected a name that is free, got one in use; take another.")
    # Banks of 1:2 up to half a metre above the water, cells about twice as long as wide.
    dy, level = reach.width / CELLS_OF_FLOOR, reach.depth - reach.slope * reach.length
    beside = int(np.ceil((reach.depth + reach.slope * reach.length + 0.5) / 0.5 / dy))
    columns = 2 * round(reach.length / dy / 4.0)
    dx = reach.length / columns
    numbers = {
        "length": reach.length, "half": 0.5 * reach.width + beside * dy, "dx": dx, "dy": dy, "width": reach.width,
        "slope": reach.slope, "discharge": reach.discharge, "level": level, "canopy": 0.6 * reach.depth,
        "patch_from": dx * round(0.4 * columns), "patch_to": dx * round(0.55 * columns),
        "patch_side": 0.5 * reach.width,
    }  # fmt: skip
    words = {"name": case_name(Path(name).name), "plants": reach.plants}
    words |= {key: f"{value:.10g}" for key, value in numbers.items()}
    growing = into.with_name(f".{into.name}.new")
    _clear(growing)
    write_text(growing / "case.yaml", file_text("case.yaml.j2", words), ANOTHER_NAME)
    for file, heading in (("velocities.csv", "section,x,y,u,u_se"), ("levels.csv", "x,y,level,level_se")):
        write_text(growing / file, f"{heading}\n", ANOTHER_NAME)
    case = load_case(growing / "case.yaml")
    flow = solve_flow(case, {name: TRUTH[name] for name in case.parameters}).get("first")
    if flow is None:
        _clear(growing)
        raise InputError(f"{shown_path(into)}: no steady flow is found with these numbers; try a greater --depth.")
    _write_measurements(growing, flow, reach)
    write_text(growing / "README.md", file_text("readme.md.j2", words), ANOTHER_NAME)
    with failed_writes_told(into, ANOTHER_NAME):
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
