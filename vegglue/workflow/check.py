"""What is odd about a case, in plain sentences, before hours are spent on it; errors are refused earlier."""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.case.consistency import values
from vegglue.case.messages import KeyPath
from vegglue.case.parameter_space import middle_value
from vegglue.case.parts import Value
from vegglue.case.prior import quantile
from vegglue.case.schema import Case, Experiment
from vegglue.measurements.kinds import kind_of, velocity_rows
from vegglue.measurements.observations import Observations
from vegglue.resistance.physical_constants import GRAVITY
from vegglue.results.fields import excess
from vegglue.site.channel_geometry import expected_depth, patches_present
from vegglue.site.gridded_site import Site
from vegglue.site.polygons import area_of, corners_of, distance_to_outline
from vegglue.site.zones import cells_of_patch, centres_within, inflow_cells

Bounds = tuple[float, float]
FEW_MEMBERS = 100
# Nearer to a patch edge than this share of a cell [-], a station is on it.
ON_THE_EDGE = 0.02


def check_case(case: Case, site: Site, observations: Observations) -> list[str]:
    """What a user should look at, one sentence each, none when nothing is odd."""
    checks = (
        _ensemble(case, observations),
        _kept_fields(case, site),
        _patches(case, site),
        _friction(case, site),
        _idle_parameters(case, site),
        _boundaries(case, site),
        _canopies(case, site, observations),
        _bank_law(case, site),
        _stations(case, site, observations),
        _edges_of_patches(case, observations),
        _discharges(case, observations),
    )
    return [sentence for check in checks for sentence in check]


def _shown(bounds: Bounds) -> str:
    low, high = bounds
    return f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"


def _range(case: Case, value: Value) -> Bounds:
    """What a value may be: 95 % of its prior, or itself twice."""
    if isinstance(value, str):
        low, high = quantile(case.parameters[value], [0.025, 0.975])
        return float(low), float(high)
    return value, value


def _ensemble(case: Case, observations: Observations) -> Iterator[str]:
    members, table = case.simulate.members, observations.table
    if members < FEW_MEMBERS:
        yield f"Only {members} members will be simulated: quantiles need some hundreds."
    if members & (members - 1):
        power = 2 ** round(np.log2(members))
        yield f"Note: {members} members is no power of two; Sobol' points fill the priors more evenly with {power}."
    if not len(table):
        yield "There are no observations: an ensemble can be simulated, but nothing inferred from it."
        return
    used = table[table["used"].astype(bool)]
    if len(used) < len(case.parameters):
        yield f"{len(used)} used observations cannot settle {len(case.parameters)} parameters."
    if case.infer.sigma == "known" and used["standard_error"].isna().any():
        count = int(used["standard_error"].isna().sum())
        yield f"`infer.sigma` is known, but {count} of {len(used)} used observations have no standard error."
    for name in case.experiments:
        if not (used["experiment"] == name).any():
            yield f"Experiment {name} has no used observation: it is simulated, and tells nothing about the parameters."
    for row in table[~table["used"].astype(bool)].to_dict("records"):
        yield f"The {_station(row)} is not used: {row['reason']}."


def _kept_fields(case: Case, site: Site) -> Iterator[str]:
    if sentence := excess(case, site.grid):
        yield f"It will not be simulated as it is: {sentence}"


def _station(row: Mapping[Hashable, Any]) -> str:
    return f"station at x = {row['x']:g}, y = {row['y']:g} m of experiment {row['experiment']}"


def _patches(case: Case, site: Site) -> Iterator[str]:
    cell = site.grid.dx * site.grid.dy
    for index, patch in enumerate(case.plants.patches):
        meant = area_of(corners_of(patch))
        alone = cells_of_patch(patch, site.grid)
        covered, hidden = alone.sum() * cell, int((alone & (site.patch != index)).sum())
        if not alone.any():
            yield f"Patch {patch.name} covers no cell centre: it is outside the grid, or smaller than a cell."
        elif abs(covered - meant) > 0.1 * meant:
            yield f"Patch {patch.name} of {meant:.3g} m2 becomes {covered:.3g} m2 of cells: take finer cells."
        if hidden:
            yield f"Patch {patch.name} loses {hidden} cells to patches listed after it, which win where they overlap."
    unused = case.plants.stands.keys() - {patch.stand for patch in case.plants.patches}
    for stand in sorted(unused):
        yield f"Stand {stand} grows in no patch."


