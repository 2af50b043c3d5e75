"""Draws from a posterior by adaptive importance sampling.

    w_i = p(z_i) / q(z_i),   q the mixture of the proposals of all rounds

p comes from a run of the flow model at every draw. Between rounds an emulator of the model shapes the next proposal: it
decides how many draws are effective, and never what the result is.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError
from vegglue.inference.emulator import Emulator, emulator_of_density
from vegglue.inference.student_mixture import Mixture, adapt, draw, pooled_weights
from vegglue.inference.weighted_statistics import effective_size
from vegglue.progress import silent

# Rounds at most, draws of the first, and of any other at most. Chosen, not measured: they bound the runs of the model
# (6,336 at most), and a larger first round makes a better emulator of a proposal that may be poor.
SAMPLING_ROUNDS, FIRST_DRAWS, MOST_DRAWS = 7, 192, 1024
# Draws of a round over those before at most: chosen, so that a proposal that turns out to be poor costs two thirds of
# all draws so far, while 192 draws and two more rounds are enough for 1,000 effective ones of six in ten.
GROWTH = 2
# Draws with a density below which nothing is drawn anew: the emulator predicts each from others.
FEWEST_SOLVED = 2
# Effective share of the draws [-] below which the next round is small, and the least that is hoped for of another,
# as proposals get better; what is drawn over what is missing, for hope may be wrong. Chosen, not measured.
POOR_SHARE, HOPED_SHARE, OVER_MISSING = 0.25, 0.75, 1.05
# Draws come in sets of this size: neighbours are solved together.
DRAWS_TOGETHER = 16
Predict = Callable[[Array], Array]
LogDensity = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Sample:
    """All draws z (m, p), values predicted there (m, n), NaN where that failed, and log density (m,), -inf there.

    weights (m,): of sum 1; drawn, effective: draws and effective draws so far, after each round.
    """

    z: Array
    values: Array
    log_density: Array
    weights: Array
    drawn: tuple[int, ...]
    effective: tuple[float, ...]


def sample(
    predict: Predict,
    density: LogDensity,
    start: Mixture,
    wanted: int,
    seed: int,
    finished: Callable[[int], None] = silent,
) -> Sample:
    """Draws until `wanted` of them are effective, or SAMPLING_ROUNDS are over.

    predict: z (m, p) -> values (m, n); density: z, values -> ln p(z) up to a constant (m,); finished: is told how many
    of those wanted are effective after each round.

    Errors: InputError when fewer than FEWEST_SOLVED of the draws have a density.
    """
    from scipy.stats import qmc  # late: other commands need not wait for it

    points = qmc.Halton(start.centre.shape[1] + 2, seed=seed)
    mixture, size = start, FIRST_DRAWS
    rounds: list[tuple[int, Mixture]] = []
    parts: list[tuple[Array, Array, Array]] = []
    drawn: list[int] = []
    effective: list[float] = []
    while True:
        new = draw(mixture, points.random(size))
        values = predict(new)
        parts.append((new, values, _impossible_where_nan(density(new, values))))
        rounds.append((size, mixture))
        z, values, logs = (np.concatenate(part) for part in zip(*parts, strict=True))
        if (solved := int(np.isfinite(logs).sum())) < FEWEST_SOLVED:
            raise InputError(
                f"infer: {solved or 'none'} of the {len(z)} members drawn around the best fit was solved, too few "
                "to go on from; use `--method glue`."
            )
        weights = pooled_weights(logs, z, rounds)
        drawn.append(len(z))
        effective.append(effective_size(weights))
        finished(min(int(effective[-1]), wanted))
        if effective[-1] >= wanted or len(rounds) == SAMPLING_ROUNDS:
            return Sample(z, values, logs, weights, tuple(drawn), tuple(effective))
        last = _effective_share(parts[-1][2], new, rounds[-1:])
        emulator = emulator_of_density(z, values, density, mixture.centre[0], mixture.lower[0])
        mixture = adapt(partial(_emulated, emulator, density), mixture, seed + len(rounds))
        size = min(_next_size(wanted - effective[-1], last), GROWTH * len(z))


def _emulated(emulator: Emulator, density: LogDensity, z: Array) -> Array:
    return density(z, emulator.predict(z))


def _impossible_where_nan(logs: Array) -> Array:
    return np.where(np.isnan(logs), -np.inf, logs)


def _effective_share(logs: Array, z: Array, own: list[tuple[int, Mixture]]) -> float:
    """Share of the draws z (m, p) of one round that is effective [-]; 0 where none of them was solved."""
    return effective_size(pooled_weights(logs, z, own)) / len(z) if np.isfinite(logs).any() else 0.0


def _next_size(missing: float, share: float) -> int:
    """Draws of the next round: few while only a small `share` of the draws is effective, else what is missing."""
    if share < POOR_SHARE:
        size = 2 * FIRST_DRAWS
    else:
        size = np.clip(OVER_MISSING * missing / max(share, HOPED_SHARE), DRAWS_TOGETHER, MOST_DRAWS)
    return int(DRAWS_TOGETHER * np.ceil(size / DRAWS_TOGETHER))
