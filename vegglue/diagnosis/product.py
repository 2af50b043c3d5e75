"""Whether what a law does changes with another quantity: products of two g, where the best law leaves a misfit.

The law is in the model, calibrated. While errors alone leave as much for products, nothing is said; else the best of
them are calibrated, and one is told where it is likelier than all else that could explain what is left.
"""

from dataclasses import replace

import numpy as np

from vegglue.calibration.baseline import Baseline, SearchModel
from vegglue.calibration.candidates import with_effect
from vegglue.calibration.fingerprints import Fingerprints
from vegglue.calibration.law_screening import LARGEST_GAIN, ProductScreening, screen_products
from vegglue.calibration.laws_in_case import LawInCase
from vegglue.case.parameter_space import theta_at
from vegglue.diagnosis.chances import chances_in_set
from vegglue.diagnosis.discovered import LawFound, ProductFound
from vegglue.diagnosis.refits import Refit, RefitTrial, refits_of, start_with
from vegglue.progress import Progress, Watch

# How often errors alone sound the alarm of products [-]: it comes on top of that of laws, as theirs in a diagnosis.
PRODUCT_ALARMS = 0.01
# Products that are calibrated. Chosen, not measured: each costs a fit.
PRODUCTS_REFITTED = 2


def product_beside(
    search: SearchModel, listed: Fingerprints, law: LawInCase, refit: Refit, watch: Watch
) -> ProductFound | None:
    """The product that explains what a law leaves; None where none is needed.

    search: without the law; listed: fingerprints of what is listed there; refit: of the law.
    """
    watch(Progress("looking for what that law changes with"))
    case = with_effect(search.model.case, refit.candidate, refit.shapes)
    base = Baseline(replace(search.model, case=case), search.noise, refit.fitted, None, None)
    screening = screen_products(base, listed, law, refit.shapes.get("reference"))
    if screening is None or screening.p > PRODUCT_ALARMS or screening.kind.total < screening.others:
        return None
    columns = _best_columns(screening)
    refits = refits_of(screening.full.search, [_trial(screening, column) for column in columns], watch)
    ends = [(column, one) for column, one in zip(columns, refits, strict=True) if one is not None]
    if not ends:
        return None
    prior = screening.kind.log_prior
    column, best = max(ends, key=lambda end: end[1].log_factor + prior[end[0]])
    evidence = screening.kind.total + best.log_factor + prior[column] - screening.kind.log_evidence[column]
    chance = float(chances_in_set(np.array([evidence, screening.others, 0.0]))[0])
    if chance < 0.5:
        return None
    theta = theta_at(screening.full.search.model.case, best.fitted.point.z[:-1])
    strength = float(theta[refit.candidate.parameter][0])
    return ProductFound(_told(screening, column, best, chance, evidence), best, strength)


def _best_columns(screening: ProductScreening) -> list[int]:
    """Of the products with the most evidence, the best reference of each."""
    evidence = screening.kind.log_evidence
    best = [int(np.flatnonzero(screening.law_of == j)[np.argmax(evidence[screening.law_of == j])])
            for j in range(len(screening.products))]  # fmt: skip
    return sorted(best, key=lambda column: -evidence[column])[:PRODUCTS_REFITTED]


def _trial(screening: ProductScreening, column: int) -> RefitTrial:
    """A product from the best place and the size of its score."""
    one, shapes, search = _of(screening, column).candidate, screening.settings[column], screening.full.search
    gain = float(screening.kind.gain[column])
    most = LARGEST_GAIN * one.amplitude.scale
    start = start_with(search.model.case, one, shapes, search.point.z, float(np.clip(gain, -most, most)))
    return RefitTrial(one, shapes, (start,))


def _of(screening: ProductScreening, column: int) -> LawInCase:
    return screening.products[screening.law_of[column]]


def _told(screening: ProductScreening, column: int, best: Refit, chance: float, evidence: float) -> LawFound:
    one = _of(screening, column)
    return LawFound(
        law=one.law,
        same_as="",
        reference=best.shapes.get("reference"),
        scale=best.candidate.amplitude.scale,
        strength=best.amplitude,
        interval95=best.interval95,
        chance=chance,
        log_evidence=evidence,
        seen=one.seen,
        alike=screening.alike(column),
        first=best.shapes.get("first"),
    )
