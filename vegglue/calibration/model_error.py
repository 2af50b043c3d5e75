"""How predictions answer to a term of the equations that is changed in one cell, by adjoints of each station.

Errors of a site that nobody would call a missing effect: a site is like that.

    S = s_y^2 diag((du/dy)^2) + s_q^2 sum_e Q_e Q_e' + s_n^2 sum_p P_p P_p' + s_e^2/2 sum_s (O_s O_s' + I_s I_s')

du/dy is how a velocity changes where a probe stands beside its place, Q_e answers to the discharge of experiment e, P_p
to the friction of patch p, O_s to side s of a patch that lies 1 m further out and I_s to one 1 m further in, all in
units of a station. A side lies out or in, with the same chance.
Source: definition; which errors are meant, and of which size, is chosen (see DECISIONS).

The model's own error: friction and bed are a little wrong everywhere, and the same in all experiments.

    M = (s_f^2 / v) sum_k T_k T_k' + (s_b^2 / v) sum_k B_k B_k' + S,   v = mean over cells of sum_k bump_k^2 [-]

S: see site_error.py.

T_k and B_k are how predictions answer to friction made larger by its own part, and to a bed 1 m higher, in a bump
exp(-d^2 / l^2) around place k; bumps stand a radius apart, so that their sum is a smooth random field of standard
deviation s_f [-] or s_b [m]. Something unlisted at a place, once it is in the model, is a spot there and something else
in nature: of all that it does, its force, water or volume A, shape_error may act in the n bumps around it instead,

    S_k = shape_error A / (A_k sqrt(n)) bump_k,   A_k = sum of bump_k over the cells, times their area,

so that in all of them together it has a standard deviation of shape_error A. What of that would look like another size
of the spot is left out, since the size is calibrated: water that enters at a place was all error of shape before.
Source: a model has its own error in weak-constraint data assimilation (Tremolet 2006, doi:10.1256/qj.05.224; not
checked against it); the fields of bumps are a definition of this project.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.case_effects import effect_of, value_of
from vegglue.case.channel_geometry import half_width, patches_present
from vegglue.case.grid import Grid
from vegglue.case.parameter_space import theta_at
from vegglue.case.parts import Value
from vegglue.case.schema import Case, EffectEntry, ModelError, Parameter
from vegglue.decision_constants import constants
from vegglue.engine.interface import Cause, Model, Point, responses, responses_to_cells
from vegglue.flow.local_changes import Term
from vegglue.measurements.kinds import velocity_rows
from vegglue.parallel import in_threads


@dataclass(frozen=True)
class CellResponses:
    """How predictions of all stations answer to a term changed in each cell of a grid, (station, nx, ny) by term."""

    grid: Grid
    of: dict[Term, NDArray[np.float32]]


def cell_responses(model: Model, point: Point, terms: tuple[Term, ...]) -> CellResponses:
    """Those of all experiments, side by side."""
    shape = (len(model.station), model.site.grid.x.size, model.site.grid.y.size)
    found = {term: np.zeros(shape, dtype=np.float32) for term in terms}
    tasks = [(model, point, experiment, terms) for experiment in point.flows]
    for experiment, of in zip(point.flows, in_threads(responses_to_cells, tasks), strict=True):
        for term in terms:
            found[term][model.rows[experiment]] = of[term]
    return CellResponses(model.site.grid, found)


# The name of an effect that is tried alone, and of its amplitude; no case has it.
TRIED, AMOUNT = "error_of_the_site", "error_of_the_site_amount"
UNKNOWN = Parameter(distribution="uniform", low=-1.0, high=1.0, unit="-")


def site_error_columns(model: Model, point: Point, allowed: ModelError, cells: CellResponses) -> Array:
    """Columns (station, k) with S = columns columns'; cells: how predictions answer to friction."""
    parts: list[tuple[float, Callable[[], Array]]] = [
        (allowed.probes, lambda: _beside_their_places(model, point)),
        (allowed.discharge, lambda: _discharges(model, point)),
        (allowed.stems, lambda: _patches(model, cells)),
        (allowed.edges, lambda: _sides(model, cells)),
    ]
    none = np.zeros((len(model.station), 0))
    return np.hstack([none, *(size * columns() for size, columns in parts if size)])


