"""The open-channel confluence set of R.B. Canelas (GitHub, Confluence-velocity-dataset-2021, GPL-3.0) -> a case.

The set is not part of this project: a user downloads it. Its folder holds bed.csv (x_m, y_m, z_bed_m), water_level.csv
(x_m, y_m, z_ws_m) and depth_averaged.csv (verticals: x_m, y_m, h_m, U_depthavg_ms, V_depthavg_ms, bed_extrapolated).
x runs downstream from the upstream corner of the junction; the side inflow comes through the wall at y = 0. What the
calibration needs of it is written into a folder beside the config.
"""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.case.resolved_config import Tree
from vegglue.case.text_files import case_name, write_text
from vegglue.errors import InputError, shown_path
from vegglue.importers.config_parts import (
    FIRST_LOOK,
    MANNING_BED,
    bed_prior,
    even,
    loguniform_prior,
    normal_prior,
    observed,
    validated,
    wall_prior,
)
from vegglue.measurements.csv_table import read_table

EXPERIMENT = "measured"
# Length of a cell, and about its width [m].
CELL = 0.05
# The authors do not give the width of the tributary [m]: assumed.
CONFLUENCE_WIDTH = 0.15
# No errors are given. Velocities: a share for the rule of averaging over the depth, and so much besides [m/s].
RULE, BESIDES = 0.02, 0.01
# Turn of a probe against the axis of the flume [rad], not stated: 3 degrees, as set by eye. It shows in the velocities
# across, whose means over the last four sections, where walls leave them no place, are -0.05 to -0.11 of those along.
TURN = 0.05
# Manning's n of the walls [s m^(-1/3)], whose material is not stated: glass 0.010, wood 0.012 (Chow 1959, table 5-6).
WALL = 0.011
# Levels are means of so many blocks across, and as long; what is left of their error [m].
BLOCKS, LEVEL_ERROR = 3, 0.001
# Spread of the priors of what integration of the sections gives [-], and of the level at the outlet [m].
UPSTREAM, SIDE, OUTLET = 0.05, 0.5, 0.002

# What `import` says of the set.
NOT_STATED = (
    "The set states no discharges, no errors, no walls and no width of the side channel, and so is assumed: discharges "
    f"by integration of sections, {100 * RULE:.0f} % and {BESIDES:g} m/s for velocities, {1000 * LEVEL_ERROR:.0f} mm "
    f"for levels, n = {WALL:g} s m^(-1/3) for walls, {CONFLUENCE_WIDTH:g} m for the side channel.",
    "Every second section is held out, to judge a model by. A second config, `-flat`, has a plane for the bed.",
)


def holds_confluence(folder: Path) -> bool:
    """Whether a folder is laid out as the confluence set."""
    return (folder / "depth_averaged.csv").is_file()


def case_from_confluence(folder: Path, target: Path) -> Tree:
    """The config, as keys and values, of the set in a folder; every second section is held out as validation.

    Files are written into a folder beside `target`. Errors: InputError for what cannot be read.
    """
    bed = _columns(folder / "bed.csv", "x_m", "y_m", "z_bed_m")
    level = _columns(folder / "water_level.csv", "x_m", "y_m", "z_ws_m")
    vertical = _columns(folder / "depth_averaged.csv", "x_m", "y_m", "h_m", "U_depthavg_ms", "bed_extrapolated")
    width = float(bed[:, 1].max())
    grid = _grid(bed, vertical, width)
    across = _across(folder / "depth_averaged.csv")
    angle = _angle(vertical, across)
    vertical = np.column_stack([vertical, across])
    # Where the bed is not known there is no depth to average over; and the tributary itself is not modelled.
    vertical = vertical[(vertical[:, 4] == 0) & (vertical[:, 1] > 0.0) & (vertical[:, 1] < width)]
    sections = np.unique(vertical[:, 0])
    blocks = _blocks(level, grid, width)
    into = target.with_name(f"{target.stem}-data")
    _write(into / "bed.csv", "x,y,z", _to_the_walls(bed, width))
    _write(into / "levels.csv", "x,y,level,level_se", blocks)
    seen, unseen = (vertical[np.isin(vertical[:, 0], part)] for part in (sections[::2], sections[1::2]))
    return {
        "name": case_name(target.stem),
        "title": "Open-channel confluence, measured by others",
        "grid": grid,
        "bed": [{"points": f"{into.name}/bed.csv"}],
        "friction": {"classes": {"bed": MANNING_BED}, "default": "bed", "walls": {"law": "manning", "n": "n_w"}},
        "inflows": {
            "upstream": {"side": "west", "spread": "conveyance"},
            "side": {"side": "south", "range": [0.0, CONFLUENCE_WIDTH], "spread": "uniform", "angle": angle},
        },
        "outlet": {},
        "eddy_viscosity": "eddy_viscosity",
        "experiments": {EXPERIMENT: _setting()},
        "parameters": _priors(seen, blocks, width),
        "observations": [*_velocities(into, "velocities", seen), _observation("level", into, "levels")],
        **validated({EXPERIMENT: _setting()}, _velocities(into, "held_out", unseen)),
        "numerics": {"film_depth": 0.002},
        **FIRST_LOOK,
    }


