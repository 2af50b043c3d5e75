"""What a posterior states, as values: `wording/templates/posterior.j2` renders each of them in one sentence."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from vegglue.inference.glue import sizes_as_stated
from vegglue.inference.homogeneity import DIFFERS_BELOW, differing
from vegglue.inference.refine import groups_left_out
from vegglue.inference.weighted_statistics import TRUSTED_K_HAT, root_mean_square
from vegglue.measurements.kinds import Kind, Unused, kind_of
from vegglue.results.posterior import CLAIMED_FROM, IDENTIFIED_BELOW, NEAR_BOUND, Posterior, Transfer
from vegglue.results.verdict import MisfitTooSmall, is_too_small

# |r| [-] above which a pair is named: the other parameter then explains half the variance of each (r² = 0.49).
STRONG_CORRELATION = 0.7
# p-values [-]: below the first, the customary 1 in 20, a fit is doubted; below the second something is missing, which a
# run should not report by chance.
DOUBTED, UNBELIEVED = 0.05, 0.001
# Outlying stations named one by one, at most: more are no single errors.
OUTLIERS_NAMED = 5
# p-value [-] of one parameter by itself below which one value for all is doubted: the customary 1 in 20.
DOUBTED_BELOW = 0.05
# Key of a reference table, before the name of a parameter: the chi2 of homogeneity that its source found.
REFERENCE_CHI2 = "chi2_"

Sizes = tuple[tuple[Kind, float], ...]  # one error for each kind of measurement [unit of the kind]


@dataclass(frozen=True)
class NamedParameter:
    """A parameter by its name, its symbol and its unit."""

    name: str
    symbol: str
    unit: str


@dataclass(frozen=True)
class EnsembleWeighed:
    """Members of an ensemble as a likelihood has weighted them.

    Attributes
    ----------
    used, stations : int
        Number of used stations, and of all.
    sizes : tuple of (Kind, float)
        Error of each kind of measurement [unit of the kind].
    best_member : bool
        Whether that is the RMSE of the best member; else it is known.
    threshold : float
        Smallest efficiency of a member with weight [-], -inf if there is none.
    weighed : int
        Number of members with weight.
    """

    members: int
    failed: int
    likelihood: str
    used: int
    stations: int
    sizes: Sizes
    best_member: bool
    threshold: float
    weighed: int


@dataclass(frozen=True)
class SearchSummary:
    """Where a search began, at members or in the prior, the modes that it found, and the members drawn from these."""

    starts: int
    from_prior: bool
    modes: int
    members: int
    failed: int


@dataclass(frozen=True)
class SurrogateLearned:
    """Runs of a command that a posterior rests on; see `results.posterior.Surrogate`."""

    runs: int
    failed: int
    settled: bool
    median_error: float
    sd_error: float
    last_error: float


@dataclass(frozen=True)
class ValidationProposed:
    """Discharges beyond those of the case at which measurements would test its model [m3/s]."""

    low: float
    high: float


@dataclass(frozen=True)
class ModeFound:
    """A mode: values in the units of the parameters, its chi2 [-] and its share of the posterior [-]."""

    number: int
    values: tuple[tuple[NamedParameter, float], ...]
    chi2: float
    weight: float


@dataclass(frozen=True)
class ErrorsEstimated:
    """Standard errors estimated from the residuals; as_stated: kinds with too few readings for that."""

    sizes: Sizes
    as_stated: tuple[Kind, ...]


@dataclass(frozen=True)
class ErrorsStated:
    """Standard errors as stated, and what the covariance makes of them.

    Attributes
    ----------
    stated, sizes : tuple of (Kind, float)
        Before and after [unit of the kind].
    grid_error : float
        [m/s], NaN if the cells cannot be doubled.
    """

    stated: Sizes
    grid_error: float
    sizes: Sizes


@dataclass(frozen=True)
class ErrorsScaled:
    """Errors over the stated ones [-]."""

    scale: float


@dataclass(frozen=True)
class ErrorsCorrelated:
    """Correlation of the errors of neighbours [-]."""

    correlation: float


@dataclass(frozen=True)
class WeightSummary:
    """Effective number of members, the largest weight [-], and Pareto k with the largest that is trusted [-]."""

    effective_size: float
    members: int
    largest: float
    pareto_k: float
    limit: float = TRUSTED_K_HAT


@dataclass(frozen=True)
class NoPosteriorClaimed:
    """An effective number of members below the one needed."""

    effective_size: float
    refined: bool
    needed: int = CLAIMED_FROM


@dataclass(frozen=True)
class WeightTailHeavy:
    """Pareto k beyond the largest that is trusted [-]."""

    pareto_k: float
    limit: float = TRUSTED_K_HAT


@dataclass(frozen=True)
class ParameterEstimated:
    """A parameter that is narrower than its prior.

    Attributes
    ----------
    median, sd, low, high : float
        Median, standard deviation and 95 % interval [its unit].
    share : float
        Width over that of the prior [-].
    power : (float, float) or None
        Median and standard deviation of its log10, None of a parameter that has none.
    """

    parameter: NamedParameter
    median: float
    sd: float
    low: float
    high: float
    share: float
    power: tuple[float, float] | None


@dataclass(frozen=True)
class ParameterNotIdentified:
    """95 % interval [its unit], its width over that of the prior, and from which share on nothing is known [-]."""

    parameter: NamedParameter
    low: float
    high: float
    share: float
    limit: float = IDENTIFIED_BELOW


@dataclass(frozen=True)
class ParameterAtBound:
    """A bound [its unit] with the share of the posterior within `near` of the range from it [-]."""

    parameter: NamedParameter
    side: str
    bound: float
    mass: float
    near: float = NEAR_BOUND


@dataclass(frozen=True)
class ParameterOffPrior:
    """95 % interval of the prior that the median lies outside [its unit]."""

    parameter: NamedParameter
    low: float
    high: float


@dataclass(frozen=True)
class ParametersAtBounds:
    """All parameters that end at bounds of their priors, with the sides, in one short sentence."""

    parameters: tuple[tuple[NamedParameter, tuple[str, ...]], ...]


@dataclass(frozen=True)
class ParametersCorrelated:
    """Two parameters and their correlation [-]."""

    first: NamedParameter
    second: NamedParameter
    correlation: float


@dataclass(frozen=True)
class MedianFit:
    """Root mean square misfit of the median by kind, and how many of the used stations lie outside the total band."""

    sizes: Sizes
    outside: int
    used: int


@dataclass(frozen=True)
class ReadingsExcluded:
    """How many readings a diagnosis excluded, of all stations."""

    excluded: int
    stations: int


@dataclass(frozen=True)
class BestMemberFit:
    """chi2 of the best member at the used stations [-]."""

    chi2: float
    used: int


@dataclass(frozen=True)
class MisfitTested:
    """chi2 of a refined posterior.

    Attributes
    ----------
    chi2 : float
        [-]
    p : float
        P(chi2_f >= chi2) [-].
    outcome : {"untested", "unexplained", "hardly-explained", "too-small", "explained"}
    """

    chi2: float
    freedom: int
    p: float
    outcome: str


@dataclass(frozen=True)
class StationsLeftOut:
    """ln density of stations that are left out in turn, with its standard error [-]; doubtful: those of k > limit."""

    elpd: float
    error: float
    used: int
    doubtful: int
    limit: float = TRUSTED_K_HAT


@dataclass(frozen=True)
class GroupsLeftOutScore:
    """Sections and experiments left out in turn.

    Attributes
    ----------
    groups : int
        How many.
    worst : str
        The one with the lowest score.
    score, median : float
        Its score, and the median of all: mean ln density of a station in its errors [-].
    """

    groups: int
    worst: str
    score: float
    median: float


@dataclass(frozen=True)
class GroupsUntrusted:
    """Sections and experiments whose k is beyond the largest that is trusted."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class BandCoverage:
    """Shares of the stations within the 50 and the 95 % band, and P that they are as even as bands should be [-]."""

    inside50: float
    inside95: float
    p: float
    even: bool


