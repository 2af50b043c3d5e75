"""Forces on the water [m/s2]."""

import numpy as np

from vegglue.effect import Amplitude, Array, Cells, Effect

AIR_OVER_WATER = 1.2e-3


def wind(cells: Cells, speed: Array) -> dict[str, Array]:
    """f_x = C_w (rho_air / rho) |W| W / h, C_w = 1.3e-3."""
    stress = 1.3e-3 * AIR_OVER_WATER * np.abs(speed) * speed
    return {"x": stress / np.maximum(cells.depth, 0.05)}


EFFECTS = (
    Effect(
        name="wind",
        stage="force",
        title="Wind along the channel",
        equation="f_x = C_w (rho_air / rho) |W| W / h, C_w = 1.3e-3, h at least 0.05 m",
        act=wind,
        amplitude=Amplitude("speed", "m/s", "wind speed W downstream", 5.0, -30.0, 30.0, power=2),
        source="Garratt (1977)",
        doi="10.1175/1520-0493(1977)105<0915:RODCOO>2.0.CO;2",
        tags=("negative control",),
    ),
)
