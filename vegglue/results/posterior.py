"""The posterior: weighted members, what follows from them, and how they were drawn; and its layout in posterior.h5.

A mode is a set of parameters from which no small step improves the fit. Members are drawn in rounds, each of which uses
what the rounds before it found. A field is stored under its own name, however deep it lies: arrays of the posterior in
the group `members`, those of a canopy correction, a refinement or a transfer test in a group with the name of that
part; single numbers and words as attributes of the file, those of a part with its name and _ in front.
"""

from collections.abc import Mapping
from dataclasses import dataclass, is_dataclass
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np
import pandas as pd

from vegglue.measurements.kinds import KINDS, errors_in_short
from vegglue.results.ensemble import STATION_UNITS, VALUE_UNIT
from vegglue.results.layout import (
    IN_WORDS,
    WHOLE_NUMBERS,
    YES_OR_NO,
    Group,
    Stored,
    Variable,
    fitting,
    names_of,
    stated_as,
    stations_from,
    stored_fields,
    table_group,
)
from vegglue.wording.numbers import in_short, in_short_html, interval_in_short
from vegglue.wording.sentences import phrase

OWN_UNIT = "that of the parameter, see `unit`"


@dataclass(frozen=True)
class ErrorModel:
    """The errors of the data that the misfit is weighed by.

    Attributes
    ----------
    errors : str
        "stated" or "estimated".
    correlation : float
        Of the errors of neighbours along a section [-].
    scale : float
        Of the stated errors [-].
    grid_error : float
        Root mean square, from a grid of twice the cell size [m/s, m]; NaN where that cannot be made.
    """

    errors: str
    correlation: float
    scale: float
    grid_error: float


@dataclass(frozen=True)
class PosteriorModes:
    """Where the search for the best fit ended, the best mode first.

    Attributes
    ----------
    starts : int
        Members that were followed downhill.
    mode_theta : ndarray (mode, parameter)
        Parameters of each [unit of each].
    mode_chi2 : ndarray (mode,)
        Misfit of each [-].
    mode_weight : ndarray (mode,)
        Weight of the draws nearest to each.
    """

    starts: int
    mode_theta: Annotated[np.ndarray, Stored(("mode", "parameter"), OWN_UNIT)]
    mode_chi2: Annotated[np.ndarray, Stored(("mode",))]
    mode_weight: Annotated[np.ndarray, Stored(("mode",))]


@dataclass(frozen=True)
class ImportanceDraws:
    """How the members were drawn, and as many draws from the prior to compare them with.

    Attributes
    ----------
    drawn, worth : ndarray (round,)
        Members, and what they are worth as equal ones, after each round.
    log_density : ndarray (member,)
        ln of the density of the posterior up to a constant; -inf if it failed.
    prior_theta : dict of ndarray (member,)
        Draws from the prior.
    """

    drawn: Annotated[np.ndarray, Stored(("round",), type=WHOLE_NUMBERS)]
    worth: Annotated[np.ndarray, Stored(("round",))]
    log_density: Annotated[np.ndarray, Stored(("member",))]
    prior_theta: Annotated[dict[str, np.ndarray], Stored(("parameter", "member"), OWN_UNIT)]


@dataclass(frozen=True)
class LeaveOneOut:
    """Each station predicted from all others.

    Attributes
    ----------
    elpd, elpd_error : float
        Sum of the log predictive densities of stations left out in turn, and its standard error [-].
    inside50, inside95 : float
        Shares of measurements within the 50 % and the 95 % band of the prediction from all others [-].
    p_calibration : float
        Chance that shares below are as uneven as these (Kolmogorov-Smirnov) [-].
    score, score_k : ndarray (station,)
        Log predictive density given all other stations, and its Pareto k.
    below : ndarray (station,)
        Share of the prediction below the measurement.
    """

    elpd: float
    elpd_error: float
    inside50: float
    inside95: float
    p_calibration: float
    score: Annotated[np.ndarray, Stored(("station",))]
    score_k: Annotated[np.ndarray, Stored(("station",))]
    below: Annotated[np.ndarray, Stored(("station",))]