@dataclass(frozen=True)
class StationsStandOut:
    """Stations whose residual is no chance.

    Attributes
    ----------
    experiment, section : str
        Of the one that stands out most.
    x, y : float
        [m]
    errors : float
        Its residual [standard errors].
    """

    count: int
    experiment: str
    section: str
    x: float
    y: float
    errors: float


@dataclass(frozen=True)
class NothingToCompare:
    """No parameter is constrained by two experiments."""


@dataclass(frozen=True)
class ParameterBetweenExperiments:
    """Values of one parameter from each experiment alone.

    Attributes
    ----------
    logarithmic : bool
        Whether values are log10 of the parameter.
    values : tuple of (str, float, float)
        Experiment, value and standard error.
    chi2 : float
        About the weighted mean [-].
    p : float
        [-]
    reference : float or None
        chi2 of the source, None without [-].
    outcome : {"one-value", "hardly-one-value", "differs"}
    """

    parameter: NamedParameter
    logarithmic: bool
    values: tuple[tuple[str, float, float], ...]
    chi2: float
    freedom: int
    p: float
    reference: float | None
    outcome: str


@dataclass(frozen=True)
class ParametersAlike:
    """Parameters of which one value fits all experiments, with the P of the worst [-]."""

    parameters: tuple[NamedParameter, ...]
    p: float


