"""Values that no flow can have are said, with their place and what to do; what an effect may do is not."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from open_cases import imported
from reach import write_reach

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case
from vegglue.measurements.missing_marks import MARKS_OF_ANY_COLUMN, MARKS_OR_VALUES, is_mark
from vegglue.measurements.observations import read_observations
from vegglue.measurements.suspicious_values import absurd_values

LEVELS = [(8.0, 0.97), (14.5, 0.965), (20.0, 0.955)]  # x, level [m]
Change = Callable[[pd.DataFrame], pd.DataFrame]


def reach(folder: Path, *changes: tuple[str, str]) -> tuple[Case, pd.DataFrame]:
    """The reach of the README, with errors, three gauges and a gauging."""
    case = load_case(write_reach(folder, *changes))
    table = read_observations(case).table.assign(standard_error=0.015)
    row = table.iloc[0].to_dict() | {"section": "", "y": 0.0}
    more = [row | {"kind": "level", "x": x, "value": z, "standard_error": 0.003} for x, z in LEVELS]
    gauging = row | {"kind": "discharge", "x": 5.0, "value": 2.03, "standard_error": 0.1}
    return case, pd.concat([table, pd.DataFrame([*more, gauging])], ignore_index=True)


def said_of(folder: Path, change: Change, *changes: tuple[str, str]) -> list[str]:
    case, table = reach(folder, *changes)
    return absurd_values(case, build_site(case), change(table))


def scaled(factor: float, kind: str = "velocity", column: str = "value", **where: object) -> Change:
    """Some values of a kind times a factor."""

    def change(table: pd.DataFrame) -> pd.DataFrame:
        chosen = (table["kind"] == kind) & np.all([table[key] == value for key, value in where.items()] or True, axis=0)
        assert chosen.any()
        return table.assign(**{column: table[column].where(~chosen, factor * table[column])})

    return change


def replaced(row: int, value: float, column: str = "value") -> Change:
    return lambda table: table.assign(**{column: table[column].where(table.index != row, value)})


@pytest.mark.parametrize(
    "change",
    [
        scaled(1.0),
        scaled(2.0),  # a discharge wrong by a factor of two is for the diagnosis to find
        scaled(0.3, section="patch"),  # as dense plants make it
        scaled(-1.0, section="patch"),
        replaced(3, 0.0),
        replaced(0, 1.6),
        scaled(1.2, "level"),
        scaled(3.0, "discharge"),
        scaled(5.0, column="standard_error"),
        scaled(0.1, column="standard_error"),
        scaled(np.nan, column="standard_error"),
        lambda table: replaced(3, -999.0)(table).assign(used=table.index != 3),
        lambda table: table.iloc[:0],
    ],
)
def test_what_a_flow_may_show_is_passed_in_silence(tmp_path: Path, change: Change) -> None:
    assert said_of(tmp_path, change) == []


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (
            replaced(3, -999.0),
            r"The velocity -999 m/s at x = 8, y = 1.25 m \(section above of experiment June\): this marks a missing .* "
            r"take the row out of the file.",
        ),
        (replaced(3, 99.9), r"The velocity 99.9 m/s at x = 8, y = 1.25 m .*marks a missing value"),
        (replaced(3, 1e30), r"The velocity 1e\+30 m/s at x = 8, y = 1.25 m .*marks a missing value"),
        (replaced(3, 44.6), r"The velocity 44.6 m/s at x = 8, y = 1.25 m .*: \d+ times .*beyond any thread"),
        (
            scaled(100, section="below"),
            r"5 values of velocity \(section below .*first 47.7 m/s at x = 20,.* in cm/s; c",
        ),
        (scaled(1000, section="below"), r"5 values of velocity \(section below .* in mm/s; check the unit"),
        (scaled(1 / 0.3048, section="above"), r"5 values of velocity \(section above .* in ft/s or km/h; check"),
        (scaled(100), r"15 values of velocity \(all there are; .* in cm/s; .* and the discharge and outlet level"),
        (scaled(0.01, section="below"), r"5 values of velocity \(section below .*: at most 0.0\d+ times"),
        (replaced(15, 97.0), r"The level 97 m at x = 8, y = 0 m \(experiment June\): .* in cm; check the datum"),
        (replaced(15, 9.5), r"The level 9.5 m at x = 8, .*: 8.6 m from .*, as if it were in dm, or mm taken for cm; c"),
        (scaled(10), r"15 values of velocity .*, as if it were in dm/s, or mm/s taken for cm/s; check"),
        (replaced(15, 970.0), r"The level 970 m .* in mm; check the datum"),
        (scaled(0.01, "level"), r"3 values of level .*: 0.94 m from the .*, as if it were in m, taken for cm; check"),
        (scaled(1 / 0.3048, "level", x=20.0), r"The level 3.13\d* m at x = 20, y = 0 m .* in ft; check the datum"),
        (replaced(16, -9999.0), r"The level -9999 m at x = 14.5, y = 0 m .*marks a missing value"),
        (replaced(16, -0.4), r"The level -0.4 m .*: 0.39 m below the lowest bed"),
        (replaced(16, 0.3), r"The level 0.3 m .*: 0.65 m below the outlet level"),
        (
            lambda table: table.assign(value=table["value"].where(table["kind"] != "level", table["value"] + 12.0)),
            r"3 values of level \(all there are; .*: 12 m above the outlet level, .*; check the datum",
        ),
        (
            lambda table: table.assign(value=table["value"].where(table["kind"] != "level", table["value"] + 700.0)),
            r"3 values of level \(all there are; .*: all about 700 m from the outlet level, as from another datum; c",
        ),
        (scaled(1000, "discharge"), r"The discharge 2030 m3/s at x = 5 m .* 10\d\d times .* in l/s; check"),
        (scaled(1 / 0.3048**3, "discharge"), r"The discharge .* in ft3/s; check"),
        (scaled(1e-3, "discharge"), r"The discharge 0.00203 m3/s .*: 0.001 times the smallest stated"),
        (scaled(100, column="standard_error"), r"15 values of velocity .*error of 1.5 m/s is so large"),
        (scaled(0.01, column="standard_error"), r"15 values of velocity .*error of 0.00015 m/s is smaller"),
        (replaced(2, 0.0, "standard_error"), r"The velocity 0.472 m/s .*error of 0 m/s is smaller"),
        (scaled(100, "level", "standard_error"), r"3 values of level .*error of 0.3 m is so large"),
        (scaled(0.01, "level", "standard_error"), r"3 values of level .*error of 3e-05 m is smaller"),
    ],
)
def test_what_no_flow_can_show_is_said_once(tmp_path: Path, change: Change, expected: str) -> None:
    said = said_of(tmp_path, change)
    assert len(said) == 1, said
    assert re.match(expected, said[0]), said


def test_a_wrong_outlet_or_discharge_is_said(tmp_path: Path) -> None:
    deep = said_of(tmp_path, scaled(1.0), ("level: 0.95}", "level: 95}"))
    assert deep == [
        "The outlet level of experiment June, 95 m, makes the outlet 95 m deep on a grid 9 m wide, where the water "
        "moves at 0.0024 m/s; check its unit and its datum, and the unit of the discharge."
    ]
    still = said_of(tmp_path, scaled(1.0), ("level: 0.95}", "level: 12}"), ("discharge: 2.0", "discharge: 0.2"))
    assert [sentence[:40] for sentence in still] == ["The outlet level of experiment June, 12 "]
    litres = said_of(tmp_path, scaled(1.0), ("discharge: 2.0", "discharge: 2000"))
    assert [sentence.split(":")[0][:20] for sentence in litres] == ["15 values of velocit", "The discharge 2.03 m"]


def test_errors_are_not_held_against_a_discharge_that_is_in_doubt(tmp_path: Path) -> None:
    """Velocities across share the section of those along x, and so what is said of it."""

    def across(table: pd.DataFrame) -> pd.DataFrame:
        along = table[table["kind"] == "velocity"]
        return pd.concat([table, along.assign(kind="velocity_across", value=0.01)], ignore_index=True)

    litres = said_of(tmp_path, across, ("discharge: 2.0", "discharge: 2000"))
    assert [sentence.split(":")[0][:20] for sentence in litres] == ["15 values of velocit", "The discharge 2.03 m"]


def test_an_uncertain_discharge_is_taken_at_its_bounds(tmp_path: Path) -> None:
    """3.3 times the stated discharge looks like feet, unless so much is within the prior."""
    wide = "  q: {distribution: loguniform, low: 0.5, high: 9, unit: m3/s}\n  phi:"
    assert said_of(tmp_path, scaled(3.3, section="above")) != []
    assert said_of(tmp_path, scaled(3.3, section="above"), ("discharge: 2.0", "discharge: q"), ("  phi:", wide)) == []


def test_a_steep_reach_above_a_pond_may_be_fast(tmp_path: Path) -> None:
    """The pond at its outlet reaches only part of it: at 1 in 50 the water above is shallow, and not 3 m deep."""
    steep = (
        ("bed_slope: 0.001, level: 0}", "bed_slope: 0.02, level: 6}"),
        ("level: 0.95}", "level: 2.4}"),
        ("y: [-4.5, 4.5]", "y: [-7.5, 7.5]"),
        ("top_width: 9, ", ""),
        ("x: [0, 30]", "x: [0, 300]"),
    )
    case, table = reach(tmp_path, *steep)
    fast = table[table["section"] == "above"].assign(x=50.0)
    fast["value"] = 5.0 * fast["value"] + 0.3  # 2.4 m/s in 0.25 m of water
    assert absurd_values(case, build_site(case), fast) == []
    fast["value"] = 100.0 * fast["value"]
    assert len(absurd_values(case, build_site(case), fast)) == 1


@pytest.mark.parametrize(
    ("value", "mark"),
    [
        (-999, True),
        (9999, True),
        (99.9, True),
        (-9.99, True),
        (1e30, True),
        (-32768, True),
        *((mark, True) for mark in (*MARKS_OF_ANY_COLUMN, *MARKS_OR_VALUES)),
        (0.99, False),
        (98.9, False),
    ],
)
def test_marks_for_a_missing_value_are_known(value: float, mark: bool) -> None:
    assert is_mark(value) == mark


@pytest.mark.parametrize("name", [f"open-{letter}" for letter in "abcdefghijklmnop"])
def test_campaigns_with_any_effect_are_passed_in_silence(tmp_path: Path, name: str) -> None:
    case = imported(name, tmp_path)
    assert absurd_values(case, build_site(case), read_observations(case).table) == []


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (scaled(100, section="D0", experiment="low"), r"17 values of velocity \(section D0 of experiment low; .*cm/s"),
        (scaled(100, section="D0"), r"57 values of velocity \(section D0 of experiment low, .*cm/s"),
        (scaled(100, experiment="high"), r"\d+ values of velocity \(all of experiment high; .*cm/s"),
        (replaced(3, -999.0), r"The velocity -999 m/s at x = 36, y = -1.5 m \(section D0 of experiment low\)"),
        (scaled(100, "level", x=10.0, experiment="mid"), r"The level \d+.* m at x = 10, .*experiment mid.* in cm"),
    ],
)
def test_a_campaign_with_one_wrong_unit_says_where(tmp_path: Path, change: Change, expected: str) -> None:
    case = imported("open-a", tmp_path)
    said = absurd_values(case, build_site(case), change(read_observations(case).table))
    assert len(said) == 1, said
    assert re.match(expected, said[0]), said