def _beside_their_places(model: Model, point: Point) -> Array:
    """diag(du/dy) of velocities (station, velocities) [1/s]."""
    cause = _cause(model.case, "station_shift")
    rows = velocity_rows(model.station)
    return np.diag(responses(model, point, [cause])[:, 0])[:, np.flatnonzero(rows)]


def _discharges(model: Model, point: Point) -> Array:
    """Answers to the relative error of the discharge of each experiment (station, experiments)."""
    causes = [_cause(model.case, "discharge_error", name) for name in model.case.experiments]
    return responses(model, point, causes)


def _cause(case: Case, effect: str, *experiments: str) -> Cause:
    """An effect of the library that acts alone, in some experiments or in all."""
    with_it = case.model_copy(update={"effects": {**case.effects, TRIED: EffectEntry(effect=effect, values={})}})
    amplitude = effect_of(with_it, TRIED).amplitude
    entry = EffectEntry(effect=effect, values={amplitude.name: AMOUNT}, experiments=experiments or None)
    changed = case.model_copy(
        update={
            "effects": {**case.effects, TRIED: entry},
            "parameters": {**case.parameters, AMOUNT: UNKNOWN},
        }
    )
    return Cause(changed, AMOUNT, amplitude, experiments)


def _sides(model: Model, cells: CellResponses) -> Array:
    """Answers to each side of each patch further out and further in, over 2^(1/2) (station, 2 sides) [unit of a
    station per m]; see `_side`.
    """
    patch, parts = model.site.main_patch, [np.zeros((len(model.station), 0))]
    rate = {name: _friction_rate(cells, rows) for name, rows in model.rows.items()}
    for index in np.unique(patch[patch >= 0]):
        parts += [_side(model, cells, rate, int(index), axis, step) for axis in (0, 1) for step in (-1, 1)]
    return np.hstack(parts) / np.sqrt(2.0)


def _side(model: Model, cells: CellResponses, rate: Mapping[str, Array], index: int, axis: int, outwards: int) -> Array:
    """O and I of one side of a patch (station, 2) [unit of a station per m]; rate k (nx, ny) [1/m] by experiment.

        O = (I + sum of dk / w over the cells beside it) / 2,   I = sum of dk / w over the cells within

    w is the width of these cells and dk the k of those within less that of those beside them. A strip that is gained
    stands where water was fast, and slows it: half of it counts as if water were slow there already. Of what a second
    solver does where all sides lie up to 0.1 m off, this leaves a twentieth of the squares; with I alone half was left.
    """
    inside, width = model.site.main_patch == index, (model.site.grid.dx, model.site.grid.dy)[axis]
    within, found = inside & ~_next(inside, axis, outwards), np.zeros((len(model.station), 2))
    # Cells that are covered in part differ by that part of what plants and bed differ by.
    width = width * np.maximum(model.site.cover - _next(model.site.cover, axis, outwards), 0.5)
    for experiment, rows in model.rows.items():
        if index in patches_present(model.case, experiment):
            excess = within * (rate[experiment] - _next(rate[experiment], axis, outwards)) / width
            beside = ~inside * _next(excess, axis, -outwards)
            answers = cells.of["drag"][rows].reshape(rows.size, inside.size)
            inwards, beyond = answers @ excess.ravel(), answers @ beside.ravel()
            found[rows] = np.stack([0.5 * (inwards + beyond), inwards], axis=1)
    return found


def _next(field: NDArray[Any], axis: int, step: int) -> NDArray[Any]:
    """What the next cell along an axis has, (nx, ny); at the end of the grid the cell itself."""
    count = field.shape[axis]
    return np.take(field, np.clip(np.arange(count) + step, 0, count - 1), axis)


def _friction_rate(cells: CellResponses, rows: NDArray[np.int_]) -> Array:
    """k (nx, ny) [1/m] in the experiment of some stations: what answers to friction made larger by its own part is k
    times what answers to drag.
    """
    friction, drag = (cells.of[term][rows].astype(float) for term in ("friction", "drag"))
    return np.asarray((friction * drag).sum(axis=0) / np.maximum((drag**2).sum(axis=0), np.finfo(float).tiny))


