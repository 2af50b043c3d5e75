"""Sections: stations that were measured together across the channel, though a boat does not keep its line."""

import pandas as pd


def section_places(station: pd.DataFrame) -> pd.Series:
    """The x of the section of each station [m]: the median of those of its name in its experiment.

    Stations without such a name, or that lie along the channel rather than across it, have their own x.
    """
    group = station.groupby(["experiment", station["section"]])
    along = group["x"].transform("max") - group["x"].transform("min")
    across = group["y"].transform("max") - group["y"].transform("min")
    together = (station["section"] != "") & (along <= across)
    return group["x"].transform("median").where(together, station["x"])


def section_place(station: pd.DataFrame, experiment: str, section: str) -> float:
    """The x of a section of one experiment [m]: the median of its stations; NaN without any."""
    own = (station["experiment"] == experiment) & (station["section"] == section)
    return float(station.loc[own, "x"].median())
