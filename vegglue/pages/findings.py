"""What a run states beside its verdict, as values; those that limit the use of the result come first."""

from dataclasses import dataclass

import numpy as np

from vegglue.case.channel_geometry import discharges_upstream_of
from vegglue.errors import shell_line
from vegglue.flow.status import FAILED, STATUS_WORDS, members_with
from vegglue.inference.command_ensemble import doubts_of_predictions
from vegglue.inference.statements import BandCoverage, NamedParameter, limits_use, parameter_of, posterior_statements
from vegglue.measurements.observations import section_place
from vegglue.measurements.section_discharge import changing_discharge
from vegglue.pages.parameters import plant_parameter, residual_compared, symbols_of
from vegglue.pages.run import Run, median_plants
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
class StationNotUsed:
    experiment: str
    x: float
    y: float
    reason: str


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
        found.append((StationNotUsed(str(row["experiment"]), row["x"], row["y"], str(row["reason"])), False))
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
