"""Effects that push the water: forces along x and y [m/s2] (nx, ny, m), which are added.

Parameters are (m,); unit and meaning of each stand in EFFECTS, with the source of the formula.
"""

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.definition import Amplitude, Effect, Shape
from vegglue.effects.physical_constants import AIR_OVER_WATER, GRAVITY
from vegglue.effects.surroundings import Cells

WIND_DRAG = 1.3e-3  # C_w [-], of winds of some 8 m/s by Garratt (1977)
LEAST_WINDY_DEPTH = 0.05  # over that of the site [-]; a stress on less water would be a force without end


def wind(cells: Cells, speed: Array) -> dict[str, Array]:
    """f_x = C_w (rho_air / rho) |W| W / h, C_w = 1.3e-3, h at least 0.05 of that of the site."""
    stress = WIND_DRAG * AIR_OVER_WATER * np.abs(speed) * speed
    return {"x": stress / np.maximum(cells.depth, LEAST_WINDY_DEPTH * cells.geometry.depth_scale)}


def panel_current(cells: Cells, strength: Array, slope: Array, bank_ratio: Array) -> dict[str, Array]:
    """f = -k g S u / |U| on the floor, r times that on the banks; nothing at rest."""
    bank = cells.geometry.bank
    held = -strength * GRAVITY * slope * (1.0 - bank + bank_ratio * bank) / cells.speed
    return {"x": held * cells.u, "y": held * cells.v}


def turning_earth(cells: Cells, parameter: Array) -> dict[str, Array]:
    """f_x = c v, f_y = -c u."""
    return {"x": parameter * cells.v, "y": -parameter * cells.u}


EFFECTS = (
    Effect(
        name="wind",
        stage="force",
        title="Wind along the channel",
        equation="f_x = C_w (rho_air / rho) |W| W / h, C_w = 1.3e-3, h at least 0.05 of that of the site",
        act=wind,
        amplitude=Amplitude("speed", "m/s", "wind speed W downstream", 5.0, -30.0, 30.0, power=2),
        source="Garratt (1977)",
        read_in="RegCM, where C_w is 1.29e-3 at 8 m/s",
        doi="10.1175/1520-0493(1977)105<0915:RODCOO>2.0.CO;2",
        tags=("negative control",),
        needs=("open air",),
    ),
    Effect(
        name="panel_current",
        stage="force",
        title="Secondary currents: the floor loses momentum that the banks gain",
        equation="f = -k g S on the floor, -r k g S on the banks, along the flow (Gamma = k rho g h S)",
        act=panel_current,
        amplitude=Amplitude("strength", "-", "strength k = Gamma / (rho g h S) on the floor", 0.1, -0.8, 0.8),
        shapes=(
            Shape("slope", "-", "slope S that drives the flow", 1.0, 0.001, 50.0, of="slope"),
            Shape("bank_ratio", "-", "strength r on the banks over that on the floor", -1.0, -3.0, 3.0, (-1.0, 0.0)),
        ),
        source="Shiono and Knight (1991); values of k by Abril and Knight (2004)",
        doi="10.1017/S0022112091001246",
    ),
    Effect(
        name="turning_earth",
        stage="force",
        title="The rotation of the earth",
        equation="f_x = c v, f_y = -c u, to the right on the northern half of the earth",
        act=turning_earth,
        amplitude=Amplitude("parameter", "1/s", "Coriolis parameter c", 1e-4, -1.5e-4, 1.5e-4),
        source="definition",
        checked=True,
        mirrored=False,
        tags=("negative control",),
        needs=("open air",),
    ),
)
