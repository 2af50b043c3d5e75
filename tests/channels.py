"""Channels that the verification tests share: small, with smooth walls."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.effects import bed_laws
from vegglue.effects.active_effect import ActiveEffect
from vegglue.effects.library import library
from vegglue.effects.plant_laws import PLANT_LAWS
from vegglue.effects.surroundings import ChannelGeometry
from vegglue.flow.equations import faces
from vegglue.flow.newton import newton
from vegglue.flow.problem import LEVEL, BedFriction, Boundaries, InflowSegment, Problem, VegetatedCells, take
from vegglue.flow.starts import backwater, on_grid

GRAVITY = 9.81


def centres(length: float, cells: int) -> Array:
    return (np.arange(cells) + 0.5) * length / cells


def make_problem(
    bed: Array,
    cell: tuple[float, float],
    discharge: float,
    level: float,
    friction: tuple[int, float] = (bed_laws.CHEZY, 50.0),
    **changes: object,
) -> Problem:
    """One friction class, inflow from the west by conveyance, outlet all along the east, a film of 0.1 mm."""
    inflow = InflowSegment("west", 0, bed.shape[1], np.array([discharge]))
    problem = Problem(
        dx=cell[0],
        dy=cell[1],
        bed=np.ascontiguousarray(bed),
        friction=BedFriction(
            np.zeros(bed.shape, np.int64), np.array([friction[0]]), np.array([[friction[1]]]), bank_argument_minimum=1.3
        ),
        plants=planted((0, 0), 0.0, 0.0, 0.0),
        viscosity=np.zeros(1),
        boundaries=Boundaries((inflow,), np.ones(bed.shape[1], bool), np.array([level])),
        film=1e-4,
        smallest_shear_depth=False,
    )
    return changed(problem, **changes)


def changed(problem: Problem, **changes: object) -> Problem:
    """A problem with other fields, be they its own, or those of its bed friction or its boundaries."""
    for part in ("friction", "boundaries"):
        own = {field.name for field in fields(getattr(problem, part))} & changes.keys()
        if own:
            other = replace(getattr(problem, part), **{name: changes.pop(name) for name in own})
            problem = replace(problem, **{part: other})
    return replace(problem, **changes)


def sloping(length: float, cells: int, rows: int, slope: float) -> Array:
    """A plane bed, zero at x = 0."""
    return np.repeat(-slope * centres(length, cells)[:, None], rows, axis=1)


def planted(
    shape: tuple[int, int],
    phi: float,
    canopy_height: float,
    bare_chezy: float,
    law: str = "baptist",
    proportional: bool = False,
) -> VegetatedCells:
    """Plants in every cell."""
    return plants_at(*(index.ravel() for index in np.indices(shape)), phi, canopy_height, bare_chezy, law, proportional)


def plants_at(
    column: Array,
    row: Array,
    phi: float | Array,
    canopy_height: float,
    bare_chezy: float,
    law: str = "baptist",
    proportional: bool = False,
) -> VegetatedCells:
    """Plants in some cells; phi may differ between them, (cell, 1)."""
    values = [value + np.zeros((column.size, 1)) for value in (phi, canopy_height, bare_chezy)]
    return VegetatedCells(
        column, row, np.full(column.size, PLANT_LAWS.index(law)), np.ones(column.size), *values, proportional
    )


def trapezoid(length: float, half_width: float, cells: tuple[int, int]) -> tuple[Array, Array]:
    """Bed and classes (0 floor, 1 bank) of the paper's section: floor 3 m, banks 1:1.5, slope 0.001."""
    x, y = centres(length, cells[0]), centres(2.0 * half_width, cells[1]) - half_width
    bed = -0.001 * x[:, None] + np.maximum(np.abs(y) - 1.5, 0.0)[None] / 1.5
    return bed, np.repeat((np.abs(y) > 1.5).astype(np.int64)[None], cells[0], axis=0)


def even_geometry(bed: Array, banks: Array, cell: tuple[float, float]) -> ChannelGeometry:
    """What effects are told of the paper's section, y = 0 on its axis; nothing of plants."""
    nx, ny = bed.shape
    nothing = np.zeros((nx, ny, 1))
    far = nothing + np.inf
    return ChannelGeometry(
        x=centres(nx * cell[0], nx)[:, None, None], y=(centres(ny * cell[1], ny) - 0.5 * ny * cell[1])[None, :, None],
        share_along=np.zeros((nx, 1, 1)), length=nx * cell[0], dx=cell[0], dy=cell[1],
        filter_width=(cell[0] * cell[1]) ** 0.5,
        bed=bed[..., None], offset=nothing,
        half_width=nothing + 1.5, side_slope=nothing, bank=banks[..., None].astype(float), planted=nothing, front=far,
        edge=far, wake=far, patch=nothing - 1.0,
    )  # fmt: skip


