"""`vegglue check`: a sound case has no remark, one cause is one remark, and every remark has words."""

import re
from dataclasses import fields, is_dataclass
from pathlib import Path

import pytest
from built_models import model_of
from field_folders import CHANNEL, JUNE, folder_of
from sound_case import ROWS, SOUND, found_in, odd, read_case

import vegglue
from vegglue.calibration.baseline import baseline
from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.diagnosis import channel_check, effect_contract, flow_check, station_check
from vegglue.diagnosis.case_check import check_case, critical_remarks
from vegglue.diagnosis.channel_check import BankLawHeld, CanopyUnlikeMeasured, MembersNoPowerOfTwo, StationUnused
from vegglue.diagnosis.flow_check import ComponentsExchanged, FlowUpstream, LevelsRiseDownstream
from vegglue.diagnosis.station_check import PointsOutsideWater, StationsOnLand, StationsOnPatchEdge
from vegglue.errors import InputError
from vegglue.measurements import kinds, plausibility, section_discharge
from vegglue.measurements.kinds import Unused
from vegglue.measurements.observations import read_observations
from vegglue.measurements.plausibility import ImplausibleValues, Symptom
from vegglue.pages.channel import save_channel_figure
from vegglue.wording.sentences import macros, tag_of
from vegglue.workflow.case_run import CaseRun
from vegglue.workflow.check import critical_warnings

CONFIGS = Path(__file__).parents[2] / "configs"
BOTH = SOUND.replace("level: 1.0}", "level: 1.0}\n  high: {discharge: 2.2, level: 1.1}").replace(
    "k_s: 0.5", "k_s: 0.05"
)
COMPONENTS = BOTH.replace("velocities.csv}\n", "velocities.csv}\n  - {kind: velocity_across, file: across.csv}\n")


def test_a_sound_case_is_passed_in_silence(tmp_path):
    assert odd(tmp_path) == []


def test_every_remark_has_words_for_all_its_values():
    """One that no test renders would end a check in a KeyError."""
    modules = (channel_check, flow_check, station_check, effect_contract, plausibility)
    remarks = {
        one
        for module in modules
        for one in vars(module).values()
        if isinstance(one, type) and is_dataclass(one) and one.__module__ == module.__name__
    } - {plausibility.PlausibleFlow, effect_contract.Trial}
    for one in {*remarks, section_discharge.DischargeMismatch, kinds.UnstatedErrors}:
        assert tag_of(object.__new__(one)) in macros(), one
        assert one.__dataclass_params__.frozen
        assert "kind" not in {field.name for field in fields(one)}, "`tagged` writes the class there"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("d0", [MembersNoPowerOfTwo, BankLawHeld]),
        ("d3a", [MembersNoPowerOfTwo, StationUnused, BankLawHeld, StationsOnPatchEdge]),
        ("d3b", [MembersNoPowerOfTwo, BankLawHeld, StationsOnPatchEdge]),
        ("d3b_paper", [MembersNoPowerOfTwo, CanopyUnlikeMeasured, BankLawHeld, StationsOnPatchEdge]),
    ],
)
def test_shipped_cases_are_sound_but_for_what_is_known(name, expected):
    case = load_case(CONFIGS / f"{name}.yaml")
    found = check_case(case, build_site(case), read_observations(case))
    assert [type(one) for one in found] == expected
    assert found_in(found, BankLawHeld, friction_class="bank", k_s=5.0, up_to=True)
    assert not found_in(found, StationUnused) or found_in(found, StationUnused, x=402.0, y=6.4)
    edges = {"d3a": (4.0, 5.5), "d3b": (4.0,), "d3b_paper": (4.0,)}
    assert name not in edges or found_in(found, StationsOnPatchEdge, section="D3", y=edges[name])


def table(column: str, value: float) -> str:
    """Two sections in both experiments, in which everything reads about as much."""
    places = [(x, y) for x in (20, 30) for y in (-1.5, -0.5, 0.5, 1.5)]
    rows = "".join(f"{name},A{x},{x},{y},{value + 0.01 * y:g},0.01\n" for name in ("low", "high") for x, y in places)
    return f"experiment,section,x,y,{column},{column}_se\n{rows}"


def test_exchanged_components_are_one_remark(tmp_path):
    """Water that runs upstream, too slowly and with another discharge follows from it."""
    (tmp_path / "across.csv").write_text(table("v", 0.33))
    case, site, observations = read_case(tmp_path, COMPONENTS, table("u", -0.005))
    (one,) = found = check_case(case, site, observations)
    assert found_in(found, ComponentsExchanged, experiments=("low", "high"), across=0.33)
    assert critical_remarks(case, site, observations) == [one]


def test_a_stream_reversed_is_one_remark(tmp_path):
    (one,) = odd(tmp_path, BOTH, table("u", -0.33))
    assert found_in([one], FlowUpstream, experiments=("low", "high"), median=-0.33, on_centreline=False)


