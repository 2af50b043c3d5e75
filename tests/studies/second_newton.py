"""Newton's steps of the second solver: where the flow would stop changing, were its rates linear in depth and velocity.

    (dr/dw) dw = -r(w),   w = (h, u, v) and r = (dh/dt, d(hu)/dt - k|U|hu, d(hv)/dt - k|U|hv) of each cell

The slopes dr/dw are differences. A cell acts on cells at most two away, so that every fifth one along and across is
moved at once. Cells that are nearly dry stay as they are: explicit steps between move the waterline.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy.sparse
from scipy.sparse.linalg import splu
from second_kernels import DRY
from second_solver import Ends, Field, Flow, Reach, rates

# Cells under this depth [m] are left to explicit steps: three times that at which water is at rest.
SHALLOW = 3.0 * DRY
# By how much depths [m] and velocities [m/s] are moved for differences: their rounding is then some 1e-9.
MOVED = 1e-6
# Cells on which one acts lie in a square of so many, and slopes below this are none [1/s].
REACHED, NO_SLOPE = 5, 1e-9


def imbalance(reach: Reach, ends: Ends, flow: Flow) -> Field:
    """r (nx, ny, 3): dh/dt [m/s], d(hu)/dt and d(hv)/dt [m2/s2] with friction."""
    acting = reach.closure(flow)
    rh, ru, rv = rates(reach, ends, flow, acting)
    held = acting.drag * np.hypot(flow.u, flow.v) * flow.h
    return np.stack([rh, ru - held * flow.u, rv - held * flow.v], axis=-1)


def newton_of(reach: Reach, ends: Ends, flow: Flow) -> Callable[[Flow], Flow]:
    """Newton's step with the slopes at this flow, for flows near it. Errors: RuntimeError where they are singular."""
    live = flow.h > SHALLOW
    # Cells act on each other both ways: an order made for that leaves 0.6 to 0.8 of the entries, in half the time.
    ordered = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.1, "options": {"SymmetricMode": True}}
    factors = splu(_slopes(reach, ends, flow, live), **ordered)

    def step(near: Flow) -> Flow:
        moving = (live & (near.h > SHALLOW))[..., None]
        left = np.where(moving, imbalance(reach, ends, near), 0.0)
        change = np.zeros_like(left)
        change[live] = factors.solve(-left[live].ravel()).reshape(-1, 3)
        change = np.where(moving, change, 0.0)
        h = np.maximum(near.h + change[..., 0], 0.0)
        wet = h > DRY
        return Flow(h, np.where(wet, near.u + change[..., 1], 0.0), np.where(wet, near.v + change[..., 2], 0.0))

    return step


def _slopes(reach: Reach, ends: Ends, flow: Flow, live: Field) -> scipy.sparse.csc_matrix:
    """dr/dw over live cells, three rows and columns to each. The inflow of a cell is held, which hangs on all."""
    number = np.cumsum(live).reshape(live.shape) - 1
    before, rows, columns, values = imbalance(reach, ends, flow), [], [], []
    for along in range(REACHED):
        for across in range(REACHED):
            moved, owner, ruled = _moved_at_once(live, along, across)
            for which in range(3):
                after = _with(flow, which, moved)
                slope = (imbalance(reach, _held(ends, flow, after), after) - before) / MOVED
                for row in range(3):
                    there = ruled & (np.abs(slope[..., row]) > NO_SLOPE)
                    rows.append(3 * number[there] + row)
                    columns.append(3 * number.ravel()[owner[there]] + which)
                    values.append(slope[..., row][there])
    size = 3 * int(live.sum())
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return scipy.sparse.csc_matrix(entries, shape=(size, size))


def _moved_at_once(live: Field, along: int, across: int) -> tuple[Field, Field, Field]:
    """Live cells that are moved together; of every cell, the one of them nearest, and whether there is one."""
    i, j = np.indices(live.shape)
    near_i, near_j = (
        each - ((each - first + REACHED // 2) % REACHED - REACHED // 2) for each, first in ((i, along), (j, across))
    )
    inside = (near_i >= 0) & (near_i < live.shape[0]) & (near_j >= 0) & (near_j < live.shape[1])
    owner = np.clip(near_i, 0, live.shape[0] - 1) * live.shape[1] + np.clip(near_j, 0, live.shape[1] - 1)
    moved = live & (i % REACHED == along) & (j % REACHED == across)
    return moved, owner, live & inside & moved.ravel()[owner]


def _with(flow: Flow, which: int, moved: Field) -> Flow:
    fields = [flow.h, flow.u, flow.v]
    fields[which] = fields[which] + MOVED * moved
    return Flow(*fields)


def _held(ends: Ends, flow: Flow, after: Flow) -> Ends:
    """The ends by which every cell takes in as much water at another depth."""
    old, new = np.maximum(flow.h[0], MOVED), np.maximum(after.h[0], MOVED)
    return replace(ends, share=ends.share * (old / new) ** (5.0 / 3.0))
