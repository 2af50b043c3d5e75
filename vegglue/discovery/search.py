"""From the misfit of a calibrated model to a law: laws of the grammar in one competition with all that is listed.

The model is calibrated and screened as for a diagnosis. While errors alone leave as much for laws, nothing is said.
Else the most promising laws are calibrated with the model and ranked by their evidence beside listed effects, places
and instruments, which are as likely before as in a diagnosis; all laws together are a tenth as likely as all listed
effects (`law_screening`), and so is something at a place, which is as vague.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, baseline
from vegglue.diagnosis.competition import REACH, Contender, contenders_of, tempered_chances, tempering
from vegglue.diagnosis.diagnose import FALSE_ALARMS
from vegglue.diagnosis.refits import Refit, RefitTrial, refits_of, start_with
from vegglue.discovery.discovered import Discovery, LawFound
from vegglue.effects.grammar import SAME_AS
from vegglue.engine.interface import Model
from vegglue.progress import Progress, Watch, silent
from vegglue.screening.law_screening import LISTED_ODDS, LawScreening, law_fingerprints, screen_laws
from vegglue.screening.score_test import ALIKE

# Laws that are calibrated at most; as many as listed effects in a diagnosis. Chosen, not measured: each costs a fit.
MOST_LAWS_REFITTED = 8
# Chance that the set of laws and other causes holds together [-].
HELD = 0.95


def discover_laws(model: Model, without: Sequence[str] = (), watch: Watch = silent) -> Discovery:
    """The shortest laws that explain what a calibrated model leaves; without: listed effects that do not compete.

    Errors: InputError when the model finds no flow, or a station has no standard error.
    """
    watch(Progress("calibrating the model as it is"))
    return laws_beyond(baseline(model), without, watch)


def laws_beyond(base: Baseline, without: Sequence[str] = (), watch: Watch = silent) -> Discovery:
    """The same of a model that is calibrated."""
    watch(Progress("looking for a law"))
    traces = law_fingerprints(base, tuple(without))
    if not traces.laws:
        return Discovery(1.0, 0, (), {})
    screening = screen_laws(base, traces)
    if screening.p > FALSE_ALARMS:
        return Discovery(screening.p, len(screening.laws), (), {})
    known = _as_vague(screening, contenders_of(screening.listed, watch, screening.kind.total))
    laws = _laws(screening, max((one.log_evidence for one in known), default=-np.inf), watch)
    return _discovery(screening, sorted([*known, *laws], key=lambda one: -one.log_evidence))


def _as_vague(screening: LawScreening, found: Sequence[Contender]) -> list[Contender]:
    """What is at a place, of no kind that others have seen in nature, as likely before as laws; all else as it is."""
    places = {one.term for one in screening.listed.fingerprints.places}
    less = np.log(LISTED_ODDS)
    return [replace(one, log_evidence=one.log_evidence - less) if one.kind in places else one for one in found]


def _laws(screening: LawScreening, known: float, watch: Watch) -> list[Contender]:
    """The most promising laws, calibrated, with their evidence; known: that of the best of all else."""
    evidence = screening.kind.log_evidence
    best = np.array([screening.best_column(j) for j in range(len(screening.laws))])
    order = np.argsort(-evidence[best])[:MOST_LAWS_REFITTED]
    top = max(float(evidence[best].max()), known)
    reach = [int(j) for j in order if (top - evidence[best[j]]) / tempering(np.array(top)) < REACH]
    trials = [_trial(screening, j, int(best[j])) for j in reach]
    refits = refits_of(screening.listed.search, trials, watch)
    return [
        Contender("law", refit.candidate.name, refit.log_factor + _charge(screening, j), int(best[j]), refit)
        for j, refit in zip(reach, refits, strict=True)
        if refit is not None
    ]


def _trial(screening: LawScreening, law: int, column: int) -> RefitTrial:
    """A law at its best reference, from the best place and the size of its score."""
    search, one, shapes = screening.listed.search, screening.laws[law].candidate, screening.settings[column]
    start = start_with(search.model.case, one, shapes, search.point.z, screening.gain(law))
    return RefitTrial(one, shapes, (start,))


def _charge(screening: LawScreening, law: int) -> float:
    """ln prior of a law at its best reference, and what its other references add to first order."""
    columns, evidence = screening.columns[law], screening.kind.log_evidence
    others = float(np.logaddexp.reduce(evidence[columns]) - evidence[columns].max())
    return float(screening.kind.log_prior[columns[0]]) + others


def _discovery(screening: LawScreening, ranked: Sequence[Contender]) -> Discovery:
    """The causes that hold HELD of the chance together; none where even the best says too little."""
    if not ranked or ranked[0].log_evidence < 0.0:
        return Discovery(screening.p, len(screening.laws), (), {})
    chances = tempered_chances(np.array([one.log_evidence for one in ranked]))
    count = int(np.searchsorted(np.cumsum(chances), HELD)) + 1
    pairs = list(zip(ranked, chances, strict=True))[:count]
    laws = tuple(_law_found(screening, one, float(p)) for one, p in pairs if one.kind == "law")
    return Discovery(
        p=screening.p,
        tried=len(screening.laws),
        laws=laws,
        others={one.name: float(p) for one, p in pairs if one.kind != "law"},
    )


def _law_found(screening: LawScreening, one: Contender, chance: float) -> LawFound:
    refit = one.what
    assert isinstance(refit, Refit)
    of_law = next(law for law in screening.laws if law.candidate.name == one.name)
    return LawFound(
        law=of_law.law,
        same_as=SAME_AS.get(of_law.law.name, ""),
        reference=refit.shapes.get("reference"),
        scale=refit.candidate.amplitude.scale,
        strength=refit.amplitude,
        interval95=refit.interval95,
        chance=chance,
        log_evidence=one.log_evidence,
        seen=of_law.seen,
        alike=_alike(screening, one),
    )


def _alike(screening: LawScreening, one: Contender) -> tuple[str, ...]:
    """Names of listed effects and laws whose trace at the stations is that of this law, the most alike first."""
    row = np.abs(screening.cosine[screening.of_listed + one.column])
    listed = screening.listed.fingerprints
    names = [candidate.name for candidate in listed.candidates] + [law.candidate.name for law in screening.laws]
    columns = [*listed.columns, *(screening.of_listed + numbers for numbers in screening.columns)]
    nearest: Array = np.array([row[numbers].max() for numbers in columns])
    return tuple(names[j] for j in np.argsort(-nearest) if nearest[j] > ALIKE and names[j] != one.name)
