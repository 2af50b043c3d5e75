"""The misfit that a diagnosis tells."""

from dataclasses import replace

import numpy as np
from coarse_twin import coarse_twin

from vegglue.diagnosis.diagnose import diagnose_model


def test_parameters_that_few_readings_leave_open_cost_no_degree_of_freedom() -> None:
    """Six velocities determine three of four parameters."""
    model, point = coarse_twin()
    every = np.flatnonzero(model.station["kind"] == "velocity")[::14]
    station = model.station.assign(value=point.prediction).iloc[every].reset_index(drop=True)
    misfit = diagnose_model(replace(model, station=station)).misfit
    assert len(station) - len(model.names) < misfit.freedom < len(station)
