"""Terms of the equations changed by a field of their own: friction, drag, bed level, water that enters, viscosity,
momentum that the flow carries.

What a model has wrong at a place is such a change.
"""

from dataclasses import replace
from typing import Literal

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.active_effect import ActiveEffect
from vegglue.effects.definition import Act, Amplitude, Effect
from vegglue.effects.exchange import dispersion
from vegglue.effects.surroundings import Cells, ChannelGeometry
from vegglue.flow.problem import Problem, take

# friction: k -> k (1 + a) [-]; drag: k -> k + a [1/m]; bed: z_b -> z_b + a [m]; inflow: a enters [m/s]; viscosity:
# nu -> nu + a [m2/s]; mixing: nu -> nu (1 + a) [-]; advection: h U U -> h U U (1 + a) [-].
Term = Literal["friction", "drag", "bed", "inflow", "viscosity", "mixing", "advection"]


def with_changed_term(problem: Problem, geometry: ChannelGeometry, term: Term, change: Array) -> Problem:
    """One member's problem as many, in each of which a term of the equations is changed by a field of its own.

    Parameters
    ----------
    problem, geometry
        Of one member, and what effects see of its channel.
    change
        (nx, ny, m) [unit of the term].

    Returns
    -------
    Problem
        Of m members.
    """
    members = change.shape[2]
    many = take(problem, np.zeros(members, dtype=np.int64))

    def added_to(before: Array) -> Array:
        return np.ascontiguousarray(before + change if before.size else change)

    if term == "bed":
        return replace(many, bed_rise=added_to(many.bed_rise))
    if term == "inflow":
        entering = added_to(many.boundaries.lateral_inflow)
        return replace(many, boundaries=replace(many.boundaries, lateral_inflow=entering))

    def here(cells: Cells, on: Array) -> Array:
        """The field in the columns and rows that an effect sees at a time."""
        column = np.rint((cells.geometry.x[:, 0, 0] - geometry.x[0, 0, 0]) / geometry.dx).astype(int)
        row = np.rint((cells.geometry.y[0, :, 0] - geometry.y[0, 0, 0]) / geometry.dy).astype(int)
        return on * change[column][:, row]

    acts: dict[Term, Act] = {
        "friction": lambda cells, on: {"rate": cells.rate * (1.0 + here(cells, on))},
        "drag": lambda cells, on: {"rate": cells.rate + here(cells, on)},
        "viscosity": lambda cells, on: {"viscosity": here(cells, on)},
        "mixing": lambda cells, on: {"viscosity": here(cells, on) * cells.viscosity},
        "advection": lambda cells, on: dispersion(cells, here(cells, on)),
    }
    field = Effect(
        name=f"field_of_{term}",
        stage="exchange" if term in ("viscosity", "mixing", "advection") else "resistance",
        title=f"A field of {term}",
        equation="term + field",
        act=acts[term],
        amplitude=Amplitude("on", "-", "0 or 1", 1.0, 0.0, 1.0),
        source="definition",
        checked=True,
    )
    effect = ActiveEffect(field, {"on": np.ones(members)})
    return replace(many, effects=(*many.effects, effect), geometry=geometry)
