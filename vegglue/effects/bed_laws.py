"""Friction of the bed by classes of roughness, and of side walls by the same laws, compiled; the innermost axis of
every array is the member.

Logarithm and cube root are written in plain arithmetic, which the compiler spreads over SIMD lanes as it cannot a
library's: six times as fast (1 and 2 ns instead of 6 and 13), within four units in the last place
(tests/effects/test_resistance_laws.py), for positive normal numbers only.
"""

import math

import numpy as np

from vegglue.arrays import Array
from vegglue.compilation import compiled, compiled_within
from vegglue.effects.physical_constants import FILM_ON_LAND, GRAVITY

LN2, ROOT2 = math.log(2.0), math.sqrt(2.0)
# Of the bit pattern of a double: its 52 bits after the point, and the pattern of the number one.
FRACTION, ONE = 0xFFFFFFFFFFFFF, 0x3FF0000000000000
# Of the bit pattern of a cube root: two thirds of that of one; 3.3 % off at most.
TWO_THIRDS = 0x2A9F7893782DA1CE


@compiled_within
def logarithm(x: float) -> float:
    """ln x = e ln 2 + 2 artanh((m - 1)/(m + 1)), x = m 2^e with m between 0.71 and 1.41."""
    bits = np.float64(x).view(np.int64)
    exponent = np.float64((bits >> 52) - 1023)
    mantissa = np.int64((bits & FRACTION) | ONE).view(np.float64)
    high = mantissa > ROOT2
    mantissa = 0.5 * mantissa if high else mantissa
    exponent = exponent + 1.0 if high else exponent
    t = (mantissa - 1.0) / (mantissa + 1.0)
    s = t * t
    series = 1.0 / 21.0
    series = series * s + 1.0 / 19.0
    series = series * s + 1.0 / 17.0
    series = series * s + 1.0 / 15.0
    series = series * s + 1.0 / 13.0
    series = series * s + 1.0 / 11.0
    series = series * s + 1.0 / 9.0
    series = series * s + 1.0 / 7.0
    series = series * s + 1.0 / 5.0
    series = series * s + 1.0 / 3.0
    return exponent * LN2 + 2.0 * (t + t * s * series)


@compiled_within
def cube_root(x: float) -> float:
    """y <- y (y^3 + 2 x) / (2 y^3 + x), three times (Halley's rounds triple the digits)."""
    third = np.int64(np.float64(np.float64(x).view(np.int64)) * (1.0 / 3.0)) + TWO_THIRDS
    y = np.int64(third).view(np.float64)
    for _ in range(3):
        cube = y * y * y
        y = y * (cube + 2.0 * x) / (2.0 * cube + x)
    return y


# Laws of the bed by the names a config gives them; compiled loops know each by its place here.
BED_LAWS = ("manning", "keulegan", "chezy")
MANNING, KEULEGAN, CHEZY = 0, 1, 2
# 18 log10 x = LOG_SLOPE ln x [m^1/2/s].
LOG_SLOPE = 18.0 / math.log(10.0)


@compiled_within
def _wet_depths(out, depth, half_range, dry):
    """Mean depth [m] of the wet part of cells (t,), f + a^(1/2) (a^4 + w^4)^(1/8), a = h - f: f + (a w)^(1/2) if the
    waterline crosses the cell, h far from it.
    """
    for t in range(depth.size):
        mean = max(depth[t] - dry, 1e-12)
        square = mean * mean
        out[t] = dry + math.sqrt(mean * math.sqrt(math.sqrt(square * square + half_range[t] ** 4)))


@compiled_within
def _chezys(out, wet, half_range, law, coefficient, bank_argument_minimum):
    """C [m^1/2/s] of the wet part of cells (t,), of depths from h - w to h + w, or 0 to 2 h.

    h^(1/6) / n (Manning), C itself (Chezy), or the mean over these depths of 18 log10(max(12 h/k_s, a)) (Keulegan
    1938): a floor that a whole cell met at once would stop Newton.
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
def class_drag(depth, half_range, friction_class, law, coefficient, bank_argument_minimum, film):
    """k = g h^2 / (s K(h_w) + (1 - s) K(f))^2, K = C h^(3/2): friction rate of the bed.

    A wet share s of the cell, of mean depth h_w = f + (h - f)/s, and a film f beyond it.

    Parameters
    ----------
    depth
        Mean depth h of each cell (nx, ny, m) [m].
    half_range
        Half the range w of the bed across the flow within each cell (nx, ny) [m].
    friction_class
        Class of each cell (nx, ny).
    law, coefficient
        Law of each class (class,), an index into BED_LAWS, and its coefficient (class, m) [s m^(-1/3), m or m^1/2/s].
    bank_argument_minimum
        Floor of 12 h/k_s in Keulegan's law [-].
    film
        Ten times f [m].

    Returns
    -------
    array
        k (nx, ny, m) [1/m].

    References
    ----------
    Subgrid friction as in Volp et al. (2013), doi:10.1002/wrcr.20324, except that the wet part counts by C at its mean
    depth, since mixing ties its water together (`verification/test_banks`).
    """
    # Neighbours of one class and all their members are one run of numbers: SIMD lanes are full with one member, too.
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
        for j in range(ny):
            for k in range(m):
                half[j * m + k] = half_range[i, j]
        _wet_depths(wet, here, half, dry)
        first = 0
        while first < ny:
            c, stop = friction_class[i, first], first + 1
            while stop < ny and friction_class[i, stop] == c:
                stop += 1
            a, b = first * m, stop * m
            _chezys(drag[i, a:b], wet[a:b], half[a:b], law[c], of_members[c, a:b], bank_argument_minimum)
            for t in range(a, b):
                share = max(here[t] - dry, 1e-12) / (wet[t] - dry)
                carried = share * drag[i, t] * wet[t] * math.sqrt(wet[t]) + (1.0 - share) * on_film[c, t]
                drag[i, t] = GRAVITY * (here[t] / carried) ** 2
            first = stop
    return drag.reshape((nx, ny, m))


def wall_coefficient(law: int, coefficient: Array, width: float, argument_minimum: float) -> Array:
    """c_w = g / C_w^2: the stress on a wall is tau/rho = c_w |u| u, u the mean of a cell beside it.

    C_w [m^1/2/s] is that of the law at the width b of the cell in place of a depth: u is the mean over b of a profile
    that begins at the wall, as a depth-averaged velocity is over a bed. (Of u(y) = u*/kappa ln(y/z_0), z_0 = k_s/30,
    the mean over b is u*/kappa (ln(b/z_0) - 1), so that C_w = 18 log10(11 b/k_s), where Keulegan has 12.)

    Parameters
    ----------
    law
        Index into BED_LAWS.
    coefficient
        Of the law, (m,) [s m^(-1/3), m or m^1/2/s].
    width
        Width b of the cell [m].
    argument_minimum
        Floor of 12 b/k_s [-].

    Returns
    -------
    array
        c_w (m,) [-].
    """
    if law == MANNING:
        chezy = width ** (1.0 / 6.0) / coefficient
    elif law == KEULEGAN:
        chezy = LOG_SLOPE * np.log(np.maximum(12.0 * width / coefficient, argument_minimum))
    else:
        chezy = coefficient
    return np.asarray(GRAVITY / chezy**2)
