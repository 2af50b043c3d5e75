"""The tables of the page: stations, health of the run, how it was made."""

import math
import platform
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.case.resolved_config import case_hash
from vegglue.flow.status import FAILED, RUN_BY_COMMAND, STATUS_WORDS, members_with
from vegglue.measurements.kinds import Kind, kind_of
from vegglue.pages.findings import largest_mass_error
from vegglue.pages.run import Run, station_zones
from vegglue.results.ensemble import Ensemble

# Decimals of what was measured: 1 mm/s and 1 mm, or as many as a better instrument resolves.
FEWEST_DECIMALS, MOST_DECIMALS = 3, 5


@dataclass(frozen=True)
class StationRow:
    """One line of the table of stations; modelled: median and 95 % range; places: decimals of the values."""

    experiment: str
    section: str
    kind: Kind
    x: float
    y: float
    zone: str
    value: float
    error: float
    modelled: tuple[float, float, float]
    residual: float
    score: float
    reason: str
    places: int


@dataclass(frozen=True)
class RunHealth:
    """Members and failures, mass errors, weights and iterations, by which the numbers are trusted or not; None of what
    a run has not. bound_mass: share of the weight near the lower and the upper bound of each parameter that has some.
    """

    members: int
    failed: int
    draws: bool
    counts: tuple[tuple[str, int, float], ...]
    reasons: tuple[tuple[str, int], ...]
    by_command: bool
    mass_error: float | None
    effective_size: float
    posterior_members: int
    largest_weight: float
    pareto_k: float
    iterations: tuple[float, int] | None
    seconds: tuple[float, float] | None
    bound_mass: tuple[tuple[str, float, float], ...]


def station_rows(run: Run) -> list[StationRow]:
    """All stations, used or not, in the order of the table of observations."""
    table, fit = run.observations.table.assign(zone=station_zones(run)), run.posterior.fit
    rows = []
    for index, (_, row) in enumerate(table.iterrows()):
        low, middle, high = run.posterior.predicted.model_band[[0, 2, -1], index]
        error = float(row["standard_error"])
        places = min(max(FEWEST_DECIMALS, 1 - math.floor(math.log10(error))), MOST_DECIMALS) if error > 0.0 else 3
        rows.append(
            StationRow(
                str(row["experiment"]), str(row["section"]), kind_of(row["kind"]), row["x"], row["y"], str(row["zone"]),
                row["value"], error, (middle, low, high), fit.residual[index], fit.residual[index] / fit.noise[index],
                str(row["reason"]), places,
            )
        )  # fmt: skip
    return rows


def run_health(run: Run) -> RunHealth:
    """By what the numbers of a run are trusted or not."""
    ensemble, posterior = run.ensemble, run.posterior
    ends = {name: posterior.marginals.bound_mass[name] for name in posterior.parameters}
    bounds = [(name, float(low), float(high)) for name, (low, high) in ends.items()]
    mass = tuple(one for one in bounds if not np.isnan(one[1:]).all())  # NaN: its prior has no bounds
    weights, sample = posterior.weighting, posterior.sample
    shared = (weights.effective_size, sample.members, weights.largest_weight, weights.pareto_k)
    if ensemble is None:
        return RunHealth(sample.members, sample.failed, True, (), (), False, None, *shared, None, None, mass)
    own, failed = not ensemble.by_command, members_with(ensemble.status, FAILED)
    reasons = pd.Series(ensemble.reason[ensemble.status == FAILED].astype(str)).value_counts()
    seconds = ensemble.seconds[np.isfinite(ensemble.seconds)]
    solved = ensemble.iterations[ensemble.status != FAILED]
    return RunHealth(
        len(ensemble.status), failed, False, member_counts(ensemble),
        tuple((str(reason), int(number)) for reason, number in reasons.items()), ensemble.by_command,
        largest_mass_error(ensemble) if own else None, *shared,
        (float(np.median(solved)), int(ensemble.iterations.max())) if own else None,
        (float(seconds.sum()), float(np.median(seconds))), mass,
    )  # fmt: skip


def member_counts(ensemble: Ensemble) -> tuple[tuple[str, int, float], ...]:
    """For each status of a member: its words, how many members have it, and their share."""
    ways = {RUN_BY_COMMAND, FAILED} if ensemble.by_command else STATUS_WORDS.keys() - {RUN_BY_COMMAND}
    counts = [(word, members_with(ensemble.status, way)) for way, word in STATUS_WORDS.items() if way in ways]
    return tuple((word, number, number / len(ensemble.status)) for word, number in counts)


def provenance(run: Run) -> dict[str, object]:
    """What the run was made of: config, data, versions, grid and choices of the model, by the names of the page."""
    numerics, infer, grid, settings = run.case.numerics, run.case.infer, run.site.grid, run.posterior.settings
    return {
        "config": run.case.source.name, "hash": case_hash(run.case)[:16], "seed": settings.seed,
        "version": settings.version, "python": platform.python_version(), "cells": (len(grid.x), len(grid.y)),
        "cell": (grid.dx, grid.dy), "likelihood": infer.likelihood, "sigma": infer.sigma, "method": settings.method,
        "behavioural": infer.behavioural, "emergent": numerics.emergent, "shear_depth": numerics.shear_depth,
        "bank_argument_minimum": numerics.bank_argument_minimum,
    }  # fmt: skip
