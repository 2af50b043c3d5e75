"""What could be measured next: where, for how many hours, and at which discharge."""

import re
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from vegglue.case.channel_geometry import expected_depth
from vegglue.case.config import load_case
from vegglue.case.gridded_site import in_experiment
from vegglue.case.schema import Planned, PlannedHours
from vegglue.diagnosis.next_measurement import HIGHER, LEVEL_POWER, planned, with_other_discharges
from vegglue.engine.interface import Model
from vegglue.workflow.case_run import CaseRun

HOURS = PlannedHours()


@pytest.fixture(scope="module")
def model() -> Model:
    return CaseRun(load_case(Path(__file__).parents[2] / "configs" / "twin.yaml")).model


def test_a_section_again_costs_its_own_verticals(model: Model) -> None:
    station = model.station
    of_one = station["section"] == "A"
    few = station[~of_one | (station["y"].abs() < 0.5)].reset_index(drop=True)
    _, plans = planned(replace(model, station=few), model.case)
    again = {plan.name.split("(")[0]: plan for plan in plans if "again" in plan.name}
    assert len(again) == few.loc[few["section"] != "", "section"].nunique()
    for plan in again.values():
        assert plan.hours == pytest.approx(HOURS.transect + len(plan.stations) * HOURS.vertical)
    assert len({plan.hours for plan in again.values()}) > 1


def test_where_levels_alone_were_measured_gauges_are_thought_of(model: Model) -> None:
    levels = model.station[model.station["kind"] == "level"].reset_index(drop=True)
    _, plans = planned(replace(model, station=levels), model.case)
    assert plans
    assert {kind for plan in plans for kind in plan.stations["kind"]} == {"level"}


def test_small_discharges_have_names_of_their_own(model: Model) -> None:
    small = {
        name: one.model_copy(update={"discharge": dict.fromkeys(one.discharge, 0.004)})
        for name, one in list(model.case.experiments.items())[:1]
    }
    shallow = replace(model, case=model.case.model_copy(update={"experiments": small}))
    further = [name for name in with_other_discharges(shallow, (0.25, 0.5)).experiments if name not in small]
    assert [name.split(" (")[0] for name in further] == ["at 0.001 m3/s", "at 0.002 m3/s", "at 0.0056 m3/s"]
    assert re.fullmatch(r"at 0.001 m3/s \(level at the outlet about 0\.\d\d m\)", further[0]), further[0]


def test_a_section_that_a_boat_measured_beside_itself_is_thought_of_once(model: Model) -> None:
    """It was listed once for each experiment, 2 cm apart."""
    station = model.station
    experiment = {name: 0.02 * number for number, name in enumerate(model.case.experiments)}
    boat = station.assign(x=station["x"] + station["experiment"].map(experiment))
    at_line, by_boat = (
        [plan for plan in planned(replace(model, station=one), model.case)[1] if "again" in plan.name]
        for one in (station, boat)
    )
    assert len(experiment) > 1
    assert [plan.hours for plan in by_boat] == [plan.hours for plan in at_line]
    assert [plan.x for plan in by_boat] == pytest.approx([plan.x for plan in at_line], abs=0.03)


def test_what_could_be_measured_hangs_on_no_order_of_rows(model: Model) -> None:
    """Which experiment a section is planned after, of two that measured as many verticals, the table's order said."""
    experiment = {name: 0.02 * number for number, name in enumerate(model.case.experiments)}
    boat = model.station.assign(x=model.station["x"] + model.station["experiment"].map(experiment))
    turned = boat.iloc[::-1].reset_index(drop=True)
    before, after = (planned(replace(model, station=one), model.case)[1] for one in (boat, turned))
    assert [(plan.name, plan.x, plan.hours) for plan in after] == [(plan.name, plan.x, plan.hours) for plan in before]


def test_other_discharges_are_thought_of_on_the_site_at_hand(model: Model) -> None:
    """The bed was read from its files again."""
    deeper = replace(model, site=replace(model.site, bed=model.site.bed - 0.5))
    levels = [
        [float(one.level) for name, one in found.experiments.items() if name not in model.case.experiments]
        for found in (with_other_discharges(one, (0.5,)) for one in (model, deeper))
    ]
    assert levels[1][0] < levels[0][0]


def test_another_discharge_flows_over_the_bed_of_the_experiment_it_is_like(model: Model) -> None:
    """It was given the bed of the case, and its level as if that lay under the experiment, 0.3 m higher here."""
    low, *_, high = model.case.experiments
    scoured = model.case.experiments[low].model_copy(update={"bed": model.case.bed})
    case = model.case.model_copy(update={"experiments": {**model.case.experiments, low: scoured}})
    site = replace(model.site, own={low: replace(model.site, bed=model.site.bed - 0.3)})
    wide, _ = planned(here := replace(model, case=case, site=site), with_other_discharges(here, (0.25,)))
    lower, higher = (name for name in wide.case.experiments if name not in case.experiments)

    def depth(name: str) -> float:
        return float(wide.case.experiments[name].level) - float(in_experiment(wide.site, name).bed[-1].min())

    assert depth(lower) == pytest.approx(0.25**LEVEL_POWER * depth(low))
    assert depth(higher) == pytest.approx(HIGHER[0] ** LEVEL_POWER * depth(high))


def test_no_vertical_is_planned_where_a_lower_discharge_leaves_it_dry(model: Model) -> None:
    """A section was planned, and its hours counted, as at the highest discharge, beside the water too."""
    wide, plans = planned(model, with_other_discharges(model, (0.25,)))
    lower, higher = (
        [plan for plan in plans if "the section" in plan.name and plan.experiment == name]
        for name in wide.case.experiments
        if name not in model.case.experiments
    )
    assert 0 < len(lower) == len(higher)
    grid = wide.site.grid
    for plan, full in zip(lower, higher, strict=True):
        site = in_experiment(wide.site, plan.experiment)
        depth = expected_depth(wide.case, site, wide.case.experiments[plan.experiment])
        at = abs(grid.x - plan.x).argmin(), [abs(grid.y - y).argmin() for y in plan.stations["y"]]
        assert (depth[at] > 0).all()
        assert 0 < len(plan.stations) <= len(full.stations)
        assert plan.hours == pytest.approx(full.hours - HOURS.vertical * (len(full.rows) - len(plan.rows)))
    assert sum(len(plan.rows) for plan in lower) < sum(len(full.rows) for full in higher)


def test_sections_of_one_experiment_are_two_however_near(model: Model) -> None:
    station = model.station
    beside = station[station["section"] == "A"].assign(section="beside", x=lambda of: of["x"] + 0.1)
    both = pd.concat([station, beside], ignore_index=True)
    before, after = (planned(replace(model, station=one), model.case)[1] for one in (station, both))
    assert sum("again" in plan.name for plan in after) == sum("again" in plan.name for plan in before) + 1


def test_hours_are_those_of_the_config(model: Model) -> None:
    case = model.case.model_copy(update={"planned": Planned(costs=PlannedHours(gauge=2.0, discharge=9.0))})
    usual, changed = (planned(replace(model, case=one), one)[1] for one in (model.case, case))
    more = {before.name: after.hours - before.hours for before, after in zip(usual, changed, strict=True)}
    assert {round(hours, 9) for name, hours in more.items() if "gauge" in name} == {1.5}
    assert {round(hours, 9) for name, hours in more.items() if "gauge" not in name} == {0.0}
