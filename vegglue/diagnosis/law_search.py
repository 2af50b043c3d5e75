"""From the misfit of a calibrated model to a law: laws of the grammar in one competition with all that is listed.

The model is calibrated and screened as for a diagnosis. While errors alone leave as much for laws, nothing is said.
Else the most promising laws are calibrated with the model and ranked by their evidence beside listed effects, places
and instruments, which are as likely before as in a diagnosis; all laws together are a tenth as likely as all listed
effects (`law_screening`), and so is something at a place, which is as vague. A law that is best is looked at again for
products with another quantity (`product`).

Products: the best law is in the model, calibrated. While errors alone leave as much for products, none is reported;
else the best of them are calibrated, and one is reported if it is likelier than all else that could explain what is
left.

A law is written as an effect file to read, rename and keep, as of docs/own_effect.md. A case names one such file: if it
has one of its own, the law is written below what stands there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, SearchModel, baseline
from vegglue.calibration.candidates import start_with, with_effect
from vegglue.calibration.fingerprints import Fingerprints
from vegglue.calibration.law_screening import (
    VALUES_SEEN,
    LawInCase,
    LawScreening,
    ProductScreening,
    first_order_gain,
    law_fingerprints,
    screen_laws,
    screen_products,
)
from vegglue.calibration.residual_screening import refit_start
from vegglue.case.parameter_space import theta_at
from vegglue.decision_constants import constants
from vegglue.diagnosis.competition import REACH, Hypothesis, hypotheses_of
from vegglue.diagnosis.odds import chances_in_set, tempering
from vegglue.diagnosis.refits import Refit, RefitTrial, refits_of
from vegglue.effects.grammar import SAME_AS, Law, signed
from vegglue.effects.library import library
from vegglue.engine.interface import Model
from vegglue.engine.model import with_compilation
from vegglue.errors import InputError
from vegglue.progress import Progress, Watch
from vegglue.wording.numbers import in_short
from vegglue.wording.phases import CALIBRATING, SEARCHING_SECOND
from vegglue.wording.sentences import file_text, phrase, sentence


@dataclass(frozen=True)
class LawFound:
    """A law, term -> term exp(a g(quantity)), that the data know.

    Attributes
    ----------
    same_as : str
        The listed effect that it restates, '' for none.
    reference, first : float or None
        r of its quantity, and of that of the law that a product multiplies [unit of the quantity]; None without one.
    scale, strength : float
        A plausible a, and the calibrated one [-].
    interval95 : (float, float)
        Of the strength [-].
    chance : float
        That its term changes with its quantity, in whatever form [-]; the law is the form that explains most.
    log_evidence : float
        ln evidence [-].
    seen : (float, float)
        From where to where the data have seen its quantity [its unit].
    alike : tuple of str
        Listed effects and laws that leave the same trace at the stations.
    """

    law: Law
    same_as: str
    reference: float | None
    scale: float
    strength: float
    interval95: tuple[float, float]
    chance: float
    log_evidence: float
    seen: tuple[float, float]
    alike: tuple[str, ...]
    first: float | None = None

    @property
    def name(self) -> str:
        """Of the listed effect, where the law only restates it."""
        return self.same_as or self.law.name

    @property
    def unit(self) -> str:
        """Of its quantity, with a space before it; nothing for a pure number."""
        return self.law.quantity.unit_behind

    @property
    def equation(self) -> str:
        """With the references in it, the strength as a letter."""
        return self.law.equation(self.reference, self.first)

    @property
    def factor(self) -> float:
        """By what the term is larger where it differs most, over what was seen, than at the lower end of that [-]."""
        g = self.law.form.of(np.linspace(*self.seen, VALUES_SEEN), 1.0 if self.reference is None else self.reference)
        return float(np.exp(self.strength * (g - g[0])[np.abs(g - g[0]).argmax()]))

    @property
    def range_seen(self) -> str:
        """From where to where the data have seen its quantity."""
        return phrase("range_of_law", self)

    @property
    def lines(self) -> list[str]:
        """The law in words, as an equation, and how far to trust it."""
        parts = (phrase(f"{part}_of_law", self) for part in ("title", "strength", "reach", "rivals"))
        return [line for line in parts if line]


@dataclass(frozen=True)
class ProductFound:
    """A product of the best law with another quantity.

    Attributes
    ----------
    found : LawFound
        The product, reported as any law; its chance is that it is what is left, among all else that could be.
    refit : Refit
        Of it, beside the law.
    strength_of_law : float
        a of the law then [-].
    """

    found: LawFound
    refit: Refit
    strength_of_law: float

    @property
    def lines(self) -> list[str]:
        """As those of a law."""
        first, _, *further = self.found.lines
        return [first, phrase("strength_of_product", self), *further]


@dataclass(frozen=True)
class Discovery:
    """What a search among all laws found.

    Attributes
    ----------
    p : float
        Chance that errors alone make laws stand out as much [-].
    tried : int
        Number of laws that had something to act on.
    laws : tuple of LawFound
        The best first; none if nothing is found.
    others : dict of float
        Chances of other causes by name [-]; they and the laws hold 95 % together.
    compared : mapping of float
        ln evidence of all that was calibrated, by name [-].
    likeliest : Refit or None
        The likeliest of these, where it is in the model and not in the data.
    product : ProductFound or None
        Of the best law with another quantity, where that law leaves a misfit.
    """

    p: float
    tried: int
    laws: tuple[LawFound, ...]
    others: dict[str, float]
    compared: Mapping[str, float] = field(default_factory=dict)
    likeliest: Refit | None = None
    product: ProductFound | None = None

    @property
    def best(self) -> LawFound | None:
        """The law that is likelier than any other cause, if there is one."""
        if not self.laws or any(chance > self.laws[0].chance for chance in self.others.values()):
            return None
        return self.laws[0]

    @property
    def alarmed(self) -> bool:
        """Whether errors alone leave as much no more often than the rate of an alarm."""
        return self.p <= constants().false_alarm_rate

    @property
    def likeliest_other(self) -> tuple[str, float] | None:
        """The likeliest other cause with its chance, if there is one."""
        return max(self.others.items(), key=lambda pair: pair[1], default=None)

    @property
    def sentence(self) -> str:
        """What was found, in one sentence."""
        return sentence(self)

    def __repr__(self) -> str:
        return in_short(f"Discovery: {self.sentence}", self.lines)

    @property
    def written(self) -> tuple[LawFound, ...]:
        """What a child config holds: the best law and its product; none where it only restates a listed effect."""
        best = self.best
        if best is None or best.same_as:
            return ()
        return (best,) if self.product is None else (best, self.product.found)

    @property
    def ranked(self) -> list[list[str]]:
        """Lines of every law and other cause, the likeliest first; those of the product after its law."""
        pairs = [(law.chance, law.lines) for law in self.laws]
        pairs += [(chance, [phrase("other_cause", name, chance)]) for name, chance in self.others.items()]
        ranked = [lines for _, lines in sorted(pairs, key=lambda pair: -pair[0])]
        if self.product is not None:
            ranked.insert(1, self.product.lines)
        return ranked

    @property
    def lines(self) -> list[str]:
        """The same, one after the other."""
        return [line for lines in self.ranked for line in lines]


def effect_name(found: LawFound) -> str:
    """The name of a law as an effect of a user's own: bank_speed_step."""
    return found.law.name.removeprefix("law_")


