"""Models of a case: on its own grid, and on a coarser one."""

from dataclasses import replace

from vegglue.case.schema import Case
from vegglue.engine.interface import Engine, Model
from vegglue.engine.newton import NEWTON
from vegglue.measurements.observations import Observations
from vegglue.site.gridded_site import build_site
from vegglue.site.zones import ranges_without_cells

# Least number of cells of a coarser grid, along and across. Chosen, not measured: fewer hardly resolve a section.
FEWEST_CELLS = 6
# Length over width of cells above which a coarser grid has wider ones only: across the flow is where the error is.
LONG_CELL = 2.0


def model_of(case: Case, observations: Observations, engine: Engine = NEWTON) -> Model:
    """The case on its grid, read where it was measured."""
    return Model(case, build_site(case), observations.table, engine)


def coarser(model: Model) -> Model | None:
    """The model on cells of twice the size, or of twice the width only where they are more than twice as long as wide.

    None where their number is odd or would become too small, or an inflow or the outlet would hold no cell centre.
    """
    grid = model.site.grid
    along = 1 if grid.dx > LONG_CELL * grid.dy else 2
    if grid.x.size % along or grid.y.size % 2 or min(grid.x.size / along, grid.y.size / 2) < FEWEST_CELLS:
        return None
    cell = (along * model.case.grid.cell[0], 2.0 * model.case.grid.cell[1])
    case: Case = model.case.model_copy(update={"grid": model.case.grid.model_copy(update={"cell": cell})})
    site = build_site(case)
    return None if any(ranges_without_cells(case, site.grid)) else replace(model, case=case, site=site)
