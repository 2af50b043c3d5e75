"""The answer in words (HTML), for a reader with ten seconds: what is missing, how far the error falls, what to do."""

import html
import math
from collections.abc import Iterator

import numpy as np
import pandas as pd

from vegglue.effects.library import library
from vegglue.figures.typography import NARROW, count, decimals, fixed, interval, percent, short, unit_html
from vegglue.inference.weighted_statistics import TRUSTED_K_HAT
from vegglue.report_page.cause_words import (
    OF_KIND,
    accepted_causes,
    field_in_words,
    likelier_place_in_words,
    size_of,
    what_at,
    where,
)
from vegglue.report_page.findings import FAILED_TOLERATED
from vegglue.report_page.key_numbers import MASS_LIMIT, largest_mass_error, verdict_of
from vegglue.report_page.page_file import set_as_code
from vegglue.report_page.posterior_words import UNBELIEVED
from vegglue.report_page.run import Run
from vegglue.results.diagnosis import AmplitudeEstimate, Diagnosis, Step
from vegglue.results.ensemble import Ensemble
from vegglue.results.ladder import Ladder, LadderStep
from vegglue.results.open_questions import OpenQuestion
from vegglue.results.posterior import Posterior
from vegglue.screening.candidates import key_of
from vegglue.solver.status import FAILED, members_with

# Ways of judging a model, the most telling first: field of a step, and the measurements it is about.
JUDGED_ON = {
    "unseen": "measurements no calibration has seen",
    "held_out_sections": "sections left out in turn",
    "held_out_experiments": "experiments left out in turn",
    "in_sample": "measurements it was calibrated to",
}
NUMBERS = ("", "One", "Two", "Three", "Four", "Five", "Six")
# How a question names an effect that calibration hides.
HIDDEN_BEHIND = " from a change of "
# Measurements named beside the answer: more are a list that nobody acts on.
QUESTIONS_SHOWN = 3


def headline(run: Run) -> str:
    """The verdict in one sentence; of a model that was extended, what was missing before and what is now."""
    before, own = run.before, run.diagnosis
    if before is None and run.behind is None:
        return verdict_of(run.case, run.posterior)
    parts = [] if before is None else [_said(before, html.escape(before.name), "was")]
    if own is not None:
        suspected = bool(parts) and _only_suspects_a_law(own)
        parts.append(f"What is left looks like a law that is in no list: {_law_in_words(own)}." if suspected
                     else _said(own, "this model", "is"))  # fmt: skip
    elif before is None and run.behind is not None:
        parts.append(_said(run.behind, html.escape(run.behind.name), "was"))
    return " ".join(parts)


def _said(found: Diagnosis, model: str, tense: str) -> str:
    """The verdict on a model in one sentence; tense: is or was."""
    kind = found.verdict.kind
    if kind == "nothing-missing":
        return f"Nothing {tense} missing from {model} that these data could show."
    if kind == "instrument":
        which = " and ".join(f"{OF_KIND[one.kind]}, at {where(one.x, one.y)}" for one in found.instruments)
        told = "The model is sound, but an" if found.laws is None else "More may be missing, but an"
        return f"{told} instrument is off: {which}."
    if kind == "none-of-these" and found.field is not None:
        return f"Something is missing that is in no list: {field_in_words(found)}."
    if _only_suspects_a_law(found):
        return f"Something {tense} missing from {model} that is in no list: {_law_in_words(found)}."
    if kind in ("identified", "one-of", "none-of-these"):
        return _what_is_missing(found, model, tense)
    if kind == "cannot-tell" and found.laws is not None and not (found.steps or found.places):
        chance = percent(found.laws.laws[0].chance)
        return (
            f"Whether anything {tense} missing from {model}, these data cannot tell; the likeliest, with a chance of "
            f"{chance}, is a law that is in no list: {_law_in_words(found)}."
        )
    return set_as_code(html.escape(found.verdict.sentence))


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
    places = [f"{what_at(one)} of {size_of(one)} at {where(one.x, one.y)}" for one in found.places]
    parts = []
    if effects:
        subject = f"physical effect {tense}"
        if len(effects) > 1:
            subject = f"physical effects {'are' if tense == 'is' else 'were'}"
        parts.append(f"{NUMBERS[min(len(effects), 6)]} {subject} missing from {model}: {', and '.join(effects)}")
    if places:
        what = "something else" if parts else "Something"
        parts.append(f"{what} {tense} missing from {model} that is in no list: {' and '.join(places)}")
    return f"{'; and '.join(parts)}."


def _effect_in_words(found: Diagnosis, step: Step) -> str:
    name, likelier = step.accepted, step.likelier_place
    suspect = found.suspect(name)
    short_title, _, more = (html.escape(part.strip()) for part in suspect.title.partition(":"))
    chance = f"({percent(found.chances[name])}) " if likelier or len(step.rivals) > 1 else ""
    doubt = f"most likely {chance}" if chance and not likelier else chance
    explained = f", {more}" if more else ""
    size = f", {_amplitude_in_words(suspect.amplitude)}"
    return (
        f"{doubt}<b>{short_title[:1].lower()}{short_title[1:]}</b> (<code>{html.escape(name)}</code>{explained}{size})"
    )


