"""Data with a hidden effect: measurements of a truth on another grid, with an answer that is sealed.

    y = f'(z, a) + e,   |(I - P_J) W (f(z, a) - f(z, off))| = snr

f' is the model on cells two thirds as long and wide, z lies off the centre of the prior, e are errors of a stated kind,
and the size a of the effect is chosen on the model's own grid at z: P_J projects onto what calibration could mimic, W
whitens errors of the data and of the grid. Where a is given, snr is what it comes to.
"""

import base64
import json
import re
import zlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.calibration.noise import Noise, noise_of, with_correlation, with_grid_error
from vegglue.case.messages import nearest
from vegglue.case.parameter_space import theta_at
from vegglue.case.schema import Case
from vegglue.diagnosis.child_config import candidate_named
from vegglue.engine.interface import Model, Point, linearise, responses
from vegglue.engine.model import coarser
from vegglue.errors import InputError
from vegglue.measurements.kinds import velocity_rows
from vegglue.screening import score_test
from vegglue.screening.candidates import Candidate, candidates_of, cause_of, working_of
from vegglue.site.gridded_site import build_site
from vegglue.twins import unlisted_objects

FINER = 1.5
# Distance of a true parameter from the centre of its prior [standard deviations].
OFF_CENTRE = (0.3, 1.0)
# An effect that must be larger than this many plausible sizes to be as visible as asked is not hidden.
LARGEST_SIZE = 4.0
# Steps and exactness [-] of finding the size.
SIZING_STEPS, SIZED = 6, 0.02
# Effects and places that are tried where chance decides.
DRAWN = 20
# Excess of a bad probe [standard errors].
BAD = 10.0
UNLISTED, BAD_PROBE, NOTHING_HIDDEN, ANY = "unlisted:", "bad_probe", "nothing", "?"


class VisibilityError(InputError):
    """At no plausible size would an effect be as visible as asked."""


@dataclass(frozen=True)
class Hidden:
    """One thing that is hidden. signal: its snr on the model's grid; station: row of a bad probe, else -1."""

    name: str
    amplitude: float
    shapes: dict[str, float]
    signal: float
    station: int = -1

    @property
    def listed(self) -> bool:
        return not self.name.startswith(UNLISTED) and self.name != BAD_PROBE


@dataclass(frozen=True)
class Answer:
    """What is true: everything hidden, the parameters, the errors."""

    hidden: tuple[Hidden, ...]
    parameters: dict[str, float]
    correlation: float
    scale: float
    seed: int


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


def errors_named(text: str) -> tuple[float, float]:
    """Correlation of neighbours, and true over stated errors: `white`, `ar1:0.5`, `understated:1.5`."""
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
    """z (p,): on either side of the centre of each prior, off it."""
    random = np.random.default_rng((seed, 1))
    return np.asarray(random.choice([-1.0, 1.0], parameters) * random.uniform(*OFF_CENTRE, parameters))


def twin_base(model: Model, z: Array) -> TwinBase:
    """Errors: InputError when no steady flow is found there."""
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
    cell = tuple(length / round(FINER * round(length / size)) for length, size in zip(lengths, grid.cell, strict=True))
    case: Case = model.case.model_copy(update={"grid": grid.model_copy(update={"cell": cell})})
    return replace(model, case=case, site=build_site(case))


def measured(ground: TwinBase, wanted: Sequence[str], snr: float, noise: str, seed: int) -> tuple[pd.DataFrame, Answer]:
    """Stations with the values measured in a truth that hides `wanted`, and the answer.

    wanted: `EFFECT`, `EFFECT=SIZE`, `unlisted:NAME`, `bad_probe`, `?` for any effect, `nothing`. Errors: InputError for
    what is unknown, or cannot be made as visible as asked.
    """
    random = np.random.default_rng((seed, 2))
    correlation, scale = errors_named(noise)
    errors = with_correlation(noise_of(ground.model.station), correlation, scale)
    with_grid = with_grid_error(errors, ground.difference)
    hidden: list[Hidden] = []
    case = ground.fine.case
    for text in wanted:
        name, _, size = text.partition("=")
        if name in (NOTHING_HIDDEN, BAD_PROBE):
            hidden += [_bad_probe(errors, size, random)] if name == BAD_PROBE else []
            continue
        candidate, one = _chosen(ground, with_grid, name, _size(text, size), snr, random)
        hidden.append(one)
        case = case_hiding(case, candidate, one)
    truth: Point | None = ground.there
    if case is not ground.fine.case:
        truth = linearise(replace(ground.fine, case=case), ground.there.z, ground.there)
    if truth is None:
        raise InputError(f"{case.name}: no steady flow was found with {', '.join(wanted)} hidden; take another --seed.")
    value = truth.prediction.copy()
    value[errors.rows] += errors.lower @ random.standard_normal(errors.rows.size)
    for one in hidden:
        if one.station >= 0:
            value[one.station] += one.amplitude * float(ground.model.station["standard_error"].iloc[one.station])
    theta = {key: float(values[0]) for key, values in theta_at(ground.model.case, ground.here.z).items()}
    return ground.model.station.assign(value=value), Answer(tuple(hidden), theta, correlation, scale, seed)


