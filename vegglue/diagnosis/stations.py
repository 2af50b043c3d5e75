"""Does every station stand in the water, away from the edges of patches, and show what a flow can have?"""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from vegglue.case.channel_geometry import expected_depth
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.polygons import corners_of, distance_to_outline
from vegglue.case.schema import Case
from vegglue.diagnosis.boundaries import dry_outlets
from vegglue.diagnosis.directions import exchanged_components
from vegglue.diagnosis.units_of_places import fitting_unit
from vegglue.measurements.kinds import kind_of, velocity_rows
from vegglue.measurements.observations import OUTSIDE, Observations
from vegglue.measurements.plausibility import implausible_values
from vegglue.wording.sentences import sentence

# Nearer to a patch edge than this share of a cell [-], a station is on it.
ON_THE_EDGE = 0.02


def remarks_on_stations(case: Case, site: Site, observations: Observations) -> Iterator[str]:
    """Stations outside the grid or above the expected water; of each experiment in one sentence."""
    table = observations.table
    outside = (table["reason"] == OUTSIDE).to_numpy()
    for experiment, rows in table[outside].groupby("experiment", sort=False):
        yield f"{_places_in_words(rows, str(experiment))} outside the grid, and not used."
    yield from (_land_in_words(*one) for one in _on_land(case, site, table))


def remarks_on_shared_places(observations: Observations) -> Iterator[str]:
    """Stations in use where another of their kind and experiment stands: a file may be a copy, or a place wrong."""
    table = observations.table[observations.table["used"]]
    table = table[np.array([kind_of(str(kind)).at_point for kind in table["kind"]], dtype=bool)]
    shared = table[table.duplicated(["experiment", "kind", "x", "y"], keep=False)]
    for (experiment, kind), rows in shared.groupby(["experiment", "kind"], sort=False):
        first = rows.iloc[0]
        there = rows.loc[(rows["x"] == first["x"]) & (rows["y"] == first["y"]), "section"].unique()
        yield (
            f"{len(rows)} stations of {kind_of(str(kind)).words} in experiment {experiment} share places, the first at "
            f"x = {first['x']:g}, y = {first['y']:g} m (of {_listed([str(one) for one in there])}), and "
            "count as measured apart: see whether a file is a copy, or a place wrong."
        )


def remarks_on_dry_velocities(case: Case, site: Site, observations: Observations) -> Iterator[str]:
    """Velocities of an experiment of which most stand on land: the model has no flow to hold against them."""
    yield from (_land_in_words(*one) for one in _on_land(case, site, observations.table) if one[-1])


def _on_land(case: Case, site: Site, table: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame, bool]]:
    """Of each experiment the stations above the expected water, `above` [m] by how much; whether most velocities do.

    None of an experiment whose outlet is dry: that is said once.
    """
    dry_ones = dry_outlets(case, site)
    at_point = np.array([kind_of(str(kind)).at_point for kind in table["kind"]], dtype=bool)
    inside = table[(table["reason"] != OUTSIDE).to_numpy() & at_point]
    for experiment, rows in inside[~inside["experiment"].isin(list(dry_ones))].groupby("experiment", sort=False):
        now = in_experiment(site, str(experiment))
        depth = expected_depth(case, now, case.experiments[str(experiment)])
        i, j = (np.abs(np.subtract.outer(rows[name].to_numpy(float), at)).argmin(axis=1)
                for name, at in (("x", site.grid.x), ("y", site.grid.y)))  # fmt: skip
        dry = rows.assign(above=-depth[i, j])[(depth[i, j] <= 0) & ~(rows["depth"].to_numpy(float) > 0)]
        if len(dry):
            velocities = [int(velocity_rows(one).sum()) for one in (dry, rows)]
            yield str(experiment), dry, 2 * velocities[0] > velocities[1]


def _land_in_words(experiment: str, dry: pd.DataFrame, most: bool) -> str:
    above = f"outside the wet channel, about {dry['above'].iloc[0]:.2g} m above the water"
    advice = ": most of its velocities; check their y, the bed and the outlet level" if most else ""
    return f"{_places_in_words(dry, experiment)} {above}{advice}."


def remarks_on_exchanged_axes(case: Case, observations: Observations) -> Iterator[str]:
    """Velocities of which most are outside the grid, and would all lie inside, were x and y exchanged."""
    table = observations.table[velocity_rows(observations.table)]
    lost = table[(table["reason"] == OUTSIDE).to_numpy()]
    (west, east), (south, north) = case.grid.x, case.grid.y
    turned = lost["y"].between(west, east) & lost["x"].between(south, north)
    if 2 * len(lost) > len(table) and turned.all():
        yield (
            f"All {len(lost)} velocities outside the grid, the first at x = {lost['x'].iloc[0]:g}, y = "
            f"{lost['y'].iloc[0]:g} m, would lie inside with x and y exchanged: x runs along the channel and y across; "
            "check which column is which."
        )


def remarks_on_map_places(case: Case, observations: Observations) -> Iterator[str]:
    """Velocities all outside the grid, by more than its length: as if they lay on a map that no `frame` speaks of."""
    table = observations.table[velocity_rows(observations.table)]
    west, east = case.grid.x
    beyond = np.maximum(west - table["x"], table["x"] - east) > east - west
    unknown = case.frame is None and fitting_unit(case, table) is None
    if len(table) and unknown and (table["reason"] == OUTSIDE).all() and beyond.all():
        first = table.iloc[0]
        yield (
            f"All velocities lie more than the length of the grid away from it, the first at x = {first['x']:.10g}, "
            f"y = {first['y']:.10g} m, as if on a map: say where the channel lies on it by `frame` in the site file, "
            "and import again."
        )


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
    """Marks for missing values, wrong units, another datum, and standard errors without sense; of no velocities whose
    components are exchanged, as those along are too slow for that reason.
    """
    table, exchanged = observations.table, exchanged_components(case, observations)
    told = velocity_rows(table) & table["experiment"].isin(exchanged).to_numpy(bool)
    yield from map(sentence, implausible_values(case, site, table.assign(used=table["used"] & ~told)))


def station_in_words(row: Mapping[Hashable, Any]) -> str:
    """A row of the table of stations as a phrase: place [m] and experiment."""
    return f"station at x = {row['x']:g}, y = {row['y']:g} m of experiment {row['experiment']}"


def _places_in_words(rows: pd.DataFrame, experiment: str) -> str:
    """`The station at x = 1, y = 2 m of experiment low is`, or how many are, with the first of them."""
    places = rows.drop_duplicates(["x", "y"])
    first = places.iloc[0]
    if len(places) == 1:
        return f"The {station_in_words(first.to_dict())} is"
    return (
        f"{len(places)} places of experiment {experiment}, the first at x = {first['x']:g}, y = {first['y']:g} m, are"
    )


def _listed(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
