"""The tables of the page: parameters with reference values, stations, health of the run, how it was made."""

import html
import math
import platform
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Case
from vegglue.flow.status import FAILED, RUN_BY_COMMAND, STATUS_WORDS, members_with
from vegglue.inference.weighted_statistics import TRUSTED_K_HAT
from vegglue.measurements.kinds import STREAMWISE, kind_of
from vegglue.pages.key_numbers import as_power, estimate, largest_mass_error, study_value, symbol
from vegglue.pages.posterior_words import identification
from vegglue.pages.prior_words import off_its_prior, pressed_bounds
from vegglue.pages.run import Run, station_zones
from vegglue.pages.typography import NARROW, as_given, fixed, percent, plus_minus, short
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import CorrectedCanopy
from vegglue.wording.numbers import duration_in_short, so_many, telling_digits

# Answers of the column "Identified"; that there are too few members to tell is said in full.
YES_NO = {"identified": "yes", "not identified": "no"}
# Decimals of what was measured: 1 mm/s and 1 mm, or as many as a better instrument tells.
FEWEST_DECIMALS, MOST_DECIMALS = 3, 5


@dataclass(frozen=True)
class ReferenceComparison:
    """Values of others for one parameter, and how far ours differs from them (HTML).

    study: of another study. made_with: of a synthetic record. Differences: ours minus theirs in standard
    deviations. – where there is no such value.
    """

    study: str = "–"
    study_difference: str = "–"
    made_with: str = "–"
    made_with_difference: str = "–"


@dataclass(frozen=True)
class ParameterRow:
    """One line of the table of parameters (HTML)."""

    symbol: str
    meaning: str
    prior: str
    posterior: str
    range95: str
    identified: str
    reference: ReferenceComparison


@dataclass(frozen=True)
class FitRow:
    """A line below the parameters in their table: the residual sigma of a kind, or the number of stations (text)."""

    symbol: str
    meaning: str
    value: str
    unit: str
    study: str


@dataclass(frozen=True)
class StationRow:
    """One line of the table of stations (text)."""

    experiment: str
    section: str
    kind: str
    x: str
    y: str
    zone: str
    measured: str
    modelled: str
    residual: str
    score: str
    reason: str


def parameter_rows(run: Run) -> list[ParameterRow]:
    """One row for each parameter, and one for a phi corrected to another canopy height, which then is compared."""
    posterior, canopy = run.posterior, run.posterior.canopy
    rows = []
    for name in posterior.parameters:
        logarithmic = as_power(posterior, name)
        centre = posterior.marginals.log10_median[name] if logarithmic else posterior.marginals.median[name]
        sd = posterior.marginals.log10_sd[name] if logarithmic else posterior.marginals.sd[name]
        comparison = ReferenceComparison() if canopy and canopy.parameter == name else _compared(run, name, centre, sd)
        rows.append(_parameter_row(run, name, comparison))
    if canopy is not None:
        comparison = _compared(run, canopy.parameter, canopy.log10_median, canopy.log10_sd)
        rows.append(_corrected_row(run.case, canopy, comparison))
    return rows


def _parameter_row(run: Run, name: str, comparison: ReferenceComparison) -> ParameterRow:
    posterior = run.posterior
    low, high = posterior.marginals.quantiles[name][[0, -1]]
    bound = " and ".join(pressed_bounds(posterior, name))
    answer = identification(posterior, name)
    identified = f"{YES_NO.get(answer, answer)}, {percent(posterior.marginals.width_ratio[name])}"
    return ParameterRow(
        symbol(run.case, name),
        html.escape(run.case.parameters[name].meaning),
        _prior(run, name),
        estimate(posterior, name),
        _range(low, high),
        identified
        + (f", at {bound} bound" if bound else "")
        + (", outside its prior’s 95 %" if off_its_prior(posterior, name) else ""),
        comparison,
    )


def _corrected_row(case: Case, canopy: CorrectedCanopy, comparison: ReferenceComparison) -> ParameterRow:
    low, high = canopy.quantiles[[0, -1]]
    return ParameterRow(
        symbol(case, canopy.parameter),
        f"corrected from a canopy of {canopy.from_height:g} m to one of {canopy.to_height:g} m",
        "",
        f"10<sup>{plus_minus(canopy.log10_median, canopy.log10_sd)}</sup>",
        _range(low, high),
        "",
        comparison,
    )


