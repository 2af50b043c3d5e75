"""Laws of the grammar as candidates of a case: which of them have something to act on, with references from its flow,
and their fingerprints by the answers of predictions to each cell.

A law is measured by what its term has seen: the quantity in the cells of the term that lie under water at the measured
sections, at the calibrated flow; in all cells of the term under water if hardly any lie there, for what is beside a
section shows in it too. Of these the references and the range of validity are quantiles.

    d prediction_n / d a = sum_cells  d prediction_n / d ln k  g share,   the same with ln nu and ln h U U

Terms of the grammar are multiplied by exp(a g), and g at the flow of the point gives how much in each cell: one product
for a law, and no flow. So a form may be tried at many references for nothing.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.candidates import Candidate
from vegglue.calibration.fingerprints import LEAST_DEPTH
from vegglue.calibration.model_error import CellResponses, cell_responses
from vegglue.case.case_effects import effect_of
from vegglue.case.channel_geometry import channel_geometry
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
    """A law, its candidate with the references to be tried, and the values of its quantity from 5 to 95 % of what its
    term has seen [unit of the quantity].
    """

    law: Law
    candidate: Candidate
    seen: tuple[float, float]


def laws_in_case(model: Model, point: Point, listed: Sequence[str]) -> list[LawInCase]:
    """Laws that have something to act on, without those that restate a candidate effect that is `listed`."""
    water = _water_of(model, point)
    return [
        found
        for law in LAWS.values()
        if SAME_AS.get(law.name) not in listed and law.name not in model.case.effects
        if (found := _in_case(law, water)) is not None
    ]


def products_in_case(model: Model, point: Point, law: LawInCase, reference: float | None) -> list[LawInCase]:
    """Products of a law that is in the model with other quantities; reference: of that law, if it has one."""
    water, change = _water_of(model, point), _change_of(law.law, law.seen, reference)
    products = [_in_case(product, water, reference, change) for product in PRODUCTS[law.law.name]]
    return [product for product in products if product is not None]


# The flow of each experiment, twice: in all cells, and dry but for the sections that were measured.
_Water = tuple[list[Cells], list[Cells]]


def _water_of(model: Model, point: Point) -> _Water:
    flows = {name: centre_cells(model, point, name) for name in model.case.experiments}
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


def centre_cells(model: Model, point: Point, experiment: str) -> Cells:
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
    """Answers to each cell (station, nx, ny) by term, and the flow of each experiment with the rows of its stations."""

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
    flows = tuple((rows, centre_cells(model, point, experiment)) for experiment, rows in model.rows.items())
    return LawTraces(responses, flows)


@dataclass(frozen=True)
class LawBeyondRange:
    """A law of the case that is used beyond the range that it was found in [unit]; share: of the cells that it acts on
    [-], those under the measured sections if any lie there.
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
    """One for each experiment in which more than SHARE_BEYOND of the cells are beyond; point: of its flow."""
    for key in model.case.effects:
        effect, only = effect_of(model.case, key), model.case.effects[key].experiments
        seen = effect.seen
        if seen is None:
            continue
        shapes = {shape.name: np.array(shape.default) for shape in effect.shapes}
        strength = {effect.amplitude.name: np.array(effect.amplitude.scale)}
        for experiment in (one for one in model.case.experiments if only is None or one in only):
            everywhere = centre_cells(model, point, experiment)
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
