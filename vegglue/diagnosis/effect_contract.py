"""What every effect must keep, tried in a small channel: floor, banks, plants under water and plants that stand out.

Shipped effects and a user's own are judged alike. `breaches` returns what an effect breaks as values, whose words stand
in `wording/templates/checks.j2`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.channel_geometry import site_scales
from vegglue.case.gridded_site import Site, build_site
from vegglue.case.schema import Case
from vegglue.effects.active_effect import applied
from vegglue.effects.definition import Effect
from vegglue.effects.scales import at_site
from vegglue.effects.surroundings import PlantCells
from vegglue.errors import InputError
from vegglue.flow.closures import closures
from vegglue.flow.equations import faces, residual
from vegglue.flow.newton import newton
from vegglue.flow.problem import ACROSS, ALONG, LEVEL, Problem, crop, take
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.sensor import predictions_at_sensors
from vegglue.flow.starts import backwater

# Column of cells from which on water is made faster, and how many upstream of it may feel that.
CHANGED, FELT_AFAR = 20, 4
# What a faulty function of an effect may raise.
OF_ITS_FUNCTION = (ValueError, TypeError, KeyError, IndexError, AttributeError, NameError)
AMPLITUDE = "amplitude"
LEVEL_OF_OUTLET = 0.7
CHANNEL: dict[str, Any] = {
    "name": "contract",
    "grid": {"x": (0.0, 20.0), "y": (-4.0, 4.0), "cell": (0.5, 0.5)},
    "bed": [{"trapezoid": {"axis": 0.0, "bottom_width": 4.0, "bank_slope": 0.6, "bed_slope": 0.001, "level": 0.02}}],
    "friction": {
        "classes": {"floor": {"law": "manning", "n": 0.04}, "bank": {"law": "keulegan", "k_s": 0.5}},
        "default": "floor",
        "zones": [{"class": "bank", "beyond_slope_break": 0.2}],
    },
    "plants": {
        "stands": {"low": {"phi": 3.75, "canopy_height": 0.4}, "high": {"phi": 1.6, "canopy_height": 1.2}},
        "patches": [
            {"name": "low", "stand": "low", "x": (6.0, 9.0), "y": (-1.0, 1.0), "stems": 0.8},
            {"name": "high", "stand": "high", "x": (13.0, 15.0), "y": (-1.0, 1.0), "stems": 1.25},
        ],
    },
    "inflows": {"main": {"side": "west"}},
    "experiments": {"flow": {"discharge": {"main": 1.2}, "level": LEVEL_OF_OUTLET}},
    "parameters": {AMPLITUDE: {"distribution": "uniform", "low": 0.0, "high": 1.0, "unit": "-"}},
}
# Stations stand in pairs that change places in the mirror.
TRIAL_STATIONS = pd.DataFrame(
    [
        {"experiment": "flow", "kind": kind, "section": section, "x": x, "y": y, "device": device}
        for kind, section, device in (("velocity", "A", "probe"), ("level", "gauges", "gauge"))
        for x in (4.1, 8.0, 11.3)
        for y in (-1.9, -0.4, 0.4, 1.9)
    ]
)
PAIRS = np.arange(len(TRIAL_STATIONS)).reshape(-1, 4)[:, ::-1].ravel()


def channel_at(scale: float) -> dict[str, Any]:
    """CHANNEL with all lengths `scale` times as large, by Froude's law: Q ~ l^2.5, nu ~ l^1.5, n ~ l^(1/6)."""
    (bed,), friction, plants = CHANNEL["bed"], CHANNEL["friction"], CHANNEL["plants"]

    def longer(given: Mapping[str, Any], *keys: str) -> dict[str, Any]:
        times = {key: np.multiply(given[key], scale).tolist() for key in keys}
        return {**given, **times}

    classes = {
        "floor": {"law": "manning", "n": 0.04 * scale ** (1 / 6)},
        "bank": {"law": "keulegan", "k_s": 0.5 * scale},
    }
    patches = [longer(one, "x", "y") for one in plants["patches"]]
    stands = {name: longer(one, "canopy_height") for name, one in plants["stands"].items()}
    return CHANNEL | {
        "grid": longer(CHANNEL["grid"], "x", "y", "cell"),
        "bed": [{"trapezoid": longer(bed["trapezoid"], "axis", "bottom_width", "level")}],
        "friction": {**friction, "classes": classes},
        "plants": {"stands": stands, "patches": patches},
        "experiments": {"flow": {"discharge": {"main": 1.2 * scale**2.5}, "level": LEVEL_OF_OUTLET * scale}},
        "eddy_viscosity": 0.01 * scale**1.5,
        "numerics": {"film_depth": 0.01 * min(scale, 1.0)},
    }


