"""What the study of laws counts as right in one of its records."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from hidden_laws import BY_NAME, HiddenLaw

from vegglue.effects.identity import EffectIdentity

Record = Mapping[str, Any]
Said = tuple[str, str]  # a term and a quantity
# What listed effects say in the words of the grammar; others say something else.
LISTED_SAYS: dict[str, Said] = {
    "depth_dependent_bank": ("bank", "depth"), "depth_dependent_bed": ("floor", "depth"),
    "bank_trend": ("bank", "along"),
    "bed_trend": ("floor", "along"), "bank_vegetation": ("bank", "depth"), "streamlining": ("plants", "speed"),
    "canopy_deflection": ("plants", "speed"), "canopy_bending": ("plants", "speed"), "foliage": ("plants", "speed"),
    "slow_stems": ("plants", "speed"), "emergent_part": ("plants", "depth"), "undergrowth": ("plants", "depth"),
    "debris_screen": ("plants", "front"), "density_trend": ("plants", "front"), "edge_thinning": ("plants", "edge"),
    "edge_mixing": ("viscosity", "edge"), "mixing_length": ("viscosity", "shear"),
    "coherent_structures": ("viscosity", "shear"), "smagorinsky": ("viscosity", "shear"),
    "elder": ("viscosity", "speed"),
    "stem_blockage": ("plants", ""), "canopy_height_error": ("plants", ""), "patch_density": ("plants", ""),
    "steep_bank": ("bank", ""), "bank_difference": ("bank", ""), "viscosity": ("viscosity", ""),
    "unlisted_viscosity": ("viscosity", ""),
}  # fmt: skip
NEAR = 1.25


def causes(record: Record) -> list[tuple[Said, float, bool]]:
    """What each cause of the set says, its chance, and whether it is a law; the likeliest first."""
    found = [((one["term"], one["quantity"]), one["chance"], True) for one in record["laws"]]
    listed = [(EffectIdentity.parse(name).name, p) for name, p in record["others"].items()]
    others = [(LISTED_SAYS.get(name, ("", "")), p, False) for name, p in listed]
    return sorted([*found, *others], key=lambda one: -one[1])


def says_term(record: Record) -> bool:
    """The likeliest cause changes the term in which a law was hidden."""
    first = causes(record)[:1]
    return bool(first) and first[0][0][0] == BY_NAME[record["hide"]].term


def law_says_term(record: Record) -> bool:
    """The same, and it is a law."""
    return says_term(record) and causes(record)[0][2]


def is_true(law: HiddenLaw, said: Said) -> bool:
    """Whether that is the term and a quantity of a hidden law."""
    return said[0] == law.term and said[1] in law.quantities


def has_quantity(record: Record) -> bool:
    """A cause of the set says the quantity, of the term, that was hidden."""
    return any(is_true(BY_NAME[record["hide"]], said) for said, _, _ in causes(record))


def quantity_alone(record: Record) -> bool:
    """All causes of the set do."""
    found = causes(record)
    return bool(found) and all(is_true(BY_NAME[record["hide"]], said) for said, _, _ in found)


def near_truth(record: Record, probe: float = 0.0) -> bool | None:
    """Whether the error in the experiment that was held out is at most NEAR times that with the true law calibrated;
    where no law was written, that of the model as it was. probe: error of a probe, added in quadrature [m/s].
    """
    errors = record["held_out"]
    after = errors["before"] if errors["after"] is None else errors["after"]
    if errors["truth"] is None or after is None:
        return None
    return bool(np.hypot(after, probe) <= NEAR * np.hypot(errors["truth"], probe))


def told_near_truth(record: Record) -> bool | None:
    """The same with what was likeliest added to the model, law or listed effect or place; None in older records."""
    told, truth = record["held_out"].get("told"), record["held_out"]["truth"]
    return None if told is None or truth is None else bool(told <= NEAR * truth)


def is_silent(record: Record) -> bool:
    """No law was written."""
    return not record["best"]