def _amplitude_in_words(amplitude: AmplitudeEstimate) -> str:
    """'size −0.67, 95 % in −0.79 to −0.54' (HTML)."""
    unit = unit_html(amplitude.unit)
    low, high = amplitude.interval95
    places = decimals((high - low) / 4) if high > low else 3  # as the interval has them
    value = f"size {fixed(amplitude.value, places)}"
    return f"{value}{f'{NARROW}{unit}' if unit else ''}, 95{NARROW}% in {interval(low, high)}"


def of_which_model(run: Run) -> str:
    """Which model the page is about, where it is not the one that was diagnosed; '' else."""
    ladder = run.loop.ladder
    if ladder is None or (run.before is None and run.behind is run.diagnosis):
        return ""
    added = [name for step in ladder.steps for name in step.added if name in run.case.effects]
    return (
        f"This page is about the model made of {html.escape(ladder.steps[0].name)} by adding "
        f"{_listed([f'<code>{html.escape(name)}</code>' for name in added]) or 'what was missing'}."
    )


def _listed(words: list[str]) -> str:
    return f"{', '.join(words[:-1])} and {words[-1]}" if len(words) > 1 else "".join(words)


def why_not_to_rely(run: Run) -> str:
    """What forbids using the answer, in one sentence; '' where nothing does."""
    told = run.behind is None and not run.posterior.claimed  # by the headline
    verdict = [*_of_verdict(run.diagnosis or run.behind)]
    parameters = [*([] if told else _of_posterior(run.posterior)), *_of_ensemble(run.ensemble)]
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


def _of_posterior(posterior: Posterior) -> Iterator[str]:
    size = posterior.weighting.effective_size
    if not posterior.claimed:
        members = f"the weights are worth {max(size, 1.0):.0f} of {count(posterior.sample.members, 'member')}"
        yield f"{members}, too few to say how sure the parameters are"
    elif posterior.weighting.pareto_k > TRUSTED_K_HAT:
        yield "a few members carry most of the weight, so that the parameters are less sure than they look"


def _of_ensemble(ensemble: Ensemble | None) -> Iterator[str]:
    if ensemble is None:
        return
    failed = members_with(ensemble.status, FAILED)
    if failed > FAILED_TOLERATED * len(ensemble.status):
        yield f"{failed:,} of {count(len(ensemble.status), 'member')} failed"
    if not ensemble.by_command and largest_mass_error(ensemble) >= MASS_LIMIT:
        yield f"a member loses or gains {percent(largest_mass_error(ensemble))} of its discharge"


def ladder_in_words(ladder: Ladder, causes: str = "") -> str:
    """How far the error falls from the first model to the last, by the most telling way of judging.

    causes: what was added, in words (text), where that is known.
    """
    first, last = ladder.steps[0], ladder.steps[-1]
    judged = next((name for name in JUDGED_ON if math.isfinite(getattr(last, name))), None)
    if judged is None:
        return "No velocities along x were measured, by which models are set side by side."
    before, after = getattr(first, judged), getattr(last, judged)
    where = ", at what it was calibrated to," if judged == "unseen" else ""  # whose own errors are mostly not stated
    measuring = f"; errors of measuring alone{where} are {_speed(last.noise_floor)}"
    floor = measuring if math.isfinite(last.noise_floor) else ""
    if len(ladder.steps) == 1:
        why = f" {html.escape(ladder.reason)}" if ladder.reason else ""
        return f"The model misses {JUDGED_ON[judged]} by {_speed(after)}{floor}.{why}"
    falls = "falls" if after < before else "rises"
    with_it = _listed([f"<code>{html.escape(name)}</code>" for name in _all_added(ladder)])
    model = html.escape(causes) or with_it or html.escape(last.name)
    from_to = f"{falls} from {short(before, 2)} to {_speed(after)}"
    return f"With {model}, the error at {JUDGED_ON[judged]} {from_to}{floor}."


def _all_added(ladder: Ladder) -> list[str]:
    last = [name for step in ladder.steps[1:] for name in step.added]
    return list(dict.fromkeys(last))


def _speed(value: float) -> str:
    return f"{short(value, 2)}{NARROW}{unit_html('m/s')}"


def causes_of(run: Run) -> str:
    """What the diagnosis of the ladder's first model accepted, in words (text), where the ladder adds all of it and
    nothing else; '' else.
    """
    ladder = run.loop.ladder
    known = [one for one in (run.loop.behind, run.diagnosis) if one is not None]
    found = next((one for one in known if ladder and one.name == ladder.steps[0].name), None)
    if ladder is None or found is None:
        return ""
    effects = [key_of(step.accepted) for step in found.steps]
    places, added = sorted(one.effect for one in found.places), _all_added(ladder)
    others = sorted(name.partition("_x")[0] for name in added if name not in effects)
    return accepted_causes(found) if set(effects) <= set(added) and others == places else ""


