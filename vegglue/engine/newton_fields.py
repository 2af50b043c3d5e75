"""How predictions answer to a term of the equations changed in each cell, by adjoints.

    d prediction_n / d a_c = - l_n . dR/da_c,    J' l_n = d prediction_n / d state

A change in a cell reaches the residual of its neighbours only, so that every CELL_STRIDE-th cell along and across is
changed at once, and each answer is told from the next by its place (Curtis, Powell and Reid 1974,
doi:10.1093/imamat/13.1.117; not checked against it). Where a bed changes how discharge is shared over all cells of an
inflow, that part is an answer of its own, see `shared_inflow`:

    + (l_n . dR/d ln Q) d ln W/da_c
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array, Single
from vegglue.case.channel_geometry import ChannelGeometry, channel_geometry, rows_of
from vegglue.compilation import compiled
from vegglue.engine.flow_problem import problem_at
from vegglue.engine.interface import Model, Point
from vegglue.flow.equations import cell_depths, residual
from vegglue.flow.local_changes import Term, with_changed_term
from vegglue.flow.problem import Problem, crop
from vegglue.flow.sensor import reading_weights
from vegglue.flow.shared_inflow import (
    answer_to_discharge,
    cells_of,
    changes_of_whole,
    shared_inflows,
    with_kept_shares,
)
from vegglue.flow.tangent import adjoints
from vegglue.flow.wet_band import widen

# Cells from one changed cell to the next [-]: a change reaches the residual of two neighbours on either side.
CELL_STRIDE = 5
# Stations whose adjoints are made together [-]. On 342 x 40 cells 1,000 stations take 1.6 s of a core with 128, 1.7 s
# with 64 or 32, and 2.6 s all at once, when each holds some 50 bytes in every cell.
STATIONS_TOGETHER = 128
# Small changes for differences, in the unit of each term: thousandths of what is common, and large against rounding.
SMALL_CHANGE: dict[Term, float] = {
    "friction": 1e-3, "drag": 1e-5, "bed": 1e-4, "inflow": 1e-6, "viscosity": 1e-4, "mixing": 1e-2,
    "advection": 1e-3,
}  # fmt: skip


@dataclass(frozen=True)
class _Change:
    """A term changed in each cell: dR/da at shares of the inflows as they are, in every CELL_STRIDE-th cell at once
    (nx, 3, ny, CELL_STRIDE^2), and d ln W/da of each inflow that shares by depth, (cell,) each.
    """

    local: Single
    of_whole: tuple[Array, ...]


def responses_by_adjoints(model: Model, point: Point, experiment: str, terms: Sequence[Term]) -> Mapping[Term, Single]:
    """See `Engine.responses_to_cells`; in single precision, one solve for each station."""
    flow, grid, station = point.flows[experiment], model.site.grid, model.station_of(experiment)
    problem = problem_at(model, experiment, point.z[None])
    state, rows = widen(flow.state, flow.rows, flow.band), slice(*flow.band)
    part = crop(problem, *flow.band)
    geometry = rows_of(channel_geometry(model.case, model.site, experiment), *flow.band)
    changes = {term: _change(part, flow.state, geometry, term) for term in terms}
    inflows = shared_inflows(part)
    discharges = [answer_to_discharge(part, flow.state, inflow).astype(np.float32) for inflow in inflows]
    found = {term: np.zeros((len(station), grid.x.size, grid.y.size), np.float32) for term in terms}
    for first in range(0, len(station), STATIONS_TOGETHER):
        some = slice(first, first + STATIONS_TOGETHER)
        weights = reading_weights(problem, state, grid, station.iloc[some])
        sensitivity = adjoints(part, flow.state, flow.factors, weights[:, :, rows]).astype(np.float32)
        of_discharges = [np.einsum("ikjn,ikj->n", sensitivity, discharge) for discharge in discharges]
        for term, change in changes.items():
            answers = _told_apart(sensitivity, change.local)
            for inflow, of_discharge, of_whole in zip(inflows, of_discharges, change.of_whole, strict=True):
                column, row = cells_of(part, inflow)
                answers[:, column, row] += np.outer(of_discharge, of_whole)
            found[term][some, :, rows] = answers
    return found


def _change(part: Problem, state: Array, geometry: ChannelGeometry, term: Term) -> _Change:
    small, states = SMALL_CHANGE[term], np.repeat(state, CELL_STRIDE**2, axis=3)
    many = with_changed_term(part, geometry, term, small * _lattice(*part.shape))
    before, after = cell_depths(part, state), cell_depths(many, states)
    rates = residual(with_kept_shares(many, before, after), states)
    # The depth of a cell changes in the one member only in which the cell itself is changed.
    of_whole = [changes_of_whole(part, one, before, after).sum(axis=1) / small for one in shared_inflows(part)]
    return _Change(((rates - residual(part, state)) / small).astype(np.float32), tuple(of_whole))


def _lattice(nx: int, ny: int) -> Array:
    """1 in the cells that are changed in member m, (nx, ny, CELL_STRIDE^2): every so many-th both ways."""
    i, j = np.arange(nx)[:, None, None] % CELL_STRIDE, np.arange(ny)[None, :, None] % CELL_STRIDE
    member = np.arange(CELL_STRIDE**2)
    return ((i == member // CELL_STRIDE) & (j == member % CELL_STRIDE)).astype(float)


def _told_apart(sensitivity: Single, change: Single) -> Single:
    """-l . dR of every cell (n, nx, ny), summed over the window of CELL_STRIDE cells around it.

    sensitivity l (nx, 3, ny, n), change dR (nx, 3, ny, CELL_STRIDE^2).
    """
    nx, _, ny, n = sensitivity.shape
    found = np.zeros((nx, ny, n), dtype=np.float32)
    _sum_windows(sensitivity, change, found)
    return np.ascontiguousarray(np.moveaxis(found, -1, 0))


@compiled
def _sum_windows(sensitivity: Single, change: Single, found: Single) -> None:
    nx, equations, ny, n = sensitivity.shape
    half = CELL_STRIDE // 2
    for i in range(nx):
        first, last = max(i - half, 0), min(i + half + 1, nx)
        for j in range(ny):
            member = (i % CELL_STRIDE) * CELL_STRIDE + j % CELL_STRIDE
            lowest, highest = max(j - half, 0), min(j + half + 1, ny)
            for a in range(first, last):
                for b in range(lowest, highest):
                    for k in range(equations):
                        weight = change[a, k, b, member]
                        if weight != 0.0:
                            for station in range(n):
                                found[i, j, station] -= sensitivity[a, k, b, station] * weight
