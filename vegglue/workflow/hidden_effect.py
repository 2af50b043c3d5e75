"""Synthetic measurements with a hidden effect: the truth on finer cells, and an effect of the wanted visibility.

    y = f_fine(z, a) + e,    |(I - P_J) W (f(z, a) - f(z, off))| = snr

f_fine is the model on cells two thirds as long and wide, z lies off the centre of the prior, and e are errors of a
stated kind. The size a is chosen on the grid of the model at z: P_J projects onto what calibration could mimic, and W
whitens errors of the data and of the grid. If a is given, snr is what it comes to.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.candidates import Candidate, candidates_of, cause_of, effect_entry
from vegglue.calibration.noise import Noise, noise_of, with_correlation, with_grid_error
from vegglue.case.grid import on_cells
from vegglue.case.gridded_site import build_site
from vegglue.case.messages import nearest
from vegglue.case.parameter_space import theta_at
from vegglue.case.schema import Case
from vegglue.diagnosis.child_config import candidate_named
from vegglue.effects.identity import EffectIdentity
from vegglue.engine.interface import Model, Point, linearise, responses
from vegglue.engine.model import coarser
from vegglue.errors import InputError
from vegglue.measurements.kinds import velocity_rows
from vegglue.workflow import unlisted_objects

UNLISTED, BAD_PROBE, NOTHING_HIDDEN, ANY = "unlisted:", "bad_probe", "nothing", "?"
# An effect that must be larger than this many plausible sizes to be as visible as wanted is not hidden.
LARGEST_SIZE = 4.0
# Steps and exactness [-] of finding the size.
SIZING_STEPS, SIZE_TOLERANCE = 6, 0.02
# Effects and places that are tried where chance decides.
DRAWN = 20
# Shares of the length of the grid between which something unlisted stands, and the share of the measured half width up
# to which it lies off the middle [-]. Chosen, not measured: nearer its inflow water has not found its shape; nearer
# the outlet the level is given, and little of a wake is left to be seen; at a bank half of it would be on land.
PLACED_ALONG, PLACED_ACROSS = (0.15, 0.8), 0.8
# Excess of a bad probe [standard errors].
BAD_PROBE_EXCESS = 10.0


@dataclass(frozen=True)
class Hidden:
    """One thing that is hidden.

    Attributes
    ----------
    amplitude : float
        [unit of its amplitude; a bad probe in standard errors]
    shapes : dict of float
        [unit of each]
    signal : float
        Its visibility on the model's grid [standard errors].
    station : int
        Row of a bad probe, else -1.
    """

    name: str
    amplitude: float
    shapes: dict[str, float]
    signal: float
    station: int = -1

    @property
    def listed(self) -> bool:
        """Whether it is an effect of the library: neither something unlisted nor a bad probe."""
        return not self.name.startswith(UNLISTED) and self.name != BAD_PROBE


@dataclass(frozen=True)
class Answer:
    """What is true.

    Attributes
    ----------
    parameters : dict of float
        [unit of each]
    correlation : float
        Of the errors of neighbours along a section [-].
    scale : float
        True over stated errors [-].
    """

    hidden: tuple[Hidden, ...]
    parameters: dict[str, float]
    correlation: float
    scale: float
    seed: int


class VisibilityError(InputError):
    """At no plausible size is an effect as visible as wanted."""


@dataclass(frozen=True)
class TwinBase:
    """A true place seen by the model and by the finer one that makes the data, nothing hidden yet.

    Attributes
    ----------
    here, there : Point
        Of either, at the same z.
    difference : ndarray (station,)
        Between the model and a coarser one, which a diagnosis takes for the error of its grid [unit of each station].
    """

    model: Model
    fine: Model
    here: Point
    there: Point
    difference: Array


def chosen_effect(
    base: TwinBase, errors: Noise, name: str, size: float | None, snr: float, random: np.random.Generator
) -> tuple[Candidate, Hidden]:
    """An effect to hide, at its size.

    Parameters
    ----------
    name : str
        An effect, `unlisted:NAME`, or `?`: then it is drawn until it can be seen.
    size : float or None
        [unit of its amplitude]; as visible as `snr` if None.
    snr : float
        [standard errors]
    random : numpy.random.Generator

    Raises
    ------
    VisibilityError
        If it is as visible as wanted at no plausible size.
    InputError
        If the effect is unknown, or cannot have that size.
    """
    everything = candidates_of(base.model.case, base.model.station)
    for _ in range(DRAWN if name == ANY or name.startswith(UNLISTED) else 1):
        candidate = everything[int(random.integers(len(everything)))] if name == ANY else candidate_of(base.model, name)
        amplitude = candidate.amplitude
        listed = not name.startswith(UNLISTED)
        if listed:  # between the values that a search tries, but for those of the place of a candidate
            shapes = candidate.drawn_shapes(random)
        else:  # anywhere on the floor
            used, (low, high) = base.model.station[base.model.station["used"]], base.model.case.grid.x
            first, last = (low + share * (high - low) for share in PLACED_ALONG)
            x = random.uniform(first, last)
            across = used[velocity_rows(used)]["y"]
            middle, half = 0.5 * (across.max() + across.min()), 0.5 * (across.max() - across.min())
            y = middle + PLACED_ACROSS * half * random.uniform(-1.0, 1.0)
            radius = next(shape.default for shape in candidate.effect.shapes if shape.name == "radius")
            shapes = {"x": float(x), "y": float(y), "radius": radius}
        label = candidate.name if listed else UNLISTED + candidate.effect.name
        if size is not None:
            if not amplitude.low <= size <= amplitude.high:
                bounds = f"{amplitude.low:g} to {amplitude.high:g} {amplitude.unit}".removesuffix(" -")
                raise InputError(f"--hide {candidate.name}: expected a size within {bounds}, got {size:g}.")
            one = Hidden(label, size, shapes, 0.0)
            return candidate, replace(one, signal=_signal(base, errors, candidate, one))
        found = _sized(base, errors, candidate, Hidden(label, 0.0, shapes, 0.0), snr, random)
        if found is not None:
            return candidate, found
    raise VisibilityError(
        f"--hide {name}: at no plausible size would it be as visible as --snr {snr:g} in these data; ask for less, or "
        f"give its size, --hide {name}=SIZE."
    )


def candidate_of(model: Model, name: str) -> Candidate:
    """The effect that a name stands for.

    `discharge_error` is the one of the only experiment, if there is one only, by the name that a diagnosis has for it.

    Parameters
    ----------
    name : str
        Of a listed effect, or `unlisted:NAME`.

    Raises
    ------
    InputError
        If it is unknown, or something unlisted and the case has effects of its own.
    """
    if not name.startswith(UNLISTED):
        try:
            named = candidate_named(model.case, model.station, name)
        except InputError as error:
            raise InputError(str(error).replace("--add:", "--hide:", 1)) from None
        told = [one for one in candidates_of(model.case, model.station) if one.effect.name == named.effect.name]
        return told[0] if len(told) == 1 and not EffectIdentity.parse(name).target else named
    known = {UNLISTED + effect.name: effect for effect in unlisted_objects.EFFECTS}
    if name not in known:
        raise InputError(f"--hide: `{name}` is unknown: {nearest(name, known)}")
    if model.case.effect_file is not None:
        raise InputError("--hide: expected a config without `effect_file` to hide something unlisted in; take it out.")
    return Candidate(known[name])


def case_hiding(case: Case, candidate: Candidate, hidden: Hidden) -> Case:
    """The case with the effect at work at its true size; one that stands in no list is read from its own file."""
    working = effect_entry(candidate, hidden.amplitude, hidden.shapes)
    return with_unlisted_objects(case, hidden).model_copy(update={"effects": {**case.effects, candidate.key: working}})


def bad_probe(errors: Noise, size: str, random: np.random.Generator) -> Hidden:
    """A probe of velocity that reads wrong, drawn from those with a neighbour in their section.

    Parameters
    ----------
    size : str
        Standard errors, BAD_PROBE_EXCESS up or down if empty.
    random : numpy.random.Generator

    Raises
    ------
    InputError
        If no section has two velocities, or the size is no number.
    """
    velocity = np.flatnonzero(np.isfinite(errors.separation).sum(axis=1) > 1)  # gauges have no neighbours
    if not velocity.size:
        raise InputError(f"--hide {BAD_PROBE} expected a section with two velocities or more, got none; hide another.")
    station = int(errors.rows[random.choice(velocity)])
    excess = size_given(f"{BAD_PROBE}={size}", size)
    return Hidden(
        BAD_PROBE, BAD_PROBE_EXCESS * float(random.choice([-1.0, 1.0])) if excess is None else excess, {}, 0.0, station
    )


def size_given(text: str, size: str) -> float | None:
    """The number behind `EFFECT=`.

    Returns
    -------
    float or None
        [unit of its amplitude]; None if there is none.

    Raises
    ------
    InputError
        If it is no number.
    """
    try:
        return float(size) if size else None
    except ValueError:
        raise InputError(f"--hide: expected EFFECT or EFFECT=NUMBER, got {text!r}; e.g. --hide wind=8.") from None


def with_unlisted_objects(case: Case, hidden: Hidden) -> Case:
    """The case with the file of the unlisted objects, if what is hidden is one of them."""
    return case if hidden.listed else case.model_copy(update={"effect_file": Path(unlisted_objects.__file__)})


def _sized(
    base: TwinBase, errors: Noise, candidate: Candidate, hidden: Hidden, snr: float, random: np.random.Generator
) -> Hidden | None:
    """The effect at the size that is as visible as wanted, on the true flow and not to first order."""
    amplitude = candidate.effect.amplitude
    sides = [sign for sign, end in ((1.0, amplitude.high), (-1.0, amplitude.low)) if sign * (end - amplitude.off) > 0]
    sign, most = float(random.choice(sides)), LARGEST_SIZE * amplitude.scale
    # (snr / |S_perp|)^(1/power), to first order.
    case = with_unlisted_objects(base.model.case, hidden)
    trace = responses(replace(base.model, case=case), base.here, [cause_of(case, candidate, hidden.shapes)])
    size = amplitude.size(snr / max(visible_length(base, errors, trace[:, 0]), 1e-300))
    if size > 2.0 * most:
        return None
    for _ in range(SIZING_STEPS):
        size = min(size, most)
        one = replace(hidden, amplitude=float(np.clip(amplitude.off + sign * size, amplitude.low, amplitude.high)))
        signal = _signal(base, errors, candidate, one)
        if abs(signal / snr - 1.0) < SIZE_TOLERANCE:
            return replace(one, signal=signal)
        at_its_end = abs(one.amplitude - amplitude.off) < size or size == most
        if signal == 0.0 or (at_its_end and signal < snr):
            return None
        size *= min((snr / signal) ** (1.0 / amplitude.power), 3.0)
    return replace(one, signal=signal) if abs(signal / snr - 1.0) < 5.0 * SIZE_TOLERANCE else None


def _signal(base: TwinBase, errors: Noise, candidate: Candidate, hidden: Hidden) -> float:
    """|(I - P_J) W (f(z, a) - f(z, off))| on the model's grid; 0 where the flow finds no rest."""
    case = case_hiding(base.model.case, candidate, hidden)
    point = linearise(replace(base.model, case=case), base.here.z, base.here)
    if point is None:
        return 0.0
    return visible_length(base, errors, point.prediction - base.here.prediction)