class ContractRule(Enum):
    """What every effect must keep. The comment gives what a Breach holds besides."""

    WORD_MISSING = "word-missing"  # name of the word
    PARAMETER_UNDECLARED = "parameter-undeclared"  # name
    PARAMETER_TWICE = "parameter-twice"  # name
    AMPLITUDE_FINITE = "amplitude-finite"
    OFF_WITHIN_SUPPORT = "off-within-support"  # values: off, low, high
    SCALE_WITHIN_SUPPORT = "scale-within-support"
    SHAPE_WITHIN_SUPPORT = "shape-within-support"  # name; values: low, high
    FUNCTION_RUNS = "function-runs"  # name: the error
    REPEATS = "repeats"
    FINITE = "finite"  # water
    OFF_IS_OFF = "off-is-off"  # name of the amplitude; water
    ACTS = "acts"  # name of the amplitude
    POWER = "power"  # name of the amplitude; values: power
    TURNS = "turns"  # name of the amplitude
    DRAG_POSITIVE = "drag-positive"  # water
    VISCOSITY_POSITIVE = "viscosity-positive"  # water
    PLANTS_POSITIVE = "plants-positive"  # name
    INFLOW_POSITIVE = "inflow-positive"
    MIRRORED = "mirrored"
    MEMBERS_ALONE = "members-alone"
    ROWS_ALONE = "rows-alone"
    DOWNSTREAM_ALONE = "downstream-alone"
    SETTLES = "settles"  # name of the amplitude; values: amplitude


@dataclass(frozen=True)
class Breach:
    """A rule that an effect breaks.

    Attributes
    ----------
    rule : ContractRule
        Which also states what the others hold.
    water : {"still", "moving", "backward", "no", ""}
    """

    rule: ContractRule
    name: str = ""
    values: tuple[float, ...] = ()
    water: str = ""


@dataclass(frozen=True)
class Trial:
    """An effect in the channel: the problem of any amplitudes (m,), and without it."""

    effect: Effect
    case: Case
    site: Site
    stations: pd.DataFrame

    def problem(self, *amplitude: float) -> Problem:
        return build_problem(self.case, self.site, "flow", {AMPLITUDE: np.array(amplitude)})

    def without(self, members: int) -> Problem:
        bare = self.case.model_copy(update={"effects": {}})
        return build_problem(bare, self.site, "flow", {AMPLITUDE: np.zeros(members)})


def trial(effect: Effect, own: Path | None = None, scale: float = 1.0) -> Trial:
    """The channel of this file with an effect in it.

    Parameters
    ----------
    own : Path, optional
        The file of the effect, if it is a user's.
    scale : float
        Of all lengths of the channel [-].
    """
    works = {effect.name: {"values": {effect.amplitude.name: AMPLITUDE}}}
    case = Case.model_validate(channel_at(scale) | {"source": Path("contract"), "effect_file": own, "effects": works})
    site = build_site(case)
    stations = TRIAL_STATIONS.assign(x=scale * TRIAL_STATIONS["x"], y=scale * TRIAL_STATIONS["y"])
    return Trial(at_site(effect, site_scales(case, site)), case, site, stations)


def at_rest(problem: Problem) -> Array:
    """Still water at the level of the outlet, for every member."""
    state = np.zeros((problem.shape[0], 3, problem.shape[1], problem.members))
    state[:, LEVEL] = problem.boundaries.outlet_level
    return state


def dry(problem: Problem) -> Array:
    """No water at all."""
    state = at_rest(problem)
    state[:, LEVEL] = problem.bed.min() - 1.0
    return state


def moving_water(problem: Problem) -> Array:
    """Water in motion, not steady, not symmetric: every derivative differs from 0, and the banks are partly dry; of the
    same Froude number whatever the scale of the channel.
    """
    nx, ny = problem.shape
    scale = problem.dx / CHANNEL["grid"]["cell"][0]
    x, y = np.linspace(0.0, 1.0, nx)[:, None, None], np.linspace(-1.0, 1.0, ny)[None, :, None]
    state = at_rest(problem)
    depth = scale**-0.5 * np.clip(LEVEL_OF_OUTLET * scale - problem.bed, 0.0, None)[..., None]
    state[:, LEVEL] += scale * (0.02 * (1.0 - x) + 0.002 * np.sin(7.0 * x + 2.0 * y))
    state[:, ALONG] = depth * (0.8 + 0.2 * np.sin(9.0 * x) + 0.15 * y - 0.3 * y**2)
    state[:, ACROSS] = depth * 0.1 * np.cos(8.0 * x + y)
    state[:, ACROSS, 0] = 0.0
    return state


def running_back(problem: Problem) -> Array:
    """Water in motion the other way, as in an eddy."""
    state = moving_water(problem)
    state[:, ALONG] *= -1.0
    return state


