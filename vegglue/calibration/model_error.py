"""The model's own error: friction and bed are a little wrong everywhere, and the same in all experiments.

    M = (s_f^2 / v) sum_k T_k T_k' + (s_b^2 / v) sum_k B_k B_k' + R C R' + S,   v = mean over cells of sum_k b_k^2 [-]

T_k and B_k are how predictions answer to friction made larger by its own part, and to a bed 1 m higher, in a Gaussian
basis function b_k = exp(-d^2 / l^2) around place k; these stand a radius apart, so that their sum is a smooth random
field of standard deviation s_f [-] or s_b [m]. R is how predictions answer to the bed of each cell, and C the
covariance of what a survey leaves open between its points (case/survey_error.py). S are errors of the site that are no
missing effect:

    S = s_y^2 diag((du/dy)^2) + s_q^2 sum_e Q_e Q_e' + s_n^2 sum_p P_p P_p' + s_e^2/2 sum_s (O_s O_s' + I_s I_s')

du/dy is how a velocity changes where a probe stands beside its place, Q_e answers to the discharge of experiment e, P_p
to the friction of patch p, O_s to side s of a patch that lies 1 m further out and I_s to one 1 m further in, all in
units of a station. A side lies out or in, with the same chance. Within a cell of a wall the model has one velocity,
the mean of the profile u(y) = u*/kappa ln(y/z_0) whose standard deviation over the cell is u*/kappa; S has its square
there, with u* = c_w^(1/2) |u| by the friction of the wall.

Something unlisted at a place, once it is in the model, is a spot there and something else in nature: of all that it
does, its force, water or volume A, shape_error may act in the n basis functions around it instead,

    S_k = shape_error A / (A_k sqrt(n)) b_k,   A_k = sum of b_k over the cells, times their area,

so that in all of them together it has a standard deviation of shape_error A. What of that would look like another size
of the spot is left out, since the size is calibrated: water that enters at a place was all error of shape before.
Plants that are not on the map have no such error: their outline is fitted, and beside them responses to first order
lead far off.
Source: a model has its own error in weak-constraint data assimilation (Tremolet 2006, doi:10.1256/qj.05.224; not
checked against it); the fields are a definition of this project, and which errors are meant is chosen (see DECISIONS).
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array, Mask
from vegglue.case.bed_error import bed_error_columns, beds_of
from vegglue.case.case_effects import effect_of, value_of
from vegglue.case.channel_geometry import half_width, patches_present
from vegglue.case.grid import Grid
from vegglue.case.parameter_space import theta_at
from vegglue.case.schema import Case, EffectEntry, ModelError, Parameter
from vegglue.case.zones import centres_within
from vegglue.decision_constants import constants
from vegglue.effects.physical_constants import KARMAN
from vegglue.engine.interface import Cause, Model, Point, responses, responses_to_cells
from vegglue.engine.newton import problem_at
from vegglue.flow.local_changes import Term
from vegglue.measurements.kinds import velocity_rows
from vegglue.parallel import in_threads

# What may be at a place: a term of the equations, or a barrier, drag that is even across the channel.
Unlisted = Literal["drag", "barrier", "bed", "inflow", "viscosity"]
# The effect of the library that is a spot of it, and the term that a spot changes.
EFFECT_AT_PLACE: dict[Unlisted, str] = {
    "drag": "unlisted_object",
    "barrier": "unlisted_barrier",
    "bed": "unlisted_bed",
    "inflow": "unlisted_inflow",
    "viscosity": "unlisted_viscosity",
}
TERM_OF: dict[str, Term] = {
    effect: "drag" if unlisted == "barrier" else unlisted for unlisted, effect in EFFECT_AT_PLACE.items()
}
# Radius of a basis function over the half width of the floor [-]: friction differs from one stone, tuft or stem count
# to the next, a survey from one line of points to the next. Chosen, not measured.
FRICTION_RADIUS, BED_RADIUS = 0.3, 0.5
# How far around a spot what it leaves of an object of another shape may act, over its size [-]. Chosen.
AROUND = 2.0
# Least radius of a basis function in cells: below, they look unlike, as their middles lie in cells or between them.
LEAST_CELLS = 1.5
# Below it a basis function counts as zero [-]: responses hold seven digits. Smaller ones are lost in single precision
# and take a processor ten times as long.
LEAST_VALUE = 1e-15
# The name of an effect that is tried alone, and of its amplitude; no case has it.
TRIED, AMOUNT = "error_of_the_site", "error_of_the_site_amount"
UNKNOWN = Parameter(distribution="uniform", low=-1.0, high=1.0, unit="-")


@dataclass(frozen=True)
class CellResponses:
    """d prediction / d term of all stations, for a change of the term in each cell of a grid.

    Attributes
    ----------
    of : dict of ndarray (station, nx, ny)
        By term [unit of each station per that of the term].
    """

    grid: Grid
    of: dict[Term, NDArray[np.float32]]


def excluded_terms(case: Case) -> set[Unlisted]:
    """What no place may change, and no field: the case excludes its effect, or walls keep water out."""
    excluded = {term for term, name in EFFECT_AT_PLACE.items() if name in (case.exclude or ())}
    return excluded if case.friction.walls is None else excluded | {"inflow"}


def cell_responses(model: Model, point: Point, terms: tuple[Term, ...]) -> CellResponses:
    """d prediction / d term in each cell, of all experiments in parallel.

    Returns
    -------
    CellResponses
        [unit of each station per that of the term]
    """
    shape = (len(model.station), model.site.grid.x.size, model.site.grid.y.size)
    found = {term: np.zeros(shape, dtype=np.float32) for term in terms}

    def fill(experiment: str) -> None:
        for rows, of in responses_to_cells(model, point, experiment, terms):
            for term in terms:
                found[term][rows] = of[term]

    in_threads(fill, [(experiment,) for experiment in point.flows])
    return CellResponses(model.site.grid, found)


@dataclass(frozen=True)
class GaussianBasis:
    """b_kj = exp(-((x - x_k) / l)^2 - ((y - y_j) / w)^2) over a grid

    Attributes
    ----------
    x, y : ndarray (k,), (j,)
        Middles [m].
    length, width : float
        l and w [m].
    along, across : ndarray (k, nx), (j, ny)
        The two factors at cell centres [-].
    """

    x: Array
    y: Array
    length: float
    width: float
    along: Array
    across: Array

    def areas(self, grid: Grid) -> Array:
        """A_kj of a size of one (k, j) [m2]."""
        return grid.dx * grid.dy * np.outer(self.along.sum(axis=1), self.across.sum(axis=1))


def gaussian_basis(grid: Grid, length: float, width: float, cells: float = LEAST_CELLS) -> GaussianBasis:
    """Functions of half length l and half width w, about l and w apart, over the whole grid.

    Parameters
    ----------
    length, width : float
        l and w [m], made larger if they are less than `cells` cells.
    cells : float
        [-]
    """
    length, width = max(length, cells * grid.dx), max(width, cells * grid.dy)
    x, y = (
        np.linspace(centres[0], centres[-1], max(round((centres[-1] - centres[0]) / spacing), 1) + 1)
        for centres, spacing in ((grid.x, length), (grid.y, width))
    )
    return gaussian_basis_at(grid, x, y, length, width)


def gaussian_basis_at(grid: Grid, x: Array, y: Array, length: float, width: float) -> GaussianBasis:
    """b_kj = exp(-((x - x_k) / l)^2 - ((y - y_j) / w)^2), 0 below LEAST_VALUE.

    Parameters
    ----------
    x, y : ndarray (k,), (j,)
        Middles; there is a function at every pair [m].
    length, width : float
        l and w [m].
    """
    along, across = (
        np.exp(-(((cells[None] - middles[:, None]) / radius) ** 2))
        for cells, middles, radius in ((grid.x, x, length), (grid.y, y, width))
    )
    along, across = (np.where(found < LEAST_VALUE, 0.0, found) for found in (along, across))
    return GaussianBasis(x, y, length, width, along, across)


def responses_to_basis(responses: CellResponses, term: Term, basis: GaussianBasis) -> Array:
    """sum_cells d prediction / d term b_kj: responses to a size of one of each function.

    Returns
    -------
    ndarray (station, k, j)
        [unit of each station per that of the term]
    """
    of_cells = responses.of[term]
    # Across first, in the precision of the responses: a fifth of the time that a product of all three takes in double.
    by_row = of_cells.reshape(-1, of_cells.shape[2]) @ basis.across.T.astype(of_cells.dtype)
    return np.asarray(np.matmul(basis.along, by_row.reshape(*of_cells.shape[:2], -1)), dtype=float)


def field_columns(responses: CellResponses, term: Term, basis: GaussianBasis) -> Array:
    """F with F F' the covariance of predictions under a smooth random field of variance one.

    Returns
    -------
    ndarray (station, k j)
        [unit of each station per that of the term]
    """
    variance = (basis.along**2).sum(axis=0).mean() * (basis.across**2).sum(axis=0).mean()
    return responses_to_basis(responses, term, basis).reshape(len(responses.of[term]), -1) / np.sqrt(variance)


def any_error(case: Case, allowed: ModelError) -> bool:
    """Whether any error of the model or of its site is allowed, or a survey states one."""
    return any(allowed.model_dump().values()) or any(layer.survey is not None for layer in beds_of(case))


def model_error_columns(model: Model, point: Point, allowed: ModelError, cells: CellResponses | None = None) -> Array:
    """M = columns columns', the covariance of the model's own error, see the head of this file.

    Parameters
    ----------
    model : Model
        Its case may hold unlisted objects, whose shapes err.
    point : Point
        The flow and parameters at which predictions are linearised.
    allowed : ModelError
        s_f [-] and s_b [m], and s_e [m], s_y [m], s_q [-], s_n [-] of the site.
    cells : CellResponses, optional
        To the terms of `terms_that_err`, if they are known.

    Returns
    -------
    array (station, k)
        [m/s or m]; no columns if no error is allowed.
    """
    if not any_error(model.case, allowed):
        return np.zeros((len(model.station), 0))
    cells = cells or cell_responses(model, point, terms_that_err(model.case, allowed))
    objects = _objects(model.case)
    friction, bed = error_bases(model)
    return np.hstack(
        [
            allowed.friction * field_columns(cells, "friction", friction),
            allowed.bed * field_columns(cells, "bed", bed),
            survey_error_columns(model, cells),
            *(shape_error_columns(model, point, cells, key, TERM_OF[effect]) for key, effect in objects),
            site_error_columns(model, point, allowed, cells),
        ]
    )


def error_bases(model: Model) -> tuple[GaussianBasis, GaussianBasis]:
    """Basis functions of the errors of friction and of the bed.

    Returns
    -------
    GaussianBasis, GaussianBasis
        FRICTION_RADIUS and BED_RADIUS half widths of the floor wide.
    """
    half = half_width(model.site)
    friction, bed = (gaussian_basis(model.site.grid, one * half, one * half) for one in (FRICTION_RADIUS, BED_RADIUS))
    return friction, bed


def terms_that_err(case: Case, allowed: ModelError) -> tuple[Term, ...]:
    """Those of which `model_error_columns` needs responses."""
    of_sides: tuple[Term, ...] = ("drag",) if allowed.edges else ()
    of_objects = (TERM_OF[effect] for _, effect in _objects(case))
    return tuple(dict.fromkeys(("friction", *of_sides, "bed", *of_objects)))


def _objects(case: Case) -> list[tuple[str, str]]:
    """Key and effect of what the case has at places in no list."""
    of = [(key, effect_of(case, key).name) for key in case.effects]
    return [(key, effect) for key, effect in of if effect in TERM_OF]


def survey_error_columns(model: Model, cells: CellResponses) -> Array:
    """R C R' = columns columns': what surveyed beds err by, at the stations.

    R are the responses to the bed, C is the covariance of its error, of each bed its own.

    Parameters
    ----------
    cells : CellResponses
        To the bed.

    Returns
    -------
    ndarray (station, k)
        [unit of each station]; no columns if no survey states its error.
    """
    parts, case, grid = [np.zeros((len(model.station), 0))], model.case, model.site.grid
    with_own = {name: rows for name, rows in model.rows.items() if name in model.site.own}
    shared = [rows for name, rows in model.rows.items() if name not in with_own]
    for name, rows in [("", np.concatenate([*shared, np.zeros(0, int)])), *with_own.items()]:
        error = bed_error_columns(case, grid, name)
        found = np.zeros((len(model.station), error.shape[1]))
        found[rows] = cells.of["bed"][rows].reshape(len(rows), -1) @ error.astype(cells.of["bed"].dtype, copy=False)
        parts.append(found)
    return np.hstack(parts)


def shape_error_columns(model: Model, point: Point, cells: CellResponses, key: str, term: Term) -> Array:
    """S_k of the basis functions around the spot of an effect, without what looks like another size."""
    effect, entry, theta = effect_of(model.case, key), model.case.effects[key], theta_at(model.case, point.z[None])

    def value(name: str, default: float) -> float:
        return float(value_of(entry.values.get(name, default), theta, 1)[0])

    place = {shape.name: value(shape.name, shape.default) for shape in effect.shapes}
    size = value(effect.amplitude.name, effect.amplitude.off)
    half, grid = FRICTION_RADIUS * half_width(model.site), model.site.grid
    basis = gaussian_basis(grid, half, half)
    spot = gaussian_basis_at(grid, np.array([place["x"]]), np.array([place["y"]]), place["length"], place["width"])
    along = ((basis.x - place["x"]) / (place["length"] + basis.length)) ** 2
    across = ((basis.y - place["y"]) / (place["width"] + basis.width)) ** 2
    near = along[:, None] + across[None] < AROUND**2
    whole = size if term == "inflow" else size * float(spot.areas(grid)[0, 0])
    if effect.name == EFFECT_AT_PLACE["barrier"]:
        whole /= 2.0 * np.sqrt(np.pi) * place["length"]
    in_each = constants().shape_error * whole / np.sqrt(max(int(near.sum()), 1))
    own, others = responses_to_basis(cells, term, spot)[:, 0, 0], responses_to_basis(cells, term, basis)[:, near]
    acts = np.ones(len(own)) if entry.experiments is None else model.station["experiment"].isin(entry.experiments)
    # Without their part along the spot's own trace, weighted by 1 / s^2; 0 if no standard error s is stated.
    error = model.station["standard_error"].where(model.station["used"])
    weight = np.nan_to_num(error.to_numpy(float) ** -2.0) * acts
    squared = float(weight @ own**2)
    share = (weight * own) @ others / squared if squared > 0.0 else np.zeros(others.shape[1])
    columns = np.asarray(others - np.outer(own, share))
    return np.asarray(in_each / basis.areas(grid)[near] * columns * np.asarray(acts)[:, None])


def site_error_columns(model: Model, point: Point, allowed: ModelError, cells: CellResponses) -> Array:
    """Columns with S = columns columns', see the head of this file.

    A discharge, or the stems of a patch, that an effect of the case changes has no error beside it.

    Parameters
    ----------
    cells : CellResponses
        To friction and, if sides of patches may lie off, to drag.

    Returns
    -------
    ndarray (station, k)
        [unit of each station]
    """
    columns = [np.zeros((len(model.station), 0))]
    of_discharge, of_stems = set[str](), set[int]()
    for name, entry in model.case.effects.items():
        if effect_of(model.case, name).name == "discharge_error":
            of_discharge |= set(entry.experiments or model.case.experiments)
        elif effect_of(model.case, name).name == "patch_density":
            of_stems.add(int(float(entry.values.get("patch", 1.0))) - 1)
    velocities = np.asarray(velocity_rows(model.station))
    if allowed.probes:
        slope = responses(model, point, [_cause(model.case, "station_shift")])[:, 0]
        columns.append(allowed.probes * np.diag(slope)[:, velocities])
    if (beside := beside_walls(model) & velocities).any():
        rate = problem_at(model, next(iter(point.flows)), point.z).walls.rate[0]  # c_w / dy, the same in all flows
        deviation = np.sqrt(rate * model.site.grid.dy) / KARMAN * np.abs(point.prediction)
        columns.append(np.diag(deviation)[:, beside])
    if allowed.discharge:
        stated = [name for name in model.case.experiments if name not in of_discharge]
        causes = [_cause(model.case, "discharge_error", name) for name in stated]
        columns.append(allowed.discharge * responses(model, point, causes))
    patch = model.site.main_patch
    for index in sorted(set(patch[patch >= 0]) - of_stems) if allowed.stems else ():
        answers = cells.of["friction"][:, patch == index].sum(axis=1)
        for experiment, rows in model.rows.items():
            answers[rows] *= index in patches_present(model.case, experiment)
        columns.append(allowed.stems * answers[:, None].astype(float))
    if allowed.edges:
        columns.append(allowed.edges * _sides(model, cells))
    return np.hstack(columns)


def beside_walls(model: Model) -> Mask:
    """Which stations lie within a cell of a side wall.

    Returns
    -------
    ndarray of bool (station,)
        False where water enters through a side, and without walls.
    """
    width, (x, y) = model.case.grid.cell[1], model.station[["x", "y"]].to_numpy(float).T
    beside = np.zeros(y.size, dtype=bool)
    for side, end in zip(("south", "north"), model.case.grid.y, strict=True):
        near = np.abs(y - end) <= width
        for inflow in (one for one in model.case.inflows.values() if one.side == side):
            near &= ~centres_within(inflow.range, x)
        beside |= near
    return beside & (model.case.friction.walls is not None)


def _cause(case: Case, effect: str, *experiments: str) -> Cause:
    """An effect of the library that acts alone, in some experiments or in all."""
    with_it = case.model_copy(update={"effects": {**case.effects, TRIED: EffectEntry(effect=effect, values={})}})
    amplitude = effect_of(with_it, TRIED).amplitude
    entry = EffectEntry(effect=effect, values={amplitude.name: AMOUNT}, experiments=experiments or None)
    changed = {"effects": {**case.effects, TRIED: entry}, "parameters": {**case.parameters, AMOUNT: UNKNOWN}}
    return Cause(case.model_copy(update=changed), AMOUNT, amplitude, experiments)


def _sides(model: Model, cells: CellResponses) -> Array:
    """O and I of each side of each patch, over 2^(1/2) (station, 2 sides) [unit of a station per m].

        O = (I + sum of dk / w over the cells beside it) / 2,   I = sum of dk / w over the cells within

    w is the width of these cells and dk the k of those within less that of those beside them. A strip that is gained
    stands where water was fast, and slows it: half of it counts as if water were slow there already. Of what a second
    solver does where all sides lie up to 0.1 m off, this leaves a twentieth of the squares; with I alone half was left.
    """
    site, parts = model.site, [np.zeros((len(model.station), 0))]
    patch, rate = site.main_patch, dict[str, Array]()
    friction, drag = (cells.of[term] for term in ("friction", "drag"))
    for experiment, rows in model.rows.items():
        # k (nx, ny) [1/m]: what answers to friction made larger by its own part is k times what answers to drag.
        both, square = (
            sum((one[n] * drag[n].astype(float) for n in rows), np.zeros(patch.shape)) for one in (friction, drag)
        )
        rate[experiment] = both / np.maximum(square, np.finfo(float).tiny)
    sides = [(axis, step) for axis in (0, 1) for step in (-1, 1)]
    for index, (axis, outwards) in ((int(index), side) for index in np.unique(patch[patch >= 0]) for side in sides):
        inside, width = patch == index, (site.grid.dx, site.grid.dy)[axis]
        within, found = inside & ~_next_cell(inside, axis, outwards), np.zeros((len(model.station), 2))
        # Cells that are covered in part differ by that part of what plants and bed differ by.
        width = width * np.maximum(site.cover - _next_cell(site.cover, axis, outwards), 0.5)
        for experiment, rows in model.rows.items():
            if index in patches_present(model.case, experiment):
                excess = within * (rate[experiment] - _next_cell(rate[experiment], axis, outwards)) / width
                beside = ~inside * _next_cell(excess, axis, -outwards)
                there = (excess != 0.0) | (beside != 0.0)
                answers = drag[:, there][rows]
                inwards, beyond = answers @ excess[there], answers @ beside[there]
                found[rows] = np.stack([0.5 * (inwards + beyond), inwards], axis=1)
        parts.append(found)
    return np.hstack(parts) / np.sqrt(2.0)


def _next_cell(field: NDArray[Any], axis: int, step: int) -> NDArray[Any]:
    """What the next cell along an axis has, (nx, ny); at the end of the grid the cell itself."""
    count = field.shape[axis]
    return np.take(field, np.clip(np.arange(count) + step, 0, count - 1), axis)
