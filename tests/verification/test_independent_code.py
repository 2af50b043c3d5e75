"""Against flows that other codes computed.

open-a, open-e: an explicit finite-volume code, truth given; Baptist's law, the floor of 1.3 and phi as it is where
plants emerge are its conventions too, and kappa was chosen on open-a, so that agreement does not test these. delft3d:
Delft3D-FLOW 6.04 on the channel of the paper, with another floor and another emergent rule; its flows lie in a folder
`shared` beside the repository, else that test is skipped.
"""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from channels import centres, even_geometry, make_problem, mixed, mixed_from, plants_at, solved, trapezoid
from open_cases import OPEN_CASES

from vegglue.case.grid import Grid
from vegglue.effects import bed_laws
from vegglue.flow.equations import faces
from vegglue.flow.problem import LEVEL
from vegglue.flow.sensor import read_sensors

pytestmark = pytest.mark.slow

DELFT3D = Path(__file__).parents[3] / "shared" / "cases" / "delft3d"
CELL = (0.5, 0.375)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def patch_cells(x, y, patches):
    """Column, row and patch number of the cells whose centre lies in a patch, {x: (from, to), y: (from, to)}."""
    found = [
        np.stack([*np.nonzero(((x > p["x"][0]) & (x < p["x"][1]))[:, None] & ((y > p["y"][0]) & (y < p["y"][1])))])
        for p in patches
    ]
    number = np.repeat(np.arange(len(patches)), [cells.shape[1] for cells in found])
    return *np.concatenate(found, axis=1), number


@cache
def with_the_truth(folder, finer, smallest):
    """The fourth flow of a case with its true parameters, on the paper's cells or on those of half the size (2)."""
    place, answer = (json.loads((folder / name).read_text("utf-8")) for name in ("site.json", "answer.json"))
    truth, run = answer["truth"], place["holdout"]["hold"]
    cells, size = (200 * finer, 24 * finer), (CELL[0] / finer, CELL[1] / finer)
    grid = Grid(centres(100.0, cells[0]), centres(9.0, cells[1]) - 4.5, *size)
    bed, banks = trapezoid(100.0, 4.5, cells)
    column, row, number = patch_cells(grid.x, grid.y, place["patches"])
    stems = np.array([patch["stems_per_m2"] for patch in place["patches"]])[number][:, None]
    plants = plants_at(column, row, truth["phi"] * stems / 22.0, truth["hd"], 60.0)
    changes = {
        "law": np.array([bed_laws.MANNING, bed_laws.KEULEGAN]),
        "coefficient": np.array([[truth["nb"]], [truth["ks"]]]),
        "friction_class": banks,
        "plants": plants,
        "viscosity": np.array([truth["nu"]]),
        "film": 0.002,
        "smallest_shear_depth": smallest,
        "geometry": even_geometry(bed, banks, size),
    }
    problem = make_problem(bed, size, run["discharge_m3_s"], run["downstream_level_m"], **changes)
    length = answer["settings"].get("mixk", 0.0)
    if finer == 1:
        return grid, *mixed(problem, length, 1e-8)
    return grid, *mixed_from(with_the_truth(folder, 1, smallest)[2], problem, length, 1e-8)


MISSED = pytest.mark.xfail(strict=True, raises=AssertionError, reason="data of their own cells, see DECISIONS")
HALVED = [pytest.mark.slow]


@pytest.mark.parametrize(
    ("case", "finer", "smallest", "everywhere", "inside"),
    [
        ("open-a", 1, False, 0.009, 0.005),
        ("open-e", 1, False, 0.009, 0.005),
        pytest.param("open-a", 2, False, 0.005, 0.003, marks=HALVED),
        pytest.param("open-e", 2, False, 0.005, 0.003, marks=[MISSED, *HALVED]),
        ("open-a", 1, True, 0.009, 0.005),
        ("open-e", 1, True, 0.009, 0.005),
        pytest.param("open-a", 2, True, 0.005, 0.003, marks=HALVED),
        pytest.param("open-e", 2, True, 0.005, 0.003, marks=[MISSED, *HALVED]),
    ],
)
def test_true_parameters_reproduce_the_holdout(case, finer, smallest, everywhere, inside):
    """Root mean square difference [m/s] at 105 stations, and at those within 2 m of the axis, measured:

        cells [m]        shear over the depth of its point   over the smallest around it
                         open-a         open-e               open-a         open-e
        0.5 x 0.375      0.0050 0.0035  0.0060 0.0039        0.0055 0.0025  0.0074 0.0047
        0.25 x 0.1875    0.0033 0.0023  0.0105 0.0047        0.0018 0.0020  0.0038 0.0031

    Laws of resistance, floor and emergent rule are the same in both codes, kappa was chosen on open-a: not tested here.
    The finer cells are those of the other code, which reconstructs depths at faces from the higher bed (Audusse et al.
    2004, doi:10.1137/S1064827503431090); that it does so for shear, too, is inferred from how open-a is met. Why open-e
    gets worse with the depth of the point: `test_independent_cells`. On cells of the coarser size the other code is
    0.006 (inside) and 0.016 m/s (banks) from its own result, on cells of half the finer size 0.002 and 0.003 (open-a).
    """
    folder = OPEN_CASES / case
    grid, problem, state = with_the_truth(folder, finer, smallest)
    station = pd.read_csv(folder / "holdout.csv").assign(kind="velocity")
    read = read_sensors(problem, state, grid, station, ()).prediction[0]
    difference, near = (read - station["u"]).to_numpy(), (station["y"].abs() <= 2.0).to_numpy()
    print(f"{case}, dx {grid.dx} m, smallest: {smallest}: {rms(difference):.4f} m/s, near {rms(difference[near]):.4f}")
    assert rms(difference) <= everywhere
    assert rms(difference[near]) <= inside