def mirrored(state: Array) -> Array:
    """The state seen in a mirror along the axis."""
    other = np.zeros_like(state)
    other[:, LEVEL], other[:, ALONG] = state[:, LEVEL, ::-1], state[:, ALONG, ::-1]
    other[:, ACROSS, 1:] = -state[:, ACROSS, :0:-1]
    return other


def answer(tried: Trial, problem: Problem, state: Array) -> tuple[Array, Array]:
    """All that an effect can change.

    Parameters
    ----------
    problem : Problem
        Of m members.
    state : ndarray (nx, 3, ny, m)
        Level and fluxes.

    Returns
    -------
    residual : ndarray (nx, 3, ny, m)
    readings : ndarray (station, m)
        [m/s or m]
    """
    return residual(problem, state), predictions_at_sensors(problem, state, tried.site.grid, tried.stations).T


def sizes(effect: Effect) -> tuple[float, ...]:
    """Amplitudes worth trying: off, a plausible one to each side as far as there is room, and both ends."""
    a = effect.amplitude
    return tuple(np.clip([a.off, a.off + a.scale, a.off - a.scale, a.low, a.high], a.low, a.high).tolist())


WATERS = {"still": at_rest, "moving": moving_water, "backward": running_back, "no": dry}


def breaches(effect: Effect, own: Path | None = None, scale: float = 1.0) -> list[Breach]:
    """What an effect breaks of the contract, in the channel of this file.

    Parameters
    ----------
    own : Path, optional
        The file of the effect, if it is a user's.
    scale : float
        Of all lengths of the channel [-].

    Returns
    -------
    list of Breach
        Empty for a good one; what its function raises is a breach, too.
    """
    declared = list(undeclared(effect))
    if declared:
        return declared
    tried = trial(effect, own, scale)
    try:
        with np.errstate(divide="raise", over="raise", invalid="raise", under="ignore"):
            problem = tried.problem(*sizes(effect))
            first, again = (answer(tried, problem, moving_water(problem)) for _ in range(2))
            if not all(np.array_equal(a, b, equal_nan=True) for a, b in zip(first, again, strict=True)):
                return [Breach(ContractRule.REPEATS)]
            return [breach for check in CHECKS for breach in check(tried)]
    except InputError as error:
        return [Breach(ContractRule.FUNCTION_RUNS, str(error))]
    except (ArithmeticError, *OF_ITS_FUNCTION) as error:
        return [Breach(ContractRule.FUNCTION_RUNS, f"{type(error).__name__}: {error}")]


def undeclared(effect: Effect) -> Iterator[Breach]:
    """Words and numbers of a declaration that are missing or contradict each other."""
    for word in ("name", "title", "equation", "source"):
        if not getattr(effect, word).strip():
            yield Breach(ContractRule.WORD_MISSING, word)
    for parameter in effect.parameters:
        if not (parameter.unit and parameter.meaning):
            yield Breach(ContractRule.PARAMETER_UNDECLARED, parameter.name)
    names = [parameter.name for parameter in effect.parameters]
    for name in sorted({one for one in names if names.count(one) > 1}):
        yield Breach(ContractRule.PARAMETER_TWICE, name)
    amplitude = effect.amplitude
    if not np.isfinite([amplitude.low, amplitude.high, amplitude.off, amplitude.scale]).all():
        yield Breach(ContractRule.AMPLITUDE_FINITE)
        return
    if not (amplitude.low <= amplitude.off <= amplitude.high and amplitude.low < amplitude.high):
        yield Breach(ContractRule.OFF_WITHIN_SUPPORT, amplitude.name, (amplitude.off, amplitude.low, amplitude.high))
    if not (0.0 < amplitude.scale <= amplitude.high - amplitude.low) or amplitude.power < 1:
        yield Breach(ContractRule.SCALE_WITHIN_SUPPORT)
    for shape in effect.shapes:
        if not all(shape.low <= value <= shape.high for value in (shape.default, *shape.grid)):
            yield Breach(ContractRule.SHAPE_WITHIN_SUPPORT, shape.name, (shape.low, shape.high))


def _off_is_off(tried: Trial) -> Iterator[Breach]:
    """Bit by bit, alone and beside a member where it is on."""
    off, on = tried.effect.amplitude.off, sizes(tried.effect)[1]
    for water, amplitudes in product(("still", "moving", "no"), ((off,), (on, off))):
        problem, without = tried.problem(*amplitudes), tried.without(len(amplitudes))
        found, wanted = (answer(tried, one, WATERS[water](one)) for one in (problem, without))
        if not all(np.array_equal(a[..., -1], b[..., -1]) for a, b in zip(found, wanted, strict=True)):
            yield Breach(ContractRule.OFF_IS_OFF, tried.effect.amplitude.name, water=water)
            return