def _friction(case: Case, site: Site) -> Iterator[str]:
    for index, name in enumerate(site.class_names):
        if not (site.friction_class == index).any():
            yield f"Friction class {name} holds in no cell."


def _idle_parameters(case: Case, site: Site) -> Iterator[str]:
    classes = {name for index, name in enumerate(site.class_names) if (site.friction_class == index).any()}
    growing = _growing(case, site)
    acting = {value for place, value, _ in values(case) if _acts(place, classes, growing)}
    for name in case.parameters:
        if name not in acting:
            yield f"Parameter {name} acts in no cell of any experiment: its posterior will be its prior."


def _acts(place: KeyPath, classes: set[str], growing: set[str]) -> bool:
    if place[0] == "friction":
        return place[2] in classes
    return place[-2] in growing if "stands" in place[:-2] else True


def _growing(case: Case, site: Site) -> set[str]:
    """Stands that have cells in at least one experiment."""
    found = set()
    for experiment in case.experiments:
        for index in patches_present(case, experiment):
            if (site.patch == index).any():
                found.add(case.plants.patches[index].stand)
    return found


def _boundaries(case: Case, site: Site) -> Iterator[str]:
    for name, experiment in case.experiments.items():
        depth = expected_depth(case, site, experiment)
        open_ = centres_within(case.outlet.range, site.grid.y)
        level = middle_value(case, experiment.level)
        wet = np.maximum(depth[-1, open_], 0.0)
        if not open_.any():
            yield "The outlet holds no cell centre: no water can leave."
        elif not (wet > 0).any():
            lowest = site.bed[-1, open_].min()
            yield f"The outlet level of experiment {name}, {level:g} m, is below the bed there, {lowest:.3g} m."
        elif (froude := _froude(case, experiment, wet, site.grid.dy)) > 0.7:
            yield f"Experiment {name} leaves at a Froude number of {froude:.2g}: the outlet level may not hold near 1."
        if (depth[:, [0, -1]] > 0).any():
            yield f"Experiment {name} puts water on the side edges of the grid, which act as walls: widen the grid."
        for inflow, side in case.inflows.items():
            edge = {"west": depth[0], "south": depth[:, 0], "north": depth[:, -1]}[side.side]
            cells = inflow_cells(side, site.grid)
            if not cells.size:
                yield f"Inflow {inflow} holds no cell centre: no water can enter."
            elif side.side == "west" and not (edge[cells] > 0).any():
                yield f"Inflow {inflow} lies above the water of experiment {name}."


def _froude(case: Case, experiment: Experiment, depth: Array, width: float) -> float:
    """Fr = Q / (A sqrt(g A / B)) of the outlet [-]."""
    area, top = float(depth.sum()) * width, float((depth > 0).sum()) * width
    discharge = sum(middle_value(case, value) for value in experiment.discharge.values())
    return discharge / (area * float(np.sqrt(GRAVITY * area / top)))


def _canopies(case: Case, site: Site, observations: Observations) -> Iterator[str]:
    for name, experiment in case.experiments.items():
        depth = expected_depth(case, site, experiment)
        for stand in sorted({case.plants.patches[index].stand for index in patches_present(case, name)}):
            cells = np.isin(site.patch, [i for i, patch in enumerate(case.plants.patches) if patch.stand == stand])
            if not cells.any():
                continue
            height = _range(case, _canopy_height(case, experiment, stand))
            canopy, deepest = f"The canopy of {stand}, {_shown(height)} m,", float(depth[cells].max())
            if deepest <= 0:
                yield f"Stand {stand} stands dry in experiment {name}."
            elif height[1] > deepest:
                reaches = "reaches" if height[0] >= deepest else "may reach"
                yield (
                    f"{canopy} {reaches} above the water of experiment {name}, about {deepest:.2g} m deep: "
                    f"`numerics.emergent` ({case.numerics.emergent}) then decides its drag."
                )
            yield from _measured_canopy(observations, name, stand, height)


