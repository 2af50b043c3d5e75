"""What may be missing or off: effects of the library that a case could lack, as a case with one parameter more, and
instruments.

    value -> value + offset,   the offset the same in all readings of the instrument

An instrument is found by its offset. A probe may be off by a factor, too: once it is excluded neither counts, see
`error_columns`.
"""

import itertools
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.bed_error import SurveyedLine
from vegglue.case.case_effects import effect_named, effect_of
from vegglue.case.channel_geometry import site_scales
from vegglue.case.parameter_space import middle_value, z_of
from vegglue.case.schema import Case, EffectEntry, Parameter
from vegglue.case.site_schema import Value
from vegglue.decision_constants import constants
from vegglue.effects.definition import Amplitude, Effect, Need, Shape
from vegglue.effects.identity import EffectIdentity
from vegglue.effects.library import library
from vegglue.engine.interface import Cause
from vegglue.errors import InputError, shown_path
from vegglue.measurements.csv_table import read_table
from vegglue.measurements.kinds import kind_of, velocity_rows

# Combinations of shapes of an effect that a search tries at most. Chosen, not measured: each is a tangent of the flow.
MOST_SETTINGS = 12
# Share of a plausible size [-] by which a fit starts off the ends of a support: there the normal variable in which it
# searches is at its furthest. Chosen, not measured.
START_OFF_ENDS = 0.01
# Tags of effects that are no candidates of their own: something at a place, and laws of the grammar.
NOT_SEARCHED = {"search", "law"}


