"""How small sets could be at all: those of somebody who knows that one effect is there, how long its trace is, and all
traces without error, on the same stations. No diagnosis can know as much.
"""

from dataclasses import replace

import numpy as np

from vegglue import score
from vegglue.baseline import baseline
from vegglue.effect import Array
from vegglue.suspicion import Look, look
from vegglue.twin import LARGEST, Ground, measured

# Data sets for each effect and ground, and groups that a set holds at most to count as small.
DRAWS, SMALL = 60, 3


def at_best(grounds: list[Ground], signal: float, level: float) -> tuple[float, float]:
    """Share of data sets whose set of this level holds the hidden effect, and whose set has at most SMALL groups."""
    random = np.random.default_rng(7)
    sets = np.concatenate([_sets(_silent(ground), signal, level, random) for ground in grounds])
    return float(sets[:, 0].mean()), float((sets[:, 1] <= SMALL).mean())


def _silent(ground: Ground) -> Look:
    """A look where nothing is hidden: for its traces, and the errors they are seen against."""
    station, _ = measured(ground, (), 0.0, "white", 1)
    return look(baseline(replace(ground.model, station=station), ground.here.z))


def _sets(seen: Look, signal: float, level: float, random: np.random.Generator) -> Array:
    """Whether the truth is in the set, and its groups, (data sets, 2); each effect that may be as long is hidden."""
    units, one_sided = seen.projected.units, seen.traces.one_sided
    family = [seen.traces.columns[j] for j in np.flatnonzero(seen.stretch(signal) < LARGEST)]
    found = []
    for true, columns in enumerate(family):
        for _ in range(DRAWS):
            column = int(random.choice(columns))
            sign = 1.0 if one_sided[column] else float(random.choice([-1.0, 1.0]))
            residual = sign * signal * units[:, column] + random.standard_normal(len(units))
            drawn = replace(seen.projected, residual=residual)
            kept = score.fewest(score.chances(drawn, one_sided, family, signal), level)
            found.append((true in kept, _groups(drawn, [family[j] for j in kept])))
    return np.array(found, dtype=float)


def _groups(drawn: score.Projected, kept: list[np.ndarray]) -> int:
    """Groups that the data cannot tell apart, each effect by the shape that fits best."""
    scores = np.abs(drawn.units.T @ drawn.residual)
    best = [int(columns[np.argmax(scores[columns])]) for columns in kept]
    units = drawn.units[:, best]
    return len(score.groups([str(column) for column in best], units.T @ units))
