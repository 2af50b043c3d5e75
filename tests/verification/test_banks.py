"""Developed flow in the paper's section, over banks that fall dry, mixed by eddy viscosity or a mixing length.

    g h S - c_f |u| u + d/dy((nu + l^2 |du/dy|) h du/dy) = 0,    c_f = g / C^2,    h = 0 at the waterline.

The reference solves this on 1,900 cells whose outermost ends at the waterline.
"""

import numpy as np
import pytest
from channels import GRAVITY, centres, even_geometry, make_problem, mixed, mixed_from, trapezoid
from scipy.linalg import solve_banded

from vegglue.arrays import Array
from vegglue.effects import bed_laws
from vegglue.flow.equations import faces

FLOOR, BANK, SLOPE, DEPTH = 0.03, 0.3, 0.001, 1.1
# Developed flow is the same along the reach: 60 columns gave the same to 0.4 mm/s and 0.4 mm, for twice the time.
LENGTH, COLUMNS = 1500.0, 30
# Further out, what rows of 0.375 m put between their centres is wrong by 0.04 m/s however right they are.
STATIONS = np.linspace(-2.7, 0.0, 10)


def across(viscosity: float, length: float, cells: int = 1900) -> tuple[Array, float]:
    """u [m/s] at the stations and the discharge [m3/s] where the floor is DEPTH under water."""
    half = 1.5 + 1.5 * DEPTH
    y, edges = centres(2.0 * half, cells) - half, np.linspace(-half, half, cells + 1)
    width = edges[1] - edges[0]
    h, between = (DEPTH - np.maximum(np.abs(place) - 1.5, 0.0) / 1.5 for place in (y, edges[1:-1]))
    law = 18.0 * np.log10(np.maximum(12.0 * h / BANK, 1.3))
    rough = GRAVITY / np.where(np.abs(y) < 1.5, h ** (1.0 / 6.0) / FLOOR, law) ** 2
    u, change = np.full(cells, 0.5), 1.0
    while change > 1e-11:
        link = (viscosity + length**2 * np.abs(np.diff(u)) / width) * between / width
        bands = np.zeros((3, cells))
        bands[1] = 2.0 * rough * np.abs(u) * width + np.append(link, 0.0) + np.append(0.0, link)
        bands[0, 1:], bands[2, :-1] = -link, -link
        new = solve_banded((1, 1), bands, (GRAVITY * h * SLOPE + rough * u * np.abs(u)) * width)
        change, u = float(np.abs(new - u).max()), 0.5 * (u + new)
    return np.interp(STATIONS, y, u), float((u * h).sum() * width)


def developed(
    viscosity: float, length: float, flow: float, rows: int, smallest: bool, coarser: Array | None
) -> tuple[Array, float, Array]:
    """u [m/s] at the stations in the middle of a long reach, the depth on its floor [m] and the state; coarser: that on
    half the rows, to start from.
    """
    bed, banks = trapezoid(LENGTH, 4.5, (COLUMNS, rows))
    y = centres(9.0, rows) - 4.5
    problem = make_problem(
        bed,
        (LENGTH / COLUMNS, 9.0 / rows),
        flow,
        DEPTH - SLOPE * LENGTH,
        law=np.array([bed_laws.MANNING, bed_laws.KEULEGAN]),
        coefficient=np.array([[FLOOR], [BANK]]),
        friction_class=banks,
        viscosity=np.array([viscosity]),
        film=0.01,
        smallest_shear_depth=smallest,
        geometry=even_geometry(bed, banks, (LENGTH / COLUMNS, 9.0 / rows)),
    )
    whole = mixed(problem, length, 1e-6) if coarser is None else mixed_from(coarser, problem, length, 1e-6)
    found, i = faces(*whole), COLUMNS // 2
    u = np.interp(STATIONS, y, found.u[i, :, 0])
    return u, float(found.cell[i, rows // 2, 0]), whole[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("viscosity", "length", "smallest", "coarse", "fine", "shallow"),
    [
        (0.01, 0.0, False, 5e-3, 1e-3, 1e-3),
        (0.05, 0.0, False, 0.015, 5e-3, 4e-3),
        (0.01, 0.5, False, 0.03, 7e-3, 7e-3),
        (0.01, 0.0, True, 7e-3, 4e-3, 3e-3),
        (0.05, 0.0, True, 0.04, 0.02, 0.02),
        (0.01, 0.5, True, 0.07, 0.035, 0.04),
    ],
)
def test_velocity_and_depth_where_banks_fall_dry(
    viscosity: float, length: float, smallest: bool, coarse: float, fine: float, shallow: float
) -> None:
    """On rows of 0.375, 0.1875 and 0.094 m wrong by 0.003, 0.001 and 0.001 m/s, depths by 0.2 mm at most; with five
    times that viscosity by 0.012, 0.008 and 0.004 m/s, 10, 6 and 4 mm; mixed over 0.5 m by 0.026, 0.019 and 0.006 m/s,
    27, 20 and 7 mm, all too shallow: what is mixed well feels the shallow end of a cell more than its mean says.
    With shear over the smallest depth by 0.006, 0.005, 0.003 m/s; 0.036, 0.027, 0.017; 0.066, 0.060, 0.032.
    """
    exact, flow = across(viscosity, length)
    errors, depths, state = [], [], None
    for rows in (24, 48, 96):
        u, depth, state = developed(viscosity, length, flow, rows, smallest, state)
        errors.append(float(np.sqrt(np.mean((u - exact) ** 2))))
        depths.append(depth - DEPTH)
    told = ", ".join(f"{e:.4f} m/s, {1e3 * d:.1f} mm" for e, d in zip(errors, depths, strict=True))
    print(f"nu {viscosity}, l {length}, smallest {smallest}: {told}")
    assert errors[0] > errors[1] > errors[2]
    assert errors[0] < coarse
    assert errors[2] < fine
    assert abs(depths[2]) < shallow