@dataclass(frozen=True)
class MisfitTest:
    """Whether the errors explain what the best member leaves, at all stations together and at each.

    Attributes
    ----------
    chi2 : float
        Of the best member, whitened by the covariance of the errors [-].
    freedom : int
        Its degrees of freedom.
    p_misfit : float
        Chance of a chi2 as large under errors alone [-].
    surprise : ndarray (station,)
        Residual that calibration cannot explain, in its errors.
    outlier : ndarray of bool (station,)
        Whether one such residual among all is no chance.
    """

    chi2: float
    freedom: int
    p_misfit: float
    surprise: Annotated[np.ndarray, Stored(("station",))]
    outlier: Annotated[np.ndarray, Stored(("station",), type=YES_OR_NO)]

    @property
    def worst_outlier(self) -> int:
        """The row of the station that stands out most, of those that are outliers; ValueError without any."""
        return int(np.nanargmax(np.abs(np.where(self.outlier, self.surprise, np.nan))))


@dataclass(frozen=True)
class GroupsLeftOut:
    """Each section, and each experiment, predicted from all other stations.

    Attributes
    ----------
    left_out : ndarray of str (group,)
        Sections and experiments left out in turn.
    left_out_stations : ndarray of int (group,)
        How many stations each has.
    left_out_score, left_out_k : ndarray (group,)
        Log predictive density of the stations of each together, and its Pareto k.
    """

    left_out: Annotated[np.ndarray, Stored(("group",), type=IN_WORDS)]
    left_out_stations: Annotated[np.ndarray, Stored(("group",), type=WHOLE_NUMBERS)]
    left_out_score: Annotated[np.ndarray, Stored(("group",))]
    left_out_k: Annotated[np.ndarray, Stored(("group",))]


@dataclass(frozen=True)
class Refinement:
    """What a refined posterior knows more than a weighted ensemble."""

    error_model: ErrorModel
    modes: PosteriorModes
    draws: ImportanceDraws
    leave_one_out: LeaveOneOut
    misfit: MisfitTest
    groups: GroupsLeftOut


LEVELS = (0.025, 0.25, 0.5, 0.75, 0.975)  # of all quantiles and bands: the 95 % and 50 % ranges and the median
IDENTIFIED_BELOW = 0.5  # 95 % range of the posterior over that of the prior
NEAR_BOUND = 0.02  # of the range of the prior
CHAINS, DRAWS_PER_CHAIN = 4, 500  # equal-weight draws for ArviZ
# Effective members below which no posterior is claimed: an end of the 95 % range rests on 2.5 % of them, here 2 or 3.
CLAIMED_FROM = 100
ByParameter = Annotated[dict[str, float], Stored(("parameter",), OWN_UNIT)]
ByLogParameter = Annotated[dict[str, float], Stored(("log_parameter",))]
ByKind = Annotated[dict[str, float], Stored(("kind",), VALUE_UNIT)]


@dataclass(frozen=True)
class InferenceSettings:
    """How the members were weighed, and which ensemble they come from.

    Attributes
    ----------
    method : str
        "glue": members of the ensemble weighed; "refine": draws around the modes; "surrogate": of a surrogate.
    likelihood : str
        "gaussian", "nse" or "inverse-variance".
    sigma_rule : str
        "best-member" or "known".
    threshold : float
        Smallest efficiency of a member with weight [-]; -inf: none.
    ensemble_hash : str
        Config hash of the ensemble, '' where none was needed.
    seed : int
        Of the draws.
    version : str
        Of vegglue.
    """

    method: str
    likelihood: str
    sigma_rule: str
    threshold: float
    ensemble_hash: str
    seed: int
    version: str


