"""What a run states beside its verdict, as values: findings, those that limit the use of the result first; stations,
the health of the run, and how it was made.
"""

import math
import platform
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.case.channel_geometry import discharges_upstream_of
from vegglue.case.resolved_config import case_hash
from vegglue.diagnosis.channel_check import StationUnused
from vegglue.errors import shell_line
from vegglue.flow.status import FAILED, RUN_BY_COMMAND, STATUS_WORDS, members_with
from vegglue.inference.command_ensemble import doubts_of_predictions
from vegglue.inference.statements import BandCoverage, NamedParameter, limits_use, parameter_of, posterior_statements
from vegglue.measurements.kinds import Kind, kind_of
from vegglue.measurements.observations import section_place
from vegglue.measurements.section_discharge import changing_discharge
from vegglue.pages.parameters import plant_parameter, residual_compared, symbols_of
from vegglue.pages.run import Run, median_plants, station_zones
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior

# Share of failed members [-] above which the rest may misrepresent the prior.
FAILED_TOLERATED = 0.01
# Standard errors [-] between measured and prescribed discharge, beyond which chance explains it 1 time in 20.
DISCHARGE_DOUBTED = 2.0
# Largest |Q - Q_in| over all that enters [-] of a sound member: a hundredth of what a flow meter can resolve.
MASS_LIMIT = 1e-4


@dataclass(frozen=True)
class CylinderCompared:
    """Drag of rigid cylinders of the surveyed size, and how many times as much the flow needs; None: not known."""

    parameter: NamedParameter
    mean: float
    sd: float
    median: float
    ratio: float | None
    undergrowth: tuple[float, float] | None


@dataclass(frozen=True)
class CanopyHeightRead:
    """Height of the canopy [m] in the verticals of a section, NaN with a reason; heights that the model has."""

    section: str
    experiment: str
    height: float
    error: float
    reason: str
    modelled: tuple[float, ...]


@dataclass(frozen=True)
class ModelBand:
    inside: int
    used: int


@dataclass(frozen=True)
class ReadingsExcludedSince:
    """Readings of the posterior that a diagnosis made after it excludes; config: of the case, quoted for a shell."""

    readings: int
    config: str


@dataclass(frozen=True)
class DischargeMeasured:
    """Discharge through the verticals of a section beside the one prescribed [m3/s], None if it is a parameter; changed
    by: effects that change it on the way there; off: prescribed minus measured in standard errors.
    """

    section: str
    experiment: str
    value: float
    error: float
    prescribed: float | None
    changed_by: str
    off: float


@dataclass(frozen=True)
class MembersSolved:
    """Members by the way in which they were solved; draws: of a refined posterior and those of them that failed."""

    newton: int
    marched: int
    failed: int
    by_command: int | None
    draws: tuple[int, int] | None


@dataclass(frozen=True)
class MassError:
    worst: float
    limit: float = MASS_LIMIT


@dataclass(frozen=True)
class FlowOfBuiltInEngine:
    pass


def findings(run: Run) -> list[tuple[object, bool]]:
    """All statements, and of each whether it limits the use of the result; those that do come first."""
    case, posterior, observations = run.case, run.posterior, run.observations
    others, symbols = case.reference.table if case.reference else {}, symbols_of(case)
    found: list[tuple[object, bool]] = []
    for one in posterior_statements(posterior, others, symbols):
        found.append((one, limits_use(one)))
        if isinstance(one, BandCoverage):
            used = posterior.station["used"].to_numpy()
            value = posterior.station["value"].to_numpy(float)[used]
            low, high = posterior.predicted.model_band[0][used], posterior.predicted.model_band[-1][used]
            found.append((ModelBand(int(np.sum((value >= low) & (value <= high))), posterior.fit.used), False))
    name, cylinder = plant_parameter(case), run.cylinder
    if name is not None and cylinder is not None:
        inferred = posterior.marginals.median[name] if posterior.canopy is None else posterior.canopy.median
        median = cylinder.quantile(0.5)
        ratio = inferred / median if posterior.marginals.identified[name] else None
        size = cylinder.mean, cylinder.standard_deviation, median
        parameter = parameter_of(posterior, name, symbols)
        found.append((CylinderCompared(parameter, *size, ratio, cylinder.undergrowth_density), False))
    for (experiment, section), canopy in observations.canopy_height.items():
        heights = np.unique(median_plants(run, experiment).canopy_height.round(3)) if canopy.unknown is None else ()
        reason, modelled = "" if canopy.unknown is None else canopy.unknown.value, tuple(map(float, heights))
        height = canopy.value, canopy.standard_error
        found.append((CanopyHeightRead(section, experiment, *height, reason, modelled), False))
    for kind, rmse in posterior.fit.best_rmse.items():
        compared = residual_compared(posterior, kind, rmse, best=True)
        found.append((compared, compared.compared == "exceeds"))
    for _, row in observations.table[~observations.table["used"]].iterrows():
        found.append((StationUnused(str(row["experiment"]), row["x"], row["y"], str(row["reason"])), False))
    if run.excluded_since:
        found.append((ReadingsExcludedSince(run.excluded_since, shell_line([case.source.name])), True))
    for (experiment, section), rules in observations.discharge.items():
        x, measured = section_place(observations.table, experiment, section), rules["profile"]
        given = discharges_upstream_of(case, case.experiments[experiment], x)
        if given is None:
            continue
        prescribed = None if any(isinstance(value, str) for value in given) else sum(map(float, given))
        off = 0.0 if prescribed is None else (measured.value - prescribed) / measured.standard_error
        changed = changing_discharge(case, experiment, x) or ""
        carried = measured.value, measured.standard_error
        discharge = DischargeMeasured(section, experiment, *carried, prescribed, changed, off)
        found.append((discharge, abs(off) > DISCHARGE_DOUBTED and not changed))
    if run.ensemble is not None:
        found += [(one, True) for one in doubts_of_predictions(run.ensemble)]
        newton, marched, failed, commanded = (members_with(run.ensemble.status, number) for number in STATUS_WORDS)
        draws = (posterior.sample.members, posterior.sample.failed) if posterior.refinement is not None else None
        by_command = commanded if run.ensemble.by_command else None
        members = MembersSolved(newton, marched, failed, by_command, draws if failed else None)
        found.append((members, too_many_failed(run.ensemble, posterior)))
        if not run.ensemble.by_command:
            worst = largest_mass_error(run.ensemble)
            found.append((MassError(worst), worst >= MASS_LIMIT))
    if case.of_another_model:
        found.append((FlowOfBuiltInEngine(), False))
    return sorted(found, key=lambda one: not one[1])


def failed_of_weighed(ensemble: Ensemble | None, posterior: Posterior) -> tuple[int, int]:
    """How many of the members that a posterior weighs failed, and how many these are: draws of its own if it was
    refined, as the ensemble then is only the start of the search.
    """
    if posterior.refinement is not None or ensemble is None:
        return posterior.sample.failed, posterior.sample.members
    return members_with(ensemble.status, FAILED), len(ensemble.status)


def too_many_failed(ensemble: Ensemble | None, posterior: Posterior) -> bool:
    """Whether so many of them failed that the posterior may be wrong."""
    failed, members = failed_of_weighed(ensemble, posterior)
    return failed > FAILED_TOLERATED * members


def largest_mass_error(ensemble: Ensemble) -> float:
    """Largest |Q - Q_in| over all that enters, of the solved members [-]."""
    return float(np.max(ensemble.mass_error[ensemble.status != FAILED]))


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
