"""Fingerprints of something unlisted at any place in the water: of drag, of bed level, of inflow, of viscosity.

    S(x_0, y_0) = sum_cells  d prediction / d term  exp(-((x - x_0) / l)^2 - ((y - y_0) / w)^2)

A place has one fingerprint for all experiments: what lies there stays where it is.

Fingerprints at one point: how predictions change with every candidate effect, and with a spot anywhere.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import SearchModel
from vegglue.calibration.candidates import Candidate, candidates_of, cause_of
from vegglue.calibration.model_error import (
    TERM_OF,
    Bumps,
    CellResponses,
    bumps,
    bumps_at,
    cell_responses,
    responses_to_bumps,
)
from vegglue.case.grid import Grid, cell_stretch
from vegglue.case.gridded_site import in_experiment
from vegglue.case.parameter_space import middle_value
from vegglue.case.schema import Case
from vegglue.decision_constants import constants
from vegglue.effects.definition import Amplitude
from vegglue.engine.interface import Cause, Model, Point, flow_at_centres, responses
from vegglue.errors import InputError
from vegglue.flow.local_changes import Term
from vegglue.flow.problem_setup import share_under_water
from vegglue.parallel import in_threads

# Half width of a spot over the half width of the floor [-], and its half lengths over its half width: an object, a bar,
# and a stretch of bank, as in open-m, after which the longest was added. Smaller ones tell places apart more closely,
# and are more tests.
SPOT_WIDTH = 0.3
SPOT_LENGTHS: Mapping[Term, tuple[float, ...]] = {
    "drag": (1.0, 4.0, 12.0),
    "bed": (1.0, 4.0, 12.0),
    "inflow": (1.0, 4.0, 12.0),
    "viscosity": (4.0, 12.0),
}
# Least half length and half width of a spot in cells: below, it falls between their centres.
SPOT_CELLS = 1.0
# Spots around a place on either side of it: chosen, not measured.
STEPS_AROUND = 4
# Share of a spot that has to lie under water, of water that enters in all experiments, else in one of them [-].
LEAST_SHARE = 0.5
# Depth [m] above which a cell counts as under water.
LEAST_DEPTH = 0.05
# The effect of the library that stands for a term at a place.
EFFECT_AT_PLACE: Mapping[Term, str] = {term: effect for effect, term in TERM_OF.items()}


@dataclass(frozen=True)
class Places:
    """Spots of one term: middles x, y, half lengths and half widths (spot,) [m]; plausible: size of one [unit of the
    effect that stands for it]; fingerprints (station, spot) [unit of a station per that of the effect].
    """

    term: Term
    x: Array
    y: Array
    length: Array
    width: Array
    plausible: float
    fingerprints: Array

    @property
    def name(self) -> str:
        """What all of them are called together, `drag at a place`, in messages and among what was tried."""
        return f"{self.term} at a place"

    def shapes(self, spot: int) -> dict[str, float]:
        """The shapes of the effect at one of them, rounded to a centimetre."""
        return {name: round(float(getattr(self, name)[spot]), 2) for name in ("x", "y", "length", "width")}


def places_of(model: Model, point: Point, half_width: float) -> tuple[Places, ...]:
    """Spots of every term all over the water; half_width: of the floor of the channel [m]."""
    width = SPOT_WIDTH * half_width
    rasters = {
        term: [bumps(model.site.grid, length * width, width, SPOT_CELLS) for length in lengths]
        for term, lengths in SPOT_LENGTHS.items()
    }
    return _places_over(model, point, rasters)


def places_around(model: Model, point: Point, term: Term, place: Mapping[str, float], share: float) -> Places:
    """Spots of one term and size around a place, its x, y, length and width [m]; share: how far apart they stand over
    their half length and half width.
    """
    length, width = place["length"], place["width"]
    steps = share * np.arange(-STEPS_AROUND, STEPS_AROUND + 1, dtype=float)
    x, y = place["x"] + steps * length, place["y"] + steps * width
    return _places_over(model, point, {term: [bumps_at(model.site.grid, x, y, length, width)]})[0]


def _places_over(model: Model, point: Point, rasters: Mapping[Term, Sequence[Bumps]]) -> tuple[Places, ...]:
    responses = cell_responses(model, point, tuple(rasters))
    if "inflow" in rasters:
        for experiment, rows in model.rows.items():
            responses.of["inflow"][rows] *= _under_water(model, experiment)
    depth = np.stack([flow_at_centres(model, point, name).depth for name in point.flows])
    wet = depth > LEAST_DEPTH
    # Water that enters does so where there is water at all times.
    seen = {term: wet.all(axis=0) if term == "inflow" else wet.any(axis=0) for term in rasters}
    mean_depth = float(depth[wet].mean()) if wet.any() else 0.0
    plausible = {term: plausible_size(model.case, term, mean_depth) for term in rasters}
    tasks = [(model, responses, term, over, seen[term], plausible[term]) for term, over in rasters.items()]
    return tuple(in_threads(_places_of_term, tasks))


def plausible_size(case: Case, term: Term, depth: float) -> float:
    """Of the effect that stands for a term at a place, in its unit, in water of a mean depth [m]."""
    if term != "inflow":
        of = constants()
        return {"drag": of.spot_drag, "bed": of.spot_rise * depth, "viscosity": of.spot_viscosity}[term]
    totals = [
        sum(middle_value(case, value) for value in experiment.discharge.values())
        for experiment in case.experiments.values()
    ]
    return constants().spot_inflow * float(np.mean(totals))


def _places_of_term(
    model: Model, responses: CellResponses, term: Term, rasters: Sequence[Bumps], wet: Any, plausible: float
) -> Places:
    parts = []
    for over in rasters:
        answers = responses_to_bumps(responses, term, over)
        if term == "inflow":
            answers = answers / _area_under_water(model, over)
        share = over.along @ wet @ over.across.T
        within = share > LEAST_SHARE * over.along.sum(axis=1)[:, None] * over.across.sum(axis=1)[None]
        a, b = np.nonzero(within & _in_channel(model.site.grid, over))
        size = np.full((2, a.size), [[over.length], [over.width]])
        parts.append((over.x[a], over.y[b], *size, answers[:, a, b]))
    x, y, length_of, width_of, fingerprints = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
    return Places(term, x, y, length_of, width_of, plausible, fingerprints)


def _in_channel(grid: Grid, over: Bumps) -> Any:
    """Whether the middle of each bump lies in the grid (k, j), to a cell, as places are rounded."""
    along = (over.x >= grid.x[0] - grid.dx) & (over.x <= grid.x[-1] + grid.dx)
    across = (over.y >= grid.y[0] - grid.dy) & (over.y <= grid.y[-1] + grid.dy)
    return along[:, None] & across


def _under_water(model: Model, experiment: str) -> Any:
    site = in_experiment(model.site, experiment)
    return share_under_water(model.case, site, model.case.experiments[experiment])


def _area_under_water(model: Model, over: Bumps) -> Array:
    """Area [m2] over which the water of each spot enters, (station, k, j): that of the experiment of the station."""
    cell = model.site.grid.dx * model.site.grid.dy
    area = np.ones((len(model.station), over.x.size, over.y.size))
    for experiment, rows in model.rows.items():
        water = _under_water(model, experiment) * cell_stretch(model.site.grid)
        area[rows] = np.maximum(cell * (over.along @ water @ over.across.T), 0.1 * cell)
    return area


@dataclass(frozen=True)
class Fingerprints:
    """values (station, c): d prediction / d gain of candidates, [m/s or m] per unit of gain, one column per setting.

    columns: for each candidate, its columns; settings, amplitudes, causes: of each column (c,).
    """

    point: Point
    candidates: list[Candidate]
    columns: list[np.ndarray]
    settings: list[dict[str, float]]
    amplitudes: list[Amplitude]
    causes: list[Cause]
    values: Array
    places: tuple[Places, ...]

    @property
    def only_sign(self) -> np.ndarray:
        """The only sign that a gain of each column (c,) may have, 0 where it may have both."""
        return np.array([amplitude.only_sign for amplitude in self.amplitudes], dtype=int)

    def allowed(self, gains: Array, largest: float) -> np.ndarray:
        """Whether gains (c,), and their opposites, are allowed for each column, (2, c); see `Amplitude.allows`."""
        pairs = list(zip(self.amplitudes, gains, strict=True))
        return np.array([[amplitude.allows(sign * gain, largest) for amplitude, gain in pairs] for sign in (1.0, -1.0)])


def fingerprints_of(search: SearchModel, half_width: float) -> Fingerprints:
    """Fingerprints of the search model, exact enough for a direction; half_width: of the floor of the channel [m]."""
    model, point = search.model, search.point
    candidates = candidates_of(model.case, model.station)
    tried = [one.settings() for one in candidates]
    every = [(one, shapes) for one, settings in zip(candidates, tried, strict=True) for shapes in settings]
    causes = [cause_of(model.case, one, shapes) for one, shapes in every]
    values = responses(model, point, causes)
    for column in np.flatnonzero(~np.isfinite(values[model.station["used"].to_numpy()]).all(axis=0)):
        raise InputError(f"The effect `{every[column][0].name}` gives what is no finite number; mend it.")
    return Fingerprints(
        point=point,
        candidates=candidates,
        columns=[np.arange(*ends) for ends in pairwise(accumulate(map(len, tried), initial=0))],
        settings=[shapes for _, shapes in every],
        amplitudes=[one.amplitude for one, _ in every],
        causes=causes,
        values=values,
        places=places_of(model, point, half_width),
    )