def visible_length(base: TwinBase, errors: Noise, trace: Array) -> float:
    """|(I - P_J) W d| of a change d of the predictions.

    Parameters
    ----------
    trace : ndarray (station,)
        d [unit of each station].

    Returns
    -------
    float
        [standard errors]
    """
    white = errors.whiten(errors.used(trace[:, None]))
    slopes = errors.whiten(errors.used(base.here.slope))
    return float(score_test.project(slopes, white[:, 0], np.zeros(slopes.shape[1]), white).length[0])


# Cells of the truth are so much shorter and narrower than those of the model [-].
FINER = 1.5
# Distance of a true parameter from the centre of its prior [standard deviations].
OFF_CENTRE = (0.3, 1.0)


def errors_named(text: str) -> tuple[float, float]:
    """The errors that `--noise` names.

    Parameters
    ----------
    text : str
        `white`, `ar1:0.5`, `understated:1.5`.

    Returns
    -------
    float, float
        Correlation of neighbours, and true over stated errors [-].

    Raises
    ------
    InputError
        If it is none of these.
    """
    kind, _, number = text.partition(":")
    try:
        value = float(number) if number else 0.0
    except ValueError:
        value = -1.0
    if kind == "white" and not number:
        return 0.0, 1.0
    if kind == "ar1" and 0.0 < value < 1.0:
        return value, 1.0
    if kind == "understated" and value >= 1.0:
        return 0.0, value
    raise InputError(f"--noise: expected white, ar1:0.5 (below 1) or understated:1.5 (1 or more), got {text!r}.")