@dataclass(frozen=True)
class WeightedSample:
    """The members: their parameters, what each predicts, how well, and its weight.

    Attributes
    ----------
    members, failed, best : int
        How many, those without a flow among them, and the one that fits best.
    unit : dict of str
        Of each parameter.
    theta : dict of ndarray (member,)
        Values of each parameter [its unit].
    weights : ndarray (member,)
        w, of sum 1.
    efficiency : ndarray (member,)
        1 - sum (y - f)^2 / sum (y - mean y)^2 (Nash-Sutcliffe).
    log_likelihood : ndarray (member, station)
        Gaussian; of a refined posterior that of each station given all others.
    prediction : ndarray (member, station)
        f [unit of the kind].
    """

    members: int
    failed: int
    best: int
    unit: Annotated[dict[str, str], Stored(("parameter",), type=IN_WORDS)]
    theta: Annotated[dict[str, np.ndarray], Stored(("parameter", "member"), OWN_UNIT)]
    weights: Annotated[np.ndarray, Stored(("member",))]
    efficiency: Annotated[np.ndarray, Stored(("member",))]
    log_likelihood: Annotated[np.ndarray, Stored(("member", "station"))]
    prediction: Annotated[np.ndarray, Stored(("member", "station"), VALUE_UNIT)]


@dataclass(frozen=True)
class WeightStatistics:
    """What the weights are worth.

    Attributes
    ----------
    weighed : int
        Members solved and above the threshold.
    effective_size : float
        N = 1 / sum w^2 (Kish): equal members that the weights w are worth [-].
    largest_weight : float
        Largest w [-].
    pareto_k : float
        Shape of the tail of the weights [-]; above 0.7 they are not to be trusted.
    """

    weighed: int
    effective_size: float
    largest_weight: float
    pareto_k: float


@dataclass(frozen=True)
class Marginals:
    """Each parameter by its name, beside its prior, and the correlation of all pairs.

    Of a log-uniform or lognormal parameter, correlation, width_ratio and bound_mass are those of its log10.

    Attributes
    ----------
    median, sd : dict of float
        Median and standard deviation [unit of the parameter].
    quantiles, prior_quantiles : dict of ndarray (level,)
        Of the posterior and of the prior at LEVELS [unit of the parameter].
    log10_median, log10_sd : dict of float
        The same of log10, if the prior is log-uniform or lognormal [-].
    correlation : ndarray (parameter, other_parameter)
        Of all pairs.
    width_ratio : dict of float
        95 % range of the posterior over that of the prior.
    identified : dict of bool
        Whether that is below IDENTIFIED_BELOW.
    bounds : dict of ndarray (side,)
        Of the prior, maybe infinite [unit of the parameter].
    bound_mass : dict of ndarray (side,)
        Share of the weight within 2 % of the range of a bound [-].
    bound_hit : dict of ndarray of bool (side,)
        Whether it presses against that bound.
    """

    median: ByParameter
    sd: ByParameter
    quantiles: Annotated[dict[str, np.ndarray], Stored(("parameter", "level"), OWN_UNIT)]
    prior_quantiles: Annotated[dict[str, np.ndarray], Stored(("parameter", "level"), OWN_UNIT)]
    log10_median: ByLogParameter
    log10_sd: ByLogParameter
    correlation: Annotated[np.ndarray, Stored(("parameter", "other_parameter"))]
    width_ratio: Annotated[dict[str, float], Stored(("parameter",))]
    identified: Annotated[dict[str, bool], Stored(("parameter",), type=YES_OR_NO)]
    bounds: Annotated[dict[str, np.ndarray], Stored(("parameter", "side"), OWN_UNIT)]
    bound_mass: Annotated[dict[str, np.ndarray], Stored(("parameter", "side"))]
    bound_hit: Annotated[dict[str, np.ndarray], Stored(("parameter", "side"), type=YES_OR_NO)]


