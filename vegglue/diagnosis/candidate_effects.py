"""What a screening finds of effects and of laws, as values: how large to first order, how surely, what confounds them.

Laws would explain what no listed effect does, to first order; `discover` calibrates them and writes one down.

    p_j ~ exp((E_j - max E) / w_j)   over laws and all else that was compared, see `competition`

They have an alarm of their own, which follows that of everything listed: the listed library goes first. Beside a
listed effect that was accepted they are named if they clearly explain more.
"""

from collections.abc import Callable

import numpy as np

from vegglue.calibration import score_test
from vegglue.calibration.baseline import log_evidence
from vegglue.calibration.detection import detected_length
from vegglue.calibration.fit import objective
from vegglue.calibration.law_screening import LawScreening, law_fingerprints, screen_laws
from vegglue.calibration.residual_screening import Screening
from vegglue.calibration.score_test import prior_shrinkage
from vegglue.decision_constants import constants
from vegglue.diagnosis.competition import tempered_probabilities
from vegglue.diagnosis.search_state import SearchState
from vegglue.normal_range import NORMAL95
from vegglue.results.causes import (
    AmplitudeEstimate,
    CandidateEffect,
    CandidateLaw,
    CandidateLaws,
    Detectability,
    ScoreTest,
)

# Lengths of a fingerprint, in standard errors, that may be there undetected: thresholds are near a score of 3.2, so
# that longer ones stand out and shorter ones change little. Which it is, is not known.
UNDETECTED_LENGTHS = (2.0, 3.0, 4.0)
# Share of the chances that the effects listed as not excluded hold together.
NOT_EXCLUDED_CHANCE = 0.9
# Standard deviations of an effect's prior beyond which its size is not taken to be possible.
LARGEST_POSSIBLE = 3.0
# Chance with which an effect of the smallest size is detected [-].
DETECTED = 0.95
# Standard deviations of its prior within which an effect must be detectable to be testable, and within its support.
TESTABLE = 2.0


def candidate_effects_of(screening: Screening) -> dict[str, CandidateEffect]:
    """All effects of a screening by name, none of them refitted, to first order.

    gain = T / |S_perp| a^2 / (1 + a^2) with a standard error of s / (1 + a^2)^(1/2), s and a of `score_test`; objective
    F - T^2 a^2 / (1 + a^2), F under the errors as they are now: the prior of the amplitude is in all of them, as in
    those of a refit.
    """
    threshold, base, kind = (
        screening.effects.threshold(constants().effect_alarm_rate),
        screening.base,
        screening.kinds[0],
    )
    detected = float(detected_length(np.array(threshold), DETECTED))
    projected, prints = screening.projected, screening.fingerprints
    least_squares = objective(base.noise, base.fitted.point)

    def unit(columns: np.ndarray) -> np.ndarray:
        return columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)

    found = {}
    for j, one in enumerate(prints.candidates):
        column, score = screening.best_column(j), screening.best_score(j)
        amplitude, gain = prints.amplitudes[column], float(kind.gain[column])
        reach = NORMAL95 * amplitude.plausible_gain / float(np.hypot(1.0, kind.size[column]))
        taken = float(screening.effects.scores[column] ** 2 * prior_shrinkage(kind.size[column]))
        smallest = amplitude.size(detected / max(float(projected.length[column]), 1e-300))
        confounder, cosine = "", 0.0  # the parameter whose slope is most like the fingerprint
        if base.model.names:
            cosines = unit(screening.whitened_fingerprints[:, column]) @ unit(screening.whitened_slopes)
            nearest = int(np.argmax(np.abs(cosines)))
            confounder, cosine = base.model.names[nearest], float(cosines[nearest])
        found[one.name] = CandidateEffect(
            name=one.name,
            title=one.effect.title,
            shapes=prints.settings[column],
            amplitude=AmplitudeEstimate(
                value=amplitude.at(gain),
                interval95=(amplitude.at(gain - reach), amplitude.at(gain + reach)),
                unit=amplitude.unit,
                off=amplitude.off,
                scale=amplitude.scale,
                refitted=False,
                support=(amplitude.low, amplitude.high),
                objective=least_squares - taken,
            ),
            test=ScoreTest(score, screening.effects.p_of(score)),
            detectability=Detectability(
                visibility=float(projected.visible[column]),
                smallest=smallest,
                testable=smallest < min(TESTABLE * amplitude.scale, amplitude.furthest),
                confounder=confounder,
                cosine=cosine,
            ),
        )
    return found


