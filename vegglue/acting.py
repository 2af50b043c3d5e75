"""Effects at work in a flow: what they make of plants, friction, viscosity and momentum at cell centres.

Nothing here knows a face of the grid but `push`, which hands momentum over to the faces.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vegglue import kernels
from vegglue.effect import Acting, Array, Cells, Ground, Stand, applied
from vegglue.ground import part

LEVEL, ACROSS, ALONG = 0, 1, 2
# Columns worked on together, so that what lies between fits the cache.
STRIP = 40


@dataclass(frozen=True)
class Closures:
    """Friction rate k [1/m] and viscosity [m2/s], (nx, ny, m); momentum fluxes h T [m3/s2] and forces [m/s2] by name,
    as far as there are any.
    """

    rate: Array
    viscosity: Array
    momentum: dict[str, Array]


@dataclass(frozen=True)
class Bare:
    """What effects at cell centres start from: depth h [m], friction rate k [1/m] and the part of it that is the bed's,
    (nx, ny, m), viscosity [m2/s]; whether shear acts over the smallest depth, see `Problem`.
    """

    depth: Array
    rate: Array
    bed_rate: Array
    viscosity: Array
    smallest_shear_depth: bool


def stages_of(acting: tuple[Acting, ...]) -> set[str]:
    return {one.effect.stage for one in acting}


def stand_values(
    acting: tuple[Acting, ...],
    ground: Ground,
    column: NDArray[np.int64],
    row: NDArray[np.int64],
    plants: tuple[Array, Array],
    state: Array,
    depth: Array,
) -> tuple[Array, Array]:
    """phi and canopy height (cell, m) of vegetated cells after the effects of the stage plants."""
    phi, canopy_height = plants
    before = np.maximum(column - 1, 0)
    u = 0.5 * (state[column, ALONG, row] + state[before, ALONG, row])
    north = np.minimum(row + 1, state.shape[2] - 1)
    beyond = np.where((row + 1 < state.shape[2])[:, None], state[column, ACROSS, north], 0.0)
    v = 0.5 * (state[column, ACROSS, row] + beyond)
    stand = Stand(
        phi=phi,
        canopy_height=canopy_height,
        depth=depth[column, row],
        speed=np.sqrt(u**2 + v**2 + 1e-6),
        front=ground.front[column, row],
        edge=ground.edge[column, row],
        x=ground.x[column, 0],
        y=ground.y[0, row],
    )
    now = applied(acting, "plants", stand, {"phi": phi, "canopy_height": canopy_height})
    return np.ascontiguousarray(now["phi"]), np.ascontiguousarray(now["canopy_height"])


def closures(acting: tuple[Acting, ...], ground: Ground, state: Array, bare: Bare) -> Closures:
    """All that the stages resistance, exchange and force hand on."""
    nx = state.shape[0]
    found: dict[str, Array] = {"rate": np.empty_like(bare.rate), "viscosity": np.empty_like(bare.rate)}
    for first in range(0, nx, STRIP):
        stop = min(first + STRIP, nx)
        wide = slice(max(first - 1, 0), min(stop + 1, nx))
        inner = slice(first - wide.start, stop - wide.start)
        cells = _cells(part(ground, wide, slice(None)), state, bare, wide)
        values = applied(acting, "resistance", cells, {"rate": cells.rate})
        cells = Cells(**{**cells.__dict__, "rate": values["rate"]})
        values |= applied(acting, "exchange", cells, {"viscosity": bare.viscosity, "xx": ZERO, "xy": ZERO, "yy": ZERO})
        values |= applied(acting, "force", cells, {"x": ZERO, "y": ZERO})
        for name, value in values.items():
            if value is ZERO:
                continue
            if name not in found:
                found[name] = np.zeros_like(bare.rate)
            found[name][first:stop] = np.broadcast_to(value, cells.depth.shape)[inner]
    momentum = {name: value for name, value in found.items() if name not in ("rate", "viscosity")}
    return Closures(found["rate"], found["viscosity"], momentum)


ZERO, NOTHING = np.zeros(1), np.zeros((0, 0, 0))


def _cells(ground: Ground, state: Array, bare: Bare, columns: slice) -> Cells:
    here, depth = state[columns], bare.depth[columns]
    before = state[np.maximum(np.arange(columns.start, columns.stop) - 1, 0), ALONG]
    v = 0.5 * here[:, ACROSS]
    v[:, :-1] += 0.5 * here[:, ACROSS, 1:]
    return Cells(
        ground=ground,
        depth=depth,
        level=here[:, LEVEL],
        u=0.5 * (here[:, ALONG] + before),
        v=v,
        rate=bare.rate[columns],
        bed_rate=bare.bed_rate[columns],
        viscosity=bare.viscosity,
        shear_depth=np.minimum(depth[:, 1:], depth[:, :-1]) if bare.smallest_shear_depth else NOTHING,
    )


def push(out: Array, momentum: dict[str, Array], depth: Array, film: float, dx: float, dy: float) -> None:
    """Take forces and the divergence of momentum fluxes from a residual (nx, 3, ny, m), see kernels.push."""
    x, y, xx, xy, yy = (momentum.get(name, NOTHING) for name in ("x", "y", "xx", "xy", "yy"))
    kernels.push(out, depth, x, y, xx, xy, yy, film, dx, dy)
