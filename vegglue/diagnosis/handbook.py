"""Doubts about calibrated parameters: at a bound of their priors, beyond handbooks, or far off what was stated."""

from collections.abc import Iterator
from dataclasses import dataclass

from vegglue.calibration.baseline import Baseline
from vegglue.calibration.fit import interval95
from vegglue.case.case_effects import parameters_of_effects
from vegglue.case.channel_geometry import site_scales
from vegglue.case.parameter_space import probability
from vegglue.case.schema import Case
from vegglue.effects.scales import SiteScales
from vegglue.results.verdict import BeyondHandbook, EstimateAtBound, EstimateOffPrior

# Share of the prior beyond an estimate [-] below which its bound decides it. Chosen, not measured.
PRESSES = 0.02
# Distance from a normal or lognormal prior beyond which an estimate is reported [standard deviations]. Chosen: one
# in 80 by chance.
OFF_STATED = 2.5
# Widest a stream may be at its surface [m] that Chow (1959) calls minor.
MINOR_STREAM = 30.0


@dataclass(frozen=True)
class HandbookRange:
    """What a handbook gives for a quantity, low to high [its unit]; source: its key in the template of the remark."""

    low: float
    high: float
    source: str


# Manning's n [s m^(-1/3)], Chow (1959), table 5-6: glass 0.009 to cobbles and plastic grass in a flume; minor streams
# up to sluggish weedy reaches; major streams.
OF_FLUME = HandbookRange(0.008, 0.035, "chow-flume")
OF_MINOR_STREAM = HandbookRange(0.01, 0.15, "chow-minor")
OF_MAJOR_STREAM = HandbookRange(0.01, 0.06, "chow-major")
OF_WALLS = HandbookRange(0.008, 0.018, "chow-walls")


def parameter_doubts(base: Baseline) -> Iterator[EstimateAtBound | BeyondHandbook | EstimateOffPrior]:
    """Parameters at an end of their prior, beyond handbooks, or more than OFF_STATED off what was stated.

    Yields
    ------
    EstimateAtBound, BeyondHandbook or EstimateOffPrior
        None of amplitudes of effects, which have doubts of their own.
    """
    model, case = base.model, base.model.case
    scales, of_effects = site_scales(case, model.site), parameters_of_effects(case)
    for name in model.names:
        if name in of_effects:
            continue
        prior, value = case.parameters[name], interval95(model, base.fitted, name)[0]
        if prior.low is not None and prior.high is not None and prior.distribution in ("uniform", "loguniform"):
            below = float(probability(prior, value))
            if min(below, 1.0 - below) < PRESSES:
                yield EstimateAtBound(name, value, prior.unit, prior.low, prior.high, below < 0.5)
        known = _handbook(case, scales, name)
        if known is not None and not known.low <= value <= known.high:
            yield BeyondHandbook(name, value, prior.unit, known.low, known.high, known.source)
        far = abs(float(base.fitted.point.z[model.names.index(name)]))
        if prior.distribution in ("normal", "lognormal") and far > OFF_STATED:
            yield EstimateOffPrior(name, value, prior.unit, far)


def _handbook(case: Case, scales: SiteScales, name: str) -> HandbookRange | None:
    """The range of what a parameter stands for in the case; None if no handbook gives one."""
    walls = case.friction.walls
    if walls is not None and walls.n == name:
        return OF_WALLS
    if case.eddy_viscosity == name:
        # Not checked against it: 0.15 to 0.3 of straight channels to 1 to 3 of sharp bends, here with wider ends.
        eddy = scales.of("eddy")
        return HandbookRange(0.05 * eddy, 3.5 * eddy, "rutherford")
    of_classes = [one for one in case.friction.classes.values() if one.coefficient == name]
    if any(one.law == "manning" for one in of_classes):
        width = scales.discharge / (scales.speed * scales.mean_depth)
        of_stream = OF_MINOR_STREAM if width < MINOR_STREAM else OF_MAJOR_STREAM
        return OF_FLUME if walls is not None else of_stream
    if any(one.law == "keulegan" for one in of_classes):
        high = scales.mean_depth
        return HandbookRange(0.0, high, "keulegan")
    return None
