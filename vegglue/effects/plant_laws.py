"""Laws of resistance where plants stand, compiled: Baptist's, and others to choose from.

Each gives C [m^1/2/s] from phi = C_D m D h_d, canopy height h_d and depth h; the friction rate is k = g / (C^2 h).
Baptist's takes the bed under the plants into the canopy part; all others add it, 1/C^2 = 1/C_b^2 + 1/C_plants^2.

    baptist      C = (1/C_b^2 + phi/2g)^(-1/2) + g^(1/2)/kappa ln(h/h_d)           doi:10.1080/00221686.2007.9521778
    huthoff      C = (2g/phi)^(1/2) (h_d/h)^(1/2) (Z^(1/2) + (1 - Z) ((h - h_d)/s)^p), p = 2/3 (1 - Z^5), Z = h_d/h,
                 s = 0.1 m between stems                                                doi:10.1029/2006WR005625
    klopstra     two layers: an exponential profile among plants with the length A = 0.0227 h_d^0.7, a log law above
                 (Klopstra et al. 1997, closure of Van Velzen et al. 2003)
    luhar-nepf   C = (2g/C_i)^(1/2) (1 - Z)^(3/2) + (2g/phi)^(1/2) Z, C_i = 0.1   doi:10.1016/j.advwatres.2012.02.002
    stone-shen   C = (2g/phi)^(1/2) (1 - r) ((1 - pi/4 r^2 Z) h/h_d)^(1/2), r = D m^(1/2) = 0.05
                                                                            doi:10.1061/(ASCE)0733-9429(2002)128:5(500)
    yang-choi    C = (2g/phi)^(1/2) + C_u (g (1 - Z))^(1/2)/kappa (ln(h/h_d) - 1 + Z), C_u = 1 up to phi/h_d = 5 1/m, 2
                 beyond                                                                doi:10.1080/00221686.2010.491649

Under h_d all are C = (2g/phi)^(1/2), stone-shen with (1 - r) (1 - pi/4 r^2)^(1/2). The papers were not at hand:
huthoff, klopstra and luhar-nepf were read in the source of TELEMAC-2D (V8P2), stone-shen and yang-choi follow from
balances of forces, their constants are from memory and unverified. STEM_SPACING, INTERFACE and SOLIDITY (s, C_i, r)
are fixed at plausible values, see there.
"""

import math

from vegglue.compilation import compiled, compiled_inside
from vegglue.effects.physical_constants import GRAVITY, KARMAN

PLANT_LAWS = ("baptist", "huthoff", "klopstra", "luhar-nepf", "stone-shen", "yang-choi")
BAPTIST, HUTHOFF, KLOPSTRA, LUHAR_NEPF, STONE_SHEN, YANG_CHOI = range(6)
# Distance s between stems in Huthoff's law [m], friction C_i at the top of the plants in Luhar's and Nepf's [-], width
# of a stem over the distance between stems, r, in Stone's and Shen's [-]: chosen, not measured, for no case gives them.
# Twice as much of each lowers C by 21, 21 and 5 % (phi = 2, 0.9 m of water over plants of 0.5 m).
STEM_SPACING, INTERFACE, SOLIDITY = 0.1, 0.1, 0.05
# phi/h_d [1/m] beyond which C_u of Yang's and Choi's law is 2 and not 1: theirs, from memory.
DENSE = 5.0


@compiled_inside
def _klopstra(drag_area: float, top: float, depth: float) -> float:
    """U / (g S)^(1/2) [m^1/2] over plants of drag_area = C_D m D [1/m], so written that nothing overflows."""
    over, mixing, stem = depth - top, 0.0227 * top**0.7, math.sqrt(2.0 / drag_area)
    scale = math.sqrt(mixing / drag_area)
    steep, push = top / scale, over * scale / mixing
    fade = math.exp(-steep)
    at_top = math.sqrt(2.0 * push / (1.0 + fade * fade) + stem * stem)
    at_bed = math.sqrt(2.0 * push * fade / (1.0 + fade * fade) + stem * stem)
    within = 2.0 * scale / top * (at_top - at_bed)
    within += stem * scale / top * (steep + 2.0 * math.log((at_bed + stem) / (at_top + stem)))
    edge = math.sqrt(2.0 * push * math.tanh(steep) + stem * stem)
    slope = over / (mixing * edge) * KARMAN
    below = (1.0 + math.sqrt(1.0 + 4.0 * slope * slope * over)) / (2.0 * slope * slope)
    shear = math.sqrt(over + below)
    grown = (over + below) * math.log1p(over / below) - over
    above = edge + shear / (KARMAN * over) * grown
    return (top * within + over * above) / depth


