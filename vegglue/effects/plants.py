"""Effects on plants: drag phi [-] and canopy height h_d [m] of each vegetated cell, both (cell, m).

Parameters are (m,); unit and meaning of each stand in EFFECTS, with the source of the formula.
"""

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.definition import Amplitude, Effect, Shape
from vegglue.effects.physical_constants import WATER_VISCOSITY
from vegglue.effects.surroundings import PlantCells

# Speed over that of the site [-] below which plants do not yield further: a negative exponent would give infinite drag
# at rest.
LEAST_YIELDING_SPEED = 0.04
# Cauchy number [-] that stands for still water: far below 1, where nothing bends, and its powers stay finite.
LEAST_CAUCHY = 1e-3
# Reynolds number [-] below which C_D stays as it is, 2 mm/s at a stem of 1 cm: it grows without end towards rest.
LEAST_REYNOLDS = 20.0


def streamlining(plants: PlantCells, vogel_exponent: Array, reference_speed: Array) -> dict[str, Array]:
    """phi -> phi (|U| / U_0)^chi, |U| at least 0.04 of that of the site."""
    speed = np.maximum(plants.speed, LEAST_YIELDING_SPEED * plants.speed_scale)
    return {"phi": plants.phi * (speed / reference_speed) ** vogel_exponent}


def canopy_height_error(plants: PlantCells, relative_error: Array) -> dict[str, Array]:
    """h_d -> h_d (1 + e), phi in proportion."""
    return {"phi": plants.phi * (1.0 + relative_error), "canopy_height": plants.canopy_height * (1.0 + relative_error)}


def canopy_deflection(plants: PlantCells, rate: Array) -> dict[str, Array]:
    """h_d -> h_d exp(-k |U|)."""
    return {"canopy_height": plants.canopy_height * np.exp(-rate * plants.speed)}


def bent_blade(cauchy: Array, buoyancy: Array) -> tuple[Array, Array]:
    """l_e/l = 1 - (1 - 0.9 Ca^(-1/3)) / (1 + Ca^(-3/2) (8 + B^(3/2))), the effective length of a flexible blade, and

        h/l = 1 - (1 - Ca^(-1/4)) / (1 + Ca^(-3/5) (4 + B^(3/5)) + Ca^-2 (8 + B^2)),

    its height; both at most 1 [-]: a blade is not shortened where Ca is below 0.9^3, nor lowered below 1.

    Parameters
    ----------
    cauchy, buoyancy : (cell, m) or (m,) [-]
        Ca, the drag over the stiffness of the blade, and B, its buoyancy over that.

    References
    ----------
    Luhar and Nepf (2011), doi:10.4319/lo.2011.56.6.2003, not compared with it: l_e as in ROMS (vegetation_drag.F), the
    height from memory.
    """
    ca = np.maximum(cauchy, LEAST_CAUCHY)
    length = 1.0 - (1.0 - 0.9 * ca ** (-1 / 3)) / (1.0 + ca**-1.5 * (8.0 + buoyancy**1.5))
    height = 1.0 - (1.0 - ca**-0.25) / (1.0 + ca**-0.6 * (4.0 + buoyancy**0.6) + ca**-2.0 * (8.0 + buoyancy**2))
    return np.minimum(length, 1.0), np.minimum(height, 1.0)


def canopy_bending(
    plants: PlantCells, share: Array, cauchy: Array, buoyancy: Array, reference_speed: Array
) -> dict[str, Array]:
    """phi -> phi (1 - s (1 - l_e/l)), h_d -> h_d (1 - s (1 - h/l)) with Ca = Ca_0 (|U| / U_0)^2."""
    length, height = bent_blade(cauchy * (plants.speed / reference_speed) ** 2, buoyancy)
    return {
        "phi": plants.phi * (1.0 - share * (1.0 - length)),
        "canopy_height": plants.canopy_height * (1.0 - share * (1.0 - height)),
    }


def undergrowth(plants: PlantCells, drag: Array, height: Array) -> dict[str, Array]:
    """phi -> phi + phi_u min(h / h_u, 1)."""
    return {"phi": plants.phi + drag * np.minimum(plants.depth / height, 1.0)}


def foliage(plants: PlantCells, drag: Array, vogel_exponent: Array, reference_speed: Array) -> dict[str, Array]:
    """phi -> phi + phi_F (|U| / U_0)^chi_F min(h / h_d, 1), |U| at least 0.04 of that of the site."""
    bent = (np.maximum(plants.speed, LEAST_YIELDING_SPEED * plants.speed_scale) / reference_speed) ** vogel_exponent
    return {"phi": plants.phi + drag * bent * np.minimum(plants.depth / plants.canopy_height, 1.0)}