@dataclass(frozen=True)
class MisfitOfExperiments:
    """Misfit with one value of each parameter for all experiments, and with values of their own.

    Attributes
    ----------
    experiments : tuple of (str, float, float, int)
        Experiment, chi2 together and alone (NaN: not found) [-], and number of stations.
    scale : float
        Of the standard errors [-].
    gain : float
        Fall of chi2 with values of their own [-].
    more : int
        Parameters more.
    p : float
        That errors alone gain as much [-].
    """

    experiments: tuple[tuple[str, float, float, int], ...]
    scale: float
    gain: float
    more: int
    p: float


@dataclass(frozen=True)
class ErrorsOfComparison:
    """Whether errors are estimated, and by what they are scaled [-]."""

    estimated: bool
    scale: float


@dataclass(frozen=True)
class CalibrationTransfers:
    """One set of parameters fits all experiments."""


@dataclass(frozen=True)
class CalibrationDiffers:
    """parameters: those that have to move, none if only all together do."""

    parameters: tuple[NamedParameter, ...]
    scale: float


@dataclass(frozen=True)
class CanopyCorrected:
    """Plant drag at another canopy height: heights and depth [m], median before and after [-], log10 of the latter."""

    parameter: NamedParameter
    from_height: float
    to_height: float
    depth: float
    before: float
    median: float
    power: tuple[float, float]


# Statements that limit how far a posterior may be used.
LIMITS = (
    NoPosteriorClaimed, WeightTailHeavy, ParameterNotIdentified, ParameterAtBound, ParameterOffPrior, ErrorsEstimated,
    GroupsUntrusted, StationsStandOut, CalibrationDiffers, MisfitTooSmall,
)  # fmt: skip


def limits_use(statement: object) -> bool:
    """Whether a statement limits how far the posterior may be used."""
    if isinstance(statement, MisfitTested):
        return statement.outcome in ("unexplained", "too-small")
    return isinstance(statement, LIMITS)


def posterior_statements(
    posterior: Posterior, others: Mapping[str, object] | None = None, symbols: Mapping[str, str] | None = None
) -> list[object]:
    """All that a posterior states.

    Parameters
    ----------
    others : mapping, optional
        The reference table of the case, by key.
    symbols : mapping of str, optional
        Of parameters, by name.

    Returns
    -------
    list
        In this order: members, weights, each parameter, correlations, the fit, stations left out, whether the
        experiments agree, the corrected canopy, and at which discharge measurements would test a surrogate.
    """
    return [
        *sample_statements(posterior, symbols),
        *weight_statements(posterior),
        *(one for name in posterior.parameters for one in parameter_statements(posterior, name, symbols)),
        *correlations(posterior, symbols),
        *fit_statements(posterior),
        *validation_statements(posterior),
        *transfer_statements(posterior, others or {}, symbols),
        *canopy_statements(posterior, symbols),
        *surrogate_statements(posterior)[1:],
    ]


