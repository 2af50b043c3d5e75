"""Errors of a site that nobody would call a missing effect: a site is like that.

    S = s_y^2 diag((du/dy)^2) + s_q^2 sum_e Q_e Q_e' + s_n^2 sum_p P_p P_p' + s_e^2 sum_s E_s E_s'

du/dy is how a velocity changes where a probe stands beside its place, Q_e answers to the discharge of experiment e, P_p
to the friction of patch p, and E_s to side s of a patch that lies 1 m further out, all in units of a station.
Source: definition; which errors are meant, and of which size, is chosen (see DECISIONS).
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.calibration.cell_responses import CellResponses
from vegglue.case.case_effects import effect_of
from vegglue.case.schema import Case, EffectEntry, ModelError, Parameter
from vegglue.engine.interface import Cause, Model, Point, responses
from vegglue.measurements.kinds import velocity_rows
from vegglue.site.channel_geometry import patches_present

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


def _patches(model: Model, cells: CellResponses) -> Array:
    """Answers to the relative friction of each patch (station, patches)."""
    return _summed(model, cells, lambda inside: [inside.astype(float)])


def _sides(model: Model, cells: CellResponses) -> Array:
    """Answers to each side of each patch further out (station, sides) [unit of a station per m].

    To first order the strip that is gained, d wide, is friction of the cells inside that side made larger by d over
    their width: what the bed among stems resists by itself is left out.
    """
    grid = model.site.grid

    def sides(inside: NDArray[np.bool_]) -> list[Array]:
        return [
            (inside & ~np.roll(inside, step, axis)) / width
            for axis, width in ((0, grid.dx), (1, grid.dy))
            for step in (-1, 1)
        ]

    return _summed(model, cells, sides)


def _summed(model: Model, cells: CellResponses, parts: Callable[[NDArray[np.bool_]], list[Array]]) -> Array:
    """Answers to friction in each part of each patch (station, parts); none in experiments in which it is not there."""
    patch, columns = model.site.patch, [np.zeros((len(model.station), 0))]
    for index in np.unique(patch[patch >= 0]):
        fields = np.array(parts(patch == index), dtype=float)
        answers = np.einsum("nij,kij->nk", cells.of["friction"], fields, optimize=True)
        for experiment, rows in model.rows.items():
            answers[rows] *= index in patches_present(model.case, experiment)
        columns.append(answers)
    return np.hstack(columns)
