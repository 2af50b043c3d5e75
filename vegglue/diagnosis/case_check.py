"""What is odd about a case, as remarks, before hours are spent on it; errors are refused earlier.

Remarks are frozen values that `wording.sentences.sentence` renders. Each comes from one function of a file of checks
(channel_check, flow_check, station_check); a new one is added to the lists below.
"""

from dataclasses import replace

from vegglue.case.gridded_site import Site
from vegglue.case.schema import Case
from vegglue.diagnosis import channel_check, flow_check, station_check
from vegglue.measurements.observations import Observations
from vegglue.measurements.plausibility import implausible_levels


def critical_remarks(case: Case, site: Site, observations: Observations) -> list[object]:
    """What would mislead all that is computed with the measurements.

    Wrong units, signs, marks of missing values, outlets that no water reaches, and sections that carry another
    discharge than stated.

    Returns
    -------
    list of dataclass instances
        None of measurements if none is in use: commands that need them refuse that, with the reason of the first.
    """
    dry: list[object] = [*flow_check.remarks_on_dry_outlets(case, site, observations)]
    if not observations.table["used"].any():
        return dry
    possible = _with_possible_levels(case, site, observations)
    return [
        *dry,
        *station_check.remarks_on_implausible_values(case, site, observations),
        *station_check.remarks_on_frames(case, observations),
        *(one for one in station_check.remarks_on_land(case, site, observations) if one.most),
        *station_check.remarks_on_exchanged_heights(case, observations),
        *station_check.remarks_on_unmoved_heights(case, observations),
        *flow_check.remarks_on_directions(case, possible),
        *flow_check.remarks_on_turned_velocities(case, observations),
        *flow_check.remarks_on_outlet_levels(case, site, possible),
        *flow_check.remarks_on_discharges(case, site, observations),
    ]


def check_case(case: Case, site: Site, observations: Observations) -> list[object]:
    """All remarks on a case, none if nothing is odd.

    Parameters
    ----------
    site : Site
        Of the case, on its grid.
    observations : Observations
        Of the case.

    Returns
    -------
    list of dataclass instances
        In the order in which they are printed.
    """
    possible, table = _with_possible_levels(case, site, observations), observations.table
    implausible = table.loc[table["used"] & ~possible.table["used"], "experiment"]
    doubted = {*implausible, *flow_check.rising_levels(case, possible)}
    return [
        *station_check.remarks_on_implausible_values(case, site, observations),
        *station_check.remarks_on_frames(case, observations),
        *station_check.remarks_on_stations(case, site, observations),
        *station_check.remarks_on_shared_places(observations),
        *station_check.remarks_on_exchanged_heights(case, observations),
        *station_check.remarks_on_unmoved_heights(case, observations),
        *station_check.remarks_on_heights(observations),
        *flow_check.remarks_on_directions(case, possible),
        *flow_check.remarks_on_turned_velocities(case, observations),
        *flow_check.remarks_on_turned_probes(observations),
        *flow_check.remarks_on_outlet_levels(case, site, possible),
        *station_check.remarks_on_lost_points(observations, doubted),
        *channel_check.remarks_on_ensemble(case, observations),
        *channel_check.remarks_on_kept_fields(case, site),
        *channel_check.remarks_on_bed(case, site),
        *channel_check.remarks_on_survey(case),
        *channel_check.remarks_on_patches(case, site),
        *channel_check.remarks_on_friction_classes(site),
        *channel_check.remarks_on_unnamed_banks(case, site),
        *channel_check.remarks_on_parameters(case, site),
        *flow_check.remarks_on_dry_outlets(case, site, observations),
        *flow_check.remarks_on_boundaries(case, site),
        *flow_check.remarks_on_steep_flow(case, site),
        *channel_check.remarks_on_canopies(case, site, observations),
        *channel_check.remarks_on_bank_law(case, site),
        *station_check.remarks_on_patch_edges(case, observations),
        *station_check.remarks_on_walls(case, observations),
        *station_check.remarks_on_errors_across_plants(case, observations),
        *flow_check.remarks_on_discharges(case, site, observations),
        *flow_check.remarks_on_measured_discharges(case, site, observations),
    ]


def _with_possible_levels(case: Case, site: Site, observations: Observations) -> Observations:
    """Without implausible levels: that water rises from such a gauge to the next follows from it."""
    table = observations.table
    return replace(observations, table=table.assign(used=table["used"] & ~implausible_levels(case, site, table)))