def not_excluded(screening: Screening) -> tuple[tuple[str, ...], ...]:
    """Groups of effects among which one that is there undetected is in nine of ten cases, the likeliest first.

    One is taken to be there, as long as may be missed, and at a possible size.
    """
    families = screening.fingerprints.columns
    names = [one.name for one in screening.fingerprints.candidates]
    possible = {length: screening.possible_signs(length, LARGEST_POSSIBLE) for length in UNDETECTED_LENGTHS}
    chance = score_test.chances(screening.projected, families, possible)
    groups = score_test.likeliest_families(screening.projected, families, chance, NOT_EXCLUDED_CHANCE)
    return tuple(tuple(names[j] for j in group) for group in groups)


# Share of the chance of all laws that the reported ones hold together.
LAWS_HELD = 0.95


def laws_beside(screening: Screening) -> LawScreening | None:
    """Laws screened beside all that is listed; None if there can be none: `discover` refuses a command."""
    if screening.base.model.case.of_another_model:
        return None
    traces = law_fingerprints(screening.base, (), screening.fingerprints)
    return screen_laws(screening.base, traces, screening.flagged) if traces.laws else None


def candidate_laws(
    first: Screening, last: Screening, found: SearchState, beside_first: Callable[[], LawScreening | None]
) -> CandidateLaws | None:
    """Laws that are significant in the last model, or in the first one if something was accepted; else None.

    Beside accepted effects they are reported only if they are `clearly_a_law`, or likelier than effects and a place
    together, which a law looks like. Chosen after the twin of docs/discover.md, whose law has 84 %.

    beside_first: `laws_beside` the first screening, begun before it is known whether it is needed.
    """
    if found.implausible:
        return None
    screening = beside_first() if found.accepted or last is first else laws_beside(last)
    if screening is None or screening.p >= constants().law_alarm_rate:
        return None
    # What laws are compared with: what was accepted, else what was calibrated, else all that was tested.
    if found.accepted:
        against = [found.gained(log_evidence(first.base), log_evidence(last.base))]
    elif found.undecided:
        against = [one.log_evidence for one in found.undecided.hypotheses]
    else:
        against = [kind.total for kind in last.kinds]
    of_laws = screening.of_each
    chances = tempered_probabilities(np.append(of_laws, against))[: of_laws.size]
    order = np.argsort(-chances)
    count = int(np.searchsorted(np.cumsum(chances[order]), LAWS_HELD * chances.sum())) + 1
    laws = []
    for j in map(int, order[:count]):
        one, reference = screening.laws[j], screening.settings[screening.best_column(j)].get("reference")
        laws.append(
            CandidateLaw(
                name=one.law.name,
                term=one.law.term.words,
                quantity=one.law.quantity.words,
                title=one.law.title,
                equation=one.law.equation(reference),
                reference=reference,
                scale=one.candidate.amplitude.scale,
                strength=screening.gain(j),
                chance=float(chances[j]),
            )
        )
    suspected = CandidateLaws(screening.p, of_laws.size, float(chances.sum()), tuple(laws))
    reported = not found.steps or clearly_a_law(suspected) or (bool(found.places) and suspected.likelier)
    return suspected if reported else None


def clearly_a_law(laws: CandidateLaws | None) -> bool:
    """Whether laws are strong_odds times as likely as all else together: a place then stands in for one."""
    return laws is not None and laws.chance > constants().strong_odds * (1.0 - laws.chance)