def ladder_rows(ladder: Ladder) -> dict[str, list[float]]:
    """Errors of each model in turn [m/s], by what they are judged on, without what nothing is known of."""
    rows = {words: [float(getattr(step, name)) for step in ladder.steps] for name, words in JUDGED_ON.items()}
    return {words: values for words, values in rows.items() if any(map(math.isfinite, values))}


def where_it_fails(found: Diagnosis | None) -> str:
    """The zone that the first model misses most (text); '' where none is known."""
    zones = found.misfit.zones if found else pd.DataFrame()
    if found is None or zones.empty:
        return ""
    size = np.sqrt(np.nan_to_num(zones["chi2"] / zones["stations"]))
    worst = zones.iloc[int(np.argmax(size))]
    section = f"section {worst['section']}, " if str(worst["section"]) else ""
    model = "Before, the model" if accepted_causes(found) else "The model"
    return (
        f"{model} misses most at {section}{worst['zone']}, in experiment {worst['experiment']}: by "
        f"{fixed(float(size.max()), 1)} standard errors. Errors of measuring alone would make 1."
    )


def next_steps(run: Run) -> list[str]:
    """What to do next, the first thing first."""
    command = html.escape(run.case.source.name)
    if run.behind is None:
        return [f"<code>vegglue diagnose {command}</code> tells which physical effect this model lacks, if any."]
    return [*_better_model(run), *_measurements(run, command), *_of_instruments(run.behind)]


def _of_instruments(found: Diagnosis) -> Iterator[str]:
    for one in found.instruments:
        yield f"Look at the instrument again: {OF_KIND[one.kind]}, at {where(one.x, one.y)}. Its readings are left out."


def _better_model(run: Run) -> Iterator[str]:
    ladder, found = run.loop.ladder, run.behind
    assert found is not None
    if (run.diagnosis or found).laws is not None and (ladder is None or ladder.steps[-1].name == run.case.name):
        command = html.escape(run.case.source.name)
        yield f"<code>vegglue discover {command}</code> calibrates laws that are in no list, and writes the best."
    if ladder is None:
        if found.steps or found.places:
            command = html.escape(run.case.source.name)
            yield f"<code>vegglue extend {command} --auto</code> adds what is missing, and shows the error fall."
        return
    if len(ladder.steps) > 1 and ladder.steps[-1].name != run.case.name:
        yield f"Go on with the model that has it: {_page_of(run, ladder.steps[-1])}."
    elif len(ladder.steps) > 1 and ladder.steps[0].name in run.loop.pages:
        yield f"Compare with the model without it: {_page_of(run, ladder.steps[0])}."


def _page_of(run: Run, step: LadderStep) -> str:
    config = f"<code>{html.escape(step.config)}</code>"
    if step.name not in run.loop.pages:
        return config
    return f'{config} (<a href="{html.escape(run.loop.pages[step.name])}">its report</a>)'


def _measurements(run: Run, command: str) -> Iterator[str]:
    """What to measure, and what no single measurement would settle."""
    questions = run.loop.questions
    if questions is None:
        yield f"<code>vegglue next {command}</code> says what to measure next."
        return
    if not questions and run.loop.ladder is not None and run.loop.ladder.steps[-1].name != run.case.name:
        yield "What was found needs no further measurement. What that model leaves open stands in its report."
    elif not questions:
        yield "No further measurement is needed."
    settled = [one for one in questions if one.measurements and one.measurements[0].enough]
    measurements = {one.measurements[0].name: one.measurements[0] for one in reversed(settled)}
    for best in list(reversed(measurements.values()))[:QUESTIONS_SHOWN]:
        purposes = [_to_see(one) for one in settled if one.measurements[0].name == best.name]
        yield (
            f"Measure <b>{html.escape(best.name)}</b>, {' and '.join(purposes)}: {count(best.stations, 'station')}, "
            f"some {short(best.hours, 2)}{NARROW}hours of field work."
        )
    left = [_to_see(one) for one in questions if one not in settled]
    if left:
        yield f"No single measurement would do {'; nor '.join(left)}."


def _to_see(question: OpenQuestion) -> str:
    """What a question asks, as a purpose."""
    one, hidden, other = question.tells_apart.partition(HIDDEN_BEHIND)
    if hidden:
        return f"to test {_told(one)}, which a change of <code>{html.escape(other)}</code> hides"
    return f"to tell {html.escape(question.tells_apart)}"


def _told(name: str) -> str:
    """'“Steep banks touch more water than their width says” (steep_bank)': an effect of the library by its title."""
    known = library().get(name.partition("[")[0])
    code = f"<code>{html.escape(name)}</code>"
    return f"“{html.escape(known.title)}” ({code})" if known is not None else code
