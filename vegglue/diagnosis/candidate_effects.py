"""What a screening finds of effects and of laws, as values: how large to first order, how surely, what confounds them.

Laws would explain what no listed effect does; `discover` writes one down.

    p_j ~ exp((E_j - max E) / w_j)   over laws and all else that was compared, see `odds`

They have an alarm of their own, which follows that of everything listed: the listed library goes first. Those that are
not clearly less likely than what was accepted are calibrated, as in `discover`, and named beside it; a law that leaves
the same trace as an accepted effect is that effect, and so is another form of an effect that is a law itself: both say
that a term changes with a quantity, or with one that goes with it in these data, and the known form goes first.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.baseline import log_evidence
from vegglue.calibration.fit import objective
from vegglue.calibration.law_screening import LawScreening, first_order_gain, law_fingerprints, screen_laws
from vegglue.calibration.residual_screening import Screening
from vegglue.calibration.score_test import prior_shrinkage
from vegglue.case.case_effects import parameters_of_effects
from vegglue.decision_constants import constants
from vegglue.diagnosis.competition import Hypothesis
from vegglue.diagnosis.odds import chances_in_set
from vegglue.diagnosis.refits import Refit
from vegglue.diagnosis.search_state import SearchState
from vegglue.effects.grammar import LAWS, SAME_AS
from vegglue.engine.interface import Model
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


def candidate_effects_of(screening: Screening) -> dict[str, CandidateEffect]:
    """All effects of a screening, none of them refitted, to first order.

        gain = T / |S_perp| a^2 / (1 + a^2),   standard error s / (1 + a^2)^(1/2),   objective F - T^2 a^2 / (1 + a^2)

    s and a are those of `score_test`, F the objective under the errors as they are now: the prior of the amplitude is
    in all of them, as in those of a refit.

    Returns
    -------
    dict of CandidateEffect
        By name; amplitudes in their units.
    """
    base, kind = screening.base, screening.kinds[0]
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
                smallest=screening.smallest_shown(column),
                testable=screening.testable(column),
                confounder=confounder,
                cosine=cosine,
            ),
        )
    return found


def not_excluded(screening: Screening) -> tuple[tuple[str, ...], ...]:
    """Groups of effects among which one that is there undetected is with a chance of NOT_EXCLUDED_CHANCE.

    One is taken to be there, of UNDETECTED_LENGTHS, and at a possible size, see `score_test.chances`.

    Returns
    -------
    tuple of tuple of str
        Names of each group, the likeliest first.
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
    """Laws screened beside all that is listed.

    Returns
    -------
    LawScreening or None
        None without a law that has something to act on, or of a case of another model: `discover` refuses a command.
    """
    if screening.base.model.case.of_another_model:
        return None
    traces = law_fingerprints(screening.base, (), screening.fingerprints)
    return screen_laws(screening.base, traces, screening.flagged) if traces.laws else None


