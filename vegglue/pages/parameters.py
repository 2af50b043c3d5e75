"""The parameters of a run as rows of its page: prior, posterior, values of other studies; and the state of the fit."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.special

from vegglue.case.case_effects import parameters_of_effects
from vegglue.case.schema import Case
from vegglue.inference.statements import (
    DOUBTED,
    UNBELIEVED,
    NamedParameter,
    measurement_error,
    off_its_prior,
    parameter_of,
    pressed_bounds,
)
from vegglue.measurements.kinds import STREAMWISE, Kind, kind_of
from vegglue.pages.run import Run
from vegglue.results.posterior import Posterior
from vegglue.results.verdict import is_too_small
from vegglue.wording.numbers import decimals

# Standard deviation of log10 [-] above which a value is written as a power of ten: below, both sides of it are alike.
WIDE = 0.05


@dataclass(frozen=True)
class ParameterRow:
    """A parameter with its prior, posterior, and values of others.

    prior: ends of its range, or of 95 % of it; power: median and standard deviation of its log10, None unless it is
    compared so; identification: identified, not-identified or unknown; study: median and standard deviation of another
    study (NaN: not stated), as a power if power; known: the value of a synthetic record. Differences are ours minus
    theirs in standard deviations of both together; of known values in ours, and in the study's.
    """

    parameter: NamedParameter
    meaning: str
    distribution: str
    prior: tuple[float, float]
    median: float
    sd: float
    power: tuple[float, float] | None
    low: float
    high: float
    identification: str
    share: float
    bounds: tuple[str, ...]
    off_prior: bool
    study: tuple[float, float] | None = None
    study_difference: float = math.nan
    known: float | None = None
    known_difference: float = math.nan
    known_in_study: float = math.nan
    corrected: tuple[float, float] | None = None  # canopy heights [m] from and to which phi was corrected

    @property
    def wide(self) -> bool:
        """Whether it is written as a power of ten."""
        return self.power is not None and self.power[1] > WIDE


@dataclass(frozen=True)
class FitRow:
    """Sigma of the residual of a kind, or (kind None) the number of stations; study: that of another study."""

    kind: Kind | None
    value: float
    study: float | None


@dataclass(frozen=True)
class ResidualCompared:
    """An RMSE beside the standard error of the measurements; compared: unknown, exceeds, hardly, explained or far-less;
    best: of the best member, else of the median prediction.
    """

    kind: Kind
    rmse: float
    error: float
    compared: str
    best: bool = False


@dataclass(frozen=True)
class PosteriorVerdict:
    """What is known of the parameters, and how well the model does."""

    identified: tuple[NamedParameter, ...]
    at_bound: tuple[NamedParameter, ...]
    unknown: tuple[NamedParameter, ...]
    used: int
    claimed: bool
    effective_size: float
    members: int
    residual: ResidualCompared


def symbols_of(case: Case) -> dict[str, str]:
    """Symbol of each parameter by its name."""
    return {name: prior.symbol or name for name, prior in case.parameters.items()}


def posterior_verdict(case: Case, posterior: Posterior) -> PosteriorVerdict:
    """What stands on top of a page without a diagnosis."""
    named = {name: parameter_of(posterior, name, symbols_of(case)) for name in posterior.parameters}
    at_bound = [name for name in named if pressed_bounds(posterior, name)]
    known = [name for name in named if posterior.marginals.identified[name] and name not in at_bound]
    unknown = [name for name in named if name not in {*known, *at_bound}]
    sure, bound, unsure = (tuple(named[name] for name in group) for group in (known, at_bound, unknown))
    kind = next(iter(posterior.fit.rmse))
    return PosteriorVerdict(
        sure, bound, unsure, posterior.fit.used, posterior.claimed, posterior.weighting.effective_size,
        posterior.sample.members,
        residual_compared(posterior, kind, posterior.fit.rmse[kind]),
    )  # fmt: skip


def residual_compared(posterior: Posterior, kind: str, rmse: float, best: bool = False) -> ResidualCompared:
    """Whether the errors of the measurements of a kind explain an RMSE.

    They do not if errors alone leave as much less than once in 1,000 times: rmse > error sqrt(chi2_n^-1(0.999) / n), n
    used stations of the kind. A refined posterior with stated errors adds its own p-value.
    """
    error, refined = measurement_error(posterior, kind), posterior.refinement
    stated = refined is not None and refined.error_model.errors == "stated"
    p = refined.misfit.p_misfit if refined is not None and stated else 1.0
    small = refined is not None and stated and is_too_small(refined.misfit.chi2, refined.misfit.freedom)
    count = max(int((posterior.station["used"] & (posterior.station["kind"] == kind)).sum()), 1)
    compared = "explained"
    if not np.isfinite(error):
        compared = "unknown"
    elif rmse > error * float(np.sqrt(scipy.special.chdtri(count, UNBELIEVED) / count)):
        compared = "exceeds"
    elif rmse > error and p < DOUBTED:
        compared = "exceeds" if p < UNBELIEVED else "hardly"
    elif rmse < error and small:
        compared = "far-less"
    return ResidualCompared(kind_of(kind), rmse, error, compared, best)


def key_parameters(run: Run) -> list[ParameterRow]:
    """The rows of its parameters, those of effects first: they are what was found."""
    added = parameters_of_effects(run.case)
    rows = [row for row in parameter_rows(run) if row.corrected is None]
    return sorted(rows, key=lambda row: row.parameter.name not in added)


def parameter_rows(run: Run) -> list[ParameterRow]:
    """One row for each parameter, and one for a phi corrected to another canopy height, which then is compared."""
    posterior, canopy = run.posterior, run.posterior.canopy
    corrected = canopy.parameter if canopy else ""
    rows = [parameter_row(run, name, compared=name != corrected) for name in posterior.parameters]
    if canopy is not None:
        low, high = (float(end) for end in canopy.quantiles[[0, -1]])
        power = (canopy.log10_median, canopy.log10_sd)
        rows.append(
            ParameterRow(
                parameter_of(posterior, canopy.parameter, symbols_of(run.case)), "", "", (low, high), canopy.median,
                canopy.sd, power, low, high, "", math.nan, (), False,
                **_compared(run, canopy.parameter, *power, as_power(posterior, canopy.parameter)),
                corrected=(canopy.from_height, canopy.to_height),
            )
        )  # fmt: skip
    return rows


def parameter_row(run: Run, name: str, compared: bool = True) -> ParameterRow:
    """A parameter's row; compared: whether values of others stand in it."""
    posterior, marginals, prior = run.posterior, run.posterior.marginals, run.case.parameters[name]
    bounded = prior.distribution in ("uniform", "loguniform")
    ends = marginals.bounds[name] if bounded else marginals.prior_quantiles[name][[0, -1]]
    powers = as_power(posterior, name)
    power = (marginals.log10_median[name], marginals.log10_sd[name]) if powers else None
    known = "identified" if marginals.identified[name] else "not-identified"
    centre = power or (marginals.median[name], marginals.sd[name])
    low, high = (float(end) for end in marginals.quantiles[name][[0, -1]])
    return ParameterRow(
        parameter_of(posterior, name, symbols_of(run.case)), prior.meaning, prior.distribution,
        (float(ends[0]), float(ends[1])), marginals.median[name], marginals.sd[name], power, low, high,
        known if posterior.claimed else "unknown", marginals.width_ratio[name], tuple(pressed_bounds(posterior, name)),
        off_its_prior(posterior, name), **(_compared(run, name, *centre, powers) if compared else {}),
    )  # fmt: skip


