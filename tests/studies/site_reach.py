"""A site as the second solver sees it: a channel with patches, at its true numbers, with what may be hidden in it.

`SETTINGS` says what may be hidden, besides the effects of `second_effects`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter
from second_channel import PAPER, Channel, Range, lie_of
from second_effects import BED, changes
from second_kernels import DRY
from second_laws import USUAL, Formulation, Ground, closure_of
from second_solver import Ends, Field, Flow, Reach
from second_steady import STEADY, steady

FINE = (0.25, 0.1875)
# Water may rise so much over the level at the outlet [m] before it meets the wall of the grid.
MARGIN = 0.35
EDDY_VISCOSITY = 0.01
SETTINGS = {
    "chi": "phi (|U|/0.35)^chi with |U| the local depth-averaged speed (at least 0.02 m/s)",
    "exp": "experiment whose true discharge is factor times the reported one (low, mid, high)",
    "factor": "true over reported discharge",
    "mixk": "nu_t = nu + l^2 |du/dy|, l = mixk in metres",
    "ervine": "force per unit mass -(1/h) d(K h u^2)/dy with K(y) = ervine sin(pi y/1.5) exp(-(y/2.25)^4)",
    "pier": "[x, y, s]: extra drag c |U| u per unit mass, c = s exp(-((X-x)/0.35)^2-((Y-y)/0.3)^2)",
    "scour": "[x, y, depth, lx, ly]: the bed is lower by depth exp(-((X-x)/lx)^2-((Y-y)/ly)^2), a bar if negative",
    "station": "y of the probe that reads too much by bias in all experiments [m]",
    "bias": "m/s",
    "gauge": "x of the gauge that reads too high by shift in all experiments [m]",
    "shift": "m",
    "seep": "[x0, x1, y0, y1, Q]: water that enters over this part of the bed, without momentum",
    "lateral": "the same, as much as enters along the whole floor",
    "skew": "the inflow is spread by h^(5/3) (1 + skew y/1.5), at least 0.1 h^(5/3)",
    "banktrend": "drag in 1/m, added on |y| > 1.5 m: banktrend (x/100 - 0.5) + |banktrend|/2",
}
# Settings by the effect they are: its name, that of its amplitude, and its shapes.
AS_EFFECTS: dict[str, tuple[str, str, dict[str, float]]] = {
    "chi": ("streamlining", "vogel_exponent", {"reference_speed": 0.35}),
    "mixk": ("mixing_length", "length", {}),
    "ervine": ("secondary_current", "strength", {}),
}
# Error of the survey of the bed [m], over what it is the same [m], and how densely it is drawn [m].
BED_ERROR, BED_LENGTHS, BED_STEP = 0.01, (2.0, 0.5), 0.125


@dataclass(frozen=True)
class Truth:
    """What is so on a site: parameters, what is hidden, and imperfections (stems and discharges as factors).

    settings: by SETTINGS; effects: numbers of effects by name; spread: of the inflow, numbers by name; edges: where
    patches truly are, if not where they were mapped.
    """

    nb: float
    ks: float
    phi: float
    hd: float
    settings: Mapping[str, Any]
    nu: float = EDDY_VISCOSITY
    stems: tuple[float, ...] = (1.0,) * 7
    discharges: tuple[float, ...] = (1.0,) * 4
    bed_seed: int | None = None
    channel: Channel = PAPER
    edges: tuple[tuple[Range, Range], ...] = ()
    formulation: Formulation = USUAL
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    spread: Mapping[str, float] = field(default_factory=dict)

    @property
    def planted(self) -> Channel:
        """The channel with its patches where they truly are."""
        return replace(self.channel, patches=self.edges or self.channel.patches)


def bed_level(x: Field, y: Field, truth: Truth) -> Field:
    """z at places [m]."""
    channel = truth.channel
    bed = np.maximum(np.abs(y) - channel.half, 0.0) * channel.rise - channel.slope * x
    if "scour" in truth.settings:
        px, py, depth, lx, ly = truth.settings["scour"]
        bed = bed - depth * np.exp(-(((x - px) / lx) ** 2) - ((y - py) / ly) ** 2)
    rises: list[Field] = changes(BED, truth.effects, lie_of(truth.planted, x, y))
    return sum(rises, bed) + _survey_error(x, y, truth)


def _survey_error(x: Field, y: Field, truth: Truth) -> Field:
    """Smooth noise of one site, the same at every place whatever the grid [m]."""
    if truth.bed_seed is None:
        return np.zeros(np.broadcast(x, y).shape)
    smooth = _smooth_noise(truth.bed_seed, truth.channel.length)
    i = np.clip(np.rint(x / BED_STEP).astype(int), 0, smooth.shape[0] - 1)
    j = np.clip(np.rint((y + 5.0) / BED_STEP).astype(int), 0, smooth.shape[1] - 1)
    return smooth[i, j]


@lru_cache(maxsize=4)  # a flow asks for it at centres and faces of three grids
def _smooth_noise(seed: int, length: float) -> Field:
    """Errors every BED_STEP along a channel of this length [m], and across 10 m about its axis [m]."""
    noise = np.random.default_rng(seed).standard_normal((int(length / BED_STEP) + 1, 81))
    # a Gaussian filter of width s correlates over exp(-d^2/(4 s^2)): 1/e at the stated lengths
    smooth = gaussian_filter(noise, [0.5 * length / BED_STEP for length in BED_LENGTHS], mode="nearest")
    smooth *= BED_ERROR / smooth.std()
    smooth.flags.writeable = False
    return smooth


def centres(cells: tuple[float, float], level: float, channel: Channel = PAPER) -> tuple[Field, Field]:
    """x (nx, 1) and y (1, ny) of the cells that may become wet [m]."""
    dx, dy = cells
    reach = channel.half + (level + channel.slope * channel.length + MARGIN) / channel.rise
    side = int(np.ceil(reach / 0.75)) * round(0.75 / dy)
    x = (np.arange(round(channel.length / dx)) + 0.5) * dx
    y = (np.arange(-side, side) + 0.5) * dy
    return x[:, None], y[None, :]


def reach_of(truth: Truth, cells: tuple[float, float], level: float) -> Reach:
    """The site on cells of this size [m]."""
    (dx, dy), (x, y) = cells, centres(cells, level, truth.channel)
    channel = truth.planted
    x_faces, y_faces = np.arange(len(x) + 1)[:, None] * dx, np.append(y[0] - dy / 2, y[0, -1] + dy / 2)[None, :]
    effects = {**truth.effects, **_effects_of(truth.settings)}
    ground = Ground(truth.nb, truth.ks, truth.phi, truth.hd, truth.nu, truth.stems, truth.formulation, effects)
    extra = _extra_drag(x, y, truth)
    return Reach(
        dx=dx, dy=dy, z=bed_level(x, y, truth), zx=bed_level(x_faces, y, truth), zy=bed_level(x, y_faces, truth),
        source=_source(x, y, cells, truth),
        closure=closure_of(ground, channel, lie_of(channel, x, y, dx, dy), cells, extra),
    )  # fmt: skip


def _effects_of(settings: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """Settings that are effects of `second_effects` under another name."""
    return {
        effect: {amplitude: float(settings[name]), **shapes}
        for name, (effect, amplitude, shapes) in AS_EFFECTS.items()
        if name in settings
    }


def _extra_drag(x: Field, y: Field, truth: Truth) -> Field:
    settings, extra = truth.settings, np.zeros(np.broadcast(x, y).shape)
    if "pier" in settings:
        px, py, strength = settings["pier"]
        extra += strength * np.exp(-(((x - px) / 0.35) ** 2) - ((y - py) / 0.3) ** 2)
    trend, channel = settings.get("banktrend", 0.0), truth.channel
    along = trend * (x / channel.length - 0.5) + abs(trend) / 2
    return extra + np.where(np.abs(y) > channel.half, along, 0.0)


def _source(x: Field, y: Field, cells: tuple[float, float], truth: Truth) -> Field:
    """Water that enters [m/s]: over a part of the bed, or evenly over the floor."""
    source = np.zeros(np.broadcast(x, y).shape)
    for x0, x1, y0, y1, discharge in (truth.settings.get(key) for key in ("seep", "lateral") if key in truth.settings):
        inside = ((x > x0) & (x < x1) & (y > y0) & (y < y1)).astype(float)
        source += inside * discharge / (inside.sum() * cells[0] * cells[1])
    return source


def steady_flow(
    truth: Truth, discharge: float, level: float, cells: tuple[float, float] = FINE, change: float = STEADY,
    start: Flow | None = None,
) -> Flow:  # fmt: skip
    """The steady flow on cells of this size, from a flow of a like site on the same cells, else by way of cells that
    are twice as long and wide.
    """
    reach, ends = _problem(truth, discharge, level, cells)
    if start is not None and start.h.shape == reach.z.shape:
        level_bed = bed_level(*centres(cells, level, truth.channel), replace(truth, bed_seed=None, effects={}))
        near = _on_cells_of(reach, replace(reach, z=level_bed), start)
    else:
        near = _from_afar(truth, discharge, level, cells, reach, 10 * change)
    flow = steady(reach, ends, near, change)
    if flow.h[:, [0, -1]].max() > DRY:
        raise RuntimeError("the water stands at the wall of the grid: a larger MARGIN is needed")
    return flow


def _from_afar(
    truth: Truth, discharge: float, level: float, cells: tuple[float, float], reach: Reach, change: float
) -> Flow:
    """The flow on larger cells, which is only a start, on these."""
    large, channel = (2 * cells[0], 2 * cells[1]), truth.channel
    coarse, ends = _problem(truth, discharge, level, large)
    surface = level + channel.slope * (channel.length - centres(large, level, channel)[0])
    return _on_cells_of(reach, coarse, steady(coarse, ends, _first_guess(coarse, discharge, surface), change))


def _first_guess(reach: Reach, discharge: float, surface: Field) -> Flow:
    """Water up to a surface (nx, 1) [m], fast where it is deep."""
    h = np.maximum(surface - reach.z, 0.0)
    u = h ** (2 / 3)
    return Flow(h, u * discharge / ((h * u).sum(axis=1, keepdims=True) * reach.dy), np.zeros_like(h))


def _on_cells_of(finer: Reach, coarse: Reach, flow: Flow) -> Flow:
    """A flow on the cells of another reach, a whole number to one."""
    along, across = (fine // old for fine, old in zip(finer.z.shape, coarse.z.shape, strict=True))
    middle = coarse.z.shape[1] // 2
    surface = (flow.h + coarse.z)[:, middle, None].repeat(along, axis=0)
    h = np.maximum(surface - finer.z, 0.0)
    u, v = (np.where(h > DRY, field.repeat(along, axis=0).repeat(across, axis=1), 0.0) for field in (flow.u, flow.v))
    return Flow(h, u, v)


def _problem(truth: Truth, discharge: float, level: float, cells: tuple[float, float]) -> tuple[Reach, Ends]:
    y = centres(cells, level, truth.channel)[1][0]
    share = np.maximum(1.0 + truth.settings.get("skew", 0.0) * y / truth.channel.half, 0.1)
    s = y / truth.channel.inflow
    share = share * (1.0 + truth.spread.get("skew", 0.0) * s)
    share = share * (1.0 + truth.spread.get("excess", 0.0) * (1.0 - 3.0 * s**2) / 2.0)
    off_peak = (s - truth.spread.get("peak_middle", 0.0)) / truth.spread.get("peak_width", 1.0)
    share = share * (1.0 + truth.spread.get("peak_excess", 0.0) * np.exp(-(off_peak**2)))
    for k in range(1, 5):
        share = share * np.exp(truth.spread.get(f"mode_{k}", 0.0) * np.cos(0.5 * np.pi * k * (1.0 + s)) / k)
    return reach_of(truth, cells, level), Ends(discharge, level, share)


def at(field: Field, cells: tuple[float, float], level: float, x: Field, y: Field, channel: Channel = PAPER) -> Field:
    """A field at stations, linear in x and y between centres of cells."""
    along, across = (axis.ravel() for axis in centres(cells, level, channel))
    i = np.clip(np.searchsorted(along, x) - 1, 0, along.size - 2)
    j = np.clip(np.searchsorted(across, y) - 1, 0, across.size - 2)
    s, t = (x - along[i]) / cells[0], (y - across[j]) / cells[1]
    near = field[i, j] * (1 - t) + field[i, j + 1] * t
    far = field[i + 1, j] * (1 - t) + field[i + 1, j + 1] * t
    return near * (1 - s) + far * s
