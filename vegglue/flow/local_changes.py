"""Terms of the equations changed by a field of their own: friction, drag, bed level, water that enters, viscosity,
momentum that the flow carries.

What a model has wrong at a place is such a change.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.active_effect import ActiveEffect
from vegglue.effects.definition import Amplitude, Effect
from vegglue.effects.exchange import dispersion
from vegglue.effects.surroundings import Cells, ChannelGeometry
from vegglue.flow.problem import Problem, take

# friction: k -> k (1 + a) [-]; drag: k -> k + a [1/m]; bed: z_b -> z_b + a [m]; inflow: a enters [m/s]; viscosity:
# nu -> nu + a [m2/s]; mixing: nu -> nu (1 + a) [-]; advection: h U U -> h U U (1 + a) [-].
Term = Literal["friction", "drag", "bed", "inflow", "viscosity", "mixing", "advection"]
TERMS: tuple[Term, ...] = ("friction", "drag", "bed", "inflow", "viscosity", "mixing", "advection")


def with_changed_term(problem: Problem, geometry: ChannelGeometry, term: Term, change: Array) -> Problem:
    """One member's problem as many: member m has a term changed by change[..., m], (nx, ny, m) [unit of the term]."""
    members = change.shape[2]
    many = take(problem, np.zeros(members, dtype=np.int64))
    if term == "bed":
        return replace(many, bed_rise=_sum(many.bed_rise, change))
    if term == "inflow":
        entering = _sum(many.boundaries.lateral_inflow, change)
        return replace(many, boundaries=replace(many.boundaries, lateral_inflow=entering))
    effect = ActiveEffect(_field_effect(term, geometry, change), {"on": np.ones(members)})
    return replace(many, effects=(*many.effects, effect), geometry=geometry)


def _sum(before: Array, change: Array) -> Array:
    return np.ascontiguousarray(before + change if before.size else change)


def _field_effect(term: Term, whole: ChannelGeometry, change: Array) -> Effect:
    """The field as an effect, which sees some columns and rows of the grid at a time."""

    def here(cells: Cells) -> Array:
        column = np.rint((cells.geometry.x[:, 0, 0] - whole.x[0, 0, 0]) / whole.dx).astype(int)
        row = np.rint((cells.geometry.y[0, :, 0] - whole.y[0, 0, 0]) / whole.dy).astype(int)
        return change[column][:, row]

    def friction(cells: Cells, on: Array) -> Mapping[str, Array]:
        return {"rate": cells.rate * (1.0 + on * here(cells))}

    def drag(cells: Cells, on: Array) -> Mapping[str, Array]:
        return {"rate": cells.rate + on * here(cells)}

    def viscosity(cells: Cells, on: Array) -> Mapping[str, Array]:
        return {"viscosity": on * here(cells)}

    def mixing(cells: Cells, on: Array) -> Mapping[str, Array]:
        return {"viscosity": on * here(cells) * cells.viscosity}

    def advection(cells: Cells, on: Array) -> Mapping[str, Array]:
        return dispersion(cells, on * here(cells))

    return Effect(
        name=f"field_of_{term}",
        stage="exchange" if term in ("viscosity", "mixing", "advection") else "resistance",
        title=f"A field of {term}",
        equation="term + field",
        act={
            "friction": friction,
            "drag": drag,
            "viscosity": viscosity,
            "mixing": mixing,
            "advection": advection,
        }[term],
        amplitude=Amplitude("on", "-", "0 or 1", 1.0, 0.0, 1.0),
        source="definition",
        checked=True,
    )
