"""Products of a law that is in the model with other quantities of its term, beside all else that may be missing yet.

    k -> k exp(a g_1 + c g_1 g_2)

One score test for each product at the flow with the law, and an alarm of their own. What else could explain what is
left competes: a second law of any quantity, in any form, listed effects, places and instruments. The listed ones have
the fingerprints of the flow without the law, which costs nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np

from vegglue.calibration import score_test
from vegglue.calibration.baseline import Baseline, search_model
from vegglue.calibration.evidence import HypothesisKind, alarm_p
from vegglue.calibration.fingerprints import Fingerprints
from vegglue.calibration.law_screening import LAW_SEED, LISTED_ODDS, kind_of_laws, of_listed, with_laws
from vegglue.calibration.laws_in_case import LawInCase, laws_in_case, products_in_case
from vegglue.calibration.residual_screening import Screening, screen


@dataclass(frozen=True)
class ProductScreening:
    """full: the screening of all columns, of listed effects, of single laws and of products, in this order; kind: the
    products; law_of, settings: of each of its columns; others: ln evidence of all else together [-]; p: chance that
    errors alone make products stand out as much.
    """

    full: Screening
    products: list[LawInCase]
    kind: HypothesisKind
    law_of: np.ndarray
    settings: list[dict[str, float]]
    others: float
    p: float

    def alike(self, column: int) -> tuple[str, ...]:
        """Names of all but products that leave the same trace as a column of products, the most alike first."""
        found, count = self.full.fingerprints, self.kind.scores.size
        cosine = np.abs(self.full.projected.units.T @ self.kind.projected.units[:, column])[:-count]
        near = {
            one.name: float(cosine[some].max())
            for one, some in zip(found.candidates, found.columns, strict=True)
            if some.max(initial=0) < cosine.size
        }
        return tuple(name for name in sorted(near, key=lambda name: -near[name]) if near[name] > score_test.ALIKE)


def screen_products(
    base: Baseline, listed: Fingerprints, law: LawInCase, reference: float | None
) -> ProductScreening | None:
    """Of a model calibrated with a law; listed: fingerprints of what is listed; reference: of the law, if it has one.

    None where the data have seen too little of every other quantity.
    """
    search = search_model(base)
    products = products_in_case(search.model, search.point, law, reference)
    if not products:
        return None
    singles = laws_in_case(search.model, search.point, [one.effect.name for one in listed.candidates])
    every = with_laws(listed, [*singles, *products], search)
    full, first = screen(base, (), every, LAW_SEED), len(listed.settings)
    middle = first + sum(len(one.candidate.settings()) for one in singles)
    kind = kind_of_laws(full, products, _columns(products), slice(middle, None))
    single = kind_of_laws(full, singles, _columns(singles), slice(first, middle))
    return ProductScreening(
        full=full,
        products=products,
        kind=kind,
        law_of=np.repeat(np.arange(len(products)), [some.size for some in _columns(products)]),
        settings=every.settings[middle:],
        others=_all_else(of_listed(full, listed), single),
        p=alarm_p([kind], full.errors, LAW_SEED),
    )


def _columns(laws: Sequence[LawInCase]) -> list[np.ndarray]:
    """The columns of each law where only these stand."""
    ends = accumulate((len(one.candidate.settings()) for one in laws), initial=0)
    return [np.arange(*pair) for pair in pairwise(ends)]


def _all_else(listed: Screening, laws: HypothesisKind) -> float:
    """ln evidence of all that is no product; something at a place is as vague as a law."""
    places = {one.term for one in listed.fingerprints.places}
    totals = [kind.total - np.log(LISTED_ODDS) * (kind.name in places) for kind in listed.kinds]
    return float(np.logaddexp.reduce([*totals, laws.total]))
