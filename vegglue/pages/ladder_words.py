"""How far the error falls, in words (HTML), and what was added for it."""

import html
import math

from vegglue.effects.identity import EffectIdentity
from vegglue.pages.cause_words import accepted_causes
from vegglue.pages.run import Run
from vegglue.pages.typography import NARROW, short, unit_html
from vegglue.results.model_comparison import ModelComparison
from vegglue.wording.numbers import listed

# Ways of judging a model, the most telling first: field of a step, and the measurements it is about.
JUDGED_ON = {
    "unseen": "measurements no calibration has seen",
    "held_out_sections": "sections left out in turn",
    "held_out_experiments": "experiments left out in turn",
    "in_sample": "measurements it was calibrated to",
}


def ladder_in_words(ladder: ModelComparison, causes: str = "") -> str:
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
    with_it = listed([f"<code>{html.escape(name)}</code>" for name in _all_added(ladder)])
    model = html.escape(causes) or with_it or html.escape(last.name)
    fall = f"With {model}, the error at {JUDGED_ON[judged]} {_from_to(before, after)}{floor}."
    return " ".join(filter(None, [fall, _unclear_in_words(ladder)]))


def _unclear_in_words(ladder: ModelComparison) -> str:
    """Of which part of what was added nobody can say that it helps, '' for none."""
    if not ladder.unclear:
        return ""
    names = listed([f"<code>{html.escape(name)}</code>" for name in ladder.unclear])
    whole = {EffectIdentity.parse(name).key for name in ladder.unclear} >= set(_all_added(ladder))
    what = "this fall" if whole else f"what {names} {'adds' if len(ladder.unclear) == 1 else 'add'} to it"
    return f"By the errors at what was held out, {what} cannot be told from chance."


def _from_to(before: float, after: float) -> str:
    """'falls from 0.041 to 0.013 m/s'; what is the same as it is written neither falls nor rises."""
    if not math.isfinite(before):
        return f"is {_speed(after)}"
    if short(before, 2) == short(after, 2):
        return f"stays at {_speed(after)}"
    return f"{'falls' if after < before else 'rises'} from {short(before, 2)} to {_speed(after)}"


def _all_added(ladder: ModelComparison) -> list[str]:
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
    effects = {EffectIdentity.parse(step.accepted).key for step in found.steps}
    places = {EffectIdentity.at_place(one.effect, one.x, one.y).key for one in found.places}
    return accepted_causes(found) if effects | places == set(_all_added(ladder)) else ""


def ladder_rows(ladder: ModelComparison) -> dict[str, list[float]]:
    """Errors of each model in turn [m/s], by what they are judged on, without what nothing is known of."""
    rows = {words: [float(getattr(step, name)) for step in ladder.steps] for name, words in JUDGED_ON.items()}
    return {words: values for words, values in rows.items() if any(map(math.isfinite, values))}
