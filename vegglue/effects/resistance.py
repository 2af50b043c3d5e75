"""Effects on the friction rate k = g / (C^2 h) [1/m] (nx, ny, m), beyond the laws of the friction classes.

Parameters are (m,); unit and meaning of each stand in EFFECTS, with the source of the formula.
"""

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.definition import Amplitude, Effect, Shape
from vegglue.effects.surroundings import Cells

# Depth over that of the site [-] below which a law that depends on it stays as it is: its power would be infinite where
# there is no water.
LEAST_DEPTH_OF_POWER = 0.02


def depth_dependent_bank(cells: Cells, exponent: Array, reference_depth: Array) -> dict[str, Array]:
    """k -> k (h / h_0)^e on the banks, h at least 0.02 of that of the site."""
    depth = cells.depth.clip(LEAST_DEPTH_OF_POWER * cells.geometry.depth_scale)
    return {"rate": cells.rate * (depth / reference_depth) ** (exponent * cells.geometry.bank)}


def depth_dependent_bed(cells: Cells, exponent: Array, reference_depth: Array) -> dict[str, Array]:
    """k -> k (h / h_0)^e on the floor where no plants stand, h at least 0.02 of that of the site."""
    depth = cells.depth.clip(LEAST_DEPTH_OF_POWER * cells.geometry.depth_scale)
    return {"rate": cells.rate * (depth / reference_depth) ** (exponent * cells.geometry.open_floor)}


def bank_trend(cells: Cells, trend: Array) -> dict[str, Array]:
    """k -> k exp(a (x - x_m) / L) on the banks, x_m the middle of the grid and L its length."""
    return {"rate": cells.rate * np.exp(trend * cells.geometry.bank * cells.geometry.share_along)}


def bank_drag_trend(cells: Cells, drag: Array, direction: Array) -> dict[str, Array]:
    """k -> k + c (1/2 + d (x - x_m) / L) on the banks."""
    return {"rate": cells.rate + drag * (0.5 + direction * cells.geometry.share_along) * cells.geometry.bank}


def bed_trend(cells: Cells, trend: Array) -> dict[str, Array]:
    """k -> k exp(a (x - x_m) / L) on the floor where no plants stand."""
    return {"rate": cells.rate * np.exp(trend * cells.geometry.open_floor * cells.geometry.share_along)}


def bank_difference(cells: Cells, log_ratio: Array) -> dict[str, Array]:
    """k -> k exp(+-a / 2) on the banks, + on that of larger y."""
    return {"rate": cells.rate * np.exp(0.5 * log_ratio * cells.geometry.bank * np.sign(cells.geometry.offset))}


def bank_roughness(cells: Cells, log_ratio: Array) -> dict[str, Array]:
    """k -> k exp(a) beyond the toe of the banks: another surface than the floor's."""
    return {"rate": cells.rate * np.exp(log_ratio * cells.geometry.bank)}


def floor_difference(cells: Cells, log_ratio: Array) -> dict[str, Array]:
    """k -> k exp(+-a / 2) on the floor where no plants stand, + on the side of larger y."""
    return {"rate": cells.rate * np.exp(0.5 * log_ratio * cells.geometry.open_floor * np.sign(cells.geometry.offset))}


def bed_stretch(cells: Cells, log_ratio: Array, middle: Array, share: Array) -> dict[str, Array]:
    """k -> k exp(a g) on the floor where no plants stand, g = exp(-((x / L - c) / (s / 2))^4), x / L -1/2 .. 1/2."""
    within = np.exp(-(((cells.geometry.share_along - middle) / (0.5 * share)) ** 4))
    return {"rate": cells.rate * np.exp(log_ratio * cells.geometry.open_floor * within)}


def steep_bank(cells: Cells, share: Array) -> dict[str, Array]:
    """k -> k (1 + a ((1 + s^2)^(1/2) - 1)), s = |dz_b/dy|."""
    longer = np.sqrt(1.0 + cells.geometry.side_slope**2) - 1.0
    return {"rate": cells.rate * (1.0 + share * longer)}


