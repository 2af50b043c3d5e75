"""Laws beside all that is screened: one score test for each, and an alarm of their own.

The errors' correlation is estimated with laws among what could be missing, else a law that is missing would pass for
correlated errors. Listed effects, places and instruments keep their kinds and chances.

Products of a law that is in the model with other quantities of its term, beside all else that may be missing yet.

    k -> k exp(a g_1 + c g_1 g_2)

One score test for each product at the flow with the law, and an alarm of their own. What else could explain what is
left competes: a second law of any quantity, in any form, listed effects, places and instruments. The listed ones have
the fingerprints of the flow without the law, which costs nothing.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise

import numpy as np

from vegglue.calibration import score_test
from vegglue.calibration.baseline import Baseline, SearchModel, search_model
from vegglue.calibration.candidates import cause_of
from vegglue.calibration.fingerprints import Fingerprints, fingerprints_of
from vegglue.calibration.laws_in_case import LawInCase, law_traces, laws_in_case, products_in_case
from vegglue.calibration.residual_screening import GROUPS, Screening, kind_of_listed, screen
from vegglue.calibration.score_test import HypothesisKind, alarm_p, family_of, kind_of_hypotheses
from vegglue.case.channel_geometry import half_width
from vegglue.decision_constants import constants

# Largest strength to first order, over the plausible one [-]: beyond, a flow may not be found.
LARGEST_GAIN = 3.0
LAW_SEED = 1  # of the draws of errors alone, as in `screen`


@dataclass(frozen=True)
class LawScreening:
    """listed: the screening without laws; laws, kind: the laws and their score tests; columns: of each law, in `kind`;
    settings: of each column; p: chance that errors alone make laws stand out as much; cosine (c + l, c + l): between
    the projected fingerprints of all columns, listed effects first.
    """

    listed: Screening
    laws: list[LawInCase]
    kind: HypothesisKind
    columns: list[np.ndarray]
    settings: list[dict[str, float]]
    p: float
    cosine: np.ndarray

    @property
    def of_each(self) -> np.ndarray:
        """ln evidence of each law, all its references together (law,) [-]."""
        evidence = self.kind.log_evidence
        return np.array([np.logaddexp.reduce(evidence[columns]) for columns in self.columns])

    @property
    def subjects(self) -> dict[tuple[str, str], list[int]]:
        """The laws of each quantity of each term, by their numbers."""
        found: dict[tuple[str, str], list[int]] = {}
        for j, one in enumerate(self.laws):
            found.setdefault(one.law.subject, []).append(j)
        return found

    def best_column(self, law: int) -> int:
        """Of the fingerprint of a law with the most evidence, in `kind`."""
        columns = self.columns[law]
        return int(columns[np.argmax(self.kind.log_evidence[columns])])

    def settings_of(self, law: int) -> dict[str, float]:
        """Of that fingerprint."""
        return self.settings[self.best_column(law)]

    def gain(self, law: int) -> float:
        """Its strength to first order, not beyond LARGEST_GAIN plausible ones [-]."""
        column, scale = self.best_column(law), self.laws[law].candidate.amplitude.scale
        return float(np.clip(self.kind.gain[column], -LARGEST_GAIN * scale, LARGEST_GAIN * scale))

    @property
    def of_listed(self) -> int:
        """The number of columns of listed effects."""
        return len(self.listed.fingerprints.settings)


@dataclass(frozen=True)
class LawFingerprints:
    """Fingerprints of what is listed, the laws of a case, and fingerprints of both, listed effects first."""

    listed: Fingerprints
    laws: list[LawInCase]
    every: Fingerprints


def law_fingerprints(
    base: Baseline, without: tuple[str, ...] = (), known: Fingerprints | None = None
) -> LawFingerprints:
    """Of a calibrated model; without: listed effects that are left out; known: fingerprints of what is listed."""
    search = search_model(base)
    listed = _left(known or fingerprints_of(search, half_width(base.model.site)), without)
    laws = laws_in_case(search.model, search.point, [one.effect.name for one in listed.candidates])
    return LawFingerprints(listed, laws, with_laws(listed, laws, search) if laws else listed)


def screen_laws(base: Baseline, found: LawFingerprints, flagged: tuple[int, ...] = ()) -> LawScreening:
    """Score tests of a calibrated model with laws, one at least; flagged: readings that were set aside."""
    listed, laws, every = found.listed, found.laws, found.every
    full = screen(base, flagged, every, LAW_SEED)
    count = len(listed.settings)
    columns = [numbers - count for numbers in every.columns[len(listed.candidates) :]]
    kind = kind_of_laws(full, laws, columns, slice(count, None))
    return LawScreening(
        listed=of_listed(full, listed),
        laws=laws,
        kind=kind,
        columns=columns,
        settings=every.settings[count:],
        p=alarm_p([kind], full.errors, LAW_SEED),
        cosine=score_test.cosines(full.projected),
    )


def _left(found: Fingerprints, without: tuple[str, ...]) -> Fingerprints:
    """Fingerprints but for those of some listed effects."""
    kept = [j for j, one in enumerate(found.candidates) if one.effect.name not in without]
    columns = np.concatenate([np.zeros(0), *(found.columns[j] for j in kept)]).astype(int)
    starts = np.cumsum([0, *(found.columns[j].size for j in kept)])
    return replace(
        found,
        candidates=[found.candidates[j] for j in kept],
        columns=[np.arange(first, last) for first, last in pairwise(starts)],
        settings=[found.settings[c] for c in columns],
        amplitudes=[found.amplitudes[c] for c in columns],
        causes=[found.causes[c] for c in columns],
        values=found.values[:, columns],
    )


def with_laws(listed: Fingerprints, laws: list[LawInCase], search: SearchModel) -> Fingerprints:
    """Fingerprints of listed effects, then of laws."""
    first = len(listed.settings)
    columns, settings, amplitudes, causes = list(listed.columns), list(listed.settings), list(listed.amplitudes), []
    for one in laws:
        tried = one.candidate.settings()
        columns.append(first + np.arange(len(tried)))
        settings += tried
        amplitudes += [one.candidate.amplitude] * len(tried)
        causes += [cause_of(search.model.case, one.candidate, shapes) for shapes in tried]
        first += len(tried)
    traces = law_traces(search.model, search.point)
    values = np.hstack([traces.of(one.law, one.candidate.settings()) for one in laws])
    return replace(
        listed,
        candidates=[*listed.candidates, *(one.candidate for one in laws)],
        columns=columns,
        settings=settings,
        amplitudes=amplitudes,
        causes=[*listed.causes, *causes],
        values=np.hstack([listed.values, values]),
    )


def _part(projected: score_test.Projected, columns: slice) -> score_test.Projected:
    return replace(
        projected,
        fingerprints=projected.fingerprints[:, columns],
        length=projected.length[columns],
        visible=projected.visible[columns],
    )


def kind_of_laws(
    full: Screening, laws: Sequence[LawInCase], columns: Sequence[np.ndarray], part: slice
) -> HypothesisKind:
    """All quantities of all terms are as likely before, all forms of one, and all references of a form.

    part: where the fingerprints of these laws stand in `full`; columns: of each law, in that part.
    """
    plausible = np.array([one.plausible_gain for one in full.fingerprints.amplitudes[part]])
    less = GROUPS * constants().listed_over_laws
    prior, forms = np.empty(plausible.size), Counter(one.law.subject for one in laws)
    for one, of_law in zip(laws, columns, strict=True):
        prior[of_law] = 1.0 / (less * len(forms) * forms[one.law.subject] * of_law.size)
    return kind_of_hypotheses("law", _part(full.projected, part), plausible, prior)


def of_listed(full: Screening, listed: Fingerprints) -> Screening:
    """The screening of the listed effects alone, with the noise that was estimated with laws."""
    count, projected = len(listed.settings), _part(full.projected, slice(len(listed.settings)))
    return replace(
        full,
        fingerprints=listed,
        whitened_fingerprints=full.whitened_fingerprints[:, :count],
        projected=projected,
        effects=family_of(projected, listed.only_sign, full.errors, LAW_SEED),
        kinds=(kind_of_listed(listed, projected), *full.kinds[1:]),
    )


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
        return tuple(
            name for name in sorted(near, key=lambda name: -near[name]) if near[name] > constants().alike_cosine
        )


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
    totals = [kind.total - np.log(constants().listed_over_laws) * (kind.name in places) for kind in listed.kinds]
    return float(np.logaddexp.reduce([*totals, laws.total]))
