"""What was found, in words: one verdict in one sentence, remarks, and where the model misses."""

from collections.abc import Sequence

from vegglue.results.diagnosis import DragLocation, EstimatedErrors, Misfit, Step, Suspect, Verdict, VerdictKind

# A set of more groups than this says nothing.
MOST_GROUPS = 3
# Chance of the last misfit under errors alone, below which something is still missing.
POOR = 1e-3
# Chance of what is named, below which it is stated: above, it would be told as 100 %.
STATED_BELOW = 0.995
# Share of the effects that must be testable before it is said that nothing is missing.
TESTABLE_SHARE = 0.25
# Amplitude over a plausible one, above which it is said to be too large to be believed.
IMPLAUSIBLE = 3.0
# |cosine| with a parameter above which that is told as the reason why an effect is untestable.
CONFOUNDED = 0.8
# Names that a remark holds at most.
NAMES_SHOWN = 8


def judged(
    errors: EstimatedErrors,
    misfit: Misfit,
    steps: Sequence[Step],
    suspects: Sequence[Suspect],
    location: DragLocation | None,
    not_excluded: tuple[tuple[str, ...], ...],
    unexplained: str,
) -> Verdict:
    """The verdict, its sentence, and what else should be known. unexplained: what stands out and nothing came of."""
    open_still = _open(not_excluded) if misfit.p >= POOR else []
    remarks = [*_implausible(steps, suspects), *open_still, *_remarks(errors, suspects)]
    kind, sentence = _sentence(misfit, steps, suspects, location, unexplained)
    if kind in ("identified", "one-of") and misfit.p < POOR:
        remarks.append(
            f"The misfit that is left is still larger than the errors allow ({_told(misfit)}, p = {misfit.p:.1g})."
        )
    return Verdict(kind, sentence, tuple(remarks), location, not_excluded)


def _sentence(
    misfit: Misfit, steps: Sequence[Step], suspects: Sequence[Suspect], location: DragLocation | None, unexplained: str
) -> tuple[VerdictKind, str]:
    if location is not None:
        before = f", after {_names(steps)}" if steps else ""
        return (
            "none-of-these",
            f"None of the known effects{before}: the misfit points at x = {location.x:.1f}, y = {location.y:.1f} m, "
            f"where something holds the flow back or lets it pass that the model does not have ({_told(misfit)} "
            "without it).",
        )
    if unexplained:
        return "cannot-tell", f"These data cannot tell: {unexplained} ({_told(misfit)})."
    if not steps:
        return _without_steps(suspects, misfit)
    if len(steps[0].groups) > MOST_GROUPS:
        names = ", ".join(_likely(steps[0], steps[0].rivals))
        which = f"which of {names} it is (chances among those calibrated)"
        return "cannot-tell", f"Something is missing, but these data cannot tell {which}."
    sentences = "; and ".join(_step_words(step, suspects) for step in steps)
    single = all(len(step.rivals) == 1 for step in steps)
    return ("identified" if single else "one-of"), f"Missing: {sentences}; {_told(misfit)} with it."


def _told(misfit: Misfit) -> str:
    return f"chi2 is {misfit.chi2:.0f} for {misfit.freedom} degrees of freedom"


def _without_steps(suspects: Sequence[Suspect], misfit: Misfit) -> tuple[VerdictKind, str]:
    testable = [suspect for suspect in suspects if suspect.detectability.testable]
    if misfit.p < POOR:
        return (
            "cannot-tell",
            f"The misfit is larger than the errors allow ({_told(misfit)}), but no known effect and no place stands "
            "out.",
        )
    if len(testable) < TESTABLE_SHARE * max(len(suspects), 1):
        return (
            "cannot-tell",
            f"Nothing stands out ({_told(misfit)}), but only {len(testable)} of {len(suspects)} effects would be seen "
            "in these data if they were there at twice a plausible size.",
        )
    return (
        "nothing-missing",
        f"Nothing is missing that these data could show: {_told(misfit)}, and none of {len(suspects)} effects stands "
        f"out ({len(testable)} of them would be seen at twice a plausible size).",
    )


def _names(steps: Sequence[Step]) -> str:
    return " and ".join(step.accepted for step in steps)


def _step_words(step: Step, suspects: Sequence[Suspect]) -> str:
    by_name = {suspect.name: suspect for suspect in suspects}
    best = by_name[step.accepted]
    low, high = best.amplitude.interval95
    unit = "" if best.amplitude.unit == "-" else f" {best.amplitude.unit}"
    words = f"{step.accepted} of {best.amplitude.value:.3g}{unit} ({low:.3g} to {high:.3g}; {best.title.lower()})"
    alike = next(group for group in step.groups if step.accepted in group)
    same = [name for name in alike if name != step.accepted]
    rest = [name for name in step.rivals if name not in alike]
    own = sum(step.chance[name] for name in alike)
    if same:
        words += f", which leaves the same trace in these data as {', '.join(same)}"
    if rest or own < STATED_BELOW:
        words += f", {'together ' if same else ''}with a chance of {own:.0%} among those calibrated"
    return words + (f", or else {' or '.join(_likely(step, rest))}" if rest else "")


def _likely(step: Step, names: Sequence[str]) -> list[str]:
    """Names with their chances."""
    return [f"{name} ({step.chance[name]:.0%})" for name in names]


def _remarks(errors: EstimatedErrors, suspects: Sequence[Suspect]) -> list[str]:
    remarks = []
    if errors.correlation > 0:
        remarks.append(f"Errors of neighbours are correlated by {errors.correlation:.2f}; this is allowed for.")
    if errors.scale > 1:
        remarks.append(f"The stated errors look too small by a factor of {errors.scale:.2f}; this is allowed for.")
    if errors.flagged:
        number = len(errors.flagged)
        many = "1 station stands" if number == 1 else f"{number} stations stand"
        remarks.append(f"{many} alone against every effect and every place; no effect is judged by it.")
    hidden = [suspect for suspect in suspects if not suspect.detectability.testable]
    if hidden:
        names = ", ".join(_untestable(suspect) for suspect in hidden)
        remarks.append(f"Untestable with these data, neither present nor absent: {names}.")
    return remarks


def _open(groups: Sequence[Sequence[str]]) -> list[str]:
    names = [name for group in groups for name in group]
    more = f" and {len(names) - NAMES_SHOWN} more" if len(names) > NAMES_SHOWN else ""
    said = (
        "Should exactly one effect hide here, of about three standard errors, nine times of ten it is one of these, "
        f"the likeliest first: {', '.join(names[:NAMES_SHOWN])}{more}; what is smaller may be any."
    )
    return [said] if names else []


def _implausible(steps: Sequence[Step], suspects: Sequence[Suspect]) -> list[str]:
    by_name = {suspect.name: suspect for suspect in suspects}
    far = [one for step in steps if (one := by_name[step.accepted]).amplitude.relative_size > IMPLAUSIBLE]
    return [
        f"{one.name} is {one.amplitude.relative_size:.1f} times what is plausible for it: it may stand in for "
        "something that is not in the library."
        for one in far
    ]


def _untestable(suspect: Suspect) -> str:
    if abs(suspect.detectability.cosine) > CONFOUNDED:
        return f"{suspect.name} (looks like a change of {suspect.detectability.confounder})"
    return suspect.name
