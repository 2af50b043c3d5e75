"""Effects on lateral exchange of momentum: viscosity [m2/s] and momentum fluxes h T [m3/s2]."""

import numpy as np

from vegglue.effect import Amplitude, Array, Cells, Effect


def viscosity(cells: Cells, added: Array) -> dict[str, Array]:
    """nu -> nu + nu_1."""
    return {"viscosity": np.broadcast_to(added, cells.depth.shape)}


def mixing_length(cells: Cells, length: Array) -> dict[str, Array]:
    """nu -> nu + l^2 |du/dy|."""
    return {"viscosity": length**2 * np.abs(cells.u_y)}


def secondary_current(cells: Cells, strength: Array) -> dict[str, Array]:
    """h T_xy = K h u^2, K = k sin(pi eta) exp(-(eta/1.5)^4), eta the distance from the axis over the half width."""
    eta = cells.ground.offset
    return {"xy": strength * np.sin(np.pi * eta) * np.exp(-((eta / 1.5) ** 4)) * cells.depth * cells.u**2}


EFFECTS = (
    Effect(
        name="viscosity",
        stage="exchange",
        title="Eddy viscosity larger or smaller than assumed",
        equation="nu -> nu + nu_1",
        act=viscosity,
        amplitude=Amplitude("added", "m2/s", "viscosity nu_1 added", 0.02, -0.009, 0.5),
        source="definition",
        checked=True,
    ),
    Effect(
        name="mixing_length",
        stage="exchange",
        title="Turbulence made by lateral shear",
        equation="nu -> nu + l^2 |du/dy|",
        act=mixing_length,
        amplitude=Amplitude("length", "m", "mixing length l", 0.5, 0.0, 3.0, power=2),
        source="Prandtl (1925), doi:10.1002/zamm.19250050212",
        doi="10.1002/zamm.19250050212",
    ),
    Effect(
        name="secondary_current",
        stage="exchange",
        title="Secondary currents: mirrored cells carry momentum across the floor",
        equation="-(1/h) d(K h u^2)/dy with K = k sin(pi eta) exp(-(eta/1.5)^4), eta = 1 at the toe of the bank",
        act=secondary_current,
        amplitude=Amplitude("strength", "-", "strength k of the cells", 0.02, -0.2, 0.2),
        source="Ervine et al. (2000)",
        doi="10.1061/(ASCE)0733-9429(2000)126:9(653)",
    ),
)
