"""Banks of an imported case: the cells beyond where a cross-section begins to rise steeply, rough in their own way."""

import numpy as np

from vegglue.arrays import Array
from vegglue.case.grid import Grid
from vegglue.case.resolved_config import Tree
from vegglue.case.zones import beyond_slope_break, slope
from vegglue.importers.config_parts import loguniform_prior
from vegglue.importers.field_site import Channel, FieldSite
from vegglue.wording.numbers import in_digits

BANK = "bank"
BANK_CLASS = {"law": "keulegan", "k_s": "k_s"}


def bank_break(site: FieldSite) -> float | None:
    """Half of the stated slope of the banks [-], in the middle between floor and bank; None where none are stated.

    Nearer to the floor, a surveyor's errors of some centimetres would end the floor.
    """
    if site.walls is not None or site.channel is None or site.channel.bank_slope_v_per_h is None:
        return None
    return round(0.5 * site.channel.bank_slope_v_per_h, 4)


def with_banks(friction: Tree, steeper: float) -> Tree:
    """Friction with banks beyond such a slope [-]; zones that are there already win over them."""
    zones = [{"class": BANK, "beyond_slope_break": steeper}, *friction.get("zones", [])]
    return friction | {"classes": friction["classes"] | {BANK: BANK_CLASS}, "zones": zones}


def roughness_of_banks(friction: Tree) -> Tree:
    """The prior of k_s by its name, where a class has it."""
    if BANK_CLASS not in friction["classes"].values():
        return {}
    return {"k_s": loguniform_prior(0.01, 5.0, "m", "k_s", "Nikuradse roughness height of the banks")}


def found_banks(bed: Array, grid: Grid, channel: Channel, steeper: float) -> tuple[bool, str]:
    """Whether any cell is a bank beyond such a slope [-], and what is said of them. bed: levels (nx, ny) [m]."""
    banks = beyond_slope_break(slope(bed, grid) > steeper, bed)
    if not banks.any():
        return False, f"no bank, as it is nowhere steeper than {steeper:g}, half the stated slope of the banks"
    floor, stated = float(np.mean((~banks).sum(axis=1)) * grid.dy), channel.bottom_width_m
    return True, (
        f"banks lie beyond a slope of {steeper:g}, half the stated one, and leave a floor of {in_digits(floor)} m "
        f"({in_digits(stated)} m stated)"
    )