def true_place(parameters: int, seed: int) -> Array:
    """A true place, on either side of the centre of each prior by OFF_CENTRE.

    Parameters
    ----------
    parameters : int
        p.

    Returns
    -------
    ndarray (p,)
        z [standard deviations of the prior].
    """
    random = np.random.default_rng((seed, 1))
    return np.asarray(random.choice([-1.0, 1.0], parameters) * random.uniform(*OFF_CENTRE, parameters))


def twin_base(model: Model, z: Array) -> TwinBase:
    """A model and a finer one at a true place.

    Parameters
    ----------
    z : ndarray (p,)
        [standard deviations of the prior]

    Raises
    ------
    InputError
        If no steady flow is found there.
    """
    fine = finer(model)
    here, there = linearise(model, z), linearise(fine, z)
    if here is None or there is None:
        raise InputError(f"{model.case.name}: no steady flow was found at the true parameters; take another --seed.")
    coarse = coarser(model)
    on_coarse = None if coarse is None else linearise(coarse, z)
    difference = here.prediction - (here if on_coarse is None else on_coarse).prediction
    return TwinBase(model, fine, here, there, difference)


def finer(model: Model) -> Model:
    """The model on cells two thirds as long and wide, of which every third edge is an edge of the model's as well."""
    grid = model.case.grid
    lengths = (grid.x[1] - grid.x[0], grid.y[1] - grid.y[0])
    dx, dy = (length / round(FINER * round(length / size)) for length, size in zip(lengths, grid.cell, strict=True))
    case = on_cells(model.case, (dx, dy))
    return replace(model, case=case, site=build_site(case))