def parameter_of(posterior: Posterior, name: str, symbols: Mapping[str, str] | None) -> NamedParameter:
    """A parameter with its symbol and unit."""
    return NamedParameter(name, (symbols or {}).get(name, name), posterior.sample.unit[name])


def _sizes_of(errors: Mapping[str, float]) -> Sizes:
    """Errors by kind of measurement."""
    return tuple((kind_of(name), float(value)) for name, value in errors.items())


def measurement_error(posterior: Posterior, kind: str) -> float:
    """s = sqrt(mean s_i^2) of the standard errors of the used stations of a kind.

    Returns
    -------
    float
        [unit of the kind]; NaN if one is unknown.
    """
    station = posterior.station
    error = station.loc[station["used"] & (station["kind"] == kind), "standard_error"].to_numpy(float)
    return root_mean_square(error)


def sample_statements(posterior: Posterior, symbols: Mapping[str, str] | None = None) -> Iterator[object]:
    """How the members were made and weighted, and under which errors.

    Parameters
    ----------
    symbols : mapping of str, optional
        Of parameters, by name.

    Yields
    ------
    EnsembleWeighed
        Alone, without a refinement.
    SearchSummary, SurrogateLearned, ModeFound, ErrorsEstimated, ErrorsStated, ErrorsScaled, ErrorsCorrelated
        With one; modes if there is more than one.
    """
    settings, sample, refined = posterior.settings, posterior.sample, posterior.refinement
    sizes = _sizes_of(posterior.fit.sigma)
    if refined is None:
        yield EnsembleWeighed(
            sample.members, sample.failed, settings.likelihood, posterior.fit.used, len(posterior.station), sizes,
            settings.sigma_rule == "best-member", settings.threshold, posterior.weighting.weighed,
        )  # fmt: skip
        return
    modes, model = refined.modes, refined.error_model
    count = modes.mode_chi2.size
    yield SearchSummary(modes.starts, not settings.ensemble_hash, count, sample.members, sample.failed)
    yield from surrogate_statements(posterior)[:1]
    for number, (theta, chi2, weight) in enumerate(
        zip(modes.mode_theta, modes.mode_chi2, modes.mode_weight, strict=True), 1
    ):
        if count > 1:
            values = zip(posterior.parameters, theta, strict=True)
            each = tuple((parameter_of(posterior, name, symbols), float(value)) for name, value in values)
            yield ModeFound(number, each, float(chi2), float(weight))
    if model.errors == "estimated":
        yield ErrorsEstimated(sizes, tuple(kind_of(name) for name in sizes_as_stated(posterior.station)))
    else:
        stated = {kind: measurement_error(posterior, kind) for kind in posterior.fit.sigma}
        yield ErrorsStated(_sizes_of(stated), model.grid_error, sizes)
        if model.scale > 1.0:
            yield ErrorsScaled(model.scale)
    if model.correlation != 0.0:
        yield ErrorsCorrelated(model.correlation)


def surrogate_statements(posterior: Posterior) -> list[object]:
    """What a surrogate rests on, and at which discharge measurements would test it; none without one."""
    one = posterior.surrogate
    if one is None:
        return []
    learned = SurrogateLearned(one.runs, one.failed, bool(one.settled), one.median_error, one.sd_error, one.last_error)
    known = math.isnan(one.validation_low)
    return [learned] if known else [learned, ValidationProposed(one.validation_low, one.validation_high)]


