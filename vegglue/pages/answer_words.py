"""The answer in words (HTML), for a reader with ten seconds: what is missing, how far the error falls, what to do."""

import html
from collections.abc import Iterator

from vegglue.inference.weighted_statistics import TRUSTED_K_HAT
from vegglue.measurements.kinds import KINDS
from vegglue.measurements.section_discharge import discharge_mismatches, mismatched_discharges
from vegglue.pages.cause_words import (
    accepted_causes,
    field_in_words,
    instrument_at,
    likelier_place_in_words,
    place_in_headline,
)
from vegglue.pages.diagnosis_words import standard_errors
from vegglue.pages.findings import failed_of_weighed, too_many_failed
from vegglue.pages.key_numbers import MASS_LIMIT, largest_mass_error, symbol, verdict_of
from vegglue.pages.page_file import set_as_code
from vegglue.pages.prior_words import ends_at_bounds
from vegglue.pages.run import Run
from vegglue.pages.typography import NARROW, decimals_between, fixed, html_notation, interval, percent, unit_html
from vegglue.pages.validation_words import UNBELIEVED
from vegglue.results.causes import AmplitudeEstimate, Step
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.posterior import Posterior
from vegglue.results.verdict import MisfitTooSmall, is_too_small
from vegglue.wording.numbers import listed, so_many, without_asides
from vegglue.wording.sentences import phrase

# Rivals that the headline names, the likeliest: more are in the table.
RIVALS_NAMED = 2
NUMBERS = ("", "One", "Two", "Three", "Four", "Five", "Six")


def headline(run: Run) -> str:
    """The verdict in short; of a model that was extended, what was missing before and what is now."""
    return " ".join(headline_lines(run))


def headline_lines(run: Run) -> list[str]:
    """The same, a sentence or two in each line: the verdict, what the model still asks for, and what limits both."""
    before, own = run.before, run.diagnosis
    if before is None and run.behind is None:
        return [verdict_of(run.case, run.posterior)]
    lines = [] if before is None else _said(before, html.escape(before.name), "was")
    if own is not None:
        suspected = bool(lines) and _only_suspects_a_law(own)
        lines += ([f"What is left looks like a law that is in no list: {_law_in_words(own)}."] if suspected
                  else _said(own, "this model", "is"))  # fmt: skip
    elif before is None and run.behind is not None:
        lines += _said(run.behind, html.escape(run.behind.name), "was")
    last = own or run.behind
    return lines if last is not None and last.verdict.doubts_the_data else [*lines, *_limits(run)]


def _limits(run: Run) -> list[str]:
    """That parameters end at bounds, and that the misfit is far too small."""
    posterior, refined = run.posterior, run.posterior.refinement
    notation = html_notation({name: symbol(run.case, name) for name in posterior.parameters})
    lines = [ends_at_bounds(posterior, notation)]
    if refined is not None and refined.error_model.errors == "stated":
        chi2, freedom = refined.misfit.chi2, refined.misfit.freedom
        if is_too_small(chi2, freedom):
            lines.append(phrase("misfit_too_small_in_short", MisfitTooSmall(chi2, freedom)))
    return [one for one in lines if one]


def _said(found: Diagnosis, model: str, tense: str) -> list[str]:
    """The verdict on a model in one sentence, and what the model still asks for; tense: is or was."""
    named = found.verdict.kind in ("identified", "one-of", "none-of-these") and not _only_suspects_a_law(found)
    left_over = html.escape(without_asides(found.verdict.left_over)) if named and found.field is None else ""
    return [one for one in (_verdict_in_short(found, model, tense), left_over) if one]


def _verdict_in_short(found: Diagnosis, model: str, tense: str) -> str:
    kind = found.verdict.kind
    if kind == "nothing-missing":
        return f"Nothing {tense} missing from {model} that these data could show."
    if kind == "instrument":
        which = " and ".join(map(instrument_at, found.instruments))
        told = "The model is sound, but an" if found.verdict.clears_the_model else "More may be missing, but an"
        return f"{told} instrument is off: {which}."
    if kind == "none-of-these" and found.field is not None:
        return f"Something is missing that is in no list: {field_in_words(found)}."
    if _only_suspects_a_law(found):
        return f"Something {tense} missing from {model} that is in no list: {_law_in_words(found)}."
    if kind in ("identified", "one-of", "none-of-these"):
        return _what_is_missing(found, model, tense)
    if kind == "cannot-tell" and found.laws is not None and found.verdict.tells_laws:
        best, chance = found.laws.laws[0], percent(sum(one.chance for one in found.laws.alike))
        law = html.escape(f"a law of {best.quantity} in {best.term}")
        return (
            f"Whether anything {tense} missing from {model}, these data cannot tell; the likeliest, with a chance of "
            f"{chance}, is {law}, which is in no list."
        )
    return set_as_code(html.escape(without_asides(found.verdict.sentence)))


def _only_suspects_a_law(found: Diagnosis) -> bool:
    nothing_else = found.field is None and not found.places
    return found.verdict.kind == "none-of-these" and found.laws is not None and nothing_else


def _law_in_words(found: Diagnosis) -> str:
    """The likeliest law by its title, within a sentence."""
    title = html.escape(found.laws.laws[0].title) if found.laws is not None else ""
    return f"{title[:1].lower()}{title[1:]}"


