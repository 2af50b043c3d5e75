"""What every candidate would change at every station: effects that act as a law, and something unlisted at any place in
the water, of drag, of bed level, of inflow or of viscosity.

    S(x_0, y_0) = sum_cells  d prediction / d term  exp(-((x - x_0) / l)^2 - ((y - y_0) / w)^2)

A place has one fingerprint for all experiments: what lies there stays where it is. A barrier has a place along the
channel alone, between the first and the last station: beyond them it is a level at the outlet, or nothing. A surveyed
line that is too high leaves -R w, w how the bed of each cell rises with its level, and R how predictions answer to the
bed of each.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array, Mask
from vegglue.calibration.baseline import SearchModel
from vegglue.calibration.candidates import Candidate, candidates_of, cause_of
from vegglue.calibration.model_error import (
    EFFECT_AT_PLACE,
    TERM_OF,
    CellResponses,
    GaussianBasis,
    Unlisted,
    cell_responses,
    excluded_terms,
    gaussian_basis,
    gaussian_basis_at,
    responses_to_basis,
)
from vegglue.case.bed_error import SurveyedLines, surveyed_lines
from vegglue.case.case_effects import effect_named
from vegglue.case.channel_geometry import site_scales
from vegglue.case.grid import cell_stretch
from vegglue.case.gridded_site import in_experiment
from vegglue.case.schema import Case
from vegglue.decision_constants import constants
from vegglue.effects.definition import Amplitude
from vegglue.effects.scales import SPOT_WIDTH
from vegglue.effects.unlisted import BARRIER_LENGTH, BARRIER_WIDTH
from vegglue.engine.interface import Cause, Model, Point, flow_at_centres, responses
from vegglue.errors import InputError
from vegglue.flow.local_changes import Term
from vegglue.flow.problem_setup import share_under_water
from vegglue.parallel import in_threads

# Half lengths of a spot over its half width [-]: an object, a bar, and a stretch of bank, as in open-m, after which the
# longest was added. Smaller ones separate places more closely, and are more tests. A barrier's is that of its effect.
SPOT_LENGTHS: Mapping[Unlisted, tuple[float, ...]] = {
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
# Depth over that of the site [-] above which a cell counts as under water.
LEAST_DEPTH = 0.05
# Cells that a spot keeps from inflow and outlet at least: nearer, it only changes how the water enters or leaves.
FROM_ENDS = 2.0
# Share of a spot under plants [-] up to which it lies on a bare bed.
WITHOUT_PLANTS = 0.02


@dataclass(frozen=True)
class Places:
    """Spots of one term, or barriers.

    Attributes
    ----------
    x, y : ndarray (spot,)
        Middles [m].
    length, width : ndarray (spot,)
        Half lengths and half widths [m].
    plausible : float
        Size of one [unit of the effect that stands for it].
    fingerprints : ndarray (station, spot)
        [unit of a station per that of the effect]
    bare : ndarray of bool (spot,)
        Whether no plants stand there.
    """

    term: Unlisted
    x: Array
    y: Array
    length: Array
    width: Array
    plausible: float
    fingerprints: Array
    bare: Mask = field(default_factory=lambda: np.zeros(0, dtype=bool))

    @property
    def only_sign(self) -> NDArray[np.int_]:
        """The only sign that the size of each spot may have, 0 for both (spot,): a bare bed has no drag to lose, and a
        barrier no head to give.
        """
        if self.term == "barrier":
            return np.ones(self.x.size, dtype=int)
        one_sided = self.term == "drag" and self.bare.size == self.x.size
        return self.bare.astype(int) if one_sided else np.zeros(self.x.size, dtype=int)

    @property
    def name(self) -> str:
        """What all of them are called together, `drag at a place`, in messages and among what was tried."""
        return "an obstacle across the channel" if self.term == "barrier" else f"{self.term} at a place"

    def shapes(self, spot: int) -> dict[str, float]:
        """The shapes of the effect at one of them, rounded to a centimetre, or to a tenth of its smaller half size."""
        digits = digits_of_place(float(min(self.length[spot], self.width[spot])))
        return {name: round(float(getattr(self, name)[spot]), digits) for name in ("x", "y", "length", "width")}


@dataclass(frozen=True)
class Fingerprints:
    """S = d prediction / d gain of candidates, one column for each setting of their shapes.

    Attributes
    ----------
    point : Point
        At which S is taken.
    columns : list of ndarray of int
        Of each candidate.
    settings : list of dict of float
        Shapes of each column [unit of each].
    amplitudes : list of Amplitude
        Of each column.
    causes : list of Cause
        Of each column.
    values : ndarray (station, c)
        S [m/s or m per unit of gain].
    places : tuple of Places
        The spots of each term.
    of_lines : ndarray (station, lines)
        By what a measurement exceeds its prediction for each m that a line is too high [unit of the station per m].
    """

    point: Point
    candidates: list[Candidate]
    columns: list[np.ndarray]
    settings: list[dict[str, float]]
    amplitudes: list[Amplitude]
    causes: list[Cause]
    values: Array
    places: tuple[Places, ...]
    lines: SurveyedLines | None = None
    of_lines: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def only_sign(self) -> np.ndarray:
        """The only sign that a gain of each column (c,) may have, 0 if it may have both."""
        return np.array([amplitude.only_sign for amplitude in self.amplitudes], dtype=int)

    def allowed(self, gains: Array, largest: float) -> np.ndarray:
        """Whether gains (c,), and their opposites, are allowed for each column, (2, c); see `Amplitude.allows`."""
        pairs = list(zip(self.amplitudes, gains, strict=True))
        return np.array([[amplitude.allows(sign * gain, largest) for amplitude, gain in pairs] for sign in (1.0, -1.0)])


def consecutive_columns(sizes: Sequence[int]) -> list[np.ndarray]:
    """Numbers of columns that stand one group after another, by group."""
    return [np.arange(*ends) for ends in pairwise(accumulate(sizes, initial=0))]


def digits_of_place(half: float) -> int:
    """Decimals of coordinates: a centimetre, or a tenth of what is smaller, half length or half width.

    Parameters
    ----------
    half : float
        Half length or half width of what lies there, the smaller one [m].
    """
    return max(2, 1 - math.floor(math.log10(half)))


def fingerprints_of(search: SearchModel, half_width: float) -> Fingerprints:
    """S = d prediction / d gain of all candidates, and the fingerprints of places and of surveyed lines.

    Parameters
    ----------
    half_width : float
        Of the floor of the channel [m].

    Returns
    -------
    Fingerprints
        Exact enough for a direction.

    Raises
    ------
    InputError
        If an effect gives values that are not finite.
    """
    model, point = search.model, search.point
    candidates = candidates_of(model.case, model.station)
    tried = [one.settings() for one in candidates]
    every = [(one, shapes) for one, settings in zip(candidates, tried, strict=True) for shapes in settings]
    causes = [cause_of(model.case, one, shapes) for one, shapes in every]
    values = responses(model, point, causes)
    for column in np.flatnonzero(~np.isfinite(values[model.station["used"].to_numpy()]).all(axis=0)):
        raise InputError(f"The effect `{every[column][0].name}` gives values that are not finite; correct it.")
    lines = surveyed_lines(model.case, model.site.grid)
    of_bed: tuple[Term, ...] = ("bed",) if lines.lines else ()
    cells = cell_responses(model, point, tuple(dict.fromkeys([*terms_of(terms_at_places(model.case)), *of_bed])))
    of_lines = np.zeros((len(model.station), 0))
    if lines.lines:
        of_lines = -(cells.of["bed"].reshape(len(model.station), -1) @ lines.weights)
        of_lines[model.station["experiment"].isin(model.site.own)] = 0.0
    return Fingerprints(
        point=point,
        candidates=candidates,
        columns=consecutive_columns([len(settings) for settings in tried]),
        settings=[shapes for _, shapes in every],
        amplitudes=[one.amplitude for one, _ in every],
        causes=causes,
        values=values,
        places=places_of(model, point, half_width, cells),
        lines=lines,
        of_lines=of_lines,
    )


def terms_at_places(case: Case) -> list[Unlisted]:
    """What something at a place may be."""
    excluded = excluded_terms(case)
    return [term for term in EFFECT_AT_PLACE if term not in excluded]


def terms_of(unlisted: Iterable[Unlisted]) -> tuple[Term, ...]:
    """The terms of the equations that these change, each once."""
    return tuple(dict.fromkeys(TERM_OF[EFFECT_AT_PLACE[one]] for one in unlisted))


def places_of(model: Model, point: Point, half_width: float, cells: CellResponses | None = None) -> tuple[Places, ...]:
    """Spots of every term that is not excluded, all over the water.

    Parameters
    ----------
    half_width : float
        Of the floor of the channel [m].
    cells : CellResponses, optional
        To these terms, if they are at hand.

    Returns
    -------
    tuple of Places
        One for each term.
    """
    width, grid = SPOT_WIDTH * half_width, model.site.grid
    rasters = {
        term: [barriers(model)]
        if term == "barrier"
        else [gaussian_basis(grid, length * width, width, SPOT_CELLS) for length in SPOT_LENGTHS[term]]
        for term in terms_at_places(model.case)
    }
    cells = cells or cell_responses(model, point, terms_of(rasters))
    return _places_over(model, point, rasters, cells, beside_ends=False)


def barriers(model: Model) -> GaussianBasis:
    """Spots even across the channel, as long as their effect states and as far apart.

    Returns
    -------
    GaussianBasis
        Of half length BARRIER_LENGTH depths, SPOT_CELLS cells at least.
    """
    grid = model.site.grid
    length = max(BARRIER_LENGTH * site_scales(model.case, model.site).depth, SPOT_CELLS * grid.dx)
    x = np.linspace(grid.x[0], grid.x[-1], max(round((grid.x[-1] - grid.x[0]) / length), 1) + 1)
    middle, half = 0.5 * (grid.y[0] + grid.y[-1]), 0.5 * grid.y.size * grid.dy
    return gaussian_basis_at(grid, x, np.array([middle]), length, BARRIER_WIDTH * half)


def places_around(model: Model, point: Point, term: Unlisted, place: Mapping[str, float], share: float) -> Places:
    """Spots of one term and size around a place, STEPS_AROUND on either side.

    Parameters
    ----------
    place : mapping of float
        x, y, length and width [m].
    share : float
        Spacing over half length and half width [-].

    Returns
    -------
    Places
        Those under water in the grid.
    """
    length, width = place["length"], place["width"]
    steps = share * np.arange(-STEPS_AROUND, STEPS_AROUND + 1, dtype=float)
    x, y = place["x"] + steps * length, place["y"] + (0.0 * steps[:1] if term == "barrier" else steps * width)
    around = {term: [gaussian_basis_at(model.site.grid, x, y, length, width)]}
    return _places_over(model, point, around, cell_responses(model, point, terms_of([term])))[0]


def _places_over(
    model: Model,
    point: Point,
    rasters: Mapping[Unlisted, Sequence[GaussianBasis]],
    cells: CellResponses,
    beside_ends: bool = True,
) -> tuple[Places, ...]:
    """beside_ends: whether spots may reach inflow and outlet, where each only changes how the water passes."""
    grid = model.site.grid
    water = {}
    if "inflow" in rasters:
        for experiment, rows in model.rows.items():
            site = in_experiment(model.site, experiment)
            water[experiment] = share_under_water(model.case, site, model.case.experiments[experiment])
            cells.of["inflow"][rows] *= water[experiment]
    depth = np.stack([flow_at_centres(model, point, name).depth for name in point.flows])
    wet = depth > least_depth(model)
    measured = model.station.loc[model.station["used"], "x"]

    def places_of_term(term: Unlisted, spots: Sequence[GaussianBasis]) -> Places:
        # Water that enters does so where there is water at all times.
        seen = wet.all(axis=0) if term == "inflow" else wet.any(axis=0)
        parts, bare, cover = [], [], model.site.cover
        for over in spots:
            answers = responses_to_basis(cells, TERM_OF[EFFECT_AT_PLACE[term]], over)
            if term == "barrier":
                answers = answers / (2.0 * np.sqrt(np.pi) * over.length)
            if term == "inflow":
                # Over the area [m2] on which the water enters (station, k, j), that of the experiment of the station.
                cell = grid.dx * grid.dy
                area = np.ones((len(model.station), over.x.size, over.y.size))
                for experiment, rows in model.rows.items():
                    covered = water[experiment] * cell_stretch(grid)
                    area[rows] = np.maximum(cell * (over.along @ covered @ over.across.T), 0.1 * cell)
                answers = answers / area
            share = over.along @ seen @ over.across.T
            least = 0.0 if term == "barrier" else LEAST_SHARE  # a valley may be dry beside its channel
            within = share > least * over.along.sum(axis=1)[:, None] * over.across.sum(axis=1)[None]
            # With the middle in the grid, to a cell, as places are rounded.
            along = (over.x >= grid.x[0] - grid.dx) & (over.x <= grid.x[-1] + grid.dx)
            if not beside_ends:
                kept = max(over.length, FROM_ENDS * grid.dx)
                along &= (over.x >= grid.x[0] + kept) & (over.x <= grid.x[-1] - kept)
            if term == "barrier":
                along &= (over.x > measured.min()) & (over.x < measured.max())
            across = (over.y >= grid.y[0] - grid.dy) & (over.y <= grid.y[-1] + grid.dy)
            a, b = np.nonzero(within & (along[:, None] & across))
            size = np.full((2, a.size), [[over.length], [over.width]])
            parts.append((over.x[a], over.y[b], *size, answers[:, a, b]))
            bare.append((over.along @ cover @ over.across.T <= WITHOUT_PLANTS * share)[a, b])
        x, y, length, width, fingerprints = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
        return Places(term, x, y, length, width, plausible_size(model.case, term), fingerprints, np.concatenate(bare))

    return tuple(in_threads(places_of_term, rasters.items()))


def least_depth(model: Model) -> float:
    """h_min = LEAST_DEPTH times the depth of the site: above it a cell counts as under water.

    Returns
    -------
    float
        [m]
    """
    return LEAST_DEPTH * site_scales(model.case, model.site).depth


def plausible_size(case: Case, term: Unlisted) -> float:
    """A plausible size of an unlisted object: a multiple of a scale of the site.

    Returns
    -------
    float
        [unit of the effect that stands for it]
    """
    of, scales = constants(), site_scales(case)
    return {
        "barrier": of.effect_sizes * effect_named(case, EFFECT_AT_PLACE["barrier"]).amplitude.scale,
        "drag": of.spot_drag * scales.of("object"),
        "bed": of.spot_rise * scales.mean_depth,
        "inflow": of.spot_inflow * scales.discharge,
        "viscosity": of.spot_viscosity * scales.of("eddy"),
    }[term]