def emergent_part(plants: PlantCells, share: Array) -> dict[str, Array]:
    """phi -> phi (1 - s (1 - min(h / h_d, 1)))."""
    return {"phi": plants.phi * (1.0 - share * (1.0 - np.minimum(plants.depth / plants.canopy_height, 1.0)))}


def slow_stems(plants: PlantCells, share: Array, diameter: Array) -> dict[str, Array]:
    """phi -> phi (1 + s (C_D - 1)), C_D = 1 + 10 Re^(-2/3), Re = |U| D / nu at least 20."""
    reynolds = np.maximum(plants.speed * diameter / WATER_VISCOSITY, LEAST_REYNOLDS)
    return {"phi": plants.phi * (1.0 + share * 10.0 * reynolds ** (-2 / 3))}


def debris_screen(plants: PlantCells, excess: Array, length: Array) -> dict[str, Array]:
    """phi -> phi (1 + a exp(-f / L)), f the distance from the front of the patch."""
    return {"phi": plants.phi * (1.0 + excess * np.exp(-plants.front / length))}


def density_trend(plants: PlantCells, trend: Array, length: Array) -> dict[str, Array]:
    """phi -> phi (1 + a tanh(f / L - 1)), f the distance from the front of the patch."""
    return {"phi": plants.phi * (1.0 + trend * np.tanh(plants.front / length - 1.0))}


def edge_thinning(plants: PlantCells, share: Array, width: Array) -> dict[str, Array]:
    """phi -> phi (1 - a exp(-e / w)), e the distance inward from the sides of the patch."""
    return {"phi": plants.phi * (1.0 - share * np.exp(np.minimum(plants.edge, 0.0) / width))}


def patch_density(plants: PlantCells, excess: Array, patch: Array) -> dict[str, Array]:
    """phi -> phi (1 + a) in one patch, the first of which is number 1."""
    return {"phi": plants.phi * (1.0 + excess * (plants.patch == patch - 1.0))}