def _patches(model: Model, cells: CellResponses) -> Array:
    """Answers to the relative friction of each patch (station, patches); none in experiments without it."""
    patch, columns = model.site.main_patch, [np.zeros((len(model.station), 0))]
    for index in np.unique(patch[patch >= 0]):
        answers = cells.of["friction"][:, patch == index].sum(axis=1)
        for experiment, rows in model.rows.items():
            answers[rows] *= index in patches_present(model.case, experiment)
        columns.append(answers[:, None])
    return np.hstack(columns)


# The term that each unlisted effect of the library changes at its place.
TERM_OF: dict[str, Term] = {
    "unlisted_object": "drag",
    "unlisted_bed": "bed",
    "unlisted_inflow": "inflow",
    "unlisted_viscosity": "viscosity",
}
# Radius of a bump over the half width of the floor [-]: friction differs from one stone, tuft or stem count to the
# next, a survey from one line of points to the next. Chosen, not measured.
FRICTION_RADIUS, BED_RADIUS = 0.3, 0.5
# How far around a spot what it leaves of an object of another shape may act, over its size [-]. Chosen.
AROUND = 2.0
# Least radius of a bump in cells: below, bumps look unlike, as their middles lie in cells or between them.
BUMP_CELLS = 1.5
# Below it a bump counts as zero [-]: responses hold seven digits. Smaller ones are not told from zero in single
# precision and take a processor ten times as long.
LEAST_BUMP = 1e-15


@dataclass(frozen=True)
class Bumps:
    """Bumps exp(-((x - x_k) / l)^2 - ((y - y_j) / w)^2) over a grid: along (k, nx) and across (j, ny) [-], their
    middles x, y [m], l and w [m].
    """

    x: Array
    y: Array
    length: float
    width: float
    along: Array
    across: Array


def bumps(grid: Grid, length: float, width: float, cells: float = BUMP_CELLS) -> Bumps:
    """Bumps of half length l and half width w [m], as far apart, and of at least so many cells."""
    length, width = max(length, cells * grid.dx), max(width, cells * grid.dy)
    return bumps_at(grid, _raster(grid.x, length), _raster(grid.y, width), length, width)


def bumps_at(grid: Grid, x: Array, y: Array, length: float, width: float) -> Bumps:
    """Bumps of half length l and half width w [m] around all x (k,) and y (j,) [m]."""
    return Bumps(x, y, length, width, _bump(grid.x, x, length), _bump(grid.y, y, width))


def _bump(cells: Array, middles: Array, radius: float) -> Array:
    """exp(-((c - m) / r)^2) of cells (n,) around middles (k,), (k, n) [-]."""
    found = np.exp(-(((cells[None] - middles[:, None]) / radius) ** 2))
    return np.where(found < LEAST_BUMP, 0.0, found)


def responses_to_bumps(responses: CellResponses, term: Term, over: Bumps) -> Array:
    """d prediction / d size of each bump (station, k, j) [unit of a station per that of the term]."""
    of_cells = responses.of[term]
    # Across first, in the precision of the responses: a fifth of the time that a product of all three takes in double.
    by_row = of_cells.reshape(-1, of_cells.shape[2]) @ over.across.T.astype(of_cells.dtype)
    return np.asarray(np.matmul(over.along, by_row.reshape(*of_cells.shape[:2], -1)), dtype=float)


def field_columns(responses: CellResponses, term: Term, over: Bumps) -> Array:
    """Columns F (station, k j) with F F' the covariance of predictions under a field of the bumps of variance one."""
    variance = (over.along**2).sum(axis=0).mean() * (over.across**2).sum(axis=0).mean()
    return responses_to_bumps(responses, term, over).reshape(len(responses.of[term]), -1) / np.sqrt(variance)


def model_error_columns(model: Model, point: Point, allowed: ModelError) -> Array:
    """Columns (station, k) with M = columns columns', see the head of this file; none where no error is allowed."""
    if not any_error(allowed):
        return np.zeros((len(model.station), 0))
    objects = unlisted_in(model.case)
    of_sides: tuple[Term, ...] = ("drag",) if allowed.edges else ()
    terms = dict.fromkeys(("friction", *of_sides, "bed", *(one.term for one in objects)))
    responses, half, grid = cell_responses(model, point, tuple(terms)), half_width(model.site), model.site.grid
    friction = bumps(grid, FRICTION_RADIUS * half, FRICTION_RADIUS * half)
    bed = bumps(grid, BED_RADIUS * half, BED_RADIUS * half)
    return np.hstack(
        [
            allowed.friction * field_columns(responses, "friction", friction),
            allowed.bed * field_columns(responses, "bed", bed),
            *(_columns_of_shape(model, point, responses, one) for one in objects),
            site_error_columns(model, point, allowed, responses),
        ]
    )