def measured_twin(
    base: TwinBase, wanted: Sequence[str], snr: float, noise: str, seed: int
) -> tuple[pd.DataFrame, Answer]:
    """Stations with the values measured in a truth that hides something, and the answer.

    Parameters
    ----------
    wanted : sequence of str
        `EFFECT`, `EFFECT=SIZE`, `unlisted:NAME`, `bad_probe`, `?` for any effect, `nothing`.
    snr : float
        Visibility of what has no size [standard errors].
    noise : str
        See `errors_named`.

    Raises
    ------
    InputError
        For what is unknown, or cannot be made as visible as wanted; if no flow is found with it.
    """
    random = np.random.default_rng((seed, 2))
    correlation, scale = errors_named(noise)
    errors = with_correlation(noise_of(base.model.station), correlation, scale)
    with_grid = with_grid_error(errors, base.difference)
    hidden: list[Hidden] = []
    case = base.fine.case
    for text in wanted:
        name, _, size = text.partition("=")
        if name in (NOTHING_HIDDEN, BAD_PROBE):
            hidden += [bad_probe(errors, size, random)] if name == BAD_PROBE else []
            continue
        candidate, one = chosen_effect(base, with_grid, name, size_given(text, size), snr, random)
        hidden.append(one)
        case = case_hiding(case, candidate, one)
    truth: Point | None = base.there
    if case is not base.fine.case:
        truth = linearise(replace(base.fine, case=case), base.there.z, base.there)
    if truth is None:
        raise InputError(f"{case.name}: no steady flow was found with {', '.join(wanted)} hidden; take another --seed.")
    value = truth.prediction.copy()
    value[errors.rows] += errors.lower @ random.standard_normal(errors.rows.size)
    for one in hidden:
        if one.station >= 0:
            value[one.station] += one.amplitude * float(base.model.station["standard_error"].iloc[one.station])
    theta = {key: float(values[0]) for key, values in theta_at(base.model.case, base.here.z).items()}
    return base.model.station.assign(value=value), Answer(tuple(hidden), theta, correlation, scale, seed)
