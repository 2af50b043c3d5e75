"""What every effect must keep, tried in a small channel: floor, banks, plants under water and plants that stand out.

Both shipped effects and a user's own are judged here; `breaches` says in sentences what is wrong.
"""

from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.diagnosis.trial_channel import (
    PAIRS,
    Trial,
    answer,
    at_rest,
    dry,
    mirrored,
    moving_water,
    running_back,
    sizes,
    trial,
)
from vegglue.effects.active_effect import applied
from vegglue.effects.definition import Effect
from vegglue.effects.surroundings import PlantCells
from vegglue.errors import InputError
from vegglue.flow.closures import closures
from vegglue.flow.equations import faces, residual
from vegglue.flow.newton import newton
from vegglue.flow.problem import ALONG, Problem, crop, take
from vegglue.flow.starts import backwater

# Column of cells from which on water is made faster, and how many upstream of it may feel that.
CHANGED, FELT_AFAR = 20, 4


def breaches(effect: Effect, own: Path | None = None) -> list[str]:
    """What an effect breaks, in sentences; none for a good one."""
    declared = list(undeclared(effect))
    if declared:
        return declared
    tried = trial(effect, own)
    try:
        with np.errstate(divide="raise", over="raise", invalid="raise", under="ignore"):
            return list(_repeats(tried)) or [sentence for check in CHECKS for sentence in check(tried)]
    except InputError as error:
        return [str(error)]
    except (ArithmeticError, *OF_ITS_FUNCTION) as error:
        return [f"its function fails: {type(error).__name__}: {error}"]


OF_ITS_FUNCTION = (ValueError, TypeError, KeyError, IndexError, AttributeError, NameError)


def undeclared(effect: Effect) -> Iterator[str]:
    """Words and numbers of a declaration that are missing or contradict each other."""
    for word in ("name", "title", "equation", "source"):
        if not getattr(effect, word).strip():
            yield f"`{word}` is empty: say it"
    for parameter in effect.parameters:
        if not (parameter.unit and parameter.meaning):
            yield f"the parameter {parameter.name} has no unit or no meaning: say both (- for a pure number)"
    names = [parameter.name for parameter in effect.parameters]
    yield from (f"two parameters are called {name}" for name in sorted({one for one in names if names.count(one) > 1}))
    amplitude = effect.amplitude
    if not np.isfinite([amplitude.low, amplitude.high, amplitude.off, amplitude.scale]).all():
        yield "`low`, `high`, `off` and `scale` of the amplitude have to be finite: say what it may be at all"
        return
    if not (amplitude.low <= amplitude.off <= amplitude.high and amplitude.low < amplitude.high):
        yield f"off = {amplitude.off:g} lies outside {amplitude.low:g} to {amplitude.high:g}"
    if not (0.0 < amplitude.scale <= amplitude.high - amplitude.low) or amplitude.power < 1:
        yield "the amplitude needs a `scale` above 0 within its support, and a `power` of at least 1"
    for shape in effect.shapes:
        if not all(shape.low <= value <= shape.high for value in (shape.default, *shape.grid)):
            yield f"default or grid of {shape.name} lie outside {shape.low:g} to {shape.high:g}"


def _repeats(tried: Trial) -> Iterator[str]:
    """The same flow feels the same, whenever it is asked."""
    problem = tried.problem(*sizes(tried.effect))
    state = moving_water(problem)
    first, again = answer(tried, problem, state), answer(tried, problem, state)
    if not all(np.array_equal(a, b, equal_nan=True) for a, b in zip(first, again, strict=True)):
        yield "the same flow is answered otherwise when asked again: keep nothing between calls, use no random numbers"


def _off_is_off(tried: Trial) -> Iterator[str]:
    """Bit by bit, alone and beside a member where it is on."""
    off, on = tried.effect.amplitude.off, sizes(tried.effect)[1]
    for state_of, amplitudes in product((at_rest, moving_water, dry), ((off,), (on, off))):
        problem, without = tried.problem(*amplitudes), tried.without(len(amplitudes))
        found, wanted = (answer(tried, one, state_of(one)) for one in (problem, without))
        if not all(np.array_equal(a[..., -1], b[..., -1]) for a, b in zip(found, wanted, strict=True)):
            yield f"something changes although {tried.effect.amplitude.name} is off, in {_name(state_of)} water"
            return


def _acts(tried: Trial) -> Iterator[str]:
    """It does something, and answers to (amplitude - off)^power where it is small."""
    a = tried.effect.amplitude
    problem = tried.problem(a.off, a.off + 0.5 * a.small, a.off + a.small)
    told = answer(tried, problem, moving_water(problem))
    half, whole = (np.concatenate([(t[..., k] - t[..., 0]).ravel() for t in told]) for k in (1, 2))
    largest = np.abs(whole).max()
    if largest == 0.0:
        yield f"nothing changes with {a.name} in moving water: neither the flow nor a reading"
    elif np.abs(half * 2.0**a.power - whole).max() > 0.1 * largest + 1e-11:
        yield f"the answer to a small {a.name} is not of the power {a.power}: correct `power`, or avoid a jump at off"
    elif a.only_sign == 0 and "search" not in tried.effect.tags:
        yield from _turns(tried, whole)


