"""Laws of the grammar in a case: what each has to act on, its fingerprint, and a score test of it beside all that is
screened; then products of a law that is in the model with other quantities of its term.

A law is measured by what its term has seen: the quantity in the cells of the term that lie under water at the measured
sections, at the calibrated flow; in all cells of the term under water if hardly any lie there, for what is beside a
section shows in it too. Of these the references and the range of validity are quantiles.

    d prediction_n / d a = sum_cells  d prediction_n / d ln k  g share,   the same with ln nu and ln h U U

Terms of the grammar are multiplied by exp(a g), and g at the flow of the point gives how much in each cell: one product
for a law, and no flow. So a form may be tried at many references for nothing.

    k -> k exp(a g_1 + c g_1 g_2)

The errors' correlation is estimated with laws among what could be missing, else a law that is missing would pass for
correlated errors. Listed effects, places and instruments keep their kinds and chances. Products are tested at the flow
with the law; what else could explain what is left competes: a second law of any quantity, in any form, listed effects,
places and instruments. The listed ones have the fingerprints of the flow without the law, which costs nothing.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, SearchModel, search_model
from vegglue.calibration.candidates import Candidate, cause_of
from vegglue.calibration.fingerprints import LEAST_DEPTH, Fingerprints, consecutive_columns, fingerprints_of
from vegglue.calibration.model_error import CellResponses, cell_responses
from vegglue.calibration.residual_screening import GROUPS, Screening, kind_of_listed, screen
from vegglue.calibration.score_test import HypothesisKind, Projected, alarm_p, cosines, family_of, kind_of_hypotheses
from vegglue.case.case_effects import effect_of
from vegglue.case.channel_geometry import channel_geometry, half_width
from vegglue.decision_constants import constants
from vegglue.effects.definition import Shape
from vegglue.effects.grammar import LAWS, PLAUSIBLE_STRENGTH, PRODUCTS, SAME_AS, Law
from vegglue.effects.surroundings import Cells
from vegglue.engine.interface import Model, Point, flow_at_centres, relinearised
from vegglue.flow.local_changes import Term
from vegglue.measurements.kinds import velocity_rows

# Quantiles between which a law counts as seen, and the fewest cells that show what a term sees. Chosen, not measured.
SEEN, FEWEST_SEEN = (0.05, 0.95), 10
# Fewest values of a quantity: of the stems of two patches a law means no more than that one of them is denser.
FEWEST_VALUES = 3
# Relative spread of a quantity, from the 5 to the 95 % quantile over the median, below which no law of it differs
# from a constant: a factor exp(a g) of plausible size then changes its term by less than 5 %, an error of friction.
LEAST_SPREAD = 0.1
# Values of a quantity over what was seen, enough to meet the top of a hump to a few per cent.
VALUES_SEEN = 41
# Significant digits of a reference: a person reads it.
DIGITS = 2
# Share of the cells above which a law is used beyond its range. A range holds 90 % of what was seen, so that a tenth
# lies outside by definition; twice that is another flow.
SHARE_BEYOND = 0.2
# What a law changes, relative to what is there, by the name of its term.
RELATIVE_TERM: Mapping[str, Term] = {
    "floor": "friction", "bank": "friction", "plants": "friction", "viscosity": "mixing", "advection": "advection",
}  # fmt: skip


@dataclass(frozen=True)
class LawInCase:
    """A law that has something to act on.

    Attributes
    ----------
    candidate : Candidate
        With the references that are tried.
    seen : (float, float)
        The values of its quantity from 5 to 95 % of what its term has seen [unit of the quantity].
    """

    law: Law
    candidate: Candidate
    seen: tuple[float, float]


def laws_in_case(model: Model, point: Point, listed: Sequence[str]) -> list[LawInCase]:
    """Laws that have something to act on.

    Parameters
    ----------
    point : Point
        Of the flow.
    listed : sequence of str
        Candidate effects; laws that restate one are left out, as are laws of the case.
    """
    water = _water_of(model, point)
    return [
        found
        for law in LAWS.values()
        if SAME_AS.get(law.name) not in listed and law.name not in model.case.effects
        if (found := _in_case(law, water)) is not None
    ]


def products_in_case(model: Model, point: Point, law: LawInCase, reference: float | None) -> list[LawInCase]:
    """Products of a law that is in the model with other quantities.

    Parameters
    ----------
    point : Point
        Of the flow.
    reference : float or None
        Of that law, if it has one [unit of its quantity].
    """
    water, change = _water_of(model, point), _change_of(law.law, law.seen, reference)
    products = [_in_case(product, water, reference, change) for product in PRODUCTS[law.law.name]]
    return [product for product in products if product is not None]


# The flow of each experiment, twice: in all cells, and dry but for the sections that were measured.
_Water = tuple[list[Cells], list[Cells]]


def _water_of(model: Model, point: Point) -> _Water:
    flows = {name: _centre_cells(model, point, name) for name in model.case.experiments}
    return list(flows.values()), [at_sections(model, cells, name) for name, cells in flows.items()]


def _in_case(law: Law, water: _Water, first: float | None = None, change: float = 1.0) -> LawInCase | None:
    """A law with its references and a plausible strength; None if the data have seen too little of its quantity.

    first, change: reference of the law that it multiplies, and how much the g of that law changes over what was seen.
    """

    def values_in(flows: list[Cells]) -> Array:
        """The quantity in the cells of the term that are under water, where it is finite."""
        parts = []
        for cells in flows:
            q = np.broadcast_to(law.quantity.of(cells), cells.depth.shape)
            share = np.broadcast_to(law.term.share(cells), cells.depth.shape)
            found = q[(share > 0.0) & (cells.depth > LEAST_DEPTH * cells.geometry.depth_scale)]
            parts.append(found[np.isfinite(found)])
        return np.concatenate(parts)

    def with_references(shape: Shape) -> Shape:
        if shape.name == "reference":
            return replace(shape, default=tried[len(tried) // 2], grid=tuple(tried), of="")
        return shape if first is None else replace(shape, default=first, of="")

    everywhere, measured = water
    values = values_in(measured)
    if values.size < FEWEST_SEEN:
        values = values_in(everywhere)
    if values.size < FEWEST_SEEN or np.unique(values).size < FEWEST_VALUES:
        return None
    low, middle, high = (float(q) for q in np.quantile(values, (SEEN[0], 0.5, SEEN[1])))
    if high - low < LEAST_SPREAD * abs(middle):
        return None
    tried = sorted({float(f"{value:.{DIGITS}g}") for value in np.quantile(values, law.form.quantiles)})
    if 0.0 in tried:  # on an odd number of cells across the floor a tenth or more lies on the axis: there is no q / 0
        with np.errstate(divide="ignore", invalid="ignore"):
            tried = [one for one in tried if one != 0.0 or np.isfinite(law.form.of(np.array([low, high]), one)).all()]
        if not tried:
            return None
    effect = replace(law.effect, shapes=tuple(map(with_references, law.shapes)))
    default = next((shape.default for shape in effect.shapes if shape.name == "reference"), None)
    whole = max(change * _change_of(law, (low, high), default), 1e-9)
    scale = min(PLAUSIBLE_STRENGTH / whole, 0.5 * effect.amplitude.high)
    return LawInCase(law, Candidate(effect, scale=scale), (low, high))


def _change_of(law: Law, seen: tuple[float, float], reference: float | None) -> float:
    """How much g changes over what was seen [-]. A strength a is plausible if a times that is PLAUSIBLE_STRENGTH.

    So all laws are as free to change what the data see, however g is counted; at most half way to the support's end.
    """
    return float(np.ptp(law.form.of(np.linspace(*seen, VALUES_SEEN), 1.0 if reference is None else reference)))


def _centre_cells(model: Model, point: Point, experiment: str) -> Cells:
    """The flow at cell centres of one experiment, with friction and viscosity of 1."""
    flow = flow_at_centres(model, point, experiment)
    geometry = channel_geometry(model.case, model.site, experiment)
    of_smallest = model.case.numerics.shear_depth == "smallest"
    depth, of_one = flow.depth[..., None], np.ones_like(flow.depth)[..., None]
    return Cells(
        geometry=geometry,
        depth=depth,
        level=depth + geometry.bed,
        u=flow.u[..., None],
        v=flow.v[..., None],
        rate=of_one,
        bed_rate=of_one,
        viscosity=of_one,
        shear_depth=np.minimum(depth[:, 1:], depth[:, :-1]) + 1e-9 if of_smallest else np.zeros((0, 0, 0)),
    )


def at_sections(model: Model, cells: Cells, experiment: str) -> Cells:
    """The same, dry but for the columns in which velocities were measured."""
    station, grid = model.stations[experiment], model.site.grid
    x = station["x"].to_numpy(float)[velocity_rows(station) & station["used"].to_numpy()]
    measured = np.zeros((grid.x.size, 1, 1), dtype=bool)
    measured[np.abs(grid.x[:, None] - x).argmin(axis=0)] = True
    return replace(cells, depth=np.where(measured, cells.depth, 0.0))


@dataclass(frozen=True)
class LawTraces:
    """What fingerprints of laws are made of.

    Attributes
    ----------
    responses : CellResponses
        Of all stations to each cell.
    flows : tuple of (ndarray of int, Cells)
        Of each experiment the rows of its stations, and its flow.
    """

    responses: CellResponses
    flows: tuple[tuple[Array, Cells], ...]

    def of(self, law: Law, settings: Sequence[Mapping[str, float]]) -> Array:
        """d prediction / d strength (station, setting) [m/s or m], at each value of the reference."""
        answers = self.responses.of[RELATIVE_TERM[law.term.name]]
        found = np.zeros((len(answers), len(settings)))
        for rows, cells in self.flows:
            share = law.term.share(cells)
            fields = [np.broadcast_to(law.g(cells, **one) * share, cells.depth.shape).ravel() for one in settings]
            of_cells = answers[rows].reshape(rows.size, answers[0].size)
            found[rows] = of_cells @ np.array(fields, dtype=np.float32).T
        return found


def law_traces(model: Model, point: Point) -> LawTraces:
    """Of a model at a point."""
    responses = cell_responses(model, relinearised(model, point), tuple(dict.fromkeys(RELATIVE_TERM.values())))
    flows = tuple((rows, _centre_cells(model, point, experiment)) for experiment, rows in model.rows.items())
    return LawTraces(responses, flows)


@dataclass(frozen=True)
class LawBeyondRange:
    """A law of the case that is used beyond the range in which it was found.

    Attributes
    ----------
    effect : str
        Its key.
    symbol, unit : str
        Of its quantity.
    low, high : float
        The range [unit].
    share : float
        Of the cells that it acts on [-].
    at_sections : bool
        Whether these are those under the measured sections; all, if none lie there.
    """

    effect: str
    symbol: str
    unit: str
    low: float
    high: float
    experiment: str
    share: float
    at_sections: bool


def laws_beyond_their_range(model: Model, point: Point) -> Iterator[LawBeyondRange]:
    """Laws with q < low or q > high in more than SHARE_BEYOND of the cells on which they act.

    Parameters
    ----------
    point : Point
        Of its flow.

    Yields
    ------
    LawBeyondRange
        One for each law and experiment.
    """
    for key in model.case.effects:
        effect, only = effect_of(model.case, key), model.case.effects[key].experiments
        seen = effect.seen
        if seen is None:
            continue
        shapes = {shape.name: np.array(shape.default) for shape in effect.shapes}
        strength = {effect.amplitude.name: np.array(effect.amplitude.scale)}
        for experiment in (one for one in model.case.experiments if only is None or one in only):
            everywhere = _centre_cells(model, point, experiment)
            found = []
            for cells in (at_sections(model, everywhere, experiment), everywhere):
                # Of a flux the part along x shows where it acts.
                changed = next(iter(effect.act(cells, **strength, **shapes).values()))
                off = 0.0 if effect.stage == "exchange" else cells.rate
                q = np.broadcast_to(seen.of(cells), cells.depth.shape)
                found.append(
                    q[(changed != off) & (cells.depth > LEAST_DEPTH * cells.geometry.depth_scale) & np.isfinite(q)]
                )
            measured = bool(found[0].size)
            q = found[0] if measured else found[1]
            share = float(np.mean((q < seen.low) | (q > seen.high))) if q.size else 0.0
            if share > SHARE_BEYOND:
                yield LawBeyondRange(key, seen.symbol, seen.unit, seen.low, seen.high, experiment, share, measured)


# Largest strength to first order, over the plausible one [-]: beyond, a flow may not be found.
LARGEST_GAIN = 3.0
LAW_SEED = 1  # of the draws of errors alone, as in `screen`


@dataclass(frozen=True)
class LawScreening:
    """Score tests of laws beside all that is listed.

    Attributes
    ----------
    listed : Screening
        Without laws.
    kind : HypothesisKind
        Their score tests, of l columns.
    columns : list of ndarray of int
        Of each law, in `kind`.
    settings : list of dict of float
        Shapes of each column [unit of each].
    p : float
        Chance that errors alone make laws stand out as much [-].
    cosine : ndarray (c + l, c + l)
        Between the projected fingerprints of all columns, listed effects first [-].
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

    def alike(self, column: int, law: Law) -> tuple[str, ...]:
        """Names of what leaves the same trace as a column of a law, the most alike first: listed effects, and the
        nearest law of any other quantity.
        """
        row, listed = np.abs(self.cosine[self.of_listed + column]), self.listed.fingerprints
        near = {one.name: float(row[some].max()) for one, some in zip(listed.candidates, listed.columns, strict=True)}
        for subject, laws in self.subjects.items():
            if subject != law.subject:
                cosine = {other: float(row[self.of_listed + self.columns[other]].max()) for other in laws}
                nearest = max(laws, key=lambda other: cosine[other])
                near[self.laws[nearest].candidate.name] = cosine[nearest]
        return _most_alike(near)

    @property
    def of_listed(self) -> int:
        """The number of columns of listed effects."""
        return len(self.listed.fingerprints.settings)


