"""Do patches, stands and friction classes hold cells, does the water cover the plants, and does the bank law hold?"""

from collections.abc import Iterator, Mapping

import numpy as np

from vegglue.arrays import Array
from vegglue.case.channel_geometry import expected_depth, patches_present
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.parameter_space import Bounds, prior_range, value_at
from vegglue.case.parts import Value
from vegglue.case.plant_cover import share_in_patch
from vegglue.case.polygons import area_of, corners_of
from vegglue.case.schema import Case, Experiment
from vegglue.case.zones import BANK_SLOPE, slope
from vegglue.diagnosis.boundaries import dry_outlets
from vegglue.measurements.observations import Observations
from vegglue.wording.numbers import experiments_in_words, in_digits, range_in_digits

# By `numerics.emergent`: what is taken for plants that stand out of the water.
DRAG_OF_EMERGENT = {
    "constant": "phi is taken for the part in the water; `numerics.emergent: proportional` lets it fall with that part",
    "proportional": "phi falls with the part in the water, as `numerics.emergent` says",
}
# Share of the wet cells from which it matters that they are steep [-]: with banks twice as rough as the floor, a tenth
# of the width changes its friction by a tenth, which is twice what imported cases allow the model for.
MANY_STEEP = 0.1
# Share of the area of a patch [-] by which its cells may miss it, chosen, not measured: the drag of a patch goes with
# its area, and a tenth of it is less than the stems counted in a few frames tell.
LARGEST_MISS = 0.1
# Height [m] by which a canopy may differ from what verticals show, beside twice their error. Chosen, not measured:
# tops of plants end within some centimetres of each other, and a profile bends over as much.
UNEVEN_CANOPY = 0.05
# Share of a prior [-] whose end stands for its largest value: many lognormal ones have none, and of a million members
# one is rougher.
NEARLY_ALL = 0.999999
# Share of the height of a cross-section by which its middle stands above both sides in a ridge [-], at least so much
# [m], and share of the sections that are one [-]. Chosen, not measured.
OF_A_RIDGE, LEAST_RIDGE, MOST_RIDGE = 0.5, 0.02, 0.8


def remarks_on_patches(case: Case, site: Site) -> Iterator[str]:
    """Patches that the grid holds poorly: area in it against their own [m2], small ones, overlaps, unused stands."""
    cell = site.grid.dx * site.grid.dy
    for index, patch in enumerate(case.plants.patches):
        meant = area_of(corners_of(case, patch))
        share = share_in_patch(case, patch, site.grid)
        covered, hidden = share.sum() * cell, int(((share > 0.5) & (site.patch != index)).sum())
        if not share.any():
            yield f"Patch {patch.name} covers no cell: {_why_none(case, site, corners_of(case, patch))}."
        elif abs(covered - meant) > LARGEST_MISS * meant:
            remedy = _beyond_grid(case, corners_of(case, patch)) or "take finer cells"
            yield f"Patch {patch.name} of {in_digits(meant)} m2 becomes {in_digits(covered)} m2 of cells: {remedy}."
        elif share.max() < 0.5:
            yield (
                f"Patch {patch.name} covers less than half of every cell that it touches: its drag is spread over "
                "them; take finer cells."
            )
        if hidden:
            yield f"Patch {patch.name} loses {hidden} cells to patches listed after it, which win where they overlap."
    unused = case.plants.stands.keys() - {patch.stand for patch in case.plants.patches}
    for stand in sorted(unused):
        yield f"Stand {stand} grows in no patch."


def _why_none(case: Case, site: Site, corners: Array) -> str:
    """Why a patch with these corners (k, 2) [m] covers no cell."""
    x, y = site.grid.x, site.grid.y
    if case.frame is not None:
        east, north = corners.mean(axis=0)
        along, across = case.frame.to_model(east, north)
        if x[0] <= along <= x[-1] and y[0] <= across <= y[-1]:
            return "its corners are places on the map, and a case expects them along and across the channel; turn them"
    return _beyond_grid(case, corners) or "it has no area; correct its corners"


