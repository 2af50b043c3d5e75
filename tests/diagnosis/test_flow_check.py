"""Remarks on boundaries, outlet levels, Froude numbers, directions and discharges."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from open_cases import imported
from reach import write_reach
from sound_case import ROWS, SOUND, found_in, odd, read_case

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.site_schema import Inflow
from vegglue.diagnosis.case_check import check_case, critical_remarks
from vegglue.diagnosis.flow_check import (
    ComponentsExchanged,
    FlowUpstream,
    InflowAboveWater,
    InflowWithoutCells,
    LevelsRiseDownstream,
    OutletAboveGauge,
    OutletDry,
    OutletFast,
    OutletWithoutCells,
    SectionsUpstream,
    Supercritical,
    VelocitiesTurned,
    WaterOnSideEdges,
    even_froude,
    remarks_on_directions,
    remarks_on_discharges,
    remarks_on_measured_discharges,
    remarks_on_outlet_levels,
    remarks_on_steep_flow,
    remarks_on_turned_probes,
    remarks_on_turned_velocities,
)
from vegglue.measurements.observations import read_observations

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.mark.parametrize(
    ("old", "new", "remark", "expected"),
    [
        ("outlet: {}", "outlet: {range: [4.01, 4.02]}", OutletWithoutCells, {}),
        ("outlet: {}", "outlet: {range: [4.26, 4.75]}", OutletWithoutCells, {}),
        ("outlet: {}", "outlet: {range: [4, 5]}", OutletDry, {"experiment": "low", "level": 1.0, "bed": 1.09}),
        ("level: 1.0}", "level: -0.5}", OutletDry, {"level": -0.5}),
        ("level: 1.0}", "level: 0.2}", OutletFast, {"experiment": "low", "froude": 1.286}),
        ("bed_slope: 0.001", "bed_slope: 0.2", Supercritical, {"experiment": "low", "slope": 0.2}),
        ("level: 1.0}", "level: 2.0}", WaterOnSideEdges, {"experiment": "low"}),
        ("{side: west}", "{side: west, range: [4.01, 4.02]}", InflowWithoutCells, {"inflow": "upstream"}),
        ("{side: west}", "{side: west, range: [4.26, 4.75]}", InflowWithoutCells, {"inflow": "upstream"}),
        ("{side: west}", "{side: west, range: [4.2, 5]}", InflowAboveWater, {"inflow": "upstream"}),
        ("{side: west}", "{side: south, range: [2, 6]}", InflowAboveWater, {"experiment": "low"}),
    ],
)
def test_an_oddity_is_a_remark(tmp_path, old, new, remark, expected):
    assert old in SOUND
    found = odd(tmp_path, SOUND.replace(old, new))
    assert len(found_in(found, remark, **expected)) == 1, found


def test_a_boundary_without_cells_is_one_remark_of_all_experiments(tmp_path):
    two = SOUND.replace("level: 1.0}", "level: 1.0}\n  high: {discharge: 3.0, level: 1.1}")
    for old, kind in (("outlet: {}", OutletWithoutCells), ("{side: west}", InflowWithoutCells)):
        new = old.replace("{", "{range: [4.01, 4.02], ").replace(", }", "}")
        assert len(found_in(odd(tmp_path, two.replace(old, new)), kind)) == 1


@pytest.mark.parametrize("measured", [True, False])
def test_an_outlet_below_the_bed_is_one_remark_of_every_command(tmp_path, measured):
    """It left simulate without a flow, whether or not anything was measured in the experiment."""
    dry = SOUND.replace("level: 1.0}", "level: 1.0}\n  dry: {discharge: 2.0, level: -0.5}")
    rows = ROWS + ROWS.split("\n", 1)[1].replace("low", "dry") if measured else ROWS
    case, site, observations = read_case(tmp_path, dry, rows)
    (one,) = found_in(check_case(case, site, observations), OutletDry, experiment="dry", level=-0.5, measured=measured)
    assert one in critical_remarks(case, site, observations)
    assert len([remark for remark in check_case(case, site, observations) if "dry" in repr(remark)]) == 2 - measured


def test_a_flume_with_walls_may_have_water_on_its_side_edges(tmp_path):
    full = SOUND.replace("level: 1.0}", "level: 2.0}")
    assert found_in(odd(tmp_path, full), WaterOnSideEdges)
    walled = full.replace("  default: bed", "  default: bed\n  walls: {law: manning, n: 0.011}")
    assert not found_in(odd(tmp_path, walled), WaterOnSideEdges)


STEEP = ("bed_slope: 0.001", "bed_slope: 0.05")


@pytest.mark.parametrize(
    ("changes", "steep"), [([], False), ([("bed_slope: 0.001", "bed_slope: -0.05")], False), ([STEEP], True)]
)
def test_a_steep_channel_is_supercritical(tmp_path, changes, steep):
    case = load_case(write_reach(tmp_path, *changes))
    found = list(remarks_on_steep_flow(case, build_site(case)))
    assert len(found_in(found, Supercritical, experiment="June", slope=0.05)) == len(found) == steep


@pytest.mark.parametrize(
    ("law", "chezy"),
    [("{law: chezy, c: 30}", 30.0), ("{law: manning, n: 0.05}", (2.0 / 3 * 0.05 / 0.05**0.5) ** (3 / 5 / 6) / 0.05)],
)
def test_the_froude_number_is_that_of_even_flow(tmp_path, law, chezy):
    """A floor 3 m wide, 2 m3/s: h = (n q / S^(1/2))^(3/5) for Manning's law."""
    priors = ("  n_b: {distribution: uniform, low: 0.02, high: 0.10, unit: s m^(-1/3)}\n", "")
    case = load_case(write_reach(tmp_path, STEEP, ("{law: manning, n: n_b}", law), priors))
    site = build_site(case)
    found = even_froude(case, site, case.experiments["June"], 0.05)
    assert found == pytest.approx(chezy * (0.05 / 9.81) ** 0.5, rel=0.02)


