"""From the misfit of a calibrated model to a law: laws of the grammar in one competition with all that is listed.

The model is calibrated and screened as for a diagnosis. While errors alone leave as much for laws, nothing is said.
Else the most promising laws are calibrated with the model and ranked by their evidence beside listed effects, places
and instruments, which are as likely before as in a diagnosis; all laws together are a tenth as likely as all listed
effects (`law_screening`), and so is something at a place, which is as vague. A law that is best is looked at again for
products with another quantity (`product`).

Products: the best law is in the model, calibrated. While errors alone leave as much for products, none is reported;
else the best of them are calibrated, and one is reported if it is likelier than all else that could explain what is
left.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vegglue.calibration.baseline import Baseline, SearchModel, baseline
from vegglue.calibration.candidates import with_effect
from vegglue.calibration.fingerprints import Fingerprints
from vegglue.calibration.law_screening import (
    LARGEST_GAIN,
    LawScreening,
    law_fingerprints,
    screen_laws,
    screen_products,
)
from vegglue.calibration.laws_in_case import LawInCase
from vegglue.case.parameter_space import theta_at
from vegglue.decision_constants import constants
from vegglue.diagnosis.competition import REACH, Hypothesis, chances_in_set, hypotheses_of, tempering
from vegglue.diagnosis.discovered import Discovery, LawFound, ProductFound
from vegglue.diagnosis.refits import Refit, RefitTrial, refits_of, start_with
from vegglue.effects.grammar import SAME_AS, Law
from vegglue.engine.interface import Model
from vegglue.engine.model import with_compilation
from vegglue.progress import Progress, Watch

# How often errors alone sound the alarm of products [-]: it comes on top of that of laws, as theirs in a diagnosis.
PRODUCT_ALARMS = 0.01
# Products that are calibrated. Chosen, not measured: each costs a fit.
PRODUCTS_REFITTED = 2


def product_beside(
    search: SearchModel, listed: Fingerprints, law: LawInCase, refit: Refit, watch: Watch
) -> ProductFound | None:
    """The product that explains what a law leaves; None if none is needed.

    search: without the law; listed: fingerprints of what is listed there; refit: of the law.
    """
    watch(Progress("looking for what that law changes with"))
    case = with_effect(search.model.case, refit.candidate, refit.shapes)
    base = Baseline(replace(search.model, case=case), search.noise, refit.fitted, None, None)
    screening = screen_products(base, listed, law, refit.shapes.get("reference"))
    if screening is None or screening.p > PRODUCT_ALARMS or screening.kind.total < screening.others:
        return None
    evidence, full = screening.kind.log_evidence, screening.full.search
    of_each = [np.flatnonzero(screening.law_of == j) for j in range(len(screening.products))]
    best_columns = [int(columns[np.argmax(evidence[columns])]) for columns in of_each]
    columns = sorted(best_columns, key=lambda column: -evidence[column])[:PRODUCTS_REFITTED]
    trials = []
    for column in columns:
        one, shapes = screening.products[screening.law_of[column]].candidate, screening.settings[column]
        most = LARGEST_GAIN * one.amplitude.scale
        gain = float(np.clip(float(screening.kind.gain[column]), -most, most))
        trials.append(RefitTrial(one, shapes, (start_with(full.model.case, one, shapes, full.point.z, gain),)))
    refits = refits_of(full, trials, watch)
    ends = [(column, one) for column, one in zip(columns, refits, strict=True) if one is not None]
    if not ends:
        return None
    prior = screening.kind.log_prior
    column, best = max(ends, key=lambda end: end[1].log_factor + prior[end[0]])
    total = screening.kind.total + best.log_factor + prior[column] - evidence[column]
    chance = float(chances_in_set(np.array([total, screening.others, 0.0]))[0])
    if chance < 0.5:
        return None
    one = screening.products[screening.law_of[column]]
    found = LawFound(
        law=one.law,
        same_as="",
        reference=best.shapes.get("reference"),
        scale=best.candidate.amplitude.scale,
        strength=best.amplitude,
        interval95=best.interval95,
        chance=chance,
        log_evidence=total,
        seen=one.seen,
        alike=screening.alike(column),
        first=best.shapes.get("first"),
    )
    theta = theta_at(full.model.case, best.fitted.point.z[:-1])
    return ProductFound(found, best, float(theta[refit.candidate.parameter][0]))


# Quantities of terms of which a law is calibrated at most; as many as listed effects in a diagnosis. Of the first two,
# which decide what is told, two forms are. Chosen, not measured: each costs a fit.
MOST_QUANTITIES, SEVERAL_FORMS, FORMS_REFITTED = 8, 2, 2
# Chance that the set of laws and other causes holds together [-].
HELD = 0.95


def discover_laws(model: Model, without: Sequence[str], watch: Watch) -> Discovery:
    """The shortest laws that explain what a calibrated model leaves; without: listed effects that do not compete.

    Errors: InputError when the model finds no flow, or a station has no standard error.
    """
    watch(Progress(with_compilation("calibrating the model as it is")))
    return laws_beyond(baseline(model), without, watch)


def laws_beyond(base: Baseline, without: Sequence[str], watch: Watch) -> Discovery:
    """The same of a model that is calibrated."""
    watch(Progress("looking for a law"))
    traces = law_fingerprints(base, tuple(without))
    if not traces.laws:
        return Discovery(1.0, 0, (), {})
    screening = screen_laws(base, traces)
    if screening.p > constants().false_alarm_rate:
        return Discovery(screening.p, len(screening.laws), (), {})
    known = _as_vague(screening, hypotheses_of(screening.listed, watch, screening.kind.total))
    laws = _laws(screening, max((one.log_evidence for one in known), default=-np.inf), watch)
    found = _discovery(screening, sorted([*known, *laws], key=lambda one: -one.log_evidence))
    return replace(found, product=_product(screening, found, watch))


def _as_vague(screening: LawScreening, found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """What is at a place, of no kind that others have seen in nature, as likely before as laws; all else as it is."""
    places = {one.term for one in screening.listed.fingerprints.places}
    less = np.log(constants().listed_over_laws)
    return [replace(one, log_evidence=one.log_evidence - less) if one.kind in places else one for one in found]


def _laws(screening: LawScreening, known: float, watch: Watch) -> list[Hypothesis]:
    """The most promising quantities, each with the best of its laws that were calibrated and the evidence of all its
    laws; known: ln evidence of the best of all else.
    """
    evidence = screening.kind.log_evidence
    columns = {said: _columns(screening, laws) for said, laws in screening.subjects.items()}
    promised = {said: float(np.logaddexp.reduce(evidence[some])) for said, some in columns.items()}
    ranked = sorted(promised, key=lambda said: -promised[said])[:MOST_QUANTITIES]
    top = max(promised[ranked[0]], known)
    ranked = [said for said in ranked if (top - promised[said]) / tempering(np.array(top)) < REACH]
    tried = [(said, law) for rank, said in enumerate(ranked) for law in _forms(screening, said, rank)]
    refits = refits_of(screening.listed.search, [_trial(screening, law) for _, law in tried], watch)
    found = []
    for said in ranked:
        kept = {law: refit for (of, law), refit in zip(tried, refits, strict=True) if of == said and refit is not None}
        if kept:
            found.append(_hypothesis(screening, columns[said], kept))
    return found


def _columns(screening: LawScreening, laws: Sequence[int]) -> np.ndarray:
    return np.concatenate([screening.columns[law] for law in laws])


def _forms(screening: LawScreening, said: tuple[str, str], rank: int) -> list[int]:
    """The laws of a quantity that are calibrated, the most promising first: more than one of the first quantities."""
    evidence, laws = screening.kind.log_evidence, screening.subjects[said]
    ranked = sorted(laws, key=lambda law: -evidence[screening.best_column(law)])
    return ranked[: FORMS_REFITTED if rank < SEVERAL_FORMS else 1]


def _trial(screening: LawScreening, law: int) -> RefitTrial:
    """A law at its best reference, from the best place and the size of its score."""
    search, one, shapes = screening.listed.search, screening.laws[law].candidate, screening.settings_of(law)
    start = start_with(search.model.case, one, shapes, search.point.z, screening.gain(law))
    return RefitTrial(one, shapes, (start,))


def _hypothesis(screening: LawScreening, columns: np.ndarray, kept: Mapping[int, Refit]) -> Hypothesis:
    """The best of the calibrated laws of a quantity, with the evidence of all its columns: as kept where calibrated,
    elsewhere to first order, corrected as that of the best one.
    """
    first, prior = screening.kind.log_evidence, screening.kind.log_prior
    ends = {screening.best_column(law): refit for law, refit in kept.items()}
    best = max(ends, key=lambda column: ends[column].log_factor + prior[column])
    evidence = first + (ends[best].log_factor + prior[best] - first[best])
    for column, refit in ends.items():
        evidence[column] = refit.log_factor + prior[column]
    return Hypothesis("law", ends[best].candidate.name, float(np.logaddexp.reduce(evidence[columns])), best, ends[best])


def _discovery(screening: LawScreening, ranked: Sequence[Hypothesis]) -> Discovery:
    """The causes that hold HELD of the chance together; none where all of them together say too little."""
    evidence = np.array([one.log_evidence for one in ranked])
    if np.logaddexp.reduce(evidence) < 0.0:
        return Discovery(screening.p, len(screening.laws), (), {})
    chances = chances_in_set(evidence)
    count = int(np.searchsorted(np.cumsum(chances), HELD)) + 1
    pairs = list(zip(ranked, chances, strict=True))[:count]
    laws = tuple(_law_found(screening, one, float(p)) for one, p in pairs if one.kind == "law")
    return Discovery(
        p=screening.p,
        tried=len(screening.laws),
        laws=laws,
        others={one.name: float(p) for one, p in pairs if one.kind != "law"},
        compared={one.name: one.log_evidence for one in ranked},
        likeliest=ranked[0].what if isinstance(ranked[0].what, Refit) else None,
    )


def _law_found(screening: LawScreening, one: Hypothesis, chance: float) -> LawFound:
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
        alike=_alike(screening, one, of_law.law),
    )


def _product(screening: LawScreening, found: Discovery, watch: Watch) -> ProductFound | None:
    """Of the best law with another quantity, where that law leaves a misfit."""
    best, refit = found.best, found.likeliest
    if best is None or best.same_as or refit is None:
        return None
    of_law = next(one for one in screening.laws if one.law.name == best.law.name)
    return product_beside(screening.listed.search, screening.listed.fingerprints, of_law, refit, watch)


def _alike(screening: LawScreening, one: Hypothesis, own: Law) -> tuple[str, ...]:
    """Names of listed effects, and of the nearest law of any other quantity, that leave the same trace as this law, the
    most alike first.
    """
    row = np.abs(screening.cosine[screening.of_listed + one.column])
    listed = screening.listed.fingerprints
    near = {of.name: float(row[some].max()) for of, some in zip(listed.candidates, listed.columns, strict=True)}
    for said, laws in screening.subjects.items():
        if said != own.subject:
            cosine = {law: float(row[screening.of_listed + screening.columns[law]].max()) for law in laws}
            nearest = max(laws, key=lambda law: cosine[law])
            near[screening.laws[nearest].candidate.name] = cosine[nearest]
    return tuple(name for name in sorted(near, key=lambda name: -near[name]) if near[name] > constants().alike_cosine)
