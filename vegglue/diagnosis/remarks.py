"""What else should be known beside the sentence of a verdict."""

from collections.abc import Sequence

from vegglue.calibration.fingerprints import LEAST_DEPTH
from vegglue.decision_constants import constants
from vegglue.diagnosis.causes_in_words import TO_DISCOVER, instruments_in_words, law_in_words, model_error_in_words
from vegglue.diagnosis.verdict_inputs import Statement, VerdictInputs, is_clear
from vegglue.measurements.section_discharge import discharge_mismatches
from vegglue.results.candidate_effect import counted_in_words
from vegglue.results.causes import FaultyInstrument
from vegglue.results.diagnosis import CandidateEffect, Step
from vegglue.results.small_misfit import small_misfit_in_words
from vegglue.wording.sentences import sentence

# Amplitude over a plausible one, above which it is said to be too large to be believed.
IMPLAUSIBLE = 3.0
# Names that a remark holds at most.
NAMES_SHOWN = 8
# Names that it holds of each group, where they are more.
NAMES_OF_GROUP = 3
TOO_SHALLOW = (
    "Nothing was looked for at a place, and no law was tried: nowhere is the water deeper than "
    f"{100 * LEAST_DEPTH:g} cm."
)


def remarks_of(inputs: VerdictInputs, candidate_effects: Sequence[CandidateEffect], statement: Statement) -> list[str]:
    """All of them, those on what is carried and on what is named first; statement: beside which they stand."""
    found, misfit = inputs.state, inputs.misfit
    remarks = [*map(sentence, discharge_mismatches(inputs.carried))]
    remarks += filter(None, [small_misfit_in_words(misfit.chi2, misfit.freedom)])
    remarks += _implausible(found.steps, candidate_effects)
    remarks += _open(inputs.not_excluded, bool(found.accepted)) if misfit.p >= constants().poor_fit_chance else []
    remarks += _besides(inputs, candidate_effects, statement)
    remarks += [one for one in (inputs.on_map, inputs.stretch) if one]
    remarks += [] if inputs.places_searched else [TOO_SHALLOW]
    if (
        statement.kind in ("identified", "one-of", "none-of-these", "instrument")
        and misfit.p < constants().poor_fit_chance
        and not statement.tells_laws
    ):
        remarks.append(
            f"The misfit that is left is still larger than the errors allow ({misfit.told}, p = {misfit.p:.1g})."
        )
    return remarks


def _besides(inputs: VerdictInputs, candidate_effects: Sequence[CandidateEffect], statement: Statement) -> list[str]:
    """What else was taken into account, set aside, or cannot be tested, as far as the statement does not say it."""
    errors, effects, remarks = inputs.errors, inputs.state.effects, []
    if inputs.model_error is not None:
        remarks.append(model_error_in_words(inputs.model_error))
    if inputs.laws is not None and not statement.tells_laws:
        rather = f", rather than {' and '.join(effects)}" if effects else ""
        remarks.append(f"To first order {law_in_words(inputs.laws)}{rather}. {TO_DISCOVER}")
    if errors.correlation > 0:
        remarks.append(f"Errors of neighbours are correlated by {errors.correlation:.2f}; this is allowed for.")
    if errors.scale > 1 and not statement.tells_errors:
        remarks.append(f"The stated errors look too small by a factor of {errors.scale:.2f}; this is allowed for.")
    remarks += [_told_of(one) for one in inputs.state.instruments if one not in statement.instruments]
    told = {name for group in inputs.not_excluded for name in group} | {*effects}
    seen = {*told, *inputs.significant_effects}
    hidden = [one for one in candidate_effects if not one.detectability.testable and one.name not in seen]
    if hidden:
        also = ", too" if any(not one.detectability.testable and one.name in told for one in candidate_effects) else ""
        remarks.append(f"Untestable with these data{also}, neither present nor absent: {_untestable(hidden)}.")
    return remarks


def _told_of(instrument: FaultyInstrument) -> str:
    """What a remark says of an instrument that was set aside."""
    words = instruments_in_words((instrument,))
    least = constants().instrument_errors
    faint = f" It is off by less than {least} standard errors, which chance or the model may make."
    return words if is_clear(instrument) else f"{words}{faint}"


def _open(groups: Sequence[Sequence[str]], something_named: bool) -> list[str]:
    names = [name for group in groups for name in group]
    more = f" and {len(names) - NAMES_SHOWN} more" if len(names) > NAMES_SHOWN else ""
    one = "one more effect hide beside it" if something_named else "exactly one effect hide here"
    said = (
        f"Should {one}, of two to four standard errors, it is most likely one of these, "
        f"the likeliest first: {', '.join(names[:NAMES_SHOWN])}{more}; what is smaller may be any."
    )
    return [said] if names else []


def _implausible(steps: Sequence[Step], candidate_effects: Sequence[CandidateEffect]) -> list[str]:
    by_name = {candidate_effect.name: candidate_effect for candidate_effect in candidate_effects}
    far = [one for step in steps if (one := by_name[step.accepted]).amplitude.relative_size > IMPLAUSIBLE]
    return [
        f"{one.name} is {one.amplitude.relative_size:.1f} times what is plausible for it: it may stand in for "
        "something that is not in the library."
        for one in far
    ]


def _untestable(hidden: Sequence[CandidateEffect]) -> str:
    """The effects by what they look like; of many their number, and a few names of the largest groups."""
    alike: dict[str, list[str]] = {}
    for one in hidden:
        alike.setdefault(one.detectability.looks_like, []).append(one.name)
    groups = sorted(alike.items(), key=lambda group: (not group[0], -len(group[1])))
    if len(hidden) <= NAMES_SHOWN:
        return "; ".join(_group(names, parameter, len(hidden)) for parameter, names in groups)
    shown = "; ".join(_group(names, parameter, NAMES_OF_GROUP) for parameter, names in groups)
    return (
        f"{counted_in_words(hidden)}: {shown}. The table of effects on the page of the run (`vegglue report`) lists all"
    )


def _group(names: Sequence[str], parameter: str, most: int) -> str:
    """`wind, steep_bank and 12 more (look like a change of n_b)`."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    verb = "look" if len(names) > 1 else "looks"
    why = f" ({verb} like a change of {parameter})" if parameter else ""
    return f"{', '.join(names[:most])}{more}{why}"
