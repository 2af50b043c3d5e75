"""How well a diagnosis guessed what a twin hides."""

from dataclasses import dataclass

import numpy as np

from vegglue.effects.grammar import LAWS
from vegglue.effects.law import Law
from vegglue.results.diagnosis import Diagnosis
from vegglue.wording.numbers import listed, so_many
from vegglue.workflow.sealed_answer import BAD_PROBE, Answer, Hidden


@dataclass(frozen=True)
class Mark:
    """One hidden thing against a diagnosis. named: the verdict is this effect alone; inside: it is in the set; open:
    nothing stands out, and it is among what is not excluded.

    amplitude: whether the 95 % interval holds the true one, None when it is not in the set; away: distance [m] of the
    place that is pointed at from the true one, NaN without either; found: what counts as success for its kind.
    """

    hidden: Hidden
    named: bool
    inside: bool
    open: bool
    amplitude: bool | None
    away: float
    found: bool


def marks(answer: Answer, diagnosis: Diagnosis) -> list[Mark]:
    """One for each thing that is hidden."""
    return [_mark(hidden, diagnosis) for hidden in answer.hidden]


def _mark(hidden: Hidden, diagnosis: Diagnosis) -> Mark:
    if hidden.name == BAD_PROBE:
        there = hidden.station in diagnosis.errors.flagged
        return Mark(hidden, False, there, False, None, float("nan"), there)
    if not hidden.listed:
        away = _away(hidden, diagnosis)
        found = diagnosis.verdict.kind == "none-of-these"
        return Mark(hidden, False, False, False, None, away, found)
    if hidden.name in LAWS:
        told = _tells_of(LAWS[hidden.name], diagnosis)
        return Mark(hidden, False, told, False, None, float("nan"), told)
    inside = hidden.name in diagnosis.set
    named = diagnosis.verdict.kind == "identified" and [step.accepted for step in diagnosis.steps] == [hidden.name]
    still = hidden.name in [name for group in diagnosis.verdict.not_excluded for name in group]
    amplitude = None
    if inside:
        low, high = diagnosis.candidate_effect(hidden.name).amplitude.interval95
        amplitude = bool(low <= hidden.amplitude <= high)
    return Mark(hidden, named, inside, still, amplitude, float("nan"), inside)


def _tells_of(law: Law, diagnosis: Diagnosis) -> bool:
    """Whether a law of the same quantity in the same term is among those that a diagnosis tells."""
    laws = () if diagnosis.laws is None else diagnosis.laws.laws
    return any((one.term, one.quantity) == (law.term.words, law.quantity.words) for one in laws)


def _away(hidden: Hidden, diagnosis: Diagnosis) -> float:
    """Distance of the nearest place that is pointed at [m], NaN where there is none."""
    x, y = hidden.shapes["x"], hidden.shapes["y"]
    return float(min((np.hypot(one.x - x, one.y - y) for one in diagnosis.places), default=np.nan))


def groups_of(diagnosis: Diagnosis) -> list[int]:
    """Groups that the data cannot tell apart, counted for each step."""
    return [len(step.groups) for step in diagnosis.steps]


def _groups_in_words(diagnosis: Diagnosis) -> str:
    """`3 groups`, and with more than one step of how many each."""
    counts = [so_many(number, "group") for number in groups_of(diagnosis)]
    return counts[0] if len(counts) == 1 else f"{listed(counts)}, step by step"


def guess_in_words(answer: Answer, diagnosis: Diagnosis | None) -> list[str]:
    """The truth, and what the diagnosis made of it, one line each."""
    errors = "errors as stated" if answer.scale == 1.0 else f"errors {answer.scale:g} times those stated"
    if answer.correlation:
        errors += f", neighbours correlated by {answer.correlation:g}"
    parameters = ", ".join(f"{name} = {value:.4g}" for name, value in answer.parameters.items())
    lines = [f"True parameters: {parameters}; {errors}."]
    if not answer.hidden:
        lines.append("Nothing was hidden.")
        if diagnosis is not None:
            right = {"nothing-missing": "right", "cannot-tell": "too shy"}.get(diagnosis.verdict.kind, "a false alarm")
            lines.append(f"The diagnosis said {diagnosis.verdict.kind}: {right}.")
        return lines
    if diagnosis is None:
        return lines + [f"Hidden: {_truth(one)}." for one in answer.hidden]
    return lines + [_told(mark, diagnosis) for mark in marks(answer, diagnosis)]


def _truth(hidden: Hidden) -> str:
    if hidden.name == BAD_PROBE:
        return f"a bad probe at station {hidden.station}, {hidden.amplitude:+.3g} standard errors off"
    shapes = "".join(f", {name} = {value:.3g}" for name, value in hidden.shapes.items())
    return f"{hidden.name} of {hidden.amplitude:.4g}{shapes} (signal over noise {hidden.signal:.1f})"


def _told(mark: Mark, diagnosis: Diagnosis) -> str:
    truth = f"Hidden: {_truth(mark.hidden)}. "
    if mark.hidden.name == BAD_PROBE:
        alone = " The verdict was instrument." if diagnosis.verdict.kind == "instrument" else ""
        return truth + ("It was set aside." + alone if mark.found else "It was not noticed.")
    if not mark.hidden.listed:
        told = f"The verdict was {diagnosis.verdict.kind}"
        return truth + told + (f", {mark.away:.1f} m from it." if np.isfinite(mark.away) else ".")
    if mark.hidden.name in LAWS:
        which = "tells of a law of that quantity in that term" if mark.found else "tells of no such law"
        return f"{truth}The diagnosis said {diagnosis.verdict.kind}; it {which}."
    if mark.open:
        return truth + f"The diagnosis said {diagnosis.verdict.kind}, and lists it among what is not excluded."
    if not mark.inside:
        said = f"{diagnosis.verdict.kind} {', '.join(diagnosis.set)}".rstrip()
        return f"{truth}The diagnosis missed it; it said {said}."
    alone = "It was named alone" if mark.named else f"It is in the set, which holds {_groups_in_words(diagnosis)}"
    told = f"{truth}{alone}; the interval {'holds' if mark.amplitude else 'misses'} the true size."
    others = _other_shapes(mark.hidden, diagnosis)
    return f"{told} It was found with {others}, on which sizes depend." if others else told


def _other_shapes(hidden: Hidden, diagnosis: Diagnosis) -> str:
    """Settings of shape the effect was found with, where they differ from those of the truth by a twentieth or more."""
    found = diagnosis.candidate_effect(hidden.name).shapes
    others = [name for name, true in hidden.shapes.items() if not np.isclose(found.get(name, true), true, rtol=0.05)]
    return " and ".join(f"{name} = {found[name]:.3g} instead of {hidden.shapes[name]:.3g}" for name in others)