REFERENCE_SPEED = Shape("reference_speed", "m/s", "speed U_0 at which phi holds", 0.7, 0.1, 4.0, of="speed")
EFFECTS = (
    Effect(
        name="streamlining",
        stage="plants",
        title="Plants bend and streamline: drag grows slower than the square of speed",
        equation="phi -> phi (|U| / U_0)^chi",
        act=streamlining,
        amplitude=Amplitude("vogel_exponent", "-", "Vogel exponent chi, 0 for rigid plants", 0.5, -2.0, 1.0),
        shapes=(REFERENCE_SPEED,),
        source="Vogel (1984); Järvelä (2004)",
        read_in="Delft3D-FLOW (trtrou.f90, law 155)",
        doi="10.1080/15715124.2004.9635222",
        needs=("plants",),
    ),
    Effect(
        name="canopy_height_error",
        stage="plants",
        title="The plants are taller than assumed",
        equation="h_d -> h_d (1 + e), phi -> phi (1 + e)",
        act=canopy_height_error,
        amplitude=Amplitude("relative_error", "-", "true over assumed height, less one", 0.2, -0.6, 1.0),
        source="definition",
        checked=True,
        needs=("plants",),
    ),
    Effect(
        name="canopy_deflection",
        stage="plants",
        title="The canopy is pushed down as the water runs faster",
        equation="h_d -> h_d exp(-k |U|)",
        act=canopy_deflection,
        amplitude=Amplitude(
            "rate",
            "s/m",
            "share k of the height lost for each m/s",
            0.25,
            0.0,
            1.5,
            of="slowness",
            basis="ln(1.06/0.80) = 0.28 at the mean speed, bent shrubs of Berends et al. (2020)",
        ),
        source="after Verschoren et al. (2016)",
        doi="10.1007/s10652-015-9432-1",
        needs=("plants",),
    ),
    Effect(
        name="canopy_bending",
        stage="plants",
        title="Plants bend like elastic blades, with less height and less drag",
        equation="phi -> phi (1 - s (1 - l_e/l)), h_d -> h_d (1 - s (1 - h/l)), l_e and h of Ca = Ca_0 (|U|/U_0)^2, B",
        act=canopy_bending,
        amplitude=Amplitude("share", "-", "share s of the plants that bend", 0.5, 0.0, 1.0),
        shapes=(
            Shape("cauchy", "-", "Cauchy number Ca_0 at U_0", 30.0, 0.1, 1e4, (5.0, 30.0, 200.0)),
            Shape("buoyancy", "-", "buoyancy number B", 0.0, 0.0, 200.0),
            REFERENCE_SPEED,
        ),
        source="Luhar and Nepf (2011)",
        read_in="ROMS (vegetation_drag.F; l_e alone)",
        doi="10.4319/lo.2011.56.6.2003",
        needs=("plants",),
    ),
    Effect(
        name="undergrowth",
        stage="plants",
        title="A lower layer grows under the plants",
        equation="phi -> phi + phi_u min(h/h_u, 1)",
        act=undergrowth,
        amplitude=Amplitude("drag", "-", "drag phi_u of the lower layer", 3.0, 0.0, 100.0),
        shapes=(Shape("height", "m", "height h_u of the lower layer", 0.33, 0.02, 2.0, of="canopy"),),
        source="definition",
        checked=True,
        needs=("plants",),
    ),
    Effect(
        name="foliage",
        stage="plants",
        title="Leaves add drag of their own, which they reduce by streamlining",
        equation="phi -> phi + phi_F (|U|/U_0)^chi_F min(h/h_d, 1)",
        act=foliage,
        amplitude=Amplitude("drag", "-", "drag phi_F of the leaves at U_0", 2.0, 0.0, 100.0),
        shapes=(
            Shape("vogel_exponent", "-", "Vogel exponent chi_F of leaves", -0.9, -2.0, 0.0, (-1.2, -0.6)),
            REFERENCE_SPEED,
        ),
        source="Västilä and Järvelä (2014)",
        read_in="Delft3D-FLOW (trtrou.f90, law 155)",
        doi="10.1002/2013WR013819",
        needs=("plants",),
    ),
    Effect(
        name="emergent_part",
        stage="plants",
        title="Only the part of the plants under water resists",
        equation="phi -> phi (1 - s (1 - min(h/h_d, 1)))",
        act=emergent_part,
        amplitude=Amplitude("share", "-", "share s of the plants to which this applies", 0.5, 0.0, 1.0),
        source="definition",
        checked=True,
        needs=("plants",),
    ),
    Effect(
        name="slow_stems",
        stage="plants",
        title="Stems resist more where the water is slow",
        equation="phi -> phi (1 + s (C_D - 1)), C_D = 1 + 10 Re^(-2/3), Re = |U| D/nu at least 20",
        act=slow_stems,
        amplitude=Amplitude("share", "-", "share s of the excess of C_D over 1", 1.0, 0.0, 5.0),
        shapes=(Shape("diameter", "m", "diameter D of the stems", 1.0, 0.05, 20.0, (0.35, 1.0), "stem"),),
        source="White (1991), Viscous Fluid Flow, a fit for single cylinders",
        needs=("plants",),
    ),
    Effect(
        name="debris_screen",
        stage="plants",
        title="Debris hangs in the front of the plants",
        equation="phi -> phi (1 + a exp(-f/L)), f the distance from the front of the patch",
        act=debris_screen,
        amplitude=Amplitude("excess", "-", "relative excess a of drag at the front", 2.0, -0.9, 50.0),
        shapes=(Shape("length", "m", "depth L of the screen", 0.125, 0.0125, 2.5, (0.075, 0.25), "patch_length"),),
        source="definition",
        checked=True,
        needs=("plants",),
    ),
    Effect(
        name="density_trend",
        stage="plants",
        title="The plants grow denser towards the end of the patch",
        equation="phi -> phi (1 + a tanh(f/L - 1)), f the distance from the front of the patch",
        act=density_trend,
        amplitude=Amplitude("trend", "-", "relative excess a towards the end", 0.3, -0.95, 0.95),
        shapes=(
            Shape(
                "length",
                "m",
                "distance L from the front where phi holds",
                0.5,
                0.025,
                12.5,
                (0.25, 0.5),
                "patch_length",
            ),
        ),
        source="definition",
        checked=True,
        needs=("plants",),
    ),
    Effect(
        name="edge_thinning",
        stage="plants",
        title="The plants are thinner along the sides of the patch",
        equation="phi -> phi (1 - a exp(-e/w)), e the distance inward from the sides of the patch",
        act=edge_thinning,
        amplitude=Amplitude("share", "-", "share a missing at the very side, negative for more there", 0.4, -5.0, 0.95),
        shapes=(Shape("width", "m", "width w of the thinner rim", 0.2, 0.013, 3.3, (0.13, 0.33), "patch_width"),),
        source="definition",
        checked=True,
        needs=("plants",),
    ),
    Effect(
        name="patch_density",
        stage="plants",
        title="One patch is denser or thinner than counted",
        equation="phi -> phi (1 + a) in one patch",
        act=patch_density,
        amplitude=Amplitude("excess", "-", "relative excess a of stems over those counted", 0.3, -0.95, 5.0),
        shapes=(Shape("patch", "-", "number of the patch in the order of the config, from 1", 1.0, 1.0, 1e4),),
        source="definition",
        checked=True,
        each="patch",
        mirrored=False,
        needs=("plants",),
    ),
)