def _prior(run: Run, name: str) -> str:
    prior, (low, high) = run.case.parameters[name], run.posterior.marginals.bounds[name]
    words = {"uniform": "uniform", "loguniform": "log-uniform", "normal": "normal", "lognormal": "log-normal"}
    if prior.distribution in ("uniform", "loguniform"):
        return f"{words[prior.distribution]}, {as_given(low)} to {as_given(high)}"
    low, high = run.posterior.marginals.prior_quantiles[name][[0, -1]]
    return f"{words[prior.distribution]}, 95{NARROW}% in {_range(low, high)}"


def _range(low: float, high: float) -> str:
    digits = telling_digits(low, high)
    return f"{short(low, digits)} to {short(high, digits)}"


def _compared(run: Run, name: str, centre: float, sd: float) -> ReferenceComparison:
    """What others have for a parameter, and how far off `centre` ± `sd` lies (log10 where it is looked at so).

    From another study in the standard deviations of both together; from known values in our own and in the study's.
    """
    logarithmic = as_power(run.posterior, name)
    stated = study_value(run.case, run.posterior, name)
    known = (run.case.reference.made_with if run.case.reference else {}).get(name)
    study = study_difference = made_with = made_with_difference = "–"
    if stated is not None:
        study = f"10<sup>{as_given(*stated)}</sup>" if logarithmic else as_given(*stated)
        study_difference = f"{fixed((centre - stated[0]) / np.hypot(sd, np.nan_to_num(stated[1])), 1)} sd"
    if known is not None:
        off = centre - (np.log10(known) if logarithmic else known)
        made_with, made_with_difference = as_given(known), f"{fixed(off / sd, 1)} sd"
        if stated is not None and np.isfinite(stated[1]):
            made_with_difference += f" ({fixed(off / stated[1], 1)} of the study’s)"
    return ReferenceComparison(study, study_difference, made_with, made_with_difference)


def fit_rows(run: Run) -> list[FitRow]:
    """Sigma of each kind and the number of stations, which other studies state beside their parameters."""
    stated = run.case.reference.table if run.case.reference else {}
    study = {key: as_given(value) for key, value in stated.items() if isinstance(value, float)}
    rows = [
        FitRow(
            "σ",
            f"residual, {kind.words}",
            short(value, 2),
            kind.unit,
            study.get("sigma", "–") if kind.name == STREAMWISE else "–",
        )
        for kind, value in ((kind_of(name), value) for name, value in run.posterior.fit.sigma.items())
    ]
    return [*rows, FitRow("n", "stations used", str(run.posterior.fit.used), "", study.get("n", "–"))]


def station_rows(run: Run) -> list[StationRow]:
    """All stations, used or not, in the order of the table of observations."""
    table = run.observations.table.assign(zone=station_zones(run))
    return [_station_row(run, index, row) for index, (_, row) in enumerate(table.iterrows())]


def _station_row(run: Run, index: int, row: pd.Series) -> StationRow:
    posterior = run.posterior
    low, middle, high = posterior.predicted.model_band[[0, 2, -1], index]
    kind, places = kind_of(row["kind"]), _places_of(float(row["standard_error"]))
    measured = f"{fixed(row['value'], places)} ± {fixed(row['standard_error'], places)}"
    return StationRow(
        str(row["experiment"]),
        str(row["section"]) or "–",
        kind.words,
        fixed(row["x"], 2),
        fixed(row["y"], 2),
        str(row["zone"]),
        f"{measured}{NARROW}{kind.unit.replace('3', '³')}",
        f"{fixed(middle, places)} ({fixed(low, places)} to {fixed(high, places)})",
        fixed(posterior.fit.residual[index], places),
        fixed(posterior.fit.residual[index] / posterior.fit.noise[index], 1),
        str(row["reason"]),
    )


def _places_of(error: float) -> int:
    """Decimals that show two figures of an error, within these bounds; the fewest where it is unknown."""
    if not error > 0.0:
        return FEWEST_DECIMALS
    return min(max(FEWEST_DECIMALS, 1 - math.floor(math.log10(error))), MOST_DECIMALS)