@dataclass(frozen=True)
class GoodnessOfFit:
    """What is left between measured and predicted, and the errors it is compared with, by kind of observation.

    Attributes
    ----------
    used : int
        Stations that count.
    chi2 : float
        sum ((y - f) / s)^2 of the best member, s known standard errors [-]; NaN where one is unknown.
    sigma : dict of float
        Root mean square residual of the best member, or of the known standard errors, by kind [its unit].
    rmse, best_rmse : dict of float
        Root mean square residual of the median prediction, and of the best member, by kind [its unit].
    noise : ndarray (station,)
        Standard deviation of a residual, NaN if unknown.
    residual : ndarray (station,)
        y - f of the median prediction.
    """

    used: int
    chi2: float
    sigma: ByKind
    rmse: ByKind
    best_rmse: ByKind
    noise: Annotated[np.ndarray, Stored(("station",), VALUE_UNIT)]
    residual: Annotated[np.ndarray, Stored(("station",), VALUE_UNIT)]


@dataclass(frozen=True)
class PredictiveDistribution:
    """What the posterior predicts at the stations: quantiles, and draws of equal weight.

    Attributes
    ----------
    model_band, total_band : ndarray (level, station)
        Quantiles at LEVELS of the members alone, and with the residual error.
    draws : ndarray (chain, draw)
        Members of draws of equal weight.
    predictive : ndarray (chain, draw, station)
        What these predict, with residual error.
    """

    model_band: Annotated[np.ndarray, Stored(("level", "station"), VALUE_UNIT)]
    total_band: Annotated[np.ndarray, Stored(("level", "station"), VALUE_UNIT)]
    draws: Annotated[np.ndarray, Stored(("chain", "draw"), type=WHOLE_NUMBERS)]
    predictive: Annotated[np.ndarray, Stored(("chain", "draw", "station"), VALUE_UNIT)]


@dataclass(frozen=True)
class CorrectedCanopy:
    """phi of a stand for another canopy height: equal Chézy coefficient at the same depth.

    Attributes
    ----------
    parameter : str
        Name of phi.
    from_height, to_height, depth : float
        Of the canopy [m], and depth of the water [m].
    phi : ndarray (member,)
        phi of each member [-].
    median, sd : float
        Median and standard deviation [-].
    quantiles : ndarray (level,)
        At LEVELS [-].
    log10_median, log10_sd : float
        Median and standard deviation of log10 phi [-].
    """

    parameter: str
    from_height: float
    to_height: float
    depth: float
    phi: Annotated[np.ndarray, Stored(("member",))]
    median: float
    sd: float
    quantiles: Annotated[np.ndarray, Stored(("level",))]
    log10_median: float
    log10_sd: float


@dataclass(frozen=True)
class Transfer:
    """Each experiment calibrated alone: its estimate of each parameter, and whether that is one value for all.

    Values and errors on the scale on which the prior is flat (log10 of a log-uniform one); NaN where the data constrain
    little. chi2 of homogeneity with its freedom and chance; misfits chi2 in the joint fit and alone.

    Attributes
    ----------
    scale : float
        Of the errors, from what the experiments alone leave [-].
    gain : float
        By which chi2 falls when every experiment has its own parameters [-].
    more : int
        How many parameters more these are.
    p_all : float
        Chance of such a gain by errors alone [-].
    experiments : ndarray of str (experiment,)
    value, error : ndarray (experiment, parameter)
        Estimate of each experiment alone, and its standard error.
    chi2, freedom, p : ndarray (parameter,)
        Of homogeneity, its degrees of freedom, and its chance by errors alone.
    misfit_together, misfit_alone : ndarray (experiment,)
        chi2 in the joint fit, and of the experiment alone.
    stations : ndarray (experiment,)
        How many.
    """

    scale: float
    gain: float
    more: int
    p_all: float
    experiments: Annotated[np.ndarray, Stored(("experiment",), type=IN_WORDS)]
    value: Annotated[np.ndarray, Stored(("experiment", "parameter"), OWN_UNIT)]
    error: Annotated[np.ndarray, Stored(("experiment", "parameter"), OWN_UNIT)]
    chi2: Annotated[np.ndarray, Stored(("parameter",))]
    freedom: Annotated[np.ndarray, Stored(("parameter",))]
    p: Annotated[np.ndarray, Stored(("parameter",))]
    misfit_together: Annotated[np.ndarray, Stored(("experiment",))]
    misfit_alone: Annotated[np.ndarray, Stored(("experiment",))]
    stations: Annotated[np.ndarray, Stored(("experiment",), type=WHOLE_NUMBERS)]