LINE = "  - {kind: velocity, file: velocities.csv, experiment: June}\n"
BACKWARD = "section,x,y,u\nA,8,-1,-0.4\nA,8,0,-0.5\nB,20,0,-0.4\n"


def directions(
    folder: Path, velocities: str = "", levels: str = "", across: str = "", change: tuple[str, str] = ("", "")
) -> list[object]:
    """Remarks on the brook with other tables."""
    added = {"level": ("levels.csv", levels), "velocity_across": ("across.csv", across)}
    more = [f"  - {{kind: {kind}, file: {file}, experiment: June}}\n" for kind, (file, text) in added.items() if text]
    config = write_reach(folder, (LINE, LINE + "".join(more)), *([change] if change[0] else []))
    if velocities:
        (folder / "velocities.csv").write_text(velocities, encoding="utf-8")
    for file, text in added.values():
        (folder / file).write_text(text, encoding="utf-8")
    case = load_case(config)
    return list(remarks_on_directions(case, read_observations(case)))


@pytest.mark.parametrize("on_centreline", [False, True])
def test_the_whole_stream_reversed(tmp_path, on_centreline):
    change = ("cell: ", "centreline: {parts: [{length: 30}]}, cell: ") if on_centreline else ("", "")
    found = directions(tmp_path, BACKWARD, change=change)
    assert found == [FlowUpstream(("June",), pytest.approx(-0.4), on_centreline)]


def test_one_section_reversed(tmp_path):
    rows = "section,x,y,u\n" + "".join(f"A,8,{y},-0.2\nB,14,{y},0.4\nC,20,{y},0.5\n" for y in (-1, 0, 1))
    assert directions(tmp_path, rows) == [SectionsUpstream("June", ("A",), pytest.approx(-0.2))]


def test_components_exchanged(tmp_path):
    found = directions(tmp_path, "section,x,y,u\nA,8,0,0.02\n", across="section,x,y,v\nA,8,0,-0.4\n")
    assert found == [ComponentsExchanged(("June",), 0.02, 0.4)]


def test_levels_that_rise_downstream(tmp_path):
    found = directions(tmp_path, levels="x,y,level,level_se\n2,0,0.99,0.002\n25,0,1.05,0.002\n")
    assert found == [LevelsRiseDownstream(("June",), (pytest.approx(0.06),), 2.0, 25.0)]


@pytest.mark.parametrize(
    "tables",
    [
        {"levels": "x,y,level,level_se\n2,0,0.99,0.002\n25,0,0.96,0.002\n"},
        {"levels": "x,y,level,level_se\n2,0,0.99,0.002\n25,0,0.992,0.002\n"},
        {"velocities": "section,x,y,u\nA,8,-2,-0.05\nA,8,0,0.5\nA,8,1,0.4\n"},  # an eddy
    ],
)
def test_what_a_brook_may_show_has_no_remark(tmp_path, tables):
    assert directions(tmp_path, **tables) == []


