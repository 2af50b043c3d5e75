"""Is the ensemble large enough, does it fit its budget, and does every parameter act on something?"""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from vegglue.case.case_effects import effect_of
from vegglue.case.channel_geometry import patches_present
from vegglue.case.consistency import values
from vegglue.case.gridded_site import Site
from vegglue.case.messages import KeyPath
from vegglue.case.schema import Case
from vegglue.diagnosis.stations import station_in_words
from vegglue.measurements.kinds import unstated_errors
from vegglue.measurements.observations import OUTSIDE, Observations
from vegglue.results.fields import excess

# Fewer members leave two or three in each tail of 2.5 %. Draws around the best of them need no more than a start.
FEW_MEMBERS = 100


def remarks_on_ensemble(case: Case, observations: Observations) -> Iterator[str]:
    """Its size against what quantiles and Sobol' points need, and what the observations can settle."""
    members, table = case.simulate.members, observations.table
    if not case.parameters:
        yield "There are no `parameters`: every command that simulates or calibrates will refuse this; add a prior."
    if members < FEW_MEMBERS and case.infer.method == "glue":
        yield f"Only {members} members will be simulated: quantiles need some hundreds."
    if members & (members - 1):
        power = 2 ** round(np.log2(members))
        yield f"Note: {members} members is no power of two; Sobol' points fill the priors more evenly with {power}."
    if not len(table):
        yield "There are no observations: an ensemble can be simulated, but nothing inferred from it."
        return
    used = table[table["used"]]
    if len(used) < len(case.parameters):
        yield f"{len(used)} used observations cannot settle {len(case.parameters)} parameters."
    yield from refused_for_errors(case, table)
    for name in case.experiments:
        if not (used["experiment"] == name).any():
            yield f"Experiment {name} has no used observation: it is simulated, and tells nothing about the parameters."
    for row in table[~table["used"] & (table["reason"] != OUTSIDE)].to_dict("records"):
        yield f"The {station_in_words(row)} is not used: {row['reason']}."


def refused_for_errors(case: Case, table: pd.DataFrame) -> Iterator[str]:
    """Which commands refuse stations whose standard errors nobody states; nothing where all are stated."""
    if (unstated := unstated_errors(table)) is not None:
        refusing = "`infer`, `diagnose` and `run`" if case.infer.sigma == "known" else "`diagnose` and `run`"
        yield f"{refusing} will refuse this: {unstated}"


def remarks_on_kept_fields(case: Case, site: Site) -> Iterator[str]:
    """Fields that would exceed their budget [MB]."""
    if sentence := excess(case, site.grid):
        yield f"It will not be simulated as it is: {sentence}"


def remarks_on_idle_parameters(case: Case, site: Site) -> Iterator[str]:
    """Parameters whose value changes nothing in any experiment, or nothing in the built-in engine."""
    classes = {name for index, name in enumerate(site.class_names) if (site.friction_class == index).any()}
    growing = _growing(case, site)
    acting = {value for place, value, _ in values(case) if _acts(place, classes, growing)}
    for name in case.parameters:
        if name not in acting and case.engine is not None:
            yield f"Parameter {name} acts in the command of `engine` only: what effects would change ignores it."
        elif name not in acting:
            yield f"Parameter {name} acts in no cell of any experiment: its posterior will be its prior."


def remarks_on_units_of_effects(case: Case) -> Iterator[str]:
    """Parameters of effects whose prior states another unit than the effect takes: nothing is converted."""
    for key, entry in case.effects.items():
        taken = {one.name: one.unit for one in effect_of(case, key).parameters}
        for name, value in entry.values.items():
            said = case.parameters[value].unit if isinstance(value, str) else taken[name]
            if said.replace(" ", "") != taken[name].replace(" ", ""):
                yield (
                    f"`parameters.{value}` states {said}, and `effects.{key}` takes {name} in {taken[name]}: its "
                    "numbers are used as they stand; correct the unit or the numbers."
                )


def _acts(place: KeyPath, classes: set[str], growing: set[str]) -> bool:
    if place[:2] == ("friction", "classes"):
        return place[2] in classes
    if place[0] == "validation":
        return False
    return place[-2] in growing if "stands" in place[:-2] else True


def _growing(case: Case, site: Site) -> set[str]:
    """Stands that have cells in at least one experiment."""
    found = set()
    for experiment in case.experiments:
        for index in patches_present(case, experiment):
            if (site.patch == index).any():
                found.add(case.plants.patches[index].stand)
    return found