def _turns(tried: Trial, above: Array) -> Iterator[str]:
    """An amplitude of both signs turns the answer round with its own; above: that to a small one above off. Water that
    enters at a place brings no momentum, and that which leaves takes its own: what is searched may turn otherwise.
    """
    a = tried.effect.amplitude
    problem = tried.problem(a.off, a.off - a.small)
    told = answer(tried, problem, moving_water(problem))
    below = np.concatenate([(t[..., 1] - t[..., 0]).ravel() for t in told])
    if np.abs(above + below).max() > 0.1 * np.abs(above).max() + 1e-11:
        yield f"{a.name} below off does not turn the answer round: give it one sign by `low` or `high`, or avoid a kink"


def _finite(tried: Trial) -> Iterator[str]:
    problem = tried.problem(*sizes(tried.effect))
    for state_of in (at_rest, moving_water, running_back, dry):
        if not all(np.isfinite(values).all() for values in answer(tried, problem, state_of(problem))):
            yield f"something is not finite in {_name(state_of)} water"


def _never_pushes(tried: Trial) -> Iterator[str]:
    """Friction rate, viscosity, phi and canopy height stay at or above 0; discharge and spread stay above. What stands
    for anything at a place may push: its friction rate may fall below 0.
    """
    problem, may_push = tried.problem(*sizes(tried.effect)), "search" in tried.effect.tags
    for state_of in (at_rest, moving_water, dry):
        state = state_of(problem)
        closed = closures(problem, state, faces(problem, state).cell)
        if (closed.rate < 0.0).any() and not may_push:
            yield f"the friction rate falls below 0 in {_name(state_of)} water: drag would push"
        if (closed.viscosity < 0.0).any():
            yield f"the viscosity falls below 0 in {_name(state_of)} water"
    for name, values in _standing(problem).items():
        if (values <= 0.0).any():
            yield f"{name} does not stay above 0"
    if any((inflow.discharge <= 0.0).any() or (inflow.spread <= 0.0).any() for inflow in problem.boundaries.inflows):
        yield "an inflow does not stay above 0 everywhere"


def _standing(problem: Problem) -> dict[str, Array]:
    """phi and canopy height of plants in 0.3 m of water from slow to fast."""
    speed = np.geomspace(0.001, 3.0, 40)[:, None] * np.ones(problem.members)
    one = np.ones_like(speed)
    plants = PlantCells(
        phi=2.0 * one,
        canopy_height=0.5 * one,
        depth=0.3 * one,
        speed=speed,
        front=one[:, :1],
        edge=-0.1 * one[:, :1],
        x=one[:, :1],
        y=0.0 * one[:, :1],
        patch=0.0 * one[:, :1],
    )
    return applied(problem.effects, "plants", plants, {"phi": plants.phi, "canopy_height": plants.canopy_height})


def _mirrors(tried: Trial) -> Iterator[str]:
    """A mirrored flow feels the mirrored effect."""
    if not tried.effect.mirrored:
        return
    problem = tried.problem(sizes(tried.effect)[1])
    state = moving_water(problem)
    rates, readings = answer(tried, problem, state)
    rates_there, readings_there = answer(tried, problem, mirrored(state))
    if not (_alike(mirrored(rates), rates_there) and _alike(readings[PAIRS], readings_there)):
        yield "a mirrored flow does not feel the mirrored effect: set mirrored=False and name in `equation` what turns"


def _parts(tried: Trial) -> Iterator[str]:
    """Some members, or some rows, of a problem answer as they do within it."""
    problem = tried.problem(*sizes(tried.effect))
    state, pick = moving_water(problem), np.array([3, 0, 1])
    whole = residual(problem, state)
    if not np.array_equal(residual(take(problem, pick), np.ascontiguousarray(state[..., pick])), whole[..., pick]):
        yield "members answer otherwise when others are left out: work on each member alone"
    rows = slice(2, problem.shape[1] - 2)
    cut = residual(crop(problem, rows.start, rows.stop), np.ascontiguousarray(state[:, :, rows]))
    if not _alike(cut[3:, :, 3:-3], whole[3:, :, 5:-5]):
        yield "rows answer otherwise when those beyond them are left out: look no further than the next cell"
    faster = state.copy()
    faster[CHANGED:, ALONG:] *= 1.1
    upstream = slice(CHANGED - FELT_AFAR)
    if not _alike(residual(problem, faster)[upstream], whole[upstream]):
        yield "water answers otherwise when that far downstream is faster: look no further than the next cell"


def _settles(tried: Trial) -> Iterator[str]:
    """A steady flow exists with a plausible size of it."""
    problem = tried.problem(sizes(tried.effect)[1])
    if not newton(problem, backwater(problem), 1e-8).converged[0]:
        yield f"no steady flow is found with {tried.effect.amplitude.name} = {sizes(tried.effect)[1]:g}"


Check = Callable[[Trial], Iterator[str]]
CHECKS: tuple[Check, ...] = (_finite, _off_is_off, _acts, _never_pushes, _mirrors, _parts, _settles)


def _alike(found: Array, wanted: Array) -> bool:
    return bool(np.abs(found - wanted).max() <= 1e-9 * (1e-3 + np.abs(wanted).max()))


def _name(state_of: Callable[[Problem], Array]) -> str:
    return {"at_rest": "still", "moving_water": "moving", "running_back": "backward", "dry": "no"}[state_of.__name__]
