"""posterior.h5: nested values on one side, flat groups of datasets and attributes on the other.

A field is stored under its own name, however deep it lies. Arrays of the posterior are datasets of the group `members`;
those of a canopy correction, a refinement or a transfer test are datasets of a group with the name of that part. Single
numbers and words are attributes of the file, those of a part with its name and _ in front.
"""

from collections.abc import Mapping
from dataclasses import is_dataclass
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from vegglue.measurements.kinds import KINDS
from vegglue.results.ensemble import STATION_UNITS, VALUE_UNIT
from vegglue.results.layout import (
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
from vegglue.results.posterior import (
    CHAINS,
    DRAWS_PER_CHAIN,
    LEVELS,
    CorrectedCanopy,
    Posterior,
    Refinement,
    Surrogate,
    Transfer,
)

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