def _beyond_grid(case: Case, corners: Array) -> str:
    """That a patch with these corners (k, 2) [m] is not all in the grid, with both; nothing where it is."""
    for name, values, (low, high) in zip("xy", corners.T, (case.grid.x, case.grid.y), strict=True):
        if values.min() < low or values.max() > high:
            how = "outside" if values.max() <= low or values.min() >= high else "partly outside"
            return (
                f"it lies {how} the grid, at {name} = {values.min():g} to {values.max():g} m, where the grid has "
                f"{low:g} to {high:g} m; correct the patch or the grid"
            )
    return ""


def remarks_on_rising_floor(case: Case) -> Iterator[str]:
    """A floor by its numbers that rises downstream: the slope of a falling one is often written as negative."""
    west, east = case.grid.x
    for layer in case.bed:
        if layer.trapezoid is not None and (fall := layer.trapezoid.bed_slope) < 0.0:
            yield (
                f"The floor rises by {-fall * (east - west):.2g} m downstream (`bed_slope` {fall:g}): "
                "the slope of a floor that falls downstream is above 0."
            )


def remarks_on_ridge(case: Case, site: Site) -> Iterator[str]:
    """A surveyed bed that stands highest along its middle, as depths do that were taken for levels."""
    if all(layer.trapezoid is not None for layer in case.bed):
        return
    quarter = site.bed.shape[1] // 4
    middle = site.bed[:, quarter : site.bed.shape[1] - quarter].mean(axis=1)
    sides = np.maximum(site.bed[:, 0], site.bed[:, -1])
    ridge = middle - sides > np.maximum(OF_A_RIDGE * np.ptp(site.bed, axis=1), LEAST_RIDGE)
    if ridge.mean() > MOST_RIDGE:
        yield (
            f"The bed is higher along its middle than at both sides, by {np.median(middle - sides):.2g} m, as if z "
            "held depths: z is a level, and counts upward."
        )


def remarks_on_friction_classes(site: Site) -> Iterator[str]:
    """Friction classes that hold in no cell."""
    for index, name in enumerate(site.class_names):
        if not (site.friction_class == index).any():
            yield f"Friction class {name} holds in no cell."


def remarks_on_unnamed_banks(case: Case, site: Site) -> Iterator[str]:
    """Steep cells of a surveyed bed [-] that share the friction of the floor because there is one class only; whoever
    writes a trapezoid knows its banks.
    """
    surveyed = any(layer.trapezoid is None for layer in case.bed)
    if len(case.friction.classes) > 1 or case.friction.walls is not None or not surveyed:
        return
    shares = [
        float(steep[depth > 0].mean()) if (depth > 0).any() else 0.0
        for name, experiment in case.experiments.items()
        for now in [in_experiment(site, name)]
        for steep, depth in [(slope(now.bed, now.grid) > BANK_SLOPE, expected_depth(case, now, experiment))]
    ]
    if max(shares) > MANY_STEEP:
        yield (
            f"Up to {100 * max(shares):.0f} % of the wet cells are steeper than {BANK_SLOPE:g} and have the friction "
            f"of the floor: where they are banks, add a class for them, with the zone `{{class: bank, "
            f"beyond_slope_break: {BANK_SLOPE:g}}}`, or `diagnose` may name what is not there."
        )


