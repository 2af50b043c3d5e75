"""A calibrated model whose predictions are linear in z, prediction = slope z: no flow is solved for it."""

from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline
from vegglue.calibration.fit import MapEstimate, chi2, covariance, objective
from vegglue.calibration.noise import noise_of
from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case
from vegglue.engine.interface import Model, Point
from vegglue.engine.newton import NEWTON

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


def at_best(case: Case, station: pd.DataFrame, values: Array, slope: Array) -> Baseline:
    """The baseline at its best place for measured values (station,); slope (station, p)."""
    station = station.assign(value=values)
    noise = noise_of(station)
    error = station["standard_error"].to_numpy(float)
    white = slope / error[:, None]
    z = np.linalg.solve(white.T @ white + np.eye(slope.shape[1]), white.T @ (values / error))
    point = Point(z, slope @ z, slope, {})
    fitted = MapEstimate(point, chi2(noise, point), objective(noise, point), covariance(noise, point))
    return Baseline(Model(case, build_site(case), station, NEWTON), noise, fitted, None, None)
