"""Effects as the second solver has them, coded anew from their equations: on plants, drag, mixing and forces.

Each is a function of the state and of its own numbers by name, and gives what it changes; amplitudes and shapes are
those that `vegglue effects NAME` lists. Arrays are (nx, ny), SI throughout.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from second_channel import Lie
from second_kernels import DRY, GRAVITY, KARMAN
from second_solver import Field, Flow

# Viscosity of water [m2/s], density of air over that of water [-], drag of wind of some 8 m/s [-].
WATER, AIR, WIND = 1e-6, 1.2e-3, 1.3e-3
# Eddies of Smagorinsky's are those smaller than a cell of the user's [m2], whose model he completes.
USER_CELL = 0.5 * 0.1875


@dataclass(frozen=True)
class State:
    """What effects see: the channel (half width, rise of banks, length), how cells lie, the
    flow, plants (phi, hd), drag k [1/m], the bed's part of it, and viscosity nu [m2/s].
    """

    half: float
    rise: float
    length: float
    lie: Lie
    flow: Flow
    spacing: tuple[float, float]
    phi: Field
    hd: Field
    k: Field
    bed_k: Field
    nu: Field

    @property
    def h(self) -> Field:
        return np.maximum(self.flow.h, DRY)

    @property
    def speed(self) -> Field:
        return np.hypot(self.flow.u, self.flow.v)

    @property
    def eta(self) -> Field:
        return self.lie.y / self.half

    @property
    def open_floor(self) -> Field:
        return (1.0 - self.lie.bank) * (1.0 - self.lie.cover)


Effect = Callable[..., Field]


def slope(field: Field, wet: Field, step: float, axis: int) -> Field:
    """Mean of the differences to the wet neighbours on either side [unit/m]."""
    field, wet = np.moveaxis(field, axis, 0), np.moveaxis(wet, axis, 0)
    both = (wet[1:] & wet[:-1]).astype(float)
    rise = np.diff(field, axis=0) * both
    total, number = np.zeros_like(field), np.zeros_like(field)
    for part, of in ((slice(1, None), slice(None)), (slice(None, -1), slice(None))):
        total[part] += rise[of]
        number[part] += both[of]
    return np.moveaxis(total / np.maximum(number, 1.0) / step, 0, axis)


def gradients(s: State) -> tuple[Field, Field, Field, Field]:
    """du/dx, du/dy, dv/dx, dv/dy [1/s]."""
    wet = s.flow.h > DRY
    u_x, u_y = (slope(s.flow.u, wet, step, axis) for axis, step in enumerate(s.spacing))
    v_x, v_y = (slope(s.flow.v, wet, step, axis) for axis, step in enumerate(s.spacing))
    return u_x, u_y, v_x, v_y


def shear(s: State) -> Field:
    """|du/dy| [1/s]."""
    return np.abs(slope(s.flow.u, s.flow.h > DRY, s.spacing[1], 1))


def blade(ca: Field, b: float) -> tuple[Field, Field]:
    """Effective length and height of a flexible blade over its length (Luhar and Nepf 2011), at most 1."""
    ca = np.maximum(ca, 1e-3)
    long = 1.0 - (1.0 - 0.9 * ca ** (-1 / 3)) / (1.0 + ca**-1.5 * (8.0 + b**1.5))
    tall = 1.0 - (1.0 - ca**-0.25) / (1.0 + ca**-0.6 * (4.0 + b**0.6) + ca**-2.0 * (8.0 + b**2))
    return np.minimum(long, 1.0), np.minimum(tall, 1.0)


def _bent(s: State, share: float, cauchy: float, buoyancy: float, reference_speed: float) -> tuple[Field, Field]:
    long, tall = blade(cauchy * (s.speed / reference_speed) ** 2, buoyancy)
    return s.phi * (1.0 - share * (1.0 - long)), s.hd * (1.0 - share * (1.0 - tall))


def _yielding(s: State, reference_speed: float) -> Field:
    return np.maximum(s.speed, 0.02) / reference_speed


def _stems(s: State, share: float, diameter: float) -> Field:
    return s.phi * (1.0 + share * 10.0 * np.maximum(s.speed * diameter / WATER, 20.0) ** (-2 / 3))


def _leaves(s: State, drag: float, vogel_exponent: float, reference_speed: float) -> Field:
    return s.phi + drag * _yielding(s, reference_speed) ** vogel_exponent * np.minimum(s.h / s.hd, 1.0)


# phi and hd of plants.
PLANTS: dict[str, Callable[..., tuple[Field, Field]]] = {
    "streamlining": lambda s, vogel_exponent, reference_speed: (
        s.phi * _yielding(s, reference_speed) ** vogel_exponent, s.hd),
    "canopy_height_error": lambda s, relative_error: (s.phi * (1 + relative_error), s.hd * (1 + relative_error)),
    "canopy_deflection": lambda s, rate: (s.phi, s.hd * np.exp(-rate * s.speed)),
    "canopy_bending": _bent,
    "undergrowth": lambda s, drag, height: (s.phi + drag * np.minimum(s.h / height, 1.0), s.hd),
    "foliage": lambda s, **leaf: (_leaves(s, **leaf), s.hd),
    "emergent_part": lambda s, share: (s.phi * (1.0 - share * (1.0 - np.minimum(s.h / s.hd, 1.0))), s.hd),
    "slow_stems": lambda s, **stem: (_stems(s, **stem), s.hd),
    "debris_screen": lambda s, excess, length: (s.phi * (1.0 + excess * np.exp(-s.lie.front / length)), s.hd),
    "density_trend": lambda s, trend, length: (s.phi * (1.0 + trend * np.tanh(s.lie.front / length - 1.0)), s.hd),
    "edge_thinning": lambda s, share, width: (
        s.phi * (1.0 - share * np.exp(np.minimum(s.lie.edge, 0.0) / width)), s.hd),
    "patch_density": lambda s, excess, patch: (s.phi * (1.0 + excess * (s.lie.patch == round(patch) - 1)), s.hd),
}  # fmt: skip


def _spot(s: State, x: float, y: float, radius: float) -> Field:
    """Squared distance from a place over the squared radius."""
    return ((s.lie.x - x) ** 2 + (s.lie.y - y) ** 2) / radius**2


def _tree(s: State, drag: float, x: float, y: float, radius: float) -> Field:
    along, across = (s.lie.x - x + s.lie.y - y) / 2**0.5, (s.lie.x - x - s.lie.y + y) / 2**0.5
    return s.k + drag * np.exp(-((across / (0.3 * radius + 0.2)) ** 2) - (along / (2.0 * radius)) ** 4)


def _deep(s: State, exponent: Field, reference_depth: float) -> Field:
    return s.k * (np.maximum(s.h, 0.02) / reference_depth) ** exponent


# k [1/m].
DRAG: dict[str, Effect] = {
    "depth_dependent_bank": lambda s, exponent, reference_depth: _deep(s, exponent * s.lie.bank, reference_depth),
    "depth_dependent_bed": lambda s, exponent, reference_depth: _deep(s, exponent * s.open_floor, reference_depth),
    "bank_trend": lambda s, trend: s.k * np.exp(trend * s.lie.bank * (s.lie.x / s.length - 0.5)),
    "bank_drag_trend": lambda s, drag, direction: (
        s.k + drag * (0.5 + direction * (s.lie.x / s.length - 0.5)) * s.lie.bank
    ),
    "bed_trend": lambda s, trend: s.k * np.exp(trend * s.open_floor * (s.lie.x / s.length - 0.5)),
    "bank_difference": lambda s, log_ratio: s.k * np.exp(0.5 * log_ratio * s.lie.bank * np.sign(s.lie.y)),
    "bank_roughness": lambda s, log_ratio: s.k * np.exp(log_ratio * s.lie.bank),
    "floor_difference": lambda s, log_ratio: s.k * np.exp(0.5 * log_ratio * s.open_floor * np.sign(s.lie.y)),
    "bed_stretch": lambda s, log_ratio, middle, share: (
        s.k * np.exp(log_ratio * s.open_floor * np.exp(-((2.0 * (s.lie.x / s.length - 0.5 - middle) / share) ** 4)))
    ),
    "steep_bank": lambda s, share: s.k * (1.0 + share * s.lie.bank * ((1.0 + s.rise**2) ** 0.5 - 1.0)),
    "bank_vegetation": lambda s, drag, height: s.k + 0.5 * drag * np.minimum(1 / height, 1 / s.h) * s.lie.bank,
    "stem_blockage": lambda s, share: s.k / (1.0 - share * s.lie.cover) ** 2,
    "unlisted:pier": lambda s, drag, x, y, radius: s.k + drag * np.exp(-(_spot(s, x, y, radius) ** 2)),
    "unlisted:fallen_tree": _tree,
}


def _strain(s: State, coefficient: float) -> Field:
    u_x, u_y, v_x, v_y = gradients(s)
    return coefficient**2 * USER_CELL * np.sqrt(2.0 * u_x**2 + 2.0 * v_y**2 + (u_y + v_x) ** 2)


def _layer(s: State, coefficient: float, width: float) -> Field:
    return coefficient * width**2 * np.exp(-((s.lie.edge / width) ** 2)) * shear(s)


def _eddies(s: State, coefficient: float, width: float, mean_depth: float) -> Field:
    return (coefficient * width) ** 2 * mean_depth / np.maximum(s.h, 0.2 * mean_depth) * shear(s)


def _growing(s: State, spreading: float, rate: float) -> Field:
    """van Prooijen and Uijttewaal (2002): a layer that widens from x = 0 on."""
    width = spreading * (1.0 - np.exp(-2.0 * rate * s.lie.x)) / (2.0 * rate)
    return (0.07 * width) ** 2 * shear(s)


# Viscosity added [m2/s].
MIXING: dict[str, Effect] = {
    "viscosity": lambda s, added: added + 0.0 * s.h,
    "elder": lambda s, coefficient: coefficient * s.h * np.sqrt(s.bed_k * s.h) * s.speed,
    "smagorinsky": _strain,
    "mixing_length": lambda s, length: length**2 * shear(s),
    "edge_mixing": _layer,
    "coherent_structures": _eddies,
    "growing_shear_layer": _growing,
    "wake_mixing": lambda s, coefficient, length: coefficient * s.speed * np.exp(-s.lie.wake / length),
}

Stress = tuple[Field, Field, Field]


def _helix(s: State, share: float) -> Stress:
    """Kalkwijk and Booij (1986): the stress of a spiral in balance, of the curvature of stream lines."""
    (u, v), (u_x, u_y, v_x, v_y) = (s.flow.u, s.flow.v), gradients(s)
    turn = s.h * (u**2 * v_x - v**2 * u_y + u * v * (v_y - u_x)) / (u**2 + v**2 + 0.0025) ** 1.5
    turn = turn / np.sqrt(1.0 + 4.0 * turn**2)
    a = np.minimum(np.sqrt(s.bed_k * s.h) / KARMAN, 0.5)
    carried = share * (5.0 * a - 15.6 * a**2 + 37.5 * a**3) * s.h * turn
    return 2.0 * carried * u * v, -carried * (u**2 - v**2), -2.0 * carried * u * v


def _cells(s: State, strength: float) -> Stress:
    """Ervine et al. (2000), of strength K over the floor; it fades on the banks."""
    k = strength * np.sin(np.pi * s.eta) * np.exp(-((s.eta / 1.5) ** 4))
    return 0.0 * s.h, k * s.h * s.flow.u**2, 0.0 * s.h


# Momentum fluxes h T: xx, xy, yy [m3/s2].
STRESS: dict[str, Callable[..., Stress]] = {
    "dispersion": lambda s, excess: (
        excess * s.h * s.flow.u**2, excess * s.h * s.flow.u * s.flow.v, excess * s.h * s.flow.v**2),
    "secondary_current": _cells,
    "helical_flow": _helix,
}  # fmt: skip


def _panels(s: State, strength: float, slope: float, bank_ratio: float) -> tuple[Field, Field]:
    held = -strength * GRAVITY * slope * (1.0 - s.lie.bank + bank_ratio * s.lie.bank) / np.maximum(s.speed, 1e-3)
    return held * s.flow.u, held * s.flow.v


def _sink(s: State, loss: float, x: float, y: float, radius: float) -> tuple[Field, Field]:
    held = -loss * np.exp(-_spot(s, x, y, radius))
    return held * s.flow.u, held * s.flow.v


# Forces along x and y [m/s2].
FORCE: dict[str, Callable[..., tuple[Field, Field]]] = {
    "wind": lambda s, speed: (WIND * AIR * abs(speed) * speed / np.maximum(s.h, 0.05), 0.0 * s.h),
    "panel_current": _panels,
    "turning_earth": lambda s, parameter: (parameter * s.flow.v, -parameter * s.flow.u),
    "unlisted:jet": lambda s, push, x, y, radius: (GRAVITY * push * np.exp(-_spot(s, x, y, radius)), 0.0 * s.h),
    "unlisted:sink": _sink,
}


def _trench(lie: Lie, depth: float, width: float) -> Field:
    beside = np.where(np.isfinite(lie.edge), lie.edge, -1e3)
    return np.where(beside > 0.0, -depth * np.exp(-(((beside - width) / width) ** 2)), 0.0)


def _hole(lie: Lie, depth: float, x: float, y: float, radius: float) -> Field:
    return -depth * np.exp(-((lie.x - x) ** 2 + (lie.y - y) ** 2) / radius**2)


# z_b less the surveyed one [m].
BED: dict[str, Callable[..., Field]] = {
    "floor_level_error": lambda lie, rise: rise * (1.0 - lie.bank),
    "bank_level_error": lambda lie, rise: rise * lie.bank,
    "bed_slope_error": lambda lie, slope: slope * (lie.end - lie.x),
    "cross_slope_error": lambda lie, slope: slope * lie.y,
    "flank_scour": _trench,
    "patch_deposit": lambda lie, rise: rise * (lie.patch >= 0),
    "wake_deposit": lambda lie, rise, length: rise * np.exp(-lie.wake / length),
    "unlisted:scour_hole": _hole,
}


def changes(table: Mapping[str, Callable[..., Any]], given: Mapping[str, Mapping[str, float]], seen: Any) -> list[Any]:
    """What those effects give that stand in a table."""
    return [table[name](seen, **numbers) for name, numbers in given.items() if name in table]
