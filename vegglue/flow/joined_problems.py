"""Problems of one experiment on one grid side by side: the members of each after those of the one before."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.effects.active_effect import ActiveEffect
from vegglue.flow.problem import EMPTY, Boundaries, InflowSegment, Problem


def joined(problems: Sequence[Problem]) -> Problem:
    """One problem with all members: what is alike, as the grid and its classes, is taken from the first."""
    first = problems[0]
    plants: dict[str, Any] = {
        name: _side_by_side([getattr(one.plants, name) for one in problems])
        for name in ("phi", "canopy_height", "bare_chezy")
    }
    return replace(
        first,
        friction=replace(first.friction, coefficient=_side_by_side([one.friction.coefficient for one in problems])),
        plants=replace(first.plants, **plants),
        viscosity=_side_by_side([one.viscosity for one in problems]),
        boundaries=_boundaries([one.boundaries for one in problems], [one.members for one in problems]),
        bed_rise=_where_any([one.bed_rise for one in problems], [one.members for one in problems]),
        walls=replace(first.walls, rate=_side_by_side([one.walls.rate for one in problems])),
        effects=_effects(problems),
        geometry=next((one.geometry for one in problems if one.geometry is not None), None),
    )


def _boundaries(parts: Sequence[Boundaries], members: Sequence[int]) -> Boundaries:
    inflows = zip(*(one.inflows for one in parts), strict=True)
    return replace(
        parts[0],
        inflows=tuple(_inflow(alike, members) for alike in inflows),
        outlet_level=_side_by_side([one.outlet_level for one in parts]),
        lateral_inflow=_where_any([one.lateral_inflow for one in parts], members),
    )


def _inflow(parts: Sequence[InflowSegment], members: Sequence[int]) -> InflowSegment:
    cells = max(len(one.spread) for one in parts)
    spread = [np.broadcast_to(one.spread, (cells, count)) for one, count in zip(parts, members, strict=True)]
    return replace(parts[0], discharge=_side_by_side([one.discharge for one in parts]), spread=_side_by_side(spread))


def _effects(problems: Sequence[Problem]) -> tuple[ActiveEffect, ...]:
    """Effects of each problem, off in the members of all others."""
    found, start, total = list[ActiveEffect](), 0, sum(one.members for one in problems)
    for one in problems:
        own = slice(start, start + one.members)
        for active in one.effects:
            amplitude = active.effect.amplitude
            values = {name: np.full(total, value[0]) for name, value in active.values.items()}
            values[amplitude.name][:] = amplitude.off
            for name, value in active.values.items():
                values[name][own] = value
            found.append(replace(active, values=values))
        start += one.members
    return tuple(found)


def _where_any(parts: Sequence[Array], members: Sequence[int]) -> Array:
    """Arrays (nx, ny, m), 0 of a problem without one; empty where none has one."""
    shape = next((one.shape[:2] for one in parts if one.size), None)
    if shape is None:
        return EMPTY
    return _side_by_side(
        [one if one.size else np.zeros((*shape, count)) for one, count in zip(parts, members, strict=True)]
    )


def _side_by_side(parts: Sequence[Array]) -> Array:
    return np.concatenate(parts, axis=-1)
