"""The misfit that a diagnosis states, and the standard errors of its mean in zones."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from coarse_twin import coarse_twin
from linear_baseline import at_best, stations_of

from vegglue.calibration.noise import with_correlation
from vegglue.case.config import load_case
from vegglue.diagnosis.conclusion import misfit_zones
from vegglue.diagnosis.diagnose import diagnose_model


def test_parameters_that_few_readings_leave_open_cost_no_degree_of_freedom() -> None:
    """Six velocities determine three of four parameters."""
    model, point = coarse_twin()
    every = np.flatnonzero(model.station["kind"] == "velocity")[::14]
    station = model.station.assign(value=point.prediction).iloc[every].reset_index(drop=True)
    misfit = diagnose_model(replace(model, station=station)).misfit
    assert len(station) - len(model.names) < misfit.freedom < len(station)


CASE = load_case(Path(__file__).parents[2] / "configs" / "twin.yaml")


@pytest.mark.parametrize(("points", "variance"), [(2, 2 + 2 * 0.6), (3, 3 + 4 * 0.6 + 2 * 0.36)])
def test_errors_of_means_are_those_of_correlated_neighbours(points: int, variance: float) -> None:
    """Var(sum) = s^2 sum_ij rho^|i-j| for probes as far apart as each other; gauges share no error."""
    probes = stations_of(CASE, ("A",), points)
    probes["y"] *= 0.03  # all in one zone
    gauges = probes.assign(kind="level", section="")
    station = pd.concat([probes, gauges], ignore_index=True)
    base = at_best(CASE, station, np.zeros(len(station)), np.zeros((len(station), len(CASE.parameters))))
    table = misfit_zones(base.model, with_correlation(base.noise, 0.6, 1.0), base.fitted.point)
    fewer = misfit_zones(base.model, base.noise, base.fitted.point, (0, len(station) - 1))
    assert fewer["stations"].sum() == len(station) - 2, "what was set aside is no misfit of the model"
    assert table.groupby("section")["stations"].sum().to_dict() == {"A": 3 * points, "gauges": 3 * points}
    of_gauges = table[table["section"] == "gauges"]["standard_error"].to_numpy()
    assert of_gauges == pytest.approx(0.01 / np.sqrt(points))
    whole = table[(table["section"] == "A") & (table["stations"] == points)]["standard_error"].to_numpy()
    assert whole == pytest.approx(0.01 * np.sqrt(variance) / points)
    assert whole.size == 3, "a mean in each experiment"