def any_error(allowed: ModelError) -> bool:
    """Whether any error of the model or of its site is allowed."""
    return any(allowed.model_dump().values())


@dataclass(frozen=True)
class UnlistedObject:
    """Something unlisted at a place that acts in a case: its term, its amplitude and its spot, numbers or names of
    parameters; experiments: where it acts, None for all.
    """

    term: Term
    amplitude: Value
    place: dict[str, Value]
    experiments: tuple[str, ...] | None


def unlisted_in(case: Case) -> list[UnlistedObject]:
    """Those of a case."""
    found = []
    for name, entry in case.effects.items():
        effect = effect_of(case, name)
        if effect.name in TERM_OF:
            place = {shape.name: entry.values.get(shape.name, shape.default) for shape in effect.shapes}
            amplitude = entry.values.get(effect.amplitude.name, effect.amplitude.off)
            found.append(UnlistedObject(TERM_OF[effect.name], amplitude, place, entry.experiments))
    return found


def _columns_of_shape(model: Model, point: Point, responses: CellResponses, one: UnlistedObject) -> Array:
    """S_k of the bumps around a spot, but for what looks like another size."""
    theta = theta_at(model.case, point.z[None])
    place = {name: float(value_of(value, theta, 1)[0]) for name, value in one.place.items()}
    half, grid = FRICTION_RADIUS * half_width(model.site), model.site.grid
    over, spot = bumps(grid, half, half), _spot(grid, place)
    near = _are_around(over, place)
    size = float(value_of(one.amplitude, theta, 1)[0])
    whole = size if one.term == "inflow" else size * float(_areas(grid, spot)[0, 0])
    in_each = constants().shape_error * whole / np.sqrt(max(int(near.sum()), 1))
    own = responses_to_bumps(responses, one.term, spot)[:, 0, 0]
    acts = np.ones(len(own)) if one.experiments is None else model.station["experiment"].isin(one.experiments)
    columns = _without(own, responses_to_bumps(responses, one.term, over)[:, near], _weights_of(model) * acts)
    return np.asarray(in_each / _areas(grid, over)[near] * columns * np.asarray(acts)[:, None])


def _spot(grid: Grid, place: Mapping[str, float]) -> Bumps:
    """The one bump of a place."""
    return bumps_at(grid, np.array([place["x"]]), np.array([place["y"]]), place["length"], place["width"])


def _are_around(over: Bumps, place: Mapping[str, float]) -> Any:
    """Which bumps stand around a place (k, j)."""
    along = ((over.x - place["x"]) / (place["length"] + over.length)) ** 2
    across = ((over.y - place["y"]) / (place["width"] + over.width)) ** 2
    return along[:, None] + across[None] < AROUND**2


def _areas(grid: Grid, over: Bumps) -> Array:
    """A_k of a size of one, (k, j) [m2]."""
    return grid.dx * grid.dy * np.outer(over.along.sum(axis=1), over.across.sum(axis=1))


def _weights_of(model: Model) -> Array:
    """1 / s^2 of each station in use [per its unit squared], 0 of others and where no standard error s is told."""
    error = model.station["standard_error"].where(model.station["used"])
    return np.nan_to_num(error.to_numpy(float) ** -2.0)


def _without(direction: Array, columns: Array, weight: Array) -> Array:
    """Columns (station, k) less their part along a direction (station,), by weights (station,)."""
    squared = float(weight @ direction**2)
    share = (weight * direction) @ columns / squared if squared > 0.0 else np.zeros(columns.shape[1])
    return np.asarray(columns - np.outer(direction, share))


def _raster(centres: Array, spacing: float) -> Array:
    count = max(round((centres[-1] - centres[0]) / spacing), 1)
    return np.linspace(centres[0], centres[-1], count + 1)
