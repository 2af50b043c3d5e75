"""How wrong the bed of each cell may be between the points of its surveys, on any grid."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from vegglue.arrays import Array, Mask
from vegglue.case.bed import all_places, cell_places, kept_mean_level, layer_levels, spline_places, surveyed, to_cells
from vegglue.case.grid import Grid
from vegglue.case.schema import Case
from vegglue.case.site_schema import BedLayer, CovarianceOfBed
from vegglue.case.survey_error import BedSurvey, evidence_of_lines, line_weights, root_of_covariance
from vegglue.memoised import memoised

# Beds whose errors and lines are kept in memory, most of them of one column of cells.
MOST_BEDS_KEPT = 48


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


@dataclass(frozen=True)
class SurveyedLayer:
    """A layer of the bed with a survey.

    Attributes
    ----------
    index : int
        Among the layers.
    read : BedSurvey
        The survey as read.
    level : ndarray (nx ny,)
        [m]
    there : ndarray of bool (nx ny,)
        Cells that have its levels.
    """

    index: int
    covariances: tuple[CovarianceOfBed, ...]
    read: BedSurvey
    level: Array
    there: Mask

    def in_cells(self, values: Array) -> Array:
        """Values of the cells that have its levels (cells, k) among all (nx ny, k), zero in others."""
        found = np.zeros((self.level.size, values.shape[1]), values.dtype)
        found[self.there] = values
        return found


def bed_error_columns(case: Case, grid: Grid, experiment: str = "") -> Array:
    """B with B B' the covariance of the error of `bed_levels` by the surveys of its layers.

    The bed may be off the mean of its covariances by more than that: where it is, the distance is one more column.

    Parameters
    ----------
    case, grid, experiment
        As `bed_levels`.

    Returns
    -------
    (nx ny, k) [m]
        Without columns if no layer has a survey.

    Raises
    ------
    InputError
        If a survey cannot be read.
    """
    layers = [one for one in _surveyed_layers(case, grid, experiment) if one.there.any()]
    found = [_error_columns_of(one, grid) for one in layers]
    return found[0] if len(found) == 1 else np.hstack([np.zeros((grid.x.size * grid.y.size, 0)), *found])


@memoised(MOST_BEDS_KEPT)
def _error_columns_of(one: SurveyedLayer, grid: Grid) -> Array:
    x, y = spline_places(grid, one.covariances)
    error = to_cells(_root_of_covariance(one.read, one.covariances, all_places(x, y)), x, y, grid)
    off = one.level.ravel() - kept_mean_level(one.read, one.covariances, cell_places(grid))
    return one.in_cells(np.column_stack([off.astype("float32"), error])[one.there])


_root_of_covariance = memoised(MOST_BEDS_KEPT)(root_of_covariance)  # grids of one reach share their places


@dataclass(frozen=True)
class SurveyedLine:
    """A line of the survey of a layer of the bed.

    Attributes
    ----------
    layer : int
        Index of the layer.
    number : int
        Of the line in that survey.
    x, y : float
        Its middle [m].
    """

    layer: int
    number: int
    x: float
    y: float


@dataclass(frozen=True)
class SurveyedLines:
    """Lines between two others of the bed that all experiments share, without loose ones.

    Attributes
    ----------
    weights
        By how much the bed of each cell rises with the level of each (nx ny, lines) [-].
    evidence
        h and H, see `evidence_of_lines`.
    """

    lines: tuple[SurveyedLine, ...]
    weights: Array
    evidence: tuple[Array, Array]


def surveyed_lines(case: Case, grid: Grid) -> SurveyedLines:
    """Lines whose level may be wrong, of a case on a grid.

    The outermost lines are no candidates: beyond them the bed may go on otherwise. Of 220 drawn surveys without a wrong
    line 5 % had one that was off by more than 4.5 standard errors, always an outermost one.

    Raises
    ------
    InputError
        If a survey cannot be read.
    """

    layers = [one for one in _surveyed_layers(case, grid) if one.there.any() and one.read.lines]
    found = [_lines_of(one, grid) for one in layers]
    weights = np.hstack([np.zeros((grid.x.size * grid.y.size, 0)), *(one.weights for one in found)])
    h = np.concatenate([np.zeros(0), *(one.evidence[0] for one in found)])
    columns = block_diag(np.zeros((0, 0)), *(one.evidence[1] for one in found))
    return SurveyedLines(tuple(line for one in found for line in one.lines), weights, (h, columns))


@memoised(MOST_BEDS_KEPT)
def _lines_of(one: SurveyedLayer, grid: Grid) -> SurveyedLines:
    rows = one.read.lines
    numbers = [int(one.read.line[own[0]]) for own in rows]
    kept = [j for j in range(1, len(rows) - 1) if numbers[j] not in one.read.loose]
    middles = [one.read.points[rows[j], :2].mean(axis=0) for j in kept]
    weights = one.in_cells(line_weights(one.read, one.covariances, cell_places(grid)[one.there]))
    h, columns = evidence_of_lines(one.read, one.covariances)
    lines = [SurveyedLine(one.index, numbers[j], *map(float, at)) for j, at in zip(kept, middles, strict=True)]
    return SurveyedLines(tuple(lines), weights[:, kept], (h, columns[:, kept]))


def without_level(case: Case, line: SurveyedLine) -> Case:
    """The case with the level of a surveyed line unknown."""
    layer = case.bed[line.layer]
    assert layer.survey is not None
    survey = layer.survey.model_copy(update={"relevelled": (*layer.survey.relevelled, line.number)})
    bed = [one if one is not layer else layer.model_copy(update={"survey": survey}) for one in case.bed]
    return case.model_copy(update={"bed": tuple(bed)})


def _surveyed_layers(case: Case, grid: Grid, experiment: str = "") -> Iterator[SurveyedLayer]:
    """Those of a case, or of one of its experiments; of each cell the last layer with data counts."""
    own = case.experiments[experiment].bed if experiment in case.experiments else None
    layers = (*case.bed, *(own or ()))
    free = np.ones(grid.x.size * grid.y.size, dtype=bool)
    for index, layer in reversed(list(enumerate(layers))) if any(one.survey is not None for one in layers) else ():
        level = layer_levels(layer, grid, case.grid.x[0]).ravel()
        if (survey := layer.survey) is not None:
            yield SurveyedLayer(index, survey.covariances, surveyed(survey), level, free & ~np.isnan(level))
        free &= np.isnan(level)
