"""Cross-sections: both rules, the bed and level where none is stated, and the discharge that velocities carry."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from diagnoses import a_candidate_effect, a_diagnosis, an_anomaly
from open_cases import imported
from reach import write_reach
from report_runs import a_toy
from verdicts import step, verdict_on

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case
from vegglue.cli.printed import show_carried
from vegglue.diagnosis.verdict_rules import OF_DISCHARGES
from vegglue.effects.library import library
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations
from vegglue.measurements.section_discharge import (
    CarriedDischarge,
    CrossSection,
    DischargeMismatch,
    carried_discharges,
    combine,
    conveyance_weights,
    discharge_mismatches,
    fall_of_floor,
    grid_weights,
    mismatched_discharges,
    neighbour_error,
)
from vegglue.measurements.vertical_profile import Column
from vegglue.pages.answer import not_reliable
from vegglue.results.verdict import AmplitudeBeyondPlausible

Y = np.arange(-3.99, 4.0, 0.02)
TRAPEZOID = CrossSection(Y, 0.6667 * np.maximum(np.abs(Y) - 1.5, 0.0), 1.2)
RECTANGLE = CrossSection(Y, np.where(np.abs(Y) < 2.0, 0.0, 5.0), 1.0)


def columns_at(section, position, velocity):
    """Verticals of 50 points each, with velocity(y, height above the bed)."""
    depth = np.interp(position, section.y, section.depth)
    heights = [h * (np.arange(50) + 0.5) / 50 for h in depth]
    return [Column(z, velocity(y, z), np.full(50, 0.01), h) for y, z, h in zip(position, heights, depth, strict=True)]


def discharge(weights, columns):
    return sum(float(weight @ column.velocity) for weight, column in zip(weights, columns, strict=True))


def test_paper_rule_sums_a_linear_profile_exactly():
    position = np.linspace(-1.99, 1.99, 9)
    columns = columns_at(RECTANGLE, position, lambda y, z: 2.0 * z)
    # u = 2 z up to the highest point at 0.99 m, constant above; zero within one cell of the walls
    assert discharge(grid_weights(RECTANGLE, position, columns, 0.01), columns) == pytest.approx(4.0, rel=0.01)


def test_paper_rule_goes_to_zero_between_the_outermost_vertical_and_the_bank():
    position = np.array([-1.0, 1.0])
    columns = columns_at(RECTANGLE, position, lambda y, z: np.ones_like(z))
    # full velocity over 2 m, straight down to zero over 1 m on either side, and to zero below the lowest point
    assert discharge(grid_weights(RECTANGLE, position, columns, 0.002), columns) == pytest.approx(3.0 * 0.995, rel=0.01)


def test_paper_rule_on_dense_verticals_is_the_integral_over_a_trapezoid():
    position = np.arange(-3.2, 3.21, 0.1)
    columns = columns_at(TRAPEZOID, position, lambda y, z: (1.0 - (y / 4.0) ** 2) * np.sqrt(z))
    exact = TRAPEZOID.width * np.sum((1.0 - (Y / 4.0) ** 2) * TRAPEZOID.depth**1.5 / 1.5)
    assert discharge(grid_weights(TRAPEZOID, position, columns, 0.02), columns) == pytest.approx(exact, rel=0.01)


def test_conveyance_rule_is_exact_for_a_constant_froude_number_whatever_the_verticals():
    position = np.array([-2.6, -0.3, 1.9])
    depth = np.interp(position, Y, TRAPEZOID.depth)
    weights = conveyance_weights(TRAPEZOID, position, depth)
    exact = TRAPEZOID.width * np.sum(0.2 * TRAPEZOID.depth**1.5)
    assert weights @ (0.2 * np.sqrt(depth)) == pytest.approx(exact, rel=1e-9)


def test_neighbour_error_is_the_noise_on_a_smooth_profile():
    position = np.cumsum(np.random.default_rng(1).uniform(0.2, 0.6, 400))
    smooth = 0.1 + 0.3 * position - 0.002 * position**2 + 1e-5 * position**3
    assert neighbour_error(position, smooth) == pytest.approx(0.0, abs=1e-9)
    noise = np.random.default_rng(2).normal(0.0, 0.03, position.size)
    assert neighbour_error(position, smooth + noise) == pytest.approx(0.03, rel=0.15)


def test_neighbour_error_of_few_verticals_takes_the_straight_line():
    position, straight = np.array([0.0, 1.0, 3.0]), np.array([0.0, 1.0, 3.0])
    assert neighbour_error(position, straight) == pytest.approx(0.0, abs=1e-12)
    lifted = straight + np.array([0.0, 0.1, 0.0])
    assert neighbour_error(position, lifted) == pytest.approx(0.1 / np.sqrt(1.0 + (2 / 3) ** 2 + (1 / 3) ** 2))
    assert np.isnan(neighbour_error(position[:2], straight[:2]))


def test_discharge_error_takes_the_larger_of_sampling_and_spacing():
    assert combine(2.0, 0.03, 0.01, 0.04).standard_error == pytest.approx(0.05)
    assert combine(2.0, 0.01, 0.03, 0.04).standard_error == pytest.approx(0.05)
    assert combine(2.0, 0.03, float("nan"), 0.04).standard_error == pytest.approx(0.05)


# Of the brook: a floor that falls by 0.001, and 0.95 m at the outlet, 30 m down.
FLOOR_THERE, EXPECTED_THERE = -0.008, 0.95 + (0.0295 - 0.008)
ADV = "{kind: adv, file: adv.csv, experiment: June, section: A, case: A, average: profile%s}"
LEVELS = "  - {kind: level, file: levels.csv, experiment: June}\n"
TWO_GAUGES = "4,0,1.00\n12,0,0.98\n"


def section_at_8(
    folder: Path, more: str = "", levels: bool = False, header: str = "x,y,z,u,v", gauges: str = TWO_GAUGES
) -> Case:
    """The brook with ADV points at x = 8 m, z in the datum of the bed; v is a tenth of u."""
    rows = [f"case,device,{header}"]
    for y in (-1.0, -0.5, 0.0, 0.5, 1.0):
        for z in (0.05, 0.2, 0.4, 0.6, 0.8):
            u = 0.1 * np.log((z - FLOOR_THERE) / 0.002)
            rows.append(f"A,ADV,8,{y},{z},{u:.6f}" + (f",{0.1 * u:.6f}" if "v" in header else ""))
    (folder / "adv.csv").write_text("\n".join(rows), encoding="utf-8")
    (folder / "levels.csv").write_text(f"x,y,level\n{gauges}", encoding="utf-8")
    line = "{kind: velocity, file: velocities.csv, experiment: June}"
    config = write_reach(folder, (f"  - {line}\n", f"  - {ADV % more}\n" + (LEVELS if levels else "")))
    return load_case(config)


def test_the_bed_and_the_expected_level_hold(tmp_path: Path) -> None:
    points = read_observations(section_at_8(tmp_path)).points
    assert np.allclose(points["bed"], FLOOR_THERE)
    assert np.allclose(points["depth"], EXPECTED_THERE - FLOOR_THERE, atol=1e-9)


def test_measured_levels_hold_before_expected_ones(tmp_path: Path) -> None:
    points = read_observations(section_at_8(tmp_path, levels=True)).points
    assert np.allclose(points["depth"], 0.99 - FLOOR_THERE)


@pytest.mark.parametrize(
    ("gauges", "level"),
    [("28,0,0.96\n", 0.98), ("2,0,0.98\n", 0.95 + 0.03 * 22 / 28), ("20,0,0.98\n28,0,0.97\n", 0.992)],
)
def test_above_the_gauges_the_surface_falls_as_the_floor_does_and_below_to_the_outlet(
    tmp_path: Path, gauges: str, level: float
) -> None:
    """It was flat: of a single gauge down a steep reach most points lay above the water. Points and the discharge that
    they carry had two rules.
    """
    case = section_at_8(tmp_path, levels=True, gauges=gauges)
    found = read_observations(case)
    assert np.allclose(found.points["depth"], level - FLOOR_THERE)
    table = found.table
    (of_gauges,), of_file = carried(case, table), table["kind"] != "level"
    stated = case.observations[0].model_copy(update={"surface": level})
    told = case.model_copy(update={"observations": (stated, *case.observations[1:])})
    assert of_gauges.value == pytest.approx(carried(told, table[of_file])[0].value, rel=2e-3)


def test_a_pool_at_the_gauge_is_no_slope() -> None:
    """The discharge of a section upstream of it was summed under a level as much higher as the pool is deep."""
    x = np.arange(0.5, 30.0)
    floor = 0.03 - 0.001 * x
    assert fall_of_floor(x, np.where(np.abs(x - 15.0) < 3.0, floor - 0.5, floor)) == pytest.approx(0.001, rel=0.1)
    assert fall_of_floor(x, -floor) == 0.0


def test_a_level_that_is_given_holds_before_all(tmp_path: Path) -> None:
    points = read_observations(section_at_8(tmp_path, ", surface: 0.9", levels=True)).points
    assert np.allclose(points["depth"], 0.9 - FLOOR_THERE)


def test_velocities_across_are_averaged_like_those_along(tmp_path: Path) -> None:
    table = read_observations(section_at_8(tmp_path, ", across: true")).table
    along, across = (table[table["kind"] == kind] for kind in ("velocity", "velocity_across"))
    assert len(along) == len(across) == 5
    assert np.allclose(across["value"], 0.1 * along["value"], rtol=0.03), "linear below, a law of the wall above"
    assert (across["standard_error"] > 0.0).all()


def test_without_a_column_there_is_nothing_across(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"adv\.csv, row 1: .* v .*`across`"):
        read_observations(section_at_8(tmp_path, ", across: true", header="x,y,z,u"))


def test_even_velocities_among_plants_are_their_own_average(tmp_path: Path) -> None:
    """With zero at the bed the average was 5 % too low, and a diagnosis named `among_plants` for it."""
    case = section_at_8(tmp_path)
    rows = [f"A,ADV,14,{y},{z},0.2" for y in (-1.0, 0.5, 1.0) for z in (0.1, 0.2, 0.4, 0.6, 0.8)]
    (tmp_path / "adv.csv").write_text("\n".join(["case,device,x,y,z,u", *rows]), encoding="utf-8")
    found = read_observations(case)
    plants = found.profiles["plants"].to_numpy(dtype=bool)
    assert plants.tolist() == [False, True, True]
    assert np.allclose(found.table["value"][plants], 0.2)
    assert (found.profiles["fitted_error"][plants] > 0.02 * 0.2).all(), "what the lowest part may be is in the error"


# Water that enters over a stretch of a bank, and a discharge that is not the reported one: more passes the sections.
REALLY_OTHERWISE = {"open-d": ("high", 1.087), "open-m": ("low", 1.11)}
HIGHER = CarriedDischarge("low", "A", 36.0, 2.1, (1.9, 2.3), (1.4, 1.4), 0.85, 17, True)


def faster(table: pd.DataFrame, times: float, experiment: str | None = None) -> pd.DataFrame:
    """All velocities, or those of one experiment, times a factor."""
    chosen = (table["kind"] == "velocity") & (True if experiment is None else table["experiment"] == experiment)
    return table.assign(value=table["value"].where(~chosen, times * table["value"]))


def read(case: Case) -> tuple[Case, pd.DataFrame]:
    return case, read_observations(case).table


def carried(case: Case, table: pd.DataFrame) -> list[CarriedDischarge]:
    return carried_discharges(case, build_site(case), table)


def standard_errors_off(one: CarriedDischarge) -> float:
    assert one.stated is not None
    low, high = one.interval95
    off = one.value - one.stated[0]
    return off / (one.value - low if off > 0.0 else high - one.value) * 1.96


@pytest.mark.parametrize("name", [f"open-{letter}" for letter in "abcdefghijklmnop"])
def test_sections_of_campaigns_carry_what_is_stated(tmp_path: Path, name: str) -> None:
    case, table = read(imported(name, tmp_path))
    found, (experiment, true) = carried(case, table), REALLY_OTHERWISE.get(name, ("", 1.0))
    assert len(found) == 12
    assert all(one.gauged and 0.8 < one.share < 0.95 for one in found)
    assert [one.ratio for one in found if one.experiment == experiment] == pytest.approx(
        [true] * 4 * bool(experiment), rel=0.01
    )
    others = [standard_errors_off(one) for one in found if name not in REALLY_OTHERWISE]
    assert np.abs(others).max(initial=0.0) < 1.2
    assert mismatched_discharges(case, build_site(case), table) == []


def test_velocities_that_carry_half_as_much_again_are_said_of_each_experiment(tmp_path: Path) -> None:
    case, table = read(imported("open-b", tmp_path))
    off = mismatched_discharges(case, build_site(case), faster(table, 1.5))
    assert [one.ratio for one in off] == pytest.approx([1.5] * 12, rel=0.02)
    (together,) = discharge_mismatches(off)
    assert (len(together.sections), together.experiments) == (12, ("low", "mid", "high"))
    first = together.sections[0]
    assert (first.experiment, first.section, first.x, first.stated) == ("low", "D0", 36.0, (1.4, 1.4))
    assert (first.value, *first.interval95) == pytest.approx((2.07, 1.9, 2.24), abs=5e-3)
    alone = mismatched_discharges(case, build_site(case), faster(table, 0.7, "mid"))
    (less,) = discharge_mismatches(alone)
    assert (len(less.sections), less.experiments, less.ratios) == (4, ("mid",), pytest.approx((0.7, 0.71), abs=5e-3))
    assert [len(one.sections) for one in discharge_mismatches([*alone, *off])] == [12, 4]


def test_what_was_not_measured_makes_it_less_certain(tmp_path: Path) -> None:
    """With the verticals of the middle alone, or few of them, 1.3 times the discharge is no longer clearly off."""
    case, table = read(imported("open-b", tmp_path))
    more = faster(table, 1.3)
    assert all(one.clearly_off for one in carried(case, more))
    middle = more[(more["kind"] == "level") | (more["y"].abs() < 1.0)]
    few = more[(more["kind"] == "level") | more["y"].isin([-1.8, -0.6, 0.6, 1.8])]
    for part in (middle, few):
        assert not any(one.clearly_off for one in carried(case, part))
    whole, narrow = carried(case, table)[0], carried(case, table[table.index.isin(middle.index)])[0]
    assert narrow.share < 0.4 < whole.share
    assert np.ptp(narrow.interval95) > 3.0 * np.ptp(whole.interval95)


def test_levels_above_another_datum_are_none_of_a_section(tmp_path: Path) -> None:
    """At 410 m sections were said to carry 800 times the stated discharge, beside the remark on the datum."""
    case, table = read(imported("open-b", tmp_path))
    above_sea = table.assign(value=table["value"].where(table["kind"] != "level", table["value"] + 410.0))
    found = carried(case, above_sea)
    assert not any(one.gauged for one in found)
    assert [one.value for one in found] == [one.value for one in carried(case, table[table["kind"] != "level"])]


def test_without_a_gauge_the_water_may_be_higher(tmp_path: Path) -> None:
    case, table = read(imported("open-b", tmp_path))
    for one in carried(case, table[table["kind"] != "level"]):
        low, high = one.interval95
        assert not one.gauged
        assert high - one.value > 3.0 * (one.value - low), "growth may hold it up, walls are no smoother than smooth"
    assert any(one.clearly_off for one in carried(case, faster(table, 1.5)))
    assert not any(one.clearly_off for one in carried(case, faster(table[table["kind"] != "level"], 0.7)))


def test_the_section_of_the_paper_carries_its_discharge_under_the_level_stated_beside_it() -> None:
    configs = Path(__file__).parents[2] / "configs"
    for name, true in (("d0", 0.986), ("d3a", 1.002), ("d3b", 0.968)):
        (one,) = carried(*read(load_case(configs / f"{name}.yaml")))
        assert one.gauged
        assert one.ratio == pytest.approx(true, abs=2e-3)


def test_few_verticals_of_a_reach_say_little(tmp_path: Path) -> None:
    case, table = read(load_case(write_reach(tmp_path)))
    found = carried(case, table)
    assert [one.section for one in found] == ["above", "patch", "below"]
    assert all(0.9 < one.ratio < 1.1 and one.verticals == 5 and one.share < 0.6 for one in found)
    assert not any(one.clearly_off for one in carried(case, faster(table, 1.3)))


def test_an_experiment_whose_discharge_is_calibrated_is_not_doubted(tmp_path: Path) -> None:
    case, table = read(imported("open-b", tmp_path))
    of_one = {"discharge_error": {"experiments": ["low"], "values": {"relative_error": 0.5}}}
    told = Case.model_validate({**case.model_dump(exclude_unset=True), "effects": of_one, "source": case.source})
    off = mismatched_discharges(told, build_site(told), faster(table, 1.5))
    assert {one.experiment for one in off} == {"mid", "high"}


def test_values_that_no_flow_can_have_are_said_instead(tmp_path: Path) -> None:
    case, table = read(imported("open-b", tmp_path))
    assert all(one.clearly_off for one in carried(case, faster(table, 100.0)))
    assert mismatched_discharges(case, build_site(case), faster(table, 100.0)) == []


@pytest.mark.parametrize(
    ("name", "value"),
    [("wind", 0.3), ("partial_depth", 2.5), ("discharge_error[low]", -2.5), ("discharge_error[mid]", 0.3)],
)
def test_no_name_is_believed_that_does_not_explain_what_sections_carry(name: str, value: float) -> None:
    """Of a scale of 0.5, the second and third are five times what is plausible; the last acts elsewhere."""
    there = (a_candidate_effect(name, amplitude={"value": value}),)
    found = verdict_on(step(name), candidates=there, carried=(HIGHER,))
    assert (found.kind, found.doubts_the_data) == ("cannot-tell", True)
    assert found.reasons == (DischargeMismatch((HIGHER,)),)
    assert [one.name for one in found.effects] == [name]
    assert found.may_explain == ()
    alone = verdict_on(step(name), candidates=there)
    assert alone.kind == ("identified" if abs(value) < 1.0 else "cannot-tell")
    assert alone.reasons == (() if abs(value) < 1.0 else (AmplitudeBeyondPlausible(name, abs(value) / 0.5),))


@pytest.mark.parametrize(
    "name", ["discharge_error[low]", "partial_depth", "lateral_inflow", "probe_gain[A]", "device_gain[adv]"]
)
def test_a_name_that_explains_it_is_given_as_such(name: str) -> None:
    found = verdict_on(step(name), carried=(HIGHER,))
    assert (found.kind, found.doubts_the_data) == ("identified", False)
    assert found.may_explain == (DischargeMismatch((HIGHER,)),)
    assert found.notes[0] == DischargeMismatch((HIGHER,))
    assert verdict_on(step(name)).may_explain == ()


def test_every_section_has_to_be_explained() -> None:
    """An error of the discharge of one experiment does not let more water through another."""
    found = verdict_on(step("discharge_error[mid]"), carried=(HIGHER, replace(HIGHER, experiment="mid")))
    assert (found.kind, found.reasons) == ("cannot-tell", (DischargeMismatch((HIGHER,)),))


def test_water_of_an_effect_in_the_model_is_no_doubt(tmp_path: Path) -> None:
    """It is let in above the sections; below x = 40 m only those further down carry it."""
    case, table = read(imported("open-b", tmp_path))
    for x, experiments in ((0.0, set()), (40.0, {"D0"}), (60.0, {"D0", "D3", "D5", "D7"})):
        spring = {"unlisted_inflow": {"values": {"discharge": 0.5, "x": x, "y": 0.0}}}
        told = Case.model_validate({**case.model_dump(exclude_unset=True), "effects": spring, "source": case.source})
        off = mismatched_discharges(told, build_site(told), faster(table, 1.5))
        assert {one.section for one in off} == experiments


@pytest.mark.parametrize("term", ["inflow", "bed"])
def test_water_that_enters_at_a_place_or_another_bed_explains_it(term: str) -> None:
    assert verdict_on(places=(an_anomaly(term=term),), carried=(HIGHER,)).kind == "none-of-these"


def test_drag_at_a_place_does_not() -> None:
    assert verdict_on(places=(an_anomaly(term="drag"),), carried=(HIGHER,)).kind == "cannot-tell"


def test_effects_of_discharges_are_listed() -> None:
    assert set(OF_DISCHARGES) <= set(library())


def test_the_page_says_that_the_verdict_is_not_to_be_relied_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    doubting = a_diagnosis(verdict={"kind": "cannot-tell", "reasons": (DischargeMismatch((HIGHER,)),)})
    explained, toy = (replace(a_toy(tmp_path), diagnosis=one) for one in (a_diagnosis(), doubting))
    monkeypatch.setattr("vegglue.pages.answer.mismatched_discharges", lambda *_: [HIGHER])
    found, other = not_reliable(toy), not_reliable(explained)
    assert found is not None
    assert (found.verdict, len(found.discharges)) == (True, 1)
    assert other is None or not other.discharges, "what was found may be why"


def test_a_range_that_excludes_the_stated_discharge_is_told_below_the_table(capsys: pytest.CaptureFixture[str]) -> None:
    """Between two and three standard errors it stood in the table alone."""
    sections = [replace(HIGHER, section=name, stated=(at, at)) for name, at in (("B", 1.95), ("C", 1.85), ("D", 1.7))]
    assert [(one.excludes_stated, one.clearly_off) for one in sections] == [(False, False), (True, False), (True, True)]
    show_carried(sections)
    _, _, below = capsys.readouterr().out.partition("- ")
    assert [name for name in "BCD" if f"{name} (low" in below] == ["C"]


def test_every_section_stands_in_the_table_of_a_check(capsys: pytest.CaptureFixture[str]) -> None:
    show_carried([HIGHER, replace(HIGHER, section="B", stated=None, gauged=False)])
    *_, first, second = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert " ".join(first) == "low A 36 2.1 1.9 to 2.3 1.4 1.50 85% measured"
    assert " ".join(second) == "low B 36 2.1 1.9 to 2.3 - - 85% estimated"