def remarks_on_canopies(case: Case, site: Site, observations: Observations) -> Iterator[str]:
    """Canopies above the water, of all experiments in one sentence; dry stands, and heights [m] that differ from those
    measured.
    """
    emergent: dict[tuple[str, Bounds], dict[str, float]] = {}
    for name in [name for name in case.experiments if name not in dry_outlets(case, site)]:
        experiment = case.experiments[name]
        depth = expected_depth(case, in_experiment(site, name), experiment)
        for stand in sorted({case.plants.patches[index].stand for index in patches_present(case, name)}):
            cells = np.isin(site.patch, [i for i, patch in enumerate(case.plants.patches) if patch.stand == stand])
            if not cells.any():
                continue
            height = prior_range(case, _canopy_height(case, experiment, stand))
            deepest = float(depth[cells].max())
            if deepest <= 0:
                yield f"Stand {stand} stands dry in experiment {name}."
            elif height[1] > deepest:
                emergent.setdefault((stand, height), {})[name] = deepest
            yield from _measured_canopy(observations, name, stand, height)
    yield from (_emergent_in_words(case, *one, deepest) for one, deepest in emergent.items())


def _emergent_in_words(case: Case, stand: str, height: Bounds, deepest: Mapping[str, float]) -> str:
    """deepest: water of a stand [m], by the name of each experiment in which its canopy reaches above it."""
    shallow, deep = (f"{end(deepest.values()):.2g}" for end in (min, max))
    depths = shallow if shallow == deep else f"{shallow} to {deep}"
    reaches = "reaches" if height[0] >= max(deepest.values()) else "may reach"
    return (
        f"The canopy of {stand}, {range_in_digits(height)} m, {reaches} above the water of "
        f"{experiments_in_words(list(deepest))}, about {depths} m deep: "
        f"{DRAG_OF_EMERGENT[case.numerics.emergent]}."
    )


def _canopy_height(case: Case, experiment: Experiment, stand: str) -> Value:
    override = experiment.stands.get(stand)
    own = case.plants.stands[stand].canopy_height
    return own if override is None or override.canopy_height is None else override.canopy_height


def _measured_canopy(observations: Observations, name: str, stand: str, height: Bounds) -> Iterator[str]:
    for (experiment, section), canopy in observations.canopy_height.items():
        margin = 2.0 * canopy.standard_error + UNEVEN_CANOPY
        # Nothing compares with NaN, so a canopy that does not show raises no question.
        if experiment == name and max(height[0] - canopy.value, canopy.value - height[1]) > margin:
            yield (
                f"The verticals of {section} in experiment {name} put the canopy at {canopy.value:.2f} m, "
                f"the case puts {stand} at {range_in_digits(height)} m."
            )


def remarks_on_bank_law(case: Case, site: Site) -> Iterator[str]:
    """Where 12 h / k_s of the law of the banks falls below its floor [-] and is held there."""
    floor = case.numerics.bank_argument_minimum
    for index, (class_name, friction_class) in enumerate(case.friction.classes.items()):
        if friction_class.k_s is None:
            continue
        roughest = value_at(case, friction_class.k_s, NEARLY_ALL)
        up_to = "up to " if isinstance(friction_class.k_s, str) else ""
        shares = {name: _share_held(case, site, name, index, roughest) for name in case.experiments}
        held = ", ".join(f"{100 * share:.0f} % in {name}" for name, share in shares.items() if share > 0)
        if held:
            yield (
                f"With k_s of class {class_name} {up_to}{roughest:.3g} m, water shallower than "
                f"{floor * roughest / 12:.2g} m gets the friction of that depth: Keulegan's law has none where stones "
                f"reach through the water (12 h/k_s below {floor:g}). Of the wet cells of that class: {held}."
            )


def _share_held(case: Case, site: Site, experiment: str, friction_class: int, k_s: float) -> float:
    """Share of the wet cells of a class, without those of plants, in which 12 h / k_s lies below its floor [-]."""
    now = in_experiment(site, experiment)
    depth = expected_depth(case, now, case.experiments[experiment])
    wet = depth[(now.friction_class == friction_class) & (site.main_patch < 0) & (depth > 0)]
    return float(np.mean(12.0 * wet / k_s < case.numerics.bank_argument_minimum)) if wet.size else 0.0