@dataclass(frozen=True)
class LawFingerprints:
    """Fingerprints of what is listed and of the laws of a case.

    Attributes
    ----------
    every : Fingerprints
        Of both, listed effects first.
    """

    listed: Fingerprints
    laws: list[LawInCase]
    every: Fingerprints


def law_fingerprints(
    base: Baseline, without: tuple[str, ...] = (), known: Fingerprints | None = None
) -> LawFingerprints:
    """Fingerprints of what is listed and of the laws of a case.

    Parameters
    ----------
    without : tuple of str
        Listed effects that are left out.
    known : Fingerprints, optional
        Of what is listed.
    """
    search = search_model(base)
    found = known or fingerprints_of(search, half_width(base.model.site))
    kept = [j for j, one in enumerate(found.candidates) if one.effect.name not in without]
    columns = np.concatenate([np.zeros(0), *(found.columns[j] for j in kept)]).astype(int)
    listed = replace(
        found,
        candidates=[found.candidates[j] for j in kept],
        columns=consecutive_columns([found.columns[j].size for j in kept]),
        settings=[found.settings[c] for c in columns],
        amplitudes=[found.amplitudes[c] for c in columns],
        causes=[found.causes[c] for c in columns],
        values=found.values[:, columns],
    )
    laws = laws_in_case(search.model, search.point, [one.effect.name for one in listed.candidates])
    return LawFingerprints(listed, laws, _with_laws(listed, laws, search) if laws else listed)


