"""Effects on lateral exchange of momentum: viscosity [m2/s] and momentum fluxes h T [m3/s2], (nx, ny, m), added.

Parameters are (m,); unit and meaning of each stand in EFFECTS, with the source of the formula.
"""

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.definition import Amplitude, Effect, Shape
from vegglue.effects.physical_constants import KARMAN
from vegglue.effects.surroundings import Cells

# Smallest depth over the mean one [-]: towards the waterline their ratio would grow without end.
LEAST_RELATIVE_DEPTH = 0.2
# Secondary currents fade out from here, in half widths from the axis: on the banks they have no room to turn.
CURRENTS_END = 1.5
# Speed over that of the site [-], whose square is added to |U|^2: slower water has no direction that would show a bend.
STILL = 0.1
# Mixing length over the width of a shear layer [-] (van Prooijen et al. 2005).
MIXING_OF_LAYER = 0.07
# a [-] at which b of `helical_flow` is held: the formula is for smoother beds.
LARGEST_ROUGHNESS = 0.5


def viscosity(cells: Cells, added: Array) -> dict[str, Array]:
    """nu -> nu + nu_1."""
    return {"viscosity": np.broadcast_to(added, cells.depth.shape)}


def elder(cells: Cells, coefficient: Array) -> dict[str, Array]:
    """nu -> nu + lambda h u*."""
    return {"viscosity": coefficient * cells.depth * cells.shear_velocity}


def smagorinsky(cells: Cells, coefficient: Array) -> dict[str, Array]:
    """nu -> nu + (C_s Delta)^2 (2 u_x^2 + 2 v_y^2 + (u_y + v_x)^2)^(1/2), Delta the width of the filter [m].

    Delta is that of the case's own cells, on the coarser and finer grids of a diagnosis, too.
    """
    strain = 2.0 * cells.u_x**2 + 2.0 * cells.v_y**2 + (cells.u_y + cells.v_x) ** 2
    seen = cells.geometry
    return {"viscosity": (coefficient * seen.filter_width) ** 2 * seen.stretch * np.sqrt(strain)}


def mixing_length(cells: Cells, length: Array) -> dict[str, Array]:
    """nu -> nu + l^2 |du/dy|."""
    return {"viscosity": length**2 * np.abs(cells.u_y)}


def edge_mixing(cells: Cells, coefficient: Array, width: Array) -> dict[str, Array]:
    """nu -> nu + c d^2 |du/dy| exp(-(e / d)^2), e the distance from the side of a patch [m].

    d |du/dy| is the difference of speed across the layer of width d.
    """
    band = np.exp(-((cells.geometry.edge / width) ** 2))
    return {"viscosity": coefficient * width**2 * band * np.abs(cells.u_y)}


def coherent_structures(cells: Cells, coefficient: Array, width: Array, mean_depth: Array) -> dict[str, Array]:
    """nu -> nu + b^2 d^2 (h_m / h) |du/dy|, h at least h_m / 5, h_m the depth between the deep and the shallow part."""
    shallow = mean_depth / np.maximum(cells.depth, LEAST_RELATIVE_DEPTH * mean_depth)
    return {"viscosity": coefficient**2 * width**2 * shallow * np.abs(cells.u_y)}


def growing_shear_layer(cells: Cells, spreading: Array, rate: Array) -> dict[str, Array]:
    """nu -> nu + (b d)^2 |du/dy|, d = s (1 - exp(-2 k x)) / (2 k), x the distance from the inflow.

    A layer of width 0 at the inflow grows by s dx, until friction of the bed has used up the difference of speeds. Its
    eddies reach into both streams: k is c_f / h of the whole section, not that of a cell.

    Parameters
    ----------
    spreading : (m,) [-]
        growth s of its width, some 0.085 times the difference of both speeds over their mean.
    rate : (m,) [1/m]
        k, friction of the section over its depth.

    Returns
    -------
    dict
        `viscosity` (nx, ny, m) [m2/s].
    """
    along = (0.5 + cells.geometry.share_along) * cells.geometry.length
    width = spreading * -np.expm1(-2.0 * rate * along) / (2.0 * rate)
    return {"viscosity": (MIXING_OF_LAYER * width) ** 2 * np.abs(cells.u_y)}


def wake_mixing(cells: Cells, coefficient: Array, length: Array) -> dict[str, Array]:
    """nu -> nu + c |U| exp(-s / L) behind a patch, s the distance from its end [m]."""
    return {"viscosity": coefficient * np.exp(-cells.geometry.wake / length) * cells.speed}


