"""Friction of a vertical wall on the water beside it, by the laws of the bed."""

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.bed_laws import KEULEGAN, LOG_SLOPE, MANNING
from vegglue.effects.physical_constants import GRAVITY


def wall_coefficient(law: int, coefficient: Array, width: float, argument_minimum: float) -> Array:
    """c_w = g / C_w^2 [-], so that the stress on the wall is tau/rho = c_w |u| u, u the mean of a cell beside it.

    C_w [m^1/2/s] is that of the law (its place in BED_LAWS) at the width of the cell [m] in the place of a depth: over
    that width u is the mean of the profile that begins at the wall, as a velocity over a bed is over its depth. (Of
    u(y) = u*/kappa ln(y/z_0), z_0 = k_s/30, the mean over a width b is u*/kappa (ln(b/z_0) - 1), so that C_w =
    18 log10(11 b/k_s), where Keulegan has 12.) 12 b/k_s is bounded as on banks; coefficient: (m,), unit of the law.
    """
    if law == MANNING:
        chezy = width ** (1.0 / 6.0) / coefficient
    elif law == KEULEGAN:
        chezy = LOG_SLOPE * np.log(np.maximum(12.0 * width / coefficient, argument_minimum))
    else:
        chezy = coefficient
    return np.asarray(GRAVITY / chezy**2)
