"""Checks of the case alone: patches, bed, friction classes, canopies, parameters, and the size of the ensemble.

Each check yields remarks, frozen values whose words stand in `wording/templates/checks.j2`. Lengths in m.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.case.bed_error import beds_of
from vegglue.case.case_effects import effect_of
from vegglue.case.channel_geometry import expected_depth, patches_present
from vegglue.case.config import values
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.parameter_space import Bounds, prior_range, value_at
from vegglue.case.schema import Case
from vegglue.case.survey_error import stands_out
from vegglue.case.zones import BANK_SLOPE, corners_of, share_in_patch, signed_area, slope
from vegglue.diagnosis.flow_check import dry_outlets
from vegglue.measurements.kinds import UnstatedErrors, Unused, unstated_errors
from vegglue.measurements.observations import Observations
from vegglue.results.ensemble import FieldsTooLarge, excess

# Share of the wet cells from which it matters that they are steep [-]: with banks twice as rough as the floor, a tenth
# of the width changes its friction by a tenth, which is twice what imported cases allow the model for.
MANY_STEEP = 0.1
# Share of the area of a patch [-] by which its cells may miss it, chosen, not measured: the drag of a patch goes with
# its area, and a tenth of it is less than the stems counted in a few frames show.
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
# Fewer members leave two or three in each tail of 2.5 %. Draws around the best of them need no more than a start.
FEW_MEMBERS = 100


@dataclass(frozen=True)
class BeyondGrid:
    """A patch that reaches out of the grid.

    Attributes
    ----------
    axis : str
        Along which.
    patch, grid : (float, float)
        Ends of the patch and of the grid along that axis [m].
    wholly : bool
        Whether none of it is in the grid.
    """

    axis: str
    patch: Bounds
    grid: Bounds
    wholly: bool


@dataclass(frozen=True)
class PatchWithoutCells:
    """A patch that covers no cell; on_map: its corners are places on the map."""

    patch: str
    on_map: bool
    beyond: BeyondGrid | None


@dataclass(frozen=True)
class PatchAreaMissed:
    """A patch whose cells have another area than the patch.

    Attributes
    ----------
    area, covered : float
        Of the patch and of its cells [m2].
    """

    patch: str
    area: float
    covered: float
    beyond: BeyondGrid | None


@dataclass(frozen=True)
class PatchInPartialCells:
    """A patch that covers less than half of every cell that it touches."""

    patch: str


@dataclass(frozen=True)
class PatchHidden:
    """A patch that loses cells to patches listed after it."""

    patch: str
    cells: int


@dataclass(frozen=True)
class StandUnused:
    """A vegetation type that grows in no patch."""

    stand: str


@dataclass(frozen=True)
class FloorRises:
    """A floor given by numbers that rises downstream; rise over the grid [m], slope as in the config [-]."""

    rise: float
    slope: float


@dataclass(frozen=True)
class BedHighestInMiddle:
    """A surveyed bed whose middle stands above both sides by a median height [m]."""

    height: float


@dataclass(frozen=True)
class FrictionClassUnused:
    """A friction class that holds in no cell."""

    friction_class: str


@dataclass(frozen=True)
class SurveyLeftOut:
    """How well each surveyed line (or point) is predicted from all others.

    Attributes
    ----------
    error, stated, straight : float
        Root mean square of errors, of stated ones, and of those of straight lines between the neighbours [m].
    most : float
        Largest error of a line over its stated one [-].
    most_at : float
        x of that line [m].
    x : float
        Of the line that is furthest off [m].
    offset, offset_error : float
        By how much it lies too high, and its standard error [m].
    suspect : bool
        Whether errors alone hardly put a line so far off.
    """

    count: int
    error: float
    stated: float
    straight: float
    most: float
    most_at: float
    x: float
    offset: float
    offset_error: float
    suspect: bool


@dataclass(frozen=True)
class ErrorsAssumed:
    """Errors that an import assumes for a natural reach, as no file states them.

    Attributes
    ----------
    edges, probes : float
        Of the sides of patches and of the places of verticals across [m].
    discharge, stems : float
        Of discharges and of stems [-].
    """

    edges: float
    probes: float
    discharge: float
    stems: float


@dataclass(frozen=True)
class SteepCellsLikeFloor:
    """Wet cells steeper than `slope` [-] with the friction of the floor: their share, in the worst experiment [-]."""

    share: float
    slope: float


@dataclass(frozen=True)
class StandDry:
    """A vegetation type without water in an experiment."""

    stand: str
    experiment: str


@dataclass(frozen=True)
class CanopyEmergent:
    """A canopy above the water.

    Attributes
    ----------
    height : (float, float)
        Within 95 % of the prior [m].
    depths : tuple of float
        Largest depth there in each experiment [m].
    always : bool
        Whether it is above the water whatever its height in that range.
    emergent : str
        `numerics.emergent` of the case.
    """

    stand: str
    height: Bounds
    experiments: tuple[str, ...]
    depths: tuple[float, ...]
    always: bool
    emergent: str


@dataclass(frozen=True)
class CanopyUnlikeMeasured:
    """A canopy height of the case, and another one that the verticals of a section show.

    Attributes
    ----------
    measured : float
        [m]
    height : (float, float)
        95 % of the prior [m].
    """

    section: str
    experiment: str
    measured: float
    stand: str
    height: Bounds


@dataclass(frozen=True)
class BankLawHeld:
    """Wet cells of a friction class that are too shallow for Keulegan's law.

    Attributes
    ----------
    k_s : float
        [m]
    up_to : bool
        Whether that is the upper end of its prior.
    depth : float
        Below which the law is held [m].
    argument : float
        12 h / k_s there [-].
    shares : tuple of (str, float)
        Of the wet cells of the class by experiment [-].
    """

    friction_class: str
    k_s: float
    up_to: bool
    depth: float
    argument: float
    shares: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class NoParameters:
    """A case without priors."""


@dataclass(frozen=True)
class NoObservations:
    """A case without measurements."""


@dataclass(frozen=True)
class FewMembers:
    """An ensemble too small for quantiles."""

    members: int


@dataclass(frozen=True)
class MembersNoPowerOfTwo:
    """An ensemble size that Sobol' points fill unevenly, and the nearest power of two."""

    members: int
    nearest: int


