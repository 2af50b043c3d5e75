"""What was found, in words: one verdict in one sentence, remarks, and where the model misses."""

from collections.abc import Sequence
from dataclasses import dataclass

import scipy.stats

from vegglue.calibration.noise import Noise
from vegglue.results.diagnosis import Step, Suspect, Verdict, Where

# A set of more groups than this says nothing.
MOST_GROUPS = 3
# Chance of the last misfit under errors alone, below which something is still missing.
POOR = 1e-3
# Chance of what is named, below which it is told.
SURE_CHANCE = 0.995
# Amplitude over a plausible one, above which it is said to be too large to be believed.
STRETCHED = 3.0
# Names that a remark holds at most.
NAMES_SHOWN = 8


@dataclass(frozen=True)
class Misfit:
    """Whitened chi2 of the last model and its degrees of freedom [-]."""

    chi2: float
    freedom: int

    @property
    def p(self) -> float:
        """Chance of a chi2 as large under errors alone."""
        return float(scipy.stats.chi2.sf(self.chi2, max(self.freedom, 1)))

    def __str__(self) -> str:
        return f"chi2 is {self.chi2:.0f} for {self.freedom} degrees of freedom"


def judged(
    noise: Noise,
    steps: Sequence[Step],
    suspects: Sequence[Suspect],
    place: Where | None,
    fit: Misfit,
    flagged: Sequence[int],
    not_excluded: Sequence[Sequence[str]],
    unexplained: str = "",
) -> tuple[Verdict, str, list[str]]:
    """The verdict, its sentence, and what else should be known. unexplained: what stands out and nothing came of."""
    still = _open(not_excluded) if fit.p >= POOR else []
    remarks = [*_stretched(steps, suspects), *still, *_remarks(noise, suspects, flagged)]
    if place is not None:
        before = f", after {_names(steps)}" if steps else ""
        return (
            "none-of-these",
            f"None of the known effects{before}: the misfit points at x = {place.x:.1f}, y = {place.y:.1f} m, where "
            f"something holds the flow back or lets it pass that the model does not have ({fit} without it).",
            remarks,
        )
    if unexplained:
        return "cannot-tell", f"These data cannot tell: {unexplained} ({fit}).", remarks
    if not steps:
        return _without_steps(suspects, fit, remarks)
    if len(steps[0].groups) > MOST_GROUPS:
        names = ", ".join(_likely(steps[0], steps[0].rivals))
        which = f"which of {names} it is (chances among those calibrated)"
        return "cannot-tell", f"Something is missing, but these data cannot tell {which}.", remarks
    if fit.p < POOR:
        remarks.append(f"The misfit that is left is still larger than the errors allow ({fit}, p = {fit.p:.1g}).")
    sentences = "; and ".join(_step_words(step, suspects) for step in steps)
    single = all(len(step.rivals) == 1 for step in steps)
    return ("identified" if single else "one-of"), f"Missing: {sentences}; {fit} with it.", remarks


def _without_steps(suspects: Sequence[Suspect], fit: Misfit, remarks: list[str]) -> tuple[Verdict, str, list[str]]:
    testable = [suspect for suspect in suspects if suspect.testable]
    if fit.p < POOR:
        return (
            "cannot-tell",
            f"The misfit is larger than the errors allow ({fit}), but no known effect and no place stands out.",
            remarks,
        )
    if len(testable) < 0.25 * max(len(suspects), 1):
        return (
            "cannot-tell",
            f"Nothing stands out ({fit}), but only {len(testable)} of {len(suspects)} effects would be seen in these "
            "data if they were there at twice a plausible size.",
            remarks,
        )
    return (
        "nothing-missing",
        f"Nothing is missing that these data could show: {fit}, and none of {len(suspects)} effects stands out "
        f"({len(testable)} of them would be seen at twice a plausible size).",
        remarks,
    )


def _names(steps: Sequence[Step]) -> str:
    return " and ".join(step.accepted for step in steps)


def _step_words(step: Step, suspects: Sequence[Suspect]) -> str:
    by_name = {suspect.name: suspect for suspect in suspects}
    best = by_name[step.accepted]
    low, high = best.interval95
    unit = "" if best.unit == "-" else f" {best.unit}"
    words = f"{step.accepted} of {best.amplitude:.3g}{unit} ({low:.3g} to {high:.3g}; {best.title.lower()})"
    alike = next(group for group in step.groups if step.accepted in group)
    same = [name for name in alike if name != step.accepted]
    rest = [name for name in step.rivals if name not in alike]
    own = sum(step.chance[name] for name in alike)
    if same:
        words += f", which leaves the same trace in these data as {', '.join(same)}"
    if rest or own < SURE_CHANCE:
        words += f", {'together ' if same else ''}with a chance of {own:.0%} among those calibrated"
    return words + (f", or else {' or '.join(_likely(step, rest))}" if rest else "")


def _likely(step: Step, names: Sequence[str]) -> list[str]:
    """Names with their chances."""
    return [f"{name} ({step.chance[name]:.0%})" for name in names]


def _remarks(noise: Noise, suspects: Sequence[Suspect], flagged: Sequence[int]) -> list[str]:
    remarks = []
    if noise.correlation > 0:
        remarks.append(f"Errors of neighbours are correlated by {noise.correlation:.2f}; this is allowed for.")
    if noise.scale > 1:
        remarks.append(f"The stated errors look too small by a factor of {noise.scale:.2f}; this is allowed for.")
    if flagged:
        many = "1 station stands" if len(flagged) == 1 else f"{len(flagged)} stations stand"
        remarks.append(f"{many} alone against every effect and every place; no effect is judged by it.")
    hidden = [suspect for suspect in suspects if not suspect.testable]
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


def _stretched(steps: Sequence[Step], suspects: Sequence[Suspect]) -> list[str]:
    by_name = {suspect.name: suspect for suspect in suspects}
    far = [one for step in steps if (one := by_name[step.accepted]).stretch > STRETCHED]
    return [
        f"{one.name} is {one.stretch:.1f} times what is plausible for it: it may stand in for something that is not in "
        "the library."
        for one in far
    ]


def _untestable(suspect: Suspect) -> str:
    if abs(suspect.likeness) > 0.8:
        return f"{suspect.name} (looks like a change of {suspect.mimicked_by})"
    return suspect.name