def as_power(posterior: Posterior, name: str) -> bool:
    """Whether a parameter is compared by its log10: it has one, and its prior spans more than a decade."""
    low, high = posterior.marginals.prior_quantiles[name][[0, -1]]
    return name in posterior.marginals.log10_median and bool(high > 10 * low)


def _compared(run: Run, name: str, centre: float, sd: float, powers: bool) -> dict[str, Any]:
    """Values of others, and how far off centre ± sd lies (log10 if powers)."""
    stated = study_value(run.case, run.posterior, name)
    known = (run.case.reference.made_with if run.case.reference else {}).get(name)
    found: dict[str, object] = {}
    if stated is not None:
        apart = float((centre - stated[0]) / np.hypot(sd, np.nan_to_num(stated[1])))
        found |= {"study": stated, "study_difference": apart}
    if known is not None:
        off = centre - (math.log10(known) if powers else known)
        in_study = off / stated[1] if stated is not None and np.isfinite(stated[1]) else math.nan
        found |= {"known": known, "known_difference": float(off / sd), "known_in_study": float(in_study)}
    return found


def study_value(case: Case, posterior: Posterior, name: str) -> tuple[float, float] | None:
    """Median and standard deviation of another study, NaN if it states none, as a power if ours is compared so.

    What it states in that form comes first; what it states in the other alone is converted, its standard deviation to
    first order, and rounded to two figures of it (three of the value itself without one), as stated values are.
    """
    table = case.reference.table if case.reference else {}
    forms = {
        power: stated if isinstance(stated, tuple) else (stated, math.nan)
        for power, stated in ((True, table.get(f"log10_{name}")), (False, table.get(name)))
        if stated is not None
    }
    wanted = as_power(posterior, name)
    if wanted in forms or not forms:
        return forms.get(wanted)
    value, sd = forms[not wanted]
    if wanted and value <= 0.0:
        return None
    slope = math.log(10.0) * (value if wanted else 10.0**value)
    value, sd = (math.log10(value), sd / slope) if wanted else (10.0**value, sd * slope)
    places = decimals(sd) if math.isfinite(sd) else decimals(value, 3)
    return round(value, places), round(sd, places)


def fit_rows(run: Run) -> list[FitRow]:
    """Sigma of each kind and the number of stations, which other studies state beside their parameters."""
    stated = run.case.reference.table if run.case.reference else {}
    study = {key: value for key, value in stated.items() if isinstance(value, float)}
    sigma = [
        FitRow(kind_of(name), value, study.get("sigma") if name == STREAMWISE else None)
        for name, value in run.posterior.fit.sigma.items()
    ]
    return [*sigma, FitRow(None, run.posterior.fit.used, study.get("n"))]


def plant_parameter(case: Case) -> str | None:
    """The parameter that is phi of a stand growing in a patch, if there is one."""
    stands = [case.plants.stands[patch.stand] for patch in case.plants.patches]
    return next((stand.phi for stand in stands if isinstance(stand.phi, str)), None)