def flat_bed(folder: Path, parent: Path) -> Tree:
    """A config that extends that of the set by the plane, level across, that fits its bed best."""
    bed = _columns(folder / "bed.csv", "x_m", "y_m", "z_bed_m")
    grid = _grid(bed, _columns(folder / "depth_averaged.csv", "x_m", "y_m"), float(bed[:, 1].max()))
    (low, high), (_, width) = grid["x"], grid["y"]
    inside = (bed[:, 0] >= low) & (bed[:, 0] <= high)
    slope, level = np.polyfit(bed[inside, 0] - low, bed[inside, 2], 1)
    plane = {"axis": width / 2, "bottom_width": 2 * width, "bank_slope": 1.0}
    plane |= {"bed_slope": round(float(-slope), 6), "level": round(float(level), 5)}
    return {
        "extends": parent.name,
        "name": f"{case_name(parent.stem)}-flat",
        "title": "Open-channel confluence, its bed taken as a plane",
        "bed": [{"trapezoid": plane}],
    }


def discharge(y: Array, unit: Array, width: float) -> float:
    """Q = int_0^B h U dy [m3/s] by trapezoids, constant from the outermost verticals to the walls."""
    order = np.argsort(y)
    across, inner = np.concatenate([[0.0], y[order], [width]]), unit[order]
    return float(np.trapezoid(np.concatenate([inner[:1], inner, inner[-1:]]), across))


def _priors(vertical: Array, blocks: Array, width: float) -> Tree:
    sections = np.unique(vertical[:, 0])
    flows = []
    for x in sections:
        here = vertical[vertical[:, 0] == x]
        flows.append(discharge(here[:, 1], here[:, 2] * here[:, 3], width))
    above, below = np.array(flows)[sections <= 0.0], np.array(flows)[sections > 4.0 * CONFLUENCE_WIDTH]
    before = float(above.mean())
    side = max(float(below.mean()) - before, 0.02 * before)
    level = float(blocks[blocks[:, 0] > blocks[:, 0].max() - 0.5 * width, 2].mean())
    return {
        "discharge": normal_prior(
            _rounded(before), _rounded(UPSTREAM * before), "m3/s", "Q", "discharge from upstream"
        ),
        "side_discharge": normal_prior(
            _rounded(side), _rounded(SIDE * side), "m3/s", "Q_s", "discharge from the side, which is not stated",
            low=_rounded(0.02 * side), high=_rounded(3.0 * side),
        ),
        "outlet_level": normal_prior(_rounded(level), OUTLET, "m", "z_out", "water level at the outlet"),
        "n_b": bed_prior(0.005, 0.05),
        "n_w": wall_prior(WALL),
        "eddy_viscosity": loguniform_prior(3e-5, 1e-2, "m2/s", "ν", "eddy viscosity"),
    }  # fmt: skip