def weight_statements(posterior: Posterior) -> Iterator[object]:
    """What the weights are worth, and whether that is too little for a posterior."""
    weights = posterior.weighting
    yield WeightSummary(weights.effective_size, posterior.sample.members, weights.largest_weight, weights.pareto_k)
    if not posterior.claimed:
        yield NoPosteriorClaimed(weights.effective_size, posterior.refinement is not None)
    if weights.pareto_k > TRUSTED_K_HAT:
        yield WeightTailHeavy(weights.pareto_k)


def pressed_bounds(posterior: Posterior, name: str) -> list[str]:
    """The bounds of its prior that a parameter presses against: 'lower', 'upper', both or none."""
    hit = posterior.marginals.bound_hit[name]
    return [side for side, pressed in zip(("lower", "upper"), hit, strict=True) if pressed]


def parameters_at_bounds(posterior: Posterior, symbols: Mapping[str, str] | None = None) -> ParametersAtBounds | None:
    """All parameters that end at bounds of their priors; None if none does."""
    at = {name: tuple(pressed_bounds(posterior, name)) for name in posterior.parameters}
    found = tuple((parameter_of(posterior, name, symbols), sides) for name, sides in at.items() if sides)
    return ParametersAtBounds(found) if found else None


def off_its_prior(posterior: Posterior, name: str) -> bool:
    """Whether the median of a parameter lies outside the 95 % range of its prior, and against no bound.

    Parameters
    ----------
    name : str
        Of the parameter.

    Returns
    -------
    bool
        False if there are too few effective members for a posterior.
    """
    low, high = posterior.marginals.prior_quantiles[name][[0, -1]]
    inside = low <= posterior.marginals.median[name] <= high
    return posterior.claimed and not inside and not pressed_bounds(posterior, name)


def parameter_statements(posterior: Posterior, name: str, symbols: Mapping[str, str] | None = None) -> Iterator[object]:
    """What is known of a parameter, the bounds it presses against, and whether it lies off its prior.

    Parameters
    ----------
    symbols : mapping of str, optional
        Of parameters, by name.

    Yields
    ------
    ParameterEstimated or ParameterNotIdentified
    ParameterAtBound
        Of each such bound.
    ParameterOffPrior
    """
    marginals, parameter = posterior.marginals, parameter_of(posterior, name, symbols)
    low, high = (float(value) for value in marginals.quantiles[name][[0, -1]])
    share = marginals.width_ratio[name]
    if marginals.identified[name]:
        logarithmic = name in marginals.log10_median
        power = (marginals.log10_median[name], marginals.log10_sd[name]) if logarithmic else None
        yield ParameterEstimated(parameter, marginals.median[name], marginals.sd[name], low, high, share, power)
    else:
        yield ParameterNotIdentified(parameter, low, high, share)
    for side in pressed_bounds(posterior, name):
        end = ("lower", "upper").index(side)
        bound, mass = marginals.bounds[name][end], marginals.bound_mass[name][end]
        yield ParameterAtBound(parameter, side, float(bound), float(mass))
    if off_its_prior(posterior, name):
        yield ParameterOffPrior(parameter, *(float(end) for end in marginals.prior_quantiles[name][[0, -1]]))


def correlations(posterior: Posterior, symbols: Mapping[str, str] | None = None) -> Iterator[ParametersCorrelated]:
    """Pairs of parameters with |r| > STRONG_CORRELATION.

    Parameters
    ----------
    symbols : mapping of str, optional
        Of parameters, by name.

    Yields
    ------
    ParametersCorrelated
        None if there are too few effective members: any two parameters of few members are correlated perfectly.
    """
    if not posterior.claimed:
        return
    matrix = np.nan_to_num(posterior.marginals.correlation)
    names = [parameter_of(posterior, name, symbols) for name in posterior.parameters]
    for i, j in combinations(range(len(names)), 2):
        if abs(matrix[i, j]) > STRONG_CORRELATION:
            yield ParametersCorrelated(names[i], names[j], float(matrix[i, j]))