def outlet(folder: Path, last: float, first: float = 1.03, level: str = "1.0") -> list[OutletAboveGauge]:
    """Remarks on a brook at 0.38 m/s, where gauges at x = 5 and 36 m read so much [m]."""
    parts = SOUND.split("simulate:")
    text = parts[0] + "  - {kind: level, file: levels.csv, experiment: low}\nsimulate:" + parts[1]
    (folder / "levels.csv").write_text(f"x,y,level,level_se\n5,0,{first},0.002\n36,0,{last},0.002\n")
    deep = "  deep: {distribution: uniform, low: 0.9, high: 1.1, unit: m}\nobservations:"
    text = text.replace("level: 1.0}", f"level: {level}}}")
    text = text.replace("observations:", deep if level == "deep" else "observations:")
    case, site, observations = read_case(folder, text, "experiment,section,x,y,u,u_se\nlow,A,12,0.7,0.3,0.01\n")
    found = list(remarks_on_outlet_levels(case, site, observations))
    for one in found:
        assert one in critical_remarks(case, site, observations)
        assert one in check_case(case, site, observations)
    return found


def test_an_outlet_above_the_last_gauge(tmp_path):
    assert outlet(tmp_path, 0.95, 0.96) == [OutletAboveGauge(36.0, 4.0, (("low", 0.95, pytest.approx(0.05)),))]


@pytest.mark.parametrize(
    "levels", [{"last": 1.01}, {"last": 1.0}, {"last": 0.992}, {"last": 0.95, "first": 0.96, "level": "deep"}]
)
def test_gauges_as_low_as_velocity_and_errors_allow(tmp_path, levels):
    assert outlet(tmp_path, **levels) == []


@pytest.mark.parametrize("name", ["campaign", "twin", "open-a", "open-p"])
def test_levels_of_shipped_and_open_cases(tmp_path, name):
    case = imported(name, tmp_path) if name.startswith("open") else load_case(CONFIGS / f"{name}.yaml")
    assert list(remarks_on_outlet_levels(case, build_site(case), read_observations(case))) == []


def turned(folder: Path, angles: Mapping[str, Sequence[float]]) -> list[VelocitiesTurned]:
    """Remarks on 0.5 m/s with these angles to the left at sections of each experiment [degrees]."""
    across = (-1.5, -0.5, 0.5, 1.5)
    places = [(name, i, y, angle) for name, some in angles.items() for i, angle in enumerate(some) for y in across]
    for column, part in (("u", np.cos), ("v", np.sin)):
        rows = [f"{name},s{i},{5 + 8 * i},{y},{0.5 * part(np.radians(a)):.5f}\n" for name, i, y, a in places]
        (folder / f"{column}.csv").write_text(f"experiment,section,x,y,{column}\n" + "".join(rows), encoding="utf-8")
    files = "{kind: velocity, file: u.csv}\n  - {kind: velocity_across, file: v.csv}"
    text = SOUND.replace("{kind: velocity, file: velocities.csv}", files)
    text = text.replace("level: 1.0}", "level: 1.0}\n  high: {discharge: 2.0, level: 1.0}")
    case, site, observations = read_case(folder, text)
    found = list(remarks_on_turned_velocities(case, observations))
    for one in found:
        assert one in critical_remarks(case, site, observations)
        assert one in check_case(case, site, observations)
    return found


@pytest.mark.parametrize(
    ("angles", "expected"),
    [
        (
            {"low": (-12.0, -12.7, -11.9), "high": (0.3, -0.5, 0.8)},
            {"side": "right", "experiments": ("low",), "angles": (12.2,), "sections": 3, "others": (("high", 0.2),)},
        ),
        (
            {"low": (5.0, 5.5, 4.8), "high": (5.1, 5.2, 5.0)},
            {"side": "left", "experiments": ("low", "high"), "angles": (5.1, 5.1), "others": ()},
        ),
    ],
)
def test_velocities_that_point_to_one_side(tmp_path, angles, expected):
    assert len(found_in(turned(tmp_path, angles), VelocitiesTurned, **expected)) == 1


@pytest.mark.parametrize(
    "angles",
    [(2.0, 2.1, 1.9), (15.0, 0.5, -0.3), (9.0, -8.0, 7.5, 8.0), (12.0, 12.0), (16.0, 1.0, 2.0)],
    ids=["small", "one section", "a bend", "two sections", "one side by chance"],
)
def test_what_plants_and_bends_do_has_no_remark(tmp_path, angles):
    assert turned(tmp_path, {"low": angles}) == []