@dataclass(frozen=True)
class FewerObservationsThanParameters:
    """Used observations against parameters."""

    observations: int
    parameters: int


@dataclass(frozen=True)
class ErrorsRefused:
    """Commands that refuse stations without standard errors, and these."""

    commands: tuple[str, ...]
    unstated: UnstatedErrors


@dataclass(frozen=True)
class ExperimentUnmeasured:
    """An experiment without a used observation."""

    experiment: str


@dataclass(frozen=True)
class StationUnused:
    """A station that is not used, and why; x, y [m]."""

    experiment: str
    x: float
    y: float
    reason: str


@dataclass(frozen=True)
class FieldsBeyondBudget:
    """Kept fields larger than their budget; reason: the refusal of `simulate`."""

    reason: FieldsTooLarge


@dataclass(frozen=True)
class ParameterIdle:
    """A parameter that acts in no cell of any experiment; in_engine: the command of `engine` may use it."""

    parameter: str
    in_engine: bool


@dataclass(frozen=True)
class UnitOfPrior:
    """A prior in another unit than the effect takes.

    Attributes
    ----------
    parameter, stated : str
        The parameter, and the unit of its prior.
    effect, quantity, taken : str
        Key of the effect, which of its numbers it is, and the unit of that.
    """

    parameter: str
    stated: str
    effect: str
    quantity: str
    taken: str


def remarks_on_patches(case: Case, site: Site) -> Iterator[object]:
    """Patches that the grid holds poorly, small ones, overlaps, and vegetation types in no patch."""
    cell, (x, y) = site.grid.dx * site.grid.dy, (site.grid.x, site.grid.y)
    for index, patch in enumerate(case.plants.patches):
        corners = corners_of(case, patch)
        area, share = abs(signed_area(corners)), share_in_patch(case, patch, site.grid)
        covered, hidden = float(share.sum() * cell), int(((share > 0.5) & (site.patch != index)).sum())
        beyond = None
        for axis, along, (low, high) in zip("xy", corners.T, (case.grid.x, case.grid.y), strict=True):
            first, last = float(along.min()), float(along.max())
            if beyond is None and (first < low or last > high):
                beyond = BeyondGrid(axis, (first, last), (low, high), last <= low or first >= high)
        if not share.any():
            on_map = False
            if case.frame is not None:
                at_x, at_y = case.frame.to_model(*corners.mean(axis=0))
                on_map = bool(x[0] <= at_x <= x[-1] and y[0] <= at_y <= y[-1])
            yield PatchWithoutCells(patch.name, on_map, beyond)
        elif abs(covered - area) > LARGEST_MISS * area:
            yield PatchAreaMissed(patch.name, area, covered, beyond)
        elif share.max() < 0.5:
            yield PatchInPartialCells(patch.name)
        if hidden:
            yield PatchHidden(patch.name, hidden)
    unused = case.plants.stands.keys() - {patch.stand for patch in case.plants.patches}
    yield from map(StandUnused, sorted(unused))


