"""The ensemble: what every member predicted at every station, and how it was solved."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd

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
from vegglue.results.fields import FieldWindow
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

VALUE_UNIT = ", ".join(f"{kind.unit} for {kind.words}" for kind in KINDS.values())
STATION_UNITS = dict.fromkeys(("x", "y", "depth"), "m") | dict.fromkeys(("value", "standard_error"), VALUE_UNIT)


@dataclass(frozen=True)
class Header:
    """What is known of an ensemble before its first member is solved."""

    parameters: Mapping[str, np.ndarray]  # (member,) each
    units: Mapping[str, str]  # of the parameters
    station: pd.DataFrame  # all rows of observations.table
    experiments: tuple[str, ...]
    sections: tuple[tuple[str, float], ...]  # name, x [m]
    chunks: int  # how many fixed sets of members the run is cut into
    cut: str  # hash of these sets
    config: str  # resolved YAML
    config_hash: str
    seed: int
    version: str
    window: FieldWindow | None = None  # where fields are kept

    @property
    def members(self) -> int:
        return len(next(iter(self.parameters.values())))


@dataclass(frozen=True)
class Ensemble:
    """All members of a finished run, failed ones included."""

    parameters: dict[str, np.ndarray]  # (member,) each
    prediction: Annotated[np.ndarray, Stored(("member", "station"), VALUE_UNIT)]  # NaN for failed members
    status: Annotated[np.ndarray, Stored(("member",), fill=NOT_YET, type=np.int8)]  # one of `flow.status`
    reason: Annotated[np.ndarray, Stored(("member",), fill=b"", type="S240")]  # '' or a sentence
    iterations: Annotated[np.ndarray, Stored(("member",), fill=0, type=np.int32)]
    mass_error: Annotated[np.ndarray, Stored(("member",))]  # largest |Q - Q_in| over all that enters
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
