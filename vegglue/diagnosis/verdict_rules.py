"""The rules that make a verdict of what a diagnosis found. Silence has to be earned, and so has a name: see DECISIONS.

A new reason is a class in `results/verdict.py`, its rule here, and its macro in wording/templates/verdict.j2.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from dataclasses import field as by_default

from vegglue.calibration.candidates import START_OFF_ENDS
from vegglue.case.parameter_space import FURTHEST
from vegglue.decision_constants import constants
from vegglue.effects.identity import EffectIdentity
from vegglue.measurements.plausibility import ImplausibleOutlet, ImplausibleValues
from vegglue.measurements.section_discharge import CHANGE_DISCHARGE, CarriedDischarge, discharge_mismatches
from vegglue.normal_range import NORMAL95
from vegglue.results import verdict
from vegglue.results.causes import (
    CandidateEffect,
    CandidateLaws,
    FaultyInstrument,
    FieldFound,
    LocalAnomaly,
    ModelErrorUsed,
    Rival,
    Step,
    effects_among,
)
from vegglue.results.verdict import (
    BedCorrected,
    ChiSquare,
    EffectFound,
    EffectsTested,
    EstimatedErrors,
    NameHangsOnSection,
    Note,
    OneSection,
    Reason,
    Remaining,
    Verdict,
    VerdictKind,
    is_too_small,
)

# Effects of the library, and terms at a place, that let sections read another discharge than stated: water that comes
# or goes, readings that are off as a whole, a bed or a level that is not there.
OF_DISCHARGES = (
    *CHANGE_DISCHARGE, "outlet_level_error", "gauge_datum", "device_gain", "probe_gain", "zero_offset",
    "partial_depth", "floor_level_error", "bank_level_error", "bed_slope_error", "flank_scour",
)  # fmt: skip
TERMS_OF_DISCHARGES, OF_DEVICES = ("inflow", "bed"), ("device_gain", "zero_offset")


@dataclass(frozen=True)
class Doubts:
    """What may take a name or silence from a verdict.

    Attributes
    ----------
    held_out, by_chance : float
        Errors at held-out measurements over the expected ones [-], NaN without any, infinite without a flow; and
        what of that errors alone exceed in 5 % of cases.
    between : float
        Errors between the sections over those of the data [-].
    neighbours : bool
        Whether readings side by side are excluded.
    strained : (str, float)
        The parameter furthest off its prior, and how far [standard deviations].
    strained_without : (str, float) or None
        The section without which it is not too far, and how far then.
    hangs_on : NameHangsOnSection or None
        The section without which another name leads.
    one_section : OneSection or None
        That of all measurements.
    carried : tuple of CarriedDischarge
        Sections that clearly carry another discharge than stated.
    """

    held_out: float = float("nan")
    by_chance: float = 1.0
    between: float = 1.0
    neighbours: bool = False
    strained: tuple[str, float] = ("", 0.0)
    strained_without: tuple[str, float] | None = None
    hangs_on: NameHangsOnSection | None = None
    one_section: OneSection | None = None
    carried: tuple[CarriedDischarge, ...] = ()


@dataclass(frozen=True)
class VerdictInputs:
    """What a verdict rests on.

    Attributes
    ----------
    candidates : tuple of CandidateEffect
        Every tested effect, the strongest first.
    misfit : ChiSquare
        Of the model with all that was accepted.
    instruments : tuple of FaultyInstrument
        What was accepted.
    model_error : ModelErrorUsed or None
        What was found beside it.
    undecided : tuple of Rival
        Hypotheses of which none leads.
    implausible : tuple of ImplausibleOutlet or ImplausibleValues
        Values that no flow can have.
    not_excluded : tuple of tuple of str
        Groups of effects among which one that is there undetected is.
    significant_effects : mapping of float
        p of those that were not accepted, by name [-].
    remainder : bool
        Whether all of them may be a remainder of what was.
    surroundings : tuple of Note
        Notes on the map, the measured stretch, the depth and the parameters.
    excluded : mapping of str
        Effects that cannot act at the site, with the reason of each.
    bed : tuple of BedCorrected
        Where it differs from the surveyed one, the clearest first.
    """

    candidates: tuple[CandidateEffect, ...]
    errors: EstimatedErrors
    misfit: ChiSquare
    doubts: Doubts
    steps: tuple[Step, ...] = ()
    places: tuple[LocalAnomaly, ...] = ()
    instruments: tuple[FaultyInstrument, ...] = ()
    undecided: tuple[Rival, ...] = ()
    implausible: tuple[ImplausibleOutlet | ImplausibleValues, ...] = ()
    field: FieldFound | None = None
    laws: CandidateLaws | None = None
    model_error: ModelErrorUsed | None = None
    not_excluded: tuple[tuple[str, ...], ...] = ()
    significant_effects: Mapping[str, float] = by_default(default_factory=dict)
    remainder: bool = False
    surroundings: tuple[Note, ...] = ()
    excluded: Mapping[str, str] = by_default(default_factory=dict)
    bed: tuple[BedCorrected, ...] = ()


def make_verdict(inputs: VerdictInputs) -> Verdict:
    """The verdict on what was found, with what remains and what else should be known.

    Data come first, then doubt, laws, fields, places, effects and silence, which has to be earned as a name has.
    """
    testable = sum(one.detectability.testable for one in inputs.candidates)
    plain = Verdict(
        kind="cannot-tell",
        misfit=inputs.misfit,
        effects=tuple(effect_found(step, inputs.candidates) for step in inputs.steps),
        places=inputs.places,
        tested=EffectsTested(effects_among(inputs.candidates), len(inputs.candidates), testable),
        not_excluded=inputs.not_excluded,
        significant_effects=dict(inputs.significant_effects),
    )
    found = _concluded(inputs, plain)
    remaining: list[Remaining] = []
    if (inputs.steps or inputs.places) and found.kind != "cannot-tell" and inputs.field is None:
        if inputs.errors.clearly_larger:
            remaining.append(verdict.ErrorsStillLarger(inputs.errors.scale))
        if ranked := sorted(inputs.significant_effects.items(), key=lambda one: one[1]):
            remaining.append(verdict.EffectsStillSignificant(tuple(ranked), inputs.remainder))
    explained = () if found.doubts_the_data else tuple(discharge_mismatches(inputs.doubts.carried))
    sure = not (found.kind == "cannot-tell" or found.reasons or remaining or found.field or found.laws)
    bed = inputs.bed[0] if inputs.bed and sure and found.anomaly is None else None
    found = replace(found, remaining=tuple(remaining), may_explain=explained, bed=bed)
    return replace(found, notes=tuple(_notes(inputs, found)))


def _concluded(inputs: VerdictInputs, plain: Verdict) -> Verdict:
    """Kind, reasons and what is named: data first, then doubt, laws, fields, places, effects, and silence."""
    if inputs.implausible:
        return replace(plain, reasons=inputs.implausible)
    if off := _unexplained(inputs):
        return replace(plain, reasons=tuple(discharge_mismatches(off)))
    doubt, laws, accepted = _doubt(inputs), inputs.laws, bool(inputs.steps or inputs.places)
    lone = inputs.doubts.one_section
    if lone is not None and (accepted or laws is not None or inputs.field is not None):
        return replace(plain, laws=laws, reasons=(lone, doubt) if doubt else (lone,))
    if laws is not None:
        nothing_else = not (accepted or inputs.undecided or inputs.field)
        if nothing_else or (not doubt and laws.likelier and not accepted):
            return _with_laws(inputs, plain, laws, doubt)
    if inputs.field is not None:
        return replace(plain, kind="none-of-these", field=inputs.field)
    if accepted and doubt:
        return replace(plain, reasons=(doubt,))
    if inputs.places:
        return replace(plain, kind="none-of-these")
    if inputs.steps:
        first = inputs.steps[0]
        if len(first.groups) > constants().most_groups:
            effects = tuple(Rival(name, "effect", first.chance[name]) for name in first.rivals)
            return replace(plain, reasons=(verdict.TooManyGroups(effects),))
        single = all(len(step.rivals) == 1 and not step.others for step in inputs.steps)
        kind: VerdictKind = "identified" if single and laws is None else "one-of"
        if laws is not None and laws.clear:
            kind = "none-of-these"
        return replace(plain, kind=kind, laws=laws, instruments=inputs.instruments)
    if inputs.undecided:
        return replace(plain, undecided=inputs.undecided, reasons=(verdict.NoneLeads(),))
    return _silent(inputs, plain)


def _unexplained(inputs: VerdictInputs) -> list[CarriedDischarge]:
    """Sections that carry another discharge than stated, for no reason among what was accepted."""
    if any(place.term in TERMS_OF_DISCHARGES for place in inputs.places):
        return []
    names = {step.accepted for step in inputs.steps}
    believed = [
        EffectIdentity.parse(one.name)
        for one in inputs.candidates
        if one.name in names and one.amplitude.relative_size <= constants().far_off_prior
    ]

    def may_be_why(one: EffectIdentity, section: CarriedDischarge) -> bool:
        # Which sections a device measured is not known here.
        acts = not one.target or one.name in OF_DEVICES or bool({section.experiment, section.section} & set(one.target))
        return one.name in OF_DISCHARGES and acts

    return [section for section in inputs.doubts.carried if not any(may_be_why(one, section) for one in believed)]


def _doubt(inputs: VerdictInputs) -> Reason | None:
    """Why no name can be believed, None when it can."""
    parameter, far = inputs.doubts.strained
    ratio = inputs.misfit.value / max(inputs.misfit.freedom, 1)
    if ratio > constants().absurd_misfit:
        return verdict.MisfitBeyondErrors(math.sqrt(ratio))
    if inputs.errors.scale > constants().absurd_errors:
        return verdict.ErrorsLargerThanStated(inputs.errors.scale)
    if far > constants().far_off_prior:
        return verdict.ParameterFarFromPrior(parameter, far, inputs.doubts.strained_without)
    names = {step.accepted for step in inputs.steps}
    at_bound = []
    for one in (each for each in inputs.candidates if each.name in names):
        # An end other than that at which it is off, or as far off its prior as a calibration goes; nearer than refits
        # start.
        amplitude = one.amplitude
        ends = [end for end in amplitude.support if end != amplitude.off]
        near = any(abs(amplitude.value - end) < START_OFF_ENDS * amplitude.scale for end in ends)
        if near or amplitude.relative_size > FURTHEST - START_OFF_ENDS:
            at_bound.append(one.name)
    if at_bound:
        return verdict.AmplitudeAtBound(tuple(at_bound))
    sizes = [(one.amplitude.relative_size, one.name) for one in inputs.candidates if one.name in names]
    sizes += [(abs(one.amplitude) / one.plausible, f"{one.term} at a place") for one in inputs.places]
    size, name = max(sizes, default=(0.0, ""))
    if size > constants().far_off_prior:
        return verdict.AmplitudeBeyondPlausible(name, float(size))
    return inputs.doubts.hangs_on


def _with_laws(inputs: VerdictInputs, plain: Verdict, laws: CandidateLaws, doubt: Reason | None) -> Verdict:
    """Laws if no known effect explains the misfit, and if errors need not be absurdly large beside them; an instrument
    that is clearly off goes before laws that are not likelier than all else, except readings side by side.
    """
    found = replace(plain, laws=laws)
    used = inputs.model_error
    if inputs.errors.scale > math.sqrt(constants().absurd_misfit):
        doubt = doubt or verdict.ErrorsLargerThanStated(inputs.errors.scale)
    if used is not None and used.needed > constants().absurd_model_error:
        doubt = doubt or verdict.ModelErrorExceeded(used.needed, used.friction)
    if inputs.doubts.neighbours and not laws.likelier:
        doubt = doubt or verdict.NeighboursExcluded()
    if doubt:
        return replace(found, reasons=(doubt,))
    if laws.likelier:
        return replace(found, kind="none-of-these")
    if inputs.instruments and all(map(_is_clear, inputs.instruments)):
        return replace(found, kind="instrument", instruments=inputs.instruments)
    return found


def _silent(inputs: VerdictInputs, plain: Verdict) -> Verdict:
    """Nothing is missing, or an instrument is off, if silence is earned."""
    doubts, clear = inputs.doubts, tuple(filter(_is_clear, inputs.instruments))
    all_clear = bool(clear) and len(clear) == len(inputs.instruments) and not doubts.neighbours
    named = inputs.instruments if all_clear else ()
    if inputs.misfit.p < constants().poor_fit_chance:
        return replace(plain, reasons=(verdict.MisfitUnexplained(),))
    errors, used, unearned = inputs.errors, inputs.model_error, list[Reason]()
    if errors.clearly_larger:
        unearned.append(verdict.ErrorsLargerThanStated(errors.scale))
    if errors.correlation > constants().largest_correlation:
        unearned.append(verdict.CorrelatedErrors(errors.correlation))
    if doubts.neighbours:
        unearned.append(verdict.NeighboursExcluded())
    if used is not None and used.asks_for_more:
        unearned.append(verdict.ModelErrorExceeded(used.needed, used.friction))
    if doubts.held_out == math.inf:
        unearned.append(verdict.NoFlowHeldOut())
    elif doubts.held_out > max(constants().held_out_ratio, doubts.by_chance):
        unearned.append(verdict.HeldOutMissed(doubts.held_out))
    if unearned:
        return replace(plain, reasons=(unearned[0],), instruments=named)
    if doubts.between > constants().held_out_ratio:
        kind: VerdictKind = "instrument" if all_clear else "cannot-tell"
        return replace(plain, kind=kind, reasons=(verdict.UncertainBetweenSections(doubts.between),), instruments=named)
    if plain.tested.testable < constants().testable_share * max(len(inputs.candidates), 1):
        return replace(plain, reasons=(verdict.FewTestable(),))
    return replace(plain, kind="instrument" if clear else "nothing-missing", instruments=clear, clears_the_model=True)


def _is_clear(instrument: FaultyInstrument) -> bool:
    """Whether an instrument is off by instrument_errors of its standard errors."""
    low, high = instrument.interval95
    return bool(abs(instrument.offset) > constants().instrument_errors * (high - low) / (2.0 * NORMAL95))


def effect_found(step: Step, candidates: Iterable[CandidateEffect]) -> EffectFound:
    """An accepted effect with what it may be instead.

    Parameters
    ----------
    candidates : iterable of CandidateEffect
        The accepted one among them.

    Returns
    -------
    EffectFound
        Its probability is that of all effects of the same trace; the rivals are those of other traces, the likeliest
        first.
    """
    best = next(one for one in candidates if one.name == step.accepted)
    alike = next(group for group in step.groups if step.accepted in group)
    first = step.likelier_place
    rivals = [Rival(name, "effect", step.chance[name]) for name in step.rivals if name not in alike]
    for name, chance in step.others.items():
        place = step.places.get(name)
        if name != first:
            at = {} if place is None else {"x": place.x, "y": place.y, "amplitude": place.amplitude}
            rivals.append(Rival(name, name if place is None else place.term, chance, **at))
    return EffectFound(
        name=best.name,
        title=best.title,
        amplitude=best.amplitude.value,
        interval95=best.amplitude.interval95,
        unit=best.amplitude.unit,
        probability=sum(step.chance[name] for name in alike),
        alike=tuple(name for name in alike if name != step.accepted),
        rivals=tuple(sorted(rivals, key=lambda one: -one.probability)),
        likelier=step.places[first] if first else None,
        likelier_probability=step.others[first] if first else float("nan"),
    )


def _notes(inputs: VerdictInputs, found: Verdict) -> Iterable[Note]:
    """What else should be known, on discharges and on what is named first."""
    misfit, errors, accepted = inputs.misfit, inputs.errors, tuple(step.accepted for step in inputs.steps)
    yield from discharge_mismatches(inputs.doubts.carried)
    if is_too_small(misfit.value, misfit.freedom):
        yield verdict.MisfitTooSmall(misfit.value, misfit.freedom)
    by_name = {one.name: one for one in inputs.candidates}
    for name in accepted:
        if (times := by_name[name].amplitude.relative_size) > constants().implausible_size:
            yield verdict.ImplausibleAmplitude(name, times)
    hidden = tuple(name for group in inputs.not_excluded for name in group)
    if hidden and misfit.p >= constants().poor_fit_chance:
        yield verdict.EffectsNotExcluded(hidden, bool(inputs.steps or inputs.places))
    if inputs.excluded:
        yield verdict.EffectsExcluded(tuple(inputs.excluded.items()))
    if inputs.model_error is not None:
        yield inputs.model_error
    if inputs.laws is not None and found.laws is None:
        yield verdict.LawStandsOut(inputs.laws, accepted)
    if errors.correlation > 0:
        yield verdict.NeighboursCorrelated(errors.correlation)
    if errors.scale > 1 and not any(isinstance(one, verdict.ErrorsStillLarger) for one in found.remaining):
        yield verdict.StatedErrorsTooSmall(errors.scale)
    others = [one for one in inputs.instruments if one not in found.instruments]
    yield from (verdict.InstrumentExcluded(one, _is_clear(one), constants().instrument_errors) for one in others)
    elsewhere, alike = {*hidden, *accepted}, dict[str, list[CandidateEffect]]()
    blind = [one for one in inputs.candidates if not one.detectability.testable]
    unnamed = [one for one in blind if one.name not in {*elsewhere, *inputs.significant_effects}]
    for one in unnamed:  # by what they look like, the largest group first
        alike.setdefault(one.detectability.looks_like, []).append(one)
    groups = sorted(alike.items(), key=lambda group: (not group[0], -len(group[1])))
    if unnamed:
        yield verdict.EffectsUntestable(
            tuple((parameter, tuple(one.name for one in some)) for parameter, some in groups),
            effects_among(unnamed),
            len(unnamed),
            any(one.name in elsewhere for one in blind),
        )
    yield from inputs.surroundings
    yield from (one for one in inputs.bed if one is not found.bed)
    named = found.kind in ("identified", "one-of", "none-of-these", "instrument")
    if named and misfit.p < constants().poor_fit_chance and found.laws is None:
        yield verdict.MisfitRemains(misfit)
