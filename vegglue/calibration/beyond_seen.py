"""Laws where nobody has seen them: experiments in which a discovered law is used beyond the range it was found in."""

from collections.abc import Iterator

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.laws_in_case import at_sections, centre_cells
from vegglue.calibration.places import LEAST_DEPTH
from vegglue.case.case_effects import effect_of
from vegglue.effects.definition import Effect, SeenRange
from vegglue.effects.surroundings import Cells
from vegglue.engine.interface import Model, Point

# Share of the cells above which a law is said to be used beyond its range. A range holds 90 % of what was seen, so that
# a tenth lies outside by definition; twice that is another flow.
SHARE_BEYOND = 0.2


def laws_beyond_their_range(model: Model, point: Point) -> Iterator[str]:
    """One sentence for each experiment in which a law of the case is used where it was not seen; point: of its flow."""
    for key in model.case.effects:
        effect, only = effect_of(model.case, key), model.case.effects[key].experiments
        if effect.seen is None:
            continue
        for experiment in (one for one in model.case.experiments if only is None or one in only):
            cells = centre_cells(model, point, experiment)
            measured = at_sections(model, cells, experiment)
            at_stations = _values(effect, effect.seen, measured)
            q = at_stations if at_stations.size else _values(effect, effect.seen, cells)
            beyond = float(np.mean((q < effect.seen.low) | (q > effect.seen.high))) if q.size else 0.0
            if beyond > SHARE_BEYOND:
                where = "under its measured sections" if at_stations.size else "under water"
                yield _sentence(key, effect.seen, experiment, beyond, where)


def _sentence(key: str, seen: SeenRange, experiment: str, beyond: float, where: str) -> str:
    unit = "" if seen.unit == "-" else f" {seen.unit}"
    return (
        f"`{key}` was seen for {seen.symbol} from {seen.low:g} to {seen.high:g}{unit}; in experiment `{experiment}` "
        f"{beyond:.0%} of the cells that it acts on {where} lie outside, where it is a guess."
    )


def _values(effect: Effect, seen: SeenRange, cells: Cells) -> Array:
    """The quantity (k,) of the cells under water that the effect changes."""
    shapes = {shape.name: np.array(shape.default) for shape in effect.shapes}
    # Of a flux the part along x says where it acts.
    strength = {effect.amplitude.name: np.array(effect.amplitude.scale)}
    changed = next(iter(effect.act(cells, **strength, **shapes).values()))
    off = 0.0 if effect.stage == "exchange" else cells.rate
    q = np.broadcast_to(seen.of(cells), cells.depth.shape)
    return np.asarray(q[(changed != off) & (cells.depth > LEAST_DEPTH) & np.isfinite(q)])