def candidate_laws(
    first: Screening,
    last: Screening,
    found: SearchState,
    beside_first: Callable[[], LawScreening | None],
    beside_last: Callable[[], LawScreening | None],
    refitted: Callable[[LawScreening, Sequence[str], float, float], tuple[Sequence[Hypothesis], Array, float]],
) -> CandidateLaws | None:
    """Laws that are significant in the last model, or in the first one if something was accepted.

    Beside accepted effects they are reported if these are not strong_odds times as likely as they are, and go before
    these only if they are significant with these in the model, too.

    Parameters
    ----------
    beside_first, beside_last : callable
        `laws_beside` either screening; the first is begun before it is known whether it is needed.
    refitted : callable
        `laws_beside_accepted` of a screening, accepted effects, their ln prior, ln evidence of the best of all else.

    Returns
    -------
    CandidateLaws or None
        With the laws that hold LAWS_HELD of the chance of all.
    """
    if found.implausible:
        return None
    screening = beside_first() if found.accepted or last is first else beside_last()
    if screening is None or screening.p >= constants().law_alarm_rate:
        return None
    # What laws are compared with: what was accepted, else what was calibrated, else all that was tested.
    if found.accepted:
        against = [found.gained(log_evidence(first.base), log_evidence(last.base))]
    elif found.undecided:
        against = [one.log_evidence for one in found.undecided.hypotheses]
    else:
        against = [kind.total for kind in last.kinds]
    same = same_as_accepted(screening, found.effects)
    evidence = np.where(same, -np.inf, screening.kind.log_evidence)
    of_laws, refits = screening.of_each(evidence), dict[str, Refit]()
    # What was accepted stands for all its forms, with the evidence of the likeliest.
    of_forms = float(screening.kind.log_evidence[same].max(initial=-np.inf))
    against = [max(one, of_forms) for one in against]

    def chances_of_laws() -> Array:
        return chances_in_set(np.append(of_laws, against))[: of_laws.size]

    if _may_be_laws(float(chances_of_laws().sum())):
        alone = [] if found.places else found.effects
        calibrated, kept, own = refitted(screening, alone, found.log_prior, max(against))
        against = [max(own, of_forms)] if found.accepted else against
        of_laws = screening.of_each(np.where(np.isinf(evidence), -np.inf, kept))
        refits = {one.name: one.what for one in calibrated if isinstance(one.what, Refit)}
    if not np.isfinite(of_laws).any():
        return None
    chances = chances_of_laws()
    order = np.argsort(-chances)
    count = int(np.searchsorted(np.cumsum(chances[order]), LAWS_HELD * chances.sum())) + 1
    laws = []
    for j in map(int, order[:count]):
        one, column = screening.laws[j], screening.best_column(j)
        reference = screening.settings[column].get("reference")
        laws.append(
            CandidateLaw(
                name=one.law.name,
                term=one.law.term.words,
                quantity=one.law.quantity.words,
                title=one.law.title,
                equation=one.law.equation(reference),
                reference=reference,
                scale=one.candidate.amplitude.scale,
                strength=(
                    refits[one.law.name].amplitude
                    if one.law.name in refits
                    else first_order_gain(screening.kind, column, one)
                ),
                chance=float(chances[j]),
            )
        )
    suspected = CandidateLaws(screening.p, of_laws.size, float(chances.sum()), tuple(laws), bool(refits))
    if laws[0].name in refits:
        model = first.base.model
        _, far = furthest_off_prior(model, refits[laws[0].name].fitted.point.z[: len(model.names)])
        suspected = replace(suspected, strained=far)
    if found.steps and suspected.clear:
        beside = beside_last()
        suspected = replace(suspected, needed=beside is not None and beside.p < constants().law_alarm_rate)
    return suspected if not found.steps or _may_be_laws(suspected.chance) else None


def furthest_off_prior(model: Model, z: Array) -> tuple[str, float]:
    """The calibrated parameter, other than the amplitude of an effect, that is furthest off the middle of its prior,
    and how far [standard deviations]; z (p,).
    """
    of_effects = parameters_of_effects(model.case)
    own = [(abs(float(z[j])), name) for j, name in enumerate(model.names) if name not in of_effects]
    far, strained = max(own, default=(0.0, ""))
    return strained, far


def same_as_accepted(screening: LawScreening, accepted: Sequence[str]) -> NDArray[np.bool_]:
    """Whether the law of each column is an accepted effect.

    It leaves the same trace; or the effect is a law itself, and this is another form of it, of the same quantity or of
    one that the data cannot separate: in the form of the effect it leaves the same trace.

    Parameters
    ----------
    accepted : sequence of str
        Names of effects.

    Returns
    -------
    ndarray of bool (l,)
    """
    prints = screening.listed.fingerprints
    own = [some for one, some in zip(prints.candidates, prints.columns, strict=True) if one.name in accepted]
    if not own:
        return np.zeros(len(screening.settings), dtype=bool)
    cosine = np.abs(screening.cosine[np.concatenate(own), screening.of_listed :])
    same = np.asarray(cosine.max(axis=0) > constants().alike_cosine)
    laws = [LAWS[law] for law, effect in SAME_AS.items() if effect in accepted]
    columns_of = [(one.law, columns) for one, columns in zip(screening.laws, screening.columns, strict=True)]
    subjects = {law.subject for law in laws} | {
        law.subject
        for law, columns in columns_of
        if same[columns].any() and (law.term, law.form) in [(one.term, one.form) for one in laws]
    }
    for law, columns in columns_of:
        same[columns] |= law.subject in subjects
    return same


def _may_be_laws(chance: float) -> bool:
    """Whether all else together is less than strong_odds times as likely as laws of this probability [-]."""
    return constants().strong_odds * chance >= 1.0 - chance
