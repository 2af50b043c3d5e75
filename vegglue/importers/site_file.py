"""The site file of a field team, read and checked whole."""

import json
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from vegglue.case.config import read_tree
from vegglue.case.messages import dotted, expected_in_words
from vegglue.case.size_limits import LARGEST_CONFIG
from vegglue.case.text_files import read_text
from vegglue.errors import InputError, shown_path
from vegglue.importers.field_site import FieldSite
from vegglue.importers.site_keys import OF_FLOW, about_stems, misspelt_key, unread_keys

# What the file of measurements is called that no calibration sees, whatever its ending.
HELD_OUT = "holdout"


def site_file(folder: Path) -> Path:
    """The site file of a folder: site.yaml if it is there, else site.json, which need not be."""
    return folder / "site.yaml" if (folder / "site.yaml").is_file() else folder / "site.json"


def held_out_file(folder: Path) -> Path | None:
    """The file of measurements that a folder holds out: holdout.csv, else the first other table of that name."""
    return next(iter(_held_out_files(folder)), None)


def _held_out_files(folder: Path) -> list[Path]:
    found = (path for path in folder.iterdir() if path.is_file() and path.stem.lower() == HELD_OUT)
    return sorted(found, key=lambda path: (path.name != "holdout.csv", path.name))


def read_site(path: Path) -> FieldSite:
    """The site in a file. Errors: InputError, naming file and key, for what is missing, no number or beyond bounds."""
    if not path.exists():
        what = "none in it" if path.parent.is_dir() else "a file" if path.parent.exists() else "no such folder"
        raise InputError(
            f"{shown_path(path.parent)}: expected a folder with site.yaml, or site.json, and tables of measurements, "
            f"got {what}; `vegglue new NAME` makes one to begin with."
        )
    given = _given(path)
    if (misspelt := misspelt_key(given)) is not None:
        place, known = misspelt
        raise InputError(f"{shown_path(path)}: `{place}` is not a known key: did you mean `{known}`?")
    try:
        site = FieldSite.model_validate(given)
    except ValidationError as error:
        raise InputError(f"{shown_path(path)}: {_sentence(error)}") from None
    _refuse_some_uncounted(path, site)
    return site


def _refuse_some_uncounted(path: Path, site: FieldSite) -> None:
    """Errors: InputError when stems were counted in some patches only: the others would seem all but bare."""
    counted = ["stems_per_m2" in one.model_fields_set for one in site.patches if one.file is None]
    if any(counted) and not all(counted):
        raise InputError(
            f"{shown_path(path)}: expected `stems_per_m2` of every patch or of none, got none of "
            f"`patches[{counted.index(False)}]`; add it there."
        )


def left_open(folder: Path) -> list[str]:
    """What the site file of a folder does not say and `import` assumes, and what it says that nobody reads.

    Errors: InputError as those of `read_site`.
    """
    path = site_file(folder)
    site, given = read_site(path), _given(path)
    assumed = []
    if "eddy_viscosity_m2_s" not in site.model_fields_set:
        within = f" (standard deviation: a factor of {site.viscosity_factor:g})" if site.viscosity_factor > 1 else ""
        assumed.append(f"eddy_viscosity_m2_s {site.eddy_viscosity_m2_s:g}{within}")
    if site.patches and "canopy_height_guess_m" not in site.model_fields_set:
        assumed.append(f"canopy_height_guess_m {site.canopy_height_guess_m:g}")
    here = [one for one in site.patches if one.file is None]
    if here and not any("stems_per_m2" in one.model_fields_set for one in here):
        assumed.append("plants equally dense in all patches that have no file")
    if not site.patches:
        assumed.append("no plants")
    unread = unread_keys(given)
    if site.walls is not None and site.channel is not None and site.channel.bank_slope_v_per_h is not None:
        unread.append("channel.bank_slope_v_per_h, as there are walls")
    told = [f"{path.name} does not say, and so is assumed: {', '.join(assumed)}."] if assumed else []
    told += [f"{path.name}: taken as notes, and not read: {', '.join(unread)}."] if unread else []
    told += about_stems(unread)
    if (held_out := held_out_file(folder)) is not None and not site.holdout:
        told.append(f"{held_out.name} is not read: {path.name} names no experiment under `holdout`.")
    first, *others = _held_out_files(folder) or [path]
    told += [f"{other.name} is not read, as {first.name} is: put the rows of both into one." for other in others]
    return told


def _given(path: Path) -> Any:
    """What a site file says, not checked. Errors: InputError."""
    if path.suffix == ".yaml":
        return read_tree(path)
    try:
        return json.loads(read_text(path, LARGEST_CONFIG, "a folder to import has one"))
    except InputError:
        raise
    except RecursionError:
        raise InputError(f"{shown_path(path)}: keys stand within keys too often: write them flatter.") from None
    except ValueError as error:
        raise InputError(f"{shown_path(path)} is not valid JSON: {error}; correct it there.") from None


def _by_short_name(place: str) -> str:
    """`experiments.May.level` of `experiments.May.downstream_level_m`: as it may be written with a unit of its own."""
    short = {long: name for name, long in OF_FLOW}
    before, dot, last = place.rpartition(".")
    return f"{before}{dot}{short.get(last, last)}"


def _sentence(error: ValidationError) -> str:
    problem = error.errors()[0]
    place = dotted(tuple(key for key in problem["loc"] if key != "[key]")) or "site.json"
    if problem["type"] == "missing":
        return f"`{_by_short_name(place)}` is missing; add it."
    expected = expected_in_words(problem)
    for said, meant in (("valid number", "number"), ("valid string", "text in quotes")):
        expected = expected.replace(said, meant)
    return f"`{place}` expected {expected}, got {repr(problem['input'])[:80]}; correct it."
