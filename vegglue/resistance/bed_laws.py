"""Friction of the bed by classes of roughness, compiled; the innermost axis of every array is the member."""

import math

import numpy as np

from vegglue.compilation import compiled
from vegglue.resistance.elementary import cube_root, logarithm
from vegglue.resistance.physical_constants import FILM_ON_LAND, GRAVITY

# Laws of the bed by the names a config gives them; compiled loops know each by its place here.
BED_LAWS = ("manning", "keulegan", "chezy")
MANNING, KEULEGAN, CHEZY = 0, 1, 2
# 18 log10 x = LOG_SLOPE ln x [m^1/2/s].
LOG_SLOPE = 18.0 / math.log(10.0)


@compiled
def _wet_depths(out, depth, half_range, dry):
    """Mean depth [m] of the wet part of one cell for all members, f + a^(1/2) (a^4 + w^4)^(1/8), a = h - f.

    f: depth of the film. Without it (a w)^(1/2) where the waterline crosses the cell, a far from it, smooth between.
    """
    half_range_4 = half_range**4
    for k in range(depth.size):
        mean = max(depth[k] - dry, 1e-12)
        square = mean * mean
        out[k] = dry + math.sqrt(mean * math.sqrt(math.sqrt(square * square + half_range_4)))


@compiled
def _chezys(out, wet, half_range, law, coefficient, bank_argument_minimum):
    """C [m^1/2/s] of the wet part of one cell for all members, of mean depth h: between h - w and h + w, or 0 and 2 h.

    h^(1/6) / n, the coefficient itself, or the mean over these depths of 18 log10(max(12 h/k_s, a))
    (Keulegan 1938) with a the floor of the bank law, `bank_argument_minimum`, which would stop Newton where all of a
    cell met it at once.
    """
    if law == MANNING:
        for k in range(wet.size):
            out[k] = math.sqrt(cube_root(wet[k])) / coefficient[k]
    elif law == KEULEGAN:
        lowest = math.log(bank_argument_minimum)
        for k in range(wet.size):
            per, half = 12.0 / coefficient[k], min(wet[k], half_range)
            high, low = per * (wet[k] + half), per * (wet[k] - half)
            up, down = max(high, bank_argument_minimum), max(low, bank_argument_minimum)
            above = up * (logarithm(up) - 1.0 - lowest) - down * (logarithm(down) - 1.0 - lowest)
            out[k] = LOG_SLOPE * (lowest + above / (high - low))
    else:
        for k in range(wet.size):
            out[k] = coefficient[k]


@compiled
def class_drag(depth, half_range, friction_class, law, coefficient, bank_argument_minimum, film):
    """k = g h^2 / (s K(h_w) + (1 - s) K(f))^2 [1/m], K = C h^(3/2): a wet share s of the cell and a film f beyond it.

    depth (nx, ny, m) is h, the mean of the cell; h_w = f + (h - f)/s; half_range: half the range of the bed across the
    flow in a cell, w [m]. The slope of the surface drives either part, as in the subgrid friction of Volp et al. 2013,
    doi:10.1002/wrcr.20324; but the wet part is asked once, at its mean depth, and not each depth as if the water beside
    it did not matter (`verification/test_banks`).
    """
    (nx, ny, m), dry = depth.shape, FILM_ON_LAND * film
    drag, wet, on_film = np.empty(depth.shape), np.full(m, dry), np.empty((law.size, m))
    for c in range(law.size):
        _chezys(on_film[c], wet, dry, law[c], coefficient[c], bank_argument_minimum)
    on_film *= dry * math.sqrt(dry)
    for i in range(nx):
        for j in range(ny):
            c, out = friction_class[i, j], drag[i, j]
            _wet_depths(wet, depth[i, j], half_range[i, j], dry)
            _chezys(out, wet, half_range[i, j], law[c], coefficient[c], bank_argument_minimum)
            for k in range(m):
                share = max(depth[i, j, k] - dry, 1e-12) / (wet[k] - dry)
                carried = share * out[k] * wet[k] * math.sqrt(wet[k]) + (1.0 - share) * on_film[c, k]
                out[k] = GRAVITY * (depth[i, j, k] / carried) ** 2
    return drag