def screen_laws(base: Baseline, found: LawFingerprints, flagged: tuple[int, ...] = ()) -> LawScreening:
    """Score tests of a calibrated model with laws beside all that is listed.

    Parameters
    ----------
    found : LawFingerprints
        With one law at least.
    flagged : tuple of int
        Readings that are excluded, indices of used stations.
    """
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
        columns=[*listed.columns, *(first + some for some in consecutive_columns([len(some) for some in tried]))],
        settings=[*listed.settings, *(shapes for _, shapes in pairs)],
        amplitudes=[*listed.amplitudes, *(one.amplitude for one, _ in pairs)],
        causes=[*listed.causes, *(cause_of(search.model.case, one, shapes) for one, shapes in pairs)],
        values=np.hstack([listed.values, values]),
    )


def _columns_of(projected: Projected, columns: slice) -> Projected:
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
    return kind_of_hypotheses("law", _columns_of(full.projected, part), plausible, prior)


def _of_listed(full: Screening, listed: Fingerprints) -> Screening:
    """The screening of the listed effects alone, with the noise that was estimated with laws."""
    count, projected = len(listed.settings), _columns_of(full.projected, slice(len(listed.settings)))
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
    """Score tests of products of a law that is in the model.

    Attributes
    ----------
    full : Screening
        Of listed effects, of single laws and of products, in this order.
    kind : HypothesisKind
        Score tests of the products.
    law_of : ndarray of int
        Product of each column of `kind`.
    settings : list of dict of float
        Shapes of each of these columns [unit of each].
    others : float
        ln evidence of all else together [-].
    p : float
        Chance that errors alone make products stand out as much [-].
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
        return _most_alike(near)


def _most_alike(near: Mapping[str, float]) -> tuple[str, ...]:
    """Names that the data cannot separate from one, the most alike first; near: |cosine| with each [-]."""
    ranked = sorted(near, key=lambda name: -near[name])
    return tuple(name for name in ranked if near[name] > constants().alike_cosine)


def first_order_gain(kind: HypothesisKind, column: int, law: LawInCase) -> float:
    """g of a law by one of its columns, within LARGEST_GAIN plausible ones.

    Returns
    -------
    float
        [-]
    """
    most = LARGEST_GAIN * law.candidate.amplitude.scale
    return float(np.clip(kind.gain[column], -most, most))


def screen_products(
    base: Baseline, listed: Fingerprints, law: LawInCase, reference: float | None
) -> ProductScreening | None:
    """Score tests of products of a law that is in the model with other quantities of its term.

    Parameters
    ----------
    base : Baseline
        Calibrated with the law.
    listed : Fingerprints
        Of what is listed.
    reference : float or None
        Of the law, if it has one [unit of its quantity].

    Returns
    -------
    ProductScreening or None
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
        consecutive_columns([len(one.candidate.settings()) for one in some]) for some in (singles, products)
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
