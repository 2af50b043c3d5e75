"""What is odd about a case, in plain sentences, before hours are spent on it; errors are refused earlier.

Each remark comes from one function of the file of its subject; a new one is added to the list below.
"""

from vegglue.case.schema import Case
from vegglue.checks.boundaries import remarks_on_boundaries, remarks_on_discharges, remarks_on_dry_outlets
from vegglue.checks.channel_and_plants import (
    remarks_on_bank_law,
    remarks_on_canopies,
    remarks_on_friction_classes,
    remarks_on_patches,
    remarks_on_ridge,
    remarks_on_rising_floor,
    remarks_on_unnamed_banks,
)
from vegglue.checks.directions import remarks_on_directions
from vegglue.checks.ensemble_and_priors import (
    remarks_on_ensemble,
    remarks_on_idle_parameters,
    remarks_on_kept_fields,
    remarks_on_units_of_effects,
)
from vegglue.checks.stations import (
    remarks_on_absurd_values,
    remarks_on_dry_velocities,
    remarks_on_exchanged_axes,
    remarks_on_map_places,
    remarks_on_patch_edges,
    remarks_on_shared_places,
    remarks_on_stations,
)
from vegglue.checks.steep_flow import remarks_on_steep_flow
from vegglue.checks.units_of_places import remarks_on_units_of_places
from vegglue.checks.verticals import remarks_on_exchanged_heights, remarks_on_heights, remarks_on_lost_points
from vegglue.measurements.observations import Observations
from vegglue.site.gridded_site import Site


def doubts_about(case: Case, site: Site, observations: Observations) -> list[str]:
    """What would mislead all that is computed with the measurements: wrong units, signs, marks of missing values,
    outlets that no water reaches, and sections that carry another discharge than stated.

    Nothing of measurements where none is in use: commands that need them refuse that, with the reason of the first.
    """
    dry = [*remarks_on_dry_outlets(case, site, observations)]
    if not observations.table["used"].any():
        return dry
    return [
        *dry,
        *remarks_on_absurd_values(case, site, observations),
        *remarks_on_exchanged_axes(case, observations),
        *remarks_on_map_places(case, observations),
        *remarks_on_units_of_places(case, observations),
        *remarks_on_dry_velocities(case, site, observations),
        *remarks_on_exchanged_heights(case, observations),
        *remarks_on_directions(case, observations),
        *remarks_on_discharges(case, site, observations),
    ]


def check_case(case: Case, site: Site, observations: Observations) -> list[str]:
    """What a user should look at, one sentence each, none when nothing is odd."""
    remarks = (
        remarks_on_absurd_values(case, site, observations),
        remarks_on_exchanged_axes(case, observations),
        remarks_on_map_places(case, observations),
        remarks_on_units_of_places(case, observations),
        remarks_on_stations(case, site, observations),
        remarks_on_shared_places(observations),
        remarks_on_exchanged_heights(case, observations),
        remarks_on_heights(observations),
        remarks_on_lost_points(observations),
        remarks_on_directions(case, observations),
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
        remarks_on_discharges(case, site, observations),
    )
    return [sentence for about in remarks for sentence in about]
