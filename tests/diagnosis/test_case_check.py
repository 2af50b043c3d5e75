"""`vegglue check`: each oddity is said in a sentence, a sound case is passed in silence, and the channel is drawn."""

import re
from pathlib import Path

import numpy as np
import pytest
from sound_case import ROWS, SOUND, odd

from vegglue.case.channel_geometry import expected_depth
from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.polygons import distance_to_outline
from vegglue.diagnosis.boundaries import remarks_on_discharges
from vegglue.diagnosis.case_check import check_case, doubts_about
from vegglue.measurements.observations import read_observations
from vegglue.pages.channel import save_channel_figure

CONFIGS = Path(__file__).parents[2] / "configs"


def test_a_sound_case_is_passed_in_silence(tmp_path):
    assert odd(tmp_path) == []


def test_a_patch_on_the_map_is_told_as_that(tmp_path):
    patch = SOUND.index("x: [", SOUND.index("patches"))
    west, east = SOUND[patch:].split("[")[1].split("]")[0].split(",")
    on_map = SOUND[:patch] + SOUND[patch:].replace(
        f"x: [{west},{east}]", f"x: [{1000 + int(west)}, {1000 + int(east)}]", 1
    )
    on_map = on_map.replace("y: [0, 1.5], stems", "y: [2000, 2001.5], stems")
    framed = on_map + "frame: {origin: [1000, 2000], angle: 0}\n"
    assert any("Patch p1 covers no cell: its corners are places on the map" in one for one in odd(tmp_path, framed))
    assert any("Patch p1 covers no cell: it lies outside the grid, at x" in one for one in odd(tmp_path, on_map))


@pytest.mark.parametrize(
    ("measured", "advice"), [(True, r"the bed\."), (False, r"the bed, or take the experiment out, in ")]
)
def test_an_outlet_below_the_bed_is_said_once_and_before_every_command(tmp_path, measured, advice):
    """It left simulate without a flow, whether or not anything was measured in the experiment."""
    dry = SOUND.replace("level: 1.0}", "level: 1.0}\n  dry: {discharge: 2.0, level: -0.5}")
    rows = ROWS + ROWS.split("\n", 1)[1].replace("low", "dry") if measured else ROWS
    said = [one for one in odd(tmp_path, dry, rows) if "dry" in one and "no used observation" not in one]
    assert len(said) == 1, said
    assert re.match(r"The outlet level of experiment dry, -0\.5 m, .* no command finds a flow: .*" + advice, said[0])
    case = load_case(tmp_path / "sound.yaml")
    assert said[0] in doubts_about(case, build_site(case), read_observations(case))