def _acts(tried: Trial) -> Iterator[Breach]:
    """It acts as (amplitude - off)^power where that is small. An amplitude of both signs turns the answer round with
    its own, but water that enters at a place brings no momentum, and that which leaves takes its own: what is searched
    may turn otherwise.
    """

    def change_with(*amplitudes: float) -> list[Array]:
        problem = tried.problem(a.off, *amplitudes)
        found = answer(tried, problem, moving_water(problem))
        return [
            np.concatenate([(one[..., k] - one[..., 0]).ravel() for one in found])
            for k in range(1, len(amplitudes) + 1)
        ]

    a = tried.effect.amplitude
    half, whole = change_with(a.off + 0.5 * a.small, a.off + a.small)
    largest = np.abs(whole).max()
    if largest == 0.0:
        yield Breach(ContractRule.ACTS, a.name)
    elif np.abs(half * 2.0**a.power - whole).max() > 0.1 * largest + 1e-11:
        yield Breach(ContractRule.POWER, a.name, (a.power,))
    elif a.only_sign == 0 and "search" not in tried.effect.tags:
        (below,) = change_with(a.off - a.small)
        if np.abs(whole + below).max() > 0.1 * largest + 1e-11:
            yield Breach(ContractRule.TURNS, a.name)


def _keeps_bounds(tried: Trial) -> Iterator[Breach]:
    """All is finite. Friction rate and viscosity stay at or above 0; phi and canopy height, in 0.3 m of water from slow
    to fast, discharge and spread stay above. What stands for anything at a place may push: its friction rate may fall
    below 0.
    """
    problem, may_push = tried.problem(*sizes(tried.effect)), "search" in tried.effect.tags
    for water, state_of in WATERS.items():
        if not all(np.isfinite(values).all() for values in answer(tried, problem, state_of(problem))):
            yield Breach(ContractRule.FINITE, water=water)
    for water in ("still", "moving", "no"):
        state = WATERS[water](problem)
        closed = closures(problem, state, faces(problem, state).cell)
        if (closed.rate < 0.0).any() and not may_push:
            yield Breach(ContractRule.DRAG_POSITIVE, water=water)
        if (closed.viscosity < 0.0).any():
            yield Breach(ContractRule.VISCOSITY_POSITIVE, water=water)
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
    at_first = {"phi": plants.phi, "canopy_height": plants.canopy_height}
    for name, values in applied(problem.effects, "plants", plants, at_first).items():
        if (values <= 0.0).any():
            yield Breach(ContractRule.PLANTS_POSITIVE, name)
    if any((inflow.discharge <= 0.0).any() or (inflow.spread <= 0.0).any() for inflow in problem.boundaries.inflows):
        yield Breach(ContractRule.INFLOW_POSITIVE)


def _is_local(tried: Trial) -> Iterator[Breach]:
    """A mirrored flow feels the mirrored effect; some members, or some rows, of a problem answer as they do within it;
    and a steady flow exists with a plausible size.
    """
    problem = tried.problem(*sizes(tried.effect))
    state, pick = moving_water(problem), np.array([3, 0, 1])
    whole = residual(problem, state)
    if not np.array_equal(residual(take(problem, pick), np.ascontiguousarray(state[..., pick])), whole[..., pick]):
        yield Breach(ContractRule.MEMBERS_ALONE)
    rows = slice(2, problem.shape[1] - 2)
    cut = residual(crop(problem, rows.start, rows.stop), np.ascontiguousarray(state[:, :, rows]))
    if not _alike(cut[3:, :, 3:-3], whole[3:, :, 5:-5]):
        yield Breach(ContractRule.ROWS_ALONE)
    faster = state.copy()
    faster[CHANGED:, ALONG:] *= 1.1
    upstream = slice(CHANGED - FELT_AFAR)
    if not _alike(residual(problem, faster)[upstream], whole[upstream]):
        yield Breach(ContractRule.DOWNSTREAM_ALONE)
    size = sizes(tried.effect)[1]
    problem = tried.problem(size)
    state = moving_water(problem)
    rates, readings = answer(tried, problem, state)
    rates_there, readings_there = answer(tried, problem, mirrored(state))
    same = _alike(mirrored(rates), rates_there) and _alike(readings[PAIRS], readings_there)
    if tried.effect.mirrored and not same:
        yield Breach(ContractRule.MIRRORED)
    if not newton(problem, backwater(problem), 1e-8).converged[0]:
        yield Breach(ContractRule.SETTLES, tried.effect.amplitude.name, (size,))


CHECKS = (_off_is_off, _acts, _keeps_bounds, _is_local)


def _alike(found: Array, wanted: Array) -> bool:
    return bool(np.abs(found - wanted).max() <= 1e-9 * (1e-3 + np.abs(wanted).max()))
