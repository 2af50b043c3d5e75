"""Keys of a site file that nobody reads: notes, or slips of the pen."""

import difflib
from collections.abc import Iterator, Sequence
from typing import Any

from pydantic import BaseModel

from vegglue.importers.field_site import (
    Channel,
    FieldSite,
    FlumeWalls,
    PlantedPatch,
    SiteFrame,
    SiteGrid,
)

SITE_PARTS: dict[str, type[BaseModel]] = {"channel": Channel, "grid": SiteGrid, "frame": SiteFrame, "walls": FlumeWalls}
# What an experiment may be described by, each by either name.
OF_FLOW = (("discharge", "discharge_m3_s"), ("level", "downstream_level_m"))
# How alike two words are that are one misspelt [-], and letters of a word cut short: `stems` for `stems_per_m2`.
MISSPELT, CUT_SHORT = 0.8, 4

# What others call a key, in a config of a case or elsewhere.
OTHER_WORDS = {
    "plants": "patches", "vegetation": "patches", "density": "stems_per_m2", "stem_density": "stems_per_m2",
    "canopy_height": "canopy_height_guess_m", "q": "discharge", "width": "bottom_width_m", "slope": "bed_slope",
    "viscosity": "eddy_viscosity_m2_s",
}  # fmt: skip
# What takes the place of two things that are usually known of plants.
THICK_STEMS = (
    "Diameters of stems have no key: the drag phi = C_d m D h of the densest patch is calibrated, with the diameter D "
    "in it. Where it differs from patch to patch, write stems times diameter [1/m] as `stems_per_m2` of all of them: "
    "only their ratio counts. Where you know D, narrow the prior of phi in the config."
)
COUNTED_STEMS = "The number of stems in a patch has no key: write it over the area of the patch, as `stems_per_m2`."


def unread_keys(given: Any) -> list[str]:
    """The keys of a site file that no reader knows, with where they stand, as in `channel.axis`."""
    return [place + key for place, key, _ in _unread(given)]


def about_stems(unread: Sequence[str]) -> list[str]:
    """What to write instead of keys of a patch that tell how thick its stems are, or how many stand in it."""
    words = [key.rpartition(".")[2].lower() for key in unread if key.startswith("patches")]
    told = []
    if any("diam" in word or "thick" in word for word in words):
        told.append(THICK_STEMS)
    if any("stem" in word and ("number" in word or "count" in word) for word in words):
        told.append(COUNTED_STEMS)
    return told


def misspelt_key(given: Any) -> tuple[str, str] | None:
    """The first unknown key, with its place, that is all but a known one which is not given, and that one."""
    for place, key, missing in _unread(given):
        close = next(iter(difflib.get_close_matches(key, missing, n=1, cutoff=MISSPELT)), None)
        close = OTHER_WORDS.get(key.lower()) if close is None and OTHER_WORDS.get(key.lower()) in missing else close
        if close is None and len(key) >= CUT_SHORT:
            close = next((known for known in missing if known.startswith(key)), None)
        if close is not None:
            return place + key, close
    return None


def _unread(given: Any) -> Iterator[tuple[str, str, list[str]]]:
    """Of each unknown key: the place it stands at, its name, and the known keys that are not given there."""
    for place, part, known in _parts(given):
        if isinstance(part, dict):
            missing = [name for names in known if not set(names) & part.keys() for name in names]
            names = {name for names in known for name in names}
            yield from ((place, str(key), missing) for key in part if key not in names)


def _parts(given: Any) -> Iterator[tuple[str, Any, list[tuple[str, ...]]]]:
    """The parts of a site file: where each stands, what is given there, and its known keys, each by all its names."""
    if not isinstance(given, dict):
        return
    yield "", given, _names(FieldSite)
    for name, model in SITE_PARTS.items():
        yield f"{name}.", given.get(name), _names(model)
    for name in ("experiments", "holdout"):
        flows = given.get(name)
        for experiment, flow in flows.items() if isinstance(flows, dict) else ():
            yield f"{name}.{experiment}.", flow, [*OF_FLOW]
    patches = given.get("patches")
    if isinstance(patches, dict):
        yield "patches.", patches, _names(PlantedPatch)
    for number, patch in enumerate(patches) if isinstance(patches, list) else ():
        yield f"patches[{number}].", patch, _names(PlantedPatch)


def _names(model: type[BaseModel]) -> list[tuple[str, ...]]:
    return [(name,) for name in model.model_fields]