@dataclass(frozen=True)
class Surrogate:
    """Of a command: what a posterior by a surrogate rests on, and how far it is known.

    Errors are standard errors over realisations of what the surrogate does not know, the largest of any parameter.

    Attributes
    ----------
    runs, failed : int
        Of the command, and those of them that failed.
    settled : int
        1 if the errors were small enough, and stayed so when runs were added.
    median_error : float
        Of a median [standard deviations of the posterior].
    sd_error : float
        Of a standard deviation, over itself [-].
    last_error : float
        Of the surrogate at the last runs, root mean square [standard errors of the data].
    validation_low, validation_high : float
        Discharges at which measurements would test it [m3/s]; NaN if the case has any.
    """

    runs: int
    failed: int
    settled: int
    median_error: float
    sd_error: float
    last_error: float
    validation_low: float
    validation_high: float


@dataclass(frozen=True)
class Posterior:
    """Everything one inference finds. Arrays over stations count all rows of the table `station`.

    Attributes
    ----------
    settings, sample, weighting, marginals, fit, predicted
        InferenceSettings, WeightedSample, WeightStatistics, Marginals, GoodnessOfFit and PredictiveDistribution.
    station
        Table of all stations, used or not.
    canopy, refinement, transfer, surrogate
        CorrectedCanopy, Refinement, Transfer (of several experiments) and Surrogate (of a command), None without.
    """

    settings: InferenceSettings
    sample: WeightedSample
    weighting: WeightStatistics
    marginals: Marginals
    fit: GoodnessOfFit
    predicted: PredictiveDistribution
    station: pd.DataFrame
    canopy: CorrectedCanopy | None
    refinement: Refinement | None
    transfer: Transfer | None
    surrogate: Surrogate | None = None

    @property
    def parameters(self) -> tuple[str, ...]:
        return tuple(self.sample.theta)

    @property
    def claimed(self) -> bool:
        """Whether enough effective members carry the weight for anything to rest on it."""
        return self.weighting.effective_size >= CLAIMED_FROM

    def __repr__(self) -> str:
        sample, marginals, worth = self.sample, self.marginals, self.weighting.effective_size
        ends, errors = [LEVELS.index(0.025), LEVELS.index(0.975)], errors_in_short(self.fit.rmse)
        ranges = {name: values[ends] for name, values in marginals.quantiles.items()}
        return in_short(
            f"Posterior of {', '.join(self.parameters)} ({self.settings.method})",
            [
                phrase("members_in_posterior", sample.members, sample.failed, worth),
                "" if self.claimed else phrase("posterior_not_claimed", CLAIMED_FROM),
                *(
                    interval_in_short(name, marginals.median[name], low, high, sample.unit[name])
                    for name, (low, high) in ranges.items()
                ),
                phrase("errors_of_median", self.fit.used, errors),
            ],
        )

    def _repr_html_(self) -> str:
        marginals, unit = self.marginals, self.sample.unit
        ends = [LEVELS.index(0.025), LEVELS.index(0.975)]
        rows = [
            (
                name,
                f"{marginals.median[name]:.3g}",
                "{:.3g} to {:.3g}".format(*marginals.quantiles[name][ends]),
                unit[name],
            )
            for name in self.parameters
        ]
        heading, *lines = repr(self).split("\n")
        others = [line for line in lines if not line.strip().startswith(tuple(f"{name}: " for name in self.parameters))]
        return in_short_html("\n".join([heading, *others]), ("parameter", "median", "95 % range", "unit"), rows)


