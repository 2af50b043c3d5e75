"""Stations that a diagnosis set aside: no model that is compared afterwards is judged by them."""

from dataclasses import replace

import numpy as np
import pandas as pd

from vegglue.engine.interface import Model
from vegglue.measurements.observations import SET_ASIDE
from vegglue.results.diagnosis import Diagnosis

# What makes a measurement the same in a case and in those that extend it.
MEASUREMENT = ["experiment", "kind", "section", "x", "y", "value"]


def excluded_by(*found: Diagnosis) -> pd.DataFrame:
    """The measurements that any of the diagnoses has flagged."""
    flagged = [
        one.predictions.station.iloc[list(one.errors.flagged)][MEASUREMENT] for one in found if one.errors.flagged
    ]
    return pd.concat(flagged, ignore_index=True).drop_duplicates() if flagged else pd.DataFrame(columns=MEASUREMENT)


def excluding(model: Model, aside: pd.DataFrame) -> Model:
    """The model, with these measurements not used."""
    return replace(model, station=without_stations(model.station, aside))


def without_stations(station: pd.DataFrame, aside: pd.DataFrame) -> pd.DataFrame:
    """A table of stations, with these measurements not used."""
    known = set(aside.itertuples(index=False, name=None))
    there = np.array([row in known for row in station[MEASUREMENT].itertuples(index=False, name=None)], dtype=bool)
    there &= station["used"].to_numpy()
    return station.assign(used=station["used"].mask(there, False), reason=station["reason"].mask(there, SET_ASIDE))


def exclusion_in_words(aside: pd.DataFrame) -> str:
    """One sentence for a reader of what was compared, '' when nothing was set aside."""
    if aside.empty:
        return ""
    places = "; ".join(
        f"{' '.join(filter(None, (row.experiment, row.section)))} at x = {row.x:g}, y = {row.y:g} m"
        for row in aside.itertuples()
    )
    many, they = ("1 station is", "it") if len(aside) == 1 else (f"{len(aside)} stations are", "them")
    return f"{many} left out of every model, as the diagnosis set {they} aside: {places}."