@compiled_inside
def _submerged(law: int, phi: float, top: float, depth: float) -> float:
    """C [m^1/2/s] of plants under water, without the bed."""
    share = top / depth
    alone = math.sqrt(2.0 * GRAVITY / phi)
    if law == HUTHOFF:
        power = 2.0 / 3.0 * (1.0 - share**5)
        return alone * math.sqrt(share) * (math.sqrt(share) + (1.0 - share) * ((depth - top) / STEM_SPACING) ** power)
    if law == KLOPSTRA:
        return _klopstra(phi / top, top, depth) * math.sqrt(GRAVITY / depth)
    if law == LUHAR_NEPF:
        return math.sqrt(2.0 * GRAVITY / INTERFACE) * (1.0 - share) ** 1.5 + alone * share
    if law == STONE_SHEN:
        return alone * (1.0 - SOLIDITY) * math.sqrt((1.0 - 0.25 * math.pi * SOLIDITY**2 * share) / share)
    grown = 1.0 if phi <= DENSE * top else 2.0
    over = math.sqrt(GRAVITY * (1.0 - share)) / KARMAN * (math.log(1.0 / share) - 1.0 + share)
    return alone + grown * over


@compiled
def above_canopy(top: float, depth: float) -> float:
    """g^(1/2)/kappa ln(max(h/h_d, 1)): what the water above the plants adds to C by Baptist's law [m^1/2/s].

    Parameters
    ----------
    top, depth : h_d, h [m]
    """
    return math.sqrt(GRAVITY) / KARMAN * math.log(max(depth / top, 1.0))


@compiled
def baptist_chezy(phi: float, top: float, depth: float, bare: float) -> float:
    """C = (1/C_b^2 + phi/2g)^(-1/2) + g^(1/2)/kappa ln(max(h/h_d, 1)) [m^1/2/s].

    Parameters
    ----------
    phi : [-]
        C_D m D h_d.
    top, depth : h_d, h [m]
    bare : C_b [m^1/2/s]
    """
    return 1.0 / math.sqrt(1.0 / bare**2 + phi / (2.0 * GRAVITY)) + above_canopy(top, depth)


@compiled_inside
def _chezy(law: int, phi: float, top: float, depth: float, bare: float) -> float:
    """C [m^1/2/s] of plants and bed; phi already of the part under water."""
    if law == BAPTIST:
        return baptist_chezy(phi, top, depth, bare)
    if depth > top:
        plants = _submerged(law, phi, top, depth)
    else:
        plants = math.sqrt(2.0 * GRAVITY / phi)
        if law == STONE_SHEN:
            plants *= (1.0 - SOLIDITY) * math.sqrt(1.0 - 0.25 * math.pi * SOLIDITY**2)
    return 1.0 / math.sqrt(1.0 / bare**2 + 1.0 / plants**2)


@compiled
def plant_drag(drag, depth, column, row, law, cover, phi, canopy, bare_chezy, proportional):
    """k -> s k_p + (1 - s) k, k_p = g / (C^2 h): friction rate of vegetated cells, in place.

    The force on the plants' share s and on the rest, with the water as fast on both.

    Parameters
    ----------
    drag
        k (nx, ny, m) [1/m], of the bed on entry.
    depth
        h (nx, ny, m) [m].
    column, row
        Vegetated cells (cell,).
    law
        Law of each (cell,), an index into PLANT_LAWS.
    cover
        s (cell,) [-].
    phi, canopy, bare_chezy
        C_D m D h_d [-], h_d [m] and C_b [m^1/2/s] of each, (cell, m).
    proportional
        Whether phi h/h_d takes the place of phi if plants stand out of the water.
    """
    m = depth.shape[2]
    for p in range(column.size):
        i, j = column[p], row[p]
        for k in range(m):
            h = depth[i, j, k]
            share = min(h / canopy[p, k], 1.0) if proportional else 1.0
            chezy = _chezy(law[p], share * phi[p, k], canopy[p, k], h, bare_chezy[p, k])
            drag[i, j, k] = cover[p] * (GRAVITY / (chezy * chezy * h)) + (1.0 - cover[p]) * drag[i, j, k]
