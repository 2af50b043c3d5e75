"""A second solver of the shallow-water equations; it shares neither code nor scheme nor grid with the package.

    dh/dt + d(hu)/dx + d(hv)/dy = s
    d(hu)/dt + d(hu^2 + g h^2/2)/dx + d(huv)/dy = -g h dz/dx - h k |U| u + div(h nu grad u) + push, v alike

Explicit finite volumes on collocated cells: HLLC (Toro 2001), hydrostatic reconstruction (Audusse et al. 2004,
doi:10.1137/S1064827503431090) about a bed known at the faces, slopes after van Albada, Heun's steps, friction implicit
in each cell. Arrays are (nx, ny), x downstream, y to the left; SI throughout.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import second_kernels as kernels

Field = np.ndarray
# Share of the largest stable step: 1 is the limit of Heun's steps with second order.
COURANT = 0.8
# Steps between two evaluations of the closures: some 0.1 s, under the time of friction among plants.
LAWS_EVERY = 5


@dataclass(frozen=True)
class Closure:
    """What acts on the flow in cells: drag k [1/m], viscosity nu [m2/s], and pushes along x and y [m2/s2]."""

    drag: Field
    viscosity: Field
    push_x: Field
    push_y: Field


@dataclass(frozen=True)
class Flow:
    """Depth [m] and velocities [m/s] of all cells."""

    h: Field
    u: Field
    v: Field


@dataclass(frozen=True)
class Reach:
    """A channel on cells dx by dy [m]: bed at centres z, at faces zx (nx+1, ny) and zy (nx, ny+1) [m]; source: water
    added [m/s]; closure: of a flow.
    """

    dx: float
    dy: float
    z: Field
    zx: Field
    zy: Field
    source: Field
    closure: Callable[[Flow], Closure]


@dataclass(frozen=True)
class Ends:
    """Discharge [m3/s] spread by share(y) h^(5/3) at x = 0, and the level kept at the other end [m]."""

    discharge: float
    level: float
    share: Field


def rates(reach: Reach, ends: Ends, flow: Flow, acting: Closure) -> tuple[Field, Field, Field]:
    """dh/dt [m/s], d(hu)/dt and d(hv)/dt [m2/s2] without friction."""
    h, u, v = flow.h, flow.u, flow.v
    eta = h + reach.z
    rh, ru, rv = reach.source.copy(), acting.push_x.copy(), acting.push_y.copy()
    slopes = tuple(np.zeros_like(h) for _ in range(3))
    kernels.slopes_x(h, eta, u, v, *slopes)
    kernels.rates_x(h, eta, u, v, *slopes, reach.zx, reach.dx, rh, ru, rv)
    slopes = tuple(np.zeros_like(h) for _ in range(3))
    kernels.slopes_y(h, eta, u, v, *slopes)
    kernels.rates_y(h, eta, u, v, *slopes, reach.zy, reach.dy, rh, ru, rv)
    kernels.walls(h, eta, reach.zy, reach.dy, rv)
    kernels.ends(h, eta, u, v, reach.zx, reach.dx, reach.dy, ends.discharge, ends.level, ends.share, rh, ru, rv)
    kernels.mixing_x(h, u, v, reach.dx, acting.viscosity, ru, rv)
    kernels.mixing_y(h, u, v, reach.dy, acting.viscosity, ru, rv)
    return rh, ru, rv


def largest_step(reach: Reach, flow: Flow) -> float:
    """Courant's limit [s] in two dimensions."""
    speed = np.sqrt(kernels.GRAVITY * flow.h)
    per = (np.abs(flow.u) + speed) / reach.dx + (np.abs(flow.v) + speed) / reach.dy
    return COURANT / float(per.max())


def march(reach: Reach, ends: Ends, flow: Flow, steps: int) -> tuple[Flow, float]:
    """The flow after some steps, and the seconds they took."""
    flow = Flow(flow.h.copy(), flow.u.copy(), flow.v.copy())
    later = Flow(*(np.empty_like(flow.h) for _ in range(3)))
    latest = Flow(*(np.empty_like(flow.h) for _ in range(3)))
    passed = 0.0
    for step in range(steps):
        if step % LAWS_EVERY == 0:
            acting, dt = reach.closure(flow), largest_step(reach, flow)
        kernels.advance(
            flow.h, flow.u, flow.v, *rates(reach, ends, flow, acting), acting.drag, dt, later.h, later.u, later.v
        )
        kernels.advance(
            later.h, later.u, later.v, *rates(reach, ends, later, acting), acting.drag, dt, latest.h, latest.u, latest.v
        )
        kernels.mean(flow.h, flow.u, flow.v, latest.h, latest.u, latest.v)
        passed += dt
    return flow, passed