SEVEN = [{"x": (55.0 + 8.0 * n, 59.0 + 8.0 * n), "y": (6.0, 7.5) if n % 2 == 0 else (7.5, 9.0)} for n in range(7)]
FIRST_ROW = 8


def papers_channel(case, switched):
    """171 m of the paper's channel, 9 m of its width, with the resistance of one of Delft3D's two cases.

    switched: with shear over the smallest depth, and their floor of the bank law.
    """
    bed, classes = trapezoid(171.0, 4.5, (342, 24))
    column, row, _ = patch_cells(centres(171.0, 342), centres(15.0, 40)[FIRST_ROW : FIRST_ROW + 24], SEVEN)
    if case == "manning":
        classes[column, row] = 2
        changes = {"law": np.zeros(3, np.int64), "coefficient": np.array([[0.10], [0.12], [0.40]])}
    else:
        changes = {
            "law": np.array([bed_laws.MANNING, bed_laws.KEULEGAN]),
            "coefficient": np.array([[0.10], [2.7]]),
            "plants": plants_at(column, row, 40.0, 0.8, 60.0),
        }
    changes |= {"friction_class": classes, "viscosity": np.array([0.01]), "film": 0.002}
    if switched:
        changes |= {"smallest_shear_depth": True, "bank_argument_minimum": 1.0129}
    return make_problem(bed, CELL, 2.66, 1.1 - 0.171, **changes)


@pytest.mark.skipif(not DELFT3D.is_dir(), reason="no folder `shared/cases/delft3d` beside the repository")
@pytest.mark.parametrize("switched", [False, True])
@pytest.mark.parametrize("case", ["manning", "paper_laws"])
def test_delft3d(case, switched):
    """u in the wet cells of six sections: within 0.015 m/s root mean square, measured 0.0096 and 0.0108; with what can
    be switched to their conventions 0.0095 and 0.0112. Both codes have Baptist's law: not tested here.

    What differs: roughness on cell faces there, one depth a cell, the smaller of two depths on a face, land where
    12 h < 1.0129 k_s, inflow, advection. TELEMAC-2D and Delft3D differ by 0.002 beside a patch and 0.006 m/s in it.
    """
    theirs = pd.read_csv(DELFT3D / f"{case}.csv")
    problem = papers_channel(case, switched)
    state = solved(problem, 1e-8)
    now = faces(problem, state)
    u, level = 0.5 * (now.u[1:] + now.u[:-1])[..., 0], state[:, LEVEL, :, 0]
    cells = np.rint(theirs["x"] / 0.5 - 0.5).astype(int), np.rint(theirs["y"] / 0.375 - 0.5).astype(int) - FIRST_ROW
    assert np.abs(problem.bed[cells] - theirs["bed"]).max() < 2e-3
    apart = theirs.assign(u=u[cells] - theirs["u"], level=level[cells] - theirs["level"])
    apart["floor"] = (theirs["y"] - 7.5).abs() < 1.5
    table = {}
    for x in (30.0, 57.0, 65.0, 73.0, 100.0, 150.0):
        here = apart[(apart["x"] - x).abs() < 0.3]
        floor, bank = here[here["floor"]]["u"], here[~here["floor"]]["u"]
        table[x] = (rms(here["u"]), rms(floor), rms(bank), here["u"].abs().max(), here["level"].mean())
    print(f"\n{case}: less Delft3D-FLOW; u [m/s]: root mean square, floor, banks, largest; level [m]: mean")
    print(pd.DataFrame(table, index=["u", "floor", "banks", "largest", "level"]).T.round(4).to_string())
    overall = rms([row[0] for row in table.values()])
    print(f"six sections: {overall:.4f} m/s; all wet cells: {rms(apart['u']):.4f} m/s")
    assert overall < 0.015
    assert apart["level"].abs().mean() < 0.01