def fit_statements(posterior: Posterior) -> Iterator[object]:
    """Misfit of the median prediction and stations outside the total band; chi2 of weighted members of known errors."""
    fit, station = posterior.fit, posterior.station
    value, band = station["value"].to_numpy(float), posterior.predicted.total_band
    outside = ((value < band[0]) | (value > band[-1])) & station["used"].to_numpy()
    yield MedianFit(_sizes_of(fit.rmse), int(outside.sum()), fit.used)
    if excluded := int((station["reason"] == Unused.EXCLUDED).sum()):
        yield ReadingsExcluded(excluded, len(station))
    if math.isfinite(fit.chi2) and posterior.refinement is None:
        yield BestMemberFit(fit.chi2, fit.used)
        freedom = fit.used - len(posterior.parameters)
        if is_too_small(fit.chi2, freedom):
            yield MisfitTooSmall(fit.chi2, freedom)


def misfit_tested(posterior: Posterior) -> MisfitTested | None:
    """P(chi2_f >= chi2) below UNBELIEVED: unexplained, below DOUBTED: hardly explained; too close to 1: too small.

    Returns
    -------
    MisfitTested or None
        None without a refinement, or if errors are estimated from the misfit itself.
    """
    refined = posterior.refinement
    if refined is None or refined.error_model.errors == "estimated":
        return None
    misfit = refined.misfit
    outcome = "explained"
    if misfit.freedom < 1:
        outcome = "untested"
    elif misfit.p_misfit < UNBELIEVED:
        outcome = "unexplained"
    elif is_too_small(misfit.chi2, misfit.freedom):
        outcome = "too-small"
    elif misfit.p_misfit < DOUBTED:
        outcome = "hardly-explained"
    return MisfitTested(misfit.chi2, misfit.freedom, misfit.p_misfit, outcome)


def validation_statements(posterior: Posterior) -> Iterator[object]:
    """Of a refined posterior: chi2, what is predicted of stations left out, bands, stations that stand out."""
    refined = posterior.refinement
    if refined is None:
        return
    if tested := misfit_tested(posterior):
        yield tested
    alone, groups = refined.leave_one_out, refined.groups
    yield StationsLeftOut(alone.elpd, alone.elpd_error, posterior.fit.used, int(np.sum(alone.score_k > TRUSTED_K_HAT)))
    if groups.left_out.size:
        # (ln p(y) + sum_i ln s_i) / n of each group of n stations: the density of y_i / s_i, s_i the errors. That of
        # y_i itself is the higher the smaller its unit, so that velocities would come last beside levels.
        used = posterior.station["used"].to_numpy()
        size, rows = np.log(posterior.fit.noise[used]), groups_left_out(posterior.station[used])
        sizes = [size[rows[name]].mean() if name in rows else size.mean() for name in groups.left_out]
        each = np.asarray(groups.left_out_score / groups.left_out_stations + sizes)
        worst = int(np.argmin(each))
        yield GroupsLeftOutScore(
            groups.left_out.size, str(groups.left_out[worst]), float(each[worst]), float(np.median(each))
        )
    untrusted = [str(name) for name, k in zip(groups.left_out, groups.left_out_k, strict=True) if k > TRUSTED_K_HAT]
    if untrusted:
        yield GroupsUntrusted(tuple(untrusted))
    yield BandCoverage(alone.inside50, alone.inside95, alone.p_calibration, not alone.p_calibration < DOUBTED)
    yield from stations_standing_out(posterior)


def stations_standing_out(posterior: Posterior) -> Iterator[StationsStandOut]:
    """Stations whose residual is no chance: each, or of more than OUTLIERS_NAMED their number and the worst.

    Yields
    ------
    StationsStandOut
        None without a refinement.
    """
    if posterior.refinement is None:
        return
    misfit = posterior.refinement.misfit
    rows = np.flatnonzero(misfit.outlier).tolist()
    if len(rows) > OUTLIERS_NAMED:
        count, rows = len(rows), [misfit.worst_outlier]
    else:
        count = 1
    for row in rows:
        station = posterior.station.iloc[row]
        yield StationsStandOut(
            count, str(station["experiment"]), str(station["section"]), float(station["x"]), float(station["y"]),
            float(misfit.surprise[row]),
        )  # fmt: skip


