"""Values that no flow can have are found, with their place and their unit; what an effect may do is not."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from open_cases import imported
from reach import write_reach

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case
from vegglue.measurements.observations import read_observations
from vegglue.measurements.plausibility import (
    MARKS_OF_ANY_COLUMN,
    MARKS_OR_VALUES,
    ImplausibleOutlet,
    ImplausibleValues,
    Symptom,
    implausible_levels,
    implausible_values,
    is_mark,
)

LEVELS = [(8.0, 0.97), (14.5, 0.965), (20.0, 0.955)]  # x, level [m]
Change = Callable[[pd.DataFrame], pd.DataFrame]
Found = list[ImplausibleOutlet | ImplausibleValues]


def reach(folder: Path, *changes: tuple[str, str]) -> tuple[Case, pd.DataFrame]:
    """The reach of the README, with errors, three gauges and a gauging."""
    case = load_case(write_reach(folder, *changes))
    table = read_observations(case).table.assign(standard_error=0.015)
    row = table.iloc[0].to_dict() | {"section": "", "y": 0.0}
    more = [row | {"kind": "level", "x": x, "value": z, "standard_error": 0.003} for x, z in LEVELS]
    gauging = row | {"kind": "discharge", "x": 5.0, "value": 2.03, "standard_error": 0.1}
    return case, pd.concat([table, pd.DataFrame([*more, gauging])], ignore_index=True)


def found_in(folder: Path, change: Change, *changes: tuple[str, str]) -> Found:
    case, table = reach(folder, *changes)
    return implausible_values(case, build_site(case), change(table))


def scaled(factor: float, kind: str = "velocity", column: str = "value", **where: object) -> Change:
    """Some values of a kind times a factor."""

    def change(table: pd.DataFrame) -> pd.DataFrame:
        chosen = (table["kind"] == kind) & np.all([table[key] == value for key, value in where.items()] or True, axis=0)
        assert chosen.any()
        return table.assign(**{column: table[column].where(~chosen, factor * table[column])})

    return change


def raised(by: float) -> Change:
    """All levels, by so much [m]."""
    return lambda table: table.assign(value=table["value"].where(table["kind"] != "level", table["value"] + by))


def replaced(row: int, value: float, column: str = "value") -> Change:
    return lambda table: table.assign(**{column: table[column].where(table.index != row, value)})


def is_of(found: Found, symptom: Symptom, **expected: Any) -> bool:
    """Whether one thing alone was found, with these values; numbers to two digits."""
    (one,) = found
    assert isinstance(one, ImplausibleValues)
    for name, value in {"symptom": symptom, "unit": "", **expected}.items():
        near = name in ("size", "first")
        assert getattr(one, name) == (pytest.approx(value, rel=0.05) if near else value), name
    return True


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
    assert found_in(tmp_path, change) == []


FOURTH = {"quantity": "velocity", "count": 1, "total": 15, "places": (("June", "above"),)}
BELOW = {"quantity": "velocity", "count": 5, "total": 15, "places": (("June", "below"),)}
ALL = {"quantity": "velocity", "count": 15, "total": 15, "places": (("June", None),)}
GAUGE = {"quantity": "level", "si_unit": "m", "count": 1, "total": 3, "places": (("June", ""),)}
GAUGES = {"quantity": "level", "count": 3, "total": 3, "instrument": "gauge"}
GAUGING = {"quantity": "discharge", "si_unit": "m3/s", "count": 1, "total": 1}


@pytest.mark.parametrize(
    ("change", "symptom", "expected"),
    [
        (replaced(3, -999.0), Symptom.MISSING_MARK, FOURTH | {"first": (-999.0, 8.0, 1.25), "si_unit": "m/s"}),
        (replaced(3, 99.9), Symptom.MISSING_MARK, FOURTH | {"first": (99.9, 8.0, 1.25)}),
        (replaced(3, 1e30), Symptom.MISSING_MARK, FOURTH),
        (replaced(3, 44.6), Symptom.ISOLATED, FOURTH),
        (scaled(100, section="below"), Symptom.FAST, BELOW | {"unit": "cm/s", "first": (47.7, 20.0, -2.0)}),
        (scaled(1000, section="below"), Symptom.FAST, BELOW | {"unit": "mm/s"}),
        (scaled(1 / 0.3048, section="above"), Symptom.FAST, {"count": 5, "unit": "ft/s or km/h"}),
        (scaled(100), Symptom.FAST, ALL | {"unit": "cm/s"}),
        (scaled(10), Symptom.FAST, ALL | {"unit": "dm/s, or mm/s taken for cm/s"}),
        (scaled(0.01, section="below"), Symptom.SLOW, BELOW),
        (replaced(15, 97.0), Symptom.LEVEL_UNIT, GAUGE | {"unit": "cm", "first": (97.0, 8.0, 0.0)}),
        (replaced(15, 9.5), Symptom.LEVEL_UNIT, GAUGE | {"unit": "dm, or mm taken for cm", "size": 8.55}),
        (replaced(15, 970.0), Symptom.LEVEL_UNIT, GAUGE | {"unit": "mm"}),
        (scaled(0.01, "level"), Symptom.LEVEL_UNIT, GAUGES | {"unit": "m, taken for cm", "size": 0.94}),
        (scaled(1 / 0.3048, "level", x=20.0), Symptom.LEVEL_UNIT, GAUGE | {"unit": "ft", "first": (3.13, 20.0, 0.0)}),
        (replaced(16, -9999.0), Symptom.MISSING_MARK, GAUGE | {"first": (-9999.0, 14.5, 0.0)}),
        (replaced(16, -0.4), Symptom.BELOW_BED, GAUGE | {"size": 0.39}),
        (replaced(16, 0.3), Symptom.LOW, GAUGE | {"size": 0.65}),
        (raised(12.0), Symptom.HIGH, GAUGES | {"size": 12.0}),
        (raised(700.0), Symptom.DATUM, GAUGES | {"size": 700.0}),
        (scaled(1000, "discharge"), Symptom.LARGE_DISCHARGE, GAUGING | {"unit": "l/s", "size": 1015.0}),
        (scaled(1 / 0.3048**3, "discharge"), Symptom.LARGE_DISCHARGE, GAUGING | {"unit": "ft3/s"}),
        (scaled(1e-3, "discharge"), Symptom.SMALL_DISCHARGE, GAUGING | {"size": 0.001}),
        (scaled(100, column="standard_error"), Symptom.LARGE_ERROR, ALL | {"size": 1.5}),
        (scaled(0.01, column="standard_error"), Symptom.SMALL_ERROR, ALL | {"size": 0.00015}),
        (replaced(2, 0.0, "standard_error"), Symptom.SMALL_ERROR, FOURTH | {"size": 0.0}),
        (scaled(100, "level", "standard_error"), Symptom.LARGE_ERROR, GAUGES | {"size": 0.3}),
        (scaled(0.01, "level", "standard_error"), Symptom.SMALL_ERROR, GAUGES | {"size": 3e-5}),
    ],
)
def test_what_no_flow_can_show_is_found_once(
    tmp_path: Path, change: Change, symptom: Symptom, expected: Mapping[str, Any]
) -> None:
    assert is_of(found_in(tmp_path, change), symptom, **expected)


def test_a_unit_is_a_value_of_its_own_and_no_part_of_the_problem(tmp_path: Path) -> None:
    """Two sections of one experiment in two units are one problem with two units."""
    both = found_in(tmp_path, lambda table: scaled(1000, section="below")(scaled(100, section="above")(table)))
    assert [(one.symptom, one.unit, one.places) for one in both] == [
        (Symptom.FAST, "cm/s", (("June", "above"),)),
        (Symptom.FAST, "mm/s", (("June", "below"),)),
    ]


def test_a_level_with_a_senseless_error_is_no_implausible_level(tmp_path: Path) -> None:
    case, table = reach(tmp_path)
    site = build_site(case)
    assert not implausible_levels(case, site, scaled(100, "level", "standard_error")(table)).any()
    off = implausible_levels(case, site, replaced(15, 97.0)(replaced(3, -999.0)(table)))
    assert list(off.index[off]) == [15]


def test_a_wrong_outlet_or_discharge_is_found(tmp_path: Path) -> None:
    (deep,) = found_in(tmp_path, scaled(1.0), ("level: 0.95}", "level: 95}"))
    assert isinstance(deep, ImplausibleOutlet)
    assert (deep.experiment, deep.level) == ("June", 95.0)
    assert (deep.depth, deep.width, deep.velocity) == pytest.approx((95.0, 9.0, 0.0024), rel=0.03)
    (still,) = found_in(tmp_path, scaled(1.0), ("level: 0.95}", "level: 12}"), ("discharge: 2.0", "discharge: 0.2"))
    assert isinstance(still, ImplausibleOutlet)
    assert still.level == 12.0


@pytest.mark.parametrize("across", [False, True])
def test_errors_are_not_held_against_a_discharge_that_is_in_doubt(tmp_path: Path, across: bool) -> None:
    """Velocities across share the section of those along x, and so what is found of it."""

    def change(table: pd.DataFrame) -> pd.DataFrame:
        along = table[table["kind"] == "velocity"]
        return pd.concat([table, along.assign(kind="velocity_across", value=0.01)] if across else [table])

    litres = found_in(tmp_path, lambda table: change(table).reset_index(), ("discharge: 2.0", "discharge: 2000"))
    assert [(one.quantity, one.count, one.symptom) for one in litres] == [
        ("velocity", 15, Symptom.SLOW),
        ("discharge", 1, Symptom.SMALL_DISCHARGE),
    ]


def test_an_uncertain_discharge_is_taken_at_its_bounds(tmp_path: Path) -> None:
    """3.3 times the stated discharge looks like feet, unless so much is within the prior."""
    wide = "  q: {distribution: loguniform, low: 0.5, high: 9, unit: m3/s}\n  phi:"
    assert found_in(tmp_path, scaled(3.3, section="above")) != []
    assert found_in(tmp_path, scaled(3.3, section="above"), ("discharge: 2.0", "discharge: q"), ("  phi:", wide)) == []


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
    assert implausible_values(case, build_site(case), fast) == []
    fast["value"] = 100.0 * fast["value"]
    assert len(implausible_values(case, build_site(case), fast)) == 1


@pytest.mark.parametrize(
    ("value", "mark"),
    [
        *((value, True) for value in (-999, 9999, 99.9, -9.99, 1e30, -32768, *MARKS_OF_ANY_COLUMN, *MARKS_OR_VALUES)),
        (0.99, False),
        (98.9, False),
    ],
)
def test_marks_for_a_missing_value_are_known(value: float, mark: bool) -> None:
    assert is_mark(value) == mark


@pytest.mark.parametrize("name", [f"open-{letter}" for letter in "abcdefghijklmnop"])
def test_campaigns_with_any_effect_are_passed_in_silence(tmp_path: Path, name: str) -> None:
    case = imported(name, tmp_path)
    assert implausible_values(case, build_site(case), read_observations(case).table) == []


LOW, HIGH = (("low", "D0"),), (("high", None),)


@pytest.mark.parametrize(
    ("change", "symptom", "expected"),
    [
        (scaled(100, section="D0", experiment="low"), Symptom.FAST, {"count": 17, "unit": "cm/s", "places": LOW}),
        (
            scaled(100, section="D0"), Symptom.FAST,
            {"count": 57, "unit": "cm/s", "places": (*LOW, ("mid", "D0"), ("high", "D0"))},
        ),
        (scaled(100, experiment="high"), Symptom.FAST, {"unit": "cm/s", "places": HIGH}),
        (replaced(3, -999.0), Symptom.MISSING_MARK, {"count": 1, "first": (-999.0, 36.0, -1.5), "places": LOW}),
        (scaled(100, "level", x=10.0, experiment="mid"), Symptom.LEVEL_UNIT, {"count": 1, "unit": "cm"}),
    ],
)  # fmt: skip
def test_a_campaign_with_one_wrong_unit_shows_its_place(
    tmp_path: Path, change: Change, symptom: Symptom, expected: Mapping[str, Any]
) -> None:
    case = imported("open-a", tmp_path)
    assert is_of(implausible_values(case, build_site(case), change(read_observations(case).table)), symptom, **expected)
