"""The twin on coarse cells with its own bed as a raster that comes from lines across the channel."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from coarse_twin import coarse_twin

from vegglue.case.site_schema import BedLayer, CovarianceOfBed, SurveyOfBed
from vegglue.case.survey_error import BedSurvey, bed_survey_text
from vegglue.engine.interface import Model, Point

OF_BED = CovarianceOfBed(chance=1.0, along=4.0, across=1.5, sd=0.05, point_error=0.005)


def surveyed_twin(folder: Path) -> tuple[Model, Point]:
    """Its raster and survey in a folder; five lines, with a point in each row of cells."""
    model, point = coarse_twin()
    grid = model.site.grid
    size = min(grid.dx, grid.dy)
    x = np.arange(grid.x[0] - grid.dx, grid.x[-1] + 2.0 * grid.dx, size)
    y = np.arange(grid.y[0] - grid.dy, grid.y[-1] + 2.0 * grid.dy, size)
    level = np.stack([np.interp(y, grid.y, model.site.bed[int(np.abs(grid.x - at).argmin())]) for at in x])
    head = f"ncols {x.size}\nnrows {y.size}\nxllcenter {x[0]}\nyllcenter {y[0]}\ncellsize {size}\n"
    rows = "\n".join(" ".join(f"{one:.5f}" for one in row) for row in level.T[::-1])
    (folder / "bed.asc").write_text(head + rows + "\n", encoding="utf-8")
    every = np.linspace(0, grid.x.size - 1, 5).astype(int)
    points = [(grid.x[i], grid.y[j], model.site.bed[i, j]) for i in every for j in range(grid.y.size)]
    line = np.repeat(np.arange(every.size), grid.y.size)
    (folder / "survey.csv").write_text(bed_survey_text(BedSurvey(np.array(points), line)), encoding="utf-8")
    survey = SurveyOfBed(file=folder / "survey.csv", covariances=(OF_BED,))
    layer = BedLayer(raster=folder / "bed.asc", survey=survey)
    return replace(model, case=model.case.model_copy(update={"bed": (layer,)})), point
