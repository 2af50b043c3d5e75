"""Can water enter and leave, does it stay off the edges, and is the discharge the measured one?"""

from collections.abc import Iterator

import numpy as np

from vegglue.arrays import Array
from vegglue.case.channel_geometry import expected_depth
from vegglue.case.grid import curvature_of
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.parameter_space import middle_value
from vegglue.case.schema import Case, Experiment
from vegglue.case.zones import centres_within, inflow_cells
from vegglue.diagnosis.directions import misdirected
from vegglue.effects.physical_constants import GRAVITY
from vegglue.measurements.observations import Observations
from vegglue.measurements.section_discharge import discharge_mismatches, mismatched_discharges
from vegglue.wording.numbers import in_digits
from vegglue.wording.sentences import sentence

# Width of the grid over the radius of its centreline [-] from which its ends should be straight: chosen, not measured.
LEAST_TURN = 0.02
# Froude number [-] of an outlet above which it is said that its level may not hold: chosen, not measured. At 1 no wave
# carries the level upstream; 0.7 leaves room for the fastest part of a section, some 1.4 times as fast as its mean.
LARGEST_FROUDE = 0.7


def remarks_on_boundaries(case: Case, site: Site) -> Iterator[str]:
    """Inflows and outlets without cells or without water, water on edges that act as walls, ends in a bend."""
    yield from _ends_in_a_bend(site)
    dry = dry_outlets(case, site)
    for name, experiment in case.experiments.items():
        now = in_experiment(site, name)
        depth = expected_depth(case, now, experiment)
        open_ = centres_within(case.outlet.range, site.grid.y)
        wet = np.maximum(depth[-1, open_], 0.0)
        if not open_.any():
            yield "The outlet holds no cell centre: no water can leave."
        elif name in dry:
            continue
        elif (froude := _froude(case, experiment, wet, site.grid.dy)) > LARGEST_FROUDE:
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


def dry_outlets(case: Case, site: Site) -> dict[str, float]:
    """Experiments whose outlet level lies below all of the bed there, and the lowest of that [m]."""
    open_ = centres_within(case.outlet.range, site.grid.y)
    if not open_.any():
        return {}
    lowest = {name: float(in_experiment(site, name).bed[-1, open_].min()) for name in case.experiments}
    return {name: bed for name, bed in lowest.items() if middle_value(case, case.experiments[name].level) <= bed}


def remarks_on_dry_outlets(case: Case, site: Site, observations: Observations) -> Iterator[str]:
    """Outlets below the bed, where no command finds a flow; one that was measured in or not is solved alike."""
    table = observations.table
    for name, bed in dry_outlets(case, site).items():
        level = middle_value(case, case.experiments[name].level)
        measured = (table["experiment"] == name).any()
        advice = "" if measured else ", or take the experiment out, in which nothing was measured"
        yield (
            f"The outlet level of experiment {name}, {level:g} m, is below the bed there, {in_digits(bed)} m, so that "
            f"no command finds a flow: correct the level or the bed{advice}."
        )


def _ends_in_a_bend(site: Site) -> Iterator[str]:
    """A grid that begins or ends where its centreline turns: u is even there, and the level at the outlet too."""
    curvature = curvature_of(site.grid)
    for end, turning in (("begins", curvature[0]), ("ends", curvature[-1])):
        if abs(turning) * site.grid.y.size * site.grid.dy > LEAST_TURN:
            yield (
                f"The grid {end} in a bend with a radius of {in_digits(1.0 / abs(turning))} m, where water that enters "
                "evenly or leaves at one level has to find its shape first: let the grid run on straight for about its "
                "width."
            )


def _froude(case: Case, experiment: Experiment, depth: Array, width: float) -> float:
    """Fr = Q / (A sqrt(g A / B)) of the outlet [-]."""
    area, top = float(depth.sum()) * width, float((depth > 0).sum()) * width
    discharge = sum(middle_value(case, value) for value in experiment.discharge.values())
    return discharge / (area * float(np.sqrt(GRAVITY * area / top)))


def remarks_on_discharges(case: Case, site: Site, observations: Observations) -> Iterator[str]:
    """Sections whose velocities clearly carry another discharge than stated, in one sentence; none of an experiment
    whose velocities or levels run the wrong way, as that is why.
    """
    off, told = mismatched_discharges(case, site, observations.table), misdirected(case, observations)
    yield from map(sentence, discharge_mismatches([one for one in off if one.experiment not in told]))
