"""Sections that nobody named: stations that stand together across the channel, called by their place along it."""

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array

# Places nearer than this are one [m]; what is measured by tape is known to a centimetre.
ONE_PLACE = 0.001
# Number of x over that of places, up to which places stand on lines across the channel [-]. Chosen, not measured.
ON_LINES = 2.0 / 3.0
# Stations of one section lie within so much of one another along the channel [m].
SECTION_GAP = 0.25


def sections_by_place(x: Array, y: Array) -> list[str]:
    """x12.50 for each of the stations (n,) that stand together there, from their places x and y (n,) [m].

    Sections begin where stations are further apart than SECTION_GAP; what reaches further along the channel than across
    it is no section, and stands as it is.
    """
    places = np.unique(np.round(np.column_stack([x, y]), 3), axis=0)
    # Equal x of many places are sections as they are, however near; scattered ones are joined.
    scattered = np.unique(places[:, 0]).size > ON_LINES * len(places)
    apart, group = _groups_along(x, ONE_PLACE), _groups_along(x, SECTION_GAP if scattered else ONE_PLACE)
    for one in np.unique(group):
        here = group == one
        if np.ptp(x[here]) > np.ptp(y[here]):
            group[here] = x.size + apart[here]
    names = {number: section_at(x[group == number]) for number in np.unique(group)}
    return [names[number] for number in group]


def section_at(x: Array) -> str:
    """x12.50, the name of a section of stations at x (n,) [m]."""
    return f"x{np.median(x):.2f}"


def _groups_along(x: Array, gap: float) -> NDArray[np.int_]:
    """A number for each station (n,), the same where no gap along the channel is wider [m]."""
    order = np.argsort(x, kind="stable")
    group = np.zeros(x.size, dtype=int)
    group[order] = np.concatenate([[0], np.cumsum(np.diff(x[order]) > gap)])
    return group
