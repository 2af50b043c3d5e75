"""Fingerprints of laws by the answers of predictions to each cell: one product for a law, and no flow.

    d prediction_n / d a = sum_cells  d prediction_n / d ln k  g share,   the same with ln nu and ln h U U

Terms of the grammar are multiplied by exp(a g), and g at the flow of the point says how much in each cell. So a form
may be tried at many references for nothing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.cell_responses import CellResponses, cell_responses
from vegglue.calibration.laws_in_case import centre_cells
from vegglue.effects.law import Law
from vegglue.effects.surroundings import Cells
from vegglue.engine.interface import Model, Point, by_itself
from vegglue.flow.local_changes import Term

# What a law changes, relative to what is there, by the name of its term.
RELATIVE_TERM: Mapping[str, Term] = {
    "floor": "friction", "bank": "friction", "plants": "friction", "viscosity": "mixing", "advection": "advection",
}  # fmt: skip


@dataclass(frozen=True)
class LawTraces:
    """Answers to each cell (station, nx, ny) by term, and the flow of each experiment with the rows of its stations."""

    responses: CellResponses
    flows: tuple[tuple[Array, Cells], ...]

    def of(self, law: Law, settings: Sequence[Mapping[str, float]]) -> Array:
        """d prediction / d strength (station, setting) [m/s or m], at each value of the reference."""
        answers = self.responses.of[RELATIVE_TERM[law.term.name]]
        found = np.zeros((len(answers), len(settings)))
        for rows, cells in self.flows:
            share = law.term.share(cells)
            fields = [np.broadcast_to(law.g(cells, **one) * share, cells.depth.shape).ravel() for one in settings]
            of_cells = answers[rows].reshape(rows.size, answers[0].size)
            found[rows] = of_cells @ np.array(fields, dtype=np.float32).T
        return found


def law_traces(model: Model, point: Point) -> LawTraces:
    """Of a model at a point."""
    responses = cell_responses(model, by_itself(model, point), tuple(dict.fromkeys(RELATIVE_TERM.values())))
    flows = tuple((rows, centre_cells(model, point, experiment)) for experiment, rows in model.rows.items())
    return LawTraces(responses, flows)