def _what_is_missing(found: Diagnosis, model: str, tense: str) -> str:
    """Effects by their titles, places by what they do; tense: is or was."""
    effects = [f"{likelier_place_in_words(step)}{_effect_in_words(found, step)}" for step in found.steps]
    places = [place_in_headline(one) for one in found.places]
    parts = []
    if effects:
        many = NUMBERS[min(len(effects), 6)]
        plural = f"{many} physical effects {'are' if tense == 'is' else 'were'}"
        subject = plural if len(effects) > 1 else f"{many} physical effect {tense}"
        if any(step.others for step in found.steps):  # which may be no effect at all
            subject = f"Something {tense}"
        parts.append(f"{subject} missing from {model}: {', and '.join(effects)}")
    if places:
        what = "something else" if parts else "Something"
        parts.append(f"{what} {tense} missing from {model} that is in no list: {' and '.join(places)}")
    return f"{'; and '.join(parts)}."


def _effect_in_words(found: Diagnosis, step: Step) -> str:
    """An accepted effect by its title, with its name and size, its likeliest rivals, and how likely it is none of the
    listed; 'most likely' where there are any, unless a place that is likelier is told before it.
    """
    name, likelier = step.accepted, step.likelier_place
    suspect = found.candidate_effect(name)
    short_title, _, more = (html.escape(part.strip()) for part in suspect.title.partition(":"))
    chance = f"({percent(found.chances[name])}) " if step.others or len(step.rivals) > 1 else ""
    doubt = f"most likely {chance}" if chance and not likelier else chance
    explained = f", {more}" if more else ""
    size = f", {_amplitude_in_words(suspect.amplitude)}"
    others = sorted((one for one in step.rivals if one != name), key=lambda one: -step.chance[one])[:RIVALS_NAMED]
    or_else = "".join(f", or <code>{html.escape(one)}</code> ({percent(step.chance[one])})" for one in others)
    left = sum(chance for one, chance in step.others.items() if one != likelier)
    or_else += f", or no listed effect ({percent(left)})" if left else ""
    return (
        f"{doubt}<b>{short_title[:1].lower()}{short_title[1:]}</b> (<code>{html.escape(name)}</code>{explained}{size})"
        f"{or_else}"
    )


def _amplitude_in_words(amplitude: AmplitudeEstimate) -> str:
    """'size −0.67, 95 % in −0.79 to −0.54' (HTML)."""
    unit = unit_html(amplitude.unit)
    low, high = amplitude.interval95
    value = f"size {fixed(amplitude.value, decimals_between(low, high))}"
    return f"{value}{f'{NARROW}{unit}' if unit else ''}, 95{NARROW}% in {interval(low, high)}"


def of_which_model(run: Run) -> str:
    """Which model the page is about, where it is not the one that was diagnosed; '' else."""
    ladder = run.loop.ladder
    if ladder is None or (run.before is None and run.behind is run.diagnosis):
        return ""
    added = [name for step in ladder.steps for name in step.added if name in run.case.effects]
    return (
        f"What follows is of the model made of {html.escape(ladder.steps[0].name)} by adding "
        f"{listed([f'<code>{html.escape(name)}</code>' for name in added]) or 'what was missing'}."
    )


def why_not_to_rely(run: Run) -> str:
    """What forbids using the answer, in one sentence; '' where nothing does."""
    told = run.behind is None and not run.posterior.claimed  # by the headline
    found = run.diagnosis or run.behind
    of_discharges = [*_of_discharges(run)]
    verdict = [*_of_verdict(found), *(of_discharges if found and found.verdict.doubts_the_data else [])]
    weights = [] if told else _of_posterior(run.posterior)
    parameters = [*([] if found else of_discharges), *weights, *_of_members(run)]
    if verdict and parameters:
        subject = "Neither the verdict nor the parameters below are"
    else:
        subject = "The verdict is not" if verdict else "The parameters below are not"
    reasons = [*verdict, *parameters]
    return f"{subject} to be relied on yet: {'; '.join(reasons)}." if reasons else ""


def _of_verdict(found: Diagnosis | None) -> Iterator[str]:
    if found is None or (found.laws and not (found.places or found.steps)):  # the misfit is that without the law
        return
    if found.misfit.p < UNBELIEVED and found.verdict.kind != "cannot-tell":
        yield "what is left of the misfit is still larger than the errors allow"


def _of_discharges(run: Run) -> Iterator[str]:
    if off := mismatched_discharges(run.case, run.site, run.observations.table):
        yield html.escape(phrase("mismatches_in_short", discharge_mismatches(off)))


def _of_posterior(posterior: Posterior) -> Iterator[str]:
    size = posterior.weighting.effective_size
    if not posterior.claimed:
        members = f"the weights are worth {max(size, 1.0):.0f} of {so_many(posterior.sample.members, 'member')}"
        yield f"{members}, too few to say how sure the parameters are"
    elif posterior.weighting.pareto_k > TRUSTED_K_HAT:
        yield "a few members carry most of the weight, so that the parameters are less sure than they look"


def _of_members(run: Run) -> Iterator[str]:
    if too_many_failed(run.ensemble, run.posterior):
        failed, members = failed_of_weighed(run.ensemble, run.posterior)
        yield f"{failed:,} of {so_many(members, 'member')} failed"
    ensemble = run.ensemble
    if ensemble is not None and not ensemble.by_command and largest_mass_error(ensemble) >= MASS_LIMIT:
        yield f"a member loses or gains {percent(largest_mass_error(ensemble))} of its discharge"


def where_it_fails(found: Diagnosis | None) -> str:
    """The zone that the first model misses most (text); '' where none is known."""
    if found is None or found.misfit.worst is None:
        return ""
    worst, size = found.misfit.worst
    named = str(worst["section"])
    section = f"{named if worst['zone'] in KINDS else f'section {named}'}, " if named else ""
    model = "Before, the model" if accepted_causes(found) else "The model"
    return (
        f"{model} misses most at {section}{worst['zone']}, in experiment {worst['experiment']}: by "
        f"{fixed(size, 1)} {standard_errors(found)}. Errors of measuring alone would make 1."
    )