def effect_text(laws: Sequence[LawFound], own: Path | None) -> str:
    """The file of a law, and of its product if it has one, as effects of a user's own.

    Parameters
    ----------
    own : Path or None
        The file of the case's own effects, which are kept.

    Raises
    ------
    InputError
        If that file has an effect of the same name already.
    """
    known = library(own)
    for name in map(effect_name, laws):
        if name in known:
            raise InputError(f"{own}: the effect `{name}` exists already; rename it there, then run discover again.")
    parts = []
    for found in laws:
        law = found.law
        g = _written(law, found.reference)
        if law.times is not None:
            g = f"({_written(law.times, found.first)}) * ({g})"
        change = law.term.change.format(factor=f"np.exp(strength * g{law.term.written})")
        parts.append({"name": effect_name(found), "found": found, "g": g, "change": change})
    before = "" if own is None else own.read_text(encoding="utf-8").rstrip() + "\n\n\n"
    return before + file_text("effects.py.j2", {"parts": parts, "own": own is not None})


def _written(law: Law, reference: float | None) -> str:
    """Its own g as code."""
    return law.form.written.format(q=law.quantity.written, r="" if reference is None else signed(reference))


# Products that are calibrated. Chosen, not measured: each costs a fit.
PRODUCTS_REFITTED = 2


def _trial(screening: LawScreening | ProductScreening, column: int, one: LawInCase, z: Array) -> RefitTrial:
    """The refit of a law at the shapes of a column, from the size that the screening gives it beside z (p,)."""
    start = start_with(one.candidate, z, first_order_gain(screening.kind, column, one))
    return RefitTrial(one.candidate, screening.settings[column], (start,))