def with_gauges(folder: Path, middle: float) -> list[object]:
    """Remarks on verticals of points with a gauge in the middle that reads so much in both experiments [m]."""
    (folder / "levels.csv").write_text(
        "experiment,section,x,y,level,level_se\n"
        + "".join(
            f"{name},G{x},{x},0,{z},0.002\n"
            for name, surface in (("low", 1.0), ("high", 1.1))
            for x, z in ((2, surface + 0.02), (20, surface + middle), (38, surface))
        )
    )
    points = "".join(
        f"s{x},{name},{x},{y},{z},{0.34 + 0.1 * z:g},0.01\n"
        for name in ("low", "high") for x in (20, 26) for y in (-1.5, -0.5, 0.5, 1.5) for z in (0.2, 0.4, 0.6, 0.8)
    )  # fmt: skip
    entries = "".join(
        f"  - {{kind: adv, file: {name}.csv, experiment: {name}, section: s{x}, case: s{x}, average: profile}}\n"
        for name in ("low", "high") for x in (20, 26)
    )  # fmt: skip
    for name in ("low", "high"):
        own = "".join(row + "\n" for row in points.splitlines() if f",{name}," in row)
        (folder / f"{name}.csv").write_text("case,device,x,y,height,u,u_se\n" + own)
    levels = "  - {kind: level, file: levels.csv}\n"
    return odd(folder, BOTH.replace("  - {kind: velocity, file: velocities.csv}\n", entries + levels))


def test_gauges_that_agree_raise_no_question(tmp_path):
    assert with_gauges(tmp_path, 0.01) == []


@pytest.mark.parametrize("middle", [-0.7, -0.4])
def test_a_wrong_gauge_is_one_remark_and_one_on_the_points_that_it_loses(tmp_path, middle):
    """Not one remark of each experiment and section; the second points at the first."""
    first, second = with_gauges(tmp_path, middle)
    if middle == -0.7:
        places = (("low", "G20"), ("high", "G20"))
        assert isinstance(first, ImplausibleValues)
        assert (first.symptom, first.count, first.places) == (Symptom.LOW, 2, places)
    else:
        found = found_in([first], LevelsRiseDownstream, experiments=("low", "high"), first=20.0, last=38.0)
        assert found[0].rises == pytest.approx((0.4, 0.4))
    assert found_in([second], PointsOutsideWater, reason=Unused.ABOVE_SURFACE, levels_doubted=True)
    assert (second.sections, second.experiments) == (("s20", "s26"), ("low", "high"))


@pytest.mark.parametrize(("dry", "doubtful"), [(3, True), (1, False)])
def test_a_survey_on_land_is_a_warning_of_every_command(tmp_path, dry, doubtful):
    """`run` took 12 velocities on dry banks for measurements, all of them "in use", and named what may be missing."""
    places = [*((12, 3.6 + 0.1 * n) for n in range(dry)), (12, 0.0), (12, 1.0)]
    rows = "\n".join(["x,y,u,u_se", *(f"{x},{y},0.4,0.02" for x, y in places)])
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=rows), tmp_path / "brook.yaml")
    assert bool(found_in(critical_warnings(CaseRun(case)), StationsOnLand)) == doubtful
    remarks = vegglue.check(case, runs=tmp_path / "runs").remarks
    assert [one.most for one in found_in(remarks, StationsOnLand)] == [doubtful]


@pytest.mark.slow
def test_a_model_without_any_flow_is_refused(tmp_path):
    case, _, observations = read_case(tmp_path, SOUND.replace("level: 1.0}", "level: -0.5}"))
    with pytest.raises(InputError, match=r"sound: .*`vegglue check`"):
        baseline(model_of(case, observations))


@pytest.mark.parametrize("name", ["d0", "d3a"])
def test_the_channel_is_drawn(tmp_path, name):
    case = load_case(CONFIGS / f"{name}.yaml")
    path = tmp_path / "new" / "channel.png"
    save_channel_figure(case, build_site(case), read_observations(case), path)
    assert path.read_bytes().startswith(b"\x89PNG")
    assert path.stat().st_size > 20_000


def test_a_bare_case_is_drawn_too(tmp_path):
    text = SOUND.replace("observations:\n  - {kind: velocity, file: velocities.csv}\n", "")
    text = re.sub(r"plants:\n(  .*\n)+", "", text).replace("  phi:", "  nu:")
    text = text.replace("outlet:", "eddy_viscosity: nu\noutlet:")
    text = text.replace("upstream: {side: west}", "upstream: {side: west}\n  side: {side: north, range: [5, 9]}")
    case = read_case(tmp_path, text.replace("discharge: 2.0", "discharge: {upstream: 1, side: 1}"), ROWS)
    save_channel_figure(*case, tmp_path / "channel.png")
    assert (tmp_path / "channel.png").stat().st_size > 10_000
