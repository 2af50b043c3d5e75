"""A calibrated model whose predictions are linear in z, prediction = slope z: no flow is solved for it."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline
from vegglue.calibration.fit import MapEstimate, chi2, covariance, objective
from vegglue.calibration.noise import noise_of
from vegglue.case.config import load_case
from vegglue.case.gridded_site import Site, build_site
from vegglue.case.schema import Case
from vegglue.engine.interface import Engine, Model, Point, StationsOfCells, Wanted, always
from vegglue.engine.newton import NEWTON
from vegglue.flow.local_changes import Term

CASE_OF_TWINS = load_case(Path(__file__).parents[1] / "configs" / "twin.yaml")


def measured_linearly(sections: tuple[str, ...], points: int, parameters: int) -> tuple[Array, Array]:
    """Slopes (station, p), and values measured at a place of the prior with errors of 0.01 m/s (station,)."""
    random = np.random.default_rng((1, parameters))
    count = len(stations_of(CASE_OF_TWINS, sections, points))
    slope = 0.05 * random.standard_normal((count, parameters))
    return slope, slope @ random.standard_normal(parameters) + 0.01 * random.standard_normal(count)


def stations_of(case: Case, sections: tuple[str, ...], points: int) -> pd.DataFrame:
    """So many velocities a metre apart in each section of each experiment, with errors of 0.01 m/s."""
    rows = [
        {"experiment": experiment, "kind": "velocity", "section": section, "x": 10.0, "y": float(y)}
        for experiment in case.experiments
        for section in sections
        for y in range(points)
    ]
    return pd.DataFrame(rows).assign(standard_error=0.01, used=True, reason="", depth=np.nan, device="")


def linear_engine(
    answer: Callable[[Model], tuple[Array, Array] | None],
    of_causes: Array | None = None,
    of_cells: Mapping[Term, Array] | None = None,
) -> Engine:
    """An engine of predictions a + J z, with (a, J) by model, None without a flow.

    of_causes (station, cause), of_cells (station, nx, ny): what predictions answer to causes, and to terms in cells.
    """

    def linearise(model: Model, z: Array, _: Point | None = None, wanted: Wanted = always) -> Point | None:
        a, slope = answer(model) or (None, None)
        if a is None or slope is None or not wanted(a + slope @ z):
            return None
        return Point(z, a + slope @ z, slope, dict.fromkeys(model.case.experiments))

    def predict(model: Model, _: object, z: Array) -> Array:
        a, slope = answer(model) or (np.full(len(model.station), np.nan), np.zeros((len(model.station), z.shape[1])))
        return a + z @ slope.T

    def responses(model: Model, *_: object) -> Array:
        assert of_causes is not None
        return of_causes[None, : len(model.station)]

    def responses_to_cells(model: Model, _: Point, experiment: str, terms: Sequence[Term]) -> StationsOfCells:
        rows, grid = model.rows[experiment], model.site.grid
        nothing = np.zeros((rows.size, grid.x.size, grid.y.size), np.float32)
        yield rows, {term: nothing if of_cells is None else of_cells[term][rows] for term in terms}

    return Engine(
        "linear", linearise, lambda model, z, _: [linearise(model, one) for one in z],
        predict, responses, responses_to_cells, NEWTON.flow_at_centres,
        lambda model, point: point, lambda point, before, after: point,
    )  # fmt: skip


@cache
def _site_of_twins() -> Site:
    return build_site(CASE_OF_TWINS)


def at_best(case: Case, station: pd.DataFrame, values: Array, slope: Array, engine: Engine = NEWTON) -> Baseline:
    """The baseline at its best place for measured values (station,); slope (station, p)."""
    station = station.assign(value=values)
    noise = noise_of(station)
    error = station["standard_error"].to_numpy(float)
    white = slope / error[:, None]
    z = np.linalg.solve(white.T @ white + np.eye(slope.shape[1]), white.T @ (values / error))
    point = Point(z, slope @ z, slope, {} if engine is NEWTON else dict.fromkeys(case.experiments))
    fitted = MapEstimate(point, chi2(noise, point), objective(noise, point), covariance(noise, point))
    site = _site_of_twins() if case is CASE_OF_TWINS else build_site(case)
    return Baseline(Model(case, site, station, engine), noise, fitted, None, None)
