"""How predictions answer to a term of the equations that is changed in one cell, by adjoints of each station."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vegglue.case.grid import Grid
from vegglue.engine.interface import Model, Point, responses_to_cells
from vegglue.flow.local_changes import Term
from vegglue.parallel import in_threads


@dataclass(frozen=True)
class CellResponses:
    """How predictions of all stations answer to a term changed in each cell of a grid, (station, nx, ny) by term."""

    grid: Grid
    of: dict[Term, NDArray[np.float32]]


def cell_responses(model: Model, point: Point, terms: tuple[Term, ...]) -> CellResponses:
    """Those of all experiments, side by side."""
    shape = (len(model.station), model.site.grid.x.size, model.site.grid.y.size)
    found = {term: np.zeros(shape, dtype=np.float32) for term in terms}
    tasks = [(model, point, experiment, terms) for experiment in point.flows]
    for experiment, of in zip(point.flows, in_threads(responses_to_cells, tasks), strict=True):
        for term in terms:
            found[term][model.rows[experiment]] = of[term]
    return CellResponses(model.site.grid, found)