def member_counts(ensemble: Ensemble) -> list[tuple[str, int, str]]:
    """For each status of a member: its words, how many members have it, and their share as text."""
    ways = {RUN_BY_COMMAND, FAILED} if ensemble.by_command else STATUS_WORDS.keys() - {RUN_BY_COMMAND}
    counts = [(word, members_with(ensemble.status, way)) for way, word in STATUS_WORDS.items() if way in ways]
    return [(word, number, percent(number / len(ensemble.status))) for word, number in counts]


def health_in_words(run: Run) -> str:
    """How many members there are, or draws without an ensemble, and how many failed (text)."""
    if run.ensemble is None:
        sample = run.posterior.sample
        return f"{so_many(sample.members, 'draw')}, {sample.failed or 'none'} of them failed"
    failed = members_with(run.ensemble.status, FAILED)
    return f"{so_many(len(run.ensemble.status), 'member')}, {failed or 'none'} of them failed"


def failure_reasons(ensemble: Ensemble) -> list[tuple[str, int]]:
    """The reasons of failed members with their counts, the most frequent first."""
    reasons = pd.Series(ensemble.reason[ensemble.status == FAILED].astype(str))
    return [(str(reason), int(number)) for reason, number in reasons.value_counts().items()]


def health_facts(run: Run) -> Iterator[tuple[str, str]]:
    """Mass errors, weights and iterations, by which the numbers are trusted or not: a name and a value each."""
    posterior = run.posterior
    if run.ensemble is not None and not run.ensemble.by_command:
        yield "largest mass error of a member", short(largest_mass_error(run.ensemble), 2)
    yield "effective members", f"{posterior.weighting.effective_size:,.0f} of {posterior.sample.members:,}"
    yield "largest weight", percent(posterior.weighting.largest_weight)
    yield "tail of the weights, k̂", f"{fixed(posterior.weighting.pareto_k, 2)} (to be trusted below {TRUSTED_K_HAT})"
    if run.ensemble is not None:
        yield from _work_done(run.ensemble)
    for name in posterior.parameters:
        low, high = posterior.marginals.bound_mass[name]
        if np.isnan([low, high]).all():  # its prior has no bounds
            continue
        yield f"weight of {name} near its lower and upper bound", f"{percent(low)} and {percent(high)}"


def _work_done(ensemble: Ensemble) -> Iterator[tuple[str, str]]:
    """Iterations and time of its members."""
    if not ensemble.by_command:
        of_solved = ensemble.iterations[ensemble.status != FAILED]
        yield "iterations of a solved member", f"{np.median(of_solved):.0f} (most {ensemble.iterations.max()})"
    seconds = ensemble.seconds[np.isfinite(ensemble.seconds)]
    yield (
        "time of the runs" if ensemble.by_command else "time of all processes together",
        f"{duration_in_short(float(seconds.sum()))}, {short(float(np.median(seconds)), 2)} s a member",
    )


def provenance(run: Run) -> Iterator[tuple[str, str]]:
    """What the run was made of: config, data, versions, grid and choices of the model; a name and a value each."""
    numerics, infer = run.case.numerics, run.case.infer
    yield "config", run.case.source.name
    yield "hash of config and data", case_hash(run.case)[:16]
    yield "seed", str(run.posterior.settings.seed)
    yield "vegglue", run.posterior.settings.version
    yield "Python", platform.python_version()
    yield (
        "grid",
        f"{len(run.site.grid.x)} × {len(run.site.grid.y)} cells of {run.site.grid.dx:g} m × {run.site.grid.dy:g} m",
    )
    yield (
        "likelihood",
        f"{infer.likelihood}, sigma {infer.sigma}, {run.posterior.settings.method}"
        + (f", members with an efficiency of at least {infer.behavioural:g}" if infer.behavioural is not None else ""),
    )
    yield "plants taller than the water is deep", "φ as it is" if numerics.emergent == "constant" else "φ h / h_d"
    yield "shear acts over", "its point's depth" if numerics.shear_depth is None else "the smallest depth around it"
    yield "least 12 h / k_s in the bank law", f"{numerics.bank_argument_minimum:g}"