ROUNDING = 1e-6  # of a sum of a million weights
LARGEST_PARAMETER = 1e100  # its square is still a number
PARTS = {"canopy": CorrectedCanopy, "refinement": Refinement, "transfer": Transfer, "surrogate": Surrogate}


def posterior_groups(posterior: Posterior) -> dict[str, Group]:
    """All groups of posterior.h5: those ArviZ knows, `members` with every array, `stations` with the whole table."""
    names = np.array(posterior.parameters, object)
    named = {
        "parameter": names,
        "other_parameter": names,
        "log_parameter": np.array(list(posterior.marginals.log10_median), object),
        "kind": np.array(list(posterior.fit.sigma), object),
        "level": np.array(LEVELS),
        "side": np.array(["low", "high"], object),
    }
    groups = {}
    for name, part in ({"members": posterior} | _parts(posterior)).items():
        own = _variables(part)
        sizes = {dim: size for each in own.values() for dim, size in zip(each.dims, each.values.shape, strict=True)}
        groups[name] = Group({dim: named.get(dim, np.arange(size)) for dim, size in sizes.items()}, own)
    groups["stations"] = table_group(posterior.station, "station", STATION_UNITS)
    return groups | _arviz_groups(posterior)


def posterior_attributes(posterior: Posterior) -> dict[str, Any]:
    """Numbers and words of the posterior and its parts, for the attributes of the file."""
    own = _attributes(posterior)
    for name, part in _parts(posterior).items():
        own |= {f"{name}_{field}": value for field, value in _attributes(part).items()}
    return own


def posterior_from(read: Mapping[str, Mapping[str, np.ndarray]], stated: Mapping[str, Any]) -> Posterior:
    """The posterior whose file has these groups and attributes.

    Raises
    ------
    KeyError, ValueError
        If a part is missing or does not fit, weights do not sum to 1, a draw is no member, or a kind is unknown.
    """
    station, parameters = stations_from(read["stations"]), names_of(read["members"], "parameter")
    sizes = {"member": stated_as(int, stated, "members"), "station": len(station), "level": len(LEVELS), "side": 2}
    sizes |= {"parameter": len(parameters), "other_parameter": len(parameters)}
    there = {name: kind for name, kind in ({"members": Posterior} | PARTS).items() if name in read}
    for name, kind in there.items():
        fitting(read[name], _all_stored(kind), sizes)
    parts: dict[str, Any] = dict.fromkeys(PARTS) | {
        name: kind(**_fields_from(kind, read[name], stated, f"{name}_")) for name, kind in PARTS.items() if name in read
    }
    posterior = Posterior(**_fields_from(Posterior, read["members"], stated), station=station, **parts)
    drawn, sample = posterior.predicted.draws, posterior.sample
    if not all((np.abs(values) <= LARGEST_PARAMETER).all() for values in sample.theta.values()):
        raise ValueError("theta holds what no parameter can be")
    if not (sample.weights >= 0.0).all() or abs(sample.weights.sum() - 1.0) > ROUNDING:
        raise ValueError("weights do not sum to 1")
    if not 0 <= sample.best < sample.members or drawn.min() < 0 or drawn.max() >= sample.members:
        raise ValueError("a draw is no member")
    if not set(posterior.fit.sigma) <= set(KINDS):
        raise ValueError("an error is of no kind of observation")
    return posterior


def _parts(posterior: Posterior) -> dict[str, Any]:
    """What a posterior may have besides its own arrays, by the name of the group."""
    return {name: part for name in PARTS if (part := getattr(posterior, name)) is not None}


def _values_in(kind: type) -> dict[str, type]:
    """Fields that are values with fields of their own."""
    return {name: hint for name, hint in get_type_hints(kind).items() if isinstance(hint, type) and is_dataclass(hint)}