def test_a_flume_with_walls_is_not_told_to_widen_its_grid(tmp_path):
    full = SOUND.replace("level: 1.0}", "level: 2.0}")
    walled = full.replace("  default: bed", "  default: bed\n  walls: {law: manning, n: 0.011}")
    assert [sentence for sentence in odd(tmp_path, full) if "widen" in sentence]
    assert not [sentence for sentence in odd(tmp_path, walled) if "widen" in sentence]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("members: 1024", "members: 64}\ninfer: {method: glue", "Only 64 members will be simulated"),
        ("members: 1024", "members: 1000", "Note: 1000 members is no power of two; .* with 1024."),
        ("y: [0, 1.5], stems", "y: [0.1, 0.2], stems", "Patch p1 covers less than half of every cell that it touches"),
        (
            "y: [0, 1.5], stems",
            "y: [4, 9], stems",
            "Patch p1 of 20 m2 becomes 4 m2 of cells: it lies partly outside the grid, at y = 4 to 9 m, where the grid "
            "has -5 to 5 m; correct",
        ),
        (
            "stems: 22}\ninflows",
            "stems: 22}\n    - {name: p2, stand: reed, x: [13, 20], y: [0, 1], stems: 1}\ninflows",
            "Patch p1 loses 2 cells to patches listed after it",
        ),
        ("reed: {phi", "sedge: {phi: 1, canopy_height: 0.5}\n    reed: {phi", "Stand sedge grows in no patch"),
        ("beyond_slope_break: 0.2", "beyond_slope_break: 2", "Friction class bank holds in no cell"),
        ("level: 1.0}", "level: 1.0, plants: false}", "Parameter phi acts in no cell of any experiment"),
        ("n: n_b}", "n: n_b}\n    mud: {law: manning, n: 0.1}", "Friction class mud holds in no cell"),
        (
            "canopy_height: 0.8",
            "canopy_height: 1.3",
            "The canopy of reed, 1.3 m, reaches above the water of experiment low",
        ),
        ("canopy_height: 0.8", "canopy_height: h_d", "The canopy of reed, 0.717 to 1.38 m, may reach above the water"),
        ("k_s: 0.5", "k_s: 5", r"With k_s of class bank 5 m, water shallower than 0.54 m gets .* class: 50 % in low\."),
        ("outlet: {}", "outlet: {range: [4.01, 4.02]}", "The outlet holds no cell centre: no water can leave"),
        (
            "outlet: {}",
            "outlet: {range: [4, 5]}",
            "The outlet level of experiment low, 1 m, is below the bed there, 1.09 m",
        ),
        ("level: 1.0}", "level: -0.5}", "The outlet level of experiment low, -0.5 m, is below the bed there"),
        ("level: 1.0}", "level: 0.2}", "leaves at a Froude number of 1.3"),
        ("bed_slope: 0.001", "bed_slope: 0.2", "Experiment low is supercritical: on the slope of the floor, 0.2,"),
        ("level: 1.0}", "level: 2.0}", "Experiment low puts water on the side edges of the grid"),
        ("{side: west}", "{side: west, range: [4.01, 4.02]}", "Inflow upstream holds no cell centre"),
        ("outlet: {}", "outlet: {range: [4.26, 4.75]}", "The outlet holds no cell centre"),
        ("{side: west}", "{side: west, range: [4.26, 4.75]}", "Inflow upstream holds no cell centre"),
        ("{side: west}", "{side: west, range: [4.2, 5]}", "Inflow upstream lies above the water of experiment low"),
        ("{side: west}", "{side: south, range: [2, 6]}", "Inflow upstream lies above the water of experiment low"),
        ("members: 1024}", "members: 1024}\ninfer: {sigma: known}", None),
        (
            "discharge: 2.0, level: 1.0}",
            "discharge: 2.0, level: 1.0}\n  high: {discharge: 2, level: 1.1}",
            "Experiment high has no used observation",
        ),
        ("observations:\n  - {kind: velocity, file: velocities.csv}\n", "", "There are no observations"),
    ],
)
def test_an_oddity_is_said(tmp_path, old, new, expected):
    assert old in SOUND
    text = SOUND.replace(old, new)
    if "h_d" in new:
        text = text.replace(
            "parameters:\n", "parameters:\n  h_d: {distribution: uniform, low: 0.7, high: 1.4, unit: m}\n"
        )
    said = odd(tmp_path, text)
    if expected is None:
        assert said == []
    else:
        assert [sentence for sentence in said if re.search(expected, sentence)], said


@pytest.mark.parametrize(
    ("high", "depths"),
    [
        ("1.1", "reaches above the water of experiments low and high, about 1 to 1.1 m"),
        ("1.5", "experiment low, about 1 m"),
    ],
)
def test_a_canopy_above_the_water_is_said_once(tmp_path, high, depths):
    """It was said again of each experiment."""
    text = SOUND.replace("level: 1.0}", f"level: 1.0}}\n  high: {{discharge: 2.0, level: {high}}}")
    said = [one for one in odd(tmp_path, text.replace("height: 0.8", "height: 1.3")) if "The canopy of reed" in one]
    assert len(said) == 1
    assert depths in said[0]


def test_a_prior_in_another_unit_than_its_effect_is_said(tmp_path):
    prior = "  d: {distribution: uniform, low: -0.1, high: 0.1, unit: cm/s}\n"
    text = SOUND.replace("observations:", prior + "effects:\n  zero_offset: {values: {offset: d}}\nobservations:")
    assert [one for one in odd(tmp_path, text) if "`parameters.d` states cm/s, and `effects.zero_offset" in one]
    assert odd(tmp_path, text.replace("cm/s", "m/s")) == []


def test_stations_without_error_cannot_be_weighed_by_it(tmp_path):
    text = SOUND.replace("members: 1024}", "members: 1024}\ninfer: {sigma: known}")
    said = odd(tmp_path, text, ROWS.replace(",u_se", "").replace(",0.01\n", "\n"))
    (sentence,) = said
    assert sentence.startswith(
        "`infer`, `diagnose` and `run` will refuse this: no standard error is stated for 3 of vel"
    )


def test_too_few_observations_are_said(tmp_path):
    said = odd(tmp_path, rows="\n".join(ROWS.splitlines()[:2]) + "\n")
    assert said == ["1 used observations cannot settle 2 parameters."]


def test_the_papers_cases_are_sound_but_for_what_is_known():
    known = {
        "d0": ["Note: 5000 members", "With k_s of class bank up to 5 m"],
        "d3a": [
            "Note: 5000 members",
            "The station at x = 402, y = 6.4 m",
            "With k_s of class bank up to 5 m",
            "Stations of D3 at y = 4 and 5.5 m",
        ],
        "d3b": ["Note: 5000 members", "With k_s of class bank up to 5 m", "Stations of D3 at y = 4 m"],
        "d3b_paper": [
            "Note: 5000 members",
            "The verticals of D3",
            "With k_s of class bank up to 5 m",
            "Stations of D3 at y = 4 m",
        ],
    }
    for name, beginnings in known.items():
        case = load_case(CONFIGS / f"{name}.yaml")
        said = check_case(case, build_site(case), read_observations(case))
        assert len(said) == len(beginnings), said
        assert all(sentence.startswith(start) for sentence, start in zip(said, beginnings, strict=True)), said


