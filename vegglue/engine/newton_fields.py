"""How predictions answer to a term of the equations changed in each cell, by adjoints.

    d prediction_n / d a_c = - l_n . dR/da_c,    J' l_n = d prediction_n / d state

A change in a cell reaches the residual of its neighbours only, so that every CELL_STRIDE-th cell along and across is
changed at once, and each answer is told from the next by its place (Curtis, Powell and Reid 1974,
doi:10.1093/imamat/13.1.117; not checked against it). Beside the inflow, where a
bed changes how water is spread over the whole inflow, this is not so: there an answer is that of the cells around it
together.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from vegglue.arrays import Array, Single
from vegglue.case.parameter_space import theta_at
from vegglue.compilation import compiled
from vegglue.engine.interface import Model, Point
from vegglue.flow.equations import residual
from vegglue.flow.local_changes import Term, with_changed_term
from vegglue.flow.problem import Problem, crop
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.sensor import reading_weights
from vegglue.site.channel_geometry import ChannelGeometry, channel_geometry, rows_of
from vegglue.solver.tangent import adjoints
from vegglue.solver.wet_band import widen

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


def responses_by_adjoints(model: Model, point: Point, experiment: str, terms: Sequence[Term]) -> Mapping[Term, Single]:
    """See `Engine.responses_to_cells`; in single precision, one solve for each station."""
    flow, grid, station = point.flows[experiment], model.site.grid, model.station_of(experiment)
    problem = build_problem(model.case, model.site, experiment, theta_at(model.case, point.z[None]))
    state, rows = widen(flow.state, flow.rows, flow.band), slice(*flow.band)
    part = crop(problem, *flow.band)
    geometry = rows_of(channel_geometry(model.case, model.site, experiment), *flow.band)
    changes = {term: _changes(part, flow.state, geometry, term) for term in terms}
    found = {term: np.zeros((len(station), grid.x.size, grid.y.size), np.float32) for term in terms}
    for first in range(0, len(station), STATIONS_TOGETHER):
        some = slice(first, first + STATIONS_TOGETHER)
        weights = reading_weights(problem, state, grid, station.iloc[some])
        sensitivity = adjoints(flow.factors, weights[:, :, rows]).astype(np.float32)
        for term, change in changes.items():
            found[term][some, :, rows] = _told_apart(sensitivity, change)
    return found


def _changes(part: Problem, state: Array, geometry: ChannelGeometry, term: Term) -> Single:
    """dR/da of the term in every CELL_STRIDE-th cell at once, (nx, 3, ny, CELL_STRIDE^2)."""
    small = SMALL_CHANGE[term]
    many = with_changed_term(part, geometry, term, small * _lattice(*part.shape))
    rates = residual(many, np.repeat(state, CELL_STRIDE**2, axis=3))
    return ((rates - residual(part, state)) / small).astype(np.float32)


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
        # Beside an edge the window is shifted inwards, so that every change is counted once.
        first = 0 if i < CELL_STRIDE else i - half
        last = nx if i >= nx - CELL_STRIDE else i + half + 1
        for j in range(ny):
            member = (i % CELL_STRIDE) * CELL_STRIDE + j % CELL_STRIDE
            lowest = 0 if j < CELL_STRIDE else j - half
            highest = ny if j >= ny - CELL_STRIDE else j + half + 1
            for a in range(first, last):
                for b in range(lowest, highest):
                    for k in range(equations):
                        weight = change[a, k, b, member]
                        if weight != 0.0:
                            for station in range(n):
                                found[i, j, station] -= sensitivity[a, k, b, station] * weight