def product_beside(
    search: SearchModel, listed: Fingerprints, law: LawInCase, refit: Refit, watch: Watch
) -> ProductFound | None:
    """The product of a law with another quantity that explains what the law leaves.

    Parameters
    ----------
    search : SearchModel
        Without the law.
    listed : Fingerprints
        Of what is listed there.
    refit : Refit
        Of the law.
    watch : callable
        Is called with each phase.

    Returns
    -------
    ProductFound or None
        None if errors alone leave as much, no flow is found, or the product is not likelier than all else together.
    """
    watch(Progress(SEARCHING_SECOND))
    case = with_effect(search.model.case, refit.candidate, refit.shapes)
    base = Baseline(replace(search.model, case=case), search.noise, refit.fitted, None, None)
    screening = screen_products(base, listed, law, refit.shapes.get("reference"))
    if screening is None or screening.p > constants().product_alarm_rate or screening.kind.total < screening.others:
        return None
    evidence, full = screening.kind.log_evidence, screening.full.search
    of_each = [np.flatnonzero(screening.law_of == j) for j in range(len(screening.products))]
    best_columns = [int(columns[np.argmax(evidence[columns])]) for columns in of_each]
    columns = sorted(best_columns, key=lambda column: -evidence[column])[:PRODUCTS_REFITTED]
    products = screening.products
    trials = [_trial(screening, column, products[screening.law_of[column]], full.point.z) for column in columns]
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
    found = _law_found(one, best, chance, total, screening.alike(column))
    theta = theta_at(full.model.case, best.fitted.point.z[:-1])
    return ProductFound(found, best, float(theta[refit.candidate.parameter][0]))


# Quantities of terms of which a law is calibrated at most; as many as listed effects in a diagnosis. Of the first two,
# which decide what is reported, two forms are. Chosen, not measured: each costs a fit.
MOST_QUANTITIES, SEVERAL_FORMS, FORMS_REFITTED = 8, 2, 2
# Chance that the set of laws and other causes holds together [-].
HELD = 0.95


def discover_laws(model: Model, without: Sequence[str], watch: Watch) -> Discovery:
    """The shortest laws that explain what a calibrated model leaves.

    Parameters
    ----------
    without : sequence of str
        Listed effects that do not compete.
    watch : callable
        Is called with each phase.

    Raises
    ------
    InputError
        If the model finds no flow, or a station has no standard error.
    """
    watch(Progress(with_compilation(CALIBRATING)))
    return laws_beyond(baseline(model), without, watch)


def laws_beyond(base: Baseline, without: Sequence[str], watch: Watch) -> Discovery:
    """The shortest laws that explain what a calibrated model leaves.

    Parameters
    ----------
    without : sequence of str
        Listed effects that do not compete.
    watch : callable
        Is called with each phase.

    Returns
    -------
    Discovery
        Without laws if errors alone leave as much, or if all causes together are less likely than none.
    """
    watch(Progress("looking for a law"))
    traces = law_fingerprints(base, tuple(without))
    if not traces.laws:
        return Discovery(1.0, 0, (), {})
    screening = screen_laws(base, traces)
    nothing = Discovery(screening.p, len(screening.laws), (), {})
    if screening.p > constants().false_alarm_rate:
        return nothing
    # What is at a place, of no kind that others have seen in nature, is as likely before as laws.
    places, less = {one.term for one in screening.listed.fingerprints.places}, np.log(constants().listed_over_laws)
    known = [
        replace(one, log_evidence=one.log_evidence - less) if one.kind in places else one
        for one in hypotheses_of(screening.listed, watch, screening.kind.total)
    ]
    laws, _ = refitted_laws(screening, max((one.log_evidence for one in known), default=-np.inf), watch)
    ranked = sorted([*known, *laws], key=lambda one: -one.log_evidence)
    evidence = np.array([one.log_evidence for one in ranked])
    if np.logaddexp.reduce(evidence) < 0.0:
        return nothing
    chances = chances_in_set(evidence)
    count = int(np.searchsorted(np.cumsum(chances), HELD)) + 1
    pairs = list(zip(ranked, chances, strict=True))[:count]
    tried, held = {one.candidate.name: one for one in screening.laws}, []
    for one, p in pairs:
        if isinstance(one.what, Refit) and one.kind == "law":
            law = tried[one.name]
            held.append(_law_found(law, one.what, float(p), one.log_evidence, screening.alike(one.column, law.law)))
    found = Discovery(
        p=screening.p,
        tried=len(screening.laws),
        laws=tuple(held),
        others={one.name: float(p) for one, p in pairs if one.kind != "law"},
        compared={one.name: one.log_evidence for one in ranked},
        likeliest=ranked[0].what if isinstance(ranked[0].what, Refit) else None,
    )
    best, refit = found.best, found.likeliest
    if best is None or best.same_as or refit is None:
        return found
    of_law = next(one for one in screening.laws if one.law.name == best.law.name)
    listed = screening.listed
    return replace(found, product=product_beside(listed.search, listed.fingerprints, of_law, refit, watch))


