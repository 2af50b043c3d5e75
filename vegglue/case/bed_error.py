"""How wrong the bed of each cell may be between the points of its surveys, on any grid."""

import hashlib

import numpy as np

from vegglue.arrays import Array, Mask
from vegglue.case.bed import layer_levels
from vegglue.case.grid import Grid
from vegglue.case.schema import Case
from vegglue.case.site_schema import BedLayer, SurveyOfBed
from vegglue.case.survey_error import conditional, read_bed_survey

# Beds whose errors are kept in memory.
MOST_BED_ERRORS = 8
_kept: dict[bytes, Array] = {}


def beds_of(case: Case) -> list[BedLayer]:
    """Layers of the bed of a case and of its experiments."""
    return [*case.bed, *(layer for one in case.experiments.values() for layer in one.bed or ())]


def without_surveys(case: Case) -> Case:
    """The case as if no survey of its bed stated an error."""
    experiments = {
        name: one.model_copy(update={"bed": _plain(one.bed)}) if one.bed else one
        for name, one in case.experiments.items()
    }
    return case.model_copy(update={"bed": _plain(case.bed), "experiments": experiments})


def _plain(layers: tuple[BedLayer, ...]) -> tuple[BedLayer, ...]:
    return tuple(layer.model_copy(update={"survey": None}) for layer in layers)


def bed_error_columns(case: Case, grid: Grid, experiment: str = "") -> Array:
    """Columns B (nx ny, k) [m] with B B' the covariance of the error of `bed_levels` by the surveys of its layers; none
    if no layer has a survey. Computed once for a bed. Errors: InputError if a survey cannot be read.
    """
    own = case.experiments[experiment].bed if experiment in case.experiments else None
    layers, parts = (*case.bed, *(own or ())), [np.zeros((grid.x.size * grid.y.size, 0))]
    free = np.ones(grid.x.size * grid.y.size, dtype=bool)
    for layer in reversed(layers) if any(one.survey is not None for one in layers) else ():
        level = layer_levels(layer, grid, case.grid.x[0]).ravel()
        if layer.survey is not None:
            parts.append(_columns_of_survey(layer.survey, grid, level, free & ~np.isnan(level)))
        free &= np.isnan(level)
    return np.hstack(parts)


def _columns_of_survey(survey: SurveyOfBed, grid: Grid, level: Array, there: Mask) -> Array:
    """Those of the layer that gives the levels (nx ny,) [m] of some cells, zero in others."""
    read = read_bed_survey(survey.file, survey.loose)
    digest = hashlib.sha256(survey.model_dump_json(exclude={"file"}).encode())
    for values in (read.points, read.line, grid.x, grid.y, level, there):
        digest.update(values.tobytes())
    found = _kept.get(digest.digest())
    if found is None:
        places = np.column_stack([part.ravel() for part in np.meshgrid(grid.x, grid.y, indexing="ij")])
        found = np.zeros((level.size, 0))
        if there.any():
            some = conditional(read, survey.covariances, places[there], level[there]).columns
            found = np.zeros((level.size, some.shape[1]))
            found[there] = some
        while len(_kept) >= MOST_BED_ERRORS:
            _kept.pop(next(iter(_kept)), None)
        _kept[digest.digest()] = found
    return found