def transfer_statements(
    posterior: Posterior, others: Mapping[str, object], symbols: Mapping[str, str] | None = None
) -> Iterator[object]:
    """Whether one value of each parameter fits all experiments.

    Parameters
    ----------
    others : mapping
        The reference table of the case, by key.
    symbols : mapping of str, optional
        Of parameters, by name.

    Yields
    ------
    ParameterBetweenExperiments
        That of the largest chi2 first.
    ParametersAlike
        The others.
    MisfitOfExperiments, ErrorsOfComparison
    CalibrationTransfers or CalibrationDiffers
    """
    transfer = posterior.transfer
    if transfer is None:
        return
    order = [int(j) for j in np.argsort(-np.nan_to_num(transfer.chi2)) if transfer.freedom[j] > 0]
    if not order:
        yield NothingToCompare()
        return
    moves = differing(dict(zip(posterior.parameters, transfer.p, strict=True)))
    named = [parameter_of(posterior, name, symbols) for name in posterior.parameters]
    alike = [j for j in order[1:] if transfer.p[j] >= DOUBTED_BELOW and REFERENCE_CHI2 + named[j].name not in others]
    for j in (one for one in order if one not in alike):
        each = zip(transfer.experiments, transfer.value[:, j], transfer.error[:, j], strict=True)
        other = others.get(REFERENCE_CHI2 + named[j].name)
        doubted = "hardly-one-value" if transfer.p[j] < DOUBTED_BELOW else "one-value"
        yield ParameterBetweenExperiments(
            named[j], named[j].name in posterior.marginals.log10_median,
            tuple((str(name), float(value), float(error)) for name, value, error in each if np.isfinite(value)),
            float(transfer.chi2[j]), int(transfer.freedom[j]), float(transfer.p[j]),
            float(other) if isinstance(other, int | float) else None, "differs" if named[j].name in moves else doubted,
        )  # fmt: skip
    if alike:
        yield ParametersAlike(tuple(named[j] for j in alike), float(min(transfer.p[j] for j in alike)))
    misfits = zip(transfer.experiments, transfer.misfit_together, transfer.misfit_alone, transfer.stations, strict=True)
    yield MisfitOfExperiments(
        tuple((str(name), float(both), float(alone), int(count)) for name, both, alone, count in misfits),
        transfer.scale, transfer.gain, transfer.more, transfer.p_all,
    )  # fmt: skip
    estimated = posterior.refinement is not None and posterior.refinement.error_model.errors == "estimated"
    yield ErrorsOfComparison(estimated, transfer.scale)
    yield transfer_verdict(posterior, transfer, symbols)


def transfer_verdict(
    posterior: Posterior, transfer: Transfer, symbols: Mapping[str, str] | None = None
) -> CalibrationTransfers | CalibrationDiffers:
    """The calibration transfers if no parameter differs between experiments, nor all together (p < DIFFERS_BELOW).

    Parameters
    ----------
    symbols : mapping of str, optional
        Of parameters, by name.
    """
    moves = differing(dict(zip(posterior.parameters, transfer.p, strict=True)))
    if not moves and not transfer.p_all < DIFFERS_BELOW:
        return CalibrationTransfers()
    named = [parameter_of(posterior, name, symbols) for name in posterior.parameters if name in moves]
    return CalibrationDiffers(tuple(named), transfer.scale)


def canopy_statements(posterior: Posterior, symbols: Mapping[str, str] | None = None) -> Iterator[CanopyCorrected]:
    """The median of plant drag before and after it is corrected to another canopy height; nothing without."""
    canopy = posterior.canopy
    if canopy is not None:
        before = posterior.marginals.median[canopy.parameter]
        yield CanopyCorrected(
            parameter_of(posterior, canopy.parameter, symbols), canopy.from_height, canopy.to_height, canopy.depth,
            before, canopy.median, (canopy.log10_median, canopy.log10_sd),
        )  # fmt: skip
