"""Errors of a site that nobody would call a missing effect: a site is like that.

    S = s_y^2 diag((du/dy)^2) + s_q^2 sum_e Q_e Q_e' + s_n^2 sum_p P_p P_p' + s_e^2/2 sum_s (O_s O_s' + I_s I_s')

du/dy is how a velocity changes where a probe stands beside its place, Q_e answers to the discharge of experiment e, P_p
to the friction of patch p, O_s to side s of a patch that lies 1 m further out and I_s to one 1 m further in, all in
units of a station. A side lies out or in, with the same chance.
Source: definition; which errors are meant, and of which size, is chosen (see DECISIONS).
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.calibration.cell_responses import CellResponses
from vegglue.case.case_effects import effect_of
from vegglue.case.channel_geometry import patches_present
from vegglue.case.schema import Case, EffectEntry, ModelError, Parameter
from vegglue.engine.interface import Cause, Model, Point, responses
from vegglue.measurements.kinds import velocity_rows

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
