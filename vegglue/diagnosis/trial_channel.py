"""A small channel to try effects in: floor, banks, plants under water and plants that stand out."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.gridded_site import Site, build_site
from vegglue.case.schema import Case
from vegglue.effects.definition import Effect
from vegglue.flow.equations import residual
from vegglue.flow.problem import ACROSS, ALONG, LEVEL, Problem
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.sensor import predictions_at_sensors

AMPLITUDE = "amplitude"
CHANNEL = {
    "name": "contract",
    "grid": {"x": (0.0, 20.0), "y": (-4.0, 4.0), "cell": (0.5, 0.5)},
    "bed": [
        {"trapezoid": {"axis": 0.0, "bottom_width": 4.0, "bank_slope": 0.6, "bed_slope": 0.001, "level": 0.02}},
    ],
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
    "experiments": {"flow": {"discharge": {"main": 1.2}, "level": 0.7}},
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


@dataclass(frozen=True)
class Trial:
    """An effect in the channel: the problem of any amplitudes (m,), and without it."""

    effect: Effect
    case: Case
    site: Site

    def problem(self, *amplitude: float) -> Problem:
        return build_problem(self.case, self.site, "flow", {AMPLITUDE: np.array(amplitude)})

    def without(self, members: int) -> Problem:
        bare = self.case.model_copy(update={"effects": {}})
        return build_problem(bare, self.site, "flow", {AMPLITUDE: np.zeros(members)})


def trial(effect: Effect, own: Path | None = None) -> Trial:
    """own: the file of the effect, if it is a user's."""
    works = {effect.name: {"values": {effect.amplitude.name: AMPLITUDE}}}
    case = Case.model_validate(CHANNEL | {"source": Path("contract"), "effect_file": own, "effects": works})
    return Trial(effect, case, build_site(case))


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
    """Water in motion, not steady, not symmetric: every derivative differs from 0, and the banks are partly dry."""
    nx, ny = problem.shape
    x, y = np.linspace(0.0, 1.0, nx)[:, None, None], np.linspace(-1.0, 1.0, ny)[None, :, None]
    state = at_rest(problem)
    depth = np.clip(0.7 - problem.bed, 0.0, None)[..., None]
    state[:, LEVEL] += 0.02 * (1.0 - x) + 0.002 * np.sin(7.0 * x + 2.0 * y)
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
    """All that an effect can change: the residual (nx, 3, ny, m), and the readings (station, m)."""
    return residual(problem, state), predictions_at_sensors(problem, state, tried.site.grid, TRIAL_STATIONS).T


def sizes(effect: Effect) -> tuple[float, ...]:
    """Amplitudes worth trying: off, a plausible one to each side as far as there is room, and both ends."""
    a = effect.amplitude
    return tuple(np.clip([a.off, a.off + a.scale, a.off - a.scale, a.low, a.high], a.low, a.high).tolist())
