"""Does water run faster than its waves, where neither Newton nor marching is made for it?"""

import math
from collections.abc import Iterator

import numpy as np

from vegglue.case.channel_geometry import half_width
from vegglue.case.gridded_site import Site
from vegglue.case.parameter_space import middle_value
from vegglue.case.schema import Case, Experiment
from vegglue.effects.physical_constants import GRAVITY

# Halvings and more of the error of the depth, whatever it began at: each multiplies it by less than 2/3.
ROUNDS = 60


def remarks_on_steep_flow(case: Case, site: Site) -> Iterator[str]:
    """Experiments whose even flow on the slope of the floor would be supercritical."""
    slope = floor_slope(site)
    for name, experiment in case.experiments.items():
        froude = even_froude(case, site, experiment, slope)
        if froude > 1.0:
            yield (
                f"Experiment {name} is supercritical: on the slope of the floor, {slope:.2g}, water without plants "
                f"runs at a Froude number of about {froude:.2g}. The model is for slower flow; expect members to fail."
            )


def floor_slope(site: Site) -> float:
    """S = -dz/dx of the lowest bed of each cross-section, by least squares [-]."""
    return float(-np.polyfit(site.grid.x, site.bed.min(axis=1), 1)[0])


def even_froude(case: Case, site: Site, experiment: Experiment, slope: float) -> float:
    """Fr = C (S/g)^(1/2) of even flow on the floor, C at its depth h = (q / (C S^(1/2)))^(2/3) [-]; 0 without a fall.

    q: discharge over the width of the floor, all of it, as if there were neither banks nor plants.
    """
    if slope <= 0.0:
        return 0.0
    per_width = sum(middle_value(case, value) for value in experiment.discharge.values()) / (2.0 * half_width(site))
    lowest = site.friction_class[np.arange(site.bed.shape[0]), site.bed.argmin(axis=1)]
    name = site.class_names[int(np.bincount(lowest).argmax())]
    depth = chezy = 1.0
    for _ in range(ROUNDS):
        chezy = _chezy(case, name, depth)
        depth = (per_width / (chezy * math.sqrt(slope))) ** (2.0 / 3.0)
    return chezy * math.sqrt(slope / GRAVITY)


def _chezy(case: Case, name: str, depth: float) -> float:
    """C of a friction class at a depth [m^1/2/s]: h^(1/6)/n, 18 log10(12 h/k_s), or given."""
    law = case.friction.classes[name]
    coefficient = middle_value(case, law.coefficient)
    if law.law == "manning":
        return float(depth ** (1.0 / 6.0) / coefficient)
    if law.law == "keulegan":
        return float(18.0 * math.log10(max(12.0 * depth / coefficient, case.numerics.bank_argument_minimum)))
    return float(coefficient)