@dataclass(frozen=True)
class Candidate:
    """An effect and where it would act; empty tuples mean everywhere.

    Attributes
    ----------
    at : tuple of str
        Its patch or its place, as a target of `EffectIdentity`.
    fixed : tuple of (str, float)
        The shapes of that patch or place [unit of each].
    scale : float or None
        A plausible size in this case [unit of the amplitude], None for that of the effect.
    above_off : bool
        Whether the amplitude may only lie above off.
    fitted : tuple of (str, Parameter)
        Priors of shapes that are fitted with the amplitude, from their values in `fixed`.
    """

    effect: Effect
    experiments: tuple[str, ...] = ()
    sections: tuple[str, ...] = ()
    devices: tuple[str, ...] = ()
    at: tuple[str, ...] = ()
    fixed: tuple[tuple[str, float], ...] = ()
    scale: float | None = None
    above_off: bool = False
    fitted: tuple[tuple[str, Parameter], ...] = ()

    @property
    def identity(self) -> EffectIdentity:
        return EffectIdentity(self.effect.name, (*self.experiments, *self.sections, *self.devices, *self.at))

    @property
    def name(self) -> str:
        return self.identity.text

    @property
    def key(self) -> str:
        return self.identity.key

    @property
    def amplitude(self) -> Amplitude:
        """That of the effect, with a plausible size in this case."""
        own = self.effect.amplitude
        own = replace(own, scale=own.scale * constants().effect_sizes if self.scale is None else self.scale)
        return replace(own, low=own.off) if self.above_off else own

    @property
    def parameter(self) -> str:
        return f"{self.key}_{self.effect.amplitude.name}"

    @property
    def free(self) -> dict[str, str]:
        """Parameters of the shapes that are calibrated together with the amplitude, by the shape."""
        names = [*(one.name for one in self.effect.shapes if one.sd), *(name for name, _ in self.fitted)]
        return {name: f"{self.key}_{name}" for name in names}

    @property
    def has_further_amplitudes(self) -> bool:
        """Whether others share what its amplitude explains: each may then be compatible with off, and not all."""
        return any(one.sd for one in self.effect.shapes)

    @property
    def priors(self) -> dict[str, Parameter]:
        """Of the amplitude and of the shapes that are calibrated with it, by the parameter: normal around off, or the
        default, its standard deviation the plausible size, within the support.
        """
        amplitude, free = self.amplitude, self.free
        all_of: list[tuple[str, Amplitude | Shape, float, float]] = [
            (self.parameter, amplitude, amplitude.off, amplitude.scale),
            *((free[one.name], one, one.default, one.sd) for one in self.effect.shapes if one.sd),
        ]
        return {
            name: Parameter(
                distribution="normal", mean=mean, sd=sd, low=one.low, high=one.high, unit=one.unit, symbol="",
                meaning=one.meaning,
            )
            for name, one, mean, sd in all_of
        } | {free[name]: prior for name, prior in self.fitted}  # fmt: skip

    def drawn_shapes(self, random: np.random.Generator) -> dict[str, float]:
        """Values of the shapes between those that a search tries, as nature does; those that are fixed as they are."""
        drawn = {
            shape.name: float(random.uniform(min(shape.grid), max(shape.grid))) if shape.grid else shape.default
            for shape in self.effect.shapes
        }
        return drawn | dict(self.fixed)

    def settings(self) -> list[dict[str, float]]:
        """Values of the shapes to try: those that are fixed, else their grids, or their defaults; none of `free`."""
        if self.fixed:
            return [dict(self.fixed)]
        tried = [shape for shape in self.effect.shapes if not shape.sd]
        grids = [shape.grid or (shape.default,) for shape in tried]
        names = [shape.name for shape in tried]
        combinations = [dict(zip(names, values, strict=True)) for values in itertools.product(*grids)]
        every = -(-len(combinations) // MOST_SETTINGS)
        return combinations[::every]


def candidates_of(case: Case, station: pd.DataFrame) -> list[Candidate]:
    """Effects of the library that neither act in the case nor are excluded, where each may act.

    Parameters
    ----------
    station : DataFrame
        All stations.

    Returns
    -------
    list of Candidate
        Those whose needs the site fulfils.
    """
    found = []
    possible, missing = where_it_may_act(case, station), missing_needs(case, station)
    for name, listed in library(case.effect_file).items():
        if name in (case.exclude or ()):
            continue
        if NOT_SEARCHED & set(listed.tags) or missing & set(listed.needs):
            continue
        if listed.stage == "plants" and not case.plants.patches:
            continue
        effect = effect_named(case, name)
        if effect.each == "case":
            found.append(Candidate(effect))
        elif effect.each == "patch":
            found += [patch_candidate(effect, index, case) for index in range(len(case.plants.patches))]
        else:
            found += [acting_in(effect, effect.each, (name,)) for name in possible[effect.each]]
            if effect.each == "experiment" and len(possible["experiment"]) > 1:
                found.append(Candidate(effect))
    return [one for one in found if not at_work(case, one)]


# Heights in a vertical from which its mean is that of the depth, whatever the law: one is a sample, two give a slope,
# three a curve.
ENOUGH_HEIGHTS = 3


def missing_needs(case: Case, station: pd.DataFrame) -> set[Need]:
    """What effects may need and the site does not have: without it they are no candidates.

    Side walls are those of a laboratory, where no wind blows and no water seeps in.

    Parameters
    ----------
    station : DataFrame
        All stations.
    """
    used = station[station["used"]]
    kinds = [kind_of(str(name)) for name in used["kind"].unique()]
    averaged = [one for one in case.observations if one.kind == "adv"]
    heights = []  # points in the median vertical of each section
    for file in {one.file for one in averaged}:
        verticals = read_table(file, ("case",), ("x", "y")).groupby(["case", "x", "y"]).size()
        heights += [float(verticals[one.case].median()) for one in averaged if one.file == file]
    has: dict[Need, bool] = {
        "open air": case.friction.walls is None,
        "open ground": case.friction.walls is None,
        "banks": site_scales(case).banks,
        "plants": bool(case.plants.patches),
        "one surface": len({one.coefficient for one in case.friction.classes.values()}) == 1,
        "gauges": any(kind.instrument == "gauge" for kind in kinds),
        "two streams": site_scales(case).two_streams
        or any("inflow" in effect_of(case, name).tags for name in case.effects),
        "few heights": not averaged
        or len(averaged) < sum(kind_of(one.kind).velocity for one in case.observations if one.kind != "adv")
        or min(heights) < ENOUGH_HEIGHTS,
    }
    return {need for need, there in has.items() if not there}


def at_work(case: Case, candidate: Candidate) -> bool:
    """Whether this effect acts in the case just where the candidate does, whatever its key is there.

    Returns
    -------
    bool
        True if the case has an effect of the candidate's key, too: the candidate would take its place.
    """

    def acts_in(one: Candidate) -> tuple[object, ...]:
        """Every experiment by its name is the same as none."""
        experiments = frozenset(one.experiments or case.experiments)
        return one.effect.name, one.at, experiments, frozenset(one.sections), frozenset(one.devices)

    in_case = candidates_in_case(case).values()
    return candidate.key in case.effects or any(acts_in(one) == acts_in(candidate) for one in in_case)


def acting_in(effect: Effect, kind: str, names: tuple[str, ...]) -> Candidate:
    """An effect in some experiments, sections or devices, by `kind`."""
    where = {f"{one}s": names if one == kind else () for one in ("experiment", "section", "device")}
    return Candidate(effect, where["experiments"], where["sections"], where["devices"])


def where_it_may_act(case: Case, station: pd.DataFrame) -> dict[str, list[str]]:
    """Places in one of which alone an effect may act.

    Parameters
    ----------
    station : DataFrame
        All stations.

    Returns
    -------
    dict of list of str
        `experiment`; `section`, those with used velocities; `device`, the used ones; `patch`.

    Raises
    ------
    InputError
        If two names give one key of a config, such as `Q 2` and `Q/2`.
    """
    used = station[station["used"]]
    velocity = used[velocity_rows(used)]
    places = {
        "experiment": list(case.experiments),
        "section": [str(name) for name in velocity["section"].unique()],
        "device": [str(name) for name in used["device"].unique() if str(name)],
        "patch": [patch.name for patch in case.plants.patches],
    }
    for kind, names in places.items():
        known: dict[str, str] = {}
        for name in names:
            if (other := known.setdefault(EffectIdentity("", (name,)).key, name)) != name:
                raise InputError(
                    f"{shown_path(case.source)}: expected {kind}s whose names differ in letters or digits, got "
                    f"{other!r} and {name!r}; rename one."
                )
    return places


def candidates_in_case(case: Case) -> dict[str, Candidate]:
    """The effects of a case as candidates.

    Returns
    -------
    dict of Candidate
        By the key of the effect; shapes that are calibrated are in the middle of their priors.
    """
    found = {}
    for key, entry in case.effects.items():
        effect = effect_of(case, key)
        shapes = {one.name: float(middle_value(case, entry.values.get(one.name, one.default))) for one in effect.shapes}
        if effect.each == "patch" and (index := int(shapes["patch"]) - 1) in range(len(case.plants.patches)):
            found[key] = patch_candidate(effect, index, case)
        elif "search" in effect.tags and key != effect.name:
            found[key] = place_candidate(effect, shapes)
        else:
            found[key] = Candidate(effect, entry.experiments or (), entry.sections, entry.devices)
    return found


def candidate_in_case(case: Case, name: str) -> Candidate:
    """The effect of a case that has this name as a candidate."""
    return next(one for one in candidates_in_case(case).values() if one.name == name)


def patch_candidate(effect: Effect, index: int, case: Case) -> Candidate:
    """An effect on one patch of a case, the first of which has the index 0."""
    return Candidate(effect, at=(case.plants.patches[index].name,), fixed=(("patch", index + 1.0),))


def place_candidate(
    effect: Effect, place: Mapping[str, float], scale: float | None = None, above_off: bool = False
) -> Candidate:
    """An unlisted object at a place.

    Parameters
    ----------
    effect : Effect
        That stands for it.
    place : mapping of float
        Its shapes, x and y [m] among them.
    scale : float, optional
        A plausible size [unit of the amplitude].
    above_off : bool
        Whether the amplitude may only lie above off.
    """
    at = EffectIdentity.at_place(effect.name, place["x"], place["y"]).target
    return Candidate(effect, at=at, fixed=tuple(place.items()), scale=scale, above_off=above_off)


def effect_entry(candidate: Candidate, amplitude: Value, shapes: Mapping[str, float]) -> EffectEntry:
    """The entry of a candidate in the `effects` of a case.

    Parameters
    ----------
    amplitude : float or str
        A number, or the name of a parameter; then the `free` shapes are parameters, too.
    shapes : mapping of float
        Values of shapes [unit of each], the default of others.
    """
    effect, shapes = candidate.effect, {**dict(candidate.fixed), **shapes}
    free = candidate.free if isinstance(amplitude, str) else {}
    given: dict[str, Value] = {one.name: float(shapes.get(one.name, one.default)) for one in effect.shapes}
    return EffectEntry(
        effect=effect.name if candidate.key != effect.name else None,
        values={effect.amplitude.name: amplitude, **given, **free},
        experiments=candidate.experiments or None,
        sections=candidate.sections,
        devices=candidate.devices,
    )


def with_effect(case: Case, candidate: Candidate, shapes: Mapping[str, float]) -> Case:
    """The case with one effect more, its amplitude and free shapes as parameters with priors.

    Parameters
    ----------
    shapes : mapping of float
        Values of its other shapes [unit of each], for those that are not fixed.
    """
    effects = {**case.effects, candidate.key: effect_entry(candidate, candidate.parameter, shapes)}
    parameters = {**case.parameters, **candidate.priors}
    return case.model_copy(update={"effects": effects, "parameters": parameters})


def cause_of(case: Case, candidate: Candidate, shapes: Mapping[str, float]) -> Cause:
    """The case with one effect more, all shapes numbers; the response to it is the fingerprint of the effect.

    Parameters
    ----------
    shapes : mapping of float
        Values of its shapes [unit of each], for those that are not fixed.
    """
    shapes_as_numbers = tuple(replace(one, sd=0.0) for one in candidate.effect.shapes)
    candidate = replace(candidate, effect=replace(candidate.effect, shapes=shapes_as_numbers))
    changed = with_effect(case, candidate, shapes)
    return Cause(changed, candidate.parameter, candidate.amplitude, candidate.experiments)


def start_amplitude(amplitude: Amplitude, gain: float) -> float:
    """off + |g|^(1/power) sign(g), kept START_OFF_ENDS plausible sizes off the ends of its support.

    Parameters
    ----------
    gain : float
        g [unit of the amplitude, to its power].

    Returns
    -------
    float
        [unit of the amplitude]
    """
    margin = START_OFF_ENDS * min(amplitude.scale, amplitude.high - amplitude.low)
    return float(np.clip(amplitude.at(gain), amplitude.low + margin, amplitude.high - margin))


def start_with(candidate: Candidate, z: Array, gain: float) -> Array:
    """z of the case with a candidate: that of the case, of the amplitude, of free shapes, of fitted shapes.

    Parameters
    ----------
    candidate : Candidate
        Free shapes start in the middle of their priors, fitted ones at their values.
    z : ndarray (p,)
    gain : float
        Of the amplitude.

    Returns
    -------
    ndarray (p + q,)
        q - 1 of them of shapes [standard deviations of the prior].
    """
    amplitude, at = start_amplitude(candidate.amplitude, gain), dict(candidate.fixed)
    middle = np.zeros(len(candidate.free) - len(candidate.fitted))
    of_fitted = [z_of(prior, at[name]) for name, prior in candidate.fitted]
    return np.concatenate([z, [z_of(candidate.priors[candidate.parameter], amplitude)], middle, of_fitted])


InstrumentKind = Literal["reading", "position", "probe", "gauge", "line"]


@dataclass(frozen=True)
class Instrument:
    """An instrument that could be off.

    Attributes
    ----------
    kind : {"reading", "position", "probe", "gauge", "line"}
    readings : tuple of int
        Indices of used stations.
    x, y : float
        Where it stood [m], NaN if everywhere.
    line : SurveyedLine or None
        A surveyed line of the bed, which has no readings.
    """

    kind: InstrumentKind
    readings: tuple[int, ...]
    x: float
    y: float
    line: SurveyedLine | None = None


def plausible_offset(kind: InstrumentKind) -> float:
    """Plausible size of an instrument's offset: a reading that went wrong, or an instrument that is off.

    Returns
    -------
    float
        Over the median standard error of its readings [-]; of a surveyed line [m].
    """
    of = constants()
    of_probe = {"position": of.probe_offset, "probe": of.probe_offset}
    return {"reading": of.reading_offset, "gauge": of.gauge_offset, "line": of.line_offset, **of_probe}[kind]


def median_errors(instruments: Sequence[Instrument], error: Array) -> Array:
    """What `plausible_offset` is a multiple of: the median standard error of the readings of each instrument.

    Parameters
    ----------
    instruments : sequence of Instrument
        k of them.
    error : ndarray (n,)
        Standard errors of the used stations [unit of each].

    Returns
    -------
    ndarray (k,)
        [unit of its readings]; of surveyed lines 1 m.
    """
    return np.array([1.0 if one.line else np.median(error[list(one.readings)]) for one in instruments])


def instruments_of(used: pd.DataFrame) -> dict[InstrumentKind, tuple[Instrument, ...]]:
    """Instruments of the used stations: every reading, and places or lines across that several readings share.

    A probe at one place in several experiments is a `position`, one at one y in several sections a `probe`. Readings of
    other kinds have offsets of their own.

    Parameters
    ----------
    used : DataFrame
        The used stations (n rows).

    Returns
    -------
    dict of tuple of Instrument
        By kind, without surveyed lines.
    """
    kinds = [kind_of(str(name)) for name in used["kind"]]
    places = used[["x", "y"]].to_numpy(float)

    def shared(kind: InstrumentKind, name: Mapping[int, Hashable]) -> tuple[Instrument, ...]:
        """Instruments of more than one reading, rows of the same name together."""
        together: dict[Hashable, list[int]] = {}
        for row, its in name.items():
            together.setdefault(its, []).append(row)
        several = [rows for rows in together.values() if len(rows) > 1]
        return tuple(Instrument(kind, tuple(rows), *places[rows[0]].tolist()) for rows in several)

    # To a millimetre: a place on the axis that was turned from a map lies at 0 or at -0.
    of = [(kind.name, round(float(x), 3), round(float(y), 3)) for kind, (x, y) in zip(kinds, places, strict=True)]
    probes = [row for row, kind in enumerate(kinds) if kind.velocity]
    positions = shared("position", {row: of[row] for row in probes})
    at_one_place = {one.readings for one in positions}
    across = shared("probe", {row: (of[row][0], of[row][2]) for row in probes})
    return {
        "reading": tuple(Instrument("reading", (row,), *place) for row, place in enumerate(places.tolist())),
        "position": positions,
        "probe": tuple(replace(one, x=float("nan")) for one in across if one.readings not in at_one_place),
        "gauge": shared("gauge", {row: of[row] for row, kind in enumerate(kinds) if kind.instrument == "gauge"}),
    }


def error_columns(instrument: Instrument, value: Array) -> Array:
    """[1, y] in its readings, else 0: an instrument that is off adds an offset and, as a probe, a share of the value y.

    Parameters
    ----------
    value : ndarray (n,)
        y, measured at the used stations [unit of each].

    Returns
    -------
    ndarray (n, 1 or 2)
    """
    offset = offset_columns((instrument,), value.size)
    factor = offset[:, 0] * value
    is_probe = instrument.kind in ("position", "probe")
    return np.column_stack([offset, factor]) if is_probe and factor.any() else offset


def offset_columns(instruments: tuple[Instrument, ...], stations: int) -> Array:
    """d value / d offset: 1 in the readings of an instrument, else 0.

    Parameters
    ----------
    stations : int
        n, the used ones.

    Returns
    -------
    ndarray (n, instrument)
        [-]
    """
    columns = np.zeros((stations, len(instruments)))
    for j, one in enumerate(instruments):
        columns[list(one.readings), j] = 1.0
    return columns