def other(folder: Path, text: str) -> list[object]:
    """Remarks on the discharges of d3a, changed; its section lies at x = 402 m and carries 2.66 m3/s."""
    (folder / "other.yaml").write_text(f"extends: {CONFIGS / 'd3a.yaml'}\n{text}", encoding="utf-8")
    case = load_case(folder / "other.yaml")
    site, observations = build_site(case), read_observations(case)
    found = list(remarks_on_discharges(case, site, observations))
    assert found == [one for one in check_case(case, site, observations) if one in found]
    return found


@pytest.mark.parametrize(
    ("gauged", "changed", "off"),
    [
        (1.43, "", False), (0.6, "", True), (2.8, "", True), (0.6, "inflow between", False),
        (14.0, "", False), (0.6, "levels of another datum", False),
    ],
)  # fmt: skip
def test_a_gauging_that_the_sections_contradict(tmp_path, gauged, changed, off):
    """All four sections of an experiment carry 1.4 m3/s; 14 is refused as a wrong unit, which is another remark."""
    case = imported("open-b", tmp_path)
    observations = read_observations(case)
    row = observations.table[observations.table["experiment"] == "low"].iloc[[0]]
    row = row.assign(kind="discharge", section="Q", value=gauged, standard_error=0.07, x=50.0)
    table = pd.concat([observations.table, row], ignore_index=True)
    if changed.startswith("levels"):
        is_level = table["kind"] == "level"
        table = table.assign(value=table["value"].where(~is_level, table["value"] + 410.0))
    if changed.startswith("inflow"):
        inflows = case.inflows | {"all along": Inflow(side="north", range=(0.0, 100.0))}
        flow = case.experiments["low"]
        more = flow.model_copy(update={"discharge": {**flow.discharge, "all along": 0.1}})
        case = case.model_copy(update={"inflows": inflows, "experiments": {**case.experiments, "low": more}})
    observations = replace(observations, table=table)
    found = list(remarks_on_measured_discharges(case, build_site(case), observations))
    assert [(one.experiment, one.x, one.value) for one in found] == [("low", 50.0, gauged)] * off


def test_a_discharge_far_from_the_measured_one(tmp_path):
    (one,) = other(tmp_path, "experiments: {D3a: {discharge: 3.2}}\n")
    assert [(section.section, section.stated) for section in one.sections] == [("D3", (3.2, 3.2))]
    assert one.ratios == pytest.approx((0.83, 0.83), abs=5e-3)


@pytest.mark.parametrize(
    ("enters", "main", "stated"),
    [("420, 422", 2.66, None), ("420, 422", 1.66, 1.66), ("20, 22", 1.66, None), ("400, 404", 1.66, None)],
)
def test_a_section_measures_what_has_entered_above_it(tmp_path, enters, main, stated):
    found = other(
        tmp_path,
        f"inflows: {{stream: {{side: north, range: [{enters}]}}}}\n"
        f"experiments: {{D3a: {{discharge: {{upstream: {main}, stream: 1.0}}}}}}\n",
    )
    assert [one.sections[0].stated for one in found] == ([] if stated is None else [(stated, stated)])
    assert all(one.ratios[0] == pytest.approx(1.6, rel=0.02) for one in found)


@pytest.mark.parametrize(("turn", "found"), [(5.0, 1), (0.0, 0), (1.5, 0)])
def test_a_probe_that_is_turned_at_every_section(tmp_path, turn, found):
    """The same angle beside both neighbours at four sections; noise of 0.3 degrees, and a profile that bends."""
    random = np.random.default_rng(3)
    rows = {"u": [], "v": []}
    for i in range(4):
        for y in np.linspace(-2.0, 2.0, 9):
            angle = np.radians(1.5 * y + random.normal(0.0, 0.3) + (turn if y == 0.5 else 0.0))
            for column, part in (("u", np.cos), ("v", np.sin)):
                rows[column].append(f"low,s{i},{5 + 8 * i},{y},{0.5 * part(angle):.5f}\n")
    for column, some in rows.items():
        (tmp_path / f"{column}.csv").write_text(f"experiment,section,x,y,{column}\n" + "".join(some), encoding="utf-8")
    files = "{kind: velocity, file: u.csv}\n  - {kind: velocity_across, file: v.csv}"
    _, _, observations = read_case(tmp_path, SOUND.replace("{kind: velocity, file: velocities.csv}", files))
    told = [one for one in remarks_on_turned_probes(observations) if abs(one.y - 0.5) < 1e-9]
    assert len(told) == found
    assert all(one.side == "left" and one.angle == pytest.approx(turn, abs=0.5) for one in told)
