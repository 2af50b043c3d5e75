"""Friction of the bed by classes of roughness, compiled; the innermost axis of every array is the member."""

import math

import numpy as np

from vegglue.compilation import compiled
from vegglue.effects.elementary import cube_root, logarithm
from vegglue.effects.physical_constants import FILM_ON_LAND, GRAVITY

# Laws of the bed by the names a config gives them; compiled loops know each by its place here.
BED_LAWS = ("manning", "keulegan", "chezy")
MANNING, KEULEGAN, CHEZY = 0, 1, 2
# 18 log10 x = LOG_SLOPE ln x [m^1/2/s].
LOG_SLOPE = 18.0 / math.log(10.0)


@compiled
def _wet_depths(out, depth, half_range, dry):
    """Mean depth [m] of the wet part of cells (t,), f + a^(1/2) (a^4 + w^4)^(1/8), a = h - f.

    f: depth of the film. Without it (a w)^(1/2) where the waterline crosses the cell, a far from it, smooth between.
    """
    for t in range(depth.size):
        mean = max(depth[t] - dry, 1e-12)
        square = mean * mean
        out[t] = dry + math.sqrt(mean * math.sqrt(math.sqrt(square * square + half_range[t] ** 4)))


@compiled
def _chezys(out, wet, half_range, law, coefficient, bank_argument_minimum):
    """C [m^1/2/s] of the wet part of cells (t,), of mean depth h: between h - w and h + w, or 0 and 2 h.

    h^(1/6) / n, the coefficient itself, or the mean over these depths of 18 log10(max(12 h/k_s, a))
    (Keulegan 1938) with a the floor of the bank law, `bank_argument_minimum`, which would stop Newton where all of a
    cell met it at once.
    """
    if law == MANNING:
        for t in range(wet.size):
            out[t] = math.sqrt(cube_root(wet[t])) / coefficient[t]
    elif law == KEULEGAN:
        lowest = math.log(bank_argument_minimum)
        for t in range(wet.size):
            per, half = 12.0 / coefficient[t], min(wet[t], half_range[t])
            high, low = per * (wet[t] + half), per * (wet[t] - half)
            up, down = max(high, bank_argument_minimum), max(low, bank_argument_minimum)
            above = up * (logarithm(up) - 1.0 - lowest) - down * (logarithm(down) - 1.0 - lowest)
            out[t] = LOG_SLOPE * (lowest + above / (high - low))
    else:
        for t in range(wet.size):
            out[t] = coefficient[t]


@compiled
def _drag_of_cells(out, depth, wet, on_film, dry):
    """k [1/m] of cells (t,) in place of the C of their wet parts, whose mean depths are `wet` [m]; on_film: K(f)."""
    for t in range(depth.size):
        share = max(depth[t] - dry, 1e-12) / (wet[t] - dry)
        carried = share * out[t] * wet[t] * math.sqrt(wet[t]) + (1.0 - share) * on_film[t]
        out[t] = GRAVITY * (depth[t] / carried) ** 2


@compiled
def _one_after_the_other(out, values, times):
    """Values (n,) of cells, each as often as there are members: a row of cells and their members (n times,)."""
    for j in range(values.size):
        for k in range(times):
            out[j * times + k] = values[j]


@compiled
def class_drag(depth, half_range, friction_class, law, coefficient, bank_argument_minimum, film):
    """k = g h^2 / (s K(h_w) + (1 - s) K(f))^2 [1/m], K = C h^(3/2): a wet share s of the cell and a film f beyond it.

    depth (nx, ny, m) is h, the mean of the cell; h_w = f + (h - f)/s; half_range: half the range of the bed across the
    flow in a cell, w [m]. The slope of the surface drives either part, as in the subgrid friction of Volp et al. 2013,
    doi:10.1002/wrcr.20324; but the wet part is asked once, at its mean depth, and not each depth as if the water beside
    it did not matter (`verification/test_banks`).

    Neighbours of one class and all their members are one run of numbers: SIMD lanes are full with one member, too.
    """
    (nx, ny, m), dry = depth.shape, FILM_ON_LAND * film
    drag, wet, half, thin = np.empty((nx, ny * m)), np.empty(ny * m), np.empty(ny * m), np.full(ny * m, dry)
    of_members, on_film = np.empty((law.size, ny * m)), np.empty((law.size, ny * m))
    for c in range(law.size):
        for j in range(ny):
            for k in range(m):
                of_members[c, j * m + k] = coefficient[c, k]
        _chezys(on_film[c], thin, thin, law[c], of_members[c], bank_argument_minimum)
    on_film *= dry * math.sqrt(dry)
    for i in range(nx):
        here = depth[i].reshape(ny * m)
        _one_after_the_other(half, half_range[i], m)
        _wet_depths(wet, here, half, dry)
        first = 0
        while first < ny:
            c, stop = friction_class[i, first], first + 1
            while stop < ny and friction_class[i, stop] == c:
                stop += 1
            a, b = first * m, stop * m
            _chezys(drag[i, a:b], wet[a:b], half[a:b], law[c], of_members[c, a:b], bank_argument_minimum)
            _drag_of_cells(drag[i, a:b], here[a:b], wet[a:b], on_film[c, a:b], dry)
            first = stop
    return drag.reshape((nx, ny, m))
