"""What to do next, in words (HTML): the command, the page, the measurement that leads on."""

import html
from collections.abc import Iterator

from vegglue.effects.identity import EffectIdentity
from vegglue.effects.library import library
from vegglue.pages.cause_words import instrument_at
from vegglue.pages.run import Run, command_about
from vegglue.pages.typography import NARROW, short
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.model_comparison import ComparedModel
from vegglue.results.open_questions import HiddenEffect, Question
from vegglue.wording.numbers import so_many

# Measurements named beside the answer: more are a list that nobody acts on.
QUESTIONS_SHOWN = 3


def next_steps(run: Run) -> list[str]:
    """What to do next, the first thing first."""
    if run.behind is None:
        return [f"{command_about(run, 'diagnose')} tells which physical effect this model lacks, if any."]
    return [*_better_model(run), *_measurements(run), *_of_instruments(run.behind)]


def _of_instruments(found: Diagnosis) -> Iterator[str]:
    for one in found.instruments:
        yield f"Look at the instrument again: {instrument_at(one)}. Its readings are left out."


def _better_model(run: Run) -> Iterator[str]:
    """The command that adds what is missing; where the loop has done so, the page of the model that has it."""
    ladder, found = run.loop.ladder, run.behind
    assert found is not None
    if found.verdict.doubts_the_data:
        return
    if (run.diagnosis or found).law_stands_out and (ladder is None or ladder.steps[-1].name == run.case.name):
        yield f"{command_about(run, 'discover')} calibrates laws that are in no list, and writes the best."
    if ladder is None:
        if found.steps or found.places:
            yield f"{command_about(run, 'extend', '--auto')} adds what is missing, and shows the error fall."
        return
    if run.diagnosis is not None and ladder.steps[-1].name == run.case.name and _asks_for_more(run.diagnosis):
        yield f"{command_about(run, 'extend', '--auto')} adds what this model still lacks, and shows the error fall."
    if len(ladder.steps) > 1 and ladder.steps[-1].name != run.case.name:
        yield f"Go on with the model that has it: {_page_of(run, ladder.steps[-1])}."
    elif len(ladder.steps) > 1 and ladder.steps[0].name in run.loop.pages:
        yield f"Compare with the model without it: {_page_of(run, ladder.steps[0])}."


def _asks_for_more(found: Diagnosis) -> bool:
    return bool(found.steps or found.places)


def _page_of(run: Run, step: ComparedModel) -> str:
    config = f"<code>{html.escape(step.config)}</code>"
    if step.name not in run.loop.pages:
        return config
    return f'{config} (<a href="{html.escape(run.loop.pages[step.name])}">its report</a>)'


def _measurements(run: Run) -> Iterator[str]:
    """What to measure, and what no single measurement would settle."""
    questions = run.loop.questions
    if run.behind is not None and run.behind.verdict.doubts_the_data:
        yield f"Mend the measurements first. {command_about(run, 'check')} says all that is odd of them."
        return
    if questions is None:
        yield f"{command_about(run, 'next')} says what to measure next."
        return
    if all(one.answered for one in questions):
        yield _nothing_to_measure(run)
    settled = [one for one in questions if one.useful]
    measurements = {one.useful[0].name: one.useful[0] for one in reversed(settled)}
    for best in list(reversed(measurements.values()))[:QUESTIONS_SHOWN]:
        purposes = [_to_see(one) for one in settled if one.useful[0].name == best.name]
        yield (
            f"Measure <b>{html.escape(best.name)}</b>, {', and '.join(purposes)}: {so_many(best.stations, 'station')}, "
            f"some {short(best.hours, 2)}{NARROW}hours of field work."
        )
    left = [_to_see(one) for one in questions if one not in settled and not one.answered]
    if left:
        yield f"No single measurement would do {'; nor '.join(left)}."


def _nothing_to_measure(run: Run) -> str:
    """That nothing is asked of this model; of one that was extended no more, as what the last one lacks or leaves open
    is not known here.
    """
    ladder = run.loop.ladder
    if ladder is not None and ladder.steps[-1].name != run.case.name:
        last = html.escape(ladder.steps[-1].name)
        return (
            f"Of this model nothing more is to be measured. What {last} still lacks, and what that model leaves open "
            "stands in its report."
        )
    if run.loop.questions == () and run.behind is not None and run.behind.verdict.kind != "nothing-missing":
        return "No measurement is proposed: no two listed effects are left to be told apart."
    return "No further measurement is needed."


def _to_see(question: Question) -> str:
    """What a question asks, as a purpose."""
    about = question.about
    if isinstance(about, HiddenEffect):
        return f"to test {_told(about.name)}, which a change of <code>{html.escape(about.parameter)}</code> hides"
    return f"to tell {html.escape(question.tells_apart)}"


def _told(name: str) -> str:
    """'“Steep banks touch more water than their width says” (steep_bank)': an effect of the library by its title."""
    known = library().get(EffectIdentity.parse(name).name)
    code = f"<code>{html.escape(name)}</code>"
    return f"“{html.escape(known.title)}” ({code})" if known is not None else code
