"""What a diagnosis needs of memory, by its counts of flows and cells, and how many cores fit into what it may use."""

from vegglue.calibration.baseline import FEWEST_CELLS_ACROSS
from vegglue.case.channel_geometry import cells_across
from vegglue.case.gridded_site import Site
from vegglue.case.size_limits import WIDE_FROM, factor_bytes
from vegglue.engine.interface import Model
from vegglue.engine.model import coarser
from vegglue.errors import InputError
from vegglue.flow.nested_dissection import MOST_BYTES, keep_factors_within

# What the process holds before it solves anything, and what it finds beside flows [bytes].
BASE = 0.4e9
# Flows that are held of each experiment at once [-], on the cells of the search and on the case's own: refits of all
# hypotheses, and points of the calibration. Measured on natural reaches, 72 x 32 to 360 x 150 cells.
SEARCHED, OWN = 12.0, 4.0
# A flow without its factors on a wide grid, and what each core works with [bytes a cell].
FLOW, AT_WORK = 1000.0, 5000.0
# Factors of so many flows on the case's own cells are kept if there is room [-]: those of two experiments, of a point
# and of the one it started from, and two to spare.
SETS = 6.0
# Share of the machine's memory that may be used unless a command says otherwise [-].
MEMORY_SHARE = 0.9
GIGABYTE = 1e9


def jobs_in_memory(model: Model, jobs: int, allowed: float) -> int:
    """As many of `jobs` cores as the memory allowed [bytes] has room for; factors of wide grids are kept within it.

    Raises
    ------
    InputError
        If one core needs more.
    """
    found = coarser(model)
    searched = found.site if found is not None and cells_across(found.site) >= FEWEST_CELLS_ACROSS else model.site
    experiments, cells = len(model.case.experiments), model.site.bed.size
    held = BASE + experiments * (SEARCHED * _flow_bytes(searched) + OWN * _flow_bytes(model.site))
    nx, ny = model.site.bed.shape
    in_use = factor_bytes(nx, ny) if ny >= WIDE_FROM else 0.0  # the least of factors that are kept
    each = AT_WORK * cells + 2.0 * in_use
    fit = min(int((allowed - held) / each), jobs)
    if fit < 1:
        raise InputError(
            f"{model.case.name}: a diagnosis on {nx} x {ny} cells needs about {(held + each) / GIGABYTE:.1f} GB, "
            f"{allowed / GIGABYTE:.1f} GB are allowed: take larger cells, or raise --memory."
        )
    room, enough = allowed - held - AT_WORK * cells * fit, max(MOST_BYTES, SETS * in_use)
    keep_factors_within(min(max(room, 2.0 * in_use), enough))
    return fit


def _flow_bytes(site: Site) -> float:
    nx, ny = site.bed.shape
    return FLOW * nx * ny if ny >= WIDE_FROM else factor_bytes(nx, ny)