def refitted_laws(screening: LawScreening, known: float, watch: Watch) -> tuple[list[Hypothesis], Array]:
    """The most promising quantities, each with the best of its laws that were calibrated.

    Parameters
    ----------
    known : float
        ln evidence of the best of all else [-].
    watch : callable
        Is called with each refit.

    Returns
    -------
    list of Hypothesis
        Of each quantity, with the evidence of all its columns together.
    ndarray (l,)
        ln evidence of each column of the laws [-]: as refitted, else to first order, corrected as that of the best one
        of its quantity was; -inf of other quantities.
    """
    evidence, prior, search = screening.kind.log_evidence, screening.kind.log_prior, screening.listed.search
    columns = {
        subject: np.concatenate([screening.columns[law] for law in laws])
        for subject, laws in screening.subjects.items()
    }
    promised = {subject: float(np.logaddexp.reduce(evidence[some])) for subject, some in columns.items()}
    ranked = sorted(promised, key=lambda subject: -promised[subject])[:MOST_QUANTITIES]
    top = max(promised[ranked[0]], known)
    ranked = [subject for subject in ranked if (top - promised[subject]) / tempering(np.array(top)) < REACH]
    tried = []
    for rank, subject in enumerate(ranked):  # more than one form of the first quantities
        forms = sorted(screening.subjects[subject], key=lambda law: -evidence[screening.best_column(law)])
        tried += [(subject, law) for law in forms[: FORMS_REFITTED if rank < SEVERAL_FORMS else 1]]
    trials = [_trial(screening, screening.best_column(law), screening.laws[law], search.point.z) for _, law in tried]
    refits = refits_of(search, trials, watch)
    found, of_columns = [], np.full(evidence.size, -np.inf)
    for subject in ranked:
        ends = {
            screening.best_column(law): refit
            for (of, law), refit in zip(tried, refits, strict=True)
            if of == subject and refit is not None
        }
        if not ends:
            continue
        best = max(ends, key=lambda column: ends[column].log_factor + prior[column])
        corrected = evidence + (ends[best].log_factor + prior[best] - evidence[best])
        for column, refit in ends.items():
            corrected[column] = refit.log_factor + prior[column]
        of_columns[columns[subject]] = corrected[columns[subject]]
        total = float(np.logaddexp.reduce(corrected[columns[subject]]))
        found.append(Hypothesis("law", ends[best].candidate.name, total, best, ends[best]))
    return found, of_columns


def laws_beside_accepted(
    screening: LawScreening, accepted: Sequence[str], log_prior: float, known: float, watch: Watch
) -> tuple[list[Hypothesis], Array, float]:
    """`refitted_laws` beside what was accepted, whose ln evidence is the larger of two.

    It is `known`, with the errors as estimated beside it, or that of one listed effect refitted in the same model under
    the same errors: the known goes before the vague. Chosen after open-o, see DECISIONS.

    Parameters
    ----------
    accepted : sequence of str
        Names of listed effects.
    log_prior, known : float
        ln prior of the accepted effect, and ln evidence of the best of all but laws [-].

    Returns
    -------
    list of Hypothesis, ndarray (l,), float
        Those of `refitted_laws`, and ln evidence of what was accepted [-].
    """
    listed, names = screening.listed, [one.name for one in screening.listed.fingerprints.candidates]
    if len(accepted) == 1 and accepted[0] in names:
        j = names.index(accepted[0])
        column = listed.best_column(j)
        one, shapes = listed.fingerprints.candidates[j], listed.fingerprints.settings[column]
        (refit,) = refits_of(listed.search, [RefitTrial(one, shapes, (refit_start(listed, j, column),))], watch)
        known = known if refit is None else max(known, refit.log_factor + log_prior)
    return *refitted_laws(screening, known, watch), known


def _law_found(tried: LawInCase, refit: Refit, chance: float, log_evidence: float, alike: tuple[str, ...]) -> LawFound:
    """A law or a product as its refit has left it."""
    return LawFound(
        law=tried.law,
        same_as=SAME_AS.get(tried.law.name, ""),
        reference=refit.shapes.get("reference"),
        scale=refit.candidate.amplitude.scale,
        strength=refit.amplitude,
        interval95=refit.interval95,
        chance=chance,
        log_evidence=log_evidence,
        seen=tried.seen,
        alike=alike,
        first=refit.shapes.get("first"),
    )
