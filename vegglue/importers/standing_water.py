"""Outlet levels under which a channel given by its numbers would be a lake: of another datum or unit, most likely."""

from pathlib import Path

from vegglue.errors import InputError, shown_path
from vegglue.importers.field_site import Channel, FieldSite, MeasuredFlow
from vegglue.measurements.plausibility import DEEPEST_CHANNEL, STANDING_WATER


def refuse_standing_water(path: Path, site: FieldSite) -> None:
    """h = z + S L at the outlet, U = Q / (h (b + h / m)), b the width of the floor and m the slope of the banks.

    Errors: InputError for an experiment that is more than twice as deep there as its floor is wide, and all but stands:
    its level is as a rule one above the sea. A grid that held it would be as wide as the lake.
    """
    if site.channel is None or site.bed is not None:
        return
    for key, flows in (("experiments", site.experiments), ("holdout", site.holdout)):
        for name, flow in flows.items():
            depth, speed = _depth_and_speed(site, site.channel, flow)
            if depth > DEEPEST_CHANNEL * site.channel.bottom_width_m and speed < STANDING_WATER:
                raise InputError(
                    f"{shown_path(path)}: `{key}.{name}` expected a level in m above the floor at x = 0, got "
                    f"{flow.downstream_level_m:g} m, which makes the outlet {depth:.3g} m deep and its water move at "
                    f"{speed:.1g} m/s; subtract the level of that floor here and from all levels, or mend the unit."
                )


def _depth_and_speed(site: FieldSite, channel: Channel, flow: MeasuredFlow) -> tuple[float, float]:
    """At the outlet, the floor in the middle: h [m] and U [m/s]."""
    depth = flow.downstream_level_m + channel.bed_slope * (channel.length_m or 0.0)
    beside = depth / channel.bank_slope_v_per_h if channel.bank_slope_v_per_h and site.walls is None else 0.0
    area = depth * (channel.bottom_width_m + beside)
    return depth, flow.discharge_m3_s / area if area > 0.0 else 0.0