def secondary_current(cells: Cells, strength: Array) -> dict[str, Array]:
    """h T_xy = K h u^2, K = k sin(pi eta) exp(-(eta/1.5)^4), eta the distance from the axis over the half width."""
    eta = cells.geometry.offset
    return {"xy": strength * (np.sin(np.pi * eta) * np.exp(-((eta / CURRENTS_END) ** 4))) * cells.depth * cells.u**2}


def dispersion(cells: Cells, excess: Array) -> dict[str, Array]:
    """h T = (beta - 1) h (u^2, u v, v^2)."""
    carried = excess * cells.depth
    return {"xx": carried * cells.u**2, "xy": carried * cells.u * cells.v, "yy": carried * cells.v**2}


def curvature(cells: Cells) -> Array:
    """r = h (u^2 v_x - v^2 u_y + u v (v_y - u_x)) / |U|^3, depth over radius of the bend, as r / (1 + 4 r^2)^(1/2) [-].

    Positive where the flow turns towards larger y, and never above 1/2: no bend is narrower than it is deep. |U|^2 is
    u^2 + v^2 + (0.1 U)^2, U the speed of the site, so that water at rest has no bend.

    Returns
    -------
    (nx, ny, m) [-]
    """
    u, v = cells.u, cells.v
    turn = u**2 * cells.v_x - v**2 * cells.u_y + u * v * (cells.v_y - cells.u_x)
    bend = cells.depth * turn / (u**2 + v**2 + (STILL * cells.geometry.speed_scale) ** 2) ** 1.5
    return bend / np.sqrt(1.0 + 4.0 * bend**2)


def helical_flow(cells: Cells, share: Array) -> dict[str, Array]:
    """h T_sn = -s b h (h / R) |U|^2, b = 5 a - 15.6 a^2 + 37.5 a^3, a = (k_bed h)^(1/2) / kappa at most 1/2.

    It carries fast water to the outside of the bend; s is along the flow, n across it.
    """
    a = np.minimum(np.sqrt(cells.bed_rate * cells.depth) / KARMAN, LARGEST_ROUGHNESS)
    carried = share * (5.0 * a - 15.6 * a**2 + 37.5 * a**3) * cells.depth * curvature(cells)
    along = 2.0 * carried * cells.u * cells.v
    return {"xx": along, "xy": -carried * (cells.u**2 - cells.v**2), "yy": -along}


