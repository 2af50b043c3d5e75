"""Effects under suspicion as a look sees them: how large to first order, how surely, and what hides them."""

import numpy as np

from vegglue.results.diagnosis import Suspect
from vegglue.screening import score_test
from vegglue.screening.residual_screening import Screening

# Length of a trace, in standard errors, that hides more often than not: the alarm is near a score of 3.2.
HIDING = 3.0
# Share of the chances that the effects listed as not excluded hold together.
HELD = 0.9
# Standard deviations of an effect's prior beyond which its size is not believed.
BEYOND_BELIEF = 3.0
# By how many standard errors a trace must be longer than the score of the alarm, to be seen 19 times of 20.
SEEN_SURELY = 1.645
# Standard deviations of its prior within which an effect must be seen to be testable.
TESTABLE = 2.0


def suspects_of(seen: Screening) -> dict[str, Suspect]:
    """All effects of a look by name, none of them refitted."""
    return {one.name: _suspect(seen, j) for j, one in enumerate(seen.traces.candidates)}


def _suspect(seen: Screening, candidate: int) -> Suspect:
    one, column = seen.traces.candidates[candidate], seen.best_column(candidate)
    amplitude, length = one.effect.amplitude, max(float(seen.projected.length[column]), 1e-300)
    gain = float(seen.scores[column]) / length
    smallest = amplitude.size((seen.threshold + SEEN_SURELY) / length)
    mimic, likeness = _mimic(seen, column)
    return Suspect(
        name=one.name,
        title=one.effect.title,
        unit=amplitude.unit,
        amplitude=amplitude.at(gain),
        interval95=(amplitude.at(gain - 1.96 / length), amplitude.at(gain + 1.96 / length)),
        score=float(seen.scores[column]),
        p_family=seen.family_p(candidate),
        visibility=float(seen.projected.visible[column]),
        smallest_detectable=smallest,
        testable=smallest < TESTABLE * amplitude.scale,
        refitted=False,
        objective=seen.base.fitted.objective - float(seen.scores[column] ** 2),
        mimicked_by=mimic,
        likeness=likeness,
        shapes=seen.traces.settings[column],
        off=amplitude.off,
        scale=amplitude.scale,
    )


def hiding(seen: Screening) -> tuple[tuple[str, ...], ...]:
    """Groups of effects among which one that hides is in nine of ten cases, the likeliest first.

    One is taken to be there, as long as hides more often than not, and at a size that may be believed.
    """
    family, names = seen.traces.columns, [one.name for one in seen.traces.candidates]
    chance = score_test.chances(seen.projected, family, seen.may_be(HIDING, BEYOND_BELIEF), HIDING)
    return tuple(tuple(names[j] for j in group) for group in score_test.likely(seen.projected, family, chance, HELD))


def _mimic(seen: Screening, column: int) -> tuple[str, float]:
    """The parameter whose slope is most like a trace, and the cosine between both."""
    names = seen.base.model.names
    if not names:
        return "", 0.0
    alike = _unit(seen.white[:, column]) @ _unit(seen.slopes)
    nearest = int(np.argmax(np.abs(alike)))
    return names[nearest], float(alike[nearest])


def _unit(columns: np.ndarray) -> np.ndarray:
    return columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
