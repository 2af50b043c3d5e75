"""What is odd about a case, in plain sentences, before hours are spent on it; errors are refused earlier.

Each remark comes from one function of the file of its subject; a new one is added to the list below.
"""

from dataclasses import replace

from vegglue.case.gridded_site import Site
from vegglue.case.schema import Case
from vegglue.diagnosis.boundaries import remarks_on_boundaries, remarks_on_discharges, remarks_on_dry_outlets
from vegglue.diagnosis.channel_and_plants import (
    remarks_on_bank_law,
    remarks_on_canopies,
    remarks_on_friction_classes,
    remarks_on_patches,
    remarks_on_ridge,
    remarks_on_rising_floor,
    remarks_on_unnamed_banks,
)
from vegglue.diagnosis.directions import remarks_on_directions, rising_levels
from vegglue.diagnosis.ensemble_and_priors import (
    remarks_on_ensemble,
    remarks_on_idle_parameters,
    remarks_on_kept_fields,
    remarks_on_units_of_effects,
)
from vegglue.diagnosis.errors_across_plants import remarks_on_errors_across_plants
from vegglue.diagnosis.heights_or_levels import remarks_on_unmoved_heights
from vegglue.diagnosis.outlet_level import remarks_on_outlet_levels
from vegglue.diagnosis.stations import (
    remarks_on_absurd_values,
    remarks_on_dry_velocities,
    remarks_on_exchanged_axes,
    remarks_on_map_places,
    remarks_on_patch_edges,
    remarks_on_shared_places,
    remarks_on_stations,
)
from vegglue.diagnosis.steep_flow import remarks_on_steep_flow
from vegglue.diagnosis.turned_velocities import remarks_on_turned_velocities
from vegglue.diagnosis.units_of_places import remarks_on_units_of_places
from vegglue.diagnosis.verticals import remarks_on_exchanged_heights, remarks_on_heights, remarks_on_lost_points
from vegglue.measurements.observations import Observations
from vegglue.measurements.plausibility import implausible_levels


def doubts_about(case: Case, site: Site, observations: Observations) -> list[str]:
    """What would mislead all that is computed with the measurements: wrong units, signs, marks of missing values,
    outlets that no water reaches, and sections that carry another discharge than stated.

    Nothing of measurements where none is in use: commands that need them refuse that, with the reason of the first.
    """
    dry = [*remarks_on_dry_outlets(case, site, observations)]
    if not observations.table["used"].any():
        return dry
    possible = _with_possible_levels(case, site, observations)
    return [
        *dry,
        *remarks_on_absurd_values(case, site, observations),
        *remarks_on_exchanged_axes(case, observations),
        *remarks_on_map_places(case, observations),
        *remarks_on_units_of_places(case, observations),
        *remarks_on_dry_velocities(case, site, observations),
        *remarks_on_exchanged_heights(case, observations),
        *remarks_on_unmoved_heights(case, observations),
        *remarks_on_directions(case, possible),
        *remarks_on_turned_velocities(case, observations),
        *remarks_on_outlet_levels(case, site, possible),
        *remarks_on_discharges(case, site, observations),
    ]


def _with_possible_levels(case: Case, site: Site, observations: Observations) -> Observations:
    """Without levels that are told as absurd: that water rises from such a gauge to the next follows from it."""
    table = observations.table
    absurd = implausible_levels(case, site, table).to_numpy(bool)
    return replace(observations, table=table.assign(used=table["used"] & ~absurd))


def _doubted_levels(case: Case, observations: Observations, possible: Observations) -> set[str]:
    """Experiments with an absurd level, or whose levels rise downstream. possible: without the former."""
    absurd = observations.table["used"] & ~possible.table["used"]
    return {*observations.table.loc[absurd, "experiment"].astype(str), *rising_levels(case, possible)}


def check_case(case: Case, site: Site, observations: Observations) -> list[str]:
    """What a user should look at, one sentence each, none when nothing is odd."""
    possible = _with_possible_levels(case, site, observations)
    remarks = (
        remarks_on_absurd_values(case, site, observations),
        remarks_on_exchanged_axes(case, observations),
        remarks_on_map_places(case, observations),
        remarks_on_units_of_places(case, observations),
        remarks_on_stations(case, site, observations),
        remarks_on_shared_places(observations),
        remarks_on_exchanged_heights(case, observations),
        remarks_on_unmoved_heights(case, observations),
        remarks_on_heights(observations),
        remarks_on_directions(case, possible),
        remarks_on_turned_velocities(case, observations),
        remarks_on_outlet_levels(case, site, possible),
        remarks_on_lost_points(observations, _doubted_levels(case, observations, possible)),
        remarks_on_ensemble(case, observations),
        remarks_on_kept_fields(case, site),
        remarks_on_rising_floor(case),
        remarks_on_ridge(case, site),
        remarks_on_patches(case, site),
        remarks_on_friction_classes(site),
        remarks_on_unnamed_banks(case, site),
        remarks_on_idle_parameters(case, site),
        remarks_on_units_of_effects(case),
        remarks_on_dry_outlets(case, site, observations),
        remarks_on_boundaries(case, site),
        remarks_on_steep_flow(case, site),
        remarks_on_canopies(case, site, observations),
        remarks_on_bank_law(case, site),
        remarks_on_patch_edges(case, observations),
        remarks_on_errors_across_plants(case, observations),
        remarks_on_discharges(case, site, observations),
    )
    return [sentence for about in remarks for sentence in about]
