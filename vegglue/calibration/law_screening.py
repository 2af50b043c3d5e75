"""Laws beside all that is screened: one score test for each, and an alarm of their own; then products of a law that is
in the model with other quantities of its term.

    k -> k exp(a g_1 + c g_1 g_2)

The errors' correlation is estimated with laws among what could be missing, else a law that is missing would pass for
correlated errors. Listed effects, places and instruments keep their kinds and chances. Products are tested at the flow
with the law; what else could explain what is left competes: a second law of any quantity, in any form, listed effects,
places and instruments. The listed ones have the fingerprints of the flow without the law, which costs nothing.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, SearchModel, search_model
from vegglue.calibration.candidates import cause_of
from vegglue.calibration.fingerprints import Fingerprints, fingerprints_of
from vegglue.calibration.laws_in_case import LawInCase, law_traces, laws_in_case, products_in_case
from vegglue.calibration.residual_screening import GROUPS, Screening, kind_of_listed, screen
from vegglue.calibration.score_test import HypothesisKind, Projected, alarm_p, cosines, family_of, kind_of_hypotheses
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

    def of_each(self, evidence: Array) -> np.ndarray:
        """ln evidence of each law, all its references together (law,) [-]; evidence: of each column (l,)."""
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
    found = known or fingerprints_of(search, half_width(base.model.site))
    kept = [j for j, one in enumerate(found.candidates) if one.effect.name not in without]
    columns = np.concatenate([np.zeros(0), *(found.columns[j] for j in kept)]).astype(int)
    listed = replace(
        found,
        candidates=[found.candidates[j] for j in kept],
        columns=_consecutive([found.columns[j].size for j in kept]),
        settings=[found.settings[c] for c in columns],
        amplitudes=[found.amplitudes[c] for c in columns],
        causes=[found.causes[c] for c in columns],
        values=found.values[:, columns],
    )
    laws = laws_in_case(search.model, search.point, [one.effect.name for one in listed.candidates])
    return LawFingerprints(listed, laws, _with_laws(listed, laws, search) if laws else listed)


def _consecutive(sizes: Sequence[int]) -> list[np.ndarray]:
    """Numbers of columns that stand one group after another, by group."""
    return [np.arange(*ends) for ends in pairwise(accumulate(sizes, initial=0))]


def screen_laws(base: Baseline, found: LawFingerprints, flagged: tuple[int, ...] = ()) -> LawScreening:
    """Score tests of a calibrated model with laws, one at least; flagged: readings that are excluded."""
    full, count = screen(base, flagged, found.every, LAW_SEED), len(found.listed.settings)
    columns = [numbers - count for numbers in found.every.columns[len(found.listed.candidates) :]]
    kind = _kind_of_laws(full, found.laws, columns, slice(count, None))
    return LawScreening(
        listed=_of_listed(full, found.listed),
        laws=found.laws,
        kind=kind,
        columns=columns,
        settings=found.every.settings[count:],
        p=alarm_p([kind], full.errors, LAW_SEED),
        cosine=cosines(full.projected),
    )


def _with_laws(listed: Fingerprints, laws: list[LawInCase], search: SearchModel) -> Fingerprints:
    """Fingerprints of listed effects, then of laws."""
    first, traces = len(listed.settings), law_traces(search.model, search.point)
    tried = [one.candidate.settings() for one in laws]
    pairs = [(one.candidate, shapes) for one, some in zip(laws, tried, strict=True) for shapes in some]
    values = np.hstack([traces.of(one.law, some) for one, some in zip(laws, tried, strict=True)])
    return replace(
        listed,
        candidates=[*listed.candidates, *(one.candidate for one in laws)],
        columns=[*listed.columns, *(first + some for some in _consecutive([len(some) for some in tried]))],
        settings=[*listed.settings, *(shapes for _, shapes in pairs)],
        amplitudes=[*listed.amplitudes, *(one.amplitude for one, _ in pairs)],
        causes=[*listed.causes, *(cause_of(search.model.case, one, shapes) for one, shapes in pairs)],
        values=np.hstack([listed.values, values]),
    )


def _part(projected: Projected, columns: slice) -> Projected:
    return replace(
        projected,
        fingerprints=projected.fingerprints[:, columns],
        length=projected.length[columns],
        visible=projected.visible[columns],
    )


def _kind_of_laws(
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


def _of_listed(full: Screening, listed: Fingerprints) -> Screening:
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
        least = constants().alike_cosine
        return tuple(name for name in sorted(near, key=lambda name: -near[name]) if near[name] > least)


def screen_products(
    base: Baseline, listed: Fingerprints, law: LawInCase, reference: float | None
) -> ProductScreening | None:
    """Of a model calibrated with a law; listed: fingerprints of what is listed; reference: of the law, if it has one.

    None if the data have seen too little of every other quantity.
    """
    search = search_model(base)
    products = products_in_case(search.model, search.point, law, reference)
    if not products:
        return None
    singles = laws_in_case(search.model, search.point, [one.effect.name for one in listed.candidates])
    every = _with_laws(listed, [*singles, *products], search)
    full, first = screen(base, (), every, LAW_SEED), len(listed.settings)
    of_singles, of_products = (
        _consecutive([len(one.candidate.settings()) for one in some]) for some in (singles, products)
    )
    middle = first + sum(some.size for some in of_singles)
    kind = _kind_of_laws(full, products, of_products, slice(middle, None))
    single = _kind_of_laws(full, singles, of_singles, slice(first, middle))
    # Something at a place is as vague as a law.
    without, places = _of_listed(full, listed), {one.term for one in listed.places}
    totals = [one.total - np.log(constants().listed_over_laws) * (one.name in places) for one in without.kinds]
    return ProductScreening(
        full=full,
        products=products,
        kind=kind,
        law_of=np.repeat(np.arange(len(products)), [some.size for some in of_products]),
        settings=every.settings[middle:],
        others=float(np.logaddexp.reduce([*totals, single.total])),
        p=alarm_p([kind], full.errors, LAW_SEED),
    )
