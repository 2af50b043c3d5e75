"""Effects and instruments as candidates: however much of an effect the config states, and what an offset changes."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from linear_baseline import CASE_OF_TWINS as CASE
from linear_baseline import stations_of

from vegglue.calibration.candidates import (
    Candidate,
    Instrument,
    acting_in,
    candidate_in_case,
    candidates_in_case,
    candidates_of,
    cause_of,
    error_columns,
    instruments_of,
    offset_columns,
    patch_candidate,
    with_effect,
)
from vegglue.case.schema import Case, EffectEntry, Observation, Parameter
from vegglue.case.site_schema import FrictionClass, Plants, Value, Zone
from vegglue.diagnosis.child_config import candidate_named, child_tree
from vegglue.effects.library import SHIPPED, library
from vegglue.errors import InputError

SOMEWHERE = Parameter(distribution="uniform", low=5.0, high=20.0, unit="m")


def case_with(effect: str, values: Mapping[str, Value]) -> Case:
    """The twin with an effect that has a name of its own, and a calibrated place."""
    entry = EffectEntry(effect=effect, values=dict(values))
    parameters = {**CASE.parameters, "somewhere": SOMEWHERE}
    return CASE.model_copy(update={"effects": {"own": entry}, "parameters": parameters})


def test_names_that_give_one_key_are_refused() -> None:
    """Of an error of the discharge in each of two experiments the second took the place of the first."""
    experiments = {name: next(iter(CASE.experiments.values())) for name in ("Q 2", "Q/2")}
    case = CASE.model_copy(update={"experiments": experiments})
    with pytest.raises(InputError, match="rename one"):
        candidates_of(case, stations_of(case, ("A",), 5))


@pytest.mark.parametrize(
    ("effect", "values", "name"),
    [
        ("patch_density", {"excess": 0.1}, "patch_density[p1]"),
        ("patch_density", {"excess": 0.1, "patch": 2.0}, "patch_density[p2]"),
        ("patch_density", {"excess": 0.1, "patch": 9.0}, "patch_density"),
        ("unlisted_bed", {"rise": 0.1}, "unlisted_bed[x0,y0]"),
        ("unlisted_bed", {"rise": 0.1, "x": "somewhere", "y": 0.5}, "unlisted_bed[x12.5,y0.5]"),
    ],
)
def test_shapes_that_are_left_alone_or_calibrated_stop_no_search(
    effect: str, values: dict[str, Value], name: str
) -> None:
    """What was accepted beside them was looked for, and the search ended in a KeyError or a ValueError."""
    case = case_with(effect, values)
    assert [one.name for one in candidates_in_case(case).values()] == [name]
    beside = Candidate(library()["bank_trend"])
    assert candidate_in_case(with_effect(case, beside, {}), "bank_trend") == beside


STATION = stations_of(CASE, ("A",), 3)


def test_shapes_calibrated_with_the_amplitude_are_parameters_of_a_case_and_numbers_of_a_cause(tmp_path: Path) -> None:
    others = ("first_other", "second_other", "third_other")
    one = Candidate(library()["inflow_distribution"])
    assert one.settings() == [{"mode": float(mode)} for mode in range(1, 5)]
    added = set(with_effect(CASE, one, {"mode": 2.0}).parameters) - set(CASE.parameters)
    assert added == {f"inflow_distribution_{name}" for name in ("excess", *others)}
    cause = cause_of(CASE, one, {"mode": 2.0})
    assert set(cause.case.parameters) - set(CASE.parameters) == {cause.parameter}
    assert cause.case.effects[one.key].values == {"excess": cause.parameter, "mode": 2.0, **dict.fromkeys(others, 0.0)}
    assert set(child_tree(CASE, tmp_path / "child.yaml", [(one, {"mode": 2.0})])["parameters"]) == added


def test_discharges_may_be_off_together() -> None:
    """One current meter, or one rating, gives them all: a reach with both 3 % high was told to be steeper."""
    names = {one.name for one in candidates_of(CASE, STATION) if one.effect.name == "discharge_error"}
    assert names == {"discharge_error", *(f"discharge_error[{name}]" for name in CASE.experiments)}
    one = next(iter(CASE.experiments))
    alone = CASE.model_copy(update={"experiments": {one: CASE.experiments[one]}})
    names = {each.name for each in candidates_of(alone, STATION) if each.effect.name == "discharge_error"}
    assert names == {f"discharge_error[{one}]"}


def test_an_excluded_effect_is_no_candidate() -> None:
    both = {one.name for one in candidates_of(CASE, STATION)}
    without = CASE.model_copy(update={"exclude": {"wind": "indoors", "unlisted_bed": "a flume of glass"}})
    assert both - {one.name for one in candidates_of(without, STATION)} == {"wind"}


@pytest.mark.parametrize(("heights", "offered"), [(2, True), (3, False)])
def test_heights_of_a_section_with_a_number_for_a_name_are_counted(tmp_path: Path, heights: int, offered: bool) -> None:
    """pandas took the column for numbers, found no row of case "1", and partial sampling was a candidate anywhere."""
    rows = [f"1, adv, 5.0, {y}, {0.1 * (1 + k)}, 0.3\n" for y in (-0.5, 0.5) for k in range(heights)]
    (tmp_path / "points.csv").write_text("case, device, x, y, z, u\n" + "".join(rows), encoding="utf-8")
    points = Observation(
        kind="adv", file=tmp_path / "points.csv", experiment="low", section="A", case="1", average="profile"
    )
    case = CASE.model_copy(update={"observations": (points,)})
    assert any(one.effect.name == "partial_depth" for one in candidates_of(case, STATION)) == offered


@pytest.mark.parametrize(
    "beside",
    [
        Candidate(library()["wind"]),
        acting_in(library()["discharge_error"], "experiment", ("mid",)),
        acting_in(library()["probe_gain"], "section", ("A",)),
        patch_candidate(library()["patch_density"], 1, CASE),
    ],
    ids=lambda one: one.name,
)
def test_an_effect_of_the_case_is_not_missing_whatever_its_key(beside: Candidate) -> None:
    """Keys were compared: `my_wind: {effect: wind, ...}` was in the case, and wind was proposed as missing."""
    listed = with_effect(CASE, beside, {}).effects[beside.key]
    own = listed.model_copy(update={"effect": beside.effect.name})
    case = CASE.model_copy(update={"effects": {"my_own": own}})
    before, after = ({one.name for one in candidates_of(of, STATION)} for of in (CASE, case))
    assert before - after == {beside.name}
    with pytest.raises(InputError, match="is at work in twin already"):
        candidate_named(case, STATION, beside.name)


def test_an_effect_elsewhere_is_still_a_candidate() -> None:
    """What acts in one experiment only may be missing in the others; in all by their names it is everywhere."""
    wind = library()["wind"]
    of_some = EffectEntry(effect="wind", values={wind.amplitude.name: 1.0}, experiments=("low",))
    of_all = of_some.model_copy(update={"experiments": tuple(CASE.experiments)})
    for entry, proposed in ((of_some, True), (of_all, False)):
        case = CASE.model_copy(update={"effects": {"own": entry}})
        assert ("wind" in [one.name for one in candidates_of(case, STATION)]) == proposed


def test_what_cannot_be_is_no_candidate() -> None:
    """Walls are those of a laboratory; without plants, banks or gauges nothing is wrong with them."""
    walls = FrictionClass(law="manning", n=0.01)
    indoors = CASE.model_copy(update={"friction": CASE.friction.model_copy(update={"walls": walls})})
    bare = CASE.model_copy(update={"plants": Plants()})
    without_gauges = STATION[STATION["kind"] != "level"]
    before = {one.effect.name for one in candidates_of(CASE, STATION)}
    in_flume = {one.effect.name for one in candidates_of(indoors, STATION)}
    assert {"wind", "lateral_inflow", "bank_drag_trend"} <= before - in_flume
    of_plants = {one.name for one in SHIPPED if "plants" in one.needs}
    assert not of_plants & {one.effect.name for one in candidates_of(bare, STATION)}
    assert not {"gauge_datum", "gauge_head"} & {one.effect.name for one in candidates_of(CASE, without_gauges)}


def test_a_shear_layer_needs_two_streams() -> None:
    """On an even floor of one surface none grows; between two surfaces, or from an inflow of two speeds, one may."""

    def grows(case: Case) -> bool:
        return "growing_shear_layer" in {one.effect.name for one in candidates_of(case, STATION)}

    bed = CASE.friction.classes[CASE.friction.default]
    left = Zone.model_validate({"class": "grass", "y": (0.0, 1.5)})
    friction = {"classes": {**CASE.friction.classes, "grass": bed}, "zones": (*CASE.friction.zones, left)}
    two = CASE.model_copy(update={"friction": CASE.friction.model_copy(update=friction)})
    assert not grows(CASE)
    assert grows(two)
    assert grows(case_with("inflow_skew", {}))


def readings(*rows: tuple[str, str, float, float]) -> pd.DataFrame:
    """kind, experiment, x and y of each."""
    return pd.DataFrame(rows, columns=["kind", "experiment", "x", "y"])


# Two experiments; sections at x = 5 and 9 with probes at y = -1, 0 and (in the first alone) 1; a gauge, and a gauging.
USED = readings(
    ("velocity", "low", 5.0, -1.0), ("velocity", "low", 5.0, 0.0), ("velocity", "low", 5.0, 1.0),
    ("velocity", "low", 9.0, -1.0), ("level", "low", 2.0, 0.0),
    ("velocity", "high", 5.0, -1.0), ("velocity", "high", 9.0, 0.0), ("level", "high", 2.0, 0.0),
    ("discharge", "high", 2.0, 0.0),
)  # fmt: skip


def rows_of(some: tuple[Instrument, ...]) -> set[tuple[int, ...]]:
    return {one.readings for one in some}


def test_every_reading_may_be_off_alone() -> None:
    found = instruments_of(USED)["reading"]
    assert [one.readings for one in found] == [(row,) for row in range(len(USED))]
    assert (found[3].x, found[3].y) == (9.0, -1.0)


def test_a_probe_may_be_off_wherever_it_stood() -> None:
    """At one place in several experiments, and at one y in several sections; what stood once is a reading."""
    found = instruments_of(USED)
    assert rows_of(found["position"]) == {(0, 5)}
    assert rows_of(found["probe"]) == {(0, 3, 5), (1, 6)}
    assert all(np.isnan(one.x) for one in found["probe"])
    assert {one.y for one in found["probe"]} == {-1.0, 0.0}
    assert (found["position"][0].x, found["position"][0].y) == (5.0, -1.0)


def test_a_probe_on_the_axis_is_one_whatever_side_of_it_was_rounded() -> None:
    """Places turned from a map lie at 0 or at -0, which were two probes."""
    turned = USED.assign(y=[-1.0, 0.0, 1.0, -1.0, -0.0, -1.0, -1e-9, 0.0, 0.0])
    for kind in ("probe", "gauge"):
        assert rows_of(instruments_of(turned)[kind]) == rows_of(instruments_of(USED)[kind])


def test_a_gauge_may_be_off_in_all_experiments_and_is_no_probe() -> None:
    found = instruments_of(USED)
    assert rows_of(found["gauge"]) == {(4, 7)}
    assert not any({4, 7, 8} & set(one.readings) for one in (*found["position"], *found["probe"]))


def test_the_same_readings_are_no_two_instruments() -> None:
    """With one section alone a probe at one y is one at one place."""
    found = instruments_of(USED[USED["x"] < 9.0].reset_index(drop=True))
    assert rows_of(found["position"]) == {(0, 4)}
    assert rows_of(found["probe"]) == set()


def test_an_offset_is_the_same_in_all_readings_of_an_instrument() -> None:
    some = (Instrument("probe", (0, 3), np.nan, 1.0), Instrument("reading", (2,), 5.0, 1.0))
    assert offset_columns(some, 4).T.tolist() == [[1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]]
    assert offset_columns((), 4).shape == (4, 0)


def test_a_probe_may_be_off_by_a_factor_too_and_a_gauge_may_not() -> None:
    value = np.array([0.3, 0.5, 0.7, 0.4])
    probe, gauge = Instrument("probe", (0, 3), np.nan, 1.0), Instrument("gauge", (1, 2), 2.0, 0.0)
    assert error_columns(probe, value).T.tolist() == [[1.0, 0.0, 0.0, 1.0], [0.3, 0.0, 0.0, 0.4]]
    assert error_columns(gauge, value).T.tolist() == [[0.0, 1.0, 1.0, 0.0]]
    assert error_columns(probe, np.zeros(4)).shape == (4, 1), "of nothing a factor is nothing"
