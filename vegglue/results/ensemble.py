"""The ensemble: what every member predicted at every station, and how it was solved; and the fields kept of every
member in a window along x, enough to predict any measurement there without solving again.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
import pandas as pd

from vegglue.arrays import Array, Single
from vegglue.case.grid import Grid
from vegglue.case.schema import Case
from vegglue.errors import InputError
from vegglue.flow.sensor import between
from vegglue.flow.status import (
    FAILED,
    NOT_YET,
    RUN_BY_COMMAND,
    SOLVED_BY_MARCHING,
    SOLVED_BY_NEWTON,
    STATUS_WORDS,
    members_with,
)
from vegglue.measurements.kinds import KINDS, stations_in_short
from vegglue.results.layout import (
    IN_WORDS,
    Group,
    Stored,
    Variable,
    fitting,
    names_of,
    stated_as,
    stations_from,
    stored_fields,
    table_group,
)
from vegglue.wording.numbers import in_short, in_short_html
from vegglue.wording.sentences import phrase

Quantity = Literal["level", "u", "v"]
DIMS = ("member", "experiment", "x", "y")
COMPRESSED_AT_ONCE = 2**20  # [bytes]


@dataclass(frozen=True)
class FieldWindow:
    """Columns of the grid around a range along x.

    Attributes
    ----------
    range : (float, float)
        From where to where [m].
    columns : slice
        Of the grid.
    x, y : ndarray (columns,), (ny,)
        Cell centres [m].
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
    """The cells whose centres surround the range of which a case keeps the fields.

    Returns
    -------
    FieldWindow or None
        None if it keeps none.
    """
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
    """Fields of all members that exceed their budget.

    Attributes
    ----------
    megabytes : float
        Their size [MB].
    budget : float
        [MB]
    length, fitting : float
        Length of the range along x, and of one that fits [m].
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
    """q = sum_ij w_i w_j q_ij over the four cells around a point, weights linear in x and y, as sensors read it.

    Parameters
    ----------
    x, y : float
        Place in the coordinates of the grid [m].
    quantity : {"u", "v", "level"}

    Returns
    -------
    array
        (member, experiment) [m/s; level m], NaN where a cell that counts is dry throughout in that member.

    Raises
    ------
    InputError
        If the point is outside the fields that were kept.
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


VALUE_UNIT = ", ".join(f"{kind.unit} for {kind.words}" for kind in KINDS.values())
STATION_UNITS = dict.fromkeys(("x", "y", "depth"), "m") | dict.fromkeys(("value", "standard_error"), VALUE_UNIT)


@dataclass(frozen=True)
class Header:
    """What is known of an ensemble before its first member is solved.

    Attributes
    ----------
    parameters : mapping of ndarray (member,)
        By name [unit of each].
    units : mapping of str
        Of the parameters.
    station : DataFrame
        All rows of observations.table.
    sections : tuple of (str, float)
        Name, x [m].
    chunks : int
        How many fixed sets of members the run is cut into.
    cut : str
        Hash of these sets.
    config : str
        Resolved YAML.
    window : FieldWindow or None
        Where fields are kept.
    """

    parameters: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    station: pd.DataFrame
    experiments: tuple[str, ...]
    sections: tuple[tuple[str, float], ...]
    chunks: int
    cut: str
    config: str
    config_hash: str
    seed: int
    version: str
    window: FieldWindow | None = None

    @property
    def members(self) -> int:
        return len(next(iter(self.parameters.values())))


