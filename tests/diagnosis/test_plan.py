"""What planned measurements would show: stations, hours, sizes and questions, on a small channel."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_case import SMALL

from vegglue.calibration.candidates import effect_entry
from vegglue.calibration.detection import trace_lengths
from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Planned
from vegglue.diagnosis.plan import after_survey, needed_evidence, plan_measurements, shown_by
from vegglue.diagnosis.plan_model import (
    PlanModel,
    bending_of,
    errors_at,
    plan_model,
    planned_pieces,
    possible_pieces,
    stations_of,
    verticals_at,
    with_chosen,
)
from vegglue.diagnosis.plan_search import NAMED_AT, plan_search
from vegglue.engine.interface import Model, linearise
from vegglue.errors import InputError
from vegglue.plain_json import plain
from vegglue.results.plan import EffectsInGeneral, FieldPlan, PlannedPiece, Work, hours_of, plan_json
from vegglue.workflow.case_run import CaseRun

PLANNED = """
model_error: {friction: 0.05, bed: 0.01}
planned:
  hours: 14
  transects: [{x: 9, spacing: 0.5}, {x: 16, spacing: 0.5, y: [-1.2, 1.3]}]
  gauges: [{x: 5}, {x: 30}]
  points: [{x: 12, y: 0.7}]
  errors: {velocity: 0.01}
  costs: {vertical: 0.2}
