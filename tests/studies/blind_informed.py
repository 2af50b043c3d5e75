"""What well-calibrated sets come to: each holds the hidden effect with a stated chance, for somebody who knows that one
effect is there, how long its trace is, and all traces without error, on the stations of the study.
"""

from dataclasses import replace

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import baseline
from vegglue.screening import score_test
from vegglue.screening.residual_screening import Screening, screen
from vegglue.twins.hidden_effect import LARGEST_SIZE, TwinBase
from vegglue.twins.twin import measured_twin

# Data sets for each effect and ground, and groups that a set holds at most to count as small.
DRAWS, SMALL = 40, 3


def silent(ground: TwinBase) -> Screening:
    """A screening where nothing is hidden: for its fingerprints, and the errors they are seen against."""
    station, _ = measured_twin(ground, (), 0.0, "white", 1)
    return screen(baseline(replace(ground.model, station=station), ground.here.z))


def informed(looks: list[Screening], signal: float, level: float) -> tuple[float, float]:
    """Share of data sets whose set of this level holds the hidden effect, and whose set has at most SMALL groups."""
    random = np.random.default_rng(7)
    sets = np.concatenate([_sets(seen, signal, level, random) for seen in looks])
    return float(sets[:, 0].mean()), float((sets[:, 1] <= SMALL).mean())


def _sets(seen: Screening, signal: float, level: float, random: np.random.Generator) -> Array:
    """Whether the truth is in the set, and its groups, (data sets, 2); each effect that may be as long is hidden."""
    units, family = seen.projected.units, seen.fingerprints.columns
    allowed = seen.possible_signs(signal, LARGEST_SIZE)
    found = []
    for true, columns in enumerate(family):
        ways = [(sign, int(column)) for column in columns for sign in (0, 1) if allowed[sign, column]]
        for _ in range(DRAWS if ways else 0):
            sign, column = ways[random.integers(len(ways))]
            residual = (1 - 2 * sign) * signal * units[:, column] + random.standard_normal(len(units))
            drawn = replace(seen.projected, residual=residual)
            kept = score_test.likeliest_families(
                drawn, family, score_test.chances(drawn, family, allowed, signal), level
            )
            found.append((any(true in group for group in kept), len(kept)))
    return np.array(found, dtype=float)
