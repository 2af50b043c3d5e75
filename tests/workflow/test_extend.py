"""Child configs: what they add, what is read back, what cannot be added; what a diagnosis asks to be added."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnoses import a_candidate_effect, a_diagnosis, a_patch, an_instrument, candidate_laws_of
from linear_baseline import stations_of
from reach import Say
from surveyed_twin import surveyed_twin

from vegglue.calibration.candidates import candidates_in_case, candidates_of, with_effect
from vegglue.calibration.model_error import EFFECT_AT_PLACE
from vegglue.case.bed import bed_levels, read_bed_survey
from vegglue.case.bed_error import surveyed_lines
from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Case
from vegglue.case.survey_error import bed_survey_text, line_offsets
from vegglue.diagnosis.child_config import candidate_at, candidate_named, spread_over_its_error, with_additions
from vegglue.diagnosis.stepwise_choice import (
    Addition,
    Choice,
    HeldOutErrorsDidNotFall,
    UnclearFall,
    found_additions,
    in_doubt,
    nominees,
    tried_additions,
    values_found,
    values_tried,
)
from vegglue.flow.local_changes import Term
from vegglue.measurements.observations import read_observations
from vegglue.results.causes import LocalAnomaly, Step
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.result_files import write_diagnosis
from vegglue.wording.sentences import sentence
from vegglue.workflow.extend import (
    ExtensionReason,
    extend,
    extension_reason,
    without_levels,
    write_child,
    write_relevelled,
)

ROOT = Path(__file__).parents[2]


def test_a_child_says_what_it_adds_and_reads_back(tmp_path: Path) -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    station = read_observations(case).table
    added = [(candidate_named(case, station, "discharge_error[high]"), {})]
    child = write_child(case, tmp_path / "child.yaml", added)
    assert child.name == "twin-discharge_error_high"
    assert child.effects["discharge_error_high"].experiments == ("high",)
    assert set(child.parameters) - set(case.parameters) == {"discharge_error_high_relative_error"}
    assert child.observations == case.observations


def test_a_name_that_is_given_twice_is_added_once(tmp_path: Path) -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    added = ("streamlining", ["streamlining"], ["streamlining", "streamlining"])
    names = [extend(case, one, to=tmp_path / f"{number}.yaml").name for number, one in enumerate(added)]
    assert names == ["twin-streamlining"] * 3


def test_an_entry_of_a_case_says_which_candidate_it_was() -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    station = read_observations(case).table
    every = candidates_of(case, station)
    assert {one.effect.each for one in every} >= {"case", "experiment", "section"}
    for one in every:
        assert candidates_in_case(with_effect(case, one, {})) == {one.key: one}
        assert candidate_named(case, station, one.name) == one


def test_a_candidate_is_found_by_its_name_whatever_else_has_that_name() -> None:
    """A section called as an experiment or a patch is: its probe was said of all sections of the experiment, and the
    density of the patch to act nowhere.
    """
    case = load_case(ROOT / "configs" / "twin.yaml")
    station = stations_of(case, ("low", "p1", "left, 2", "b]"), 2)
    for one in candidates_of(case, station):
        assert candidate_named(case, station, one.name) == one


def a_place(term: Term, x: float = 47.29, y: float = -0.29) -> LocalAnomaly:
    return LocalAnomaly(x, y, 1.8, 0.45, term, EFFECT_AT_PLACE[term], 0.19, (0.14, 0.24), "m", 5.0, ("low",), {}, 0.23)


def at_places(case: Case, *places: LocalAnomaly) -> list[Addition]:
    return [(candidate_at(case, place), place.shapes) for place in places]


@pytest.mark.parametrize(
    "place", [*map(a_place, EFFECT_AT_PLACE), a_patch(x=47.29, y=-0.29)], ids=lambda one: one.effect
)
def test_a_child_holds_a_place_with_numbers_and_a_plausible_prior(place: LocalAnomaly, tmp_path: Path) -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    child = write_child(case, tmp_path / "child.yaml", at_places(case, place))
    key = f"{place.effect}_x47_29_y_0_29"
    parameter = next(iter(set(child.parameters) - set(case.parameters)))
    entry = child.effects[key]
    assert entry.effect == place.effect
    assert {name: entry.values[name] for name in place.shapes} == place.shapes
    assert parameter in entry.values.values()
    assert child.parameters[parameter].sd == place.plausible
    assert child.parameters[parameter].mean == 0.0


def test_two_spots_of_one_kind_are_two_effects(tmp_path: Path) -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    added = at_places(case, a_place("bed"), a_place("bed", x=60.0, y=0.5))
    child = write_child(case, tmp_path / "child.yaml", added)
    assert list(child.effects) == ["unlisted_bed_x47_29_y_0_29", "unlisted_bed_x60_y0_5"]
    assert len(set(child.parameters) - set(case.parameters)) == 2


def test_what_is_tried_is_the_child_that_is_written(tmp_path: Path) -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    added = at_places(case, a_place("inflow"))
    child, tried = write_child(case, tmp_path / "child.yaml", added), with_additions(case, added)
    assert (tried.name, tried.effects, tried.parameters) == (child.name, child.effects, child.parameters)
    assert case_hash(tried) == case_hash(child)


def found_in(case: Case, kind: str, *, order: tuple[str, ...] = (), place: bool = False) -> Diagnosis:
    """A diagnosis of that verdict; order: parameters of its last model."""
    step = Step("streamlining", ("streamlining",), (1.0,), (("streamlining",),), 900.0, 250.0, 0.0)
    found = a_diagnosis(
        candidate_effects=(a_candidate_effect("streamlining"),), steps=(step,) if order else (), verdict={"kind": kind},
        parameters={"last": dict.fromkeys((*case.parameters, *order), (1.0, 0.9, 1.1))},
        predictions={"station": read_observations(case).table},
    )  # fmt: skip
    return replace(found, places=(a_place("bed"),) if place else ())


def test_a_place_is_spread_over_where_it_may_lie() -> None:
    """A spot whose middle errs by a normal has a wider and lower one as its mean; as much as before is there."""
    place = replace(a_place("bed"), x_spread=3.0, y_spread=0.2)
    spread, u = spread_over_its_error(place), np.linspace(-30.0, 30.0, 2001)
    middles = 3.0 * np.random.default_rng(1).standard_normal(4000)
    mean = place.amplitude * np.exp(-(((u[:, None] - middles) / place.length) ** 2)).mean(axis=1)
    across = place.width / spread.width
    assert spread.amplitude * np.exp(-((u / spread.length) ** 2)) == pytest.approx(across * mean, abs=0.003)
    assert spread.plausible / place.plausible == pytest.approx(spread.amplitude / place.amplitude)
    assert spread_over_its_error(a_place("bed")) == a_place("bed")


def test_water_that_enters_stays_as_much_where_it_is_spread() -> None:
    place = replace(a_place("inflow"), x_spread=3.0)
    assert spread_over_its_error(place).amplitude == place.amplitude


def test_a_place_that_was_found_is_added_as_it_is_spread() -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    found = found_in(case, "none-of-these", order=("unlisted_bed_x47_29_y_0_29_rise",), place=True)
    found = replace(found, places=(replace(a_place("bed"), x_spread=3.0),))
    ((candidate, shapes),) = [one for one in found_additions(case, found) if one[0].name != "streamlining"]
    assert shapes["length"] == dict(candidate.fixed)["length"] == pytest.approx(np.hypot(1.8, 3.0 * 2**0.5), abs=0.01)
    values = values_found(case, found)
    assert values[candidate.parameter] == pytest.approx(1.8 / shapes["length"])  # 1.0 in `found_in`
    ((name, length, width),) = extension_reason(case, found, Choice(((), (candidate.name,)), {})).spread
    assert (name, length, width) == (candidate.name, shapes["length"], shapes["width"])


def test_a_place_that_is_added_by_name_is_as_the_diagnosis_found_it(tmp_path: Path) -> None:
    """It had the default size under the name of the one that was found; what is given by hand holds."""
    case, name = load_case(ROOT / "configs" / "twin.yaml"), "unlisted_bed[x47.29,y-0.29]"
    found, key = replace(a_diagnosis(), places=(a_place("bed"),)), "unlisted_bed_x47_29_y_0_29"
    (tmp_path / case.name).mkdir()
    write_diagnosis(tmp_path / case.name / "diagnosis.h5", found, "", case_hash(case))
    known = extend(case, name, to=tmp_path / "known.yaml", runs=tmp_path).effects[key].values
    given = extend(case, name, shapes={"length": 0.7}, to=tmp_path / "given.yaml", runs=tmp_path).effects[key].values
    unknown = extend(case, name, to=tmp_path / "unknown.yaml", runs=tmp_path / "none").effects[key].values
    assert [(one["length"], one["width"]) for one in (known, given)] == [(1.8, 0.45), (0.7, 0.45)]
    assert unknown["length"] == 0.45, "0.3 half widths of the floor"


@pytest.mark.parametrize("turn", [1, -1])
def test_effects_and_places_are_tried_in_the_order_found(turn: int) -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    names = ["streamlining", "unlisted_bed[x47.29,y-0.29]"][::turn]
    order = ("streamlining_vogel_exponent", "unlisted_bed_x47_29_y_0_29_rise")[::turn]
    found = found_in(case, "none-of-these", order=order, place=True)
    assert [candidate.parameter for candidate, _ in found_additions(case, found)] == list(order)
    assert [candidate.name for candidate, _ in found_additions(case, found)] == names


@pytest.mark.parametrize(
    ("kind", "chance", "tried"), [("one-of", 0.76, 2), ("one-of", 0.1, 1), ("cannot-tell", 0.1, 2)]
)
def test_a_place_likelier_than_an_effect_is_tried_after_it_in_doubt_any_other(
    kind: str, chance: float, tried: int
) -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    found = found_in(case, kind, order=("streamlining_vogel_exponent",))
    place, name = replace(a_place("bed"), x_spread=3.0), "unlisted_bed[x47.29,y-0.29]"
    step = replace(found.steps[0], chances=(0.24,), others={name: chance}, places={name: place})
    found = replace(found, steps=(step,))
    names = [candidate.name for candidate, _ in tried_additions(case, found)]
    assert names == ["streamlining", name][:tried]
    assert [candidate.name for candidate, _ in found_additions(case, found)] == ["streamlining"]
    sizes = set(values_tried(case, found)) - set(values_found(case, found))
    assert sizes == {"unlisted_bed_x47_29_y_0_29_rise"} if tried == 2 else not sizes
    reason = extension_reason(case, found, Choice(((), (name,)), {"streamlining": HeldOutErrorsDidNotFall()}))
    assert [one for one, _, _ in reason.spread] == [name][: tried - 1]


@pytest.mark.parametrize("kind", ["nothing-missing", "instrument", "none-of-these", "cannot-tell"])
def test_the_verdict_is_why_nothing_is_added(kind: str) -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    found = found_in(case, kind)
    assert found_additions(case, found) == []
    assert extension_reason(case, found, Choice(((),), {})) == ExtensionReason((), kind)


def test_what_acts_in_one_experiment_or_section_says_so() -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    for name, only_in in (("discharge_error[high]", {"experiments": "high"}), ("probe_gain[B]", {"sections": "B"})):
        found = found_in(case, "identified", order=("",))
        step = replace(found.steps[0], accepted=name, rivals=(name,), chances=(1.0,), groups=((name,),))
        found = replace(found, steps=(step,), candidate_effects=(a_candidate_effect(name),))
        (one,) = nominees(case, found)
        assert one.only_in == only_in
    (one,) = nominees(case, found_in(case, "identified", order=("streamlining_vogel_exponent",)))
    assert one.only_in == {}


def test_a_law_that_stands_out_is_left_to_discover() -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    found = replace(found_in(case, "none-of-these"), laws=candidate_laws_of("law_bank_speed_step"))
    assert extension_reason(case, found, Choice(((),), {})).nothing == "law"
    unlikely = replace(found, verdict=replace(found.verdict, kind="cannot-tell"))
    assert extension_reason(case, unlikely, Choice(((),), {})).nothing == "cannot-tell"


def test_doubt_is_a_verdict_that_cannot_tell() -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    assert in_doubt(found_in(case, "cannot-tell"))
    assert not in_doubt(found_in(case, "identified"))


def test_what_is_not_kept_and_what_is_unclear_are_reported() -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    choice = Choice(((), ("a",)), {"b": HeldOutErrorsDidNotFall()}, {"a": UnclearFall((("sections", 2e-5, 4e-4),))})
    reason = extension_reason(case, found_in(case, "identified"), choice)
    assert (reason.added, reason.refused, reason.unclear) == (("a",), choice.refused, choice.unclear)
    assert sentence(reason)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--add", "streamlning"), "did you mean `streamlining`?"),
        (("--add", "discharge_error[none]"), "acts nowhere"),
        (("--add", "streamlining[p1]"), "acts nowhere: expected names of experiments (low, mid, high), got p1"),
        (("--add", "patch_density[p1,p2]"), "expected one patch, got 2"),
        (("--add", "unlisted_object[x1.2.3,y0]"), "expected a place such as"),
        (("--add", "streamlining", "--shape", "width=2"), "`width` is no shape"),
        ((), "either --auto or --add EFFECT, got neither; give one"),
        (("--auto", "--add", "wind"), "got both; give one"),
        (("--auto", "--to", "child.yaml"), "expected --to with --add only, got it with --auto"),
        (("--auto", "--shape", "width=2"), "expected --shape with --add only, got it with --auto"),
    ],
)
def test_what_cannot_be_added_is_refused(
    tmp_path: Path,
    say: Say,
    arguments: tuple[str, ...],
    said: str,
) -> None:
    code, error = say("extend", ROOT / "configs" / "twin.yaml", *arguments, "--runs", tmp_path)
    assert code == 2
    assert said in error


def test_a_line_at_a_wrong_level_is_taken_out_of_the_bed_of_a_child(tmp_path: Path) -> None:
    """The child reads back with the bed of the survey without that level; a line that it lacks already is left."""
    model, _ = surveyed_twin(tmp_path)
    case, grid, survey = model.case, model.site.grid, model.case.bed[0].survey
    assert survey is not None
    read = read_bed_survey(survey.file)
    read.points[read.lines[1], 2] += 0.1
    survey.file.write_text(bed_survey_text(read), encoding="utf-8")
    line = surveyed_lines(case, grid).lines[0]
    off = an_instrument(kind="line", x=line.x, y=line.y, stations=(), offset=0.12, unit="m")
    found = replace(a_diagnosis(), instruments=(off,))
    relevelled = without_levels(case, grid, found)
    child = write_relevelled(case, relevelled, tmp_path / "child.yaml")
    assert child.bed == relevelled.bed
    offset = line_offsets(read, survey.covariances)[0][1]
    assert offset == pytest.approx(0.1, abs=0.02)
    moved = (bed_levels(child, grid) - bed_levels(case, grid)).ravel()
    assert moved == pytest.approx(-offset * surveyed_lines(case, grid).weights[:, 0], abs=1e-3)
    assert line.number not in [one.number for one in surveyed_lines(child, grid).lines]
    assert without_levels(child, grid, found) is child
    assert without_levels(case, grid, a_diagnosis()) is case
