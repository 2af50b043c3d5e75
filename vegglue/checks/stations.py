"""Does every station stand in the water, away from the edges of patches, and show what a flow can have?"""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from vegglue.case.schema import Case
from vegglue.measurements.kinds import kind_of, velocity_rows
from vegglue.measurements.observations import OUTSIDE, Observations
from vegglue.measurements.suspicious_values import absurd_values
from vegglue.site.channel_geometry import expected_depth
from vegglue.site.gridded_site import Site, in_experiment
from vegglue.site.polygons import corners_of, distance_to_outline

# Nearer to a patch edge than this share of a cell [-], a station is on it.
ON_THE_EDGE = 0.02


def remarks_on_stations(case: Case, site: Site, observations: Observations) -> Iterator[str]:
    """Stations outside the grid or above the expected water."""
    for row in observations.table.to_dict("records"):
        if row["reason"] == OUTSIDE:
            yield f"The {station_in_words(row)} is outside the grid, and not used."
            continue
        if not kind_of(row["kind"]).at_point:
            continue
        i, j = np.abs(site.grid.x - row["x"]).argmin(), np.abs(site.grid.y - row["y"]).argmin()
        depth = float(
            expected_depth(case, in_experiment(site, row["experiment"]), case.experiments[row["experiment"]])[i, j]
        )
        if not row["depth"] > 0 and depth <= 0:
            yield f"The {station_in_words(row)} is outside the wet channel, about {-depth:.2g} m above the water."


def remarks_on_patch_edges(case: Case, observations: Observations) -> Iterator[str]:
    """Stations of velocity so near to the edge of a patch that the model interpolates across it."""
    table = observations.table[velocity_rows(observations.table)]
    limit = ON_THE_EDGE * min(case.grid.cell)
    for patch in case.plants.patches:
        outline = corners_of(case, patch)
        near = [distance_to_outline(outline, x, y) < limit for x, y in zip(table["x"], table["y"], strict=True)]
        for section, rows in table[np.array(near, dtype=bool)].groupby("section"):
            at = _listed([f"{y:g}" for y in sorted(set(rows["y"]))])
            yield (
                f"Stations of {section} at y = {at} m lie on the edge of patch {patch.name}: "
                f"there the model interpolates between plants and open water."
            )


def remarks_on_absurd_values(case: Case, site: Site, observations: Observations) -> Iterator[str]:
    """Marks for missing values, wrong units, another datum, and standard errors without sense."""
    yield from absurd_values(case, site, observations.table)


def station_in_words(row: Mapping[Hashable, Any]) -> str:
    """A row of the table of stations as a phrase: place [m] and experiment."""
    return f"station at x = {row['x']:g}, y = {row['y']:g} m of experiment {row['experiment']}"


def _listed(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