def case_hiding(case: Case, candidate: Candidate, hidden: Hidden) -> Case:
    """The case with the effect at work at its true size; one that stands in no list is read from its own file."""
    working = working_of(candidate, hidden.amplitude, hidden.shapes)
    return _knowing(case, hidden).model_copy(update={"effects": {**case.effects, candidate.key: working}})


def _knowing(case: Case, hidden: Hidden) -> Case:
    """The case with the file of the strangers, if what is hidden is one of them."""
    return case if hidden.listed else case.model_copy(update={"effect_file": Path(unlisted_objects.__file__)})


def _chosen(
    ground: TwinBase, errors: Noise, name: str, size: float | None, snr: float, random: np.random.Generator
) -> tuple[Candidate, Hidden]:
    """The candidate that `name` asks for, at its size; what `?` or chance decides is drawn until it can be seen."""
    for _ in range(DRAWN if name == ANY or name.startswith(UNLISTED) else 1):
        candidate = _any(ground.model, random) if name == ANY else candidate_of(ground.model, name)
        listed = not name.startswith(UNLISTED)
        shapes = _shapes(ground.model, candidate, listed, random)
        label = candidate.name if listed else UNLISTED + candidate.effect.name
        if size is not None:
            one = Hidden(label, size, shapes, 0.0)
            return candidate, replace(one, signal=_signal(ground, errors, candidate, one))
        found = _sized(ground, errors, candidate, Hidden(label, 0.0, shapes, 0.0), snr, random)
        if found is not None:
            return candidate, found
    raise VisibilityError(
        f"--hide {name}: at no plausible size would it be as visible as --snr {snr:g} in these data; ask for less, or "
        f"give its size, --hide {name}=SIZE."
    )


def candidate_of(model: Model, name: str) -> Candidate:
    """The effect that a name stands for, listed or `unlisted:NAME`. Errors: InputError."""
    if not name.startswith(UNLISTED):
        return candidate_named(model.case, model.station, name)
    known = {UNLISTED + effect.name: effect for effect in unlisted_objects.EFFECTS}
    if name not in known:
        raise InputError(f"--hide: `{name}` is unknown: {nearest(name, known)}")
    if model.case.effect_file is not None:
        raise InputError("--hide: expected a config without `effect_file` to hide something unlisted in; take it out.")
    return Candidate(known[name])


def _any(model: Model, random: np.random.Generator) -> Candidate:
    everything = candidates_of(model.case, model.station)
    return everything[int(random.integers(len(everything)))]


def _shapes(model: Model, candidate: Candidate, listed: bool, random: np.random.Generator) -> dict[str, float]:
    """Between the values that a search tries, not on them; something unlisted stands anywhere on the floor."""
    if listed:
        return {
            shape.name: float(random.uniform(min(shape.grid), max(shape.grid))) if shape.grid else shape.default
            for shape in candidate.effect.shapes
        }
    used = model.station[model.station["used"].to_numpy(bool)]
    low, high = model.case.grid.x
    x = random.uniform(low + 0.15 * (high - low), low + 0.8 * (high - low))
    velocity = used[velocity_rows(used)]["y"]
    middle, half = 0.5 * (velocity.max() + velocity.min()), 0.5 * (velocity.max() - velocity.min())
    radius = next(shape.default for shape in candidate.effect.shapes if shape.name == "radius")
    return {"x": float(x), "y": float(middle + 0.8 * half * random.uniform(-1.0, 1.0)), "radius": radius}


