"""Kinds of observation: what is told of each, how its files are read, and that nothing passes for what it is not."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from reach import Say, write_reach

from vegglue.case.config import load_case
from vegglue.errors import InputError
from vegglue.flow.sensor import READERS
from vegglue.measurements.kinds import (
    KINDS,
    STREAMWISE,
    WATER_LEVEL,
    UnstatedErrors,
    kind_of,
    unstated_errors,
    velocity_rows,
)
from vegglue.measurements.observations import Observations, read_observations

GIVEN = "- {kind: velocity, file: velocities.csv, experiment: June}"


def read(folder: Path, kind: str, text: str, more: str = "") -> Observations:
    """The brook of the README with one file of a kind."""
    (folder / "measured.csv").write_text(text, encoding="utf-8")
    observation = f"- {{kind: {kind}, file: measured.csv, experiment: June{more}}}"
    return read_observations(load_case(write_reach(folder, (GIVEN, observation))))


def test_every_kind_has_a_reader_and_every_reader_a_kind() -> None:
    assert set(READERS) == set(KINDS)


def test_kinds_are_told_apart() -> None:
    assert [kind.name for kind in KINDS.values()] == list(KINDS)
    assert {STREAMWISE, WATER_LEVEL} <= set(KINDS)
    for name in ("words", "column", "file"):
        assert len({getattr(kind, name) for kind in KINDS.values()}) == len(KINDS), name
    assert all(kind.usual_error > 0 for kind in KINDS.values())


def test_an_unknown_kind_is_refused_by_name() -> None:
    with pytest.raises(InputError, match=r"velocity, velocity_across, .*'temperature'"):
        kind_of("temperature")
    with pytest.raises(InputError, match="'temperature'"):
        velocity_rows(pd.DataFrame({"kind": ["velocity", "temperature"]}))


def test_velocities_of_any_direction_are_velocities() -> None:
    names = ["velocity", "level", "speed", "discharge", "velocity_across"]
    assert list(velocity_rows(pd.DataFrame({"kind": names}))) == [True, False, True, False, True]


@pytest.mark.parametrize("kind", [kind for kind in KINDS.values() if kind.at_point], ids=lambda kind: kind.name)
def test_a_file_of_each_kind_is_read_as_it_is(kind, tmp_path: Path) -> None:
    text = f"section,x,y,{kind.column},{kind.column}_se\nA,8,-1,0.25,0.02\nA,8,1,-0.1,0\n"
    table = read(tmp_path, kind.name, text, ", offset: {x: 1, y: 0.5}").table
    assert list(table["kind"]) == [kind.name] * 2
    assert list(table["section"]) == ["A"] * 2
    assert list(zip(table["x"], table["y"], table["value"], strict=True)) == [(9, -0.5, 0.25), (9, 1.5, -0.1)]
    assert table["standard_error"].iloc[0] == 0.02
    assert np.isnan(table["standard_error"].iloc[1])


def test_a_discharge_needs_no_y(tmp_path: Path) -> None:
    table = read(tmp_path, "discharge", "x,discharge\n5,2.01\n25,1.97\n", ", standard_error: 0.05").table
    assert list(table["value"]) == [2.01, 1.97]
    assert list(table["y"]) == [0.0, 0.0]  # the middle of the grid
    assert set(table["standard_error"]) == {0.05}
    table = read(tmp_path, "discharge", "section,x,y,discharge\ngauging,5,1.5,2.01\n", ", section: gauging").table
    assert list(table["y"]) == [1.5]
    assert list(table["section"]) == ["gauging"]
    with pytest.raises(InputError, match=r"row 3: .*experiment, section, x"):
        read(tmp_path, "discharge", "x,discharge\n5,2.01\n5,1.97\n")


def test_one_file_holds_both_components(tmp_path: Path) -> None:
    (tmp_path / "both.csv").write_text("section,x,y,u,v\nA,8,-1,0.4,0.02\n", encoding="utf-8")
    both = "\n  ".join(f"- {{kind: {kind}, file: both.csv, experiment: June}}" for kind in list(KINDS)[:2])
    table = read_observations(load_case(write_reach(tmp_path, (GIVEN, both)))).table
    assert list(zip(table["kind"], table["value"], strict=True)) == [("velocity", 0.4), ("velocity_across", 0.02)]


@pytest.mark.parametrize(("kind", "column"), [("velocity_across", "v"), ("speed", "speed"), ("discharge", "discharge")])
def test_a_file_without_the_column_of_its_kind_is_refused(kind: str, column: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, kind, "section,x,y,u\nA,8,-1,0.4\n")
    assert caught.value.kind == "missing_columns"
    assert column in caught.value.values["missing"]


def test_a_misspelt_kind_is_refused_with_the_config_and_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say
) -> None:
    config = write_reach(tmp_path, ("kind: velocity", "kind: velocty"))
    monkeypatch.chdir(tmp_path)
    code, said = say("check", config.name)
    assert code == 2
    assert all(word in said for word in ("brook.yaml", "velocities.csv", "`kind`", "`velocity`"))


@pytest.mark.parametrize(
    ("errors", "counts", "y", "fill", "add"),
    [
        ((0.01, 0.0, 0.01), (("velocity", 1),), 2.0, ("u_se",), ()),
        ((0.0, 0.0, 0.01), (("velocity", 2),), 1.0, (), ("u_se",)),
        ((0.01, 0.0, 0.0), (("velocity", 1), ("level", 1)), 2.0, ("u_se",), ("level_se",)),
        ((0.01, 0.01, 0.01), None, 0.0, (), ()),
    ],
)
def test_an_error_that_one_reading_lacks_needs_no_new_column(errors, counts, y, fill, add) -> None:
    """`add a column u_se` was the advice for one empty cell of that column."""
    table = pd.DataFrame({"kind": ["velocity", "velocity", "level"], "standard_error": errors, "used": True})
    found = unstated_errors(table.assign(x=8.0, y=[1.0, 2.0, 3.0]))
    assert found == (None if counts is None else UnstatedErrors(counts, (8.0, y), fill, add, (0.015, "m/s")))