def remarks_on_bed(case: Case, site: Site) -> Iterator[object]:
    """A floor that rises downstream, as the slope of a falling one is often written as negative; a surveyed bed that
    stands highest along its middle, as depths do that were taken for levels.
    """
    west, east = case.grid.x
    for layer in case.bed:
        if layer.trapezoid is not None and (fall := layer.trapezoid.bed_slope) < 0.0:
            yield FloorRises(-fall * (east - west), fall)
    if all(layer.trapezoid is not None for layer in case.bed):
        return
    quarter = site.bed.shape[1] // 4
    middle = site.bed[:, quarter : site.bed.shape[1] - quarter].mean(axis=1)
    above = middle - np.maximum(site.bed[:, 0], site.bed[:, -1])
    if (above > np.maximum(OF_A_RIDGE * np.ptp(site.bed, axis=1), LEAST_RIDGE)).mean() > MOST_RIDGE:
        yield BedHighestInMiddle(float(np.median(above)))


def remarks_on_friction_classes(site: Site) -> Iterator[object]:
    """Friction classes that hold in no cell."""
    for index, name in enumerate(site.class_names):
        if not (site.friction_class == index).any():
            yield FrictionClassUnused(name)


def remarks_on_survey(case: Case) -> Iterator[SurveyLeftOut]:
    """How well each survey of the bed predicts its own lines."""
    for layer in beds_of(case):
        if layer.survey is not None and (found := layer.survey.left_out) is not None:
            worst, off = (found.most, found.most_at), (found.offset_at, found.offset, found.offset_error)
            yield SurveyLeftOut(found.count, found.error, found.stated, found.straight, *worst, *off, stands_out(found))


def remarks_on_assumed_errors(case: Case) -> Iterator[ErrorsAssumed]:
    """What an import of a natural reach assumes of the errors of its site."""
    error = case.model_error
    if any(of_site := (error.edges, error.probes, error.discharge, error.stems)):
        yield ErrorsAssumed(*of_site)


def remarks_on_unnamed_banks(case: Case, site: Site) -> Iterator[SteepCellsLikeFloor]:
    """Steep cells of a surveyed bed that share the friction of the floor because there is one class only; the banks of
    a trapezoid are known to its author.
    """
    surveyed = any(layer.trapezoid is None for layer in case.bed)
    if len(case.friction.classes) > 1 or case.friction.walls is not None or not surveyed:
        return
    share = 0.0
    for name, experiment in case.experiments.items():
        now = in_experiment(site, name)
        wet = expected_depth(case, now, experiment) > 0
        share = max(share, float((slope(now.bed, now.grid) > BANK_SLOPE)[wet].mean()) if wet.any() else 0.0)
    if share > MANY_STEEP:
        yield SteepCellsLikeFloor(share, BANK_SLOPE)


def remarks_on_canopies(case: Case, site: Site, observations: Observations) -> Iterator[object]:
    """Canopies above the expected water, stands that are dry, and heights that differ from those measured.

    Yields
    ------
    StandDry
        Of each experiment.
    CanopyUnlikeMeasured
        If the measured height lies outside 95 % of the prior by more than 2 standard errors and UNEVEN_CANOPY.
    CanopyEmergent
        All experiments in one remark, after all others.
    """
    emergent: dict[tuple[str, Bounds], dict[str, float]] = {}
    dry = dry_outlets(case, site)
    for name in [name for name in case.experiments if name not in dry]:
        experiment = case.experiments[name]
        depth = expected_depth(case, in_experiment(site, name), experiment)
        for stand in sorted({case.plants.patches[index].stand for index in patches_present(case, name)}):
            cells = np.isin(site.patch, [i for i, patch in enumerate(case.plants.patches) if patch.stand == stand])
            if not cells.any():
                continue
            own, override = case.plants.stands[stand].canopy_height, experiment.stands.get(stand)
            if override is not None and override.canopy_height is not None:
                own = override.canopy_height
            height, deepest = prior_range(case, own), float(depth[cells].max())
            if deepest <= 0:
                yield StandDry(stand, name)
            elif height[1] > deepest:
                emergent.setdefault((stand, height), {})[name] = deepest
            for (where, section), canopy in observations.canopy_height.items():
                margin = 2.0 * canopy.standard_error + UNEVEN_CANOPY
                # Nothing compares with NaN, so a canopy that does not show raises no question.
                if where == name and max(height[0] - canopy.value, canopy.value - height[1]) > margin:
                    yield CanopyUnlikeMeasured(section, name, canopy.value, stand, height)
    for (stand, height), depths in emergent.items():
        always = height[0] >= max(depths.values())
        yield CanopyEmergent(stand, height, tuple(depths), tuple(depths.values()), always, case.numerics.emergent)


