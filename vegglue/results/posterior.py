"""The posterior: weights of the members, and what follows from them for parameters and predictions."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np
import pandas as pd

from vegglue.results.ensemble import STATION_UNITS, VALUE_UNIT
from vegglue.results.layout import Group, Stored, Variable, stored_fields, table_group

LEVELS = (0.025, 0.25, 0.5, 0.75, 0.975)  # of all quantiles and bands: the 95 % and 50 % ranges and the median
IDENTIFIED_BELOW = 0.5  # 95 % range of the posterior over that of the prior
NEAR_BOUND = 0.02  # of the range of the prior
PRESSES_ABOVE = 0.05  # posterior mass near a bound, at least; a parameter left at its prior has 0.02
# Of the 95 % range, how far from a bound that ends it: 0.014 for half a normal at it, 0.09 for one two deviations off.
ENDS = 0.05
CHAINS, DRAWS_PER_CHAIN = 4, 500  # equal-weight draws for ArviZ
OWN_UNIT = "that of the parameter, see `unit`"
ByParameter = Annotated[dict[str, float], Stored(("parameter",), OWN_UNIT)]
ByLogParameter = Annotated[dict[str, float], Stored(("log_parameter",))]
ByKind = Annotated[dict[str, float], Stored(("kind",), VALUE_UNIT)]


@dataclass(frozen=True)
class CorrectedCanopy:
    """phi of a stand for another canopy height: equal Chézy coefficient at the same depth."""

    parameter: str
    from_height: float  # [m]
    to_height: float  # [m]
    depth: float  # [m]
    phi: Annotated[np.ndarray, Stored(("member",))]
    median: float
    sd: float
    quantiles: Annotated[np.ndarray, Stored(("level",))]
    log10_median: float
    log10_sd: float


@dataclass(frozen=True)
class Refinement:
    """How draws around the best places of the prior were made, under which errors, and what they predict unseen.

    A mode is a place of the prior from which no step helps; a round draws members from all that is known by then.
    """

    errors: str  # stated or estimated
    correlation: float  # of the errors of neighbours along a section [-]
    scale: float  # of the stated errors [-]
    grid_error: float  # root mean square, from a grid of twice the cell size [m/s, m]; NaN where that cannot be made
    starts: int  # members that were followed downhill
    chi2: float  # of the best member, whitened by the covariance of the errors [-]
    freedom: int
    p_misfit: float  # chance of a chi2 as large under errors alone [-]
    elpd: float  # sum of the log predictive densities of stations left out in turn [-]
    elpd_error: float
    inside50: float  # share of measurements within the 50 % band of the prediction from all others [-]
    inside95: float
    p_calibration: float  # chance that shares below are as uneven as these (Kolmogorov-Smirnov) [-]
    mode_theta: Annotated[np.ndarray, Stored(("mode", "parameter"), OWN_UNIT)]
    mode_chi2: Annotated[np.ndarray, Stored(("mode",))]
    mode_weight: Annotated[np.ndarray, Stored(("mode",))]  # of the draws nearest to each
    drawn: Annotated[np.ndarray, Stored(("round",))]  # members after each round
    worth: Annotated[np.ndarray, Stored(("round",))]  # effective members after each round
    log_density: Annotated[np.ndarray, Stored(("member",))]  # of the posterior up to a constant; -inf failed
    prior_theta: Annotated[dict[str, np.ndarray], Stored(("parameter", "member"), OWN_UNIT)]  # draws from the prior
    score: Annotated[np.ndarray, Stored(("station",))]  # log predictive density given all other stations
    score_k: Annotated[np.ndarray, Stored(("station",))]  # k-hat of it
    below: Annotated[np.ndarray, Stored(("station",))]  # share of the prediction below the measurement
    surprise: Annotated[np.ndarray, Stored(("station",))]  # residual that calibration cannot explain, in its errors
    outlier: Annotated[np.ndarray, Stored(("station",))]  # whether one such among all stations is no chance
    left_out: Annotated[np.ndarray, Stored(("group",))]  # sections and experiments left out in turn
    left_out_stations: Annotated[np.ndarray, Stored(("group",))]
    left_out_score: Annotated[np.ndarray, Stored(("group",))]  # log predictive density of them together
    left_out_k: Annotated[np.ndarray, Stored(("group",))]


@dataclass(frozen=True)
class Transfer:
    """Each experiment calibrated alone: what its data say of each parameter, and whether that is one value for all.

    Values and errors on the scale on which the prior is flat (log10 of a log-uniform one); NaN where the data say
    little. chi2 of homogeneity with its freedom and chance; misfits chi2 in the joint fit and alone.
    """

    scale: float  # of the errors, from what the experiments alone leave [-]
    gain: float  # by which chi2 falls when every experiment has its own parameters [-]
    more: int  # how many parameters more these are
    p_all: float  # chance of such a gain by errors alone [-]
    experiments: Annotated[np.ndarray, Stored(("experiment",))]
    value: Annotated[np.ndarray, Stored(("experiment", "parameter"), OWN_UNIT)]
    error: Annotated[np.ndarray, Stored(("experiment", "parameter"), OWN_UNIT)]
    chi2: Annotated[np.ndarray, Stored(("parameter",))]
    freedom: Annotated[np.ndarray, Stored(("parameter",))]
    p: Annotated[np.ndarray, Stored(("parameter",))]
    misfit_together: Annotated[np.ndarray, Stored(("experiment",))]
    misfit_alone: Annotated[np.ndarray, Stored(("experiment",))]
    stations: Annotated[np.ndarray, Stored(("experiment",))]


@dataclass(frozen=True)
class Posterior:
    """Members weighed by their likelihood. `station` counts all rows of the station table; `kind` is velocity or level.

    For a log-uniform or lognormal parameter log10 is what is looked at: in correlation, width_ratio and bound_mass.
    """

    parameters: tuple[str, ...]
    method: str  # glue: members of the ensemble weighed; refine: draws around the best places of the prior
    likelihood: str
    sigma_rule: str
    threshold: float  # smallest efficiency of a member with weight [-]; -inf: none
    members: int
    failed: int
    weighed: int  # members solved and above the threshold
    used: int  # stations that count
    best: int  # member that fits best
    effective_size: float  # Kish: equal members that the weights are worth [-]
    largest_weight: float  # [-]
    pareto_k: float  # shape of the tail of the weights [-]; above 0.7 they are not to be trusted
    chi2: float  # of the best member against known standard errors [-], NaN where one is unknown
    ensemble_hash: str  # config hash of the ensemble
    seed: int
    version: str
    unit: Annotated[dict[str, str], Stored(("parameter",))]
    theta: Annotated[dict[str, np.ndarray], Stored(("parameter", "member"), OWN_UNIT)]
    weights: Annotated[np.ndarray, Stored(("member",))]  # sum 1
    efficiency: Annotated[np.ndarray, Stored(("member",))]  # Nash-Sutcliffe
    log_likelihood: Annotated[np.ndarray, Stored(("member", "station"))]  # Gaussian, refined: given all other stations
    prediction: Annotated[np.ndarray, Stored(("member", "station"), VALUE_UNIT)]
    median: ByParameter
    sd: ByParameter
    quantiles: Annotated[dict[str, np.ndarray], Stored(("parameter", "level"), OWN_UNIT)]
    prior_quantiles: Annotated[dict[str, np.ndarray], Stored(("parameter", "level"), OWN_UNIT)]
    log10_median: ByLogParameter
    log10_sd: ByLogParameter
    correlation: Annotated[np.ndarray, Stored(("parameter", "other_parameter"))]
    width_ratio: Annotated[dict[str, float], Stored(("parameter",))]  # 95 % range, posterior over prior
    identified: Annotated[dict[str, bool], Stored(("parameter",))]
    bounds: Annotated[dict[str, np.ndarray], Stored(("parameter", "side"), OWN_UNIT)]  # of the prior, maybe infinite
    bound_mass: Annotated[dict[str, np.ndarray], Stored(("parameter", "side"))]  # within 2 % of the range of a bound
    bound_hit: Annotated[dict[str, np.ndarray], Stored(("parameter", "side"))]  # whether it presses against it
    sigma: ByKind  # RMS residual of the best member, or of the known standard errors
    rmse: ByKind  # of the median prediction
    best_rmse: ByKind
    noise: Annotated[np.ndarray, Stored(("station",), VALUE_UNIT)]  # residual standard deviation, NaN unknown
    residual: Annotated[np.ndarray, Stored(("station",), VALUE_UNIT)]  # measured minus median prediction
    best_residual: Annotated[np.ndarray, Stored(("station",), VALUE_UNIT)]  # measured minus best member
    model_band: Annotated[np.ndarray, Stored(("level", "station"), VALUE_UNIT)]  # spread of the members alone
    total_band: Annotated[np.ndarray, Stored(("level", "station"), VALUE_UNIT)]  # with the residual error
    draws: Annotated[np.ndarray, Stored(("chain", "draw"))]  # member indices, equal weights
    predictive: Annotated[np.ndarray, Stored(("chain", "draw", "station"), VALUE_UNIT)]  # draws with residual error
    station: pd.DataFrame
    canopy: CorrectedCanopy | None
    refinement: Refinement | None
    transfer: Transfer | None  # of several experiments


PARTS = {"canopy": CorrectedCanopy, "refinement": Refinement, "transfer": Transfer}


def posterior_groups(posterior: Posterior) -> dict[str, Group]:
    """All groups of posterior.h5: those ArviZ knows, `members` with every array, `stations` with the whole table."""
    coordinates = _coordinates(posterior)
    own = {name: _group(part, coordinates) for name, part in ({"members": posterior} | _parts(posterior)).items()}
    own["stations"] = table_group(posterior.station, "station", STATION_UNITS)
    return own | _arviz_groups(posterior)


def _group(part: Any, coordinates: Mapping[str, Any]) -> Group:
    stored = stored_fields(type(part))
    dims = dict.fromkeys(dim for each in stored.values() for dim in each.dims)
    values = {name: _variable(getattr(part, name), each) for name, each in stored.items()}
    return Group({dim: coordinates[dim] for dim in dims}, values)


def _parts(posterior: Posterior) -> dict[str, Any]:
    """What a posterior may have besides its own arrays, by the name of the group."""
    return {name: part for name in PARTS if (part := getattr(posterior, name)) is not None}


def posterior_attributes(posterior: Posterior) -> dict[str, Any]:
    """Numbers and words of the posterior and its canopy correction, for the attributes of the file."""
    own = {name: getattr(posterior, name) for name in _plain(Posterior)}
    for name, part in _parts(posterior).items():
        own |= {f"{name}_{field}": getattr(part, field) for field in _plain(type(part))}
    return own


def posterior_from(read: Mapping[str, Mapping[str, np.ndarray]], stated: Mapping[str, Any]) -> Posterior:
    """The posterior whose file has these groups and attributes."""
    own = read["members"]
    arrays = {name: _value(own, name, stored, Posterior) for name, stored in stored_fields(Posterior).items()}
    return Posterior(
        **arrays,
        **{name: kind(stated[name]) for name, kind in _plain(Posterior).items()},
        parameters=tuple(own["parameter"]),
        station=pd.DataFrame({name: values for name, values in read["stations"].items() if name != "station"}),
        **{name: _part_from(kind, name, read, stated) for name, kind in PARTS.items()},
    )


def _part_from(kind: Any, name: str, read: Mapping[str, Mapping[str, np.ndarray]], stated: Mapping[str, Any]) -> Any:
    if name not in read:
        return None
    arrays = {field: _value(read[name], field, stored, kind) for field, stored in stored_fields(kind).items()}
    return kind(**arrays, **{field: hint(stated[f"{name}_{field}"]) for field, hint in _plain(kind).items()})


def _plain(kind: type) -> dict[str, type]:
    """Fields that are one number or word."""
    return {name: hint for name, hint in get_type_hints(kind).items() if hint in (str, int, float)}


def _variable(value: Any, stored: Stored) -> Variable:
    values = list(value.values()) if isinstance(value, dict) else value
    shape = None if not isinstance(value, dict) or value else (0,) * len(stored.dims)
    return Variable(stored.dims, np.zeros(shape) if shape else np.array(values), stored.unit)


def _value(group: Mapping[str, np.ndarray], name: str, stored: Stored, kind: type) -> Any:
    hint = get_type_hints(kind)[name]
    if get_origin(hint) is not dict:
        return group[name]
    entry = get_args(hint)[1]
    convert = entry if entry in (str, float, bool) else np.asarray
    return {key: convert(value) for key, value in zip(group[stored.dims[0]], group[name], strict=True)}


def _coordinates(posterior: Posterior) -> dict[str, Any]:
    names = np.array(posterior.parameters, object)
    counted = {"mode": "mode_chi2", "round": "drawn", "group": "left_out", "experiment": "experiments"}
    own = {
        dim: np.arange(len(getattr(part, field)))
        for part in _parts(posterior).values()
        for dim, field in counted.items()
        if hasattr(part, field)
    }
    return own | {
        "member": np.arange(posterior.members),
        "station": np.arange(len(posterior.station)),
        "parameter": names,
        "other_parameter": names,
        "log_parameter": np.array(list(posterior.log10_median), object),
        "kind": np.array(list(posterior.sigma), object),
        "level": np.array(LEVELS),
        "side": np.array(["low", "high"], object),
        "chain": np.arange(CHAINS),
        "draw": np.arange(DRAWS_PER_CHAIN),
    }


def _arviz_groups(posterior: Posterior) -> dict[str, Group]:
    """Equal-weight draws and used stations only, so that no NaN reaches ArviZ."""
    used = np.flatnonzero(posterior.station["used"].to_numpy(bool))
    draw = {"chain": np.arange(CHAINS), "draw": np.arange(DRAWS_PER_CHAIN)}
    prior = {"chain": np.arange(1), "draw": np.arange(posterior.members)}
    station, at_draws = {"station": used}, ("chain", "draw")
    member, log_likelihood = posterior.draws, posterior.log_likelihood[:, used]
    units, theta, refined = posterior.unit, posterior.theta, posterior.refinement
    before = refined.prior_theta if refined else theta
    lp = refined.log_density if refined else log_likelihood.sum(axis=1)
    table = table_group(posterior.station.iloc[used], "station", STATION_UNITS)

    def measured(dims: tuple[str, ...], values: Any, unit: str) -> dict[str, Variable]:
        return {"measured": Variable((*dims, "station"), values, unit)}

    stats = {"lp": Variable(at_draws, lp[member]), "member": Variable(at_draws, member)}
    value = posterior.station["value"].to_numpy(float)[used]
    return {
        "posterior": Group(draw, {name: Variable(at_draws, theta[name][member], units[name]) for name in theta}),
        "prior": Group(prior, {name: Variable(at_draws, before[name][None, :], units[name]) for name in theta}),
        "log_likelihood": Group(draw | station, measured(at_draws, log_likelihood[member], "-")),
        "posterior_predictive": Group(draw | station, measured(at_draws, posterior.predictive[:, :, used], VALUE_UNIT)),
        "observed_data": Group(station, measured((), value, VALUE_UNIT)),
        "constant_data": Group(station, table.variables),
        "sample_stats": Group(draw, stats),
    }