def bank_vegetation(cells: Cells, drag: Array, height: Array) -> dict[str, Array]:
    """k -> k + phi_b min(h / h_b, 1) / (2 h) on the banks."""
    standing = np.minimum(1.0 / height, 1.0 / cells.depth)
    return {"rate": cells.rate + 0.5 * drag * standing * cells.geometry.bank}


def stem_blockage(cells: Cells, share: Array) -> dict[str, Array]:
    """k -> k / (1 - s)^2 among plants: what lies between stems runs at u / (1 - s)."""
    return {"rate": cells.rate * (1.0 - share * cells.geometry.planted) ** -2.0}


# n = 0.030 of a clean main channel and 0.050 of a floodplain with scattered brush: 2 ln(5/3).
TWO_SURFACES = "2 ln(0.050/0.030), floodplain with brush and clean main channel, Chow (1959), table 5-6"
REFERENCE_DEPTH = Shape("reference_depth", "m", "depth h_0 at which nothing changes", 0.5, 0.05, 5.0, of="depth")
EFFECTS = (
    Effect(
        name="depth_dependent_bank",
        stage="resistance",
        title="The roughness of the banks changes with depth beyond their law",
        equation="k -> k (h / h_0)^e on the banks, h at least 0.02 of that of the site",
        act=depth_dependent_bank,
        amplitude=Amplitude("exponent", "-", "exponent e", 0.5, -3.0, 3.0),
        shapes=(REFERENCE_DEPTH,),
        source="definition",
        checked=True,
        needs=("banks",),
    ),
    Effect(
        name="depth_dependent_bed",
        stage="resistance",
        title="The roughness of the floor changes with depth beyond its law",
        equation="k -> k (h / h_0)^e on the floor without plants, h at least 0.02 of that of the site",
        act=depth_dependent_bed,
        amplitude=Amplitude("exponent", "-", "exponent e", 0.5, -3.0, 3.0),
        shapes=(REFERENCE_DEPTH,),
        source="definition",
        checked=True,
    ),
    Effect(
        name="bank_trend",
        stage="resistance",
        title="Banks grow rougher along the channel",
        equation="k -> k exp(a (x - x_m)/L) on the banks, x_m the middle of the grid, L its length",
        act=bank_trend,
        amplitude=Amplitude("trend", "-", "logarithm a of k at the end over k at the beginning", 0.5, -4.0, 4.0),
        source="definition",
        checked=True,
        needs=("banks",),
    ),
    Effect(
        name="bank_drag_trend",
        stage="resistance",
        title="Plants or stones on the banks become denser along the channel",
        equation="k -> k + c (1/2 + d (x - x_m)/L) on the banks, x_m the middle of the grid, L its length",
        act=bank_drag_trend,
        # On half of the depth, as on banks, friction is twice that of the floor.
        amplitude=Amplitude("drag", "1/m", "drag c that is added where there is most", 1.5, 0.0, 150.0, of="friction"),
        shapes=(Shape("direction", "-", "d, 1 where it grows downstream, -1 upstream", 1.0, -1.0, 1.0, (1.0, -1.0)),),
        source="definition",
        checked=True,
        needs=("banks", "open ground"),
    ),
    Effect(
        name="bed_trend",
        stage="resistance",
        title="The floor grows rougher along the channel",
        equation="k -> k exp(a (x - x_m)/L) on the floor without plants, x_m the middle of the grid, L its length",
        act=bed_trend,
        amplitude=Amplitude("trend", "-", "logarithm a of k at the end over k at the beginning", 0.5, -4.0, 4.0),
        source="definition",
        checked=True,
    ),
    Effect(
        name="bank_difference",
        stage="resistance",
        title="One bank is rougher than the other",
        equation="k -> k exp(a/2) on the bank of larger y, k exp(-a/2) on the other",
        act=bank_difference,
        amplitude=Amplitude("log_ratio", "-", "logarithm a of the ratio of both", 0.5, -4.0, 4.0),
        source="definition",
        checked=True,
        mirrored=False,
        needs=("banks",),
    ),
    # Plausible, as of concrete beside short grass: n differs by 1.6, friction by its square (Chow 1959, table 5-6).
    Effect(
        name="bank_roughness",
        stage="resistance",
        title="Floor and banks, or floodplains, are two surfaces of different roughness",
        equation="k -> k exp(a) beyond the toe of the banks",
        act=bank_roughness,
        amplitude=Amplitude(
            "log_ratio", "-", "logarithm a of friction there over that of the law", 1.0, -4.0, 4.0, basis=TWO_SURFACES
        ),
        source="definition",
        checked=True,
        tags=("common",),
        needs=("banks", "one surface"),
    ),
    Effect(
        name="floor_difference",
        stage="resistance",
        title="The left and the right of the floor are two surfaces of different roughness",
        equation="k -> k exp(a/2) on the floor without plants at larger y than the axis, k exp(-a/2) on the other side",
        act=floor_difference,
        amplitude=Amplitude("log_ratio", "-", "logarithm a of the ratio of both", 1.0, -4.0, 4.0, basis=TWO_SURFACES),
        source="definition",
        checked=True,
        mirrored=False,
    ),
    Effect(
        name="bed_stretch",
        stage="resistance",
        title="A stretch of the floor has another roughness than the rest",
        equation="k -> k exp(a exp(-((x/L - c)/(s/2))^4)) on the floor without plants, x/L from -1/2 to 1/2",
        act=bed_stretch,
        amplitude=Amplitude(
            "log_ratio", "-", "logarithm a of friction there over that of the rest", 1.0, -4.0, 4.0, basis=TWO_SURFACES
        ),
        shapes=(
            Shape("middle", "-", "its middle c over the length of the channel", 0.0, -0.5, 0.5, (-0.33, 0.0, 0.33)),
            Shape("share", "-", "its share s of the length of the channel", 0.33, 0.02, 1.0),
        ),
        source="definition",
        checked=True,
    ),
    Effect(
        name="steep_bank",
        stage="resistance",
        title="Steep banks have a longer wetted perimeter than their width",
        equation="k -> k (1 + a ((1 + s^2)^(1/2) - 1)), s = |dz_b/dy|",
        act=steep_bank,
        amplitude=Amplitude(
            "share", "-", "share a of the longer perimeter that counts, 1 for all of it", 1.0, 0.0, 3.0
        ),
        source="definition; as in Shiono and Knight (1991)",
        doi="10.1017/S0022112091001246",
        checked=True,
        needs=("banks",),
    ),
    Effect(
        name="bank_vegetation",
        stage="resistance",
        title="Grass or shrubs stand on the banks",
        equation="k -> k + phi_b min(h/h_b, 1) / (2 h) on the banks",
        act=bank_vegetation,
        amplitude=Amplitude("drag", "-", "drag phi_b of the plants", 0.5, 0.0, 50.0),
        shapes=(Shape("height", "m", "height h_b of the plants", 0.3, 0.02, 3.0, (0.15, 0.55), "depth"),),
        source="definition",
        checked=True,
        needs=("banks",),
    ),
    Effect(
        name="stem_blockage",
        stage="resistance",
        title="Stems take up space, so that water between them is faster",
        equation="k -> k / (1 - s)^2 among plants",
        act=stem_blockage,
        amplitude=Amplitude("share", "-", "share s of the volume that stems take up", 0.05, 0.0, 0.6),
        source="definition; constricted speed as in Stone and Shen (2002)",
        doi="10.1061/(ASCE)0733-9429(2002)128:5(500)",
        checked=True,
        needs=("plants",),
    ),
)
