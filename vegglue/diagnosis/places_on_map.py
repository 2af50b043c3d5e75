"""Where what was found at places lies on the map, to go there and look."""

from collections.abc import Sequence

import numpy as np

from vegglue.case.centreline import on_map
from vegglue.case.grid import centreline_in
from vegglue.case.schema import Case
from vegglue.wording.numbers import listed


def places_on_map_in_words(case: Case, places: Sequence[tuple[float, float]]) -> str:
    """Where places along and across the channel [m] lie on the map; '' without any, or where the case knows no map."""
    line, frame = centreline_in(case), case.frame
    if not places or (line is None and frame is None):
        return ""
    x, y = np.array(places).T
    east, north = (x, y) if line is None else on_map(line, x, y)
    if frame is not None:
        east, north = frame.to_map(east, north)
    told = [
        f"x = {one[0]:.1f}, y = {one[1]:.1f} m at {float(e):.1f}, {float(n):.1f}"
        for one, e, n in zip(places, east, north, strict=True)
    ]
    return f"On the map lies {listed(told)}."
