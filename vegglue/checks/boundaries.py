"""Can water enter and leave, does it stay off the edges, and is the discharge the measured one?"""

from collections.abc import Iterator

import numpy as np

from vegglue.arrays import Array
from vegglue.case.parameter_space import middle_value, prior_range
from vegglue.case.schema import Case, Experiment
from vegglue.checks.ensemble_and_priors import shown_bounds
from vegglue.measurements.observations import Observations
from vegglue.measurements.sections import section_place
from vegglue.resistance.physical_constants import GRAVITY
from vegglue.site.channel_geometry import discharges_upstream_of, expected_depth
from vegglue.site.grid import curvature_of
from vegglue.site.gridded_site import Site, in_experiment
from vegglue.site.zones import centres_within, inflow_cells

# Width of the grid over the radius of its centreline [-] from which its ends should be straight: chosen, not measured.
LEAST_TURN = 0.02


def remarks_on_boundaries(case: Case, site: Site) -> Iterator[str]:
    """Inflows and outlets without cells or without water, water on edges that act as walls, ends in a bend."""
    yield from _ends_in_a_bend(site)
    for name, experiment in case.experiments.items():
        now = in_experiment(site, name)
        depth = expected_depth(case, now, experiment)
        open_ = centres_within(case.outlet.range, site.grid.y)
        level = middle_value(case, experiment.level)
        wet = np.maximum(depth[-1, open_], 0.0)
        if not open_.any():
            yield "The outlet holds no cell centre: no water can leave."
        elif not (wet > 0).any():
            lowest = now.bed[-1, open_].min()
            yield f"The outlet level of experiment {name}, {level:g} m, is below the bed there, {lowest:.3g} m."
        elif (froude := _froude(case, experiment, wet, site.grid.dy)) > 0.7:
            yield f"Experiment {name} leaves at a Froude number of {froude:.2g}: the outlet level may not hold near 1."
        if case.friction.walls is None and (depth[:, [0, -1]] > 0).any():
            yield (
                f"Experiment {name} puts water on the side edges of the grid, which act as smooth walls: widen the "
                f"grid, or for a flume give the roughness of its walls as `friction.walls`."
            )
        for inflow, side in case.inflows.items():
            edge = {"west": depth[0], "south": depth[:, 0], "north": depth[:, -1]}[side.side]
            cells = inflow_cells(side, site.grid)
            if not cells.size:
                yield f"Inflow {inflow} holds no cell centre: no water can enter."
            elif not (edge[cells] > 0).any():
                yield f"Inflow {inflow} lies above the water of experiment {name}."


def _ends_in_a_bend(site: Site) -> Iterator[str]:
    """A grid that begins or ends where its centreline turns: u is even there, and the level at the outlet too."""
    curvature = curvature_of(site.grid)
    for end, turning in (("begins", curvature[0]), ("ends", curvature[-1])):
        if abs(turning) * site.grid.y.size * site.grid.dy > LEAST_TURN:
            yield (
                f"The grid {end} in a bend with a radius of {1.0 / abs(turning):.3g} m, where water that enters evenly "
                f"or leaves at one level has to find its shape first: let the grid run on straight for about its width."
            )


def _froude(case: Case, experiment: Experiment, depth: Array, width: float) -> float:
    """Fr = Q / (A sqrt(g A / B)) of the outlet [-]."""
    area, top = float(depth.sum()) * width, float((depth > 0).sum()) * width
    discharge = sum(middle_value(case, value) for value in experiment.discharge.values())
    return discharge / (area * float(np.sqrt(GRAVITY * area / top)))


def remarks_on_discharges(case: Case, observations: Observations) -> Iterator[str]:
    """Discharges [m3/s] that differ from those of ADV sections, by the rule of the case, by more than their errors."""
    rules = {(one.experiment, one.section): one.average for one in case.observations}
    for (name, section), by_rule in observations.discharge.items():
        given = discharges_upstream_of(case, case.experiments[name], section_place(observations.table, name, section))
        if given is None:
            continue
        parts = [prior_range(case, value) for value in given]
        total = (sum(low for low, _ in parts), sum(high for _, high in parts))
        for rule, measured in by_rule.items():
            if rules.get((name, section), rule) != rule:
                continue
            off = max(total[0] - measured.value, measured.value - total[1])
            if off > max(2.0 * measured.standard_error, 0.03 * measured.value):
                found = f"{measured.value:.3g} ± {measured.standard_error:.2g} m3/s by the rule `{rule}`"
                said = f"the case says {shown_bounds(total)} m3/s"
                yield f"The ADV of {section} in experiment {name} gives {found}, {said}."