BAND = "width d of the layer"
EFFECTS = (
    Effect(
        name="viscosity",
        stage="exchange",
        title="Eddy viscosity larger or smaller than assumed",
        equation="nu -> nu + nu_1",
        act=viscosity,
        amplitude=Amplitude(
            "added",
            "m2/s",
            "viscosity nu_1 added",
            0.15,
            -0.9,
            5.0,
            of="eddy",
            low_of="viscosity",
            basis="0.15 h u*, Fischer et al. (1979) for straight flumes",
        ),
        source="definition",
        checked=True,
    ),
    Effect(
        name="elder",
        stage="exchange",
        title="Turbulence made by the bed",
        equation="nu -> nu + lambda h u*, u* = (k_bed h)^(1/2) |U|",
        act=elder,
        amplitude=Amplitude(
            "coefficient",
            "-",
            "lambda, some 0.07 to 0.5",
            0.2,
            0.0,
            5.0,
            basis="between 0.07 of a log law and 0.6 of natural streams, Fischer et al. (1979), the mean of both logs",
        ),
        source="Elder (1959)",
        doi="10.1017/S0022112059000374",
    ),
    Effect(
        name="smagorinsky",
        stage="exchange",
        title="Eddies smaller than a cell, made by any shear",
        equation="nu -> nu + (C_s D)^2 (2 u_x^2 + 2 v_y^2 + (u_y + v_x)^2)^(1/2), D = (dx dy)^(1/2)",
        act=smagorinsky,
        amplitude=Amplitude("coefficient", "-", "coefficient C_s, some 0.1 to 0.2", 0.3, 0.0, 3.0, power=2),
        source="Smagorinsky (1963)",
        read_in="TELEMAC-2D (smagor.f)",
        doi="10.1175/1520-0493(1963)091<0099:GCEWTP>2.3.CO;2",
    ),
    Effect(
        name="mixing_length",
        stage="exchange",
        title="Turbulence made by lateral shear",
        equation="nu -> nu + l^2 |du/dy|",
        act=mixing_length,
        amplitude=Amplitude(
            "length",
            "m",
            "mixing length l",
            0.5,
            0.0,
            3.0,
            power=2,
            of="depth",
            basis="6 times the vertical one of 0.09 h, Stansby (2003), doi:10.1017/S0022112003006384",
        ),
        source="Prandtl (1925)",
        doi="10.1002/zamm.19250050212",
    ),
    Effect(
        name="edge_mixing",
        stage="exchange",
        title="A mixing layer along the sides of the plants",
        equation="nu -> nu + c d^2 |du/dy| exp(-(e/d)^2), e the distance from the side of a patch",
        act=edge_mixing,
        amplitude=Amplitude("coefficient", "-", "c, viscosity over speed difference times width", 0.2, 0.0, 5.0),
        shapes=(Shape("width", "m", BAND, 0.4, 0.03, 3.3, (0.2, 0.4, 0.8), "half_width"),),
        source="after White and Nepf (2008)",
        doi="10.1029/2006WR005651",
        needs=("plants",),
    ),
    Effect(
        name="coherent_structures",
        stage="exchange",
        title="Large horizontal eddies between deep and shallow water",
        equation="nu -> nu + b^2 d^2 (h_m/h) |du/dy|, h at least h_m/5",
        act=coherent_structures,
        amplitude=Amplitude(
            "coefficient", "-", "b, some 0.07", 0.1, 0.0, 1.0, power=2, basis="0.07 of its source, to one digit up"
        ),
        shapes=(
            Shape("width", "m", BAND, 1.0, 0.05, 13.0, of="half_width"),
            Shape("mean_depth", "m", "depth h_m between both", 1.0, 0.05, 10.0, of="mean_depth"),
        ),
        source="van Prooijen, Battjes and Uijttewaal (2005)",
        doi="10.1061/(ASCE)0733-9429(2005)131:3(175)",
    ),
    Effect(
        name="growing_shear_layer",
        stage="exchange",
        title="A shear layer that grows from the inflow, between fast and slow water side by side",
        equation="nu -> nu + (0.07 d)^2 |du/dy|, d = s (1 - exp(-2 k x))/(2 k), x the distance from the inflow",
        act=growing_shear_layer,
        amplitude=Amplitude(
            "spreading",
            "-",
            "growth s of its width, some 0.085",
            0.1,
            0.0,
            1.0,
            power=2,
            basis="0.085 of its source for speeds that differ by their mean, to one digit up",
        ),
        shapes=(Shape("rate", "1/m", "c_f / h of the section k", 1.0, 0.05, 20.0, (0.5, 1.0, 2.0), "friction"),),
        source="after van Prooijen and Uijttewaal (2002)",
        doi="10.1063/1.1514660",
        needs=("two streams",),
    ),
    Effect(
        name="wake_mixing",
        stage="exchange",
        title="Eddies shed behind the plants",
        equation="nu -> nu + c |U| exp(-s/L), s the distance downstream of a patch",
        act=wake_mixing,
        amplitude=Amplitude(
            "coefficient", "m", "c, viscosity over speed at the end of the patch", 0.03, 0.0, 0.6, of="patch_width"
        ),
        shapes=(Shape("length", "m", "length L over which they fade", 3.3, 0.13, 66.0, (1.3, 5.3), "patch_width"),),
        source="after Zong and Nepf (2012)",
        doi="10.1017/jfm.2011.479",
        needs=("plants",),
    ),
    Effect(
        name="secondary_current",
        stage="exchange",
        title="Secondary currents: mirrored cells carry momentum across the floor",
        equation="-(1/h) d(K h u^2)/dy with K = k sin(pi eta) exp(-(eta/1.5)^4), eta = 1 at the toe of the bank",
        act=secondary_current,
        amplitude=Amplitude(
            "strength",
            "-",
            "strength k of the cells",
            0.02,
            -0.2,
            0.2,
            basis="between 0.005 of straight and 0.05 of meandering channels, its source, the mean of both logs",
        ),
        source="Ervine et al. (2000)",
        doi="10.1061/(ASCE)0733-9429(2000)126:9(653)",
    ),
    Effect(
        name="dispersion",
        stage="exchange",
        title="Velocity varies over the depth, so that more momentum is carried than by its mean",
        equation="-(1/h) div((beta - 1) h U U)",
        act=dispersion,
        amplitude=Amplitude(
            "excess",
            "-",
            "beta - 1, momentum coefficient less one",
            0.1,
            0.0,
            1.0,
            basis="beta = 1.10 of natural streams, Chow (1959), table 2-1",
        ),
        source="definition",
        checked=True,
    ),
    Effect(
        name="helical_flow",
        stage="exchange",
        title="Spiral flow in bends carries fast water outward",
        equation="h T_sn = -s b h (h/R) |U|^2, b = 5 a - 15.6 a^2 + 37.5 a^3, a = (k_bed h)^(1/2)/kappa",
        act=helical_flow,
        amplitude=Amplitude("share", "-", "strength s, 1 for a spiral in balance", 0.5, -3.0, 3.0),
        source="Kalkwijk and Booij (1986)",
        read_in="Delft3D-FLOW (vihsec.f90, secrhs.f90)",
        doi="10.1080/00221688609499330",
    ),
)