# Tolerance of flows from which others are searched [m, m/s].
ON_THE_WAY = 1e-2


def mixed(problem: Problem, length: float, tolerance: float) -> tuple[Problem, Array]:
    """With a mixing length, and its steady state, reached by shorter ones: from none at once Newton stops.

    What only leads there need not be at rest: the last flow is the same to 1e-12, in a quarter less time.
    """
    state = solved(problem, ON_THE_WAY if length else tolerance)
    for share in (0.4, 0.7, 1.0) if length else ():
        state = _rested(_mixing(problem, share * length), state, tolerance if share == 1.0 else ON_THE_WAY)
    return _mixing(problem, length), state


def mixed_from(coarser: Array, problem: Problem, length: float, tolerance: float) -> tuple[Problem, Array]:
    """As `mixed`, from the state on cells of twice the size: the same to 1e-9, in a third of the time."""
    problem = _mixing(problem, length)
    return problem, _rested(problem, on_grid(coarser, problem.shape), tolerance)


def _mixing(problem: Problem, length: float) -> Problem:
    mixing = ActiveEffect(library()["mixing_length"], {"length": np.array([length])})
    return replace(problem, effects=(mixing,) if length else ())


def _rested(problem: Problem, start: Array, tolerance: float) -> Array:
    solution = newton(problem, start, tolerance)
    assert solution.converged[0]
    return solution.state


def river(cells: tuple[int, int] = (60, 24), film: float = 0.002, **changes: object) -> Problem:
    """30 m of the paper's channel: dry banks, Manning, Keulegan, and one patch of plants beside the axis."""
    bed, banks = trapezoid(30.0, 4.5, cells)
    x, y = centres(30.0, cells[0]), centres(9.0, cells[1]) - 4.5
    column, row = np.nonzero(((x > 12.0) & (x < 16.0))[:, None] & ((y > 0.0) & (y < 1.5))[None])
    settings = {
        "law": np.array([bed_laws.MANNING, bed_laws.KEULEGAN]),
        "coefficient": np.array([[0.06], [1.0]]),
        "friction_class": banks,
        "plants": plants_at(column, row, 4.0, 0.7, 60.0),
        "viscosity": np.array([0.01]),
        "film": film,
    }
    cell = (30.0 / cells[0], 9.0 / cells[1])
    return make_problem(bed, cell, 2.0, 0.95, **(settings | changes))


def solved(problem: Problem, tolerance: float = 1e-10) -> Array:
    """The steady state that Newton finds from the backwater estimate."""
    solution = newton(problem, backwater(problem), tolerance)
    assert solution.converged[0], f"Newton stopped at {solution.correction[0]:.1e} after {solution.iterations[0]}"
    return solution.state


def discharge(problem: Problem, state: Array) -> Array:
    """Discharge through every west-east face, (nx + 1, m) [m3/s]."""
    return faces(problem, state).flux_x.sum(axis=1) * problem.dy


def order(errors: list[float]) -> float:
    """Observed order of convergence from the last of a series of halvings."""
    return float(np.log2(errors[-2] / errors[-1]))


def shown(errors: list[float]) -> str:
    """A series of errors and its order, to print."""
    return f"errors {', '.join(f'{error:.2e}' for error in errors)}, order {order(errors):.2f}"


def filled(problem: Problem, level: float) -> Array:
    """Water at rest at one level."""
    state = np.zeros((problem.shape[0], 3, problem.shape[1], problem.members))
    state[:, LEVEL] = level
    return state


def family(points: Array) -> Problem:
    """The reach for members at points (m, 2) of a unit square: roughness of the floor, density of the plants."""
    points = np.atleast_2d(points)
    many = take(river(), np.zeros(len(points), dtype=np.int64))
    coefficient = np.stack([0.03 + 0.06 * points[:, 0], np.full(len(points), 1.0)])
    phi = many.plants.phi * 10.0 ** (points[:, 1] - 0.5)
    return changed(many, coefficient=coefficient, plants=replace(many.plants, phi=phi))


def stations_at(
    experiments: Iterable[str], places: Mapping[str, tuple[Sequence[float], Sequence[float]]]
) -> pd.DataFrame:
    """A table of stations, of each kind in each experiment at some x and y [m]; nothing was read yet."""
    rows = [
        {"experiment": experiment, "kind": kind, "section": f"{kind} {x:g}", "x": x, "y": y}
        for experiment in experiments for kind, (along, across) in places.items() for x in along for y in across
    ]  # fmt: skip
    return pd.DataFrame(rows).assign(value=0.0, standard_error=0.01, used=True, reason="", depth=np.nan, device="")