@dataclass(frozen=True)
class Ensemble:
    """All members of a finished run, failed ones included.

    Attributes
    ----------
    parameters
        By name, (member,) [unit of the parameter].
    prediction
        (member, station) [unit of the kind], NaN for failed members.
    status, reason
        (member,) one of `flow.status`, and why a member failed, '' if it did not.
    iterations, seconds
        (member,) of the solver; [s].
    mass_error
        (member,) largest |Q - Q_in| / Q_in over all that enters [-].
    section_flow
        (member, experiment, section) discharge [m3/s].
    station
        Table of all stations, used or not.
    experiments, sections
        Names of experiments; names and places along the channel of sections [m].
    config, config_hash, seed, version
        Of the run.
    """

    parameters: dict[str, np.ndarray]
    prediction: Annotated[np.ndarray, Stored(("member", "station"), VALUE_UNIT)]
    status: Annotated[np.ndarray, Stored(("member",), fill=NOT_YET, type=np.int8)]
    reason: Annotated[np.ndarray, Stored(("member",), fill=b"", type="S240")]
    iterations: Annotated[np.ndarray, Stored(("member",), fill=0, type=np.int32)]
    mass_error: Annotated[np.ndarray, Stored(("member",))]
    seconds: Annotated[np.ndarray, Stored(("member",), "s")]
    section_flow: Annotated[np.ndarray, Stored(("member", "experiment", "section"), "m3/s")]
    station: pd.DataFrame
    experiments: tuple[str, ...]
    sections: tuple[tuple[str, float], ...]  # name, x [m]
    config: str
    config_hash: str
    seed: int
    version: str

    @property
    def by_command(self) -> bool:
        """Whether its members are runs of a command, of which no mass error is known."""
        return bool((self.status == RUN_BY_COMMAND).any()) or "\nengine:" in f"\n{self.config}"

    def __repr__(self) -> str:
        newton, marched, failed, run = (
            members_with(self.status, how) for how in (SOLVED_BY_NEWTON, SOLVED_BY_MARCHING, FAILED, RUN_BY_COMMAND)
        )
        worst = self.mass_error[np.isfinite(self.mass_error)].max(initial=0.0)
        return in_short(
            phrase("ensemble_in_short", len(self.status), newton, marched, failed, run, self.by_command),
            [
                f"parameters: {', '.join(self.parameters)}",
                f"experiments: {', '.join(self.experiments)}",
                stations_in_short(self.station),
                "no mass error known" if self.by_command else f"largest mass error {worst:.1g} of the discharge",
                f"seed {self.seed}, vegglue {self.version}",
            ],
        )

    def _repr_html_(self) -> str:
        return in_short_html(repr(self))


ROWS = stored_fields(Ensemble)  # what is stored of each member
AT_SECTIONS = {"section": Stored(("section",), type=IN_WORDS), "section_x": Stored(("section",), "m")}


def unsolved(header: Header) -> dict[str, Group]:
    """All groups of an ensemble file, every member 'not solved yet'."""
    coordinates = {
        "member": np.arange(header.members),
        "station": np.arange(len(header.station)),
        "experiment": np.array(header.experiments, object),
        "section": np.array([name for name, _ in header.sections], object),
    }
    sizes = {dim: len(values) for dim, values in coordinates.items()}
    rows = {
        name: Variable(row.dims, np.full([sizes[dim] for dim in row.dims], row.fill, row.type), row.unit)
        for name, row in ROWS.items()
    }
    rows["section_x"] = Variable(("section",), np.array([x for _, x in header.sections], float), "m")
    parameters = {name: Variable(("member",), values, header.units[name]) for name, values in header.parameters.items()}
    progress = {
        "finished": Variable(("chunk",), np.zeros(header.chunks, np.int8)),
        "digest": Variable(
            ("chunk",), np.zeros(header.chunks, np.uint32)
        ),  # CRC-32 of all that is stored of its members
    }
    return {
        "members": Group(coordinates, rows),
        "parameters": Group({"member": coordinates["member"]}, parameters),
        "stations": table_group(header.station, "station", STATION_UNITS),
        "progress": Group({"chunk": np.arange(header.chunks)}, progress),
    }


def ensemble_from(groups: Mapping[str, Mapping[str, np.ndarray]], attributes: Mapping[str, Any]) -> Ensemble:
    """The ensemble whose file has these groups and attributes."""
    parameters = {name: values for name, values in groups["parameters"].items() if name != "member"}
    station, experiments = stations_from(groups["stations"]), names_of(groups["members"], "experiment")
    sizes = {"station": len(station), "experiment": len(experiments)}
    rows = fitting(groups["members"], ROWS | AT_SECTIONS, sizes)
    fitting(parameters, dict.fromkeys(parameters, Stored(("member",))), {"member": len(rows["status"])})
    if not np.isin(rows["status"], (NOT_YET, *STATUS_WORDS)).all():
        raise ValueError("status holds what is none")
    return Ensemble(
        parameters=parameters,
        **{name: rows[name] for name in ROWS},
        station=station,
        experiments=experiments,
        sections=tuple(zip(rows["section"].tolist(), rows["section_x"].tolist(), strict=True)),
        config=stated_as(str, attributes, "config"),
        config_hash=stated_as(str, attributes, "config_hash"),
        seed=stated_as(int, attributes, "seed"),
        version=stated_as(str, attributes, "version"),
    )
