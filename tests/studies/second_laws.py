"""Closures of the second solver, from the formulas in the literature: drag of floor, banks and plants, mixing.

    floor    k = g n^2 / h^(4/3)                                        Manning
    banks    k = g / (C^2 h), C = 18 log10(max(12 h/ks, b))             Keulegan; the floor b differs between codes
    plants   k = g / (C^2 h), C = (1/C_b^2 + phi/2g)^(-1/2) + a sqrt(g)/kappa ln(h/h_d) above h_d
             Baptist et al. (2007), doi:10.1080/00221686.2007.9521778

A formulation says how one code, or one site, differs from the next in such laws.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import second_effects as effects
from second_channel import Channel, Lie
from second_effects import State, changes
from second_hidden_laws import LAW_DRAG, LAW_MIXING
from second_kernels import DRY, GRAVITY, KARMAN
from second_solver import Closure, Field, Flow


@dataclass(frozen=True)
class Formulation:
    """bank_floor: b [-]; emergent: 1 where only the part of plants under water resists, else 0; upper: a, share of the
    logarithm above plants [-]; bare: C_b of the bed among plants [m^1/2/s].
    """

    bank_floor: float = 1.3
    emergent: float = 0.0
    upper: float = 1.0
    bare: float = 60.0


USUAL = Formulation()


@dataclass(frozen=True)
class Ground:
    """What is so on a site: n [s m^(-1/3)], ks [m], phi of the densest patch [-], canopy height [m], nu [m2/s]; stems
    of each patch over those counted [-]; effects: numbers by name, of each that acts.
    """

    nb: float
    ks: float
    phi: float
    hd: float
    nu: float
    stems: tuple[float, ...]
    formulation: Formulation = USUAL
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


def closure_of(
    ground: Ground, channel: Channel, lie: Lie, spacing: tuple[float, float], extra: Field
) -> Callable[[Flow], Closure]:
    """The closure on cells dx by dy [m]; extra: drag added [1/m]."""
    counted = np.array([share * factor for share, factor in zip(channel.density, ground.stems, strict=True)])
    phi = ground.phi * np.append(counted, 0.0)[lie.patch]

    def closure(flow: Flow) -> Closure:
        state = _before(ground, channel, lie, spacing, phi, flow)
        return _acting(ground, state, extra)

    return closure


def _before(ground: Ground, channel: Channel, lie: Lie, spacing: tuple[float, float], phi: Field, flow: Flow) -> State:
    """The state before any effect but those on plants has acted."""
    h = np.maximum(flow.h, DRY)
    floor = GRAVITY * ground.nb**2 / h ** (4.0 / 3.0)
    bank = GRAVITY / (h * (18.0 * np.log10(np.maximum(12.0 * h / ground.ks, ground.formulation.bank_floor))) ** 2)
    bed = np.where(lie.bank > 0.0, bank, floor)
    hd, nu = np.full(h.shape, ground.hd), np.full(h.shape, ground.nu)
    state = State(channel.half, channel.rise, channel.length, lie, flow, spacing, phi, hd, bed, bed, nu)
    for name, numbers in ground.effects.items():
        if name in effects.PLANTS:
            new = effects.PLANTS[name](state, **numbers)
            state = replace(state, phi=new[0], hd=new[1])
    return replace(state, k=(1.0 - lie.cover) * bed + lie.cover * _plants(ground.formulation, state))


def _plants(formulation: Formulation, state: State) -> Field:
    """k among plants [1/m]."""
    h, hd = state.h, state.hd
    wetted = 1.0 - formulation.emergent * (1.0 - np.minimum(h / hd, 1.0))
    chezy = 1.0 / np.sqrt(1.0 / formulation.bare**2 + state.phi * wetted / (2.0 * GRAVITY))
    chezy += formulation.upper * np.sqrt(GRAVITY) / KARMAN * np.log(np.maximum(h / hd, 1.0))
    return GRAVITY / (chezy**2 * h)


def _acting(ground: Ground, state: State, extra: Field) -> Closure:
    drag = effects.DRAG | LAW_DRAG
    for name, numbers in ground.effects.items():
        if name in drag:
            state = replace(state, k=drag[name](state, **numbers))
    nu = sum(changes(effects.MIXING | LAW_MIXING, ground.effects, state), state.nu)
    push_x, push_y = np.zeros_like(state.k), np.zeros_like(state.k)
    for along, across in changes(effects.FORCE, ground.effects, state):
        push_x, push_y = push_x + state.flow.h * along, push_y + state.flow.h * across
    for stress in changes(effects.STRESS, ground.effects, state):
        along, across = _divergence(stress, state)
        push_x, push_y = push_x - along, push_y - across
    return Closure(np.maximum(state.k + extra, 0.0), np.maximum(nu, 0.0), push_x, push_y)


def _divergence(stress: tuple[Field, Field, Field], state: State) -> tuple[Field, Field]:
    """div (h T) of fluxes that are the mean of both cells at faces, and pass no shore."""
    xx, xy, yy = stress
    wet = state.flow.h > DRY
    return (
        _change(xx, wet, state.spacing[0], 0) + _change(xy, wet, state.spacing[1], 1),
        _change(xy, wet, state.spacing[0], 0) + _change(yy, wet, state.spacing[1], 1),
    )


def _change(flux: Field, wet: Field, step: float, axis: int) -> Field:
    flux, wet = np.moveaxis(flux, axis, 0), np.moveaxis(wet, axis, 0)
    faces = np.zeros((flux.shape[0] + 1, *flux.shape[1:]))
    faces[1:-1] = 0.5 * (flux[1:] + flux[:-1]) * (wet[1:] & wet[:-1])
    if axis == 0:  # the ends are open
        faces[0], faces[-1] = flux[0], flux[-1]
    return np.moveaxis(np.diff(faces, axis=0) / step, 0, axis)
