"""What a twin hides: an effect chosen by name or by chance, at the size that is as visible as asked.

    |(I - P_J) W (f(z, a) - f(z, off))| = snr

The size a is chosen on the model's own grid at the true place z: P_J projects onto what calibration could mimic, W
whitens errors of the data and of the grid. Where a is given, snr is what it comes to.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.candidates import Candidate, candidates_of, cause_of, effect_entry
from vegglue.calibration.noise import Noise
from vegglue.case.messages import nearest
from vegglue.case.schema import Case
from vegglue.diagnosis.child_config import candidate_named
from vegglue.effects.identity import EffectIdentity
from vegglue.engine.interface import Model, Point, linearise, responses
from vegglue.errors import InputError
from vegglue.measurements.kinds import velocity_rows
from vegglue.workflow import unlisted_objects
from vegglue.workflow.sealed_answer import ANY, BAD_PROBE, UNLISTED, Hidden

# An effect that must be larger than this many plausible sizes to be as visible as asked is not hidden.
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


class VisibilityError(InputError):
    """At no plausible size would an effect be as visible as asked."""


@dataclass(frozen=True)
class TwinBase:
    """A true place z (p,) seen by the model and by the finer one that makes the data, nothing hidden yet.

    difference: between the model and a coarser one (station,), which a diagnosis takes for the error of its grid.
    """

    model: Model
    fine: Model
    here: Point
    there: Point
    difference: Array


def chosen_effect(
    base: TwinBase, errors: Noise, name: str, size: float | None, snr: float, random: np.random.Generator
) -> tuple[Candidate, Hidden]:
    """The candidate that `name` asks for, at its size; what `?` or chance decides is drawn until it can be seen."""
    for _ in range(DRAWN if name == ANY or name.startswith(UNLISTED) else 1):
        candidate = _any(base.model, random) if name == ANY else candidate_of(base.model, name)
        listed = not name.startswith(UNLISTED)
        shapes = _shapes(base.model, candidate, listed, random)
        label = candidate.name if listed else UNLISTED + candidate.effect.name
        if size is not None:
            _refuse_beyond_support(candidate, size)
            one = Hidden(label, size, shapes, 0.0)
            return candidate, replace(one, signal=_signal(base, errors, candidate, one))
        found = _sized(base, errors, candidate, Hidden(label, 0.0, shapes, 0.0), snr, random)
        if found is not None:
            return candidate, found
    raise VisibilityError(
        f"--hide {name}: at no plausible size would it be as visible as --snr {snr:g} in these data; ask for less, or "
        f"give its size, --hide {name}=SIZE."
    )


def _refuse_beyond_support(candidate: Candidate, size: float) -> None:
    """Errors: InputError for a size that the effect cannot have."""
    amplitude = candidate.amplitude
    if not amplitude.low <= size <= amplitude.high:
        bounds = f"{amplitude.low:g} to {amplitude.high:g} {amplitude.unit}".removesuffix(" -")
        raise InputError(f"--hide {candidate.name}: expected a size within {bounds}, got {size:g}; give another.")


def candidate_of(model: Model, name: str) -> Candidate:
    """The effect that a name stands for, listed or `unlisted:NAME`. Errors: InputError.

    `discharge_error` is the one of the only experiment, if there is one only, by the name that a diagnosis has for it.
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
    """A probe of velocity that reads wrong, by `size` standard errors if that is given.

    Errors: InputError where no section has two velocities.
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
    """The number behind `EFFECT=` [unit of its amplitude], None if there is none. Errors: InputError."""
    try:
        return float(size) if size else None
    except ValueError:
        raise InputError(f"--hide: expected EFFECT or EFFECT=NUMBER, got {text!r}; e.g. --hide wind=8.") from None


def with_unlisted_objects(case: Case, hidden: Hidden) -> Case:
    """The case with the file of the unlisted objects, if what is hidden is one of them."""
    return case if hidden.listed else case.model_copy(update={"effect_file": Path(unlisted_objects.__file__)})


def _any(model: Model, random: np.random.Generator) -> Candidate:
    everything = candidates_of(model.case, model.station)
    return everything[int(random.integers(len(everything)))]


def _shapes(model: Model, candidate: Candidate, listed: bool, random: np.random.Generator) -> dict[str, float]:
    """Between the values that a search tries, not on them, but for those that say where a candidate acts; something
    in no list stands anywhere on the floor.
    """
    if listed:
        drawn = {
            shape.name: float(random.uniform(min(shape.grid), max(shape.grid))) if shape.grid else shape.default
            for shape in candidate.effect.shapes
        }
        return drawn | dict(candidate.fixed)
    used = model.station[model.station["used"].to_numpy(bool)]
    low, high = model.case.grid.x
    first, last = (low + share * (high - low) for share in PLACED_ALONG)
    x = random.uniform(first, last)
    velocity = used[velocity_rows(used)]["y"]
    middle, half = 0.5 * (velocity.max() + velocity.min()), 0.5 * (velocity.max() - velocity.min())
    radius = next(shape.default for shape in candidate.effect.shapes if shape.name == "radius")
    return {"x": float(x), "y": float(middle + PLACED_ACROSS * half * random.uniform(-1.0, 1.0)), "radius": radius}


def _sized(
    base: TwinBase, errors: Noise, candidate: Candidate, hidden: Hidden, snr: float, random: np.random.Generator
) -> Hidden | None:
    """The effect at the size that is as visible as asked, on the true flow and not to first order."""
    amplitude = candidate.effect.amplitude
    sides = [sign for sign, end in ((1.0, amplitude.high), (-1.0, amplitude.low)) if sign * (end - amplitude.off) > 0]
    sign, most = float(random.choice(sides)), LARGEST_SIZE * amplitude.scale
    size = _first_size(base, errors, candidate, hidden, snr)
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


def _first_size(base: TwinBase, errors: Noise, candidate: Candidate, hidden: Hidden, snr: float) -> float:
    """(snr / |S_perp|)^(1/power), to first order."""
    amplitude = candidate.effect.amplitude
    case = with_unlisted_objects(base.model.case, hidden)
    changed = cause_of(case, candidate, hidden.shapes)
    trace = responses(replace(base.model, case=case), base.here, [changed])
    return amplitude.size(snr / max(visible_length(base, errors, trace[:, 0]), 1e-300))


def _signal(base: TwinBase, errors: Noise, candidate: Candidate, hidden: Hidden) -> float:
    """|(I - P_J) W (f(z, a) - f(z, off))| on the model's grid; 0 where the flow finds no rest."""
    case = case_hiding(base.model.case, candidate, hidden)
    point = linearise(replace(base.model, case=case), base.here.z, base.here)
    if point is None:
        return 0.0
    return visible_length(base, errors, point.prediction - base.here.prediction)


def visible_length(base: TwinBase, errors: Noise, trace: Array) -> float:
    """|(I - P_J) W d| of a change d (station,) of the predictions."""
    white = errors.whiten(errors.used(trace[:, None]))
    slopes = errors.whiten(errors.used(base.here.slope))
    return float(score_test.project(slopes, white[:, 0], np.zeros(slopes.shape[1]), white).length[0])