"""


def case_model(folder: Path, text: str) -> Model:
    path = folder / "small.yaml"
    path.write_text(SMALL + text, encoding="utf-8")
    return CaseRun(load_case(path)).model


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Model:
    return case_model(tmp_path_factory.mktemp("planned"), PLANNED)


@pytest.fixture(scope="module")
def found(model: Model) -> FieldPlan:
    return plan_measurements(model)


@pytest.fixture(scope="module")
def wide(model: Model) -> PlanModel:
    planned = model.case.planned
    assert planned is not None
    base = planned_pieces(model, planned)
    return plan_model(model, planned, model.station, base, possible_pieces(model, planned, model.station, base))


def test_verticals_stand_under_water_at_the_spacing(model: Model) -> None:
    places = np.array(verticals_at(model, "low", 9.0, 0.5))
    assert places == pytest.approx(np.arange(-2.5, 2.6, 0.5))  # 0.9 m deep, banks of 1 in 1.5: wet to 2.85 m
    assert verticals_at(model, "low", 16.0, 0.5, (-1.2, 1.3)) == pytest.approx((-1.2, -0.7, -0.2, 0.3, 0.8, 1.3))
    assert verticals_at(model, "low", 16.0, 0.5, (3.4, 3.9)) == ()


def test_hours_are_those_of_the_config(model: Model) -> None:
    assert model.case.planned is not None
    pieces = planned_pieces(model, model.case.planned)
    assert [one.work for one in pieces] == [Work.TRANSECT, Work.TRANSECT, Work.POINT, Work.GAUGE, Work.GAUGE]
    assert [one.hours for one in pieces] == pytest.approx([0.5 + 11 * 0.2, 0.5 + 6 * 0.2, 0.2, 0.5, 0.5])
    two = [replace(pieces[0], experiment=name) for name in ("low", "high")]
    assert hours_of(two, 4.0) == pytest.approx(2 * 2.7 + 4.0)
    assert hours_of(two, 4.0, frozenset({"mid"})) == pytest.approx(2 * 2.7 + 8.0)


def test_every_effect_has_a_size_and_a_plausible_one(found: FieldPlan) -> None:
    assert found.draws == 8
    assert not found.proposed
    assert found.hours == pytest.approx(sum(one.hours for one in found.pieces))
    by_name = {one.name: one for one in found.effects}
    for one in found.effects:
        assert one.best <= one.smallest
        assert one.best <= one.worst
        assert one.seen <= (one.chance_plausible >= 0.88)
        assert not (one.seen and one.hidden)
    assert by_name["discharge_error[low]"].testable
    # Plants bend: of one flow that is a change of their drag.
    assert by_name["streamlining"].hidden
    assert not by_name["streamlining"].testable
    # A canopy at one depth acts as another drag, and one patch alone as its own density.
    assert by_name["canopy_height_error"].confused[0].cosine > 0.99
    assert {one.name for one in found.parameters} == {"n_b", "phi"}
    assert all(one.after[0] > one.before[0] and one.after[1] < one.before[1] for one in found.parameters)


def test_what_is_added_is_ranked_by_its_gain_for_an_hour(found: FieldPlan) -> None:
    rates = [one.per_hour for one in found.further]
    assert rates == sorted(rates, reverse=True)
    assert all(one.before == found.answer < one.after for one in found.further)
    assert found.extended is not None
    assert found.extended.hours <= 14.0 - found.hours + 1e-9
    assert not any(one.new for one in found.extended.pieces)


@pytest.mark.parametrize(
    "question", [{"about": "bank_vegetation", "size": 0.03}, {"between": ("undergrowth", "foliage")}]
)
def test_a_question_has_a_chance_as_its_answer(model: Model, question: dict[str, object]) -> None:
    found = plan_measurements(model, **question)  # type: ignore[arg-type]
    assert 0.0 < found.answer <= 1.0
    assert found.further
    assert all(found.answer < one.after <= 1.0 for one in found.further)


@pytest.mark.parametrize(
    "question",
    [{"about": "wnd"}, {"size": 1.0}, {"about": "wind", "size": 1e6}, {"between": ("wind", "wind")},
     {"about": "wind", "between": ("wind", "elder")}],
)  # fmt: skip
def test_an_unknown_question_is_refused(model: Model, question: dict[str, object]) -> None:
    with pytest.raises(InputError):
        plan_measurements(model, **question)  # type: ignore[arg-type]


def test_without_anything_planned_a_first_set_fits_the_hours(tmp_path: Path) -> None:
    model = case_model(tmp_path, "planned: {hours: 6}\n")
    found = plan_measurements(model)
    assert found.proposed
    assert found.pieces
    assert found.hours <= 6.0 + 1e-9
    assert {one.experiment for one in found.pieces} == {"low"}
    assert len(found.testable) >= 10
    with pytest.raises(InputError, match="hours"):
        plan_measurements(case_model(tmp_path, "planned: {hours: 0.1}\n"))


def test_measurements_at_hand_are_a_plan_too(model: Model) -> None:
    planned = model.case.planned
    assert planned is not None
    table, _ = stations_of(model, planned, planned_pieces(model, planned), model.station)
    without = model.case.model_copy(update={"planned": None})
    found = plan_measurements(replace(model, case=without, station=table))
    assert found.at_hand == len(table)
    assert found.pieces == ()
    planned_ones = {one.name: one.smallest for one in plan_measurements(model).effects}
    assert {one.name: one.smallest for one in found.effects} == pytest.approx(planned_ones)


def test_sections_beside_a_decimetre_are_measured_together_in_another_flow(model: Model) -> None:
    planned = model.case.planned
    assert planned is not None
    table, _ = stations_of(model, planned, planned_pieces(model, planned), model.station)
    table = table.assign(x=table["x"] + 0.03)
    wide = plan_model(model, planned, table, [], possible_pieces(model, planned, table, []))
    none = np.zeros(len(wide.candidates))
    search = plan_search(wide, EffectsInGeneral(1), planned, needed_evidence(), frozenset(table["experiment"]), none)
    together = [[wide.pieces[j].x for j in move] for move in search.moves() if len(move) > 1]
    assert [9.0, 12.0, 16.0] in together


def test_a_set_is_worth_at_least_what_equally_spaced_transects_are(model: Model, wide: PlanModel) -> None:
    planned, none = model.case.planned, np.zeros(len(wide.candidates))
    assert planned is not None
    search = plan_search(wide, EffectsInGeneral(1), planned, needed_evidence(), frozenset(), none)
    budget, flows = 9.0, frozenset({"low"})
    chosen = search.best_set(budget)
    assert 0.0 < search.hours(chosen, frozenset()) <= budget + 1e-6
    spaced = search.equally_spaced(budget, flows)
    x = [sorted({wide.pieces[j].x for j in some}) for some in spaced]
    assert [len(some) for some in x] == list(range(1, len(x) + 1))
    assert x[1] == pytest.approx(np.array([1, 2]) * model.case.grid.x[1] / 3.0, abs=1.0)
    assert all(search.worth(chosen) >= search.worth(some) for some in spaced)
    squares = search.with_each([(j,) for j in chosen])
    alone = [search.base.made(search.rows_of([j])).squares for j in chosen]
    assert squares == pytest.approx(np.moveaxis(np.array(alone), 1, 0))


def test_a_trace_of_half_a_size_is_as_long_as_the_flow_with_it_says(wide: PlanModel) -> None:
    """Twice the viscosity does not change a flow twice as much: it is predicted at half a plausible size, where it was
    not computed. Effects on the bed are predicted to first order.
    """
    bending, draw = bending_of(wide), wide.draws[1]
    names = [one.name for one in wide.candidates]
    assert bending[names.index("floor_level_error")] == 0.0
    assert (bending >= 0.0).all()
    variance, nuisances = errors_at(wide, draw, wide.known)
    for name in ("mixing_length", "elder", "bank_vegetation"):
        one = wide.candidates[j := names.index(name)]
        value = one.amplitude.off + 0.5 * one.amplitude.scale
        entry = effect_entry(one, value, one.settings()[len(one.settings()) // 2])
        case = draw.model.case.model_copy(update={"effects": {**draw.model.case.effects, one.key: entry}})
        point = linearise(replace(draw.model, case=case), draw.point.z, draw.point)
        assert point is not None
        first_order = draw.values[wide.known, j] * one.amplitude.gain(value)
        change = (point.prediction - draw.point.prediction)[wide.known]
        linear, length = trace_lengths(variance, nuisances, np.column_stack([first_order, change]))
        assert length < 0.97 * linear
        assert linear / (1.0 + bending[j] * 0.5**one.amplitude.power) == pytest.approx(length, rel=0.12)


def test_a_line_of_bed_levels_makes_errors_smaller_as_conditioning_does(wide: PlanModel) -> None:
    lines = [rows for piece, rows in zip(wide.pieces, wide.rows, strict=True) if piece.work is Work.SURVEY_LINE]
    assert lines
    shared, known, rows = wide.draws[0].shared, wide.known, lines[3]
    after = after_survey(shared, known, rows, wide.error)
    across = shared[known] @ shared[rows].T
    inner = shared[rows] @ shared[rows].T + np.diag(wide.error[rows] ** 2)
    expected = shared[known] @ shared[known].T - across @ np.linalg.solve(inner, across.T)
    assert after @ after.T == pytest.approx(expected, abs=1e-12)


def test_the_bed_levels_of_a_line_have_the_stated_error(wide: PlanModel) -> None:
    rows = next(r for piece, r in zip(wide.pieces, wide.rows, strict=True) if piece.work is Work.SURVEY_LINE)
    spread = np.sqrt((wide.draws[0].shared[rows] ** 2).sum(axis=1))
    inner = spread[len(spread) // 4 : -len(spread) // 4]
    assert inner == pytest.approx(np.full(inner.size, 0.01), rel=0.35)


def test_a_short_trace_is_not_named_and_a_long_one_is_unless_it_is_mistaken(wide: PlanModel) -> None:
    shown = shown_by(wide)
    by_name = {one.name: chance for one, chance in zip(wide.candidates, shown.named, strict=True)}
    assert (shown.named[:, 0] == 0.0).all()
    assert (shown.named[:, NAMED_AT <= 2.0] < 0.3).all()
    # Far above its plausible size a cause is taken for what may be larger.
    rising = shown.named[:, NAMED_AT <= 4.0]
    assert (np.diff(rising, axis=1) > -0.05).all()
    assert by_name["discharge_error[low]"][NAMED_AT == 8.0] > 0.95
    assert (shown.beyond >= 0.0).all()


def test_what_is_chosen_is_as_if_it_had_been_planned(model: Model, wide: PlanModel) -> None:
    planned = model.case.planned
    assert planned is not None
    chosen = [j for j, one in enumerate(wide.pieces) if one.work is Work.TRANSECT and not one.again][:2]
    chosen += [next(j for j, one in enumerate(wide.pieces) if one.work is Work.SURVEY_LINE)]
    base = [*planned_pieces(model, planned), *(wide.pieces[j] for j in chosen)]
    again = plan_model(model, planned, model.station, base, possible_pieces(model, planned, model.station, base))
    extended = with_chosen(wide, chosen)
    assert {one.name for one in extended.candidates} == {one.name for one in again.candidates}
    one, other = shown_by(extended), shown_by(again)
    length = {name.name: size for name, size in zip(extended.candidates, one.lengths, strict=True)}
    for candidate, size in zip(again.candidates, other.lengths, strict=True):
        assert length[candidate.name] == pytest.approx(size, rel=1e-3, abs=1e-6)
    # More measurements make no trace shorter.
    before = shown_by(wide).lengths
    assert all((length[o.name] >= 0.999 * size).all() for o, size in zip(wide.candidates, before, strict=True))


def test_what_is_planned_changes_no_result(model: Model) -> None:
    assert case_hash(model.case) == case_hash(model.case.model_copy(update={"planned": None}))


def test_a_plan_is_an_object(found: FieldPlan) -> None:
    tree = json.loads(json.dumps(plain(plan_json(found)), allow_nan=False))
    assert tree["case"] == "small"
    assert len(tree["effects"]) == len(found.effects)
    assert {one["work"] for one in tree["pieces"]} == {"transect", "point", "gauge"}
    assert tree["question"]["kind"] == "effects_in_general"


@pytest.mark.parametrize(
    ("old", "new"),
    [("{x: 5}", "{x: 500}"), ("{x: 5}", "{x: 5, experiments: [flood]}"), ("spacing: 0.5}", "spacing: 0}"),
     ("x: 12, y: 0.7", "x: 12, y: 3.9")],
)  # fmt: skip
def test_places_and_experiments_that_are_not_there_are_refused(tmp_path: Path, old: str, new: str) -> None:
    def pieces_of(text: str) -> list[PlannedPiece]:
        model = case_model(tmp_path, text)
        return planned_pieces(model, model.case.planned or Planned())

    with pytest.raises(InputError, match="planned"):
        pieces_of(PLANNED.replace(old, new, 1))
