"""Fields kept of every member in a window along x, enough to predict any measurement there without solving again."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np

from vegglue.arrays import Array, Single
from vegglue.case.grid import Grid
from vegglue.case.schema import Case
from vegglue.errors import InputError
from vegglue.flow.sensor import between
from vegglue.results.layout import Group, Stored, Variable, fitting, names_of, stored_fields

Quantity = Literal["level", "u", "v"]
DIMS = ("member", "experiment", "x", "y")
COMPRESSED_AT_ONCE = 2**20  # [bytes]


@dataclass(frozen=True)
class FieldWindow:
    """Columns of the grid around a range along x.

    Attributes
    ----------
    range
        From where to where [m].
    columns
        Of the grid.
    x, y
        Cell centres (columns,) and (ny,) [m].
    """

    range: tuple[float, float]
    columns: slice
    x: Array
    y: Array


@dataclass(frozen=True)
class Fields:
    """Level and depth-averaged velocities at cell centres; NaN in a dry cell or a failed member.

    Attributes
    ----------
    level, u, v
        (member, experiment, x, y) [m], [m/s]
    experiments
        Names.
    x, y
        Cell centres [m].
    range
        Along x [m].
    config_hash
    """

    level: Annotated[Single, Stored(DIMS, "m")]
    u: Annotated[Single, Stored(DIMS, "m/s")]
    v: Annotated[Single, Stored(DIMS, "m/s")]
    experiments: tuple[str, ...]
    x: Array  # centres [m]
    y: Array
    range: tuple[float, float]  # along x, what can be predicted [m]
    config_hash: str  # of the ensemble


QUANTITIES = tuple(stored_fields(Fields))  # in the order in which sensor.read_sensors keeps them


def window_of(case: Case, grid: Grid) -> FieldWindow | None:
    """The cells whose centres surround the range that the case keeps, None if it keeps none."""
    if case.simulate.fields is None:
        return None
    low, high = case.simulate.fields.x
    ends, _ = between(np.array([low, high]), grid.x[0], grid.dx, grid.x.size)
    columns = slice(int(ends[0]), int(ends[1]) + 2)
    return FieldWindow((low, high), columns, grid.x[columns], grid.y)


def megabytes(case: Case, window: FieldWindow) -> float:
    """members * experiments * 3 * columns * ny * 4 bytes, before compression [MB]."""
    return case.simulate.members * len(case.experiments) * len(QUANTITIES) * window.x.size * window.y.size * 4e-6


@dataclass(frozen=True)
class FieldsTooLarge:
    """`simulate.fields` keeps `megabytes` of `members`, beyond the budget [MB]; length of its range and one that fits
    [m].
    """

    megabytes: float
    members: int
    budget: float
    length: float
    fitting: float


def excess(case: Case, grid: Grid) -> FieldsTooLarge | None:
    """A window larger than its budget, None when all is well."""
    window = window_of(case, grid)
    if window is None or (size := megabytes(case, window)) <= case.simulate.field_budget:
        return None
    columns = int(window.x.size * case.simulate.field_budget / size)
    low, high = window.range
    fitting = max(columns - 2, 0) * grid.dx
    return FieldsTooLarge(size, case.simulate.members, case.simulate.field_budget, high - low, fitting)


def predict_at(fields: Fields, x: float, y: float, quantity: Quantity = "u") -> Array:
    """A quantity at a point, bilinear between cell centres as sensors read it, (member, experiment) [m, m/s].

    NaN where a cell that counts is dry throughout in that member. Errors: InputError for a point outside the window.
    """
    dx, dy = fields.x[1] - fields.x[0], fields.y[1] - fields.y[0]
    (west, east), (south, north) = fields.range, (fields.y[0] - 0.5 * dy, fields.y[-1] + 0.5 * dy)
    if not (west <= x <= east and south <= y <= north):
        raise InputError(
            f"x = {x:g}, y = {y:g} m is outside the fields that were kept, {west:g} to {east:g} m by {south:g} to "
            f"{north:g} m: choose a point within, or a wider `simulate.fields`."
        )
    (i,), (along,) = between(np.array([x]), fields.x[0], dx, fields.x.size)
    (j,), (across,) = between(np.array([y]), fields.y[0], dy, fields.y.size)
    corners = getattr(fields, quantity)[:, :, i : i + 2, j : j + 2].astype(np.float64)
    weight = np.outer((1.0 - along, along), (1.0 - across, across))
    return np.where(weight > 0.0, weight * corners, 0.0).sum(axis=(2, 3))


def fields_group(window: FieldWindow, experiments: tuple[str, ...], values: Single) -> Group:
    """What fields.h5 holds, from values (member, experiment, quantity, x, y)."""
    members, (columns, rows) = len(values), (window.x.size, window.y.size)
    batch = min(members, max(1, COMPRESSED_AT_ONCE // (columns * rows * values.itemsize)))
    coordinates = {
        "member": np.arange(members), "experiment": np.array(experiments, object), "x": window.x, "y": window.y
    }  # fmt: skip
    variables = {
        name: Variable(stored.dims, values[:, :, place], stored.unit, compressed=(batch, 1, columns, rows))
        for place, (name, stored) in enumerate(stored_fields(Fields).items())
    }
    return Group(coordinates, variables, {"x": "m", "y": "m"})


def fields_from(groups: Mapping[str, Mapping[str, np.ndarray]], attributes: Mapping[str, Any]) -> Fields:
    """The fields whose file has these groups and attributes."""
    stored = fitting(groups["fields"], stored_fields(Fields) | {"x": Stored(("x",)), "y": Stored(("y",))})
    west, east = fitting({"range": np.asarray(attributes["range"])}, {"range": Stored(("end",))}, {"end": 2})["range"]
    return Fields(
        **{name: stored[name] for name in QUANTITIES},
        experiments=names_of(stored, "experiment"),
        x=stored["x"],
        y=stored["y"],
        range=(float(west), float(east)),
        config_hash=str(attributes["config_hash"]),
    )