def _all_stored(kind: type) -> dict[str, Stored]:
    """Arrays of a value and of the values in it, by name."""
    inner = [_all_stored(each) for each in _values_in(kind).values()]
    return stored_fields(kind) | {name: one for each in inner for name, one in each.items()}


def _plain(kind: type) -> dict[str, type]:
    """Fields that are one number or word."""
    return {name: hint for name, hint in get_type_hints(kind).items() if hint in (str, int, float)}


def _attributes(value: Any) -> dict[str, Any]:
    """Numbers and words of a value and of the values in it, by name."""
    own = {name: getattr(value, name) for name in _plain(type(value))}
    for name in _values_in(type(value)):
        own |= _attributes(getattr(value, name))
    return own


def _variables(value: Any) -> dict[str, Variable]:
    """Arrays of a value and of the values in it, by name."""
    own = {}
    for name, stored in stored_fields(type(value)).items():
        array = getattr(value, name)
        values = np.array(list(array.values()) if isinstance(array, dict) else array)
        empty = isinstance(array, dict) and not array
        own[name] = Variable(stored.dims, np.zeros((0,) * len(stored.dims)) if empty else values, stored.unit)
    for name in _values_in(type(value)):
        own |= _variables(getattr(value, name))
    return own


def _fields_from(kind: type, group: Mapping[str, np.ndarray], stated: Mapping[str, Any], prefix: str = "") -> Any:
    """Arguments that make a value of this kind again, but for those that are no field of the group or attribute."""
    hints = get_type_hints(kind)
    own = {name: stated_as(hint, stated, prefix + name) for name, hint in _plain(kind).items()}
    for name, stored in stored_fields(kind).items():
        own[name] = group[name]
        if get_origin(hints[name]) is dict:
            entry = get_args(hints[name])[1]
            convert = entry if entry in (str, float, bool) else np.asarray
            keys = names_of(group, stored.dims[0])
            own[name] = {key: convert(value) for key, value in zip(keys, group[name], strict=True)}
    return own | {name: inner(**_fields_from(inner, group, stated, prefix)) for name, inner in _values_in(kind).items()}


def _arviz_groups(posterior: Posterior) -> dict[str, Group]:
    """Equal-weight draws and used stations only, so that no NaN reaches ArviZ."""
    sample, refined = posterior.sample, posterior.refinement
    used = np.flatnonzero(posterior.station["used"].to_numpy())
    draw = {"chain": np.arange(CHAINS), "draw": np.arange(DRAWS_PER_CHAIN)}
    prior = {"chain": np.arange(1), "draw": np.arange(sample.members)}
    station, at_draws = {"station": used}, ("chain", "draw")
    member, log_likelihood = posterior.predicted.draws, sample.log_likelihood[:, used]
    units, theta = sample.unit, sample.theta
    before = refined.draws.prior_theta if refined else theta
    lp = refined.draws.log_density if refined else log_likelihood.sum(axis=1)
    table = table_group(posterior.station.iloc[used], "station", STATION_UNITS)
    predictive = posterior.predicted.predictive[:, :, used]

    def measured(dims: tuple[str, ...], values: Any, unit: str) -> dict[str, Variable]:
        return {"measured": Variable((*dims, "station"), values, unit)}

    stats = {"lp": Variable(at_draws, lp[member]), "member": Variable(at_draws, member)}
    value = posterior.station["value"].to_numpy(float)[used]
    return {
        "posterior": Group(draw, {name: Variable(at_draws, theta[name][member], units[name]) for name in theta}),
        "prior": Group(prior, {name: Variable(at_draws, before[name][None, :], units[name]) for name in theta}),
        "log_likelihood": Group(draw | station, measured(at_draws, log_likelihood[member], "-")),
        "posterior_predictive": Group(draw | station, measured(at_draws, predictive, VALUE_UNIT)),
        "observed_data": Group(station, measured((), value, VALUE_UNIT)),
        "constant_data": Group(station, table.variables),
        "sample_stats": Group(draw, stats),
    }