def test_a_discharge_far_from_the_measured_one_is_said(tmp_path):
    (tmp_path / "other.yaml").write_text(
        f"extends: {CONFIGS / 'd3a.yaml'}\nexperiments: {{D3a: {{discharge: 3.2}}}}\n", encoding="utf-8"
    )
    case = load_case(tmp_path / "other.yaml")
    said = check_case(case, build_site(case), read_observations(case))
    assert [
        s
        for s in said
        if s.startswith("The velocities of 1 section in experiment D3a carry 0.83 times the stated discharge (D3, x = ")
        and "stated 3.2 m3/s" in s
    ]


@pytest.mark.parametrize(
    ("enters", "main", "said"),
    [("420, 422", 2.66, None), ("420, 422", 1.66, "1.66 m3/s"), ("20, 22", 1.66, None), ("400, 404", 1.66, None)],
)
def test_a_section_measures_what_has_entered_above_it(tmp_path, enters, main, said):
    (tmp_path / "other.yaml").write_text(
        f"extends: {CONFIGS / 'd3a.yaml'}\ninflows: {{stream: {{side: north, range: [{enters}]}}}}\n"
        f"experiments: {{D3a: {{discharge: {{upstream: {main}, stream: 1.0}}}}}}\n",
        encoding="utf-8",
    )
    case = load_case(tmp_path / "other.yaml")
    observations = read_observations(case)  # D3 lies at x = 402 m and tells 2.66 m3/s
    remarks = list(remarks_on_discharges(case, build_site(case), observations))
    assert bool(remarks) == bool(said)
    assert all("carry 1.6 times the" in one and f"stated {said}" in one for one in remarks)
    assert len(remarks) == bool(said)


def test_the_expected_water_is_parallel_to_the_floor_and_nowhere_below_the_outlet(tmp_path):
    odd(tmp_path)
    case = load_case(tmp_path / "sound.yaml")
    site = build_site(case)
    depth = expected_depth(case, site, case.experiments["low"])
    # z_out = 1 m over a floor at -0.0395 m in the last cell.
    assert depth.max(axis=1) == pytest.approx(1.0395)
    rising = site.__class__(site.grid, site.bed[::-1], site.friction_class, site.class_names, site.patch, site.cover)
    assert (rising.bed + expected_depth(case, rising, case.experiments["low"])).min() == pytest.approx(1.0)


@pytest.mark.parametrize(("x", "y", "expected"), [(1, 0.2, 0.2), (3, 2, 0.0), (-3, 4, 3.6055512754639896), (5, 1, 2.0)])
def test_distance_to_an_outline(x, y, expected):
    outline = np.array([[0, 0], [3, 0], [3, 2], [0, 2]], dtype=float)
    assert distance_to_outline(outline, x, y) == pytest.approx(expected)


@pytest.mark.filterwarnings("error")
def test_corners_that_coincide_are_measured_without_a_warning():
    outline = np.array([[0, 0], [3, 0], [3, 0], [3, 2], [0, 2], [0, 0]], dtype=float)
    assert distance_to_outline(outline, -3, 4) == pytest.approx(3.6055512754639896)


@pytest.mark.parametrize("name", ["d0", "d3a"])
def test_the_channel_is_drawn(tmp_path, name):
    case = load_case(CONFIGS / f"{name}.yaml")
    path = tmp_path / "new" / "channel.png"
    save_channel_figure(case, build_site(case), read_observations(case), path)
    assert path.read_bytes().startswith(b"\x89PNG")
    assert path.stat().st_size > 20_000


def test_a_bare_case_is_drawn_too(tmp_path):
    text = SOUND.replace("observations:\n  - {kind: velocity, file: velocities.csv}\n", "")
    text = (
        re.sub(r"plants:\n(  .*\n)+", "", text)
        .replace("  phi:", "  nu:")
        .replace("outlet:", "eddy_viscosity: nu\noutlet:")
    )
    text = text.replace("upstream: {side: west}", "upstream: {side: west}\n  side: {side: north, range: [5, 9]}")
    odd(tmp_path, text.replace("discharge: 2.0", "discharge: {upstream: 1, side: 1}"))
    case = load_case(tmp_path / "sound.yaml")
    save_channel_figure(case, build_site(case), read_observations(case), tmp_path / "channel.png")
    assert (tmp_path / "channel.png").stat().st_size > 10_000