def _across(path: Path) -> Array:
    """V (vertical,) [m/s], NaN where none was measured. Errors: InputError, naming the row, for what is no number."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        texts = [row.get("V_depthavg_ms") or "nan" for row in csv.DictReader(file)]
    return np.array([_number(path, row, text) for row, text in enumerate(texts, 2)])


def _number(path: Path, row: int, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        complaint = f"expected a number or nothing in column V_depthavg_ms, got {text!r}; correct it"
        raise InputError(f"{shown_path(path)}, row {row}: {complaint}.") from None


def _angle(vertical: Array, v: Array) -> float:
    """Where the water heads in the mouth of the tributary, y <= 0, from downstream [degrees]; 90 where none was
    measured.
    """
    inside = (vertical[:, 1] <= 0.0) & ~np.isnan(v)
    along, across = vertical[inside, 3].sum(), v[inside].sum()
    return round(float(np.degrees(np.arctan2(across, along))), 1) if across > 0.0 else 90.0


def _grid(bed: Array, vertical: Array, width: float) -> Tree:
    """From just above the first section to just beyond the last one; edges of coarser cells meet the junction.

    Smooth flumes are too short to change how water is spread across (C^2 h / 2 g is some metres), and the bed at the
    end of the map need not show it: so it enters where its spread is measured.
    """
    coarse = 4.0 * CELL
    low = max(np.floor((vertical[:, 0].min() - 0.5 * width) / coarse), np.ceil(bed[:, 0].min() / coarse - 1e-9))
    high = min(np.ceil(vertical[:, 0].max() / coarse) + 1, np.floor(bed[:, 0].max() / coarse + 1e-9))
    rows = even(width / CELL)
    return {
        "x": [round(float(low) * coarse, 6), round(float(high) * coarse, 6)],
        "y": [0.0, width],
        "cell": [CELL, _rounded(width / rows, 9)],
    }


def _to_the_walls(bed: Array, width: float) -> Array:
    """The map, with the outermost level of each cross-section carried on to the walls."""
    added = []
    for x in np.unique(bed[:, 0]):
        here = bed[bed[:, 0] == x]
        for edge, row in ((0.0, here[here[:, 1].argmin()]), (width, here[here[:, 1].argmax()])):
            if row[1] != edge:
                added.append([x, edge, row[2]])
    return np.vstack([bed, np.array(added).reshape(-1, 3)])


def _blocks(level: Array, grid: Tree, width: float) -> Array:
    """Means of the water level in squares, with their standard error: (block, 4) of x, y, level, error."""
    size = width / BLOCKS
    low, high = grid["x"]
    inside = level[(level[:, 0] > low) & (level[:, 0] < high) & (level[:, 1] < width)]
    number = np.floor((inside[:, :2] - [low, 0.0]) / size)
    found = []
    for block in np.unique(number, axis=0):
        here = inside[(number == block).all(axis=1)]
        if len(here) > 4:
            own = here[:, 2].std(ddof=1) / np.sqrt(len(here))
            found.append([*here.mean(axis=0), np.hypot(own, LEVEL_ERROR)])
    return np.array(found)


def _stations(vertical: Array) -> list[list[float | str]]:
    """Rows section, x, y, u and its error; a small turn of the probe changes u by its square only."""
    return [[f"x{x:+.2f}", x, y, u, float(np.hypot(RULE * u, BESIDES))] for x, y, _, u, _, _ in vertical.tolist()]


def _stations_across(vertical: Array) -> list[list[float | str]]:
    """Rows section, x, y, v and its error, which has a share of u; not all verticals have v."""
    return [
        [f"x{x:+.2f}", x, y, v, float(np.linalg.norm([RULE * v, BESIDES, TURN * u]))]
        for x, y, _, u, _, v in vertical[~np.isnan(vertical[:, 5])].tolist()
    ]


def _setting() -> Tree:
    return {"discharge": {"upstream": "discharge", "side": "side_discharge"}, "level": "outlet_level"}


def _velocities(into: Path, name: str, vertical: Array) -> list[Tree]:
    """Velocities along, and across if there are any, written and named."""
    _write(into / f"{name}.csv", "section,x,y,u,u_se", _stations(vertical))
    found = [_observation("velocity", into, name)]
    if across := _stations_across(vertical):
        _write(into / f"{name}_across.csv", "section,x,y,v,v_se", across)
        found.append(_observation("velocity_across", into, f"{name}_across"))
    return found


def _observation(kind: str, into: Path, name: str) -> Tree:
    return observed(kind, f"{into.name}/{name}.csv", EXPERIMENT)


def _columns(path: Path, *names: str) -> Array:
    return np.asarray(read_table(path, (), names).to_numpy(), dtype=np.float64)


def _rounded(value: float, digits: int = 5) -> float:
    return round(value, digits)


def _write(path: Path, heading: str, rows: Sequence[Sequence[float | str]] | Array) -> None:
    lines = [",".join(cell if isinstance(cell, str) else f"{cell:.5f}" for cell in row) for row in rows]
    write_text(path, "\n".join([heading, *lines]) + "\n", "give another place by --to")
