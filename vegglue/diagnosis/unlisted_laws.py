"""Laws that would explain what no listed effect does, to first order; `discover` calibrates them and writes one down.

    p_j ~ exp((E_j - max E) / w_j)   over laws and all else that was compared, see `competition`

They have an alarm of their own, which is asked after that of everything listed: the listed library goes first. Beside a
listed effect that was accepted they are told where they clearly explain more.
"""

from collections.abc import Callable

import numpy as np

from vegglue.calibration.baseline import log_evidence
from vegglue.calibration.law_screening import LawScreening, law_fingerprints, screen_laws
from vegglue.calibration.residual_screening import Screening
from vegglue.decision_constants import constants
from vegglue.diagnosis.search_state import SearchState
from vegglue.diagnosis.tempered_probabilities import tempered_probabilities
from vegglue.results.causes import CandidateLaw, CandidateLaws

# Share of the chance of all laws that those told hold together.
LAWS_HELD = 0.95


def laws_beside(screening: Screening) -> LawScreening | None:
    """Laws screened beside all that is listed; None where none can be told: `discover` refuses a command."""
    if screening.base.model.case.engine is not None:
        return None
    traces = law_fingerprints(screening.base, (), screening.fingerprints)
    return screen_laws(screening.base, traces, screening.flagged) if traces.laws else None


def candidate_laws(
    first: Screening, last: Screening, found: SearchState, beside_first: Callable[[], LawScreening | None]
) -> CandidateLaws | None:
    """Laws that stand out against the last model, or against the first one where something was accepted; None where
    errors alone leave as much, or beside listed effects that were accepted unless it is clearly a law.

    beside_first: `laws_beside` the first screening, begun before it is known whether it is asked for.
    """
    if found.implausible:
        return None
    screening = beside_first() if found.accepted or last is first else laws_beside(last)
    if screening is None or screening.p >= constants().law_alarm_rate:
        return None
    of_laws = screening.of_each
    chances = tempered_probabilities(np.append(of_laws, _against(first, last, found)))[: of_laws.size]
    order = np.argsort(-chances)
    count = int(np.searchsorted(np.cumsum(chances[order]), LAWS_HELD * chances.sum())) + 1
    laws = tuple(_law(screening, int(j), float(chances[j])) for j in order[:count])
    suspected = CandidateLaws(screening.p, of_laws.size, float(chances.sum()), laws)
    return None if found.steps and not clearly_a_law(suspected) else suspected


def clearly_a_law(laws: CandidateLaws | None) -> bool:
    """Whether laws are strong_odds times as likely as all else together: a place then stands in for one."""
    return laws is not None and laws.chance > constants().strong_odds * (1.0 - laws.chance)


def _against(first: Screening, last: Screening, found: SearchState) -> list[float]:
    """ln evidence of what laws are compared with: what was accepted, else what was calibrated, else all that was
    tested.
    """
    if found.accepted:
        return [found.gained(log_evidence(first.base), log_evidence(last.base))]
    if found.undecided:
        return [one.log_evidence for one in found.undecided.hypotheses]
    return [kind.total for kind in last.kinds]


def _law(screening: LawScreening, law: int, chance: float) -> CandidateLaw:
    one = screening.laws[law]
    reference = screening.settings[screening.best_column(law)].get("reference")
    return CandidateLaw(
        name=one.law.name,
        term=one.law.term.words,
        quantity=one.law.quantity.words,
        title=one.law.title,
        equation=one.law.equation(reference),
        reference=reference,
        scale=one.candidate.amplitude.scale,
        strength=screening.gain(law),
        chance=chance,
    )
