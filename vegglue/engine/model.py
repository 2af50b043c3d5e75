"""Models of a case, on its own grid and on a coarser one; and the phase of a command that compiles first."""

from dataclasses import replace

from vegglue.case.grid import on_cells
from vegglue.case.gridded_site import Site, build_site
from vegglue.case.schema import Case
from vegglue.case.zones import ranges_without_cells
from vegglue.compilation import is_kept
from vegglue.engine.first_compilation import compile_beside
from vegglue.engine.interface import Model
from vegglue.flow.kernels import rates
from vegglue.wording.phases import COMPILING


def with_compilation(phase: str) -> str:
    """The phase of a command that solves flows, and that it compiles first where no earlier process did, by two
    processes.

    25 s of a core for a diagnosis were measured, 64 s on a busy machine; then nothing seems to move.
    """
    if rates.signatures or is_kept(rates):  # others may be kept by a second process alone
        return phase
    compile_beside()
    return phase + COMPILING


# Least number of cells of a coarser grid, along and across. Chosen, not measured: fewer hardly resolve a section.
FEWEST_CELLS = 6
# Length over width of cells above which a coarser grid has wider ones only: across the flow is where the error is.
LONG_CELL = 2.0


def coarser(model: Model) -> Model | None:
    """The model on cells of twice the size.

    Returns
    -------
    Model or None
        None if there are no such cells, see `coarser_grid`.
    """
    found = coarser_grid(model.case, model.site)
    return None if found is None else replace(model, case=found[0], site=found[1])


def coarser_grid(case: Case, site: Site) -> tuple[Case, Site] | None:
    """The case on cells of twice the size, or of twice the width only if they are more than twice as long as wide.

    Returns
    -------
    (Case, Site) or None
        None if their number is odd or would become too small, or an inflow or the outlet would have no cell centre.
    """
    grid = site.grid
    along = 1 if grid.dx > LONG_CELL * grid.dy else 2
    if grid.x.size % along or grid.y.size % 2 or min(grid.x.size / along, grid.y.size / 2) < FEWEST_CELLS:
        return None
    coarse = on_cells(case, (along * case.grid.cell[0], 2.0 * case.grid.cell[1]))
    on_coarse = build_site(coarse)
    return None if any(ranges_without_cells(coarse, on_coarse.grid)) else (coarse, on_coarse)


def ever_coarser(case: Case, site: Site) -> list[tuple[Case, Site]]:
    """The case on its grid and on ever coarser ones, see `coarser_grid`, the coarsest first."""
    grids = [(case, site)]
    while (coarse := coarser_grid(*grids[0])) is not None:
        grids.insert(0, coarse)
    return grids