def _canopy_height(case: Case, experiment: Experiment, stand: str) -> Value:
    override = experiment.stands.get(stand)
    own = case.plants.stands[stand].canopy_height
    return own if override is None or override.canopy_height is None else override.canopy_height


def _measured_canopy(observations: Observations, name: str, stand: str, height: Bounds) -> Iterator[str]:
    for (experiment, section), canopy in observations.canopy_height.items():
        margin = 2.0 * canopy.standard_error + 0.05
        # Nothing compares with NaN, so a canopy that does not show raises no question.
        if experiment == name and max(height[0] - canopy.value, canopy.value - height[1]) > margin:
            yield (
                f"The verticals of {section} in experiment {name} put the canopy at {canopy.value:.2f} m, "
                f"the case puts {stand} at {_shown(height)} m."
            )


def _bank_law(case: Case, site: Site) -> Iterator[str]:
    floor = case.numerics.bank_argument_minimum
    for index, (name, friction_class) in enumerate(case.friction.classes.items()):
        if friction_class.k_s is None:
            continue
        roughest = _bound(case, friction_class.k_s)
        for experiment_name, experiment in case.experiments.items():
            depth = expected_depth(case, site, experiment)
            wet = depth[(site.friction_class == index) & (site.patch < 0) & (depth > 0)]
            share = float(np.mean(12.0 * wet / roughest < floor)) if wet.size else 0.0
            if share > 0:
                yield (
                    f"At k_s = {roughest:.3g} m, 12 h/k_s falls below {floor:g} and is held there where h < "
                    f"{floor * roughest / 12:.2g} m: in {100 * share:.0f} % of the wet cells of class {name} "
                    f"in experiment {experiment_name}."
                )


def _bound(case: Case, value: Value) -> float:
    return float(quantile(case.parameters[value], 0.999999)) if isinstance(value, str) else value


def _stations(case: Case, site: Site, observations: Observations) -> Iterator[str]:
    (west, east), (south, north) = case.grid.x, case.grid.y
    for row in observations.table.to_dict("records"):
        if not (west <= row["x"] <= east and south <= row["y"] <= north):
            yield f"The {_station(row)} is outside the grid."
            continue
        if not kind_of(row["kind"]).at_point:
            continue
        i, j = np.abs(site.grid.x - row["x"]).argmin(), np.abs(site.grid.y - row["y"]).argmin()
        depth = float(expected_depth(case, site, case.experiments[row["experiment"]])[i, j])
        if not row["depth"] > 0 and depth <= 0:
            yield f"The {_station(row)} is outside the wet channel, about {-depth:.2g} m above the water."


def _edges_of_patches(case: Case, observations: Observations) -> Iterator[str]:
    table = observations.table[velocity_rows(observations.table)]
    limit = ON_THE_EDGE * min(case.grid.cell)
    for patch in case.plants.patches:
        near = [
            distance_to_outline(corners_of(patch), x, y) < limit for x, y in zip(table["x"], table["y"], strict=True)
        ]
        for section, rows in table[np.array(near, dtype=bool)].groupby("section"):
            at = _listed([f"{y:g}" for y in sorted(set(rows["y"]))])
            yield (
                f"Stations of {section} at y = {at} m lie on the edge of patch {patch.name}: "
                f"there the model interpolates between plants and open water."
            )


def _listed(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _discharges(case: Case, observations: Observations) -> Iterator[str]:
    for (name, section), by_rule in observations.discharge.items():
        parts = [_range(case, value) for value in case.experiments[name].discharge.values()]
        total = (sum(low for low, _ in parts), sum(high for _, high in parts))
        for rule, measured in by_rule.items():
            off = max(total[0] - measured.value, measured.value - total[1])
            if off > max(2.0 * measured.standard_error, 0.03 * measured.value):
                found = f"{measured.value:.3g} ± {measured.standard_error:.2g} m3/s by the rule `{rule}`"
                yield f"The ADV of {section} in experiment {name} gives {found}, the case says {_shown(total)} m3/s."