def _sized(
    ground: TwinBase, errors: Noise, candidate: Candidate, hidden: Hidden, snr: float, random: np.random.Generator
) -> Hidden | None:
    """The effect at the size that is as visible as asked, on the true flow and not to first order."""
    amplitude = candidate.effect.amplitude
    sides = [sign for sign, end in ((1.0, amplitude.high), (-1.0, amplitude.low)) if sign * (end - amplitude.off) > 0]
    sign, most = float(random.choice(sides)), LARGEST_SIZE * amplitude.scale
    size = _first_size(ground, errors, candidate, hidden, snr)
    if size > 2.0 * most:
        return None
    for _ in range(SIZING_STEPS):
        size = min(size, most)
        one = replace(hidden, amplitude=float(np.clip(amplitude.off + sign * size, amplitude.low, amplitude.high)))
        signal = _signal(ground, errors, candidate, one)
        if abs(signal / snr - 1.0) < SIZED:
            return replace(one, signal=signal)
        at_its_end = abs(one.amplitude - amplitude.off) < size or size == most
        if signal == 0.0 or (at_its_end and signal < snr):
            return None
        size *= min((snr / signal) ** (1.0 / amplitude.power), 3.0)
    return replace(one, signal=signal) if abs(signal / snr - 1.0) < 5.0 * SIZED else None


def _first_size(ground: TwinBase, errors: Noise, candidate: Candidate, hidden: Hidden, snr: float) -> float:
    """(snr / |S_perp|)^(1/power), to first order."""
    amplitude = candidate.effect.amplitude
    case = _knowing(ground.model.case, hidden)
    changed = cause_of(case, candidate, hidden.shapes)
    trace = responses(replace(ground.model, case=case), ground.here, [changed])
    return amplitude.size(snr / max(_visible(ground, errors, trace[:, 0]), 1e-300))


def _signal(ground: TwinBase, errors: Noise, candidate: Candidate, hidden: Hidden) -> float:
    """|(I - P_J) W (f(z, a) - f(z, off))| on the model's grid; 0 where the flow finds no rest."""
    case = case_hiding(ground.model.case, candidate, hidden)
    point = linearise(replace(ground.model, case=case), ground.here.z, ground.here)
    if point is None:
        return 0.0
    return _visible(ground, errors, point.prediction - ground.here.prediction)


def _visible(ground: TwinBase, errors: Noise, trace: Array) -> float:
    """|(I - P_J) W d| of a change d (station,) of the predictions."""
    white = errors.whiten(errors.used(trace[:, None]))
    slopes = errors.whiten(errors.used(ground.here.slope))
    return float(score_test.project(slopes, white[:, 0], np.zeros(slopes.shape[1]), white).length[0])


def _bad_probe(errors: Noise, size: str, random: np.random.Generator) -> Hidden:
    velocity = np.flatnonzero(np.isfinite(errors.apart).sum(axis=1) > 1)  # gauges have no neighbours
    station = int(errors.rows[random.choice(velocity)])
    excess = _size(f"{BAD_PROBE}={size}", size)
    return Hidden(BAD_PROBE, BAD * float(random.choice([-1.0, 1.0])) if excess is None else excess, {}, 0.0, station)


def _size(text: str, size: str) -> float | None:
    try:
        return float(size) if size else None
    except ValueError:
        raise InputError(f"--hide: expected EFFECT or EFFECT=NUMBER, got {text!r}; e.g. --hide wind=8.") from None


def sealed(answer: Answer) -> str:
    """The answer as text that nobody reads at a glance."""
    packed = base64.b64encode(zlib.compress(json.dumps(asdict(answer)).encode())).decode()
    return "\n".join(["# Sealed by `vegglue twin`; `vegglue reveal` opens it.", *re.findall(r".{1,76}", packed), ""])


def opened(path: Path) -> Answer:
    """Errors: InputError when there is no seal, or it is broken."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
        told = json.loads(zlib.decompress(base64.b64decode("".join(lines[1:]))))
        return Answer(**told | {"hidden": tuple(Hidden(**one) for one in told["hidden"])})
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}; `vegglue twin` writes it.") from None
    except (ValueError, KeyError, TypeError, zlib.error):
        raise InputError(f"{path}: the seal is broken, make it again by `vegglue twin`.") from None