def remarks_on_bank_law(case: Case, site: Site) -> Iterator[BankLawHeld]:
    """Cells without plants in which 12 h / k_s of the law of the banks is held at its lower bound.

    Yields
    ------
    BankLawHeld
        Of each friction class with k_s, at the upper end of its prior (quantile NEARLY_ALL) and the expected depth.
    """
    floor = case.numerics.bank_argument_minimum
    for index, (name, friction_class) in enumerate(case.friction.classes.items()):
        if friction_class.k_s is None:
            continue
        roughest, shares = value_at(case, friction_class.k_s, NEARLY_ALL), []
        for experiment in case.experiments:
            now = in_experiment(site, experiment)
            depth = expected_depth(case, now, case.experiments[experiment])
            wet = depth[(now.friction_class == index) & (site.main_patch < 0) & (depth > 0)]
            share = float(np.mean(12.0 * wet / roughest < floor)) if wet.size else 0.0
            shares += [(experiment, share)] if share > 0 else []
        if shares:
            up_to = isinstance(friction_class.k_s, str)
            yield BankLawHeld(name, roughest, up_to, floor * roughest / 12, floor, tuple(shares))


def remarks_on_ensemble(case: Case, observations: Observations) -> Iterator[object]:
    """Its size against what quantiles and Sobol' points need, and what the observations can settle."""
    members, table = case.simulate.members, observations.table
    if not case.parameters:
        yield NoParameters()
    if members < FEW_MEMBERS and case.infer.method == "glue":
        yield FewMembers(members)
    if members & (members - 1):
        yield MembersNoPowerOfTwo(members, 2 ** round(np.log2(members)))
    if not len(table):
        yield NoObservations()
        return
    used = table[table["used"]]
    if len(used) < len(case.parameters):
        yield FewerObservationsThanParameters(len(used), len(case.parameters))
    yield from refused_for_errors(case, table)
    for name in case.experiments:
        if not (used["experiment"] == name).any():
            yield ExperimentUnmeasured(name)
    for row in table[~table["used"] & (table["reason"] != Unused.OUTSIDE)].itertuples():
        yield StationUnused(str(row.experiment), float(row.x), float(row.y), str(row.reason))


def refused_for_errors(case: Case, table: pd.DataFrame) -> Iterator[ErrorsRefused]:
    """Which commands refuse stations without standard errors; nothing if all are stated."""
    if (unstated := unstated_errors(table)) is not None:
        always = ("diagnose", "run")
        yield ErrorsRefused(("infer", *always) if case.infer.sigma == "known" else always, unstated)


def remarks_on_kept_fields(case: Case, site: Site) -> Iterator[FieldsBeyondBudget]:
    """Fields that would exceed their budget."""
    if beyond := excess(case, site.grid):
        yield FieldsBeyondBudget(beyond)


def remarks_on_parameters(case: Case, site: Site) -> Iterator[object]:
    """Parameters whose value changes nothing in any experiment, or nothing in the built-in engine; parameters of
    effects whose prior states another unit than the effect takes, as nothing is converted.
    """
    classes = {name for index, name in enumerate(site.class_names) if (site.friction_class == index).any()}
    growing = {
        case.plants.patches[index].stand
        for experiment in case.experiments
        for index in patches_present(case, experiment)
        if (site.patch == index).any()
    }
    acting = set()
    for place, value, _ in values(case):
        if place[:2] == ("friction", "classes"):
            acts = place[2] in classes
        else:
            acts = place[0] != "validation" and ("stands" not in place[:-2] or place[-2] in growing)
        acting |= {value} if acts else set()
    for name in case.parameters:
        if name not in acting:
            yield ParameterIdle(name, case.engine is not None)
    for key, entry in case.effects.items():
        taken = {one.name: one.unit for one in effect_of(case, key).parameters}
        for name, value in entry.values.items():
            stated = case.parameters[value].unit if isinstance(value, str) else taken[name]
            if stated.replace(" ", "") != taken[name].replace(" ", ""):
                yield UnitOfPrior(str(value), stated, key, name, taken[name])
