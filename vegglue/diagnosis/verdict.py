"""What was found: one verdict in one sentence.

Silence has to be earned, and so has a name: see DECISIONS.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vegglue.calibration.candidates import START_OFF_ENDS
from vegglue.case.parameter_space import FURTHEST
from vegglue.decision_constants import constants
from vegglue.diagnosis.causes_in_words import (
    TO_DISCOVER,
    causes_in_words,
    field_sentence,
    instruments_in_words,
    law_in_words,
    left_over_in_words,
    undecided_in_words,
    with_their_chances,
)
from vegglue.diagnosis.remarks import remarks_of
from vegglue.diagnosis.search_state import SearchState
from vegglue.diagnosis.unlisted_laws import is_likelier, law_goes_first
from vegglue.diagnosis.verdict_inputs import Statement, VerdictInputs, is_clear
from vegglue.effects.identity import EffectIdentity
from vegglue.measurements.section_discharge import CHANGE_DISCHARGE, CarriedDischarge, discharge_mismatches
from vegglue.results.candidate_effect import counted_in_words
from vegglue.results.causes import CandidateLaws
from vegglue.results.diagnosis import BEFORE_ALL_ELSE, CandidateEffect, Misfit, Verdict, VerdictKind
from vegglue.wording.sentences import phrase

# Effects of the library, and terms at a place, that let sections read another discharge than stated: water that comes
# or goes, readings that are off as a whole, a bed or a level that is not there. Larger than this over what is plausible
# they only make up for it. Chosen, as for a parameter.
OF_DISCHARGES = (
    *CHANGE_DISCHARGE, "outlet_level_error", "gauge_datum", "device_gain", "probe_gain", "zero_offset",
    "partial_depth", "floor_level_error", "bank_level_error", "bed_slope_error", "flank_scour",
)  # fmt: skip
TERMS_OF_DISCHARGES, OF_DEVICES = ("inflow", "bed"), ("device_gain", "zero_offset")
# Distance from an end of its support, over a plausible size, within which an amplitude lies at a bound: as far as
# refits start from it at least, see `start_amplitude`.
AT_BOUND = START_OFF_ENDS
NEIGHBOURS_ASIDE = "readings side by side had to be set aside, which one bad probe does not explain"


def make_verdict(inputs: VerdictInputs, candidate_effects: Sequence[CandidateEffect]) -> Verdict:
    """The verdict, its sentence, and what else should be known."""
    statement, places = _stated(inputs, candidate_effects), inputs.state.places
    left_over = _left_over(inputs, statement)
    statement = replace(statement, tells_errors=bool(left_over) and inputs.errors.clearly_larger)
    return Verdict(
        kind=statement.kind,
        sentence=" ".join(one for one in (statement.sentence, left_over, _explained(inputs, statement)) if one),
        remarks=tuple(remarks_of(inputs, candidate_effects, statement)),
        anomaly=places[0] if places else None,
        not_excluded=inputs.not_excluded,
        clears_the_model=statement.clears_the_model,
        tells_laws=statement.tells_laws,
        left_over=left_over,
        significant_effects=dict(inputs.significant_effects),
    )


def _explained(inputs: VerdictInputs, statement: Statement) -> str:
    """That what was named may be why sections carry another discharge than stated; '' where none does."""
    untold = inputs.carried and not statement.sentence.startswith(BEFORE_ALL_ELSE)
    return f"What was found may be why {_in_short(inputs.carried)}." if untold else ""


def _in_short(off: Sequence[CarriedDischarge]) -> str:
    return phrase("mismatches_in_short", discharge_mismatches(off))


def _unexplained(inputs: VerdictInputs, candidate_effects: Sequence[CandidateEffect]) -> list[CarriedDischarge]:
    """Sections that carry another discharge than stated, for no reason among what was accepted."""
    found = inputs.state
    if any(place.term in TERMS_OF_DISCHARGES for place in found.places):
        return []
    accepted = [one for one in candidate_effects if one.name in found.effects]
    believed = [one.name for one in accepted if one.amplitude.relative_size <= constants().far_off_prior]
    return [one for one in inputs.carried if not any(_may_be_why(name, one) for name in believed)]


def _may_be_why(name: str, section: CarriedDischarge) -> bool:
    """Whether a candidate changes what a section carries: everywhere, in its experiment, or there; of a device nobody
    says here which sections it measured.
    """
    one = EffectIdentity.parse(name)
    acts = not one.target or one.name in OF_DEVICES or bool({section.experiment, section.section} & set(one.target))
    return one.name in OF_DISCHARGES and acts


def _left_over(inputs: VerdictInputs, statement: Statement) -> str:
    """What the model asks for with what was accepted, where that is what the statement names."""
    found = inputs.state
    unnamed = found.absurd or statement.kind == "cannot-tell" or statement.tells_laws
    if not found.accepted or unnamed or inputs.field is not None:
        return ""
    return left_over_in_words(inputs.errors, inputs.significant_effects, inputs.remainder)


def _stated(inputs: VerdictInputs, candidate_effects: Sequence[CandidateEffect]) -> Statement:
    found, misfit = inputs.state, inputs.misfit
    if found.absurd:
        return Statement("cannot-tell", BEFORE_ALL_ELSE + found.absurd[0])
    named = causes_in_words(found, candidate_effects)
    if off := _unexplained(inputs, candidate_effects):
        check = phrase("check_discharge")
        made_up = f" What may make up for it: {named}." if named else ""
        return Statement("cannot-tell", f"{BEFORE_ALL_ELSE}{_in_short(off)}: {check}.{made_up}")
    doubt = _doubt(inputs, candidate_effects)
    nothing = not (found.places or found.steps or found.undecided or inputs.field)
    if inputs.laws is not None and (nothing or (not doubt and law_goes_first(inputs.laws, found))):
        return _with_a_law(inputs.laws, inputs, doubt)
    if inputs.field is not None:
        words = field_sentence(inputs.field) + (f", rather than {named}" if named else "")
        return Statement("none-of-these", f"None of the known effects: {words} ({misfit.told} without it).")
    if (found.places or found.steps) and doubt:
        return Statement("cannot-tell", f"These data cannot tell: {doubt}. What explains most of the misfit: {named}.")
    if found.places:
        return Statement("none-of-these", f"None of the known effects: {named}; {misfit.told} with it.")
    if found.steps:
        return _with_effects(found, named, misfit)
    if found.undecided:
        names = undecided_in_words(found.undecided)
        unsure = f"it may be {names}, but none of them surely ({misfit.told})"
        return Statement("cannot-tell", f"These data cannot tell: {unsure}.")
    return _without_causes(inputs, candidate_effects)


def _with_effects(found: SearchState, named: str, misfit: Misfit) -> Statement:
    """Listed effects, or too many to name; named: all of them in words."""
    first = found.steps[0]
    if len(first.groups) > constants().most_groups:
        names = ", ".join(with_their_chances(first, first.rivals))
        which = f"which of {names} it is (chances among those calibrated)"
        return Statement("cannot-tell", f"Something is missing, but these data cannot tell {which}.")
    single = all(len(step.rivals) == 1 and not step.others for step in found.steps)
    also = f" {instruments_in_words(found.instruments)}" if found.instruments else ""
    which = found.steps[-1].accepted if any(step.likelier_place for step in found.steps) else "it"
    sentence = f"Missing: {named}; {misfit.told} with {which}.{also}"
    return Statement("identified" if single else "one-of", sentence, instruments=found.instruments)


def _with_a_law(laws: CandidateLaws, inputs: VerdictInputs, doubt: str) -> Statement:
    """A law where no known effect explains the misfit; an instrument that is clearly off goes before one that is not
    likelier than all else, but for readings side by side.
    """
    law = f"{law_in_words(laws)} ({inputs.misfit.told} without it)"
    if inputs.neighbours and not is_likelier(laws):
        doubt = doubt or NEIGHBOURS_ASIDE
    if doubt:
        told = f"These data cannot tell: {doubt}. To first order {law}. {TO_DISCOVER}"
        return Statement("cannot-tell", told, tells_laws=True)
    if is_likelier(laws):
        return Statement("none-of-these", f"None of the known effects: {law}. {TO_DISCOVER}", tells_laws=True)
    off = inputs.state.instruments
    if off and all(is_clear(one) for one in off):
        unsure = f"These data cannot tell whether anything else is missing: {law}. {TO_DISCOVER}"
        return Statement("instrument", f"{instruments_in_words(off)} {unsure}", tells_laws=True, instruments=off)
    told = f"These data cannot tell whether anything is missing: {law}. {TO_DISCOVER}"
    return Statement("cannot-tell", told, tells_laws=True)


def _doubt(inputs: VerdictInputs, candidate_effects: Sequence[CandidateEffect]) -> str:
    """Why no name can be believed, '' when it can."""
    misfit, (parameter, far) = inputs.misfit, inputs.strained
    ratio = misfit.chi2 / max(misfit.freedom, 1)
    if ratio > constants().absurd_misfit:
        return (
            f"with all that was found the model still misses by {np.sqrt(ratio):.1f} times the errors that are allowed "
            f"for ({misfit.told}); check units, datum, bed and boundaries first"
        )
    if far > constants().far_off_prior:
        return f"{parameter} would have to lie {far:.1f} standard deviations from the middle of its prior"
    at_bound = [one.name for one in candidate_effects if one.name in inputs.state.effects and _is_at_bound(one)]
    if at_bound:
        return f"{' and '.join(at_bound)} would have to be as large as can be, and stands in for something else"
    return ""


def _is_at_bound(candidate_effect: CandidateEffect) -> bool:
    """Whether an amplitude lies at an end of its support, other than the end at which it is off, or as far off its
    prior as a calibration goes.
    """
    amplitude = candidate_effect.amplitude
    margin = AT_BOUND * amplitude.scale
    ends = [end for end in amplitude.support if end != amplitude.off]
    return amplitude.relative_size > FURTHEST - AT_BOUND or any(abs(amplitude.value - end) < margin for end in ends)


def _without_causes(inputs: VerdictInputs, candidate_effects: Sequence[CandidateEffect]) -> Statement:
    misfit = inputs.misfit
    testable = [candidate_effect for candidate_effect in candidate_effects if candidate_effect.detectability.testable]
    if misfit.p < constants().poor_fit_chance:
        larger = f"The misfit is larger than the errors allow ({misfit.told})"
        return Statement("cannot-tell", f"{larger}, but no known effect and no place stands out.")
    unearned = _unearned(inputs)
    if unearned:
        return _nothing_further(inputs, unearned, "cannot-tell")
    if inputs.between > constants().held_out_ratio:
        return _unsure_between(inputs)
    if len(testable) < constants().testable_share * max(len(candidate_effects), 1):
        seen = f"only {len(testable)} of {counted_in_words(candidate_effects)} would be seen in these data"
        unsure = f"{seen} if they were there at twice a plausible size"
        return Statement("cannot-tell", f"Nothing stands out ({misfit.told}), but {unsure}.")
    nothing = (
        f"{misfit.told}, and none of {counted_in_words(candidate_effects)} stands out ({len(testable)} of them would "
        "be seen at twice a plausible size)."
    )
    clear = tuple(one for one in inputs.state.instruments if is_clear(one))
    if clear:
        told = f"{instruments_in_words(clear)} Nothing else is missing: {nothing}"
        return Statement("instrument", told, clears_the_model=True, instruments=clear)
    told = f"Nothing is missing that these data could show: {nothing}"
    return Statement("nothing-missing", told, clears_the_model=True)


def _unsure_between(inputs: VerdictInputs) -> Statement:
    """Silence, or an instrument, where the model may miss by more than held_out_ratio between the sections."""
    unsure = (
        "where nobody measured, halfway between the sections, the model may miss by as much as "
        f"{inputs.between:.1f} times the errors of the data (by its own errors, those of its site and its parameters, "
        "as far as these data know them): a missing effect may hide in that"
    )
    return _nothing_further(inputs, unsure, "instrument" if _all_clear(inputs) else "cannot-tell")


def _nothing_further(inputs: VerdictInputs, doubt: str, kind: VerdictKind) -> Statement:
    """Instruments that are clearly off, or nothing, and why it cannot be said that nothing else is missing."""
    if not _all_clear(inputs):
        return Statement(kind, f"Nothing stands out ({inputs.misfit.told}), but {doubt}.")
    off = inputs.state.instruments
    told = f"{instruments_in_words(off)} Nothing else stands out ({inputs.misfit.told}), but {doubt}."
    return Statement(kind, told, instruments=off)


def _all_clear(inputs: VerdictInputs) -> bool:
    """Whether there are instruments that are off, and all of them clearly; readings side by side are none."""
    instruments = inputs.state.instruments
    return bool(instruments) and not inputs.neighbours and all(is_clear(one) for one in instruments)


def _unearned(inputs: VerdictInputs) -> str:
    """Why it cannot be said that nothing is missing, '' when it can."""
    errors, used = inputs.errors, inputs.model_error
    if errors.clearly_larger:
        return f"only with errors {errors.scale:.1f} times as large as stated: they, or the model, are wrong"
    if errors.correlation > constants().largest_correlation:
        return (
            f"only with errors of neighbours correlated by {errors.correlation:.2f}: the model misses in the same way "
            "over whole sections"
        )
    if inputs.neighbours:
        return NEIGHBOURS_ASIDE
    if used is not None and used.asks_for_more:
        of_friction = f": {used.needed * used.friction:.0%} in friction where {used.friction:.0%} is allowed"
        return (
            f"the model needs {used.needed:.1f} times the errors of its own, and of its site, that are allowed"
            f"{of_friction if used.friction else ''}"
        )
    if inputs.unseen == np.inf:
        return "the model finds no steady flow in experiments that were not calibrated to"
    if inputs.unseen > max(constants().held_out_ratio, inputs.by_chance):
        return f"measurements that were not calibrated to are missed by {inputs.unseen:.1f} times what is expected"
    return ""
