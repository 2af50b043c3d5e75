"""A case that `check` passes in silence, and its remarks on one that was changed."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar

import pytest

from vegglue.case.config import load_case
from vegglue.case.gridded_site import Site, build_site
from vegglue.case.schema import Case
from vegglue.diagnosis.case_check import check_case
from vegglue.measurements.observations import Observations, read_observations

Remark = TypeVar("Remark")

SOUND = """
name: sound
grid: {x: [0, 40], y: [-5, 5], cell: [1.0, 0.5]}
bed:
  - trapezoid: {axis: 0.0, bottom_width: 4.0, bank_slope: 0.5, bed_slope: 0.001, level: 0.0}
friction:
  classes:
    bed: {law: manning, n: n_b}
    bank: {law: keulegan, k_s: 0.5}
  default: bed
  zones:
    - {class: bank, beyond_slope_break: 0.2}
plants:
  stands:
    reed: {phi: phi, canopy_height: 0.8, stems: 22}
  patches:
    - {name: p1, stand: reed, x: [10, 14], y: [0, 1.5], stems: 22}
inflows:
  upstream: {side: west}
outlet: {}
experiments:
  low: {discharge: 2.0, level: 1.0}
parameters:
  n_b: {distribution: uniform, low: 0.01, high: 0.15, unit: s m^(-1/3)}
  phi: {distribution: loguniform, low: 0.01, high: 100, unit: "-"}
observations:
  - {kind: velocity, file: velocities.csv}
simulate: {members: 1024}
"""
ROWS = "experiment,section,x,y,u,u_se\nlow,A,12,0.7,0.3,0.01\nlow,A,12,-0.7,0.5,0.01\nlow,A,12,1.1,0.3,0.01\n"


def read_case(folder: Path, text: str = SOUND, rows: str = ROWS) -> tuple[Case, Site, Observations]:
    (folder / "velocities.csv").write_text(rows)
    (folder / "sound.yaml").write_text(text)
    case = load_case(folder / "sound.yaml")
    return case, build_site(case), read_observations(case)


def odd(folder: Path, text: str = SOUND, rows: str = ROWS) -> list[object]:
    """The remarks on a case."""
    return check_case(*read_case(folder, text, rows))


def found_in(remarks: Iterable[object], kind: type[Remark], **fields: Any) -> list[Remark]:
    """Those of a class with these values, numbers to one per cent."""
    return [
        one
        for one in remarks
        if isinstance(one, kind) and all(near(getattr(one, name), value) for name, value in fields.items())
    ]


def near(found: Any, expected: Any) -> bool:
    if isinstance(expected, tuple) and isinstance(found, tuple):
        return len(found) == len(expected) and all(map(near, found, expected))
    return bool(found == (pytest.approx(expected, rel=0.01) if isinstance(expected, float) else expected))
